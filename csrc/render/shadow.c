/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Shadow maps: perspective faces around lamps, orthographic maps along suns and the world's
 * samples. */
#include "render/shadow.h"
#include "base/hash.h"
#include "base/result.h"
#include "math/frame.h"
#include "scene/light.h"
#include "scene/light_view.h"
#include "scene/world.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MAX_LAYERS 2048
#define COARSE_SIDE 128   /* texels: below this, fewer samples hurt less than coarser maps */
#define LEAST_SIDE 16
#define FEW_DIRECTIONS 16 /* of the world */
#define MAPS_A_FINISH 8   /* on a CPU */
#define WORLD_TILES 4     /* maps of the world in one layer */

/* Maps of a distant light: over all geometry, and before it a finer one over what is solid where
 * that is much smaller (a house on a wide plain). */
static uint32_t distant_faces(const struct geometry *geometry)
{
    float all = 0.0f, solid = 0.0f;
    for (int i = 0; i < 3; ++i) {
        const float a = geometry->upper[i] - geometry->lower[i];
        const float s = geometry->solid_upper[i] - geometry->solid_lower[i];
        all += a * a;
        solid += s * s;
    }
    return geometry->solid_lower[0] <= geometry->solid_upper[0] && solid < 0.25f * all ? 2 : 1;
}

static void distant_views(const struct geometry *geometry, uint32_t faces, const vec4 *towards,
                          int side, struct gpu_shadow_view *out)
{
    if (faces == 2)
        light_view_distant(geometry->lower, geometry->upper, geometry->solid_lower,
                           geometry->solid_upper, towards, side, out++);
    light_view_distant(geometry->lower, geometry->upper, geometry->lower, geometry->upper, towards,
                       side, out);
}

/* Faces in the order of shadow_face() in shaders/lib/shadow.glsl. */
static void lamp_views(const brume_light *light, const struct gpu_light *gpu,
                       const struct gpu_light_sample *sample, const struct geometry *geometry,
                       int side, struct gpu_shadow_view *out)
{
    const float eye[3] = {sample->position.x, sample->position.y, sample->position.z};
    const float near_ = light_view_near(geometry->lower, geometry->upper);
    const uint32_t faces = light_faces(light);
    const float tangent = faces == 1 ? tanf(0.5f * light->spot_angle) : 1.0f;
    for (uint32_t face = 0; face < faces; ++face)
        light_view_face(gpu, eye, face, tangent, side, near_, &out[face]);
}

/* --- Layout ------------------------------------------------------------------------------- */

static uint32_t faces_of(const brume_light *light, uint32_t distant)
{
    return light->type == BRUME_LIGHT_SUN ? distant : light_faces(light);
}

/* The world is many soft directions: how many they are matters more than how sharp each is. */
static uint32_t world_layer_count(const struct shadow_plan *plan)
{
    return (plan->world_samples * plan->distant + WORLD_TILES - 1) / WORLD_TILES;
}

static int world_is_black(const brume_world *world)
{
    return world->color[0] <= 0.0f && world->color[1] <= 0.0f && world->color[2] <= 0.0f;
}

/* A world medium without limit lets nothing through from infinitely far. */
static int distant_light(const struct snapshot *snapshot)
{
    return !(snapshot->world.has_volume && snapshot->world.reach < 0.0f);
}

/* Everything that lights as a lamp: the scene's, the suns of its world's image, and small things that
 * glow. */
struct lamps {
    const struct table *table;
    brume_light suns[WORLD_SPOTS];
    const struct emitters *emitters;
    uint32_t count, sun_count;
};

static struct lamps all_lamps(const struct snapshot *snapshot, const struct world_map *map,
                              const struct emitters *emitters)
{
    struct lamps lamps = {.table = &snapshot->tables[BRUME_KIND_LIGHT], .emitters = emitters};
    if (!world_is_black(&snapshot->world) && distant_light(snapshot))
        for (; lamps.sun_count < map->spot_count; ++lamps.sun_count)
            world_sun(&map->spots[lamps.sun_count], &snapshot->world,
                      &lamps.suns[lamps.sun_count]);
    lamps.count = lamps.table->count + lamps.sun_count + emitters->count;
    return lamps;
}

