/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * brume.h: the whole public interface of libbrume.
 *
 * A device owns one OpenGL context on one thread of its own. A scene holds copies of what the
 * caller gave it; a job renders a scene as it was when the job began. Every function may be called
 * from any thread; calls on one scene are serialised by the library. Nothing here blocks on the
 * GPU but brume_job_wait, brume_job_read and brume_device_create.
 *
 * Units: metres, 1/m, W/(sr m^2), linear RGB, radians. Matrices are 16 floats, column-major
 * (element [column * 4 + row]), named target_from_source. Arrays belong to the caller and are
 * copied before the call returns, unless a line says otherwise.
 *
 * A params struct filled with zeros means the defaults that its comments name.
 *
 * Every function that can fail returns a brume_result; brume_last_error() then gives the sentence
 * for the thread that called. Failures inside a job belong to the job (brume_job_error).
 */
#ifndef BRUME_H
#define BRUME_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(BRUME_BUILD)
#define BRUME_API __attribute__((visibility("default")))
#else
#define BRUME_API
#endif

/* Raised by every change to a struct, an enumerator or a function below. */
#define BRUME_ABI 10u

BRUME_API uint32_t brume_abi(void);

/* Bytes of a struct of this header by its name ("brume_mesh"), 0 for an unknown name. Bindings
 * compare it with their own idea of the struct. */
BRUME_API size_t brume_struct_size(const char *name);

/* ---------------------------------------------------------------------------------------------
 * Results
 */

typedef enum brume_result {
    BRUME_OK = 0,
    BRUME_E_ARGUMENT = 1,      /* a precondition of the call does not hold: the caller's mistake */
    BRUME_E_MEMORY = 2,        /* no memory, or a budget that cannot be kept */
    BRUME_E_FILE_MISSING = 3,  /* the file is not there or may not be read */
    BRUME_E_FILE_FORMAT = 4,   /* damaged, truncated or not what its name says */
    BRUME_E_FILE_WRITE = 5,    /* the file could not be written */
    BRUME_E_GRID_UNKNOWN = 6,  /* no grid of that name in the file */
    BRUME_E_GRID_TYPE = 7,     /* a level set, a point grid or another type that is no medium */
    BRUME_E_GRID_EMPTY = 8,    /* no active voxel */
    BRUME_E_GRID_VALUES = 9,   /* NaN or infinite values */
    BRUME_E_TRANSFORM = 10,    /* a singular, non-linear or non-finite transform */
    BRUME_E_MESH = 11,         /* indices out of range, non-finite positions */
    BRUME_E_SHADER_PROGRAM = 12, /* an ill-formed volume shader program */
    BRUME_E_NO_EGL = 13,       /* no EGL display could be opened */
    BRUME_E_NO_GL = 14,        /* the driver has no OpenGL 4.5 core */
    BRUME_E_GPU = 15,          /* a shader did not compile, or the driver reported an error */
    BRUME_E_CANCELLED = 16,    /* the job was cancelled */
    BRUME_E_NOT_READY = 17,    /* the job has no picture yet, or not this pass */
    BRUME_E_UNSUPPORTED = 18,  /* well-formed, but not something that Brume does */
} brume_result;

/* "BRUME_E_GRID_EMPTY" and so on; never NULL. */
BRUME_API const char *brume_result_name(brume_result result);

/* The sentence of this thread's last failed call; empty if none failed. Valid until the next
 * failing call of this thread. */
BRUME_API const char *brume_last_error(void);

/* ---------------------------------------------------------------------------------------------
 * Device
 */

typedef struct brume_device brume_device;

typedef enum brume_log_level {
    BRUME_LOG_ERROR = 0,
    BRUME_LOG_WARNING = 1,
    BRUME_LOG_INFO = 2,
    BRUME_LOG_DEBUG = 3,
} brume_log_level;

/* Called from any thread of the library, one call at a time. */
typedef void (*brume_log_function)(void *user, int32_t level, const char *sentence);

typedef struct brume_device_params {
    const char *shader_dir;  /* NULL: BRUME_SHADERS, else "shaders" beside the library, else the
                                source tree it was built from */
    brume_log_function log;  /* NULL: errors and warnings go to stderr */
    void *log_user;
    uint32_t debug;          /* 1: KHR_debug messages into the log; slower */
    uint32_t reserved;
} brume_device_params;

