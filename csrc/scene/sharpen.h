/* SPDX-License-Identifier: GPL-3.0-or-later */
/* From the means of a lattice's cells to values that show them when interpolated. Any thread, and
 * all cores. */
#ifndef BRUME_SCENE_SHARPEN_H
#define BRUME_SCENE_SHARPEN_H

#include "scene/medium.h"

/* A cell's mean widens the medium, and so does the linear interpolation between cells: a quarter of
 * a cell's square is added to the variance of what is seen along each axis, which makes silhouettes
 * bright outside and dark inside. The coefficients' cells give that much back to their denser
 * neighbours: no mass is lost, nothing falls below 0, a cell of nothing stays one, a constant and a
 * straight slope stay what they are. The mean cosines are left alone. */
brume_result medium_sharpen(struct medium_lattice *lattice);

#endif
