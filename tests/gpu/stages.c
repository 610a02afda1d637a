/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Which stages run again after which change, read from the stage counters: the promise of Table 1
 * of the OPV paper, that moving a light does not touch the medium and moving the camera touches
 * neither. */
#include "harness.h"

#define BIT(stage) (1u << BRUME_STAGE_##stage)

enum {
    VIEW = BIT(GBUFFER) | BIT(SHADE) | BIT(MARCH) | BIT(PASSES),
    LIGHTING = BIT(SHADOW) | BIT(TRANSPORT),
    EVERYTHING = (1 << BRUME_STAGE_COUNT) - 1,
};

static const float origin[3];
static const float down[3] = {0.3f, 0.2f, -1.0f};
static const struct coefficients fog = {.sigma_s = {1, 2, 3}, .sigma_a = {0.1f, 0.1f, 0.1f}};

struct fixture {
    brume_scene *scene;
    brume_settings settings;
    brume_view view;
    uint64_t runs[BRUME_STAGE_COUNT];
};

static brume_settings small_settings(void)
{
    return (brume_settings){.medium_resolution = 8,
                            .lattice_resolution = 6,
                            .shadow_resolution = 16,
                            .light_samples = 2,
                            .world_samples = 2};
}

/* Stages whose count has grown since the last call, as bits. A job that never began tells none. */
static uint32_t stages_run(struct fixture *fixture, brume_job *job)
{
    brume_stats stats;
    uint32_t bits = 0;
    assert_ok(brume_job_stats(job, &stats));
    for (int stage = 0; stage < BRUME_STAGE_COUNT; ++stage) {
        if (stats.stages[stage].runs <= fixture->runs[stage])
            continue;
        bits |= 1u << stage;
        fixture->runs[stage] = stats.stages[stage].runs;
    }
    return bits;
}

static uint32_t rerun(struct fixture *fixture)
{
    brume_job *job = render(fixture->scene, &fixture->settings, &fixture->view);
    const uint32_t bits = stages_run(fixture, job);
    brume_job_release(job);
    return bits;
}

static const char *names_of(uint32_t bits, char *out, size_t size)
{
    out[0] = '\0';
    for (uint32_t stage = 0; stage < BRUME_STAGE_COUNT; ++stage)
        if (bits & (1u << stage)) {
            strncat(out, brume_stage_name(stage), size - strlen(out) - 1);
            strncat(out, " ", size - strlen(out) - 1);
        }
    return out;
}

#define assert_reruns(fixture, expected)                                                           \
    do {                                                                                           \
        char ran_[128], wanted_[128];                                                              \
        const uint32_t bits_ = rerun(fixture);                                                     \
        if (bits_ != (uint32_t)(expected))                                                         \
            fail_msg("ran: %s; expected: %s", names_of(bits_, ran_, sizeof ran_),                  \
                     names_of(expected, wanted_, sizeof wanted_));                                 \
    } while (0)

static void set_lamp(brume_scene *scene, float x)
{
    brume_light lamp = point_lamp((float[3]){x, 0, 2}, 10.0f);
    lamp.radius = 0.1f;
    assert_ok(brume_scene_set_light(scene, 2, &lamp));
}

static struct fixture open_fixture(void)
{
    struct fixture fixture = {.settings = small_settings(),
                              .view = orthographic_view(origin, down, 2.0f, 3.0f, 8)};
    const brume_world world = {.color = {0.2f, 0.3f, 0.4f}};
    fixture.view.samples = 1;
    assert_ok(brume_scene_create(device, &fixture.scene));
    add_fog_cube(fixture.scene, 1, origin, 0.5f, &fog);
    add_plate(fixture.scene, 1, (float[3]){0, 0, -1}, (float[3]){0, 0, -1}, 2.0f);
    add_sun(fixture.scene, 1, down);
    set_lamp(fixture.scene, 0.0f);
    assert_ok(brume_scene_set_world(fixture.scene, &world));
    assert_reruns(&fixture, EVERYTHING);
    return fixture;
}

