// SPDX-License-Identifier: GPL-3.0-or-later
// One iteration, with links that surfaces cut.
#version 450 core
#include "lib/blocked_links.glsl"
#include "lib/propagate.glsl"
