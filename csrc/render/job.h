/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A render as a job: queued for the device, watched, waited for and cancelled from any thread. */
#ifndef BRUME_RENDER_JOB_H
#define BRUME_RENDER_JOB_H

#include "render/renderer.h"

struct brume_scene {
    brume_device *device;
    struct scene scene;
    struct renderer renderer; /* device thread only */
    int closing;              /* atomic access only: jobs end at their next check */
    int jobs;                 /* atomic access only: how many are posted */
};

struct brume_job {
    int references;      /* atomic access only: the caller's and the device's */
    struct task task;    /* a step renders a sample, or a part of one */
    brume_scene *scene;  /* there as long as the job has not ended */
    struct job_control control;
    struct snapshot snapshot; /* of the scene when brume_render was called */
    struct render_request request;

    pthread_cond_t ended; /* with control.mutex, as all below */
    uint32_t state;
    brume_result result;
    char error[1024];
    struct picture picture; /* the newest */
};

brume_result job_create(brume_scene *scene, const brume_settings *settings, const brume_view *view,
                        brume_job **out);
void job_poll(brume_job *job, brume_job_status *out);
void job_wait(brume_job *job, int32_t timeout_ms, brume_job_status *out);
/* Ends a job that has not begun; one that runs ends at its next check. */
void job_stop(brume_job *job);
brume_result job_read(brume_job *job, uint32_t pass, float *pixels, uint64_t float_count);
brume_result job_stats(brume_job *job, brume_stats *out);
void job_release(brume_job *job);

/* Ends a scene: its jobs stop at their next check, its GPU memory is freed on the device. */
brume_result scene_open(brume_device *device, brume_scene **out);
void scene_close(brume_scene *scene);

#endif
