/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Ordinates that the cube's rotations turn into one another. Beside the polynomials that a degree
 * asks for, those of 48 and 96 integrate |x| over the sphere, so that what falls onto a face of the
 * lattice's is right: with the points of highest degree it is 2 % too much, and a slab that absorbs
 * nothing loses 2 % of the light. They are not their own mirror images: those that are stand in
 * clusters about the axes and leave gaps elsewhere. docs/methods/dom.md has the figures. */
#include "transport/dom.h"

#include <math.h>

/* A point whose images by the 24 rotations all belong to the set. */
struct orbit {
    double x, y, z, weight; /* of a point; all together 1 */
};

static const struct orbit orbits_26[] = {
    {1.0, 0.0, 0.0, 1.0 / 21.0},
    {M_SQRT1_2, M_SQRT1_2, 0.0, 4.0 / 105.0},
    {0.57735026918962576, 0.57735026918962576, 0.57735026918962576, 9.0 / 280.0},
};
static const struct orbit orbits_48[] = {
    {0.708009589314440, 0.638947329489903, 0.300780204761748, 0.020918138446224},
    {0.933655832675592, 0.352184302283536, -0.065215054518923, 0.020748528220443},
};
static const struct orbit orbits_96[] = {
    {0.767548844865895, 0.468386160762951, 0.437587905626712, 0.013070454050213},
    {0.862194302515593, 0.501909807685200, 0.068611439709839, 0.011835866290686},
    {0.978354979948034, 0.148569883603592, 0.144043475717915, 0.008406659908131},
    {0.804198920656243, 0.564698099891915, -0.185418855550870, 0.008353686417636},
};

static int major(const double v[3])
{
    const double x = fabs(v[0]), y = fabs(v[1]), z = fabs(v[2]);
    return x >= y && x >= z ? 0 : (y >= z ? 1 : 2);
}

/* Adds those of the orbit whose major axis it is. */
static int add(const struct orbit *orbit, int axis, vec4 *out)
{
    static const int orders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1},
                                     {2, 1, 0}, {1, 0, 2}}; /* odd ones from the fourth on */
    const double point[3] = {orbit->x, orbit->y, orbit->z};
    int count = 0;
    for (int order = 0; order < 6; ++order) {
        for (int signs = 0; signs < 8; ++signs) {
            const int turned = (signs & 1) + (signs >> 1 & 1) + (signs >> 2) + (order >= 3);
            double v[3];
            for (int i = 0; i < 3; ++i)
                v[i] = point[orders[order][i]] * (signs >> i & 1 ? -1.0 : 1.0);
            /* An odd number of swaps and signs makes a mirror image. */
            bool skip = turned % 2 != 0 || major(v) != axis;
            for (int i = 0; i < count && !skip; ++i)
                skip = fabs((double)out[i].x - v[0]) + fabs((double)out[i].y - v[1]) +
                           fabs((double)out[i].z - v[2]) <
                       1e-5;
            if (!skip)
                out[count++] = (vec4){(float)v[0], (float)v[1], (float)v[2],
                                      (float)(4.0 * M_PI * orbit->weight)};
        }
    }
    return count;
}

void dom_quadrature(int count, vec4 directions[MOST_ORDINATES], int axes[3])
{
    const struct orbit *orbits = count == 26 ? orbits_26 : (count == 48 ? orbits_48 : orbits_96);
    const int orbit_count = count == 26 ? 3 : count / 24;
    int all = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const int begin = all;
        for (int i = 0; i < orbit_count; ++i)
            all += add(&orbits[i], axis, directions + all);
        axes[axis] = all - begin;
    }
}
