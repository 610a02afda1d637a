/* SPDX-License-Identifier: GPL-3.0-or-later */
/* OpenEXR files: round trip, orientation, kinds of files, damage. */
#define _GNU_SOURCE /* memmem */
#include "base/result.h"
#include "io/exr.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <dirent.h>
#include <math.h>
#include <openexr.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

/* The initializers that OpenEXR 3.4 has for its pipelines name the first fields only. */
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"

static char folder[64];

static const char *in_folder(const char *name)
{
    static char path[4][sizeof folder + 256]; /* 255: the longest name in a folder */
    static int turn;
    turn = (turn + 1) % 4;
    snprintf(path[turn], sizeof path[turn], "%s/%s", folder, name);
    return path[turn];
}

static int make_folder(void **state)
{
    (void)state;
    strcpy(folder, "/tmp/brume-exr-XXXXXX");
    return mkdtemp(folder) ? 0 : -1;
}

static int files_in_folder(void)
{
    DIR *directory = opendir(folder);
    int count = 0;
    for (struct dirent *entry; (entry = readdir(directory));)
        count += entry->d_name[0] != '.';
    closedir(directory);
    return count;
}

static int remove_folder(void **state)
{
    (void)state;
    DIR *directory = opendir(folder);
    for (struct dirent *entry; (entry = readdir(directory));)
        if (entry->d_name[0] != '.')
            unlink(in_folder(entry->d_name));
    closedir(directory);
    return rmdir(folder);
}

static char *slurp(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    *size = (size_t)ftell(file);
    rewind(file);
    char *bytes = malloc(*size + 1);
    assert_int_equal(fread(bytes, 1, *size, file), *size);
    fclose(file);
    return bytes;
}

static void spill(const char *path, const char *bytes, size_t size)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    fclose(file);
}

static float pattern(int32_t x, int32_t y, int channel)
{
    return (float)(x + 100 * y) * 0.37f + (float)channel * 1000.0f;
}

/* --- Files of other kinds, by OpenEXR itself ------------------------------------------------ */

#define CHECK(call) assert_int_equal((call), EXR_ERR_SUCCESS)

struct recipe {
    exr_pixel_type_t type;
    exr_compression_t compression;
    int32_t left, top, width, height; /* data window */
    int32_t tile;                     /* 0: scanlines */
    const char *channels;             /* one letter each, sorted; values are pattern() of "RGBA" */
    int sampling;
    const char *first_part; /* channels of a part before this one; NULL: none */
};

static void store(void *to, exr_pixel_type_t type, int32_t x, int32_t y, char channel)
{
    const char *where = strchr("RGBAY", channel);
    const float value = pattern(x, y, (int)(where - "RGBAY"));
    if (type == EXR_PIXEL_FLOAT) {
        *(float *)to = value;
    } else if (type == EXR_PIXEL_UINT) {
        *(uint32_t *)to = (uint32_t)value;
    } else {
        /* Small whole numbers, exact in half: 10 bits of mantissa. */
        const unsigned whole = (unsigned)(x + y) % 32 + 1;
        unsigned exponent = 15, mantissa;
        unsigned power = 1;
        while (power * 2 <= whole) {
            power *= 2;
            ++exponent;
        }
        mantissa = (whole - power) * 1024 / power;
        *(uint16_t *)to = (uint16_t)(exponent << 10 | mantissa);
    }
}

static float expected(exr_pixel_type_t type, int32_t x, int32_t y, char channel)
{
    const float value = pattern(x, y, (int)(strchr("RGBAY", channel) - "RGBAY"));
    if (type == EXR_PIXEL_FLOAT)
        return value;
    if (type == EXR_PIXEL_UINT)
        return (float)(uint32_t)value;
    return (float)((x + y) % 32 + 1);
}

