/* SPDX-License-Identifier: GPL-3.0-or-later */
/* An OpenGL 4.5 core context without a window, through EGL. All platform code of the library is in
 * context.c. The context belongs to the thread that created it. */
#ifndef BRUME_GL_CONTEXT_H
#define BRUME_GL_CONTEXT_H

#include "brume.h"

struct context {
    void *display, *context, *surface; /* EGL handles */
    brume_device_info info;
    int debug_errors;                  /* KHR_debug messages of type error so far */
};

/* Creates the context and makes it current on this thread. BRUME_E_NO_EGL, BRUME_E_NO_GL. */
brume_result context_init(struct context *context, uint32_t debug);
void context_finish(struct context *context);

/* GL_NO_ERROR or the driver's first pending error, as a result. Once per job, never per frame. */
brume_result context_check(const char *during);

#endif
