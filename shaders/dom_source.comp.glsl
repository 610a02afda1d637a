// SPDX-License-Identifier: GPL-3.0-or-later
// The source along every ordinate, of every cell: what light was first scattered there, and what is
// scattered of the radiance that the last iteration found. In units of radiance: per extinction.
#version 450 core
#include "lib/ordinates.glsl"
#include "lib/harmonics.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage;
};

layout(binding = SLOT_CELL_EXTINCT) uniform sampler3D cell_extinct;
layout(binding = SLOT_CELL_ALBEDO) uniform sampler3D cell_absorbed;
layout(binding = SLOT_MOMENTS) uniform sampler3D moments;
layout(binding = SLOT_MOMENTS + 1) uniform sampler3D first;

layout(binding = SLOT_OUTPUT, rgba16f) writeonly uniform image3D source_image;

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, stage.slab.z);
    if (!in_level(cell) || cell.z >= stage.slab.w)
        return;
    vec3 extinct = texelFetch(cell_extinct, cell, 0).rgb;
    float medium = max(extinct.r, max(extinct.g, extinct.b)) > 0.0 ? 1.0 : 0.0;
    vec4 absorbed = texelFetch(cell_absorbed, cell, 0);
    vec3 albedo = 1.0 - absorbed.rgb;
    vec4 bands = scaled_bands(absorbed.w);
    vec3 q[MOMENTS];
    for (int m = 0; m < MOMENTS; ++m)
        q[m] = texelFetch(first, moment_texel(cell, m), 0).rgb +
               albedo * bands[band_of(m)] * texelFetch(moments, moment_texel(cell, m), 0).rgb;
    for (int k = 0; k < ordinates.count.x; ++k) {
        vec3 sum = vec3(0.0);
        for (int i = 0; i < MOMENTS / 4; ++i) {
            vec4 y = ordinates.list[k].harmonics[i];
            sum += y.x * q[4 * i] + y.y * q[4 * i + 1] + y.z * q[4 * i + 2] + y.w * q[4 * i + 3];
        }
        imageStore(source_image, ordinate_texel(cell, k), fit_along(sum * medium, medium, cell, k));
    }
}
