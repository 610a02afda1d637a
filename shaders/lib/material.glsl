// SPDX-License-Identifier: GPL-3.0-or-later
// The material and the alpha test of the drawing stages.
#include "lib/draw.glsl"
#include "lib/hash.glsl"

layout(std140, binding = SLOT_MATERIAL) uniform material_block
{
    gpu_material material; // of the draw
};

layout(binding = SLOT_MATERIAL_BASE) uniform sampler2D base_image;
layout(binding = SLOT_MATERIAL_ROUGHNESS) uniform sampler2D roughness_image;

vec4 material_base(vec2 uv)
{
    if ((material.flags.x & MATERIAL_BASE_IMAGE) == 0u)
        return vec4(1.0);
    if ((material.flags.x & MATERIAL_CLIP_IMAGE) != 0u &&
        (any(lessThan(uv, vec2(0.0))) || any(greaterThan(uv, vec2(1.0)))))
        return vec4(0.0);
    return texture(base_image, uv);
}

float material_alpha(vec4 base)
{
    return material.specular.w *
           ((material.flags.x & MATERIAL_ALPHA_IMAGE) != 0u ? base.a : 1.0);
}

// Shadow maps know no colour: what passes a tinted surface is thinned by its luminance instead.
float material_shadow_alpha(float alpha)
{
    return 1.0 - (1.0 - alpha) * min(dot(material.transparent.rgb, vec3(0.2126, 0.7152, 0.0722)),
                                     1.0);
}

// False where this sample sees through the surface. Blending is coverage, drawn by lot for every
// pixel, surface and sample, so that the mean over the samples is exact in any order of surfaces.
bool material_covers(float alpha, vec2 pixel, uint surface, uint seed)
{
    if ((material.flags.x & MATERIAL_ALPHA_CLIP) != 0u)
        return alpha >= material.metal.w;
    if ((material.flags.x & MATERIAL_ALPHA_BLEND) == 0u)
        return true;
    uint start = hash(uint(pixel.x) + hash(uint(pixel.y) + hash(surface)));
    // Another irrational than the world's directions follow: the samples that hit a surface must
    // see them all.
    float lot = fract(float(start) * (1.0 / 4294967296.0) + float(seed) * 0.6710436067);
    return lot < alpha;
}

// The same for a light's rays, that know no colour.
bool material_casts(vec4 base, vec2 pixel, uint surface, uint seed)
{
    float alpha = material_shadow_alpha(material_alpha(base));
    return material_covers(alpha, pixel, surface, seed);
}
