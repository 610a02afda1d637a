// SPDX-License-Identifier: GPL-3.0-or-later
// What is known of the surfaces in a cell, from the sums that the drawing of links leaves.
#include "lib/level.glsl"

layout(binding = SLOT_WALLS) uniform usampler3D wall_sums;

// Three sums, from the number on, over the cuts that they are of.
vec3 mean_of_walls(ivec3 cell, int number)
{
    ivec3 texel = ivec3(WALL_TEXELS * cell.x, cell.yz);
    uint count = texelFetch(wall_sums, texel + ivec3(WALL_COUNT, 0, 0), 0).r;
    uvec3 sums = uvec3(texelFetch(wall_sums, texel + ivec3(number, 0, 0), 0).r,
                       texelFetch(wall_sums, texel + ivec3(number + 1, 0, 0), 0).r,
                       texelFetch(wall_sums, texel + ivec3(number + 2, 0, 0), 0).r);
    return vec3(sums) / (WALL_UNIT * max(float(count), 1.0));
}
