/* SPDX-License-Identifier: GPL-3.0-or-later */
/* DOM: a ground that goes on far beyond the lattice lights thin fog above it, and hides the world
 * below it, as an endless one does by its closed form. */
#include "dom.h"

#define REFLECTANCE 0.3f

static void add_ground(brume_scene *scene, float height)
{
    static const uint32_t triangles[6] = {0, 1, 2, 0, 2, 3};
    const float h = 200.0f;
    const float square[12] = {-h, -h, height, h, -h, height, h, h, height, -h, h, height};
    add_matt(scene, 1, "ground", REFLECTANCE, identity, square, 4, triangles, 2);
}

/* Below the cube, and at its lower side. */
static const float heights[] = {-2.5f, -1.001f};

/* Through its lower part, in steps of less than a cell: which cells are the ground's changes in one
 * of them, and with it what they have of the sky. So much each may be off, and their mean by less.
 */
enum { STEPS = 9 };
#define LOWEST (-0.86f)
#define STEP 0.02f /* one is at the centres of a layer, or a rounding below */
#define EACH 0.04
#define MEAN 0.01

/* What the fog scatters over a ground at this height, by the truth. */
static double by_truth(brume_scene *scene, float height, double truth)
{
    add_ground(scene, height);
    const double found = scattered(scene, BRUME_PASS_VOLUME_INDIRECT) / truth;
    print_message("ground at %g: %.4f of the truth\n", (double)height, found);
    brume_scene_destroy(scene);
    return found;
}

static void check(brume_scene *(*make)(void), double truth)
{
    for (size_t i = 0; i < sizeof heights / sizeof *heights; ++i)
        assert_true(fabs(by_truth(make(), heights[i], truth) - 1.0) < 0.02);
    double sum = 0.0;
    for (int i = 0; i < STEPS; ++i) {
        const double found = by_truth(make(), LOWEST + STEP * (float)i, truth);
        assert_true(fabs(found - 1.0) < EACH);
        sum += found / STEPS;
    }
    print_message("mean of those in the cube: %.4f\n", sum);
    assert_true(fabs(sum - 1.0) < MEAN);
}

static brume_scene *in_the_sun(void)
{
    brume_scene *scene = empty();
    add_sun(scene, 3, (float[3]){0.5f, 0.3f, -1.0f});
    return scene;
}

/* The ground sends out R E / pi, and the fog turns half of the sphere times that over 4 pi to the
 * eye. */
static void sunlit_ground(void **state)
{
    (void)state;
    const double cosine = 1.0 / sqrt(1.34);
    check(in_the_sun, (double)REFLECTANCE * cosine / (2.0 * PI));
}

/* A sky of radiance 1 above, and below what the ground reflects of it. */
static void ground_under_a_sky(void **state)
{
    (void)state;
    check(under_a_sky, 0.5 * (1.0 + (double)REFLECTANCE));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sunlit_ground),
        cmocka_unit_test(ground_under_a_sky),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
