// SPDX-License-Identifier: GPL-3.0-or-later
// The pixels that march_upsample leaves to march_rest.
#include "shared/brume_gpu.h"

layout(std430, binding = SLOT_REST) buffer rest_block
{
    uint rest_groups[3]; // of the dispatch
    uint rest_count;
    uint rest_pixels[];  // x, y in its upper half
};
