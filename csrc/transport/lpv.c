/* SPDX-License-Identifier: GPL-3.0-or-later */
/* LPV: multiple scattering by light carried from cell to cell, after "Light Propagation Volumes
 * with scattering"; docs/methods/lpv.md. Single scattering is OPV's. */
#include "transport/lpv.h"
#include "base/result.h"
#include "gl/timer.h"
#include "transport/method.h"

#include <math.h>
#include <stdlib.h>

#define MOST_ITERATIONS 2000
#define ITERATIONS_A_LOOK 4
#define USUAL_ITERATIONS 64
/* Of the power that flies in all, what may be wrong of what is not waited for. */
#define CONVERGED 0.003
#define SMALL_REST 0.1

static size_t cell_count(const ivec4 *dims)
{
    return (size_t)dims->x * (size_t)dims->y * (size_t)dims->z;
}

static brume_result lattice_texture(struct lpv_work *work, struct texture *texture, GLenum format,
                                    int across, const char *label)
{
    const ivec4 dims = work->field->dims;
    return texture_init(&work->input->gpu->memory, texture, FOR_TRANSPORT, GL_TEXTURE_3D, format,
                        texture_side(across * dims.x), texture_side(dims.y), texture_side(dims.z),
                        1, label);
}

/* Otherwise the lattice knows surfaces alone. */
static int with_media(const struct lpv_work *work)
{
    return work->input->settings->light_paths == BRUME_PATHS_ALL;
}

static brume_result make(struct lpv_work *work)
{
    const ivec4 dims = work->field->dims;
    TRY(buffer_init(&work->input->gpu->memory, &work->level, FOR_TRANSPORT, sizeof *work->field,
                    work->field, "lattice"));
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
    if (with_media(work))
        TRY(buffer_init(&work->input->gpu->memory, &work->scattered, FOR_TRANSPORT,
                        cell_count(&dims) * 3 * sizeof(vec4), NULL, "scattered light"));
    TRY(buffer_init(&work->input->gpu->memory, &work->powers, FOR_TRANSPORT,
                    cell_count(&dims) * sizeof(float), NULL, "powers in flight"));
    TRY(texture_init(&work->input->gpu->memory, &work->links, FOR_TRANSPORT, GL_TEXTURE_3D,
                     GL_R32UI, texture_side(dims.x + 2), texture_side(dims.y + 2),
                     texture_side(dims.z + 2), 1, "cut links")); /* of the cells around, too */
    if (work->around)
        TRY(texture_init(&work->input->gpu->memory, &work->cells_around, FOR_TRANSPORT,
                         GL_TEXTURE_3D, GL_RGBA8UI, texture_side(dims.x + 2),
                         texture_side(dims.y + 2), texture_side(dims.z + 2), 1, "cells around"));
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
    texture_finish(memory, &work->cells_around);
    texture_finish(memory, &work->walls);
    lpv_fuzzy_finish(work);
    buffer_finish(memory, &work->scattered);
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
    const size_t count = cell_count(&work->field->dims);
    float *parts = malloc(count * sizeof *parts);
    if (!parts)
        return fail(BRUME_E_MEMORY, "no memory for %zu powers", count);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    glGetNamedBufferSubData(work->powers.id, 0, (GLsizeiptr)(count * sizeof *parts), parts);
    *power = 0.0;
    for (size_t i = 0; i < count; ++i)
        *power += (double)parts[i];
    free(parts);
    return BRUME_OK;
}

static void bind_level(const struct lpv_work *work)
{
    glBindBufferBase(GL_UNIFORM_BUFFER, SLOT_LEVEL, work->level.id);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, SLOT_POWERS, work->powers.id);
}

/* What media scatter. */
static brume_result scatter(struct lpv_work *work)
{
    if (!with_media(work))
        return BRUME_OK;
    laps_go(work->laps, BRUME_FIELD_SCATTERED);
    const bool sky = work->input->frame->sky_dims.w != 0;
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, SLOT_SCATTERED_FLOWS, work->scattered.id);
    TRY(over_field(work, sky ? "lpv_scatter:SKY" : "lpv_scatter", (ivec4){0}));
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    return BRUME_OK;
}

