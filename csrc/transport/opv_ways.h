/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The ways to find the depths of a lattice's nodes to some sources, each with a shader of its name;
 * and what they share. Device thread. */
#ifndef BRUME_TRANSPORT_OPV_WAYS_H
#define BRUME_TRANSPORT_OPV_WAYS_H

#include "transport/method.h"

/* One run: sources, which are bound, and the texture that their tiles are in. */
struct opv_work {
    const struct transport_input *input;
    struct texture *texture;
    const struct gpu_depth_source *sources;
    uint32_t count;
    float done, share; /* of all depths, before this run and by it: for progress */
    struct buffer block, groups;
};

brume_result opv_propagate(struct opv_work *run);
brume_result opv_march(struct opv_work *run);
brume_result opv_gather(struct opv_work *run);
brume_result opv_iterate(struct opv_work *run);

/* What a way needs beside the texture, for so many sources at once, in bytes. */
uint64_t opv_propagate_bytes(const ivec4 *dims, uint32_t sources);
uint64_t opv_iterate_bytes(const ivec4 *dims, uint32_t sources, int texture_limit);

brume_result opv_set_pass(struct opv_work *run, struct gpu_lattice_pass pass);
void opv_bind_image(const struct texture *texture);
/* Between two steps: tells the progress, `part` of the run, and ends a cancelled one. */
brume_result opv_go_on(const struct opv_work *run, float part);

/* Runs a program over a whole lattice in slabs, so that a cancel need not wait for all of it; the
 * progress goes on from one part of the run by another. */
brume_result opv_slabs(struct opv_work *run, const struct program *program,
                       struct gpu_lattice_pass pass, const ivec4 *dims, float from, float part);

/* Bytes of a texture that holds depths. */
uint64_t opv_texture_bytes(int width, int height, int depth);

#endif
