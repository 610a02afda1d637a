/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Bad input through the public interface: each is refused with its id and a sentence that names the
 * thing, the datablock that stood there stays, what can be shown is shown, and a good render
 * works after each. */
#include "harness.h"

static const float origin[3];
static const float down[3] = {0, 0, -1};
static const struct coefficients fog = {.sigma_s = {1, 1, 1}};
static const brume_settings settings = {.medium_resolution = 8, .lattice_resolution = 4,
                                        .shadow_resolution = 16, .light_samples = 2,
                                        .world_samples = 4};

static brume_scene *scene;
static double good_value;

static brume_view small_view(void)
{
    brume_view view = orthographic_view(origin, down, 0.5f, 2.0f, 4);
    view.samples = 2;
    view.passes = (1u << BRUME_PASS_COUNT) - 1;
    return view;
}

/* The picture's middle; every value of it must be finite. */
static double value_now(void)
{
    const brume_view view = small_view();
    brume_job *job = render(scene, &settings, &view);
    double value = 0.0;
    for (uint32_t pass = 0; pass < BRUME_PASS_COUNT; ++pass) {
        float *pixels = read_pass(job, &view, pass);
        for (uint32_t i = 0; i < 16 * brume_pass_channels(pass); ++i)
            if (!isfinite(pixels[i]))
                fail_msg("value %u of the pass %s is %g", i, brume_pass_name(pass),
                         (double)pixels[i]);
        if (pass == BRUME_PASS_COMBINED)
            value = middle(pixels, &view, 4, 0);
        free(pixels);
    }
    brume_job_release(job);
    return value;
}

static int open_scene(void **state)
{
    (void)state;
    const brume_world world = {.color = {0.1f, 0.1f, 0.1f}};
    assert_ok(brume_scene_create(device, &scene));
    add_fog_cube(scene, 1, origin, 0.5f, &fog);
    add_plate(scene, 1, (float[3]){0, 0, -1}, down, 4.0f);
    add_sun(scene, 1, down);
    assert_ok(brume_scene_set_world(scene, &world));
    good_value = value_now();
    return good_value > 0.0 ? 0 : -1;
}

static int close_scene(void **state)
{
    (void)state;
    brume_scene_destroy(scene);
    return 0;
}

