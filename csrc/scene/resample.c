/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A field's means over the cells of a lattice. Any thread. */
#include "scene/resample.h"
#include "base/result.h"
#include "math/frame.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Where axes are not parallel: what a field may cost, in points looked up, and what each cell may
 * have even if that is exceeded. */
enum { ALL_POINTS = 1 << 25, CELL_POINTS = 27 };

/* So many points per averaged voxel and axis let turned tents still sum to nearly 1. */
#define DENSITY 1.2f

/* Axes count as parallel if they drift apart by less than this over the lattice, in voxels. */
#define DRIFT 0.01f

/* --- Support ------------------------------------------------------------------------------ */

/* Whether any voxel of layer number `layer` across the axis is not 0. */
static bool layer_shows(const brume_grid *field, int axis, int32_t layer)
{
    int32_t from[3] = {0, 0, 0}, to[3];
    memcpy(to, field->info.dims, sizeof to);
    from[axis] = layer;
    to[axis] = layer + 1;
    const size_t channels = (size_t)field->info.channels;
    for (int32_t z = from[2]; z < to[2]; ++z)
        for (int32_t y = from[1]; y < to[1]; ++y) {
            const size_t row =
                ((size_t)z * (size_t)field->info.dims[1] + (size_t)y) * (size_t)field->info.dims[0];
            for (size_t i = (row + (size_t)from[0]) * channels;
                 i < (row + (size_t)to[0]) * channels; ++i)
                if (field->data[i] != 0.0f)
                    return true;
        }
    return false;
}

void field_support(const brume_grid *field, float lower[3], float upper[3])
{
    for (int axis = 0; axis < 3; ++axis) {
        const int32_t size = field->info.dims[axis];
        lower[axis] = layer_shows(field, axis, 0) ? -0.5f : 0.0f;
        upper[axis] = (float)size + (layer_shows(field, axis, size - 1) ? 0.5f : 0.0f);
    }
}

/* --- Parallel axes ------------------------------------------------------------------------ */

/* The integral of the unit tent from -infinity to x. */
static double tent_integral(double x)
{
    if (x <= -1.0)
        return 0.0;
    if (x >= 1.0)
        return 1.0;
    return x < 0.0 ? 0.5 * (1.0 + x) * (1.0 + x) : 1.0 - 0.5 * (1.0 - x) * (1.0 - x);
}

/* Cell i reaches from origin + i * step to origin + (i + 1) * step, in voxels. */
static bool taps_init(struct resample_taps *taps, int32_t cells, double origin, double step,
                      int32_t voxels, float lower, float upper)
{
    const double length = fabs(step);
    /* A cell sees the voxels whose tents reach it, one voxel further than itself each way. */
    taps->stride = (int32_t)fmin(ceil(length) + 3.0, voxels);
    const size_t count = (size_t)cells;
    taps->first = malloc(count * sizeof *taps->first);
    taps->count = malloc(count * sizeof *taps->count);
    taps->inside = malloc(count * sizeof *taps->inside);
    taps->weights = malloc(count * (size_t)taps->stride * sizeof *taps->weights);
    if (!taps->first || !taps->count || !taps->inside || !taps->weights)
        return false;

    taps->from = voxels;
    taps->to = 0;
    for (int32_t i = 0; i < cells; ++i) {
        const double a = origin + i * step, b = origin + (i + 1) * step;
        const double low = fmin(a, b), high = fmax(a, b);
        const int32_t first = (int32_t)fmin(fmax(floor(low - 0.5), 0.0), voxels);
        const int32_t end = (int32_t)fmax(fmin(ceil(high + 0.5), voxels), first);
        ASSERT(end - first <= taps->stride);
        taps->first[i] = first;
        taps->count[i] = end - first;
        for (int32_t v = first; v < end; ++v)
            taps->weights[i * taps->stride + (v - first)] =
                (float)((tent_integral(high - v - 0.5) - tent_integral(low - v - 0.5)) / length);
        taps->inside[i] =
            (float)(fmax(fmin(high, (double)upper) - fmax(low, (double)lower), 0.0) / length);
        if (first < end) {
            taps->from = first < taps->from ? first : taps->from;
            taps->to = end > taps->to ? end : taps->to;
        }
    }
    if (taps->from > taps->to)
        taps->from = taps->to;
    return true;
}

