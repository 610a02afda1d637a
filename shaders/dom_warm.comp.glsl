// SPDX-License-Identifier: GPL-3.0-or-later
// What iterations begin with, of the lattice around or one of the last run: its light at the cells that
// are within it, without the world's own, and the radiance of surfaces.
#version 450 core
#include "lib/ordinates.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage; // offset.x: 1: the world's own light, as it is now, is in it; y: 1: all
                            // lattices stand one above the other
};

layout(std140, binding = SLOT_LEVEL_BEFORE) uniform before_block
{
    gpu_field before;
};

layout(binding = SLOT_CUTS) uniform usampler3D cell_cuts;
layout(binding = SLOT_ANGULAR) uniform sampler3D light; // moments
layout(binding = SLOT_CELL_WALLS) uniform sampler3D walls;
layout(binding = SLOT_MOMENTS) uniform sampler3D world_moments;

layout(binding = SLOT_OUTPUT, rgba16f) writeonly uniform image3D moments_image;
layout(binding = SLOT_OUTPUT + 1, rgba16f) writeonly uniform image3D wall_image;

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, stage.slab.z);
    if (!in_level(cell) || cell.z >= stage.slab.w)
        return;
    vec3 at = (cell_centre(level, cell) - before.lower.xyz) / before.lower.w;
    ivec3 nearest = ivec3(floor(at)), low = ivec3(floor(at - 0.5));
    if (!in_field(before, nearest))
        return;
    ivec3 stands = ivec3(0, 0, before.dims.w * stage.offset.y);
    vec3 f = at - 0.5 - vec3(low), sums[MOMENTS];
    for (int m = 0; m < MOMENTS; ++m)
        sums[m] = vec3(0.0);
    for (int corner = 0; corner < 8; ++corner) {
        ivec3 side = ivec3(corner & 1, corner >> 1 & 1, corner >> 2);
        vec3 each = mix(1.0 - f, f, vec3(side));
        ivec3 from = clamp(low + side, ivec3(0), before.dims.xyz - 1) + stands;
        for (int m = 0; m < MOMENTS; ++m)
            sums[m] += each.x * each.y * each.z * texelFetch(light, moment_texel_of(before, from, m), 0).rgb;
    }
    for (int m = 0; m < MOMENTS; ++m) {
        if (stage.offset.x != 0)
            sums[m] -= texelFetch(world_moments, moment_texel(cell, m), 0).rgb;
        imageStore(moments_image, moment_texel(cell, m), fit(sums[m], 0.0));
    }
    vec3 wall = texelFetch(walls, nearest + stands, 0).rgb;
    imageStore(wall_image, cell, fit(texelFetch(cell_cuts, cell, 0).r != 0u ? wall : vec3(0.0), 0.0));
}
