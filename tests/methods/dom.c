/* SPDX-License-Identifier: GPL-3.0-or-later */
/* DOM against exact numbers: its quadratures, a cube that a beam lights, a thick medium, rooms,
 * furnaces; and that nothing becomes negative or infinite whatever the scene is. */
#include "dom.h"

#include "transport/dom.h"

/* --- Quadratures ---------------------------------------------------------------------------- */

/* The mean of x^a y^b z^c over the sphere. */
static double mean_of(int a, int b, int c)
{
    if (a % 2 || b % 2 || c % 2)
        return 0.0;
    return tgamma(0.5 * a + 0.5) * tgamma(0.5 * b + 0.5) * tgamma(0.5 * c + 0.5) /
           (tgamma(0.5 * (a + b + c) + 1.5) * 2.0 * PI);
}

static double dot(const float a[3], const float b[3])
{
    return (double)a[0] * (double)b[0] + (double)a[1] * (double)b[1] + (double)a[2] * (double)b[2];
}

/* Polynomials, the flux through faces across an axis and through slanted ones; and no two ordinates
 * are closer than so many degrees. */
static void quadratures(void **state)
{
    (void)state;
    static const float across[3][3] = {
        {1, 0, 0}, {0.70710678f, 0.70710678f, 0}, {0.57735027f, 0.57735027f, 0.57735027f}};
    static const struct {
        int count, degree;
        double half[3]; /* how far off the flux may be */
        double apart;
    } cases[] = {{26, 7, {0.1, 0.1, 0.1}, 35.0},
                 {48, 9, {1e-6, 0.01, 0.02}, 29.0},
                 {96, 11, {1e-6, 1e-6, 1e-6}, 15.0}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        const int count = cases[i].count;
        vec4 list[MOST_ORDINATES];
        int axes[3];
        dom_quadrature(count, list, axes);
        assert_int_equal(axes[0] + axes[1] + axes[2], count);
        double half[3] = {0.0}, nearest = -1.0;
        for (int k = 0; k < count; ++k) {
            const float v[3] = {list[k].x, list[k].y, list[k].z};
            assert_true(list[k].w > 0.0f);
            for (int face = 0; face < 3; ++face)
                half[face] += (double)list[k].w / (4.0 * PI) * fabs(dot(v, across[face]));
            for (int m = 0; m < k; ++m) {
                const float other[3] = {list[m].x, list[m].y, list[m].z};
                nearest = fmax(nearest, dot(v, other));
            }
        }
        print_message("%d ordinates: %.1f degrees apart, flux off by %+.4f %+.4f %+.4f\n", count,
                      acos(nearest) * 180.0 / PI, half[0] - 0.5, half[1] - 0.5, half[2] - 0.5);
        assert_true(acos(nearest) * 180.0 / PI > cases[i].apart);
        for (int face = 0; face < 3; ++face)
            assert_close(half[face], 0.5, cases[i].half[face]);
        for (int a = 0; a <= cases[i].degree; ++a)
            for (int b = 0; a + b <= cases[i].degree; ++b)
                for (int c = 0; a + b + c <= cases[i].degree; ++c) {
                    double mean = 0.0;
                    for (int k = 0; k < count; ++k)
                        mean += (double)list[k].w / (4.0 * PI) * pow((double)list[k].x, a) *
                                pow((double)list[k].y, b) * pow((double)list[k].z, c);
                    assert_true(fabs(mean - mean_of(a, b, c)) < 1e-6);
                }
    }
}

/* --- A cube that a beam lights -------------------------------------------------------------- */

#define PHOTONS 400000
#define BEAM_PHOTONS (10 * PHOTONS) /* half a percent of noise in the last cell */
#define AXIS_CELLS 16

/* What a beam that falls onto the cube's upper side does: Monte Carlo. */
struct beam {
    double fluences[AXIS_CELLS]; /* in the middle of the cube, from above, by the irradiance */
    double above, below, aside;  /* shares that leave by each side; all but straight on */
};

