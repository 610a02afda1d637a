/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Surfaces on the GPU. */
#include "render/geometry.h"
#include "base/result.h"
#include "math/frame.h"
#include "scene/pack.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

/* m; squares of distances stay finite floats. */
#define FARTHEST 1e15f
#define HALF_MAX 65504.0f
#define VERTEX_BYTES (VERTEX_FLOATS * sizeof(float))
#define TRIANGLE_BYTES (3 * sizeof(uint32_t)) /* its corners' numbers */

/* --- Caches ------------------------------------------------------------------------------- */

static void finish_mesh(struct gpu *gpu, struct gpu_mesh *mesh)
{
    buffer_finish(&gpu->memory, &mesh->vertices);
    buffer_finish(&gpu->memory, &mesh->corners);
}

static brume_result upload_mesh(struct gpu *gpu, struct gpu_mesh *mesh, const struct entry *entry)
{
    const struct mesh_block *source = (const struct mesh_block *)entry->block;
    mesh->key = entry->key;
    mesh->revision = entry->revision;
    TRY(buffer_init(&gpu->memory, &mesh->vertices, FOR_MESH,
                    (uint64_t)source->vertex_count * VERTEX_BYTES, source->vertices, source->name));
    const brume_result result = buffer_init(&gpu->memory, &mesh->corners, FOR_MESH,
                                            (uint64_t)source->triangle_count * TRIANGLE_BYTES,
                                            source->corners, source->name);
    if (result != BRUME_OK)
        finish_mesh(gpu, mesh);
    return result;
}

static int mip_levels(int width, int height)
{
    int levels = 1;
    for (int side = width > height ? width : height; side > 1; side /= 2)
        ++levels;
    return levels;
}

