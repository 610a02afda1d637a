/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The stages of a frame, each run only when one of its inputs changed. One renderer a scene; device
 * thread. */
#ifndef BRUME_RENDER_RENDERER_H
#define BRUME_RENDER_RENDERER_H

#include "render/geometry.h"
#include "render/shadow.h"
#include "render/view.h"
#include "transport/method.h"

struct stage_record {
    uint64_t signature; /* of the inputs of the last run; 0: never, or it failed */
    uint64_t revision, runs;
    struct job_warning *warnings; /* of the last run: they hold as long as its product */
    uint32_t warning_count;
};

/* Bytes that each lattice and the shadow maps may take: what the budget leaves beside pictures,
 * meshes and images. */
struct shares {
    uint64_t medium, shadow, depth, sky, field;
};

struct renderer {
    struct stage_record stages[BRUME_STAGE_COUNT];
    struct geometry geometry;
    struct medium_textures medium;
    struct world_map world_map;
    struct shadows shadows;
    struct transport transport;
    struct view_targets *targets; /* the pool of its jobs' */
    struct gpu_frame frame;
    struct buffer frame_block;
    int tau_size[3];
    int field_resolution; /* cells of the frame's lattice of scattered light */
    struct shares shares;
    struct shadow_plan shadow_plan;
    struct emitters emitters;
};

/* What one job asks for and gets. */
struct render_request {
    const struct snapshot *snapshot;
    brume_settings settings; /* defaults filled in */
    brume_view view;
    struct job_control *control;
    struct picture *front; /* the newest whole picture, guarded by the control's mutex */
    struct picture back;   /* the next one; owned by whoever made the request */
    brume_stats stats;
    /* How far it is. */
    struct view_targets *targets; /* from the first step to the last */
    uint32_t sample;
    bool drawn; /* the sample's G-buffer */
    int row;
    uint64_t products;   /* of the scene's stages, as its warnings tell of them */
    double next_picture;
};

/* Renders a sample, or as much of it as a CPU does in a moment; what the scene's stages lack for it
 * comes first. *more: there is more to do, and the result is BRUME_OK. Other requests may take steps
 * in between. */
brume_result renderer_step(struct gpu *gpu, struct renderer *renderer,
                           struct render_request *request, bool *more);
void renderer_finish(struct gpu *gpu, struct renderer *renderer);

#endif
