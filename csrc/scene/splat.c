/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Gaussians as their means over the cells of a lattice. Any thread, and all cores. */
#include "scene/splat.h"
#include "base/result.h"
#include "math/frame.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* No reach is shorter, in cells: a double must still tell the two sides of a point that lies on the
 * border of two cells, or one of them would lose its half. */
#define SHORTEST 1e-9

#define HALF_SQRT_PI 0.88622692545275801365

double gaussian_place(const brume_gaussian *gaussian, const float world_from_object[16],
                      double center[3])
{
    /* In double: far from the world's origin a float has no digits left for cells. */
    const float *m = world_from_object, *p = gaussian->center;
    for (int axis = 0; axis < 3; ++axis)
        center[axis] = (double)m[axis] * p[0] + (double)m[4 + axis] * p[1] +
                       (double)m[8 + axis] * p[2] + m[12 + axis];
    return gaussian->scale / cbrt(fabs(mat4_determinant3(m)));
}

/* All but the place of its weights. */
static struct splat splat_make(const brume_gaussian *gaussian, const float world_from_object[16],
                               const double lower[3], double cell, const int32_t dims[3])
{
    struct splat splat;
    splat.scale = gaussian_place(gaussian, world_from_object, splat.center) * cell;
    splat.reach = fmax(GAUSSIAN_REACH / splat.scale, SHORTEST);
    for (int c = 0; c < 3; ++c)
        splat.values[c] = (double)gaussian->color[c] * gaussian->amplitude;
    splat.values[3] = gaussian->amplitude;
    for (int axis = 0; axis < 3; ++axis) {
        /* The lattice is as large as the bounds up to rounding, which could be more than all of a
         * small Gaussian. */
        const double margin = fmin(splat.reach, 0.5 * dims[axis]);
        const double at = (splat.center[axis] - lower[axis]) / cell;
        splat.center[axis] = fmin(fmax(at, margin), dims[axis] - margin);
        const double first = fmax(floor(splat.center[axis] - splat.reach), 0.0);
        const double end = fmin(floor(splat.center[axis] + splat.reach) + 1.0, dims[axis]);
        splat.first[axis] = (int32_t)first;
        splat.count[axis] = (int32_t)(end - first);
    }
    return splat;
}

/* The means of exp(-scale^2 (x - center)^2) over the splat's cells along an axis. */
static void weigh(const struct splat *splat, int axis, float *weights)
{
    const double from_center = splat->first[axis] - splat->center[axis];
    double low = splat->scale * from_center, tail_low = erfc(fabs(low));
    for (int32_t i = 0; i < splat->count[axis]; ++i) {
        const double high = splat->scale * (from_center + i + 1.0), tail_high = erfc(fabs(high));
        /* On one side of the centre by what is beyond: differences of erf, near 1 there, would
         * cancel. */
        const double between =
            low < 0.0 && high > 0.0 ? 2.0 - tail_low - tail_high : fabs(tail_low - tail_high);
        weights[i] = (float)(HALF_SQRT_PI / splat->scale * between);
        low = high;
        tail_low = tail_high;
    }
}

/* Which splats each plane has: counted, then filled from the back, which leaves starts holding the
 * starts. */
static bool sort_by_plane(struct splats *splats, uint32_t count)
{
    const int32_t planes = splats->dims[2];
    splats->starts = calloc((size_t)planes + 1, sizeof *splats->starts);
    if (!splats->starts)
        return false;
    for (uint32_t s = 0; s < count; ++s)
        for (int32_t k = 0; k < splats->splats[s].count[2]; ++k)
            ++splats->starts[splats->splats[s].first[2] + k];
    size_t end = 0;
    for (int32_t k = 0; k <= planes; ++k)
        splats->starts[k] = end += splats->starts[k];
    splats->members = malloc((end + 1) * sizeof *splats->members);
    if (!splats->members)
        return false;
    for (uint32_t s = count; s-- > 0;)
        for (int32_t k = 0; k < splats->splats[s].count[2]; ++k)
            splats->members[--splats->starts[splats->splats[s].first[2] + k]] = s;
    return true;
}

brume_result splats_init(struct splats *splats, const brume_gaussian *gaussians, uint32_t count,
                         const float world_from_object[16], const double lower[3], double cell,
                         const int32_t dims[3], bool (*stopped)(void *user), void *user)
{
    struct splats made = {0};
    memcpy(made.dims, dims, sizeof made.dims);
    size_t weights = 0;
    made.splats = malloc(((size_t)count + 1) * sizeof *made.splats);
    for (uint32_t s = 0; made.splats && s < count; ++s) {
        struct splat *splat = &made.splats[s];
        *splat = splat_make(&gaussians[s], world_from_object, lower, cell, dims);
        splat->weights = weights;
        for (int axis = 0; axis < 3; ++axis)
            weights += (size_t)splat->count[axis];
    }
    made.weights = malloc((weights + 1) * sizeof *made.weights);
    if (!made.splats || !made.weights || !sort_by_plane(&made, count)) {
        splats_finish(&made);
        return fail(BRUME_E_MEMORY, "no memory for %u Gaussians", count);
    }
#pragma omp parallel for schedule(dynamic, 64)
    for (uint32_t s = 0; s < count; ++s) {
        if (stopped(user))
            continue;
        float *along = made.weights + made.splats[s].weights;
        for (int axis = 0; axis < 3; along += made.splats[s].count[axis++])
            weigh(&made.splats[s], axis, along);
    }
    *splats = made;
    return BRUME_OK;
}

void splats_finish(struct splats *splats)
{
    free(splats->splats);
    free(splats->weights);
    free(splats->members);
    free(splats->starts);
    *splats = (struct splats){0};
}

size_t splats_in_plane(const struct splats *splats, int32_t k)
{
    return splats->starts[k + 1] - splats->starts[k];
}

/* How far from the centre the nearest point of a cell is, along an axis. */
static double distance(const struct splat *splat, int axis, int32_t cell)
{
    const double below = cell - splat->center[axis];
    return fmax(fmax(below, -1.0 - below), 0.0);
}

/* Row by row, the cells that are nowhere nearer than the reach left out: a box would show. */
void splats_add(const struct splats *splats, int32_t k, size_t number, double *sums)
{
    const struct splat *splat = &splats->splats[splats->members[splats->starts[k] + number]];
    const int32_t *first = splat->first, *count = splat->count;
    const float *along_x = splats->weights + splat->weights;
    const float *along_y = along_x + count[0], *along_z = along_y + count[1];
    const double away_z = distance(splat, 2, k);
    for (int32_t j = 0; j < count[1]; ++j) {
        const double away_y = distance(splat, 1, first[1] + j);
        const double left = splat->reach * splat->reach - away_z * away_z - away_y * away_y;
        if (left < 0.0)
            continue;
        const double half = sqrt(left), middle = splat->center[0] - first[0];
        const int32_t from = (int32_t)fmax(floor(middle - half), 0.0);
        const int32_t to = (int32_t)fmin(floor(middle + half) + 1.0, count[0]);
        const double weight = (double)along_z[k - first[2]] * along_y[j];
        double values[4];
        for (int c = 0; c < 4; ++c)
            values[c] = weight * splat->values[c];
        double *cell = sums + 4 * ((size_t)(first[1] + j) * (size_t)splats->dims[0] +
                                   (size_t)(first[0] + from));
        for (int32_t i = from; i < to; ++i, cell += 4)
            for (int c = 0; c < 4; ++c)
                cell[c] += along_x[i] * values[c];
    }
}
