/* SPDX-License-Identifier: GPL-3.0-or-later */
/* DOM's iteration in plain C. Formulas are the shaders'; what they look up in textures lies in rows
 * here that a compiler can take several of at once. */
#include "plain.h"

#include "transport/dom.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

#define MOST_CELLS 128

/* --- Places --------------------------------------------------------------------------------- */

/* Strides of a row's cells, of rows and of slices in a plain lattice, seen along a major axis. */
static void turned_strides(int axis, int n, size_t strides[3])
{
    const size_t all[3] = {1, (size_t)n, (size_t)n * (size_t)n};
    strides[0] = all[(axis + 1) % 3];
    strides[1] = all[(axis + 2) % 3];
    strides[2] = all[axis];
}

static size_t cells_of(const struct plain *plain)
{
    return (size_t)plain->cells * (size_t)plain->cells * (size_t)plain->cells;
}

/* A plane of moments and room after it: a cell's moments, powers of two apart, would fall into the
 * same few lines of a cache. */
static size_t moments_of(const struct plain *plain)
{
    return cells_of(plain) + 48;
}

/* Which row a thread takes: those that share lines of a cache follow one another, which along x are
 * the next slice's. */
static void row_of(int axis, int number, int n, int *along, int *row)
{
    *along = axis == 0 ? number % n : number / n;
    *row = axis == 0 ? number / n : number % n;
}

static size_t wide_side(const struct plain *plain)
{
    return (size_t)plain->cells + 2;
}

static size_t wide_cells(const struct plain *plain)
{
    return wide_side(plain) * wide_side(plain) * wide_side(plain);
}

/* --- Making it ------------------------------------------------------------------------------ */

/* Real spherical harmonics as in shaders/lib/harmonics.glsl. */
static void harmonics(vec4 d, float y[MOMENTS])
{
    const float x2 = d.x * d.x, y2 = d.y * d.y, z2 = d.z * d.z;
    y[0] = 0.28209479177387814f;
    y[1] = 0.4886025119029199f * d.y;
    y[2] = 0.4886025119029199f * d.z;
    y[3] = 0.4886025119029199f * d.x;
    y[4] = 1.0925484305920792f * d.x * d.y;
    y[5] = 1.0925484305920792f * d.y * d.z;
    y[6] = 0.31539156525252005f * (3.0f * z2 - 1.0f);
    y[7] = 1.0925484305920792f * d.x * d.z;
    y[8] = 0.5462742152960396f * (x2 - y2);
    y[9] = 0.5900435899266435f * d.y * (3.0f * x2 - y2);
    y[10] = 2.890611442640554f * d.x * d.y * d.z;
    y[11] = 0.4570457994644658f * d.y * (5.0f * z2 - 1.0f);
    y[12] = 0.3731763325901154f * d.z * (5.0f * z2 - 3.0f);
    y[13] = 0.4570457994644658f * d.x * (5.0f * z2 - 1.0f);
    y[14] = 1.445305721320277f * d.z * (x2 - y2);
    y[15] = 0.5900435899266435f * d.x * (x2 - 3.0f * y2);
}

static int band_of(int moment)
{
    return moment < 1 ? 0 : (moment < 4 ? 1 : (moment < 9 ? 2 : 3));
}

static float *zeros(size_t count)
{
    return calloc(count, sizeof(float));
}

int plain_init(struct plain *plain, int cells, float side, int count, const float sigma_s[3],
               const float sigma_a[3], const float emission[3], float g)
{
    *plain = (struct plain){.cells = cells, .side = side, .count = count};
    if (cells > MOST_CELLS)
        return 0;
    dom_quadrature(count, plain->directions, plain->axes);
    for (int k = 0; k < count; ++k)
        harmonics(plain->directions[k], plain->harmonics[k]);
    const size_t n3 = cells_of(plain), wide = wide_side(plain);
    plain->albedo = zeros(3 * n3);
    plain->g = zeros(n3);
    plain->first = zeros(3 * MOMENTS * moments_of(plain));
    plain->now = zeros(3 * MOMENTS * moments_of(plain));
    plain->next = zeros(3 * MOMENTS * moments_of(plain));
    plain->sources = zeros(3 * (size_t)count * wide_cells(plain));
    plain->means = zeros(3 * (size_t)count * n3);
    int there = plain->albedo && plain->g && plain->first && plain->now && plain->next &&
                plain->sources && plain->means;
    for (int axis = 0; axis < 3; ++axis) {
        plain->extinct[axis] = zeros(3 * n3);
        plain->medium[axis] = zeros(wide_cells(plain));
        there = there && plain->extinct[axis] && plain->medium[axis];
    }
    if (!there) {
        plain_finish(plain);
        return 0;
    }
    const float forward = g * g * g * g;
    for (size_t i = 0; i < n3; ++i) {
        plain->g[i] = g;
        for (size_t c = 0; c < 3; ++c) {
            const float scatters = (1.0f - forward) * sigma_s[c], extinct = scatters + sigma_a[c];
            plain->albedo[c * n3 + i] = scatters / extinct;
            plain->first[c * moments_of(plain) + i] =
                emission[c] * 3.5449077018110318f / extinct; /* sqrt(4 pi) */
            for (int axis = 0; axis < 3; ++axis)
                plain->extinct[axis][c * n3 + i] = extinct;
        }
    }
    for (int axis = 0; axis < 3; ++axis)
        for (size_t z = 1; z + 1 < wide; ++z)
            for (size_t y = 1; y + 1 < wide; ++y)
                for (size_t x = 1; x + 1 < wide; ++x)
                    plain->medium[axis][(z * wide + y) * wide + x] = 1.0f;
    return 1;
}