typedef struct brume_device_info {
    char renderer[128];
    char version[128];
    uint32_t software;       /* 1 on a CPU rasteriser such as llvmpipe */
    int32_t gl_major, gl_minor;
    int32_t max_texture_3d;
} brume_device_info;

/* Starts the device's thread and waits until its context stands. */
BRUME_API brume_result brume_device_create(const brume_device_params *params, brume_device **out);
/* Ends all jobs, frees all scenes' GPU memory, joins the thread. NULL is fine. Scenes and jobs of
 * the device must be destroyed first. */
BRUME_API void brume_device_destroy(brume_device *device);
BRUME_API brume_result brume_device_describe(const brume_device *device, brume_device_info *out);

/* ---------------------------------------------------------------------------------------------
 * Grids: dense fields of voxels, immutable, reference-counted. No device needed.
 *
 * A grid's array space has voxel (i, j, k) fill the unit cube from (i, j, k) to (i+1, j+1, k+1),
 * its value standing at the centre; object_from_array maps that space to the object's.
 */

typedef struct brume_grid brume_grid;

typedef struct brume_grid_info {
    char name[64];
    char type[32];              /* the file's word for it: "float", "half", "vec3s", "ls_float" … */
    int32_t channels;           /* 1 or 3; 0 where the type is no medium */
    int32_t dims[3];            /* voxels held in memory; 0 where only listed */
    int64_t file_dims[3];       /* active bounding box in the file */
    int32_t reduction;          /* file voxels per held voxel and axis: 1 unless made coarser */
    uint32_t supported;         /* 1: brume_grid_load_vdb takes it */
    float object_from_array[16];
    float minimum, maximum;     /* over all channels of the held voxels */
} brume_grid_info;

/* Lists the grids of a .vdb file. Writes at most capacity of them; *count gets the full number. */
BRUME_API brume_result brume_vdb_list(const char *path, brume_grid_info *infos, uint32_t capacity,
                                      uint32_t *count);

/* Loads one grid by name. max_voxels limits the memory held (0: 2^27); a grid with more is
 * averaged over cubes of `reduction` voxels. at_corner: 0: an index of the file stands for the
 * centre of a voxel, as OpenVDB has it; 1: for its lower corner, as the engines of Blender before
 * 5.0 have it, which show every voxel half a voxel further along each axis. */
BRUME_API brume_result brume_grid_load_vdb(const char *path, const char *name, uint64_t max_voxels,
                                           uint32_t at_corner, brume_grid **out);

/* data: channels * dims[0] * dims[1] * dims[2] floats, x fastest, channels interleaved. */
BRUME_API brume_result brume_grid_create(const char *name, const int32_t dims[3], int32_t channels,
                                         const float *data, const float object_from_array[16],
                                         brume_grid **out);
BRUME_API brume_result brume_grid_describe(const brume_grid *grid, brume_grid_info *out);
BRUME_API void brume_grid_release(brume_grid *grid); /* NULL is fine */

/* ---------------------------------------------------------------------------------------------
 * Scene. Every datablock has a key of the caller's choosing, unique within its kind; setting a key
 * again replaces the datablock, and a call that fails leaves the old one.
 */

typedef struct brume_scene brume_scene;

BRUME_API brume_result brume_scene_create(brume_device *device, brume_scene **out);
BRUME_API void brume_scene_destroy(brume_scene *scene); /* NULL is fine; waits for its jobs */

typedef enum brume_kind {
    BRUME_KIND_MESH = 0,
    BRUME_KIND_INSTANCES = 1,
    BRUME_KIND_MATERIAL = 2,
    BRUME_KIND_IMAGE = 3,
    BRUME_KIND_LIGHT = 4,
    BRUME_KIND_VOLUME = 5,
} brume_kind;

/* Removing what is not there is no error. */
BRUME_API brume_result brume_scene_remove(brume_scene *scene, uint32_t kind, uint64_t key);
/* Removes every datablock of the kind whose key is not among the count keys. */
BRUME_API brume_result brume_scene_keep(brume_scene *scene, uint32_t kind, const uint64_t *keys,
                                        uint64_t count);

/* --- Media ------------------------------------------------------------------------------- */

/* A volume's shader is a straight program over registers of three floats; a number fills all
 * three. It runs once per cell of the medium's lattice. */
