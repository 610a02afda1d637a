// SPDX-License-Identifier: GPL-3.0-or-later
// The transmittance from a point to a light, through the optical-depth lattice and the world's
// medium. The lattice has one value a node; nodes stand on the box's faces too, so that depth 0 at
// a lit face is exact.
#include "lib/light.glsl"
#include "lib/medium.glsl"

layout(binding = SLOT_TAU) uniform sampler3D tau_lattice;

vec3 lattice_tau(gpu_light light, vec3 p)
{
    vec3 node = clamp((p - frame.lattice_lower.xyz) / frame.lattice_lower.w, vec3(0.0),
                      vec3(frame.lattice_dims.xyz - 1));
    node.yz += vec2(light.info.yz);
    return textureLod(tau_lattice, (node + 0.5) / vec3(textureSize(tau_lattice, 0)), 0.0).rgb;
}

// towards: unit vector from p to the light, distance: how far it is.
vec3 light_transmittance(gpu_light light, vec3 p, vec3 towards, float distance)
{
    vec3 tau = fog_tau(p, towards, distance);
    if (light.info.w != 0u) {
        // Outside the box its depth is that of the point where the ray to the light enters.
        vec2 span = ray_box(p, towards, frame.medium_lower.xyz, frame.medium_upper.xyz);
        if (max(span.x, 0.0) < min(span.y, distance))
            tau += lattice_tau(light, p + towards * max(span.x, 0.0));
    }
    return exp(-tau);
}