static const brume_light *lamp(const struct lamps *lamps, uint32_t number)
{
    const struct table *table = lamps->table;
    const uint32_t suns = table->count, emitters = suns + lamps->sun_count;
    if (number < suns)
        return &((struct light_block *)table->entries[number].block)->light;
    return number < emitters ? &lamps->suns[number - suns]
                             : &lamps->emitters->lamps[number - emitters];
}

/* Emitters, which are small and may be many, share what one lamp has. */
static uint32_t samples_of(const struct lamps *lamps, uint32_t number, uint32_t wanted)
{
    if (number >= lamps->table->count + lamps->sun_count)
        wanted /= lamps->emitters->count;
    return light_sample_count(lamp(lamps, number), wanted);
}

static uint64_t lamp_layer_count(const struct lamps *lamps, const struct shadow_plan *plan)
{
    uint64_t layers = 0;
    for (uint32_t i = 0; i < lamps->count; ++i) {
        const brume_light *light = lamp(lamps, i);
        if (light->cast_shadow)
            layers += (uint64_t)samples_of(lamps, i, plan->light_samples) *
                      faces_of(light, plan->distant);
    }
    return layers;
}

static brume_result allocate(struct shadows *shadows, const struct lamps *lamps,
                             const struct shadow_plan *plan)
{
    const uint32_t views = plan->lamp_layers + plan->world_samples * plan->distant;
    uint32_t samples = plan->world_samples;
    for (uint32_t i = 0; i < lamps->count; ++i)
        samples += samples_of(lamps, i, plan->light_samples);
    free(shadows->lights);
    free(shadows->samples);
    free(shadows->views);
    shadows->lights = calloc((size_t)lamps->count + 1, sizeof *shadows->lights);
    shadows->samples = calloc((size_t)samples + 1, sizeof *shadows->samples);
    shadows->views = calloc((size_t)views + 1, sizeof *shadows->views);
    shadows->light_count = lamps->count;
    shadows->sample_count = samples;
    shadows->view_count = 0;
    if (!shadows->lights || !shadows->samples || !shadows->views)
        return fail(BRUME_E_MEMORY, "no memory for %u lights", lamps->count);
    return BRUME_OK;
}

static int casts(const struct geometry *geometry)
{
    return geometry->lower[0] <= geometry->upper[0];
}

brume_result shadows_plan(const struct snapshot *snapshot, const struct world_map *map,
                          const struct emitters *emitters, const brume_settings *settings,
                          const struct geometry *geometry, uint64_t budget,
                          struct shadow_plan *plan)
{
    const struct lamps all = all_lamps(snapshot, map, emitters);
    *plan = (struct shadow_plan){
        .side = settings->shadow_resolution / 2 * 2, /* quarters of whole texels */
        .light_samples = (uint32_t)settings->light_samples,
        .distant = casts(geometry) ? distant_faces(geometry) : 1,
    };
    if (!world_is_black(&snapshot->world) && distant_light(snapshot))
        plan->world_samples = (uint32_t)settings->world_samples;
    for (;;) {
        const int fewest = plan->light_samples == 1 && plan->world_samples <= FEW_DIRECTIONS;
        const uint32_t world = casts(geometry) ? world_layer_count(plan) : 0;
        uint64_t lamps = casts(geometry) ? lamp_layer_count(&all, plan) : 0;
        if (fewest && lamps + world > MAX_LAYERS)
            lamps = MAX_LAYERS - world; /* the last lamps get none */
        const uint64_t layers = lamps + world;
        const uint64_t texels = (uint64_t)plan->side * (uint64_t)plan->side;
        const int too_many = layers > MAX_LAYERS;
        plan->lamp_layers = (uint32_t)lamps;
        plan->world_layers = world;
        if (!too_many && layers * (texels * 4 + WORLD_TILES * sizeof(struct gpu_shadow_view)) <= budget)
            return BRUME_OK;
        /* Sharpness goes before softness, as far as it is plenty. */
        if (!too_many && plan->side > (fewest ? LEAST_SIDE : COARSE_SIDE)) {
            plan->side /= 2;
        } else if (!fewest) {
            plan->light_samples = plan->light_samples > 1 ? plan->light_samples / 2 : 1;
            if (plan->world_samples > FEW_DIRECTIONS)
                plan->world_samples /= 2;
        } else {
            return fail(BRUME_E_MEMORY, "the shadow maps of %u lamps do not fit the memory budget",
                        all.count);
        }
    }
}

