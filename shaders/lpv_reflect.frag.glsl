// SPDX-License-Identifier: GPL-3.0-or-later
// Adds a lobe to its cell: cosines to its axis have the mean 2/3.
#version 450 core

flat in vec3 power;
flat in vec3 axis;

layout(location = 0) out vec4 red;
layout(location = 1) out vec4 green;
layout(location = 2) out vec4 blue;

void main()
{
    vec4 lobe = vec4(1.0, axis * (2.0 / 3.0));
    red = power.r * lobe;
    green = power.g * lobe;
    blue = power.b * lobe;
}
