/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The device: one thread that owns one context and runs tasks in order. Any thread may post. */
#ifndef BRUME_GL_DEVICE_H
#define BRUME_GL_DEVICE_H

#include "gl/context.h"
#include "gl/memory.h"
#include "gl/program.h"

#include <pthread.h>

/* What the tasks of the device's thread work with. */
struct gpu {
    struct context context;
    struct program_cache programs;
    struct memory memory;
};

struct task {
    void (*run)(struct gpu *gpu, void *user);
    void *user;
    int *done; /* set once it ran, where somebody waits; the waiter owns the task then */
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
    struct task *first, *last;
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
brume_result device_post(brume_device *device, void (*run)(struct gpu *, void *), void *user);
/* Queues the task and returns when it has run, and with it all that was posted before. Cannot fail.
 * Not from the device's thread. */
void device_call(brume_device *device, void (*run)(struct gpu *, void *), void *user);

#endif
