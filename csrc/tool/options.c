/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The command line of brume-render: every number is checked as it is read. */
#include "tool/options.h"

#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define RADIANS(degrees) ((degrees) * 0.017453292519943295f)

static const char help[] =
    "Usage: brume-render [options] --output PICTURE.exr SMOKE.vdb\n"
    "       brume-render --list SMOKE.vdb\n"
    "\n"
    "Renders the grids of an OpenVDB file as fog, smoke or cloud into an OpenEXR picture.\n"
    "Vectors and colours are three numbers with commas, 1,0.5,0.2; a colour may be one number.\n"
    "Lengths are metres, angles degrees; +Z is up.\n"
    "\n"
    "  -o, --output FILE           the picture, linear 32-bit EXR\n"
    "  -l, --list                  list the grids of the file and end\n"
    "\n"
    "Medium\n"
    "      --density GRID          its density (default: \"density\")\n"
    "      --density-scale X       extinction in 1/m of a density of 1 (default: 1)\n"
    "      --albedo COLOUR         share of the extinction that scatters (default: 0.9)\n"
    "      --anisotropy G          mean cosine of scattering, -0.99 to 0.99 (default: 0)\n"
    "      --emission COLOUR       own light in W/(sr m^3), times the flame, else the density\n"
    "      --flame GRID            where --emission glows\n"
    "      --temperature GRID      glows as a black body of this temperature\n"
    "      --kelvin K              temperature in kelvin of a value of 1 (default: 1000)\n"
    "      --blackbody X           intensity from 0 to 1, as in Principled Volume (default: 1)\n"
    "\n"
    "Light (by default a sun, unless the medium glows; --color … change the lamp before them)\n"
    "      --sun X,Y,Z             a sun that shines along X,Y,Z\n"
    "        --irradiance W          in W/m^2 (default: 3)\n"
    "        --angle DEGREES         its angular diameter (default: 0.526)\n"
    "      --point X,Y,Z           a lamp that stands at X,Y,Z\n"
    "        --power W               in W (default: 100)\n"
    "        --radius M              of its ball (default: 0.1)\n"
    "        --color COLOUR          of either (default: 1)\n"
    "      --environment FILE      an equirectangular EXR all around\n"
    "      --environment-rotation DEGREES  turns it about +Z, anticlockwise seen from above\n"
    "      --background COLOUR     radiance of the world; multiplies the environment\n"
    "      --floor COLOUR          a matt plane under the medium\n"
    "\n"
    "Camera (by default it frames the medium)\n"
    "      --eye X,Y,Z             where it stands\n"
    "      --target X,Y,Z          what it looks at (default: the medium's middle)\n"
    "      --up X,Y,Z              what points upwards in the picture (default: 0,0,1)\n"
    "      --fov DEGREES           vertical field of view (default: 40)\n"
    "      --orthographic M        parallel view of this height instead\n"
    "      --size WxH              pixels (default: 640x360)\n"
    "\n"
    "Quality\n"
    "      --samples N             samples of a pixel (default: 16)\n"
    "      --seed N                same seed, same noise (default: 0)\n"
    "      --medium-resolution N   cells along the medium's longest side (default: 128)\n"
    "      --lattice-resolution N  the same for the light's lattice (default: 64)\n"
    "      --shadow-resolution N   texels along a shadow map's side (default: 512)\n"
    "      --light-samples N       shadow maps spread over each lamp (default: 8)\n"
    "      --world-samples N       directions that stand for the world's light (default: 128)\n"
    "      --step X                march step in cells of the medium (default: 1)\n"
    "      --half-march            march one ray for 2 x 2 pixels: the view takes a third of the\n"
    "                              time or less, and fine detail of the medium is softer\n"
    "      --depths WAY            optical depths to the lamps: propagated (the default), marched\n"
    "                              (exact, slower); corrected or paper, to compare\n"
    "      --method METHOD         dom: all that media and surfaces scatter, right to a few percent\n"
    "                              (the default); lpv: the same, softly; opv: light that media\n"
    "                              scatter once, the quickest\n"
    "      --field-resolution N    lpv, dom: cells along the longest side of the lattice in which\n"
    "                              that goes on (default: half of --lattice-resolution)\n"
    "      --cascades N            lpv, dom: such lattices, each within the last around the medium, half\n"
    "                              as long with as many cells (1 to 3; default: 1, and with dom\n"
    "                              another around a medium that is small in it)\n"
    "      --ordinates N           dom: directions that light goes along, 26, 48 or 96 (default: 48)\n"
    "      --iterations N          lpv: how many cells far; dom: how often it is scattered anew\n"
    "                              (default: until it converged)\n"
    "      --blockers KIND         what keeps LPV's light from passing surfaces: links (exact,\n"
    "                              the default) or fuzzy (as published, leaks; to compare)\n"
    "      --memory-budget MIB     on the GPU (default: 2048)\n"
    "\n"
    "Output\n"
    "      --passes LIST           further layers of the picture: all, or of depth,normal,volumedir,\n"
    "                              emit,env,transmittance,volumeind\n"
    "      --transparent           alpha tells coverage, the world is not drawn\n"
    "      --stats                 print stage times and memory\n"
    "  -v, --verbose               print what the library says\n"
    "  -h, --help                  this text\n"
    "      --version               the program's version\n"
    "\n"
    "Ends with 0 when the picture is written, 1 when it could not be, 2 when the command line is\n"
    "wrong and 130 after Ctrl-C.\n"
    "\n"
    "  brume-render --sun 0.4,0.6,-1 --albedo 0.99 --density-scale 8 -o cloud.exr cloud.vdb\n"
    "  brume-render --temperature temperature --background 0 --floor 0.3 -o fire.exr fire.vdb\n";

