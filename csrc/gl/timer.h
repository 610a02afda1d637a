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

/* Pieces of work, one after another, each added to the sum of its kind: the GPU's time, for which
 * nothing waits before the end. */
#define LAPS 256

struct laps {
    double *sums_ms; /* one a kind */
    GLuint queries[LAPS];
    int kinds[LAPS], count;
};

/* What follows is of that kind. */
void laps_go(struct laps *laps, int kind);
/* Waits for the GPU and adds to the sums. */
void laps_end(struct laps *laps);

#endif
