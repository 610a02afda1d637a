/* SPDX-License-Identifier: GPL-3.0-or-later */
/* DOM's surfaces that emit, against closed forms and a Monte Carlo: closed boxes in which all light is
 * even, and things in dark rooms that are larger than the lattice's cells; for others see emitters.c. */
#include "dom.h"

/* A closed box that glows and reflects: everywhere in it is the same light. */
static void glowing_walls(void **state)
{
    (void)state;
    const brume_settings settings = settings_for(16);
    const brume_material glowing = {
        .diffuse = {0.6f, 0.6f, 0.6f}, .emission = {200, 0.5f, 0.02f}, .roughness = 1, .alpha = 1};
    const struct coefficients fog = {.sigma_s = {1, 1, 1}};
    brume_scene *scene = empty();
    add_box(scene, 1, 1.0f, 0.0f);
    assert_ok(brume_scene_set_material(scene, 1, &glowing));
    add_fog_cube(scene, 2, origin, 0.5f, &fog); /* changes nothing */
    struct field field = field_of(scene, &settings, NULL);
    for (int c = 0; c < 3; ++c) {
        const double mean = mean_fluence(&field, c);
        const double truth = 4.0 * PI * (double)glowing.emission[c] / (1.0 - 0.6);
        print_message("glowing walls, emission %g: %+.2f %%\n", (double)glowing.emission[c],
                      100.0 * (mean / truth - 1.0));
        assert_close(mean, truth, 0.01);
    }
    free(field.texels);
    brume_scene_destroy(scene);
}

/* The same, turned against the lattice: cells' surfaces are cut askew. */
static void glowing_walls_askew(void **state)
{
    (void)state;
    const brume_settings settings = settings_for(24);
    const brume_material glowing = { /* red reflects nothing */
        .diffuse = {0, 0.3f, 0.6f}, .emission = {1, 1, 1}, .roughness = 1, .alpha = 1};
    const float k = 0.8660254f, h = 0.5f; /* 30 degrees about z, then about x */
    const float turned[16] = {k, h, 0, 0, -h * k, k * k, h, 0, h * h, -k * h, k, 0, 0, 0, 0, 1};
    const brume_instances instance = {.world_from_object = turned,
                                      .mesh = 1,
                                      .count = 1,
                                      .visibility = BRUME_VISIBLE_CAMERA | BRUME_VISIBLE_SHADOW};
    brume_scene *scene = empty();
    add_box(scene, 1, 1.0f, 0.0f);
    assert_ok(brume_scene_set_instances(scene, 1, &instance));
    assert_ok(brume_scene_set_material(scene, 1, &glowing));
    struct field field = field_of(scene, &settings, NULL);
    double mean[3] = {0.0}, worst[3] = {0.0};
    int count = 0;
    for (int z = 0; z < field.levels[0].dims.z; ++z)
        for (int y = 0; y < field.levels[0].dims.y; ++y)
            for (int x = 0; x < field.levels[0].dims.x; ++x) {
                const int cell[3] = {x, y, z};
                double square = 0.0;
                for (int i = 0; i < 3; ++i)
                    square += centre(&field, i, cell[i]) * centre(&field, i, cell[i]);
                if (square > 0.64)
                    continue;
                for (int c = 0; c < 3; ++c) {
                    const double truth = 4.0 * PI / (1.0 - (double)(&glowing.diffuse[0])[c]);
                    const double off = fluence(&field, cell, c) / truth - 1.0;
                    worst[c] = fmax(worst[c], fabs(off));
                    mean[c] += off;
                }
                ++count;
            }
    for (int c = 0; c < 3; ++c) {
        print_message("glowing walls askew, reflectance %.1f: mean fluence %+.2f %%, worst %.2f %%\n",
                      (double)(&glowing.diffuse[0])[c], 100.0 * mean[c] / count, 100.0 * worst[c]);
        assert_true(fabs(mean[c] / count) < 0.002 && worst[c] < 0.002);
    }
    free(field.texels);
    brume_scene_destroy(scene);
}

