// SPDX-License-Identifier: GPL-3.0-or-later
// Of the light before a surface, as a lattice tells it, what reaches the surface past others that stand
// nearer to it than the lattice tells apart, such as the other wall of a corner or what lies on a floor.
// How much of the sky over the surface those hide the horizons tell that the pixels around show, in two
// planes through the eye (Jimenez et al., "Practical Real-Time Strategies for Accurate Indirect Occlusion",
// SIGGRAPH 2016 courses; the closed form of the inner integral).

const float NEARBY_REACH = 1.5; // cells: from there on the lattice knows
const int NEARBY_STEPS = 8;     // along each half of a plane

layout(binding = SLOT_GBUFFER_EMISSION) uniform sampler2D gbuffer_emission;

// The pixels around one as its surface sees them.
struct pixels_around
{
    ivec2 pixel;
    vec3 p;
    float reach; // m
    float wide;  // the same, in pixels
    float start; // by lot
};

// Cosine of the angle between the view and the highest that stands within reach along a way in the picture;
// `least`: of the surface's own plane.
float horizon(pixels_around around, vec2 way, vec3 view, float least)
{
    float highest = least;
    ivec2 where = around.pixel;
    int i = 0;
    do {
        float t = (float(i) + around.start) / float(NEARBY_STEPS);
        ivec2 other = around.pixel + ivec2(round(way * max(around.wide * t * t, float(i + 1))));
        if (any(lessThan(other, ivec2(0))) || any(greaterThanEqual(other, frame.size.xy)))
            continue;
        float depth = texelFetch(gbuffer_normal, other, 0).w;
        view_ray ray = pixel_ray(other);
        vec3 to = ray.origin + ray.direction * (depth * ray.stretch) - around.p;
        float square = dot(to, to);
        // Less the farther off: the lattice knows the more of it.
        float counts = max(1.0 - square / (around.reach * around.reach), 0.0);
        float height = min(mix(least, dot(to, view) * inversesqrt(max(square, 1e-20)), counts), 1.0);
        if (depth > NO_DEPTH && height > highest) {
            highest = height;
            where = other;
        }
    } while (++i < NEARBY_STEPS);
    // What glows hides nothing: its light is the lattice's.
    return texelFetch(gbuffer_emission, where, 0).rgb == vec3(0.0) ? highest : least;
}

// Of the light that falls on a surface, of half a plane, what comes from within an angle off the view;
// `tilt`: the normal's.
float lit_within(float angle, float tilt)
{
    return 0.25 * (cos(tilt) - cos(2.0 * angle - tilt) + 2.0 * angle * sin(tilt));
}

// Share of the light, alike from everywhere, that comes to a surface past what is nearby.
float nearby_visible(surface s, vec3 p, float depth, ivec2 pixel, float cell)
{
    vec3 width = frame.ray_origin_x.xyz + depth * frame.ray_direction_x.xyz; // of half a picture
    vec3 height = frame.ray_origin_y.xyz + depth * frame.ray_direction_y.xyz;
    vec3 right = normalize(width), up = normalize(height);
    pixels_around around;
    around.pixel = pixel;
    around.p = p;
    around.reach = NEARBY_REACH * cell;
    around.wide = around.reach * 0.5 * float(frame.size.x) / max(length(width), 1e-20);
    around.wide = min(around.wide, 0.25 * float(frame.size.x));
    around.start = pixel_random(pixel, 41u);
    float turn = PI * pixel_random(pixel, 31u), visible = 0.0, all = 0.0;
    int plane = 0;
    do {
        vec2 way = plane == 0 ? vec2(cos(turn), sin(turn)) : vec2(-sin(turn), cos(turn));
        vec3 along = right * way.x + up * way.y;
        along = normalize(along - s.view * dot(along, s.view));
        vec3 across = cross(along, s.view);
        vec3 normal = s.normal - across * dot(s.normal, across); // in the plane
        float size = max(length(normal), 1e-6);
        float tilt = acos(clamp(dot(normal, s.view) / size, -1.0, 1.0));
        tilt = dot(normal, along) < 0.0 ? -tilt : tilt;
        float ahead = acos(horizon(around, way, s.view, -sin(tilt)));
        float behind = -acos(horizon(around, -way, s.view, sin(tilt)));
        visible += size * (lit_within(ahead, tilt) + lit_within(behind, tilt));
        all += size * (cos(tilt) + tilt * sin(tilt));
    } while (++plane < 2);
    return clamp(visible / all, 0.0, 1.0);
}

// Surfaces that hide light send on what they reflect of it, and this one's back again: as in a hollow
// whose opening is that share.
vec3 nearby_lit(float visible, vec3 reflectance)
{
    return visible / (1.0 - min(reflectance, 0.99) * (1.0 - visible));
}