static void nothing_changed(void **state)
{
    (void)state;
    struct fixture f = open_fixture();
    assert_reruns(&f, VIEW);
    assert_reruns(&f, VIEW);
    brume_scene_destroy(f.scene);
}

static void view_changes(void **state)
{
    (void)state;
    struct fixture f = open_fixture();
    f.view = orthographic_view(origin, (float[3]){1, 0, -0.5f}, 1.0f, 3.0f, 8);
    f.view.samples = 1;
    assert_reruns(&f, VIEW);
    f.view.width = 12;
    assert_reruns(&f, VIEW);
    f.view.passes = (1u << BRUME_PASS_COUNT) - 1;
    assert_reruns(&f, VIEW);
    f.view.samples = 3;
    assert_reruns(&f, VIEW);
    f.view.seed = 7;
    assert_reruns(&f, VIEW);
    f.settings.step = 0.5f;
    assert_reruns(&f, VIEW);
    brume_scene_destroy(f.scene);
}

static void light_changes(void **state)
{
    (void)state;
    struct fixture f = open_fixture();
    set_lamp(f.scene, 0.5f);
    assert_reruns(&f, LIGHTING | VIEW);
    assert_ok(brume_scene_remove(f.scene, BRUME_KIND_LIGHT, 2));
    assert_reruns(&f, LIGHTING | VIEW);
    const brume_world world = {.color = {1, 1, 1}};
    assert_ok(brume_scene_set_world(f.scene, &world));
    assert_reruns(&f, LIGHTING | VIEW);
    brume_scene_destroy(f.scene);
}

static void medium_changes(void **state)
{
    (void)state;
    struct fixture f = open_fixture();
    const struct coefficients thin = {.sigma_s = {0.1f, 0.1f, 0.1f}};
    add_fog_cube(f.scene, 1, origin, 0.5f, &thin);
    assert_reruns(&f, BIT(MEDIUM) | BIT(TRANSPORT) | VIEW);
    assert_ok(brume_scene_remove(f.scene, BRUME_KIND_VOLUME, 1));
    assert_reruns(&f, BIT(MEDIUM) | BIT(TRANSPORT) | VIEW);
    brume_scene_destroy(f.scene);
}

static void surface_changes(void **state)
{
    (void)state;
    struct fixture f = open_fixture();
    const brume_material red = {.diffuse = {1, 0, 0}, .roughness = 1, .alpha = 1};
    assert_ok(brume_scene_set_material(f.scene, 1, &red));
    assert_reruns(&f, BIT(UPLOAD) | LIGHTING | VIEW);
    assert_ok(brume_scene_remove(f.scene, BRUME_KIND_INSTANCES, 1));
    assert_reruns(&f, BIT(UPLOAD) | LIGHTING | VIEW);
    brume_scene_destroy(f.scene);
}

static void settings_changes(void **state)
{
    (void)state;
    struct fixture f = open_fixture();
    f.settings.medium_resolution = 9;
    assert_reruns(&f, BIT(MEDIUM) | BIT(TRANSPORT) | VIEW);
    f.settings.lattice_resolution = 5;
    assert_reruns(&f, BIT(TRANSPORT) | VIEW);
    f.settings.shadow_resolution = 32;
    assert_reruns(&f, LIGHTING | VIEW);
    f.settings.light_samples = 3;
    assert_reruns(&f, LIGHTING | VIEW);
    f.settings.world_samples = 4;
    assert_reruns(&f, LIGHTING | VIEW);
    /* A budget that everything fits with room to spare changes nothing. */
    f.settings.memory_budget = 1ull << 30;
    assert_reruns(&f, VIEW);
    brume_scene_destroy(f.scene);
}

/* What a job redid, in all: shadow maps, lamps' tiles, the sky. */
static void assert_redone(const struct fixture *f, uint32_t maps, uint32_t lamps, uint32_t sky)
{
    brume_stats stats;
    brume_job *job = render(f->scene, &f->settings, &f->view);
    assert_ok(brume_job_stats(job, &stats));
    brume_job_release(job);
    if (stats.shadow_maps_drawn != maps || stats.lights_propagated != lamps ||
        stats.sky_propagated != sky)
        fail_msg("drew %u maps, propagated %u lamps and %u skies; expected %u, %u, %u",
                 stats.shadow_maps_drawn, stats.lights_propagated, stats.sky_propagated, maps,
                 lamps, sky);
}

