/* SPDX-License-Identifier: GPL-3.0-or-later */
/* OpenEXR files: planes of floats out, RGBA in. Files have their first row at the top, our pixels
 * theirs at the bottom; each chunk passes a small buffer in which its rows lie as the file has
 * them. */
#include "io/exr.h"

#include "base/result.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <openexr.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* The initializers that OpenEXR 3.4 has for its pipelines name the first fields only. */
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"

/* 4 GiB of RGBA floats: beyond any picture or environment that Brume is meant for. */
#define MOST_PIXELS (UINT64_C(1) << 28)

/* An open file for OpenEXR's callbacks, and the first thing that went wrong on it. */
struct stream {
    int descriptor;
    int error; /* errno of a failed read or write, 0 if none */
};

/* OpenEXR's own words for the first error since a call began. It reports on the calling thread,
 * sometimes about a context that is only half made, so the words cannot lie in the stream. */
static _Thread_local char reason[256];

static void note_reason(exr_const_context_t context, exr_result_t code, const char *message)
{
    (void)context;
    (void)code;
    if (!reason[0])
        snprintf(reason, sizeof reason, "%s", message);
}

static const char *why(const struct stream *stream, exr_result_t code)
{
    if (stream->error)
        return strerror(stream->error);
    return reason[0] ? reason : exr_get_default_error_message(code);
}

static int64_t stream_size(exr_const_context_t context, void *user)
{
    (void)context;
    struct stat status;
    return fstat(((struct stream *)user)->descriptor, &status) == 0 ? status.st_size : -1;
}

static int64_t stream_read(exr_const_context_t context, void *user, void *buffer, uint64_t size,
                           uint64_t offset, exr_stream_error_func_ptr_t error)
{
    (void)context;
    (void)error;
    struct stream *stream = user;
    uint64_t done = 0;
    while (done < size) {
        const ssize_t got =
            pread(stream->descriptor, (char *)buffer + done, size - done, (off_t)(offset + done));
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0) {
            stream->error = errno;
            return -1;
        }
        if (got == 0)
            break;
        done += (uint64_t)got;
    }
    return (int64_t)done;
}

static int64_t stream_write(exr_const_context_t context, void *user, const void *buffer,
                            uint64_t size, uint64_t offset, exr_stream_error_func_ptr_t error)
{
    (void)context;
    (void)error;
    struct stream *stream = user;
    uint64_t done = 0;
    while (done < size) {
        const ssize_t put = pwrite(stream->descriptor, (const char *)buffer + done, size - done,
                                   (off_t)(offset + done));
        if (put < 0 && errno == EINTR)
            continue;
        if (put < 0) {
            stream->error = errno;
            return -1;
        }
        done += (uint64_t)put;
    }
    return (int64_t)done;
}

/* --- Writing ----------------------------------------------------------------------------- */

static int by_name(const void *a, const void *b)
{
    const brume_exr_channel *const *left = a, *const *right = b;
    return strcmp((*left)->name, (*right)->name);
}

