/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Iterations of DOM until its light no longer changes: sweeps, diffusion, and the mix of the last
 * few results that an iteration begins with. docs/methods/dom.md. */
#include "base/result.h"
#include "gl/timer.h"
#include "transport/dom_work.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MOST_ITERATIONS 100
/* Iterations also end when for so many no less was left to find, and it is less than so many times
 * what may be: rounding is all that is left. */
#define STALLED 4
#define NEARLY 10.0
#define STEPS 32 /* of diffusion, at most */

/* Makes room for one more in the history. */
static void begin_entry(struct dom_work *work)
{
    if (work->kept < HISTORY) {
        work->slots[work->kept] = work->kept;
        ++work->kept;
        return;
    }
    const int oldest = work->slots[0];
    memmove(work->slots, work->slots + 1, (HISTORY - 1) * sizeof *work->slots);
    work->slots[HISTORY - 1] = oldest;
}

static void bind_diffusion(const struct dom_work *work, const struct texture *missing)
{
    dom_bind_lattice(work);
    glBindTextureUnit(SLOT_CELL_DEPTHS, work->depths.id);
    glBindTextureUnit(SLOT_WALLS, work->cells.cells[2].id);
    glBindTextureUnit(SLOT_MISSING, missing->id);
    glBindTextureUnit(SLOT_MOMENTS, work->residuals[work->slots[work->kept - 1]].id);
}

/* Adds what the newest result has yet to find where light diffuses, found in as many steps as the
 * lattice is long: with Chebyshev's weights for the modes that fit into it these leave a tenth. Of
 * lattices longer than STEPS longer modes are left to the iterations: thick media take one or two
 * more of these then, but with 64 cells steps would be more than half of each. */
static brume_result diffuse(struct dom_work *work)
{
    const struct program *program;
    const int newest = work->slots[work->kept - 1];
    const int side = dom_longest_side(&work->cells.field->dims);
    const int most = side < STEPS ? side : STEPS;
    /* Eigenvalues: of the longest mode that is looked for, and of the shortest. */
    const double least = 4.0 / ((double)most * most), greatest = 2.0;
    const double middle = 0.5 * (greatest + least), half = 0.5 * (greatest - least);
    double weight = half / middle, inertia = 0.0, forward = 1.0 / middle;
    TRY(program_compute(&work->cells.input->gpu->programs, "dom_diffusion", &program));
    texture_clear(&work->missing[0]);
    texture_clear(&work->missing[1]);
    for (int step = 0; step < most; ++step) {
        bind_diffusion(work, &work->missing[(step + 1) % 3]);
        glBindTextureUnit(SLOT_MISSING + 1, work->missing[step % 3].id);
        dom_image(SLOT_OUTPUT, &work->missing[(step + 2) % 3]);
        glProgramUniform2f(program->id, 0, (float)inertia, (float)forward);
        TRY(dom_over_field(work, "dom_diffusion", (ivec4){0}));
        const double next = 1.0 / (2.0 * middle / half - weight);
        inertia = next * weight;
        forward = 2.0 * next / half;
        weight = next;
    }
    bind_diffusion(work, &work->missing[(most + 1) % 3]);
    glBindImageTexture(SLOT_OUTPUT, work->residuals[newest].id, 0, GL_TRUE, 0, GL_READ_WRITE,
                       GL_RGBA16F);
    glBindImageTexture(SLOT_OUTPUT + 1, work->results[newest].id, 0, GL_TRUE, 0, GL_READ_WRITE,
                       GL_RGBA16F);
    return dom_over_field(work, "dom_correct", (ivec4){0});
}

/* The newest residual's products with all that are kept. Into *change its length over the result's.
 */
static brume_result compare(struct dom_work *work, double *change)
{
    const struct program *program;
    const ivec4 dims = work->cells.field->dims;
    const int newest = work->slots[work->kept - 1];
    TRY(program_compute(&work->cells.input->gpu->programs, "dom_dots", &program));
    dom_bind_lattice(work);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, SLOT_DOTS, work->dots.id);
    for (int i = 0; i < HISTORY; ++i)
        glBindTextureUnit((GLuint)(SLOT_HISTORY + i), work->residuals[i].id);
    glBindTextureUnit(SLOT_MOMENTS, work->results[newest].id);
    TRY(opv_set_pass(&work->cells.passes,
                     (struct gpu_lattice_pass){.offset = {newest, work->kept, 0, 0}}));
    program_dispatch(program, dims.y, dims.z, 1);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);

    const size_t rows = (size_t)dims.y * (size_t)dims.z, count = rows * (HISTORY + 1);
    vec4 *parts = malloc(count * sizeof *parts);
    if (!parts)
        return fail(BRUME_E_MEMORY, "no memory for %zu products", count);
    glGetNamedBufferSubData(work->dots.id, 0, (GLsizeiptr)(count * sizeof *parts), parts);
    double sums[HISTORY + 1][3] = {{0}};
    for (size_t row = 0; row < rows; ++row)
        for (int i = 0; i <= HISTORY; ++i)
            for (int c = 0; c < 3; ++c)
                sums[i][c] += (double)(&parts[row * (HISTORY + 1) + (size_t)i].x)[c];
    free(parts);
    double left = 0.0, all = 0.0;
    for (int c = 0; c < 3; ++c) {
        for (int i = 0; i < work->kept; ++i)
            work->products[c][newest][i] = work->products[c][i][newest] = sums[i][c];
        left += sums[newest][c];
        all += sums[HISTORY][c];
    }
    *change = all > 0.0 ? sqrt(left / all) : 0.0;
    return BRUME_OK;
}

