/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The medium's lattice: no mass is lost, volumes add, transforms hold, bad volumes are named. */
#include "base/field.h"
#include "base/result.h"
#include "math/frame.h"
#include "scene/medium.h"
#include "scene/resample.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <omp.h>

/* --- Makers ------------------------------------------------------------------------------- */

/* sigma_s = grid 0 * colour, sigma_a = grid 0 * 0.5, g, no emission */
static const brume_instruction smoke_code[] = {
    {.op = BRUME_OP_GRID, .dst = 0, .a = 0},
    {.op = BRUME_OP_CONSTANT, .dst = 1, .value = {1.0f, 0.5f, 0.25f}},
    {.op = BRUME_OP_MULTIPLY, .dst = 2, .a = 0, .b = 1},
    {.op = BRUME_OP_CONSTANT, .dst = 3, .value = {0.5f, 0.5f, 0.5f}},
    {.op = BRUME_OP_MULTIPLY, .dst = 4, .a = 0, .b = 3},
    {.op = BRUME_OP_CONSTANT, .dst = 5, .value = {0.3f, 0.3f, 0.3f}},
    {.op = BRUME_OP_CONSTANT, .dst = 6},
};
static const brume_volume_program smoke = {.instructions = smoke_code,
                                           .instruction_count = 7,
                                           .sigma_s = 2,
                                           .sigma_a = 4,
                                           .g = 5,
                                           .emission = 6};

/* A medium that is the same everywhere; its registers are its results. */
static brume_volume_program constant_program(brume_instruction code[4], float sigma_s,
                                             float sigma_a, float g, float emission)
{
    const float values[4] = {sigma_s, sigma_a, g, emission};
    for (uint32_t i = 0; i < 4; ++i)
        code[i] = (brume_instruction){
            .op = BRUME_OP_CONSTANT, .dst = i, .value = {values[i], values[i], values[i]}};
    return (brume_volume_program){.instructions = code,
                                  .instruction_count = 4,
                                  .sigma_s = 0,
                                  .sigma_a = 1,
                                  .g = 2,
                                  .emission = 3};
}

static brume_grid *grid_make(int32_t nx, int32_t ny, int32_t nz, int32_t channels,
                             const float object_from_array[16])
{
    brume_grid_info info = {.name = "density", .channels = channels, .dims = {nx, ny, nz}};
    memcpy(info.object_from_array, object_from_array, sizeof info.object_from_array);
    brume_grid *grid;
    assert_int_equal(field_create(&info, &grid), BRUME_OK);
    return grid;
}

/* Voxels that fill the cube from 0 to 1 (along the longest side). */
static void unit_from_array(int32_t longest, float out[16])
{
    mat4_identity(out);
    for (int i = 0; i < 3; ++i)
        out[5 * i] = 1.0f / (float)longest;
}

static float random_float(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (float)(*state >> 8) / 16777216.0f;
}

/* Noise in every voxel, to the very border. */
static brume_grid *noise_make(int32_t nx, int32_t ny, int32_t nz, int32_t channels)
{
    float from_array[16];
    unit_from_array(nx > ny ? (nx > nz ? nx : nz) : (ny > nz ? ny : nz), from_array);
    brume_grid *grid = grid_make(nx, ny, nz, channels, from_array);
    uint32_t state = 7;
    for (size_t i = 0; i < (size_t)nx * ny * nz * channels; ++i)
        grid->data[i] = random_float(&state);
    return grid;
}

static struct volume *volume_make(brume_grid *grid, const brume_volume_program *program,
                                  const float world_from_object[16])
{
    brume_volume source = {.name = "smoke", .grids = &grid, .grid_count = 1, .program = *program};
    memcpy(source.world_from_object, world_from_object, sizeof source.world_from_object);
    struct volume *volume;
    assert_int_equal(volume_create(&source, &volume), BRUME_OK);
    return volume;
}

static const float box_positions[24] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0,
                                        0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1};
static const uint32_t box_triangles[36] = {0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4,
                                           2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6};

static brume_volume box_source(const brume_volume_program *program, float x, float y, float z,
                               float width, float depth, float height)
{
    return (brume_volume){
        .name = "box",
        .positions = box_positions,
        .triangles = box_triangles,
        .vertex_count = 8,
        .triangle_count = 12,
        .program = *program,
        .world_from_object = {width, 0, 0, 0, 0, depth, 0, 0, 0, 0, height, 0, x, y, z, 1}};
}

static struct volume *box_make(const brume_volume_program *program, float x, float y, float z,
                               float width, float depth, float height)
{
    const brume_volume source = box_source(program, x, y, z, width, depth, height);
    struct volume *volume;
    assert_int_equal(volume_create(&source, &volume), BRUME_OK);
    return volume;
}

static struct medium_lattice build(struct volume *const *volumes, uint32_t count,
                                   int32_t resolution)
{
    struct medium_lattice lattice;
    assert_int_equal(medium_build(volumes, count, resolution, 0, NULL, NULL, &lattice), BRUME_OK);
    return lattice;
}

static size_t cell_count(const struct medium_lattice *lattice)
{
    return (size_t)lattice->dims[0] * (size_t)lattice->dims[1] * (size_t)lattice->dims[2];
}

