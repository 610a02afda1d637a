// SPDX-License-Identifier: GPL-3.0-or-later
// A view ray through the media: in-scattered and emitted light, transmittance.
#ifdef DOM_LAMPS
#define DOM
#define LAMPS // there are some
#endif

#include "lib/transmittance.glsl"
#include "lib/shadow.glsl"
#include "lib/sky.glsl"
#include "lib/field.glsl"
#include "lib/phase.glsl"

layout(binding = SLOT_GBUFFER_NORMAL) uniform sampler2D gbuffer_normal;

// A pixel's ray as far as it is seen: to the first surface, or to the far plane.
struct pixel_view
{
    view_ray ray;
    vec4 normal_depth;
    float t_near, t_far;
    bool hit;
};

pixel_view view_of(ivec2 pixel)
{
    pixel_view view;
    view.ray = pixel_ray(pixel);
    view.normal_depth = texelFetch(gbuffer_normal, pixel, 0);
    view.hit = view.normal_depth.w > NO_DEPTH;
    view.t_near = frame.clip.x * view.ray.stretch;
    view.t_far = (view.hit ? view.normal_depth.w : frame.clip.y) * view.ray.stretch;
    return view;
}

struct march_state
{
    vec3 direct;        // in-scattered: the lights' own light
    vec3 indirect;      // and what was scattered or reflected before
    vec3 emission;
    vec3 transmittance;
};

// Mean of 1/d^2 over dt of a ray, from t0 on, whose nearest approach to a point, at distance h, is at
// t = 0: the exact integral, so that a lamp in the fog makes no bright cell and no banding. Turns
// `within`, a place in the step, 0 to 1, into one that is as likely as 1/d^2 is large: what else varies
// counts where the light is (Kulla and Fajardo, "Importance Sampling Techniques for Path Tracing in
// Participating Media", EGSR 2012, sec. 4.1). `uneven`: how far the least 1/d^2 is from the greatest, 0 to 1.
float mean_inverse_square(float t0, float dt, float h, inout float within, out float uneven)
{
    float x = t0 / h, wide = dt / h;
    float begins = 1.0 + x * x, ends = 1.0 + (x + wide) * (x + wide);
    uneven = 1.0 - min(begins, ends) / max(begins, ends);
    // atan(x + wide) - atan(x), without cancellation far from the lamp.
    float angle = atan(wide, 1.0 + x * (x + wide));
    // tan(atan(x) + within * angle) - x, likewise; of small angles no driver need know the tangent well.
    float part = within * angle, turned = part < 0.1 ? part + part * part * part / 3.0 : tan(part);
    within = clamp(turned * begins / ((1.0 - x * turned) * wide), 0.0, 1.0);
    return angle / (h * dt);
}

// The distance from the ray that mean_inverse_square wants, and in `along` the point's place on the
// ray. Samples strewn over a disk that faces the medium would each have a bright core of their own; those of an
// area, which the pixels' samples move about, are blunt by a sixth of the radius of what each stands for: the
// sharpest of their peaks would be grain, and hold 1 % of the light right before the lamp.
float nearest_approach(gpu_light light, vec3 point, view_ray ray, out float along)
{
    bool disk = is_disk(light);
    vec3 v = (disk ? light.position.xyz : point) - ray.origin;
    along = dot(v, ray.direction);
    vec3 off = v - along * ray.direction;
    float share = light.radiance.w / (PI * float(light.samples.y)); // of the area: radius squared
    return sqrt(max(dot(off, off) + (disk ? softness(light) : 0.03 * share), 1e-8));
}

// The medium at one step of the ray: lattice and fog together.
struct medium_step
{
    vec3 sigma_s, sigma_t, emission;
    float g;
};

// What scatters at a place.
void look_up_scatter(vec3 p, bool in_lattice, inout medium_step m)
{
    vec4 scatter = in_lattice ? textureLod(medium_scatter, medium_coordinate(p), 0.0) : vec4(0.0);
    m.sigma_s = scatter.rgb;
    m.g = scatter.a;
    if (fog_exists())
        add_fog(m.sigma_s, m.g);
}

