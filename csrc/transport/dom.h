/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What the stages of DOM share. Device thread. */
#ifndef BRUME_TRANSPORT_DOM_H
#define BRUME_TRANSPORT_DOM_H

#include "transport/lpv.h"

/* Bytes of a cell: what the view takes light from, and the next run begins with; what is needed
 * while that is found; of this for each ordinate, and where another lattice stands within. */
#define DOM_CELL_BYTES (FIELD_CELL_BYTES + 8 * MOMENTS + 8 * BAND_2 + 24)
#define DOM_WORKING_BYTES (32 * MOMENTS + HISTORY * 16 * MIXED + 188)
#define DOM_ORDINATE_BYTES 24
#define DOM_AROUND_BYTES 8
#define DOM_SLICE_BYTES 16 /* of a slice's cell, for each ordinate */

/* Cells along the lattice's longest side. */
int dom_longest_side(const ivec4 *dims);

/* The ordinates of a quadrature with so many, 26, 48 or 96, sorted by their major axes: directions
 * and weights, sr. docs/methods/dom.md says what they integrate exactly. Returns how many have each
 * axis. */
void dom_quadrature(int count, vec4 directions[MOST_ORDINATES], int axes[3]);

/* Whether geometry reaches beyond the outermost lattice. */
bool dom_has_surroundings(const struct transport_input *input);
/* Tells the ordinate where in its map light is found. */
void dom_place_map(const struct lpv_work *cells, struct gpu_ordinate *ordinate);
/* Makes the maps, a layer an ordinate: radiance of the world, or of surfaces beyond the lattice
 * that hide it. Ordinates and lattice are there and bound; the texture is new, and the caller's. */
brume_result dom_look_out(struct lpv_work *cells, const vec4 *directions, int count,
                          struct texture *out);

/* Shares of the results of `count` iterations, 1 together, that make their residuals' sum least;
 * from the residuals' products. Any thread. */
void dom_mix_shares(int count, double products[HISTORY][HISTORY], double shares[HISTORY]);

#endif
