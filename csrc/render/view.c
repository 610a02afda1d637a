/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The view's stages. */
#include "render/view.h"
#include "base/result.h"
#include "math/frame.h"
#include "render/filter.h"
#include "render/lens.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Of a pool, so that the views of a quad view need not make theirs again each time. */
#define IDLE_MAX 4

static int is_orthographic(const brume_view *view)
{
    return view->clip_from_view[15] != 0.0f;
}

static vec4 rotate(const float world_from_view[16], float x, float y, float z)
{
    const float v[3] = {x, y, z};
    float out[3];
    mat4_vector(world_from_view, v, out);
    return (vec4){out[0], out[1], out[2], 0.0f};
}

static vec4 offset_by(vec4 base, vec4 x, float by_x, vec4 y, float by_y)
{
    return (vec4){base.x + by_x * x.x + by_y * y.x, base.y + by_x * x.y + by_y * y.y,
                  base.z + by_x * x.z + by_y * y.z, 0.0f};
}

/* The sample's offset in normalised device coordinates. */
static void sample_offset(const brume_view *view, uint32_t sample, float ndc[2])
{
    filter_offset(sample, view->samples, view->filter_width, ndc);
    ndc[0] *= 2.0f / (float)view->width;
    ndc[1] *= 2.0f / (float)view->height;
}

/* World to view of a sample: from its place in the lens, and sheared so that what is in focus stays
 * where it is. */
static void sample_view(const brume_view *view, uint32_t sample, float view_from_world[16])
{
    const brume_lens *lens = &view->lens;
    if (lens->radius <= 0.0f) {
        memcpy(view_from_world, view->view_from_world, 16 * sizeof *view_from_world);
        return;
    }
    float aside[2], shear[16];
    lens_offset(lens, sample, view->samples, aside);
    mat4_identity(shear);
    for (int i = 0; i < 2; ++i) {
        shear[8 + i] = -aside[i] / lens->focus;
        shear[12 + i] = -aside[i];
    }
    mat4_multiply(shear, view->view_from_world, view_from_world);
}

/* Where the eye is, or with w 0 the way that a parallel view looks. */
static vec4 eye_of(const brume_view *view, const float view_from_world[16])
{
    float world_from_view[16];
    mat4_invert(view_from_world, world_from_view);
    return is_orthographic(view)
               ? rotate(world_from_view, 0.0f, 0.0f, -1.0f)
               : (vec4){world_from_view[12], world_from_view[13], world_from_view[14], 1.0f};
}

void view_frame(const brume_view *view, uint32_t sample, struct gpu_frame *frame)
{
    const float *p = view->clip_from_view;
    float view_from_world[16], world_from_view[16], ndc[2];
    sample_view(view, sample, view_from_world);
    mat4_invert(view_from_world, world_from_view); /* checked when the job was made */
    frame->eye = eye_of(view, view->view_from_world);
    sample_offset(view, sample, ndc);
    const float dx = 1.0f / p[0], dy = 1.0f / p[5];
    const vec4 eye = {world_from_view[12], world_from_view[13], world_from_view[14], 0.0f};
    if (is_orthographic(view)) {
        frame->ray_origin_x = rotate(world_from_view, dx, 0.0f, 0.0f);
        frame->ray_origin_y = rotate(world_from_view, 0.0f, dy, 0.0f);
        frame->ray_origin = offset_by(eye, frame->ray_origin_x, ndc[0] - p[12], frame->ray_origin_y,
                                      ndc[1] - p[13]);
        frame->ray_direction = rotate(world_from_view, 0.0f, 0.0f, -1.0f);
        frame->ray_direction_x = frame->ray_direction_y = (vec4){0};
    } else {
        frame->ray_direction_x = rotate(world_from_view, dx, 0.0f, 0.0f);
        frame->ray_direction_y = rotate(world_from_view, 0.0f, dy, 0.0f);
        frame->ray_direction =
            offset_by(rotate(world_from_view, 0.0f, 0.0f, -1.0f), frame->ray_direction_x,
                      ndc[0] + p[8], frame->ray_direction_y, ndc[1] + p[9]);
        frame->ray_origin = eye;
        frame->ray_origin_x = frame->ray_origin_y = (vec4){0};
    }
    frame->size = (ivec4){view->width, view->height, (int)sample, (int)view->seed};
    frame->clip = (vec4){view->clip_near, view->clip_far, view->film_transparent ? 1.0f : 0.0f,
                         (float)view->samples};
    int slot = 0;
    for (int pass = 0; pass < PASS_COUNT; ++pass) {
        int *slots = &frame->pass_slots[pass / 4].x;
        slots[pass % 4] = view->passes & (1u << pass) ? slot++ : -1;
    }
}

