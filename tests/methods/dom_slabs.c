/* SPDX-License-Identifier: GPL-3.0-or-later */
/* DOM's slabs: what they reflect and pass of a beam and of diffuse light, against exact numbers.
 * BRUME_ALL_ROWS=1 goes through the whole table, and finer lattices. */
#include "dom.h"

#define ALBEDOS 4
static const double albedos[ALBEDOS] = {0.5, 0.9, 0.99, 1.0};

enum light { BEAM, DIFFUSE, LIGHTS };

/* Parts of the light that falls onto a slab without end. */
struct slab {
    double g, tau;
    double reflected[LIGHTS][ALBEDOS], passed[LIGHTS][ALBEDOS];
};

/* By adding and doubling, which gives van de Hulst's numbers (Multiple Light Scattering, 1980; for
 * a beam, g 0.75, tau 2, albedo 0.9: Table 35) to 3e-6. */
static const struct slab slabs[] = {
    {0.0,
     0.5,
     {{0.07295, 0.16904, 0.19892, 0.20251}, {0.10768, 0.24749, 0.29066, 0.29583}},
     {{0.67423, 0.76538, 0.79405, 0.79749}, {0.53499, 0.65992, 0.69942, 0.70417}}},
    {0.0,
     1.0,
     {{0.09912, 0.26741, 0.33292, 0.34133}, {0.13417, 0.35271, 0.43596, 0.44659}},
     {{0.44606, 0.59163, 0.65098, 0.65867}, {0.30671, 0.47475, 0.54435, 0.55341}}},
    {0.0,
     2.0,
     {{0.11283, 0.36165, 0.49749, 0.51751}, {0.14509, 0.43715, 0.58800, 0.60994}},
     {{0.18932, 0.35650, 0.46570, 0.48249}, {0.10706, 0.26558, 0.37335, 0.39006}}},
    {0.0,
     4.0,
     {{0.11517, 0.40814, 0.64505, 0.69093}, {0.14652, 0.47319, 0.70973, 0.75403}},
     {{0.03199, 0.12852, 0.27548, 0.30907}, {0.01423, 0.09056, 0.21663, 0.24597}}},
    {0.0,
     8.0,
     {{0.11523, 0.41484, 0.72875, 0.82180}, {0.14654, 0.47795, 0.77577, 0.85847}},
     {{0.00082, 0.01602, 0.12207, 0.17820}, {0.00028, 0.01103, 0.09568, 0.14153}}},
    {0.0,
     16.0,
     {{0.11523, 0.41495, 0.75126, 0.90363}, {0.14654, 0.47802, 0.79342, 0.92346}},
     {{0.00000, 0.00024, 0.02960, 0.09637}, {0.00000, 0.00016, 0.02320, 0.07654}}},
    {0.75,
     0.5,
     {{0.01044, 0.02940, 0.03646, 0.03734}, {0.03205, 0.09058, 0.11245, 0.11519}},
     {{0.75701, 0.91537, 0.95775, 0.96266}, {0.61194, 0.81707, 0.87763, 0.88481}}},
    {0.75,
     1.0,
     {{0.01511, 0.05595, 0.07603, 0.07874}, {0.03955, 0.13836, 0.18561, 0.19197}},
     {{0.56461, 0.82792, 0.91118, 0.92126}, {0.39677, 0.68855, 0.79469, 0.80803}}},
    {0.75,
     2.0,
     {{0.01845, 0.09739, 0.15440, 0.16318}, {0.04323, 0.19109, 0.28918, 0.30404}},
     {{0.30533, 0.66096, 0.81604, 0.83682}, {0.17668, 0.50182, 0.67199, 0.69596}}},
    {0.75,
     4.0,
     {{0.01946, 0.14157, 0.28432, 0.31164}, {0.04398, 0.23161, 0.41598, 0.45006}},
     {{0.08329, 0.39732, 0.64651, 0.68836}, {0.03837, 0.27618, 0.50863, 0.54994}}},
    {0.75,
     8.0,
     {{0.01953, 0.16297, 0.43305, 0.50642}, {0.04401, 0.24727, 0.53715, 0.61089}},
     {{0.00539, 0.13061, 0.41634, 0.49358}, {0.00203, 0.08652, 0.32202, 0.38911}}},
    {0.75,
     16.0,
     {{0.01953, 0.16549, 0.53001, 0.68805}, {0.04401, 0.24895, 0.61230, 0.75430}},
     {{0.00002, 0.01313, 0.19301, 0.31195}, {0.00001, 0.00862, 0.14906, 0.24570}}},
};

/* How a slab 1 m thick is cut into cells. */
struct cut {
    double wide; /* m */
    int across;  /* cells of its thickness */
    int ordinates;
};

/* Between white walls on four sides, which lose nothing, a piece is as a slab without end, as long
 * as it is not thick: matt walls turn back light that went on downwards, and iterations go on for
 * long. One six times as wide as deep needs none: what leaves by its sides its middle does not
 * miss. In the lattice walls reach half a cell beyond their rims, and keep there what leaves a
 * slab: so much that the middle of a piece twice as wide as deep is 1 % brighter than by Monte
 * Carlo. */
