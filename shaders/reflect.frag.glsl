// SPDX-License-Identifier: GPL-3.0-or-later
// A reflective shadow map (Dachsbacher and Stamminger, "Reflective Shadow Maps", I3D 2005): where
// the light's rays meet surfaces, how those stand, and what they reflect.
#version 450 core
#include "lib/material.glsl"
#include "lib/level.glsl"

in vec3 world_position;
in vec3 world_normal;
in vec2 uv;
flat in uint material_number;
flat in uint instance_number;

layout(location = 0) out vec4 out_position; // w: 1, or REFLECTS_WITHIN
layout(location = 1) out vec4 out_normal;
layout(location = 2) out vec4 out_diffuse;

// Of a map that looks out of the lattice: 0 before it, REFLECTS_WITHIN in it, 1 beyond.
float place()
{
    float room = 1e-2 * level.lower.w;
    vec3 half_ = 0.5 * vec3(level.dims.xyz) * level.lower.w;
    vec3 off = world_position - level.lower.xyz - half_;
    if (all(lessThan(abs(off), half_ + room)))
        return REFLECTS_WITHIN;
    return dot(off, stage.eye.xyz) > 0.0 ? 1.0 : 0.0;
}

void main()
{
    gpu_material material = materials[material_number];
    vec4 base = material_base(material, uv);
    if (!material_casts(material, base, gl_FragCoord.xy, instance_number, stage.info.x))
        discard;
    float where = stage.eye.w != 0.0 ? place() : 1.0;
    if (where == 0.0)
        discard;
    out_position = vec4(world_position, where);
    out_normal = vec4(world_normal * inversesqrt(max(dot(world_normal, world_normal), 1e-30)), 0.0);
    out_diffuse = vec4(material.diffuse.rgb * base.rgb, 0.0);
}
