// SPDX-License-Identifier: GPL-3.0-or-later
// Where surfaces cut the links of the field's lattice. The picture is seen along one of them, sheared
// so that each pixel's centre is a line through cells' centres: a fragment is a cut, exactly.
#version 450 core
#include "lib/material.glsl"
#include "lib/level.glsl"

in vec3 world_position;
in vec2 uv;
flat in uint instance_number;

layout(binding = SLOT_OUTPUT_LINKS, r32ui) uniform uimage3D links_image;
layout(binding = SLOT_OUTPUT_WALLS, r32ui) uniform uimage3D walls_image;

void add(ivec3 texel, vec3 value)
{
    uvec3 parts = uvec3(clamp(value, 0.0, 1.0) * WALL_UNIT + 0.5);
    for (int c = 0; c < 3; ++c)
        imageAtomicAdd(walls_image, texel + ivec3(c, 0, 0), parts[c]);
}

void add_wall(ivec3 cell, vec3 reflectance, vec3 emission)
{
    if (!in_level(cell))
        return;
    ivec3 texel = ivec3(WALL_TEXELS * cell.x, cell.yz);
    add(texel, reflectance);
    if (emission != vec3(0.0))
        add(texel + ivec3(WALL_EMISSION, 0, 0), emission);
    imageAtomicAdd(walls_image, texel + ivec3(WALL_COUNT, 0, 0), 1u);
}

void main()
{
    vec4 base = material_base(uv);
    if (!material_casts(base, gl_FragCoord.xy, instance_number, stage.info.x))
        discard;
    ivec3 link = LINKS[stage.info.y];
    int axis = link.x != 0 ? 0 : (link.y != 0 ? 1 : 2);
    vec3 at = (world_position - level.lower.xyz) / level.lower.w - 0.5 + ASIDE;
    float along = floor(at[axis]);
    ivec3 cell = ivec3(round(at - (at[axis] - along) * vec3(link)));
    cell[axis] = int(along);
    if (in_links(cell))
        imageAtomicOr(links_image, links_texel(cell), 1u << stage.info.y);
    if (stage.info.y < 3u && in_level(cell))
        imageAtomicMax(walls_image, ivec3(WALL_TEXELS * cell.x + WALL_CUTS + axis, cell.yz),
                       uint((at[axis] - along) * 253.0) + 1u);
    vec3 reflectance = material.diffuse.rgb * base.rgb;
    vec3 emission = material.emission.rgb * stage.clip.w;
    add_wall(cell, reflectance, emission);
    add_wall(cell + link, reflectance, emission);
}
