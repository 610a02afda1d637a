/* SPDX-License-Identifier: GPL-3.0-or-later */
/* LPV: multiple scattering by light carried from cell to cell, after "Light Propagation Volumes with
 * scattering"; docs/methods/lpv.md. Single scattering is OPV's. */
#include "transport/lpv.h"
#include "base/result.h"
#include "transport/method.h"

#include <math.h>
#include <stdlib.h>

#define MOST_ITERATIONS 2000
#define ITERATIONS_A_LOOK 4
/* Of the power that has flown in all, what may still be to come. */
#define CONVERGED 0.005

static brume_result lattice_texture(struct lpv_work *work, struct texture *texture, GLenum format,
                                    int across, const char *label)
{
    const ivec4 dims = work->input->frame->field_dims;
    return texture_init(&work->input->gpu->memory, texture, FOR_TRANSPORT, GL_TEXTURE_3D, format,
                        texture_side(across * dims.x), texture_side(dims.y), texture_side(dims.z),
                        1, label);
}

static brume_result make(struct lpv_work *work)
{
    const ivec4 dims = work->input->frame->field_dims;
    static const char *const labels[] = {"cells' extinction", "cells' albedo", "cells' surfaces"};
    work->tiles = (int)ceil(sqrt((double)dims.z));
    const int rows = (dims.z + work->tiles - 1) / work->tiles;
    for (int c = 0; c < 3; ++c) {
        TRY(lattice_texture(work, &work->flow[0][c], GL_RGBA32F, 1, "light in flight"));
        TRY(lattice_texture(work, &work->flow[1][c], GL_RGBA32F, 1, "light in flight"));
        TRY(lattice_texture(work, &work->sums[c], GL_RGBA32F, 1, "light that passed"));
        TRY(lattice_texture(work, &work->cells[c], GL_RGBA16F, 1, labels[c]));
        TRY(texture_init(&work->input->gpu->memory, &work->reflected[c], FOR_TRANSPORT,
                         GL_TEXTURE_2D, GL_RGBA32F, texture_side(work->tiles * dims.x),
                         texture_side(rows * dims.y), 1, 1, "reflected light"));
    }
    TRY(lattice_texture(work, &work->links, GL_R32UI, 1, "cut links"));
    return lattice_texture(work, &work->walls, GL_R32UI, 4, "surfaces' reflectances");
}

static void finish(struct lpv_work *work)
{
    struct memory *memory = &work->input->gpu->memory;
    for (int c = 0; c < 3; ++c) {
        texture_finish(memory, &work->flow[0][c]);
        texture_finish(memory, &work->flow[1][c]);
        texture_finish(memory, &work->sums[c]);
        texture_finish(memory, &work->cells[c]);
        texture_finish(memory, &work->reflected[c]);
    }
    texture_finish(memory, &work->links);
    texture_finish(memory, &work->walls);
    lpv_fuzzy_finish(work);
    buffer_finish(memory, &work->powers);
    buffer_finish(memory, &work->passes.block);
}

static void bind_images(int slot, const struct texture textures[3], GLenum access, GLenum format)
{
    for (int c = 0; c < 3; ++c)
        glBindImageTexture((GLuint)(slot + c), textures[c].id, 0, GL_TRUE, 0, access, format);
}

static void bind_textures(int slot, const struct texture textures[3])
{
    for (int c = 0; c < 3; ++c)
        glBindTextureUnit((GLuint)(slot + c), textures[c].id);
}

static brume_result over_lattice(struct lpv_work *work, const char *stem, ivec4 offset)
{
    const struct transport_input *input = work->input;
    const struct program *program;
    TRY(program_compute(&input->gpu->programs, stem, &program));
    return opv_slabs(&work->passes, program, (struct gpu_lattice_pass){.offset = offset},
                     &input->frame->field_dims, 0.0f, 0.0f);
}

static brume_result fill_cells(struct lpv_work *work)
{
    glBindTextureUnit(SLOT_WALLS, work->walls.id);
    bind_images(SLOT_OUTPUT, work->cells, GL_WRITE_ONLY, GL_RGBA16F);
    TRY(over_lattice(work, "lpv_medium", (ivec4){work->media, 0, 0, 0}));
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    return BRUME_OK;
}

static brume_result begin(struct lpv_work *work, struct transport *transport)
{
    static const float nothing[4];
    transport_bind(transport); /* depths and sky, as OPV has just found them */
    bind_textures(SLOT_REFLECTED, work->reflected);
    bind_images(SLOT_OUTPUT, work->flow[0], GL_WRITE_ONLY, GL_RGBA32F);
    TRY(over_lattice(work, "lpv_scatter", (ivec4){work->media, work->tiles, 0, 0}));
    for (int c = 0; c < 3; ++c)
        glClearTexImage(work->sums[c].id, 0, GL_RGBA, GL_FLOAT, nothing);
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
    return BRUME_OK;
}

static int groups(int cells, int group)
{
    return (cells + group - 1) / group;
}

static uint32_t group_count(const ivec4 *dims)
{
    return (uint32_t)(groups(dims->x, GROUP_LANES) * groups(dims->y, GROUP_CELLS) *
                      groups(dims->z, GROUP_CELLS));
}

