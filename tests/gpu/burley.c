/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Burley's diffuse reflection against its formula: of a sun, of a world and of a field of light that
 * are alike from everywhere. */
#include "harness.h"

#include <math.h>
#include <stdlib.h>

static const double pi = 3.14159265358979;
static const float reflectance = 0.7f;

static double rim(double cosine)
{
    return pow(1.0 - cosine, 5.0);
}

/* Over Lambert's. `both`: cosine between light and view. */
static double burley(double roughness, double nl, double nv, double both)
{
    const double retro = roughness * (1.0 + both) - 0.5; /* 2 r cos^2 to the half vector, less 1/2 */
    return (1.0 + retro * rim(nl)) * (1.0 + retro * rim(nv));
}

static double mean_burley(double roughness, double nv)
{
    enum { STEPS = 200 };
    double sum = 0.0;
    for (int i = 0; i < STEPS; ++i)
        for (int k = 0; k < STEPS; ++k) {
            const double sine = sqrt((i + 0.5) / STEPS), nl = sqrt(1.0 - sine * sine);
            const double both = nl * nv + sine * sqrt(1.0 - nv * nv) * cos(2.0 * pi * (k + 0.5) / STEPS);
            sum += burley(roughness, nl, nv, both) / (STEPS * STEPS);
        }
    return sum;
}

/* What is seen of a plate across z along a direction, from so many degrees off its normal. */
static double seen(brume_scene *scene, double degrees, const brume_settings *settings)
{
    const double angle = degrees * pi / 180.0;
    const float way[3] = {(float)sin(angle), 0, (float)-cos(angle)};
    brume_view view = orthographic_view((float[3]){0, 0, 0}, way, 0.02f, 0.5f, 4);
    view.samples = 16;
    brume_job *job = render(scene, settings, &view);
    float *pixels = read_pass(job, &view, BRUME_PASS_COMBINED);
    double sum = 0.0;
    for (int i = 0; i < 16; ++i)
        sum += (double)pixels[4 * i] / 16.0;
    free(pixels);
    brume_job_release(job);
    return sum / (double)reflectance;
}

static brume_scene *plate(float roughness, float share)
{
    const brume_material material = {.diffuse = {reflectance, reflectance, reflectance},
                                     .roughness = roughness,
                                     .alpha = 1,
                                     .burley = share};
    brume_scene *scene;
    assert_ok(brume_scene_create(device, &scene));
    add_plate(scene, 1, (float[3]){0, 0, 0}, (float[3]){0, 0, -1}, 0.4f);
    assert_ok(brume_scene_set_material(scene, 1, &material));
    return scene;
}

static const double degrees[] = {0, 45, 75, 85};
static const float roughnesses[] = {0.0f, 0.5f, 1.0f};

static void of_a_sun(void **state)
{
    (void)state;
    static const float ways[2][3] = {{0.8f, 0.1f, -0.3f}, {-0.8f, 0.1f, -0.3f}};
    for (size_t r = 0; r < 3; ++r)
        for (size_t w = 0; w < 2; ++w)
            for (size_t d = 0; d < sizeof degrees / sizeof *degrees; ++d)
                for (int share = 0; share <= 2; ++share) {
                    brume_scene *scene = plate(roughnesses[r], 0.5f * (float)share);
                    add_sun(scene, 2, ways[w]);
                    float light[3] = {-ways[w][0], -ways[w][1], -ways[w][2]};
                    unit(light);
                    const double angle = degrees[d] * pi / 180.0, nl = (double)light[2];
                    const double both = -sin(angle) * (double)light[0] + cos(angle) * nl;
                    const double whole = burley((double)roughnesses[r], nl, cos(angle), both);
                    const double wanted = (1.0 + 0.5 * share * (whole - 1.0)) * nl / pi;
                    const double found = seen(scene, degrees[d], NULL);
                    if (fabs(found - wanted) > 2e-3 * wanted)
                        fail_msg("roughness %g, %g degrees: %g instead of %g",
                                 (double)roughnesses[r], degrees[d], found, wanted);
                    brume_scene_destroy(scene);
                }
}

/* By directions of a world, and by the lattice of a closed box that glows, where the mean over all
 * directions stands for each. */
static void of_what_is_everywhere(void **state)
{
    (void)state;
    for (size_t r = 0; r < 3; ++r)
        for (size_t d = 0; d < sizeof degrees / sizeof *degrees; ++d) {
            const double wanted = mean_burley((double)roughnesses[r], cos(degrees[d] * pi / 180.0));
            brume_scene *scene = plate(roughnesses[r], 1.0f);
            const brume_world world = {.color = {1, 1, 1}};
            assert_ok(brume_scene_set_world(scene, &world));
            const double by_world = seen(scene, degrees[d], NULL);
            brume_scene_destroy(scene);

            scene = plate(roughnesses[r], 1.0f);
            float positions[24];
            uint32_t triangles[36];
            cube_mesh((float[3]){0, 0, 0}, 1.0f, positions, triangles);
            add_matt(scene, 3, "box", 0.0f, identity, positions, 8, triangles, 12);
            const brume_material glow = {.emission = {1, 1, 1}, .roughness = 1, .alpha = 1};
            assert_ok(brume_scene_set_material(scene, 3, &glow));
            const brume_settings settings = {.method = BRUME_METHOD_DOM, .field_resolution = 16};
            const double by_field = seen(scene, degrees[d], &settings);
            brume_scene_destroy(scene);
            print_message("roughness %.1f, %2.0f degrees: %.3f; world %.3f, field %.3f\n",
                          (double)roughnesses[r], degrees[d], wanted, by_world, by_field);
            assert_true(fabs(by_world - wanted) < 0.03 * wanted);
            assert_true(fabs(by_field - wanted) < 0.04 * wanted);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(of_a_sun),
        cmocka_unit_test(of_what_is_everywhere),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
