/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Even worlds: media that emit what they absorb cannot be seen, thin ones scatter first-order light,
 * and the world's own medium attenuates background, surfaces and lamps by its reach. With single
 * scattering there is no white furnace. */
#include "harness.h"

#define PI 3.14159265358979

static const float origin[3];
static const float down[3] = {0, 0, -1};

static const brume_settings settings = {.medium_resolution = 32, .lattice_resolution = 32,
                                        .shadow_resolution = 128, .world_samples = 128};

/* The middle of a pass, as seen from `distance` before the target; far things are in sight. */
static double see_from(brume_scene *scene, const float target[3], const float direction[3],
                       float distance, uint32_t pass, uint32_t channel)
{
    brume_view view = orthographic_view(target, direction, 0.001f, distance, 4);
    view.clip_far = 1000.0f;
    view.samples = 16;
    view.passes = 1u << pass;
    brume_job *job = render(scene, &settings, &view);
    float *pixels = read_pass(job, &view, pass);
    const double value = middle(pixels, &view, brume_pass_channels(pass), channel);
    free(pixels);
    brume_job_release(job);
    return value;
}

/* DESIGN's furnace with absorption at albedo 0: Kirchhoff's law. */
static void absorption_and_emission_balance(void **state)
{
    (void)state;
    static const struct coefficients grey = {.sigma_a = {0.5f, 2.0f, 20.0f},
                                             .emission = {0.5f, 2.0f, 20.0f}};
    static const float directions[3][3] = {{0, 0, -1}, {1, 1, 1}, {0.3f, -1, 0.2f}};
    const brume_world world = {.color = {1, 1, 1}};
    brume_scene *scene;
    assert_ok(brume_scene_create(device, &scene));
    add_fog_cube(scene, 1, origin, 0.5f, &grey);
    assert_ok(brume_scene_set_world(scene, &world));
    for (int i = 0; i < 3; ++i)
        for (uint32_t channel = 0; channel < 3; ++channel)
            assert_close(
                see_from(scene, origin, directions[i], 2.0f, BRUME_PASS_COMBINED, channel), 1.0,
                0.01);
    brume_scene_destroy(scene);
}

/* Distance from a point in the cube [-1/2, 1/2]^3 to its surface. */
static double exit_distance(const double p[3], const double d[3])
{
    double length = INFINITY;
    for (int i = 0; i < 3; ++i)
        if (fabs(d[i]) > 1e-12)
            length = fmin(length, ((d[i] > 0 ? 0.5 : -0.5) - p[i]) / d[i]);
    return length;
}

/* First-order scattering of an even world of radiance 1 along the cube's axis: what reaches each
 * point from all directions, by the phase function towards the eye at -X. */
static double sky_quadrature(double sigma, double g)
{
    enum { STEPS = 64, DIRECTIONS = 4096 };
    double sum = 0.0;
    for (int k = 0; k < STEPS; ++k) {
        const double x = (k + 0.5) / STEPS - 0.5, p[3] = {x, 0, 0};
        double mean = 0.0;
        for (int i = 0; i < DIRECTIONS; ++i) {
            const double z = 1.0 - 2.0 * (i + 0.5) / DIRECTIONS, r = sqrt(1.0 - z * z);
            const double turn = i * PI * (3.0 - sqrt(5.0));
            const double d[3] = {r * cos(turn), r * sin(turn), z};
            /* Light from d goes along -d, and on along -X. */
            const double phase = (1.0 - g * g) / pow(1.0 + g * g - 2.0 * g * d[0], 1.5);
            mean += phase * exp(-sigma * exit_distance(p, d)) / DIRECTIONS;
        }
        sum += sigma * exp(-sigma * (x + 0.5)) * mean / STEPS;
    }
    return sum;
}

