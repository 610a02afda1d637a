// SPDX-License-Identifier: GPL-3.0-or-later
// What comes along some ordinates from beyond the lattice's sides, before light passes a slice of its cells:
// all around the slice before that, or in place of it where the lattice begins.
#version 450 core
#include "lib/ordinates.glsl"

layout(local_size_x = GROUP_REST) in;

// Number of the slice, from where light enters; first ordinate; their major axis; 1: the world's own
// light, 2: also that of surfaces around, 0: only what the lattice around has scattered.
layout(location = 0) uniform ivec4 pass;
// The lattice around, -1: none; how many tiles of ordinates stand along z in its textures.
layout(location = 1) uniform ivec2 around;

layout(binding = SLOT_MEANS_AROUND) uniform sampler3D means_around;
layout(binding = SLOT_SURROUNDINGS) uniform sampler2DArray surroundings;

layout(binding = SLOT_OUTPUT, rgba16f) writeonly uniform image3D slice_image;

// Of the lattice around, or of the world and of surfaces there.
vec3 outside(vec3 p, int number)
{
    vec3 light = ordinates.list[number].world.rgb * float(min(pass.w, 1));
    if (pass.w == 2) {
        vec4 q = vec4(p, 1.0);
        vec2 at = vec2(dot(q, ordinates.list[number].map_u), dot(q, ordinates.list[number].map_v));
        light = textureLod(surroundings, vec3(at, number), 0.0).rgb;
    }
    if (around.x < 0)
        return light;
    gpu_field field = frame.fields[around.x];
    vec3 at = (p - field.lower.xyz) / field.lower.w;
    if (any(lessThan(at, vec3(0.0))) || any(greaterThan(at, vec3(field.dims.xyz))))
        return light;
    at = clamp(at, vec3(0.5), vec3(field.dims.xyz) - 0.5);
    at.yz += vec2(divided(number, around.y)) * vec2(field.dims.yz);
    return textureLod(means_around, at / vec3(textureSize(means_around, 0)), 0.0).rgb;
}

// Of all places in and around a slice the one of a number; or of those around it alone.
ivec2 place(int index, ivec2 sides, bool all)
{
    ivec2 wide = sides + 2;
    if (all)
        return divided(index, wide.x).yx - 1;
    if (index < 2 * wide.x)
        return divided(index, wide.x).yx * ivec2(1, wide.y - 1) - 1;
    int rest = index - 2 * wide.x;
    return ivec2((rest & 1) * (wide.x - 1), rest / 2 + 1) - 1;
}

void main()
{
    int axis = pass.z, number = pass.y + int(gl_WorkGroupID.z);
    ivec3 dims = slice_dims(axis);
    bool forward = turned(axis, ordinates.list[number].direction.xyz).x > 0.0;
    int before = forward ? pass.x - 1 : dims.x - pass.x;
    ivec2 at = place(int(gl_GlobalInvocationID.x), dims.yz, pass.x == 0);
    if (at.y > dims.z)
        return;
    ivec3 cell = placed(axis, before, at);
    vec3 light = outside(cell_centre(level, cell), number);
    imageStore(slice_image, slice_texel(at, number), fit_along(light, 0.0, cell, number));
}
