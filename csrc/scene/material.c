/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Materials and images: checked copies. */
#include "base/result.h"
#include "scene/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void plain_destroy(struct block *block)
{
    free(block);
}

static int clean(float *values, int count)
{
    for (int i = 0; i < count; ++i) {
        if (!isfinite(values[i]))
            return 0;
        values[i] = fmaxf(values[i], 0.0f);
    }
    return 1;
}

brume_result material_create(const brume_material *source, struct block **out)
{
    const char *name = source->name ? source->name : "";
    struct material_block *owner = calloc(1, sizeof *owner);
    if (!owner)
        return fail(BRUME_E_MEMORY, "no memory for material '%s'", name);
    block_init(&owner->block, plain_destroy);
    owner->material = *source;
    owner->material.name = NULL;
    brume_material *m = &owner->material;
    if (!clean(m->diffuse, 3) || !clean(m->specular, 3) || !clean(m->metal, 3) ||
        !clean(m->emission, 3) || !clean(m->transparent, 3) || !clean(&m->roughness, 1) ||
        !clean(&m->alpha, 1) || !clean(&m->alpha_threshold, 1)) {
        free(owner);
        return fail(BRUME_E_ARGUMENT, "material '%s' has a value that is not finite", name);
    }
    if (m->alpha_mode > BRUME_ALPHA_BLEND) {
        free(owner);
        return fail(BRUME_E_ARGUMENT, "material '%s' has no alpha mode %u", name,
                    source->alpha_mode);
    }
    *out = &owner->block;
    return BRUME_OK;
}

static void image_destroy(struct block *block)
{
    free(((struct image_block *)block)->pixels);
    free(block);
}

brume_result image_create(const brume_image *source, struct block **out)
{
    const char *name = source->name ? source->name : "";
    REQUIRE(source->pixels);
    REQUIRE(source->width > 0 && source->height > 0);
    REQUIRE(source->width <= 65536 && source->height <= 65536);
    REQUIRE(source->extend <= BRUME_EXTEND_MIRROR);
    struct image_block *image = calloc(1, sizeof *image);
    const size_t count = 4 * (size_t)source->width * (size_t)source->height;
    float *pixels = malloc(count * sizeof *pixels);
    if (!image || !pixels) {
        free(image);
        free(pixels);
        return fail(BRUME_E_MEMORY, "no memory for the %d x %d pixels of image '%s'", source->width,
                    source->height, name);
    }
    block_init(&image->block, image_destroy);
    snprintf(image->name, sizeof image->name, "%s", name);
    image->width = source->width;
    image->height = source->height;
    image->extend = source->extend;
    image->nearest = source->nearest;
    image->pixels = pixels;
    /* One bad pixel of an HDR must not make the whole picture NaN. */
    for (size_t i = 0; i < count; ++i) {
        pixels[i] = isfinite(source->pixels[i]) ? source->pixels[i] : 0.0f;
        image->maximum = fmaxf(image->maximum, fabsf(pixels[i]));
    }
    *out = &image->block;
    return BRUME_OK;
}
