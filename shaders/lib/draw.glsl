// SPDX-License-Identifier: GPL-3.0-or-later
// The drawing stages' block, for their vertices and fragments.
#include "shared/brume_gpu.h"

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_draw stage;
};