void plain_finish(struct plain *plain)
{
    float *all[] = {plain->albedo,     plain->g,          plain->first,     plain->now,
                    plain->next,       plain->sources,    plain->means,     plain->extinct[0],
                    plain->extinct[1], plain->extinct[2], plain->medium[0], plain->medium[1],
                    plain->medium[2]};
    for (size_t i = 0; i < sizeof all / sizeof *all; ++i)
        free(all[i]);
}

/* --- An iteration --------------------------------------------------------------------------- */

/* The sources along a major axis's ordinates, of a row of cells. */
static void source_row(struct plain *plain, int axis, int begin, int number)
{
    int along, row;
    row_of(axis, number, plain->cells, &along, &row);
    const int n = plain->cells;
    const size_t n3 = cells_of(plain), wide = wide_side(plain);
    float q[MOMENTS][3][MOST_CELLS];
    size_t strides[3];
    turned_strides(axis, n, strides);
    const size_t start = (size_t)along * strides[2] + (size_t)row * strides[1];
    for (int u = 0; u < n; ++u) {
        const size_t cell = start + (size_t)u * strides[0];
        const float g = plain->g[cell], f = g * g * g * g, part = 1.0f / fmaxf(1.0f - f, 1e-6f);
        const float bands[4] = {1.0f, (g - f) * part, (g * g - f) * part, (g * g * g - f) * part};
        for (int m = 0; m < MOMENTS; ++m)
            for (size_t c = 0; c < 3; ++c) {
                const size_t at = (3 * (size_t)m + c) * moments_of(plain) + cell;
                q[m][c][u] = plain->first[at] +
                             plain->albedo[c * n3 + cell] * bands[band_of(m)] * plain->now[at];
            }
    }
    const size_t place = (((size_t)along + 1) * wide + (size_t)row + 1) * wide + 1;
    const float *medium = plain->medium[axis] + place;
    for (int k = begin; k < begin + plain->axes[axis]; ++k) {
        const float *y = plain->harmonics[k];
        for (size_t c = 0; c < 3; ++c) {
            float *out = plain->sources + (3 * (size_t)k + c) * wide_cells(plain) + place;
            for (int u = 0; u < n; ++u) {
                float sum = 0.0f;
                for (int m = 0; m < MOMENTS; ++m)
                    sum += y[m] * q[m][c][u];
                out[u] = sum * medium[u];
            }
        }
    }
}

struct way {
    float along, u, v; /* that light goes through a slice, in cells */
    float shares[4];   /* of the cells that it comes from */
    ptrdiff_t from[4]; /* where they are in the slice before */
    float aside[2];    /* half of what a column has aside and straight on, by axes */
    float depth;       /* of a unit of extinction */
};

/* What leaves a slice: colours; whether there is a cell, and how far it counts how light grows; and
 * how much that does from one column to the next, along both axes. A column's neighbours may be a
 * row before the first or after the last. */
enum slice_plane { SLICE_THERE = 3, SLICE_COUNTS, SLICE_RISES, SLICE_PLANES = SLICE_RISES + 6 };

static size_t slice_room(const struct plain *plain)
{
    const size_t wide = wide_side(plain);
    return SLICE_PLANES * wide * wide + 2 * wide;
}

/* How much light grows, in a row of a slice. */
static void rise_row(int n, ptrdiff_t step, const float *restrict light,
                     const float *restrict there, const float *restrict counts,
                     float *restrict rises)
{
    for (int u = 0; u < n; ++u) {
        const ptrdiff_t low = u - step, high = u + step;
        const float own = light[u], most = 2.0f * fabsf(own);
        const float slope = (light[high] - own) * there[high] + (own - light[low]) * there[low];
        const float rise = counts[u] * slope / fmaxf(there[low] + there[high], 1.0f);
        rises[u] = fminf(fmaxf(rise, -most), most);
    }
}

