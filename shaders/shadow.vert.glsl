// SPDX-License-Identifier: GPL-3.0-or-later
// A light's view of the surfaces, one vertex.
#version 450 core
#include "lib/vertex.glsl"

void main()
{
    place_corner(world_from_object * vec4(in_position, 1.0));
}