typedef enum brume_op {
    BRUME_OP_CONSTANT = 0,   /* dst = value */
    BRUME_OP_GRID = 1,       /* dst = grid number a at the cell; one channel fills all three */
    BRUME_OP_ADD = 2,        /* dst = a + b, componentwise, as all below where not said */
    BRUME_OP_SUBTRACT = 3,
    BRUME_OP_MULTIPLY = 4,
    BRUME_OP_DIVIDE = 5,     /* 0 where b is 0, as Blender's Math node */
    BRUME_OP_MULTIPLY_ADD = 6, /* dst = a * b + c */
    BRUME_OP_POWER = 7,      /* 0 where undefined */
    BRUME_OP_LOGARITHM = 8,  /* log of a to the base b; 0 where undefined */
    BRUME_OP_SQRT = 9,       /* 0 below 0 */
    BRUME_OP_INVERSE_SQRT = 10, /* 0 at and below 0 */
    BRUME_OP_ABSOLUTE = 11,
    BRUME_OP_EXPONENT = 12,
    BRUME_OP_MINIMUM = 13,
    BRUME_OP_MAXIMUM = 14,
    BRUME_OP_LESS = 15,      /* a < b ? 1 : 0 */
    BRUME_OP_GREATER = 16,
    BRUME_OP_SIGN = 17,
    BRUME_OP_COMPARE = 18,   /* |a - b| <= max(c, 1e-5) ? 1 : 0 */
    BRUME_OP_SMOOTH_MIN = 19,
    BRUME_OP_SMOOTH_MAX = 20,
    BRUME_OP_ROUND = 21,     /* floor(a + 0.5) */
    BRUME_OP_FLOOR = 22,
    BRUME_OP_CEIL = 23,
    BRUME_OP_TRUNCATE = 24,
    BRUME_OP_FRACTION = 25,  /* a - floor(a) */
    BRUME_OP_MODULO = 26,    /* fmod; 0 where b is 0 */
    BRUME_OP_WRAP = 27,      /* a wrapped into [c, b) : Blender's max b, min c */
    BRUME_OP_SNAP = 28,      /* floor(a / b) * b; 0 where b is 0 */
    BRUME_OP_PINGPONG = 29,
    BRUME_OP_SINE = 30,
    BRUME_OP_COSINE = 31,
    BRUME_OP_TANGENT = 32,
    BRUME_OP_ARCSINE = 33,   /* 0 outside [-1, 1] */
    BRUME_OP_ARCCOSINE = 34,
    BRUME_OP_ARCTANGENT = 35,
    BRUME_OP_ARCTANGENT2 = 36,
    BRUME_OP_HYPERBOLIC_SINE = 37,
    BRUME_OP_HYPERBOLIC_COSINE = 38,
    BRUME_OP_HYPERBOLIC_TANGENT = 39,
    BRUME_OP_CLAMP01 = 40,
    BRUME_OP_MIX = 41,       /* a + (b - a) * c, c not clamped */
    BRUME_OP_SMOOTHSTEP = 42, /* Hermite: 3t^2 - 2t^3 of t = a clamped to [0, 1] */
    BRUME_OP_SMOOTHERSTEP = 43,
    BRUME_OP_RAMP = 44,      /* dst = table number b at a.x clamped to [0, 1], linear */
    BRUME_OP_AVERAGE = 45,   /* all = (r + g + b) / 3 */
    BRUME_OP_LUMINANCE = 46, /* all = 0.2126 r + 0.7152 g + 0.0722 b */
    BRUME_OP_COMPONENT = 47, /* all = component number b of a */
    BRUME_OP_COMBINE = 48,   /* (a.x, b.x, c.x) */
    BRUME_OP_BLACKBODY = 49, /* linear Rec.709 of a black body of a.x kelvin, luminance 1 */
    BRUME_OP_POSITION = 50,  /* the middle of the cell, in the brume_space number a */
    BRUME_OP_NOISE = 51,     /* Blender's Noise Texture, scaled, at a. b.x: detail, b.y: roughness,
                                b.z: lacunarity. c.x: W, c.y: distortion. value: dimensions, 1 to 4;
                                1 if normalized; 1 for its three colours, 0 for Fac in all */
    BRUME_OP_COUNT = 52
} brume_op;

#define BRUME_REGISTERS 64u
#define BRUME_RAMP_SIZE 256u

typedef struct brume_instruction {
    uint32_t op, dst, a, b, c; /* registers, but for the numbers that the op's line names */
    float value[3];
} brume_instruction;

