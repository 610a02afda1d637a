/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The world's samples: they send what the world does in each colour, and see where it is bright. */
#include "base/result.h"
#include "math/frame.h"
#include "scene/scene.h"
#include "scene/world.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

#define PI 3.14159265358979323846
#define WIDTH 64
#define HEIGHT 32
#define COUNT 32

static float pixels[4 * WIDTH * HEIGHT];

/* Total radiance over the sphere of one channel of the image. */
static double integral(int channel)
{
    double sum = 0.0;
    for (int y = 0; y < HEIGHT; ++y) {
        const double solid =
            (cos(PI * y / HEIGHT) - cos(PI * (y + 1) / HEIGHT)) * 2.0 * PI / WIDTH;
        for (int x = 0; x < WIDTH; ++x)
            sum += solid * pixels[4 * (y * WIDTH + x) + channel];
    }
    return sum;
}

static void sample(const brume_world *world, const struct image_block *image,
                   const float world_from_image[16], struct gpu_light_sample *out, double sum[3])
{
    assert_int_equal(world_samples(world, image, world_from_image, COUNT, out), BRUME_OK);
    sum[0] = sum[1] = sum[2] = 0.0;
    for (int i = 0; i < COUNT; ++i) {
        const vec4 d = out[i].position;
        assert_true(fabs(d.x * d.x + d.y * d.y + d.z * d.z - 1.0) < 1e-5);
        sum[0] += out[i].weight.x;
        sum[1] += out[i].weight.y;
        sum[2] += out[i].weight.z;
    }
}

static void plain_world_sends_four_pi(void **state)
{
    (void)state;
    const brume_world world = {.color = {0.5f, 1.0f, 2.0f}};
    struct gpu_light_sample samples[COUNT];
    float identity[16];
    double sum[3], balance[3] = {0.0};
    mat4_identity(identity);
    sample(&world, NULL, identity, samples, sum);
    for (int c = 0; c < 3; ++c)
        assert_true(fabs(sum[c] / (4.0 * PI * world.color[c]) - 1.0) < 1e-4);
    for (int i = 0; i < COUNT; ++i) {
        balance[0] += samples[i].position.x / COUNT;
        balance[1] += samples[i].position.y / COUNT;
        balance[2] += samples[i].position.z / COUNT;
    }
    /* 32 random directions would be off by 0.1 in each axis. */
    for (int c = 0; c < 3; ++c)
        assert_true(fabs(balance[c]) < 0.03);
}

static void image_keeps_its_power_and_turns(void **state)
{
    (void)state;
    for (int y = 0; y < HEIGHT; ++y) {
        for (int x = 0; x < WIDTH; ++x) {
            float *p = pixels + 4 * (y * WIDTH + x);
            p[0] = 0.1f + 0.4f * (float)x / WIDTH;
            p[1] = 0.3f;
            p[2] = 0.2f + 0.3f * (float)y / HEIGHT;
        }
    }
    /* A bright spot on the equator in the image's centre column: it looks along +X. */
    pixels[4 * (HEIGHT / 2 * WIDTH + WIDTH / 2)] += 400.0f;
    const struct image_block image = {.width = WIDTH, .height = HEIGHT, .pixels = pixels};
    const brume_world world = {.color = {1.0f, 1.0f, 1.0f}};
    struct gpu_light_sample samples[COUNT];
    double sum[3];
    /* A quarter turn about Z: X to Y. */
    const float turn[16] = {0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    sample(&world, &image, turn, samples, sum);
    for (int c = 0; c < 3; ++c) /* the table's rows take the solid angle at their middle */
        assert_true(fabs(sum[c] / integral(c) - 1.0) < 2e-3);
    double bright = 0.0;
    for (int i = 0; i < COUNT; ++i)
        if (samples[i].position.y > 0.99)
            bright += samples[i].weight.x;
    const double spot = 400.0 * (2.0 * PI / WIDTH) * (PI / HEIGHT);
    assert_true(bright > 0.8 * spot);
    assert_true(bright < 1.2 * spot);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(plain_world_sends_four_pi),
        cmocka_unit_test(image_keeps_its_power_and_turns),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
