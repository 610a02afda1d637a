/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The sizes that the shaders expect of the shared structs (std140 and std430 agree on them). */
#include "brume_gpu.h"

_Static_assert(sizeof(struct gpu_light) == 128, "gpu_light");
_Static_assert(sizeof(struct gpu_light_sample) == 32, "gpu_light_sample");
_Static_assert(sizeof(struct gpu_shadow_view) == 96, "gpu_shadow_view");
_Static_assert(sizeof(struct gpu_material) == 256, "gpu_material");
_Static_assert(sizeof(struct gpu_instance) == 144, "gpu_instance");
_Static_assert(sizeof(struct gpu_draw) == 112, "gpu_draw");
_Static_assert(sizeof(struct gpu_lattice_pass) == 32, "gpu_lattice_pass");
_Static_assert(sizeof(struct gpu_reflection) == 112, "gpu_reflection");
_Static_assert(sizeof(struct gpu_depth_source) == 48, "gpu_depth_source");
_Static_assert(sizeof(struct gpu_field) == 64, "gpu_field");
_Static_assert(sizeof(struct gpu_ordinate) == 160, "gpu_ordinate");
_Static_assert(sizeof(struct gpu_frame) % 16 == 0, "gpu_frame");
