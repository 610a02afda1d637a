// SPDX-License-Identifier: GPL-3.0-or-later
// The camera's view of the surfaces: normal and depth, and the lobes of the material.
#version 450 core
#include "lib/material.glsl"

in vec3 world_position;
in vec3 world_normal;
in vec2 uv;
flat in uint instance_number;
flat in uint visibility;

layout(location = 0) out vec4 out_normal;   // world normal; view depth
layout(location = 1) out vec4 out_diffuse;  // reflectance; roughness
layout(location = 2) out vec4 out_specular; // F0; 1 where the surface is a holdout
layout(location = 3) out vec4 out_emission; // w: share of the diffuse that is Burley's

void main()
{
    vec4 base = material_base(uv);
    float alpha = material_alpha(base);
    if (!material_covers(alpha, gl_FragCoord.xy, instance_number, stage.info.x))
        discard;
    if ((material.flags.x & MATERIAL_CULL_BACK) != 0u && !gl_FrontFacing)
        discard;

    vec3 view_vector = stage.eye.w != 0.0 ? stage.eye.xyz - world_position : -stage.eye.xyz;
    vec3 face = cross(dFdx(world_position), dFdy(world_position));
    // Corner normals that cancel one another leave none: a dark pixel, but not NaN.
    vec3 normal = world_normal * inversesqrt(max(dot(world_normal, world_normal), 1e-30));
    // Both sides of a surface are the same: the normal looks at the viewer.
    if (dot(face, view_vector) < 0.0)
        face = -face;
    if (dot(normal, face) < 0.0)
        normal = -normal;

    float depth = stage.clip.z != 0.0
                      ? stage.clip.y - gl_FragCoord.z * (stage.clip.y - stage.clip.x)
                      : stage.clip.x / max(gl_FragCoord.z, 1e-30);
    if (depth > stage.clip.y)
        discard;

    float roughness = material.diffuse.w;
    if ((material.flags.x & MATERIAL_ROUGHNESS_IMAGE) != 0u)
        roughness *= texture(roughness_image, uv).r;
    bool holdout = (visibility & VISIBLE_HOLDOUT) != 0u;
    out_normal = vec4(normal, depth);
    out_diffuse = vec4(material.diffuse.rgb * base.rgb, clamp(roughness, 0.0, 1.0));
    out_specular = vec4(material.specular.rgb + material.metal.rgb * base.rgb, holdout ? 1.0 : 0.0);
    out_emission = vec4(min(material.emission.rgb, vec3(65504.0)), material.emission.w); // what halves hold
}
