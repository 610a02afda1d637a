/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What tests of DOM against exact numbers share: settings, light that leaves a medium, dice. */
#ifndef BRUME_TESTS_DOM_H
#define BRUME_TESTS_DOM_H

#include "field.h"

#define PI 3.14159265358979

static const float down[3] = {0, 0, -1};

static brume_settings settings_for(int cells)
{
    return (brume_settings){.method = BRUME_METHOD_DOM,
                            .medium_resolution = 32,
                            .lattice_resolution = 32,
                            .field_resolution = cells,
                            .ordinates = 48,
                            .step = 0.5f,
                            .shadow_resolution = 64,
                            .light_samples = 1,
                            .world_samples = 64};
}

/* Whether to go through what takes many minutes: all rows of tables, fine lattices. */
static bool at_length(void)
{
    const char *wanted = getenv("BRUME_ALL_ROWS");
    return wanted && strcmp(wanted, "1") == 0;
}

/* --- What media send out -------------------------------------------------------------------- */

/* Gauss and Legendre's points on [0, 1] and their weights. */
#define ANGLES 6
static const double gauss[ANGLES][2] = {
    {0.033765242898424, 0.085662246189585}, {0.169395306766868, 0.180380786524069},
    {0.380690406958402, 0.233956967286346}, {0.619309593041598, 0.233956967286346},
    {0.830604693233132, 0.180380786524069}, {0.966234757101576, 0.085662246189585}};

/* Adds the radiance that a medium sends out at a point of its surface, to an eye far away, that
 * many times. */
static void add_sent(brume_scene *scene, const brume_settings *settings, const float from[3],
                     const float out[3], double times, double radiance[3])
{
    const float along[3] = {-out[0], -out[1], -out[2]};
    brume_view view = orthographic_view(from, along, 1e-4f, 5.0f, 1);
    view.samples = 2;
    view.passes = 1u << BRUME_PASS_VOLUME_DIRECT | 1u << BRUME_PASS_VOLUME_INDIRECT;
    brume_job *job = render(scene, settings, &view);
    float *direct = read_pass(job, &view, BRUME_PASS_VOLUME_DIRECT);
    float *indirect = read_pass(job, &view, BRUME_PASS_VOLUME_INDIRECT);
    for (int c = 0; c < 3; ++c)
        radiance[c] += times * ((double)direct[c] + (double)indirect[c]);
    free(direct);
    free(indirect);
    brume_job_release(job);
}

/* Power per area that leaves at a point of a face across an axis, upwards or downwards; directions
 * turn by quarters of `turns`. */
static void leaves(brume_scene *scene, const brume_settings *settings, const float from[3],
                   int axis, float sign, int turns, double power[3])
{
    memset(power, 0, 3 * sizeof *power);
    for (int i = 0; i < ANGLES; ++i)
        for (int k = 0; k < turns; ++k) {
            const double cosine = gauss[i][0], sine = sqrt(1.0 - cosine * cosine);
            const double turn = (k + 0.3) * 2.0 * PI / turns;
            float out[3];
            out[axis] = sign * (float)cosine;
            out[(axis + 1) % 3] = (float)(sine * cos(turn));
            out[(axis + 2) % 3] = (float)(sine * sin(turn));
            add_sent(scene, settings, from, out, 2.0 * PI * cosine * gauss[i][1] / turns, power);
        }
}

#define THIN 0.002f /* what scatters once scatters no more, and dims nothing */

/* Radiance that a cube of thin fog, two metres wide, scatters to an eye at its side of light that
 * does not come from lamps, by its scattering coefficient and width. */
static double scattered(brume_scene *scene, uint32_t pass)
{
    static const struct coefficients thin = {.sigma_s = {THIN, THIN, THIN}};
    static const float sideways[3] = {1, 0, 0};
    const brume_settings settings = settings_for(16);
    add_fog_cube(scene, 2, origin, 1.0f, &thin);
    brume_view view = orthographic_view(origin, sideways, 0.2f, 50.0f, 8);
    view.passes = 1u << pass;
    brume_job *job = render(scene, &settings, &view);
    float *pixels = read_pass(job, &view, pass);
    const double found = middle(pixels, &view, 4, 0);
    free(pixels);
    brume_job_release(job);
    return found / (2.0 * (double)THIN);
}

/* A sky of radiance 1, all around. */
static brume_scene *under_a_sky(void)
{
    brume_scene *scene = empty();
    const brume_world world = {.color = {1, 1, 1}};
    assert_ok(brume_scene_set_world(scene, &world));
    return scene;
}

/* --- Monte Carlo ---------------------------------------------------------------------------- */

static double lot(uint64_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return ((double)(*state >> 11) + 0.5) / 9007199254740992.0;
}

/* Henyey and Greenstein's phase function about the direction. */
static void scatter(double d[3], double g, uint64_t *state)
{
    const double u = lot(state), turn = 2.0 * PI * lot(state);
    const double part = fabs(g) < 1e-3 ? 0.0 : (1.0 - g * g) / (1.0 - g + 2.0 * g * u);
    const double cosine = fabs(g) < 1e-3 ? 1.0 - 2.0 * u : (1.0 + g * g - part * part) / (2.0 * g);
    const double sine = sqrt(fmax(1.0 - cosine * cosine, 0.0));
    double x[3], y[3];
    const double *other = fabs(d[2]) < 0.9 ? (const double[]){0, 0, 1} : (const double[]){1, 0, 0};
    double length = 0.0;
    for (int i = 0; i < 3; ++i) {
        x[i] = other[(i + 1) % 3] * d[(i + 2) % 3] - other[(i + 2) % 3] * d[(i + 1) % 3];
        length += x[i] * x[i];
    }
    for (int i = 0; i < 3; ++i)
        x[i] /= sqrt(length);
    for (int i = 0; i < 3; ++i)
        y[i] = d[(i + 1) % 3] * x[(i + 2) % 3] - d[(i + 2) % 3] * x[(i + 1) % 3];
    for (int i = 0; i < 3; ++i)
        d[i] = cosine * d[i] + sine * (cos(turn) * x[i] + sin(turn) * y[i]);
}

/* The side of the cube [-half, half]^3 that a ray from within meets: its axis, and how far it is.
 */
static int wall_ahead(const double p[3], const double d[3], double half, double *way)
{
    int side = 0;
    *way = INFINITY;
    for (int axis = 0; axis < 3; ++axis) {
        const double to =
            d[axis] != 0.0 ? ((d[axis] > 0 ? half : -half) - p[axis]) / d[axis] : INFINITY;
        if (to < *way) {
            *way = to;
            side = axis;
        }
    }
    return side;
}

#endif
