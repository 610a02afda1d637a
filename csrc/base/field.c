/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Fields: memory, references, range of values. */
#include "base/field.h"
#include "base/result.h"

#include <math.h>
#include <stdlib.h>

static size_t value_count(const brume_grid_info *info)
{
    return (size_t)info->channels * (size_t)info->dims[0] * (size_t)info->dims[1] *
           (size_t)info->dims[2];
}

brume_result field_create(const brume_grid_info *info, brume_grid **out)
{
    ASSERT(info->channels > 0 && info->dims[0] > 0 && info->dims[1] > 0 && info->dims[2] > 0);
    brume_grid *field = calloc(1, sizeof *field);
    float *data = calloc(value_count(info), sizeof *data);
    if (!field || !data) {
        free(field);
        free(data);
        return fail(BRUME_E_MEMORY, "no memory for the %d x %d x %d voxels of grid '%s'",
                    info->dims[0], info->dims[1], info->dims[2], info->name);
    }
    field->references = 1;
    field->info = *info;
    field->data = data;
    *out = field;
    return BRUME_OK;
}

brume_grid *field_retain(brume_grid *field)
{
    if (field)
        __atomic_add_fetch(&field->references, 1, __ATOMIC_RELAXED);
    return field;
}

void field_release(brume_grid *field)
{
    if (field && __atomic_sub_fetch(&field->references, 1, __ATOMIC_ACQ_REL) == 0) {
        free(field->data);
        free(field);
    }
}

brume_result field_finish(brume_grid *field)
{
    const size_t count = value_count(&field->info);
    float minimum = INFINITY, maximum = -INFINITY;
    for (size_t i = 0; i < count; ++i) {
        const float value = field->data[i];
        if (!isfinite(value))
            return fail(BRUME_E_GRID_VALUES, "grid '%s' has NaN or infinite values",
                        field->info.name);
        minimum = fminf(minimum, value);
        maximum = fmaxf(maximum, value);
    }
    field->info.minimum = minimum;
    field->info.maximum = maximum;
    return BRUME_OK;
}
