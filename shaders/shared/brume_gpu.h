/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What C and GLSL share: structs, group sizes, slots. Only float int uint vec4 ivec4 uvec4 mat4,
 * padded by hand; sizes are asserted in C (render/layout.c). */
#ifndef BRUME_GPU_H
#define BRUME_GPU_H

#ifndef GL_core_profile
#include <stdint.h>
typedef uint32_t uint;
typedef struct vec4 { float x, y, z, w; } vec4;
typedef struct ivec4 { int x, y, z, w; } ivec4;
typedef struct uvec4 { uint32_t x, y, z, w; } uvec4;
typedef struct mat4 { float m[16]; } mat4;
#endif

/* Depth of a pixel of the G-buffer that sees no surface. Orthographic views see behind their eye, at
 * depths below 0. */
#define NO_DEPTH -1e30f

/* Group sizes */
#define GROUP_PIXELS 8   /* 8 x 8 x 1: a view pass */
/* 8 x 4 x 4: a lattice pass. A CPU's rasteriser fills its vectors along x alone: groups of 4 x 4 x 4
 * took it 1.75 times as long. */
#define GROUP_LANES 8
#define GROUP_CELLS 4

#define GROUP_REST 64    /* 64 x 1 x 1: pixels from a list */

/* Uniform blocks */
#define SLOT_FRAME 0
#define SLOT_STAGE 1
#define SLOT_LEVEL 2
#define SLOT_ORDINATES 3     /* and as a storage buffer where they are written */
#define SLOT_LEVEL_BEFORE 4  /* DOM: a lattice of the last run */
#define SLOT_MATERIAL 5

/* Storage buffers */
#define SLOT_ACCUMULATION 2
#define SLOT_DEPTH_SOURCES 4
#define SLOT_REST 4
#define SLOT_DEPTH_GROUPS 5
#define SLOT_SCATTERED_FLOWS 5
#define SLOT_POWERS 6
#define SLOT_DOTS 7

/* Textures */
#define SLOT_MEDIUM_SCATTER 0
#define SLOT_MEDIUM_EXTINCT 1
#define SLOT_MEDIUM_EMISSION 2
#define SLOT_MEDIUM_BRICKS 3
#define SLOT_TAU 4
#define SLOT_SKY_R 5
#define SLOT_SKY_G 6
#define SLOT_SKY_B 7
#define SLOT_SHADOW 8
#define SLOT_WORLD 9
#define SLOT_GBUFFER_NORMAL 10
#define SLOT_GBUFFER_DIFFUSE 11
#define SLOT_GBUFFER_SPECULAR 12
#define SLOT_GBUFFER_EMISSION 13
#define SLOT_SURFACE 14
#define SLOT_MATERIAL_BASE 15
#define SLOT_MATERIAL_ROUGHNESS 16
#define SLOT_GBUFFER_TINT 17
#define SLOT_DEPTH_BEFORE 18
#define SLOT_FIELD 19
#define SLOT_LINKS 20
#define SLOT_CELL_EXTINCT 21
#define SLOT_CELL_ALBEDO 22  /* with DOM what it lacks to 1 */
#define SLOT_WALLS 23
#define SLOT_FLOW 24         /* and two more: red, green, blue */
#define SLOT_AREAS 24        /* and one more: fuzzy blockers' */
#define SLOT_REFLECTED 27    /* and two more */
#define SLOT_RSM 27          /* and two more: position, normal, reflectance */
#define SLOT_FLOW_AROUND 27  /* and two more: of the lattice around */
#define SLOT_BLOCKED 30
#define SLOT_HALF 31
#define SLOT_AROUND 32       /* which cell of the lattice around a cell beyond this one is in */
#define SLOT_SCATTERED 33    /* what cells scatter towards the eye */
/* Lists that are read as texels: of a storage buffer software reads every number for every lane by itself,
 * which took a third of the time of shading and a quarter of that of the march. */
