// SPDX-License-Identifier: GPL-3.0-or-later
// The moments of every cell's mean radiance, from all ordinates; and what the surfaces in it send back of
// the light that met them.
#version 450 core
#include "lib/ordinates.glsl"
#include "lib/cuts.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage; // offset.x: 1: of sources in the lattice; 0: the world's own light, which
                            // has no past and meets no surface here; y: tiles in a row of the reflected
};

layout(binding = SLOT_CUTS) uniform usampler3D cell_cuts;
layout(binding = SLOT_WALLS) uniform sampler3D cell_reflectance;
layout(binding = SLOT_ANGULAR) uniform sampler3D means;
layout(binding = SLOT_HITS) uniform sampler3D hits;
layout(binding = SLOT_MOMENTS) uniform sampler3D moments; // that the iteration began with
layout(binding = SLOT_CELL_WALLS) uniform sampler3D cell_walls; // radiance that it began with
layout(binding = SLOT_CELL_EMISSION) uniform sampler3D cell_emission; // radiance
layout(binding = SLOT_REFLECTED) uniform sampler2D reflected[3];

layout(binding = SLOT_OUTPUT, rgba16f) writeonly uniform image3D moments_image;
layout(binding = SLOT_OUTPUT + 1, rgba16f) writeonly uniform image3D residual_image;
layout(binding = SLOT_OUTPUT + 2, rgba16f) writeonly uniform image3D result_image;

// The radiance of a cell's surfaces: they send out, over the links that they cut, what meets them there,
// by their reflectance, what they reflect of the lights' own light, and what they emit.
vec3 wall_radiance(ivec3 cell)
{
    vec3 meets = vec3(0.0);
    float area = 0.0; // times pi, in faces of cells
    for (int k = 0; k < ordinates.count.x; ++k) {
        vec4 direction = ordinates.list[k].direction;
        float part = direction.w * abs(direction[major_axis(direction.xyz)]);
        vec4 hit = texelFetch(hits, ordinate_texel(cell, k), 0);
        meets += part * hit.rgb;
        area += part * hit.w;
    }
    if (area <= 0.0)
        return vec3(0.0);
    ivec2 texel = tiled_texel(cell, level.dims.xyz, stage.offset.y);
    vec3 first = vec3(texelFetch(reflected[0], texel, 0).x, texelFetch(reflected[1], texel, 0).x,
                      texelFetch(reflected[2], texel, 0).x);
    vec3 emitted = texelFetch(cell_emission, cell, 0).rgb;
    return emitted + (texelFetch(cell_reflectance, cell, 0).rgb * meets +
                      first / (level.lower.w * level.lower.w)) / area;
}

void keep(ivec3 texel, vec3 result, vec3 before)
{
    imageStore(residual_image, texel, fit(result - before, 0.0));
    imageStore(result_image, texel, fit(result, 0.0));
}

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, stage.slab.z);
    if (!in_level(cell) || cell.z >= stage.slab.w)
        return;
    vec3 sums[MOMENTS];
    for (int m = 0; m < MOMENTS; ++m)
        sums[m] = vec3(0.0);
    for (int k = 0; k < ordinates.count.x; ++k) {
        vec3 light = texelFetch(means, ordinate_texel(cell, k), 0).rgb * ordinates.list[k].direction.w;
        for (int i = 0; i < MOMENTS / 4; ++i) {
            vec4 y = ordinates.list[k].harmonics[i];
            sums[4 * i] += y.x * light;
            sums[4 * i + 1] += y.y * light;
            sums[4 * i + 2] += y.z * light;
            sums[4 * i + 3] += y.w * light;
        }
    }
    for (int m = 0; m < MOMENTS; ++m)
        imageStore(moments_image, moment_texel(cell, m), fit(sums[m], 0.0));
    if (stage.offset.x == 0)
        return;
    for (int m = 0; m < MIXED - 1; ++m) {
        vec3 before = texelFetch(moments, moment_texel(cell, m), 0).rgb;
        keep(mixed_texel(cell, m), sums[m], before);
    }
    if (texelFetch(cell_cuts, cell, 0).gb != uvec2(0u))
        keep(mixed_texel(cell, MIXED - 1), wall_radiance(cell), texelFetch(cell_walls, cell, 0).rgb);
}
