// SPDX-License-Identifier: GPL-3.0-or-later
// What the next iteration begins with: bands 0 and 1, and the radiance of surfaces, from all results that are kept, so mixed that their
// residuals all but cancel (Anderson, "Iterative Procedures for Nonlinear Integral Equations", J. ACM
// 1965; Walker and Ni, "Anderson Acceleration for Fixed-Point Iterations", SIAM J. Numer. Anal. 2011);
// the others follow from these at once.
#version 450 core
#include "lib/ordinates.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage; // offset.x: how many are kept
};

layout(location = 0) uniform vec3 shares[HISTORY]; // of each, by colours; all together 1

layout(binding = SLOT_HISTORY) uniform sampler3D results[HISTORY];
layout(binding = SLOT_MOMENTS) uniform sampler3D newest;

layout(binding = SLOT_OUTPUT, rgba16f) writeonly uniform image3D moments_image;
layout(binding = SLOT_OUTPUT + 1, rgba16f) writeonly uniform image3D wall_image;

vec4 mixed(ivec3 cell, int number)
{
    vec3 sum = vec3(0.0);
    for (int i = 0; i < HISTORY; ++i)
        if (i < stage.offset.x)
            sum += shares[i] * texelFetch(results[i], mixed_texel(cell, number), 0).rgb;
    return fit(sum, 0.0);
}

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, stage.slab.z);
    if (!in_level(cell) || cell.z >= stage.slab.w)
        return;
    for (int m = 0; m < MOMENTS; ++m) {
        ivec3 texel = moment_texel(cell, m);
        vec4 value = m < MIXED - 1 ? mixed(cell, m) : texelFetch(newest, texel, 0);
        imageStore(moments_image, texel, value);
    }
    imageStore(wall_image, cell, mixed(cell, MIXED - 1));
}