static void taps_finish(struct resample_taps *taps)
{
    free(taps->first);
    free(taps->count);
    free(taps->weights);
    free(taps->inside);
}

/* Finds the array axis along each lattice axis; false where there is none. */
static bool find_axes(const float array_from_lattice[16], const int32_t dims[3], int axis[3])
{
    int seen = 0;
    for (int lattice = 0; lattice < 3; ++lattice) {
        const float *step = array_from_lattice + 4 * lattice;
        int along = 0;
        for (int array = 1; array < 3; ++array)
            if (fabsf(step[array]) > fabsf(step[along]))
                along = array;
        for (int array = 0; array < 3; ++array)
            if (array != along && fabsf(step[array]) * (float)dims[lattice] > DRIFT)
                return false;
        axis[lattice] = along;
        seen |= 1 << along;
    }
    return seen == 7;
}

/* out += weight * values, which stand stride apart. */
static void add_strided(float *out, const float *values, size_t stride, int32_t count, float weight)
{
    if (stride == 1)
#pragma omp simd
        for (int32_t i = 0; i < count; ++i)
            out[i] += weight * values[i];
    else
        for (int32_t i = 0; i < count; ++i)
            out[i] += weight * values[(size_t)i * stride];
}

static void aligned_channel(const struct resampler *r, int32_t k, size_t channel, float *scratch,
                            float *means)
{
    const struct resample_taps *along_x = &r->taps[0], *along_y = &r->taps[1],
                               *along_z = &r->taps[2];
    const int32_t width = along_x->to - along_x->from, height = along_y->to - along_y->from;
    const int32_t *size = r->field->info.dims;
    const size_t channels = (size_t)r->field->info.channels;
    const size_t strides[3] = {channels, channels * (size_t)size[0],
                               channels * (size_t)size[0] * (size_t)size[1]};
    const size_t step_x = strides[r->axis[0]], step_y = strides[r->axis[1]],
                 step_z = strides[r->axis[2]];

    float *plane = scratch, *row = scratch + (size_t)width * (size_t)height;
    memset(plane, 0, (size_t)width * (size_t)height * sizeof *plane);
    for (int32_t t = 0; t < along_z->count[k]; ++t) {
        const float weight = along_z->weights[k * along_z->stride + t];
        const float *slice = r->field->data + channel + (size_t)(along_z->first[k] + t) * step_z +
                             (size_t)along_y->from * step_y + (size_t)along_x->from * step_x;
        for (int32_t y = 0; y < height; ++y)
            add_strided(plane + (size_t)y * (size_t)width, slice + (size_t)y * step_y, step_x,
                        width, weight);
    }
    for (int32_t j = 0; j < r->dims[1]; ++j) {
        memset(row, 0, (size_t)width * sizeof *row);
        for (int32_t t = 0; t < along_y->count[j]; ++t)
            add_strided(row,
                        plane + (size_t)(along_y->first[j] + t - along_y->from) * (size_t)width, 1,
                        width, along_y->weights[j * along_y->stride + t]);
        float *out = means + 3 * (size_t)j * (size_t)r->dims[0] + channel;
        for (int32_t i = 0; i < r->dims[0]; ++i) {
            const float *values = row + (along_x->first[i] - along_x->from);
            const float *weights = along_x->weights + i * along_x->stride;
            float sum = 0.0f;
            for (int32_t t = 0; t < along_x->count[i]; ++t)
                sum += weights[t] * values[t];
            out[3 * i] = sum;
        }
    }
}

static void aligned_plane(const struct resampler *r, int32_t k, float *scratch, float *means,
                          float *inside)
{
    for (int32_t channel = 0; channel < r->field->info.channels; ++channel)
        aligned_channel(r, k, (size_t)channel, scratch, means);
    for (int32_t j = 0; j < r->dims[1]; ++j)
        for (int32_t i = 0; i < r->dims[0]; ++i) {
            const float part = r->taps[0].inside[i] * r->taps[1].inside[j] * r->taps[2].inside[k];
            float *cell = &inside[(size_t)j * (size_t)r->dims[0] + (size_t)i];
            *cell = fmaxf(*cell, part);
        }
}

