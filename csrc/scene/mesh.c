/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Meshes and their instances: checked, sorted by material slot, alike corners one vertex. */
#include "base/result.h"
#include "math/frame.h"
#include "scene/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* How many vertices at a place are compared with a corner there: the latest, lest a fan of flat
 * triangles take a time that grows with its square. */
#define MOST_COMPARED 8
#define NONE UINT32_MAX

static void mesh_destroy(struct block *block)
{
    struct mesh_block *mesh = (struct mesh_block *)block;
    free(mesh->vertices);
    free(mesh->corners);
    free(mesh->slot_first);
    free(mesh->materials);
    free(mesh);
}

static uint32_t place(const brume_mesh *source, uint32_t triangle, int corner)
{
    return source->triangles[3 * (size_t)triangle + (size_t)corner];
}

static const float *position(const brume_mesh *source, uint32_t triangle, int corner)
{
    return source->positions + 3 * (size_t)place(source, triangle, corner);
}

static void flat_normal(const brume_mesh *source, uint32_t triangle, float out[3])
{
    const float *a = position(source, triangle, 0);
    const float *b = position(source, triangle, 1);
    const float *c = position(source, triangle, 2);
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

/* Vertices by the source's places: the latest of each, and of each the one before. */
struct chains {
    uint32_t *latest, *before;
};

/* The number of the mesh's vertex that a corner is, a new one if no other at its place is alike. */
static uint32_t find_vertex(struct mesh_block *mesh, struct chains *chains, uint32_t at,
                            const float corner[VERTEX_FLOATS])
{
    uint32_t number = chains->latest[at];
    for (int i = 0; i < MOST_COMPARED && number != NONE; ++i, number = chains->before[number])
        if (memcmp(mesh->vertices + VERTEX_FLOATS * (size_t)number, corner,
                   VERTEX_FLOATS * sizeof *corner) == 0)
            return number;
    number = mesh->vertex_count++;
    memcpy(mesh->vertices + VERTEX_FLOATS * (size_t)number, corner,
           VERTEX_FLOATS * sizeof *corner);
    chains->before[number] = chains->latest[at];
    chains->latest[at] = number;
    return number;
}

static void write_triangle(const brume_mesh *source, uint32_t triangle, struct mesh_block *mesh,
                           struct chains *chains, uint32_t *out)
{
    float flat[3];
    flat_normal(source, triangle, flat);
    for (int corner = 0; corner < 3; ++corner) {
        const size_t index = 3 * (size_t)triangle + (size_t)corner;
        float vertex[VERTEX_FLOATS];
        memcpy(vertex, position(source, triangle, corner), 3 * sizeof *vertex);
        const float *normal = source->corner_normals ? source->corner_normals + 3 * index : flat;
        const float length =
            sqrtf(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
        memcpy(vertex + 3, length > 1e-6f && isfinite(length) ? normal : flat, 3 * sizeof *vertex);
        for (int i = 0; i < 2; ++i) {
            const float uv = source->corner_uvs ? source->corner_uvs[2 * index + (size_t)i] : 0.0f;
            vertex[6 + i] = isfinite(uv) ? uv : 0.0f;
        }
        out[corner] = find_vertex(mesh, chains, place(source, triangle, corner), vertex);
    }
}

/* Counting sort by slot: one draw a slot. */
static brume_result write_triangles(const brume_mesh *source, struct mesh_block *mesh)
{
    const uint32_t slot_count = mesh->slot_count;
    const size_t corner_count = 3 * (size_t)source->triangle_count;
    struct chains chains = {
        .latest = malloc(((size_t)source->vertex_count + 1) * sizeof *chains.latest),
        .before = malloc((corner_count + 1) * sizeof *chains.before)};
    uint32_t *next = calloc((size_t)slot_count + 1, sizeof *next);
    brume_result result = BRUME_OK;
    if (chains.latest && chains.before && next) {
        memset(chains.latest, 0xff, source->vertex_count * sizeof *chains.latest); /* NONE */
        for (uint32_t t = 0; t < source->triangle_count; ++t)
            ++mesh->slot_first[slot_of(source, slot_count, t) + 1];
        for (uint32_t s = 0; s < slot_count; ++s)
            mesh->slot_first[s + 1] += mesh->slot_first[s];
        memcpy(next, mesh->slot_first, slot_count * sizeof *next);
        for (uint32_t t = 0; t < source->triangle_count; ++t)
            write_triangle(source, t, mesh, &chains,
                           mesh->corners + 3 * (size_t)next[slot_of(source, slot_count, t)]++);
    } else {
        result = fail(BRUME_E_MEMORY, "no memory to sort the %u triangles of mesh '%s'",
                      source->triangle_count, mesh->name);
    }
    free(chains.latest);
    free(chains.before);
    free(next);
    return result;
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
    const size_t corner_count = 3 * (size_t)source->triangle_count;
    mesh->vertices = malloc((VERTEX_FLOATS * corner_count + 1) * sizeof *mesh->vertices);
    mesh->corners = malloc((corner_count + 1) * sizeof *mesh->corners);
    mesh->slot_first = calloc((size_t)slot_count + 1, sizeof *mesh->slot_first);
    mesh->materials = calloc(slot_count, sizeof *mesh->materials);
    brume_result result = BRUME_OK;
    if (!mesh->vertices || !mesh->corners || !mesh->slot_first || !mesh->materials)
        result = fail(BRUME_E_MEMORY, "no memory for the %u triangles of mesh '%s'",
                      source->triangle_count, name);
    else
        result = write_triangles(source, mesh);
    if (result != BRUME_OK) {
        mesh_destroy(&mesh->block);
        return result;
    }
    if (source->material_count)
        memcpy(mesh->materials, source->materials, slot_count * sizeof *mesh->materials);
    /* As many as there are, of as many as there could be. */
    float *vertices = realloc(mesh->vertices, (VERTEX_FLOATS * (size_t)mesh->vertex_count + 1) *
                                                  sizeof *vertices);
    mesh->vertices = vertices ? vertices : mesh->vertices;

    for (int i = 0; i < 3; ++i) {
        mesh->lower[i] = INFINITY;
        mesh->upper[i] = -INFINITY;
        for (size_t v = 0; v < mesh->vertex_count; ++v) {
            const float at = mesh->vertices[VERTEX_FLOATS * v + (size_t)i];
            mesh->lower[i] = fminf(mesh->lower[i], at);
            mesh->upper[i] = fmaxf(mesh->upper[i], at);
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
