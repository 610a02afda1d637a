// SPDX-License-Identifier: GPL-3.0-or-later
// Brings the areas that a set of maps found into their lattice: of all sets, the greatest.
#version 450 core
#include "lib/fuzzy.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage; // offset.x: tiles in a row of the sums
};

layout(binding = SLOT_AREAS) uniform sampler2D sums[2];

layout(binding = SLOT_OUTPUT, rgba16f) uniform image3D areas_image[2];

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, stage.slab.z);
    if (!in_blockers(cell) || cell.z >= stage.slab.w)
        return;
    ivec2 texel = tiled_texel(cell, blockers_dims(), stage.offset.x);
    for (int i = 0; i < 2; ++i) {
        vec4 sum = texelFetch(sums[i], texel, 0);
        // What stands one behind another in a cell blocks its face once.
        sum /= max(max(sum.x, sum.y), max(sum.z, 1.0));
        imageStore(areas_image[i], cell, max(imageLoad(areas_image[i], cell), sum));
    }
}
