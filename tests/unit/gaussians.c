/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Media of Gaussians on the lattice against their closed forms: mass, means, colours, transforms.
 */
#include "base/result.h"
#include "harness.h"
#include "scene/medium.h"
#include "scene/splat.h"

#include <omp.h>

/* Of a Gaussian's mass, erfc(3) + 6 / sqrt(pi) exp(-9) lie beyond its reach; cells that jut out of
 * it keep some of that. */
#define CUT 4.5e-4

/* --- Makers ------------------------------------------------------------------------------- */

/* Registers 0 and 1: scatters the density, absorbs the colour. */
static const brume_instruction read_code[] = {{.op = BRUME_OP_GRID, .dst = 0, .a = 0},
                                              {.op = BRUME_OP_GRID, .dst = 1, .a = 1},
                                              {.op = BRUME_OP_CONSTANT, .dst = 2}};
static const brume_volume_program read_both = {.instructions = read_code,
                                               .instruction_count = 3,
                                               .sigma_s = 0,
                                               .sigma_a = 1,
                                               .g = 2,
                                               .emission = 2};

static brume_volume source_of(const brume_gaussian *gaussians, uint32_t count)
{
    brume_volume source = {
        .name = "dust", .gaussians = gaussians, .gaussian_count = count, .program = read_both};
    memcpy(source.world_from_object, identity, sizeof identity);
    return source;
}

static struct volume *volume_of(const brume_volume *source)
{
    struct volume *volume;
    assert_ok(volume_create(source, &volume));
    return volume;
}

static struct volume *gaussians_make(const brume_gaussian *gaussians, uint32_t count)
{
    const brume_volume source = source_of(gaussians, count);
    return volume_of(&source);
}

static brume_gaussian white(float x, float y, float z, float scale, float amplitude)
{
    return (brume_gaussian){
        .center = {x, y, z}, .scale = scale, .color = {1, 1, 1}, .amplitude = amplitude};
}

/* A cube from -1 to 1 that scatters so much. */
static struct volume *cube_make(float sigma_s)
{
    const struct coefficients c = {.sigma_s = {sigma_s, sigma_s, sigma_s}, .g = 0.5f};
    const float origin[3] = {0};
    struct fog_cube cube;
    fog_cube_init(&cube, origin, 1.0f, &c);
    return volume_of(&cube.volume);
}

/* Evenly spread over the cube from 0 to 1, side^3 of them, jittered; about two cells of a lattice
 * of that resolution wide. */
static brume_gaussian *spread(int side, int resolution)
{
    uint32_t seed = 7;
    brume_gaussian *out = malloc((size_t)side * (size_t)side * (size_t)side * sizeof *out);
    assert_non_null(out);
    for (int i = 0; i < side * side * side; ++i) {
        const int at[3] = {i % side, i / side % side, i / side / side};
        float values[7];
        for (int v = 0; v < 7; ++v) {
            seed = seed * 1664525u + 1013904223u;
            values[v] = (float)(seed >> 8) / 16777216.0f;
        }
        out[i] = (brume_gaussian){.scale = 1.5f * (float)resolution, .amplitude = values[3]};
        for (int axis = 0; axis < 3; ++axis) {
            out[i].center[axis] = ((float)at[axis] + values[axis]) / (float)side;
            out[i].color[axis] = values[4 + axis];
        }
    }
    return out;
}

static struct medium_lattice build(struct volume *const *volumes, uint32_t count,
                                   int32_t resolution)
{
    struct medium_lattice lattice;
    assert_ok(medium_build(volumes, count, resolution, 0, NULL, NULL, &lattice));
    return lattice;
}

static size_t cell_count(const struct medium_lattice *lattice)
{
    return (size_t)lattice->dims[0] * (size_t)lattice->dims[1] * (size_t)lattice->dims[2];
}

static double mass(const struct medium_lattice *lattice)
{
    double sum = 0.0;
    for (size_t i = 0; i < cell_count(lattice); ++i)
        sum += lattice->scatter[4 * i];
    return sum * pow(lattice->cell, 3.0);
}

static double mass_of(double amplitude, double scale)
{
    return amplitude * pow(sqrt(3.14159265358979323846) / scale, 3.0);
}

/* The world's coordinate of a cell's lower side. */
static double side(const struct medium_lattice *lattice, int axis, int32_t cell)
{
    return lattice->lower[axis] + (double)cell * lattice->cell;
}

