/* SPDX-License-Identifier: GPL-3.0-or-later */
/* DOM: multiple scattering by discrete ordinates, which converges to the truth;
 * docs/methods/dom.md. Optical depths towards the lamps are OPV's, surfaces' cuts and reflections
 * LPV's. */
#include "transport/dom.h"
#include "base/hash.h"
#include "base/result.h"
#include "gl/timer.h"
#include "transport/method.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MOST_ITERATIONS 100
/* Iterations also end when for so many no less was left to find, and it is less than so many times
 * what may be: rounding is all that is left. */
#define STALLED 4
#define NEARLY 10.0
#define STEPS 32 /* of diffusion, at most */

struct dom_work {
    struct lpv_work cells;         /* the lattice: what it is filled with, and its surfaces */
    const struct dom_work *around; /* the lattice around, whose light is known; or NULL */
    int number;                    /* of the lattice, from outside */
    bool surrounded;               /* whether surfaces stand beyond the outermost one's sides, */
    struct texture surroundings;   /* which this shows then, of the outermost */
    bool has_within;               /* whether another stands in it */
    int count, axes[3];            /* ordinates: all, and by their major axes */
    vec4 directions[MOST_ORDINATES], sky[MOST_ORDINATES]; /* the world's radiance along each */
    int across;                                           /* tiles of theirs along z */
    struct buffer ordinates, dots;
    struct texture sources, means, hits;    /* by ordinates */
    struct texture world_means;             /* the same of the world's own light, for one within */
    struct texture slices[2];               /* what leaves a slice of cells */
    bool warm;                              /* whether iterations begin with what was known */
    struct texture cuts;                    /* what surfaces do to links */
    struct texture wall;                    /* radiance of surfaces */
    struct texture emission;                /* of surfaces */
    struct texture depths, missing[3];      /* for diffusion: of cells; the fluence, by steps */
    struct texture first, world, now, next; /* moments: of the first source, of the world's own
                                               light, of what an iteration begins with, and finds */
    struct texture residuals[HISTORY], results[HISTORY]; /* bands 0, 1, surfaces */
    int slots[HISTORY], kept;                            /* which of these, from the oldest on */
    double products[3][HISTORY][HISTORY];                /* of residuals, by slots, colours apart */
};

static brume_result lattice_texture(struct dom_work *work, struct texture *texture, GLenum format,
                                    int across, int up, int deep, const char *label)
{
    const ivec4 dims = work->cells.field->dims;
    return texture_init(&work->cells.input->gpu->memory, texture, FOR_TRANSPORT, GL_TEXTURE_3D,
                        format, texture_side(across * dims.x), texture_side(up * dims.y),
                        texture_side(deep * dims.z), 1, label);
}

int dom_longest_side(const ivec4 *dims)
{
    const int most = dims->x > dims->y ? dims->x : dims->y;
    return most > dims->z ? most : dims->z;
}

static void clear(const struct texture *texture)
{
    static const float nothing[4];
    glClearTexImage(texture->id, 0, GL_RGBA, GL_FLOAT, nothing);
}

static brume_result make_cells(struct dom_work *work)
{
    struct lpv_work *cells = &work->cells;
    struct memory *memory = &cells->input->gpu->memory;
    const ivec4 dims = cells->field->dims;
    static const char *const labels[] = {"cells' extinction", "cells' albedo", "cells' surfaces"};
    TRY(buffer_init(memory, &cells->level, FOR_TRANSPORT, sizeof *cells->field, cells->field,
                    "lattice"));
    cells->tiles = (int)ceil(sqrt((double)dims.z));
    for (int c = 0; c < 3; ++c) {
        TRY(lattice_texture(work, &cells->cells[c], GL_RGBA16F, 1, 1, 1, labels[c]));
        TRY(texture_init(memory, &cells->reflected[c], FOR_TRANSPORT, GL_TEXTURE_2D, GL_RGBA32F,
                         texture_side(cells->tiles * dims.x),
                         texture_side(lpv_tile_rows(&dims, cells->tiles) * dims.y), 1, 1,
                         "reflected light"));
    }
    TRY(texture_init(memory, &cells->links, FOR_TRANSPORT, GL_TEXTURE_3D, GL_R32UI,
                     texture_side(dims.x + 2), texture_side(dims.y + 2), texture_side(dims.z + 2),
                     1, "cut links"));
    TRY(texture_init(memory, &cells->lines, FOR_TRANSPORT, GL_TEXTURE_3D, GL_R32UI,
                     texture_side(LINE_SIDE * (dims.x + 2)), texture_side(LINE_SIDE * (dims.y + 2)),
                     texture_side(dims.z + 2), 1, "links' lines"));
    TRY(lattice_texture(work, &work->cuts, GL_RGBA32UI, 1, 1, 1, "cells' cut links"));
    TRY(lattice_texture(work, &work->wall, GL_RGBA16F, 1, 1, 1, "surfaces' radiance"));
    TRY(lattice_texture(work, &work->emission, GL_RGBA16F, 1, 1, 1, "surfaces' emission"));
    TRY(lattice_texture(work, &work->depths, GL_RGBA16F, 1, 1, 1, "cells' depths"));
    return lattice_texture(work, &cells->walls, GL_R32UI, WALL_TEXELS, 1, 1,
                           "surfaces' reflectances");
}

