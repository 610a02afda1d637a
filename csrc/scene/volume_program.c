/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Volume shader programs: checked once, then interpreted over blocks of cells, so that choosing the
 * instruction costs little beside doing it. Any thread. */
#include "scene/volume_program.h"
#include "base/result.h"
#include "scene/noise.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    BLOCK = 64, /* cells; all registers of a block take 48 KiB of stack */
    MAX_INSTRUCTIONS = 4096
};

/* How many of a, b, c are registers, in this order; what is no register is a number or unused. */
static const struct {
    const char *name;
    uint32_t registers;
} ops[BRUME_OP_COUNT] = {
    [BRUME_OP_CONSTANT] = {"CONSTANT", 0},
    [BRUME_OP_GRID] = {"GRID", 0},
    [BRUME_OP_ADD] = {"ADD", 2},
    [BRUME_OP_SUBTRACT] = {"SUBTRACT", 2},
    [BRUME_OP_MULTIPLY] = {"MULTIPLY", 2},
    [BRUME_OP_DIVIDE] = {"DIVIDE", 2},
    [BRUME_OP_MULTIPLY_ADD] = {"MULTIPLY_ADD", 3},
    [BRUME_OP_POWER] = {"POWER", 2},
    [BRUME_OP_LOGARITHM] = {"LOGARITHM", 2},
    [BRUME_OP_SQRT] = {"SQRT", 1},
    [BRUME_OP_INVERSE_SQRT] = {"INVERSE_SQRT", 1},
    [BRUME_OP_ABSOLUTE] = {"ABSOLUTE", 1},
    [BRUME_OP_EXPONENT] = {"EXPONENT", 1},
    [BRUME_OP_MINIMUM] = {"MINIMUM", 2},
    [BRUME_OP_MAXIMUM] = {"MAXIMUM", 2},
    [BRUME_OP_LESS] = {"LESS", 2},
    [BRUME_OP_GREATER] = {"GREATER", 2},
    [BRUME_OP_SIGN] = {"SIGN", 1},
    [BRUME_OP_COMPARE] = {"COMPARE", 3},
    [BRUME_OP_SMOOTH_MIN] = {"SMOOTH_MIN", 3},
    [BRUME_OP_SMOOTH_MAX] = {"SMOOTH_MAX", 3},
    [BRUME_OP_ROUND] = {"ROUND", 1},
    [BRUME_OP_FLOOR] = {"FLOOR", 1},
    [BRUME_OP_CEIL] = {"CEIL", 1},
    [BRUME_OP_TRUNCATE] = {"TRUNCATE", 1},
    [BRUME_OP_FRACTION] = {"FRACTION", 1},
    [BRUME_OP_MODULO] = {"MODULO", 2},
    [BRUME_OP_WRAP] = {"WRAP", 3},
    [BRUME_OP_SNAP] = {"SNAP", 2},
    [BRUME_OP_PINGPONG] = {"PINGPONG", 2},
    [BRUME_OP_SINE] = {"SINE", 1},
    [BRUME_OP_COSINE] = {"COSINE", 1},
    [BRUME_OP_TANGENT] = {"TANGENT", 1},
    [BRUME_OP_ARCSINE] = {"ARCSINE", 1},
    [BRUME_OP_ARCCOSINE] = {"ARCCOSINE", 1},
    [BRUME_OP_ARCTANGENT] = {"ARCTANGENT", 1},
    [BRUME_OP_ARCTANGENT2] = {"ARCTANGENT2", 2},
    [BRUME_OP_HYPERBOLIC_SINE] = {"HYPERBOLIC_SINE", 1},
    [BRUME_OP_HYPERBOLIC_COSINE] = {"HYPERBOLIC_COSINE", 1},
    [BRUME_OP_HYPERBOLIC_TANGENT] = {"HYPERBOLIC_TANGENT", 1},
    [BRUME_OP_CLAMP01] = {"CLAMP01", 1},
    [BRUME_OP_MIX] = {"MIX", 3},
    [BRUME_OP_SMOOTHSTEP] = {"SMOOTHSTEP", 1},
    [BRUME_OP_SMOOTHERSTEP] = {"SMOOTHERSTEP", 1},
    [BRUME_OP_RAMP] = {"RAMP", 1},
    [BRUME_OP_AVERAGE] = {"AVERAGE", 1},
    [BRUME_OP_LUMINANCE] = {"LUMINANCE", 1},
    [BRUME_OP_COMPONENT] = {"COMPONENT", 1},
    [BRUME_OP_COMBINE] = {"COMBINE", 3},
    [BRUME_OP_BLACKBODY] = {"BLACKBODY", 1},
    [BRUME_OP_POSITION] = {"POSITION", 0},
    [BRUME_OP_NOISE] = {"NOISE", 3},
};

