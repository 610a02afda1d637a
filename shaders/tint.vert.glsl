// SPDX-License-Identifier: GPL-3.0-or-later
// The camera's view of what is seen through, one vertex.
#version 450 core
#include "lib/vertex.glsl"

out vec2 uv;
flat out uint material_number;
flat out uint instance_number;

void main()
{
    gpu_instance instance = instances[in_instance];
    uv = in_uv;
    material_number = in_material;
    instance_number = in_instance;
    gl_Position = stage.clip_from_world * (instance.world_from_object * vec4(in_position, 1.0));
    if ((instance.flags.x & 1u) == 0u)
        gl_Position = vec4(0.0, 0.0, 2.0, 1.0); // not visible to the camera: outside the clip box
}
