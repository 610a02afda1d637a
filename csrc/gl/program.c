/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Loading, including and linking shaders. */
#define _GNU_SOURCE /* dladdr */
#include "gl/program.h"
#include "base/result.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define INCLUDE_MAX 32
#define SHADER_MAX_BYTES (1 << 20)

static int is_folder(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 && S_ISDIR(status.st_mode);
}

brume_result program_cache_init(struct program_cache *cache, const char *shader_dir)
{
    memset(cache, 0, sizeof *cache);
    const char *environment = getenv("BRUME_SHADERS");
    Dl_info library;
    if (shader_dir) {
        snprintf(cache->folder, sizeof cache->folder, "%s", shader_dir);
    } else if (environment && *environment) {
        snprintf(cache->folder, sizeof cache->folder, "%s", environment);
    } else {
        if (dladdr((const void *)&brume_abi, &library) && library.dli_fname) {
            const char *slash = strrchr(library.dli_fname, '/');
            const int length = slash ? (int)(slash - library.dli_fname) : 0;
            snprintf(cache->folder, sizeof cache->folder, "%.*s/shaders", length,
                     library.dli_fname);
        }
        if (!is_folder(cache->folder))
            snprintf(cache->folder, sizeof cache->folder, "%s", BRUME_SOURCE_SHADERS);
    }
    if (!is_folder(cache->folder))
        return fail(BRUME_E_FILE_MISSING, "the shader folder '%s' is not there", cache->folder);
    return BRUME_OK;
}

void program_cache_finish(struct program_cache *cache)
{
    for (int i = 0; i < cache->count; ++i)
        glDeleteProgram(cache->programs[i].id);
    cache->count = 0;
}

/* --- Text --------------------------------------------------------------------------------- */

struct text {
    char *data;
    size_t length, capacity;
};

struct includes {
    const char *folder;
    char names[INCLUDE_MAX][96];
    int count;
};

static int append(struct text *text, const char *data, size_t length)
{
    if (text->length + length + 1 > text->capacity) {
        size_t capacity = (text->capacity + length + 1) * 2;
        char *grown = realloc(text->data, capacity);
        if (!grown)
            return 0;
        text->data = grown;
        text->capacity = capacity;
    }
    memcpy(text->data + text->length, data, length);
    text->length += length;
    text->data[text->length] = '\0';
    return 1;
}

static brume_result read_file(const char *folder, const char *name, char **out)
{
    char path[1200];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "rb");
    if (!file)
        return fail(BRUME_E_FILE_MISSING, "the shader '%s' is not there", path);
    char *data = malloc(SHADER_MAX_BYTES + 1);
    const size_t length = data ? fread(data, 1, SHADER_MAX_BYTES, file) : 0;
    fclose(file);
    if (!data)
        return fail(BRUME_E_MEMORY, "no memory to read the shader '%s'", path);
    data[length] = '\0';
    *out = data;
    return BRUME_OK;
}

/* Appends a file, each include at its first mention only. */
static brume_result append_file(struct includes *includes, const char *name, struct text *text)
{
    for (int i = 0; i < includes->count; ++i)
        if (strcmp(includes->names[i], name) == 0)
            return BRUME_OK;
    if (includes->count == INCLUDE_MAX)
        return fail(BRUME_E_GPU, "the shader '%s' includes more than %d files", name, INCLUDE_MAX);
    const int number = includes->count++;
    snprintf(includes->names[number], sizeof includes->names[number], "%s", name);

    char *source = NULL;
    TRY(read_file(includes->folder, name, &source));
    brume_result result = BRUME_OK;
    char directive[64];
    int line_number = 0;
    if (number > 0) {
        snprintf(directive, sizeof directive, "#line 1 %d\n", number);
        append(text, directive, strlen(directive));
    }
    for (char *line = source; *line && result == BRUME_OK;) {
        char *end = strchr(line, '\n');
        const size_t length = end ? (size_t)(end - line) + 1 : strlen(line);
        ++line_number;
        char included[96];
        if (sscanf(line, "#include \"%95[^\"\n]\"", included) == 1) {
            result = append_file(includes, included, text);
            snprintf(directive, sizeof directive, "#line %d %d\n", line_number + 1, number);
            if (!append(text, directive, strlen(directive)))
                result = fail(BRUME_E_MEMORY, "no memory for the shader '%s'", name);
        } else if (!append(text, line, length)) {
            result = fail(BRUME_E_MEMORY, "no memory for the shader '%s'", name);
        }
        line += length;
    }
    free(source);
    return result;
}

