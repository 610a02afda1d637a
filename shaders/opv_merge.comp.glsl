// SPDX-License-Identifier: GPL-3.0-or-later
// The samples of a lamp with extent made one: the mean extinction with which, each from as far as it is, they
// have the mean of their transmittances.
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
    float lengths[EXTENDED_SAMPLES];
    float all_ = 0.0;
    vec3 least = vec3(1e30); // keeps sums from underflow
    for (int i = 0; i < count; ++i) {
        gpu_depth_source s = sources[stage.offset.x + 1 + i];
        light_way way = way_to(s, p);
        lengths[i] = way.to - way.from;
        all_ += lengths[i];
        depths[i] = texelFetch(depth_before, node + s.tile.xyz, 0).rgb * lengths[i];
        least = min(least, depths[i]);
    }
    vec3 sum = vec3(0.0);
    for (int i = 0; i < count; ++i)
        sum += exp(least - depths[i]);
    gpu_depth_source lamp = sources[stage.offset.x];
    vec3 mean = extinction_at(p);
    if (all_ > 1e-4 * frame.lattice_lower.w) {
        // exp(-mean length) has a greater mean over lengths than their mean has: Newton's method starts
        // with too little, and never goes beyond.
        mean = (least - log(sum / float(count))) * (float(count) / all_);
        for (int step_ = 0; step_ < 4; ++step_) {
            vec3 excess = -sum, slope = vec3(0.0);
            for (int i = 0; i < count; ++i) {
                vec3 through = exp(min(least - mean * lengths[i], vec3(80.0)));
                excess += through;
                slope += through * lengths[i];
            }
            mean += excess / max(slope, vec3(1e-30));
        }
    }
    imageStore(depth_image, node + lamp.tile.xyz, vec4(min(mean, vec3(65504.0)), 1.0));
}
