/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The world's samples, means along directions and suns: together they send what the world does in each
 * colour, from where it is bright. */
#include "base/result.h"
#include "math/frame.h"
#include "scene/scene.h"
#include "scene/world.h"
#include "scene/world_map.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define PI 3.14159265358979323846
#define WIDTH 512
#define HEIGHT 256
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

static void sample(const brume_world *world, const struct world_map *map,
                   struct gpu_light_sample *out, double sum[3])
{
    assert_int_equal(world_samples(world, map, COUNT, out), BRUME_OK);
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
    struct world_map map = {0};
    double sum[3], balance[3] = {0.0};
    assert_int_equal(world_map_update(&map, NULL, 1), BRUME_OK);
    assert_int_equal(map.spot_count, 0);
    sample(&world, &map, samples, sum);
    world_map_finish(&map);
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

/* A quarter turn about Z: the image's X is the world's Y. Stretched, which changes nothing. */
static const brume_world turned = {
    .color = {1.0f, 1.0f, 1.0f},
    .image_from_world = {0, -3, 0, 0, 3, 0, 0, 0, 0, 0, 3, 0, 0, 0, 0, 1},
};

static void draw_sky(void)
{
    for (int y = 0; y < HEIGHT; ++y) {
        for (int x = 0; x < WIDTH; ++x) {
            float *p = pixels + 4 * (y * WIDTH + x);
            p[0] = 0.1f + 0.4f * (float)x / WIDTH;
            p[1] = 0.3f;
            p[2] = 0.2f + 0.3f * (float)y / HEIGHT;
        }
    }
}

/* Adds light around a direction, within a radius. */
static void draw_disk(const double direction[3], double radius, float red, float green, float blue)
{
    const double size =
        sqrt(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2]);
    for (int y = 0; y < HEIGHT; ++y) {
        for (int x = 0; x < WIDTH; ++x) {
            float d[3], *p = pixels + 4 * (y * WIDTH + x);
            world_direction(PI * (y + 0.5) / HEIGHT, PI - 2.0 * PI * (x + 0.5) / WIDTH, d);
            const double cosine =
                (d[0] * direction[0] + d[1] * direction[1] + d[2] * direction[2]) / size;
            if (cosine < cos(radius))
                continue;
            p[0] += red;
            p[1] += green;
            p[2] += blue;
        }
    }
}

static struct world_map map_of_pixels(void)
{
    const struct image_block image = {.width = WIDTH, .height = HEIGHT, .pixels = pixels};
    struct world_map map = {0};
    assert_int_equal(world_map_update(&map, &image, 2), BRUME_OK);
    return map;
}

static void bright_part_is_where_it_is(void **state)
{
    (void)state;
    draw_sky();
    draw_disk((const double[]){1.0, 0.0, 0.0}, 0.4, 40.0f, 0.0f, 0.0f);
    struct world_map map = map_of_pixels();
    assert_int_equal(map.spot_count, 0); /* it is wide */
    struct gpu_light_sample samples[COUNT];
    double sum[3];
    sample(&turned, &map, samples, sum);
    for (int c = 0; c < 3; ++c) /* the table's rows take the solid angle at their middle */
        assert_true(fabs(sum[c] / integral(c) - 1.0) < 2e-3);
    double bright = 0.0;
    for (int i = 0; i < COUNT; ++i)
        if (samples[i].position.y > 0.9f)
            bright += samples[i].weight.x;
    const double disk = 40.0 * 2.0 * PI * (1.0 - cos(0.4));
    assert_true(fabs(bright / disk - 1.0) < 0.15);
    world_map_finish(&map);
}

/* A sun a degree wide and a softer one, beside a wide bright part, which stays in the table. */
static void suns_are_taken_out(void **state)
{
    (void)state;
    const double high[3] = {0.3, -0.2, 0.9}, low[3] = {-1.0, -0.01, 0.05}, wide[3] = {0.0, 1.0, 0.0};
    draw_sky();
    draw_disk(wide, 0.5, 3.0f, 3.0f, 3.0f);
    const double without[3] = {integral(0), integral(1), integral(2)};
    draw_disk(high, 0.01, 20000.0f, 10000.0f, 5000.0f);
    const double sun[3] = {integral(0) - without[0], integral(1) - without[1],
                           integral(2) - without[2]};
    draw_disk(low, 0.06, 90.0f, 90.0f, 180.0f);
    struct world_map map = map_of_pixels();
    assert_int_equal(map.spot_count, 2);
    const struct world_spot *one = map.spots, *other = map.spots + 1;
    if (one->direction[2] < 0.5f) {
        one = map.spots + 1;
        other = map.spots;
    }
    double apart = 0.0;
    for (int i = 0; i < 3; ++i) {
        const double off = one->direction[i] - high[i] / sqrt(0.94);
        apart += off * off;
        assert_true(fabs(one->irradiance[i] / sun[i] - 1.0) < 0.02);
    }
    assert_true(sqrt(apart) < 0.005);
    assert_true(one->radius > 0.006f && one->radius < 0.02f); /* a pixel is 0.012 wide */
    assert_true(other->direction[0] < -0.99f); /* on both sides of the image's edge */
    assert_true(other->radius > 0.05f && other->radius < 0.07f);

    /* Nothing is lost, nothing counted twice. */
    struct gpu_light_sample samples[COUNT];
    double sum[3];
    sample(&turned, &map, samples, sum);
    for (int c = 0; c < 3; ++c) {
        const double all =
            sum[c] + (double)one->irradiance[c] + (double)other->irradiance[c];
        assert_true(fabs(all / integral(c) - 1.0) < 2e-3);
    }
    brume_light lamp;
    world_sun(one, &turned, &lamp);
    /* The image's (0.3, -0.2, 0.9) is (0.2, 0.3, 0.9) after a quarter turn. */
    const float *towards = lamp.world_from_light + 8;
    assert_true(fabs(towards[0] - 0.2 / sqrt(0.94)) < 0.005);
    assert_true(fabs(towards[1] - 0.3 / sqrt(0.94)) < 0.005);
    assert_int_equal(lamp.type, BRUME_LIGHT_SUN);
    assert_true(lamp.power[0] == one->irradiance[0] && lamp.cast_shadow && !lamp.camera_visible);
    world_map_finish(&map);
}