/* Whether light comes into the lattice from outside that no lamp of the scene sends there. */
static bool has_world(const struct dom_work *work)
{
    return work->cells.input->world_count > 0 || work->surrounded;
}

/* Once for all lattices: their ordinates are the same, and it takes milliseconds. */
static void find_sky(struct dom_work *work)
{
    const struct transport_input *input = work->cells.input;
    if (work->around)
        memcpy(work->sky, work->around->sky, sizeof work->sky);
    if (work->around || !input->world_count)
        return;
    vec4 towards[MOST_ORDINATES];
    for (int i = 0; i < work->count; ++i) {
        const vec4 direction = work->directions[i];
        towards[i] = (vec4){-direction.x, -direction.y, -direction.z, direction.w};
    }
    world_means(input->world_map, input->world, towards, work->count, work->sky);
}

/* Tiles of ordinates fill a column along z, then the next along y. */
static brume_result make_ordinates(struct dom_work *work)
{
    struct gpu *gpu = work->cells.input->gpu;
    const ivec4 dims = work->cells.field->dims;
    const int limit = gpu->context.info.max_texture_3d;
    const int most = (limit - 1) / dims.z;
    const int columns = (work->count + most - 1) / most;
    work->across = (work->count + columns - 1) / columns;
    if (columns * dims.y >= limit)
        return fail(BRUME_E_UNSUPPORTED,
                    "%d directions of a lattice of %d x %d x %d cells are more than "
                    "this machine's textures hold",
                    work->count, dims.x, dims.y, dims.z);
    struct gpu_ordinates *block = calloc(1, sizeof *block);
    if (!block)
        return fail(BRUME_E_MEMORY, "no memory for ordinates");
    vec4 *directions = work->directions;
    dom_quadrature(work->count, directions, work->axes);
    block->count = (ivec4){work->count, work->across, 0, 0};
    find_sky(work);
    for (int i = 0; i < work->count; ++i) {
        block->list[i].direction = directions[i];
        block->list[i].world = work->sky[i];
        if (work->surrounded)
            dom_place_map(&work->cells, &block->list[i]);
    }
    const brume_result result = buffer_init(&gpu->memory, &work->ordinates, FOR_TRANSPORT,
                                            sizeof *block, block, "ordinates");
    free(block);
    TRY(result);
    TRY(lattice_texture(work, &work->sources, GL_RGBA16F, 1, columns, work->across, "sources"));
    TRY(lattice_texture(work, &work->means, GL_RGBA16F, 1, columns, work->across, "radiance"));
    TRY(lattice_texture(work, &work->hits, GL_RGBA16F, 1, columns, work->across,
                        "light on surfaces"));
    if (work->has_within && has_world(work))
        TRY(lattice_texture(work, &work->world_means, GL_RGBA16F, 1, columns, work->across,
                            "the world's radiance"));
    const int side = dom_longest_side(&dims) + 2;
    for (int i = 0; i < 2; ++i)
        TRY(texture_init(&gpu->memory, &work->slices[i], FOR_TRANSPORT, GL_TEXTURE_3D, GL_RGBA16F,
                         texture_side(side), texture_side(side), texture_side(work->count), 1,
                         "light between slices"));
    return BRUME_OK;
}

