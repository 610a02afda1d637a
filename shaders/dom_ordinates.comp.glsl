// SPDX-License-Identifier: GPL-3.0-or-later
// Fills in the ordinates: their harmonics, and the world's mean radiance where light comes from along
// each. Every point of an even set on the sphere counts for the ordinate nearest to it.
#version 450 core
#include "lib/world.glsl"
#include "lib/harmonics.glsl"

layout(local_size_x = GROUP_REST) in;

#define ORDINATES_WRITTEN
#include "lib/ordinates.glsl"
#include "lib/cuts.glsl"

const int POINTS = 8192;

shared vec4 parts[GROUP_REST];

// Radiance, and in w how many points it is the sum of, of a group's so-manieth share of all points.
vec4 part_of_world(int number, int share, float blur)
{
    vec3 own = -ordinates.list[number].direction.xyz;
    vec4 sum = vec4(0.0);
    for (int i = share; i < POINTS; i += GROUP_REST) {
        float z = 1.0 - 2.0 * (float(i) + 0.5) / float(POINTS);
        float turn = fract(float(i) * 0.618033988749895) * 2.0 * PI;
        vec3 towards = vec3(sqrt(1.0 - z * z) * vec2(cos(turn), sin(turn)), z);
        float nearness = dot(own, towards);
        bool nearest = true;
        for (int k = 0; k < ordinates.count.x && nearest; ++k)
            nearest = k == number || dot(-ordinates.list[k].direction.xyz, towards) < nearness;
        if (nearest)
            sum += vec4(world_radiance(towards, blur), 1.0);
    }
    return sum;
}

// A group an ordinate: one invocation for all points would pass the most iterations of loops that a
// software rasteriser allows, 65535.
void main()
{
    int number = int(gl_WorkGroupID.x), share = int(gl_LocalInvocationID.x);
    float blur = 0.0;
    if (frame.world_color.w != 0.0) {
        ivec2 size = textureSize(world_image, 0);
        blur = max(0.5 * log2(float(size.x * size.y) / float(POINTS)), 0.0);
    }
    parts[share] = part_of_world(number, share, blur);
    barrier();
    if (share != 0)
        return;
    vec4 sum = vec4(0.0);
    for (int i = 0; i < GROUP_REST; ++i)
        sum += parts[i];
    float y[MOMENTS];
    harmonics(ordinates.list[number].direction.xyz, y);
    for (int i = 0; i < 4; ++i)
        ordinates.list[number].harmonics[i] =
            vec4(y[4 * i], y[4 * i + 1], y[4 * i + 2], y[4 * i + 3]);
    ordinates.list[number].world = ordinates.list[number].sky = vec4(sum.rgb / max(sum.w, 1.0), 0.0);
    vec3 direction = ordinates.list[number].direction.xyz;
    int axis = major_axis(direction);
    ivec3 way = ivec3(sign(turned(axis, direction)));
    for (int i = 0; i < 4; ++i) {
        ivec3 link = placed(axis, way.x, way.yz * aside_of(i));
        ordinates.list[number].links_in[i] = link_bit(-link);
        ordinates.list[number].links_out[i] = link_bit(link);
    }
}
