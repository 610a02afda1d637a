/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Media so thick that a step of the march is many free paths long: what a sun's light that is scattered
 * once makes of them (Chandrasekhar, Radiative Transfer, sec. 26: a half space). */
#include "dom.h"

static void lit_by_a_sun(void **state)
{
    (void)state;
    static const float thickness[] = {2, 20, 200, 2000}; /* of the cube, 1 m */
    static const float ways[2][3] = {{0, 0, -1}, {0.8f, 0, -0.6f}};
    for (size_t n = 0; n < sizeof thickness / sizeof *thickness; ++n)
        for (size_t w = 0; w < (n ? 2 : 1); ++w) { /* aslant a thin one is no half space */
            const float t = thickness[n];
            const struct coefficients fog = {.sigma_s = {0.9f * t, 0.4f * t, 0.1f * t},
                                             .sigma_a = {0.1f * t, 0.1f * t, 0.4f * t}};
            const brume_settings settings = {.method = BRUME_METHOD_OPV,
                                             .medium_resolution = 64,
                                             .lattice_resolution = 64,
                                             .step = 4.0f,
                                             .shadow_resolution = 64};
            brume_scene *scene = empty();
            add_fog_cube(scene, 1, origin, 0.5f, &fog);
            add_sun(scene, 2, ways[w]);
            brume_view view = orthographic_view((float[3]){0, 0, 0.5f}, down, 0.1f, 1.0f, 8);
            view.samples = 64;
            brume_job *job = render(scene, &settings, &view);
            float *pixels = read_pass(job, &view, BRUME_PASS_COMBINED);
            brume_job_release(job);
            const double up = -(double)ways[w][2];
            for (int c = 0; c < 3; ++c) {
                const double sigma_s = (double)fog.sigma_s[c];
                const double sigma_t = sigma_s + (double)fog.sigma_a[c];
                const double reaches = 1.0 - exp(-sigma_t * (1.0 + 1.0 / up));
                const double wanted =
                    sigma_s / sigma_t / (4.0 * PI) * up / (up + 1.0) * reaches;
                double found = 0.0;
                for (int i = 0; i < 64; ++i)
                    found += (double)pixels[4 * i + c] / 64.0;
                print_message("depth %g, sun %.1f: %.5f of %.5f\n", sigma_t, up, found, wanted);
                assert_close(found, wanted, 0.02);
            }
            free(pixels);
            brume_scene_destroy(scene);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(lit_by_a_sun)};
    return cmocka_run_group_tests(tests, open_device, close_device);
}