/* The integral of a channel over space. */
static double mass(const struct medium_lattice *lattice, const float *values, int channel)
{
    double sum = 0.0;
    for (size_t i = 0; i < cell_count(lattice); ++i)
        sum += values[4 * i + (size_t)channel];
    return sum * pow(lattice->cell, 3.0);
}

static double grid_mass(const brume_grid *grid, const float world_from_object[16], int channel)
{
    double sum = 0.0;
    const int32_t *dims = grid->info.dims;
    for (size_t i = 0; i < (size_t)dims[0] * dims[1] * dims[2]; ++i)
        sum += grid->data[i * (size_t)grid->info.channels + (size_t)channel];
    float world_from_array[16];
    mat4_multiply(world_from_object, grid->info.object_from_array, world_from_array);
    return sum * fabs(mat4_determinant3(world_from_array));
}

static const float *cell_at(const struct medium_lattice *lattice, const float *values,
                            const float world[3])
{
    size_t index = 0;
    for (int axis = 2; axis >= 0; --axis) {
        const float at = (world[axis] - lattice->lower[axis]) / lattice->cell;
        assert_true(at >= 0.0f && at < (float)lattice->dims[axis]);
        index = index * (size_t)lattice->dims[axis] + (size_t)at;
    }
    return values + 4 * index;
}

/* --- The lattice's shape ------------------------------------------------------------------ */

static void no_volumes_make_no_lattice(void **state)
{
    (void)state;
    struct medium_lattice lattice = build(NULL, 0, 64);
    assert_int_equal(lattice.dims[0] + lattice.dims[1] + lattice.dims[2], 0);
    assert_null(lattice.scatter);
    medium_finish(&lattice);
    assert_int_equal(medium_build(NULL, 0, 0, 0, NULL, NULL, &lattice), BRUME_E_ARGUMENT);
}

static void the_longest_side_has_the_resolution(void **state)
{
    (void)state;
    brume_instruction code[4];
    const brume_volume_program program = constant_program(code, 1, 0, 0, 0);
    struct volume *volume = box_make(&program, 1, 2, 3, 2.0f, 1.0f, 0.5f);
    struct medium_lattice lattice = build(&volume, 1, 40);
    assert_int_equal(lattice.dims[0], 40);
    assert_int_equal(lattice.dims[1], 20);
    assert_int_equal(lattice.dims[2], 10);
    const float lower[3] = {1, 2, 3}, upper[3] = {3, 3, 3.5f};
    for (int axis = 0; axis < 3; ++axis) {
        assert_float_equal(lattice.lower[axis], lower[axis], 1e-6f);
        assert_float_equal(lattice.upper[axis], upper[axis], 1e-6f);
    }
    /* A box that fits the cells fills them, all of them. */
    for (size_t i = 0; i < cell_count(&lattice); ++i)
        assert_true(lattice.scatter[4 * i] == 1.0f);
    medium_finish(&lattice);

    /* Not a multiple: one cell more than fits, centred. */
    lattice = build(&volume, 1, 7);
    assert_int_equal(lattice.dims[0], 7);
    assert_int_equal(lattice.dims[1], 4);
    assert_int_equal(lattice.dims[2], 2);
    assert_float_equal(lattice.lower[1] + lattice.upper[1], 5.0f, 1e-5f);
    assert_float_equal(lattice.upper[1] - lattice.lower[1], 4.0f * lattice.cell, 1e-5f);
    assert_float_equal(mass(&lattice, lattice.scatter, 0), 1.0, 1e-2);
    medium_finish(&lattice);
    volume_release(volume);

    /* Thin as paper: one cell thick, and all its mass. */
    volume = box_make(&program, 0, 0, 0, 4.0f, 4.0f, 0.01f);
    lattice = build(&volume, 1, 8);
    assert_int_equal(lattice.dims[2], 1);
    assert_float_equal(mass(&lattice, lattice.scatter, 0), 0.16, 1e-4);
    medium_finish(&lattice);
    volume_release(volume);
}

static void the_limit_makes_it_coarser(void **state)
{
    (void)state;
    brume_instruction code[4];
    const brume_volume_program program = constant_program(code, 1, 0, 0, 0);
    struct volume *volume = box_make(&program, 0, 0, 0, 2.0f, 1.0f, 1.0f);
    struct medium_lattice lattice;
    const uint64_t limits[4] = {16 * 8 * 8, 16 * 8 * 8 - 1, 3, 1};
    for (int i = 0; i < 4; ++i) {
        assert_int_equal(medium_build(&volume, 1, 16, limits[i], NULL, NULL, &lattice), BRUME_OK);
        assert_true(cell_count(&lattice) <= limits[i]);
        assert_int_equal(lattice.coarser, i > 0);
        assert_float_equal(mass(&lattice, lattice.scatter, 0), 2.0, 0.02);
        medium_finish(&lattice);
    }
    /* No more than it must. */
    assert_int_equal(medium_build(&volume, 1, 1 << 20, 16 * 8 * 8, NULL, NULL, &lattice), BRUME_OK);
    assert_int_equal(lattice.dims[0], 16);
    medium_finish(&lattice);
    volume_release(volume);
}

