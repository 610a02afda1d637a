/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A field: a dense box of voxels with its place in an object's space. Array space has voxel
 * (i, j, k) fill the unit cube from (i, j, k); the value stands at its centre. Immutable once made,
 * reference-counted; any thread. */
#ifndef BRUME_BASE_FIELD_H
#define BRUME_BASE_FIELD_H

#include "brume.h"

#ifdef __cplusplus
extern "C" {
#endif

/* brume_grid of the public interface is this struct. */
struct brume_grid {
    int references;          /* atomic access only */
    brume_grid_info info;    /* name, type, channels, dims, object_from_array … */
    float *data;             /* channels * dims product, x fastest; malloc */
};

/* A field with info copied and zeroed data of channels * dims floats; references = 1. */
brume_result field_create(const brume_grid_info *info, brume_grid **out);
brume_grid *field_retain(brume_grid *field);  /* NULL gives NULL */
void field_release(brume_grid *field);        /* NULL is fine */

/* Fills info.minimum and maximum; BRUME_E_GRID_VALUES naming the field if a value is not finite. */
brume_result field_finish(brume_grid *field);

#ifdef __cplusplus
}
#endif
#endif
