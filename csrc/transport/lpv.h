/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What the stages of LPV share. Device thread. */
#ifndef BRUME_TRANSPORT_LPV_H
#define BRUME_TRANSPORT_LPV_H

#include "transport/opv_ways.h"

/* Bytes of a cell: of the field, and of what is needed while it is found. */
#define FIELD_CELL_BYTES 64
#define FIELD_WORKING_BYTES 240 /* and one layer more of what is cut */
/* Beside the lattice: reflective shadow maps, and blocks. */
#define FIELD_FIXED_BYTES (3u << 20)

/* One run. Textures of the lattice's size, colours apart. */
struct lpv_work {
    const struct transport_input *input;
    struct opv_work passes;         /* the block of lattice passes, and how far it is */
    struct texture flow[2][3];      /* light in flight, before and after an iteration */
    struct texture sums[3];         /* what has passed through a cell: the field */
    struct texture cells[3];        /* extinction, albedo, reflectance of the surfaces in it */
    struct texture links, walls;    /* links that surfaces cut; sums of their reflectances */
    struct texture reflected[3];    /* what surfaces reflect first, the lattice's layers as tiles */
    int tiles;                      /* of these in a row */
    struct buffer powers;           /* in flight, a group of the last iteration */
    bool media;                     /* false: the lattice knows surfaces alone */
};

/* Links that surfaces cut, and what these reflect, into work->links and walls. */
brume_result lpv_cut_links(struct lpv_work *work);
/* What surfaces reflect of the lights' own light, into work->reflected. */
brume_result lpv_reflect(struct lpv_work *work);

#endif
