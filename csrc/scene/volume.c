/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Volumes of the medium: checked, copied and bounded once. Any thread. */
#include "base/field.h"
#include "base/result.h"
#include "math/frame.h"
#include "scene/medium.h"
#include "scene/resample.h"
#include "scene/splat.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What a program of Gaussians may read: their density and their colour. */
enum { GAUSSIAN_GRIDS = 2 };

static brume_result check_transform(struct volume *volume)
{
    float *m = volume->world_from_object;
    if (!mat4_is_finite(m))
        return fail(BRUME_E_TRANSFORM, "volume '%s' has NaN or infinite values in its transform",
                    volume->name);
    /* Inverted parents leave rounding noise in the last row, which goes. */
    for (int column = 0; column < 4; ++column) {
        const float expected = column == 3 ? 1.0f : 0.0f;
        if (!(fabsf(m[4 * column + 3] - expected) <= 1e-5f))
            return fail(BRUME_E_TRANSFORM, "volume '%s' has a transform that is not linear",
                        volume->name);
        m[4 * column + 3] = expected;
    }
    if (!mat4_invert(m, volume->object_from_world))
        return fail(BRUME_E_TRANSFORM, "volume '%s' has zero scale along an axis", volume->name);
    return BRUME_OK;
}

static brume_result copy_mesh(struct volume *volume, const brume_volume *source)
{
    if (!source->triangles || source->triangle_count == 0)
        return fail(BRUME_E_MESH, "the mesh of volume '%s' has no triangles", volume->name);
    const size_t position_count = (size_t)source->vertex_count * 3;
    const size_t index_count = (size_t)source->triangle_count * 3;
    for (size_t i = 0; i < position_count; ++i)
        if (!isfinite(source->positions[i]))
            return fail(BRUME_E_MESH, "vertex %zu of volume '%s' has a NaN or infinite position",
                        i / 3, volume->name);
    for (size_t i = 0; i < index_count; ++i)
        if (source->triangles[i] >= source->vertex_count)
            return fail(BRUME_E_MESH, "triangle %zu of volume '%s' names vertex %u of %u", i / 3,
                        volume->name, source->triangles[i], source->vertex_count);

    volume->positions = malloc(position_count * sizeof *volume->positions);
    volume->triangles = malloc(index_count * sizeof *volume->triangles);
    if (!volume->positions || !volume->triangles)
        return fail(BRUME_E_MEMORY, "no memory for the mesh of volume '%s'", volume->name);
    memcpy(volume->positions, source->positions, position_count * sizeof *volume->positions);
    memcpy(volume->triangles, source->triangles, index_count * sizeof *volume->triangles);
    volume->vertex_count = source->vertex_count;
    volume->triangle_count = source->triangle_count;
    return BRUME_OK;
}

static brume_result retain_grids(struct volume *volume, const brume_volume *source)
{
    volume->grids = calloc(source->grid_count, sizeof *volume->grids);
    if (!volume->grids)
        return fail(BRUME_E_MEMORY, "no memory for the grids of volume '%s'", volume->name);
    volume->grid_count = source->grid_count;
    for (uint32_t i = 0; i < source->grid_count; ++i)
        volume->grids[i] = field_retain(source->grids[i]);
    return BRUME_OK;
}

static brume_result check_gaussian(const struct volume *volume, const brume_gaussian *gaussian,
                                   uint32_t number)
{
    const float *center = gaussian->center, *color = gaussian->color;
    if (!isfinite(center[0]) || !isfinite(center[1]) || !isfinite(center[2]))
        return fail(BRUME_E_ARGUMENT, "Gaussian %u of volume '%s' has a NaN or infinite center",
                    number, volume->name);
    if (!(gaussian->scale > 0.0f && isfinite(gaussian->scale)))
        return fail(BRUME_E_ARGUMENT,
                    "Gaussian %u of volume '%s' has the scale %g; it must be finite and positive",
                    number, volume->name, gaussian->scale);
    if (!(gaussian->amplitude >= 0.0f && isfinite(gaussian->amplitude)))
        return fail(BRUME_E_ARGUMENT,
                    "Gaussian %u of volume '%s' has the amplitude %g; it must be finite and not "
                    "negative",
                    number, volume->name, gaussian->amplitude);
    for (int c = 0; c < 3; ++c)
        if (!(color[c] >= 0.0f && isfinite(color[c])))
            return fail(BRUME_E_ARGUMENT,
                        "Gaussian %u of volume '%s' has the color (%g, %g, %g); it must be finite "
                        "and not negative",
                        number, volume->name, color[0], color[1], color[2]);
    return BRUME_OK;
}

static brume_result copy_gaussians(struct volume *volume, const brume_volume *source)
{
    if (source->gaussian_count == 0)
        return fail(BRUME_E_ARGUMENT, "volume '%s' has no Gaussians", volume->name);
    volume->gaussians = malloc(source->gaussian_count * sizeof *volume->gaussians);
    if (!volume->gaussians)
        return fail(BRUME_E_MEMORY, "no memory for the Gaussians of volume '%s'", volume->name);
    for (uint32_t i = 0; i < source->gaussian_count; ++i) {
        TRY(check_gaussian(volume, &source->gaussians[i], i));
        if (source->gaussians[i].amplitude > 0.0f)
            volume->gaussians[volume->gaussian_count++] = source->gaussians[i];
    }
    return BRUME_OK;
}

