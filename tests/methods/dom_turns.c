/* SPDX-License-Identifier: GPL-3.0-or-later */
/* DOM: that a turned scene is a turned picture, and that light adds up. */
#include "dom.h"

/* --- Turned scenes -------------------------------------------------------------------------- */

#define PIXELS 64
#define BLOCKS 8

/* About an axis by an angle: column-major, world from unturned world. */
static void turning(const float axis[3], double degrees, float out[16])
{
    const double angle = degrees * PI / 180.0, c = cos(angle), s = sin(angle);
    float n[3] = {axis[0], axis[1], axis[2]};
    unit(n);
    memcpy(out, identity, 16 * sizeof *out);
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row) {
            double value = (1.0 - c) * (double)n[row] * (double)n[column];
            if (row == column)
                value += c;
            else
                value += ((row + 1) % 3 == column ? -s : s) * (double)n[3 - row - column];
            out[4 * column + row] = (float)value;
        }
}

static void times(const float a[16], const float b[16], float out[16])
{
    for (int column = 0; column < 4; ++column)
        for (int row = 0; row < 4; ++row) {
            out[4 * column + row] = 0.0f;
            for (int k = 0; k < 4; ++k)
                out[4 * column + row] += a[4 * k + row] * b[4 * column + k];
        }
}

static void turn(const float matrix[16], const float v[3], float out[3])
{
    for (int row = 0; row < 3; ++row)
        out[row] = matrix[row] * v[0] + matrix[4 + row] * v[1] + matrix[8 + row] * v[2];
}

/* A lump of fog, denser on one side, that scatters forwards. */
static void add_lump(brume_scene *scene, uint64_t key, const float matrix[16])
{
    enum { SIDE = 24 };
    static float data[SIDE * SIDE * SIDE];
    for (int i = 0; i < SIDE * SIDE * SIDE; ++i) {
        const int at[3] = {i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE};
        double p[3], square = 0.0;
        for (int axis = 0; axis < 3; ++axis) {
            p[axis] = (at[axis] + 0.5) / SIDE * 2.0 - 1.0;
            square += p[axis] * p[axis];
        }
        const double waves = 1.0 + 0.8 * sin(5.0 * p[0] + 2.0) * sin(4.0 * p[1]) * cos(3.0 * p[2]);
        data[i] = (float)(fmax(1.0 - square, 0.0) * waves * (1.0 + 0.5 * p[0]));
    }
    const float object_from_array[16] = {
        1.0f / SIDE, 0, 0, 0, 0, 1.0f / SIDE, 0, 0, 0, 0, 1.0f / SIDE, 0, -0.5f, -0.5f, -0.5f, 1};
    const int32_t dims[3] = {SIDE, SIDE, SIDE};
    brume_grid *grid;
    assert_ok(brume_grid_create("density", dims, 1, data, object_from_array, &grid));
    const brume_instruction code[] = {
        {.op = BRUME_OP_GRID, .dst = 0, .a = 0},
        {.op = BRUME_OP_CONSTANT, .dst = 1, .value = {10, 8, 6}},
        {.op = BRUME_OP_MULTIPLY, .dst = 2, .a = 0, .b = 1},
        {.op = BRUME_OP_CONSTANT, .dst = 3, .value = {0, 1, 2}},
        {.op = BRUME_OP_MULTIPLY, .dst = 4, .a = 0, .b = 3},
        {.op = BRUME_OP_CONSTANT, .dst = 5, .value = {0.5f, 0.5f, 0.5f}},
        {.op = BRUME_OP_CONSTANT, .dst = 6},
    };
    brume_volume volume = {.name = "lump",
                           .grids = &grid,
                           .grid_count = 1,
                           .program = {.instructions = code,
                                       .instruction_count = 7,
                                       .sigma_s = 2,
                                       .sigma_a = 4,
                                       .g = 5,
                                       .emission = 6}};
    memcpy(volume.world_from_object, matrix, sizeof volume.world_from_object);
    assert_ok(brume_scene_set_volume(scene, key, &volume));
    brume_grid_release(grid);
}

/* The lump, over a floor and before a wall if wanted, a sun and an even sky, all turned, seen by a
 * camera turned likewise: means of blocks of pixels. */
