/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Optical depths: propagated, marched, or gathered as in the paper. docs/methods/opv.md. */
#include "transport/depths.h"
#include "base/result.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Samples whose transmittances are averaged for a light with extent; at most 8 (opv_merge). */
#define EXTENDED_SAMPLES 4
/* Bricks whose list is on the GPU at once; lamps beyond wait for the next. */
#define BRICKS_AT_ONCE 16384
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

/* At most so many bricks has a lattice, wherever the light is. */
static size_t bricks_of(const ivec4 *dims)
{
    const int *side = &dims->x;
    size_t bricks = 1;
    for (int i = 0; i < 3; ++i)
        bricks *= (size_t)side[i] / GROUP_BRICK + 2;
    return bricks;
}

static uint64_t texture_bytes(int width, int height, int depth)
{
    return (uint64_t)texture_side(width) * (uint64_t)texture_side(height) *
           (uint64_t)texture_side(depth) * NODE_BYTES;
}

uint64_t depths_working_bytes(const brume_settings *settings, const struct gpu_light *lights,
                              uint32_t count, const struct gpu_frame *frame, const int tau_size[3])
{
    const ivec4 dims = frame->lattice_dims;
    const size_t bricks = bricks_of(&dims);
    const size_t listed = bricks * (count ? count : 1);
    uint64_t bytes = (uint64_t)(count + EXTENDED_SAMPLES + 1) * sizeof(struct gpu_depth_source) +
                     2 * sizeof(struct gpu_lattice_pass);
    if (settings->depths == BRUME_DEPTHS_PROPAGATED)
        bytes += sizeof(ivec4) * (uint64_t)(listed < BRICKS_AT_ONCE   ? listed
                                            : bricks < BRICKS_AT_ONCE ? BRICKS_AT_ONCE
                                                                      : bricks);
    uint64_t apart = 0;
    for (uint32_t i = 0; i < count && !apart; ++i)
        if (depths_samples(&lights[i], frame->lattice_lower.w) > 1)
            apart = texture_bytes(dims.x, dims.y, EXTENDED_SAMPLES * dims.z);
    const uint64_t all = texture_bytes(tau_size[0], tau_size[1], tau_size[2]);
    /* Iterations go to and fro between two textures. */
    if (settings->depths == BRUME_DEPTHS_ITERATED)
        bytes += 2 * apart > all ? 2 * apart : all;
    else
        bytes += apart;
    return bytes;
}

/* --- Sources ------------------------------------------------------------------------------ */

/* One run: sources, and the texture that their tiles are in. */
struct depths {
    const struct transport_input *input;
    struct texture *texture;
    const struct gpu_depth_source *sources;
    uint32_t count;
    struct buffer block, bricks;
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

static brume_result check_cancel(const struct transport_input *input)
{
    return job_cancelled(input->control) ? fail(BRUME_E_CANCELLED, "cancelled") : BRUME_OK;
}

/* --- Propagation --------------------------------------------------------------------------- */

/* The bricks along one axis: their first nodes, by their level, which is how many bricks the light
 * passes before. Bricks at both sides of the light are of one level. */
struct brick_row {
    int *first; /* two a level; INT32_MIN: none */
    int levels;
};

#define NO_BRICK INT32_MIN

static brume_result row_init(struct brick_row *row, int origin, int nodes)
{
    const int above = nodes - 1 - origin, below = origin + 1;
    const int longer = above > below ? above : below;
    row->levels = (longer + GROUP_BRICK - 1) / GROUP_BRICK;
    row->first = malloc(2 * (size_t)row->levels * sizeof *row->first);
    if (!row->first)
        return fail(BRUME_E_MEMORY, "no memory for the bricks of a lattice");
    for (int level = 0; level < row->levels; ++level) {
        const int step = level * GROUP_BRICK;
        row->first[2 * level] = step < above ? origin + 1 + step : NO_BRICK;
        row->first[2 * level + 1] = step < below ? origin - step - (GROUP_BRICK - 1) : NO_BRICK;
    }
    return BRUME_OK;
}

/* Appends a source's bricks of one level, or only counts them. */
static size_t list_level(const struct brick_row rows[3], int level, int source, ivec4 *out)
{
    size_t count = 0;
    for (int x = 0; x < 2 * rows[0].levels; ++x)
        for (int y = 0; y < 2 * rows[1].levels; ++y)
            for (int side = 0; side < 2; ++side) {
                const int z = level - x / 2 - y / 2;
                if (z < 0 || z >= rows[2].levels)
                    continue;
                const ivec4 brick = {rows[0].first[x], rows[1].first[y],
                                     rows[2].first[2 * z + side], source};
                if (brick.x == NO_BRICK || brick.y == NO_BRICK || brick.z == NO_BRICK)
                    continue;
                if (out)
                    out[count] = brick;
                ++count;
            }
    return count;
}

/* The bricks of some sources, level by level. */
struct brick_list {
    ivec4 *bricks;
    size_t *first; /* levels + 1 */
    int levels;
};

static brume_result list_bricks(const struct depths *depths, uint32_t from, uint32_t end,
                                struct brick_row *rows, struct brick_list *list)
{
    const int *dims = &depths->input->frame->lattice_dims.x;
    for (uint32_t i = from; i < end; ++i) {
        const int *origin = &depths->sources[i].node.x;
        int levels = 1;
        for (int axis = 0; axis < 3; ++axis) {
            struct brick_row *row = &rows[3 * (i - from) + (uint32_t)axis];
            TRY(row_init(row, origin[axis], dims[axis]));
            levels += row->levels - 1;
        }
        list->levels = levels > list->levels ? levels : list->levels;
    }
    list->first = calloc((size_t)list->levels + 1, sizeof *list->first);
    if (!list->first)
        return fail(BRUME_E_MEMORY, "no memory for the bricks of a lattice");
    for (int level = 0; level < list->levels; ++level) {
        list->first[level + 1] = list->first[level];
        for (uint32_t i = from; i < end; ++i)
            list->first[level + 1] += list_level(rows + 3 * (i - from), level, (int)i, NULL);
    }
    list->bricks = malloc(list->first[list->levels] * sizeof *list->bricks);
    if (!list->bricks)
        return fail(BRUME_E_MEMORY, "no memory for the bricks of a lattice");
    ivec4 *next = list->bricks;
    for (int level = 0; level < list->levels; ++level)
        for (uint32_t i = from; i < end; ++i)
            next += list_level(rows + 3 * (i - from), level, (int)i, next);
    return BRUME_OK;
}

static brume_result run_levels(struct depths *depths, const struct brick_list *list)
{
    const struct transport_input *input = depths->input;
    const struct program *program;
    TRY(program_compute(&input->gpu->programs, "opv_propagate", &program));
    TRY(buffer_update(&input->gpu->memory, &depths->bricks, FOR_TRANSPORT,
                      list->first[list->levels] * sizeof *list->bricks, list->bricks,
                      "depth bricks"));
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, SLOT_DEPTH_BRICKS, depths->bricks.id);
    glBindTextureUnit(SLOT_DEPTH_BEFORE, depths->texture->id);
    bind_image(depths->texture);
    for (int level = 0; level < list->levels; ++level) {
        const size_t count = list->first[level + 1] - list->first[level];
        TRY(check_cancel(input));
        TRY(set_pass(depths, (struct gpu_lattice_pass){.offset = {(int)list->first[level]}}));
        program_dispatch(program, (int)count * program->group[0], 1, 1);
        /* What this level wrote, the next reads. */
        glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    }
    return BRUME_OK;
}