/* --- Black bodies ------------------------------------------------------------------------- */

/* CIE 1931 2 degree colour matching functions, 380 to 780 nm in steps of 5 nm, as tabulated to four
 * digits in Wyszecki and Stiles, Color Science. */
static const float cie_1931[81][3] = {
    {.0014f, .0000f, .0065f},  {.0022f, .0001f, .0105f},  {.0042f, .0001f, .0201f},
    {.0076f, .0002f, .0362f},  {.0143f, .0004f, .0679f},  {.0232f, .0006f, .1102f},
    {.0435f, .0012f, .2074f},  {.0776f, .0022f, .3713f},  {.1344f, .0040f, .6456f},
    {.2148f, .0073f, 1.0391f}, {.2839f, .0116f, 1.3856f}, {.3285f, .0168f, 1.6230f},
    {.3483f, .0230f, 1.7471f}, {.3481f, .0298f, 1.7826f}, {.3362f, .0380f, 1.7721f},
    {.3187f, .0480f, 1.7441f}, {.2908f, .0600f, 1.6692f}, {.2511f, .0739f, 1.5281f},
    {.1954f, .0910f, 1.2876f}, {.1421f, .1126f, 1.0419f}, {.0956f, .1390f, .8130f},
    {.0580f, .1693f, .6162f},  {.0320f, .2080f, .4652f},  {.0147f, .2586f, .3533f},
    {.0049f, .3230f, .2720f},  {.0024f, .4073f, .2123f},  {.0093f, .5030f, .1582f},
    {.0291f, .6082f, .1117f},  {.0633f, .7100f, .0782f},  {.1096f, .7932f, .0573f},
    {.1655f, .8620f, .0422f},  {.2257f, .9149f, .0298f},  {.2904f, .9540f, .0203f},
    {.3597f, .9803f, .0134f},  {.4334f, .9950f, .0087f},  {.5121f, 1.0000f, .0057f},
    {.5945f, .9950f, .0039f},  {.6784f, .9786f, .0027f},  {.7621f, .9520f, .0021f},
    {.8425f, .9154f, .0018f},  {.9163f, .8700f, .0017f},  {.9786f, .8163f, .0014f},
    {1.0263f, .7570f, .0011f}, {1.0567f, .6949f, .0010f}, {1.0622f, .6310f, .0008f},
    {1.0456f, .5668f, .0006f}, {1.0026f, .5030f, .0003f}, {.9384f, .4412f, .0002f},
    {.8544f, .3810f, .0002f},  {.7514f, .3210f, .0001f},  {.6424f, .2650f, .0000f},
    {.5419f, .2170f, .0000f},  {.4479f, .1750f, .0000f},  {.3608f, .1382f, .0000f},
    {.2835f, .1070f, .0000f},  {.2187f, .0816f, .0000f},  {.1649f, .0610f, .0000f},
    {.1212f, .0446f, .0000f},  {.0874f, .0320f, .0000f},  {.0636f, .0232f, .0000f},
    {.0468f, .0170f, .0000f},  {.0329f, .0119f, .0000f},  {.0227f, .0082f, .0000f},
    {.0158f, .0057f, .0000f},  {.0114f, .0041f, .0000f},  {.0081f, .0029f, .0000f},
    {.0058f, .0021f, .0000f},  {.0041f, .0015f, .0000f},  {.0029f, .0010f, .0000f},
    {.0020f, .0007f, .0000f},  {.0014f, .0005f, .0000f},  {.0010f, .0004f, .0000f},
    {.0007f, .0002f, .0000f},  {.0005f, .0002f, .0000f},  {.0003f, .0001f, .0000f},
    {.0002f, .0001f, .0000f},  {.0002f, .0001f, .0000f},  {.0001f, .0000f, .0000f},
    {.0001f, .0000f, .0000f},  {.0001f, .0000f, .0000f},  {.0000f, .0000f, .0000f},
};

