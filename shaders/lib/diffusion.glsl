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

// What passes a side of a cell of the optical depth tau: of the cell's own fluence, and into `comes` what
// that of the cell beyond sends. Half a cell resists by 3/2 of its optical depth for fluxes of scattered
// light; where it leaves for good Marshak's condition, with a surface's reflectance.
vec3 passes_side(ivec3 cell, int number, vec3 tau, uint cuts, vec3 reflectance, out vec3 comes)
{
    int axis = number >> 1;
    ivec3 beyond = cell + side_of(number);
    bool cut = (cuts >> ((number & 1) != 0 ? axis : 13 + axis) & 1u) != 0u;
    ivec3 texel = clamp(beyond, ivec3(0), level.dims.xyz - 1);
    bool on = !cut && beyond == texel;
    vec3 mirrored = cut ? reflectance : vec3(0.0);
    vec3 lost = (1.0 - mirrored) / (2.0 * (1.0 + mirrored) + 1.5 * tau * (1.0 - mirrored));
    vec3 through = on ? 1.0 / (1.5 * (tau + texelFetch(cell_depths, texel, 0).rgb)) : lost;
    comes = on ? through * texelFetch(missing, texel, 0).rgb : vec3(0.0);
    return through;
}
