/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Meshes as they are drawn: corners that are alike are one vertex, and each is where it was. */
#include "harness.h"

#include "scene/scene.h"

#include <math.h>

#define FAN 1000

static const float positions[] = {-1, -1, -1, 1, -1, -1, -1, 1, -1, 1, 1, -1,
                                  -1, -1, 1,  1, -1, 1,  -1, 1, 1,  1, 1, 1};
static const uint32_t triangles[] = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                     2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
static const uint16_t slots[12] = {1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0};
static const uint64_t materials[2] = {7, 8};

static struct mesh_block *made(const brume_mesh *source)
{
    struct block *block;
    assert_int_equal(mesh_create(source, &block), BRUME_OK);
    return (struct mesh_block *)block;
}

/* The corner of a drawn triangle. */
static const float *corner(const struct mesh_block *mesh, uint32_t triangle, int number)
{
    const uint32_t vertex = mesh->corners[3 * triangle + (uint32_t)number];
    assert_true(vertex < mesh->vertex_count);
    return mesh->vertices + VERTEX_FLOATS * (size_t)vertex;
}

static void smooth_and_flat(void **state)
{
    (void)state;
    float normals[3 * 36];
    for (int i = 0; i < 36; ++i)
        for (int k = 0; k < 3; ++k)
            normals[3 * i + k] = positions[3 * triangles[i] + (uint32_t)k] / sqrtf(3.0f);
    brume_mesh source = {.positions = positions, .vertex_count = 8, .triangles = triangles,
                         .triangle_count = 12, .corner_normals = normals};
    struct mesh_block *mesh = made(&source);
    assert_int_equal(mesh->vertex_count, 8);
    for (uint32_t t = 0; t < 12; ++t)
        for (int c = 0; c < 3; ++c) {
            const float *found = corner(mesh, t, c);
            assert_memory_equal(found, positions + 3 * triangles[3 * t + (uint32_t)c], 12);
            assert_memory_equal(found + 3, normals + 9 * t + 3 * (uint32_t)c, 12);
        }
    block_release(&mesh->block);

    source.corner_normals = NULL; /* four corners of each side are alike */
    mesh = made(&source);
    assert_int_equal(mesh->vertex_count, 24);
    for (int i = 0; i < 3; ++i) {
        assert_true(mesh->lower[i] == -1.0f);
        assert_true(mesh->upper[i] == 1.0f);
    }
    block_release(&mesh->block);
}

static void slots_in_turn(void **state)
{
    (void)state;
    const brume_mesh source = {.positions = positions, .vertex_count = 8, .triangles = triangles,
                               .triangle_count = 12, .triangle_slots = slots,
                               .materials = materials, .material_count = 2};
    struct mesh_block *mesh = made(&source);
    assert_int_equal(mesh->slot_first[1], 6);
    assert_int_equal(mesh->slot_first[2], 12);
    for (uint32_t t = 0; t < 12; ++t) {
        const uint32_t drawn = mesh->slot_first[slots[t]] + t / 2;
        for (int c = 0; c < 3; ++c)
            assert_memory_equal(corner(mesh, drawn, c),
                                positions + 3 * triangles[3 * t + (uint32_t)c], 12);
    }
    block_release(&mesh->block);
}

/* A flat fan: at its middle no two corners are alike. */
static void fan(void **state)
{
    (void)state;
    float rim[3 * (FAN + 1)] = {0.0f, 0.0f, 1.0f};
    uint32_t corners[3 * FAN];
    for (uint32_t i = 0; i < FAN; ++i) {
        const float angle = 6.2831853f * (float)i / FAN;
        rim[3 * (i + 1)] = cosf(angle);
        rim[3 * (i + 1) + 1] = sinf(angle);
        corners[3 * i] = 0;
        corners[3 * i + 1] = i + 1;
        corners[3 * i + 2] = (i + 1) % FAN + 1;
    }
    const brume_mesh source = {.positions = rim, .vertex_count = FAN + 1, .triangles = corners,
                               .triangle_count = FAN};
    struct mesh_block *mesh = made(&source);
    assert_int_equal(mesh->vertex_count, 3 * FAN);
    for (uint32_t t = 0; t < FAN; ++t)
        for (int c = 0; c < 3; ++c)
            assert_memory_equal(corner(mesh, t, c), rim + 3 * corners[3 * t + (uint32_t)c], 12);
    block_release(&mesh->block);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(smooth_and_flat),
        cmocka_unit_test(slots_in_turn),
        cmocka_unit_test(fan),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