static brume_result upload_image(struct gpu *gpu, struct gpu_image *image,
                                 const struct entry *entry)
{
    static const GLint wraps[] = {
        [BRUME_EXTEND_REPEAT] = GL_REPEAT,
        [BRUME_EXTEND_CLAMP] = GL_CLAMP_TO_EDGE,
        [BRUME_EXTEND_CLIP] = GL_CLAMP_TO_EDGE, /* the shader cuts */
        [BRUME_EXTEND_MIRROR] = GL_MIRRORED_REPEAT,
    };
    const struct image_block *source = (const struct image_block *)entry->block;
    image->key = entry->key;
    image->revision = entry->revision;
    image->extend = source->extend;
    GLint limit = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &limit);
    if (source->width > limit || source->height > limit)
        return fail(BRUME_E_MEMORY, "image '%s' of %d x %d pixels is larger than the driver's %d",
                    source->name, source->width, source->height, limit);
    /* The sun of an outdoor panorama passes what halves hold. */
    const GLenum format = source->maximum > HALF_MAX ? GL_RGBA32F : GL_RGBA16F;
    TRY(texture_init(&gpu->memory, &image->texture, FOR_IMAGE, GL_TEXTURE_2D, format, source->width,
                     source->height, 1, mip_levels(source->width, source->height), source->name));
    const GLuint id = image->texture.id;
    glTextureSubImage2D(id, 0, 0, 0, source->width, source->height, GL_RGBA, GL_FLOAT,
                        source->pixels);
    glGenerateTextureMipmap(id);
    glTextureParameteri(id, GL_TEXTURE_WRAP_S, wraps[source->extend]);
    glTextureParameteri(id, GL_TEXTURE_WRAP_T, wraps[source->extend]);
    if (source->nearest) {
        glTextureParameteri(id, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        glTextureParameteri(id, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    }
    return BRUME_OK;
}

/* Both lists are sorted by key: what stands in both at one revision is kept. */
static brume_result sync_meshes(struct gpu *gpu, struct geometry *geometry,
                                const struct table *table)
{
    struct gpu_mesh *fresh = calloc((size_t)table->count + 1, sizeof *fresh);
    if (!fresh)
        return fail(BRUME_E_MEMORY, "no memory for %u meshes", table->count);
    brume_result result = BRUME_OK;
    /* What goes is freed before anything new comes. */
    for (uint32_t i = 0; i < geometry->mesh_count; ++i) {
        struct gpu_mesh *mesh = &geometry->meshes[i];
        const struct entry *entry = table_find(table, mesh->key);
        if (!entry || entry->revision != mesh->revision)
            finish_mesh(gpu, mesh);
    }
    uint32_t old = 0, count = 0;
    for (uint32_t i = 0; i < table->count; ++i) {
        const struct entry *entry = &table->entries[i];
        while (old < geometry->mesh_count && geometry->meshes[old].key < entry->key)
            ++old;
        if (old < geometry->mesh_count && geometry->meshes[old].key == entry->key &&
            geometry->meshes[old].corners.id)
            fresh[count++] = geometry->meshes[old++];
        else if (result == BRUME_OK && (result = upload_mesh(gpu, &fresh[count], entry)) == BRUME_OK)
            ++count;
    }
    free(geometry->meshes);
    geometry->meshes = fresh;
    geometry->mesh_count = count;
    return result;
}

static brume_result sync_images(struct gpu *gpu, struct geometry *geometry,
                                const struct table *table, struct job_control *control)
{
    struct gpu_image *fresh = calloc((size_t)table->count + 1, sizeof *fresh);
    if (!fresh)
        return fail(BRUME_E_MEMORY, "no memory for %u images", table->count);
    for (uint32_t i = 0; i < geometry->image_count; ++i) {
        struct gpu_image *image = &geometry->images[i];
        const struct entry *entry = table_find(table, image->key);
        if (!entry || entry->revision != image->revision)
            texture_finish(&gpu->memory, &image->texture);
    }
    uint32_t old = 0, count = 0;
    for (uint32_t i = 0; i < table->count; ++i) {
        const struct entry *entry = &table->entries[i];
        while (old < geometry->image_count && geometry->images[old].key < entry->key)
            ++old;
        if (old < geometry->image_count && geometry->images[old].key == entry->key &&
            geometry->images[old].texture.id)
            fresh[count++] = geometry->images[old++];
        else if (upload_image(gpu, &fresh[count], entry) == BRUME_OK)
            ++count;
        else
            job_warn(control, "IMAGE_LEFT_OUT", "%s", last_error());
    }
    free(geometry->images);
    geometry->images = fresh;
    geometry->image_count = count;
    return BRUME_OK;
}

const struct gpu_image *geometry_image(const struct geometry *geometry, uint64_t key)
{
    if (key)
        for (uint32_t i = 0; i < geometry->image_count; ++i)
            if (geometry->images[i].key == key)
                return &geometry->images[i];
    return NULL;
}

static const struct gpu_mesh *find_mesh(const struct geometry *geometry, uint64_t key)
{
    uint32_t low = 0, high = geometry->mesh_count;
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        if (geometry->meshes[middle].key < key)
            low = middle + 1;
        else
            high = middle;
    }
    return low < geometry->mesh_count && geometry->meshes[low].key == key ? &geometry->meshes[low]
                                                                          : NULL;
}

/* --- Materials ---------------------------------------------------------------------------- */

static struct gpu_material material_to_gpu(const struct geometry *geometry, const brume_material *m)
{
    struct gpu_material out = {
        .diffuse = pack(m->diffuse, m->roughness),
        .specular = pack(m->specular, m->alpha),
        .metal = pack(m->metal, m->alpha_threshold > 0.0f ? m->alpha_threshold : 0.5f),
        .emission = pack(m->emission, fminf(fmaxf(m->burley, 0.0f), 1.0f)),
        .transparent = pack(m->transparent, 0.0f),
    };
    const struct gpu_image *base = geometry_image(geometry, m->base_image);
    if (base)
        out.flags.x |= MATERIAL_BASE_IMAGE |
                       (base->extend == BRUME_EXTEND_CLIP ? MATERIAL_CLIP_IMAGE : 0u) |
                       (m->alpha_from_base_image ? MATERIAL_ALPHA_IMAGE : 0u);
    if (geometry_image(geometry, m->roughness_image))
        out.flags.x |= MATERIAL_ROUGHNESS_IMAGE;
    if (m->alpha_mode == BRUME_ALPHA_CLIP)
        out.flags.x |= MATERIAL_ALPHA_CLIP;
    if (m->alpha_mode == BRUME_ALPHA_BLEND && (m->alpha < 1.0f || m->alpha_from_base_image))
        out.flags.x |= MATERIAL_ALPHA_BLEND;
    if (m->backface_culling)
        out.flags.x |= MATERIAL_CULL_BACK;
    return out;
}

