// SPDX-License-Identifier: GPL-3.0-or-later
// Inputs of the drawing stages: one vertex a corner, one instance an object.
#include "lib/draw.glsl"

layout(location = 0) in vec3 in_position;
layout(location = 1) in vec3 in_normal;
layout(location = 2) in vec2 in_uv;
layout(location = 3) in uint in_instance; // per instance: its number in the instances' buffer
layout(location = 4) in uint in_material; // constant of the draw

layout(std430, binding = SLOT_INSTANCES) readonly buffer instances_block
{
    gpu_instance instances[];
};

out vec2 uv;
flat out uint material_number;
flat out uint instance_number;

// Hands on what fragments need and places the corner; outside the clip box where its instance lacks
// the visibility (a bit of brume_visibility).
void place_corner(vec4 world, uint visibility)
{
    uv = in_uv;
    material_number = in_material;
    instance_number = in_instance;
    gl_Position = (instances[in_instance].flags.x & visibility) != 0u
                      ? stage.clip_from_world * world
                      : vec4(0.0, 0.0, 2.0, 1.0);
}