vec3 look_up_extinct(vec3 p, bool in_lattice)
{
    vec3 sigma_t = in_lattice ? textureLod(medium_extinct, medium_coordinate(p), 0.0).rgb : vec3(0.0);
    return fog_exists() ? sigma_t + frame.fog_sigma_t.rgb : sigma_t;
}

// The rest of it. False where the step is in an empty brick; `skipped` more steps then are too.
bool look_up(view_ray ray, float t, float dt, float within, bool in_lattice, bool emission,
             out medium_step m, out int skipped)
{
    m = medium_step(vec3(0.0), vec3(0.0), vec3(0.0), 0.0);
    skipped = 0;
    vec3 p = ray.origin + ray.direction * t;
    bool fog = fog_exists(), here = in_lattice;
    if (in_lattice) {
        float skip = medium_skip(p, ray.direction);
        if (skip > 0.0 && !fog) {
            skipped = medium_steps_to_skip(skip, dt, within);
            return false;
        }
        here = skip <= 0.0;
    }
    m.sigma_t = look_up_extinct(p, here);
    if (emission) {
        if (here && frame.medium_upper.w != 0.0)
            m.emission = textureLod(medium_emission, medium_coordinate(p), 0.0).rgb;
        if (fog)
            m.emission += frame.fog_emission.rgb;
    }
    return true;
}

// Integral of exp(-sigma_t s) over the step; its limit where the medium is thin.
vec3 step_weight(vec3 sigma_t, vec3 through, float dt)
{
    return mix((1.0 - through) / max(sigma_t, vec3(1e-12)), vec3(dt),
               lessThan(sigma_t * dt, vec3(1e-4)));
}

// The same where the place that the step is seen at was chosen: that goes with how far the light of it comes.
vec3 step_weight_at(vec3 sigma_t, vec3 through, float dt, float within, float chosen)
{
    return mix(step_weight(sigma_t, through, dt), dt * exp(-sigma_t * (within * dt)), chosen);
}

// A place in a step that is as likely as what is there is seen through the step's thinnest colour: in thick
// media, where a step is many free paths long, the light at its beginning is all that counts. `within`, a place
// from 0 to 1, becomes it; `weight`: what light there counts of the step's integral, by colours.
void see_into(vec3 sigma_t, vec3 through, float dt, inout float within, out vec3 weight)
{
    float depth = min(min(sigma_t.r, sigma_t.g), sigma_t.b) * dt, seen = 1.0 - exp(-depth);
    if (depth < 0.1) {
        weight = step_weight(sigma_t, through, dt);
        return;
    }
    within = min(-log(1.0 - within * seen) / depth, 1.0);
    weight = exp((depth - sigma_t * dt) * within) * (dt * seen / depth);
}

// What is left behind this could no longer be told from black.
bool is_black(vec3 transmittance)
{
    return max(max(transmittance.r, transmittance.g), transmittance.b) < 1e-4;
}

// Each step has a jitter of its own: the errors of a ray's steps then cancel one another.
float step_jitter(float jitter, int k)
{
    return fract(jitter + float(k) * 0.754877666);
}

// A lamp's sample as a ray's steps see it.
struct lamp_ray
{
    gpu_light light;
    gpu_light_sample light_sample;
    vec3 point; // that it stands for
    bool sun;
    float along, h; // as nearest_approach() has them
};

lamp_ray lamp_along(uint number, view_ray ray, ivec2 pixel)
{
    lamp_ray lamp;
    lamp.light = light_at(number);
    uint turn = turn_of(uint(frame.size.z) + pixel_hash(pixel, number), lamp.light.samples.y);
    lamp.light_sample = light_sample_at(lamp.light.samples.x + turn);
    lamp.sun = lamp.light.info.x == uint(LIGHT_SUN);
    lamp.point = light_point(lamp.light, lamp.light_sample, light_lot(pixel, number));
    lamp.h = nearest_approach(lamp.light, lamp.point, ray, lamp.along);
    return lamp;
}

