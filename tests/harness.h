/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What tests of the renderer share: a device, a scene to fill, a render, and small scenes. */
#ifndef BRUME_TESTS_HARNESS_H
#define BRUME_TESTS_HARNESS_H

#include "brume.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define assert_ok(call)                                                                            \
    do {                                                                                           \
        const brume_result result_ = (call);                                                       \
        if (result_ != BRUME_OK)                                                                   \
            fail_msg("%s: %s: %s", #call, brume_result_name(result_), brume_last_error());         \
    } while (0)

/* |value - expected| <= share * |expected| */
#define assert_close(value, expected, share)                                                       \
    do {                                                                                           \
        const double value_ = (value), expected_ = (expected);                                     \
        if (!(fabs(value_ - expected_) <= (share) * fabs(expected_)))                              \
            fail_msg("%s is %.9g, expected %.9g within %g: off by %.3f %%", #value, value_,        \
                     expected_, (double)(share), 100.0 * (value_ / expected_ - 1.0));              \
    } while (0)

#pragma GCC diagnostic ignored "-Wunused-function" /* no test uses all of this */

static brume_device *device;

static int open_device(void **state)
{
    (void)state;
    const brume_device_params params = {.shader_dir = TEST_SHADERS, .debug = 1};
    const brume_result result = brume_device_create(&params, &device);
    if (result != BRUME_OK)
        fprintf(stderr, "%s: %s\n", brume_result_name(result), brume_last_error());
    return result == BRUME_OK ? 0 : -1;
}

static int close_device(void **state)
{
    (void)state;
    brume_device_destroy(device);
    return 0;
}

static const float identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

/* A cube of side 2 * half around a centre, outward normals. */
static void cube_mesh(const float center[3], float half, float positions[24], uint32_t triangles[36])
{
    static const uint32_t faces[36] = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                       2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
    for (int i = 0; i < 8; ++i) {
        positions[3 * i] = center[0] + (i & 1 ? half : -half);
        positions[3 * i + 1] = center[1] + (i & 2 ? half : -half);
        positions[3 * i + 2] = center[2] + (i & 4 ? half : -half);
    }
    memcpy(triangles, faces, sizeof faces);
}

struct coefficients {
    float sigma_s[3], sigma_a[3], emission[3], g;
};

/* A program that gives the same everywhere. */
static void constant_program(const struct coefficients *c, brume_instruction out[4],
                             brume_volume_program *program)
{
    const float *values[4] = {c->sigma_s, c->sigma_a, c->emission, NULL};
    for (uint32_t i = 0; i < 4; ++i) {
        out[i] = (brume_instruction){.op = BRUME_OP_CONSTANT, .dst = i};
        for (int k = 0; k < 3; ++k)
            out[i].value[k] = i < 3 ? values[i][k] : c->g;
    }
    *program = (brume_volume_program){.instructions = out,
                                      .instruction_count = 4,
                                      .sigma_s = 0,
                                      .sigma_a = 1,
                                      .emission = 2,
                                      .g = 3};
}

/* A homogeneous cube of medium, as a volume and all that it points to. */
struct fog_cube {
    float positions[24];
    uint32_t triangles[36];
    brume_instruction instructions[4];
    brume_volume volume;
};

static void fog_cube_init(struct fog_cube *cube, const float center[3], float half,
                          const struct coefficients *c)
{
    cube->volume = (brume_volume){.name = "fog cube",
                                  .positions = cube->positions,
                                  .triangles = cube->triangles,
                                  .vertex_count = 8,
                                  .triangle_count = 12};
    cube_mesh(center, half, cube->positions, cube->triangles);
    constant_program(c, cube->instructions, &cube->volume.program);
    memcpy(cube->volume.world_from_object, identity, sizeof identity);
}

static void add_fog_cube(brume_scene *scene, uint64_t key, const float center[3], float half,
                         const struct coefficients *c)
{
    struct fog_cube cube;
    fog_cube_init(&cube, center, half, c);
    assert_ok(brume_scene_set_volume(scene, key, &cube.volume));
}

/* A solid cube without a material: mesh and instances of the key. */
static void add_cube(brume_scene *scene, uint64_t key, const float center[3], float half,
                     uint32_t visibility)
{
    float positions[24];
    uint32_t triangles[36];
    cube_mesh(center, half, positions, triangles);
    const brume_mesh mesh = {.name = "cube",
                             .positions = positions,
                             .triangles = triangles,
                             .vertex_count = 8,
                             .triangle_count = 12};
    const brume_instances instances = {
        .world_from_object = identity, .mesh = key, .count = 1, .visibility = visibility};
    assert_ok(brume_scene_set_mesh(scene, key, &mesh));
    assert_ok(brume_scene_set_instances(scene, key, &instances));
}

static void unit(float v[3])
{
    const float length = sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3; ++i)
        v[i] /= length;
}

