/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The medium's lattice, summed from its volumes. Any thread, and all cores. */
#include "scene/medium.h"
#include "base/field.h"
#include "base/result.h"
#include "math/frame.h"
#include "scene/medium_place.h"
#include "scene/resample.h"
#include "scene/splat.h"
#include "scene/voxelize.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

/* No coefficient is larger, so that no sum is infinite: a nanometre of it is opaque. */
#define MOST 1e9f

struct build {
    struct medium_lattice *lattice;
    bool (*cancelled)(void *user);
    void *user;
    bool stop;  /* atomic access only, as emits */
    bool emits; /* some cell has emission */
};

/* One volume's share: the box of cells that it reaches, and what gives its values there. */
struct share {
    const struct volume *volume;
    int32_t first[3], dims[3];
    /* grids */
    struct resampler *resamplers; /* grid_count, those of grids not needed stay zeroed */
    bool dark;                    /* where all grids are 0 there is nothing */
    /* meshes */
    float *coverage;
    struct medium_sample constant; /* of a program that is the same everywhere */
    /* Gaussians */
    struct splats splats;
};

/* What a thread needs for a plane of a share. */
struct worker {
    float *scratch;
    double *sums;  /* Gaussians: a plane, as splats_add wants it */
    float *means;  /* 3 floats a cell: per grid a plane, or a row of Gaussians */
    float *inside; /* the part of each cell that counts: a plane, or a row of Gaussians */
    const float **rows;
    struct medium_sample *samples; /* a row */
};

/* cancelled is the caller's, so only the caller's thread asks. */
static bool stopped(struct build *build)
{
    if (omp_get_thread_num() == 0 && build->cancelled && build->cancelled(build->user))
        __atomic_store_n(&build->stop, true, __ATOMIC_RELAXED);
    return __atomic_load_n(&build->stop, __ATOMIC_RELAXED);
}

/* target_from_world with the share's first cell at the origin, applied to world_from_source. */
static void share_from(const struct build *build, const struct share *share,
                       const float world_from_source[16], float out[16])
{
    const struct medium_lattice *lattice = build->lattice;
    for (int column = 0; column < 4; ++column) {
        for (int axis = 0; axis < 3; ++axis) {
            /* In double: far from the world's origin a float has no digits left for cells. */
            double value = world_from_source[4 * column + axis];
            if (column == 3)
                value -= lattice->lower[axis];
            value /= lattice->cell;
            if (column == 3)
                value -= share->first[axis];
            out[4 * column + axis] = (float)value;
        }
        out[4 * column + 3] = column == 3 ? 1.0f : 0.0f;
    }
}

static void share_cells(const struct build *build, struct share *share)
{
    const struct medium_lattice *lattice = build->lattice;
    for (int axis = 0; axis < 3; ++axis) {
        const double size = lattice->dims[axis];
        const double low =
            ((double)share->volume->lower[axis] - lattice->lower[axis]) / lattice->cell;
        const double high =
            ((double)share->volume->upper[axis] - lattice->lower[axis]) / lattice->cell;
        const double first = fmin(fmax(floor(low + SLIVER), 0.0), size - 1.0);
        const double end = fmin(fmax(ceil(high - SLIVER), first + 1.0), size);
        share->first[axis] = (int32_t)first;
        share->dims[axis] = (int32_t)(end - first);
    }
}

/* Where a row of the share's cells lies, from (i, j, k) on along x. In double: far from the world's
 * origin a float has no digits left for cells. */
static struct cell_row row_from(const struct build *build, const struct share *share, int32_t i,
                                int32_t j, int32_t k)
{
    const struct medium_lattice *lattice = build->lattice;
    const struct volume *volume = share->volume;
    const int32_t cell[3] = {i, j, k};
    const float *m = volume->object_from_world;
    struct cell_row row = {.step[BRUME_SPACE_WORLD][0] = lattice->cell};
    double *world = row.first[BRUME_SPACE_WORLD];
    for (int axis = 0; axis < 3; ++axis)
        world[axis] =
            lattice->lower[axis] + (share->first[axis] + cell[axis] + 0.5) * lattice->cell;
    for (int axis = 0; axis < 3; ++axis) {
        const double at = m[axis] * world[0] + m[4 + axis] * world[1] + m[8 + axis] * world[2] +
                          m[12 + axis];
        const double step = (double)m[axis] * lattice->cell;
        const double lower = volume->generated_lower[axis];
        const double side = volume->generated_upper[axis] - lower;
        row.first[BRUME_SPACE_OBJECT][axis] = at;
        row.step[BRUME_SPACE_OBJECT][axis] = step;
        row.first[BRUME_SPACE_GENERATED][axis] = side != 0.0 ? (at - lower) / side : 0.0;
        row.step[BRUME_SPACE_GENERATED][axis] = side != 0.0 ? step / side : 0.0;
    }
    return row;
}