static size_t index_of(const struct medium_lattice *lattice, int32_t i, int32_t j, int32_t k)
{
    return ((size_t)k * (size_t)lattice->dims[1] + (size_t)j) * (size_t)lattice->dims[0] +
           (size_t)i;
}

/* How far the nearest point of a cell is from a point. */
static double distance_to(const struct medium_lattice *lattice, const int32_t cell[3],
                          const float point[3])
{
    double square = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double low = side(lattice, axis, cell[axis]) - point[axis];
        const double away = fmax(fmax(low, -low - lattice->cell), 0.0);
        square += away * away;
    }
    return sqrt(square);
}

/* --- Mass --------------------------------------------------------------------------------- */

/* From a hundred-thousandth of a cell to many cells, anywhere in a cell. */
static void the_mass_is_kept_at_any_size(void **state)
{
    (void)state;
    const float scales[7] = {1e6f, 1e3f, 100.0f, 30.0f, 10.0f, 5.0f, 0.5f};
    const float places[3][3] = {{0.013f, -0.327f, 0.411f}, {0.2f, 0.2f, 0.2f}, {0, 0, 0}};
    struct volume *volumes[2] = {NULL, cube_make(0.0f)};
    for (int s = 0; s < 7; ++s)
        for (int p = 0; p < 3; ++p)
            for (int32_t resolution = 1; resolution <= 40; resolution = 3 * resolution + 1) {
                const brume_gaussian one =
                    white(places[p][0], places[p][1], places[p][2], scales[s], 2.0f);
                volumes[0] = gaussians_make(&one, 1);
                struct medium_lattice lattice = build(volumes, 2, resolution);
                const double expected = mass_of(2.0, scales[s]);
                assert_true(mass(&lattice) < expected * (1.0 + 1e-6));
                assert_true(mass(&lattice) > expected * (1.0 - CUT));
                medium_finish(&lattice);
                volume_release(volumes[0]);
            }
    volume_release(volumes[1]);
}

/* Where cells meet, each has its part; two more specks only widen the volume's box. */
static void a_speck_on_a_corner_is_shared_by_eight_cells(void **state)
{
    (void)state;
    const float scales[3] = {100.0f, 1e4f, 1e17f}, amplitudes[3] = {1e6f, 1e12f, 1e38f};
    for (int s = 0; s < 3; ++s) {
        const float amplitude = amplitudes[s];
        const double part = mass_of(amplitude, scales[s]) / 8.0;
        const brume_gaussian three[3] = {white(0, 0, 0, scales[s], amplitude),
                                         white(-0.9f, -0.9f, -0.9f, scales[s], amplitude),
                                         white(0.9f, 0.9f, 0.9f, scales[s], amplitude)};
        struct volume *volumes[2] = {gaussians_make(three, 3), cube_make(0.0f)};
        struct medium_lattice lattice = build(volumes, 2, 2);
        assert_int_equal(cell_count(&lattice), 8);
        for (size_t i = 0; i < 8; ++i)
            assert_close(lattice.scatter[4 * i], i == 0 || i == 7 ? 9.0 * part : part, 1e-5);
        medium_finish(&lattice);
        volume_release(volumes[0]);
        volume_release(volumes[1]);
    }
}

/* Specks that are smaller than the bounds' rounding lie on the lattice's very sides. */
static void specks_at_the_ends_of_the_lattice_stay_in_it(void **state)
{
    (void)state;
    const float scales[3] = {1e3f, 1e6f, 1e9f}, away[2] = {0.0f, 1e5f};
    for (int s = 0; s < 3; ++s)
        for (int a = 0; a < 2; ++a)
            for (int32_t resolution = 1; resolution < 12; ++resolution) {
                const brume_gaussian two[2] = {white(away[a], 0.1f, 0.2f, scales[s], 1.0f),
                                               white(away[a] + 1.0f, 0.7f, 0.8f, scales[s], 1.0f)};
                struct volume *volume = gaussians_make(two, 2);
                struct medium_lattice lattice = build(&volume, 1, resolution);
                assert_close(mass(&lattice), 2.0 * mass_of(1.0, scales[s]), 1e-3);
                medium_finish(&lattice);
                volume_release(volume);
            }
}

/* --- Values ------------------------------------------------------------------------------- */

