// SPDX-License-Identifier: GPL-3.0-or-later
// The light that propagation begins with: of every cell, what its medium scatters and what its surfaces reflect
// of the lights' own light, as the lobe that it leaves by.
#version 450 core
#include "lib/flow.glsl"
#include "lib/level.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage; // offset: tiles in a row of the surfaces', whether media have scattered any
};

layout(binding = SLOT_REFLECTED) uniform sampler2D reflected[3];

layout(std430, binding = SLOT_SCATTERED_FLOWS) readonly buffer flows_block
{
    vec4 flows[]; // of every cell three: red, green, blue
};

layout(binding = SLOT_OUTPUT, rgba32f) writeonly uniform image3D flow_image[3];

#include "lib/power.glsl"

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, stage.slab.z);
    if (!in_level(cell) || cell.z >= stage.slab.w)
        return;
    ivec2 texel = tiled_texel(cell, level.dims.xyz, stage.offset.x);
    vec3 power;
    for (int c = 0; c < 3; ++c) {
        vec4 flow = texelFetch(reflected[c], texel, 0);
        if (stage.offset.y != 0)
            flow += flows[3 * cell_number(cell) + c];
        imageStore(flow_image[c], cell, lobe_of(flow));
        power[c] = max(flow.x, 0.0);
    }
    tell_power(cell, power);
}
