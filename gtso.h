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
 *     gtso_table_desc table = {0};                  // GGX lobe, 32 x 32 x 32
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
                         GTSO_LOBE_GGX = 0,      /* D(h) n.l, D of GGX [Wal07] */
                         GTSO_LOBE_BECKMANN = 1, /* D(h) n.l, Beckmann [Wal07] */
                         GTSO_LOBE_BLINN = 2,    /* D(h) n.l, Blinn-Phong, exponent p = 2 / alpha^2 - 2 */
                         GTSO_LOBE_PHONG = 3     /* (R.l)^p n.l */
} gtso_lobe;

typedef enum gtso_frame { /* where n and v are, given only the angle between b and R */
                          GTSO_FRAME_BENT =
                              0, /* n = b, so the view angle is beta: an open hemisphere gives exactly 1 */
                          GTSO_FRAME_REFLECTION = 1 /* n = v = R: a lobe of revolution about R */
} gtso_frame;

/* [J16] cone against lobe: the integral of the lobe over the cone by that over the hemisphere of n. By quadrature,
 * within 1e-5. */
GTSO_API float gtso_lobe_visibility(gtso_lobe lobe, gtso_frame frame, float aperture_rad, float beta_rad,
                                    float roughness);

/* [J16] the final definition, for any bent normal: integral of V f n.l by that of f n.l, f the full BRDF: GGX,
 * height-correlated Smith [Hei14], Schlick's Fresnel from f0. *occluded and *open (may be null) receive the two, so
 * occluded = V_s (f0 env[0] + env[1]): the white-dome identity. Unit vectors. By quadrature, within 1e-5. */
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
/* Coordinates in [0, 1] of a point, one for each axis (0 for those the kind does not have), and back. */
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

/* [Kar13] split sum: the integral of f n.l over the hemisphere is f0 env[0] + env[1]. By quadrature, within 1e-5. */
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
#endif /* GTAOI_W */