static void even_sky_in_a_cube(void **state)
{
    (void)state;
    static const float gs[] = {0.0f, 0.6f};
    const brume_world world = {.color = {1, 1, 1}};
    for (int i = 0; i < 2; ++i) {
        const struct coefficients thin = {.sigma_s = {0.02f, 0.1f, 1.0f}, .g = gs[i]};
        brume_scene *scene;
        assert_ok(brume_scene_create(device, &scene));
        add_fog_cube(scene, 1, origin, 0.5f, &thin);
        assert_ok(brume_scene_set_world(scene, &world));
        for (uint32_t channel = 0; channel < 3; ++channel)
            /* The sky's lattice has bands 0 and 1 alone: of g = 0.6 that takes 1.5 % in the densest
             * channel, and nothing where g is 0. */
            assert_close(see_from(scene, origin, (float[3]){1, 0, 0}, 2.0f,
                                  BRUME_PASS_VOLUME_DIRECT, channel),
                         sky_quadrature(thin.sigma_s[channel], gs[i]), gs[i] > 0 ? 0.035 : 0.02);
        brume_scene_destroy(scene);
    }
}

/* --- The world's medium ------------------------------------------------------------------- */

/* A plate of side 1 at z = 0: its bounds widened by the reach are the box of the fog. */
static brume_scene *foggy_plate(const brume_world *world)
{
    brume_scene *scene;
    assert_ok(brume_scene_create(device, &scene));
    add_plate(scene, 1, origin, down, 1.0f);
    assert_ok(brume_scene_set_world(scene, world));
    return scene;
}

static void fog_before_the_background(void **state)
{
    (void)state;
    const float reach = 5.0f;
    const brume_world world = {.color = {2, 2, 2}, .has_volume = 1, .reach = reach,
                               .sigma_a = {0.01f, 0.1f, 0.3f}};
    brume_scene *scene = foggy_plate(&world);
    static const float aside[3] = {0, 2, 1};
    for (uint32_t channel = 0; channel < 3; ++channel) {
        /* From within, from x = -3 to the box's face at x = 0.5 + reach. */
        const double within = 2.0 * exp(-world.sigma_a[channel] * (3.0 + 0.5 + reach));
        assert_close(see_from(scene, aside, (float[3]){1, 0, 0}, 3.0f, BRUME_PASS_ENVIRONMENT,
                              channel), within, 0.01);
        /* From without, through all of it. */
        const double through = exp(-world.sigma_a[channel] * (1.0 + 2.0 * reach));
        assert_close(see_from(scene, aside, (float[3]){1, 0, 0}, 20.0f, BRUME_PASS_TRANSMITTANCE,
                              channel), through, 0.01);
    }
    brume_scene_destroy(scene);
}

/* A sun on a plate: its light passes the fog above, and what is reflected the fog up to the eye. */
static void fog_before_a_surface(void **state)
{
    (void)state;
    const float reach = 4.0f, eye = 1.5f;
    const brume_world world = {.has_volume = 1, .reach = reach, .sigma_a = {0.05f, 0.2f, 0.5f}};
    brume_scene *scene = foggy_plate(&world);
    const float along[3] = {0.6f, 0, -0.8f};
    add_sun(scene, 1, along);
    for (uint32_t channel = 0; channel < 3; ++channel)
        assert_close(see_from(scene, origin, down, eye, BRUME_PASS_COMBINED, channel),
                     0.8 / PI * exp(-world.sigma_a[channel] * (reach / 0.8 + eye)), 0.01);
    brume_scene_destroy(scene);
}

/* The default reach is half of the diagonal of what the scene shows. */
static void default_reach(void **state)
{
    (void)state;
    const brume_world world = {.color = {1, 1, 1}, .has_volume = 1, .sigma_a = {0.1f, 0.1f, 0.1f}};
    brume_scene *scene = foggy_plate(&world);
    add_plate(scene, 2, (float[3]){0, 0, -8}, down, 1.0f);
    const double reach = 0.5 * sqrt(1.0 + 1.0 + 64.0);
    assert_close(see_from(scene, (float[3]){0, 2, -4}, (float[3]){1, 0, 0}, 50.0f,
                          BRUME_PASS_TRANSMITTANCE, 0),
                 exp(-0.1 * (1.0 + 2.0 * reach)), 0.01);
    brume_scene_destroy(scene);
}

