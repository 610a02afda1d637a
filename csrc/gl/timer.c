/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Timestamps around a stage. */
#include "gl/timer.h"

#include <time.h>

double clock_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

void timer_begin(struct timer *timer, const char *name)
{
    glPushDebugGroup(GL_DEBUG_SOURCE_APPLICATION, 0, -1, name);
    glCreateQueries(GL_TIMESTAMP, 2, timer->queries);
    timer->started_ms = clock_ms();
    glQueryCounter(timer->queries[0], GL_TIMESTAMP);
}

void timer_end(struct timer *timer, double *wall_ms, double *gpu_ms)
{
    glQueryCounter(timer->queries[1], GL_TIMESTAMP);
    glFinish();
    GLuint64 begin = 0, end = 0;
    glGetQueryObjectui64v(timer->queries[0], GL_QUERY_RESULT, &begin);
    glGetQueryObjectui64v(timer->queries[1], GL_QUERY_RESULT, &end);
    glDeleteQueries(2, timer->queries);
    glPopDebugGroup();
    *wall_ms += clock_ms() - timer->started_ms;
    if (end > begin)
        *gpu_ms += (double)(end - begin) * 1e-6;
}

static void mark(struct laps *laps, int kind)
{
    GLuint *query = &laps->queries[laps->count];
    glCreateQueries(GL_TIMESTAMP, 1, query);
    glQueryCounter(*query, GL_TIMESTAMP);
    laps->kinds[laps->count++] = kind;
}

void laps_go(struct laps *laps, int kind)
{
    if (laps->count && laps->kinds[laps->count - 1] == kind)
        return;
    if (laps->count == LAPS - 1)
        laps_end(laps);
    mark(laps, kind);
}

void laps_end(struct laps *laps)
{
    if (!laps->count)
        return;
    mark(laps, -1);
    GLuint64 before = 0;
    for (int i = 0; i < laps->count; ++i) {
        GLuint64 now = 0;
        glGetQueryObjectui64v(laps->queries[i], GL_QUERY_RESULT, &now);
        if (i > 0 && now > before)
            laps->sums_ms[laps->kinds[i - 1]] += (double)(now - before) * 1e-6;
        before = now;
    }
    glDeleteQueries(laps->count, laps->queries);
    laps->count = 0;
}
