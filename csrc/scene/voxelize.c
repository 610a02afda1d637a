/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A closed mesh as fractional coverage of a lattice's cells. Any thread, and all cores.
 *
 * Each cell is crossed by a raster of columns along z. Where a column meets the mesh the winding
 * number changes; the length of column inside is exact, so faces across z lose nothing. A column
 * belongs to exactly one of the triangles around an edge or vertex that it hits (the top-left rule
 * of rasterisers, on vertices snapped to a fixed-point raster so that it is decided exactly).
 *
 * An open mesh leaves a column with a winding number that does not return to 0. Inside is then what
 * is inside seen from both of its ends, so that a hole costs the columns through it, and nothing
 * runs on to infinity. */
#include "scene/voxelize.h"
#include "base/result.h"
#include "math/frame.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* Columns per cell and axis: coarse lattices, where a cell's fraction shows, get more. */
enum { COLUMNS_FEW = 4, COLUMNS_MANY = 8, SMALL_LATTICE = 64 * 64 };

/* The fixed-point raster, in steps per cell. The columns stand on it, float's noise vanishes in it,
 * and edge functions within 1024 cells are exact in double. */
#define SNAP 65536.0

/* Coverage this close to 0 or 1 is rounding noise of the vertices: a box that fits its cells fills
 * them, and a touched neighbour stays empty. */
#define NOISE 1e-5f

/* Twice the signed area of (a, b, point), with a before b in a fixed order, so that the two
 * triangles of an edge get the same number whatever its rounding; sign undoes the order. */
struct edge {
    double x, y, dx, dy;
    double sign;
    bool inclusive; /* a point on the edge is inside */
};

/* A triangle seen along z, counter-clockwise. */
struct facet {
    struct edge edges[3];
    double y_min, y_max;
    double x, y, z, z_dx, z_dy; /* its plane */
    double z_min, z_max;
    int winding; /* how a column going up changes its winding number */
};

struct crossing {
    double z;
    uint32_t column;
    int32_t winding;
};

/* One thread's crossings of one row of columns; sorted is as long as found. */
struct crossings {
    struct crossing *found, *sorted;
    size_t count, capacity;
    uint32_t *starts; /* column count + 1 */
};

struct raster {
    const int32_t *dims;
    int columns; /* per cell and axis */
    uint32_t row_columns;
    float *coverage;
};

static struct edge edge_between(const double a[3], const double b[3])
{
    const double dx = b[0] - a[0], dy = b[1] - a[1];
    const bool ordered = a[0] < b[0] || (a[0] == b[0] && a[1] < b[1]);
    const double *from = ordered ? a : b, *to = ordered ? b : a;
    return (struct edge){.x = from[0],
                         .y = from[1],
                         .dx = to[0] - from[0],
                         .dy = to[1] - from[1],
                         .sign = ordered ? 1.0 : -1.0,
                         .inclusive = dy > 0.0 || (dy == 0.0 && dx < 0.0)};
}

static inline bool edge_holds(const struct edge *edge, double x, double y)
{
    const double side = edge->sign * (edge->dx * (y - edge->y) - edge->dy * (x - edge->x));
    return side > 0.0 || (side == 0.0 && edge->inclusive);
}

/* false for a triangle that no column can cross. */
static bool facet_make(const double *const v[3], struct facet *out)
{
    const double area =
        (v[1][0] - v[0][0]) * (v[2][1] - v[0][1]) - (v[1][1] - v[0][1]) * (v[2][0] - v[0][0]);
    if (area == 0.0)
        return false;
    const double *const a = v[0], *const b = area > 0.0 ? v[1] : v[2],
                        *const c = area > 0.0 ? v[2] : v[1];
    const double twice = fabs(area);
    *out = (struct facet){
        .edges = {edge_between(a, b), edge_between(b, c), edge_between(c, a)},
        .y_min = fmin(a[1], fmin(b[1], c[1])),
        .y_max = fmax(a[1], fmax(b[1], c[1])),
        .x = a[0],
        .y = a[1],
        .z = a[2],
        .z_dx = ((b[2] - a[2]) * (c[1] - a[1]) - (c[2] - a[2]) * (b[1] - a[1])) / twice,
        .z_dy = ((c[2] - a[2]) * (b[0] - a[0]) - (b[2] - a[2]) * (c[0] - a[0])) / twice,
        .z_min = fmin(a[2], fmin(b[2], c[2])),
        .z_max = fmax(a[2], fmax(b[2], c[2])),
        /* A normal that points up is where a column going up leaves. */
        .winding = area > 0.0 ? -1 : 1,
    };
    return true;
}

