/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The paper's own ways to propagate depths, kept for comparison: its gather from six neighbours by
 * wavefronts, literally or corrected, and its iterations as published. */
#include "base/result.h"
#include "transport/opv_ways.h"

/* By wavefronts: the nodes that are so many steps along the axes from the light. */
brume_result opv_gather(struct opv_work *run)
{
    const struct transport_input *input = run->input;
    const ivec4 dims = input->frame->lattice_dims;
    const struct program *program;
    TRY(program_compute(&input->gpu->programs, "opv_gather", &program));
    opv_bind_image(run->texture);
    glBindTextureUnit(SLOT_DEPTH_BEFORE, run->texture->id);
    const int literal = input->settings->depths != BRUME_DEPTHS_CORRECTED;
    const int fronts = dims.x + dims.y + dims.z - 2;
    for (int front = 0; front < fronts; ++front) {
        TRY(opv_go_on(run, (float)front / (float)fronts));
        TRY(opv_set_pass(
            run, (struct gpu_lattice_pass){.offset = {(int)run->count, front, literal, 0}}));
        program_dispatch(program, dims.x, dims.y, 2 * (int)run->count);
        glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    }
    return BRUME_OK;
}

/* Tiles of four sources that a texture has room for, one above the other. */
static uint32_t tiles_at_once(const ivec4 *dims, int texture_limit)
{
    return (uint32_t)((texture_limit - 1) / dims->z);
}

uint64_t opv_iterate_bytes(const ivec4 *dims, uint32_t sources, int texture_limit)
{
    const uint32_t wanted = (sources + 3) / 4, most = tiles_at_once(dims, texture_limit);
    const uint32_t tiles = wanted < most ? wanted : most;
    return 2 * opv_texture_bytes(dims->x, dims->y, (int)tiles * dims->z);
}

/* All nodes in every iteration, from one texture into another, four lights a texel. */
static brume_result iterate_some(struct opv_work *run, uint32_t from, uint32_t end,
                                 struct texture textures[2])
{
    static const float unreached[4] = {-1, -1, -1, -1};
    const struct transport_input *input = run->input;
    const ivec4 dims = input->frame->lattice_dims;
    const int tiles = (int)(end - from + 3) / 4;
    const struct program *program;
    TRY(program_compute(&input->gpu->programs, "opv_iterate", &program));
    for (int i = 0; i < 2; ++i) {
        TRY(texture_ensure(&input->gpu->memory, &textures[i], FOR_TRANSPORT, GL_TEXTURE_3D,
                           GL_RGBA16F, texture_side(dims.x), texture_side(dims.y),
                           texture_side(tiles * dims.z), 1, "depths to four lamps"));
        glClearTexImage(textures[i].id, 0, GL_RGBA, GL_FLOAT, unreached);
    }
    const int fronts = dims.x + dims.y + dims.z - 2;
    for (int i = 0; i < fronts; ++i) {
        TRY(opv_go_on(run, ((float)from + (float)(end - from) * (float)i / (float)fronts) /
                               (float)run->count));
        glBindTextureUnit(SLOT_DEPTH_BEFORE, textures[i % 2].id);
        opv_bind_image(&textures[1 - i % 2]);
        TRY(opv_set_pass(run, (struct gpu_lattice_pass){.offset = {(int)end, -1, (int)from, 0}}));
        program_dispatch(program, dims.x, dims.y, tiles * dims.z);
        glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    }
    glBindTextureUnit(SLOT_DEPTH_BEFORE, textures[fronts % 2].id);
    opv_bind_image(run->texture);
    for (uint32_t i = from; i < end; ++i) {
        TRY(opv_set_pass(run,
                         (struct gpu_lattice_pass){.offset = {(int)end, (int)i, (int)from, 0}}));
        program_dispatch(program, dims.x, dims.y, dims.z);
    }
    return BRUME_OK;
}

brume_result opv_iterate(struct opv_work *run)
{
    struct texture textures[2] = {{0}};
    const uint32_t most = 4 * tiles_at_once(&run->input->frame->lattice_dims,
                                            run->input->gpu->context.info.max_texture_3d);
    brume_result result = BRUME_OK;
    for (uint32_t from = 0; from < run->count && result == BRUME_OK; from += most)
        result =
            iterate_some(run, from, from + most < run->count ? from + most : run->count, textures);
    for (int i = 0; i < 2; ++i)
        texture_finish(&run->input->gpu->memory, &textures[i]);
    return result;
}
