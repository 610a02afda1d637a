// SPDX-License-Identifier: GPL-3.0-or-later
// A reflective shadow map (Dachsbacher and Stamminger, "Reflective Shadow Maps", I3D 2005): where
// the light's rays meet surfaces, how those stand, and what they reflect.
#version 450 core
#include "lib/material.glsl"
#include "lib/level.glsl"

in vec3 world_position;
in vec3 world_normal;
in vec2 uv;
flat in uint instance_number;

layout(location = 0) out vec4 out_position; // w: 1
layout(location = 1) out vec4 out_normal;
layout(location = 2) out vec4 out_diffuse;

// Of a map that looks out of the lattice: whether light from here goes on into it.
bool goes_in()
{
    float room = 1e-2 * level.lower.w;
    vec2 span = ray_box(world_position, -stage.eye.xyz, level.lower.xyz - room,
                        level.lower.xyz + vec3(level.dims.xyz) * level.lower.w + room);
    return span.x < span.y && span.x > 0.0;
}

void main()
{
    vec4 base = material_base(uv);
    if (!material_casts(base, gl_FragCoord.xy, instance_number, stage.info.x))
        discard;
    if (stage.eye.w != 0.0 && !goes_in())
        discard;
    out_position = vec4(world_position, 1.0);
    out_normal = vec4(world_normal * inversesqrt(max(dot(world_normal, world_normal), 1e-30)), 0.0);
    out_diffuse = vec4(material.diffuse.rgb * base.rgb, 0.0);
}
