// SPDX-License-Identifier: GPL-3.0-or-later
// Light of the world that a point of the medium scatters: the sky lattice times the phase function.
#include "lib/frame.glsl"

layout(binding = SLOT_SKY_R) uniform sampler3D sky_r;
layout(binding = SLOT_SKY_G) uniform sampler3D sky_g;
layout(binding = SLOT_SKY_B) uniform sampler3D sky_b;

vec3 sky_coordinate(vec3 p)
{
    vec3 node = clamp((p - frame.sky_lower.xyz) / frame.sky_lower.w, vec3(0.0),
                      vec3(frame.sky_dims.xyz - 1));
    return (node + 0.5) / vec3(textureSize(sky_r, 0));
}

// Radiance that leaves towards `out_direction`, per unit of sigma_s. The lattice holds the fluence
// and the net flux of the uncollided light (bands 0 and 1); Henyey-Greenstein's moments are 1, g.
vec3 sky_scatter(vec3 p, vec3 out_direction, float g)
{
    vec3 uvw = sky_coordinate(p);
    vec4 r = textureLod(sky_r, uvw, 0.0);
    vec4 gr = textureLod(sky_g, uvw, 0.0);
    vec4 b = textureLod(sky_b, uvw, 0.0);
    vec4 weights = vec4(1.0, 3.0 * g * out_direction) / (4.0 * PI);
    return max(vec3(dot(r, weights), dot(gr, weights), dot(b, weights)), vec3(0.0));
}
