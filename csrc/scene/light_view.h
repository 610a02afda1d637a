/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What lights see of the scene: the views that shadow maps and reflective ones are drawn from. Boxes
 * are corners in the world, m. Any thread. */
#ifndef BRUME_SCENE_LIGHT_VIEW_H
#define BRUME_SCENE_LIGHT_VIEW_H

#include "brume_gpu.h"

#include <stdint.h>

/* A map along `towards` (unit, to the light) over the box from lower to upper, with the depths of
 * all that is in the casters' box. Leaves out->tile alone, as the other does. */
void light_view_distant(const float casters_lower[3], const float casters_upper[3],
                        const float lower[3], const float upper[3], const vec4 *towards, int side,
                        struct gpu_shadow_view *out);

/* How near lamps begin to see in a scene of that box. */
float light_view_near(const float lower[3], const float upper[3]);

/* Face number `face`, in the order of shadow_face() in shaders/lib/shadow.glsl, of a lamp as seen
 * from eye; tangent: of half its opening. */
void light_view_face(const struct gpu_light *light, const float eye[3], uint32_t face, float tangent,
                     int side, float near_, struct gpu_shadow_view *out);

#endif
