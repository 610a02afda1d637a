/* SPDX-License-Identifier: GPL-3.0-or-later */
/* DOM: surfaces stand in the way of light that the lattice knows nothing of, for it is coarser. */
#include "dom.h"

#define HIGH 0.025 /* of a step on a plate, m; cells are .125 m wide */

/* A box of that breadth along y, from x = 0 on. */
static void add_step(brume_scene *scene, uint64_t key, float glows)
{
    float positions[24];
    uint32_t triangles[36];
    const brume_material material = {.diffuse = {0.05f, 0.05f, 0.05f},
                                     .emission = {glows, glows, glows},
                                     .roughness = 1,
                                     .alpha = 1};
    cube_mesh(origin, 1.0f, positions, triangles);
    for (size_t i = 0; i < 24; ++i) {
        const bool high = positions[i] > 0.0f;
        positions[i] = i % 3 == 0   ? 0.01f * high
                       : i % 3 == 1 ? 0.5f * positions[i]
                                    : (float)HIGH * high;
    }
    add_matt(scene, key, "step", 0.05f, identity, positions, 8, triangles, 12);
    assert_ok(brume_scene_set_material(scene, key, &material));
}

/* The picture of a dark plate, perhaps with the step, in a box that glows. */
static float *picture(bool step, float glows, brume_view *view)
{
    static const brume_material glowing = {.emission = {1, 1, 1}, .roughness = 1, .alpha = 1};
    static const float square[12] = {-0.6f, -0.6f, 0, 0.6f, -0.6f, 0,
                                     -0.6f, 0.6f,  0, 0.6f, 0.6f,  0};
    static const uint32_t halves[6] = {0, 1, 3, 0, 3, 2};
    static const float aslant[3] = {1, 0, -1};
    const brume_settings settings = settings_for(16);
    brume_scene *scene = empty();
    add_box(scene, 1, 1.0f, 0.0f);
    assert_ok(brume_scene_set_material(scene, 1, &glowing));
    add_matt(scene, 2, "plate", 0.05f, identity, square, 4, halves, 2);
    if (step)
        add_step(scene, 3, glows);
    *view = orthographic_view(origin, aslant, 0.3f, 0.8f, 256);
    view->samples = 16;
    brume_job *job = render(scene, &settings, view);
    float *pixels = read_pass(job, view, BRUME_PASS_COMBINED);
    brume_job_release(job);
    brume_scene_destroy(scene);
    return pixels;
}

/* Mean of what the plate sends to the eye, so far before the step. */
static double seen(const float *pixels, const brume_view *view, double before)
{
    const float *m = view->view_from_world;
    double sum = 0.0;
    for (int i = -20; i <= 20; ++i) {
        const double at[2] = {-before, 0.004 * i};
        int pixel[2];
        for (int k = 0; k < 2; ++k) {
            const double on_view =
                (double)m[k] * at[0] + (double)m[4 + k] * at[1] + (double)m[12 + k];
            pixel[k] = (int)((0.5 + 0.5 * on_view * (double)view->clip_from_view[5 * k]) * 256.0);
        }
        sum += (double)pixels[4 * (pixel[1] * 256 + pixel[0])] / 41.0;
    }
    return sum;
}

/* The share that a strip hides of what falls on a point of the plate that it stands on is known. Of
 * a horizon the pixels that are asked miss some, so that a little more light comes past it. */
static void before_a_step(void **state)
{
    (void)state;
    brume_view view;
    float *open = picture(false, 0.0f, &view), *dark = picture(true, 0.0f, &view);
    float *bright = picture(true, 1.0f, &view);
    print_message("a plate in a box that glows: %.4f\n", seen(open, &view, 0.0));
    assert_close(seen(open, &view, 0.0), 0.05, 0.01);
    for (int i = 1; i <= 6; ++i) {
        const double before = HIGH * 0.25 * i;
        const double hidden = 0.5 - 0.5 * before / hypot(before, HIGH);
        const double truth = (1.0 - hidden) / (1.0 - 0.05 * hidden);
        const double found = seen(dark, &view, before) / 0.05;
        const double if_bright = seen(bright, &view, before) / 0.05;
        print_message("so many heights before a step: %.2f: %.3f of that, in truth %.3f; if the "
                      "step glows %.3f\n",
                      before / HIGH, found, truth, if_bright);
        assert_true(found > truth - 0.01 && found < truth + 0.04);
        assert_close(if_bright, 1.0, 0.03);
    }
    free(open);
    free(dark);
    free(bright);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(before_a_step),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
