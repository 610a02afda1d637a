// SPDX-License-Identifier: GPL-3.0-or-later
// The paper's propagation as published (OPV, Algorithm 1): every node in every iteration, the depths
// of four lights in one texel, one coefficient for all colours. For comparison.
#version 450 core
#include "lib/depth.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    // offset.x: one after the last source; y: source to take out of the result, -1: iterate; z: the
    // first source
    gpu_lattice_pass stage;
};

layout(binding = SLOT_DEPTH_BEFORE) uniform sampler3D depth_before; // below 0: not reached yet
layout(binding = SLOT_OUTPUT, rgba16f) writeonly uniform image3D depth_image;

float grey(vec3 p)
{
    return dot(extinction_at(p), vec3(1.0 / 3.0));
}

// Depth of one light at a node: steps from the light's node, and what the six neighbours have.
float gather(gpu_depth_source source, ivec3 node, vec3 p, float here, vec3 lower, vec3 upper)
{
    light_way way = way_to(source, p);
    ivec3 steps = node - source.node.xyz;
    if (steps == ivec3(0) || way.to <= way.from)
        return here;
    vec3 weights = max(-vec3(sign(steps)) * way.towards, vec3(0.0)); // eq. 7
    vec3 before = mix(upper, lower, greaterThan(steps, ivec3(0)));
    if (any(lessThan(mix(before, vec3(0.0), equal(weights, vec3(0.0))), vec3(0.0))))
        return -1.0;
    float sum = weights.x + weights.y + weights.z;
    return here + (sum > 0.0 ? dot(weights, before) / sum : 0.0); // eq. 6
}

vec4 before_at(ivec3 node, int tile)
{
    bool inside = all(greaterThanEqual(node, ivec3(0))) &&
                  all(lessThan(node, frame.lattice_dims.xyz));
    return inside ? texelFetch(depth_before, node + ivec3(0, 0, tile), 0) : vec4(-1.0);
}

void iterate(ivec3 node)
{
    int tile = node.z / frame.lattice_dims.z * frame.lattice_dims.z;
    int first = stage.offset.z + 4 * (node.z / frame.lattice_dims.z);
    node.z -= tile;
    if (first >= stage.offset.x || any(greaterThanEqual(node, frame.lattice_dims.xyz)))
        return;
    vec4 texel = before_at(node, tile);
    vec4 lower[3], upper[3];
    for (int i = 0; i < 3; ++i) {
        ivec3 along = ivec3(i == 0, i == 1, i == 2);
        lower[i] = before_at(node - along, tile);
        upper[i] = before_at(node + along, tile);
    }
    vec3 p = node_position(node);
    float here = grey(p) * frame.lattice_lower.w;
    for (int i = 0; i < 4; ++i)
        if (texel[i] < 0.0 && first + i < stage.offset.x)
            texel[i] = gather(sources[first + i], node, p, here,
                              vec3(lower[0][i], lower[1][i], lower[2][i]),
                              vec3(upper[0][i], upper[1][i], upper[2][i]));
    imageStore(depth_image, node + ivec3(0, 0, tile), min(texel, vec4(65504.0)));
}

void main()
{
    ivec3 node = ivec3(gl_GlobalInvocationID);
    int number = stage.offset.y;
    if (number < 0) {
        iterate(node);
        return;
    }
    if (any(greaterThanEqual(node, frame.lattice_dims.xyz)))
        return;
    gpu_depth_source source = sources[number];
    vec3 p = node_position(node);
    light_way way = way_to(source, p);
    int place = number - stage.offset.z;
    float tau = max(before_at(node, place / 4 * frame.lattice_dims.z)[place % 4], 0.0);
    // The first cell has a depth at no distance.
    float way_length = max(way.to - way.from, frame.lattice_lower.w);
    imageStore(depth_image, node + source.tile.xyz, depth_texel(vec3(tau), way_length, p));
}