typedef enum brume_space {
    BRUME_SPACE_OBJECT = 0,
    BRUME_SPACE_WORLD = 1,
    BRUME_SPACE_GENERATED = 2, /* 0 to 1 along each side of the volume's generated box */
    BRUME_SPACE_COUNT = 3
} brume_space;

typedef struct brume_volume_program {
    const brume_instruction *instructions;
    const float *ramps;              /* ramp_count tables of BRUME_RAMP_SIZE rgb triples */
    uint32_t instruction_count;
    uint32_t ramp_count;
    uint32_t sigma_s, sigma_a;       /* registers that hold the results, 1/m */
    uint32_t g;                      /* mean cosine, clamped to [-0.99, 0.99] */
    uint32_t emission;               /* W/(sr m^3) */
} brume_volume_program;

/* One term of a medium that is a sum of Gaussians: amplitude * exp(-scale^2 |x - center|^2) at x in
 * object space. It stays round under any transform, which scales it by the cube root of its
 * determinant. Cells that are nowhere within 3 / scale of its centre do without it. */
typedef struct brume_gaussian {
    float center[3];
    float scale;                     /* above 0 */
    float color[3];
    float amplitude;                 /* 0 and above */
} brume_gaussian;

/* A medium: grids in an object's space, the inside of a closed mesh, or a sum of Gaussians. The
 * program of Gaussians reads the sum of their amplitudes as grid 0, and as grid 1 the mean of their
 * colours, weighted by those. */
typedef struct brume_volume {
    const char *name;                /* for messages */
    brume_grid *const *grids;        /* what BRUME_OP_GRID numbers; retained, may be NULL entries,
                                        which read as 0 */
    const float *positions;          /* mesh: 3 floats a vertex, object space; else NULL */
    const uint32_t *triangles;       /* mesh: 3 indices a triangle */
    const brume_gaussian *gaussians; /* NULL for grids and meshes */
    uint32_t grid_count, vertex_count, triangle_count, gaussian_count;
    brume_volume_program program;
    float world_from_object[16];
    float scale;                     /* multiplies all coefficients; 0 means 1 */
    float generated_lower[3], generated_upper[3]; /* object space; an empty side is all 0 there */
    float reserved2;
} brume_volume;

BRUME_API brume_result brume_scene_set_volume(brume_scene *scene, uint64_t key,
                                              const brume_volume *volume);

/* --- Surfaces ---------------------------------------------------------------------------- */

typedef struct brume_mesh {
    const char *name;
    const float *positions;          /* 3 a vertex */
    const uint32_t *triangles;       /* 3 vertex indices a triangle */
    const float *corner_normals;     /* 3 a corner, 9 a triangle; NULL: flat */
    const float *corner_uvs;         /* 2 a corner; NULL: (0, 0) */
    const uint16_t *triangle_slots;  /* material slot a triangle; NULL: all 0 */
    const uint64_t *materials;       /* key of each slot's material; unknown keys: grey, matt */
    uint32_t vertex_count, triangle_count, material_count, reserved;
} brume_mesh;

BRUME_API brume_result brume_scene_set_mesh(brume_scene *scene, uint64_t key,
                                            const brume_mesh *mesh);

typedef enum brume_visibility {
    BRUME_VISIBLE_CAMERA = 1,
    BRUME_VISIBLE_SHADOW = 2,
    BRUME_VISIBLE_HOLDOUT = 4,       /* cuts a hole into picture and alpha */
} brume_visibility;

/* All instances of one mesh, replaced together. Zero-scale instances are left out. */
typedef struct brume_instances {
    const float *world_from_object;  /* 16 an instance */
    uint64_t mesh;
    uint32_t count;
    uint32_t visibility;             /* brume_visibility bits */
} brume_instances;

BRUME_API brume_result brume_scene_set_instances(brume_scene *scene, uint64_t key,
                                                 const brume_instances *instances);

typedef enum brume_alpha_mode {
    BRUME_ALPHA_OPAQUE = 0,
    BRUME_ALPHA_CLIP = 1,            /* opaque at and above alpha_threshold */
    BRUME_ALPHA_BLEND = 2,           /* as coverage, stochastic over the samples */
} brume_alpha_mode;

/* A sum of lobes: Lambert, GGX reflection, emission, and straight transmission.
 *   diffuse reflectance = diffuse * base image
 *   F0                  = specular + metal * base image
 *   alpha               = alpha * (alpha of the base image if alpha_from_base_image) */
