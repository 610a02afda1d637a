/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Laying out the lattices. */
#include "render/lattice.h"
#include "base/result.h"
#include "math/frame.h"
#include "scene/pack.h"
#include "transport/depths.h"
#include "transport/dom.h"
#include "transport/lpv.h"

#include <math.h>
#include <string.h>

#define SKY_NODE_BYTES 24 /* three times four halves */
#define FAR 1e30f
#define FLAT_MOST 20.0f /* times as long as what stands among it */
#define MOST_PARTS 4 /* of a cell's side in a lattice within */

struct box {
    float lower[3], upper[3];
};

static int box_is_empty(const struct box *box)
{
    return !(box->lower[0] <= box->upper[0]);
}

static void box_join(struct box *box, const float lower[3], const float upper[3])
{
    for (int i = 0; i < 3; ++i) {
        box->lower[i] = fminf(box->lower[i], lower[i]);
        box->upper[i] = fmaxf(box->upper[i], upper[i]);
    }
}

static float longest(const struct box *box)
{
    float side = 0.0f;
    for (int i = 0; i < 3; ++i)
        side = fmaxf(side, box->upper[i] - box->lower[i]);
    return side;
}

/* Nodes along the sides of a box for a number of cells along its longest. */
static float nodes_of(const struct box *box, int resolution, ivec4 *dims)
{
    const float cell = fmaxf(longest(box), 1e-6f) / (float)resolution;
    int *out = &dims->x;
    for (int i = 0; i < 3; ++i) {
        const int cells = (int)ceilf((box->upper[i] - box->lower[i]) / cell - 1e-3f);
        out[i] = (cells < 1 ? 1 : cells) + 1;
    }
    dims->w = 1;
    return cell;
}

static uint64_t texels_of(const ivec4 *dims)
{
    return (uint64_t)texture_side(dims->x) * (uint64_t)texture_side(dims->y) *
           (uint64_t)texture_side(dims->z);
}

static void join_lamps(struct box *box, const struct snapshot *snapshot)
{
    const struct table *lights = &snapshot->tables[BRUME_KIND_LIGHT];
    for (uint32_t i = 0; i < lights->count; ++i) {
        const brume_light *light = &((struct light_block *)lights->entries[i].block)->light;
        if (light->type != BRUME_LIGHT_SUN)
            box_join(box, light->world_from_light + 12, light->world_from_light + 12);
    }
}

/* Everything that the scene shows, lamps included: what the world's medium should fill. */
static struct box scene_box(const struct renderer *renderer, const struct snapshot *snapshot)
{
    struct box box = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    const struct geometry *geometry = &renderer->geometry;
    if (geometry->lower[0] <= geometry->upper[0])
        box_join(&box, geometry->lower, geometry->upper);
    if (renderer->medium.dims[0])
        box_join(&box, renderer->medium.lower, renderer->medium.upper);
    join_lamps(&box, snapshot);
    if (box_is_empty(&box))
        box = (struct box){{-10, -10, -10}, {10, 10, 10}};
    return box;
}

static float diagonal(const struct box *box)
{
    float square = 0.0f;
    for (int i = 0; i < 3; ++i)
        square += (box->upper[i] - box->lower[i]) * (box->upper[i] - box->lower[i]);
    return sqrtf(square);
}

static void layout_fog(struct renderer *renderer, const struct snapshot *snapshot, uint32_t method)
{
    struct gpu_frame *frame = &renderer->frame;
    const brume_world *world = &snapshot->world;
    if (!world->has_volume)
        return;
    struct box box = scene_box(renderer, snapshot);
    const int unlimited = world->reach < 0.0f;
    const float margin = unlimited             ? 1e7f
                         : world->reach > 0.0f ? world->reach
                                               : fmaxf(0.5f * diagonal(&box), 1.0f);
    for (int i = 0; i < 3; ++i) {
        box.lower[i] -= margin;
        box.upper[i] += margin;
    }
    float sigma_t[3];
    const float share = method == BRUME_METHOD_DOM ? medium_forward_share(world->g) : 0.0f;
    for (int c = 0; c < 3; ++c)
        sigma_t[c] = (1.0f - share) * world->sigma_s[c] + world->sigma_a[c];
    frame->fog_lower = pack(box.lower, 1.0f);
    frame->fog_upper = pack(box.upper, unlimited ? 1.0f : 0.0f);
    frame->fog_sigma_s = pack(world->sigma_s, world->g);
    frame->fog_sigma_t = pack(sigma_t, 0.0f);
    frame->fog_emission = pack(world->emission, 0.0f);
}