static struct gpu_draw camera_draw(const brume_view *view, uint32_t sample)
{
    float view_from_world[16], projection[16], ndc[2];
    const float near_ = view->clip_near, far_ = view->clip_far;
    const int orthographic = is_orthographic(view);
    sample_view(view, sample, view_from_world);
    sample_offset(view, sample, ndc);
    memcpy(projection, view->clip_from_view, sizeof projection);
    /* Reversed depth instead of the caller's: near / distance, or even from 1 to 0. */
    projection[2] = projection[6] = projection[10] = projection[14] = 0.0f;
    if (orthographic) {
        projection[10] = 1.0f / (far_ - near_);
        projection[14] = far_ / (far_ - near_);
    } else {
        projection[14] = near_;
    }
    for (int column = 0; column < 4; ++column) {
        projection[4 * column] -= ndc[0] * projection[4 * column + 3];
        projection[4 * column + 1] -= ndc[1] * projection[4 * column + 3];
    }
    struct gpu_draw draw = {.clip = {near_, far_, orthographic ? 1.0f : 0.0f, 0.0f},
                            .info = {view->seed + sample, 0, 0, 0}};
    mat4_multiply(projection, view_from_world, draw.clip_from_world.m);
    draw.eye = eye_of(view, view_from_world);
    return draw;
}

static uint32_t pass_count(const brume_view *view)
{
    return (uint32_t)__builtin_popcount(view->passes & ((1u << PASS_COUNT) - 1u));
}

static uint64_t accumulation_bytes(const brume_view *view)
{
    return (uint64_t)view->width * (uint64_t)view->height *
           (VIEW_PASS_PIXEL_BYTES * (uint64_t)pass_count(view));
}

/* The sides of the texture of half_march, in blocks. */
static int half_side(int32_t pixels)
{
    return texture_side((pixels + 1) / 2);
}

static uint64_t half_bytes(const brume_view *view)
{
    return view->half_march ? (uint64_t)half_side(view->width) * (uint64_t)half_side(view->height) *
                                  VIEW_HALF_BLOCK_BYTES
                            : 0;
}

static uint64_t rest_bytes(const brume_view *view)
{
    return view->half_march ? VIEW_REST_BYTES + (uint64_t)view->width * (uint64_t)view->height *
                                                    VIEW_REST_PIXEL_BYTES
                            : 0;
}

uint64_t view_bytes(const brume_view *view)
{
    return (uint64_t)texture_side(view->width) * (uint64_t)texture_side(view->height) *
               VIEW_PIXEL_BYTES +
           half_bytes(view) + rest_bytes(view) + accumulation_bytes(view);
}

static uint64_t held_bytes(const struct view_targets *targets)
{
    return targets->normal.bytes + targets->diffuse.bytes + targets->specular.bytes +
           targets->emission.bytes + targets->tint.bytes + targets->depth.bytes +
           targets->surface.bytes + targets->half.bytes + targets->rest.bytes +
           targets->accumulation.bytes;
}

uint64_t view_pool_bytes(const struct view_targets *pool, bool busy)
{
    uint64_t bytes = 0;
    for (; pool; pool = pool->next)
        if (pool->busy == busy)
            bytes += held_bytes(pool);
    return bytes;
}

