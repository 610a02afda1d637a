// SPDX-License-Identifier: GPL-3.0-or-later
// One iteration: every cell gathers what its 26 neighbours send it (LPV, sec. 4.3). A link is flown
// in two halves, each through the medium of its cell; what a half scatters stays in that cell and
// leaves anew in the next iteration. Surfaces block a link, and send back what they reflect of it.
// How much they block is told by one of lib/blocked_*.glsl, included before this: a switch between
// them made an iteration a quarter longer.
#include "lib/flow.glsl"
#include "lib/level.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage; // offset.x: 1 tells what is in flight; y: a float: what the
                            // light of this iteration counts in the field; z: 1: there is a
                            // lattice around this one
};

layout(binding = SLOT_FLOW) uniform sampler3D flow_before[3];
layout(binding = SLOT_FLOW_AROUND) uniform sampler3D flow_around[3];
layout(binding = SLOT_AROUND) uniform usampler3D cells_around;
layout(binding = SLOT_CELL_EXTINCT) uniform sampler3D cell_extinct;
layout(binding = SLOT_CELL_ALBEDO) uniform sampler3D cell_albedo;
layout(binding = SLOT_WALLS) uniform sampler3D cell_walls;

layout(binding = SLOT_OUTPUT, rgba32f) writeonly uniform image3D flow_image[3];
layout(binding = SLOT_OUTPUT_FIELD, rgba32f) uniform image3D field_image[3];

#include "lib/power.glsl"

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

vec3 leave(sampler3D flow[3], ivec3 cell, int class_, vec3 direction)
{
    return vec3(leaving(texelFetch(flow[0], cell, 0), class_, direction),
                leaving(texelFetch(flow[1], cell, 0), class_, direction),
                leaving(texelFetch(flow[2], cell, 0), class_, direction));
}

// From a cell beyond the lattice, what the lattice around it knows. Each cell of that one is eight of
// this one's, and an iteration of it two of this one's, so that light gets as far. What media scatter
// in a cell leaves it once more: for the same light cells send the more the thicker they are, by the
// share that the mean way through one dims.
vec3 leave_around(ivec3 cell, int class_, vec3 direction, vec3 extinct)
{
    uvec4 around = texelFetch(cells_around, links_texel(cell), 0);
    if (around.w == 0u)
        return vec3(0.0);
    vec3 dimmed = exp(-MEAN_WAY * level.lower.w * extinct);
    return leave(flow_around, ivec3(around.xyz), class_, direction) * (1.0 + dimmed) * (1.0 / 16.0);
}

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, stage.slab.z);
    if (!in_level(cell) || cell.z >= stage.slab.w)
        return;
    float side = level.lower.w;
    vec3 extinct = texelFetch(cell_extinct, cell, 0).rgb;
    vec3 albedo = texelFetch(cell_albedo, cell, 0).rgb;
    vec3 wall = texelFetch(cell_walls, cell, 0).rgb;
    cell_blockers own_blockers = blockers_of(cell);
    vec4 own[3];
    for (int c = 0; c < 3; ++c)
        own[c] = texelFetch(flow_before[c], cell, 0);
    gathered sum = gathered(vec3(0.0), mat3(0.0), vec3(0.0), mat3(0.0));
    for (int number = 0; number < 26; ++number) {
        int i = number % 13;
        ivec3 link = number < 13 ? LINKS[i] : -LINKS[i];
        int class_ = link_class(i);
        float way = 0.5 * side * link_length(i);
        vec3 direction = vec3(link) / link_length(i);
        ivec3 beyond = cell + link;
        bool there = in_level(beyond);
        half_way mine = fly(extinct, way);

        vec3 out_ = vec3(leaving(own[0], class_, direction), leaving(own[1], class_, direction),
                         leaving(own[2], class_, direction));
        sum.power += out_ * (1.0 - mine.through) * albedo;
        sum.passed += out_ * mine.mean;
        add_flux(sum.passed_flux, out_ * mine.mean, direction);

        link_blockers shares = blockers_between(own_blockers, beyond, number, there);
        vec3 begins = vec3(0.0);
        vec3 lobes = vec3(0.0); // the same, times their mean cosines to the link
        if (shares.there > 0.0) {
            begins = out_ * mine.through * wall * shares.there;
            lobes = begins * (2.0 / 3.0);
        }
        if (shares.back < 1.0 && (there || stage.offset.z != 0)) {
            vec3 comes = 1.0 - vec3(shares.back);
            if (there)
                comes *= leave(flow_before, beyond, class_, -direction) *
                         fly(texelFetch(cell_extinct, beyond, 0).rgb, way).through;
            else
                comes *= leave_around(beyond, class_, -direction, extinct) * mine.through;
            begins += comes;
            lobes += comes;
        }
        vec3 arrives = begins * mine.through;
        sum.power += arrives + (begins - arrives) * albedo;
        add_flux(sum.flux, lobes * mine.through, -direction);
        sum.passed += begins * mine.mean;
        add_flux(sum.passed_flux, lobes * mine.mean, -direction);
    }
    float counts = intBitsToFloat(stage.offset.y) / (side * side * side);
    for (int c = 0; c < 3; ++c) {
        vec4 field = imageLoad(field_image[c], cell);
        field += vec4(sum.passed[c], sum.passed_flux[c]) * counts;
        imageStore(field_image[c], cell, field);
        imageStore(flow_image[c], cell, lobe_of(vec4(sum.power[c], sum.flux[c])));
    }
    if (stage.offset.x != 0)
        tell_power(cell, sum.power);
}