/* Tiles stack along z as far as a texture goes, then along y. */
static int layout_tiles(struct renderer *renderer, int limit)
{
    const ivec4 dims = renderer->frame.lattice_dims;
    struct shadows *shadows = &renderer->shadows;
    const int per_column = limit / dims.z;
    const int columns = limit / dims.y;
    uint32_t tile = 0;
    for (uint32_t i = 0; i < shadows->light_count; ++i) {
        struct gpu_light *light = &shadows->lights[i];
        const int dark =
            light->radiance.x <= 0.0f && light->radiance.y <= 0.0f && light->radiance.z <= 0.0f;
        light->info.w = !dark;
        if (dark)
            continue;
        light->info.y = (tile / (uint32_t)per_column) * (uint32_t)dims.y;
        light->info.z = (tile % (uint32_t)per_column) * (uint32_t)dims.z;
        ++tile;
    }
    const int used_columns = ((int)tile + per_column - 1) / per_column;
    renderer->tau_size[0] = tile ? texture_side(dims.x) : 0;
    renderer->tau_size[1] = texture_side(used_columns * dims.y);
    renderer->tau_size[2] =
        texture_side(((int)tile < per_column ? (int)tile : per_column) * dims.z);
    return used_columns <= columns;
}

static uint64_t tau_bytes(const struct renderer *renderer)
{
    const int *size = renderer->tau_size;
    return (uint64_t)size[0] * (uint64_t)size[1] * (uint64_t)size[2] * DEPTH_NODE_BYTES;
}

uint64_t lattice_depth_bytes(const struct renderer *renderer, const brume_settings *settings)
{
    const uint64_t nodes = (uint64_t)settings->lattice_resolution + 3;
    /* Twice: the last column of tiles may be nearly empty. And what is needed beside them. */
    return nodes * nodes * nodes * DEPTH_NODE_BYTES * 2 *
               ((uint64_t)renderer->shadows.light_count + 9) +
           (1u << 20);
}

/* Half as fine as the lamps' lattice. What is scattered once more shows more of what the nodes cut off
 * at the rim of thick media: where light goes on, not below 32. */
static int sky_resolution(const brume_settings *settings, int resolution)
{
    const int half = resolution / 2 < 4 ? 4 : resolution / 2;
    if (settings->method == BRUME_METHOD_OPV)
        return half;
    const int most = resolution < 32 ? resolution : 32;
    return half < most ? most : half;
}

uint64_t lattice_sky_bytes(const brume_settings *settings)
{
    const uint64_t nodes =
        (uint64_t)sky_resolution(settings, settings->lattice_resolution) + 7;
    return nodes * nodes * nodes * SKY_NODE_BYTES;
}

int lattice_wants_field(const brume_settings *settings)
{
    if (settings->method == BRUME_METHOD_DOM)
        return 1;
    return settings->method == BRUME_METHOD_LPV && settings->light_paths != BRUME_PATHS_DIRECT &&
           settings->light_paths != BRUME_PATHS_SINGLE;
}

uint64_t lattice_field_bytes(const struct renderer *renderer, const brume_settings *settings)
{
    const struct gpu_frame *frame = &renderer->frame;
    uint64_t each = FIELD_CELL_BYTES + FIELD_WORKING_BYTES +
                    (settings->blockers == BRUME_BLOCKERS_FUZZY ? FIELD_FUZZY_BYTES : 0);
    if (settings->method == BRUME_METHOD_DOM)
        each = DOM_CELL_BYTES + DOM_WORKING_BYTES +
               (uint64_t)settings->ordinates *
                   (DOM_ORDINATE_BYTES + (frame->field.x > 1 ? DOM_AROUND_BYTES : 0));
    uint64_t cells = 0, slices = 0;
    for (int i = 0; i < frame->field.x; ++i) {
        const ivec4 dims = frame->fields[i].dims;
        const uint64_t side = (uint64_t)dom_longest_side(&dims) + 2;
        if (settings->method == BRUME_METHOD_DOM)
            slices += side * side * (uint64_t)settings->ordinates * DOM_SLICE_BYTES;
        cells += (uint64_t)dims.x * (uint64_t)dims.y * (uint64_t)dims.z;
    }
    return cells * each + slices + FIELD_FIXED_BYTES;
}