// What reaches the eye of what a step scatters. Where a strong forward peak counts as not scattered, the
// light in the peak itself (sharp) is seen as far as it is scattered no more, be it forwards: what it was
// scattered before is in the lesser depth towards the lamp.
struct march_reach
{
    vec3 soft;
#ifdef DOM
    vec3 sharp;
#endif
};

#ifdef DOM
// How often light has been scattered by the forward peak on a way of such a depth through a medium such as is
// here, in the mean of the colours. No light is left behind depths of 80.
float times_forward(medium_step m, vec3 depth)
{
    vec3 times = forward_share(m.g) * m.sigma_s / max(m.sigma_t, vec3(1e-12));
    return dot(min(depth, vec3(80.0)) * times, vec3(1.0 / 3.0));
}
#endif

// What a lamp adds in a step from t0 on, whose medium is known at a place within it; what it scatters there
// may be. What comes from behind it has less reach. Of the peak's lobes below 0 a step may have less than
// nothing; a ray has not.
vec3 lamp_step(lamp_ray lamp, view_ray ray, medium_step m, bool scatter_known, bool in_lattice,
               float t0, float within, float dt, inout march_reach reach)
{
    vec3 through = exp(-m.sigma_t * dt);
#ifdef DOM
    vec3 sharp_t = m.sigma_t + forward_share(m.g) * m.sigma_s;
    vec3 sharp_through = exp(-sharp_t * dt);
#endif
    float falloff = 1.0, uneven = 0.0;
    vec3 weight;
    if (!lamp.sun)
        falloff = mean_inverse_square(t0 - lamp.along, dt, lamp.h, within, uneven);
    else
        see_into(m.sigma_t, through, dt, within, weight);
    vec3 p = ray.origin + ray.direction * (t0 + within * dt);
#ifdef DOM
    vec3 sharp_there = sharp_through;
#endif
    // Both of one place: no step scatters more than meets it.
    if (!(scatter_known && lamp.sun))
        look_up_scatter(p, in_lattice, m);
    if (!lamp.sun) {
        m.sigma_t = look_up_extinct(p, in_lattice);
        vec3 there = exp(-m.sigma_t * dt);
        weight = step_weight_at(m.sigma_t, there, dt, within, uneven);
#ifdef DOM
        sharp_t = m.sigma_t + forward_share(m.g) * m.sigma_s;
        sharp_there = exp(-sharp_t * dt);
#endif
    }
    vec3 towards;
    float square;
    vec3 intensity = falloff * light_intensity(lamp.light, lamp.point, p, towards, square);
    float distance = lamp.sun ? 1e30 : sqrt(square);
    if (m.sigma_s == vec3(0.0))
        intensity = vec3(0.0);
    if (intensity != vec3(0.0))
        intensity *= light_shadow_medium(lamp.light, lamp.light_sample, p);
    vec3 sum = vec3(0.0);
    if (intensity != vec3(0.0)) {
        float cosine = dot(towards, ray.direction);
        vec4 depth = light_depth(lamp.light, p, towards, distance);
        vec3 here = m.sigma_s * intensity * exp(-depth.rgb);
#ifdef DOM
        float soft = phase_soft(cosine, m.g);
        float peak = phase_peak(cosine, m.g, times_forward(m, depth.rgb), depth.a);
        // In the peak the step is denser than in what its place was chosen by, and its weight the lesser.
        vec3 sharp = lamp.sun ? weight * exp((m.sigma_t - sharp_t) * (within * dt))
                              : step_weight_at(sharp_t, sharp_there, dt, within, uneven);
        sum = here * (reach.soft * weight * soft + reach.sharp * sharp * peak);
#else
        sum = here * reach.soft * weight * phase_hg(cosine, m.g);
#endif
    }
    reach.soft *= through;
#ifdef DOM
    reach.sharp *= sharp_through;
#endif
    return sum;
}

march_reach reach_of(vec3 transmittance)
{
#ifdef DOM
    return march_reach(transmittance, transmittance);
#else
    return march_reach(transmittance);
#endif
}

