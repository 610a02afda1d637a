/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The device's thread and its queue. */
#include "gl/device.h"
#include "base/log.h"
#include "base/result.h"

#include <stdio.h>
#include <stdlib.h>

/* Behind all others: the queue is as long as there are jobs, a few. */
static void push(brume_device *device, struct task *task)
{
    struct task **end = &device->first;
    while (*end)
        end = &(*end)->next;
    task->next = NULL;
    *end = task;
}

/* The first of those of the lowest rank; NULL from an empty queue. */
static struct task *pop(brume_device *device)
{
    struct task **best = &device->first;
    for (struct task **place = best; *place; place = &(*place)->next)
        if ((*place)->rank < (*best)->rank)
            best = place;
    struct task *task = *best;
    if (task)
        *best = task->next;
    return task;
}

static void *thread_main(void *argument)
{
    brume_device *device = argument;
    const brume_result started = context_init(&device->gpu.context, device->debug);

    pthread_mutex_lock(&device->mutex);
    device->start_result = started;
    snprintf(device->start_error, sizeof device->start_error, "%s", last_error());
    device->ready = 1;
    pthread_cond_broadcast(&device->idle);
    if (started != BRUME_OK) {
        pthread_mutex_unlock(&device->mutex);
        return NULL;
    }
    for (;;) {
        while (!device->first && !device->quit)
            pthread_cond_wait(&device->wake, &device->mutex);
        struct task *task = pop(device);
        if (!task)
            break;
        pthread_mutex_unlock(&device->mutex);
        const bool more = task->step(&device->gpu, task->user);
        pthread_mutex_lock(&device->mutex);
        if (more)
            push(device, task);
    }
    pthread_mutex_unlock(&device->mutex);

    program_cache_finish(&device->gpu.programs);
    if (device->gpu.memory.total != 0)
        log_write(BRUME_LOG_WARNING, "%llu bytes of GPU memory were not freed",
                  (unsigned long long)device->gpu.memory.total);
    context_finish(&device->gpu.context);
    return NULL;
}

brume_result device_create(const brume_device_params *params, brume_device **out)
{
    brume_device *device = calloc(1, sizeof *device);
    if (!device)
        return fail(BRUME_E_MEMORY, "no memory for the device");
    device->references = 1;
    device->debug = params->debug;
    device->log = params->log;
    device->log_user = params->log_user;
    brume_result result = program_cache_init(&device->gpu.programs, params->shader_dir);
    if (result != BRUME_OK) {
        free(device);
        return result;
    }
    log_set_sink(device->log, device->log_user);
    pthread_mutex_init(&device->mutex, NULL);
    pthread_cond_init(&device->wake, NULL);
    pthread_cond_init(&device->idle, NULL);
    if (pthread_create(&device->thread, NULL, thread_main, device) != 0) {
        result = fail(BRUME_E_MEMORY, "the device's thread could not be started");
        goto error;
    }
    pthread_mutex_lock(&device->mutex);
    while (!device->ready)
        pthread_cond_wait(&device->idle, &device->mutex);
    pthread_mutex_unlock(&device->mutex);
    if (device->start_result != BRUME_OK) {
        pthread_join(device->thread, NULL);
        result = fail(device->start_result, "%s", device->start_error);
        goto error;
    }
    *out = device;
    return BRUME_OK;

error:
    log_clear_sink(device->log, device->log_user);
    pthread_cond_destroy(&device->idle);
    pthread_cond_destroy(&device->wake);
    pthread_mutex_destroy(&device->mutex);
    free(device);
    return result;
}

brume_device *device_retain(brume_device *device)
{
    __atomic_add_fetch(&device->references, 1, __ATOMIC_RELAXED);
    return device;
}

void device_release(brume_device *device)
{
    if (__atomic_sub_fetch(&device->references, 1, __ATOMIC_ACQ_REL) != 0)
        return;
    pthread_mutex_lock(&device->mutex);
    device->quit = 1;
    pthread_cond_broadcast(&device->wake);
    pthread_mutex_unlock(&device->mutex);
    pthread_join(device->thread, NULL);
    pthread_cond_destroy(&device->idle);
    pthread_cond_destroy(&device->wake);
    pthread_mutex_destroy(&device->mutex);
    free(device);
}

void device_destroy(brume_device *device)
{
    log_clear_sink(device->log, device->log_user);
    device_release(device);
}

void device_post(brume_device *device, struct task *task)
{
    pthread_mutex_lock(&device->mutex);
    push(device, task);
    pthread_cond_broadcast(&device->wake);
    pthread_mutex_unlock(&device->mutex);
}

void device_hurry(brume_device *device, struct task *task)
{
    pthread_mutex_lock(&device->mutex);
    task->rank = TASK_ENDING;
    pthread_mutex_unlock(&device->mutex);
}

void device_hurry_all(brume_device *device, const void *owner)
{
    pthread_mutex_lock(&device->mutex);
    for (struct task *task = device->first; task; task = task->next)
        if (task->owner == owner)
            task->rank = TASK_ENDING;
    pthread_mutex_unlock(&device->mutex);
}

/* A task that somebody waits for. */
struct call {
    struct task task;
    brume_device *device;
    bool (*step)(struct gpu *gpu, void *user);
    void *user;
    bool done; /* guarded by the device's mutex */
};

static bool step_call(struct gpu *gpu, void *user)
{
    struct call *call = user;
    if (call->step(gpu, call->user))
        return true;
    brume_device *device = call->device;
    pthread_mutex_lock(&device->mutex);
    call->done = true; /* the caller's stack, gone once it sees this */
    pthread_cond_broadcast(&device->idle);
    pthread_mutex_unlock(&device->mutex);
    return false;
}

void device_call(brume_device *device, bool (*step)(struct gpu *, void *), void *user)
{
    struct call call = {.task = {.step = step_call, .rank = TASK_ENDING},
                        .device = device, .step = step, .user = user};
    call.task.user = &call;
    device_post(device, &call.task);
    pthread_mutex_lock(&device->mutex);
    while (!call.done)
        pthread_cond_wait(&device->idle, &device->mutex);
    pthread_mutex_unlock(&device->mutex);
}
