/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Optical depths from the lattice's nodes to the lamps: what is to be found for each, and in which
 * way. docs/methods/opv.md. */
#include "transport/depths.h"
#include "base/result.h"
#include "transport/opv_ways.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Of what is scattered: a peak of less has no light that shows (g below 0.5). */
#define SLIGHT_SHARE 0.06f

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

uint64_t opv_texture_bytes(int width, int height, int depth)
{
    return (uint64_t)texture_side(width) * (uint64_t)texture_side(height) *
           (uint64_t)texture_side(depth) * DEPTH_NODE_BYTES;
}

uint64_t depths_working_bytes(const brume_settings *settings, const struct gpu_light *lights,
                              uint32_t count, const struct gpu_frame *frame, int texture_limit)
{
    const ivec4 dims = frame->lattice_dims;
    uint64_t bytes = (uint64_t)(count + EXTENDED_SAMPLES + 1) * sizeof(struct gpu_depth_source) +
                     3 * sizeof(struct gpu_lattice_pass);
    uint32_t sources = count;
    for (uint32_t i = 0; i < count; ++i)
        if (depths_samples(&lights[i], frame->lattice_lower.w) > 1) {
            bytes += opv_texture_bytes(dims.x, 2 * dims.y, 2 * dims.z);
            sources = count > EXTENDED_SAMPLES ? count : EXTENDED_SAMPLES;
            break;
        }
    if (settings->depths == BRUME_DEPTHS_PROPAGATED)
        bytes += opv_propagate_bytes(&dims, sources);
    if (settings->depths == BRUME_DEPTHS_ITERATED)
        bytes += opv_iterate_bytes(&dims, sources, texture_limit);
    return bytes;
}

/* --- What ways share ------------------------------------------------------------------------ */

brume_result opv_set_pass(struct opv_work *run, struct gpu_lattice_pass pass)
{
    TRY(buffer_update(&run->input->gpu->memory, &run->block, FOR_TRANSPORT, sizeof pass, &pass,
                      "lattice pass"));
    glBindBufferBase(GL_UNIFORM_BUFFER, SLOT_STAGE, run->block.id);
    return BRUME_OK;
}

void opv_bind_image(const struct texture *texture)
{
    glBindImageTexture(SLOT_OUTPUT, texture->id, 0, GL_TRUE, 0, GL_WRITE_ONLY, GL_RGBA16F);
}

brume_result opv_go_on(const struct opv_work *run, float part)
{
    struct job_control *control = run->input->control;
    job_report(control, BRUME_STAGE_TRANSPORT, 0.1f + 0.1f * (run->done + run->share * part));
    return job_cancelled(control) ? fail(BRUME_E_CANCELLED, "cancelled") : BRUME_OK;
}

brume_result opv_slabs(struct opv_work *run, const struct program *program,
                       struct gpu_lattice_pass pass, const ivec4 *dims, float from, float part)
{
    /* A GPU takes the lattice whole; a CPU takes about a tenth of a second a slab. */
    const int slab = run->input->gpu->context.info.software ? 2 * GROUP_CELLS : dims->z;
    for (int z = 0; z < dims->z; z += slab) {
        TRY(opv_go_on(run, from + part * (float)z / (float)dims->z));
        pass.slab.z = z;
        pass.slab.w = z + slab < dims->z ? z + slab : dims->z;
        TRY(opv_set_pass(run, pass));
        program_dispatch(program, dims->x, dims->y, pass.slab.w - z);
        glFinish(); /* or a cancel would find all of them in the driver's queue */
    }
    return BRUME_OK;
}

/* --- Sources ------------------------------------------------------------------------------ */

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

static brume_result bind_sources(const struct transport_input *input, struct buffer *buffer,
                                 const struct gpu_depth_source *sources, uint32_t count)
{
    TRY(buffer_update(&input->gpu->memory, buffer, FOR_TRANSPORT, count * sizeof *sources, sources,
                      "depth sources"));
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, SLOT_DEPTH_SOURCES, buffer->id);
    return BRUME_OK;
}

/* Where a forward peak is scaled away: what of its light is at the nodes, beside the depths that
 * the lamps' tiles have now. The first of the sources that are bound. */
