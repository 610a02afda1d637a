// SPDX-License-Identifier: GPL-3.0-or-later
// The field as surfaces want it, in lpv_finish's form: fluence and flux of light that was scattered or
// reflected, and band 2 of that. And all moments of the light that media scatter towards the eye without
// the lamps: that light and the world's own. And what surfaces send out, for the next run.
#version 450 core
#include "lib/ordinates.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage; // offset.x: 1: the world's own light is known
};

layout(binding = SLOT_MOMENTS) uniform sampler3D moments;
layout(binding = SLOT_MOMENTS + 1) uniform sampler3D world_moments;
layout(binding = SLOT_CUTS) uniform usampler3D cell_cuts;
layout(binding = SLOT_CELL_ALBEDO) uniform sampler3D cell_absorbed;
layout(binding = SLOT_WALLS) uniform usampler3D walls;
layout(binding = SLOT_CELL_WALLS) uniform sampler3D cell_walls;

layout(binding = SLOT_OUTPUT, rgba32f) writeonly uniform image3D field_image;
layout(binding = SLOT_OUTPUT + 1, rgba16f) writeonly uniform image3D light_image;
layout(binding = SLOT_OUTPUT + 2, rgba16f) writeonly uniform image3D wall_image;
layout(binding = SLOT_OUTPUT + 3, rgba16f) writeonly uniform image3D band_image;

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, stage.slab.z);
    if (!in_level(cell) || cell.z >= stage.slab.w)
        return;
    vec3 own[MOMENTS];
    float g = texelFetch(cell_absorbed, cell, 0).w;
    for (int m = 0; m < MOMENTS; ++m) {
        ivec3 texel = moment_texel(cell, m);
        own[m] = texelFetch(moments, texel, 0).rgb;
        vec3 all = own[m];
        if (stage.offset.x != 0)
            all += texelFetch(world_moments, texel, 0).rgb;
        imageStore(light_image, above(texel), fit(all, g));
    }
    imageStore(wall_image, above(cell), texelFetch(cell_walls, cell, 0));
    uint cuts = texelFetch(cell_cuts, cell, 0).r, where = 0u;
    for (int axis = 0; axis < 3; ++axis)
        where |= texelFetch(walls, ivec3(WALL_TEXELS * cell.x + WALL_CUTS + axis, cell.yz), 0).r
                 << (8 * axis);
    const float fluence = 3.5449077018110318, flux = 2.0466534158929770; // sqrt(4 pi), sqrt(4 pi / 3)
    ivec3 texel = above(cell);
    for (int m = 0; m < BAND_2; ++m)
        imageStore(band_image, texel + ivec3(m * level.dims.x, 0, 0), fit(own[4 + m], 0.0));
    for (int c = 0; c < 3; ++c, texel.x += level.dims.x)
        imageStore(field_image, texel,
                   vec4(fluence * own[0][c], flux * own[3][c], flux * own[1][c], flux * own[2][c]));
    imageStore(field_image, texel,
               vec4(float(cuts & 8191u), float(cuts >> 13), float(where), 0.0));
}
