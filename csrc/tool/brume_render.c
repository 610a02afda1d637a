/* SPDX-License-Identifier: GPL-3.0-or-later */
/* brume-render: an OpenVDB file in, an OpenEXR picture out, through brume.h alone. Metres, radians;
 * the main thread waits while the library renders. */
#include "brume.h"
#include "tool/compose.h"
#include "tool/options.h"

#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum exit_code {
    EXIT_DONE = 0,
    EXIT_FAILED = 1,
    EXIT_USAGE = 2,
    EXIT_INTERRUPTED = 130, /* 128 + SIGINT, as shells expect */
};

static volatile sig_atomic_t interrupted;

static void interrupt(int signal_number)
{
    (void)signal_number;
    interrupted = 1;
}

/* One sentence on stderr, and the exit code that goes with it. */
static int failed(const char *sentence)
{
    fprintf(stderr, "brume-render: %s\n", sentence);
    return EXIT_FAILED;
}

static void log_verbose(void *user, int32_t level, const char *sentence)
{
    const options *given = user;
    if (given->verbose && level <= BRUME_LOG_INFO)
        fprintf(stderr, "brume-render: %s\n", sentence);
}

static int list_grids(const char *path)
{
    brume_grid_info *infos = NULL;
    uint32_t count = 0, found = 0;

    if (brume_vdb_list(path, NULL, 0, &count) != BRUME_OK)
        return failed(brume_last_error());
    infos = calloc(count ? count : 1, sizeof *infos);
    if (infos == NULL)
        return failed("there is no memory for the list of grids");
    if (brume_vdb_list(path, infos, count, &found) != BRUME_OK) {
        free(infos);
        return failed(brume_last_error());
    }
    if (found < count)
        count = found;
    for (uint32_t i = 0; i < count; i++)
        printf("%-24s %-10s %lld x %lld x %lld%s\n", infos[i].name, infos[i].type,
               (long long)infos[i].file_dims[0], (long long)infos[i].file_dims[1],
               (long long)infos[i].file_dims[2], infos[i].supported ? "" : "  (no medium)");
    free(infos);
    return fflush(stdout) == 0 ? EXIT_DONE : failed("the list could not be written");
}

static brume_result wait_for(brume_job *job)
{
    const bool terminal = isatty(STDERR_FILENO);
    brume_job_status status = {0};

    for (;;) {
        brume_result result = brume_job_wait(job, 100, &status);
        if (result != BRUME_OK)
            return result;
        if (status.state >= BRUME_JOB_DONE)
            break;
        if (interrupted)
            brume_job_cancel(job);
        if (terminal)
            fprintf(stderr, "\r%3.0f %%  %-12s sample %u ", 100.0 * (double)status.progress,
                    brume_stage_name(status.stage), status.samples_done);
    }
    if (terminal)
        fputs("\r\033[K", stderr);
    return status.result;
}

static void print_warnings(const brume_job *job)
{
    const char *id, *sentence;
    for (uint32_t i = 0; brume_job_warning(job, i, &id, &sentence) == BRUME_OK; i++)
        fprintf(stderr, "brume-render: warning: %s\n", sentence);
}

static void print_stats(const brume_job *job)
{
    const double mib = 1024.0 * 1024.0;
    brume_stats stats;

    if (brume_job_stats(job, &stats) != BRUME_OK)
        return;
    printf("%-12s %10s %10s\n", "stage", "wall ms", "gpu ms");
    for (uint32_t i = 0; i < BRUME_STAGE_COUNT; i++)
        printf("%-12s %10.1f %10.1f\n", brume_stage_name(i), stats.stages[i].wall_ms,
               stats.stages[i].gpu_ms);
    for (uint32_t i = 0; i < BRUME_FIELD_PARTS; i++)
        if (stats.field_ms[i] > 0.0)
            printf("  %-21s %10.1f\n", brume_field_part_name(i), stats.field_ms[i]);
    printf("%-12s %10.1f\n", "total", stats.total_ms);
    printf("%-12s %10.1f MiB\n%-12s %10.1f MiB\n", "GPU memory", (double)stats.total_bytes / mib,
           "at its peak", (double)stats.peak_bytes / mib);
    if (stats.iterations > 0)
        printf("%-12s %10u, the last changed %.2g %%\n", "iterations", stats.iterations,
               100.0 * stats.change);
    printf("medium %d x %d x %d, transport %d x %d x %d, %u samples\n", stats.medium_dims[0],
           stats.medium_dims[1], stats.medium_dims[2], stats.transport_dims[0],
           stats.transport_dims[1], stats.transport_dims[2], stats.samples);
}

/* A channel's letter: colours are RGBA, a depth is Z, a normal XYZ. */
static char channel_letter(uint32_t pass, uint32_t channel)
{
    return pass == BRUME_PASS_DEPTH    ? 'Z'
           : pass == BRUME_PASS_NORMAL ? "XYZ"[channel]
                                       : "RGBA"[channel];
}

