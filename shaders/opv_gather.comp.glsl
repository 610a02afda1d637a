// SPDX-License-Identifier: GPL-3.0-or-later
// The paper's propagation, kept for comparison: a node gathers from its neighbours on the light's
// side (OPV, eq. 6 and 7; the factor 1 - K_t(X) of the weights cancels in their mean). Literally, it
// adds K(X) a cell whatever the direction; corrected, by the length of the step: neighbours weighted
// by |w_i| have their mean at X + towards * h / sum |w_i|.
#version 450 core
#include "lib/depth.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    // offset.x: sources; y: steps along the axes from the light to the nodes of this wavefront; z: 1
    // literally
    gpu_lattice_pass stage;
};

layout(binding = SLOT_DEPTH_BEFORE) uniform sampler3D depth_before;
layout(binding = SLOT_OUTPUT, rgba16f) writeonly uniform image3D depth_image;

// The length that a depth is kept over: the paper's first cell has a depth at no distance.
float kept_over(light_way way)
{
    float way_length = way.to - way.from;
    return stage.offset.z != 0 ? max(way_length, frame.lattice_lower.w) : way_length;
}

vec4 gather(gpu_depth_source source, ivec3 node)
{
    vec3 p = node_position(node);
    light_way way = way_to(source, p);
    float h = frame.lattice_lower.w;
    ivec3 steps = node - source.node.xyz;
    vec3 around = vec3(0.0);
    float weights = 0.0;
    for (int i = 0; i < 3; ++i) {
        float weight = max(-float(sign(steps[i])) * way.towards[i], 0.0);
        if (weight <= 0.0 || way.to <= way.from)
            continue;
        ivec3 neighbour = node;
        neighbour[i] -= sign(steps[i]);
        vec3 before = texelFetch(depth_before, neighbour + source.tile.xyz, 0).rgb;
        if (stage.offset.z != 0)
            before *= kept_over(way_to(source, node_position(neighbour)));
        around += weight * before;
        weights += weight;
    }
    vec3 here = extinction_at(p);
    vec3 tau = here * (stage.offset.z != 0 ? h : way.to - way.from);
    if (weights > 0.0) {
        around /= weights;
        float step_length = min(h / weights, way.to - way.from);
        tau = stage.offset.z != 0
                  ? here * h + around
                  : here * step_length + around * (way.to - way.from - step_length);
    }
    return depth_texel(tau, kept_over(way), p);
}

void main()
{
    ivec3 node = ivec3(gl_GlobalInvocationID);
    int number = node.z / 2;
    if (number >= stage.offset.x)
        return;
    gpu_depth_source source = sources[number];
    ivec2 steps = abs(node.xy - source.node.xy);
    int rest = stage.offset.y - steps.x - steps.y;
    bool below = (node.z & 1) != 0;
    node.z = source.node.z + (below ? -rest : rest);
    if (rest < 0 || (rest == 0 && below) || any(lessThan(node, ivec3(0))) ||
        any(greaterThanEqual(node, frame.lattice_dims.xyz)))
        return;
    imageStore(depth_image, node + source.tile.xyz, gather(source, node));
}
