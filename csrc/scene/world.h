/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The world's light as directional samples: importance-sampled where an image is bright, an even
 * spiral where it is not. Any thread. */
#ifndef BRUME_SCENE_WORLD_H
#define BRUME_SCENE_WORLD_H

#include "brume.h"
#include "brume_gpu.h"

struct image_block;

/* count samples; weight = radiance times the solid angle that the sample stands for. image may be
 * NULL. world_from_image turns image directions to the world's. */
brume_result world_samples(const brume_world *world, const struct image_block *image,
                           const float world_from_image[16], uint32_t count,
                           struct gpu_light_sample *out);

#endif