/* Header and pixels into an open stream. sorted: the channels by name, as the file has them. */
static exr_result_t write_picture(exr_context_t context, int32_t width, int32_t height,
                                  const brume_exr_channel *const *sorted, uint32_t count)
{
    exr_result_t result;
    float *plane = NULL;
    exr_encode_pipeline_t encoder = EXR_ENCODE_PIPELINE_INITIALIZER;
    int part, initialized = 0;
    int32_t chunk_rows = 0;

    if ((result = exr_set_longname_support(context, 1)) != EXR_ERR_SUCCESS ||
        (result = exr_add_part(context, "brume", EXR_STORAGE_SCANLINE, &part)) != EXR_ERR_SUCCESS ||
        (result = exr_initialize_required_attr_simple(context, part, width, height,
                                                      EXR_COMPRESSION_ZIP)) != EXR_ERR_SUCCESS)
        return result;
    for (uint32_t i = 0; i < count; ++i)
        if ((result = exr_add_channel(context, part, sorted[i]->name, EXR_PIXEL_FLOAT,
                                      EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1)) != EXR_ERR_SUCCESS)
            return result;
    if ((result = exr_write_header(context)) != EXR_ERR_SUCCESS ||
        (result = exr_get_scanlines_per_chunk(context, part, &chunk_rows)) != EXR_ERR_SUCCESS)
        return result;

    const size_t plane_size = (size_t)chunk_rows * (size_t)width;
    plane = malloc(plane_size * count * sizeof *plane);
    if (!plane)
        return EXR_ERR_OUT_OF_MEMORY;

    for (int32_t top = 0; top < height; top += chunk_rows) {
        exr_chunk_info_t chunk;
        if ((result = exr_write_scanline_chunk_info(context, part, top, &chunk)) != EXR_ERR_SUCCESS)
            goto end;
        result = initialized ? exr_encoding_update(context, part, &chunk, &encoder)
                             : exr_encoding_initialize(context, part, &chunk, &encoder);
        if (result != EXR_ERR_SUCCESS)
            goto end;

        for (uint32_t i = 0; i < count; ++i) {
            const brume_exr_channel *channel = sorted[i];
            float *to = plane + i * plane_size;
            for (int32_t y = 0; y < chunk.height; ++y) {
                const size_t row = (size_t)(height - 1 - (top + y));
                const float *from = channel->pixels + row * (size_t)width * channel->stride;
                for (int32_t x = 0; x < width; ++x)
                    *to++ = from[(size_t)x * channel->stride];
            }
            exr_coding_channel_info_t *coded = &encoder.channels[i];
            ASSERT(strcmp(coded->channel_name, channel->name) == 0);
            coded->encode_from_ptr = (const uint8_t *)(plane + i * plane_size);
            coded->user_data_type = EXR_PIXEL_FLOAT;
            coded->user_bytes_per_element = sizeof(float);
            coded->user_pixel_stride = sizeof(float);
            coded->user_line_stride = width * (int32_t)sizeof(float);
        }
        if (!initialized && (result = exr_encoding_choose_default_routines(
                                 context, part, &encoder)) != EXR_ERR_SUCCESS)
            goto end;
        initialized = 1;
        if ((result = exr_encoding_run(context, part, &encoder)) != EXR_ERR_SUCCESS)
            goto end;
    }

end:
    exr_encoding_destroy(context, &encoder);
    free(plane);
    return result;
}

