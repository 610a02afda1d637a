/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Boxing down, and looking for spots: parts that are connected above a threshold, from low ones to
 * high ones, so that a sun with its glow is one where that is narrow, and without it where not. */
#include "scene/world_map.h"
#include "base/result.h"
#include "math/frame.h"
#include "scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
/* Of thresholds, over the mean luminance: each twice the last. */
#define LOWEST 4.0
#define THRESHOLDS 14
/* Wider ones are left to what takes the world as a whole: 48 ordinates stand 30 degrees apart. */
#define WIDEST 0.1
/* Of all the world's light: what is less makes no difference. Those that have much of it come first. */
static const double least_shares[] = {0.1, 0.01};

double world_luminance(const float rgb[3])
{
    return 0.2126 * (double)rgb[0] + 0.7152 * (double)rgb[1] + 0.0722 * (double)rgb[2];
}

void world_direction(double polar, double azimuth, float out[3])
{
    out[0] = (float)(sin(polar) * cos(azimuth));
    out[1] = (float)(sin(polar) * sin(azimuth));
    out[2] = (float)-cos(polar);
}

double world_cell_solid(int row)
{
    const double low = PI * row / WORLD_HEIGHT, high = PI * (row + 1) / WORLD_HEIGHT;
    return (cos(low) - cos(high)) * 2.0 * PI / WORLD_WIDTH;
}

/* The image's pixels, from *begin on and before *end, that a row or column of the table has. */
static void pixels_of(int cell, int cells, int32_t pixels, int32_t *begin, int32_t *end)
{
    *begin = (int32_t)((int64_t)cell * pixels / cells);
    *end = (int32_t)((int64_t)(cell + 1) * pixels / cells);
    if (*end <= *begin)
        *end = *begin + 1;
}

static void shrink(const struct image_block *image, float *rgb)
{
    for (int cell = 0; cell < WORLD_CELLS; ++cell) {
        int32_t x0, x1, y0, y1;
        pixels_of(cell % WORLD_WIDTH, WORLD_WIDTH, image->width, &x0, &x1);
        pixels_of(cell / WORLD_WIDTH, WORLD_HEIGHT, image->height, &y0, &y1);
        double sums[3] = {0.0};
        for (int32_t y = y0; y < y1; ++y) {
            const float *row = image->pixels + 4 * (size_t)y * (size_t)image->width;
            for (int32_t x = x0; x < x1; ++x)
                for (int c = 0; c < 3; ++c)
                    sums[c] += (double)fmaxf(row[4 * x + c], 0.0f);
        }
        for (int c = 0; c < 3; ++c)
            rgb[3 * cell + c] = (float)(sums[c] / ((double)(x1 - x0) * (y1 - y0)));
    }
}

/* --- Spots ---------------------------------------------------------------------------------- */

/* A part of the table above a threshold. */
struct part {
    int *cells, count;
    double threshold;
    double excess;    /* luminance above it, times solid angle */
    double middle[3]; /* mean direction, weighted by that: shorter than 1 the wider it is */
};

static void add_to_middle(struct part *part, double weight, double polar, double azimuth)
{
    float direction[3];
    world_direction(polar, azimuth, direction);
    part->excess += weight;
    for (int i = 0; i < 3; ++i)
        part->middle[i] += weight * (double)direction[i];
}

static double length(const double v[3])
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/* Radius of the disk of even radiance whose mean direction is as long: 1 - r^2 / 4. */
static double radius_of(const struct part *part)
{
    const double shorter = 1.0 - length(part->middle) / fmax(part->excess, 1e-300);
    return 2.0 * sqrt(fmax(shorter, 0.0));
}

