/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Running the stages. */
#include "render/renderer.h"
#include "base/hash.h"
#include "base/result.h"
#include "base/spread.h"
#include "gl/timer.h"
#include "math/frame.h"
#include "render/lattice.h"
#include "scene/medium.h"
#include "scene/sharpen.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* Steps of a ray through the world's medium where there is no lattice. */
#define FOG_STEPS 24
/* Of one step on a CPU: a tenth of a second or so. */
#define SOFTWARE_PIXELS 65536
/* Between two pictures of a progressive job. */
#define PICTURE_MS 200.0

struct run {
    struct gpu *gpu;
    struct renderer *renderer;
    struct render_request *request;
};

/* --- Signatures: what a stage depends on -------------------------------------------------- */

static uint64_t signature(const uint64_t *values, size_t count)
{
    return hash_bytes(HASH_START, values, count * sizeof *values);
}

static uint64_t float_bits(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static void keep_warnings(struct stage_record *record, const struct job_warning *warnings,
                          uint32_t count)
{
    free(record->warnings);
    record->warnings = count ? malloc(count * sizeof *warnings) : NULL;
    record->warning_count = record->warnings ? count : 0;
    if (record->warnings)
        memcpy(record->warnings, warnings, count * sizeof *warnings);
}

/* Runs the stage if its inputs changed since its last success. */
static brume_result run_if_changed(struct run *run, enum brume_stage stage,
                                   const uint64_t *inputs, size_t count,
                                   brume_result (*work)(struct run *))
{
    struct stage_record *record = &run->renderer->stages[stage];
    brume_stage_stats *stats = &run->request->stats.stages[stage];
    const uint64_t wanted = signature(inputs, count);
    struct job_control *control = run->request->control;
    if (record->signature == wanted)
        return BRUME_OK;
    if (job_cancelled(control))
        return fail(BRUME_E_CANCELLED, "cancelled");
    /* Products may grow up to their shares, which leave nothing for idle targets. */
    view_pool_trim(run->gpu, &run->renderer->targets);
    const uint32_t warned = control->warning_count; /* only this thread adds to them */
    record->signature = 0;
    ++record->runs;
    ++record->revision;
    struct timer timer;
    timer_begin(&timer, brume_stage_name(stage));
    const brume_result result = work(run);
    timer_end(&timer, &stats->wall_ms, &stats->gpu_ms);
    if (result == BRUME_OK) {
        record->signature = wanted;
        keep_warnings(record, control->warnings + warned, control->warning_count - warned);
    }
    return result;
}

/* --- Stages that outlive the view --------------------------------------------------------- */

static brume_result work_upload(struct run *run)
{
    job_report(run->request->control, BRUME_STAGE_UPLOAD, 0.0f);
    return geometry_sync(run->gpu, &run->renderer->geometry, run->request->snapshot,
                         run->request->control);
}

static void warn_of_smeared(struct job_control *control, struct volume *const *volumes,
                            uint32_t count, const struct medium_lattice *lattice)
{
    const struct volume *wide, *smeared = medium_smeared(volumes, count, lattice, &wide);
    if (smeared && wide)
        job_warn(control, "FOG_SMEARED",
                 "\"%s\": most of its balls of fog are smaller than the volumes' cells of %.3g m "
                 "and smeared over them; \"%s\" makes the box of all volumes at least twice as "
                 "long",
                 smeared->name, (double)lattice->cell, wide->name);
    else if (smeared)
        job_warn(control, "FOG_SMEARED",
                 "\"%s\": most of its balls of fog are smaller than the volumes' cells of %.3g m "
                 "and smeared over them; a higher volume resolution shows "
                 "them, or are there stray balls far away?",
                 smeared->name, (double)lattice->cell);
}

static brume_result work_medium(struct run *run)
{
    const struct render_request *request = run->request;
    const struct table *table = &request->snapshot->tables[BRUME_KIND_VOLUME];
    job_report(request->control, BRUME_STAGE_MEDIUM, 0.01f);
    struct volume **volumes = calloc((size_t)table->count + 1, sizeof *volumes);
    if (!volumes)
        return fail(BRUME_E_MEMORY, "no memory for %u volumes", table->count);
    for (uint32_t i = 0; i < table->count; ++i)
        volumes[i] = ((struct volume_block *)table->entries[i].block)->volume;
    struct medium_lattice lattice = {0};
    const int32_t useful = medium_useful_resolution(volumes, table->count);
    const int32_t wanted = request->settings.medium_resolution;
    brume_result result =
        medium_build(volumes, table->count, wanted < useful ? wanted : useful,
                     run->renderer->shares.medium / MEDIUM_CELL_BYTES,
                     job_cancelled_callback, request->control, &lattice);
    if (result == BRUME_OK)
        warn_of_smeared(request->control, volumes, table->count, &lattice);
    free(volumes);
    if (result == BRUME_OK)
        result = medium_sharpen(&lattice);
    if (result == BRUME_OK) {
        if (lattice.coarser)
            job_warn(request->control, "MEDIUM_COARSER",
                     "medium lattice of %d x %d x %d cells instead of %d along the longest side, "
                     "to keep the memory budget",
                     lattice.dims[0], lattice.dims[1], lattice.dims[2],
                     request->settings.medium_resolution);
        result = medium_textures_upload(run->gpu, &run->renderer->medium, &lattice,
                                        request->settings.method == BRUME_METHOD_DOM);
    }
    medium_finish(&lattice);
    return result;
}

static brume_result update_world_map(struct run *run)
{
    const struct snapshot *snapshot = run->request->snapshot;
    const struct entry *image =
        table_find(&snapshot->tables[BRUME_KIND_IMAGE], snapshot->world.image);
    return world_map_update(&run->renderer->world_map,
                            image ? (struct image_block *)image->block : NULL,
                            image ? 2 * image->revision : 1);
}

static void set_world(struct run *run)
{
    struct renderer *renderer = run->renderer;
    struct gpu_frame *frame = &renderer->frame;
    const brume_world *world = &run->request->snapshot->world;
    const struct gpu_image *image = geometry_image(&renderer->geometry, world->image);
    frame->world_color = (vec4){world->color[0], world->color[1], world->color[2],
                                image ? 1.0f : 0.0f};
    if (world->image_from_world[15] != 0.0f)
        memcpy(frame->image_from_world.m, world->image_from_world, sizeof world->image_from_world);
    else
        mat4_identity(frame->image_from_world.m);
    const uint32_t count = renderer->shadows.world_count;
    const uint32_t samples = run->request->view.samples;
    /* A pixel need not see all of many directions: its neighbours see the others. */
    const uint32_t draws = run->request->view.world_draws;
    const uint32_t seen = count < draws ? count : draws;
    const uint32_t each = (seen + samples - 1) / samples;
    const uint32_t every = count > each * samples ? count / (each * samples) : 1;
    frame->world = (uvec4){renderer->shadows.world_first, count, each,
                           renderer->shadows.world_faces};
    frame->counts = (uvec4){renderer->shadows.light_count, (uint32_t)renderer->shadows.side, every,
                            spread_step(count / every)};
    glBindTextureUnit(SLOT_WORLD, image ? image->texture.id : 0);
}

/* Of all light, what the settings want. */
static void set_paths(struct run *run)
{
    const brume_settings *settings = &run->request->settings;
    const uint32_t paths =
        settings->method == BRUME_METHOD_DOM ? BRUME_PATHS_ALL : settings->light_paths;
    const int all = paths == BRUME_PATHS_ALL, sum = paths == BRUME_PATHS_SUM;
    run->renderer->frame.paths = (ivec4){
        .x = all || sum || paths == BRUME_PATHS_SINGLE,
        .y = all || sum || paths == BRUME_PATHS_REFLECTED_MARCHED,
    };
}

static brume_result bind_frame(struct run *run)
{
    struct renderer *renderer = run->renderer;
    TRY(buffer_update(&run->gpu->memory, &renderer->frame_block, FOR_TARGET,
                      sizeof renderer->frame, &renderer->frame, "frame"));
    glBindBufferBase(GL_UNIFORM_BUFFER, SLOT_FRAME, renderer->frame_block.id);
    return BRUME_OK;
}

static brume_result work_shadow(struct run *run)
{
    struct renderer *renderer = run->renderer;
    const uint64_t casters[] = {renderer->stages[BRUME_STAGE_UPLOAD].revision,
                                renderer->emitters.signature};
    const struct render_request *request = run->request;
    job_report(request->control, BRUME_STAGE_SHADOW, 0.02f);
    TRY(shadows_layout(&renderer->shadows, request->snapshot, &renderer->world_map,
                       &renderer->emitters, &request->settings, &renderer->geometry, &renderer->shadow_plan,
                       request->control));
    TRY(shadows_upload(run->gpu, &renderer->shadows));
    return shadows_render(run->gpu, &renderer->shadows, &renderer->geometry,
                          signature(casters, 2), request->control,
                          &run->request->stats.shadow_maps_drawn);
}

static brume_result work_transport(struct run *run)
{
    struct renderer *renderer = run->renderer;
    struct render_request *request = run->request;
    const struct method *method = method_find(request->settings.method);
    job_report(request->control, BRUME_STAGE_TRANSPORT, 0.1f);
    TRY(lattice_layout(run->gpu, renderer, request));
    TRY(shadows_upload(run->gpu, &renderer->shadows));
    set_world(run);
    TRY(bind_frame(run));
    medium_textures_bind(&renderer->medium);
    shadows_bind(&renderer->shadows);
    const struct transport_input input = {
        .gpu = run->gpu,
        .medium = &renderer->medium,
        .geometry = &renderer->geometry,
        .settings = &request->settings,
        .control = request->control,
        .frame = &renderer->frame,
        .lights = renderer->shadows.lights,
        .samples = renderer->shadows.samples,
        .light_count = renderer->shadows.light_count,
        .medium_revision = renderer->stages[BRUME_STAGE_MEDIUM].revision,
        .world_signature = renderer->shadows.world_signature,
        .world = &request->snapshot->world,
        .world_map = &renderer->world_map,
        .world_first = renderer->shadows.world_first,
        .world_count = renderer->shadows.world_count,
        .stats = &request->stats,
        .tau_size = {renderer->tau_size[0], renderer->tau_size[1], renderer->tau_size[2]},
    };
    if (!renderer->frame.field.x) /* left by another method, or by other paths */
        transport_forget_field(run->gpu, &renderer->transport);
    else if (request->settings.method != BRUME_METHOD_DOM)
        transport_forget_moments(run->gpu, &renderer->transport);
    if (lattice_field_bytes(renderer, &request->settings) + transport_field_bytes(&renderer->transport) >
        renderer->shares.field) /* no room to keep what is there while new light is found */
        transport_forget_field(run->gpu, &renderer->transport);
    return method->run(&renderer->transport, &input);
}

/* --- The view ----------------------------------------------------------------------------- */

static brume_result stage_timed(struct run *run, enum brume_stage stage,
                                brume_result (*work)(struct run *))
{
    struct render_request *request = run->request;
    brume_stage_stats *stats = &request->stats.stages[stage];
    if (job_cancelled(request->control))
        return fail(BRUME_E_CANCELLED, "cancelled");
    const float rows = (float)request->row / (float)request->view.height;
    job_report(request->control, stage,
               0.25f + 0.74f * ((float)request->sample + rows) / (float)request->view.samples);
    struct timer timer;
    timer_begin(&timer, brume_stage_name(stage));
    const brume_result result = work(run);
    timer_end(&timer, &stats->wall_ms, &stats->gpu_ms);
    return result;
}

static brume_result work_gbuffer(struct run *run)
{
    struct render_request *request = run->request;
    return view_gbuffer(run->gpu, request->targets, &run->renderer->geometry, &request->view,
                        request->sample);
}

static brume_result work_shade(struct run *run)
{
    const vec4 march = run->renderer->frame.march;
    return view_shade(run->gpu, &run->request->view, (int)march.z, (int)march.w);
}

static brume_result work_march(struct run *run)
{
    const vec4 march = run->renderer->frame.march;
    const struct render_request *request = run->request;
    enum view_march_kind kind = VIEW_MARCH;
    if (request->settings.method == BRUME_METHOD_DOM)
        kind = run->renderer->frame.counts.x ? VIEW_MARCH_DOM_LAMPS : VIEW_MARCH_DOM;
    return view_march(run->gpu, request->targets, &request->view, kind, (int)march.z, (int)march.w);
}

/* Reads the mean of the samples so far and makes it the newest picture. */
static brume_result work_passes(struct run *run)
{
    struct render_request *request = run->request;
    struct picture *back = &request->back;
    if (!back->pixels[BRUME_PASS_COMBINED])
        TRY(picture_init(back, &request->view));
    for (uint32_t pass = 0; pass < BRUME_PASS_COUNT; ++pass)
        if (back->pixels[pass])
            TRY(view_read(request->targets, &request->view, pass, request->sample,
                          back->pixels[pass]));
    back->samples = request->sample;
    pthread_mutex_lock(&request->control->mutex);
    const struct picture newest = *back;
    *back = *request->front;
    *request->front = newest;
    pthread_mutex_unlock(&request->control->mutex);
    return context_check("reading the picture");
}

/* Whether a sample takes so long that others should have their turn within it. */
static bool is_long(const struct run *run)
{
    const brume_view *view = &run->request->view;
    return run->gpu->context.info.software && view->width * view->height > SOFTWARE_PIXELS;
}

/* The last row of this step, and one. */
static int last_row(const struct run *run)
{
    const brume_view *view = &run->request->view;
    if (!is_long(run))
        return view->height;
    const int groups = SOFTWARE_PIXELS / view->width / GROUP_PIXELS;
    const int end = run->request->row + (groups ? groups : 1) * GROUP_PIXELS;
    return end < view->height ? end : view->height;
}

/* All of the context's state that a sample needs: another job may have had its step before. */
static brume_result bind_view(struct run *run, int end)
{
    struct renderer *renderer = run->renderer;
    const struct render_request *request = run->request;
    const float cell = renderer->medium.dims[0] ? renderer->medium.cell : 1.0f;
    set_world(run);
    set_paths(run);
    renderer->frame.march = (vec4){cell * request->settings.step, FOG_STEPS, (float)request->row,
                                   (float)end};
    view_frame(&request->view, request->sample, &renderer->frame);
    medium_textures_bind(&renderer->medium);
    shadows_bind(&renderer->shadows);
    transport_bind(&renderer->transport);
    TRY(bind_frame(run));
    if (run->request->settings.method == BRUME_METHOD_DOM && renderer->frame.field.x != 0)
        TRY(dom_look(run->gpu, &renderer->transport, &renderer->frame));
    view_bind(request->targets); /* last: images are the others' too */
    return BRUME_OK;
}

static void count_sample(struct render_request *request)
{
    request->drawn = false;
    request->row = 0;
    ++request->sample;
    pthread_mutex_lock(&request->control->mutex);
    request->control->samples_done = request->sample;
    pthread_mutex_unlock(&request->control->mutex);
}

static brume_result step_view(struct run *run, bool *more)
{
    struct render_request *request = run->request;
    const brume_view *view = &request->view;
    *more = true;
    if (!request->drawn) {
        TRY(stage_timed(run, BRUME_STAGE_GBUFFER, work_gbuffer));
        request->drawn = true;
        if (is_long(run))
            return BRUME_OK;
    }
    const int end = last_row(run);
    TRY(bind_view(run, end));
    TRY(stage_timed(run, BRUME_STAGE_SHADE, work_shade));
    TRY(stage_timed(run, BRUME_STAGE_MARCH, work_march));
    request->row = end;
    if (end < view->height)
        return BRUME_OK;
    count_sample(request);
    *more = request->sample < view->samples;
    if (*more && !(view->progressive && clock_ms() > request->next_picture))
        return BRUME_OK;
    const brume_result result = stage_timed(run, BRUME_STAGE_PASSES, work_passes);
    request->next_picture = clock_ms() + PICTURE_MS; /* the first sample was at once */
    return result;
}

/* --- The budget --------------------------------------------------------------------------- */

/* The blocks of frame, stage and lattice pass, and the smallest of everything else. */
#define FIXED_BYTES (256u << 10)

static uint64_t product_bytes(const struct renderer *renderer)
{
    const struct medium_textures *medium = &renderer->medium;
    const struct transport *transport = &renderer->transport;
    return medium->scatter.bytes + medium->extinct.bytes + medium->emission.bytes +
           medium->bricks.bytes + renderer->shadows.maps.bytes + transport->tau.bytes +
           transport->sky[0].bytes + transport->sky[1].bytes + transport->sky[2].bytes +
           transport_field_bytes(transport);
}

/* Shares out what pictures, meshes and images leave. What was made under a larger share goes
 * first, so that the budget holds at every moment. */
static brume_result share_budget(struct run *run)
{
    struct renderer *renderer = run->renderer;
    struct render_request *request = run->request;
    const uint64_t budget = request->settings.memory_budget;
    const uint64_t pictures = view_pool_bytes(renderer->targets, true) +
                              (request->targets ? 0 : view_bytes(&request->view));
    const uint64_t taken = pictures + geometry_bytes(request->snapshot) + FIXED_BYTES;
    if (taken >= budget)
        return fail(BRUME_E_MEMORY,
                    "picture, meshes and images alone need %.1f MiB of graphics memory; the "
                    "memory budget is %.1f MiB",
                    (double)taken / (1 << 20), (double)budget / (1 << 20));
    const uint64_t all = budget - taken;
    const uint64_t field = request->settings.method == BRUME_METHOD_LPV   ? all / 4
                           : request->settings.method == BRUME_METHOD_DOM ? all / 2
                                                                          : 0;
    const uint64_t rest = all - field;
    renderer->shares = (struct shares){
        .medium = rest / 4, .shadow = rest / 8 * 3, .depth = rest / 4, .sky = rest / 8, .field = field};
    if (product_bytes(renderer) + view_pool_bytes(renderer->targets, false) > all)
        view_pool_trim(run->gpu, &renderer->targets);
    if (product_bytes(renderer) > all) {
        medium_textures_finish(run->gpu, &renderer->medium);
        shadows_finish(run->gpu, &renderer->shadows);
        transport_finish(run->gpu, &renderer->transport);
        for (int stage = BRUME_STAGE_MEDIUM; stage <= BRUME_STAGE_TRANSPORT; ++stage)
            renderer->stages[stage].signature = 0;
    }
    return BRUME_OK;
}

static uint64_t least(uint64_t a, uint64_t b)
{
    return a < b ? a : b;
}

static uint64_t cube(int32_t side)
{
    return (uint64_t)side * (uint64_t)side * (uint64_t)side;
}

/* --- All of it ---------------------------------------------------------------------------- */

static void fill_stats(struct run *run)
{
    brume_stats *stats = &run->request->stats;
    const struct renderer *renderer = run->renderer;
    const struct memory *memory = &run->gpu->memory;
    for (int stage = 0; stage < BRUME_STAGE_COUNT; ++stage) {
        stats->stages[stage].runs = renderer->stages[stage].runs;
        stats->stages[stage].revision = renderer->stages[stage].revision;
    }
    stats->medium_bytes = memory->bytes[FOR_MEDIUM];
    stats->transport_bytes = memory->bytes[FOR_TRANSPORT];
    stats->shadow_bytes = memory->bytes[FOR_SHADOW];
    stats->mesh_bytes = memory->bytes[FOR_MESH];
    stats->image_bytes = memory->bytes[FOR_IMAGE];
    stats->target_bytes = memory->bytes[FOR_TARGET];
    stats->total_bytes = memory->total;
    memcpy(stats->medium_dims, renderer->medium.dims, sizeof stats->medium_dims);
    memcpy(stats->transport_dims, &renderer->frame.lattice_dims, sizeof stats->transport_dims);
    stats->light_count = renderer->shadows.light_count;
    stats->triangle_count = renderer->geometry.triangle_count;
    stats->samples = run->request->sample;
}

/* The warnings of the products that the job now uses, once each. */
static void collect_warnings(struct run *run)
{
    struct render_request *request = run->request;
    struct job_control *control = request->control;
    const struct stage_record *stages = run->renderer->stages;
    uint64_t revisions[BRUME_STAGE_TRANSPORT + 1];
    for (int stage = 0; stage <= BRUME_STAGE_TRANSPORT; ++stage)
        revisions[stage] = stages[stage].revision;
    const uint64_t products = signature(revisions, BRUME_STAGE_TRANSPORT + 1);
    if (products == request->products)
        return;
    request->products = products;
    pthread_mutex_lock(&control->mutex);
    control->warning_count = 0;
    pthread_mutex_unlock(&control->mutex);
    for (int stage = 0; stage <= BRUME_STAGE_TRANSPORT; ++stage)
        for (uint32_t i = 0; i < stages[stage].warning_count; ++i)
            job_warn_again(control, &stages[stage].warnings[i]);
}

/* What the view takes its light from: signatures alone where nothing changed since, be it by
 * another request's step. */
static brume_result run_stages(struct run *run)
{
    struct renderer *renderer = run->renderer;
    struct render_request *request = run->request;
    const struct snapshot *snapshot = request->snapshot;
    const brume_settings *settings = &request->settings;
    const struct stage_record *stages = renderer->stages;
    const struct shares *shares = &renderer->shares;
    TRY(share_budget(run));
    run->gpu->memory.peak = run->gpu->memory.total;
    if (!request->targets)
        TRY(view_take(run->gpu, &renderer->targets, &request->view, &request->targets));

    /* A share counts as an input only where it is less than what could be used: another picture's
     * size then does not re-run what fits anyway. */
    const uint64_t upload[] = {snapshot->tables[BRUME_KIND_MESH].revision,
                               snapshot->tables[BRUME_KIND_INSTANCES].revision,
                               snapshot->tables[BRUME_KIND_MATERIAL].revision,
                               snapshot->tables[BRUME_KIND_IMAGE].revision};
    TRY(run_if_changed(run, BRUME_STAGE_UPLOAD, upload, 4, work_upload));
    const uint64_t medium[] = {snapshot->tables[BRUME_KIND_VOLUME].revision,
                               (uint64_t)settings->medium_resolution,
                               least(shares->medium / MEDIUM_CELL_BYTES,
                                     cube(settings->medium_resolution)),
                               settings->method == BRUME_METHOD_DOM};
    TRY(run_if_changed(run, BRUME_STAGE_MEDIUM, medium, 4, work_medium));
    TRY(update_world_map(run));
    lattice_place(renderer, request);
    emitters_update(&renderer->emitters, &renderer->geometry, snapshot, &renderer->frame,
                    stages[BRUME_STAGE_UPLOAD].revision, settings->method == BRUME_METHOD_DOM);
    TRY(shadows_plan(snapshot, &renderer->world_map, &renderer->emitters, settings,
                     &renderer->geometry, shares->shadow, &renderer->shadow_plan));
    const uint64_t shadow[] = {stages[BRUME_STAGE_UPLOAD].revision,
                               snapshot->tables[BRUME_KIND_LIGHT].revision,
                               snapshot->world_revision,
                               (uint64_t)renderer->shadow_plan.side,
                               renderer->shadow_plan.light_samples,
                               renderer->shadow_plan.world_samples,
                               renderer->emitters.signature};
    TRY(run_if_changed(run, BRUME_STAGE_SHADOW, shadow, 7, work_shadow));
    const uint64_t transport[] = {stages[BRUME_STAGE_MEDIUM].revision,
                                  stages[BRUME_STAGE_SHADOW].revision,
                                  (uint64_t)settings->lattice_resolution,
                                  settings->method,
                                  settings->depths,
                                  least(shares->depth, lattice_depth_bytes(renderer, settings)),
                                  least(shares->sky, lattice_sky_bytes(settings)),
                                  (uint64_t)settings->iterations,
                                  (uint64_t)settings->field_resolution,
                                  settings->light_paths == BRUME_PATHS_ALL,
                                  settings->blockers,
                                  (uint64_t)settings->ordinates,
                                  settings->warm,
                                  float_bits(settings->converged),
                                  float_bits(snapshot->world.reach),
                                  hash_bytes(HASH_START, renderer->frame.fields,
                                             sizeof renderer->frame.fields)};
    TRY(run_if_changed(run, BRUME_STAGE_TRANSPORT, transport, 16, work_transport));
    collect_warnings(run);
    return BRUME_OK;
}

brume_result renderer_step(struct gpu *gpu, struct renderer *renderer,
                           struct render_request *request, bool *more)
{
    struct run run = {gpu, renderer, request};
    const double started = clock_ms();
    *more = false;
    brume_result result = BRUME_OK;
    if (job_cancelled(request->control))
        result = fail(BRUME_E_CANCELLED, "cancelled");
    if (result == BRUME_OK)
        result = run_stages(&run);
    if (result == BRUME_OK)
        result = step_view(&run, more);
    request->stats.total_ms += clock_ms() - started;
    if (request->stats.peak_bytes < gpu->memory.peak)
        request->stats.peak_bytes = gpu->memory.peak;
    *more = *more && result == BRUME_OK;
    if (!*more) {
        if (result == BRUME_OK)
            for (int stage = BRUME_STAGE_GBUFFER; stage < BRUME_STAGE_COUNT; ++stage) {
                ++renderer->stages[stage].runs;
                ++renderer->stages[stage].revision;
            }
        fill_stats(&run); /* of a job that failed, too */
        view_give_back(gpu, &renderer->targets, request->targets);
    }
    return result;
}

void renderer_finish(struct gpu *gpu, struct renderer *renderer)
{
    geometry_finish(gpu, &renderer->geometry);
    medium_textures_finish(gpu, &renderer->medium);
    for (int stage = 0; stage < BRUME_STAGE_COUNT; ++stage)
        free(renderer->stages[stage].warnings);
    world_map_finish(&renderer->world_map);
    shadows_finish(gpu, &renderer->shadows);
    transport_finish(gpu, &renderer->transport);
    view_pool_trim(gpu, &renderer->targets); /* all of them: its jobs have ended */
    buffer_finish(&gpu->memory, &renderer->frame_block);
    memset(renderer, 0, sizeof *renderer);
}