/* --- Any axes ----------------------------------------------------------------------------- */

/* The mean of a cube of voxels; those beyond the box are 0. */
static float cube_mean(const brume_grid *field, int32_t reduction, const int32_t cube[3],
                       int32_t channel)
{
    const int32_t *size = field->info.dims;
    int32_t from[3], to[3];
    for (int axis = 0; axis < 3; ++axis) {
        from[axis] = cube[axis] * reduction;
        to[axis] = from[axis] + reduction < size[axis] ? from[axis] + reduction : size[axis];
    }
    double sum = 0.0;
    for (int32_t z = from[2]; z < to[2]; ++z)
        for (int32_t y = from[1]; y < to[1]; ++y)
            for (int32_t x = from[0]; x < to[0]; ++x)
                sum += field->data[(((size_t)z * (size_t)size[1] + (size_t)y) * (size_t)size[0] +
                                    (size_t)x) *
                                       (size_t)field->info.channels +
                                   (size_t)channel];
    return (float)(sum / pow(reduction, 3.0));
}

static brume_result reduce(struct resampler *r)
{
    const int32_t *dims = r->reduced_dims;
    const int32_t channels = r->field->info.channels;
    r->reduced = malloc((size_t)dims[0] * (size_t)dims[1] * (size_t)dims[2] * (size_t)channels *
                        sizeof *r->reduced);
    if (!r->reduced)
        return fail(BRUME_E_MEMORY, "no memory to average the voxels of grid '%s'",
                    r->field->info.name);
#pragma omp parallel for schedule(dynamic)
    for (int32_t z = 0; z < dims[2]; ++z)
        for (int32_t y = 0; y < dims[1]; ++y)
            for (int32_t x = 0; x < dims[0]; ++x)
                for (int32_t c = 0; c < channels; ++c)
                    r->reduced[(((size_t)z * (size_t)dims[1] + (size_t)y) * (size_t)dims[0] +
                                (size_t)x) *
                                   (size_t)channels +
                               (size_t)c] =
                        cube_mean(r->field, r->reduction, (const int32_t[3]){x, y, z}, c);
    return BRUME_OK;
}

/* The voxels around a point in units of reduced voxels: the lowest, and how far from its centre the
 * point is. false where all are beyond the box, and 0. */
static inline bool find_voxels(const int32_t dims[3], const float point[3], int32_t low[3],
                               float part[3])
{
    for (int axis = 0; axis < 3; ++axis) {
        const float from_centre = point[axis] - 0.5f;
        if (!(from_centre > -1.0f && from_centre < (float)dims[axis]))
            return false;
        low[axis] = (int32_t)(from_centre + 1.0f) - 1; /* floor of what is above -1 */
        part[axis] = from_centre - (float)low[axis];
    }
    return true;
}

static inline float mix(float a, float b, float part)
{
    return a + (b - a) * part;
}

/* The trilinear value among eight voxels, all in the box. */
static inline float look_up(const float *voxel, size_t step_x, size_t step_y, size_t step_z,
                            const float part[3])
{
    const float *above = voxel + step_z;
    const float low = mix(mix(voxel[0], voxel[step_x], part[0]),
                          mix(voxel[step_y], voxel[step_y + step_x], part[0]), part[1]);
    const float high = mix(mix(above[0], above[step_x], part[0]),
                           mix(above[step_y], above[step_y + step_x], part[0]), part[1]);
    return mix(low, high, part[2]);
}

/* The same where some of the eight are beyond the box. */
static void add_border(const float *data, const int32_t dims[3], int32_t channels,
                       const int32_t low[3], const float part[3], float sum[3])
{
    for (int corner = 0; corner < 8; ++corner) {
        size_t voxel = 0;
        float weight = 1.0f;
        for (int axis = 2; axis >= 0; --axis) {
            const int32_t high = corner >> axis & 1, at = low[axis] + high;
            weight *= at < 0 || at >= dims[axis] ? 0.0f : high ? part[axis] : 1.0f - part[axis];
            voxel = voxel * (size_t)dims[axis] + (size_t)at;
        }
        if (weight > 0.0f)
            for (int32_t c = 0; c < channels; ++c)
                sum[c] += weight * data[voxel * (size_t)channels + (size_t)c];
    }
}

