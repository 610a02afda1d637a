/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Three floats and one more as the GPU's vec4. */
#ifndef BRUME_SCENE_PACK_H
#define BRUME_SCENE_PACK_H

#include "brume_gpu.h"

static inline vec4 pack(const float v[3], float w)
{
    return (vec4){v[0], v[1], v[2], w};
}

#endif