/* The mean over a cell by many points, where the library has it by erf. */
static double mean_by_points(const struct medium_lattice *lattice, const int32_t cell[3],
                             const brume_gaussian *gaussian)
{
    double mean = gaussian->amplitude;
    for (int axis = 0; axis < 3; ++axis) {
        double sum = 0.0;
        for (int p = 0; p < 64; ++p) {
            const double x = side(lattice, axis, cell[axis]) + (p + 0.5) / 64 * lattice->cell -
                             gaussian->center[axis];
            sum += exp(-pow(gaussian->scale * x, 2.0));
        }
        mean *= sum / 64;
    }
    return mean;
}

/* All of them within the reach, and nothing beyond it, not even in the corners of its box. */
static void cells_hold_means_up_to_the_reach(void **state)
{
    (void)state;
    const brume_gaussian one = white(0.11f, -0.07f, 0.23f, 5.0f, 3.0f);
    const int32_t resolutions[3] = {5, 16, 48};
    struct volume *volumes[2] = {gaussians_make(&one, 1), cube_make(0.0f)};
    for (int r = 0; r < 3; ++r) {
        struct medium_lattice lattice = build(volumes, 2, resolutions[r]);
        int within = 0, beyond = 0;
        for (int32_t k = 0; k < lattice.dims[2]; ++k)
            for (int32_t j = 0; j < lattice.dims[1]; ++j)
                for (int32_t i = 0; i < lattice.dims[0]; ++i) {
                    const int32_t cell[3] = {i, j, k};
                    const float *found = lattice.scatter + 4 * index_of(&lattice, i, j, k);
                    const double widths = distance_to(&lattice, cell, one.center) * one.scale;
                    if (widths < GAUSSIAN_REACH - 1e-4)
                        /* 64 points an axis are good to (a h)^2 / 64^2 times a few. */
                        assert_close(found[0], mean_by_points(&lattice, cell, &one), 5e-3);
                    else if (widths > GAUSSIAN_REACH + 1e-4)
                        assert_true(found[0] == 0.0f);
                    within += found[0] > 0.0f;
                    beyond += found[0] == 0.0f;
                }
        assert_true(within > 0 && beyond > 0);
        medium_finish(&lattice);
    }
    volume_release(volumes[0]);
    volume_release(volumes[1]);
}

/* On a fine lattice the means are the values. */
static void a_fine_lattice_shows_the_function(void **state)
{
    (void)state;
    const brume_gaussian one = white(1.0f, 2.0f, 3.0f, 0.8f, 0.7f);
    struct volume *volume = gaussians_make(&one, 1);
    struct medium_lattice lattice = build(&volume, 1, 120);
    for (int32_t i = 10; i < 110; ++i) {
        const double x = side(&lattice, 0, i) + 0.5 * lattice.cell - 1.0;
        const double y = side(&lattice, 1, 40) + 0.5 * lattice.cell - 2.0;
        const double z = side(&lattice, 2, 70) + 0.5 * lattice.cell - 3.0;
        const double value = 0.7 * exp(-0.64 * (x * x + y * y + z * z));
        /* The mean differs by (a h)^2 / 24 times what the second derivative is, 36 at most. */
        assert_close(lattice.scatter[4 * index_of(&lattice, i, 40, 70)], value, 5e-3);
    }
    medium_finish(&lattice);
    volume_release(volume);
}

/* Trilinear, between the cells' centres; 0 beyond them. */
static double interpolate(const struct medium_lattice *lattice, const double point[3])
{
    int32_t low[3];
    double part[3], sum = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double at = (point[axis] - lattice->lower[axis]) / lattice->cell - 0.5;
        low[axis] = (int32_t)floor(at);
        part[axis] = at - low[axis];
        if (low[axis] < 0 || low[axis] + 1 >= lattice->dims[axis])
            return 0.0;
    }
    for (int corner = 0; corner < 8; ++corner) {
        double weight = 1.0;
        int32_t cell[3];
        for (int axis = 0; axis < 3; ++axis) {
            const int high = corner >> axis & 1;
            cell[axis] = low[axis] + high;
            weight *= high ? part[axis] : 1.0 - part[axis];
        }
        sum += weight * lattice->scatter[4 * index_of(lattice, cell[0], cell[1], cell[2])];
    }
    return sum;
}

