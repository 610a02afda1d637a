// SPDX-License-Identifier: GPL-3.0-or-later
// What the media of every cell scatter of the lights' own light: its power and flux. Gathered by the cell
// rather than strewn along the lights' rays, so that many rays through one cell cost no more than one.
// variants: SKY
#version 450 core
#include "lib/transmittance.glsl"
#include "lib/shadow.glsl"
#include "lib/sky.glsl"
#include "lib/level.glsl"
#include "lib/spread.glsl"

layout(local_size_x = GROUP_LANES, local_size_y = GROUP_CELLS, local_size_z = GROUP_CELLS) in;

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_lattice_pass stage;
};

layout(std430, binding = SLOT_SCATTERED_FLOWS) writeonly buffer flows_block
{
    vec4 flows[]; // of every cell three: red, green, blue
};

const int POINTS = 64; // along the lattice

// What the media scatter in a cube of side `part` around a point, of the light of all lights.
void add_scattered(inout vec4 flow[3], vec3 p, float part, uint lot)
{
    float volume = part * part * part;
    vec3 sigma_s = vec3(0.0);
    float g = 0.0;
    if (medium_exists() && in_box(p, frame.medium_lower.xyz, frame.medium_upper.xyz)) {
        vec4 scatter = textureLod(medium_scatter, medium_coordinate(p), 0.0);
        sigma_s = scatter.rgb;
        g = scatter.a;
    }
    if (fog_exists() && in_box(p, frame.fog_lower.xyz, frame.fog_upper.xyz))
        add_fog(sigma_s, g);
    if (sigma_s == vec3(0.0))
        return;
    uint number = 0u;
    if (frame.counts.x > 0u) do {
        gpu_light light = light_at(number);
        gpu_light_sample s = light_sample_at(light.samples.x + turn_of(lot, light.samples.y));
        int paths = paths_into(light, p, part), i = 0;
        do {
            light_path path = path_into(light, s, i, paths, p, part, lot);
            if (path.intensity == vec3(0.0))
                continue;
            vec3 power = path.intensity * sigma_s * volume *
                         light_transmittance(light, path.p, path.towards, path.distance);
            for (int c = 0; c < 3; ++c)
                flow[c] += power[c] * vec4(1.0, -g * path.towards);
        } while (++i < paths);
    } while (++number < frame.counts.x);
#ifdef SKY
    vec3 uvw = sky_coordinate(p);
    vec4 scattered = volume * vec4(1.0, vec3(g));
    flow[0] += sigma_s.r * scattered * textureLod(sky_r, uvw, 0.0);
    flow[1] += sigma_s.g * scattered * textureLod(sky_g, uvw, 0.0);
    flow[2] += sigma_s.b * scattered * textureLod(sky_b, uvw, 0.0);
#endif
}

void main()
{
    ivec3 cell = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, stage.slab.z);
    if (!in_level(cell) || cell.z >= stage.slab.w)
        return;
    vec4 flow[3] = vec4[](vec4(0.0), vec4(0.0), vec4(0.0));
    uint start = hash(uint(cell_number(cell)));
    int points = points_in_cell(POINTS, 4);
    float part = level.lower.w / float(points);
    int i = 0;
    do {
        // No lots: what is turned by a right angle is lit alike.
        vec3 p = point_in_cell(cell, i, points);
        add_scattered(flow, p, part, start + uint(i));
    } while (++i < points * points * points);
    for (int c = 0; c < 3; ++c)
        flows[3 * cell_number(cell) + c] = flow[c];
}
