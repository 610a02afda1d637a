// SPDX-License-Identifier: GPL-3.0-or-later
// The power that a lattice pass leaves in flight, summed a group; every thread of it takes part.
// Needs the stage's block, with the pass.

layout(std430, binding = SLOT_POWERS) writeonly buffer powers_block
{
    float powers[]; // W of all colours, a group of the whole lattice
};

const uint GROUP_SIZE = uint(GROUP_LANES * GROUP_CELLS * GROUP_CELLS);

shared float group_powers[GROUP_SIZE];

void sum_power(float mine)
{
    uint lane = gl_LocalInvocationIndex;
    group_powers[lane] = mine;
    for (uint count = GROUP_SIZE / 2u; count > 0u; count /= 2u) {
        barrier();
        if (lane < count)
            group_powers[lane] += group_powers[lane + count];
    }
    if (lane == 0u) {
        uvec3 groups = gl_NumWorkGroups;
        uint layer = gl_WorkGroupID.z + uint(stage.slab.z) / uint(GROUP_CELLS);
        powers[(layer * groups.y + gl_WorkGroupID.y) * groups.x + gl_WorkGroupID.x] =
            group_powers[0];
    }
}
