/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Where the medium's lattice lies, and how fine it is. Any thread. */
#ifndef BRUME_SCENE_MEDIUM_PLACE_H
#define BRUME_SCENE_MEDIUM_PLACE_H

#include "scene/medium.h"

/* Parts of a cell this thin are rounding noise of the bounds, not worth a cell of their own. */
#define SLIVER 1e-4

/* Fills all but the arrays, as medium_build says; the dims stay 0 if the volumes have no extent. */
void medium_place(struct medium_lattice *lattice, struct volume *const *volumes, uint32_t count,
                  int32_t resolution, uint64_t max_cells);

#endif
