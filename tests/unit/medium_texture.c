/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Media whose programs ask where a cell is: every kind of volume knows, in every space. */
#include "base/field.h"
#include "scene/medium.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

/* sigma_s = the position times `factor`, sigma_a = factor */
static const brume_instruction placed_code[] = {
    {.op = BRUME_OP_POSITION, .dst = 0, .a = BRUME_SPACE_OBJECT},
    {.op = BRUME_OP_MULTIPLY, .dst = 1, .a = 0, .b = 3},
    {.op = BRUME_OP_CONSTANT, .dst = 2},
};

/* Twice as long as wide, turned by a quarter about z, away from the world's middle: x of the object
 * is the world's y - 10, 2 to 4 times a half; all coordinates are above 0. */
static const float world_from_object[16] = {0, 2, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 20, 10, 5, 1};

static void object_from_world(const float world[3], double object[3])
{
    object[0] = 0.5 * (world[1] - 10.0);
    object[1] = 20.0 - world[0];
    object[2] = world[2] - 5.0;
}

static const float lower[3] = {1, 1, 2}, upper[3] = {2, 3, 4}; /* of all volumes, object space */

static struct volume *make(brume_volume source, uint32_t space, uint32_t grid)
{
    brume_instruction code[4];
    code[0] = grid ? (brume_instruction){.op = BRUME_OP_GRID, .dst = 3, .a = 0}
                   : (brume_instruction){.op = BRUME_OP_CONSTANT, .dst = 3, .value = {1, 1, 1}};
    memcpy(code + 1, placed_code, sizeof placed_code);
    code[1].a = space;
    source.name = "placed";
    source.program = (brume_volume_program){.instructions = code,
                                            .instruction_count = 4,
                                            .sigma_s = 1,
                                            .sigma_a = 3,
                                            .g = 2,
                                            .emission = 2};
    memcpy(source.world_from_object, world_from_object, sizeof world_from_object);
    for (int i = 0; i < 3; ++i) {
        source.generated_lower[i] = lower[i];
        source.generated_upper[i] = i == 2 ? lower[i] : upper[i]; /* flat */
    }
    struct volume *volume;
    assert_int_equal(volume_create(&source, &volume), BRUME_OK);
    return volume;
}

/* In cells that are full, or weighted by what there is in them. */
static void expect_positions(struct volume *volume, uint32_t space)
{
    struct medium_lattice lattice;
    assert_int_equal(medium_build(&volume, 1, 24, 0, NULL, NULL, &lattice), BRUME_OK);
    int seen = 0;
    for (int32_t k = 0; k < lattice.dims[2]; ++k)
        for (int32_t j = 0; j < lattice.dims[1]; ++j)
            for (int32_t i = 0; i < lattice.dims[0]; ++i) {
                const int32_t cell[3] = {i, j, k};
                const size_t at = 4 * (size_t)((k * lattice.dims[1] + j) * lattice.dims[0] + i);
                float world[3];
                double object[3], expected[3];
                for (int c = 0; c < 3; ++c)
                    world[c] = lattice.lower[c] + ((float)cell[c] + 0.5f) * lattice.cell;
                object_from_world(world, object);
                for (int c = 0; c < 3; ++c) {
                    expected[c] = space == BRUME_SPACE_OBJECT  ? object[c]
                                  : space == BRUME_SPACE_WORLD ? (double)world[c]
                                  : c == 2 ? 0.0
                                           : (object[c] - lower[c]) / (upper[c] - lower[c]);
                    const float scattered = lattice.scatter[at + (size_t)c];
                    const float there = lattice.extinct[at + (size_t)c] - scattered;
                    if (there > 0.01f) {
                        assert_float_equal(scattered / there, fmax(expected[c], 0.0), 2e-3);
                        ++seen;
                    }
                }
            }
    assert_true(seen > 1000);
    medium_finish(&lattice);
    volume_release(volume);
}

static void meshes_know_where_they_are(void **state)
{
    (void)state;
    static const uint32_t triangles[36] = {0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4,
                                           2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6};
    float positions[24];
    for (int i = 0; i < 8; ++i)
        for (int c = 0; c < 3; ++c)
            positions[3 * i + c] = i >> c & 1 ? upper[c] : lower[c];
    const brume_volume box = {
        .positions = positions, .triangles = triangles, .vertex_count = 8, .triangle_count = 12};
    for (uint32_t space = 0; space < BRUME_SPACE_COUNT; ++space)
        expect_positions(make(box, space, 0), space);
}

