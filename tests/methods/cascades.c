/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Lattices within one another: that the inner ones know the light from outside, show what is finer
 * in them, and stay where they are while the camera moves a little. */
#include "field.h"

#define CELLS 16
#define RINGS 6 /* of the inner lattice's cells, from its sides inwards */

static const uint32_t methods[] = {BRUME_METHOD_LPV, BRUME_METHOD_DOM};
static const char *const names[] = {"LPV", "DOM"};

static brume_settings settings_for(uint32_t method, int cells, int cascades)
{
    return (brume_settings){.method = method,
                            .medium_resolution = 32,
                            .lattice_resolution = 32,
                            .field_resolution = cells,
                            .cascades = cascades,
                            .shadow_resolution = 64,
                            .light_samples = 1,
                            .world_samples = 16};
}

static int ring_of(const int cell[3], const int dims[3])
{
    int ring = dims[0];
    for (int i = 0; i < 3; ++i) {
        const int last = dims[i] - 1 - cell[i], nearest = cell[i] < last ? cell[i] : last;
        ring = nearest < ring ? nearest : ring;
    }
    return ring;
}

/* Sums over a ring of cells: the fluence of a lattice of the finer cells, of that in the coarser
 * one, and of the coarser; and how far the latter two are from the first, where that is asked for.
 */
struct ring {
    double fine, within, coarse, within_off, coarse_off;
};

/* In a closed box with fog and a lamp. */
static void compare(uint32_t method, float sigma_s, float reflectance, const float lamp[3], bool with_fine,
                    struct ring rings[RINGS])
{
    const struct coefficients fog = {.sigma_s = {sigma_s, sigma_s, sigma_s},
                                     .sigma_a = {0.05f, 0.05f, 0.05f}};
    brume_scene *scene = empty();
    add_box(scene, 1, 1.0f, reflectance);
    add_fog_cube(scene, 2, origin, 1.0f, &fog);
    add_lamp(scene, 3, lamp, 1.0f);
    brume_settings settings = settings_for(method, CELLS, 1);
    struct field coarse = field_of(scene, &settings, NULL);
    settings = settings_for(method, CELLS, 2);
    struct field within = field_of(scene, &settings, NULL);
    settings = settings_for(method, 2 * CELLS, 1);
    struct field fine = with_fine ? field_of(scene, &settings, NULL) : coarse;
    within.level = 1;
    const int *dims = dims_of(&within);
    int cell[3];
    for (cell[2] = 0; cell[2] < dims[2]; ++cell[2])
        for (cell[1] = 0; cell[1] < dims[1]; ++cell[1])
            for (cell[0] = 0; cell[0] < dims[0]; ++cell[0]) {
                const int number = ring_of(cell, dims);
                if (number >= RINGS)
                    continue;
                struct ring *ring = &rings[number];
                float p[3];
                for (int i = 0; i < 3; ++i)
                    p[i] = centre(&within, i, cell[i]);
                const double f = fluence_at(&fine, p, 0), c = fluence_at(&coarse, p, 0);
                const double w = fluence(&within, cell, 0);
                ring->fine += f;
                ring->within += w;
                ring->coarse += c;
                ring->within_off += fabs(w - f);
                ring->coarse_off += fabs(c - f);
            }
    if (with_fine)
        free(fine.texels);
    free(within.texels);
    free(coarse.texels);
    brume_scene_destroy(scene);
}

/* As bright as the lattice around it: what comes in over its sides is all, and not more, in thin
 * and in thick fog, from afar and reflected to and fro. */
static void as_bright_as_around(void **state)
{
    (void)state;
    static const struct {
        float sigma_s, reflectance;
    } cases[] = {{0.5f, 0.3f}, {0.5f, 0.8f}, {4.0f, 0.3f}};
    const size_t count = sizeof cases / sizeof *cases;
    for (size_t k = 0; k < 2 * count; ++k) {
        const size_t i = k % count;
        struct ring rings[RINGS] = {0};
        compare(methods[k / count], cases[i].sigma_s, cases[i].reflectance,
                (float[3]){0.8f, 0.2f, -0.3f}, false, rings);
        for (int r = 0; r < RINGS; ++r) {
            print_message("%s, sigma_s %g, reflectance %g, ring %d: %.2f %%\n", names[k / count],
                          (double)cases[i].sigma_s, (double)cases[i].reflectance, r,
                          100.0 * (rings[r].within / rings[r].coarse - 1.0));
            assert_close(rings[r].within, rings[r].coarse, 0.03);
        }
    }
}

