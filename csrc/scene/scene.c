/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Scenes and snapshots. */
#include "scene/scene.h"
#include "base/result.h"
#include "math/frame.h"
#include "scene/medium.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void scene_init(struct scene *scene)
{
    memset(scene, 0, sizeof *scene);
    pthread_mutex_init(&scene->mutex, NULL);
}

void scene_finish(struct scene *scene)
{
    for (int kind = 0; kind < KIND_COUNT; ++kind)
        table_finish(&scene->tables[kind]);
    pthread_mutex_destroy(&scene->mutex);
}

brume_result scene_set(struct scene *scene, uint32_t kind, uint64_t key, struct block *block)
{
    pthread_mutex_lock(&scene->mutex);
    const brume_result result = table_set(&scene->tables[kind], key, ++scene->revision, block);
    pthread_mutex_unlock(&scene->mutex);
    return result;
}

brume_result scene_remove(struct scene *scene, uint32_t kind, uint64_t key)
{
    REQUIRE(kind < KIND_COUNT);
    pthread_mutex_lock(&scene->mutex);
    table_remove(&scene->tables[kind], key, ++scene->revision);
    pthread_mutex_unlock(&scene->mutex);
    return BRUME_OK;
}

brume_result scene_keep(struct scene *scene, uint32_t kind, const uint64_t *keys, uint64_t count)
{
    REQUIRE(kind < KIND_COUNT);
    REQUIRE(keys || count == 0);
    pthread_mutex_lock(&scene->mutex);
    const brume_result result =
        table_keep(&scene->tables[kind], keys, count, ++scene->revision);
    pthread_mutex_unlock(&scene->mutex);
    return result;
}

static int all_finite(const float *values, int count)
{
    for (int i = 0; i < count; ++i)
        if (!isfinite(values[i]))
            return 0;
    return 1;
}

brume_result scene_set_world(struct scene *scene, const brume_world *world)
{
    REQUIRE(all_finite(world->color, 3));
    float inverse[16];
    if (world->image_from_world[15] != 0.0f && !mat4_invert(world->image_from_world, inverse))
        return fail(BRUME_E_TRANSFORM, "the world's image has a singular or non-finite rotation");
    REQUIRE(mat4_is_finite(world->image_from_world));
    REQUIRE(all_finite(world->sigma_s, 3) && all_finite(world->sigma_a, 3));
    REQUIRE(all_finite(world->emission, 3));
    REQUIRE(isfinite(world->g) && isfinite(world->reach));
    pthread_mutex_lock(&scene->mutex);
    scene->world = *world;
    for (int c = 0; c < 3; ++c) {
        scene->world.sigma_s[c] = fmaxf(world->sigma_s[c], 0.0f);
        scene->world.sigma_a[c] = fmaxf(world->sigma_a[c], 0.0f);
        scene->world.emission[c] = fmaxf(world->emission[c], 0.0f);
    }
    scene->world.g = fminf(fmaxf(world->g, -0.99f), 0.99f);
    scene->world_revision = ++scene->revision;
    pthread_mutex_unlock(&scene->mutex);
    return BRUME_OK;
}

brume_result scene_snapshot(struct scene *scene, struct snapshot *out)
{
    memset(out, 0, sizeof *out);
    brume_result result = BRUME_OK;
    pthread_mutex_lock(&scene->mutex);
    for (int kind = 0; kind < KIND_COUNT && result == BRUME_OK; ++kind)
        result = table_snapshot(&scene->tables[kind], &out->tables[kind]);
    out->world = scene->world;
    out->world_revision = scene->world_revision;
    pthread_mutex_unlock(&scene->mutex);
    if (result != BRUME_OK)
        snapshot_finish(out);
    return result;
}

void snapshot_finish(struct snapshot *snapshot)
{
    for (int kind = 0; kind < KIND_COUNT; ++kind)
        table_finish(&snapshot->tables[kind]);
}

static void volume_block_destroy(struct block *block)
{
    volume_release(((struct volume_block *)block)->volume);
    free(block);
}

brume_result volume_block_create(const brume_volume *source, struct block **out)
{
    struct volume_block *owner = calloc(1, sizeof *owner);
    if (!owner)
        return fail(BRUME_E_MEMORY, "no memory for a volume");
    const brume_result result = volume_create(source, &owner->volume);
    if (result != BRUME_OK) {
        free(owner);
        return result;
    }
    block_init(&owner->block, volume_block_destroy);
    *out = &owner->block;
    return BRUME_OK;
}