/* Adds to each cell of the column in the middle how much of a straight way is in it. */
static void add_way(const double p[3], const double d[3], double way, double lengths[AXIS_CELLS])
{
    const double half = 1.0 / AXIS_CELLS;
    double begin = 0.0, end = way;
    for (int axis = 0; axis < 2; ++axis) {
        const double to = -p[axis] / d[axis], reach = half / fabs(d[axis]);
        begin = fmax(begin, to - reach);
        end = fmin(end, to + reach);
    }
    if (begin >= end)
        return;
    const double from = (0.5 - p[2] - begin * d[2]) * AXIS_CELLS;
    const double till = (0.5 - p[2] - end * d[2]) * AXIS_CELLS;
    const double low = fmin(from, till), high = fmax(from, till);
    const int first = (int)low;
    for (int k = first; k < AXIS_CELLS && k < high; ++k)
        lengths[k] +=
            (end - begin) * (fmin(high, k + 1.0) - fmax(low, k)) / fmax(high - low, 1e-12);
}

/* sigma_s of a cube of 1 m that absorbs nothing. */
static struct beam trace(double sigma_s, double g)
{
    struct beam beam = {{0}, 0, 0, 0};
    uint64_t state = 88172645463325252u;
    for (int i = 0; i < BEAM_PHOTONS; ++i) {
        double p[3] = {lot(&state) - 0.5, lot(&state) - 0.5, 0.5}, d[3] = {0, 0, -1};
        for (int hits = 0;; ++hits) {
            const double way = -log(lot(&state)) / sigma_s;
            double end;
            const int side = wall_ahead(p, d, 0.5, &end);
            if (hits > 0) /* what comes straight is known, and without noise */
                add_way(p, d, fmin(way, end), beam.fluences);
            if (way >= end) {
                *(side != 2  ? &beam.aside
                  : d[2] > 0 ? &beam.above
                             : &beam.below) += hits ? 1.0 / BEAM_PHOTONS : 0.0;
                break;
            }
            for (int axis = 0; axis < 3; ++axis)
                p[axis] += way * d[axis];
            scatter(d, g, &state);
        }
    }
    const double volume = 4.0 / (AXIS_CELLS * AXIS_CELLS * AXIS_CELLS), step = sigma_s / AXIS_CELLS;
    for (int k = 0; k < AXIS_CELLS; ++k)
        beam.fluences[k] =
            beam.fluences[k] / (BEAM_PHOTONS * volume) + exp(-step * k) * (1.0 - exp(-step)) / step;
    return beam;
}

/* The share of the side of a cube of 1 m that an eye's ray meets first: whose plane it crosses last
 * of those that face it. p: on the ray. */
static double *side_met(struct beam *beam, const double p[3], const float along[3])
{
    double last = -INFINITY;
    int side = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double step = (double)along[axis];
        const double to = step != 0.0 ? ((step > 0.0 ? -0.5 : 0.5) - p[axis]) / step : -INFINITY;
        if (to > last) {
            last = to;
            side = axis;
        }
    }
    return side != 2 ? &beam->aside : along[2] < 0.0f ? &beam->above : &beam->below;
}

/* The shares that leave a cube of 1 m by each side, but for what goes straight on: by how bright it
 * is to eyes far away, in directions by their angles to the beam, near which are most of those that
 * forward scattering needs; in a quarter of all, for the others are the same. */
static struct beam exits(brume_scene *scene, const brume_settings *settings)
{
    static const double ends[] = {0.0, 0.2, 0.5 * PI, PI};
    static const float size = 1.75f;
    const int pixels = 64;
    struct beam beam = {{0}, 0, 0, 0};
    for (int n = 0; n < 3 * ANGLES * ANGLES; ++n) {
        const int piece = n / (ANGLES * ANGLES), i = n / ANGLES % ANGLES, k = n % ANGLES;
        const double width = ends[piece + 1] - ends[piece];
        const double tilt = ends[piece] + width * gauss[i][0], turn = 0.5 * PI * gauss[k][0];
        const double solid = width * gauss[i][1] * 2.0 * PI * gauss[k][1] * sin(tilt);
        const float along[3] = {-(float)(sin(tilt) * cos(turn)), -(float)(sin(tilt) * sin(turn)),
                                (float)cos(tilt)};
        brume_view view = orthographic_view(origin, along, size, 5.0f, pixels);
        view.samples = 1;
        view.passes = 1u << BRUME_PASS_VOLUME_DIRECT | 1u << BRUME_PASS_VOLUME_INDIRECT;
        brume_job *job = render(scene, settings, &view);
        float *direct = read_pass(job, &view, BRUME_PASS_VOLUME_DIRECT);
        float *indirect = read_pass(job, &view, BRUME_PASS_VOLUME_INDIRECT);
        float world_from_view[16];
        placed(origin, along, world_from_view);
        for (int at = 0; at < pixels * pixels; ++at) {
            const double x = (double)size * ((at % pixels + 0.5) / pixels - 0.5);
            const double y = (double)size * ((at / pixels + 0.5) / pixels - 0.5);
            double p[3];
            for (int axis = 0; axis < 3; ++axis)
                p[axis] = x * (double)world_from_view[axis] + y * (double)world_from_view[4 + axis];
            *side_met(&beam, p, along) += solid * pow((double)size / pixels, 2.0) *
                                          ((double)direct[3 * at] + (double)indirect[3 * at]);
        }
        free(direct);
        free(indirect);
        brume_job_release(job);
    }
    return beam;
}

