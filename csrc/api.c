/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The public functions: check the arguments, then one call downwards. */
#include "base/field.h"
#include "base/result.h"
#include "io/exr.h"
#include "io/vdb.h"
#include "math/frame.h"
#include "render/job.h"
#include "scene/medium.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

uint32_t brume_abi(void)
{
    return BRUME_ABI;
}

size_t brume_struct_size(const char *name)
{
#define ENTRY(type) {#type, sizeof(type)}
    static const struct {
        const char *name;
        size_t size;
    } sizes[] = {
        ENTRY(brume_device_params), ENTRY(brume_device_info),    ENTRY(brume_grid_info),
        ENTRY(brume_instruction),   ENTRY(brume_volume_program), ENTRY(brume_gaussian),
        ENTRY(brume_volume),        ENTRY(brume_mesh),           ENTRY(brume_instances),
        ENTRY(brume_material),      ENTRY(brume_image),          ENTRY(brume_light),
        ENTRY(brume_world),         ENTRY(brume_settings),       ENTRY(brume_lens),
        ENTRY(brume_view),          ENTRY(brume_stage_stats),    ENTRY(brume_stats),
        ENTRY(brume_job_status),    ENTRY(brume_exr_channel),
    };
#undef ENTRY
    for (size_t i = 0; name && i < sizeof sizes / sizeof *sizes; ++i)
        if (strcmp(sizes[i].name, name) == 0)
            return sizes[i].size;
    return 0;
}

const char *brume_result_name(brume_result result)
{
#define NAME(code) [code] = #code
    static const char *const names[] = {
        NAME(BRUME_OK),           NAME(BRUME_E_ARGUMENT),       NAME(BRUME_E_MEMORY),
        NAME(BRUME_E_FILE_MISSING), NAME(BRUME_E_FILE_FORMAT),  NAME(BRUME_E_FILE_WRITE),
        NAME(BRUME_E_GRID_UNKNOWN), NAME(BRUME_E_GRID_TYPE),    NAME(BRUME_E_GRID_EMPTY),
        NAME(BRUME_E_GRID_VALUES), NAME(BRUME_E_TRANSFORM),     NAME(BRUME_E_MESH),
        NAME(BRUME_E_SHADER_PROGRAM), NAME(BRUME_E_NO_EGL),     NAME(BRUME_E_NO_GL),
        NAME(BRUME_E_GPU),        NAME(BRUME_E_CANCELLED),      NAME(BRUME_E_NOT_READY),
        NAME(BRUME_E_UNSUPPORTED),
    };
#undef NAME
    return (size_t)result < sizeof names / sizeof *names ? names[result] : "BRUME_E_UNKNOWN";
}

const char *brume_last_error(void)
{
    return last_error();
}

const char *brume_stage_name(uint32_t stage)
{
    static const char *const names[BRUME_STAGE_COUNT] = {
        "upload", "medium", "shadow", "transport", "gbuffer", "shade", "march", "passes"};
    return stage < BRUME_STAGE_COUNT ? names[stage] : "";
}

const char *brume_field_part_name(uint32_t part)
{
    static const char *const names[BRUME_FIELD_PARTS] = {
        "surfaces", "media", "reflected", "scattered", "blockers",
        "aggregate", "prepare", "iterations", "copy"};
    return part < BRUME_FIELD_PARTS ? names[part] : "";
}

static const struct {
    const char *name;
    uint32_t channels;
} passes[BRUME_PASS_COUNT] = {
    [BRUME_PASS_COMBINED] = {"Combined", 4},
    [BRUME_PASS_DEPTH] = {"Depth", 1},
    [BRUME_PASS_NORMAL] = {"Normal", 3},
    [BRUME_PASS_VOLUME_DIRECT] = {"VolumeDir", 3},
    [BRUME_PASS_EMISSION] = {"Emit", 3},
    [BRUME_PASS_ENVIRONMENT] = {"Env", 3},
    [BRUME_PASS_TRANSMITTANCE] = {"Transmittance", 3},
    [BRUME_PASS_VOLUME_INDIRECT] = {"VolumeInd", 3},
};

uint32_t brume_pass_channels(uint32_t pass)
{
    return pass < BRUME_PASS_COUNT ? passes[pass].channels : 0;
}

