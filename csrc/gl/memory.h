/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Buffers and textures of the device, every byte counted by purpose. Device thread only. */
#ifndef BRUME_GL_MEMORY_H
#define BRUME_GL_MEMORY_H

#include "brume.h"

#include <epoxy/gl.h>

enum purpose {
    FOR_MEDIUM,
    FOR_TRANSPORT,
    FOR_SHADOW,
    FOR_MESH,
    FOR_IMAGE,
    FOR_TARGET,
    PURPOSE_COUNT
};

struct memory {
    uint64_t bytes[PURPOSE_COUNT];
    uint64_t total, peak;
};

struct buffer {
    GLuint id;
    uint64_t bytes;
    enum purpose purpose;
};

struct texture {
    GLuint id;
    uint64_t bytes;
    enum purpose purpose;
    GLenum format;
    int width, height, depth, levels;
};

/* Immutable storage; data may be NULL. The label names it in the debug output. Zeroed structs are
 * empty; ensure_* keep what already fits exactly. */
brume_result buffer_init(struct memory *memory, struct buffer *buffer, enum purpose purpose,
                         uint64_t bytes, const void *data, const char *label);
/* Uploads into the buffer, made anew only when it is too small. */
brume_result buffer_update(struct memory *memory, struct buffer *buffer, enum purpose purpose,
                           uint64_t bytes, const void *data, const char *label);
void buffer_finish(struct memory *memory, struct buffer *buffer);

/* The side of a texture that holds so many texels, one more where those are a power of two:
 * llvmpipe compiles every shader anew, for a second or so, when a texture's side becomes one or
 * ceases to be. Lattices and pictures change their sizes while somebody waits. */
int texture_side(int texels);

/* target: GL_TEXTURE_2D, _2D_ARRAY or _3D. Linear filter (none for integers), clamp to edge. A new
 * 3D texture holds 0. */
brume_result texture_init(struct memory *memory, struct texture *texture, enum purpose purpose,
                          GLenum target, GLenum format, int width, int height, int depth,
                          int levels, const char *label);
/* Does nothing when the texture already has this shape. */
brume_result texture_ensure(struct memory *memory, struct texture *texture, enum purpose purpose,
                            GLenum target, GLenum format, int width, int height, int depth,
                            int levels, const char *label);
/* Makes the first level 0 everywhere. */
void texture_clear(const struct texture *texture);
void texture_finish(struct memory *memory, struct texture *texture);

#endif
