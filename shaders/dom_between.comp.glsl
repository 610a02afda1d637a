// SPDX-License-Identifier: GPL-3.0-or-later
// From what the cells' means scatter towards the eye to what is interpolated between them. A mean, and
// the interpolation, round off whatever is curved: second differences give it back (as csrc/scene/sharpen.c
// does for the medium). A cell with nothing that scatters goes on as the media beside it do, for up to the
// medium's border their light falls as steeply as before it.
#version 450 core
#include "lib/ordinates.glsl"
#include "lib/field.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

// scattered_lattice is as dom_eye leaves it: w: 1 where nothing scatters.

layout(binding = SLOT_OUTPUT, rgba16f) writeonly uniform image3D between_image; // w: 1 where surfaces
                                         // part the cells that are interpolated between from this one on

const float SHARE = 0.125;

// What the next cell scatters, w: 1; w: 0 where it does not, or a surface parts it from this one.
vec4 beside(ivec3 cell, uint cuts, ivec3 offset)
{
    ivec3 next = cell + offset;
    if (!in_level(next) || is_cut(cuts, offset))
        return vec4(0.0);
    vec4 light = texelFetch(scattered_lattice, above(next), 0);
    return light.w == 0.0 ? vec4(light.rgb, 1.0) : vec4(0.0);
}

vec3 sharpened(ivec3 cell, uint cuts, vec3 mean)
{
    vec3 light = mean;
    for (int axis = 0; axis < 3; ++axis) {
        ivec3 offset = ivec3(0);
        offset[axis] = 1;
        vec4 before = beside(cell, cuts, -offset), after = beside(cell, cuts, offset);
        if (before.w * after.w > 0.0)
            light += SHARE * (2.0 * mean - before.rgb - after.rgb);
    }
    return clamp(light, 0.5 * mean, 2.0 * mean);
}

vec3 gone_on(ivec3 cell, uint cuts)
{
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 27; ++i) {
        ivec3 offset = ivec3(i % 3, i / 3 % 3, i / 9) - 1;
        vec4 first = i == 13 ? vec4(0.0) : beside(cell, cuts, offset);
        if (first.w == 0.0)
            continue;
        vec4 second = beside(cell + offset, cuts_of(level, cell + offset), offset);
        vec3 light = mix(first.rgb, clamp(2.0 * first.rgb - second.rgb, vec3(0.0), 2.0 * first.rgb),
                         second.w);
        sum += vec4(light, 1.0) * inversesqrt(float(dot(offset, offset)));
    }
    return sum.rgb / max(sum.w, 1e-3);
}

// Whether links between the cell and the seven beyond it along the axes are cut.
bool parted_from_here(ivec3 cell)
{
    bool parted = false;
    for (int corner = 0; corner < 8; ++corner) {
        ivec3 at = cell + ivec3(corner & 1, corner >> 1 & 1, corner >> 2);
        if (in_level(at))
            parted = parted || (cuts_of(level, at) & LINKS_BETWEEN[corner]) != 0u;
    }
    return parted;
}

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (!in_level(cell))
        return;
    vec4 mean = texelFetch(scattered_lattice, above(cell), 0);
    uint cuts = cuts_of(level, cell);
    vec3 light = mean.w == 0.0 ? sharpened(cell, cuts, mean.rgb) : gone_on(cell, cuts);
    imageStore(between_image, above(cell), fit(light, parted_from_here(cell) ? 1.0 : 0.0));
}
