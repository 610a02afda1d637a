/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A pixel's samples: spread as the filter is, and with their middle in the pixel's. */
#include "render/filter.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#define WIDTH 1.5f

/* Variance of the Blackman-Harris window over [-1/2, 1/2], by its closed form: 1/12 and terms
 * (-1)^k a_k / (2 pi^2 k^2 a_0). */
static double variance(void)
{
    static const double a[] = {0.35875, 0.48829, 0.14128, 0.01168};
    const double pi = 3.14159265358979323846;
    double sum = a[0] / 12.0;
    for (int k = 1; k < 4; ++k)
        sum += (k % 2 ? -1.0 : 1.0) * a[k] / (2.0 * pi * pi * k * k);
    return sum / a[0] * (2.0 * WIDTH) * (2.0 * WIDTH);
}

static void shifts_nothing(void **state)
{
    (void)state;
    static const uint32_t counts[] = {1, 3, 4, 7, 8, 16, 64, 255};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; ++i) {
        double mean[2] = {0.0};
        for (uint32_t index = 0; index < counts[i]; ++index) {
            float offset[2];
            filter_offset(index, counts[i], WIDTH, offset);
            if (index == 0)
                assert_true(fabsf(offset[0]) < 1e-4f && fabsf(offset[1]) < 1e-4f);
            mean[0] += offset[0];
            mean[1] += offset[1];
        }
        for (int axis = 0; axis < 2; ++axis)
            assert_true(fabs(mean[axis]) / counts[i] < 1e-4);
    }
}

static void is_as_wide_as_the_filter(void **state)
{
    (void)state;
    double square[2] = {0.0};
    for (uint32_t index = 0; index < 255; ++index) {
        float offset[2];
        filter_offset(index, 255, WIDTH, offset);
        for (int axis = 0; axis < 2; ++axis) {
            assert_true(fabsf(offset[axis]) <= WIDTH);
            square[axis] += (double)offset[axis] * (double)offset[axis];
        }
    }
    for (int axis = 0; axis < 2; ++axis)
        assert_true(fabs(square[axis] / 255.0 / variance() - 1.0) < 0.03);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shifts_nothing),
        cmocka_unit_test(is_as_wide_as_the_filter),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