static void box_grow(struct box *box, float margin)
{
    for (int i = 0; i < 3; ++i) {
        box->lower[i] -= margin;
        box->upper[i] += margin;
    }
}

static void box_cut(struct box *box, const float lower[3], const float upper[3])
{
    for (int i = 0; i < 3; ++i) {
        box->lower[i] = fmaxf(box->lower[i], lower[i]);
        box->upper[i] = fminf(box->upper[i], upper[i]);
    }
}

/* Of a medium without end what light hardly comes back from behind: twice as far around what stands in
 * it, lamps included, as light goes, but not so far that cells become coarse. */
static struct box endless_box(const struct renderer *renderer, const struct snapshot *snapshot,
                              struct box box)
{
    const vec4 sigma = renderer->frame.fog_sigma_t;
    const float most = fmaxf(fmaxf(sigma.x, fmaxf(sigma.y, sigma.z)), 1e-9f);
    join_lamps(&box, snapshot);
    if (box_is_empty(&box))
        box = scene_box(renderer, snapshot);
    box_grow(&box, fminf(2.0f / most, fmaxf(3.0f * diagonal(&box), 1.0f)));
    return box;
}

static bool has_flat(const struct geometry *geometry, int axis)
{
    return geometry->flat_lower[axis][0] <= geometry->flat_upper[axis][0];
}

/* Adds what is flat, walls, floors and ceilings, if there is some across several axes: not what makes
 * the box more than twice as long, as a wide ground does, nor all that makes what stands in the box
 * smaller than a cell or two. */
static void join_flat(struct box *box, const struct geometry *geometry)
{
    struct box whole = *box;
    if (has_flat(geometry, 0) + has_flat(geometry, 1) + has_flat(geometry, 2) < 2)
        return;
    for (int axis = 0; axis < 3; ++axis) {
        struct box others = *box, all;
        for (int i = 0; i < 3; ++i)
            if (i != axis && has_flat(geometry, i))
                box_join(&others, geometry->flat_lower[i], geometry->flat_upper[i]);
        all = others;
        if (has_flat(geometry, axis))
            box_join(&all, geometry->flat_lower[axis], geometry->flat_upper[axis]);
        if (has_flat(geometry, axis) && longest(&all) < 2.0f * longest(&others))
            box_join(&whole, geometry->flat_lower[axis], geometry->flat_upper[axis]);
    }
    if (box_is_empty(box) || longest(&whole) < FLAT_MOST * longest(box))
        *box = whole;
}

/* Adds what flat things that glow light, as far as there is anything. */
static void join_glow(struct box *box, const struct geometry *geometry)
{
    struct box whole = *box, glow = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    box_join(&glow, geometry->glow_lower, geometry->glow_upper);
    if (box_is_empty(&glow))
        return;
    box_cut(&glow, geometry->lower, geometry->upper);
    box_join(&whole, glow.lower, glow.upper);
    if (box_is_empty(box) || longest(&whole) < FLAT_MOST * longest(box))
        *box = whole;
}

/* Where light goes to and fro: what is solid, the media, flat things that glow or surround all this,
 * and what of the ground is around them. With the world's medium, all that the scene shows. */
static struct box field_box(const struct renderer *renderer, const struct snapshot *snapshot,
                            uint32_t method)
{
    const struct geometry *geometry = &renderer->geometry;
    const int fog = renderer->frame.fog_lower.w != 0.0f;
    struct box box = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    const struct medium_textures *medium = &renderer->medium;
    if (geometry->solid_lower[0] <= geometry->solid_upper[0])
        box_join(&box, geometry->solid_lower, geometry->solid_upper);
    if (medium->dims[0])
        box_join(&box, medium->lower, medium->upper);
    if (method == BRUME_METHOD_DOM) /* else it lights nothing */
        join_glow(&box, geometry);
    join_flat(&box, geometry);
    if (fog && method == BRUME_METHOD_DOM) {
        const vec4 low = renderer->frame.fog_lower, high = renderer->frame.fog_upper;
        return high.w != 0.0f ? endless_box(renderer, snapshot, box)
                              : (struct box){{low.x, low.y, low.z}, {high.x, high.y, high.z}};
    }
    if (box_is_empty(&box))
        return fog ? scene_box(renderer, snapshot) : box;
    struct box all = box;
    if (geometry->lower[0] <= geometry->upper[0])
        box_join(&all, geometry->lower, geometry->upper);
    box_grow(&box, 0.25f * longest(&box));
    box_cut(&box, all.lower, all.upper);
    return box;
}

