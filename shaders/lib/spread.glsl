// SPDX-License-Identifier: GPL-3.0-or-later
// A lamp's light in a cube of medium. Most cubes see a lamp as a point, by one path from it to their middle. A
// cube that touches it is lit by rays that leave it; so that all of a lamp's light is somewhere, wherever in
// its cell it stands. Of an area that is larger than the cube, cubes before it see a solid angle.
#include "lib/shadow.glsl"

const int RAYS = 128; // of a lamp that cubes touch
const float GOLDEN_ANGLE = 2.39996323;

// Whether the lamp is an area that is large beside a cube of that side.
bool is_wide(gpu_light light, float side)
{
    return light.info.x >= uint(LIGHT_RECTANGLE) && light.radiance.w > side * side;
}

// Paths from the lamp into a cube of that side around p.
int paths_into(gpu_light light, vec3 p, float side)
{
    if (light.info.x == uint(LIGHT_SUN) || is_wide(light, side))
        return 1;
    return all(lessThan(abs(light.position.xyz - p), vec3(0.99 * side))) ? RAYS : 1;
}

struct light_path {
    vec3 p;         // its middle in the cube
    vec3 intensity; // W/m^2, past surfaces but not through media: its part of the mean over the cube
    vec3 towards;   // unit vector to the lamp
    float distance; // how far it is
    bool spreads;   // whether its light falls with the square of that in the cube
    float chord;    // its length in the cube; 0: it stands for the whole cube
};

// The integral of d^2 / (d^2 + soft) from 0 on.
float soft_way(float d, float soft)
{
    float radius = sqrt(soft);
    return radius > 1e-6 * d ? d - radius * atan(d / radius) : d;
}

light_path ray_from(gpu_light light, int number, vec3 p, float side)
{
    // A spiral in the cone that the lamp sends light to.
    float lowest = -1.0;
    if (light.info.x == uint(LIGHT_SPOT))
        lowest = light.tangent.w;
    else if (light.info.x != uint(LIGHT_POINT))
        lowest = light.factors.w > 0.0 ? inversesqrt(1.0 + light.factors.w * light.factors.w) : 0.0;
    float along = 1.0 - (1.0 - lowest) * (float(number) + 0.5) / float(RAYS);
    float aside = sqrt(max(1.0 - along * along, 0.0)), angle = float(number) * GOLDEN_ANGLE;
    vec3 u, v;
    frame_around(light.axis.xyz, u, v);
    vec3 direction = along * light.axis.xyz + aside * (cos(angle) * u + sin(angle) * v);

    light_path path = light_path(p, vec3(0.0), -direction, 0.0, false, 0.0);
    vec2 span = ray_box(light.position.xyz, direction, p - 0.5 * side, p + 0.5 * side);
    span.x = max(span.x, 0.0);
    if (span.x >= span.y)
        return path;
    path.distance = 0.5 * (span.x + span.y);
    path.chord = span.y - span.x;
    path.p = light.position.xyz + direction * path.distance;
    vec3 towards;
    float square, soft = softness(light);
    path.intensity = light_intensity(light, light.position.xyz, path.p, towards, square) *
                    (2.0 * PI * (1.0 - lowest) / float(RAYS) / (side * side * side) *
                     (soft_way(span.y, soft) - soft_way(span.x, soft)));
    return path;
}

