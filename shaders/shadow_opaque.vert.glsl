// SPDX-License-Identifier: GPL-3.0-or-later
// A light's view of surfaces that cover all behind them, one vertex.
#version 450 core
#include "lib/vertex.glsl"

void main()
{
    place_corner(instances[in_instance].world_from_object * vec4(in_position, 1.0), VISIBLE_SHADOW);
}
