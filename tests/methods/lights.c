/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Radiometry of lamps in closed form: on a white matt plate, whose radiance is irradiance / pi, and
 * in homogeneous media, where single scattering along a ray is one integral ("airlight"), done here
 * by quadrature. Tolerances: 1 % where nothing is sampled, 2 % where jittered steps or lamp
 * samples are. */
#include "harness.h"

#define PI 3.14159265358979

static const float origin[3];
static const float down[3] = {0, 0, -1};

static const brume_settings settings = {.medium_resolution = 32,
                                        .lattice_resolution = 32,
                                        .shadow_resolution = 256,
                                        .light_samples = 64,
                                        .world_samples = 256};

/* --- On a plate --------------------------------------------------------------------------- */

static double plate_under(const brume_light *lamp, const brume_world *world, const float target[3])
{
    brume_scene *scene;
    assert_ok(brume_scene_create(device, &scene));
    add_plate(scene, 1, origin, down, 4.0f);
    if (lamp)
        assert_ok(brume_scene_set_light(scene, 1, lamp));
    if (world)
        assert_ok(brume_scene_set_world(scene, world));
    brume_view view = orthographic_view(target, down, 0.001f, 0.25f, 4);
    view.samples = 64;
    brume_job *job = render(scene, &settings, &view);
    float *pixels = read_pass(job, &view, BRUME_PASS_COMBINED);
    const double value = middle(pixels, &view, 4, 1);
    free(pixels);
    brume_job_release(job);
    brume_scene_destroy(scene);
    return value;
}

static void sun_on_plate(void **state)
{
    (void)state;
    static const float angles[] = {0.0f, 0.6f, 1.2f};
    for (int i = 0; i < 3; ++i) {
        const float along[3] = {sinf(angles[i]), 0, -cosf(angles[i])};
        brume_light sun = point_lamp(origin, 2.0f);
        sun.type = BRUME_LIGHT_SUN;
        placed(origin, along, sun.world_from_light);
        assert_close(plate_under(&sun, NULL, origin), 2.0 * cos(angles[i]) / PI, 0.01);
        sun.angle = 0.1f; /* a wide sun gives the same irradiance */
        assert_close(plate_under(&sun, NULL, origin), 2.0 * cos(angles[i]) / PI, 0.02);
    }
}

/* Intensity P / (4 pi) W/sr: an isotropic source of P watts. */
static void point_on_plate(void **state)
{
    (void)state;
    static const float places[][3] = {{0, 0, 1}, {0, 0, 3}, {1, 0.5f, 2}};
    for (int i = 0; i < 3; ++i) {
        const brume_light lamp = point_lamp(places[i], 10.0f);
        const float *q = places[i];
        const double square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2];
        const double expected = 10.0 / (4.0 * PI) * q[2] / (square * sqrt(square)) / PI;
        assert_close(plate_under(&lamp, NULL, origin), expected, 0.01);
        brume_light ball = lamp;
        ball.radius = 0.05f;
        assert_close(plate_under(&ball, NULL, origin), expected, 0.02);
    }
}

static void spot_on_plate(void **state)
{
    (void)state;
    brume_light spot = point_lamp((float[3]){0, 0, 2}, 10.0f);
    spot.type = BRUME_LIGHT_SPOT;
    spot.spot_angle = (float)(PI / 3);
    const double on_axis = 10.0 / (4.0 * PI) / 4.0 / PI;
    assert_close(plate_under(&spot, NULL, origin), on_axis, 0.01);
    /* 30 degrees to each side: 2 tan(30 degrees) = 1.155 from the axis. */
    assert_true(plate_under(&spot, NULL, (float[3]){1.13f, 0, 0}) > 0.3 * on_axis);
    assert_true(plate_under(&spot, NULL, (float[3]){1.18f, 0, 0}) == 0.0);
    assert_true(plate_under(&spot, NULL, (float[3]){0, -1.18f, 0}) == 0.0);
    spot.spot_blend = 1.0f; /* the axis keeps its light */
    assert_close(plate_under(&spot, NULL, origin), on_axis, 0.01);
    assert_true(plate_under(&spot, NULL, (float[3]){1.0f, 0, 0}) < 0.3 * on_axis);
}

/* Radiance P / (4 A) on the whole lamp. A disk of radius r overhead at height h has the form factor
 * r^2 / (r^2 + h^2); the rectangle's is a sum. */