static bool crossings_push(struct crossings *list, struct crossing crossing)
{
    if (list->count == list->capacity) {
        const size_t capacity = list->capacity ? 2 * list->capacity : 4096;
        struct crossing *found = realloc(list->found, capacity * sizeof *found);
        if (!found)
            return false;
        list->found = found;
        struct crossing *sorted = realloc(list->sorted, capacity * sizeof *sorted);
        if (!sorted)
            return false;
        list->sorted = sorted;
        list->capacity = capacity;
    }
    list->found[list->count++] = crossing;
    return true;
}

static void crossings_finish(struct crossings *list)
{
    free(list->found);
    free(list->sorted);
    free(list->starts);
}

/* Where the row of columns at y crosses the facet. false: no memory. */
static bool facet_cross(const struct facet *facet, double y, const struct raster *raster,
                        struct crossings *list)
{
    double x_min = INFINITY, x_max = -INFINITY;
    for (int i = 0; i < 3; ++i) {
        const struct edge *edge = &facet->edges[i];
        const double low = fmin(edge->y, edge->y + edge->dy);
        const double high = fmax(edge->y, edge->y + edge->dy);
        if (y < low || y > high)
            continue;
        const double x0 =
            edge->dy != 0.0 ? edge->x + (y - edge->y) * (edge->dx / edge->dy) : edge->x;
        const double x1 = edge->dy != 0.0 ? x0 : edge->x + edge->dx;
        x_min = fmin(x_min, fmin(x0, x1));
        x_max = fmax(x_max, fmax(x0, x1));
    }
    /* One column of margin each way: the edges decide, exactly. */
    const double last = (double)raster->row_columns - 1.0;
    const double from = fmax(floor(x_min * raster->columns - 0.5) - 1.0, 0.0);
    const double to = fmin(ceil(x_max * raster->columns - 0.5) + 1.0, last);
    for (double column = from; column <= to; column += 1.0) {
        const double x = (column + 0.5) / raster->columns;
        if (!edge_holds(&facet->edges[0], x, y) || !edge_holds(&facet->edges[1], x, y) ||
            !edge_holds(&facet->edges[2], x, y))
            continue;
        /* Steep slivers would shoot beyond their corners. */
        const double z = facet->z + facet->z_dx * (x - facet->x) + facet->z_dy * (y - facet->y);
        const struct crossing crossing = {.z = fmin(fmax(z, facet->z_min), facet->z_max),
                                          .column = (uint32_t)column,
                                          .winding = facet->winding};
        if (!crossings_push(list, crossing))
            return false;
    }
    return true;
}

static int by_height(const void *left, const void *right)
{
    const struct crossing *a = left, *b = right;
    if (a->z != b->z)
        return a->z < b->z ? -1 : 1;
    return a->winding - b->winding;
}

/* Groups by column, counting; then each column from below. */
static void crossings_sort(struct crossings *list, uint32_t column_count)
{
    memset(list->starts, 0, (column_count + 1) * sizeof *list->starts);
    for (size_t i = 0; i < list->count; ++i)
        ++list->starts[list->found[i].column];
    uint32_t end = 0;
    for (uint32_t column = 0; column < column_count; ++column)
        list->starts[column] = end += list->starts[column];
    list->starts[column_count] = end;
    for (size_t i = list->count; i-- > 0;)
        list->sorted[--list->starts[list->found[i].column]] = list->found[i];
    for (uint32_t column = 0; column < column_count; ++column) {
        const uint32_t start = list->starts[column];
        const uint32_t count = list->starts[column + 1] - start;
        if (count > 1)
            qsort(list->sorted + start, count, sizeof *list->sorted, by_height);
    }
}