/* What the next iteration begins with, into work->now. */
static brume_result mix(struct dom_work *work)
{
    const struct program *program;
    float shares[HISTORY][3] = {{0}};
    for (int c = 0; c < 3; ++c) {
        double products[HISTORY][HISTORY], found[HISTORY];
        for (int i = 0; i < work->kept; ++i)
            for (int j = 0; j < work->kept; ++j)
                products[i][j] = work->products[c][work->slots[i]][work->slots[j]];
        dom_mix_shares(work->kept, products, found);
        for (int i = 0; i < work->kept; ++i)
            shares[work->slots[i]][c] = (float)found[i];
    }
    TRY(program_compute(&work->cells.input->gpu->programs, "dom_mix", &program));
    dom_bind_lattice(work);
    for (int i = 0; i < HISTORY; ++i)
        glBindTextureUnit((GLuint)(SLOT_HISTORY + i), work->results[i].id);
    glBindTextureUnit(SLOT_MOMENTS, work->next.id);
    dom_image(SLOT_OUTPUT, &work->now);
    dom_image(SLOT_OUTPUT + 1, &work->wall);
    glProgramUniform3fv(program->id, 0, HISTORY, shares[0]);
    return dom_over_field(work, "dom_mix", (ivec4){work->kept, 0, 0, 0});
}

brume_result dom_begin(struct dom_work *work)
{
    if (dom_has_world(work)) {
        laps_go(work->cells.laps, BRUME_FIELD_SCATTERED);
        TRY(dom_sweep(work, true));
        TRY(dom_gather(work, &work->world, false));
        if (work->has_within) {
            const struct texture *means = &work->means;
            glCopyImageSubData(means->id, GL_TEXTURE_3D, 0, 0, 0, 0, work->world_means.id,
                               GL_TEXTURE_3D, 0, 0, 0, 0, means->width, means->height,
                               means->depth);
        }
    }
    laps_go(work->cells.laps, BRUME_FIELD_SCATTERED);
    dom_bind_lattice(work);
    glBindTextureUnit(SLOT_MOMENTS, work->world.id);
    dom_image(SLOT_OUTPUT, &work->first);
    return dom_over_field(work, "dom_first", (ivec4){dom_has_world(work), 0, 0, 0});
}

static brume_result iterate(struct dom_work *work, double *change)
{
    dom_bind_lattice(work);
    glBindTextureUnit(SLOT_MOMENTS, work->now.id);
    glBindTextureUnit(SLOT_MOMENTS + 1, work->first.id);
    dom_image(SLOT_OUTPUT, &work->sources);
    TRY(dom_over_field(work, "dom_source", (ivec4){0}));
    TRY(dom_sweep(work, false));
    begin_entry(work);
    TRY(dom_gather(work, &work->next, true));
    TRY(diffuse(work));
    return compare(work, change);
}

brume_result dom_solve(struct dom_work *work)
{
    brume_stats *stats = work->cells.input->stats;
    const int wanted = work->cells.input->settings->iterations;
    const int most = wanted > 0 ? wanted : MOST_ITERATIONS;
    laps_go(work->cells.laps, BRUME_FIELD_ITERATIONS);
    const double limit = (double)work->cells.input->settings->converged;
    double least = INFINITY;
    for (int i = 0, best = 0; i < most; ++i) {
        double change = 0.0;
        work->cells.passes.done = 1.0f + 0.5f * (float)i / (float)(wanted > 0 ? wanted : i + 6);
        TRY(iterate(work, &change));
        ++stats->iterations;
        stats->change = change;
        TRY(mix(work));
        if (change < least) {
            least = change;
            best = i;
        }
        /* In the first one surfaces only learn what they have to send, unless they know. */
        if (wanted <= 0 && (i > 0 || work->warm) &&
            (change < limit || (least < NEARLY * limit && i - best >= STALLED)))
            break;
    }
    return BRUME_OK;
}
