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

// Where in a map p is: x, y: 0..1; z: distance from the light, as the map has it. SHADOW_OUTSIDE in z where it does
// not reach.
vec3 shadow_place(gpu_shadow_view view, vec3 p)
{
    vec4 clip = view.clip_from_world * vec4(p, 1.0);
    vec2 uv = clip.xy / clip.w * 0.5 + 0.5;
    if (clip.w <= 0.0 || any(lessThan(uv, vec2(0.0))) || any(greaterThan(uv, vec2(1.0))))
        return vec3(uv, SHADOW_OUTSIDE);
    return vec3(uv, view.range.x != 0.0 ? view.range.z - clip.z * (view.range.z - view.range.y) : clip.w);
}

// Texels of the layer, from a place in a map.
vec2 shadow_texel(gpu_shadow_view view, vec2 uv, float rim)
{
    float side = float(frame.counts.y);
    vec2 low = view.tile.xy * side; // whole texels of this map, and none of the one beside it in the layer
    return clamp((view.tile.xy + uv * view.tile.z) * side, low + rim, low + view.tile.z * side - rim);
}

// The maps are from first to last: where one does not reach, the next is asked. In loops, so that software
// does not ask all. Beyond all of them all is lit.

// A point of a medium has no normal to tell how surfaces lie. Near one a texel's depth is as often too near as
// too far, and left at that: fog that is dark right before a lit wall is not seen, light right behind a dark
// one is. What may lie on a surface stays `clear` of it, in sizes of a texel of a parallel map.
float shadow_medium(int first, int last, vec3 p, float clear)
{
    do {
        gpu_shadow_view view = shadow_view(first);
        vec3 place = shadow_place(view, p);
        if (place.z == SHADOW_OUTSIDE)
            continue;
        ivec2 texel = ivec2(shadow_texel(view, place.xy, 0.5));
        float depth = texelFetch(shadow_maps, ivec3(texel, int(view.tile.w)), 0).r;
        return shadow_distance(view, depth) < place.z - clear * view.range.w ? 0.0 : 1.0;
    } while (++first <= last);
    return 1.0;
}

// Of a surface the four texels around p are asked, each for where the surface's plane is in it, as far as that
// is nearer to the light: one that comes nearer does not shadow itself, and where it goes away another one
// that meets it may be lit as well. p itself stays where it is: stepping off the surface, by a texel along its
// normal, moves the rims of shadows by more than that in flat light. The slope is bounded at grazing light.
float shadow_surface(int first, int last, vec3 p, float distance, vec3 normal, vec3 towards)
{
    float cosine = clamp(dot(normal, towards), 0.05, 1.0);
    float slope = min(sqrt(1.0 - cosine * cosine) / cosine, 4.0);
    do {
        gpu_shadow_view view = shadow_view(first);
        vec3 place = shadow_place(view, p);
        if (place.z == SHADOW_OUTSIDE)
            continue;
        vec2 texel = shadow_texel(view, place.xy, 1.0);
        vec4 depths = textureGather(shadow_maps, vec3(texel / float(frame.counts.y), view.tile.w));
        vec2 f = fract(texel - 0.5);
        // How the plane's distance grows from texel to texel.
        mat4 m = view.clip_from_world;
        vec3 across = vec3(m[0].x, m[1].x, m[2].x), up = vec3(m[0].y, m[1].y, m[2].y);
        float metres = view.range.w * distance; // a texel's size
        vec2 grows = vec2(dot(normal, across) * inversesqrt(dot(across, across)),
                          dot(normal, up) * inversesqrt(dot(up, up))) * (metres / cosine);
        vec4 plane = vec4(-f.x, 1.0 - f.x, 1.0 - f.x, -f.x) * grows.x +
                     vec4(1.0 - f.y, 1.0 - f.y, -f.y, -f.y) * grows.y;
        vec4 here = place.z + min(plane, 0.0) - metres * (0.5 + 0.5 * slope);
        vec4 lit;
        for (int i = 0; i < 4; ++i)
            lit[i] = shadow_distance(view, depths[i]) < here[i] ? 0.0 : 1.0;
        return mix(mix(lit.w, lit.z, f.x), mix(lit.x, lit.y, f.x), f.y);
    } while (++first <= last);
    return 1.0;
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

float light_shadow_medium(gpu_light light, gpu_light_sample s, vec3 p)
{
    int first, last;
    if (!maps_of(light, s, p, first, last))
        return 1.0;
    return shadow_medium(first, last, p, 0.0);
}
