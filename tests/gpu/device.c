/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Devices: what a machine without EGL, without OpenGL 4.5 or without the shaders is told, and that
 * devices come, go and stand side by side. Drivers read their environment once a process, so each
 * hostile one is met in a child. */
#include "harness.h"

#include <stdatomic.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#define SAY_ANSWER "--say-answer" /* how this program is called for a child */

static const float origin[3];

struct answer {
    brume_result result;
    char sentence[1024];
};

static char own_path[4096];

/* What the child does: says how brume_device_create ends, a number and a sentence. */
static int say_answer(void)
{
    const brume_device_params params = {.shader_dir = TEST_SHADERS};
    brume_device *made = NULL;
    const brume_result result = brume_device_create(&params, &made);
    printf("%d %s", (int)result, brume_last_error());
    brume_device_destroy(made);
    return 0;
}

/* What brume_device_create answers in a process with these variables, "NAME=value …". A new
 * program, not a fork: libraries have threads by now, and whatever they hold stays held. */
static struct answer ask_with(const char *variables)
{
    struct answer answer = {0};
    char command[sizeof own_path + 256];
    snprintf(command, sizeof command, "env %s '%s' " SAY_ANSWER, variables, own_path);
    FILE *child = popen(command, "r");
    assert_non_null(child);
    int result = 0;
    const int found = fscanf(child, "%d %1023[^\n]", &result, answer.sentence);
    const int status = pclose(child);
    if (status != 0 || found != 2)
        fail_msg("the child ended with status 0x%x", status);
    answer.result = result;
    return answer;
}

static void no_egl(void **state)
{
    (void)state;
    const struct answer answer = ask_with("__EGL_VENDOR_LIBRARY_FILENAMES=/nonexistent.json");
    assert_string_equal(brume_result_name(answer.result), "BRUME_E_NO_EGL");
    assert_non_null(strstr(answer.sentence, "EGL"));
}

/* Mesa pretends on request. */
static void no_gl_45(void **state)
{
    (void)state;
    const struct answer answer =
        ask_with("MESA_GL_VERSION_OVERRIDE=3.3 LIBGL_ALWAYS_SOFTWARE=1");
    assert_string_equal(brume_result_name(answer.result), "BRUME_E_NO_GL");
    assert_non_null(strstr(answer.sentence, "OpenGL 4.5"));
    assert_non_null(strstr(answer.sentence, "llvmpipe"));
    assert_non_null(strstr(answer.sentence, "3.3"));
}

static void no_shader_folder(void **state)
{
    (void)state;
    const brume_device_params params = {.shader_dir = "/nonexistent/shaders"};
    brume_device *made = NULL;
    assert_int_equal(brume_device_create(&params, &made), BRUME_E_FILE_MISSING);
    assert_null(made);
    assert_non_null(strstr(brume_last_error(), "/nonexistent/shaders"));
}

static void write_text(const char *folder, const char *name, const char *text)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
}

static void expect_failure(brume_scene *scene, brume_result expected, const char *word)
{
    const brume_view view = orthographic_view(origin, (float[3]){0, 0, -1}, 1.0f, 2.0f, 8);
    brume_job *job;
    brume_job_status status;
    assert_ok(brume_render(scene, NULL, &view, &job));
    assert_ok(brume_job_wait(job, -1, &status));
    assert_int_equal(status.state, BRUME_JOB_FAILED);
    assert_string_equal(brume_result_name((brume_result)status.result),
                        brume_result_name(expected));
    if (!strstr(brume_job_error(job), word))
        fail_msg("'%s' does not name %s", brume_job_error(job), word);
    brume_job_release(job);
}

/* A folder with the wrong contents fails the job, which names the shader. */
static void broken_shaders(void **state)
{
    (void)state;
    char folder[] = "/tmp/brume-shaders-XXXXXX", path[256];
    assert_non_null(mkdtemp(folder));
    const brume_device_params params = {.shader_dir = folder};
    brume_scene *scene;
    assert_ok(brume_device_create(&params, &device));
    assert_ok(brume_scene_create(device, &scene));
    expect_failure(scene, BRUME_E_FILE_MISSING, ".glsl");
    write_text(folder, "gbuffer.vert.glsl", "#version 450 core\nnonsense\n");
    write_text(folder, "gbuffer.frag.glsl", "#version 450 core\nvoid main() {}\n");
    add_plate(scene, 1, origin, (float[3]){0, 0, -1}, 1.0f);
    expect_failure(scene, BRUME_E_GPU, "gbuffer.vert.glsl");
    brume_scene_destroy(scene);
    brume_device_destroy(device);
    static const char *const names[] = {"gbuffer.vert.glsl", "gbuffer.frag.glsl"};
    for (int i = 0; i < 2; ++i) {
        snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        unlink(path);
    }
    rmdir(folder);
}

static brume_device *plain_device(void)
{
    const brume_device_params params = {.shader_dir = TEST_SHADERS, .debug = 1};
    brume_device *made = NULL;
    assert_ok(brume_device_create(&params, &made));
    return made;
}

static void describes_itself(void **state)
{
    (void)state;
    brume_device_info info;
    brume_device *made = plain_device();
    assert_ok(brume_device_describe(made, &info));
    assert_true(info.gl_major * 10 + info.gl_minor >= 45);
    assert_true(info.renderer[0] != '\0' && info.version[0] != '\0');
    assert_true(info.max_texture_3d >= 2048);
    assert_int_equal(info.software != 0, strstr(info.renderer, "llvmpipe") != NULL);
    assert_int_equal(brume_device_describe(NULL, &info), BRUME_E_ARGUMENT);
    assert_int_equal(brume_device_describe(made, NULL), BRUME_E_ARGUMENT);
    brume_device_destroy(made);
    brume_device_destroy(NULL);
}

