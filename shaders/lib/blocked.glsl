// SPDX-License-Identifier: GPL-3.0-or-later
// What surfaces block of the light on a link: shares of it.
#include "lib/level.glsl"

struct link_blockers
{
    float there; // of what the cell sends
    float back;  // of what comes to it
};