static void destroy(struct gpu *gpu, struct view_targets *targets)
{
    struct memory *memory = &gpu->memory;
    texture_finish(memory, &targets->normal);
    texture_finish(memory, &targets->diffuse);
    texture_finish(memory, &targets->specular);
    texture_finish(memory, &targets->emission);
    texture_finish(memory, &targets->tint);
    texture_finish(memory, &targets->depth);
    texture_finish(memory, &targets->surface);
    texture_finish(memory, &targets->half);
    buffer_finish(memory, &targets->rest);
    buffer_finish(memory, &targets->accumulation);
    glDeleteFramebuffers(1, &targets->framebuffer);
    glDeleteFramebuffers(1, &targets->tint_framebuffer);
    free(targets);
}

static brume_result create(struct gpu *gpu, struct view_targets *targets, const brume_view *view)
{
    struct {
        struct texture *texture;
        GLenum format, attachment;
        const char *label;
    } const list[] = {
        {&targets->normal, GL_RGBA32F, GL_COLOR_ATTACHMENT0, "normal and depth"},
        {&targets->diffuse, GL_RGBA16F, GL_COLOR_ATTACHMENT1, "diffuse reflectance"},
        {&targets->specular, GL_RGBA16F, GL_COLOR_ATTACHMENT2, "specular reflectance"},
        {&targets->emission, GL_RGBA16F, GL_COLOR_ATTACHMENT3, "emission"},
        {&targets->tint, GL_RGBA16F, GL_NONE, "tint of what is seen through"},
        {&targets->depth, GL_DEPTH_COMPONENT32F, GL_DEPTH_ATTACHMENT, "depth"},
        {&targets->surface, GL_RGBA32F, GL_NONE, "surface radiance"},
    };
    glCreateFramebuffers(1, &targets->framebuffer);
    glCreateFramebuffers(1, &targets->tint_framebuffer);
    for (size_t i = 0; i < sizeof list / sizeof *list; ++i) {
        TRY(texture_init(&gpu->memory, list[i].texture, FOR_TARGET, GL_TEXTURE_2D, list[i].format,
                         texture_side(view->width), texture_side(view->height), 1, 1,
                         list[i].label));
        if (list[i].attachment != GL_NONE)
            glNamedFramebufferTexture(targets->framebuffer, list[i].attachment, list[i].texture->id,
                                      0);
    }
    static const GLenum buffers[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1,
                                     GL_COLOR_ATTACHMENT2, GL_COLOR_ATTACHMENT3};
    glNamedFramebufferDrawBuffers(targets->framebuffer, 4, buffers);
    glNamedFramebufferTexture(targets->tint_framebuffer, GL_COLOR_ATTACHMENT0, targets->tint.id, 0);
    glNamedFramebufferTexture(targets->tint_framebuffer, GL_DEPTH_ATTACHMENT, targets->depth.id, 0);
    if (glCheckNamedFramebufferStatus(targets->framebuffer, GL_FRAMEBUFFER) !=
        GL_FRAMEBUFFER_COMPLETE)
        return fail(BRUME_E_GPU, "the driver refuses a %d x %d framebuffer", view->width,
                    view->height);
    if (view->half_march) {
        TRY(texture_init(&gpu->memory, &targets->half, FOR_TARGET, GL_TEXTURE_2D_ARRAY, GL_RGBA32F,
                         half_side(view->width), half_side(view->height), HALF_LAYERS, 1,
                         "media at half the resolution"));
        TRY(buffer_init(&gpu->memory, &targets->rest, FOR_TARGET, rest_bytes(view), NULL,
                        "pixels to march"));
    }
    return buffer_init(&gpu->memory, &targets->accumulation, FOR_TARGET, accumulation_bytes(view),
                       NULL, "accumulation");
}

static bool fits(const struct view_targets *targets, const brume_view *view)
{
    return targets->normal.width == texture_side(view->width) &&
           targets->normal.height == texture_side(view->height) &&
           targets->half.bytes == half_bytes(view) && targets->rest.bytes == rest_bytes(view) &&
           targets->accumulation.bytes == accumulation_bytes(view);
}