static void too_large_a_lattice_is_an_error(void **state)
{
    (void)state;
    brume_instruction code[4];
    const brume_volume_program program = constant_program(code, 1, 0, 0, 0);
    struct volume *volume = box_make(&program, 0, 0, 0, 1.0f, 1.0f, 1.0f);
    struct medium_lattice lattice;
    assert_int_equal(medium_build(&volume, 1, 1 << 30, 0, NULL, NULL, &lattice), BRUME_E_MEMORY);
    assert_non_null(strstr(last_error(), "1073741824 x 1073741824"));
    assert_null(lattice.scatter);
    volume_release(volume);
}

/* --- Mass --------------------------------------------------------------------------------- */

static void expect_mass(brume_grid *grid, const float world_from_object[16], int32_t resolution,
                        double tolerance)
{
    struct volume *volume = volume_make(grid, &smoke, world_from_object);
    struct medium_lattice lattice = build(&volume, 1, resolution);
    const float colour[3] = {1.0f, 0.5f, 0.25f};
    for (int c = 0; c < 3; ++c) {
        const double expected =
            grid_mass(grid, world_from_object, grid->info.channels == 3 ? c : 0);
        const double scattering = mass(&lattice, lattice.scatter, c);
        const double extinction = mass(&lattice, lattice.extinct, c);
        assert_float_equal(scattering / (expected * colour[c]), 1.0, tolerance);
        assert_float_equal(extinction / (expected * (colour[c] + 0.5)), 1.0, tolerance);
    }
    assert_null(lattice.emission);
    medium_finish(&lattice);
    volume_release(volume);
}

static void coarse_and_fine_lattices_keep_the_mass(void **state)
{
    (void)state;
    float identity[16];
    mat4_identity(identity);
    brume_grid *grid = noise_make(23, 17, 11, 1);
    const int32_t resolutions[6] = {2, 5, 12, 24, 31, 90};
    for (int i = 0; i < 6; ++i)
        expect_mass(grid, identity, resolutions[i], 1e-3);
    field_release(grid);
    grid = noise_make(9, 12, 10, 3);
    for (int i = 0; i < 4; ++i)
        expect_mass(grid, identity, resolutions[i], 1e-3);
    field_release(grid);
    /* One voxel, which its tents make a cube of two. */
    grid = noise_make(1, 1, 1, 1);
    for (int i = 0; i < 4; ++i)
        expect_mass(grid, identity, resolutions[i], 1e-3);
    field_release(grid);
}

static void mirrored_turned_and_sheared_grids_keep_the_mass(void **state)
{
    (void)state;
    const float s = sqrtf(0.5f), c30 = sqrtf(0.75f);
    const float transforms[6][16] = {
        {-2, 0, 0, 0, 0, 3, 0, 0, 0, 0, -1, 0, 5, 6, 7, 1},              /* mirrored, stretched */
        {0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0, 1},                /* axes exchanged */
        {s, s, 0, 0, -s, s, 0, 0, 0, 0, 1, 0, 100, 0, 0, 1},             /* 45 degrees about z */
        {1, 0, 0, 0, 0, c30, .5f, 0, 0, -.5f, c30, 0, 0, -9, 0, 1},      /* 30 degrees about x */
        {1, .7f, .2f, 0, -.3f, 1, .6f, 0, 0, 0, 1.5f, 0, 0, 0, 0, 1},    /* sheared */
        {s, -s, 0, 0, -.2f * s, -.2f * s, 0, 0, 0, 0, 5, 0, 0, 0, 0, 1}, /* anisotropic, mirrored */
    };
    brume_grid *grids[2] = {noise_make(23, 17, 11, 1), noise_make(14, 20, 18, 3)};
    const int32_t resolutions[5] = {3, 8, 20, 33, 70};
    for (int t = 0; t < 6; ++t)
        for (int g = 0; g < 2; ++g)
            for (int i = 0; i < 5; ++i)
                expect_mass(grids[g], transforms[t], resolutions[i], 0.01);
    field_release(grids[0]);
    field_release(grids[1]);
}

/* However small beside a cell, and whatever its angle. */
static void a_grid_smaller_than_a_cell_keeps_its_mass(void **state)
{
    (void)state;
    const float s = sqrtf(0.5f), size = 1e-3f;
    const float transforms[2][16] = {
        {size, 0, 0, 0, 0, size, 0, 0, 0, 0, size, 0, 0.1f, 0.2f, 0.3f, 1},
        {s * size, s * size, 0, 0, -s * size, s * size, 0, 0, 0, 0, size, 0, 0.1f, 0.2f, 0.3f, 1}};
    brume_instruction code[4];
    const brume_volume_program air = constant_program(code, 0, 1, 0, 0);
    struct volume *box = box_make(&air, -1, -1, -1, 2, 2, 2);
    brume_grid *grid = noise_make(20, 20, 20, 1);
    for (int t = 0; t < 2; ++t) {
        struct volume *volumes[2] = {volume_make(grid, &smoke, transforms[t]), box};
        struct medium_lattice lattice = build(volumes, 2, 5);
        const double expected = grid_mass(grid, transforms[t], 0);
        assert_float_equal(mass(&lattice, lattice.scatter, 0) / expected, 1.0, 0.01);
        medium_finish(&lattice);
        volume_release(volumes[0]);
    }
    volume_release(box);
    field_release(grid);
}

/* --- Values ------------------------------------------------------------------------------- */

