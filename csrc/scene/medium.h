/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The medium's lattice: all volumes of a scene summed into one box of cells, on the CPU with all
 * cores. Any thread. World-aligned, cubic cells, no world volume (that one stays analytic). */
#ifndef BRUME_SCENE_MEDIUM_H
#define BRUME_SCENE_MEDIUM_H

#include "brume.h"
#include "scene/volume_program.h"

#include <stdbool.h>

/* An owned, immutable copy of a brume_volume; reference-counted. */
struct volume {
    int references;
    char name[64];
    uint32_t grid_count;
    brume_grid **grids;              /* retained */
    uint32_t vertex_count, triangle_count;
    float *positions;                /* NULL but for a mesh */
    uint32_t *triangles;
    brume_gaussian *gaussians;       /* NULL but for those; none of amplitude 0 */
    uint32_t gaussian_count;
    struct volume_program program;
    float world_from_object[16];
    float object_from_world[16];
    float generated_lower[3], generated_upper[3];
    float scale;
    float lower[3], upper[3];        /* world-axis bounds of what can be non-zero; where nothing
                                        can, infinite and the wrong way round */
};

/* Checks everything and copies; the errors name the volume. A grid volume without any grid, a
 * singular matrix, a mesh without triangles, no Gaussians are errors; Gaussians that are all of
 * amplitude 0 are a volume that reaches nowhere. */
brume_result volume_create(const brume_volume *source, struct volume **out);
struct volume *volume_retain(struct volume *volume);
void volume_release(struct volume *volume);

/* Per cell, x fastest: 4 floats each.
 *   scatter  rgb sigma_s, a mean cosine (weighted by sigma_s)
 *   extinct  rgb sigma_t, a unused
 *   emission rgb, a unused; NULL when no volume emits */
struct medium_lattice {
    int32_t dims[3];                 /* all 0 without volumes */
    float lower[3], upper[3];        /* world box */
    float cell;                      /* side of a cell, m */
    float *scatter, *extinct, *emission;
    bool coarser;                    /* max_cells forced a lower resolution */
};

/* The resolution at which cells are as small as the smallest voxel of the grids, or as the
 * narrowest Gaussian needs: more cells would show nothing more. INT32_MAX with a mesh or a texture,
 * which any resolution makes better. */
int32_t medium_useful_resolution(struct volume *const *volumes, uint32_t count);

/* A volume most of whose Gaussians are narrower than the lattice's cells, so that they are smeared
 * over these, or NULL. Into *wide another without which the box of all would be half as long at
 * most, or NULL. */
const struct volume *medium_smeared(struct volume *const *volumes, uint32_t count,
                                    const struct medium_lattice *lattice,
                                    const struct volume **wide);

/* resolution: cells along the longest side of the volumes' joint bounds. max_cells: a limit that
 * makes it coarser. cancelled (may be NULL): polled; a true return ends with BRUME_E_CANCELLED.
 * Values are means over the cell: a lattice coarser than the grid does not lose mass, a finer one
 * interpolates linearly. */
brume_result medium_build(struct volume *const *volumes, uint32_t count, int32_t resolution,
                          uint64_t max_cells, bool (*cancelled)(void *user), void *user,
                          struct medium_lattice *out);
void medium_finish(struct medium_lattice *lattice); /* zeroed is fine */

#endif
