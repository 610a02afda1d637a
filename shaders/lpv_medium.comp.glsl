// SPDX-License-Identifier: GPL-3.0-or-later
// What a cell of the field's lattice is filled with: the media's mean extinction and albedo, and the
// mean reflectance of the surfaces that cut its links.
#version 450 core
#include "lib/medium.glsl"
#include "lib/walls.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage; // offset.x: 0 leaves the media out
};


layout(binding = SLOT_OUTPUT, rgba16f) writeonly uniform image3D cell_image[3]; // extinction,
                                                                 // albedo, surfaces' reflectance

const int POINTS = 128; // along the lattice

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, stage.slab.z);
    if (!in_level(cell) || cell.z >= stage.slab.w)
        return;
    float side = level.lower.w;
    vec3 lower = level.lower.xyz + vec3(cell) * side;
    // A strong forward lobe is as no scattering: the lattice scatters isotropically, with the
    // reduced coefficient sigma_s (1 - g).
    vec3 extinct = vec3(0.0), scatter = vec3(0.0);
    if (medium_exists() && stage.offset.x != 0) {
        int points = points_in_cell(POINTS, 4);
        int all = points * points * points;
        for (int i = 0; i < all; ++i) {
            vec3 p = point_in_cell(cell, i, points);
            if (!in_box(p, frame.medium_lower.xyz, frame.medium_upper.xyz))
                continue;
            vec3 uvw = medium_coordinate(p);
            vec4 s = textureLod(medium_scatter, uvw, 0.0);
            extinct += textureLod(medium_extinct, uvw, 0.0).rgb - s.rgb * s.a;
            scatter += s.rgb * (1.0 - s.a);
        }
        extinct /= float(all);
        scatter /= float(all);
    }
    if (fog_exists() && stage.offset.x != 0) {
        vec3 filled = clamp((min(frame.fog_upper.xyz, lower + side) -
                             max(frame.fog_lower.xyz, lower)) / side, 0.0, 1.0);
        float part = filled.x * filled.y * filled.z, g = frame.fog_sigma_s.w;
        extinct += part * (frame.fog_sigma_t.rgb - g * frame.fog_sigma_s.rgb);
        scatter += part * (1.0 - g) * frame.fog_sigma_s.rgb;
    }
    extinct = clamp(extinct, vec3(0.0), vec3(65504.0));
    imageStore(cell_image[0], cell, vec4(extinct, 0.0));
    imageStore(cell_image[1], cell, vec4(clamp(scatter / max(extinct, vec3(1e-12)), 0.0, 1.0), 0.0));
    imageStore(cell_image[2], cell, vec4(mean_of_walls(cell, 0), 0.0));
}
