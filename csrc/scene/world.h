/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The world's light as directional samples: importance-sampled where an image is bright, an even
 * spiral where it is not. Any thread. */
#ifndef BRUME_SCENE_WORLD_H
#define BRUME_SCENE_WORLD_H

#include "brume.h"
#include "brume_gpu.h"

struct world_map;

/* count samples; weight = radiance times the solid angle that the sample stands for. The map's spots
 * are left out. */
brume_result world_samples(const brume_world *world, const struct world_map *map, uint32_t count,
                           struct gpu_light_sample *out);

#endif