static brume_result make_moments(struct dom_work *work)
{
    struct texture *all[] = {&work->first, &work->world, &work->now, &work->next};
    for (size_t i = 0; i < sizeof all / sizeof *all; ++i)
        TRY(lattice_texture(work, all[i], GL_RGBA16F, MOMENT_SIDE, MOMENT_SIDE, 1, "moments"));
    for (int i = 0; i < HISTORY; ++i) {
        TRY(lattice_texture(work, &work->residuals[i], GL_RGBA16F, MIXED, 1, 1, "residuals"));
        TRY(lattice_texture(work, &work->results[i], GL_RGBA16F, MIXED, 1, 1, "results"));
        /* Cells without surfaces never write theirs. */
        clear(&work->residuals[i]);
        clear(&work->results[i]);
    }
    for (size_t i = 0; i < sizeof work->missing / sizeof *work->missing; ++i)
        TRY(lattice_texture(work, &work->missing[i], GL_RGBA16F, 1, 1, 1, "diffusion"));
    const ivec4 dims = work->cells.field->dims;
    return buffer_init(&work->cells.input->gpu->memory, &work->dots, FOR_TRANSPORT,
                       (size_t)dims.y * (size_t)dims.z * (HISTORY + 1) * sizeof(vec4), NULL,
                       "products");
}

static void finish(struct dom_work *work)
{
    struct memory *memory = &work->cells.input->gpu->memory;
    struct lpv_work *cells = &work->cells;
    struct texture *all[] = {&work->sources,    &work->means,        &work->hits,
                             &work->slices[0],  &work->slices[1],    &work->cuts,
                             &work->wall,       &work->first,        &work->world,
                             &work->now,        &work->next,         &cells->links,
                             &cells->walls,     &work->depths,       &work->missing[0],
                             &work->missing[1], &work->missing[2],   &work->world_means,
                             &work->emission,   &work->surroundings, &cells->lines};
    for (size_t i = 0; i < sizeof all / sizeof *all; ++i)
        texture_finish(memory, all[i]);
    for (int i = 0; i < HISTORY; ++i) {
        texture_finish(memory, &work->residuals[i]);
        texture_finish(memory, &work->results[i]);
    }
    for (int c = 0; c < 3; ++c) {
        texture_finish(memory, &cells->cells[c]);
        texture_finish(memory, &cells->reflected[c]);
    }
    buffer_finish(memory, &work->ordinates);
    buffer_finish(memory, &work->dots);
    buffer_finish(memory, &cells->level);
    buffer_finish(memory, &cells->passes.block);
}

/* --- Passes over the lattice ---------------------------------------------------------------- */

static void image(int slot, const struct texture *texture)
{
    glBindImageTexture((GLuint)slot, texture->id, 0, GL_TRUE, 0, GL_WRITE_ONLY, texture->format);
}

static void bind_lattice(const struct dom_work *work)
{
    glBindBufferBase(GL_UNIFORM_BUFFER, SLOT_LEVEL, work->cells.level.id);
    glBindBufferBase(GL_UNIFORM_BUFFER, SLOT_ORDINATES, work->ordinates.id);
    glBindTextureUnit(SLOT_CELL_EXTINCT, work->cells.cells[0].id);
    glBindTextureUnit(SLOT_CELL_ALBEDO, work->cells.cells[1].id);
    glBindTextureUnit(SLOT_CUTS, work->cuts.id);
}

static brume_result over_field(struct dom_work *work, const char *stem, ivec4 offset)
{
    TRY(lpv_over_lattice(&work->cells, stem, offset, &work->cells.field->dims));
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT |
                    GL_TEXTURE_UPDATE_BARRIER_BIT);
    return BRUME_OK;
}

static brume_result prepare(struct dom_work *work)
{
    struct lpv_work *cells = &work->cells;
    const struct program *program;
    TRY(make_cells(work));
    glBindBufferBase(GL_UNIFORM_BUFFER, SLOT_LEVEL, cells->level.id);
    laps_go(cells->laps, BRUME_FIELD_SURFACES);
    TRY(lpv_cut_links(cells));
    laps_go(cells->laps, BRUME_FIELD_MEDIUM);
    glBindTextureUnit(SLOT_WALLS, cells->walls.id);
    glBindTextureUnit(SLOT_LINKS, cells->links.id);
    for (int c = 0; c < 3; ++c)
        image(SLOT_OUTPUT + c, &cells->cells[c]);
    image(SLOT_OUTPUT_FIELD, &work->cuts);
    image(SLOT_OUTPUT_FIELD + 1, &work->depths);
    image(SLOT_OUTPUT_FIELD + 2, &work->emission);
    glBindTextureUnit(SLOT_LINES, cells->lines.id);
    TRY(program_compute(&cells->input->gpu->programs, "dom_cells", &program));
    glProgramUniform1f(program->id, 0, cells->input->geometry->brightest);
    TRY(over_field(work, "dom_cells", (ivec4){0}));
    texture_finish(&cells->input->gpu->memory, &cells->lines); /* before larger ones are needed */
    TRY(make_ordinates(work));
    TRY(make_moments(work));
    TRY(lpv_reflect(cells));
    laps_go(cells->laps, BRUME_FIELD_PREPARE);
    TRY(program_compute(&cells->input->gpu->programs, "dom_ordinates", &program));
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, SLOT_ORDINATES, work->ordinates.id);
    program_dispatch(program, work->count, 1, 1);
    glMemoryBarrier(GL_UNIFORM_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
    glBindBufferBase(GL_UNIFORM_BUFFER, SLOT_ORDINATES, work->ordinates.id);
    if (work->surrounded && !work->around)
        TRY(dom_look_out(cells, work->directions, work->count, &work->surroundings));
    clear(&work->wall);
    clear(&work->now);
    clear(&work->hits);
    return BRUME_OK;
}

