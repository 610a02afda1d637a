// SPDX-License-Identifier: GPL-3.0-or-later
// The world's uncollided light at every node of its lattice, as spherical harmonics of bands 0 and
// 1 per colour: the sum over the world's samples of radiance * solid angle * transmittance.
#version 450 core
#include "lib/medium.glsl"
#include "lib/shadow.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage;
};

layout(binding = SLOT_OUTPUT, rgba16f) writeonly uniform image3D sky_image[3];

const uint SKY_SAMPLES = 64u;

void main()
{
    ivec3 node = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, stage.slab.z);
    if (any(greaterThanEqual(node, frame.sky_dims.xyz)) || node.z >= stage.slab.w)
        return;
    vec3 p = frame.sky_lower.xyz + vec3(node) * frame.sky_lower.w;
    float step_length = 2.0 * frame.medium_lower.w;
    vec4 red = vec4(0.0), green = vec4(0.0), blue = vec4(0.0);
    // Of many samples a node takes every so-manieth, which are spread as evenly as all are; which,
    // differs from node to node.
    uint every = max(frame.world.y / SKY_SAMPLES, 1u);
    uint start = hash(uint(node.x) + hash(uint(node.y) + hash(uint(node.z)))) % every;
    for (uint i = start; i < frame.world.y; i += every) {
        gpu_light_sample s = light_sample_at(frame.world.x + i);
        vec3 towards = s.position.xyz;
        int first = int(s.position.w);
        if (first >= 0 && shadow_medium(first, first + int(frame.world.w) - 1, p, 1.5) == 0.0)
            continue;
        vec3 light = s.weight.rgb * distant_transmittance(p, towards, step_length, 0.5) *
                     float(every);
        // Y_0 = sqrt(1 / 4 pi), Y_1 = sqrt(3 / 4 pi) (y, z, x); kept as mean and flux vector:
        // the constants are put back in sky_scatter().
        vec4 basis = vec4(1.0, -towards);
        red += light.r * basis;
        green += light.g * basis;
        blue += light.b * basis;
    }
    // Half floats end at 65504, and infinity times nothing is NaN.
    const vec4 most = vec4(65504.0);
    imageStore(sky_image[0], node, clamp(red, -most, most));
    imageStore(sky_image[1], node, clamp(green, -most, most));
    imageStore(sky_image[2], node, clamp(blue, -most, most));
}
