/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The device: one thread that owns one context and runs tasks, a step of each in turn. Any thread
 * may post. */
#ifndef BRUME_GL_DEVICE_H
#define BRUME_GL_DEVICE_H

#include "gl/context.h"
#include "gl/memory.h"
#include "gl/program.h"

#include <pthread.h>
#include <stdbool.h>

/* What the tasks of the device's thread work with. */
struct gpu {
    struct context context;
    struct program_cache programs;
    struct memory memory;
};

/* Tasks of a lower rank run before all of a higher one, those of one rank take turns. */
enum task_rank {
    TASK_ENDING, /* frees memory, or only has to see that it was cancelled */
    TASK_URGENT,
    TASK_PATIENT,
};

/* Belongs to who posts it, until the step that returns false. */
struct task {
    bool (*step)(struct gpu *gpu, void *user); /* true: there is more to do */
    void *user;
    const void *owner; /* what device_hurry_all knows it by; may be NULL */
    enum task_rank rank; /* guarded by the device's mutex once posted, as next */
    struct task *next;
};

struct brume_device {
    int references; /* atomic access only: the caller's and the scenes' */
    struct gpu gpu;
    brume_log_function log;
    void *log_user;
    uint32_t debug;
    pthread_t thread;
    pthread_mutex_t mutex;
    pthread_cond_t wake, idle;
    struct task *first; /* in the order of their turns */
    int quit, ready;
    brume_result start_result;
    char start_error[1024];
};

brume_result device_create(const brume_device_params *params, brume_device **out);
/* Takes the log back from the caller, and ends the thread once no scene is left. */
void device_destroy(brume_device *device);
brume_device *device_retain(brume_device *device);
void device_release(brume_device *device);

/* Queues the task; never waits for it. */
void device_post(brume_device *device, struct task *task);
/* Serves a task that was posted, or all of an owner that wait, before others from now on. */
void device_hurry(brume_device *device, struct task *task);
void device_hurry_all(brume_device *device, const void *owner);
/* Runs a task before others and returns when it is done. Not from the device's thread. */
void device_call(brume_device *device, bool (*step)(struct gpu *, void *), void *user);

#endif
