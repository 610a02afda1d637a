/* SPDX-License-Identifier: GPL-3.0-or-later */
/* DOM: multiple scattering by discrete ordinates, which converges to the truth;
 * docs/methods/dom.md. Optical depths towards the lamps are OPV's, surfaces' cuts and reflections
 * LPV's. */
#include "transport/dom_work.h"
#include "base/hash.h"
#include "base/result.h"
#include "gl/timer.h"
#include "transport/method.h"

/* Light of another lattice to begin with, where that one is. */
static brume_result begin_with(struct dom_work *work, const struct buffer *level,
                               const struct texture *light, const struct texture *wall,
                               ivec4 offset)
{
    dom_bind_lattice(work);
    glBindBufferBase(GL_UNIFORM_BUFFER, SLOT_LEVEL_BEFORE, level->id);
    glBindTextureUnit(SLOT_ANGULAR, light->id);
    glBindTextureUnit(SLOT_CELL_WALLS, wall->id);
    glBindTextureUnit(SLOT_MOMENTS, work->world.id);
    dom_image(SLOT_OUTPUT, &work->now);
    dom_image(SLOT_OUTPUT + 1, &work->wall);
    work->warm = true;
    return dom_over_field(work, "dom_warm", offset);
}

/* What iterations begin with: what the lattice around has found, and light of the last run. Not of
 * finer lattices than this: what they tell at its cells' centres is not the cells' mean. */
static brume_result warm_up(struct dom_work *work, const struct transport *transport)
{
    const struct dom_work *around = work->around;
    if (around)
        TRY(begin_with(work, &around->cells.level, &around->now, &around->wall, (ivec4){0}));
    const int levels = work->cells.input->settings->warm ? transport->level_count : 0;
    for (int i = 0; i < levels && i <= work->number; ++i)
        TRY(begin_with(work, &transport->levels[i], &transport->light, &transport->wall,
                       (ivec4){dom_has_world(work), 1, 0, 0}));
    return BRUME_OK;
}

static brume_result hand_over(struct dom_work *work, struct transport *transport)
{
    dom_bind_lattice(work);
    glBindTextureUnit(SLOT_MOMENTS, work->now.id);
    glBindTextureUnit(SLOT_MOMENTS + 1, work->world.id);
    glBindTextureUnit(SLOT_WALLS, work->cells.walls.id);
    glBindTextureUnit(SLOT_CELL_WALLS, work->wall.id);
    dom_image(SLOT_OUTPUT, &transport->field);
    dom_image(SLOT_OUTPUT + 1, &transport->light);
    dom_image(SLOT_OUTPUT + 2, &transport->wall);
    dom_image(SLOT_OUTPUT + 3, &transport->band_2);
    return dom_over_field(work, "dom_finish", (ivec4){dom_has_world(work), 0, 0, 0});
}

static brume_result make_product(struct transport *transport, const struct transport_input *input)
{
    struct memory *memory = &input->gpu->memory;
    const struct gpu_frame *frame = input->frame;
    int size[3];
    lpv_product_size(frame, size);
    const int x = size[0], y = size[1], z = size[2];
    TRY(lpv_make_product(&transport->field, input));
    TRY(texture_ensure(memory, &transport->light, FOR_TRANSPORT, GL_TEXTURE_3D, GL_RGBA16F,
                       texture_side(MOMENT_SIDE * x), texture_side(MOMENT_SIDE * y),
                       texture_side(z), 1, "moments"));
    TRY(texture_ensure(memory, &transport->means, FOR_TRANSPORT, GL_TEXTURE_3D, GL_RGBA16F,
                       texture_side(x), texture_side(y), texture_side(z), 1,
                       "means scattered towards the eye"));
    TRY(texture_ensure(memory, &transport->scattered, FOR_TRANSPORT, GL_TEXTURE_3D, GL_RGBA16F,
                       texture_side(x), texture_side(y), texture_side(z), 1,
                       "scattered towards the eye"));
    TRY(texture_ensure(memory, &transport->wall, FOR_TRANSPORT, GL_TEXTURE_3D, GL_RGBA16F,
                       texture_side(x), texture_side(y), texture_side(z), 1, "surfaces' radiance"));
    TRY(texture_ensure(memory, &transport->band_2, FOR_TRANSPORT, GL_TEXTURE_3D, GL_RGBA16F,
                       texture_side(BAND_2 * x), texture_side(y), texture_side(z), 1, "band 2"));
    for (int i = 0; i < frame->field.x; ++i)
        TRY(buffer_update(memory, &transport->levels[i], FOR_TRANSPORT, sizeof frame->fields[i],
                          &frame->fields[i], "lattice"));
    return BRUME_OK;
}

