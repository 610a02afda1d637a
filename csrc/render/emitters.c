/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Lamps for small things that glow. */
#include "render/emitters.h"
#include "base/hash.h"
#include "math/frame.h"
#include "scene/light.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
#define MOST_LAMPS 64 /* in all, with those of the scene: beyond it shadows would suffer */
/* Triangles of all draws in all their instances: more take longer to look at than a frame has. */
#define MOST_TRIANGLES (1u << 18)
#define FARTHEST 1e15f  /* m, as for geometry */
#define BRIGHTEST 1e30f /* W */
/* Cells that one may be long. In the lattice boxes of 0.35 were up to 91 % off, of 0.75 up to 32 %,
 * and shone in beams along its directions; larger ones: tests/methods/dom_glow. */
#define LONGEST 1.0
/* Of the normals' squares along one axis: above it all of a part is about across that. Of a ball a
 * third, of a cube as well. */
#define FLAT 0.8
/* Area over the square of the longest side: below it a tube or a bar is no point, and no disk. */
#define ROUND 0.8
#define SQUARE 0.25

#define NONE UINT32_MAX

/* --- What hangs together ------------------------------------------------------------------ */

/* The corners of a draw's triangles in a table by their places, alike ones once, and of each the one
 * that stands for its part: meshes often are not joined where their surfaces meet. */
struct corners {
    uint32_t *slots, *parents; /* by hash, the first corner at a place, or NONE; by corners */
    uint32_t mask;
};

static void place_of(const struct mesh_block *mesh, const struct draw *draw, uint32_t corner,
                     float out[3])
{
    const uint32_t vertex = mesh->corners[draw->first_corner + corner];
    for (size_t i = 0; i < 3; ++i)
        out[i] = mesh->vertices[VERTEX_FLOATS * (size_t)vertex + i] + 0.0f; /* -0 is 0 */
}

static uint32_t part_of(uint32_t *parents, uint32_t corner)
{
    while (parents[corner] != corner) {
        parents[corner] = parents[parents[corner]];
        corner = parents[corner];
    }
    return corner;
}

/* The first corner at a corner's place. */
static uint32_t first_at(struct corners *corners, const struct mesh_block *mesh,
                         const struct draw *draw, uint32_t corner)
{
    float place[3], other[3];
    place_of(mesh, draw, corner, place);
    uint32_t slot = (uint32_t)hash_bytes(HASH_START, place, sizeof place) & corners->mask;
    for (; corners->slots[slot] != NONE; slot = (slot + 1) & corners->mask) {
        place_of(mesh, draw, corners->slots[slot], other);
        if (memcmp(other, place, sizeof place) == 0)
            return corners->slots[slot];
    }
    corners->slots[slot] = corner;
    return corner;
}

static bool corners_init(struct corners *corners, uint32_t count)
{
    uint32_t size = 4;
    while (size < 2 * count)
        size *= 2;
    corners->mask = size - 1;
    corners->slots = malloc(size * sizeof *corners->slots);
    corners->parents = malloc(((size_t)count + 1) * sizeof *corners->parents);
    if (!corners->slots || !corners->parents)
        return false;
    memset(corners->slots, 0xff, size * sizeof *corners->slots); /* NONE */
    for (uint32_t i = 0; i < count; ++i)
        corners->parents[i] = i;
    return true;
}

static void corners_finish(struct corners *corners)
{
    free(corners->slots);
    free(corners->parents);
}

/* --- Parts -------------------------------------------------------------------------------- */

/* A part of a draw that hangs together, in the world. */
struct part {
    double area, vector[3]; /* sums over triangles; of areas times normals */
    double squares[3][3];   /* of areas times normals times normals */
    double middle[3];       /* of areas times places */
    double lower[3], upper[3];
    uint32_t places, triangles;
};

