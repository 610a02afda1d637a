/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Noise has Blender's values: tests/data/noise.txt is what its Noise Texture gives, as
 * tests/addon/test_texture.py checks. */
#include "scene/noise.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

/* Rows of the file: dimensions; x, y, z, w; detail, roughness, distortion; Fac, Color. */
enum { COLUMNS = 12 };

static void values_are_blender_s(void **state)
{
    (void)state;
    FILE *file = fopen(TEST_DATA "/noise.txt", "r");
    assert_non_null(file);
    float row[COLUMNS], worst = 0.0f;
    int rows = 0, seen[5] = {0}, read;
    do {
        for (read = 0; read < COLUMNS && fscanf(file, "%f", &row[read]) == 1; ++read)
            ;
        if (read < COLUMNS)
            break;
        const int dimensions = (int)row[0];
        const struct noise noise = {.dimensions = dimensions,
                                    .normalized = true,
                                    .detail = row[5],
                                    .roughness = row[6],
                                    .lacunarity = 2.0f,
                                    .distortion = row[7]};
        const float at[4] = {dimensions > 1 ? row[1] : row[4], row[2], row[3], row[4]};
        float color[3], fac[3];
        noise_at(&noise, at, true, color);
        noise_at(&noise, at, false, fac);
        for (int c = 0; c < 3; ++c) {
            worst = fmaxf(worst, fabsf(color[c] - row[9 + c]));
            assert_true(fac[c] == color[0]);
        }
        worst = fmaxf(worst, fabsf(fac[0] - row[8]));
        ++seen[dimensions];
        ++rows;
    } while (read == COLUMNS);
    fclose(file);
    for (int dimensions = 1; dimensions <= 4; ++dimensions)
        assert_true(seen[dimensions] >= 20);
    if (!(worst < 1e-4f)) /* a float's rounding of the place, 2^6 times as large in the last octave */
        fail_msg("of %d rows the worst is %g off", rows, (double)worst);
}

static const struct noise plain = {
    .dimensions = 3, .normalized = true, .detail = 2.0f, .roughness = 0.5f, .lacunarity = 2.0f};

static void octaves_fade_in(void **state)
{
    (void)state;
    const float at[4] = {0.3f, 1.7f, -2.2f};
    float before[3], after[3], found[3];
    struct noise noise = plain;
    noise_at(&noise, at, false, before);
    noise.detail = 3.0f;
    noise_at(&noise, at, false, after);
    noise.detail = 2.25f;
    noise_at(&noise, at, false, found);
    assert_float_equal(found[0], 0.75f * before[0] + 0.25f * after[0], 1e-6f);
    noise.roughness = 0.0f; /* octaves that add nothing */
    noise_at(&noise, at, false, after);
    noise.detail = 0.0f;
    noise_at(&noise, at, false, before);
    assert_float_equal(after[0], before[0], 1e-6f);
}

/* Sums of octaves, as Blender's Musgrave Texture and its noise without normalization. */
static void what_is_not_normalized_is_the_sum(void **state)
{
    (void)state;
    const float at[4] = {0.3f, 1.7f, -2.2f}, doubled[4] = {0.6f, 3.4f, -4.4f};
    float one[3], two[3], both[3];
    struct noise noise = plain;
    noise.normalized = false;
    noise.detail = 0.0f;
    noise_at(&noise, at, false, one);
    noise_at(&noise, doubled, false, two);
    noise.detail = 1.0f;
    noise.roughness = 0.7f;
    noise_at(&noise, at, false, both);
    assert_float_equal(both[0], one[0] + 0.7f * two[0], 1e-6f);
}

static void odd_points_and_settings_stay_finite(void **state)
{
    (void)state;
    static const float odd[] = {0.0f, 1e-30f, 1e30f, -1e30f, INFINITY, NAN, 99999.99f, -0.0f};
    for (int dimensions = 1; dimensions <= 4; ++dimensions)
        for (size_t i = 0; i < sizeof odd / sizeof *odd; ++i)
            for (size_t k = 0; k < sizeof odd / sizeof *odd; ++k) {
                const float at[4] = {odd[i], odd[k], 0.5f, odd[i]};
                struct noise noise = plain;
                noise.dimensions = dimensions;
                float out[3];
                noise_at(&noise, at, true, out);
                for (int c = 0; c < 3; ++c)
                    assert_true(isfinite(out[c]));
                noise.detail = odd[i]; /* must return; what of, is the medium's to check */
                noise.lacunarity = odd[k];
                noise.distortion = odd[i];
                noise_at(&noise, at, true, out);
            }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_are_blender_s),
        cmocka_unit_test(octaves_fade_in),
        cmocka_unit_test(what_is_not_normalized_is_the_sum),
        cmocka_unit_test(odd_points_and_settings_stay_finite),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
