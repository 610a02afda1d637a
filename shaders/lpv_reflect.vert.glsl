// SPDX-License-Identifier: GPL-3.0-or-later
// One point a texel of a reflective shadow map: the light that the surface there reflects, into the
// cell half a cell before it, lest it light itself (LPV, sec. 4.2; Kaplanyan and Dachsbacher,
// "Cascaded Light Propagation Volumes for Real-time Indirect Illumination", I3D 2010, sec. 3.1).
#version 450 core
#include "lib/transmittance.glsl"
#include "lib/shadow.glsl"
#include "lib/level.glsl"
#include "lib/cuts.glsl"

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_reflection stage;
};

layout(binding = SLOT_LINKS) uniform usampler3D links;
layout(binding = SLOT_RSM) uniform sampler2D rsm[3]; // position, normal, reflectance

flat out vec3 power;
flat out vec3 axis;

// Power that the light sends through a texel, W.
vec3 texel_power(vec3 p, out vec3 towards)
{
    gpu_light_sample s = light_sample_at(stage.what.y);
    float area = stage.scale.x * stage.scale.x;
    if (stage.what.x < 0) {
        towards = s.position.xyz;
        return s.weight.rgb * area *
               distant_transmittance(p, towards, 2.0 * frame.medium_lower.w, 0.5);
    }
    gpu_light light = light_at(stage.what.x);
    float square;
    vec3 intensity = light_intensity(light, s.position.xyz, p, towards, square) * light.factors.x;
    if (light.info.x == uint(LIGHT_SUN))
        return intensity * area * light_transmittance(light, p, towards, 1e30);
    if (shadow_face(light, p - s.position.xyz) != stage.what.z)
        return vec3(0.0); // faces reach a little into one another
    // A plane's texel at 1 m before the eye fills texel^2 cos^3 of solid angle.
    float distance = sqrt(square);
    float cosine = (stage.clip_from_world * vec4(p, 1.0)).w / distance;
    return intensity * (area * cosine * cosine * cosine) *
           light_transmittance(light, p, towards, distance);
}

// Along the surface's normal as far aside as links see it: else one through cells' centres would light
// cells behind it.
ivec3 cell_at(vec3 p, vec3 normal)
{
    return ivec3(floor((p - level.lower.xyz) / level.lower.w + ASIDE * abs(normal)));
}

// Whether a surface cuts the link between two neighbours; far ones are taken to be parted.
bool is_parted(ivec3 a, ivec3 b)
{
    ivec3 link = b - a;
    if (any(greaterThan(abs(link), ivec3(1))))
        return true;
    uint number = link_number(link);
    bool along = number < 13u; // else it is b's, against that
    ivec3 from = along ? a : b;
    uint cut = texelFetch(links, links_texel(from), 0).r >> (along ? number : number - 13u) & 1u;
    return link != ivec3(0) && in_links(from) && cut != 0u;
}

void main()
{
    power = axis = vec3(0.0);
    gl_Position = vec4(0.0, 0.0, 2.0, 1.0); // nowhere
    ivec2 texel = divided(gl_VertexID, stage.what.w).yx;
    vec4 position = texelFetch(rsm[0], texel, 0);
    if (position.w == 0.0)
        return;
    vec3 towards;
    vec3 p = position.xyz;
    power = texel_power(p, towards) * stage.scale.y * texelFetch(rsm[2], texel, 0).rgb;
    axis = texelFetch(rsm[1], texel, 0).xyz;
    if (dot(axis, towards) < 0.0)
        axis = -axis; // both sides of a surface are the same
    float reach = 0.5 * level.lower.w * (abs(axis.x) + abs(axis.y) + abs(axis.z));
    ivec3 cell = cell_at(p + axis * reach, axis);
    // In a wedge's tip the other wall may be nearer than that. Towards the light nothing is; but along the
    // surface, where light grazes it, the cell may be one behind it.
    ivec3 towards_light = cell_at(p + towards * (reach / max(dot(axis, towards), 0.5)), axis);
    if (dot(cell_centre(level, towards_light) - p, axis) > 0.0 && is_parted(cell, towards_light))
        cell = towards_light;
    if (!in_level(cell))
        return;
    gl_Position = tiled_position(cell, level.dims.xyz, stage.tiles.x);
}
