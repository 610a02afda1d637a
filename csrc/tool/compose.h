/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Scene and view of brume-render, from what its command line says. A .vdb's own space is the world.
 * One thread; brume_last_error() has the sentence where a call fails. */
#ifndef BRUME_TOOL_COMPOSE_H
#define BRUME_TOOL_COMPOSE_H

#include "tool/options.h"

#define COMPOSE_GRIDS 3 /* density, flame, temperature */

/* World box of the medium. */
typedef struct compose_box {
    float lower[3], upper[3], center[3], radius;
} compose_box;

/* Loads the grids that the options name; the others stay NULL. The caller releases them. */
brume_result compose_grids(const options *given, brume_grid *grids[COMPOSE_GRIDS]);
brume_result compose_bounds(brume_grid *const grids[COMPOSE_GRIDS], compose_box *out);

brume_result compose_scene(brume_scene *scene, const options *given,
                           brume_grid *const grids[COMPOSE_GRIDS], const compose_box *box);

/* false where the camera has no direction. */
bool compose_view(const options *given, const compose_box *box, brume_view *out);

#endif