/* What the last iteration left in flight, W of all colours. */
static brume_result in_flight(struct lpv_work *work, double *power)
{
    const uint32_t count = group_count(&work->input->frame->field_dims);
    float *parts = malloc(count * sizeof *parts);
    if (!parts)
        return fail(BRUME_E_MEMORY, "no memory for %u sums", count);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    glGetNamedBufferSubData(work->powers.id, 0, (GLsizeiptr)(count * sizeof *parts), parts);
    *power = 0.0;
    for (uint32_t i = 0; i < count; ++i)
        *power += (double)parts[i];
    free(parts);
    return BRUME_OK;
}

/* Whether what is to come, as far as the last iterations tell, no longer counts. */
struct convergence {
    double before, flown;
};

static bool converged(struct convergence *so_far, double power)
{
    const double ratio =
        so_far->before > 0.0 ? pow(power / so_far->before, 1.0 / ITERATIONS_A_LOOK) : 1.0;
    so_far->before = power;
    so_far->flown += power * ITERATIONS_A_LOOK;
    if (!(power > 0.0))
        return true;
    return ratio < 1.0 && power * ratio / (1.0 - ratio) < CONVERGED * so_far->flown;
}

static brume_result propagate(struct lpv_work *work)
{
    const struct transport_input *input = work->input;
    const char *stem = lpv_is_fuzzy(work) ? "lpv_propagate_fuzzy" : "lpv_propagate";
    const int wanted = input->settings->iterations;
    const int most = wanted > 0 ? wanted : MOST_ITERATIONS;
    struct convergence so_far = {0};
    const uint32_t count = group_count(&input->frame->field_dims);
    TRY(buffer_init(&input->gpu->memory, &work->powers, FOR_TRANSPORT, count * sizeof(float), NULL,
                    "powers in flight"));
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, SLOT_POWERS, work->powers.id);
    glBindTextureUnit(SLOT_CELL_EXTINCT, work->cells[0].id);
    glBindTextureUnit(SLOT_CELL_ALBEDO, work->cells[1].id);
    glBindTextureUnit(SLOT_WALLS, work->cells[2].id);
    glBindTextureUnit(SLOT_LINKS, work->links.id);
    glBindTextureUnit(SLOT_BLOCKED, work->fuzzy.factors.id);
    bind_images(SLOT_OUTPUT_FIELD, work->sums, GL_READ_WRITE, GL_RGBA32F);
    for (int i = 0; i < most; ++i) {
        const bool look = wanted <= 0 && i % ITERATIONS_A_LOOK == ITERATIONS_A_LOOK - 1;
        bind_textures(SLOT_FLOW, work->flow[i % 2]);
        bind_images(SLOT_OUTPUT, work->flow[(i + 1) % 2], GL_WRITE_ONLY, GL_RGBA32F);
        TRY(over_lattice(work, stem, (ivec4){look, 1, 0, 0}));
        glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
        ++input->stats->iterations;
        double power = 0.0;
        if (look)
            TRY(in_flight(work, &power));
        if (look && converged(&so_far, power))
            break;
    }
    return BRUME_OK;
}

static brume_result hand_over(struct lpv_work *work, struct transport *transport)
{
    const struct transport_input *input = work->input;
    const ivec4 dims = input->frame->field_dims;
    const struct program *program;
    TRY(texture_ensure(&input->gpu->memory, &transport->field, FOR_TRANSPORT, GL_TEXTURE_3D,
                       GL_RGBA32F, texture_side(4 * dims.x), texture_side(dims.y),
                       texture_side(dims.z), 1, "field"));
    TRY(program_compute(&input->gpu->programs, "lpv_finish", &program));
    bind_textures(SLOT_FLOW, work->sums);
    glBindTextureUnit(SLOT_LINKS, work->links.id);
    glBindImageTexture(SLOT_OUTPUT, transport->field.id, 0, GL_TRUE, 0, GL_WRITE_ONLY, GL_RGBA32F);
    program_dispatch(program, dims.x, dims.y, dims.z);
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    return BRUME_OK;
}

static brume_result find(struct lpv_work *work, struct transport *transport)
{
    TRY(make(work));
    TRY(lpv_cut_links(work));
    TRY(fill_cells(work));
    if (lpv_is_fuzzy(work))
        TRY(lpv_fuzzy_begin(work));
    TRY(lpv_reflect(work));
    if (lpv_is_fuzzy(work))
        TRY(lpv_fuzzy_prepare(work));
    TRY(begin(work, transport));
    TRY(propagate(work));
    return hand_over(work, transport);
}

brume_result lpv_run(struct transport *transport, const struct transport_input *input)
{
    TRY(opv_run(transport, input));
    if (!input->frame->field_dims.w) {
        texture_finish(&input->gpu->memory, &transport->field);
        return BRUME_OK;
    }
    struct lpv_work work = {
        .input = input,
        .passes = {.input = input, .done = 1.0f, .share = 0.5f},
        .media = input->settings->light_paths == BRUME_PATHS_ALL,
    };
    const brume_result result = find(&work, transport);
    finish(&work);
    return result;
}