static void area_on_plate(void **state)
{
    (void)state;
    static const double radii[] = {0.05, 0.5, 1.0};
    for (int i = 0; i < 3; ++i) {
        const double r = radii[i], h = 1.0;
        brume_light lamp = point_lamp((float[3]){0, 0, (float)h}, 10.0f);
        lamp.type = BRUME_LIGHT_ELLIPSE;
        lamp.size[0] = lamp.size[1] = (float)(2 * r);
        assert_close(plate_under(&lamp, NULL, origin),
                     10.0 / (4.0 * PI * r * r) * r * r / (r * r + h * h), 0.02);

        lamp.type = BRUME_LIGHT_RECTANGLE;
        lamp.size[1] = 0.5f * lamp.size[0];
        double form = 0.0; /* integral of cos cos / d^2 */
        enum { CELLS = 200 };
        const double a = lamp.size[0], b = lamp.size[1];
        for (int j = 0; j < CELLS; ++j)
            for (int k = 0; k < CELLS; ++k) {
                const double x = a * ((j + 0.5) / CELLS - 0.5), y = b * ((k + 0.5) / CELLS - 0.5);
                const double square = x * x + y * y + h * h;
                form += h * h / (square * square) * a * b / (CELLS * CELLS);
            }
        assert_close(plate_under(&lamp, NULL, origin), 10.0 / (4.0 * a * b) * form / PI, 0.02);
    }
}

/* A lamp in a shut box lights nothing outside, whichever way it looks: its maps leave no gap. */
static void shut_in(void **state)
{
    (void)state;
    static const float place[3] = {0, 0, 0.5f};
    static const float directions[][3] = {{0, 0, -1}, {0.3f, -0.5f, -0.8f}, {1, 1, 1}};
    static const uint32_t types[] = {BRUME_LIGHT_POINT, BRUME_LIGHT_RECTANGLE};
    for (int i = 0; i < 6; ++i) {
        brume_scene *scene;
        assert_ok(brume_scene_create(device, &scene));
        add_plate(scene, 1, origin, down, 4.0f);
        add_cube(scene, 2, place, 0.2f, BRUME_VISIBLE_SHADOW);
        brume_light lamp = point_lamp(place, 10.0f);
        lamp.type = types[i % 2];
        lamp.size[0] = lamp.size[1] = 0.1f;
        placed(place, directions[i / 2], lamp.world_from_light);
        assert_ok(brume_scene_set_light(scene, 1, &lamp));
        const brume_view view = orthographic_view(origin, down, 3.9f, 2.0f, 64);
        brume_job *job = render(scene, &settings, &view);
        float *pixels = read_pass(job, &view, BRUME_PASS_COMBINED);
        for (int pixel = 0; pixel < 64 * 64; ++pixel)
            if (pixels[4 * pixel] != 0.0f)
                fail_msg("case %d: %g at pixel (%d, %d)", i, pixels[4 * pixel], pixel % 64,
                         pixel / 64);
        free(pixels);
        brume_job_release(job);
        brume_scene_destroy(scene);
    }
}

/* Under an even world an open plate has the world's radiance times its albedo. */
static void world_on_plate(void **state)
{
    (void)state;
    const brume_world world = {.color = {3, 0.7f, 3}};
    assert_close(plate_under(NULL, &world, origin), 0.7, 0.02);
}

/* --- In a medium -------------------------------------------------------------------------- */

struct airlight {
    const char *what;
    float lamp[3];
    float y, z; /* the ray runs along +X through (0, y, z) */
    struct coefficients medium;
    float spot_angle; /* 0: a point */
    float side;       /* of a square that shines down instead */
};

/* The medium is the cube of side 2 around the origin: how far towards the lamp it reaches. */
static double inside(const double p[3], const double to_lamp[3], double distance)
{
    double length = distance;
    for (int i = 0; i < 3; ++i)
        if (fabs(to_lamp[i]) > 1e-12)
            length = fmin(length, ((to_lamp[i] > 0 ? 1.0 : -1.0) - p[i]) / to_lamp[i]);
    return length;
}

