/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Surfaces that glow and are small beside the cells of the field's lattice, such as bulbs, candles
 * and LEDs: lamps stand for them, since a lattice knows no more of them than whether one of its
 * lines happens to meet them. Device thread. */
#ifndef BRUME_RENDER_EMITTERS_H
#define BRUME_RENDER_EMITTERS_H

#include "render/geometry.h"

#define EMITTERS_MOST 24 /* lamps: each is a ray in every step of the march, and six shadow maps */

struct emitters {
    brume_light lamps[EMITTERS_MOST];
    uint32_t count;
    uint64_t signature; /* of these */
    uint64_t key;       /* of what they were found in */
};

/* Finds them, if geometry (its revision says), the size of the frame's cells or `wanted` changed,
 * without which there are none; and marks the draws that they stand for, which light nothing and
 * cast no shadow then. */
void emitters_update(struct emitters *emitters, struct geometry *geometry,
                     const struct snapshot *snapshot, const struct gpu_frame *frame,
                     uint64_t revision, int wanted);

#endif
