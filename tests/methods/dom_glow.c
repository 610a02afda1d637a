/* SPDX-License-Identifier: GPL-3.0-or-later */
/* DOM's surfaces that emit, against closed forms and a Monte Carlo: closed boxes in which all light is
 * even, and things in dark rooms, larger and smaller than the lattice's cells. */
#include "dom.h"

/* A closed box that glows and reflects: everywhere in it is the same light. */
static void glowing_walls(void **state)
{
    (void)state;
    const brume_settings settings = settings_for(16);
    const brume_material glowing = {
        .diffuse = {0.6f, 0.6f, 0.6f}, .emission = {200, 0.5f, 0.02f}, .roughness = 1, .alpha = 1};
    const struct coefficients fog = {.sigma_s = {1, 1, 1}};
    brume_scene *scene = empty();
    add_box(scene, 1, 1.0f, 0.0f);
    assert_ok(brume_scene_set_material(scene, 1, &glowing));
    add_fog_cube(scene, 2, origin, 0.5f, &fog); /* changes nothing */
    struct field field = field_of(scene, &settings, NULL);
    for (int c = 0; c < 3; ++c) {
        const double mean = mean_fluence(&field, c);
        const double truth = 4.0 * PI * (double)glowing.emission[c] / (1.0 - 0.6);
        print_message("glowing walls, emission %g: %+.2f %%\n", (double)glowing.emission[c],
                      100.0 * (mean / truth - 1.0));
        assert_close(mean, truth, 0.01);
    }
    free(field.texels);
    brume_scene_destroy(scene);
}

/* The same, turned against the lattice: cells' surfaces are cut askew. */
static void glowing_walls_askew(void **state)
{
    (void)state;
    const brume_settings settings = settings_for(24);
    const brume_material glowing = { /* red reflects nothing */
        .diffuse = {0, 0.3f, 0.6f}, .emission = {1, 1, 1}, .roughness = 1, .alpha = 1};
    const float k = 0.8660254f, h = 0.5f; /* 30 degrees about z, then about x */
    const float turned[16] = {k, h, 0, 0, -h * k, k * k, h, 0, h * h, -k * h, k, 0, 0, 0, 0, 1};
    const brume_instances instance = {.world_from_object = turned,
                                      .mesh = 1,
                                      .count = 1,
                                      .visibility = BRUME_VISIBLE_CAMERA | BRUME_VISIBLE_SHADOW};
    brume_scene *scene = empty();
    add_box(scene, 1, 1.0f, 0.0f);
    assert_ok(brume_scene_set_instances(scene, 1, &instance));
    assert_ok(brume_scene_set_material(scene, 1, &glowing));
    struct field field = field_of(scene, &settings, NULL);
    double mean[3] = {0.0}, worst[3] = {0.0};
    int count = 0;
    for (int z = 0; z < field.levels[0].dims.z; ++z)
        for (int y = 0; y < field.levels[0].dims.y; ++y)
            for (int x = 0; x < field.levels[0].dims.x; ++x) {
                const int cell[3] = {x, y, z};
                double square = 0.0;
                for (int i = 0; i < 3; ++i)
                    square += centre(&field, i, cell[i]) * centre(&field, i, cell[i]);
                if (square > 0.64)
                    continue;
                for (int c = 0; c < 3; ++c) {
                    const double truth = 4.0 * PI / (1.0 - (double)(&glowing.diffuse[0])[c]);
                    const double off = fluence(&field, cell, c) / truth - 1.0;
                    worst[c] = fmax(worst[c], fabs(off));
                    mean[c] += off;
                }
                ++count;
            }
    for (int c = 0; c < 3; ++c) {
        print_message("glowing walls askew, reflectance %.1f: mean fluence %+.2f %%, worst %.2f %%\n",
                      (double)(&glowing.diffuse[0])[c], 100.0 * mean[c] / count, 100.0 * worst[c]);
        assert_true(fabs(mean[c] / count) < 0.002 && worst[c] < 0.002);
    }
    free(field.texels);
    brume_scene_destroy(scene);
}

