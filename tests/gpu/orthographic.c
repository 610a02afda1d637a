/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Orthographic views reach behind their eye: where it stands along the view does not matter. */
#include "harness.h"

#include <math.h>
#include <stdlib.h>

enum { PIXELS = 16 };

static const float origin[3] = {0, 0, 0}, down[3] = {0, 0, -1};

/* A slanted plate, fog above it, a sun and a lamp that is seen. */
static brume_scene *make_scene(void)
{
    brume_scene *scene;
    const struct coefficients fog = {.sigma_s = {0.4f, 0.4f, 0.4f}};
    assert_ok(brume_scene_create(device, &scene));
    add_plate(scene, 1, origin, (float[3]){0.3f, 0, -1}, 3.0f);
    add_fog_cube(scene, 2, (float[3]){0, 0, 0.5f}, 0.8f, &fog);
    add_sun(scene, 3, (float[3]){0.2f, 0.1f, -1});
    brume_light lamp = point_lamp((float[3]){0.4f, 0.2f, 1.0f}, 10.0f);
    lamp.radius = 0.2f;
    lamp.camera_visible = 1;
    assert_ok(brume_scene_set_light(scene, 4, &lamp));
    return scene;
}

/* The view moved along its axis by `back`, with clip planes that stay where they are. */
static brume_view moved(brume_view view, float back)
{
    view.view_from_world[14] -= back;
    view.clip_near += back;
    view.clip_far += back;
    return view;
}

static void the_eye_may_stand_anywhere(void **state)
{
    (void)state;
    brume_scene *scene = make_scene();
    brume_view ahead = orthographic_view(origin, down, 2.0f, 4.0f, PIXELS);
    ahead.clip_near = 0.5f;
    ahead.passes = 1u << BRUME_PASS_COMBINED | 1u << BRUME_PASS_DEPTH;
    /* The eye within the lamp's height, on the plate, and behind all of it. */
    static const float back[] = {-3.2f, -4.0f, -7.0f};
    brume_job *job = render(scene, NULL, &ahead);
    float *wanted = read_pass(job, &ahead, BRUME_PASS_COMBINED);
    float *depth = read_pass(job, &ahead, BRUME_PASS_DEPTH);
    brume_job_release(job);
    for (size_t k = 0; k < sizeof back / sizeof *back; ++k) {
        const brume_view view = moved(ahead, back[k]);
        assert_true(view.clip_near < 0.0f);
        job = render(scene, NULL, &view);
        float *seen = read_pass(job, &view, BRUME_PASS_COMBINED);
        float *far_ = read_pass(job, &view, BRUME_PASS_DEPTH);
        brume_job_release(job);
        for (size_t i = 0; i < 4 * PIXELS * PIXELS; ++i)
            assert_float_equal(seen[i], wanted[i], 2e-3f * (1.0f + fabsf(wanted[i])));
        for (size_t i = 0; i < PIXELS * PIXELS; ++i)
            assert_float_equal(far_[i], depth[i] + back[k], 1e-3f);
        free(seen);
        free(far_);
    }
    free(wanted);
    free(depth);
    brume_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_eye_may_stand_anywhere)};
    return cmocka_run_group_tests(tests, open_device, close_device);
}