/* Number 0 is the grey of a slot without material; the others follow the table. */
static brume_result sync_materials(struct gpu *gpu, struct geometry *geometry,
                                   const struct table *table)
{
    static const brume_material grey = {.diffuse = {0.8f, 0.8f, 0.8f}, .roughness = 0.5f,
                                        .alpha = 1.0f};
    const size_t count = (size_t)table->count + 1;
    struct gpu_material *materials = calloc(count, sizeof *materials);
    if (!materials)
        return fail(BRUME_E_MEMORY, "no memory for %u materials", table->count);
    materials[0] = material_to_gpu(geometry, &grey);
    for (uint32_t i = 0; i < table->count; ++i)
        materials[i + 1] = material_to_gpu(
            geometry, &((const struct material_block *)table->entries[i].block)->material);
    geometry->brightest = 0.0f;
    for (size_t i = 0; i < count; ++i) {
        const vec4 e = materials[i].emission;
        geometry->brightest = fmaxf(geometry->brightest, fmaxf(e.x, fmaxf(e.y, e.z)));
    }
    const brume_result result =
        buffer_update(&gpu->memory, &geometry->materials, FOR_MESH, count * sizeof *materials,
                      materials, "materials");
    free(materials);
    return result;
}

/* --- Instances and draws ------------------------------------------------------------------ */

static void grow(float lower[3], float upper[3], const float add_lower[3], const float add_upper[3])
{
    for (int i = 0; i < 3; ++i) {
        lower[i] = fminf(lower[i], add_lower[i]);
        upper[i] = fmaxf(upper[i], add_upper[i]);
    }
}

static int is_flat(const struct mesh_block *mesh)
{
    float thinnest = INFINITY, longest = 0.0f;
    for (int i = 0; i < 3; ++i) {
        thinnest = fminf(thinnest, mesh->upper[i] - mesh->lower[i]);
        longest = fmaxf(longest, mesh->upper[i] - mesh->lower[i]);
    }
    return thinnest <= 1e-3f * longest; /* a point, too */
}

static void write_instance(struct gpu_instance *out, const float *world_from_object,
                           uint32_t visibility, uint32_t number)
{
    float inverse[16];
    memcpy(&out->world_from_object, world_from_object, sizeof out->world_from_object);
    mat4_invert(world_from_object, inverse); /* singular ones were left out */
    for (int column = 0; column < 4; ++column)
        for (int row = 0; row < 4; ++row)
            out->normal_from_object.m[4 * column + row] =
                column < 3 && row < 3 ? inverse[4 * row + column] : (column == row);
    out->flags = (uvec4){visibility, number, 0, 0};
}

static int glows(const brume_material *material)
{
    const float *e = material->emission;
    return e[0] > 0.0f || e[1] > 0.0f || e[2] > 0.0f;
}

/* Whether some of a mesh's instances light others. */
static int any_glows(const struct snapshot *snapshot, const struct mesh_block *mesh,
                     uint32_t visibility)
{
    const struct table *materials = &snapshot->tables[BRUME_KIND_MATERIAL];
    for (uint32_t slot = 0; slot < mesh->slot_count && visibility & BRUME_VISIBLE_SHADOW; ++slot) {
        const struct entry *entry = table_find(materials, mesh->materials[slot]);
        if (entry && mesh->slot_first[slot] < mesh->slot_first[slot + 1] &&
            glows(&((struct material_block *)entry->block)->material))
            return 1;
    }
    return 0;
}

