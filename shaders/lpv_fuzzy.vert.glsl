// SPDX-License-Identifier: GPL-3.0-or-later
// One point a texel of a reflective shadow map: the area of the surface there, in faces of a cell,
// into the blockers' lattice. Its cells lie between the centres that links join, so that light
// leaves a surface without being blocked by it (Kaplanyan and Dachsbacher, I3D 2010, sec. 3.3).
#version 450 core
#include "lib/shadow.glsl"
#include "lib/level.glsl"
#include "lib/fuzzy.glsl"

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_reflection stage;
};

layout(binding = SLOT_RSM) uniform sampler2D rsm[3]; // position, normal, reflectance

// Area as seen along the axes, where the normal has a positive part of them, and where a negative
// one; w: the area itself, by the squares of the normal's parts.
flat out vec4 front;
flat out vec4 back;

// A surface more askew has so few texels and each stands for so much that the sum would be noise.
const float LEAST_COSINE = 0.2;

void main()
{
    front = back = vec4(0.0);
    gl_Position = vec4(0.0, 0.0, 2.0, 1.0); // nowhere
    ivec2 texel = divided(gl_VertexID, stage.what.w).yx;
    vec4 position = texelFetch(rsm[0], texel, 0);
    if (position.w == 0.0)
        return;
    vec3 p = position.xyz;
    mat4 m = stage.clip_from_world;
    float area = stage.scale.x * stage.scale.x; // across the way to the eye
    vec3 towards = normalize(vec3(m[0].z, m[1].z, m[2].z)); // depth is reversed
    if (stage.what.x >= 0 && light_at(stage.what.x).info.x != uint(LIGHT_SUN)) {
        vec3 way = light_sample_at(stage.what.y).position.xyz - p;
        if (shadow_face(light_at(stage.what.x), -way) != stage.what.z)
            return; // faces reach a little into one another
        float distance = length(way);
        float cosine = (m * vec4(p, 1.0)).w / distance;
        area *= cosine * cosine * cosine * distance * distance;
        towards = way / distance;
    }
    vec3 normal = texelFetch(rsm[1], texel, 0).xyz;
    float cosine = dot(normal, towards);
    if (abs(cosine) < LEAST_COSINE)
        return;
    normal *= sign(cosine); // both sides of a surface are the same
    float side = level.lower.w;
    area /= abs(cosine) * side * side;
    ivec3 cell = ivec3(floor((p - level.lower.xyz) / side + 0.5 + ASIDE));
    if (!in_blockers(cell))
        return;
    vec3 squares = normal * normal;
    front = area * vec4(max(normal, 0.0), dot(squares, vec3(greaterThan(normal, vec3(0.0)))));
    back = area * vec4(max(-normal, 0.0), dot(squares, vec3(lessThan(normal, vec3(0.0)))));
    gl_Position = tiled_position(cell, blockers_dims(), stage.tiles.y);
}
