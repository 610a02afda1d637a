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
    struct task *next;
};

struct brume_device {
    struct gpu gpu;
    uint32_t debug;
    pthread_t thread;
    pthread_mutex_t mutex;
    pthread_cond_t wake, idle;
    struct task *first, *last;
    int busy, quit, ready;
    brume_result start_result;
    char start_error[1024];
};

brume_result device_create(const brume_device_params *params, brume_device **out);
void device_destroy(brume_device *device);

/* Queues the task; never waits for it. */
brume_result device_post(brume_device *device, void (*run)(struct gpu *, void *), void *user);
/* Returns when every task posted before has run. Not from the device's thread. */
void device_drain(brume_device *device);

#endif