/* Adds count samples, step apart, times weights, to the cells of row (j, k) from i on. */
static void add_row(struct build *build, const struct share *share, int32_t i, int32_t j, int32_t k,
                    int32_t count, const struct medium_sample *samples, size_t step,
                    const float *weights)
{
    const struct medium_lattice *lattice = build->lattice;
    const size_t cell =
        ((size_t)(share->first[2] + k) * (size_t)lattice->dims[1] + (size_t)(share->first[1] + j)) *
            (size_t)lattice->dims[0] +
        (size_t)(share->first[0] + i);
    float *scatter = lattice->scatter + 4 * cell, *extinct = lattice->extinct + 4 * cell;
    float *emission = lattice->emission ? lattice->emission + 4 * cell : NULL;
    bool emits = false;
    for (int32_t n = 0; n < count; ++n, scatter += 4, extinct += 4, samples += step) {
        const float weight = weights[n] * share->volume->scale;
        const float before = scatter[0] + scatter[1] + scatter[2];
        float added = 0.0f;
        for (int c = 0; c < 3; ++c) {
            const float sigma_s = fminf(weight * samples->sigma_s[c], MOST);
            scatter[c] += sigma_s;
            extinct[c] += sigma_s + fminf(weight * samples->sigma_a[c], MOST);
            added += sigma_s;
        }
        if (added > 0.0f)
            scatter[3] += (samples->g - scatter[3]) * (added / (before + added));
        if (emission)
            for (int c = 0; c < 3; ++c) {
                const float emitted = fminf(weight * samples->emission[c], MOST);
                emission[4 * n + c] += emitted;
                emits = emits || emitted > 0.0f;
            }
    }
    if (emits)
        __atomic_store_n(&build->emits, true, __ATOMIC_RELAXED);
}

/* The cells of a row from the first to the last with any weight: to - from of them. */
static void weighted_cells(const float *weights, int32_t width, int32_t *from, int32_t *to)
{
    *from = 0;
    *to = width;
    while (*from < *to && weights[*from] <= 0.0f)
        ++*from;
    while (*from < *to && weights[*to - 1] <= 0.0f)
        --*to;
}

/* samples: room for a row, or NULL where the program is the same everywhere. */
static void add_mesh_plane(struct build *build, const struct share *share,
                           struct medium_sample *samples, int32_t k)
{
    const int32_t *dims = share->dims;
    for (int32_t j = 0; j < dims[1] && !stopped(build); ++j) {
        const float *coverage =
            share->coverage + ((size_t)k * (size_t)dims[1] + (size_t)j) * (size_t)dims[0];
        int32_t from, to;
        weighted_cells(coverage, dims[0], &from, &to);
        if (samples && from < to) {
            const struct cell_row row = row_from(build, share, from, j, k);
            volume_program_run(&share->volume->program, NULL, &row, (uint32_t)(to - from), samples);
        }
        add_row(build, share, from, j, k, to - from, samples ? samples : &share->constant,
                samples ? 1 : 0, coverage + from);
    }
}

/* Whether there is anything to compute for a cell of a plane. */
static bool cell_shows(const struct share *share, const struct worker *worker, size_t cell)
{
    if (worker->inside[cell] <= 0.0f)
        return false;
    if (!share->dark)
        return true;
    for (uint32_t grid = 0; grid < share->volume->grid_count; ++grid)
        if (worker->rows[grid]) {
            const size_t plane = (size_t)share->dims[0] * (size_t)share->dims[1];
            const float *mean = worker->means + 3 * (grid * plane + cell);
            if (mean[0] != 0.0f || mean[1] != 0.0f || mean[2] != 0.0f)
                return true;
        }
    return false;
}

