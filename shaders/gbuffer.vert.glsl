// SPDX-License-Identifier: GPL-3.0-or-later
// The camera's view of the surfaces, one vertex.
#version 450 core
#include "lib/surface.glsl"

flat out uint visibility;

void main()
{
    visibility = in_flags.x;
    place_surface();
}
