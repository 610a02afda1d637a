/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Light along ordinates, through the lattice of a run of DOM. docs/methods/dom.md. */
#include "base/result.h"
#include "transport/dom_work.h"

/* What comes from beyond the lattice's sides, around a slice: the world's own light, or of the same
 * kind what the lattice around has there. */
static brume_result come_in(struct dom_work *work, int slice, bool world)
{
    const struct program *program;
    const struct dom_work *around = work->around;
    const int *dims = &work->cells.field->dims.x;
    TRY(program_compute(&work->cells.input->gpu->programs, "dom_border", &program));
    if (work->surroundings.id)
        glBindTextureUnit(SLOT_SURROUNDINGS, work->surroundings.id);
    if (around)
        glBindTextureUnit(SLOT_MEANS_AROUND, world ? around->world_means.id : around->means.id);
    glProgramUniform2i(program->id, 1, around ? around->number : -1, around ? around->across : 1);
    dom_image(SLOT_OUTPUT, &work->slices[slice % 2]);
    for (int axis = 0, begin = 0; axis < 3; begin += work->axes[axis++]) {
        const int wide = dims[(axis + 1) % 3] + 2, high = dims[(axis + 2) % 3] + 2;
        if (slice >= dims[axis])
            continue;
        glProgramUniform4i(program->id, 0, slice, begin, axis,
                           world ? 1 + (work->surroundings.id != 0) : 0);
        program_dispatch(program, slice ? 2 * (wide + high) - 4 : wide * high, 1, work->axes[axis]);
    }
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    return BRUME_OK;
}

brume_result dom_sweep(struct dom_work *work, bool world)
{
    const struct program *program;
    const int *dims = &work->cells.field->dims.x;
    const bool open = world || work->around;
    TRY(program_compute(&work->cells.input->gpu->programs, "dom_sweep", &program));
    for (int i = 0; i < 2 && !open; ++i)
        texture_clear(&work->slices[i]);
    dom_bind_lattice(work);
    glBindTextureUnit(SLOT_CELL_WALLS, work->wall.id);
    glBindTextureUnit(SLOT_ANGULAR, work->sources.id);
    dom_image(SLOT_OUTPUT + 2, &work->hits);
    const int most = dom_longest_side(&work->cells.field->dims);
    for (int slice = 0; slice < most; ++slice) {
        TRY(opv_go_on(&work->cells.passes, 0.0f));
        if (open)
            TRY(come_in(work, slice, world));
        dom_image(SLOT_OUTPUT, &work->means);
        glBindTextureUnit(SLOT_SLICE, work->slices[slice % 2].id);
        dom_image(SLOT_OUTPUT + 1, &work->slices[1 - slice % 2]);
        for (int axis = 0, begin = 0; axis < 3; begin += work->axes[axis++]) {
            if (slice >= dims[axis])
                continue;
            glProgramUniform4i(program->id, 0, slice, begin, axis, world);
            program_dispatch(program, dims[(axis + 1) % 3] * dims[(axis + 2) % 3], 1,
                             work->axes[axis]);
        }
        glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
        if (work->cells.input->gpu->context.info.software)
            glFinish(); /* or a cancel would find all of them in the driver's queue */
    }
    return BRUME_OK;
}

brume_result dom_gather(struct dom_work *work, const struct texture *moments, bool sources)
{
    dom_bind_lattice(work);
    const int newest =
        work->kept ? work->slots[work->kept - 1] : 0; /* the world's leaves no history */
    glBindTextureUnit(SLOT_WALLS, work->cells.cells[2].id);
    glBindTextureUnit(SLOT_ANGULAR, work->means.id);
    glBindTextureUnit(SLOT_HITS, work->hits.id);
    glBindTextureUnit(SLOT_MOMENTS, work->now.id);
    glBindTextureUnit(SLOT_CELL_WALLS, work->wall.id);
    glBindTextureUnit(SLOT_CELL_EMISSION, work->emission.id);
    dom_image(SLOT_OUTPUT, moments);
    dom_image(SLOT_OUTPUT + 1, &work->residuals[newest]);
    dom_image(SLOT_OUTPUT + 2, &work->results[newest]);
    /* Reflected light is bound where moments are. */
    for (int c = 0; c < 3; ++c)
        glBindTextureUnit((GLuint)(SLOT_REFLECTED + c), work->cells.reflected[c].id);
    return dom_over_field(work, "dom_gather", (ivec4){sources, work->cells.tiles, 0, 0});
}
