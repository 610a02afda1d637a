/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Closed forms of a homogeneous cube: Beer-Lambert in the view and through the lattice, an emitting
 * and absorbing slab, and the slab's single scattering. Tolerance 1 %, as the default lattice
 * promises. */
#include "harness.h"

static const float origin[3];

/* The 6 faces, 8 corners: the directions in which lattices err differently. */
static void direction_of(int index, float out[3])
{
    if (index < 6) {
        memset(out, 0, 3 * sizeof *out);
        out[index / 2] = index % 2 ? -1.0f : 1.0f;
    } else {
        for (int i = 0; i < 3; ++i)
            out[i] = (index - 6) >> i & 1 ? -1.0f : 1.0f;
    }
    unit(out);
}

/* Length of a chord through the middle of the cube [-1/2, 1/2]^3. */
static double chord(const float d[3])
{
    return 1.0 / fmax(fabs(d[0]), fmax(fabs(d[1]), fabs(d[2])));
}

static void view_transmittance(void **state)
{
    (void)state;
    brume_scene *scene;
    const struct coefficients fog = {.sigma_a = {0.5f, 2.0f, 4.0f}};
    assert_ok(brume_scene_create(device, &scene));
    add_fog_cube(scene, 1, origin, 0.5f, &fog);
    for (int index = 0; index < 14; ++index) {
        float d[3];
        direction_of(index, d);
        brume_view view = orthographic_view(origin, d, 0.001f, 3.0f, 8);
        view.passes = 1u << BRUME_PASS_TRANSMITTANCE;
        brume_job *job = render(scene, NULL, &view);
        float *pixels = read_pass(job, &view, BRUME_PASS_TRANSMITTANCE);
        for (uint32_t c = 0; c < 3; ++c)
            assert_close(middle(pixels, &view, 3, c), exp(-(double)fog.sigma_a[c] * chord(d)), 0.01);
        free(pixels);
        brume_job_release(job);
    }
    brume_scene_destroy(scene);
}

/* A white matt plate behind the cube, lit by a sun through the cube's middle and seen from the
 * side where the fog is not: its radiance is E cos / pi * exp(-tau). */
static void light_transmittance(void **state)
{
    (void)state;
    const struct coefficients fog = {.sigma_a = {0.5f, 2.0f, 4.0f}};
    for (int index = 0; index < 14; ++index) {
        float d[3], plate[3];
        direction_of(index, d);
        brume_scene *scene;
        assert_ok(brume_scene_create(device, &scene));
        add_fog_cube(scene, 1, origin, 0.5f, &fog);
        add_sun(scene, 1, d);
        /* A small square across the light's way, behind the cube. */
        float matrix[16];
        for (int i = 0; i < 3; ++i)
            plate[i] = 1.5f * d[i];
        placed(plate, d, matrix);
        const float square[12] = {-0.05f, -0.05f, 0, 0.05f, -0.05f, 0, 0.05f, 0.05f, 0, -0.05f, 0.05f, 0};
        const uint32_t triangles[6] = {0, 1, 2, 0, 2, 3};
        const uint64_t slots[1] = {1};
        const brume_material white = {.diffuse = {1, 1, 1}, .roughness = 1, .alpha = 1};
        const brume_mesh mesh = {.name = "plate", .positions = square, .triangles = triangles,
                                 .materials = slots, .vertex_count = 4, .triangle_count = 2,
                                 .material_count = 1};
        const brume_instances instances = {.world_from_object = matrix, .mesh = 1, .count = 1,
                                           .visibility = BRUME_VISIBLE_CAMERA |
                                                         BRUME_VISIBLE_SHADOW};
        assert_ok(brume_scene_set_material(scene, 1, &white));
        assert_ok(brume_scene_set_mesh(scene, 1, &mesh));
        assert_ok(brume_scene_set_instances(scene, 1, &instances));
        /* From between cube and plate, so closely that no chord misses the cube's corner by much. */
        brume_view view = orthographic_view(plate, d, 0.001f, 0.4f, 8);
        brume_job *job = render(scene, NULL, &view);
        float *pixels = read_pass(job, &view, BRUME_PASS_COMBINED);
        for (uint32_t c = 0; c < 3; ++c)
            assert_close(middle(pixels, &view, 4, c),
                         exp(-(double)fog.sigma_a[c] * chord(d)) / 3.14159265358979, 0.01);
        free(pixels);
        brume_job_release(job);
        brume_scene_destroy(scene);
    }
}