typedef struct brume_material {
    const char *name;
    uint64_t base_image;             /* image key, 0: none (white) */
    uint64_t roughness_image;        /* its red channel multiplies roughness */
    float diffuse[3];
    float specular[3];
    float metal[3];
    float emission[3];               /* W/(sr m^2) */
    float transparent[3];            /* colour of what passes where alpha lets it */
    float roughness;                 /* perceptual, alpha = roughness^2 */
    float alpha;
    float alpha_threshold;           /* 0: 0.5 */
    uint32_t alpha_mode;
    uint32_t alpha_from_base_image;
    uint32_t backface_culling;
    float burley;                    /* share of `diffuse` that is rougher and brighter at grazing
                                        angles, as Principled BSDF before Blender 4 (Burley,
                                        "Physically-Based Shading at Disney", 2012); 0: Lambert */
} brume_material;

BRUME_API brume_result brume_scene_set_material(brume_scene *scene, uint64_t key,
                                                const brume_material *material);

typedef enum brume_extend {
    BRUME_EXTEND_REPEAT = 0,
    BRUME_EXTEND_CLAMP = 1,
    BRUME_EXTEND_CLIP = 2,           /* transparent black outside */
    BRUME_EXTEND_MIRROR = 3,
} brume_extend;

typedef struct brume_image {
    const char *name;
    const float *pixels;             /* width * height * 4, linear RGBA, straight alpha, first row
                                        at the bottom */
    int32_t width, height;
    uint32_t extend;
    uint32_t nearest;                /* 1: no interpolation */
} brume_image;

BRUME_API brume_result brume_scene_set_image(brume_scene *scene, uint64_t key,
                                             const brume_image *image);

/* --- Lights ------------------------------------------------------------------------------ */

typedef enum brume_light_type {
    BRUME_LIGHT_SUN = 0,
    BRUME_LIGHT_POINT = 1,
    BRUME_LIGHT_SPOT = 2,
    BRUME_LIGHT_RECTANGLE = 3,
    BRUME_LIGHT_ELLIPSE = 4,
} brume_light_type;

/* A lamp at Cycles' radiometry. It stands at the matrix's origin and shines along local -Z. */
typedef struct brume_light {
    const char *name;
    float world_from_light[16];      /* its scale stretches area lights and spot cones */
    float power[3];                  /* W, colour included; sun: W/m^2 */
    float radius;                    /* point, spot: m */
    float angle;                     /* sun: full angular diameter */
    float size[2];                   /* rectangle, ellipse: full extents, m */
    float spot_angle;                /* full cone angle */
    float spot_blend;                /* 0..1 */
    float spread;                    /* area: full angle, 0 means pi (no limit) */
    float diffuse_factor, specular_factor, volume_factor; /* multiply its light by kind of receiver */
    uint32_t type;
    uint32_t cast_shadow;
    uint32_t camera_visible;
    uint32_t type_reserved;
} brume_light;

BRUME_API brume_result brume_scene_set_light(brume_scene *scene, uint64_t key,
                                             const brume_light *light);

/* --- World ------------------------------------------------------------------------------- */

typedef struct brume_world {
    float color[3];                  /* radiance; multiplies the image */
    uint32_t has_volume;
    uint64_t image;                  /* equirectangular image key, 0: none */
    float image_from_world[16];      /* rotates world directions into the image's; zeros: identity */
    float sigma_s[3], sigma_a[3], emission[3]; /* homogeneous medium, everywhere within reach */
    float g;
    float reach;                     /* m around the scene's bounds that the world's medium fills;
                                        0: half of their diagonal */
    float reserved;
} brume_world;

/* Equirectangular as Blender: u = 0.5 - atan2(y, x)/(2 pi) … the image's centre column looks along
 * -Y with identity (azimuth measured as Cycles does), v = 0.5 + elevation / pi. */
BRUME_API brume_result brume_scene_set_world(brume_scene *scene, const brume_world *world);

/* ---------------------------------------------------------------------------------------------
 * Rendering
 */

typedef enum brume_method {
    BRUME_METHOD_OPV = 0,
    BRUME_METHOD_LPV = 1,
    BRUME_METHOD_DOM = 2,
    BRUME_METHOD_COUNT = 3
} brume_method;

