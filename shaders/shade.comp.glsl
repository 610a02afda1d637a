// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces of the camera's view, lit by all lamps and the world: one sample of each light a pixel
// and frame, through its shadow map and the media's transmittance.
#version 450 core
#include "lib/transmittance.glsl"
#include "lib/shadow.glsl"
#include "lib/world.glsl"
#include "lib/bsdf.glsl"
#include "lib/field.glsl"

layout(local_size_x = GROUP_PIXELS, local_size_y = GROUP_PIXELS) in;

layout(binding = SLOT_GBUFFER_NORMAL) uniform sampler2D gbuffer_normal;
layout(binding = SLOT_GBUFFER_DIFFUSE) uniform sampler2D gbuffer_diffuse;
layout(binding = SLOT_GBUFFER_SPECULAR) uniform sampler2D gbuffer_specular;
#include "lib/nearby.glsl"

layout(binding = SLOT_OUTPUT, rgba32f) writeonly uniform image2D surface_image;

vec3 light_surface(surface s, vec3 p, gpu_light light, ivec2 pixel, uint number)
{
    // Each pixel walks through all samples of the light, from a start of its own.
    uint turn = turn_of(uint(frame.size.z) + pixel_hash(pixel, number), light.samples.y);
    gpu_light_sample light_sample = light_sample_at(light.samples.x + turn);
    vec3 point = light_point(light, light_sample, light_lot(pixel, number));
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
    return distant_transmittance(p, towards, 8.0 * frame.medium_lower.w, within);
}

float world_shadow(gpu_light_sample w, vec3 p, vec3 normal)
{
    int first = int(w.position.w);
    return first < 0 ? 1.0
                     : shadow_surface(first, first + int(frame.world.w) - 1, p, 1.0, normal,
                                      w.position.xyz);
}

vec3 world_diffuse(surface s, vec3 p, ivec2 pixel, float within)
{
    vec3 sum = vec3(0.0);
    // A pixel's samples take every so-manieth direction, which are spread as evenly as all are, from
    // a start of its own: what few directions do not resolve becomes grain rather than bands.
    uint every = frame.counts.z, stride = frame.counts.w;
    uint taken = uint(divided(int(frame.world.y), int(every)).x);
    uint start = turn_of(pixel_hash(pixel, 7u), frame.world.y);
    uint first = turn_of(uint(frame.size.z) * frame.world.z, taken);
    uint i = 0u;
    do {
        uint turn = turn_of(start + every * turn_of((first + i) * stride, taken), frame.world.y);
        gpu_light_sample w = light_sample_at(frame.world.x + turn);
        vec3 reflected = bsdf_diffuse(s, w.position.xyz);
        if (reflected == vec3(0.0))
            continue;
        float lit = world_shadow(w, p, s.normal);
        if (lit > 0.0)
            sum += reflected * w.weight.rgb *
                   (lit * world_transmittance(p, w.position.xyz, within));
    } while (++i < frame.world.z);
    return sum * (float(frame.world.y) / float(frame.world.z));
}

// Whether geometry hides the world in a direction, as far as the shadow maps of its samples tell:
// the nearest of them to a direction drawn around it answers.
float world_visible(vec3 p, vec3 normal, vec3 direction, vec3 lot)
{
    vec3 around = direction + (lot - 0.5) * (2.0 * inversesqrt(float(frame.world.y)));
    float best = -2.0;
    uint nearest = 0u;
    for (uint i = 0u; i < frame.world.y; ++i) {
        vec3 towards = light_sample_at(frame.world.x + i).position.xyz;
        float nearness = dot(around, towards);
        if (nearness > best && dot(normal, towards) > 0.0) {
            best = nearness;
            nearest = i;
        }
    }
    return best > -2.0 ? world_shadow(light_sample_at(frame.world.x + nearest), p, normal) : 1.0;
}

// One direction of the lobe a sample; the image is blurred by what the samples leave between them
// (Krivanek and Colbert, "Real-time Shading with Filtered Importance Sampling", EGSR 2008).
vec3 world_specular(surface s, vec3 p, ivec2 pixel, float within)
{
    if (s.specular == vec3(0.0))
        return vec3(0.0);
    vec2 lot = fract(vec2(pixel_hash(pixel, 21u), pixel_hash(pixel, 22u)) / 4294967296.0 +
                     float(frame.size.z) * vec2(0.7548776662466927, 0.5698402909980532));
    vec3 towards;
    float density;
    vec3 reflected = bsdf_sample(s, lot, towards, density);
    if (reflected == vec3(0.0))
        return vec3(0.0);
    float lit = world_visible(p, s.normal, towards,
                              vec3(pixel_random(pixel, 23u), pixel_random(pixel, 24u),
                                   pixel_random(pixel, 25u)));
    if (lit == 0.0)
        return vec3(0.0);
    float level = 0.0;
    if (frame.world_color.w != 0.0) {
        ivec2 size = textureSize(world_image, 0);
        float texel = 4.0 * PI / float(size.x * size.y);
        level = max(0.5 * log2(1.0 / (frame.clip.w * density * texel)), 0.0);
    }
    return reflected * world_radiance(towards, level) *
           (lit * world_transmittance(p, towards, within));
}

// Light that was scattered or reflected before. What mirrors show of it is as soft as the lattice.
vec3 field_surface(surface s, vec3 p, vec3 near)
{
    vec3 before = s.normal * (0.5 * frame.fields[0].lower.w);
    float left;
    vec3 q = field_leaves(p + before, left) - before;
    if (left <= 0.0)
        return vec3(0.0);
    field_light light = field_at(q, s.normal, s.view, frame.field.x - 1);
    return left * (bsdf_diffuse_mean(s) * near * field_irradiance(light, s.normal) / PI +
                   s.specular * field_radiance(light, reflect(-s.view, s.normal)));
}

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, int(frame.march.z));
    if (any(greaterThanEqual(pixel, ivec2(frame.size.x, int(frame.march.w)))))
        return;
    vec4 normal_depth = texelFetch(gbuffer_normal, pixel, 0);
    vec3 radiance = vec3(0.0);
    if (normal_depth.w > NO_DEPTH) {
        view_ray ray = pixel_ray(pixel);
        vec4 diffuse = texelFetch(gbuffer_diffuse, pixel, 0);
        surface s;
        s.normal = normal_depth.xyz;
        s.view = -ray.direction;
        s.diffuse = diffuse.rgb;
        s.roughness = diffuse.w;
        s.specular = texelFetch(gbuffer_specular, pixel, 0).rgb;
        s.burley = texelFetch(gbuffer_emission, pixel, 0).w;
        vec3 p = ray.origin + ray.direction * (normal_depth.w * ray.stretch);
        uint i = 0u;
        if (frame.counts.x > 0u) do
            radiance += light_surface(s, p, light_at(i), pixel, i);
        while (++i < frame.counts.x);
        if (frame.world.y > 0u && frame.fog_upper.w == 0.0) {
            float within = pixel_random(pixel, 8u);
            radiance += world_diffuse(s, p, pixel, within) + world_specular(s, p, pixel, within);
        }
        if (field_exists()) {
            // LPV's light is as published.
            vec3 near = vec3(1.0);
            if (frame.field.y != 0)
                near = nearby_lit(nearby_visible(s, p, normal_depth.w, pixel, field_cell(p)), s.diffuse);
            radiance += field_surface(s, p, near);
        }
    }
    imageStore(surface_image, pixel, vec4(radiance, 0.0));
}
