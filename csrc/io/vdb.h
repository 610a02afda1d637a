/* SPDX-License-Identifier: GPL-3.0-or-later */
/* OpenVDB files, read as dense fields. Any thread. Everything in the file is hostile until checked:
 * no exception, no crash and no allocation beyond the limit leaves this module. */
#ifndef BRUME_IO_VDB_H
#define BRUME_IO_VDB_H

#include "brume.h"

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

brume_result vdb_list(const char *path, brume_grid_info *infos, uint32_t capacity,
                      uint32_t *count);
brume_result vdb_load(const char *path, const char *name, uint64_t max_voxels, bool at_corner,
                      brume_grid **out);

#ifdef __cplusplus
}
#endif
#endif
