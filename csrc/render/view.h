/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The view's stages: G-buffer, shading, march, and reading the passes back. Device thread. */
#ifndef BRUME_RENDER_VIEW_H
#define BRUME_RENDER_VIEW_H

#include "render/geometry.h"

/* What a job draws into, from its first sample to its last. */
struct view_targets {
    struct texture normal, diffuse, specular, emission, tint, depth, surface;
    struct buffer accumulation;
    struct texture half; /* these two where the view wants half_march */
    struct buffer rest;  /* groups, count, places of pixels that the texture tells nothing of */
    GLuint framebuffer, tint_framebuffer;
    bool busy;                 /* a job's; others are free to take */
    struct view_targets *next; /* of the pool */
};

/* Bytes of a pixel: five attachments, depth, the surfaces' radiance, and a vec4 a pass. */
#define VIEW_PIXEL_BYTES 68
#define VIEW_PASS_PIXEL_BYTES 16
/* With half_march also of a block of 2 x 2 pixels, of each pixel, and before those. */
#define VIEW_HALF_BLOCK_BYTES 64
#define VIEW_REST_PIXEL_BYTES 4
#define VIEW_REST_BYTES 16

uint64_t view_bytes(const brume_view *view);
/* Bytes of the pool's targets: of those that jobs hold, or of the idle ones. */
uint64_t view_pool_bytes(const struct view_targets *pool, bool busy);
/* Cleared targets of this view's size: idle ones, or new ones after all idle ones are freed. */
brume_result view_take(struct gpu *gpu, struct view_targets **pool, const brume_view *view,
                       struct view_targets **out);
/* Makes them idle; a few are kept. NULL is fine. */
void view_give_back(struct gpu *gpu, struct view_targets **pool, struct view_targets *targets);
/* Frees the idle ones. */
void view_pool_trim(struct gpu *gpu, struct view_targets **pool);

/* The camera's part of the frame's block, for one sample of a pixel. */
void view_frame(const brume_view *view, uint32_t sample, struct gpu_frame *frame);

brume_result view_gbuffer(struct gpu *gpu, struct view_targets *targets, struct geometry *geometry,
                          const brume_view *view, uint32_t sample);
/* For the two below, once the G-buffer is drawn; they do the rows that stand in the frame: from the
 * first to the one before the end, multiples of GROUP_PIXELS but for the picture's own end. */
void view_bind(const struct view_targets *targets);
brume_result view_shade(struct gpu *gpu, const brume_view *view, int first, int end);
/* With VIEW_MARCH_DOM media take the field from the lattice of what cells scatter towards the eye, and
 * strong forward scattering counts as none in all optical depths (delta-M); VIEW_MARCH_DOM_LAMPS is
 * the same where there are lamps. */
enum view_march_kind { VIEW_MARCH, VIEW_MARCH_DOM, VIEW_MARCH_DOM_LAMPS };
brume_result view_march(struct gpu *gpu, const struct view_targets *targets, const brume_view *view,
                        enum view_march_kind kind, int first, int end);

/* The passes as floats in main memory. */
struct picture {
    float *pixels[BRUME_PASS_COUNT]; /* width * height * channels; NULL: not wanted */
    uint32_t samples;                /* that it is the mean of; 0: nothing in it yet */
};

brume_result picture_init(struct picture *picture, const brume_view *view);
void picture_finish(struct picture *picture);

/* The mean over the samples of one pass, pixels * channels floats. */
brume_result view_read(struct view_targets *targets, const brume_view *view, uint32_t pass,
                       uint32_t samples, float *pixels);

#endif
