// SPDX-License-Identifier: GPL-3.0-or-later
// What share of the light along each of a cell's 26 links is blocked (LPV, eq. 2), once, before the
// iterations that need it: 8 bits each, those of links 0 to 12 in one texel, of their opposites in
// the next.
#version 450 core
#include "lib/level.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage;
};

layout(binding = SLOT_AREAS) uniform sampler3D areas[2];

layout(binding = SLOT_OUTPUT, rgba32ui) writeonly uniform uimage3D factors_image;

// Spherical harmonics of bands 0 and 1, as x + yzw . direction, of the lobes of clamped cosines
// around surfaces' normals: they block what runs against these.
vec4 blocking(vec3 at)
{
    at /= vec3(textureSize(areas[0], 0));
    vec4 front = textureLod(areas[0], at, 0.0), back = textureLod(areas[1], at, 0.0);
    vec4 b = vec4(0.25 * (front.w + back.w), 0.5 * (front.xyz - back.xyz));
    return b / max(b.x + length(b.yzw), 1.0);
}

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, stage.slab.z);
    if (!in_level(cell) || cell.z >= stage.slab.w)
        return;
    for (int backwards = 0; backwards < 2; ++backwards) {
        uvec4 factors = uvec4(0u);
        for (int i = 0; i < 13; ++i) {
            ivec3 link = backwards == 0 ? LINKS[i] : -LINKS[i];
            // Between the cells' centres, in the lattice that stands half a cell lower.
            vec4 b = blocking(vec3(cell) + 1.0 + 0.5 * vec3(link));
            float share = clamp(b.x - dot(b.yzw, vec3(link)) / link_length(i), 0.0, 1.0);
            factors[i >> 2] |= uint(share * 255.0 + 0.5) << (8 * (i & 3));
        }
        imageStore(factors_image, ivec3(2 * cell.x + backwards, cell.yz), factors);
    }
}