#define SLOT_LIGHTS 36
#define SLOT_LIGHT_SAMPLES 37
#define SLOT_SHADOW_VIEWS 38
#define SLOT_BAND_2 39       /* with DOM: what the field has of it */
/* DOM's, while it looks for the field */
#define SLOT_ANGULAR 24      /* by ordinates: the source; in the end what cells' means are, */
#define SLOT_HITS 25         /* and what meets surfaces */
#define SLOT_SLICE 26        /* radiance that leaves the slice of cells before */
#define SLOT_LINES 25        /* lines that links are made of */
#define SLOT_CUTS 30         /* what surfaces do to a cell's links: dom_cells says */
#define SLOT_MOMENTS 34      /* and one more that a stage's shader names */
#define SLOT_CELL_EMISSION 26 /* of the surfaces in a cell */
#define SLOT_CELL_WALLS 31   /* radiance of the surfaces in a cell */
#define SLOT_HISTORY 24      /* and three more: residuals, or results */
#define SLOT_MEANS_AROUND 27 /* what cells' means are in the lattice around */
#define SLOT_SURROUNDINGS 28 /* radiance that comes into the outermost lattice, a layer an ordinate */
#define SLOT_CELL_DEPTHS 24  /* optical depths of cells as diffusion has them */
#define SLOT_MISSING 25      /* and one more: what an iteration has yet to find, and a step before */

/* Images written by compute passes, and by the drawing of links */
#define SLOT_OUTPUT 0
#define SLOT_OUTPUT_HALF 1
#define SLOT_OUTPUT_LINKS 0
#define SLOT_OUTPUT_WALLS 1
#define SLOT_OUTPUT_NEAREST 2
#define SLOT_OUTPUT_LINES 3
#define SLOT_OUTPUT_FIELD 3  /* and two more */

/* Layers of what is marched at half the resolution: colours, and in w */
#define HALF_DIRECT 0        /* how far the ray went */
#define HALF_INDIRECT 1      /* 1: it left the media before it met a surface */
#define HALF_EMISSION 2
#define HALF_TRANSMITTANCE 3 /* how much of its way is in the world's medium */
#define HALF_LAYERS 4

/* Rows of blocks of 2 x 2 pixels that are marched once so many rows of pixels are, which is an even
 * number or all of them: one more than those, which the last row of pixels leans on. */
#define HALF_ROWS(rows, height)                                                                    \
    ((rows) == 0 ? 0 : (rows) / 2 + 1 < ((height) + 1) / 2 ? (rows) / 2 + 1 : ((height) + 1) / 2)

/* Surfaces are seen this much aside, in cells: what lies exactly at cells' centres is then on one side
 * of them for all links. */
#define ASIDE_X 1.3e-4f
#define ASIDE_Y 1.7e-4f
#define ASIDE_Z 2.1e-4f

/* Texels of a cell in the picture of its surfaces: sums, in 1/WALL_UNIT, of their reflectances and of
 * what they emit, as shares of the brightest material's; a count; and for the links along the three
 * axes how far along the last cut is, in 1/254, from 1; 0: there is none. */
#define WALL_TEXELS 10
#define WALL_EMISSION 3
#define WALL_COUNT 6
#define WALL_CUTS 7
#define WALL_UNIT 1048575.0

/* A link is made of lines from points around the middle of its cell, a third of a cell apart, to those
 * of its neighbour. Texels of a cell in their picture: bits, by points, for each of 13 links of the lines
 * that surfaces cut, and of the points that are parted from the cell's middle; and of the surface nearest
 * to a line's end its reflectance and what it emits, as a share of the brightest material's. */
#define LINES_ALONG 3
#define LINE_SIDE 4 /* texels of a cell, along x and y */
#define LINE_PARTED 13
#define LINE_REFLECTANCE 14
#define LINE_EMISSION 15

/* Cells along a brick's side: the unit of empty-space skipping. */
#define BRICK_CELLS 8

/* Nodes along a brick's side: the unit of propagation, of whole groups. */
#define BRICK_NODES 8

/* Samples of a lamp with extent whose transmittances are averaged, two by two in a texture. */
#define EXTENDED_SAMPLES 4

/* Lattices of light scattered or reflected, one within another, at most; outermost cells of one over
 * which it gives way to the one around it. */
#define FIELD_LEVELS 3
#define FIELD_GIVES_WAY 4

/* DOM: ordinates, the directions that light is carried along, at most; moments of the radiance, real
 * spherical harmonics of bands 0 to 3, four by four in a texture; of these the first bands, 0 and 1, are
 * extrapolated from so many iterations, and with them the radiance of surfaces. */
#define MOST_ORDINATES 96
#define MOMENT_SIDE 4
#define MOMENTS 16
#define BAND_2 5 /* of these, from number 4 on */
#define MIXED 5
#define HISTORY 4
/* Below this optical depth of a cell light does not diffuse. */
#define THINNEST 0.25

