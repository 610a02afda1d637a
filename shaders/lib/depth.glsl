// SPDX-License-Identifier: GPL-3.0-or-later
// The lattice of optical depths, as the stages that fill it see it. It holds the depth of the way to
// the light over that way's length in the medium's box: the mean extinction, which changes little
// from node to node and is the same everywhere in a homogeneous medium. Alpha is dom_astray's, 1 without it.
#include "lib/medium.glsl"

layout(std430, binding = SLOT_DEPTH_SOURCES) readonly buffer sources_block
{
    gpu_depth_source sources[];
};

// The way from a point to a source: where it is in the medium's box.
struct light_way
{
    vec3 towards; // unit
    float from, to;
};

light_way way_to(gpu_depth_source source, vec3 p)
{
    light_way way;
    float distance = 1e30;
    way.towards = source.point.xyz;
    if (source.point.w == 0.0) {
        vec3 v = source.point.xyz - p;
        distance = max(length(v), 1e-9);
        way.towards = v / distance;
    }
    vec2 span = ray_box(p, way.towards, frame.medium_lower.xyz, frame.medium_upper.xyz);
    way.from = max(span.x, 0.0);
    way.to = max(min(span.y, distance), way.from);
    return way;
}

vec3 node_position(ivec3 node)
{
    return frame.lattice_lower.xyz + vec3(node) * frame.lattice_lower.w;
}

vec3 extinction_at(vec3 p)
{
    return textureLod(medium_extinct, medium_coordinate(p), 0.0).rgb;
}

// What the lattice holds for a depth. Where the light enters there is no way to take the mean of.
vec4 depth_texel(vec3 tau, float way_length, vec3 p)
{
    vec3 mean = way_length > 1e-4 * frame.lattice_lower.w ? tau / way_length : extinction_at(p);
    return vec4(min(mean, vec3(65504.0)), 1.0); // half floats end there
}
