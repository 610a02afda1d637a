// SPDX-License-Identifier: GPL-3.0-or-later
// Inputs of the drawing stages: one vertex a corner, one instance an object. What is the instance's comes
// as attributes: from a buffer software reads it number by number, lane by lane, for every corner.
#include "lib/draw.glsl"

layout(location = 0) in vec3 in_position;
layout(location = 1) in vec3 in_normal;
layout(location = 2) in vec2 in_uv;
layout(location = 3) in mat4 world_from_object; // from here on as gpu_instance
layout(location = 7) in mat3 normal_from_object;
layout(location = 10) in uvec2 in_flags;

out vec2 uv;
flat out uint instance_number;

// Hands on what fragments need and places the corner.
void place_corner(vec4 world)
{
    uv = in_uv;
    instance_number = in_flags.y;
    gl_Position = stage.clip_from_world * world;
}