static void emitting_slab(void **state)
{
    (void)state;
    brume_scene *scene;
    const struct coefficients fog = {.sigma_a = {0.1f, 1.0f, 5.0f}, .emission = {2.0f, 3.0f, 4.0f}};
    assert_ok(brume_scene_create(device, &scene));
    add_fog_cube(scene, 1, origin, 0.5f, &fog);
    for (int index = 0; index < 14; ++index) {
        float d[3];
        direction_of(index, d);
        const brume_view view = orthographic_view(origin, d, 0.001f, 3.0f, 8);
        brume_job *job = render(scene, NULL, &view);
        float *pixels = read_pass(job, &view, BRUME_PASS_COMBINED);
        for (uint32_t c = 0; c < 3; ++c) {
            const double tau = fog.sigma_a[c] * chord(d);
            assert_close(middle(pixels, &view, 4, c),
                         fog.emission[c] / fog.sigma_a[c] * (1.0 - exp(-tau)), 0.01);
        }
        free(pixels);
        brume_job_release(job);
    }
    brume_scene_destroy(scene);
}

static double phase(double cosine, double g)
{
    return (1.0 - g * g) / (4.0 * 3.14159265358979 * pow(1.0 + g * g - 2.0 * g * cosine, 1.5));
}

/* Reflection of a slab of optical thickness tau, lit at mu0, seen at mu (after
 * Chandrasekhar, "Radiative Transfer", 1950, section 65): a wide plate of medium is the slab. */
static void scattering_slab(void **state)
{
    (void)state;
    static const float suns[3][3] = {{0, 0, -1}, {0.6f, 0, -0.8f}, {0, -0.8f, -0.6f}};
    static const float eyes[3][3] = {{0, 0, -1}, {-0.6f, 0, -0.8f}, {0.28f, 0, -0.96f}};
    static const double gs[2] = {0.0, 0.75};
    for (int variant = 0; variant < 2; ++variant) {
        const double g = gs[variant], tau = 2.0, albedo = 0.9;
        const struct coefficients fog = {
            .sigma_s = {1.8f, 1.8f, 1.8f}, .sigma_a = {0.2f, 0.2f, 0.2f}, .g = (float)g};
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
                brume_scene *scene;
                assert_ok(brume_scene_create(device, &scene));
                /* 4 m wide and 1 m thick: at these angles the middle sees no side. */
                float positions[24];
                uint32_t triangles[36];
                brume_instruction instructions[4];
                brume_volume slab = {.name = "slab", .positions = positions,
                                     .triangles = triangles, .vertex_count = 8,
                                     .triangle_count = 12};
                cube_mesh(origin, 0.5f, positions, triangles);
                constant_program(&fog, instructions, &slab.program);
                memcpy(slab.world_from_object, identity, sizeof identity);
                slab.world_from_object[0] = slab.world_from_object[5] = 4.0f;
                assert_ok(brume_scene_set_volume(scene, 1, &slab));
                add_sun(scene, 1, suns[i]);
                const brume_view view = orthographic_view(origin, eyes[j], 0.01f, 5.0f, 8);
                brume_job *job = render(scene, NULL, &view);
                float *pixels = read_pass(job, &view, BRUME_PASS_COMBINED);
                const double mu0 = -suns[i][2], mu = -eyes[j][2];
                double cosine = 0.0; /* between the light's way and the way to the eye */
                for (int k = 0; k < 3; ++k)
                    cosine -= (double)suns[i][k] * eyes[j][k];
                const double expected = albedo * phase(cosine, g) * mu0 / (mu + mu0) *
                                        (1.0 - exp(-tau * (1.0 / mu + 1.0 / mu0)));
                assert_close(middle(pixels, &view, 4, 1), expected, 0.01);
                free(pixels);
                brume_job_release(job);
                brume_scene_destroy(scene);
            }
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(view_transmittance),
        cmocka_unit_test(light_transmittance),
        cmocka_unit_test(emitting_slab),
        cmocka_unit_test(scattering_slab),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
