// SPDX-License-Identifier: GPL-3.0-or-later
// Light along some ordinates passes one slice of cells. What enters a cell, a column of light as wide as
// the cell, leaves it by its far side, for up to four cells of the next slice, as the column overlaps
// with these; each of the ways between is one of the 26 links, so that a surface that cuts it blocks the
// light, and sends what it reflects in its place. On its way through the cell light is dimmed, and the
// source adds to it, which varies linearly along the way; the cell's mean follows from what came, what
// went and what the source gave: nothing is lost, however thick the cell is.
#version 450 core
#include "lib/ordinates.glsl"

layout(local_size_x = 4 * GROUP_PIXELS, local_size_y = GROUP_PIXELS) in;

// Number of the slice, from where light enters; first ordinate; their major axis; 1: the world's own
// light on its way into the lattice, 2: also that of surfaces around it, 0: light from sources in it.
layout(location = 0) uniform ivec4 pass;
// The lattice around, -1: none; how many tiles of ordinates stand along z in its textures.
layout(location = 1) uniform ivec2 around;

layout(binding = SLOT_CELL_EXTINCT) uniform sampler3D cell_extinct;
layout(binding = SLOT_CUTS) uniform usampler3D cell_cuts;
layout(binding = SLOT_CELL_WALLS) uniform sampler3D cell_walls; // radiance
layout(binding = SLOT_ANGULAR) uniform sampler3D sources;       // w: 1 where there is a medium
layout(binding = SLOT_SLICE) uniform sampler3D slice_before;
layout(binding = SLOT_MEANS_AROUND) uniform sampler3D means_around;
layout(binding = SLOT_SURROUNDINGS) uniform sampler2DArray surroundings;

layout(binding = SLOT_OUTPUT, rgba16f) writeonly uniform image3D mean_image;
layout(binding = SLOT_OUTPUT + 1, rgba16f) writeonly uniform image3D slice_image;
layout(binding = SLOT_OUTPUT + 2, rgba16f) writeonly uniform image3D hits_image;

// Software runs through both sides of every branch, but not through loops that nobody enters: what is
// seldom needed stands in loops.

// Radiance that comes from a cell beyond the lattice's side: of the lattice around, or of the world and of
// surfaces there.
vec3 outside(ivec3 cell, int number)
{
    vec3 light = ordinates.list[number].world.rgb * float(min(pass.w, 1));
    for (int i = pass.w; i == 2; i = 0) {
        vec4 p = vec4(cell_centre(level, cell), 1.0);
        vec2 at = vec2(dot(p, ordinates.list[number].map_u), dot(p, ordinates.list[number].map_v));
        light = textureLod(surroundings, vec3(at, number), 0.0).rgb;
    }
    for (int i = around.x; i >= 0; i = -1) {
        gpu_field field = frame.fields[i];
        vec3 at = (cell_centre(level, cell) - field.lower.xyz) / field.lower.w;
        if (any(lessThan(at, vec3(0.0))) || any(greaterThan(at, vec3(field.dims.xyz))))
            continue;
        at = clamp(at, vec3(0.5), vec3(field.dims.xyz) - 0.5);
        at.yz += vec2(number / around.y, number % around.y) * vec2(field.dims.yz);
        light = textureLod(means_around, at / vec3(textureSize(means_around, 0)), 0.0).rgb;
    }
    return light;
}

// Radiance on its way into a cell by one of the four ways.
vec3 comes_from(int axis, int along, ivec2 from, ivec2 sides, int number)
{
    ivec2 within = clamp(from, ivec2(0), sides - 1);
    vec3 light = texelFetch(slice_before, ivec3(within, number), 0).rgb;
    for (int i = pass.x > 0 && from == within ? 1 : 0; i < 1; ++i)
        light = outside(placed(axis, along, from), number);
    return light;
}

