// SPDX-License-Identifier: GPL-3.0-or-later
// The frame's block, rays of a pixel, and the random numbers of a sample.
//
// What runs often is written for software GL (llvmpipe), too. That runs both sides of a branch; the body of
// a loop once more than it is entered, with all lanes off, unless the condition stands at its end: hence
// `do` where a loop is entered at least once; reads storage buffers lane by lane and number by number: hence
// lists as texels; and divides integers lane by lane.
#include "shared/brume_gpu.h"
#include "lib/hash.glsl"

const float PI = 3.14159265358979;

layout(std140, binding = SLOT_FRAME) uniform frame_block
{
    gpu_frame frame;
};

uint pixel_hash(ivec2 pixel, uint stream)
{
    return hash(uint(pixel.x) + hash(uint(pixel.y) + hash(stream + uint(frame.size.w) * 977u)));
}

// Stratified over a pixel's samples: a golden-ratio sequence with its own start at each pixel.
float pixel_random(ivec2 pixel, uint stream)
{
    float start = float(pixel_hash(pixel, stream)) * (1.0 / 4294967296.0);
    return fract(start + float(frame.size.z) * 0.618033988749895);
}

// Two at once, spread over a square (Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences",
// 2018): two of the above go along its diagonal together.
vec2 pixel_random_2(ivec2 pixel, uint stream)
{
    vec2 start = vec2(pixel_hash(pixel, stream), pixel_hash(pixel, stream + 1u)) * (1.0 / 4294967296.0);
    return fract(start + float(frame.size.z) * vec2(0.754877666246693, 0.569840290998053));
}

// How often, and the rest. By floats, exact up to four million.
ivec2 divided(int number, int by)
{
    int times = int((float(number) + 0.5) / float(by));
    return ivec2(times, number - times * by);
}

// Which of so many a lot means; those that follow one another take turns. Of the lot 20 bits count.
uint turn_of(uint lot, uint count)
{
    return uint(divided(int(lot & 0xfffffu), int(count)).y);
}

// The place of one of so many points along each side of a cube, of 1.
vec3 point_in_cube(int number, int points)
{
    ivec2 row = divided(number, points), layer = divided(row.x, points);
    return (vec3(row.y, layer.y, layer.x) + 0.5) / float(points);
}

// The number of an offset, -1 to 1 along each axis, x first; of none: 13.
int offset_number(ivec3 offset)
{
    return 9 * offset.z + 3 * offset.y + offset.x + 13;
}

uint offset_bit(ivec3 offset)
{
    return 1u << offset_number(offset);
}

// By thirds along its sides, the part of a cube that a point is in: a bit.
uint third_bit(vec3 within)
{
    return offset_bit(clamp(ivec3(3.0 * within), ivec3(0), ivec3(2)) - 1);
}

struct view_ray
{
    vec3 origin;
    vec3 direction; // unit
    float stretch;  // distance along the ray per unit of view depth
};

view_ray pixel_ray(ivec2 pixel)
{
    vec2 ndc = (vec2(pixel) + 0.5) / vec2(frame.size.xy) * 2.0 - 1.0;
    view_ray ray;
    ray.origin = frame.ray_origin.xyz + ndc.x * frame.ray_origin_x.xyz +
                 ndc.y * frame.ray_origin_y.xyz;
    vec3 d = frame.ray_direction.xyz + ndc.x * frame.ray_direction_x.xyz +
             ndc.y * frame.ray_direction_y.xyz;
    ray.stretch = length(d);
    ray.direction = d / ray.stretch;
    return ray;
}

// Where a ray is inside a box: x enter, y leave; empty where x >= y.
vec2 ray_box(vec3 origin, vec3 direction, vec3 lower, vec3 upper)
{
    // A zero component gives infinities of the right signs, but 0 * inf is NaN: keep off zero.
    vec3 d = mix(direction, vec3(1e-20), lessThan(abs(direction), vec3(1e-20)));
    vec3 a = (lower - origin) / d;
    vec3 b = (upper - origin) / d;
    vec3 near = min(a, b);
    vec3 far = max(a, b);
    return vec2(max(max(near.x, near.y), near.z), min(min(far.x, far.y), far.z));
}

// A unit vector across another.
vec3 across(vec3 v)
{
    return normalize(abs(v.z) < 0.9 ? cross(v, vec3(0.0, 0.0, 1.0)) : cross(v, vec3(1.0, 0.0, 0.0)));
}

bool in_box(vec3 p, vec3 lower, vec3 upper)
{
    return all(greaterThanEqual(p, lower)) && all(lessThanEqual(p, upper));
}

float luminance(vec3 rgb)
{
    return dot(rgb, vec3(0.2126, 0.7152, 0.0722));
}
