// SPDX-License-Identifier: GPL-3.0-or-later
// The source that iterations begin with: of every cell what its medium scatters of the lamps' own light
// and of the world's, and what it emits. In units of radiance: per extinction.
#version 450 core
#include "lib/transmittance.glsl"
#include "lib/shadow.glsl"
#include "lib/ordinates.glsl"
#include "lib/harmonics.glsl"
#include "lib/spread.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage; // offset.x: 1: the world's own light is known
};

layout(binding = SLOT_CELL_EXTINCT) uniform sampler3D cell_extinct;
layout(binding = SLOT_CELL_ALBEDO) uniform sampler3D cell_absorbed;
layout(binding = SLOT_MOMENTS) uniform sampler3D world_moments;
layout(binding = SLOT_CUTS) uniform usampler3D cell_cuts;

layout(binding = SLOT_OUTPUT, rgba16f) writeonly uniform image3D first_image;

const int POINTS = 64; // along the lattice
const int POINTS_IN_PART = 3; // that the medium is asked at, along a part of a cell, at most

// What the media scatter in a cube of side `part` around a point, of all lamps' light, and emit.
void add_point(inout vec3 q[MOMENTS], vec3 p, float part, uint lot)
{
    medium_mean medium = mean_of_medium(p, part, POINTS_IN_PART, 0u);
    vec3 sigma_s = medium.sigma_s, extinct = medium.sigma_t, emission = medium.emission;
    float g = medium.g;
    if (fog_exists() && in_box(p, frame.fog_lower.xyz, frame.fog_upper.xyz)) {
        add_fog(sigma_s, g);
        extinct += frame.fog_sigma_t.rgb;
        emission += frame.fog_emission.rgb;
    }
    q[0] += emission * sqrt(4.0 * PI);
    if (sigma_s == vec3(0.0))
        return;
    sigma_s *= 1.0 - forward_share(g);
    vec4 bands = scaled_bands(g);
    uint number = 0u;
    if (frame.counts.x > 0u) do {
        gpu_light light = light_at(number);
        gpu_light_sample s = light_sample_at(light.samples.x + turn_of(lot, light.samples.y));
        int paths = paths_into(light, p, part), i = 0;
        do {
            light_path path = path_into(light, s, i, paths, p, part, lot);
            if (path.intensity == vec3(0.0))
                continue;
            vec3 depth = light_depth(light, path.p, path.towards, path.distance).rgb;
            vec3 scattered = path.intensity * mean_transmittance(depth, extinct, path, part) * sigma_s;
            float y[MOMENTS];
            harmonics(-path.towards, y);
            for (int m = 0; m < MOMENTS; ++m)
                q[m] += scattered * (bands[band_of(m)] * y[m]);
        } while (++i < paths);
    } while (++number < frame.counts.x);
}

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, stage.slab.z);
    if (!in_level(cell) || cell.z >= stage.slab.w)
        return;
    vec3 extinct = texelFetch(cell_extinct, cell, 0).rgb;
    vec3 q[MOMENTS];
    for (int m = 0; m < MOMENTS; ++m)
        q[m] = vec3(0.0);
    float side = level.lower.w;
    if (extinct != vec3(0.0)) {
        uint start = hash(uint(cell.x) + hash(uint(cell.y) + hash(uint(cell.z))));
        uint parted = texelFetch(cell_cuts, cell, 0).a;
        int points = parted == 0u ? points_in_cell(POINTS, 4) : LINES_ALONG;
        float part = side / float(points);
        float asked = 0.0;
        int i = 0;
        do {
            if ((parted & third_bit(point_in_cube(i, points))) != 0u)
                continue; // behind a surface, where light may be another
            vec3 p = point_in_cell(cell, i, points);
            add_point(q, p, part, start + uint(i));
            asked += 1.0;
        } while (++i < points * points * points);
        // A source in a cell that dims next to nothing would be next to infinite.
        vec3 per = 1.0 / (max(asked, 1.0) * max(extinct, vec3(1e-4 / side)));
        for (int m = 0; m < MOMENTS; ++m)
            q[m] *= per;
        if (stage.offset.x != 0) {
            vec4 absorbed = texelFetch(cell_absorbed, cell, 0);
            vec4 bands = scaled_bands(absorbed.w);
            for (int m = 0; m < MOMENTS; ++m)
                q[m] += (1.0 - absorbed.rgb) * bands[band_of(m)] *
                        texelFetch(world_moments, moment_texel(cell, m), 0).rgb;
        }
    }
    for (int m = 0; m < MOMENTS; ++m)
        imageStore(first_image, moment_texel(cell, m), fit(q[m], 0.0));
}