brume_result view_take(struct gpu *gpu, struct view_targets **pool, const brume_view *view,
                       struct view_targets **out)
{
    struct view_targets *targets = *pool;
    while (targets && (targets->busy || !fits(targets, view)))
        targets = targets->next;
    if (!targets) {
        view_pool_trim(gpu, pool);
        targets = calloc(1, sizeof *targets);
        if (!targets)
            return fail(BRUME_E_MEMORY, "no memory for a view's targets");
        const brume_result result = create(gpu, targets, view);
        if (result != BRUME_OK) {
            destroy(gpu, targets);
            return result;
        }
        targets->next = *pool;
        *pool = targets;
    }
    targets->busy = true;
    glClearNamedBufferData(targets->accumulation.id, GL_R32F, GL_RED, GL_FLOAT, NULL);
    *out = targets;
    return BRUME_OK;
}

/* Frees the idle ones but the first `kept`. */
static void trim(struct gpu *gpu, struct view_targets **pool, int kept)
{
    while (*pool) {
        struct view_targets *targets = *pool;
        if (targets->busy || kept-- > 0) {
            pool = &targets->next;
        } else {
            *pool = targets->next;
            destroy(gpu, targets);
        }
    }
}

void view_give_back(struct gpu *gpu, struct view_targets **pool, struct view_targets *targets)
{
    if (targets)
        targets->busy = false;
    trim(gpu, pool, IDLE_MAX);
}

void view_pool_trim(struct gpu *gpu, struct view_targets **pool)
{
    trim(gpu, pool, 0);
}

brume_result view_gbuffer(struct gpu *gpu, struct view_targets *targets, struct geometry *geometry,
                          const brume_view *view, uint32_t sample)
{
    static const float zero[4], white[4] = {1.0f, 1.0f, 1.0f, 1.0f};
    static const float nothing[4] = {0.0f, 0.0f, 0.0f, NO_DEPTH};
    glBindFramebuffer(GL_FRAMEBUFFER, targets->framebuffer);
    glViewport(0, 0, view->width, view->height);
    for (int i = 0; i < 4; ++i)
        glClearNamedFramebufferfv(targets->framebuffer, GL_COLOR, i, i ? zero : nothing);
    glClearNamedFramebufferfv(targets->framebuffer, GL_DEPTH, 0, zero);
    const struct gpu_draw stage = camera_draw(view, sample);
    TRY(geometry_draw(gpu, geometry, &stage, BRUME_VISIBLE_CAMERA, GEOMETRY_GBUFFER));
    glBindFramebuffer(GL_FRAMEBUFFER, targets->tint_framebuffer);
    glClearNamedFramebufferfv(targets->tint_framebuffer, GL_COLOR, 0, white);
    TRY(geometry_draw(gpu, geometry, &stage, BRUME_VISIBLE_CAMERA, GEOMETRY_TINT));
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    return BRUME_OK;
}

void view_bind(const struct view_targets *targets)
{
    glBindTextureUnit(SLOT_GBUFFER_NORMAL, targets->normal.id);
    glBindTextureUnit(SLOT_GBUFFER_DIFFUSE, targets->diffuse.id);
    glBindTextureUnit(SLOT_GBUFFER_SPECULAR, targets->specular.id);
    glBindTextureUnit(SLOT_GBUFFER_EMISSION, targets->emission.id);
    glBindTextureUnit(SLOT_GBUFFER_TINT, targets->tint.id);
    glBindTextureUnit(SLOT_SURFACE, targets->surface.id);
    glBindImageTexture(SLOT_OUTPUT, targets->surface.id, 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA32F);
    if (targets->half.id) {
        glBindTextureUnit(SLOT_HALF, targets->half.id);
        glBindImageTexture(SLOT_OUTPUT_HALF, targets->half.id, 0, GL_TRUE, 0, GL_WRITE_ONLY,
                           GL_RGBA32F);
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, SLOT_REST, targets->rest.id);
    }
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, SLOT_ACCUMULATION, targets->accumulation.id);
}