/* From a point lamp of a watt, or per area from a point of a square lamp. */
static double airlight_from(const struct airlight *a, const double from[3], int channel, int steps)
{
    const double sigma_s = a->medium.sigma_s[channel], g = a->medium.g;
    const double sigma_t = sigma_s + a->medium.sigma_a[channel];
    double sum = 0.0;
    for (int k = 0; k < steps; ++k) {
        const double p[3] = {-1.0 + 2.0 * (k + 0.5) / steps, a->y, a->z};
        double v[3], square = 0.0;
        for (int i = 0; i < 3; ++i) {
            v[i] = from[i] - p[i];
            square += v[i] * v[i];
        }
        const double distance = sqrt(square);
        for (int i = 0; i < 3; ++i)
            v[i] /= distance;
        double intensity = 1.0 / (4.0 * PI);
        if (a->spot_angle > 0.0f) /* it shines down, with Cycles' cosine */
            intensity *= v[2] > cos(0.5 * a->spot_angle) ? v[2] : 0.0;
        if (a->side > 0.0f)
            intensity = fmax(v[2], 0.0) / (4.0 * a->side * a->side);
        const double cosine = v[0]; /* the light goes along -v, the eye's way is -X */
        const double phase = (1.0 - g * g) / (4.0 * PI * pow(1.0 + g * g - 2.0 * g * cosine, 1.5));
        sum += sigma_s * phase * intensity / square *
               exp(-sigma_t * (inside(p, v, distance) + p[0] + 1.0)) * 2.0 / steps;
    }
    return sum;
}

static double quadrature(const struct airlight *a, int channel)
{
    enum { ACROSS = 64 };
    const double from[3] = {a->lamp[0], a->lamp[1], a->lamp[2]};
    if (a->side <= 0.0f)
        return airlight_from(a, from, channel, 20000);
    double sum = 0.0;
    for (int i = 0; i < ACROSS; ++i)
        for (int j = 0; j < ACROSS; ++j) {
            const double at[3] = {from[0] + a->side * ((i + 0.5) / ACROSS - 0.5),
                                  from[1] + a->side * ((j + 0.5) / ACROSS - 0.5), from[2]};
            sum += airlight_from(a, at, channel, 500) * a->side * a->side / (ACROSS * ACROSS);
        }
    return sum;
}

/* What pixels that all look along +X through (0, y, z) see of the lamps' light in media: their mean
 * and the brightest, by channels. */
static void look_along(brume_scene *scene, const brume_settings *wanted, float y, float z,
                       double mean[3], double most[3])
{
    brume_view view =
        orthographic_view((float[3]){0, y, z}, (float[3]){1, 0, 0}, 1e-4f, 3.0f, 8);
    view.samples = 64;
    view.passes = 1u << BRUME_PASS_VOLUME_DIRECT;
    brume_job *job = render(scene, wanted, &view);
    float *pixels = read_pass(job, &view, BRUME_PASS_VOLUME_DIRECT);
    for (int channel = 0; channel < 3; ++channel) {
        mean[channel] = most[channel] = 0.0;
        for (int pixel = 0; pixel < 64; ++pixel) {
            mean[channel] += pixels[3 * pixel + channel] / 64.0;
            most[channel] = fmax(most[channel], pixels[3 * pixel + channel]);
        }
    }
    free(pixels);
    brume_job_release(job);
}

/* step: the march's. */
static void expect_airlight(const struct airlight *a, float step)
{
    brume_settings wanted = settings;
    wanted.step = step;
    wanted.light_samples = 4; /* a square is even all the same */
    brume_scene *scene;
    assert_ok(brume_scene_create(device, &scene));
    add_fog_cube(scene, 1, origin, 1.0f, &a->medium);
    brume_light lamp = point_lamp(a->lamp, 1.0f);
    if (a->spot_angle > 0.0f) {
        lamp.type = BRUME_LIGHT_SPOT;
        lamp.spot_angle = a->spot_angle;
    }
    if (a->side > 0.0f) {
        lamp.type = BRUME_LIGHT_RECTANGLE;
        lamp.size[0] = lamp.size[1] = a->side;
    }
    assert_ok(brume_scene_set_light(scene, 1, &lamp));
    double mean[3], most[3];
    look_along(scene, &wanted, a->y, a->z, mean, most);
    brume_scene_destroy(scene);
    for (int channel = 0; channel < 3; ++channel) {
        const double expected = quadrature(a, channel);
        if (fabs(mean[channel] - expected) > 0.02 * expected)
            fail_msg("lamp %s, step %g: %.6g instead of %.6g, %.2f %% off", a->what, (double)step,
                     mean[channel], expected, 100.0 * (mean[channel] / expected - 1.0));
        /* All pixels see the same; none may be a firefly. */
        if (most[channel] > 1.25 * expected)
            fail_msg("lamp %s, step %g: a pixel of %.6g where %.6g is due", a->what, (double)step,
                     most[channel], expected);
    }
}

