/* SPDX-License-Identifier: GPL-3.0-or-later */
/* DOM: what is narrower than a cell blocks as much light as it covers, and nothing passes walls
 * that are thinner: strips below fog hide as much of the sky as they do by counting rays; a closed
 * box is dark. */
#include "dom.h"

#define MOST 64
#define RAYS 200000
#define EYE 0.0125 /* how high the middle pixel of scattered() looks through the cube */

/* Strips along y, of black board so thick, that cover a part of a plane through the fog. */
struct strips {
    double period, part, begin, thick, low;
};

/* From x = -1 to 1. */
static void add_strips(brume_scene *scene, const struct strips *strips)
{
    float corners[MOST * 24];
    uint32_t triangles[MOST * 36], count = 0;
    for (double x = strips->begin; x < 1.0 && count < MOST; x += strips->period, ++count) {
        float unit_cube[24];
        cube_mesh(origin, 1.0f, unit_cube, triangles + (size_t)count * 36);
        const double low[3] = {fmax(x, -1.0), -1.0, strips->low};
        const double high[3] = {fmin(x + strips->part * strips->period, 1.0), 1.0,
                                strips->low + strips->thick};
        for (size_t i = 0; i < 24; ++i)
            corners[count * 24 + i] = (float)(unit_cube[i] > 0.0f ? high[i % 3] : low[i % 3]);
        for (size_t i = 0; i < 36; ++i)
            triangles[count * 36 + i] += count * 8;
    }
    add_matt(scene, 1, "strips", 0.0f, identity, corners, count * 8, triangles, count * 12);
}

/* How much of a sky that is 1 everywhere is seen through them, mean over the way through the cube.
 */
static double by_rays(const struct strips *strips)
{
    uint64_t lots = 88172645463325252u;
    int seen = 0;
    for (int i = 0; i < RAYS; ++i) {
        const double from[3] = {2.0 * lot(&lots) - 1.0, 0.1 * (lot(&lots) - 0.5), EYE};
        double d[3] = {0, 0, 1}, turns[2] = {0};
        scatter(d, 0.0, &lots);
        bool beside = d[2] > 0.0;
        for (int k = 0; k < 2 && !beside; ++k) {
            const double way = (strips->low + k * strips->thick - from[2]) / d[2];
            const double x = from[0] + way * d[0], y = from[1] + way * d[1];
            turns[k] = (x - strips->begin) / strips->period;
            beside = fabs(x) > 1.0 || fabs(y) > 1.0;
        }
        seen += beside ||
                (floor(turns[0]) == floor(turns[1]) && turns[0] - floor(turns[0]) > strips->part &&
                 turns[1] - floor(turns[1]) > strips->part);
    }
    return (double)seen / RAYS;
}

static double by_brume(const struct strips *strips)
{
    brume_scene *scene = under_a_sky();
    add_strips(scene, strips);
    const double found = scattered(scene, BRUME_PASS_VOLUME_INDIRECT);
    brume_scene_destroy(scene);
    return found;
}

/* Cells are .125 m wide. Were links either cut or not, these would be off by .02 in the mean, and
 * by .12 where all gaps or none have a link's middle. */
static void strips(void **state)
{
    (void)state;
    static const struct strips cases[] = {
        /* wide as cells, begun anywhere in one; with narrow gaps; narrow themselves */
        {0.125, 0.5, -1.0, 0.001, -0.55},
        {0.125, 0.5, -1.04, 0.001, -0.55},
        {0.125, 0.5, -1.08, 0.001, -0.55},
        {0.125, 0.8, -1.02, 0.001, -0.55},
        {0.125, 0.2, -1.08, 0.001, -0.55},
        {0.08, 0.5, -1.0, 0.001, -0.55},
        {0.29, 0.3, -1.1, 0.001, -0.55},
        {0.5, 0.1, -1.0, 0.001, -0.55},
        {0.5, 0.1, -1.04, 0.001, -0.55},
        /* boards: where they are between cells' middles, the first around these; thicker ones; bars
         */
        {0.086, 0.53, -1.0, 0.015, -0.57},
        {0.086, 0.53, -1.0, 0.015, -0.55},
        {0.086, 0.53, -1.0, 0.015, -0.53},
        {0.086, 0.53, -1.0, 0.015, -0.51},
        {0.086, 0.53, -1.0, 0.015, -0.59},
        {0.086, 0.53, -1.0, 0.06, -0.57},
        {0.086, 0.53, -1.0, 0.06, -0.53},
        {0.3, 0.33, -1.0, 0.1, -0.57},
        {0.3, 0.33, -1.1, 0.1, -0.6},
        {0.3, 0.33, -1.2, 0.1, -0.63},
    };
    const size_t count = sizeof cases / sizeof *cases;
    double sum = 0.0;
    for (size_t i = 0; i < count; ++i) {
        const double truth = by_rays(&cases[i]), found = by_brume(&cases[i]);
        const struct strips *c = &cases[i];
        print_message("strips every %g m that cover %g, from %g, %g thick, at %g: %.4f, by rays "
                      "%.4f\n",
                      c->period, c->part, c->begin, c->thick, c->low, found, truth);
        assert_true(fabs(found - truth) < 0.03);
        sum += fabs(found - truth);
    }
    print_message("mean of what they are off by: %.4f\n", sum / (double)count);
    assert_true(sum / (double)count < 0.01);
}

