/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What surfaces reflect of the lights' own light: reflective shadow maps, one after another, each
 * strewn into the lattice as points that add up. */
#include "base/result.h"
#include "gl/timer.h"
#include "scene/light_view.h"
#include "transport/lpv.h"

#include <math.h>

#define SUN_SIDE 256 /* texels of a map */
#define FACE_SIDE 128
#define WORLD_SIDE 64
#define WORLD_MAPS 32  /* at most */
#define LAMP_SAMPLES 4 /* of a lamp with extent, at most */

struct maps {
    struct texture position, normal, diffuse, depth;
    GLuint framebuffer, target, vertex_array;
    struct buffer block;
};

static brume_result make_maps(struct lpv_work *work, struct maps *maps)
{
    struct memory *memory = &work->input->gpu->memory;
    TRY(texture_init(memory, &maps->position, FOR_TRANSPORT, GL_TEXTURE_2D, GL_RGBA32F, SUN_SIDE,
                     SUN_SIDE, 1, 1, "reflecting positions"));
    TRY(texture_init(memory, &maps->normal, FOR_TRANSPORT, GL_TEXTURE_2D, GL_RGBA16F, SUN_SIDE,
                     SUN_SIDE, 1, 1, "reflecting normals"));
    TRY(texture_init(memory, &maps->diffuse, FOR_TRANSPORT, GL_TEXTURE_2D, GL_RGBA16F, SUN_SIDE,
                     SUN_SIDE, 1, 1, "reflectances"));
    TRY(texture_init(memory, &maps->depth, FOR_TRANSPORT, GL_TEXTURE_2D, GL_DEPTH_COMPONENT32F,
                     SUN_SIDE, SUN_SIDE, 1, 1, "reflecting depths"));
    static const GLenum targets[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1,
                                     GL_COLOR_ATTACHMENT2};
    const struct texture *colors[] = {&maps->position, &maps->normal, &maps->diffuse};
    glCreateVertexArrays(1, &maps->vertex_array);
    glCreateFramebuffers(1, &maps->framebuffer);
    glCreateFramebuffers(1, &maps->target);
    for (int i = 0; i < 3; ++i) {
        glNamedFramebufferTexture(maps->framebuffer, targets[i], colors[i]->id, 0);
        glNamedFramebufferTexture(maps->target, targets[i], work->reflected[i].id, 0);
        glBindTextureUnit((GLuint)(SLOT_RSM + i), colors[i]->id);
    }
    glBindTextureUnit(SLOT_LINKS, work->links.id);
    glNamedFramebufferTexture(maps->framebuffer, GL_DEPTH_ATTACHMENT, maps->depth.id, 0);
    glNamedFramebufferDrawBuffers(maps->framebuffer, 3, targets);
    glNamedFramebufferDrawBuffers(maps->target, 3, targets);
    return BRUME_OK;
}

static void finish_maps(struct memory *memory, struct maps *maps)
{
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glDeleteFramebuffers(1, &maps->framebuffer);
    glDeleteFramebuffers(1, &maps->target);
    glDeleteVertexArrays(1, &maps->vertex_array);
    texture_finish(memory, &maps->position);
    texture_finish(memory, &maps->normal);
    texture_finish(memory, &maps->diffuse);
    texture_finish(memory, &maps->depth);
    buffer_finish(memory, &maps->block);
}

