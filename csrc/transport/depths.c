/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Optical depths: propagated, marched, or gathered as in the paper. docs/methods/opv.md. */
#include "transport/depths.h"
#include "base/result.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Samples whose transmittances are averaged for a light with extent; at most 8 (opv_merge). */
#define EXTENDED_SAMPLES 4
/* Groups whose list is on the GPU at once; lamps beyond wait for the next. */
#define GROUPS_AT_ONCE 65536
#define NODE_BYTES 8

uint32_t depths_samples(const struct gpu_light *light, float cell)
{
    int extended;
    switch (light->info.x) {
    case LIGHT_SUN:
        extended = light->axis.w > 0.02f;
        break;
    case LIGHT_POINT:
    case LIGHT_SPOT:
        extended = light->position.w > cell;
        break;
    default:
        extended = light->radiance.w > cell * cell;
        break;
    }
    if (!extended)
        return 1;
    return light->samples.y < EXTENDED_SAMPLES ? light->samples.y : EXTENDED_SAMPLES;
}

/* At most so many groups has a lattice, wherever the light is. */
static size_t groups_of(const ivec4 *dims)
{
    return ((size_t)dims->x / GROUP_LANES + 2) * ((size_t)dims->y / GROUP_CELLS + 2) *
           ((size_t)dims->z / GROUP_CELLS + 2);
}

static uint64_t texture_bytes(int width, int height, int depth)
{
    return (uint64_t)texture_side(width) * (uint64_t)texture_side(height) *
           (uint64_t)texture_side(depth) * NODE_BYTES;
}

uint64_t depths_working_bytes(const brume_settings *settings, const struct gpu_light *lights,
                              uint32_t count, const struct gpu_frame *frame)
{
    const ivec4 dims = frame->lattice_dims;
    const size_t groups = groups_of(&dims);
    const size_t listed = groups * (count ? count : 1);
    uint64_t bytes = (uint64_t)(count + EXTENDED_SAMPLES + 1) * sizeof(struct gpu_depth_source) +
                     2 * sizeof(struct gpu_lattice_pass);
    if (settings->depths == BRUME_DEPTHS_PROPAGATED)
        bytes += sizeof(ivec4) * (uint64_t)(listed < GROUPS_AT_ONCE   ? listed
                                            : groups < GROUPS_AT_ONCE ? GROUPS_AT_ONCE
                                                                      : groups);
    uint64_t apart = 0;
    for (uint32_t i = 0; i < count && !apart; ++i)
        if (depths_samples(&lights[i], frame->lattice_lower.w) > 1)
            apart = texture_bytes(dims.x, dims.y, EXTENDED_SAMPLES * dims.z);
    bytes += apart;
    if (settings->depths == BRUME_DEPTHS_ITERATED)
        bytes += 2 * texture_bytes(dims.x, dims.y, ((int)count / 4 + 1) * dims.z);
    return bytes;
}

/* --- Sources ------------------------------------------------------------------------------ */

/* One run: sources, and the texture that their tiles are in. */
struct depths {
    const struct transport_input *input;
    struct texture *texture;
    const struct gpu_depth_source *sources;
    uint32_t count;
    struct buffer block, groups;
};

static int is_paper(const struct transport_input *input)
{
    return input->settings->depths >= BRUME_DEPTHS_CORRECTED;
}

/* position: a point, or for a sun the unit vector towards it. */
static struct gpu_depth_source source_at(const struct transport_input *input, uint32_t type,
                                         vec4 position, int tile_y, int tile_z)
{
    const struct gpu_frame *frame = input->frame;
    const int sun = type == LIGHT_SUN;
    const float from[3] = {position.x, position.y, position.z};
    const float *lower = &frame->lattice_lower.x;
    const int *dims = &frame->lattice_dims.x;
    struct gpu_depth_source source = {
        .point = {position.x, position.y, position.z, sun ? 1.0f : 0.0f},
        .tile = {0, tile_y, tile_z, 0}};
    int *node = &source.node.x;
    for (int i = 0; i < 3; ++i) {
        const int last = dims[i] - 1;
        /* In cells, and far away on its side for a sun. */
        const float at =
            sun ? (from[i] > 0.0f ? 1e9f : -1e9f) : (from[i] - lower[i]) / frame->lattice_lower.w;
        /* The paper's light is at a node; ours in a cell, or before the first node. */
        node[i] = is_paper(input) ? (int)fminf(fmaxf(rintf(at), 0.0f), (float)last)
                                  : (int)fminf(fmaxf(floorf(at), -1.0f), (float)last);
    }
    return source;
}

