/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A thin lens: where in its opening a sample of all pixels looks from. Any thread. */
#ifndef BRUME_RENDER_LENS_H
#define BRUME_RENDER_LENS_H

#include "brume.h"

/* Offset from the eye along the view's right and up, m, of sample number index, of count. Those of
 * all samples are spread evenly over the opening; sample 0 is next to its middle. */
void lens_offset(const brume_lens *lens, uint32_t index, uint32_t count, float offset[2]);

#endif