/* The box in the middle, and along its longest side nothing but it: walls, which are often its sides,
 * are where cells end. */
static struct gpu_field whole_field(const struct box *box, int resolution)
{
    const float cell = fmaxf(longest(box), 1e-6f) / ((float)resolution - 0.02f);
    struct gpu_field field = {.lower = {.w = cell},
                              .keep_lower = {-FAR, -FAR, -FAR, 0},
                              .keep_upper = {FAR, FAR, FAR, 0}};
    for (int i = 0; i < 3; ++i) {
        const int needed = (int)ceilf((box->upper[i] - box->lower[i]) / cell);
        const int dims = needed < 1 ? 1 : needed;
        (&field.dims.x)[i] = dims;
        (&field.lower.x)[i] = 0.5f * (box->lower[i] + box->upper[i] - (float)dims * cell);
    }
    return field;
}

static bool is_within(const struct box *box, const float lower[3], const float upper[3])
{
    bool within = true;
    for (int i = 0; i < 3; ++i)
        within = within && lower[i] <= box->lower[i] && box->upper[i] <= upper[i];
    return within;
}

/* Where media end within the lattice, as a cube of fog on the ground does, cells end with them: one
 * that is filled in part is thin all over, and a thick medium's lit side would not be where it is. For
 * that cells grow or shrink a little, and the lattice may become a cell longer on each side. Not in
 * rooms, for whose walls the lattice is laid out. */
static void fit_field(struct gpu_field *field, const struct box *box,
                      const struct renderer *renderer)
{
    const struct medium_textures *medium = &renderer->medium;
    const struct geometry *geometry = &renderer->geometry;
    if (!medium->dims[0])
        return;
    const struct box fog = {{medium->lower[0], medium->lower[1], medium->lower[2]},
                            {medium->upper[0], medium->upper[1], medium->upper[2]}};
    const float cells = floorf(longest(&fog) / field->lower.w + 0.3f);
    if (cells < 4.0f || longest(&fog) > 0.9f * longest(box) ||
        is_within(&fog, geometry->solid_lower, geometry->solid_upper))
        return;
    const float cell = longest(&fog) / cells;
    field->lower.w = cell;
    for (int i = 0; i < 3; ++i) {
        const float before = ceilf((fog.lower[i] - box->lower[i]) / cell - 0.01f);
        const float lower = fog.lower[i] - before * cell;
        const float needed = ceilf((box->upper[i] - lower) / cell - 0.01f);
        (&field->lower.x)[i] = lower;
        (&field->dims.x)[i] = needed < 1.0f ? 1 : (int)needed;
    }
}

/* The point that finer lattices surround: of a box this long, before a camera near its side. */
static void focus_of(const struct renderer *renderer, const struct render_request *request,
                     float length, float focus[3])
{
    const struct medium_textures *medium = &renderer->medium;
    if (request->settings.cascade_focus == BRUME_FOCUS_MEDIUM && medium->dims[0]) {
        for (int i = 0; i < 3; ++i)
            focus[i] = 0.5f * (medium->lower[i] + medium->upper[i]);
        return;
    }
    const float *view = request->view.view_from_world;
    float world[16];
    mat4_invert(view, world); /* checked when the request was made */
    for (int i = 0; i < 3; ++i)
        focus[i] = world[12 + i] - view[4 * i + 2] * (0.4f * length);
}

/* Of whole cells of the one around it: on each axis as many as `cells` says from `first` on, each parted
 * into `parts`. Where both end nothing gives way. */
static struct gpu_field field_within(const struct gpu_field *around, const int first[3],
                                     const int cells[3], int parts)
{
    struct gpu_field field = {.lower = {.w = around->lower.w / (float)parts}};
    for (int i = 0; i < 3; ++i) {
        const float lower = (&around->lower.x)[i] + (float)first[i] * around->lower.w;
        const float upper = lower + (float)cells[i] * around->lower.w;
        const bool ends = first[i] + cells[i] == (&around->dims.x)[i];
        (&field.dims.x)[i] = parts * cells[i];
        (&field.lower.x)[i] = lower;
        (&field.keep_lower.x)[i] =
            first[i] == 0 ? (&around->keep_lower.x)[i] : lower + 0.5f * field.lower.w;
        (&field.keep_upper.x)[i] =
            ends ? (&around->keep_upper.x)[i] : upper - 0.5f * field.lower.w;
    }
    field.dims.w = around->dims.w + around->dims.z;
    return field;
}

