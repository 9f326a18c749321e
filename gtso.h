#ifndef GTAOI_W
/* gtso.h - ground-truth specular occlusion on a CPU - v0.1
 *
 * How much of a glossy reflection is open: the specular visibility V_s of [J16, J19] from visibility, bent normal,
 * normal, view vector and roughness; tables of it, each with a stated error; the cones and lobes they come from; and
 * the environment BRDF that completes the shading equation. Nothing here knows about screens or depth.
 *
 * DO THIS
 *
 *     #define GTAO_IMPLEMENTATION
 *     #define GTSO_IMPLEMENTATION
 *     #include "gtso.h"                             // includes gtao.h, whose vector operations it uses
 *
 *   in one C or C++ file; include it plainly elsewhere. Or define GTAO_STATIC too, in each file that wants its own
 *   copy of both. What gtao.h says about compilers, threads, SIMD and determinism holds here.
 *
 * EXAMPLE
 *
 *     gtso_table_desc table = {0};                  // full BRDF, 32 x 32 x 32
 *     float *data = malloc(gtso_table_count(&table) * sizeof(float));
 *     gtso_bake(&table, data, NULL);                // once; or load what build/lut wrote
 *
 *     gtso_lookup_desc lookup = {0};                // each frame
 *     lookup.width = 1920, lookup.height = 1080;
 *     lookup.table = &table, lookup.data = data;
 *     lookup.visibility = visibility, lookup.bent_normals = bent;   // of gtao_compute
 *     lookup.normals = normals, lookup.roughness = roughness;
 *     lookup.views = views;                         // or null: one view vector for all pixels
 *     lookup.output = specular_visibility;
 *     gtso_result result = gtso_lookup(&lookup);
 *     if (result != GTSO_OK) puts(gtso_result_string(result));
 *
 *   colour = V_s * probe(R, roughness) * (f0 * env[0] + env[1]), env from gtso_env_lookup.
 *
 * CONVENTIONS
 *   Unit vectors in any right- or left-handed space, all in the same one: n normal, v towards the eye, b bent normal
 *   (axis of the visibility cone), R = 2 (n.v) n - v reflection. Angles in radians: aperture (half angle of the
 *   visibility cone, 0 .. pi/2), beta (between b and R, 0 .. pi), view (between n and v, 0 .. pi/2), azimuth (of b
 *   around R, 0 towards n, 0 .. pi). Roughness is the perceptual one, 0 .. 1, alpha = roughness^2 the width of the
 *   distribution [Wal07]; the r of [J16] is alpha. Visibility: 1 open, 0 occluded.
 *
 * API LEVELS
 *   1 gtso_bake, gtso_lookup: whole tables, whole images.
 *   2 gtso_bake_rows, gtso_lookup_rows, gtso_env_bake_rows: row ranges, on the caller's threads.
 *   3 gtso_cap_intersection, gtso_lobe_visibility, gtso_brdf_visibility, ...: the formulas and integrals.
 *
 * OPTIONS (define before the implementation)
 *   GTSO_STATIC            everything of this file static; only together with GTSO_IMPLEMENTATION
 *   GTSO_HEADER_FILENAME   "gtso.h": how the file includes itself, once per vector width
 *
 * MEMORY, THREADS, DETERMINISM
 *   No allocation, no globals, no I/O, no threads: as gtao.h. Tables belong to the caller (32^3 floats: 128 KiB) and
 *   are read-only once baked. Baking runs in scalar double, by quadrature, with functions of its own instead of libm's;
 *   lookups in every kernel of gtao.h. Tables and lookups have the same bits everywhere (tests/determinism.sh).
 *
 * ACCURACY (tests/reference/test_specular.c)
 *   Cap intersection: 6e-7 sr for every triple, degenerate ones included. V_s by Oat's and the smoothstep approximation
 *   is off by 0.009 and 0.021 on average, 0.15 and 0.44 at most.
 *   Integrals over lobes and of the full BRDF: 1e-5 RMS, 1e-4 at most; white-dome identity 1e-6.
 *   Tables against those integrals, RMSE over evenly spread points, at 8 bits (BC4 adds 0.001):
 *     full BRDF with n = b (default)   32^3 0.0033   16^3 0.0090      32^3 bakes in 0.4 s on one 2.5 GHz core
 *     GGX about R                      32^3 0.0022   16^3 0.0064      0.2 s
 *     full BRDF, view angle too        16^4 0.0043                    0.9 s
 *   What is left sits where V_s is a step: mirrors at the edge of nearly closed and nearly open cones. Plain axes
 *   (angles or cosines for beta) have four times the error.
 *   Cones themselves are the larger error: against random smooth horizons V_s has RMSE 0.210 as cone/cone, 0.199 as
 *   cone/lobe, 0.169 by the default table, 0.156 by that with the view angle; visibility itself in its place, 0.385.
 *   The bent normal's azimuth (GTSO_KIND_BENT) adds nothing that can be measured.
 *
 * DEVIATIONS FROM THE PAPERS
 *   - The default is the final definition of [J16] under the assumption n = b, for which three parameters suffice:
 *     nearer to truth than the distribution alone, and open surfaces stay exactly 1. lobe = GTSO_LOBE_GGX with frame =
 *     GTSO_FRAME_REFLECTION is the slides' cone/lobe table, kind = GTSO_KIND_CONE their first attempt.
 *   - Apertures are corrected for the tilt of the bent normal (no_tilt: not).
 *   - Beta is stored by its distance from the cone's edge.
 *
 * REFERENCES
 *   [J16], [J19] see gtao.h.
 *   [Wal07] Walter, Marschner, Li, Torrance: Microfacet models for refraction through rough surfaces. EGSR 2007.
 *   [OS07] Oat, Sander: Ambient aperture lighting. I3D 2007.
 *   [TV01] Tovchigrechko, Vakser: How common is the funnel-like energy landscape in protein-protein interactions?
 *          Protein Science 10, 2001.
 *   [Maz12] Mazonka: Solid angle of conical surfaces, polyhedral cones, and intersecting spherical caps. 2012.
 *   [Dro14] Drobot, [Ulu14] Uludag: lobe to cone fits, GPU Pro 5, as quoted in [J16].
 *   [Kar13] Karis: Real shading in Unreal Engine 4. SIGGRAPH 2013 course.
 *   [Hei14] Heitz: Understanding the masking-shadowing function in microfacet-based BRDFs. JCGT 3(2), 2014.
 *
 * REVISIONS
 *   0.1 (2026-11-22) first version
 *
 * Licence: MIT or public domain, at your choice; see the end of the file.
 */
#ifndef GTSO_H
#define GTSO_H

#include "gtao.h"

#define GTSO_VERSION 100 /* major * 10000 + minor * 100 + patch */

#ifndef GTSO_API
#if defined(GTSO_STATIC) && defined(__GNUC__)
#define GTSO_API static __attribute__((unused))
#elif defined(GTSO_STATIC)
#define GTSO_API static
#else
#define GTSO_API GTAO_API
#endif
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- results ---------------------------------------------------------------------------------------------------- */

/* One item per broken precondition; data never fails. */
#define GTSO_RESULTS(X)                                                                                                \
    X(GTSO_OK, "ok")                                                                                                   \
    X(GTSO_CANCELLED, "cancelled by the progress callback")                                                            \
    X(GTSO_ERROR_DESC, "desc: null pointer")                                                                           \
    X(GTSO_ERROR_KIND, "kind: unknown")                                                                                \
    X(GTSO_ERROR_LOBE, "lobe: unknown")                                                                                \
    X(GTSO_ERROR_FRAME, "frame: unknown")                                                                              \
    X(GTSO_ERROR_FIT, "fit: unknown")                                                                                  \
    X(GTSO_ERROR_CAPS, "caps: unknown")                                                                                \
    X(GTSO_ERROR_F0, "f0: must be 0 (0.04) or up to 1")                                                                \
    X(GTSO_ERROR_TABLE_SIZE, "size: each must be 0 (default) or 8..64, azimuth 4..64")                                 \
    X(GTSO_ERROR_SCALE, "scale: not one of its axis")                                                                  \
    X(GTSO_ERROR_ROWS, "row_begin, row_end: not within the table or image")                                            \
    X(GTSO_ERROR_DATA, "data: null pointer")                                                                           \
    X(GTSO_ERROR_SIZE, "width, height: must be 1..32768")                                                              \
    X(GTSO_ERROR_VISIBILITY, "visibility, visibility_stride: null pointer, or rows overlap or are misaligned")         \
    X(GTSO_ERROR_BENT, "bent_normals, bent_stride, bent_components: null, or not 0 (3), 3 or 4 floats, or misaligned") \
    X(GTSO_ERROR_NORMALS,                                                                                              \
      "normals, normal_stride, normal_components: null, or not 0 (3), 3 or 4 floats, or misaligned")                   \
    X(GTSO_ERROR_VIEWS, "views, view_stride, view_components, view: not 0 (3), 3 or 4 floats, or misaligned")          \
    X(GTSO_ERROR_ROUGHNESS, "roughness, roughness_stride, constant_roughness: misaligned, or not 0..1")                \
    X(GTSO_ERROR_FADE, "fade_begin, fade_end: must be 0 <= begin <= end <= 1")                                         \
    X(GTSO_ERROR_WEIGHTING, "weighting: unknown")                                                                      \
    X(GTSO_ERROR_ISA, "isa: unknown, not compiled in, or not supported by this machine")                               \
    X(GTSO_ERROR_OUTPUT, "output, output_stride: null pointer, or rows overlap or are misaligned")

typedef enum gtso_result {
#define GTSOI_X(name, text) name,
    GTSO_RESULTS(GTSOI_X)
#undef GTSOI_X
        GTSO_RESULT_COUNT
} gtso_result;

/* "field: what is wrong with it", never null. */
GTSO_API const char *gtso_result_string(gtso_result result);

/* ---- cones ------------------------------------------------------------------------------------------------------ */

typedef enum gtso_fit { /* aperture of the cone that stands for a lobe */
                        GTSO_FIT_JIMENEZ =
                            0, /* [J16] cos = 0.01^(1 / (p + 2)) = 2^(-3.32193 alpha^2), p = 2 / alpha^2 - 2 */
                        GTSO_FIT_DROBOT = 1, /* [Dro14] 2 sqrt(2 / (p + 2)) = 2 alpha */
                        GTSO_FIT_ULUDAG = 2  /* [Ulu14] cos = 0.244^(1 / (p + 1)) */
} gtso_fit;

typedef enum gtso_caps {                      /* solid angle of the intersection of two spherical caps */
                         GTSO_CAPS_EXACT = 0, /* [TV01], [Maz12] */
                         GTSO_CAPS_OAT =
                             1, /* [OS07] the smaller cap times a smoothstep of the angle between the axes */
                         GTSO_CAPS_SMOOTHSTEP = 2 /* the same of its cosine: no inverse function */
} gtso_caps;

/* Cosine of the aperture of the cone with this visibility: cosine-weighted about an upright axis, sqrt(1 - A) [J16];
 * about an axis tilted by n.b, sqrt(1 - A / n.b), which stays above the tangent plane where there is such a cone;
 * uniformly weighted, 1 - A [J16]. In [0, 1]. */
GTSO_API float gtso_cos_aperture(float visibility);
GTSO_API float gtso_cos_aperture_tilted(float visibility, float n_dot_b);
GTSO_API float gtso_cos_aperture_uniform(float visibility);

/* Half angle of the cone that stands for a lobe, 0 .. pi/2. */
GTSO_API float gtso_lobe_aperture(gtso_fit fit, float roughness);

/* Solid angle, steradian, of what two caps of half angles a and b have in common whose axes are `distance` apart. All
 * in [0, pi]. Exact within 1e-6 for every triple. */
GTSO_API float gtso_cap_intersection(gtso_caps caps, float a_rad, float b_rad, float distance_rad);

/* [J16] cone against cone: that solid angle by the lobe's. 1 for aperture pi, 0 for aperture 0, to the last bit. */
GTSO_API float gtso_cone_visibility(gtso_caps caps, float aperture_rad, float lobe_aperture_rad, float beta_rad);

/* ---- lobes ------------------------------------------------------------------------------------------------------ */

typedef enum gtso_lobe {                         /* integrand besides visibility */
                         GTSO_LOBE_BRDF = 0,     /* f n.l, as gtso_brdf_visibility, f0 = 0.04 */
                         GTSO_LOBE_GGX = 1,      /* D(h) n.l, D of GGX [Wal07] */
                         GTSO_LOBE_BECKMANN = 2, /* D(h) n.l, Beckmann [Wal07] */
                         GTSO_LOBE_BLINN = 3,    /* D(h) n.l, Blinn-Phong, exponent p = 2 / alpha^2 - 2 */
                         GTSO_LOBE_PHONG = 4     /* (R.l)^p n.l */
} gtso_lobe;

typedef enum gtso_frame { /* where n and v are, given only the angle between b and R */
                          GTSO_FRAME_BENT =
                              0, /* n = b, so the view angle is beta, to pi/2: an open hemisphere gives exactly 1 */
                          GTSO_FRAME_REFLECTION = 1 /* n = v = R: a lobe of revolution about R */
} gtso_frame;

/* [J16] cone against lobe: the integral of the lobe over the cone by that over the hemisphere of n. By quadrature,
 * within 1e-4, mostly 1e-5. Apertures up to pi/2. */
GTSO_API float gtso_lobe_visibility(gtso_lobe lobe, gtso_frame frame, float aperture_rad, float beta_rad,
                                    float roughness);

/* [J16] the final definition, for any bent normal: integral of V f n.l by that of f n.l, f the full BRDF: GGX,
 * height-correlated Smith [Hei14], Schlick's Fresnel from f0. *occluded and *open (may be null) receive the two, so
 * occluded = V_s (f0 env[0] + env[1]): the white-dome identity. Vectors of any length. By quadrature, within
 * 1e-4, mostly 1e-5. */
GTSO_API float gtso_brdf_visibility(const float normal[3], const float view[3], const float bent_normal[3],
                                    float aperture_rad, float roughness, float f0, float *occluded, float *open);

/* f n.l of that BRDF for unit vectors, 0 below the horizon. */
GTSO_API float gtso_brdf(const float normal[3], const float view[3], const float light[3], float roughness, float f0);

