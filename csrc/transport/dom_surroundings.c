/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What surrounds the lattice: the world's light along an ordinate, or that of surfaces beyond the
 * lattice's sides which hide it, such as a wide ground. */
#include "base/result.h"
#include "scene/light_view.h"
#include "transport/dom.h"

#define SIDE 32 /* texels of a map */

struct maps {
    struct texture colors[3], depth; /* position, normal, reflectance */
    GLuint framebuffer;
};

bool dom_has_surroundings(const struct transport_input *input)
{
    const struct geometry *geometry = input->geometry;
    const struct gpu_field *field = &input->frame->fields[0];
    const float room = field->lower.w;
    float lower[3], upper[3];
    lpv_field_box(field, lower, upper);
    if (!(geometry->lower[0] <= geometry->upper[0]))
        return false;
    for (int i = 0; i < 3; ++i)
        if (geometry->lower[i] < lower[i] - room || geometry->upper[i] > upper[i] + room)
            return true;
    return false;
}

static brume_result make_maps(struct memory *memory, struct maps *maps)
{
    static const GLenum formats[] = {GL_RGBA32F, GL_RGBA16F, GL_RGBA16F};
    static const GLenum targets[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1,
                                     GL_COLOR_ATTACHMENT2};
    glCreateFramebuffers(1, &maps->framebuffer);
    for (int i = 0; i < 3; ++i) {
        TRY(texture_init(memory, &maps->colors[i], FOR_TRANSPORT, GL_TEXTURE_2D, formats[i], SIDE,
                         SIDE, 1, 1, "surroundings"));
        glNamedFramebufferTexture(maps->framebuffer, targets[i], maps->colors[i].id, 0);
    }
    TRY(texture_init(memory, &maps->depth, FOR_TRANSPORT, GL_TEXTURE_2D, GL_DEPTH_COMPONENT32F,
                     SIDE, SIDE, 1, 1, "surroundings' depths"));
    glNamedFramebufferTexture(maps->framebuffer, GL_DEPTH_ATTACHMENT, maps->depth.id, 0);
    glNamedFramebufferDrawBuffers(maps->framebuffer, 3, targets);
    return BRUME_OK;
}

static void finish_maps(struct memory *memory, struct maps *maps)
{
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glDeleteFramebuffers(1, &maps->framebuffer);
    for (int i = 0; i < 3; ++i)
        texture_finish(memory, &maps->colors[i]);
    texture_finish(memory, &maps->depth);
}

static void view_out(const struct lpv_work *cells, const vec4 *direction,
                     struct gpu_shadow_view *view)
{
    const struct geometry *geometry = cells->input->geometry;
    float lower[3], upper[3];
    lpv_field_box(cells->field, lower, upper);
    light_view_distant(geometry->lower, geometry->upper, lower, upper, direction, SIDE, view);
}

void dom_place_map(const struct lpv_work *cells, struct gpu_ordinate *ordinate)
{
    struct gpu_shadow_view view;
    view_out(cells, &ordinate->direction, &view);
    const float *m = view.clip_from_world.m;
    ordinate->map_u = (vec4){0.5f * m[0], 0.5f * m[4], 0.5f * m[8], 0.5f * m[12] + 0.5f};
    ordinate->map_v = (vec4){0.5f * m[1], 0.5f * m[5], 0.5f * m[9], 0.5f * m[13] + 0.5f};
}

/* Out of the lattice, against the ordinate. */
static brume_result draw(struct lpv_work *cells, const struct maps *maps, const vec4 *direction)
{
    static const float nothing[4], far_;
    const struct transport_input *input = cells->input;
    struct gpu_shadow_view view;
    view_out(cells, direction, &view);
    glBindFramebuffer(GL_FRAMEBUFFER, maps->framebuffer);
    glViewport(0, 0, SIDE, SIDE);
    glClearNamedFramebufferfv(maps->framebuffer, GL_COLOR, 0, nothing);
    glClearNamedFramebufferfv(maps->framebuffer, GL_DEPTH, 0, &far_);
    const struct gpu_draw stage = {.clip_from_world = view.clip_from_world,
                                   .eye = {-direction->x, -direction->y, -direction->z, 1.0f}};
    return geometry_draw(input->gpu, input->geometry, &stage, BRUME_VISIBLE_SHADOW,
                         GEOMETRY_REFLECT);
}

static brume_result look_out(struct lpv_work *cells, const struct maps *maps,
                             const vec4 *directions, int count, const struct texture *out)
{
    const struct program *program;
    TRY(program_compute(&cells->input->gpu->programs, "dom_surroundings", &program));
    glBindImageTexture(SLOT_OUTPUT, out->id, 0, GL_TRUE, 0, GL_WRITE_ONLY, out->format);
    for (int k = 0; k < count; ++k) {
        TRY(opv_go_on(&cells->passes, 0.0f));
        TRY(draw(cells, maps, &directions[k]));
        for (int i = 0; i < 3; ++i)
            glBindTextureUnit((GLuint)(SLOT_RSM + i), maps->colors[i].id);
        glProgramUniform2i(program->id, 0, k, SIDE);
        program_dispatch(program, SIDE, SIDE, 1);
    }
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    return BRUME_OK;
}

brume_result dom_look_out(struct lpv_work *cells, const vec4 *directions, int count,
                          struct texture *out)
{
    struct memory *memory = &cells->input->gpu->memory;
    struct maps maps = {0};
    TRY(texture_init(memory, out, FOR_TRANSPORT, GL_TEXTURE_2D_ARRAY, GL_RGBA16F, SIDE, SIDE, count,
                     1, "surroundings"));
    brume_result result = make_maps(memory, &maps);
    if (result == BRUME_OK)
        result = look_out(cells, &maps, directions, count, out);
    finish_maps(memory, &maps);
    return result;
}
