// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces of the camera's view, lit by all lamps and the world: one sample of each light a pixel
// and frame, through its shadow map and the media's transmittance.
#version 450 core
#include "lib/transmittance.glsl"
#include "lib/shadow.glsl"
#include "lib/world.glsl"
#include "lib/bsdf.glsl"

layout(local_size_x = GROUP_PIXELS, local_size_y = GROUP_PIXELS) in;

layout(binding = SLOT_GBUFFER_NORMAL) uniform sampler2D gbuffer_normal;
layout(binding = SLOT_GBUFFER_DIFFUSE) uniform sampler2D gbuffer_diffuse;
layout(binding = SLOT_GBUFFER_SPECULAR) uniform sampler2D gbuffer_specular;

layout(binding = SLOT_OUTPUT, rgba32f) writeonly uniform image2D surface_image;

vec3 light_surface(surface s, vec3 p, gpu_light light, ivec2 pixel, uint number)
{
    // Each pixel walks through all samples of the light, from a start of its own.
    uint turn = (uint(frame.size.z) + pixel_hash(pixel, number)) % light.samples.y;
    gpu_light_sample light_sample = light_samples[light.samples.x + turn];
    vec2 lot = vec2(pixel_random(pixel, 2u * number + 101u),
                    pixel_random(pixel, 2u * number + 102u)) * 2.0 - 1.0;
    vec3 point = light_point(light, light_sample, lot);
    vec3 towards;
    float square;
    vec3 intensity = light_intensity(light, point, p, towards, square);
    vec3 reflected = bsdf_diffuse(s, towards) * light.factors.x +
                     bsdf_specular(s, towards) * light.factors.y;
    vec3 radiance = reflected * intensity / square;
    if (radiance == vec3(0.0))
        return radiance;
    float distance = light.info.x == uint(LIGHT_SUN) ? 1e30 : sqrt(square);
    float lit = light_shadow(light, light_sample, p, s.normal);
    if (lit == 0.0)
        return vec3(0.0);
    return radiance * lit * light_transmittance(light, p, towards, distance);
}

// What the media between a point and the world's sample let through. Wide steps, shifted by lot so
// that they leave no pattern.
vec3 world_transmittance(vec3 p, vec3 towards, float within)
{
    vec3 tau = fog_tau(p, towards, 1e30);
    if (medium_exists())
        tau += medium_tau(p, towards, 1e30, 4.0 * frame.medium_lower.w, within);
    return exp(-tau);
}

vec3 world_surface(surface s, vec3 p, ivec2 pixel)
{
    vec3 diffuse = vec3(0.0);
    float seen = 0.0, seen_weight = 0.0;
    vec3 mirror = reflect(-s.view, s.normal);
    bool glossy = s.specular != vec3(0.0);
    float within = pixel_random(pixel, 8u);
    // A pixel's samples take every stride-th direction, which are spread as evenly as all are, from
    // a start of its own: what a few directions do not resolve becomes grain rather than bands.
    uint stride = max(frame.world.y / (frame.world.z * uint(frame.clip.w)), 1u);
    uint start = pixel_hash(pixel, 7u);
    for (uint i = 0u; i < frame.world.z; ++i) {
        uint turn = start + (uint(frame.size.z) * frame.world.z + i) * stride;
        gpu_light_sample w = light_samples[frame.world.x + turn % frame.world.y];
        vec3 towards = w.position.xyz;
        float cosine = dot(s.normal, towards);
        if (cosine <= 0.0)
            continue;
        float lit = w.position.w < 0.0 ? 1.0
                                       : distant_shadow(int(w.position.w), frame.world.w, p,
                                                        s.normal, towards);
        float nearness = glossy ? pow(max(dot(mirror, towards), 0.0), 4.0) + 1e-3 : 0.0;
        seen += lit * nearness;
        seen_weight += nearness;
        if (lit > 0.0)
            diffuse += bsdf_diffuse(s, towards) * w.weight.rgb * lit *
                       world_transmittance(p, towards, within);
    }
    diffuse *= float(frame.world.y) / float(frame.world.z);
    vec3 specular = vec3(0.0);
    if (glossy) {
        // The mirror's part of the world, blurred by the roughness, as far as the samples around
        // it are not hidden.
        float levels = frame.world_color.w != 0.0 ? float(textureQueryLevels(world_image)) : 1.0;
        float visible = seen_weight > 0.0 ? seen / seen_weight : 0.0;
        specular = world_radiance(mirror, s.roughness * (levels - 2.0)) * bsdf_environment(s) *
                   visible * world_transmittance(p, mirror, within);
    }
    return diffuse + specular;
}

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, frame.size.xy)))
        return;
    vec4 normal_depth = texelFetch(gbuffer_normal, pixel, 0);
    vec3 radiance = vec3(0.0);
    if (normal_depth.w > 0.0) {
        view_ray ray = pixel_ray(pixel);
        vec4 diffuse = texelFetch(gbuffer_diffuse, pixel, 0);
        surface s;
        s.normal = normal_depth.xyz;
        s.view = -ray.direction;
        s.diffuse = diffuse.rgb;
        s.roughness = diffuse.w;
        s.specular = texelFetch(gbuffer_specular, pixel, 0).rgb;
        vec3 p = ray.origin + ray.direction * (normal_depth.w * ray.stretch);
        for (uint i = 0u; i < frame.counts.x; ++i)
            radiance += light_surface(s, p, lights[i], pixel, i);
        if (frame.world.y > 0u && frame.fog_upper.w == 0.0)
            radiance += world_surface(s, p, pixel);
    }
    imageStore(surface_image, pixel, vec4(radiance, 0.0));
}
