/* The methods gtao.h is compared with, each written from its source for the same depth and normal buffers: plain scalar
 * C, one file per method, the parameters of the source.
 *
 * [A13] F. Aalund, A comparative study of screen-space ambient occlusion methods, 2013: six methods, the parameters of
 *       its "performance" (tables 2, 3) and "quality" (table 4) configurations, its blur and its output function.
 * [B08] L. Bavoil, M. Sainz, Image-space horizon-based ambient occlusion, SIGGRAPH 2008.
 * [J16], [J19] the slides and the memo of GTAO. [TP16] A. Tatarinov, A. Panteleev, Advanced ambient occlusion methods
 * for modern games, GDC 2016.
 *
 * [A13]'s lengths are for a sampling radius of 10 units; they are scaled by radius / 10 here. Its raw values are mapped
 * by an output function (b (AO + a))^c that its author tuned by eye to one scene and a ray tracer with linear falloff.
 * The truth here is another, so a, b, c are fitted anew, for every method, by least squares to the truth pooled over the
 * scenes: the best that the method can do with that output function. Compare with the fitted one. */
#ifndef BENCH_RIVALS_H
#define BENCH_RIVALS_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "tests/bench/scenes.h"
#include "tests/bench/view.h"

typedef struct rival_output {
    float a, b, c; /* visibility = clamp(b (raw + a))^c */
} rival_output;

typedef struct rival_preset {
    const char *name;
    int directions, steps; /* what they count is said in the method's file */
    int taps;              /* depth samples a pixel, all told */
    int blur;              /* half width of the denoiser, or its number of passes; 0: none */
    rival_output published;
} rival_preset;

typedef struct rival rival;
struct rival {
    const char *name, *title, *source;
    /* The method itself: raw visibility of every pixel, 1 for sky. `scratch`: rival_scratch_floats(v) floats. */
    void (*run)(const view *v, const rival_preset *p, float *scratch, float *raw);
    /* Denoises `raw` in place; null: the method has none. */
    void (*denoise)(const view *v, const rival_preset *p, float *scratch, float *raw);
    int presets;
    rival_preset preset[6];
};

extern const rival rival_mittring2007, rival_filion2008, rival_bavoil2008, rival_volumetric, rival_alchemy,
    rival_mittring2012, rival_hbao, rival_gtao_memo, rival_xegtao, rival_bitmask;

/* All of the above, null-terminated. */
extern const rival *const rivals[];

size_t rival_scratch_floats(const view *v);

/* Applies an output function to every pixel with a surface, in place. */
void rival_apply_output(const view *v, const rival_output *o, float *visibility);

/* Least squares over (raw, truth) pairs binned by the raw value. */
enum { RIVAL_BINS = 1024 };
typedef struct rival_fit {
    double count[RIVAL_BINS], truth[RIVAL_BINS], truth2[RIVAL_BINS];
} rival_fit;
void rival_fit_add(rival_fit *fit, const view *v, const float *raw, const float *truth);
rival_output rival_fit_solve(const rival_fit *fit, double *rmse);

/* [A13] section 5.3, listing 7: separable blur over `half_width` pixels on either side, weighed by depth and normals. */
void rival_blur(const view *v, int half_width, float *scratch, float *visibility);
/* The same as a rival's denoiser: half the width is the preset's. */
void rival_blur_preset(const view *v, const rival_preset *p, float *scratch, float *visibility);

/* ---- voxel cone tracing [TP16], on the meshes ---- */

typedef struct voxel_grid voxel_grid;

/* Voxelises the triangles within reach of what the view sees into cubes of opacity, `resolution` along the longest side
 * (a power of two), with the coarser levels. Null if there is no memory. */
voxel_grid *voxel_open(const bench_scene *s, const view *v, int resolution);
void voxel_close(voxel_grid *g);
double voxel_size(const voxel_grid *g); /* side of the finest cubes, world units */

/* Visibility by `cones` (1 + 5 of 60 degrees, or 16 of 36 degrees) cones a pixel up to the radius. */
void voxel_visibility(const voxel_grid *g, const view *v, int cones, float *visibility);

