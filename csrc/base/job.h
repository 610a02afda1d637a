/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What long work reports and obeys: progress, cancel, warnings. The worker writes, any thread
 * reads. */
#ifndef BRUME_BASE_JOB_H
#define BRUME_BASE_JOB_H

#include "brume.h"

#include <pthread.h>
#include <stdbool.h>

struct job_warning {
    char id[32];
    char sentence[512];
};

struct job_control {
    pthread_mutex_t mutex;
    int cancel;                 /* atomic access only */
    const int *scene_closing;   /* atomic access only; may be NULL */
    uint32_t stage, samples_done;
    float progress;
    struct job_warning *warnings;
    uint32_t warning_count, warning_capacity;
};

void job_control_init(struct job_control *control);
void job_control_finish(struct job_control *control);

void job_cancel(struct job_control *control);
bool job_cancelled(const struct job_control *control);
/* The same for callbacks that take a void *. */
bool job_cancelled_callback(void *control);
void job_report(struct job_control *control, uint32_t stage, float progress);
void job_warn(struct job_control *control, const char *id, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/* Warns what an earlier job was warned of, since its product is used again. */
void job_warn_again(struct job_control *control, const struct job_warning *warning);

#endif
