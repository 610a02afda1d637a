/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What keeps the light of LPV's lattice from passing surfaces: links that they cut, which nothing
 * passes, and the paper's fuzzy blockers, which leak. A closed box is parted by a wall; a lamp
 * stands in one half, and in each half thin fog, away from the wall, tells how much light there is.
 */
#include "harness.h"

#define HALF 1.0f    /* of the box's side, m */
#define FOG 0.25f    /* the same, of the fog on either side */
#define BESIDE 0.55f /* from the wall to the fog's middle */
#define GREY 0.5f    /* reflectance of box and wall */
#define PIXELS 8

static const struct coefficients thin = {.sigma_s = {0.3f, 0.3f, 0.3f}};
static const float down[3] = {0, 0, -1};

/* A wall through the box's middle, upright. */
struct wall {
    const char *name;
    float degrees; /* turned by, from the lattice's axes */
    int cells;     /* thick */
};

static const struct wall walls[] = {
    {"infinitely thin", 0, 0},
    {"infinitely thin", 30, 0},
    {"a cell thick", 0, 1},
    {"a cell thick", 30, 1},
};

/* Upright, at that distance from the middle along the normal, and a little through the box. */
static void add_sheet(brume_scene *scene, uint64_t key, const float normal[2], float distance)
{
    static const uint32_t triangles[6] = {0, 1, 2, 0, 2, 3};
    const float reach = 1.001f * HALF;
    float positions[12];
    for (int i = 0; i < 4; ++i) {
        const float y = i == 1 || i == 2 ? reach : -reach;
        positions[3 * i] = (distance - normal[1] * y) / normal[0];
        positions[3 * i + 1] = y;
        positions[3 * i + 2] = i >= 2 ? reach : -reach;
    }
    add_matt(scene, key, "wall", GREY, identity, positions, 4, triangles, 2);
}

/* With so many lamps in one place, that together send the same. */
static brume_scene *parted_box(const struct wall *wall, int resolution, uint64_t lamps,
                               float normal[2])
{
    static const float middle_[3];
    float positions[24];
    uint32_t triangles[36];
    brume_scene *scene;
    const float turn = wall->degrees * 0.0174532925f;
    normal[0] = cosf(turn);
    normal[1] = sinf(turn);
    assert_ok(brume_scene_create(device, &scene));
    cube_mesh(middle_, HALF, positions, triangles);
    add_matt(scene, 1, "wall", GREY, identity, positions, 8, triangles, 12);
    const float thickness = (float)wall->cells * 2.0f * HALF / (float)(resolution - 1);
    add_sheet(scene, 2, normal, -0.5f * thickness);
    if (wall->cells)
        add_sheet(scene, 3, normal, 0.5f * thickness);
    for (uint64_t side = 0; side < 2; ++side) {
        const float at = side ? BESIDE : -BESIDE;
        add_fog_cube(scene, side, (float[3]){at * normal[0], at * normal[1], 0}, FOG, &thin);
    }
    const brume_light lamp = point_lamp((float[3]){-BESIDE * normal[0], -BESIDE * normal[1], 0.1f},
                                        100.0f / (float)lamps);
    for (uint64_t i = 0; i < lamps; ++i)
        assert_ok(brume_scene_set_light(scene, i, &lamp));
    return scene;
}

/* Mean of what the fog around a point scatters of light that was scattered or reflected before. */
static double light_at(brume_scene *scene, const brume_settings *settings, const float target[3])
{
    brume_view view = orthographic_view(target, down, FOG, 0.9f * HALF, PIXELS);
    view.passes = 1u << BRUME_PASS_VOLUME_INDIRECT;
    brume_job *job = render(scene, settings, &view);
    float *pixels = read_pass(job, &view, BRUME_PASS_VOLUME_INDIRECT);
    float *combined = read_pass(job, &view, BRUME_PASS_COMBINED);
    double sum = 0.0;
    for (int i = 0; i < PIXELS * PIXELS; ++i) {
        for (int c = 0; c < 3; ++c) {
            assert_true(isfinite(pixels[3 * i + c]) && pixels[3 * i + c] >= 0.0f);
            assert_true(isfinite(combined[4 * i + c]) && combined[4 * i + c] >= 0.0f);
        }
        sum += pixels[3 * i];
    }
    free(combined);
    free(pixels);
    brume_job_release(job);
    return sum / (PIXELS * PIXELS);
}

/* Lattices that light goes on in. The inner ones end in the middle of the walls' and the fog's
 * sides. */
struct lattices {
    const char *name;
    int resolution, cascades;
};