static void add_grid_plane(struct build *build, const struct share *share, struct worker *worker,
                           int32_t k)
{
    const int32_t width = share->dims[0];
    const size_t plane = (size_t)width * (size_t)share->dims[1];
    const uint32_t grid_count = share->volume->grid_count;
    memset(worker->inside, 0, plane * sizeof *worker->inside);
    for (uint32_t grid = 0; grid < grid_count; ++grid) {
        worker->rows[grid] = NULL;
        if (!share->resamplers[grid].field)
            continue;
        worker->rows[grid] = worker->means + 3 * grid * plane;
        resampler_plane(&share->resamplers[grid], k, worker->scratch,
                        worker->means + 3 * grid * plane, worker->inside);
    }
    /* A cell that juts out of the grids has zeros there, which a dark program may be given. */
    for (size_t cell = 0; share->dark && cell < plane; ++cell)
        worker->inside[cell] = 1.0f;

    for (int32_t j = 0; j < share->dims[1] && !stopped(build); ++j) {
        const size_t row = (size_t)j * (size_t)width;
        int32_t from = 0, to = width;
        while (from < to && !cell_shows(share, worker, row + (size_t)from))
            ++from;
        while (from < to && !cell_shows(share, worker, row + (size_t)to - 1))
            --to;
        if (from == to)
            continue;
        /* Another sees the mean over the part of the cell inside the grids, and counts for that
         * part: beyond the grids is nothing, whatever the program makes of zeros. */
        const float *inside = worker->inside + row;
        for (uint32_t grid = 0; grid < grid_count; ++grid) {
            if (!worker->rows[grid])
                continue;
            float *means = worker->means + 3 * (grid * plane + row);
            worker->rows[grid] = means + 3 * from;
            for (int32_t i = from; i < to; ++i)
                if (inside[i] > 0.0f && inside[i] < 1.0f)
                    for (int c = 0; c < 3; ++c)
                        means[3 * i + c] /= inside[i];
        }
        const struct cell_row place = row_from(build, share, from, j, k);
        volume_program_run(&share->volume->program, worker->rows, &place, (uint32_t)(to - from),
                           worker->samples);
        add_row(build, share, from, j, k, to - from, worker->samples, 1, inside + from);
    }
}

static brume_result add_mesh(struct build *build, struct share *share)
{
    const struct volume *volume = share->volume;
    const int32_t *dims = share->dims;
    share->coverage =
        malloc((size_t)dims[0] * (size_t)dims[1] * (size_t)dims[2] * sizeof *share->coverage);
    if (!share->coverage)
        return fail(BRUME_E_MEMORY, "no memory to voxelise volume '%s'", volume->name);
    float from_object[16];
    share_from(build, share, volume->world_from_object, from_object);
    TRY(voxelize_mesh(volume->positions, volume->vertex_count, volume->triangles,
                      volume->triangle_count, from_object, dims, share->coverage));
    const bool placed = volume_program_is_placed(&volume->program);
    if (!placed)
        volume_program_run(&volume->program, NULL, NULL, 1, &share->constant);
    bool memory = true;
#pragma omp parallel reduction(&& : memory)
    {
        struct medium_sample *samples =
            placed ? malloc((size_t)dims[0] * sizeof *samples) : NULL;
        memory = samples || !placed;
#pragma omp for schedule(dynamic)
        for (int32_t k = 0; k < dims[2]; ++k)
            if (memory)
                add_mesh_plane(build, share, samples, k);
        free(samples);
    }
    return memory ? BRUME_OK
                  : fail(BRUME_E_MEMORY, "no memory to fill volume '%s'", volume->name);
}

static bool program_reads(const struct volume_program *program, uint32_t grid)
{
    const brume_volume_program *code = &program->program;
    for (uint32_t i = 0; i < code->instruction_count; ++i)
        if (code->instructions[i].op == BRUME_OP_GRID && code->instructions[i].a == grid)
            return true;
    return false;
}

static bool is_nothing(const struct medium_sample *sample)
{
    for (int c = 0; c < 3; ++c)
        if (sample->sigma_s[c] > 0.0f || sample->sigma_a[c] > 0.0f || sample->emission[c] > 0.0f)
            return false;
    return true;
}

static brume_result prepare_grids(const struct build *build, struct share *share)
{
    const struct volume *volume = share->volume;
    share->resamplers = calloc(volume->grid_count, sizeof *share->resamplers);
    if (!share->resamplers)
        return fail(BRUME_E_MEMORY, "no memory to resample volume '%s'", volume->name);
    bool reads_any = false;
    for (uint32_t grid = 0; grid < volume->grid_count; ++grid)
        reads_any = reads_any || (volume->grids[grid] && program_reads(&volume->program, grid));
    for (uint32_t grid = 0; grid < volume->grid_count; ++grid) {
        /* A program that reads none still fills the grids' boxes. */
        if (!volume->grids[grid] || (reads_any && !program_reads(&volume->program, grid)))
            continue;
        float from_array[16], box_from_array[16];
        mat4_multiply(volume->world_from_object, volume->grids[grid]->info.object_from_array,
                      from_array);
        share_from(build, share, from_array, box_from_array);
        TRY(resampler_init(&share->resamplers[grid], volume->grids[grid], box_from_array,
                           share->dims));
    }
    /* One that asks where it is may give something elsewhere. */
    if (!volume_program_is_placed(&volume->program)) {
        struct medium_sample nothing;
        volume_program_run(&volume->program, NULL, NULL, 1, &nothing);
        share->dark = is_nothing(&nothing);
    }
    return BRUME_OK;
}