static brume_result begin(struct lpv_work *work)
{
    laps_go(work->laps, BRUME_FIELD_AGGREGATE);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, SLOT_SCATTERED_FLOWS, work->scattered.id);
    bind_textures(SLOT_REFLECTED, work->reflected);
    bind_images(SLOT_OUTPUT, work->flow[0], GL_WRITE_ONLY, GL_RGBA32F);
    TRY(over_field(work, "lpv_aggregate", (ivec4){work->tiles, with_media(work), 0, 0}));
    laps_go(work->laps, BRUME_FIELD_PREPARE);
    if (!work->around)
        TRY(in_flight(work, &work->input->stats->power_begun));
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

/* `counts`: what this iteration's light counts in the field. Into *power what is in flight after
 * it, unless that is NULL: to look takes time. */
static brume_result iterate(struct lpv_work *work, double counts, double *power)
{
    const union {
        float value;
        int bits;
    } times = {(float)counts};
    const struct lpv_work *around = work->around;
    const int now = work->iterations % 2;
    bind_level(work);
    bind_textures(SLOT_FLOW, work->flow[now]);
    glBindTextureUnit(SLOT_CELL_EXTINCT, work->cells[0].id);
    glBindTextureUnit(SLOT_CELL_ALBEDO, work->cells[1].id);
    glBindTextureUnit(SLOT_WALLS, work->cells[2].id);
    glBindTextureUnit(SLOT_LINKS, work->links.id);
    glBindTextureUnit(SLOT_BLOCKED, work->fuzzy.factors.id);
    if (around) { /* what it began its own iteration with, which has just ended */
        bind_textures(SLOT_FLOW_AROUND, around->flow[(around->iterations - 1) % 2]);
        glBindTextureUnit(SLOT_AROUND, work->cells_around.id);
    }
    bind_images(SLOT_OUTPUT, work->flow[!now], GL_WRITE_ONLY, GL_RGBA32F);
    bind_images(SLOT_OUTPUT_FIELD, work->sums, GL_READ_WRITE, GL_RGBA32F);
    TRY(over_field(work, lpv_is_fuzzy(work) ? "lpv_propagate_fuzzy" : "lpv_propagate",
                   (ivec4){power != NULL, times.bits, around != NULL, 0}));
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
    ++work->iterations;
    return power ? in_flight(work, power) : BRUME_OK;
}

/* One iteration of a lattice, and two of the one within it, whose cells are half as long. */
static brume_result step(struct lpv_work *work, double counts, double *power)
{
    TRY(iterate(work, counts, power));
    for (int i = 0; work->within && i < 2; ++i)
        TRY(step(work->within, counts, NULL));
    return BRUME_OK;
}

/* Of the whole lattice, with all in it. */
static brume_result propagate(struct lpv_work *work)
{
    brume_stats *stats = work->input->stats;
    const int wanted = work->input->settings->iterations;
    const int most = wanted > 0 ? wanted : MOST_ITERATIONS;
    struct series so_far = {0};
    double counts = 1.0;
    for (int i = 0; i < most; ++i) {
        const bool look =
            i % ITERATIONS_A_LOOK == ITERATIONS_A_LOOK - 1 || i == most - 1 || counts != 1.0;
        /* Of iterations until it converged nobody knows how many there will be. */
        work->passes.done =
            1.0f + 0.5f * (float)i / (float)(wanted > 0 ? wanted : i + USUAL_ITERATIONS);
        TRY(step(work, counts, look ? &stats->power_in_flight : NULL));
        ++stats->iterations;
        if (counts != 1.0)
            break;
        if (look && wanted <= 0 && settled(&so_far, stats->power_in_flight)) {
            if (!(so_far.power > 0.0))
                break;
            counts = 1.0 / (1.0 - so_far.ratio); /* the next one stands for all that would follow */
        }
    }
    return BRUME_OK;
}

