/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A closed mesh as fractional coverage of a lattice's cells. Any thread. */
#ifndef BRUME_SCENE_VOXELIZE_H
#define BRUME_SCENE_VOXELIZE_H

#include "brume.h"

/* coverage: dims product floats, x fastest, each set to the part of the cell inside the mesh, 0..1.
 * lattice_from_object maps vertices to lattice space, where cell (i, j, k) is the unit cube from
 * (i, j, k). Inside is where the winding number is not 0, so overlapping shells unite. Exact along
 * one axis, by sub-columns across it. */
brume_result voxelize_mesh(const float *positions, uint32_t vertex_count, const uint32_t *triangles,
                           uint32_t triangle_count, const float lattice_from_object[16],
                           const int32_t dims[3], float *coverage);

#endif