static void add_triangle(struct part *part, double corners[3][3])
{
    double u[3], v[3], n[3];
    for (int i = 0; i < 3; ++i) {
        u[i] = corners[1][i] - corners[0][i];
        v[i] = corners[2][i] - corners[0][i];
        for (int k = 0; k < 3; ++k) {
            part->lower[i] = fmin(part->lower[i], corners[k][i]);
            part->upper[i] = fmax(part->upper[i], corners[k][i]);
        }
    }
    for (int i = 0; i < 3; ++i)
        n[i] = 0.5 * (u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3]);
    const double area = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    if (!(area > 0.0))
        return;
    part->area += area;
    for (int i = 0; i < 3; ++i) {
        part->vector[i] += n[i];
        part->middle[i] += area / 3.0 * (corners[0][i] + corners[1][i] + corners[2][i]);
        for (int k = 0; k < 3; ++k)
            part->squares[i][k] += n[i] * n[k] / area;
    }
}

/* The axis that most of a part's normals are along. Returns their share, 1/3 to 1. */
static double main_axis(const struct part *part, double axis[3])
{
    /* By powers of the matrix: the longest of what it makes of the coordinate axes. */
    double share = 0.0;
    for (int begin = 0; begin < 3; ++begin) {
        double a[3] = {begin == 0, begin == 1, begin == 2};
        double length = 0.0;
        for (int i = 0; i < 16; ++i) {
            double b[3];
            for (int k = 0; k < 3; ++k)
                b[k] = (part->squares[k][0] * a[0] + part->squares[k][1] * a[1] +
                        part->squares[k][2] * a[2]) /
                       part->area;
            length = sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2]);
            for (int k = 0; k < 3 && length > 0.0; ++k)
                a[k] = b[k] / length;
        }
        if (length > share) {
            share = length;
            memcpy(axis, a, sizeof a);
        }
    }
    return share;
}

static double longest_side(const struct part *part)
{
    double side = 0.0;
    for (int i = 0; i < 3; ++i)
        side = fmax(side, part->upper[i] - part->lower[i]);
    return side;
}

static bool is_within(const struct part *part, const struct part *other)
{
    bool within = true;
    for (int i = 0; i < 3; ++i)
        within = within && other->lower[i] < part->lower[i] && part->upper[i] < other->upper[i];
    return within;
}

/* Like a ball: around its middle, where a ring has nothing and a pole may stand. Euler's number of a
 * closed surface, whose triangles have three halves of an edge each. */
static bool is_ball_like(const struct part *part)
{
    const double side = longest_side(part);
    return 2 * part->places == part->triangles + 4 && part->area > ROUND * side * side;
}

/* --- Lamps -------------------------------------------------------------------------------- */

/* A lamp at a part's middle that shines as so much of it does. */
static brume_light lamp_at(const struct part *part, const float emission[3], double watts)
{
    brume_light lamp = {.diffuse_factor = 1, .specular_factor = 1, .volume_factor = 1,
                        .type = BRUME_LIGHT_POINT, .cast_shadow = 1};
    mat4_identity(lamp.world_from_light);
    for (int i = 0; i < 3; ++i) {
        lamp.power[i] = (float)(watts * (double)emission[i]);
        lamp.world_from_light[12 + i] = (float)(part->middle[i] / part->area);
    }
    return lamp;
}

/* One side of something flat: a disk as large, which shines along its -Z. */
static brume_light disk_at(const struct part *part, const float emission[3], double area,
                           const double axis[3], double sign)
{
    /* Blender's area lamps: radiance is power / (4 area). */
    brume_light lamp = lamp_at(part, emission, 4.0 * area);
    float z[3], x[3], y[3];
    for (int i = 0; i < 3; ++i)
        z[i] = (float)(-sign * axis[i]);
    frame_around(z, x, y);
    memcpy(lamp.world_from_light, x, sizeof x);
    memcpy(lamp.world_from_light + 4, y, sizeof y);
    memcpy(lamp.world_from_light + 8, z, sizeof z);
    lamp.type = BRUME_LIGHT_ELLIPSE;
    lamp.size[0] = lamp.size[1] = (float)(2.0 * sqrt(area / PI));
    return lamp;
}

/* False if no lamp stands for it, or there is no more room. What is seen of a convex surface from
 * anywhere is a quarter of it, on average (Cauchy); of an open one both sides shine. */