/* --- Iterations ----------------------------------------------------------------------------- */

/* What comes from beyond the lattice's sides, around a slice: the world's own light, or of the same
 * kind what the lattice around has there. */
static brume_result come_in(struct dom_work *work, int slice, bool world)
{
    const struct program *program;
    const struct dom_work *around = work->around;
    const int *dims = &work->cells.field->dims.x;
    TRY(program_compute(&work->cells.input->gpu->programs, "dom_border", &program));
    if (work->surroundings.id)
        glBindTextureUnit(SLOT_SURROUNDINGS, work->surroundings.id);
    if (around)
        glBindTextureUnit(SLOT_MEANS_AROUND, world ? around->world_means.id : around->means.id);
    glProgramUniform2i(program->id, 1, around ? around->number : -1, around ? around->across : 1);
    image(SLOT_OUTPUT, &work->slices[slice % 2]);
    for (int axis = 0, begin = 0; axis < 3; begin += work->axes[axis++]) {
        const int wide = dims[(axis + 1) % 3] + 2, high = dims[(axis + 2) % 3] + 2;
        if (slice >= dims[axis])
            continue;
        glProgramUniform4i(program->id, 0, slice, begin, axis,
                           world ? 1 + (work->surroundings.id != 0) : 0);
        program_dispatch(program, slice ? 2 * (wide + high) - 4 : wide * high, 1, work->axes[axis]);
    }
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    return BRUME_OK;
}

/* Light along all ordinates through the whole lattice, slice by slice, into work->means: the
 * world's own alone, or that of sources and surfaces. */
static brume_result sweep(struct dom_work *work, bool world)
{
    const struct program *program;
    const int *dims = &work->cells.field->dims.x;
    const bool open = world || work->around;
    TRY(program_compute(&work->cells.input->gpu->programs, "dom_sweep", &program));
    for (int i = 0; i < 2 && !open; ++i)
        clear(&work->slices[i]);
    bind_lattice(work);
    glBindTextureUnit(SLOT_CELL_WALLS, work->wall.id);
    glBindTextureUnit(SLOT_ANGULAR, work->sources.id);
    image(SLOT_OUTPUT + 2, &work->hits);
    const int most = dom_longest_side(&work->cells.field->dims);
    for (int slice = 0; slice < most; ++slice) {
        TRY(opv_go_on(&work->cells.passes, 0.0f));
        if (open)
            TRY(come_in(work, slice, world));
        image(SLOT_OUTPUT, &work->means);
        glBindTextureUnit(SLOT_SLICE, work->slices[slice % 2].id);
        image(SLOT_OUTPUT + 1, &work->slices[1 - slice % 2]);
        for (int axis = 0, begin = 0; axis < 3; begin += work->axes[axis++]) {
            if (slice >= dims[axis])
                continue;
            glProgramUniform4i(program->id, 0, slice, begin, axis, world);
            program_dispatch(program, dims[(axis + 1) % 3] * dims[(axis + 2) % 3], 1,
                             work->axes[axis]);
        }
        glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
        if (work->cells.input->gpu->context.info.software)
            glFinish(); /* or a cancel would find all of them in the driver's queue */
    }
    return BRUME_OK;
}

