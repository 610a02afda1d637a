/* SPDX-License-Identifier: GPL-3.0-or-later */
/* DOM that begins with the light that the scene had last: fewer iterations to the same light; and
 * that without it nothing is left of what was rendered before. */
#include "field.h"

#define CELLS 16

static brume_settings settings_for(int cells, uint32_t warm)
{
    return (brume_settings){.method = BRUME_METHOD_DOM,
                            .medium_resolution = 32,
                            .lattice_resolution = 32,
                            .field_resolution = cells,
                            .cascades = 1,
                            .ordinates = 26,
                            .warm = warm,
                            .shadow_resolution = 64,
                            .light_samples = 1,
                            .world_samples = 16};
}

/* A room with fog. */
static brume_scene *foggy_room(void)
{
    const struct coefficients fog = {.sigma_s = {2, 1, 0.5f}, .g = 0.5f};
    const brume_world world = {.color = {0.2f, 0.2f, 0.2f}};
    brume_scene *scene = empty();
    add_box(scene, 1, 1.0f, 0.6f);
    add_fog_cube(scene, 2, (float[3]){0.2f, 0, -0.2f}, 0.5f, &fog);
    assert_ok(brume_scene_set_world(scene, &world));
    return scene;
}

static void light_up(brume_scene *scene, float x)
{
    add_lamp(scene, 3, (float[3]){x, 0.3f, 0.7f}, 10.0f);
}

/* A lamp that moves a little, as far as it takes and roughly, and more cells than before. */
static void begins_with_the_last(void **state)
{
    (void)state;
    const brume_settings cold = settings_for(CELLS, 0), warm = settings_for(CELLS, 1);
    brume_settings rough = settings_for(CELLS / 2, 1);
    rough.converged = 0.03f;
    brume_stats stats;
    brume_scene *scene = foggy_room();
    light_up(scene, -0.50f);
    struct field fresh = field_of(scene, &cold, &stats);
    const uint32_t all = stats.iterations;
    light_up(scene, -0.46f);
    struct field moved = field_of(scene, &warm, &stats);
    const uint32_t after_a_move = stats.iterations;
    free(field_of(scene, &rough, NULL).texels);
    light_up(scene, -0.42f);
    free(field_of(scene, &rough, &stats).texels);
    const uint32_t roughly = stats.iterations;
    light_up(scene, -0.46f);
    struct field finer = field_of(scene, &warm, &stats);
    const uint32_t from_fewer_cells = stats.iterations;
    brume_scene_destroy(scene);

    scene = foggy_room();
    light_up(scene, -0.46f);
    struct field truth = field_of(scene, &cold, NULL);
    brume_scene_destroy(scene);
    print_message("iterations: cold %u, a lamp moved %u; to 3 %% %u; from fewer cells %u; "
                  "%.3f and %.3f %% off, the move %.2f %%\n",
                  all, after_a_move, roughly, from_fewer_cells,
                  100.0 * fields_apart(&moved, &truth, 3), 100.0 * fields_apart(&finer, &truth, 3),
                  100.0 * fields_apart(&fresh, &truth, 3));
    assert_true(after_a_move < all);
    assert_true(roughly <= 2);
    assert_true(from_fewer_cells < all);
    assert_true(fields_apart(&moved, &truth, 3) < 0.002);
    assert_true(fields_apart(&finer, &truth, 3) < 0.002);
    assert_true(fields_apart(&fresh, &truth, 3) > 0.005); /* or there was nothing to find */
    free(fresh.texels);
    free(moved.texels);
    free(finer.texels);
    free(truth.texels);
}

/* The light is the same to the bit, whatever the scene was before. */
static void cold_is_as_fresh(void **state)
{
    (void)state;
    const brume_settings cold = settings_for(CELLS, 0), warm = settings_for(CELLS, 1);
    brume_scene *scene = foggy_room();
    light_up(scene, -0.46f);
    struct field fresh = field_of(scene, &cold, NULL);
    light_up(scene, 0.50f);
    free(field_of(scene, &warm, NULL).texels);
    light_up(scene, -0.46f);
    free(field_of(scene, &warm, NULL).texels);
    struct field again = field_of(scene, &cold, NULL);
    assert_true(fields_apart(&again, &fresh, 3) == 0.0);
    free(fresh.texels);
    free(again.texels);
    brume_scene_destroy(scene);
}

/* A cube of fog that scatters strongly forwards, in a world's medium that does, too. */
static float *in_a_medium(brume_scene *scene, float sigma_s)
{
    const brume_settings cold = settings_for(CELLS, 0);
    const brume_world world = {
        .has_volume = 1, .sigma_s = {sigma_s, sigma_s, sigma_s}, .g = 0.9f, .reach = 1.0f};
    brume_view view = orthographic_view(origin, (float[3]){0.2f, 0.1f, 1}, 1.2f, 4.0f, 8);
    view.passes = 1u << BRUME_PASS_VOLUME_DIRECT;
    assert_ok(brume_scene_set_world(scene, &world));
    brume_job *job = render(scene, &cold, &view);
    float *pixels = read_pass(job, &view, BRUME_PASS_VOLUME_DIRECT);
    brume_job_release(job);
    return pixels;
}

/* So is the lamps' own light, whatever the world's medium was before. */
static void another_world_is_as_fresh(void **state)
{
    (void)state;
    const struct coefficients fog = {.sigma_s = {4, 4, 4}, .g = 0.9f};
    brume_scene *scenes[2] = {empty(), empty()};
    for (int i = 0; i < 2; ++i) {
        add_fog_cube(scenes[i], 1, origin, 0.5f, &fog);
        add_sun(scenes[i], 2, (float[3]){0, 0, -1});
    }
    free(in_a_medium(scenes[1], 2.0f));
    float *fresh = in_a_medium(scenes[0], 0.1f), *after = in_a_medium(scenes[1], 0.1f);
    assert_true(fresh[0] > 0.0f);
    assert_memory_equal(after, fresh, 8 * 8 * 3 * sizeof *fresh);
    free(fresh);
    free(after);
    brume_scene_destroy(scenes[0]);
    brume_scene_destroy(scenes[1]);
}

/* What was known is still there after a run that was given up. */
static void cancelled_run_loses_nothing(void **state)
{
    (void)state;
    const brume_settings warm = settings_for(CELLS, 1);
    const brume_view view = orthographic_view(origin, (float[3]){0, 0, -1}, 0.1f, 5.0f, 4);
    brume_stats stats;
    brume_scene *scene = foggy_room();
    light_up(scene, -0.50f);
    free(field_of(scene, &warm, NULL).texels);
    light_up(scene, 0.50f);
    brume_job *job;
    assert_ok(brume_render(scene, &warm, &view, &job));
    nanosleep(&(struct timespec){.tv_nsec = 50000000}, NULL);
    brume_job_cancel(job);
    brume_job_release(job);
    light_up(scene, -0.50f);
    free(field_of(scene, &warm, &stats).texels);
    assert_true(stats.iterations <= 1);
    brume_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(begins_with_the_last),
        cmocka_unit_test(cold_is_as_fresh),
        cmocka_unit_test(another_world_is_as_fresh),
        cmocka_unit_test(cancelled_run_loses_nothing),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