static bool add_part(struct emitters *emitters, const struct part *part, const float emission[3],
                     uint32_t most)
{
    double axis[3] = {0.0, 0.0, 1.0};
    const double *v = part->vector;
    const double open = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    const double along = main_axis(part, axis), side = longest_side(part);
    const double disk = 0.5 * (along * part->area + open); /* one side of it, if it is flat */
    if (along > FLAT) {
        if (emitters->count + 2 > most || disk < SQUARE * side * side)
            return false;
        for (int sign = -1; sign <= 1; sign += 2)
            emitters->lamps[emitters->count++] = disk_at(part, emission, disk, axis, sign);
        return true;
    }
    if (emitters->count + 1 > most || !is_ball_like(part))
        return false;
    /* Blender's point lamps: intensity is power / (4 pi). */
    brume_light lamp = lamp_at(part, emission, PI * part->area);
    lamp.radius = (float)sqrt(part->area / (4.0 * PI));
    emitters->lamps[emitters->count++] = lamp;
    return true;
}

/* --- Draws -------------------------------------------------------------------------------- */

struct search {
    struct emitters *emitters;
    const struct snapshot *snapshot;
    double longest; /* m */
    uint32_t most;  /* lamps */
    uint32_t triangles; /* that may yet be looked at */
};

/* Of each corner the number of its part from 0 on, and the parts' places. Returns how many parts there
 * are, or more than EMITTERS_MOST. */
static uint32_t number_parts(const struct mesh_block *mesh, const struct draw *draw,
                             uint32_t *numbers, struct part parts[EMITTERS_MOST])
{
    struct corners corners = {0};
    uint32_t count = 0;
    if (!corners_init(&corners, draw->corner_count))
        count = NONE;
    for (uint32_t i = 0; i < draw->corner_count && count != NONE; ++i)
        numbers[i] = first_at(&corners, mesh, draw, i);
    for (uint32_t i = 0; i < draw->corner_count && count != NONE; ++i) {
        const uint32_t a = part_of(corners.parents, numbers[i / 3 * 3]);
        const uint32_t b = part_of(corners.parents, numbers[i]);
        corners.parents[a > b ? a : b] = a > b ? b : a; /* the first stands for all */
    }
    for (uint32_t i = 0; i < draw->corner_count && count <= EMITTERS_MOST; ++i) {
        const bool new_place = numbers[i] == i;
        const bool new_triangle = i % 3 == 0 && numbers[i] != numbers[i + 1] &&
                                  numbers[i] != numbers[i + 2] && numbers[i + 1] != numbers[i + 2];
        const uint32_t first = part_of(corners.parents, numbers[i]);
        numbers[i] = first == i ? count++ : numbers[first];
        if (numbers[i] < EMITTERS_MOST) {
            parts[numbers[i]].places += new_place;
            parts[numbers[i]].triangles += new_triangle;
        }
    }
    corners_finish(&corners);
    return count;
}

/* Adds all parts of one instance. False if one is no lamp, or they are too many. */
static bool add_instance(struct search *search, const struct mesh_block *mesh,
                         const struct draw *draw, const float *matrix, const float emission[3],
                         const uint32_t *numbers, const struct part *numbered, uint32_t count)
{
    struct part parts[EMITTERS_MOST];
    for (uint32_t i = 0; i < count; ++i)
        parts[i] = (struct part){.places = numbered[i].places,
                                 .triangles = numbered[i].triangles,
                                 .lower = {INFINITY, INFINITY, INFINITY},
                                 .upper = {-INFINITY, -INFINITY, -INFINITY}};
    for (uint32_t i = 0; i < draw->corner_count; i += 3) {
        double corners[3][3];
        for (uint32_t k = 0; k < 3; ++k) {
            float p[3];
            place_of(mesh, draw, i + k, p);
            for (int c = 0; c < 3; ++c)
                corners[k][c] = (double)matrix[c] * (double)p[0] +
                                (double)matrix[4 + c] * (double)p[1] +
                                (double)matrix[8 + c] * (double)p[2] + (double)matrix[12 + c];
        }
        add_triangle(&parts[numbers[i]], corners);
    }
    for (uint32_t i = 0; i < count; ++i) {
        const struct part *part = &parts[i];
        bool inner = !(part->area > 0.0); /* nothing of it is seen */
        for (uint32_t k = 0; k < count; ++k)
            inner = inner || (is_ball_like(&parts[k]) && is_within(part, &parts[k]));
        if (inner)
            continue;
        if (!(longest_side(part) <= search->longest && fabs(part->lower[0]) < (double)FARTHEST &&
              fabs(part->lower[1]) < (double)FARTHEST && fabs(part->lower[2]) < (double)FARTHEST) ||
            !add_part(search->emitters, part, emission, search->most))
            return false;
    }
    return true;
}

