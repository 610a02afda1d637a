// SPDX-License-Identifier: GPL-3.0-or-later
// The field as the view wants it: a texture four times as wide as its lattices, which stand in it one
// above the other, with each colour's
// fluence and flux, and last which links are cut, forwards and backwards, and where those along the
// axes are.
#version 450 core
#include "lib/level.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(binding = SLOT_FLOW) uniform sampler3D sums[3];
layout(binding = SLOT_LINKS) uniform usampler3D links;
layout(binding = SLOT_WALLS) uniform usampler3D walls;

layout(binding = SLOT_OUTPUT, rgba32f) writeonly uniform image3D field_image;

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (!in_level(cell))
        return;
    uint forwards = texelFetch(links, links_texel(cell), 0).r, backwards = 0u;
    for (int i = 0; i < 13; ++i)
        backwards |= texelFetch(links, links_texel(cell - LINKS[i]), 0).r & 1u << i;
    uint where = 0u;
    for (int axis = 0; axis < 3; ++axis)
        where |= texelFetch(walls, ivec3(WALL_TEXELS * cell.x + WALL_CUTS + axis, cell.yz), 0).r
                 << (8 * axis);
    ivec3 texel = cell + ivec3(0, 0, level.dims.w);
    for (int c = 0; c < 3; ++c, texel.x += level.dims.x)
        imageStore(field_image, texel, texelFetch(sums[c], cell, 0));
    imageStore(field_image, texel, vec4(float(forwards), float(backwards), float(where), 0.0));
}