/* The worst, in parts of the peak; the peak itself lies on a corner of cells, where it is worst. */
static double worst_interpolation(const struct medium_lattice *lattice)
{
    double worst = 0.0;
    for (int z = 0; z <= 60; ++z)
        for (int y = 0; y <= 60; ++y)
            for (int x = 0; x <= 60; ++x) {
                const double point[3] = {0.05 * x, 0.05 * y, 0.05 * z};
                const double value =
                    exp(-(point[0] * point[0] + point[1] * point[1] + point[2] * point[2]));
                worst = fmax(worst, fabs(interpolate(lattice, point) - value));
            }
    return worst;
}

static void the_useful_resolution_shows_half_a_percent(void **state)
{
    (void)state;
    const brume_gaussian one = white(0, 0, 0, 1, 1);
    struct volume *volume = gaussians_make(&one, 1);
    const int32_t useful = medium_useful_resolution(&volume, 1);
    assert_int_equal(useful, 96); /* 6 widths of 16 cells */
    struct medium_lattice lattice = build(&volume, 1, useful);
    const double worst = worst_interpolation(&lattice);
    assert_true(worst < 0.004);
    medium_finish(&lattice);
    lattice = build(&volume, 1, useful / 2);
    assert_close(worst_interpolation(&lattice), 4.0 * worst, 0.02);
    medium_finish(&lattice);
    volume_release(volume);

    /* The narrowest counts, in the world; one of amplitude 0 does not. */
    const brume_gaussian three[3] = {white(0, 0, 0, 1, 1), white(0, 0, 0, 2, 1),
                                     white(9, 9, 9, 50, 0)};
    brume_volume source = source_of(three, 3);
    source.world_from_object[0] = 10.0f;
    source.world_from_object[5] = source.world_from_object[10] = 10.0f;
    volume = volume_of(&source);
    assert_int_equal(medium_useful_resolution(&volume, 1), 192);
    volume_release(volume);
}

/* --- Colours, and more than one ----------------------------------------------------------- */

static void colors_are_means_weighted_by_density(void **state)
{
    (void)state;
    brume_gaussian two[2] = {white(-0.2f, 0, 0, 4.0f, 1.0f), white(0.2f, 0.1f, 0, 5.0f, 3.0f)};
    const float colors[2][3] = {{1.0f, 0.5f, 0.0f}, {0.25f, 0.5f, 7.0f}};
    memcpy(two[0].color, colors[0], sizeof colors[0]);
    memcpy(two[1].color, colors[1], sizeof colors[1]);
    struct volume *volume = gaussians_make(two, 2);
    struct medium_lattice lattice = build(&volume, 1, 20);
    int overlaps = 0;
    for (int32_t k = 0; k < lattice.dims[2]; ++k)
        for (int32_t j = 0; j < lattice.dims[1]; ++j)
            for (int32_t i = 0; i < lattice.dims[0]; ++i) {
                const int32_t cell[3] = {i, j, k};
                const size_t at = 4 * index_of(&lattice, i, j, k);
                double means[2];
                for (int g = 0; g < 2; ++g) {
                    const double widths = distance_to(&lattice, cell, two[g].center) * two[g].scale;
                    if (fabs(widths - GAUSSIAN_REACH) < 1e-4)
                        goto next; /* either would be right */
                    means[g] =
                        widths < GAUSSIAN_REACH ? mean_by_points(&lattice, cell, &two[g]) : 0.0;
                }
                overlaps += means[0] > 0.0 && means[1] > 0.0;
                const double density = means[0] + means[1];
                for (int c = 0; c < 3; ++c) {
                    const double color =
                        density > 0.0
                            ? (means[0] * colors[0][c] + means[1] * colors[1][c]) / density
                            : 0.0;
                    assert_float_equal(lattice.scatter[at + (size_t)c], density, 1e-3 * density);
                    assert_float_equal(lattice.extinct[at + (size_t)c], density + color,
                                       1e-3 * (density + color));
                }
            next:;
            }
    assert_true(overlaps > 100);
    medium_finish(&lattice);
    volume_release(volume);
}

