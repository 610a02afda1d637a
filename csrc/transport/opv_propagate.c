/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Depths carried outwards from their sources, brick by brick. docs/methods/opv.md. */
#include "base/result.h"
#include "transport/opv_ways.h"

#include <stdlib.h>

/* Groups whose list is on the GPU at once, and that a dispatch may have; sources beyond wait for
 * the next. */
#define GROUPS_AT_ONCE 65535

_Static_assert(BRICK_NODES % GROUP_LANES == 0 && BRICK_NODES % GROUP_CELLS == 0,
               "a brick is of whole groups");

/* At most so many groups has a lattice, wherever the light is. */
static size_t groups_of(const ivec4 *dims)
{
    return ((size_t)dims->x / GROUP_LANES + 2) * ((size_t)dims->y / GROUP_CELLS + 2) *
           ((size_t)dims->z / GROUP_CELLS + 2);
}

uint64_t opv_propagate_bytes(const ivec4 *dims, uint32_t sources)
{
    const size_t groups = groups_of(dims), listed = groups * sources;
    return sizeof(ivec4) * (uint64_t)(listed < GROUPS_AT_ONCE   ? listed
                                      : groups < GROUPS_AT_ONCE ? GROUPS_AT_ONCE
                                                                : groups);
}

/* Along an axis the lattice is cut into groups, at both sides of the light. Their level is how many
 * bricks the light passes before. */
struct axis_groups {
    int origin, nodes, side; /* side: nodes along a group */
};

#define NO_GROUP INT32_MIN

/* The first node of the group that begins so many steps from the light, on either side. */
static int group_first(const struct axis_groups *axis, int steps, int below)
{
    if (below)
        return axis->origin - steps >= 0 ? axis->origin - steps - (axis->side - 1) : NO_GROUP;
    return axis->origin + 1 + steps < axis->nodes ? axis->origin + 1 + steps : NO_GROUP;
}

static int steps_of(const struct axis_groups *axis)
{
    const int above = axis->nodes - 1 - axis->origin, below = axis->origin + 1;
    return above > below ? above : below;
}

static void cut_axes(const struct opv_work *run, uint32_t source, const struct program *program,
                     struct axis_groups axes[3])
{
    const int *nodes = &run->input->frame->lattice_dims.x;
    const int *origin = &run->sources[source].node.x;
    for (int i = 0; i < 3; ++i)
        axes[i] = (struct axis_groups){origin[i], nodes[i], program->group[i]};
}

/* Appends a source's groups of one level to out, unless it is NULL; their number. */
static size_t list_level(const struct axis_groups axes[3], int level, int source, ivec4 *out)
{
    size_t count = 0;
    for (int x = 0; x < steps_of(&axes[0]); x += axes[0].side)
        for (int y = 0; y < steps_of(&axes[1]); y += axes[1].side) {
            const int brick = (level - x / BRICK_NODES - y / BRICK_NODES) * BRICK_NODES;
            for (int z = brick; z < brick + BRICK_NODES && z >= 0; z += axes[2].side)
                for (int sides = 0; sides < 8; ++sides) {
                    const ivec4 group = {group_first(&axes[0], x, sides & 1),
                                         group_first(&axes[1], y, sides & 2),
                                         group_first(&axes[2], z, sides & 4), source};
                    if (group.x == NO_GROUP || group.y == NO_GROUP || group.z == NO_GROUP)
                        continue;
                    if (out)
                        out[count] = group;
                    ++count;
                }
        }
    return count;
}

/* The groups of some sources, level by level. */
struct group_list {
    ivec4 *groups;
    size_t *first; /* levels + 1 */
    int levels;
};

static brume_result list_groups(const struct opv_work *run, const struct program *program,
                                uint32_t from, uint32_t end, struct group_list *list)
{
    struct axis_groups axes[3];
    for (uint32_t i = from; i < end; ++i) {
        cut_axes(run, i, program, axes);
        int levels = 1;
        for (int axis = 0; axis < 3; ++axis)
            levels += (steps_of(&axes[axis]) - 1) / BRICK_NODES;
        list->levels = levels > list->levels ? levels : list->levels;
    }
    list->first = calloc((size_t)list->levels + 1, sizeof *list->first);
    if (!list->first)
        return fail(BRUME_E_MEMORY, "no memory to order a lattice");
    for (int pass = 0; pass < 2; ++pass) {
        size_t count = 0;
        for (int level = 0; level < list->levels; ++level) {
            for (uint32_t i = from; i < end; ++i) {
                cut_axes(run, i, program, axes);
                count +=
                    list_level(axes, level, (int)i, list->groups ? list->groups + count : NULL);
            }
            list->first[level + 1] = count;
        }
        if (pass == 0)
            list->groups = malloc((count + 1) * sizeof *list->groups);
        if (!list->groups)
            return fail(BRUME_E_MEMORY, "no memory to order a lattice");
    }
    return BRUME_OK;
}

static brume_result run_levels(struct opv_work *run, const struct program *program,
                               const struct group_list *list, uint32_t from, uint32_t end)
{
    const struct transport_input *input = run->input;
    TRY(buffer_update(&input->gpu->memory, &run->groups, FOR_TRANSPORT,
                      list->first[list->levels] * sizeof *list->groups, list->groups,
                      "depth groups"));
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, SLOT_DEPTH_GROUPS, run->groups.id);
    glBindTextureUnit(SLOT_DEPTH_BEFORE, run->texture->id);
    opv_bind_image(run->texture);
    for (int level = 0; level < list->levels; ++level) {
        const size_t count = list->first[level + 1] - list->first[level];
        const float part = (float)(end - from) * (float)level / (float)list->levels;
        ASSERT(count <= GROUPS_AT_ONCE);
        TRY(opv_go_on(run, ((float)from + part) / (float)run->count));
        TRY(opv_set_pass(run, (struct gpu_lattice_pass){.offset = {(int)list->first[level]}}));
        program_dispatch(program, (int)count * program->group[0], 1, 1);
        /* What this level wrote, the next reads. */
        glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    }
    return BRUME_OK;
}

/* Work grows with the nodes: every one is computed once a source. */
brume_result opv_propagate(struct opv_work *run)
{
    const struct program *program;
    TRY(program_compute(&run->input->gpu->programs, "opv_propagate", &program));
    const size_t groups = groups_of(&run->input->frame->lattice_dims);
    const uint32_t most = groups < GROUPS_AT_ONCE ? (uint32_t)(GROUPS_AT_ONCE / groups) : 1;
    brume_result result = BRUME_OK;
    for (uint32_t from = 0; from < run->count && result == BRUME_OK; from += most) {
        const uint32_t end = from + most < run->count ? from + most : run->count;
        struct group_list list = {0};
        result = list_groups(run, program, from, end, &list);
        if (result == BRUME_OK)
            result = run_levels(run, program, &list, from, end);
        free(list.first);
        free(list.groups);
    }
    return result;
}
