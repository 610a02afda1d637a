/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Scene and view of brume-render, from what its command line says. */
#include "tool/compose.h"

#include <math.h>

/* Keys of the scene's datablocks. */
enum { KEY_MEDIUM = 1, KEY_FLOOR, KEY_ENVIRONMENT, KEY_LIGHTS };

enum { GRID_DENSITY, GRID_FLAME, GRID_TEMPERATURE };

brume_result compose_grids(const options *given, brume_grid *grids[COMPOSE_GRIDS])
{
    const char *names[COMPOSE_GRIDS] = {given->density, given->flame, given->temperature};

    for (int i = 0; i < COMPOSE_GRIDS; i++) {
        if (names[i] == NULL)
            continue;
        brume_result result = brume_grid_load_vdb(given->input, names[i], 0, 0, &grids[i]);
        if (result != BRUME_OK)
            return result;
    }
    return BRUME_OK;
}

/* ---------------------------------------------------------------------------------------------
 * The scene
 */

brume_result compose_bounds(brume_grid *const grids[COMPOSE_GRIDS], compose_box *out)
{
    for (int axis = 0; axis < 3; axis++) {
        out->lower[axis] = INFINITY;
        out->upper[axis] = -INFINITY;
    }
    for (int i = 0; i < COMPOSE_GRIDS; i++) {
        brume_grid_info info;
        if (grids[i] == NULL)
            continue;
        brume_result result = brume_grid_describe(grids[i], &info);
        if (result != BRUME_OK)
            return result;
        for (int corner = 0; corner < 8; corner++) {
            for (int axis = 0; axis < 3; axis++) {
                float value = info.object_from_array[12 + axis];
                for (int j = 0; j < 3; j++)
                    if (corner >> j & 1)
                        value += info.object_from_array[4 * j + axis] * (float)info.dims[j];
                out->lower[axis] = fminf(out->lower[axis], value);
                out->upper[axis] = fmaxf(out->upper[axis], value);
            }
        }
    }
    for (int axis = 0; axis < 3; axis++)
        out->center[axis] = 0.5f * (out->lower[axis] + out->upper[axis]);
    out->radius = 0.5f * sqrtf(powf(out->upper[0] - out->lower[0], 2.0f) +
                               powf(out->upper[1] - out->lower[1], 2.0f) +
                               powf(out->upper[2] - out->lower[2], 2.0f));
    return BRUME_OK;
}

#define CONSTANT(to, r, g, b) {.op = BRUME_OP_CONSTANT, .dst = to, .value = {r, g, b}}
#define GRID(to, number) {.op = BRUME_OP_GRID, .dst = to, .a = number}
#define MULTIPLY(to, x, y) {.op = BRUME_OP_MULTIPLY, .dst = to, .a = x, .b = y}
#define MULTIPLY_ADD(to, x, y, z) {.op = BRUME_OP_MULTIPLY_ADD, .dst = to, .a = x, .b = y, .c = z}

/* The medium's coefficients from its grids, as Principled Volume has them: extinction by density;
 * emission by flame and, after Stefan and Boltzmann, by temperature. */