brume_result shadows_layout(struct shadows *shadows, const struct snapshot *snapshot,
                            const struct world_map *map, const struct emitters *emitters,
                            const brume_settings *settings, const struct geometry *geometry,
                            const struct shadow_plan *plan, struct job_control *control)
{
    const struct lamps lamps = all_lamps(snapshot, map, emitters);
    const int casters = casts(geometry);
    const uint32_t wanted = plan->light_samples, world_count = plan->world_samples;
    const uint32_t distant = plan->distant;
    const int side = plan->side;
    if (wanted < (uint32_t)settings->light_samples ||
        (world_count && world_count < (uint32_t)settings->world_samples))
        job_warn(control, "LIGHT_SAMPLES_FEWER",
                 "%u shadow maps a lamp instead of %d, and %u for the world: no more fit", wanted,
                 settings->light_samples, world_count);
    if (side < settings->shadow_resolution - 1)
        job_warn(control, "SHADOWS_COARSER",
                 "shadow maps of %d instead of %d texels, to keep the memory budget", side,
                 settings->shadow_resolution);
    TRY(allocate(shadows, &lamps, plan));
    shadows->side = side;
    shadows->layer_count = plan->lamp_layers + plan->world_layers;
    shadows->world_faces = distant;

    uint32_t next_sample = 0, next_view = 0, left_out = 0;
    for (uint32_t i = 0; i < lamps.count; ++i) {
        const brume_light *light = lamp(&lamps, i);
        struct gpu_light *out = &shadows->lights[i];
        light_to_gpu(light, out);
        if (light->type == BRUME_LIGHT_SUN && !distant_light(snapshot))
            out->radiance = (vec4){0};
        const uint32_t count = samples_of(&lamps, i, wanted);
        const uint32_t faces = faces_of(light, distant);
        out->samples.x = next_sample;
        out->samples.y = count;
        out->samples.z = faces;
        for (uint32_t s = 0; s < count; ++s, ++next_sample) {
            struct gpu_light_sample *sample = &shadows->samples[next_sample];
            light_sample(light, out, s, count, sample);
            if (!light->cast_shadow || !casters)
                continue;
            if (next_view + faces > plan->lamp_layers) {
                ++left_out;
                continue;
            }
            sample->position.w = (float)next_view;
            if (light->type == BRUME_LIGHT_SUN)
                distant_views(geometry, faces, &sample->position, side,
                              &shadows->views[next_view]);
            else
                lamp_views(light, out, sample, geometry, side, &shadows->views[next_view]);
            for (uint32_t face = 0; face < faces; ++face, ++next_view)
                shadows->views[next_view].tile = (vec4){0.0f, 0.0f, 1.0f, (float)next_view};
        }
    }
    if (left_out)
        job_warn(control, "SHADOWS_LEFT_OUT",
                 "%u lamps cast no shadow: there is room for %d shadow maps", left_out, MAX_LAYERS);
    shadows->world_first = next_sample;
    shadows->world_count = world_count;
    if (world_count) {
        TRY(world_samples(&snapshot->world, map, world_count, shadows->samples + next_sample));
        for (uint32_t s = 0; s < world_count && casters; ++s) {
            struct gpu_light_sample *sample = &shadows->samples[next_sample + s];
            sample->position.w = (float)next_view;
            distant_views(geometry, distant, &sample->position, side / 2,
                          &shadows->views[next_view]);
            for (uint32_t face = 0; face < distant; ++face, ++next_view) {
                const uint32_t tile = s * distant + face;
                shadows->views[next_view].tile =
                    (vec4){tile & 1 ? 0.5f : 0.0f, tile & 2 ? 0.5f : 0.0f, 0.5f,
                           (float)(plan->lamp_layers + tile / WORLD_TILES)};
            }
        }
    }
    shadows->view_count = next_view;
    return BRUME_OK;
}