__attribute__((format(printf, 1, 2))) static bool usage_error(const char *format, ...)
{
    va_list arguments;

    fputs("brume-render: ", stderr);
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fputs(" (--help tells more)\n", stderr);
    return false;
}

/* A finite number at *text, which moves behind it. strtod alone takes NaN, infinities and blanks. */
static bool scan_number(const char **text, float *out)
{
    char *end;
    double value = strtod(*text, &end);
    if (end == *text || !isfinite(value) || fabs(value) > 1e30)
        return false;
    *text = end;
    *out = (float)value;
    return true;
}

static bool parse_number(const char *option, const char *text, float lower, float upper, float *out)
{
    const char *rest = text;
    float value;
    if (!scan_number(&rest, &value) || *rest != '\0')
        return usage_error("--%s wants a number, not '%s'", option, text);
    if (value < lower || value > upper)
        return usage_error("--%s must be from %g to %g, not %s", option, lower, upper, text);
    *out = value;
    return true;
}

static bool parse_degrees(const char *option, const char *text, float lower, float upper,
                          float *radians)
{
    float degrees;
    if (!parse_number(option, text, lower, upper, &degrees))
        return false;
    *radians = RADIANS(degrees);
    return true;
}

static bool parse_integer(const char *option, const char *text, long long lower, long long upper,
                          long long *out)
{
    char *end;
    errno = 0;
    long long value = strtoll(text, &end, 10);
    if (end == text || *end != '\0')
        return usage_error("--%s wants a whole number, not '%s'", option, text);
    if (errno == ERANGE || value < lower || value > upper)
        return usage_error("--%s must be from %lld to %lld, not %s", option, lower, upper, text);
    *out = value;
    return true;
}

static bool parse_count(const char *option, const char *text, int32_t upper, int32_t *out)
{
    long long value;
    if (!parse_integer(option, text, 1, upper, &value))
        return false;
    *out = (int32_t)value;
    return true;
}

static bool parse_vector(const char *option, const char *text, float out[3])
{
    const char *rest = text;
    float value[3];
    for (int i = 0; i < 3; i++) {
        if (!scan_number(&rest, &value[i]) || *rest != (i < 2 ? ',' : '\0'))
            return usage_error("--%s wants three numbers X,Y,Z, not '%s'", option, text);
        rest++;
    }
    memcpy(out, value, sizeof value);
    return true;
}

static bool parse_color(const char *option, const char *text, float upper, float out[3])
{
    const char *rest = text;
    float value[3];
    if (scan_number(&rest, &value[0]) && *rest == '\0')
        value[1] = value[2] = value[0];
    else if (!parse_vector(option, text, value))
        return false;
    for (int i = 0; i < 3; i++)
        if (value[i] < 0.0f || value[i] > upper)
            return usage_error("--%s must be from 0 to %g, not %s", option, upper, text);
    memcpy(out, value, sizeof value);
    return true;
}

