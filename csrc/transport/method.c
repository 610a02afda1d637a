/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The table of methods. */
#include "transport/method.h"

#include <stdlib.h>
#include <string.h>

static const struct method methods[BRUME_METHOD_COUNT] = {
    [BRUME_METHOD_OPV] = {"OPV", opv_run},
    [BRUME_METHOD_LPV] = {"LPV", lpv_run},
    [BRUME_METHOD_DOM] = {"DOM", dom_run},
};

const struct method *method_find(uint32_t number)
{
    return number < BRUME_METHOD_COUNT ? &methods[number] : NULL;
}

void transport_bind(const struct transport *transport)
{
    glBindTextureUnit(SLOT_TAU, transport->tau.id);
    glBindTextureUnit(SLOT_SKY_R, transport->sky[0].id);
    glBindTextureUnit(SLOT_SKY_G, transport->sky[1].id);
    glBindTextureUnit(SLOT_SKY_B, transport->sky[2].id);
    glBindTextureUnit(SLOT_FIELD, transport->field.id);
    glBindTextureUnit(SLOT_SCATTERED, transport->scattered.id);
    glBindTextureUnit(SLOT_BAND_2, transport->band_2.id);
}

uint64_t transport_field_bytes(const struct transport *transport)
{
    uint64_t bytes = transport->field.bytes + transport->light.bytes + transport->means.bytes +
                     transport->scattered.bytes + transport->wall.bytes + transport->band_2.bytes;
    for (int i = 0; i < FIELD_LEVELS; ++i)
        bytes += transport->levels[i].bytes;
    return bytes;
}

void transport_forget_moments(struct gpu *gpu, struct transport *transport)
{
    texture_finish(&gpu->memory, &transport->light);
    texture_finish(&gpu->memory, &transport->means);
    texture_finish(&gpu->memory, &transport->scattered);
    texture_finish(&gpu->memory, &transport->wall);
    texture_finish(&gpu->memory, &transport->band_2);
    for (int i = 0; i < FIELD_LEVELS; ++i)
        buffer_finish(&gpu->memory, &transport->levels[i]);
    transport->level_count = 0;
}

void transport_forget_field(struct gpu *gpu, struct transport *transport)
{
    texture_finish(&gpu->memory, &transport->field);
    transport_forget_moments(gpu, transport);
}

void transport_finish(struct gpu *gpu, struct transport *transport)
{
    texture_finish(&gpu->memory, &transport->tau);
    for (int i = 0; i < 3; ++i)
        texture_finish(&gpu->memory, &transport->sky[i]);
    transport_forget_field(gpu, transport);
    free(transport->tau_signatures);
    memset(transport, 0, sizeof *transport);
}
