/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Radiometry of lamps. The yardstick is Cycles: its lamps' powers are measured in
 * tests/pictures, per kind of lamp. */
#include "scene/light.h"
#include "base/result.h"
#include "math/frame.h"
#include "scene/pack.h"
#include "scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846f
#define SPREAD_MIN 0.0174532925f /* Blender's; below it tan(x) - x has no digits left */
#define GOLDEN_ANGLE 2.39996322972865332f

static void light_destroy(struct block *block)
{
    free(block);
}

static int is_finite(const struct gpu_light *gpu)
{
    const vec4 *const vectors[] = {&gpu->position,  &gpu->axis,     &gpu->tangent,
                                   &gpu->bitangent, &gpu->radiance, &gpu->factors};
    for (size_t i = 0; i < sizeof vectors / sizeof *vectors; ++i) {
        const vec4 v = *vectors[i];
        if (!isfinite(v.x) || !isfinite(v.y) || !isfinite(v.z) || !isfinite(v.w))
            return 0;
    }
    return 1;
}

brume_result light_create(const brume_light *source, struct block **out)
{
    const char *name = source->name ? source->name : "";
    const float values[] = {source->power[0],        source->power[1],
                            source->power[2],        source->radius,
                            source->angle,           source->size[0],
                            source->size[1],         source->spot_angle,
                            source->spot_blend,      source->spread,
                            source->diffuse_factor,  source->specular_factor,
                            source->volume_factor};
    for (size_t i = 0; i < sizeof values / sizeof *values; ++i)
        if (!isfinite(values[i]))
            return fail(BRUME_E_ARGUMENT, "light '%s' has a value that is not finite", name);
    if (!mat4_is_finite(source->world_from_light))
        return fail(BRUME_E_TRANSFORM, "light '%s' has a transform that is not finite", name);
    if (source->type > BRUME_LIGHT_ELLIPSE)
        return fail(BRUME_E_ARGUMENT, "light '%s' has no type %u", name, source->type);
    struct light_block *owner = calloc(1, sizeof *owner);
    if (!owner)
        return fail(BRUME_E_MEMORY, "no memory for light '%s'", name);
    block_init(&owner->block, light_destroy);
    owner->light = *source;
    owner->light.name = NULL;
    owner->light.radius = fmaxf(source->radius, 0.0f);
    owner->light.angle = fminf(fmaxf(source->angle, 0.0f), 3.1f);
    owner->light.spot_angle = fminf(fmaxf(source->spot_angle, 1e-3f), PI);
    owner->light.spot_blend = fminf(fmaxf(source->spot_blend, 0.0f), 1.0f);
    if (source->spread > 0.0f)
        owner->light.spread = fmaxf(source->spread, SPREAD_MIN);
    struct gpu_light gpu;
    light_to_gpu(&owner->light, &gpu);
    if (!is_finite(&gpu)) {
        light_destroy(&owner->block);
        return fail(BRUME_E_ARGUMENT, "light '%s' is larger or brighter than numbers reach", name);
    }
    *out = &owner->block;
    return BRUME_OK;
}

