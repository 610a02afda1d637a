// SPDX-License-Identifier: GPL-3.0-or-later
// What every cell of the field's lattice scatters towards the eye, per unit of sigma_s: found once for a
// view, so that its rays need not ask each cell for all moments.
#version 450 core
#include "lib/ordinates.glsl"
#include "lib/harmonics.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(binding = SLOT_MOMENTS) uniform sampler3D light; // w: the cell's mean cosine, or EMPTY

layout(binding = SLOT_OUTPUT, rgba16f) writeonly uniform image3D scattered_image; // w: 1 where
                                                                               // nothing scatters

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID);
    if (!in_level(cell))
        return;
    vec3 out_ = frame.eye.w == 0.0 ? -frame.eye.xyz : frame.eye.xyz - cell_centre(level, cell);
    out_ *= inversesqrt(max(dot(out_, out_), 1e-20));
    float y[MOMENTS];
    harmonics(out_, y);
    float g = texelFetch(light, above(cell), 0).w;
    vec4 bands = scaled_bands(g) * (1.0 - forward_share(g));
    vec3 sum = vec3(0.0);
    for (int m = 0; m < MOMENTS; ++m)
        sum += bands[band_of(m)] * y[m] * texelFetch(light, above(moment_texel(cell, m)), 0).rgb;
    imageStore(scattered_image, above(cell), fit(max(sum, vec3(0.0)), g == EMPTY ? 1.0 : 0.0));
}