/* How far the lattice is off. */
struct cube_errors {
    double fluence, worst; /* sum of absolute differences over sum; in the worst cell */
    double out[3];         /* what leaves above, below and by the four sides, less what should */
};

/* Prints them. */
static struct cube_errors compare(float g, const brume_settings *settings, const struct beam *truth)
{
    const struct coefficients c = {.sigma_s = {4, 4, 4}, .g = g};
    brume_scene *scene = empty();
    add_fog_cube(scene, 1, origin, 0.5f, &c);
    add_sun(scene, 2, down);
    brume_stats stats;
    struct field field = field_of(scene, settings, &stats);
    print_message("cube, %d cells, %d ordinates, g %.1f, %u iterations: fluence",
                  settings->field_resolution, settings->ordinates, (double)g, stats.iterations);
    const double scaled = 4.0 * (1.0 - pow((double)g, 4.0));
    struct cube_errors errors = {0};
    double all = 0.0;
    for (int k = 0; k < AXIS_CELLS; ++k) {
        const double depth = (k + 0.5) / AXIS_CELLS;
        const float p[3] = {0, 0, (float)(0.5 - depth)};
        const double found = fluence_at(&field, p, 0) + exp(-scaled * depth);
        print_message(" %+.3f", found / truth->fluences[k] - 1.0);
        errors.fluence += fabs(found - truth->fluences[k]);
        errors.worst = fmax(errors.worst, fabs(found / truth->fluences[k] - 1.0));
        all += truth->fluences[k];
    }
    errors.fluence /= all;
    print_message(" (%.2f %%)", 100.0 * errors.fluence);
    const struct beam found = exits(scene, settings);
    double *out = errors.out;
    out[0] = found.above - truth->above;
    out[1] = found.below - truth->below;
    out[2] = found.aside - truth->aside;
    print_message("; above %+.4f below %+.4f aside %+.4f\n", out[0], out[1], out[2]);
    free(field.texels);
    brume_scene_destroy(scene);
    return errors;
}

/* No cell's fluence may be off by more than `worst`, nor all together by more than `fluence`. */
static void cubes(const brume_settings *settings, double worst, double fluence)
{
    static const float gs[] = {0.0f, 0.5f, 0.7f, 0.9f};
    for (size_t i = 0; i < sizeof gs / sizeof *gs; ++i) {
        const struct beam truth = trace(4.0, (double)gs[i]);
        const struct cube_errors off = compare(gs[i], settings, &truth);
        assert_true(off.worst < worst);
        assert_true(off.fluence < fluence);
        assert_true(fabs(off.out[0]) < 0.01);
        assert_true(fabs(off.out[1]) < 0.01);
        assert_true(fabs(off.out[2]) < 0.02); /* four sides */
    }
}

static void cube(void **state)
{
    (void)state;
    const brume_settings settings = settings_for(32);
    cubes(&settings, 0.04, 0.02);
}

/* With fine cells and directions. */
static void fine_cube(void **state)
{
    (void)state;
    brume_settings settings = settings_for(64);
    settings.ordinates = 96;
    settings.medium_resolution = settings.lattice_resolution = 64;
    cubes(&settings, 0.03, 0.01);
}

/* --- Furnaces ------------------------------------------------------------------------------- */

/* In an even world a medium that absorbs nothing cannot be seen; nor one that emits what it
 * absorbs. */
