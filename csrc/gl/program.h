/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Shader programs from files. `#include "path"` is resolved from the shader folder, once per
 * program, with numeric #line so that the driver's messages can be read. Device thread, but for
 * program_cache_init. */
#ifndef BRUME_GL_PROGRAM_H
#define BRUME_GL_PROGRAM_H

#include "brume.h"

#include <epoxy/gl.h>

#define PROGRAM_MAX 64

struct program {
    char name[48];
    GLuint id;
    int group[3]; /* compute: threads of a group */
};

struct program_cache {
    char folder[1024];
    struct program programs[PROGRAM_MAX];
    int count;
};

/* shader_dir NULL: BRUME_SHADERS, "shaders" beside the library, the source tree. */
brume_result program_cache_init(struct program_cache *cache, const char *shader_dir);
void program_cache_finish(struct program_cache *cache);

/* The compute program <stem>.comp.glsl, or the drawing program <stem>.vert.glsl with
 * <stem>.frag.glsl; compiled at first use. "stem:NAME" is its variant in which NAME is defined; a
 * line "// variants: NAME" in the file tells which there are. */
brume_result program_compute(struct program_cache *cache, const char *stem,
                             const struct program **out);
brume_result program_draw(struct program_cache *cache, const char *stem,
                          const struct program **out);

/* Dispatches so that at least x * y * z threads run. */
void program_dispatch(const struct program *program, int x, int y, int z);
/* Dispatches as many groups as stand at the buffer's start. */
void program_dispatch_indirect(const struct program *program, GLuint buffer);

/* The text of one shader file with its includes, malloc; for the tests too. */
brume_result shader_load(const char *folder, const char *name, char **text);

#endif
