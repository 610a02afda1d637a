/* SPDX-License-Identifier: GPL-3.0-or-later */
/* One run of DOM over one lattice, and what its steps share. Device thread. */
#ifndef BRUME_TRANSPORT_DOM_WORK_H
#define BRUME_TRANSPORT_DOM_WORK_H

#include "transport/dom.h"

struct dom_work {
    struct lpv_work cells;         /* the lattice: what it is filled with, and its surfaces */
    const struct dom_work *around; /* the lattice around, whose light is known; or NULL */
    int number;                    /* of the lattice, from outside */
    bool surrounded;               /* whether surfaces stand beyond the outermost one's sides, */
    struct texture surroundings;   /* which this shows then, of the outermost */
    bool has_within;               /* whether another stands in it */
    int count, axes[3];            /* ordinates: all, and by their major axes */
    vec4 directions[MOST_ORDINATES], sky[MOST_ORDINATES]; /* the world's radiance along each */
    int across;                                           /* tiles of theirs along z */
    struct buffer ordinates, dots;
    struct texture sources, means, hits;    /* by ordinates */
    struct texture world_means;             /* the same of the world's own light, for one within */
    struct texture slices[2];               /* what leaves a slice of cells */
    bool warm;                              /* whether iterations begin with what was known */
    struct texture cuts;                    /* what surfaces do to links */
    struct texture wall;                    /* radiance of surfaces */
    struct texture emission;                /* of surfaces */
    struct texture depths, missing[3];      /* for diffusion: of cells; the fluence, by steps */
    struct texture first, world, now, next; /* moments: of the first source, of the world's own
                                               light, of what an iteration begins with, and finds */
    struct texture residuals[HISTORY], results[HISTORY]; /* bands 0, 1, surfaces */
    int slots[HISTORY], kept;                            /* which of these, from the oldest on */
    double products[3][HISTORY][HISTORY];                /* of residuals, by slots, colours apart */
};

/* --- The lattice ---------------------------------------------------------------------------- */

/* Makes all of its textures, and fills them with what surfaces and medium are; iterations know
 * nothing yet. */
brume_result dom_prepare(struct dom_work *work);
void dom_finish(struct dom_work *work);

/* Whether light comes into the lattice from outside that no lamp of the scene sends there. */
bool dom_has_world(const struct dom_work *work);

/* Binds what all passes read: the lattice, its ordinates and medium, links that are cut. */
void dom_bind_lattice(const struct dom_work *work);
/* Binds a texture to be written. */
void dom_image(int slot, const struct texture *texture);
/* Runs a program over all cells, and lets what it wrote be read. */
brume_result dom_over_field(struct dom_work *work, const char *stem, ivec4 offset);

/* --- Light ---------------------------------------------------------------------------------- */

/* Light along all ordinates through the whole lattice, slice by slice, into work->means: the
 * world's own alone, or that of sources and surfaces. */
brume_result dom_sweep(struct dom_work *work, bool world);
/* The moments of work->means, into `moments`; of light from sources also the history's newest. */
brume_result dom_gather(struct dom_work *work, const struct texture *moments, bool sources);

/* The world's own light, and what the medium scatters of it and of the lamps' first. */
brume_result dom_begin(struct dom_work *work);
/* Iterates until little enough is yet to find, into work->now and wall. */
brume_result dom_solve(struct dom_work *work);

#endif
