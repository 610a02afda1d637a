/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Jobs that are under way together: which comes first, that none waits for all of another, that
 * cancelling and destroying need not wait for others, and that the pictures of several views are
 * made within one budget. Order is told by the samples that the others have done, not by the clock. */
#include "harness.h"
#include "render/view.h"

enum { ENDLESS = 60000, FEW = 4 };

static const float origin[3];
static const float down[3] = {0.2f, 0.1f, -1.0f};

static const brume_settings settings = {.medium_resolution = 8, .lattice_resolution = 4,
                                        .shadow_resolution = 16, .light_samples = 2,
                                        .world_samples = 4};

static brume_scene *fog_scene(void)
{
    static const struct coefficients fog = {.sigma_s = {1, 2, 3}};
    brume_scene *scene;
    assert_ok(brume_scene_create(device, &scene));
    add_fog_cube(scene, 1, origin, 0.5f, &fog);
    add_plate(scene, 1, (float[3]){0, 0, -1}, (float[3]){0, 0, -1}, 2.0f);
    add_sun(scene, 1, down);
    return scene;
}

static brume_job *start(brume_scene *scene, uint32_t samples, uint32_t urgent)
{
    brume_view view = orthographic_view(origin, down, 2.0f, 3.0f, 16);
    brume_job *job;
    view.samples = samples;
    view.urgent = urgent;
    assert_ok(brume_render(scene, &settings, &view, &job));
    return job;
}

static brume_job_status status_of(brume_job *job)
{
    brume_job_status status;
    assert_ok(brume_job_poll(job, &status));
    return status;
}

static uint32_t await_samples(brume_job *job, uint32_t samples)
{
    brume_job_status status = status_of(job);
    while (status.state <= BRUME_JOB_RUNNING && status.samples_done < samples) {
        assert_ok(brume_job_wait(job, 1, &status));
    }
    assert_int_equal(status.state, BRUME_JOB_RUNNING);
    return status.samples_done;
}

static void assert_ends(brume_job *job, uint32_t state)
{
    brume_job_status status;
    assert_ok(brume_job_wait(job, -1, &status));
    assert_int_equal(status.state, state);
}

static void urgent_jobs_come_first(void **state)
{
    (void)state;
    brume_scene *scene = fog_scene(), *other = fog_scene();
    brume_job *endless = start(scene, ENDLESS, 0);
    const uint32_t before = await_samples(endless, 1);
    brume_job *urgent = start(other, 100, 1);
    assert_ends(urgent, BRUME_JOB_DONE);
    const uint32_t after = await_samples(endless, 1);
    /* In turns it would have done a hundred of its own. */
    if (after - before > 50)
        fail_msg("%u samples were done before an urgent job", after - before);
    brume_job_release(urgent);
    brume_job_release(endless);
    brume_scene_destroy(scene);
    brume_scene_destroy(other);
}

static void patient_jobs_take_turns(void **state)
{
    (void)state;
    brume_scene *scene = fog_scene(), *other = fog_scene();
    brume_job *endless = start(scene, ENDLESS, 0);
    const uint32_t before = await_samples(endless, 1);
    brume_job *same_scene = start(scene, 50, 0), *other_scene = start(other, 50, 0);
    assert_ends(same_scene, BRUME_JOB_DONE);
    assert_ends(other_scene, BRUME_JOB_DONE);
    assert_true(await_samples(endless, 1) - before >= 48);
    brume_job_release(same_scene);
    brume_job_release(other_scene);
    brume_job_release(endless);
    brume_scene_destroy(scene);
    brume_scene_destroy(other);
}

