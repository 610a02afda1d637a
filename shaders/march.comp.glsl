// SPDX-License-Identifier: GPL-3.0-or-later
// The view ray of every pixel through the media: in-scattered and emitted light, transmittance, and
// the surface or the world behind; added to the passes.
#version 450 core
#include "lib/transmittance.glsl"
#include "lib/shadow.glsl"
#include "lib/sky.glsl"
#include "lib/world.glsl"
#include "lib/phase.glsl"

layout(local_size_x = GROUP_PIXELS, local_size_y = GROUP_PIXELS) in;

layout(binding = SLOT_GBUFFER_NORMAL) uniform sampler2D gbuffer_normal;
layout(binding = SLOT_GBUFFER_SPECULAR) uniform sampler2D gbuffer_specular;
layout(binding = SLOT_GBUFFER_EMISSION) uniform sampler2D gbuffer_emission;
layout(binding = SLOT_SURFACE) uniform sampler2D surface_radiance;

layout(std430, binding = SLOT_ACCUMULATION) buffer accumulation_block
{
    vec4 accumulation[];
};

struct march_state
{
    vec3 direct;        // in-scattered
    vec3 emission;
    vec3 transmittance;
};

// Mean of 1/d^2 over [t0, t1] of a ray whose nearest approach to a point, at distance h, is at t = 0:
// the exact integral, so that a lamp in the fog makes no bright cell and no banding.
float mean_inverse_square(float t0, float t1, float h)
{
    float x = t0 / h, y = t1 / h;
    // atan(y) - atan(x), without cancellation far from the lamp.
    float angle = atan((y - x), 1.0 + x * y);
    if (angle < 0.0)
        angle += PI;
    return angle / (h * (t1 - t0));
}

// Light of all lamps that the point scatters towards the viewer, per unit of sigma_s.
vec3 lamp_scatter(view_ray ray, float t, float t0, float t1, float g, ivec2 pixel)
{
    vec3 p = ray.origin + ray.direction * t;
    vec3 sum = vec3(0.0);
    for (uint i = 0u; i < frame.counts.x; ++i) {
        gpu_light light = lights[i];
        uint turn = (uint(frame.size.z) + pixel_hash(pixel, i)) % light.samples.y;
        gpu_light_sample light_sample = light_samples[light.samples.x + turn];
        vec3 towards;
        float square;
        vec3 intensity = light_intensity(light, light_sample.position.xyz, p, towards, square) *
                         light.factors.z;
        if (intensity == vec3(0.0))
            continue;
        float distance = 1e30;
        if (light.info.x != uint(LIGHT_SUN)) {
            distance = sqrt(square);
            float along = dot(light_sample.position.xyz - ray.origin, ray.direction);
            float h = sqrt(max(square - (along - t) * (along - t), 1e-8));
            intensity *= mean_inverse_square(t0 - along, t1 - along, h);
        }
        float lit = light_shadow(light, light_sample, p, vec3(0.0), false);
        if (lit > 0.0)
            sum += intensity * lit * phase_hg(dot(-towards, -ray.direction), g) *
                   light_transmittance(light, p, towards, distance);
    }
    return sum;
}

// One stretch of the ray, in count even steps, each seen at one jittered point.
void march(inout march_state state, view_ray ray, vec2 span, int count, bool in_lattice,
           ivec2 pixel, float jitter)
{
    float dt = (span.y - span.x) / float(count);
    bool emits = in_lattice && frame.medium_upper.w != 0.0;
    bool fog = fog_exists();
    for (int k = 0; k < count; ++k) {
        float t0 = span.x + float(k) * dt;
        // Each step has a jitter of its own: the errors of a ray's steps then cancel one another.
        float t = t0 + fract(jitter + float(k) * 0.754877666) * dt;
        vec3 p = ray.origin + ray.direction * t;
        vec4 scatter = vec4(0.0);
        vec3 extinct = vec3(0.0), emission = vec3(0.0);
        if (in_lattice) {
            float skip = medium_skip(p, ray.direction);
            if (skip > 0.0) {
                if (!fog) {
                    k += int(skip / dt);
                    continue;
                }
            } else {
                vec3 uvw = medium_coordinate(p);
                scatter = textureLod(medium_scatter, uvw, 0.0);
                extinct = textureLod(medium_extinct, uvw, 0.0).rgb;
                if (emits)
                    emission = textureLod(medium_emission, uvw, 0.0).rgb;
            }
        }
        if (fog) {
            float both = luminance(scatter.rgb) + luminance(frame.fog_sigma_s.rgb);
            scatter.a = both > 0.0 ? (luminance(scatter.rgb) * scatter.a +
                                      luminance(frame.fog_sigma_s.rgb) * frame.fog_sigma_s.w) / both
                                   : 0.0;
            scatter.rgb += frame.fog_sigma_s.rgb;
            extinct += frame.fog_sigma_t.rgb;
            emission += frame.fog_emission.rgb;
        }
        if (extinct == vec3(0.0) && emission == vec3(0.0))
            continue;
        vec3 through = exp(-extinct * dt);
        // Integral of exp(-sigma_t s) over the step; its limit where the medium is thin.
        vec3 weight = mix((1.0 - through) / max(extinct, vec3(1e-12)), vec3(dt),
                          lessThan(extinct * dt, vec3(1e-4)));
        weight *= state.transmittance;
        if (scatter.rgb != vec3(0.0)) {
            vec3 light = lamp_scatter(ray, t, t0, t0 + dt, scatter.a, pixel);
            if (frame.sky_dims.w != 0)
                light += sky_scatter(p, -ray.direction, scatter.a);
            state.direct += weight * scatter.rgb * light;
        }
        state.emission += weight * emission;
        state.transmittance *= through;
        // What is left behind could no longer be told from black.
        if (max(max(state.transmittance.r, state.transmittance.g), state.transmittance.b) < 1e-4) {
            state.transmittance = vec3(0.0);
            return;
        }
    }
}