static bool parse_size(const char *option, const char *text, options *out)
{
    int end = 0;
    int width, height;
    if (sscanf(text, "%6dx%6d%n", &width, &height, &end) != 2 || text[end] != '\0')
        return usage_error("--%s wants WIDTHxHEIGHT, not '%s'", option, text);
    if (width < 1 || height < 1 || width > 16384 || height > 16384)
        return usage_error("--%s must be from 1x1 to 16384x16384, not %s", option,
                           text);
    out->width = width;
    out->height = height;
    return true;
}

/* A word of the list, in any case. */
static bool pass_matches(const char *name, const char *word, size_t length)
{
    return strlen(name) == length && strncasecmp(name, word, length) == 0;
}

static bool parse_passes(const char *option, const char *text, options *out)
{
    for (const char *word = text;; word++) {
        size_t length = strcspn(word, ",");
        uint32_t bits = 0;
        for (uint32_t pass = 0; pass < BRUME_PASS_COUNT; pass++)
            if (pass_matches("all", word, length) ||
                pass_matches(brume_pass_name(pass), word, length))
                bits |= 1u << pass;
        if (bits == 0)
            return usage_error("--%s: there is no pass '%.*s'", option, (int)length, word);
        out->passes |= bits;
        word += length;
        if (*word == '\0')
            return true;
    }
}

/* Starts a lamp of white light. */
static brume_light *add_light(options *out, uint32_t type, float strength)
{
    if (out->light_count == OPTION_LIGHTS_MAX) {
        usage_error("there may be %d lamps at most", OPTION_LIGHTS_MAX);
        return NULL;
    }
    brume_light *light = &out->lights[out->light_count++];
    *light = (brume_light){
        .name = type == BRUME_LIGHT_SUN ? "sun" : "point",
        .type = type,
        .power = {strength, strength, strength},
        .diffuse_factor = 1.0f,
        .specular_factor = 1.0f,
        .volume_factor = 1.0f,
        .cast_shadow = 1,
    };
    for (int i = 0; i < 4; i++)
        light->world_from_light[i * 5] = 1.0f;
    out->lamp_strength = strength;
    out->lamp_color[0] = out->lamp_color[1] = out->lamp_color[2] = 1.0f;
    return light;
}

/* Turns the lamp's -Z along the direction, which need not be of unit length; a sun looks the same
 * however it is rolled about that. */
static void aim(brume_light *light, const float direction[3])
{
    float length = hypotf(hypotf(direction[0], direction[1]), direction[2]);
    float z[3] = {-direction[0] / length, -direction[1] / length, -direction[2] / length};
    bool steep = fabsf(z[2]) > 0.9f;
    float x[3] = {steep ? z[2] : -z[1], steep ? 0.0f : z[0], steep ? -z[0] : 0.0f};
    float x_length = hypotf(hypotf(x[0], x[1]), x[2]);

    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        light->world_from_light[i] = x[i] / x_length;
        light->world_from_light[4 + i] = (z[j] * x[k] - z[k] * x[j]) / x_length;
        light->world_from_light[8 + i] = z[i];
    }
}

bool options_add_sun(options *out, const float direction[3])
{
    brume_light *light = add_light(out, BRUME_LIGHT_SUN, 3.0f);
    if (light == NULL)
        return false;
    light->angle = RADIANS(0.526f);
    aim(light, direction);
    return true;
}

static bool parse_sun(const char *option, const char *text, options *out)
{
    float direction[3];
    if (!parse_vector(option, text, direction))
        return false;
    if (hypotf(hypotf(direction[0], direction[1]), direction[2]) < 1e-12f)
        return usage_error("--%s wants a direction that is not zero", option);
    return options_add_sun(out, direction);
}

static bool parse_point(const char *option, const char *text, options *out)
{
    float position[3];
    if (!parse_vector(option, text, position))
        return false;
    brume_light *light = add_light(out, BRUME_LIGHT_POINT, 100.0f);
    if (light == NULL)
        return false;
    light->radius = 0.1f;
    memcpy(&light->world_from_light[12], position, sizeof position);
    return true;
}

