/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Places in a lens: spread evenly over its opening, whatever its shape, from the middle on. */
#include "render/lens.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#define RADIUS 0.02f
#define COUNT 255

struct moments {
    double mean[2], square[2], product, most;
};

/* In radii. */
static struct moments moments_of(const brume_lens *lens, uint32_t count)
{
    struct moments m = {0};
    for (uint32_t index = 0; index < count; ++index) {
        float offset[2];
        lens_offset(lens, index, count, offset);
        const double x = (double)(offset[0] / RADIUS), y = (double)(offset[1] / RADIUS);
        m.mean[0] += x / count;
        m.mean[1] += y / count;
        m.square[0] += x * x / count;
        m.square[1] += y * y / count;
        m.product += x * y / count;
        m.most = fmax(m.most, hypot(x, y));
    }
    return m;
}

static void assert_near(double value, double wanted, double tolerance)
{
    if (!(fabs(value - wanted) <= tolerance))
        fail_msg("%g instead of %g", value, wanted);
}

/* Mean squares along an axis, by their closed forms: a quarter in the unit disk; in a regular polygon
 * (1 + 2 cos^2(pi / n)) / 12. */
static void fills_its_opening(void **state)
{
    (void)state;
    static const uint32_t blades[] = {0, 3, 4, 6, 9};
    for (size_t i = 0; i < sizeof blades / sizeof *blades; ++i) {
        const brume_lens lens = {.radius = RADIUS, .focus = 1, .blades = blades[i]};
        const struct moments m = moments_of(&lens, COUNT);
        const double c = blades[i] ? cos(3.14159265358979 / blades[i]) : 1.0;
        const double wanted = blades[i] ? (1.0 + 2.0 * c * c) / 12.0 : 0.25;
        for (int axis = 0; axis < 2; ++axis) {
            assert_near(m.mean[axis], 0.0, 0.01);
            assert_near(m.square[axis], wanted, 0.03 * wanted);
        }
        assert_near(m.product, 0.0, 0.005);
        assert_true(m.most <= 1.0 && m.most > 0.9);
    }
}

/* Few samples are not aside of the middle by more than a sixth of the radius, and the first picture
 * is nearly that of the middle. */
static void few_stand_for_all(void **state)
{
    (void)state;
    static const uint32_t counts[] = {1, 4, 8, 12, 16, 64};
    const brume_lens lens = {.radius = RADIUS, .focus = 1};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; ++i) {
        float first[2];
        const struct moments m = moments_of(&lens, counts[i]);
        assert_true(hypot(m.mean[0], m.mean[1]) < 1.0 / 6.0);
        lens_offset(&lens, 0, counts[i], first);
        assert_true(hypot((double)first[0], (double)first[1]) <=
                    (counts[i] > 1 ? 1.001 * (double)RADIUS * sqrt(0.5 / counts[i]) : 0.0));
    }
}

/* The ratio makes it narrower, and turns nothing: blades are turned first. */
static void has_a_shape(void **state)
{
    (void)state;
    const brume_lens wide = {.radius = RADIUS, .focus = 1, .ratio = 2};
    const struct moments m = moments_of(&wide, COUNT);
    assert_near(m.square[0], 0.25 / 4.0, 0.003);
    assert_near(m.square[1], 0.25, 0.01);
    /* A triangle has its corner where its blades are turned to: mean of the cubed way there. */
    const brume_lens turned = {.radius = RADIUS, .focus = 1, .blades = 3, .rotation = 0.5f};
    double cubes[2] = {0};
    for (uint32_t index = 0; index < COUNT; ++index) {
        float offset[2];
        lens_offset(&turned, index, COUNT, offset);
        for (int k = 0; k < 2; ++k) { /* to the first corner, 60 degrees from the side, and back */
            const double angle = 0.5 + 3.14159265358979 / 3.0 + k * 3.14159265358979;
            const double way = ((double)offset[0] * cos(angle) + (double)offset[1] * sin(angle)) /
                               (double)RADIUS;
            cubes[k] += way * way * way / COUNT;
        }
    }
    /* Of an equilateral triangle of circumradius 1: 1/40 to 1/10 by axis. */
    assert_near(cubes[0], 1.0 / 40.0, 0.004);
    assert_near(cubes[1], -1.0 / 40.0, 0.004);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fills_its_opening),
        cmocka_unit_test(few_stand_for_all),
        cmocka_unit_test(has_a_shape),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
