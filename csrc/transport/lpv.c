/* SPDX-License-Identifier: GPL-3.0-or-later */
/* LPV: multiple scattering by light carried from cell to cell, after "Light Propagation Volumes
 * with scattering"; docs/methods/lpv.md. Single scattering is OPV's. */
#include "transport/lpv.h"
#include "base/hash.h"
#include "base/result.h"
#include "gl/timer.h"
#include "transport/method.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MOST_ITERATIONS 2000
#define ITERATIONS_A_LOOK 4
#define USUAL_ITERATIONS 64
/* Of the power that flies in all, what may be wrong of what is not waited for. */
#define CONVERGED 0.003
#define SMALL_REST 0.1

static int groups(int cells, int group)
{
    return (cells + group - 1) / group;
}

static uint32_t group_count(const ivec4 *dims)
{
    return (uint32_t)(groups(dims->x, GROUP_LANES) * groups(dims->y, GROUP_CELLS) *
                      groups(dims->z, GROUP_CELLS));
}

static brume_result lattice_texture(struct lpv_work *work, struct texture *texture, GLenum format,
                                    int across, const char *label)
{
    const ivec4 dims = work->field->dims;
    return texture_init(&work->input->gpu->memory, texture, FOR_TRANSPORT, GL_TEXTURE_3D, format,
                        texture_side(across * dims.x), texture_side(dims.y), texture_side(dims.z),
                        1, label);
}

static brume_result make(struct lpv_work *work)
{
    const ivec4 dims = work->field->dims;
    TRY(buffer_init(&work->input->gpu->memory, &work->level, FOR_TRANSPORT, sizeof *work->field,
                    work->field, "lattice"));
    glBindBufferBase(GL_UNIFORM_BUFFER, SLOT_LEVEL, work->level.id);
    static const char *const labels[] = {"cells' extinction", "cells' albedo", "cells' surfaces"};
    work->tiles = (int)ceil(sqrt((double)dims.z));
    const int rows = lpv_tile_rows(&dims, work->tiles);
    for (int c = 0; c < 3; ++c) {
        TRY(lattice_texture(work, &work->flow[0][c], GL_RGBA32F, 1, "light in flight"));
        TRY(lattice_texture(work, &work->flow[1][c], GL_RGBA32F, 1, "light in flight"));
        TRY(lattice_texture(work, &work->sums[c], GL_RGBA32F, 1, "light that passed"));
        TRY(lattice_texture(work, &work->cells[c], GL_RGBA16F, 1, labels[c]));
        TRY(texture_init(&work->input->gpu->memory, &work->reflected[c], FOR_TRANSPORT,
                         GL_TEXTURE_2D, GL_RGBA32F, texture_side(work->tiles * dims.x),
                         texture_side(rows * dims.y), 1, 1, "reflected light"));
    }
    TRY(buffer_init(&work->input->gpu->memory, &work->powers, FOR_TRANSPORT,
                    group_count(&dims) * sizeof(float), NULL, "powers in flight"));
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, SLOT_POWERS, work->powers.id);
    TRY(texture_init(&work->input->gpu->memory, &work->links, FOR_TRANSPORT, GL_TEXTURE_3D,
                     GL_R32UI, texture_side(dims.x + 2), texture_side(dims.y + 2),
                     texture_side(dims.z + 2), 1, "cut links")); /* of the cells around, too */
    return lattice_texture(work, &work->walls, GL_R32UI, WALL_TEXELS, "surfaces' reflectances");
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
    buffer_finish(memory, &work->level);
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

brume_result lpv_over_lattice(struct lpv_work *work, const char *stem, ivec4 offset,
                              const ivec4 *dims)
{
    const struct program *program;
    TRY(program_compute(&work->input->gpu->programs, stem, &program));
    return opv_slabs(&work->passes, program, (struct gpu_lattice_pass){.offset = offset}, dims,
                     0.0f, 0.0f);
}

static brume_result over_field(struct lpv_work *work, const char *stem, ivec4 offset)
{
    return lpv_over_lattice(work, stem, offset, &work->field->dims);
}

/* Otherwise the lattice knows surfaces alone. */
static int with_media(const struct lpv_work *work)
{
    return work->input->settings->light_paths == BRUME_PATHS_ALL;
}

static brume_result fill_cells(struct lpv_work *work)
{
    glBindTextureUnit(SLOT_WALLS, work->walls.id);
    bind_images(SLOT_OUTPUT, work->cells, GL_WRITE_ONLY, GL_RGBA16F);
    TRY(over_field(work, "lpv_medium", (ivec4){with_media(work), 0, 0, 0}));
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    return BRUME_OK;
}