static brume_result find_astray(struct opv_work *run, struct texture *tau, uint32_t count)
{
    const struct transport_input *input = run->input;
    const struct program *program;
    if (input->medium->forward < SLIGHT_SHARE)
        return BRUME_OK;
    TRY(program_compute(&input->gpu->programs, "dom_astray", &program));
    glBindImageTexture(SLOT_OUTPUT, tau->id, 0, GL_TRUE, 0, GL_READ_WRITE, GL_RGBA16F);
    glMemoryBarrier(GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
    for (uint32_t i = 0; i < count; ++i)
        TRY(opv_slabs(run, program, (struct gpu_lattice_pass){.offset = {(int)i}},
                      &input->frame->lattice_dims, 1.0f, 0.0f));
    return BRUME_OK;
}

static brume_result find(struct opv_work *run)
{
    static brume_result (*const ways[BRUME_DEPTHS_COUNT])(struct opv_work *) = {
        [BRUME_DEPTHS_PROPAGATED] = opv_propagate, [BRUME_DEPTHS_MARCHED] = opv_march,
        [BRUME_DEPTHS_CORRECTED] = opv_gather,     [BRUME_DEPTHS_PAPER] = opv_gather,
        [BRUME_DEPTHS_ITERATED] = opv_iterate,
    };
    return ways[run->input->settings->depths](run);
}

/* --- Lamps with extent ---------------------------------------------------------------------- */

/* Where the depths to a lamp's samples are, and in what order. */
struct apart {
    struct texture texture;
    struct buffer sources;
};

static void apart_finish(struct memory *memory, struct apart *apart)
{
    texture_finish(memory, &apart->texture);
    buffer_finish(memory, &apart->sources);
}

/* The samples, two by two in a texture of their own, then their mean in the lamp's tile. */
static brume_result find_extended(struct opv_work *run, struct texture *tau, struct apart *apart,
                                  const struct gpu_light *light, uint32_t samples)
{
    const struct transport_input *input = run->input;
    struct memory *memory = &input->gpu->memory;
    const ivec4 dims = input->frame->lattice_dims;
    const struct program *merge;
    struct gpu_depth_source sources[1 + EXTENDED_SAMPLES]; /* the lamp, its samples */
    sources[0] =
        source_at(input, light->info.x, light->position, (int)light->info.y, (int)light->info.z);
    for (uint32_t i = 0; i < samples; ++i) {
        const uint32_t number = light->samples.x + i * light->samples.y / samples;
        sources[1 + i] = source_at(input, light->info.x, input->samples[number].position,
                                   (int)(i / 2) * dims.y, (int)(i % 2) * dims.z);
    }
    TRY(program_compute(&input->gpu->programs, "opv_merge", &merge));
    TRY(texture_ensure(memory, &apart->texture, FOR_TRANSPORT, GL_TEXTURE_3D, GL_RGBA16F,
                       texture_side(dims.x), texture_side(2 * dims.y), texture_side(2 * dims.z), 1,
                       "depths to a lamp's samples"));
    TRY(bind_sources(input, &apart->sources, sources + 1, samples));
    run->texture = &apart->texture;
    run->sources = sources + 1;
    run->count = samples;
    TRY(find(run));
    TRY(bind_sources(input, &apart->sources, sources, samples + 1));
    TRY(opv_set_pass(run, (struct gpu_lattice_pass){.offset = {0, (int)samples, 0, 0}}));
    glBindTextureUnit(SLOT_DEPTH_BEFORE, apart->texture.id);
    opv_bind_image(tau);
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    program_dispatch(merge, dims.x, dims.y, dims.z);
    TRY(find_astray(run, tau, 1));
    /* The next lamp's samples go where this one's are read. */
    glMemoryBarrier(GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
    return BRUME_OK;
}

/* --- All of them -------------------------------------------------------------------------- */

brume_result depths_run(struct transport *transport, const struct transport_input *input,
                        const uint32_t *lights, uint32_t count)
{
    struct memory *memory = &input->gpu->memory;
    struct opv_work run = {.input = input, .share = 1.0f / (float)count};
    struct apart apart = {0};
    struct buffer buffer = {0};
    uint32_t points = 0;
    struct gpu_depth_source *sources = malloc((count + 1) * sizeof *sources);
    if (!sources)
        return fail(BRUME_E_MEMORY, "no memory for %u lamps", count);
    brume_result result = BRUME_OK;
    for (uint32_t i = 0; i < count && result == BRUME_OK; ++i) {
        const struct gpu_light *light = &input->lights[lights[i]];
        const uint32_t samples = depths_samples(light, input->frame->lattice_lower.w);
        if (samples > 1) {
            result = find_extended(&run, &transport->tau, &apart, light, samples);
            run.done += run.share;
        } else {
            sources[points++] = source_at(input, light->info.x, light->position, (int)light->info.y,
                                          (int)light->info.z);
        }
    }
    if (result == BRUME_OK && points) {
        run.texture = &transport->tau;
        run.sources = sources;
        run.count = points;
        run.share *= (float)points;
        result = bind_sources(input, &buffer, sources, points);
    }
    if (result == BRUME_OK && points)
        result = find(&run);
    if (result == BRUME_OK && points)
        result = find_astray(&run, &transport->tau, points);
    buffer_finish(memory, &run.block);
    buffer_finish(memory, &run.groups);
    buffer_finish(memory, &buffer);
    apart_finish(memory, &apart);
    free(sources);
    return result;
}