/* Bit for bit what a scene that never was another shows. */
static void assert_as_new(const struct fixture *f, void (*fill)(brume_scene *scene))
{
    brume_scene *scenes[2] = {f->scene};
    float *pixels[2];
    assert_ok(brume_scene_create(device, &scenes[1]));
    fill(scenes[1]);
    for (int i = 0; i < 2; ++i) {
        brume_job *job = render(scenes[i], &f->settings, &f->view);
        pixels[i] = read_pass(job, &f->view, BRUME_PASS_COMBINED);
        brume_job_release(job);
    }
    assert_memory_equal(pixels[0], pixels[1], 8 * 8 * 4 * sizeof(float));
    free(pixels[0]);
    free(pixels[1]);
    brume_scene_destroy(scenes[1]);
}

enum { LAMPS = 8, LAMP_MAPS = 2 * 6, WORLD_MAPS = 6 }; /* two samples of six faces */

static void set_ball(brume_scene *scene, uint64_t key, float x, float power)
{
    brume_light lamp = point_lamp((float[3]){x, 0.5f * (float)key - 1.5f, 2}, power);
    lamp.radius = 0.3f;
    assert_ok(brume_scene_set_light(scene, key, &lamp));
}

static void fill_with_lamps(brume_scene *scene)
{
    const brume_world world = {.color = {0.2f, 0.3f, 0.4f}};
    add_fog_cube(scene, 1, origin, 0.5f, &fog);
    add_plate(scene, 1, (float[3]){0, 0, -1}, (float[3]){0, 0, -1}, 2.0f);
    for (uint64_t key = 0; key < LAMPS; ++key)
        set_ball(scene, key, 0.3f, 5.0f);
    assert_ok(brume_scene_set_world(scene, &world));
}

static void fill_with_moved_lamp(brume_scene *scene)
{
    fill_with_lamps(scene);
    set_ball(scene, 3, -0.6f, 5.0f);
}

static void work_grows_with_changes(void **state)
{
    (void)state;
    struct fixture f = {.settings = small_settings(),
                        .view = orthographic_view(origin, down, 2.0f, 3.0f, 8)};
    f.view.samples = 2;
    f.settings.world_samples = WORLD_MAPS;
    assert_ok(brume_scene_create(device, &f.scene));
    fill_with_lamps(f.scene);
    assert_redone(&f, LAMPS * LAMP_MAPS + WORLD_MAPS, LAMPS, 1);
    assert_redone(&f, 0, 0, 0);

    /* One lamp moves: its maps, its tile; there and back. */
    set_ball(f.scene, 3, -0.6f, 5.0f);
    assert_redone(&f, LAMP_MAPS, 1, 0);
    assert_as_new(&f, fill_with_moved_lamp);
    set_ball(f.scene, 3, 0.3f, 5.0f);
    assert_redone(&f, LAMP_MAPS, 1, 0);
    assert_as_new(&f, fill_with_lamps);
    set_ball(f.scene, 3, 0.3f, 7.0f); /* brighter, where it was */
    assert_redone(&f, 0, 0, 0);
    set_ball(f.scene, 3, 0.3f, 0.0f); /* out: another layout of the tiles */
    assert_redone(&f, 0, LAMPS - 1, 0);
    set_ball(f.scene, 3, 0.3f, 5.0f);
    assert_redone(&f, 0, LAMPS, 0);
    assert_as_new(&f, fill_with_lamps);

    f.view.seed = 3;
    assert_redone(&f, 0, 0, 0);
    const struct coefficients thin = {.sigma_s = {0.1f, 0.1f, 0.1f}};
    add_fog_cube(f.scene, 1, origin, 0.5f, &thin);
    assert_redone(&f, 0, LAMPS, 1);
    add_fog_cube(f.scene, 1, origin, 0.5f, &fog);
    assert_redone(&f, 0, LAMPS, 1);
    const brume_world brighter = {.color = {1, 1, 1}};
    assert_ok(brume_scene_set_world(f.scene, &brighter)); /* from the same directions */
    assert_redone(&f, 0, 0, 1);

    /* A caster changes: every map, and the world's light in the medium, which they shadow. */
    add_plate(f.scene, 1, (float[3]){0, 0.1f, -1}, (float[3]){0, 0, -1}, 2.0f);
    assert_redone(&f, LAMPS * LAMP_MAPS + WORLD_MAPS, 0, 1);
    /* Lamps come and go: another layout. */
    assert_ok(brume_scene_remove(f.scene, BRUME_KIND_LIGHT, 0));
    rerun(&f);
    fill_with_lamps(f.scene);
    rerun(&f);
    assert_as_new(&f, fill_with_lamps);
    brume_scene_destroy(f.scene);
}

