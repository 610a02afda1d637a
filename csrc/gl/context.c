/* SPDX-License-Identifier: GPL-3.0-or-later */
/* EGL: a context on a device, else surfaceless, else on a pbuffer of the default display. */
#include "gl/context.h"
#include "base/log.h"
#include "base/result.h"

#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <stdio.h>
#include <string.h>

#define MAX_DEVICES 16

static const EGLint context_attributes[] = {
    EGL_CONTEXT_MAJOR_VERSION, 4,
    EGL_CONTEXT_MINOR_VERSION, 5,
    EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
    EGL_NONE, EGL_NONE, EGL_NONE};

static const EGLint debug_attributes[] = {
    EGL_CONTEXT_MAJOR_VERSION, 4,
    EGL_CONTEXT_MINOR_VERSION, 5,
    EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
    EGL_CONTEXT_OPENGL_DEBUG, EGL_TRUE, EGL_NONE};

static void drop(struct context *c)
{
    if (!c->display)
        return;
    eglMakeCurrent(c->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (c->surface)
        eglDestroySurface(c->display, c->surface);
    if (c->context)
        eglDestroyContext(c->display, c->context);
    /* Never eglTerminate: Blender may share this display. */
    c->display = c->context = c->surface = NULL;
}

static int is_software(const char *renderer)
{
    static const char *const words[] = {"llvmpipe", "softpipe", "swrast", "SWR", "Software"};
    for (size_t i = 0; i < sizeof words / sizeof *words; ++i)
        if (strstr(renderer, words[i]))
            return 1;
    return 0;
}

/* A current GL 4.5 context on the display, or false with c->info.renderer saying what was found. */
static int try_display(struct context *c, EGLDisplay display, uint32_t debug)
{
    EGLint major, minor;
    if (display == EGL_NO_DISPLAY || !eglInitialize(display, &major, &minor))
        return 0;
    if (!eglBindAPI(EGL_OPENGL_API))
        return 0;

    const int surfaceless = epoxy_has_egl_extension(display, "EGL_KHR_surfaceless_context");
    const EGLint config_attributes[] = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE,
                                        surfaceless ? 0 : EGL_PBUFFER_BIT, EGL_NONE};
    EGLConfig config = NULL;
    EGLint count = 0;
    if (!eglChooseConfig(display, config_attributes, &config, 1, &count) || count < 1)
        return 0;

    c->display = display;
    c->context =
        eglCreateContext(display, config, EGL_NO_CONTEXT, debug ? debug_attributes : context_attributes);
    if (c->context && !surfaceless) {
        const EGLint size[] = {EGL_WIDTH, 1, EGL_HEIGHT, 1, EGL_NONE};
        c->surface = eglCreatePbufferSurface(display, config, size);
    }
    if (!c->context || !eglMakeCurrent(display, c->surface, c->surface, c->context)) {
        /* Name what the machine does have, for the sentence that the user will read. */
        EGLContext any = eglCreateContext(display, config, EGL_NO_CONTEXT, NULL);
        if (any && eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, any)) {
            snprintf(c->info.renderer, sizeof c->info.renderer, "%s",
                     (const char *)glGetString(GL_RENDERER));
            snprintf(c->info.version, sizeof c->info.version, "%s",
                     (const char *)glGetString(GL_VERSION));
            eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        }
        if (any)
            eglDestroyContext(display, any);
        drop(c);
        return 0;
    }

    brume_device_info *info = &c->info;
    snprintf(info->renderer, sizeof info->renderer, "%s", (const char *)glGetString(GL_RENDERER));
    snprintf(info->version, sizeof info->version, "%s", (const char *)glGetString(GL_VERSION));
    glGetIntegerv(GL_MAJOR_VERSION, &info->gl_major);
    glGetIntegerv(GL_MINOR_VERSION, &info->gl_minor);
    glGetIntegerv(GL_MAX_3D_TEXTURE_SIZE, &info->max_texture_3d);
    info->software = (uint32_t)is_software(info->renderer);
    if (info->gl_major * 10 + info->gl_minor < 45) {
        drop(c);
        return 0;
    }
    return 1;
}