/* Without limit neither sun nor world arrives, as in Cycles; a lamp does. */
static void unlimited_fog(void **state)
{
    (void)state;
    const brume_world world = {.color = {1, 1, 1}, .has_volume = 1, .reach = -1.0f,
                               .sigma_s = {0.1f, 0.1f, 0.1f}};
    brume_scene *scene = foggy_plate(&world);
    add_sun(scene, 1, down);
    assert_true(see_from(scene, origin, down, 1.0f, BRUME_PASS_COMBINED, 0) == 0.0);
    const brume_light lamp = point_lamp((float[3]){0, 0, 2}, 10.0f);
    assert_ok(brume_scene_set_light(scene, 2, &lamp));
    brume_world dark = world;
    memcpy(dark.sigma_a, world.sigma_s, sizeof dark.sigma_a);
    memset(dark.sigma_s, 0, sizeof dark.sigma_s);
    assert_ok(brume_scene_set_world(scene, &dark));
    assert_close(see_from(scene, origin, down, 1.0f, BRUME_PASS_COMBINED, 0),
                 10.0 / (4.0 * PI) / 4.0 / PI * exp(-0.1 * (2.0 + 1.0)), 0.01);
    brume_scene_destroy(scene);
}

/* Fog and a cube in it: their depths add, in the view and towards a lamp. */
static void fog_and_lattice_overlap(void **state)
{
    (void)state;
    static const struct coefficients cube = {.sigma_a = {1, 1, 1}};
    const float reach = 3.0f;
    const brume_world world = {.color = {1, 1, 1}, .has_volume = 1, .reach = reach,
                               .sigma_a = {0.1f, 0.2f, 0.3f}};
    brume_scene *scene;
    assert_ok(brume_scene_create(device, &scene));
    add_fog_cube(scene, 1, origin, 0.5f, &cube);
    assert_ok(brume_scene_set_world(scene, &world));
    for (uint32_t channel = 0; channel < 3; ++channel)
        assert_close(see_from(scene, origin, (float[3]){1, 0, 0}, 20.0f, BRUME_PASS_TRANSMITTANCE,
                              channel),
                     exp(-1.0 - world.sigma_a[channel] * (1.0 + 2.0 * reach)), 0.01);
    /* A plate below the cube, in its shadow; the plate widens the fog's box downwards. */
    const brume_world dark = {.has_volume = 1, .reach = reach, .sigma_a = {0.1f, 0.2f, 0.3f}};
    assert_ok(brume_scene_set_world(scene, &dark));
    add_plate(scene, 1, (float[3]){0, 0, -1}, down, 0.2f);
    add_sun(scene, 1, down);
    for (uint32_t channel = 0; channel < 3; ++channel)
        assert_close(see_from(scene, (float[3]){0, 0, -1}, down, 0.25f, BRUME_PASS_COMBINED,
                              channel),
                     exp(-1.0 - world.sigma_a[channel] * (0.5 + reach + 1.0 + 0.25)) / PI, 0.01);
    brume_scene_destroy(scene);
}

/* Emission of the fog along a ray: emission / sigma_a * (1 - exp(-tau)). */
static void glowing_fog(void **state)
{
    (void)state;
    const float reach = 2.0f;
    const brume_world world = {.has_volume = 1, .reach = reach, .sigma_a = {0.05f, 0.5f, 5},
                               .emission = {1, 2, 3}};
    brume_scene *scene = foggy_plate(&world);
    for (uint32_t channel = 0; channel < 3; ++channel) {
        const double sigma = world.sigma_a[channel];
        assert_close(see_from(scene, (float[3]){0, 1, 1}, (float[3]){1, 0, 0}, 9.0f,
                              BRUME_PASS_EMISSION, channel),
                     world.emission[channel] / sigma * (1.0 - exp(-sigma * (1.0 + 2.0 * reach))),
                     0.01);
    }
    brume_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(absorption_and_emission_balance),
        cmocka_unit_test(even_sky_in_a_cube),
        cmocka_unit_test(fog_before_the_background),
        cmocka_unit_test(fog_before_a_surface),
        cmocka_unit_test(default_reach),
        cmocka_unit_test(unlimited_fog),
        cmocka_unit_test(fog_and_lattice_overlap),
        cmocka_unit_test(glowing_fog),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
