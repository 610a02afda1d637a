// SPDX-License-Identifier: GPL-3.0-or-later
// One view ray of every block of 2 x 2 pixels through the media, for march_upsample.
// variants: DOM DOM_LAMPS
#version 450 core
#include "lib/half.glsl"

layout(local_size_x = GROUP_PIXELS, local_size_y = GROUP_PIXELS) in;

layout(binding = SLOT_OUTPUT_HALF, rgba32f) writeonly uniform image2DArray half_image;

void write(ivec2 block, int layer, vec3 light, float w)
{
    imageStore(half_image, ivec3(block, layer), vec4(light, w));
}

void main()
{
    int first = HALF_ROWS(int(frame.march.z), frame.size.y);
    int end = HALF_ROWS(int(frame.march.w), frame.size.y);
    ivec2 block = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, first);
    if (any(greaterThanEqual(block, ivec2(block_count().x, end))))
        return;
    pixel_view view = view_of(block_pixel(block));
    media_spans spans = spans_of(view.ray, view.t_near, view.t_far);
    march_state state = march_state(vec3(0.0), vec3(0.0), vec3(0.0), vec3(1.0));
    // Lots are the block's, not the pixel's: one sequence, with no gaps where others had the ray.
    march_media(state, view.ray, spans, block);
    march_end ended = end_of(spans, view.t_far);
    write(block, HALF_DIRECT, state.direct, ended.t);
    write(block, HALF_INDIRECT, state.indirect, ended.leaves ? 1.0 : 0.0);
    write(block, HALF_EMISSION, state.emission, 0.0);
    write(block, HALF_TRANSMITTANCE, state.transmittance, ended.fog);
}