/* How OPV finds the optical depths from the lamps to the nodes of its lattice. */
typedef enum brume_depths {
    BRUME_DEPTHS_PROPAGATED = 0,     /* from brick to brick, outwards from the lamp */
    BRUME_DEPTHS_MARCHED = 1,        /* each by a march of its own: the reference, slower */
    BRUME_DEPTHS_CORRECTED = 2,      /* for comparison: gathered from six neighbours, as the paper
                                        has it, with increments as long as the step */
    BRUME_DEPTHS_PAPER = 3,          /* for comparison: the paper's increments, too large where light
                                        runs askew to the lattice */
    BRUME_DEPTHS_ITERATED = 4,       /* for comparison: as 3 and as published: all nodes in every
                                        iteration, four lights together, one extinction for all
                                        colours */
    BRUME_DEPTHS_COUNT = 5
} brume_depths;

/* What of the light is shown: all, or for comparison the parts that "Light Propagation Volumes with
 * scattering" sets side by side in its Figure 5. LPV alone knows others than the first. */
typedef enum brume_light_paths {
    BRUME_PATHS_ALL = 0,
    BRUME_PATHS_DIRECT = 1,          /* surfaces, straight from the lights */
    BRUME_PATHS_REFLECTED = 2,       /* 1, and what surfaces reflect to one another */
    BRUME_PATHS_SINGLE = 3,          /* 1, and what media scatter once */
    BRUME_PATHS_REFLECTED_MARCHED = 4, /* 2, and what media scatter of that to the camera */
    BRUME_PATHS_SUM = 5,             /* 3 and 4 added up: what media scatter lights nothing */
    BRUME_PATHS_COUNT = 6
} brume_light_paths;

/* How LPV's lattice knows of the surfaces that stand in the light's way. */
typedef enum brume_blockers {
    BRUME_BLOCKERS_LINKS = 0,        /* links between cells that a surface cuts, exactly */
    BRUME_BLOCKERS_FUZZY = 1,        /* for comparison, as the paper: from what lights, camera and six
                                        views from outside see, as spherical harmonics a cell */
    BRUME_BLOCKERS_COUNT = 2
} brume_blockers;

/* What the finer of nested lattices surround. */
typedef enum brume_focus {
    BRUME_FOCUS_MEDIUM = 0,          /* the middle of the volumes; without any, as 1 */
    BRUME_FOCUS_CAMERA = 1,          /* what is near the camera, before it: light that goes on is
                                        found anew as it moves far */
    BRUME_FOCUS_COUNT = 2
} brume_focus;

typedef struct brume_settings {
    uint32_t method;
    int32_t medium_resolution;       /* cells along the longest side; 0: 128 */
    int32_t lattice_resolution;      /* the transport's lattice; 0: 64 */
    int32_t iterations;              /* 0: until converged */
    int32_t shadow_resolution;       /* texels of a shadow map's side; 0: 512 */
    int32_t light_samples;           /* shadow maps spread over each lamp; 0: 8 */
    int32_t world_samples;           /* directions that stand for the world's light; 0: 128 */
    float step;                      /* march step in cells of the medium; 0: 1 */
    uint32_t depths;                 /* brume_depths */
    uint32_t light_paths;            /* brume_light_paths */
    uint32_t blockers;               /* brume_blockers */
    int32_t field_resolution;        /* cells along the longest side of the lattice in which scattered
                                        and reflected light goes on; 0: half of lattice_resolution */
    int32_t cascades;                /* such lattices, each within the last, of half its length and as
                                        many cells; at most 3; 0: 1, and with DOM another around
                                        media that are small in it, where memory allows */
    uint32_t cascade_focus;          /* brume_focus */
    int32_t ordinates;               /* DOM: directions that light is carried along: 26, 48 or 96; 0: 48 */
    uint32_t warm;                   /* DOM: 1: iterations begin with the light that the scene had last:
                                        fewer do, and the picture tells, within `converged`, what was
                                        rendered before */
    float converged;                 /* DOM: the share of the light that iterations may leave unfound;
                                        0: 0.001 */
    uint32_t reserved;
    uint64_t memory_budget;          /* bytes on the GPU; 0: 2 GiB */
} brume_settings;