void march_media(inout march_state state, view_ray ray, float t_near, float t_far, ivec2 pixel)
{
    float jitter = pixel_random(pixel, 11u);
    vec2 fog = vec2(0.0);
    if (fog_exists()) {
        fog = ray_box(ray.origin, ray.direction, frame.fog_lower.xyz, frame.fog_upper.xyz);
        // Beyond this depth of fog nothing is seen, however far it reaches.
        vec3 sigma = frame.fog_sigma_t.rgb;
        float thinnest = min(min(sigma.r, sigma.g), sigma.b);
        fog.y = min(fog.y, max(fog.x, t_near) + 12.0 / max(thinnest, 1e-6));
        fog = vec2(max(fog.x, t_near), min(fog.y, t_far));
    }
    vec2 box = vec2(0.0);
    if (medium_exists()) {
        box = ray_box(ray.origin, ray.direction, frame.medium_lower.xyz, frame.medium_upper.xyz);
        box = vec2(max(box.x, t_near), min(box.y, t_far));
    }
    bool has_box = box.x < box.y;
    int fog_steps = int(frame.march.y);
    vec2 before = has_box ? vec2(fog.x, min(box.x, fog.y)) : fog;
    if (before.x < before.y)
        march(state, ray, before, fog_steps, false, pixel, jitter);
    if (has_box)
        march(state, ray, box, max(int(ceil((box.y - box.x) / frame.march.x)), 1), true, pixel,
              jitter);
    vec2 after = vec2(max(box.y, fog.x), fog.y);
    if (has_box && after.x < after.y)
        march(state, ray, after, fog_steps, false, pixel, jitter);
}

void add(int pass, int index, vec4 value)
{
    int slot = frame.pass_slots[pass >> 2][pass & 3];
    if (slot >= 0)
        accumulation[slot * frame.size.x * frame.size.y + index] += value;
}

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, int(frame.march.z));
    if (any(greaterThanEqual(pixel, ivec2(frame.size.x, int(frame.march.w)))))
        return;
    view_ray ray = pixel_ray(pixel);
    vec4 normal_depth = texelFetch(gbuffer_normal, pixel, 0);
    bool hit = normal_depth.w > 0.0;
    float t_near = frame.clip.x * ray.stretch;
    float t_far = hit ? normal_depth.w * ray.stretch : frame.clip.y * ray.stretch;

    march_state state = march_state(vec3(0.0), vec3(0.0), vec3(1.0));
    march_media(state, ray, t_near, t_far, pixel);

    vec3 surface = vec3(0.0), emission = state.emission, environment = vec3(0.0);
    float alpha = 1.0;
    bool holdout = hit && texelFetch(gbuffer_specular, pixel, 0).w != 0.0;
    if (holdout) {
        alpha = 1.0 - dot(state.transmittance, vec3(1.0 / 3.0));
    } else if (hit) {
        surface = state.transmittance * texelFetch(surface_radiance, pixel, 0).rgb;
        emission += state.transmittance * texelFetch(gbuffer_emission, pixel, 0).rgb;
    } else if (frame.clip.z != 0.0) {
        alpha = 1.0 - dot(state.transmittance, vec3(1.0 / 3.0));
    } else {
        environment = state.transmittance * world_radiance(ray.direction, 0.0);
    }

    int index = pixel.y * frame.size.x + pixel.x;
    vec3 combined = state.direct + emission + surface + environment;
    add(PASS_COMBINED, index, vec4(combined, alpha));
    add(PASS_NORMAL, index, hit ? vec4(normal_depth.xyz, 0.0) : vec4(0.0));
    add(PASS_VOLUME_DIRECT, index, vec4(state.direct, 0.0));
    add(PASS_EMISSION, index, vec4(emission, 0.0));
    add(PASS_ENVIRONMENT, index, vec4(environment, 0.0));
    add(PASS_TRANSMITTANCE, index, vec4(state.transmittance, 0.0));
    // Depth is not averaged: the first sample, through the pixel's centre, tells it.
    if (frame.size.z == 0)
        add(PASS_DEPTH, index, vec4(hit ? normal_depth.w : 1e10, 0.0, 0.0, 0.0));
}
