// SPDX-License-Identifier: GPL-3.0-or-later
// Fills in the ordinates' harmonics and links.
#version 450 core
#include "lib/harmonics.glsl"

layout(local_size_x = GROUP_REST) in;

#define ORDINATES_WRITTEN
#include "lib/ordinates.glsl"
#include "lib/cuts.glsl"

void main()
{
    int number = int(gl_GlobalInvocationID.x);
    if (number >= ordinates.count.x)
        return;
    vec3 direction = ordinates.list[number].direction.xyz;
    float y[MOMENTS];
    harmonics(direction, y);
    for (int i = 0; i < 4; ++i)
        ordinates.list[number].harmonics[i] =
            vec4(y[4 * i], y[4 * i + 1], y[4 * i + 2], y[4 * i + 3]);
    int axis = major_axis(direction);
    ivec3 way = ivec3(sign(turned(axis, direction)));
    for (int i = 0; i < 4; ++i) {
        ivec3 link = placed(axis, way.x, way.yz * aside_of(i));
        ordinates.list[number].links_in[i] = link_bit(-link);
        ordinates.list[number].links_out[i] = link_bit(link);
    }
}
