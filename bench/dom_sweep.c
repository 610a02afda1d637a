/* SPDX-License-Identifier: GPL-3.0-or-later */
/* DOM's iteration by the library's shaders and in plain C, taking turns: prints a JSON object with
 * the milliseconds of iterations, and how far their fields are apart.
 *
 *     bench_dom_sweep CELLS ORDINATES ITERATIONS ROUNDS
 *
 * A cube of 1 m of a medium that emits light, with nothing around it. */
#include "field.h"
#include "plain.h"

#include "transport/dom.h"

#include <omp.h>

static const struct coefficients glow = {
    .sigma_s = {6, 3, 1.5f}, .sigma_a = {0.5f, 0.5f, 0.5f}, .emission = {1, 1, 1}, .g = 0.5f};

static brume_settings settings_for(int cells, int ordinates, int iterations)
{
    return (brume_settings){.method = BRUME_METHOD_DOM,
                            .medium_resolution = 64,
                            .lattice_resolution = 16,
                            .field_resolution = cells,
                            .ordinates = ordinates,
                            .iterations = iterations,
                            .step = 1.0f,
                            .shadow_resolution = 16,
                            .light_samples = 1,
                            .world_samples = 1};
}

/* The shaders' fields are kept while nothing changes. */
static void disturb(brume_scene *scene, int round)
{
    struct coefficients c = glow;
    c.emission[0] += 1e-5f * (float)(round + 1);
    add_fog_cube(scene, 1, origin, 0.5f, &c);
}

static void start(struct plain *plain, const struct field *field, int ordinates)
{
    const int *dims = dims_of(field);
    if (dims[0] != dims[1] || dims[1] != dims[2] ||
        !plain_init(plain, dims[0], cell_of(field), ordinates, glow.sigma_s, glow.sigma_a,
                    glow.emission, glow.g)) {
        fprintf(stderr, "no cube, or no memory for one of %d cells\n", dims[0]);
        exit(1);
    }
}

/* Sum of absolute differences over sum, and the greatest one over the mean. */
static void compare(const struct plain *plain, const struct field *field, double *off, double *most)
{
    const int n = plain->cells;
    double sum = 0.0, apart = 0.0;
    *most = 0.0;
    for (int i = 0; i < n * n * n; ++i)
        for (int c = 0; c < 3; ++c) {
            const int cell[3] = {i % n, i / n % n, i / (n * n)};
            const double ours = fluence(field, cell, c);
            const double difference = fabs(plain_fluence(plain, i, c) - ours);
            sum += ours;
            apart += difference;
            *most = fmax(*most, difference);
        }
    *off = apart / sum;
    *most *= 3.0 * n * n * n / sum;
}

int main(int count, char **words)
{
    if (count != 5) {
        fprintf(stderr, "bench_dom_sweep CELLS ORDINATES ITERATIONS ROUNDS\n");
        return 2;
    }
    const int cells = atoi(words[1]), ordinates = atoi(words[2]);
    const int iterations = atoi(words[3]), rounds = atoi(words[4]);
    const brume_device_params params = {.shader_dir = TEST_SHADERS};
    if (brume_device_create(&params, &device) != BRUME_OK) {
        fprintf(stderr, "%s\n", brume_last_error());
        return 1;
    }
    brume_scene *scene = empty();
    struct plain plain;
    brume_stats stats;
    double off[2], most[2];
    for (int whole = 0; whole < 2; ++whole) { /* after one iteration, and in the end */
        add_fog_cube(scene, 1, origin, 0.5f, &glow);
        const brume_settings settings = settings_for(cells, ordinates, whole ? 0 : 1);
        struct field field = field_of(scene, &settings, &stats);
        start(&plain, &field, ordinates);
        for (int i = 0; i < (whole ? 60 : 1); ++i)
            plain_iterate(&plain);
        compare(&plain, &field, &off[whole], &most[whole]);
        free(field.texels);
        if (!whole)
            plain_finish(&plain);
    }
    printf("{\"cells\": %d, \"ordinates\": %d, \"threads\": %d, \"iterations\": %d,\n"
           " \"cell_bytes\": %d, \"working_bytes\": %d, \"ordinate_bytes\": %d,\n"
           " \"apart_first\": %.3g, \"most_apart_first\": %.3g, \"apart\": %.3g, "
           "\"most_apart\": %.3g,\n \"rounds\": [",
           plain.cells, ordinates, omp_get_max_threads(), iterations, DOM_CELL_BYTES,
           DOM_WORKING_BYTES, DOM_ORDINATE_BYTES, off[0], most[0], off[1], most[1]);
    const brume_settings settings = settings_for(cells, ordinates, iterations);
    const brume_view view = orthographic_view(origin, (float[3]){0, 0, -1}, 0.1f, 5.0f, 4);
    for (int round = 0; round < rounds; ++round) {
        disturb(scene, round);
        brume_job *job = render(scene, &settings, &view);
        assert_ok(brume_job_stats(job, &stats));
        brume_job_release(job);
        memset(plain.spent_ms, 0, sizeof plain.spent_ms);
        for (int i = 0; i < iterations; ++i)
            plain_iterate(&plain);
        printf("%s\n  {\"shaders_ms\": %.4f, \"source_ms\": %.4f, \"sweep_ms\": %.4f, "
               "\"gather_ms\": %.4f}",
               round ? "," : "", stats.field_ms[BRUME_FIELD_ITERATIONS] / iterations,
               plain.spent_ms[PLAIN_SOURCE] / iterations, plain.spent_ms[PLAIN_SWEEP] / iterations,
               plain.spent_ms[PLAIN_GATHER] / iterations);
    }
    printf("]}\n");
    plain_finish(&plain);
    brume_scene_destroy(scene);
    brume_device_destroy(device);
    return 0;
}
