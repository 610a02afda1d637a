// SPDX-License-Identifier: GPL-3.0-or-later
// The media: the lattice of all volumes, and the world's homogeneous medium, kept analytic.
#include "lib/frame.glsl"
#include "lib/phase.glsl"

layout(binding = SLOT_MEDIUM_SCATTER) uniform sampler3D medium_scatter;   // sigma_s, mean cosine
layout(binding = SLOT_MEDIUM_EXTINCT) uniform sampler3D medium_extinct;   // sigma_t
layout(binding = SLOT_MEDIUM_EMISSION) uniform sampler3D medium_emission;
layout(binding = SLOT_MEDIUM_BRICKS) uniform sampler3D medium_bricks;     // 0: nothing in the brick

bool medium_exists()
{
    return frame.medium_dims.w != 0;
}

vec3 medium_coordinate(vec3 p)
{
    return (p - frame.medium_lower.xyz) /
           (frame.medium_lower.w * vec3(textureSize(medium_extinct, 0)));
}

// The lattice's medium in a cube of that side around a point: means, of g by how much each part scatters.
struct medium_mean
{
    vec3 sigma_s, sigma_t, emission;
    vec3 sigma_s_scaled; // strong forward scattering counts as none
    float g;
};

// Asked at points a cell of the medium apart, or nearly: texels are then asked for as they weigh, so that
// thick media are as thick in cells that their sides pass through. Not where the cube's thirds, numbered
// as in point_in_cube(), are hidden; in its middle none is.
medium_mean mean_of_medium(vec3 p, float side, int most, uint hidden)
{
    medium_mean m = medium_mean(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), 0.0);
    vec3 reach = vec3(0.5 * side);
    bool near = medium_exists() && all(lessThan(frame.medium_lower.xyz, p + reach)) &&
                all(lessThan(p - reach, frame.medium_upper.xyz));
    if (!near)
        return m;
    int points = clamp(int(ceil(side / frame.medium_lower.w)), 1, most);
    int all_ = points * points * points, i = 0;
    float weights = 0.0, asked = 0.0;
    do {
        vec3 within = point_in_cube(i, points), q = p + (within - 0.5) * side;
        if ((hidden & third_bit(within)) != 0u)
            continue;
        asked += 1.0;
        if (!in_box(q, frame.medium_lower.xyz, frame.medium_upper.xyz))
            continue;
        vec3 uvw = medium_coordinate(q);
        vec4 scatter = textureLod(medium_scatter, uvw, 0.0);
        float weight = luminance(scatter.rgb);
        m.sigma_s += scatter.rgb;
        m.sigma_s_scaled += scatter.rgb * (1.0 - forward_share(scatter.a));
        m.sigma_t += textureLod(medium_extinct, uvw, 0.0).rgb;
        m.g += scatter.a * weight;
        weights += weight;
        if (frame.medium_upper.w != 0.0)
            m.emission += textureLod(medium_emission, uvw, 0.0).rgb;
    } while (++i < all_);
    float share = 1.0 / max(asked, 1.0);
    m.sigma_s *= share;
    m.sigma_s_scaled *= share;
    m.sigma_t *= share;
    m.emission *= share;
    m.g /= max(weights, 1e-30);
    return m;
}

// Distance along the direction to the end of an empty brick, 0 where the brick has something.
float medium_skip(vec3 p, vec3 direction)
{
    float side = frame.medium_lower.w * float(BRICK_CELLS);
    vec3 q = (p - frame.medium_lower.xyz) / side;
    ivec3 last = (frame.medium_dims.xyz - 1) / BRICK_CELLS;
    ivec3 brick = clamp(ivec3(floor(q)), ivec3(0), last);
    if (texelFetch(medium_bricks, brick, 0).r > 0.0)
        return 0.0;
    vec3 d = mix(direction, vec3(1e-20), lessThan(abs(direction), vec3(1e-20)));
    vec3 t = (vec3(brick) + step(0.0, d) - q) * side / d;
    return max(min(t.x, min(t.y, t.z)), 0.0);
}

// How many of the steps that follow number k, at `within` of it, lie wholly in an empty brick.
int medium_steps_to_skip(float skip, float dt, float within)
{
    return max(int(skip / dt + within) - 1, 0);
}

// Optical depth of the lattice from the origin along a unit direction, each step seen at `within`
// of its length (1/2 is the midpoint rule). Exact where the medium is homogeneous.
vec3 medium_tau(vec3 origin, vec3 direction, float t_max, float step_length, float within)
{
    vec2 span = ray_box(origin, direction, frame.medium_lower.xyz, frame.medium_upper.xyz);
    float t0 = max(span.x, 0.0);
    float t1 = min(span.y, t_max);
    vec3 tau = vec3(0.0);
    if (t0 >= t1)
        return tau;
    int count = max(int(ceil((t1 - t0) / step_length)), 1);
    float dt = (t1 - t0) / float(count);
    int k = 0;
    do {
        vec3 p = origin + direction * (t0 + (float(k) + within) * dt);
        float skip = medium_skip(p, direction);
        if (skip > 0.0)
            k += medium_steps_to_skip(skip, dt, within);
        else
            tau += textureLod(medium_extinct, medium_coordinate(p), 0.0).rgb * dt;
    } while (++k < count);
    return tau;
}

bool fog_exists()
{
    return frame.fog_lower.w != 0.0;
}

// Adds the world's medium to what scatters; g: the mean, weighted by how much each scatters.
void add_fog(inout vec3 sigma_s, inout float g)
{
    float here = luminance(sigma_s), there = luminance(frame.fog_sigma_s.rgb);
    g = (here * g + there * frame.fog_sigma_s.w) / max(here + there, 1e-30);
    sigma_s += frame.fog_sigma_s.rgb;
}

// Optical depth of the world's medium from the origin along a unit direction.
vec3 fog_tau(vec3 origin, vec3 direction, float t_max)
{
    if (!fog_exists())
        return vec3(0.0);
    vec2 span = ray_box(origin, direction, frame.fog_lower.xyz, frame.fog_upper.xyz);
    float length_inside = max(min(span.y, t_max) - max(span.x, 0.0), 0.0);
    return frame.fog_sigma_t.rgb * length_inside;
}

// What all media between a point and something infinitely far let through; as medium_tau.
vec3 distant_transmittance(vec3 p, vec3 towards, float step_length, float within)
{
    vec3 tau = fog_tau(p, towards, 1e30);
    if (medium_exists())
        tau += medium_tau(p, towards, 1e30, step_length, within);
    return exp(-tau);
}