// What one lamp adds along the steps from first to end, which start at t_start. Lamps are the outer
// loop: their data are read once a ray.
vec3 march_lamp(uint number, vec3 transmittance, view_ray ray, float t_start, float dt, int first,
                int end, bool in_lattice, ivec2 pixel, float jitter)
{
    lamp_ray lamp = lamp_along(number, ray, pixel);
    march_reach reach = reach_of(transmittance);
    vec3 sum = vec3(0.0);
    int k = first;
    do {
        float within = step_jitter(jitter, k);
        float t0 = t_start + float(k) * dt;
        float t = t0 + within * dt;
        medium_step m;
        int skipped;
        if (look_up(ray, t, dt, within, in_lattice, false, m, skipped) &&
            !(lamp.sun && m.sigma_t == vec3(0.0))) {
#ifdef DOM // whose reach depends on it
            look_up_scatter(ray.origin + ray.direction * t, in_lattice, m);
            sum += lamp_step(lamp, ray, m, true, in_lattice, t0, within, dt, reach);
#else
            sum += lamp_step(lamp, ray, m, false, in_lattice, t0, within, dt, reach);
#endif
        }
        k += skipped;
    } while (++k < end);
    return max(sum, vec3(0.0)) * lamp.light.factors.z;
}

// Where a lattice whose cells are longer than steps is asked for so many of these, the first of them at t: in
// their middle. Asked at the first, light that grows behind a lit face would come too late.
vec3 middle_of(view_ray ray, float t, int steps, float dt, float t_end)
{
    return ray.origin + ray.direction * min(t + 0.5 * float(steps - 1) * dt, t_end);
}

// Transmittance, emission, the world's light and the lamps' along the stretch.
void march(inout march_state state, view_ray ray, vec2 span, int count, bool in_lattice,
           ivec2 pixel, float jitter)
{
    vec3 transmittance = state.transmittance;
    float dt = (span.y - span.x) / float(count);
#ifndef DOM // which has the world's light in its field
    // The sky's lattice is coarser than a step.
    int sky_steps = max(int(frame.sky_lower.w / dt + 0.5), 1), sky_next = 0;
    vec3 sky = vec3(0.0);
#endif
    // So is the field's, whose look-ups are dear.
    gpu_field finest = frame.fields[max(frame.field.x - 1, 0)];
    int field_steps = max(int(0.5 * finest.lower.w / dt + 0.5), 1), field_next = 0;
    vec3 field = vec3(0.0);
    bool with_field = field_exists() && frame.paths.y != 0;
#ifdef LAMPS
    // The first lamp takes these steps along: it need not look up what is there once more.
    lamp_ray lamp = lamp_along(0u, ray, pixel);
    march_reach reach = reach_of(transmittance);
    vec3 lamp_sum = vec3(0.0);
#endif
    int first = count, end = 0; // the steps in bricks that are not empty
    int k = 0;
    do {
        bool open = true; // else one look-up did not tell the last step's field
        vec3 p, scattered;
        do {
            float within = step_jitter(jitter, k);
            float t0 = span.x + float(k) * dt, t = t0 + within * dt;
            medium_step m;
            int skipped;
            if (!look_up(ray, t, dt, within, in_lattice, true, m, skipped)) {
                k += skipped;
                continue;
            }
            first = min(first, k);
            end = k + 1;
            // A lamp near by may see the step where it is not, if in no empty brick.
            bool empty = m.sigma_t == vec3(0.0) && m.emission == vec3(0.0);
#ifdef LAMPS
            empty = empty && lamp.sun;
#endif
            if (empty)
                continue;
            look_up_scatter(ray.origin + ray.direction * t, in_lattice, m);
            vec3 through = exp(-m.sigma_t * dt);
            vec3 weight = transmittance * step_weight(m.sigma_t, through, dt);
            state.emission += weight * m.emission;
            scattered = weight * m.sigma_s;
#ifndef DOM
            if (frame.sky_dims.w != 0 && frame.paths.x != 0) {
                if (k >= sky_next) {
                    p = middle_of(ray, t, sky_steps, dt, span.y);
                    sky = sky_scatter(p, -ray.direction, m.g);
                    sky_next = k + sky_steps;
                }
                state.direct += scattered * sky;
            }
#endif
            if (with_field) {
                if (field_steps == 1) {
                    float place = within;
                    see_into(m.sigma_t, through, dt, place, weight);
                    scattered = transmittance * weight * m.sigma_s;
                    t = t0 + place * dt;
                }
                if (k >= field_next) {
                    p = middle_of(ray, t, field_steps, dt, span.y);
#ifdef DOM
                    open = field_scattered_open(finest, p, field);
#else
                    field = field_scatter(p, -ray.direction, m.g);
#endif
                    field_next = k + field_steps;
                }
                if (open)
                    state.indirect += scattered * field;
            }
#ifdef LAMPS
            lamp_sum += lamp_step(lamp, ray, m, true, in_lattice, t0, within, dt, reach);
#endif
            transmittance *= through;
            if (is_black(transmittance)) {
                transmittance = vec3(0.0);
                k = count;
            }
        } while (++k < count && open);
#ifdef DOM
        if (!open) {
            field = field_scattered(p);
            state.indirect += scattered * field;
        }
#endif
    } while (k < count);
    uint i = 0u;
#ifdef LAMPS
    if (frame.paths.x != 0)
        state.direct += max(lamp_sum, vec3(0.0)) * lamp.light.factors.z;
    ++i;
#endif
    if (first < end && frame.paths.x != 0 && i < frame.counts.x) do
        state.direct += march_lamp(i, state.transmittance, ray, span.x, dt, first, end,
                                   in_lattice, pixel, jitter);
    while (++i < frame.counts.x);
    state.transmittance = transmittance;
}

