/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Blockers from geometry: drawn along each of the 13 links, so that a pixel's centre is a line
 * through cells' centres and a fragment a cut of one link. Exact, however thin a wall is. Drawn once
 * more, what is nearest to the cells at a link's ends tells them what it reflects and emits: not the
 * ground below a floor's tiles, nor the other side of a wall. */
#include "base/result.h"
#include "transport/lpv.h"

#include <string.h>

#define LINKS 13

/* As LINKS of shaders/lib/links.glsl. */
static const int links[LINKS][3] = {{1, 0, 0},  {0, 1, 0},  {0, 0, 1},  {1, 1, 0},  {1, -1, 0},
                                    {1, 0, 1},  {1, 0, -1}, {0, 1, 1},  {0, 1, -1}, {1, 1, 1},
                                    {1, 1, -1}, {1, -1, 1}, {1, -1, -1}};

/* The view along a link: an affine map, sheared. `size`: its pixels, so many to a cell's side. */
static mat4 view_along(const struct gpu_field *field, const int link[3], int lines, int size[2])
{
    static const double aside[3] = {(double)ASIDE_X, (double)ASIDE_Y, (double)ASIDE_Z};
    const float *lower = &field->lower.x;
    const int *dims = &field->dims.x;
    const double per_m = 1.0 / (double)field->lower.w;
    const int axis = link[0] ? 0 : (link[1] ? 1 : 2);
    mat4 view = {{0}};
    double origin[3]; /* in cells, where the world's origin is */
    for (int i = 0; i < 3; ++i)
        origin[i] = -(double)lower[i] * per_m - 0.5 + aside[i];
    for (int row = 0; row < 2; ++row) {
        const int other = (axis + 1 + row) % 3;
        /* pixel = q[other] - link[other] q[axis], moved to begin with 1: lines stand around links */
        const int before = 1 + (link[other] > 0 ? dims[axis] : 0);
        const int cells = 2 + dims[other] + (link[other] ? dims[axis] : 0);
        size[row] = lines * cells;
        const double scale = 2.0 / (double)cells;
        view.m[4 * other + row] = (float)(scale * per_m);
        view.m[4 * axis + row] = (float)(-scale * per_m * (double)link[other]);
        view.m[12 + row] = (float)(scale * (origin[other] - (double)link[other] * origin[axis] +
                                            (double)before + 0.5) -
                                   1.0);
    }
    const double depth = 1.0 / (double)(dims[axis] + 1);
    view.m[4 * axis + 2] = (float)(depth * per_m);
    view.m[12 + 2] = (float)(depth * (origin[axis] + 1.0));
    view.m[15] = 1.0f;
    return view;
}

static brume_result draw(struct lpv_work *work, GLuint framebuffer)
{
    const struct transport_input *input = work->input;
    const float brightest = input->geometry->brightest;
    const bool lines = work->lines.id != 0;
    for (int i = 0; i < 2 * LINKS; ++i) {
        int size[2];
        const int link = i / 2;
        const struct gpu_draw stage = {
            .clip_from_world = view_along(work->field, links[link], lines ? LINES_ALONG : 1, size),
            .clip.w = brightest > 0.0f ? 1.0f / brightest : 0.0f,
            .info = {0, (uint32_t)link, (uint32_t)(i % 2), 0}};
        glNamedFramebufferParameteri(framebuffer, GL_FRAMEBUFFER_DEFAULT_WIDTH, size[0]);
        glNamedFramebufferParameteri(framebuffer, GL_FRAMEBUFFER_DEFAULT_HEIGHT, size[1]);
        glViewport(0, 0, size[0], size[1]);
        TRY(geometry_draw(input->gpu, input->geometry, &stage, BRUME_VISIBLE_SHADOW,
                          lines ? GEOMETRY_LINES : GEOMETRY_LINKS));
        glMemoryBarrier(GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
    }
    return BRUME_OK;
}

static void add_to(int slot, const struct texture *texture)
{
    glBindImageTexture((GLuint)slot, texture->id, 0, GL_TRUE, 0, GL_READ_WRITE, GL_R32UI);
}

brume_result lpv_cut_links(struct lpv_work *work)
{
    struct memory *memory = &work->input->gpu->memory;
    const ivec4 dims = work->field->dims;
    struct texture nearest = {0};
    TRY(texture_init(memory, &nearest, FOR_TRANSPORT, GL_TEXTURE_3D, GL_R32UI,
                     texture_side(2 * dims.x), texture_side(dims.y), texture_side(dims.z), 1,
                     "nearest surfaces"));
    add_to(SLOT_OUTPUT_LINKS, &work->links);
    add_to(SLOT_OUTPUT_WALLS, &work->walls);
    add_to(SLOT_OUTPUT_NEAREST, &nearest);
    if (work->lines.id)
        add_to(SLOT_OUTPUT_LINES, &work->lines);
    GLuint framebuffer;
    glCreateFramebuffers(1, &framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    const brume_result result = draw(work, framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glDeleteFramebuffers(1, &framebuffer);
    texture_finish(memory, &nearest);
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    return result;
}