/* ---- shared by the methods ---- */

typedef struct v3f {
    float x, y, z;
} v3f;

static inline v3f v3f_sub(v3f a, v3f b) {
    return (v3f){a.x - b.x, a.y - b.y, a.z - b.z};
}
static inline v3f v3f_mad(v3f a, v3f b, float s) {
    return (v3f){a.x + b.x * s, a.y + b.y * s, a.z + b.z * s};
}
static inline v3f v3f_scale(v3f a, float s) {
    return (v3f){a.x * s, a.y * s, a.z * s};
}
static inline float v3f_dot(v3f a, v3f b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
static inline v3f v3f_cross(v3f a, v3f b) {
    return (v3f){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline v3f v3f_normalize(v3f a) {
    return v3f_scale(a, 1 / sqrtf(v3f_dot(a, a)));
}

static inline float clampf(float x, float lo, float hi) {
    return x < lo ? lo : x > hi ? hi : x;
}
static inline int clampi(int x, int lo, int hi) {
    return x < lo ? lo : x > hi ? hi : x;
}

static inline size_t rival_index(const view *v, int x, int y) {
    return (size_t)y * (size_t)v->width + (size_t)x;
}

static inline v3f rival_normal(const view *v, size_t i) {
    return (v3f){v->normals[3 * i], v->normals[3 * i + 1], v->normals[3 * i + 2]};
}

/* View-space point of pixel (x, y) at depth z. */
static inline v3f rival_point(const view *v, int x, int y, float z) {
    float s = z / v->focal_px;
    return (v3f){((float)x + 0.5f - v->cx) * s, ((float)y + 0.5f - v->cy) * s, z};
}

/* The pixel that holds the position (px, py), pixel centres at + 0.5: a point sampler clamped to the image. */
static inline v3f rival_fetch(const view *v, float px, float py) {
    int x = clampi((int)floorf(px), 0, v->width - 1), y = clampi((int)floorf(py), 0, v->height - 1);
    return rival_point(v, x, y, v->z[rival_index(v, x, y)]);
}

/* ---- the random vectors of [A13] section 5.2.1 ---- */

enum { RIVAL_TILE = 64, RIVAL_MOST_SAMPLES = 256 };

typedef struct rival_random {
    v3f unit[RIVAL_TILE * RIVAL_TILE];       /* one direction per pixel of a tile, uniform on the sphere */
    float angle[RIVAL_TILE * RIVAL_TILE][2]; /* cosine and sine of a uniform angle */
    float jitter[RIVAL_TILE * RIVAL_TILE];   /* [0, 1) */
    v3f ball[RIVAL_MOST_SAMPLES];            /* `count` points uniform in the unit ball */
    float disk[RIVAL_MOST_SAMPLES][2];       /* and in the unit disk */
} rival_random;

/* The source draws its points at random; these are spread evenly (Fibonacci sphere and disk), in the methods' favour. */
void rival_random_fill(rival_random *r, int count);

static inline size_t rival_tile_index(int x, int y) {
    return (size_t)(y & (RIVAL_TILE - 1)) * RIVAL_TILE + (size_t)(x & (RIVAL_TILE - 1));
}

/* Lagarde's fit, the shaders' usual one: maximum error 0.009 rad, x in [-1, 1]. */
static inline float rival_acos(float x) {
    float a = fabsf(x), r = (-0.156583f * a + 1.57079633f) * sqrtf(1 - a);
    return x >= 0 ? r : 3.14159265f - r;
}

static inline float rival_tan_to_sin(float t) {
    return t / sqrtf(t * t + 1);
}

/* `count` directions around the circle, evenly. */
static inline void rival_directions(int count, float (*direction)[2]) {
    for (int k = 0; k < count; ++k) {
        float a = 6.28318531f * (float)k / (float)count;
        direction[k][0] = cosf(a), direction[k][1] = sinf(a);
    }
}

/* GLSL's reflect: a mirrored in the plane perpendicular to the unit vector n. */
static inline v3f v3f_reflect(v3f a, v3f n) {
    return v3f_mad(a, n, -2 * v3f_dot(a, n));
}

#endif