static void write_part(exr_context_t context, int part, const struct recipe *recipe,
                       const char *channels)
{
    const int bytes = recipe->type == EXR_PIXEL_HALF ? 2 : 4;
    const int32_t tile = recipe->tile;
    int32_t rows = tile, columns = tile ? tile : recipe->width;
    if (!tile)
        CHECK(exr_get_scanlines_per_chunk(context, part, &rows));
    char *plane = calloc(strlen(channels), (size_t)rows * (size_t)columns * (size_t)bytes);
    for (int32_t top = 0; top < recipe->height; top += rows) {
        for (int32_t left = 0; left < recipe->width; left += columns) {
            exr_chunk_info_t chunk;
            exr_encode_pipeline_t encoder = EXR_ENCODE_PIPELINE_INITIALIZER;
            if (tile)
                CHECK(exr_write_tile_chunk_info(context, part, left / tile, top / tile, 0, 0,
                                                &chunk));
            else
                CHECK(exr_write_scanline_chunk_info(context, part, recipe->top + top, &chunk));
            CHECK(exr_encoding_initialize(context, part, &chunk, &encoder));
            for (int16_t i = 0; i < encoder.channel_count; ++i) {
                char *data = plane + (size_t)i * (size_t)rows * (size_t)columns * (size_t)bytes;
                exr_coding_channel_info_t *coded = &encoder.channels[i];
                for (int32_t y = 0; y < coded->height; ++y)
                    for (int32_t x = 0; x < coded->width; ++x)
                        store(data + (y * coded->width + x) * bytes, recipe->type, left + x,
                              top + y, coded->channel_name[0]);
                coded->encode_from_ptr = (const uint8_t *)data;
                coded->user_pixel_stride = bytes;
                coded->user_line_stride = bytes * coded->width;
            }
            CHECK(exr_encoding_choose_default_routines(context, part, &encoder));
            CHECK(exr_encoding_run(context, part, &encoder));
            CHECK(exr_encoding_destroy(context, &encoder));
        }
    }
    free(plane);
}

static void write_recipe(const char *path, const struct recipe *recipe)
{
    exr_context_initializer_t setup = EXR_DEFAULT_CONTEXT_INITIALIZER;
    exr_context_t context;
    const char *parts[2] = {recipe->channels, NULL};
    int count = 1;
    if (recipe->first_part) {
        parts[0] = recipe->first_part;
        parts[1] = recipe->channels;
        count = 2;
    }
    CHECK(exr_start_write(&context, path, EXR_WRITE_FILE_DIRECTLY, &setup));
    for (int p = 0; p < count; ++p) {
        int part;
        CHECK(exr_add_part(context, p ? "second" : "first",
                           recipe->tile ? EXR_STORAGE_TILED : EXR_STORAGE_SCANLINE, &part));
        const exr_attr_box2i_t data = {
            .min = {.x = recipe->left, .y = recipe->top},
            .max = {.x = recipe->left + recipe->width - 1, .y = recipe->top + recipe->height - 1}};
        const exr_attr_box2i_t display = {.max = {.x = 9, .y = 9}};
        const exr_attr_v2f_t centre = {.x = 0.0f};
        CHECK(exr_initialize_required_attr(context, part, &display, &data, 1.0f, &centre, 1.0f,
                                           EXR_LINEORDER_INCREASING_Y, recipe->compression));
        if (recipe->tile)
            CHECK(exr_set_tile_descriptor(context, part, (uint32_t)recipe->tile,
                                          (uint32_t)recipe->tile, EXR_TILE_ONE_LEVEL,
                                          EXR_TILE_ROUND_DOWN));
        for (const char *channel = parts[p]; *channel; ++channel) {
            const char name[2] = {*channel, '\0'};
            const int sampling = recipe->sampling ? recipe->sampling : 1;
            CHECK(exr_add_channel(context, part, name, recipe->type, EXR_PERCEPTUALLY_LOGARITHMIC,
                                  sampling, sampling));
        }
    }
    CHECK(exr_write_header(context));
    for (int p = 0; p < count; ++p)
        write_part(context, p, recipe, parts[p]);
    CHECK(exr_finish(&context));
}

static void check_recipe(const struct recipe *recipe)
{
    const char *path = in_folder("recipe.exr");
    write_recipe(path, recipe);
    int32_t width = 0, height = 0;
    float *pixels = NULL;
    const brume_result result = exr_read(path, &width, &height, &pixels);
    if (result != BRUME_OK)
        fail_msg("%s", last_error());
    assert_int_equal(width, recipe->width);
    assert_int_equal(height, recipe->height);
    const int grey = strchr(recipe->channels, 'Y') != NULL;
    for (int32_t y = 0; y < height; ++y) {
        for (int32_t x = 0; x < width; ++x) {
            const float *pixel = pixels + ((height - 1 - y) * width + x) * 4;
            for (int c = 0; c < 4; ++c) {
                const char letter = c < 3 && grey ? 'Y' : "RGBA"[c];
                const float value =
                    strchr(recipe->channels, letter) ? expected(recipe->type, x, y, letter) : 1.0f;
                if (pixel[c] != value)
                    fail_msg("pixel %d, %d, channel %d: %g, not %g", x, y, c, (double)pixel[c],
                             (double)value);
            }
        }
    }
    free(pixels);
}

