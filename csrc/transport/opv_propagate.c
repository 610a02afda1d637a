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

/* Along an axis the lattice is cut into pieces, outwards from the light on both its sides. */
struct axis {
    int origin, side; /* side: nodes along a piece */
    int below, count; /* pieces before the light, and all */
};

struct piece {
    int first; /* node */
    int level; /* how many bricks the light passes before */
};

static struct axis cut_axis(int nodes, int origin, int side)
{
    const int below = (origin + side) / side, above = (nodes - 2 - origin + side) / side;
    return (struct axis){origin, side, below, below + above};
}

static struct piece piece_of(const struct axis *axis, int number)
{
    const int is_below = number < axis->below;
    const int steps = (is_below ? number : number - axis->below) * axis->side;
    return (struct piece){is_below ? axis->origin - steps - (axis->side - 1)
                                   : axis->origin + 1 + steps,
                          steps / BRICK_NODES};
}

/* The groups of some sources, level by level. */
struct group_list {
    ivec4 *groups;
    size_t *first; /* of each level, and where the last ends */
    int levels;
};

/* Counts a source's groups in places[level], or lists them at these places and moves them on. */
static void list_source(const struct opv_work *run, uint32_t source, const struct program *program,
                        size_t *places, ivec4 *groups)
{
    const int *nodes = &run->input->frame->lattice_dims.x;
    const int *origin = &run->sources[source].node.x;
    struct axis axes[3];
    for (int i = 0; i < 3; ++i)
        axes[i] = cut_axis(nodes[i], origin[i], program->group[i]);
    for (int i = 0; i < axes[0].count; ++i)
        for (int j = 0; j < axes[1].count; ++j)
            for (int k = 0; k < axes[2].count; ++k) {
                const struct piece x = piece_of(&axes[0], i), y = piece_of(&axes[1], j),
                                   z = piece_of(&axes[2], k);
                size_t *place = &places[x.level + y.level + z.level];
                if (groups)
                    groups[*place] = (ivec4){x.first, y.first, z.first, (int)source};
                ++*place;
            }
}

static brume_result list_groups(const struct opv_work *run, const struct program *program,
                                uint32_t from, uint32_t end, struct group_list *list)
{
    const ivec4 dims = run->input->frame->lattice_dims;
    list->levels = 1 + (dims.x - 1) / BRICK_NODES + (dims.y - 1) / BRICK_NODES +
                   (dims.z - 1) / BRICK_NODES;
    list->first = calloc((size_t)list->levels + 2, sizeof *list->first);
    if (!list->first)
        return fail(BRUME_E_MEMORY, "no memory to order a lattice");
    /* Two places on, so that the second pass, which moves a level's first on to its end, leaves it
     * where the next begins. */
    for (uint32_t i = from; i < end; ++i)
        list_source(run, i, program, list->first + 2, NULL);
    for (int level = 0; level < list->levels; ++level)
        list->first[level + 2] += list->first[level + 1];
    list->groups = malloc((list->first[list->levels + 1] + 1) * sizeof *list->groups);
    if (!list->groups)
        return fail(BRUME_E_MEMORY, "no memory to order a lattice");
    for (uint32_t i = from; i < end; ++i)
        list_source(run, i, program, list->first + 1, list->groups);
    while (list->first[list->levels - 1] == list->first[list->levels])
        --list->levels; /* how many there are, the place of the light decides */
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
