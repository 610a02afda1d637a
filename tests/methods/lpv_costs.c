/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What LPV's parts take, in lattices of 32 and of 64 cells, as the rows of its paper's Table 1.
 * Ratios alone, of stretches of about the same length, which take turns: the speed of a machine with
 * other work changes. */
#include "field.h"

#define WATTS 100.0f

#define SMALL 32
#define LARGE 64
#define FRAMES 8 /* of the small lattice, for one of the large */
#define ROUNDS 8 /* at most, until it is as it should be */
#define LEAST 6  /* rounds, where the least of them counts, */
#define MOST 30

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

static brume_settings settings_for(int cells, uint32_t blockers, uint32_t iterations)
{
    return (brume_settings){.method = BRUME_METHOD_LPV,
                            .medium_resolution = 64,
                            .lattice_resolution = 64,
                            .field_resolution = cells,
                            .iterations = iterations,
                            .blockers = blockers,
                            .shadow_resolution = 64,
                            .light_samples = 1};
}

/* A lamp that moves a little in a room of its own for each lattice: neither has to be made anew. */
struct pair {
    brume_scene *rooms[2];
    brume_settings settings[2]; /* of SMALL and LARGE cells */
    float z;                    /* m, of the lamp */
};

static struct pair pair_of(uint32_t blockers, uint32_t iterations)
{
    static const float lamps[] = {0.5f, 0.2f, -0.3f, -0.4f, -0.1f, 0.6f};
    return (struct pair){.rooms = {room(lamps, 2), room(lamps, 2)},
                         .settings = {settings_for(SMALL, blockers, iterations),
                                      settings_for(LARGE, blockers, iterations)},
                         .z = -0.3f};
}

/* Adds what so many frames of one of them take, after the lamp has moved. */
static void run_one(struct pair *pair, int which, int frames, struct cost *cost)
{
    pair->z += 0.01f;
    run(pair->rooms[which], pair->settings[which], (float[3]){0.5f, 0.2f, pair->z}, frames, cost);
}

static void end_pair(struct pair *pair)
{
    brume_scene_destroy(pair->rooms[0]);
    brume_scene_destroy(pair->rooms[1]);
}

static const char *blockers_name(uint32_t blockers)
{
    return blockers == BRUME_BLOCKERS_LINKS ? "exact" : "fuzzy";
}

/* It hardly grows with the lattice. A frame of each takes about as long, so that the least of many
 * can be compared: other work only ever adds to it. */
static void injection_by_cells(void **state)
{
    (void)state;
    for (uint32_t blockers = 0; blockers < BRUME_BLOCKERS_COUNT; ++blockers) {
        struct pair pair = pair_of(blockers, 1);
        double least[2] = {INFINITY, INFINITY};
        bool as_held = false;
        for (int round = -1; round < MOST && !as_held; ++round) {
            for (int i = 0; i < 2; ++i) {
                struct cost cost = {0};
                run_one(&pair, i, 1, &cost);
                if (round >= 0) /* shaders were compiled before */
                    least[i] = fmin(least[i], injection(&cost));
            }
            as_held = round >= LEAST - 1 && least[1] <= 1.2 * least[0];
        }
        print_message("%s blockers: injection %.2f times\n", blockers_name(blockers),
                      least[1] / least[0]);
        end_pair(&pair);
        assert_true(as_held);
    }
}

/* They grow as the number of cells. */
static void iterations_by_cells(void **state)
{
    (void)state;
    for (uint32_t blockers = 0; blockers < BRUME_BLOCKERS_COUNT; ++blockers) {
        struct pair pair = pair_of(blockers, 4);
        struct cost costs[2] = {0};
        bool as_held = false;
        for (int round = -1; round < ROUNDS && !as_held; ++round) {
            if (round == 0)
                memset(costs, 0, sizeof costs);
            run_one(&pair, 0, round < 0 ? 1 : FRAMES, &costs[0]);
            run_one(&pair, 1, 1, &costs[1]);
            as_held = round >= 0 && costs[1].parts[BRUME_FIELD_ITERATIONS] <=
                                        8.5 * costs[0].parts[BRUME_FIELD_ITERATIONS];
        }
        print_message("%s blockers: iterations %.2f times\n", blockers_name(blockers),
                      costs[1].parts[BRUME_FIELD_ITERATIONS] /
                          costs[0].parts[BRUME_FIELD_ITERATIONS]);
        end_pair(&pair);
        assert_true(as_held);
    }
}

/* The paper's worst case, all of a lamp's light in one cell: a lamp in a box as small as that,
 * whose reflected light all goes to one cell and whose way through the medium is in one. */
static void all_in_one_cell(void **state)
{
    (void)state;
    static const float middle[3] = {0.011f, 0.012f, 0.013f};
    const brume_settings settings = settings_for(SMALL, BRUME_BLOCKERS_LINKS, 4);
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
        cmocka_unit_test(injection_by_cells),
        cmocka_unit_test(iterations_by_cells),
        cmocka_unit_test(all_in_one_cell),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