/* Of more suns than lamps are made of, the one that sends most is a lamp, wherever it stands. */
static void brightest_comes_first(void **state)
{
    (void)state;
    draw_sky();
    for (int i = 0; i < 8; ++i)
        draw_disk((const double[]){cos(i * 0.75), sin(i * 0.75), -0.3}, 0.03, 9e3f, 9e3f, 9e3f);
    draw_disk((const double[]){0.3, 0.2, 0.9}, 0.012, 1e6f, 1e6f, 1e6f);
    struct world_map map = map_of_pixels();
    assert_int_equal(map.spot_count, WORLD_SPOTS);
    assert_true(map.spots[0].direction[2] > 0.9f);
    for (int i = 1; i < WORLD_SPOTS; ++i)
        assert_true(map.spots[i].irradiance[0] < 0.2f * map.spots[0].irradiance[0]);
    world_map_finish(&map);
}

/* What a coarse quadrature takes of the world is all of it, from about where it is. */
static void means_send_what_the_world_does(void **state)
{
    (void)state;
    draw_sky();
    draw_disk((const double[]){1.0, 0.0, 0.0}, 0.4, 40.0f, 0.0f, 0.0f);
    struct world_map map = map_of_pixels();
    vec4 towards[6] = {{1, 0, 0, 0}, {-1, 0, 0, 0}, {0, 1, 0, 0},
                       {0, -1, 0, 0}, {0, 0, 1, 0}, {0, 0, -1, 0}};
    vec4 means[6];
    for (int i = 0; i < 6; ++i)
        towards[i].w = (float)(4.0 * PI / 6.0);
    world_means(&map, &turned, towards, 6, means);
    double sums[3] = {0.0};
    for (int i = 0; i < 6; ++i)
        for (int c = 0; c < 3; ++c)
            sums[c] += (double)(&means[i].x)[c] * (double)towards[i].w;
    for (int c = 0; c < 3; ++c)
        assert_true(fabs(sums[c] / integral(c) - 1.0) < 1e-3);
    assert_true(means[2].x > 5.0f * means[3].x); /* the image's X is the world's Y */
    assert_true(means[4].z > 1.2f * means[5].z); /* rows go up */
    world_map_finish(&map);
}

/* Whatever is in an image: no light is made, none is not a number. */
static void odd_images(void **state)
{
    (void)state;
    memset(pixels, 0, sizeof pixels);
    struct world_map map = map_of_pixels();
    assert_int_equal(map.spot_count, 0);
    world_map_finish(&map);
    /* More suns than lamps are made of, one of them on the pole, and one hot pixel. */
    draw_sky();
    for (int i = 0; i < 12; ++i)
        draw_disk((const double[]){cos(i * 0.5), sin(i * 0.5), 0.1 * i}, 0.03, 900.0f, 900.0f, 900.0f);
    draw_disk((const double[]){0.0, 0.0, 1.0}, 0.03, 900.0f, 900.0f, 900.0f);
    pixels[4 * (30 * WIDTH + 100)] = 3e38f;
    map = map_of_pixels();
    assert_true(map.spot_count <= WORLD_SPOTS);
    double sum[3];
    struct gpu_light_sample samples[COUNT];
    sample(&turned, &map, samples, sum);
    for (uint32_t i = 0; i < map.spot_count; ++i)
        for (int c = 0; c < 3; ++c) {
            assert_true(isfinite(map.spots[i].irradiance[c]) && map.spots[i].irradiance[c] >= 0.0f);
            assert_true(isfinite(map.spots[i].direction[c]));
        }
    for (int c = 0; c < 3; ++c)
        assert_true(isfinite(sum[c]) && sum[c] >= 0.0);
    world_map_finish(&map);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(plain_world_sends_four_pi),
        cmocka_unit_test(bright_part_is_where_it_is),
        cmocka_unit_test(suns_are_taken_out),
        cmocka_unit_test(brightest_comes_first),
        cmocka_unit_test(means_send_what_the_world_does),
        cmocka_unit_test(odd_images),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
