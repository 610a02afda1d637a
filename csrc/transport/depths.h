/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Optical depths from a lattice's nodes to the lamps: the ways to find them. Device thread. */
#ifndef BRUME_TRANSPORT_DEPTHS_H
#define BRUME_TRANSPORT_DEPTHS_H

#include "transport/method.h"

#define DEPTH_NODE_BYTES 8 /* of one lamp: four halves */

/* Of how many of a lamp's samples the transmittances are averaged: 1, but for lamps so wide that it
 * shows. */
uint32_t depths_samples(const struct gpu_light *light, float cell);

/* What depths_run needs for a while beside the texture of the lamps' tiles, in bytes. */
uint64_t depths_working_bytes(const brume_settings *settings, const struct gpu_light *lights,
                              uint32_t count, const struct gpu_frame *frame, int texture_limit);

/* Fills the tiles of those lamps in transport->tau, which has its size. The frame's block and the
 * medium are bound. */
brume_result depths_run(struct transport *transport, const struct transport_input *input,
                        const uint32_t *lights, uint32_t count);

#endif