/* Draws what is seen, and tells the shaders that strew it. */
static brume_result draw_map(struct lpv_work *work, struct maps *maps,
                             const struct gpu_shadow_view *view, ivec4 what, float scale)
{
    static const float nothing[4], far_;
    const struct transport_input *input = work->input;
    const int side = what.w;
    TRY(opv_go_on(&work->passes, 0.0f));
    glBindFramebuffer(GL_FRAMEBUFFER, maps->framebuffer);
    glViewport(0, 0, side, side);
    glClearNamedFramebufferfv(maps->framebuffer, GL_COLOR, 0, nothing);
    glClearNamedFramebufferfv(maps->framebuffer, GL_DEPTH, 0, &far_);
    const struct gpu_draw stage = {.clip_from_world = view->clip_from_world};
    TRY(geometry_draw(input->gpu, input->geometry, &stage, BRUME_VISIBLE_SHADOW, GEOMETRY_REFLECT));

    const struct gpu_reflection reflection = {.clip_from_world = view->clip_from_world,
                                              .scale = {view->range.w, scale, 0, 0},
                                              .what = what,
                                              .tiles = {work->tiles, work->fuzzy.dims.w, 0, 0}};
    TRY(buffer_update(&input->gpu->memory, &maps->block, FOR_TRANSPORT, sizeof reflection,
                      &reflection, "reflection"));
    glBindBufferBase(GL_UNIFORM_BUFFER, SLOT_STAGE, maps->block.id);
    glBindVertexArray(maps->vertex_array);
    return BRUME_OK;
}

int lpv_tile_rows(const ivec4 *dims, int in_a_row)
{
    return (dims->z + in_a_row - 1) / in_a_row;
}

brume_result lpv_strew(struct lpv_work *work, const char *stem, GLuint target, const ivec4 *dims,
                       int in_a_row, int texels)
{
    const struct program *program;
    TRY(program_draw(&work->input->gpu->programs, stem, &program));
    glBindFramebuffer(GL_FRAMEBUFFER, target);
    glViewport(0, 0, in_a_row * dims->x, lpv_tile_rows(dims, in_a_row) * dims->y);
    glUseProgram(program->id);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE);
    glDrawArrays(GL_POINTS, 0, texels);
    glDisable(GL_BLEND);
    return BRUME_OK;
}

/* Draws what the light sees, and strews it. */
static brume_result one_map(struct lpv_work *work, struct maps *maps,
                            const struct gpu_shadow_view *view, ivec4 what, float scale)
{
    const int texels = what.w * what.w;
    laps_go(work->laps, BRUME_FIELD_REFLECTED);
    TRY(draw_map(work, maps, view, what, scale));
    TRY(lpv_strew(work, "lpv_reflect", maps->target, &work->field->dims, work->tiles, texels));
    if (!lpv_is_fuzzy(work))
        return BRUME_OK;
    laps_go(work->laps, BRUME_FIELD_BLOCKERS);
    return lpv_fuzzy_add(work, texels);
}

/* Of one sample of a light all has been drawn. */
static brume_result end_sample(struct lpv_work *work)
{
    return lpv_is_fuzzy(work) ? lpv_fuzzy_keep(work) : BRUME_OK;
}

/* The surfaces as seen from outside, for fuzzy blockers alone. What the camera sees, which could be
 * added, is left out: the field would depend on the view, flicker as the camera moves, and have to
 * be propagated anew for each move. */
static brume_result see_from_outside(struct lpv_work *work, struct maps *maps)
{
    for (int i = 0; i < 6; ++i) {
        struct gpu_shadow_view view;
        laps_go(work->laps, BRUME_FIELD_BLOCKERS);
        const int side = lpv_fuzzy_view(work, i % 3, i >= 3, SUN_SIDE, &view);
        TRY(draw_map(work, maps, &view, (ivec4){-1, 0, 0, side}, 0.0f));
        TRY(lpv_fuzzy_add(work, side * side));
        TRY(lpv_fuzzy_keep(work));
    }
    return BRUME_OK;
}

void lpv_field_box(const struct gpu_field *field, float lower[3], float upper[3])
{
    const int *dims = &field->dims.x;
    for (int i = 0; i < 3; ++i) {
        lower[i] = (&field->lower.x)[i];
        upper[i] = lower[i] + (float)dims[i] * field->lower.w;
    }
}

