/* SPDX-License-Identifier: GPL-3.0-or-later */
/* OPV: single scattering through one optical depth a node and light. "Real-time single scattering
 * in heterogeneous media by opacity propagation volumes"; docs/methods/opv.md. The world's light
 * goes into a lattice of its own. */
#include "base/hash.h"
#include "base/result.h"
#include "transport/depths.h"
#include "transport/method.h"
#include "transport/opv_ways.h"

#include <stdlib.h>

/* All that a light's depths are made from, and where they are. 0: the light has no tile. */
static uint64_t tau_signature(const struct transport_input *input, const struct gpu_light *light)
{
    if (!light->info.w)
        return 0;
    const struct gpu_frame *frame = input->frame;
    const vec4 point = {light->position.x, light->position.y, light->position.z, 0.0f};
    const uint32_t count = depths_samples(light, frame->lattice_lower.w);
    const uint64_t parts[] = {input->medium_revision, light->info.x, light->info.y,
                              light->info.z,          count,         input->settings->depths};
    uint64_t hash = hash_bytes(HASH_START, parts, sizeof parts);
    hash = hash_bytes(hash, &frame->lattice_lower, sizeof frame->lattice_lower);
    hash = hash_bytes(hash, &frame->lattice_dims, sizeof frame->lattice_dims);
    hash = hash_bytes(hash, &point, sizeof point);
    if (input->medium->forward > 0.0f) /* dom_astray looks at the world's medium, too */
        hash = hash_bytes(hash, &frame->fog_sigma_s, sizeof frame->fog_sigma_s);
    for (uint32_t i = 0; count > 1 && i < light->samples.y; ++i)
        hash = hash_bytes(hash, &input->samples[light->samples.x + i].position, sizeof(float[3]));
    return hash;
}

/* Keeps the signatures of tiles that stay as they are; 0 for all others. *wanted: of all lights. */
static brume_result compare_tiles(struct transport *transport, const struct transport_input *input,
                                  uint64_t **wanted)
{
    const struct texture *tau = &transport->tau;
    const int *size = input->tau_size;
    const uint32_t kept = tau->width == size[0] && tau->height == size[1] && tau->depth == size[2]
                              ? transport->tau_count
                              : 0;
    uint64_t *held = calloc(2 * (size_t)input->light_count, sizeof *held);
    if (!held)
        return fail(BRUME_E_MEMORY, "no memory for %u lights", input->light_count);
    *wanted = held + input->light_count;
    for (uint32_t i = 0; i < input->light_count; ++i) {
        (*wanted)[i] = tau_signature(input, &input->lights[i]);
        if (i < kept && transport->tau_signatures[i] == (*wanted)[i])
            held[i] = (*wanted)[i];
    }
    free(transport->tau_signatures);
    transport->tau_signatures = held;
    transport->tau_count = input->light_count;
    return BRUME_OK;
}

static brume_result run_tau(struct transport *transport, const struct transport_input *input)
{
    uint64_t *wanted = NULL;
    uint32_t count = 0;
    TRY(compare_tiles(transport, input, &wanted));
    TRY(texture_ensure(&input->gpu->memory, &transport->tau, FOR_TRANSPORT, GL_TEXTURE_3D,
                       GL_RGBA16F, input->tau_size[0], input->tau_size[1], input->tau_size[2], 1,
                       "optical depths"));
    uint32_t *changed = malloc((input->light_count + 1) * sizeof *changed);
    if (!changed)
        return fail(BRUME_E_MEMORY, "no memory for %u lights", input->light_count);
    for (uint32_t i = 0; i < input->light_count; ++i)
        if (transport->tau_signatures[i] != wanted[i])
            changed[count++] = i;
    const brume_result result = count ? depths_run(transport, input, changed, count) : BRUME_OK;
    for (uint32_t i = 0; i < count && result == BRUME_OK; ++i)
        transport->tau_signatures[changed[i]] = wanted[changed[i]];
    if (result == BRUME_OK)
        input->stats->lights_propagated += count;
    free(changed);
    return result;
}

/* All that opv_sky reads. */
static uint64_t sky_signature(const struct transport_input *input)
{
    const struct gpu_frame *frame = input->frame;
    const uint64_t parts[] = {input->medium_revision, input->world_signature};
    const vec4 vectors[] = {frame->sky_lower, frame->fog_lower, frame->fog_upper,
                            frame->fog_sigma_t};
    uint64_t hash = hash_bytes(HASH_START, parts, sizeof parts);
    hash = hash_bytes(hash, vectors, sizeof vectors);
    return hash_bytes(hash, &frame->sky_dims, sizeof frame->sky_dims);
}

static brume_result run_sky(struct transport *transport, const struct transport_input *input)
{
    static const char *const labels[] = {"sky red", "sky green", "sky blue"};
    const struct program *program;
    const ivec4 *dims = &input->frame->sky_dims;
    const uint64_t wanted = sky_signature(input);
    if (transport->sky_signature == wanted)
        return BRUME_OK;
    transport->sky_signature = 0;
    TRY(program_compute(&input->gpu->programs, "opv_sky", &program));
    for (int i = 0; i < 3; ++i) {
        TRY(texture_ensure(&input->gpu->memory, &transport->sky[i], FOR_TRANSPORT, GL_TEXTURE_3D,
                           GL_RGBA16F, texture_side(dims->x), texture_side(dims->y),
                           texture_side(dims->z), 1, labels[i]));
        glBindImageTexture((GLuint)(SLOT_OUTPUT + i), transport->sky[i].id, 0, GL_TRUE, 0,
                           GL_WRITE_ONLY, GL_RGBA16F);
    }
    struct opv_work work = {.input = input, .done = 1.0f, .share = 0.5f}; /* after the lamps' */
    const brume_result result =
        opv_slabs(&work, program, (struct gpu_lattice_pass){0}, dims, 0.0f, 1.0f);
    buffer_finish(&input->gpu->memory, &work.block);
    TRY(result);
    transport->sky_signature = wanted;
    ++input->stats->sky_propagated;
    return BRUME_OK;
}

static void forget_tau(struct transport *transport, const struct transport_input *input)
{
    texture_finish(&input->gpu->memory, &transport->tau);
    transport->tau_count = 0;
}

static void forget_sky(struct transport *transport, const struct transport_input *input)
{
    for (int i = 0; i < 3; ++i)
        texture_finish(&input->gpu->memory, &transport->sky[i]);
    transport->sky_signature = 0;
}

brume_result opv_run(struct transport *transport, const struct transport_input *input)
{
    if (input->tau_size[0] > 0)
        TRY(run_tau(transport, input));
    else
        forget_tau(transport, input);
    if (input->frame->sky_dims.w)
        TRY(run_sky(transport, input));
    else
        forget_sky(transport, input);
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    return BRUME_OK;
}