static inline void add_point(const float *data, const int32_t dims[3], int32_t channels,
                             const float point[3], float sum[3])
{
    int32_t low[3];
    float part[3];
    if (!find_voxels(dims, point, low, part))
        return;
    if (low[0] < 0 || low[1] < 0 || low[2] < 0 || low[0] + 1 >= dims[0] || low[1] + 1 >= dims[1] ||
        low[2] + 1 >= dims[2]) {
        add_border(data, dims, channels, low, part, sum);
        return;
    }
    const size_t step_x = (size_t)channels, step_y = step_x * (size_t)dims[0],
                 step_z = step_y * (size_t)dims[1];
    const float *voxel =
        data + (size_t)low[2] * step_z + (size_t)low[1] * step_y + (size_t)low[0] * step_x;
    for (int32_t c = 0; c < channels; ++c)
        sum[c] += look_up(voxel + c, step_x, step_y, step_z, part);
}

/* Points spread over the part of the cell that lies in the support's lattice bounds, however small
 * that part is. */
static void any_cell(const struct resampler *r, const int32_t cell[3], float means[3],
                     float *inside)
{
    const float *data = r->reduced ? r->reduced : r->field->data;
    double low[3], step[3], part = 1.0;
    int32_t points[3];
    for (int lattice = 0; lattice < 3; ++lattice) {
        low[lattice] = fmax(cell[lattice], (double)r->lattice_lower[lattice]);
        const double length =
            fmin(cell[lattice] + 1.0, (double)r->lattice_upper[lattice]) - low[lattice];
        means[lattice] = 0.0f;
        if (!(length > 0.0))
            part = 0.0;
        points[lattice] = (int32_t)fmax(ceil(length * r->points_per_cell[lattice]), 1.0);
        step[lattice] = length / points[lattice];
        part *= step[lattice];
    }
    if (part <= 0.0)
        return;

    /* In units of averaged voxels: the first point, and the way to the next along each axis. */
    const float *m = r->array_from_lattice;
    const double scale = 1.0 / r->reduction;
    float first[3], next[3][3], lower[3], upper[3];
    for (int axis = 0; axis < 3; ++axis) {
        double at = m[12 + axis];
        for (int lattice = 0; lattice < 3; ++lattice) {
            at += m[4 * lattice + axis] * (low[lattice] + 0.5 * step[lattice]);
            next[lattice][axis] = (float)(m[4 * lattice + axis] * step[lattice] * scale);
        }
        first[axis] = (float)(at * scale);
        lower[axis] = (float)(r->lower[axis] * scale);
        upper[axis] = (float)(r->upper[axis] * scale);
    }
    float sum[3] = {0.0f, 0.0f, 0.0f};
    int32_t seen = 0;
    for (int32_t z = 0; z < points[2]; ++z)
        for (int32_t y = 0; y < points[1]; ++y)
            for (int32_t x = 0; x < points[0]; ++x) {
                float point[3];
                bool in = true;
                for (int axis = 0; axis < 3; ++axis) {
                    point[axis] = first[axis] + (float)x * next[0][axis] +
                                  (float)y * next[1][axis] + (float)z * next[2][axis];
                    in = in && point[axis] >= lower[axis] && point[axis] <= upper[axis];
                }
                seen += in;
                add_point(data, r->reduced_dims, r->field->info.channels, point, sum);
            }
    for (int c = 0; c < 3; ++c)
        means[c] = sum[c] * (float)part;
    *inside = fmaxf(*inside, fminf((float)(seen * part), 1.0f));
}

static void any_plane(const struct resampler *r, int32_t k, float *means, float *inside)
{
    for (int32_t j = 0; j < r->dims[1]; ++j)
        for (int32_t i = 0; i < r->dims[0]; ++i) {
            const size_t cell = (size_t)j * (size_t)r->dims[0] + (size_t)i;
            any_cell(r, (const int32_t[3]){i, j, k}, means + 3 * cell, &inside[cell]);
        }
}