static void add_draws(struct geometry *geometry, const struct snapshot *snapshot,
                      const struct mesh_block *mesh, const struct gpu_mesh *gpu_mesh,
                      const struct entry *set, const float lower[3],
                      const float upper[3], uint32_t first_instance, uint32_t instance_count)
{
    const struct table *materials = &snapshot->tables[BRUME_KIND_MATERIAL];
    for (uint32_t slot = 0; slot < mesh->slot_count; ++slot) {
        const uint32_t first = mesh->slot_first[slot], end = mesh->slot_first[slot + 1];
        if (first == end)
            continue;
        struct draw *draw = &geometry->draws[geometry->draw_count++];
        *draw = (struct draw){.vertices = gpu_mesh->vertices.id,
                              .corners = gpu_mesh->corners.id,
                              .first_corner = 3 * first,
                              .corner_count = 3 * (end - first),
                              .first_instance = first_instance,
                              .instance_count = instance_count,
                              .visibility = ((struct instances_block *)set->block)->visibility,
                              .mesh = gpu_mesh->key,
                              .set = set->key,
                              .opaque = 1};
        memcpy(draw->lower, lower, sizeof draw->lower);
        memcpy(draw->upper, upper, sizeof draw->upper);
        const struct entry *entry = table_find(materials, mesh->materials[slot]);
        if (!entry)
            continue;
        const brume_material *material = &((struct material_block *)entry->block)->material;
        const struct gpu_image *base = geometry_image(geometry, material->base_image);
        const struct gpu_image *rough = geometry_image(geometry, material->roughness_image);
        draw->material = (uint32_t)(entry - materials->entries) + 1;
        draw->base_image = base ? base->texture.id : 0;
        draw->roughness_image = rough ? rough->texture.id : 0;
        draw->opaque = material->alpha_mode == BRUME_ALPHA_OPAQUE;
        draw->glows = glows(material) && draw->visibility & BRUME_VISIBLE_SHADOW;
        draw->tinted = !draw->opaque &&
                       (material->transparent[0] != 1.0f || material->transparent[1] != 1.0f ||
                        material->transparent[2] != 1.0f);
    }
}

/* What something flat that glows lights: as far around it as it is long, twice as far before it. */
static void add_glow(struct geometry *geometry, int across, const float lower[3],
                     const float upper[3])
{
    float length = 0.0f, from[3], to[3];
    for (int i = 0; i < 3; ++i)
        length = fmaxf(length, upper[i] - lower[i]);
    for (int i = 0; i < 3; ++i) {
        from[i] = lower[i] - (i == across ? 2.0f : 1.0f) * length;
        to[i] = upper[i] + (i == across ? 2.0f : 1.0f) * length;
    }
    grow(geometry->glow_lower, geometry->glow_upper, from, to);
}

/* To the scene's and the set's. False where finite vertices and a finite matrix make a place that
 * no number holds. */
static int add_bounds(struct geometry *geometry, const struct mesh_block *mesh, const float *matrix,
                      int glowing, float set_lower[3], float set_upper[3])
{
    float lower[3], upper[3];
    mat4_bounds(matrix, mesh->lower, mesh->upper, lower, upper);
    for (int i = 0; i < 3; ++i)
        if (!(fabsf(lower[i]) < FARTHEST && fabsf(upper[i]) < FARTHEST))
            return 0;
    grow(set_lower, set_upper, lower, upper);
    grow(geometry->lower, geometry->upper, lower, upper);
    if (!is_flat(mesh)) {
        grow(geometry->solid_lower, geometry->solid_upper, lower, upper);
        return 1;
    }
    int thinnest = 0;
    for (int i = 1; i < 3; ++i)
        thinnest = upper[i] - lower[i] < upper[thinnest] - lower[thinnest] ? i : thinnest;
    grow(geometry->flat_lower[thinnest], geometry->flat_upper[thinnest], lower, upper);
    if (glowing)
        add_glow(geometry, thinnest, lower, upper);
    return 1;
}