static void cover_interval(const struct raster *raster, double from, double to, float *cells)
{
    const int32_t *dims = raster->dims;
    const size_t stride = (size_t)dims[0] * (size_t)dims[1];
    const float share = 1.0f / (float)(raster->columns * raster->columns);
    from = fmin(fmax(from, 0.0), dims[2]);
    to = fmin(to, dims[2]);
    for (int32_t k = (int32_t)from; k < dims[2] && k < to; ++k)
        cells[(size_t)k * stride] += share * (float)(fmin(to, k + 1.0) - fmax(from, k));
}

static void cover_row(const struct raster *raster, const struct crossings *list, int32_t row)
{
    float *cells = raster->coverage + (size_t)row * (size_t)raster->dims[0];
    for (uint32_t column = 0; column < raster->row_columns; ++column) {
        const struct crossing *sorted = list->sorted + list->starts[column];
        const uint32_t count = list->starts[column + 1] - list->starts[column];
        int32_t left_over = 0, winding = 0;
        for (uint32_t i = 0; i < count; ++i)
            left_over += sorted[i].winding;
        for (uint32_t i = 0; i + 1 < count; ++i) {
            winding += sorted[i].winding;
            if (winding != 0 && winding != left_over)
                cover_interval(raster, sorted[i].z, sorted[i + 1].z,
                               cells + column / (uint32_t)raster->columns);
        }
    }
}

static void round_row(const struct raster *raster, int32_t row)
{
    const size_t width = (size_t)raster->dims[0], height = (size_t)raster->dims[1];
    for (int32_t k = 0; k < raster->dims[2]; ++k) {
        float *cells = raster->coverage + ((size_t)k * height + (size_t)row) * width;
        for (size_t i = 0; i < width; ++i)
            cells[i] = cells[i] < NOISE ? 0.0f : cells[i] > 1.0f - NOISE ? 1.0f : cells[i];
    }
}

/* The rows of cells whose columns a facet may cross; false if none. */
static bool facet_rows(const struct facet *facet, int32_t row_count, int32_t *first, int32_t *last)
{
    if (!(facet->y_max >= 0.0 && facet->y_min <= row_count))
        return false;
    *first = (int32_t)fmax(floor(facet->y_min), 0.0);
    *last = (int32_t)fmin(floor(facet->y_max), row_count - 1.0);
    return *first <= *last;
}

static bool cross_row(const struct raster *raster, const struct facet *facets,
                      const uint32_t *members, size_t member_count, int32_t row,
                      struct crossings *list)
{
    for (int sub_row = 0; sub_row < raster->columns; ++sub_row) {
        const double y = row + (sub_row + 0.5) / raster->columns;
        list->count = 0;
        for (size_t i = 0; i < member_count; ++i) {
            const struct facet *facet = &facets[members[i]];
            if (facet->y_min <= y && y <= facet->y_max && !facet_cross(facet, y, raster, list))
                return false;
        }
        if (list->count == 0)
            continue;
        crossings_sort(list, raster->row_columns);
        cover_row(raster, list, row);
    }
    round_row(raster, row);
    return true;
}

static brume_result check_mesh(const float *positions, uint32_t vertex_count,
                               const uint32_t *triangles, uint32_t triangle_count)
{
    for (size_t i = 0; i < (size_t)vertex_count * 3; ++i)
        if (!isfinite(positions[i]))
            return fail(BRUME_E_MESH, "vertex %zu of the mesh has a NaN or infinite position",
                        i / 3);
    for (size_t i = 0; i < (size_t)triangle_count * 3; ++i)
        if (triangles[i] >= vertex_count)
            return fail(BRUME_E_MESH, "triangle %zu of the mesh names vertex %u of %u", i / 3,
                        triangles[i], vertex_count);
    return BRUME_OK;
}

/* Facets in lattice space; returns how many could be crossed at all. */
static size_t make_facets(const double *vertices, const uint32_t *triangles,
                          uint32_t triangle_count, struct facet *facets)
{
    size_t count = 0;
    for (size_t i = 0; i < triangle_count; ++i) {
        const double *const corners[3] = {vertices + 3 * (size_t)triangles[3 * i],
                                          vertices + 3 * (size_t)triangles[3 * i + 1],
                                          vertices + 3 * (size_t)triangles[3 * i + 2]};
        count += facet_make(corners, &facets[count]);
    }
    return count;
}

