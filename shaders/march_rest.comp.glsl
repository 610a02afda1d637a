// SPDX-License-Identifier: GPL-3.0-or-later
// The view rays of those pixels that the rays of the blocks around them do not stand for.
// variants: DOM DOM_LAMPS
#version 450 core
#include "lib/compose.glsl"
#include "lib/rest.glsl"

layout(local_size_x = GROUP_REST) in;

void main()
{
    uint i = gl_GlobalInvocationID.x;
    if (i < rest_count) do {
        ivec2 pixel = ivec2(rest_pixels[i] & 0xffffu, rest_pixels[i] >> 16);
        pixel_view view = view_of(pixel);
        march_state state = march_state(vec3(0.0), vec3(0.0), vec3(0.0), vec3(1.0));
        march_media(state, view.ray, spans_of(view.ray, view.t_near, view.t_far), pixel);
        compose(pixel, view, state);
        i += GROUP_REST * gl_NumWorkGroups.x;
    } while (i < rest_count);
}