static brume_result set_pass(struct depths *depths, struct gpu_lattice_pass pass)
{
    TRY(buffer_update(&depths->input->gpu->memory, &depths->block, FOR_TRANSPORT, sizeof pass,
                      &pass, "lattice pass"));
    glBindBufferBase(GL_UNIFORM_BUFFER, SLOT_STAGE, depths->block.id);
    return BRUME_OK;
}

static void bind_image(const struct texture *texture)
{
    glBindImageTexture(SLOT_OUTPUT, texture->id, 0, GL_TRUE, 0, GL_WRITE_ONLY, GL_RGBA16F);
}

/* Between two steps: how many of all are done. */
static brume_result go_on(const struct transport_input *input, size_t done, size_t all)
{
    job_report(input->control, BRUME_STAGE_TRANSPORT, 0.1f + 0.1f * (float)done / (float)all);
    return job_cancelled(input->control) ? fail(BRUME_E_CANCELLED, "cancelled") : BRUME_OK;
}

/* --- Propagation --------------------------------------------------------------------------- */

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

static void cut_axes(const struct depths *depths, uint32_t source, const struct program *program,
                     struct axis_groups axes[3])
{
    const int *nodes = &depths->input->frame->lattice_dims.x;
    const int *origin = &depths->sources[source].node.x;
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

static brume_result list_groups(const struct depths *depths, const struct program *program,
                                uint32_t from, uint32_t end, struct group_list *list)
{
    struct axis_groups axes[3];
    for (uint32_t i = from; i < end; ++i) {
        cut_axes(depths, i, program, axes);
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
                cut_axes(depths, i, program, axes);
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

static brume_result run_levels(struct depths *depths, const struct program *program,
                               const struct group_list *list)
{
    const struct transport_input *input = depths->input;
    TRY(buffer_update(&input->gpu->memory, &depths->groups, FOR_TRANSPORT,
                      list->first[list->levels] * sizeof *list->groups, list->groups,
                      "depth groups"));
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, SLOT_DEPTH_GROUPS, depths->groups.id);
    glBindTextureUnit(SLOT_DEPTH_BEFORE, depths->texture->id);
    bind_image(depths->texture);
    for (int level = 0; level < list->levels; ++level) {
        const size_t count = list->first[level + 1] - list->first[level];
        TRY(go_on(input, (size_t)level, (size_t)list->levels));
        TRY(set_pass(depths, (struct gpu_lattice_pass){.offset = {(int)list->first[level]}}));
        program_dispatch(program, (int)count * program->group[0], 1, 1);
        /* What this level wrote, the next reads. */
        glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    }
    return BRUME_OK;
}

/* Work grows with the nodes: every one is computed once a source. */
static brume_result propagate(struct depths *depths)
{
    const struct program *program;
    TRY(program_compute(&depths->input->gpu->programs, "opv_propagate", &program));
    const size_t groups = groups_of(&depths->input->frame->lattice_dims);
    const uint32_t most = groups < GROUPS_AT_ONCE ? (uint32_t)(GROUPS_AT_ONCE / groups) : 1;
    brume_result result = BRUME_OK;
    for (uint32_t from = 0; from < depths->count && result == BRUME_OK; from += most) {
        const uint32_t end = from + most < depths->count ? from + most : depths->count;
        struct group_list list = {0};
        result = list_groups(depths, program, from, end, &list);
        if (result == BRUME_OK)
            result = run_levels(depths, program, &list);
        free(list.first);
        free(list.groups);
    }
    return result;
}

/* --- The reference, and the paper's own ways ----------------------------------------------- */

static brume_result march(struct depths *depths)
{
    const struct transport_input *input = depths->input;
    const ivec4 dims = input->frame->lattice_dims;
    const struct program *program;
    TRY(program_compute(&input->gpu->programs, "opv_march", &program));
    bind_image(depths->texture);
    /* A GPU takes the lattice whole; a CPU about a tenth of a second a slab, so that a cancel need
     * not wait for all of it. */
    const int slab = input->gpu->context.info.software ? 2 * GROUP_CELLS : dims.z;
    for (uint32_t i = 0; i < depths->count; ++i)
        for (int z = 0; z < dims.z; z += slab) {
            const int end = z + slab < dims.z ? z + slab : dims.z;
            TRY(go_on(input, (size_t)i * (size_t)dims.z + (size_t)z,
                      depths->count * (size_t)dims.z));
            TRY(set_pass(depths,
                         (struct gpu_lattice_pass){.offset = {(int)i}, .slab = {0, 0, z, end}}));
            program_dispatch(program, dims.x, dims.y, end - z);
            if (slab < dims.z)
                glFinish();
        }
    return BRUME_OK;
}

/* By wavefronts: the nodes that are so many steps along the axes from the light. */
static brume_result gather_fronts(struct depths *depths)
{
    const struct transport_input *input = depths->input;
    const ivec4 dims = input->frame->lattice_dims;
    const struct program *program;
    TRY(program_compute(&input->gpu->programs, "opv_gather", &program));
    bind_image(depths->texture);
    glBindTextureUnit(SLOT_DEPTH_BEFORE, depths->texture->id);
    const int literal = input->settings->depths != BRUME_DEPTHS_CORRECTED;
    const int fronts = dims.x + dims.y + dims.z - 2;
    for (int front = 0; front < fronts; ++front) {
        TRY(go_on(input, (size_t)front, (size_t)fronts));
        TRY(set_pass(depths,
                     (struct gpu_lattice_pass){.offset = {(int)depths->count, front, literal, 0}}));
        program_dispatch(program, dims.x, dims.y, 2 * (int)depths->count);
        glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    }
    return BRUME_OK;
}

/* All nodes in every iteration, from one texture into another, four lights a texel: the paper's
 * way.
 */
static brume_result iterate_in(struct depths *depths, struct texture textures[2])
{
    static const float unreached[4] = {-1, -1, -1, -1};
    const struct transport_input *input = depths->input;
    const ivec4 dims = input->frame->lattice_dims;
    const int count = (int)depths->count, tiles = (count + 3) / 4;
    const struct program *program;
    TRY(program_compute(&input->gpu->programs, "opv_iterate", &program));
    for (int i = 0; i < 2; ++i) {
        TRY(texture_init(&input->gpu->memory, &textures[i], FOR_TRANSPORT, GL_TEXTURE_3D,
                         GL_RGBA16F, texture_side(dims.x), texture_side(dims.y),
                         texture_side(tiles * dims.z), 1, "depths to four lamps"));
        glClearTexImage(textures[i].id, 0, GL_RGBA, GL_FLOAT, unreached);
    }
    const int fronts = dims.x + dims.y + dims.z - 2;
    for (int i = 0; i < fronts; ++i) {
        TRY(go_on(input, (size_t)i, (size_t)fronts));
        glBindTextureUnit(SLOT_DEPTH_BEFORE, textures[i % 2].id);
        bind_image(&textures[1 - i % 2]);
        TRY(set_pass(depths, (struct gpu_lattice_pass){.offset = {count, -1, 0, 0}}));
        program_dispatch(program, dims.x, dims.y, tiles * dims.z);
        glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    }
    glBindTextureUnit(SLOT_DEPTH_BEFORE, textures[fronts % 2].id);
    bind_image(depths->texture);
    for (int i = 0; i < count; ++i) {
        TRY(set_pass(depths, (struct gpu_lattice_pass){.offset = {count, i, 0, 0}}));
        program_dispatch(program, dims.x, dims.y, dims.z);
    }
    return BRUME_OK;
}

static brume_result iterate(struct depths *depths)
{
    struct texture textures[2] = {{0}};
    const brume_result result = iterate_in(depths, textures);
    for (int i = 0; i < 2; ++i)
        texture_finish(&depths->input->gpu->memory, &textures[i]);
    return result;
}

/* --- All of them -------------------------------------------------------------------------- */

static brume_result run(const struct transport_input *input, struct texture *texture,
                        const struct gpu_depth_source *sources, uint32_t count)
{
    static brume_result (*const ways[BRUME_DEPTHS_COUNT])(struct depths *) = {
        [BRUME_DEPTHS_PROPAGATED] = propagate,    [BRUME_DEPTHS_MARCHED] = march,
        [BRUME_DEPTHS_CORRECTED] = gather_fronts, [BRUME_DEPTHS_PAPER] = gather_fronts,
        [BRUME_DEPTHS_ITERATED] = iterate,
    };
    struct depths depths = {.input = input, .texture = texture, .sources = sources, .count = count};
    const brume_result result = ways[input->settings->depths](&depths);
    buffer_finish(&input->gpu->memory, &depths.block);
    buffer_finish(&input->gpu->memory, &depths.groups);
    return result;
}

static brume_result bind_sources(const struct transport_input *input, struct buffer *buffer,
                                 const struct gpu_depth_source *sources, uint32_t count)
{
    TRY(buffer_update(&input->gpu->memory, buffer, FOR_TRANSPORT, count * sizeof *sources, sources,
                      "depth sources"));
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, SLOT_DEPTH_SOURCES, buffer->id);
    return BRUME_OK;
}

/* A lamp with extent: its samples in a texture of their own, then their mean. */
static brume_result run_extended(struct transport *transport, const struct transport_input *input,
                                 const struct gpu_light *light, uint32_t samples,
                                 struct buffer *buffer)
{
    struct memory *memory = &input->gpu->memory;
    const ivec4 dims = input->frame->lattice_dims;
    const struct program *merge;
    struct gpu_depth_source sources[EXTENDED_SAMPLES + 1];
    struct texture apart = {0};
    struct buffer block = {0};
    for (uint32_t i = 0; i < samples; ++i) {
        const uint32_t number = light->samples.x + i * light->samples.y / samples;
        sources[i] =
            source_at(input, light->info.x, input->samples[number].position, 0, (int)i * dims.z);
    }
    TRY(program_compute(&input->gpu->programs, "opv_merge", &merge));
    TRY(texture_init(memory, &apart, FOR_TRANSPORT, GL_TEXTURE_3D, GL_RGBA16F, texture_side(dims.x),
                     texture_side(dims.y), texture_side((int)samples * dims.z), 1,
                     "depths to a lamp's samples"));
    brume_result result = bind_sources(input, buffer, sources, samples);
    if (result == BRUME_OK)
        result = run(input, &apart, sources, samples);
    memmove(sources + 1, sources, samples * sizeof *sources);
    sources[0] =
        source_at(input, light->info.x, light->position, (int)light->info.y, (int)light->info.z);
    if (result == BRUME_OK)
        result = bind_sources(input, buffer, sources, samples + 1);
    const struct gpu_lattice_pass pass = {.offset = {0, (int)samples, 0, 0}};
    if (result == BRUME_OK)
        result = buffer_init(memory, &block, FOR_TRANSPORT, sizeof pass, &pass, "lattice pass");
    if (result == BRUME_OK) {
        glBindBufferBase(GL_UNIFORM_BUFFER, SLOT_STAGE, block.id);
        glBindTextureUnit(SLOT_DEPTH_BEFORE, apart.id);
        bind_image(&transport->tau);
        glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
        program_dispatch(merge, dims.x, dims.y, dims.z);
    }
    buffer_finish(memory, &block);
    texture_finish(memory, &apart);
    return result;
}

brume_result depths_run(struct transport *transport, const struct transport_input *input,
                        const uint32_t *lights, uint32_t count)
{
    struct buffer buffer = {0};
    uint32_t points = 0;
    struct gpu_depth_source *sources = malloc((count + 1) * sizeof *sources);
    if (!sources)
        return fail(BRUME_E_MEMORY, "no memory for %u lamps", count);
    brume_result result = BRUME_OK;
    for (uint32_t i = 0; i < count && result == BRUME_OK; ++i) {
        const struct gpu_light *light = &input->lights[lights[i]];
        const uint32_t samples = depths_samples(light, input->frame->lattice_lower.w);
        if (samples > 1)
            result = run_extended(transport, input, light, samples, &buffer);
        else
            sources[points++] = source_at(input, light->info.x, light->position, (int)light->info.y,
                                          (int)light->info.z);
    }
    if (result == BRUME_OK && points)
        result = bind_sources(input, &buffer, sources, points);
    if (result == BRUME_OK && points)
        result = run(input, &transport->tau, sources, points);
    buffer_finish(&input->gpu->memory, &buffer);
    free(sources);
    return result;
}