/* A small box that glows in a room that reflects nothing. */
static void glowing_thing(void **state)
{
    (void)state;
    const brume_material glowing = {.emission = {1, 1, 1}, .roughness = 1, .alpha = 1};
    const brume_settings settings = settings_for(32);
    static const float at[3] = {0.13f, -0.21f, 0.3f};
    const float half = 0.2f;
    brume_scene *scene = empty();
    add_box(scene, 1, 1.0f, 0.0f);
    add_box_at(scene, 2, at, half, 0.0f);
    assert_ok(brume_scene_set_material(scene, 2, &glowing));
    struct field field = field_of(scene, &settings, NULL);
    double found = 0.0, truth = 0.0;
    for (int z = 0; z < 32; ++z)
        for (int y = 0; y < 32; ++y)
            for (int x = 0; x < 32; ++x) {
                const int cell[3] = {x, y, z};
                bool within = true;
                for (int i = 0; i < 3; ++i)
                    within = within && fabsf(centre(&field, i, cell[i]) - at[i]) < half;
                found += within ? 0.0 : fluence(&field, cell, 0) / (32.0 * 32.0 * 32.0);
            }
    uint64_t lots = 88172645463325252u;
    const int count = 100000;
    for (int i = 0; i < count; ++i) { /* from its sides to the walls */
        double p[3], d[3], way;
        const int axis = i % 3;
        const double sign = i / 3 % 2 ? 1.0 : -1.0;
        const double sine = sqrt(lot(&lots)), turn = 2.0 * PI * lot(&lots);
        for (int k = 0; k < 3; ++k)
            p[k] = (double)at[k] + (double)half * (k == axis ? sign : 2.0 * lot(&lots) - 1.0);
        d[axis] = sign * sqrt(1.0 - sine * sine);
        d[(axis + 1) % 3] = sine * cos(turn);
        d[(axis + 2) % 3] = sine * sin(turn);
        wall_ahead(p, d, 1.0, &way);
        truth += way / count;
    }
    truth *= PI * 24.0 * (double)half * (double)half / 8.0; /* W, over the room's volume */
    print_message("a glowing thing: mean fluence %+.2f %%\n", 100.0 * (found / truth - 1.0));
    assert_close(found, truth, 0.05);
    free(field.texels);
    brume_scene_destroy(scene);
}

/* Boxes larger than lamps stand for, anywhere in it: light in the room but for the cells around them. It
 * is right in the mean; of one box it depends on how many lines meet it. */
static void small_things_glow(void **state)
{
    (void)state;
    enum { CELLS = 16, PLACES = 12 };
    static const struct {
        double side, worst, mean; /* in cells */
    } cases[] = {{1.05, 0.45, 0.25}, {1.5, 0.20, 0.05}, {2.0, 0.25, 0.20}};
    const brume_material glowing = {.emission = {1, 1, 1}, .roughness = 1, .alpha = 1};
    const brume_settings settings = settings_for(CELLS);
    for (size_t n = 0; n < sizeof cases / sizeof *cases; ++n) {
        const double half = 0.5 * cases[n].side * 2.0 / CELLS;
        uint64_t lots = 88172645463325252u;
        double worst = 0.0, sum = 0.0;
        for (int place = 0; place < PLACES; ++place) {
            double middle[3];
            float at[3];
            for (int i = 0; i < 3; ++i) {
                middle[i] = (lot(&lots) + 1.0) * 2.0 / CELLS; /* in one cell */
                at[i] = (float)middle[i];
            }
            brume_scene *scene = empty();
            add_box(scene, 1, 1.0f, 0.0f);
            add_box_at(scene, 2, at, (float)half, 0.0f);
            assert_ok(brume_scene_set_material(scene, 2, &glowing));
            struct field field = field_of(scene, &settings, NULL);
            double found = 0.0, truth = 0.0;
            for (int z = 0; z < CELLS; ++z)
                for (int y = 0; y < CELLS; ++y)
                    for (int x = 0; x < CELLS; ++x) {
                        const int cell[3] = {x, y, z};
                        double square = 0.0, sum_of = 0.0;
                        for (int i = 0; i < 3; ++i) {
                            const double off = centre(&field, i, cell[i]) - middle[i];
                            square += off * off;
                            sum_of += fabs(off);
                        }
                        if (square < 0.09)
                            continue; /* too near for the means of cells */
                        found += fluence(&field, cell, 0);
                        truth += 4.0 * half * half * sum_of / (square * sqrt(square)); /* as seen */
                    }
            const double off = found / truth - 1.0;
            worst = fmax(worst, fabs(off));
            sum += off / PLACES;
            free(field.texels);
            brume_scene_destroy(scene);
        }
        print_message("glowing boxes %.2f cells wide: mean %+.1f %%, worst %.1f %%\n",
                      cases[n].side, 100.0 * sum, 100.0 * worst);
        assert_true(fabs(sum) < cases[n].mean && worst < cases[n].worst);
    }
}

