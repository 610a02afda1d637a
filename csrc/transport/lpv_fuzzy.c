/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Fuzzy blockers, as in "Light Propagation Volumes with scattering", eq. 2, after Kaplanyan and
 * Dachsbacher, "Cascaded Light Propagation Volumes for Real-time Indirect Illumination", I3D 2010,
 * sec. 3.3: texels of reflective shadow maps are small surfaces, which add up in a lattice.
 *
 * Maps see the same surface several times. Within a set of maps, those of one sample of a light or
 * one view from outside, no surface is seen twice, and areas add up; of all sets the greatest sum
 * counts, for the six sides of a cell apart. Sums over all sets would block as often as there are
 * lights, and without sides apart, the front of a thin wall would hide its back. */
#include "base/result.h"
#include "gl/timer.h"
#include "transport/lpv.h"

#include <math.h>

bool lpv_is_fuzzy(const struct lpv_work *work)
{
    const brume_settings *settings = work->input->settings;
    return settings->method == BRUME_METHOD_LPV && settings->blockers == BRUME_BLOCKERS_FUZZY;
}

brume_result lpv_fuzzy_begin(struct lpv_work *work)
{
    static const GLenum targets[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
    struct memory *memory = &work->input->gpu->memory;
    struct lpv_fuzzy *fuzzy = &work->fuzzy;
    const ivec4 field = work->field->dims;
    const ivec4 dims = {field.x + 1, field.y + 1, field.z + 1,
                        (int)ceil(sqrt((double)field.z + 1.0))};
    const int rows = lpv_tile_rows(&dims, dims.w);
    fuzzy->dims = dims;
    for (int i = 0; i < 2; ++i) {
        TRY(texture_init(memory, &fuzzy->sums[i], FOR_TRANSPORT, GL_TEXTURE_2D, GL_RGBA32F,
                         texture_side(dims.w * dims.x), texture_side(rows * dims.y), 1, 1,
                         "blocking areas of maps"));
        texture_clear(&fuzzy->sums[i]);
        TRY(texture_init(memory, &fuzzy->areas[i], FOR_TRANSPORT, GL_TEXTURE_3D, GL_RGBA16F,
                         texture_side(dims.x), texture_side(dims.y), texture_side(dims.z), 1,
                         "blocking areas"));
    }
    TRY(texture_init(memory, &fuzzy->factors, FOR_TRANSPORT, GL_TEXTURE_3D, GL_RGBA32UI,
                     texture_side(2 * field.x), texture_side(field.y), texture_side(field.z), 1,
                     "blocking factors"));
    glCreateFramebuffers(1, &fuzzy->target);
    for (int i = 0; i < 2; ++i)
        glNamedFramebufferTexture(fuzzy->target, targets[i], fuzzy->sums[i].id, 0);
    glNamedFramebufferDrawBuffers(fuzzy->target, 2, targets);
    /* Cells' reflectances have been taken from what cut links; nothing is parted by them. */
    texture_clear(&work->links);
    return BRUME_OK;
}

void lpv_fuzzy_finish(struct lpv_work *work)
{
    struct memory *memory = &work->input->gpu->memory;
    for (int i = 0; i < 2; ++i) {
        texture_finish(memory, &work->fuzzy.sums[i]);
        texture_finish(memory, &work->fuzzy.areas[i]);
    }
    texture_finish(memory, &work->fuzzy.factors);
    glDeleteFramebuffers(1, &work->fuzzy.target);
}

brume_result lpv_fuzzy_add(struct lpv_work *work, int texels)
{
    const struct lpv_fuzzy *fuzzy = &work->fuzzy;
    return lpv_strew(work, "lpv_fuzzy", fuzzy->target, &fuzzy->dims, fuzzy->dims.w, texels);
}

static brume_result over_lattice(struct lpv_work *work, const char *stem, const ivec4 *dims)
{
    TRY(lpv_over_lattice(work, stem, (ivec4){work->fuzzy.dims.w, 0, 0, 0}, dims));
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
    return BRUME_OK;
}

brume_result lpv_fuzzy_keep(struct lpv_work *work)
{
    struct lpv_fuzzy *fuzzy = &work->fuzzy;
    laps_go(work->laps, BRUME_FIELD_AGGREGATE);
    for (GLuint i = 0; i < 2; ++i) {
        glBindTextureUnit(SLOT_AREAS + i, fuzzy->sums[i].id);
        glBindImageTexture(SLOT_OUTPUT + i, fuzzy->areas[i].id, 0, GL_TRUE, 0, GL_READ_WRITE,
                           GL_RGBA16F);
    }
    TRY(over_lattice(work, "lpv_fuzzy_keep", &fuzzy->dims));
    for (int i = 0; i < 2; ++i)
        texture_clear(&fuzzy->sums[i]);
    return BRUME_OK;
}

int lpv_fuzzy_view(const struct lpv_work *work, int axis, bool from_end, int most,
                   struct gpu_shadow_view *out)
{
    const struct gpu_field *field = work->field;
    const int *dims = &work->fuzzy.dims.x;
    const float cell = field->lower.w;
    int longest = dims[0];
    for (int i = 1; i < 3; ++i)
        longest = dims[i] > longest ? dims[i] : longest;
    /* Whole texels a cell, or cells would get more and less by turns. A lattice with more cells
     * than that blocks in part. */
    const int side = longest < most ? most / longest * longest : most;
    float lower[3];
    for (int i = 0; i < 3; ++i)
        lower[i] = (&field->lower.x)[i] - 0.5f * cell;
    mat4 view = {{0}};
    for (int row = 0; row < 2; ++row) {
        const int other = (axis + 1 + row) % 3;
        const float scale = 2.0f / ((float)longest * cell);
        view.m[4 * other + row] = scale;
        view.m[12 + row] = -1.0f - scale * lower[other];
    }
    const float depth = 1.0f / ((float)dims[axis] * cell); /* reversed: 1 is near */
    view.m[4 * axis + 2] = from_end ? depth : -depth;
    view.m[12 + 2] = from_end ? -depth * lower[axis] : 1.0f + depth * lower[axis];
    view.m[15] = 1.0f;
    *out = (struct gpu_shadow_view){.clip_from_world = view,
                                    .range = {.x = 1.0f, .w = (float)longest * cell / (float)side}};
    return side;
}

brume_result lpv_fuzzy_prepare(struct lpv_work *work)
{
    for (GLuint i = 0; i < 2; ++i)
        glBindTextureUnit(SLOT_AREAS + i, work->fuzzy.areas[i].id);
    glBindImageTexture(SLOT_OUTPUT, work->fuzzy.factors.id, 0, GL_TRUE, 0, GL_WRITE_ONLY,
                       GL_RGBA32UI);
    return over_lattice(work, "lpv_fuzzy_prepare", &work->field->dims);
}
