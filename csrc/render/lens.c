/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Places in the opening of a lens. */
#include "render/lens.h"
#include "base/spread.h"

#include <math.h>

#define PI 3.14159265358979323846
#define GOLDEN 0.6180339887498949

/* A place of the unit disk: share of a turn, and share of the area within. */
static void place_in_disk(double turn, double within, double out[2])
{
    out[0] = sqrt(within) * cos(2.0 * PI * turn);
    out[1] = sqrt(within) * sin(2.0 * PI * turn);
}

/* The same of a regular polygon with corners on the unit circle, of which one triangle, from the
 * middle to a side, has its axis along the first axis. */
static void place_in_polygon(uint32_t corners, double turn, double within, double out[2])
{
    const double half = PI / corners, at = turn * corners;
    const double triangle = floor(at), along = sqrt(within) * cos(half);
    const double across = (2.0 * (at - triangle) - 1.0) * sqrt(within) * sin(half);
    const double c = cos(2.0 * half * triangle), s = sin(2.0 * half * triangle);
    out[0] = c * along - s * across;
    out[1] = s * along + c * across;
}

void lens_offset(const brume_lens *lens, uint32_t index, uint32_t count, float offset[2])
{
    offset[0] = offset[1] = 0.0f;
    if (count == 1)
        return; /* the middle stands for all */
    /* Vogel's spiral: "A better way to construct the sunflower head", Mathematical Biosciences
     * 1979. Not from its middle on, so that any first part of it stands for all. */
    const uint64_t number = (uint64_t)index * spread_step(count) % count;
    const double turn = fmod((double)number * GOLDEN, 1.0);
    const double within = ((double)number + 0.5) / count;
    double place[2];
    if (lens->blades < 3)
        place_in_disk(turn, within, place);
    else
        place_in_polygon(lens->blades, turn, within, place);
    const double c = cos((double)lens->rotation), s = sin((double)lens->rotation);
    const double ratio = lens->ratio > 0.0f ? (double)lens->ratio : 1.0;
    offset[0] = (float)((double)lens->radius * (c * place[0] - s * place[1]) / ratio);
    offset[1] = (float)((double)lens->radius * (s * place[0] + c * place[1]));
}