/* What the last iteration left in flight, W of all colours. */
static brume_result in_flight(struct lpv_work *work, double *power)
{
    const uint32_t count = group_count(&work->field->dims);
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

/* What the lattice around this one sends into it, once that one's field is known. */
static brume_result flow_in(struct lpv_work *work)
{
    laps_go(work->laps, BRUME_FIELD_INFLOW);
    bind_images(SLOT_OUTPUT, work->reflected, GL_READ_WRITE, GL_RGBA32F);
    TRY(over_field(work, "lpv_inflow", (ivec4){work->number, work->tiles, 0, 0}));
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
    return BRUME_OK;
}

static brume_result begin(struct lpv_work *work)
{
    static const float nothing[4];
    double begun = 0.0;
    for (int c = 0; c < 3; ++c)
        glClearTexImage(work->sums[c].id, 0, GL_RGBA, GL_FLOAT, nothing);
    bind_images(SLOT_OUTPUT_FIELD, work->sums, GL_READ_WRITE, GL_RGBA32F);
    glBindTextureUnit(SLOT_CELL_EXTINCT, work->cells[0].id);
    glBindTextureUnit(SLOT_CELL_ALBEDO, work->cells[1].id);
    glBindTextureUnit(SLOT_LINKS, work->links.id);
    if (work->number > 0)
        TRY(flow_in(work));
    laps_go(work->laps, BRUME_FIELD_SCATTERED);
    bind_textures(SLOT_REFLECTED, work->reflected);
    bind_images(SLOT_OUTPUT, work->flow[0], GL_WRITE_ONLY, GL_RGBA32F);
    TRY(over_field(work, "lpv_scatter", (ivec4){with_media(work), work->tiles, 0, 0}));
    TRY(in_flight(work, &begun));
    if (work->number == 0)
        work->input->stats->power_begun = begun;
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
    return BRUME_OK;
}

/* What is in flight falls, in the end, by the same ratio in every iteration, everywhere alike: the
 * rest of the series is then known. */
struct series {
    double power, ratio,
        change;   /* W in flight; an iteration's to that before it; its last change */
    double flown; /* W, all iterations together */
};

/* Whether the rest is known well enough: not before it is a small part of all, for where it is must
 * have settled, too; and then as far as the ratio has, which comes nearer to its end by a ratio of
 * its own. */
static bool settled(struct series *so_far, double power)
{
    const double ratio =
        so_far->power > 0.0 ? pow(power / so_far->power, 1.0 / ITERATIONS_A_LOOK) : 1.0;
    const double change = fabs(ratio - so_far->ratio), left = 1.0 - ratio;
    const double nearer = so_far->change > 0.0 ? fmin(change / so_far->change, 0.95) : 0.95;
    const double to_come = change * nearer / (1.0 - nearer);
    *so_far = (struct series){power, ratio, change, so_far->flown + power * ITERATIONS_A_LOOK};
    if (!(power > 0.0))
        return true;
    if (!(left > 0.0) || power / left > SMALL_REST * so_far->flown)
        return false;
    return power / left * fmin(to_come / left, 1.0) < CONVERGED * so_far->flown;
}

/* `counts`: what this iteration's light counts in the field. Into *power what is in flight after it,
 * unless that is NULL: to look takes time. */
static brume_result iterate(struct lpv_work *work, int number, double counts, double *power)
{
    const union {
        float value;
        int bits;
    } times = {(float)counts};
    /* Of iterations until it converged nobody knows how many there will be. */
    const int wanted = work->input->settings->iterations;
    const int all = wanted > 0 ? wanted : number + USUAL_ITERATIONS;
    const int levels = work->input->frame->field.x;
    work->passes.done =
        1.0f + 0.5f * ((float)work->number + (float)number / (float)all) / (float)levels;
    bind_textures(SLOT_FLOW, work->flow[number % 2]);
    bind_images(SLOT_OUTPUT, work->flow[(number + 1) % 2], GL_WRITE_ONLY, GL_RGBA32F);
    TRY(over_field(work, lpv_is_fuzzy(work) ? "lpv_propagate_fuzzy" : "lpv_propagate",
                     (ivec4){power != NULL, times.bits, 0, 0}));
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
    ++work->input->stats->iterations;
    return power ? in_flight(work, power) : BRUME_OK;
}

/* Into *power what is left in flight at the end. */
static brume_result go_on(struct lpv_work *work, double *power)
{
    const int wanted = work->input->settings->iterations;
    const int most = wanted > 0 ? wanted : MOST_ITERATIONS;
    struct series so_far = {0};
    for (int i = 0; i < most; ++i) {
        const bool look = i % ITERATIONS_A_LOOK == ITERATIONS_A_LOOK - 1 || i == most - 1;
        TRY(iterate(work, i, 1.0, look ? power : NULL));
        if (look && wanted <= 0 && settled(&so_far, *power))
            /* The next iteration stands for all that would follow. */
            return so_far.power > 0.0 ? iterate(work, i + 1, 1.0 / (1.0 - so_far.ratio), power)
                                      : BRUME_OK;
    }
    return BRUME_OK;
}

static brume_result propagate(struct lpv_work *work)
{
    double power = 0.0;
    glBindTextureUnit(SLOT_WALLS, work->cells[2].id);
    glBindTextureUnit(SLOT_BLOCKED, work->fuzzy.factors.id);
    TRY(go_on(work, &power));
    if (work->number == 0)
        work->input->stats->power_in_flight = power;
    return BRUME_OK;
}

static brume_result hand_over(struct lpv_work *work, struct transport *transport)
{
    const ivec4 dims = work->field->dims;
    const struct program *program;
    laps_go(work->laps, BRUME_FIELD_COPY);
    TRY(program_compute(&work->input->gpu->programs, "lpv_finish", &program));
    bind_textures(SLOT_FLOW, work->sums);
    glBindTextureUnit(SLOT_LINKS, work->links.id);
    glBindTextureUnit(SLOT_WALLS, work->walls.id);
    glBindImageTexture(SLOT_OUTPUT, transport->field.id, 0, GL_TRUE, 0, GL_WRITE_ONLY, GL_RGBA32F);
    program_dispatch(program, dims.x, dims.y, dims.z);
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    return BRUME_OK;
}

static brume_result find(struct lpv_work *work, struct transport *transport)
{
    TRY(make(work));
    laps_go(work->laps, BRUME_FIELD_SURFACES);
    TRY(lpv_cut_links(work));
    laps_go(work->laps, BRUME_FIELD_MEDIUM);
    TRY(fill_cells(work));
    if (lpv_is_fuzzy(work))
        TRY(lpv_fuzzy_begin(work));
    TRY(lpv_reflect(work));
    laps_go(work->laps, BRUME_FIELD_PREPARE);
    if (lpv_is_fuzzy(work))
        TRY(lpv_fuzzy_prepare(work));
    TRY(begin(work));
    laps_go(work->laps, BRUME_FIELD_ITERATIONS);
    TRY(propagate(work));
    return hand_over(work, transport);
}

/* The texture of all lattices, one above the other. What it held is lost when its size changes. */
static brume_result make_field(struct transport *transport, const struct transport_input *input)
{
    const struct gpu_frame *frame = input->frame;
    struct texture *field = &transport->field;
    int size[3] = {0};
    for (int i = 0; i < frame->field.x; ++i) {
        const ivec4 dims = frame->fields[i].dims;
        size[0] = dims.x > size[0] ? dims.x : size[0];
        size[1] = dims.y > size[1] ? dims.y : size[1];
        size[2] = dims.w + dims.z;
    }
    const int width = texture_side(4 * size[0]), height = texture_side(size[1]),
              depth = texture_side(size[2]);
    if (!field->id || field->width != width || field->height != height || field->depth != depth)
        memset(transport->field_signatures, 0, sizeof transport->field_signatures);
    return texture_ensure(&input->gpu->memory, field, FOR_TRANSPORT, GL_TEXTURE_3D, GL_RGBA32F,
                          width, height, depth, 1, "field");
}

static brume_result one_level(struct transport *transport, const struct transport_input *input,
                              int number, struct laps *laps)
{
    struct lpv_work work = {
        .input = input,
        .field = &input->frame->fields[number],
        .number = number,
        .laps = laps,
        .passes = {.input = input, .done = 1.0f}, /* after the depths */
    };
    const brume_result result = find(&work, transport);
    finish(&work);
    return result;
}

brume_result lpv_run(struct transport *transport, const struct transport_input *input)
{
    TRY(opv_run(transport, input));
    const struct gpu_frame *frame = input->frame;
    if (!frame->field.x)
        return BRUME_OK;
    TRY(make_field(transport, input));
    transport_bind(transport); /* depths and sky, as OPV has just found them */
    struct laps laps = {.sums_ms = input->stats->field_ms};
    uint64_t wanted = input->signature;
    brume_result result = BRUME_OK;
    for (int i = 0; i < frame->field.x && result == BRUME_OK; ++i) {
        wanted = hash_bytes(wanted, &frame->fields[i], sizeof frame->fields[i]);
        if (transport->field_signatures[i] == wanted)
            continue; /* nor has what is around it changed */
        transport->field_signatures[i] = 0;
        result = one_level(transport, input, i, &laps);
        if (result == BRUME_OK)
            transport->field_signatures[i] = wanted;
    }
    laps_end(&laps);
    return result;
}