static void furnaces(void **state)
{
    (void)state;
    static const struct {
        float sigma_s, sigma_a, g;
    } cases[] = {{0.5f, 0, 0}, {2, 0, 0},    {8, 0, 0}, {2, 0, 0.6f},
                 {8, 0, 0.9f}, {2, 1, 0.3f}, {0, 3, 0}, {2, 0, -0.6f}};
    const brume_world world = {.color = {1, 1, 1}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        const float s = cases[i].sigma_s, a = cases[i].sigma_a;
        const struct coefficients fog = {
            .sigma_s = {s, s, s}, .sigma_a = {a, a, a}, .emission = {a, a, a}, .g = cases[i].g};
        brume_settings settings = settings_for(32);
        settings.medium_resolution = 64;
        brume_view view = orthographic_view(origin, (float[3]){0.3f, -1, 0.2f}, 0.8f, 5.0f, 16);
        view.samples = 16;
        brume_scene *scene = empty();
        add_fog_cube(scene, 1, origin, 0.5f, &fog);
        assert_ok(brume_scene_set_world(scene, &world));
        brume_job *job = render(scene, &settings, &view);
        float *pixels = read_pass(job, &view, BRUME_PASS_COMBINED);
        double mean = 0.0, least = 1e9, most = 0.0;
        for (int p = 0; p < 256; ++p) {
            mean += (double)pixels[4 * p] / 256.0;
            least = fmin(least, (double)pixels[4 * p]);
            most = fmax(most, (double)pixels[4 * p]);
        }
        print_message("furnace, sigma_s %g, sigma_a %g, g %g: %.4f (%.4f to %.4f)\n", (double)s,
                      (double)a, (double)fog.g, mean, least, most);
        assert_close(mean, 1.0, 0.005);
        free(pixels);
        brume_job_release(job);
        brume_scene_destroy(scene);
    }
}

/* --- Iterations ----------------------------------------------------------------------------- */

/* Media and rooms that nearly no light leaves: it ends after few iterations, where many more would
 * not go elsewhere. */
static void few_iterations(void **state)
{
    (void)state;
    static const struct {
        float sigma_s, g, reflectance; /* of a room around, 0: none */
    } cases[] = {{24, 0, 0}, {80, 0, 0}, {80, 0.8f, 0}, {4, 0.7f, 0.8f}, {0.5f, 0, 0.8f}};
    static const float corner[3] = {0.8f, 0.3f, 0.7f};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        const float s = cases[i].sigma_s;
        const struct coefficients fog = {.sigma_s = {s, 0.5f * s, 0.25f * s}, .g = cases[i].g};
        brume_settings settings = settings_for(16);
        brume_stats stats;
        brume_scene *scene = empty();
        add_fog_cube(scene, 1, origin, 0.5f, &fog);
        if (cases[i].reflectance > 0.0f) {
            add_box(scene, 2, 1.0f, cases[i].reflectance);
            add_lamp(scene, 3, corner, 10.0f);
        } else {
            add_sun(scene, 3, down);
        }
        struct field early = field_of(scene, &settings, &stats);
        settings.iterations = 20;
        struct field late = field_of(scene, &settings, NULL);
        const double off = fields_apart(&early, &late, 1);
        print_message("sigma_s %g g %g, walls %.1f: %u iterations, change %.5f, %.3f %% off\n",
                      (double)s, (double)cases[i].g, (double)cases[i].reflectance, stats.iterations,
                      stats.change, 100.0 * off);
        assert_true(stats.iterations <= 15);
        assert_true(off < 0.005);
        free(early.texels);
        free(late.texels);
        brume_scene_destroy(scene);
    }
}

/* --- Rooms ---------------------------------------------------------------------------------- */

/* The mean fluence in the room [-1, 1]^3 of what its matt walls reflect of a lamp's 1 W: Monte
 * Carlo. */
static double between_walls(const float lamp[3], double reflectance)
{
    uint64_t state = 88172645463325252u;
    double sum = 0.0;
    for (int i = 0; i < PHOTONS / 4; ++i) {
        double p[3] = {lamp[0], lamp[1], lamp[2]}, d[3] = {0, 0, 1}, way;
        scatter(d, 0.0, &state);
        for (double weight = 1.0; weight > 1e-4; weight *= reflectance) {
            const int axis = wall_ahead(p, d, 1.0, &way);
            sum += weight < 1.0 ? weight * way : 0.0;
            for (int k = 0; k < 3; ++k)
                p[k] = fmax(fmin(p[k] + way * d[k], 1.0), -1.0);
            const double sine = sqrt(lot(&state)), turn = 2.0 * PI * lot(&state);
            const double inwards = p[axis] > 0.0 ? -1.0 : 1.0;
            d[axis] = inwards * sqrt(1.0 - sine * sine);
            d[(axis + 1) % 3] = sine * cos(turn);
            d[(axis + 2) % 3] = sine * sin(turn);
        }
    }
    return sum / (PHOTONS / 4) / 8.0;
}

