/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Jobs. */
#include "render/job.h"
#include "base/result.h"
#include "gl/timer.h"
#include "math/frame.h"

#include <errno.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static void set_default(int32_t *value, int32_t fallback)
{
    if (*value == 0)
        *value = fallback;
}

static brume_result check_settings(brume_settings *settings)
{
    set_default(&settings->medium_resolution, 128);
    set_default(&settings->lattice_resolution, 64);
    set_default(&settings->field_resolution, (settings->lattice_resolution + 1) / 2);
    set_default(&settings->ordinates, 48);
    set_default(&settings->shadow_resolution, 512);
    set_default(&settings->light_samples, 8);
    set_default(&settings->world_samples, 128);
    if (settings->step == 0.0f)
        settings->step = 1.0f;
    if (settings->converged == 0.0f)
        settings->converged = 1e-3f;
    if (settings->memory_budget == 0)
        settings->memory_budget = 2ull << 30;
    REQUIRE(method_find(settings->method));
    REQUIRE(settings->medium_resolution >= 1 && settings->medium_resolution <= 1024);
    REQUIRE(settings->lattice_resolution >= 1 && settings->lattice_resolution <= 512);
    REQUIRE(settings->field_resolution >= 1 && settings->field_resolution <= 256);
    REQUIRE(settings->cascades >= 0 && settings->cascades <= FIELD_LEVELS);
    REQUIRE(settings->ordinates == 26 || settings->ordinates == 48 || settings->ordinates == 96);
    REQUIRE(settings->warm <= 1);
    REQUIRE(settings->converged >= 1e-5f && settings->converged <= 1.0f);
    REQUIRE(settings->cascade_focus < BRUME_FOCUS_COUNT);
    REQUIRE(settings->shadow_resolution >= 16 && settings->shadow_resolution <= 8192);
    REQUIRE(settings->light_samples >= 1 && settings->light_samples <= 1024);
    REQUIRE(settings->world_samples >= 1 && settings->world_samples <= 1024);
    REQUIRE(settings->depths < BRUME_DEPTHS_COUNT);
    REQUIRE(settings->light_paths < BRUME_PATHS_COUNT);
    REQUIRE(settings->blockers < BRUME_BLOCKERS_COUNT);
    REQUIRE(settings->iterations >= 0);
    REQUIRE(settings->step >= 0.05f && settings->step <= 100.0f);
    REQUIRE(settings->memory_budget >= 1 << 20);
    return BRUME_OK;
}

#define LENS_MOST 1e6f /* m: what is far smaller than that has a matrix that can be inverted */

static brume_result check_view(brume_view *view)
{
    float inverse[16];
    if (view->samples == 0)
        view->samples = 16;
    if (view->filter_width == 0.0f)
        view->filter_width = 1.5f;
    if (view->world_draws == 0)
        view->world_draws = 32;
    view->passes |= 1u << BRUME_PASS_COMBINED;
    view->passes &= (1u << BRUME_PASS_COUNT) - 1u;
    REQUIRE(view->width >= 1 && view->width <= 16384);
    REQUIRE(view->height >= 1 && view->height <= 16384);
    REQUIRE(view->samples <= 1u << 16);
    REQUIRE(view->filter_width > 0.0f && view->filter_width <= 100.0f);
    REQUIRE(isfinite(view->clip_near) && isfinite(view->clip_far));
    REQUIRE(view->clip_near < view->clip_far);
    if (!mat4_invert(view->view_from_world, inverse))
        return fail(BRUME_E_TRANSFORM, "the camera's transform is singular or not finite");
    if (!mat4_is_finite(view->clip_from_view) || view->clip_from_view[0] == 0.0f ||
        view->clip_from_view[5] == 0.0f)
        return fail(BRUME_E_TRANSFORM, "the camera's projection is singular or not finite");
    if (view->clip_from_view[15] == 0.0f)
        REQUIRE(view->clip_near > 0.0f);
    const brume_lens *lens = &view->lens;
    REQUIRE(lens->radius >= 0.0f && lens->radius <= LENS_MOST);
    if (lens->radius > 0.0f) {
        REQUIRE(lens->focus >= 1.0f / LENS_MOST && isfinite(lens->focus));
        REQUIRE(lens->blades <= 1024 && isfinite(lens->rotation));
        REQUIRE(lens->ratio == 0.0f || (lens->ratio >= 0.01f && lens->ratio <= 100.0f));
    }
    return BRUME_OK;
}

