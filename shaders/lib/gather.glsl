// SPDX-License-Identifier: GPL-3.0-or-later
// What comes to a cell along its links, and what that does in it.
#include "lib/level.glsl"

layout(binding = SLOT_OUTPUT_FIELD, rgba32f) uniform image3D field_image[3];

struct half_way
{
    vec3 through; // what arrives at its end
    vec3 mean;    // m; times the power at its begin: power times path
};

half_way fly(vec3 extinct, float way)
{
    half_way half_;
    vec3 tau = extinct * way;
    half_.through = exp(-tau);
    half_.mean = mix((1.0 - half_.through) / max(extinct, vec3(1e-20)), way * (1.0 - 0.5 * tau),
                     lessThan(tau, vec3(1e-3)));
    return half_;
}

struct gathered
{
    vec3 power;   // that arrives in the cell's middle, or is scattered on its way
    mat3 flux;    // columns: colours
    vec3 passed;  // power times path
    mat3 passed_flux;
};

void add_flux(inout mat3 flux, vec3 power, vec3 direction)
{
    for (int c = 0; c < 3; ++c)
        flux[c] += power[c] * direction;
}

// Light that begins the half of a link to the cell, which leads away along `direction`; `lobes`: the
// same, times the mean cosine to the link.
void arrive(inout gathered sum, vec3 begins, vec3 lobes, half_way mine, vec3 albedo, vec3 direction)
{
    vec3 arrives = begins * mine.through;
    sum.power += arrives + (begins - arrives) * albedo;
    add_flux(sum.flux, lobes * mine.through, -direction);
    sum.passed += begins * mine.mean;
    add_flux(sum.passed_flux, lobes * mine.mean, -direction);
}

// Adds so many times what passed through a cell to the field.
void count_passed(ivec3 cell, gathered sum, float times)
{
    float side = level.lower.w;
    for (int c = 0; c < 3; ++c) {
        vec4 field = imageLoad(field_image[c], cell);
        field += vec4(sum.passed[c], sum.passed_flux[c]) * (times / (side * side * side));
        imageStore(field_image[c], cell, field);
    }
}