/* Lights, numbered as brume_light_type of brume.h; the world is one more. */
#define LIGHT_SUN 0
#define LIGHT_POINT 1
#define LIGHT_SPOT 2
#define LIGHT_RECTANGLE 3
#define LIGHT_ELLIPSE 4

#define LIGHT_CASTS_SHADOW 1u
#define LIGHT_CAMERA_VISIBLE 2u

struct gpu_light {
    vec4 position;   /* centre; sun: unit vector towards it. w: radius (point, spot) */
    vec4 axis;       /* unit vector that it shines along. w: tan of half the sun's angle */
    vec4 tangent;    /* area: half extent along u. spot: unit x over its scale. w: spot cos */
    vec4 bitangent;  /* area: half extent along v. spot: unit y over its scale. w: spot smooth */
    vec4 radiance;   /* sun: irradiance; point, spot: W/sr; area: W/(sr m^2). w: area, m^2 */
    vec4 factors;    /* diffuse, specular, volume; w: tan of half the spread, 0: none */
    uvec4 samples;   /* first sample, count, faces a sample, LIGHT_ flags */
    uvec4 info;      /* type; tile origin of its optical depth (y, z); 1 if it has one */
};
#define LIGHT_TEXELS 8

struct gpu_light_sample {
    vec4 position;   /* point on the light; sun and world: unit vector towards it.
                        w: first shadow view, -1: none */
    vec4 weight;     /* world: radiance times solid angle. area: middle and half size of the
                        stratum in [-1, 1]^2 */
};
#define LIGHT_SAMPLE_TEXELS 2

/* One shadow map: a layer of their texture, or a quarter of one. */
struct gpu_shadow_view {
    mat4 clip_from_world;
    vec4 range;      /* x: 0 perspective, 1 orthographic; y near; z far; w: texel's size, m at
                        distance 1 (perspective) or anywhere (orthographic) */
    vec4 tile;       /* x, y: lower corner in the layer, 0..1; z: side, 0..1; w: layer */
};
#define SHADOW_VIEW_TEXELS 6

#define MATERIAL_BASE_IMAGE 1u
#define MATERIAL_ROUGHNESS_IMAGE 2u
#define MATERIAL_ALPHA_CLIP 4u
#define MATERIAL_ALPHA_BLEND 8u
#define MATERIAL_ALPHA_IMAGE 16u
#define MATERIAL_CULL_BACK 32u
#define MATERIAL_CLIP_IMAGE 64u  /* transparent black outside the image */

struct gpu_material {
    vec4 diffuse;      /* w: roughness */
    vec4 specular;     /* w: alpha */
    vec4 metal;        /* w: alpha threshold */
    vec4 emission;     /* w: share of the diffuse that is Burley's */
    vec4 transparent;
    uvec4 flags;
    vec4 padding[10]; /* a device may want uniform blocks to begin at multiples of 256 bytes */
};

/* As brume_visibility of brume.h. */
#define VISIBLE_CAMERA 1u
#define VISIBLE_SHADOW 2u
#define VISIBLE_HOLDOUT 4u

struct gpu_instance {
    mat4 world_from_object;
    mat4 normal_from_object; /* inverse transpose */
    uvec4 flags;             /* brume_visibility bits, its number */
};

/* The drawing stages' block: one shadow layer, or the camera. */
struct gpu_draw {
    mat4 clip_from_world;
    vec4 clip;           /* near, far along the view; z: 1 orthographic; w: for links, the share of the
                            brightest emission that a unit is */
    vec4 eye;            /* camera position, or the direction it looks along; w: 0 direction. Of a
                            reflective map that looks out of the field's lattice: that way; w: 1 */
    uvec4 info;          /* x: seed of the alpha test; y: number of a link; z: 1: once more,
                            adding what is nearest along it */
};

/* The lattice stages' block. */
struct gpu_lattice_pass {
    ivec4 offset;        /* what a stage's shader says */
    ivec4 slab;          /* z, w: first node layer of this dispatch, one after its last; x, y unused */
};

/* One reflective shadow map on its way into the field's lattice. */
struct gpu_reflection {
    mat4 clip_from_world;
    vec4 scale;          /* x: texel's side, m at distance 1 (perspective) or anywhere; y: times the
                            light of its sample */
    ivec4 what;          /* light, -1: from afar without one; sample, also the world's; face; texels
                            of a side */
    ivec4 tiles;         /* x: layers of the lattice in a row of the picture that it is gathered in;
                            y: the same of the fuzzy blockers' */
};