/* Cycles' range; beyond it the colour stays. Ten kelvin a step keep linear interpolation within
 * 2e-4 of the integral at the red end, where it bends most. */
#define COLDEST 800.0f
#define HOTTEST 12000.0f
#define KELVIN_STEP 10.0f
enum { BLACKBODY_STEPS = 1120 };

static float blackbody_table[BLACKBODY_STEPS + 1][3];
static pthread_once_t blackbody_once = PTHREAD_ONCE_INIT;

/* Planck's law against the matching functions, then to Rec.709 primaries with its D65 white. Cool
 * bodies lie outside the gamut; like Cycles we leave their negative green and blue alone. */
static void blackbody_fill(void)
{
    static const double rgb_from_xyz[3][3] = {{3.2404542, -1.5371385, -0.4985314},
                                              {-0.9692660, 1.8760108, 0.0415560},
                                              {0.0556434, -0.2040259, 1.0572252}};
    const double c2 = 1.4387769e-2; /* m K, second radiation constant */
    for (int step = 0; step <= BLACKBODY_STEPS; ++step) {
        const double kelvin = COLDEST + step * KELVIN_STEP;
        double xyz[3] = {0.0, 0.0, 0.0};
        for (int i = 0; i < 81; ++i) {
            const double metres = (380 + 5 * i) * 1e-9;
            const double radiance = pow(metres * 1e9, -5.0) / expm1(c2 / (metres * kelvin));
            for (int c = 0; c < 3; ++c)
                xyz[c] += radiance * cie_1931[i][c];
        }
        for (int c = 0; c < 3; ++c)
            blackbody_table[step][c] =
                (float)((rgb_from_xyz[c][0] * xyz[0] + rgb_from_xyz[c][1] * xyz[1] +
                         rgb_from_xyz[c][2] * xyz[2]) /
                        xyz[1]);
    }
}

/* The table of count rgb entries at a position counted in entries; NaN reads the first. */
static void table_lookup(const float *table, int count, float position, float out[3])
{
    if (!(position > 0.0f))
        position = 0.0f;
    if (position > (float)(count - 1))
        position = (float)(count - 1);
    int entry = (int)position;
    if (entry > count - 2)
        entry = count - 2;
    const float part = position - (float)entry;
    const float *low = table + 3 * entry;
    for (int c = 0; c < 3; ++c)
        out[c] = low[c] + (low[c + 3] - low[c]) * part;
}

/* --- Check and copy ----------------------------------------------------------------------- */

static brume_result check_register(uint32_t number, uint64_t written, const char *what,
                                   const char *volume_name)
{
    if (number >= BRUME_REGISTERS)
        return fail(BRUME_E_SHADER_PROGRAM,
                    "volume '%s': %s names register %u, but there are only %u", volume_name, what,
                    number, BRUME_REGISTERS);
    if (!(written >> number & 1u))
        return fail(BRUME_E_SHADER_PROGRAM,
                    "volume '%s': %s reads register %u, which nothing has written", volume_name,
                    what, number);
    return BRUME_OK;
}

