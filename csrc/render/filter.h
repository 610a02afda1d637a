/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The pixel filter: where in and around its pixel a sample lies. Any thread. */
#ifndef BRUME_RENDER_FILTER_H
#define BRUME_RENDER_FILTER_H

#include <stdint.h>

/* Offset from the pixel's centre, in pixels, of sample number index, of count. Sample 0 is the centre.
 * The offsets are distributed as the Blackman-Harris filter, so all weights are 1; their mean is 0,
 * but for two samples. What Blender calls its width is the distance from the centre at which it ends. */
void filter_offset(uint32_t index, uint32_t count, float width, float offset[2]);

#endif
