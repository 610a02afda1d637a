/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The lattice of a run of DOM: its textures, its ordinates, and what surfaces and medium are in its
 * cells. docs/methods/dom.md. */
#include "base/result.h"
#include "gl/timer.h"
#include "transport/dom_work.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

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

bool dom_has_world(const struct dom_work *work)
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
    if (work->has_within && dom_has_world(work))
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
    }
    for (size_t i = 0; i < sizeof work->missing / sizeof *work->missing; ++i)
        TRY(lattice_texture(work, &work->missing[i], GL_RGBA16F, 1, 1, 1, "diffusion"));
    const ivec4 dims = work->cells.field->dims;
    return buffer_init(&work->cells.input->gpu->memory, &work->dots, FOR_TRANSPORT,
                       (size_t)dims.y * (size_t)dims.z * (HISTORY + 1) * sizeof(vec4), NULL,
                       "products");
}

void dom_finish(struct dom_work *work)
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

void dom_image(int slot, const struct texture *texture)
{
    glBindImageTexture((GLuint)slot, texture->id, 0, GL_TRUE, 0, GL_WRITE_ONLY, texture->format);
}

void dom_bind_lattice(const struct dom_work *work)
{
    glBindBufferBase(GL_UNIFORM_BUFFER, SLOT_LEVEL, work->cells.level.id);
    glBindBufferBase(GL_UNIFORM_BUFFER, SLOT_ORDINATES, work->ordinates.id);
    glBindTextureUnit(SLOT_CELL_EXTINCT, work->cells.cells[0].id);
    glBindTextureUnit(SLOT_CELL_ALBEDO, work->cells.cells[1].id);
    glBindTextureUnit(SLOT_CUTS, work->cuts.id);
}

brume_result dom_over_field(struct dom_work *work, const char *stem, ivec4 offset)
{
    TRY(lpv_over_lattice(&work->cells, stem, offset, &work->cells.field->dims));
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT |
                    GL_TEXTURE_UPDATE_BARRIER_BIT);
    return BRUME_OK;
}

brume_result dom_prepare(struct dom_work *work)
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
        dom_image(SLOT_OUTPUT + c, &cells->cells[c]);
    dom_image(SLOT_OUTPUT_FIELD, &work->cuts);
    dom_image(SLOT_OUTPUT_FIELD + 1, &work->depths);
    dom_image(SLOT_OUTPUT_FIELD + 2, &work->emission);
    glBindTextureUnit(SLOT_LINES, cells->lines.id);
    TRY(program_compute(&cells->input->gpu->programs, "dom_cells", &program));
    glProgramUniform1f(program->id, 0, cells->input->geometry->brightest);
    TRY(dom_over_field(work, "dom_cells", (ivec4){0}));
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
    return BRUME_OK;
}
