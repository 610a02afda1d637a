// SPDX-License-Identifier: GPL-3.0-or-later
// One iteration: every cell gathers what its 26 neighbours send it (LPV, sec. 4.3). A link is flown
// in two halves, each through the medium of its cell; what a half scatters stays in that cell and
// leaves anew in the next iteration. Surfaces block a link, and send back what they reflect of it.
// How much they block is told by one of lib/blocked_*.glsl, included before this: a switch between
// them made an iteration a quarter longer.
#include "lib/flow.glsl"
#include "lib/gather.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage; // offset.x: 1 sums what is in flight; y: a float: what the
                            // light of this iteration counts in the field
};

layout(binding = SLOT_FLOW) uniform sampler3D flow_before[3];
layout(binding = SLOT_CELL_EXTINCT) uniform sampler3D cell_extinct;
layout(binding = SLOT_CELL_ALBEDO) uniform sampler3D cell_albedo;
layout(binding = SLOT_WALLS) uniform sampler3D cell_walls;

layout(binding = SLOT_OUTPUT, rgba32f) writeonly uniform image3D flow_image[3];

#include "lib/power.glsl"

vec3 leave(ivec3 cell, int class_, vec3 direction)
{
    return vec3(leaving(texelFetch(flow_before[0], cell, 0), class_, direction),
                leaving(texelFetch(flow_before[1], cell, 0), class_, direction),
                leaving(texelFetch(flow_before[2], cell, 0), class_, direction));
}

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, stage.slab.z);
    vec3 in_flight = vec3(0.0);
    if (in_level(cell) && cell.z < stage.slab.w) {
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
            if (shares.back < 1.0) {
                vec3 comes = leave(beyond, class_, -direction) *
                             fly(texelFetch(cell_extinct, beyond, 0).rgb, way).through *
                             (1.0 - shares.back);
                begins += comes;
                lobes += comes;
            }
            arrive(sum, begins, lobes, mine, albedo, direction);
        }
        count_passed(cell, sum, intBitsToFloat(stage.offset.y));
        for (int c = 0; c < 3; ++c)
            imageStore(flow_image[c], cell, lobe_of(vec4(sum.power[c], sum.flux[c])));
        in_flight = sum.power;
    }
    if (stage.offset.x != 0)
        sum_power(in_flight.r + in_flight.g + in_flight.b);
}
