// SPDX-License-Identifier: GPL-3.0-or-later
// Where surfaces cut the links of the field's lattice, and what the cells at a link's ends see of them: what
// is nearest. The picture is seen along one of them, sheared so that each pixel's centre is a line through
// cells' centres: a fragment is a cut, exactly. It is drawn twice: nothing else tells what is nearest of
// all cuts before the last one is drawn. With LINES the picture is finer, and all lines that links are
// made of are asked, too.
// variants: LINES
#version 450 core
#include "lib/material.glsl"
#include "lib/lines.glsl"

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

// The line that goes along a link through a point, in cells, from where it is so far past a cell's middle: the
// cell and the place that it begins at, and how far along the point is.
ivec3 line_through(vec3 at, ivec3 link, int axis, float past, out vec3 begins, out float off)
{
    float from = at[axis] - past, along = floor(from);
    off = from - along;
    begins = at - off * vec3(link);
    ivec3 cell = ivec3(round(begins));
    cell[axis] = int(along);
    return cell;
}

#ifdef LINES
layout(binding = SLOT_OUTPUT_LINES, r32ui) uniform uimage3D lines_image;

// What a line ends at cuts the next one, too: no light slips through a wall between them.
const float MARGIN = 1e-3;

void cut_line(ivec3 cell, int number, uint points)
{
    if (in_links(cell))
        imageAtomicOr(lines_image, lines_texel(cell, number), points);
}

// What is seen from a line's end, so far off; the nearest remains.
void show_line(ivec3 cell, float off, vec3 reflectance, vec3 emission)
{
    if (!in_level(cell))
        return;
    imageAtomicMax(lines_image, lines_texel(cell, LINE_REFLECTANCE), packUnorm4x8(vec4(reflectance, 1.0 - off)));
    if (emission != vec3(0.0))
        imageAtomicMax(lines_image, lines_texel(cell, LINE_EMISSION), packUnorm4x8(vec4(emission, 1.0 - off)));
}

void cut_lines(vec3 at, ivec3 link, int axis, vec3 reflectance, vec3 emission)
{
    int number = int(stage.info.y);
    for (int i = -1; i <= 1; ++i) {
        vec3 begins;
        float off;
        ivec3 cell = line_through(at, link, axis, float(i) / float(LINES_ALONG), begins, off);
        ivec3 point = clamp(ivec3(round(float(LINES_ALONG) * (begins - vec3(cell)))), -1, 1);
        point[axis] = i;
        uint bit = offset_bit(point);
        if ((POINTS_ACROSS[number] & bit) == 0u)
            continue;
        cut_line(cell, number, bit);
        if (off < MARGIN)
            cut_line(cell - link, number, bit);
        if (off > 1.0 - MARGIN)
            cut_line(cell + link, number, bit);
        const float near = 1.0 / float(LINES_ALONG) + MARGIN;
        if (bit == MIDDLE && off < near)
            cut_line(cell, LINE_PARTED, offset_bit(link));
        if (bit == MIDDLE && off > 1.0 - near)
            cut_line(cell + link, LINE_PARTED, offset_bit(-link));
        show_line(cell, off, reflectance, emission);
        show_line(cell + link, 1.0 - off, reflectance, emission);
    }
}
#endif

void main()
{
    vec4 base = material_base(uv);
    if (!material_casts(base, gl_FragCoord.xy, instance_number, stage.info.x))
        discard;
    ivec3 link = LINKS[stage.info.y];
    int axis = link.x != 0 ? 0 : (link.y != 0 ? 1 : 2);
    vec3 at = (world_position - level.lower.xyz) / level.lower.w - 0.5 + ASIDE;
    bool adds = stage.info.z != 0u;
    vec3 reflectance = material.diffuse.rgb * base.rgb, emission = material.emission.rgb * stage.clip.w;
    vec3 begins;
    float off;
    ivec3 cell = line_through(at, link, axis, 0.0, begins, off);
#ifdef LINES
    if (!adds)
        cut_lines(at, link, axis, reflectance, emission);
    if (any(greaterThan(abs(begins - vec3(cell)), vec3(0.5 / float(LINES_ALONG)))))
        return; // not the middle of its lines, which is the link itself
#endif
    for (int end = 0; end < 2; ++end) {
        ivec3 from = end == 0 ? cell : cell + link;
        if (!in_level(from))
            continue;
        uint near = nearness(end == 0 ? off : 1.0 - off);
        ivec3 texel = ivec3(2 * from.x + end, from.yz);
        if (!adds)
            imageAtomicMax(nearest_image, texel, near);
        else if (imageLoad(nearest_image, texel).r == near)
            add_wall(from, reflectance, emission);
    }
    if (adds)
        return;
    if (in_links(cell))
        imageAtomicOr(links_image, links_texel(cell), 1u << stage.info.y);
    if (stage.info.y < 3u && in_level(cell))
        imageAtomicMax(walls_image, ivec3(WALL_TEXELS * cell.x + WALL_CUTS + axis, cell.yz),
                       uint(off * 253.0) + 1u);
}
