// SPDX-License-Identifier: GPL-3.0-or-later
// Inputs of the drawing stages: one vertex a corner, one instance an object.
#include "shared/brume_gpu.h"

layout(location = 0) in vec3 in_position;
layout(location = 1) in vec3 in_normal;
layout(location = 2) in vec2 in_uv;
layout(location = 3) in uint in_instance; // per instance: its number in the instances' buffer
layout(location = 4) in uint in_material; // constant of the draw

layout(std430, binding = SLOT_INSTANCES) readonly buffer instances_block
{
    gpu_instance instances[];
};

layout(std140, binding = SLOT_STAGE) uniform stage_block
{
    gpu_draw stage;
};