static bool wants_walls(double tau)
{
    return tau <= 8.0;
}

static brume_scene *piece_of(const struct slab *slab, double wide, const double three[3],
                             enum light light)
{
    static const uint32_t sides[24] = {0, 1, 5, 0, 5, 4, 2, 3, 7, 2, 7, 6,
                                       0, 2, 6, 0, 6, 4, 1, 3, 7, 1, 7, 5};
    struct coefficients c = {.g = (float)slab->g};
    for (int i = 0; i < 3; ++i) {
        c.sigma_s[i] = (float)(slab->tau * three[i]);
        c.sigma_a[i] = (float)(slab->tau * (1.0 - three[i]));
    }
    brume_scene *scene = empty();
    struct fog_cube cube;
    fog_cube_init(&cube, origin, 0.5f, &c);
    for (int k = 0; k < 8; ++k) {
        cube.positions[3 * k] *= (float)wide;
        cube.positions[3 * k + 1] *= (float)wide;
    }
    assert_ok(brume_scene_set_volume(scene, 1, &cube.volume));
    if (wants_walls(slab->tau))
        add_matt(scene, 2, "walls", 1.0f, identity, cube.positions, 8, sides, 8);
    if (light == BEAM) {
        add_sun(scene, 3, down);
        return scene;
    }
    enum { HIGH = 64 };
    float pixels[HIGH * 4] = {0}; /* a column: white above the horizon */
    for (int i = 2 * HIGH; i < 4 * HIGH; ++i)
        pixels[i] = 1.0f;
    const brume_image image = {
        .name = "above", .pixels = pixels, .width = 1, .height = HIGH, .nearest = 1};
    const brume_world world = {.color = {(float)(1 / PI), (float)(1 / PI), (float)(1 / PI)},
                               .image = 4};
    assert_ok(brume_scene_set_image(scene, 4, &image));
    assert_ok(brume_scene_set_world(scene, &world));
    return scene;
}

/* What passes without meeting anything. The world is seen through the scaled depth: what is
 * scattered nearly straight on still comes from it. */
static double straight_on(const struct slab *slab, double albedo, enum light light)
{
    if (light == BEAM)
        return exp(-slab->tau);
    const double depth = slab->tau * (1.0 - albedo * pow(slab->g, 4.0));
    double sum = 0.0; /* 2 E3 */
    for (int i = 0; i < 1000; ++i) {
        const double cosine = (i + 0.5) / 1000.0;
        sum += 2e-3 * cosine * exp(-depth / cosine);
    }
    return sum;
}

/* Prints and returns how far off what a slab of these three albedos reflects and passes is. */
static double off(const struct slab *slab, const struct cut *cut, const int which[3],
                  enum light light)
{
    static const float top[3] = {0.11f, 0.07f, 0.5f}, bottom[3] = {0.11f, 0.07f, -0.5f};
    const double longest = fmax(cut->wide, 1.0);
    const double three[3] = {albedos[which[0]], albedos[which[1]], albedos[which[2]]};
    brume_settings settings = settings_for((int)(longest * cut->across));
    settings.ordinates = cut->ordinates;
    settings.medium_resolution = settings.lattice_resolution = (int)(longest * 32.0);
    brume_scene *scene = piece_of(slab, cut->wide, three, light);
    double r[3], t[3], most = 0.0;
    leaves(scene, &settings, top, 2, 1.0f, 2, r);
    leaves(scene, &settings, bottom, 2, -1.0f, 2, t);
    for (int i = 0; i < 3; ++i) {
        if (i > 0 && which[i] == which[i - 1])
            continue;
        r[i] -= slab->reflected[light][which[i]];
        t[i] += straight_on(slab, three[i], light) - slab->passed[light][which[i]];
        print_message("%s, %d cells, %d ordinates, g %.2f tau %g albedo %g: R %+.4f T %+.4f\n",
                      light == BEAM ? "beam" : "diffuse", cut->across, cut->ordinates, slab->g,
                      slab->tau, three[i], r[i], t[i]);
        most = fmax(most, fmax(fabs(r[i]), fabs(t[i])));
    }
    brume_scene_destroy(scene);
    return most;
}

static const struct slab *slab_of(double g, double tau)
{
    for (size_t i = 0; i < sizeof slabs / sizeof *slabs; ++i)
        if (slabs[i].g == g && slabs[i].tau == tau)
            return &slabs[i];
    fail_msg("no slab of g %g and tau %g", g, tau);
    return NULL;
}

/* Thin ones wider, or looks that go flat through them end at the walls; and others as wide that it
 * hardly counts that walls are matt: in the middle of a piece three times as wide as deep, of depth
 * 4, g 0.75 and without absorption, they make R and T 1.4 and 1 % more than those of a slab without
 * end (Monte Carlo). */