/* The program runs where there is density, whatever it makes of it. */
static void a_constant_keeps_to_the_gaussians(void **state)
{
    (void)state;
    const brume_gaussian two[2] = {white(0, 0, 0, 6.0f, 1.0f), white(4, 0, 0, 6.0f, 1.0f)};
    const struct coefficients fog = {.sigma_s = {1, 2, 3}, .emission = {0, 0, 4}};
    brume_instruction code[4];
    brume_volume source = source_of(two, 2);
    constant_program(&fog, code, &source.program);
    source.scale = 2.0f;
    struct volume *volume = volume_of(&source);
    struct medium_lattice lattice = build(&volume, 1, 50);
    assert_non_null(lattice.emission);
    int full = 0, empty = 0;
    for (int32_t i = 0; i < lattice.dims[0]; ++i) {
        const size_t at = 4 * index_of(&lattice, i, lattice.dims[1] / 2, lattice.dims[2] / 2);
        const double x = side(&lattice, 0, i) + 0.5 * lattice.cell;
        const bool in = x < 0.5 || x > 3.5;
        if (fabs(x - 0.5) < lattice.cell || fabs(x - 3.5) < lattice.cell)
            continue;
        assert_true(lattice.scatter[at + 2] == (in ? 6.0f : 0.0f));
        assert_true(lattice.emission[at + 2] == (in ? 8.0f : 0.0f));
        full += in;
        empty += !in;
    }
    assert_true(full > 5 && empty > 20);
    medium_finish(&lattice);
    volume_release(volume);
}

static void they_add_to_other_media(void **state)
{
    (void)state;
    const brume_gaussian one = white(0.2f, 0.2f, 0.2f, 4.0f, 2.0f);
    struct volume *volumes[2] = {cube_make(1.5f), gaussians_make(&one, 1)};
    assert_int_equal(medium_useful_resolution(volumes, 2), INT32_MAX);
    struct medium_lattice both = build(volumes, 2, 24);
    struct medium_lattice turned = build((struct volume *[]){volumes[1], volumes[0]}, 2, 24);
    assert_close(mass(&both), 1.5 * 8.0 + mass_of(2.0, 4.0), 1e-4);
    for (size_t i = 0; i < cell_count(&both); ++i)
        for (int c = 0; c < 4; ++c)
            assert_float_equal(both.scatter[4 * i + (size_t)c], turned.scatter[4 * i + (size_t)c],
                               1e-6);
    medium_finish(&both);
    medium_finish(&turned);
    volume_release(volumes[0]);
    volume_release(volumes[1]);
}

/* --- Transforms --------------------------------------------------------------------------- */

static void transforms_move_and_scale_but_keep_them_round(void **state)
{
    (void)state;
    const struct {
        float matrix[16];
        double size; /* cube root of the determinant */
        double center[3];
        double tolerance; /* of the middle, m: a float's last digit there */
    } cases[5] = {
        {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1e5f, 0, -1e5f, 1}, 1, {1e5 + 1, 2, -1e5 - 3}, 0.01},
        {{3, 0, 0, 0, 0, 3, 0, 0, 0, 0, 3, 0, 5, 6, 7, 1}, 3, {8, 12, -2}, 1e-4},
        {{2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 4, 0, 0, 0, 0, 1}, 2, {2, 2, -12}, 1e-4},
        {{0, 0, -1, 0, 0, 8, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1}, 2, {-3, 16, -1}, 1e-4}, /* turned */
        {{1, 0, 0, 0, 5, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1}, 1, {11, 2, 3}, 1e-4},   /* sheared */
    };
    const brume_gaussian one = white(1, 2, -3, 2.0f, 0.5f);
    for (int t = 0; t < 5; ++t) {
        brume_volume source = source_of(&one, 1);
        memcpy(source.world_from_object, cases[t].matrix, sizeof cases[t].matrix);
        struct volume *volume = volume_of(&source);
        for (int axis = 0; axis < 3; ++axis) {
            assert_float_equal(0.5 * ((double)volume->lower[axis] + volume->upper[axis]),
                               cases[t].center[axis], cases[t].tolerance);
            assert_float_equal(volume->upper[axis] - volume->lower[axis], 3.0 * cases[t].size,
                               2.0 * cases[t].tolerance);
        }
        struct medium_lattice lattice = build(&volume, 1, 30);
        assert_close(mass(&lattice), mass_of(0.5, 2.0 / cases[t].size), 1e-3);
        /* The mass's middle and spread, which is half a width squared along each axis. */
        double sum = 0.0, first[3] = {0}, second[3] = {0};
        for (int32_t k = 0; k < lattice.dims[2]; ++k)
            for (int32_t j = 0; j < lattice.dims[1]; ++j)
                for (int32_t i = 0; i < lattice.dims[0]; ++i) {
                    const int32_t cell[3] = {i, j, k};
                    const double value = lattice.scatter[4 * index_of(&lattice, i, j, k)];
                    sum += value;
                    for (int axis = 0; axis < 3; ++axis) {
                        const double x = side(&lattice, axis, cell[axis]) + 0.5 * lattice.cell -
                                         cases[t].center[axis];
                        first[axis] += value * x;
                        second[axis] += value * x * x;
                    }
                }
        for (int axis = 0; axis < 3; ++axis) {
            assert_float_equal(first[axis] / sum, 0.0, cases[t].tolerance);
            /* A cell's own spread is 0.3 % of it, the cut's share 0.3 % again. */
            assert_close(second[axis] / sum, 0.5 * pow(cases[t].size / 2.0, 2.0), 0.01);
        }
        medium_finish(&lattice);
        volume_release(volume);
    }
}

