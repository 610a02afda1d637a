// SPDX-License-Identifier: GPL-3.0-or-later
// Which of a cell's 26 links surfaces cut: bits, by their numbers.
#include "lib/links.glsl"

// Numbers of links by their offsets, x first; 31: there is none to the cell itself.
const uint NUMBERS[27] = uint[](
    22u, 20u, 12u, 18u, 15u, 6u, 24u, 8u, 10u, 16u, 14u, 4u, 13u, 31u,
    0u, 17u, 1u, 3u, 23u, 21u, 11u, 19u, 2u, 5u, 25u, 7u, 9u);

// The links from one of eight cells around a corner to the others, by which it is: as in point_in_cube(), x first.
const uint LINKS_BETWEEN[8] = uint[](
    0x00002afu, 0x20a2086u, 0x0204835u, 0x0a96004u,
    0x000854bu, 0x106a102u, 0x010d051u, 0x055e000u);

uint link_number(ivec3 offset)
{
    return NUMBERS[offset_number(offset)];
}

uint link_bit(ivec3 offset)
{
    return 1u << link_number(offset);
}

// Whether a surface cuts the link from a cell with those cut links, by the offset to its neighbour.
bool is_cut(uint cuts, ivec3 offset)
{
    return (cuts & link_bit(offset)) != 0u;
}

// How much of a link is closed: thirds of it, one and two, are bits by numbers of links.
float closed_share(uvec2 closed, uint link)
{
    return ((closed.x & link) != 0u ? 1.0 / 3.0 : 0.0) + ((closed.y & link) != 0u ? 2.0 / 3.0 : 0.0);
}
