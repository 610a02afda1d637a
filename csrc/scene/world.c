/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Sampling the world by luminance: the marginal and conditional distributions of Pharr, Jakob and
 * Humphreys, "Physically Based Rendering", 14.2.4, driven by a golden-ratio lattice. */
#include "scene/world.h"
#include "base/result.h"
#include "math/frame.h"
#include "scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
#define TABLE_WIDTH 256
#define TABLE_HEIGHT 128

/* The image boxed down to the table: rgb a cell. */
static void shrink(const struct image_block *image, float *table)
{
    float *weights = table + 3 * TABLE_WIDTH * TABLE_HEIGHT;
    memset(table, 0, 4 * TABLE_WIDTH * TABLE_HEIGHT * sizeof *table);
    for (int32_t y = 0; y < TABLE_HEIGHT; ++y) {
        int32_t y0 = (int32_t)((int64_t)y * image->height / TABLE_HEIGHT);
        int32_t y1 = (int32_t)((int64_t)(y + 1) * image->height / TABLE_HEIGHT);
        if (y1 <= y0)
            y1 = y0 + 1;
        for (int32_t x = 0; x < TABLE_WIDTH; ++x) {
            int32_t x0 = (int32_t)((int64_t)x * image->width / TABLE_WIDTH);
            int32_t x1 = (int32_t)((int64_t)(x + 1) * image->width / TABLE_WIDTH);
            if (x1 <= x0)
                x1 = x0 + 1;
            const int cell = y * TABLE_WIDTH + x;
            for (int32_t j = y0; j < y1; ++j) {
                const float *row = image->pixels + 4 * (size_t)j * (size_t)image->width;
                for (int32_t i = x0; i < x1; ++i) {
                    for (int c = 0; c < 3; ++c)
                        table[3 * cell + c] += fmaxf(row[4 * i + c], 0.0f);
                    weights[cell] += 1.0f;
                }
            }
            for (int c = 0; c < 3; ++c)
                table[3 * cell + c] /= weights[cell];
        }
    }
}

/* Where the share falls in a cumulated list that ends with its total; *offset: place within. */
static int invert(const double *cumulated, int count, double share, double *offset)
{
    const double target = share * cumulated[count - 1];
    int low = 0, high = count - 1;
    while (low < high) {
        const int middle = (low + high) / 2;
        if (cumulated[middle] < target)
            low = middle + 1;
        else
            high = middle;
    }
    const double before = low ? cumulated[low - 1] : 0.0;
    const double width = cumulated[low] - before;
    *offset = width > 0.0 ? (target - before) / width : 0.5;
    return low;
}

brume_result world_samples(const brume_world *world, const struct image_block *image,
                           const float world_from_image[16], uint32_t count,
                           struct gpu_light_sample *out)
{
    const size_t cells = TABLE_WIDTH * TABLE_HEIGHT;
    float *table = malloc(4 * cells * sizeof *table);
    double *rows = malloc((cells + TABLE_HEIGHT) * sizeof *rows);
    if (!table || !rows) {
        free(table);
        free(rows);
        return fail(BRUME_E_MEMORY, "no memory to sample the world");
    }
    double *marginal = rows + cells;
    if (image) {
        shrink(image, table);
    } else {
        for (size_t i = 0; i < 3 * cells; ++i)
            table[i] = 1.0f;
    }
    double mean = 0.0, whole[3] = {0.0}, found[3] = {0.0};
    for (int y = 0; y < TABLE_HEIGHT; ++y) {
        const double solid = sin(PI * (y + 0.5) / TABLE_HEIGHT);
        for (int x = 0; x < TABLE_WIDTH; ++x) {
            const float *rgb = table + 3 * (y * TABLE_WIDTH + x);
            mean += solid * (0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]);
            for (int c = 0; c < 3; ++c)
                whole[c] += solid * rgb[c];
        }
    }
    mean /= (double)cells * 2.0 / PI;
    double total = 0.0;
    for (int y = 0; y < TABLE_HEIGHT; ++y) {
        const double solid = sin(PI * (y + 0.5) / TABLE_HEIGHT);
        double row = 0.0;
        for (int x = 0; x < TABLE_WIDTH; ++x) {
            const float *rgb = table + 3 * (y * TABLE_WIDTH + x);
            const double luminance = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
            /* A tenth evenly, so that dark parts are seen and no weight explodes. */
            row += solid * (0.9 * luminance + 0.1 * mean + 1e-12);
            rows[y * TABLE_WIDTH + x] = row;
        }
        total += row;
        marginal[y] = total;
    }

    for (uint32_t i = 0; i < count; ++i) {
        const double share_v = (i + 0.5) / count;
        const double share_u = fmod((i + 0.5) * 0.6180339887498949, 1.0);
        double v, u;
        const int y = invert(marginal, TABLE_HEIGHT, share_v, &v);
        const double *row = rows + (size_t)y * TABLE_WIDTH;
        const int x = invert(row, TABLE_WIDTH, share_u, &u);
        const double density = (row[x] - (x ? row[x - 1] : 0.0)) / total; /* of the cell */
        const double low = PI * y / TABLE_HEIGHT, high = PI * (y + 1) / TABLE_HEIGHT;
        const double solid = (cos(low) - cos(high)) * 2.0 * PI / TABLE_WIDTH;
        /* Rows are bottom-up: polar angle from -Z. Cycles' map: azimuth = pi - 2 pi u. */
        const double polar = acos(cos(low) + v * (cos(high) - cos(low)));
        const double azimuth = PI - 2.0 * PI * (x + u) / TABLE_WIDTH;
        const float direction[3] = {(float)(sin(polar) * cos(azimuth)),
                                    (float)(sin(polar) * sin(azimuth)), (float)-cos(polar)};
        float turned[3];
        mat4_vector(world_from_image, direction, turned);
        const float length =
            sqrtf(turned[0] * turned[0] + turned[1] * turned[1] + turned[2] * turned[2]);
        for (int axis = 0; axis < 3; ++axis)
            turned[axis] /= length;
        const double weight = solid / (density * count);
        const float *rgb = table + 3 * (y * TABLE_WIDTH + x);
        out[i].position = (vec4){turned[0], turned[1], turned[2], -1.0f};
        out[i].weight = (vec4){(float)(weight * rgb[0]), (float)(weight * rgb[1]),
                               (float)(weight * rgb[2]), 0.0f};
        for (int c = 0; c < 3; ++c)
            found[c] += weight * rgb[c];
    }
    /* All together send exactly what the world does, in each colour. */
    float scale[3];
    for (int c = 0; c < 3; ++c) {
        whole[c] *= 2.0 * PI * PI / (double)cells;
        scale[c] = found[c] > 0.0 ? (float)(whole[c] / found[c]) * world->color[c] : 0.0f;
    }
    for (uint32_t i = 0; i < count; ++i) {
        out[i].weight.x *= scale[0];
        out[i].weight.y *= scale[1];
        out[i].weight.z *= scale[2];
    }
    free(rows);
    free(table);
    return BRUME_OK;
}