/* The moments of work->means, into `moments`; of light from sources also the history's newest. */
static brume_result gather(struct dom_work *work, const struct texture *moments, bool sources)
{
    bind_lattice(work);
    const int newest =
        work->kept ? work->slots[work->kept - 1] : 0; /* the world's leaves no history */
    glBindTextureUnit(SLOT_WALLS, work->cells.cells[2].id);
    glBindTextureUnit(SLOT_ANGULAR, work->means.id);
    glBindTextureUnit(SLOT_HITS, work->hits.id);
    glBindTextureUnit(SLOT_MOMENTS, work->now.id);
    glBindTextureUnit(SLOT_CELL_WALLS, work->wall.id);
    glBindTextureUnit(SLOT_CELL_EMISSION, work->emission.id);
    image(SLOT_OUTPUT, moments);
    image(SLOT_OUTPUT + 1, &work->residuals[newest]);
    image(SLOT_OUTPUT + 2, &work->results[newest]);
    /* Reflected light is bound where moments are. */
    for (int c = 0; c < 3; ++c)
        glBindTextureUnit((GLuint)(SLOT_REFLECTED + c), work->cells.reflected[c].id);
    return over_field(work, "dom_gather", (ivec4){sources, work->cells.tiles, 0, 0});
}

/* Makes room for one more in the history. */
static void begin_entry(struct dom_work *work)
{
    if (work->kept < HISTORY) {
        work->slots[work->kept] = work->kept;
        ++work->kept;
        return;
    }
    const int oldest = work->slots[0];
    memmove(work->slots, work->slots + 1, (HISTORY - 1) * sizeof *work->slots);
    work->slots[HISTORY - 1] = oldest;
}

static void bind_diffusion(const struct dom_work *work, const struct texture *missing)
{
    bind_lattice(work);
    glBindTextureUnit(SLOT_CELL_DEPTHS, work->depths.id);
    glBindTextureUnit(SLOT_WALLS, work->cells.cells[2].id);
    glBindTextureUnit(SLOT_MISSING, missing->id);
    glBindTextureUnit(SLOT_MOMENTS, work->residuals[work->slots[work->kept - 1]].id);
}

/* Adds what the newest result has yet to find where light diffuses, found in as many steps as the
 * lattice is long: with Chebyshev's weights for the modes that fit into it these leave a tenth. Of
 * lattices longer than STEPS longer modes are left to the iterations: thick media take one or two
 * more of these then, but with 64 cells steps would be more than half of each. */
static brume_result diffuse(struct dom_work *work)
{
    const struct program *program;
    const int newest = work->slots[work->kept - 1];
    const int side = dom_longest_side(&work->cells.field->dims);
    const int most = side < STEPS ? side : STEPS;
    /* Eigenvalues: of the longest mode that is looked for, and of the shortest. */
    const double least = 4.0 / ((double)most * most), greatest = 2.0;
    const double middle = 0.5 * (greatest + least), half = 0.5 * (greatest - least);
    double weight = half / middle, inertia = 0.0, forward = 1.0 / middle;
    TRY(program_compute(&work->cells.input->gpu->programs, "dom_diffusion", &program));
    clear(&work->missing[0]);
    clear(&work->missing[1]);
    for (int step = 0; step < most; ++step) {
        bind_diffusion(work, &work->missing[(step + 1) % 3]);
        glBindTextureUnit(SLOT_MISSING + 1, work->missing[step % 3].id);
        image(SLOT_OUTPUT, &work->missing[(step + 2) % 3]);
        glProgramUniform2f(program->id, 0, (float)inertia, (float)forward);
        TRY(over_field(work, "dom_diffusion", (ivec4){0}));
        const double next = 1.0 / (2.0 * middle / half - weight);
        inertia = next * weight;
        forward = 2.0 * next / half;
        weight = next;
    }
    bind_diffusion(work, &work->missing[(most + 1) % 3]);
    glBindImageTexture(SLOT_OUTPUT, work->residuals[newest].id, 0, GL_TRUE, 0, GL_READ_WRITE,
                       GL_RGBA16F);
    glBindImageTexture(SLOT_OUTPUT + 1, work->results[newest].id, 0, GL_TRUE, 0, GL_READ_WRITE,
                       GL_RGBA16F);
    return over_field(work, "dom_correct", (ivec4){0});
}

/* The newest residual's products with all that are kept. Into *change its length over the result's.
 */