/* Work grows with the nodes: every brick of every source is computed once. */
static brume_result propagate(struct depths *depths)
{
    const size_t bricks = bricks_of(&depths->input->frame->lattice_dims);
    const uint32_t most = bricks < BRICKS_AT_ONCE ? (uint32_t)(BRICKS_AT_ONCE / bricks) : 1;
    brume_result result = BRUME_OK;
    for (uint32_t from = 0; from < depths->count && result == BRUME_OK; from += most) {
        const uint32_t end = from + most < depths->count ? from + most : depths->count;
        struct brick_list list = {0};
        struct brick_row *rows = calloc(3 * (size_t)(end - from), sizeof *rows);
        result = rows ? list_bricks(depths, from, end, rows, &list)
                      : fail(BRUME_E_MEMORY, "no memory for the bricks of a lattice");
        if (result == BRUME_OK)
            result = run_levels(depths, &list);
        for (uint32_t i = 0; rows && i < 3 * (end - from); ++i)
            free(rows[i].first);
        free(rows);
        free(list.first);
        free(list.bricks);
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
            TRY(check_cancel(input));
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
    for (int front = 0; front < dims.x + dims.y + dims.z - 2; ++front) {
        TRY(check_cancel(input));
        TRY(set_pass(depths, (struct gpu_lattice_pass){.offset = {0, front, literal, 0},
                                                       .slab = {(int)depths->count, 0, 0, 0}}));
        program_dispatch(program, dims.x, dims.y, 2 * (int)depths->count);
        glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    }
    return BRUME_OK;
}

/* All nodes in every iteration, from one texture into another, as the paper has it. */
static brume_result iterate(struct depths *depths)
{
    const struct transport_input *input = depths->input;
    struct memory *memory = &input->gpu->memory;
    const ivec4 dims = input->frame->lattice_dims;
    const struct program *program;
    struct texture *texture = depths->texture, other = {0};
    TRY(program_compute(&input->gpu->programs, "opv_gather", &program));
    TRY(texture_init(memory, &other, FOR_TRANSPORT, GL_TEXTURE_3D, GL_RGBA16F, texture->width,
                     texture->height, texture->depth, 1, "optical depths before"));
    glClearTexImage(texture->id, 0, GL_RGBA, GL_FLOAT, NULL);
    brume_result result = BRUME_OK;
    /* An even number, so that the last goes into the texture that is kept. */
    const int fronts = (dims.x + dims.y + dims.z - 1) / 2 * 2;
    for (int i = 0; i < fronts && result == BRUME_OK; ++i) {
        glBindTextureUnit(SLOT_DEPTH_BEFORE, i % 2 ? other.id : texture->id);
        bind_image(i % 2 ? texture : &other);
        result = check_cancel(input);
        if (result == BRUME_OK)
            result =
                set_pass(depths, (struct gpu_lattice_pass){.offset = {0, -1, 1, 0},
                                                           .slab = {(int)depths->count, 0, 0, 0}});
        if (result == BRUME_OK)
            program_dispatch(program, dims.x, dims.y, dims.z * (int)depths->count);
        glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    }
    texture_finish(memory, &other);
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
    buffer_finish(&input->gpu->memory, &depths.bricks);
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