/* Combined is the file's own R, G, B, A; every other pass a layer of its name. */
static brume_result write_picture(brume_job *job, const brume_view *view, const char *path)
{
    enum { CHANNELS_MAX = 4 * BRUME_PASS_COUNT };
    brume_exr_channel channels[CHANNELS_MAX];
    char names[CHANNELS_MAX][64];
    float *pixels[BRUME_PASS_COUNT] = {NULL};
    const uint64_t area = (uint64_t)view->width * (uint64_t)view->height;
    brume_result result = BRUME_OK;
    uint32_t count = 0;

    for (uint32_t pass = 0; pass < BRUME_PASS_COUNT && result == BRUME_OK; pass++) {
        const uint32_t stride = brume_pass_channels(pass);
        if (!(view->passes >> pass & 1))
            continue;
        pixels[pass] = malloc(area * stride * sizeof(float));
        if (pixels[pass] == NULL) {
            result = BRUME_E_MEMORY;
            failed("there is no memory for the picture");
            break;
        }
        result = brume_job_read(job, pass, pixels[pass], area * stride);
        if (result != BRUME_OK)
            failed(brume_last_error());
        for (uint32_t i = 0; i < stride; i++, count++) {
            const char letter = channel_letter(pass, i);
            if (pass == BRUME_PASS_COMBINED)
                snprintf(names[count], sizeof names[count], "%c", letter);
            else
                snprintf(names[count], sizeof names[count], "%s.%c", brume_pass_name(pass), letter);
            channels[count] = (brume_exr_channel){
                .name = names[count], .pixels = pixels[pass] + i, .stride = stride};
        }
    }
    if (result == BRUME_OK) {
        result = brume_exr_write(path, view->width, view->height, channels, count);
        if (result != BRUME_OK)
            failed(brume_last_error());
    }
    for (uint32_t pass = 0; pass < BRUME_PASS_COUNT; pass++)
        free(pixels[pass]);
    return result;
}

/* From the scene to the file. */
static int render(brume_scene *scene, const options *given, const brume_view *view)
{
    brume_job *job = NULL;
    int code = EXIT_FAILED;

    if (brume_render(scene, &given->settings, view, &job) != BRUME_OK)
        return failed(brume_last_error());
    brume_result result = wait_for(job);
    print_warnings(job);
    if (interrupted || result == BRUME_E_CANCELLED) {
        fputs("brume-render: cancelled, no picture was written\n", stderr);
        code = EXIT_INTERRUPTED;
    } else if (result != BRUME_OK) {
        const char *sentence = brume_job_error(job);
        failed(*sentence ? sentence : brume_result_name(result));
    } else if (write_picture(job, view, given->output) == BRUME_OK) {
        if (given->stats)
            print_stats(job);
        code = EXIT_DONE;
    }
    brume_job_release(job);
    return code;
}

/* A light where the command line names none: what glows by itself needs none. */
static void add_default_light(options *given)
{
    const float direction[3] = {0.5f, 0.6f, -0.8f};
    const bool glows = given->temperature != NULL || given->emission[0] > 0.0f ||
                       given->emission[1] > 0.0f || given->emission[2] > 0.0f;
    if (given->light_count == 0 && given->environment == NULL && isnan(given->background[0]) &&
        !glows)
        options_add_sun(given, direction);
}

/* Minutes of rendering should not end in a folder that does not exist. */
static bool folder_is_writable(const char *path)
{
    const char *slash = strrchr(path, '/');
    char *folder = slash == NULL ? strdup(".") : strndup(path, (size_t)(slash - path) + 1);
    bool writable = folder != NULL && access(folder, W_OK | X_OK) == 0;
    free(folder);
    return writable;
}

static int run(const options *given)
{
    brume_grid *grids[COMPOSE_GRIDS] = {NULL};
    brume_device *device = NULL;
    brume_scene *scene = NULL;
    brume_view view;
    compose_box box;
    int code = EXIT_FAILED;

    if (!folder_is_writable(given->output)) {
        fprintf(stderr, "brume-render: the folder of '%s' is not there or may not be written to\n",
                given->output);
        return EXIT_FAILED;
    }
    if (compose_grids(given, grids) != BRUME_OK || compose_bounds(grids, &box) != BRUME_OK)
        goto error;
    if (!compose_view(given, &box, &view)) {
        fputs("brume-render: --eye and --target are the same point\n", stderr);
        code = EXIT_USAGE;
        goto end;
    }
    const brume_device_params params = {.log = log_verbose, .log_user = (void *)given};
    if (brume_device_create(&params, &device) != BRUME_OK ||
        brume_scene_create(device, &scene) != BRUME_OK ||
        compose_scene(scene, given, grids, &box) != BRUME_OK)
        goto error;
    code = render(scene, given, &view);
    goto end;

error:
    failed(brume_last_error());
end:
    brume_scene_destroy(scene);
    brume_device_destroy(device);
    for (int i = 0; i < COMPOSE_GRIDS; i++)
        brume_grid_release(grids[i]);
    return code;
}

int main(int argc, char **argv)
{
    options given;
    int code;

    if (!options_parse(argc, argv, &given, &code))
        return code;
    if (given.list)
        return list_grids(given.input);
    add_default_light(&given);
    /* the second Ctrl-C ends the program at once */
    sigaction(SIGINT, &(struct sigaction){.sa_handler = interrupt, .sa_flags = SA_RESETHAND}, NULL);
    return run(&given);
}
