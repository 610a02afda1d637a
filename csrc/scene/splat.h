/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Gaussians as their means over the cells of a lattice. A Gaussian is a product of one function per
 * axis, so its mean over a cell is a product of three differences of erf: exact for any size beside
 * the cell's, no mass is lost. Each costs only the cells that it reaches. Any thread. */
#ifndef BRUME_SCENE_SPLAT_H
#define BRUME_SCENE_SPLAT_H

#include "brume.h"

#include <stdbool.h>
#include <stddef.h>

/* Beyond so many widths (1 / scale) of its centre a Gaussian counts as 0: 1.2e-4 of its peak is
 * left there, and 4.4e-4 of its mass beyond. */
#define GAUSSIAN_REACH 3.0

/* Where a Gaussian is in the world; returns its scale there, 1/m. */
double gaussian_place(const brume_gaussian *gaussian, const float world_from_object[16],
                      double center[3]);

/* One Gaussian, in units of cells from the lattice's corner. */
struct splat {
    double center[3], scale, reach;
    double values[4];            /* at the peak: colour times amplitude, amplitude */
    int32_t first[3], count[3];  /* the cells that it may reach */
    size_t weights;              /* its weights begin here: along x, then y, then z */
};

struct splats {
    int32_t dims[3];             /* cells */
    struct splat *splats;        /* in the order of the Gaussians */
    float *weights;              /* means along one axis */
    uint32_t *members;           /* numbers of the splats in each plane, ascending */
    size_t *starts;              /* of each plane's members; dims[2] + 1 */
};

/* Cell (i, j, k) is the world's cube of side `cell` from lower + (i, j, k) * cell. The lattice
 * holds the Gaussians' reach, up to rounding. stopped: polled; once true, the weights stay undefined
 * and the caller ends. */
brume_result splats_init(struct splats *splats, const brume_gaussian *gaussians, uint32_t count,
                         const float world_from_object[16], const double lower[3], double cell,
                         const int32_t dims[3], bool (*stopped)(void *user), void *user);
void splats_finish(struct splats *splats); /* zeroed is fine */

/* How many Gaussians plane k has. */
size_t splats_in_plane(const struct splats *splats, int32_t k);

/* Adds one of them to the plane's cells: 4 values each, the sum of colours times densities, then
 * that of densities. In doubles, which products of extreme floats do not exceed. */
void splats_add(const struct splats *splats, int32_t k, size_t number, double *sums);

#endif