/* Half as long as the one around it. It follows the focus in steps, so that small moves change
 * nothing. */
static struct gpu_field field_half(const struct gpu_field *around, const float focus[3])
{
    int first[3], cells[3];
    for (int i = 0; i < 3; ++i) {
        const int all = (&around->dims.x)[i];
        cells[i] = (all + 1) / 2;
        const int step = cells[i] / 8 ? cells[i] / 8 : 1;
        const float off = (focus[i] - (&around->lower.x)[i]) / around->lower.w;
        const float wanted = (off - 0.5f * (float)cells[i]) / (float)step;
        first[i] = (int)floorf(fmaxf(fminf(wanted, 1e6f), 0.0f) + 0.5f) * step;
        first[i] = first[i] < all - cells[i] ? first[i] : all - cells[i];
    }
    return field_within(around, first, cells, 2);
}

/* Around the media, where they are so small in the lattice that with cells half as long or shorter
 * another is about as long as that; a little longer than the media, for what gives way. */
static bool field_of_medium(const struct medium_textures *medium, const struct gpu_field *around,
                            int resolution, struct gpu_field *out)
{
    const struct box fog = {{medium->lower[0], medium->lower[1], medium->lower[2]},
                            {medium->upper[0], medium->upper[1], medium->upper[2]}};
    const float cell = around->lower.w;
    const float fit = (float)(resolution - FIELD_GIVES_WAY) * cell / longest(&fog) + 0.01f;
    const int parts = fit < MOST_PARTS ? (int)fit : MOST_PARTS;
    if (parts < 2)
        return false;
    int first[3], cells[3];
    for (int i = 0; i < 3; ++i) {
        const float margin = FIELD_GIVES_WAY / (float)parts - 0.01f;
        const float low = (fog.lower[i] - (&around->lower.x)[i]) / cell - margin;
        const float high = (fog.upper[i] - (&around->lower.x)[i]) / cell + margin;
        const float all = (float)(&around->dims.x)[i];
        first[i] = (int)floorf(fmaxf(low, 0.0f));
        cells[i] = (int)ceilf(fminf(high, all)) - first[i];
    }
    *out = field_within(around, first, cells, parts);
    return true;
}

/* The lattices within the first. */
static void layout_within(struct renderer *renderer, const struct render_request *request,
                          const struct box *box, int resolution)
{
    struct gpu_frame *frame = &renderer->frame;
    const brume_settings *settings = &request->settings;
    const int asked = settings->cascades;
    frame->field.x = 1;
    frame->field.y = settings->method == BRUME_METHOD_DOM;
    if (!asked) {
        const struct medium_textures *medium = &renderer->medium;
        if (settings->method == BRUME_METHOD_DOM && medium->dims[0] &&
            field_of_medium(medium, &frame->fields[0], resolution, &frame->fields[1]))
            frame->field.x = 2;
        return;
    }
    for (; frame->field.x < asked; ++frame->field.x) {
        const int i = frame->field.x;
        float focus[3];
        focus_of(renderer, request, ldexpf(longest(box), -i), focus);
        frame->fields[i] = field_half(&frame->fields[i - 1], focus);
    }
}

/* Fills frame->fields for as many cells as fit the budget. Returns how many along the longest side. */
static int layout_field(struct renderer *renderer, const struct render_request *request)
{
    struct gpu_frame *frame = &renderer->frame;
    const brume_settings *settings = &request->settings;
    const struct box box = field_box(renderer, request->snapshot, settings->method);
    frame->field = (ivec4){0};
    memset(frame->fields, 0, sizeof frame->fields);
    if (!lattice_wants_field(settings) || box_is_empty(&box))
        return settings->field_resolution;
    int resolution = settings->field_resolution < 2 ? 2 : settings->field_resolution;
    for (;; resolution = resolution * 3 / 4) {
        frame->fields[0] = whole_field(&box, resolution);
        fit_field(&frame->fields[0], &box, renderer);
        layout_within(renderer, request, &box, resolution);
        if (lattice_field_bytes(renderer, settings) <= renderer->shares.field || resolution <= 4)
            return resolution;
        /* Rather none that was not asked for than all coarser. */
        if (settings->cascades)
            continue;
        frame->field.x = 1;
        if (lattice_field_bytes(renderer, settings) <= renderer->shares.field)
            return resolution;
    }
}