static void picture(const float matrix[16], bool surfaces, double blocks[BLOCKS * BLOCKS][3])
{
    static const float sun[3] = {-0.5f, 0.3f, -1}, look[3] = {0.4f, 1, -0.5f};
    static const float h = 0.8f;
    static const float floor_[12] = {-h, -h, -0.55f, h, -h, -0.55f, h, h, -0.55f, -h, h, -0.55f};
    static const float wall[12] = {-h, 0.6f, -0.5f, h, 0.6f, -0.5f, h, 0.6f, 0.7f, -h, 0.6f, 0.7f};
    static const uint32_t triangles[6] = {0, 1, 2, 0, 2, 3};
    const brume_world world = {.color = {0.1f, 0.15f, 0.2f}};
    float shines[3], back[16];
    brume_scene *scene = empty();
    add_lump(scene, 1, matrix);
    if (surfaces) {
        add_matt(scene, 2, "floor", 0.6f, matrix, floor_, 4, triangles, 2);
        add_matt(scene, 3, "wall", 0.4f, matrix, wall, 4, triangles, 2);
    }
    turn(matrix, sun, shines);
    add_sun(scene, 4, shines);
    assert_ok(brume_scene_set_world(scene, &world));
    brume_settings settings = settings_for(32);
    settings.medium_resolution = 64;
    settings.shadow_resolution = 512;
    brume_view view = orthographic_view(origin, look, 1.6f, 5.0f, PIXELS);
    float seen[16];
    memcpy(seen, view.view_from_world, sizeof seen);
    invert_rigid(matrix, back);
    times(seen, back, view.view_from_world);
    view.samples = 16;
    view.world_draws = 64;
    brume_job *job = render(scene, &settings, &view);
    float *pixels = read_pass(job, &view, BRUME_PASS_COMBINED);
    memset(blocks, 0, BLOCKS * BLOCKS * sizeof *blocks);
    for (int p = 0; p < PIXELS * PIXELS; ++p) {
        const int side = PIXELS / BLOCKS;
        const int block = p % PIXELS / side + p / PIXELS / side * BLOCKS;
        for (int c = 0; c < 3; ++c)
            blocks[block][c] += (double)pixels[4 * p + c] / (side * side);
    }
    free(pixels);
    brume_job_release(job);
    brume_scene_destroy(scene);
}

static double apart(double a[BLOCKS * BLOCKS][3], double b[BLOCKS * BLOCKS][3])
{
    double off = 0.0, all = 0.0;
    for (int i = 0; i < BLOCKS * BLOCKS; ++i)
        for (int c = 0; c < 3; ++c) {
            off += fabs(a[i][c] - b[i][c]);
            all += a[i][c];
        }
    return off / all;
}

/* By a quarter cells and ordinates turn into one another: what is left is noise, and with surfaces
 * the texels of their shadow maps. By 30 degrees the medium's cells and the lattice's are others.
 */
static void turns(void **state)
{
    (void)state;
    static const float skew[3] = {1, 2, 3}, upwards[3] = {0, 0, 1}, along[3] = {1, 0, 0};
    static const struct {
        const float *axis;
        double degrees;
        bool surfaces, slow;
        double share;
    } rows[] = {{upwards, 90, false, false, 0.001},
                {skew, 30, false, false, 0.005},
                {along, 90, true, false, 0.006},
                {skew, 30, true, true, 0.02}};
    double before[2][BLOCKS * BLOCKS][3], after[BLOCKS * BLOCKS][3];
    for (int i = 0; i < 2; ++i)
        picture(identity, i > 0, before[i]);
    for (size_t i = 0; i < sizeof rows / sizeof *rows; ++i) {
        if (rows[i].slow && !at_length())
            continue;
        float matrix[16];
        turning(rows[i].axis, rows[i].degrees, matrix);
        picture(matrix, rows[i].surfaces, after);
        const double off = apart(before[rows[i].surfaces], after);
        print_message("turned by %g degrees, %s surfaces: %.3f %% off\n", rows[i].degrees,
                      rows[i].surfaces ? "with" : "without", 100.0 * off);
        assert_true(off < rows[i].share);
    }
}

/* --- Sums ----------------------------------------------------------------------------------- */

/* Twice the power is twice the light; and each of two lamps alone, added up, is both. Iterations
 * end when little changes, and half floats hold the light: to a thousandth. */
static void light_adds_up(void **state)
{
    (void)state;
    static const float places[2][3] = {{0.5f, 0.2f, -0.3f}, {-0.6f, -0.4f, 0.1f}};
    static const float watts[4][2] = {{10, 0}, {0, 10}, {10, 10}, {20, 0}};
    enum { CELLS = 16 };
    const brume_settings settings = settings_for(CELLS);
    struct field fields[4];
    brume_scene *scene = empty();
    add_box(scene, 1, 1.0f, 0.5f);
    add_fog_cube(scene, 2, origin, 1.0f, &white_fog);
    for (int i = 0; i < 4; ++i) {
        for (int k = 0; k < 2; ++k)
            add_lamp(scene, 3 + (uint64_t)k, places[k], watts[i][k]);
        fields[i] = field_of(scene, &settings, NULL);
    }
    double sum = 0.0, twice = 0.0, all = 0.0, most_sum = 0.0, most_twice = 0.0;
    for (int i = 0; i < CELLS * CELLS * CELLS; ++i)
        for (int color = 0; color < 3; ++color) {
            const int cell[3] = {i % CELLS, i / CELLS % CELLS, i / CELLS / CELLS};
            const double one = fluence(&fields[0], cell, color);
            const double both = fluence(&fields[2], cell, color);
            const double s = fabs(one + fluence(&fields[1], cell, color) - both);
            const double t = fabs(2.0 * one - fluence(&fields[3], cell, color));
            sum += s;
            twice += t;
            all += both;
            most_sum = fmax(most_sum, s / both);
            most_twice = fmax(most_twice, t / (2.0 * one));
        }
    print_message(
        "two lamps and each alone: %.4f %% off, a cell %.4f %%; twice the power: %.4f %%, "
        "a cell %.4f %%\n",
        100.0 * sum / all, 100.0 * most_sum, 100.0 * twice / all, 100.0 * most_twice);
    assert_true(sum < 1e-3 * all);
    assert_true(twice < 1e-3 * all);
    for (int i = 0; i < 4; ++i)
        free(fields[i].texels);
    brume_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(turns),
        cmocka_unit_test(light_adds_up),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