static void unreference(brume_job *job)
{
    if (__atomic_sub_fetch(&job->references, 1, __ATOMIC_ACQ_REL) != 0)
        return;
    picture_finish(&job->picture);
    snapshot_finish(&job->snapshot);
    pthread_cond_destroy(&job->ended);
    job_control_finish(&job->control);
    free(job);
}

/* With the control's mutex. */
static void set_ended(brume_job *job, brume_result result)
{
    job->result = result;
    job->state = result == BRUME_OK          ? BRUME_JOB_DONE
                 : result == BRUME_E_CANCELLED ? BRUME_JOB_CANCELLED
                                               : BRUME_JOB_FAILED;
    if (job->state == BRUME_JOB_FAILED)
        snprintf(job->error, sizeof job->error, "%s", last_error());
    if (result == BRUME_OK)
        job->control.progress = 1.0f;
    pthread_cond_broadcast(&job->ended);
}

/* False if the job was cancelled before it began. */
static bool begin(brume_job *job)
{
    pthread_mutex_lock(&job->control.mutex);
    if (job->state == BRUME_JOB_QUEUED)
        job->state = BRUME_JOB_RUNNING;
    const bool running = job->state == BRUME_JOB_RUNNING;
    pthread_mutex_unlock(&job->control.mutex);
    return running;
}

/* On the device's thread. */
static bool step_job(struct gpu *gpu, void *user)
{
    brume_job *job = user;
    brume_scene *scene = job->scene;
    if (begin(job)) {
        bool more = false;
        const brume_result result =
            renderer_step(gpu, &scene->renderer, &job->request, &more);
        if (more)
            return true;
        pthread_mutex_lock(&job->control.mutex);
        set_ended(job, result);
        pthread_mutex_unlock(&job->control.mutex);
    }
    __atomic_sub_fetch(&scene->jobs, 1, __ATOMIC_RELEASE);
    picture_finish(&job->request.back);
    snapshot_finish(&job->snapshot); /* a picture that is kept keeps no scene alive */
    unreference(job);
    return false;
}

brume_result job_create(brume_scene *scene, const brume_settings *settings, const brume_view *view,
                        brume_job **out)
{
    static const brume_settings default_settings;
    brume_job *job = calloc(1, sizeof *job);
    if (!job)
        return fail(BRUME_E_MEMORY, "no memory for a job");
    job->request = (struct render_request){.snapshot = &job->snapshot,
                                           .settings = settings ? *settings : default_settings,
                                           .view = *view,
                                           .control = &job->control,
                                           .front = &job->picture};
    brume_result result = check_settings(&job->request.settings);
    if (result == BRUME_OK)
        result = check_view(&job->request.view);
    if (result == BRUME_OK)
        result = scene_snapshot(&scene->scene, &job->snapshot);
    if (result != BRUME_OK) {
        free(job);
        return result;
    }
    job->references = 2;
    job->scene = scene;
    job->task = (struct task){.step = step_job, .user = job, .owner = scene,
                              .rank = view->urgent ? TASK_URGENT : TASK_PATIENT};
    job_control_init(&job->control);
    job->control.scene_closing = &scene->closing;
    pthread_condattr_t attributes;
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_cond_init(&job->ended, &attributes);
    pthread_condattr_destroy(&attributes);
    __atomic_add_fetch(&scene->jobs, 1, __ATOMIC_RELAXED);
    device_post(scene->device, &job->task);
    *out = job;
    return BRUME_OK;
}

void job_stop(brume_job *job)
{
    job_cancel(&job->control);
    pthread_mutex_lock(&job->control.mutex);
    if (job->state < BRUME_JOB_DONE)
        device_hurry(job->scene->device, &job->task);
    if (job->state == BRUME_JOB_QUEUED)
        set_ended(job, BRUME_E_CANCELLED);
    pthread_mutex_unlock(&job->control.mutex);
}