/* The greatest fluence in a box of half a metre, which is turned by that matrix, and around it. */
static void in_and_out(const struct field *field, const float matrix[16], double found[2])
{
    int cell[3];
    found[0] = found[1] = 0.0;
    for (cell[2] = 0; cell[2] < dims_of(field)[2]; ++cell[2])
        for (cell[1] = 0; cell[1] < dims_of(field)[1]; ++cell[1])
            for (cell[0] = 0; cell[0] < dims_of(field)[0]; ++cell[0]) {
                double most = 0.0;
                for (int k = 0; k < 3; ++k) { /* how far out, along the box's axes */
                    double along = 0.0;
                    for (int m = 0; m < 3; ++m)
                        along += (double)matrix[4 * k + m] *
                                 ((double)centre(field, m, cell[m]) - (double)matrix[12 + m]);
                    most = fmax(most, fabs(along));
                }
                double *to = &found[most > 0.499];
                *to = fmax(*to, fluence(field, cell, 0));
            }
}

/* A closed white box as thin as paper, turned against the lattice, in fog under a sky, or in the
 * sun: it is dark inside. Of the sun the fog's points nearest to the walls may have some, by a
 * shadow map's texels. */
static void closed_box(void **state)
{
    (void)state;
    static const struct coefficients fog = {.sigma_s = {0.5f, 0.5f, 0.5f}};
    static const brume_world world = {.color = {1, 1, 1}};
    static const double turns[][2] = {
        {0, 0}, {0.3, 0}, {0.5, 0.2}, {0.785398, 0.61548}, {1.1, 0.7}};
    brume_settings settings = settings_for(16);
    settings.shadow_resolution = 1024;
    float positions[24];
    uint32_t triangles[36];
    cube_mesh(origin, 0.5f, positions, triangles);
    for (size_t i = 0; i < 2 * sizeof turns / sizeof *turns; ++i) {
        const bool sun = i % 2;
        const double a = turns[i / 2][0], b = turns[i / 2][1];
        const double rows[3][3] = {{cos(a) * cos(b), sin(a) * cos(b), -sin(b)},
                                   {-sin(a), cos(a), 0},
                                   {cos(a) * sin(b), sin(a) * sin(b), cos(b)}};
        float matrix[16] = {[12] = 0.013f, [13] = -0.021f, [14] = 0.034f, [15] = 1};
        for (int k = 0; k < 9; ++k)
            matrix[4 * (k / 3) + k % 3] = (float)rows[k / 3][k % 3];
        brume_scene *scene = empty();
        if (sun)
            add_sun(scene, 3, (float[3]){0.5f, 0.3f, -1.0f});
        else
            assert_ok(brume_scene_set_world(scene, &world));
        add_matt(scene, 1, "box", 0.9f, matrix, positions, 8, triangles, 12);
        add_fog_cube(scene, 2, origin, 1.0f, &fog);
        struct field field = field_of(scene, &settings, NULL);
        double found[2];
        in_and_out(&field, matrix, found);
        print_message("box turned by %g and %g %s: fluence up to %.4f inside, %.4f outside\n", a, b,
                      sun ? "in the sun" : "under a sky", found[0], found[1]);
        assert_true(found[0] <= (sun ? 0.02 : 0.0) * found[1]);
        assert_true(found[1] > 1.0);
        free(field.texels);
        brume_scene_destroy(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(closed_box),
        cmocka_unit_test(strips),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