static brume_result compare(struct dom_work *work, double *change)
{
    const struct program *program;
    const ivec4 dims = work->cells.field->dims;
    const int newest = work->slots[work->kept - 1];
    TRY(program_compute(&work->cells.input->gpu->programs, "dom_dots", &program));
    bind_lattice(work);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, SLOT_DOTS, work->dots.id);
    for (int i = 0; i < HISTORY; ++i)
        glBindTextureUnit((GLuint)(SLOT_HISTORY + i), work->residuals[i].id);
    glBindTextureUnit(SLOT_MOMENTS, work->results[newest].id);
    TRY(opv_set_pass(&work->cells.passes,
                     (struct gpu_lattice_pass){.offset = {newest, work->kept, 0, 0}}));
    program_dispatch(program, dims.y, dims.z, 1);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);

    const size_t rows = (size_t)dims.y * (size_t)dims.z, count = rows * (HISTORY + 1);
    vec4 *parts = malloc(count * sizeof *parts);
    if (!parts)
        return fail(BRUME_E_MEMORY, "no memory for %zu products", count);
    glGetNamedBufferSubData(work->dots.id, 0, (GLsizeiptr)(count * sizeof *parts), parts);
    double sums[HISTORY + 1][3] = {{0}};
    for (size_t row = 0; row < rows; ++row)
        for (int i = 0; i <= HISTORY; ++i)
            for (int c = 0; c < 3; ++c)
                sums[i][c] += (double)(&parts[row * (HISTORY + 1) + (size_t)i].x)[c];
    free(parts);
    double left = 0.0, all = 0.0;
    for (int c = 0; c < 3; ++c) {
        for (int i = 0; i < work->kept; ++i)
            work->products[c][newest][i] = work->products[c][i][newest] = sums[i][c];
        left += sums[newest][c];
        all += sums[HISTORY][c];
    }
    *change = all > 0.0 ? sqrt(left / all) : 0.0;
    return BRUME_OK;
}

/* What the next iteration begins with, into work->now. */
static brume_result mix(struct dom_work *work)
{
    const struct program *program;
    float shares[HISTORY][3] = {{0}};
    for (int c = 0; c < 3; ++c) {
        double products[HISTORY][HISTORY], found[HISTORY];
        for (int i = 0; i < work->kept; ++i)
            for (int j = 0; j < work->kept; ++j)
                products[i][j] = work->products[c][work->slots[i]][work->slots[j]];
        dom_mix_shares(work->kept, products, found);
        for (int i = 0; i < work->kept; ++i)
            shares[work->slots[i]][c] = (float)found[i];
    }
    TRY(program_compute(&work->cells.input->gpu->programs, "dom_mix", &program));
    bind_lattice(work);
    for (int i = 0; i < HISTORY; ++i)
        glBindTextureUnit((GLuint)(SLOT_HISTORY + i), work->results[i].id);
    glBindTextureUnit(SLOT_MOMENTS, work->next.id);
    image(SLOT_OUTPUT, &work->now);
    image(SLOT_OUTPUT + 1, &work->wall);
    glProgramUniform3fv(program->id, 0, HISTORY, shares[0]);
    return over_field(work, "dom_mix", (ivec4){work->kept, 0, 0, 0});
}

static brume_result begin(struct dom_work *work)
{
    if (has_world(work)) {
        laps_go(work->cells.laps, BRUME_FIELD_SCATTERED);
        TRY(sweep(work, true));
        TRY(gather(work, &work->world, false));
        if (work->has_within) {
            const struct texture *means = &work->means;
            glCopyImageSubData(means->id, GL_TEXTURE_3D, 0, 0, 0, 0, work->world_means.id,
                               GL_TEXTURE_3D, 0, 0, 0, 0, means->width, means->height,
                               means->depth);
        }
    }
    laps_go(work->cells.laps, BRUME_FIELD_SCATTERED);
    bind_lattice(work);
    glBindTextureUnit(SLOT_MOMENTS, work->world.id);
    image(SLOT_OUTPUT, &work->first);
    return over_field(work, "dom_first", (ivec4){has_world(work), 0, 0, 0});
}

static brume_result iterate(struct dom_work *work, double *change)
{
    bind_lattice(work);
    glBindTextureUnit(SLOT_MOMENTS, work->now.id);
    glBindTextureUnit(SLOT_MOMENTS + 1, work->first.id);
    image(SLOT_OUTPUT, &work->sources);
    TRY(over_field(work, "dom_source", (ivec4){0}));
    TRY(sweep(work, false));
    begin_entry(work);
    TRY(gather(work, &work->next, true));
    TRY(diffuse(work));
    return compare(work, change);
}