static brume_result set_medium(brume_scene *scene, const options *given,
                               brume_grid *const grids[COMPOSE_GRIDS])
{
    /* W/(m^2 K^4 sr), and the 1e-6 that Blender scales it by */
    const float sigma = 5.670373e-8f * 1e-6f / 3.14159265f;
    const float black = grids[GRID_TEMPERATURE] ? given->blackbody : 0.0f;
    const float *albedo = given->albedo, *emission = given->emission;
    enum { DENSITY, SCALE, SIGMA_T, ALBEDO, SIGMA_S, SIGMA_A, G, GLOW, EMISSION, FLAME, HEAT,
           KELVIN, ZERO, SQUARE, COLOR, BIAS, FACTOR };
    const brume_instruction instructions[] = {
        GRID(DENSITY, GRID_DENSITY),
        CONSTANT(SCALE, given->density_scale, given->density_scale, given->density_scale),
        MULTIPLY(SIGMA_T, DENSITY, SCALE),
        CONSTANT(ALBEDO, albedo[0], albedo[1], albedo[2]),
        MULTIPLY(SIGMA_S, SIGMA_T, ALBEDO),
        {.op = BRUME_OP_SUBTRACT, .dst = SIGMA_A, .a = SIGMA_T, .b = SIGMA_S},
        CONSTANT(G, given->anisotropy, given->anisotropy, given->anisotropy),

        CONSTANT(GLOW, emission[0], emission[1], emission[2]),
        GRID(FLAME, grids[GRID_FLAME] ? GRID_FLAME : GRID_DENSITY),
        MULTIPLY(EMISSION, GLOW, FLAME),

        /* a missing grid reads as 0, and so does the intensity of what has no temperature */
        GRID(HEAT, GRID_TEMPERATURE),
        CONSTANT(KELVIN, given->kelvin, given->kelvin, given->kelvin),
        MULTIPLY(HEAT, HEAT, KELVIN),
        CONSTANT(ZERO, 0.0f, 0.0f, 0.0f),
        {.op = BRUME_OP_MAXIMUM, .dst = HEAT, .a = HEAT, .b = ZERO},
        {.op = BRUME_OP_BLACKBODY, .dst = COLOR, .a = HEAT},
        MULTIPLY(SQUARE, HEAT, HEAT),
        MULTIPLY(SQUARE, SQUARE, SQUARE),
        CONSTANT(FACTOR, sigma * black, sigma * black, sigma * black),
        CONSTANT(BIAS, black > 0.0f ? sigma * (1.0f - black) : 0.0f,
                 black > 0.0f ? sigma * (1.0f - black) : 0.0f,
                 black > 0.0f ? sigma * (1.0f - black) : 0.0f),
        MULTIPLY_ADD(FACTOR, SQUARE, FACTOR, BIAS),
        MULTIPLY_ADD(EMISSION, COLOR, FACTOR, EMISSION),
    };
    brume_volume volume = {
        .name = given->input,
        .grids = grids,
        .grid_count = COMPOSE_GRIDS,
        .program = {.instructions = instructions,
                    .instruction_count = sizeof instructions / sizeof instructions[0],
                    .sigma_s = SIGMA_S,
                    .sigma_a = SIGMA_A,
                    .g = G,
                    .emission = EMISSION},
    };
    for (int i = 0; i < 4; i++)
        volume.world_from_object[i * 5] = 1.0f;
    return brume_scene_set_volume(scene, KEY_MEDIUM, &volume);
}

/* A matt square right under the medium, far wider than it. */
static brume_result set_floor(brume_scene *scene, const options *given, const compose_box *box)
{
    const float reach = 20.0f * box->radius;
    const float x = box->center[0], y = box->center[1], z = box->lower[2];
    const float positions[] = {x - reach, y - reach, z, x + reach, y - reach, z,
                               x + reach, y + reach, z, x - reach, y + reach, z};
    const uint32_t triangles[] = {0, 1, 2, 0, 2, 3};
    const uint64_t material_key = KEY_FLOOR;
    const float identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    const brume_material material = {
        .name = "floor",
        .diffuse = {given->floor[0], given->floor[1], given->floor[2]},
        .transparent = {1.0f, 1.0f, 1.0f},
        .roughness = 1.0f,
        .alpha = 1.0f,
    };
    const brume_mesh mesh = {
        .name = "floor",
        .positions = positions,
        .triangles = triangles,
        .materials = &material_key,
        .vertex_count = 4,
        .triangle_count = 2,
        .material_count = 1,
    };
    const brume_instances instances = {
        .world_from_object = identity,
        .mesh = KEY_FLOOR,
        .count = 1,
        .visibility = BRUME_VISIBLE_CAMERA | BRUME_VISIBLE_SHADOW,
    };
    brume_result result = brume_scene_set_material(scene, KEY_FLOOR, &material);
    if (result == BRUME_OK)
        result = brume_scene_set_mesh(scene, KEY_FLOOR, &mesh);
    if (result == BRUME_OK)
        result = brume_scene_set_instances(scene, KEY_FLOOR, &instances);
    return result;
}

static brume_result set_environment(brume_scene *scene, const char *path)
{
    brume_image image = {.name = path, .extend = BRUME_EXTEND_REPEAT};
    float *pixels = NULL;
    brume_result result = brume_exr_read(path, &image.width, &image.height, &pixels);
    if (result == BRUME_OK) {
        image.pixels = pixels;
        result = brume_scene_set_image(scene, KEY_ENVIRONMENT, &image);
        brume_free(pixels);
    }
    return result;
}

