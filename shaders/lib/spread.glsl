// SPDX-License-Identifier: GPL-3.0-or-later
// A lamp's light over what is not a point.
#include "lib/shadow.glsl"

// The mean of 1/d^2 over a cube of that side around a point, to the second order (its Laplacian is
// 2/d^4), and no more than over a cube around the lamp itself.
float mean_inverse_square(float square, float side)
{
    float s = side * side;
    return min((1.0 + s / (12.0 * square)) / square, 7.7 / s);
}

// What a lamp's sample sends into a cube of that side around a point, past surfaces but not through media:
// its mean there, W/m^2. towards: unit vector to the lamp; distance: how far it is.
vec3 light_in_cube(gpu_light light, gpu_light_sample s, vec3 p, float side, out vec3 towards,
                   out float distance)
{
    float square;
    vec3 intensity = light_intensity(light, s.position.xyz, p, towards, square) * light.factors.z;
    bool sun = light.info.x == uint(LIGHT_SUN);
    distance = sun ? 1e30 : sqrt(square);
    if (intensity != vec3(0.0))
        intensity *= light_shadow_medium(light, s, p, distance);
    return sun ? intensity : intensity * mean_inverse_square(square, side);
}

// The mean of exp(-depth) over a cube of that side, of a depth at its middle that grows by extinct a
// metre along a unit direction; exact, and however thick the cube is. Where light enters the depth is 0.
vec3 mean_transmittance(vec3 depth, vec3 extinct, vec3 direction, float side)
{
    vec3 near = depth, mean = vec3(1.0);
    for (int axis = 0; axis < 3; ++axis) {
        vec3 across = extinct * (side * abs(direction[axis]));
        near -= 0.5 * across;
        mean *= mix((1.0 - exp(-across)) / max(across, vec3(1e-6)), 1.0 - 0.5 * across,
                    lessThan(across, vec3(1e-3)));
    }
    return exp(-max(near, vec3(0.0))) * mean;
}
