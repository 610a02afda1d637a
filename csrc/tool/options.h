/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What the command line of brume-render says. Angles are kept in radians, all else in the units of
 * brume.h. One thread. */
#ifndef BRUME_TOOL_OPTIONS_H
#define BRUME_TOOL_OPTIONS_H

#include "brume.h"

#include <stdbool.h>

#define OPTION_LIGHTS_MAX 64

/* A vector whose first number is NaN was not given. */
typedef struct options {
    const char *input;  /* the .vdb */
    const char *output; /* the .exr */
    bool list, stats, verbose, help, version;

    /* medium */
    const char *density, *temperature, *flame; /* grid names; the last two may be NULL */
    float density_scale, albedo[3], anisotropy;
    float emission[3];
    float blackbody, kelvin;

    /* light */
    brume_light lights[OPTION_LIGHTS_MAX];
    uint32_t light_count;
    float lamp_strength, lamp_color[3]; /* of the last lamp: its power is their product */
    const char *environment;
    float environment_rotation;
    float background[3];
    float floor[3]; /* colour */

    /* camera */
    float eye[3], target[3], up[3];
    float fov;          /* vertical */
    float orthographic; /* height of the view in metres; 0: perspective */
    int32_t width, height;

    brume_settings settings;
    int32_t samples; /* 0: the library's default */
    uint32_t seed, passes;
    bool transparent, half_march;
} options;

/* Reads the command line. true where there is work to do; else *exit_code is what the program ends
 * with: 0 after --help and --version, 2 after a sentence on stderr. */
bool options_parse(int argc, char **argv, options *out, int *exit_code);

/* Adds a sun that shines along the direction, of any length but zero. false where there are too
 * many lamps. */
bool options_add_sun(options *out, const float direction[3]);

#endif
