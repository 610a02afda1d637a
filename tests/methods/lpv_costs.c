/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What LPV's parts take, in lattices of 32 and of 64 cells, as the rows of its paper's Table 1.
 * Ratios alone: the least of several rounds, for other work on the machine only adds. */
#include "field.h"

#define WATTS 100.0f

static const int sizes[] = {32, 64};

struct cost {
    double parts[BRUME_FIELD_PARTS];
};

static double injection(const struct cost *cost)
{
    return cost->parts[BRUME_FIELD_REFLECTED] + cost->parts[BRUME_FIELD_SCATTERED];
}

/* Of a frame in which a lamp has moved; the least of each part so far. */
static void run(brume_scene *scene, brume_settings settings, const float lamp[3],
                struct cost *least)
{
    const brume_view view = orthographic_view(origin, (float[3]){0, 0, -1}, 1.0f, 5.0f, 8);
    add_lamp(scene, 3, lamp, WATTS);
    brume_job *job = render(scene, &settings, &view);
    brume_stats stats;
    assert_ok(brume_job_stats(job, &stats));
    brume_job_release(job);
    for (int part = 0; part < BRUME_FIELD_PARTS; ++part)
        least->parts[part] = least->parts[part] > 0.0
                                 ? fmin(least->parts[part], stats.field_ms[part])
                                 : stats.field_ms[part];
}

static brume_scene *room(const float *lamps, uint64_t count)
{
    brume_scene *scene = empty();
    add_box(scene, 1, 1.0f, 0.5f);
    add_fog_cube(scene, 2, origin, 1.0f, &white_fog);
    for (uint64_t i = 0; i < count; ++i)
        add_lamp(scene, 3 + i, lamps + 3 * i, WATTS);
    return scene;
}

static brume_settings settings_for(int cells, uint32_t blockers)
{
    return (brume_settings){.method = BRUME_METHOD_LPV,
                            .medium_resolution = 64,
                            .lattice_resolution = 64,
                            .field_resolution = cells,
                            .iterations = 8,
                            .blockers = blockers,
                            .shadow_resolution = 64,
                            .light_samples = 1};
}

/* With the lattice: injection hardly grows, an iteration as the number of cells. */
static void by_cells(void **state)
{
    (void)state;
    for (uint32_t blockers = 0; blockers < BRUME_BLOCKERS_COUNT; ++blockers) {
        const float lamps[2][3] = {{0.5f, 0.2f, -0.3f}, {-0.4f, -0.1f, 0.6f}};
        brume_scene *scene = room(lamps[0], 2);
        struct cost least[2] = {0};
        bool as_held = false;
        for (int round = 0; round < 10 && !as_held; ++round) {
            if (round == 1) /* shaders were compiled in the first */
                memset(least, 0, sizeof least);
            for (int i = 0; i < 2; ++i)
                run(scene, settings_for(sizes[i], blockers),
                    (float[3]){0.5f, 0.2f, -0.3f + 0.05f * (float)round}, &least[i]);
            as_held = round > 1 && injection(&least[1]) <= 1.2 * injection(&least[0]) &&
                      least[1].parts[BRUME_FIELD_ITERATIONS] <=
                          8.5 * least[0].parts[BRUME_FIELD_ITERATIONS];
        }
        print_message("%s blockers, ms at 32^3 and 64^3\n", blockers ? "fuzzy" : "exact");
        for (uint32_t part = 0; part < BRUME_FIELD_PARTS; ++part)
            print_message("%-12s %8.2f %8.2f\n", brume_field_part_name(part), least[0].parts[part],
                          least[1].parts[part]);
        print_message("injection %.2f times, iterations %.2f times\n",
                      injection(&least[1]) / injection(&least[0]),
                      least[1].parts[BRUME_FIELD_ITERATIONS] /
                          least[0].parts[BRUME_FIELD_ITERATIONS]);
        brume_scene_destroy(scene);
        assert_true(as_held);
    }
}

/* The paper's worst case, all of a lamp's light in one cell: a lamp in a box as small as that,
 * whose reflected light all goes to one cell and whose way through the medium is in one. */
static void all_in_one_cell(void **state)
{
    (void)state;
    static const float middle[3] = {0.011f, 0.012f, 0.013f};
    struct cost least[2] = {0};
    bool as_held = false;
    brume_scene *scenes[2];
    for (int narrow = 0; narrow < 2; ++narrow) {
        scenes[narrow] = room(middle, 1);
        if (narrow)
            add_box_at(scenes[1], 9, middle, 0.03f, 0.5f);
    }
    for (int round = 0; round < 10 && !as_held; ++round) {
        if (round == 1)
            memset(least, 0, sizeof least);
        for (int narrow = 0; narrow < 2; ++narrow)
            run(scenes[narrow], settings_for(32, BRUME_BLOCKERS_LINKS),
                (float[3]){0.011f + 1e-4f * (float)round, 0.012f, 0.013f}, &least[narrow]);
        as_held = round > 1 && injection(&least[1]) <= 1.2 * injection(&least[0]);
    }
    for (int narrow = 0; narrow < 2; ++narrow)
        print_message("%s: reflected %.2f, scattered %.2f ms\n",
                      narrow ? "all in one cell" : "all over the room",
                      least[narrow].parts[BRUME_FIELD_REFLECTED],
                      least[narrow].parts[BRUME_FIELD_SCATTERED]);
    brume_scene_destroy(scenes[0]);
    brume_scene_destroy(scenes[1]);
    assert_true(as_held);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(by_cells),
        cmocka_unit_test(all_in_one_cell),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