/* A lamp in a closed room without a medium. */
static void light_between_walls(void **state)
{
    (void)state;
    static const float reflectances[] = {0.2f, 0.6f, 0.8f}; /* whole 255ths, as cells hold them */
    const brume_settings settings = settings_for(16);
    for (size_t i = 0; i < sizeof reflectances / sizeof *reflectances; ++i) {
        static const float lamp[3] = {0.2f, -0.1f, 0.3f};
        const double rho = (double)reflectances[i];
        brume_scene *scene = empty();
        add_box(scene, 1, 1.0f, reflectances[i]);
        add_lamp(scene, 2, lamp, 1.0f);
        brume_stats stats;
        struct field field = field_of(scene, &settings, &stats);
        const double mean = mean_fluence(&field, 0);
        const double truth = between_walls(lamp, rho);
        print_message("walls of %.1f, %u iterations: mean fluence %+.2f %%\n", rho,
                      stats.iterations, 100.0 * (mean / truth - 1.0));
        assert_close(mean, truth, 0.03);
        free(field.texels);
        brume_scene_destroy(scene);
    }
}

/* Cells know what walls reflect on their side: not what touches these from behind, as the ground
 * does below a floor's tiles. */
static void behind_walls(void **state)
{
    (void)state;
    static const float lamp[3] = {0.2f, -0.1f, 0.3f};
    const brume_settings settings = settings_for(16);
    double means[2];
    for (int i = 0; i < 2; ++i) {
        brume_scene *scene = empty();
        add_box(scene, 1, 1.0f, 0.8f);
        if (i)
            add_box(scene, 3, 1.001f, 0.0f);
        add_lamp(scene, 2, lamp, 1.0f);
        brume_stats stats;
        struct field field = field_of(scene, &settings, &stats);
        means[i] = mean_fluence(&field, 0);
        free(field.texels);
        brume_scene_destroy(scene);
    }
    print_message("black walls behind: mean fluence %+.2f %%\n",
                  100.0 * (means[1] / means[0] - 1.0));
    assert_close(means[1], means[0], 0.01);
}

/* In a closed white box all of a lamp's power ends in the fog, however little that absorbs: the
 * light crosses the box hundreds of times. */
static void white_room(void **state)
{
    (void)state;
    static const struct {
        float sigma_s, sigma_a;
    } cases[] = {{0.45f, 0.05f}, {1.98f, 0.02f}, {7.92f, 0.08f}};
    static const double lamp[3] = {0.31, 0.17, -0.23};
    const brume_settings settings = settings_for(16);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        const float s = cases[i].sigma_s, a = cases[i].sigma_a;
        const struct coefficients fog = {.sigma_s = {s, s, s}, .sigma_a = {a, a, a}};
        const double sigma_t = (double)s + (double)a;
        brume_scene *scene = empty();
        brume_stats stats;
        add_box(scene, 1, 1.0f, 1.0f);
        add_fog_cube(scene, 2, origin, 1.0f, &fog);
        add_lamp(scene, 3, (float[3]){(float)lamp[0], (float)lamp[1], (float)lamp[2]}, 1.0f);
        struct field field = field_of(scene, &settings, &stats);
        double fluences = 8.0 * mean_fluence(&field, 0); /* over the volume */
        uint64_t lots = 88172645463325252u;
        for (int k = 0; k < PHOTONS / 4; ++k) { /* and what comes straight from the lamp */
            double d[3] = {0, 0, 1}, way;
            scatter(d, 0.0, &lots);
            wall_ahead(lamp, d, 1.0, &way);
            fluences += (1.0 - exp(-sigma_t * way)) / sigma_t / (PHOTONS / 4);
        }
        const double absorbed = (double)a * fluences;
        print_message("white room, sigma_s %g sigma_a %g, %u iterations: %.4f of 1 W\n", (double)s,
                      (double)a, stats.iterations, absorbed);
        assert_close(absorbed, 1.0, 0.03);
        assert_true(stats.iterations <= 15);
        free(field.texels);
        brume_scene_destroy(scene);
    }
}

/* --- Hostile scenes ------------------------------------------------------------------------- */

