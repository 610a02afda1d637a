/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What a lens blurs, of surfaces and of media, as much as geometry says; what is in focus stays. */
#include "harness.h"

#include <math.h>
#include <stdlib.h>

enum { PIXELS = 128, SAMPLES = 64 };

static const float zoom = 4.0f, focus = 2.0f;

/* Of a picture's first channel: where its light is, in pixels from the middle, how far spread along
 * the axes (variances), and all of it. */
struct spot {
    double sum, mean[2], spread[2];
};

static struct spot spot_of(brume_scene *scene, const brume_view *view)
{
    brume_job *job = render(scene, NULL, view);
    float *pixels = read_pass(job, view, BRUME_PASS_COMBINED);
    brume_job_release(job);
    struct spot spot = {0};
    for (int pass = 0; pass < 2; ++pass)
        for (int y = 0; y < PIXELS; ++y)
            for (int x = 0; x < PIXELS; ++x) {
                const double value = (double)pixels[4 * (y * PIXELS + x)];
                const double at[2] = {x + 0.5 - 0.5 * PIXELS, y + 0.5 - 0.5 * PIXELS};
                spot.sum += pass ? 0.0 : value;
                for (int i = 0; i < 2 && value > 0.0; ++i)
                    if (pass)
                        spot.spread[i] +=
                            value / spot.sum * (at[i] - spot.mean[i]) * (at[i] - spot.mean[i]);
                    else
                        spot.mean[i] += value * at[i];
                if (!pass && y == PIXELS - 1 && x == PIXELS - 1)
                    for (int i = 0; i < 2; ++i)
                        spot.mean[i] /= spot.sum;
            }
    free(pixels);
    return spot;
}

/* From the origin along -Z. */
static brume_view perspective(const brume_lens *lens)
{
    brume_view view = {.width = PIXELS,
                       .height = PIXELS,
                       .clip_near = 0.1f,
                       .clip_far = 10.0f,
                       .samples = SAMPLES,
                       .lens = *lens};
    memcpy(view.view_from_world, identity, sizeof identity);
    view.clip_from_view[0] = view.clip_from_view[5] = zoom;
    view.clip_from_view[10] = view.clip_from_view[11] = -1.0f;
    view.clip_from_view[14] = -0.2f;
    return view;
}

/* The same plane in focus, as wide there. */
static brume_view parallel(const brume_lens *lens)
{
    brume_view view = orthographic_view((float[3]){0, 0, -5}, (float[3]){0, 0, -1},
                                        2.0f * focus / zoom, 5.0f, PIXELS);
    view.samples = SAMPLES;
    view.lens = *lens;
    return view;
}

/* A square that glows, so far before the eye and a little aside. */
static brume_scene *plate(float depth)
{
    const float center[3] = {0.02f * depth, -0.03f * depth, -depth};
    const brume_material glow = {.emission = {1, 1, 1}, .roughness = 1, .alpha = 1};
    brume_scene *scene;
    assert_ok(brume_scene_create(device, &scene));
    add_plate(scene, 1, center, (float[3]){0, 0, -1}, 0.08f * depth);
    assert_ok(brume_scene_set_material(scene, 1, &glow));
    return scene;
}

/* A cube of a medium that glows. */
static brume_scene *glow(float depth)
{
    const float center[3] = {0.02f * depth, -0.03f * depth, -depth};
    const struct coefficients c = {.emission = {1, 1, 1}};
    brume_scene *scene;
    assert_ok(brume_scene_create(device, &scene));
    add_fog_cube(scene, 1, center, 0.04f * depth, &c);
    return scene;
}

/* Spread by the disk that the opening's picture is, a quarter of the radius' square along each axis,
 * over what it is without a lens; the light in the same place, and as much of it. The edges of
 * things fall on pixels' middles or not in each sample: a fortieth of their own spread. */
static void assert_blurred(brume_scene *scene, brume_view view, double radius)
{
    const struct spot blurred = spot_of(scene, &view);
    view.lens = (brume_lens){0};
    const struct spot sharp = spot_of(scene, &view);
    assert_true(sharp.sum > 0.0);
    assert_true(fabs(blurred.sum / sharp.sum - 1.0) < 0.02);
    for (int i = 0; i < 2; ++i) {
        const double more = blurred.spread[i] - sharp.spread[i], wanted = 0.25 * radius * radius;
        if (fabs(more - wanted) > 0.05 * wanted + 0.025 * sharp.spread[i] ||
            fabs(blurred.mean[i] - sharp.mean[i]) > 0.02 * radius + 0.05)
            fail_msg("spread %.3f -> %.3f, %.3f more wanted; mean %.3f -> %.3f", sharp.spread[i],
                     blurred.spread[i], wanted, sharp.mean[i], blurred.mean[i]);
    }
}

static void blurs_as_geometry_says(void **state)
{
    (void)state;
    static const float depths[] = {0.8f, 1.5f, 2.0f, 4.0f};
    const brume_lens lens = {.radius = 0.06f, .focus = focus};
    for (size_t i = 0; i < sizeof depths / sizeof *depths; ++i) {
        brume_scene *scenes[2] = {plate(depths[i]), glow(depths[i])};
        const double away = fabs(1.0 / (double)depths[i] - 1.0 / (double)focus);
        const double pixels = 0.5 * PIXELS * (double)zoom * (double)lens.radius;
        for (int k = 0; k < 2; ++k) {
            assert_blurred(scenes[k], perspective(&lens), away * pixels);
            /* A parallel view has things as large everywhere. */
            assert_blurred(scenes[k], parallel(&lens), away * pixels * (double)(depths[i] / focus));
            brume_scene_destroy(scenes[k]);
        }
    }
}

static void bad_lenses_are_told(void **state)
{
    (void)state;
    static const brume_lens bad[] = {
        {.radius = -1, .focus = 1},
        {.radius = NAN, .focus = 1},
        {.radius = INFINITY, .focus = 1},
        {.radius = 1},
        {.radius = 1, .focus = -1},
        {.radius = 1, .focus = NAN},
        {.radius = 1, .focus = INFINITY},
        {.radius = 1, .focus = 1, .blades = 1025},
        {.radius = 1, .focus = 1, .rotation = NAN},
        {.radius = 1, .focus = 1e-7f},
        {.radius = 1e7f, .focus = 1},
        {.radius = 1, .focus = 1, .ratio = -1},
        {.radius = 1, .focus = 1, .ratio = 1e-3f},
        {.radius = 1, .focus = 1, .ratio = INFINITY},
    };
    brume_scene *scene = plate(1.0f);
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
        const brume_view view = perspective(&bad[i]);
        brume_job *job;
        assert_int_equal(brume_render(scene, NULL, &view, &job), BRUME_E_ARGUMENT);
    }
    /* Too wide for anything to be seen, and all the same a picture. */
    const brume_view wide = perspective(&(brume_lens){.radius = 1e6f, .focus = 1e-6f});
    brume_job_release(render(scene, NULL, &wide));
    brume_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(blurs_as_geometry_says),
        cmocka_unit_test(bad_lenses_are_told),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
