/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Counted buffers and textures. */
#include "gl/memory.h"
#include "base/result.h"

#include <string.h>

static void count(struct memory *memory, enum purpose purpose, uint64_t bytes)
{
    memory->bytes[purpose] += bytes;
    memory->total += bytes;
    if (memory->total > memory->peak)
        memory->peak = memory->total;
}

static void discount(struct memory *memory, enum purpose purpose, uint64_t bytes)
{
    memory->bytes[purpose] -= bytes;
    memory->total -= bytes;
}

brume_result buffer_init(struct memory *memory, struct buffer *buffer, enum purpose purpose,
                         uint64_t bytes, const void *data, const char *label)
{
    const uint64_t given = bytes;
    if (bytes < 16)
        bytes = 16; /* a binding point wants something, even for an empty list */
    memset(buffer, 0, sizeof *buffer);
    while (glGetError() != GL_NO_ERROR)
        ;
    glCreateBuffers(1, &buffer->id);
    glNamedBufferStorage(buffer->id, (GLsizeiptr)bytes, NULL, GL_DYNAMIC_STORAGE_BIT);
    if (glGetError() != GL_NO_ERROR) {
        glDeleteBuffers(1, &buffer->id);
        buffer->id = 0;
        return fail(BRUME_E_MEMORY, "no graphics memory for %llu bytes of %s",
                    (unsigned long long)bytes, label);
    }
    glObjectLabel(GL_BUFFER, buffer->id, -1, label);
    buffer->bytes = bytes;
    buffer->purpose = purpose;
    count(memory, purpose, bytes);
    if (data && given)
        glNamedBufferSubData(buffer->id, 0, (GLsizeiptr)given, data);
    return BRUME_OK;
}

brume_result buffer_update(struct memory *memory, struct buffer *buffer, enum purpose purpose,
                           uint64_t bytes, const void *data, const char *label)
{
    if (!buffer->id || buffer->bytes < bytes) {
        buffer_finish(memory, buffer);
        TRY(buffer_init(memory, buffer, purpose, bytes, NULL, label));
    }
    if (data && bytes)
        glNamedBufferSubData(buffer->id, 0, (GLsizeiptr)bytes, data);
    return BRUME_OK;
}

void buffer_finish(struct memory *memory, struct buffer *buffer)
{
    if (buffer->id) {
        glDeleteBuffers(1, &buffer->id);
        discount(memory, buffer->purpose, buffer->bytes);
    }
    memset(buffer, 0, sizeof *buffer);
}

static uint64_t texel_bytes(GLenum format)
{
    switch (format) {
    case GL_RGBA32F:
    case GL_RGBA32UI:
        return 16;
    case GL_RGBA16F:
        return 8;
    case GL_R32F:
    case GL_R32UI:
    case GL_RGBA8UI:
    case GL_DEPTH_COMPONENT32F:
        return 4;
    case GL_R16F:
        return 2;
    default:
        ASSERT(!"texel_bytes knows the format");
        return 0;
    }
}

int texture_side(int texels)
{
    const int power = (texels & (texels - 1)) == 0;
    if (!power || texels >= 2048) /* near the driver's limit there is none to waste */
        return texels;
    return texels == 1 ? 3 : texels + 1;
}

/* Which are fetched, never filtered. */
static int has_integers(GLenum format)
{
    return format == GL_R32UI || format == GL_RGBA8UI || format == GL_RGBA32UI;
}

void texture_clear(const struct texture *texture)
{
    const int integers = has_integers(texture->format);
    glClearTexImage(texture->id, 0, integers ? GL_RGBA_INTEGER : GL_RGBA,
                    integers ? GL_UNSIGNED_INT : GL_FLOAT, NULL);
}

brume_result texture_init(struct memory *memory, struct texture *texture, enum purpose purpose,
                          GLenum target, GLenum format, int width, int height, int depth,
                          int levels, const char *label)
{
    memset(texture, 0, sizeof *texture);
    while (glGetError() != GL_NO_ERROR)
        ;
    glCreateTextures(target, 1, &texture->id);
    if (target == GL_TEXTURE_2D)
        glTextureStorage2D(texture->id, levels, format, width, height);
    else
        glTextureStorage3D(texture->id, levels, format, width, height, depth);
    if (glGetError() != GL_NO_ERROR) {
        glDeleteTextures(1, &texture->id);
        texture->id = 0;
        return fail(BRUME_E_MEMORY, "no graphics memory for %d x %d x %d texels of %s", width,
                    height, depth, label);
    }
    glObjectLabel(GL_TEXTURE, texture->id, -1, label);
    const GLint filter = has_integers(format) ? GL_NEAREST : GL_LINEAR;
    glTextureParameteri(texture->id, GL_TEXTURE_MIN_FILTER,
                        levels > 1 ? GL_LINEAR_MIPMAP_LINEAR : filter);
    glTextureParameteri(texture->id, GL_TEXTURE_MAG_FILTER, filter);
    glTextureParameteri(texture->id, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTextureParameteri(texture->id, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glTextureParameteri(texture->id, GL_TEXTURE_WRAP_R, GL_CLAMP_TO_EDGE);
    texture->purpose = purpose;
    texture->format = format;
    texture->width = width;
    texture->height = height;
    texture->depth = depth;
    texture->levels = levels;
    if (target == GL_TEXTURE_3D) /* what no cell fills is read with weight 0, but NaN stays NaN */
        texture_clear(texture);
    uint64_t level_texels = (uint64_t)width * (uint64_t)height * (uint64_t)depth;
    for (int level = 0; level < levels; ++level, level_texels /= 4)
        texture->bytes += level_texels * texel_bytes(format);
    count(memory, purpose, texture->bytes);
    return BRUME_OK;
}

brume_result texture_ensure(struct memory *memory, struct texture *texture, enum purpose purpose,
                            GLenum target, GLenum format, int width, int height, int depth,
                            int levels, const char *label)
{
    if (texture->id && texture->format == format && texture->width == width &&
        texture->height == height && texture->depth == depth && texture->levels == levels)
        return BRUME_OK;
    texture_finish(memory, texture);
    return texture_init(memory, texture, purpose, target, format, width, height, depth, levels,
                        label);
}

void texture_finish(struct memory *memory, struct texture *texture)
{
    if (texture->id) {
        glDeleteTextures(1, &texture->id);
        discount(memory, texture->purpose, texture->bytes);
    }
    memset(texture, 0, sizeof *texture);
}
