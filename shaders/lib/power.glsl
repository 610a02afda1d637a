// SPDX-License-Identifier: GPL-3.0-or-later
// The power that a lattice pass leaves in flight, cell by cell. Summed up elsewhere: barriers, which a
// sum by groups needs, took software a fifth of the whole pass.
#include "lib/level.glsl"

layout(std430, binding = SLOT_POWERS) writeonly buffer powers_block
{
    float powers[]; // W of all colours
};

void tell_power(ivec3 cell, vec3 power)
{
    powers[cell_number(cell)] = power.r + power.g + power.b;
}