static brume_result add_grids(struct build *build, struct share *share)
{
    TRY(prepare_grids(build, share));
    const struct volume *volume = share->volume;
    const uint32_t grid_count = volume->grid_count;
    const size_t plane = (size_t)share->dims[0] * (size_t)share->dims[1];
    size_t scratch = 0;
    for (uint32_t grid = 0; grid < grid_count; ++grid)
        if (share->resamplers[grid].field && resampler_scratch(&share->resamplers[grid]) > scratch)
            scratch = resampler_scratch(&share->resamplers[grid]);

    bool memory = true;
#pragma omp parallel reduction(&& : memory)
    {
        struct worker worker = {
            .scratch = malloc((scratch + 1) * sizeof *worker.scratch),
            .means = malloc(3 * grid_count * plane * sizeof *worker.means),
            .inside = malloc(plane * sizeof *worker.inside),
            .rows = malloc(grid_count * sizeof *worker.rows),
            .samples = malloc((size_t)share->dims[0] * sizeof *worker.samples),
        };
        memory = worker.scratch && worker.means && worker.inside && worker.rows && worker.samples;
#pragma omp for schedule(dynamic)
        for (int32_t k = 0; k < share->dims[2]; ++k)
            if (memory && !stopped(build))
                add_grid_plane(build, share, &worker, k);
        free(worker.scratch);
        free(worker.means);
        free(worker.inside);
        free(worker.rows);
        free(worker.samples);
    }
    return memory ? BRUME_OK
                  : fail(BRUME_E_MEMORY, "no memory to resample volume '%s'", volume->name);
}

/* What the program reads in a row of cells, and the cells that the Gaussians fill. */
static void splat_means(const double *sums, int32_t count, float *density, float *color,
                        float *inside)
{
    for (int32_t i = 0; i < count; ++i, sums += 4) {
        const float mean = (float)sums[3];
        inside[i] = mean > 0.0f ? 1.0f : 0.0f;
        for (int c = 0; c < 3; ++c) {
            density[3 * i + c] = mean;
            color[3 * i + c] = mean > 0.0f ? (float)(sums[c] / sums[3]) : 0.0f;
        }
    }
}

static void add_gaussian_plane(struct build *build, const struct share *share,
                               struct worker *worker, int32_t k)
{
    const size_t splat_count = splats_in_plane(&share->splats, k);
    if (splat_count == 0)
        return;
    const int32_t width = share->dims[0];
    const size_t row = (size_t)width;
    memset(worker->sums, 0, 4 * row * (size_t)share->dims[1] * sizeof *worker->sums);
    for (size_t i = 0; i < splat_count && !stopped(build); ++i)
        splats_add(&share->splats, k, i, worker->sums);

    for (int32_t j = 0; j < share->dims[1] && !stopped(build); ++j) {
        splat_means(worker->sums + 4 * row * (size_t)j, width, worker->means,
                    worker->means + 3 * row, worker->inside);
        int32_t from, to;
        weighted_cells(worker->inside, width, &from, &to);
        if (from == to)
            continue;
        const float *rows[2] = {worker->means + 3 * from, worker->means + 3 * (width + from)};
        const struct cell_row place = row_from(build, share, from, j, k);
        volume_program_run(&share->volume->program, rows, &place, (uint32_t)(to - from),
                           worker->samples);
        add_row(build, share, from, j, k, to - from, worker->samples, 1, worker->inside + from);
    }
}

static bool is_stopped(void *build)
{
    return stopped(build);
}

