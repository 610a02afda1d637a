/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The small system of Anderson's acceleration. */
#include "transport/dom.h"

#include <math.h>

/* Solves a x = b, symmetric and positive, in place; false where it is none. */
static bool solve(int n, double a[HISTORY][HISTORY], double b[HISTORY])
{
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < i; ++j) {
            const double factor = a[i][j] / a[j][j];
            for (int k = j; k < n; ++k)
                a[i][k] -= factor * a[j][k];
            b[i] -= factor * b[j];
        }
        if (!(a[i][i] > 0.0))
            return false;
    }
    for (int i = n - 1; i >= 0; --i) {
        for (int k = i + 1; k < n; ++k)
            b[i] -= a[i][k] * b[k];
        b[i] /= a[i][i];
    }
    return true;
}

void dom_mix_shares(int count, double products[HISTORY][HISTORY], double shares[HISTORY])
{
    /* The least of the sum with shares of 1 together: G s = lambda 1. A little is added to the
     * diagonal, for residuals that are all but parallel; their lengths differ by orders of
     * magnitude. */
    for (int n = count; n > 1; --n) { /* of the newest, last in the list */
        const int first = count - n;
        double a[HISTORY][HISTORY], b[HISTORY], sum = 0.0;
        for (int i = 0; i < n; ++i) {
            for (int j = 0; j < n; ++j)
                a[i][j] = products[first + i][first + j];
            a[i][i] *= 1.0 + 1e-6;
            b[i] = 1.0;
        }
        if (!solve(n, a, b))
            continue;
        for (int i = 0; i < n; ++i)
            sum += b[i];
        if (!(fabs(sum) > 0.0) || !isfinite(sum))
            continue;
        for (int i = 0; i < count; ++i)
            shares[i] = i < first ? 0.0 : b[i - first] / sum;
        return;
    }
    for (int i = 0; i < count; ++i)
        shares[i] = i == count - 1 ? 1.0 : 0.0;
}