/* The lamp that the options --power, --angle … change: the last one, if it is of the type. */
static brume_light *last_light(const char *option, const options *out, int type)
{
    const brume_light *light = out->light_count ? &out->lights[out->light_count - 1] : NULL;
    if (light == NULL || (type >= 0 && light->type != (uint32_t)type)) {
        usage_error("--%s must follow the --%s that it changes", option,
                    type == BRUME_LIGHT_SUN     ? "sun"
                    : type == BRUME_LIGHT_POINT ? "point"
                                                : "sun or --point");
        return NULL;
    }
    return (brume_light *)light;
}

static void set_power(brume_light *light, const options *out)
{
    for (int i = 0; i < 3; i++)
        light->power[i] = out->lamp_strength * out->lamp_color[i];
}

static bool parse_strength(const char *option, const char *text, options *out)
{
    int type = strcmp(option, "power") == 0 ? BRUME_LIGHT_POINT : BRUME_LIGHT_SUN;
    brume_light *light = last_light(option, out, type);
    if (light == NULL || !parse_number(option, text, 0.0f, 1e12f, &out->lamp_strength))
        return false;
    set_power(light, out);
    return true;
}

static bool parse_lamp_color(const char *option, const char *text, options *out)
{
    brume_light *light = last_light(option, out, -1);
    if (light == NULL || !parse_color(option, text, 1e6f, out->lamp_color))
        return false;
    set_power(light, out);
    return true;
}

static bool parse_angle(const char *option, const char *text, options *out)
{
    brume_light *light = last_light(option, out, BRUME_LIGHT_SUN);
    return light != NULL && parse_degrees(option, text, 0.0f, 180.0f, &light->angle);
}

static bool parse_radius(const char *option, const char *text, options *out)
{
    brume_light *light = last_light(option, out, BRUME_LIGHT_POINT);
    return light != NULL && parse_number(option, text, 0.0f, 1e6f, &light->radius);
}

static bool parse_seed(const char *option, const char *text, options *out)
{
    long long value;
    if (!parse_integer(option, text, 0, UINT32_MAX, &value))
        return false;
    out->seed = (uint32_t)value;
    return true;
}

static bool parse_memory_budget(const char *option, const char *text, options *out)
{
    long long mebibytes;
    if (!parse_integer(option, text, 1, 1 << 20, &mebibytes))
        return false;
    out->settings.memory_budget = (uint64_t)mebibytes << 20;
    return true;
}

static bool parse_depths(const char *option, const char *text, options *out)
{
    static const char *const ways[] = {[BRUME_DEPTHS_PROPAGATED] = "propagated",
                                       [BRUME_DEPTHS_MARCHED] = "marched",
                                       [BRUME_DEPTHS_CORRECTED] = "corrected",
                                       [BRUME_DEPTHS_PAPER] = "paper"};
    for (uint32_t way = 0; way < sizeof ways / sizeof *ways; ++way)
        if (strcmp(text, ways[way]) == 0) {
            out->settings.depths = way;
            return true;
        }
    usage_error("--%s wants propagated, marched, corrected or paper, not '%s'", option, text);
    return false;
}

static bool parse_method(const char *option, const char *text, options *out)
{
    static const char *const methods[] = {[BRUME_METHOD_OPV] = "opv", [BRUME_METHOD_LPV] = "lpv",
                                          [BRUME_METHOD_DOM] = "dom"};
    for (uint32_t method = 0; method < BRUME_METHOD_COUNT; ++method)
        if (strcmp(text, methods[method]) == 0) {
            out->settings.method = method;
            return true;
        }
    usage_error("--%s wants opv, lpv or dom, not '%s'", option, text);
    return false;
}

static bool parse_ordinates(const char *option, const char *text, options *out)
{
    static const int counts[] = {26, 48, 96};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; ++i) {
        char name[8];
        snprintf(name, sizeof name, "%d", counts[i]);
        if (strcmp(text, name) == 0) {
            out->settings.ordinates = counts[i];
            return true;
        }
    }
    usage_error("--%s wants 26, 48 or 96, not '%s'", option, text);
    return false;
}

