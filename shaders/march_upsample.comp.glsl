// SPDX-License-Identifier: GPL-3.0-or-later
// Every pixel's media from the rays of the blocks around it: interpolated between those that end
// where the pixel's own ray does (Kopf et al., "Joint Bilateral Upsampling", SIGGRAPH 2007).
#version 450 core
#include "lib/compose.glsl"
#include "lib/half.glsl"
#include "lib/rest.glsl"

layout(local_size_x = GROUP_PIXELS, local_size_y = GROUP_PIXELS) in;

layout(binding = SLOT_HALF) uniform sampler2DArray half_march;

// How well a block's ray, of that pixel, stands for the pixel's: always where both leave the media.
// Surfaces must each lie on the plane of the other, so that slopes need not be level; a
// silhouette's own plane holds what is behind it. Two pixels' spacing off is far.
float likeness(pixel_view view, march_end own, ivec2 pixel, float t, bool leaves, float spacing)
{
    if (own.leaves && leaves)
        return 1.0;
    float off = t - own.t;
    if (!own.leaves && !leaves) {
        view_ray ray = pixel_ray(pixel);
        vec3 between = ray.origin + t * ray.direction - view.ray.origin -
                       own.t * view.ray.direction;
        vec3 normal = texelFetch(gbuffer_normal, pixel, 0).xyz;
        off = max(abs(dot(view.normal_depth.xyz, between)), abs(dot(normal, between)));
    }
    off /= 2.0 * spacing;
    return exp(-off * off);
}

// What is thinner than the blocks' grid, or ends between its rays, is left to march_rest: a wire
// before bright fog must not take the fog's light in three samples of four. In a dispatch of its
// own, since these few would hold up the others of their groups.
void leave(ivec2 pixel)
{
    uint number = atomicAdd(rest_count, 1u);
    rest_pixels[number] = uint(pixel.x) | uint(pixel.y) << 16;
    if (number % GROUP_REST == 0u && number < GROUP_REST * 65535u)
        atomicAdd(rest_groups[0], 1u);
}

// False where no block's ray is like the pixel's, or not all meet media.
bool upsample(ivec2 pixel, pixel_view view, march_end own, out march_state state)
{
    state = march_state(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
    view_ray beside = pixel_ray(pixel + ivec2(1, 0));
    float spacing = distance(beside.origin + own.t * beside.direction,
                             view.ray.origin + own.t * view.ray.direction);
    vec2 at = 0.5 * vec2(pixel - block_phase());
    ivec2 low = ivec2(floor(at));
    vec2 f = at - vec2(low);
    float sum = 0.0;
    for (int corner = 0; corner < 4; ++corner) {
        ivec2 side = ivec2(corner & 1, corner >> 1);
        vec2 each = mix(1.0 - f, f, vec2(side));
        float weight = each.x * each.y;
        if (weight == 0.0)
            continue;
        ivec2 block = clamp(low + side, ivec2(0), block_count() - 1);
        vec4 direct = texelFetch(half_march, ivec3(block, HALF_DIRECT), 0);
        vec4 indirect = texelFetch(half_march, ivec3(block, HALF_INDIRECT), 0);
        // By a silhouette of the media's box rays beside miss it and tell nothing; the others alone have
        // come further through the media than the pixel's.
        if (direct.w <= NO_DEPTH)
            return false;
        weight *= likeness(view, own, block_pixel(block), direct.w, indirect.w != 0.0, spacing);
        if (weight == 0.0)
            continue;
        vec4 through = texelFetch(half_march, ivec3(block, HALF_TRANSMITTANCE), 0);
        // The world's medium is known: what it lets through is each pixel's own.
        vec3 rest = min(frame.fog_sigma_t.rgb * (through.w - own.fog), vec3(80.0));
        sum += weight;
        state.direct += weight * direct.rgb;
        state.indirect += weight * indirect.rgb;
        state.emission += weight * texelFetch(half_march, ivec3(block, HALF_EMISSION), 0).rgb;
        state.transmittance += weight * min(through.rgb * exp(rest), vec3(1.0));
    }
    if (sum < 0.05)
        return false;
    state.direct /= sum;
    state.indirect /= sum;
    state.emission /= sum;
    state.transmittance /= sum;
    return true;
}

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, int(frame.march.z));
    if (!in_picture(pixel))
        return;
    pixel_view view = view_of(pixel);
    media_spans spans = spans_of(view.ray, view.t_near, view.t_far);
    march_end own = end_of(spans, view.t_far);
    march_state state = march_state(vec3(0.0), vec3(0.0), vec3(0.0), vec3(1.0));
    if (own.t > NO_DEPTH && !upsample(pixel, view, own, state))
        leave(pixel);
    else
        compose(pixel, view, state);
}