brume_result voxelize_mesh(const float *positions, uint32_t vertex_count, const uint32_t *triangles,
                           uint32_t triangle_count, const float lattice_from_object[16],
                           const int32_t dims[3], float *coverage)
{
    REQUIRE(positions != NULL || vertex_count == 0);
    REQUIRE(triangles != NULL || triangle_count == 0);
    REQUIRE(coverage != NULL);
    REQUIRE(dims[0] > 0 && dims[1] > 0 && dims[2] > 0);
    REQUIRE(dims[0] <= INT32_MAX / COLUMNS_MANY);
    if (!mat4_is_finite(lattice_from_object))
        return fail(BRUME_E_TRANSFORM, "the mesh's transform has NaN or infinite values");
    TRY(check_mesh(positions, vertex_count, triangles, triangle_count));

    const int columns = (int64_t)dims[0] * dims[1] <= SMALL_LATTICE ? COLUMNS_MANY : COLUMNS_FEW;
    const struct raster raster = {.dims = dims,
                                  .columns = columns,
                                  .row_columns = (uint32_t)(dims[0] * columns),
                                  .coverage = coverage};
    memset(coverage, 0, (size_t)dims[0] * (size_t)dims[1] * (size_t)dims[2] * sizeof *coverage);
    if (triangle_count == 0)
        return BRUME_OK;

    brume_result result = BRUME_E_MEMORY;
    uint32_t *members = NULL;
    double *vertices = malloc((size_t)vertex_count * 3 * sizeof *vertices);
    struct facet *facets = malloc((size_t)triangle_count * sizeof *facets);
    size_t *ends = calloc((size_t)dims[1] + 1, sizeof *ends);
    if (!vertices || !facets || !ends)
        goto error;

    const float *m = lattice_from_object;
    for (size_t i = 0; i < vertex_count; ++i) {
        const float *p = positions + 3 * i;
        double q[3];
        for (int axis = 0; axis < 3; ++axis)
            q[axis] = (double)m[axis] * p[0] + (double)m[4 + axis] * p[1] +
                      (double)m[8 + axis] * p[2] + m[12 + axis];
        vertices[3 * i] = rint(q[0] * SNAP) / SNAP;
        vertices[3 * i + 1] = rint(q[1] * SNAP) / SNAP;
        vertices[3 * i + 2] = q[2];
    }
    const size_t facet_count = make_facets(vertices, triangles, triangle_count, facets);

    /* Which facets each row of cells meets: counted, then filled from the back, which leaves ends
     * holding the starts. */
    int32_t first, last;
    for (size_t i = 0; i < facet_count; ++i)
        if (facet_rows(&facets[i], dims[1], &first, &last))
            for (int32_t row = first; row <= last; ++row)
                ++ends[row];
    size_t member_count = 0;
    for (int32_t row = 0; row < dims[1]; ++row)
        ends[row] = member_count += ends[row];
    ends[dims[1]] = member_count;
    members = malloc((member_count + 1) * sizeof *members);
    if (!members)
        goto error;
    for (size_t i = facet_count; i-- > 0;)
        if (facet_rows(&facets[i], dims[1], &first, &last))
            for (int32_t row = first; row <= last; ++row)
                members[--ends[row]] = (uint32_t)i;

    /* A row of cells belongs to one thread: the same sums in the same order for any number. */
    bool memory = true;
#pragma omp parallel reduction(&& : memory)
    {
        struct crossings list = {0};
        list.starts = malloc(((size_t)raster.row_columns + 1) * sizeof *list.starts);
        memory = list.starts != NULL;
#pragma omp for schedule(dynamic)
        for (int32_t row = 0; row < dims[1]; ++row)
            memory = memory && cross_row(&raster, facets, members + ends[row],
                                         ends[row + 1] - ends[row], row, &list);
        crossings_finish(&list);
    }
    if (memory)
        result = BRUME_OK;

error:
    free(members);
    free(ends);
    free(facets);
    free(vertices);
    if (result == BRUME_E_MEMORY)
        return fail(BRUME_E_MEMORY, "no memory to voxelise a mesh of %u triangles", triangle_count);
    return result;
}