static void copy_status(const brume_job *job, brume_job_status *out)
{
    *out = (brume_job_status){.state = job->state,
                              .stage = job->control.stage,
                              .progress = job->control.progress,
                              .samples_done = job->control.samples_done,
                              .result = (int32_t)job->result,
                              .warnings = job->control.warning_count,
                              .picture_samples = job->picture.samples};
}

void job_poll(brume_job *job, brume_job_status *out)
{
    pthread_mutex_lock(&job->control.mutex);
    copy_status(job, out);
    pthread_mutex_unlock(&job->control.mutex);
}

void job_wait(brume_job *job, int32_t timeout_ms, brume_job_status *out)
{
    struct timespec until;
    clock_gettime(CLOCK_MONOTONIC, &until);
    if (timeout_ms > 0) {
        until.tv_sec += timeout_ms / 1000;
        until.tv_nsec += (long)(timeout_ms % 1000) * 1000000L;
        if (until.tv_nsec >= 1000000000L) {
            until.tv_nsec -= 1000000000L;
            ++until.tv_sec;
        }
    }
    pthread_mutex_lock(&job->control.mutex);
    while (job->state < BRUME_JOB_DONE) {
        if (timeout_ms < 0)
            pthread_cond_wait(&job->ended, &job->control.mutex);
        else if (pthread_cond_timedwait(&job->ended, &job->control.mutex, &until) == ETIMEDOUT)
            break;
    }
    if (out)
        copy_status(job, out);
    pthread_mutex_unlock(&job->control.mutex);
}

static uint32_t state_of(brume_job *job)
{
    brume_job_status status;
    job_poll(job, &status);
    return status.state;
}

brume_result job_read(brume_job *job, uint32_t pass, float *pixels, uint64_t float_count)
{
    const brume_view *view = &job->request.view;
    const uint64_t expected =
        (uint64_t)view->width * (uint64_t)view->height * brume_pass_channels(pass);
    REQUIRE(float_count == expected);
    if (!(view->passes & (1u << pass)))
        return fail(BRUME_E_NOT_READY, "the job was not asked for the pass %s",
                    brume_pass_name(pass));
    pthread_mutex_lock(&job->control.mutex);
    const uint32_t samples = job->picture.samples;
    if (samples)
        memcpy(pixels, job->picture.pixels[pass], expected * sizeof *pixels);
    pthread_mutex_unlock(&job->control.mutex);
    return samples ? BRUME_OK : fail(BRUME_E_NOT_READY, "the job has no picture");
}

brume_result job_stats(brume_job *job, brume_stats *out)
{
    if (state_of(job) < BRUME_JOB_DONE)
        return fail(BRUME_E_NOT_READY, "the job has not ended");
    *out = job->request.stats;
    return BRUME_OK;
}

void job_release(brume_job *job)
{
    job_stop(job);
    unreference(job);
}

/* --- Scenes ------------------------------------------------------------------------------- */

brume_result scene_open(brume_device *device, brume_scene **out)
{
    brume_scene *scene = calloc(1, sizeof *scene);
    if (!scene)
        return fail(BRUME_E_MEMORY, "no memory for a scene");
    scene->device = device_retain(device);
    scene_init(&scene->scene);
    *out = scene;
    return BRUME_OK;
}

/* Its jobs end first: each sees that the scene closes in its next step, which comes now. */
static bool step_close(struct gpu *gpu, void *user)
{
    brume_scene *scene = user;
    if (__atomic_load_n(&scene->jobs, __ATOMIC_ACQUIRE)) {
        device_hurry_all(scene->device, scene);
        return true;
    }
    renderer_finish(gpu, &scene->renderer);
    return false;
}

void scene_close(brume_scene *scene)
{
    __atomic_store_n(&scene->closing, 1, __ATOMIC_RELEASE);
    device_call(scene->device, step_close, scene);
    device_release(scene->device);
    scene_finish(&scene->scene);
    free(scene);
}
