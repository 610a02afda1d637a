// SPDX-License-Identifier: GPL-3.0-or-later
// What DOM's iterations have yet to find, as diffusion: how much passes from a cell to those around.
#include "lib/ordinates.glsl"
#include "lib/cuts.glsl"

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage;
};

layout(binding = SLOT_CUTS) uniform usampler3D cell_cuts;
layout(binding = SLOT_CELL_DEPTHS) uniform sampler3D cell_depths; // as dom_cells leaves them
layout(binding = SLOT_WALLS) uniform sampler3D cell_reflectance;
layout(binding = SLOT_MISSING) uniform sampler3D missing; // of the fluence's moment

// The six sides: against an axis, and along it.
ivec3 side_of(int number)
{
    int axis = number >> 1;
    return (2 * (number & 1) - 1) * ivec3(axis == 0, axis == 1, axis == 2);
}

// A cell, as far as it matters here.
struct diffusing
{
    vec3 tau;      // its optical depth
    uint cuts;
    vec3 mirrored; // reflectance of its surfaces
    vec3 sent;     // radiance that these have yet to send
};

diffusing diffusing_cell(ivec3 cell, sampler3D residual)
{
    return diffusing(texelFetch(cell_depths, cell, 0).rgb, texelFetch(cell_cuts, cell, 0).r,
                     texelFetch(cell_reflectance, cell, 0).rgb,
                     texelFetch(residual, mixed_texel(cell, MIXED - 1), 0).rgb);
}

// What surfaces, or the lattice's end, with that reflectance take of the fluence of a cell, and into
// `comes` what they send: Marshak's condition behind half the cell.
vec3 passes_end(diffusing c, vec3 mirrored, vec3 sent, out vec3 comes)
{
    vec3 resists = 2.0 * (1.0 + mirrored) + 1.5 * c.tau * (1.0 - mirrored);
    comes = sent * sqrt(4.0 * PI) / resists;
    return (1.0 - mirrored) / resists;
}

// What passes a side of a cell: of the cell's own fluence, and into `comes` what comes from beyond. Half a
// cell resists by 3/2 of its optical depth.
vec3 passes_side(ivec3 cell, int number, diffusing c, out vec3 comes)
{
    int axis = number >> 1;
    ivec3 beyond = cell + side_of(number);
    bool cut = (c.cuts >> ((number & 1) != 0 ? axis : 13 + axis) & 1u) != 0u;
    ivec3 texel = clamp(beyond, ivec3(0), level.dims.xyz - 1);
    vec3 lost = passes_end(c, cut ? c.mirrored : vec3(0.0), cut ? c.sent : vec3(0.0), comes);
    if (cut || beyond != texel)
        return lost;
    vec3 through = 1.0 / (1.5 * (c.tau + texelFetch(cell_depths, texel, 0).rgb));
    comes = through * texelFetch(missing, texel, 0).rgb;
    return through;
}
