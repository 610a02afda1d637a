/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Volume programs: every op against its definition, black bodies against published colours, results
 * that transport can bear, and ill-formed programs refused by name. */
#include "base/result.h"
#include "scene/volume_program.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define PI 3.14159265358979f

/* --- Ops ---------------------------------------------------------------------------------- */

/* Runs op on constants and reads the result from emission, offset so that negative ones show. */
static void run_op(uint32_t op, const float a[3], const float b[3], const float c[3], float out[3])
{
    const float offset = 1000.0f;
    brume_instruction code[8] = {
        {.op = BRUME_OP_CONSTANT, .dst = 10, .value = {a[0], a[1], a[2]}},
        {.op = BRUME_OP_CONSTANT, .dst = 11, .value = {b[0], b[1], b[2]}},
        {.op = BRUME_OP_CONSTANT, .dst = 12, .value = {c[0], c[1], c[2]}},
        {.op = op, .dst = 13, .a = 10, .b = 11, .c = 12, .value = {3, 1, 1}}, /* of NOISE */
        {.op = BRUME_OP_CONSTANT, .dst = 0, .value = {offset, offset, offset}},
        {.op = BRUME_OP_ADD, .dst = 1, .a = 0, .b = 13},
        {.op = BRUME_OP_CONSTANT, .dst = 2},
    };
    const brume_volume_program source = {.instructions = code,
                                         .instruction_count = 7,
                                         .sigma_s = 2,
                                         .sigma_a = 2,
                                         .g = 2,
                                         .emission = 1};
    struct volume_program program;
    assert_int_equal(volume_program_init(&program, &source, 0, "ops"), BRUME_OK);
    struct medium_sample sample;
    volume_program_run(&program, NULL, NULL, 1, &sample);
    for (int i = 0; i < 3; ++i)
        out[i] = sample.emission[i] - offset;
    volume_program_finish(&program);
}

static void expect_op(uint32_t op, float a, float b, float c, float expected)
{
    const float as[3] = {a, a, a}, bs[3] = {b, b, b}, cs[3] = {c, c, c};
    float out[3];
    run_op(op, as, bs, cs, out);
    for (int i = 0; i < 3; ++i)
        if (!(fabsf(out[i] - expected) <= 3e-4f))
            fail_msg("op %u of (%g, %g, %g) is %g, expected %g", op, a, b, c, out[i], expected);
}