// How much the source grows along the way through a cell, from the cells around.
vec3 growth(bool wanted, ivec3 cell, int number, vec3 way, vec4 own, uint cuts)
{
    vec3 sum = vec3(0.0);
    for (int axis = wanted ? 0 : 3; axis < 3; ++axis) {
        ivec3 offset = ivec3(axis == 0, axis == 1, axis == 2);
        ivec3 before = max(cell - offset, ivec3(0)), after = min(cell + offset, level.dims.xyz - 1);
        vec4 low = texelFetch(sources, ordinate_texel(before, number), 0);
        vec4 high = texelFetch(sources, ordinate_texel(after, number), 0);
        float has_low = before == cell || (cuts >> (13 + axis) & 1u) != 0u ? 0.0 : low.w;
        float has_high = after == cell || (cuts >> axis & 1u) != 0u ? 0.0 : high.w;
        vec3 slope = (high.rgb - own.rgb) * has_high + (own.rgb - low.rgb) * has_low;
        sum += dot(way, vec3(offset)) * slope / max(has_low + has_high, 1.0);
    }
    // The source is nowhere on the way of another sign than in the middle.
    return clamp(sum, -2.0 * abs(own.rgb), 2.0 * abs(own.rgb));
}

void main()
{
    int axis = pass.z, number = pass.y + int(gl_WorkGroupID.z);
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    ivec3 dims = axis == 0 ? level.dims.xyz : (axis == 1 ? level.dims.yzx : level.dims.zxy);
    if (any(greaterThanEqual(at, dims.yz)))
        return;
    vec3 direction = ordinates.list[number].direction.xyz;
    vec3 way = turned(axis, direction);
    float long_ = 1.0 / abs(way.x); // the way through a slice, in cells
    ivec3 cell = placed(axis, way.x > 0.0 ? pass.x : dims.x - 1 - pass.x, at);
    uint cuts = texelFetch(cell_cuts, cell, 0).r;

    vec2 aside = abs(way.yz) * long_;
    ivec2 turn = ivec2(sign(way.yz));
    vec3 enters = vec3(0.0);
    vec4 shares = vec4(1.0 - aside.x, aside.x, 1.0 - aside.x, aside.x) *
                  vec4(1.0 - aside.yy, aside.yy);
    int before = (way.x > 0.0 ? pass.x : dims.x - 1 - pass.x) - int(sign(way.x));
    for (int i = 0; i < 4; ++i)
        enters += shares[i] * comes_from(axis, before, at - turn * aside_of(i), dims.yz, number);
    float stopped = 0.0;
    for (int i = cuts != 0u ? 0 : 4; i < 4; ++i) {
        if ((cuts & ordinates.list[number].links_in[i]) != 0u) {
            vec3 comes = comes_from(axis, before, at - turn * aside_of(i), dims.yz, number);
            enters += shares[i] * (texelFetch(cell_walls, cell, 0).rgb - comes);
        }
        if ((cuts & ordinates.list[number].links_out[i]) != 0u)
            stopped += shares[i];
    }
    enters = pass.w != 0 ? max(enters, vec3(0.0)) : enters;

    vec3 depth = texelFetch(cell_extinct, cell, 0).rgb * (level.lower.w * long_);
    vec3 through = exp(-depth);
    vec4 source =
        pass.w != 0 ? vec4(0.0) : texelFetch(sources, ordinate_texel(cell, number), 0);
    vec3 gives = mix(1.0 - through, depth * (1.0 - 0.5 * depth), lessThan(depth, vec3(1e-3)));
    bool thick = max(depth.r, max(depth.g, depth.b)) > 0.02 && source.w > 0.0;
    vec3 grows = growth(thick, cell, number, direction * long_, source, cuts);
    vec3 leaves = enters * through + source.rgb * gives +
                  grows * (0.5 * (1.0 + through) - gives / max(depth, vec3(1e-3)));
    // Of thin cells to the second order.
    vec3 mean = mix(source.rgb + (enters - leaves) / max(depth, vec3(1e-6)),
                    enters * (1.0 - 0.5 * depth) + source.rgb * (0.5 * depth),
                    lessThan(depth, vec3(3e-3)));
    imageStore(slice_image, ivec3(at, number), fit_along(leaves, 0.0, cell, number));
    imageStore(mean_image, ordinate_texel(cell, number), fit_along(mean, 0.0, cell, number));
    for (int i = cuts != 0u && pass.w == 0 ? 0 : 1; i < 1; ++i)
        imageStore(hits_image, ordinate_texel(cell, number), fit(leaves * stopped, stopped));
}
