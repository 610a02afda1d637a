// SPDX-License-Identifier: GPL-3.0-or-later
// DOM's ordinates, and where the light along each stands in the textures: a tile of the lattice each.
#include "lib/level.glsl"

#ifdef ORDINATES_WRITTEN
layout(std430, binding = SLOT_ORDINATES) buffer ordinates_block
#else
layout(std140, binding = SLOT_ORDINATES) uniform ordinates_block
#endif
{
    gpu_ordinates ordinates;
};

ivec3 ordinate_texel(ivec3 cell, int number)
{
    return cell + ivec3(0, divided(number, ordinates.count.y) * level.dims.yz);
}

// The mean cosine of a cell that nothing scatters in.
const float EMPTY = 2.0;

ivec3 moment_texel_of(gpu_field field, ivec3 cell, int moment)
{
    return cell + ivec3(moment % MOMENT_SIDE, moment / MOMENT_SIDE, 0) * ivec3(field.dims.xy, 0);
}

ivec3 moment_texel(ivec3 cell, int moment)
{
    return moment_texel_of(level, cell, moment);
}

// A texel of one lattice where all stand one above the other.
ivec3 above(ivec3 texel)
{
    return texel + ivec3(0, 0, level.dims.w);
}

// The same of what is extrapolated: bands 0 and 1, and the radiance of surfaces.
ivec3 mixed_texel(ivec3 cell, int number)
{
    return cell + ivec3(number * level.dims.x, 0, 0);
}

// The cell of a slice across an axis, `along` it.
ivec3 placed(int axis, int along, ivec2 at)
{
    return axis == 0 ? ivec3(along, at) : (axis == 1 ? ivec3(at.y, along, at.x) : ivec3(at, along));
}

// Where light on its way from one slice to the next stands: a layer for each ordinate, with what comes from
// beyond the lattice's sides around it.
ivec3 slice_texel(ivec2 at, int number)
{
    return ivec3(at + 1, number);
}

// The sides of a slice across an axis.
ivec3 slice_dims(int axis)
{
    return axis == 0 ? level.dims.xyz : (axis == 1 ? level.dims.yzx : level.dims.zxy);
}

// A direction's own axes: the major one first.
vec3 turned(int axis, vec3 way)
{
    return axis == 0 ? way.xyz : (axis == 1 ? way.yzx : way.zxy);
}

// A column of light leaves a slice for up to four cells of the next: straight on, and aside along the
// slice's axes or not.
ivec2 aside_of(int number)
{
    return ivec2(number & 1, number >> 1);
}

// A colour as half floats hold it: they end at 65504, and what a driver does with the bits that they lack
// is its own affair. Software cuts them off, which would dim light by 0.02 % in every slice of cells.
vec4 rounded(vec3 value, float w, uint up)
{
    vec3 within = clamp(value, vec3(-65504.0), vec3(65504.0));
    return vec4(uintBitsToFloat((floatBitsToUint(within) + up) & 0xffffe000u), w);
}

vec4 fit(vec3 value, float w)
{
    return rounded(value, w, 0x1000u);
}

// The same of light along an ordinate. Rounded to the nearest, even light, which is alike along all of
// them and in many cells, would be wrong by as much everywhere, and thick media show a thousand times
// that; so ordinates and cells are rounded up or down by turns.
vec4 fit_along(vec3 value, float w, ivec3 cell, int number)
{
    uint turn = uint(number) * 2654435769u + uint(cell.x) * 3242174889u + uint(cell.y) * 2447445413u +
                uint(cell.z) * 1831565813u;
    return rounded(value, w, turn >> 19);
}

// The axis that light along a direction goes along most: it passes the lattice slice by slice of that.
int major_axis(vec3 way)
{
    vec3 a = abs(way);
    return a.x >= a.y && a.x >= a.z ? 0 : (a.y >= a.z ? 1 : 2);
}