/* A slice of gtao.h: the directions cos(h) v + sin(h) o, h0 <= h <= h1, are open. */
typedef struct gtso_slice {
    float direction[3]; /* unit, perpendicular to the view vector */
    float h0_rad;       /* horizon on the side of -direction, -pi .. 0 */
    float h1_rad;       /* horizon on the side of +direction, 0 .. pi */
} gtso_slice;

/* The same against horizons instead of a cone: every direction is open up to the horizon of the nearest slice in
 * azimuth around v. `count` slices at equal angles, in order, the first direction anywhere. */
GTSO_API float gtso_horizon_visibility(const float normal[3], const float view[3], const gtso_slice *slices, int count,
                                       float roughness, float f0, float *occluded, float *open);

/* ---- tables ----------------------------------------------------------------------------------------------------- */

typedef enum gtso_kind {
    GTSO_KIND_LOBE = 0, /* aperture, beta, roughness: cone against lobe */
    GTSO_KIND_CONE = 1, /* aperture, beta, roughness: cone against cone */
    GTSO_KIND_BRDF = 2, /* aperture, beta, roughness, view: full BRDF, b in the plane of n and R, on the side of n */
    GTSO_KIND_BENT = 3  /* aperture, beta, roughness, view, azimuth: full BRDF, b anywhere */
} gtso_kind;

typedef enum gtso_axis {
    GTSO_AXIS_APERTURE = 0,
    GTSO_AXIS_BETA = 1,
    GTSO_AXIS_ROUGHNESS = 2,
    GTSO_AXIS_VIEW = 3,
    GTSO_AXIS_AZIMUTH = 4,
    GTSO_AXIS_COUNT = 5
} gtso_axis;

/* Coordinate u in [0, 1] along an axis; texel i of N stands for u = i / (N - 1). */
typedef enum gtso_scale {
    GTSO_SCALE_DEFAULT = 0,   /* what interpolates best: docs/specular.md */
    GTSO_SCALE_ANGLE = 1,     /* angles: u = angle / largest */
    GTSO_SCALE_COSINE = 2,    /* angles: u = (1 - cos) / (1 - cos of the largest) */
    GTSO_SCALE_HALF_SINE = 3, /* angles: u = sin(angle / 2) / sin(largest / 2) */
    GTSO_SCALE_EDGE = 4, /* beta: e = aperture - beta in units of the lobe's width, compressed; see gtso_table_coords */
    GTSO_SCALE_ROUGHNESS = 5, /* roughness: u = roughness */
    GTSO_SCALE_ALPHA = 6,     /* roughness: u = roughness^2 */
    GTSO_SCALE_COUNT = 7
} gtso_scale;

/* What a table holds. Zero-initialise, then set what differs: zero always means the default. The data are floats in
 * the order [azimuth][view][roughness][beta][aperture], axes the kind does not have left out. */
typedef struct gtso_table_desc {
    gtso_kind kind;
    gtso_lobe lobe;            /* GTSO_KIND_LOBE */
    gtso_frame frame;          /* GTSO_KIND_LOBE */
    gtso_fit fit;              /* GTSO_KIND_CONE */
    gtso_caps caps;            /* GTSO_KIND_CONE */
    float f0;                  /* GTSO_KIND_BRDF, GTSO_KIND_BENT: reflectance at normal incidence; 0: 0.04 */
    int size[GTSO_AXIS_COUNT]; /* texels, 8..64 (azimuth 4..64); 0: 32 (3 axes), 16 (4), 16 and 8 azimuths (5) */
    gtso_scale scale[GTSO_AXIS_COUNT];
} gtso_table_desc;

/* A point of a table's domain. */
typedef struct gtso_point {
    float aperture_rad, beta_rad, roughness, view_rad, azimuth_rad;
} gtso_point;

/* Reports how many of the range's rows are done; nonzero cancels. */
typedef struct gtso_progress {
    int (*report)(void *user, int rows_done, int rows_total);
    void *user;
} gtso_progress;

/* Checks a description and replaces every default by what it stands for: unused axes get size 1. */
GTSO_API gtso_result gtso_table_resolve(const gtso_table_desc *desc, gtso_table_desc *resolved);
GTSO_API int gtso_table_axes(const gtso_table_desc *desc);     /* 3, 4 or 5; 0 if the description is invalid */
GTSO_API size_t gtso_table_count(const gtso_table_desc *desc); /* floats of the whole table; 0 if invalid */
GTSO_API int gtso_table_rows(const gtso_table_desc *desc);     /* rows of size[0] floats; 0 if invalid */

/* Bakes the whole table, or its rows [row_begin, row_end), into `data`, the start of the whole table. Ranges may run at
 * once on any threads; the bits do not depend on the split. `progress` may be null. */
GTSO_API gtso_result gtso_bake(const gtso_table_desc *desc, float *data, const gtso_progress *progress);
GTSO_API gtso_result gtso_bake_rows(const gtso_table_desc *desc, float *data, int row_begin, int row_end,
                                    const gtso_progress *progress);

/* What the table stands for at a point, by quadrature: the truth its interpolation is measured against. The
 * description must be valid. */
GTSO_API float gtso_table_exact(const gtso_table_desc *desc, const gtso_point *point);
/* Coordinates in [0, 1] of a point, one for each axis (0 for those the kind does not have), and back.
 * GTSO_SCALE_EDGE, for shaders: with chord(a) = 2 sin(a/2) = sqrt(2 - 2 cos a), w = 2 max(roughness^2, 1e-4),
 * c(e) = e / (w + |e|) and a = chord(aperture),  u = (c(a - chord(beta)) - c(a - 2)) / (c(a) - c(a - 2)). */
GTSO_API void gtso_table_coords(const gtso_table_desc *desc, const gtso_point *point, float u[GTSO_AXIS_COUNT]);
GTSO_API void gtso_table_point(const gtso_table_desc *desc, const float u[GTSO_AXIS_COUNT], gtso_point *point);
/* Multilinear interpolation at a point. */
GTSO_API float gtso_table_sample(const gtso_table_desc *desc, const float *data, const gtso_point *point);

/* ---- lookup ----------------------------------------------------------------------------------------------------- */

/* Everything a lookup reads and writes. Pointers are to row 0; strides are bytes, may be negative, 0 = tightly
 * packed; float alignment suffices. */
typedef struct gtso_lookup_desc {
    int width, height;
    const gtso_table_desc *table;
    const float *data; /* of the table */

    const float *visibility; /* 1 open .. 0 */
    ptrdiff_t visibility_stride;
    gtao_weighting weighting; /* of the visibility; cosine-weighted ones get the tilt correction, unless */
    int no_tilt;              /* nonzero: sqrt(1 - A) as in [J16] */

    const float *bent_normals; /* unit */
    ptrdiff_t bent_stride;
    int bent_components;  /* floats from one to the next, 0 (3), 3 or 4 */
    const float *normals; /* unit */
    ptrdiff_t normal_stride;
    int normal_components;
    const float *views; /* unit, towards the eye; null: `view` for all pixels */
    ptrdiff_t view_stride;
    int view_components;
    float view[3];          /* all zero: (0, 0, -1), the orthographic camera of gtao.h */
    const float *roughness; /* null: constant_roughness */
    ptrdiff_t roughness_stride;
    float constant_roughness;

    float fade_begin, fade_end; /* V_s goes to 1 by a smoothstep as roughness falls from end to begin, where a cone
                                 * is too coarse for what a mirror shows; both 0: no fade */

    float *output; /* V_s, 1 open .. 0 */
    ptrdiff_t output_stride;
    gtao_isa isa;
} gtso_lookup_desc;

/* Whole image, or rows [row_begin, row_end) on any thread. On an error nothing is written. */
GTSO_API gtso_result gtso_lookup(const gtso_lookup_desc *desc);
GTSO_API gtso_result gtso_lookup_rows(const gtso_lookup_desc *desc, int row_begin, int row_end);

/* One pixel, with the bits of the above (cosine weighting, tilt correction, no fade). The description must be valid. */
GTSO_API float gtso_lookup_at(const gtso_table_desc *desc, const float *data, float visibility,
                              const float bent_normal[3], const float normal[3], const float view[3], float roughness);

/* ---- environment BRDF ------------------------------------------------------------------------------------------- */

/* [Kar13] split sum: the integral of f n.l over the hemisphere is f0 env[0] + env[1]. By quadrature, within 1e-4. */
GTSO_API void gtso_env_brdf(float n_dot_v, float roughness, float env[2]);
/* Rows [row_begin, row_end) of a table of size_view x size_roughness pairs (each 2..256): row j is roughness
 * j / (size_roughness - 1), column i is n.v = i / (size_view - 1). */
GTSO_API gtso_result gtso_env_bake_rows(int size_view, int size_roughness, float *data, int row_begin, int row_end,
                                        const gtso_progress *progress);
GTSO_API void gtso_env_lookup(int size_view, int size_roughness, const float *data, float n_dot_v, float roughness,
                              float env[2]);

/* ---- formats ---------------------------------------------------------------------------------------------------- */

/* A BC4 (unsigned) block: 4 x 4 texels in [0, 1], row by row, in 8 bytes. The decoder is exact: e0 + (e1 - e0) k / 7
 * unrounded. */
GTSO_API void gtso_bc4_encode_block(const float texels[16], uint8_t block[8]);
GTSO_API void gtso_bc4_decode_block(const uint8_t block[8], float texels[16]);

#ifdef __cplusplus
}
#endif
#endif /* GTSO_H */

/* ================================================================================================================
 * IMPLEMENTATION
 * ================================================================================================================ */
#if defined(GTSO_IMPLEMENTATION) && !defined(GTSOI_IMPLEMENTED)
#define GTSOI_IMPLEMENTED

#ifndef GTAOI_IMPLEMENTED
#error "gtso.h: define GTAO_IMPLEMENTATION, too, in the file that defines GTSO_IMPLEMENTATION"
#endif
#ifndef GTSO_HEADER_FILENAME
#define GTSO_HEADER_FILENAME "gtso.h" /* how this file includes itself, by way of gtao.h, once per vector width */
#endif

/* As in gtao.h. */
#if defined(__clang__)
#if defined(__i386__) && !defined(__SSE2_MATH__)
#pragma clang attribute push(__attribute__((target("sse2"))), apply_to = function)
#endif
#elif defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wuninitialized"
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#pragma GCC push_options
#pragma GCC optimize("fp-contract=off")
#if defined(__i386__)
#pragma GCC target("sse2,fpmath=sse")
#endif
#elif defined(_MSC_VER)
#pragma float_control(precise, on, push)
#pragma fp_contract(off)
#endif

/* ---- constants -------------------------------------------------------------------------------------------------- */

#define GTSOI_ALPHA_MIN 1e-4     /* narrower lobes are taken for this: roughness 0.01 */
#define GTSOI_FACING_MIN 1e-3    /* least n.v in an integral, so that the horizon stays finite */
#define GTSOI_EDGE_WIDTH 2.0     /* GTSO_SCALE_EDGE: chord in units of alpha at which half the texels are used up */
#define GTSOI_MAX_COUNT 16777216 /* floats of a table: their indices are whole numbers in float */
#define GTSOI_GAUSS 12           /* nodes of a panel */

/* ---- elementary functions in double: correctly rounded operations only, so the same bits everywhere ------------- */

static double gtsoi_clamp(double x, double lo, double hi) { /* NaN: lo */
    return x > lo ? (x < hi ? x : hi) : lo;
}

/* |a| < 100; error below 1e-15. */
static void gtsoi_sincos(double a, double *sine, double *cosine) {
    GTAOI_NO_CONTRACT
    int q = (int)(a * 0.63661977236758134308 + (a < 0.0 ? -0.5 : 0.5));
    double k = (double)q, r = (a - k * 1.57079632679489655800) - k * 6.12323399573676603587e-17, rr = r * r, s, c;
    s = -7.6471637318198164759e-13 + rr * 2.8114572543455207632e-15;
    s = 1.6059043836821614599e-10 + rr * s;
    s = -2.5052108385441718775e-8 + rr * s;
    s = 2.7557319223985890653e-6 + rr * s;
    s = -1.9841269841269841270e-4 + rr * s;
    s = 8.3333333333333333333e-3 + rr * s;
    s = -1.6666666666666666667e-1 + rr * s;
    s = r + r * rr * s;
    c = -1.1470745597729724714e-11 + rr * 4.7794773323873852974e-14;
    c = 2.0876756987868098979e-9 + rr * c;
    c = -2.7557319223985890653e-7 + rr * c;
    c = 2.4801587301587301587e-5 + rr * c;
    c = -1.3888888888888888889e-3 + rr * c;
    c = 4.1666666666666666667e-2 + rr * c;
    c = 1.0 - 0.5 * rr + rr * rr * c;
    *sine = q & 1 ? c : s;
    *cosine = q & 1 ? s : c;
    if (q & 2)
        *sine = -*sine;
    if ((q + 1) & 2)
        *cosine = -*cosine;
}

/* Two halvings, then the series; error below 1e-15 relative. */
static double gtsoi_atan01(double x) {
    GTAOI_NO_CONTRACT
    double xx, p = 0.0;
    int k;
    x = x / (1.0 + sqrt(1.0 + x * x));
    x = x / (1.0 + sqrt(1.0 + x * x));
    xx = x * x; /* below 0.04 */
    for (k = 21; k >= 1; k -= 2)
        p = 1.0 / (double)k - xx * p;
    return 4.0 * x * p;
}

/* In [-pi, pi]; 0 for (0, 0) and NaN. */
static double gtsoi_atan2(double y, double x) {
    double ay = y < 0.0 ? -y : y, ax = x < 0.0 ? -x : x, a;
    if (!(ax + ay > 0.0))
        return 0.0;
    a = ax >= ay ? gtsoi_atan01(ay / ax) : 0.5 * GTAOI_PI - gtsoi_atan01(ax / ay);
    if (x < 0.0)
        a = GTAOI_PI - a;
    return y < 0.0 ? -a : a;
}

static double gtsoi_acos(double x) {
    x = gtsoi_clamp(x, -1.0, 1.0);
    return gtsoi_atan2(sqrt((1.0 - x) * (1.0 + x)), x);
}

