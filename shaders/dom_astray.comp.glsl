// SPDX-License-Identifier: GPL-3.0-or-later
// In the depths towards the lamps light that a forward peak has scattered counts as straight. But it comes from
// beside the straight way, and from where nothing scatters comes none: it has left the medium. Of what is
// counted at a node as scattered by the peak, once or more, this is the share that is there: what scatters along
// ways as far beside as such light comes from, over what scatters along the straight one. Kept in alpha.
#version 450 core
#include "lib/depth.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage; // offset.x: source
};

layout(binding = SLOT_OUTPUT, rgba16f) uniform image3D depth_image;

const int STEPS = 12, SIDES = 4;

// What the peak scatters at a point per metre, and its g.
vec2 peak_at(vec3 p)
{
    vec4 scatter = vec4(0.0);
    if (in_box(p, frame.medium_lower.xyz, frame.medium_upper.xyz))
        scatter = textureLod(medium_scatter, medium_coordinate(p), 0.0);
    if (fog_exists())
        add_fog(scatter.rgb, scatter.a);
    return vec2(forward_share(scatter.a) * dot(scatter.rgb, vec3(1.0 / 3.0)), scatter.a);
}

void main()
{
    ivec3 node = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, stage.slab.z);
    if (any(greaterThanEqual(node, frame.lattice_dims.xyz)) || node.z >= stage.slab.w)
        return;
    gpu_depth_source source = sources[stage.offset.x];
    float border = 1e-3 * frame.medium_lower.w; // else rounding tells whether nodes on the box's sides are in it
    vec3 p = clamp(node_position(node), frame.medium_lower.xyz + border, frame.medium_upper.xyz - border);
    light_way way = way_to(source, p);
    float dt = (way.to - way.from) / float(STEPS);
    float straight = 0.0, g = 0.0;
    for (int i = 0; i < STEPS; ++i) {
        vec2 peak = peak_at(p + (way.from + (float(i) + 0.5) * dt) * way.towards);
        straight += peak.x;
        g += peak.x * peak.y;
    }
    float there = 1.0;
    if (straight * dt > 1e-4) {
        float sine = peak_sine(peak_before(g / straight, straight * dt));
        // To a lamp nearby the ways come together again.
        float nearness = source.point.w == 0.0 ? 1.0 / max(length(source.point.xyz - p), 1e-9) : 0.0;
        vec3 u = across(way.towards), v = cross(way.towards, u);
        float beside = 0.0;
        for (int k = 0; k < STEPS * SIDES; ++k) {
            float along = way.from + (float(k / SIDES) + 0.5) * dt;
            float turn = float(k) * 2.39996323; // the golden angle
            float off = sine * along * max(1.0 - along * nearness, 0.0);
            beside += peak_at(p + along * way.towards + off * (cos(turn) * u + sin(turn) * v)).x;
        }
        there = min(beside / (float(SIDES) * straight), 4.0);
    }
    ivec3 texel = node + source.tile.xyz;
    imageStore(depth_image, texel, vec4(imageLoad(depth_image, texel).rgb, there));
}
