/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The volume shader programs of brume.h: check and run. Any thread. */
#ifndef BRUME_SCENE_VOLUME_PROGRAM_H
#define BRUME_SCENE_VOLUME_PROGRAM_H

#include "brume.h"

#include <stdbool.h>

/* An owned copy of a program. */
struct volume_program {
    brume_volume_program program; /* its pointers are owned */
};

/* Checks registers, ops, grid and ramp numbers, use before definition; copies. */
brume_result volume_program_init(struct volume_program *program, const brume_volume_program *source,
                                 uint32_t grid_count, const char *volume_name);
void volume_program_finish(struct volume_program *program); /* zeroed is fine */

/* What a program gives for one cell; non-negative and finite whatever it computed. */
struct medium_sample {
    float sigma_s[3], sigma_a[3], emission[3], g;
};

/* Middles of cells in a row, in each space: the first one's, and the way to the next. */
struct cell_row {
    double first[BRUME_SPACE_COUNT][3], step[BRUME_SPACE_COUNT][3];
};

/* Whether the program asks where a cell is. */
bool volume_program_is_placed(const struct volume_program *program);

/* Runs the program for count cells. grids: for each grid number, count * 3 floats (a one-channel
 * grid has its value thrice), or NULL which reads as 0. row: where they are; NULL reads as 0. */
void volume_program_run(const struct volume_program *program, const float *const *grids,
                        const struct cell_row *row, uint32_t count, struct medium_sample *out);

#endif
