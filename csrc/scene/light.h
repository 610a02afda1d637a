/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Lamps at Cycles' radiometry, and the points on them that stand for their extent. Any thread. */
#ifndef BRUME_SCENE_LIGHT_H
#define BRUME_SCENE_LIGHT_H

#include "brume.h"
#include "brume_gpu.h"

/* Everything of the GPU's light but its sample range and lattice tile. */
void light_to_gpu(const brume_light *light, struct gpu_light *out);

/* How many samples stand for it when `wanted` are asked for: 1 where it has no extent. */
uint32_t light_sample_count(const brume_light *light, uint32_t wanted);

/* Faces of the shadow maps of one sample: 1, 5 (all but behind) or 6. */
uint32_t light_faces(const brume_light *light);

/* Sample number index of count; stratified, deterministic. */
void light_sample(const brume_light *light, const struct gpu_light *gpu, uint32_t index,
                  uint32_t count, struct gpu_light_sample *out);

/* Right-handed frame that the faces are laid along: u, v, forward, unit. */
void light_frame(const struct gpu_light *gpu, float u[3], float v[3], float forward[3]);

#endif
