// SPDX-License-Identifier: GPL-3.0-or-later
// The lines that a link is made of, nine or seven: from points around the middle of its cell to those of its
// neighbour, as far apart as they are from each other across it: thirds of a cell. Points are bits, by offset_bit().
#include "lib/level.glsl"

const uint POINTS_ACROSS[13] = uint[](
    0x2492492u, 0x0e07038u, 0x003fe00u, 0x150a854u, 0x4462311u, 0x1252524u, 0x4912449u,
    0x01c71c0u, 0x7007007u, 0x028a8a0u, 0x280a80au, 0x2222222u, 0x08a2288u);
const uint MIDDLE = 1u << 13;

ivec3 lines_texel(ivec3 cell, int number)
{
    return links_texel(cell) * ivec3(LINE_SIDE, LINE_SIDE, 1) + ivec3(number % LINE_SIDE, number / LINE_SIDE, 0);
}