static brume_result check_instruction(const brume_volume_program *program, uint32_t index,
                                      uint32_t grid_count, uint64_t *written,
                                      const char *volume_name)
{
    const brume_instruction *instruction = &program->instructions[index];
    if (instruction->op >= BRUME_OP_COUNT)
        return fail(BRUME_E_SHADER_PROGRAM, "volume '%s': instruction %u has the unknown op %u",
                    volume_name, index, instruction->op);
    const char *name = ops[instruction->op].name;
    char what[64];
    snprintf(what, sizeof what, "instruction %u (%s)", index, name);

    const uint32_t operands[3] = {instruction->a, instruction->b, instruction->c};
    for (uint32_t i = 0; i < ops[instruction->op].registers; ++i)
        TRY(check_register(operands[i], *written, what, volume_name));
    if (instruction->op == BRUME_OP_GRID && instruction->a >= grid_count)
        return fail(BRUME_E_SHADER_PROGRAM, "volume '%s': %s names grid %u of %u", volume_name,
                    what, instruction->a, grid_count);
    if (instruction->op == BRUME_OP_RAMP && instruction->b >= program->ramp_count)
        return fail(BRUME_E_SHADER_PROGRAM, "volume '%s': %s names ramp %u of %u", volume_name,
                    what, instruction->b, program->ramp_count);
    if (instruction->op == BRUME_OP_COMPONENT && instruction->b >= 3)
        return fail(BRUME_E_SHADER_PROGRAM, "volume '%s': %s names component %u of 3", volume_name,
                    what, instruction->b);
    if (instruction->op == BRUME_OP_POSITION && instruction->a >= BRUME_SPACE_COUNT)
        return fail(BRUME_E_SHADER_PROGRAM, "volume '%s': %s names space %u of %d", volume_name,
                    what, instruction->a, BRUME_SPACE_COUNT);
    const float dimensions = instruction->value[0];
    if (instruction->op == BRUME_OP_NOISE &&
        !(dimensions >= 1.0f && dimensions <= 4.0f && dimensions == truncf(dimensions)))
        return fail(BRUME_E_SHADER_PROGRAM, "volume '%s': %s has %g dimensions, not 1 to 4",
                    volume_name, what, (double)dimensions);
    if (instruction->dst >= BRUME_REGISTERS)
        return fail(BRUME_E_SHADER_PROGRAM,
                    "volume '%s': %s writes register %u, but there are only %u", volume_name, what,
                    instruction->dst, BRUME_REGISTERS);
    *written |= UINT64_C(1) << instruction->dst;
    return BRUME_OK;
}

static brume_result check_program(const brume_volume_program *program, uint32_t grid_count,
                                  const char *volume_name)
{
    _Static_assert(BRUME_REGISTERS == 64u, "the written registers are bits of 64");
    if (program->instruction_count > MAX_INSTRUCTIONS)
        return fail(BRUME_E_SHADER_PROGRAM,
                    "volume '%s': a program of %u instructions; %d is the limit", volume_name,
                    program->instruction_count, MAX_INSTRUCTIONS);
    if (program->instruction_count > 0 && !program->instructions)
        return fail(BRUME_E_SHADER_PROGRAM, "volume '%s': the program's instructions are missing",
                    volume_name);
    if (program->ramp_count > MAX_INSTRUCTIONS)
        return fail(BRUME_E_SHADER_PROGRAM, "volume '%s': a program of %u ramps; %d is the limit",
                    volume_name, program->ramp_count, MAX_INSTRUCTIONS);
    if (program->ramp_count > 0 && !program->ramps)
        return fail(BRUME_E_SHADER_PROGRAM, "volume '%s': the program's ramps are missing",
                    volume_name);

    uint64_t written = 0;
    for (uint32_t i = 0; i < program->instruction_count; ++i)
        TRY(check_instruction(program, i, grid_count, &written, volume_name));
    TRY(check_register(program->sigma_s, written, "the result sigma_s", volume_name));
    TRY(check_register(program->sigma_a, written, "the result sigma_a", volume_name));
    TRY(check_register(program->g, written, "the result g", volume_name));
    TRY(check_register(program->emission, written, "the result emission", volume_name));

    for (size_t i = 0; i < (size_t)program->ramp_count * BRUME_RAMP_SIZE * 3; ++i)
        if (!isfinite(program->ramps[i]))
            return fail(BRUME_E_SHADER_PROGRAM, "volume '%s': ramp %zu has NaN or infinite values",
                        volume_name, i / (BRUME_RAMP_SIZE * 3));
    return BRUME_OK;
}

brume_result volume_program_init(struct volume_program *program, const brume_volume_program *source,
                                 uint32_t grid_count, const char *volume_name)
{
    REQUIRE(program != NULL);
    REQUIRE(source != NULL);
    if (!volume_name)
        volume_name = "unnamed";
    *program = (struct volume_program){0};
    TRY(check_program(source, grid_count, volume_name));

    const size_t code_bytes = source->instruction_count * sizeof *source->instructions;
    const size_t ramp_bytes =
        (size_t)source->ramp_count * BRUME_RAMP_SIZE * 3 * sizeof *source->ramps;
    brume_instruction *code = malloc(code_bytes);
    float *ramps = ramp_bytes ? malloc(ramp_bytes) : NULL;
    if (!code || (ramp_bytes && !ramps)) {
        free(code);
        free(ramps);
        return fail(BRUME_E_MEMORY, "no memory for the shader program of volume '%s'", volume_name);
    }
    memcpy(code, source->instructions, code_bytes);
    if (ramps)
        memcpy(ramps, source->ramps, ramp_bytes);
    program->program = *source;
    program->program.instructions = code;
    program->program.ramps = ramps;
    return BRUME_OK;
}

