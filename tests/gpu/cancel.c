/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Cancelling in every stage: the job ends within 0.5 s plus one stage, leaves nothing behind, and
 * the next picture is what it would have been. The stage's time is measured in this process, on
 * the same scene. Of the wait both clocks are read, the wall's and the process's own, and the
 * lesser counts: on a busy machine the first holds other programs' work, on a GPU the second is
 * short of the device's, and a cancel that does not come through is long by both. */
#include "harness.h"

#include <sched.h>
#include <time.h>

enum { PIXELS = 32, SAMPLES = 16, TRIES = 50, MANY = 100000 };

static const float origin[3];

static const brume_settings settings = {.medium_resolution = 64, .lattice_resolution = 32,
                                        .shadow_resolution = 128, .light_samples = 4,
                                        .world_samples = 8};

static double seconds(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* A mesh that nothing shows: long to upload, so that a cancel can meet it. */
static void add_hidden_mesh(brume_scene *scene)
{
    static const float positions[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    static uint32_t triangles[3 * MANY];
    for (int i = 0; i < 3 * MANY; ++i)
        triangles[i] = (uint32_t)i % 3;
    const brume_mesh mesh = {.name = "hidden", .positions = positions, .triangles = triangles,
                             .vertex_count = 3, .triangle_count = MANY};
    assert_ok(brume_scene_set_mesh(scene, 2, &mesh));
}

/* Every datablock anew, so that every stage runs again; the other scene differs in each. */
static void fill(brume_scene *scene, int other)
{
    static const struct coefficients fogs[] = {
        {.sigma_s = {1, 1.5f, 2}, .sigma_a = {0.2f, 0.1f, 0}}, {.sigma_s = {3, 3, 3}}};
    static float matrices[500][16];
    brume_light lamp = point_lamp((float[3]){0.4f, other ? -0.6f : 0.6f, 1.5f}, 30.0f);
    lamp.radius = 0.2f;
    const brume_world world = {.color = {other ? 0.9f : 0.2f, 0.3f, 0.4f}};
    add_fog_cube(scene, 1, origin, 0.5f, &fogs[other]);
    add_hidden_mesh(scene);
    add_plate(scene, 1, (float[3]){0, 0, -1}, (float[3]){0, 0, -1}, 0.1f);
    for (int i = 0; i < 500; ++i) {
        memcpy(matrices[i], identity, sizeof identity);
        matrices[i][12] = 0.1f * (float)(i % 25) - 1.2f;
        matrices[i][13] = 0.1f * (float)(i / 25) - 1.0f;
        matrices[i][14] = other ? -0.8f : -1.0f;
    }
    const brume_instances instances = {.world_from_object = matrices[0], .mesh = 1, .count = 500,
                                       .visibility = BRUME_VISIBLE_CAMERA | BRUME_VISIBLE_SHADOW};
    assert_ok(brume_scene_set_instances(scene, 1, &instances));
    assert_ok(brume_scene_set_light(scene, 1, &lamp));
    assert_ok(brume_scene_set_world(scene, &world));
}

static brume_view the_view(void)
{
    brume_view view = orthographic_view(origin, (float[3]){0.3f, 0.5f, -1}, 3.0f, 4.0f, PIXELS);
    view.samples = SAMPLES;
    return view;
}

/* The undisturbed picture, and its longest single run of a stage in seconds. */
static float *undisturbed(brume_scene *scene, double *longest)
{
    const brume_view view = the_view();
    brume_stats stats;
    fill(scene, 0);
    brume_job *job = render(scene, &settings, &view);
    assert_ok(brume_job_stats(job, &stats));
    for (int stage = 0; stage < BRUME_STAGE_COUNT; ++stage) {
        const int per_sample = stage >= BRUME_STAGE_GBUFFER && stage <= BRUME_STAGE_MARCH;
        const double run = 1e-3 * stats.stages[stage].wall_ms / (per_sample ? SAMPLES : 1);
        *longest = fmax(*longest, run);
    }
    float *pixels = read_pass(job, &view, BRUME_PASS_COMBINED);
    brume_job_release(job);
    return pixels;
}

/* A job that was seen in the stage. */
static brume_job *start_and_reach(brume_scene *scene, uint32_t stage)
{
    const brume_view view = the_view();
    for (int attempt = 0; attempt < TRIES; ++attempt) {
        brume_job *job;
        brume_job_status status;
        fill(scene, 0);
        assert_ok(brume_render(scene, &settings, &view, &job));
        do {
            sched_yield();
            assert_ok(brume_job_poll(job, &status));
            if (status.state == BRUME_JOB_RUNNING && status.stage == stage)
                return job;
        } while (status.state < BRUME_JOB_DONE);
        brume_job_release(job); /* it was through before we looked */
    }
    fail_msg("%d jobs were never seen in the stage %s", TRIES, brume_stage_name(stage));
    return NULL;
}

static void cancel_in_every_stage(void **state)
{
    (void)state;
    brume_scene *scene;
    assert_ok(brume_scene_create(device, &scene));
    double longest = 0.0, waits[BRUME_STAGE_COUNT] = {0};
    float *reference = undisturbed(scene, &longest);
    for (uint32_t stage = 0; stage < BRUME_STAGE_PASSES; ++stage) {
        /* What a cancelled stage leaves undone must not look done: the GPU holds another scene. */
        const brume_view view = the_view();
        fill(scene, 1);
        brume_job_release(render(scene, &settings, &view));
        brume_job *job = start_and_reach(scene, stage);
        brume_job_status status;
        const double wall = seconds(CLOCK_MONOTONIC), own = seconds(CLOCK_PROCESS_CPUTIME_ID);
        brume_job_cancel(job);
        assert_ok(brume_job_wait(job, -1, &status));
        waits[stage] = fmin(seconds(CLOCK_MONOTONIC) - wall,
                            seconds(CLOCK_PROCESS_CPUTIME_ID) - own);
        assert_int_equal(status.state, BRUME_JOB_CANCELLED);
        assert_int_equal(status.result, BRUME_E_CANCELLED);
        assert_string_equal(brume_job_error(job), "");
        static float none[PIXELS * PIXELS * 4];
        assert_int_equal(brume_job_read(job, BRUME_PASS_COMBINED, none, PIXELS * PIXELS * 4),
                         BRUME_E_NOT_READY);
        brume_job_release(job);

        job = render(scene, &settings, &view);
        float *pixels = read_pass(job, &view, BRUME_PASS_COMBINED);
        assert_memory_equal(pixels, reference, PIXELS * PIXELS * 4 * sizeof *pixels);
        free(pixels);
        brume_job_release(job);
    }
    float *again = undisturbed(scene, &longest); /* the machine may have become slower */
    for (uint32_t stage = 0; stage < BRUME_STAGE_PASSES; ++stage) {
        print_message("%-10s cancelled after %6.1f ms\n", brume_stage_name(stage),
                      1e3 * waits[stage]);
        if (waits[stage] > 0.5 + longest)
            fail_msg("cancelled in %s, the job ended after %.3f s; the longest stage takes %.3f s",
                     brume_stage_name(stage), waits[stage], longest);
    }
    free(again);
    free(reference);
    brume_scene_destroy(scene);
}

static void release_while_running(void **state)
{
    (void)state;
    brume_scene *scene;
    double longest = 0.0;
    assert_ok(brume_scene_create(device, &scene));
    float *reference = undisturbed(scene, &longest);
    brume_job_release(start_and_reach(scene, BRUME_STAGE_MARCH));
    brume_job_release(start_and_reach(scene, BRUME_STAGE_SHADOW));
    float *pixels = undisturbed(scene, &longest);
    assert_memory_equal(pixels, reference, PIXELS * PIXELS * 4 * sizeof *pixels);
    free(pixels);
    free(reference);
    brume_scene_destroy(scene);
}

static void destroy_scene_while_running(void **state)
{
    (void)state;
    brume_scene *scene, *other;
    const brume_view view = the_view();
    brume_job_status status;
    assert_ok(brume_scene_create(device, &scene));
    assert_ok(brume_scene_create(device, &other));
    fill(scene, 0);
    fill(other, 1);
    brume_job *queued, *elsewhere, *running = start_and_reach(scene, BRUME_STAGE_MARCH);
    assert_ok(brume_render(scene, &settings, &view, &queued));
    assert_ok(brume_render(other, &settings, &view, &elsewhere));
    brume_scene_destroy(scene);
    assert_ok(brume_job_poll(running, &status));
    assert_int_equal(status.state, BRUME_JOB_CANCELLED);
    assert_ok(brume_job_poll(queued, &status));
    assert_int_equal(status.state, BRUME_JOB_CANCELLED);
    /* The other scene's job does not notice. */
    assert_ok(brume_job_wait(elsewhere, -1, &status));
    assert_int_equal(status.state, BRUME_JOB_DONE);
    brume_job_release(running);
    brume_job_release(queued);
    brume_job_release(elsewhere);
    brume_scene_destroy(other);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cancel_in_every_stage),
        cmocka_unit_test(release_while_running),
        cmocka_unit_test(destroy_scene_while_running),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
