/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Voxelisation: boxes have exact fractions, a sphere its volume, and bad meshes do no harm. */
#include "base/result.h"
#include "math/frame.h"
#include "scene/voxelize.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <omp.h>

/* The box's faces, normals outwards, two triangles each, bottom (z = 0) and top last. */
static const uint32_t box_triangles[36] = {0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4,
                                           2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6};

static void box_vertices(float x0, float y0, float z0, float x1, float y1, float z1, float *out)
{
    for (int i = 0; i < 8; ++i) {
        out[3 * i] = i & 1 ? x1 : x0;
        out[3 * i + 1] = i & 2 ? y1 : y0;
        out[3 * i + 2] = i & 4 ? z1 : z0;
    }
}

static double sum(const float *values, size_t count)
{
    double total = 0.0;
    for (size_t i = 0; i < count; ++i)
        total += values[i];
    return total;
}

static float overlap(float lower, float upper, int cell)
{
    return fmaxf(fminf(upper, (float)cell + 1.0f) - fmaxf(lower, (float)cell), 0.0f);
}

/* Voxelises an axis-aligned box and compares each cell with the product of its overlaps. */
static void expect_box(const float lower[3], const float upper[3], const int32_t dims[3],
                       const float lattice_from_object[16], float tolerance)
{
    float vertices[24], inverse[16], object_vertices[24];
    box_vertices(lower[0], lower[1], lower[2], upper[0], upper[1], upper[2], vertices);
    assert_true(mat4_invert(lattice_from_object, inverse));
    for (int i = 0; i < 8; ++i)
        mat4_point(inverse, vertices + 3 * i, object_vertices + 3 * i);
    const size_t count = (size_t)dims[0] * (size_t)dims[1] * (size_t)dims[2];
    float *coverage = malloc(count * sizeof *coverage);
    memset(coverage, 0xff, count * sizeof *coverage);
    assert_int_equal(
        voxelize_mesh(object_vertices, 8, box_triangles, 12, lattice_from_object, dims, coverage),
        BRUME_OK);
    for (int k = 0; k < dims[2]; ++k)
        for (int j = 0; j < dims[1]; ++j)
            for (int i = 0; i < dims[0]; ++i) {
                const float expected = overlap(lower[0], upper[0], i) *
                                       overlap(lower[1], upper[1], j) *
                                       overlap(lower[2], upper[2], k);
                const float found = coverage[((size_t)k * dims[1] + j) * dims[0] + i];
                if (tolerance == 0.0f)
                    assert_true(found == expected);
                else
                    assert_float_equal(found, expected, tolerance);
            }
    free(coverage);
}

static void a_box_on_the_cells_fills_them_exactly(void **state)
{
    (void)state;
    float identity[16];
    mat4_identity(identity);
    const int32_t dims[3] = {7, 6, 5};
    expect_box((float[3]){0, 0, 0}, (float[3]){7, 6, 5}, dims, identity, 0.0f);
    expect_box((float[3]){2, 1, 1}, (float[3]){5, 6, 4}, dims, identity, 0.0f);

    /* Through a matrix whose numbers floats do not hold exactly. */
    const float scaled[16] = {3.7f, 0, 0,    0, 0,      3.7f,  0,      0,
                              0,    0, 3.7f, 0, -12.3f, 4.56f, 0.789f, 1};
    expect_box((float[3]){0, 0, 0}, (float[3]){7, 6, 5}, dims, scaled, 0.0f);
    /* A lattice that is not small: four columns a cell instead of eight. */
    expect_box((float[3]){3, 4, 0}, (float[3]){70, 60, 2}, (int32_t[3]){72, 64, 3}, scaled, 0.0f);
}

static void a_box_between_the_cells_has_exact_fractions(void **state)
{
    (void)state;
    float identity[16];
    mat4_identity(identity);
    const int32_t dims[3] = {7, 6, 5};
    expect_box((float[3]){1.5f, 0.5f, 1.5f}, (float[3]){5.5f, 4.5f, 3.5f}, dims, identity, 1e-6f);
    expect_box((float[3]){1.25f, 0.75f, 1.3f}, (float[3]){5.125f, 4.625f, 3.85f}, dims, identity,
               1e-6f);
    /* Inside one cell. */
    expect_box((float[3]){2.25f, 3.25f, 1.2f}, (float[3]){2.75f, 3.75f, 1.45f}, dims, identity,
               1e-6f);
    /* Faces through the columns themselves, which stand at odd sixteenths: one side has them. */
    expect_box((float[3]){1.0625f, 1.0625f, 1.0f}, (float[3]){4.0625f, 4.0625f, 4.0f}, dims,
               identity, 0.13f);
    float coverage[7 * 6 * 5], vertices[24];
    box_vertices(1.0625f, 1.0625f, 1.0f, 4.0625f, 4.0625f, 4.0f, vertices);
    assert_int_equal(voxelize_mesh(vertices, 8, box_triangles, 12, identity, dims, coverage),
                     BRUME_OK);
    assert_float_equal(sum(coverage, 7 * 6 * 5), 27.0, 1e-4);
}