static brume_result load(struct includes *includes, const char *name, char **out)
{
    struct text text = {0};
    const brume_result result = append_file(includes, name, &text);
    if (result != BRUME_OK) {
        free(text.data);
        return result;
    }
    *out = text.data;
    return BRUME_OK;
}

brume_result shader_load(const char *folder, const char *name, char **text)
{
    struct includes includes = {.folder = folder};
    return load(&includes, name, text);
}

/* --- Programs ----------------------------------------------------------------------------- */

static brume_result compile(struct program_cache *cache, GLuint program, GLenum type,
                            const char *stem, const char *suffix)
{
    char name[96], variant[64] = "";
    const char *colon = strchr(stem, ':');
    snprintf(name, sizeof name, "%.*s.%s.glsl", colon ? (int)(colon - stem) : (int)strlen(stem),
             stem, suffix);
    if (colon)
        snprintf(variant, sizeof variant, "#define %s\n", colon + 1);
    struct includes includes = {.folder = cache->folder};
    char *text = NULL;
    TRY(load(&includes, name, &text));
    const GLuint shader = glCreateShader(type);
    /* Nothing but comments may stand before #version. */
    const char *version = strstr(text, "#version");
    const char *rest = version ? strchr(version, '\n') : NULL;
    rest = rest ? rest + 1 : text;
    const char *parts[] = {text, variant, rest};
    const GLint lengths[] = {(GLint)(rest - text), (GLint)strlen(variant), (GLint)strlen(rest)};
    glShaderSource(shader, 3, parts, lengths);
    glCompileShader(shader);
    free(text);
    GLint compiled = 0;
    glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
    brume_result result = BRUME_OK;
    if (!compiled) {
        char log[600] = "";
        glGetShaderInfoLog(shader, sizeof log, NULL, log);
        result = fail(BRUME_E_GPU, "the shader '%s' does not compile: %s", name, log);
    } else {
        glAttachShader(program, shader);
    }
    glDeleteShader(shader);
    return result;
}

static brume_result build(struct program_cache *cache, const char *stem, int compute,
                          const struct program **out)
{
    for (int i = 0; i < cache->count; ++i) {
        if (strcmp(cache->programs[i].name, stem) == 0) {
            *out = &cache->programs[i];
            return BRUME_OK;
        }
    }
    ASSERT(cache->count < PROGRAM_MAX);
    const GLuint id = glCreateProgram();
    brume_result result;
    if (compute) {
        result = compile(cache, id, GL_COMPUTE_SHADER, stem, "comp");
    } else {
        result = compile(cache, id, GL_VERTEX_SHADER, stem, "vert");
        if (result == BRUME_OK)
            result = compile(cache, id, GL_FRAGMENT_SHADER, stem, "frag");
    }
    if (result == BRUME_OK) {
        GLint linked = 0;
        glLinkProgram(id);
        glGetProgramiv(id, GL_LINK_STATUS, &linked);
        if (!linked) {
            char log[600] = "";
            glGetProgramInfoLog(id, sizeof log, NULL, log);
            result = fail(BRUME_E_GPU, "the program '%s' does not link: %s", stem, log);
        }
    }
    if (result != BRUME_OK) {
        glDeleteProgram(id);
        return result;
    }
    struct program *program = &cache->programs[cache->count++];
    snprintf(program->name, sizeof program->name, "%s", stem);
    program->id = id;
    if (compute)
        glGetProgramiv(id, GL_COMPUTE_WORK_GROUP_SIZE, program->group);
    glObjectLabel(GL_PROGRAM, id, -1, stem);
    *out = program;
    return BRUME_OK;
}

brume_result program_compute(struct program_cache *cache, const char *stem,
                             const struct program **out)
{
    return build(cache, stem, 1, out);
}

brume_result program_draw(struct program_cache *cache, const char *stem, const struct program **out)
{
    return build(cache, stem, 0, out);
}

void program_dispatch(const struct program *program, int x, int y, int z)
{
    const int *group = program->group;
    glUseProgram(program->id);
    glDispatchCompute((GLuint)((x + group[0] - 1) / group[0]),
                      (GLuint)((y + group[1] - 1) / group[1]),
                      (GLuint)((z + group[2] - 1) / group[2]));
}

void program_dispatch_indirect(const struct program *program, GLuint buffer)
{
    glUseProgram(program->id);
    glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, buffer);
    glDispatchComputeIndirect(0);
    glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, 0);
}
