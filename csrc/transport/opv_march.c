/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Depths by a march from each node all the way to the source: the reference. */
#include "base/result.h"
#include "transport/opv_ways.h"

brume_result opv_march(struct opv_work *run)
{
    const struct transport_input *input = run->input;
    const ivec4 dims = input->frame->lattice_dims;
    const struct program *program;
    TRY(program_compute(&input->gpu->programs, "opv_march", &program));
    opv_bind_image(run->texture);
    /* A GPU takes the lattice whole; a CPU about a tenth of a second a slab, so that a cancel need
     * not wait for all of it. */
    const int slab = input->gpu->context.info.software ? 2 * GROUP_CELLS : dims.z;
    for (uint32_t i = 0; i < run->count; ++i)
        for (int z = 0; z < dims.z; z += slab) {
            const int end = z + slab < dims.z ? z + slab : dims.z;
            TRY(opv_go_on(run, ((float)i + (float)z / (float)dims.z) / (float)run->count));
            TRY(opv_set_pass(
                run, (struct gpu_lattice_pass){.offset = {(int)i}, .slab = {0, 0, z, end}}));
            program_dispatch(program, dims.x, dims.y, end - z);
            /* Or a cancel would find all of them in the driver's queue. */
            glFinish();
        }
    return BRUME_OK;
}