/* Voxels are averaged as little as the cost allows, since averaging blurs. */
static brume_result any_init(struct resampler *r, const float lattice_from_array[16])
{
    mat4_bounds(lattice_from_array, r->lower, r->upper, r->lattice_lower, r->lattice_upper);
    float lengths[3], parts[3];
    double cells = 1.0;
    for (int lattice = 0; lattice < 3; ++lattice) {
        const float *step = r->array_from_lattice + 4 * lattice;
        lengths[lattice] = sqrtf(step[0] * step[0] + step[1] * step[1] + step[2] * step[2]);
        parts[lattice] = fminf(r->lattice_upper[lattice] - r->lattice_lower[lattice], 1.0f);
        cells *= r->dims[lattice];
    }
    const int32_t *size = r->field->info.dims;
    const double allowed = fmax(ALL_POINTS / cells, CELL_POINTS);
    double points;
    r->reduction = 0;
    do {
        ++r->reduction;
        points = 1.0;
        for (int lattice = 0; lattice < 3; ++lattice) {
            r->points_per_cell[lattice] = DENSITY * lengths[lattice] / (float)r->reduction;
            points *= fmaxf(ceilf(r->points_per_cell[lattice] * parts[lattice]), 1.0f);
        }
    } while (points > allowed &&
             (r->reduction < size[0] || r->reduction < size[1] || r->reduction < size[2]));
    for (int axis = 0; axis < 3; ++axis)
        r->reduced_dims[axis] = (size[axis] + r->reduction - 1) / r->reduction;
    return r->reduction > 1 ? reduce(r) : BRUME_OK;
}

/* --- Both --------------------------------------------------------------------------------- */

brume_result resampler_init(struct resampler *resampler, const brume_grid *field,
                            const float lattice_from_array[16], const int32_t dims[3])
{
    struct resampler r = {.field = field};
    memcpy(r.dims, dims, sizeof r.dims);
    field_support(field, r.lower, r.upper);
    brume_result result = BRUME_OK;
    if (!mat4_invert(lattice_from_array, r.array_from_lattice))
        result = fail(BRUME_E_TRANSFORM, "grid '%s' has zero scale", field->info.name);
    else if (find_axes(r.array_from_lattice, dims, r.axis)) {
        r.aligned = true;
        for (int lattice = 0; lattice < 3 && result == BRUME_OK; ++lattice) {
            const int array = r.axis[lattice];
            if (!taps_init(&r.taps[lattice], dims[lattice], r.array_from_lattice[12 + array],
                           r.array_from_lattice[4 * lattice + array], field->info.dims[array],
                           r.lower[array], r.upper[array]))
                result = fail(BRUME_E_MEMORY, "no memory to resample grid '%s'", field->info.name);
        }
    } else {
        result = any_init(&r, lattice_from_array);
    }
    if (result != BRUME_OK)
        resampler_finish(&r);
    *resampler = r;
    return result;
}

void resampler_finish(struct resampler *resampler)
{
    for (int lattice = 0; lattice < 3; ++lattice)
        taps_finish(&resampler->taps[lattice]);
    free(resampler->reduced);
    *resampler = (struct resampler){0};
}

size_t resampler_scratch(const struct resampler *r)
{
    if (!r->aligned)
        return 0;
    const size_t width = (size_t)(r->taps[0].to - r->taps[0].from);
    return width * ((size_t)(r->taps[1].to - r->taps[1].from) + 1);
}

void resampler_plane(const struct resampler *r, int32_t k, float *scratch, float *means,
                     float *inside)
{
    if (r->aligned)
        aligned_plane(r, k, scratch, means, inside);
    else
        any_plane(r, k, means, inside);
    if (r->field->info.channels == 1)
        for (size_t i = 0; i < (size_t)r->dims[0] * (size_t)r->dims[1]; ++i)
            means[3 * i + 1] = means[3 * i + 2] = means[3 * i];
}