static void what_stands_out_of_the_lattice_is_cut(void **state)
{
    (void)state;
    float identity[16];
    mat4_identity(identity);
    expect_box((float[3]){-3, -2, -100}, (float[3]){2.5f, 1e6f, 3.25f}, (int32_t[3]){4, 4, 4},
               identity, 1e-6f);
    expect_box((float[3]){-3, -2, -100}, (float[3]){-1, -1, 3}, (int32_t[3]){4, 4, 4}, identity,
               0.0f);
    expect_box((float[3]){1, 1, 8}, (float[3]){3, 3, 9}, (int32_t[3]){4, 4, 4}, identity, 0.0f);
}

/* A sphere of latitudes and longitudes; its poles and meridians meet in many triangles. */
static void sphere_make(float centre, float radius, int rings, float **positions,
                        uint32_t *vertex_count, uint32_t **triangles, uint32_t *triangle_count)
{
    const int segments = 2 * rings;
    *vertex_count = (uint32_t)((rings + 1) * segments);
    *triangle_count = (uint32_t)(2 * rings * segments);
    *positions = malloc(*vertex_count * 3 * sizeof **positions);
    *triangles = malloc(*triangle_count * 3 * sizeof **triangles);
    for (int r = 0; r <= rings; ++r)
        for (int s = 0; s < segments; ++s) {
            /* sin(pi) is no zero: the pole must be one point for the mesh to be closed */
            const double theta = M_PI * r / rings, phi = 2.0 * M_PI * s / segments;
            const double ring = r == 0 || r == rings ? 0.0 : sin(theta);
            float *p = *positions + 3 * (r * segments + s);
            p[0] = centre + radius * (float)(ring * cos(phi));
            p[1] = centre + radius * (float)(ring * sin(phi));
            p[2] = centre + radius * (float)cos(theta);
        }
    uint32_t *t = *triangles;
    for (int r = 0; r < rings; ++r)
        for (int s = 0; s < segments; ++s) {
            const uint32_t a = (uint32_t)(r * segments + s);
            const uint32_t b = (uint32_t)(r * segments + (s + 1) % segments);
            const uint32_t c = a + (uint32_t)segments, d = b + (uint32_t)segments;
            const uint32_t quad[6] = {a, c, b, b, c, d};
            memcpy(t, quad, sizeof quad);
            t += 6;
        }
}

static void a_sphere_has_its_volume(void **state)
{
    (void)state;
    float identity[16];
    mat4_identity(identity);
    const int sizes[2] = {20, 80}; /* eight and four columns a cell */
    for (int i = 0; i < 2; ++i) {
        const int size = sizes[i];
        const int32_t dims[3] = {size, size, size};
        const size_t count = (size_t)size * size * size;
        const float radius = 0.45f * (float)size;
        float *positions, *coverage = malloc(count * sizeof *coverage);
        uint32_t vertex_count, *triangles, triangle_count;
        sphere_make(0.5f * (float)size, radius, 64, &positions, &vertex_count, &triangles,
                    &triangle_count);
        assert_int_equal(voxelize_mesh(positions, vertex_count, triangles, triangle_count, identity,
                                       dims, coverage),
                         BRUME_OK);
        const double volume = 4.0 / 3.0 * M_PI * pow(radius, 3.0);
        assert_float_equal(sum(coverage, count) / volume, 1.0, 0.01);
        const size_t middle = ((size_t)size / 2 * size + size / 2) * size + size / 2;
        assert_true(coverage[middle] == 1.0f);
        assert_true(coverage[0] == 0.0f);
        free(positions);
        free(triangles);
        free(coverage);
    }
}

