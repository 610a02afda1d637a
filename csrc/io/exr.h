/* SPDX-License-Identifier: GPL-3.0-or-later */
/* OpenEXR files through OpenEXR's C API (OpenEXRCore). Any thread. */
#ifndef BRUME_IO_EXR_H
#define BRUME_IO_EXR_H

#include "brume.h"

brume_result exr_write(const char *path, int32_t width, int32_t height,
                       const brume_exr_channel *channels, uint32_t count);
/* *pixels: width * height * 4 floats, rows bottom to top, malloc. */
brume_result exr_read(const char *path, int32_t *width, int32_t *height, float **pixels);

#endif