static void grids_know_where_they_are(void **state)
{
    (void)state;
    brume_grid_info info = {.name = "density", .channels = 1, .dims = {10, 20, 20}};
    const float object_from_array[16] = {0.1f, 0, 0, 0, 0, 0.1f, 0, 0, 0, 0, 0.1f, 0, 1, 1, 2, 1};
    memcpy(info.object_from_array, object_from_array, sizeof object_from_array);
    brume_grid *grid;
    assert_int_equal(field_create(&info, &grid), BRUME_OK);
    for (size_t i = 0; i < 10 * 20 * 20; ++i)
        grid->data[i] = 1.0f;
    const brume_volume source = {.grids = &grid, .grid_count = 1};
    for (uint32_t space = 0; space < BRUME_SPACE_COUNT; ++space)
        expect_positions(make(source, space, 1), space);
    field_release(grid);
}

/* What is 0 where all grids are need not be so elsewhere: here beyond x = 1.5 of the object. */
static void a_texture_shows_where_grids_are_zero(void **state)
{
    (void)state;
    const brume_instruction code[] = {
        {.op = BRUME_OP_POSITION, .dst = 0, .a = BRUME_SPACE_OBJECT},
        {.op = BRUME_OP_COMPONENT, .dst = 0, .a = 0, .b = 0},
        {.op = BRUME_OP_CONSTANT, .dst = 1, .value = {1.5f, 1.5f, 1.5f}},
        {.op = BRUME_OP_GREATER, .dst = 0, .a = 0, .b = 1},
        {.op = BRUME_OP_GRID, .dst = 1, .a = 0},
        {.op = BRUME_OP_ADD, .dst = 0, .a = 0, .b = 1},
        {.op = BRUME_OP_CONSTANT, .dst = 1},
    };
    brume_grid_info info = {.name = "density", .channels = 1, .dims = {10, 20, 20}};
    const float object_from_array[16] = {0.1f, 0, 0, 0, 0, 0.1f, 0, 0, 0, 0, 0.1f, 0, 1, 1, 2, 1};
    memcpy(info.object_from_array, object_from_array, sizeof object_from_array);
    brume_grid *grid;
    assert_int_equal(field_create(&info, &grid), BRUME_OK);
    memset(grid->data, 0, 10 * 20 * 20 * sizeof *grid->data);
    grid->data[0] = 1e-6f;
    brume_volume source = {.name = "dark",
                           .grids = &grid,
                           .grid_count = 1,
                           .program = {.instructions = code,
                                       .instruction_count = 7,
                                       .sigma_s = 0,
                                       .sigma_a = 1,
                                       .g = 1,
                                       .emission = 1}};
    for (int i = 0; i < 16; i += 5)
        source.world_from_object[i] = 1.0f;
    struct volume *volume;
    struct medium_lattice lattice;
    assert_int_equal(volume_create(&source, &volume), BRUME_OK);
    assert_int_equal(medium_build(&volume, 1, 40, 0, NULL, NULL, &lattice), BRUME_OK);
    double mass = 0.0;
    for (int32_t i = 0; i < lattice.dims[0] * lattice.dims[1] * lattice.dims[2]; ++i)
        mass += lattice.scatter[4 * i] * pow(lattice.cell, 3.0);
    assert_float_equal(mass, 0.5 * 2.0 * 2.0, 0.5 * lattice.cell * 2.0 * 2.0 + 1e-3);
    medium_finish(&lattice);
    volume_release(volume);
    field_release(grid);
}

static void gaussians_know_where_they_are(void **state)
{
    (void)state;
    const brume_gaussian ball = {
        .center = {1.5f, 2, 3}, .scale = 4, .color = {1, 1, 1}, .amplitude = 1};
    const brume_volume source = {.gaussians = &ball, .gaussian_count = 1};
    for (uint32_t space = 0; space < BRUME_SPACE_COUNT; ++space)
        expect_positions(make(source, space, 1), space);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(meshes_know_where_they_are),
        cmocka_unit_test(grids_know_where_they_are),
        cmocka_unit_test(a_texture_shows_where_grids_are_zero),
        cmocka_unit_test(gaussians_know_where_they_are),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
