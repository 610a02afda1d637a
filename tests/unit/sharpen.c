/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Sharpened cells: no mass is lost, nothing odd appears, and what is interpolated between them is
 * nearer to what their means were taken of. */
#include "scene/sharpen.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <omp.h>

static size_t cell_count(const struct medium_lattice *lattice)
{
    return (size_t)lattice->dims[0] * (size_t)lattice->dims[1] * (size_t)lattice->dims[2];
}

static struct medium_lattice make(int32_t x, int32_t y, int32_t z, bool emits)
{
    struct medium_lattice lattice = {.dims = {x, y, z}, .cell = 1.0f};
    const size_t values = 4 * cell_count(&lattice);
    lattice.scatter = calloc(values, sizeof(float));
    lattice.extinct = calloc(values, sizeof(float));
    lattice.emission = emits ? calloc(values, sizeof(float)) : NULL;
    return lattice;
}

static void sharpen(struct medium_lattice *lattice)
{
    assert_int_equal(medium_sharpen(lattice), BRUME_OK);
}

/* A value that differs between the channels. */
static void set(struct medium_lattice *lattice, size_t cell, float value)
{
    for (size_t c = 0; c < 3; ++c) {
        lattice->scatter[4 * cell + c] = value / (float)(c + 1);
        lattice->extinct[4 * cell + c] = value;
        if (lattice->emission)
            lattice->emission[4 * cell + c] = 2.0f * value;
    }
    lattice->scatter[4 * cell + 3] = -0.5f;
}

static uint32_t random_state;

static float random_float(void)
{
    random_state = random_state * 1664525u + 1013904223u;
    return (float)(random_state >> 8) / 16777216.0f;
}

/* Noise with holes in it. */
static struct medium_lattice noise(bool emits)
{
    struct medium_lattice lattice = make(19, 12, 7, emits);
    random_state = 3;
    for (size_t i = 0; i < cell_count(&lattice); ++i) {
        const float value = random_float();
        set(&lattice, i, random_float() < 0.4f ? 0.0f : value * value * value);
    }
    return lattice;
}

static double mass(const struct medium_lattice *lattice, const float *values, size_t channel)
{
    double sum = 0.0;
    for (size_t i = 0; i < cell_count(lattice); ++i)
        sum += values[4 * i + channel];
    return sum;
}

static void even_media_and_slopes_stay(void **state)
{
    (void)state;
    struct medium_lattice lattice = make(9, 8, 7, true);
    for (size_t i = 0; i < cell_count(&lattice); ++i)
        set(&lattice, i, 1.5f);
    sharpen(&lattice);
    for (size_t i = 0; i < cell_count(&lattice); ++i)
        assert_true(lattice.scatter[4 * i] == 1.5f && lattice.extinct[4 * i + 2] == 1.5f &&
                    lattice.emission[4 * i + 1] == 3.0f);

    for (int along = 0; along < 3; ++along) {
        for (size_t i = 0; i < cell_count(&lattice); ++i) {
            const size_t at[3] = {i % 9, i / 9 % 8, i / 72};
            set(&lattice, i, 1.0f + 0.25f * (float)at[along]);
        }
        sharpen(&lattice);
        /* What is beyond the lattice is as its last cells, so those have a kink. */
        for (size_t i = 0; i < cell_count(&lattice); ++i) {
            const size_t at[3] = {i % 9, i / 9 % 8, i / 72};
            if (at[along] > 1 && at[along] + 2 < (size_t)lattice.dims[along])
                assert_float_equal(lattice.extinct[4 * i], 1.0f + 0.25f * (float)at[along], 1e-6f);
        }
    }
    medium_finish(&lattice);
}

static void no_mass_is_lost_and_nothing_odd_appears(void **state)
{
    (void)state;
    struct medium_lattice before = noise(true), after = noise(true);
    sharpen(&after);
    for (size_t c = 0; c < 3; ++c) {
        assert_float_equal(mass(&after, after.scatter, c) / mass(&before, before.scatter, c), 1.0,
                           1e-5);
        assert_float_equal(mass(&after, after.extinct, c) / mass(&before, before.extinct, c), 1.0,
                           1e-5);
        assert_float_equal(mass(&after, after.emission, c) / mass(&before, before.emission, c),
                           1.0, 1e-5);
    }
    int changed = 0;
    for (size_t i = 0; i < cell_count(&after); ++i) {
        assert_true(after.scatter[4 * i + 3] == -0.5f);
        for (size_t c = 4 * i; c < 4 * i + 3; ++c) {
            assert_true(after.scatter[c] >= 0.0f && after.extinct[c] >= after.scatter[c]);
            assert_true(after.emission[c] >= 0.0f && isfinite(after.extinct[c]));
            if (before.extinct[c] == 0.0f)
                assert_true(after.extinct[c] == 0.0f && after.emission[c] == 0.0f);
            changed += after.extinct[c] != before.extinct[c];
        }
    }
    assert_true(changed > 1000);
    medium_finish(&before);
    medium_finish(&after);
}

