/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Where the lattice of scattered light lies: around walls that are flat and things that glow, not along
 * a ground as wide as it happens to be, and as far as endless fog sends light back from. */
#include "dom.h"

/* The walls of add_box(), a plate each. */
static void add_planes(brume_scene *scene, uint64_t first, float half, float reflectance)
{
    for (int i = 0; i < 6; ++i) {
        const float sign = i % 2 ? 1.0f : -1.0f;
        float middle[3] = {0}, across[3] = {0};
        middle[i / 2] = sign * half;
        across[i / 2] = sign;
        add_plate(scene, first + (uint64_t)i, middle, across, 2.0f * half);
        const brume_material matt = {
            .diffuse = {reflectance, reflectance, reflectance}, .roughness = 1, .alpha = 1};
        assert_ok(brume_scene_set_material(scene, first + (uint64_t)i, &matt));
    }
}

/* With and without something that stands in it, as much light as in a room that is one box. */
static void planes_are_a_room(void **state)
{
    (void)state;
    static const uint32_t methods[] = {BRUME_METHOD_DOM, BRUME_METHOD_LPV};
    for (size_t n = 0; n < 2; ++n)
        for (int vase = 0; vase < 2; ++vase) {
            brume_settings settings = settings_for(16);
            settings.method = methods[n];
            double mean[2];
            for (int planes = 0; planes < 2; ++planes) {
                brume_scene *scene = empty();
                if (planes)
                    add_planes(scene, 1, 1.0f, 0.6f);
                else
                    add_box(scene, 1, 1.0f, 0.6f);
                if (vase)
                    add_box_at(scene, 10, (float[3]){0.3f, 0.2f, -0.7f}, 0.1f, 0.3f);
                add_lamp(scene, 11, (float[3]){0.1f, -0.2f, 0.3f}, 100.0f);
                struct field field = field_of(scene, &settings, NULL);
                mean[planes] = mean_fluence(&field, 0);
                free(field.texels);
                brume_scene_destroy(scene);
            }
            print_message("method %u: a room of planes has %+.2f %% more light than a box\n",
                          methods[n], 100.0 * (mean[1] / mean[0] - 1.0));
            assert_true(mean[0] > 0.0);
            assert_close(mean[1], mean[0], 0.01);
        }
}

static float length_of(const struct field *field)
{
    const int *dims = dims_of(field);
    const int most = dims[0] > dims[1] ? dims[0] : dims[1];
    return cell_of(field) * (float)(most > dims[2] ? most : dims[2]);
}

static float lattice_length(brume_scene *scene)
{
    const brume_settings settings = settings_for(16);
    struct field field = field_of(scene, &settings, NULL);
    const float length = length_of(&field);
    free(field.texels);
    return length;
}

/* A ground of 50 m under a box of 1 m changes nothing, nor do a post and a board on it; walls around
 * do, but not a fence so far that the box would be a speck. */
static void a_ground_is_no_room(void **state)
{
    (void)state;
    brume_scene *scene = empty();
    add_box_at(scene, 1, (float[3]){0, 0, 0.5f}, 0.5f, 0.5f);
    add_plate(scene, 2, (float[3]){0, 0, 0}, down, 50.0f);
    const float alone = lattice_length(scene);
    assert_true(alone < 2.0f);
    add_plate(scene, 3, (float[3]){0.2f, 0, 1}, (float[3]){1, 0, 0}, 0.5f);
    add_plate(scene, 4, (float[3]){0, 0.2f, 1}, (float[3]){0, 1, 0}, 0.5f);
    assert_true(lattice_length(scene) < 2.0f);
    add_plate(scene, 3, (float[3]){2, 0, 2}, (float[3]){1, 0, 0}, 4.0f);
    add_plate(scene, 4, (float[3]){0, 2, 2}, (float[3]){0, 1, 0}, 4.0f);
    const float walls = lattice_length(scene);
    assert_true(walls > 3.9f && walls < 6.5f);
    add_plate(scene, 3, (float[3]){25, 0, 5}, (float[3]){1, 0, 0}, 50.0f);
    add_plate(scene, 4, (float[3]){0, 25, 5}, (float[3]){0, 1, 0}, 50.0f);
    assert_true(lattice_length(scene) < 2.0f);
    brume_scene_destroy(scene);
}

/* A square that glows over a wide ground: the light on one as large below it, by the form factor of two
 * parallel squares as far apart as they are wide (Siegel and Howell, Thermal Radiation Heat Transfer,
 * parallel rectangles). */
static void a_plate_lights_the_ground(void **state)
{
    (void)state;
    enum { PIXELS = 16 };
    const brume_material glow = {.emission = {1, 1, 1}, .roughness = 1, .alpha = 1};
    const brume_settings settings = settings_for(32);
    brume_scene *scene = empty();
    add_plate(scene, 1, (float[3]){0, 0, 0}, down, 50.0f);
    add_plate(scene, 2, (float[3]){0, 0, 2}, down, 2.0f);
    assert_ok(brume_scene_set_material(scene, 2, &glow));
    const brume_view view = orthographic_view(origin, down, 2.0f, 1.0f, PIXELS);
    brume_job *job = render(scene, &settings, &view);
    float *pixels = read_pass(job, &view, BRUME_PASS_COMBINED);
    brume_job_release(job);
    double found = 0.0;
    for (int i = 0; i < PIXELS * PIXELS; ++i)
        found += (double)pixels[4 * i] / (PIXELS * PIXELS);
    free(pixels);
    print_message("ground below a glowing plate: %.4f, by its form factor 0.1998\n", found);
    assert_close(found, 0.1998, 0.25); /* along 48 directions; without the lattice there 0.002 */
    brume_scene_destroy(scene);
}

/* Endless fog around a small scene: a lattice of twice the way that light goes in it. */
static void endless_fog_is_in_the_lattice(void **state)
{
    (void)state;
    brume_world world = {.has_volume = 1, .sigma_s = {0.5f, 0.5f, 0.5f}, .reach = -1.0f};
    brume_scene *scene = empty();
    add_box_at(scene, 1, origin, 0.5f, 0.5f);
    add_lamp(scene, 2, (float[3]){0, 0, 2}, 100.0f);
    assert_ok(brume_scene_set_world(scene, &world));
    const float length = lattice_length(scene);
    assert_true(length > 2.0f * 2.0f / 0.5f && length < 15.0f);
    add_plate(scene, 3, (float[3]){0, 0, -0.5f}, down, 1000.0f);
    assert_true(lattice_length(scene) < 15.0f);
    world.sigma_s[0] = world.sigma_s[1] = world.sigma_s[2] = 1e-4f; /* not so far that cells are coarse */
    assert_ok(brume_scene_set_world(scene, &world));
    assert_true(lattice_length(scene) < 25.0f);
    brume_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(planes_are_a_room),
        cmocka_unit_test(a_ground_is_no_room),
        cmocka_unit_test(a_plate_lights_the_ground),
        cmocka_unit_test(endless_fog_is_in_the_lattice),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