// The stretches of a ray in media: in the world's alone before the lattice, in the lattice's box,
// and behind it again. Those that end where they begin, or before, are none.
struct media_spans
{
    vec2 before, box, after;
};

media_spans spans_of(view_ray ray, float t_near, float t_far)
{
    vec2 fog = vec2(0.0);
    if (fog_exists()) {
        fog = ray_box(ray.origin, ray.direction, frame.fog_lower.xyz, frame.fog_upper.xyz);
        // Beyond this depth of fog nothing is seen, however far it reaches.
        vec3 sigma = mix(frame.fog_sigma_t.rgb, vec3(1e30),
                         equal(frame.fog_sigma_t.rgb, vec3(0.0)));
        float thinnest = min(min(sigma.r, sigma.g), sigma.b);
        fog.y = min(fog.y, max(fog.x, t_near) + 12.0 / max(thinnest, 1e-6));
        fog = vec2(max(fog.x, t_near), min(fog.y, t_far));
    }
    media_spans spans = media_spans(fog, vec2(0.0), vec2(0.0));
    if (medium_exists()) {
        vec2 box = ray_box(ray.origin, ray.direction, frame.medium_lower.xyz,
                           frame.medium_upper.xyz);
        box = vec2(max(box.x, t_near), min(box.y, t_far));
        if (box.x < box.y)
            spans = media_spans(vec2(fog.x, min(box.x, fog.y)), box,
                                vec2(max(box.y, fog.x), fog.y));
    }
    return spans;
}

void march_media(inout march_state state, view_ray ray, media_spans spans, ivec2 pixel)
{
    float jitter = pixel_random(pixel, 11u);
    vec2 stretches[3] = vec2[](spans.before, spans.box, spans.after);
    // One call, in a loop that no compiler unrolls: three would be three times as long to compile.
    int i = fog_exists() ? 0 : 1, last = fog_exists() ? 2 : 1;
    do {
        vec2 span = stretches[i];
        if (span.x >= span.y)
            continue;
        bool in_box = i == 1;
        int count = in_box ? max(int(ceil((span.y - span.x) / frame.march.x)), 1)
                           : int(frame.march.y);
        march(state, ray, span, count, in_box, pixel, jitter);
    } while (++i <= last);
}
