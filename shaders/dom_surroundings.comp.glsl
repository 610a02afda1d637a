// SPDX-License-Identifier: GPL-3.0-or-later
// What comes into the lattice along an ordinate, where surfaces beyond its sides hide the world: of a map
// that looks out of the lattice against it, the mean over all texels that see past the lattice's end.
// These surfaces reflect the lamps' light and the world's, as matt as all do in the lattice.
#version 450 core
#include "lib/transmittance.glsl"
#include "lib/shadow.glsl"

layout(local_size_x = GROUP_REST) in;

#define ORDINATES_WRITTEN
#include "lib/ordinates.glsl"

layout(location = 0) uniform ivec2 map; // the ordinate; texels of a side

layout(binding = SLOT_RSM) uniform sampler2D rsm[3]; // position, normal, reflectance

shared vec4 parts[GROUP_REST];

vec3 reflected(vec3 p, vec3 normal, vec3 reflectance, int lot)
{
    vec3 sum = vec3(0.0);
    for (uint i = 0u; i < frame.counts.x; ++i) {
        gpu_light light = lights[i];
        gpu_light_sample s = light_samples[light.samples.x + uint(lot) % light.samples.y];
        vec3 towards;
        float square;
        vec3 intensity = light_intensity(light, s.position.xyz, p, towards, square) * light.factors.x;
        float cosine = dot(normal, towards);
        if (cosine <= 0.0 || intensity == vec3(0.0))
            continue;
        float distance = light.info.x == uint(LIGHT_SUN) ? 1e30 : sqrt(square);
        sum += intensity * (cosine / square * light_shadow(light, s, p, normal)) *
               light_transmittance(light, p, towards, distance);
    }
    for (int k = 0; k < ordinates.count.x; ++k) {
        vec4 direction = ordinates.list[k].direction;
        sum += ordinates.list[k].sky.rgb * (direction.w * max(-dot(normal, direction.xyz), 0.0));
    }
    return reflectance * sum / PI;
}

void main()
{
    int number = map.x, share = int(gl_LocalInvocationID.x);
    vec3 way = ordinates.list[number].direction.xyz, sky = ordinates.list[number].sky.rgb;
    vec4 sum = vec4(0.0);
    for (int i = share; i < map.y * map.y; i += GROUP_REST) {
        ivec2 texel = ivec2(i % map.y, i / map.y);
        vec4 position = texelFetch(rsm[0], texel, 0);
        if (position.w == REFLECTS_WITHIN)
            continue;
        vec3 light = sky;
        if (position.w != 0.0) {
            vec3 normal = texelFetch(rsm[1], texel, 0).xyz;
            light = reflected(position.xyz, dot(normal, way) < 0.0 ? -normal : normal,
                              texelFetch(rsm[2], texel, 0).rgb, i);
        }
        sum += vec4(light, 1.0);
    }
    parts[share] = sum;
    barrier();
    if (share != 0)
        return;
    sum = vec4(0.0);
    for (int i = 0; i < GROUP_REST; ++i)
        sum += parts[i];
    ordinates.list[number].world = vec4(sum.w > 0.0 ? sum.rgb / sum.w : sky, 0.0);
}
