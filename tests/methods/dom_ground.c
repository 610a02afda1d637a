/* SPDX-License-Identifier: GPL-3.0-or-later */
/* DOM: a ground that goes on far beyond the lattice lights thin fog above it, and hides the world
 * below it, as an endless one does by its closed form. */
#include "dom.h"

#define REFLECTANCE 0.3f
#define THIN 0.002f /* what scatters once scatters no more, and dims nothing */

static void add_ground(brume_scene *scene, float height)
{
    static const uint32_t triangles[6] = {0, 1, 2, 0, 2, 3};
    const float h = 200.0f;
    const float square[12] = {-h, -h, height, h, -h, height, h, h, height, -h, h, height};
    add_matt(scene, 1, "ground", REFLECTANCE, identity, square, 4, triangles, 2);
}

/* Radiance that a cube of thin fog, two metres wide, scatters to an eye at its side of light that
 * does not come from lamps, by its scattering coefficient and width. */
static double scattered(brume_scene *scene, uint32_t pass)
{
    static const struct coefficients thin = {.sigma_s = {THIN, THIN, THIN}};
    static const float sideways[3] = {1, 0, 0};
    const brume_settings settings = settings_for(16);
    add_fog_cube(scene, 2, origin, 1.0f, &thin);
    brume_view view = orthographic_view(origin, sideways, 0.2f, 50.0f, 8);
    view.passes = 1u << pass;
    brume_job *job = render(scene, &settings, &view);
    float *pixels = read_pass(job, &view, pass);
    const double found = middle(pixels, &view, 4, 0);
    free(pixels);
    brume_job_release(job);
    return found / (2.0 * (double)THIN);
}

/* Below the cube, at its lower side, and through its lower part. */
static const float heights[] = {-2.5f, -1.001f, -0.7f};

/* The ground sends out R E / pi, and the fog turns half of the sphere times that over 4 pi to the
 * eye. */
static void sunlit_ground(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof heights / sizeof *heights; ++i) {
        brume_scene *scene = empty();
        add_sun(scene, 3, (float[3]){0.5f, 0.3f, -1.0f});
        add_ground(scene, heights[i]);
        const double cosine = 1.0 / sqrt(1.34);
        const double truth = (double)REFLECTANCE * cosine / (2.0 * PI);
        const double found = scattered(scene, BRUME_PASS_VOLUME_INDIRECT);
        print_message("ground at %g: %.4f of the truth\n", (double)heights[i], found / truth);
        assert_true(fabs(found / truth - 1.0) < 0.02);
        brume_scene_destroy(scene);
    }
}

/* A sky of radiance 1 above, and below what the ground reflects of it. */
static void ground_under_a_sky(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof heights / sizeof *heights; ++i) {
        brume_scene *scene = empty();
        const brume_world world = {.color = {1, 1, 1}};
        assert_ok(brume_scene_set_world(scene, &world));
        add_ground(scene, heights[i]);
        const double truth = 0.5 * (1.0 + (double)REFLECTANCE);
        const double found = scattered(scene, BRUME_PASS_VOLUME_INDIRECT);
        print_message("ground at %g: %.4f of the truth\n", (double)heights[i], found / truth);
        assert_true(fabs(found / truth - 1.0) < 0.02);
        brume_scene_destroy(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sunlit_ground),
        cmocka_unit_test(ground_under_a_sky),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