static void rise(const struct plain *plain, const struct way *way, float *slice)
{
    const size_t wide = wide_side(plain), plane = wide * wide;
    for (size_t i = 0; i < 2; ++i)
        for (size_t c = 0; c < 3; ++c)
            for (size_t row = 1; row + 1 < wide; ++row) {
                float *light = slice + row * wide + 1;
                rise_row(plain->cells, -way->from[1 + i], light + c * plane,
                         light + SLICE_THERE * plane, light + SLICE_COUNTS * plane,
                         light + (SLICE_RISES + 3 * i + c) * plane);
            }
}

/* A colour of a row of cells. */
static void sweep_row(int n, size_t wide, const struct way *way, const float *restrict extinct,
                      const float *restrict medium, const float *restrict source,
                      const float *restrict thick, int any_thick, const float *restrict before,
                      const float *restrict rises_u, const float *restrict rises_v,
                      float *restrict after, float *restrict means)
{
    const ptrdiff_t row = (ptrdiff_t)wide, slice = row * row;
    const float *b0 = before + way->from[0], *b1 = before + way->from[1];
    const float *b2 = before + way->from[2], *b3 = before + way->from[3];
    float grows[MOST_CELLS];
    if (any_thick) {
        const float steps[3] = {way->u, way->v, way->along};
        const ptrdiff_t strides[3] = {1, row, slice};
        for (int u = 0; u < n; ++u) {
            const float own = source[u], most = 2.0f * fabsf(own);
            float sum = 0.0f;
            for (int axis = 0; axis < 3; ++axis) {
                const ptrdiff_t low = u - strides[axis], high = u + strides[axis];
                const float slope =
                    (source[high] - own) * medium[high] + (own - source[low]) * medium[low];
                sum += steps[axis] * slope / fmaxf(medium[low] + medium[high], 1.0f);
            }
            grows[u] = thick[u] * fminf(fmaxf(sum, -most), most);
        }
    } else {
        memset(grows, 0, sizeof(float) * (size_t)n);
    }
    for (int u = 0; u < n; ++u) {
        float enters = way->shares[0] * b0[u] + way->shares[1] * b1[u] + way->shares[2] * b2[u] +
                       way->shares[3] * b3[u];
        enters += way->aside[0] * (rises_u[u + way->from[1]] - rises_u[u]) +
                  way->aside[1] * (rises_v[u + way->from[2]] - rises_v[u]);
        const float depth = extinct[u] * way->depth, through = expf(-depth);
        const float gives = depth < 1e-3f ? depth * (1.0f - 0.5f * depth) : 1.0f - through;
        const float leaves = enters * through + source[u] * gives +
                             grows[u] * (0.5f * (1.0f + through) - gives / fmaxf(depth, 1e-3f));
        after[u] = leaves;
        means[u] = depth < 3e-3f ? enters * (1.0f - 0.5f * depth) + source[u] * (0.5f * depth)
                                 : source[u] + (enters - leaves) / fmaxf(depth, 1e-6f);
    }
}

static struct way way_along(const struct plain *plain, int axis, int k)
{
    const float *d = &plain->directions[k].x;
    const float major = d[axis], u = d[(axis + 1) % 3], v = d[(axis + 2) % 3];
    const float size = 1.0f / fabsf(major);
    const float a = fabsf(u) * size, b = fabsf(v) * size;
    const ptrdiff_t to_u = u > 0.0f ? 1 : (u < 0.0f ? -1 : 0);
    const ptrdiff_t to_v = (v > 0.0f ? 1 : (v < 0.0f ? -1 : 0)) * (ptrdiff_t)wide_side(plain);
    return (struct way){.along = major * size,
                        .u = u * size,
                        .v = v * size,
                        .shares = {(1.0f - a) * (1.0f - b), a * (1.0f - b), (1.0f - a) * b, a * b},
                        .from = {0, -to_u, -to_v, -to_u - to_v},
                        .aside = {0.5f * a * (1.0f - a), 0.5f * b * (1.0f - b)},
                        .depth = plain->side * size};
}

