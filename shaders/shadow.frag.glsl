// SPDX-License-Identifier: GPL-3.0-or-later
// A light's view of the surfaces: depth alone, through the alpha test; of opaque ones there is nothing to
// run, which is several times as quick on a CPU.
// variants: OPAQUE
#version 450 core
#include "lib/material.glsl"

in vec2 uv;
flat in uint instance_number;

void main()
{
#ifndef OPAQUE
    vec4 base = material_base(uv);
    if (!material_casts(base, gl_FragCoord.xy, instance_number, stage.info.x))
        discard;
#endif
}