/* --- Many --------------------------------------------------------------------------------- */

static void one_of_many_changes_only_what_it_reaches(void **state)
{
    (void)state;
    const uint32_t count = 27000;
    brume_gaussian *gaussians = spread(30, 20);
    struct volume *without = gaussians_make(gaussians, count);
    gaussians[count / 2].amplitude += 1.0f;
    struct volume *with = gaussians_make(gaussians, count);
    struct medium_lattice before = build(&without, 1, 20), after = build(&with, 1, 20);
    int changed = 0;
    double expected = 0.0;
    for (uint32_t i = 0; i < count; ++i)
        expected += mass_of(gaussians[i].amplitude, gaussians[i].scale);
    assert_close(mass(&after), expected, 1e-3);
    for (int32_t k = 0; k < before.dims[2]; ++k)
        for (int32_t j = 0; j < before.dims[1]; ++j)
            for (int32_t i = 0; i < before.dims[0]; ++i) {
                const int32_t cell[3] = {i, j, k};
                const size_t at = 4 * index_of(&before, i, j, k);
                const double reach = GAUSSIAN_REACH / gaussians[count / 2].scale;
                const bool same = before.scatter[at] == after.scatter[at] &&
                                  before.extinct[at] == after.extinct[at];
                assert_true(same ||
                            distance_to(&before, cell, gaussians[count / 2].center) < reach);
                changed += !same;
            }
    assert_true(changed > 20 && changed < 250);
    medium_finish(&before);
    medium_finish(&after);
    volume_release(without);
    volume_release(with);
    free(gaussians);
}

static void any_number_of_threads_gives_the_same(void **state)
{
    (void)state;
    brume_gaussian *gaussians = spread(12, 30);
    struct volume *volume = gaussians_make(gaussians, 12 * 12 * 12);
    const int threads = omp_get_max_threads();
    omp_set_num_threads(1);
    struct medium_lattice one = build(&volume, 1, 30);
    for (int n = 2; n <= 5; n += 3) {
        omp_set_num_threads(n);
        struct medium_lattice many = build(&volume, 1, 30);
        const size_t bytes = cell_count(&one) * 4 * sizeof(float);
        assert_memory_equal(one.scatter, many.scatter, bytes);
        assert_memory_equal(one.extinct, many.extinct, bytes);
        medium_finish(&many);
    }
    omp_set_num_threads(threads);
    medium_finish(&one);
    volume_release(volume);
    free(gaussians);
}

static bool cancel_after(void *user)
{
    int *polls = user;
    return (*polls)-- <= 0;
}

static void a_cancelled_build_ends_early(void **state)
{
    (void)state;
    brume_gaussian *gaussians = spread(12, 30);
    struct volume *volume = gaussians_make(gaussians, 12 * 12 * 12);
    /* Only the caller's thread asks, and how often depends on the planes that it gets: alone, all.
     * Each plane asks for each of its Gaussians and rows. */
    const int threads = omp_get_max_threads();
    omp_set_num_threads(1);
    struct medium_lattice lattice;
    for (int polls = 0; polls < 5000; polls += 709) {
        int left = polls;
        assert_int_equal(medium_build(&volume, 1, 30, 0, cancel_after, &left, &lattice),
                         BRUME_E_CANCELLED);
        assert_null(lattice.scatter);
    }
    omp_set_num_threads(threads);
    int enough = 10000000;
    assert_ok(medium_build(&volume, 1, 30, 0, cancel_after, &enough, &lattice));
    medium_finish(&lattice);
    volume_release(volume);
    free(gaussians);
}

