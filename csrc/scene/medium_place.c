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

/* The box of all volumes but one, or of all; returns its longest side, 0 where none reaches
 * anywhere. */
static double joint_bounds(struct volume *const *volumes, uint32_t count,
                           const struct volume *without, double lower[3], double upper[3],
                           double extent[3])
{
    double longest = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        lower[axis] = INFINITY;
        upper[axis] = -INFINITY;
        for (uint32_t i = 0; i < count; ++i) {
            if (volumes[i] == without)
                continue;
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

/* Axes count as the world's if they drift from them by less than this over a grid, in voxels. */
#define DRIFT 0.01

/* The finest that the volumes hold. */
struct voxels {
    double side;      /* m; 0 where any resolution makes it better: of a mesh the shape, of a
                         program the texture */
    bool cubes;       /* those of a grid, along the world's axes */
    double corner[3]; /* of one of these cubes */
};

/* Whether cubes along the world's axes are what a grid's voxels are. */
static bool are_cubes(const float world_from_array[16], const int32_t dims[3], double side)
{
    int seen = 0;
    for (int column = 0; column < 3; ++column) {
        int along = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const double length = fabs((double)world_from_array[4 * column + axis]);
            if (fabs(length - side) * dims[column] < DRIFT * side) {
                along = axis;
                seen |= 1 << axis;
            }
        }
        for (int axis = 0; axis < 3; ++axis)
            if (axis != along &&
                fabs((double)world_from_array[4 * column + axis]) * dims[column] > DRIFT * side)
                return false;
    }
    return seen == 7;
}

static void see_grid(const struct volume *volume, const brume_grid *grid, struct voxels *voxels)
{
    float m[16];
    mat4_multiply(volume->world_from_object, grid->info.object_from_array, m);
    double side = INFINITY;
    for (int column = 0; column < 3; ++column)
        side = fmin(side, sqrt((double)m[4 * column] * m[4 * column] +
                               (double)m[4 * column + 1] * m[4 * column + 1] +
                               (double)m[4 * column + 2] * m[4 * column + 2]));
    if (!(side < voxels->side))
        return;
    voxels->side = side;
    voxels->cubes = are_cubes(m, grid->info.dims, side);
    for (int axis = 0; axis < 3; ++axis)
        voxels->corner[axis] = m[12 + axis];
}

static struct voxels finest_voxels(struct volume *const *volumes, uint32_t count)
{
    struct voxels voxels = {.side = INFINITY};
    for (uint32_t i = 0; i < count; ++i) {
        if (volumes[i]->positions || volume_program_is_placed(&volumes[i]->program))
            return (struct voxels){.side = 0.0};
        for (uint32_t g = 0; g < volumes[i]->grid_count; ++g)
            if (volumes[i]->grids[g])
                see_grid(volumes[i], volumes[i]->grids[g], &voxels);
        for (uint32_t g = 0; g < volumes[i]->gaussian_count; ++g) {
            double center[3];
            const double scale =
                gaussian_place(&volumes[i]->gaussians[g], volumes[i]->world_from_object, center);
            const double side = 1.0 / (CELLS_PER_WIDTH * scale);
            if (side < voxels.side)
                voxels = (struct voxels){.side = side};
        }
    }
    return voxels;
}

static int32_t useful_resolution(const struct voxels *voxels, double longest)
{
    const double cells = ceil(longest / voxels->side - SLIVER);
    /* Also where a mesh or a texture, with voxels of no size, makes it infinite. */
    return cells < INT32_MAX ? (int32_t)fmax(cells, 1.0) : INT32_MAX;
}

int32_t medium_useful_resolution(struct volume *const *volumes, uint32_t count)
{
    double lower[3], upper[3], extent[3];
    const double longest = joint_bounds(volumes, count, NULL, lower, upper, extent);
    const struct voxels voxels = finest_voxels(volumes, count);
    return useful_resolution(&voxels, longest);
}

/* The lattice whose cells are voxels. */
static bool place_on_voxels(struct medium_lattice *lattice, const struct voxels *voxels,
                            const double lower[3], const double upper[3], uint64_t max_cells)
{
    double first[3], cells[3];
    for (int axis = 0; axis < 3; ++axis) {
        first[axis] = floor((lower[axis] - voxels->corner[axis]) / voxels->side + SLIVER);
        const double end = ceil((upper[axis] - voxels->corner[axis]) / voxels->side - SLIVER);
        cells[axis] = fmax(end - first[axis], 1.0);
        if (cells[axis] > INT32_MAX)
            return false;
    }
    if (max_cells > 0 && cells[0] * cells[1] * cells[2] > (double)max_cells)
        return false;
    lattice->cell = (float)voxels->side;
    for (int axis = 0; axis < 3; ++axis) {
        const double low = voxels->corner[axis] + first[axis] * voxels->side;
        lattice->dims[axis] = (int32_t)cells[axis];
        lattice->lower[axis] = (float)low;
        lattice->upper[axis] = (float)(low + cells[axis] * voxels->side);
    }
    return true;
}

void medium_place(struct medium_lattice *lattice, struct volume *const *volumes, uint32_t count,
                  int32_t resolution, uint64_t max_cells)
{
    double lower[3], upper[3], extent[3];
    const double longest = joint_bounds(volumes, count, NULL, lower, upper, extent);
    /* Also false for a box so small that floats have no cells for it. */
    if (!((float)(longest / resolution) > 0.0f))
        return;
    /* Cells as fine as voxels show them best where they lie on them: half a voxel aside, means of
     * two are interpolated once more. */
    const struct voxels voxels = finest_voxels(volumes, count);
    if (voxels.cubes && resolution == useful_resolution(&voxels, longest) &&
        place_on_voxels(lattice, &voxels, lower, upper, max_cells))
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

/* --- Fog too fine for it -------------------------------------------------------------------- */

/* Whether most of its Gaussians are narrower than a cell: 2 / scale is their radius, with 2 % of
 * the peak left there. */
static bool is_smeared(const struct volume *volume, double cell)
{
    uint32_t narrow = 0;
    for (uint32_t i = 0; i < volume->gaussian_count; ++i) {
        double center[3];
        narrow += 2.0 / gaussian_place(&volume->gaussians[i], volume->world_from_object, center) <
                  cell;
    }
    return narrow > volume->gaussian_count / 2;
}

/* The volume, other than that one, without which the box would be shortest, if half as long at most.
 * Only those on its sides can be. */
static const struct volume *widening(struct volume *const *volumes, uint32_t count,
                                     const struct volume *that)
{
    double lower[3], upper[3], extent[3], rest[3][3];
    const struct volume *found = NULL;
    double least = 0.5 * joint_bounds(volumes, count, NULL, lower, upper, extent);
    for (int side = 0; side < 6; ++side)
        for (uint32_t i = 0; i < count; ++i) {
            const struct volume *volume = volumes[i];
            const int axis = side / 2;
            if (side % 2 ? (double)volume->upper[axis] < upper[axis]
                         : (double)volume->lower[axis] > lower[axis])
                continue;
            const double without =
                joint_bounds(volumes, count, volume, rest[0], rest[1], rest[2]);
            if (volume != that && without > 0.0 && without <= least) {
                least = without;
                found = volume;
            }
            break; /* another on the same side keeps the box as long */
        }
    return found;
}

const struct volume *medium_smeared(struct volume *const *volumes, uint32_t count,
                                    const struct medium_lattice *lattice,
                                    const struct volume **wide)
{
    *wide = NULL;
    for (uint32_t i = 0; i < count; ++i)
        if (is_smeared(volumes[i], lattice->cell)) {
            *wide = widening(volumes, count, volumes[i]);
            return volumes[i];
        }
    return NULL;
}
