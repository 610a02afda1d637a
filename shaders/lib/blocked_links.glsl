// SPDX-License-Identifier: GPL-3.0-or-later
// A surface that cuts a link blocks it, both ways.
#include "lib/blocked.glsl"

layout(binding = SLOT_LINKS) uniform usampler3D links;

struct cell_blockers
{
    uint cut;
};

cell_blockers blockers_of(ivec3 cell)
{
    return cell_blockers(texelFetch(links, links_texel(cell), 0).r);
}

// Of the cell's link with that number to its neighbour; `there`: that is in the lattice.
link_blockers blockers_between(cell_blockers own, ivec3 beyond, int number, bool there)
{
    int i = number % 13;
    uint cut = (number < 13 ? own.cut : texelFetch(links, links_texel(beyond), 0).r) >> i;
    float share = float(cut & 1u);
    return link_blockers(share, share);
}