/* --- Tests ------------------------------------------------------------------------------- */

/* Bits, not values: NaN, infinities, negative zero and denormals come back as they went. */
static void test_round_trip(void **state)
{
    (void)state;
    enum { W = 37, H = 41 }; /* not a multiple of the 16 rows of a chunk */
    float *pixels = malloc(W * H * 4 * sizeof *pixels), *back = NULL;
    uint32_t random = 12345;
    for (int i = 0; i < W * H * 4; ++i) {
        random = random * 1664525u + 1013904223u;
        memcpy(&pixels[i], &random, sizeof random);
    }
    pixels[0] = NAN;
    pixels[1] = -INFINITY;
    pixels[2] = -0.0f;
    pixels[3] = 1e-45f;
    const brume_exr_channel channels[] = {{"R", pixels, 4, 0},
                                          {"G", pixels + 1, 4, 0},
                                          {"B", pixels + 2, 4, 0},
                                          {"A", pixels + 3, 4, 0}};
    assert_int_equal(exr_write(in_folder("a.exr"), W, H, channels, 4), BRUME_OK);
    int32_t width, height;
    assert_int_equal(exr_read(in_folder("a.exr"), &width, &height, &back), BRUME_OK);
    assert_int_equal(width, W);
    assert_int_equal(height, H);
    assert_memory_equal(back, pixels, W * H * 4 * sizeof *pixels);
    free(back);
    free(pixels);
    assert_int_equal(files_in_folder(), 1); /* no partial file is left */
}

/* The file's first row is the top, which is our last; planes of other strides; many channels. */
static void test_flip_and_strides(void **state)
{
    (void)state;
    enum { W = 5, H = 3 };
    float plane[W * H], wide[W * H * 7];
    for (int i = 0; i < W * H; ++i) {
        plane[i] = (float)i;
        for (int c = 0; c < 7; ++c)
            wide[i * 7 + c] = (float)(100 * c + i);
    }
    const brume_exr_channel channels[] = {
        {"R", plane, 1, 0},
        {"ViewLayer.A.name.longer.than.thirty-one.characters.Z", wide + 3, 7, 0},
        {"B", wide + 5, 7, 0},
        {"G", wide + 2, 7, 0},
        {"ViewLayer.Depth.Z", wide, 7, 0},
        {"ViewLayer.Combined.R", wide + 1, 7, 0},
        {"ViewLayer.Combined.A", wide + 6, 7, 0},
        {"A", wide + 4, 7, 0}};
    assert_int_equal(exr_write(in_folder("a.exr"), W, H, channels, 8), BRUME_OK);

    exr_context_initializer_t setup = EXR_DEFAULT_CONTEXT_INITIALIZER;
    exr_context_t context;
    const exr_attr_chlist_t *list;
    CHECK(exr_start_read(&context, in_folder("a.exr"), &setup));
    CHECK(exr_get_channels(context, 0, &list));
    assert_int_equal(list->num_channels, 8);
    for (int i = 1; i < 8; ++i)
        assert_true(strcmp(list->entries[i - 1].name.str, list->entries[i].name.str) < 0);

    /* What another reader finds in the first row. */
    exr_chunk_info_t chunk;
    exr_decode_pipeline_t decoder = EXR_DECODE_PIPELINE_INITIALIZER;
    float rows[8][W * H];
    CHECK(exr_read_scanline_chunk_info(context, 0, 0, &chunk));
    CHECK(exr_decoding_initialize(context, 0, &chunk, &decoder));
    for (int i = 0; i < 8; ++i) {
        decoder.channels[i].decode_to_ptr = (uint8_t *)rows[i];
        decoder.channels[i].user_pixel_stride = 4;
        decoder.channels[i].user_line_stride = 4 * W;
    }
    CHECK(exr_decoding_choose_default_routines(context, 0, &decoder));
    CHECK(exr_decoding_run(context, 0, &decoder));
    for (int i = 0; i < 8; ++i) {
        const brume_exr_channel *source = NULL;
        for (int k = 0; k < 8; ++k)
            if (strcmp(channels[k].name, list->entries[i].name.str) == 0)
                source = &channels[k];
        assert_non_null(source);
        for (int y = 0; y < H; ++y)
            for (int x = 0; x < W; ++x)
                assert_true(rows[i][y * W + x] ==
                            source->pixels[((H - 1 - y) * W + x) * (int)source->stride]);
    }
    CHECK(exr_decoding_destroy(context, &decoder));
    CHECK(exr_finish(&context));

    int32_t width, height;
    float *back;
    assert_int_equal(exr_read(in_folder("a.exr"), &width, &height, &back), BRUME_OK);
    assert_true(back[0] == 0.0f && back[1] == 200.0f && back[2] == 500.0f && back[3] == 400.0f);
    free(back);
}