/* An urgent job that never ends keeps a patient one in the queue. */
static void cancelled_in_the_queue(void **state)
{
    (void)state;
    brume_scene *scene = fog_scene(), *other = fog_scene();
    brume_job *endless = start(scene, ENDLESS, 1);
    await_samples(endless, 1);
    brume_job *queued = start(other, FEW, 0);
    await_samples(endless, status_of(endless).samples_done + 5);
    assert_int_equal(status_of(queued).state, BRUME_JOB_QUEUED);
    brume_job_cancel(queued);
    assert_int_equal(status_of(queued).state, BRUME_JOB_CANCELLED);
    assert_int_equal(status_of(queued).result, BRUME_E_CANCELLED);
    brume_stats stats;
    assert_ok(brume_job_stats(queued, &stats));
    for (int stage = 0; stage < BRUME_STAGE_COUNT; ++stage)
        assert_int_equal(stats.stages[stage].runs, 0);
    brume_job_cancel(queued); /* once more does nothing */
    brume_job_release(queued);
    assert_int_equal(status_of(endless).state, BRUME_JOB_RUNNING);
    brume_job_release(endless);
    brume_scene_destroy(scene);
    brume_scene_destroy(other);
}

/* Ending comes before what is urgent, be it a job or a scene with all of its jobs. */
static void ending_waits_for_nobody(void **state)
{
    (void)state;
    brume_scene *scene = fog_scene(), *other = fog_scene(), *third = fog_scene();
    brume_job *patient = start(other, ENDLESS, 0), *doomed = start(third, ENDLESS, 0);
    await_samples(patient, 1);
    await_samples(doomed, 1);
    brume_job *endless = start(scene, ENDLESS, 1);
    await_samples(endless, 1);
    brume_job *queued = start(third, FEW, 0);
    brume_job_cancel(patient);
    assert_ends(patient, BRUME_JOB_CANCELLED);
    brume_scene_destroy(third);
    assert_int_equal(status_of(doomed).state, BRUME_JOB_CANCELLED);
    assert_int_equal(status_of(queued).state, BRUME_JOB_CANCELLED);
    await_samples(endless, 1);
    brume_job_release(patient);
    brume_job_release(doomed);
    brume_job_release(queued);
    brume_job_release(endless);
    brume_scene_destroy(scene);
    brume_scene_destroy(other);
}

/* Pictures come one after the other, each of more samples; a cancelled job keeps its last. */
static void pictures_get_better(void **state)
{
    (void)state;
    enum { PIXELS = 16 };
    static float pixels[PIXELS * PIXELS * 4];
    brume_scene *scene = fog_scene();
    brume_view view = orthographic_view(origin, down, 2.0f, 3.0f, PIXELS);
    brume_job *job;
    view.samples = ENDLESS;
    view.progressive = 1;
    assert_ok(brume_render(scene, &settings, &view, &job));
    uint32_t last = 0;
    for (int pictures = 0; pictures < 3;) {
        const brume_job_status status = status_of(job);
        assert_true(status.state <= BRUME_JOB_RUNNING);
        assert_true(status.picture_samples >= last);
        if (status.picture_samples > last) {
            assert_true(pictures > 0 || status.picture_samples == 1);
            last = status.picture_samples;
            ++pictures;
            assert_ok(brume_job_read(job, BRUME_PASS_COMBINED, pixels, PIXELS * PIXELS * 4));
            assert_true(middle(pixels, &view, 4, 0) > 0.0);
        }
        assert_ok(brume_job_wait(job, 1, NULL));
    }
    brume_job_cancel(job);
    assert_ends(job, BRUME_JOB_CANCELLED);
    assert_true(status_of(job).picture_samples >= last);
    assert_ok(brume_job_read(job, BRUME_PASS_COMBINED, pixels, PIXELS * PIXELS * 4));
    brume_job_release(job);
    brume_scene_destroy(scene);
}

/* On a CPU a picture of this size is rendered some rows at a time: what others do to the scene's
 * products between two parts of a sample leaves no trace. */