const char *brume_pass_name(uint32_t pass)
{
    return pass < BRUME_PASS_COUNT ? passes[pass].name : "";
}

/* --- Device ------------------------------------------------------------------------------- */

brume_result brume_device_create(const brume_device_params *params, brume_device **out)
{
    static const brume_device_params defaults;
    REQUIRE(out);
    return device_create(params ? params : &defaults, out);
}

void brume_device_destroy(brume_device *device)
{
    if (device)
        device_destroy(device);
}

brume_result brume_device_describe(const brume_device *device, brume_device_info *out)
{
    REQUIRE(device && out);
    *out = device->gpu.context.info;
    return BRUME_OK;
}

/* --- Grids -------------------------------------------------------------------------------- */

brume_result brume_vdb_list(const char *path, brume_grid_info *infos, uint32_t capacity,
                            uint32_t *count)
{
    REQUIRE(path && count);
    REQUIRE(infos || capacity == 0);
    return vdb_list(path, infos, capacity, count);
}

brume_result brume_grid_load_vdb(const char *path, const char *name, uint64_t max_voxels,
                                 uint32_t at_corner, brume_grid **out)
{
    REQUIRE(path && name && out);
    return vdb_load(path, name, max_voxels, at_corner != 0, out);
}

brume_result brume_grid_create(const char *name, const int32_t dims[3], int32_t channels,
                               const float *data, const float object_from_array[16],
                               brume_grid **out)
{
    float inverse[16];
    REQUIRE(dims && data && object_from_array && out);
    REQUIRE(channels == 1 || channels == 3);
    REQUIRE(dims[0] > 0 && dims[1] > 0 && dims[2] > 0);
    REQUIRE((double)dims[0] * dims[1] * dims[2] <= 1e10);
    if (!mat4_invert(object_from_array, inverse))
        return fail(BRUME_E_TRANSFORM, "grid '%s' has a singular or non-finite transform",
                    name ? name : "");
    brume_grid_info info = {.channels = channels, .reduction = 1, .supported = 1};
    snprintf(info.name, sizeof info.name, "%s", name ? name : "");
    snprintf(info.type, sizeof info.type, "%s", channels == 1 ? "float" : "vec3s");
    for (int i = 0; i < 3; ++i) {
        info.dims[i] = dims[i];
        info.file_dims[i] = dims[i];
    }
    memcpy(info.object_from_array, object_from_array, sizeof info.object_from_array);
    brume_grid *grid;
    TRY(field_create(&info, &grid));
    memcpy(grid->data, data,
           (size_t)channels * (size_t)dims[0] * (size_t)dims[1] * (size_t)dims[2] * sizeof *data);
    const brume_result result = field_finish(grid);
    if (result != BRUME_OK) {
        field_release(grid);
        return result;
    }
    *out = grid;
    return BRUME_OK;
}

brume_result brume_grid_describe(const brume_grid *grid, brume_grid_info *out)
{
    REQUIRE(grid && out);
    *out = grid->info;
    return BRUME_OK;
}

void brume_grid_release(brume_grid *grid)
{
    field_release(grid);
}

/* --- Scene -------------------------------------------------------------------------------- */

brume_result brume_scene_create(brume_device *device, brume_scene **out)
{
    REQUIRE(device && out);
    return scene_open(device, out);
}

void brume_scene_destroy(brume_scene *scene)
{
    if (scene)
        scene_close(scene);
}

brume_result brume_scene_remove(brume_scene *scene, uint32_t kind, uint64_t key)
{
    REQUIRE(scene);
    return scene_remove(&scene->scene, kind, key);
}

brume_result brume_scene_keep(brume_scene *scene, uint32_t kind, const uint64_t *keys,
                              uint64_t count)
{
    REQUIRE(scene);
    return scene_keep(&scene->scene, kind, keys, count);
}

/* One shape for all kinds: a checked copy is made first, so that a failure leaves the old one. */
#define SET(scene, kind, key, create, source)                                                      \
    do {                                                                                           \
        struct block *block_;                                                                      \
        REQUIRE((scene) && (source));                                                              \
        TRY(create((source), &block_));                                                            \
        return scene_set(&(scene)->scene, (kind), (key), block_);                                  \
    } while (0)

