/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Results: where a call fails, it says so once, in a sentence that names the thing. Any thread;
 * the sentence belongs to the thread. */
#ifndef BRUME_BASE_RESULT_H
#define BRUME_BASE_RESULT_H

#include "brume.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Stores the sentence as the thread's last error and returns the code: `return fail(…);` */
brume_result fail(brume_result code, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* The thread's last sentence. */
const char *last_error(void);

/* Our own mistake: kept in release builds. */
void assertion_failed(const char *expression, const char *file, int line)
    __attribute__((noreturn));

#ifdef __cplusplus
}
#endif

#ifndef __cplusplus
#define ASSERT(expression)                                                                         \
    ((expression) ? (void)0 : assertion_failed(#expression, __FILE__, __LINE__))
#endif

/* The caller's mistake: the failed precondition prints itself. */
#define REQUIRE(expression)                                                                        \
    do {                                                                                           \
        if (!(expression))                                                                         \
            return fail(BRUME_E_ARGUMENT, "%s: the condition '%s' does not hold", __func__,        \
                        #expression);                                                              \
    } while (0)

#define TRY(call)                                                                                  \
    do {                                                                                           \
        brume_result try_result_ = (call);                                                         \
        if (try_result_ != BRUME_OK)                                                               \
            return try_result_;                                                                    \
    } while (0)

#endif