static brume_result solve(struct dom_work *work)
{
    brume_stats *stats = work->cells.input->stats;
    const int wanted = work->cells.input->settings->iterations;
    const int most = wanted > 0 ? wanted : MOST_ITERATIONS;
    laps_go(work->cells.laps, BRUME_FIELD_ITERATIONS);
    const double limit = (double)work->cells.input->settings->converged;
    double least = INFINITY;
    for (int i = 0, best = 0; i < most; ++i) {
        double change = 0.0;
        work->cells.passes.done = 1.0f + 0.5f * (float)i / (float)(wanted > 0 ? wanted : i + 6);
        TRY(iterate(work, &change));
        ++stats->iterations;
        stats->change = change;
        TRY(mix(work));
        if (change < least) {
            least = change;
            best = i;
        }
        /* In the first one surfaces only learn what they have to send, unless they know. */
        if (wanted <= 0 && (i > 0 || work->warm) &&
            (change < limit || (least < NEARLY * limit && i - best >= STALLED)))
            break;
    }
    return BRUME_OK;
}

/* Light of another lattice to begin with, where that one is. */
static brume_result begin_with(struct dom_work *work, const struct buffer *level,
                               const struct texture *light, const struct texture *wall,
                               ivec4 offset)
{
    bind_lattice(work);
    glBindBufferBase(GL_UNIFORM_BUFFER, SLOT_LEVEL_BEFORE, level->id);
    glBindTextureUnit(SLOT_ANGULAR, light->id);
    glBindTextureUnit(SLOT_CELL_WALLS, wall->id);
    glBindTextureUnit(SLOT_MOMENTS, work->world.id);
    image(SLOT_OUTPUT, &work->now);
    image(SLOT_OUTPUT + 1, &work->wall);
    work->warm = true;
    return over_field(work, "dom_warm", offset);
}

/* What iterations begin with: what the lattice around has found, and light of the last run. Not of
 * finer lattices than this: what they tell at its cells' centres is not the cells' mean. */
static brume_result warm_up(struct dom_work *work, const struct transport *transport)
{
    const struct dom_work *around = work->around;
    if (around)
        TRY(begin_with(work, &around->cells.level, &around->now, &around->wall, (ivec4){0}));
    const int levels = work->cells.input->settings->warm ? transport->level_count : 0;
    for (int i = 0; i < levels && i <= work->number; ++i)
        TRY(begin_with(work, &transport->levels[i], &transport->light, &transport->wall,
                       (ivec4){has_world(work), 1, 0, 0}));
    return BRUME_OK;
}

static brume_result hand_over(struct dom_work *work, struct transport *transport)
{
    bind_lattice(work);
    glBindTextureUnit(SLOT_MOMENTS, work->now.id);
    glBindTextureUnit(SLOT_MOMENTS + 1, work->world.id);
    glBindTextureUnit(SLOT_WALLS, work->cells.walls.id);
    glBindTextureUnit(SLOT_CELL_WALLS, work->wall.id);
    image(SLOT_OUTPUT, &transport->field);
    image(SLOT_OUTPUT + 1, &transport->light);
    image(SLOT_OUTPUT + 2, &transport->wall);
    image(SLOT_OUTPUT + 3, &transport->band_2);
    return over_field(work, "dom_finish", (ivec4){has_world(work), 0, 0, 0});
}

/* --- All of it ------------------------------------------------------------------------------ */

static brume_result make_product(struct transport *transport, const struct transport_input *input)
{
    struct memory *memory = &input->gpu->memory;
    const struct gpu_frame *frame = input->frame;
    int size[3];
    lpv_product_size(frame, size);
    const int x = size[0], y = size[1], z = size[2];
    TRY(lpv_make_product(&transport->field, input));
    TRY(texture_ensure(memory, &transport->light, FOR_TRANSPORT, GL_TEXTURE_3D, GL_RGBA16F,
                       texture_side(MOMENT_SIDE * x), texture_side(MOMENT_SIDE * y),
                       texture_side(z), 1, "moments"));
    TRY(texture_ensure(memory, &transport->means, FOR_TRANSPORT, GL_TEXTURE_3D, GL_RGBA16F,
                       texture_side(x), texture_side(y), texture_side(z), 1,
                       "means scattered towards the eye"));
    TRY(texture_ensure(memory, &transport->scattered, FOR_TRANSPORT, GL_TEXTURE_3D, GL_RGBA16F,
                       texture_side(x), texture_side(y), texture_side(z), 1,
                       "scattered towards the eye"));
    TRY(texture_ensure(memory, &transport->wall, FOR_TRANSPORT, GL_TEXTURE_3D, GL_RGBA16F,
                       texture_side(x), texture_side(y), texture_side(z), 1, "surfaces' radiance"));
    TRY(texture_ensure(memory, &transport->band_2, FOR_TRANSPORT, GL_TEXTURE_3D, GL_RGBA16F,
                       texture_side(BAND_2 * x), texture_side(y), texture_side(z), 1, "band 2"));
    for (int i = 0; i < frame->field.x; ++i)
        TRY(buffer_update(memory, &transport->levels[i], FOR_TRANSPORT, sizeof frame->fields[i],
                          &frame->fields[i], "lattice"));
    return BRUME_OK;
}

