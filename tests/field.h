/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What tests of light that goes on from cell to cell share: its lattices, read back, and scenes. */
#ifndef BRUME_TESTS_FIELD_H
#define BRUME_TESTS_FIELD_H

#include "gl/device.h"
#include "harness.h"
#include "render/job.h"

#include <stdbool.h>

static const float origin[3];
static const struct coefficients white_fog = {.sigma_s = {1.0f, 0.5f, 0.25f}};

/* What the view takes light from: fluence and flux of a colour at a cell of one of its lattices. */
struct field {
    brume_scene *scene;
    struct gpu_field levels[FIELD_LEVELS];
    int level_count, level; /* the latter: that the functions below are of */
    int width, height, depth;
    float *texels;
};

static bool fetch(struct gpu *gpu, void *user)
{
    (void)gpu;
    struct field *field = user;
    const struct renderer *renderer = &field->scene->renderer;
    const struct texture *texture = &renderer->transport.field;
    memcpy(field->levels, renderer->frame.fields, sizeof field->levels);
    field->level_count = renderer->frame.field.x;
    field->width = texture->width;
    field->height = texture->height;
    field->depth = texture->depth;
    const size_t count = 4 * (size_t)field->width * (size_t)field->height * (size_t)field->depth;
    field->texels = malloc(count * sizeof *field->texels);
    if (field->texels)
        glGetTextureImage(texture->id, 0, GL_RGBA, GL_FLOAT, (GLsizei)(count * sizeof(float)),
                          field->texels);
    return false;
}

/* Renders and gives the field; free() its texels. */
static struct field field_of(brume_scene *scene, const brume_settings *settings, brume_stats *stats)
{
    const brume_view view = orthographic_view(origin, (float[3]){0, 0, -1}, 0.1f, 5.0f, 4);
    struct field field = {.scene = scene};
    brume_job *job = render(scene, settings, &view);
    if (stats)
        assert_ok(brume_job_stats(job, stats));
    brume_job_release(job);
    device_call(device, fetch, &field);
    assert_non_null(field.texels);
    return field;
}

static const int *dims_of(const struct field *field)
{
    return &field->levels[field->level].dims.x;
}

static float cell_of(const struct field *field)
{
    return field->levels[field->level].lower.w;
}

/* A coordinate of a cell's centre. */
static float centre(const struct field *field, int axis, int cell)
{
    return (&field->levels[field->level].lower.x)[axis] + ((float)cell + 0.5f) * cell_of(field);
}

static const float *texel(const struct field *field, const int cell[3], int color)
{
    const int *dims = dims_of(field);
    const size_t x = (size_t)(cell[0] + color * dims[0]), y = (size_t)cell[1];
    const size_t z = (size_t)(cell[2] + dims[3]);
    return field->texels + 4 * (x + (size_t)field->width * (y + (size_t)field->height * z));
}

static double fluence(const struct field *field, const int cell[3], int color)
{
    return texel(field, cell, color)[0];
}

/* The same between cells' centres, at a point. */
static double fluence_at(const struct field *field, const float p[3], int color)
{
    double sum = 0.0;
    int low[3];
    double f[3];
    for (int i = 0; i < 3; ++i) {
        const double at = ((double)p[i] - (double)centre(field, i, 0)) / (double)cell_of(field);
        low[i] = (int)floor(at);
        f[i] = at - floor(at);
    }
    for (int corner = 0; corner < 8; ++corner) {
        int cell[3];
        double weight = 1.0;
        for (int i = 0; i < 3; ++i) {
            const int side = corner >> i & 1;
            cell[i] = low[i] + side;
            weight *= side ? f[i] : 1.0 - f[i];
        }
        sum += weight * fluence(field, cell, color);
    }
    return sum;
}

/* Over all cells of the level: the mean fluence of a colour; and how far two fields of one lattice are
 * apart in the first colours, sum of absolute differences over sum. */
static double mean_fluence(const struct field *field, int color)
{
    const int *dims = dims_of(field);
    double sum = 0.0;
    int cell[3];
    for (cell[2] = 0; cell[2] < dims[2]; ++cell[2])
        for (cell[1] = 0; cell[1] < dims[1]; ++cell[1])
            for (cell[0] = 0; cell[0] < dims[0]; ++cell[0])
                sum += fluence(field, cell, color);
    return sum / ((double)dims[0] * dims[1] * dims[2]);
}

static double fields_apart(const struct field *field, const struct field *truth, int colors)
{
    const int *dims = dims_of(truth);
    double off = 0.0, all = 0.0;
    int cell[3];
    for (cell[2] = 0; cell[2] < dims[2]; ++cell[2])
        for (cell[1] = 0; cell[1] < dims[1]; ++cell[1])
            for (cell[0] = 0; cell[0] < dims[0]; ++cell[0])
                for (int color = 0; color < colors; ++color) {
                    off += fabs(fluence(field, cell, color) - fluence(truth, cell, color));
                    all += fluence(truth, cell, color);
                }
    return off / all;
}

static void assert_sound(const struct field *field)
{
    int cell[3];
    for (cell[2] = 0; cell[2] < dims_of(field)[2]; ++cell[2])
        for (cell[1] = 0; cell[1] < dims_of(field)[1]; ++cell[1])
            for (cell[0] = 0; cell[0] < dims_of(field)[0]; ++cell[0])
                for (int color = 0; color < 3; ++color)
                    for (int i = 0; i < 4; ++i) {
                        const float value = texel(field, cell, color)[i];
                        if (!isfinite(value) || (i == 0 && value < 0.0f))
                            fail_msg("cell %d %d %d has %g", cell[0], cell[1], cell[2],
                                     (double)value);
                    }
}

/* Looks down on the scene, and finds no pixel negative or infinite. */
static void assert_sound_picture(brume_scene *scene, const brume_settings *settings)
{
    brume_view view = orthographic_view(origin, (float[3]){0.3f, -0.2f, -1}, 3.0f, 5.0f, 32);
    brume_job *job = render(scene, settings, &view);
    float *pixels = read_pass(job, &view, BRUME_PASS_COMBINED);
    for (int i = 0; i < 4 * 32 * 32; ++i)
        if (!isfinite(pixels[i]) || pixels[i] < 0.0f)
            fail_msg("pixel %d has %g", i / 4, (double)pixels[i]);
    free(pixels);
    brume_job_release(job);
}

static brume_scene *empty(void)
{
    brume_scene *scene;
    assert_ok(brume_scene_create(device, &scene));
    return scene;
}

static void add_lamp(brume_scene *scene, uint64_t key, const float from[3], float watts)
{
    const brume_light lamp = point_lamp(from, watts);
    assert_ok(brume_scene_set_light(scene, key, &lamp));
}

/* A closed box of a diffuse material. */
static void add_box_at(brume_scene *scene, uint64_t key, const float middle[3], float half,
                       float reflectance)
{
    float positions[24];
    uint32_t triangles[36];
    cube_mesh(middle, half, positions, triangles);
    add_matt(scene, key, "box", reflectance, identity, positions, 8, triangles, 12);
}

/* The same around the origin. */
static void add_box(brume_scene *scene, uint64_t key, float half, float reflectance)
{
    add_box_at(scene, key, origin, half, reflectance);
}

#endif
