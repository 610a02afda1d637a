// SPDX-License-Identifier: GPL-3.0-or-later
// A light's view of the surfaces, with what is needed to reflect its light: one vertex.
#version 450 core
#include "lib/surface.glsl"

void main()
{
    place_surface();
}
