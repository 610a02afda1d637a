/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Stage times: the wall's, and the GPU's between two timestamps. Device thread only. */
#ifndef BRUME_GL_TIMER_H
#define BRUME_GL_TIMER_H

#include <epoxy/gl.h>

double clock_ms(void); /* monotonic; any thread */

struct timer {
    GLuint queries[2];
    double started_ms;
};

/* Opens a debug group of that name and takes the times. */
void timer_begin(struct timer *timer, const char *name);
/* Waits for the GPU, closes the group, adds to the two sums. */
void timer_end(struct timer *timer, double *wall_ms, double *gpu_ms);

#endif