void volume_program_finish(struct volume_program *program)
{
    free((void *)program->program.instructions);
    free((void *)program->program.ramps);
    *program = (struct volume_program){0};
}

/* --- Run ---------------------------------------------------------------------------------- */

/* The safe arithmetic of Blender's Math node: where a result is undefined it is 0. */

static inline float minimum(float a, float b)
{
    return a < b ? a : b;
}

static inline float maximum(float a, float b)
{
    return a > b ? a : b;
}

static inline float clamp01(float a)
{
    return a > 0.0f ? minimum(a, 1.0f) : 0.0f;
}

static inline float divide(float a, float b)
{
    return b != 0.0f ? a / b : 0.0f;
}

static inline float power(float a, float b)
{
    if ((a < 0.0f && b != truncf(b)) || (a == 0.0f && b < 0.0f))
        return 0.0f;
    return powf(a, b);
}

static inline float logarithm(float a, float b)
{
    return a > 0.0f && b > 0.0f ? divide(logf(a), logf(b)) : 0.0f;
}

/* Inigo Quilez's cubic polynomial, as Blender. */
static inline float smooth_minimum(float a, float b, float distance)
{
    if (distance == 0.0f)
        return minimum(a, b);
    const float h = maximum(distance - fabsf(a - b), 0.0f) / distance;
    return minimum(a, b) - h * h * h * distance * (1.0f / 6.0f);
}

static inline float wrap(float a, float upper, float lower)
{
    const float range = upper - lower;
    return range != 0.0f ? a - range * floorf((a - lower) / range) : lower;
}

static inline float pingpong(float a, float scale)
{
    if (scale == 0.0f)
        return 0.0f;
    const float turns = (a - scale) / (2.0f * scale);
    return fabsf((turns - floorf(turns)) * 2.0f * scale - scale);
}

/* A register of a block is three runs of n floats, one per component. An op reads and writes the
 * same cell only, so its loops may be vectorised even where dst is an operand. */
#define RUN(count, body)                                           \
    do {                                                           \
        _Pragma("omp simd") for (uint32_t i = 0; i < (count); ++i) \
        {                                                          \
            body;                                                  \
        }                                                          \
    } while (0);                                                   \
    break
#define ONE(expression) RUN(3 * n, const float x = a[i]; dst[i] = (expression))
#define TWO(expression) \
    RUN(3 * n, const float x = a[i]; const float y = b[i]; dst[i] = (expression))
#define THREE(expression)                                                        \
    RUN(3 * n, const float x = a[i]; const float y = b[i]; const float z = c[i]; \
        dst[i] = (expression))
#define ALL(expression)                                                          \
    RUN(n, const float value = (expression); dst[i] = value; dst[n + i] = value; \
        dst[2 * n + i] = value)

static void run_noise(const brume_instruction *instruction, const float *a, const float *b,
                      const float *c, uint32_t n, float *dst)
{
    struct noise noise = {.dimensions = (int)instruction->value[0],
                          .normalized = instruction->value[1] != 0.0f};
    for (uint32_t i = 0; i < n; ++i) {
        noise.detail = b[i];
        noise.roughness = b[n + i];
        noise.lacunarity = b[2 * n + i];
        noise.distortion = c[n + i];
        const float at[4] = {noise.dimensions > 1 ? a[i] : c[i], a[n + i], a[2 * n + i], c[i]};
        float out[3];
        noise_at(&noise, at, instruction->value[2] != 0.0f, out);
        for (uint32_t component = 0; component < 3; ++component)
            dst[component * n + i] = out[component];
    }
}

