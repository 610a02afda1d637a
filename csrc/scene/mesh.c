/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Meshes and their instances: checked, sorted by material slot, one vertex a corner. */
#include "base/result.h"
#include "math/frame.h"
#include "scene/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void mesh_destroy(struct block *block)
{
    struct mesh_block *mesh = (struct mesh_block *)block;
    free(mesh->corners);
    free(mesh->slot_first);
    free(mesh->materials);
    free(mesh);
}

static const float *vertex(const brume_mesh *source, uint32_t triangle, int corner)
{
    return source->positions + 3 * (size_t)source->triangles[3 * (size_t)triangle + (size_t)corner];
}

static void flat_normal(const brume_mesh *source, uint32_t triangle, float out[3])
{
    const float *a = vertex(source, triangle, 0);
    const float *b = vertex(source, triangle, 1);
    const float *c = vertex(source, triangle, 2);
    const float u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    const float v[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    const float n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                        u[0] * v[1] - u[1] * v[0]};
    const float length = sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int i = 0; i < 3; ++i)
        out[i] = length > 0.0f ? n[i] / length : (i == 2 ? 1.0f : 0.0f);
}

static brume_result check(const brume_mesh *source, const char *name)
{
    for (size_t i = 0; i < 3 * (size_t)source->vertex_count; ++i)
        if (!isfinite(source->positions[i]))
            return fail(BRUME_E_MESH, "mesh '%s' has a vertex that is not finite", name);
    for (size_t i = 0; i < 3 * (size_t)source->triangle_count; ++i)
        if (source->triangles[i] >= source->vertex_count)
            return fail(BRUME_E_MESH, "mesh '%s' uses vertex %u but has only %u", name,
                        source->triangles[i], source->vertex_count);
    return BRUME_OK;
}

static uint32_t slot_of(const brume_mesh *source, uint32_t slot_count, uint32_t triangle)
{
    const uint32_t slot = source->triangle_slots ? source->triangle_slots[triangle] : 0;
    return slot < slot_count ? slot : slot_count - 1; /* as Blender does */
}

static void write_triangle(const brume_mesh *source, uint32_t triangle, float *out)
{
    float flat[3];
    flat_normal(source, triangle, flat);
    for (int corner = 0; corner < 3; ++corner, out += 8) {
        const size_t index = 3 * (size_t)triangle + (size_t)corner;
        memcpy(out, vertex(source, triangle, corner), 3 * sizeof *out);
        const float *normal = source->corner_normals ? source->corner_normals + 3 * index : flat;
        const float length =
            sqrtf(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
        memcpy(out + 3, length > 1e-6f && isfinite(length) ? normal : flat, 3 * sizeof *out);
        for (int i = 0; i < 2; ++i) {
            const float uv = source->corner_uvs ? source->corner_uvs[2 * index + (size_t)i] : 0.0f;
            out[6 + i] = isfinite(uv) ? uv : 0.0f;
        }
    }
}

brume_result mesh_create(const brume_mesh *source, struct block **out)
{
    const char *name = source->name ? source->name : "";
    REQUIRE(source->positions || source->vertex_count == 0);
    REQUIRE(source->triangles || source->triangle_count == 0);
    REQUIRE(source->materials || source->material_count == 0);
    TRY(check(source, name));

    struct mesh_block *mesh = calloc(1, sizeof *mesh);
    if (!mesh)
        return fail(BRUME_E_MEMORY, "no memory for mesh '%s'", name);
    block_init(&mesh->block, mesh_destroy);
    snprintf(mesh->name, sizeof mesh->name, "%s", name);
    const uint32_t slot_count = source->material_count ? source->material_count : 1;
    mesh->slot_count = slot_count;
    mesh->triangle_count = source->triangle_count;
    mesh->corners = malloc(((size_t)source->triangle_count * 24 + 1) * sizeof(float));
    mesh->slot_first = calloc((size_t)slot_count + 1, sizeof *mesh->slot_first);
    mesh->materials = calloc(slot_count, sizeof *mesh->materials);
    uint32_t *next = calloc((size_t)slot_count + 1, sizeof *next);
    if (!mesh->corners || !mesh->slot_first || !mesh->materials || !next) {
        free(next);
        mesh_destroy(&mesh->block);
        return fail(BRUME_E_MEMORY, "no memory for the %u triangles of mesh '%s'",
                    source->triangle_count, name);
    }
    if (source->material_count)
        memcpy(mesh->materials, source->materials, slot_count * sizeof *mesh->materials);

    /* Counting sort by slot: one draw a slot. */
    for (uint32_t t = 0; t < source->triangle_count; ++t)
        ++mesh->slot_first[slot_of(source, slot_count, t) + 1];
    for (uint32_t s = 0; s < slot_count; ++s)
        mesh->slot_first[s + 1] += mesh->slot_first[s];
    memcpy(next, mesh->slot_first, slot_count * sizeof *next);
    for (uint32_t t = 0; t < source->triangle_count; ++t)
        write_triangle(source, t, mesh->corners + 24 * (size_t)next[slot_of(source, slot_count, t)]++);
    free(next);

    for (int i = 0; i < 3; ++i) {
        mesh->lower[i] = INFINITY;
        mesh->upper[i] = -INFINITY;
    }
    for (size_t c = 0; c < 3 * (size_t)source->triangle_count; ++c) {
        for (int i = 0; i < 3; ++i) {
            mesh->lower[i] = fminf(mesh->lower[i], mesh->corners[8 * c + (size_t)i]);
            mesh->upper[i] = fmaxf(mesh->upper[i], mesh->corners[8 * c + (size_t)i]);
        }
    }
    *out = &mesh->block;
    return BRUME_OK;
}

static void instances_destroy(struct block *block)
{
    struct instances_block *instances = (struct instances_block *)block;
    free(instances->world_from_object);
    free(instances);
}

brume_result instances_create(const brume_instances *source, struct block **out)
{
    REQUIRE(source->world_from_object || source->count == 0);
    struct instances_block *instances = calloc(1, sizeof *instances);
    if (!instances)
        return fail(BRUME_E_MEMORY, "no memory for instances");
    block_init(&instances->block, instances_destroy);
    instances->mesh = source->mesh;
    instances->visibility = source->visibility;
    instances->world_from_object = malloc(((size_t)source->count * 16 + 1) * sizeof(float));
    if (!instances->world_from_object) {
        instances_destroy(&instances->block);
        return fail(BRUME_E_MEMORY, "no memory for %u instances", source->count);
    }
    for (uint32_t i = 0; i < source->count; ++i) {
        const float *matrix = source->world_from_object + 16 * (size_t)i;
        float inverse[16];
        if (!mat4_invert(matrix, inverse))
            continue;
        memcpy(instances->world_from_object + 16 * (size_t)instances->count++, matrix,
               16 * sizeof(float));
    }
    *out = &instances->block;
    return BRUME_OK;
}