/* A linear ramp interpolates to itself, wherever the cells lie. */
static void a_finer_lattice_interpolates_linearly(void **state)
{
    (void)state;
    const float s = sqrtf(0.5f);
    const float transforms[3][16] = {
        {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
        {-1, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 3, 4, 5, 1},
        {s, s, 0, 0, -s, s, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
    };
    float from_array[16];
    unit_from_array(8, from_array);
    brume_grid *grid = grid_make(8, 8, 8, 1, from_array);
    for (int z = 0; z < 8; ++z)
        for (int y = 0; y < 8; ++y)
            for (int x = 0; x < 8; ++x)
                grid->data[(z * 8 + y) * 8 + x] = 1.0f + 2.0f * ((float)x + 0.5f) / 8 +
                                                  3.0f * ((float)y + 0.5f) / 8 -
                                                  ((float)z + 0.5f) / 8;
    for (int t = 0; t < 3; ++t) {
        struct volume *volume = volume_make(grid, &smoke, transforms[t]);
        struct medium_lattice lattice = build(&volume, 1, 41);
        int compared = 0;
        for (int k = 0; k < lattice.dims[2]; ++k)
            for (int j = 0; j < lattice.dims[1]; ++j)
                for (int i = 0; i < lattice.dims[0]; ++i) {
                    const float world[3] = {lattice.lower[0] + ((float)i + 0.5f) * lattice.cell,
                                            lattice.lower[1] + ((float)j + 0.5f) * lattice.cell,
                                            lattice.lower[2] + ((float)k + 0.5f) * lattice.cell};
                    float p[3];
                    mat4_point(volume->object_from_world, world, p);
                    /* The cell lies between the outermost voxels' centres. */
                    bool inner = true;
                    for (int axis = 0; axis < 3; ++axis)
                        inner = inner && p[axis] > 0.0625f + lattice.cell &&
                                p[axis] < 0.9375f - lattice.cell;
                    if (!inner)
                        continue;
                    const float expected = 1.0f + 2.0f * p[0] + 3.0f * p[1] - p[2];
                    assert_float_equal(cell_at(&lattice, lattice.scatter, world)[0], expected,
                                       1e-3f);
                    ++compared;
                }
        assert_true(compared > 1000);
        medium_finish(&lattice);
        volume_release(volume);
    }
    field_release(grid);
}

static void more_cells_than_voxels_are_of_no_use(void **state)
{
    (void)state;
    float from_array[16], doubled[16];
    unit_from_array(8, from_array);
    mat4_identity(doubled);
    doubled[0] = doubled[5] = doubled[10] = 2.0f;
    brume_grid *grid = grid_make(8, 4, 2, 1, from_array);
    struct volume *volumes[2] = {volume_make(grid, &smoke, doubled)};
    /* Empty outermost voxels add no half voxel to the bounds. */
    assert_int_equal(medium_useful_resolution(volumes, 1), 8);
    mat4_identity(doubled);
    volumes[1] = volume_make(grid, &smoke, doubled);
    assert_int_equal(medium_useful_resolution(volumes, 2), 16); /* 2 m of voxels of 1/8 m */
    assert_int_equal(medium_useful_resolution(NULL, 0), 1);
    volume_release(volumes[0]);
    volume_release(volumes[1]);
    field_release(grid);
}

/* At the useful resolution cells are voxels, wherever the grid lies and whatever its axes are
 * called; a mesh or a turned grid has no such place. */
static void cells_as_fine_as_voxels_lie_on_them(void **state)
{
    (void)state;
    const float s = sqrtf(0.5f);
    const float transforms[3][16] = {
        {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.317f, -0.21f, 5.03f, 1},
        {0, 0, -2, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0.317f, -0.21f, 5.03f, 1},
        {s, s, 0, 0, -s, s, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
    };
    brume_grid *grid = noise_make(9, 7, 8, 1);
    /* Two of its six sides are empty: the lattice begins half a voxel further in there, and its
     * cells must not. */
    for (int z = 0; z < 8; ++z)
        for (int y = 0; y < 7; ++y)
            grid->data[(z * 7 + y) * 9] = 0.0f;
    for (int i = 0; i < 63; ++i)
        grid->data[i] = 0.0f;
    for (int t = 0; t < 3; ++t) {
        struct volume *volume = volume_make(grid, &smoke, transforms[t]);
        struct medium_lattice lattice = build(&volume, 1, medium_useful_resolution(&volume, 1));
        assert_float_equal(mass(&lattice, lattice.scatter, 0) /
                               grid_mass(grid, transforms[t], 0), 1.0, 0.01);
        const float voxel[3] = {4.5f / 9, 3.5f / 9, 5.5f / 9};
        float world[3];
        mat4_point(transforms[t], voxel, world);
        bool on_it = true;
        for (int axis = 0; axis < 3; ++axis) {
            const float at = (world[axis] - lattice.lower[axis]) / lattice.cell;
            on_it = on_it && fabsf(at - floorf(at) - 0.5f) < 1e-3f;
        }
        assert_int_equal(on_it, t < 2);
        if (t < 2)
            assert_float_equal(lattice.cell, (t == 0 ? 1.0f : 2.0f) / 9, 1e-6f);
        medium_finish(&lattice);
        volume_release(volume);
    }
    field_release(grid);
}

static void interpolation_reaches_half_a_voxel_beyond(void **state)
{
    (void)state;
    float identity[16];
    mat4_identity(identity);
    /* Two voxels a metre wide, 0 and 1: the ramp is seen to 2.5, where the tent of 1 ends. The
     * empty side ends with the box. */
    brume_grid *grid = grid_make(2, 1, 1, 1, identity);
    grid->data[1] = 1.0f;
    float lower[3], upper[3];
    field_support(grid, lower, upper);
    assert_true(lower[0] == 0.0f && upper[0] == 2.5f && lower[1] == -0.5f && upper[1] == 1.5f);
    struct volume *volume = volume_make(grid, &smoke, identity);
    assert_true(volume->lower[0] == 0.0f && volume->upper[0] == 2.5f);
    struct medium_lattice lattice = build(&volume, 1, 25);
    for (int i = 0; i < 25; ++i) {
        const float x = 0.1f * ((float)i + 0.5f);
        const float expected = i == 4 || i == 14 || i == 24 ? NAN : fmaxf(1 - fabsf(x - 1.5f), 0);
        const float at[3] = {x, 0.5f, 0.5f};
        /* Across, the cell begins at the tent's top and is 0.1 wide: a mean of 0.95, squared. */
        const float found = cell_at(&lattice, lattice.scatter, at)[0] / (0.95f * 0.95f);
        if (expected == expected)
            assert_float_equal(found, expected, 1e-4f);
    }
    medium_finish(&lattice);
    volume_release(volume);
    field_release(grid);
}

static void a_lattice_half_a_cell_off_halves(void **state)
{
    (void)state;
    brume_instruction code[2][4];
    const brume_volume_program programs[2] = {constant_program(code[0], 1, 0, 0, 0),
                                              constant_program(code[1], 2, 0, 0, 0)};
    /* The first spans the lattice of 8 cells, the second begins and ends in their middles. */
    struct volume *volumes[2] = {box_make(&programs[0], 0, 0, 0, 8, 8, 8),
                                 box_make(&programs[1], 1.5f, 1.5f, 1.5f, 4, 4, 4)};
    struct medium_lattice lattice = build(volumes, 2, 8);
    for (int k = 0; k < 8; ++k)
        for (int i = 0; i < 8; ++i) {
            const float part_i = i == 1 || i == 5 ? 0.5f : i > 1 && i < 5 ? 1.0f : 0.0f;
            const float part_k = k == 1 || k == 5 ? 0.5f : k > 1 && k < 5 ? 1.0f : 0.0f;
            const float at[3] = {(float)i + 0.5f, 3.5f, (float)k + 0.5f};
            assert_float_equal(cell_at(&lattice, lattice.scatter, at)[0],
                               1.0f + 2.0f * part_i * part_k, 1e-6f);
        }
    medium_finish(&lattice);
    volume_release(volumes[0]);
    volume_release(volumes[1]);
}

static void volumes_add_and_g_is_weighted(void **state)
{
    (void)state;
    brume_instruction code[3][4];
    const brume_volume_program programs[3] = {constant_program(code[0], 1, 0.5f, 0.8f, 0),
                                              constant_program(code[1], 3, 0.25f, -0.4f, 7),
                                              constant_program(code[2], 0, 2.0f, 0.9f, 0)};
    struct volume *volumes[3] = {box_make(&programs[0], 0, 0, 0, 2, 2, 2),
                                 box_make(&programs[1], 1, 0, 0, 2, 2, 2),
                                 box_make(&programs[2], 0, 0, 0, 4, 2, 2)};
    struct medium_lattice lattice = build(volumes, 3, 8);
    const struct {
        float x, sigma_s, sigma_t, g, emission;
    } expected[4] = {
        {0.5f, 1, 3.5f, 0.8f, 0},
        {1.5f, 4, 6.75f, (0.8f * 1 - 0.4f * 3) / 4, 7},
        {2.5f, 3, 5.25f, -0.4f, 7},
        {3.5f, 0, 2, 0, 0}, /* what only absorbs has no say in g */
    };
    for (int i = 0; i < 4; ++i) {
        const float at[3] = {expected[i].x, 1.1f, 0.9f};
        for (int c = 0; c < 3; ++c) {
            assert_float_equal(cell_at(&lattice, lattice.scatter, at)[c], expected[i].sigma_s,
                               1e-5f);
            assert_float_equal(cell_at(&lattice, lattice.extinct, at)[c], expected[i].sigma_t,
                               1e-5f);
            assert_float_equal(cell_at(&lattice, lattice.emission, at)[c], expected[i].emission,
                               1e-5f);
        }
        assert_float_equal(cell_at(&lattice, lattice.scatter, at)[3], expected[i].g, 1e-5f);
    }
    medium_finish(&lattice);
    for (int i = 0; i < 3; ++i)
        volume_release(volumes[i]);
}

static void scale_multiplies_all_coefficients(void **state)
{
    (void)state;
    brume_instruction code[4];
    const brume_volume_program program = constant_program(code, 1, 2, 0.5f, 3);
    brume_volume source = box_source(&program, 0, 0, 0, 1, 1, 1);
    source.scale = 10.0f;
    struct volume *volume;
    assert_int_equal(volume_create(&source, &volume), BRUME_OK);
    struct medium_lattice lattice = build(&volume, 1, 2);
    assert_float_equal(lattice.scatter[0], 10.0f, 1e-5f);
    assert_float_equal(lattice.scatter[3], 0.5f, 1e-6f);
    assert_float_equal(lattice.extinct[0], 30.0f, 1e-5f);
    assert_float_equal(lattice.emission[0], 30.0f, 1e-5f);
    medium_finish(&lattice);
    volume_release(volume);
}

static void a_program_that_emits_nothing_leaves_no_array(void **state)
{
    (void)state;
    float identity[16];
    mat4_identity(identity);
    /* emission = grid 0, which is 0 at first: no constant, so only running it tells. */
    brume_volume_program glow = smoke;
    glow.emission = 0;
    brume_grid *grid = grid_make(4, 4, 4, 1, identity);
    struct volume *volume = volume_make(grid, &glow, identity);
    struct medium_lattice lattice = build(&volume, 1, 8);
    assert_null(lattice.emission);
    assert_int_equal(lattice.dims[0], 8);
    medium_finish(&lattice);
    volume_release(volume);

    grid->data[21] = 2.0f;
    volume = volume_make(grid, &glow, identity);
    lattice = build(&volume, 1, 8);
    assert_non_null(lattice.emission);
    assert_float_equal(mass(&lattice, lattice.emission, 1), 2.0, 1e-3);
    medium_finish(&lattice);
    volume_release(volume);
    field_release(grid);
}

/* A program that makes something of zeros fills the grid's box, turned as it is, and no more. */
static void a_constant_in_a_grid_keeps_to_its_box(void **state)
{
    (void)state;
    const float s = sqrtf(0.5f);
    const float transforms[2][16] = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.3f, 0, 0, 1},
                                     {s, s, 0, 0, -s, s, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
    brume_instruction code[4];
    const brume_volume_program program = constant_program(code, 2, 0, 0, 0);
    float from_array[16];
    unit_from_array(8, from_array);
    brume_grid *grid = grid_make(8, 8, 8, 1, from_array);
    grid->data[100] = 1.0f; /* the border is 0, so the box is the unit cube */
    brume_instruction far_code[4];
    const brume_volume_program far_program = constant_program(far_code, 0, 1, 0, 0);
    struct volume *other = box_make(&far_program, -2, -2, -2, 5.3f, 5.1f, 5.2f);
    for (int t = 0; t < 2; ++t) {
        struct volume *volumes[2] = {volume_make(grid, &program, transforms[t]), other};
        struct medium_lattice lattice = build(volumes, 2, 50);
        /* Cells cut by the turned box are seen at a few points only. */
        assert_float_equal(mass(&lattice, lattice.scatter, 0), 2.0, t == 0 ? 1e-3 : 0.05);
        medium_finish(&lattice);
        volume_release(volumes[0]);
    }
    volume_release(other);
    field_release(grid);
}

static void a_missing_grid_reads_as_zero(void **state)
{
    (void)state;
    float identity[16];
    mat4_identity(identity);
    /* sigma_s = grid 0 + grid 1, of which there is only the second */
    const brume_instruction code[] = {{.op = BRUME_OP_GRID, .dst = 0, .a = 0},
                                      {.op = BRUME_OP_GRID, .dst = 1, .a = 1},
                                      {.op = BRUME_OP_ADD, .dst = 2, .a = 0, .b = 1},
                                      {.op = BRUME_OP_CONSTANT, .dst = 3}};
    brume_grid *grids[2] = {NULL, noise_make(6, 6, 6, 1)};
    brume_volume source = {.name = "half there",
                           .grids = grids,
                           .grid_count = 2,
                           .program = {.instructions = code,
                                       .instruction_count = 4,
                                       .sigma_s = 2,
                                       .sigma_a = 3,
                                       .g = 3,
                                       .emission = 3}};
    memcpy(source.world_from_object, identity, sizeof identity);
    struct volume *volume;
    assert_int_equal(volume_create(&source, &volume), BRUME_OK);
    struct medium_lattice lattice = build(&volume, 1, 9);
    assert_float_equal(mass(&lattice, lattice.scatter, 0) / grid_mass(grids[1], identity, 0), 1.0,
                       1e-3);
    medium_finish(&lattice);
    volume_release(volume);
    field_release(grids[1]);
}

/* Two grids of one volume at different voxel sizes, multiplied. */
static void grids_of_two_resolutions_meet_in_the_cells(void **state)
{
    (void)state;
    float identity[16], coarse_from_array[16], fine_from_array[16];
    mat4_identity(identity);
    unit_from_array(4, coarse_from_array);
    unit_from_array(16, fine_from_array);
    brume_grid *grids[2] = {grid_make(4, 4, 4, 1, coarse_from_array),
                            grid_make(16, 16, 16, 3, fine_from_array)};
    for (int i = 0; i < 64; ++i)
        grids[0]->data[i] = 3.0f;
    for (int i = 0; i < 4096; ++i) {
        grids[1]->data[3 * i] = 1.0f;
        grids[1]->data[3 * i + 1] = 2.0f;
    }
    const brume_instruction code[] = {{.op = BRUME_OP_GRID, .dst = 0, .a = 0},
                                      {.op = BRUME_OP_GRID, .dst = 1, .a = 1},
                                      {.op = BRUME_OP_MULTIPLY, .dst = 2, .a = 0, .b = 1},
                                      {.op = BRUME_OP_CONSTANT, .dst = 3}};
    brume_volume source = {.name = "two",
                           .grids = grids,
                           .grid_count = 2,
                           .program = {.instructions = code,
                                       .instruction_count = 4,
                                       .sigma_s = 2,
                                       .sigma_a = 3,
                                       .g = 3,
                                       .emission = 3}};
    memcpy(source.world_from_object, identity, sizeof identity);
    struct volume *volume;
    assert_int_equal(volume_create(&source, &volume), BRUME_OK);
    struct medium_lattice lattice = build(&volume, 1, 10);
    const float middle[3] = {0.5f, 0.5f, 0.5f};
    const float *cell = cell_at(&lattice, lattice.scatter, middle);
    assert_float_equal(cell[0], 3.0f, 1e-5f);
    assert_float_equal(cell[1], 6.0f, 1e-5f);
    assert_float_equal(cell[2], 0.0f, 1e-5f);
    medium_finish(&lattice);
    volume_release(volume);
    field_release(grids[0]);
    field_release(grids[1]);
}

static void far_from_the_origin_is_as_good(void **state)
{
    (void)state;
    brume_instruction code[4];
    const brume_volume_program program = constant_program(code, 1, 0, 0, 0);
    struct volume *volume = box_make(&program, 4096.0f, -2048.0f, 1024.0f, 1, 1, 1);
    struct medium_lattice lattice = build(&volume, 1, 64);
    assert_int_equal(lattice.dims[0] * lattice.dims[1] * lattice.dims[2], 64 * 64 * 64);
    for (size_t i = 0; i < cell_count(&lattice); ++i)
        assert_true(lattice.scatter[4 * i] == 1.0f);
    medium_finish(&lattice);
    volume_release(volume);
}

/* --- Running ------------------------------------------------------------------------------ */

static void any_number_of_threads_gives_the_same(void **state)
{
    (void)state;
    const float turn[16] = {.6f, .8f, 0, 0, -.8f, .6f, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    float identity[16];
    mat4_identity(identity);
    brume_instruction code[4];
    const brume_volume_program program = constant_program(code, 1, 2, 0.5f, 3);
    brume_grid *grid = noise_make(21, 22, 23, 1);
    struct volume *volumes[3] = {volume_make(grid, &smoke, identity),
                                 volume_make(grid, &smoke, turn),
                                 box_make(&program, 0.21f, 0.32f, 0.43f, 1.2f, 0.1f, 0.3f)};
    const int threads = omp_get_max_threads();
    omp_set_num_threads(1);
    struct medium_lattice one = build(volumes, 3, 50);
    omp_set_num_threads(5);
    struct medium_lattice many = build(volumes, 3, 50);
    omp_set_num_threads(threads);
    const size_t bytes = cell_count(&one) * 4 * sizeof(float);
    assert_memory_equal(one.scatter, many.scatter, bytes);
    assert_memory_equal(one.extinct, many.extinct, bytes);
    assert_memory_equal(one.emission, many.emission, bytes);
    medium_finish(&one);
    medium_finish(&many);
    for (int i = 0; i < 3; ++i)
        volume_release(volumes[i]);
    field_release(grid);
}

static bool cancel_after(void *user)
{
    int *polls = user;
    return (*polls)-- <= 0;
}

static void a_cancelled_build_ends_early(void **state)
{
    (void)state;
    float identity[16];
    mat4_identity(identity);
    brume_instruction code[4];
    const brume_volume_program program = constant_program(code, 1, 2, 0.5f, 3);
    brume_grid *grid = noise_make(16, 16, 16, 1);
    struct volume *volumes[2] = {volume_make(grid, &smoke, identity),
                                 box_make(&program, 0, 0, 0, 1, 1, 1)};
    /* Only the caller's thread asks, and how often depends on the rows that it gets: alone, all. */
    const int threads = omp_get_max_threads();
    omp_set_num_threads(1);
    for (int polls = 0; polls < 2000; polls += 499) {
        int left = polls;
        struct medium_lattice lattice;
        assert_int_equal(medium_build(volumes, 2, 40, 0, cancel_after, &left, &lattice),
                         BRUME_E_CANCELLED);
        assert_null(lattice.scatter);
    }
    omp_set_num_threads(threads);
    int none = 0;
    struct medium_lattice lattice;
    assert_int_equal(medium_build(volumes, 2, 40, 0, cancel_after, &none, &lattice),
                     BRUME_E_CANCELLED);
    int enough = 1000000;
    assert_int_equal(medium_build(volumes, 2, 40, 0, cancel_after, &enough, &lattice), BRUME_OK);
    medium_finish(&lattice);
    volume_release(volumes[0]);
    volume_release(volumes[1]);
    field_release(grid);
}

/* --- Volumes ------------------------------------------------------------------------------ */

static void refused(const brume_volume *source, brume_result code, const char *words)
{
    struct volume *volume = NULL;
    assert_int_equal(volume_create(source, &volume), code);
    assert_null(volume);
    assert_non_null(strstr(last_error(), words));
    assert_non_null(strstr(last_error(), source->name));
}

static void bad_volumes_are_refused_by_name(void **state)
{
    (void)state;
    brume_instruction code[4];
    const brume_volume_program program = constant_program(code, 1, 2, 0.5f, 3);
    const brume_volume good = box_source(&program, 0, 0, 0, 1, 1, 1);

    brume_volume bad = good;
    bad.world_from_object[10] = 0.0f;
    refused(&bad, BRUME_E_TRANSFORM, "zero scale");
    bad = good;
    bad.world_from_object[12] = NAN;
    refused(&bad, BRUME_E_TRANSFORM, "NaN");
    bad = good;
    bad.world_from_object[3] = 0.5f;
    refused(&bad, BRUME_E_TRANSFORM, "not linear");
    bad = good;
    bad.world_from_object[0] = bad.world_from_object[12] = 3e38f;
    refused(&bad, BRUME_E_TRANSFORM, "");
    bad = good;
    bad.scale = -1.0f;
    refused(&bad, BRUME_E_ARGUMENT, "-1");
    bad.scale = NAN;
    refused(&bad, BRUME_E_ARGUMENT, "scale");

    bad = good;
    bad.triangle_count = 0;
    refused(&bad, BRUME_E_MESH, "no triangles");
    bad = good;
    bad.vertex_count = 7;
    refused(&bad, BRUME_E_MESH, "vertex 7 of 7");
    float positions[24];
    memcpy(positions, box_positions, sizeof positions);
    positions[10] = NAN;
    bad = good;
    bad.positions = positions;
    refused(&bad, BRUME_E_MESH, "vertex 3");

    bad = good;
    bad.program.instruction_count = 3;
    refused(&bad, BRUME_E_SHADER_PROGRAM, "emission");

    bad = good;
    bad.positions = NULL;
    refused(&bad, BRUME_E_ARGUMENT, "neither a grid, a mesh nor Gaussians");
    brume_grid *grids[2] = {NULL, NULL};
    bad.grids = grids;
    bad.grid_count = 2;
    refused(&bad, BRUME_E_ARGUMENT, "neither a grid, a mesh nor Gaussians");
    float flat[16];
    mat4_identity(flat);
    flat[5] = 0.0f;
    grids[1] = grid_make(2, 2, 2, 1, flat);
    refused(&bad, BRUME_E_TRANSFORM, "grid 'density'");
    /* Nothing keeps the grid: a failed volume let it go. */
    assert_int_equal(grids[1]->references, 1);
    field_release(grids[1]);

    struct volume *volume;
    assert_int_equal(volume_create(NULL, &volume), BRUME_E_ARGUMENT);
    assert_int_equal(volume_create(&good, NULL), BRUME_E_ARGUMENT);
}

static void a_volume_keeps_its_own_copy(void **state)
{
    (void)state;
    float identity[16];
    mat4_identity(identity);
    brume_grid *grid = noise_make(4, 4, 4, 1);
    const double expected = grid_mass(grid, identity, 0);
    struct volume *volume = volume_make(grid, &smoke, identity);
    assert_int_equal(grid->references, 2);
    field_release(grid);
    assert_ptr_equal(volume_retain(volume), volume);
    volume_release(volume);
    struct medium_lattice lattice = build(&volume, 1, 6);
    assert_float_equal(mass(&lattice, lattice.scatter, 0) / expected, 1.0, 1e-3);
    medium_finish(&lattice);
    volume_release(volume);
    volume_release(NULL);
    assert_null(volume_retain(NULL));

    brume_instruction code[4];
    const brume_volume_program program = constant_program(code, 1, 2, 0.5f, 3);
    float *positions = malloc(sizeof box_positions);
    memcpy(positions, box_positions, sizeof box_positions);
    brume_volume source = box_source(&program, 0, 0, 0, 1, 1, 1);
    source.positions = positions;
    assert_int_equal(volume_create(&source, &volume), BRUME_OK);
    free(positions);
    memset(code, 0xff, sizeof code);
    lattice = build(&volume, 1, 3);
    assert_float_equal(mass(&lattice, lattice.extinct, 0), 3.0, 1e-4);
    medium_finish(&lattice);
    volume_release(volume);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_volumes_make_no_lattice),
        cmocka_unit_test(the_longest_side_has_the_resolution),
        cmocka_unit_test(the_limit_makes_it_coarser),
        cmocka_unit_test(too_large_a_lattice_is_an_error),
        cmocka_unit_test(coarse_and_fine_lattices_keep_the_mass),
        cmocka_unit_test(mirrored_turned_and_sheared_grids_keep_the_mass),
        cmocka_unit_test(a_grid_smaller_than_a_cell_keeps_its_mass),
        cmocka_unit_test(a_finer_lattice_interpolates_linearly),
        cmocka_unit_test(more_cells_than_voxels_are_of_no_use),
        cmocka_unit_test(cells_as_fine_as_voxels_lie_on_them),
        cmocka_unit_test(interpolation_reaches_half_a_voxel_beyond),
        cmocka_unit_test(a_lattice_half_a_cell_off_halves),
        cmocka_unit_test(volumes_add_and_g_is_weighted),
        cmocka_unit_test(scale_multiplies_all_coefficients),
        cmocka_unit_test(a_program_that_emits_nothing_leaves_no_array),
        cmocka_unit_test(a_constant_in_a_grid_keeps_to_its_box),
        cmocka_unit_test(a_missing_grid_reads_as_zero),
        cmocka_unit_test(grids_of_two_resolutions_meet_in_the_cells),
        cmocka_unit_test(far_from_the_origin_is_as_good),
        cmocka_unit_test(any_number_of_threads_gives_the_same),
        cmocka_unit_test(a_cancelled_build_ends_early),
        cmocka_unit_test(bad_volumes_are_refused_by_name),
        cmocka_unit_test(a_volume_keeps_its_own_copy),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