/* Natural logarithm, 1e-3 < x < 1e12; absolute error below 1e-13. */
static double gtsoi_log(double x) {
    GTAOI_NO_CONTRACT
    double z, zz, p = 0.0;
    int exponent = 0, k;
    while (x > 1.41421356237309504880)
        x *= 0.5, exponent++;
    while (x < 0.70710678118654752440)
        x *= 2.0, exponent--;
    z = (x - 1.0) / (x + 1.0), zz = z * z; /* below 0.0295 */
    for (k = 17; k >= 1; k -= 2)
        p = p * zz + 1.0 / (double)k;
    return 2.0 * z * p + (double)exponent * 0.69314718055994530942;
}

/* Exponential, x <= 0; 0 below -700. */
static double gtsoi_exp(double x) {
    GTAOI_NO_CONTRACT
    double e = 1.0, base = 0.5;
    int n, k;
    if (!(x > -700.0))
        return 0.0;
    n = (int)(-x * 1.44269504088896340736 + 0.5);
    x = x + (double)n * 0.69314718055994530942;
    for (k = 13; k >= 1; k--)
        e = 1.0 + e * x * (1.0 / (double)k);
    for (; n; n >>= 1, base *= base)
        if (n & 1)
            e *= base;
    return e;
}

/* Gauss-Legendre rule of 12 nodes on [0, 1]. */
typedef struct gtsoi_rule {
    double x[GTSOI_GAUSS], w[GTSOI_GAUSS];
    double position[GTSOI_GAUSS],
        weight[GTSOI_GAUSS]; /* the same after x -> (1 - cos(pi x)) / 2: for ends like a square
                                                        * root's */
} gtsoi_rule;

static void gtsoi_make_rule(gtsoi_rule *rule) {
    GTAOI_NO_CONTRACT
    static const double node[6] = {0.98156063424671924, 0.9041172563704748,  0.76990267419430469,
                                   0.58731795428661748, 0.36783149899818018, 0.12523340851146894};
    static const double weight[6] = {0.047175336386511835, 0.10693932599531818, 0.16007832854334633,
                                     0.20316742672306584,  0.23349253653835478, 0.24914704581340288};
    int i;
    for (i = 0; i < GTSOI_GAUSS; i++) {
        double s, c;
        int j = i < 6 ? i : GTSOI_GAUSS - 1 - i;
        rule->x[i] = 0.5 + (i < 6 ? -0.5 : 0.5) * node[j];
        rule->w[i] = 0.5 * weight[j];
        gtsoi_sincos(GTAOI_PI * rule->x[i], &s, &c);
        rule->position[i] = 0.5 - 0.5 * c;
        rule->weight[i] = rule->w[i] * 0.5 * GTAOI_PI * s;
    }
}

GTSO_API const char *gtso_result_string(gtso_result result) {
    static const char *const text[] = {
#define GTSOI_X(name, string) string,
        GTSO_RESULTS(GTSOI_X)
#undef GTSOI_X
    };
    return (unsigned)result < (unsigned)GTSO_RESULT_COUNT ? text[result] : "unknown result";
}

/* ---- cones ------------------------------------------------------------------------------------------------------ */

GTSO_API float gtso_cos_aperture(float visibility) {
    GTAOI_NO_CONTRACT
    return sqrtf(1.0f - gtaoi_clamp(visibility, 0.0f, 1.0f));
}

GTSO_API float gtso_cos_aperture_tilted(float visibility, float n_dot_b) {
    GTAOI_NO_CONTRACT
    return sqrtf(1.0f - gtaoi_clamp(gtaoi_clamp(visibility, 0.0f, 1.0f) / gtaoi_max(n_dot_b, 1e-6f), 0.0f, 1.0f));
}

GTSO_API float gtso_cos_aperture_uniform(float visibility) {
    GTAOI_NO_CONTRACT
    return 1.0f - gtaoi_clamp(visibility, 0.0f, 1.0f);
}

/* Width of the distribution; NaN: the narrowest. */
static double gtsoi_alpha(float roughness) {
    double r = gtsoi_clamp((double)roughness, 0.0, 1.0);
    return r * r > GTSOI_ALPHA_MIN ? r * r : GTSOI_ALPHA_MIN;
}

GTSO_API float gtso_lobe_aperture(gtso_fit fit, float roughness) {
    GTAOI_NO_CONTRACT
    double alpha = gtsoi_alpha(roughness), aa = alpha * alpha, half;
    if (fit == GTSO_FIT_DROBOT)
        return (float)gtsoi_clamp(2.0 * alpha, 0.0, 0.5 * GTAOI_PI);
    /* cos a = e^-x; sin(a/2) = sqrt((1 - e^-x) / 2), by series where that cancels */
    half = fit == GTSO_FIT_ULUDAG ? 1.41058705437025 / (2.0 / aa - 1.0) : 2.30258509299404568 * aa; /* x */
    half = half < 1e-4 ? half * (1.0 - half * (0.5 - half * (1.0 / 6.0))) : 1.0 - gtsoi_exp(-half);
    half = sqrt(0.5 * half);
    return (float)(2.0 * gtsoi_atan2(half, sqrt(1.0 - half * half)));
}

/* Angle at the corner between the sides p and q of a spherical triangle, opposite r, from its half perimeter s less
 * each side. */
static double gtsoi_corner(double s_p, double s_q, double s, double s_r) {
    GTAOI_NO_CONTRACT
    double sine[4], unused;
    gtsoi_sincos(s_p, &sine[0], &unused);
    gtsoi_sincos(s_q, &sine[1], &unused);
    gtsoi_sincos(s, &sine[2], &unused);
    gtsoi_sincos(s_r, &sine[3], &unused);
    return 2.0 *
           gtsoi_atan2(sqrt(gtsoi_clamp(sine[0] * sine[1], 0.0, 1.0)), sqrt(gtsoi_clamp(sine[2] * sine[3], 0.0, 1.0)));
}

/* 1 - cos a. */
static double gtsoi_versine(double a) {
    GTAOI_NO_CONTRACT
    double s, c;
    gtsoi_sincos(0.5 * a, &s, &c);
    return 2.0 * s * s;
}

/* [TV01] by another route: two sectors less the kite between the axes and the corners of the lens,
 *   2 phi_a (1 - cos a) + 2 phi_b (1 - cos b) - 2 E,   E = phi_a + phi_b + gamma - pi the excess of half the kite,
 * whose half-angle formulas and l'Huilier's lose nothing for small caps. */
static double gtsoi_cap_intersection(double a, double b, double d) {
    GTAOI_NO_CONTRACT
    double small, large, phi_a, phi_b, t[4], excess, sine, cosine, result;
    int i;
    a = gtsoi_clamp(a, 0.0, GTAOI_PI), b = gtsoi_clamp(b, 0.0, GTAOI_PI), d = gtsoi_clamp(d, 0.0, GTAOI_PI);
    small = a < b ? a : b, large = a < b ? b : a;
    if (d <= large - small)
        return 2.0 * GTAOI_PI * gtsoi_versine(small);
    if (d >= small + large)
        return 0.0;
    if (a + b + d >= 2.0 * GTAOI_PI) /* together they cover the sphere */
        return 2.0 * GTAOI_PI * (gtsoi_versine(a) + gtsoi_versine(b) - 2.0);
    t[0] = 0.5 * (a + b + d), t[1] = 0.5 * ((b - a) + d), t[2] = 0.5 * ((a - b) + d), t[3] = 0.5 * (a + b - d);
    phi_a = gtsoi_corner(t[1], t[3], t[0], t[2]);
    phi_b = gtsoi_corner(t[2], t[3], t[0], t[1]);
    for (i = 0; i < 4; i++)
        t[i] *= 0.5;
    sine = cosine = 1.0;
    for (i = 0; i < 4; i++) {
        double si, co;
        gtsoi_sincos(t[i], &si, &co);
        sine *= si, cosine *= co;
    }
    excess = 4.0 * gtsoi_atan2(sqrt(gtsoi_clamp(sine, 0.0, 1.0)), sqrt(gtsoi_clamp(cosine, 0.0, 1.0)));
    result = 2.0 * (phi_a * gtsoi_versine(a) + phi_b * gtsoi_versine(b) - excess);
    return gtsoi_clamp(result, 0.0, 2.0 * GTAOI_PI * gtsoi_versine(small));
}

/* The part of the smaller cap that the approximations give: 1 contained, 0 apart, a smoothstep between. */
static double gtsoi_cap_overlap(gtso_caps caps, double a, double b, double d) {
    GTAOI_NO_CONTRACT
    double apart = a + b, inside = a < b ? b - a : a - b, x;
    if (d <= inside)
        return 1.0;
    if (d >= apart)
        return 0.0;
    if (caps == GTSO_CAPS_SMOOTHSTEP)
        x = (gtsoi_versine(apart) - gtsoi_versine(d)) / (gtsoi_versine(apart) - gtsoi_versine(inside));
    else
        x = (apart - d) / (apart - inside);
    return x * x * (3.0 - 2.0 * x);
}

static double gtsoi_caps_by(gtso_caps caps, double a, double b, double d) {
    GTAOI_NO_CONTRACT
    if (caps == GTSO_CAPS_EXACT)
        return gtsoi_cap_intersection(a, b, d);
    a = gtsoi_clamp(a, 0.0, GTAOI_PI), b = gtsoi_clamp(b, 0.0, GTAOI_PI), d = gtsoi_clamp(d, 0.0, GTAOI_PI);
    if (a + b > GTAOI_PI) /* they meet wherever they are: by what they leave out */
        return 2.0 * GTAOI_PI * (gtsoi_versine(a) + gtsoi_versine(b) - 2.0) +
               2.0 * GTAOI_PI * gtsoi_versine(GTAOI_PI - (a < b ? b : a)) *
                   gtsoi_cap_overlap(caps, GTAOI_PI - a, GTAOI_PI - b, d);
    return 2.0 * GTAOI_PI * gtsoi_versine(a < b ? a : b) * gtsoi_cap_overlap(caps, a, b, d);
}

GTSO_API float gtso_cap_intersection(gtso_caps caps, float a_rad, float b_rad, float distance_rad) {
    return (float)gtsoi_caps_by(caps, (double)a_rad, (double)b_rad, (double)distance_rad);
}

GTSO_API float gtso_cone_visibility(gtso_caps caps, float aperture_rad, float lobe_aperture_rad, float beta_rad) {
    GTAOI_NO_CONTRACT
    double lobe = gtsoi_clamp((double)lobe_aperture_rad, 1e-6, GTAOI_PI), a = (double)aperture_rad;
    if (!(a > 0.0))
        return 0.0f;
    if (a >= 3.14159) /* pi as a float may lie on either side of pi */
        return 1.0f;
    return (float)gtsoi_clamp(gtsoi_caps_by(caps, a, lobe, (double)beta_rad) / (2.0 * GTAOI_PI * gtsoi_versine(lobe)),
                              0.0, 1.0);
}

/* ---- integrals over a lobe --------------------------------------------------------------------------------------- */

/* Directions l are mirror images of v about half vectors h(theta, phi), polar coordinates about the z axis of a frame
 * in which v lies in the xz plane. For each phi, with t = tan(theta), e = (cos phi, sin phi, 0) and m = e turned by 90
 * degrees,
 *
 *     l.b >= c   <=>   (A - K) + 2 B t - (A + K) t^2 >= 0,
 *     A = v_z b_z - v_e b_e,  B = v_e b_z + v_z b_e,  K = c + v_m b_m,
 *
 * so that the visible part of each half-plane has closed-form ends. The z axis is n, so that the distribution depends
 * on theta alone; for Phong's lobe it is R, and v is R as well: then l itself is at 2 theta. */

typedef struct gtsoi_integrand {
    gtso_lobe lobe;
    double alpha, aa;
    double power; /* Phong, Blinn-Phong */
    double width; /* of the lobe in t */
    double t_max; /* the lobe is 0 beyond */
    double split; /* of the radial integral, in y */
    double v[3];  /* v[1] = 0 */
    double n[3];  /* n[1] = 0 */
    double nv;
} gtsoi_integrand;

/* n.v is held above GTSOI_FACING_MIN. */
static void gtsoi_setup(gtsoi_integrand *g, gtso_lobe lobe, double alpha, double nv) {
    GTAOI_NO_CONTRACT
    double sine;
    nv = gtsoi_clamp(nv, GTSOI_FACING_MIN, 1.0);
    sine = sqrt((1.0 - nv) * (1.0 + nv));
    g->lobe = lobe;
    g->alpha = alpha, g->aa = alpha * alpha;
    g->nv = nv;
    g->power = 2.0 / g->aa - 2.0;
    g->width = alpha;
    g->t_max = 1e9;
    g->split = lobe == GTSO_LOBE_GGX ? 2.0 : lobe == GTSO_LOBE_BRDF ? 1.0 / (1.0 + sqrt(alpha)) : 0.5;
    g->v[0] = sine, g->v[1] = 0.0, g->v[2] = nv;
    g->n[0] = 0.0, g->n[1] = 0.0, g->n[2] = 1.0;
    if (lobe == GTSO_LOBE_BECKMANN)
        g->t_max = 5.5 * alpha;
    if (lobe == GTSO_LOBE_BLINN && alpha < 0.3)
        g->t_max = 7.0 * alpha;
    if (lobe == GTSO_LOBE_PHONG) {
        g->v[0] = 0.0, g->v[2] = 1.0;
        g->n[0] = sine, g->n[2] = nv;
        g->width = 0.5 * alpha;
        g->t_max = alpha < 0.3 ? 3.5 * alpha : 1.0; /* R.l > 0 */
    }
}

/* b at angle beta from R, azimuth 0 towards n. */
static void gtsoi_place(const gtsoi_integrand *g, double beta, double azimuth, double b[3]) {
    GTAOI_NO_CONTRACT
    double sb, cb, sa, ca, sine = sqrt((1.0 - g->nv) * (1.0 + g->nv));
    gtsoi_sincos(beta, &sb, &cb);
    gtsoi_sincos(azimuth, &sa, &ca);
    if (g->lobe == GTSO_LOBE_PHONG) {
        b[0] = sb * ca, b[1] = sb * sa, b[2] = cb;
    } else { /* R = (-sin, 0, n.v), towards n: (n.v, 0, sin) */
        b[0] = sb * ca * g->nv - cb * sine;
        b[1] = sb * sa;
        b[2] = sb * ca * sine + cb * g->nv;
    }
}