void lattice_place(struct renderer *renderer, const struct render_request *request)
{
    struct gpu_frame *frame = &renderer->frame;
    frame->fog_lower = frame->fog_upper = (vec4){0};
    frame->fog_sigma_s = frame->fog_sigma_t = frame->fog_emission = (vec4){0};
    layout_fog(renderer, request->snapshot, request->settings.method);
    renderer->field_resolution = layout_field(renderer, request);
}

brume_result lattice_layout(const struct gpu *gpu, struct renderer *renderer,
                            const struct render_request *request)
{
    struct gpu_frame *frame = &renderer->frame;
    const struct medium_textures *medium = &renderer->medium;
    const brume_settings *settings = &request->settings;
    frame->medium_dims = (ivec4){0};
    frame->lattice_dims = (ivec4){0};
    frame->sky_dims = (ivec4){0};
    memset(renderer->tau_size, 0, sizeof renderer->tau_size);
    /* No tile is left from a medium that is gone. */
    for (uint32_t i = 0; i < renderer->shadows.light_count; ++i)
        renderer->shadows.lights[i].info.w = 0;
    if (renderer->field_resolution < settings->field_resolution)
        job_warn(request->control, "FIELD_COARSER",
                 "lattice of scattered light of %d instead of %d cells, to keep the memory budget",
                 renderer->field_resolution, settings->field_resolution);
    /* The sky's lattice needs a cell's size to march by, medium or not. */
    frame->medium_lower = (vec4){0, 0, 0, 1};

    int resolution = settings->lattice_resolution;
    if (medium->dims[0]) {
        struct box box;
        memcpy(box.lower, medium->lower, sizeof box.lower);
        memcpy(box.upper, medium->upper, sizeof box.upper);
        frame->medium_lower = pack(medium->lower, medium->cell);
        frame->medium_upper = pack(medium->upper, medium->emits ? 1.0f : 0.0f);
        frame->medium_dims = (ivec4){medium->dims[0], medium->dims[1], medium->dims[2], 1};
        for (;; resolution = resolution * 3 / 4) {
            frame->lattice_lower =
                pack(medium->lower, nodes_of(&box, resolution, &frame->lattice_dims));
            if (layout_tiles(renderer, gpu->context.info.max_texture_3d) &&
                tau_bytes(renderer) + depths_working_bytes(settings, renderer->shadows.lights,
                                                           renderer->shadows.light_count, frame,
                                                           gpu->context.info.max_texture_3d) <=
                    renderer->shares.depth)
                break;
            if (resolution == 1)
                return fail(BRUME_E_MEMORY,
                            "the optical depths of %u lamps do not fit the memory "
                            "budget",
                            renderer->shadows.light_count);
        }
        if (resolution < settings->lattice_resolution)
            job_warn(request->control, "LATTICE_COARSER",
                     "transport lattice of %d instead of %d cells, to keep the memory budget",
                     resolution, settings->lattice_resolution);
    }

    const int fog = frame->fog_lower.w != 0.0f;
    /* DOM carries the world's light through the field's lattice. */
    if (renderer->shadows.world_count && (medium->dims[0] || fog) &&
        settings->method != BRUME_METHOD_DOM) {
        struct box box = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
        if (medium->dims[0])
            box_join(&box, medium->lower, medium->upper);
        if (fog) {
            const vec4 low = frame->fog_lower, high = frame->fog_upper;
            box_join(&box, (float[3]){low.x, low.y, low.z}, (float[3]){high.x, high.y, high.z});
        }
        int sky = sky_resolution(settings, resolution);
        for (;; sky = sky * 3 / 4) {
            frame->sky_lower = pack(box.lower, nodes_of(&box, sky, &frame->sky_dims));
            if (texels_of(&frame->sky_dims) * SKY_NODE_BYTES <= renderer->shares.sky || sky <= 4)
                break;
        }
    }
    return BRUME_OK;
}
