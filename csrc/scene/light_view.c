/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Views of the scene from its lights. */
#include "scene/light_view.h"
#include "math/frame.h"
#include "scene/light.h"

#include <math.h>

static float radius_of(const float lower[3], const float upper[3], float center[3])
{
    float square = 0.0f;
    for (int i = 0; i < 3; ++i) {
        center[i] = 0.5f * (lower[i] + upper[i]);
        const float half = 0.5f * (upper[i] - lower[i]);
        square += half * half;
    }
    return sqrtf(square);
}

void light_view_distant(const float casters_lower[3], const float casters_upper[3],
                        const float lower[3], const float upper[3], const vec4 *towards, int side,
                        struct gpu_shadow_view *out)
{
    float center[3], view[16], projection[16], low[3], high[3], all_low[3], all_high[3];
    float right[3], up[3];
    const float radius = fmaxf(radius_of(casters_lower, casters_upper, center), 1e-4f);
    const float direction[3] = {-towards->x, -towards->y, -towards->z};
    const float eye[3] = {center[0] - direction[0] * radius, center[1] - direction[1] * radius,
                          center[2] - direction[2] * radius};
    frame_around(direction, right, up);
    mat4_look(eye, direction, up, view);
    mat4_bounds(view, lower, upper, low, high);
    mat4_bounds(view, casters_lower, casters_upper, all_low, all_high);
    /* Square texels, and a texel of room for the filter at the rim. */
    const float extent = fmaxf(fmaxf(high[0] - low[0], high[1] - low[1]), 1e-4f * radius);
    const float width = extent * (1.0f + 4.0f / (float)side);
    const float x = 0.5f * (low[0] + high[0]), y = 0.5f * (low[1] + high[1]);
    const float near_ = -all_high[2] - 1e-3f * radius, far_ = -all_low[2] + 1e-3f * radius;
    mat4_orthographic(x - 0.5f * width, x + 0.5f * width, y - 0.5f * width, y + 0.5f * width, near_,
                      far_, projection);
    /* Reversed depth: 1 at near, 0 at far. */
    for (int column = 0; column < 4; ++column)
        projection[4 * column + 2] = 0.0f;
    projection[10] = 1.0f / (far_ - near_);
    projection[14] = far_ / (far_ - near_);
    mat4_multiply(projection, view, out->clip_from_world.m);
    out->range = (vec4){1.0f, near_, far_, width / (float)side};
}

float light_view_near(const float lower[3], const float upper[3])
{
    float center[3];
    return fmaxf(1e-4f * radius_of(lower, upper, center), 1e-4f);
}

static void perspective_view(const float eye[3], const float direction[3], const float up[3],
                             float tangent, int side, float near_, struct gpu_shadow_view *out)
{
    float view[16];
    mat4_look(eye, direction, up, view);
    /* Room at the rim for the filter. Where faces meet also says which texels of reflective maps
     * are left out: to 1 % how much light these send on. */
    tangent *= 1.0f + 6.0f / (float)side;
    /* Reversed depth without a far plane: near / distance. */
    const float projection[16] = {
        1.0f / tangent, 0, 0, 0, 0, 1.0f / tangent, 0, 0, 0, 0, 0, -1, 0, 0, near_, 0};
    mat4_multiply(projection, view, out->clip_from_world.m);
    out->range = (vec4){0.0f, near_, 0.0f, 2.0f * tangent / (float)side};
}

void light_view_face(const struct gpu_light *light, const float eye[3], uint32_t face,
                     float tangent, int side, float near_, struct gpu_shadow_view *out)
{
    float u[3], v[3], forward[3], direction[3];
    light_frame(light, u, v, forward);
    for (int i = 0; i < 3; ++i) {
        const float axes[6] = {forward[i], u[i], -u[i], v[i], -v[i], -forward[i]};
        direction[i] = axes[face];
    }
    /* Upright in the lamp's frame, or the faces would not meet at the cube's edges. */
    const float *up = face == 3 || face == 4 ? forward : v;
    perspective_view(eye, direction, up, tangent, side, near_, out);
}