static brume_result sync_instances(struct gpu *gpu, struct geometry *geometry,
                                   const struct snapshot *snapshot, struct job_control *control)
{
    const struct table *table = &snapshot->tables[BRUME_KIND_INSTANCES];
    const struct table *meshes = &snapshot->tables[BRUME_KIND_MESH];
    size_t instance_count = 0, draw_count = 0;
    for (uint32_t i = 0; i < table->count; ++i) {
        const struct instances_block *set = (struct instances_block *)table->entries[i].block;
        const struct entry *mesh = table_find(meshes, set->mesh);
        instance_count += set->count;
        draw_count += mesh ? ((struct mesh_block *)mesh->block)->slot_count : 0;
    }
    struct gpu_instance *instances = calloc(instance_count + 1, sizeof *instances);
    free(geometry->draws);
    geometry->draws = calloc(draw_count + 1, sizeof *geometry->draws);
    geometry->draw_count = 0;
    geometry->triangle_count = 0;
    for (int i = 0; i < 3; ++i) {
        geometry->lower[i] = geometry->solid_lower[i] = geometry->glow_lower[i] = INFINITY;
        geometry->upper[i] = geometry->solid_upper[i] = geometry->glow_upper[i] = -INFINITY;
        for (int axis = 0; axis < 3; ++axis) {
            geometry->flat_lower[axis][i] = INFINITY;
            geometry->flat_upper[axis][i] = -INFINITY;
        }
    }
    brume_result result = BRUME_OK;
    if (!instances || !geometry->draws)
        result = fail(BRUME_E_MEMORY, "no memory for %zu instances", instance_count);

    uint32_t next = 0;
    for (uint32_t i = 0; i < table->count && result == BRUME_OK; ++i) {
        const struct instances_block *set = (struct instances_block *)table->entries[i].block;
        const struct entry *entry = table_find(meshes, set->mesh);
        const struct gpu_mesh *gpu_mesh = find_mesh(geometry, set->mesh);
        if (!entry || !gpu_mesh || set->count == 0)
            continue;
        const struct mesh_block *mesh = (struct mesh_block *)entry->block;
        if (mesh->triangle_count == 0)
            continue;
        const uint32_t first = next;
        const int glowing = any_glows(snapshot, mesh, set->visibility);
        float lower[3] = {INFINITY, INFINITY, INFINITY};
        float upper[3] = {-INFINITY, -INFINITY, -INFINITY};
        for (uint32_t k = 0; k < set->count; ++k) {
            const float *matrix = set->world_from_object + 16 * (size_t)k;
            if (!add_bounds(geometry, mesh, matrix, glowing, lower, upper))
                continue;
            write_instance(&instances[next], matrix, set->visibility, next);
            ++next;
        }
        if (next - first < set->count)
            job_warn(control, "INSTANCES_LEFT_OUT",
                     "%u of %u instances of mesh '%s' lie farther away than numbers reach",
                     set->count - (next - first), set->count, mesh->name);
        if (next == first)
            continue;
        add_draws(geometry, snapshot, mesh, gpu_mesh, &table->entries[i], lower, upper, first,
                  next - first);
        geometry->triangle_count += mesh->triangle_count * (next - first);
    }
    if (result == BRUME_OK)
        result = buffer_update(&gpu->memory, &geometry->instances, FOR_MESH,
                               (size_t)next * sizeof *instances, instances, "instances");
    free(instances);
    return result;
}

/* Attributes as shaders/lib/vertex.glsl has them. */
static void make_vertex_array(struct geometry *geometry)
{
    GLuint array;
    glCreateVertexArrays(1, &array);
    static const struct {
        GLint size;
        GLuint offset, binding; /* 0: a corner's, 1: an instance's */
    } attributes[] = {
        {3, 0, 0},
        {3, 12, 0},
        {2, 24, 0},
        {4, offsetof(struct gpu_instance, world_from_object), 1},
        {4, offsetof(struct gpu_instance, world_from_object) + 16, 1},
        {4, offsetof(struct gpu_instance, world_from_object) + 32, 1},
        {4, offsetof(struct gpu_instance, world_from_object) + 48, 1},
        {3, offsetof(struct gpu_instance, normal_from_object), 1},
        {3, offsetof(struct gpu_instance, normal_from_object) + 16, 1},
        {3, offsetof(struct gpu_instance, normal_from_object) + 32, 1},
    };
    const GLuint count = sizeof attributes / sizeof *attributes;
    for (GLuint i = 0; i < count; ++i) {
        glEnableVertexArrayAttrib(array, i);
        glVertexArrayAttribFormat(array, i, attributes[i].size, GL_FLOAT, GL_FALSE,
                                  attributes[i].offset);
        glVertexArrayAttribBinding(array, i, attributes[i].binding);
    }
    glEnableVertexArrayAttrib(array, count);
    glVertexArrayAttribIFormat(array, count, 2, GL_UNSIGNED_INT,
                               offsetof(struct gpu_instance, flags));
    glVertexArrayAttribBinding(array, count, 1);
    glVertexArrayBindingDivisor(array, 1, 1);
    geometry->vertex_array = array;
}

