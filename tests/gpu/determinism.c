/* SPDX-License-Identifier: GPL-3.0-or-later */
/* One scene gives one picture: bit for bit the same when it is rendered again, by another scene
 * object, and when its datablocks came in another order, with every source of noise on. */
#include "harness.h"

enum { PIXELS = 24 };

static const float origin[3];

static const brume_settings settings = {.medium_resolution = 12, .lattice_resolution = 8,
                                        .shadow_resolution = 32, .light_samples = 4,
                                        .world_samples = 8};

static void add_world(brume_scene *scene)
{
    float pixels[16 * 8 * 4];
    for (int i = 0; i < 16 * 8 * 4; ++i)
        pixels[i] = i % 4 == 3 ? 1.0f : 0.1f + 0.05f * (float)(i % 17);
    const brume_image image = {.name = "sky", .pixels = pixels, .width = 16, .height = 8};
    const brume_world world = {.color = {1, 1, 1}, .image = 9};
    assert_ok(brume_scene_set_image(scene, 9, &image));
    assert_ok(brume_scene_set_world(scene, &world));
}

static void add_lamps(brume_scene *scene)
{
    brume_light lamp = point_lamp((float[3]){0.4f, 0.6f, 1.5f}, 30.0f);
    lamp.radius = 0.3f;
    assert_ok(brume_scene_set_light(scene, 1, &lamp));
    lamp.type = BRUME_LIGHT_RECTANGLE;
    lamp.size[0] = lamp.size[1] = 1.0f;
    assert_ok(brume_scene_set_light(scene, 2, &lamp));
}

static void add_surfaces(brume_scene *scene)
{
    add_plate(scene, 1, (float[3]){0, 0, -1}, (float[3]){0, 0, -1}, 3.0f);
    add_plate(scene, 2, (float[3]){0, 0.2f, 0.8f}, (float[3]){0, 0.3f, -1}, 0.8f);
    const brume_material veil = {.diffuse = {0.8f, 0.3f, 0.2f}, .specular = {0.04f, 0.04f, 0.04f},
                                 .roughness = 0.4f, .alpha = 0.5f,
                                 .alpha_mode = BRUME_ALPHA_BLEND};
    assert_ok(brume_scene_set_material(scene, 2, &veil));
}

static brume_scene *noisy_scene(int backwards)
{
    static const struct coefficients fog = {.sigma_s = {1, 1.5f, 2}, .sigma_a = {0.2f, 0.1f, 0},
                                            .emission = {0.1f, 0, 0}, .g = 0.4f};
    void (*const steps[])(brume_scene *) = {add_world, add_lamps, add_surfaces};
    brume_scene *scene;
    assert_ok(brume_scene_create(device, &scene));
    for (int i = 0; i < 3; ++i)
        steps[backwards ? 2 - i : i](scene);
    add_fog_cube(scene, 1, origin, 0.5f, &fog);
    return scene;
}

static brume_view noisy_view(uint32_t seed)
{
    brume_view view = orthographic_view(origin, (float[3]){0.3f, 0.5f, -1}, 3.0f, 4.0f, PIXELS);
    view.passes = (1u << BRUME_PASS_COUNT) - 1;
    view.seed = seed;
    return view;
}

/* All passes, one after the other. */
static float *all_passes(brume_job *job, size_t *bytes)
{
    float *all = malloc(PIXELS * PIXELS * 4 * BRUME_PASS_COUNT * sizeof *all);
    assert_non_null(all);
    size_t floats = 0;
    for (uint32_t pass = 0; pass < BRUME_PASS_COUNT; ++pass) {
        const size_t count = PIXELS * PIXELS * brume_pass_channels(pass);
        assert_ok(brume_job_read(job, pass, all + floats, count));
        for (size_t i = floats; i < floats + count; ++i)
            assert_true(isfinite(all[i]));
        floats += count;
    }
    *bytes = floats * sizeof *all;
    return all;
}

static float *picture(brume_scene *scene, uint32_t seed, size_t *bytes)
{
    const brume_view view = noisy_view(seed);
    brume_job *job = render(scene, &settings, &view);
    float *all = all_passes(job, bytes);
    brume_job_release(job);
    return all;
}

static void same_scene_same_pixels(void **state)
{
    (void)state;
    size_t bytes;
    brume_scene *first = noisy_scene(0), *second = noisy_scene(1);
    float *reference = picture(first, 3, &bytes);
    float *other = picture(first, 4, &bytes);
    /* Otherwise no noise is on, and the rest shows nothing. */
    assert_memory_not_equal(reference, other, bytes);
    free(other);
    other = picture(first, 3, &bytes);
    assert_memory_equal(reference, other, bytes);
    free(other);
    other = picture(second, 3, &bytes);
    assert_memory_equal(reference, other, bytes);
    free(other);
    free(reference);
    brume_scene_destroy(first);
    brume_scene_destroy(second);
}