/* One half-plane: its direction and what the radial integral needs of it. */
typedef struct gtsoi_ray {
    double cosine, sine; /* of phi */
    double ve, vm;
    double na, nb, nc; /* n.l = (na (1 - t^2) + 2 nb t) / (1 + t^2) - nc */
} gtsoi_ray;

/* Integral of f n.l over y0 <= y <= y1, t = width y / (1 - y): the tail of GGX becomes a polynomial's. Fresnel's 1 - s
 * and s apart. */
static void gtsoi_panel(const gtsoi_integrand *g, const gtsoi_rule *rule, const gtsoi_ray *ray, double y0, double y1,
                        double sum[2]) {
    GTAOI_NO_CONTRACT
    double vz = g->v[2];
    int i;
    for (i = 0; i < GTSOI_GAUSS; i++) {
        double y = y0 + (y1 - y0) * rule->x[i], q = 1.0 / (1.0 - y), t = g->width * y * q, tt = t * t;
        double inv = 1.0 / (1.0 + tt), nl = (ray->na * (1.0 - tt) + 2.0 * ray->nb * t) * inv - ray->nc;
        double vh = vz + ray->ve * t, d; /* times sqrt(inv): v.h */
        double w = rule->w[i] * (y1 - y0) * g->width * q * q * 4.0 * t * vh;
        if (!(nl > 0.0) || !(vh > 0.0))
            continue;
        /* D(h) dl, dl = 4 v.h dh */
        switch (g->lobe) {
        case GTSO_LOBE_BECKMANN:
            d = gtsoi_exp(-tt / g->aa) / g->aa;
            break;
        case GTSO_LOBE_BLINN:
            d = gtsoi_exp(-0.5 * g->power * gtsoi_log(1.0 + tt)) * inv * inv;
            break;
        case GTSO_LOBE_PHONG:
            d = tt < 1.0 ? gtsoi_exp(g->power * gtsoi_log(gtsoi_clamp((1.0 - tt) * inv, 1e-3, 1.0))) * inv * inv : 0.0;
            break;
        default:
            d = g->aa / ((g->aa + tt) * (g->aa + tt));
            break;
        }
        w *= d * nl;
        if (g->lobe == GTSO_LOBE_BRDF) {
            /* [Hei14] G2 / (4 n.l n.v); Schlick */
            double a1 = 1.0 - g->aa, s = 1.0 - vh * sqrt(inv), ss = s * s;
            w *= 0.5 / (nl * sqrt(g->nv * g->nv * a1 + g->aa) + g->nv * sqrt(nl * nl * a1 + g->aa));
            s = s > 0.0 ? ss * ss * s : 0.0;
            sum[1] += w * s;
            w *= 1.0 - s;
        }
        sum[0] += w;
    }
}

/* The same over t0 <= t <= t1: in two where the tail sees more of Fresnel than the peak, and for steep lobes. */
static void gtsoi_radial(const gtsoi_integrand *g, const gtsoi_rule *rule, const gtsoi_ray *ray, double t0, double t1,
                         double sum[2]) {
    GTAOI_NO_CONTRACT
    double y0 = t0 / (g->width + t0), y1 = t1 / (g->width + t1), split = g->split;
    if (y0 < split && split < y1) {
        gtsoi_panel(g, rule, ray, y0, split, sum);
        y0 = split;
    }
    gtsoi_panel(g, rule, ray, y0, y1, sum);
}

/* Roots of (a - k) + 2 b t - (a + k) t^2, in order; 0 if there are none. */
static int gtsoi_roots(double a, double b, double k, double root[2]) {
    GTAOI_NO_CONTRACT
    double d = a * a + b * b - k * k, q, swap;
    if (!(d > 0.0))
        return 0;
    q = b >= 0.0 ? b + sqrt(d) : b - sqrt(d);
    root[0] = a + k != 0.0 ? q / (a + k) : 1e9;
    root[1] = q != 0.0 ? -(a - k) / q : 0.0;
    if (root[0] > root[1])
        swap = root[0], root[0] = root[1], root[1] = swap;
    return 1;
}

/* What of the half-plane phi is above the horizon and in the cone; b null: above the horizon. */
static void gtsoi_half_plane(const gtsoi_integrand *g, const gtsoi_rule *rule, const double *b, double c, double phi,
                             double sum[2]) {
    GTAOI_NO_CONTRACT
    gtsoi_ray ray;
    double ne, a, bb, k, be, bm, root[2], t_max = g->t_max;
    gtsoi_sincos(phi, &ray.sine, &ray.cosine);
    ray.ve = g->v[0] * ray.cosine, ray.vm = -g->v[0] * ray.sine;
    ne = g->n[0] * ray.cosine;
    ray.na = g->v[2] * g->n[2] - ray.ve * ne;
    ray.nb = ray.ve * g->n[2] + g->v[2] * ne;
    ray.nc = -ray.vm * g->n[0] * ray.sine; /* v_m n_m, n_m = -n_x sin(phi) */
    /* R is above the horizon, so the part of the half-plane above it begins at t = 0. */
    if (gtsoi_roots(ray.na, ray.nb, ray.nc, root)) {
        double end = root[0] > 0.0 ? root[0] : root[1];
        if (end > 0.0 && end < t_max)
            t_max = end;
    }
    if (!b) {
        gtsoi_radial(g, rule, &ray, 0.0, t_max, sum);
        return;
    }
    be = b[0] * ray.cosine + b[1] * ray.sine, bm = b[1] * ray.cosine - b[0] * ray.sine;
    a = g->v[2] * b[2] - ray.ve * be;
    bb = ray.ve * b[2] + g->v[2] * be;
    k = c + ray.vm * bm;
    if (!gtsoi_roots(a, bb, k, root)) {
        if (k < 0.0)
            gtsoi_radial(g, rule, &ray, 0.0, t_max, sum);
        return;
    }
    root[0] = gtsoi_clamp(root[0], 0.0, t_max), root[1] = gtsoi_clamp(root[1], 0.0, t_max);
    if (a + k >= 0.0) { /* between the roots */
        if (root[0] < root[1])
            gtsoi_radial(g, rule, &ray, root[0], root[1], sum);
    } else {
        if (root[0] > 0.0)
            gtsoi_radial(g, rule, &ray, 0.0, root[0], sum);
        if (root[1] < t_max)
            gtsoi_radial(g, rule, &ray, root[1], t_max, sum);
    }
}

static int gtsoi_add_break(double *list, int count, double phi, double end) {
    int i;
    while (phi < 0.0)
        phi += 2.0 * GTAOI_PI;
    while (phi >= 2.0 * GTAOI_PI)
        phi -= 2.0 * GTAOI_PI;
    if (!(phi < end))
        return count;
    for (i = count; i > 0 && list[i - 1] > phi; i--)
        list[i] = list[i - 1];
    list[i] = phi;
    return count + 1;
}

/* Integral of f n.l over the hemisphere of n and the cone of axis b and cosine c; b null: over the hemisphere.
 * sum: Fresnel's 1 - s and s apart. */
static void gtsoi_integrate(const gtsoi_integrand *g, const gtsoi_rule *rule, const double *b, double c,
                            double sum[2]) {
    GTAOI_NO_CONTRACT
    /* Where the integrand over phi has kinks: the end of the range, turns of the horizon, half-planes that touch the
     * cone or run along its edge, and those through the points where it meets the horizon. */
    double list[16], end = !b || b[1] == 0.0 ? GTAOI_PI : 2.0 * GTAOI_PI, factor = end < 4.0 ? 2.0 : 1.0;
    int count = 0, i, j;
    sum[0] = sum[1] = 0.0;
    count = gtsoi_add_break(list, count, 0.0, end);
    count = gtsoi_add_break(list, count, 0.5 * GTAOI_PI, end);
    count = gtsoi_add_break(list, count, GTAOI_PI, end);
    count = gtsoi_add_break(list, count, 1.5 * GTAOI_PI, end);
    if (b) {
        /* touching: v_m^2 + b_m^2 + 2 c v_m b_m = 1 - c^2, a sinusoid of 2 phi */
        double vx = g->v[0], p = 0.5 * (vx * vx + (b[0] * b[0] - b[1] * b[1]) + 2.0 * c * vx * b[0]);
        double q = b[0] * b[1] + c * vx * b[1];
        double m = 0.5 * (vx * vx + (b[0] * b[0] + b[1] * b[1]) + 2.0 * c * vx * b[0]) - (1.0 - c * c);
        double r = p * p + q * q, l0[3], l1[3], along, across, rho, s1, c1, sine;
        if (m * m < r) {
            double middle = 0.5 * gtsoi_atan2(q, p), half = 0.5 * gtsoi_acos(m / sqrt(r));
            count = gtsoi_add_break(list, count, middle - half, end);
            count = gtsoi_add_break(list, count, middle + half, end);
            count = gtsoi_add_break(list, count, middle - half + GTAOI_PI, end);
            count = gtsoi_add_break(list, count, middle + half + GTAOI_PI, end);
        }
        /* tangent, at R, to the circle around b through R: beside it ends turn fast where R is near the cone's edge */
        along = vx * b[2] + g->v[2] * b[0], across = g->v[2] * b[1];
        s1 = gtsoi_atan2(along, -across);
        count = gtsoi_add_break(list, count, s1, end);
        count = gtsoi_add_break(list, count, s1 + GTAOI_PI, end);
        /* on the horizon: l = (along l0 + across y) with l0 = the horizon's direction in the xz plane */
        l0[0] = g->n[2], l0[1] = 0.0, l0[2] = -g->n[0];
        along = b[0] * l0[0] + b[2] * l0[2], across = b[1];
        rho = along * along + across * across;
        if (c * c < rho) {
            rho = sqrt(rho);
            c1 = c / rho, s1 = sqrt((1.0 - c1) * (1.0 + c1));
            along /= rho, across /= rho;
            for (j = -1; j <= 1; j += 2) {
                sine = (double)j * s1;
                l1[0] = (along * c1 - across * sine) * l0[0] + g->v[0];
                l1[1] = across * c1 + along * sine;
                count = gtsoi_add_break(list, count, gtsoi_atan2(l1[1], l1[0]), end);
            }
        }
    }
    list[count] = end;
    for (i = 0; i < count; i++) {
        double from = list[i], range = list[i + 1] - list[i], panel[2];
        if (range < 1e-12)
            continue;
        for (j = 0; j < GTSOI_GAUSS; j++) {
            panel[0] = panel[1] = 0.0;
            gtsoi_half_plane(g, rule, b, c, from + range * rule->position[j], panel);
            sum[0] += rule->weight[j] * range * panel[0];
            sum[1] += rule->weight[j] * range * panel[1];
        }
    }
    sum[0] *= factor / GTAOI_PI, sum[1] *= factor / GTAOI_PI; /* D's 1 / pi */
}

static double gtsoi_lobe_visibility(const gtsoi_rule *rule, gtso_lobe lobe, gtso_frame frame, double aperture,
                                    double beta, float roughness, double f0) {
    GTAOI_NO_CONTRACT
    gtsoi_integrand g;
    double b[3], nv = 1.0, s, c, occluded[2], open[2];
    beta = gtsoi_clamp(beta, 0.0, GTAOI_PI);
    gtsoi_sincos(gtsoi_clamp(aperture, 0.0, 0.5 * GTAOI_PI), &s, &c);
    if (!(aperture > 0.0))
        return 0.0;
    if (frame == GTSO_FRAME_BENT) {
        if (c < 1e-7)
            return 1.0;
        gtsoi_sincos(gtsoi_clamp(beta, 0.0, 0.5 * GTAOI_PI), &s, &nv);
    } else if (c < 1e-7 && beta == 0.0) {
        return 1.0;
    }
    gtsoi_setup(&g, lobe, gtsoi_alpha(roughness), nv);
    if (frame == GTSO_FRAME_BENT)
        b[0] = g.n[0], b[1] = 0.0, b[2] = g.n[2];
    else
        gtsoi_place(&g, beta, 0.0, b);
    b[1] = 0.0;
    gtsoi_integrate(&g, rule, b, c, occluded);
    gtsoi_integrate(&g, rule, 0, 0.0, open);
    if (lobe == GTSO_LOBE_BRDF) {
        occluded[0] = f0 * occluded[0] + occluded[1];
        open[0] = f0 * open[0] + open[1];
    }
    return gtsoi_clamp(occluded[0] / open[0], 0.0, 1.0);
}

GTSO_API float gtso_lobe_visibility(gtso_lobe lobe, gtso_frame frame, float aperture_rad, float beta_rad,
                                    float roughness) {
    gtsoi_rule rule;
    gtsoi_make_rule(&rule);
    return (float)gtsoi_lobe_visibility(&rule, lobe, frame, (double)aperture_rad, (double)beta_rad, roughness, 0.04);
}

static double gtsoi_f0(float f0) {
    return gtsoi_clamp((double)f0, 0.0, 1.0);
}

/* V_s of the full BRDF; b in the integrand's frame. */
static double gtsoi_brdf_visibility(const gtsoi_integrand *g, const gtsoi_rule *rule, const double b[3],
                                    double aperture, double f0, double *occluded, double *open) {
    GTAOI_NO_CONTRACT
    double s, c, sum[2];
    gtsoi_sincos(gtsoi_clamp(aperture, 0.0, 0.5 * GTAOI_PI), &s, &c);
    gtsoi_integrate(g, rule, 0, 0.0, sum);
    *open = f0 * sum[0] + sum[1];
    if (c < 1e-7 && b[2] > 1.0 - 1e-13) { /* the whole hemisphere */
        *occluded = *open;
        return 1.0;
    }
    if (!(aperture > 0.0)) {
        *occluded = 0.0;
        return 0.0;
    }
    gtsoi_integrate(g, rule, b, c, sum);
    *occluded = f0 * sum[0] + sum[1];
    /* The integrals' own errors must not make light. */
    *occluded = gtsoi_clamp(*occluded, 0.0, *open);
    return *open > 0.0 ? *occluded / *open : 0.0;
}