uint64_t geometry_bytes(const struct snapshot *snapshot)
{
    const struct table *meshes = &snapshot->tables[BRUME_KIND_MESH];
    const struct table *images = &snapshot->tables[BRUME_KIND_IMAGE];
    const struct table *sets = &snapshot->tables[BRUME_KIND_INSTANCES];
    uint64_t bytes = ((uint64_t)snapshot->tables[BRUME_KIND_MATERIAL].count + 1) *
                     sizeof(struct gpu_material);
    for (uint32_t i = 0; i < meshes->count; ++i) {
        const struct mesh_block *mesh = (struct mesh_block *)meshes->entries[i].block;
        bytes += VERTEX_BYTES * (uint64_t)mesh->vertex_count +
                 TRIANGLE_BYTES * (uint64_t)mesh->triangle_count;
    }
    for (uint32_t i = 0; i < images->count; ++i) {
        const struct image_block *image = (struct image_block *)images->entries[i].block;
        const uint64_t texel = image->maximum > HALF_MAX ? 16 : 8;
        bytes += (uint64_t)image->width * (uint64_t)image->height * texel * 4 / 3 + 16;
    }
    for (uint32_t i = 0; i < sets->count; ++i)
        bytes += sizeof(struct gpu_instance) *
                 (uint64_t)((struct instances_block *)sets->entries[i].block)->count;
    return bytes;
}

brume_result geometry_sync(struct gpu *gpu, struct geometry *geometry,
                           const struct snapshot *snapshot, struct job_control *control)
{
    if (!geometry->vertex_array)
        make_vertex_array(geometry);
    TRY(sync_meshes(gpu, geometry, &snapshot->tables[BRUME_KIND_MESH]));
    TRY(sync_images(gpu, geometry, &snapshot->tables[BRUME_KIND_IMAGE], control));
    TRY(sync_materials(gpu, geometry, &snapshot->tables[BRUME_KIND_MATERIAL]));
    return sync_instances(gpu, geometry, snapshot, control);
}

/* Whether all of the draw lies beyond one of the clip volume's planes; five of six of a lamp's maps
 * see nothing of it, and vertices are what a CPU spends its time on. */
static int is_outside(const struct draw *draw, const mat4 *clip_from_world)
{
    const float *m = clip_from_world->m;
    uint32_t beyond_all = 63;
    for (int corner = 0; corner < 8; ++corner) {
        const float x = corner & 1 ? draw->upper[0] : draw->lower[0];
        const float y = corner & 2 ? draw->upper[1] : draw->lower[1];
        const float z = corner & 4 ? draw->upper[2] : draw->lower[2];
        float clip[4], size[4]; /* sizes of the sums, for what rounding may do to them */
        for (int row = 0; row < 4; ++row) {
            const float parts[4] = {m[row] * x, m[4 + row] * y, m[8 + row] * z, m[12 + row]};
            clip[row] = parts[0] + parts[1] + parts[2] + parts[3];
            size[row] = fabsf(parts[0]) + fabsf(parts[1]) + fabsf(parts[2]) + fabsf(parts[3]);
        }
        uint32_t beyond = 0;
        for (int row = 0; row < 3; ++row) {
            const float slack = 1e-5f * (size[row] + size[3]);
            const float least = row == 2 ? 0.0f : -clip[3]; /* depth goes from 0 to w */
            beyond |= (uint32_t)(clip[row] < least - slack) << (2 * row);
            beyond |= (uint32_t)(clip[row] > clip[3] + slack) << (2 * row + 1);
        }
        beyond_all &= beyond;
    }
    return beyond_all != 0;
}

