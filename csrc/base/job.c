/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Progress, cancel, warnings. */
#include "base/job.h"
#include "base/log.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void job_control_init(struct job_control *control)
{
    memset(control, 0, sizeof *control);
    pthread_mutex_init(&control->mutex, NULL);
}

void job_control_finish(struct job_control *control)
{
    free(control->warnings);
    pthread_mutex_destroy(&control->mutex);
}

void job_cancel(struct job_control *control)
{
    __atomic_store_n(&control->cancel, 1, __ATOMIC_RELEASE);
}

bool job_cancelled(const struct job_control *control)
{
    return __atomic_load_n(&control->cancel, __ATOMIC_ACQUIRE) ||
           (control->scene_closing && __atomic_load_n(control->scene_closing, __ATOMIC_ACQUIRE));
}

bool job_cancelled_callback(void *control)
{
    return job_cancelled(control);
}

void job_report(struct job_control *control, uint32_t stage, float progress)
{
    pthread_mutex_lock(&control->mutex);
    control->stage = stage;
    if (progress > control->progress) /* a stage that runs again takes nothing back */
        control->progress = progress;
    pthread_mutex_unlock(&control->mutex);
}

void job_warn(struct job_control *control, const char *id, const char *format, ...)
{
    struct job_warning warning;
    snprintf(warning.id, sizeof warning.id, "%s", id);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(warning.sentence, sizeof warning.sentence, format, arguments);
    va_end(arguments);
    log_write(BRUME_LOG_INFO, "%s: %s", id, warning.sentence);
    job_warn_again(control, &warning);
}

void job_warn_again(struct job_control *control, const struct job_warning *warning)
{
    pthread_mutex_lock(&control->mutex);
    if (control->warning_count == control->warning_capacity) {
        const uint32_t capacity = control->warning_capacity ? control->warning_capacity * 2 : 8;
        struct job_warning *grown = realloc(control->warnings, capacity * sizeof *grown);
        if (grown) {
            control->warnings = grown;
            control->warning_capacity = capacity;
        }
    }
    if (control->warning_count < control->warning_capacity)
        control->warnings[control->warning_count++] = *warning;
    pthread_mutex_unlock(&control->mutex);
}
