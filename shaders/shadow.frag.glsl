// SPDX-License-Identifier: GPL-3.0-or-later
// A light's view of the surfaces: depth alone, through the alpha test; of opaque ones there is nothing to
// run, which is several times as quick on a CPU.
// variants: OPAQUE
#version 450 core
#include "lib/material.glsl"

in vec2 uv;
flat in uint material_number;
flat in uint instance_number;

void main()
{
#ifndef OPAQUE
    gpu_material material = materials[material_number];
    vec4 base = material_base(material, uv);
    if (!material_casts(material, base, gl_FragCoord.xy, instance_number, stage.info.x))
        discard;
#endif
}