static void parts_of_samples(void **state)
{
    (void)state;
    brume_scene *scene = fog_scene();
    brume_view view = orthographic_view(origin, down, 2.0f, 3.0f, 288);
    brume_job_status status;
    view.samples = 2;
    brume_job *job = render(scene, &settings, &view);
    float *alone = read_pass(job, &view, BRUME_PASS_COMBINED);
    brume_job_release(job);

    brume_settings finer = settings;
    finer.medium_resolution = 12;
    finer.shadow_resolution = 24;
    brume_view small = orthographic_view(origin, down, 2.0f, 3.0f, 16);
    small.samples = 16;
    brume_job *other;
    assert_ok(brume_render(scene, &finer, &small, &other));
    assert_ok(brume_render(scene, &settings, &view, &job));
    assert_ok(brume_job_wait(job, -1, &status));
    assert_int_equal(status.state, BRUME_JOB_DONE);
    brume_stats stats;
    assert_ok(brume_job_stats(job, &stats));
    /* The fog's extinction was made again for at least one later part. */
    assert_true(stats.lights_propagated > 1);
    float *beside = read_pass(job, &view, BRUME_PASS_COMBINED);
    assert_memory_equal(beside, alone, 288 * 288 * 4 * sizeof *alone);
    free(beside);
    free(alone);
    brume_job_release(job);
    brume_job_release(other);
    brume_scene_destroy(scene);
}

/* Four views of one scene at once: all their targets count, and the rest shrinks to what they
 * leave; afterwards no more of them stay than a few. */
static void views_share_one_budget(void **state)
{
    (void)state;
    enum { VIEWS = 4, ROUNDS = 2, BUDGET = 24 << 20 };
    brume_settings greedy = settings;
    greedy.medium_resolution = 160;
    greedy.lattice_resolution = 24;
    greedy.shadow_resolution = 512;
    greedy.memory_budget = BUDGET;
    greedy.step = 8;
    brume_scene *scene = fog_scene();
    for (int round = 0; round < ROUNDS; ++round) {
        brume_job *jobs[VIEWS];
        brume_view views[VIEWS];
        brume_stats stats;
        uint64_t together = 0, most = 0;
        for (int i = 0; i < VIEWS; ++i) {
            views[i] = orthographic_view(origin, down, 2.0f, 3.0f, 200 + (round == 1 ? 0 : 20 * i));
            views[i].samples = 2;
            together += view_bytes(&views[i]);
            assert_ok(brume_render(scene, &greedy, &views[i], &jobs[i]));
        }
        for (int i = 0; i < VIEWS; ++i) {
            assert_ends(jobs[i], BRUME_JOB_DONE);
            assert_ok(brume_job_stats(jobs[i], &stats));
            if (stats.peak_bytes > BUDGET)
                fail_msg("the peak is %llu of %d bytes", (unsigned long long)stats.peak_bytes,
                         BUDGET);
            most = stats.target_bytes > most ? stats.target_bytes : most;
            float *pixels = read_pass(jobs[i], &views[i], BRUME_PASS_COMBINED);
            assert_true(middle(pixels, &views[i], 4, 0) > 0.0);
            free(pixels);
            brume_job_release(jobs[i]);
        }
        assert_true(most >= together); /* they were under way together */
    }
    /* Another size alone, and nothing but its targets is left. */
    brume_view small = orthographic_view(origin, down, 2.0f, 3.0f, 8);
    brume_stats stats;
    small.samples = 1;
    brume_job *job = render(scene, &greedy, &small);
    assert_ok(brume_job_stats(job, &stats));
    assert_true(stats.target_bytes < 64 << 10);
    brume_job_release(job);
    brume_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(urgent_jobs_come_first),  cmocka_unit_test(patient_jobs_take_turns),
        cmocka_unit_test(cancelled_in_the_queue),  cmocka_unit_test(ending_waits_for_nobody),
        cmocka_unit_test(pictures_get_better),     cmocka_unit_test(parts_of_samples),
        cmocka_unit_test(views_share_one_budget),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