static bool parse_blockers(const char *option, const char *text, options *out)
{
    static const char *const kinds[] = {[BRUME_BLOCKERS_LINKS] = "links",
                                        [BRUME_BLOCKERS_FUZZY] = "fuzzy"};
    for (uint32_t kind = 0; kind < BRUME_BLOCKERS_COUNT; ++kind)
        if (strcmp(text, kinds[kind]) == 0) {
            out->settings.blockers = kind;
            return true;
        }
    usage_error("--%s wants links or fuzzy, not '%s'", option, text);
    return false;
}

/* What an option's value is, and so how it is read. */
enum kind {
    KIND_FLAG,     /* bool, no value */
    KIND_TEXT,     /* const char * */
    KIND_NUMBER,   /* float from lower to upper */
    KIND_DEGREES,  /* the same, kept in radians */
    KIND_COUNT,    /* int32_t from 1 to upper */
    KIND_VECTOR,   /* float[3] */
    KIND_COLOR,    /* float[3] from 0 to upper */
    KIND_OWN,      /* read by a function of its own */
};

struct spec {
    const char *name;
    enum kind kind;
    size_t offset; /* into struct options */
    float lower, upper;
    bool (*parse)(const char *option, const char *text, options *out);
    char letter; /* short form, 0: none */
};

#define AT(member) .offset = offsetof(options, member)

static const struct spec specs[] = {
    {"output", KIND_TEXT, AT(output), .letter = 'o'},
    {"list", KIND_FLAG, AT(list), .letter = 'l'},
    {"help", KIND_FLAG, AT(help), .letter = 'h'},
    {"verbose", KIND_FLAG, AT(verbose), .letter = 'v'},
    {"version", KIND_FLAG, AT(version)},
    {"stats", KIND_FLAG, AT(stats)},
    {"transparent", KIND_FLAG, AT(transparent)},
    {"passes", KIND_OWN, .parse = parse_passes},

    {"density", KIND_TEXT, AT(density)},
    {"density-scale", KIND_NUMBER, AT(density_scale), .lower = 0.0f, .upper = 1e9f},
    {"albedo", KIND_COLOR, AT(albedo), .upper = 1.0f},
    {"anisotropy", KIND_NUMBER, AT(anisotropy), .lower = -0.99f, .upper = 0.99f},
    {"emission", KIND_COLOR, AT(emission), .upper = 1e9f},
    {"flame", KIND_TEXT, AT(flame)},
    {"temperature", KIND_TEXT, AT(temperature)},
    {"kelvin", KIND_NUMBER, AT(kelvin), .lower = 0.0f, .upper = 1e6f},
    {"blackbody", KIND_NUMBER, AT(blackbody), .lower = 0.0f, .upper = 1.0f},

    {"sun", KIND_OWN, .parse = parse_sun},
    {"point", KIND_OWN, .parse = parse_point},
    {"irradiance", KIND_OWN, .parse = parse_strength},
    {"power", KIND_OWN, .parse = parse_strength},
    {"angle", KIND_OWN, .parse = parse_angle},
    {"radius", KIND_OWN, .parse = parse_radius},
    {"color", KIND_OWN, .parse = parse_lamp_color},
    {"environment", KIND_TEXT, AT(environment)},
    {"environment-rotation", KIND_DEGREES, AT(environment_rotation), .lower = -3600.0f,
     .upper = 3600.0f},
    {"background", KIND_COLOR, AT(background), .upper = 1e9f},
    {"floor", KIND_COLOR, AT(floor), .upper = 1.0f},

    {"eye", KIND_VECTOR, AT(eye)},
    {"target", KIND_VECTOR, AT(target)},
    {"up", KIND_VECTOR, AT(up)},
    {"fov", KIND_DEGREES, AT(fov), .lower = 0.1f, .upper = 175.0f},
    {"orthographic", KIND_NUMBER, AT(orthographic), .lower = 1e-6f, .upper = 1e9f},
    {"size", KIND_OWN, .parse = parse_size},

    {"samples", KIND_COUNT, AT(samples), .upper = 65536},
    {"seed", KIND_OWN, .parse = parse_seed},
    {"medium-resolution", KIND_COUNT, AT(settings.medium_resolution), .upper = 2048},
    {"lattice-resolution", KIND_COUNT, AT(settings.lattice_resolution), .upper = 1024},
    {"shadow-resolution", KIND_COUNT, AT(settings.shadow_resolution), .upper = 16384},
    {"light-samples", KIND_COUNT, AT(settings.light_samples), .upper = 4096},
    {"world-samples", KIND_COUNT, AT(settings.world_samples), .upper = 4096},
    {"step", KIND_NUMBER, AT(settings.step), .lower = 0.01f, .upper = 100.0f},
    {"half-march", KIND_FLAG, AT(half_march)},
    {"method", KIND_OWN, .parse = parse_method},
    {"field-resolution", KIND_COUNT, AT(settings.field_resolution), .upper = 256},
    {"cascades", KIND_COUNT, AT(settings.cascades), .upper = 3},
    {"ordinates", KIND_OWN, .parse = parse_ordinates},
    {"iterations", KIND_COUNT, AT(settings.iterations), .upper = 100000},
    {"depths", KIND_OWN, .parse = parse_depths},
    {"blockers", KIND_OWN, .parse = parse_blockers},
    {"memory-budget", KIND_OWN, .parse = parse_memory_budget},
};

