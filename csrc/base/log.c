/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The log's sink. */
#include "base/log.h"

#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>

static struct {
    pthread_mutex_t mutex;
    brume_log_function function;
    void *user;
} sink = {.mutex = PTHREAD_MUTEX_INITIALIZER};

void log_set_sink(brume_log_function function, void *user)
{
    pthread_mutex_lock(&sink.mutex);
    sink.function = function;
    sink.user = user;
    pthread_mutex_unlock(&sink.mutex);
}

void log_clear_sink(brume_log_function function, void *user)
{
    pthread_mutex_lock(&sink.mutex);
    if (sink.function == function && sink.user == user) {
        sink.function = NULL;
        sink.user = NULL;
    }
    pthread_mutex_unlock(&sink.mutex);
}

void log_write(brume_log_level level, const char *format, ...)
{
    static const char *const words[] = {"error", "warning", "info", "debug"};
    char sentence[2048];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(sentence, sizeof sentence, format, arguments);
    va_end(arguments);

    pthread_mutex_lock(&sink.mutex);
    if (sink.function)
        sink.function(sink.user, level, sentence);
    else if (level <= BRUME_LOG_WARNING)
        fprintf(stderr, "brume: %s: %s\n", words[level], sentence);
    pthread_mutex_unlock(&sink.mutex);
}