static void fill(brume_scene *scene)
{
    static const struct coefficients fog = {.sigma_s = {1, 1, 1}, .sigma_a = {1, 1, 1}};
    add_fog_cube(scene, 1, origin, 0.5f, &fog);
    add_sun(scene, 1, (float[3]){0.2f, 0.1f, -1});
}

static double brightness(brume_scene *scene)
{
    const brume_settings settings = {.medium_resolution = 8, .lattice_resolution = 4};
    brume_view view = orthographic_view(origin, (float[3]){0, 0, -1}, 0.5f, 2.0f, 8);
    view.samples = 1;
    brume_job *job = render(scene, &settings, &view);
    float *pixels = read_pass(job, &view, BRUME_PASS_COMBINED);
    const double value = middle(pixels, &view, 4, 0);
    free(pixels);
    brume_job_release(job);
    return value;
}

static void twenty_times(void **state)
{
    (void)state;
    double first = 0.0;
    for (int i = 0; i < 20; ++i) {
        brume_scene *scene;
        device = plain_device();
        assert_ok(brume_scene_create(device, &scene));
        if (i % 5 == 0) {
            fill(scene);
            const double value = brightness(scene);
            assert_true(value > 0.0);
            if (i == 0)
                first = value;
            assert_true(value == first);
        }
        brume_scene_destroy(scene);
        brume_device_destroy(device);
    }
}

static void two_devices_two_scenes(void **state)
{
    (void)state;
    brume_device *devices[2] = {plain_device(), plain_device()};
    brume_scene *scenes[3];
    double values[3];
    for (int i = 0; i < 3; ++i) {
        assert_ok(brume_scene_create(devices[i % 2], &scenes[i]));
        fill(scenes[i]);
    }
    for (int i = 0; i < 3; ++i)
        values[i] = brightness(scenes[i]);
    for (int i = 0; i < 3; ++i)
        assert_true(values[i] == values[0] && brightness(scenes[i]) == values[0]);
    brume_scene_destroy(scenes[1]);
    brume_device_destroy(devices[1]);
    assert_true(brightness(scenes[0]) == values[0]);
    brume_scene_destroy(scenes[0]);
    assert_true(brightness(scenes[2]) == values[0]);
    brume_scene_destroy(scenes[2]);
    brume_device_destroy(devices[0]);
}

/* The wrong order is the caller's mistake, which a garbage collector makes easily. */
static void scene_outlives_its_device(void **state)
{
    (void)state;
    brume_scene *scene;
    device = plain_device();
    assert_ok(brume_scene_create(device, &scene));
    fill(scene);
    const double before = brightness(scene);
    brume_device_destroy(device);
    assert_true(brightness(scene) == before);
    brume_scene_destroy(scene);
}

static atomic_int sentences;

static void count_sentence(void *user, int32_t level, const char *sentence)
{
    (void)user, (void)level, (void)sentence;
    atomic_fetch_add(&sentences, 1);
}

/* A log function is not called once its device is gone or was never made. */
static void log_is_given_back(void **state)
{
    (void)state;
    brume_device_params params = {.shader_dir = "/nonexistent", .log = count_sentence};
    brume_device *made = NULL;
    brume_scene *scene;
    assert_int_equal(brume_device_create(&params, &made), BRUME_E_FILE_MISSING);
    assert_int_equal(atomic_load(&sentences), 0);
    params.shader_dir = TEST_SHADERS;
    assert_ok(brume_device_create(&params, &device));
    assert_true(atomic_load(&sentences) > 0); /* the renderer's name, at the least */

    /* Each of these renders has something to warn of, also the one after the log was taken back. */
    const brume_settings tight = {.medium_resolution = 512, .lattice_resolution = 4,
                                  .memory_budget = 1 << 20};
    assert_ok(brume_scene_create(device, &scene));
    for (int turn = 0; turn < 2; ++turn) {
        brume_view view = orthographic_view(origin, (float[3]){0, 0, -1}, 0.5f, 2.0f, 8);
        view.samples = 1;
        if (turn)
            brume_device_destroy(device);
        fill(scene);
        const int before = atomic_load(&sentences);
        brume_job *job = render(scene, &tight, &view);
        brume_job_status status;
        assert_ok(brume_job_poll(job, &status));
        assert_true(status.warnings > 0);
        brume_job_release(job);
        assert_int_equal(atomic_load(&sentences) > before, turn == 0);
    }
    brume_scene_destroy(scene);
}

int main(int count, char **arguments)
{
    if (count == 2 && strcmp(arguments[1], SAY_ANSWER) == 0)
        return say_answer();
    if (readlink("/proc/self/exe", own_path, sizeof own_path - 1) < 0)
        return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_egl),
        cmocka_unit_test(no_gl_45),
        cmocka_unit_test(no_shader_folder),
        cmocka_unit_test(broken_shaders),
        cmocka_unit_test(describes_itself),
        cmocka_unit_test(twenty_times),
        cmocka_unit_test(two_devices_two_scenes),
        cmocka_unit_test(scene_outlives_its_device),
        cmocka_unit_test(log_is_given_back),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