#define SPEC_COUNT (sizeof specs / sizeof specs[0])

static bool parse_option(const struct spec *spec, const char *text, options *out)
{
    void *member = (char *)out + spec->offset;

    switch (spec->kind) {
    case KIND_FLAG:
        *(bool *)member = true;
        return true;
    case KIND_TEXT:
        *(const char **)member = text;
        return true;
    case KIND_NUMBER:
        return parse_number(spec->name, text, spec->lower, spec->upper, member);
    case KIND_DEGREES:
        return parse_degrees(spec->name, text, spec->lower, spec->upper, member);
    case KIND_COUNT:
        return parse_count(spec->name, text, (int32_t)spec->upper, member);
    case KIND_VECTOR:
        return parse_vector(spec->name, text, member);
    case KIND_COLOR:
        return parse_color(spec->name, text, spec->upper, member);
    case KIND_OWN:
        return spec->parse(spec->name, text, out);
    }
    return false;
}

/* What only shows once all options are read. */
static bool check(const options *given, int operands)
{
    if (operands != 1)
        return usage_error(operands ? "one .vdb file is wanted, not %d" : "a .vdb file is wanted",
                           operands);
    if (!given->list && given->output == NULL)
        return usage_error("--output is wanted: the picture to write");
    return true;
}

bool options_parse(int argc, char **argv, options *out, int *exit_code)
{
    struct option longs[SPEC_COUNT + 1] = {{0}};
    for (size_t i = 0; i < SPEC_COUNT; i++)
        longs[i] = (struct option){
            specs[i].name, specs[i].kind == KIND_FLAG ? no_argument : required_argument, NULL, 0};

    *out = (options){
        .density = "density",
        .density_scale = 1.0f,
        .albedo = {0.9f, 0.9f, 0.9f},
        .kelvin = 1000.0f,
        .blackbody = 1.0f,
        .settings = {.method = BRUME_METHOD_DOM},
        .background = {NAN},
        .floor = {NAN},
        .eye = {NAN},
        .target = {NAN},
        .up = {0.0f, 0.0f, 1.0f},
        .fov = RADIANS(40.0f),
        .width = 640,
        .height = 360,
    };
    *exit_code = 2;
    for (int found, index = 0; (found = getopt_long(argc, argv, ":o:lhv", longs, &index)) != -1;) {
        if (found == '?' || found == ':') {
            usage_error(found == ':' ? "%s wants a value" : "there is no option %s",
                        argv[optind - 1]);
            return false;
        }
        const struct spec *spec = &specs[index];
        for (size_t i = 0; found != 0 && i < SPEC_COUNT; i++)
            if (specs[i].letter == found)
                spec = &specs[i];
        if (!parse_option(spec, optarg, out))
            return false;
    }
    if (out->help || out->version) {
        out->help ? fputs(help, stdout) : printf("brume-render %s\n", BRUME_VERSION);
        *exit_code = fflush(stdout) == 0 ? 0 : 1;
        return false;
    }
    if (!check(out, argc - optind))
        return false;
    out->input = argv[optind];
    return true;
}