brume_result brume_scene_set_volume(brume_scene *scene, uint64_t key, const brume_volume *volume)
{
    SET(scene, BRUME_KIND_VOLUME, key, volume_block_create, volume);
}

brume_result brume_scene_set_mesh(brume_scene *scene, uint64_t key, const brume_mesh *mesh)
{
    SET(scene, BRUME_KIND_MESH, key, mesh_create, mesh);
}

brume_result brume_scene_set_instances(brume_scene *scene, uint64_t key,
                                       const brume_instances *instances)
{
    SET(scene, BRUME_KIND_INSTANCES, key, instances_create, instances);
}

brume_result brume_scene_set_material(brume_scene *scene, uint64_t key,
                                      const brume_material *material)
{
    SET(scene, BRUME_KIND_MATERIAL, key, material_create, material);
}

brume_result brume_scene_set_image(brume_scene *scene, uint64_t key, const brume_image *image)
{
    SET(scene, BRUME_KIND_IMAGE, key, image_create, image);
}

brume_result brume_scene_set_light(brume_scene *scene, uint64_t key, const brume_light *light)
{
    SET(scene, BRUME_KIND_LIGHT, key, light_create, light);
}

brume_result brume_scene_set_world(brume_scene *scene, const brume_world *world)
{
    REQUIRE(scene && world);
    return scene_set_world(&scene->scene, world);
}

/* --- Jobs --------------------------------------------------------------------------------- */

brume_result brume_render(brume_scene *scene, const brume_settings *settings,
                          const brume_view *view, brume_job **out)
{
    REQUIRE(scene && view && out);
    return job_create(scene, settings, view, out);
}

brume_result brume_job_poll(const brume_job *job, brume_job_status *out)
{
    REQUIRE(job && out);
    job_poll((brume_job *)job, out); /* locks, so not const inside */
    return BRUME_OK;
}

brume_result brume_job_wait(brume_job *job, int32_t timeout_ms, brume_job_status *out)
{
    REQUIRE(job);
    job_wait(job, timeout_ms, out);
    return BRUME_OK;
}

void brume_job_cancel(brume_job *job)
{
    if (job)
        job_stop(job);
}

const char *brume_job_error(const brume_job *job)
{
    if (!job)
        return "";
    brume_job_status status;
    job_poll((brume_job *)job, &status); /* written once, before the state changes */
    return status.state == BRUME_JOB_FAILED ? job->error : "";
}

brume_result brume_job_warning(const brume_job *job, uint32_t index, const char **id,
                               const char **sentence)
{
    REQUIRE(job && id && sentence);
    brume_job_status status;
    job_poll((brume_job *)job, &status);
    REQUIRE(index < status.warnings);
    if (status.state < BRUME_JOB_DONE)
        return fail(BRUME_E_NOT_READY, "the job has not ended");
    *id = job->control.warnings[index].id;
    *sentence = job->control.warnings[index].sentence;
    return BRUME_OK;
}

brume_result brume_job_stats(const brume_job *job, brume_stats *out)
{
    REQUIRE(job && out);
    return job_stats((brume_job *)job, out);
}

brume_result brume_job_read(brume_job *job, uint32_t pass, float *pixels, uint64_t float_count)
{
    REQUIRE(job && pixels);
    REQUIRE(pass < BRUME_PASS_COUNT);
    return job_read(job, pass, pixels, float_count);
}

void brume_job_release(brume_job *job)
{
    if (job)
        job_release(job);
}

/* --- EXR ---------------------------------------------------------------------------------- */

brume_result brume_exr_write(const char *path, int32_t width, int32_t height,
                             const brume_exr_channel *channels, uint32_t count)
{
    REQUIRE(path && channels);
    REQUIRE(width > 0 && height > 0 && count > 0);
    return exr_write(path, width, height, channels, count);
}

brume_result brume_exr_read(const char *path, int32_t *width, int32_t *height, float **pixels)
{
    REQUIRE(path && width && height && pixels);
    return exr_read(path, width, height, pixels);
}

void brume_free(void *memory)
{
    free(memory);
}