brume_result exr_write(const char *path, int32_t width, int32_t height,
                       const brume_exr_channel *channels, uint32_t count)
{
    /* A row of one channel in bytes, and the channels' number, are 31 and 15 bits in OpenEXR. */
    REQUIRE(path && *path && channels);
    REQUIRE(width > 0 && height > 0 && (uint64_t)width * (uint64_t)height <= MOST_PIXELS);
    REQUIRE(count > 0 && count <= 1024);
    for (uint32_t i = 0; i < count; ++i) {
        REQUIRE(channels[i].name && channels[i].name[0] && strlen(channels[i].name) <= 255);
        REQUIRE(channels[i].pixels && channels[i].stride > 0);
    }

    brume_result result = BRUME_OK;
    const brume_exr_channel **sorted = malloc(count * sizeof *sorted);
    char *partial = malloc(strlen(path) + 48);
    struct stream stream = {.descriptor = -1};
    if (!sorted || !partial) {
        result = fail(BRUME_E_MEMORY, "no memory to write '%s'", path);
        goto end;
    }
    for (uint32_t i = 0; i < count; ++i)
        sorted[i] = &channels[i];
    qsort(sorted, count, sizeof *sorted, by_name);
    for (uint32_t i = 1; i < count; ++i) {
        if (strcmp(sorted[i - 1]->name, sorted[i]->name) == 0) {
            result = fail(BRUME_E_ARGUMENT, "two channels of '%s' have the name '%s'", path,
                          sorted[i]->name);
            goto end;
        }
    }

    /* Beside its goal, so that the rename at the end stays in one file system. */
    static atomic_uint serial;
    sprintf(partial, "%s.%ld-%u.part", path, (long)getpid(), atomic_fetch_add(&serial, 1));
    stream.descriptor = open(partial, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (stream.descriptor < 0) {
        result = fail(BRUME_E_FILE_WRITE, "cannot write '%s': %s", path, strerror(errno));
        goto end;
    }

    reason[0] = '\0';
    exr_context_initializer_t setup = EXR_DEFAULT_CONTEXT_INITIALIZER;
    setup.error_handler_fn = note_reason;
    setup.user_data = &stream;
    setup.write_fn = stream_write;
    exr_context_t context = NULL;
    exr_result_t code = exr_start_write(&context, path, EXR_WRITE_FILE_DIRECTLY, &setup);
    if (code == EXR_ERR_SUCCESS) {
        code = write_picture(context, width, height, sorted, count);
        const exr_result_t finished = exr_finish(&context);
        if (code == EXR_ERR_SUCCESS)
            code = finished;
    }
    if (code != EXR_ERR_SUCCESS || stream.error)
        result = fail(code == EXR_ERR_OUT_OF_MEMORY ? BRUME_E_MEMORY : BRUME_E_FILE_WRITE,
                      "cannot write '%s': %s", path, why(&stream, code));
    /* Some file systems tell only now that the disk is full. */
    if (close(stream.descriptor) != 0 && result == BRUME_OK)
        result = fail(BRUME_E_FILE_WRITE, "cannot write '%s': %s", path, strerror(errno));
    if (result == BRUME_OK && rename(partial, path) != 0)
        result = fail(BRUME_E_FILE_WRITE, "cannot write '%s': %s", path, strerror(errno));
    if (result != BRUME_OK)
        unlink(partial);

end:
    free(partial);
    free(sorted);
    return result;
}

/* --- Reading ----------------------------------------------------------------------------- */

/* A part of the file that can be read as RGBA. */
struct picture {
    int part;
    exr_storage_t storage;
    int32_t left, top, width, height;
    int source[4]; /* index of the file's channel in plane 0 .. 3; -1: none, reads as 1 */
    int plane[4];  /* plane that R, G, B, A come from */
};

static brume_result bad_file(const char *path, const struct stream *stream, exr_result_t code)
{
    if (code == EXR_ERR_OUT_OF_MEMORY)
        return fail(BRUME_E_MEMORY, "no memory to read '%s'", path);
    if (code == EXR_ERR_FEATURE_NOT_IMPLEMENTED)
        return fail(BRUME_E_UNSUPPORTED, "cannot read '%s': %s", path, why(stream, code));
    return fail(BRUME_E_FILE_FORMAT, "cannot read '%s': %s", path, why(stream, code));
}

static int find_channel(const exr_attr_chlist_t *list, const char *name)
{
    for (int i = 0; i < list->num_channels; ++i)
        if (strcmp(list->entries[i].name.str, name) == 0)
            return i;
    return -1;
}

/* Whether the part has R, G and B or else Y. */
static int choose_channels(const exr_attr_chlist_t *list, struct picture *out)
{
    static const char *const names[] = {"R", "G", "B", "A"};
    for (int c = 0; c < 4; ++c) {
        out->source[c] = find_channel(list, names[c]);
        out->plane[c] = c;
    }
    if (out->source[0] >= 0 && out->source[1] >= 0 && out->source[2] >= 0)
        return 1;
    out->source[0] = find_channel(list, "Y");
    out->source[1] = out->source[2] = -1;
    out->plane[1] = out->plane[2] = 0;
    return out->source[0] >= 0;
}

/* The first part with colours. */
static brume_result find_picture(const char *path, const struct stream *stream,
                                 exr_const_context_t context, struct picture *out)
{
    exr_result_t code;
    int parts = 0;
    const exr_attr_chlist_t *list = NULL;
    exr_attr_box2i_t window;

    if ((code = exr_get_count(context, &parts)) != EXR_ERR_SUCCESS)
        return bad_file(path, stream, code);
    int found = 0;
    for (int part = 0; part < parts && !found; ++part) {
        out->part = part;
        if ((code = exr_get_channels(context, part, &list)) != EXR_ERR_SUCCESS)
            return bad_file(path, stream, code);
        found = choose_channels(list, out);
    }
    if (!found)
        return fail(BRUME_E_UNSUPPORTED, "'%s' has no channels R, G and B, and no Y", path);

    if ((code = exr_get_storage(context, out->part, &out->storage)) != EXR_ERR_SUCCESS ||
        (code = exr_get_data_window(context, out->part, &window)) != EXR_ERR_SUCCESS)
        return bad_file(path, stream, code);
    if (out->storage != EXR_STORAGE_SCANLINE && out->storage != EXR_STORAGE_TILED)
        return fail(BRUME_E_UNSUPPORTED, "'%s' holds deep pixels", path);
    for (int i = 0; i < list->num_channels; ++i)
        if (list->entries[i].x_sampling != 1 || list->entries[i].y_sampling != 1)
            return fail(BRUME_E_UNSUPPORTED, "channel '%s' of '%s' is subsampled",
                        list->entries[i].name.str, path);

    const int64_t width = (int64_t)window.max.x - window.min.x + 1;
    const int64_t height = (int64_t)window.max.y - window.min.y + 1;
    if (width <= 0 || height <= 0)
        return fail(BRUME_E_FILE_FORMAT, "'%s' is damaged: its data window is empty", path);
    if ((uint64_t)width > MOST_PIXELS || (uint64_t)height > MOST_PIXELS / (uint64_t)width)
        return fail(BRUME_E_MEMORY, "'%s' is too large: %lld x %lld pixels", path, (long long)width,
                    (long long)height);
    out->left = window.min.x;
    out->top = window.min.y;
    out->width = (int32_t)width;
    out->height = (int32_t)height;
    return BRUME_OK;
}

/* A decoder that is kept over the chunks of a picture, and its planes. */
struct decoder {
    exr_decode_pipeline_t pipeline;
    int initialized;
    float *planes;
    size_t plane_size; /* floats */
};

/* Decodes one chunk, whose top left pixel is at (left, top) of the picture, into RGBA pixels. */
static exr_result_t read_chunk(exr_const_context_t context, const struct picture *picture,
                               struct decoder *decoder, const exr_chunk_info_t *chunk, int32_t left,
                               int32_t top, float *pixels)
{
    exr_result_t code;
    const int32_t width = picture->width, height = picture->height;
    if (chunk->width <= 0 || chunk->height <= 0 || chunk->width > width - left ||
        chunk->height > height - top)
        return EXR_ERR_BAD_CHUNK_LEADER;

    const size_t size = (size_t)chunk->width * (size_t)chunk->height;
    if (size > decoder->plane_size) {
        free(decoder->planes);
        decoder->plane_size = 0;
        decoder->planes = malloc(4 * size * sizeof *decoder->planes);
        if (!decoder->planes)
            return EXR_ERR_OUT_OF_MEMORY;
        decoder->plane_size = size;
    }
    code = decoder->initialized
               ? exr_decoding_update(context, picture->part, chunk, &decoder->pipeline)
               : exr_decoding_initialize(context, picture->part, chunk, &decoder->pipeline);
    if (code != EXR_ERR_SUCCESS)
        return code;

    for (int16_t i = 0; i < decoder->pipeline.channel_count; ++i)
        decoder->pipeline.channels[i].decode_to_ptr = NULL;
    for (int c = 0; c < 4; ++c) {
        if (picture->source[c] < 0)
            continue;
        exr_coding_channel_info_t *coded = &decoder->pipeline.channels[picture->source[c]];
        coded->decode_to_ptr = (uint8_t *)(decoder->planes + (size_t)c * size);
        coded->user_data_type = EXR_PIXEL_FLOAT;
        coded->user_bytes_per_element = sizeof(float);
        coded->user_pixel_stride = sizeof(float);
        coded->user_line_stride = chunk->width * (int32_t)sizeof(float);
    }
    if (!decoder->initialized &&
        (code = exr_decoding_choose_default_routines(context, picture->part, &decoder->pipeline)) !=
            EXR_ERR_SUCCESS)
        return code;
    decoder->initialized = 1;
    if ((code = exr_decoding_run(context, picture->part, &decoder->pipeline)) != EXR_ERR_SUCCESS)
        return code;

    for (int c = 0; c < 4; ++c) {
        const int plane = picture->plane[c];
        const float *from = decoder->planes + (size_t)plane * size;
        for (int32_t y = 0; y < chunk->height; ++y) {
            const size_t row = (size_t)(height - 1 - (top + y));
            float *to = pixels + (row * (size_t)width + (size_t)left) * 4 + c;
            for (int32_t x = 0; x < chunk->width; ++x)
                to[4 * x] = picture->source[plane] < 0 ? 1.0f : *from++;
        }
    }
    return EXR_ERR_SUCCESS;
}

static exr_result_t read_scanlines(exr_const_context_t context, const struct picture *picture,
                                   struct decoder *decoder, float *pixels)
{
    exr_result_t code;
    int32_t rows = 0;
    if ((code = exr_get_scanlines_per_chunk(context, picture->part, &rows)) != EXR_ERR_SUCCESS)
        return code;
    if (rows <= 0)
        return EXR_ERR_FILE_BAD_HEADER;
    for (int64_t top = 0; top < picture->height; top += rows) {
        exr_chunk_info_t chunk;
        if ((code = exr_read_scanline_chunk_info(context, picture->part, (int)(picture->top + top),
                                                 &chunk)) != EXR_ERR_SUCCESS ||
            (code = read_chunk(context, picture, decoder, &chunk, 0, (int32_t)top, pixels)) !=
                EXR_ERR_SUCCESS)
            return code;
    }
    return EXR_ERR_SUCCESS;
}

static exr_result_t read_tiles(exr_const_context_t context, const struct picture *picture,
                               struct decoder *decoder, float *pixels)
{
    exr_result_t code;
    int32_t width = 0, height = 0;
    if ((code = exr_get_tile_sizes(context, picture->part, 0, 0, &width, &height)) !=
        EXR_ERR_SUCCESS)
        return code;
    if (width <= 0 || height <= 0)
        return EXR_ERR_FILE_BAD_HEADER;
    for (int64_t top = 0; top < picture->height; top += height) {
        for (int64_t left = 0; left < picture->width; left += width) {
            exr_chunk_info_t chunk;
            if ((code = exr_read_tile_chunk_info(context, picture->part, (int)(left / width),
                                                 (int)(top / height), 0, 0, &chunk)) !=
                    EXR_ERR_SUCCESS ||
                (code = read_chunk(context, picture, decoder, &chunk, (int32_t)left, (int32_t)top,
                                   pixels)) != EXR_ERR_SUCCESS)
                return code;
        }
    }
    return EXR_ERR_SUCCESS;
}

/* Values are given as the file has them, NaN and infinities included. */
brume_result exr_read(const char *path, int32_t *width, int32_t *height, float **pixels)
{
    REQUIRE(path && width && height && pixels);

    brume_result result;
    exr_context_t context = NULL;
    float *made = NULL;
    struct decoder decoder = {.pipeline = EXR_DECODE_PIPELINE_INITIALIZER};
    /* Not to hang on a pipe of that name. */
    struct stream stream = {.descriptor = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
    struct stat status;
    if (stream.descriptor < 0)
        return fail(BRUME_E_FILE_MISSING, "cannot open '%s': %s", path, strerror(errno));
    if (fstat(stream.descriptor, &status) != 0 || !S_ISREG(status.st_mode)) {
        result = fail(BRUME_E_FILE_MISSING, "'%s' is not a file", path);
        goto end;
    }

    reason[0] = '\0';
    exr_context_initializer_t setup = EXR_DEFAULT_CONTEXT_INITIALIZER;
    setup.error_handler_fn = note_reason;
    setup.user_data = &stream;
    setup.read_fn = stream_read;
    setup.size_fn = stream_size;
    exr_result_t code = exr_start_read(&context, path, &setup);
    if (code != EXR_ERR_SUCCESS) {
        result = bad_file(path, &stream, code);
        goto end;
    }
    struct picture picture;
    if ((result = find_picture(path, &stream, context, &picture)) != BRUME_OK)
        goto end;
    made = malloc((size_t)picture.width * (size_t)picture.height * 4 * sizeof *made);
    if (!made) {
        result = fail(BRUME_E_MEMORY, "no memory for the %d x %d pixels of '%s'", picture.width,
                      picture.height, path);
        goto end;
    }
    code = picture.storage == EXR_STORAGE_TILED ? read_tiles(context, &picture, &decoder, made)
                                                : read_scanlines(context, &picture, &decoder, made);
    if (code != EXR_ERR_SUCCESS) {
        result = bad_file(path, &stream, code);
        goto end;
    }
    *width = picture.width;
    *height = picture.height;
    *pixels = made;
    made = NULL;

end:
    if (context) {
        exr_decoding_destroy(context, &decoder.pipeline);
        exr_finish(&context);
    }
    free(decoder.planes);
    free(made);
    close(stream.descriptor);
    return result;
}
