// SPDX-License-Identifier: GPL-3.0-or-later
// Lamps as the camera sees them. As in Cycles they hide nothing and leave alpha alone: their light
// is added to what is behind them.
#include "lib/transmittance.glsl"

// Radiance of a lamp along a ray, and how far it is; black where the ray misses it.
vec3 lamp_seen(gpu_light light, view_ray ray, out float t)
{
    t = 1e30;
    if (light.info.x == uint(LIGHT_SUN)) {
        float cosine = dot(ray.direction, light.position.xyz);
        float tangent = light.axis.w;
        if (tangent < 1e-6 || cosine * cosine * (1.0 + tangent * tangent) < 1.0 || cosine < 0.0)
            return vec3(0.0);
        // A disk at distance 1: its irradiance over the solid angle of the part that is seen.
        return light.radiance.rgb / (PI * tangent * tangent * cosine * cosine * cosine);
    }
    vec3 v = light.position.xyz - ray.origin;
    if (light.info.x == uint(LIGHT_POINT) || light.info.x == uint(LIGHT_SPOT)) {
        // A disk that faces the eye.
        float along = dot(v, ray.direction);
        float radius2 = light.position.w * light.position.w;
        if (along <= 0.0 || radius2 <= 0.0)
            return vec3(0.0);
        t = dot(v, v) / along;
        vec3 off = ray.direction * t - v;
        if (dot(off, off) > radius2)
            return vec3(0.0);
        float cone = light.info.x == uint(LIGHT_SPOT)
                         ? spot_cone(light, dot(-ray.direction, light.axis.xyz))
                         : 1.0;
        return light.radiance.rgb * (cone / (PI * radius2));
    }
    float cosine = -dot(ray.direction, light.axis.xyz);
    if (cosine <= 1e-6)
        return vec3(0.0); // it shines to one side
    t = -dot(v, light.axis.xyz) / cosine;
    vec3 off = ray.direction * t - v;
    vec2 at = vec2(dot(off, light.tangent.xyz) / dot(light.tangent.xyz, light.tangent.xyz),
                   dot(off, light.bitangent.xyz) / dot(light.bitangent.xyz, light.bitangent.xyz));
    bool inside = light.info.x == uint(LIGHT_RECTANGLE) ? max(abs(at.x), abs(at.y)) <= 1.0
                                                        : dot(at, at) <= 1.0;
    return inside ? light.radiance.rgb * area_spread(light, cosine) : vec3(0.0);
}

// All lamps that the camera may see along the ray, through the media. Suns are behind everything.
vec3 lamps_seen(view_ray ray, float t_near, float t_far, bool hit)
{
    vec3 sum = vec3(0.0);
    if (t_near < 0.0) { // an orthographic view: what is behind the eye is before the near plane
        ray.origin += ray.direction * t_near;
        t_far -= t_near;
        t_near = 0.0;
    }
    uint i = 0u;
    if (frame.counts.x > 0u) do {
        gpu_light light = light_at(i);
        if ((light.samples.w & LIGHT_CAMERA_VISIBLE) == 0u)
            continue;
        float t;
        vec3 radiance = lamp_seen(light, ray, t);
        bool sun = light.info.x == uint(LIGHT_SUN);
        if (radiance == vec3(0.0) || (sun ? hit : t < t_near || t > t_far))
            continue;
        vec3 tau = fog_tau(ray.origin, ray.direction, t);
        if (medium_exists())
            tau += medium_tau(ray.origin, ray.direction, t, frame.march.x, 0.5);
        sum += radiance * exp(-tau);
    } while (++i < frame.counts.x);
    return sum;
}