/* --- Volumes ------------------------------------------------------------------------------ */

static void refused(const brume_volume *source, brume_result code, const char *words)
{
    struct volume *volume = NULL;
    assert_int_equal(volume_create(source, &volume), code);
    assert_null(volume);
    if (!strstr(last_error(), words) || !strstr(last_error(), "'dust'"))
        fail_msg("'%s' does not say '%s' of 'dust'", last_error(), words);
}

static void bad_gaussians_are_refused_by_number(void **state)
{
    (void)state;
    const brume_gaussian good = white(0, 0, 0, 1, 1);
    brume_gaussian two[2] = {good, good};
    const brume_volume source = source_of(two, 2);
    const float wrong[3] = {NAN, INFINITY, -INFINITY};
    for (int w = 0; w < 3; ++w) {
        two[1] = good;
        two[1].center[w] = wrong[w];
        refused(&source, BRUME_E_ARGUMENT, "Gaussian 1 ");
        two[1] = good;
        two[1].scale = wrong[w];
        refused(&source, BRUME_E_ARGUMENT, "scale");
        two[1] = good;
        two[1].amplitude = wrong[w];
        refused(&source, BRUME_E_ARGUMENT, "amplitude");
        two[1] = good;
        two[1].color[w] = wrong[w];
        refused(&source, BRUME_E_ARGUMENT, "color");
    }
    two[1] = good;
    two[1].scale = 0.0f;
    refused(&source, BRUME_E_ARGUMENT, "Gaussian 1 ");
    two[1].scale = -2.0f;
    refused(&source, BRUME_E_ARGUMENT, "-2");
    two[1] = good;
    two[1].amplitude = -3.0f;
    refused(&source, BRUME_E_ARGUMENT, "-3");
    two[1] = good;
    two[1].color[2] = -4.0f;
    refused(&source, BRUME_E_ARGUMENT, "(1, 1, -4)");
    /* Of one that does not show, too. */
    two[1].amplitude = 0.0f;
    refused(&source, BRUME_E_ARGUMENT, "Gaussian 1 ");

    two[1] = good;
    two[1].scale = 1e-45f;
    refused(&source, BRUME_E_TRANSFORM, "further than numbers");

    two[1] = good;
    brume_volume bad = source;
    bad.gaussian_count = 0;
    refused(&bad, BRUME_E_ARGUMENT, "no Gaussians");
    bad = source;
    bad.gaussians = NULL;
    refused(&bad, BRUME_E_ARGUMENT, "neither");
    bad = source;
    bad.world_from_object[0] = 0.0f;
    refused(&bad, BRUME_E_TRANSFORM, "zero scale");

    float positions[24];
    uint32_t triangles[36];
    cube_mesh(identity + 1, 1.0f, positions, triangles);
    bad = source;
    bad.positions = positions;
    bad.triangles = triangles;
    bad.vertex_count = 8;
    bad.triangle_count = 12;
    refused(&bad, BRUME_E_ARGUMENT, "more than one");

    /* They have two grids. */
    brume_instruction code[3];
    memcpy(code, read_code, sizeof code);
    code[1].a = 2;
    bad = source;
    bad.program.instructions = code;
    refused(&bad, BRUME_E_SHADER_PROGRAM, "grid 2 of 2");
}

static void those_without_amplitude_reach_nowhere(void **state)
{
    (void)state;
    brume_gaussian two[2] = {white(7, 8, 9, 1, 0), white(-7, 0, 0, 1, 0)};
    struct volume *volumes[2] = {gaussians_make(two, 2), cube_make(1.0f)};
    struct medium_lattice lattice = build(volumes, 1, 20);
    assert_int_equal(lattice.dims[0] + lattice.dims[1] + lattice.dims[2], 0);
    assert_null(lattice.scatter);
    medium_finish(&lattice);
    assert_int_equal(medium_useful_resolution(volumes, 1), 1);

    lattice = build(volumes, 2, 20);
    assert_int_equal(cell_count(&lattice), 20 * 20 * 20);
    assert_close(mass(&lattice), 8.0, 1e-5);
    medium_finish(&lattice);
    volume_release(volumes[0]);
    volume_release(volumes[1]);

    /* Beside another they do not count. */
    two[0] = white(0, 0, 0, 1, 1);
    struct volume *volume = gaussians_make(two, 2);
    assert_true(volume->lower[0] == -3.0f && volume->upper[0] == 3.0f);
    volume_release(volume);
}