static brume_result add_gaussians(struct build *build, struct share *share)
{
    const struct volume *volume = share->volume;
    const double cell = build->lattice->cell;
    double lower[3];
    for (int axis = 0; axis < 3; ++axis)
        lower[axis] = build->lattice->lower[axis] + share->first[axis] * cell;
    TRY(splats_init(&share->splats, volume->gaussians, volume->gaussian_count,
                    volume->world_from_object, lower, cell, share->dims, is_stopped, build));
    const size_t width = (size_t)share->dims[0];
    bool memory = true;
#pragma omp parallel reduction(&& : memory)
    {
        struct worker worker = {
            .sums = malloc(4 * width * (size_t)share->dims[1] * sizeof *worker.sums),
            .means = malloc(6 * width * sizeof *worker.means),
            .inside = malloc(width * sizeof *worker.inside),
            .samples = malloc(width * sizeof *worker.samples),
        };
        memory = worker.sums && worker.means && worker.inside && worker.samples;
        /* A plane belongs to one thread: the same sums in the same order for any number. */
#pragma omp for schedule(dynamic)
        for (int32_t k = 0; k < share->dims[2]; ++k)
            if (memory && !stopped(build))
                add_gaussian_plane(build, share, &worker, k);
        free(worker.sums);
        free(worker.means);
        free(worker.inside);
        free(worker.samples);
    }
    return memory
               ? BRUME_OK
               : fail(BRUME_E_MEMORY, "no memory for the Gaussians of volume '%s'", volume->name);
}

static brume_result add_volume(struct build *build, const struct volume *volume)
{
    if (!(volume->lower[0] <= volume->upper[0]))
        return BRUME_OK; /* reaches nowhere */
    struct share share = {.volume = volume};
    share_cells(build, &share);
    const brume_result result = volume->positions   ? add_mesh(build, &share)
                                : volume->gaussians ? add_gaussians(build, &share)
                                                    : add_grids(build, &share);
    splats_finish(&share.splats);
    free(share.coverage);
    for (uint32_t grid = 0; share.resamplers && grid < volume->grid_count; ++grid)
        resampler_finish(&share.resamplers[grid]);
    free(share.resamplers);
    return result;
}

/* Whether the program's emission is more than a constant 0; saves the array's memory where not. */
static bool may_emit(const struct volume_program *program)
{
    const brume_volume_program *code = &program->program;
    for (uint32_t i = code->instruction_count; i-- > 0;) {
        const brume_instruction *instruction = &code->instructions[i];
        if (instruction->dst == code->emission)
            return instruction->op != BRUME_OP_CONSTANT || instruction->value[0] > 0.0f ||
                   instruction->value[1] > 0.0f || instruction->value[2] > 0.0f;
    }
    return false;
}

static brume_result allocate(struct medium_lattice *lattice, struct volume *const *volumes,
                             uint32_t count)
{
    bool emission = false;
    for (uint32_t i = 0; i < count; ++i)
        emission = emission || may_emit(&volumes[i]->program);
    const double cells = (double)lattice->dims[0] * lattice->dims[1] * lattice->dims[2];
    if (cells < (double)SIZE_MAX / 32.0) {
        const size_t values = 4 * (size_t)cells;
        lattice->scatter = calloc(values, sizeof *lattice->scatter);
        lattice->extinct = calloc(values, sizeof *lattice->extinct);
        lattice->emission = emission ? calloc(values, sizeof *lattice->emission) : NULL;
    }
    if (!lattice->scatter || !lattice->extinct || (emission && !lattice->emission))
        return fail(BRUME_E_MEMORY, "no memory for a medium lattice of %d x %d x %d cells",
                    lattice->dims[0], lattice->dims[1], lattice->dims[2]);
    return BRUME_OK;
}

brume_result medium_build(struct volume *const *volumes, uint32_t count, int32_t resolution,
                          uint64_t max_cells, bool (*cancelled)(void *user), void *user,
                          struct medium_lattice *out)
{
    REQUIRE(out != NULL);
    *out = (struct medium_lattice){0};
    REQUIRE(volumes != NULL || count == 0);
    REQUIRE(resolution > 0);

    struct medium_lattice lattice = {0};
    medium_place(&lattice, volumes, count, resolution, max_cells);
    if (lattice.dims[0] == 0)
        return BRUME_OK;

    struct build build = {.lattice = &lattice, .cancelled = cancelled, .user = user};
    brume_result result = allocate(&lattice, volumes, count);
    for (uint32_t i = 0; i < count && result == BRUME_OK && !stopped(&build); ++i)
        result = add_volume(&build, volumes[i]);
    if (result == BRUME_OK && stopped(&build))
        result = fail(BRUME_E_CANCELLED, "the medium was cancelled");
    if (result != BRUME_OK) {
        medium_finish(&lattice);
        return result;
    }
    if (!build.emits) {
        free(lattice.emission);
        lattice.emission = NULL;
    }
    *out = lattice;
    return BRUME_OK;
}

void medium_finish(struct medium_lattice *lattice)
{
    free(lattice->scatter);
    free(lattice->extinct);
    free(lattice->emission);
    *lattice = (struct medium_lattice){0};
}