static double gtsoi_dot(const double a[3], const double b[3]) {
    GTAOI_NO_CONTRACT
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* A unit vector in double: what is not finite or has no length becomes `fallback`. */
static void gtsoi_unit(const float from[3], const double fallback[3], double to[3]) {
    GTAOI_NO_CONTRACT
    double length = 0.0;
    int i;
    for (i = 0; i < 3; i++)
        length += (double)from[i] * (double)from[i];
    if (!(length > 0.0 && length < 1e200)) {
        to[0] = fallback[0], to[1] = fallback[1], to[2] = fallback[2];
        return;
    }
    length = 1.0 / sqrt(length);
    for (i = 0; i < 3; i++)
        to[i] = (double)from[i] * length;
}

/* x axis from v's part perpendicular to z, or any; y completes it. */
static void gtsoi_axes(const double z[3], const double v[3], double x[3], double y[3]) {
    GTAOI_NO_CONTRACT
    double along = gtsoi_dot(z, v), length;
    int i, k = 0;
    for (i = 0; i < 3; i++)
        x[i] = v[i] - along * z[i];
    length = gtsoi_dot(x, x);
    if (!(length > 1e-12)) {
        for (i = 1; i < 3; i++)
            if (z[i] * z[i] < z[k] * z[k])
                k = i;
        for (i = 0; i < 3; i++)
            x[i] = (i == k ? 1.0 : 0.0) - z[k] * z[i];
        length = gtsoi_dot(x, x);
    }
    length = 1.0 / sqrt(length);
    for (i = 0; i < 3; i++)
        x[i] *= length;
    y[0] = z[1] * x[2] - z[2] * x[1];
    y[1] = z[2] * x[0] - z[0] * x[2];
    y[2] = z[0] * x[1] - z[1] * x[0];
}

GTSO_API float gtso_brdf_visibility(const float normal[3], const float view[3], const float bent_normal[3],
                                    float aperture_rad, float roughness, float f0, float *occluded, float *open) {
    GTAOI_NO_CONTRACT
    static const double up[3] = {0.0, 0.0, 1.0};
    double n[3], v[3], bent[3], x[3], y[3], b[3], o, p, vs;
    gtsoi_integrand g;
    gtsoi_rule rule;
    gtsoi_make_rule(&rule);
    gtsoi_unit(normal, up, n);
    gtsoi_unit(view, n, v);
    gtsoi_unit(bent_normal, n, bent);
    gtsoi_axes(n, v, x, y);
    b[0] = gtsoi_dot(bent, x), b[1] = gtsoi_dot(bent, y), b[2] = gtsoi_dot(bent, n);
    gtsoi_setup(&g, GTSO_LOBE_BRDF, gtsoi_alpha(roughness), gtsoi_dot(n, v));
    vs = gtsoi_brdf_visibility(&g, &rule, b, (double)aperture_rad, gtsoi_f0(f0), &o, &p);
    if (occluded)
        *occluded = (float)o;
    if (open)
        *open = (float)p;
    return (float)vs;
}

/* f n.l from n.v, n.l, n.h and v.h. */
static double gtsoi_brdf(double aa, double f0, double nv, double nl, double nh, double vh) {
    GTAOI_NO_CONTRACT
    double a1 = 1.0 - aa, d = 1.0 - a1 * nh * nh, s = gtsoi_clamp(1.0 - vh, 0.0, 1.0), ss = s * s, f;
    f = f0 + (1.0 - f0) * ss * ss * s;
    f = f * aa / (GTAOI_PI * d * d) * nl;
    return f * 0.5 / (nl * sqrt(nv * nv * a1 + aa) + nv * sqrt(nl * nl * a1 + aa));
}

GTSO_API float gtso_brdf(const float normal[3], const float view[3], const float light[3], float roughness, float f0) {
    GTAOI_NO_CONTRACT
    static const double up[3] = {0.0, 0.0, 1.0};
    double n[3], v[3], l[3], h[3], nv, nl, length, alpha = gtsoi_alpha(roughness);
    int i;
    gtsoi_unit(normal, up, n);
    gtsoi_unit(view, n, v);
    gtsoi_unit(light, n, l);
    nv = gtsoi_dot(n, v), nl = gtsoi_dot(n, l);
    for (i = 0; i < 3; i++)
        h[i] = v[i] + l[i];
    length = gtsoi_dot(h, h);
    if (!(nv > 0.0) || !(nl > 0.0) || !(length > 0.0))
        return 0.0f;
    length = 1.0 / sqrt(length);
    return (float)gtsoi_brdf(alpha * alpha, gtsoi_f0(f0), nv, nl, gtsoi_clamp(gtsoi_dot(n, h) * length, 0.0, 1.0),
                             gtsoi_dot(v, h) * length);
}

/* ---- horizons ---------------------------------------------------------------------------------------------------- */

/* Directions at the angle 2x from v in the half-plane of azimuth phi around v have half vectors at the angle x in the
 * same half-plane: the lobe peaks at x = nu, the angle of the projected normal. Integral over 0 <= x <= limit. */
static double gtsoi_horizon_arc(const gtsoi_rule *rule, double aa, double f0, double nz, double ne, double nm,
                                double limit) {
    GTAOI_NO_CONTRACT
    double nu = gtsoi_atan2(ne, nz), width = sqrt(aa + nm * nm), sum = 0.0, end, top = 0.5 * nu + 0.25 * GTAOI_PI;
    int i, side;
    limit = limit < top ? limit : top; /* n.l > 0: 2x < nu + pi/2 */
    for (side = 0; side < 2; side++) {
        /* x = nu -+ width y / (1 - y) */
        double lo = side ? -nu : nu, hi, y0, y1;
        end = side ? limit - nu : nu - limit;
        hi = side ? end : nu;
        lo = side ? (lo > 0.0 ? lo : 0.0) : (end > 0.0 ? end : 0.0);
        if (!(hi > lo))
            continue;
        y0 = lo / (width + lo), y1 = hi / (width + hi);
        for (i = 0; i < GTSOI_GAUSS; i++) {
            double y = y0 + (y1 - y0) * rule->x[i], q = 1.0 / (1.0 - y), x = width * y * q, s, c, nl;
            x = side ? nu + x : nu - x;
            gtsoi_sincos(x, &s, &c);
            nl = nz * (c * c - s * s) + 2.0 * ne * s * c;
            if (nl > 0.0) /* dl = sin 2x d2x dphi = 4 sin x cos x dx dphi */
                sum += rule->w[i] * (y1 - y0) * width * q * q * 4.0 * s * c *
                       gtsoi_brdf(aa, f0, nz, nl, gtsoi_clamp(nz * c + ne * s, 0.0, 1.0), c);
        }
    }
    return sum;
}

GTSO_API float gtso_horizon_visibility(const float normal[3], const float view[3], const gtso_slice *slices, int count,
                                       float roughness, float f0, float *occluded, float *open) {
    GTAOI_NO_CONTRACT
    static const double up[3] = {0.0, 0.0, 1.0};
    double n[3], v[3], x[3], y[3], second[3], nx, ny, nz, nr, k, alpha = gtsoi_alpha(roughness), aa = alpha * alpha;
    double visible = 0.0, whole = 0.0, azimuth, f = gtsoi_f0(f0);
    gtsoi_rule rule;
    int i, j, p;
    if (occluded)
        *occluded = 0.0f;
    if (open)
        *open = 0.0f;
    if (!slices || count < 1)
        return 0.0f;
    gtsoi_make_rule(&rule);
    gtsoi_unit(normal, up, n);
    gtsoi_unit(view, n, v);
    gtsoi_unit(slices[0].direction, n, second);
    gtsoi_axes(v, second, x, y);
    if (count > 1) { /* azimuth grows from slice to slice */
        gtsoi_unit(slices[1].direction, y, second);
        if (gtsoi_dot(second, y) < 0.0)
            for (i = 0; i < 3; i++)
                y[i] = -y[i];
    }
    nz = gtsoi_clamp(gtsoi_dot(n, v), GTSOI_FACING_MIN, 1.0);
    nx = gtsoi_dot(n, x), ny = gtsoi_dot(n, y);
    nr = sqrt((1.0 - nz) * (1.0 + nz));
    azimuth = gtsoi_atan2(ny, nx);
    k = sqrt(1.0 + nr * nr / aa); /* tan(z/2) = k tan(d/2): z crowds around the lobe's azimuth, d = 0 */
    for (i = 0; i < 2 * count; i++) {
        double middle = GTAOI_PI * (double)i / (double)count - azimuth, half = 0.5 * GTAOI_PI / (double)count, z[4];
        double limit = i < count ? (double)slices[i].h1_rad : -(double)slices[i - count].h0_rad;
        int panels = 1;
        limit = 0.5 * gtsoi_clamp(limit, 0.0, GTAOI_PI);
        while (middle > GTAOI_PI)
            middle -= 2.0 * GTAOI_PI;
        while (middle < -GTAOI_PI)
            middle += 2.0 * GTAOI_PI;
        z[0] = middle - half, z[1] = middle + half;
        if (z[0] < 0.0 && z[1] > 0.0) /* the peak within */
            z[2] = z[1], z[1] = 0.0, panels = 2;
        else if (z[1] > GTAOI_PI || z[0] < -GTAOI_PI) /* the seam within */
            z[2] = z[1], z[1] = z[0] < -GTAOI_PI ? -GTAOI_PI : GTAOI_PI, panels = 2;
        for (p = 0; p < panels; p++) {
            double turn = z[p] >= GTAOI_PI - 1e-12        ? -2.0 * GTAOI_PI
                          : z[p + 1] <= -GTAOI_PI + 1e-12 ? 2.0 * GTAOI_PI
                                                          : 0.0;
            double ends[2], s, c, step, a;
            int e, part, parts;
            for (e = 0; e < 2; e++) {
                gtsoi_sincos(0.5 * (z[p + e] + turn), &s, &c);
                ends[e] = 2.0 * gtsoi_atan2(k * s, c > 0.0 ? c : 0.0);
            }
            parts = 1 + (int)((ends[1] - ends[0]) * 1.5);
            step = (ends[1] - ends[0]) / (double)parts;
            for (part = 0; part < parts; part++)
                for (j = 0; j < GTSOI_GAUSS; j++) {
                    double d, jacobian, ne, nm, w;
                    a = ends[0] + step * ((double)part + rule.x[j]);
                    gtsoi_sincos(0.5 * a, &s, &c);
                    jacobian = k / (k * k * c * c + s * s);
                    d = 2.0 * gtsoi_atan2(s, k * c);
                    gtsoi_sincos(d, &s, &c);
                    ne = nr * c, nm = nr * s;
                    w = rule.w[j] * step * jacobian;
                    whole += w * gtsoi_horizon_arc(&rule, aa, f, nz, ne, nm, 0.5 * GTAOI_PI);
                    visible += w * gtsoi_horizon_arc(&rule, aa, f, nz, ne, nm, limit);
                }
        }
    }
    if (occluded)
        *occluded = (float)visible;
    if (open)
        *open = (float)whole;
    return whole > 0.0 ? (float)gtsoi_clamp(visible / whole, 0.0, 1.0) : 0.0f;
}

/* ---- tables ------------------------------------------------------------------------------------------------------ */

GTSO_API gtso_result gtso_table_resolve(const gtso_table_desc *desc, gtso_table_desc *resolved) {
    static const int defaults[3][GTSO_AXIS_COUNT] = {{32, 32, 32, 1, 1}, {16, 16, 16, 16, 1}, {16, 16, 16, 16, 8}};
    static const unsigned allowed[GTSO_AXIS_COUNT] = {
        1u << GTSO_SCALE_ANGLE | 1u << GTSO_SCALE_COSINE | 1u << GTSO_SCALE_HALF_SINE,
        1u << GTSO_SCALE_ANGLE | 1u << GTSO_SCALE_COSINE | 1u << GTSO_SCALE_HALF_SINE | 1u << GTSO_SCALE_EDGE,
        1u << GTSO_SCALE_ROUGHNESS | 1u << GTSO_SCALE_ALPHA,
        1u << GTSO_SCALE_ANGLE | 1u << GTSO_SCALE_COSINE | 1u << GTSO_SCALE_HALF_SINE,
        1u << GTSO_SCALE_ANGLE | 1u << GTSO_SCALE_COSINE | 1u << GTSO_SCALE_HALF_SINE};
    static const gtso_scale best[GTSO_AXIS_COUNT] = {GTSO_SCALE_ANGLE, GTSO_SCALE_EDGE, GTSO_SCALE_ROUGHNESS,
                                                     GTSO_SCALE_ANGLE, GTSO_SCALE_ANGLE};
    gtso_table_desc t;
    double count = 1.0;
    int i, axes;
    if (!desc || !resolved)
        return GTSO_ERROR_DESC;
    t = *desc;
    if ((unsigned)t.kind > GTSO_KIND_BENT)
        return GTSO_ERROR_KIND;
    if ((unsigned)t.lobe > GTSO_LOBE_PHONG)
        return GTSO_ERROR_LOBE;
    if ((unsigned)t.frame > GTSO_FRAME_REFLECTION)
        return GTSO_ERROR_FRAME;
    if ((unsigned)t.fit > GTSO_FIT_ULUDAG)
        return GTSO_ERROR_FIT;
    if ((unsigned)t.caps > GTSO_CAPS_SMOOTHSTEP)
        return GTSO_ERROR_CAPS;
    if (!(t.f0 >= 0.0f && t.f0 <= 1.0f))
        return GTSO_ERROR_F0;
    if (t.f0 == 0.0f)
        t.f0 = 0.04f;
    axes = t.kind == GTSO_KIND_BENT ? 5 : t.kind == GTSO_KIND_BRDF ? 4 : 3;
    for (i = 0; i < GTSO_AXIS_COUNT; i++) {
        if (i >= axes || t.size[i] == 0)
            t.size[i] = defaults[axes - 3][i];
        else if (t.size[i] < (i == GTSO_AXIS_AZIMUTH ? 4 : 8) || t.size[i] > 64)
            return GTSO_ERROR_TABLE_SIZE;
        count *= (double)t.size[i];
        if (i >= axes || t.scale[i] == GTSO_SCALE_DEFAULT)
            t.scale[i] = best[i];
        else if ((unsigned)t.scale[i] >= GTSO_SCALE_COUNT || !(allowed[i] >> t.scale[i] & 1u))
            return GTSO_ERROR_SCALE;
    }
    if (count > (double)GTSOI_MAX_COUNT)
        return GTSO_ERROR_TABLE_SIZE;
    *resolved = t;
    return GTSO_OK;
}

GTSO_API int gtso_table_axes(const gtso_table_desc *desc) {
    gtso_table_desc t;
    if (gtso_table_resolve(desc, &t) != GTSO_OK)
        return 0;
    return t.kind == GTSO_KIND_BENT ? 5 : t.kind == GTSO_KIND_BRDF ? 4 : 3;
}

GTSO_API int gtso_table_rows(const gtso_table_desc *desc) {
    gtso_table_desc t;
    if (gtso_table_resolve(desc, &t) != GTSO_OK)
        return 0;
    return t.size[1] * t.size[2] * t.size[3] * t.size[4];
}

GTSO_API size_t gtso_table_count(const gtso_table_desc *desc) {
    gtso_table_desc t;
    if (gtso_table_resolve(desc, &t) != GTSO_OK)
        return 0;
    return (size_t)t.size[0] * (size_t)(t.size[1] * t.size[2] * t.size[3] * t.size[4]);
}

/* Largest angle of an axis. */
static double gtsoi_axis_max(const gtso_table_desc *t, int axis) {
    if (axis == GTSO_AXIS_AZIMUTH)
        return GTAOI_PI;
    /* With n = b nothing is beyond pi/2; but a scale by distances from the cone's edge must not end at the widest
     * cone's. */
    if (axis == GTSO_AXIS_BETA &&
        (t->kind != GTSO_KIND_LOBE || t->frame != GTSO_FRAME_BENT || t->scale[axis] == GTSO_SCALE_EDGE))
        return GTAOI_PI;
    return 0.5 * GTAOI_PI;
}

/* 2 sin(a/2). */
static double gtsoi_chord(double a) {
    GTAOI_NO_CONTRACT
    double s, c;
    gtsoi_sincos(0.5 * a, &s, &c);
    return 2.0 * s;
}

static double gtsoi_angle_of_chord(double chord) {
    GTAOI_NO_CONTRACT
    double s = gtsoi_clamp(0.5 * chord, 0.0, 1.0);
    return 2.0 * gtsoi_atan2(s, sqrt((1.0 - s) * (1.0 + s)));
}

static double gtsoi_angle_coord(gtso_scale scale, double angle, double largest) {
    GTAOI_NO_CONTRACT
    double ratio;
    if (scale == GTSO_SCALE_ANGLE)
        return angle / largest;
    ratio = gtsoi_chord(angle) / gtsoi_chord(largest);
    return scale == GTSO_SCALE_COSINE ? ratio * ratio : ratio;
}

static double gtsoi_angle_at(gtso_scale scale, double u, double largest) {
    GTAOI_NO_CONTRACT
    if (scale == GTSO_SCALE_ANGLE)
        return u * largest;
    return gtsoi_angle_of_chord((scale == GTSO_SCALE_COSINE ? sqrt(u) : u) * gtsoi_chord(largest));
}

/* GTSO_SCALE_EDGE: e = chord(aperture) - chord(beta), chord(a) = 2 sin(a/2), compressed to g = e / (w + |e|) with
 * w = GTSOI_EDGE_WIDTH alpha; u = 0 where beta is largest and 1 where it is 0. */
static double gtsoi_compress(double e, double w) {
    return e / (w + (e < 0.0 ? -e : e));
}

GTSO_API void gtso_table_coords(const gtso_table_desc *desc, const gtso_point *point, float u[GTSO_AXIS_COUNT]) {
    GTAOI_NO_CONTRACT
    gtso_table_desc t;
    double angle[GTSO_AXIS_COUNT], r = gtsoi_clamp((double)point->roughness, 0.0, 1.0), out[GTSO_AXIS_COUNT];
    int i, axes;
    memset(u, 0, GTSO_AXIS_COUNT * sizeof *u);
    if (gtso_table_resolve(desc, &t) != GTSO_OK)
        return;
    axes = gtso_table_axes(&t);
    angle[0] = (double)point->aperture_rad, angle[1] = (double)point->beta_rad, angle[2] = 0.0;
    angle[3] = (double)point->view_rad, angle[4] = (double)point->azimuth_rad;
    for (i = 0; i < axes; i++) {
        angle[i] = gtsoi_clamp(angle[i], 0.0, gtsoi_axis_max(&t, i));
        out[i] = gtsoi_angle_coord(t.scale[i], angle[i], gtsoi_axis_max(&t, i));
    }
    out[2] = t.scale[2] == GTSO_SCALE_ALPHA ? r * r : r;
    if (t.scale[1] == GTSO_SCALE_EDGE) {
        double w = GTSOI_EDGE_WIDTH * gtsoi_alpha(point->roughness), a = gtsoi_chord(angle[0]);
        double lo = gtsoi_compress(a - gtsoi_chord(gtsoi_axis_max(&t, 1)), w), hi = gtsoi_compress(a, w);
        double g = gtsoi_compress(a - gtsoi_chord(angle[1]), w);
        out[1] = hi > lo ? (g - lo) / (hi - lo) : 0.0;
    }
    for (i = 0; i < axes; i++)
        u[i] = (float)gtsoi_clamp(out[i], 0.0, 1.0);
}

/* In double, for the baker. angle: all but roughness. */
static void gtsoi_point(const gtso_table_desc *t, const double u[GTSO_AXIS_COUNT], double angle[GTSO_AXIS_COUNT],
                        float *roughness) {
    GTAOI_NO_CONTRACT
    int i;
    *roughness = (float)(t->scale[2] == GTSO_SCALE_ALPHA ? sqrt(u[2]) : u[2]);
    for (i = 0; i < GTSO_AXIS_COUNT; i++)
        angle[i] = gtsoi_angle_at(t->scale[i], u[i], gtsoi_axis_max(t, i));
    if (t->scale[1] == GTSO_SCALE_EDGE) {
        double w = GTSOI_EDGE_WIDTH * gtsoi_alpha(*roughness), a = gtsoi_chord(angle[0]);
        double lo = gtsoi_compress(a - gtsoi_chord(gtsoi_axis_max(t, 1)), w), hi = gtsoi_compress(a, w);
        double g = lo + u[1] * (hi - lo);
        angle[1] = gtsoi_angle_of_chord(a - w * g / (1.0 - (g < 0.0 ? -g : g)));
        if (u[1] <= 0.0)
            angle[1] = gtsoi_axis_max(t, 1);
        if (u[1] >= 1.0)
            angle[1] = 0.0;
    }
}

GTSO_API void gtso_table_point(const gtso_table_desc *desc, const float u[GTSO_AXIS_COUNT], gtso_point *point) {
    gtso_table_desc t;
    double at[GTSO_AXIS_COUNT], angle[GTSO_AXIS_COUNT];
    int i, axes;
    memset(point, 0, sizeof *point);
    if (gtso_table_resolve(desc, &t) != GTSO_OK)
        return;
    axes = gtso_table_axes(&t);
    for (i = 0; i < GTSO_AXIS_COUNT; i++)
        at[i] = i < axes ? gtsoi_clamp((double)u[i], 0.0, 1.0) : 0.0;
    gtsoi_point(&t, at, angle, &point->roughness);
    point->aperture_rad = (float)angle[0], point->beta_rad = (float)angle[1];
    point->view_rad = (float)angle[3], point->azimuth_rad = (float)angle[4];
}

static double gtsoi_table_exact(const gtso_table_desc *t, const gtsoi_rule *rule, const double angle[GTSO_AXIS_COUNT],
                                float roughness) {
    GTAOI_NO_CONTRACT
    gtsoi_integrand g;
    double b[3], s, c, occluded, open, aperture = angle[0];
    if (t->kind == GTSO_KIND_CONE)
        return (double)gtso_cone_visibility(t->caps, (float)aperture, gtso_lobe_aperture(t->fit, roughness),
                                            (float)angle[1]);
    if (t->kind == GTSO_KIND_LOBE)
        return gtsoi_lobe_visibility(rule, t->lobe, t->frame, aperture, angle[1], roughness, (double)t->f0);
    gtsoi_sincos(gtsoi_clamp(angle[3], 0.0, 0.5 * GTAOI_PI), &s, &c);
    gtsoi_setup(&g, GTSO_LOBE_BRDF, gtsoi_alpha(roughness), c);
    gtsoi_place(&g, gtsoi_clamp(angle[1], 0.0, GTAOI_PI), gtsoi_clamp(angle[4], 0.0, GTAOI_PI), b);
    if (t->kind == GTSO_KIND_BRDF)
        b[1] = 0.0;
    return gtsoi_brdf_visibility(&g, rule, b, aperture, (double)t->f0, &occluded, &open);
}

GTSO_API float gtso_table_exact(const gtso_table_desc *desc, const gtso_point *point) {
    gtso_table_desc t;
    gtsoi_rule rule;
    double angle[GTSO_AXIS_COUNT];
    if (gtso_table_resolve(desc, &t) != GTSO_OK)
        return 0.0f;
    gtsoi_make_rule(&rule);
    angle[0] = (double)point->aperture_rad, angle[1] = (double)point->beta_rad, angle[2] = 0.0;
    angle[3] = (double)point->view_rad, angle[4] = t.kind == GTSO_KIND_BENT ? (double)point->azimuth_rad : 0.0;
    return (float)gtsoi_table_exact(&t, &rule, angle, point->roughness);
}

GTSO_API gtso_result gtso_bake_rows(const gtso_table_desc *desc, float *data, int row_begin, int row_end,
                                    const gtso_progress *progress) {
    GTAOI_NO_CONTRACT
    gtso_table_desc t;
    gtsoi_rule rule;
    gtso_result result = gtso_table_resolve(desc, &t);
    int row, i, k, rest;
    if (result != GTSO_OK)
        return result;
    if (!data)
        return GTSO_ERROR_DATA;
    if (row_begin < 0 || row_end < row_begin || row_end > gtso_table_rows(&t))
        return GTSO_ERROR_ROWS;
    gtsoi_make_rule(&rule);
    for (row = row_begin; row < row_end; row++) {
        double u[GTSO_AXIS_COUNT], angle[GTSO_AXIS_COUNT];
        float roughness;
        for (rest = row, k = 1; k < GTSO_AXIS_COUNT; k++) {
            u[k] = t.size[k] > 1 ? (double)(rest % t.size[k]) / (double)(t.size[k] - 1) : 0.0;
            rest /= t.size[k];
        }
        for (i = 0; i < t.size[0]; i++) {
            u[0] = (double)i / (double)(t.size[0] - 1);
            gtsoi_point(&t, u, angle, &roughness);
            data[(size_t)row * (size_t)t.size[0] + (size_t)i] = (float)gtsoi_table_exact(&t, &rule, angle, roughness);
        }
        if (progress && progress->report && progress->report(progress->user, row + 1 - row_begin, row_end - row_begin))
            return GTSO_CANCELLED;
    }
    return GTSO_OK;
}

GTSO_API gtso_result gtso_bake(const gtso_table_desc *desc, float *data, const gtso_progress *progress) {
    gtso_table_desc t;
    gtso_result result = gtso_table_resolve(desc, &t);
    return result != GTSO_OK ? result : gtso_bake_rows(&t, data, 0, gtso_table_rows(&t), progress);
}

GTSO_API float gtso_table_sample(const gtso_table_desc *desc, const float *data, const gtso_point *point) {
    GTAOI_NO_CONTRACT
    gtso_table_desc t;
    float u[GTSO_AXIS_COUNT], fraction[GTSO_AXIS_COUNT], value[32];
    size_t base = 0, step[GTSO_AXIS_COUNT], pitch = 1;
    int i, k, axes;
    if (gtso_table_resolve(desc, &t) != GTSO_OK)
        return 0.0f;
    axes = gtso_table_axes(&t);
    gtso_table_coords(&t, point, u);
    for (k = 0; k < axes; k++) {
        float at = u[k] * (float)(t.size[k] - 1);
        int whole = gtaoi_imin((int)at, t.size[k] - 2);
        fraction[k] = at - (float)whole;
        step[k] = pitch;
        base += (size_t)whole * pitch;
        pitch *= (size_t)t.size[k];
    }
    for (i = 0; i < 1 << axes; i++) {
        size_t at = base;
        for (k = 0; k < axes; k++)
            at += (i >> k & 1) ? step[k] : 0;
        value[i] = data[at];
    }
    for (k = 0; k < axes; k++)
        for (i = 0; i < 1 << (axes - 1 - k); i++)
            value[i] = value[2 * i] + fraction[k] * (value[2 * i + 1] - value[2 * i]);
    return value[0];
}

/* ---- environment BRDF -------------------------------------------------------------------------------------------- */

static void gtsoi_env(const gtsoi_rule *rule, double nv, double alpha, float env[2]) {
    gtsoi_integrand g;
    double sum[2];
    gtsoi_setup(&g, GTSO_LOBE_BRDF, alpha, nv);
    gtsoi_integrate(&g, rule, 0, 0.0, sum);
    env[0] = (float)sum[0], env[1] = (float)sum[1];
}

GTSO_API void gtso_env_brdf(float n_dot_v, float roughness, float env[2]) {
    gtsoi_rule rule;
    gtsoi_make_rule(&rule);
    gtsoi_env(&rule, (double)n_dot_v, gtsoi_alpha(roughness), env);
}

GTSO_API gtso_result gtso_env_bake_rows(int size_view, int size_roughness, float *data, int row_begin, int row_end,
                                        const gtso_progress *progress) {
    gtsoi_rule rule;
    int i, j;
    if (size_view < 2 || size_view > 256 || size_roughness < 2 || size_roughness > 256)
        return GTSO_ERROR_TABLE_SIZE;
    if (!data)
        return GTSO_ERROR_DATA;
    if (row_begin < 0 || row_end < row_begin || row_end > size_roughness)
        return GTSO_ERROR_ROWS;
    gtsoi_make_rule(&rule);
    for (j = row_begin; j < row_end; j++) {
        for (i = 0; i < size_view; i++)
            gtsoi_env(&rule, (double)i / (double)(size_view - 1), gtsoi_alpha((float)j / (float)(size_roughness - 1)),
                      data + 2 * ((size_t)j * (size_t)size_view + (size_t)i));
        if (progress && progress->report && progress->report(progress->user, j + 1 - row_begin, row_end - row_begin))
            return GTSO_CANCELLED;
    }
    return GTSO_OK;
}

GTSO_API void gtso_env_lookup(int size_view, int size_roughness, const float *data, float n_dot_v, float roughness,
                              float env[2]) {
    GTAOI_NO_CONTRACT
    float x = gtaoi_clamp(n_dot_v, 0.0f, 1.0f) * (float)(size_view - 1);
    float y = gtaoi_clamp(roughness, 0.0f, 1.0f) * (float)(size_roughness - 1);
    int i = gtaoi_imin((int)x, size_view - 2), j = gtaoi_imin((int)y, size_roughness - 2), k;
    const float *row0 = data + 2 * ((size_t)j * (size_t)size_view + (size_t)i), *row1 = row0 + 2 * (size_t)size_view;
    x -= (float)i, y -= (float)j;
    for (k = 0; k < 2; k++) {
        float a = row0[k] + x * (row0[k + 2] - row0[k]), b = row1[k] + x * (row1[k + 2] - row1[k]);
        env[k] = a + y * (b - a);
    }
}

/* ---- BC4 --------------------------------------------------------------------------------------------------------- */

/* The eight values of a block, 0 .. 255. */
static void gtsoi_bc4_palette(int e0, int e1, float value[8]) {
    GTAOI_NO_CONTRACT
    int i, n = e0 > e1 ? 7 : 5;
    value[0] = (float)e0, value[1] = (float)e1;
    for (i = 1; i < n; i++)
        value[i + 1] = (float)(e0 * (n - i) + e1 * i) / (float)n;
    if (n == 5)
        value[6] = 0.0f, value[7] = 255.0f;
}

/* Squared error with these ends, and each texel's nearest value. */
static float gtsoi_bc4_fit(const float texel[16], int e0, int e1, float limit, uint8_t code[16]) {
    GTAOI_NO_CONTRACT
    float value[8], error = 0.0f;
    int i, k;
    gtsoi_bc4_palette(e0, e1, value);
    for (i = 0; i < 16 && error < limit; i++) {
        float best = 1e30f;
        for (k = 0; k < 8; k++) {
            float d = texel[i] - value[k];
            if (d * d < best)
                best = d * d, code[i] = (uint8_t)k;
        }
        error += best;
    }
    return error;
}

GTSO_API void gtso_bc4_encode_block(const float texels[16], uint8_t block[8]) {
    GTAOI_NO_CONTRACT
    float texel[16], best = 1e30f, error;
    uint8_t code[16], chosen[16];
    uint64_t bits = 0;
    int i, mode, a, b, best0 = 0, best1 = 0;
    memset(chosen, 0, sizeof chosen);
    memset(code, 0, sizeof code);
    for (i = 0; i < 16; i++)
        texel[i] = 255.0f * gtaoi_clamp(texels[i], 0.0f, 1.0f);
    /* Both modes; ends from the extremes (mode 1: of what 0 and 255 do not cover), moved a little either way, more
     * where the values between lie further apart. */
    for (mode = 0; mode < 2; mode++) {
        float lo = 255.0f, hi = 0.0f;
        int low, high, step;
        for (i = 0; i < 16; i++) {
            if (mode == 1 && (texel[i] < 2.0f || texel[i] > 253.0f))
                continue;
            lo = gtaoi_min(lo, texel[i]), hi = gtaoi_max(hi, texel[i]);
        }
        if (lo > hi)
            lo = hi = 128.0f;
        low = (int)(lo + 0.5f), high = (int)(hi + 0.5f);
        step = 1 + (high - low) / 48;
        for (a = -1; a <= 4; a++)
            for (b = -1; b <= 4; b++) {
                int e0 = gtaoi_imin(gtaoi_imax(low + a * step, 0), 255),
                    e1 = gtaoi_imin(gtaoi_imax(high - b * step, 0), 255);
                if (mode == 0 ? e0 >= e1 : e0 > e1)
                    continue;
                error = mode == 0 ? gtsoi_bc4_fit(texel, e1, e0, best, code) : gtsoi_bc4_fit(texel, e0, e1, best, code);
                if (error < best) {
                    best = error;
                    best0 = mode == 0 ? e1 : e0, best1 = mode == 0 ? e0 : e1;
                    memcpy(chosen, code, sizeof chosen);
                }
            }
    }
    block[0] = (uint8_t)best0, block[1] = (uint8_t)best1;
    for (i = 0; i < 16; i++)
        bits |= (uint64_t)chosen[i] << (3 * i);
    for (i = 0; i < 6; i++)
        block[2 + i] = (uint8_t)(bits >> (8 * i) & 255u);
}

GTSO_API void gtso_bc4_decode_block(const uint8_t block[8], float texels[16]) {
    GTAOI_NO_CONTRACT
    float value[8];
    uint64_t bits = 0;
    int i;
    gtsoi_bc4_palette(block[0], block[1], value);
    for (i = 0; i < 6; i++)
        bits |= (uint64_t)block[2 + i] << (8 * i);
    for (i = 0; i < 16; i++)
        texels[i] = value[bits >> (3 * i) & 7u] / 255.0f;
}

/* ---- lookup ------------------------------------------------------------------------------------------------------ */

/* A checked description, its defaults resolved. */
typedef struct gtsoi_lookup {
    gtso_lookup_desc d;
    gtso_table_desc t;
    int axes, fade;
    float view[3];
    float largest[GTSO_AXIS_COUNT];    /* chord of the largest angle, 2 sin(largest / 2) */
    float per_radian[GTSO_AXIS_COUNT]; /* 1 / largest angle */
    float inv_fade;
} gtsoi_lookup;

static gtso_result gtsoi_check_lookup(const gtso_lookup_desc *desc, gtsoi_lookup *l) {
    gtso_lookup_desc *d = &l->d;
    gtso_result result;
    int i;
    if (!desc)
        return GTSO_ERROR_DESC;
    memset(l, 0, sizeof *l);
    *d = *desc;
    if (d->width < 1 || d->width > 32768 || d->height < 1 || d->height > 32768)
        return GTSO_ERROR_SIZE;
    result = gtso_table_resolve(d->table, &l->t);
    if (result != GTSO_OK)
        return result;
    if (!d->data)
        return GTSO_ERROR_DATA;
    if (!d->visibility || !gtaoi_stride_ok(d->visibility_stride, d->width * 4, 4))
        return GTSO_ERROR_VISIBILITY;
    if ((unsigned)d->weighting > GTAO_WEIGHTING_UNIFORM)
        return GTSO_ERROR_WEIGHTING;
    if (!d->visibility_stride)
        d->visibility_stride = (ptrdiff_t)d->width * 4;
#define GTSOI_VECTORS(pointer, stride, components, error)                                                              \
    d->components = d->components == 0 ? 3 : d->components;                                                            \
    if ((d->components != 3 && d->components != 4) || !gtaoi_stride_ok(d->stride, d->width * d->components * 4, 4))    \
        return error;                                                                                                  \
    if (!d->stride)                                                                                                    \
    d->stride = (ptrdiff_t)d->width * d->components * 4
    if (!d->bent_normals)
        return GTSO_ERROR_BENT;
    GTSOI_VECTORS(bent_normals, bent_stride, bent_components, GTSO_ERROR_BENT);
    if (!d->normals)
        return GTSO_ERROR_NORMALS;
    GTSOI_VECTORS(normals, normal_stride, normal_components, GTSO_ERROR_NORMALS);
    GTSOI_VECTORS(views, view_stride, view_components, GTSO_ERROR_VIEWS);
#undef GTSOI_VECTORS
    for (i = 0; i < 3; i++) {
        if (!gtaoi_finite(d->view[i]))
            return GTSO_ERROR_VIEWS;
        l->view[i] = d->view[i];
    }
    if (l->view[0] == 0.0f && l->view[1] == 0.0f && l->view[2] == 0.0f)
        l->view[2] = -1.0f;
    if (!gtaoi_stride_ok(d->roughness_stride, d->width * 4, 4) ||
        !(d->constant_roughness >= 0.0f && d->constant_roughness <= 1.0f))
        return GTSO_ERROR_ROUGHNESS;
    if (!d->roughness_stride)
        d->roughness_stride = (ptrdiff_t)d->width * 4;
    if (!(d->fade_begin >= 0.0f && d->fade_begin <= d->fade_end && d->fade_end <= 1.0f))
        return GTSO_ERROR_FADE;
    if (!d->output || !gtaoi_stride_ok(d->output_stride, d->width * 4, 4))
        return GTSO_ERROR_OUTPUT;
    if (!d->output_stride)
        d->output_stride = (ptrdiff_t)d->width * 4;
    if (!gtao_isa_available(d->isa))
        return GTSO_ERROR_ISA;
    d->isa = gtaoi_resolve_isa(d->isa);
    l->axes = l->t.kind == GTSO_KIND_BENT ? 5 : l->t.kind == GTSO_KIND_BRDF ? 4 : 3;
    for (i = 0; i < GTSO_AXIS_COUNT; i++) {
        l->largest[i] = gtsoi_axis_max(&l->t, i) > 2.0 ? 2.0f : 1.41421356f;
        l->per_radian[i] = (float)(1.0 / gtsoi_axis_max(&l->t, i));
    }
    l->fade = d->fade_end > 0.0f;
    l->inv_fade = 1.0f / gtaoi_max(d->fade_end - d->fade_begin, 1e-6f);
    return GTSO_OK;
}

#define GTAOI_KERNELS GTSO_HEADER_FILENAME

#define GTAOI_W 1
#define GTAOI_NAME(x) x##_so_scalar
#define GTAOI_ATTRIBUTE
#include GTAO_HEADER_FILENAME

#if GTAOI_X86
#define GTAOI_W 4
#define GTAOI_NAME(x) x##_so_sse2
#define GTAOI_ATTRIBUTE GTAOI_TARGET("sse2")
#include GTAO_HEADER_FILENAME

#define GTAOI_W 8
#define GTAOI_NAME(x) x##_so_avx2
#define GTAOI_ATTRIBUTE GTAOI_TARGET("avx2")
#include GTAO_HEADER_FILENAME

#define GTAOI_W 16
#define GTAOI_NAME(x) x##_so_avx512
#define GTAOI_ATTRIBUTE GTAOI_TARGET("avx512f,avx512dq")
#include GTAO_HEADER_FILENAME
#endif

#if GTAOI_NEON
#define GTAOI_W 4
#define GTAOI_NAME(x) x##_so_neon
#define GTAOI_ATTRIBUTE
#include GTAO_HEADER_FILENAME
#endif

#undef GTAOI_KERNELS

static void gtsoi_rows(const gtsoi_lookup *l, int row_begin, int row_end) {
    switch (l->d.isa) {
#if GTAOI_X86
    case GTAO_ISA_SSE2:
        gtsoi_lookup_rows_so_sse2(l, row_begin, row_end);
        break;
    case GTAO_ISA_AVX2:
        gtsoi_lookup_rows_so_avx2(l, row_begin, row_end);
        break;
    case GTAO_ISA_AVX512:
        gtsoi_lookup_rows_so_avx512(l, row_begin, row_end);
        break;
#endif
#if GTAOI_NEON
    case GTAO_ISA_NEON:
        gtsoi_lookup_rows_so_neon(l, row_begin, row_end);
        break;
#endif
    default:
        gtsoi_lookup_rows_so_scalar(l, row_begin, row_end);
        break;
    }
}

GTSO_API gtso_result gtso_lookup_rows(const gtso_lookup_desc *desc, int row_begin, int row_end) {
    gtsoi_lookup l;
    gtso_result result = gtsoi_check_lookup(desc, &l);
    if (result != GTSO_OK)
        return result;
    if (row_begin < 0 || row_end < row_begin || row_end > desc->height)
        return GTSO_ERROR_ROWS;
    gtsoi_rows(&l, row_begin, row_end);
    return GTSO_OK;
}

GTSO_API gtso_result gtso_lookup(const gtso_lookup_desc *desc) {
    gtsoi_lookup l;
    gtso_result result = gtsoi_check_lookup(desc, &l);
    if (result == GTSO_OK)
        gtsoi_rows(&l, 0, desc->height);
    return result;
}

GTSO_API float gtso_lookup_at(const gtso_table_desc *desc, const float *data, float visibility,
                              const float bent_normal[3], const float normal[3], const float view[3], float roughness) {
    gtso_lookup_desc d;
    float output = 0.0f;
    memset(&d, 0, sizeof d);
    d.width = d.height = 1;
    d.table = desc, d.data = data;
    d.visibility = &visibility, d.bent_normals = bent_normal, d.normals = normal, d.views = view;
    d.roughness = &roughness, d.output = &output;
    d.isa = GTAO_ISA_SCALAR;
    (void)gtso_lookup(&d);
    return output;
}

#if defined(__clang__)
#if defined(__i386__) && !defined(__SSE2_MATH__)
#pragma clang attribute pop
#endif
#elif defined(__GNUC__)
#pragma GCC pop_options
#pragma GCC diagnostic pop
#elif defined(_MSC_VER)
#pragma float_control(pop)
#endif

#endif /* GTSO_IMPLEMENTATION */
#else  /* GTAOI_W */
/* ================================================================================================================
 * KERNELS, written once, compiled for GTAOI_W lanes with the operations of gtao.h
 * ================================================================================================================ */

/* p[index], whole numbers below 2^24 as floats. */
#if GTAOI_W == 1
#define GTSOI_GATHER(p, index) ((p)[(int)(index)])
#elif GTAOI_W == 8
#define GTSOI_GATHER(p, index) _mm256_i32gather_ps(p, _mm256_cvttps_epi32(index), 4)
#elif GTAOI_W == 16
#define GTSOI_GATHER(p, index) GTAOI_NAME(gtsoi_gather)(p, index)
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wsign-conversion" /* in gcc's macro, without optimisation */
#endif
GTAOI_FI GV GTAOI_NAME(gtsoi_gather)(const float *p, GV index) {
    return _mm512_i32gather_ps(_mm512_cvttps_epi32(index), p, 4);
}
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic pop
#endif
#else
#define GTSOI_GATHER(p, index) GTAOI_NAME(gtsoi_gather)(p, index)
GTAOI_FI GV GTAOI_NAME(gtsoi_gather)(const float *p, GV index) {
    float i[4], v[4];
    GV_STORE(i, index);
    v[0] = p[(int)i[0]], v[1] = p[(int)i[1]], v[2] = p[(int)i[2]], v[3] = p[(int)i[3]];
    return GV_LOAD(v);
}
#endif

/* NaN: lo. */
GTAOI_FI GV GTAOI_NAME(gtsoi_clamp)(GV x, float lo, float hi) {
    return GV_MIN(GV_MAX(x, GV_SET(lo)), GV_SET(hi));
}

GTAOI_FI GV GTAOI_NAME(gtsoi_dot)(const GV a[3], const GV b[3]) {
    GTAOI_NO_CONTRACT
    return GV_ADD(GV_ADD(GV_MUL(a[0], b[0]), GV_MUL(a[1], b[1])), GV_MUL(a[2], b[2]));
}

/* The twin of gtao_acos, x in [-1, 1]. */
GTAOI_FI GV GTAOI_NAME(gtsoi_acos)(GV x) {
    GTAOI_NO_CONTRACT
    GV a = GV_ABS(x), p = GV_SET(-0.0012624911f);
    p = GV_ADD(GV_MUL(p, a), GV_SET(0.0066700901f));
    p = GV_ADD(GV_MUL(p, a), GV_SET(-0.0170881256f));
    p = GV_ADD(GV_MUL(p, a), GV_SET(0.0308918810f));
    p = GV_ADD(GV_MUL(p, a), GV_SET(-0.0501743046f));
    p = GV_ADD(GV_MUL(p, a), GV_SET(0.0889789874f));
    p = GV_ADD(GV_MUL(p, a), GV_SET(-0.2145988016f));
    p = GV_ADD(GV_MUL(p, a), GV_SET(1.5707963050f));
    p = GV_MUL(p, GV_SQRT(GV_SUB(GV_SET(1.0f), a)));
    return GV_SELECT(GV_LT(x, GV_SET(0.0f)), GV_SUB(GV_SET(3.14159265f), p), p);
}

/* 2 sin(a/2) from cos(a). */
GTAOI_FI GV GTAOI_NAME(gtsoi_chord)(GV cosine) {
    GTAOI_NO_CONTRACT
    return GV_SQRT(GV_MUL(GV_SET(2.0f), GV_SUB(GV_SET(1.0f), cosine)));
}

/* Coordinate of an angle, from its cosine. */
GTAOI_FI GV GTAOI_NAME(gtsoi_coord)(const gtsoi_lookup *l, int axis, GV cosine, GV chord) {
    GTAOI_NO_CONTRACT
    GV u;
    if (l->t.scale[axis] == GTSO_SCALE_ANGLE)
        return GV_MUL(GTAOI_NAME(gtsoi_acos)(cosine), GV_SET(l->per_radian[axis]));
    u = GV_DIV(chord, GV_SET(l->largest[axis]));
    return l->t.scale[axis] == GTSO_SCALE_COSINE ? GV_MUL(u, u) : u;
}

/* V_s of a group. */
GTAOI_FI GV GTAOI_NAME(gtsoi_group)(const gtsoi_lookup *l, GV visibility, const GV n[3], const GV b[3], const GV v[3],
                                    GV roughness) {
    GTAOI_NO_CONTRACT
    const GV zero = GV_SET(0.0f), one = GV_SET(1.0f), two = GV_SET(2.0f);
    GV nv = GTAOI_NAME(gtsoi_dot)(n, v), nb = GTAOI_NAME(gtsoi_dot)(n, b), bv = GTAOI_NAME(gtsoi_dot)(b, v);
    GV cos_aperture, cos_beta, aperture, beta, u[GTSO_AXIS_COUNT], fraction[GTSO_AXIS_COUNT], base = zero, value[32];
    float pitch = 1.0f, step[GTSO_AXIS_COUNT];
    int i, k, corners = 1 << l->axes;
    visibility = GTAOI_NAME(gtsoi_clamp)(visibility, 0.0f, 1.0f);
    roughness = GTAOI_NAME(gtsoi_clamp)(roughness, 0.0f, 1.0f);
    nv = GTAOI_NAME(gtsoi_clamp)(nv, 0.0f, 1.0f);
    nb = GTAOI_NAME(gtsoi_clamp)(nb, -1.0f, 1.0f);
    bv = GTAOI_NAME(gtsoi_clamp)(bv, -1.0f, 1.0f);
    if (l->d.weighting == GTAO_WEIGHTING_UNIFORM) {
        cos_aperture = GV_SUB(one, visibility);
    } else {
        GV share = visibility;
        if (!l->d.no_tilt)
            share = GV_MIN(GV_DIV(visibility, GV_MAX(nb, GV_SET(1e-6f))), one);
        cos_aperture = GV_SQRT(GV_SUB(one, share));
    }
    cos_beta = GV_SUB(GV_MUL(GV_MUL(two, nv), nb), bv); /* R.b */
    cos_beta = GTAOI_NAME(gtsoi_clamp)(cos_beta, l->largest[GTSO_AXIS_BETA] == 2.0f ? -1.0f : 0.0f, 1.0f);

    aperture = GTAOI_NAME(gtsoi_chord)(cos_aperture);
    beta = GTAOI_NAME(gtsoi_chord)(cos_beta);
    u[0] = GTAOI_NAME(gtsoi_coord)(l, 0, cos_aperture, aperture);
    u[0] = GV_SELECT(GV_LE(cos_aperture, zero), one, u[0]); /* whatever the rounding: open is open */
    u[2] = GV_MUL(roughness, roughness);
    if (l->t.scale[1] == GTSO_SCALE_EDGE) {
        GV w = GV_MUL(GV_SET((float)GTSOI_EDGE_WIDTH), GV_MAX(u[2], GV_SET((float)GTSOI_ALPHA_MIN)));
        /* (g - lo) / (hi - lo) of the three fractions lo = -rest / low, hi = aperture / high, g = e / middle */
        GV rest = GV_SUB(two, aperture), e = GV_SUB(aperture, beta);
        GV low = GV_ADD(w, rest), high = GV_ADD(w, aperture), middle = GV_ADD(w, GV_ABS(e));
        GV over = GV_MUL(GV_ADD(GV_MUL(e, low), GV_MUL(rest, middle)), high);
        GV under = GV_MUL(GV_ADD(GV_MUL(aperture, low), GV_MUL(rest, high)), middle);
        u[1] = GV_DIV(over, under);
    } else {
        u[1] = GTAOI_NAME(gtsoi_coord)(l, 1, cos_beta, beta);
    }
    if (l->t.scale[2] != GTSO_SCALE_ALPHA)
        u[2] = roughness;
    if (l->axes > 3)
        u[3] = GTAOI_NAME(gtsoi_coord)(l, 3, nv, GTAOI_NAME(gtsoi_chord)(nv));
    if (l->axes > 4) {
        /* azimuth of b around R, from n's: (n.b - (n.R)(b.R)) / (|n x R| |b x R|), n.R = n.v; 0 where it has none */
        GV across = GV_MUL(GV_SUB(one, GV_MUL(nv, nv)), GV_SUB(one, GV_MUL(cos_beta, cos_beta)));
        GV cosine = GV_DIV(GV_SUB(nb, GV_MUL(nv, cos_beta)), GV_SQRT(GV_MAX(across, GV_SET(1e-12f))));
        cosine = GV_SELECT(GV_LT(GV_SET(1e-12f), across), cosine, one);
        cosine = GTAOI_NAME(gtsoi_clamp)(cosine, -1.0f, 1.0f);
        u[4] = GTAOI_NAME(gtsoi_coord)(l, 4, cosine, GTAOI_NAME(gtsoi_chord)(cosine));
    }
    for (k = 0; k < l->axes; k++) {
        GV at = GV_MUL(GTAOI_NAME(gtsoi_clamp)(u[k], 0.0f, 1.0f), GV_SET((float)(l->t.size[k] - 1)));
        GV whole = GV_MIN(GTAOI_NAME(gtaoi_floor)(at), GV_SET((float)(l->t.size[k] - 2)));
        fraction[k] = GV_SUB(at, whole);
        base = GV_ADD(base, GV_MUL(whole, GV_SET(pitch)));
        step[k] = pitch;
        pitch *= (float)l->t.size[k];
    }
    for (i = 0; i < corners; i++) {
        float offset = 0.0f;
        for (k = 0; k < l->axes; k++)
            offset += (i >> k & 1) ? step[k] : 0.0f;
        value[i] = GTSOI_GATHER(l->d.data + (ptrdiff_t)offset, base);
    }
    for (k = 0; k < l->axes; k++)
        for (i = 0, corners /= 2; i < corners; i++)
            value[i] = GV_ADD(value[2 * i], GV_MUL(fraction[k], GV_SUB(value[2 * i + 1], value[2 * i])));
    if (l->axes > 3) /* b = n then; the texels around need not be open */
        value[0] = GV_SELECT(GV_LE(one, visibility), one, value[0]);
    value[0] = GTAOI_NAME(gtsoi_clamp)(value[0], 0.0f, 1.0f);
    if (l->fade) {
        GV x = GV_MUL(GV_SUB(roughness, GV_SET(l->d.fade_begin)), GV_SET(l->inv_fade));
        x = GTAOI_NAME(gtsoi_clamp)(x, 0.0f, 1.0f);
        x = GV_MUL(GV_MUL(x, x), GV_SUB(GV_SET(3.0f), GV_MUL(two, x)));
        value[0] = GV_ADD(one, GV_MUL(x, GV_SUB(value[0], one)));
    }
    return value[0];
}

/* Vectors of a whole group, and one float more within the caller's row. */
GTAOI_FI void GTAOI_NAME(gtsoi_vectors)(const float *from, int components, GV out[4]) {
#if GTAOI_W == 1
    (void)components;
    out[0] = from[0], out[1] = from[1], out[2] = from[2];
#else
    GTAOI_NAME(gtaoi_load4)(from, components, out);
#endif
}

GTAOI_FN void GTAOI_NAME(gtsoi_lookup_rows)(const gtsoi_lookup *l, int row_begin, int row_end) {
    const gtso_lookup_desc *d = &l->d;
    int x, y, i, width = d->width;
    for (y = row_begin; y < row_end; y++) {
#define GTSOI_ROW(pointer, stride) ((const float *)(const void *)((const char *)(pointer) + (ptrdiff_t)y * d->stride))
        const float *visibility = GTSOI_ROW(d->visibility, visibility_stride);
        const float *bent = GTSOI_ROW(d->bent_normals, bent_stride);
        const float *normal = GTSOI_ROW(d->normals, normal_stride);
        const float *view = d->views ? GTSOI_ROW(d->views, view_stride) : 0;
        const float *rough = d->roughness ? GTSOI_ROW(d->roughness, roughness_stride) : 0;
        float *out = (float *)(void *)((char *)d->output + (ptrdiff_t)y * d->output_stride);
#undef GTSOI_ROW
        for (x = 0; x < width; x += GTAOI_W) {
            const float *at[5];
            float copy[5][4 * GTAOI_W + 4], result[GTAOI_W];
            GV n[4], b[4], v[4], r = GV_SET(d->constant_roughness), value;
            int left = width - x;
            at[0] = visibility + x;
            at[1] = bent + (ptrdiff_t)x * d->bent_components;
            at[2] = normal + (ptrdiff_t)x * d->normal_components;
            at[3] = view ? view + (ptrdiff_t)x * d->view_components : 0;
            at[4] = rough ? rough + x : 0;
            if (left <= GTAOI_W && GTAOI_W > 1) { /* not past the end of the caller's rows */
                int each[5];
                each[0] = 1, each[1] = d->bent_components, each[2] = d->normal_components;
                each[3] = d->view_components, each[4] = 1;
                memset(copy, 0, sizeof copy);
                for (i = 0; i < 5; i++)
                    if (at[i]) {
                        memcpy(copy[i], at[i], (size_t)(left * each[i]) * sizeof(float));
                        at[i] = copy[i];
                    }
            }
            GTAOI_NAME(gtsoi_vectors)(at[1], d->bent_components, b);
            GTAOI_NAME(gtsoi_vectors)(at[2], d->normal_components, n);
            if (at[3])
                GTAOI_NAME(gtsoi_vectors)(at[3], d->view_components, v);
            else
                v[0] = GV_SET(l->view[0]), v[1] = GV_SET(l->view[1]), v[2] = GV_SET(l->view[2]);
            if (at[4])
                r = GV_LOAD(at[4]);
            value = GTAOI_NAME(gtsoi_group)(l, GV_LOAD(at[0]), n, b, v, r);
            if (GTAOI_W > 1 && left < GTAOI_W) {
                GV_STORE(result, value);
                memcpy(out + x, result, (size_t)left * sizeof(float));
            } else {
                GV_STORE(out + x, value);
            }
        }
    }
}

#undef GTSOI_GATHER
#endif /* GTAOI_W */
/*
This software is available under two licences; choose whichever you prefer.

------------------------------------------------------------------------------
ALTERNATIVE A - MIT License

Copyright (c) 2026 gtao.h contributors

Permission is hereby granted, free of charge, to any person obtaining a copy of
this software and associated documentation files (the "Software"), to deal in
the Software without restriction, including without limitation the rights to
use, copy, modify, merge, publish, distribute, sublicense, and/or sell copies
of the Software, and to permit persons to whom the Software is furnished to do
so, subject to the following conditions:

The above copyright notice and this permission notice shall be included in all
copies or substantial portions of the Software.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR
IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY,
FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE
AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER
LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM,
OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE
SOFTWARE.

------------------------------------------------------------------------------
ALTERNATIVE B - Public Domain (www.unlicense.org)

This is free and unencumbered software released into the public domain.

Anyone is free to copy, modify, publish, use, compile, sell, or distribute this
software, either in source code form or as a compiled binary, for any purpose,
commercial or non-commercial, and by any means.

In jurisdictions that recognize copyright laws, the author or authors of this
software dedicate any and all copyright interest in the software to the public
domain. We make this dedication for the benefit of the public at large and to
the detriment of our heirs and successors. We intend this dedication to be an
overt act of relinquishment in perpetuity of all present and future rights to
this software under copyright law.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR
IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY,
FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE
AUTHORS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN
ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM, OUT OF OR IN CONNECTION
WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE.

*/