static void test_kinds(void **state)
{
    (void)state;
    const exr_pixel_type_t types[] = {EXR_PIXEL_FLOAT, EXR_PIXEL_HALF, EXR_PIXEL_UINT};
    const exr_compression_t compressions[] = {EXR_COMPRESSION_NONE, EXR_COMPRESSION_RLE,
                                              EXR_COMPRESSION_ZIPS, EXR_COMPRESSION_ZIP,
                                              EXR_COMPRESSION_PIZ};
    for (int t = 0; t < 3; ++t)
        for (int c = 0; c < 5; ++c)
            for (int tiled = 0; tiled < 2; ++tiled) {
                const struct recipe recipe = {.type = types[t],
                                              .compression = compressions[c],
                                              .width = 35,
                                              .height = 39,
                                              .tile = tiled ? 16 : 0,
                                              .channels = "ABGR"};
                check_recipe(&recipe);
            }
}

static void test_channels_and_windows(void **state)
{
    (void)state;
    check_recipe(
        &(struct recipe){EXR_PIXEL_FLOAT, EXR_COMPRESSION_ZIP, -7, -3, 20, 22, 0, "BGR", 0, NULL});
    check_recipe(
        &(struct recipe){EXR_PIXEL_FLOAT, EXR_COMPRESSION_ZIP, 5, 100, 20, 22, 8, "BGR", 0, NULL});
    check_recipe(
        &(struct recipe){EXR_PIXEL_HALF, EXR_COMPRESSION_ZIP, 0, 0, 9, 1, 0, "Y", 0, NULL});
    check_recipe(
        &(struct recipe){EXR_PIXEL_FLOAT, EXR_COMPRESSION_ZIP, 0, 0, 1, 9, 0, "AY", 0, NULL});
    /* The first part has no colours, the second has. */
    const char *path = in_folder("parts.exr");
    write_recipe(path, &(struct recipe){EXR_PIXEL_FLOAT, EXR_COMPRESSION_ZIP, 0, 0, 3, 2, 0, "ABGR",
                                        0, "A"});
    int32_t width, height;
    float *pixels;
    assert_int_equal(exr_read(path, &width, &height, &pixels), BRUME_OK);
    assert_true(pixels[0] == pattern(0, 1, 0));
    free(pixels);
}

static void expect_refusal(const char *path, brume_result code, const char *part)
{
    int32_t width = -5, height = -5;
    float *pixels = NULL;
    assert_int_equal(exr_read(path, &width, &height, &pixels), code);
    assert_null(pixels);
    assert_int_equal(width, -5);
    assert_non_null(strstr(last_error(), path));
    assert_non_null(strstr(last_error(), part));
}