static void cross3(const float a[3], const float b[3], float out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* World matrix of something at `from` whose local -Z looks along `direction`. */
static void placed(const float from[3], const float direction[3], float world_from_local[16])
{
    float z[3] = {-direction[0], -direction[1], -direction[2]}, x[3], y[3];
    unit(z);
    const float up[3] = {0, fabsf(z[2]) > 0.9f ? 1.0f : 0.0f, fabsf(z[2]) > 0.9f ? 0.0f : 1.0f};
    cross3(up, z, x);
    unit(x);
    cross3(z, x, y);
    for (int i = 0; i < 3; ++i) {
        world_from_local[i] = x[i];
        world_from_local[4 + i] = y[i];
        world_from_local[8 + i] = z[i];
        world_from_local[12 + i] = from[i];
        world_from_local[4 * i + 3] = 0.0f;
    }
    world_from_local[15] = 1.0f;
}

/* A sun of irradiance 1 W/m^2 (white) that shines along a direction. */
static void add_sun(brume_scene *scene, uint64_t key, const float direction[3])
{
    static const float origin[3];
    brume_light sun = {.name = "sun",
                       .power = {1, 1, 1},
                       .diffuse_factor = 1,
                       .specular_factor = 1,
                       .volume_factor = 1,
                       .type = BRUME_LIGHT_SUN,
                       .cast_shadow = 1};
    placed(origin, direction, sun.world_from_light);
    assert_ok(brume_scene_set_light(scene, key, &sun));
}

/* A white lamp of that power at a point, to be changed and set. */
static brume_light point_lamp(const float from[3], float watts)
{
    static const float along[3] = {0, 0, -1};
    brume_light lamp = {.name = "lamp",
                        .power = {watts, watts, watts},
                        .diffuse_factor = 1,
                        .specular_factor = 1,
                        .volume_factor = 1,
                        .type = BRUME_LIGHT_POINT,
                        .cast_shadow = 1};
    placed(from, along, lamp.world_from_light);
    return lamp;
}

/* Grey matt triangles, seen and casting shadows: mesh, material and instances of the key. */
static void add_matt(brume_scene *scene, uint64_t key, const char *name, float reflectance,
                     const float matrix[16], const float *positions, uint32_t vertices,
                     const uint32_t *triangles, uint32_t triangle_count)
{
    const brume_material material = {
        .diffuse = {reflectance, reflectance, reflectance}, .roughness = 1, .alpha = 1};
    const brume_mesh mesh = {.name = name,
                             .positions = positions,
                             .triangles = triangles,
                             .materials = &key,
                             .vertex_count = vertices,
                             .triangle_count = triangle_count,
                             .material_count = 1};
    const brume_instances instances = {.world_from_object = matrix,
                                       .mesh = key,
                                       .count = 1,
                                       .visibility = BRUME_VISIBLE_CAMERA | BRUME_VISIBLE_SHADOW};
    assert_ok(brume_scene_set_material(scene, key, &material));
    assert_ok(brume_scene_set_mesh(scene, key, &mesh));
    assert_ok(brume_scene_set_instances(scene, key, &instances));
}

/* A white matt square of that side, across a direction. */
static void add_plate(brume_scene *scene, uint64_t key, const float center[3],
                      const float direction[3], float side)
{
    static const uint32_t triangles[6] = {0, 1, 2, 0, 2, 3};
    const float h = 0.5f * side;
    const float square[12] = {-h, -h, 0, h, -h, 0, h, h, 0, -h, h, 0};
    float matrix[16];
    placed(center, direction, matrix);
    add_matt(scene, key, "plate", 1.0f, matrix, square, 4, triangles, 2);
}

/* The inverse of a rigid matrix. */
static void invert_rigid(const float m[16], float out[16])
{
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j)
            out[4 * i + j] = m[4 * j + i];
        out[4 * i + 3] = 0.0f;
    }
    for (int i = 0; i < 3; ++i)
        out[12 + i] = -(m[4 * i] * m[12] + m[4 * i + 1] * m[13] + m[4 * i + 2] * m[14]);
    out[15] = 1.0f;
}

/* An orthographic view of that size around `target`, from `distance` away along the direction. */
static brume_view orthographic_view(const float target[3], const float direction[3], float size,
                                    float distance, int32_t pixels)
{
    float d[3] = {direction[0], direction[1], direction[2]}, eye[3], matrix[16];
    unit(d);
    for (int i = 0; i < 3; ++i)
        eye[i] = target[i] - d[i] * distance;
    placed(eye, d, matrix);
    brume_view view = {.width = pixels,
                       .height = pixels,
                       .clip_near = 0.0f,
                       .clip_far = 2.0f * distance,
                       .samples = 4};
    invert_rigid(matrix, view.view_from_world);
    view.clip_from_view[0] = view.clip_from_view[5] = 2.0f / size;
    view.clip_from_view[10] = -2.0f / (view.clip_far - view.clip_near);
    view.clip_from_view[14] = -1.0f;
    view.clip_from_view[15] = 1.0f;
    return view;
}

static brume_job *render(brume_scene *scene, const brume_settings *settings, const brume_view *view)
{
    brume_job *job;
    brume_job_status status;
    assert_ok(brume_render(scene, settings, view, &job));
    assert_ok(brume_job_wait(job, -1, &status));
    if (status.state != BRUME_JOB_DONE)
        fail_msg("the job ended with %s: %s", brume_result_name((brume_result)status.result),
                 brume_job_error(job));
    return job;
}

/* A pass of a finished job; free() it. */
static float *read_pass(brume_job *job, const brume_view *view, uint32_t pass)
{
    const uint64_t count =
        (uint64_t)view->width * (uint64_t)view->height * brume_pass_channels(pass);
    float *pixels = malloc(count * sizeof *pixels);
    assert_non_null(pixels);
    assert_ok(brume_job_read(job, pass, pixels, count));
    return pixels;
}

/* One channel of the pixel in the middle. */
static double middle(const float *pixels, const brume_view *view, uint32_t channels,
                     uint32_t channel)
{
    const size_t pixel = (size_t)(view->height / 2) * (size_t)view->width + (size_t)(view->width / 2);
    return pixels[pixel * channels + channel];
}

#endif
