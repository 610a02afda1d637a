/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A memory budget is kept at every moment of a render, whatever the settings ask for, with warnings
 * by id and the picture still made; and the bytes of a pixel, a triangle and a cell are what the
 * budget is shared out by. */
#include "field.h"
#include "render/view.h"
#include "transport/dom.h"
#include "transport/medium_textures.h"

static const float down[3] = {0.2f, 0.1f, -1.0f};

static const brume_settings greedy = {.medium_resolution = 256, .lattice_resolution = 160,
                                      .shadow_resolution = 1024, .light_samples = 64,
                                      .world_samples = 64, .step = 8};

static brume_scene *full_scene(void)
{
    static const struct coefficients fog = {.sigma_s = {1, 1, 1}, .emission = {0.1f, 0.1f, 0.1f}};
    const brume_world world = {.color = {0.2f, 0.3f, 0.4f}};
    brume_light lamp = point_lamp((float[3]){0.4f, 0.6f, 1.5f}, 30.0f);
    lamp.radius = 0.2f;
    brume_scene *scene;
    assert_ok(brume_scene_create(device, &scene));
    add_fog_cube(scene, 1, origin, 0.5f, &fog);
    add_plate(scene, 1, (float[3]){0, 0, -1}, (float[3]){0, 0, -1}, 2.0f);
    assert_ok(brume_scene_set_light(scene, 1, &lamp));
    assert_ok(brume_scene_set_world(scene, &world));
    return scene;
}

static brume_view view_of(int32_t pixels)
{
    brume_view view = orthographic_view(origin, down, 2.0f, 3.0f, pixels);
    view.samples = 1;
    return view;
}

static int warned(brume_job *job, const char *wanted)
{
    brume_job_status status;
    assert_ok(brume_job_poll(job, &status));
    for (uint32_t i = 0; i < status.warnings; ++i) {
        const char *id, *sentence;
        assert_ok(brume_job_warning(job, i, &id, &sentence));
        if (strcmp(id, wanted) == 0) {
            assert_true(strlen(sentence) > 10);
            return 1;
        }
    }
    return 0;
}

/* Renders within the budget, and sees to it that it was: not only at the end, and not by leaving
 * most of it unused. */
static brume_job *render_within(brume_scene *scene, brume_settings settings, const brume_view *view,
                                uint64_t budget, brume_stats *stats)
{
    settings.memory_budget = budget;
    brume_job *job = render(scene, &settings, view);
    assert_ok(brume_job_stats(job, stats));
    if (stats->peak_bytes > budget)
        fail_msg("the peak is %llu of %llu bytes", (unsigned long long)stats->peak_bytes,
                 (unsigned long long)budget);
    assert_true(stats->total_bytes <= stats->peak_bytes);
    assert_int_equal(stats->total_bytes, stats->medium_bytes + stats->transport_bytes +
                                             stats->shadow_bytes + stats->mesh_bytes +
                                             stats->image_bytes + stats->target_bytes);
    float *pixels = read_pass(job, view, BRUME_PASS_COMBINED);
    assert_true(middle(pixels, view, 4, 0) > 0.0);
    free(pixels);
    return job;
}

static void greedy_settings_are_cut(void **state)
{
    (void)state;
    static const char *const ids[] = {"MEDIUM_COARSER", "LATTICE_COARSER", "SHADOWS_COARSER",
                                      "LIGHT_SAMPLES_FEWER"};
    const brume_view view = view_of(32);
    brume_scene *scene = full_scene();
    brume_stats stats;
    uint32_t warnings = 0;
    /* The second time nothing of the scene runs again, and its product is as coarse as it was. */
    for (int time = 0; time < 2; ++time) {
        brume_job *job = render_within(scene, greedy, &view, 8 << 20, &stats);
        for (int i = 0; i < 4; ++i)
            if (!warned(job, ids[i]))
                fail_msg("no warning %s at time %d", ids[i], time);
        brume_job_status status;
        assert_ok(brume_job_poll(job, &status));
        assert_true(time == 0 || status.warnings == warnings);
        warnings = status.warnings;
        assert_true(stats.peak_bytes > 3 << 20);
        assert_true(stats.medium_dims[0] < 256 && stats.medium_dims[0] > 32);
        assert_int_equal(stats.stages[BRUME_STAGE_MEDIUM].runs, 1);
        brume_job_release(job);
    }
    brume_scene_destroy(scene);
}

