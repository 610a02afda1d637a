/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The seam for methods of transport: a method is one C file, its shaders, and one line in
 * method.c. A method fills the product below from the medium, the lights and their shadow maps,
 * which are bound when it runs. Device thread. */
#ifndef BRUME_TRANSPORT_METHOD_H
#define BRUME_TRANSPORT_METHOD_H

#include "base/job.h"
#include "brume_gpu.h"
#include "gl/device.h"
#include "render/geometry.h"
#include "scene/world_map.h"
#include "transport/medium_textures.h"

/* What the view takes light from. */
struct transport {
    struct texture tau;    /* optical depth to each light over the length of the way, a tile a light;
                              alpha: of light that a forward peak scatters what is there */
    struct texture sky[3]; /* the world's light, spherical harmonics a colour */
    struct texture field;  /* light scattered or reflected before, as lpv_finish leaves it */
    /* DOM: moments of the light that media scatter, what cells scatter of it to the eye, in the mean
     * and as it is interpolated, what surfaces in cells send out, and band 2 of the field; of so many
     * lattices, one above the other. */
    struct texture light, means, scattered, wall, band_2;
    struct buffer levels[FIELD_LEVELS];
    int level_count;
    uint64_t eye;          /* of the eye that `scattered` was last found for, 0: none */
    /* Signatures of what a light's tile and the sky hold, 0: nothing of use. */
    uint64_t *tau_signatures, sky_signature;
    uint32_t tau_count;
};

struct transport_input {
    struct gpu *gpu;
    const struct medium_textures *medium;
    struct geometry *geometry;
    const brume_settings *settings;
    struct job_control *control;
    const struct gpu_frame *frame;  /* lattices are laid out in it, and bound */
    const struct gpu_light *lights; /* tiles are laid out in them, and bound */
    const struct gpu_light_sample *samples;
    uint32_t light_count;
    uint64_t medium_revision;
    uint64_t world_signature;       /* of the world's samples and shadow maps */
    brume_stats *stats;             /* counts what is propagated */
    const brume_world *world;
    const struct world_map *world_map;
    uint32_t world_first, world_count; /* samples */
    int tau_size[3];                /* texels of the optical depths' texture, 0: none wanted */
};

struct method {
    const char *id;
    brume_result (*run)(struct transport *transport, const struct transport_input *input);
};

/* NULL for an unknown number. */
const struct method *method_find(uint32_t number);
void transport_bind(const struct transport *transport);
/* Bytes of what is known of light scattered or reflected. */
uint64_t transport_field_bytes(const struct transport *transport);
/* Forgets that. */
void transport_forget_field(struct gpu *gpu, struct transport *transport);
/* Of this what DOM alone makes. */
void transport_forget_moments(struct gpu *gpu, struct transport *transport);
void transport_finish(struct gpu *gpu, struct transport *transport);

/* The methods. */
brume_result opv_run(struct transport *transport, const struct transport_input *input);
brume_result lpv_run(struct transport *transport, const struct transport_input *input);
brume_result dom_run(struct transport *transport, const struct transport_input *input);

/* DOM: makes transport->scattered for the eye of the frame, which is bound, unless it is for that one. */
brume_result dom_look(struct gpu *gpu, struct transport *transport, const struct gpu_frame *frame);

#endif
