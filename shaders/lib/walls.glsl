// SPDX-License-Identifier: GPL-3.0-or-later
// What is known of the surfaces in a cell, from the sums that the drawing of links leaves.
#include "lib/level.glsl"

layout(binding = SLOT_WALLS) uniform usampler3D wall_sums;

// How many cuts of links its sums are of.
uint walls_met(ivec3 cell)
{
    return texelFetch(wall_sums, ivec3(WALL_TEXELS * cell.x + WALL_COUNT, cell.yz), 0).r;
}

// Three sums, from the number on, over the cuts that they are of.
vec3 mean_of_walls(ivec3 cell, int number)
{
    ivec3 texel = ivec3(WALL_TEXELS * cell.x, cell.yz);
    uvec3 sums = uvec3(texelFetch(wall_sums, texel + ivec3(number, 0, 0), 0).r,
                       texelFetch(wall_sums, texel + ivec3(number + 1, 0, 0), 0).r,
                       texelFetch(wall_sums, texel + ivec3(number + 2, 0, 0), 0).r);
    return vec3(sums) / (WALL_UNIT * max(float(walls_met(cell)), 1.0));
}
