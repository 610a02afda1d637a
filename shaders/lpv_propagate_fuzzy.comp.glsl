// SPDX-License-Identifier: GPL-3.0-or-later
// One iteration, with fuzzy blockers.
#version 450 core
#include "lib/blocked_fuzzy.glsl"
#include "lib/propagate.glsl"