/* Light along an ordinate through the whole lattice; `slices` has room for what leaves two. */
static void sweep(struct plain *plain, int axis, int k, float *slices)
{
    const int n = plain->cells;
    const size_t n2 = (size_t)n * (size_t)n, n3 = n2 * (size_t)n, wide = wide_side(plain);
    const size_t room = slice_room(plain), plane = wide * wide;
    const struct way way = way_along(plain, axis, k);
    memset(slices, 0, 2 * room * sizeof *slices); /* nothing comes from outside */
    for (int slice = 0; slice < n; ++slice) {
        const size_t along = (size_t)(way.along > 0.0f ? slice : n - 1 - slice);
        float *before = slices + (slice % 2 ? room : 0) + wide;
        float *after = slices + (slice % 2 ? 0 : room) + wide;
        rise(plain, &way, before);
        for (size_t row = 0; row < (size_t)n; ++row) {
            const size_t here = along * n2 + row * (size_t)n;
            const size_t flat = (row + 1) * wide + 1, place = (along + 1) * plane + flat;
            const float *medium = plain->medium[axis] + place;
            const float *extinct = plain->extinct[axis] + here;
            float *there = after + SLICE_THERE * plane + flat;
            float *counts = after + SLICE_COUNTS * plane + flat;
            float thick[MOST_CELLS], any = 0.0f;
            for (int u = 0; u < n; ++u) {
                const float most =
                    fmaxf(extinct[u], fmaxf(extinct[n3 + (size_t)u], extinct[2 * n3 + (size_t)u]));
                thick[u] = most * way.depth > 0.02f ? medium[u] : 0.0f;
                any += thick[u];
                there[u] = 1.0f;
                counts[u] = fminf(8.0f * most * way.depth, 1.0f);
            }
            for (size_t c = 0; c < 3; ++c)
                sweep_row(n, wide, &way, extinct + c * n3, medium,
                          plain->sources + (3 * (size_t)k + c) * wide_cells(plain) + place, thick,
                          any > 0.0f, before + c * plane + flat,
                          before + (SLICE_RISES + c) * plane + flat,
                          before + (SLICE_RISES + 3 + c) * plane + flat, after + c * plane + flat,
                          plain->means + (3 * (size_t)k + c) * n3 + here);
        }
    }
}

/* What a row's moments have of a major axis's ordinates. */
static void gather_row(struct plain *plain, int axis, int begin, int number)
{
    int along, row;
    row_of(axis, number, plain->cells, &along, &row);
    const int n = plain->cells;
    const size_t n3 = cells_of(plain);
    const size_t here = ((size_t)along * (size_t)n + (size_t)row) * (size_t)n;
    size_t strides[3];
    turned_strides(axis, n, strides);
    const size_t start = (size_t)along * strides[2] + (size_t)row * strides[1];
    for (size_t c = 0; c < 3; ++c) {
        float sums[MOMENTS][MOST_CELLS];
        memset(sums, 0, sizeof sums);
        for (int k = begin; k < begin + plain->axes[axis]; ++k) {
            const float *light = plain->means + (3 * (size_t)k + c) * n3 + here;
            for (int m = 0; m < MOMENTS; ++m) {
                const float y = plain->harmonics[k][m] * plain->directions[k].w;
                for (int u = 0; u < n; ++u)
                    sums[m][u] += y * light[u];
            }
        }
        for (int m = 0; m < MOMENTS; ++m) {
            float *out = plain->next + (3 * (size_t)m + c) * moments_of(plain) + start;
            for (int u = 0; u < n; ++u) {
                float *sum = out + (size_t)u * strides[0];
                *sum = (axis > 0 ? *sum : 0.0f) + sums[m][u];
            }
        }
    }
}

static double lap(double *since)
{
    const double now = omp_get_wtime(), spent = (now - *since) * 1e3;
    *since = now;
    return spent;
}

void plain_iterate(struct plain *plain)
{
    const int n = plain->cells;
    int begins[3] = {0, plain->axes[0], plain->axes[0] + plain->axes[1]};
    double since = omp_get_wtime();
    for (int axis = 0; axis < 3; ++axis) {
#pragma omp parallel for schedule(dynamic, 16)
        for (int i = 0; i < n * n; ++i)
            source_row(plain, axis, begins[axis], i);
    }
    plain->spent_ms[PLAIN_SOURCE] += lap(&since);
#pragma omp parallel
    {
        float *slices = malloc(2 * slice_room(plain) * sizeof *slices);
        if (!slices)
            abort();
#pragma omp for schedule(dynamic)
        for (int k = 0; k < plain->count; ++k)
            sweep(plain, k < begins[1] ? 0 : (k < begins[2] ? 1 : 2), k, slices);
        free(slices);
    }
    plain->spent_ms[PLAIN_SWEEP] += lap(&since);
    for (int axis = 0; axis < 3; ++axis) {
#pragma omp parallel for schedule(dynamic, 16)
        for (int i = 0; i < n * n; ++i)
            gather_row(plain, axis, begins[axis], i);
    }
    plain->spent_ms[PLAIN_GATHER] += lap(&since);
    float *found = plain->next;
    plain->next = plain->now;
    plain->now = found;
}

double plain_fluence(const struct plain *plain, int cell, int color)
{
    return 3.5449077018110318 *
           (double)plain->now[(size_t)color * moments_of(plain) + (size_t)cell];
}
