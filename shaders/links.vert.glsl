// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces as seen along a link, one vertex.
#version 450 core
#include "lib/vertex.glsl"

out vec3 world_position;

void main()
{
    vec4 p = world_from_object * vec4(in_position, 1.0);
    world_position = p.xyz;
    place_corner(p);
}
