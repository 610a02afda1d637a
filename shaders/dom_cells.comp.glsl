// SPDX-License-Identifier: GPL-3.0-or-later
// What a cell of the field's lattice is filled with, means over the cell: the media's extinction, their
// albedo and mean cosine, the reflectance of the surfaces in it, and all links that these cut. Strong
// forward scattering counts as none, as everywhere with DOM: extinction comes scaled.
#version 450 core
#include "lib/medium.glsl"
#include "lib/ordinates.glsl"
#include "lib/walls.glsl"
#include "lib/harmonics.glsl"
#include "lib/lines.glsl"
#include "lib/cuts.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage;
};

layout(binding = SLOT_LINKS) uniform usampler3D links;
layout(binding = SLOT_LINES) uniform usampler3D lines;

layout(binding = SLOT_OUTPUT, rgba16f) writeonly uniform image3D cell_image[3]; // extinction; absorbed share,
                                                       // mean cosine; surfaces' reflectance
layout(binding = SLOT_OUTPUT_FIELD, rgba32ui) writeonly uniform uimage3D cuts_image; // links that are cut; how much
                             // of them is closed, two words; points of the cell parted from its middle
layout(binding = SLOT_OUTPUT_FIELD + 1, rgba16f) writeonly uniform image3D depths_image; // of cells, by
                                             // what turns light off its way; not below THINNEST

layout(binding = SLOT_OUTPUT_FIELD + 2, rgba16f) writeonly uniform image3D emission_image; // of surfaces

layout(location = 0) uniform float brightest; // emission of a surface

const int POINTS = 6; // along a cell, at most

uint lines_of(ivec3 cell, int number)
{
    return texelFetch(lines, lines_texel(cell, number), 0).r;
}

bool glows(ivec3 cell)
{
    return lines_of(cell, LINE_EMISSION) != 0u;
}

// How much of a cell's links is closed, as closed_share() wants it: of the lines from points that the cell's
// middle sees to points that its neighbour's sees. What parts others from these is not in the way, but beside
// it, unless the link itself is cut: then they are behind what cuts it. What glows is never rounded to nothing.
uvec2 closed_links(ivec3 cell, uint parted)
{
    uvec2 closed = uvec2(0u);
    bool glows_here = glows(cell);
    for (int i = 0; i < 26; ++i) {
        ivec3 next = i < 13 ? cell + LINKS[i] : cell - LINKS[i - 13];
        uint there = lines_of(next, LINE_PARTED), cut = lines_of(i < 13 ? cell : next, i % 13);
        bool blocked = (cut & MIDDLE) != 0u;
        uint told = POINTS_ACROSS[i % 13] & ~(blocked ? parted & there : parted | there);
        float share = float(bitCount(told & (cut | parted | there))) / float(bitCount(told));
        uint thirds = uint(round(3.0 * share));
        if (thirds == 0u && share > 0.0 && (glows_here || glows(next)))
            thirds = 1u;
        closed |= uvec2(thirds & 1u, thirds >> 1) << i;
    }
    return closed;
}

// Of what surfaces send into a cell over its closed links and it passes on, the part that they would by the
// lines that they cut: thirds say little of small things, nor do they tell that what is on both sides of the
// cell's middle hides itself.
float true_part(ivec3 cell, uvec2 closed)
{
    float looks = 0.0, sends = 0.0;
    for (int i = 0; i < 13; ++i) {
        // By the solid angle of the direction, and how dense its lines are across it.
        float weight = WEIGHTS[link_class(i)] / link_length(i);
        uint ahead = POINTS_ACROSS[i] & lines_of(cell, i);
        uint behind = POINTS_ACROSS[i] & lines_of(cell - LINKS[i], i);
        float there = closed_share(closed, 1u << i), back = closed_share(closed, 1u << (i + 13));
        looks += weight * float(bitCount(ahead ^ behind)) / float(bitCount(POINTS_ACROSS[i]));
        sends += weight * (there * (1.0 - back) + back * (1.0 - there));
    }
    return sends > 0.0 ? looks / sends : 0.0;
}

