/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Lamps for small things that glow. */
#include "render/emitters.h"
#include "base/hash.h"
#include "math/frame.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
/* Cells that one may be long. Boxes of 0.35 are up to 91 % off in the lattice, of 1 to 1.4 up to 43 %,
 * of 2 up to 23 % (tests/methods/dom_glow), and shine in beams along its directions. */
#define LONGEST 1.5f
/* Triangles of a draw in all its instances: more take longer to look at than a frame has. */
#define MOST_TRIANGLES (1u << 18)
/* Of the normals' squares along one axis: above it all of a part is about across that. Of a ball a
 * third, of a cube as well. */
#define FLAT 0.8

/* A part of a mesh that hangs together, in the world. */
struct part {
    double area, vector[3]; /* sums over triangles; of areas times normals */
    double squares[3][3];   /* of areas times normals times normals */
    double middle[3];       /* of areas times places */
    float lower[3], upper[3];
};

static void add_triangle(struct part *part, double corners[3][3])
{
    double u[3], v[3], n[3];
    for (int i = 0; i < 3; ++i) {
        u[i] = corners[1][i] - corners[0][i];
        v[i] = corners[2][i] - corners[0][i];
        for (int k = 0; k < 3; ++k) {
            part->lower[i] = fminf(part->lower[i], (float)corners[k][i]);
            part->upper[i] = fmaxf(part->upper[i], (float)corners[k][i]);
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

/* The side of a cell at a place, of the finest lattice there. */
static float cell_at(const struct gpu_frame *frame, const float lower[3], const float upper[3])
{
    float cell = frame->fields[0].lower.w;
    for (int i = 1; i < frame->field.x; ++i) {
        const struct gpu_field *field = &frame->fields[i];
        bool within = true;
        for (int k = 0; k < 3; ++k) {
            const float low = (&field->lower.x)[k];
            const float high = low + (float)(&field->dims.x)[k] * field->lower.w;
            const float middle = 0.5f * (lower[k] + upper[k]);
            within = within && low <= middle && middle <= high;
        }
        if (within)
            cell = field->lower.w;
    }
    return cell;
}

static bool is_small(const struct part *part, const struct gpu_frame *frame)
{
    const float most = LONGEST * cell_at(frame, part->lower, part->upper);
    for (int i = 0; i < 3; ++i)
        if (!(part->upper[i] - part->lower[i] <= most))
            return false;
    return part->area > 0.0;
}

/* A lamp at a part's middle that shines as it does: W/(sr m^2) on `area` of it. */
static brume_light lamp_at(const struct part *part, const float emission[3], double watts_an_area)
{
    brume_light lamp = {.diffuse_factor = 1, .specular_factor = 1, .volume_factor = 1,
                        .type = BRUME_LIGHT_POINT, .cast_shadow = 1};
    mat4_identity(lamp.world_from_light);
    for (int i = 0; i < 3; ++i) {
        lamp.power[i] = (float)(watts_an_area * (double)emission[i]);
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

/* False if there is no more room. What is seen of a convex surface from anywhere is a quarter of it,
 * on average (Cauchy); of an open one half of its hull's, and both of its sides shine. */
static bool add_part(struct emitters *emitters, const struct part *part, const float emission[3])
{
    double axis[3] = {0.0, 0.0, 1.0};
    const double *v = part->vector;
    const double open = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    const double along = main_axis(part, axis);
    const bool flat = along > FLAT;
    if (emitters->count + (flat ? 2 : 1) > EMITTERS_MOST)
        return false;
    if (!flat) {
        /* Blender's point lamps: intensity is power / (4 pi). */
        brume_light lamp = lamp_at(part, emission, PI * (part->area + open));
        lamp.radius = (float)sqrt((part->area + open) / (4.0 * PI));
        emitters->lamps[emitters->count++] = lamp;
        return true;
    }
    for (int side = -1; side <= 1; side += 2)
        emitters->lamps[emitters->count++] =
            disk_at(part, emission, 0.5 * (along * part->area + open), axis, side);
    return true;
}

static void corner_at(const struct mesh_block *mesh, const float *matrix, size_t corner,
                      double out[3])
{
    const float *p = mesh->vertices + VERTEX_FLOATS * (size_t)mesh->corners[corner];
    for (int i = 0; i < 3; ++i)
        out[i] = (double)matrix[i] * (double)p[0] + (double)matrix[4 + i] * (double)p[1] +
                 (double)matrix[8 + i] * (double)p[2] + (double)matrix[12 + i];
}

/* Numbers the islands among a draw's triangles from 0 on. Returns how many, at most one too many. */
static uint32_t number_parts(const struct mesh_block *mesh, const struct draw *draw,
                             uint32_t *numbers)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < draw->corner_count / 3 && count <= EMITTERS_MOST; ++i) {
        uint32_t *number = &numbers[mesh->islands[draw->first_corner / 3 + i]];
        if (*number == 0)
            *number = ++count;
    }
    return count;
}

/* Adds all parts of one instance. False if one is too large, or they are too many. */
static bool add_instance(struct emitters *emitters, const struct mesh_block *mesh,
                         const struct draw *draw, const float *matrix, const float emission[3],
                         const uint32_t *numbers, uint32_t count, const struct gpu_frame *frame)
{
    struct part parts[EMITTERS_MOST];
    for (uint32_t i = 0; i < count; ++i)
        parts[i] = (struct part){.lower = {INFINITY, INFINITY, INFINITY},
                                 .upper = {-INFINITY, -INFINITY, -INFINITY}};
    for (uint32_t i = 0; i < draw->corner_count / 3; ++i) {
        const size_t triangle = draw->first_corner / 3 + i;
        double corners[3][3];
        for (size_t k = 0; k < 3; ++k)
            corner_at(mesh, matrix, 3 * triangle + k, corners[k]);
        add_triangle(&parts[numbers[mesh->islands[triangle]] - 1], corners);
    }
    for (uint32_t i = 0; i < count; ++i)
        if (!is_small(&parts[i], frame) || !add_part(emitters, &parts[i], emission))
            return false;
    return true;
}

/* Whether lamps stand for all of a draw. */
static bool add_draw(struct emitters *emitters, const struct draw *draw,
                     const struct snapshot *snapshot, const struct gpu_frame *frame)
{
    const struct entry *mesh_entry = table_find(&snapshot->tables[BRUME_KIND_MESH], draw->mesh);
    const struct entry *set_entry = table_find(&snapshot->tables[BRUME_KIND_INSTANCES], draw->set);
    const struct table *materials = &snapshot->tables[BRUME_KIND_MATERIAL];
    if (!draw->material || !draw->opaque || !(draw->visibility & BRUME_VISIBLE_SHADOW) ||
        !mesh_entry || !set_entry)
        return false;
    const float *emission =
        ((struct material_block *)materials->entries[draw->material - 1].block)->material.emission;
    const struct mesh_block *mesh = (struct mesh_block *)mesh_entry->block;
    const struct instances_block *set = (struct instances_block *)set_entry->block;
    if (!(emission[0] > 0.0f || emission[1] > 0.0f || emission[2] > 0.0f) ||
        set->count > EMITTERS_MOST || draw->corner_count / 3 > MOST_TRIANGLES / set->count)
        return false;
    uint32_t *numbers = calloc((size_t)mesh->island_count + 1, sizeof *numbers);
    if (!numbers)
        return false;
    const uint32_t before = emitters->count, count = number_parts(mesh, draw, numbers);
    bool all = count <= EMITTERS_MOST;
    for (uint32_t i = 0; i < set->count && all; ++i)
        all = add_instance(emitters, mesh, draw, set->world_from_object + 16 * (size_t)i, emission,
                           numbers, count, frame);
    free(numbers);
    if (!all)
        emitters->count = before;
    return all;
}

void emitters_update(struct emitters *emitters, struct geometry *geometry,
                     const struct snapshot *snapshot, const struct gpu_frame *frame,
                     uint64_t revision, int wanted)
{
    const uint64_t inputs[] = {revision, (uint64_t)wanted, (uint64_t)frame->field.x};
    uint64_t key = hash_bytes(HASH_START, inputs, sizeof inputs);
    key = hash_bytes(key, frame->fields, sizeof frame->fields);
    if (emitters->key == key)
        return;
    memset(emitters, 0, sizeof *emitters);
    emitters->key = key;
    for (uint32_t i = 0; i < geometry->draw_count; ++i)
        geometry->draws[i].as_lamps = wanted && frame->field.x > 0 &&
                                      add_draw(emitters, &geometry->draws[i], snapshot, frame);
    emitters->signature =
        hash_bytes(HASH_START, emitters->lamps, emitters->count * sizeof *emitters->lamps);
}
