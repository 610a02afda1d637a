/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Uploading the medium. */
#include "transport/medium_textures.h"
#include "base/result.h"
#include "brume_gpu.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static int brick_count(int cells)
{
    return (cells + BRICK_CELLS - 1) / BRICK_CELLS;
}

static int clamp(int value, int low, int high)
{
    return value < low ? low : value > high ? high : value;
}

/* A brick is 1 if any of its cells, or of the cells beside it that interpolation may reach, has
 * extinction or emission. */
static float *make_bricks(const struct medium_lattice *lattice, const int bricks[3])
{
    float *occupied =
        calloc((size_t)bricks[0] * (size_t)bricks[1] * (size_t)bricks[2], sizeof *occupied);
    if (!occupied)
        return NULL;
    const int32_t *dims = lattice->dims;
    size_t cell = 0;
    for (int z = 0; z < dims[2]; ++z) {
        for (int y = 0; y < dims[1]; ++y) {
            for (int x = 0; x < dims[0]; ++x, ++cell) {
                const float *extinct = lattice->extinct + 4 * cell;
                const float *emission = lattice->emission ? lattice->emission + 4 * cell : extinct;
                if (extinct[0] + extinct[1] + extinct[2] <= 0.0f &&
                    emission[0] + emission[1] + emission[2] <= 0.0f)
                    continue;
                const int position[3] = {x, y, z};
                int low[3], high[3];
                for (int i = 0; i < 3; ++i) {
                    low[i] = clamp(position[i] - 1, 0, dims[i] - 1) / BRICK_CELLS;
                    high[i] = clamp(position[i] + 1, 0, dims[i] - 1) / BRICK_CELLS;
                }
                for (int k = low[2]; k <= high[2]; ++k)
                    for (int j = low[1]; j <= high[1]; ++j)
                        for (int i = low[0]; i <= high[0]; ++i)
                            occupied[((size_t)k * (size_t)bricks[1] + (size_t)j) *
                                         (size_t)bricks[0] +
                                     (size_t)i] = 1.0f;
            }
        }
    }
    return occupied;
}

/* Infinite in a half float, and infinity times nothing is NaN. A cell this dense is opaque whatever
 * its number: both coefficients shrink alike, so that the albedo stays. */
#define HALF_MAX 65504.0f

static void fit_halves(struct medium_lattice *lattice)
{
    const size_t cells =
        (size_t)lattice->dims[0] * (size_t)lattice->dims[1] * (size_t)lattice->dims[2];
    for (size_t cell = 0; cell < cells; ++cell) {
        float *scatter = lattice->scatter + 4 * cell, *extinct = lattice->extinct + 4 * cell;
        for (int c = 0; c < 3; ++c) {
            if (extinct[c] > HALF_MAX) {
                scatter[c] = scatter[c] / extinct[c] * HALF_MAX;
                extinct[c] = HALF_MAX;
            }
            if (lattice->emission && lattice->emission[4 * cell + (size_t)c] > HALF_MAX)
                lattice->emission[4 * cell + (size_t)c] = HALF_MAX;
        }
    }
}

/* A lattice ends with its last layer of cells; where the texture goes on, so does that layer, as if
 * it were clamped to its edge. */
static void repeat_last_layers(const struct texture *texture, const int32_t dims[3])
{
    const int sides[3] = {texture->width, texture->height, texture->depth};
    int size[3] = {dims[0], dims[1], dims[2]};
    for (int axis = 0; axis < 3; ++axis) {
        int layer[3] = {size[0], size[1], size[2]}, from[3] = {0, 0, 0}, to[3] = {0, 0, 0};
        if (size[axis] == sides[axis])
            continue;
        layer[axis] = 1;
        from[axis] = size[axis] - 1;
        to[axis] = size[axis];
        glCopyImageSubData(texture->id, GL_TEXTURE_3D, 0, from[0], from[1], from[2], texture->id,
                           GL_TEXTURE_3D, 0, to[0], to[1], to[2], layer[0], layer[1], layer[2]);
        size[axis] += 1;
    }
}

