// SPDX-License-Identifier: GPL-3.0-or-later
// Vertices of surfaces whose position and normal fragments need.
#include "lib/vertex.glsl"

out vec3 world_position;
out vec3 world_normal;

void place_surface()
{
    vec4 p = world_from_object * vec4(in_position, 1.0);
    world_position = p.xyz;
    world_normal = normal_from_object * in_normal;
    place_corner(p);
}
