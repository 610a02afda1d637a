/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The view's stages: G-buffer, shading, march, and reading the passes back. Device thread. */
#ifndef BRUME_RENDER_VIEW_H
#define BRUME_RENDER_VIEW_H

#include "render/geometry.h"

struct view_targets {
    struct texture normal, diffuse, specular, emission, tint, depth, surface;
    struct buffer accumulation;
    GLuint framebuffer, tint_framebuffer;
};

/* Bytes of a pixel: five attachments, depth, the surfaces' radiance, and a vec4 a pass. */
#define VIEW_PIXEL_BYTES 68
#define VIEW_PASS_PIXEL_BYTES 16

uint64_t view_bytes(const brume_view *view);
/* Frees targets that are not of this view's size, before anything else takes their memory. */
void view_forget(struct gpu *gpu, struct view_targets *targets, const brume_view *view);

/* The camera's part of the frame's block, for one sample of a pixel. */
void view_frame(const brume_view *view, uint32_t sample, struct gpu_frame *frame);

brume_result view_begin(struct gpu *gpu, struct view_targets *targets, const brume_view *view);
brume_result view_gbuffer(struct gpu *gpu, struct view_targets *targets, struct geometry *geometry,
                          const brume_view *view, uint32_t sample);
brume_result view_shade(struct gpu *gpu, struct view_targets *targets, const brume_view *view);
/* In bands of rows on a CPU, so that a cancel comes through; the band stands in the frame. */
brume_result view_march(struct gpu *gpu, struct view_targets *targets, const brume_view *view,
                        struct gpu_frame *frame, struct buffer *frame_block,
                        struct job_control *control);
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
void view_finish(struct gpu *gpu, struct view_targets *targets);

#endif
