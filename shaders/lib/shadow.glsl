// SPDX-License-Identifier: GPL-3.0-or-later
// Looking into the shadow maps: reversed depth, 0 where nothing was drawn.
#include "lib/light.glsl"

layout(binding = SLOT_SHADOW) uniform sampler2DArray shadow_maps;

layout(binding = SLOT_SHADOW_VIEWS) uniform samplerBuffer shadow_views;

gpu_shadow_view shadow_view(int number)
{
    vec4 texels[SHADOW_VIEW_TEXELS];
    for (int i = 0; i < SHADOW_VIEW_TEXELS; ++i)
        texels[i] = texelFetch(shadow_views, number * SHADOW_VIEW_TEXELS + i);
    return gpu_shadow_view(mat4(texels[0], texels[1], texels[2], texels[3]), texels[4], texels[5]);
}

// Distance of the occluder that a texel of the map holds.
float shadow_distance(gpu_shadow_view view, float depth)
{
    if (view.range.x != 0.0)
        return depth > 0.0 ? view.range.z - depth * (view.range.z - view.range.y) : 1e30;
    return view.range.y / max(depth, 1e-30);
}

const float SHADOW_OUTSIDE = -1.0;

// The share of a light sample that geometry lets through to p: one texel (soft false) or a
// bilinear comparison of four. SHADOW_OUTSIDE where the map does not reach.
float shadow_test(gpu_shadow_view view, vec3 p, float bias, bool soft)
{
    vec4 clip = view.clip_from_world * vec4(p, 1.0);
    if (clip.w <= 0.0)
        return SHADOW_OUTSIDE;
    vec2 uv = clip.xy / clip.w * 0.5 + 0.5;
    if (any(lessThan(uv, vec2(0.0))) || any(greaterThan(uv, vec2(1.0))))
        return SHADOW_OUTSIDE;
    float distance_here = view.range.x != 0.0
                              ? view.range.z - clip.z * (view.range.z - view.range.y)
                              : clip.w;
    distance_here -= bias;
    float side = float(frame.counts.y);
    vec2 texel = (view.tile.xy + uv * view.tile.z) * side;
    // Whole texels of this map, and none of the one beside it in the layer.
    vec2 low = view.tile.xy * side, high = low + view.tile.z * side;
    if (!soft) {
        texel = clamp(texel, low + 0.5, high - 0.5);
        float depth = texelFetch(shadow_maps, ivec3(texel, int(view.tile.w)), 0).r;
        return shadow_distance(view, depth) < distance_here ? 0.0 : 1.0;
    }
    texel = clamp(texel, low + 1.0, high - 1.0);
    vec4 depths = textureGather(shadow_maps, vec3(texel / side, view.tile.w));
    vec4 lit;
    for (int i = 0; i < 4; ++i)
        lit[i] = shadow_distance(view, depths[i]) < distance_here ? 0.0 : 1.0;
    vec2 f = fract(texel - 0.5);
    return mix(mix(lit.w, lit.z, f.x), mix(lit.x, lit.y, f.x), f.y);
}

// The maps are from first to last: where one does not reach, the next is asked. In loops, so that software
// does not ask all. Beyond all of them all is lit.

// A point of a medium has no normal to step off along: near a surface it stays clear of the depths
// that a texel of the map rounds.
float shadow_medium(int first, int last, vec3 p, float distance)
{
    float lit;
    do {
        gpu_shadow_view view = shadow_view(first);
        lit = shadow_test(view, p, 1.5 * view.range.w * distance, false);
    } while (lit == SHADOW_OUTSIDE && ++first <= last);
    return abs(lit);
}

// A surface moves the look-up off itself along its normal by the texel's size. The slope's share of
// the bias is bounded: at grazing light the offset along the normal does the rest.
float shadow_surface(int first, int last, vec3 p, float distance, vec3 normal, vec3 towards)
{
    float cosine = clamp(dot(normal, towards), 0.05, 1.0);
    float slope = min(sqrt(1.0 - cosine * cosine) / cosine, 4.0);
    float lit;
    do {
        gpu_shadow_view view = shadow_view(first);
        float texel = view.range.w * distance;
        lit = shadow_test(view, p + normal * texel, texel * (0.5 + 0.5 * slope), true);
    } while (lit == SHADOW_OUTSIDE && ++first <= last);
    return abs(lit);
}

// Unit vectors across a unit vector, the same as those of csrc/math/frame.cpp.
void frame_around(vec3 forward, out vec3 u, out vec3 v)
{
    float s = forward.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + forward.z);
    float b = forward.x * forward.y * a;
    u = vec3(1.0 + s * forward.x * forward.x * a, s * b, -s * forward.x);
    v = vec3(b, s + forward.y * forward.y * a, -forward.y);
}

// The view that sees along v (from the light), by the light's faces.
int shadow_face(gpu_light light, vec3 v)
{
    if (light.samples.z == 1u)
        return 0; // a spot's one map
    vec3 u, w;
    frame_around(light.axis.xyz, u, w);
    vec3 q = vec3(dot(v, u), dot(v, w), dot(v, light.axis.xyz));
    vec3 m = abs(q);
    if (m.z >= m.x && m.z >= m.y)
        return q.z > 0.0 ? 0 : 5;
    if (m.x >= m.y)
        return q.x > 0.0 ? 1 : 2;
    return q.y > 0.0 ? 3 : 4;
}

// The maps that may see p of a light's sample. False where nothing can stand between.
bool maps_of(gpu_light light, gpu_light_sample s, vec3 p, out int first, out int last)
{
    bool sun = light.info.x == uint(LIGHT_SUN); // one map, or a fine one before a wide one
    int face = sun ? 0 : shadow_face(light, p - s.position.xyz);
    first = int(s.position.w) + face;
    last = first + (sun ? int(light.samples.z) - 1 : 0);
    // No map looks behind an area light, which sends nothing there.
    return s.position.w >= 0.0 && face < int(light.samples.z);
}

float light_shadow(gpu_light light, gpu_light_sample s, vec3 p, vec3 normal)
{
    int first, last;
    if (!maps_of(light, s, p, first, last))
        return 1.0;
    bool sun = light.info.x == uint(LIGHT_SUN);
    vec3 v = sun ? s.position.xyz : s.position.xyz - p;
    float distance = sun ? 1.0 : length(v);
    return shadow_surface(first, last, p, distance, normal, v / distance);
}

// distance: how far a lamp is from p, of no account for suns.
float light_shadow_medium(gpu_light light, gpu_light_sample s, vec3 p, float distance)
{
    int first, last;
    if (!maps_of(light, s, p, first, last))
        return 1.0;
    return shadow_medium(first, last, p, light.info.x == uint(LIGHT_SUN) ? 1.0 : distance);
}