/* All that is connected with a cell, above the threshold; seen: what has been found before. */
static void flood(const float *rgb, unsigned char *seen, int from, struct part *part)
{
    part->count = 1;
    part->cells[0] = from;
    part->excess = 0.0;
    memset(part->middle, 0, sizeof part->middle);
    seen[from] = 1;
    for (int next = 0; next < part->count; ++next) {
        const int x = part->cells[next] % WORLD_WIDTH, y = part->cells[next] / WORLD_WIDTH;
        add_to_middle(part,
                      (world_luminance(rgb + 3 * part->cells[next]) - part->threshold) *
                          world_cell_solid(y),
                      PI * (y + 0.5) / WORLD_HEIGHT, PI - 2.0 * PI * (x + 0.5) / WORLD_WIDTH);
        for (int i = 0; i < 9; ++i) {
            const int v = y + i / 3 - 1, u = (x + i % 3 - 1 + WORLD_WIDTH) % WORLD_WIDTH;
            const int cell = v * WORLD_WIDTH + u;
            if (v < 0 || v >= WORLD_HEIGHT || seen[cell] ||
                world_luminance(rgb + 3 * cell) <= part->threshold)
                continue;
            seen[cell] = 1;
            part->cells[part->count++] = cell;
        }
    }
}

/* Where the part's light is, by the image's own pixels: a sun is less than a cell. */
static void sharpen(const struct image_block *image, struct part *part)
{
    struct part sharp = {0};
    for (int i = 0; i < part->count; ++i) {
        int32_t x0, x1, y0, y1;
        pixels_of(part->cells[i] % WORLD_WIDTH, WORLD_WIDTH, image->width, &x0, &x1);
        pixels_of(part->cells[i] / WORLD_WIDTH, WORLD_HEIGHT, image->height, &y0, &y1);
        for (int32_t y = y0; y < y1; ++y) {
            const double polar = PI * (y + 0.5) / image->height;
            for (int32_t x = x0; x < x1; ++x) {
                const float *pixel =
                    image->pixels + 4 * ((size_t)y * (size_t)image->width + (size_t)x);
                const double above = world_luminance(pixel) - part->threshold;
                if (above > 0.0)
                    add_to_middle(&sharp, above * sin(polar), polar,
                                  PI - 2.0 * PI * (x + 0.5) / image->width);
            }
        }
    }
    if (sharp.excess > 0.0) {
        part->excess = sharp.excess;
        memcpy(part->middle, sharp.middle, sizeof part->middle);
    }
}

/* Out of the table, into the spot. */
static void take_out(const struct image_block *image, struct part *part, float *rgb,
                     struct world_spot *spot)
{
    memset(spot, 0, sizeof *spot);
    for (int i = 0; i < part->count; ++i) {
        float *cell = rgb + 3 * part->cells[i];
        const double solid = world_cell_solid(part->cells[i] / WORLD_WIDTH);
        const double left = part->threshold / world_luminance(cell);
        for (int c = 0; c < 3; ++c) {
            spot->irradiance[c] += (float)(solid * (1.0 - left) * (double)cell[c]);
            cell[c] *= (float)left;
        }
    }
    sharpen(image, part);
    const double scale = 1.0 / length(part->middle);
    for (int i = 0; i < 3; ++i)
        spot->direction[i] = (float)(scale * part->middle[i]);
    spot->radius = (float)radius_of(part);
}

static brume_result find_spots(struct world_map *map, const struct image_block *image)
{
    struct part part = {.cells = malloc(WORLD_CELLS * sizeof *part.cells)};
    unsigned char *seen = malloc(WORLD_CELLS);
    if (!part.cells || !seen) {
        free(part.cells);
        free(seen);
        return fail(BRUME_E_MEMORY, "no memory to look for suns in the world's image");
    }
    double total = 0.0;
    for (int cell = 0; cell < WORLD_CELLS; ++cell)
        total += world_cell_solid(cell / WORLD_WIDTH) * world_luminance(map->rgb + 3 * cell);
    for (int i = 0; i < 2 * THRESHOLDS && total > 0.0; ++i) {
        const double least = least_shares[i / THRESHOLDS] * total;
        part.threshold = ldexp(LOWEST * total / (4.0 * PI), i % THRESHOLDS);
        memset(seen, 0, WORLD_CELLS);
        for (int cell = 0; cell < WORLD_CELLS && map->spot_count < WORLD_SPOTS; ++cell) {
            if (seen[cell] || world_luminance(map->rgb + 3 * cell) <= part.threshold)
                continue;
            flood(map->rgb, seen, cell, &part);
            if (part.excess >= least && radius_of(&part) <= WIDEST)
                take_out(image, &part, map->rgb, &map->spots[map->spot_count++]);
        }
    }
    free(part.cells);
    free(seen);
    return BRUME_OK;
}

