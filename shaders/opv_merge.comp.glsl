// SPDX-License-Identifier: GPL-3.0-or-later
// The samples of a lamp with extent made one: -log of the mean of their transmittances.
#version 450 core
#include "lib/depth.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage; // offset.x: source of the lamp itself; y: how many follow, its samples
};

layout(binding = SLOT_DEPTH_BEFORE) uniform sampler3D depth_before; // of the samples
layout(binding = SLOT_OUTPUT, rgba16f) writeonly uniform image3D depth_image;

void main()
{
    ivec3 node = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(node, frame.lattice_dims.xyz)))
        return;
    vec3 p = node_position(node);
    int count = stage.offset.y;
    vec3 depths[EXTENDED_SAMPLES];
    vec3 least = vec3(1e30); // keeps the sum from underflow
    for (int i = 0; i < count; ++i) {
        gpu_depth_source s = sources[stage.offset.x + 1 + i];
        light_way way = way_to(s, p);
        depths[i] = texelFetch(depth_before, node + s.tile.xyz, 0).rgb * (way.to - way.from);
        least = min(least, depths[i]);
    }
    vec3 sum = vec3(0.0);
    for (int i = 0; i < count; ++i)
        sum += exp(least - depths[i]);
    vec3 tau = least - log(sum / float(count));
    gpu_depth_source lamp = sources[stage.offset.x];
    light_way way = way_to(lamp, p);
    imageStore(depth_image, node + lamp.tile.xyz, depth_texel(tau, way.to - way.from, p));
}