static brume_result fill(struct gpu *gpu, struct texture *texture, GLenum format,
                         const int32_t dims[3], GLenum channels, const float *data,
                         const char *label)
{
    TRY(texture_ensure(&gpu->memory, texture, FOR_MEDIUM, GL_TEXTURE_3D, format,
                       texture_side(dims[0]), texture_side(dims[1]), texture_side(dims[2]), 1,
                       label));
    glTextureSubImage3D(texture->id, 0, 0, 0, 0, dims[0], dims[1], dims[2], channels, GL_FLOAT,
                        data);
    repeat_last_layers(texture, dims);
    return BRUME_OK;
}

float medium_forward_share(float g)
{
    return g * g * g * g;
}

/* Returns the largest share. */
static float scale(struct medium_lattice *lattice)
{
    float largest = 0.0f;
    const size_t cells =
        (size_t)lattice->dims[0] * (size_t)lattice->dims[1] * (size_t)lattice->dims[2];
    for (size_t cell = 0; cell < cells; ++cell) {
        const float *scatter = lattice->scatter + 4 * cell;
        float *extinct = lattice->extinct + 4 * cell;
        const float share = medium_forward_share(scatter[3]);
        for (int c = 0; c < 3; ++c) {
            if (scatter[c] > 0.0f)
                largest = fmaxf(largest, share);
            extinct[c] = fmaxf(extinct[c] - share * scatter[c], 0.0f);
        }
    }
    return largest;
}

brume_result medium_textures_upload(struct gpu *gpu, struct medium_textures *textures,
                                    struct medium_lattice *lattice, bool scaled)
{
    textures->forward = scaled ? scale(lattice) : 0.0f;
    fit_halves(lattice);
    memcpy(textures->dims, lattice->dims, sizeof textures->dims);
    memcpy(textures->lower, lattice->lower, sizeof textures->lower);
    memcpy(textures->upper, lattice->upper, sizeof textures->upper);
    textures->cell = lattice->cell;
    textures->emits = lattice->emission != NULL;
    if (!lattice->emission)
        texture_finish(&gpu->memory, &textures->emission);
    if (lattice->dims[0] == 0) {
        medium_textures_finish(gpu, textures);
        return BRUME_OK;
    }
    TRY(fill(gpu, &textures->scatter, GL_RGBA16F, lattice->dims, GL_RGBA, lattice->scatter,
             "medium scatter"));
    TRY(fill(gpu, &textures->extinct, GL_RGBA16F, lattice->dims, GL_RGBA, lattice->extinct,
             "medium extinction"));
    if (lattice->emission)
        TRY(fill(gpu, &textures->emission, GL_RGBA16F, lattice->dims, GL_RGBA, lattice->emission,
                 "medium emission"));
    const int bricks[3] = {brick_count(lattice->dims[0]), brick_count(lattice->dims[1]),
                           brick_count(lattice->dims[2])};
    float *occupied = make_bricks(lattice, bricks);
    if (!occupied)
        return fail(BRUME_E_MEMORY, "no memory for the medium's bricks");
    const brume_result result =
        fill(gpu, &textures->bricks, GL_R32F, bricks, GL_RED, occupied, "medium bricks");
    free(occupied);
    return result;
}

void medium_textures_bind(const struct medium_textures *textures)
{
    glBindTextureUnit(SLOT_MEDIUM_SCATTER, textures->scatter.id);
    glBindTextureUnit(SLOT_MEDIUM_EXTINCT, textures->extinct.id);
    glBindTextureUnit(SLOT_MEDIUM_EMISSION, textures->emission.id);
    glBindTextureUnit(SLOT_MEDIUM_BRICKS, textures->bricks.id);
}

void medium_textures_finish(struct gpu *gpu, struct medium_textures *textures)
{
    texture_finish(&gpu->memory, &textures->scatter);
    texture_finish(&gpu->memory, &textures->extinct);
    texture_finish(&gpu->memory, &textures->emission);
    texture_finish(&gpu->memory, &textures->bricks);
    memset(textures, 0, sizeof *textures);
}
