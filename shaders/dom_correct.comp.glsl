// SPDX-License-Identifier: GPL-3.0-or-later
// Adds to an iteration's result what it has yet to find, where light diffuses: fluence, the flux that its
// differences drive, and what surfaces reflect of it.
#version 450 core
#include "lib/diffusion.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(binding = SLOT_MOMENTS) uniform sampler3D residual; // as the image was

layout(binding = SLOT_OUTPUT, rgba16f) uniform image3D residual_image;
layout(binding = SLOT_OUTPUT + 1, rgba16f) uniform image3D result_image;

void add(ivec3 texel, vec3 value)
{
    imageStore(residual_image, texel, fit(imageLoad(residual_image, texel).rgb + value, 0.0));
    imageStore(result_image, texel, fit(imageLoad(result_image, texel).rgb + value, 0.0));
}

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, stage.slab.z);
    if (!in_level(cell) || cell.z >= stage.slab.w)
        return;
    diffusing c = diffusing_cell(cell, residual);
    vec3 own = texelFetch(missing, cell, 0).rgb;
    add(mixed_texel(cell, 0), own);
    const int moments[3] = int[](3, 1, 2); // of band 1, by axes
    for (int axis = 0; axis < 3; ++axis) {
        vec3 comes[2], flux[2];
        for (int i = 0; i < 2; ++i)
            flux[i] = own * passes_side(cell, 2 * axis + i, c, comes[i]) - comes[i];
        add(mixed_texel(cell, moments[axis]), 0.5 * sqrt(3.0) * (flux[1] - flux[0]));
    }
    if (c.cuts == 0u)
        return;
    // What falls onto them is a quarter of the fluence there and half of what they take.
    vec3 sends, takes = own * passes_end(c, c.mirrored, c.sent, sends) - sends;
    vec3 falls = 0.25 * (own - 1.5 * c.tau * takes) + 0.5 * takes;
    add(mixed_texel(cell, MIXED - 1), c.mirrored * falls * sqrt(4.0 * PI) / PI);
}