/* --- Lamps for what is no larger than a cell or so -------------------------------------------- */

enum { FLOOR_CELLS = 16, PIXELS = 24, RINGS = 8, AROUND = 12, COPIES = 2 };

/* A shape around the origin, which a matrix puts in its place. */
struct shape {
    const char *name;
    float half[3];  /* of a ball, or of a box; without thickness: a square of two triangles */
    bool round;
    int copies;     /* side by side along x, in one mesh */
    int instances;  /* side by side along y */
    double within;  /* how far any place on the floor may be off, over the mean */
};

struct mesh_of {
    float positions[COPIES * RINGS * AROUND * 3];
    uint32_t triangles[COPIES * RINGS * AROUND * 6], vertices, triangle_count;
};

/* A ball of radius 1 by its rings, the first and the last points. */
static void ball_mesh(struct mesh_of *mesh)
{
    for (int ring = 0; ring < RINGS; ++ring)
        for (int i = 0; i < AROUND; ++i) {
            const double up = PI * ring / (RINGS - 1), turn = 2.0 * PI * i / AROUND;
            const double wide = ring % (RINGS - 1) ? sin(up) : 0.0;
            float *p = mesh->positions + 3 * mesh->vertices++;
            p[0] = (float)(wide * cos(turn));
            p[1] = (float)(wide * sin(turn));
            p[2] = (float)cos(up);
            const uint32_t a = (uint32_t)(ring * AROUND + i);
            const uint32_t b = (uint32_t)(ring * AROUND + (i + 1) % AROUND);
            const uint32_t quad[6] = {a, a + AROUND, b + AROUND, a, b + AROUND, b};
            if (ring < RINGS - 1)
                memcpy(mesh->triangles + 3 * mesh->triangle_count, quad, sizeof quad);
            mesh->triangle_count += ring < RINGS - 1 ? 2 : 0;
        }
}

static void box_mesh(const struct shape *shape, struct mesh_of *mesh)
{
    static const uint32_t square[6] = {0, 1, 3, 0, 3, 2};
    const bool flat = shape->half[2] == 0.0f;
    cube_mesh(origin, 1.0f, mesh->positions, mesh->triangles);
    if (flat)
        memcpy(mesh->triangles, square, sizeof square);
    mesh->vertices = flat ? 4 : 8;
    mesh->triangle_count = flat ? 2 : 12;
}