/* From infinitely far, on the lattice alone. */
static brume_result distant(struct lpv_work *work, struct maps *maps, const vec4 *towards,
                            ivec4 what, float scale)
{
    const struct transport_input *input = work->input;
    float lower[3], upper[3];
    struct gpu_shadow_view view;
    lpv_field_box(work->field, lower, upper);
    light_view_distant(input->geometry->lower, input->geometry->upper, lower, upper, towards,
                       what.w, &view);
    TRY(one_map(work, maps, &view, what, scale));
    return end_sample(work);
}

static brume_result lamp(struct lpv_work *work, struct maps *maps, int number, int sample,
                         float scale)
{
    const struct transport_input *input = work->input;
    const struct gpu_light *light = &input->lights[number];
    const vec4 position = input->samples[sample].position;
    const float eye[3] = {position.x, position.y, position.z};
    const float near_ = light_view_near(input->geometry->lower, input->geometry->upper);
    const float cosine = light->tangent.w;
    const float tangent =
        light->samples.z == 1 ? sqrtf(fmaxf(1.0f - cosine * cosine, 0.0f)) / cosine : 1.0f;
    for (uint32_t face = 0; face < light->samples.z; ++face) {
        struct gpu_shadow_view view;
        light_view_face(light, eye, face, tangent, FACE_SIDE, near_, &view);
        TRY(one_map(work, maps, &view, (ivec4){number, sample, (int)face, FACE_SIDE}, scale));
    }
    return end_sample(work);
}

/* Of several samples of a light some are taken, evenly; of a sun no more than rims of shadows are
 * cells wide where it has come all through the lattice. */
static uint32_t taken(const struct lpv_work *work, const struct gpu_light *light)
{
    uint32_t most = LAMP_SAMPLES;
    if (light->info.x == LIGHT_SUN) {
        const ivec4 dims = work->field->dims;
        const double cells = sqrt((double)dims.x * dims.x + (double)dims.y * dims.y +
                                  (double)dims.z * dims.z);
        const double wide = ceil(2.0 * (double)light->axis.w * cells);
        most = wide < LAMP_SAMPLES ? (uint32_t)fmax(wide, 1.0) : LAMP_SAMPLES;
    }
    return light->samples.y < most ? light->samples.y : most;
}

static brume_result all_maps(struct lpv_work *work, struct maps *maps)
{
    const struct transport_input *input = work->input;
    for (uint32_t i = 0; i < input->light_count; ++i) {
        const struct gpu_light *light = &input->lights[i];
        if (light->radiance.x + light->radiance.y + light->radiance.z <= 0.0f)
            continue;
        const uint32_t count = taken(work, light);
        for (uint32_t s = 0; s < count; ++s) {
            const int sample = (int)(light->samples.x + s * light->samples.y / count);
            const float scale = 1.0f / (float)count;
            if (light->info.x == LIGHT_SUN)
                TRY(distant(work, maps, &input->samples[sample].position,
                            (ivec4){(int)i, sample, 0, SUN_SIDE}, scale));
            else
                TRY(lamp(work, maps, (int)i, sample, scale));
        }
    }
    const uint32_t count = input->world_count < WORLD_MAPS ? input->world_count : WORLD_MAPS;
    for (uint32_t s = 0; s < count; ++s) {
        const int sample = (int)(input->world_first + s * input->world_count / count);
        TRY(distant(work, maps, &input->samples[sample].position,
                    (ivec4){-1, sample, 0, WORLD_SIDE}, (float)input->world_count / (float)count));
    }
    return BRUME_OK;
}

brume_result lpv_reflect(struct lpv_work *work)
{
    const struct geometry *geometry = work->input->geometry;
    for (int i = 0; i < 3; ++i)
        texture_clear(&work->reflected[i]);
    if (!(geometry->lower[0] <= geometry->upper[0]))
        return BRUME_OK;
    struct maps maps = {0};
    brume_result result = make_maps(work, &maps);
    if (result == BRUME_OK)
        result = all_maps(work, &maps);
    if (result == BRUME_OK && lpv_is_fuzzy(work))
        result = see_from_outside(work, &maps);
    finish_maps(&work->input->gpu->memory, &maps);
    return result;
}
