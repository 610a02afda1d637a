// SPDX-License-Identifier: GPL-3.0-or-later
// Optical depth T(X, S) from every node of the lattice to one light (OPV, eq. 4), by an exact march
// through the medium. A light with extent is seen through the mean of several transmittances.
#version 450 core
#include "lib/medium.glsl"
#include "lib/light.glsl"

layout(local_size_x = GROUP_CELLS, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage; // offset.x: light, offset.y: samples to average, offset.zw: tile
};

layout(binding = SLOT_OUTPUT, rgba16f) writeonly uniform image3D tau_image;

vec3 depth_towards(gpu_light light, vec3 point, vec3 p)
{
    if (light.info.x == uint(LIGHT_SUN))
        return medium_tau(p, point, 1e30, frame.medium_lower.w, 0.5);
    vec3 v = point - p;
    float distance = max(length(v), 1e-9);
    return medium_tau(p, v / distance, distance, frame.medium_lower.w, 0.5);
}

void main()
{
    ivec3 node = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, stage.slab.z);
    if (any(greaterThanEqual(node, frame.lattice_dims.xyz)) || node.z >= stage.slab.w)
        return;
    vec3 p = frame.lattice_lower.xyz + vec3(node) * frame.lattice_lower.w;
    gpu_light light = lights[stage.offset.x];
    vec3 tau;
    int count = stage.offset.y;
    if (count == 1) {
        tau = depth_towards(light, light.position.xyz, p);
    } else {
        // -log of the mean transmittance, kept from underflow by the smallest depth.
        vec3 depths[8];
        vec3 least = vec3(1e30);
        for (int i = 0; i < count; ++i) {
            uint index = light.samples.x + uint(i) * light.samples.y / uint(count);
            depths[i] = depth_towards(light, light_samples[index].position.xyz, p);
            least = min(least, depths[i]);
        }
        vec3 sum = vec3(0.0);
        for (int i = 0; i < count; ++i)
            sum += exp(least - depths[i]);
        tau = least - log(sum / float(count));
    }
    // Half floats end at 65504; nothing passes 1000 mean free paths.
    ivec3 texel = node + ivec3(0, stage.offset.z, stage.offset.w);
    imageStore(tau_image, texel, vec4(min(tau, vec3(1000.0)), 0.0));
}
