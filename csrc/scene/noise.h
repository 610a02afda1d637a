/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Gradient noise with the values of Blender's Noise Texture, so that a volume looks the same in
 * every engine. Any thread. */
#ifndef BRUME_SCENE_NOISE_H
#define BRUME_SCENE_NOISE_H

#include <stdbool.h>

/* Octaves added up: each has lacunarity times the frequency of the one before and roughness times
 * its amplitude. detail: how many after the first, 0 to NOISE_OCTAVES; a fraction fades the last in.
 * normalized: 0 to 1 with a mean of 0.5, else the sum itself, around 0. distortion: how far the
 * noise is moved by another noise. */
struct noise {
    int dimensions; /* 1 to 4 */
    bool normalized;
    float detail, roughness, lacunarity, distortion;
};

#define NOISE_OCTAVES 15

/* At a point, of which the first `dimensions` coordinates count. out[0]: Blender's Fac; with `color`
 * all three of its Color, else the same in all. Not finite where the sum of the octaves is not. */
void noise_at(const struct noise *noise, const float point[4], bool color, float out[3]);

#endif