static void a_turned_sheared_box_keeps_its_volume(void **state)
{
    (void)state;
    /* A unit cube to a parallelepiped inside the lattice; the volume is the determinant. */
    const float turn[16] = {6, 4, 1, 0, -4, 6, 2, 0, 1, -2, 7, 0, 7, 4, 3, 1};
    const int32_t dims[3] = {20, 20, 20};
    float coverage[20 * 20 * 20], vertices[24];
    box_vertices(0, 0, 0, 1, 1, 1, vertices);
    assert_int_equal(voxelize_mesh(vertices, 8, box_triangles, 12, turn, dims, coverage), BRUME_OK);
    assert_float_equal(sum(coverage, 8000) / mat4_determinant3(turn), 1.0, 0.01);

    /* Mirrored, so that every normal points inwards: the same volume. */
    float mirror[16];
    memcpy(mirror, turn, sizeof mirror);
    for (int i = 0; i < 3; ++i) {
        mirror[12 + i] += mirror[i];
        mirror[i] = -mirror[i];
    }
    float other[20 * 20 * 20];
    assert_int_equal(voxelize_mesh(vertices, 8, box_triangles, 12, mirror, dims, other), BRUME_OK);
    for (int i = 0; i < 8000; ++i)
        assert_float_equal(other[i], coverage[i], 1e-4f);
}

static void join_boxes(const float first[24], const float second[24], float positions[48],
                       uint32_t triangles[72])
{
    memcpy(positions, first, 24 * sizeof *positions);
    memcpy(positions + 24, second, 24 * sizeof *positions);
    for (int i = 0; i < 36; ++i) {
        triangles[i] = box_triangles[i];
        triangles[36 + i] = box_triangles[i] + 8;
    }
}

static void overlapping_boxes_unite(void **state)
{
    (void)state;
    float identity[16], first[24], second[24], positions[48], coverage[512];
    uint32_t triangles[72];
    const int32_t dims[3] = {8, 8, 8};
    mat4_identity(identity);
    box_vertices(1, 1, 1, 5, 5, 5, first);
    box_vertices(3, 3, 2.5f, 7, 7, 6.5f, second);
    join_boxes(first, second, positions, triangles);
    assert_int_equal(voxelize_mesh(positions, 16, triangles, 24, identity, dims, coverage),
                     BRUME_OK);
    assert_float_equal(sum(coverage, 512), 64.0 + 64.0 - 2.0 * 2.0 * 2.5, 1e-4);
    for (int i = 0; i < 512; ++i)
        assert_true(coverage[i] >= 0.0f && coverage[i] <= 1.0f);

    /* One on the other: no seam where they touch inside a cell. */
    box_vertices(1, 1, 1, 5, 5, 3.3f, first);
    box_vertices(1, 1, 3.3f, 5, 5, 6, second);
    join_boxes(first, second, positions, triangles);
    assert_int_equal(voxelize_mesh(positions, 16, triangles, 24, identity, dims, coverage),
                     BRUME_OK);
    assert_true(coverage[(3 * 8 + 2) * 8 + 2] == 1.0f);
    assert_float_equal(sum(coverage, 512), 80.0, 1e-4);
}

static void a_hole_costs_its_columns_and_nothing_smears(void **state)
{
    (void)state;
    float identity[16], vertices[24], coverage[512];
    const int32_t dims[3] = {8, 8, 8};
    mat4_identity(identity);
    box_vertices(1, 1, 1, 5, 5, 5, vertices);
    /* Without its top the box is nothing; without half of it, a half. */
    assert_int_equal(voxelize_mesh(vertices, 8, box_triangles, 10, identity, dims, coverage),
                     BRUME_OK);
    assert_true(sum(coverage, 512) == 0.0);
    assert_int_equal(voxelize_mesh(vertices, 8, box_triangles, 11, identity, dims, coverage),
                     BRUME_OK);
    assert_float_equal(sum(coverage, 512), 32.0, 4.0);
    /* Without a side it is whole. */
    assert_int_equal(voxelize_mesh(vertices, 8, box_triangles + 6, 10, identity, dims, coverage),
                     BRUME_OK);
    assert_float_equal(sum(coverage, 512), 64.0, 1e-4);

    /* A sheet under or over a whole box, over the half x > y, may cost the columns that it crosses,
     * but covers nothing outside the box and leaves the other columns alone. */
    for (int above = 0; above < 2; ++above)
        for (int flip = 0; flip < 2; ++flip) {
            float positions[36];
            uint32_t triangles[39];
            const float z = above ? 7.0f : 0.5f;
            const float sheet[12] = {0, 0, z, 8, 0, z, 0, 8, z, 8, 8, z};
            memcpy(positions, vertices, sizeof vertices);
            memcpy(positions + 24, sheet, sizeof sheet);
            memcpy(triangles, box_triangles, sizeof box_triangles);
            triangles[36] = 8;
            triangles[37] = flip ? 11 : 9;
            triangles[38] = flip ? 9 : 11;
            assert_int_equal(voxelize_mesh(positions, 12, triangles, 13, identity, dims, coverage),
                             BRUME_OK);
            for (int k = 0; k < 8; ++k)
                for (int j = 0; j < 8; ++j)
                    for (int i = 0; i < 8; ++i) {
                        const float found = coverage[(k * 8 + j) * 8 + i];
                        const bool inside = i >= 1 && i < 5 && j >= 1 && j < 5 && k >= 1 && k < 5;
                        if (!inside)
                            assert_true(found == 0.0f);
                        else if (i < j)
                            assert_true(found == 1.0f);
                    }
        }
}

