/* SPDX-License-Identifier: GPL-3.0-or-later */
/* LPV: that light in flight keeps its power, goes alike in all directions and adds up; that a
 * turned scene is a turned picture; that a white furnace is white; and that nothing becomes
 * negative or infinite whatever the scene is. */
#include "field.h"

#define CELLS 32

static brume_settings settings_for(int iterations)
{
    return (brume_settings){.method = BRUME_METHOD_LPV,
                            .medium_resolution = 32,
                            .lattice_resolution = CELLS,
                            .field_resolution = CELLS,
                            .iterations = iterations,
                            .shadow_resolution = 64,
                            .light_samples = 1,
                            .world_samples = 64};
}

/* --- Power ---------------------------------------------------------------------------------- */

/* In a white box with a white medium all of a lamp's light is scattered or reflected once, 1 W of
 * each colour, and then flies for ever. */
static void power_is_kept(void **state)
{
    (void)state;
    brume_scene *scene = empty();
    add_box(scene, 1, 1.0f, 1.0f);
    add_fog_cube(scene, 2, origin, 1.0f, &white_fog);
    add_lamp(scene, 3, (float[3]){0.2f, -0.1f, 0.3f}, 1.0f);
    static const int iterations[] = {1, 8, 64};
    for (size_t i = 0; i < sizeof iterations / sizeof *iterations; ++i) {
        const brume_settings settings = settings_for(iterations[i]);
        brume_stats stats;
        struct field field = field_of(scene, &settings, &stats);
        free(field.texels);
        assert_int_equal(stats.iterations, iterations[i]);
        print_message("after %d iterations %.7f of %.4f W\n", iterations[i],
                      stats.power_in_flight / stats.power_begun, stats.power_begun);
        assert_close(stats.power_in_flight, stats.power_begun, 1e-4);
        assert_close(stats.power_begun, 3.0, 0.01);
    }
    brume_scene_destroy(scene);
}

/* A grain of medium that a lamp lights: a source in one cell, alike in all directions, amid a
 * medium that absorbs. */
