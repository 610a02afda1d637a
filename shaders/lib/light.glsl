// SPDX-License-Identifier: GPL-3.0-or-later
// What lamps send to a point, without what stands between.
#include "lib/frame.glsl"

layout(binding = SLOT_LIGHTS) uniform usamplerBuffer lights;
layout(binding = SLOT_LIGHT_SAMPLES) uniform samplerBuffer light_samples;

gpu_light light_at(uint number)
{
    int first = int(number) * LIGHT_TEXELS;
    vec4 texels[LIGHT_TEXELS - 2];
    for (int i = 0; i < LIGHT_TEXELS - 2; ++i)
        texels[i] = uintBitsToFloat(texelFetch(lights, first + i));
    return gpu_light(texels[0], texels[1], texels[2], texels[3], texels[4], texels[5],
                     texelFetch(lights, first + 6), texelFetch(lights, first + 7));
}

gpu_light_sample light_sample_at(uint number)
{
    int first = int(number) * LIGHT_SAMPLE_TEXELS;
    return gpu_light_sample(texelFetch(light_samples, first), texelFetch(light_samples, first + 1));
}

// Points and spots are disks that face whom they light, as in Cycles.
bool is_disk(gpu_light light)
{
    return light.info.x == uint(LIGHT_POINT) || light.info.x == uint(LIGHT_SPOT);
}

// Their light at a distance d is 2 (1 - d / sqrt(d^2 + r^2)) / r^2 instead of 1 / d^2: the same is
// 1 / (d^2 + softness), within 5 % from d = r / 2 on, and all in all within 2 %. Other lamps have none.
float softness(gpu_light light)
{
    return is_disk(light) ? 0.7 * light.position.w * light.position.w : 0.0;
}

// Cycles' cone: the cosine itself, faded over the blend (Blender 3.4).
float spot_cone(gpu_light light, float cosine)
{
    float t = cosine - light.tangent.w;
    if (t <= 0.0)
        return 0.0;
    float smoothing = light.bitangent.w;
    return cosine * (t < smoothing ? smoothstep(0.0, smoothing, t) : 1.0);
}

// Cycles' area spread: a fall from the axis to the limiting angle, scaled to keep the power.
float area_spread(gpu_light light, float cosine)
{
    float limit = light.factors.w;
    if (limit <= 0.0)
        return 1.0;
    float tangent = sqrt(max(1.0 - cosine * cosine, 0.0)) / max(cosine, 1e-6);
    return max((limit - tangent) / (limit - atan(limit)), 0.0);
}

// Shirley and Chiu, "A Low Distortion Map Between Disk and Square", JGT 1997.
vec2 square_to_disk(vec2 p)
{
    if (p == vec2(0.0))
        return p;
    bool wide = abs(p.x) > abs(p.y);
    float radius = wide ? p.x : p.y;
    float angle = wide ? 0.25 * PI * (p.y / p.x) : 0.5 * PI - 0.25 * PI * (p.x / p.y);
    return radius * vec2(cos(angle), sin(angle));
}

// For a pixel's sample, where in its stratum a light's sample is: -1..1.
vec2 light_lot(ivec2 pixel, uint number)
{
    return pixel_random_2(pixel, 2u * number + 101u) * 2.0 - 1.0;
}

// The point of the light that a sample stands for; on an area light moved by lot (-1..1) within the
// sample's stratum.
vec3 light_point(gpu_light light, gpu_light_sample s, vec2 lot)
{
    if (light.info.x < uint(LIGHT_RECTANGLE))
        return s.position.xyz;
    vec2 p = s.weight.xy + lot * s.weight.zw;
    if (light.info.x == uint(LIGHT_ELLIPSE))
        p = square_to_disk(p);
    return light.position.xyz + light.tangent.xyz * p.x + light.bitangent.xyz * p.y;
}

// Radiance times solid angle, per sample of the light, that arrives from `point` (for a sun: a unit
// vector towards it) at p, without the 1/d^2, which comes out in `square`.
vec3 light_intensity(gpu_light light, vec3 point, vec3 p, out vec3 towards, out float square)
{
    if (light.info.x == uint(LIGHT_SUN)) {
        towards = point;
        square = 1.0;
        return light.radiance.rgb;
    }
    vec3 v = point - p;
    square = max(dot(v, v), 1e-12);
    towards = v * inversesqrt(square);
    float cosine = dot(-towards, light.axis.xyz);
    if (light.info.x == uint(LIGHT_POINT))
        return light.radiance.rgb;
    if (light.info.x == uint(LIGHT_SPOT))
        return light.radiance.rgb * spot_cone(light, cosine);
    return light.radiance.rgb * (light.radiance.w * max(cosine, 0.0) * area_spread(light, cosine));
}