static void shape_mesh(const struct shape *shape, float apart, struct mesh_of *mesh)
{
    memset(mesh, 0, sizeof *mesh);
    if (shape->round)
        ball_mesh(mesh);
    else
        box_mesh(shape, mesh);
    for (uint32_t i = 0; i < 3 * mesh->vertices; ++i)
        mesh->positions[i] *= shape->half[i % 3];
    for (int copy = 1; copy < shape->copies; ++copy) {
        for (uint32_t i = 0; i < 3 * mesh->vertices; ++i)
            mesh->positions[3 * mesh->vertices + i] =
                mesh->positions[i] + (i % 3 == 0 ? apart : 0.0f);
        for (uint32_t i = 0; i < 3 * mesh->triangle_count; ++i)
            mesh->triangles[3 * mesh->triangle_count + i] = mesh->triangles[i] + mesh->vertices;
        mesh->vertices *= 2;
        mesh->triangle_count *= 2;
    }
}

/* What a place on the floor gets of all triangles, each as if in its middle; of closed shapes from
 * their outer sides alone. */
static double irradiance(const struct mesh_of *mesh, const float *matrices, int instances, bool open,
                         const double place[3])
{
    double sum = 0.0;
    for (uint32_t t = 0; t < mesh->triangle_count * (uint32_t)instances; ++t) {
        const float *m = matrices + 16 * (t / mesh->triangle_count);
        const uint32_t *corner = mesh->triangles + 3 * (t % mesh->triangle_count);
        double p[3][3], n[3], middle[3], square = 0.0, leaves = 0.0;
        for (int k = 0; k < 3; ++k)
            for (int i = 0; i < 3; ++i) {
                const float *q = mesh->positions + 3 * corner[k];
                p[k][i] = (double)(m[i] * q[0] + m[4 + i] * q[1] + m[8 + i] * q[2] + m[12 + i]);
            }
        for (int i = 0; i < 3; ++i) {
            const int a = (i + 1) % 3, b = (i + 2) % 3;
            n[i] = 0.5 * ((p[1][a] - p[0][a]) * (p[2][b] - p[0][b]) -
                          (p[1][b] - p[0][b]) * (p[2][a] - p[0][a]));
            middle[i] = (p[0][i] + p[1][i] + p[2][i]) / 3.0 - place[i];
            square += middle[i] * middle[i];
        }
        for (int i = 0; i < 3; ++i)
            leaves -= n[i] * middle[i] / sqrt(square);
        leaves = open ? fabs(leaves) : fmax(leaves, 0.0);
        sum += leaves * (middle[2] / sqrt(square)) / square;
    }
    return sum;
}