static const struct lattices lattices[] = {
    {"16³", 16, 1}, {"32³", 32, 1}, {"16³, two within", 16, 3}};

/* Light behind the wall, by the light before it. */
static double leak(const struct wall *wall, const struct lattices *in, uint32_t blockers,
                   uint64_t lamps, double *lit)
{
    const brume_settings settings = {.method = BRUME_METHOD_LPV,
                                     .medium_resolution = 64,
                                     .lattice_resolution = in->resolution,
                                     .field_resolution = in->resolution,
                                     .cascades = in->cascades,
                                     .shadow_resolution = 128,
                                     .blockers = blockers};
    float n[2];
    brume_scene *scene = parted_box(wall, in->resolution, lamps, n);
    *lit = light_at(scene, &settings, (float[3]){-BESIDE * n[0], -BESIDE * n[1], 0});
    const double dark = light_at(scene, &settings, (float[3]){BESIDE * n[0], BESIDE * n[1], 0});
    brume_scene_destroy(scene);
    return dark / *lit;
}

static void through_a_wall(void **state)
{
    (void)state;
    printf("| wall | turned by | lattice | links | fuzzy | before it, of links' |\n"
           "|---|---|---|---|---|---|\n");
    for (size_t w = 0; w < sizeof walls / sizeof *walls; ++w)
        for (size_t r = 0; r < sizeof lattices / sizeof *lattices; ++r) {
            double lit, fuzzy_lit;
            const double links = leak(&walls[w], &lattices[r], BRUME_BLOCKERS_LINKS, 1, &lit);
            const double fuzzy = leak(&walls[w], &lattices[r], BRUME_BLOCKERS_FUZZY, 1, &fuzzy_lit);
            printf("| %s | %g° | %s | %.1e | %.1f %% | %.0f %% |\n", walls[w].name,
                   (double)walls[w].degrees, lattices[r].name, links, 100.0 * fuzzy,
                   100.0 * fuzzy_lit / lit);
            assert_true(lit > 0.0 && fuzzy_lit > 0.0);
            /* Nothing passes; but in a wedge's very tip a cell's centre may lie behind either
             * wall, of what these reflect first; and beyond an inner lattice's sides, of a wall
             * askew, the side that a cell is on is not known exactly. */
            const double limit = lattices[r].cascades > 1 ? 1e-3 : 2e-4;
            assert_true(links < (walls[w].degrees > 0 && !walls[w].cells ? limit : 1e-6));
            assert_true(fuzzy > links && fuzzy < 1.0);
        }
}

/* What several lamps see blocks no more than what one sees. */
static void seen_by_several_lamps(void **state)
{
    (void)state;
    double lit[2], leaks[2];
    for (int i = 0; i < 2; ++i)
        leaks[i] = leak(&walls[1], &lattices[0], BRUME_BLOCKERS_FUZZY, i ? 4 : 1, &lit[i]);
    printf("four lamps instead of one: %.2f %% of the light before the wall, %.2f of its leak\n",
           100.0 * lit[1] / lit[0], leaks[1] / leaks[0]);
    assert_close(lit[1], lit[0], 0.01);
    assert_close(leaks[1], leaks[0], 0.01);
}

/* Without surfaces nothing is blocked, in either way. */
static void without_surfaces(void **state)
{
    (void)state;
    static const float origin[3];
    brume_scene *scene;
    assert_ok(brume_scene_create(device, &scene));
    add_fog_cube(scene, 1, origin, 0.5f, &(struct coefficients){.sigma_s = {1, 2, 4}, .g = 0.3f});
    const brume_light lamp = point_lamp((float[3]){-1, 0.2f, 0}, 100.0f);
    assert_ok(brume_scene_set_light(scene, 1, &lamp));
    const brume_view view = orthographic_view(origin, (float[3]){1, 2, -1}, 1.5f, 2.0f, 16);
    float *pictures[2];
    for (uint32_t blockers = 0; blockers < 2; ++blockers) {
        const brume_settings settings = {.method = BRUME_METHOD_LPV,
                                         .medium_resolution = 32,
                                         .lattice_resolution = 16,
                                         .field_resolution = 16,
                                         .blockers = blockers};
        brume_job *job = render(scene, &settings, &view);
        pictures[blockers] = read_pass(job, &view, BRUME_PASS_COMBINED);
        brume_job_release(job);
    }
    for (int i = 0; i < 16 * 16 * 4; ++i)
        assert_true(pictures[0][i] == pictures[1][i]);
    free(pictures[0]);
    free(pictures[1]);
    brume_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(through_a_wall),
        cmocka_unit_test(seen_by_several_lamps),
        cmocka_unit_test(without_surfaces),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