static void what_fits_is_left_alone(void **state)
{
    (void)state;
    static const char *const ids[] = {"MEDIUM_COARSER", "LATTICE_COARSER", "SHADOWS_COARSER",
                                      "LIGHT_SAMPLES_FEWER"};
    const brume_settings modest = {.medium_resolution = 16, .lattice_resolution = 8,
                                   .shadow_resolution = 32, .light_samples = 2,
                                   .world_samples = 4};
    const brume_view view = view_of(32);
    brume_scene *scene = full_scene();
    brume_stats stats;
    brume_job *job = render_within(scene, modest, &view, 8 << 20, &stats);
    for (int i = 0; i < 4; ++i)
        assert_false(warned(job, ids[i]));
    assert_int_equal(stats.medium_dims[0], 16);
    assert_int_equal(stats.transport_dims[0], 9);
    brume_job_release(job);
    brume_scene_destroy(scene);
}

/* What an earlier picture was given is taken back before this one takes its own. */
static void budgets_and_pictures_change(void **state)
{
    (void)state;
    brume_settings settings = greedy;
    settings.medium_resolution = 96;
    settings.lattice_resolution = 64;
    settings.shadow_resolution = 256;
    settings.light_samples = settings.world_samples = 16;
    static const struct {
        uint64_t budget;
        int32_t pixels;
    } turns[] = {{48 << 20, 16}, {8 << 20, 16}, {24 << 20, 400}, {24 << 20, 16},
                 {24 << 20, 440}, {6 << 20, 128}, {48 << 20, 16}};
    brume_scene *scene = full_scene();
    for (size_t i = 0; i < sizeof turns / sizeof *turns; ++i) {
        const brume_view view = view_of(turns[i].pixels);
        brume_stats stats;
        brume_job_release(render_within(scene, settings, &view, turns[i].budget, &stats));
    }
    brume_scene_destroy(scene);
}

/* Images and meshes count: with them there is less left for the lattices. */
static void images_and_meshes_count(void **state)
{
    (void)state;
    enum { SIDE = 512 };
    const brume_view view = view_of(32);
    brume_scene *scene = full_scene();
    brume_stats without, with;
    brume_job_release(render_within(scene, greedy, &view, 8 << 20, &without));
    float *pixels = calloc(SIDE * SIDE * 4, sizeof *pixels);
    assert_non_null(pixels);
    const brume_image image = {.name = "wide", .pixels = pixels, .width = SIDE, .height = SIDE};
    assert_ok(brume_scene_set_image(scene, 1, &image));
    brume_job_release(render_within(scene, greedy, &view, 8 << 20, &with));
    assert_true(with.image_bytes > SIDE * SIDE * 8);
    assert_true(with.medium_bytes < without.medium_bytes);
    pixels[0] = 1e6f; /* more than half floats hold */
    assert_ok(brume_scene_set_image(scene, 1, &image));
    brume_job_release(render_within(scene, greedy, &view, 8 << 20, &with));
    assert_true(with.image_bytes > SIDE * SIDE * 16);
    free(pixels);
    brume_scene_destroy(scene);
}

static void impossible_budgets_are_refused(void **state)
{
    (void)state;
    const brume_settings settings = {.memory_budget = 1 << 20};
    const brume_view view = view_of(1024);
    brume_scene *scene = full_scene();
    brume_job *job;
    brume_job_status status;
    assert_ok(brume_render(scene, &settings, &view, &job));
    assert_ok(brume_job_wait(job, -1, &status));
    assert_int_equal(status.state, BRUME_JOB_FAILED);
    assert_int_equal(status.result, BRUME_E_MEMORY);
    assert_non_null(strstr(brume_job_error(job), "memory budget is 1.0 MiB"));
    brume_job_release(job);
    const brume_settings none = {.memory_budget = 1};
    assert_int_equal(brume_render(scene, &none, &view, &job), BRUME_E_ARGUMENT);
    brume_scene_destroy(scene);
}