/* Bulbs, panels, strings of them: the floor of a dark room, place by place, against their sum. */
static void small_things_light_a_floor(void **state)
{
    (void)state;
    static const struct shape shapes[] = {
        {"a ball", {0.06f, 0.06f, 0.06f}, true, 1, 1, 0.08},
        {"a ball of a sixtieth of a cell", {0.001f, 0.001f, 0.001f}, true, 1, 1, 0.08},
        {"a square, both sides", {0.025f, 0.025f, 0}, false, 1, 1, 0.08},
        {"a panel", {0.025f, 0.02f, 0.0005f}, false, 1, 1, 0.08},
        {"two balls in one mesh, three times", {0.02f, 0.02f, 0.02f}, true, 2, 3, 0.08},
    };
    const brume_material glowing = {.emission = {70000, 10000, 0}, .roughness = 1, .alpha = 1};
    brume_settings settings = settings_for(FLOOR_CELLS);
    settings.shadow_resolution = 512;
    for (size_t n = 0; n < sizeof shapes / sizeof *shapes; ++n) {
        const struct shape *shape = &shapes[n];
        const bool open = shape->half[2] == 0.0f;
        struct mesh_of mesh;
        shape_mesh(shape, 0.4f, &mesh);
        float matrices[16 * 3];
        for (int i = 0; i < shape->instances; ++i)
            placed((float[3]){-0.17f, 0.3f * (float)i - 0.21f, 0.13f}, (float[3]){0.2f, 0.3f, -1},
                   matrices + 16 * i);
        brume_scene *scene = empty();
        add_box(scene, 1, 1.0f, 0.0f);
        add_plate(scene, 2, (float[3]){0, 0, -0.9f}, (float[3]){0, 0, -1}, 1.9f);
        add_matt(scene, 3, "shape", 0.0f, matrices, mesh.positions, mesh.vertices, mesh.triangles,
                 mesh.triangle_count);
        const brume_instances instances = {.world_from_object = matrices,
                                           .mesh = 3,
                                           .count = (uint32_t)shape->instances,
                                           .visibility = BRUME_VISIBLE_SHADOW};
        assert_ok(brume_scene_set_instances(scene, 3, &instances));
        assert_ok(brume_scene_set_material(scene, 3, &glowing));
        const brume_view view = orthographic_view((float[3]){0, 0, -0.9f}, (float[3]){0, 0, -1},
                                                  1.6f, 1.5f, PIXELS);
        brume_job *job = render(scene, &settings, &view);
        float *pixels = read_pass(job, &view, BRUME_PASS_COMBINED);
        brume_job_release(job);
        double worst = 0.0, mean = 0.0, found = 0.0;
        for (int pixel = 0; pixel < 2 * PIXELS * PIXELS; ++pixel) {
            const int at = pixel % (PIXELS * PIXELS);
            const double place[3] = {((at % PIXELS + 0.5) / PIXELS - 0.5) * 1.6,
                                     ((at / PIXELS + 0.5) / PIXELS - 0.5) * 1.6, -0.9};
            const double truth = irradiance(&mesh, matrices, shape->instances, open, place);
            const double seen = PI * (double)pixels[4 * at + 1] / 10000.0;
            if (pixel < PIXELS * PIXELS) {
                mean += truth / (PIXELS * PIXELS);
                found += seen / (PIXELS * PIXELS);
                assert_true(fabs((double)(pixels[4 * at] - 7.0f * pixels[4 * at + 1])) <
                            2e-3 * (double)pixels[4 * at]);
                assert_true(pixels[4 * at + 2] == 0.0f);
            } else {
                worst = fmax(worst, fabs(seen - truth) / mean);
            }
        }
        print_message("%s: floor %+.1f %%, worst place %.1f %% of the mean\n", shape->name,
                      100.0 * (found / mean - 1.0), 100.0 * worst);
        assert_close(found, mean, 0.02);
        assert_true(worst < shape->within);
        free(pixels);
        brume_scene_destroy(scene);
    }
}

/* As many lamps as a thing has parts that are like balls: not more for seams, nor for what is inside;
 * none for what has a hole in its middle, or is long. */