static void nothing_odd_comes_out(void **state)
{
    (void)state;
    static const struct coefficients media[] = {
        {.sigma_s = {5, 5, 5}, .g = -0.9f},
        {.sigma_s = {5, 5, 5}, .g = 0.98f},
        {.sigma_a = {5, 1, 0}},
        {.sigma_s = {16000, 1e-5f, 0}, .sigma_a = {0, 1e-5f, 16000}, .g = 0.5f},
        {.sigma_s = {1e-6f, 0, 0}, .emission = {3, 0, 0}},
        {.g = 0.0f},
    };
    static const float lamps[][3] = {{0.1f, 0.2f, 0.1f}, {50, 0, 0}, {0, 0, -0.7f}};
    brume_settings settings = settings_for(16);
    settings.iterations = 6; /* what is wrong is so at once */
    for (size_t i = 0; i < sizeof media / sizeof *media; ++i)
        for (size_t k = 0; k < sizeof lamps / sizeof *lamps; ++k) {
            const brume_world world = {.color = {0.5f, 0.5f, 0.5f}};
            brume_scene *scene = empty();
            add_fog_cube(scene, 1, origin, 0.5f, &media[i]);
            add_box_at(scene, 2, (float[3]){0, 0, -0.7f}, 0.1f, 0.9f); /* the last lamp is in it */
            if (k != 1)
                assert_ok(brume_scene_set_world(scene, &world));
            assert_sound_picture(scene, &settings); /* without a lamp */
            add_lamp(scene, 3, lamps[k], 100.0f);
            assert_sound_picture(scene, &settings);
            brume_scene_destroy(scene);
        }
}

/* A pixel of the sky is as bright as a sun, or the sky is black; a lamp stands on the corner of
 * cells, where the middle of an even number of them is; media of different mean cosines overlap. */
static void nothing_odd_comes_of_chance(void **state)
{
    (void)state;
    enum { WIDE = 64, HIGH = 32 };
    static float pixels[4 * WIDE * HIGH];
    for (int i = 0; i < 4 * WIDE * HIGH; ++i)
        pixels[i] = 0.1f;
    for (int c = 0; c < 3; ++c)
        pixels[4 * (20 * WIDE + 40) + c] = 1e6f;
    const brume_image image = {.name = "sky", .pixels = pixels, .width = WIDE, .height = HIGH};
    static const brume_world worlds[] = {
        {.color = {0, 0, 0}}, {.color = {1, 1, 1}, .image = 9}, {.color = {0, 0, 0}, .image = 9}};
    static const struct coefficients forwards = {.sigma_s = {5, 5, 5}, .g = 0.9f};
    static const struct coefficients backwards = {
        .sigma_s = {3, 0, 3}, .sigma_a = {1, 1, 0}, .g = -0.7f};
    static const float aside[3] = {0.2f, 0.1f, 0.15f}, face[3] = {0, 0.11f, 0.07f};
    brume_settings settings = settings_for(16);
    settings.iterations = 6;
    for (size_t i = 0; i < sizeof worlds / sizeof *worlds; ++i) {
        brume_scene *scene = empty();
        assert_ok(brume_scene_set_image(scene, 9, &image));
        assert_ok(brume_scene_set_world(scene, &worlds[i]));
        add_fog_cube(scene, 1, origin, 0.5f, &forwards);
        assert_sound_picture(scene, &settings);
        add_fog_cube(scene, 2, aside, 0.3f, &backwards); /* within the first */
        assert_sound_picture(scene, &settings);
        for (int k = 0; k < 2; ++k) {
            add_lamp(scene, 3, k ? face : origin, 100.0f);
            assert_sound_picture(scene, &settings);
            struct field field = field_of(scene, &settings, NULL);
            assert_sound(&field);
            free(field.texels);
        }
        brume_scene_destroy(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(quadratures),
        cmocka_unit_test(furnaces),
        cmocka_unit_test(few_iterations),
        cmocka_unit_test(cube),
        cmocka_unit_test(light_between_walls),
        cmocka_unit_test(behind_walls),
        cmocka_unit_test(white_room),
        cmocka_unit_test(nothing_odd_comes_out),
        cmocka_unit_test(nothing_odd_comes_of_chance),
    };
    const struct CMUnitTest long_tests[] = {
        cmocka_unit_test(fine_cube),
    };
    cmocka_set_test_filter(getenv("BRUME_TESTS"));
    return at_length() ? cmocka_run_group_tests(long_tests, open_device, close_device)
                       : cmocka_run_group_tests(tests, open_device, close_device);
}
