/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The scene as the caller described it: checked copies of datablocks, and snapshots of them for a
 * job. Any thread; the scene's own mutex guards it. */
#ifndef BRUME_SCENE_SCENE_H
#define BRUME_SCENE_SCENE_H

#include "scene/table.h"

#include <pthread.h>

#define KIND_COUNT 6
#define VERTEX_FLOATS 8 /* position, normal, uv */

struct mesh_block {
    struct block block;
    char name[64];
    uint32_t triangle_count, vertex_count, slot_count;
    float *vertices;      /* VERTEX_FLOATS each */
    uint32_t *corners;    /* 3 a triangle, sorted by slot: numbers of vertices */
    uint32_t *slot_first; /* slot_count + 1: first triangle of each slot */
    uint64_t *materials; /* slot_count */
    float lower[3], upper[3];
};

struct instances_block {
    struct block block;
    uint64_t mesh;
    uint32_t count, visibility;
    float *world_from_object; /* 16 an instance, singular ones left out */
};

struct material_block {
    struct block block;
    brume_material material; /* name unset */
};

struct image_block {
    struct block block;
    char name[64];
    int32_t width, height;
    uint32_t extend, nearest;
    float *pixels; /* RGBA, finite */
    float maximum; /* over all of them */
};

struct light_block {
    struct block block;
    brume_light light; /* name unset */
};

struct volume;

struct volume_block {
    struct block block;
    struct volume *volume;
};

struct scene {
    pthread_mutex_t mutex;
    uint64_t revision; /* counts every change */
    struct table tables[KIND_COUNT];
    brume_world world;
    uint64_t world_revision;
};

/* What a job works on. */
struct snapshot {
    struct table tables[KIND_COUNT];
    brume_world world;
    uint64_t world_revision;
};

void scene_init(struct scene *scene);
void scene_finish(struct scene *scene);
brume_result scene_remove(struct scene *scene, uint32_t kind, uint64_t key);
brume_result scene_keep(struct scene *scene, uint32_t kind, const uint64_t *keys, uint64_t count);
brume_result scene_set_world(struct scene *scene, const brume_world *world);
/* Takes over the reference. */
brume_result scene_set(struct scene *scene, uint32_t kind, uint64_t key, struct block *block);

brume_result scene_snapshot(struct scene *scene, struct snapshot *out);
void snapshot_finish(struct snapshot *snapshot);

/* Checked copies; *out has one reference. */
brume_result mesh_create(const brume_mesh *source, struct block **out);
brume_result instances_create(const brume_instances *source, struct block **out);
brume_result material_create(const brume_material *source, struct block **out);
brume_result image_create(const brume_image *source, struct block **out);
brume_result light_create(const brume_light *source, struct block **out);
brume_result volume_block_create(const brume_volume *source, struct block **out);

#endif