static void airlight_of_lamps(void **state)
{
    (void)state;
#define THIN                               \
    {                                      \
        .sigma_s = { 0.05f, 0.05f, 0.05f } \
    }
#define TINTED                                                                \
    {                                                                         \
        .sigma_s = {0.05f, 0.5f, 1.0f}, .sigma_a = {0.2f, 0.1f, 0}, .g = 0.5f \
    }
    static const struct airlight cases[] = {
        {"far from the ray, on a node", {0, 0, 0}, 0.5f, 0, THIN, 0, 0},
        {"near the ray, on a node", {0, 0, 0}, 0.1f, 0, THIN, 0, 0},
        {"very near the ray, on a node", {0, 0, 0}, 0.02f, 0, THIN, 0, 0},
        {"on a cell's face", {0.03125f, 0, 0.03125f}, 0.02f, 0, THIN, 0, 0},
        {"anywhere", {0.37f, -0.211f, 0.123f}, -0.2f, 0.1f, THIN, 0, 0},
        {"in a tinted medium", {0.1f, 0, 0}, 0.3f, 0.2f, TINTED, 0, 0},
        {"outside", {0, 0, 3}, 0.2f, 0, TINTED, 0, 0},
        {"in the ray's end, outside", {3, 0, 0.5f}, 0, 0, TINTED, 0, 0},
        {"a spot", {0, 0, 0.5f}, 0.1f, -0.5f, TINTED, 1.0f, 0},
        {"a wide spot", {0.2f, 0, 0.25f}, 0, -0.25f, THIN, 2.6f, 0},
        {"a square far from the ray", {0.1f, 0, 0.7f}, 0.1f, -0.3f, TINTED, 0, 0.5f},
        {"a square near the ray", {0.1f, 0, 0.2f}, 0.1f, 0, THIN, 0, 0.5f},
    };
    /* Steps longer than cones near a lamp, or than the way to it, find the same. */
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        expect_airlight(&cases[i], 1.0f);
        expect_airlight(&cases[i], 6.0f);
    }
}

/* Thin fog, and a dense block in it whose face is near a lamp: extinction, all of it scattering. */
static double block_at(const double p[3])
{
    for (int i = 0; i < 3; ++i)
        if (fabs(p[i]) > 1.0)
            return 0.0;
    const int in_block = p[0] > 0.25 && fabs(p[1]) < 0.375 && fabs(p[2]) < 0.375;
    return 0.05 + (in_block ? 4.0 : 0.0);
}

static double block_tau(const double from[3], const double to[3], int steps)
{
    double sum = 0.0, square = 0.0;
    for (int i = 0; i < 3; ++i)
        square += (to[i] - from[i]) * (to[i] - from[i]);
    for (int k = 0; k < steps; ++k) {
        double p[3];
        for (int i = 0; i < 3; ++i)
            p[i] = from[i] + (to[i] - from[i]) * (k + 0.5) / steps;
        sum += block_at(p);
    }
    return sum * sqrt(square) / steps;
}

