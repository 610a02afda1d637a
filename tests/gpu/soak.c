/* SPDX-License-Identifier: GPL-3.0-or-later */
/* 200 renders in a row through the public interface, and 500 jobs of two scenes, some cancelled: no
 * GL error, and memory stays where it was once drivers and allocators have warmed up. */
#include "brume.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { RENDERS = 200, WARM_UP = 40, WIDTH = 64, HEIGHT = 36 };

/* One leaked picture of all passes is 180 KiB, one leaked lattice of 24^3 cells 432 KiB; over the
 * renders after the warm-up either grows beyond 25 MiB. AddressSanitizer keeps freed memory in
 * quarantine, which counts as resident: there LeakSanitizer does the counting. */
#ifdef __SANITIZE_ADDRESS__
enum { GROWTH_KIB_MAX = 512 * 1024 };
#else
enum { GROWTH_KIB_MAX = 8 * 1024 };
#endif

static const float identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

static atomic_int complaints;

/* Everything that the library or, in debug contexts, the driver finds wrong. */
static void count_complaints(void *user, int32_t level, const char *sentence)
{
    (void)user;
    if (level <= BRUME_LOG_WARNING) {
        print_error("%s\n", sentence);
        atomic_fetch_add(&complaints, 1);
    }
}

static long resident_kib(void)
{
    long pages = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    assert_non_null(file);
    assert_int_equal(fscanf(file, "%*d %ld", &pages), 1);
    fclose(file);
    return pages * (sysconf(_SC_PAGESIZE) / 1024);
}

/* A metre of fog in the origin. It changes a little from render to render, so that every stage
 * runs each time. */
static void set_fog(brume_scene *scene, int number)
{
    static const float positions[] = {-.5f, -.5f, -.5f, .5f, -.5f, -.5f, .5f, .5f, -.5f,
                                      -.5f, .5f, -.5f, -.5f, -.5f, .5f, .5f, -.5f, .5f,
                                      .5f, .5f, .5f, -.5f, .5f, .5f};
    static const uint32_t triangles[] = {0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                                         1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7};
    const float sigma_s = 2.0f + 0.01f * (float)number;
    const brume_instruction instructions[] = {
        {.op = BRUME_OP_CONSTANT, .dst = 0, .value = {sigma_s, sigma_s, sigma_s}},
        {.op = BRUME_OP_CONSTANT, .dst = 1, .value = {0.1f, 0.1f, 0.1f}},
        {.op = BRUME_OP_CONSTANT, .dst = 2, .value = {0.3f, 0.3f, 0.3f}},
        {.op = BRUME_OP_CONSTANT, .dst = 3},
    };
    brume_volume volume = {
        .name = "fog",
        .positions = positions,
        .triangles = triangles,
        .vertex_count = 8,
        .triangle_count = 12,
        .program = {.instructions = instructions,
                    .instruction_count = 4,
                    .sigma_s = 0,
                    .sigma_a = 1,
                    .g = 2,
                    .emission = 3},
    };
    memcpy(volume.world_from_object, identity, sizeof identity);
    assert_int_equal(brume_scene_set_volume(scene, 1, &volume), BRUME_OK);
}

static void set_sun(brume_scene *scene)
{
    brume_light sun = {
        .name = "sun",
        .type = BRUME_LIGHT_SUN,
        .power = {3.0f, 3.0f, 3.0f},
        .angle = 0.01f,
        .diffuse_factor = 1.0f,
        .specular_factor = 1.0f,
        .volume_factor = 1.0f,
        .cast_shadow = 1,
    };
    memcpy(sun.world_from_light, identity, sizeof identity);
    assert_int_equal(brume_scene_set_light(scene, 1, &sun), BRUME_OK);
}

/* Sees the cube from 3 m along Y, 2 m high and as wide as the picture's shape asks. */
static brume_view fog_view(void)
{
    return (brume_view){
        .width = WIDTH,
        .height = HEIGHT,
        .samples = 2,
        .clip_near = 0.1f,
        .clip_far = 10.0f,
        .view_from_world = {1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, -3, 1},
        .clip_from_view = {(float)HEIGHT / WIDTH, 0, 0, 0, 0, 1, 0, 0, 0, 0, -2.0f / 9.9f, 0, 0, 0,
                           -10.1f / 9.9f, 1},
        .passes = (1u << BRUME_PASS_COUNT) - 1,
    };
}

/* Mean of the picture's red, which the fog keeps above zero. */
static double render_once(brume_scene *scene)
{
    static float pixels[WIDTH * HEIGHT * 4];
    const brume_settings settings = {.medium_resolution = 24,
                                     .lattice_resolution = 12,
                                     .shadow_resolution = 64,
                                     .light_samples = 2,
                                     .world_samples = 4};
    const brume_view view = fog_view();
    brume_job_status status;
    brume_job *job = NULL;
    double sum = 0.0;

    assert_int_equal(brume_render(scene, &settings, &view, &job), BRUME_OK);
    assert_int_equal(brume_job_wait(job, -1, &status), BRUME_OK);
    if (status.state != BRUME_JOB_DONE)
        fail_msg("%s", brume_job_error(job));
    for (uint32_t pass = 0; pass < BRUME_PASS_COUNT; pass++)
        assert_int_equal(brume_job_read(job, pass, pixels,
                                        WIDTH * HEIGHT * brume_pass_channels(pass)),
                         BRUME_OK);
    assert_int_equal(brume_job_read(job, BRUME_PASS_COMBINED, pixels, WIDTH * HEIGHT * 4),
                     BRUME_OK);
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        sum += (double)pixels[4 * i];
    brume_job_release(job);
    return sum / (WIDTH * HEIGHT);
}