static void degenerate_triangles_do_not_matter(void **state)
{
    (void)state;
    float identity[16], positions[30], coverage[512];
    uint32_t triangles[45];
    const int32_t dims[3] = {8, 8, 8};
    mat4_identity(identity);
    box_vertices(1, 1, 1, 5, 5, 5, positions);
    const float more[6] = {1, 1, 3, 3, 3, 3};
    memcpy(positions + 24, more, sizeof more);
    memcpy(triangles, box_triangles, sizeof box_triangles);
    const uint32_t flat[9] = {0, 0, 7, 0, 8, 4, 3, 3, 3};
    memcpy(triangles + 36, flat, sizeof flat);
    assert_int_equal(voxelize_mesh(positions, 10, triangles, 15, identity, dims, coverage),
                     BRUME_OK);
    assert_float_equal(sum(coverage, 512), 64.0, 1e-4);
    /* Nothing at all is nothing. */
    assert_int_equal(voxelize_mesh(NULL, 0, NULL, 0, identity, dims, coverage), BRUME_OK);
    assert_true(sum(coverage, 512) == 0.0);
}

static void bad_meshes_are_refused(void **state)
{
    (void)state;
    float identity[16], vertices[24], coverage[512];
    uint32_t triangles[36];
    const int32_t dims[3] = {8, 8, 8};
    mat4_identity(identity);
    box_vertices(1, 1, 1, 5, 5, 5, vertices);
    memcpy(triangles, box_triangles, sizeof triangles);
    triangles[20] = 8;
    assert_int_equal(voxelize_mesh(vertices, 8, triangles, 12, identity, dims, coverage),
                     BRUME_E_MESH);
    assert_non_null(strstr(last_error(), "triangle 6"));
    const float bad[3] = {NAN, INFINITY, -INFINITY};
    for (int i = 0; i < 3; ++i) {
        vertices[7] = bad[i];
        assert_int_equal(voxelize_mesh(vertices, 8, box_triangles, 12, identity, dims, coverage),
                         BRUME_E_MESH);
        assert_non_null(strstr(last_error(), "vertex 2"));
    }
    identity[5] = NAN;
    assert_int_equal(voxelize_mesh(vertices, 8, box_triangles, 12, identity, dims, coverage),
                     BRUME_E_TRANSFORM);
}

static void any_number_of_threads_gives_the_same(void **state)
{
    (void)state;
    float identity[16], *positions;
    uint32_t vertex_count, *triangles, triangle_count;
    const int32_t dims[3] = {24, 24, 24};
    static float one[24 * 24 * 24], many[24 * 24 * 24];
    mat4_identity(identity);
    sphere_make(12.1f, 10.7f, 40, &positions, &vertex_count, &triangles, &triangle_count);
    const int threads = omp_get_max_threads();
    omp_set_num_threads(1);
    assert_int_equal(
        voxelize_mesh(positions, vertex_count, triangles, triangle_count, identity, dims, one),
        BRUME_OK);
    omp_set_num_threads(5);
    assert_int_equal(
        voxelize_mesh(positions, vertex_count, triangles, triangle_count, identity, dims, many),
        BRUME_OK);
    omp_set_num_threads(threads);
    assert_memory_equal(one, many, sizeof one);
    free(positions);
    free(triangles);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_box_on_the_cells_fills_them_exactly),
        cmocka_unit_test(a_box_between_the_cells_has_exact_fractions),
        cmocka_unit_test(what_stands_out_of_the_lattice_is_cut),
        cmocka_unit_test(a_sphere_has_its_volume),
        cmocka_unit_test(a_turned_sheared_box_keeps_its_volume),
        cmocka_unit_test(overlapping_boxes_unite),
        cmocka_unit_test(a_hole_costs_its_columns_and_nothing_smears),
        cmocka_unit_test(degenerate_triangles_do_not_matter),
        cmocka_unit_test(bad_meshes_are_refused),
        cmocka_unit_test(any_number_of_threads_gives_the_same),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