typedef enum brume_pass {
    BRUME_PASS_COMBINED = 0,         /* RGBA, premultiplied */
    BRUME_PASS_DEPTH = 1,            /* 1: distance along the view axis, 1e10 where nothing is hit */
    BRUME_PASS_NORMAL = 2,           /* RGB: world-space shading normal */
    BRUME_PASS_VOLUME_DIRECT = 3,    /* RGB */
    BRUME_PASS_EMISSION = 4,         /* RGB: surfaces' and media's own light */
    BRUME_PASS_ENVIRONMENT = 5,      /* RGB */
    BRUME_PASS_TRANSMITTANCE = 6,    /* RGB: of the media in front of the first surface */
    BRUME_PASS_VOLUME_INDIRECT = 7,  /* RGB: what media scatter of light that was scattered or
                                        reflected before */
    BRUME_PASS_COUNT = 8
} brume_pass;

/* Channels of a pass: 4, 3 or 1; 0 for an unknown one. */
BRUME_API uint32_t brume_pass_channels(uint32_t pass);
BRUME_API const char *brume_pass_name(uint32_t pass);

/* A thin lens in the place of the eye: things are the more blurred, the farther they are from the
 * plane in focus. Zeroed: none, all is sharp. Its picture is that of as many places in its opening
 * as there are samples. */
typedef struct brume_lens {
    float radius;                    /* m, of the circle around the opening, 1e6 at most; 0: no lens */
    float focus;                     /* m along the view axis, 1e-6 at least, of the plane that is
                                        sharp */
    uint32_t blades;                 /* corners of the opening; below 3: a disk */
    float rotation;                  /* of the blades, rad, from the view's right to its up */
    float ratio;                     /* of the opening's height to its width, 0.01 to 100; 0: 1 */
} brume_lens;

typedef struct brume_view {
    int32_t width, height;           /* pixels */
    float view_from_world[16];
    float clip_from_view[16];        /* OpenGL projection, perspective or orthographic, of exactly
                                        these pixels: shift and border are in it */
    float clip_near, clip_far;       /* m along the view axis */
    uint32_t samples;                /* 0: 16 */
    uint32_t seed;
    float filter_width;              /* pixels, Blackman-Harris; 0: 1.5 */
    uint32_t film_transparent;       /* 1: the world is not drawn, alpha tells coverage */
    uint32_t passes;                 /* bits 1 << brume_pass; Combined always */
    uint32_t progressive;            /* 1: brume_job_read works while the job runs, on the mean of
                                        the samples so far: the first at once, then renewed five
                                        times a second */
    uint32_t urgent;                 /* 1: served before all jobs that are not: somebody waits */
    uint32_t world_draws;            /* of the world's directions, how many a pixel takes in all its
                                        samples: fewer are quicker and grainier; 0: 32 */
    uint32_t half_march;             /* 1: light in media at half the resolution, fitted to edges of
                                        surfaces: about four times as quick, and softer */
    brume_lens lens;
} brume_view;

typedef enum brume_stage {
    BRUME_STAGE_UPLOAD = 0,          /* meshes, images, lights to the GPU */
    BRUME_STAGE_MEDIUM = 1,
    BRUME_STAGE_SHADOW = 2,
    BRUME_STAGE_TRANSPORT = 3,
    BRUME_STAGE_GBUFFER = 4,
    BRUME_STAGE_SHADE = 5,
    BRUME_STAGE_MARCH = 6,
    BRUME_STAGE_PASSES = 7,          /* resolve and readback */
    BRUME_STAGE_COUNT = 8
} brume_stage;

BRUME_API const char *brume_stage_name(uint32_t stage);

/* What LPV does within the stage of transport, as the rows of its paper's Table 1. */
typedef enum brume_field_part {
    BRUME_FIELD_SURFACES = 0,        /* links between cells that surfaces cut, and what these reflect */
    BRUME_FIELD_MEDIUM = 1,
    BRUME_FIELD_REFLECTED = 2,       /* injection of what surfaces reflect first, */
    BRUME_FIELD_SCATTERED = 3,       /* and of what media scatter first */
    BRUME_FIELD_BLOCKERS = 4,        /* fuzzy ones: injection, */
    BRUME_FIELD_AGGREGATE = 5,       /* of what was injected; of blockers the greatest of all maps */
    BRUME_FIELD_PREPARE = 6,         /* their factors of links; which cells lie around a lattice */
    BRUME_FIELD_ITERATIONS = 7,
    BRUME_FIELD_COPY = 8,            /* into the lattice that the view looks up */
    BRUME_FIELD_PARTS = 9
} brume_field_part;

BRUME_API const char *brume_field_part_name(uint32_t part);

