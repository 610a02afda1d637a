/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Perlin, "Improving Noise", SIGGRAPH 2002, in one to four dimensions: gradients at the corners of
 * unit cells, chosen by a hash of the corner, faded into one another. The hash is Jenkins' lookup3
 * (burtleburtle.net/bob/c/lookup3.c, public domain), as in Blender; with another the same settings
 * would give other clouds. */
#include "scene/noise.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

/* --- Hash ----------------------------------------------------------------------------------- */

static uint32_t turned(uint32_t x, int by)
{
    return x << by | x >> (32 - by);
}

/* Of one to four words. */
static uint32_t hash_words(const uint32_t *words, int count)
{
    uint32_t a = 0xdeadbeefu + ((uint32_t)count << 2) + 13u, b = a, c = a;
    a += words[0];
    b += count > 1 ? words[1] : 0u;
    c += count > 2 ? words[2] : 0u;
    if (count > 3) {
        a -= c, a ^= turned(c, 4), c += b;
        b -= a, b ^= turned(a, 6), a += c;
        c -= b, c ^= turned(b, 8), b += a;
        a -= c, a ^= turned(c, 16), c += b;
        b -= a, b ^= turned(a, 19), a += c;
        c -= b, c ^= turned(b, 4), b += a;
        a += words[3];
    }
    c ^= b, c -= turned(b, 14);
    a ^= c, a -= turned(c, 11);
    b ^= a, b -= turned(a, 25);
    c ^= b, c -= turned(b, 16);
    a ^= c, a -= turned(c, 4);
    b ^= a, b -= turned(a, 14);
    c ^= b, c -= turned(b, 24);
    return c;
}

/* Far away in each dimension, another place for each number: noise there knows nothing of noise
 * here. */
static void far_place(int number, int dimensions, float out[4])
{
    for (int i = 0; i < dimensions; ++i) {
        const float seeds[2] = {(float)number, (float)i};
        uint32_t words[2];
        memcpy(words, seeds, sizeof words);
        out[i] = 100.0f + 100.0f * ((float)hash_words(words, dimensions > 1 ? 2 : 1) /
                                    (float)0xffffffffu);
    }
}

/* --- Noise ---------------------------------------------------------------------------------- */

static float signed_by(float value, uint32_t bit)
{
    return bit ? -value : value;
}

/* A gradient's product with the way from its corner. */
static float along_gradient(uint32_t hash, const float *way, int dimensions)
{
    if (dimensions == 1) {
        const uint32_t h = hash & 15u;
        return signed_by(1.0f + (float)(h & 7u), h & 8u) * way[0];
    }
    if (dimensions == 2) {
        const uint32_t h = hash & 7u;
        const float u = h < 4u ? way[0] : way[1], v = 2.0f * (h < 4u ? way[1] : way[0]);
        return signed_by(u, h & 1u) + signed_by(v, h & 2u);
    }
    if (dimensions == 3) {
        const uint32_t h = hash & 15u;
        const float u = h < 8u ? way[0] : way[1];
        const float v = h < 4u ? way[1] : h == 12u || h == 14u ? way[0] : way[2];
        return signed_by(u, h & 1u) + signed_by(v, h & 2u);
    }
    const uint32_t h = hash & 31u;
    const float u = h < 24u ? way[0] : way[1], v = h < 16u ? way[1] : way[2];
    const float s = h < 8u ? way[2] : way[3];
    return signed_by(u, h & 1u) + signed_by(v, h & 2u) + signed_by(s, h & 4u);
}

/* About -1 to 1. */
static float perlin(const float *point, int dimensions)
{
    /* What brings each to the same range, as Blender has it. */
    static const float scales[] = {0.25f, 0.6616f, 0.982f, 0.8344f};
    uint32_t cell[4];
    float within[4], fade[4], corners[16];
    for (int i = 0; i < dimensions; ++i) {
        /* It repeats so far away: beyond, floats have no place within a cell. */
        const float at = isfinite(point[i]) ? fmodf(point[i], 100000.0f) : 0.0f;
        const float lower = floorf(at), t = at - lower;
        cell[i] = (uint32_t)(int32_t)lower;
        within[i] = t;
        fade[i] = t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f);
    }
    const int count = 1 << dimensions;
    for (int corner = 0; corner < count; ++corner) {
        uint32_t words[4];
        float way[4];
        for (int i = 0; i < dimensions; ++i) {
            const int side = corner >> i & 1;
            words[i] = cell[i] + (uint32_t)side;
            way[i] = within[i] - (float)side;
        }
        corners[corner] = along_gradient(hash_words(words, dimensions), way, dimensions);
    }
    for (int i = 0, left = count / 2; i < dimensions; ++i, left /= 2)
        for (int k = 0; k < left; ++k)
            corners[k] = (1.0f - fade[i]) * corners[2 * k] + fade[i] * corners[2 * k + 1];
    return scales[dimensions - 1] * corners[0];
}

static float octaves(const struct noise *noise, const float point[4])
{
    const float detail = fminf(fmaxf(noise->detail, 0.0f), (float)NOISE_OCTAVES);
    const float roughness = fmaxf(noise->roughness, 0.0f);
    const int whole = (int)detail;
    const float rest = detail - (float)whole;
    float sum = 0.0f, most = 0.0f, amplitude = 1.0f, frequency = 1.0f;
    float without = 0.0f; /* the result without the octave that is faded in */
    for (int i = 0; i <= whole + (rest > 0.0f); ++i) {
        if (i > whole)
            without = noise->normalized ? 0.5f * sum / most + 0.5f : sum;
        float at[4];
        for (int k = 0; k < noise->dimensions; ++k)
            at[k] = frequency * point[k];
        sum += amplitude * perlin(at, noise->dimensions);
        most += amplitude;
        amplitude *= roughness;
        frequency *= noise->lacunarity;
    }
    const float all = noise->normalized ? 0.5f * sum / most + 0.5f : sum;
    return rest > 0.0f ? (1.0f - rest) * without + rest * all : all;
}

/* `number` is that of another place that the noise is taken at; 0: where the point is. */
static float noise_from(const struct noise *noise, const float point[4], int number)
{
    float at[4] = {point[0], point[1], point[2], point[3]}, place[4];
    if (number) {
        far_place(number, noise->dimensions, place);
        for (int i = 0; i < noise->dimensions; ++i)
            at[i] += place[i];
    }
    return octaves(noise, at);
}

void noise_at(const struct noise *noise, const float point[4], bool color, float out[3])
{
    const int dimensions = noise->dimensions;
    float moved[4] = {0.0f};
    for (int i = 0; i < dimensions; ++i) {
        moved[i] = point[i];
        if (noise->distortion != 0.0f) {
            float at[4], place[4];
            far_place(i, dimensions, place);
            for (int k = 0; k < dimensions; ++k)
                at[k] = point[k] + place[k];
            moved[i] += noise->distortion * perlin(at, dimensions);
        }
    }
    out[0] = out[1] = out[2] = noise_from(noise, moved, 0);
    for (int c = 1; c < 3 && color; ++c)
        out[c] = noise_from(noise, moved, dimensions - 1 + c);
}