// Of an area lamp that p is before, as a rectangle of its area: the point of it in that part (0..1) of its solid
// angle from p, and the solid angle. Urena, Fajardo and King, "An Area-Preserving Parametrization for Spherical
// Rectangles", EGSR 2013.
vec3 seen_point(gpu_light light, vec3 p, vec2 part, out float solid_angle)
{
    float fits = light.info.x == uint(LIGHT_RECTANGLE) ? 1.0 : 0.5 * sqrt(PI);
    vec2 extent = vec2(length(light.tangent.xyz), length(light.bitangent.xyz));
    vec3 x = light.tangent.xyz / extent.x, y = light.bitangent.xyz / extent.y, v = light.position.xyz - p;
    vec2 middle = vec2(dot(v, x), dot(v, y)), low = middle - fits * extent, high = middle + fits * extent;
    float off = dot(v, light.axis.xyz);
    // Cosines of the planes that its sides lie in, and the corners that these make.
    vec4 sides = vec4(-low.y, high.x, high.y, -low.x);
    vec4 planes = sides * inversesqrt(sides * sides + off * off);
    vec4 corners = acos(-planes * planes.yzwx);
    float rest = 2.0 * PI - corners.z - corners.w;
    solid_angle = corners.x + corners.y - rest;

    float angle = part.x * solid_angle + rest;
    float f = (cos(angle) * planes.x - planes.z) / sin(angle);
    float c = (f > 0.0 ? 1.0 : -1.0) * inversesqrt(f * f + planes.x * planes.x);
    float along_x = clamp(-c * off * inversesqrt(max(1.0 - c * c, 1e-12)), low.x, high.x);
    float d = sqrt(along_x * along_x + off * off);
    float h = mix(low.y * inversesqrt(d * d + low.y * low.y), high.y * inversesqrt(d * d + high.y * high.y),
                  part.y);
    float along_y = clamp(h * d * inversesqrt(max(1.0 - h * h, 1e-12)), low.y, high.y);
    return p + along_x * x + along_y * y + off * light.axis.xyz;
}

// One of the paths of a sample's light into a cube of that side around p; lot: any number.
light_path path_into(gpu_light light, gpu_light_sample s, int number, int paths, vec3 p, float side, uint lot)
{
    light_path path = light_path(p, vec3(0.0), vec3(0.0), 1e30, false, 0.0);
    vec3 off = light.position.xyz - p;
    float square;
    if (paths > 1) {
        path = ray_from(light, number, p, side);
    } else if (is_wide(light, side) && dot(off, off) < 4.0 * light.radiance.w &&
               dot(off, light.axis.xyz) < -1e-3 * sqrt(light.radiance.w)) { // well before it
        vec2 part = vec2(hash(lot), hash(lot + 1u)) / 4294967296.0;
        float solid_angle;
        vec3 point = seen_point(light, p, part, solid_angle);
        path.intensity = light_intensity(light, point, p, path.towards, square);
        path.intensity *= solid_angle / max(dot(-path.towards, light.axis.xyz) * light.radiance.w, 1e-6);
        path.distance = sqrt(square);
    } else {
        path.intensity = light_intensity(light, s.position.xyz, p, path.towards, square);
        if (light.info.x != uint(LIGHT_SUN)) {
            path.distance = sqrt(square);
            path.spreads = true;
            if (is_disk(light))
                square = dot(off, off) + softness(light);
            // 1 / d^2 has a mean over the cube: to the second order, its Laplacian is 2 / d^4. Beside a point of a
            // wide area it is no more than over a cube around a lamp.
            float cube = side * side;
            path.intensity *= min((1.0 + cube / (12.0 * square)) / square, 7.7 / cube);
        }
    }
    path.intensity *= light.factors.z;
    if (path.intensity != vec3(0.0))
        path.intensity *= light_shadow_medium(light, s, path.p);
    return path;
}

// The mean of exp(-depth) along a path, or over the cube, of a depth in its middle that grows by extinct a
// metre; exact, and however thick the cube is. Where light enters the depth is 0. Light that spreads is dimmed
// less where it is stronger, and more aside of the middle: to the second order the mean of both is greater by
// extinct side^2 / (12 d), as from half as much nearer as the mean of what is dimmed is.
vec3 mean_transmittance(vec3 depth, vec3 extinct, light_path path, float side)
{
    vec3 near = depth, mean = vec3(1.0);
    int axes = path.chord > 0.0 ? 1 : 3;
    for (int axis = 0; axis < axes; ++axis) {
        vec3 across = extinct * (path.chord > 0.0 ? path.chord : side * abs(path.towards[axis]));
        near -= 0.5 * across;
        mean *= mix((1.0 - exp(-across)) / max(across, vec3(1e-6)), 1.0 - 0.5 * across,
                    lessThan(across, vec3(1e-3)));
    }
    if (path.spreads) {
        vec3 u = 0.5 * side * extinct;
        vec3 nearer = 1.0 - 0.25 * side / max(path.distance, side) * u * inversesqrt(9.0 + u * u);
        mean /= nearer * nearer;
    }
    return exp(-max(near, vec3(0.0))) * mean;
}