typedef struct brume_stage_stats {
    double wall_ms;                  /* of this job, all samples together */
    double gpu_ms;                   /* by the GL's timer */
    uint64_t runs;                   /* since the scene was made: stays when a stage is skipped */
    uint64_t revision;               /* changes when the stage's product does */
} brume_stage_stats;

typedef struct brume_stats {
    brume_stage_stats stages[8];
    double total_ms;
    uint64_t medium_bytes, transport_bytes, shadow_bytes, mesh_bytes, image_bytes, target_bytes;
    uint64_t total_bytes, peak_bytes;
    int32_t medium_dims[3], transport_dims[3];
    uint32_t light_count, triangle_count; /* instances counted */
    uint32_t samples;
    uint32_t shadow_maps_drawn;  /* by this job, as the two below: what did not change stays */
    uint32_t lights_propagated;  /* lamps whose light was carried through the medium anew */
    uint32_t sky_propagated;     /* how often the world's was */
    uint32_t iterations;         /* of scattered and reflected light, by this job: of the whole, each
                                    two of a lattice in it */
    double power_begun;          /* W of all colours: what these began with in the whole lattice, */
    double power_in_flight;      /* and what the last one left there that had not left it or been
                                    absorbed */
    double change;               /* DOM: of the radiance, what its last iteration changed */
    double field_ms[9];          /* by the GL's timer: brume_field_part */
} brume_stats;

typedef struct brume_job brume_job;

typedef enum brume_job_state {
    BRUME_JOB_QUEUED = 0,
    BRUME_JOB_RUNNING = 1,
    BRUME_JOB_DONE = 2,
    BRUME_JOB_FAILED = 3,
    BRUME_JOB_CANCELLED = 4,
} brume_job_state;

typedef struct brume_job_status {
    uint32_t state;
    uint32_t stage;                  /* the one running */
    float progress;                  /* 0..1 */
    uint32_t samples_done;
    int32_t result;                  /* brume_result, once ended */
    uint32_t warnings;               /* how many so far */
    uint32_t picture_samples;        /* that brume_job_read's picture is made of, 0: none yet */
} brume_job_status;

BRUME_API brume_result brume_render(brume_scene *scene, const brume_settings *settings,
                                    const brume_view *view, brume_job **out);
BRUME_API brume_result brume_job_poll(const brume_job *job, brume_job_status *out);
/* Waits until the job ends or the time is over (milliseconds, below 0: for ever). */
BRUME_API brume_result brume_job_wait(brume_job *job, int32_t timeout_ms, brume_job_status *out);
/* A job that waits ends at once, one that runs at its next check. */
BRUME_API void brume_job_cancel(brume_job *job);
BRUME_API const char *brume_job_error(const brume_job *job); /* empty unless failed */
/* Warning number index of the job: its id ("LATTICE_COARSER") and sentence, owned by the job. */
BRUME_API brume_result brume_job_warning(const brume_job *job, uint32_t index, const char **id,
                                         const char **sentence);
BRUME_API brume_result brume_job_stats(const brume_job *job, brume_stats *out);
/* Copies a pass of the newest picture: width * height * channels floats, first row at the bottom.
 * BRUME_E_NOT_READY before there is one; a cancelled progressive job keeps its last. */
BRUME_API brume_result brume_job_read(brume_job *job, uint32_t pass, float *pixels,
                                      uint64_t float_count);
BRUME_API void brume_job_release(brume_job *job); /* cancels it if it still runs; NULL is fine */

/* ---------------------------------------------------------------------------------------------
 * EXR files. No device needed.
 */

typedef struct brume_exr_channel {
    const char *name;                /* "R", "ViewLayer.Combined.R" … */
    const float *pixels;             /* first sample */
    uint32_t stride;                 /* floats from one pixel to the next */
    uint32_t reserved;
} brume_exr_channel;

/* Writes 32-bit float channels, ZIP-compressed. Rows of the pixels go bottom to top. */
BRUME_API brume_result brume_exr_write(const char *path, int32_t width, int32_t height,
                                       const brume_exr_channel *channels, uint32_t count);
/* Reads R, G, B and A (or Y) of a flat scanline or tiled EXR as width * height * 4 floats, rows
 * bottom to top. *pixels is released with brume_free. */
BRUME_API brume_result brume_exr_read(const char *path, int32_t *width, int32_t *height,
                                      float **pixels);
BRUME_API void brume_free(void *memory);

#ifdef __cplusplus
}
#endif
#endif
