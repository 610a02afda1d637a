// SPDX-License-Identifier: GPL-3.0-or-later
// For each cell beyond a lattice's sides, the cell of the lattice around it that it lies in: on the same
// side of surfaces, or light would come through walls there.
#version 450 core
#include "lib/level.glsl"
#include "lib/field.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage; // offset.x: number of the lattice around
};

layout(binding = SLOT_OUTPUT, rgba8ui) writeonly uniform uimage3D around_image; // w: 0: none

void main()
{
    ivec3 texel = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, stage.slab.z);
    ivec3 cell = texel - links_texel(ivec3(0));
    if (!in_links(cell) || texel.z >= stage.slab.w || in_level(cell))
        return;
    gpu_field around = frame.fields[stage.offset.x];
    vec3 at = (cell_centre(level, cell) - around.lower.xyz) / around.lower.w;
    uvec4 found = uvec4(0u);
    if (in_field(around, ivec3(floor(at)))) {
        vec3 low = floor(at - 0.5);
        found = uvec4(home_of(around, ivec3(low), at - 0.5 - low, around.dims.xyz - 1), 1u);
    }
    imageStore(around_image, texel, found);
}