static void lamps_stand_for_parts(void **state)
{
    (void)state;
    const brume_settings settings = settings_for(FLOOR_CELLS);
    const brume_material glowing = {.emission = {1, 1, 1}, .roughness = 1, .alpha = 1};
    struct mesh_of ball = {0}, seams = {0}, ring = {0}, nested, rod;
    ball_mesh(&ball);
    for (uint32_t i = 0; i < 3 * ball.vertices; ++i)
        ball.positions[i] *= 0.03f;
    for (uint32_t t = 0; t < 36; ++t) { /* of a cube, each triangle by itself */
        float positions[24];
        uint32_t triangles[36];
        cube_mesh(origin, 0.03f, positions, triangles);
        memcpy(seams.positions + 3 * t, positions + 3 * triangles[t], 3 * sizeof(float));
        seams.triangles[t] = t;
    }
    seams.vertices = 36;
    seams.triangle_count = 12;
    ring = ball; /* its first and last rings moved together: a hollow ring */
    for (uint32_t i = 0; i < AROUND; ++i)
        for (uint32_t k = 0; k < 3; ++k)
            ring.positions[3 * ((RINGS - 1) * AROUND + i) + k] = ring.positions[3 * i + k] =
                k == 2 ? 0.0f : 0.01f / 0.03f * ball.positions[3 * ((RINGS / 2) * AROUND + i) + k];
    nested = ball;
    for (uint32_t i = 0; i < 3 * ball.vertices; ++i)
        nested.positions[3 * ball.vertices + i] = 0.5f * ball.positions[i];
    for (uint32_t i = 0; i < 3 * ball.triangle_count; ++i)
        nested.triangles[3 * ball.triangle_count + i] = ball.triangles[i] + ball.vertices;
    nested.vertices *= 2;
    nested.triangle_count *= 2;
    rod = ball;
    for (uint32_t i = 0; i < ball.vertices; ++i)
        for (uint32_t k = 0; k < 2; ++k)
            rod.positions[3 * i + k] *= 0.1f;
    const struct {
        const char *name;
        const struct mesh_of *mesh;
        uint32_t lamps;
    } cases[] = {{"a ball", &ball, 1}, {"a cube with seams", &seams, 1}, {"a ring", &ring, 0},
                 {"a ball in a ball", &nested, 1}, {"a rod", &rod, 0}};
    for (size_t n = 0; n < sizeof cases / sizeof *cases; ++n) {
        const struct mesh_of *mesh = cases[n].mesh;
        brume_scene *scene = empty();
        add_box(scene, 1, 1.0f, 0.0f);
        add_matt(scene, 3, "thing", 0.0f, identity, mesh->positions, mesh->vertices,
                 mesh->triangles, mesh->triangle_count);
        assert_ok(brume_scene_set_material(scene, 3, &glowing));
        brume_stats stats;
        struct field field = field_of(scene, &settings, &stats);
        free(field.texels);
        print_message("%s: %u lamps\n", cases[n].name, stats.light_count);
        assert_int_equal(stats.light_count, cases[n].lamps);
        brume_scene_destroy(scene);
    }
}

/* More than there are lamps for: the lattice has them, as ever. */
static void many_are_the_lattices(void **state)
{
    (void)state;
    enum { COUNT = 40 };
    const brume_material glowing = {.emission = {1, 1, 1}, .roughness = 1, .alpha = 1};
    const brume_settings settings = settings_for(FLOOR_CELLS);
    float matrices[16 * COUNT];
    brume_scene *scene = empty();
    add_box(scene, 1, 1.0f, 0.0f);
    add_box_at(scene, 2, origin, 0.03f, 0.0f);
    for (int i = 0; i < COUNT; ++i)
        placed((float[3]){0.19f * (float)(i % 8) - 0.7f, 0.25f * (float)(i / 8) - 0.6f, 0.1f},
               (float[3]){0, 0, -1}, matrices + 16 * i);
    brume_instances instances = {.world_from_object = matrices, .mesh = 2, .count = COUNT,
                                 .visibility = BRUME_VISIBLE_CAMERA | BRUME_VISIBLE_SHADOW};
    assert_ok(brume_scene_set_instances(scene, 2, &instances));
    assert_ok(brume_scene_set_material(scene, 2, &glowing));
    brume_stats stats;
    struct field field = field_of(scene, &settings, &stats);
    assert_int_equal(stats.light_count, 0);
    assert_true(mean_fluence(&field, 0) > 0.0);
    free(field.texels);
    instances.count = 24;
    assert_ok(brume_scene_set_instances(scene, 2, &instances));
    field = field_of(scene, &settings, &stats);
    assert_int_equal(stats.light_count, 24);
    assert_true(mean_fluence(&field, 0) == 0.0); /* what comes straight from lamps is not in it */
    free(field.texels);
    brume_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(glowing_walls),
        cmocka_unit_test(glowing_walls_askew),
        cmocka_unit_test(glowing_thing),
        cmocka_unit_test(small_things_glow),
        cmocka_unit_test(small_things_light_a_floor),
        cmocka_unit_test(lamps_stand_for_parts),
        cmocka_unit_test(many_are_the_lattices),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
