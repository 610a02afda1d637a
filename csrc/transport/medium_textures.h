/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The medium's lattice on the GPU, and its bricks for skipping empty space. Device thread. */
#ifndef BRUME_TRANSPORT_MEDIUM_TEXTURES_H
#define BRUME_TRANSPORT_MEDIUM_TEXTURES_H

#include "gl/device.h"
#include "scene/medium.h"

#include <stdbool.h>

struct medium_textures {
    struct texture scatter, extinct, emission, bricks;
    int32_t dims[3]; /* 0 without media */
    float lower[3], upper[3], cell;
    int emits;
    float forward; /* the largest share that is scaled away */
};

/* Bytes of a cell on the GPU: scatter and extinction, and emission where there is one, as halves,
 * its part of a brick, and of the layers by which textures are larger than the lattice. */
#define MEDIUM_CELL_BYTES 30

/* Of what is scattered with a mean cosine, the share that counts as not scattered at all, where strong
 * forward scattering is scaled away (delta-M; forward_share of shaders/lib/phase.glsl). */
float medium_forward_share(float g);
/* Brings the lattice's values within what half floats hold, and uploads them. scaled: extinction
 * without that share of sigma_s. */
brume_result medium_textures_upload(struct gpu *gpu, struct medium_textures *textures,
                                    struct medium_lattice *lattice, bool scaled);
void medium_textures_bind(const struct medium_textures *textures);
void medium_textures_finish(struct gpu *gpu, struct medium_textures *textures);

#endif
