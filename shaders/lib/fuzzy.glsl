// SPDX-License-Identifier: GPL-3.0-or-later
// The fuzzy blockers' lattice: half a cell lower than the field's, a cell more along every side.
#include "lib/level.glsl"

ivec3 blockers_dims()
{
    return level.dims.xyz + 1;
}

bool in_blockers(ivec3 cell)
{
    return all(greaterThanEqual(cell, ivec3(0))) && all(lessThan(cell, blockers_dims()));
}