/* From the outermost lattice to the innermost. What was known before stays until all is found: a
 * run that is cancelled loses nothing. */
static brume_result find(struct dom_work *works, int levels, struct transport *transport)
{
    for (int i = 0; i < levels; ++i) {
        TRY(dom_prepare(&works[i]));
        TRY(dom_begin(&works[i]));
        TRY(warm_up(&works[i], transport));
        TRY(dom_solve(&works[i]));
    }
    transport->eye = 0;
    transport->level_count = 0;
    laps_go(works->cells.laps, BRUME_FIELD_COPY);
    TRY(make_product(transport, works->cells.input));
    for (int i = 0; i < levels; ++i)
        TRY(hand_over(&works[i], transport));
    transport->level_count = levels;
    return BRUME_OK;
}

brume_result dom_run(struct transport *transport, const struct transport_input *input)
{
    TRY(opv_run(transport, input));
    const int levels = input->frame->field.x;
    if (!levels)
        return BRUME_OK;
    transport_bind(transport); /* depths, as OPV has just found them */
    struct laps laps = {.sums_ms = input->stats->field_ms};
    struct dom_work works[FIELD_LEVELS] = {0};
    const bool surrounded = dom_has_surroundings(input);
    for (int i = 0; i < levels; ++i)
        works[i] = (struct dom_work){
            .cells = {.input = input,
                      .field = &input->frame->fields[i],
                      .laps = &laps,
                      .passes = {.input = input, .done = 1.0f}},
            .around = i ? &works[i - 1] : NULL,
            .number = i,
            .has_within = i + 1 < levels,
            .surrounded = surrounded,
            .count = input->settings->ordinates,
        };
    const brume_result result = find(works, levels, transport);
    for (int i = 0; i < levels; ++i)
        dom_finish(&works[i]);
    laps_end(&laps);
    return result;
}

/* Where the eye is, or for a parallel view which way it looks. */
static uint64_t eye_signature(const struct gpu_frame *frame)
{
    const float eye[4] = {frame->eye.x, frame->eye.y, frame->eye.z, frame->eye.w};
    const uint64_t hash = hash_bytes(HASH_START, eye, sizeof eye);
    return hash ? hash : 1;
}

/* Every cell of all lattices. */
static brume_result look_through(struct gpu *gpu, struct transport *transport,
                                 const struct gpu_frame *frame, const char *name)
{
    const struct program *program;
    TRY(program_compute(&gpu->programs, name, &program));
    for (int i = 0; i < frame->field.x; ++i) {
        const ivec4 dims = frame->fields[i].dims;
        glBindBufferBase(GL_UNIFORM_BUFFER, SLOT_LEVEL, transport->levels[i].id);
        program_dispatch(program, dims.x, dims.y, dims.z);
    }
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    return BRUME_OK;
}

brume_result dom_look(struct gpu *gpu, struct transport *transport, const struct gpu_frame *frame)
{
    const uint64_t eye = eye_signature(frame);
    if (transport->eye == eye)
        return BRUME_OK;
    glBindTextureUnit(SLOT_MOMENTS, transport->light.id);
    dom_image(SLOT_OUTPUT, &transport->means);
    TRY(look_through(gpu, transport, frame, "dom_eye"));
    glBindTextureUnit(SLOT_SCATTERED, transport->means.id);
    dom_image(SLOT_OUTPUT, &transport->scattered);
    TRY(look_through(gpu, transport, frame, "dom_between"));
    glBindTextureUnit(SLOT_SCATTERED, transport->scattered.id);
    transport->eye = eye;
    return BRUME_OK;
}