/* Hardware devices first: the device platform is the reliable one on machines with several. */
static int try_devices(struct context *c, uint32_t debug, int *displays)
{
    if (!epoxy_has_egl_extension(NULL, "EGL_EXT_platform_device") ||
        !epoxy_has_egl_extension(NULL, "EGL_EXT_device_enumeration"))
        return 0;
    EGLDeviceEXT devices[MAX_DEVICES];
    EGLint count = 0;
    if (!eglQueryDevicesEXT(MAX_DEVICES, devices, &count))
        return 0;
    for (int software = 0; software < 2; ++software) {
        for (EGLint i = 0; i < count; ++i) {
            EGLDisplay display =
                eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[i], NULL);
            *displays += display != EGL_NO_DISPLAY;
            if (!try_display(c, display, debug))
                continue;
            if (software || !c->info.software)
                return 1;
            drop(c);
        }
    }
    return 0;
}

static void APIENTRY on_message(GLenum source, GLenum type, GLuint id, GLenum severity,
                                GLsizei length, const GLchar *message, const void *user)
{
    (void)source, (void)id, (void)length;
    if (severity == GL_DEBUG_SEVERITY_NOTIFICATION)
        return;
    const int error = type == GL_DEBUG_TYPE_ERROR;
    if (error)
        ++((struct context *)user)->debug_errors;
    log_write(error ? BRUME_LOG_ERROR : BRUME_LOG_DEBUG, "OpenGL: %s", message);
}

/* libepoxy ends the process when it misses a library, so it is not asked before. */
static int has_library(const char *name)
{
    return dlopen(name, RTLD_LAZY | RTLD_LOCAL) != NULL; /* stays: the driver wants it too */
}

brume_result context_init(struct context *context, uint32_t debug)
{
    memset(context, 0, sizeof *context);
    if (!has_library("libEGL.so.1"))
        return fail(BRUME_E_NO_EGL, "the library libEGL.so.1 is not there: is a graphics driver (or "
                                    "Mesa) installed?");
    if (!has_library("libOpenGL.so.0") && !has_library("libGL.so.1"))
        return fail(BRUME_E_NO_GL, "neither libOpenGL.so.0 nor libGL.so.1 is there: is a graphics "
                                   "driver (or Mesa) installed?");
    int displays = 0;
    int found = try_devices(context, debug, &displays);
    if (!found && epoxy_has_egl_extension(NULL, "EGL_MESA_platform_surfaceless")) {
        EGLDisplay display =
            eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
        displays += display != EGL_NO_DISPLAY;
        found = try_display(context, display, debug);
    }
    if (!found && epoxy_has_egl_extension(NULL, "EGL_EXT_client_extensions")) {
        EGLDisplay display = eglGetDisplay(EGL_DEFAULT_DISPLAY);
        displays += display != EGL_NO_DISPLAY;
        found = try_display(context, display, debug);
    }
    if (!found && context->info.renderer[0])
        return fail(BRUME_E_NO_GL,
                    "Brume needs OpenGL 4.5; the driver's renderer '%s' offers '%s'",
                    context->info.renderer, context->info.version);
    if (!found && displays)
        return fail(BRUME_E_NO_GL,
                    "Brume needs OpenGL 4.5; none of the %d EGL displays offers desktop OpenGL",
                    displays);
    if (!found)
        return fail(BRUME_E_NO_EGL,
                    "no EGL display could be opened; is a graphics driver (or Mesa) installed?");

    if (debug) {
        glEnable(GL_DEBUG_OUTPUT);
        glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
        glDebugMessageCallback(on_message, context);
    }
    /* Reversed depth in [0, 1] keeps float precision at any distance. */
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    log_write(BRUME_LOG_INFO, "%s, OpenGL %s", context->info.renderer, context->info.version);
    return BRUME_OK;
}

void context_finish(struct context *context)
{
    drop(context);
    eglReleaseThread();
}

brume_result context_check(const char *during)
{
    const GLenum error = glGetError();
    if (error == GL_NO_ERROR)
        return BRUME_OK;
    while (glGetError() != GL_NO_ERROR)
        ;
    if (error == GL_OUT_OF_MEMORY)
        return fail(BRUME_E_MEMORY, "the graphics driver ran out of memory during %s", during);
    return fail(BRUME_E_GPU, "the graphics driver reported error 0x%04x during %s", error, during);
}
