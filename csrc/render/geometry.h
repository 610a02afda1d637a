/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Meshes, instances, materials and images on the GPU, kept as long as the scene keeps them, and
 * drawing them. Device thread. */
#ifndef BRUME_RENDER_GEOMETRY_H
#define BRUME_RENDER_GEOMETRY_H

#include "base/job.h"
#include "brume_gpu.h"
#include "gl/device.h"
#include "scene/scene.h"

struct gpu_mesh {
    uint64_t key, revision;
    struct buffer vertices, corners;
};

struct gpu_image {
    uint64_t key, revision;
    struct texture texture;
    uint32_t extend;
};

/* One draw: the triangles of one material slot, for all instances of a set. */
struct draw {
    float lower[3], upper[3]; /* of the set, in the world */
    GLuint vertices, corners, base_image, roughness_image;
    uint32_t first_corner, corner_count;
    uint32_t first_instance, instance_count;
    uint32_t material;
    uint32_t visibility;
    uint64_t mesh, set; /* keys */
    int as_lamps; /* lamps stand for it: seen, it lights nothing and casts no shadow */
    int glows;  /* and lights others */
    int tinted; /* colours what is seen through it */
    int opaque; /* all of it covers what is behind */
};

struct geometry {
    struct gpu_mesh *meshes;
    uint32_t mesh_count;
    struct gpu_image *images;
    uint32_t image_count;
    struct draw *draws;
    uint32_t draw_count;
    struct buffer instances, materials, stage_block;
    GLuint vertex_array;
    uint32_t triangle_count;      /* instances counted */
    float brightest;              /* the greatest emission of a material, W/(sr m^2) */
    float lower[3], upper[3];     /* of everything drawn; lower > upper when empty */
    /* Of all but flat meshes: what a ground plane, however wide, leaves for sharp shadows. */
    float solid_lower[3], solid_upper[3];
    float flat_lower[3][3], flat_upper[3][3]; /* of the flat ones, by the axis they are across */
    float glow_lower[3], glow_upper[3];       /* of what those of them light that glow */
};

brume_result geometry_sync(struct gpu *gpu, struct geometry *geometry,
                           const struct snapshot *snapshot, struct job_control *control);
enum geometry_pass {
    GEOMETRY_GBUFFER = 0,
    GEOMETRY_SHADOW = 1,
    GEOMETRY_TINT = 2, /* multiplies by the colour of what is seen through; writes no depth */
    GEOMETRY_LINKS = 3,   /* tells where surfaces cut links of the field's lattice */
    GEOMETRY_REFLECT = 4, /* positions, normals and reflectances, for reflective shadow maps */
    GEOMETRY_LINES = 5,   /* as links, and where lines that these are made of are cut */
};

/* Draws what has all bits of `visibility` with the bound framebuffer. */
brume_result geometry_draw(struct gpu *gpu, struct geometry *geometry, const struct gpu_draw *stage,
                           uint32_t visibility, enum geometry_pass pass);
/* What geometry_sync will hold, once it is done. */
uint64_t geometry_bytes(const struct snapshot *snapshot);
const struct gpu_image *geometry_image(const struct geometry *geometry, uint64_t key);
void geometry_finish(struct gpu *gpu, struct geometry *geometry);

#endif
