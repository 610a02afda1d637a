// SPDX-License-Identifier: GPL-3.0-or-later
// The colour that a surface gives to what is seen through it, multiplied in any order.
#version 450 core
#include "lib/material.glsl"

in vec2 uv;
flat in uint instance_number;

layout(location = 0) out vec4 out_tint;

void main()
{
    float alpha = material_alpha(material_base(uv));
    if (material_covers(alpha, gl_FragCoord.xy, instance_number, stage.info.x))
        discard;
    out_tint = vec4(material.transparent.rgb, 1.0);
}
