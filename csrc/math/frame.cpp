// SPDX-License-Identifier: GPL-3.0-or-later
// Frames and matrices through GLM, in double where it costs nothing.
#include "math/frame.h"

#include <cmath>
#include <cstring>
#include <glm/glm.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/type_ptr.hpp>

namespace {

glm::dmat4 load(const float m[16])
{
    return glm::dmat4(glm::make_mat4(m));
}

void store(const glm::dmat4 &m, float out[16])
{
    const glm::mat4 narrow(m);
    std::memcpy(out, glm::value_ptr(narrow), 16 * sizeof(float));
}

glm::dvec3 load3(const float v[3])
{
    return {v[0], v[1], v[2]};
}

void store3(const glm::dvec3 &v, float out[3])
{
    for (int i = 0; i < 3; ++i)
        out[i] = static_cast<float>(v[i]);
}

} // namespace

void mat4_identity(float out[16])
{
    store(glm::dmat4(1.0), out);
}

void mat4_multiply(const float a[16], const float b[16], float out[16])
{
    store(load(a) * load(b), out);
}

bool mat4_is_finite(const float m[16])
{
    for (int i = 0; i < 16; ++i)
        if (!std::isfinite(m[i]))
            return false;
    return true;
}

double mat4_determinant3(const float m[16])
{
    return glm::determinant(glm::dmat3(load(m)));
}

bool mat4_invert(const float m[16], float out[16])
{
    if (!mat4_is_finite(m))
        return false;
    const glm::dmat4 wide = load(m);
    // Relative to the columns' lengths, so that a small but sound object is not refused.
    double scale = 1.0;
    for (int c = 0; c < 4; ++c)
        scale *= glm::length(wide[c]);
    const double determinant = glm::determinant(wide);
    if (!(std::abs(determinant) > 1e-9 * scale) || scale == 0.0)
        return false;
    const glm::dmat4 inverse = glm::inverse(wide);
    float narrow[16];
    store(inverse, narrow);
    if (!mat4_is_finite(narrow))
        return false;
    std::memcpy(out, narrow, sizeof narrow);
    return true;
}

void mat4_point(const float m[16], const float p[3], float out[3])
{
    store3(glm::dvec3(load(m) * glm::dvec4(load3(p), 1.0)), out);
}

void mat4_vector(const float m[16], const float v[3], float out[3])
{
    store3(glm::dmat3(load(m)) * load3(v), out);
}

void mat4_bounds(const float m[16], const float lower[3], const float upper[3], float out_lower[3],
                 float out_upper[3])
{
    for (int corner = 0; corner < 8; ++corner) {
        const float p[3] = {corner & 1 ? upper[0] : lower[0], corner & 2 ? upper[1] : lower[1],
                            corner & 4 ? upper[2] : lower[2]};
        float q[3];
        mat4_point(m, p, q);
        for (int i = 0; i < 3; ++i) {
            out_lower[i] = corner ? std::fmin(out_lower[i], q[i]) : q[i];
            out_upper[i] = corner ? std::fmax(out_upper[i], q[i]) : q[i];
        }
    }
}

void mat4_look(const float eye[3], const float direction[3], const float up[3], float out[16])
{
    store(glm::lookAt(load3(eye), load3(eye) + load3(direction), load3(up)), out);
}

void mat4_orthographic(float left, float right, float bottom, float top, float near_, float far_,
                       float out[16])
{
    store(glm::ortho<double>(left, right, bottom, top, near_, far_), out);
}

void mat4_perspective(float fov_y, float aspect, float near_, float far_, float out[16])
{
    store(glm::perspective<double>(fov_y, aspect, near_, far_), out);
}

// Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 2017.
void frame_around(const float n[3], float tangent[3], float bitangent[3])
{
    // Not copysign: -0 must go the way that the shaders take.
    const float sign = n[2] >= 0.0f ? 1.0f : -1.0f;
    const float a = -1.0f / (sign + n[2]);
    const float b = n[0] * n[1] * a;
    tangent[0] = 1.0f + sign * n[0] * n[0] * a;
    tangent[1] = sign * b;
    tangent[2] = -sign * n[0];
    bitangent[0] = b;
    bitangent[1] = sign + n[1] * n[1] * a;
    bitangent[2] = -n[1];
}
