/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Lamps that stand for small things that glow: which things, how many, and the light of a floor below
 * them against the sum over their triangles. */
#include "dom.h"

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
        cmocka_unit_test(small_things_light_a_floor),
        cmocka_unit_test(lamps_stand_for_parts),
        cmocka_unit_test(many_are_the_lattices),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
