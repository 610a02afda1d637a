// SPDX-License-Identifier: GPL-3.0-or-later
// The lattice that is being filled with light, one of the frame's.
#include "lib/links.glsl"

layout(std140, binding = SLOT_LEVEL) uniform level_block
{
    gpu_field level;
};

bool in_level(ivec3 cell)
{
    return in_field(level, cell);
}

// Cells in the order of their rows, layer by layer.
int cell_number(ivec3 cell)
{
    return (cell.z * level.dims.y + cell.y) * level.dims.x + cell.x;
}

// Points along a cell's side that stand for what is in it: as many in all as that along the lattice's
// longest side, at least, so that a finer lattice takes no longer to ask them.
int points_in_cell(int in_all, int most)
{
    int longest = max(level.dims.x, max(level.dims.y, level.dims.z));
    return clamp(divided(in_all + longest - 1, longest).x, 1, most);
}

// The place of one of them, of so many along a side.
vec3 point_in_cell(ivec3 cell, int number, int points)
{
    return level.lower.xyz + (vec3(cell) + point_in_cube(number, points)) * level.lower.w;
}

// Where a cell stands in a picture of a lattice with its layers as tiles, so many in a row.
ivec2 tiled_texel(ivec3 cell, ivec3 dims, int row)
{
    return divided(cell.z, row).yx * dims.xy + cell.xy;
}

// The same in clip space.
vec4 tiled_position(ivec3 cell, ivec3 dims, int row)
{
    vec2 place = vec2(tiled_texel(cell, dims, row)) + 0.5;
    return vec4(place / vec2(dims.xy * ivec2(row, divided(dims.z + row - 1, row).x)) * 2.0 - 1.0, 0.5, 1.0);
}

// The picture of cut links knows the cells around the lattice, too: links from there lead into it.
bool in_links(ivec3 cell)
{
    return all(greaterThanEqual(cell, ivec3(-1))) &&
           all(lessThanEqual(cell, level.dims.xyz));
}

ivec3 links_texel(ivec3 cell)
{
    return cell + 1;
}