/* Where a lamp stands in it, light changes much from cell to cell: it is as finer cells have it. */
static void finer_within(void **state)
{
    (void)state;
    for (size_t k = 0; k < 2; ++k) {
        struct ring rings[RINGS] = {0};
        compare(methods[k], 0.5f, 0.3f, (float[3]){0.1f, 0.2f, -0.1f}, true, rings);
        double within = 0.0, coarse = 0.0, all = 0.0;
        for (int r = 3; r < RINGS; ++r) {
            within += rings[r].within_off;
            coarse += rings[r].coarse_off;
            all += rings[r].fine;
        }
        print_message("%s, off finer cells: within %.2f %%, around %.2f %%\n", names[k],
                      100.0 * within / all, 100.0 * coarse / all);
        assert_true(within < 0.5 * coarse);
    }
}

/* --- Around media, unasked --------------------------------------------------------------------- */

/* A little thick fog by a lamp, in a black room: what light there is goes on in the fog alone. */
static brume_scene *little_fog(void)
{
    const struct coefficients fog = {.sigma_s = {12, 12, 12}};
    brume_scene *scene = empty();
    add_box(scene, 1, 1.0f, 0.0f);
    add_fog_cube(scene, 2, (float[3]){0.1f, -0.1f, 0}, 0.2f, &fog);
    add_lamp(scene, 3, (float[3]){0.5f, 0.4f, 0.6f}, 1.0f);
    return scene;
}

/* With as many cells as the whole has the fog's light is as finer ones find it; and not for other
 * methods, nor where memory is short: then the whole stays as fine as it is. */
static void around_little_fog(void **state)
{
    (void)state;
    brume_scene *scene = little_fog();
    brume_settings settings = settings_for(BRUME_METHOD_DOM, CELLS, 0);
    struct field within = field_of(scene, &settings, NULL);
    assert_int_equal(within.level_count, 2);
    within.level = 1;
    assert_true(cell_of(&within) < 0.4f * within.levels[0].lower.w);
    settings = settings_for(BRUME_METHOD_DOM, CELLS, 1);
    struct field coarse = field_of(scene, &settings, NULL);
    assert_int_equal(coarse.level_count, 1);
    settings = settings_for(BRUME_METHOD_DOM, 3 * CELLS, 1);
    struct field fine = field_of(scene, &settings, NULL);
    double all = 0.0, coarse_off = 0.0, within_off = 0.0;
    int cell[3];
    const int *dims = dims_of(&within);
    for (cell[2] = 0; cell[2] < dims[2]; ++cell[2])
        for (cell[1] = 0; cell[1] < dims[1]; ++cell[1])
            for (cell[0] = 0; cell[0] < dims[0]; ++cell[0]) {
                static const float middle[3] = {0.1f, -0.1f, 0};
                float p[3], aside = 0.0f;
                for (int i = 0; i < 3; ++i) {
                    p[i] = centre(&within, i, cell[i]);
                    aside = fmaxf(aside, fabsf(p[i] - middle[i]));
                }
                if (aside > 0.2f)
                    continue;
                const double f = fluence_at(&fine, p, 0);
                all += f;
                coarse_off += fabs(fluence_at(&coarse, p, 0) - f);
                within_off += fabs(fluence(&within, cell, 0) - f);
            }
    print_message("fluence in a little fog, off finer cells: within %.2f %%, around %.2f %%\n",
                  100.0 * within_off / all, 100.0 * coarse_off / all);
    assert_true(within_off < 0.3 * coarse_off);
    free(within.texels);
    free(coarse.texels);
    free(fine.texels);

    settings = settings_for(BRUME_METHOD_LPV, CELLS, 0);
    struct field soft = field_of(scene, &settings, NULL);
    assert_int_equal(soft.level_count, 1);
    free(soft.texels);
    settings = settings_for(BRUME_METHOD_DOM, CELLS, 0);
    settings.memory_budget = 40u << 20;
    struct field small = field_of(scene, &settings, NULL);
    assert_int_equal(small.level_count, 1);
    assert_int_equal(dims_of(&small)[0], CELLS);
    free(small.texels);
    brume_scene_destroy(scene);
}