brume_result geometry_draw(struct gpu *gpu, struct geometry *geometry, const struct gpu_draw *stage,
                           uint32_t visibility, enum geometry_pass pass)
{
    static const char *const stems[] = {
        [GEOMETRY_GBUFFER] = "gbuffer", [GEOMETRY_SHADOW] = "shadow", [GEOMETRY_TINT] = "tint",
        [GEOMETRY_LINKS] = "links",     [GEOMETRY_REFLECT] = "reflect",
        [GEOMETRY_LINES] = "links:LINES"};
    const struct program *program, *opaque;
    TRY(program_draw(&gpu->programs, stems[pass], &program));
    TRY(program_draw(&gpu->programs, pass == GEOMETRY_SHADOW ? "shadow:OPAQUE" : stems[pass],
                     &opaque));
    TRY(buffer_update(&gpu->memory, &geometry->stage_block, FOR_TARGET, sizeof *stage, stage,
                      "draw stage"));
    glBindBufferBase(GL_UNIFORM_BUFFER, SLOT_STAGE, geometry->stage_block.id);
    glBindVertexArray(geometry->vertex_array);
    glVertexArrayVertexBuffer(geometry->vertex_array, 1, geometry->instances.id, 0,
                              sizeof(struct gpu_instance));
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER); /* reversed depth */
    if (pass == GEOMETRY_TINT) {
        glDepthMask(GL_FALSE);
        glEnable(GL_BLEND);
        glBlendFunc(GL_DST_COLOR, GL_ZERO);
    }
    for (uint32_t i = 0; i < geometry->draw_count; ++i) {
        const struct draw *draw = &geometry->draws[i];
        if ((draw->visibility & visibility) != visibility ||
            (draw->as_lamps && (visibility & BRUME_VISIBLE_SHADOW)) ||
            (pass == GEOMETRY_TINT && !draw->tinted) ||
            is_outside(draw, &stage->clip_from_world))
            continue;
        const bool bare = pass == GEOMETRY_SHADOW && draw->opaque; /* nothing of it is asked */
        glUseProgram(draw->opaque ? opaque->id : program->id);
        glVertexArrayVertexBuffer(geometry->vertex_array, 0, draw->vertices, 0, VERTEX_BYTES);
        glVertexArrayElementBuffer(geometry->vertex_array, draw->corners);
        if (!bare) {
            glBindTextureUnit(SLOT_MATERIAL_BASE, draw->base_image);
            glBindTextureUnit(SLOT_MATERIAL_ROUGHNESS, draw->roughness_image);
            glBindBufferRange(GL_UNIFORM_BUFFER, SLOT_MATERIAL, geometry->materials.id,
                              (GLintptr)(draw->material * sizeof(struct gpu_material)),
                              sizeof(struct gpu_material));
        }
        glDrawElementsInstancedBaseInstance(
            GL_TRIANGLES, (GLsizei)draw->corner_count, GL_UNSIGNED_INT,
            (const void *)(draw->first_corner * sizeof(uint32_t)), (GLsizei)draw->instance_count,
            draw->first_instance);
    }
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_BLEND);
    glDepthMask(GL_TRUE);
    return BRUME_OK;
}

void geometry_finish(struct gpu *gpu, struct geometry *geometry)
{
    for (uint32_t i = 0; i < geometry->mesh_count; ++i)
        finish_mesh(gpu, &geometry->meshes[i]);
    for (uint32_t i = 0; i < geometry->image_count; ++i)
        texture_finish(&gpu->memory, &geometry->images[i].texture);
    buffer_finish(&gpu->memory, &geometry->instances);
    buffer_finish(&gpu->memory, &geometry->materials);
    buffer_finish(&gpu->memory, &geometry->stage_block);
    if (geometry->vertex_array)
        glDeleteVertexArrays(1, &geometry->vertex_array);
    free(geometry->meshes);
    free(geometry->images);
    free(geometry->draws);
    memset(geometry, 0, sizeof *geometry);
}
