// SPDX-License-Identifier: GPL-3.0-or-later
// What a pixel sees: media, surface or world, and lamps; added to the passes.
#include "lib/march.glsl"
#include "lib/world.glsl"
#include "lib/lamp.glsl"

layout(binding = SLOT_GBUFFER_SPECULAR) uniform sampler2D gbuffer_specular;
layout(binding = SLOT_GBUFFER_EMISSION) uniform sampler2D gbuffer_emission;
layout(binding = SLOT_GBUFFER_TINT) uniform sampler2D gbuffer_tint;
layout(binding = SLOT_SURFACE) uniform sampler2D surface_radiance;

layout(std430, binding = SLOT_ACCUMULATION) buffer accumulation_block
{
    vec4 accumulation[];
};

void add(int pass, int index, vec4 value)
{
    int slot = frame.pass_slots[pass >> 2][pass & 3];
    if (slot >= 0)
        accumulation[slot * frame.size.x * frame.size.y + index] += value;
}

// The pixel's row is one of this dispatch.
bool in_picture(ivec2 pixel)
{
    return all(lessThan(pixel, ivec2(frame.size.x, int(frame.march.w))));
}

void compose(ivec2 pixel, pixel_view view, march_state state)
{
    // What reaches the camera of what is behind the media and of what is seen through.
    vec3 tint = texelFetch(gbuffer_tint, pixel, 0).rgb;
    vec3 behind = state.transmittance * tint;
    vec3 surface = vec3(0.0), environment = vec3(0.0);
    vec3 emission = state.emission + tint * lamps_seen(view.ray, view.t_near, view.t_far, view.hit);
    float alpha = 1.0;
    bool holdout = view.hit && texelFetch(gbuffer_specular, pixel, 0).w != 0.0;
    if (holdout) {
        alpha = 1.0 - dot(behind, vec3(1.0 / 3.0));
    } else if (view.hit) {
        surface = behind * texelFetch(surface_radiance, pixel, 0).rgb;
        emission += behind * texelFetch(gbuffer_emission, pixel, 0).rgb;
    } else if (frame.clip.z != 0.0) {
        alpha = 1.0 - dot(behind, vec3(1.0 / 3.0));
    } else {
        environment = behind * world_radiance(view.ray.direction, 0.0);
    }

    int index = pixel.y * frame.size.x + pixel.x;
    vec3 combined = state.direct + state.indirect + emission + surface + environment;
    add(PASS_COMBINED, index, vec4(combined, alpha));
    add(PASS_NORMAL, index, view.hit ? vec4(view.normal_depth.xyz, 0.0) : vec4(0.0));
    add(PASS_VOLUME_DIRECT, index, vec4(state.direct, 0.0));
    add(PASS_VOLUME_INDIRECT, index, vec4(state.indirect, 0.0));
    add(PASS_EMISSION, index, vec4(emission, 0.0));
    add(PASS_ENVIRONMENT, index, vec4(environment, 0.0));
    add(PASS_TRANSMITTANCE, index, vec4(state.transmittance, 0.0));
    // Depth is not averaged: the first sample, through the pixel's centre, tells it.
    if (frame.size.z == 0)
        add(PASS_DEPTH, index, vec4(view.hit ? view.normal_depth.w : 1e10, 0.0, 0.0, 0.0));
}