/* A Gaussian of this standard deviation, in cells. */
#define WIDTH 1.5

static double ball(double x, double y, double z)
{
    return exp(-(x * x + y * y + z * z) / (2.0 * WIDTH * WIDTH));
}

/* Its mean over a cell, along one axis. */
static double mean(double from)
{
    const double scale = WIDTH * sqrt(2.0);
    return WIDTH * sqrt(M_PI / 2.0) * (erf((from + 1.0) / scale) - erf(from / scale));
}

static double interpolated(const struct medium_lattice *lattice, const double point[3])
{
    double sum = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
        double weight = 1.0;
        size_t index = 0;
        for (int axis = 2; axis >= 0; --axis) {
            const double at = point[axis] - 0.5, part = at - floor(at);
            const int high = corner >> axis & 1;
            weight *= high ? part : 1.0 - part;
            index = index * (size_t)lattice->dims[axis] + (size_t)(floor(at) + high);
        }
        sum += weight * lattice->extinct[4 * index];
    }
    return sum;
}

/* Root mean square of what is seen between the cells, beside the ball itself. */
static double error(const struct medium_lattice *lattice, const double middle[3])
{
    double sum = 0.0, all = 0.0;
    random_state = 5;
    for (int i = 0; i < 20000; ++i) {
        double point[3];
        for (int axis = 0; axis < 3; ++axis)
            point[axis] = 2.0 + 12.0 * random_float();
        const double truth =
            ball(point[0] - middle[0], point[1] - middle[1], point[2] - middle[2]);
        const double off = interpolated(lattice, point) - truth;
        sum += off * off;
        all += truth * truth;
    }
    return sqrt(sum / all);
}

static void what_is_seen_is_nearer_to_the_truth(void **state)
{
    (void)state;
    const double middle[3] = {8.0, 7.7, 8.4};
    struct medium_lattice lattice = make(16, 16, 16, false);
    size_t cell = 0;
    for (int z = 0; z < 16; ++z)
        for (int y = 0; y < 16; ++y)
            for (int x = 0; x < 16; ++x, ++cell)
                set(&lattice, cell,
                    (float)(mean(x - middle[0]) * mean(y - middle[1]) * mean(z - middle[2])));
    const double before = error(&lattice, middle);
    sharpen(&lattice);
    const double after = error(&lattice, middle);
    print_message("    off by %.2f %% of the ball, sharpened by %.2f %%\n", 100.0 * before,
                  100.0 * after);
    assert_true(before > 0.08);
    assert_true(after < 0.35 * before);
    medium_finish(&lattice);
}

static void any_number_of_threads_gives_the_same(void **state)
{
    (void)state;
    const int threads = omp_get_max_threads();
    omp_set_num_threads(1);
    struct medium_lattice one = noise(false);
    sharpen(&one);
    omp_set_num_threads(5);
    struct medium_lattice many = noise(false);
    sharpen(&many);
    omp_set_num_threads(threads);
    assert_memory_equal(one.scatter, many.scatter, cell_count(&one) * 4 * sizeof(float));
    assert_memory_equal(one.extinct, many.extinct, cell_count(&one) * 4 * sizeof(float));
    medium_finish(&one);
    medium_finish(&many);
}

static void nothing_and_single_cells_are_fine(void **state)
{
    (void)state;
    struct medium_lattice none = {0};
    sharpen(&none);
    struct medium_lattice one = make(1, 1, 1, true);
    set(&one, 0, 4.0f);
    sharpen(&one);
    assert_true(one.extinct[0] == 4.0f && one.scatter[1] == 2.0f && one.emission[2] == 8.0f);
    medium_finish(&one);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(even_media_and_slopes_stay),
        cmocka_unit_test(no_mass_is_lost_and_nothing_odd_appears),
        cmocka_unit_test(what_is_seen_is_nearer_to_the_truth),
        cmocka_unit_test(any_number_of_threads_gives_the_same),
        cmocka_unit_test(nothing_and_single_cells_are_fine),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
