/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The medium's cells, deblurred. Any thread, and all cores. */
#include "scene/sharpen.h"
#include "base/result.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

/* Along an axis, cells that lie on the voxels they average hold 1/8, 3/4, 1/8 of three of them. In
 * general a quarter of a cell's square is the variance of the mean over a cell (1/12) and of the
 * tents between cells (1/6); a second difference of weight SHARE takes it back. */
#define SHARE 0.125f

/* Each pass halves at least what the last left of the blur between neighbours. */
enum { PASSES = 2 };

/* Lines side by side: one along x has the 4 floats of a cell, others a whole row of them. */
struct lines {
    float *values;  /* the first cell's */
    int32_t count;  /* cells along the axis */
    size_t stride;  /* floats from one cell to the next */
    size_t width;   /* floats of a cell */
    float *means;   /* working memory: count * width */
    float *sharp;   /* the same */
    float *fluxes;  /* (count + 1) * width: what crosses a face towards the next cell */
    float *shares;  /* count * width: of what a cell should give, the part it has */
};

/* One instruction for many lanes, which fmaxf with its rules for NaN is not. */
static inline float larger(float a, float b)
{
    return a > b ? a : b;
}

/* Antidiffusion in flux form, as in flux-corrected transport (Boris and Book 1973), limited only by
 * what each cell has: their limiter, which allows no new extremes, would cut off every peak. */
static void sharpen_lines(const struct lines *lines)
{
    const int32_t count = lines->count;
    const size_t width = lines->width, all = (size_t)count * width;
    float *means = lines->means, *sharp = lines->sharp, *fluxes = lines->fluxes,
          *shares = lines->shares;
    for (int32_t i = 0; i < count; ++i)
        memcpy(means + (size_t)i * width, lines->values + (size_t)i * lines->stride,
               width * sizeof *means);
    float apart = 0.0f;
#pragma omp simd reduction(max : apart)
    for (size_t i = width; i < all; ++i)
        apart = larger(apart, larger(means[i] - means[i - width], means[i - width] - means[i]));
    if (apart == 0.0f)
        return; /* even all along: where nothing is, and in plain fog */
    memcpy(sharp, means, all * sizeof *sharp);
    memset(fluxes, 0, width * sizeof *fluxes);
    memset(fluxes + all, 0, width * sizeof *fluxes);
    for (int pass = 0; pass < PASSES; ++pass) {
#pragma omp simd
        for (size_t i = width; i < all; ++i)
            fluxes[i] = SHARE * (sharp[i] - sharp[i - width]);
#pragma omp simd
        for (size_t i = 0; i < all; ++i) {
            const float given = larger(fluxes[i + width], 0.0f) + larger(-fluxes[i], 0.0f);
            shares[i] = means[i] / larger(larger(means[i], given), FLT_MIN);
        }
#pragma omp simd
        for (size_t i = width; i < all; ++i)
            fluxes[i] *= fluxes[i] > 0.0f ? shares[i - width] : shares[i];
#pragma omp simd
        for (size_t i = 0; i < all; ++i)
            sharp[i] = larger(means[i] + fluxes[i] - fluxes[i + width], 0.0f);
    }
    for (int32_t i = 0; i < count; ++i) {
        float *out = lines->values + (size_t)i * lines->stride;
        const float *in = sharp + (size_t)i * width;
#pragma omp simd
        for (size_t k = 0; k < width; ++k)
            out[k] = k % 4 == 3 ? out[k] : in[k]; /* the mean cosine's place */
    }
}

/* Sharpens an array of the lattice along one axis. */
static bool sharpen_axis(const int32_t dims[3], int axis, float *values)
{
    const size_t strides[3] = {4, 4 * (size_t)dims[0], 4 * (size_t)dims[0] * (size_t)dims[1]};
    /* Rows of x go side by side where the axis is another. */
    const size_t width = axis == 0 ? strides[0] : strides[1];
    const size_t all = (size_t)dims[axis] * width;
    const int32_t rows = axis == 1 ? 1 : dims[1], planes = axis == 2 ? 1 : dims[2];
    bool memory = true;
#pragma omp parallel reduction(&& : memory)
    {
        struct lines lines = {
            .count = dims[axis],
            .stride = strides[axis],
            .width = width,
            .means = malloc(all * sizeof(float)),
            .sharp = malloc(all * sizeof(float)),
            .fluxes = malloc((all + width) * sizeof(float)),
            .shares = malloc(all * sizeof(float)),
        };
        memory = lines.means && lines.sharp && lines.fluxes && lines.shares;
#pragma omp for schedule(static)
        for (int32_t lot = 0; lot < rows * planes; ++lot) {
            lines.values =
                values + (size_t)(lot % rows) * strides[1] + (size_t)(lot / rows) * strides[2];
            if (memory)
                sharpen_lines(&lines);
        }
        free(lines.means);
        free(lines.sharp);
        free(lines.fluxes);
        free(lines.shares);
    }
    return memory;
}

/* Scattering and absorption are sharpened each for itself, so that albedos stay between 0 and 1. */
static void add_scattering(struct medium_lattice *lattice, float sign)
{
    const size_t cells =
        (size_t)lattice->dims[0] * (size_t)lattice->dims[1] * (size_t)lattice->dims[2];
#pragma omp parallel for schedule(static)
    for (size_t cell = 0; cell < cells; ++cell)
        for (size_t i = 4 * cell; i < 4 * cell + 3; ++i)
            lattice->extinct[i] = larger(lattice->extinct[i] + sign * lattice->scatter[i], 0.0f);
}

brume_result medium_sharpen(struct medium_lattice *lattice)
{
    bool memory = true;
    add_scattering(lattice, -1.0f);
    for (int axis = 0; axis < 3; ++axis) {
        if (lattice->dims[axis] < 2)
            continue;
        memory = memory && sharpen_axis(lattice->dims, axis, lattice->scatter) &&
                 sharpen_axis(lattice->dims, axis, lattice->extinct) &&
                 (!lattice->emission || sharpen_axis(lattice->dims, axis, lattice->emission));
    }
    add_scattering(lattice, 1.0f);
    return memory ? BRUME_OK : fail(BRUME_E_MEMORY, "no memory to sharpen the medium's lattice");
}