static void memory_stays_flat_and_no_gl_error(void **state)
{
    const brume_device_params params = {
        .shader_dir = TEST_SHADERS, .log = count_complaints, .debug = 1};
    brume_device *device = NULL;
    brume_scene *scene = NULL;
    long warm = 0;

    (void)state;
    assert_int_equal(brume_device_create(&params, &device), BRUME_OK);
    assert_int_equal(brume_scene_create(device, &scene), BRUME_OK);
    set_sun(scene);
    for (int i = 0; i < RENDERS; i++) {
        set_fog(scene, i % 7);
        assert_true(render_once(scene) > 0.0);
        if (i + 1 == WARM_UP)
            warm = resident_kib();
    }
    const long grown = resident_kib() - warm;
    print_message("resident memory: %ld KiB warm, %+ld KiB after %d more renders\n", warm, grown,
                  RENDERS - WARM_UP);
    assert_true(grown < GROWTH_KIB_MAX);
    assert_int_equal(atomic_load(&complaints), 0);
    brume_scene_destroy(scene);
    brume_device_destroy(device);
}

/* A few of both scenes' jobs are under way at any time; some are cancelled or dropped at once, some
 * after a while, some never. Sizes, urgency and the scenes change from job to job. */
static void crowds_and_cancels(void **state)
{
    enum { JOBS = 500, TOGETHER = 6, WARM_JOBS = 150 };
    const brume_settings settings = {.medium_resolution = 12, .lattice_resolution = 6,
                                     .shadow_resolution = 32, .light_samples = 2,
                                     .world_samples = 4};
    const brume_device_params params = {
        .shader_dir = TEST_SHADERS, .log = count_complaints, .debug = 1};
    brume_device *device = NULL;
    brume_scene *scenes[2];
    brume_job *jobs[TOGETHER] = {NULL};
    int cancelled[TOGETHER] = {0}, done = 0;
    uint32_t lot = 1;
    long warm = 0;

    (void)state;
    assert_int_equal(brume_device_create(&params, &device), BRUME_OK);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(brume_scene_create(device, &scenes[i]), BRUME_OK);
        set_sun(scenes[i]);
        set_fog(scenes[i], 0);
    }
    for (int i = 0; i < JOBS + TOGETHER; i++) {
        const int place = i % TOGETHER;
        lot = lot * 1664525u + 1013904223u;
        const uint32_t chance = lot >> 24;
        if (jobs[place]) {
            brume_job_status status;
            assert_int_equal(brume_job_wait(jobs[place], -1, &status), BRUME_OK);
            if (status.state != BRUME_JOB_DONE && !cancelled[place])
                fail_msg("state %u: %s", status.state, brume_job_error(jobs[place]));
            done += status.state == BRUME_JOB_DONE;
            brume_job_release(jobs[place]);
            jobs[place] = NULL;
        }
        if (i + 1 == WARM_JOBS)
            warm = resident_kib();
        if (i >= JOBS)
            continue;
        brume_view view = fog_view();
        view.width >>= 1 + chance % 3;
        view.height >>= 1 + chance % 3;
        view.urgent = chance % 5 == 0;
        view.progressive = chance % 2;
        if (chance % 8 == 0)
            set_fog(scenes[i % 2], i % 7);
        assert_int_equal(brume_render(scenes[i % 2], &settings, &view, &jobs[place]), BRUME_OK);
        cancelled[place] = chance < 40;
        if (chance < 40)
            brume_job_cancel(jobs[place]);
        if (chance >= 40 && chance < 80) { /* one that may have begun */
            const int next = (place + 1) % TOGETHER;
            cancelled[next] = 1;
            brume_job_cancel(jobs[next]);
        }
        if (chance > 245) {
            brume_job_release(jobs[place]);
            jobs[place] = NULL;
        }
    }
    const long grown = resident_kib() - warm;
    print_message("%d of %d jobs done; resident memory: %ld KiB warm, %+ld KiB after\n", done, JOBS,
                  warm, grown);
    assert_true(done > JOBS / 4 && done < JOBS);
    assert_true(grown < GROWTH_KIB_MAX);
    assert_int_equal(atomic_load(&complaints), 0);
    brume_scene_destroy(scenes[0]);
    brume_scene_destroy(scenes[1]);
    brume_device_destroy(device);
    assert_int_equal(atomic_load(&complaints), 0); /* bytes not freed, say */
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(memory_stays_flat_and_no_gl_error),
                                       cmocka_unit_test(crowds_and_cancels)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