static void extreme_values_stay_finite(void **state)
{
    (void)state;
    brume_gaussian two[2] = {white(0, 0, 0, 1, 3e38f), white(0.5f, 0, 0, 1, 3e38f)};
    two[0].color[0] = two[1].color[0] = 3e38f;
    two[1].color[1] = 1e-38f;
    struct volume *volume = gaussians_make(two, 2);
    for (int32_t resolution = 1; resolution < 30; resolution += 4) {
        struct medium_lattice lattice = build(&volume, 1, resolution);
        for (size_t i = 0; i < 4 * cell_count(&lattice); ++i)
            assert_true(isfinite(lattice.scatter[i]) && isfinite(lattice.extinct[i]));
        assert_true(mass(&lattice) > 0.0);
        medium_finish(&lattice);
    }
    volume_release(volume);
}

static void a_volume_keeps_its_own_copy(void **state)
{
    (void)state;
    brume_gaussian one = white(0, 0, 0, 1, 1);
    brume_volume source = source_of(&one, 1);
    source.scale = 3.0f;
    struct volume *volume = volume_of(&source);
    memset(&one, 0xff, sizeof one);
    struct medium_lattice lattice = build(&volume, 1, 9);
    assert_close(mass(&lattice), 3.0 * mass_of(1.0, 1.0), 1e-3);
    medium_finish(&lattice);
    volume_release(volume);
}

/* Cells that have become larger than most balls, and what made them so. */
static void balls_smaller_than_cells_are_told(void **state)
{
    (void)state;
    brume_gaussian dust[9], stray = white(0, 0, -60, 8, 1), wide = white(0, 0, 0, 0.5f, 1);
    for (int i = 0; i < 9; ++i)
        dust[i] = white((float)(i % 3), (float)(i / 3), 0, 8, 1); /* a radius of 0.25 m */
    struct volume *volumes[] = {gaussians_make(&wide, 1), gaussians_make(dust, 9),
                                gaussians_make(&stray, 1)};
    const struct {
        uint32_t first, count;
        int32_t resolution;
        int smeared, wide;
    } cases[] = {{1, 1, 40, -1, -1}, {1, 1, 8, 1, -1}, {1, 2, 40, 1, 2}, {0, 2, 40, 1, 0},
                 {0, 1, 8, -1, -1},  {0, 0, 8, -1, -1}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        struct volume **some = volumes + cases[i].first;
        const struct volume *larger;
        struct medium_lattice lattice = build(some, cases[i].count, cases[i].resolution);
        const struct volume *smeared = medium_smeared(some, cases[i].count, &lattice, &larger);
        assert_ptr_equal(smeared, cases[i].smeared < 0 ? NULL : volumes[cases[i].smeared]);
        assert_ptr_equal(larger, cases[i].wide < 0 ? NULL : volumes[cases[i].wide]);
        medium_finish(&lattice);
    }
    for (int i = 0; i < 3; ++i)
        volume_release(volumes[i]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(balls_smaller_than_cells_are_told),
        cmocka_unit_test(the_mass_is_kept_at_any_size),
        cmocka_unit_test(a_speck_on_a_corner_is_shared_by_eight_cells),
        cmocka_unit_test(specks_at_the_ends_of_the_lattice_stay_in_it),
        cmocka_unit_test(cells_hold_means_up_to_the_reach),
        cmocka_unit_test(a_fine_lattice_shows_the_function),
        cmocka_unit_test(the_useful_resolution_shows_half_a_percent),
        cmocka_unit_test(colors_are_means_weighted_by_density),
        cmocka_unit_test(a_constant_keeps_to_the_gaussians),
        cmocka_unit_test(they_add_to_other_media),
        cmocka_unit_test(transforms_move_and_scale_but_keep_them_round),
        cmocka_unit_test(one_of_many_changes_only_what_it_reaches),
        cmocka_unit_test(any_number_of_threads_gives_the_same),
        cmocka_unit_test(a_cancelled_build_ends_early),
        cmocka_unit_test(bad_gaussians_are_refused_by_number),
        cmocka_unit_test(those_without_amplitude_reach_nowhere),
        cmocka_unit_test(extreme_values_stay_finite),
        cmocka_unit_test(a_volume_keeps_its_own_copy),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