/* From the outermost lattice to the innermost. What was known before stays until all is found: a
 * run that is cancelled loses nothing. */
static brume_result find(struct dom_work *works, int levels, struct transport *transport)
{
    for (int i = 0; i < levels; ++i) {
        TRY(prepare(&works[i]));
        TRY(begin(&works[i]));
        TRY(warm_up(&works[i], transport));
        TRY(solve(&works[i]));
    }
    transport->eye = 0;
    transport->level_count = 0;
    laps_go(works->cells.laps, BRUME_FIELD_COPY);
    TRY(make_product(transport, works->cells.input));
    for (int i = 0; i < levels; ++i)
        TRY(hand_over(&works[i], transport));
    transport->level_count = levels;
    return BRUME_OK;
}

brume_result dom_run(struct transport *transport, const struct transport_input *input)
{
    TRY(opv_run(transport, input));
    const int levels = input->frame->field.x;
    if (!levels)
        return BRUME_OK;
    transport_bind(transport); /* depths, as OPV has just found them */
    struct laps laps = {.sums_ms = input->stats->field_ms};
    struct dom_work works[FIELD_LEVELS] = {0};
    const bool surrounded = dom_has_surroundings(input);
    for (int i = 0; i < levels; ++i)
        works[i] = (struct dom_work){
            .cells = {.input = input,
                      .field = &input->frame->fields[i],
                      .laps = &laps,
                      .passes = {.input = input, .done = 1.0f}},
            .around = i ? &works[i - 1] : NULL,
            .number = i,
            .has_within = i + 1 < levels,
            .surrounded = surrounded,
            .count = input->settings->ordinates,
        };
    const brume_result result = find(works, levels, transport);
    for (int i = 0; i < levels; ++i)
        finish(&works[i]);
    laps_end(&laps);
    return result;
}

/* Where the eye is, or for a parallel view which way it looks. */
static uint64_t eye_signature(const struct gpu_frame *frame)
{
    const vec4 x = frame->ray_direction_x;
    const bool parallel = x.x == 0.0f && x.y == 0.0f && x.z == 0.0f;
    const vec4 at = parallel ? frame->ray_direction : frame->ray_origin;
    const float eye[4] = {at.x, at.y, at.z, parallel};
    const uint64_t hash = hash_bytes(HASH_START, eye, sizeof eye);
    return hash ? hash : 1;
}

/* Every cell of all lattices. */
static brume_result look_through(struct gpu *gpu, struct transport *transport,
                                 const struct gpu_frame *frame, const char *name)
{
    const struct program *program;
    TRY(program_compute(&gpu->programs, name, &program));
    for (int i = 0; i < frame->field.x; ++i) {
        const ivec4 dims = frame->fields[i].dims;
        glBindBufferBase(GL_UNIFORM_BUFFER, SLOT_LEVEL, transport->levels[i].id);
        program_dispatch(program, dims.x, dims.y, dims.z);
    }
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    return BRUME_OK;
}

brume_result dom_look(struct gpu *gpu, struct transport *transport, const struct gpu_frame *frame)
{
    const uint64_t eye = eye_signature(frame);
    if (transport->eye == eye)
        return BRUME_OK;
    glBindTextureUnit(SLOT_MOMENTS, transport->light.id);
    image(SLOT_OUTPUT, &transport->means);
    TRY(look_through(gpu, transport, frame, "dom_eye"));
    glBindTextureUnit(SLOT_SCATTERED, transport->means.id);
    image(SLOT_OUTPUT, &transport->scattered);
    TRY(look_through(gpu, transport, frame, "dom_between"));
    glBindTextureUnit(SLOT_SCATTERED, transport->scattered.id);
    transport->eye = eye;
    return BRUME_OK;
}