/* The constants that the budget is shared out by, against what is really held. */
static void bytes_of_pixels_and_cells(void **state)
{
    (void)state;
    const brume_settings settings = {.medium_resolution = 16, .lattice_resolution = 8,
                                     .shadow_resolution = 32};
    brume_scene *scene = full_scene();
    brume_stats small, large, stats;
    brume_view view = view_of(100);
    brume_job_release(render_within(scene, settings, &view, 64 << 20, &small));
    view = view_of(200);
    view.passes = (1u << BRUME_PASS_COUNT) - 1;
    brume_job_release(render_within(scene, settings, &view, 64 << 20, &large));
    /* The blocks, which both have, cancel. */
    assert_int_equal(large.target_bytes - small.target_bytes,
                     200 * 200 * (VIEW_PIXEL_BYTES + BRUME_PASS_COUNT * VIEW_PASS_PIXEL_BYTES) -
                         100 * 100 * (VIEW_PIXEL_BYTES + VIEW_PASS_PIXEL_BYTES));
    /* A power of two: its layers beyond the lattice count too, the more the smaller it is. */
    const double cells = 16.0 * 16.0 * 16.0;
    assert_true((double)small.medium_bytes / cells <= MEDIUM_CELL_BYTES);
    assert_true((double)small.medium_bytes / cells > MEDIUM_CELL_BYTES - 1.5);

    static const struct coefficients dark = {.sigma_s = {1, 1, 1}};
    add_fog_cube(scene, 1, origin, 0.5f, &dark);
    brume_job_release(render_within(scene, settings, &view, 64 << 20, &stats));
    assert_close((double)(small.medium_bytes - stats.medium_bytes) / (17.0 * 17.0 * 17.0), 8.0, 1e-9);
    brume_scene_destroy(scene);
}

/* The same of Discrete Ordinates' lattice, while the light in it is found: what one of 32 cells
 * along its sides takes more than one of 24. In smaller ones reflective maps weigh more. */
static void bytes_of_the_field(void **state)
{
    (void)state;
    static const int sides[2] = {24, 32};
    brume_scene *scene = full_scene();
    double told[2], peaks[2];
    for (int i = 0; i < 2; ++i) {
        const brume_settings settings = {.method = BRUME_METHOD_DOM,
                                         .medium_resolution = 8,
                                         .lattice_resolution = 8,
                                         .field_resolution = sides[i],
                                         .ordinates = 26,
                                         .iterations = 1,
                                         .shadow_resolution = 32};
        brume_stats stats;
        struct field field = field_of(scene, &settings, &stats);
        const int *dims = dims_of(&field);
        const double cells = (double)dims[0] * dims[1] * dims[2];
        const double slice = (sides[i] + 2.0) * (sides[i] + 2.0);
        told[i] = cells * (DOM_CELL_BYTES + DOM_WORKING_BYTES + 26 * DOM_ORDINATE_BYTES) +
                  slice * 26 * DOM_SLICE_BYTES;
        peaks[i] = (double)stats.peak_bytes;
        assert_int_equal(field.level_count, 1);
        free(field.texels);
    }
    print_message("held: %.3f of what is told\n", (peaks[1] - peaks[0]) / (told[1] - told[0]));
    assert_close(peaks[1] - peaks[0], told[1] - told[0], 0.02);
    brume_scene_destroy(scene);
}

/* 400 lamps of six maps each pass the maps that there are: some cast no shadow, none is lost. */
static void more_lamps_than_maps(void **state)
{
    (void)state;
    enum { LAMPS = 400 };
    const brume_settings settings = {.medium_resolution = 4, .lattice_resolution = 4,
                                     .shadow_resolution = 16, .light_samples = 8};
    brume_view view = orthographic_view((float[3]){0, 0, 0}, (float[3]){0, 0, -1}, 0.01f, 0.5f, 2);
    brume_scene *scene;
    assert_ok(brume_scene_create(device, &scene));
    add_plate(scene, 1, origin, (float[3]){0, 0, -1}, 1.0f);
    double values[2];
    for (int turn = 0; turn < 2; ++turn) {
        brume_light lamp = point_lamp((float[3]){0, 0, 2}, turn ? 100.0f : 100.0f / LAMPS);
        assert_ok(brume_scene_keep(scene, BRUME_KIND_LIGHT, NULL, 0));
        for (uint64_t key = 0; key < (turn ? 1 : LAMPS); ++key)
            assert_ok(brume_scene_set_light(scene, key, &lamp));
        brume_job *job = render(scene, &settings, &view);
        assert_int_equal(warned(job, "SHADOWS_LEFT_OUT"), turn == 0);
        float *pixels = read_pass(job, &view, BRUME_PASS_COMBINED);
        values[turn] = middle(pixels, &view, 4, 0);
        free(pixels);
        brume_job_release(job);
    }
    assert_close(values[0], values[1], 1e-4); /* sums of floats */
    brume_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(greedy_settings_are_cut),
        cmocka_unit_test(what_fits_is_left_alone),
        cmocka_unit_test(budgets_and_pictures_change),
        cmocka_unit_test(images_and_meshes_count),
        cmocka_unit_test(impossible_budgets_are_refused),
        cmocka_unit_test(bytes_of_pixels_and_cells),
        cmocka_unit_test(bytes_of_the_field),
        cmocka_unit_test(more_lamps_than_maps),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