static void run_instruction(const brume_volume_program *program,
                            const brume_instruction *instruction, const float *const *grids,
                            const struct cell_row *row, size_t first, uint32_t n,
                            float (*registers)[3 * BLOCK])
{
    float *dst = registers[instruction->dst];
    const uint32_t count = ops[instruction->op].registers;
    const float *a = count > 0 ? registers[instruction->a] : NULL;
    const float *b = count > 1 ? registers[instruction->b] : NULL;
    const float *c = count > 2 ? registers[instruction->c] : NULL;

    switch ((brume_op)instruction->op) {
    case BRUME_OP_CONSTANT:
        for (uint32_t component = 0; component < 3; ++component)
            for (uint32_t i = 0; i < n; ++i)
                dst[component * n + i] = instruction->value[component];
        break;
    case BRUME_OP_GRID: {
        const float *grid = grids ? grids[instruction->a] : NULL;
        if (!grid) {
            memset(dst, 0, 3 * n * sizeof *dst);
            break;
        }
        grid += 3 * first;
        RUN(n, dst[i] = grid[3 * i]; dst[n + i] = grid[3 * i + 1];
            dst[2 * n + i] = grid[3 * i + 2]);
    }
    case BRUME_OP_ADD:
        TWO(x + y);
    case BRUME_OP_SUBTRACT:
        TWO(x - y);
    case BRUME_OP_MULTIPLY:
        TWO(x * y);
    case BRUME_OP_DIVIDE:
        TWO(divide(x, y));
    case BRUME_OP_MULTIPLY_ADD:
        THREE(x * y + z);
    case BRUME_OP_POWER:
        TWO(power(x, y));
    case BRUME_OP_LOGARITHM:
        TWO(logarithm(x, y));
    case BRUME_OP_SQRT:
        ONE(x > 0.0f ? sqrtf(x) : 0.0f);
    case BRUME_OP_INVERSE_SQRT:
        ONE(x > 0.0f ? 1.0f / sqrtf(x) : 0.0f);
    case BRUME_OP_ABSOLUTE:
        ONE(fabsf(x));
    case BRUME_OP_EXPONENT:
        ONE(expf(x));
    case BRUME_OP_MINIMUM:
        TWO(minimum(x, y));
    case BRUME_OP_MAXIMUM:
        TWO(maximum(x, y));
    case BRUME_OP_LESS:
        TWO(x < y ? 1.0f : 0.0f);
    case BRUME_OP_GREATER:
        TWO(x > y ? 1.0f : 0.0f);
    case BRUME_OP_SIGN:
        ONE(x > 0.0f ? 1.0f : x < 0.0f ? -1.0f : 0.0f);
    case BRUME_OP_COMPARE:
        THREE(fabsf(x - y) <= maximum(z, 1e-5f) ? 1.0f : 0.0f);
    case BRUME_OP_SMOOTH_MIN:
        THREE(smooth_minimum(x, y, z));
    case BRUME_OP_SMOOTH_MAX:
        THREE(-smooth_minimum(-x, -y, z));
    case BRUME_OP_ROUND:
        ONE(floorf(x + 0.5f));
    case BRUME_OP_FLOOR:
        ONE(floorf(x));
    case BRUME_OP_CEIL:
        ONE(ceilf(x));
    case BRUME_OP_TRUNCATE:
        ONE(truncf(x));
    case BRUME_OP_FRACTION:
        ONE(x - floorf(x));
    case BRUME_OP_MODULO:
        TWO(y != 0.0f ? fmodf(x, y) : 0.0f);
    case BRUME_OP_WRAP:
        THREE(wrap(x, y, z));
    case BRUME_OP_SNAP:
        TWO(floorf(divide(x, y)) * y);
    case BRUME_OP_PINGPONG:
        TWO(pingpong(x, y));
    case BRUME_OP_SINE:
        ONE(sinf(x));
    case BRUME_OP_COSINE:
        ONE(cosf(x));
    case BRUME_OP_TANGENT:
        ONE(tanf(x));
    case BRUME_OP_ARCSINE:
        ONE(fabsf(x) <= 1.0f ? asinf(x) : 0.0f);
    case BRUME_OP_ARCCOSINE:
        ONE(fabsf(x) <= 1.0f ? acosf(x) : 0.0f);
    case BRUME_OP_ARCTANGENT:
        ONE(atanf(x));
    case BRUME_OP_ARCTANGENT2:
        TWO(x == 0.0f && y == 0.0f ? 0.0f : atan2f(x, y));
    case BRUME_OP_HYPERBOLIC_SINE:
        ONE(sinhf(x));
    case BRUME_OP_HYPERBOLIC_COSINE:
        ONE(coshf(x));
    case BRUME_OP_HYPERBOLIC_TANGENT:
        ONE(tanhf(x));
    case BRUME_OP_CLAMP01:
        ONE(clamp01(x));
    case BRUME_OP_MIX:
        THREE(x + (y - x) * z);
    case BRUME_OP_SMOOTHSTEP:
        RUN(3 * n, const float t = clamp01(a[i]); dst[i] = t * t * (3.0f - 2.0f * t));
    case BRUME_OP_SMOOTHERSTEP:
        RUN(3 * n, const float t = clamp01(a[i]);
            dst[i] = t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f));
    case BRUME_OP_RAMP: {
        const float *ramp = program->ramps + (size_t)instruction->b * BRUME_RAMP_SIZE * 3;
        for (uint32_t i = 0; i < n; ++i) {
            float rgb[3];
            table_lookup(ramp, BRUME_RAMP_SIZE, a[i] * (BRUME_RAMP_SIZE - 1), rgb);
            for (uint32_t component = 0; component < 3; ++component)
                dst[component * n + i] = rgb[component];
        }
        break;
    }
    case BRUME_OP_AVERAGE:
        ALL((a[i] + a[n + i] + a[2 * n + i]) * (1.0f / 3.0f));
    case BRUME_OP_LUMINANCE:
        ALL(0.2126f * a[i] + 0.7152f * a[n + i] + 0.0722f * a[2 * n + i]);
    case BRUME_OP_COMPONENT:
        ALL(a[instruction->b * n + i]);
    case BRUME_OP_COMBINE:
        RUN(n, const float x = a[i]; const float y = b[i]; const float z = c[i]; dst[i] = x;
            dst[n + i] = y; dst[2 * n + i] = z);
    case BRUME_OP_BLACKBODY:
        pthread_once(&blackbody_once, blackbody_fill);
        for (uint32_t i = 0; i < n; ++i) {
            float rgb[3];
            table_lookup(blackbody_table[0], BLACKBODY_STEPS + 1,
                         (a[i] - COLDEST) * (1.0f / KELVIN_STEP), rgb);
            for (uint32_t component = 0; component < 3; ++component)
                dst[component * n + i] = rgb[component];
        }
        break;
    case BRUME_OP_POSITION:
        for (uint32_t component = 0; component < 3; ++component)
            for (uint32_t i = 0; i < n; ++i)
                dst[component * n + i] =
                    row ? (float)(row->first[instruction->a][component] +
                                  (double)(first + i) * row->step[instruction->a][component])
                        : 0.0f;
        break;
    case BRUME_OP_NOISE:
        run_noise(instruction, a, b, c, n, dst);
        break;
    case BRUME_OP_COUNT:
        break;
    }
}