static void read_as_texels(GLuint *texture, const struct buffer *buffer, GLenum format)
{
    if (!*texture)
        glCreateTextures(GL_TEXTURE_BUFFER, 1, texture);
    glTextureBuffer(*texture, format, buffer->id);
}

brume_result shadows_upload(struct gpu *gpu, struct shadows *shadows)
{
    struct memory *memory = &gpu->memory;
    TRY(buffer_update(memory, &shadows->light_buffer, FOR_SHADOW,
                      shadows->light_count * sizeof *shadows->lights, shadows->lights, "lights"));
    TRY(buffer_update(memory, &shadows->sample_buffer, FOR_SHADOW,
                      shadows->sample_count * sizeof *shadows->samples, shadows->samples,
                      "light samples"));
    TRY(buffer_update(memory, &shadows->view_buffer, FOR_SHADOW,
                      shadows->view_count * sizeof *shadows->views, shadows->views,
                      "shadow views"));
    read_as_texels(&shadows->light_texture, &shadows->light_buffer, GL_RGBA32UI);
    read_as_texels(&shadows->sample_texture, &shadows->sample_buffer, GL_RGBA32F);
    read_as_texels(&shadows->view_texture, &shadows->view_buffer, GL_RGBA32F);
    /* A sampler wants a texture, even where nothing casts a shadow. */
    const int layers = shadows->view_count ? (int)shadows->layer_count : 1;
    const int side = shadows->view_count ? shadows->side : 1;
    if (shadows->maps.width != side || shadows->maps.depth != layers || !shadows->drawn) {
        free(shadows->drawn);
        shadows->drawn = calloc((size_t)layers * WORLD_TILES, sizeof *shadows->drawn);
        if (!shadows->drawn)
            return fail(BRUME_E_MEMORY, "no memory for %d shadow maps", layers);
    }
    return texture_ensure(memory, &shadows->maps, FOR_SHADOW, GL_TEXTURE_2D_ARRAY,
                          GL_DEPTH_COMPONENT32F, side, side, layers, 1, "shadow maps");
}

/* Whole layers and first quarters share a place: never is one of a layer a lamp's and another the
 * world's. */
static uint64_t *place_of(const struct shadows *shadows, const vec4 *tile)
{
    const int quarter = (tile->x > 0.0f) + 2 * (tile->y > 0.0f);
    return &shadows->drawn[(int)tile->w * WORLD_TILES + quarter];
}

static uint64_t map_signature(const struct shadows *shadows, uint32_t number, uint64_t casters)
{
    /* The number, since it seeds the alpha test. */
    const uint64_t parts[] = {casters, number};
    const uint64_t hash = hash_bytes(HASH_START, parts, sizeof parts);
    return hash_bytes(hash, &shadows->views[number], sizeof *shadows->views);
}

static brume_result draw_map(struct gpu *gpu, struct shadows *shadows, struct geometry *geometry,
                             uint32_t number)
{
    const vec4 tile = shadows->views[number].tile;
    const float side = (float)shadows->side;
    static const float far_ = 0.0f;
    const GLint x = (GLint)(tile.x * side), y = (GLint)(tile.y * side);
    const GLsizei size = (GLsizei)(tile.z * side);
    glNamedFramebufferTextureLayer(shadows->framebuffer, GL_DEPTH_ATTACHMENT, shadows->maps.id, 0,
                                   (GLint)tile.w);
    glViewport(x, y, size, size);
    glScissor(x, y, size, size);
    glEnable(GL_SCISSOR_TEST); /* the maps beside it stay */
    glClearNamedFramebufferfv(shadows->framebuffer, GL_DEPTH, 0, &far_);
    glDisable(GL_SCISSOR_TEST);
    const struct gpu_draw stage = {.clip_from_world = shadows->views[number].clip_from_world,
                                   .info = {number, 0, 0, 0}};
    return geometry_draw(gpu, geometry, &stage, BRUME_VISIBLE_SHADOW, GEOMETRY_SHADOW);
}

