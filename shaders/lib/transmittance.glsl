// SPDX-License-Identifier: GPL-3.0-or-later
// The transmittance from a point to a light, through the lattice of optical depths and the world's
// medium. The lattice holds mean extinctions of the way to the light (lib/depth.glsl), so that the
// depth is exact in a homogeneous medium, at the lamp itself and on a lit face.
#include "lib/light.glsl"
#include "lib/medium.glsl"

layout(binding = SLOT_TAU) uniform sampler3D depth_lattice;

vec4 mean_extinction(gpu_light light, vec3 p)
{
    vec3 node = clamp((p - frame.lattice_lower.xyz) / frame.lattice_lower.w, vec3(0.0),
                      vec3(frame.lattice_dims.xyz - 1));
    node.yz += vec2(light.info.yz);
    return textureLod(depth_lattice, (node + 0.5) / vec3(textureSize(depth_lattice, 0)), 0.0);
}

// Optical depth; a: as dom_astray has it. towards: unit vector from p to the light, distance: how far it is.
vec4 light_depth(gpu_light light, vec3 p, vec3 towards, float distance)
{
    vec4 depth = vec4(fog_tau(p, towards, distance), 1.0);
    if (light.info.w != 0u) {
        // Outside the box its way begins where the ray to the light enters.
        vec2 span = ray_box(p, towards, frame.medium_lower.xyz, frame.medium_upper.xyz);
        float from = max(span.x, 0.0), to = min(span.y, distance);
        if (from < to) {
            vec4 mean = mean_extinction(light, p + towards * from);
            depth = vec4(depth.rgb + mean.rgb * (to - from), mean.a);
        }
    }
    return depth;
}

vec3 light_transmittance(gpu_light light, vec3 p, vec3 towards, float distance)
{
    return exp(-light_depth(light, p, towards, distance).rgb);
}