/* What a step scatters goes with what it lets through, also where the medium begins within it. */
static void airlight_by_a_dense_face(void **state)
{
    (void)state;
    static const struct coefficients thin = {.sigma_s = {0.05f, 0.05f, 0.05f}},
                                     dense = {.sigma_s = {4, 4, 4}};
    static const double lamp[3] = {0.15, 0.0, 0.12}, y = 0.05;
    enum { STEPS = 4000 };
    double expected = 0.0;
    for (int k = 0; k < STEPS; ++k) {
        const double p[3] = {-1.0 + 2.0 * (k + 0.5) / STEPS, y, 0.0}, eye[3] = {-1, y, 0};
        double square = 0.0;
        for (int i = 0; i < 3; ++i)
            square += (lamp[i] - p[i]) * (lamp[i] - p[i]);
        expected += block_at(p) / (4.0 * PI) / (4.0 * PI * square) *
                    exp(-block_tau(p, lamp, 200) - block_tau(eye, p, 400)) * 2.0 / STEPS;
    }
    for (float step = 1.0f; step < 5.0f; step += 2.0f) {
        brume_settings wanted = settings;
        wanted.step = step;
        brume_scene *scene;
        assert_ok(brume_scene_create(device, &scene));
        add_fog_cube(scene, 1, origin, 1.0f, &thin);
        add_fog_cube(scene, 2, (float[3]){0.625f, 0, 0}, 0.375f, &dense);
        const brume_light light =
            point_lamp((float[3]){(float)lamp[0], (float)lamp[1], (float)lamp[2]}, 1.0f);
        assert_ok(brume_scene_set_light(scene, 1, &light));
        double mean[3], most[3];
        look_along(scene, &wanted, (float)y, 0, mean, most);
        brume_scene_destroy(scene);
        print_message("by a dense face, step %g: %+.1f %%, the brightest pixel %+.1f %%\n",
                      (double)step, 100.0 * (mean[0] / expected - 1.0),
                      100.0 * (most[0] / expected - 1.0));
        assert_close(mean[0], expected, 0.06);
    }
}

/* The factors by kind of receiver, as Blender's light settings have them. */
static void volume_factor(void **state)
{
    (void)state;
    static const struct coefficients medium = THIN;
    double values[3];
    for (int i = 0; i < 3; ++i) {
        brume_scene *scene;
        brume_light lamp = point_lamp((float[3]){0, 0, 2}, 1.0f);
        lamp.volume_factor = 0.5f * (float)i;
        lamp.diffuse_factor = lamp.specular_factor = 0.0f;
        assert_ok(brume_scene_create(device, &scene));
        add_fog_cube(scene, 1, origin, 1.0f, &medium);
        assert_ok(brume_scene_set_light(scene, 1, &lamp));
        const brume_view view = orthographic_view(origin, (float[3]){1, 0, 0}, 0.1f, 3.0f, 4);
        brume_job *job = render(scene, &settings, &view);
        float *pixels = read_pass(job, &view, BRUME_PASS_COMBINED);
        values[i] = middle(pixels, &view, 4, 0);
        free(pixels);
        brume_job_release(job);
        brume_scene_destroy(scene);
    }
    assert_true(values[0] == 0.0 && values[2] > 0.0);
    assert_close(values[1], 0.5 * values[2], 1e-5);
}

/* Light that starts within a solid does not leave it, and nothing else does either. */
static void lamp_in_a_solid(void **state)
{
    (void)state;
    const struct coefficients fog = {.sigma_s = {1, 1, 1}};
    const brume_light lamp = point_lamp(origin, 100.0f);
    brume_view view = orthographic_view(origin, (float[3]){0.2f, 0.3f, -1}, 2.0f, 5.0f, 32);
    double bright[2];
    for (int with_solid = 0; with_solid < 2; ++with_solid) {
        brume_scene *scene;
        assert_ok(brume_scene_create(device, &scene));
        add_fog_cube(scene, 1, origin, 1.0f, &fog);
        assert_ok(brume_scene_set_light(scene, 1, &lamp));
        if (with_solid)
            add_cube(scene, 1, origin, 0.3f, BRUME_VISIBLE_CAMERA | BRUME_VISIBLE_SHADOW);
        brume_job *job = render(scene, NULL, &view);
        float *pixels = read_pass(job, &view, BRUME_PASS_COMBINED);
        bright[with_solid] = 0.0;
        for (int i = 0; i < 32 * 32; ++i) {
            assert_true(isfinite(pixels[4 * i]) && pixels[4 * i] >= 0.0f);
            bright[with_solid] += pixels[4 * i];
        }
        free(pixels);
        brume_job_release(job);
        brume_scene_destroy(scene);
    }
    assert_true(bright[0] > 100.0);
    /* What a texel of a shadow map leaves of the fog that touches the solid. */
    assert_true(bright[1] < 0.001 * bright[0]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lamp_in_a_solid), cmocka_unit_test(sun_on_plate),
        cmocka_unit_test(point_on_plate),  cmocka_unit_test(spot_on_plate),
        cmocka_unit_test(area_on_plate),   cmocka_unit_test(world_on_plate),
        cmocka_unit_test(shut_in),         cmocka_unit_test(airlight_of_lamps),
        cmocka_unit_test(airlight_by_a_dense_face), cmocka_unit_test(volume_factor),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
