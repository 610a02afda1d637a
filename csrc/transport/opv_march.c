/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Depths by a march from each node all the way to the source: the reference. */
#include "base/result.h"
#include "transport/opv_ways.h"

brume_result opv_march(struct opv_work *run)
{
    const struct transport_input *input = run->input;
    const struct program *program;
    TRY(program_compute(&input->gpu->programs, "opv_march", &program));
    opv_bind_image(run->texture);
    const float each = 1.0f / (float)run->count;
    for (uint32_t i = 0; i < run->count; ++i)
        TRY(opv_slabs(run, program, (struct gpu_lattice_pass){.offset = {(int)i}},
                      &input->frame->lattice_dims, each * (float)i, each));
    return BRUME_OK;
}