brume_result view_shade(struct gpu *gpu, const brume_view *view, int first, int end)
{
    const struct program *program;
    TRY(program_compute(&gpu->programs, "shade", &program));
    program_dispatch(program, view->width, end - first, 1);
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    return BRUME_OK;
}

static brume_result march_program(struct gpu *gpu, const char *stem, enum view_march_kind kind,
                                  const struct program **program)
{
    static const char *const variants[] = {"", ":DOM", ":DOM_LAMPS"};
    char name[32];
    snprintf(name, sizeof name, "%s%s", stem, variants[kind]);
    return program_compute(&gpu->programs, name, program);
}

/* The rays of blocks, the pixels between them, and those that no block stands for. */
static brume_result march_half(struct gpu *gpu, const struct view_targets *targets,
                               const brume_view *view, enum view_march_kind kind, int first,
                               int end)
{
    static const GLuint none[4] = {0, 1, 1, 0}; /* groups, and pixels */
    const int rows = HALF_ROWS(end, view->height) - HALF_ROWS(first, view->height);
    const struct program *blocks, *upsample, *rest;
    TRY(march_program(gpu, "march_half", kind, &blocks));
    TRY(program_compute(&gpu->programs, "march_upsample", &upsample));
    TRY(march_program(gpu, "march_rest", kind, &rest));
    if (rows > 0)
        program_dispatch(blocks, (view->width + 1) / 2, rows, 1);
    glNamedBufferSubData(targets->rest.id, 0, sizeof none, none);
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    program_dispatch(upsample, view->width, end - first, 1);
    glMemoryBarrier(GL_COMMAND_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
    program_dispatch_indirect(rest, targets->rest.id);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
    return BRUME_OK;
}

brume_result view_march(struct gpu *gpu, const struct view_targets *targets, const brume_view *view,
                        enum view_march_kind kind, int first, int end)
{
    if (view->half_march)
        return march_half(gpu, targets, view, kind, first, end);
    const struct program *program;
    TRY(march_program(gpu, "march", kind, &program));
    program_dispatch(program, view->width, end - first, 1);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    return BRUME_OK;
}

brume_result picture_init(struct picture *picture, const brume_view *view)
{
    memset(picture, 0, sizeof *picture);
    for (uint32_t pass = 0; pass < BRUME_PASS_COUNT; ++pass) {
        if (!(view->passes & (1u << pass)))
            continue;
        picture->pixels[pass] = malloc((size_t)view->width * (size_t)view->height *
                                       brume_pass_channels(pass) * sizeof(float));
        if (!picture->pixels[pass]) {
            picture_finish(picture);
            return fail(BRUME_E_MEMORY, "no memory for a picture of %d x %d", view->width,
                        view->height);
        }
    }
    return BRUME_OK;
}

void picture_finish(struct picture *picture)
{
    for (int pass = 0; pass < BRUME_PASS_COUNT; ++pass)
        free(picture->pixels[pass]);
    memset(picture, 0, sizeof *picture);
}

brume_result view_read(struct view_targets *targets, const brume_view *view, uint32_t pass,
                       uint32_t samples, float *pixels)
{
    const size_t count = (size_t)view->width * (size_t)view->height;
    const uint32_t slot = (uint32_t)__builtin_popcount(view->passes & ((1u << pass) - 1u));
    const uint32_t channels = brume_pass_channels(pass);
    float *sums = malloc(count * 4 * sizeof *sums);
    if (!sums)
        return fail(BRUME_E_MEMORY, "no memory to read %zu pixels", count);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    glGetNamedBufferSubData(targets->accumulation.id,
                            (GLintptr)(slot * count * VIEW_PASS_PIXEL_BYTES),
                            (GLsizeiptr)(count * VIEW_PASS_PIXEL_BYTES), sums);
    const float scale = pass == PASS_DEPTH ? 1.0f : 1.0f / (float)samples;
    for (size_t i = 0; i < count; ++i)
        for (uint32_t c = 0; c < channels; ++c)
            pixels[i * channels + c] = sums[4 * i + c] * scale;
    free(sums);
    return BRUME_OK;
}
