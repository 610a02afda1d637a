// SPDX-License-Identifier: GPL-3.0-or-later
// What lamps send to a point, without what stands between.
#include "lib/frame.glsl"

layout(std430, binding = SLOT_LIGHTS) readonly buffer lights_block
{
    gpu_light lights[];
};

layout(std430, binding = SLOT_LIGHT_SAMPLES) readonly buffer light_samples_block
{
    gpu_light_sample light_samples[];
};

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