static void ops_compute_what_blender_does(void **state)
{
    (void)state;
    const struct {
        uint32_t op;
        float a, b, c, expected;
    } cases[] = {
        {BRUME_OP_ADD, 2, 3, 0, 5},
        {BRUME_OP_SUBTRACT, 2, 3, 0, -1},
        {BRUME_OP_MULTIPLY, 2, -3, 0, -6},
        {BRUME_OP_DIVIDE, 3, 2, 0, 1.5f},
        {BRUME_OP_DIVIDE, 3, 0, 0, 0},
        {BRUME_OP_MULTIPLY_ADD, 2, 3, 4, 10},
        {BRUME_OP_POWER, 2, 3, 0, 8},
        {BRUME_OP_POWER, 2, -1, 0, 0.5f},
        {BRUME_OP_POWER, -2, 3, 0, -8},
        {BRUME_OP_POWER, -2, 0.5f, 0, 0},
        {BRUME_OP_POWER, 0, -1, 0, 0},
        {BRUME_OP_POWER, 0, 0, 0, 1},
        {BRUME_OP_POWER, 0, 2, 0, 0},
        {BRUME_OP_LOGARITHM, 8, 2, 0, 3},
        {BRUME_OP_LOGARITHM, 0, 2, 0, 0},
        {BRUME_OP_LOGARITHM, -1, 2, 0, 0},
        {BRUME_OP_LOGARITHM, 8, 0, 0, 0},
        {BRUME_OP_LOGARITHM, 8, 1, 0, 0},
        {BRUME_OP_SQRT, 9, 0, 0, 3},
        {BRUME_OP_SQRT, -9, 0, 0, 0},
        {BRUME_OP_INVERSE_SQRT, 4, 0, 0, 0.5f},
        {BRUME_OP_INVERSE_SQRT, 0, 0, 0, 0},
        {BRUME_OP_INVERSE_SQRT, -4, 0, 0, 0},
        {BRUME_OP_ABSOLUTE, -4, 0, 0, 4},
        {BRUME_OP_EXPONENT, 1, 0, 0, 2.7182818f},
        {BRUME_OP_MINIMUM, 2, -3, 0, -3},
        {BRUME_OP_MAXIMUM, 2, -3, 0, 2},
        {BRUME_OP_LESS, 1, 2, 0, 1},
        {BRUME_OP_LESS, 2, 2, 0, 0},
        {BRUME_OP_GREATER, 2, 1, 0, 1},
        {BRUME_OP_GREATER, 2, 2, 0, 0},
        {BRUME_OP_SIGN, 3, 0, 0, 1},
        {BRUME_OP_SIGN, -3, 0, 0, -1},
        {BRUME_OP_SIGN, 0, 0, 0, 0},
        {BRUME_OP_COMPARE, 1, 1.2f, 0.3f, 1},
        {BRUME_OP_COMPARE, 1, 1.4f, 0.3f, 0},
        {BRUME_OP_COMPARE, 1, 1, -1, 1},
        {BRUME_OP_SMOOTH_MIN, 1, 2, 0, 1},
        {BRUME_OP_SMOOTH_MIN, 1, 1, 1, 1 - 1.0f / 6},
        {BRUME_OP_SMOOTH_MIN, 1, 2, 2, 1 - 0.125f * 2 / 6},
        {BRUME_OP_SMOOTH_MAX, 1, 2, 0, 2},
        {BRUME_OP_SMOOTH_MAX, 1, 2, 2, 2 + 0.125f * 2 / 6},
        {BRUME_OP_ROUND, 2.5f, 0, 0, 3},
        {BRUME_OP_ROUND, -2.5f, 0, 0, -2},
        {BRUME_OP_FLOOR, -1.5f, 0, 0, -2},
        {BRUME_OP_CEIL, -1.5f, 0, 0, -1},
        {BRUME_OP_TRUNCATE, -1.5f, 0, 0, -1},
        {BRUME_OP_TRUNCATE, 1.5f, 0, 0, 1},
        {BRUME_OP_FRACTION, -1.25f, 0, 0, 0.75f},
        {BRUME_OP_MODULO, 5.5f, 2, 0, 1.5f},
        {BRUME_OP_MODULO, -5.5f, 2, 0, -1.5f},
        {BRUME_OP_MODULO, 5.5f, 0, 0, 0},
        {BRUME_OP_WRAP, 5.5f, 3, 1, 1.5f},
        {BRUME_OP_WRAP, 0.5f, 3, 1, 2.5f},
        {BRUME_OP_WRAP, 0.5f, 3, 3, 3},
        {BRUME_OP_SNAP, 5.5f, 2, 0, 4},
        {BRUME_OP_SNAP, -0.5f, 2, 0, -2},
        {BRUME_OP_SNAP, 5.5f, 0, 0, 0},
        {BRUME_OP_PINGPONG, 2.5f, 2, 0, 1.5f},
        {BRUME_OP_PINGPONG, -0.5f, 2, 0, 0.5f},
        {BRUME_OP_PINGPONG, 2.5f, 0, 0, 0},
        {BRUME_OP_SINE, PI / 2, 0, 0, 1},
        {BRUME_OP_COSINE, PI, 0, 0, -1},
        {BRUME_OP_TANGENT, PI / 4, 0, 0, 1},
        {BRUME_OP_ARCSINE, 1, 0, 0, PI / 2},
        {BRUME_OP_ARCSINE, 1.1f, 0, 0, 0},
        {BRUME_OP_ARCCOSINE, -1, 0, 0, PI},
        {BRUME_OP_ARCCOSINE, -1.1f, 0, 0, 0},
        {BRUME_OP_ARCTANGENT, 1, 0, 0, PI / 4},
        {BRUME_OP_ARCTANGENT2, 1, -1, 0, 0.75f * PI},
        {BRUME_OP_ARCTANGENT2, 0, 0, 0, 0},
        {BRUME_OP_HYPERBOLIC_SINE, 1, 0, 0, 1.1752012f},
        {BRUME_OP_HYPERBOLIC_COSINE, 1, 0, 0, 1.5430806f},
        {BRUME_OP_HYPERBOLIC_TANGENT, 1, 0, 0, 0.7615942f},
        {BRUME_OP_CLAMP01, -1, 0, 0, 0},
        {BRUME_OP_CLAMP01, 0.25f, 0, 0, 0.25f},
        {BRUME_OP_CLAMP01, 7, 0, 0, 1},
        {BRUME_OP_MIX, 2, 4, 0.25f, 2.5f},
        {BRUME_OP_MIX, 2, 4, 2, 6},
        {BRUME_OP_SMOOTHSTEP, 0.25f, 0, 0, 0.15625f},
        {BRUME_OP_SMOOTHSTEP, 2, 0, 0, 1},
        {BRUME_OP_SMOOTHERSTEP, 0.25f, 0, 0, 0.103515625f},
        {BRUME_OP_SMOOTHERSTEP, -2, 0, 0, 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i)
        expect_op(cases[i].op, cases[i].a, cases[i].b, cases[i].c, cases[i].expected);
}

static void ops_across_components(void **state)
{
    (void)state;
    const float a[3] = {1, 2, 6}, b[3] = {10, 20, 30}, c[3] = {100, 200, 300};
    float out[3];
    run_op(BRUME_OP_AVERAGE, a, b, c, out);
    assert_float_equal(out[1], 3.0f, 3e-4f);
    run_op(BRUME_OP_LUMINANCE, a, b, c, out);
    assert_float_equal(out[2], 0.2126f + 2 * 0.7152f + 6 * 0.0722f, 3e-4f);
    run_op(BRUME_OP_COMBINE, a, b, c, out);
    assert_float_equal(out[0], 1.0f, 3e-4f);
    assert_float_equal(out[1], 10.0f, 3e-4f);
    assert_float_equal(out[2], 100.0f, 3e-4f);
    run_op(BRUME_OP_MULTIPLY, a, b, c, out);
    assert_float_equal(out[0], 10.0f, 3e-4f);
    assert_float_equal(out[1], 40.0f, 3e-4f);
    assert_float_equal(out[2], 180.0f, 3e-4f);
}

/* Ops may write the register that they read, also across components. */
static void a_register_may_be_both_ends(void **state)
{
    (void)state;
    const brume_instruction code[] = {
        {.op = BRUME_OP_GRID, .dst = 0, .a = 0},
        {.op = BRUME_OP_COMPONENT, .dst = 1, .a = 0, .b = 2},
        {.op = BRUME_OP_COMBINE, .dst = 0, .a = 1, .b = 0, .c = 0},
        {.op = BRUME_OP_COMPONENT, .dst = 1, .a = 1, .b = 0},
        {.op = BRUME_OP_ADD, .dst = 0, .a = 0, .b = 0},
        {.op = BRUME_OP_LUMINANCE, .dst = 1, .a = 1},
        {.op = BRUME_OP_CONSTANT, .dst = 2},
    };
    const brume_volume_program source = {.instructions = code,
                                         .instruction_count = 7,
                                         .sigma_s = 0,
                                         .sigma_a = 1,
                                         .g = 2,
                                         .emission = 2};
    struct volume_program program;
    assert_int_equal(volume_program_init(&program, &source, 1, "x"), BRUME_OK);
    /* More cells than a block, and not a multiple of it. */
    enum { COUNT = 211 };
    static float grid[COUNT * 3];
    static struct medium_sample samples[COUNT];
    for (int i = 0; i < COUNT * 3; ++i)
        grid[i] = (float)i;
    const float *grids[1] = {grid};
    volume_program_run(&program, grids, NULL, COUNT, samples);
    for (int i = 0; i < COUNT; ++i) {
        const float x = (float)(3 * i), z = x + 2;
        assert_float_equal(samples[i].sigma_s[0], 2 * z, 1e-3f);
        assert_float_equal(samples[i].sigma_s[1], 2 * x, 1e-3f);
        assert_float_equal(samples[i].sigma_s[2], 2 * x, 1e-3f);
        assert_float_equal(samples[i].sigma_a[1], z, 1e-3f);
    }
    /* A grid that is not there reads 0. */
    grids[0] = NULL;
    volume_program_run(&program, grids, NULL, COUNT, samples);
    assert_true(samples[COUNT - 1].sigma_s[0] == 0.0f);
    volume_program_finish(&program);
    volume_program_finish(&program);
}

static void a_ramp_is_linear_between_its_entries(void **state)
{
    (void)state;
    float ramps[2][BRUME_RAMP_SIZE][3];
    for (uint32_t i = 0; i < BRUME_RAMP_SIZE; ++i)
        for (int c = 0; c < 3; ++c) {
            ramps[0][i][c] = 77.0f;
            ramps[1][i][c] = (float)(i * i) + (float)c;
        }
    const brume_instruction code[] = {{.op = BRUME_OP_GRID, .dst = 0, .a = 0},
                                      {.op = BRUME_OP_RAMP, .dst = 0, .a = 0, .b = 1},
                                      {.op = BRUME_OP_CONSTANT, .dst = 1}};
    const brume_volume_program source = {.instructions = code,
                                         .ramps = ramps[0][0],
                                         .instruction_count = 3,
                                         .ramp_count = 2,
                                         .sigma_s = 0,
                                         .sigma_a = 1,
                                         .g = 1,
                                         .emission = 1};
    struct volume_program program;
    assert_int_equal(volume_program_init(&program, &source, 1, "x"), BRUME_OK);
    const float at[6] = {-1.0f, 0.0f, 10.25f / 255, 1.0f, 9.0f, NAN};
    const float expected[6] = {0, 0, 100 + 0.25f * 21, 65025, 65025, 0};
    float grid[18] = {0};
    for (int i = 0; i < 6; ++i)
        grid[3 * i] = at[i];
    const float *grids[1] = {grid};
    struct medium_sample samples[6];
    volume_program_run(&program, grids, NULL, 6, samples);
    for (int i = 0; i < 6; ++i)
        for (int c = 0; c < 3; ++c)
            assert_float_equal(samples[i].sigma_s[c], expected[i] + (float)c, 1e-2f);
    volume_program_finish(&program);
}

/* --- Black bodies ------------------------------------------------------------------------- */

static void blackbody(float kelvin, float out[3])
{
    const float a[3] = {kelvin, 5e4f, 5e4f}, nothing[3] = {0, 0, 0};
    run_op(BRUME_OP_BLACKBODY, a, nothing, nothing, out);
}

static void black_bodies_lie_on_the_planckian_locus(void **state)
{
    (void)state;
    /* CIE 1931 chromaticities, Wyszecki and Stiles, Color Science, table of the locus. */
    const struct {
        float kelvin, x, y;
    } cases[] = {{2000, 0.5267f, 0.4133f},
                 {4000, 0.3805f, 0.3768f},
                 {6500, 0.3135f, 0.3237f},
                 {10000, 0.2807f, 0.2884f}};
    for (int i = 0; i < 4; ++i) {
        float rgb[3];
        blackbody(cases[i].kelvin, rgb);
        assert_float_equal(0.2126f * rgb[0] + 0.7152f * rgb[1] + 0.0722f * rgb[2], 1.0f, 1e-3f);
        const float x = 0.4124564f * rgb[0] + 0.3575761f * rgb[1] + 0.1804375f * rgb[2];
        const float y = 0.2126729f * rgb[0] + 0.7151522f * rgb[1] + 0.0721750f * rgb[2];
        const float z = 0.0193339f * rgb[0] + 0.1191920f * rgb[1] + 0.9503041f * rgb[2];
        assert_float_equal(x / (x + y + z), cases[i].x, 5e-4f);
        assert_float_equal(y / (x + y + z), cases[i].y, 5e-4f);
    }
}

static void black_bodies_beyond_the_table_stay(void **state)
{
    (void)state;
    /* What Cycles gives below 800 K and above 12000 K; it leaves the negative parts alone. */
    const float coldest[3] = {5.413294f, -0.203194f, -0.082254f};
    const float hottest[3] = {0.826295f, 0.994508f, 1.566308f};
    const float cold[4] = {-300.0f, 0.0f, 500.0f, 800.0f}, hot[3] = {12000.0f, 3e4f, 1e30f};
    for (int i = 0; i < 4; ++i) {
        float rgb[3];
        blackbody(cold[i], rgb);
        for (int c = 0; c < 3; ++c)
            assert_float_equal(rgb[c], coldest[c], 1e-3f);
    }
    for (int i = 0; i < 3; ++i) {
        float rgb[3];
        blackbody(hot[i], rgb);
        for (int c = 0; c < 3; ++c)
            assert_float_equal(rgb[c], hottest[c], 1e-3f);
    }
}

/* --- Results ------------------------------------------------------------------------------ */

static void results_are_what_transport_can_bear(void **state)
{
    (void)state;
    const float bad[4] = {NAN, INFINITY, -INFINITY, -1.0f};
    const float g_in[6] = {NAN, INFINITY, -INFINITY, 0.5f, 1.0f, -1.0f};
    const float g_out[6] = {0.0f, 0.99f, -0.99f, 0.5f, 0.99f, -0.99f};
    const brume_instruction code[] = {{.op = BRUME_OP_GRID, .dst = 0, .a = 0},
                                      {.op = BRUME_OP_GRID, .dst = 1, .a = 1}};
    const brume_volume_program source = {.instructions = code,
                                         .instruction_count = 2,
                                         .sigma_s = 0,
                                         .sigma_a = 0,
                                         .g = 1,
                                         .emission = 0};
    struct volume_program program;
    assert_int_equal(volume_program_init(&program, &source, 2, "x"), BRUME_OK);
    float values[18], gs[18];
    for (int i = 0; i < 6; ++i) {
        values[3 * i] = 1.0f;
        values[3 * i + 1] = bad[i % 4];
        values[3 * i + 2] = 3.0f;
        gs[3 * i] = gs[3 * i + 1] = gs[3 * i + 2] = g_in[i];
    }
    const float *grids[2] = {values, gs};
    struct medium_sample samples[6];
    volume_program_run(&program, grids, NULL, 6, samples);
    for (int i = 0; i < 6; ++i) {
        const float *results[3] = {samples[i].sigma_s, samples[i].sigma_a, samples[i].emission};
        for (int r = 0; r < 3; ++r) {
            assert_true(results[r][0] == 1.0f);
            assert_true(results[r][1] == 0.0f);
            assert_true(results[r][2] == 3.0f);
        }
        assert_true(samples[i].g == g_out[i]);
    }
    volume_program_finish(&program);
}

/* No op crashes or raises on any mix of awkward numbers. */
static void awkward_numbers_do_no_harm(void **state)
{
    (void)state;
    const float awkward[9] = {0.0f, -0.0f, 1e38f, -1e38f, 1e-42f, NAN, INFINITY, -INFINITY, 2.5f};
    for (uint32_t op = 2; op < BRUME_OP_COUNT; ++op) {
        if (op == BRUME_OP_RAMP || op == BRUME_OP_COMPONENT || op == BRUME_OP_POSITION)
            continue; /* their a or b is a number */
        for (int i = 0; i < 729; ++i) {
            const float a[3] = {awkward[i % 9], awkward[i % 9], 1.0f};
            const float b[3] = {awkward[i / 9 % 9], awkward[i / 9 % 9], 1.0f};
            const float c[3] = {awkward[i / 81], awkward[i / 81], 1.0f};
            float out[3];
            run_op(op, a, b, c, out);
            for (int k = 0; k < 3; ++k)
                assert_true(isfinite(out[k]) && out[k] >= -1000.0f);
        }
    }
}

/* --- Ill-formed programs ------------------------------------------------------------------ */

static void refused(const brume_volume_program *source, const char *words)
{
    struct volume_program program;
    assert_int_equal(volume_program_init(&program, source, 2, "Plume"), BRUME_E_SHADER_PROGRAM);
    assert_non_null(strstr(last_error(), "'Plume'"));
    if (!strstr(last_error(), words))
        fail_msg("'%s' is not in: %s", words, last_error());
    volume_program_finish(&program);
}

static void ill_formed_programs_are_refused_by_name(void **state)
{
    (void)state;
    brume_instruction code[3] = {{.op = BRUME_OP_CONSTANT, .dst = 0},
                                 {.op = BRUME_OP_ADD, .dst = 1, .a = 0, .b = 0},
                                 {.op = BRUME_OP_CONSTANT, .dst = 2}};
    const brume_volume_program good = {.instructions = code,
                                       .instruction_count = 3,
                                       .sigma_s = 0,
                                       .sigma_a = 1,
                                       .g = 2,
                                       .emission = 0};
    struct volume_program program;
    assert_int_equal(volume_program_init(&program, &good, 2, NULL), BRUME_OK);
    volume_program_finish(&program);

    const struct {
        brume_instruction instruction;
        const char *words;
    } cases[] = {
        {{.op = BRUME_OP_COUNT, .dst = 1}, "instruction 1 has the unknown op 52"},
        {{.op = UINT32_MAX, .dst = 1}, "instruction 1"},
        {{.op = BRUME_OP_ADD, .dst = 64}, "instruction 1 (ADD) writes register 64"},
        {{.op = BRUME_OP_ADD, .dst = 1, .a = 64}, "instruction 1 (ADD) names register 64"},
        {{.op = BRUME_OP_ADD, .dst = 1, .b = UINT32_MAX}, "instruction 1 (ADD) names register"},
        {{.op = BRUME_OP_ADD, .dst = 1, .b = 5}, "instruction 1 (ADD) reads register 5"},
        {{.op = BRUME_OP_ADD, .dst = 1, .b = 2}, "instruction 1 (ADD) reads register 2"},
        {{.op = BRUME_OP_MIX, .dst = 1, .c = 1}, "instruction 1 (MIX) reads register 1"},
        {{.op = BRUME_OP_GRID, .dst = 1, .a = 2}, "instruction 1 (GRID) names grid 2 of 2"},
        {{.op = BRUME_OP_RAMP, .dst = 1, .b = 0}, "instruction 1 (RAMP) names ramp 0 of 0"},
        {{.op = BRUME_OP_COMPONENT, .dst = 1, .b = 3}, "component 3"},
        {{.op = BRUME_OP_POSITION, .dst = 1, .a = 3}, "(POSITION) names space 3 of 3"},
        {{.op = BRUME_OP_POSITION, .dst = 1, .a = UINT32_MAX}, "names space"},
        {{.op = BRUME_OP_NOISE, .dst = 1, .value = {0, 1, 0}}, "(NOISE) has 0 dimensions"},
        {{.op = BRUME_OP_NOISE, .dst = 1, .value = {5, 1, 0}}, "(NOISE) has 5 dimensions"},
        {{.op = BRUME_OP_NOISE, .dst = 1, .value = {2.5f, 1, 0}}, "(NOISE) has 2.5 dimensions"},
        {{.op = BRUME_OP_NOISE, .dst = 1, .value = {NAN, 1, 0}}, "(NOISE) has"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        code[1] = cases[i].instruction;
        refused(&good, cases[i].words);
    }
    code[1] = (brume_instruction){.op = BRUME_OP_GRID, .dst = 1, .a = 1};
    assert_int_equal(volume_program_init(&program, &good, 2, "x"), BRUME_OK);
    volume_program_finish(&program);

    brume_volume_program bad = good;
    bad.sigma_s = 64;
    refused(&bad, "sigma_s names register 64");
    bad = good;
    bad.sigma_a = 3;
    refused(&bad, "sigma_a reads register 3");
    bad = good;
    bad.g = 9;
    refused(&bad, "the result g");
    bad = good;
    bad.emission = 63;
    refused(&bad, "emission reads register 63");
    bad = (brume_volume_program){0};
    refused(&bad, "sigma_s");
    bad.instruction_count = 1;
    refused(&bad, "instructions are missing");
    bad = good;
    bad.ramp_count = 1;
    refused(&bad, "ramps are missing");
    bad.ramp_count = UINT32_MAX;
    refused(&bad, "ramps");
    float ramps[2 * BRUME_RAMP_SIZE * 3] = {0};
    ramps[BRUME_RAMP_SIZE * 3 + 5] = INFINITY;
    bad.ramp_count = 2;
    bad.ramps = ramps;
    refused(&bad, "ramp 1");
}

static void programs_have_a_limit(void **state)
{
    (void)state;
    static brume_instruction code[4097]; /* zeros: constants into register 0 */
    brume_volume_program source = {.instructions = code, .instruction_count = 4096};
    struct volume_program program;
    assert_int_equal(volume_program_init(&program, &source, 0, "x"), BRUME_OK);
    struct medium_sample sample;
    volume_program_run(&program, NULL, NULL, 1, &sample);
    assert_true(sample.sigma_s[0] == 0.0f);
    volume_program_finish(&program);
    source.instruction_count = 4097;
    refused(&source, "4097");
    source.instruction_count = UINT32_MAX;
    refused(&source, "4294967295");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ops_compute_what_blender_does),
        cmocka_unit_test(ops_across_components),
        cmocka_unit_test(a_register_may_be_both_ends),
        cmocka_unit_test(a_ramp_is_linear_between_its_entries),
        cmocka_unit_test(black_bodies_lie_on_the_planckian_locus),
        cmocka_unit_test(black_bodies_beyond_the_table_stay),
        cmocka_unit_test(results_are_what_transport_can_bear),
        cmocka_unit_test(awkward_numbers_do_no_harm),
        cmocka_unit_test(ill_formed_programs_are_refused_by_name),
        cmocka_unit_test(programs_have_a_limit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