// The links that are cut, of all 26.
uint cuts_of(ivec3 cell)
{
    uint cuts = texelFetch(links, links_texel(cell), 0).r;
    for (int i = 0; i < 13; ++i)
        cuts |= (texelFetch(links, links_texel(cell - LINKS[i]), 0).r >> i & 1u) << (13 + i);
    return cuts;
}

// A wall cuts nine links or more of the cells next to it, and not all; what is smaller than a cell fewer, or,
// around a cell's middle, all of them.
bool cut_by_little(uint cuts)
{
    int count = bitCount(cuts);
    return count <= 8 || count == 26;
}

// Whether the surfaces that a cell knows are of such things alone.
bool are_small(ivec3 cell, uint cuts)
{
    bool small = cut_by_little(cuts);
    for (int i = 0; i < 26 && small; ++i)
        if ((cuts >> i & 1u) != 0u)
            small = cut_by_little(cuts_of(i < 13 ? cell + LINKS[i] : cell - LINKS[i - 13]));
    return small;
}

// Of surfaces so small that no link's middle meets them.
vec3 line_surface(ivec3 cell, int number)
{
    return unpackUnorm4x8(lines_of(cell, number)).rgb;
}

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, stage.slab.z);
    if (!in_level(cell) || cell.z >= stage.slab.w)
        return;
    float side = level.lower.w;
    vec3 lower = level.lower.xyz + vec3(cell) * side;
    uint parted = lines_of(cell, LINE_PARTED);
    medium_mean medium = mean_of_medium(lower + 0.5 * side, side, POINTS, parted);
    vec3 extinct = medium.sigma_t, scatter = medium.sigma_s_scaled;
    float g_weight = luminance(medium.sigma_s), g_sum = medium.g * g_weight;
    if (fog_exists()) {
        vec3 filled = clamp((min(frame.fog_upper.xyz, lower + side) -
                             max(frame.fog_lower.xyz, lower)) / side, 0.0, 1.0);
        float part = filled.x * filled.y * filled.z, g = frame.fog_sigma_s.w;
        extinct += part * frame.fog_sigma_t.rgb;
        scatter += part * (1.0 - forward_share(g)) * frame.fog_sigma_s.rgb;
        g_sum += part * g * luminance(frame.fog_sigma_s.rgb);
        g_weight += part * luminance(frame.fog_sigma_s.rgb);
    }
    uint cuts = cuts_of(cell);
    extinct = clamp(extinct, vec3(0.0), vec3(65504.0));
    imageStore(cell_image[0], cell, fit(extinct, 0.0));
    vec3 albedo = clamp(scatter / max(extinct, vec3(1e-12)), 0.0, 1.0);
    float g = g_sum / max(g_weight, 1e-12);
    // As what it lacks to 1: halves near 1 are too coarse, and of light that is scattered a hundred times
    // each counts.
    imageStore(cell_image[1], cell, fit(1.0 - albedo, scatter == vec3(0.0) ? EMPTY : g));
    vec3 turns = extinct * (1.0 - albedo * scaled_bands(g).y) * side;
    imageStore(depths_image, cell, vec4(clamp(turns, vec3(THINNEST), vec3(65504.0)), 0.0));
    bool met = walls_met(cell) > 0u;
    vec3 reflectance = met ? mean_of_walls(cell, 0) : line_surface(cell, LINE_REFLECTANCE);
    vec3 emission = met ? mean_of_walls(cell, WALL_EMISSION) : line_surface(cell, LINE_EMISSION);
    uvec2 closed = closed_links(cell, parted);
    if (emission != vec3(0.0) && are_small(cell, cuts)) {
        float part = true_part(cell, closed);
        emission *= part;
        // What meets the rest goes on, if by way of all closed links.
        reflectance = clamp(1.0 - part * (1.0 - reflectance), 0.0, 1.0);
    }
    imageStore(cell_image[2], cell, vec4(reflectance, 0.0));
    imageStore(emission_image, cell, vec4(min(emission * brightest, vec3(65504.0)), 0.0));
    imageStore(cuts_image, cell, uvec4(cuts, closed, parted));
}