/* The call is refused with the id, in a sentence with the word, and the picture is the same. */
#define assert_refused(call, id, word)                                                             \
    do {                                                                                           \
        assert_string_equal(brume_result_name(call), #id);                                         \
        if (!strstr(brume_last_error(), word))                                                     \
            fail_msg("'%s' does not say '%s'", brume_last_error(), word);                          \
    } while (0)
#define assert_unharmed() assert_true(value_now() == good_value)

static brume_mesh square(const float *positions, const uint32_t *triangles)
{
    return (brume_mesh){.name = "Kite", .positions = positions, .triangles = triangles,
                        .vertex_count = 4, .triangle_count = 2};
}

static void meshes(void **state)
{
    (void)state;
    float positions[12] = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
    uint32_t triangles[6] = {0, 1, 2, 0, 2, 3};
    brume_mesh mesh = square(positions, triangles);
    triangles[4] = 4;
    assert_refused(brume_scene_set_mesh(scene, 1, &mesh), BRUME_E_MESH, "Kite");
    triangles[4] = UINT32_MAX;
    assert_refused(brume_scene_set_mesh(scene, 1, &mesh), BRUME_E_MESH, "Kite");
    triangles[4] = 2;
    positions[5] = NAN;
    assert_refused(brume_scene_set_mesh(scene, 1, &mesh), BRUME_E_MESH, "Kite");
    positions[5] = INFINITY;
    assert_refused(brume_scene_set_mesh(scene, 1, &mesh), BRUME_E_MESH, "Kite");
    mesh.positions = NULL;
    assert_refused(brume_scene_set_mesh(scene, 1, &mesh), BRUME_E_ARGUMENT, "positions");
    mesh = square(positions, NULL);
    assert_refused(brume_scene_set_mesh(scene, 1, &mesh), BRUME_E_ARGUMENT, "triangles");
    mesh.material_count = 1;
    assert_refused(brume_scene_set_mesh(scene, 1, &mesh), BRUME_E_ARGUMENT, "triangles");
    assert_refused(brume_scene_set_mesh(scene, 1, NULL), BRUME_E_ARGUMENT, "mesh");
    assert_unharmed();
}

/* Nothing to draw, or nothing to see of it: no error, and no NaN. */
static void empty_meshes(void **state)
{
    (void)state;
    const float positions[12] = {0};
    const uint32_t triangles[6] = {0, 1, 2, 0, 2, 3};
    const float cancelling[18] = {0, 0, 1, 0, 0, -1, 0, 0, 1, 0, 0, -1, 0, 0, 0, NAN, 0, 0};
    brume_mesh mesh = {.name = "nothing"};
    const brume_instances instances = {.world_from_object = identity, .mesh = 2, .count = 1,
                                       .visibility = BRUME_VISIBLE_CAMERA | BRUME_VISIBLE_SHADOW};
    assert_ok(brume_scene_set_mesh(scene, 2, &mesh));
    assert_ok(brume_scene_set_instances(scene, 2, &instances));
    assert_unharmed();
    mesh = square(positions, triangles); /* all in one point */
    assert_ok(brume_scene_set_mesh(scene, 2, &mesh));
    assert_close(value_now(), good_value, 0.01); /* the shadow maps reach to it */
    const float visible[12] = {-1, -1, -0.9f, 1, -1, -0.9f, 1, 1, -0.9f, -1, 1, -0.9f};
    mesh = square(visible, triangles);
    mesh.corner_normals = cancelling;
    assert_ok(brume_scene_set_mesh(scene, 2, &mesh));
    value_now();
    mesh.corner_normals = NULL;
    mesh.corner_uvs = cancelling;
    assert_ok(brume_scene_set_mesh(scene, 2, &mesh));
    value_now();
    assert_ok(brume_scene_remove(scene, BRUME_KIND_MESH, 2)); /* instances of a mesh that is gone */
    assert_unharmed();
    assert_ok(brume_scene_remove(scene, BRUME_KIND_INSTANCES, 2));
    assert_unharmed();
}

static void instances(void **state)
{
    (void)state;
    enum { COUNT = 7 };
    float matrices[COUNT][16];
    for (int i = 0; i < COUNT; ++i)
        memcpy(matrices[i], identity, sizeof identity);
    matrices[0][0] = NAN;
    matrices[1][12] = INFINITY;
    memset(matrices[2], 0, sizeof matrices[2]);
    matrices[3][10] = 0.0f;               /* flat */
    matrices[4][0] = matrices[4][1] = 1;  /* two axes fall together */
    matrices[4][4] = matrices[4][5] = 1;
    matrices[5][0] = matrices[5][5] = matrices[5][10] = 1e30f; /* beyond all numbers */
    matrices[6][14] = -1.0f;              /* where the good plate lies */
    const brume_instances set = {.world_from_object = matrices[0], .mesh = 1, .count = COUNT,
                                 .visibility = BRUME_VISIBLE_CAMERA | BRUME_VISIBLE_SHADOW};
    assert_ok(brume_scene_set_instances(scene, 1, &set));
    const brume_view view = small_view();
    brume_job *job = render(scene, &settings, &view);
    brume_stats stats;
    brume_job_status status;
    const char *id, *sentence;
    assert_ok(brume_job_stats(job, &stats));
    assert_int_equal(stats.triangle_count, 2);
    assert_ok(brume_job_poll(job, &status));
    assert_int_equal(status.warnings, 1);
    assert_ok(brume_job_warning(job, 0, &id, &sentence));
    assert_string_equal(id, "INSTANCES_LEFT_OUT");
    assert_non_null(strstr(sentence, "plate"));
    assert_int_equal(brume_job_warning(job, 1, &id, &sentence), BRUME_E_ARGUMENT);
    brume_job_release(job);
    const brume_instances missing = {.mesh = 1, .count = 1};
    assert_refused(brume_scene_set_instances(scene, 1, &missing), BRUME_E_ARGUMENT,
                   "world_from_object");
    assert_close(value_now(), good_value, 1e-5); /* the plate's axes stand otherwise */
    add_plate(scene, 1, (float[3]){0, 0, -1}, down, 4.0f);
    assert_unharmed();
}

static void materials_and_images(void **state)
{
    (void)state;
    brume_material material = {.name = "Chalk", .diffuse = {1, 1, 1}, .alpha = 1};
    material.emission[1] = NAN;
    assert_refused(brume_scene_set_material(scene, 1, &material), BRUME_E_ARGUMENT, "Chalk");
    material.emission[1] = 0.0f;
    material.alpha_mode = 3;
    assert_refused(brume_scene_set_material(scene, 1, &material), BRUME_E_ARGUMENT, "Chalk");

    float pixels[4 * 4] = {0};
    brume_image image = {.name = "Wall", .pixels = pixels, .width = 0, .height = 2};
    assert_refused(brume_scene_set_image(scene, 1, &image), BRUME_E_ARGUMENT, "width");
    image.width = -2;
    assert_refused(brume_scene_set_image(scene, 1, &image), BRUME_E_ARGUMENT, "width");
    image.width = INT32_MAX;
    assert_refused(brume_scene_set_image(scene, 1, &image), BRUME_E_ARGUMENT, "width");
    image.width = 2;
    image.extend = 4;
    assert_refused(brume_scene_set_image(scene, 1, &image), BRUME_E_ARGUMENT, "extend");
    image.extend = 0;
    image.pixels = NULL;
    assert_refused(brume_scene_set_image(scene, 1, &image), BRUME_E_ARGUMENT, "pixels");
    assert_unharmed();
}

/* Bad pixels of an environment read as black, bright ones do not overflow. */
static void images_with_bad_pixels(void **state)
{
    (void)state;
    float pixels[8 * 4 * 4];
    for (int i = 0; i < 8 * 4 * 4; ++i)
        pixels[i] = i % 7 == 0 ? NAN : i % 7 == 1 ? -INFINITY : i % 7 == 2 ? 2e5f : 0.5f;
    const brume_image image = {.name = "storm", .pixels = pixels, .width = 8, .height = 4};
    const brume_world sky = {.color = {1, 1, 1}, .image = 5};
    const brume_material painted = {.base_image = 5, .roughness_image = 5, .diffuse = {1, 1, 1},
                                    .specular = {0.04f, 0.04f, 0.04f}, .metal = {1, 1, 1},
                                    .roughness = 1, .alpha = 1,
                                    .alpha_mode = BRUME_ALPHA_BLEND, .alpha_from_base_image = 1};
    assert_ok(brume_scene_set_image(scene, 5, &image));
    assert_ok(brume_scene_set_world(scene, &sky));
    assert_ok(brume_scene_set_material(scene, 1, &painted));
    assert_true(value_now() > 0.0);
    const brume_world world = {.color = {0.1f, 0.1f, 0.1f}};
    assert_ok(brume_scene_set_world(scene, &world));
    add_plate(scene, 1, (float[3]){0, 0, -1}, down, 4.0f);
    assert_ok(brume_scene_remove(scene, BRUME_KIND_IMAGE, 5));
    assert_unharmed();
}

static void lights(void **state)
{
    (void)state;
    for (int field = 0; field < 5; ++field) {
        brume_light lamp = point_lamp((float[3]){0, 0, 2}, 1.0f);
        lamp.name = "Torch";
        float *const fields[] = {&lamp.power[1], &lamp.radius, &lamp.size[0], &lamp.spot_blend,
                                 &lamp.volume_factor};
        *fields[field] = field % 2 ? NAN : INFINITY;
        assert_refused(brume_scene_set_light(scene, 1, &lamp), BRUME_E_ARGUMENT, "Torch");
    }
    brume_light lamp = point_lamp((float[3]){0, 0, 2}, 1.0f);
    lamp.name = "Torch";
    lamp.world_from_light[13] = NAN;
    assert_refused(brume_scene_set_light(scene, 1, &lamp), BRUME_E_TRANSFORM, "Torch");
    lamp.world_from_light[13] = 0.0f;
    lamp.type = 5;
    assert_refused(brume_scene_set_light(scene, 1, &lamp), BRUME_E_ARGUMENT, "Torch");
    lamp.type = BRUME_LIGHT_RECTANGLE;
    lamp.size[0] = lamp.size[1] = 1e30f;
    assert_refused(brume_scene_set_light(scene, 1, &lamp), BRUME_E_ARGUMENT, "Torch");
    assert_unharmed();
}

/* No power, no size, no scale, on the surface itself: dark or bright, but finite. */
static void odd_lights(void **state)
{
    (void)state;
    static const float places[3][3] = {{0, 0, -1}, {0, 0, 0}, {0.5f, 0.5f, 0.5f}};
    for (uint32_t type = 0; type <= BRUME_LIGHT_ELLIPSE; ++type) {
        for (int odd = 0; odd < 5; ++odd) {
            brume_light lamp = point_lamp(places[odd % 3], odd == 0 ? 0.0f : 1e6f);
            lamp.type = type;
            lamp.spread = odd == 1 ? 1e-20f : 0.0f;
            lamp.angle = odd == 2 ? 100.0f : 0.0f;
            lamp.radius = odd == 2 ? 1e3f : 0.0f;
            lamp.size[0] = odd == 2 ? 1e3f : 0.0f;
            lamp.size[1] = odd == 4 ? 1.0f : lamp.size[0];
            lamp.spot_angle = odd == 2 ? 10.0f : 0.0f;
            if (odd == 3)
                memset(lamp.world_from_light, 0, 12 * sizeof(float));
            assert_ok(brume_scene_set_light(scene, 2, &lamp));
            value_now();
        }
    }
    assert_ok(brume_scene_remove(scene, BRUME_KIND_LIGHT, 2));
    assert_unharmed();
}

static void worlds(void **state)
{
    (void)state;
    const brume_world good = {.color = {0.1f, 0.1f, 0.1f}};
    brume_world world = good;
    world.color[2] = NAN;
    assert_refused(brume_scene_set_world(scene, &world), BRUME_E_ARGUMENT, "color");
    world = good;
    world.sigma_a[0] = INFINITY;
    assert_refused(brume_scene_set_world(scene, &world), BRUME_E_ARGUMENT, "sigma_a");
    world = good;
    world.reach = NAN;
    assert_refused(brume_scene_set_world(scene, &world), BRUME_E_ARGUMENT, "reach");
    world = good;
    world.image_from_world[15] = 1.0f; /* and nothing else */
    assert_refused(brume_scene_set_world(scene, &world), BRUME_E_TRANSFORM, "world");
    assert_refused(brume_scene_set_world(scene, NULL), BRUME_E_ARGUMENT, "world");
    assert_unharmed();
    world = good;
    world.has_volume = 1;
    world.sigma_s[0] = 1e30f;
    world.emission[1] = 1e30f;
    world.g = 5.0f;
    world.reach = 1e30f;
    assert_ok(brume_scene_set_world(scene, &world));
    value_now();
    assert_ok(brume_scene_set_world(scene, &good));
    assert_unharmed();
}

static void volumes(void **state)
{
    (void)state;
    float positions[24];
    uint32_t triangles[36];
    brume_instruction instructions[4];
    brume_volume volume = {.name = "Smoke", .positions = positions, .triangles = triangles,
                           .vertex_count = 8, .triangle_count = 12};
    cube_mesh(origin, 0.5f, positions, triangles);
    constant_program(&fog, instructions, &volume.program);
    memcpy(volume.world_from_object, identity, sizeof identity);

    volume.world_from_object[0] = 0.0f;
    assert_refused(brume_scene_set_volume(scene, 1, &volume), BRUME_E_TRANSFORM, "Smoke");
    volume.world_from_object[0] = NAN;
    assert_refused(brume_scene_set_volume(scene, 1, &volume), BRUME_E_TRANSFORM, "Smoke");
    volume.world_from_object[0] = 1.0f;
    triangles[7] = 8;
    assert_refused(brume_scene_set_volume(scene, 1, &volume), BRUME_E_MESH, "Smoke");
    triangles[7] = 5;
    positions[3] = NAN;
    assert_refused(brume_scene_set_volume(scene, 1, &volume), BRUME_E_MESH, "Smoke");
    positions[3] = 0.5f;
    volume.triangle_count = 0;
    assert_refused(brume_scene_set_volume(scene, 1, &volume), BRUME_E_MESH, "Smoke");
    volume.triangle_count = 12;
    volume.scale = -1.0f;
    assert_refused(brume_scene_set_volume(scene, 1, &volume), BRUME_E_ARGUMENT, "Smoke");
    volume.scale = 1.0f;
    instructions[1].op = BRUME_OP_COUNT;
    assert_refused(brume_scene_set_volume(scene, 1, &volume), BRUME_E_SHADER_PROGRAM, "Smoke");
    instructions[1].op = BRUME_OP_CONSTANT;
    volume.positions = NULL;
    assert_refused(brume_scene_set_volume(scene, 1, &volume), BRUME_E_ARGUMENT, "Smoke");
    assert_unharmed();

    const float bad[1] = {NAN};
    brume_grid *grid = NULL;
    const int32_t dims[3] = {1, 1, 1}, flat[3] = {1, 0, 1}, endless[3] = {1 << 30, 1 << 30, 1 << 30};
    assert_refused(brume_grid_create("Cloud", dims, 1, bad, identity, &grid), BRUME_E_GRID_VALUES,
                   "Cloud");
    assert_refused(brume_grid_create("Cloud", flat, 1, bad, identity, &grid), BRUME_E_ARGUMENT,
                   "dims");
    assert_refused(brume_grid_create("Cloud", endless, 1, bad, identity, &grid), BRUME_E_ARGUMENT,
                   "dims");
    assert_refused(brume_grid_create("Cloud", dims, 2, bad, identity, &grid), BRUME_E_ARGUMENT,
                   "channels");
    static const float zeros[16];
    assert_refused(brume_grid_create("Cloud", dims, 1, positions, zeros, &grid), BRUME_E_TRANSFORM,
                   "Cloud");
    assert_null(grid);
}

/* Coefficients beyond half floats are opaque, dark or bright, but not NaN. */
static void dense_volumes(void **state)
{
    (void)state;
    static const struct coefficients extremes[] = {
        {.sigma_s = {1e6f, 1e20f, 3e38f}},
        {.sigma_a = {1e6f, 1e20f, 3e38f}, .emission = {1e6f, 1e20f, 3e38f}},
        {.sigma_s = {3e38f, 3e38f, 3e38f}, .sigma_a = {3e38f, 3e38f, 3e38f}, .g = 1},
        {.sigma_s = {1e-30f, 0, 1e-38f}, .g = -1},
    };
    for (size_t i = 0; i < sizeof extremes / sizeof *extremes; ++i) {
        add_fog_cube(scene, 1, origin, 0.5f, &extremes[i]);
        value_now();
    }
    add_fog_cube(scene, 1, origin, 0.5f, &fog);
    assert_unharmed();
}

/* Bad ones are refused; those without amplitude show nothing, beside another medium or alone. */
static void gaussians(void **state)
{
    (void)state;
    brume_instruction instructions[4];
    brume_gaussian one = {.scale = -1, .color = {1, 1, 1}, .amplitude = 1};
    brume_volume volume = {.name = "Sparks", .gaussians = &one, .gaussian_count = 1};
    constant_program(&fog, instructions, &volume.program);
    memcpy(volume.world_from_object, identity, sizeof identity);
    assert_refused(brume_scene_set_volume(scene, 1, &volume), BRUME_E_ARGUMENT, "Sparks");
    one.scale = 1;
    volume.gaussian_count = 0;
    assert_refused(brume_scene_set_volume(scene, 1, &volume), BRUME_E_ARGUMENT, "Sparks");
    assert_unharmed();

    volume.gaussian_count = 1;
    one.amplitude = 0;
    assert_ok(brume_scene_set_volume(scene, 2, &volume));
    assert_unharmed();
    assert_ok(brume_scene_set_volume(scene, 1, &volume));
    value_now();
    one.amplitude = 3e38f;
    assert_ok(brume_scene_set_volume(scene, 1, &volume));
    value_now();
    assert_ok(brume_scene_remove(scene, BRUME_KIND_VOLUME, 2));
    add_fog_cube(scene, 1, origin, 0.5f, &fog);
    assert_unharmed();
}

static void keys_and_kinds(void **state)
{
    (void)state;
    assert_refused(brume_scene_remove(scene, 6, 1), BRUME_E_ARGUMENT, "kind");
    assert_refused(brume_scene_keep(scene, 99, NULL, 0), BRUME_E_ARGUMENT, "kind");
    assert_refused(brume_scene_keep(scene, BRUME_KIND_MESH, NULL, 1), BRUME_E_ARGUMENT, "keys");
    assert_ok(brume_scene_remove(scene, BRUME_KIND_LIGHT, 12345));
    assert_int_equal(brume_pass_channels(BRUME_PASS_COUNT), 0);
    assert_string_equal(brume_pass_name(99), "");
    assert_string_equal(brume_stage_name(99), "");
    assert_int_equal(brume_struct_size("brume_nothing"), 0);
    assert_int_equal(brume_struct_size(NULL), 0);
    assert_unharmed();
}

static void settings_and_views(void **state)
{
    (void)state;
    static const brume_settings bad_settings[] = {
        {.method = 99},           {.medium_resolution = -1},  {.medium_resolution = 100000},
        {.lattice_resolution = -1}, {.shadow_resolution = 1 << 20}, {.light_samples = -3},
        {.world_samples = 100000}, {.step = -1},              {.step = NAN},
        {.memory_budget = 1}};
    static const char *const settings_words[] = {"method", "medium", "medium", "lattice", "shadow",
                                                 "light",  "world",  "step",   "step",    "budget"};
    const brume_view good = small_view();
    brume_job *job = NULL;
    for (size_t i = 0; i < sizeof bad_settings / sizeof *bad_settings; ++i)
        assert_refused(brume_render(scene, &bad_settings[i], &good, &job), BRUME_E_ARGUMENT,
                       settings_words[i]);
    brume_view view = good;
    view.width = 0;
    assert_refused(brume_render(scene, &settings, &view, &job), BRUME_E_ARGUMENT, "width");
    view.width = INT32_MAX;
    view.height = INT32_MAX;
    assert_refused(brume_render(scene, &settings, &view, &job), BRUME_E_ARGUMENT, "width");
    view = good;
    view.view_from_world[0] = NAN;
    assert_refused(brume_render(scene, &settings, &view, &job), BRUME_E_TRANSFORM, "camera");
    view = good;
    memset(view.view_from_world, 0, sizeof view.view_from_world);
    assert_refused(brume_render(scene, &settings, &view, &job), BRUME_E_TRANSFORM, "camera");
    view = good;
    view.clip_from_view[0] = 0.0f;
    assert_refused(brume_render(scene, &settings, &view, &job), BRUME_E_TRANSFORM, "projection");
    view = good;
    view.clip_far = view.clip_near;
    assert_refused(brume_render(scene, &settings, &view, &job), BRUME_E_ARGUMENT, "clip");
    view = good;
    view.samples = UINT32_MAX;
    assert_refused(brume_render(scene, &settings, &view, &job), BRUME_E_ARGUMENT, "samples");
    view = good;
    view.filter_width = NAN;
    assert_refused(brume_render(scene, &settings, &view, &job), BRUME_E_ARGUMENT, "filter");
    assert_refused(brume_render(NULL, &settings, &good, &job), BRUME_E_ARGUMENT, "scene");
    assert_refused(brume_render(scene, &settings, NULL, &job), BRUME_E_ARGUMENT, "view");
    assert_null(job);

    view = good;
    view.passes = 0;
    job = render(scene, &settings, &view);
    float pixels[4 * 4 * 4];
    assert_refused(brume_job_read(job, BRUME_PASS_DEPTH, pixels, 16), BRUME_E_NOT_READY, "Depth");
    assert_refused(brume_job_read(job, BRUME_PASS_COUNT, pixels, 16), BRUME_E_ARGUMENT, "pass");
    assert_refused(brume_job_read(job, BRUME_PASS_COMBINED, pixels, 63), BRUME_E_ARGUMENT, "count");
    assert_refused(brume_job_read(job, BRUME_PASS_COMBINED, NULL, 64), BRUME_E_ARGUMENT, "pixels");
    brume_job_release(job);
    brume_job_release(NULL);
    brume_job_cancel(NULL);
    brume_scene_destroy(NULL);
    assert_unharmed();
}

/* Nothing at all is a picture too. */
static void empty_scene(void **state)
{
    (void)state;
    brume_scene *full = scene;
    assert_ok(brume_scene_create(device, &scene));
    assert_true(value_now() == 0.0);
    brume_scene_destroy(scene);
    scene = full;
}

static void twenty_thousand_instances(void **state)
{
    (void)state;
    enum { COUNT = 20000 };
    float *matrices = calloc(COUNT * 16, sizeof *matrices);
    assert_non_null(matrices);
    for (size_t i = 0; i < COUNT; ++i) {
        memcpy(matrices + 16 * i, identity, sizeof identity);
        matrices[16 * i + 14] = -1.0f;
    }
    const brume_instances many = {.world_from_object = matrices, .mesh = 1, .count = COUNT,
                                  .visibility = BRUME_VISIBLE_CAMERA};
    assert_ok(brume_scene_set_instances(scene, 2, &many));
    const brume_view view = small_view();
    brume_job *job = render(scene, &settings, &view);
    brume_stats stats;
    assert_ok(brume_job_stats(job, &stats));
    assert_int_equal(stats.triangle_count, 2 * COUNT + 2);
    brume_job_release(job);
    assert_close(value_now(), good_value, 1e-5);
    assert_ok(brume_scene_remove(scene, BRUME_KIND_INSTANCES, 2));
    free(matrices);
    assert_unharmed();
}

#define in_scene(test) cmocka_unit_test_setup_teardown(test, open_scene, close_scene)

int main(void)
{
    const struct CMUnitTest tests[] = {
        in_scene(meshes),          in_scene(empty_meshes),
        in_scene(instances),       in_scene(materials_and_images),
        in_scene(images_with_bad_pixels), in_scene(lights),
        in_scene(odd_lights),      in_scene(worlds),
        in_scene(volumes),         in_scene(dense_volumes),
        in_scene(gaussians),       in_scene(keys_and_kinds),
        in_scene(settings_and_views), in_scene(empty_scene),
        in_scene(twenty_thousand_instances),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
