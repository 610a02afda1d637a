// SPDX-License-Identifier: GPL-3.0-or-later
// Where surfaces cut the links of the field's lattice, and what the cells at a link's ends see of them: what
// is nearest. The picture is seen along one of them, sheared so that each pixel's centre is a line through
// cells' centres: a fragment is a cut, exactly. It is drawn twice: nothing else tells what is nearest of
// all cuts before the last one is drawn.
#version 450 core
#include "lib/material.glsl"
#include "lib/level.glsl"

in vec3 world_position;
in vec2 uv;
flat in uint instance_number;

layout(binding = SLOT_OUTPUT_LINKS, r32ui) uniform uimage3D links_image;
layout(binding = SLOT_OUTPUT_WALLS, r32ui) uniform uimage3D walls_image;
layout(binding = SLOT_OUTPUT_NEAREST, r32ui) uniform uimage3D nearest_image; // two a cell: how near the
                                                 // nearest cut along a link is, and against it

void add(ivec3 texel, vec3 value)
{
    uvec3 parts = uvec3(clamp(value, 0.0, 1.0) * WALL_UNIT + 0.5);
    for (int c = 0; c < 3; ++c)
        imageAtomicAdd(walls_image, texel + ivec3(c, 0, 0), parts[c]);
}

void add_wall(ivec3 cell, vec3 reflectance, vec3 emission)
{
    ivec3 texel = ivec3(WALL_TEXELS * cell.x, cell.yz);
    add(texel, reflectance);
    if (emission != vec3(0.0))
        add(texel + ivec3(WALL_EMISSION, 0, 0), emission);
    imageAtomicAdd(walls_image, texel + ivec3(WALL_COUNT, 0, 0), 1u);
}

// A place on the link as nearest_image has it, from one of its ends; beyond all of the links drawn before.
uint nearness(float off)
{
    return (stage.info.y + 1u) << 28 | uint((1.0 - off) * 268435440.0);
}

void main()
{
    vec4 base = material_base(uv);
    if (!material_casts(base, gl_FragCoord.xy, instance_number, stage.info.x))
        discard;
    ivec3 link = LINKS[stage.info.y];
    int axis = link.x != 0 ? 0 : (link.y != 0 ? 1 : 2);
    vec3 at = (world_position - level.lower.xyz) / level.lower.w - 0.5 + ASIDE;
    float along = floor(at[axis]), off = at[axis] - along;
    ivec3 cell = ivec3(round(at - off * vec3(link)));
    cell[axis] = int(along);
    bool adds = stage.info.z != 0u;
    for (int end = 0; end < 2; ++end) {
        ivec3 from = end == 0 ? cell : cell + link;
        if (!in_level(from))
            continue;
        uint near = nearness(end == 0 ? off : 1.0 - off);
        ivec3 texel = ivec3(2 * from.x + end, from.yz);
        if (!adds)
            imageAtomicMax(nearest_image, texel, near);
        else if (imageLoad(nearest_image, texel).r == near)
            add_wall(from, material.diffuse.rgb * base.rgb, material.emission.rgb * stage.clip.w);
    }
    if (adds)
        return;
    if (in_links(cell))
        imageAtomicOr(links_image, links_texel(cell), 1u << stage.info.y);
    if (stage.info.y < 3u && in_level(cell))
        imageAtomicMax(walls_image, ivec3(WALL_TEXELS * cell.x + WALL_CUTS + axis, cell.yz),
                       uint(off * 253.0) + 1u);
}
