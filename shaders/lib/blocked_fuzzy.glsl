// SPDX-License-Identifier: GPL-3.0-or-later
// Factors that were found before the iterations, as lpv_fuzzy_prepare leaves them.
#include "lib/blocked.glsl"

layout(binding = SLOT_BLOCKED) uniform usampler3D blocked_factors;

struct cell_blockers
{
    uvec4 factors[2]; // of links 0 to 12, and of their opposites
};

cell_blockers blockers_of(ivec3 cell)
{
    ivec3 texel = ivec3(2 * cell.x, cell.yz);
    return cell_blockers(uvec4[](texelFetch(blocked_factors, texel, 0),
                                 texelFetch(blocked_factors, texel + ivec3(1, 0, 0), 0)));
}

float factor(uvec4 factors, int i)
{
    return float(factors[i >> 2] >> (8 * (i & 3)) & 255u) * (1.0 / 255.0);
}

// Of the cell's link with that number to its neighbour; `there`: that is in the lattice. Factors of
// what lies around it nobody knows.
link_blockers blockers_between(cell_blockers own, ivec3 beyond, int number, bool there)
{
    int i = number % 13, opposite = number < 13 ? 1 : 0;
    ivec3 texel = ivec3(2 * beyond.x + opposite, beyond.yz);
    float share = factor(own.factors[1 - opposite], i);
    return link_blockers(share, there ? factor(texelFetch(blocked_factors, texel, 0), i) : share);
}
