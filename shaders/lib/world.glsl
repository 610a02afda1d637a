// SPDX-License-Identifier: GPL-3.0-or-later
// The world's radiance in a direction.
#include "lib/frame.glsl"

layout(binding = SLOT_WORLD) uniform sampler2D world_image;

// Equirectangular as Cycles: u = 0.5 - azimuth / 2 pi, v = 0.5 + elevation / pi.
vec3 world_radiance(vec3 direction, float blur)
{
    vec3 radiance = frame.world_color.rgb;
    if (frame.world_color.w != 0.0) {
        vec3 d = normalize(mat3(frame.image_from_world) * direction);
        vec2 uv = vec2(0.5 - atan(d.y, d.x) / (2.0 * PI), 0.5 + asin(clamp(d.z, -1.0, 1.0)) / PI);
        radiance *= textureLod(world_image, uv, blur).rgb;
    }
    return radiance;
}
