/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A field's means over the cells of a lattice. Between its voxels' centres a field is linear, with
 * zeros around its box: what Cycles' linear lookup sees of a sparse grid. Its integral is the sum
 * over its voxels, so whoever takes means over cells loses no mass. Any thread. */
#ifndef BRUME_SCENE_RESAMPLE_H
#define BRUME_SCENE_RESAMPLE_H

#include "base/field.h"

#include <stdbool.h>

/* Where the field can be seen, in array space: its box, and half a voxel beyond on the sides whose
 * outermost voxels are not all 0. */
void field_support(const brume_grid *field, float lower[3], float upper[3]);

/* Along one axis: each cell as a weighted sum of consecutive voxels. */
struct resample_taps {
    int32_t *first; /* per cell, the voxel of its first weight */
    int32_t *count; /* per cell */
    float *weights; /* stride per cell */
    float *inside;  /* per cell, the part of its length in the support */
    int32_t stride;
    int32_t from, to; /* the voxels that any cell reads */
};

struct resampler {
    const brume_grid *field;  /* borrowed */
    int32_t dims[3];          /* cells */
    float lower[3], upper[3]; /* support, in array space */
    float array_from_lattice[16];

    /* Lattice and array axes are parallel: exact box integrals, one axis after the other. */
    bool aligned;
    int axis[3]; /* the array axis along each lattice axis */
    struct resample_taps taps[3];

    /* Otherwise: points in each cell, looked up in voxels averaged to nearly the cell's size. */
    int32_t reduction;
    int32_t reduced_dims[3];
    float *reduced; /* NULL: reduction is 1 */
    float points_per_cell[3];
    float lattice_lower[3], lattice_upper[3]; /* bounds of the support */
};

/* lattice_from_array: cell (i, j, k) is the unit cube from (i, j, k), as voxels are. */
brume_result resampler_init(struct resampler *resampler, const brume_grid *field,
                            const float lattice_from_array[16], const int32_t dims[3]);
void resampler_finish(struct resampler *resampler); /* zeroed is fine */

/* Floats of working memory that resampler_plane wants. */
size_t resampler_scratch(const struct resampler *resampler);

/* The means of the cells of plane k, 3 floats each (one channel thrice), and the part of each cell
 * that lies in the support, where it exceeds what inside holds. */
void resampler_plane(const struct resampler *resampler, int32_t k, float *scratch, float *means,
                     float *inside);

#endif
