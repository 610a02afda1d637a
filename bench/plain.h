/* SPDX-License-Identifier: GPL-3.0-or-later */
/* DOM's iteration in plain C, of a lattice without surfaces: what shaders/dom_source, dom_sweep and
 * dom_gather do, for the comparison of their speed. */
#ifndef BRUME_BENCH_PLAIN_H
#define BRUME_BENCH_PLAIN_H

#include "brume_gpu.h"

enum plain_part { PLAIN_SOURCE, PLAIN_SWEEP, PLAIN_GATHER, PLAIN_PARTS };

struct plain {
    int cells; /* along each side */
    float side;
    int count, axes[3]; /* ordinates: all, and by their major axes, in this order */
    vec4 directions[MOST_ORDINATES];
    float harmonics[MOST_ORDINATES][MOMENTS];
    /* x first; colours are planes of their own. In the turned ones the axis that ordinates go along
     * comes last, so that a slice of cells is one piece. */
    float *albedo, *g;
    float *extinct[3];         /* turned */
    float *medium[3];          /* turned, with a cell more on each side: 1 where there is one */
    float *first, *now, *next; /* moments */
    float *sources, *means;    /* by ordinates, turned; sources with a cell more */
    double spent_ms[PLAIN_PARTS];
};

/* A cube of one medium that emits; ordinates are those of DOM. Returns 0 without memory. */
int plain_init(struct plain *plain, int cells, float side, int count, const float sigma_s[3],
               const float sigma_a[3], const float emission[3], float g);
void plain_finish(struct plain *plain);
/* One iteration, without Anderson's acceleration. */
void plain_iterate(struct plain *plain);
double plain_fluence(const struct plain *plain, int cell, int color);

#endif
