// SPDX-License-Identifier: GPL-3.0-or-later
// The view ray of every pixel through the media.
// variants: DOM DOM_LAMPS
#version 450 core
#include "lib/compose.glsl"

layout(local_size_x = GROUP_PIXELS, local_size_y = GROUP_PIXELS) in;

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, int(frame.march.z));
    if (!in_picture(pixel))
        return;
    pixel_view view = view_of(pixel);
    march_state state = march_state(vec3(0.0), vec3(0.0), vec3(0.0), vec3(1.0));
    march_media(state, view.ray, spans_of(view.ray, view.t_near, view.t_far), pixel);
    compose(pixel, view, state);
}