static void all_directions_are_alike(void **state)
{
    (void)state;
    static const int ways[3][12][3] = {
        {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
        {{1, 1, 0},
         {-1, 1, 0},
         {1, -1, 0},
         {-1, -1, 0},
         {1, 0, 1},
         {-1, 0, 1},
         {1, 0, -1},
         {-1, 0, -1},
         {0, 1, 1},
         {0, -1, 1},
         {0, 1, -1},
         {0, -1, -1}},
        {{1, 1, 1},
         {-1, 1, 1},
         {1, -1, 1},
         {-1, -1, 1},
         {1, 1, -1},
         {-1, 1, -1},
         {1, -1, -1},
         {-1, -1, -1}}};
    static const int counts[3] = {6, 12, 8};
    static const struct coefficients black = {.sigma_a = {0.0f, 1.0f, 10.0f}};
    static const struct coefficients grain = {.sigma_s = {1, 1, 1}};
    brume_scene *scene = empty();
    brume_settings settings = settings_for(12);
    settings.field_resolution = 33; /* with a cell in the middle */
    settings.medium_resolution = 99;
    add_fog_cube(scene, 1, origin, 1.0f, &black);
    add_fog_cube(scene, 2, origin, 0.02f, &grain);
    add_lamp(scene, 3, (float[3]){0, 0, 5}, 1000.0f);
    struct field field = field_of(scene, &settings, NULL);
    for (int i = 0; i < 3; ++i)
        assert_int_equal(dims_of(&field)[i], 33);
    for (int color = 0; color < 3; ++color)
        for (int far_ = 1; far_ <= 10; ++far_)
            for (int kind = 0; kind < 3; ++kind) {
                double first = 0.0;
                for (int way = 0; way < counts[kind]; ++way) {
                    const int *d = ways[kind][way];
                    const int cell[3] = {16 + far_ * d[0], 16 + far_ * d[1], 16 + far_ * d[2]};
                    const double here = fluence(&field, cell, color);
                    assert_true(here > 0.0);
                    if (way == 0)
                        first = here;
                    assert_close(here, first, 1e-4);
                }
            }
    free(field.texels);
    brume_scene_destroy(scene);
}

/* --- Sums ----------------------------------------------------------------------------------- */

static void light_adds_up(void **state)
{
    (void)state;
    static const float places[2][3] = {{0.5f, 0.2f, -0.3f}, {-0.6f, -0.4f, 0.1f}};
    static const float watts[4][2] = {{1, 0}, {0, 1}, {1, 1}, {3, 0}};
    const brume_settings settings = settings_for(8);
    struct field fields[4];
    brume_scene *scene = empty();
    add_box(scene, 1, 1.0f, 0.5f);
    add_fog_cube(scene, 2, origin, 1.0f, &white_fog);
    for (int i = 0; i < 4; ++i) {
        for (int k = 0; k < 2; ++k)
            add_lamp(scene, 3 + (uint64_t)k, places[k], watts[i][k]);
        fields[i] = field_of(scene, &settings, NULL);
    }
    double off = 0.0, all = 0.0;
    for (int x = 0; x < CELLS; ++x)
        for (int y = 0; y < CELLS; ++y)
            for (int z = 0; z < CELLS; ++z) {
                const int cell[3] = {x, y, z};
                for (int color = 0; color < 3; ++color) {
                    const double one = fluence(&fields[0], cell, color);
                    const double both = fluence(&fields[2], cell, color);
                    off += fabs(one + fluence(&fields[1], cell, color) - both);
                    all += both;
                    assert_close(fluence(&fields[3], cell, color), 3.0 * one, 1e-4);
                }
            }
    /* Not exactly: where the light of both meets, it leaves by one lobe for the two. */
    print_message("two lamps and each alone: %.2f %% off\n", 100.0 * off / all);
    assert_true(off < 0.01 * all);
    for (int i = 0; i < 4; ++i)
        free(fields[i].texels);
    brume_scene_destroy(scene);
}

/* Stopping early, and adding the rest of the series, is as good as going on. */
static void early_is_as_late(void **state)
{
    (void)state;
    static const float reflectances[] = {0.0f, 0.5f, 0.9f};
    static const int many[] = {200, 300, 1000};
    for (size_t i = 0; i < 3; ++i) {
        brume_scene *scene = empty();
        add_box(scene, 1, 1.0f, reflectances[i]);
        add_fog_cube(scene, 2, origin, 1.0f, &white_fog);
        add_lamp(scene, 3, (float[3]){0.5f, 0.2f, -0.3f}, 1.0f);
        brume_settings settings = settings_for(0);
        settings.field_resolution = 16;
        brume_stats stats;
        struct field early = field_of(scene, &settings, &stats);
        settings.iterations = many[i];
        struct field late = field_of(scene, &settings, NULL);
        const double off = fields_apart(&early, &late, 1);
        print_message("reflectance %g: %u iterations, %.2f %% off\n", (double)reflectances[i],
                      stats.iterations, 100.0 * off);
        assert_true(off < 0.01);
        free(early.texels);
        free(late.texels);
        brume_scene_destroy(scene);
    }
}

/* --- Turned scenes -------------------------------------------------------------------------- */

static void turn(float degrees, const float p[3], float out[3])
{
    const float a = degrees * 3.14159265f / 180.0f, x = p[0], y = p[1];
    out[0] = cosf(a) * x - sinf(a) * y;
    out[1] = sinf(a) * x + cosf(a) * y;
    out[2] = p[2];
}

/* A box of fog, a solid in it, and lamps, all turned about z; the field where cells of the scene as
 * it was would be. */
static struct field turned(float degrees, int iterations)
{
    const brume_settings settings = settings_for(iterations);
    static const float lamps[2][3] = {{0.7f, 0.5f, 0.4f}, {-0.5f, 0.6f, -0.2f}};
    static const float along_x[3] = {1, 0, 0}, along_y[3] = {0, 1, 0};
    float matrix[16];
    memcpy(matrix, identity, sizeof matrix);
    turn(degrees, along_x, matrix);
    turn(degrees, along_y, matrix + 4);
    brume_scene *scene = empty();
    struct fog_cube cube;
    fog_cube_init(&cube, origin, 1.0f, &white_fog);
    memcpy(cube.volume.world_from_object, matrix, sizeof matrix);
    assert_ok(brume_scene_set_volume(scene, 1, &cube.volume));
    add_cube(scene, 2, (float[3]){0.1f, -0.3f, 0.0f}, 0.2f,
             BRUME_VISIBLE_CAMERA | BRUME_VISIBLE_SHADOW);
    const brume_instances instances = {.world_from_object = matrix,
                                       .mesh = 2,
                                       .count = 1,
                                       .visibility = BRUME_VISIBLE_CAMERA | BRUME_VISIBLE_SHADOW};
    assert_ok(brume_scene_set_instances(scene, 2, &instances));
    for (int i = 0; i < 2; ++i) {
        float from[3];
        turn(degrees, lamps[i], from);
        brume_light lamp = point_lamp(from, 10.0f);
        for (int c = 0; c < 2; ++c)
            memcpy(lamp.world_from_light + 4 * c, matrix + 4 * c, sizeof(float[3]));
        lamp.world_from_light[8] = lamp.world_from_light[9] = 0.0f;
        lamp.world_from_light[10] = 1.0f;
        assert_ok(brume_scene_set_light(scene, 3 + (uint64_t)i, &lamp));
    }
    const struct field field = field_of(scene, &settings, NULL);
    brume_scene_destroy(scene);
    return field;
}

static void a_quarter_turn_is_exact(void **state)
{
    (void)state;
    struct field before = turned(0.0f, 8), after = turned(90.0f, 8);
    double off = 0.0, all = 0.0;
    for (int x = 0; x < CELLS; ++x)
        for (int y = 0; y < CELLS; ++y)
            for (int z = 0; z < CELLS; ++z) {
                const int cell[3] = {x, y, z}, there[3] = {CELLS - 1 - y, x, z};
                const double a = fluence(&before, cell, 0), b = fluence(&after, there, 0);
                off += fabs(a - b);
                all += a;
            }
    print_message("a quarter turn: %.2e off\n", off / all);
    assert_true(off < 1e-3 * all);
    free(before.texels);
    free(after.texels);
}

static void a_turn_changes_little(void **state)
{
    (void)state;
    struct field before = turned(0.0f, 0), after = turned(30.0f, 0);
    double off = 0.0, all = 0.0;
    for (int x = 2; x < CELLS - 2; x += 2)
        for (int y = 2; y < CELLS - 2; y += 2)
            for (int z = 2; z < CELLS - 2; z += 2) {
                const int index[3] = {x, y, z};
                float p[3], q[3];
                for (int i = 0; i < 3; ++i)
                    p[i] = centre(&before, i, index[i]);
                if (fabsf(p[0] - 0.1f) < 0.3f && fabsf(p[1] + 0.3f) < 0.3f && fabsf(p[2]) < 0.3f)
                    continue; /* in the solid, or in cells that it cuts */
                turn(30.0f, p, q);
                const double a = fluence_at(&before, p, 0), b = fluence_at(&after, q, 0);
                off += fabs(a - b);
                all += a;
            }
    print_message("turned by 30 degrees: %.2f %% off\n", 100.0 * off / all);
    assert_true(off < 0.05 * all);
    free(before.texels);
    free(after.texels);
}

/* --- Furnaces ------------------------------------------------------------------------------- */

/* What scatters all light cannot be seen in an even world. In thick media the sky's nodes are
 * coarse at the rim; of strong forward lobes two bands know the mean alone. */
static void white_furnace(void **state)
{
    (void)state;
    static const struct {
        float sigma_s, g;
        double share;
    } cases[] = {{0.5f, 0.0f, 0.01}, {2.0f, 0.0f, 0.01}, {8.0f, 0.0f, 0.07}, {2.0f, 0.6f, 0.05}};
    const brume_world world = {.color = {1, 1, 1}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        const float s = cases[i].sigma_s;
        const struct coefficients fog = {.sigma_s = {s, s, s}, .g = cases[i].g};
        brume_settings settings = settings_for(0);
        settings.medium_resolution = 64;
        brume_view view = orthographic_view(origin, (float[3]){0.3f, -1, 0.2f}, 0.8f, 5.0f, 16);
        view.samples = 16;
        brume_scene *scene = empty();
        add_fog_cube(scene, 1, origin, 0.5f, &fog);
        assert_ok(brume_scene_set_world(scene, &world));
        brume_job *job = render(scene, &settings, &view);
        float *pixels = read_pass(job, &view, BRUME_PASS_COMBINED);
        double mean = 0.0;
        for (int p = 0; p < 256; ++p)
            mean += (double)pixels[4 * p] / 256.0;
        print_message("furnace, sigma_s %g, g %g: %.4f\n", (double)s, (double)fog.g, mean);
        assert_close(mean, 1.0, cases[i].share);
        free(pixels);
        brume_job_release(job);
        brume_scene_destroy(scene);
    }
}

/* --- Hostile scenes ------------------------------------------------------------------------- */

static void assert_sound_scene(brume_scene *scene, const brume_settings *settings)
{
    assert_sound_picture(scene, settings);
    struct field field = field_of(scene, settings, NULL);
    assert_sound(&field);
    free(field.texels);
}

static void thick_cells(void **state)
{
    (void)state;
    static const struct coefficients media[] = {
        {.sigma_s = {800, 400, 8}},
        {.sigma_a = {800, 400, 8}},
        {.sigma_s = {790, 0, 60000}, .sigma_a = {10, 800, 60000}, .g = 0.9f}};
    for (size_t i = 0; i < 3; ++i) { /* 800/m: 50 a cell */
        brume_scene *scene = empty();
        const brume_settings settings = settings_for(8);
        add_fog_cube(scene, 1, origin, 1.0f, &media[i]);
        add_lamp(scene, 2, (float[3]){0.1f, 0, 0}, 10.0f);
        add_lamp(scene, 3, (float[3]){0, 0, 3}, 10.0f);
        assert_sound_scene(scene, &settings);
        brume_scene_destroy(scene);
    }
}

static void lamps_in_walls(void **state)
{
    (void)state;
    static const float places[][3] = {{0, 0, 0}, {0.2f, 0.2f, 0.2f}, {0.2f, 0, 0}, {0.05f, 0, 0}};
    for (size_t i = 0; i < sizeof places / sizeof *places; ++i) {
        brume_scene *scene = empty();
        const brume_settings settings = settings_for(8);
        add_fog_cube(scene, 1, origin, 1.0f, &white_fog);
        add_box(scene, 2, 0.2f, 1.0f);
        add_lamp(scene, 3, places[i], 10.0f);
        assert_sound_scene(scene, &settings);
        brume_scene_destroy(scene);
    }
}

/* A room that fits into one cell of a lattice that a far wall makes large, and lattices of few. */
static void small_rooms(void **state)
{
    (void)state;
    static const int resolutions[] = {1, 2, 3, 8};
    for (size_t i = 0; i < sizeof resolutions / sizeof *resolutions; ++i) {
        brume_scene *scene = empty();
        brume_settings settings = settings_for(8);
        settings.field_resolution = resolutions[i];
        add_box(scene, 1, 0.05f, 0.9f);
        add_cube(scene, 2, (float[3]){20, 0, 0}, 0.5f, BRUME_VISIBLE_CAMERA | BRUME_VISIBLE_SHADOW);
        add_fog_cube(scene, 3, origin, 0.04f, &white_fog);
        add_lamp(scene, 4, origin, 1.0f);
        assert_sound_scene(scene, &settings);
        brume_scene_destroy(scene);
    }
}

static void nothing_scatters(void **state)
{
    (void)state;
    static const struct coefficients black = {.sigma_a = {1, 2, 3}};
    brume_scene *scene = empty();
    const brume_settings settings = settings_for(0);
    brume_stats stats;
    add_fog_cube(scene, 1, origin, 1.0f, &black);
    add_lamp(scene, 2, (float[3]){0.2f, 0, 0}, 10.0f);
    assert_sound_scene(scene, &settings);
    struct field field = field_of(scene, &settings, &stats);
    const int cell[3] = {8, 9, 10};
    assert_true(fluence(&field, cell, 0) == 0.0);
    free(field.texels);
    brume_scene_destroy(scene);
}

static void many_iterations(void **state)
{
    (void)state;
    brume_scene *scene = empty();
    brume_settings settings = settings_for(1000);
    settings.field_resolution = 12;
    add_box(scene, 1, 1.0f, 1.0f);
    add_fog_cube(scene, 2, origin, 1.0f, &white_fog);
    add_lamp(scene, 3, origin, 1.0f);
    assert_sound_scene(scene, &settings);
    brume_stats stats;
    settings.iterations = 0; /* white, closed: it never converges, and must end all the same */
    struct field field = field_of(scene, &settings, &stats);
    free(field.texels);
    assert_true(stats.iterations > 0 && stats.iterations <= 2000);
    brume_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(power_is_kept),           cmocka_unit_test(all_directions_are_alike),
        cmocka_unit_test(light_adds_up),           cmocka_unit_test(early_is_as_late),
        cmocka_unit_test(a_quarter_turn_is_exact), cmocka_unit_test(a_turn_changes_little),
        cmocka_unit_test(white_furnace),           cmocka_unit_test(thick_cells),
        cmocka_unit_test(lamps_in_walls),          cmocka_unit_test(small_rooms),
        cmocka_unit_test(nothing_scatters),        cmocka_unit_test(many_iterations),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