/* A small box that glows in a room that reflects nothing. */
static void glowing_thing(void **state)
{
    (void)state;
    const brume_material glowing = {.emission = {1, 1, 1}, .roughness = 1, .alpha = 1};
    const brume_settings settings = settings_for(32);
    static const float at[3] = {0.13f, -0.21f, 0.3f};
    const float half = 0.2f;
    brume_scene *scene = empty();
    add_box(scene, 1, 1.0f, 0.0f);
    add_box_at(scene, 2, at, half, 0.0f);
    assert_ok(brume_scene_set_material(scene, 2, &glowing));
    struct field field = field_of(scene, &settings, NULL);
    double found = 0.0, truth = 0.0;
    for (int z = 0; z < 32; ++z)
        for (int y = 0; y < 32; ++y)
            for (int x = 0; x < 32; ++x) {
                const int cell[3] = {x, y, z};
                bool within = true;
                for (int i = 0; i < 3; ++i)
                    within = within && fabsf(centre(&field, i, cell[i]) - at[i]) < half;
                found += within ? 0.0 : fluence(&field, cell, 0) / (32.0 * 32.0 * 32.0);
            }
    uint64_t lots = 88172645463325252u;
    const int count = 100000;
    for (int i = 0; i < count; ++i) { /* from its sides to the walls */
        double p[3], d[3], way;
        const int axis = i % 3;
        const double sign = i / 3 % 2 ? 1.0 : -1.0;
        const double sine = sqrt(lot(&lots)), turn = 2.0 * PI * lot(&lots);
        for (int k = 0; k < 3; ++k)
            p[k] = (double)at[k] + (double)half * (k == axis ? sign : 2.0 * lot(&lots) - 1.0);
        d[axis] = sign * sqrt(1.0 - sine * sine);
        d[(axis + 1) % 3] = sine * cos(turn);
        d[(axis + 2) % 3] = sine * sin(turn);
        wall_ahead(p, d, 1.0, &way);
        truth += way / count;
    }
    truth *= PI * 24.0 * (double)half * (double)half / 8.0; /* W, over the room's volume */
    print_message("a glowing thing: mean fluence %+.2f %%\n", 100.0 * (found / truth - 1.0));
    assert_close(found, truth, 0.05);
    free(field.texels);
    brume_scene_destroy(scene);
}

/* Boxes larger than lamps stand for, anywhere in it: light in the room but for the cells around them. It
 * is right in the mean; of one box it depends on how many lines meet it. */
static void small_things_glow(void **state)
{
    (void)state;
    enum { CELLS = 16, PLACES = 12 };
    static const struct {
        double side, worst, mean; /* in cells */
    } cases[] = {{1.05, 0.45, 0.25}, {1.5, 0.20, 0.05}, {2.0, 0.25, 0.20}};
    const brume_material glowing = {.emission = {1, 1, 1}, .roughness = 1, .alpha = 1};
    const brume_settings settings = settings_for(CELLS);
    for (size_t n = 0; n < sizeof cases / sizeof *cases; ++n) {
        const double half = 0.5 * cases[n].side * 2.0 / CELLS;
        uint64_t lots = 88172645463325252u;
        double worst = 0.0, sum = 0.0;
        for (int place = 0; place < PLACES; ++place) {
            double middle[3];
            float at[3];
            for (int i = 0; i < 3; ++i) {
                middle[i] = (lot(&lots) + 1.0) * 2.0 / CELLS; /* in one cell */
                at[i] = (float)middle[i];
            }
            brume_scene *scene = empty();
            add_box(scene, 1, 1.0f, 0.0f);
            add_box_at(scene, 2, at, (float)half, 0.0f);
            assert_ok(brume_scene_set_material(scene, 2, &glowing));
            struct field field = field_of(scene, &settings, NULL);
            double found = 0.0, truth = 0.0;
            for (int z = 0; z < CELLS; ++z)
                for (int y = 0; y < CELLS; ++y)
                    for (int x = 0; x < CELLS; ++x) {
                        const int cell[3] = {x, y, z};
                        double square = 0.0, sum_of = 0.0;
                        for (int i = 0; i < 3; ++i) {
                            const double off = centre(&field, i, cell[i]) - middle[i];
                            square += off * off;
                            sum_of += fabs(off);
                        }
                        if (square < 0.09)
                            continue; /* too near for the means of cells */
                        found += fluence(&field, cell, 0);
                        truth += 4.0 * half * half * sum_of / (square * sqrt(square)); /* as seen */
                    }
            const double off = found / truth - 1.0;
            worst = fmax(worst, fabs(off));
            sum += off / PLACES;
            free(field.texels);
            brume_scene_destroy(scene);
        }
        print_message("glowing boxes %.2f cells wide: mean %+.1f %%, worst %.1f %%\n",
                      cases[n].side, 100.0 * sum, 100.0 * worst);
        assert_true(fabs(sum) < cases[n].mean && worst < cases[n].worst);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(glowing_walls),
        cmocka_unit_test(glowing_walls_askew),
        cmocka_unit_test(glowing_thing),
        cmocka_unit_test(small_things_glow),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
