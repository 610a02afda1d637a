/* SPDX-License-Identifier: GPL-3.0-or-later */
/* An order in which many things are visited so that the first few stand for all. Any thread. */
#ifndef BRUME_BASE_SPREAD_H
#define BRUME_BASE_SPREAD_H

#include <stdint.h>

/* A step through `count` things that visits all of them, each far from the last: prime to their
 * count, and near the share of a low-discrepancy sequence that no lot of the shaders follows. */
static inline uint32_t spread_step(uint32_t count)
{
    const uint32_t wanted = (uint32_t)(0.8191725134 * count);
    for (uint32_t step = wanted ? wanted : 1;; ++step) {
        uint32_t a = count, b = step;
        while (b) {
            const uint32_t rest = a % b;
            a = b;
            b = rest;
        }
        if (a == 1 || count == 0)
            return step;
    }
}

#endif