/* Transport must never meet a negative, NaN or infinite coefficient. */
static inline float sane(float value)
{
    return value > 0.0f && value < INFINITY ? value : 0.0f;
}

static inline float sane_g(float g)
{
    return g > -0.99f ? minimum(g, 0.99f) : g == g ? -0.99f : 0.0f;
}

bool volume_program_is_placed(const struct volume_program *program)
{
    const brume_volume_program *code = &program->program;
    for (uint32_t i = 0; i < code->instruction_count; ++i)
        if (code->instructions[i].op == BRUME_OP_POSITION)
            return true;
    return false;
}

void volume_program_run(const struct volume_program *program, const float *const *grids,
                        const struct cell_row *row, uint32_t count, struct medium_sample *out)
{
    const brume_volume_program *code = &program->program;
    float registers[BRUME_REGISTERS][3 * BLOCK];
    for (uint32_t first = 0; first < count; first += BLOCK) {
        const uint32_t n = count - first < BLOCK ? count - first : BLOCK;
        for (uint32_t i = 0; i < code->instruction_count; ++i)
            run_instruction(code, &code->instructions[i], grids, row, first, n, registers);

        const float *sigma_s = registers[code->sigma_s], *sigma_a = registers[code->sigma_a];
        const float *emission = registers[code->emission], *g = registers[code->g];
        for (uint32_t i = 0; i < n; ++i) {
            struct medium_sample *sample = &out[first + i];
            for (uint32_t component = 0; component < 3; ++component) {
                sample->sigma_s[component] = sane(sigma_s[component * n + i]);
                sample->sigma_a[component] = sane(sigma_a[component * n + i]);
                sample->emission[component] = sane(emission[component * n + i]);
            }
            sample->g = sane_g(g[i]);
        }
    }
}
