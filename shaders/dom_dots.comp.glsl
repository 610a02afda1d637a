// SPDX-License-Identifier: GPL-3.0-or-later
// Products of the newest residual with all that are kept, and the newest result's with itself, a row of
// cells each, colours apart.
#version 450 core
#include "lib/ordinates.glsl"

layout(local_size_x = GROUP_PIXELS, local_size_y = GROUP_PIXELS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage; // offset.x: the newest; y: how many are kept
};

layout(binding = SLOT_HISTORY) uniform sampler3D residuals[HISTORY];
layout(binding = SLOT_MOMENTS) uniform sampler3D newest;

layout(std430, binding = SLOT_DOTS) writeonly buffer dots_block
{
    vec4 dots[]; // HISTORY + 1 a row
};

vec3 residual(int number, ivec3 texel)
{
    return number == 0   ? texelFetch(residuals[0], texel, 0).rgb
           : number == 1 ? texelFetch(residuals[1], texel, 0).rgb
           : number == 2 ? texelFetch(residuals[2], texel, 0).rgb
                         : texelFetch(residuals[3], texel, 0).rgb;
}

void main()
{
    ivec2 row = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(row, level.dims.yz)))
        return;
    vec3 sums[HISTORY + 1];
    for (int i = 0; i <= HISTORY; ++i)
        sums[i] = vec3(0.0);
    for (int x = 0; x < level.dims.x * MIXED; ++x) {
        ivec3 texel = ivec3(x, row);
        vec3 own = residual(stage.offset.x, texel);
        for (int i = 0; i < HISTORY; ++i)
            if (i < stage.offset.y)
                sums[i] += own * residual(i, texel);
        vec3 result = texelFetch(newest, texel, 0).rgb;
        sums[HISTORY] += result * result;
    }
    int start = (row.y * level.dims.y + row.x) * (HISTORY + 1);
    for (int i = 0; i <= HISTORY; ++i)
        dots[start + i] = vec4(sums[i], 0.0);
}
