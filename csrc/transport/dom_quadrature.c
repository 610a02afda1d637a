/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Ordinates with the cube's symmetry. Beside the polynomials that a degree asks for, those of 48
 * and 96 integrate |x| over the sphere, so that what falls onto a face of the lattice's is right:
 * with the points of highest degree it is 2 % too much, and a slab that absorbs nothing loses 2 %
 * of the light. */
#include "transport/dom.h"

#include <math.h>

/* Points whose coordinates have these sizes, in any order and with any signs. */
struct orbit {
    double a, b, c, weight; /* of a point; all together 1 */
};

static const struct orbit orbits_26[] = {
    {1.0, 0.0, 0.0, 1.0 / 21.0},
    {M_SQRT1_2, M_SQRT1_2, 0.0, 4.0 / 105.0},
    {0.57735026918962576, 0.57735026918962576, 0.57735026918962576, 9.0 / 280.0},
};
static const struct orbit orbits_48[] = {
    {0.684348909528637, 0.684348909528637, 0.0, 0.028288887514493},
    {0.131460761015857, 0.131460761015857, 0.0, 0.013377779152174},
};
static const struct orbit orbits_96[] = {
    {0.456598131002521, 0.456598131002521, 0.0, 0.010804157088350},
    {0.066479892373643, 0.066479892373643, 0.0, 0.006377491765044},
    {0.164615292543278, 0.509660111627193, 0.0, 0.012242508906636},
};

static int major(const double v[3])
{
    const double x = fabs(v[0]), y = fabs(v[1]), z = fabs(v[2]);
    return x >= y && x >= z ? 0 : (y >= z ? 1 : 2);
}

/* Adds those of the orbit whose major axis it is. */
static int add(const struct orbit *orbit, int axis, vec4 *out)
{
    static const int orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                     {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    const double sizes[3] = {orbit->a, orbit->b, orbit->c};
    int count = 0;
    for (int order = 0; order < 6; ++order) {
        for (int signs = 0; signs < 8; ++signs) {
            double v[3];
            for (int i = 0; i < 3; ++i)
                v[i] = sizes[orders[order][i]] * (signs >> i & 1 ? -1.0 : 1.0);
            bool known = major(v) != axis;
            for (int i = 0; i < count && !known; ++i)
                known = fabs((double)out[i].x - v[0]) + fabs((double)out[i].y - v[1]) +
                            fabs((double)out[i].z - v[2]) <
                        1e-5;
            if (!known)
                out[count++] = (vec4){(float)v[0], (float)v[1], (float)v[2],
                                      (float)(4.0 * M_PI * orbit->weight)};
        }
    }
    return count;
}

void dom_quadrature(int count, vec4 directions[MOST_ORDINATES], int axes[3])
{
    const struct orbit *orbits = count == 26 ? orbits_26 : (count == 48 ? orbits_48 : orbits_96);
    const int orbit_count = count == 48 ? 2 : 3;
    int all = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const int begin = all;
        for (int i = 0; i < orbit_count; ++i) {
            struct orbit orbit = orbits[i];
            if (count != 26) /* on the sphere */
                orbit.c = sqrt(1.0 - orbit.a * orbit.a - orbit.b * orbit.b);
            all += add(&orbit, axis, directions + all);
        }
        axes[axis] = all - begin;
    }
}
