/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What LPV's parts take, in lattices of 32 and of 64 cells, as the rows of its paper's Table 1.
 * Ratios alone, of sums over stretches of about the same length, which take turns: the speed of a
 * machine with other work changes, and the least of many short times is of better moments than that
 * of long ones. */
#include "field.h"

#define WATTS 100.0f

#define SMALL 32
#define LARGE 64
#define FRAMES 8 /* of the small lattice, for one of the large */
#define ROUNDS 8 /* at most, until it is as it should be */

struct cost {
    double parts[BRUME_FIELD_PARTS]; /* ms, a frame */
};

static double injection(const struct cost *cost)
{
    return cost->parts[BRUME_FIELD_REFLECTED] + cost->parts[BRUME_FIELD_SCATTERED] +
           cost->parts[BRUME_FIELD_BLOCKERS];
}

/* Adds the share of frames in which a lamp has moved. */
static void run(brume_scene *scene, brume_settings settings, const float lamp[3], int frames,
                struct cost *cost)
{
    const brume_view view = orthographic_view(origin, (float[3]){0, 0, -1}, 1.0f, 5.0f, 8);
    for (int i = 0; i < frames; ++i) {
        add_lamp(scene, 3, (float[3]){lamp[0] + 1e-4f * (float)i, lamp[1], lamp[2]}, WATTS);
        brume_job *job = render(scene, &settings, &view);
        brume_stats stats;
        assert_ok(brume_job_stats(job, &stats));
        brume_job_release(job);
        for (int part = 0; part < BRUME_FIELD_PARTS; ++part)
            cost->parts[part] += stats.field_ms[part] / frames;
    }
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
                            .iterations = 4,
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
        struct cost small = {0}, large = {0};
        bool as_held = false;
        for (int round = -1; round < ROUNDS && !as_held; ++round) {
            const float lamp[3] = {0.5f, 0.2f, -0.3f + 0.05f * (float)round};
            if (round == 0) /* shaders were compiled before */
                small = large = (struct cost){0};
            run(scene, settings_for(SMALL, blockers), lamp, round < 0 ? 1 : FRAMES, &small);
            run(scene, settings_for(LARGE, blockers), lamp, 1, &large);
            as_held =
                round >= 0 && injection(&large) <= 1.2 * injection(&small) &&
                large.parts[BRUME_FIELD_ITERATIONS] <= 8.5 * small.parts[BRUME_FIELD_ITERATIONS];
        }
        print_message("%s blockers: injection %.2f times, iterations %.2f times\n",
                      blockers ? "fuzzy" : "exact", injection(&large) / injection(&small),
                      large.parts[BRUME_FIELD_ITERATIONS] / small.parts[BRUME_FIELD_ITERATIONS]);
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
    const brume_settings settings = settings_for(SMALL, BRUME_BLOCKERS_LINKS);
    brume_scene *wide = room(middle, 1), *narrow = room(middle, 1);
    add_box_at(narrow, 9, middle, 0.03f, 0.5f);
    struct cost costs[2] = {0};
    bool as_held = false;
    for (int round = -1; round < ROUNDS && !as_held; ++round) {
        if (round == 0)
            memset(costs, 0, sizeof costs);
        run(wide, settings, middle, 2, &costs[0]);
        run(narrow, settings, middle, 2, &costs[1]);
        as_held = round > 0 && injection(&costs[1]) <= 1.2 * injection(&costs[0]);
    }
    print_message("all in one cell: %.2f times what it takes all over the room\n",
                  injection(&costs[1]) / injection(&costs[0]));
    brume_scene_destroy(wide);
    brume_scene_destroy(narrow);
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
