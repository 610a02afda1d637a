// SPDX-License-Identifier: GPL-3.0-or-later
// Marches at half the resolution: a block of 2 x 2 pixels has one ray, that of one of its pixels.
#include "lib/march.glsl"

// Which pixel of its block this sample's rays are of, the same in all blocks: each once in four
// samples, and in each four from another start. Lamps take turns too, by the sample's number: each
// pixel of a block must meet each of their points.
ivec2 block_phase()
{
    const ivec2 pixels[4] = ivec2[](ivec2(0, 0), ivec2(1, 1), ivec2(1, 0), ivec2(0, 1));
    uint digits = 0u;
    for (uint s = uint(frame.size.z); s != 0u; s >>= 2)
        digits += s;
    return pixels[digits & 3u];
}

ivec2 block_count()
{
    return (frame.size.xy + 1) / 2;
}

// The pixel whose ray a block has; blocks at the end may lack it, and have what is there.
ivec2 block_pixel(ivec2 block)
{
    return min(2 * block + block_phase(), frame.size.xy - 1);
}

// How a ray through media ends.
struct march_end
{
    float t;     // where it leaves the last medium or meets a surface in it; NO_DEPTH: in none
    float fog;   // how long it is in the world's medium
    bool leaves; // it ends with the medium, whatever surface is behind
};

march_end end_of(media_spans spans, float t_far)
{
    march_end end = march_end(NO_DEPTH, 0.0, false);
    vec2 all_spans[3] = vec2[](spans.before, spans.box, spans.after);
    for (int i = 0; i < 3; ++i) {
        vec2 span = all_spans[i];
        if (span.x < span.y) {
            end.t = span.y;
            end.fog += span.y - span.x;
        }
    }
    end.leaves = end.t > NO_DEPTH && end.t < t_far;
    return end;
}
