/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The lights on the GPU: samples that stand for their extent, and one shadow map a sample and face.
 * Device thread. */
#ifndef BRUME_RENDER_SHADOW_H
#define BRUME_RENDER_SHADOW_H

#include "render/emitters.h"
#include "scene/world_map.h"

struct shadows {
    struct gpu_light *lights;
    struct gpu_light_sample *samples;
    struct gpu_shadow_view *views;
    uint32_t light_count, sample_count, view_count;
    uint32_t world_first, world_count; /* samples */
    uint32_t world_faces;              /* maps a sample of the world */
    int side;                          /* texels of a lamp's map; the world's have half */
    uint32_t layer_count;
    struct buffer light_buffer, sample_buffer, view_buffer;
    GLuint light_texture, sample_texture, view_texture; /* of these */
    struct texture maps;
    uint64_t *drawn; /* what each quarter of a layer holds, the first for a whole layer's map: a
                        signature of the map, 0: nothing of use */
    uint64_t world_signature; /* of the world's samples and maps */
    GLuint framebuffer;
};

/* How many maps of what size: as the settings wish, or what fits. */
struct shadow_plan {
    int side;
    uint32_t light_samples, world_samples;
    uint32_t distant; /* maps of a distant light */
    uint32_t lamp_layers, world_layers; /* a layer holds one map of a lamp, or four of the world */
};

/* budget: bytes that the maps may take. Arithmetic alone. */
brume_result shadows_plan(const struct snapshot *snapshot, const struct world_map *map,
                          const struct emitters *emitters, const brume_settings *settings,
                          const struct geometry *geometry, uint64_t budget,
                          struct shadow_plan *plan);
/* Lights, samples and shadow views from the snapshot, for casters within the geometry's bounds;
 * warns where the plan falls short of the settings. */
brume_result shadows_layout(struct shadows *shadows, const struct snapshot *snapshot,
                            const struct world_map *map, const struct emitters *emitters,
                            const brume_settings *settings, const struct geometry *geometry,
                            const struct shadow_plan *plan, struct job_control *control);
/* Uploads them: the tiles in lights[].info may have been set in between. */
brume_result shadows_upload(struct gpu *gpu, struct shadows *shadows);
/* Draws the maps that differ from what their places hold, and adds to their count.
 * casters: a signature that tells them apart. */
brume_result shadows_render(struct gpu *gpu, struct shadows *shadows, struct geometry *geometry,
                            uint64_t casters, struct job_control *control, uint32_t *drawn);
void shadows_bind(const struct shadows *shadows);
void shadows_finish(struct gpu *gpu, struct shadows *shadows);

#endif
