/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Frames and matrices: GLM behind a C header. Matrices are 16 floats, column-major, named
 * target_from_source; computed in double. Any thread. */
#ifndef BRUME_MATH_FRAME_H
#define BRUME_MATH_FRAME_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

void mat4_identity(float out[16]);
void mat4_multiply(const float a[16], const float b[16], float out[16]); /* out = a b */
/* false, out untouched, where the matrix is not finite or singular to float's precision. */
bool mat4_invert(const float m[16], float out[16]);
bool mat4_is_finite(const float m[16]);
double mat4_determinant3(const float m[16]); /* of the linear part */
void mat4_point(const float m[16], const float p[3], float out[3]);  /* affine */
void mat4_vector(const float m[16], const float v[3], float out[3]);
/* world-axis box of a transformed box */
void mat4_bounds(const float m[16], const float lower[3], const float upper[3], float out_lower[3],
                 float out_upper[3]);
/* view_from_world of an eye that looks along direction, with up (not along direction) upwards. */
void mat4_look(const float eye[3], const float direction[3], const float up[3], float out[16]);
void mat4_orthographic(float left, float right, float bottom, float top, float near_, float far_,
                       float out[16]);
void mat4_perspective(float fov_y, float aspect, float near_, float far_, float out[16]);
/* Two unit vectors that make a right-handed frame with the unit vector n. */
void frame_around(const float n[3], float tangent[3], float bitangent[3]);

#ifdef __cplusplus
}
#endif
#endif
