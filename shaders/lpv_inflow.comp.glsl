// SPDX-License-Identifier: GPL-3.0-or-later
// What comes into a lattice from the one around it, whose field is known: all of it at once, since only
// the sum over all iterations counts. Light that is even in space and time crosses a link, of all that
// cells send, by its weight; fluence is the way of all light in a cell over its volume.
#version 450 core
#include "lib/blocked_links.glsl"
#include "lib/field.glsl"
#include "lib/flow.glsl"
#include "lib/gather.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage; // offset.x: number of the lattice; y: tiles in a row of the surfaces'
};

layout(binding = SLOT_CELL_EXTINCT) uniform sampler3D cell_extinct;
layout(binding = SLOT_CELL_ALBEDO) uniform sampler3D cell_albedo;

// Power and flux that a cell begins with; surfaces' are there.
layout(binding = SLOT_OUTPUT, rgba32f) uniform image2D begins_image[3];

// Power along a link that leads to the cell, where it crosses between the two.
vec3 inflow(vec3 p, int class_, vec3 along)
{
    field_light light = field_at(p, vec3(0.0), stage.offset.x - 1);
    float side = level.lower.w;
    return max(light.fluence + 3.0 * (along * light.flux), vec3(0.0)) *
           (WEIGHTS[class_] * side * side / MEAN_WAY);
}

bool at_border(ivec3 cell)
{
    return any(equal(cell, ivec3(0))) || any(equal(cell, level.dims.xyz - 1));
}

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, stage.slab.z);
    if (!in_level(cell) || cell.z >= stage.slab.w || !at_border(cell))
        return;
    vec3 extinct = texelFetch(cell_extinct, cell, 0).rgb;
    vec3 albedo = texelFetch(cell_albedo, cell, 0).rgb;
    cell_blockers own = blockers_of(cell);
    gathered sum = gathered(vec3(0.0), mat3(0.0), vec3(0.0), mat3(0.0));
    for (int number = 0; number < 26; ++number) {
        int i = number % 13;
        ivec3 link = number < 13 ? LINKS[i] : -LINKS[i];
        ivec3 beyond = cell + link;
        if (in_level(beyond) || !field_reaches(cell_centre(level, beyond)) ||
            blockers_between(own, beyond, number, true).back == 1.0)
            continue;
        vec3 direction = vec3(link) / link_length(i);
        vec3 comes = inflow(0.5 * (cell_centre(level, cell) + cell_centre(level, beyond)),
                            link_class(i), -direction);
        arrive(sum, comes, comes, fly(extinct, 0.5 * level.lower.w * link_length(i)), albedo,
               direction);
    }
    count_passed(cell, sum, 1.0);
    ivec2 texel = tiled_texel(cell, level.dims.xyz, stage.offset.y);
    for (int c = 0; c < 3; ++c)
        imageStore(begins_image[c], texel,
                   imageLoad(begins_image[c], texel) + vec4(sum.power[c], sum.flux[c]));
}
