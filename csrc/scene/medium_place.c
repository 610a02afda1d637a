/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Where the medium's lattice lies, and how fine it is. Any thread. */
#include "scene/medium_place.h"
#include "base/field.h"
#include "math/frame.h"
#include "scene/splat.h"

#include <math.h>

static double set_dims(struct medium_lattice *lattice, const double extent[3], double longest,
                       int32_t resolution)
{
    double product = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double cells = ceil(extent[axis] / longest * resolution - SLIVER);
        /* A volume thinner than a cell gets one: a second would spread the same mass over twice
         * the thickness, and an interpolation that clamps needs none. */
        lattice->dims[axis] = (int32_t)fmax(cells, 1.0);
        product *= lattice->dims[axis];
    }
    return product;
}

/* The box of all volumes; returns its longest side, 0 where none reaches anywhere. */
static double joint_bounds(struct volume *const *volumes, uint32_t count, double lower[3],
                           double upper[3], double extent[3])
{
    double longest = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        lower[axis] = INFINITY;
        upper[axis] = -INFINITY;
        for (uint32_t i = 0; i < count; ++i) {
            lower[axis] = fmin(lower[axis], (double)volumes[i]->lower[axis]);
            upper[axis] = fmax(upper[axis], (double)volumes[i]->upper[axis]);
        }
        extent[axis] = fmax(upper[axis] - lower[axis], 0.0);
        longest = fmax(longest, extent[axis]);
    }
    return longest;
}

/* Cells in a Gaussian's width (1 / scale). Means of such cells, interpolated linearly, are within
 * 0.4 % of its peak everywhere: beside the peak it loses (width / cell)^-2, a quarter of that by
 * the means and the rest by the interpolation between eight cells. */
#define CELLS_PER_WIDTH 16.0

/* Side of the smallest voxel of all volumes, m: cells smaller than that would hold nothing more.
 * 0 where a mesh gives the medium, whose shape any resolution makes better. */
static double finest_voxel(struct volume *const *volumes, uint32_t count)
{
    double finest = INFINITY;
    for (uint32_t i = 0; i < count; ++i) {
        if (volumes[i]->positions)
            return 0.0;
        for (uint32_t g = 0; g < volumes[i]->grid_count; ++g) {
            if (!volumes[i]->grids[g])
                continue;
            float m[16];
            mat4_multiply(volumes[i]->world_from_object,
                          volumes[i]->grids[g]->info.object_from_array, m);
            for (int column = 0; column < 3; ++column)
                finest = fmin(finest, sqrt((double)m[4 * column] * m[4 * column] +
                                           (double)m[4 * column + 1] * m[4 * column + 1] +
                                           (double)m[4 * column + 2] * m[4 * column + 2]));
        }
        for (uint32_t g = 0; g < volumes[i]->gaussian_count; ++g) {
            double center[3];
            const double scale =
                gaussian_place(&volumes[i]->gaussians[g], volumes[i]->world_from_object, center);
            finest = fmin(finest, 1.0 / (CELLS_PER_WIDTH * scale));
        }
    }
    return finest;
}

int32_t medium_useful_resolution(struct volume *const *volumes, uint32_t count)
{
    double lower[3], upper[3], extent[3];
    const double longest = joint_bounds(volumes, count, lower, upper, extent);
    const double voxels = ceil(longest / finest_voxel(volumes, count) - SLIVER);
    /* Also where a mesh, with voxels of no size, makes it infinite. */
    return voxels < INT32_MAX ? (int32_t)fmax(voxels, 1.0) : INT32_MAX;
}

void medium_place(struct medium_lattice *lattice, struct volume *const *volumes, uint32_t count,
                  int32_t resolution, uint64_t max_cells)
{
    double lower[3], upper[3], extent[3];
    const double longest = joint_bounds(volumes, count, lower, upper, extent);
    /* Also false for a box so small that floats have no cells for it. */
    if (!((float)(longest / resolution) > 0.0f))
        return;

    double cells = set_dims(lattice, extent, longest, resolution);
    while (max_cells > 0 && cells > (double)max_cells) {
        const double fitting = floor(resolution * cbrt((double)max_cells / cells) + 1e-6);
        resolution = (int32_t)fmax(fmin(fitting, resolution - 1), 1.0);
        cells = set_dims(lattice, extent, longest, resolution);
        lattice->coarser = true;
    }
    lattice->cell = (float)(longest / resolution);
    for (int axis = 0; axis < 3; ++axis) {
        const double half = 0.5 * lattice->dims[axis] * lattice->cell;
        const double middle = 0.5 * (lower[axis] + upper[axis]);
        lattice->lower[axis] = (float)(middle - half);
        lattice->upper[axis] = (float)(middle + half);
    }
}