/* --- The map -------------------------------------------------------------------------------- */

brume_result world_map_update(struct world_map *map, const struct image_block *image,
                              uint64_t revision)
{
    if (map->revision == revision)
        return BRUME_OK;
    map->revision = 0;
    map->spot_count = 0;
    if (!map->rgb)
        map->rgb = malloc(3 * WORLD_CELLS * sizeof *map->rgb);
    if (!map->rgb)
        return fail(BRUME_E_MEMORY, "no memory for the world's image");
    for (int i = 0; i < 3 * WORLD_CELLS; ++i)
        map->rgb[i] = 1.0f;
    if (image) {
        shrink(image, map->rgb);
        TRY(find_spots(map, image));
    }
    map->revision = revision;
    return BRUME_OK;
}

void world_map_finish(struct world_map *map)
{
    free(map->rgb);
    memset(map, 0, sizeof *map);
}

void world_turn(const brume_world *world, float out[16])
{
    if (!mat4_invert(world->image_from_world, out))
        mat4_identity(out);
}

void world_turned(const float world_from_image[16], const float direction[3], float out[3])
{
    mat4_vector(world_from_image, direction, out);
    const float scale = 1.0f / sqrtf(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
    for (int i = 0; i < 3; ++i)
        out[i] *= scale;
}

void world_sun(const struct world_spot *spot, const brume_world *world, brume_light *out)
{
    float world_from_image[16], towards[3], u[3], v[3];
    world_turn(world, world_from_image);
    world_turned(world_from_image, spot->direction, towards);
    frame_around(towards, u, v);
    *out = (brume_light){
        .type = BRUME_LIGHT_SUN,
        .angle = 2.0f * spot->radius,
        .diffuse_factor = 1.0f,
        .volume_factor = 1.0f, /* mirrors and the camera see the image itself */
        .cast_shadow = 1,
    };
    mat4_identity(out->world_from_light);
    for (int i = 0; i < 3; ++i) {
        out->world_from_light[i] = u[i];
        out->world_from_light[4 + i] = v[i];
        out->world_from_light[8 + i] = towards[i];
        out->power[i] = fminf(spot->irradiance[i] * world->color[i], 1e30f);
    }
}

void world_means(const struct world_map *map, const brume_world *world, const vec4 *towards,
                 int count, vec4 *out)
{
    double sums[MOST_ORDINATES][4] = {{0}}, whole[3] = {0}, found[3] = {0};
    float world_from_image[16];
    world_turn(world, world_from_image);
    for (int cell = 0; cell < WORLD_CELLS; ++cell) {
        float own[3], there[3], best = -2.0f;
        const int x = cell % WORLD_WIDTH, y = cell / WORLD_WIDTH;
        world_direction(PI * (y + 0.5) / WORLD_HEIGHT, PI - 2.0 * PI * (x + 0.5) / WORLD_WIDTH,
                        own);
        world_turned(world_from_image, own, there);
        int nearest = 0;
        for (int i = 0; i < count; ++i) {
            const float cosine =
                there[0] * towards[i].x + there[1] * towards[i].y + there[2] * towards[i].z;
            if (cosine > best) {
                best = cosine;
                nearest = i;
            }
        }
        const double solid = world_cell_solid(y);
        for (int c = 0; c < 3; ++c) {
            sums[nearest][c] += solid * (double)map->rgb[3 * cell + c];
            whole[c] += solid * (double)map->rgb[3 * cell + c];
        }
        sums[nearest][3] += solid;
    }
    for (int i = 0; i < count; ++i)
        for (int c = 0; c < 3; ++c) {
            sums[i][c] /= fmax(sums[i][3], 1e-30);
            found[c] += sums[i][c] * (double)towards[i].w;
        }
    float scale[3];
    for (int c = 0; c < 3; ++c)
        scale[c] = found[c] > 0.0 ? (float)(whole[c] / found[c]) * world->color[c] : 0.0f;
    for (int i = 0; i < count; ++i)
        out[i] = (vec4){(float)sums[i][0] * scale[0], (float)sums[i][1] * scale[1],
                        (float)sums[i][2] * scale[2], 0.0f};
}
