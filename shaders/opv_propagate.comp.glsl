// SPDX-License-Identifier: GPL-3.0-or-later
// Optical depths carried outwards from a source, brick by brick. A node marches no further than to
// the first point whose neighbours all lie in bricks nearer to the light, and takes the rest from
// there. Bricks are as far from the light as the sum of their distances along the axes; all that are
// equally far are one dispatch, so each node is computed once.
#version 450 core
#include "lib/depth.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage; // offset.x: first group
};

layout(std430, binding = SLOT_DEPTH_GROUPS) readonly buffer groups_block
{
    ivec4 groups[]; // first node; w: source
};

layout(binding = SLOT_DEPTH_BEFORE) uniform sampler3D depth_before; // the image, as it was
layout(binding = SLOT_OUTPUT, rgba16f) writeonly uniform image3D depth_image;

// Nodes that a look-up stays clear of those that are not computed yet: what the sampler rounds.
const float CLEAR = 0.002;

// How far along the way all nodes around a point are in bricks nearer to the light.
float way_to_nearer_bricks(ivec3 steps, vec3 towards)
{
    ivec3 start = steps & ~(BRICK_NODES - 1);
    vec3 way = (vec3(steps - start) + (1.0 + CLEAR)) * frame.lattice_lower.w /
               max(abs(towards), vec3(1e-20));
    way = mix(way, vec3(1e30), equal(start, ivec3(0)));
    return min(way.x, min(way.y, way.z));
}

vec3 before_at(gpu_depth_source source, ivec3 node, vec3 way)
{
    // In nodes, from the node: the world's coordinates have no digits left far from its origin. Along
    // an axis across the way no further from the light than the node itself.
    vec3 at = vec3(node) + way / frame.lattice_lower.w;
    vec3 side = mix(vec3(-1.0), vec3(1.0), greaterThan(node, source.node.xyz));
    at = vec3(node) - side * max(side * (vec3(node) - at), vec3(CLEAR));
    at = clamp(at, vec3(CLEAR), vec3(frame.lattice_dims.xyz - 1) - CLEAR);
    vec3 texel = at + vec3(source.tile.xyz) + 0.5;
    return textureLod(depth_before, texel / vec3(textureSize(depth_before, 0)), 0.0).rgb;
}

// As medium_tau, over a stretch too short to gain from what empty bricks save.
vec3 short_tau(vec3 origin, vec3 direction, float from, float to)
{
    if (from >= to)
        return vec3(0.0);
    int count = max(int(ceil((to - from) / frame.medium_lower.w)), 1);
    float dt = (to - from) / float(count);
    vec3 scale = 1.0 / (frame.medium_lower.w * vec3(textureSize(medium_extinct, 0)));
    vec3 at = (origin + direction * (from + 0.5 * dt) - frame.medium_lower.xyz) * scale;
    vec3 along = direction * dt * scale;
    vec3 sum = vec3(0.0);
    for (int k = 0; k < count; ++k, at += along)
        sum += textureLod(medium_extinct, at, 0.0).rgb;
    return sum * dt;
}

void main()
{
    ivec4 group = groups[stage.offset.x + int(gl_WorkGroupID.x)];
    ivec3 node = group.xyz + ivec3(gl_LocalInvocationID);
    if (any(lessThan(node, ivec3(0))) || any(greaterThanEqual(node, frame.lattice_dims.xyz)))
        return;
    gpu_depth_source source = sources[group.w];
    vec3 p = node_position(node);
    light_way way = way_to(source, p);
    // Nodes from the light's cell.
    ivec3 steps = max(node - source.node.xyz - 1, source.node.xyz - node);
    float end = min(way_to_nearer_bricks(steps, way.towards), way.to);
    vec3 tau = short_tau(p, way.towards, way.from, end);
    if (end < way.to)
        tau += before_at(source, node, way.towards * end) * (way.to - max(end, way.from));
    imageStore(depth_image, node + source.tile.xyz, depth_texel(tau, way.to - way.from, p));
}
