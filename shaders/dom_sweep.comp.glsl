// SPDX-License-Identifier: GPL-3.0-or-later
// Light along some ordinates passes one slice of cells. What enters a cell, a column of light as wide as
// the cell, leaves it by its far side, for up to four cells of the next slice, as the column overlaps
// with these; each of the ways between is one of the 26 links, so that a surface that cuts it blocks the
// light, and sends what it reflects in its place. On its way through the cell light is dimmed, and the
// source adds to it, which varies linearly along the way; the cell's mean follows from what came, what
// went and what the source gave: nothing is lost, however thick the cell is.
#version 450 core
#include "lib/ordinates.glsl"
#include "lib/cuts.glsl"

layout(local_size_x = GROUP_PIXELS * GROUP_PIXELS) in;

// Number of the slice, from where light enters; first ordinate; their major axis; 1: light on its way into
// the lattice alone, 0: of sources in it.
layout(location = 0) uniform ivec4 pass;

layout(binding = SLOT_CELL_EXTINCT) uniform sampler3D cell_extinct;
layout(binding = SLOT_CUTS) uniform usampler3D cell_cuts;
layout(binding = SLOT_CELL_WALLS) uniform sampler3D cell_walls; // radiance
layout(binding = SLOT_ANGULAR) uniform sampler3D sources;       // w: 1 where there is a medium
layout(binding = SLOT_SLICE) uniform sampler3D slice_before;

layout(binding = SLOT_OUTPUT, rgba16f) writeonly uniform image3D mean_image;
layout(binding = SLOT_OUTPUT + 1, rgba16f) writeonly uniform image3D slice_image;
layout(binding = SLOT_OUTPUT + 2, rgba16f) writeonly uniform image3D hits_image;

// How much the source grows along the way through a cell, from the cells around.
vec3 growth(ivec3 cell, int number, vec3 way, vec4 own, uint cuts)
{
    vec3 sum = vec3(0.0);
    for (int axis = 0; axis < 3; ++axis) {
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

// How much the light that leaves a slice of cells grows from one to the next, in a column between two others.
// w: 0 beyond the lattice, 1 with surfaces, else up to 2: how far it counts.
vec3 rises(vec4 low, vec4 own, vec4 high)
{
    float has_low = min(low.w, 1.0), has_high = min(high.w, 1.0);
    vec3 slope = (high.rgb - own.rgb) * has_high + (own.rgb - low.rgb) * has_low;
    slope *= max(own.w - 1.0, 0.0) / max(has_low + has_high, 1.0);
    return clamp(slope, -2.0 * abs(own.rgb), 2.0 * abs(own.rgb));
}

// The light of a place in the slice before, or around it.
vec4 column(ivec2 at, ivec3 dims, int number)
{
    return texelFetch(slice_before, slice_texel(clamp(at, ivec2(-1), dims.yz), number), 0);
}

void main()
{
    int axis = pass.z, number = pass.y + int(gl_WorkGroupID.z);
    ivec3 dims = slice_dims(axis);
    ivec2 at = divided(int(gl_GlobalInvocationID.x), dims.y).yx;
    if (at.y >= dims.z)
        return;
    vec3 direction = ordinates.list[number].direction.xyz;
    vec3 way = turned(axis, direction);
    float long_ = 1.0 / abs(way.x); // the way through a slice, in cells
    ivec3 cell = placed(axis, way.x > 0.0 ? pass.x : dims.x - 1 - pass.x, at);
    uvec2 closed = texelFetch(cell_cuts, cell, 0).gb;

    vec2 aside = abs(way.yz) * long_;
    ivec2 turn = ivec2(sign(way.yz));
    vec4 shares = vec4(1.0 - aside.x, aside.x, 1.0 - aside.x, aside.x) *
                  vec4(1.0 - aside.yy, aside.yy);
    vec3 wall = texelFetch(cell_walls, cell, 0).rgb, enters = vec3(0.0);
    vec4 comes[4];
    float stopped = 0.0;
    for (int i = 0; i < 4; ++i) {
        comes[i] = column(at - turn * aside_of(i), dims, number);
        enters += shares[i] * mix(comes[i].rgb, wall, closed_share(closed, ordinates.list[number].links_in[i]));
        stopped += shares[i] * closed_share(closed, ordinates.list[number].links_out[i]);
    }
    // The part of a column that goes aside is its side there, and light that grows is more in it.
    for (int i = 0; i < 2; ++i) {
        ivec2 step_ = turn * ivec2(1 - i, i);
        vec4 far = column(at - 2 * step_, dims, number), near = comes[1 + i];
        vec4 ahead = column(at + step_, dims, number);
        enters += 0.5 * aside[i] * (1.0 - aside[i]) *
                  (rises(far, near, comes[0]) - rises(near, comes[0], ahead));
    }
    enters = pass.w != 0 ? max(enters, vec3(0.0)) : enters;

    vec3 depth = texelFetch(cell_extinct, cell, 0).rgb * (level.lower.w * long_);
    vec3 through = exp(-depth);
    vec4 source =
        pass.w != 0 ? vec4(0.0) : texelFetch(sources, ordinate_texel(cell, number), 0);
    vec3 gives = mix(1.0 - through, depth * (1.0 - 0.5 * depth), lessThan(depth, vec3(1e-3)));
    bool thick = max(depth.r, max(depth.g, depth.b)) > 0.02 && source.w > 0.0;
    vec3 grows = vec3(0.0);
    if (thick)
        grows = growth(cell, number, direction * long_, source, closed.y);
    vec3 leaves = enters * through + source.rgb * gives +
                  grows * (0.5 * (1.0 + through) - gives / max(depth, vec3(1e-3)));
    // Of thin cells to the second order.
    vec3 mean = mix(source.rgb + (enters - leaves) / max(depth, vec3(1e-6)),
                    enters * (1.0 - 0.5 * depth) + source.rgb * (0.5 * depth),
                    lessThan(depth, vec3(3e-3)));
    // In thin media it does not count how light grows: taken as even it spreads aside, which hides that it
    // goes along few ordinates; in thick ones scattering does that.
    float counts = closed == uvec2(0u) ? clamp(8.0 * max(depth.r, max(depth.g, depth.b)), 0.0, 1.0) : 0.0;
    imageStore(slice_image, slice_texel(at, number), fit_along(leaves, 1.0 + counts, cell, number));
    imageStore(mean_image, ordinate_texel(cell, number), fit_along(mean, 0.0, cell, number));
    if (closed != uvec2(0u) && pass.w == 0)
        imageStore(hits_image, ordinate_texel(cell, number), fit(leaves * stopped, stopped));
}
