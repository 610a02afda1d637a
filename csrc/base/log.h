/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The log: one sink for the process, set by the device. Any thread, one call at a time. */
#ifndef BRUME_BASE_LOG_H
#define BRUME_BASE_LOG_H

#include "brume.h"

#ifdef __cplusplus
extern "C" {
#endif

/* NULL: errors and warnings to stderr. */
void log_set_sink(brume_log_function function, void *user);
/* Back to stderr, if the sink is still this one. */
void log_clear_sink(brume_log_function function, void *user);

void log_write(brume_log_level level, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

#ifdef __cplusplus
}
#endif
#endif