/* --- The focus -------------------------------------------------------------------------------- */

static uint64_t transports(brume_scene *scene, const brume_settings *settings,
                           const float target[3], struct field *out)
{
    const brume_view view = orthographic_view(target, (float[3]){0, 1, 0}, 0.5f, 0.5f, 4);
    brume_job *job = render(scene, settings, &view);
    brume_stats stats;
    assert_ok(brume_job_stats(job, &stats));
    brume_job_release(job);
    *out = (struct field){.scene = scene};
    device_call(device, fetch, out);
    free(out->texels);
    return stats.stages[BRUME_STAGE_TRANSPORT].runs;
}

static void around_the_camera(void **state)
{
    (void)state;
    brume_scene *scene = empty();
    add_box(scene, 1, 1.0f, 0.5f);
    add_fog_cube(scene, 2, (float[3]){0.4f, 0, 0}, 0.5f, &white_fog);
    add_lamp(scene, 3, (float[3]){0.5f, 0.2f, -0.3f}, 1.0f);
    brume_settings settings = settings_for(BRUME_METHOD_LPV, CELLS, 2);
    struct field there, here;
    /* The medium's middle, wherever the camera is. */
    const uint64_t first = transports(scene, &settings, (float[3]){-0.6f, 0, 0}, &there);
    assert_int_equal(transports(scene, &settings, (float[3]){0.6f, 0, 0}, &here), first);
    const float middle =
        there.levels[1].lower.x + 0.5f * (float)there.levels[1].dims.x * there.levels[1].lower.w;
    assert_true(fabsf(middle - 0.4f) < 0.13f);
    /* The camera's own: its side does not come nearer than that to the lattice around. */
    settings.cascade_focus = BRUME_FOCUS_CAMERA;
    const uint64_t begun = transports(scene, &settings, (float[3]){-0.3f, 0, 0}, &there);
    assert_int_equal(begun, first + 1);
    assert_int_equal(transports(scene, &settings, (float[3]){-0.31f, 0, 0}, &here), begun);
    assert_true(here.levels[1].lower.x == there.levels[1].lower.x);
    assert_int_equal(transports(scene, &settings, (float[3]){0.3f, 0, 0}, &here), begun + 1);
    assert_true(here.levels[1].lower.x > there.levels[1].lower.x + 0.3f);
    brume_scene_destroy(scene);
}

/* --- Hostile settings ------------------------------------------------------------------------- */

static void nothing_odd_of_few_cells(void **state)
{
    (void)state;
    static const int cells[] = {2, 3, 5, 9};
    brume_scene *scene = empty();
    add_box(scene, 1, 1.0f, 0.9f);
    add_fog_cube(scene, 2, origin, 1.0f, &white_fog);
    add_lamp(scene, 3, (float[3]){0.5f, 0.2f, -0.3f}, 1.0f);
    for (size_t i = 0; i < sizeof cells / sizeof *cells; ++i)
        for (uint32_t blockers = 0; blockers < BRUME_BLOCKERS_COUNT; ++blockers) {
            brume_settings settings = settings_for(BRUME_METHOD_LPV, cells[i], 3);
            settings.blockers = blockers;
            settings.iterations = 5;
            struct field field = field_of(scene, &settings, NULL);
            for (field.level = 0; field.level < 3; ++field.level)
                assert_sound(&field);
            free(field.texels);
        }
    brume_settings settings = settings_for(BRUME_METHOD_LPV, 8, 4);
    const brume_view view = orthographic_view(origin, (float[3]){0, 0, -1}, 0.1f, 5.0f, 4);
    brume_job *job = NULL;
    assert_int_equal(brume_render(scene, &settings, &view, &job), BRUME_E_ARGUMENT);
    settings = settings_for(BRUME_METHOD_LPV, 8, 1);
    settings.cascade_focus = 7;
    assert_int_equal(brume_render(scene, &settings, &view, &job), BRUME_E_ARGUMENT);
    brume_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(as_bright_as_around),
        cmocka_unit_test(finer_within),
        cmocka_unit_test(around_little_fog),
        cmocka_unit_test(around_the_camera),
        cmocka_unit_test(nothing_odd_of_few_cells),
    };
    cmocka_set_test_filter(getenv("BRUME_TESTS"));
    return cmocka_run_group_tests(tests, open_device, close_device);
}