static void test_refusals(void **state)
{
    (void)state;
    expect_refusal(in_folder("none.exr"), BRUME_E_FILE_MISSING, "No such file");
    expect_refusal(folder, BRUME_E_FILE_MISSING, "not a file");
    assert_int_equal(mkfifo(in_folder("pipe.exr"), 0600), 0);
    expect_refusal(in_folder("pipe.exr"), BRUME_E_FILE_MISSING, "not a file");
    spill(in_folder("text.exr"), "This is no picture at all.\n", 27);
    expect_refusal(in_folder("text.exr"), BRUME_E_FILE_FORMAT, "text.exr");
    spill(in_folder("empty.exr"), "", 0);
    expect_refusal(in_folder("empty.exr"), BRUME_E_FILE_FORMAT, "empty.exr");

    write_recipe(in_folder("half.exr"), &(struct recipe){EXR_PIXEL_HALF, EXR_COMPRESSION_ZIP, 0, 0,
                                                         8, 8, 0, "BGR", 2, NULL});
    expect_refusal(in_folder("half.exr"), BRUME_E_UNSUPPORTED, "subsampled");
    write_recipe(in_folder("alpha.exr"), &(struct recipe){EXR_PIXEL_HALF, EXR_COMPRESSION_ZIP, 0, 0,
                                                          8, 8, 0, "AG", 0, NULL});
    expect_refusal(in_folder("alpha.exr"), BRUME_E_UNSUPPORTED, "no channels R, G and B");

    /* Deep scanlines: the header is enough. */
    exr_context_initializer_t setup = EXR_DEFAULT_CONTEXT_INITIALIZER;
    exr_context_t context;
    int part;
    CHECK(exr_start_write(&context, in_folder("deep.exr"), EXR_WRITE_FILE_DIRECTLY, &setup));
    CHECK(exr_add_part(context, "deep", EXR_STORAGE_DEEP_SCANLINE, &part));
    CHECK(exr_initialize_required_attr_simple(context, part, 4, 4, EXR_COMPRESSION_ZIPS));
    for (int c = 0; c < 3; ++c) {
        const char name[2] = {"BGR"[c], '\0'};
        CHECK(exr_add_channel(context, part, name, EXR_PIXEL_HALF, EXR_PERCEPTUALLY_LOGARITHMIC, 1,
                              1));
    }
    CHECK(exr_set_version(context, part, 1));
    CHECK(exr_write_header(context));
    size_t size;
    char *header = slurp(in_folder("deep.exr"), &size);
    exr_finish(&context); /* removes the file, as it has no chunks */
    spill(in_folder("deep.exr"), header, size);
    free(header);
    expect_refusal(in_folder("deep.exr"), BRUME_E_UNSUPPORTED, "deep");
}

/* A header that claims 40000 x 40000 pixels in a file of a few hundred bytes. */
static void test_giant(void **state)
{
    (void)state;
    write_recipe(in_folder("giant.exr"), &(struct recipe){EXR_PIXEL_FLOAT, EXR_COMPRESSION_ZIP, 0,
                                                          0, 8, 8, 0, "BGR", 0, NULL});
    size_t size;
    char *bytes = slurp(in_folder("giant.exr"), &size);
    static const char key[] = "dataWindow\0box2i";
    char *at = memmem(bytes, size, key, sizeof key);
    assert_non_null(at);
    const int32_t corner = 39999;
    memcpy(at + sizeof key + 4 + 8, &corner, 4);
    memcpy(at + sizeof key + 4 + 12, &corner, 4);
    spill(in_folder("giant.exr"), bytes, size);
    free(bytes);
    int32_t width, height;
    float *pixels = NULL;
    const brume_result result = exr_read(in_folder("giant.exr"), &width, &height, &pixels);
    assert_true(result == BRUME_E_FILE_FORMAT || result == BRUME_E_MEMORY);
    assert_null(pixels);
}

static void test_write_failures(void **state)
{
    (void)state;
    const float pixels[4] = {1, 2, 3, 4};
    const brume_exr_channel channel = {"R", pixels, 1, 0};
    const brume_exr_channel twice[] = {channel, channel};
    const brume_exr_channel nameless = {"", pixels, 1, 0}, still = {"R", pixels, 0, 0};
    const char *lost = in_folder("missing/a.exr");
    assert_int_equal(exr_write(lost, 2, 2, &channel, 1), BRUME_E_FILE_WRITE);
    assert_non_null(strstr(last_error(), lost));
    assert_non_null(strstr(last_error(), "No such file or directory"));
    assert_int_equal(exr_write("/proc/a.exr", 2, 2, &channel, 1), BRUME_E_FILE_WRITE);
    assert_non_null(strstr(last_error(), "/proc/a.exr"));
    assert_int_equal(exr_write(in_folder("a.exr"), 0, 2, &channel, 1), BRUME_E_ARGUMENT);
    assert_int_equal(exr_write(in_folder("a.exr"), 2, 2, &channel, 0), BRUME_E_ARGUMENT);
    assert_int_equal(exr_write(in_folder("a.exr"), 2, 2, twice, 2), BRUME_E_ARGUMENT);
    assert_int_equal(exr_write(in_folder("a.exr"), 2, 2, &nameless, 1), BRUME_E_ARGUMENT);
    assert_int_equal(exr_write(in_folder("a.exr"), 2, 2, &still, 1), BRUME_E_ARGUMENT);
    assert_int_equal(files_in_folder(), 0);
}

