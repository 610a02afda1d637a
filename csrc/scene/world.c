/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Sampling the world by luminance: the marginal and conditional distributions of Pharr, Jakob and
 * Humphreys, "Physically Based Rendering", 14.2.4, driven by a golden-ratio lattice. */
#include "scene/world.h"
#include "base/result.h"
#include "scene/world_map.h"

#include <math.h>
#include <stdlib.h>

#define PI 3.14159265358979323846

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

brume_result world_samples(const brume_world *world, const struct world_map *map, uint32_t count,
                           struct gpu_light_sample *out)
{
    const float *table = map->rgb;
    double *rows = malloc((WORLD_CELLS + WORLD_HEIGHT) * sizeof *rows);
    if (!rows)
        return fail(BRUME_E_MEMORY, "no memory to sample the world");
    double *marginal = rows + WORLD_CELLS;
    float world_from_image[16];
    world_turn(world, world_from_image);
    double mean = 0.0, whole[3] = {0.0}, found[3] = {0.0};
    for (int y = 0; y < WORLD_HEIGHT; ++y) {
        const double solid = sin(PI * (y + 0.5) / WORLD_HEIGHT);
        for (int x = 0; x < WORLD_WIDTH; ++x) {
            const float *rgb = table + 3 * (y * WORLD_WIDTH + x);
            mean += solid * world_luminance(rgb);
            for (int c = 0; c < 3; ++c)
                whole[c] += solid * rgb[c];
        }
    }
    mean /= (double)WORLD_CELLS * 2.0 / PI;
    double total = 0.0;
    for (int y = 0; y < WORLD_HEIGHT; ++y) {
        const double solid = sin(PI * (y + 0.5) / WORLD_HEIGHT);
        double row = 0.0;
        for (int x = 0; x < WORLD_WIDTH; ++x) {
            const float *rgb = table + 3 * (y * WORLD_WIDTH + x);
            /* A tenth evenly, so that dark parts are seen and no weight explodes. */
            row += solid * (0.9 * world_luminance(rgb) + 0.1 * mean + 1e-12);
            rows[y * WORLD_WIDTH + x] = row;
        }
        total += row;
        marginal[y] = total;
    }

    for (uint32_t i = 0; i < count; ++i) {
        const double share_v = (i + 0.5) / count;
        const double share_u = fmod((i + 0.5) * 0.6180339887498949, 1.0);
        double v, u;
        const int y = invert(marginal, WORLD_HEIGHT, share_v, &v);
        const double *row = rows + (size_t)y * WORLD_WIDTH;
        const int x = invert(row, WORLD_WIDTH, share_u, &u);
        const double density = (row[x] - (x ? row[x - 1] : 0.0)) / total; /* of the cell */
        const double low = PI * y / WORLD_HEIGHT, high = PI * (y + 1) / WORLD_HEIGHT;
        const double polar = acos(cos(low) + v * (cos(high) - cos(low)));
        const double azimuth = PI - 2.0 * PI * (x + u) / WORLD_WIDTH;
        float direction[3], turned[3];
        world_direction(polar, azimuth, direction);
        world_turned(world_from_image, direction, turned);
        const double weight = world_cell_solid(y) / (density * count);
        const float *rgb = table + 3 * (y * WORLD_WIDTH + x);
        out[i].position = (vec4){turned[0], turned[1], turned[2], -1.0f};
        out[i].weight = (vec4){(float)(weight * rgb[0]), (float)(weight * rgb[1]),
                               (float)(weight * rgb[2]), 0.0f};
        for (int c = 0; c < 3; ++c)
            found[c] += weight * rgb[c];
    }
    /* All together send exactly what the world does, in each colour. */
    float scale[3];
    for (int c = 0; c < 3; ++c) {
        whole[c] *= 2.0 * PI * PI / (double)WORLD_CELLS;
        scale[c] = found[c] > 0.0 ? (float)(whole[c] / found[c]) * world->color[c] : 0.0f;
    }
    for (uint32_t i = 0; i < count; ++i) {
        out[i].weight.x *= scale[0];
        out[i].weight.y *= scale[1];
        out[i].weight.z *= scale[2];
    }
    free(rows);
    return BRUME_OK;
}