/* A job cancelled before it began has run nothing; the change that it would have worked on is still
 * worked on by the next. */
static void cancelled_stages_run_again(void **state)
{
    (void)state;
    struct fixture f = open_fixture();
    brume_job *blocker, *job;
    brume_view long_view = f.view;
    long_view.samples = 4096;
    set_lamp(f.scene, 0.7f);
    assert_ok(brume_render(f.scene, &f.settings, &long_view, &blocker));
    assert_ok(brume_render(f.scene, &f.settings, &f.view, &job));
    brume_job_cancel(job);
    brume_job_cancel(blocker);
    brume_job_status status;
    assert_ok(brume_job_wait(job, -1, &status));
    assert_int_equal(status.state, BRUME_JOB_CANCELLED);
    assert_int_equal(status.result, BRUME_E_CANCELLED);
    assert_ok(brume_job_wait(blocker, -1, &status));
    assert_int_equal(status.state, BRUME_JOB_CANCELLED);
    const uint32_t before = stages_run(&f, blocker);
    /* Between the two of them the lamp's change is worked on exactly once, wherever the cancel hit. */
    const uint32_t after = rerun(&f);
    assert_int_equal(after & VIEW, VIEW);
    assert_int_equal((before | after) & LIGHTING, LIGHTING);
    assert_int_equal(after & (BIT(UPLOAD) | BIT(MEDIUM)), 0);
    assert_reruns(&f, VIEW);
    brume_job_release(job);
    brume_job_release(blocker);
    brume_scene_destroy(f.scene);
}

/* A stage that fails says so on every render, and works once its input is sound. */
static void failed_stages_run_again(void **state)
{
    (void)state;
    struct fixture f = open_fixture();
    const brume_settings sound = f.settings;
    f.settings.memory_budget = 1 << 20; /* the least, of which a picture of 512 x 512 leaves nothing */
    const brume_view small = f.view;
    f.view.width = f.view.height = 512;
    for (int i = 0; i < 2; ++i) {
        brume_job *job;
        brume_job_status status;
        assert_ok(brume_render(f.scene, &f.settings, &f.view, &job));
        assert_ok(brume_job_wait(job, -1, &status));
        assert_int_equal(status.state, BRUME_JOB_FAILED);
        assert_int_equal(status.result, BRUME_E_MEMORY);
        assert_non_null(strstr(brume_job_error(job), "budget"));
        assert_int_equal(stages_run(&f, job), 0);
        brume_job_release(job);
    }
    f.settings = sound;
    f.view = small;
    assert_reruns(&f, VIEW);
    brume_scene_destroy(f.scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_changed),     cmocka_unit_test(view_changes),
        cmocka_unit_test(light_changes),       cmocka_unit_test(medium_changes),
        cmocka_unit_test(surface_changes),     cmocka_unit_test(settings_changes),
        cmocka_unit_test(work_grows_with_changes),
        cmocka_unit_test(cancelled_stages_run_again), cmocka_unit_test(failed_stages_run_again),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