/* A write that breaks off leaves what stood there before, and nothing beside it. */
static void test_full_disk(void **state)
{
    (void)state;
    const float small[4] = {1, 2, 3, 4};
    const brume_exr_channel channel = {"R", small, 1, 0};
    assert_int_equal(exr_write(in_folder("a.exr"), 2, 2, &channel, 1), BRUME_OK);
    size_t size, size_after;
    char *before = slurp(in_folder("a.exr"), &size);

    enum { SIDE = 256 };
    float *noise = malloc(SIDE * SIDE * sizeof *noise);
    uint32_t random = 7;
    for (int i = 0; i < SIDE * SIDE; ++i) {
        random = random * 1664525u + 1013904223u;
        noise[i] = (float)random;
    }
    const brume_exr_channel large = {"R", noise, 1, 0};
    const pid_t child = fork();
    if (child == 0) { /* the limit on file sizes stands in for the full disk */
        signal(SIGXFSZ, SIG_IGN);
        setrlimit(RLIMIT_FSIZE, &(struct rlimit){20000, 20000});
        const brume_result result = exr_write(in_folder("a.exr"), SIDE, SIDE, &large, 1);
        const int named = strstr(last_error(), "a.exr") && strstr(last_error(), "File too large");
        _exit(result == BRUME_E_FILE_WRITE && named ? 0 : 1);
    }
    int status;
    waitpid(child, &status, 0);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
    free(noise);

    char *after = slurp(in_folder("a.exr"), &size_after);
    assert_int_equal(size, size_after);
    assert_memory_equal(before, after, size);
    free(before);
    free(after);
    assert_int_equal(files_in_folder(), 1);
}

/* Reads a damaged file in a child, so that a crash is one failed trial. Gives its exit status: 0
 * read, 1 refused with a sentence, 2 refused without one, 3 another code than those for files. */
static int read_in_child(const char *path)
{
    const pid_t child = fork();
    if (child == 0) {
        int32_t width, height;
        float *pixels;
        const brume_result result = exr_read(path, &width, &height, &pixels);
        if (result == BRUME_OK)
            _exit(0);
        if (!last_error()[0])
            _exit(2);
        _exit(result == BRUME_E_FILE_FORMAT || result == BRUME_E_MEMORY ||
                      result == BRUME_E_UNSUPPORTED
                  ? 1
                  : 3);
    }
    int status;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

static void damage(const struct recipe *recipe)
{
    const char *path = in_folder("good.exr"), *bad = in_folder("bad.exr");
    write_recipe(path, recipe);
    size_t size;
    char *bytes = slurp(path, &size);
    for (size_t i = 0; i < 40; ++i) {
        const size_t keep = size * i / 40;
        spill(bad, bytes, keep);
        const int status = read_in_child(bad);
        if (status != 1)
            fail_msg("cut to %zu of %zu bytes: status %d", keep, size, status);
    }
    spill(bad, bytes, size - 1);
    assert_int_equal(read_in_child(bad), 1);

    uint32_t random = 99;
    for (int i = 0; i < 100; ++i) {
        random = random * 1664525u + 1013904223u;
        const size_t at = (size_t)(random >> 8) % (i % 2 ? size : 400);
        const char kept = bytes[at];
        bytes[at] = (char)(bytes[at] ^ (1 << (random & 7)));
        spill(bad, bytes, size);
        const int status = read_in_child(bad);
        if (status > 1)
            fail_msg("bit %u of byte %zu flipped: status %d", random & 7, at, status);
        bytes[at] = kept;
    }
    free(bytes);
}

static void test_damaged(void **state)
{
    (void)state;
    const exr_compression_t compressions[] = {EXR_COMPRESSION_NONE, EXR_COMPRESSION_ZIP,
                                              EXR_COMPRESSION_PIZ, EXR_COMPRESSION_RLE};
    for (int c = 0; c < 4; ++c)
        damage(&(struct recipe){.type = c == 2 ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT,
                                .compression = compressions[c],
                                .width = 35,
                                .height = 39,
                                .tile = c == 1 ? 16 : 0,
                                .channels = "ABGR"});
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_round_trip, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(test_flip_and_strides, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(test_kinds, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(test_channels_and_windows, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(test_refusals, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(test_giant, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(test_write_failures, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(test_full_disk, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(test_damaged, make_folder, remove_folder),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
