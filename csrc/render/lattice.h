/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Where the frame's lattices stand: the medium's, the transport's nodes, the sky's, the box of the
 * world's medium. Arithmetic alone; any thread. */
#ifndef BRUME_RENDER_LATTICE_H
#define BRUME_RENDER_LATTICE_H

#include "render/renderer.h"

/* Whether light goes from cell to cell with these settings. */
int lattice_wants_field(const brume_settings *settings);
/* No lattice of these settings is larger. */
uint64_t lattice_depth_bytes(const struct renderer *renderer, const brume_settings *settings);
uint64_t lattice_sky_bytes(const brume_settings *settings);
/* Fills the world's medium and the lattices of scattered light in renderer->frame, these within their
 * share of the budget. */
void lattice_place(struct renderer *renderer, const struct render_request *request);
/* What these take while light is found for them, and afterwards. */
uint64_t lattice_field_bytes(const struct renderer *renderer, const brume_settings *settings);
/* After it: fills the other lattice fields of renderer->frame, the tau tiles of the lights, renderer->tau_size.
 * Keeps the transport within its share of the budget, with a warning where that makes it coarser. */
brume_result lattice_layout(const struct gpu *gpu, struct renderer *renderer,
                            const struct render_request *request);

#endif