/* What was there before leaves no trace: a scene changed and changed back. */
static void history_leaves_no_trace(void **state)
{
    (void)state;
    size_t bytes;
    brume_scene *scene = noisy_scene(0);
    float *reference = picture(scene, 3, &bytes);
    static const struct coefficients dense = {.sigma_s = {9, 9, 9}};
    assert_ok(brume_scene_remove(scene, BRUME_KIND_LIGHT, 2));
    assert_ok(brume_scene_remove(scene, BRUME_KIND_INSTANCES, 2));
    add_fog_cube(scene, 1, (float[3]){1, 0, 0}, 0.8f, &dense);
    float *other = picture(scene, 3, &bytes);
    assert_memory_not_equal(reference, other, bytes);
    free(other);
    assert_ok(brume_scene_remove(scene, BRUME_KIND_VOLUME, 1));
    other = picture(scene, 3, &bytes);
    free(other);
    static const struct coefficients fog = {.sigma_s = {1, 1.5f, 2}, .sigma_a = {0.2f, 0.1f, 0},
                                            .emission = {0.1f, 0, 0}, .g = 0.4f};
    add_fog_cube(scene, 1, origin, 0.5f, &fog);
    add_surfaces(scene);
    add_lamps(scene);
    other = picture(scene, 3, &bytes);
    assert_memory_equal(reference, other, bytes);
    free(other);
    free(reference);
    brume_scene_destroy(scene);
}

/* A job shows the scene as it was when it was asked for, whatever happens while it waits. */
static void edits_do_not_reach_queued_jobs(void **state)
{
    (void)state;
    const brume_view view = noisy_view(3);
    const size_t count = PIXELS * PIXELS * 4;
    float *pixels[2];
    brume_scene *scene = noisy_scene(0);
    brume_job *job = render(scene, &settings, &view);
    pixels[0] = read_pass(job, &view, BRUME_PASS_COMBINED);
    brume_job_release(job);

    brume_view slow = view;
    slow.samples = 64;
    brume_job *before;
    brume_job_status status;
    assert_ok(brume_render(scene, &settings, &slow, &before));
    assert_ok(brume_render(scene, &settings, &view, &job));
    assert_ok(brume_scene_keep(scene, BRUME_KIND_LIGHT, NULL, 0));
    assert_ok(brume_scene_keep(scene, BRUME_KIND_MESH, NULL, 0));
    assert_ok(brume_job_wait(job, -1, &status));
    assert_int_equal(status.state, BRUME_JOB_DONE);
    pixels[1] = read_pass(job, &view, BRUME_PASS_COMBINED);
    assert_memory_equal(pixels[0], pixels[1], count * sizeof(float));
    brume_job_release(before);
    brume_job_release(job);
    job = render(scene, &settings, &view);
    assert_ok(brume_job_read(job, BRUME_PASS_COMBINED, pixels[1], count));
    assert_memory_not_equal(pixels[0], pixels[1], count * sizeof(float));
    brume_job_release(job);
    free(pixels[0]);
    free(pixels[1]);
    brume_scene_destroy(scene);
}

/* Jobs that take turns do not touch each other's pictures: of one scene with the same products, of
 * one scene with settings that undo them at every turn, of two scenes. */
static void jobs_beside_one_another(void **state)
{
    (void)state;
    enum { JOBS = 4 };
    brume_scene *first = noisy_scene(0), *second = noisy_scene(1);
    assert_ok(brume_scene_remove(second, BRUME_KIND_LIGHT, 2));
    brume_scene *const scenes[JOBS] = {first, first, first, second};
    brume_settings all_settings[JOBS] = {settings, settings, settings, settings};
    all_settings[2].shadow_resolution = 48;
    all_settings[2].medium_resolution = 9;
    brume_view views[JOBS];
    brume_job *jobs[JOBS];
    float *alone[JOBS];
    size_t bytes;
    for (int i = 0; i < JOBS; ++i) {
        views[i] = noisy_view(i == 1 ? 4 : 3);
        brume_job *job = render(scenes[i], &all_settings[i], &views[i]);
        alone[i] = all_passes(job, &bytes);
        brume_job_release(job);
        for (int before = 0; before < i; ++before)
            assert_memory_not_equal(alone[i], alone[before], bytes);
    }
    for (int i = 0; i < JOBS; ++i)
        assert_ok(brume_render(scenes[i], &all_settings[i], &views[i], &jobs[i]));
    brume_job_status status;
    do
        assert_ok(brume_job_wait(jobs[JOBS - 1], 1, &status));
    while (status.samples_done == 0);
    assert_ok(brume_job_poll(jobs[0], &status));
    assert_int_equal(status.state, BRUME_JOB_RUNNING); /* or else none had turns */
    for (int i = 0; i < JOBS; ++i) {
        assert_ok(brume_job_wait(jobs[i], -1, &status));
        assert_int_equal(status.state, BRUME_JOB_DONE);
        float *beside = all_passes(jobs[i], &bytes);
        assert_memory_equal(beside, alone[i], bytes);
        free(beside);
        free(alone[i]);
        brume_job_release(jobs[i]);
    }
    brume_scene_destroy(first);
    brume_scene_destroy(second);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_scene_same_pixels),
        cmocka_unit_test(history_leaves_no_trace),
        cmocka_unit_test(edits_do_not_reach_queued_jobs),
        cmocka_unit_test(jobs_beside_one_another),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
