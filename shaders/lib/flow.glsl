// SPDX-License-Identifier: GPL-3.0-or-later
// Light in flight from a cell: its power and its flux, spherical harmonics of bands 0 and 1, a
// colour. It leaves as WEIGHTS say, and where that would be less than nothing, not at all.
#include "lib/links.glsl"

float leaving(vec4 flow, int link_class_number, vec3 direction)
{
    return max(WEIGHTS[link_class_number] * (flow.x + 3.0 * dot(flow.yzw, direction)), 0.0);
}

// The same light, scaled so that all that leaves is the power that it holds.
vec4 leaving_all(vec4 flow)
{
    if (!(flow.x > 0.0))
        return vec4(0.0);
    float sum = 0.0;
    for (int i = 0; i < 13; ++i) {
        vec3 direction = vec3(LINKS[i]) / link_length(i);
        sum += leaving(flow, link_class(i), direction) + leaving(flow, link_class(i), -direction);
    }
    return flow * (flow.x / max(sum, 1e-30));
}
