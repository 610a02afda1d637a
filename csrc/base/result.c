/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The thread's last error sentence, and assertions. */
#include "base/result.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

static _Thread_local char sentence[1024];

brume_result fail(brume_result code, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(sentence, sizeof sentence, format, arguments);
    va_end(arguments);
    return code;
}

const char *last_error(void)
{
    return sentence;
}

void assertion_failed(const char *expression, const char *file, int line)
{
    fprintf(stderr, "brume: %s:%d: assertion failed: %s\n", file, line, expression);
    abort();
}