static brume_result set_world(brume_scene *scene, const options *given)
{
    const float fallback = given->environment ? 1.0f : 0.0f;
    const float c = cosf(given->environment_rotation), s = sinf(given->environment_rotation);
    brume_world world = {
        .image_from_world = {c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
    };
    for (int i = 0; i < 3; i++)
        world.color[i] = isnan(given->background[0]) ? fallback : given->background[i];
    if (given->environment != NULL) {
        brume_result result = set_environment(scene, given->environment);
        if (result != BRUME_OK)
            return result;
        world.image = KEY_ENVIRONMENT;
    }
    return brume_scene_set_world(scene, &world);
}

brume_result compose_scene(brume_scene *scene, const options *given,
                                brume_grid *const grids[COMPOSE_GRIDS], const compose_box *box)
{
    brume_result result = set_medium(scene, given, grids);
    if (result == BRUME_OK && !isnan(given->floor[0]))
        result = set_floor(scene, given, box);
    if (result == BRUME_OK)
        result = set_world(scene, given);
    for (uint32_t i = 0; i < given->light_count && result == BRUME_OK; i++)
        result = brume_scene_set_light(scene, KEY_LIGHTS + i, &given->lights[i]);
    return result;
}

/* ---------------------------------------------------------------------------------------------
 * The camera
 */

static float normalize(float v[3])
{
    float length = sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3 && length > 0.0f; i++)
        v[i] /= length;
    return length;
}

static void cross(const float a[3], const float b[3], float out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

/* Fills in the eye and the target that were not given, so that the medium's sphere fits. */
static void frame_medium(const options *given, const compose_box *box, float eye[3], float target[3])
{
    const float from[3] = {0.33f, -0.90f, 0.28f}; /* about unit length: in front, a little above */
    const float narrow = fminf(1.0f, (float)given->width / (float)given->height);
    const float half = atanf(tanf(0.5f * given->fov) * narrow);
    const float distance = 1.05f * box->radius / sinf(half);

    for (int i = 0; i < 3; i++) {
        target[i] = isnan(given->target[0]) ? box->center[i] : given->target[i];
        eye[i] = isnan(given->eye[0]) ? target[i] + distance * from[i] : given->eye[i];
    }
}

bool compose_view(const options *given, const compose_box *box, brume_view *out)
{
    float eye[3], target[3], back[3], right[3], up[3], to_center[3];
    const float aspect = (float)given->width / (float)given->height;
    const float others[2][3] = {{0.0f, 1.0f, 0.0f}, {0.0f, 0.0f, 1.0f}};

    frame_medium(given, box, eye, target);
    for (int i = 0; i < 3; i++) {
        back[i] = eye[i] - target[i];
        to_center[i] = box->center[i] - eye[i];
    }
    if (!(normalize(back) > 1e-6f * box->radius))
        return false;
    /* a view along `up` has no upright: Y then, or Z */
    cross(given->up, back, right);
    for (int i = 0; i < 2 && !(normalize(right) > 1e-5f); i++)
        cross(others[i], back, right);
    normalize(right);
    cross(back, right, up);

    *out = (brume_view){
        .width = given->width,
        .height = given->height,
        .samples = (uint32_t)given->samples,
        .seed = given->seed,
        .film_transparent = given->transparent,
        .half_march = given->half_march,
        .passes = given->passes | 1u << BRUME_PASS_COMBINED,
    };
    const float *axes[3] = {right, up, back};
    for (int row = 0; row < 3; row++)
        for (int i = 0; i < 3; i++) {
            out->view_from_world[4 * i + row] = axes[row][i];
            out->view_from_world[12 + row] -= axes[row][i] * eye[i];
        }
    out->view_from_world[15] = 1.0f;

    /* the far plane lies behind the floor's edge */
    const float distance = normalize(to_center);
    const float near_ = 1e-3f * fmaxf(distance, box->radius);
    const float far_ = distance + 30.0f * box->radius;
    float *clip = out->clip_from_view;
    if (given->orthographic > 0.0f) {
        clip[0] = 2.0f / (given->orthographic * aspect);
        clip[5] = 2.0f / given->orthographic;
        clip[10] = -2.0f / (far_ - near_);
        clip[14] = -(far_ + near_) / (far_ - near_);
        clip[15] = 1.0f;
    } else {
        clip[5] = 1.0f / tanf(0.5f * given->fov);
        clip[0] = clip[5] / aspect;
        clip[10] = -(far_ + near_) / (far_ - near_);
        clip[11] = -1.0f;
        clip[14] = -2.0f * far_ * near_ / (far_ - near_);
    }
    out->clip_near = near_;
    out->clip_far = far_;
    return true;
}
