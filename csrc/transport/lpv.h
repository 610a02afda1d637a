/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What the stages of LPV share. Device thread. */
#ifndef BRUME_TRANSPORT_LPV_H
#define BRUME_TRANSPORT_LPV_H

#include "transport/opv_ways.h"

/* Bytes of a cell: of the field, and of what is needed while it is found. */
#define FIELD_CELL_BYTES 64
#define FIELD_WORKING_BYTES 328 /* and one layer more of what is cut */
#define FIELD_FUZZY_BYTES 96 /* the same, for fuzzy blockers, and one layer more of their lattice */
/* Beside the lattice: reflective shadow maps, and blocks. */
#define FIELD_FIXED_BYTES (3u << 20)

/* Fuzzy blockers. Their lattice stands half a cell lower than the field's and has a cell more along
 * every side, so that each of its cells lies between eight of the field's. Areas come in pairs: of
 * surfaces whose normals point along the axes, and of those that point against them. */
struct lpv_fuzzy {
    ivec4 dims;                     /* w: tiles in a row of the sums */
    struct texture sums[2];         /* of the maps of one set, layers as tiles */
    struct texture areas[2];        /* the greatest sums of all sets */
    struct texture factors;         /* of what is sent along a cell's 26 links, the share blocked */
    GLuint target;                  /* framebuffer of the sums */
};

/* One run over one lattice. Textures of its size, colours apart. */
struct lpv_work {
    const struct transport_input *input;
    const struct gpu_field *field;  /* the lattice, of the frame */
    struct buffer level;            /* the same for shaders */
    struct lpv_work *around, *within; /* those of the lattices next to it, or NULL */
    const struct texture *product;  /* where the light of all lattices goes in the end */
    int iterations;                 /* so far */
    struct opv_work passes;         /* the block of lattice passes, and how far it is */
    struct texture flow[2][3];      /* light in flight, before and after an iteration */
    struct texture sums[3];         /* what has passed through a cell: the field */
    struct texture cells[3];        /* extinction, albedo, reflectance of the surfaces in it */
    struct texture cells_around;    /* of the lattice around it, by the cells beyond its sides */
    struct texture links, walls;    /* links that surfaces cut; sums of their reflectances */
    struct texture lines;           /* that links are made of, where it is there */
    struct texture reflected[3];    /* what surfaces reflect first, the lattice's layers as tiles */
    int tiles;                      /* of these in a row */
    struct laps *laps;              /* the time of each part, of all lattices */
    struct buffer scattered;        /* by media first; by cells, three vec4 each. Not a texture:
                                     * software stores into those four times as slowly */
    struct buffer powers;           /* in flight after the last iteration, by cells */
    struct lpv_fuzzy fuzzy;         /* nothing, where links block */
};

/* Runs a program over the lattice, or another, in slabs; textures and images are bound. */
brume_result lpv_over_lattice(struct lpv_work *work, const char *stem, ivec4 offset,
                              const ivec4 *dims);
/* The layers of a lattice, tiles of a picture: the rows of these, with so many in each. */
int lpv_tile_rows(const ivec4 *dims, int in_a_row);
/* Adds up so many points, the texels of a map, in a picture of a lattice. */
brume_result lpv_strew(struct lpv_work *work, const char *stem, GLuint target, const ivec4 *dims,
                       int in_a_row, int texels);

/* The cells of all lattices, one above the other, and the texture of their fields. */
void lpv_product_size(const struct gpu_frame *frame, int size[3]);
brume_result lpv_make_product(struct texture *product, const struct transport_input *input);

/* The corners of a lattice. */
void lpv_field_box(const struct gpu_field *field, float lower[3], float upper[3]);

/* Links that surfaces cut, and what these reflect, into work->links, walls and lines, which are new. */
brume_result lpv_cut_links(struct lpv_work *work);
/* What surfaces reflect of the lights' own light, into work->reflected; and where blockers are
 * fuzzy, the areas of the surfaces that lights see, or that are seen from outside. */
brume_result lpv_reflect(struct lpv_work *work);

/* Fuzzy blockers: whether they are wanted. */
bool lpv_is_fuzzy(const struct lpv_work *work);
brume_result lpv_fuzzy_begin(struct lpv_work *work);
/* Adds the map that is bound, with its gpu_reflection at SLOT_STAGE; so many texels. */
brume_result lpv_fuzzy_add(struct lpv_work *work, int texels);
/* Ends a set of maps that see no surface twice. */
brume_result lpv_fuzzy_keep(struct lpv_work *work);
/* The view from outside along an axis (0, 1, 2), from its end or from its beginning. Returns the
 * side of its map, `most` texels at most. */
int lpv_fuzzy_view(const struct lpv_work *work, int axis, bool from_end, int most,
                   struct gpu_shadow_view *out);
/* All links' factors, from the areas. */
brume_result lpv_fuzzy_prepare(struct lpv_work *work);
void lpv_fuzzy_finish(struct lpv_work *work);

#endif
