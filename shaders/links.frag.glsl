// SPDX-License-Identifier: GPL-3.0-or-later
// Where surfaces cut the links of the field's lattice. The picture is seen along one of them, sheared
// so that each pixel's centre is a line through cells' centres: a fragment is a cut, exactly.
#version 450 core
#include "lib/material.glsl"
#include "lib/level.glsl"

in vec3 world_position;
in vec2 uv;
flat in uint material_number;
flat in uint instance_number;

layout(binding = SLOT_OUTPUT_LINKS, r32ui) uniform uimage3D links_image;
layout(binding = SLOT_OUTPUT_WALLS, r32ui) uniform uimage3D walls_image;

// Diffuse reflectance in 1/255, and a count.
void add_wall(ivec3 cell, vec3 reflectance)
{
    if (!in_level(cell))
        return;
    ivec3 texel = ivec3(WALL_TEXELS * cell.x, cell.yz);
    uvec3 parts = uvec3(clamp(reflectance, 0.0, 1.0) * 255.0 + 0.5);
    imageAtomicAdd(walls_image, texel, parts.r);
    imageAtomicAdd(walls_image, texel + ivec3(1, 0, 0), parts.g);
    imageAtomicAdd(walls_image, texel + ivec3(2, 0, 0), parts.b);
    imageAtomicAdd(walls_image, texel + ivec3(3, 0, 0), 1u);
}

void main()
{
    gpu_material material = materials[material_number];
    vec4 base = material_base(material, uv);
    if (!material_casts(material, base, gl_FragCoord.xy, instance_number, stage.info.x))
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
        imageAtomicMax(walls_image, ivec3(WALL_TEXELS * cell.x + 4 + axis, cell.yz),
                       uint((at[axis] - along) * 253.0) + 1u);
    vec3 reflectance = material.diffuse.rgb * base.rgb;
    add_wall(cell, reflectance);
    add_wall(cell + link, reflectance);
}
