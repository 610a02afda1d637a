/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The world's image boxed down to a table, and what of it is so small and bright that it lights as a
 * sun does: that is taken out of the table. Any thread. */
#ifndef BRUME_SCENE_WORLD_MAP_H
#define BRUME_SCENE_WORLD_MAP_H

#include "brume.h"
#include "brume_gpu.h"

#define WORLD_WIDTH 256
#define WORLD_HEIGHT 128
#define WORLD_CELLS (WORLD_WIDTH * WORLD_HEIGHT)
#define WORLD_SPOTS 4

struct image_block;

struct world_spot {
    float direction[3];  /* towards it, unit vector in the image's directions */
    float radius;        /* of a disk of even radiance that is as wide, rad */
    float irradiance[3]; /* of what it is brighter than the table, for a world of colour 1 */
};

struct world_map {
    uint64_t revision; /* of the image; 0: none yet */
    float *rgb;        /* WORLD_CELLS radiances, rows from the nadir up, as images have them */
    struct world_spot spots[WORLD_SPOTS];
    uint32_t spot_count;
};

/* Of the image, or without one (NULL) of a world that is 1 all over. Nothing happens where the
 * revision, which is not 0, is that of the last time. */
brume_result world_map_update(struct world_map *map, const struct image_block *image,
                              uint64_t revision);
void world_map_finish(struct world_map *map);

double world_luminance(const float rgb[3]);
/* The image's unit vector. Polar angles are from -Z; azimuths are as Cycles': pi - 2 pi u. */
void world_direction(double polar, double azimuth, float out[3]);
/* Turns the image's directions to the world's. */
void world_turn(const brume_world *world, float out[16]);
/* A direction turned by that, of length 1. */
void world_turned(const float world_from_image[16], const float direction[3], float out[3]);
/* Solid angle of each cell of a row. */
double world_cell_solid(int row);

/* The spot as a lamp of the world. */
void world_sun(const struct world_spot *spot, const brume_world *world, brume_light *out);

/* Mean radiance, without spots, of the directions that are nearer to towards[i] than to all others;
 * scaled so that all together, each times towards[i].w, send what the world does in each colour.
 * towards: unit vectors of the world, and in w solid angles; MOST_ORDINATES at most. out[i].w is 0. */
void world_means(const struct world_map *map, const brume_world *world, const vec4 *towards,
                 int count, vec4 *out);

#endif