/* Whether lamps stand for all of a draw. */
static bool add_draw(struct search *search, const struct draw *draw)
{
    const struct table *tables = search->snapshot->tables;
    const struct table *materials = &tables[BRUME_KIND_MATERIAL];
    const struct entry *mesh_entry = table_find(&tables[BRUME_KIND_MESH], draw->mesh);
    const struct entry *set_entry = table_find(&tables[BRUME_KIND_INSTANCES], draw->set);
    struct emitters *emitters = search->emitters;
    if (!draw->glows || !draw->opaque || !mesh_entry || !set_entry ||
        emitters->count >= search->most)
        return false;
    const float *emission =
        ((struct material_block *)materials->entries[draw->material - 1].block)->material.emission;
    const struct mesh_block *mesh = (struct mesh_block *)mesh_entry->block;
    const struct instances_block *set = (struct instances_block *)set_entry->block;
    const uint32_t triangles = draw->corner_count / 3;
    if (set->count > search->most || triangles > search->triangles / set->count)
        return false;
    search->triangles -= triangles * set->count;
    uint32_t *numbers = malloc((size_t)draw->corner_count * sizeof *numbers);
    if (!numbers)
        return false;
    struct part parts[EMITTERS_MOST] = {0};
    const uint32_t before = emitters->count, count = number_parts(mesh, draw, numbers, parts);
    bool all = count <= EMITTERS_MOST;
    for (uint32_t i = 0; i < set->count && all; ++i)
        all = add_instance(search, mesh, draw, set->world_from_object + 16 * (size_t)i, emission,
                           numbers, parts, count);
    for (uint32_t i = before; i < emitters->count; ++i)
        for (int c = 0; c < 3; ++c)
            all = all && emitters->lamps[i].power[c] < BRIGHTEST;
    free(numbers);
    if (!all)
        emitters->count = before;
    return all;
}

void emitters_update(struct emitters *emitters, struct geometry *geometry,
                     const struct snapshot *snapshot, const struct gpu_frame *frame,
                     uint64_t revision, int wanted)
{
    const uint32_t lamps = snapshot->tables[BRUME_KIND_LIGHT].count;
    const float cell = frame->field.x > 0 && wanted ? frame->fields[0].lower.w : 0.0f;
    uint32_t most = lamps < MOST_LAMPS ? MOST_LAMPS - lamps : 0;
    most = most < EMITTERS_MOST ? most : EMITTERS_MOST;
    const uint64_t inputs[] = {revision, most};
    const uint64_t key =
        hash_bytes(hash_bytes(HASH_START, inputs, sizeof inputs), &cell, sizeof cell);
    if (emitters->key == key)
        return;
    memset(emitters, 0, sizeof *emitters);
    emitters->key = key;
    struct search search = {.emitters = emitters,
                            .snapshot = snapshot,
                            .longest = LONGEST * (double)cell,
                            .most = most,
                            .triangles = MOST_TRIANGLES};
    for (uint32_t i = 0; i < geometry->draw_count; ++i)
        geometry->draws[i].as_lamps =
            cell > 0.0f && add_draw(&search, &geometry->draws[i]);
    uint64_t hash = HASH_START;
    for (uint32_t i = 0; i < emitters->count; ++i) {
        struct gpu_light gpu; /* whose padding is known */
        light_to_gpu(&emitters->lamps[i], &gpu);
        hash = hash_bytes(hash, &gpu, sizeof gpu);
    }
    emitters->signature = hash;
}