static float length3(const float v[3])
{
    return sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/* Column of the matrix as a unit vector and its length; a zero column gives the axis. */
static float column(const brume_light *light, int index, float out[3])
{
    memcpy(out, light->world_from_light + 4 * index, 3 * sizeof *out);
    const float length = length3(out);
    for (int i = 0; i < 3; ++i)
        out[i] = length > 1e-20f ? out[i] / length : (i == index ? 1.0f : 0.0f);
    return length;
}

static int is_area(const brume_light *light)
{
    return light->type == BRUME_LIGHT_RECTANGLE || light->type == BRUME_LIGHT_ELLIPSE;
}

void light_to_gpu(const brume_light *light, struct gpu_light *out)
{
    memset(out, 0, sizeof *out);
    float u[3], v[3], z[3];
    const float scale_u = column(light, 0, u);
    const float scale_v = column(light, 1, v);
    column(light, 2, z);
    const float axis[3] = {-z[0], -z[1], -z[2]};

    float strength = 1.0f; /* radiometric quantity per watt */
    float area = 0.0f;
    switch (light->type) {
    case BRUME_LIGHT_SUN:
        out->position = pack(z, 0.0f);
        break;
    case BRUME_LIGHT_POINT:
    case BRUME_LIGHT_SPOT: {
        /* A watt of Blender's makes 1 / (4 pi^2) W/sr/m^2 of a white matt surface at 1 m, so the
         * intensity is 1 / (4 pi). */
        strength = 1.0f / (4.0f * PI);
        const float half_cos = cosf(0.5f * light->spot_angle);
        out->position = pack(light->world_from_light + 12, light->radius);
        out->tangent.w = half_cos;
        out->bitangent.w = (1.0f - half_cos) * light->spot_blend;
        break;
    }
    default: {
        const float extent_u = 0.5f * scale_u * light->size[0];
        const float extent_v = 0.5f * scale_v * light->size[1];
        area = 4.0f * extent_u * extent_v;
        if (light->type == BRUME_LIGHT_ELLIPSE)
            area *= 0.25f * PI;
        /* Cycles' area lamp: radiance = watts / (4 area). */
        strength = area > 1e-20f ? 0.25f / area : 0.0f;
        out->position = pack(light->world_from_light + 12, 0.0f);
        for (int i = 0; i < 3; ++i) {
            u[i] *= extent_u;
            v[i] *= extent_v;
        }
        break;
    }
    }
    out->axis = pack(axis, tanf(0.5f * light->angle));
    out->tangent = pack(u, out->tangent.w);
    out->bitangent = pack(v, out->bitangent.w);
    const float radiance[3] = {light->power[0] * strength, light->power[1] * strength,
                               light->power[2] * strength};
    out->radiance = pack(radiance, area);
    const float spread = light->spread > 0.0f && light->spread < PI - 1e-4f ? light->spread : 0.0f;
    out->factors = (vec4){light->diffuse_factor, light->specular_factor, light->volume_factor,
                          tanf(0.5f * spread)};
    out->samples.w = (light->cast_shadow ? LIGHT_CASTS_SHADOW : 0u) |
                     (light->camera_visible ? LIGHT_CAMERA_VISIBLE : 0u);
    out->info.x = light->type;
}

uint32_t light_sample_count(const brume_light *light, uint32_t wanted)
{
    if (wanted < 1)
        wanted = 1;
    switch (light->type) {
    case BRUME_LIGHT_SUN:
        return light->angle > 1e-5f ? wanted : 1;
    case BRUME_LIGHT_POINT:
    case BRUME_LIGHT_SPOT:
        return light->radius > 1e-5f ? wanted : 1;
    default:
        return wanted;
    }
}

uint32_t light_faces(const brume_light *light)
{
    if (light->type == BRUME_LIGHT_SUN)
        return 1;
    if (light->type == BRUME_LIGHT_SPOT && light->spot_angle < 2.4f)
        return 1;
    return is_area(light) ? 5 : 6;
}

void light_frame(const struct gpu_light *gpu, float u[3], float v[3], float forward[3])
{
    forward[0] = gpu->axis.x, forward[1] = gpu->axis.y, forward[2] = gpu->axis.z;
    frame_around(forward, u, v);
}

/* Point number index of count on the unit disk, equal areas (Vogel's spiral). */
static void disk_point(uint32_t index, uint32_t count, float *x, float *y)
{
    const float radius = sqrtf(((float)index + 0.5f) / (float)count);
    const float angle = (float)index * GOLDEN_ANGLE;
    *x = radius * cosf(angle);
    *y = radius * sinf(angle);
}

/* Shirley and Chiu, "A Low Distortion Map Between Disk and Square", JGT 1997: keeps areas. As
 * square_to_disk() of shaders/lib/light.glsl. */
static void square_to_disk(float *x, float *y)
{
    const float a = *x, b = *y;
    if (a == 0.0f && b == 0.0f)
        return;
    const int wide = fabsf(a) > fabsf(b);
    const float radius = wide ? a : b;
    const float angle = wide ? 0.25f * PI * (b / a) : 0.5f * PI - 0.25f * PI * (a / b);
    *x = radius * cosf(angle);
    *y = radius * sinf(angle);
}

/* A ball whose projection along any direction is a uniform disk, as Cycles' point lamps look from
 * everywhere: by Abel's inversion the density goes as 1 / sqrt(1 - r^2). With r = sin(t) the
 * cumulated share of radii is (2 t - sin 2t) / pi. */
static float ball_radius(float share)
{
    float low = 0.0f, high = 0.5f * PI;
    for (int i = 0; i < 24; ++i) {
        const float middle = 0.5f * (low + high);
        if ((2.0f * middle - sinf(2.0f * middle)) / PI < share)
            low = middle;
        else
            high = middle;
    }
    return sinf(0.5f * (low + high));
}

static void ball_point(uint32_t index, uint32_t count, float out[3])
{
    if (count == 1) {
        out[0] = out[1] = out[2] = 0.0f;
        return;
    }
    /* Radii in an order of their own, so that they do not follow the spiral's latitude. */
    const float share = fmodf(((float)index + 0.5f) * 0.618033988749895f, 1.0f);
    const float radius = ball_radius(share);
    const float z = 1.0f - 2.0f * ((float)index + 0.5f) / (float)count;
    const float ring = sqrtf(fmaxf(1.0f - z * z, 0.0f));
    const float angle = (float)index * GOLDEN_ANGLE;
    out[0] = radius * ring * cosf(angle);
    out[1] = radius * ring * sinf(angle);
    out[2] = radius * z;
}

void light_sample(const brume_light *light, const struct gpu_light *gpu, uint32_t index,
                  uint32_t count, struct gpu_light_sample *out)
{
    memset(out, 0, sizeof *out);
    out->position = gpu->position;
    out->position.w = -1.0f;
    float x, y;
    switch (light->type) {
    case BRUME_LIGHT_SUN: {
        float towards[3] = {gpu->position.x, gpu->position.y, gpu->position.z}, u[3], v[3];
        frame_around(towards, u, v);
        disk_point(index, count, &x, &y);
        const float spread = count > 1 ? gpu->axis.w : 0.0f;
        for (int i = 0; i < 3; ++i)
            towards[i] += spread * (x * u[i] + y * v[i]);
        const float length = length3(towards);
        out->position = (vec4){towards[0] / length, towards[1] / length, towards[2] / length, -1.0f};
        break;
    }
    case BRUME_LIGHT_POINT:
    case BRUME_LIGHT_SPOT: {
        float offset[3];
        ball_point(index, count, offset);
        out->position.x += light->radius * offset[0];
        out->position.y += light->radius * offset[1];
        out->position.z += light->radius * offset[2];
        break;
    }
    default: {
        /* Strata of the square [-1, 1]^2, themselves about square; the shader moves each point
         * within its stratum and, for an ellipse, maps the square to the disk. */
        uint32_t columns = 1;
        while (columns * columns < count || count % columns)
            ++columns;
        const uint32_t rows = count / columns;
        x = 2.0f * ((float)(index % columns) + 0.5f) / (float)columns - 1.0f;
        y = 2.0f * ((float)(index / columns) + 0.5f) / (float)rows - 1.0f;
        out->weight = (vec4){x, y, 1.0f / (float)columns, 1.0f / (float)rows};
        if (light->type == BRUME_LIGHT_ELLIPSE)
            square_to_disk(&x, &y);
        out->position.x += x * gpu->tangent.x + y * gpu->bitangent.x;
        out->position.y += x * gpu->tangent.y + y * gpu->bitangent.y;
        out->position.z += x * gpu->tangent.z + y * gpu->bitangent.z;
        break;
    }
    }
}
