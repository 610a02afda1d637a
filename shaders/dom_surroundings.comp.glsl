// SPDX-License-Identifier: GPL-3.0-or-later
// What comes into the lattice along an ordinate: the world's light, or what surfaces beyond the lattice's
// sides send, which hide it. A map that looks out of the lattice against the ordinate tells where these are;
// they reflect the lamps' light and the world's, as matt as all do in the lattice.
#version 450 core
#include "lib/transmittance.glsl"
#include "lib/shadow.glsl"

#include "lib/ordinates.glsl"

layout(local_size_x = GROUP_PIXELS, local_size_y = GROUP_PIXELS) in;

layout(location = 0) uniform ivec2 map; // the ordinate; texels of a side

layout(binding = SLOT_RSM) uniform sampler2D rsm[3]; // position, normal, reflectance

layout(binding = SLOT_OUTPUT, rgba16f) writeonly uniform image2DArray surroundings_image;

vec3 reflected(vec3 p, vec3 normal, vec3 reflectance, int lot)
{
    vec3 sum = vec3(0.0);
    for (uint i = 0u; i < frame.counts.x; ++i) {
        gpu_light light = light_at(i);
        gpu_light_sample s = light_sample_at(light.samples.x + turn_of(uint(lot), light.samples.y));
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
        sum += ordinates.list[k].world.rgb * (direction.w * max(-dot(normal, direction.xyz), 0.0));
    }
    return reflectance * sum / PI;
}

void main()
{
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    int number = map.x;
    if (any(greaterThanEqual(texel, ivec2(map.y))))
        return;
    vec3 light = ordinates.list[number].world.rgb;
    if (texelFetch(rsm[0], texel, 0).w != 0.0) {
        vec3 normal = texelFetch(rsm[1], texel, 0).xyz;
        bool turned_away = dot(normal, ordinates.list[number].direction.xyz) < 0.0;
        light = reflected(texelFetch(rsm[0], texel, 0).xyz, turned_away ? -normal : normal,
                          texelFetch(rsm[2], texel, 0).rgb, texel.x + map.y * texel.y);
    }
    imageStore(surroundings_image, ivec3(texel, number), fit(light, 0.0));
}
