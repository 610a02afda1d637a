// SPDX-License-Identifier: GPL-3.0-or-later
// A step towards what an iteration has yet to find of the fluence, where light diffuses: the flux that
// leaves a cell and what it absorbs come from what the iteration's change scatters there, and from what
// surfaces' change sends (Alcouffe,
// "Diffusion Synthetic Acceleration Methods for the Diamond-Differenced Discrete-Ordinates Equations",
// Nucl. Sci. Eng. 1977). Jacobi's iteration with Chebyshev's weights (Golub and Varga, Numer. Math. 1961).
#version 450 core
#include "lib/diffusion.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(location = 0) uniform vec2 weights; // of the last step's change, and of what is wrong

layout(binding = SLOT_CELL_EXTINCT) uniform sampler3D cell_extinct;
layout(binding = SLOT_CELL_ALBEDO) uniform sampler3D cell_absorbed;
layout(binding = SLOT_MISSING + 1) uniform sampler3D missing_before;
layout(binding = SLOT_MOMENTS) uniform sampler3D residual;

layout(binding = SLOT_OUTPUT, rgba16f) writeonly uniform image3D missing_image;

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, stage.slab.z);
    if (!in_level(cell) || cell.z >= stage.slab.w)
        return;
    diffusing c = diffusing_cell(cell, residual);
    vec3 depth = texelFetch(cell_extinct, cell, 0).rgb * level.lower.w;
    vec3 absorbed = texelFetch(cell_absorbed, cell, 0).rgb;
    vec3 comes = (1.0 - absorbed) * depth * texelFetch(residual, cell, 0).rgb, goes = absorbed * depth;
    for (int i = 0; i < 6; ++i) {
        vec3 from;
        goes += passes_side(cell, i, c, from);
        comes += from;
    }
    vec3 own = texelFetch(missing, cell, 0).rgb;
    vec3 before = texelFetch(missing_before, cell, 0).rgb;
    vec3 wrong = comes / max(goes, vec3(1e-6)) - own;
    imageStore(missing_image, cell, fit(own + weights.x * (own - before) + weights.y * wrong, 0.0));
}