/* A point of a lamp, or a direction towards one, that optical depths are found to. */
struct gpu_depth_source {
    vec4 point;          /* w: 1 for the unit vector towards a sun */
    ivec4 node;          /* where the light comes from: first node of its cell, or beyond the lattice's
                            end; the paper's gather: the nearest node */
    ivec4 tile;          /* y, z: where its lattice begins in the texture; x: 0 */
};

/* Passes as brume_pass of brume.h. */
#define PASS_COMBINED 0
#define PASS_DEPTH 1
#define PASS_NORMAL 2
#define PASS_VOLUME_DIRECT 3
#define PASS_EMISSION 4
#define PASS_ENVIRONMENT 5
#define PASS_TRANSMITTANCE 6
#define PASS_VOLUME_INDIRECT 7
#define PASS_COUNT 8

/* A lattice of light scattered or reflected: the whole, or one within the last with half its cells'
 * sides. */
struct gpu_field {
    vec4 lower;          /* w: cell, m */
    ivec4 dims;          /* cells along the sides; w: its first layer in the texture of all */
    vec4 keep_lower;     /* where it gives way to the one around it; far off where both end */
    vec4 keep_upper;
};
#ifndef GL_core_profile
typedef struct gpu_field gpu_field;
#endif

/* A direction that DOM carries light along. */
struct gpu_ordinate {
    vec4 direction;      /* w: weight, sr */
    vec4 world;          /* mean radiance of the world around where it comes from */
    vec4 map_u, map_v;   /* products with a point that light along it goes through tell where its
                            radiance stands in the map of what surrounds the lattice, 0 to 1 */
    vec4 harmonics[4];   /* of the direction */
    uvec4 links_in;      /* bits of the four links by which light along it comes into a cell, */
    uvec4 links_out;     /* and goes on; as lib/cuts.glsl numbers them */
};
#ifndef GL_core_profile
typedef struct gpu_ordinate gpu_ordinate;
#endif

/* The block of DOM's stages. */
struct gpu_ordinates {
    ivec4 count;         /* x: ordinates; y: of their tiles, how many stand along z; the next along y */
    gpu_ordinate list[MOST_ORDINATES];
};

struct gpu_frame {
    vec4 ray_origin, ray_origin_x, ray_origin_y; /* ray = origin + x ndc.x + y ndc.y */
    vec4 ray_direction, ray_direction_x, ray_direction_y; /* view depth 1 per unit */
    vec4 eye;            /* of all samples; w: 0: the way it looks, of a parallel view */
    ivec4 size;          /* width, height, number of this sample, seed */
    vec4 clip;           /* near, far, film transparent, samples in all */
    vec4 medium_lower;   /* w: cell, m */
    vec4 medium_upper;   /* w: 1 if it emits */
    ivec4 medium_dims;   /* w: 1 if there is one */
    vec4 lattice_lower;  /* transport lattice; w: cell, m */
    ivec4 lattice_dims;  /* nodes along the sides; w: 1 if there is one */
    gpu_field fields[FIELD_LEVELS];
    ivec4 field;         /* x: how many of these there are; y: 1 if band 2 of their light is known */
    vec4 sky_lower;      /* lattice of the world's light; w: cell, m */
    ivec4 sky_dims;      /* nodes along the sides; w: 1 if there is one */
    vec4 fog_lower;      /* the world's medium; w: 1 if there is one */
    vec4 fog_upper;      /* w: 1 if it reaches without limit */
    vec4 fog_sigma_s;    /* w: mean cosine */
    vec4 fog_sigma_t;
    vec4 fog_emission;
    vec4 world_color;    /* w: 1 if there is an image */
    mat4 image_from_world;
    uvec4 world;         /* first sample, count, samples a pixel takes each time, maps a sample */
    uvec4 counts;        /* lights; shadow maps' side; a pixel takes every z-th of the world's
                            samples, in an order of steps of w among them */
    vec4 march;          /* step, m; steps in fog alone; rows of this dispatch: first, end */
    ivec4 paths;         /* 0 leaves out: x: what media scatter of the lights' own light; y: of the
                            field */
    ivec4 pass_slots[2]; /* slot of each pass in the accumulation buffer, -1: not wanted */
};

#endif