/* Grids, a mesh or Gaussians: exactly one of them. */
static brume_result copy_content(struct volume *volume, const brume_volume *source)
{
    bool grids = false;
    for (uint32_t i = 0; source->grids && i < source->grid_count; ++i)
        grids = grids || source->grids[i];
    const bool mesh = source->positions, gaussians = source->gaussians;
    if (grids + mesh + gaussians == 0)
        return fail(BRUME_E_ARGUMENT, "volume '%s' has neither a grid, a mesh nor Gaussians",
                    volume->name);
    if (grids + mesh + gaussians > 1)
        return fail(BRUME_E_ARGUMENT, "volume '%s' has more than one of grids, mesh and Gaussians",
                    volume->name);
    return grids  ? retain_grids(volume, source)
           : mesh ? copy_mesh(volume, source)
                  : copy_gaussians(volume, source);
}

static void grow(struct volume *volume, const float lower[3], const float upper[3])
{
    for (int axis = 0; axis < 3; ++axis) {
        volume->lower[axis] = fminf(volume->lower[axis], lower[axis]);
        volume->upper[axis] = fmaxf(volume->upper[axis], upper[axis]);
    }
}

static brume_result find_bounds(struct volume *volume)
{
    for (int axis = 0; axis < 3; ++axis) {
        volume->lower[axis] = INFINITY;
        volume->upper[axis] = -INFINITY;
    }
    /* Vertices that no triangle has do not count. */
    for (size_t i = 0; i < (size_t)volume->triangle_count * 3; ++i) {
        float point[3];
        mat4_point(volume->world_from_object, volume->positions + 3 * (size_t)volume->triangles[i],
                   point);
        grow(volume, point, point);
    }
    for (uint32_t i = 0; i < volume->grid_count; ++i) {
        const brume_grid *grid = volume->grids[i];
        if (!grid)
            continue;
        float from_array[16], inverse[16], lower[3], upper[3], world_lower[3], world_upper[3];
        mat4_multiply(volume->world_from_object, grid->info.object_from_array, from_array);
        if (!mat4_invert(from_array, inverse))
            return fail(BRUME_E_TRANSFORM,
                        "volume '%s': grid '%s' has zero scale or values that are not finite in "
                        "its transform",
                        volume->name, grid->info.name);
        field_support(grid, lower, upper);
        mat4_bounds(from_array, lower, upper, world_lower, world_upper);
        grow(volume, world_lower, world_upper);
    }
    for (uint32_t i = 0; i < volume->gaussian_count; ++i) {
        double center[3];
        float lower[3], upper[3];
        const double reach = GAUSSIAN_REACH / gaussian_place(&volume->gaussians[i],
                                                             volume->world_from_object, center);
        for (int axis = 0; axis < 3; ++axis) {
            lower[axis] = (float)(center[axis] - reach);
            upper[axis] = (float)(center[axis] + reach);
        }
        grow(volume, lower, upper);
    }
    if (volume->gaussians && volume->gaussian_count == 0)
        return BRUME_OK; /* reaches nowhere */
    for (int axis = 0; axis < 3; ++axis)
        if (!isfinite(volume->lower[axis]) || !isfinite(volume->upper[axis]))
            return fail(BRUME_E_TRANSFORM, "volume '%s' reaches further than numbers do",
                        volume->name);
    return BRUME_OK;
}

brume_result volume_create(const brume_volume *source, struct volume **out)
{
    REQUIRE(source != NULL);
    REQUIRE(out != NULL);
    const char *name = source->name ? source->name : "unnamed";
    struct volume *volume = calloc(1, sizeof *volume);
    if (!volume)
        return fail(BRUME_E_MEMORY, "no memory for volume '%s'", name);
    volume->references = 1;
    snprintf(volume->name, sizeof volume->name, "%s", name);
    memcpy(volume->world_from_object, source->world_from_object, sizeof volume->world_from_object);
    volume->scale = source->scale == 0.0f ? 1.0f : source->scale;
    memcpy(volume->generated_lower, source->generated_lower, sizeof volume->generated_lower);
    memcpy(volume->generated_upper, source->generated_upper, sizeof volume->generated_upper);

    brume_result result = BRUME_OK;
    if (!(volume->scale > 0.0f && isfinite(volume->scale)))
        result = fail(BRUME_E_ARGUMENT, "volume '%s' has the scale %g; it must be positive",
                      volume->name, volume->scale);
    if (result == BRUME_OK)
        result = check_transform(volume);
    if (result == BRUME_OK)
        result = copy_content(volume, source);
    if (result == BRUME_OK)
        result = find_bounds(volume);
    if (result == BRUME_OK)
        result = volume_program_init(&volume->program, &source->program,
                                     volume->gaussians ? GAUSSIAN_GRIDS : source->grid_count,
                                     volume->name);
    if (result != BRUME_OK) {
        volume_release(volume);
        return result;
    }
    *out = volume;
    return BRUME_OK;
}

struct volume *volume_retain(struct volume *volume)
{
    if (volume)
        __atomic_add_fetch(&volume->references, 1, __ATOMIC_RELAXED);
    return volume;
}

void volume_release(struct volume *volume)
{
    if (!volume || __atomic_sub_fetch(&volume->references, 1, __ATOMIC_ACQ_REL) != 0)
        return;
    for (uint32_t i = 0; i < volume->grid_count; ++i)
        field_release(volume->grids[i]);
    free(volume->grids);
    free(volume->positions);
    free(volume->triangles);
    free(volume->gaussians);
    volume_program_finish(&volume->program);
    free(volume);
}