static brume_result hand_over(const struct lpv_work *work)
{
    const ivec4 dims = work->field->dims;
    const struct program *program;
    laps_go(work->laps, BRUME_FIELD_COPY);
    TRY(program_compute(&work->input->gpu->programs, "lpv_finish", &program));
    bind_level(work);
    bind_textures(SLOT_FLOW, work->sums);
    glBindTextureUnit(SLOT_LINKS, work->links.id);
    glBindTextureUnit(SLOT_WALLS, work->walls.id);
    glBindImageTexture(SLOT_OUTPUT, work->product->id, 0, GL_TRUE, 0, GL_WRITE_ONLY, GL_RGBA32F);
    program_dispatch(program, dims.x, dims.y, dims.z);
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    return BRUME_OK;
}

/* Which cells of the lattice around this one lie beyond its sides. */
static brume_result look_around(struct lpv_work *work)
{
    const ivec4 dims = work->field->dims, more = {dims.x + 2, dims.y + 2, dims.z + 2, 0};
    TRY(hand_over(work->around)); /* tells which side of surfaces its cells are on, so far */
    laps_go(work->laps, BRUME_FIELD_PREPARE);
    bind_level(work);
    glBindImageTexture(SLOT_OUTPUT, work->cells_around.id, 0, GL_TRUE, 0, GL_WRITE_ONLY,
                       GL_RGBA8UI);
    const int around = (int)(work->around->field - work->input->frame->fields);
    TRY(lpv_over_lattice(work, "lpv_around", (ivec4){around, 0, 0, 0}, &more));
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    return BRUME_OK;
}

/* All that iterations need. */
static brume_result prepare(struct lpv_work *work)
{
    TRY(make(work));
    bind_level(work);
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
    TRY(scatter(work));
    TRY(begin(work));
    return work->around ? look_around(work) : BRUME_OK;
}

static brume_result find(struct lpv_work *works, int levels)
{
    for (int i = 0; i < levels; ++i)
        TRY(prepare(&works[i]));
    laps_go(works->laps, BRUME_FIELD_ITERATIONS);
    TRY(propagate(works));
    for (int i = 0; i < levels; ++i)
        TRY(hand_over(&works[i]));
    return BRUME_OK;
}

void lpv_product_size(const struct gpu_frame *frame, int size[3])
{
    size[0] = size[1] = size[2] = 0;
    for (int i = 0; i < frame->field.x; ++i) {
        const ivec4 dims = frame->fields[i].dims;
        size[0] = dims.x > size[0] ? dims.x : size[0];
        size[1] = dims.y > size[1] ? dims.y : size[1];
        size[2] = dims.w + dims.z;
    }
}

brume_result lpv_make_product(struct texture *product, const struct transport_input *input)
{
    int size[3];
    lpv_product_size(input->frame, size);
    return texture_ensure(&input->gpu->memory, product, FOR_TRANSPORT, GL_TEXTURE_3D, GL_RGBA32F,
                          texture_side(4 * size[0]), texture_side(size[1]), texture_side(size[2]),
                          1, "field");
}

brume_result lpv_run(struct transport *transport, const struct transport_input *input)
{
    TRY(opv_run(transport, input));
    const int levels = input->frame->field.x;
    if (!levels)
        return BRUME_OK;
    TRY(lpv_make_product(&transport->field, input));
    transport_bind(transport); /* depths and sky, as OPV has just found them */
    struct laps laps = {.sums_ms = input->stats->field_ms};
    struct lpv_work works[FIELD_LEVELS] = {0};
    for (int i = 0; i < levels; ++i)
        works[i] = (struct lpv_work){
            .input = input,
            .field = &input->frame->fields[i],
            .around = i ? &works[i - 1] : NULL,
            .within = i + 1 < levels ? &works[i + 1] : NULL,
            .product = &transport->field,
            .laps = &laps,
            .passes = {.input = input, .done = 1.0f}, /* after the depths */
        };
    const brume_result result = find(works, levels);
    for (int i = 0; i < levels; ++i)
        finish(&works[i]);
    laps_end(&laps);
    return result;
}
