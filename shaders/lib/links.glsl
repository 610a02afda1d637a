// SPDX-License-Identifier: GPL-3.0-or-later
// Links: the ways from a cell of the field's lattice to its 26 neighbours, numbered so that link
// i + 13 is the opposite of link i.
#include "lib/frame.glsl"

const ivec3 LINKS[13] =
    ivec3[](ivec3(1, 0, 0), ivec3(0, 1, 0), ivec3(0, 0, 1), ivec3(1, 1, 0), ivec3(1, -1, 0),
            ivec3(1, 0, 1), ivec3(1, 0, -1), ivec3(0, 1, 1), ivec3(0, 1, -1), ivec3(1, 1, 1),
            ivec3(1, 1, -1), ivec3(1, -1, 1), ivec3(1, -1, -1));

const vec3 ASIDE = vec3(ASIDE_X, ASIDE_Y, ASIDE_Z);

// Shares of a uniform emission: the weights of the quadrature with these 26 points that is exact for
// polynomials of degree 7 (Lebedev, "Quadratures on a sphere", 1976), so that a lobe sends out the power
// and the flux that it has.
const float WEIGHTS[3] = float[](1.0 / 21.0, 4.0 / 105.0, 9.0 / 280.0);

// The mean length of a link by these, in cells.
const float MEAN_WAY = 1.3776;

// 0 through a face, 1 an edge, 2 a corner.
int link_class(int i)
{
    return i < 3 ? 0 : (i < 9 ? 1 : 2);
}

float link_length(int i)
{
    return sqrt(float(link_class(i) + 1));
}

vec3 cell_centre(gpu_field field, ivec3 cell)
{
    return field.lower.xyz + (vec3(cell) + 0.5) * field.lower.w;
}

bool in_field(gpu_field field, ivec3 cell)
{
    return all(greaterThanEqual(cell, ivec3(0))) && all(lessThan(cell, field.dims.xyz));
}