static struct cut usual_cut(double tau)
{
    return tau <= 1.0 ? (struct cut){8.0, 8, 48} : (struct cut){6.0, 16, 48};
}

static void some_slabs(void **state)
{
    (void)state;
    static const struct {
        double g, tau;
        enum light light;
    } rows[] = {{0.0, 4.0, BEAM}, {0.75, 8.0, BEAM}, {0.75, 4.0, DIFFUSE}};
    static const int which[3] = {1, 2, 3};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; ++i) {
        const struct cut cut = usual_cut(rows[i].tau);
        assert_true(off(slab_of(rows[i].g, rows[i].tau), &cut, which, rows[i].light) < 0.015);
    }
}

static void all_slabs(void **state)
{
    (void)state;
    static const int first[3] = {0, 1, 2}, last[3] = {3, 3, 3};
    double most[LIGHTS] = {0};
    for (int light = 0; light < LIGHTS; ++light)
        for (size_t i = 0; i < sizeof slabs / sizeof *slabs; ++i) {
            const struct cut cut = usual_cut(slabs[i].tau);
            most[light] = fmax(most[light], off(&slabs[i], &cut, first, (enum light)light));
            most[light] = fmax(most[light], off(&slabs[i], &cut, last, (enum light)light));
        }
    print_message("beam %.4f diffuse %.4f at most\n", most[BEAM], most[DIFFUSE]);
    assert_true(most[BEAM] < 0.015);
    assert_true(most[DIFFUSE] < 0.015);
}

static void finer_slabs(void **state)
{
    (void)state;
    static const int which[3] = {1, 2, 3};
    static const double rows[][2] = {{0.0, 4.0}, {0.75, 4.0}, {0.75, 8.0}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; ++i) {
        const struct cut cut = {4.0, 24, 96};
        assert_true(off(slab_of(rows[i][0], rows[i][1]), &cut, which, BEAM) < 0.01);
    }
}

/* --- Around a beam -------------------------------------------------------------------------- */

#define RINGS 4
static const double rings[RINGS + 1] = {0.0, 0.15, 0.3, 0.6, 1.0}; /* from the beam, radians */

/* What a beam's light that a slab without end has scattered leaves it by, of 1: Monte Carlo. */
static void trace_rings(double g, double tau, double powers[RINGS])
{
    enum { PHOTONS = 1000000 };
    uint64_t state = 88172645463325252u;
    memset(powers, 0, RINGS * sizeof *powers);
    for (int i = 0; i < PHOTONS; ++i) {
        double depth = 0.0, d[3] = {0, 0, 1};
        for (int hits = 0; depth >= 0.0; ++hits) {
            depth -= log(lot(&state)) / tau * d[2];
            if (depth > 1.0) {
                const double tilt = acos(fmin(d[2], 1.0));
                for (int k = 0; k < RINGS && hits; ++k)
                    powers[k] += tilt >= rings[k] && tilt < rings[k + 1] ? 1.0 / PHOTONS : 0.0;
                break;
            }
            scatter(d, g, &state);
        }
    }
}

/* What a forward peak scatters once and again stays close around the beam, less and less. */
static void around_a_beam(void **state)
{
    (void)state;
    static const double one[3] = {1, 1, 1};
    static const float bottom[3] = {0.11f, 0.07f, -0.5f};
    static const struct slab cases[] = {{.g = 0.9, .tau = 4.0}, {.g = 0.8, .tau = 4.0}};
    const struct cut cut = {4.0, 16, 48};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        brume_settings settings = settings_for((int)(cut.wide * cut.across));
        settings.medium_resolution = settings.lattice_resolution = (int)(cut.wide * 32.0);
        brume_scene *scene = piece_of(&cases[i], cut.wide, one, BEAM);
        double truth[RINGS];
        trace_rings(cases[i].g, cases[i].tau, truth);
        print_message("beam, g %.1f tau %g, from it:", cases[i].g, cases[i].tau);
        for (int k = 0; k < RINGS; ++k) {
            double power[3] = {0.0};
            for (int n = 0; n < ANGLES; ++n) {
                const double wide = rings[k + 1] - rings[k], tilt = rings[k] + wide * gauss[n][0];
                const float out[3] = {(float)sin(tilt), 0.0f, (float)-cos(tilt)};
                add_sent(scene, &settings, bottom, out,
                         2.0 * PI * wide * gauss[n][1] * sin(tilt) * cos(tilt), power);
            }
            print_message(" %.2f to %.2f %+.1f %%", rings[k], rings[k + 1],
                          100.0 * (power[0] / truth[k] - 1.0));
            assert_close(power[0], truth[k], 0.05);
        }
        print_message("\n");
        brume_scene_destroy(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(some_slabs),
        cmocka_unit_test(around_a_beam),
    };
    const struct CMUnitTest long_tests[] = {
        cmocka_unit_test(all_slabs),
        cmocka_unit_test(finer_slabs),
    };
    return at_length() ? cmocka_run_group_tests(long_tests, open_device, close_device)
                       : cmocka_run_group_tests(tests, open_device, close_device);
}