brume_result shadows_render(struct gpu *gpu, struct shadows *shadows, struct geometry *geometry,
                            uint64_t casters, struct job_control *control, uint32_t *drawn)
{
    if (!shadows->framebuffer) {
        glCreateFramebuffers(1, &shadows->framebuffer);
        glNamedFramebufferDrawBuffer(shadows->framebuffer, GL_NONE);
    }
    /* Depths are read one by one: gathering and fetching want no filter and no comparison. */
    glTextureParameteri(shadows->maps.id, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(shadows->maps.id, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glBindFramebuffer(GL_FRAMEBUFFER, shadows->framebuffer);
    shadows->world_signature =
        hash_bytes(HASH_START, shadows->samples + shadows->world_first,
                   shadows->world_count * sizeof *shadows->samples);
    brume_result result = BRUME_OK;
    for (uint32_t i = 0; i < shadows->view_count && result == BRUME_OK; ++i) {
        const uint64_t wanted = map_signature(shadows, i, casters);
        uint64_t *holds = place_of(shadows, &shadows->views[i].tile);
        if (shadows->views[i].tile.z < 1.0f)
            shadows->world_signature =
                hash_bytes(shadows->world_signature, &wanted, sizeof wanted);
        if (*holds == wanted)
            continue;
        if (job_cancelled(control)) {
            result = fail(BRUME_E_CANCELLED, "cancelled");
            break;
        }
        if (shadows->views[i].tile.z == 1.0f)
            memset(holds, 0, WORLD_TILES * sizeof *holds);
        *holds = 0;
        result = draw_map(gpu, shadows, geometry, i);
        if (result == BRUME_OK)
            *holds = wanted;
        if (++*drawn % MAPS_A_FINISH == 0 && gpu->context.info.software)
            glFinish(); /* so that a cancel comes through between some maps */
        job_report(control, BRUME_STAGE_SHADOW, 0.02f + 0.08f * (float)(i + 1) /
                                                            (float)shadows->view_count);
    }
    /* A texture attached lives on after its deletion. */
    glNamedFramebufferTexture(shadows->framebuffer, GL_DEPTH_ATTACHMENT, 0, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    return result;
}

void shadows_bind(const struct shadows *shadows)
{
    glBindTextureUnit(SLOT_LIGHTS, shadows->light_texture);
    glBindTextureUnit(SLOT_LIGHT_SAMPLES, shadows->sample_texture);
    glBindTextureUnit(SLOT_SHADOW_VIEWS, shadows->view_texture);
    glBindTextureUnit(SLOT_SHADOW, shadows->maps.id);
}

void shadows_finish(struct gpu *gpu, struct shadows *shadows)
{
    buffer_finish(&gpu->memory, &shadows->light_buffer);
    buffer_finish(&gpu->memory, &shadows->sample_buffer);
    buffer_finish(&gpu->memory, &shadows->view_buffer);
    texture_finish(&gpu->memory, &shadows->maps);
    glDeleteTextures(1, &shadows->light_texture);
    glDeleteTextures(1, &shadows->sample_texture);
    glDeleteTextures(1, &shadows->view_texture);
    if (shadows->framebuffer)
        glDeleteFramebuffers(1, &shadows->framebuffer);
    free(shadows->lights);
    free(shadows->samples);
    free(shadows->views);
    free(shadows->drawn);
    memset(shadows, 0, sizeof *shadows);
}
