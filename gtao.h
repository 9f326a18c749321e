#ifndef GTAOI_W
/* gtao.h - ground-truth ambient occlusion on a CPU - v0.1
 *
 * Ambient visibility and bent normals from a depth buffer (and normals, if there are any) of any camera: the horizons
 * of every pixel are searched along screen-space slices and each slice is integrated in closed form [J16, J19].
 *
 * DO THIS
 *
 *     #define GTAO_IMPLEMENTATION
 *     #include "gtao.h"
 *
 *   in one C or C++ file; include it plainly elsewhere. Or define GTAO_STATIC too, in each file that wants its own
 *   copy. C99 or C++11, <math.h>, nothing to link but libm. Compile with -ffp-contract=off if the results of your whole
 *   program shall not depend on the machine; the header guards itself.
 *
 * EXAMPLE
 *
 *     gtao_desc desc = {0};                         // zero means default, everywhere
 *     desc.width = 1920, desc.height = 1080;
 *     desc.depth = depth;                           // planar z, tightly packed; see gtao_depth_kind for others
 *     desc.normals = normals;                       // or null: derived from depth
 *     desc.camera = gtao_camera_from_fov(60.0f, 1920, 1080);
 *     desc.radius = 0.5f;                           // world units
 *     gtao_output output = {0};
 *     output.visibility = visibility;               // 1920 * 1080 floats
 *     size_t size = gtao_scratch_size(&desc);
 *     void *scratch = malloc(size);
 *     gtao_result result = gtao_compute(&desc, &output, scratch, size, NULL);
 *     if (result != GTAO_OK) puts(gtao_result_string(result));
 *
 * CONVENTIONS
 *
 *             z (into the screen)        Pixel (x, y) has its centre at (x + 0.5, y + 0.5); row 0 is the top one.
 *            /                           View space is right-handed: x right, y down, z forward.
 *           /                            Ray of a pixel: r = ((x - cx) / fx, (y - cy) / fy, 1), point P = z r.
 *          +------ x                     Normals point out of the surface: n.v > 0, v the direction to the eye.
 *          |                             Visibility: 1 open, 0 occluded. Radius and distances: world units.
 *          |                             Sky and invalid depth: visibility 1, bent normal = normal, occlude nothing.
 *          y
 *
 *   docs/conventions.md tells how to feed buffers of GL, D3D and Vulkan.
 *
 * API LEVELS
 *   1 gtao_compute: one call. gtao_frame: the next frame of a sequence, at half resolution if wanted, filtered in space
 *     and time.
 *   2 gtao_begin, gtao_prepare_rows, gtao_visibility_rows: the stages, on row ranges.
 *     gtao_share_rows, gtao_refine_begin, gtao_refine_rows: more effort where the image needs it (error_target).
 *     gtao_sweep_begin, gtao_sweep_run: the same by sweeping lines, at any radius, for baking.
 *   3 gtao_arc, gtao_arc_bent, gtao_noise_at, gtao_multi_bounce, ...: the formulas, for those who port them.
 *     gtao_output.horizons, gtao_context_constants, ...: what lies between the stages (docs/porting.md).
 *   depth, normals -> prepare (height, by noise phase) -> horizons -> integrate -> visibility, bent normals, SH
 *                  -> reduce -> prepare -> horizons -> spatial filter -> temporal filter -> upsample (docs/frames.md)
 *
 * OPTIONS (define before the implementation)
 *   GTAO_STATIC            everything static; only together with GTAO_IMPLEMENTATION
 *   GTAO_NO_SIMD           the scalar kernel only
 *   GTAO_HEADER_FILENAME   "gtao.h": how the file includes itself, once per vector width
 *
 * MEMORY
 *   No allocation, no globals, no I/O. The caller's scratch: 4 bytes a pixel for the height buffer (8 with thickness,
 *   and 8 for each further layer), its padding (1 KiB a row at most), and sample tables, 32 bytes for each of 16 noise
 *   phases (1 without noise) x slices x radius classes (4 an octave) x steps, or x pixels of the largest radius in
 *   every-pixel mode. 960x540, 1 slice of 8 steps: 5.7 bytes a pixel in all (tests/unit/test_api.c). gtao_frame's state:
 *   gtao_frame_state_size. error_target: 72 bytes a pixel more, of which 24 are touched without bent normals and
 *   harmonics, and tables of tens of megabytes, of which only the radii and levels in use are touched.
 *
 * THREADS
 *   None inside. Ranges of rows of one stage may run on any threads at once; finish gtao_prepare_rows of all rows
 *   before gtao_visibility_rows of any. Results do not depend on the split; ranges of multiples of GTAO_STRIP rows
 *   skip most (docs/performance.md).
 *
 * SIMD AND DETERMINISM
 *   Scalar, SSE2, AVX2, AVX-512 (F + DQ) and AArch64 NEON kernels are one text compiled once per width, chosen at run
 *   time or forced by desc.isa. They use correctly rounded operations only, no fused multiply-add, no libm: every
 *   kernel, compiler, optimisation level and machine gives the same bits (tests/determinism.sh). 32-bit x86 needs SSE2,
 *   which gcc is told to use here. Do not compile with -ffast-math; do not run with denormals flushed if bits must
 *   agree.
 *
 * ACCURACY (tests/reference/test_accuracy.c)
 *   Open planes, any tilt and field of view, any number of slices: visibility exactly 1, bent normal = normal.
 *   Grooves, pits and walls against their closed forms, 64 slices, every pixel: within 0.005.
 *   Against brute force in double precision on rendered scenes, 32 slices, every pixel: RMSE 0.0003 to 0.007, bent
 *   normals within 0.04 to 1.4 degrees at the 95th percentile. Depth and radius times 2^k: the same bits.
 *   Spherical harmonics against quadrature of the estimator, known horizons: 4e-7 (test_directional.c).
 *   Occluders with thickness: endless ones are the height field to 1e-6; slabs and grilles against their closed forms,
 *   64 slices, every pixel: RMSE below 0.003; about twice the time (tests/reference/test_arcs.c).
 *   What a depth buffer does not hold (the backs of things, what is off-screen) is the larger error by far against ray
 *   tracing: docs/accuracy.md.
 *
 * DEVIATIONS FROM THE PAPERS
 *   - The default estimator weighs slices by the Jacobian between screen angle and azimuth and divides by the same sum
 *     for an open surface; the memo's [J19] is biased off axis and noisy on tilted planes. GTAO_ESTIMATOR_MEMO is the
 *     memo's.
 *   - Horizons are searched as slopes of 1/z above the receiver's tangent plane (docs/theory.md): no position is
 *     rebuilt, and samples at whole pixels see exact planes.
 *   - Bent normals are exact off axis ([J19]'s rotation is not), whichever the estimator.
 *   - The product of visibility cone and clamped cosine ([J19] Section 4) has closed moments: gtao_sh_from_cone uses
 *     them in place of rotated and multiplied zonal harmonics; its aperture heeds the bent normal's tilt.
 *   - Noise [J16]: 96 different directions and 16 different offsets; as printed there would be 48 and 4
 *     (gtaoi_noise_memo).
 *   - Rises above the tangent plane of less than 9.8e-4 in cot h are rounding and ignored: 1e-6 in visibility.
 *   - A normal that faces away from the eye is tilted until it just faces it.
 *   - Frames [J16]: pixels are averaged by their slices' share of the integral; the spatial filter tells surfaces apart
 *     by a pixel's footprint in depth rather than a tenth of it; the history's clamp never closes below the noise of one
 *     frame, and a history read between pixels counts less (docs/frames.md).
 *
 * REFERENCES
 *   [J16] Jimenez, Wu, Pesce, Jarabo: Practical real-time strategies for accurate indirect occlusion. SIGGRAPH 2016
 *         course.
 *   [J19] the same: Technical memo ATVI-TR-19-01.
 *   [B08] Bavoil, Sainz: Image-space horizon-based ambient occlusion. SIGGRAPH 2008.
 *   [TP16] HBAO+ Ultra and voxel ambient occlusion. NVIDIA, 2016.
 *
 * REVISIONS
 *   0.1 (2026-11-22) first version
 *
 * Licence: MIT or public domain, at your choice; see the end of the file.
 */
#ifndef GTAO_H
#define GTAO_H

#include <stddef.h>
#include <stdint.h>

#define GTAO_VERSION 100 /* major * 10000 + minor * 100 + patch */

#ifndef GTAO_API
#ifdef GTAO_STATIC
#if defined(__GNUC__)
#define GTAO_API static __attribute__((unused))
#else
#define GTAO_API static
#endif
#else
#define GTAO_API extern
#endif
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- results ---------------------------------------------------------------------------------------------------- */

/* One item per broken precondition; data (depth, normals, mask) never fails. */
#define GTAO_RESULTS(X)                                                                                                \
    X(GTAO_OK, "ok")                                                                                                   \
    X(GTAO_ERROR_DESC, "desc: null pointer")                                                                           \
    X(GTAO_ERROR_SIZE, "width, height: must be 1..32768")                                                              \
    X(GTAO_ERROR_DEPTH, "depth: null pointer")                                                                         \
    X(GTAO_ERROR_DEPTH_STRIDE, "depth_stride: rows overlap or are not a multiple of 4 bytes apart")                    \
    X(GTAO_ERROR_DEPTH_KIND, "depth_kind: unknown, or height with a perspective camera")                               \
    X(GTAO_ERROR_DEVICE, "device_scale, device_bias: must be finite, the scale not zero")                              \
    X(GTAO_ERROR_SKY, "sky_z: must be zero (none) or positive")                                                        \
    X(GTAO_ERROR_NORMALS,                                                                                              \
      "normal_stride, normal_components: 0 (3), 3 or 4 floats, rows apart by multiples of 4 bytes")                    \
    X(GTAO_ERROR_NORMAL_AXES, "normal_to_view, normal_axes: must be finite")                                           \
    X(GTAO_ERROR_MASK, "mask_stride: rows overlap")                                                                    \
    X(GTAO_ERROR_PROJECTION, "camera.projection: unknown")                                                             \
    X(GTAO_ERROR_FOCAL, "camera.fx, fy: must be finite and positive")                                                  \
    X(GTAO_ERROR_CENTER, "camera.cx, cy: must be finite")                                                              \
    X(GTAO_ERROR_PIXEL_SIZE, "camera.sx, sy: must be finite and positive")                                             \
    X(GTAO_ERROR_BORDER, "border: unknown")                                                                            \
    X(GTAO_ERROR_RADIUS, "radius: must not be negative or NaN")                                                        \
    X(GTAO_ERROR_FALLOFF, "falloff: must be 0..1")                                                                     \
    X(GTAO_ERROR_MAX_RADIUS, "max_radius_px: must not be negative")                                                    \
    X(GTAO_ERROR_PRESET, "preset: unknown")                                                                            \
    X(GTAO_ERROR_SLICES, "slices: must be 0 (from the preset) or 1..64")                                               \
    X(GTAO_ERROR_STEPS, "steps: must be 0 (from the preset) or 1..256")                                                \
    X(GTAO_ERROR_STEP_POWER, "step_power: must be 0 (default) or 0.25..8")                                             \
    X(GTAO_ERROR_THIN_BLEND, "thin_blend: must be 0..1")                                                               \
    X(GTAO_ERROR_ALLOWED, "tolerance: must be 0..1")                                                                   \
    X(GTAO_ERROR_THICKNESS, "thickness: must not be negative or NaN")                                                  \
    X(GTAO_ERROR_THICKNESS_MAP,                                                                                        \
      "thickness_map, thickness_stride: null, or rows overlap or are not a multiple of 4 bytes apart")                 \
    X(GTAO_ERROR_BACK, "back_stride: rows overlap or are not a multiple of 4 bytes apart")                             \
    X(GTAO_ERROR_LAYERS, "layers, layer_count: 0..8 layers, each with a depth and rows apart by multiples of 4 bytes") \
    X(GTAO_ERROR_ARCS, "thickness, thickness_map, back, layers: not with the memo estimator or thin_blend")            \
    X(GTAO_ERROR_ESTIMATOR, "estimator: unknown")                                                                      \
    X(GTAO_ERROR_WEIGHTING, "weighting: unknown")                                                                      \
    X(GTAO_ERROR_FAR,                                                                                                  \
      "far_depth, far_px: unknown, below 8 px, or not with this noise, border, every_pixel, thickness, cosines")       \
    X(GTAO_ERROR_NOISE, "noise: unknown")                                                                              \
    X(GTAO_ERROR_TARGET, "error_target: must be 0 or positive, with the memo's noise; no frame, sweep, horizons")      \
    X(GTAO_ERROR_ISA, "isa: unknown, not compiled in, or not supported by this machine")                               \
    X(GTAO_ERROR_OUTPUT, "output: null, or no buffer in it")                                                           \
    X(GTAO_ERROR_OUTPUT_FORMAT, "visibility_format: unknown")                                                          \
    X(GTAO_ERROR_OUTPUT_STRIDE,                                                                                        \
      "visibility_stride, bent_stride, bent_components, packed_stride: rows overlap or are misaligned")                \
    X(GTAO_ERROR_OUTPUT_SH, "sh_bands, sh_stride, sh_plane_stride: 0 (3), 2 or 3 bands, apart by multiples of 4 "      \
                            "bytes; of a frame: as frame.sh_bands")                                                    \
    X(GTAO_ERROR_SCRATCH, "scratch, context: null, or smaller than gtao_scratch_size()")                               \
    X(GTAO_ERROR_SWEEP, "estimator, thin_blend, thickness, back, layers, signal, horizons ..: not in a sweep")         \
    X(GTAO_ERROR_REGION, "region: must be a part of the image, or all zero")                                           \
    X(GTAO_ERROR_HORIZONS, "horizon_stride, horizon_plane: rows or planes overlap or are misaligned")                  \
    X(GTAO_ERROR_BEYOND, "beyond: needs an orthographic camera, an open border and a beyond_reach of 1..2^20")         \
    X(GTAO_ERROR_BATCH, "batch: must be 0 (4) or 1..64")                                                               \
    X(GTAO_CANCELLED, "cancelled by the progress callback")                                                            \
    X(GTAO_ERROR_MATRIX, "projection matrix: neither perspective nor orthographic")                                    \
    X(GTAO_ERROR_SIGNAL, "signal_planes: must be 0 (2), 2 or 5, planes and rows multiples of 4 bytes apart")           \
    X(GTAO_ERROR_FRAME, "frame: null pointer")                                                                         \
    X(GTAO_ERROR_REDUCTION, "reduction: unknown")                                                                      \
    X(GTAO_ERROR_SH_BANDS, "frame.sh_bands: must be 0 (no output.sh), 2 or 3, as output.sh_bands")                     \
    X(GTAO_ERROR_SPATIAL, "spatial_passes: must be 0 (1) or 1..3")                                                     \
    X(GTAO_ERROR_TOLERANCE, "depth_tolerance: must be zero (default) or finite and positive")                          \
    X(GTAO_ERROR_HISTORY, "history: unknown")                                                                          \
    X(GTAO_ERROR_MAX_HISTORY, "max_history: must be 0 (24) or 1..255")                                                 \
    X(GTAO_ERROR_CLAMP_WINDOW, "clamp_window: must be zero (default) or finite and positive")                          \
    X(GTAO_ERROR_VIEW_TO_PREVIOUS, "view_to_previous: must be finite")                                                 \
    X(GTAO_ERROR_MOTION, "motion_stride, motion_components: 0 (2), 2 or 3 floats, rows apart by multiples of 4 bytes") \
    X(GTAO_ERROR_FRAME_ARCS, "desc.back, layers: not in frames; thickness, thickness_map are")                         \
    X(GTAO_ERROR_STATE, "state, context: null, or smaller than gtao_frame_state_size()")

typedef enum gtao_result {
#define GTAOI_X(name, text) name,
    GTAO_RESULTS(GTAOI_X)
#undef GTAOI_X
        GTAO_RESULT_COUNT
} gtao_result;

/* "field: what is wrong with it", never null. */
GTAO_API const char *gtao_result_string(gtao_result result);

/* ---- input ------------------------------------------------------------------------------------------------------ */

typedef enum gtao_depth_kind {
    GTAO_DEPTH_Z = 0,        /* planar view depth z, world units; visible where z > 0 and finite */
    GTAO_DEPTH_DISTANCE = 1, /* length of the ray from the eye, world units (perspective) or z (orthographic) */
    GTAO_DEPTH_DEVICE = 2,   /* device depth d: height w = device_scale d + device_bias (1/z, or -z if orthographic) */
    GTAO_DEPTH_HEIGHT = 3    /* orthographic height towards the viewer, world units; visible where finite */
} gtao_depth_kind;

typedef enum gtao_projection { GTAO_PERSPECTIVE = 0, GTAO_ORTHOGRAPHIC = 1 } gtao_projection;

/* Pixel (x, y) has its centre at (x + 0.5, y + 0.5). P = z ((x - cx) / fx, (y - cy) / fy, 1), or (x sx, y sy, z). */
typedef struct gtao_camera {
    gtao_projection projection;
    float fx, fy;   /* perspective: focal length in pixels, > 0; fy = 0 takes fx */
    float cx, cy;   /* perspective: principal point in pixels, read only if off_center is set */
    int off_center; /* 0: the principal point is the image centre */
    float sx, sy;   /* orthographic: world units per pixel, > 0; sy = 0 takes sx */
} gtao_camera;

typedef enum gtao_border {
    GTAO_BORDER_OPEN = 0,  /* nothing outside the image occludes */
    GTAO_BORDER_CLAMP = 1, /* the edge pixel's height goes on outside, as a clamping sampler reads it */
    GTAO_BORDER_WRAP = 2   /* the image repeats: tileable maps */
} gtao_border;

typedef enum gtao_preset { /* slices x samples on each side; errors and costs: docs/accuracy.md */
                           GTAO_PRESET_MEDIUM = 0,   /* 2 x 12 */
                           GTAO_PRESET_LOW = 1,      /* 1 x 8, for use with a filter */
                           GTAO_PRESET_HIGH = 2,     /* 4 x 16 */
                           GTAO_PRESET_ULTRA = 3,    /* 8 x 32 */
                           GTAO_PRESET_REFERENCE = 4 /* 32 x every pixel */
} gtao_preset;

typedef enum gtao_estimator {
    GTAO_ESTIMATOR_NORMALIZED = 0, /* unbiased: screen-angle Jacobian, divided by the same sum for an open surface */
    GTAO_ESTIMATOR_MEMO = 1        /* the pseudo-code of [J19] to the letter, for porting and comparison */
} gtao_estimator;

typedef enum gtao_weighting { GTAO_WEIGHTING_COSINE = 0, GTAO_WEIGHTING_UNIFORM = 1 } gtao_weighting;

typedef enum gtao_noise {
    GTAO_NOISE_MEMO = 0, /* [J16] 16 directions and 4 offsets in 4x4 tiles, 6 rotations and 4 offsets over 24 frames */
    GTAO_NOISE_HILBERT = 1, /* Hilbert index of a 64x64 tile into the R2 sequence, 64 frames */
    GTAO_NOISE_NONE = 2     /* slice angles pi (k + 1/2) / slices and step offset 1/2 at every pixel */
} gtao_noise;

typedef enum gtao_far { /* what samples far from their pixel read: the depth chain of [J16], of one level */
                        GTAO_FAR_EXACT = 0,   /* the same heights as near ones */
                        GTAO_FAR_NEAREST = 1, /* 4x4 pixels as one: nearest of 2x2, twice [J16] */
                        GTAO_FAR_AVERAGE =
                            2 /* their mean, without what is more than 3/4 of the radius before the rest */
} gtao_far;

typedef enum gtao_isa {
    GTAO_ISA_AUTO = 0,
    GTAO_ISA_SCALAR = 1,
    GTAO_ISA_SSE2 = 2,
    GTAO_ISA_AVX2 = 3,
    GTAO_ISA_AVX512 = 4,
    GTAO_ISA_NEON = 5
} gtao_isa;

/* What is not computed because the result is known without it (docs/performance.md). Planes are told from cells of
 * 16x16 pixels: prepare and compute in ranges of multiples of GTAO_STRIP rows, or what they cut is computed in full. */
typedef enum gtao_skip {
    GTAO_SKIP_SKY = 1,     /* blocks of nothing but sky */
    GTAO_SKIP_OPEN = 2,    /* pixels above whose tangent plane nothing rises within the radius: visibility 1 */
    GTAO_SKIP_SECTORS = 4, /* samples in directions and at distances in which nothing can rise above it */
    GTAO_SKIP_REST = 8,    /* gtao_frame: tiles in which nothing changes, as gtao_frame_desc.no_skip */
    GTAO_SKIP_RADIUS = 16, /* blocks in which the radius projects to less than a pixel */
    GTAO_SKIP_ALL = 31
} gtao_skip;

enum { GTAO_STRIP = 16 }; /* rows that such ranges are multiples of */

#define GTAO_MAX_LAYERS 8

/* A further layer of depth, as from depth peeling: front faces, and back faces if there are any. It only casts
 * occlusion. Of the kind gtao_desc.depth_kind, sky where the layer has nothing; strides as there. */
typedef struct gtao_layer {
    const float *depth;
    ptrdiff_t depth_stride;
    const float *back; /* null: gtao_desc.thickness */
    ptrdiff_t back_stride;
} gtao_layer;

/* Everything that is read. Zero-initialise, then set what differs: zero always means the default.
 * Pointers are to row 0, the top row. Strides are bytes from a row to the one below it, may be negative (images stored
 * bottom-up), 0 = tightly packed. Float buffers need float alignment only. */
typedef struct gtao_desc {
    int width, height; /* pixels, 1..32768 */

    const float *depth; /* width x height floats, see gtao_depth_kind; NaN, inf, z <= 0 are sky */
    ptrdiff_t depth_stride;
    gtao_depth_kind depth_kind;
    float device_scale, device_bias; /* GTAO_DEPTH_DEVICE; gtao_camera_from_projection gives them */
    float sky_z;                     /* depth (z or distance) at or beyond it is sky; 0: only infinity is */

    const float *normals; /* null: derived from depth. Any length; zero or non-finite: derived at that pixel */
    ptrdiff_t normal_stride;
    int normal_components;   /* floats from one normal to the next, 0 (3), 3 or 4 */
    float normal_to_view[9]; /* row-major, applied first; all zero: identity */
    float normal_axes[3];    /* factors of x, y, z against the library's axes, applied second; 0: +1 */

    const uint8_t *mask; /* null, or 0 where no result is wanted (visibility 1); such pixels still occlude */
    ptrdiff_t mask_stride;

    gtao_camera camera;
    gtao_border border;

    float radius;      /* world units; 0: nothing is in reach; 1e30 and more, INFINITY: no bound. There is no default.
                        * Its projection in pixels, radius |r| f / z, is rounded up to a quarter of its octave for the
                        * search; what is sampled beyond the radius does not count. */
    float falloff;     /* fraction f of the radius over which occlusion fades out, [J16] conservative attenuation:
                        * weight(d) = saturate((radius - d) / (f radius)). 0: hard cutoff; the memo's is 0.25 */
    int max_radius_px; /* cap of the search in pixels; 0: the image diagonal; 32767 at most */

    gtao_preset preset;
    int slices;         /* directions per pixel, 1..64; 0: from the preset */
    int steps;          /* samples on each side of a slice, 1..256; 0: from the preset */
    int every_pixel;    /* nonzero: visit every pixel out to the radius instead of `steps` samples */
    float step_power;   /* samples lie at 1 + (radius_px - 1) ((j + offset) / steps)^power; 0: 2 */
    float error_target; /* RMSE of visibility to aim at, against endless slices and samples: effort goes where the image
                         * needs it, preset, slices, steps and every_pixel are not read (docs/performance.md). Needs
                         * GTAO_NOISE_MEMO. 0: off; below 0.01 may be out of reach, in clutter below 0.02 */
    float tolerance;    /* error of a visibility that may be traded for speed, 0..1; 0: none. What rises little above a
                       * tangent plane does not count, so bumpy ground is open ground. The visibility is never less
                       * than without it and at most this more (normalized estimator, no thin_blend, no thickness) */
    float thin_blend;   /* [J16] thickness heuristic: a sample below the horizon pulls it down by this factor; 0: off */
    /* Occluders with thickness: with any of these set, slices are integrated as unions of arcs instead of up to a
     * horizon. A sample is then a column along its view ray, from its front to its back (docs/theory.md). */
    float thickness;            /* length of the column, world units; 0 or 1e30 and more: endless, a height field */
    const float *thickness_map; /* the same per pixel of `depth`, or null; NaN and what is not positive: `thickness` */
    ptrdiff_t thickness_stride;
    const float *back; /* depth of the back faces of `depth`, of the same kind, or null; sky and invalid: `thickness` */
    ptrdiff_t back_stride;
    const gtao_layer *layers; /* further layers, to be kept until gtao_prepare_rows is done */
    int layer_count;          /* 0..GTAO_MAX_LAYERS */

    gtao_estimator estimator;
    gtao_weighting weighting;
    gtao_noise noise;
    uint32_t frame; /* selects the temporal rotation and offset of the noise */

    /* Less memory traffic for radii of hundreds of pixels, at some error: docs/frames.md. With the memo's noise, an open
     * border and `steps` only; not with thickness, thin_blend or the memo's estimator. */
    gtao_far far_depth;
    int far_px; /* samples at least so far from their pixel are far: 8 or more; 0: 32 */

    gtao_isa isa;

    unsigned no_skip; /* gtao_skip flags: what not to skip; costs time, changes no bit of the output */
} gtao_desc;

/* ---- output ----------------------------------------------------------------------------------------------------- */

typedef enum gtao_format { GTAO_FORMAT_FLOAT = 0, GTAO_FORMAT_UNORM8 = 1, GTAO_FORMAT_UNORM16 = 2 } gtao_format;

/* Everything that is written; at least one buffer. Must not overlap the input. */
typedef struct gtao_output {
    void *visibility; /* 1 open .. 0 occluded; float, or round(255 v), round(65535 v) */
    ptrdiff_t visibility_stride;
    gtao_format visibility_format;

    float *bent_normals; /* unit, view space; the fourth component, if any, receives the visibility */
    ptrdiff_t bent_stride;
    int bent_components; /* 0 (3), 3 or 4 */

    uint32_t *packed; /* gtao_pack(visibility, bent normal) */
    ptrdiff_t packed_stride;

    float *signal; /* what a filter across pixels needs, as planes: visibility; weight of the pixel's slices, which is 1
                    * on average over directions (a mean of visibilities so weighted is the estimator's over all their
                    * slices); bent normal x, y, z before normalisation: the integral of V <n, w> w over pi, whose
                    * length is 2/3 in the open (uniform weighting: of V w over 2 pi, 1/2) */
    ptrdiff_t signal_stride;       /* bytes from row to row; 0: tightly packed */
    ptrdiff_t signal_plane_stride; /* bytes from plane to plane; 0: height times signal_stride */
    int signal_planes;             /* 2, or 5 with the bent normal; 0: 2 */

    /* Spherical harmonics of visibility times cosine, view space: c_i = 1/pi int V(w) max(n.w, 0) Y_i(w) dw, i < 9, in
     * the order and scale of gtao_sh_basis. Light with coefficients L_i has irradiance pi sum c_i L_i; c_0 is 0.2820948
     * times the visibility, (c_3, c_1, c_2) 0.4886025 times the bent normal before it is normalised. Uniform weighting:
     * 1/(2 pi) int V Y_i over the hemisphere. Both estimators: with the Jacobian. docs/directional.md. */
    float *sh;                 /* coefficient i of pixel (x, y): (char *)sh + i sh_plane_stride + y sh_stride + 4 x */
    ptrdiff_t sh_stride;       /* bytes from row to row */
    ptrdiff_t sh_plane_stride; /* bytes from plane to plane; 0: height times sh_stride */
    int sh_bands;              /* 0 (3: 9 coefficients), 2 (4) or 3 */

    /* What lies between the stages, as planes of equal strides: for other uses of the horizons
     * (gtso_horizon_visibility) and for ports to compare with (docs/porting.md). Not in sweeps, which have horizon maps
     * of their own. In gtao_frame: at the filters' resolution, tiles at rest left as they are. */
    float *horizons; /* 2 planes a slice, + side at 2k, - side at 2k + 1: angle in radians from the view vector up to
                      * which everything is open or hangs free, clamped to the normal's hemisphere; not computed: pi/2 */
    uint32_t *arcs;  /* 2 planes a slice: with thickness, the sectors that are occluded above that horizon */
    float *slices;   /* 3 planes a slice: angle of the normal projected to the slice, signed; Jacobian 1 / |b_perp|^2;
                      * integral of the open slice. Not computed: 0 */
    float *surface;  /* 7 planes: unit normal as used, view space; gradient of the height on the tangent plane, per
                      * pixel; extent of the radius; its class, -1 and the others 0 where nothing is computed */
    ptrdiff_t horizon_stride; /* of all four: bytes from row to row; 0: tightly packed */
    ptrdiff_t horizon_plane;  /* bytes from plane to plane; 0: height times horizon_stride */
} gtao_output;

/* Counts, added to what is already there; a thread passes its own and sums them afterwards. Skips decide by blocks of
 * four times the kernel's lanes: what they leave out, and so samples, open and small_radius, depends on the kernel. */
typedef struct gtao_stats {
    uint64_t pixels;          /* pixels visited */
    uint64_t sky;             /* of these: skipped as sky or invalid depth, */
    uint64_t masked;          /* as masked out, */
    uint64_t small_radius;    /* because the radius projects to less than a pixel */
    uint64_t derived_normals; /* pixels whose normal came from depth */
    uint64_t samples;         /* horizon samples, all pixels */
    uint64_t sky_skipped;     /* pixels of `sky` in blocks that were not looked at */
    uint64_t radius_skipped;  /* pixels of `small_radius` in such blocks */
    uint64_t open;            /* pixels that are known to be open */
    uint64_t samples_skipped; /* of the other pixels: samples that cannot rise, not taken */
    uint64_t refined;         /* error_target: pixels of tiles that got more slices than one */
    uint64_t unchanged;       /* gtao_frame: pixels of the filters' resolution in tiles at rest, not computed anew */
} gtao_stats;

/* ---- level 1: one call ------------------------------------------------------------------------------------------ */

/* Bytes of scratch for this description, or 0 if the description is invalid (gtao_compute says why) or they are more
 * than the address space holds. */
GTAO_API size_t gtao_scratch_size(const gtao_desc *desc);

/* Visibility and bent normals of the whole image. `scratch` needs no alignment and no initialisation.
 * `stats` may be null. On an error nothing is written. */
GTAO_API gtao_result gtao_compute(const gtao_desc *desc, const gtao_output *output, void *scratch, size_t scratch_size,
                                  gtao_stats *stats);

/* ---- level 2: the stages, on row ranges ------------------------------------------------------------------------- */

/* Lives inside the scratch buffer; valid as long as that and the caller's buffers are. Read-only between stages. */
typedef struct gtao_context gtao_context;

/* Checks everything, resolves defaults, fills the sample tables: under a millisecond for most settings, tens of them
 * for many slices of every pixel. One thread. */
GTAO_API gtao_result gtao_begin(const gtao_desc *desc, const gtao_output *output, void *scratch, size_t scratch_size,
                                gtao_context **context);

/* Depth to height, rows [row_begin, row_end). Ranges may run at once on any threads; all must be done before ... */
GTAO_API void gtao_prepare_rows(const gtao_context *context, int row_begin, int row_end);

/* ... horizons, integration and output, rows [row_begin, row_end), again in any order on any threads. */
GTAO_API void gtao_visibility_rows(const gtao_context *context, int row_begin, int row_end, gtao_stats *stats);

/* With error_target set, gtao_visibility_rows is the first of these stages, to be finished one before the other, and
 * gtao_share_rows writes the output:
 *   gtao_visibility_rows  one slice of 24 samples a pixel
 *   gtao_share_rows       neighbours on one surface share their slices: the first result, with an estimate of its error
 *   gtao_refine_begin     one thread: further slices for the tiles in which they take off most error for their time,
 *                         till the target is met
 *   gtao_refine_rows      ... computes these, which join the first
 *   gtao_share_rows       ... and these tiles' results
 * For a time budget: `most` is what may be spent, in times of what gtao_visibility_rows took (0: no limit); a target of
 * 1e-6 with it gives the least error within it. When time is up, gtao_refine_rows may be left out for the rest of the
 * rows; gtao_share_rows is due for all. gtao_refine_begin returns what gtao_refine_rows will take, in the same unit; 0:
 * nothing is left to do. Ranges are rounded up to multiples of 4 rows. */
GTAO_API void gtao_share_rows(const gtao_context *context, int row_begin, int row_end);
GTAO_API float gtao_refine_begin(gtao_context *context, float most);
GTAO_API void gtao_refine_rows(const gtao_context *context, int row_begin, int row_end, gtao_stats *stats);

GTAO_API int gtao_desc_slices(const gtao_desc *desc); /* directions per pixel that a description stands for */
/* What was resolved: the preset's slices and steps, the kernel in use. */
GTAO_API int gtao_context_slices(const gtao_context *context);
GTAO_API int gtao_context_steps(const gtao_context *context); /* 0: every pixel */
GTAO_API gtao_isa gtao_context_isa(const gtao_context *context);
GTAO_API const char *gtao_isa_name(gtao_isa isa); /* "scalar", "sse2", ... */
GTAO_API int gtao_isa_available(gtao_isa isa);    /* compiled in and supported here */

/* ---- what a port needs: constants, tables and heights of a context (docs/porting.md) ------------------------------ */

/* Everything that the kernels take from a description, resolved: I(integer) F(float) V(floats, how many). Meanings:
 * docs/porting.md. */
/* clang-format off */
#define GTAO_CONSTANTS(I, F, V)                                                                                        \
    I(width) I(height) I(depth_kind) I(border) I(estimator) I(weighting) I(noise) I(frame) I(orthographic)             \
    I(bounded) I(every_pixel) I(arcs) I(clip) I(cosines) I(layers) I(slices) I(steps) I(period) I(classes)             \
    I(class_base) F(radius) F(falloff) F(thin_blend) F(step_power) F(extent_min) F(extent_max) F(max_radius) F(bx1)    \
    F(by1) F(cx) F(cy) F(unit) F(reach) F(inner2) F(inv_falloff) F(w_scale) F(w_bias) F(w_numerator) F(w_far)          \
    F(w_max) F(z_sky) V(to_view, 9) F(same_surface) F(connect) F(thickness) F(weight_scale) F(sky) F(sky_limit)        \
    F(ray_limit) F(w_min) F(ortho_limit) F(kappa_limit) F(rise_min) F(facing_min) F(arc_limit) I(sectors)
/* clang-format on */

typedef struct gtao_constants {
#define GTAOI_I(name) int name;
#define GTAOI_F(name) float name;
#define GTAOI_V(name, count) float name[count];
    GTAO_CONSTANTS(GTAOI_I, GTAOI_F, GTAOI_V)
} gtao_constants;
GTAO_API void gtao_context_constants(const gtao_context *context, gtao_constants *constants);

/* Slice k of the pixels of a phase of the noise, 0 <= phase < period^2: unit screen direction (dx, dy), the same in
 * units of the ray r, its square. Noise of every pixel its own (GTAO_NOISE_HILBERT): not here. */
typedef struct gtao_direction {
    float dx, dy, bx, by, bb;
} gtao_direction;
GTAO_API gtao_direction gtao_context_direction(const gtao_context *context, int phase, int k);

/* Sample of the + side; the - side's is at (-qx, -qy). In every-pixel mode ux is the weight of the second of two taps,
 * one pixel further across the slice. */
typedef struct gtao_tap {
    int qx, qy;
    float inv_length, ux, uy; /* 1 / |q|, q / |q| */
} gtao_tap;
/* How many samples a side has; they are written to `taps` unless that is null. */
GTAO_API int gtao_context_taps(const gtao_context *context, int phase, int k, int radius_class, gtao_tap *taps);

/* Row y of the heights (or of the backs of the occluders) of a layer, 0 the first, after gtao_prepare_rows. */
GTAO_API void gtao_context_heights(const gtao_context *context, int layer, int back, int y, float *row);

/* The vector o of slice k at pixel (x, y): unit length, perpendicular to the view vector v. The slice's directions are
 * cos(h) v +- sin(h) o; horizons are such h. */
GTAO_API void gtao_context_slice(const gtao_context *context, int x, int y, int k, float o[3], float v[3]);

/* ---- frames: half resolution, denoising in space and time, upsampling ------------------------------------------- */

/* [J16] one slice a pixel, 16 directions over the pixels of a 4x4 window, 6 rotations and 4 offsets over 24 frames:
 *   depth, normals -> reduce -> prepare -> horizons -> spatial filter -> temporal filter -> upsample -> output
 * Everything that outlives a frame is in one block of the caller's memory, the state. */

typedef enum gtao_reduction { /* of a block of 2x2 pixels to one at half resolution */
                              GTAO_REDUCE_NEAREST = 0,
                              GTAO_REDUCE_FARTHEST = 1,
                              GTAO_REDUCE_CHECKERBOARD = 2 /* both in turn */
} gtao_reduction;

typedef enum gtao_history {
    GTAO_HISTORY_CLAMP = 0,    /* [J16] held within the low-passed neighbourhood of the new frame */
    GTAO_HISTORY_VARIANCE = 1, /* shortened where the new frame lies outside its variance: for comparison */
    GTAO_HISTORY_FREE = 2      /* neither: only disocclusion ends it */
} gtao_history;

typedef struct gtao_frame_desc {
    gtao_desc desc; /* of the frame at full resolution. Its `frame` is added to the state's count of frames */

    int half;                 /* nonzero: everything between reduce and upsample at half resolution */
    gtao_reduction reduction; /* with half */
    int upsample_normals;     /* nonzero: upsampling heeds normals, too; a little better, and dear: docs/frames.md */

    int no_spatial;        /* nonzero: no spatial filter */
    int spatial_passes;    /* 1..3; 0: 1. The first covers 4x4 pixels, the others smooth what is left */
    float depth_tolerance; /* relative difference of depth from the pixel's plane at which another's weight has fallen
                            * to zero; orthographic: difference over the radius. [J16] takes 0.1; 0: what a pixel
                            * measures at its depth, which errs less (docs/frames.md) */

    int sh_bands; /* 2 or 3: output.sh of so many bands is wanted, filtered with the same weights. Costs memory, and the
                   * filters' time two or three times again; 0: no output.sh */

    int no_temporal; /* nonzero: no history */
    gtao_history history;
    int max_history;            /* frames at rest, 1..255; 0: 24, all phases of the noise */
    float clamp_window;         /* [J16] the clamp's window is widened by this part of itself at rest; 0: 0.5 */
    float view_to_previous[12]; /* 3x4 row-major: this frame's view space to the previous one's; all zero: at rest */
    const float *motion;        /* null, or at full resolution, for each pixel, where its surface was in the previous
                                * frame: x', y' minus x, y in pixels; replaces view_to_previous. Not finite: nowhere */
    ptrdiff_t motion_stride;
    int motion_components; /* floats a pixel: 0 (2), 2, or 3: the third is the previous view depth z' minus z */
    int cut;               /* nonzero: forget the history */

    int no_skip;   /* nonzero: compute also what did not change; the results are the same */
    int unchanged; /* nonzero: camera, depth, normals, thickness_map and mask are those of the previous frame, and
                    * nothing moves. Saves reading them to find that out; ignored in the first frame */
} gtao_frame_desc;

/* Bytes of state for this description, or 0 if it is invalid. All frames of a sequence need the same size; when it or
 * any other setting than camera, buffers and motion changes, the history starts anew. */
GTAO_API size_t gtao_frame_state_size(const gtao_frame_desc *frame);

/* One frame. `state` is zero (or anything, with `cut` set) before the first. `output` as in gtao_compute, without
 * `signal`; `sh` as sh_bands says (there is gtao_sh_from_cone, too). `stats` may be null. */
GTAO_API gtao_result gtao_frame(const gtao_frame_desc *frame, const gtao_output *output, void *state, size_t state_size,
                                gtao_stats *stats);

/* The same in stages: run units [begin, end) of a stage on any threads, all of a stage before any of the next.
 *   for (s = 0; s < gtao_frame_stages(f); s++) gtao_frame_run(f, s, 0, gtao_frame_units(f, s), stats); */
typedef struct gtao_frame_context gtao_frame_context; /* inside the state, valid until the next frame begins */
GTAO_API gtao_result gtao_frame_begin(const gtao_frame_desc *frame, const gtao_output *output, void *state,
                                      size_t state_size, gtao_frame_context **context);
GTAO_API const gtao_context *gtao_frame_horizons(const gtao_frame_context *context); /* for gtao_context_slices ... */
GTAO_API int gtao_frame_stages(const gtao_frame_context *context);
GTAO_API const char *gtao_frame_stage_name(const gtao_frame_context *context, int stage); /* "reduce", "horizons" ... */
GTAO_API int gtao_frame_units(const gtao_frame_context *context, int stage);
GTAO_API void gtao_frame_run(gtao_frame_context *context, int stage, int unit_begin, int unit_end, gtao_stats *stats);

/* What lies between the stages, for those who show or compare it: planes at the resolution of the filters. Null where
 * the frame has none. */
typedef enum gtao_plane {
    GTAO_PLANE_HEIGHT = 0,     /* radius / z, orthographic -z / sx; -2^100 where there is nothing */
    GTAO_PLANE_RAW = 1,        /* visibility as integrated */
    GTAO_PLANE_WEIGHT = 2,     /* its weight, see gtao_output.signal */
    GTAO_PLANE_FILTERED = 3,   /* after the spatial filter */
    GTAO_PLANE_VISIBILITY = 4, /* after the temporal filter */
    GTAO_PLANE_LENGTH = 5      /* frames in the history */
} gtao_plane;
GTAO_API const float *gtao_frame_plane(const gtao_frame_context *context, gtao_plane plane, int *width, int *height,
                                       ptrdiff_t *stride);
/* All that a stage has just written: plane 0, 1, ... until null. `name` receives "height", "visibility", "bent.X" ...
 * Rows are *stride bytes apart. */
GTAO_API const float *gtao_frame_stage_plane(const gtao_frame_context *context, int stage, int plane, const char **name,
                                             ptrdiff_t *stride);
/* The caller's image as a context, without tables; gtao_frame_horizons is that of the filters' resolution. */
GTAO_API const gtao_context *gtao_frame_image(const gtao_frame_context *context);

/* What the filters take from a description, as GTAO_CONSTANTS. */
/* clang-format off */
#define GTAO_FRAME_CONSTANTS(I, F, V)                                                                                  \
    I(scale) I(reduction) I(spatial_passes) I(temporal) I(fresh) I(moved) I(history) I(max_history)                    \
    I(motion_components) V(window0, 5) V(window1, 5) F(tolerance_scale) F(tolerance_bias) F(clamp_window)              \
    F(clamp_noise) F(blur_cost) F(disocclusion_scale) F(disocclusion_bias) V(before, 12) F(before_fx) F(before_fy)     \
    F(before_cx) F(before_cy)
/* clang-format on */

typedef struct gtao_frame_constants {
    GTAO_FRAME_CONSTANTS(GTAOI_I, GTAOI_F, GTAOI_V)
#undef GTAOI_I
#undef GTAOI_F
#undef GTAOI_V
} gtao_frame_constants;
GTAO_API void gtao_frame_get_constants(const gtao_frame_context *context, gtao_frame_constants *constants);

/* ---- thickness --------------------------------------------------------------------------------------------------- */

/* How thick is what a depth buffer shows? An estimate for desc.thickness_map from the depth alone, world units along the
 * view ray: a thing is a third (0.35) as thick as it is wide on the screen, the lesser of row and column, and what is
 * wider than one and a half radii or reaches the edge of the image is endless (INFINITY; 0 in the sky). Fitted to ray
 * tracing and measured in docs/thickness.md; [J16] names the idea. Of `desc` camera, depth and radius are read.
 * `thickness` is width x height floats, `stride` as in gtao_desc. One thread. */
GTAO_API size_t gtao_thickness_scratch_size(const gtao_desc *desc);
GTAO_API gtao_result gtao_estimate_thickness(const gtao_desc *desc, float *thickness, ptrdiff_t stride, void *scratch,
                                             size_t scratch_size);

/* [TP16] two results to one, the cheap way to two layers: `scene` without what moves, and `all` with it. Where `moving`
 * is not zero the pixel shows what moves, and its visibility is that of `all`; elsewhere the lesser of both. Bent
 * normals, if any, 3 floats a pixel, go with the visibility that is taken. `n` pixels; the result replaces `all`. */
GTAO_API void gtao_compose_layers(size_t n, const float *scene, const float *scene_bent, const uint8_t *moving,
                                  float *all, float *all_bent);

/* ---- the sweep: horizons without a march, for baking ------------------------------------------------------------ */

/* The integral of gtao_compute in every-pixel mode. Without a radius (INFINITY) the cost per pixel and slice does not
 * depend on the size of the image: pixels within GTAO_SWEEP_NEAR are searched one by one, the rest of the line, to the
 * border of the image, by the upper hull of its heights. With a radius every sample of the line counts as in the march,
 * but tiles that lie too low are passed over; it pays from some tens of pixels on. For height maps of any kind (and any
 * other image): read are depth, normals, mask, camera, border (lines go on for one image diagonal beyond a clamped or
 * wrapped one), radius, falloff, slices (0: 32; K slices are 2 K directions, slice k at pi (k + 1/2) / K on its + side),
 * weighting and isa; ignored are steps, max_radius_px, step_power, noise and frame. Refused are the memo's estimator,
 * thin_blend, thickness, backs, layers and the signal.
 *
 *     gtao_sweep *sweep;
 *     gtao_result result = gtao_sweep_begin(&desc, &output, &options, scratch, scratch_size, &sweep);
 *     for (int phase = 0; phase < gtao_sweep_phases(sweep); phase++)
 *         for (int unit = 0; unit < gtao_sweep_units(sweep, phase); unit++)     // any order, any threads
 *             gtao_sweep_run(sweep, phase, unit, unit + 1, work_of_this_thread);
 *
 * All units of a phase must be done before any of the next. Results do not depend on order, threads, isa or batch. To
 * cancel, stop calling. */
#define GTAO_SWEEP_NEAR 4 /* pixels along the slice's longer axis */

/* What lies beyond the image on one line, so that a map larger than memory can be swept in tiles: the line leaves the
 * image at (x, y), in pixels with centres at +0.5, in the unit direction (dx, dy). Writes up to `capacity` points,
 * farthest first: distance_px from (x, y), at least 1 and at most beyond_reach, and depth in desc.depth's kind and units.
 * Returns how many. Called on whatever thread sweeps the line. A point that stands for a stretch of s pixels at d pixels
 * from a receiver, with heights within v pixels of its own, puts the cotangent of a horizon off by no more than
 * v / d + |cot h| s / d. */
typedef int (*gtao_beyond)(void *user, double x, double y, double dx, double dy, int capacity, float *distance_px,
                           float *depth);
#define GTAO_BEYOND_CAPACITY 256

/* What only the sweep takes; zero-initialise. */
typedef struct gtao_sweep_options {
    int region
        [4]; /* x0, y0, x1, y1: pixels [x0, x1) x [y0, y1) are wanted; others are not written (they still occlude).
                    * All zero: the whole image */
    float *horizons;          /* null, or horizon maps: 2 * slices planes, + side of slice k at 2k, - side at 2k + 1.
                               * Angle in radians from the view vector to the horizon, clamped to the normal's hemisphere:
                               * light from angle h in that direction arrives if h is smaller */
    ptrdiff_t horizon_stride; /* bytes from row to row, 0: tightly packed */
    ptrdiff_t horizon_plane;  /* bytes from plane to plane, 0: tightly packed */
    gtao_beyond beyond;       /* null: nothing; else orthographic with an open border */
    void *beyond_user;
    int beyond_reach; /* pixels, 1..2^20; memory: 8 bytes each */
    int batch;        /* slices held in memory at a time, 1..64; 0: 4. Costs 8 bytes a pixel each */
} gtao_sweep_options;

/* Lives inside the scratch buffer. */
typedef struct gtao_sweep gtao_sweep;

/* Bytes of scratch, and of work memory for each thread; 0 if a description is invalid. options may be null. */
GTAO_API size_t gtao_sweep_scratch_size(const gtao_desc *desc, const gtao_output *output,
                                        const gtao_sweep_options *options);
GTAO_API size_t gtao_sweep_work_size(const gtao_desc *desc, const gtao_sweep_options *options);

/* output may be null if horizon maps are wanted only. The caller's buffers are read and written until the last phase. */
GTAO_API gtao_result gtao_sweep_begin(const gtao_desc *desc, const gtao_output *output,
                                      const gtao_sweep_options *options, void *scratch, size_t scratch_size,
                                      gtao_sweep **sweep);
GTAO_API const gtao_context *gtao_sweep_context(const gtao_sweep *sweep); /* constants, directions, heights */
GTAO_API int gtao_sweep_phases(const gtao_sweep *sweep);
GTAO_API int gtao_sweep_units(const gtao_sweep *sweep, int phase);
/* Units [unit_begin, unit_end) of a phase; `work` is gtao_sweep_work_size bytes that no other thread uses meanwhile. */
GTAO_API void gtao_sweep_run(const gtao_sweep *sweep, int phase, int unit_begin, int unit_end, void *work);

/* Called now and then with the fraction done, 0..1; nonzero cancels. */
typedef int (*gtao_progress)(void *user, double done);

/* All of it on one thread; scratch as above with the work memory added: gtao_sweep_scratch_size + gtao_sweep_work_size.
 * GTAO_CANCELLED if the callback (may be null) says so: outputs are then incomplete. */
GTAO_API gtao_result gtao_sweep_compute(const gtao_desc *desc, const gtao_output *output,
                                        const gtao_sweep_options *options, void *scratch, size_t scratch_size,
                                        gtao_progress progress, void *user);

/* ---- level 3: the formulas -------------------------------------------------------------------------------------- */

/* acos of x clamped to [-1, 1], radians; and sine and cosine of a_rad in [-2 pi, 2 pi]; atan2 with |y|, |x| < 1e18.
 * Maximum errors are stated at their definitions and tested. */
GTAO_API float gtao_acos(float x);
GTAO_API void gtao_sincos(float a_rad, float *sine, float *cosine);
GTAO_API float gtao_atan2(float y, float x);

/* [J19] one side of a slice, cosine-weighted: (cos n + 2 h sin n - cos(2h - n)) / 4. Angles from the view vector,
 * signed, h in [n - pi/2, n + pi/2], n in [-pi/2, pi/2]. Both sides of an open slice add up to cos n + n sin n. */
GTAO_API float gtao_arc(float h_rad, float n_rad);
/* [J16] the same, uniformly weighted: 1 - cos h. */
GTAO_API float gtao_arc_uniform(float h_rad);
/* [J19 Eq. 20-21] integral of the visible directions of a slice, cosine-weighted: t[0] along the slice's direction
 * perpendicular to the view vector, t[1] along the view vector. h0_rad <= 0 <= h1_rad. */
GTAO_API void gtao_arc_bent(float h0_rad, float h1_rad, float n_rad, float t[2]);

/* Real, orthonormal spherical harmonics of the unit vector d, no Condon-Shortley phase, up to band 2: 0.2820948;
 * 0.4886025 (y, z, x); 1.0925484 xy, 1.0925484 yz, 0.3153916 (3 z^2 - 1), 1.0925484 xz, 0.5462742 (x^2 - y^2). */
GTAO_API void gtao_sh_basis(const float d[3], float sh[9]);
/* Coefficients of f(R^-1 w) from those of f, R row-major, a rotation or reflection: probes from world to view space. */
GTAO_API void gtao_sh_rotate(const float r[9], const float sh[9], float rotated[9]);
/* The integrand of gtao_arc times Y_i(w), w = sin(theta) o + cos(theta) v, theta from h0_rad <= 0 to h1_rad >= 0: what
 * the slice adds to gtao_output.sh before the factor 1/pi. */
GTAO_API void gtao_arc_sh(float h0_rad, float h1_rad, float n_rad, const float o[3], const float v[3], float sh[9]);

/* Cosine of the half-angle of the cone about the bent normal b that shows as much: visibility = n.b sin^2; at most a
 * right angle. */
GTAO_API float gtao_cone_cosine(float visibility, float n_dot_b);
/* [J19] Section 4: the coefficients of gtao_output.sh where that cone is all that is visible, in closed form. Unit
 * vectors. */
GTAO_API void gtao_sh_from_cone(float visibility, const float bent_normal[3], const float normal[3], float sh[9]);

/* Irradiance / pi (the light a white diffuse surface reflects) of a probe, 9 coefficients of 3 channels in view space,
 * by the coefficients of one pixel; below zero, where a band-limited probe can lead, 0. */
GTAO_API void gtao_irradiance(const float sh[9], const float probe[27], float rgb[3]);
/* The same of rows [row_begin, row_end) of what was written to output->sh; rgb_stride bytes from row to row, 0: tightly
 * packed. */
GTAO_API void gtao_irradiance_rows(const gtao_desc *desc, const gtao_output *output, const float probe[27], float *rgb,
                                   ptrdiff_t rgb_stride, int row_begin, int row_end);

/* [J16] multiple bounces: visibility and albedo in [0, 1] to the visibility that includes interreflection. */
GTAO_API float gtao_multi_bounce(float visibility, float albedo);
GTAO_API void gtao_multi_bounce_rgb(float visibility, const float albedo[3], float rgb[3]);
/* The same by the geometric series V / (1 - albedo (1 - V)): light that does not escape is reflected and sees the same
 * visibility again. No fit, and nearer to path-traced truth than the cubic (docs/accuracy.md). */
GTAO_API float gtao_multi_bounce_series(float visibility, float albedo);

/* Noise of a pixel: *direction and *offset in [0, 1). The slice angle is pi (k + direction) / slices, the sample
 * position as at gtao_desc.step_power. */
GTAO_API void gtao_noise_at(gtao_noise noise, int x, int y, uint32_t frame, float *direction, float *offset);

/* 8 bits each: visibility in the lowest, then bent normal x, y, z as round(127.5 + 127.5 c). */
GTAO_API uint32_t gtao_pack(float visibility, const float bent_normal[3]);
GTAO_API void gtao_unpack(uint32_t packed, float *visibility, float bent_normal[3]);

/* ---- cameras ---------------------------------------------------------------------------------------------------- */

/* Square pixels, centred; the vertical field of view in degrees, 0 < fov < 180. */
GTAO_API gtao_camera gtao_camera_from_fov(float fov_y_degrees, int width, int height);

typedef enum gtao_clip {
    GTAO_CLIP_ZERO_TO_ONE = 0,     /* D3D, Vulkan, Metal, GL with glClipControl: device depth = clip z / w */
    GTAO_CLIP_MINUS_ONE_TO_ONE = 1 /* GL: device depth in the buffer = (z / w + 1) / 2 */
} gtao_clip;

/* Camera, device_scale and device_bias from a 4x4 projection matrix, row-major, for column vectors (clip = M view).
 * Right- or left-handed, y up or down (clip_y_down: nonzero if clip y = -1 is the image's top row, as in Vulkan),
 * standard or reversed depth, finite or infinite far plane, perspective or orthographic, off-centre allowed. */
GTAO_API gtao_result gtao_camera_from_projection(const float m[16], gtao_clip clip, int clip_y_down, int width,
                                                 int height, gtao_camera *camera, float *device_scale,
                                                 float *device_bias);

#ifdef __cplusplus
}
#endif
#endif /* GTAO_H */

/* ================================================================================================================
 * IMPLEMENTATION
 * ================================================================================================================ */
#if defined(GTAO_IMPLEMENTATION) && !defined(GTAOI_IMPLEMENTED)
#define GTAOI_IMPLEMENTED

#include <float.h>
#include <math.h>
#include <string.h>

#ifndef GTAO_HEADER_FILENAME
#define GTAO_HEADER_FILENAME "gtao.h" /* how this file includes itself, once per vector width */
#endif

/* ---- platform --------------------------------------------------------------------------------------------------- */

#if !defined(GTAO_NO_SIMD)
#if defined(__i386__) && defined(__GNUC__) && !defined(__SSE2_MATH__)
/* Built for the x87: its intrinsics cannot be inlined where SSE does the arithmetic, so only the scalar kernel. */
#elif defined(__x86_64__) || (defined(_M_X64) && !defined(_M_ARM64EC)) || defined(__i386__) || defined(_M_IX86)
#define GTAOI_X86 1
#elif defined(__aarch64__) || defined(_M_ARM64)
#define GTAOI_NEON 1 /* 32-bit NEON flushes denormals and has no divide: it takes the scalar kernel */
#endif
#endif
#ifndef GTAOI_X86
#define GTAOI_X86 0
#endif
#ifndef GTAOI_NEON
#define GTAOI_NEON 0
#endif

#if GTAOI_X86
#if defined(_MSC_VER) && !defined(__clang__)
#include <intrin.h>
#else
#include <cpuid.h>
#endif
#include <immintrin.h>
#elif GTAOI_NEON
#include <arm_neon.h>
#endif

/* One answer everywhere: no contraction of a * b + c, no 80-bit intermediates. */
#if defined(__clang__)
#define GTAOI_NO_CONTRACT _Pragma("STDC FP_CONTRACT OFF")
#if defined(__i386__) && !defined(__SSE2_MATH__)
#pragma clang attribute push(__attribute__((target("sse2"))), apply_to = function)
#endif
#else
#define GTAOI_NO_CONTRACT
#if defined(__GNUC__)
/* False alarms from within g++'s own AVX-512 header. */
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wuninitialized"
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#pragma GCC push_options
#pragma GCC optimize("fp-contract=off", "no-tree-pre") /* PRE takes 4 % more to compile and 1 % more to run */
#if defined(__i386__)
#pragma GCC target("sse2,fpmath=sse")
#endif
#elif defined(_MSC_VER)
#pragma float_control(precise, on, push)
#pragma fp_contract(off)
#endif
#endif

#if defined(__GNUC__) || defined(__clang__)
#define GTAOI_INLINE static inline __attribute__((always_inline, unused))
#define GTAOI_TARGET(isa) __attribute__((target(isa)))
#elif defined(_MSC_VER)
#define GTAOI_INLINE static __forceinline
#define GTAOI_TARGET(isa)
#else
#define GTAOI_INLINE static inline
#define GTAOI_TARGET(isa)
#endif

/* Before a loop of few, constant rounds over arrays of vectors, which gcc -O2 otherwise keeps in memory. */
#if defined(__GNUC__) && !defined(__clang__) && __GNUC__ >= 8
#define GTAOI_UNROLL _Pragma("GCC unroll 8")
#else
#define GTAOI_UNROLL
#endif

/* The lines of n floats ahead of a stream; never faults. */
#if defined(__GNUC__) || defined(__clang__)
#define GTAOI_PREFETCH(p, n)                                                                                           \
    do {                                                                                                               \
        int gtaoi_ahead;                                                                                               \
        for (gtaoi_ahead = 0; gtaoi_ahead < (n); gtaoi_ahead += 16)                                                    \
            __builtin_prefetch((const void *)((uintptr_t)(p) + (uintptr_t)gtaoi_ahead * 4));                           \
    } while (0)
#else
#define GTAOI_PREFETCH(p, n) ((void)0)
#endif

/* ---- constants -------------------------------------------------------------------------------------------------- */

#define GTAOI_PI 3.14159265358979323846
#define GTAOI_SKY (-1.2676506e30f)        /* -2^100: height of sky and of anything invalid; rises above no plane */
#define GTAOI_SKY_LIMIT (-6.338253e29f)   /* -2^99: heights below are sky */
#define GTAOI_RAY_LIMIT 1e15f             /* of r0, so that its square is finite */
#define GTAOI_W_MIN 8.67361738e-19f       /* 2^-60: least height that is not sky, in units of 1 / radius */
#define GTAOI_W_MAX 1048576.0f            /* 2^20: greatest height */
#define GTAOI_ORTHO_LIMIT 274877906944.0f /* 2^38: orthographic heights, in pixels */
#define GTAOI_KAPPA_LIMIT 1073741824.0f   /* 2^30: cotangent of a horizon, so that products of four stay finite */
#define GTAOI_RISE_MIN                                                                                                 \
    9.765625e-4f               /* 2^-10: a rise in cot h above the tangent plane that is rounding; 1e-6 in visibility */
#define GTAOI_UNIT 4e-6f       /* a normal's squared length is so near 1: taken as it is */
#define GTAOI_FACING_MIN 1e-4f /* least n.v: a normal that faces away is tilted to the silhouette */
#define GTAOI_CLASS_SHIFT 21   /* radius classes: exponent and 2 bits of mantissa, 4 an octave */
#define GTAOI_CLASS_MASK 0xffe00000u
#define GTAOI_MAX_CLASSES 80
#define GTAOI_PAD 32           /* floats beside each row segment: samples up to 31 of them away need no care */
#define GTAOI_LANES 16         /* widest group */
#define GTAOI_CHUNK 64         /* samples whose offsets are remapped at once at clamped and wrapped borders */
#define GTAOI_NEAR 8           /* first samples in every-pixel mode whose taps also bound them from above */
#define GTAOI_CLAMP_NOISE 1.2f /* the clamp's least window, in mean changes of a pixel from frame to frame */
#define GTAOI_BLUR_COST 0.6f /* part of its length that a history loses when read in the middle of two pixels, x 1/4 */
#define GTAOI_DISOCCLUSION 0.025f  /* relative difference of depth that tells one surface from another in time */
#define GTAOI_TOLERANCE_PX 1.0f    /* the spatial filter's default, in pixel footprints */
#define GTAOI_SECTORS 32           /* of a side, for what hangs free above the horizon: bits of a mask */
#define GTAOI_ARC_LIMIT 1048576.0f /* 2^20: greatest t = (kappa - tangent) cos n, so that squares are exact in range */
#define GTAOI_SAME_SURFACE_PX 4.0f /* neighbours within so many pixel footprints in depth are one surface */
#define GTAOI_CONNECT                                                                                                  \
    1.5f /* samples of a slice are one surface within so many times that for each pixel between them */

/* ---- scalar helpers, in the papers' order ----------------------------------------------------------------------- */

GTAO_API const char *gtao_result_string(gtao_result result) {
    static const char *const text[] = {
#define GTAOI_X(name, string) string,
        GTAO_RESULTS(GTAOI_X)
#undef GTAOI_X
    };
    return (unsigned)result < (unsigned)GTAO_RESULT_COUNT ? text[result] : "unknown result";
}

/* a > b ? a : b and a < b ? a : b as in SSE: the second operand if one is NaN. */
GTAOI_INLINE float gtaoi_max(float a, float b) {
    return a > b ? a : b;
}
GTAOI_INLINE float gtaoi_min(float a, float b) {
    return a < b ? a : b;
}
GTAOI_INLINE float gtaoi_clamp(float x, float lo, float hi) {
    return gtaoi_min(gtaoi_max(x, lo), hi);
}
GTAOI_INLINE float gtaoi_abs(float a) {
    return a < 0.0f ? -a : a;
}
GTAOI_INLINE int gtaoi_imin(int a, int b) {
    return a < b ? a : b;
}
GTAOI_INLINE int gtaoi_imax(int a, int b) {
    return a > b ? a : b;
}
GTAOI_INLINE int gtaoi_finite(float x) {
    return x >= -FLT_MAX && x <= FLT_MAX;
}
GTAOI_INLINE uint32_t gtaoi_bits(float x) {
    uint32_t u;
    memcpy(&u, &x, sizeof u);
    return u;
}
GTAOI_INLINE float gtaoi_from_bits(uint32_t u) {
    float x;
    memcpy(&x, &u, sizeof x);
    return x;
}

/* sin(pi x) and cos(pi x), 0 <= x < 2, by Taylor's series on |x| <= 1/4; error below 1e-14. Sets up tables. */
static void gtaoi_sincospi(double x, double *sine, double *cosine) {
    GTAOI_NO_CONTRACT
    int quadrant = (int)(2.0 * x + 0.5), k;
    double a = GTAOI_PI * (x - 0.5 * (double)quadrant), s = 1.0, c = 1.0;
    for (k = 14; k >= 2; k -= 2) {
        s = 1.0 - s * a * a / (double)(k * (k + 1));
        c = 1.0 - c * a * a / (double)((k - 1) * k);
    }
    s *= a;
    switch (quadrant & 3) {
    case 0:
        *sine = s, *cosine = c;
        break;
    case 1:
        *sine = c, *cosine = -s;
        break;
    case 2:
        *sine = -s, *cosine = -c;
        break;
    default:
        *sine = -c, *cosine = s;
        break;
    }
}

/* x^p for 0 <= x <= 1, p > 0: 2^(p log2 x), relative error below 1e-9. Sets up tables. */
static double gtaoi_pow(double x, double p) {
    GTAOI_NO_CONTRACT
    double z, zz, log2x, y, f, e = 1.0;
    int exponent = 0, n, k;
    if (!(x > 0.0))
        return 0.0;
    if (p == 1.0)
        return x;
    if (p == 2.0)
        return x * x;
    while (x < 0.70710678118654752)
        x *= 2.0, exponent--;
    z = (x - 1.0) / (x + 1.0), zz = z * z;
    for (log2x = 0.0, k = 19; k >= 1; k -= 2)
        log2x = log2x * zz + 1.0 / (double)k;
    y = p * ((double)exponent + 2.0 * z * log2x * 1.4426950408889634);
    if (y < -60.0)
        return 0.0;
    n = -(int)(0.5 - y);
    f = (y - (double)n) * 0.69314718055994531;
    for (k = 14; k >= 1; k--)
        e = 1.0 + e * f / (double)k;
    for (; n < 0; n++)
        e *= 0.5;
    return e;
}

/* Abramowitz & Stegun 4.4.46, error 2e-8 before rounding; 3e-7 rad over [-1, 1] in float (tests/unit/test_math.c). */
GTAO_API float gtao_acos(float x) {
    GTAOI_NO_CONTRACT
    float a, p;
    x = gtaoi_clamp(x, -1.0f, 1.0f);
    a = x < 0.0f ? -x : x;
    p = -0.0012624911f;
    p = p * a + 0.0066700901f;
    p = p * a - 0.0170881256f;
    p = p * a + 0.0308918810f;
    p = p * a - 0.0501743046f;
    p = p * a + 0.0889789874f;
    p = p * a - 0.2145988016f;
    p = p * a + 1.5707963050f;
    p = p * sqrtf(1.0f - a);
    return x < 0.0f ? 3.14159265f - p : p;
}

/* Reduction to [-pi/4, pi/4] in two parts, then odd and even polynomials; error 2e-7. */
GTAO_API void gtao_sincos(float a_rad, float *sine, float *cosine) {
    GTAOI_NO_CONTRACT
    float k, r, rr, s, c, swap;
    int q;
    a_rad = gtaoi_clamp(a_rad, -100.0f, 100.0f);
    q = (int)(a_rad * 0.636619772f + (a_rad < 0.0f ? -0.5f : 0.5f));
    k = (float)q;
    r = (a_rad - k * 1.5703125f) - k * 4.83826794897e-4f;
    rr = r * r;
    s = ((-1.9515295891e-4f * rr + 8.3321608736e-3f) * rr - 1.6666654611e-1f) * rr * r + r;
    c = ((2.443315711809948e-5f * rr - 1.388731625493765e-3f) * rr + 4.166664568298827e-2f) * rr * rr - 0.5f * rr +
        1.0f;
    if (q & 1)
        swap = s, s = c, c = -swap;
    if (q & 2)
        s = -s, c = -c;
    *sine = s;
    *cosine = c;
}

/* Abramowitz & Stegun 4.4.49, error 2e-8 on [0, 1] before rounding; the kernels' twin is gtaoi_atan2. */
GTAO_API float gtao_atan2(float y, float x) {
    GTAOI_NO_CONTRACT
    float ay = y < 0.0f ? -y : y, ax = x < 0.0f ? -x : x;
    float hi, lo, q, qq, q4, p;
    ax = gtaoi_min(ax, 1e30f), ay = gtaoi_min(ay, 1e30f); /* NaN too */
    hi = gtaoi_max(ax, ay), lo = gtaoi_min(ax, ay);
    if (!(hi > 0.0f))
        return 0.0f;
    q = lo / hi;
    qq = q * q;
    q4 = qq * qq;
    p = (-0.3333314528f + qq * 0.1999355085f) + q4 * (-0.1420889944f + qq * 0.1065626393f);
    p = p + q4 * q4 * ((-0.0752896400f + qq * 0.0429096138f) + q4 * (-0.0161657367f + qq * 0.0028662257f));
    p = p * qq * q + q;
    if (ay > ax)
        p = 1.57079633f - p;
    if (x < 0.0f)
        p = 3.14159265f - p;
    return y < 0.0f ? -p : p;
}

GTAO_API float gtao_arc(float h_rad, float n_rad) {
    GTAOI_NO_CONTRACT
    float sn, cn, s2, c2;
    h_rad = gtaoi_clamp(h_rad, -7.0f, 7.0f);
    n_rad = gtaoi_clamp(n_rad, -7.0f, 7.0f);
    gtao_sincos(n_rad, &sn, &cn);
    gtao_sincos(2.0f * h_rad - n_rad, &s2, &c2);
    return 0.25f * (cn + 2.0f * h_rad * sn - c2);
}

GTAO_API float gtao_arc_uniform(float h_rad) {
    GTAOI_NO_CONTRACT
    float s, c;
    gtao_sincos(0.5f * h_rad, &s, &c);
    return 2.0f * s * s;
}

/* The printed 16 sin n and 8 cos n, as in [J19]; right as printed. */
GTAO_API void gtao_arc_bent(float h0_rad, float h1_rad, float n_rad, float t[2]) {
    GTAOI_NO_CONTRACT
    float s0n, c0n, s1n, c1n, s03, c03, s13, c13, s0p, c0p, s1p, c1p, sn, cn;
    gtao_sincos(n_rad, &sn, &cn);
    gtao_sincos(h0_rad - n_rad, &s0n, &c0n);
    gtao_sincos(h1_rad - n_rad, &s1n, &c1n);
    gtao_sincos(3.0f * h0_rad - n_rad, &s03, &c03);
    gtao_sincos(3.0f * h1_rad - n_rad, &s13, &c13);
    gtao_sincos(h0_rad + n_rad, &s0p, &c0p);
    gtao_sincos(h1_rad + n_rad, &s1p, &c1p);
    t[0] = (6.0f * s0n - s03 + 6.0f * s1n - s13 + 16.0f * sn - 3.0f * (s0p + s1p)) / 12.0f;
    t[1] = (-c03 - c13 + 8.0f * cn - 3.0f * (c0p + c1p)) / 12.0f;
}

#define GTAOI_SH0 0.28209479f  /* sqrt(1 / (4 pi)) */
#define GTAOI_SH1 0.48860251f  /* sqrt(3 / (4 pi)) */
#define GTAOI_SH2 1.09254843f  /* sqrt(15 / (4 pi)) */
#define GTAOI_SH20 0.31539157f /* sqrt(5 / (16 pi)) */

/* From moments of a function: its integral a, that of it times w, and times w w^T as xx, yy, zz, xy, yz, xz. */
static void gtaoi_sh_of_moments(float a, const float b[3], const float m[6], float sh[9]) {
    GTAOI_NO_CONTRACT
    sh[0] = GTAOI_SH0 * a;
    sh[1] = GTAOI_SH1 * b[1], sh[2] = GTAOI_SH1 * b[2], sh[3] = GTAOI_SH1 * b[0];
    sh[4] = GTAOI_SH2 * m[3], sh[5] = GTAOI_SH2 * m[4], sh[7] = GTAOI_SH2 * m[5];
    sh[6] = GTAOI_SH20 * (3.0f * m[2] - a);
    sh[8] = GTAOI_SH2 * 0.5f * (m[0] - m[1]);
}

/* m = aa a a^T + ab (a b^T + b a^T) + bb b b^T */
static void gtaoi_outer(float aa, float ab, float bb, const float a[3], const float b[3], float m[6]) {
    GTAOI_NO_CONTRACT
    int k;
    for (k = 0; k < 6; k++) {
        int i = k < 3 ? k : k == 4 ? 1 : 0, j = k < 3 ? k : k == 3 ? 1 : 2;
        m[k] = aa * a[i] * a[j] + ab * (a[i] * b[j] + b[i] * a[j]) + bb * b[i] * b[j];
    }
}

GTAO_API void gtao_sh_basis(const float d[3], float sh[9]) {
    float m[6];
    gtaoi_outer(1.0f, 0.0f, 0.0f, d, d, m);
    gtaoi_sh_of_moments(1.0f, d, m, sh);
}

/* Band 2 is a symmetric matrix S without trace, f(w) = w^T S w; rotated it is R S R^T. */
GTAO_API void gtao_sh_rotate(const float r[9], const float sh[9], float rotated[9]) {
    GTAOI_NO_CONTRACT
    float zz = 0.57735027f * sh[6], s[3][3], in[3], out[3], m[6] = {0};
    int i, j, k, l;
    in[0] = sh[3], in[1] = sh[1], in[2] = sh[2];
    s[0][0] = sh[8] - zz, s[1][1] = -sh[8] - zz, s[2][2] = 2.0f * zz; /* times 2 / GTAOI_SH2 */
    s[0][1] = s[1][0] = sh[4], s[1][2] = s[2][1] = sh[5], s[0][2] = s[2][0] = sh[7];
    for (i = 0; i < 3; i++)
        out[i] = r[3 * i] * in[0] + r[3 * i + 1] * in[1] + r[3 * i + 2] * in[2];
    for (k = 0; k < 6; k++) {
        i = k < 3 ? k : k == 4 ? 1 : 0, j = k < 3 ? k : k == 3 ? 1 : 2;
        for (l = 0; l < 3; l++)
            m[k] += r[3 * i + l] * (s[l][0] * r[3 * j] + s[l][1] * r[3 * j + 1] + s[l][2] * r[3 * j + 2]);
    }
    rotated[0] = sh[0];
    rotated[1] = out[1], rotated[2] = out[2], rotated[3] = out[0];
    rotated[4] = m[3], rotated[5] = m[4], rotated[7] = m[5];
    rotated[6] = 0.86602540f * m[2], rotated[8] = 0.5f * (m[0] - m[1]);
}

/* docs/directional.md; of the sides, s = sin |h|, c = cos h. */
GTAO_API void gtao_arc_sh(float h0_rad, float h1_rad, float n_rad, const float o[3], const float v[3], float sh[9]) {
    GTAOI_NO_CONTRACT
    float sn, cn, s0, c0, s1, c1, d, e, sss, a, to, tv, ov, vv, b[3], m[6];
    int i;
    h0_rad = gtaoi_clamp(h0_rad, -7.0f, 7.0f), h1_rad = gtaoi_clamp(h1_rad, -7.0f, 7.0f);
    gtao_sincos(n_rad, &sn, &cn);
    gtao_sincos(-h0_rad, &s0, &c0);
    gtao_sincos(h1_rad, &s1, &c1);
    d = (h1_rad - s1 * c1) + (h0_rad + s0 * c0);            /* 2 int sin^2 sgn */
    e = d + 2.0f * (s1 * s1 * s1 * c1 - s0 * s0 * s0 * c0); /* 8 int sin^2 cos^2 sgn */
    sss = s1 * s1 * s1 - s0 * s0 * s0;
    a = 0.5f * (cn * (s0 * s0 + s1 * s1) + sn * d);
    to = (cn * sss + sn * (4.0f - 3.0f * (c1 + c0) + (c1 * c1 * c1 + c0 * c0 * c0))) / 3.0f;
    tv = (cn * (2.0f - c1 * c1 * c1 - c0 * c0 * c0) + sn * sss) / 3.0f;
    ov = 0.125f * cn * e + 0.25f * sn * (s1 * s1 * s1 * s1 + s0 * s0 * s0 * s0);
    vv = 0.25f * cn * (2.0f - c1 * c1 * c1 * c1 - c0 * c0 * c0 * c0) + 0.125f * sn * e;
    for (i = 0; i < 3; i++)
        b[i] = to * o[i] + tv * v[i];
    gtaoi_outer(a - vv, ov, vv, o, v, m);
    gtaoi_sh_of_moments(a, b, m, sh);
}

GTAO_API float gtao_cone_cosine(float visibility, float n_dot_b) {
    GTAOI_NO_CONTRACT
    float a = gtaoi_clamp(visibility, 0.0f, 1.0f), nb = gtaoi_clamp(n_dot_b, 0.0f, 1.0f);
    return nb > a ? sqrtf(1.0f - a / nb) : 0.0f;
}

/* With c = n.b, t = n - c b, and of the cone's half-angle s its sine, u its cosine, over pi:
 *   a = c s^2,   first moment 2/3 c (1 - u^3) b + (2/3 - u + u^3/3) t,
 *   second c (1 - u^4) / 2 b b^T + s^4 / 4 (c (I - b b^T) + b t^T + t b^T) */
GTAO_API void gtao_sh_from_cone(float visibility, const float bent_normal[3], const float normal[3], float sh[9]) {
    GTAOI_NO_CONTRACT
    const float *b = bent_normal;
    float c = gtaoi_clamp(b[0] * normal[0] + b[1] * normal[1] + b[2] * normal[2], 0.0f, 1.0f), t[3], first[3], m[6];
    float u = gtao_cone_cosine(visibility, c), uu = u * u, ss = 1.0f - uu, s4 = 0.25f * ss * ss;
    int i;
    for (i = 0; i < 3; i++) {
        t[i] = normal[i] - c * b[i];
        first[i] = (2.0f * c * (1.0f - u * uu) * b[i] + (2.0f - 3.0f * u + u * uu) * t[i]) / 3.0f;
    }
    gtaoi_outer(c * (0.5f * (1.0f - uu * uu) - s4), s4, 0.0f, b, t, m);
    for (i = 0; i < 3; i++)
        m[i] += c * s4;
    gtaoi_sh_of_moments(c * ss, first, m, sh);
}

GTAO_API void gtao_irradiance(const float sh[9], const float probe[27], float rgb[3]) {
    GTAOI_NO_CONTRACT
    int i, k;
    for (k = 0; k < 3; k++) {
        float sum = 0.0f;
        for (i = 0; i < 9; i++)
            sum += sh[i] * probe[3 * i + k];
        rgb[k] = gtaoi_max(sum, 0.0f);
    }
}

GTAO_API float gtao_multi_bounce(float visibility, float albedo) {
    GTAOI_NO_CONTRACT
    float a, b, c, x = gtaoi_clamp(visibility, 0.0f, 1.0f);
    albedo = gtaoi_clamp(albedo, 0.0f, 1.0f);
    a = 2.0404f * albedo - 0.3324f, b = -4.7951f * albedo + 0.6417f, c = 2.7552f * albedo + 0.6903f;
    return gtaoi_min(gtaoi_max(x, ((x * a + b) * x + c) * x), 1.0f); /* 1.0001 at visibility and albedo 1 */
}

GTAO_API float gtao_multi_bounce_series(float visibility, float albedo) {
    GTAOI_NO_CONTRACT
    float v = gtaoi_clamp(visibility, 0.0f, 1.0f), lost = gtaoi_clamp(albedo, 0.0f, 1.0f) * (1.0f - v);
    return lost < 1.0f ? v / (1.0f - lost) : 0.0f;
}

GTAO_API void gtao_multi_bounce_rgb(float visibility, const float albedo[3], float rgb[3]) {
    int i;
    for (i = 0; i < 3; i++)
        rgb[i] = gtao_multi_bounce(visibility, albedo[i]);
}

/* [J16] noise, as meant. Printed, the directions lack parentheses; and the 6 rotations fall onto 3 offsets within a
 * sixteenth, so 16 x 6 would repeat 48 directions twice: the second three frames are moved by 1/96. Likewise 4 spatial
 * and 4 temporal offsets coincide unless the temporal ones divide the spatial quarter. */
static void gtaoi_noise_memo(int x, int y, uint32_t frame, double *direction, double *offset) {
    GTAOI_NO_CONTRACT
    static const int rotations[6] = {60, 300, 180, 240, 120, 0};
    static const int offsets[4] = {0, 2, 1, 3};
    int spatial = ((((x & 3) + (y & 3)) & 3) << 2) + (x & 3), turn = (int)(frame % 6);
    int d96 = 6 * spatial + rotations[turn] * 96 / 360 + (turn >= 3);
    int o16 = 4 * (((y & 3) - (x & 3)) & 3) + offsets[frame / 6 % 4];
    *direction = (double)(d96 % 96) / 96.0;
    *offset = (double)o16 / 16.0;
}

/* Position of (x, y) along the Hilbert curve of a 64x64 tile, then the R2 sequence; 288 further each frame. */
static void gtaoi_noise_hilbert(int x, int y, uint32_t frame, double *direction, double *offset) {
    GTAOI_NO_CONTRACT
    int index = 0, side, t;
    double i, d, o;
    x &= 63, y &= 63;
    for (side = 32; side > 0; side /= 2) {
        int rx = (x & side) > 0, ry = (y & side) > 0;
        index += side * side * ((3 * rx) ^ ry);
        if (!ry) {
            if (rx)
                x = 63 - x, y = 63 - y;
            t = x, x = y, y = t;
        }
    }
    i = (double)(index + 288 * (int)(frame % 64));
    d = 0.5 + i * 0.75487766624669276005;
    o = 0.5 + i * 0.56984029099805326591;
    *direction = d - (double)(int)d;
    *offset = o - (double)(int)o;
}

static void gtaoi_noise(gtao_noise noise, int x, int y, uint32_t frame, double *direction, double *offset) {
    *direction = *offset = 0.5;
    if (noise == GTAO_NOISE_MEMO)
        gtaoi_noise_memo(x, y, frame, direction, offset);
    if (noise == GTAO_NOISE_HILBERT)
        gtaoi_noise_hilbert(x, y, frame, direction, offset);
}

GTAO_API void gtao_noise_at(gtao_noise noise, int x, int y, uint32_t frame, float *direction, float *offset) {
    double d, o;
    gtaoi_noise(noise, x, y, frame, &d, &o);
    *direction = (float)d;
    *offset = (float)o;
}

/* x in [0, 1] to 0 .. scale, rounded; NaN to 0. */
GTAOI_INLINE uint32_t gtaoi_unorm(float x, float scale) {
    GTAOI_NO_CONTRACT
    return (uint32_t)(int32_t)(gtaoi_min(gtaoi_max(x, 0.0f), 1.0f) * scale + 0.5f);
}

GTAOI_INLINE uint32_t gtaoi_pack(float v, float x, float y, float z) {
    GTAOI_NO_CONTRACT
    return gtaoi_unorm(v, 255.0f) | gtaoi_unorm(0.5f + 0.5f * x, 255.0f) << 8 |
           gtaoi_unorm(0.5f + 0.5f * y, 255.0f) << 16 | gtaoi_unorm(0.5f + 0.5f * z, 255.0f) << 24;
}

GTAO_API uint32_t gtao_pack(float visibility, const float bent_normal[3]) {
    return gtaoi_pack(visibility, bent_normal[0], bent_normal[1], bent_normal[2]);
}

GTAO_API void gtao_unpack(uint32_t packed, float *visibility, float bent_normal[3]) {
    GTAOI_NO_CONTRACT
    float length = 0.0f;
    int i;
    *visibility = (float)(packed & 255) * (1.0f / 255.0f);
    for (i = 0; i < 3; i++) {
        bent_normal[i] = (float)(packed >> (8 * (i + 1)) & 255) * (2.0f / 255.0f) - 1.0f;
        length += bent_normal[i] * bent_normal[i];
    }
    length = 1.0f / sqrtf(length); /* never zero: 127.5 is not an integer */
    for (i = 0; i < 3; i++)
        bent_normal[i] *= length;
}

GTAO_API gtao_camera gtao_camera_from_fov(float fov_y_degrees, int width, int height) {
    gtao_camera c;
    (void)width;
    memset(&c, 0, sizeof c);
    c.fx = c.fy = (float)(0.5 * (double)height / tan((double)fov_y_degrees * (GTAOI_PI / 360.0)));
    return c;
}

/* The row of clip w decides: w = m14 z for a perspective, 1 for an orthographic matrix; its sign gives the handedness.
 * */
GTAO_API gtao_result gtao_camera_from_projection(const float m[16], gtao_clip clip, int clip_y_down, int width,
                                                 int height, gtao_camera *camera, float *device_scale,
                                                 float *device_bias) {
    double forward, scale, bias, y_sign = clip_y_down ? 1.0 : -1.0;
    gtao_camera c;
    int i, perspective, orthographic;
    memset(&c, 0, sizeof c);
    for (i = 0; i < 16; i++)
        if (!gtaoi_finite(m[i]))
            return GTAO_ERROR_MATRIX;
    perspective = m[14] != 0.0f && m[15] == 0.0f && m[11] != 0.0f;
    orthographic = m[14] == 0.0f && m[15] != 0.0f && m[10] != 0.0f;
    if (m[1] != 0.0f || m[4] != 0.0f || m[8] != 0.0f || m[9] != 0.0f || /* sheared, oblique near plane */
        m[12] != 0.0f || m[13] != 0.0f || m[0] == 0.0f || m[5] == 0.0f || (!perspective && !orthographic))
        return GTAO_ERROR_MATRIX;
    if (perspective) {
        /* ndc x = m0 x / w + m2 / m14, ndc z = m10 / m14 + m11 / w, with w = |m14| z in the library's axes. */
        forward = fabs((double)m[14]);
        c.fx = (float)(fabs((double)m[0]) / forward * 0.5 * (double)width);
        c.fy = (float)(fabs((double)m[5]) / forward * 0.5 * (double)height);
        c.off_center = 1;
        c.cx = (float)((1.0 + (double)m[2] / (double)m[14]) * 0.5 * (double)width);
        c.cy = (float)((1.0 + y_sign * (double)m[6] / (double)m[14]) * 0.5 * (double)height);
        scale = forward / (double)m[11];
        bias = -(double)m[10] / (double)m[14] * scale;
    } else {
        /* The clip volume lies in front of the camera: that tells forward from backward, standard from reversed. */
        double z0 = -(double)m[11] / (double)m[10], z1 = ((double)m[15] - (double)m[11]) / (double)m[10];
        forward = z0 + z1 != 0.0 ? (z0 + z1 > 0.0 ? 1.0 : -1.0) : (m[10] > 0.0f ? 1.0 : -1.0);
        c.projection = GTAO_ORTHOGRAPHIC;
        c.sx = (float)(2.0 * fabs((double)m[15] / (double)m[0]) / (double)width);
        c.sy = (float)(2.0 * fabs((double)m[15] / (double)m[5]) / (double)height);
        scale = -forward * (double)m[15] / (double)m[10];
        bias = forward * (double)m[11] / (double)m[10];
    }
    if (clip == GTAO_CLIP_MINUS_ONE_TO_ONE)
        bias -= scale, scale *= 2.0;
    *camera = c;
    *device_scale = (float)scale;
    *device_bias = (float)bias;
    return GTAO_OK;
}

/* ---- context ---------------------------------------------------------------------------------------------------- */

/* The heights of a cell of GTAOI_CELL^2 pixels lie between two planes, w0 + g.e + down and w0 + g.e + up, e from the
 * cell's centre in pixels: those of the first layer above the lower, those of all layers below the upper. On a plane
 * the two coincide but for rounding, however it slants. */
enum {
    GTAOI_CELL = 16,
    GTAOI_CELL_W0 = 0,
    GTAOI_CELL_GX,
    GTAOI_CELL_GY,
    GTAOI_CELL_UP,   /* GTAOI_CELL_NONE: nothing but sky */
    GTAOI_CELL_DOWN, /* minus that: sky in the first layer */
    GTAOI_CELL_MOST, /* heights that are not sky lie between these, too */
    GTAOI_CELL_LEAST,
    GTAOI_CELL_SKY, /* whether some of its pixels are sky */
    GTAOI_CELL_PLANES,
    GTAOI_DIRECTIONS = 16, /* sectors of directions on the screen */
    GTAOI_SPAN = 16        /* tiles of 64x16 pixels that are looked at together */
};
#define GTAOI_CELL_NONE (-1e38f)
#define GTAOI_STEPS_PAY 16  /* samples a side from which it pays to look at everything that may rise */
#define GTAOI_DEEP 1.25f    /* nearest to farthest height of a tile from which bands of rows are looked at */
#define GTAOI_BAND 4        /* rows of a band */
#define GTAOI_CANDIDATES 12 /* with fewer samples: cells that may rise after which a tile gives up */

/* What the receivers of a tile may see. */
typedef struct gtaoi_tile {
    float gx, gy, slack;               /* it holds for tangent planes with |g - (gx, gy)| <= slack */
    float blank;                       /* a block of no greater heights has no horizons ... */
    int sky, some_blank;               /* whether all of it is sky; whether some blocks may have none */
    int fits;                          /* close to one plane */
    int deep;                          /* one plane, whose depth varies much: worth a look by bands of rows */
    int known;                         /* 0: anything may rise anywhere */
    unsigned open;                     /* bit by bit: in these cells nothing rises above ... */
    float plane[3][GTAOI_CELL];        /* ... gx, gy, slack, four times for each cell */
    float normal[3], within;           /* a normal of the caller's that close to this one is the plane's */
    float normals[4][GTAOI_LANES + 4]; /* the same of each cell, over and over as in the caller's rows, */
    float allowed[4][GTAOI_LANES + 4]; /* -1: none is */
    float lo[GTAOI_DIRECTIONS], hi[GTAOI_DIRECTIONS]; /* where something may rise, in pixels; none: lo > hi */
    float lo_all, hi_all;                             /* the same of all directions */
} gtaoi_tile;

/* One sample of a slice, shared by all pixels of a noise phase. */
typedef struct gtaoi_sample {
    float inv_length;  /* 1 / |q|, or 1 / t on the slice line in every-pixel mode; per pixel */
    float ux, uy;      /* q / |q|; in every-pixel mode ux is the weight of the second tap */
    int16_t qx, qy;    /* whole-pixel offset of the first tap */
    int32_t offset[4]; /* of the taps in the height buffer: +q, -q, second taps of +q and -q */
} gtaoi_sample;

/* The two taps of one of the first samples in every-pixel mode, each as a sample of its own. */
typedef struct gtaoi_taps {
    float inv_length[2], ux[2], uy[2];
} gtaoi_taps;

/* A far sample on both sides: blocks of 4x4 pixels, by where their centres lie from the pixel. */
typedef struct gtaoi_far {
    float inv_length[2], ux[2], uy[2];
    int32_t offset[2]; /* in the plane of blocks */
} gtaoi_far;

typedef struct gtaoi_slice {
    float dx, dy; /* unit screen direction */
    float bx, by; /* the same in units of the ray r: (dx / fx, dy / fy), or (dx, dy sy / sx) orthographic */
    float bb;     /* |b|^2 */
    int x_major;  /* |dx| >= |dy| */
    int sector;   /* gtaoi_direction of the + side; the - side's is eight on */
} gtaoi_slice;

struct gtao_context {
    gtao_desc d; /* defaults resolved */
    gtao_output o;
    int orthographic, bounded;
    int every_pixel, slices, max_steps;
    int per_pixel_noise; /* directions differ within a group: gather */
    int period;          /* of the noise along x and y that the height buffer is interleaved for: 4 or 1 */
    int classes;
    uint32_t class_base;          /* bits of the least extent, shifted */
    int cosines;                  /* the search takes every cosine: memo estimator, thickness heuristic */
    int plain;                    /* none of the settings that gtaoi_block_plain leaves out */
    int bent;                     /* bent normals are wanted, or spherical harmonics */
    int signal;                   /* planes of the signal that are wanted */
    float weight_scale;           /* sum of the slices' Jacobians to the signal's weight, on the optical axis */
    float extent_min, extent_max; /* of the sphere of the radius on the plane z = 1 (orthographic: in pixels) */
    float max_radius;             /* cap in pixels */
    float bx1, by1, cx, cy;       /* r = ((x + 0.5 - cx) bx1, (y + 0.5 - cy) by1, 1); orthographic: (0, 0, 1) */
    float reach;                  /* radius / unit */
    float inner2;                 /* (1 - falloff)^2 */
    float inv_falloff;            /* 1 / falloff */
    float same_surface;           /* height difference of one surface, relative (perspective) or absolute */
    float w_scale, w_bias;        /* device depth or height to w */
    float w_numerator;            /* linear depth: w = w_numerator / z */
    float w_far;                  /* w at or below is sky */
    float w_max;                  /* greater ones are held there: nothing overflows */
    float z_sky;                  /* z at or beyond is sky */
    float to_view[9];             /* normal_axes * normal_to_view */
    int transform_normals;
    int arcs;        /* occluders have thickness: unions of arcs */
    int clip;        /* bit k: backs of layer k are known: such columns count as far as they are within the radius */
    float connect;   /* height difference per pixel within which samples are one surface, as same_surface */
    int layer_count; /* with the first */
    gtao_layer layer[1 + GTAO_MAX_LAYERS];
    float thickness; /* in the unit of 1 / w; 1e30 and more: endless */
    float per_unit;  /* factor of the thickness map */
    ptrdiff_t plane; /* floats from a layer's heights to its backs, and from these to the next layer's heights */
    float *w;        /* height buffer at row 0 of rows -2 .. height + 1; the first and last are sky */
    const gtao_frame_context *frame; /* whose tiles at rest are skipped, or null */
    ptrdiff_t normal_plane;          /* floats between the planes of normals in planes, 0 if they are interleaved */
    ptrdiff_t pitch;                 /* floats from row to row */
    int segment;                     /* floats of one phase's part of a row, with its padding */
    gtaoi_slice *slice;              /* [period^2][slices] */
    gtaoi_sample *sample;            /* [period^2][slices][classes or 1][max_steps] */
    gtaoi_taps *taps;                /* every-pixel mode: [period^2][slices][GTAOI_NEAR] */
    int *count;                      /* [period^2][slices][classes] */
    gtaoi_far *far_sample;           /* with far_depth: as `sample` */
    int *far_begin;                  /* and as `count`: the first of a list that are far */
    float *far_w;                    /* heights of 4x4 pixels, at row 0 */
    ptrdiff_t far_pitch;
    float *noise;                   /* per-pixel noise: [64][64 + GTAOI_LANES][2 planes] */
    float *step;                    /* per-pixel noise: ((j + offset) / steps)^power, [steps][64 offsets] */
    int before;                     /* slices in the planes that this context's join; 0: none, it writes its own */
    int slice_begin, slice_end;     /* the slices of this pass over the rows: all of them, or a sweep's batch */
    int x_begin, x_end;             /* columns that are wanted */
    const struct gtaoi_pass *pass;  /* of a sweep; null: none */
    float rise_min;                 /* rises in cot h that do not count */
    unsigned skips;                 /* gtao_skip flags that these settings allow */
    int cells_x, cells_y;           /* of 16x16 pixels */
    ptrdiff_t cell_pitch;           /* floats from one row of cells to the next */
    float *cell[GTAOI_CELL_PLANES]; /* what they hold */
    uint32_t *prepared;             /* of each row: the range that it was last prepared in */
    struct gtaoi_effort *effort;    /* error_target; null: none */
    float *keep;                    /* height and tilt of each pixel go there, planes of gtaoi_effort; null: nowhere */
};

typedef struct gtaoi_layout {
    int every_pixel, slices, max_steps, period, per_pixel_noise, classes, segment, per_segment, max_radius;
    float extent_min, extent_max;
    uint32_t class_base;
    ptrdiff_t pitch, plane;
    int planes;
    uint64_t w, slice, sample, taps, count, noise, cells, prepared, total; /* byte offsets in the aligned scratch */
    int levels, effort_planes;
    ptrdiff_t effort_pitch;
    uint64_t effort, effort_plane, tiles, level_tables[8];
    uint64_t far_sample, far_begin, far_w;
    ptrdiff_t far_pitch;
} gtaoi_layout;

/* ---- effort by need ---- */

enum {
    GTAOI_EFFORT_W = 64, /* a tile: one group of 16 pixels of each of the 16 phases */
    GTAOI_EFFORT_H = 4,
    GTAOI_EFFORT_PAD = 16,
    GTAOI_LEVELS = 6
};

/* Slices and samples of each level (0: every pixel), the first level's slice among them; squared error left after
 * sharing, by the variance of the window's mean and by visible (1 - visible) of pixels that share with none, both as the
 * first level has them; and what is left of the variance of one slice, about 1 / slices^1.5. All fitted to the scenes of
 * build/bench_effort. */
static const struct {
    int slices, steps;
    float error, alone, settled;
} gtaoi_levels[GTAOI_LEVELS] = {
    {1, 24, 0.75f, 0.5f, 1.0f},      {3, 24, 0.4f, 0.06f, 0.33f},     {4, 32, 0.26f, 0.025f, 0.165f},
    {6, 48, 0.152f, 0.018f, 0.068f}, {9, 0, 0.054f, 0.0015f, 0.024f}, {17, 0, 0.0205f, 0.0002f, 0.007f},
};

typedef struct gtaoi_effort_tile {
    float variance, alone, count; /* sums over the tile's pixels, of those with a surface */
    float cost[GTAOI_LEVELS];     /* of each level, about ns a pixel */
    float w_least, w_most;        /* of their heights; least > most: none */
    unsigned char level, wanted;  /* what has been computed, what is to be */
} gtaoi_effort_tile;

enum { /* planes: those of the signal first, then harmonics */
       GTAOI_EFFORT_SIGNAL,
       GTAOI_EFFORT_HEIGHT = 14,
       GTAOI_EFFORT_TILT_X,
       GTAOI_EFFORT_TILT_Y,
       GTAOI_EFFORT_VARIANCE,
       GTAOI_EFFORT_KINDS
};

typedef struct gtaoi_effort {
    struct gtao_context level[GTAOI_LEVELS];
    int levels, tiles_x, tiles_y, max_radius;
    int more;              /* planes that are shared beside visibility: bent normal, harmonics */
    int second;            /* gtao_refine_begin has been called */
    float foot, foot_bias; /* height per pixel of a surface that faces the eye: foot w + foot_bias */
    ptrdiff_t pitch, plane;
    float *planes[GTAOI_EFFORT_KINDS]; /* at row 0, column 0; the signal's weight is that of all its slices */
    gtaoi_effort_tile *tile;
} gtaoi_effort;

/* On the front of error against time of all settings (docs/benchmark.md). */
static const struct {
    int slices, steps;
} gtaoi_presets[] = {
    {2, 12}, /* medium */
    {1, 8},  /* low */
    {4, 16}, /* high */
    {8, 32}, /* ultra */
    {32, 0}, /* reference: every pixel */
};

static float gtaoi_fy(const gtao_camera *c) {
    return c->fy == 0.0f ? c->fx : c->fy;
}
static float gtaoi_sy(const gtao_camera *c) {
    return c->sy == 0.0f ? c->sx : c->sy;
}
static int gtaoi_positive(float x) {
    return x > 0.0f && x <= FLT_MAX;
}

static int gtaoi_stride_ok(ptrdiff_t stride, int row_bytes, int unit) {
    ptrdiff_t s = stride < 0 ? -stride : stride;
    return stride == 0 || (s >= row_bytes && s % unit == 0);
}

static int gtaoi_sh_count(const gtao_output *o) {
    return o->sh_bands == 2 ? 4 : 9;
}

/* Whether anything has a back. */
static int gtaoi_has_arcs(const gtao_desc *d) {
    return d->thickness > 0.0f || d->thickness_map || d->back || d->layer_count > 0;
}

static gtao_result gtaoi_check_arcs(const gtao_desc *d) {
    int i, row = d->width * 4;
    if (!(d->thickness >= 0.0f))
        return GTAO_ERROR_THICKNESS;
    if (d->thickness_map && !gtaoi_stride_ok(d->thickness_stride, row, 4))
        return GTAO_ERROR_THICKNESS_MAP;
    if (d->back && !gtaoi_stride_ok(d->back_stride, row, 4))
        return GTAO_ERROR_BACK;
    if (d->layer_count < 0 || d->layer_count > GTAO_MAX_LAYERS || (d->layer_count > 0 && !d->layers))
        return GTAO_ERROR_LAYERS;
    for (i = 0; i < d->layer_count; i++)
        if (!d->layers[i].depth || !gtaoi_stride_ok(d->layers[i].depth_stride, row, 4) ||
            (d->layers[i].back && !gtaoi_stride_ok(d->layers[i].back_stride, row, 4)))
            return GTAO_ERROR_LAYERS;
    if (gtaoi_has_arcs(d) && (d->estimator == GTAO_ESTIMATOR_MEMO || d->thin_blend > 0.0f))
        return GTAO_ERROR_ARCS;
    return GTAO_OK;
}

/* Order of the checks: order of the fields. */
static gtao_result gtaoi_check_desc(const gtao_desc *d) {
    gtao_result result;
    int i;
    if (!d)
        return GTAO_ERROR_DESC;
    if (d->width < 1 || d->width > 32768 || d->height < 1 || d->height > 32768)
        return GTAO_ERROR_SIZE;
    if (!d->depth)
        return GTAO_ERROR_DEPTH;
    if (!gtaoi_stride_ok(d->depth_stride, d->width * 4, 4))
        return GTAO_ERROR_DEPTH_STRIDE;
    if ((unsigned)d->depth_kind > GTAO_DEPTH_HEIGHT)
        return GTAO_ERROR_DEPTH_KIND;
    if ((unsigned)d->camera.projection > GTAO_ORTHOGRAPHIC)
        return GTAO_ERROR_PROJECTION;
    if (d->depth_kind == GTAO_DEPTH_HEIGHT && d->camera.projection != GTAO_ORTHOGRAPHIC)
        return GTAO_ERROR_DEPTH_KIND;
    if (d->depth_kind == GTAO_DEPTH_DEVICE &&
        (!gtaoi_finite(d->device_scale) || !gtaoi_finite(d->device_bias) || d->device_scale == 0.0f))
        return GTAO_ERROR_DEVICE;
    if (!(d->sky_z >= 0.0f))
        return GTAO_ERROR_SKY;
    if (d->normals) {
        int n = d->normal_components == 0 ? 3 : d->normal_components;
        if ((n != 3 && n != 4) || !gtaoi_stride_ok(d->normal_stride, d->width * n * 4, 4))
            return GTAO_ERROR_NORMALS;
        for (i = 0; i < 9; i++)
            if (!gtaoi_finite(d->normal_to_view[i]))
                return GTAO_ERROR_NORMAL_AXES;
        for (i = 0; i < 3; i++)
            if (!gtaoi_finite(d->normal_axes[i]))
                return GTAO_ERROR_NORMAL_AXES;
    }
    if (d->mask && !gtaoi_stride_ok(d->mask_stride, d->width, 1))
        return GTAO_ERROR_MASK;
    if (d->camera.projection == GTAO_PERSPECTIVE) {
        if (!gtaoi_positive(d->camera.fx) || !gtaoi_positive(gtaoi_fy(&d->camera)))
            return GTAO_ERROR_FOCAL;
        if (d->camera.off_center && (!gtaoi_finite(d->camera.cx) || !gtaoi_finite(d->camera.cy)))
            return GTAO_ERROR_CENTER;
    } else if (!gtaoi_positive(d->camera.sx) || !gtaoi_positive(gtaoi_sy(&d->camera))) {
        return GTAO_ERROR_PIXEL_SIZE;
    }
    if ((unsigned)d->border > GTAO_BORDER_WRAP)
        return GTAO_ERROR_BORDER;
    if (!(d->radius >= 0.0f))
        return GTAO_ERROR_RADIUS;
    if (!(d->falloff >= 0.0f && d->falloff <= 1.0f))
        return GTAO_ERROR_FALLOFF;
    if (d->max_radius_px < 0)
        return GTAO_ERROR_MAX_RADIUS;
    if ((unsigned)d->preset > GTAO_PRESET_REFERENCE)
        return GTAO_ERROR_PRESET;
    if (d->slices < 0 || d->slices > 64)
        return GTAO_ERROR_SLICES;
    if (d->steps < 0 || d->steps > 256)
        return GTAO_ERROR_STEPS;
    if (d->step_power != 0.0f && !(d->step_power >= 0.25f && d->step_power <= 8.0f))
        return GTAO_ERROR_STEP_POWER;
    if (!(d->thin_blend >= 0.0f && d->thin_blend <= 1.0f))
        return GTAO_ERROR_THIN_BLEND;
    if (!(d->tolerance >= 0.0f && d->tolerance <= 1.0f))
        return GTAO_ERROR_ALLOWED;
    result = gtaoi_check_arcs(d);
    if (result != GTAO_OK)
        return result;
    if ((unsigned)d->estimator > GTAO_ESTIMATOR_MEMO)
        return GTAO_ERROR_ESTIMATOR;
    if ((unsigned)d->weighting > GTAO_WEIGHTING_UNIFORM)
        return GTAO_ERROR_WEIGHTING;
    if ((unsigned)d->noise > GTAO_NOISE_NONE)
        return GTAO_ERROR_NOISE;
    if ((unsigned)d->far_depth > GTAO_FAR_AVERAGE || (d->far_px != 0 && d->far_px < 8) ||
        (d->far_depth && (d->noise != GTAO_NOISE_MEMO || d->border != GTAO_BORDER_OPEN || d->every_pixel ||
                          (d->steps ? d->steps : gtaoi_presets[d->preset].steps) == 0 || gtaoi_has_arcs(d) ||
                          d->thin_blend > 0.0f || d->estimator == GTAO_ESTIMATOR_MEMO)))
        return GTAO_ERROR_FAR;
    if (!(d->error_target >= 0.0f) || (d->error_target > 0.0f && (d->noise != GTAO_NOISE_MEMO || d->far_depth)))
        return GTAO_ERROR_TARGET;
    if (!gtao_isa_available(d->isa))
        return GTAO_ERROR_ISA;
    return GTAO_OK;
}

/* The planes follow one another, or their rows alternate. */
static int gtaoi_sh_ok(const gtao_desc *d, const gtao_output *o) {
    uint64_t bytes = (uint64_t)d->width * 4, row = bytes, plane = (uint64_t)o->sh_plane_stride;
    if ((o->sh_bands != 0 && o->sh_bands != 2 && o->sh_bands != 3) || !gtaoi_stride_ok(o->sh_stride, d->width * 4, 4))
        return 0;
    if (o->sh_stride)
        row = (uint64_t)(o->sh_stride < 0 ? -o->sh_stride : o->sh_stride);
    if (o->sh_plane_stride < 0)
        plane = 0 - plane;
    return plane == 0 || (plane % 4 == 0 && plane >= bytes &&
                          ((plane - bytes) / row >= (uint64_t)d->height - 1 ||
                           (row - bytes) / plane >= (uint64_t)gtaoi_sh_count(o) - 1));
}

/* Strides of planes of width x height floats. */
static int gtaoi_planes_ok(ptrdiff_t stride, ptrdiff_t plane, int width, int height) {
    ptrdiff_t rows = stride ? stride : (ptrdiff_t)width * 4;
    plane = plane < 0 ? -plane : plane;
    rows = (rows < 0 ? -rows : rows) * (height - 1) + (ptrdiff_t)width * 4;
    return gtaoi_stride_ok(stride, width * 4, 4) && plane % 4 == 0 && (!plane || plane >= rows);
}

static int gtaoi_has_planes(const gtao_output *o) {
    return o->horizons || o->arcs || o->slices || o->surface;
}

static gtao_result gtaoi_check_output(const gtao_desc *d, const gtao_output *o) {
    static const int bytes[] = {4, 1, 2};
    int components;
    if (!o || (!o->visibility && !o->bent_normals && !o->packed && !o->signal && !o->sh && !gtaoi_has_planes(o)))
        return GTAO_ERROR_OUTPUT;
    if (gtaoi_has_planes(o) && !gtaoi_planes_ok(o->horizon_stride, o->horizon_plane, d->width, d->height))
        return GTAO_ERROR_HORIZONS;
    if ((unsigned)o->visibility_format > GTAO_FORMAT_UNORM16)
        return GTAO_ERROR_OUTPUT_FORMAT;
    components = o->bent_components == 0 ? 3 : o->bent_components;
    if ((components != 3 && components != 4) ||
        (o->visibility &&
         !gtaoi_stride_ok(o->visibility_stride, d->width * bytes[o->visibility_format], bytes[o->visibility_format])) ||
        (o->bent_normals && !gtaoi_stride_ok(o->bent_stride, d->width * components * 4, 4)) ||
        (o->packed && !gtaoi_stride_ok(o->packed_stride, d->width * 4, 4)))
        return GTAO_ERROR_OUTPUT_STRIDE;
    if (o->sh && !gtaoi_sh_ok(d, o))
        return GTAO_ERROR_OUTPUT_SH;
    if (d->error_target > 0.0f && gtaoi_has_planes(o))
        return GTAO_ERROR_TARGET;
    if (o->signal && ((o->signal_planes != 0 && o->signal_planes != 2 && o->signal_planes != 5) ||
                      !gtaoi_stride_ok(o->signal_stride, d->width * 4, 4) || o->signal_plane_stride % 4 != 0))
        return GTAO_ERROR_SIGNAL;
    return GTAO_OK;
}

/* Bytes of a level's tables, and where each begins: slices, samples, counts, taps. */
static uint64_t gtaoi_level_tables(int level, int classes, int max_radius, uint64_t at[4]) {
    uint64_t lists = 16 * (uint64_t)(gtaoi_levels[level].slices - gtaoi_levels[0].slices), sizes[4], sum = 0;
    int i, steps = gtaoi_levels[level].steps;
    sizes[0] = lists * sizeof(gtaoi_slice);
    sizes[1] = lists * (uint64_t)(steps ? steps * classes : max_radius) * sizeof(gtaoi_sample);
    sizes[2] = lists * (uint64_t)classes * sizeof(int);
    sizes[3] = steps ? 0 : lists * GTAOI_NEAR * sizeof(gtaoi_taps);
    for (i = 0; i < 4; sum += (sizes[i++] + 63) / 64 * 64)
        if (at)
            at[i] = sum;
    return sum;
}

/* Levels that a target may want: the highest one for small targets only. */
static void gtaoi_plan_effort(const gtao_desc *d, gtaoi_layout *l) {
    uint64_t at = (l->total + 63) / 64 * 64;
    int i;
    l->levels = d->error_target >= 0.03f ? GTAOI_LEVELS - 1 : GTAOI_LEVELS;
    l->effort = at;
    at += (sizeof(gtaoi_effort) + 63) / 64 * 64;
    for (i = 1; i < l->levels; i++) {
        l->level_tables[i] = at;
        at += gtaoi_level_tables(i, l->classes, l->max_radius, NULL);
    }
    l->effort_pitch = ((d->width + GTAOI_EFFORT_W - 1) & ~(GTAOI_EFFORT_W - 1)) + 2 * GTAOI_EFFORT_PAD;
    l->effort_planes = 18; /* what the output does not ask for is not touched */
    l->effort_plane = at;
    at += (uint64_t)l->effort_planes * (uint64_t)l->effort_pitch * (uint64_t)d->height * sizeof(float);
    l->tiles = at;
    at += (uint64_t)(l->effort_pitch / GTAOI_EFFORT_W) * (uint64_t)((d->height + GTAOI_EFFORT_H - 1) / GTAOI_EFFORT_H) *
          sizeof(gtaoi_effort_tile);
    l->total = at + 63;
}

/* Everything that decides the size of the scratch buffer. */
/* Floats in a row of cells, with room for a group that starts at the last one. */
static ptrdiff_t gtaoi_cell_pitch(int width) {
    return ((width + GTAOI_CELL - 1) / GTAOI_CELL + 2 * GTAOI_LANES - 1) / GTAOI_LANES * GTAOI_LANES;
}

static void gtaoi_plan(const gtao_desc *d, gtaoi_layout *l) {
    float f_max, f_min, b_ratio;
    double diagonal = sqrt((double)d->width * (double)d->width + (double)d->height * (double)d->height);
    uint64_t phases, rows = (uint64_t)d->height + 4;
    memset(l, 0, sizeof *l);
    l->slices = d->slices ? d->slices : gtaoi_presets[d->preset].slices;
    l->max_steps = d->steps ? d->steps : gtaoi_presets[d->preset].steps;
    l->every_pixel = (d->every_pixel || l->max_steps == 0) && !(d->error_target > 0.0f);
    l->max_radius = gtaoi_imin((int)diagonal + 1, INT16_MAX); /* the offsets of gtaoi_sample have 16 bits */
    if (d->max_radius_px > 0)
        l->max_radius = gtaoi_imin(l->max_radius, d->max_radius_px);
    if (l->every_pixel)
        l->max_steps = l->max_radius;
    l->per_pixel_noise = d->noise == GTAO_NOISE_HILBERT;
    l->period = d->noise == GTAO_NOISE_MEMO ? 4 : 1;

    /* Extent e of the radius on the plane z = 1: radius_px = e / |b|, from one pixel to the cap. */
    if (d->camera.projection == GTAO_PERSPECTIVE) {
        f_max = gtaoi_max(d->camera.fx, gtaoi_fy(&d->camera));
        f_min = gtaoi_min(d->camera.fx, gtaoi_fy(&d->camera));
    } else {
        b_ratio = gtaoi_sy(&d->camera) / d->camera.sx;
        f_max = gtaoi_max(1.0f, 1.0f / b_ratio);
        f_min = gtaoi_min(1.0f, 1.0f / b_ratio);
    }
    l->extent_min = gtaoi_clamp(1.0f / f_max, 1e-30f, 1e30f);
    l->extent_max = gtaoi_clamp((float)l->max_radius / f_min, l->extent_min, l->extent_min * 1048576.0f);
    l->class_base = gtaoi_bits(l->extent_min) >> GTAOI_CLASS_SHIFT;
    l->classes = (int)((gtaoi_bits(l->extent_max) >> GTAOI_CLASS_SHIFT) - l->class_base) + 1;
    l->classes = gtaoi_imin(l->classes, GTAOI_MAX_CLASSES + 1);

    if (d->error_target > 0.0f)
        l->slices = gtaoi_levels[0].slices, l->max_steps = gtaoi_levels[0].steps;

    l->per_segment = (d->width + l->period - 1) / l->period;
    l->segment = (l->per_segment + 2 * GTAOI_PAD + GTAOI_LANES + 15) & ~15;
    l->pitch = (ptrdiff_t)l->segment * l->period;
    if (l->pitch % 1024 == 0)
        l->pitch += 16; /* rows a multiple of 4 KiB apart would share cache sets */

    l->plane = (ptrdiff_t)rows * l->pitch;
    l->planes = gtaoi_has_arcs(d) ? 2 * (1 + d->layer_count) : 1;

    phases = (uint64_t)l->period * (uint64_t)l->period;
    l->w = (sizeof(struct gtao_context) + 63) / 64 * 64;
    l->slice = l->w + ((uint64_t)l->planes * rows * (uint64_t)l->pitch * sizeof(float) + 63) / 64 * 64;
    l->sample = l->slice + (phases * (uint64_t)l->slices * sizeof(gtaoi_slice) + 63) / 64 * 64;
    l->taps = l->sample;
    if (!l->per_pixel_noise)
        l->taps += phases * (uint64_t)l->slices * (l->every_pixel ? 1 : (uint64_t)l->classes) * (uint64_t)l->max_steps *
                   sizeof(gtaoi_sample);
    l->count = l->taps + (l->every_pixel ? phases * (uint64_t)l->slices * GTAOI_NEAR * sizeof(gtaoi_taps) : 0);
    l->noise = l->count + (phases * (uint64_t)l->slices * (uint64_t)l->classes * sizeof(int) + 63) / 64 * 64;
    l->cells = l->noise;
    if (l->per_pixel_noise)
        l->cells += (2 * 64 * (64 + GTAOI_LANES) + (l->every_pixel ? 0 : 64 * (uint64_t)l->max_steps)) * sizeof(float);
    l->prepared = l->cells + GTAOI_CELL_PLANES * sizeof(float) * (uint64_t)gtaoi_cell_pitch(d->width) *
                                 (uint64_t)((d->height + GTAOI_CELL - 1) / GTAOI_CELL);
    l->total = l->prepared + (uint64_t)d->height * sizeof(uint32_t) + 63; /* room to align */
    if (d->far_depth) {
        uint64_t lists = phases * (uint64_t)l->slices * (uint64_t)l->classes;
        l->far_pitch = l->segment;
        l->far_sample = (l->total + 63) / 64 * 64;
        l->far_begin = l->far_sample + lists * (uint64_t)l->max_steps * sizeof(gtaoi_far);
        l->far_w = (l->far_begin + lists * sizeof(int) + 63) / 64 * 64;
        l->total = l->far_w + ((uint64_t)d->height + 3) / 4 * (uint64_t)l->far_pitch * sizeof(float) + 63;
    }
    if (d->error_target > 0.0f)
        gtaoi_plan_effort(d, l);
}

GTAO_API size_t gtao_scratch_size(const gtao_desc *desc) {
    gtaoi_layout l;
    if (gtaoi_check_desc(desc) != GTAO_OK)
        return 0;
    gtaoi_plan(desc, &l);
    return l.total <= SIZE_MAX ? (size_t)l.total : 0;
}

/* Where the pixel (phase + dx, dy) of a row segment lies from the pixel (phase, 0). */
static int32_t gtaoi_tap(const gtao_context *c, int phase, int dx, int dy) {
    int p = phase + dx, segment = p & (c->period - 1), shift = c->period == 4 ? 2 : 0;
    return (int32_t)(dy * (int)c->pitch + (segment - phase) * c->segment + (p - segment) / (1 << shift));
}

static void gtaoi_sample_offsets(const gtao_context *c, gtaoi_sample *s, int phase, int qx, int qy, int rx, int ry) {
    s->qx = (int16_t)qx, s->qy = (int16_t)qy;
    s->offset[0] = gtaoi_tap(c, phase, qx, qy);
    s->offset[1] = gtaoi_tap(c, phase, -qx, -qy);
    s->offset[2] = gtaoi_tap(c, phase, rx, ry);
    s->offset[3] = gtaoi_tap(c, phase, -rx, -ry);
}

/* Round half away from zero, ties within rounding too, so that mirrored slices are treated alike. */
static int gtaoi_round(double x) {
    return x < 0.0 ? -(int)(0.500000001 - x) : (int)(x + 0.500000001);
}

static int gtaoi_class(const gtao_context *c, float extent) {
    return gtaoi_imin(gtaoi_imax((int)(gtaoi_bits(extent) >> GTAOI_CLASS_SHIFT) - (int)c->class_base, 0),
                      c->classes - 1);
}

/* Upper edge of a class's extents, in pixels along a direction with |b| = 1 / px_per_extent. */
static double gtaoi_class_radius(const gtao_context *c, int k, double px_per_extent, int cap) {
    uint32_t bits = (c->class_base + (uint32_t)k + 1) << GTAOI_CLASS_SHIFT;
    double r = (double)gtaoi_from_bits(bits) * px_per_extent;
    return r < (double)cap ? (r > 1.0 ? r : 1.0) : (double)cap;
}

/* `steps` whole-pixel samples at 1 + (radius - 1) ((j + offset) / steps)^power, each pixel once. */
static int gtaoi_fill_steps(const gtao_context *c, gtaoi_sample *s, int phase, double dx, double dy, double radius,
                            double offset) {
    GTAOI_NO_CONTRACT
    double power = c->d.step_power == 0.0f ? 2.0 : (double)c->d.step_power;
    int j, n = 0;
    for (j = 0; j < c->max_steps; j++) {
        double t = 1.0 + (radius - 1.0) * gtaoi_pow(((double)j + offset) / (double)c->max_steps, power), length;
        int qx = gtaoi_round(t * dx), qy = gtaoi_round(t * dy);
        if (n > 0 && s[n - 1].qx == qx && s[n - 1].qy == qy)
            continue;
        length = sqrt((double)qx * (double)qx + (double)qy * (double)qy);
        s[n].inv_length = (float)(1.0 / length);
        s[n].ux = (float)((double)qx / length);
        s[n].uy = (float)((double)qy / length);
        gtaoi_sample_offsets(c, &s[n], phase, qx, qy, qx, qy);
        n++;
    }
    return n;
}

/* Every pixel along the major axis; across it two taps and the second one's weight. */
static int gtaoi_fill_every(const gtao_context *c, gtaoi_sample *s, gtaoi_taps *taps, int phase, double dx, double dy,
                            double radius) {
    GTAOI_NO_CONTRACT
    int x_major = (dx < 0.0 ? -dx : dx) >= (dy < 0.0 ? -dy : dy), j, k, n;
    double major = x_major ? dx : dy, minor = x_major ? dy : dx, unit = major < 0.0 ? -major : major;
    int step = major < 0.0 ? -1 : 1;
    n = gtaoi_imin((int)(radius * unit + 1e-6), c->max_steps);
    n = gtaoi_imax(n, 1);
    for (j = 1; j <= n; j++, s++) {
        double m = (double)j * minor / unit, whole = floor(m), fraction = m - whole;
        int a = (int)whole, b;
        if (fraction < 1e-6)
            fraction = 0.0;
        if (fraction > 1.0 - 1e-6)
            fraction = 0.0, a++;
        b = fraction > 0.0 ? a + 1 : a;
        s->inv_length = (float)(unit / (double)j);
        s->ux = (float)fraction;
        s->uy = 0.0f;
        if (x_major)
            gtaoi_sample_offsets(c, s, phase, step * j, a, step * j, b);
        else
            gtaoi_sample_offsets(c, s, phase, a, step * j, b, step * j);
        for (k = 0; j <= GTAOI_NEAR && k < 2; k++) {
            double across = (double)(k ? b : a), along = (double)(step * j),
                   length = sqrt(along * along + across * across);
            taps[j - 1].inv_length[k] = (float)(1.0 / length);
            taps[j - 1].ux[k] = (float)((x_major ? along : across) / length);
            taps[j - 1].uy[k] = (float)((x_major ? across : along) / length);
        }
    }
    return n;
}

/* The sector of a direction, 0 .. 15: never falls as it turns from +x by +y and -x back to +x. */
static int gtaoi_direction(float x, float y) {
    GTAOI_NO_CONTRACT
    const float half = 0.41421356f; /* tan(pi / 8) */
    int k = 0;
    float t;
    if (y < 0.0f)
        x = -x, y = -y, k = 8;
    if (x <= 0.0f)
        t = x, x = y, y = -t, k += 4;
    if (y <= x)
        return (k + (y > half * x)) & (GTAOI_DIRECTIONS - 1);
    return (k + 3 - (x > half * y)) & (GTAOI_DIRECTIONS - 1);
}

/* The far ones of a list of n samples: the blocks that hold them. Those of the two sides do not mirror each other. */
static int gtaoi_fill_far(const gtao_context *c, const gtaoi_sample *s, gtaoi_far *far_sample, int n, int px, int py) {
    GTAOI_NO_CONTRACT
    int j, side, begin = n, far_px = c->d.far_px ? c->d.far_px : 32;
    for (j = n - 1; j >= 0 && s[j].qx * s[j].qx + s[j].qy * s[j].qy >= far_px * far_px; j--, begin--)
        for (side = 0; side < 2; side++) {
            /* + 32768: so that what is shifted is not negative */
            int bx = ((px + (side ? -s[j].qx : s[j].qx) + 32768) >> 2) - 8192;
            int by = ((py + (side ? -s[j].qy : s[j].qy) + 32768) >> 2) - 8192;
            double x = 4.0 * (double)bx + 1.5 - (double)px, y = 4.0 * (double)by + 1.5 - (double)py;
            double length = sqrt(x * x + y * y);
            far_sample[j].inv_length[side] = (float)(1.0 / length);
            far_sample[j].ux[side] = (float)(x / length), far_sample[j].uy[side] = (float)(y / length);
            far_sample[j].offset[side] = (int32_t)(by * (int)c->far_pitch + bx);
        }
    return begin;
}

/* Direction of slice k, in half turns: those of a pixel are as far apart as they can be, and so are those of all 16
 * phases of the noise, which lie 1/16 apart. Slices that join another one stand around that. With more common factors
 * of 16 and their number than 1, turns by k / number alone would meet other phases' slices: hence the rest. */
static double gtaoi_slice_turn(const gtao_context *c, int k, double direction) {
    GTAOI_NO_CONTRACT
    int all = c->before + c->slices, factor = all & -all;
    if (!c->before)
        return ((double)k + direction) / (double)all;
    k += c->before, factor = factor < 16 ? factor : 16;
    direction += ((double)k + (double)(k * factor / all) / 16.0) / (double)all;
    return direction < 1.0 ? direction : direction - 1.0;
}

/* `chosen`: the radius classes that are wanted; null: all. */
static void gtaoi_fill_tables(gtao_context *c, int max_radius, const unsigned char *chosen) {
    GTAOI_NO_CONTRACT
    int px, py, k, r, last = c->classes - 1;
    double ratio = c->orthographic ? (double)gtaoi_sy(&c->d.camera) / (double)c->d.camera.sx : 1.0;
    while (chosen && last > 0 && !chosen[last]) /* the longest list that is needed, and one more for rounding */
        last--;
    for (py = 0; py < c->period; py++)
        for (px = 0; px < c->period; px++) {
            double direction, offset;
            int phase = py * c->period + px;
            gtaoi_noise(c->d.noise, px, py, c->d.frame, &direction, &offset);
            for (k = 0; k < c->slices; k++) {
                int index = phase * c->slices + k;
                gtaoi_slice *s = &c->slice[index];
                double dx, dy, bx, by, b;
                gtaoi_sincospi(gtaoi_slice_turn(c, k, direction), &dy, &dx);
                bx = c->orthographic ? dx : dx / (double)c->d.camera.fx;
                by = c->orthographic ? dy * ratio : dy / (double)gtaoi_fy(&c->d.camera);
                b = sqrt(bx * bx + by * by);
                s->dx = (float)dx, s->dy = (float)dy;
                s->bx = (float)bx, s->by = (float)by;
                s->bb = (float)(bx * bx + by * by);
                s->x_major = (dx < 0.0 ? -dx : dx) >= (dy < 0.0 ? -dy : dy);
                s->sector = gtaoi_direction(s->dx, s->dy);
                if (c->per_pixel_noise)
                    continue;
                if (c->every_pixel)
                    gtaoi_fill_every(c, c->sample + (size_t)index * (size_t)c->max_steps, c->taps + index * GTAOI_NEAR,
                                     px, dx, dy, gtaoi_class_radius(c, last, 1.0 / b, max_radius) + 1.0);
                for (r = 0; r < c->classes; r++) {
                    size_t at = (size_t)index * (size_t)c->classes + (size_t)r;
                    double radius = gtaoi_class_radius(c, r, 1.0 / b, max_radius);
                    double unit = (double)gtaoi_max((float)(dx < 0.0 ? -dx : dx), (float)(dy < 0.0 ? -dy : dy));
                    if (chosen && !chosen[r])
                        continue;
                    if (c->every_pixel)
                        c->count[at] = gtaoi_imax(1, gtaoi_imin((int)(radius * unit + 1e-6), c->max_steps));
                    else
                        c->count[at] =
                            gtaoi_fill_steps(c, c->sample + at * (size_t)c->max_steps, px, dx, dy, radius, offset);
                    if (c->d.far_depth)
                        c->far_begin[at] =
                            gtaoi_fill_far(c, c->sample + at * (size_t)c->max_steps,
                                           c->far_sample + at * (size_t)c->max_steps, c->count[at], px, py);
                }
            }
        }
}

/* ---- instruction sets ------------------------------------------------------------------------------------------- */

#if GTAOI_X86
static void gtaoi_cpuid(unsigned leaf, unsigned r[4]) {
#if defined(_MSC_VER) && !defined(__clang__)
    int i, q[4];
    __cpuidex(q, (int)leaf, 0);
    for (i = 0; i < 4; i++)
        r[i] = (unsigned)q[i];
#else
    __cpuid_count(leaf, 0, r[0], r[1], r[2], r[3]);
#endif
}

/* Which register sets the system saves; CPUID alone does not tell. */
static unsigned gtaoi_xgetbv(void) {
#if defined(_MSC_VER) && !defined(__clang__)
    return (unsigned)_xgetbv(0);
#else
    unsigned lo, hi;
    __asm__ volatile(".byte 0x0f, 0x01, 0xd0" : "=a"(lo), "=d"(hi) : "c"(0)); /* xgetbv */
    return lo;
#endif
}
#endif

/* A bit for each that is compiled in and supported here. */
static unsigned gtaoi_find_isas(void) {
    unsigned found = 1u << GTAO_ISA_AUTO | 1u << GTAO_ISA_SCALAR | (unsigned)GTAOI_NEON << GTAO_ISA_NEON;
#if GTAOI_X86
    unsigned r[4], leaves, saved = 0;
    gtaoi_cpuid(0, r);
    leaves = r[0];
    gtaoi_cpuid(1, r);
    found |= (r[3] >> 26 & 1) << GTAO_ISA_SSE2;
    if (r[2] >> 27 & 1)
        saved = gtaoi_xgetbv();
    if (leaves < 7 || (saved & 6) != 6)
        return found;
    gtaoi_cpuid(7, r);
    found |= (r[1] >> 5 & 1) << GTAO_ISA_AVX2;
    if ((saved & 0xe6) == 0xe6)
        found |= (r[1] >> 16 & r[1] >> 17 & 1) << GTAO_ISA_AVX512;
#endif
    return found;
}

/* Asked for once: on virtual machines every cpuid takes microseconds. */
GTAO_API int gtao_isa_available(gtao_isa isa) {
#if defined(__GNUC__)
    static unsigned found;
    unsigned all = __atomic_load_n(&found, __ATOMIC_RELAXED);
    if (!all)
        __atomic_store_n(&found, all = gtaoi_find_isas(), __ATOMIC_RELAXED);
#else
    unsigned all = gtaoi_find_isas();
#endif
    return (unsigned)isa <= GTAO_ISA_NEON && (all >> isa & 1u);
}

GTAO_API const char *gtao_isa_name(gtao_isa isa) {
    static const char *const names[] = {"auto", "scalar", "sse2", "avx2", "avx512", "neon"};
    return (unsigned)isa <= GTAO_ISA_NEON ? names[isa] : "unknown";
}

static gtao_isa gtaoi_resolve_isa(gtao_isa isa) {
    static const gtao_isa best[] = {GTAO_ISA_AVX512, GTAO_ISA_AVX2, GTAO_ISA_SSE2, GTAO_ISA_NEON};
    unsigned i;
    if (isa != GTAO_ISA_AUTO)
        return isa;
    for (i = 0; i < sizeof best / sizeof best[0]; i++)
        if (gtao_isa_available(best[i]))
            return best[i];
    return GTAO_ISA_SCALAR;
}

/* Per-pixel noise: a tile of directions and offsets, and the step distribution for 64 offsets. */
static void gtaoi_fill_noise(gtao_context *c) {
    double direction, offset, power = c->d.step_power == 0.0f ? 2.0 : (double)c->d.step_power;
    int x, y, j;
    for (y = 0; y < 64; y++)
        for (x = 0; x < 64 + GTAOI_LANES; x++) {
            float *n = c->noise + 2 * y * (64 + GTAOI_LANES) + x;
            gtaoi_noise(c->d.noise, x, y, c->d.frame, &direction, &offset);
            n[0] = (float)direction;
            n[64 + GTAOI_LANES] = (float)(int)(offset * 64.0);
        }
    if (c->every_pixel)
        return;
    for (j = 0; j < c->max_steps; j++)
        for (x = 0; x < 64; x++)
            c->step[64 * j + x] =
                (float)gtaoi_pow(((double)j + ((double)x + 0.5) / 64.0) / (double)c->max_steps, power);
}

/* The layers with their defaults resolved, the first among them. */
static void gtaoi_begin_arcs(gtao_context *c, float unit) {
    const gtao_desc *d = &c->d;
    int i;
    c->layer_count = 1 + d->layer_count;
    c->layer[0].depth = d->depth, c->layer[0].depth_stride = d->depth_stride;
    c->layer[0].back = d->back, c->layer[0].back_stride = d->back_stride;
    for (i = 1; i < c->layer_count; i++)
        c->layer[i] = d->layers[i - 1];
    for (i = 0; i < c->layer_count; i++) {
        if (!c->layer[i].depth_stride)
            c->layer[i].depth_stride = (ptrdiff_t)d->width * 4;
        c->clip |= (c->bounded && c->layer[i].back) << i;
        if (!c->layer[i].back_stride)
            c->layer[i].back_stride = (ptrdiff_t)d->width * 4;
    }
    if (!d->thickness_stride)
        c->d.thickness_stride = (ptrdiff_t)d->width * 4;
    c->per_unit = 1.0f / unit;
    c->connect = GTAOI_CONNECT * c->same_surface;
    c->thickness = d->thickness > 0.0f && d->thickness < 1e30f ? d->thickness / unit : (float)HUGE_VAL;
}

static void gtaoi_fill_sky(float *row, ptrdiff_t n) {
    while (n-- > 0)
        *row++ = GTAOI_SKY;
}

static float gtaoi_height_unit(const gtao_context *c) {
    float radius = c->d.radius;
    if (c->d.camera.projection == GTAO_ORTHOGRAPHIC)
        return c->d.camera.sx;
    return radius >= 1e-30f && radius < 1e30f ? radius : 1.0f;
}

/* All of the context but its tables. */
static void gtaoi_resolve(const gtao_desc *desc, const gtao_output *output, const gtaoi_layout *plan, gtao_context *c) {
    const gtaoi_layout l = *plan;
    const gtao_camera *cam;
    float unit;
    int i, identity;
    memset(c, 0, sizeof *c);
    c->d = *desc;
    c->o = *output;
    c->d.isa = gtaoi_resolve_isa(desc->isa);
    if (!c->d.depth_stride)
        c->d.depth_stride = (ptrdiff_t)desc->width * 4;
    if (!c->d.normal_components)
        c->d.normal_components = 3;
    if (!c->d.normal_stride)
        c->d.normal_stride = (ptrdiff_t)desc->width * c->d.normal_components * 4;
    if (!c->d.mask_stride)
        c->d.mask_stride = desc->width;
    if (!c->o.visibility_stride)
        c->o.visibility_stride = (ptrdiff_t)desc->width * (output->visibility_format == GTAO_FORMAT_FLOAT    ? 4
                                                           : output->visibility_format == GTAO_FORMAT_UNORM8 ? 1
                                                                                                             : 2);
    if (!c->o.bent_components)
        c->o.bent_components = 3;
    if (!c->o.bent_stride)
        c->o.bent_stride = (ptrdiff_t)desc->width * c->o.bent_components * 4;
    if (!c->o.packed_stride)
        c->o.packed_stride = (ptrdiff_t)desc->width * 4;
    if (!c->o.sh_stride)
        c->o.sh_stride = (ptrdiff_t)desc->width * 4;
    if (!c->o.sh_plane_stride)
        c->o.sh_plane_stride = c->o.sh_stride * desc->height;
    if (!c->o.signal_stride)
        c->o.signal_stride = (ptrdiff_t)desc->width * 4;
    if (!c->o.signal_plane_stride)
        c->o.signal_plane_stride = c->o.signal_stride * desc->height;
    if (!c->o.horizon_stride)
        c->o.horizon_stride = (ptrdiff_t)desc->width * 4;
    if (!c->o.horizon_plane)
        c->o.horizon_plane = (c->o.horizon_stride < 0 ? -c->o.horizon_stride : c->o.horizon_stride) * desc->height;
    c->signal = !output->signal ? 0 : output->signal_planes ? output->signal_planes : 2;

    c->every_pixel = l.every_pixel, c->slices = c->slice_end = l.slices, c->max_steps = l.max_steps;
    c->x_end = desc->width;
    c->per_pixel_noise = l.per_pixel_noise, c->period = l.period;
    c->classes = l.classes, c->class_base = l.class_base;
    c->extent_min = l.extent_min, c->extent_max = l.extent_max;
    c->pitch = l.pitch, c->segment = l.segment, c->plane = l.plane;
    c->max_radius = (float)l.max_radius;

    /* Lengths are measured in units of the radius, so that a common power of two in depth and radius changes no bit and
     * nothing overflows; orthographic ones in pixels; unbounded perspective ones as they are. */
    cam = &c->d.camera;
    c->orthographic = cam->projection == GTAO_ORTHOGRAPHIC;
    c->bounded = desc->radius < 1e30f;
    unit = gtaoi_height_unit(c);
    c->w_max = c->bounded ? GTAOI_W_MAX : 1.0f / GTAOI_W_MIN;
    c->reach = gtaoi_min(desc->radius / unit, 1e18f); /* its square is finite */
    c->inner2 = (1.0f - desc->falloff) * (1.0f - desc->falloff);
    c->cosines = desc->estimator == GTAO_ESTIMATOR_MEMO || desc->thin_blend > 0.0f;
    c->bent = output->bent_normals || output->packed || output->sh || c->signal == 5;
    c->arcs = gtaoi_has_arcs(desc);
    c->inv_falloff = desc->falloff > 0.0f ? 1.0f / desc->falloff : 0.0f;
    c->plain = !desc->far_depth && !c->orthographic && c->bounded && !c->every_pixel &&
               desc->noise != GTAO_NOISE_HILBERT && !c->cosines && !c->arcs && !output->sh && !gtaoi_has_planes(output);
    c->z_sky = desc->sky_z > 0.0f ? desc->sky_z : (float)HUGE_VAL;
    if (c->orthographic) {
        float sign = desc->depth_kind == GTAO_DEPTH_HEIGHT ? 1.0f : -1.0f;
        c->w_scale = sign / unit;
        c->w_far = -GTAOI_ORTHO_LIMIT;
        c->bx1 = 1.0f, c->by1 = gtaoi_sy(cam) / cam->sx;
        c->same_surface = GTAOI_SAME_SURFACE_PX;
        if (desc->depth_kind == GTAO_DEPTH_DEVICE)
            c->w_scale = desc->device_scale / unit;
    } else {
        c->bx1 = 1.0f / cam->fx, c->by1 = 1.0f / gtaoi_fy(cam);
        c->cx = cam->off_center ? cam->cx : 0.5f * (float)desc->width;
        c->cy = cam->off_center ? cam->cy : 0.5f * (float)desc->height;
        c->w_numerator = unit;
        c->w_scale = desc->device_scale * unit;
        c->same_surface = GTAOI_SAME_SURFACE_PX * 2.0f / (cam->fx + gtaoi_fy(cam));
    }
    if (c->arcs)
        gtaoi_begin_arcs(c, unit);
    if (desc->depth_kind == GTAO_DEPTH_DEVICE) {
        /* The far plane is at d = 1, or at 0 if height grows with d (reversed). */
        c->w_bias = c->orthographic ? desc->device_bias / unit : desc->device_bias * unit;
        c->w_far = desc->device_scale < 0.0f ? c->w_scale + c->w_bias : c->w_bias;
        if (desc->sky_z > 0.0f)
            c->w_far = gtaoi_max(c->w_far, c->orthographic ? -desc->sky_z / unit : unit / desc->sky_z);
    }

    c->weight_scale = c->bx1 * c->by1 / (float)l.slices;
    if (desc->weighting == GTAO_WEIGHTING_UNIFORM)
        c->weight_scale *= 0.5f;

    for (i = 0, identity = 1; i < 9; i++)
        identity &= desc->normal_to_view[i] == 0.0f;
    for (i = 0; i < 9; i++) {
        float axis = desc->normal_axes[i / 3] == 0.0f ? 1.0f : desc->normal_axes[i / 3];
        c->to_view[i] = axis * (identity ? (i % 4 == 0 ? 1.0f : 0.0f) : desc->normal_to_view[i]);
        c->transform_normals |= c->to_view[i] != (i % 4 == 0 ? 1.0f : 0.0f);
    }
}

/* No cell is known yet. */
static void gtaoi_begin_cells(gtao_context *c, float *cells, uint32_t *prepared) {
    int i;
    c->cells_x = (c->d.width + GTAOI_CELL - 1) / GTAOI_CELL, c->cells_y = (c->d.height + GTAOI_CELL - 1) / GTAOI_CELL;
    c->cell_pitch = gtaoi_cell_pitch(c->d.width);
    for (i = 0; i < GTAOI_CELL_PLANES; i++)
        c->cell[i] = cells + i * c->cell_pitch * c->cells_y;
    memset(cells, 0, (size_t)(GTAOI_CELL_PLANES * c->cell_pitch * c->cells_y) * sizeof(float));
    c->prepared = prepared;
    memset(prepared, 0, (size_t)c->d.height * sizeof *prepared);
    /* Below a rise e in cot h a side of a slice loses, x the rise of a direction, its angle theta from v and h_t that of
     * the tangent plane, cos(theta - n) sin theta dtheta = x sin h_t sin^4 theta dx: at most e^2 / 2, both sides e^2, of
     * an open slice that has 1 or more. With uniform weighting sin^3 theta dx: at most e a side, 2 e of 2. */
    c->rise_min = c->d.weighting == GTAO_WEIGHTING_UNIFORM ? c->d.tolerance : sqrtf(c->d.tolerance);
    c->rise_min = gtaoi_max(0.999f * c->rise_min, GTAOI_RISE_MIN);
    c->skips = (GTAO_SKIP_SKY | GTAO_SKIP_RADIUS | GTAO_SKIP_OPEN | GTAO_SKIP_SECTORS) & ~c->d.no_skip;
    if (c->cosines || c->d.far_depth) /* every sample counts, rounding and all; blocks rise above their pixels */
        c->skips &= (unsigned)(GTAO_SKIP_SKY | GTAO_SKIP_RADIUS);
    if (gtaoi_has_planes(&c->o)) /* what lies between is wanted of all pixels */
        c->skips = 0;
    if (c->signal) /* open pixels too have a weight */
        c->skips &= ~(unsigned)GTAO_SKIP_OPEN;
}

/* The levels' contexts, which write planes of the scratch in place of the caller's buffers. */
static void gtaoi_begin_effort(gtao_context *c, const gtaoi_layout *l, char *base) {
    gtaoi_effort *e = (gtaoi_effort *)(void *)(base + l->effort);
    int i;
    memset(e, 0, sizeof *e);
    e->levels = l->levels;
    e->max_radius = l->max_radius;
    e->tiles_x = (c->d.width + GTAOI_EFFORT_W - 1) / GTAOI_EFFORT_W;
    e->tiles_y = (c->d.height + GTAOI_EFFORT_H - 1) / GTAOI_EFFORT_H;
    e->pitch = l->effort_pitch;
    e->plane = e->pitch * c->d.height;
    e->more = (c->bent ? 3 : 0) + (c->o.sh ? gtaoi_sh_count(&c->o) : 0);
    e->foot = c->orthographic ? 0.0f : c->same_surface / GTAOI_SAME_SURFACE_PX;
    e->foot_bias = c->orthographic ? 1.0f : 0.0f;
    e->tile = (gtaoi_effort_tile *)(void *)(base + l->tiles);
    memset(e->tile, 0, (size_t)e->tiles_x * (size_t)e->tiles_y * sizeof *e->tile);
    for (i = 0; i < GTAOI_EFFORT_KINDS; i++)
        e->planes[i] = (float *)(void *)(base + l->effort_plane) + i * e->plane + GTAOI_EFFORT_PAD;
    for (i = 0; i < e->levels; i++) {
        gtao_context *level = &e->level[i];
        *level = *c;
        memset(&level->o, 0, sizeof level->o);
        level->signal = c->bent ? 5 : 2;
        level->o.signal = e->planes[GTAOI_EFFORT_SIGNAL];
        level->o.signal_stride = e->pitch * 4, level->o.signal_plane_stride = e->plane * 4;
        if (c->o.sh) {
            level->o.sh = e->planes[GTAOI_EFFORT_SIGNAL + 5], level->o.sh_bands = c->o.sh_bands;
            level->o.sh_stride = e->pitch * 4, level->o.sh_plane_stride = e->plane * 4;
        }
        level->weight_scale *= (float)c->slices;     /* the sum over the slices, not their mean */
        level->skips &= (unsigned)GTAO_SKIP_SECTORS; /* sky and open pixels too have a height and a weight */
        if (i == 0) {
            level->keep = e->planes[GTAOI_EFFORT_HEIGHT];
        } else {
            char *tables = base + l->level_tables[i];
            uint64_t at[4];
            gtaoi_level_tables(i, c->classes, l->max_radius, at);
            level->before = c->slices;
            level->slices = level->slice_end = gtaoi_levels[i].slices - c->slices;
            level->every_pixel = gtaoi_levels[i].steps == 0;
            level->max_steps = level->every_pixel ? l->max_radius : gtaoi_levels[i].steps;
            level->plain = level->plain && !level->every_pixel;
            level->skips = 0; /* rows come one by one */
            level->slice = (gtaoi_slice *)(void *)(tables + at[0]);
            level->sample = (gtaoi_sample *)(void *)(tables + at[1]);
            level->count = (int *)(void *)(tables + at[2]);
            level->taps = (gtaoi_taps *)(void *)(tables + at[3]);
        }
    }
    c->effort = e;
}

/* The whole context in scratch at `base`, where it stands first. */
static void gtaoi_begin(const gtao_desc *desc, const gtao_output *output, const gtaoi_layout *plan, char *base,
                        gtao_context *c) {
    const gtaoi_layout l = *plan;
    int i;
    gtaoi_resolve(desc, output, plan, c);
    c->w = (float *)(void *)(base + l.w);
    c->slice = (gtaoi_slice *)(void *)(base + l.slice);
    c->sample = (gtaoi_sample *)(void *)(base + l.sample);
    c->taps = (gtaoi_taps *)(void *)(base + l.taps);
    c->count = (int *)(void *)(base + l.count);
    c->noise = (float *)(void *)(base + l.noise);
    c->step = c->noise + 2 * 64 * (64 + GTAOI_LANES);
    gtaoi_begin_cells(c, (float *)(void *)(base + l.cells), (uint32_t *)(void *)(base + l.prepared));
    c->far_sample = (gtaoi_far *)(void *)(base + l.far_sample);
    c->far_begin = (int *)(void *)(base + l.far_begin);
    c->far_w = (float *)(void *)(base + l.far_w);
    c->far_pitch = l.far_pitch;
    gtaoi_fill_tables(c, l.max_radius, NULL);
    if (c->per_pixel_noise)
        gtaoi_fill_noise(c);
    c->w += 2 * c->pitch;
    for (i = 0; i < l.planes; i++) {
        float *w = c->w + i * c->plane;
        gtaoi_fill_sky(w - 2 * c->pitch, c->pitch);
        gtaoi_fill_sky(w + (ptrdiff_t)(desc->height + 1) * c->pitch, c->pitch);
    }
    if (desc->error_target > 0.0f)
        gtaoi_begin_effort(c, plan, base);
}

GTAO_API gtao_result gtao_begin(const gtao_desc *desc, const gtao_output *output, void *scratch, size_t scratch_size,
                                gtao_context **context) {
    gtao_result result = gtaoi_check_desc(desc);
    gtaoi_layout l;
    char *base;
    if (result == GTAO_OK)
        result = gtaoi_check_output(desc, output);
    if (result != GTAO_OK)
        return result;
    gtaoi_plan(desc, &l);
    if (!scratch || scratch_size < l.total || !context)
        return GTAO_ERROR_SCRATCH;
    base = (char *)scratch + ((64 - ((uintptr_t)scratch & 63)) & 63);
    *context = (gtao_context *)(void *)base;
    gtaoi_begin(desc, output, &l, base, *context);
    return GTAO_OK;
}

GTAO_API int gtao_desc_slices(const gtao_desc *desc) {
    if (gtaoi_check_desc(desc) != GTAO_OK)
        return 0;
    return desc->slices ? desc->slices : gtaoi_presets[desc->preset].slices;
}
GTAO_API int gtao_context_slices(const gtao_context *context) {
    return context->slices;
}
GTAO_API int gtao_context_steps(const gtao_context *context) {
    return context->every_pixel ? 0 : context->max_steps;
}
GTAO_API gtao_isa gtao_context_isa(const gtao_context *context) {
    return context->d.isa;
}

GTAO_API void gtao_context_constants(const gtao_context *context, gtao_constants *constants) {
    const gtao_context *c = context;
    gtao_constants *k = constants;
    memset(k, 0, sizeof *k);
    k->width = c->d.width, k->height = c->d.height, k->depth_kind = (int)c->d.depth_kind, k->border = (int)c->d.border;
    k->estimator = (int)c->d.estimator, k->weighting = (int)c->d.weighting, k->noise = (int)c->d.noise;
    k->frame = (int)(c->d.frame & 0x7fffffff); /* both noises repeat within it */
    k->orthographic = c->orthographic, k->bounded = c->bounded, k->every_pixel = c->every_pixel, k->arcs = c->arcs;
    k->clip = c->clip, k->cosines = c->cosines, k->layers = c->arcs ? c->layer_count : 1;
    k->slices = c->slices, k->steps = c->max_steps, k->period = c->period, k->classes = c->classes;
    k->class_base = (int)c->class_base;
    k->radius = c->bounded ? c->d.radius : 1e30f, k->falloff = c->d.falloff, k->thin_blend = c->d.thin_blend;
    k->step_power = c->d.step_power > 0.0f ? c->d.step_power : 2.0f;
    k->extent_min = c->extent_min, k->extent_max = c->extent_max, k->max_radius = c->max_radius;
    k->bx1 = c->bx1, k->by1 = c->by1, k->cx = c->cx, k->cy = c->cy;
    k->unit = gtaoi_height_unit(c), k->reach = c->reach, k->inner2 = c->inner2, k->inv_falloff = c->inv_falloff;
    k->w_scale = c->w_scale, k->w_bias = c->w_bias, k->w_numerator = c->w_numerator, k->w_far = c->w_far;
    k->w_max = c->w_max, k->z_sky = gtaoi_min(c->z_sky, FLT_MAX), k->same_surface = c->same_surface;
    memcpy(k->to_view, c->to_view, sizeof k->to_view);
    k->connect = c->connect, k->thickness = gtaoi_min(c->thickness, 1e30f), k->weight_scale = c->weight_scale;
    k->sky = GTAOI_SKY, k->sky_limit = GTAOI_SKY_LIMIT, k->ray_limit = GTAOI_RAY_LIMIT, k->w_min = GTAOI_W_MIN;
    k->ortho_limit = GTAOI_ORTHO_LIMIT, k->kappa_limit = GTAOI_KAPPA_LIMIT, k->rise_min = c->rise_min;
    k->facing_min = GTAOI_FACING_MIN, k->arc_limit = GTAOI_ARC_LIMIT, k->sectors = GTAOI_SECTORS;
}

GTAO_API gtao_direction gtao_context_direction(const gtao_context *context, int phase, int k) {
    const gtaoi_slice *s = context->slice + phase * context->slices + k;
    gtao_direction d;
    d.dx = s->dx, d.dy = s->dy, d.bx = s->bx, d.by = s->by, d.bb = s->bb;
    return d;
}

GTAO_API int gtao_context_taps(const gtao_context *context, int phase, int k, int radius_class, gtao_tap *taps) {
    const gtao_context *c = context;
    int index = phase * c->slices + k, n, i;
    size_t list = (size_t)index * (size_t)c->classes + (size_t)radius_class;
    const gtaoi_sample *s = c->sample + (c->every_pixel ? (size_t)index : list) * (size_t)c->max_steps;
    if (c->per_pixel_noise)
        return 0;
    n = c->count[list];
    for (i = 0; taps && i < n; i++) {
        taps[i].qx = s[i].qx, taps[i].qy = s[i].qy;
        taps[i].inv_length = s[i].inv_length, taps[i].ux = s[i].ux, taps[i].uy = s[i].uy;
    }
    return n;
}

GTAO_API void gtao_context_heights(const gtao_context *context, int layer, int back, int y, float *row) {
    const gtao_context *c = context;
    const float *from = c->w + (2 * layer + (back != 0)) * c->plane + (ptrdiff_t)y * c->pitch + GTAOI_PAD;
    int x, shift = c->period == 4 ? 2 : 0;
    for (x = 0; x < c->d.width; x++)
        row[x] = from[(x & (c->period - 1)) * c->segment + (x >> shift)];
}

GTAO_API void gtao_context_slice(const gtao_context *context, int x, int y, int k, float o[3], float v[3]) {
    GTAOI_NO_CONTRACT
    const gtao_context *c = context;
    double direction, offset, dx, dy, r[3], b[3], along, length;
    int i;
    gtaoi_noise(c->d.noise, x, y, c->d.frame, &direction, &offset);
    gtaoi_sincospi(((double)k + direction) / (double)c->slices, &dy, &dx);
    r[0] = r[1] = 0.0, r[2] = 1.0;
    if (!c->orthographic) {
        r[0] = ((double)x + 0.5 - (double)c->cx) * (double)c->bx1;
        r[1] = ((double)y + 0.5 - (double)c->cy) * (double)c->by1;
    }
    length = sqrt(r[0] * r[0] + r[1] * r[1] + 1.0);
    b[0] = dx * (double)c->bx1, b[1] = dy * (double)c->by1, b[2] = 0.0;
    along = (b[0] * r[0] + b[1] * r[1]) / (length * length);
    for (i = 0; i < 3; i++)
        b[i] -= along * r[i], v[i] = (float)(-r[i] / length);
    length = sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2]);
    for (i = 0; i < 3; i++)
        o[i] = (float)(b[i] / length);
}

/* ---- rows ------------------------------------------------------------------------------------------------------- */

static int gtaoi_wrap(int i, int n) {
    i %= n;
    return i < 0 ? i + n : i;
}

/* Height row that stands for image row y: the row itself, or what the border makes of it. */
static const float *gtaoi_row(const gtao_context *c, int y) {
    int h = c->d.height;
    if (c->d.border == GTAO_BORDER_CLAMP)
        y = gtaoi_imin(gtaoi_imax(y, 0), h - 1);
    if (c->d.border == GTAO_BORDER_WRAP)
        y = gtaoi_wrap(y, h);
    if (y < 0 || y >= h)
        y = h + 1; /* the row of sky */
    return c->w + (ptrdiff_t)y * c->pitch;
}

/* The padding of a row, once its pixels are there. */
static void gtaoi_pad_row(const gtao_context *c, float *row) {
    int p, i, w = c->d.width, shift = c->period == 4 ? 2 : 0, mask = c->period - 1;
    for (p = 0; p < c->period; p++) {
        float *segment = row + (ptrdiff_t)p * c->segment + GTAOI_PAD;
        int n = w > p ? (w - p + c->period - 1) / c->period : 0, end = c->segment - GTAOI_PAD;
        if (c->d.border == GTAO_BORDER_OPEN) {
            gtaoi_fill_sky(segment - GTAOI_PAD, GTAOI_PAD);
            gtaoi_fill_sky(segment + n, end - n);
            continue;
        }
        for (i = -GTAOI_PAD; i < end; i = i + 1 == 0 ? n : i + 1) {
            int x = i * c->period + p;
            x = c->d.border == GTAO_BORDER_WRAP ? gtaoi_wrap(x, w) : gtaoi_imin(gtaoi_imax(x, 0), w - 1);
            segment[i] = row[(x & mask) * c->segment + GTAOI_PAD + (x >> shift)];
        }
    }
}

/* The padding of row y of a plane of heights, and the rows above and below the image. */
static void gtaoi_border_rows(const gtao_context *c, float *w, int y) {
    int h = c->d.height;
    float *row = w + (ptrdiff_t)y * c->pitch;
    gtaoi_pad_row(c, row);
    if (c->d.border == GTAO_BORDER_OPEN) {
        if (y == 0)
            gtaoi_fill_sky(row - c->pitch, c->pitch);
        if (y == h - 1)
            gtaoi_fill_sky(row + c->pitch, c->pitch);
    } else {
        int above = c->d.border == GTAO_BORDER_CLAMP ? 0 : h - 1, below = h - 1 - above;
        if (y == above)
            memcpy(w - c->pitch, row, (size_t)c->pitch * sizeof(float));
        if (y == below)
            memcpy(w + (ptrdiff_t)h * c->pitch, row, (size_t)c->pitch * sizeof(float));
    }
}

/* Visibility v, bent normals b (3 floats a pixel; null: already there) and the further planes s of the signal of n
 * pixels from (x, y), in image order, to the caller's buffers. */
static void gtaoi_store(const gtao_context *c, int x, int y, int n, const float *v, const float *b,
                        float s[][4 * GTAOI_LANES]) {
    const gtao_output *o = &c->o;
    int i;
    for (i = 0; i < c->signal; i++)
        memcpy((char *)o->signal + i * o->signal_plane_stride + (ptrdiff_t)y * o->signal_stride + (ptrdiff_t)x * 4,
               i ? s[i - 1] : v, (size_t)n * 4);
    if (o->visibility) {
        char *row = (char *)o->visibility + (ptrdiff_t)y * o->visibility_stride;
        if (o->visibility_format == GTAO_FORMAT_FLOAT) {
            memcpy(row + (ptrdiff_t)x * 4, v, (size_t)n * 4);
        } else if (o->visibility_format == GTAO_FORMAT_UNORM8) {
            for (i = 0; i < n; i++)
                ((uint8_t *)row)[x + i] = (uint8_t)gtaoi_unorm(v[i], 255.0f);
        } else {
            for (i = 0; i < n; i++) {
                uint16_t u = (uint16_t)gtaoi_unorm(v[i], 65535.0f);
                memcpy(row + (ptrdiff_t)(x + i) * 2, &u, 2);
            }
        }
    }
    if (o->bent_normals && b) {
        float *to = (float *)(void *)((char *)o->bent_normals + (ptrdiff_t)y * o->bent_stride) +
                    (ptrdiff_t)x * o->bent_components;
        if (o->bent_components == 3) {
            memcpy(to, b, (size_t)n * 12);
        } else {
            for (i = 0; i < n; i++, to += 4)
                to[0] = b[3 * i], to[1] = b[3 * i + 1], to[2] = b[3 * i + 2], to[3] = v[i];
        }
    }
    if (o->packed) {
        char *row = (char *)o->packed + (ptrdiff_t)y * o->packed_stride;
        uint32_t u[4 * GTAOI_LANES];
        for (i = 0; i < n; i++)
            u[i] = gtaoi_pack(v[i], b[3 * i], b[3 * i + 1], b[3 * i + 2]);
        memcpy(row + (ptrdiff_t)x * 4, u, (size_t)n * 4);
    }
}

/* A group's `n` values of plane k of the intermediates at `base`, the first of pixel (x, y). */
static void gtaoi_store_lanes(const gtao_context *c, void *base, int k, const void *values, int n, int x, int y) {
    char *row = (char *)base + (ptrdiff_t)k * c->o.horizon_plane + (ptrdiff_t)y * c->o.horizon_stride;
    int i;
    for (i = 0; i < n; i++, x += c->period)
        if (x >= c->x_begin && x < c->x_end)
            memcpy(row + (ptrdiff_t)x * 4, (const char *)values + 4 * i, 4);
}

/* 1 + ry^2 of a row's rays. */
static float gtaoi_ry2(const gtao_context *c, int y) {
    GTAOI_NO_CONTRACT
    float ry = gtaoi_clamp(((float)y + 0.5f - c->cy) * c->by1, -GTAOI_RAY_LIMIT, GTAOI_RAY_LIMIT);
    return ry * ry + 1.0f;
}

/* ---- effort by need ---- */

/* Results of up to 64 pixels of a row, visibility first, to the caller's buffers. */
static void gtaoi_store_shared(const gtao_context *c, int x, int y, float slices, float result[][GTAOI_EFFORT_W]) {
    GTAOI_NO_CONTRACT
    const gtaoi_effort *e = c->effort;
    const float *own = e->planes[GTAOI_EFFORT_SIGNAL] + (ptrdiff_t)y * e->pitch + x;
    const float *height = e->planes[GTAOI_EFFORT_HEIGHT] + (ptrdiff_t)y * e->pitch + x;
    float b[3 * GTAOI_EFFORT_W], s[4][4 * GTAOI_LANES];
    int i, k, n = gtaoi_imin(GTAOI_EFFORT_W, c->d.width - x), bent = c->bent ? 3 : 0;
    for (i = 0; c->bent && i < n; i++) {
        float bx = result[1][i], by = result[2][i], bz = result[3][i], length = bx * bx + by * by + bz * bz;
        if (!(length >= 1e-12f)) { /* neighbours that cancel each other */
            bx = own[2 * e->plane + i], by = own[3 * e->plane + i], bz = own[4 * e->plane + i];
            length = bx * bx + by * by + bz * bz;
        }
        if (!(length >= 1e-12f)) /* slices of its own that do, with normals that are none */
            bx = by = 0.0f, bz = -1.0f, length = 1.0f;
        length = (float)sqrt((double)length);
        b[3 * i] = bx / length, b[3 * i + 1] = by / length, b[3 * i + 2] = bz / length;
        s[1][i] = bx, s[2][i] = by, s[3][i] = bz;
    }
    if (c->d.estimator == GTAO_ESTIMATOR_MEMO)
        slices = 1.0f;
    for (i = 0; c->signal && i < n; i++) /* 1 where there is no surface */
        s[0][i] = height[i] > GTAOI_SKY_LIMIT ? own[e->plane + i] / slices : 1.0f;
    gtaoi_store(c, x, y, n, result[0], b, s);
    for (k = 0; c->o.sh && k < gtaoi_sh_count(&c->o); k++)
        memcpy((char *)c->o.sh + (ptrdiff_t)k * c->o.sh_plane_stride + (ptrdiff_t)y * c->o.sh_stride + (ptrdiff_t)x * 4,
               result[1 + bent + k], (size_t)n * 4);
}

static void gtaoi_sum_tile(gtaoi_effort_tile *t, float columns[5][GTAOI_EFFORT_W]) {
    GTAOI_NO_CONTRACT
    int i;
    t->variance = t->alone = t->count = 0.0f, t->w_least = FLT_MAX, t->w_most = -FLT_MAX;
    for (i = 0; i < GTAOI_EFFORT_W; i++) {
        t->variance += columns[0][i], t->count += columns[1][i], t->alone += columns[4][i];
        t->w_least = gtaoi_min(t->w_least, columns[2][i]), t->w_most = gtaoi_max(t->w_most, columns[3][i]);
    }
    if (t->count > 0.0f) /* clutter keeps more error than its variance says, smooth shade less: fitted */
        t->variance *= 0.7f + 60.0f * t->variance / t->count;
}

/* Index of the lowest and of the highest bit; m is not 0. */
GTAOI_INLINE int gtaoi_lowest(uint64_t m) {
#if defined(__GNUC__) || defined(__clang__)
    return __builtin_ctzll(m);
#else
    int i = 0;
    while (!(m >> i & 1))
        i++;
    return i;
#endif
}
GTAOI_INLINE int gtaoi_highest(uint64_t m) {
#if defined(__GNUC__) || defined(__clang__)
    return 63 - __builtin_clzll(m);
#else
    int i = 63;
    while (!(m >> i & 1))
        i--;
    return i;
#endif
}

GTAOI_INLINE int gtaoi_popcount(unsigned m) {    /* of 16 bits */
    if (m == 0xffffu || m == 0xffu || m == 0xfu) /* whole groups */
        return m == 0xffffu ? 16 : m == 0xffu ? 8 : 4;
    m = (m & 0x5555u) + (m >> 1 & 0x5555u);
    m = (m & 0x3333u) + (m >> 2 & 0x3333u);
    m = (m & 0x0f0fu) + (m >> 4 & 0x0f0fu);
    return (int)((m & 31u) + (m >> 8));
}

/* Whether a sample and its mirror image are over the image for a whole group: with the outermost, all are. */
GTAOI_INLINE int gtaoi_interior(const gtao_context *c, const gtaoi_sample *s, int x0, int x1, int y) {
    int ax = s->qx < 0 ? -s->qx : s->qx, ay = s->qy < 0 ? -s->qy : s->qy;
    return y >= ay && y + ay < c->d.height && x0 >= ax && x1 + ax < c->d.width;
}

/* Leading samples, out of n, on the side of `sign` for which a group at x0 .. x1, y is still over the image (their
 * offsets grow with the index); second taps count where what lies outside is known to be sky. */
static int gtaoi_reach(const gtao_context *c, const gtaoi_sample *s, int n, int sign, int x0, int x1, int y) {
    int lo = 0, hi = n, margin = c->every_pixel && c->d.border == GTAO_BORDER_OPEN && c->d.thin_blend == 0.0f;
    while (lo < hi) {
        int mid = hi == n ? n - 1 : (lo + hi) / 2, qx = sign * s[mid].qx, qy = sign * s[mid].qy;
        if (y + qy >= -margin && y + qy < c->d.height + margin && x0 + qx < c->d.width + margin && x1 + qx >= -margin)
            lo = mid + 1;
        else
            hi = mid;
    }
    return lo;
}

/* The list of samples of a slice that was asked for last in a row. */
typedef struct gtaoi_over {
    float key;      /* class of the radius; 0: none yet */
    int index;      /* of its slice */
    int n, rows[2]; /* samples, and how many of them are over the image's rows on the + and - side */
    int columns;    /* that the last is away */
    const gtaoi_sample *list;
} gtaoi_over;

enum {
    GTAOI_MARCH = 32, /* samples of a list that are searched before those in the falloff ring are looked at */
    GTAOI_NOTES_MAX = 16
};

static void gtaoi_find_list(const gtao_context *c, int index, float key, int y, gtaoi_over *over) {
    size_t at = (size_t)index * (size_t)c->classes + (size_t)gtaoi_class(c, key);
    const gtaoi_sample *q = c->sample + at * (size_t)c->max_steps;
    int side, i, n = c->count[at];
    over->key = key, over->index = index, over->n = n, over->list = q;
    over->columns = gtaoi_imax(q[n - 1].qx, -q[n - 1].qx);
    for (side = 0; side < 2; side++) {
        for (i = n; i > 0; i--) {
            int row = side ? y - q[i - 1].qy : y + q[i - 1].qy;
            if (row >= 0 && row < c->d.height)
                break;
        }
        over->rows[side] = i;
    }
}

/* Offsets, from pixel x of row y, of samples that the border moves. Second taps, if any, lie one pixel
 * further along x or y. */
static void gtaoi_remap(const gtao_context *c, const gtaoi_sample *s, int n, int x, int y, int second_along_x,
                        gtaoi_sample *out) {
    int i, k, period = c->period, shift = period == 4 ? 2 : 0, phase = x & (period - 1), span = period * GTAOI_LANES;
    for (i = 0; i < n; i++) {
        out[i] = s[i];
        for (k = 0; k < 4; k++) {
            int sign = k & 1 ? -1 : 1, second = k >= 2 && c->every_pixel && s[i].ux > 0.0f;
            int px = x + sign * (s[i].qx + (second && second_along_x)),
                py = y + sign * (s[i].qy + (second && !second_along_x));
            if (c->d.border != GTAO_BORDER_WRAP) {
                int margin = c->d.border == GTAO_BORDER_OPEN; /* the rows of sky */
                px = gtaoi_imin(gtaoi_imax(px, -span), c->d.width);
                py = gtaoi_imin(gtaoi_imax(py, -margin), c->d.height - 1 + margin);
            } else {
                px = gtaoi_wrap(px, c->d.width);
                py = gtaoi_wrap(py, c->d.height);
            }
            out[i].offset[k] = (int32_t)((py - y) * (int)c->pitch + ((px & (period - 1)) - phase) * c->segment +
                                         ((px - (px & (period - 1))) / period) - (x >> shift));
        }
    }
}

/* ---- what can rise ---------------------------------------------------------------------------------------------- */

/* Planes of a cell, with room for what rounding does: in themselves, and in the search, which takes a sample's height
 * times 1 / |q|, the pixel's too, and sums: half an ulp of a height each, three in all; but at |q| = 1 the products are
 * exact, and from there on it is |q| >= sqrt(2), where what a rise must exceed is as much more. Between two taps half an
 * ulp more, and no such gap. A half falls to the samples' upper plane, the other to the pixels' lower one. */
static void gtaoi_keep_cell(const gtao_context *c, ptrdiff_t at, float w0, float gx, float gy, float up, float down,
                            float most, float least) {
    GTAOI_NO_CONTRACT
    int some_sky = !(least > GTAOI_SKY_LIMIT);
    if (up > GTAOI_CELL_NONE) {
        float ulps = c->every_pixel ? 1.1920929e-7f : 7.1525574e-8f; /* 2 and 1.2 times 2^-24 */
        float size = 0.5f * (float)GTAOI_CELL * (gtaoi_abs(gx) + gtaoi_abs(gy)), centre = w0, shift, room;
        int solid = down < 0.5f * -GTAOI_CELL_NONE;
        if (solid)
            centre += 0.5f * (up + down);
        shift = centre - w0, w0 = centre;
        up -= shift, down -= shift;
        size += gtaoi_abs(shift) + gtaoi_abs(up) + (solid ? gtaoi_abs(down) : 0.0f);
        room = ulps * (gtaoi_abs(w0) + size) + 2.3841858e-7f * size;
        up += room, down -= room;
        most = gtaoi_min(most, w0 + size + up), least = gtaoi_max(least, (w0 - size) + down);
    }
    c->cell[GTAOI_CELL_W0][at] = w0, c->cell[GTAOI_CELL_GX][at] = gx, c->cell[GTAOI_CELL_GY][at] = gy;
    c->cell[GTAOI_CELL_UP][at] = up;
    c->cell[GTAOI_CELL_DOWN][at] = down;
    c->cell[GTAOI_CELL_MOST][at] = most;
    c->cell[GTAOI_CELL_LEAST][at] = least;
    c->cell[GTAOI_CELL_SKY][at] = some_sky ? 1.0f : 0.0f;
}

/* A plane for cell k of a stretch, through four of its pixels, for its lanes; level if one of them is sky. Any plane is
 * right: a better one is tighter. */
static void gtaoi_cell_plane(const gtao_context *c, const float *at, int rows, int per, int k, float *w0, float *gx,
                             float *gy) {
    GTAOI_NO_CONTRACT
    const int first = 1, last = 14, shift = c->period == 4 ? 2 : 0, mask = c->period - 1;
    int i, below = gtaoi_imin(last, rows - 1);
    float w[4], mean = 0.0f, x = 0.0f, y = 0.0f;
    for (i = 0; i < 4; i++) {
        int column = k * GTAOI_CELL + (i & 1 ? last : first), row = i & 2 ? below : gtaoi_imin(first, below);
        w[i] = at[row * c->pitch + (column & mask) * c->segment + (column >> shift)];
        mean = w[i] > GTAOI_SKY_LIMIT ? w[i] : mean;
    }
    if (below > first && w[0] > GTAOI_SKY_LIMIT && w[1] > GTAOI_SKY_LIMIT && w[2] > GTAOI_SKY_LIMIT &&
        w[3] > GTAOI_SKY_LIMIT) {
        x = ((w[1] - w[0]) + (w[3] - w[2])) * (0.5f / (float)(last - first));
        y = ((w[2] - w[0]) + (w[3] - w[1])) * (0.5f / (float)(below - first));
    }
    for (i = k * per; i < (k + 1) * per; i++)
        w0[i] = mean, gx[i] = x, gy[i] = y;
}

/* A cell in which layers lie over one another, pixel by pixel. */
static void gtaoi_cell_rest(const gtao_context *c, int cx, int cy) {
    GTAOI_NO_CONTRACT
    const float half = 0.5f * (float)(GTAOI_CELL - 1);
    int x_end = gtaoi_imin((cx + 1) * GTAOI_CELL, c->d.width), y_end = gtaoi_imin((cy + 1) * GTAOI_CELL, c->d.height);
    int x, y, k, layers = c->arcs ? c->layer_count : 1, shift = c->period == 4 ? 2 : 0, nx = 0, ny = 0;
    ptrdiff_t at = cy * c->cell_pitch + cx;
    float w0 = 0.0f, gx = 0.0f, gy = 0.0f, up = GTAOI_CELL_NONE, down = -GTAOI_CELL_NONE;
    float above[GTAOI_CELL], before;
    for (k = 0; k < layers; k++) {
        const float *plane = c->w + 2 * k * c->plane;
        int pass;
        for (pass = k > 0; pass < 2; pass++) { /* gradients from neighbours, then what lies above and below */
            for (x = 0; x < GTAOI_CELL; x++)
                above[x] = GTAOI_SKY;
            for (y = cy * GTAOI_CELL; y < y_end; y++) {
                before = GTAOI_SKY;
                for (x = cx * GTAOI_CELL; x < x_end; x++) {
                    int i = x - cx * GTAOI_CELL;
                    float w = plane[y * c->pitch + (x & (c->period - 1)) * c->segment + GTAOI_PAD + (x >> shift)], d;
                    if (w > GTAOI_SKY_LIMIT) {
                        if (pass == 1) {
                            d = (w - w0) - (gx * ((float)i - half) + gy * ((float)(y - cy * GTAOI_CELL) - half));
                            up = gtaoi_max(up, d);
                            if (k == 0)
                                down = gtaoi_min(down, d);
                        } else {
                            w0 = w0 == 0.0f ? w : w0;
                            if (before > GTAOI_SKY_LIMIT)
                                gx += w - before, nx++;
                            if (above[i] > GTAOI_SKY_LIMIT)
                                gy += w - above[i], ny++;
                        }
                    }
                    before = above[i] = w;
                }
            }
            if (pass == 0)
                gx = nx ? gx / (float)nx : 0.0f, gy = ny ? gy / (float)ny : 0.0f;
        }
    }
    gtaoi_keep_cell(c, at, w0, gx, gy, up, down, FLT_MAX, -FLT_MAX);
}

/* Something may rise at distances lo .. hi in the directions from (0, 0) to the box. `all`: bounds that hold for every
 * direction. */
static void gtaoi_may_rise(gtaoi_tile *t, float all[2], float x0, float x1, float y0, float y1, float lo, float hi) {
    int k, end;
    if (y0 > 0.0f) {
        k = x1 > 0.0f ? gtaoi_direction(x1, y0) : gtaoi_direction(x1, y1);
        end = x0 < 0.0f ? gtaoi_direction(x0, y0) : gtaoi_direction(x0, y1);
    } else if (y1 < 0.0f) {
        k = x0 < 0.0f ? gtaoi_direction(x0, y1) : gtaoi_direction(x0, y0);
        end = x1 > 0.0f ? gtaoi_direction(x1, y1) : gtaoi_direction(x1, y0);
    } else if (x0 > 0.0f) {
        k = gtaoi_direction(x0, y0), end = gtaoi_direction(x0, y1);
    } else if (x1 < 0.0f) {
        k = gtaoi_direction(x1, y1), end = gtaoi_direction(x1, y0);
    } else { /* it holds the pixel itself */
        all[0] = gtaoi_min(all[0], lo), all[1] = gtaoi_max(all[1], hi);
        return;
    }
    for (;; k = (k + 1) & (GTAOI_DIRECTIONS - 1)) {
        t->lo[k] = gtaoi_min(t->lo[k], lo), t->hi[k] = gtaoi_max(t->hi[k], hi);
        if (k == end)
            break;
    }
}

/* The part of a list of samples that may rise: [range[0], range[1]) on the + side, to range[2] on the - side. */
static void gtaoi_range(const gtao_context *c, const gtaoi_tile *t, int index, const gtaoi_sample *q, int n,
                        int range[3]) {
    GTAOI_NO_CONTRACT
    const gtaoi_slice *s = c->slice + index;
    int side, begin, end, mid;
    range[0] = t ? n : 0, range[1] = range[2] = t ? 0 : n;
    for (side = 0; t && side < 2; side++) {
        int k = (s->sector + side * GTAOI_DIRECTIONS / 2) & (GTAOI_DIRECTIONS - 1);
        float lo = t->lo[k] * 0.99999f, hi = t->hi[k] * 1.00001f;
        if (!(lo <= hi))
            continue;
        begin = 0, end = n;
        while (begin < end && q[0].inv_length * lo > 1.0f) { /* the first that is not nearer than lo */
            mid = (begin + end) / 2;
            if (q[mid].inv_length * lo > 1.0f)
                begin = mid + 1;
            else
                end = mid;
        }
        range[0] = gtaoi_imin(range[0], begin);
        end = n;
        while (begin < end && q[n - 1].inv_length * hi < 1.0f) { /* the first that is farther than hi */
            mid = (begin + end) / 2;
            if (q[mid].inv_length * hi >= 1.0f)
                begin = mid + 1;
            else
                end = mid;
        }
        range[1 + side] = end;
    }
}

/* Whether no sample of a phase of the noise, whose slices start at `index`, lies where something may rise. */
static int gtaoi_directions_open(const gtao_context *c, const gtaoi_tile *t, int index) {
    GTAOI_NO_CONTRACT
    int k, open = 1;
    for (k = index; k < index + c->slices; k++) {
        int plus = c->slice[k].sector, minus = (plus + GTAOI_DIRECTIONS / 2) & (GTAOI_DIRECTIONS - 1);
        open &= !(t->lo[plus] <= t->hi[plus]) && !(t->lo[minus] <= t->hi[minus]);
    }
    return open;
}

/* Samples begin .. n - 1 on both sides of `times` pixels, of which a range is taken. */
static void gtaoi_count_samples(const int range[3], int begin, int n, int times, gtao_stats *stats) {
    int from = gtaoi_imax(range[0], begin), taken;
    taken = gtaoi_imax(gtaoi_imin(range[1], n) - from, 0) + gtaoi_imax(gtaoi_imin(range[2], n) - from, 0);
    stats->samples += (uint64_t)(taken * times);
    stats->samples_skipped += (uint64_t)((2 * gtaoi_imax(n - begin, 0) - taken) * times);
}

/* A tile that looks around. A sample of a cell, of height w, at offset q from a pixel of height w0 and gradient g, rises
 * above that pixel's tangent plane by
 *   w - w0 - g.q = (w - G.s) - (w0 - G.p) + (G - g).q <= top + slack |q|,   q = s - p,   G the tile's gradient
 * and does not count if that is at most the floor times |q|: where top <= room |q|. */
typedef struct gtaoi_looking {
    float x, y, w, low;   /* the tile's origin; heights are relative to w; least w0 - G.p */
    float x0, x1, y0, y1; /* its pixels */
    float room, inv_room; /* floor less slack, height per pixel */
    float radius;         /* pixels */
    float behind, before; /* heights beyond which the radius does not reach */
    float all[2];         /* where something may rise in every direction */
    int candidates;       /* how many more cells may rise; below 0 it is not worth it: anything may */
} gtaoi_looking;

/* `top` of a cell, exact but for 2^-52. */
static double gtaoi_cell_top(const gtao_context *c, const gtaoi_tile *t, const gtaoi_looking *l, ptrdiff_t at, float x,
                             float y) {
    GTAOI_NO_CONTRACT
    const double half = 0.5 * (GTAOI_CELL - 1);
    double gx = (double)t->gx, gy = (double)t->gy, ax = (double)c->cell[GTAOI_CELL_GX][at] - gx;
    double ay = (double)c->cell[GTAOI_CELL_GY][at] - gy, up = (double)c->cell[GTAOI_CELL_UP][at];
    double turn = half * ((ax < 0.0 ? -ax : ax) + (ay < 0.0 ? -ay : ay));
    double along = gx * ((double)x + half - (double)l->x) + gy * ((double)y + half - (double)l->y);
    return ((double)c->cell[GTAOI_CELL_W0][at] - (double)l->w) - along + (turn + (up - (double)l->low));
}

/* The caller's normal of the pixels on a tile's plane, the same for all: N ~ (Gx fx, Gy fy, w - Gx fx rx - Gy fy ry), and
 * how far a normal may be from it so that |g - G| <= slack. With n = N + d, |d| <= e, and g = w0 (nx / fx, ny / fy) / n.r0
 *   |gx(n) - gx(N)| <= e (w0 / |N.r0|) (1 + |Nx| S / |N.r0|) / fx / (1 - e S / |N.r0|),   S = 1 + |rx| + |ry|
 * and w0 / |N.r0| is |(Gx fx, Gy fy, ...)| =: len but for `rough`, what the pixels' heights differ from the plane's. */
static void gtaoi_tile_normal(const gtao_context *c, gtaoi_tile *t, const gtaoi_looking *l, float rough, float least,
                              float len2) {
    GTAOI_NO_CONTRACT
    const float *m = c->to_view;
    double n[3], to[3], len, facing, slack, e, side, off = 0.0, grow = 1.0, w = c->orthographic ? 1.0 : (double)least;
    double bx = (double)c->bx1, by = (double)c->by1, gx = (double)t->gx, gy = (double)t->gy;
    double steep = (gx < 0.0 ? -gx : gx) + (gy < 0.0 ? -gy : gy), margin = 0.999 * (double)t->slack;
    int i, k;
    t->within = 0.0f;
    if (!c->d.normals || c->bent || c->d.mask || !((double)rough < 0.01 * (double)least || c->orthographic))
        return;
    n[0] = -gx / bx, n[1] = -gy / by, n[2] = -1.0;
    side = 1.0;
    if (!c->orthographic) {
        n[2] = -(double)l->w - n[0] * ((double)l->x + 0.5 - (double)c->cx) * bx -
               n[1] * ((double)l->y + 0.5 - (double)c->cy) * by;
        side = 1.0 + 1.5 * sqrt((double)len2); /* |rx| + |ry| <= sqrt(2) |r0| */
        margin -= 1.02 * steep * ((double)rough / w);
    }
    margin -= 9.5367432e-7 * (steep + (double)t->slack); /* 2^-20: rounding of g, as in gtaoi_block_open */
    len = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    if (!(len > 0.0 && len < 1e30))
        return;
    facing = 0.98 * w / len; /* least |N.r0| */
    if (!(facing * facing > 1.02 * (double)len2 * (double)(GTAOI_FACING_MIN * GTAOI_FACING_MIN)))
        return;
    for (k = 0; k < 3; k++)
        n[k] /= len;
    slack = (1.0 + (n[0] < 0.0 ? -n[0] : n[0]) * side / facing) * bx +
            (1.0 + (n[1] < 0.0 ? -n[1] : n[1]) * side / facing) * by;
    e = margin / (1.03 * slack * (c->orthographic ? 1.0 / facing : len));
    if (e > 0.01 * facing / side)
        e = 0.01 * facing / side;
    for (k = 0; k < 3; k++)
        to[k] = n[k];
    if (c->transform_normals) { /* back by the transpose: exact for rotations and mirrors, and else `off` */
        grow = 0.0;
        for (k = 0; k < 3; k++)
            to[k] = (double)m[k] * n[0] + (double)m[3 + k] * n[1] + (double)m[6 + k] * n[2];
        for (i = 0; i < 3; i++) {
            double sum = 0.0, back = -n[i];
            for (k = 0; k < 3; k++) {
                sum += (double)(m[3 * i + k] < 0.0f ? -m[3 * i + k] : m[3 * i + k]);
                back += (double)m[3 * i + k] * to[k];
            }
            grow = sum > grow ? sum : grow;
            off = back > off ? back : -back > off ? -back : off;
        }
    }
    if (!(grow > 0.0 && grow < 1e3))
        return;
    t->within = (float)(((e - off) / grow - 1.2e-7) * 0.999); /* less the rounding of N and of a normal's transform */
    for (k = 0; k < 3; k++)
        t->normal[k] = (float)to[k];
}

/* Up to this height the radius of pixels in a box projects to less than a pixel (gtaoi_setup). */
static float gtaoi_small_height(const gtao_context *c, float x0, float x1, float y0, float y1) {
    GTAOI_NO_CONTRACT
    float ax, ay, limit;
    if (!c->bounded)
        return GTAOI_SKY_LIMIT;
    if (c->orthographic)
        return c->reach < c->extent_min ? FLT_MAX : GTAOI_SKY_LIMIT;
    ax = gtaoi_max(gtaoi_abs(x0 + 0.5f - c->cx), gtaoi_abs(x1 + 0.5f - c->cx)) * c->bx1;
    ay = gtaoi_max(gtaoi_abs(y0 + 0.5f - c->cy), gtaoi_abs(y1 + 0.5f - c->cy)) * c->by1;
    limit = 0.9999f * c->extent_min / (c->reach * sqrtf(1.0f + ax * ax + ay * ay));
    if (c->every_pixel) /* the sphere's silhouette: at a small angle a off by less than a |r0|^2 */
        limit *= c->extent_min < 0.01f ? 0.97f : 0.0f;
    return limit > 0.0f && limit < FLT_MAX ? limit : GTAOI_SKY_LIMIT;
}

/* How many cells that may rise are worth telling apart. */
static int gtaoi_candidates(const gtao_context *c) {
    return c->every_pixel || c->max_steps >= GTAOI_STEPS_PAY ? 1 << 30 : GTAOI_CANDIDATES;
}

/* For each row of cells whether all its pixels were prepared by one call of gtao_prepare_rows, the last. */
static void gtaoi_known_cells(const gtao_context *c, uint8_t *known) {
    int cy, y;
    for (cy = 0; cy < c->cells_y; cy++) {
        int begin = cy * GTAOI_CELL, end = gtaoi_imin(begin + GTAOI_CELL, c->d.height);
        uint32_t range = c->prepared[begin];
        known[cy] = (int)(range >> 16) <= begin && (int)(range & 0xffffu) >= end;
        for (y = begin + 1; y < end; y++)
            known[cy] &= c->prepared[y] == range;
    }
}

/* ---- frames ----------------------------------------------------------------------------------------------------- */

enum {
    GTAOI_TILE_W = 64, /* unit of what is skipped, in pixels of the filters' resolution */
    GTAOI_TILE_H = 8,
    GTAOI_AT_REST = 72 /* frames without a change after which the history stands still: three rounds of the noise */
};

enum { /* planes of a signal, as in gtao_output.signal; those of the history */
       GTAOI_SIGNAL_VISIBILITY,
       GTAOI_SIGNAL_WEIGHT,
       GTAOI_HISTORY_LENGTH = GTAOI_SIGNAL_WEIGHT,
       GTAOI_HISTORY_SPEED = 5,
       GTAOI_HISTORY_LAST = 6,     /* visibility of the last frame alone */
       GTAOI_HISTORY_DEVIATION = 7 /* mean change of it from frame to frame: the noise */
};

/* What makes the history of one frame useless to the next when it changes. */
typedef struct gtaoi_settings {
    uint32_t magic;
    int i[28];
    float f[10];
} gtaoi_settings;

/* A plane is `pitch` floats a row, one row more than the image (nothing: sky or zero), GTAOI_PAD columns around. */
struct gtao_frame_context {
    gtao_frame_desc f;  /* defaults resolved */
    gtao_context full;  /* of the caller's buffers, without tables: depth to height, and output */
    gtao_context *pass; /* horizons, at the filters' resolution */
    int scale;          /* pixels of the caller's for one of the filters', along x and y: 1 or 2 */
    int width, height, bent, passes, temporal, fresh;
    int sets; /* of three more planes that go through the filters: the bent normal, then spherical harmonics */
    ptrdiff_t pitch, plane; /* floats from row to row, from plane to plane */
    float *height_now, *height_before;
    float *raw, *filtered[2]; /* signals: as integrated; after odd and even passes of the spatial filter */
    float *history_now, *history_before;
    const float *signal, *result; /* after the spatial filter; after the temporal one */
    float *normals, *motion;      /* planes x, y, z of the chosen pixels: unit normals, motion in pixels */
    float *thickness;             /* of the chosen pixels; 0: none is known */
    uint8_t *mask;                /* rows of pass->d.mask_stride bytes */
    int tiles_x, tiles_y;
    uint8_t *changed, *rest;                     /* of each tile: inputs changed now; at rest, history stands still */
    uint16_t *still;                             /* frames since its horizons last could change */
    float *nearest;                              /* greatest height */
    float tolerance_scale, tolerance_bias;       /* of height differences: scale w + bias; in space, */
    float disocclusion_scale, disocclusion_bias; /* in time */
    float ray_max;                               /* greatest |r| */
    int moved;                                   /* the camera */
    int unchanged;                               /* so the caller says */
    float before[12];                            /* view_to_previous, translation in units of the heights */
    float before_fx, before_fy, before_cx, before_cy; /* previous camera, filters' resolution */
    float window[2][5];                               /* weights of the first pass and of the others, offsets -2 .. 2 */
};

typedef struct gtaoi_state {
    gtaoi_settings settings;
    uint32_t count; /* frames since the history began */
    gtao_camera camera;
    struct gtao_frame_context context;
} gtaoi_state;

typedef struct gtaoi_frame_layout {
    gtao_desc pass; /* of the horizons; pointers still null */
    gtaoi_layout pass_layout;
    int scale, bent, sets, normals, motion, passes, temporal, tiles_x, tiles_y;
    ptrdiff_t pitch;
    uint64_t plane; /* bytes */
    uint64_t heights, raw, filtered[2], history[2], normal, moves, thickness, mask, changed, rest, still, nearest,
        scratch, total;
} gtaoi_frame_layout;

static gtao_result gtaoi_check_frame(const gtao_frame_desc *f) {
    gtao_result result;
    int i, n;
    if (!f)
        return GTAO_ERROR_FRAME;
    result = gtaoi_check_desc(&f->desc);
    if (result != GTAO_OK)
        return result;
    if (f->desc.error_target > 0.0f)
        return GTAO_ERROR_TARGET;
    if (f->desc.back || f->desc.layer_count > 0)
        return GTAO_ERROR_FRAME_ARCS;
    if ((unsigned)f->reduction > GTAO_REDUCE_CHECKERBOARD)
        return GTAO_ERROR_REDUCTION;
    if (f->sh_bands != 0 && f->sh_bands != 2 && f->sh_bands != 3)
        return GTAO_ERROR_SH_BANDS;
    if (f->spatial_passes < 0 || f->spatial_passes > 3)
        return GTAO_ERROR_SPATIAL;
    if (!(f->depth_tolerance >= 0.0f && f->depth_tolerance <= FLT_MAX))
        return GTAO_ERROR_TOLERANCE;
    if ((unsigned)f->history > GTAO_HISTORY_FREE)
        return GTAO_ERROR_HISTORY;
    if (f->max_history < 0 || f->max_history > 255)
        return GTAO_ERROR_MAX_HISTORY;
    if (!(f->clamp_window >= 0.0f && f->clamp_window <= FLT_MAX))
        return GTAO_ERROR_CLAMP_WINDOW;
    for (i = 0; i < 12; i++)
        if (!gtaoi_finite(f->view_to_previous[i]))
            return GTAO_ERROR_VIEW_TO_PREVIOUS;
    n = f->motion_components == 0 ? 2 : f->motion_components;
    if (f->motion && ((n != 2 && n != 3) || !gtaoi_stride_ok(f->motion_stride, f->desc.width * n * 4, 4)))
        return GTAO_ERROR_MOTION;
    return GTAO_OK;
}

/* The camera of blocks of scale x scale pixels. */
static gtao_camera gtaoi_camera_scaled(const gtao_desc *d, int scale) {
    gtao_camera c = d->camera;
    float inv = 1.0f / (float)scale;
    c.cx = (c.off_center ? c.cx : 0.5f * (float)d->width) * inv;
    c.cy = (c.off_center ? c.cy : 0.5f * (float)d->height) * inv;
    c.off_center = 1;
    c.fx *= inv, c.fy *= inv;
    c.sx *= (float)scale, c.sy *= (float)scale;
    return c;
}

static void gtaoi_frame_plan(const gtao_frame_desc *f, int bent, gtaoi_frame_layout *l) {
    const gtao_desc *d = &f->desc;
    uint64_t at, planes, tiles;
    int i;
    memset(l, 0, sizeof *l);
    l->scale = f->half ? 2 : 1;
    l->bent = bent || f->sh_bands;
    l->sets = f->sh_bands ? f->sh_bands == 2 ? 3 : 4 : l->bent;
    l->normals = d->normals ? 3 : 0;
    l->motion = f->motion ? 3 : 0;
    l->passes = f->no_spatial ? 0 : f->spatial_passes ? f->spatial_passes : 1;
    l->temporal = !f->no_temporal;
    l->pass = *d;
    l->pass.width = (d->width + l->scale - 1) / l->scale, l->pass.height = (d->height + l->scale - 1) / l->scale;
    l->pass.camera = gtaoi_camera_scaled(d, l->scale);
    l->pass.max_radius_px = (d->max_radius_px + l->scale - 1) / l->scale;
    l->pass.far_px = d->far_px ? gtaoi_imax(d->far_px / l->scale, 8) : 0;
    l->pass.sky_z = 0.0f;
    gtaoi_plan(&l->pass, &l->pass_layout);
    l->tiles_x = (l->pass.width + GTAOI_TILE_W - 1) / GTAOI_TILE_W;
    l->tiles_y = (l->pass.height + GTAOI_TILE_H - 1) / GTAOI_TILE_H;
    tiles = (uint64_t)l->tiles_x * (uint64_t)l->tiles_y;
    l->pitch = (l->pass.width + 2 * GTAOI_PAD + 2 * GTAOI_LANES + 15) & ~15;
    if (l->pitch % 1024 == 0)
        l->pitch += 16;
    l->plane = (uint64_t)l->pitch * (uint64_t)(l->pass.height + 1) * sizeof(float);

    planes = 2 + 3 * (uint64_t)l->sets;
    at = (sizeof(gtaoi_state) + 63) / 64 * 64;
    l->heights = at, at += 2 * l->plane;
    l->raw = at, at += planes * l->plane;
    for (i = 0; i < 2; i++)
        l->filtered[i] = at, at += l->passes > i ? planes * l->plane : 0;
    for (i = 0; i < 2; i++)
        l->history[i] = at, at += l->temporal ? (5 + 3 * (uint64_t)gtaoi_imax(l->sets, 1)) * l->plane : 0;
    l->normal = at, at += (uint64_t)l->normals * l->plane;
    l->moves = at, at += (uint64_t)l->motion * l->plane;
    l->thickness = at, at += d->thickness_map ? l->plane : 0;
    l->nearest = at, at += tiles * sizeof(float);
    l->still = at, at += tiles * sizeof(uint16_t);
    l->changed = at, at += tiles;
    l->rest = at, at += tiles;
    l->mask = at, at += d->mask ? (uint64_t)l->pitch * (uint64_t)l->pass.height : 0;
    l->scratch = (at + 63) / 64 * 64;
    l->total = l->scratch + l->pass_layout.total + 63; /* room to align */
}

/* Where, in a signal and in a history, the three planes of a set begin. */
static ptrdiff_t gtaoi_signal_set(const gtao_frame_context *f, int set) {
    return (2 + 3 * set) * f->plane;
}
static ptrdiff_t gtaoi_history_set(const gtao_frame_context *f, int set) {
    return (set ? 5 + 3 * set : 2) * f->plane;
}

/* Row y of a plane, or what lies outside the image. */
static const float *gtaoi_plane_row(const gtao_frame_context *f, const float *plane, int y) {
    if (f->pass->d.border == GTAO_BORDER_WRAP)
        y = gtaoi_wrap(y, f->height);
    if (y < 0 || y >= f->height)
        y = f->height;
    return plane + (ptrdiff_t)y * f->pitch;
}

/* The columns beside a row: what the border makes of them, or the row's ends. Those of heights stay sky otherwise. */
static void gtaoi_pad_plane(const gtao_frame_context *f, float *row, int replicate) {
    int i, w = f->width, wrap = f->pass->d.border == GTAO_BORDER_WRAP;
    if (!wrap && !replicate)
        return;
    for (i = 1; i <= GTAOI_PAD; i++)
        row[-i] = row[wrap ? gtaoi_wrap(-i, w) : 0];
    for (i = w; i < w + GTAOI_PAD; i++)
        row[i] = row[wrap ? gtaoi_wrap(i, w) : w - 1];
}

/* Height of the pixel that the last block of an odd image lacks, from the two before it: so that planes go on. */
static float gtaoi_beyond(const gtao_frame_context *f, float a, float b) {
    GTAOI_NO_CONTRACT
    float d = a - b, tolerance = (f->full.orthographic ? 1.0f : a) * f->full.same_surface;
    return a > GTAOI_SKY_LIMIT && d <= tolerance && -d <= tolerance ? a + d : a;
}

/* Rows [ty0, ty1) of tiles as they were. Of the two planes of heights both have to hold them, of the motion none. */
static void gtaoi_keep(const gtao_frame_context *f, int ty0, int ty1) {
    int k, ty, x;
    for (ty = ty0; ty < ty1; ty++) {
        ptrdiff_t at = (ptrdiff_t)ty * GTAOI_TILE_H * f->pitch - GTAOI_PAD;
        size_t n = (size_t)(gtaoi_imin(GTAOI_TILE_H, f->height - ty * GTAOI_TILE_H) * f->pitch) * sizeof(float);
        int same = 1;
        for (x = ty * f->tiles_x; x < (ty + 1) * f->tiles_x; x++) {
            same &= f->still[x] > 1;
            f->changed[x] = 0;
        }
        if (same && !f->f.no_skip)
            continue;
        memcpy(f->height_now + at, f->height_before + at, n);
        for (k = 0; f->f.motion && k < 3; k++)
            memset(f->motion + k * f->plane + at, 0, n);
    }
}

/* Whether anything changed in row ty of tiles. */
static int gtaoi_row_changed(const gtao_frame_context *f, int ty) {
    int x;
    for (x = ty * f->tiles_x; x < (ty + 1) * f->tiles_x; x++)
        if (f->changed[x])
            return 1;
    return 0;
}

/* Whether all tiles within `ring` of this one are at rest. */
static int gtaoi_at_rest(const gtao_frame_context *f, int tx, int ty, int ring) {
    int x, y;
    if (f->f.no_skip || (f->f.desc.no_skip & GTAO_SKIP_REST))
        return 0;
    for (y = gtaoi_imax(ty - ring, 0); y <= gtaoi_imin(ty + ring, f->tiles_y - 1); y++)
        for (x = gtaoi_imax(tx - ring, 0); x <= gtaoi_imin(tx + ring, f->tiles_x - 1); x++)
            if (!f->rest[y * f->tiles_x + x])
                return 0;
    return f->pass->d.border != GTAO_BORDER_WRAP ||
           (tx >= ring && ty >= ring && tx + ring < f->tiles_x && ty + ring < f->tiles_y);
}

/* Pixels around a tile whose change its horizons may see: the radius where the tile is nearest, with a margin for
 * rounded radii and filters. */
static int gtaoi_tile_reach(const gtao_frame_context *f, float nearest) {
    const gtao_context *c = f->pass;
    float extent = c->reach, cap = c->max_radius;
    int margin = c->d.far_depth ? 6 : 2;
    if (nearest <= GTAOI_SKY_LIMIT)
        return 0;
    if (c->every_pixel || !c->bounded)
        return (int)cap + margin;
    if (!c->orthographic)
        extent = extent * nearest * f->ray_max;
    extent = extent * 1.25f / gtaoi_min(c->bx1, c->by1);
    return (int)gtaoi_min(extent, cap) + margin;
}

/* From what changed to what is at rest, for rows [ty0, ty1) of tiles. */
static void gtaoi_judge_tiles(const gtao_frame_context *f, int ty0, int ty1) {
    int tx, ty, x, y, wrap = f->pass->d.border == GTAO_BORDER_WRAP;
    for (ty = ty0; ty < ty1; ty++)
        for (tx = 0; tx < f->tiles_x; tx++) {
            int at = ty * f->tiles_x + tx, quiet = !f->moved && !f->fresh;
            int reach = gtaoi_tile_reach(f, f->nearest[at]);
            int nx = (reach + GTAOI_TILE_W - 1) / GTAOI_TILE_W, ny = (reach + GTAOI_TILE_H - 1) / GTAOI_TILE_H;
            for (y = ty - ny; quiet && y <= ty + ny; y++)
                for (x = tx - nx; quiet && x <= tx + nx; x++) {
                    if (wrap)
                        quiet = !f->changed[gtaoi_wrap(y, f->tiles_y) * f->tiles_x + gtaoi_wrap(x, f->tiles_x)];
                    else if (x >= 0 && x < f->tiles_x && y >= 0 && y < f->tiles_y)
                        quiet = !f->changed[y * f->tiles_x + x];
                }
            f->still[at] = (uint16_t)(quiet ? gtaoi_imin(f->still[at] + 1, 65535) : 0);
            f->rest[at] = (uint8_t)(f->temporal && f->still[at] > GTAOI_AT_REST);
        }
}

/* ---- the sweep: plan -------------------------------------------------------------------------------------------- */

#define GTAOI_TILE 16   /* lines in a group and columns in a tile, whatever the width: part of the results */
#define GTAOI_LAG 16    /* a sample is compared with its neighbours so far off before it becomes a vertex */
#define GTAOI_BLOCK 8   /* tiles whose highest sample tells at once whether one of them matters */
#define GTAOI_MARGIN 64 /* positions of sky before and after each line */

/* What one pass of a sweep over the rows reads and writes. */
typedef struct gtaoi_pass {
    float *tilt_x, *tilt_y; /* first pass: gradients, at row 0 and column 0; else null */
    ptrdiff_t tilt_pitch;
    const float *beyond; /* far horizons: planes of both sides of the slices from slice_begin on, height per column */
    ptrdiff_t beyond_pitch;
    size_t beyond_plane;
    float *sums; /* [row][block][field][pixel] */
    size_t sums_row;
    int fields;
    const gtao_sweep_options *options; /* horizon maps */
} gtaoi_pass;

/* How a slice is cut into lines: line l passes column i of the longer axis at l + slope i + phase. */
typedef struct gtaoi_cut {
    int x_major, n_major, n_minor;
    double slope, phase;
    int line_begin, groups;
    int ascending; /* the columns, along the slice */
} gtaoi_cut;

struct gtao_sweep {
    gtao_context *c; /* searches the near pixels and integrates */
    gtao_sweep_options o;
    int batch, bands, y_begin, y_end;
    int lead;      /* columns beyond the border that occlude, if it is not open */
    float *turned; /* the height buffer with rows and columns swapped, at pixel (0, 0) */
    ptrdiff_t turned_pitch;
    float *tilt[2][2]; /* gradients of the tangent planes along [x, y], laid out as the height buffer and as `turned`;
                        * only if the radius is finite */
    float *beyond;
    ptrdiff_t beyond_pitch;
    size_t beyond_plane;
    float *sums;
    size_t sums_row;
    int fields;
    float *inverse; /* 1 / k */
};

typedef struct gtaoi_sweep_layout {
    int batch, fields, longest, lead, seeds, farthest;
    ptrdiff_t pitch, turned_pitch, beyond_pitch;
    uint64_t sweep, turned, tilt[2][2], beyond, sums, inverse, total; /* byte offsets */
    uint64_t work;                                                    /* bytes */
} gtaoi_sweep_layout;

/* A sample that was on the upper hull of its line when the sweep passed it: height, slope from the vertex before it on
 * that hull, position. The hulls of all positions are one tree. */
typedef struct gtaoi_vertex {
    float w, slope;
    int32_t t, before;
} gtaoi_vertex;

/* One group of lines on its way. */
typedef struct gtaoi_lines {
    const gtao_context *c;
    const float *plane;                    /* heights, minor axis contiguous, at (0, 0) */
    const float *tilt_along, *tilt_across; /* gradients of the tangent planes, likewise */
    ptrdiff_t pitch;
    int n_major, n_minor, x_major;
    double slope, phase;
    int line;                 /* the first */
    int first;                /* column of position 0 */
    int begin, end;           /* positions of receivers */
    int count, tiles;         /* positions */
    int backward[2];          /* whether the + and - sides look towards the greater columns */
    int want_begin, want_end; /* along the minor axis */
    float *beyond;
    ptrdiff_t beyond_pitch;
    size_t beyond_plane;
    const float *inverse; /* 1 / |k|, k also negative */
    ptrdiff_t length;     /* of a line's part of the buffers */
    float *strip;         /* heights on the lines, [line][position] */
    gtaoi_vertex *vertex; /* [line][room] */
    ptrdiff_t room;
    int32_t *start; /* [line][tile]: the last vertex before a tile */
    const gtao_sweep_options *options;
    int *minor;           /* pixel of the first line at each position */
    uint16_t *above;      /* [line][tile]: samples that may be vertices */
    float *ahead;         /* slopes of the tangent planes along the lines, [line][position] */
    float *highest;       /* [line][tile] */
    float *highest_block; /* [line][block] */
    const gtaoi_slice *slice;
    int seeds[GTAOI_TILE]; /* last vertex beyond the image */
} gtaoi_lines;

/* Vertex n, after `top`: the hull loses what lies below the line from it to what remains; its slopes fall. */
GTAOI_INLINE void gtaoi_push_vertex(gtaoi_vertex *v, int n, int top, const float *inverse, int t, float w) {
    GTAOI_NO_CONTRACT
    float slope = (w - v[top].w) * inverse[t - v[top].t];
    while (slope >= v[top].slope)
        top = v[top].before, slope = (w - v[top].w) * inverse[t - v[top].t];
    v[n].w = w, v[n].slope = slope, v[n].t = t, v[n].before = top;
}

static float gtaoi_line_height(const gtao_context *c, float depth); /* below, by a kernel */

/* The vertices of a line, and which of them each tile's receivers see first, more than GTAO_SWEEP_NEAR away. Four tiles
 * at a time: it is the ends of loops that cost. */
static void gtaoi_push_vertices(gtaoi_lines *l, int line, int backward) {
    GTAOI_NO_CONTRACT
    enum { GAP = GTAO_SWEEP_NEAR, REST = GTAOI_TILE - GAP, SPAN = 4 * GTAOI_TILE };
    gtaoi_vertex *v = l->vertex + (ptrdiff_t)line * l->room;
    const float *w = l->strip + (ptrdiff_t)line * l->length;
    const uint16_t *above = l->above + line * (l->tiles + 4) + 2;
    int n = l->seeds[line] + 1, i, j;
    for (i = 0; i < l->tiles; i += 4) {
        int at = backward ? (l->tiles - i) * GTAOI_TILE + GAP - (SPAN - GTAOI_TILE) : (i - 1) * GTAOI_TILE - GAP;
        int seen = n - 1;
        uint64_t bits = 0;
        for (j = 0; j < gtaoi_imin(4, l->tiles - i); j++) { /* the 16 samples before what is near */
            int tile = backward ? l->tiles - 1 - i - j : i + j;
            unsigned some = backward ? (unsigned)above[tile + 1] >> GAP | (unsigned)above[tile + 2] << REST
                                     : (unsigned)above[tile - 2] >> REST | (unsigned)above[tile - 1] << GAP;
            some &= 0xffffu;
            bits |= (uint64_t)some << (backward ? SPAN - GTAOI_TILE - GTAOI_TILE * j : GTAOI_TILE * j);
            seen += gtaoi_popcount(some);
            l->start[line * l->tiles + tile] = seen;
        }
        while (bits) {
            int k = backward ? gtaoi_highest(bits) : gtaoi_lowest(bits);
            gtaoi_push_vertex(v, n, n - 1, l->inverse, at + k, w[at + k]);
            n++;
            bits ^= (uint64_t)1 << k;
        }
    }
}

/* What the caller knows beyond the image, at whole columns: the first vertices. */
static void gtaoi_seed_vertices(gtaoi_lines *l, int line, int backward) {
    GTAOI_NO_CONTRACT
    float distance[GTAO_BEYOND_CAPACITY], depth[GTAO_BEYOND_CAPACITY];
    gtaoi_vertex *v = l->vertex + (ptrdiff_t)line * l->room;
    int top = l->seeds[line];
    int p = backward ? l->count - 1 : 0, step = backward ? -1 : 1, last, n, i;
    double unit = 1.0 / sqrt(1.0 + l->slope * l->slope), x, y, dx = (double)-step * unit, dy = dx * l->slope;
    while (p >= 0 && p < l->count && (l->minor[p] + line < 0 || l->minor[p] + line >= l->n_minor))
        p += step;
    if (p < 0 || p >= l->count)
        return;
    x = (double)(l->first + p), y = (double)(l->line + line) + l->slope * x + l->phase;
    x += 0.5, y += 0.5;
    if (l->x_major)
        n = l->options->beyond(l->options->beyond_user, x, y, dx, dy, GTAO_BEYOND_CAPACITY, distance, depth);
    else
        n = l->options->beyond(l->options->beyond_user, y, x, dy, dx, GTAO_BEYOND_CAPACITY, distance, depth);
    last = l->options->beyond_reach + 1;
    for (i = 0; i < gtaoi_imin(n, GTAO_BEYOND_CAPACITY); i++) {
        float w = gtaoi_line_height(l->c, depth[i]);
        int t;
        if (!(distance[i] >= 0.0f && distance[i] <= (float)l->options->beyond_reach) || w < GTAOI_SKY_LIMIT)
            continue;
        t = gtaoi_imax((int)((double)distance[i] * unit + 0.5), 1);
        if (t >= last) { /* two at one column: the higher one */
            if (t > last || w <= v[top].w)
                continue;
            top--;
        }
        last = t;
        gtaoi_push_vertex(v, top + 1, top, l->inverse, p - step * t, w);
        top++;
    }
    l->seeds[line] = top;
}

/* Empty hulls, and sky around the lines. */
static void gtaoi_sweep_start(gtaoi_lines *l, int backward) {
    int i;
    for (i = 0; i < GTAOI_TILE; i++) {
        gtaoi_vertex *v = l->vertex + i * l->room;
        float *strip = l->strip + i * l->length;
        gtaoi_fill_sky(strip - GTAOI_MARGIN, GTAOI_MARGIN);
        gtaoi_fill_sky(strip + l->tiles * GTAOI_TILE, GTAOI_MARGIN);
        v->w = GTAOI_SKY, v->slope = FLT_MAX;
        v->t = backward ? l->tiles * GTAOI_TILE + GTAOI_MARGIN : -GTAOI_MARGIN;
        v->before = 0;
        l->seeds[i] = 0;
    }
}

/* Far horizons of a tile to their plane: found[line][position]; turned[position][line] if the lines go along y. */
static void gtaoi_sweep_store(const gtaoi_lines *l, int side, int tile, const float *found) {
    int wrap = l->c->d.border == GTAO_BORDER_WRAP, n = wrap ? gtaoi_imin(l->n_minor - l->line, GTAOI_TILE) : GTAOI_TILE;
    int u, k, at = tile * GTAOI_TILE, whole = n == GTAOI_TILE && at >= l->begin && at + GTAOI_TILE <= l->end;
    ptrdiff_t offset[GTAOI_TILE], along = l->x_major ? l->beyond_pitch : 1, across = l->x_major ? 1 : l->beyond_pitch;
    float *to = l->beyond + (size_t)side * l->beyond_plane;
    const int *minor = l->minor + at;
    for (u = 0; u < GTAOI_TILE; u++) {
        whole &= minor[u] >= l->want_begin && minor[u] + GTAOI_TILE <= l->want_end;
        offset[u] = minor[u] * along + (l->first + at + u) * across;
    }
    if (whole && l->x_major) {
        for (k = 0; k < GTAOI_TILE; k++, to += along, found += GTAOI_TILE)
            for (u = 0; u < GTAOI_TILE; u++)
                to[offset[u]] = found[u];
        return;
    }
    for (u = 0; u < GTAOI_TILE; u++) {
        const float *from = found + (l->x_major ? u : u * GTAOI_TILE);
        if (whole) {
            memcpy(to + offset[u], from, GTAOI_TILE * sizeof(float));
            continue;
        }
        for (k = 0; at + u >= l->begin && at + u < l->end && k < n; k++) {
            int y = minor[u] + k;
            y = wrap ? gtaoi_wrap(y, l->n_minor) : y;
            if (y >= l->want_begin && y < l->want_end)
                to[y * along + (l->first + at + u) * across] = from[l->x_major ? k * GTAOI_TILE : k];
        }
    }
}

/* ---- one table of operations per width, and the self-inclusions ------------------------------------------------- */

/* GV: float vector, GM: mask, their operations GV_ and GM_, suffix-free so that the kernels read as formulas. Undefined
 * again after each pass. A width is scalar first; its intrinsics must give the scalar twin's bits, operand order
 * included. */

#define GTAOI_W 1
#define GTAOI_NAME(x) x##_scalar
#define GTAOI_ATTRIBUTE
#include GTAO_HEADER_FILENAME

#if GTAOI_X86
#define GTAOI_W 4
#define GTAOI_NAME(x) x##_sse2
#define GTAOI_ATTRIBUTE GTAOI_TARGET("sse2")
#include GTAO_HEADER_FILENAME

#define GTAOI_W 8
#define GTAOI_NAME(x) x##_avx2
#define GTAOI_ATTRIBUTE GTAOI_TARGET("avx2")
#include GTAO_HEADER_FILENAME

#define GTAOI_W 16
#define GTAOI_NAME(x) x##_avx512
#define GTAOI_ATTRIBUTE GTAOI_TARGET("avx512f,avx512dq")
#include GTAO_HEADER_FILENAME
#endif

#if GTAOI_NEON
#define GTAOI_W 4
#define GTAOI_NAME(x) x##_neon
#define GTAOI_ATTRIBUTE
#include GTAO_HEADER_FILENAME
#endif

/* ---- dispatch --------------------------------------------------------------------------------------------------- */

#if GTAOI_X86
/* gcc 12 leaves the vectors' upper halves dirty at the end of a kernel that calls another, which slows the caller's SSE
 * code to a third. */
static GTAOI_TARGET("avx") void gtaoi_clean(void) {
    _mm256_zeroupper();
}
#define GTAOI_DISPATCH(isa, name, arguments)                                                                           \
    ((isa) == GTAO_ISA_AVX512 ? (name##_avx512 arguments, gtaoi_clean())                                               \
     : (isa) == GTAO_ISA_AVX2 ? (name##_avx2 arguments, gtaoi_clean())                                                 \
     : (isa) == GTAO_ISA_SSE2 ? name##_sse2 arguments                                                                  \
                              : name##_scalar arguments)
#elif GTAOI_NEON
#define GTAOI_DISPATCH(isa, name, arguments) ((isa) == GTAO_ISA_NEON ? name##_neon arguments : name##_scalar arguments)
#else
#define GTAOI_DISPATCH(isa, name, arguments) ((void)(isa), name##_scalar arguments)
#endif

GTAO_API void gtao_prepare_rows(const gtao_context *context, int row_begin, int row_end) {
    row_begin = gtaoi_imax(row_begin, 0), row_end = gtaoi_imin(row_end, context->d.height);
    GTAOI_DISPATCH(context->d.isa, gtaoi_prepare, (context, row_begin, row_end));
}

GTAO_API void gtao_visibility_rows(const gtao_context *context, int row_begin, int row_end, gtao_stats *stats) {
    gtao_stats unused;
    int y;
    if (!stats)
        memset(&unused, 0, sizeof unused), stats = &unused;
    row_begin = gtaoi_imax(row_begin, 0), row_end = gtaoi_imin(row_end, context->d.height);
    if (context->effort) {
        for (y = row_begin; y < row_end; y++) {
            float *row = context->effort->planes[GTAOI_EFFORT_HEIGHT] + (ptrdiff_t)y * context->effort->pitch;
            gtaoi_fill_sky(row - GTAOI_EFFORT_PAD, GTAOI_EFFORT_PAD);
            gtaoi_fill_sky(row + context->d.width, context->effort->pitch - GTAOI_EFFORT_PAD - context->d.width);
        }
        context = context->effort->level;
    }
    GTAOI_DISPATCH(context->d.isa, gtaoi_visibility, (context, row_begin, row_end, stats));
}

/* Rows of tiles that begin in [row_begin, row_end). */
static int gtaoi_tile_rows(const gtaoi_effort *e, int row) {
    return gtaoi_imin(gtaoi_imax(row, 0) / GTAOI_EFFORT_H + (row > 0 && row % GTAOI_EFFORT_H), e->tiles_y);
}

GTAO_API void gtao_share_rows(const gtao_context *context, int row_begin, int row_end) {
    const gtaoi_effort *e = context->effort;
    int tx, ty, from, ty0, ty1;
    if (!e)
        return;
    ty0 = gtaoi_tile_rows(e, row_begin), ty1 = gtaoi_tile_rows(e, row_end);
    for (tx = 0; tx < e->tiles_x; tx++)
        for (ty = ty0; ty < ty1; ty++) {
            for (from = ty; ty < ty1 && (!e->second || e->tile[ty * e->tiles_x + tx].level > 0); ty++)
                ;
            if (from < ty)
                GTAOI_DISPATCH(context->d.isa, gtaoi_share,
                               (context, tx * GTAOI_EFFORT_W, from * GTAOI_EFFORT_H,
                                gtaoi_imin(ty * GTAOI_EFFORT_H, context->d.height)));
        }
}

/* Marks the radius classes of the pixels of a tile, with one more on each side; `farthest` is the longest ray. Every
 * pixel: those out to the silhouette of the sphere, as in gtaoi_setup. */
static void gtaoi_mark_classes(const gtao_context *c, int every_pixel, const gtaoi_effort_tile *t, float farthest,
                               unsigned char *used) {
    GTAOI_NO_CONTRACT
    int from = 0, to = c->classes - 1;
    if (!c->orthographic && c->bounded) {
        float extent = t->w_most * farthest * c->reach, sine = t->w_most * c->reach;
        if (every_pixel && sine < 1.0f) {
            float tangent = sine / sqrtf(1.0f - sine * sine), inv = 1.0f / farthest;
            float room = inv - tangent * sqrtf(gtaoi_max(1.0f - inv * inv, 0.0f));
            extent = room > 0.0f ? farthest * tangent / room : c->extent_max;
        } else if (every_pixel) {
            extent = c->extent_max;
        }
        from = gtaoi_class(c, gtaoi_clamp(t->w_least * c->reach, c->extent_min, c->extent_max)) - 1;
        to = gtaoi_class(c, gtaoi_clamp(extent, c->extent_min, c->extent_max)) + 1;
    }
    for (from = gtaoi_imax(from, 0), to = gtaoi_imin(to, c->classes - 1); from <= to; from++)
        used[from] = 1;
}

/* Length of the ray through the corner that is farthest from the principal point. */
static float gtaoi_farthest(const gtao_context *c) {
    GTAOI_NO_CONTRACT
    float rx =
        gtaoi_max(gtaoi_max(c->cx, -c->cx), gtaoi_max((float)c->d.width - c->cx, c->cx - (float)c->d.width)) * c->bx1;
    float ry =
        gtaoi_max(gtaoi_max(c->cy, -c->cy), gtaoi_max((float)c->d.height - c->cy, c->cy - (float)c->d.height)) * c->by1;
    rx = gtaoi_min(rx, GTAOI_RAY_LIMIT), ry = gtaoi_min(ry, GTAOI_RAY_LIMIT);
    return (float)sqrt((double)(rx * rx + ry * ry + 1.0f));
}

/* About how many of the samples of a radius are within `end` pixels: near ones that fall on one pixel count once. */
static float gtaoi_expect_samples(int steps, float radius, float end) {
    GTAOI_NO_CONTRACT
    float s = (float)steps, near_ones = s * s / (4.0f * radius);
    return steps == 0 || s >= 2.0f * radius || end <= near_ones ? end : s * sqrtf(end / radius) - near_ones;
}

/* Times of a tile's levels, ns a pixel on one machine, of which only the ratios matter. Returns the first level's. */
static float gtaoi_effort_costs(const gtao_context *c, gtaoi_effort_tile *t, int x, int y) {
    GTAOI_NO_CONTRACT
    float radius = c->max_radius, ends[4], first = 0.0f;
    int i, k;
    if (c->bounded) {
        float extent = c->orthographic ? c->reach : 0.5f * (t->w_least + t->w_most) * c->reach;
        radius =
            gtaoi_clamp(2.0f * gtaoi_clamp(extent, c->extent_min, c->extent_max) / (c->bx1 + c->by1), 1.0f, radius);
    }
    ends[0] = (float)x, ends[1] = (float)(c->d.width - x), ends[2] = (float)y, ends[3] = (float)(c->d.height - y);
    for (k = 0; k < GTAOI_LEVELS; k++) {
        int steps = gtaoi_levels[k].steps, slices = gtaoi_levels[k].slices - (k ? gtaoi_levels[0].slices : 0);
        float samples = 0.0f, sample = steps ? 0.187f : 0.26f;
        for (i = 0; i < 4; i++) {
            float end = c->d.border == GTAO_BORDER_OPEN ? gtaoi_clamp(ends[i], 1.0f, radius) : radius;
            samples += 0.5f * gtaoi_expect_samples(steps, radius, end);
        }
        t->cost[k] = (float)slices * (3.5f + sample * samples) + 5.0f;
        first = k ? first : t->cost[k];
    }
    t->cost[0] = 0.0f;
    return first;
}

/* The level of least error + price * time of every tile; the sums of both. */
static void gtaoi_choose_levels(const gtaoi_effort *e, int price_index, double *error, double *time) {
    GTAOI_NO_CONTRACT
    static const double eighths[8] = {1.0,         0.917004043, 0.840896415, 0.771105413,
                                      0.707106781, 0.648419777, 0.594603558, 0.545253866};
    double price = 16.0 * eighths[price_index & 7];
    int i, k, n = e->tiles_x * e->tiles_y;
    for (k = price_index >> 3; k > 0; k--)
        price *= 0.5;
    for (i = 0, *error = *time = 0.0; i < n; i++) {
        gtaoi_effort_tile *t = &e->tile[i];
        double least = 0.0, least_error = 0.0;
        for (k = 0; k < e->levels && !t->level; k++) {
            double left = (double)(gtaoi_levels[k].error * t->variance + gtaoi_levels[k].alone * t->alone);
            double both = left + price * (double)(t->cost[k] * t->count);
            if (k == 0 || both < least)
                least = both, least_error = left, t->wanted = (unsigned char)k;
        }
        *error += least_error, *time += (double)(t->cost[t->wanted] * t->count);
    }
}

/* Least error for the time: the price falls until the error meets the target or the time its limit. */
GTAO_API float gtao_refine_begin(gtao_context *context, float most) {
    GTAOI_NO_CONTRACT
    enum { PRICES = 320 }; /* from more than all error is worth, eight an octave */
    gtaoi_effort *e = context->effort;
    double pixels = 0.0, first = 0.0, target, error, time;
    int i, k, n, from = 0, to = PRICES;
    unsigned char used[GTAOI_LEVELS][GTAOI_MAX_CLASSES + 1], level_used[GTAOI_LEVELS];
    float farthest;
    if (!e)
        return 0.0f;
    n = e->tiles_x * e->tiles_y;
    for (i = 0; i < n; i++) {
        gtaoi_effort_tile *t = &e->tile[i];
        int x = i % e->tiles_x * GTAOI_EFFORT_W, y = i / e->tiles_x * GTAOI_EFFORT_H;
        if (t->count > 0.0f)
            first +=
                (double)(t->count * gtaoi_effort_costs(context, t, x + GTAOI_EFFORT_W / 2, y + GTAOI_EFFORT_H / 2));
        pixels += (double)t->count;
    }
    target = (double)gtaoi_min(context->d.error_target, 1.0f);
    target *= target * pixels;
    while (from < to) { /* the first price at which there is no need or no time for a lower one */
        int middle = (from + to) / 2;
        gtaoi_choose_levels(e, middle, &error, &time);
        if (error <= target || (most > 0.0f && time > (double)most * first))
            to = middle;
        else
            from = middle + 1;
    }
    gtaoi_choose_levels(e, from, &error, &time);
    if (most > 0.0f && time > (double)most * first)
        gtaoi_choose_levels(e, from - 1, &error, &time);
    memset(used, 0, sizeof used), memset(level_used, 0, sizeof level_used);
    farthest = gtaoi_farthest(context);
    for (i = 0; i < n; i++) {
        k = e->tile[i].wanted;
        level_used[k] = 1;
        if (k && e->tile[i].count > 0.0f)
            gtaoi_mark_classes(context, e->level[k].every_pixel, &e->tile[i], farthest, used[k]);
    }
    for (k = 1; k < e->levels; k++)
        if (level_used[k])
            gtaoi_fill_tables(&e->level[k], e->max_radius, used[k]);
    e->second = 1;
    return first > 0.0 ? (float)(time / first) : 0.0f;
}

/* Level by level and, in each, by rows of the noise, so that the tables of one row stay in the cache. */
GTAO_API void gtao_refine_rows(const gtao_context *context, int row_begin, int row_end, gtao_stats *stats) {
    const gtaoi_effort *e = context->effort;
    int level, phase, tx, ty, from, ty0, ty1, i;
    gtao_stats spent;
    if (!e)
        return;
    memset(&spent, 0, sizeof spent);
    ty0 = gtaoi_tile_rows(e, row_begin), ty1 = gtaoi_tile_rows(e, row_end);
    for (level = 1; level < e->levels; level++) {
        gtao_context part = e->level[level];
        for (phase = 0; phase < GTAOI_EFFORT_H; phase++)
            for (ty = ty0; ty < ty1; ty++) {
                const gtaoi_effort_tile *t = e->tile + ty * e->tiles_x;
                int y = ty * GTAOI_EFFORT_H + phase;
                for (tx = 0; tx < e->tiles_x && y < part.d.height; tx++) {
                    for (from = tx; tx < e->tiles_x && t[tx].wanted == level && t[tx].level < level; tx++)
                        ;
                    if (from == tx)
                        continue;
                    part.x_begin = from * GTAOI_EFFORT_W;
                    part.x_end = gtaoi_imin(tx * GTAOI_EFFORT_W, part.d.width);
                    GTAOI_DISPATCH(part.d.isa, gtaoi_visibility, (&part, y, y + 1, &spent));
                }
            }
    }
    for (i = ty0 * e->tiles_x; i < ty1 * e->tiles_x; i++)
        if (e->tile[i].level < e->tile[i].wanted)
            e->tile[i].level = e->tile[i].wanted;
    if (stats)
        stats->samples += spent.samples, stats->refined += spent.pixels;
}

GTAO_API void gtao_irradiance_rows(const gtao_desc *desc, const gtao_output *output, const float probe[27], float *rgb,
                                   ptrdiff_t rgb_stride, int row_begin, int row_end) {
    ptrdiff_t row = output->sh_stride ? output->sh_stride : (ptrdiff_t)desc->width * 4, plane = output->sh_plane_stride;
    int x, y, i, n = gtaoi_sh_count(output);
    float sh[9] = {0};
    if (!plane)
        plane = row * desc->height;
    row_begin = gtaoi_imax(row_begin, 0), row_end = gtaoi_imin(row_end, desc->height);
    for (y = row_begin; y < row_end; y++) {
        const char *from = (const char *)output->sh + (ptrdiff_t)y * row;
        char *to = (char *)rgb + (ptrdiff_t)y * (rgb_stride ? rgb_stride : (ptrdiff_t)desc->width * 12);
        for (x = 0; x < desc->width; x++) {
            for (i = 0; i < n; i++)
                memcpy(&sh[i], from + (ptrdiff_t)i * plane + (ptrdiff_t)x * 4, sizeof sh[i]);
            gtao_irradiance(sh, probe, (float *)(void *)(to + (ptrdiff_t)x * 12));
        }
    }
}

GTAO_API gtao_result gtao_compute(const gtao_desc *desc, const gtao_output *output, void *scratch, size_t scratch_size,
                                  gtao_stats *stats) {
    gtao_context *context;
    gtao_result result = gtao_begin(desc, output, scratch, scratch_size, &context);
    if (result != GTAO_OK)
        return result;
    gtao_prepare_rows(context, 0, desc->height);
    gtao_visibility_rows(context, 0, desc->height, stats);
    if (context->effort) {
        gtao_share_rows(context, 0, desc->height);
        if (gtao_refine_begin(context, 0.0f) > 0.0f) {
            gtao_refine_rows(context, 0, desc->height, stats);
            gtao_share_rows(context, 0, desc->height);
        }
    }
    return GTAO_OK;
}

/* ---- thickness --------------------------------------------------------------------------------------------------- */

/* Constants of the estimate, fitted: thickness over width; widths in radii that are endless; the change of depth, in
 * footprints a pixel, within which neighbours are one surface; and the most that a slope adds to a width. */
#define GTAOI_THICKNESS_FACTOR 0.35f
#define GTAOI_THICKNESS_ENDLESS 1.5f
#define GTAOI_THICKNESS_SLOPE 6.0f
#define GTAOI_THICKNESS_STRETCH 5.0f

/* A surface met on a line of pixels: its last depth and pixel, and the pixel that names it. */
typedef struct gtaoi_run {
    float z;
    int last, id;
} gtaoi_run;

enum { GTAOI_RUNS = 32 }; /* surfaces hidden one behind the other; the farthest of more is forgotten */

/* Pixels of a line that the surface seen at each of n pixels takes up, with what nearer things hide of it. A run goes on
 * while its depth changes by no more than `slope` a pixel (perspective: of its depth); something nearer interrupts it,
 * and it is resumed behind that if its depth fits; it ends where something farther shows, which in turn may have begun
 * behind it. `work`: 3 n ints. Sky is infinite. */
static void gtaoi_widths(const float *z, ptrdiff_t step, int n, float slope, int orthographic, int *work, float *width,
                         ptrdiff_t width_step) {
    GTAOI_NO_CONTRACT
    gtaoi_run stack[GTAOI_RUNS]; /* the nearest on top */
    int *id = work, *first = work + n, *end = work + 2 * n, top = 0, i;
    for (i = 0; i < n; i++) {
        float d = z[i * step];
        int start = i, found = 0;
        id[i] = -1, end[i] = n;
        if (!gtaoi_finite(d)) {
            while (top)
                end[stack[--top].id] = i;
            continue;
        }
        while (top && !found) {
            const gtaoi_run *r = &stack[top - 1];
            float tolerance = slope * (float)(i - r->last), behind = d - r->z;
            if (!orthographic)
                tolerance *= gtaoi_min(d, r->z);
            if (behind < -tolerance)
                break; /* nearer */
            found = behind <= tolerance;
            if (!found) {
                end[r->id] = i;
                start = first[r->id];
                top--;
            }
        }
        if (!found) {
            if (top == GTAOI_RUNS)
                memmove(stack, stack + 1, (size_t)--top * sizeof *stack);
            first[i] = start;
            stack[top++].id = i;
        }
        stack[top - 1].z = d, stack[top - 1].last = i;
        id[i] = stack[top - 1].id;
    }
    for (i = 0; i < n; i++) {
        int run = id[i];
        width[i * width_step] = run < 0                            ? 0.0f
                                : first[run] == 0 || end[run] == n ? (float)HUGE_VAL
                                                                   : (float)(end[run] - first[run]);
    }
}

/* Change of depth from pixel to pixel, the lesser of both sides; FLT_MAX where neither neighbour is there. */
static float gtaoi_change(const float *z, int before, int after, ptrdiff_t step) {
    GTAOI_NO_CONTRACT
    float a = before && gtaoi_finite(z[-step]) ? z[-step] - z[0] : FLT_MAX;
    float b = after && gtaoi_finite(z[step]) ? z[step] - z[0] : FLT_MAX;
    return gtaoi_min(a < 0.0f ? -a : a, b < 0.0f ? -b : b);
}

GTAO_API size_t gtao_thickness_scratch_size(const gtao_desc *desc) {
    uint64_t n;
    if (gtaoi_check_desc(desc) != GTAO_OK)
        return 0;
    n = 2 * (uint64_t)desc->width * (uint64_t)desc->height + 3 * (uint64_t)gtaoi_imax(desc->width, desc->height);
    n = n * sizeof(float) + 63; /* room to align */
    return n <= SIZE_MAX ? (size_t)n : 0;
}

GTAO_API gtao_result gtao_estimate_thickness(const gtao_desc *desc, float *thickness, ptrdiff_t stride, void *scratch,
                                             size_t scratch_size) {
    GTAOI_NO_CONTRACT
    gtao_result result = gtaoi_check_desc(desc);
    gtao_output none;
    gtaoi_layout l;
    gtao_context c;
    float *z, *across, unit;
    int *work, x, y, w, h;
    if (result != GTAO_OK)
        return result;
    w = desc->width, h = desc->height;
    if (!thickness || !gtaoi_stride_ok(stride, w * 4, 4))
        return GTAO_ERROR_THICKNESS_MAP;
    if (!scratch || scratch_size < gtao_thickness_scratch_size(desc))
        return GTAO_ERROR_SCRATCH;
    memset(&none, 0, sizeof none);
    gtaoi_plan(desc, &l);
    gtaoi_resolve(desc, &none, &l, &c);
    unit = c.orthographic ? desc->camera.sx : c.w_numerator;
    stride = stride ? stride / 4 : w;
    z = (float *)(void *)((char *)scratch + ((64 - ((uintptr_t)scratch & 63)) & 63));
    across = z + (ptrdiff_t)w * h;
    work = (int *)(void *)(across + (ptrdiff_t)w * h);
    for (y = 0; y < h; y++) {
        const float *depth = (const float *)(const void *)((const char *)desc->depth + y * c.d.depth_stride);
        float *row = z + (ptrdiff_t)y * w, ry2 = gtaoi_ry2(&c, y);
        for (x = 0; x < w; x++) { /* in units of the radius, orthographic: of pixels */
            float height = gtaoi_height_scalar(&c, depth[x], (float)x, ry2);
            row[x] = height <= GTAOI_SKY_LIMIT ? (float)HUGE_VAL : c.orthographic ? -height : 1.0f / height;
        }
        gtaoi_widths(row, 1, w, GTAOI_THICKNESS_SLOPE * c.bx1, c.orthographic, work, across + (ptrdiff_t)y * w, 1);
    }
    for (x = 0; x < w; x++)
        gtaoi_widths(z + x, w, h, GTAOI_THICKNESS_SLOPE * c.by1, c.orthographic, work, thickness + x, stride);
    for (y = 0; y < h; y++)
        for (x = 0; x < w; x++) {
            const float *at = z + (ptrdiff_t)y * w + x;
            float *out = thickness + y * stride + x, scale = c.orthographic ? 1.0f : *at, width, sx, sy;
            if (!gtaoi_finite(*at)) {
                *out = 0.0f;
                continue;
            }
            width = gtaoi_min(across[(ptrdiff_t)y * w + x] * c.bx1, *out * c.by1) * scale;
            sx = gtaoi_change(at, x > 0, x + 1 < w, 1) / (scale * c.bx1);
            sy = gtaoi_change(at, y > 0, y + 1 < h, w) / (scale * c.by1);
            width *= gtaoi_min(sqrtf(1.0f + sx * sx + sy * sy), GTAOI_THICKNESS_STRETCH);
            *out = width <= GTAOI_THICKNESS_ENDLESS * c.reach ? GTAOI_THICKNESS_FACTOR * width * unit : (float)HUGE_VAL;
        }
    return GTAO_OK;
}

GTAO_API void gtao_compose_layers(size_t n, const float *scene, const float *scene_bent, const uint8_t *moving,
                                  float *all, float *all_bent) {
    size_t i;
    for (i = 0; i < n; i++)
        if (!moving[i] && scene[i] < all[i]) {
            all[i] = scene[i];
            if (scene_bent && all_bent)
                memcpy(all_bent + 3 * i, scene_bent + 3 * i, 3 * sizeof(float));
        }
}

/* ---- frames: state and stages ----------------------------------------------------------------------------------- */

enum { GTAOI_REDUCE, GTAOI_PREPARE, GTAOI_HORIZONS, GTAOI_SPATIAL, GTAOI_TEMPORAL, GTAOI_OUTPUT };

GTAO_API size_t gtao_frame_state_size(const gtao_frame_desc *frame) {
    gtaoi_frame_layout l;
    if (gtaoi_check_frame(frame) != GTAO_OK)
        return 0;
    gtaoi_frame_plan(frame, 1, &l); /* the same whether or not bent normals are wanted */
    return l.total <= SIZE_MAX ? (size_t)l.total : 0;
}

static void gtaoi_frame_settings(const gtao_frame_desc *f, const gtaoi_frame_layout *l, gtaoi_settings *s) {
    const gtao_desc *d = &f->desc;
    const int i[] = {d->width,
                     d->height,
                     (int)d->camera.projection,
                     (int)d->border,
                     d->max_radius_px,
                     l->pass_layout.slices,
                     l->pass_layout.max_steps,
                     l->pass_layout.every_pixel,
                     (int)d->estimator,
                     (int)d->weighting,
                     (int)d->noise,
                     f->half != 0,
                     (int)f->reduction,
                     l->passes,
                     l->temporal,
                     (int)f->history,
                     f->max_history,
                     l->sets,
                     l->normals,
                     l->motion,
                     d->mask != 0,
                     (int)d->depth_kind,
                     d->thickness_map != 0,
                     (int)d->far_depth,
                     d->far_px};
    const float x[] = {d->radius,       d->falloff,   d->step_power, d->thin_blend, f->depth_tolerance,
                       f->clamp_window, d->camera.sx, d->camera.sy,  d->thickness,  d->tolerance};
    memset(s, 0, sizeof *s);
    s->magic = 0x6f617467u;
    memcpy(s->i, i, sizeof i);
    memcpy(s->f, x, sizeof x);
}

GTAO_API gtao_result gtao_frame_begin(const gtao_frame_desc *frame, const gtao_output *output, void *state,
                                      size_t state_size, gtao_frame_context **context) {
    static const float even[5] = {0, 1, 1, 1, 1}, odd[5] = {1, 1, 1, 1, 0}, centred[5] = {0.5f, 1, 1, 1, 0.5f};
    static const float smooth[5] = {0, 0.5f, 1, 0.5f, 0};
    gtao_result result = gtaoi_check_frame(frame);
    gtaoi_frame_layout l;
    gtaoi_settings settings;
    gtaoi_layout full_layout;
    gtaoi_state *s;
    gtao_frame_context *f;
    gtao_output signal;
    char *base;
    int i, at_rest = 1, same_camera, had_third;
    float x, y;
    ptrdiff_t floats;
    if (result != GTAO_OK)
        return result;
    if (output && output->signal)
        return GTAO_ERROR_SIGNAL;
    if (output &&
        (output->sh ? gtaoi_sh_count(output) : 0) != (frame->sh_bands ? frame->sh_bands * frame->sh_bands : 0))
        return GTAO_ERROR_SH_BANDS;
    if (output) {
        signal = *output; /* its intermediates have the filters' resolution */
        signal.horizon_stride = signal.horizon_plane = 0;
    }
    result = gtaoi_check_output(&frame->desc, output ? &signal : output);
    if (result != GTAO_OK)
        return result;
    gtaoi_frame_plan(frame, 1, &l);
    if (gtaoi_has_planes(output) &&
        !gtaoi_planes_ok(output->horizon_stride, output->horizon_plane, l.pass.width, l.pass.height))
        return GTAO_ERROR_HORIZONS;
    if (!state || state_size < l.total || !context)
        return GTAO_ERROR_STATE;
    gtaoi_frame_plan(frame, output->bent_normals || output->packed, &l);
    base = (char *)state + ((64 - ((uintptr_t)state & 63)) & 63);
    s = (gtaoi_state *)(void *)base;
    f = &s->context;
    *context = f;

    gtaoi_frame_settings(frame, &l, &settings);
    floats = (ptrdiff_t)(l.plane / sizeof(float));
    if (frame->cut || memcmp(&settings, &s->settings, sizeof settings) != 0) {
        memset(s, 0, sizeof *s);
        s->settings = settings;
    } else {
        s->count++;
    }
    had_third = f->f.motion && f->f.motion_components == 3;
    memset(f, 0, sizeof *f);
    f->fresh = s->count == 0;
    f->unchanged = frame->unchanged && !f->fresh;
    f->f = *frame;
    f->scale = l.scale, f->width = l.pass.width, f->height = l.pass.height;
    f->bent = l.bent, f->sets = l.sets, f->passes = l.passes, f->temporal = l.temporal;
    f->pitch = l.pitch, f->plane = floats;
    f->tiles_x = l.tiles_x, f->tiles_y = l.tiles_y;
    if (f->f.clamp_window == 0.0f)
        f->f.clamp_window = 0.5f;
    if (!f->f.max_history)
        f->f.max_history = 24;
    if (!f->f.motion_components)
        f->f.motion_components = 2;
    if (!f->f.motion_stride)
        f->f.motion_stride = (ptrdiff_t)frame->desc.width * f->f.motion_components * 4;

#define GTAOI_PLANES(offset) ((float *)(void *)(base + (offset)) + GTAOI_PAD)
    i = (int)(s->count & 1);
    f->height_now = GTAOI_PLANES(l.heights) + (i ? floats : 0);
    f->height_before = GTAOI_PLANES(l.heights) + (i ? 0 : floats);
    f->history_now = GTAOI_PLANES(l.history[i]), f->history_before = GTAOI_PLANES(l.history[!i]);
    f->raw = GTAOI_PLANES(l.raw);
    f->filtered[0] = GTAOI_PLANES(l.filtered[0]), f->filtered[1] = GTAOI_PLANES(l.filtered[1]);
    f->normals = GTAOI_PLANES(l.normal), f->motion = GTAOI_PLANES(l.moves);
    f->thickness = GTAOI_PLANES(l.thickness);
#undef GTAOI_PLANES
    f->signal = f->passes == 0 ? f->raw : f->filtered[f->passes == 2];
    f->result = f->temporal ? f->history_now : f->signal;
    f->changed = (uint8_t *)base + l.changed, f->rest = (uint8_t *)base + l.rest;
    f->still = (uint16_t *)(void *)(base + l.still);
    f->nearest = (float *)(void *)(base + l.nearest);
    f->mask = (uint8_t *)base + l.mask;
    if (had_third && f->f.motion && f->f.motion_components == 2) /* neither written nor read then, but shown */
        memset(f->motion + 2 * floats - GTAOI_PAD, 0, (size_t)l.plane);
    if (f->fresh) {
        memset(base + l.raw, 0, (size_t)(l.scratch - l.raw));
        gtaoi_fill_sky((float *)(void *)(base + l.heights), 2 * floats);
    }

    gtaoi_plan(&frame->desc, &full_layout);
    gtaoi_resolve(&frame->desc, output, &full_layout, &f->full);
    if (f->full.orthographic) { /* heights in pixels of the filters' resolution */
        float inv = 1.0f / (float)f->scale;
        f->full.w_scale *= inv, f->full.w_bias *= inv, f->full.same_surface *= inv;
        if (frame->desc.depth_kind == GTAO_DEPTH_DEVICE)
            f->full.w_far *= inv;
    }
    l.pass.depth = f->height_now, l.pass.depth_stride = f->pitch * 4;
    l.pass.depth_kind = GTAO_DEPTH_DEVICE;
    l.pass.device_scale = 1.0f, l.pass.device_bias = 0.0f;
    l.pass.normals = frame->desc.normals ? f->normals : 0;
    l.pass.normal_stride = f->pitch * 4, l.pass.normal_components = 3;
    l.pass.thickness_map = frame->desc.thickness_map ? f->thickness : 0, l.pass.thickness_stride = f->pitch * 4;
    l.pass.mask = frame->desc.mask ? f->mask : 0, l.pass.mask_stride = f->pitch;
    l.pass.frame = frame->desc.frame + s->count;
    memset(&signal, 0, sizeof signal);
    signal.signal = f->raw;
    signal.signal_stride = f->pitch * 4, signal.signal_plane_stride = floats * 4;
    signal.signal_planes = f->bent ? 5 : 2;
    signal.horizons = output->horizons, signal.arcs = output->arcs, signal.slices = output->slices;
    signal.surface = output->surface;
    signal.horizon_stride = output->horizon_stride, signal.horizon_plane = output->horizon_plane;
    if (frame->sh_bands) {
        signal.sh = f->raw + 5 * floats;
        signal.sh_stride = f->pitch * 4, signal.sh_plane_stride = floats * 4;
        signal.sh_bands = frame->sh_bands;
    }
    {
        /* The planes have padding, which gtao_begin's check of the strides does not know of: so none of it. */
        char *scratch = base + l.scratch;
        f->pass = (gtao_context *)(void *)scratch;
        gtaoi_begin(&l.pass, &signal, &l.pass_layout, scratch, f->pass);
    }
    /* What it reads are heights already. */
    f->pass->w_scale = 1.0f, f->pass->w_bias = 0.0f, f->pass->w_far = GTAOI_SKY_LIMIT;
    f->pass->normal_plane = frame->desc.normals ? floats : 0;
    f->pass->frame = f;

    if (frame->depth_tolerance > 0.0f) {
        f->tolerance_scale = f->pass->orthographic ? 0.0f : frame->depth_tolerance;
        f->tolerance_bias = f->pass->orthographic ? frame->depth_tolerance * gtaoi_min(f->pass->reach, 1e15f) : 0.0f;
    } else {
        f->tolerance_scale = f->pass->orthographic ? 0.0f : GTAOI_TOLERANCE_PX * 0.5f * (f->pass->bx1 + f->pass->by1);
        f->tolerance_bias = f->pass->orthographic ? GTAOI_TOLERANCE_PX : 0.0f;
    }
    f->disocclusion_scale = f->pass->orthographic ? 0.0f : GTAOI_DISOCCLUSION;
    f->disocclusion_bias = f->pass->orthographic ? GTAOI_DISOCCLUSION * gtaoi_min(f->pass->reach, 1e15f) : 0.0f;
    x = gtaoi_max(f->pass->cx, (float)f->width - f->pass->cx) * f->pass->bx1;
    y = gtaoi_max(f->pass->cy, (float)f->height - f->pass->cy) * f->pass->by1;
    f->ray_max = f->pass->orthographic ? 1.0f : sqrtf(gtaoi_min(x * x + y * y + 1.0f, 1e30f));
    if (f->temporal)
        memcpy(f->window[0], (l.pass.frame & 1) ? odd : even, sizeof even);
    else
        memcpy(f->window[0], centred, sizeof centred);
    memcpy(f->window[1], smooth, sizeof smooth);

    /* Where a point was: P' = R P + t; with P = z r, and heights unit / z, that is R r + t w / unit. */
    for (i = 0; i < 12; i++)
        at_rest &= frame->view_to_previous[i] == 0.0f;
    for (i = 0; i < 12; i++) {
        float identity = i % 5 == 0 ? 1.0f : 0.0f;
        f->before[i] = at_rest ? identity : frame->view_to_previous[i];
        f->moved |= f->before[i] != identity;
        if (i % 4 == 3)
            f->before[i] = gtaoi_clamp(f->before[i] / gtaoi_height_unit(f->pass), -1e18f, 1e18f);
    }
    {
        gtao_camera camera = l.pass.camera;
        same_camera = s->count > 0 && memcmp(&camera, &s->camera, sizeof camera) == 0;
        if (s->count == 0)
            s->camera = camera;
        f->moved = (f->moved && !frame->motion) || !same_camera;
        f->before_fx = s->camera.fx, f->before_fy = gtaoi_fy(&s->camera);
        f->before_cx = s->camera.cx, f->before_cy = s->camera.cy;
        s->camera = camera;
    }
    return GTAO_OK;
}

GTAO_API const gtao_context *gtao_frame_horizons(const gtao_frame_context *context) {
    return context->pass;
}

GTAO_API int gtao_frame_stages(const gtao_frame_context *context) {
    return 3 + context->passes + context->temporal + 1;
}

/* Which of the kinds of stages, and which pass of the spatial filter. */
static int gtaoi_frame_stage(const gtao_frame_context *f, int stage, int *pass) {
    *pass = 0;
    if (stage < GTAOI_SPATIAL)
        return stage;
    *pass = stage - GTAOI_SPATIAL;
    if (*pass < f->passes)
        return GTAOI_SPATIAL;
    return *pass == f->passes && f->temporal ? GTAOI_TEMPORAL : GTAOI_OUTPUT;
}

GTAO_API const char *gtao_frame_stage_name(const gtao_frame_context *context, int stage) {
    static const char *const names[] = {"reduce", "prepare", "horizons", "spatial", "temporal", "upsample"};
    int pass;
    return names[gtaoi_frame_stage(context, stage, &pass)];
}

/* Rows of tiles in a unit: what can rise is told from strips of them. */
static int gtaoi_unit_tiles(int kind) {
    return kind == GTAOI_PREPARE || kind == GTAOI_HORIZONS ? (int)GTAO_STRIP / (int)GTAOI_TILE_H : 1;
}

GTAO_API int gtao_frame_units(const gtao_frame_context *context, int stage) {
    int pass, tiles = gtaoi_unit_tiles(gtaoi_frame_stage(context, stage, &pass));
    return (context->tiles_y + tiles - 1) / tiles;
}

GTAO_API void gtao_frame_run(gtao_frame_context *context, int stage, int unit_begin, int unit_end, gtao_stats *stats) {
    gtao_stats unused;
    int pass, set = 0, kind = gtaoi_frame_stage(context, stage, &pass), y0, y1, k;
    gtao_isa isa = context->pass->d.isa;
    if (!stats)
        memset(&unused, 0, sizeof unused), stats = &unused;
    unit_begin = gtaoi_imin(gtaoi_imax(unit_begin, 0), context->tiles_y) * gtaoi_unit_tiles(kind);
    unit_end = gtaoi_imin(gtaoi_imin(unit_end, context->tiles_y) * gtaoi_unit_tiles(kind), context->tiles_y);
    y0 = unit_begin * GTAOI_TILE_H, y1 = gtaoi_imin(unit_end * GTAOI_TILE_H, context->height);
    switch (kind) {
    case GTAOI_REDUCE:
        if (context->unchanged)
            gtaoi_keep(context, unit_begin, unit_end);
        else
            GTAOI_DISPATCH(isa, gtaoi_reduce, (context, unit_begin, unit_end));
        break;
    case GTAOI_PREPARE:
        gtaoi_judge_tiles(context, unit_begin, unit_end);
        for (; unit_begin < unit_end; unit_begin++)
            if (context->fresh || context->f.no_skip || gtaoi_row_changed(context, unit_begin)) {
                y0 = unit_begin * GTAOI_TILE_H, y1 = gtaoi_imin(y0 + GTAOI_TILE_H, context->height);
                GTAOI_DISPATCH(isa, gtaoi_prepare, (context->pass, y0, y1));
            }
        break;
    case GTAOI_HORIZONS:
        GTAOI_DISPATCH(isa, gtaoi_visibility, (context->pass, y0, y1, stats));
        for (; y0 < y1; y0++) /* what the filter sees beyond a seam */
            for (k = 0; k < (context->bent ? 5 : 2); k++)
                gtaoi_pad_plane(context, context->raw + k * context->plane + (ptrdiff_t)y0 * context->pitch, 0);
        break;
    case GTAOI_SPATIAL:
        for (; set < gtaoi_imax(context->sets, 1); set++)
            GTAOI_DISPATCH(isa, gtaoi_spatial, (context, pass, set, y0, y1));
        break;
    case GTAOI_TEMPORAL:
        for (; set < gtaoi_imax(context->sets, 1); set++)
            GTAOI_DISPATCH(isa, gtaoi_temporal, (context, set, y0, y1));
        break;
    default:
        for (; set < gtaoi_imax(context->sets, 1); set++)
            GTAOI_DISPATCH(isa, gtaoi_upsample, (context, set, y0, y1));
        break;
    }
}

GTAO_API gtao_result gtao_frame(const gtao_frame_desc *frame, const gtao_output *output, void *state, size_t state_size,
                                gtao_stats *stats) {
    gtao_frame_context *f;
    gtao_result result = gtao_frame_begin(frame, output, state, state_size, &f);
    int stage;
    if (result != GTAO_OK)
        return result;
    for (stage = 0; stage < gtao_frame_stages(f); stage++)
        gtao_frame_run(f, stage, 0, gtao_frame_units(f, stage), stats);
    return GTAO_OK;
}

GTAO_API const float *gtao_frame_plane(const gtao_frame_context *context, gtao_plane plane, int *width, int *height,
                                       ptrdiff_t *stride) {
    const gtao_frame_context *f = context;
    const float *planes[6];
    planes[GTAO_PLANE_HEIGHT] = f->height_now;
    planes[GTAO_PLANE_RAW] = f->raw;
    planes[GTAO_PLANE_WEIGHT] = f->raw + f->plane;
    planes[GTAO_PLANE_FILTERED] = f->passes ? f->signal : 0;
    planes[GTAO_PLANE_VISIBILITY] = f->result;
    planes[GTAO_PLANE_LENGTH] = f->temporal ? f->history_now + GTAOI_HISTORY_LENGTH * f->plane : 0;
    *width = f->width, *height = f->height, *stride = f->pitch * 4;
    return (unsigned)plane <= GTAO_PLANE_LENGTH ? planes[plane] : 0;
}

GTAO_API const gtao_context *gtao_frame_image(const gtao_frame_context *context) {
    return &context->full;
}

GTAO_API const float *gtao_frame_stage_plane(const gtao_frame_context *context, int stage, int plane, const char **name,
                                             ptrdiff_t *stride) {
    static const char *const reduced[] = {"height",   "normal.X", "normal.Y", "normal.Z",
                                          "motion.X", "motion.Y", "motion.Z"};
    static const char *const signals[] = {"visibility", "weight", "bent.X", "bent.Y", "bent.Z"};
    static const char *const histories[] = {"visibility", "length", "bent.X", "bent.Y",
                                            "bent.Z",     "speed",  "last",   "deviation"};
    const gtao_frame_context *f = context;
    int pass, kind = gtaoi_frame_stage(f, stage, &pass), normals = f->full.d.normals ? 3 : 0,
              motions = f->f.motion ? 3 : 0;
    *stride = f->pitch * 4;
    if (plane < 0)
        return 0;
    if (kind == GTAOI_REDUCE) {
        if (plane > normals + motions)
            return 0;
        *name = reduced[plane > normals ? plane - normals + 3 : plane];
        return plane == 0         ? f->height_now
               : plane <= normals ? f->normals + (plane - 1) * f->plane
                                  : f->motion + (plane - normals - 1) * f->plane;
    }
    if (kind == GTAOI_HORIZONS || kind == GTAOI_SPATIAL) {
        if (plane >= (f->bent ? 5 : 2))
            return 0;
        *name = signals[plane];
        return (kind == GTAOI_HORIZONS ? f->raw : f->filtered[pass & 1]) + plane * f->plane;
    }
    if (kind == GTAOI_TEMPORAL) {
        if (plane >= (f->bent ? 8 : 5))
            return 0;
        if (!f->bent && plane >= 2)
            plane += 3;
        *name = histories[plane];
        return f->history_now + plane * f->plane;
    }
    return 0;
}

GTAO_API void gtao_frame_get_constants(const gtao_frame_context *context, gtao_frame_constants *constants) {
    const gtao_frame_context *f = context;
    gtao_frame_constants *k = constants;
    memset(k, 0, sizeof *k);
    k->scale = f->scale, k->reduction = (int)f->f.reduction, k->spatial_passes = f->passes, k->temporal = f->temporal;
    k->fresh = f->fresh, k->moved = f->moved, k->history = (int)f->f.history, k->max_history = f->f.max_history;
    k->motion_components = f->f.motion ? f->f.motion_components : 0;
    memcpy(k->window0, f->window[0], sizeof k->window0);
    memcpy(k->window1, f->window[1], sizeof k->window1);
    k->tolerance_scale = f->tolerance_scale, k->tolerance_bias = f->tolerance_bias;
    k->clamp_window = f->f.clamp_window, k->clamp_noise = GTAOI_CLAMP_NOISE, k->blur_cost = GTAOI_BLUR_COST;
    k->disocclusion_scale = f->disocclusion_scale, k->disocclusion_bias = f->disocclusion_bias;
    memcpy(k->before, f->before, sizeof k->before);
    k->before_fx = f->before_fx, k->before_fy = f->before_fy, k->before_cx = f->before_cx, k->before_cy = f->before_cy;
}

/* Height of a depth beyond the image, orthographic. */
static float gtaoi_line_height(const gtao_context *c, float depth) {
    return gtaoi_height_scalar(c, depth, 0.0f, 0.0f);
}

/* ---- the sweep: stages ------------------------------------------------------------------------------------------ */

/* The description that the near pixels are searched with. */
static gtao_desc gtaoi_near_desc(const gtao_desc *desc) {
    gtao_desc d = *desc;
    d.every_pixel = 1;
    d.max_radius_px = GTAO_SWEEP_NEAR + GTAO_SWEEP_NEAR / 2; /* along the diagonal, too */
    d.noise = GTAO_NOISE_NONE;
    d.far_depth = GTAO_FAR_EXACT;
    if (d.slices == 0)
        d.slices = 32;
    return d;
}

static gtao_result gtaoi_check_sweep(const gtao_desc *d, const gtao_output *o, const gtao_sweep_options *s) {
    gtao_result result = gtaoi_check_desc(d);
    if (result != GTAO_OK)
        return result;
    if (d->estimator == GTAO_ESTIMATOR_MEMO || d->thin_blend > 0.0f || d->thickness > 0.0f || d->thickness_map ||
        d->back || d->layer_count > 0 || (o && (o->signal || gtaoi_has_planes(o))))
        return GTAO_ERROR_SWEEP;
    if (d->error_target > 0.0f)
        return GTAO_ERROR_TARGET;
    if (!(s && s->horizons && !o))
        result = gtaoi_check_output(d, o);
    if (result != GTAO_OK || !s)
        return result;
    if (s->region[0] || s->region[1] || s->region[2] || s->region[3]) {
        if (s->region[0] < 0 || s->region[1] < 0 || s->region[2] <= s->region[0] || s->region[3] <= s->region[1] ||
            s->region[2] > d->width || s->region[3] > d->height)
            return GTAO_ERROR_REGION;
    }
    if (s->horizons && !gtaoi_planes_ok(s->horizon_stride, s->horizon_plane, d->width, d->height))
        return GTAO_ERROR_HORIZONS;
    if (s->beyond && (d->border != GTAO_BORDER_OPEN || d->camera.projection != GTAO_ORTHOGRAPHIC ||
                      s->beyond_reach < 1 || s->beyond_reach > 1048576))
        return GTAO_ERROR_BEYOND;
    if (s->batch < 0 || s->batch > 64)
        return GTAO_ERROR_BATCH;
    return GTAO_OK;
}

static uint64_t gtaoi_align64(uint64_t x) {
    return (x + 63) / 64 * 64;
}

static void gtaoi_plan_sweep(const gtao_desc *d, const gtao_output *o, const gtao_sweep_options *s,
                             gtaoi_sweep_layout *l) {
    gtao_desc near_desc = gtaoi_near_desc(d);
    gtaoi_layout n;
    int diagonal = (int)sqrt((double)d->width * (double)d->width + (double)d->height * (double)d->height) + 1;
    uint64_t w = (uint64_t)d->width, h = (uint64_t)d->height;
    gtaoi_plan(&near_desc, &n);
    memset(l, 0, sizeof *l);
    l->batch = gtaoi_imin(s && s->batch ? s->batch : 4, near_desc.slices);
    l->fields = o && o->sh ? 15 : o && (o->bent_normals || o->packed) ? 8 : 2;
    l->lead = d->border == GTAO_BORDER_OPEN ? 0 : diagonal;
    if (l->lead && d->camera.projection == GTAO_ORTHOGRAPHIC) {
        float reach = d->radius / gtaoi_min(d->camera.sx, gtaoi_sy(&d->camera)) + 1.0f;
        if (reach < (float)l->lead)
            l->lead = (int)reach;
    }
    l->longest = gtaoi_imax(d->width, d->height) + 2 * l->lead;
    l->pitch = n.pitch;
    l->turned_pitch = (d->height + 2 * GTAOI_PAD + GTAOI_LANES + 15) & ~15;
    if (l->turned_pitch % 1024 == 0)
        l->turned_pitch += 16;
    l->beyond_pitch = (d->width + 63) & ~63;
    if (l->beyond_pitch % 1024 == 0)
        l->beyond_pitch += 16;
    l->sweep = gtaoi_align64(n.total);
    l->turned = l->sweep + gtaoi_align64(sizeof(struct gtao_sweep));
    l->beyond = l->turned + gtaoi_align64(w * (uint64_t)l->turned_pitch * 4);
    if (d->radius < 1e30f) {
        int i;
        for (i = 0; i < 4; i++) {
            l->tilt[i / 2][i % 2] = l->beyond;
            l->beyond += gtaoi_align64((i % 2 ? w * (uint64_t)l->turned_pitch : h * (uint64_t)l->pitch) * 4);
        }
    }
    l->sums = l->beyond + gtaoi_align64(2 * (uint64_t)l->batch * h * (uint64_t)l->beyond_pitch * 4);
    l->inverse = l->sums;
    if (l->batch < near_desc.slices)
        l->inverse += gtaoi_align64(h * (uint64_t)l->fields * ((w + 63) / 64 * 64) * 4);
    l->seeds = s && s->beyond ? GTAO_BEYOND_CAPACITY : 0;
    l->farthest = l->longest + (s && s->beyond ? s->beyond_reach : 0) + 2 * GTAOI_MARGIN;
    l->total = l->inverse + (2 * (uint64_t)l->farthest + 1) * 4 + 63;
    /* a group of lines: heights, gradients and hulls */
    l->work = ((uint64_t)GTAOI_TILE * 24 + 24) * ((uint64_t)l->longest + GTAOI_TILE + 2 * GTAOI_MARGIN) +
              (uint64_t)GTAOI_TILE * sizeof(gtaoi_vertex) * (uint64_t)l->seeds;
    if (l->work < (uint64_t)GTAOI_TILE * (uint64_t)l->pitch * 4)
        l->work = (uint64_t)GTAOI_TILE * (uint64_t)l->pitch * 4;
    l->work = gtaoi_align64(l->work) + 63;
}

GTAO_API size_t gtao_sweep_scratch_size(const gtao_desc *desc, const gtao_output *output,
                                        const gtao_sweep_options *options) {
    gtaoi_sweep_layout l;
    if (gtaoi_check_sweep(desc, output, options) != GTAO_OK)
        return 0;
    gtaoi_plan_sweep(desc, output, options, &l);
    return l.total <= SIZE_MAX ? (size_t)l.total : 0;
}

GTAO_API size_t gtao_sweep_work_size(const gtao_desc *desc, const gtao_sweep_options *options) {
    gtaoi_sweep_layout l;
    if (gtaoi_check_desc(desc) != GTAO_OK)
        return 0;
    gtaoi_plan_sweep(desc, 0, options, &l);
    return l.work <= SIZE_MAX ? (size_t)l.work : 0;
}

GTAO_API gtao_result gtao_sweep_begin(const gtao_desc *desc, const gtao_output *output,
                                      const gtao_sweep_options *options, void *scratch, size_t scratch_size,
                                      gtao_sweep **sweep) {
    gtao_result result = gtaoi_check_sweep(desc, output, options);
    gtao_output none;
    gtao_desc near_desc;
    gtaoi_sweep_layout l;
    gtao_context *c;
    gtao_sweep *s;
    char *base;
    size_t i;
    if (result != GTAO_OK)
        return result;
    gtaoi_plan_sweep(desc, output, options, &l);
    if (!scratch || scratch_size < l.total || !sweep)
        return GTAO_ERROR_SCRATCH;
    memset(&none, 0, sizeof none);
    none.visibility = scratch;
    near_desc = gtaoi_near_desc(desc);
    result = gtao_begin(&near_desc, output ? output : &none, scratch, scratch_size, &c);
    if (result != GTAO_OK)
        return result;
    base = (char *)c;
    s = (gtao_sweep *)(void *)(base + l.sweep);
    memset(s, 0, sizeof *s);
    *sweep = s;
    s->c = c;
    if (!output)
        c->o.visibility = 0;
    if (options)
        s->o = *options;
    if (s->o.region[2] == 0)
        s->o.region[2] = desc->width, s->o.region[3] = desc->height;
    c->o.horizons = s->o.horizons;
    if (s->o.horizon_stride)
        c->o.horizon_stride = s->o.horizon_stride;
    c->o.horizon_plane = s->o.horizon_plane;
    if (c->o.horizon_plane == 0)
        c->o.horizon_plane = (c->o.horizon_stride < 0 ? -c->o.horizon_stride : c->o.horizon_stride) * desc->height;
    c->x_begin = s->o.region[0], c->x_end = s->o.region[2];
    for (i = 0; i < (size_t)c->period * (size_t)c->period * (size_t)c->slices * (size_t)c->classes; i++)
        c->count[i] = gtaoi_imin(c->count[i], GTAO_SWEEP_NEAR);
    s->batch = l.batch, s->fields = l.fields, s->lead = l.lead;
    s->y_begin = s->o.region[1], s->y_end = s->o.region[3];
    s->bands = (desc->height + GTAOI_TILE - 1) / GTAOI_TILE;
    s->turned_pitch = l.turned_pitch, s->beyond_pitch = l.beyond_pitch;
    s->turned = (float *)(void *)(base + l.turned) + GTAOI_PAD;
    for (i = 0; i < 4 && c->bounded; i++)
        s->tilt[i / 2][i % 2] = (float *)(void *)(base + l.tilt[i / 2][i % 2]) + GTAOI_PAD;
    s->beyond = (float *)(void *)(base + l.beyond);
    s->beyond_plane = (size_t)desc->height * (size_t)l.beyond_pitch;
    s->sums = (float *)(void *)(base + l.sums);
    s->sums_row = (size_t)((desc->width + 63) & ~63) * (size_t)l.fields;
    s->inverse = (float *)(void *)(base + l.inverse) + l.farthest;
    s->inverse[0] = 0.0f;
    for (i = 1; i <= (size_t)l.farthest; i++)
        s->inverse[i] = s->inverse[-(ptrdiff_t)i] = (float)(1.0 / (double)i);
    return GTAO_OK;
}

GTAO_API const gtao_context *gtao_sweep_context(const gtao_sweep *sweep) {
    return sweep->c;
}

/* Phases: heights; gradients and the turned buffers; then, for every batch of slices, lines and rows. */
GTAO_API int gtao_sweep_phases(const gtao_sweep *sweep) {
    return 2 + 2 * ((sweep->c->slices + sweep->batch - 1) / sweep->batch);
}

static gtaoi_cut gtaoi_cut_slice(const gtao_sweep *s, int k) {
    GTAOI_NO_CONTRACT
    const gtao_context *c = s->c;
    gtaoi_cut cut;
    double dx, dy, low, high, golden = ((double)k + 1.0) * 0.61803398874989485;
    gtaoi_sincospi(((double)k + 0.5) / (double)c->slices, &dy, &dx);
    cut.x_major = (dx < 0.0 ? -dx : dx) >= (dy < 0.0 ? -dy : dy);
    cut.n_major = cut.x_major ? c->d.width : c->d.height;
    cut.n_minor = cut.x_major ? c->d.height : c->d.width;
    cut.slope = cut.x_major ? dy / dx : dx / dy;
    cut.phase = golden - (double)(int)golden; /* so that the lines of different slices pass the pixels differently */
    cut.ascending = (cut.x_major ? dx : dy) > 0.0;
    low = cut.slope * (double)(cut.n_major - 1), high = low > 0.0 ? low : 0.0;
    low = low < 0.0 ? low : 0.0;
    cut.line_begin = 0, cut.groups = (cut.n_minor + GTAOI_TILE - 1) / GTAOI_TILE;
    if (c->d.border != GTAO_BORDER_WRAP) {
        cut.line_begin = -(int)high - 2;
        cut.groups = (cut.n_minor + 1 - (int)low - cut.line_begin + GTAOI_TILE) / GTAOI_TILE;
    }
    return cut;
}

static int gtaoi_batch_end(const gtao_sweep *s, int phase) {
    return gtaoi_imin((phase / 2) * s->batch, s->c->slices);
}

GTAO_API int gtao_sweep_units(const gtao_sweep *sweep, int phase) {
    int k, units = 0;
    if (phase < 0 || phase >= gtao_sweep_phases(sweep))
        return 0;
    if (phase < 2)
        return sweep->bands;
    if (phase & 1)
        return (sweep->y_end - sweep->y_begin + GTAOI_TILE - 1) / GTAOI_TILE;
    for (k = (phase / 2 - 1) * sweep->batch; k < gtaoi_batch_end(sweep, phase); k++)
        units += gtaoi_cut_slice(sweep, k).groups;
    return units;
}

/* The turned height buffer's share of a band of rows; if the radius is finite, the gradients there. */
static void gtaoi_sweep_turn(const gtao_sweep *s, int band) {
    gtao_context c = *s->c;
    gtaoi_pass pass;
    int w = c.d.width, h = c.d.height, y0 = band * GTAOI_TILE, y1 = gtaoi_imin(y0 + GTAOI_TILE, h), x, y, i;
    int begin = y0 == 0 ? -GTAOI_PAD : y0, end = y1 == h ? (int)s->turned_pitch - GTAOI_PAD : y1;
    for (y = begin; y < end; y += GTAOI_TILE) {
        const float *rows[GTAOI_TILE];
        int n = gtaoi_imin(end - y, GTAOI_TILE);
        for (i = 0; i < n; i++)
            rows[i] = gtaoi_row(&c, y + i) + GTAOI_PAD;
        for (x = 0; x < w; x++) {
            float *to = s->turned + (ptrdiff_t)x * s->turned_pitch + y;
            for (i = 0; i < n; i++)
                to[i] = rows[i][x];
        }
    }
    for (i = 0; i < 2 * s->batch; i++) /* what is read past the rows' ends */
        for (y = y0; y < y1; y++)
            for (x = w; x < s->beyond_pitch; x++)
                s->beyond[(size_t)i * s->beyond_plane + (size_t)((ptrdiff_t)y * s->beyond_pitch + x)] = 0.0f;
    if (!c.bounded)
        return;
    for (i = 0; i < 2; i++)
        for (y = y0; y < y1; y++)
            memset(s->tilt[i][0] + (ptrdiff_t)y * c.pitch - GTAOI_PAD, 0, (size_t)c.pitch * sizeof(float));
    memset(&pass, 0, sizeof pass);
    pass.tilt_x = s->tilt[0][0], pass.tilt_y = s->tilt[1][0];
    pass.tilt_pitch = c.pitch;
    c.pass = &pass, c.plain = 0, c.x_begin = 0, c.x_end = w;
    gtao_visibility_rows(&c, y0, y1, 0);
    for (i = 0; i < 2; i++)
        for (y = begin; y < end; y++)
            for (x = 0; x < w; x++)
                s->tilt[i][1][(ptrdiff_t)x * s->turned_pitch + y] =
                    y >= 0 && y < h ? s->tilt[i][0][(ptrdiff_t)y * c.pitch + x] : 0.0f;
}

/* First and last + 1 column at which a group of lines is over the image, give or take one. */
static void gtaoi_sweep_span(const gtaoi_cut *cut, int line, int *begin, int *end) {
    GTAOI_NO_CONTRACT
    /* -GTAOI_TILE - 1 < line + slope i + phase < n_minor */
    double low = (double)(-GTAOI_TILE - 1 - line) - cut->phase, high = (double)(cut->n_minor - line) - cut->phase;
    double n = (double)cut->n_major;
    *begin = 0, *end = cut->n_major;
    if (cut->slope < 0.0) {
        double swap = -low;
        low = -high, high = swap;
    }
    if (cut->slope == 0.0) {
        if (low >= 0.0 || high <= 0.0)
            *end = 0;
        return;
    }
    low /= cut->slope < 0.0 ? -cut->slope : cut->slope;
    high /= cut->slope < 0.0 ? -cut->slope : cut->slope;
    *begin = low <= 0.0 ? 0 : low >= n ? cut->n_major : (int)low;
    *end = high >= n ? cut->n_major : high <= 0.0 ? 0 : gtaoi_imin((int)high + 1, cut->n_major);
}

static void gtaoi_sweep_group(const gtao_sweep *s, int k, int group, int plane, void *work) {
    const gtao_context *c = s->c;
    gtaoi_cut cut = gtaoi_cut_slice(s, k);
    gtaoi_lines l;
    int begin = 0, end = cut.n_major, i;
    memset(&l, 0, sizeof l);
    l.c = c;
    l.x_major = cut.x_major, l.n_major = cut.n_major, l.n_minor = cut.n_minor;
    l.plane = cut.x_major ? s->turned : c->w + GTAOI_PAD;
    l.tilt_along = s->tilt[!cut.x_major][cut.x_major], l.tilt_across = s->tilt[cut.x_major][cut.x_major];
    l.slice = c->slice + k;
    l.pitch = cut.x_major ? s->turned_pitch : c->pitch;
    l.slope = cut.slope, l.phase = cut.phase;
    l.line = cut.line_begin + group * GTAOI_TILE;
    if (c->d.border != GTAO_BORDER_WRAP)
        gtaoi_sweep_span(&cut, l.line, &begin, &end);
    if (begin >= end)
        return;
    /* Rows that are not wanted need no line, columns that are not wanted no receivers. */
    l.begin = s->lead, l.end = end - begin + s->lead, l.count = l.end + s->lead;
    l.first = begin - s->lead;
    l.tiles = (l.count + GTAOI_TILE - 1) / GTAOI_TILE;
    l.backward[0] = cut.ascending, l.backward[1] = !cut.ascending;
    i = cut.x_major ? 0 : 1;
    l.begin = gtaoi_imax(l.begin, s->o.region[i] - l.first), l.end = gtaoi_imin(l.end, s->o.region[i + 2] - l.first);
    l.want_begin = s->o.region[1 - i], l.want_end = s->o.region[3 - i];
    l.beyond = s->beyond + (size_t)plane * s->beyond_plane;
    l.beyond_pitch = s->beyond_pitch, l.beyond_plane = s->beyond_plane;
    l.inverse = s->inverse;
    l.length = l.tiles * GTAOI_TILE + 2 * GTAOI_MARGIN;
    l.strip = (float *)work + GTAOI_MARGIN;
    l.vertex = (gtaoi_vertex *)(void *)((float *)work + GTAOI_TILE * l.length);
    l.room = l.length + (s->o.beyond ? GTAO_BEYOND_CAPACITY : 0);
    l.options = &s->o;
    l.minor = (int *)(void *)(l.vertex + GTAOI_TILE * l.room);
    l.ahead = (float *)(void *)(l.minor + l.length);
    l.highest = l.ahead + GTAOI_TILE * l.length;
    l.highest_block = l.highest + l.length;
    l.start = (int32_t *)(void *)(l.highest_block + l.length);
    l.above = (uint16_t *)(void *)(l.start + l.length);
    memset(l.above, 0, GTAOI_TILE * (size_t)(l.tiles + 4) * sizeof(uint16_t));
    gtaoi_sweep_start(&l, 0);
    GTAOI_DISPATCH(c->d.isa, gtaoi_sweep_lines, (&l));
}

GTAO_API void gtao_sweep_run(const gtao_sweep *sweep, int phase, int unit_begin, int unit_end, void *work) {
    int unit, k, first = (phase / 2 - 1) * sweep->batch;
    if (phase < 0 || phase >= gtao_sweep_phases(sweep))
        return;
    work = (char *)work + ((64 - ((uintptr_t)work & 63)) & 63);
    unit_begin = gtaoi_imax(unit_begin, 0), unit_end = gtaoi_imin(unit_end, gtao_sweep_units(sweep, phase));
    for (unit = unit_begin; unit < unit_end; unit++) {
        if (phase == 0) {
            gtao_prepare_rows(sweep->c, unit * GTAOI_TILE, (unit + 1) * GTAOI_TILE);
        } else if (phase == 1) {
            gtaoi_sweep_turn(sweep, unit);
        } else if (phase & 1) {
            gtao_context c = *sweep->c;
            gtaoi_pass pass;
            int y = sweep->y_begin + unit * GTAOI_TILE;
            memset(&pass, 0, sizeof pass);
            pass.beyond = sweep->beyond, pass.beyond_pitch = sweep->beyond_pitch;
            pass.beyond_plane = sweep->beyond_plane;
            pass.sums = sweep->sums, pass.sums_row = sweep->sums_row, pass.fields = sweep->fields;
            pass.options = &sweep->o;
            c.pass = &pass, c.plain = 0, c.slice_begin = first, c.slice_end = gtaoi_batch_end(sweep, phase);
            gtao_visibility_rows(&c, y, gtaoi_imin(y + GTAOI_TILE, sweep->y_end), 0);
        } else {
            int rest = unit;
            for (k = first; rest >= gtaoi_cut_slice(sweep, k).groups; k++)
                rest -= gtaoi_cut_slice(sweep, k).groups;
            gtaoi_sweep_group(sweep, k, rest, 2 * (k - first), work);
        }
    }
}

GTAO_API gtao_result gtao_sweep_compute(const gtao_desc *desc, const gtao_output *output,
                                        const gtao_sweep_options *options, void *scratch, size_t scratch_size,
                                        gtao_progress progress, void *user) {
    gtao_sweep *sweep;
    gtao_result result = gtaoi_check_sweep(desc, output, options);
    size_t work = gtao_sweep_work_size(desc, options);
    int phase, unit;
    double phases;
    if (result == GTAO_OK && (!scratch || scratch_size < work))
        result = GTAO_ERROR_SCRATCH;
    if (result == GTAO_OK)
        result = gtao_sweep_begin(desc, output, options, (char *)scratch + work, scratch_size - work, &sweep);
    if (result != GTAO_OK)
        return result;
    phases = (double)gtao_sweep_phases(sweep);
    for (phase = 0; phase < gtao_sweep_phases(sweep); phase++) {
        int units = gtao_sweep_units(sweep, phase), some = units / 16 + 1;
        for (unit = 0; unit < units; unit += some) {
            gtao_sweep_run(sweep, phase, unit, unit + some, scratch);
            if (progress &&
                progress(user, ((double)phase + (double)gtaoi_imin(unit + some, units) / (double)units) / phases))
                return GTAO_CANCELLED;
        }
    }
    return GTAO_OK;
}

#if defined(__clang__)
#if defined(__i386__) && !defined(__SSE2_MATH__)
#pragma clang attribute pop
#endif
#else
#if defined(__GNUC__)
#pragma GCC pop_options
#pragma GCC diagnostic pop
#elif defined(_MSC_VER)
#pragma float_control(pop)
#endif
#endif

#endif /* GTAO_IMPLEMENTATION */
#else  /* GTAOI_W */
/* ================================================================================================================
 * KERNELS, written once, compiled for GTAOI_W lanes
 * ================================================================================================================ */

#define GTAOI_FN static GTAOI_ATTRIBUTE
#define GTAOI_FI GTAOI_INLINE GTAOI_ATTRIBUTE
#define GTAOI_ALL ((1u << GTAOI_W) - 1u)

#define GV GTAOI_NAME(gtaoi_v)
#define GI GTAOI_NAME(gtaoi_i)
#define GM GTAOI_NAME(gtaoi_m)
#define GTAOI_PIXEL GTAOI_NAME(gtaoi_pixel)
#define GTAOI_FRAME GTAOI_NAME(gtaoi_frame)
#define GTAOI_SAMPLE GTAOI_NAME(gtaoi_rising)
#define GTAOI_HORIZONS GTAOI_NAME(gtaoi_horizons)
#define GTAOI_ARCS GTAOI_NAME(gtaoi_arcs)
#define GTAOI_COLUMN GTAOI_NAME(gtaoi_column)
#define GTAOI_WALK GTAOI_NAME(gtaoi_walk)
#define GTAOI_HISTORY GTAOI_NAME(gtaoi_history)
#define GTAOI_TAPS GTAOI_NAME(gtaoi_block_taps)
#define GTAOI_GROUPS GTAOI_NAME(gtaoi_groups)

#if GTAOI_W == 1
typedef float GV;
typedef int GM;
#define GV_SET(x) (x)
#define GV_LOAD(p) (*(p))
#define GV_STORE(p, a) (*(p) = (a))
#define GV_ADD(a, b) ((a) + (b))
#define GV_SUB(a, b) ((a) - (b))
#define GV_MUL(a, b) ((a) * (b))
#define GV_DIV(a, b) ((a) / (b))
#define GV_SQRT(a) sqrtf(a)
#define GV_MIN(a, b) gtaoi_min(a, b) /* a < b ? a : b */
#define GV_MAX(a, b) gtaoi_max(a, b) /* a > b ? a : b */
#define GV_ABS(a) gtaoi_from_bits(gtaoi_bits(a) & 0x7fffffffu)
#define GV_LT(a, b) ((a) < (b))
#define GV_LE(a, b) ((a) <= (b))
#define GV_EQ(a, b) ((a) == (b))
#define GV_IF(m, a) ((m) ? (a) : 0.0f)            /* m ? a : 0 */
#define GV_SELECT(m, a, b) ((m) ? (a) : (b))      /* m ? a : b */
#define GV_MAX_IF(m, a, b) GV_MAX(a, GV_IF(m, b)) /* m ? max(a, b) : a, 0 <= a */
#define GM_AND(a, b) ((a) & (b))
#define GM_OR(a, b) ((a) | (b))
#define GM_ANDNOT(a, b) ((a) & !(b)) /* a and not b */
#define GM_BITS(m) ((unsigned)(m))
#define GM_ANY(m) (m)
#define GV_CLASS(a) gtaoi_from_bits(gtaoi_bits(a) & GTAOI_CLASS_MASK) /* a, its mantissa cut */
typedef uint32_t GI; /* masks of sectors */
#define GI_SET(x) (x)
#define GI_OR(a, b) ((a) | (b))
#define GI_AND(a, b) ((a) & (b))
#define GI_ANDNOT(a, b) ((a) & ~(b)) /* a and not b */
#define GI_ADD(a, b) ((a) + (b))
#define GI_IF(m, a) ((m) ? (a) : 0u)
#define GI_SELECT(m, a, b) ((m) ? (a) : (b))
#define GI_IS_ZERO(a) ((a) == 0u)
#define GI_FROM(f) GTAOI_NAME(gtaoi_bits_from)((int)(f))                         /* all bits from the f-th, 0..32 */
#define GI_INDEX(a) ((float)(int)(gtaoi_bits((float)(a)) >> 23 & 255u) - 127.0f) /* of the only bit */
GTAOI_INLINE uint32_t GTAOI_NAME(gtaoi_bits_from)(int i) {
    return i < 32 ? ~UINT32_C(0) << i : 0u;
}

#elif GTAOI_W == 4 && GTAOI_X86
typedef __m128 GV;
typedef __m128 GM;
#define GV_SET(x) _mm_set1_ps(x)
#define GV_LOAD(p) _mm_loadu_ps(p)
#define GV_STORE(p, a) _mm_storeu_ps(p, a)
#define GV_ADD(a, b) _mm_add_ps(a, b)
#define GV_SUB(a, b) _mm_sub_ps(a, b)
#define GV_MUL(a, b) _mm_mul_ps(a, b)
#define GV_DIV(a, b) _mm_div_ps(a, b)
#define GV_SQRT(a) _mm_sqrt_ps(a)
#define GV_MIN(a, b) _mm_min_ps(a, b)
#define GV_MAX(a, b) _mm_max_ps(a, b)
#define GV_ABS(a) _mm_andnot_ps(_mm_set1_ps(-0.0f), a)
#define GV_LT(a, b) _mm_cmplt_ps(a, b)
#define GV_LE(a, b) _mm_cmple_ps(a, b)
#define GV_EQ(a, b) _mm_cmpeq_ps(a, b)
#define GV_IF(m, a) _mm_and_ps(m, a)
#define GV_SELECT(m, a, b) _mm_or_ps(_mm_and_ps(m, a), _mm_andnot_ps(m, b))
#define GV_MAX_IF(m, a, b) GV_MAX(a, GV_IF(m, b))
#define GM_AND(a, b) _mm_and_ps(a, b)
#define GM_OR(a, b) _mm_or_ps(a, b)
#define GM_ANDNOT(a, b) _mm_andnot_ps(b, a)
#define GM_BITS(m) ((unsigned)_mm_movemask_ps(m))
#define GM_ANY(m) (_mm_movemask_ps(m) != 0)
#define GV_CLASS(a) _mm_and_ps(a, _mm_castsi128_ps(_mm_set1_epi32((int)GTAOI_CLASS_MASK)))
typedef __m128i GI;
#define GI_SET(x) _mm_set1_epi32((int)(x))
#define GI_OR(a, b) _mm_or_si128(a, b)
#define GI_AND(a, b) _mm_and_si128(a, b)
#define GI_ANDNOT(a, b) _mm_andnot_si128(b, a)
#define GI_ADD(a, b) _mm_add_epi32(a, b)
#define GI_IF(m, a) _mm_and_si128(_mm_castps_si128(m), a)
#define GI_SELECT(m, a, b) _mm_or_si128(_mm_and_si128(_mm_castps_si128(m), a), _mm_andnot_si128(_mm_castps_si128(m), b))
#define GI_IS_ZERO(a) _mm_castsi128_ps(_mm_cmpeq_epi32(a, _mm_setzero_si128()))
#define GI_FROM(f) GTAOI_NAME(gtaoi_sse2_from)(f)
#define GI_INDEX(a)                                                                                                    \
    _mm_sub_ps(                                                                                                        \
        _mm_cvtepi32_ps(_mm_and_si128(_mm_srli_epi32(_mm_castps_si128(_mm_cvtepi32_ps(a)), 23), _mm_set1_epi32(255))), \
        _mm_set1_ps(127.0f))
/* -2^i, by the exponent of a float: there is no shift by lanes. */
GTAOI_INLINE GTAOI_ATTRIBUTE __m128i GTAOI_NAME(gtaoi_sse2_from)(__m128 f) {
    __m128i power = _mm_slli_epi32(_mm_add_epi32(_mm_cvttps_epi32(f), _mm_set1_epi32(127 + 256)), 23);
    return _mm_and_si128(_mm_cvttps_epi32(_mm_castsi128_ps(power)),
                         _mm_castps_si128(_mm_cmplt_ps(f, _mm_set1_ps(32.0f))));
}

#elif GTAOI_W == 4
typedef float32x4_t GV;
typedef uint32x4_t GM;
#define GV_SET(x) vdupq_n_f32(x)
#define GV_LOAD(p) vld1q_f32(p)
#define GV_STORE(p, a) vst1q_f32(p, a)
#define GV_ADD(a, b) vaddq_f32(a, b)
#define GV_SUB(a, b) vsubq_f32(a, b)
#define GV_MUL(a, b) vmulq_f32(a, b)
#define GV_DIV(a, b) vdivq_f32(a, b)
#define GV_SQRT(a) vsqrtq_f32(a)
#define GV_MIN(a, b) vbslq_f32(vcltq_f32(a, b), a, b) /* vminq treats NaN and -0 differently */
#define GV_MAX(a, b) vbslq_f32(vcgtq_f32(a, b), a, b)
#define GV_ABS(a) vabsq_f32(a)
#define GV_LT(a, b) vcltq_f32(a, b)
#define GV_LE(a, b) vcleq_f32(a, b)
#define GV_EQ(a, b) vceqq_f32(a, b)
#define GV_IF(m, a) vreinterpretq_f32_u32(vandq_u32(m, vreinterpretq_u32_f32(a)))
#define GV_SELECT(m, a, b) vbslq_f32(m, a, b)
#define GV_MAX_IF(m, a, b) GV_MAX(a, GV_IF(m, b))
#define GM_AND(a, b) vandq_u32(a, b)
#define GM_OR(a, b) vorrq_u32(a, b)
#define GM_ANDNOT(a, b) vbicq_u32(a, b)
#define GM_BITS(m) GTAOI_NAME(gtaoi_neon_bits)(m)
#define GM_ANY(m) (vmaxvq_u32(m) != 0)
#define GV_CLASS(a) vreinterpretq_f32_u32(vandq_u32(vreinterpretq_u32_f32(a), vdupq_n_u32(GTAOI_CLASS_MASK)))
typedef uint32x4_t GI;
#define GI_SET(x) vdupq_n_u32(x)
#define GI_OR(a, b) vorrq_u32(a, b)
#define GI_AND(a, b) vandq_u32(a, b)
#define GI_ANDNOT(a, b) vbicq_u32(a, b)
#define GI_ADD(a, b) vaddq_u32(a, b)
#define GI_IF(m, a) vandq_u32(m, a)
#define GI_SELECT(m, a, b) vbslq_u32(m, a, b)
#define GI_IS_ZERO(a) vceqq_u32(a, vdupq_n_u32(0))
#define GI_FROM(f) vshlq_u32(vdupq_n_u32(0xffffffffu), vcvtq_s32_f32(f))
#define GI_INDEX(a)                                                                                                    \
    vsubq_f32(vcvtq_f32_u32(vandq_u32(vshrq_n_u32(vreinterpretq_u32_f32(vcvtq_f32_u32(a)), 23), vdupq_n_u32(255))),    \
              vdupq_n_f32(127.0f))
GTAOI_INLINE unsigned GTAOI_NAME(gtaoi_neon_bits)(uint32x4_t m) {
    static const uint32_t weight[4] = {1, 2, 4, 8};
    return vaddvq_u32(vandq_u32(m, vld1q_u32(weight)));
}

#elif GTAOI_W == 8
typedef __m256 GV;
typedef __m256 GM;
#define GV_SET(x) _mm256_set1_ps(x)
#define GV_LOAD(p) _mm256_loadu_ps(p)
#define GV_STORE(p, a) _mm256_storeu_ps(p, a)
#define GV_ADD(a, b) _mm256_add_ps(a, b)
#define GV_SUB(a, b) _mm256_sub_ps(a, b)
#define GV_MUL(a, b) _mm256_mul_ps(a, b)
#define GV_DIV(a, b) _mm256_div_ps(a, b)
#define GV_SQRT(a) _mm256_sqrt_ps(a)
#define GV_MIN(a, b) _mm256_min_ps(a, b)
#define GV_MAX(a, b) _mm256_max_ps(a, b)
#define GV_ABS(a) _mm256_andnot_ps(_mm256_set1_ps(-0.0f), a)
#define GV_LT(a, b) _mm256_cmp_ps(a, b, _CMP_LT_OQ)
#define GV_LE(a, b) _mm256_cmp_ps(a, b, _CMP_LE_OQ)
#define GV_EQ(a, b) _mm256_cmp_ps(a, b, _CMP_EQ_OQ)
#define GV_IF(m, a) _mm256_and_ps(m, a)
#define GV_SELECT(m, a, b) _mm256_blendv_ps(b, a, m)
#define GV_MAX_IF(m, a, b) GV_MAX(a, GV_IF(m, b))
#define GM_AND(a, b) _mm256_and_ps(a, b)
#define GM_OR(a, b) _mm256_or_ps(a, b)
#define GM_ANDNOT(a, b) _mm256_andnot_ps(b, a)
#define GM_BITS(m) ((unsigned)_mm256_movemask_ps(m))
#define GM_ANY(m) (_mm256_movemask_ps(m) != 0)
#define GV_CLASS(a) _mm256_and_ps(a, _mm256_castsi256_ps(_mm256_set1_epi32((int)GTAOI_CLASS_MASK)))
typedef __m256i GI;
#define GI_SET(x) _mm256_set1_epi32((int)(x))
#define GI_OR(a, b) _mm256_or_si256(a, b)
#define GI_AND(a, b) _mm256_and_si256(a, b)
#define GI_ANDNOT(a, b) _mm256_andnot_si256(b, a)
#define GI_ADD(a, b) _mm256_add_epi32(a, b)
#define GI_IF(m, a) _mm256_and_si256(_mm256_castps_si256(m), a)
#define GI_SELECT(m, a, b) _mm256_blendv_epi8(b, a, _mm256_castps_si256(m))
#define GI_IS_ZERO(a) _mm256_castsi256_ps(_mm256_cmpeq_epi32(a, _mm256_setzero_si256()))
#define GI_FROM(f) _mm256_sllv_epi32(_mm256_set1_epi32(-1), _mm256_cvttps_epi32(f))
#define GI_INDEX(a)                                                                                                    \
    _mm256_sub_ps(_mm256_cvtepi32_ps(_mm256_and_si256(                                                                 \
                      _mm256_srli_epi32(_mm256_castps_si256(_mm256_cvtepi32_ps(a)), 23), _mm256_set1_epi32(255))),     \
                  _mm256_set1_ps(127.0f))

#elif GTAOI_W == 16
typedef __m512 GV;
typedef __mmask16 GM;
#define GV_SET(x) _mm512_set1_ps(x)
#define GV_LOAD(p) _mm512_loadu_ps(p)
#define GV_STORE(p, a) _mm512_storeu_ps(p, a)
#define GV_ADD(a, b) _mm512_add_ps(a, b)
#define GV_SUB(a, b) _mm512_sub_ps(a, b)
#define GV_MUL(a, b) _mm512_mul_ps(a, b)
#define GV_DIV(a, b) _mm512_div_ps(a, b)
#define GV_SQRT(a) _mm512_sqrt_ps(a)
#define GV_MIN(a, b) _mm512_min_ps(a, b)
#define GV_MAX(a, b) _mm512_max_ps(a, b)
#define GV_ABS(a) _mm512_andnot_ps(_mm512_set1_ps(-0.0f), a)
#define GV_LT(a, b) _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ)
#define GV_LE(a, b) _mm512_cmp_ps_mask(a, b, _CMP_LE_OQ)
#define GV_EQ(a, b) _mm512_cmp_ps_mask(a, b, _CMP_EQ_OQ)
#define GV_IF(m, a) _mm512_maskz_mov_ps(m, a)
#define GV_SELECT(m, a, b) _mm512_mask_blend_ps(m, b, a)
#define GV_MAX_IF(m, a, b) _mm512_mask_max_ps(a, m, a, b)
#define GM_AND(a, b) ((__mmask16)((a) & (b)))
#define GM_OR(a, b) ((__mmask16)((a) | (b)))
#define GM_ANDNOT(a, b) ((__mmask16)((a) & ~(b)))
#define GM_BITS(m) ((unsigned)(m))
#define GM_ANY(m) ((m) != 0)
#define GV_CLASS(a) _mm512_and_ps(a, _mm512_castsi512_ps(_mm512_set1_epi32((int)GTAOI_CLASS_MASK)))
typedef __m512i GI;
#define GI_SET(x) _mm512_set1_epi32((int)(x))
#define GI_OR(a, b) _mm512_or_si512(a, b)
#define GI_AND(a, b) _mm512_and_si512(a, b)
#define GI_ANDNOT(a, b) _mm512_andnot_si512(b, a)
#define GI_ADD(a, b) _mm512_add_epi32(a, b)
#define GI_IF(m, a) _mm512_maskz_mov_epi32(m, a)
#define GI_SELECT(m, a, b) _mm512_mask_blend_epi32(m, b, a)
#define GI_IS_ZERO(a) _mm512_cmpeq_epi32_mask(a, _mm512_setzero_si512())
#define GI_FROM(f) _mm512_sllv_epi32(_mm512_set1_epi32(-1), _mm512_cvttps_epi32(f))
#define GI_INDEX(a)                                                                                                    \
    _mm512_sub_ps(_mm512_cvtepi32_ps(_mm512_and_si512(                                                                 \
                      _mm512_srli_epi32(_mm512_castps_si512(_mm512_cvtepi32_ps(a)), 23), _mm512_set1_epi32(255))),     \
                  _mm512_set1_ps(127.0f))
#endif

/* Four floats from each of the rows p, p + stride, ... into the lanes of four vectors, and back: between pixels in
 * image order and the lanes of four phases or components. */
#if GTAOI_W == 1
GTAOI_FI void GTAOI_NAME(gtaoi_load4)(const float *p, ptrdiff_t stride, GV out[4]) {
    (void)stride;
    out[0] = p[0], out[1] = p[1], out[2] = p[2], out[3] = p[3];
}
GTAOI_FI void GTAOI_NAME(gtaoi_store4)(float *p, ptrdiff_t stride, const GV in[4]) {
    (void)stride;
    p[0] = in[0], p[1] = in[1], p[2] = in[2], p[3] = in[3];
}
#else
#if GTAOI_W == 4 && GTAOI_X86
GTAOI_FI void GTAOI_NAME(gtaoi_transpose4)(GV r[4]) {
    _MM_TRANSPOSE4_PS(r[0], r[1], r[2], r[3]);
}
#define GTAOI_ROWS(p, stride) _mm_loadu_ps(p)
#define GTAOI_PUT_ROWS(p, stride, r) _mm_storeu_ps(p, r)
#elif GTAOI_W == 4
GTAOI_FI void GTAOI_NAME(gtaoi_transpose4)(GV r[4]) {
    float32x4_t ab0 = vtrn1q_f32(r[0], r[1]), ab1 = vtrn2q_f32(r[0], r[1]);
    float32x4_t cd0 = vtrn1q_f32(r[2], r[3]), cd1 = vtrn2q_f32(r[2], r[3]);
    r[0] = vcombine_f32(vget_low_f32(ab0), vget_low_f32(cd0)),
    r[1] = vcombine_f32(vget_low_f32(ab1), vget_low_f32(cd1));
    r[2] = vcombine_f32(vget_high_f32(ab0), vget_high_f32(cd0)),
    r[3] = vcombine_f32(vget_high_f32(ab1), vget_high_f32(cd1));
}
#define GTAOI_ROWS(p, stride) vld1q_f32(p)
#define GTAOI_PUT_ROWS(p, stride, r) vst1q_f32(p, r)
#elif GTAOI_W == 8
GTAOI_FI void GTAOI_NAME(gtaoi_transpose4)(GV r[4]) { /* in each half */
    GV ab0 = _mm256_unpacklo_ps(r[0], r[1]), ab1 = _mm256_unpackhi_ps(r[0], r[1]);
    GV cd0 = _mm256_unpacklo_ps(r[2], r[3]), cd1 = _mm256_unpackhi_ps(r[2], r[3]);
    r[0] = _mm256_shuffle_ps(ab0, cd0, 0x44), r[1] = _mm256_shuffle_ps(ab0, cd0, 0xee);
    r[2] = _mm256_shuffle_ps(ab1, cd1, 0x44), r[3] = _mm256_shuffle_ps(ab1, cd1, 0xee);
}
#define GTAOI_ROWS(p, stride)                                                                                          \
    _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(p)), _mm_loadu_ps((p) + 4 * (stride)), 1)
#define GTAOI_PUT_ROWS(p, stride, r)                                                                                   \
    (_mm_storeu_ps(p, _mm256_castps256_ps128(r)), _mm_storeu_ps((p) + 4 * (stride), _mm256_extractf128_ps(r, 1)))
#elif GTAOI_W == 16
GTAOI_FI void GTAOI_NAME(gtaoi_transpose4)(GV r[4]) { /* in each quarter */
    GV ab0 = _mm512_unpacklo_ps(r[0], r[1]), ab1 = _mm512_unpackhi_ps(r[0], r[1]);
    GV cd0 = _mm512_unpacklo_ps(r[2], r[3]), cd1 = _mm512_unpackhi_ps(r[2], r[3]);
    r[0] = _mm512_shuffle_ps(ab0, cd0, 0x44), r[1] = _mm512_shuffle_ps(ab0, cd0, 0xee);
    r[2] = _mm512_shuffle_ps(ab1, cd1, 0x44), r[3] = _mm512_shuffle_ps(ab1, cd1, 0xee);
}
#define GTAOI_ROWS(p, stride)                                                                                          \
    _mm512_insertf32x4(_mm512_insertf32x4(_mm512_insertf32x4(_mm512_castps128_ps512(_mm_loadu_ps(p)),                  \
                                                             _mm_loadu_ps((p) + 4 * (stride)), 1),                     \
                                          _mm_loadu_ps((p) + 8 * (stride)), 2),                                        \
                       _mm_loadu_ps((p) + 12 * (stride)), 3)
#define GTAOI_PUT_ROWS(p, stride, r)                                                                                   \
    (_mm_storeu_ps(p, _mm512_castps512_ps128(r)), _mm_storeu_ps((p) + 4 * (stride), _mm512_extractf32x4_ps(r, 1)),     \
     _mm_storeu_ps((p) + 8 * (stride), _mm512_extractf32x4_ps(r, 2)),                                                  \
     _mm_storeu_ps((p) + 12 * (stride), _mm512_extractf32x4_ps(r, 3)))
#endif
GTAOI_FI void GTAOI_NAME(gtaoi_load4)(const float *p, ptrdiff_t stride, GV out[4]) {
    int i;
    GTAOI_UNROLL
    for (i = 0; i < 4; i++, p += stride)
        out[i] = GTAOI_ROWS(p, stride);
    GTAOI_NAME(gtaoi_transpose4)(out);
}
GTAOI_FI void GTAOI_NAME(gtaoi_store4)(float *p, ptrdiff_t stride, const GV in[4]) {
    GV r[4];
    int i;
    GTAOI_UNROLL
    for (i = 0; i < 4; i++)
        r[i] = in[i];
    GTAOI_NAME(gtaoi_transpose4)(r);
    GTAOI_UNROLL
    for (i = 0; i < 4; i++, p += stride)
        GTAOI_PUT_ROWS(p, stride, r[i]);
}
#undef GTAOI_ROWS
#undef GTAOI_PUT_ROWS
#endif

/* Pixels of even and of odd columns, and back. */
GTAOI_FI void GTAOI_NAME(gtaoi_load2)(const float *p, GV *even, GV *odd) {
#if GTAOI_W == 1
    *even = p[0], *odd = p[1];
#elif GTAOI_W == 4 && GTAOI_X86
    GV a = GV_LOAD(p), b = GV_LOAD(p + 4);
    *even = _mm_shuffle_ps(a, b, 0x88), *odd = _mm_shuffle_ps(a, b, 0xdd);
#elif GTAOI_W == 4
    float32x4x2_t r = vld2q_f32(p);
    *even = r.val[0], *odd = r.val[1];
#elif GTAOI_W == 8
    GV a = _mm256_permute2f128_ps(GV_LOAD(p), GV_LOAD(p + 8), 0x20);
    GV b = _mm256_permute2f128_ps(GV_LOAD(p), GV_LOAD(p + 8), 0x31);
    *even = _mm256_shuffle_ps(a, b, 0x88), *odd = _mm256_shuffle_ps(a, b, 0xdd);
#else
    const __m512i e = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
    *even = _mm512_permutex2var_ps(GV_LOAD(p), e, GV_LOAD(p + 16));
    *odd = _mm512_permutex2var_ps(GV_LOAD(p), _mm512_add_epi32(e, _mm512_set1_epi32(1)), GV_LOAD(p + 16));
#endif
}
GTAOI_FI void GTAOI_NAME(gtaoi_store2)(float *p, GV even, GV odd) {
#if GTAOI_W == 1
    p[0] = even, p[1] = odd;
#elif GTAOI_W == 4 && GTAOI_X86
    GV_STORE(p, _mm_unpacklo_ps(even, odd));
    GV_STORE(p + 4, _mm_unpackhi_ps(even, odd));
#elif GTAOI_W == 4
    float32x4x2_t r;
    r.val[0] = even, r.val[1] = odd;
    vst2q_f32(p, r);
#elif GTAOI_W == 8
    GV lo = _mm256_unpacklo_ps(even, odd), hi = _mm256_unpackhi_ps(even, odd);
    GV_STORE(p, _mm256_permute2f128_ps(lo, hi, 0x20));
    GV_STORE(p + 8, _mm256_permute2f128_ps(lo, hi, 0x31));
#else
    const __m512i e = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
    GV_STORE(p, _mm512_permutex2var_ps(even, e, odd));
    GV_STORE(p + 16, _mm512_permutex2var_ps(even, _mm512_add_epi32(e, _mm512_set1_epi32(8)), odd));
#endif
}

/* Lane indices. */

GTAOI_FI GV GTAOI_NAME(gtaoi_iota)(void) {
    static const float lanes[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
    return GV_LOAD(lanes);
}

/* Nearest whole number, ties to even, |a| < 2^22; the largest whole number not above. */
GTAOI_FI GV GTAOI_NAME(gtaoi_nearest)(GV a) {
    return GV_SUB(GV_ADD(a, GV_SET(12582912.0f)), GV_SET(12582912.0f));
}
GTAOI_FI GV GTAOI_NAME(gtaoi_floor)(GV a) {
    GV r = GTAOI_NAME(gtaoi_nearest)(a);
    return GV_SUB(r, GV_IF(GV_LT(a, r), GV_SET(1.0f)));
}

#ifdef GTAOI_KERNELS /* the operations above serve another header's kernels: gtso.h */
#include GTAOI_KERNELS
#else

/* ---- prepare: depth to height ----------------------------------------------------------------------------------- */

/* The caller's depth of column x to height; ry2 = 1 + ry^2 of the row. */
GTAOI_FI GV GTAOI_NAME(gtaoi_height)(const gtao_context *c, GV z, GV x, float ry2) {
    GTAOI_NO_CONTRACT
    const GV zero = GV_SET(0.0f);
    GV height;
    GM visible;
    if (c->d.depth_kind == GTAO_DEPTH_DEVICE) { /* any bounded d; w_far is the far plane */
        height = GV_ADD(GV_MUL(z, GV_SET(c->w_scale)), GV_SET(c->w_bias));
        visible = GM_AND(GV_LT(GV_SET(c->w_far), height), GV_LT(height, GV_SET(FLT_MAX)));
    } else if (c->orthographic) {
        height = GV_MUL(z, GV_SET(c->w_scale));
        visible = GV_LT(GV_ABS(z), GV_SET((float)HUGE_VAL));
        if (c->d.depth_kind != GTAO_DEPTH_HEIGHT)
            visible = GM_AND(GM_AND(visible, GV_LT(zero, z)), GV_LT(z, GV_SET(c->z_sky)));
    } else {
        GV numerator = GV_SET(c->w_numerator);
        visible = GM_AND(GV_LT(zero, z), GV_LT(z, GV_SET(c->z_sky)));
        if (c->d.depth_kind == GTAO_DEPTH_DISTANCE) { /* z = distance / |r| */
            GV rx = GV_MUL(GV_SUB(GV_ADD(x, GV_SET(0.5f)), GV_SET(c->cx)), GV_SET(c->bx1));
            numerator = GV_MUL(numerator, GV_SQRT(GV_ADD(GV_MUL(rx, rx), GV_SET(ry2))));
        }
        height = GV_DIV(numerator, z);
    }
    if (c->orthographic) {
        height = GV_MAX(GV_MIN(height, GV_SET(GTAOI_ORTHO_LIMIT)), GV_SET(-GTAOI_ORTHO_LIMIT));
    } else {
        visible = GM_AND(visible, GV_LT(GV_SET(GTAOI_W_MIN), height));
        height = GV_MIN(height, GV_SET(c->w_max));
    }
    return GV_SELECT(visible, height, GV_SET(GTAOI_SKY));
}

GTAOI_FN void GTAOI_NAME(gtaoi_heights)(const gtao_context *c, const float *image, ptrdiff_t stride, float *plane,
                                        int y0, int y1) {
    GTAOI_NO_CONTRACT
    int x, y, i, p, w = c->d.width;
    for (y = y0; y < y1; y++) {
        const float *depth = (const float *)(const void *)((const char *)image + (ptrdiff_t)y * stride);
        float *row = plane + (ptrdiff_t)y * c->pitch;
        float ry2 = gtaoi_ry2(c, y);
        for (x = 0; x < w; x += GTAOI_CHUNK) {
            float in[GTAOI_CHUNK], out[GTAOI_CHUNK];
            const float *from = depth + x;
            int n = gtaoi_imin(w - x, GTAOI_CHUNK);
            if (n < GTAOI_CHUNK) { /* not past the end of the caller's row */
                for (i = 0; i < GTAOI_CHUNK; i++)
                    in[i] = i < n ? depth[x + i] : 0.0f;
                from = in;
            }
            for (i = 0; i < GTAOI_CHUNK; i += GTAOI_W) {
                GV column = GV_ADD(GV_SET((float)(x + i)), GTAOI_NAME(gtaoi_iota)());
                GV_STORE(out + i, GTAOI_NAME(gtaoi_height)(c, GV_LOAD(from + i), column, ry2));
            }
            if (c->period == 1) {
                memcpy(row + GTAOI_PAD + x, out, (size_t)n * sizeof(float));
            } else {
                float *to = row + GTAOI_PAD + x / 4;
                for (i = 0; i < GTAOI_CHUNK / 4;
                     i += GTAOI_W) { /* what lies past the row's end is padding, filled below */
                    GV phases[4];
                    GTAOI_NAME(gtaoi_load4)(out + 4 * i, 4, phases);
                    GTAOI_UNROLL
                    for (p = 0; p < 4; p++)
                        GV_STORE(to + (ptrdiff_t)p * c->segment + i, phases[p]);
                }
            }
        }
        gtaoi_border_rows(c, plane, y);
    }
}

/* Backs of a layer: those given, no nearer than the front, or what the thickness says. With T along the view ray and z
 * along the axis, w' = 1 / (1 / w + T / |r|); orthographic w' = w - T. Endless: as if it were sky. */
GTAOI_FN void GTAOI_NAME(gtaoi_backs)(const gtao_context *c, int k, int y0, int y1) {
    GTAOI_NO_CONTRACT
    const gtao_desc *d = &c->d;
    const GV sky = GV_SET(GTAOI_SKY), zero = GV_SET(0.0f), one = GV_SET(1.0f), endless = GV_SET(1e30f);
    const float *map = k == 0 ? d->thickness_map : 0;
    float *front = c->w + 2 * k * c->plane, *back = front + c->plane, lanes[GTAOI_W];
    int y, p, i, j;
    if (c->layer[k].back)
        GTAOI_NAME(gtaoi_heights)(c, c->layer[k].back, c->layer[k].back_stride, back, y0, y1);
    for (y = y0; y < y1; y++) {
        const float *row =
            map ? (const float *)(const void *)((const char *)map + (ptrdiff_t)y * d->thickness_stride) : 0;
        float ry2 = gtaoi_ry2(c, y);
        for (p = 0; p < c->period; p++) {
            ptrdiff_t at = (ptrdiff_t)y * c->pitch + (ptrdiff_t)p * c->segment + GTAOI_PAD;
            for (i = 0; i * c->period + p < d->width; i += GTAOI_W, at += GTAOI_W) {
                GV w = GV_LOAD(front + at), t = GV_SET(c->thickness), assumed;
                GM solid = GV_LT(GV_SET(GTAOI_SKY_LIMIT), w);
                if (row) {
                    GV own;
                    for (j = 0; j < GTAOI_W; j++)
                        lanes[j] = row[gtaoi_imin((i + j) * c->period + p, d->width - 1)];
                    own = GV_LOAD(lanes);
                    t = GV_SELECT(GV_LT(zero, own),
                                  GV_SELECT(GV_LT(own, endless), GV_MUL(own, GV_SET(c->per_unit)), own), t);
                }
                if (c->orthographic) {
                    assumed = GV_SUB(w, t);
                } else {
                    GV rx = GV_ADD(GTAOI_NAME(gtaoi_iota)(), GV_SET((float)i));
                    rx = GV_ADD(GV_MUL(rx, GV_SET((float)c->period)), GV_SET((float)p + 0.5f));
                    rx = GV_MUL(GV_SUB(rx, GV_SET(c->cx)), GV_SET(c->bx1));
                    rx = GV_MAX(GV_MIN(rx, GV_SET(GTAOI_RAY_LIMIT)), GV_SET(-GTAOI_RAY_LIMIT));
                    rx = GV_SQRT(GV_ADD(GV_MUL(rx, rx), GV_SET(ry2)));
                    assumed = GV_DIV(w, GV_ADD(one, GV_DIV(GV_MUL(t, w), rx)));
                }
                assumed = GV_SELECT(GV_LT(t, endless), GV_MAX(assumed, sky), sky);
                if (c->layer[k].back) {
                    GV given = GV_LOAD(back + at);
                    assumed = GV_SELECT(GV_LT(GV_SET(GTAOI_SKY_LIMIT), given), GV_MIN(given, w), assumed);
                }
                GV_STORE(back + at, GV_SELECT(solid, assumed, sky));
            }
        }
        gtaoi_border_rows(c, back, y);
    }
}

/* Four heights as one. `same`: within so much of each other they are one surface, whose mean lies in the middle. */
GTAOI_FI GV GTAOI_NAME(gtaoi_four)(const gtao_context *c, const GV w[4], float same) {
    GTAOI_NO_CONTRACT
    const GV limit = GV_SET(GTAOI_SKY_LIMIT), zero = GV_SET(0.0f), one = GV_SET(1.0f), sky = GV_SET(GTAOI_SKY);
    GV nearest = GV_MAX(GV_MAX(w[0], w[1]), GV_MAX(w[2], w[3])), farthest = GV_SET(FLT_MAX), per, sum = zero;
    GV total = zero, mean = GV_MUL(GV_SET(0.25f), GV_ADD(GV_ADD(w[0], w[1]), GV_ADD(w[2], w[3])));
    GM solid = GV_LT(limit, nearest), smooth;
    int i;
    for (i = 0; i < 4; i++)
        farthest = GV_MIN(farthest, w[i]);
    smooth = GV_LE(GV_SUB(nearest, farthest), GV_MUL(c->orthographic ? one : nearest, GV_SET(same)));
    if (c->d.far_depth == GTAO_FAR_NEAREST)
        return GV_SELECT(solid, GV_SELECT(smooth, mean, nearest), sky);
    /* XeGTAO's weights: full at the farthest, none beyond 3/4 of the radius before it; 1/a - 1/b as (b - a) / a^2 */
    for (farthest = GV_SET(FLT_MAX), i = 0; i < 4; i++)
        farthest = GV_MIN(farthest, GV_SELECT(GV_LT(limit, w[i]), w[i], farthest));
    per = GV_DIV(GV_SET(1.0f / (0.615f * 0.75f)), GV_SET(gtaoi_max(c->reach, 1e-18f)));
    if (!c->orthographic)
        per = GV_DIV(per, GV_MUL(farthest, farthest));
    for (i = 0; i < 4; i++) {
        GV above = GV_SUB(w[i], farthest);
        GV weight = GV_MIN(GV_MAX(GV_SUB(GV_SET(1.0f / 0.615f), GV_MUL(above, per)), zero), one);
        weight = GV_IF(GV_LT(limit, w[i]), weight);
        total = GV_ADD(total, weight), sum = GV_ADD(sum, GV_IF(GV_LT(zero, weight), GV_MUL(weight, above)));
    }
    return GV_SELECT(solid, GV_SELECT(smooth, mean, GV_ADD(farthest, GV_DIV(sum, total))), sky);
}

GTAOI_FN void GTAOI_NAME(gtaoi_height_row)(const gtao_context *c, int x, int y, int n, float *out);

/* The blocks of 4x4 pixels that begin in rows [y0, y1), whose heights are there; those of the rows below may not be
 * yet. What the border leaves of a block holds nothing. */
GTAOI_FN void GTAOI_NAME(gtaoi_blocks)(const gtao_context *c, int y0, int y1) {
    const int per_row = c->d.width / 4;
    int y, b, i, k;
    for (y = (y0 + 3) & ~3; y < y1; y += 4) {
        float *to = c->far_w + y / 4 * c->far_pitch + GTAOI_PAD;
        gtaoi_fill_sky(to - GTAOI_PAD, c->far_pitch);
        for (b = 0; y + 3 < c->d.height && b < per_row; b += GTAOI_W) {
            GV w[4][4], four[4], column; /* [row][column] */
            for (k = 0; k < 4; k++) {
                const float *row = c->w + (y + k) * c->pitch + GTAOI_PAD + b;
                float own[4 * GTAOI_W];
                if (y + k >= y1) {
                    GTAOI_NAME(gtaoi_height_row)(c, 4 * b, y + k, 4 * GTAOI_W, own);
                    GTAOI_NAME(gtaoi_load4)(own, 4, w[k]);
                }
                for (i = 0; i < 4 && y + k < y1; i++)
                    w[k][i] = GV_LOAD(row + i * c->segment);
            }
            for (i = 0; i < 4; i++) {
                const GV *above = &w[i & 2][2 * (i & 1)], *below = &w[(i & 2) + 1][2 * (i & 1)];
                GV quad[4];
                quad[0] = above[0], quad[1] = above[1], quad[2] = below[0], quad[3] = below[1];
                four[i] = GTAOI_NAME(gtaoi_four)(c, quad, c->same_surface);
            }
            four[0] = GTAOI_NAME(gtaoi_four)(c, four, 2.0f * c->same_surface);
            column = GV_ADD(GV_SET((float)b), GTAOI_NAME(gtaoi_iota)());
            GV_STORE(to + b, GV_SELECT(GV_LT(column, GV_SET((float)per_row)), four[0], GV_SET(GTAOI_SKY)));
        }
    }
}

/* The bounds of one phase's pixels of cells above planes, w - w0 - (g.y) - (g.x); `mixed`: of those that are not sky. */
GTAOI_FI void GTAOI_NAME(gtaoi_cell_bounds)(const float *at, ptrdiff_t pitch, int rows, const GV lines[GTAOI_CELL],
                                            GV base, GV column, int mixed, GV *least, GV *most) {
    GTAOI_NO_CONTRACT
    const GV limit = GV_SET(GTAOI_SKY_LIMIT), none = GV_SET(-GTAOI_CELL_NONE);
    GV low = none, high = GV_SET(GTAOI_CELL_NONE);
    int r;
    for (r = 0; r < rows; r++, at += pitch) {
        GV w = GV_LOAD(at), d = GV_SUB(GV_SUB(w, base), lines[r]);
        if (mixed) {
            GM solid = GV_LT(limit, w);
            high = GV_MAX(high, GV_SELECT(solid, d, GV_SET(GTAOI_CELL_NONE)));
            d = GV_SELECT(solid, d, none);
        } else {
            high = GV_MAX(high, d);
        }
        low = GV_MIN(low, d);
    }
    *least = GV_MIN(*least, GV_SUB(low, column));
    *most = GV_MAX(*most, GV_SUB(high, column));
}

/* A row of cells. Vectors run over pixels of one phase, whose lanes are joined at the end: the same sums whatever the
 * width. Cells that are all there have the plane of least squares, others one through four of their pixels. */
GTAOI_FN void GTAOI_NAME(gtaoi_cells)(const gtao_context *c, int cy) {
    GTAOI_NO_CONTRACT
    enum { WIDE = 4 * GTAOI_CELL };
    const float half = 0.5f * (float)(GTAOI_CELL - 1);
    int period4 = c->period == 4, lanes = period4 ? WIDE / 4 : WIDE, per = lanes / 4, phases = period4 ? 4 : 1;
    int rows = gtaoi_imin(GTAOI_CELL, c->d.height - cy * GTAOI_CELL), x, i, k, p, r;
    float across[WIDE], count = (float)rows, middle = 0.5f * (count - 1.0f);
    for (k = 0; k < 4; k++)
        for (i = 0; i < per; i++)
            across[k * per + i] = (float)(i * phases) - half;
    for (x = 0; x < c->d.width; x += WIDE) {
        float w0[WIDE], lowest[WIDE], highest[WIDE], along_x[WIDE], along_y[WIDE], gx[WIDE], gy[WIDE], up[WIDE],
            down[WIDE];
        const float *at = c->w + (ptrdiff_t)cy * GTAOI_CELL * c->pitch + GTAOI_PAD + x / c->period;
        int cells = (gtaoi_imin(WIDE, c->d.width - x) + GTAOI_CELL - 1) / GTAOI_CELL, mixed = 0;
        if (c->arcs && c->layer_count > 1) {
            for (k = 0; k < cells; k++)
                gtaoi_cell_rest(c, x / GTAOI_CELL + k, cy);
            continue;
        }
        for (k = 0; k < 4; k++)
            for (i = k * per; i < (k + 1) * per; i++)
                w0[i] = k < cells ? at[k * per] : 0.0f;
        for (i = 0; i < cells * per; i += GTAOI_W) {
            GV base = GV_LOAD(w0 + i), least = GV_SET(FLT_MAX), most = GV_SET(-FLT_MAX);
            GV zero = GV_SET(0.0f), sum_x = zero, sum_y = zero;
            for (r = 0; r < rows; r++) {
                GV row = zero;
                for (p = 0; p < phases; p++) {
                    GV w = GV_LOAD(at + r * c->pitch + p * c->segment + i), d = GV_SUB(w, base);
                    least = GV_MIN(least, w), most = GV_MAX(most, w);
                    sum_x = GV_ADD(sum_x, GV_MUL(d, GV_ADD(GV_LOAD(across + i), GV_SET((float)p))));
                    row = GV_ADD(row, d);
                }
                sum_y = GV_ADD(sum_y, GV_MUL(row, GV_SET((float)r - middle)));
            }
            GV_STORE(lowest + i, least), GV_STORE(highest + i, most);
            GV_STORE(along_x + i, sum_x), GV_STORE(along_y + i, sum_y);
        }
        for (k = 0; k < cells; k++) { /* least squares: sum e^2 = 340 in each row, n (n^2 - 1) / 12 in a column */
            float a = 0.0f, b = 0.0f;
            int solid = rows >= 2;
            for (i = k * per; i < (k + 1) * per; i++)
                solid &= lowest[i] > GTAOI_SKY_LIMIT, a += along_x[i], b += along_y[i];
            for (i = k * per; solid && i < (k + 1) * per; i++)
                gx[i] = a / (340.0f * count), gy[i] = b * 0.75f / (count * (count * count - 1.0f));
            if (!solid)
                gtaoi_cell_plane(c, at, rows, per, k, w0, gx, gy), mixed = 1;
        }
        for (i = cells * per; i < lanes; i++)
            gx[i] = gy[i] = 0.0f;
        for (i = 0; i < cells * per; i += GTAOI_W) {
            GV base = GV_LOAD(w0 + i), g = GV_LOAD(gx + i), h = GV_LOAD(gy + i), lines[GTAOI_CELL];
            GV least = GV_SET(-GTAOI_CELL_NONE), most = GV_SET(GTAOI_CELL_NONE);
            for (r = 0; r < rows; r++)
                lines[r] = GV_MUL(h, GV_SET((float)r - half));
            for (p = 0; p < phases; p++) {
                GV column = GV_MUL(g, GV_ADD(GV_LOAD(across + i), GV_SET((float)p)));
                const float *phase = at + p * c->segment + i;
                if (mixed)
                    GTAOI_NAME(gtaoi_cell_bounds)(phase, c->pitch, rows, lines, base, column, 1, &least, &most);
                else
                    GTAOI_NAME(gtaoi_cell_bounds)(phase, c->pitch, rows, lines, base, column, 0, &least, &most);
            }
            GV_STORE(down + i, least), GV_STORE(up + i, most);
        }
        for (k = 0; k < cells; k++) {
            ptrdiff_t to = cy * c->cell_pitch + x / GTAOI_CELL + k;
            i = k * per;
            for (r = i + 1; r < i + per; r++) {
                up[i] = gtaoi_max(up[i], up[r]), down[i] = gtaoi_min(down[i], down[r]);
                highest[i] = gtaoi_max(highest[i], highest[r]), lowest[i] = gtaoi_min(lowest[i], lowest[r]);
            }
            if (up[i] > GTAOI_SKY_LIMIT)
                gtaoi_keep_cell(c, to, w0[i], gx[i], gy[i], up[i], down[i], highest[i], lowest[i]);
            else
                gtaoi_keep_cell(c, to, 0.0f, 0.0f, 0.0f, GTAOI_CELL_NONE, -GTAOI_CELL_NONE, GTAOI_CELL_NONE, GTAOI_SKY);
        }
    }
}

/* In strips of cells, while their rows are in the cache. */
GTAOI_FN void GTAOI_NAME(gtaoi_prepare)(const gtao_context *c, int y0, int y1) {
    int k, y, end;
    for (y = y0; y < y1; y = end) {
        end = gtaoi_imin((y / GTAOI_CELL + 1) * GTAOI_CELL, y1);
        GTAOI_NAME(gtaoi_heights)(c, c->d.depth, c->d.depth_stride, c->w, y, end);
        for (k = 0; c->arcs && k < c->layer_count; k++) {
            if (k > 0)
                GTAOI_NAME(gtaoi_heights)
            (c, c->layer[k].depth, c->layer[k].depth_stride, c->w + 2 * k * c->plane, y, end);
            GTAOI_NAME(gtaoi_backs)(c, k, y, end);
        }
        if (c->skips && y % GTAOI_CELL == 0 && (end % GTAOI_CELL == 0 || end == c->d.height))
            GTAOI_NAME(gtaoi_cells)(c, y / GTAOI_CELL);
    }
    if (c->d.far_depth)
        GTAOI_NAME(gtaoi_blocks)(c, y0, y1);
    for (y = y0; c->skips && y < y1; y++)
        c->prepared[y] = (uint32_t)y0 << 16 | (uint32_t)y1;
}

/* ---- one group of pixels ---------------------------------------------------------------------------------------- */

/* r0 is the ray through the pixel, v = -r0 / |r0| the view vector; orthographic: r0 = (0, 0, 1), w0 = 1 in formulas. */
typedef struct GTAOI_PIXEL {
    GV w0;           /* height in the buffer */
    GV rx, ry;       /* r0 = (rx, ry, 1) */
    GV len, inv_len; /* |r0| */
    GV inv_w0;
    GV nx, ny, nz;        /* unit normal, n.v > 0 */
    GV nv, inv_nv;        /* n.v */
    GV gx, gy;            /* gradient of w on the tangent plane, per pixel */
    GV x, y;              /* pixel coordinates */
    GV extent;            /* of the radius, on the plane z = 1 (orthographic: in pixels) */
    GV key;               /* its class: the extent with its mantissa cut */
    GV direction, offset; /* per-pixel noise */
} GTAOI_PIXEL;

/* A slice as its pixels see it. The direction is the same for all lanes or not. */
typedef struct GTAOI_FRAME {
    GV dx, dy;        /* unit screen direction */
    GV bx, by;        /* the same in units of r */
    GV bb;            /* |b|^2 */
    GV along;         /* b.r0 / |r0| */
    GV inv_perp;      /* 1 / |b_perp| */
    GV no;            /* n.o, o = b_perp / |b_perp| */
    GV kappa_scale;   /* |r0| / (w0 |b_perp|): height per pixel to cot h */
    GV kappa_tangent; /* cot of the tangent plane's horizon on the + side: -tan n; the - side's is its negative */
    GV reach;         /* radius / |b_perp|: t^2 (1 + cot^2 h) <= (reach w)^2 lies within the radius */
    GV cos_tangent;   /* cosine of the tangent plane's horizon on the + side: -sin n; the - side's is its negative */
    GV floor;         /* rises below do not count, rise_min in cot h */
    GV n, open;       /* angle n, and the integral over the open slice: |np| (cos n + n sin n), uniform: 2 */
} GTAOI_FRAME;

/* What the search of a slice finds, on its + and - side. */
typedef struct GTAOI_HORIZONS {
    GV rise[2];   /* largest slope above the tangent plane of full-weight samples, height per pixel */
    GV cosine[2]; /* largest attenuated cosine of samples in the falloff ring */
} GTAOI_HORIZONS;

/* A sample relative to the receiver. */
typedef struct GTAOI_SAMPLE {
    GV kappa; /* cot h */
    GV rho;   /* 1 + kappa^2 */
    GV reach; /* (distance / radius)^2 = rho / reach^2 */
} GTAOI_SAMPLE;

/* One sample of height w at distance 1 / inv, `rise` above the tangent plane, which tells how far it is; it occludes up
 * to `least`, which is the same but on hollow surfaces. Returns the pixels for
 * which it lies in the falloff ring and above what has been found. */
GTAOI_FI GM GTAOI_NAME(gtaoi_rise)(const gtao_context *c, const GTAOI_FRAME *f, GTAOI_HORIZONS *s, int side, GV w,
                                   GV inv, GV rise, GV least, GTAOI_SAMPLE *sample, int orthographic, int bounded,
                                   int ring, int taps) {
    GTAOI_NO_CONTRACT
    GV slope = GV_MUL(w, inv), tangent, reach2;
    GM inside = GV_LT(inv, inv);
    if (!bounded) {
        s->rise[side] = GV_MAX(s->rise[side], least);
        sample->kappa = sample->rho = sample->reach = rise; /* not looked at */
        return inside;                                      /* none */
    }
    /* distance^2 = t^2 |b_perp|^2 (1 + kappa^2) / w^2 = (radius / reach)^2 rho, reach = radius w / (t |b_perp|) */
    tangent = side ? GV_SUB(GV_SET(0.0f), f->kappa_tangent) : f->kappa_tangent;
    sample->kappa = GV_ADD(GV_MUL(rise, f->kappa_scale), tangent);
    sample->rho = GV_ADD(GV_MUL(sample->kappa, sample->kappa), GV_SET(1.0f));
    sample->reach = GV_MUL(orthographic ? inv : slope, f->reach);
    reach2 = GV_MUL(sample->reach, sample->reach);
    inside = GV_LE(sample->rho, ring ? GV_MUL(reach2, GV_SET(c->inner2)) : reach2);
    s->rise[side] = GV_MAX_IF(inside, s->rise[side], least);
    if (!ring)
        return inside;
    if (!taps)
        return GM_AND(GV_LT(sample->rho, reach2), GV_LT(s->rise[side], rise)); /* not inside: those do not rise above */
    return GM_ANDNOT(GM_AND(GV_LT(sample->rho, reach2), GV_LT(s->rise[side], least)), inside);
}

/* The attenuated cosine of a sample in the ring: distance / radius = rho / (sqrt(rho) reach), cos h = kappa /
 * sqrt(rho). */
GTAOI_FI GV GTAOI_NAME(gtaoi_faded)(const gtao_context *c, const GTAOI_SAMPLE *sample, GV start) {
    GTAOI_NO_CONTRACT
    GV both = GV_DIV(GV_SET(1.0f), GV_MUL(GV_SQRT(sample->rho), sample->reach));
    GV weight = GV_MUL(GV_SUB(GV_SET(1.0f), GV_MUL(sample->rho, both)), GV_SET(c->inv_falloff));
    GV cosine = GV_MUL(sample->kappa, GV_MUL(sample->reach, both));
    return GV_ADD(start, GV_MUL(weight, GV_SUB(cosine, start)));
}
GTAOI_FI void GTAOI_NAME(gtaoi_fade)(const gtao_context *c, const GTAOI_FRAME *f, GTAOI_HORIZONS *s, int side,
                                     const GTAOI_SAMPLE *sample, GM fading) {
    GTAOI_NO_CONTRACT
    GV start = side ? GV_SUB(GV_SET(0.0f), f->cos_tangent) : f->cos_tangent;
    GV faded = GTAOI_NAME(gtaoi_faded)(c, sample, start);
    s->cosine[side] = GV_MAX(s->cosine[side], GV_SELECT(fading, faded, s->cosine[side]));
}

/* Height of a sample between two pixels: linear within one surface; across an edge the nearer pixel, moved onto the
 * slice's line along the receiver's tangent plane (g_across: its gradient from a to b). */
GTAOI_FI GV GTAOI_NAME(gtaoi_between)(const gtao_context *c, GV a, GV b, GV fraction, GV g_across, int orthographic) {
    GTAOI_NO_CONTRACT
    GV step = GV_SUB(b, a), limit = GV_SET(c->same_surface), nearest;
    GM near_a = GV_LT(fraction, GV_SET(0.5f));
    nearest = GV_ADD(GV_SELECT(near_a, a, b),
                     GV_MUL(GV_SUB(fraction, GV_SELECT(near_a, GV_SET(0.0f), GV_SET(1.0f))), g_across));
    if (!orthographic)
        limit = GV_MUL(limit, GV_MIN(GV_ABS(a), GV_ABS(b)));
    return GV_SELECT(GV_LE(GV_ABS(step), limit), GV_ADD(a, GV_MUL(fraction, step)), nearest);
}

/* A sample of the table on one side: rise above the tangent plane, height per pixel, and the height itself. */
GTAOI_FI GV GTAOI_NAME(gtaoi_take)(const gtao_context *c, const GTAOI_PIXEL *p, int side, const float *at,
                                   const gtaoi_sample *q, const gtaoi_taps *near_taps, GV inv, GV base, GV tangent,
                                   GV across, GV *w, GV *least, int orthographic, int taps) {
    GTAOI_NO_CONTRACT
    GV a = GV_LOAD(at + q->offset[side]), b, rise, rise_a, rise_b;
    base = side ? GV_SUB(base, tangent) : GV_ADD(base, tangent);
    *w = a;
    if (!taps)
        return *least = GV_SUB(GV_MUL(a, inv), base);
    b = GV_LOAD(at + q->offset[side + 2]);
    if (side)
        across = GV_SUB(GV_SET(0.0f), across);
    *w = GTAOI_NAME(gtaoi_between)(c, a, b, GV_SET(q->ux), across, orthographic);
    rise = *least = GV_SUB(GV_MUL(*w, inv), base);
    if (!near_taps)
        return rise;
    /* A straight line between the taps lies above a hollow surface: no higher than either tap in its own direction. */
    tangent = GV_ADD(GV_MUL(p->gx, GV_SET(near_taps->ux[0])), GV_MUL(p->gy, GV_SET(near_taps->uy[0])));
    if (side)
        tangent = GV_SUB(GV_SET(0.0f), tangent);
    rise_a = GV_SUB(GV_MUL(GV_SUB(a, p->w0), GV_SET(near_taps->inv_length[0])), tangent);
    tangent = GV_ADD(GV_MUL(p->gx, GV_SET(near_taps->ux[1])), GV_MUL(p->gy, GV_SET(near_taps->uy[1])));
    if (side)
        tangent = GV_SUB(GV_SET(0.0f), tangent);
    rise_b = GV_SUB(GV_MUL(GV_SUB(b, p->w0), GV_SET(near_taps->inv_length[1])), tangent);
    *least = GV_MIN(rise, GV_MAX(rise_a, rise_b));
    return rise;
}

/* A sample of one tap on one side. */
GTAOI_FI GM GTAOI_NAME(gtaoi_visit)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                    GTAOI_HORIZONS *s, int side, const float *at, const gtaoi_sample *q,
                                    GTAOI_SAMPLE *sample, int orthographic, int bounded, int ring) {
    GTAOI_NO_CONTRACT
    GV inv = GV_SET(q->inv_length), w, least;
    GV tangent = GV_ADD(GV_MUL(p->gx, GV_SET(q->ux)), GV_MUL(p->gy, GV_SET(q->uy)));
    GV rise = GTAOI_NAME(gtaoi_take)(c, p, side, at, q, 0, inv, GV_MUL(p->w0, inv), tangent, tangent, &w, &least,
                                     orthographic, 0);
    return GTAOI_NAME(gtaoi_rise)(c, f, s, side, w, inv, rise, least, sample, orthographic, bounded, ring, 0);
}

/* The horizon search: samples [0, n0) on the + side, [0, n1) on the - side, of which the first is number `begin` of its
 * list. `at` is the group's first pixel. Samples in the falloff ring are only noted, and looked at when the full-weight
 * ones of their chunk are in: fewer of them are above these, and nothing has to be guessed on the way. */
GTAOI_FI void GTAOI_NAME(gtaoi_march)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                      GTAOI_HORIZONS *horizons, const float *at, const gtaoi_sample *q, int begin,
                                      int n0, int n1, int orthographic, int bounded, int ring) {
    GTAOI_NO_CONTRACT
    int chunk = GTAOI_MARCH -
                begin % GTAOI_MARCH; /* chunks end at the same samples wherever the search begins: the same bits */
    GTAOI_HORIZONS s = *horizons;
    GTAOI_SAMPLE a, b;
    for (; n0 > 0 || n1 > 0; n0 -= chunk, n1 -= chunk, q += chunk, chunk = GTAOI_MARCH) {
        int both = gtaoi_imin(gtaoi_imin(n0, n1), chunk), rest = gtaoi_imin(gtaoi_imax(n0, n1), chunk), j;
        unsigned fading = 0;
        for (j = 0; j < both; j++) {
            GM fade_a = GTAOI_NAME(gtaoi_visit)(c, p, f, &s, 0, at, q + j, &a, orthographic, bounded, ring);
            GM fade_b = GTAOI_NAME(gtaoi_visit)(c, p, f, &s, 1, at, q + j, &b, orthographic, bounded, ring);
            if (ring)
                fading |= (unsigned)GM_ANY(GM_OR(fade_a, fade_b)) << j;
        }
        for (; j < rest; j++) { /* one side has left the image */
            GM fade;
            if (n1 > n0)
                fade = GTAOI_NAME(gtaoi_visit)(c, p, f, &s, 1, at, q + j, &a, orthographic, bounded, ring);
            else
                fade = GTAOI_NAME(gtaoi_visit)(c, p, f, &s, 0, at, q + j, &a, orthographic, bounded, ring);
            if (ring)
                fading |= (unsigned)GM_ANY(fade) << j;
        }
        while (ring && fading) {
            j = gtaoi_lowest(fading);
            fading &= fading - 1;
            if (j < n0) {
                GM fade = GTAOI_NAME(gtaoi_visit)(c, p, f, &s, 0, at, q + j, &a, orthographic, bounded, ring);
                GTAOI_NAME(gtaoi_fade)(c, f, &s, 0, &a, fade);
            }
            if (j < n1) {
                GM fade = GTAOI_NAME(gtaoi_visit)(c, p, f, &s, 1, at, q + j, &b, orthographic, bounded, ring);
                GTAOI_NAME(gtaoi_fade)(c, f, &s, 1, &b, fade);
            }
        }
    }
    *horizons = s;
}

/* The same for every pixel of the slices, two taps across each. `near_taps` are those of the first n_near samples. */
GTAOI_FI void GTAOI_NAME(gtaoi_march_every)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                            GTAOI_HORIZONS *horizons, const float *at, const gtaoi_sample *q, int n0,
                                            int n1, const gtaoi_taps *near_taps, int n_near, int orthographic,
                                            int bounded) {
    GTAOI_NO_CONTRACT
    GTAOI_HORIZONS s = *horizons;
    GTAOI_SAMPLE a, b;
    int j, both = gtaoi_imin(n0, n1), rest = gtaoi_imax(n0, n1), side = n1 > n0;
    GV tangent = GV_ADD(GV_MUL(p->gx, f->dx), GV_MUL(p->gy, f->dy)), w, rise, least;
    GV across = GV_SELECT(GV_LE(GV_ABS(f->dy), GV_ABS(f->dx)), p->gy, p->gx);
    for (j = 0; j < both; j++, q++) {
        GV inv = GV_SET(q->inv_length), base = GV_MUL(p->w0, inv);
        const gtaoi_taps *t = j < n_near ? near_taps + j : 0;
        GM fade_a, fade_b;
        rise = GTAOI_NAME(gtaoi_take)(c, p, 0, at, q, t, inv, base, tangent, across, &w, &least, orthographic, 1);
        fade_a = GTAOI_NAME(gtaoi_rise)(c, f, &s, 0, w, inv, rise, least, &a, orthographic, bounded, 1, 1);
        rise = GTAOI_NAME(gtaoi_take)(c, p, 1, at, q, t, inv, base, tangent, across, &w, &least, orthographic, 1);
        fade_b = GTAOI_NAME(gtaoi_rise)(c, f, &s, 1, w, inv, rise, least, &b, orthographic, bounded, 1, 1);
        if (GM_ANY(GM_OR(fade_a, fade_b))) {
            GTAOI_NAME(gtaoi_fade)(c, f, &s, 0, &a, fade_a);
            GTAOI_NAME(gtaoi_fade)(c, f, &s, 1, &b, fade_b);
        }
    }
    for (; j < rest; j++, q++) { /* one side has left the image */
        GV inv = GV_SET(q->inv_length), base = GV_MUL(p->w0, inv);
        const gtaoi_taps *t = j < n_near ? near_taps + j : 0;
        GM fading;
        rise = GTAOI_NAME(gtaoi_take)(c, p, side, at, q, t, inv, base, tangent, across, &w, &least, orthographic, 1);
        fading = GTAOI_NAME(gtaoi_rise)(c, f, &s, side, w, inv, rise, least, &a, orthographic, bounded, 1, 1);
        if (GM_ANY(fading))
            GTAOI_NAME(gtaoi_fade)(c, f, &s, side, &a, fading);
    }
    *horizons = s;
}

/* A sample on the paths that take every cosine: [J16] thickness heuristic, and the memo's search, where kappa and reach
 * belong to the sample's own direction instead of the slice's. */
GTAOI_FI void GTAOI_NAME(gtaoi_cosine)(const gtao_context *c, const GTAOI_FRAME *f, GTAOI_HORIZONS *s, int side,
                                       GV kappa, GV reach) {
    GTAOI_NO_CONTRACT
    const GV zero = GV_SET(0.0f), one = GV_SET(1.0f);
    GV rho, cosine, weight = one, faded;
    GV start = side ? GV_SUB(zero, f->cos_tangent) : f->cos_tangent;
    kappa = GV_MIN(GV_MAX(kappa, GV_SET(-GTAOI_KAPPA_LIMIT)), GV_SET(GTAOI_KAPPA_LIMIT));
    rho = GV_ADD(GV_MUL(kappa, kappa), one);
    cosine = GV_DIV(kappa, GV_SQRT(rho));
    if (c->bounded) {
        GV reach2 = GV_MUL(reach, reach);
        GM inside = GV_LE(rho, GV_MUL(reach2, GV_SET(c->inner2)));
        weight = GV_MUL(GV_SUB(one, GV_DIV(GV_SQRT(rho), GV_ABS(reach))), GV_SET(c->inv_falloff));
        weight = GV_SELECT(inside, one, GV_IF(GV_LT(rho, reach2), GV_MIN(GV_MAX(weight, zero), one)));
    }
    faded = GV_MAX(GV_ADD(start, GV_MUL(weight, GV_SUB(cosine, start))), start);
    s->cosine[side] =
        GV_SELECT(GV_LT(s->cosine[side], faded), faded,
                  GV_ADD(s->cosine[side], GV_MUL(GV_SET(c->d.thin_blend), GV_SUB(faded, s->cosine[side]))));
}

GTAOI_FI void GTAOI_NAME(gtaoi_visit_cosine)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                             GTAOI_HORIZONS *s, int side, GV w, GV inv, GV ux, GV uy) {
    GTAOI_NO_CONTRACT
    const GV zero = GV_SET(0.0f), one = GV_SET(1.0f);
    GV slope = c->orthographic ? inv : GV_MUL(w, inv), kappa, reach;
    if (c->d.estimator == GTAO_ESTIMATOR_MEMO) {
        /* D = w0 b - s r0 with b of the sample; cot h = D.v / |D_perp|, as if it lay in the slice. */
        GV w0 = c->orthographic ? one : p->w0;
        GV bx = GV_MUL(ux, GV_SET(c->bx1)), by = GV_MUL(uy, GV_SET(c->by1));
        GV br = GV_MUL(GV_ADD(GV_MUL(bx, p->rx), GV_MUL(by, p->ry)), p->inv_len);
        GV perp2 = GV_SUB(GV_ADD(GV_MUL(bx, bx), GV_MUL(by, by)), GV_MUL(br, br));
        GV dv = GV_SUB(GV_MUL(GV_MUL(GV_SUB(w, p->w0), inv), p->len), GV_MUL(w0, br));
        GV perp = GV_SQRT(perp2);
        kappa = GV_DIV(dv, GV_MUL(w0, perp));
        reach = GV_DIV(GV_MUL(GV_SET(c->reach), slope), perp);
    } else {
        GV tangent = GV_ADD(GV_MUL(p->gx, ux), GV_MUL(p->gy, uy));
        GV rise = GV_SUB(GV_MUL(w, inv), GV_ADD(GV_MUL(p->w0, inv), tangent));
        kappa = GV_ADD(GV_MUL(rise, f->kappa_scale), side ? GV_SUB(zero, f->kappa_tangent) : f->kappa_tangent);
        reach = GV_MUL(slope, f->reach);
    }
    GTAOI_NAME(gtaoi_cosine)(c, f, s, side, kappa, reach);
}

GTAOI_FN void GTAOI_NAME(gtaoi_march_cosines)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                              GTAOI_HORIZONS *s, const float *at, const gtaoi_sample *q, int n0,
                                              int n1) {
    int side, j;
    for (side = 0; side < 2; side++)
        for (j = 0; j < (side ? n1 : n0); j++) {
            GV w = GV_LOAD(at + q[j].offset[side]), inv = GV_SET(q[j].inv_length), ux = GV_SET(q[j].ux),
               uy = GV_SET(q[j].uy);
            if (c->every_pixel) {
                GV across = GV_SELECT(GV_LE(GV_ABS(f->dy), GV_ABS(f->dx)), p->gy, p->gx);
                if (side)
                    across = GV_SUB(GV_SET(0.0f), across);
                w = GTAOI_NAME(gtaoi_between)(c, w, GV_LOAD(at + q[j].offset[side + 2]), ux, across, c->orthographic);
                ux = f->dx, uy = f->dy;
            }
            if (side)
                ux = GV_SUB(GV_SET(0.0f), ux), uy = GV_SUB(GV_SET(0.0f), uy);
            GTAOI_NAME(gtaoi_visit_cosine)(c, p, f, s, side, w, inv, ux, uy);
        }
}

/* The variant of the search for this call. */
GTAOI_FN void GTAOI_NAME(gtaoi_search)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                       GTAOI_HORIZONS *s, const float *at, const gtaoi_sample *q, int begin, int n0,
                                       int n1, const gtaoi_taps *near_taps) {
    if (c->cosines)
        GTAOI_NAME(gtaoi_march_cosines)(c, p, f, s, at, q, n0, n1);
    else if (c->every_pixel && c->orthographic && !c->bounded) /* of a sweep */
        GTAOI_NAME(gtaoi_march_every)
    (c, p, f, s, at, q, n0, n1, near_taps + begin, GTAOI_NEAR - begin, 1, 0);
    else if (c->every_pixel) GTAOI_NAME(gtaoi_march_every)(c, p, f, s, at, q, n0, n1, near_taps + begin,
                                                           GTAOI_NEAR - begin, c->orthographic, c->bounded);
    else GTAOI_NAME(gtaoi_march)(c, p, f, s, at, q, begin, n0, n1, c->orthographic, c->bounded, 1);
}

/* Far samples [begin, n0) on the + side, [begin, n1) on the - side; `at` is the group's block. */
GTAOI_FN void GTAOI_NAME(gtaoi_march_far)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                          GTAOI_HORIZONS *s, const float *at, const gtaoi_far *q, int begin, int n0,
                                          int n1) {
    GTAOI_NO_CONTRACT
    int side, j;
    for (side = 0; side < 2; side++)
        for (j = begin; j < (side ? n1 : n0); j++) {
            GV w = GV_LOAD(at + q[j].offset[side]), inv = GV_SET(q[j].inv_length[side]), rise;
            GTAOI_SAMPLE sample;
            GM fading;
            rise = GV_ADD(GV_MUL(p->gx, GV_SET(q[j].ux[side])), GV_MUL(p->gy, GV_SET(q[j].uy[side])));
            rise = GV_SUB(GV_MUL(w, inv), GV_ADD(GV_MUL(p->w0, inv), rise));
            fading =
                GTAOI_NAME(gtaoi_rise)(c, f, s, side, w, inv, rise, rise, &sample, c->orthographic, c->bounded, 1, 0);
            if (c->bounded && GM_ANY(fading))
                GTAOI_NAME(gtaoi_fade)(c, f, s, side, &sample, fading);
        }
}

/* One list of samples: the part of it, from `begin`, that is over the image. */
GTAOI_FN void GTAOI_NAME(gtaoi_search_list)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                            GTAOI_HORIZONS *s, const float *at, int index, const gtaoi_sample *q,
                                            int begin, int n0, int n1, int x, int y) {
    const gtaoi_taps *near_taps = c->taps + index * GTAOI_NEAR;
    int x1 = x + (GTAOI_W - 1) * c->period, want0 = n0, want1 = n1, n = gtaoi_imax(n0, n1);
    if (n <= begin)
        return;
    if (!gtaoi_interior(c, q + n - 1, x, x1, y))
        n0 = gtaoi_reach(c, q, n0, 1, x, x1, y), n1 = gtaoi_reach(c, q, n1, -1, x, x1, y);
    if (c->d.far_depth) { /* the border is open */
        ptrdiff_t list = q - c->sample;
        int m = c->far_begin[list / c->max_steps];
        if (n0 > m || n1 > m)
            GTAOI_NAME(gtaoi_march_far)
        (c, p, f, s, c->far_w + (y >> 2) * c->far_pitch + GTAOI_PAD + (x >> 2), c->far_sample + list, m, n0, n1);
        n = m, n0 = gtaoi_imin(n0, m), n1 = gtaoi_imin(n1, m);
    }
    /* What lies outside an open border may be left out, but for the thickness heuristic, where sky too lowers horizons.
     * */
    if ((c->d.border == GTAO_BORDER_OPEN && c->d.thin_blend == 0.0f) || (n0 == want0 && n1 == want1)) {
        GTAOI_NAME(gtaoi_search)
        (c, p, f, s, at, q + begin, begin, gtaoi_imax(n0 - begin, 0), gtaoi_imax(n1 - begin, 0), near_taps);
    } else {
        gtaoi_sample moved[GTAOI_CHUNK];
        int m, second_along_x = c->slice[index].x_major == 0;
        for (; begin < n; begin += m) {
            m = gtaoi_imin(n - begin, GTAOI_CHUNK - begin % GTAOI_CHUNK);
            gtaoi_remap(c, q + begin, m, x, y, second_along_x, moved);
            GTAOI_NAME(gtaoi_search)
            (c, p, f, s, at, moved, begin, gtaoi_imax(gtaoi_imin(m, want0 - begin), 0),
             gtaoi_imax(gtaoi_imin(m, want1 - begin), 0), near_taps);
        }
    }
}

/* Search one slice of a group whose lanes share directions: lanes by radius class. */
GTAOI_FN void GTAOI_NAME(gtaoi_search_table)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                             GTAOI_HORIZONS *s, const float *at, int index, GM active, int x, int y,
                                             const gtaoi_tile *seen, gtao_stats *stats) {
    const int *count = c->count + (size_t)index * (size_t)c->classes;
    int begin = 0, i, n, whole = 1, range[3];
    float keys[GTAOI_W];
    GV_STORE(keys, p->key);
    for (; GM_ANY(active); whole = 0) {
        unsigned bits = GM_BITS(active);
        int first = gtaoi_lowest(bits), k = gtaoi_class(c, keys[first]);
        GTAOI_HORIZONS found;
        GM lanes = GM_AND(active, GV_EQ(p->key, GV_SET(keys[first]))), chosen = lanes;
        const gtaoi_sample *q;
        n = count[k];
        if (c->every_pixel) {
            /* One list for all, so all go on together up to the nearest end. */
            q = c->sample + (size_t)index * (size_t)c->max_steps;
            for (i = GM_BITS(lanes) == bits ? GTAOI_W : first + 1; i < GTAOI_W; i++) {
                if (!(bits >> i & 1) || count[gtaoi_class(c, keys[i])] >= n)
                    continue;
                n = count[gtaoi_class(c, keys[i])];
                lanes = GM_AND(active, GV_EQ(p->key, GV_SET(keys[i])));
            }
            chosen = active;
        } else {
            q = c->sample + ((size_t)index * (size_t)c->classes + (size_t)k) * (size_t)c->max_steps;
        }
        gtaoi_range(c, seen, index, q, n, range);
        range[0] = gtaoi_imax(range[0], begin);
        gtaoi_count_samples(range, begin, n, gtaoi_popcount(c->every_pixel ? bits : GM_BITS(lanes)), stats);
        if (whole && GM_BITS(lanes) == bits) { /* nearly always: all of one class */
            GTAOI_NAME(gtaoi_search_list)(c, p, f, s, at, index, q, range[0], range[1], range[2], x, y);
            return;
        }
        found = *s;
        GTAOI_NAME(gtaoi_search_list)(c, p, f, &found, at, index, q, range[0], range[1], range[2], x, y);
        for (i = 0; i < 2; i++) {
            s->rise[i] = GV_SELECT(chosen, found.rise[i], s->rise[i]);
            s->cosine[i] = GV_SELECT(chosen, found.cosine[i], s->cosine[i]);
        }
        active = GM_ANDNOT(active, lanes);
        if (c->every_pixel)
            begin = n;
    }
}

/* Heights at whole-pixel coordinates, borders applied. */
GTAOI_FI GV GTAOI_NAME(gtaoi_fetch)(const gtao_context *c, const float *plane, GV x, GV y) {
    GTAOI_NO_CONTRACT
    float xs[GTAOI_W], ys[GTAOI_W], out[GTAOI_W];
    GV w = GV_SET((float)c->d.width), h = GV_SET((float)c->d.height), zero = GV_SET(0.0f), one = GV_SET(1.0f);
    int i;
    if (c->d.border == GTAO_BORDER_OPEN) {
        x = GV_MIN(GV_MAX(x, GV_SET(-1.0f)), w);
        y = GV_MIN(GV_MAX(y, GV_SET(-1.0f)), h);
    } else if (c->d.border == GTAO_BORDER_CLAMP) {
        x = GV_MIN(GV_MAX(x, zero), GV_SUB(w, one));
        y = GV_MIN(GV_MAX(y, zero), GV_SUB(h, one));
    } else {
        x = GV_SUB(x, GV_MUL(w, GTAOI_NAME(gtaoi_floor)(GV_DIV(x, w))));
        y = GV_SUB(y, GV_MUL(h, GTAOI_NAME(gtaoi_floor)(GV_DIV(y, h))));
    }
    GV_STORE(xs, x);
    GV_STORE(ys, y);
    for (i = 0; i < GTAOI_W; i++)
        out[i] = plane[(ptrdiff_t)(int)ys[i] * c->pitch + GTAOI_PAD + (int)xs[i]];
    return GV_LOAD(out);
}

/* Rise above the tangent plane of the pixel (x, y), of height w, in its own direction. */
GTAOI_FI GV GTAOI_NAME(gtaoi_own_rise)(const GTAOI_PIXEL *p, GV x, GV y, GV w) {
    GTAOI_NO_CONTRACT
    GV qx = GV_SUB(x, p->x), qy = GV_SUB(y, p->y);
    GV rise = GV_SUB(GV_SUB(w, p->w0), GV_ADD(GV_MUL(p->gx, qx), GV_MUL(p->gy, qy)));
    return GV_DIV(rise, GV_SQRT(GV_ADD(GV_MUL(qx, qx), GV_MUL(qy, qy))));
}

/* Lanes whose sample at distance t may rise, whatever its direction; it may be a pixel off. */
GTAOI_FI GM GTAOI_NAME(gtaoi_may_matter)(const gtaoi_tile *seen, GV t) {
    return GM_AND(GV_LE(GV_SET(0.99999f * seen->lo_all - 1.0f), t), GV_LE(t, GV_SET(1.00001f * seen->hi_all + 1.0f)));
}

/* Search one slice of a group with a direction and an offset for each pixel. */
GTAOI_FN void GTAOI_NAME(gtaoi_search_noise)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                             GTAOI_HORIZONS *s, GM active, const gtaoi_tile *seen, gtao_stats *stats) {
    GTAOI_NO_CONTRACT
    const GV zero = GV_SET(0.0f), one = GV_SET(1.0f);
    GV ax = GV_ABS(f->dx), ay = GV_ABS(f->dy), unit = GV_MAX(ax, ay), radius, steps;
    GM along_x = GV_LE(ay, ax);
    float level[GTAOI_W], position[GTAOI_W] = {0.0f};
    int i, j, side, n = c->max_steps, taps = c->every_pixel;
    uint64_t left_out = 0;
    radius = GV_DIV(p->extent, GV_SQRT(f->bb));
    radius = GV_MIN(GV_MAX(radius, one), GV_SET(c->max_radius));
    steps = GV_MAX(GTAOI_NAME(gtaoi_floor)(GV_MUL(radius, unit)), one);
    GV_STORE(level, p->offset);
    if (taps) {
        GV_STORE(position, steps);
        for (n = 1, i = 0; i < GTAOI_W; i++) {
            n = gtaoi_imax(n, (int)position[i]);
            if (GM_BITS(active) >> i & 1)
                stats->samples += (uint64_t)(2 * (int)position[i]);
        }
    } else {
        stats->samples += (uint64_t)(2 * n * gtaoi_popcount(GM_BITS(active)));
    }
    if (seen && !(seen->lo_all <= seen->hi_all)) {
        for (i = 0; i < GTAOI_W; i++)
            if (GM_BITS(active) >> i & 1)
                left_out += (uint64_t)(2 * (taps ? (int)position[i] : n));
        n = 0;
    }
    for (j = 0; j < n; j++) {
        GV qx, qy, inv, fraction = zero;
        GM within = GV_LE(zero, zero), rising;
        if (taps) {
            GV t = GV_DIV(GV_SET((float)(j + 1)), unit), px = GV_MUL(t, f->dx), py = GV_MUL(t, f->dy);
            within = GV_LE(GV_SET((float)(j + 1)), steps);
            qx = GV_SELECT(along_x, GTAOI_NAME(gtaoi_nearest)(px), GTAOI_NAME(gtaoi_floor)(px));
            qy = GV_SELECT(along_x, GTAOI_NAME(gtaoi_floor)(py), GTAOI_NAME(gtaoi_nearest)(py));
            fraction = GV_SELECT(along_x, GV_SUB(py, qy), GV_SUB(px, qx));
            inv = GV_DIV(one, t);
            rising = seen ? GTAOI_NAME(gtaoi_may_matter)(seen, t) : within;
        } else {
            GV t;
            for (i = 0; i < GTAOI_W; i++)
                position[i] = c->step[64 * j + (int)level[i]];
            t = GV_ADD(one, GV_MUL(GV_SUB(radius, one), GV_LOAD(position)));
            qx = GTAOI_NAME(gtaoi_nearest)(GV_MUL(t, f->dx));
            qy = GTAOI_NAME(gtaoi_nearest)(GV_MUL(t, f->dy));
            inv = GV_DIV(one, GV_SQRT(GV_ADD(GV_MUL(qx, qx), GV_MUL(qy, qy))));
            rising = seen ? GTAOI_NAME(gtaoi_may_matter)(seen, t) : within;
        }
        if (!GM_ANY(rising)) {
            left_out += (uint64_t)(2 * gtaoi_popcount(GM_BITS(GM_AND(active, within))));
            continue;
        }
        for (side = 0; side < 2; side++) {
            GV x = side ? GV_SUB(p->x, qx) : GV_ADD(p->x, qx), y = side ? GV_SUB(p->y, qy) : GV_ADD(p->y, qy);
            GV w = GTAOI_NAME(gtaoi_fetch)(c, c->w, x, y), ux = GV_MUL(qx, inv), uy = GV_MUL(qy, inv), tangent, rise,
               least, before[2];
            GV w_a = w, w_b = w, bx = x, by = y;
            if (taps) {
                GV step = side ? GV_SET(-1.0f) : one;
                GV across = GV_MUL(step, GV_SELECT(along_x, p->gy, p->gx));
                bx = GV_SELECT(along_x, x, GV_ADD(x, step)), by = GV_SELECT(along_x, GV_ADD(y, step), y);
                w_b = GTAOI_NAME(gtaoi_fetch)(c, c->w, bx, by);
                w = GTAOI_NAME(gtaoi_between)(c, w_a, w_b, fraction, across, c->orthographic);
                ux = f->dx, uy = f->dy;
            }
            if (side)
                ux = GV_SUB(zero, ux), uy = GV_SUB(zero, uy);
            tangent = GV_ADD(GV_MUL(p->gx, ux), GV_MUL(p->gy, uy));
            rise = GV_SUB(GV_MUL(w, inv), GV_ADD(GV_MUL(p->w0, inv), tangent));
            least = rise;
            if (taps && j < GTAOI_NEAR)
                least = GV_MIN(
                    rise, GV_MAX(GTAOI_NAME(gtaoi_own_rise)(p, x, y, w_a), GTAOI_NAME(gtaoi_own_rise)(p, bx, by, w_b)));
            before[0] = s->rise[side], before[1] = s->cosine[side];
            if (c->cosines)
                GTAOI_NAME(gtaoi_visit_cosine)(c, p, f, s, side, w, inv, ux, uy);
            else {
                GTAOI_SAMPLE sample;
                GM fading = GTAOI_NAME(gtaoi_rise)(c, f, s, side, w, inv, rise, least, &sample, c->orthographic,
                                                   c->bounded, 1, taps);
                if (c->bounded && GM_ANY(fading))
                    GTAOI_NAME(gtaoi_fade)(c, f, s, side, &sample, fading);
            }
            if (taps) {
                s->rise[side] = GV_SELECT(within, s->rise[side], before[0]);
                s->cosine[side] = GV_SELECT(within, s->cosine[side], before[1]);
            }
        }
    }
    stats->samples -= left_out, stats->samples_skipped += left_out;
}

/* ---- arcs: occluders with thickness ----------------------------------------------------------------------------- */

/* A sample is a column along its view ray, from its front to its back: an interval of rises above the tangent plane.
 * What is occluded is the union of the intervals. The part of it that reaches down to the tangent plane is kept as a
 * horizon, exactly; what hangs free above it as a mask of sectors on each side. Sector borders are equidistant in
 * y = t^2 / (1 + t^2), t = (kappa - kappa_tangent) cos n: equal cosine-weighted solid angle where the normal is v and
 * nearly so elsewhere, and no angle is needed. An end of an interval goes to the nearest border; borders move by a
 * fraction from slice to slice, so that these roundings do not add up over slices. */
typedef struct GTAOI_ARCS {
    GI mask[2]; /* + and - side */
    GV to_t;    /* rise to t, and back */
    GV from_t;
    GV shift;     /* of the sector borders, in sectors, -1/2..1/2 */
    GV inv_scale; /* cot h to rise; only for falloff and columns cut off by the radius */
    GV chord;     /* (radius w0)^2: the sphere along the view rays; only for the latter */
    GV denominator, inv_denominator;
} GTAOI_ARCS;

/* A sample as a column: its height and the rises of its two ends. Also the one before it, for the surface between. */
typedef struct GTAOI_COLUMN {
    GV w, front, back;
    GM connected; /* with the sample before */
} GTAOI_COLUMN;

GTAOI_FN void GTAOI_NAME(gtaoi_begin_slice_arcs)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                                 int k, GTAOI_ARCS *a) {
    GTAOI_NO_CONTRACT
    const GV one = GV_SET(1.0f);
    GV sec = GV_SQRT(GV_ADD(one, GV_MUL(f->kappa_tangent, f->kappa_tangent)));
    float turn = 0.618034f * (float)k;
    a->mask[0] = a->mask[1] = GI_SET(0u);
    a->to_t = GV_DIV(f->kappa_scale, sec);
    a->from_t = GV_DIV(sec, f->kappa_scale);
    a->shift = GV_SET((turn - (float)(int)turn) * 0.96875f - 0.484375f);
    a->inv_scale = a->chord = a->denominator = a->inv_denominator = one;
    if (c->inv_falloff > 0.0f || c->clip)
        a->inv_scale = GV_DIV(one, f->kappa_scale);
    if (c->clip) {
        /* Of the ray r the sphere about P0 holds w0 (r.r0 -+ sqrt((R w0)^2 r^2 - (r x r0)^2)) / (r0^2 - (R w0)^2). */
        a->chord = GV_MUL(GV_SET(c->reach), p->w0);
        a->chord = GV_MUL(a->chord, a->chord);
        a->denominator = GV_SUB(GV_MUL(p->len, p->len), a->chord);
        a->inv_denominator = GV_DIV(p->w0, a->denominator);
    }
}

/* Number of the border that is nearest to a rise, 0..GTAOI_SECTORS; and the rise of a border. */
GTAOI_FI GV GTAOI_NAME(gtaoi_sector)(const GTAOI_ARCS *a, GV rise) {
    GTAOI_NO_CONTRACT
    GV t = GV_MIN(GV_MUL(rise, a->to_t), GV_SET(GTAOI_ARC_LIMIT)), tt = GV_MUL(t, t);
    return GV_SUB(GV_MUL(GV_DIV(tt, GV_ADD(tt, GV_SET(1.0f))), GV_SET((float)GTAOI_SECTORS)), a->shift);
}
GTAOI_FI GV GTAOI_NAME(gtaoi_border)(const GTAOI_ARCS *a, GV i) {
    GTAOI_NO_CONTRACT
    GV y = GV_MUL(GV_ADD(i, a->shift), GV_SET(1.0f / (float)GTAOI_SECTORS)), t;
    t = GV_SQRT(GV_DIV(GV_IF(GV_LT(GV_SET(0.5f), i), y), GV_SUB(GV_SET(1.0f), y)));
    t = GV_SELECT(GV_LT(i, GV_SET((float)GTAOI_SECTORS - 0.5f)), t, GV_SET(GTAOI_ARC_LIMIT));
    return GV_MUL(t, a->from_t);
}

/* An interval from l to u in the falloff ring: it shrinks to its lower end, cos u' = lerp(cos l, cos u, weight). For an
 * endless column l is the tangent plane, which is the attenuation of the height field. */
GTAOI_FN GV GTAOI_NAME(gtaoi_fade_interval)(const gtao_context *c, const GTAOI_ARCS *a, const GTAOI_FRAME *f, int side,
                                            GV l, GV u, GV rho, GV reach) {
    GTAOI_NO_CONTRACT
    const GV zero = GV_SET(0.0f), one = GV_SET(1.0f), limit = GV_SET(GTAOI_KAPPA_LIMIT);
    GV tangent = side ? GV_SUB(zero, f->kappa_tangent) : f->kappa_tangent, kl, ku, cosine, weight;
    weight = GV_MUL(GV_SUB(one, GV_DIV(GV_SQRT(rho), GV_ABS(reach))), GV_SET(c->inv_falloff));
    weight = GV_MIN(GV_MAX(weight, zero), one);
    kl = GV_MIN(GV_ADD(GV_MUL(GV_MAX(l, zero), f->kappa_scale), tangent), limit);
    ku = GV_MIN(GV_ADD(GV_MUL(u, f->kappa_scale), tangent), limit);
    kl = GV_DIV(kl, GV_SQRT(GV_ADD(GV_MUL(kl, kl), one)));
    ku = GV_DIV(ku, GV_SQRT(GV_ADD(GV_MUL(ku, ku), one)));
    cosine = GV_ADD(kl, GV_MUL(weight, GV_SUB(ku, kl)));
    cosine = GV_DIV(cosine, GV_SQRT(GV_MAX(GV_SUB(one, GV_MUL(cosine, cosine)), GV_SET(1e-12f))));
    return GV_MUL(GV_SUB(cosine, tangent), a->inv_scale);
}

/* A column at distance t = 1 / inv, and the height difference `gap` (perspective: relative) that a surface makes from
 * the one before; its front rises by `rise` and occludes up to `least`. Raises the horizon where it joins it. Returns
 * the pixels for which it hangs free above, as the interval [l, u]. */
GTAOI_FI GM GTAOI_NAME(gtaoi_visit_column)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                           const GTAOI_ARCS *a, int side, GTAOI_COLUMN *before, GV *horizon, GV w,
                                           GV w_back, GV gap, GV inv, GV base, GV rise, GV least, GM wanted, GV *low,
                                           GV *high, int orthographic, int bounded, int ring, int clip) {
    GTAOI_NO_CONTRACT
    const GV zero = GV_SET(0.0f), one = GV_SET(1.0f);
    GV back = GV_SUB(GV_MUL(w_back, inv), base), l, u, rho = one, reach = one;
    GM joined, connected, fading = GV_LT(one, zero);
    /* A surface that goes on from the column before covers what lies between. The height of sky is negative: it never
     * does. Rises below zero do not count. */
    if (!orthographic)
        gap = GV_MUL(gap, GV_MIN(w, before->w));
    connected = GV_LE(GV_ABS(GV_SUB(w, before->w)), gap);
    l = GV_SELECT(connected, GV_MIN(before->front, back), back);
    u = GV_MAX(least, GV_IF(connected, before->back));
    before->w = w, before->front = least, before->back = back, before->connected = connected;
    if (bounded) {
        GV tangent = side ? GV_SUB(zero, f->kappa_tangent) : f->kappa_tangent, kappa, slope = GV_MUL(w, inv), reach2;
        if (clip) { /* the column's point nearest to the pixel decides, and only what is within the sphere counts */
            GV lowest, highest;
            rise = GV_MIN(GV_MAX(GV_SUB(zero, GV_MUL(tangent, a->inv_scale)), back), rise);
            slope = GV_ADD(rise, base);
            if (orthographic) {
                GV room = GV_MUL(inv, f->reach);
                room = GV_SQRT(GV_MAX(GV_SUB(GV_MUL(room, room), one), zero));
                lowest = GV_MUL(GV_SUB(GV_SUB(zero, room), tangent), a->inv_scale);
                highest = GV_MUL(GV_SUB(room, tangent), a->inv_scale);
            } else {
                GV t = GV_DIV(one, inv), tt = GV_MUL(t, t), len2 = GV_MUL(p->len, p->len), br, rr, dot, root;
                br = GV_MUL(t, GV_MUL(f->along, p->len));
                if (side)
                    br = GV_SUB(zero, br);
                dot = GV_ADD(len2, br);
                rr = GV_ADD(GV_ADD(dot, br), GV_MUL(tt, f->bb));
                root = GV_MUL(GV_MUL(tt, len2), GV_SUB(f->bb, GV_MUL(f->along, f->along)));
                root = GV_SQRT(GV_MAX(GV_SUB(GV_MUL(a->chord, rr), root), zero));
                lowest = GV_SUB(GV_MUL(GV_MUL(GV_SUB(dot, root), a->inv_denominator), inv), base);
                highest = GV_SUB(GV_MUL(GV_MUL(GV_ADD(dot, root), a->inv_denominator), inv), base);
                highest = GV_SELECT(GV_LT(zero, a->denominator), highest, u); /* else the eye is within the sphere */
            }
            l = GV_MAX(lowest, l), u = GV_MIN(highest, u);
        }
        kappa = GV_ADD(GV_MUL(rise, f->kappa_scale), tangent);
        rho = GV_ADD(GV_MUL(kappa, kappa), one);
        reach = GV_MUL(orthographic ? inv : slope, f->reach);
        reach2 = GV_MUL(reach, reach);
        if (ring) {
            GV highest = GV_MAX(u, rise); /* as in the height field, where `least` does not bound what fades */
            GM inside = GV_LE(rho, GV_MUL(reach2, GV_SET(c->inner2)));
            fading = GM_ANDNOT(GM_AND(wanted, GV_LT(rho, reach2)), inside);
            wanted = GM_OR(GM_AND(wanted, inside), fading);
            fading = GM_AND(fading, GV_LT(*horizon, highest));
            if (GM_ANY(fading))
                u = GV_SELECT(fading, GTAOI_NAME(gtaoi_fade_interval)(c, a, f, side, l, highest, rho, reach), u);
        } else {
            wanted = GM_AND(wanted, GV_LE(rho, reach2));
        }
    }
    wanted = GM_AND(wanted, GV_LT(*horizon, u));
    *low = l, *high = u;
    if (!GM_ANY(wanted)) /* mostly */
        return wanted;
    joined = GM_AND(wanted, GV_LE(l, *horizon));
    *horizon = GV_SELECT(joined, u, *horizon);
    return GM_ANDNOT(wanted, joined);
}

/* The sectors between l and u. A sample stands for the stretch of the slice between it and its neighbours: a sheet
 * (its back is its front) that hangs free is as wide, `half` (half the distance to the sample before, in units of t)
 * to both sides but where a surface goes on. What has a depth is a quarter of a pixel narrower, for the arc from front
 * to back fills part of that (chosen by the errors in docs/thickness.md). The rise at the ends of the stretch is that
 * of the same height above the tangent plane. */
GTAOI_FI GI GTAOI_NAME(gtaoi_hang)(const GTAOI_ARCS *a, const GTAOI_COLUMN *column, GI mask, GM hangs, GV l, GV u,
                                   GV half, GV inv) {
    GTAOI_NO_CONTRACT
    const GV one = GV_SET(1.0f);
    const GM sheet = GV_LE(GV_SUB(column->front, column->back), GV_MUL(GV_ABS(column->front), GV_SET(1e-3f)));
    GV il, iu;
    half = GV_SELECT(sheet, half, GV_SUB(half, GV_MUL(GV_SET(0.25f), inv)));
    il = GTAOI_NAME(gtaoi_sector)(a, GV_DIV(l, GV_ADD(one, half)));
    iu = GTAOI_NAME(gtaoi_sector)(a, GV_DIV(u, GV_SELECT(column->connected, one, GV_SUB(one, half))));
    il = GTAOI_NAME(gtaoi_nearest)(il), iu = GTAOI_NAME(gtaoi_nearest)(iu);
    return GI_OR(mask, GI_IF(hangs, GI_ANDNOT(GI_FROM(il), GI_FROM(iu))));
}

/* Back height between two pixels: as the front's, gtaoi_between. */
GTAOI_FI GV GTAOI_NAME(gtaoi_between_backs)(const gtao_context *c, GV a, GV b, GV a_back, GV b_back, GV fraction,
                                            GV across, int orthographic) {
    GTAOI_NO_CONTRACT
    GV limit = GV_SET(c->same_surface), nearest;
    GM near_a = GV_LT(fraction, GV_SET(0.5f));
    nearest = GV_ADD(GV_SELECT(near_a, a_back, b_back),
                     GV_MUL(GV_SUB(fraction, GV_SELECT(near_a, GV_SET(0.0f), GV_SET(1.0f))), across));
    if (!orthographic)
        limit = GV_MUL(limit, GV_MIN(GV_ABS(a), GV_ABS(b)));
    return GV_SELECT(GV_LE(GV_ABS(GV_SUB(b, a)), limit), GV_ADD(a_back, GV_MUL(fraction, GV_SUB(b_back, a_back))),
                     nearest);
}

/* A column of the table on one side. */
GTAOI_FI GM GTAOI_NAME(gtaoi_take_column)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                          const GTAOI_ARCS *a, int side, GTAOI_COLUMN *before, GV *horizon,
                                          const float *at, const gtaoi_sample *q, const gtaoi_taps *near_taps, GV inv,
                                          GV base, GV tangent, GV across, GV gap, GM wanted, GV *l, GV *u,
                                          int orthographic, int bounded, int ring, int taps, int clip) {
    GTAOI_NO_CONTRACT
    const float *backs = at + c->plane;
    GV w, w_back = GV_LOAD(backs + q->offset[side]), least, rise;
    rise = GTAOI_NAME(gtaoi_take)(c, p, side, at, q, near_taps, inv, base, tangent, across, &w, &least, orthographic,
                                  taps);
    if (taps)
        w_back = GTAOI_NAME(gtaoi_between_backs)(c, GV_LOAD(at + q->offset[side]), GV_LOAD(at + q->offset[side + 2]),
                                                 w_back, GV_LOAD(backs + q->offset[side + 2]), GV_SET(q->ux),
                                                 side ? GV_SUB(GV_SET(0.0f), across) : across, orthographic);
    base = side ? GV_SUB(base, tangent) : GV_ADD(base, tangent);
    return GTAOI_NAME(gtaoi_visit_column)(c, p, f, a, side, before, horizon, w, w_back, gap, inv, base, rise, least,
                                          wanted, l, u, orthographic, bounded, ring, clip);
}

/* Where a march stands on both sides; it may be interrupted. */
typedef struct GTAOI_WALK {
    GTAOI_COLUMN column[2];
    float t;
} GTAOI_WALK;

/* Samples number j to n0 - 1 on the + side and to n1 - 1 on the - side, of which `q` is the first; a lane has the first
 * `count` of the list. `at` is the group's first pixel in the layer's heights. */
GTAOI_FI void GTAOI_NAME(gtaoi_march_columns)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                              GTAOI_HORIZONS *s, GTAOI_ARCS *a, GTAOI_WALK *walk, const float *at,
                                              const gtaoi_sample *q, const gtaoi_taps *near_taps, int j, int n0, int n1,
                                              GV count, int orthographic, int bounded, int ring, int taps, int clip) {
    GTAOI_NO_CONTRACT
    GTAOI_COLUMN column_a = walk->column[0], column_b = walk->column[1];
    GV horizon_a = s->rise[0], horizon_b = s->rise[1], la, ua, lb, ub;
    GV across = GV_SELECT(GV_LE(GV_ABS(f->dy), GV_ABS(f->dx)), p->gy, p->gx);
    GV tangent = GV_ADD(GV_MUL(p->gx, f->dx), GV_MUL(p->gy, f->dy));
    GM hangs_a, hangs_b, wanted = GV_LT(GV_SET(0.0f), count), none = GV_LT(GV_SET(1.0f), GV_SET(0.0f));
    GI mask_a = a->mask[0], mask_b = a->mask[1];
    float before = walk->t;
    for (; j < n0 || j < n1; j++, q++) {
        GV inv = GV_SET(q->inv_length), base = GV_MUL(p->w0, inv), gap;
        const gtaoi_taps *near_j = taps && j < GTAOI_NEAR ? near_taps + j : 0;
        float t = 1.0f / q->inv_length, spacing;
        spacing = t - before, before = t;
        gap = GV_SET(spacing * c->connect);
        if (taps) /* otherwise a lane has all or none */
            wanted = GV_LT(GV_SET((float)j), count);
        else
            tangent = GV_ADD(GV_MUL(p->gx, GV_SET(q->ux)), GV_MUL(p->gy, GV_SET(q->uy)));
        hangs_a = hangs_b = none;
        la = ua = lb = ub = gap;
        if (j < n0)
            hangs_a =
                GTAOI_NAME(gtaoi_take_column)(c, p, f, a, 0, &column_a, &horizon_a, at, q, near_j, inv, base, tangent,
                                              across, gap, wanted, &la, &ua, orthographic, bounded, ring, taps, clip);
        if (j < n1)
            hangs_b =
                GTAOI_NAME(gtaoi_take_column)(c, p, f, a, 1, &column_b, &horizon_b, at, q, near_j, inv, base, tangent,
                                              across, gap, wanted, &lb, &ub, orthographic, bounded, ring, taps, clip);
        if (GM_ANY(GM_OR(hangs_a, hangs_b))) {
            GV half = GV_SET(0.5f * spacing * q->inv_length);
            mask_a = GTAOI_NAME(gtaoi_hang)(a, &column_a, mask_a, hangs_a, la, ua, half, inv);
            mask_b = GTAOI_NAME(gtaoi_hang)(a, &column_b, mask_b, hangs_b, lb, ub, half, inv);
        }
    }
    s->rise[0] = horizon_a, s->rise[1] = horizon_b;
    a->mask[0] = mask_a, a->mask[1] = mask_b;
    walk->column[0] = column_a, walk->column[1] = column_b, walk->t = before;
}

/* The variant for this call; all conditions are constants in the loop of the first. */
GTAOI_FN void GTAOI_NAME(gtaoi_search_columns)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                               GTAOI_HORIZONS *s, GTAOI_ARCS *a, GTAOI_WALK *walk, const float *at,
                                               const gtaoi_sample *q, const gtaoi_taps *near_taps, int j, int n0,
                                               int n1, GV count, int clip) {
    int ring = c->inv_falloff > 0.0f;
    if (!c->orthographic && c->bounded && !ring && !c->every_pixel && !clip)
        GTAOI_NAME(gtaoi_march_columns)(c, p, f, s, a, walk, at, q, near_taps, j, n0, n1, count, 0, 1, 0, 0, 0);
    else
        GTAOI_NAME(gtaoi_march_columns)
    (c, p, f, s, a, walk, at, q, near_taps, j, n0, n1, count, c->orthographic, c->bounded, ring, c->every_pixel, clip);
}

GTAOI_FI void GTAOI_NAME(gtaoi_begin_walk)(const GTAOI_PIXEL *p, int layer, GTAOI_WALK *walk) {
    GTAOI_COLUMN *column = walk->column;
    column->w = layer == 0 ? p->w0 : GV_SET(GTAOI_SKY); /* the pixel itself is on the first layer */
    column->front = column->back = GV_SET(0.0f);
    column->connected = GV_LT(GV_SET(1.0f), GV_SET(0.0f));
    column[1] = column[0];
    walk->t = 0.0f;
}

/* One list of samples, all layers and both sides. */
GTAOI_FN void GTAOI_NAME(gtaoi_search_layers)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                              GTAOI_HORIZONS *s, GTAOI_ARCS *a, const float *at, int index,
                                              const gtaoi_sample *q, const int range[3], GV count, int x, int y) {
    const gtaoi_taps *near_taps = c->taps + index * GTAOI_NEAR;
    int x1 = x + (GTAOI_W - 1) * c->period, n0 = range[1], n1 = range[2], n = gtaoi_imax(n0, n1), layer, begin, m;
    int start = gtaoi_imax(range[0] - 1, 0), moves; /* from the one before: surfaces may go on from it */
    if (n <= range[0])
        return;
    moves = !gtaoi_interior(c, q + n - 1, x, x1, y);
    if (moves && c->d.border == GTAO_BORDER_OPEN) {
        n0 = gtaoi_reach(c, q, n0, 1, x, x1, y), n1 = gtaoi_reach(c, q, n1, -1, x, x1, y);
        moves = 0;
    }
    for (layer = 0; layer < c->layer_count; layer++) {
        const float *from = at + 2 * layer * c->plane;
        int clip = c->layer[layer].back && c->bounded;
        GTAOI_WALK walk;
        GTAOI_NAME(gtaoi_begin_walk)(p, layer, &walk);
        if (!moves)
            GTAOI_NAME(gtaoi_search_columns)
        (c, p, f, s, a, &walk, from, q + start, near_taps, start, n0, n1, count, clip);
        for (begin = start; moves && begin < n; begin += m) {
            gtaoi_sample moved[GTAOI_CHUNK];
            m = gtaoi_imin(n - begin, GTAOI_CHUNK);
            gtaoi_remap(c, q + begin, m, x, y, c->slice[index].x_major == 0, moved);
            GTAOI_NAME(gtaoi_search_columns)
            (c, p, f, s, a, &walk, from, moved, near_taps, begin, gtaoi_imin(begin + m, n0), gtaoi_imin(begin + m, n1),
             count, clip);
        }
    }
}

/* What hangs free but touches the horizon raises it; what lies below it is forgotten. */
GTAOI_FN void GTAOI_NAME(gtaoi_absorb)(GTAOI_HORIZONS *s, GTAOI_ARCS *a) {
    GTAOI_NO_CONTRACT
    int side;
    for (side = 0; side < 2; side++) {
        GI mask = a->mask[side], from, here, ends, after;
        GV i, top;
        if (GM_BITS(GI_IS_ZERO(mask)) == GTAOI_ALL)
            continue;
        i = GTAOI_NAME(gtaoi_floor)(GTAOI_NAME(gtaoi_sector)(a, s->rise[side]));
        i = GV_MIN(GV_MAX(i, GV_SET(0.0f)), GV_SET((float)(GTAOI_SECTORS - 1)));
        from = GI_FROM(i);
        mask = GI_AND(mask, from);
        here = GI_AND(mask, GI_ANDNOT(from, GI_FROM(GV_ADD(i, GV_SET(1.0f)))));
        ends = GI_ADD(mask, here); /* carries through the run of set bits that starts in the horizon's sector */
        after = GI_ANDNOT(ends, mask);
        i = GV_SELECT(GI_IS_ZERO(after), GV_SET((float)GTAOI_SECTORS), GI_INDEX(after));
        top = GTAOI_NAME(gtaoi_border)(a, i);
        s->rise[side] = GV_SELECT(GI_IS_ZERO(here), s->rise[side], GV_MAX(s->rise[side], top));
        a->mask[side] = GI_SELECT(GI_IS_ZERO(here), mask, GI_AND(mask, ends));
    }
}

/* One slice of a group whose lanes share directions: lanes by radius class. */
GTAOI_FN void GTAOI_NAME(gtaoi_arcs_table)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                           GTAOI_HORIZONS *s, GTAOI_ARCS *a, const float *at, int index, GM active,
                                           int x, int y, const gtaoi_tile *seen, gtao_stats *stats) {
    const int *count = c->count + (size_t)index * (size_t)c->classes;
    const gtaoi_sample *q = c->sample + (size_t)index * (size_t)c->max_steps;
    float keys[GTAOI_W], counts[GTAOI_W];
    int i, n, layers = c->layer_count, range[3];
    GV_STORE(keys, p->key);
    if (c->every_pixel) { /* one list, of which each lane has its part */
        for (n = 0, i = 0; i < GTAOI_W; i++) {
            int own = GM_BITS(active) >> i & 1 ? count[gtaoi_class(c, keys[i])] : 0;
            counts[i] = (float)own, n = gtaoi_imax(n, own);
        }
        gtaoi_range(c, seen, index, q, n, range);
        for (i = 0; i < GTAOI_W; i++)
            gtaoi_count_samples(range, 0, (int)counts[i], layers, stats);
        if (n > 0)
            GTAOI_NAME(gtaoi_search_layers)(c, p, f, s, a, at, index, q, range, GV_LOAD(counts), x, y);
        active = GV_LT(GV_SET(1.0f), GV_SET(0.0f));
    }
    while (GM_ANY(active)) {
        int first = gtaoi_lowest(GM_BITS(active)), k = gtaoi_class(c, keys[first]);
        GM lanes = GM_AND(active, GV_EQ(p->key, GV_SET(keys[first])));
        n = count[k];
        q = c->sample + ((size_t)index * (size_t)c->classes + (size_t)k) * (size_t)c->max_steps;
        gtaoi_range(c, seen, index, q, n, range);
        gtaoi_count_samples(range, 0, n, layers * gtaoi_popcount(GM_BITS(lanes)), stats);
        GTAOI_NAME(gtaoi_search_layers)(c, p, f, s, a, at, index, q, range, GV_IF(lanes, GV_SET((float)n)), x, y);
        active = GM_ANDNOT(active, lanes);
    }
}

/* One slice of a group with a direction and an offset for each pixel. */
GTAOI_FN void GTAOI_NAME(gtaoi_arcs_noise)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                           GTAOI_HORIZONS *s, GTAOI_ARCS *a, GM active, const gtaoi_tile *seen,
                                           gtao_stats *stats) {
    GTAOI_NO_CONTRACT
    const GV zero = GV_SET(0.0f), one = GV_SET(1.0f), limit = GV_SET(1e6f);
    GV unit = GV_MAX(GV_ABS(f->dx), GV_ABS(f->dy)), radius, steps = GV_SET((float)c->max_steps);
    GM along_x = GV_LE(GV_ABS(f->dy), GV_ABS(f->dx));
    float level[GTAOI_W], position[GTAOI_W];
    int i, j, layer, side, n = c->max_steps, taps = c->every_pixel, ring = c->inv_falloff > 0.0f;
    radius = GV_MIN(GV_MAX(GV_DIV(p->extent, GV_SQRT(f->bb)), one), GV_SET(c->max_radius));
    GV_STORE(level, p->offset);
    if (taps)
        steps = GV_MAX(GTAOI_NAME(gtaoi_floor)(GV_MUL(radius, unit)), one);
    steps = GV_IF(active, GV_MIN(steps, limit));
    GV_STORE(position, steps);
    if (seen && !(seen->lo_all <= seen->hi_all)) {
        for (i = 0; i < GTAOI_W; i++)
            stats->samples_skipped += (uint64_t)(2 * (int)position[i] * c->layer_count);
        return;
    }
    for (n = 0, i = 0; i < GTAOI_W; i++) {
        n = gtaoi_imax(n, (int)position[i]);
        stats->samples += (uint64_t)(2 * (int)position[i] * c->layer_count);
    }
    for (layer = 0; layer < c->layer_count; layer++) {
        const float *plane = c->w + 2 * layer * c->plane, *backs = plane + c->plane;
        int clip = c->layer[layer].back && c->bounded;
        GTAOI_WALK walk;
        GV before = zero;
        GTAOI_NAME(gtaoi_begin_walk)(p, layer, &walk);
        for (j = 0; j < n; j++) {
            GV qx, qy, inv, t, gap, half, fraction = zero, l, u;
            if (taps) {
                GV px, py;
                t = GV_DIV(GV_SET((float)(j + 1)), unit), px = GV_MUL(t, f->dx), py = GV_MUL(t, f->dy);
                qx = GV_SELECT(along_x, GTAOI_NAME(gtaoi_nearest)(px), GTAOI_NAME(gtaoi_floor)(px));
                qy = GV_SELECT(along_x, GTAOI_NAME(gtaoi_floor)(py), GTAOI_NAME(gtaoi_nearest)(py));
                fraction = GV_SELECT(along_x, GV_SUB(py, qy), GV_SUB(px, qx));
            } else {
                for (i = 0; i < GTAOI_W; i++)
                    position[i] = c->step[64 * j + (int)level[i]];
                t = GV_ADD(one, GV_MUL(GV_SUB(radius, one), GV_LOAD(position)));
                qx = GTAOI_NAME(gtaoi_nearest)(GV_MUL(t, f->dx));
                qy = GTAOI_NAME(gtaoi_nearest)(GV_MUL(t, f->dy));
                t = GV_SQRT(GV_ADD(GV_MUL(qx, qx), GV_MUL(qy, qy)));
            }
            inv = GV_DIV(one, t);
            gap = GV_MUL(GV_SUB(t, before), GV_SET(c->connect));
            half = GV_MUL(GV_MUL(GV_SET(0.5f), GV_SUB(t, before)), inv);
            before = t;
            for (side = 0; side < 2; side++) {
                GV x = side ? GV_SUB(p->x, qx) : GV_ADD(p->x, qx), y = side ? GV_SUB(p->y, qy) : GV_ADD(p->y, qy);
                GV w = GTAOI_NAME(gtaoi_fetch)(c, plane, x, y), w_back = GTAOI_NAME(gtaoi_fetch)(c, backs, x, y);
                GV ux = GV_MUL(qx, inv), uy = GV_MUL(qy, inv), base, rise, least, w_a = w, w_b = w, bx = x, by = y;
                GM hangs;
                if (taps) {
                    GV step = side ? GV_SET(-1.0f) : one, across = GV_MUL(step, GV_SELECT(along_x, p->gy, p->gx));
                    bx = GV_SELECT(along_x, x, GV_ADD(x, step)), by = GV_SELECT(along_x, GV_ADD(y, step), y);
                    w_b = GTAOI_NAME(gtaoi_fetch)(c, plane, bx, by);
                    w = GTAOI_NAME(gtaoi_between)(c, w_a, w_b, fraction, across, c->orthographic);
                    w_back =
                        GTAOI_NAME(gtaoi_between_backs)(c, w_a, w_b, w_back, GTAOI_NAME(gtaoi_fetch)(c, backs, bx, by),
                                                        fraction, across, c->orthographic);
                    ux = f->dx, uy = f->dy;
                }
                base = GV_ADD(GV_MUL(p->gx, ux), GV_MUL(p->gy, uy));
                base = side ? GV_SUB(GV_MUL(p->w0, inv), base) : GV_ADD(GV_MUL(p->w0, inv), base);
                rise = least = GV_SUB(GV_MUL(w, inv), base);
                if (taps && j < GTAOI_NEAR)
                    least = GV_MIN(rise, GV_MAX(GTAOI_NAME(gtaoi_own_rise)(p, x, y, w_a),
                                                GTAOI_NAME(gtaoi_own_rise)(p, bx, by, w_b)));
                hangs = GTAOI_NAME(gtaoi_visit_column)(c, p, f, a, side, &walk.column[side], &s->rise[side], w, w_back,
                                                       gap, inv, base, rise, least, GV_LT(GV_SET((float)j), steps), &l,
                                                       &u, c->orthographic, c->bounded, ring, clip);
                if (GM_ANY(hangs))
                    a->mask[side] =
                        GTAOI_NAME(gtaoi_hang)(a, &walk.column[side], a->mask[side], hangs, l, u, half, inv);
            }
        }
    }
}

GTAOI_FN void GTAOI_NAME(gtaoi_search_arcs)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                            GTAOI_HORIZONS *s, GTAOI_ARCS *a, const float *at, int index, int k,
                                            GM active, int x, int y, const gtaoi_tile *seen, gtao_stats *stats) {
    GTAOI_NAME(gtaoi_begin_slice_arcs)(c, p, f, k, a);
    if (c->per_pixel_noise)
        GTAOI_NAME(gtaoi_arcs_noise)(c, p, f, s, a, active, seen, stats);
    else
        GTAOI_NAME(gtaoi_arcs_table)(c, p, f, s, a, at, index, active, x, y, seen, stats);
    GTAOI_NAME(gtaoi_absorb)(s, a);
}

/* ---- integrate -------------------------------------------------------------------------------------------------- */

/* atan(q), -1 <= q <= 1; the polynomial of gtao_atan2. */
GTAOI_FI GV GTAOI_NAME(gtaoi_atan)(GV q) {
    GTAOI_NO_CONTRACT
    GV qq = GV_MUL(q, q), q4 = GV_MUL(qq, qq), q8 = GV_MUL(q4, q4), low, high;
    low = GV_ADD(GV_ADD(GV_SET(-0.3333314528f), GV_MUL(qq, GV_SET(0.1999355085f))),
                 GV_MUL(q4, GV_ADD(GV_SET(-0.1420889944f), GV_MUL(qq, GV_SET(0.1065626393f)))));
    high = GV_ADD(GV_ADD(GV_SET(-0.0752896400f), GV_MUL(qq, GV_SET(0.0429096138f))),
                  GV_MUL(q4, GV_ADD(GV_SET(-0.0161657367f), GV_MUL(qq, GV_SET(0.0028662257f)))));
    return GV_ADD(GV_MUL(GV_MUL(GV_ADD(low, GV_MUL(q8, high)), qq), q), q);
}

/* atan2(y, x), the twin of gtao_atan2 but for atan2(0, 0), which is not asked for. */
GTAOI_FI GV GTAOI_NAME(gtaoi_atan2)(GV y, GV x) {
    GTAOI_NO_CONTRACT
    const GV zero = GV_SET(0.0f);
    GV ay = GV_ABS(y), ax = GV_ABS(x), a = GTAOI_NAME(gtaoi_atan)(GV_DIV(GV_MIN(ax, ay), GV_MAX(ax, ay)));
    a = GV_SELECT(GV_LT(ax, ay), GV_SUB(GV_SET(1.57079633f), a), a);
    a = GV_SELECT(GV_LT(x, zero), GV_SUB(GV_SET(3.14159265f), a), a);
    return GV_SELECT(GV_LT(y, zero), GV_SUB(zero, a), a);
}

/* Sums over the slices of a pixel. */
#define GTAOI_SUM GTAOI_NAME(gtaoi_sum)
typedef struct GTAOI_SUM {
    GV visible, open;  /* sum J a, sum J a of an open surface */
    GV jacobian_open;  /* the latter with the Jacobian, whatever the estimator */
    GV bx, by, bz, bv; /* sum J (T_open - T): along the slices, and along the view vector */
    GM occluded;       /* pixels that see anything but sky */
} GTAOI_SUM;

/* cot h of a side from what the search found. */
GTAOI_FI GV GTAOI_NAME(gtaoi_kappa)(const gtao_context *c, const GTAOI_FRAME *f, const GTAOI_HORIZONS *s, int side,
                                    GM *occluded) {
    GTAOI_NO_CONTRACT
    const GV zero = GV_SET(0.0f);
    GV tangent = side ? GV_SUB(zero, f->kappa_tangent) : f->kappa_tangent;
    GV start = side ? GV_SUB(zero, f->cos_tangent) : f->cos_tangent, cosine = s->cosine[side];
    GM above = GV_LT(f->floor, s->rise[side]);
    GV kappa = GV_ADD(GV_MUL(GV_IF(above, s->rise[side]), f->kappa_scale), tangent);
    if (c->cosines || c->inv_falloff > 0.0f) {
        GM faded = GV_LT(start, cosine);
        if (GM_ANY(faded)) {
            GV sine2 = GV_MAX(GV_SUB(GV_SET(1.0f), GV_MUL(cosine, cosine)), GV_SET(1e-12f));
            kappa = GV_SELECT(faded, GV_MAX(GV_DIV(cosine, GV_SQRT(sine2)), kappa), kappa);
            above = GM_OR(above, faded);
        }
    }
    *occluded = GM_OR(*occluded, above);
    return GV_MAX(GV_MIN(kappa, GV_SET(GTAOI_KAPPA_LIMIT)), GV_SET(-GTAOI_KAPPA_LIMIT));
}

/* With s = sin h, c = cos h, both h > 0, and np the normal projected to the slice, n.v = |np| cos n, n.o = |np| sin n:
 *   |np| (a(h0, n) + a(h1, n)) = ((s0^2 + s1^2) n.v + (h1 - h0 - s1 c1 + s0 c0) n.o) / 2       [J19], no angle but one
 *   h1 - h0 = atan2(k0 - k1, 1 + k0 k1),  s^2 = 1 / (1 + k^2),  s c = k / (1 + k^2),  k = cot h
 * and for the bent normal, T = T_o o + T_v v = int V (np.w) w |sin|:
 *   T_o = (s1^3 - s0^3) n.v / 3 + (4/3 - c1 - c0 + (c1^3 + c0^3) / 3) n.o,   T_v = (2 - c1^3 - c0^3) n.v / 3 + (s1^3 -
 *   s0^3) n.o / 3
 * open: |np| (cos n + n sin n),  T_o = 4/3 n.o,  T_v = 2/3 n.v. */
GTAOI_FI void GTAOI_NAME(gtaoi_integrate)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                          const GTAOI_HORIZONS *s, GTAOI_SUM *sum) {
    GTAOI_NO_CONTRACT
    const GV zero = GV_SET(0.0f), one = GV_SET(1.0f), half = GV_SET(0.5f), third = GV_SET(1.0f / 3.0f);
    const GV no = f->no, inv_perp = f->inv_perp;
    int uniform = c->d.weighting == GTAO_WEIGHTING_UNIFORM, memo = c->d.estimator == GTAO_ESTIMATOR_MEMO;
    GM occluded = GV_LT(one, zero);
    GV k1 = GTAOI_NAME(gtaoi_kappa)(c, f, s, 0, &occluded), k0 = GTAOI_NAME(gtaoi_kappa)(c, f, s, 1, &occluded);
    GV jacobian = GV_MUL(inv_perp, inv_perp), weight = memo ? one : jacobian, open = f->open, arc;
    arc = open;
    if (GM_ANY(occluded)) {
        GV rho1 = GV_ADD(one, GV_MUL(k1, k1)), rho0 = GV_ADD(one, GV_MUL(k0, k0));
        GV c1 = zero, c0 = zero, s1 = zero, s0 = zero, both = GV_DIV(one, GV_MUL(rho1, rho0));
        GV ss1 = GV_MUL(both, rho0), ss0 = GV_MUL(both, rho1), between = zero;
        if (uniform || c->bent) {
            s1 = GV_SQRT(ss1), s0 = GV_SQRT(ss0);
            c1 = GV_MUL(k1, s1), c0 = GV_MUL(k0, s0);
        }
        if (!uniform || c->bent) { /* h1 - h0 - s1 c1 + s0 c0 */
            between = GTAOI_NAME(gtaoi_atan2)(GV_SUB(k0, k1), GV_ADD(one, GV_MUL(k0, k1)));
            between = GV_ADD(GV_SUB(between, GV_MUL(k1, ss1)), GV_MUL(k0, ss0));
        }
        if (uniform)
            arc = GV_SUB(GV_SUB(open, c1), c0);
        else
            arc = GV_MUL(half, GV_ADD(GV_MUL(GV_ADD(ss0, ss1), p->nv), GV_MUL(between, no)));
        arc = GV_SELECT(occluded, arc, open);
        if (c->bent) { /* T_open - T, subtracted later from that of the open hemisphere */
            GV to, tv, along;
            if (uniform) { /* T_o = (h1 - h0 - s1 c1 + s0 c0) / 2, T_v = (s0^2 + s1^2) / 2 */
                GV open_v = GV_DIV(one, GV_ADD(one, GV_MUL(f->kappa_tangent, f->kappa_tangent)));
                GV open_o = GV_SUB(GTAOI_NAME(gtaoi_atan2)(no, p->nv), GV_MUL(f->kappa_tangent, open_v));
                to = GV_SUB(open_o, GV_MUL(half, between));
                tv = GV_SUB(open_v, GV_MUL(half, GV_ADD(ss0, ss1)));
            } else {
                GV ds = GV_MUL(third, GV_SUB(GV_MUL(ss1, s1), GV_MUL(ss0, s0)));
                GV c13 = GV_MUL(GV_MUL(c1, c1), c1), c03 = GV_MUL(GV_MUL(c0, c0), c0);
                GV cc = GV_MUL(third, GV_ADD(c13, c03));
                to = GV_SUB(GV_MUL(GV_SUB(GV_ADD(c1, c0), cc), no), GV_MUL(ds, p->nv));
                tv = GV_SUB(GV_MUL(cc, p->nv), GV_MUL(ds, no));
            }
            /* o = (b - along r0 / |r0|) / |b_perp|, along = b.r0 / |r0|. Masked last: the factors may overflow. */
            to = GV_IF(occluded, GV_MUL(to, GV_MUL(jacobian, inv_perp)));
            tv = GV_IF(occluded, GV_MUL(tv, jacobian));
            along = GV_MUL(f->along, p->inv_len);
            sum->bx = GV_ADD(sum->bx, GV_MUL(to, GV_SUB(f->bx, GV_MUL(along, p->rx))));
            sum->by = GV_ADD(sum->by, GV_MUL(to, GV_SUB(f->by, GV_MUL(along, p->ry))));
            sum->bz = GV_SUB(sum->bz, GV_MUL(to, along));
            sum->bv = GV_ADD(sum->bv, tv);
        }
    }
    sum->visible = GV_ADD(sum->visible, GV_MUL(weight, arc));
    sum->open = GV_ADD(sum->open, GV_MUL(weight, open));
    sum->jacobian_open = GV_ADD(sum->jacobian_open, GV_MUL(jacobian, open));
    sum->occluded = GM_OR(sum->occluded, occluded);
}

/* ---- spherical harmonics ----------------------------------------------------------------------------------------- */

/* Sums of second moments over the slices of a pixel, for spherical harmonics: of what a slice lacks to the open one. */
#define GTAOI_MOMENTS GTAOI_NAME(gtaoi_moments)
typedef struct GTAOI_MOMENTS {
    GV lost;                   /* sum J (open - a) */
    GV vv, xv, yv, xx, xy, yy; /* sum J (M_open - M) along v v, q v and q q, q = b / |b_perp|; o is linear in q */
} GTAOI_MOMENTS;

/* M = M_oo o o^T + M_ov (o v^T + v o^T) + M_vv v v^T = int V (np.w) w w^T |sin|, in the terms of gtaoi_integrate,
 * D = h1 - h0 - s1 c1 + s0 c0 and E = D + 2 (s1^3 c1 - s0^3 c0):
 *   M_vv = (2 - c1^4 - c0^4) n.v / 4 + E n.o / 8,   M_ov = E n.v / 8 + (s1^4 + s0^4) n.o / 4,   M_oo = a - M_vv
 * and uniformly weighted M_vv = (2 - c1^3 - c0^3) / 3, M_ov = (s1^3 - s0^3) / 3. Open: s = cos n, c = -+ sin n. */
GTAOI_FI void GTAOI_NAME(gtaoi_lose)(const GTAOI_FRAME *f, GM where, GV lost, GV vv, GV ov, GTAOI_MOMENTS *sum) {
    GTAOI_NO_CONTRACT
    GV jacobian = GV_MUL(f->inv_perp, f->inv_perp), qx = GV_MUL(f->bx, f->inv_perp), qy = GV_MUL(f->by, f->inv_perp);
    GV oo = GV_IF(where, GV_MUL(jacobian, GV_SUB(lost, vv))); /* masked last: the factors may overflow */
    ov = GV_IF(where, GV_MUL(jacobian, ov));
    sum->lost = GV_ADD(sum->lost, GV_IF(where, GV_MUL(jacobian, lost)));
    sum->vv = GV_ADD(sum->vv, GV_IF(where, GV_MUL(jacobian, vv)));
    sum->xv = GV_ADD(sum->xv, GV_IF(where, GV_MUL(ov, qx)));
    sum->yv = GV_ADD(sum->yv, GV_IF(where, GV_MUL(ov, qy)));
    sum->xx = GV_ADD(sum->xx, GV_IF(where, GV_MUL(GV_MUL(oo, qx), qx)));
    sum->xy = GV_ADD(sum->xy, GV_IF(where, GV_MUL(GV_MUL(oo, qx), qy)));
    sum->yy = GV_ADD(sum->yy, GV_IF(where, GV_MUL(GV_MUL(oo, qy), qy)));
}

GTAOI_FN void GTAOI_NAME(gtaoi_integrate_sh)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                             const GTAOI_HORIZONS *s, GTAOI_MOMENTS *sum) {
    GTAOI_NO_CONTRACT
    const GV zero = GV_SET(0.0f), one = GV_SET(1.0f), two = GV_SET(2.0f), quarter = GV_SET(0.25f);
    GM occluded = GV_LT(one, zero);
    GV k1 = GTAOI_NAME(gtaoi_kappa)(c, f, s, 0, &occluded), k0 = GTAOI_NAME(gtaoi_kappa)(c, f, s, 1, &occluded);
    GV ss1, ss0, cc1, cc0, lost, vv, ov;
    if (!GM_ANY(occluded))
        return;
    ss1 = GV_DIV(one, GV_ADD(one, GV_MUL(k1, k1))), ss0 = GV_DIV(one, GV_ADD(one, GV_MUL(k0, k0)));
    cc1 = GV_MUL(GV_MUL(k1, k1), ss1), cc0 = GV_MUL(GV_MUL(k0, k0), ss0);
    if (c->d.weighting == GTAO_WEIGHTING_UNIFORM) {
        GV s1 = GV_SQRT(ss1), s0 = GV_SQRT(ss0), c1 = GV_MUL(k1, s1), c0 = GV_MUL(k0, s0), third = GV_SET(1.0f / 3.0f);
        lost = GV_ADD(c1, c0);
        vv = GV_MUL(third, GV_ADD(GV_MUL(c1, cc1), GV_MUL(c0, cc0)));
        ov = GV_MUL(third, GV_SUB(GV_MUL(s0, ss0), GV_MUL(s1, ss1)));
    } else { /* open - occluded of D, E / 8, s^2 and s^4; t = tan n, sc = sin n cos n, cc = cos^2 n */
        GV t = GV_SUB(zero, f->kappa_tangent), cc = GV_DIV(one, GV_ADD(one, GV_MUL(t, t))), sc = GV_MUL(t, cc);
        GV sc1 = GV_MUL(k1, ss1), sc0 = GV_MUL(k0, ss0), d, e, s2, s4, c4, tsc = GV_MUL(t, sc);
        d = GTAOI_NAME(gtaoi_atan2)(GV_SUB(k0, k1), GV_ADD(one, GV_MUL(k0, k1)));
        d = GV_SUB(GV_MUL(two, GV_ADD(f->n, sc)), GV_ADD(GV_SUB(d, sc1), sc0));
        e = GV_ADD(GV_MUL(two, GV_MUL(sc, cc)), GV_SUB(GV_MUL(sc1, ss1), GV_MUL(sc0, ss0)));
        e = GV_MUL(GV_SET(0.125f), GV_SUB(d, GV_MUL(two, e)));
        s2 = GV_SUB(GV_MUL(two, cc), GV_ADD(ss1, ss0));
        s4 = GV_SUB(GV_MUL(two, GV_MUL(cc, cc)), GV_ADD(GV_MUL(ss1, ss1), GV_MUL(ss0, ss0)));
        c4 = GV_SUB(GV_ADD(GV_MUL(cc1, cc1), GV_MUL(cc0, cc0)), GV_MUL(two, GV_MUL(tsc, tsc)));
        lost = GV_MUL(GV_SET(0.5f), GV_ADD(GV_MUL(s2, p->nv), GV_MUL(d, f->no)));
        vv = GV_ADD(GV_MUL(GV_MUL(quarter, c4), p->nv), GV_MUL(e, f->no));
        ov = GV_ADD(GV_MUL(e, p->nv), GV_MUL(GV_MUL(quarter, s4), f->no));
    }
    GTAOI_NAME(gtaoi_lose)(f, occluded, lost, vv, ov, sum);
}

/* The same of what hangs free above a horizon, between cot h = k0 and k1 > k0 on the side of `sign`. */
GTAOI_FN void GTAOI_NAME(gtaoi_integrate_sh_arc)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                                 GM here, GV sign, GV k0, GV k1, GTAOI_MOMENTS *sum) {
    GTAOI_NO_CONTRACT
    const GV one = GV_SET(1.0f), quarter = GV_SET(0.25f), third = GV_SET(1.0f / 3.0f), no = GV_MUL(sign, f->no);
    GV ss1 = GV_DIV(one, GV_ADD(one, GV_MUL(k1, k1))), ss0 = GV_DIV(one, GV_ADD(one, GV_MUL(k0, k0)));
    GV cc1 = GV_MUL(GV_MUL(k1, k1), ss1), cc0 = GV_MUL(GV_MUL(k0, k0), ss0), lost, vv, ov;
    if (c->d.weighting == GTAO_WEIGHTING_UNIFORM) {
        GV s1 = GV_SQRT(ss1), s0 = GV_SQRT(ss0), c1 = GV_MUL(k1, s1), c0 = GV_MUL(k0, s0);
        lost = GV_SUB(c1, c0);
        vv = GV_MUL(third, GV_SUB(GV_MUL(c1, cc1), GV_MUL(c0, cc0)));
        ov = GV_MUL(third, GV_SUB(GV_MUL(s0, ss0), GV_MUL(s1, ss1)));
    } else {
        GV sc1 = GV_MUL(k1, ss1), sc0 = GV_MUL(k0, ss0), d, e;
        d = GTAOI_NAME(gtaoi_atan2)(GV_SUB(k1, k0), GV_ADD(one, GV_MUL(k0, k1)));
        d = GV_ADD(GV_SUB(d, sc0), sc1);
        e = GV_SUB(GV_MUL(sc0, ss0), GV_MUL(sc1, ss1));
        e = GV_MUL(GV_SET(0.125f), GV_ADD(d, GV_ADD(e, e)));
        lost = GV_MUL(GV_SET(0.5f), GV_ADD(GV_MUL(GV_SUB(ss0, ss1), p->nv), GV_MUL(d, no)));
        vv = GV_MUL(quarter, GV_SUB(GV_MUL(cc1, cc1), GV_MUL(cc0, cc0)));
        vv = GV_ADD(GV_MUL(vv, p->nv), GV_MUL(e, no));
        ov = GV_MUL(quarter, GV_SUB(GV_MUL(ss0, ss0), GV_MUL(ss1, ss1)));
        ov = GV_ADD(GV_MUL(e, p->nv), GV_MUL(ov, no));
    }
    GTAOI_NAME(gtaoi_lose)(f, here, lost, vv, GV_MUL(sign, ov), sum);
}

/* The sums of a pixel to its coefficients. p->n is still the normal. */
GTAOI_FN void GTAOI_NAME(gtaoi_finish_sh)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_SUM *sum,
                                          const GTAOI_MOMENTS *m, GM active, GV sh[9]) {
    GTAOI_NO_CONTRACT
    static const int rows[6] = {0, 1, 2, 0, 1, 0}, columns[6] = {0, 1, 2, 1, 2, 2}; /* xx, yy, zz, xy, yz, xz */
    const GV zero = GV_SET(0.0f), one = GV_SET(1.0f);
    const int cosine = c->d.weighting == GTAO_WEIGHTING_COSINE;
    GV scale = GV_DIV(one, sum->jacobian_open), along = GV_MUL(sum->bv, p->inv_len), n[3], r[3], e[3][3], s[3][3];
    GV lost[10], value[10], size = zero; /* moments: w, then 1, then w w^T */
    GM good;
    int i, j;
    n[0] = p->nx, n[1] = p->ny, n[2] = p->nz;
    r[0] = GV_MUL(p->rx, p->inv_len), r[1] = GV_MUL(p->ry, p->inv_len), r[2] = p->inv_len;
    lost[0] = GV_SUB(sum->bx, GV_MUL(along, p->rx)), lost[1] = GV_SUB(sum->by, GV_MUL(along, p->ry));
    lost[2] = GV_SUB(sum->bz, along), lost[3] = m->lost;
    for (i = 0; i < 3; i++) { /* o = qx e0 + qy e1, v = e2; e0 = x - (x.r) r, r = r0 / |r0| */
        e[0][i] = GV_SUB(i == 0 ? one : zero, GV_MUL(r[0], r[i]));
        e[1][i] = GV_SUB(i == 1 ? one : zero, GV_MUL(r[1], r[i]));
        e[2][i] = GV_SUB(zero, r[i]);
        s[0][i] = GV_ADD(GV_ADD(GV_MUL(m->xx, e[0][i]), GV_MUL(m->xy, e[1][i])), GV_MUL(m->xv, e[2][i]));
        s[1][i] = GV_ADD(GV_ADD(GV_MUL(m->xy, e[0][i]), GV_MUL(m->yy, e[1][i])), GV_MUL(m->yv, e[2][i]));
        s[2][i] = GV_ADD(GV_ADD(GV_MUL(m->xv, e[0][i]), GV_MUL(m->yv, e[1][i])), GV_MUL(m->vv, e[2][i]));
    }
    for (i = 0; i < 6; i++)
        lost[4 + i] = GV_ADD(GV_ADD(GV_MUL(e[0][rows[i]], s[0][columns[i]]), GV_MUL(e[1][rows[i]], s[1][columns[i]])),
                             GV_MUL(e[2][rows[i]], s[2][columns[i]]));
    for (i = 0; i < 10; i++) {
        lost[i] = GV_MUL(scale, lost[i]);
        size = GV_ADD(size, GV_ABS(lost[i]));
    }
    /* What is open has 1, 2/3 n, (I + n n^T) / 4, or uniformly 1, n / 2, I / 3; not finite: as if open. */
    good = GM_AND(GM_AND(active, sum->occluded), GV_LE(size, GV_SET(FLT_MAX)));
    for (i = 0; i < 10; i++) {
        j = i - 4;
        value[i] = i < 3 ? GV_MUL(GV_SET(cosine ? 2.0f / 3.0f : 0.5f), n[i]) : GV_SET(i < 7 ? 1.0f / 3.0f : 0.0f);
        if (i == 3)
            value[i] = one;
        if (i > 3 && cosine)
            value[i] = GV_MUL(GV_SET(0.25f), GV_ADD(GV_MUL(n[rows[j]], n[columns[j]]), i < 7 ? one : zero));
        value[i] = GV_SUB(value[i], GV_IF(good, lost[i]));
    }
    for (i = 0; i < 10; i++) /* no moment is larger than 1 */
        value[i] = GV_MAX(GV_MIN(value[i], one), i == 3 ? zero : GV_SET(-1.0f));
    sh[0] = GV_MUL(GV_SET(GTAOI_SH0), value[3]);
    sh[1] = GV_MUL(GV_SET(GTAOI_SH1), value[1]);
    sh[2] = GV_MUL(GV_SET(GTAOI_SH1), value[2]);
    sh[3] = GV_MUL(GV_SET(GTAOI_SH1), value[0]);
    sh[4] = GV_MUL(GV_SET(GTAOI_SH2), value[7]);
    sh[5] = GV_MUL(GV_SET(GTAOI_SH2), value[8]);
    sh[6] = GV_MUL(GV_SET(GTAOI_SH20), GV_SUB(GV_MUL(GV_SET(3.0f), value[6]), value[3]));
    sh[7] = GV_MUL(GV_SET(GTAOI_SH2), value[9]);
    sh[8] = GV_MUL(GV_SET(0.5f * GTAOI_SH2), GV_SUB(value[4], value[5]));
}

/* The signal's weight: the sum of the slices' Jacobians. */
GTAOI_FI GV GTAOI_NAME(gtaoi_weight)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_SUM *sum, GM active) {
    GTAOI_NO_CONTRACT
    const GV one = GV_SET(1.0f);
    GV weight = GV_MUL(GV_MUL(sum->jacobian_open, p->inv_len), GV_SET(c->weight_scale));
    weight = GV_MIN(GV_MAX(weight, GV_SET(1e-3f)), GV_SET(1e3f));
    return c->d.estimator == GTAO_ESTIMATOR_MEMO ? one : GV_SELECT(active, weight, one);
}

/* Slices that join those of the planes at (x, y): what part of the whole they are, and the whole's weight. Weights that
 * are 1 for any number of slices (the memo's estimator) do not tell. */
GTAOI_FN void GTAOI_NAME(gtaoi_part)(const gtao_context *c, int x, int y, const GV *weight, GV *part, GV *whole) {
    GTAOI_NO_CONTRACT
    const char *row = (const char *)c->o.signal + c->o.signal_plane_stride + (ptrdiff_t)y * c->o.signal_stride;
    int g, memo = c->d.estimator == GTAO_ESTIMATOR_MEMO;
    GTAOI_NAME(gtaoi_load4)((const float *)(const void *)row + x, 4, whole);
    for (g = 0; g < 4; g++) {
        whole[g] = memo ? weight[g] : GV_ADD(whole[g], weight[g]);
        part[g] = memo ? GV_SET((float)c->slices / (float)(c->before + c->slices)) : GV_DIV(weight[g], whole[g]);
    }
}

/* Four groups' values of a plane joined with what it has: equal ones stay as they are. */
GTAOI_FI void GTAOI_NAME(gtaoi_average)(const float *before_at, const GV *part, GV *values) {
    GTAOI_NO_CONTRACT
    GV before[4];
    int g;
    GTAOI_NAME(gtaoi_load4)(before_at, 4, before);
    for (g = 0; g < 4; g++)
        values[g] = GV_ADD(before[g], GV_MUL(part[g], GV_SUB(values[g], before[g])));
}

/* The coefficients of a block of pixels, as in gtaoi_visibility, to the caller's planes. */
GTAOI_FN void GTAOI_NAME(gtaoi_store_sh)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_SUM *sum,
                                         const GTAOI_MOMENTS *m, const GM *active, int groups, int x, int y,
                                         int count) {
    float image[4 * GTAOI_W];
    GV sh[4][9], plane[4], part[4], whole[4];
    int i, g, from = gtaoi_imax(c->x_begin - x, 0), to = gtaoi_imin(count, c->x_end - x);
    for (g = 0; g < groups; g++) {
        GTAOI_NAME(gtaoi_finish_sh)(c, p + g, sum + g, m + g, active[g], sh[g]);
        plane[g] = GTAOI_NAME(gtaoi_weight)(c, p + g, sum + g, active[g]);
    }
    if (c->before)
        GTAOI_NAME(gtaoi_part)(c, x, y, plane, part, whole);
    for (i = 0; i < gtaoi_sh_count(&c->o); i++) {
        char *row = (char *)c->o.sh + (ptrdiff_t)i * c->o.sh_plane_stride + (ptrdiff_t)y * c->o.sh_stride;
        for (g = 0; g < groups; g++) {
            plane[g] = sh[g][i];
            if (c->period != 4)
                GV_STORE(image + g * GTAOI_W, plane[g]);
        }
        if (c->before)
            GTAOI_NAME(gtaoi_average)((const float *)(const void *)row + x, part, plane);
        if (c->period == 4)
            GTAOI_NAME(gtaoi_store4)(image, 4, plane);
        if (from < to)
            memcpy(row + (ptrdiff_t)(x + from) * 4, image + from, (size_t)(to - from) * 4);
    }
}

/* Takes what hangs free above the horizons off the sums: run by run of the masks, each an interval [k0, k1] of cot h on
 * one side, with the formulas of gtaoi_integrate for two horizons on that side. */
GTAOI_FN void GTAOI_NAME(gtaoi_integrate_arcs)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                               const GTAOI_ARCS *a, GTAOI_SUM *sum, GTAOI_MOMENTS *moments) {
    GTAOI_NO_CONTRACT
    const GV zero = GV_SET(0.0f), one = GV_SET(1.0f), half = GV_SET(0.5f), third = GV_SET(1.0f / 3.0f);
    const GV limit = GV_SET(GTAOI_KAPPA_LIMIT), jacobian = GV_MUL(f->inv_perp, f->inv_perp);
    int uniform = c->d.weighting == GTAO_WEIGHTING_UNIFORM;
    GI mask = a->mask[0], other = a->mask[1];
    GV sign = one;
    for (;;) {
        GM first_done = GI_IS_ZERO(mask), here;
        GV tangent, no, k0, k1, ss0, ss1, between, arc;
        GI low, rest, after;
        mask = GI_SELECT(first_done, other, mask);
        other = GI_SELECT(first_done, GI_SET(0u), other);
        sign = GV_SELECT(first_done, GV_SET(-1.0f), sign);
        here = GI_IS_ZERO(mask);
        if (GM_BITS(here) == GTAOI_ALL)
            break;
        here = GM_ANDNOT(GV_LE(zero, zero), here);
        low = GI_AND(mask, GI_ADD(GI_ANDNOT(GI_SET(0xffffffffu), mask), GI_SET(1u)));
        rest = GI_ADD(mask, low);
        after = GI_ANDNOT(rest, mask);
        k0 = GTAOI_NAME(gtaoi_border)(a, GI_INDEX(low));
        k1 = GTAOI_NAME(gtaoi_border)(a, GV_SELECT(GI_IS_ZERO(after), GV_SET((float)GTAOI_SECTORS), GI_INDEX(after)));
        mask = GI_AND(mask, rest);
        tangent = GV_MUL(sign, f->kappa_tangent), no = GV_MUL(sign, f->no);
        k0 = GV_MAX(GV_MIN(GV_ADD(GV_MUL(k0, f->kappa_scale), tangent), limit), GV_SUB(zero, limit));
        k1 = GV_MAX(GV_MIN(GV_ADD(GV_MUL(k1, f->kappa_scale), tangent), limit), GV_SUB(zero, limit));
        ss0 = GV_DIV(one, GV_ADD(one, GV_MUL(k0, k0))), ss1 = GV_DIV(one, GV_ADD(one, GV_MUL(k1, k1)));
        between = zero;
        if (!uniform || c->bent) {
            between = GTAOI_NAME(gtaoi_atan2)(GV_SUB(k1, k0), GV_ADD(one, GV_MUL(k0, k1)));
            between = GV_ADD(GV_SUB(between, GV_MUL(k0, ss0)), GV_MUL(k1, ss1));
        }
        arc = GV_MUL(half, GV_ADD(GV_MUL(GV_SUB(ss0, ss1), p->nv), GV_MUL(between, no)));
        if (uniform || c->bent) {
            GV s0 = GV_SQRT(ss0), s1 = GV_SQRT(ss1), c0 = GV_MUL(k0, s0), c1 = GV_MUL(k1, s1), to, tv, along;
            if (uniform) {
                arc = GV_SUB(c1, c0);
                to = GV_MUL(half, between), tv = GV_MUL(half, GV_SUB(ss0, ss1));
            } else {
                GV ds = GV_MUL(third, GV_SUB(GV_MUL(ss0, s0), GV_MUL(ss1, s1)));
                GV cc = GV_MUL(third, GV_SUB(GV_MUL(GV_MUL(c1, c1), c1), GV_MUL(GV_MUL(c0, c0), c0)));
                to = GV_ADD(GV_MUL(ds, p->nv), GV_MUL(GV_SUB(GV_SUB(c1, c0), cc), no));
                tv = GV_ADD(GV_MUL(cc, p->nv), GV_MUL(ds, no));
            }
            to = GV_IF(here, GV_MUL(GV_MUL(to, sign), GV_MUL(jacobian, f->inv_perp)));
            tv = GV_IF(here, GV_MUL(tv, jacobian));
            along = GV_MUL(f->along, p->inv_len);
            sum->bx = GV_ADD(sum->bx, GV_MUL(to, GV_SUB(f->bx, GV_MUL(along, p->rx))));
            sum->by = GV_ADD(sum->by, GV_MUL(to, GV_SUB(f->by, GV_MUL(along, p->ry))));
            sum->bz = GV_SUB(sum->bz, GV_MUL(to, along));
            sum->bv = GV_ADD(sum->bv, tv);
        }
        if (moments)
            GTAOI_NAME(gtaoi_integrate_sh_arc)(c, p, f, here, sign, k0, k1, moments);
        sum->visible = GV_SUB(sum->visible, GV_IF(here, GV_MUL(jacobian, arc)));
        sum->occluded = GM_OR(sum->occluded, here);
    }
}

/* ---- normals ---------------------------------------------------------------------------------------------------- */

/* Derivative of w along one axis: of the two sides the one whose next pixel it predicts better; zero if neither side
 * is there. `has` is false outside the image. `error`: by how much it misses. */
GTAOI_FI GV GTAOI_NAME(gtaoi_gradient)(GV w0, GV a1, GV a2, GV b1, GV b2, GM has_a, GM has_b, GV *error) {
    GTAOI_NO_CONTRACT
    const GV limit = GV_SET(GTAOI_SKY_LIMIT), far_off = GV_SET(FLT_MAX);
    GV ga = GV_SUB(w0, a1), gb = GV_SUB(b1, w0);
    GV ea = GV_SELECT(GV_LT(limit, a2), GV_ABS(GV_SUB(GV_SUB(a1, a2), ga)), GV_ABS(ga));
    GV eb = GV_SELECT(GV_LT(limit, b2), GV_ABS(GV_SUB(GV_SUB(b2, b1), gb)), GV_ABS(gb));
    has_a = GM_AND(has_a, GV_LT(limit, a1));
    has_b = GM_AND(has_b, GV_LT(limit, b1));
    ga = GV_IF(has_a, ga), gb = GV_IF(has_b, gb);
    ea = GV_SELECT(has_a, ea, far_off), eb = GV_SELECT(has_b, eb, far_off);
    *error = GV_MIN(ea, eb);
    return GV_SELECT(GV_LT(ea, eb), ga, GV_SELECT(GV_LT(eb, ea), gb, GV_MUL(GV_SET(0.5f), GV_ADD(ga, gb))));
}

/* The normal of the surface w = w0 + g.q: n = -(fx gx, fy gy, w0 - g.(x - c)), normalised; orthographic -(g / size, 1).
 * */
GTAOI_FN void GTAOI_NAME(gtaoi_derive_normals)(const gtao_context *c, GTAOI_PIXEL *p, const float *at, int phase, int y,
                                               GM here) {
    GTAOI_NO_CONTRACT
    const GV zero = GV_SET(0.0f), one = GV_SET(1.0f), w = GV_SET((float)c->d.width);
    int wrap = c->d.border == GTAO_BORDER_WRAP, h = c->d.height, i;
    ptrdiff_t x_at = at - gtaoi_row(c, y);
    const float *rows[5];
    GV gx, gy, nx, ny, nz, len2, scale, unused;
    GM always = GV_LE(zero, zero), valid;
    for (i = -2; i <= 2; i++)
        rows[i + 2] =
            (wrap || (y + i >= 0 && y + i < h) ? gtaoi_row(c, y + i) : c->w + (ptrdiff_t)(h + 1) * c->pitch) + x_at;
    gx = GTAOI_NAME(gtaoi_gradient)(p->w0, GV_LOAD(at + gtaoi_tap(c, phase, -1, 0)),
                                    GV_LOAD(at + gtaoi_tap(c, phase, -2, 0)), GV_LOAD(at + gtaoi_tap(c, phase, 1, 0)),
                                    GV_LOAD(at + gtaoi_tap(c, phase, 2, 0)), wrap ? always : GV_LE(one, p->x),
                                    wrap ? always : GV_LT(GV_ADD(p->x, one), w), &unused);
    gy = GTAOI_NAME(gtaoi_gradient)(p->w0, GV_LOAD(rows[1]), GV_LOAD(rows[0]), GV_LOAD(rows[3]), GV_LOAD(rows[4]),
                                    always, always, &unused);
    nx = GV_DIV(gx, GV_SET(c->bx1)), ny = GV_DIV(gy, GV_SET(c->by1)), nz = one;
    if (!c->orthographic)
        nz = GV_SUB(GV_SUB(p->w0, GV_MUL(nx, p->rx)), GV_MUL(ny, p->ry));
    len2 = GV_ADD(GV_ADD(GV_MUL(nx, nx), GV_MUL(ny, ny)), GV_MUL(nz, nz));
    valid = GM_AND(GV_LT(zero, len2), GV_LE(len2, GV_SET(FLT_MAX)));
    scale = GV_DIV(GV_SET(-1.0f), GV_SQRT(len2));
    /* where nothing can be told: towards the eye */
    nx = GV_SELECT(valid, GV_MUL(nx, scale), GV_SUB(zero, GV_MUL(p->rx, p->inv_len)));
    ny = GV_SELECT(valid, GV_MUL(ny, scale), GV_SUB(zero, GV_MUL(p->ry, p->inv_len)));
    nz = GV_SELECT(valid, GV_MUL(nz, scale), GV_SUB(zero, p->inv_len));
    p->nx = GV_SELECT(here, nx, p->nx), p->ny = GV_SELECT(here, ny, p->ny), p->nz = GV_SELECT(here, nz, p->nz);
}

/* The caller's normals of a block of `count` pixels to lanes, [group][component]. Lanes past the count repeat the last
 * pixel. */
GTAOI_FN void GTAOI_NAME(gtaoi_read_normals)(const float *from, int components, int period, int count, GV n[12]) {
    float lanes[GTAOI_W];
    int i, k, g, step = period == 4 ? 1 : GTAOI_W;
    if (count == 4 * GTAOI_W && period == 4 && components == 3) {
        for (k = 0; k < 3; k++)
            GTAOI_NAME(gtaoi_load4)(from + 4 * k, 12, n + 4 * k);
        return;
    }
    for (g = 0; g < 4; g++) {
        if (count == 4 * GTAOI_W && components == 4) {
            GV pixel[4];
            GTAOI_NAME(gtaoi_load4)(from + 4 * g * step, 4 * period, pixel);
            for (k = 0; k < 3; k++)
                n[3 * g + k] = pixel[k];
            continue;
        }
        for (k = 0; k < 3; k++) {
            for (i = 0; i < GTAOI_W; i++)
                lanes[i] = from[gtaoi_imin(g * step + i * period, count - 1) * components + k];
            n[3 * g + k] = GV_LOAD(lanes);
        }
    }
}

/* Normals to view space, unit length (to GTAOI_UNIT if they come so); the pixels that have none. */
GTAOI_FI GM GTAOI_NAME(gtaoi_load_normals)(const gtao_context *c, GTAOI_PIXEL *p, GV nx, GV ny, GV nz) {
    GTAOI_NO_CONTRACT
    const GV zero = GV_SET(0.0f), one = GV_SET(1.0f);
    const float *m = c->to_view;
    GV len2;
    GM missing, scaled;
    if (c->transform_normals) {
        GV tx = nx, ty = ny, tz = nz;
        nx = GV_ADD(GV_ADD(GV_MUL(GV_SET(m[0]), tx), GV_MUL(GV_SET(m[1]), ty)), GV_MUL(GV_SET(m[2]), tz));
        ny = GV_ADD(GV_ADD(GV_MUL(GV_SET(m[3]), tx), GV_MUL(GV_SET(m[4]), ty)), GV_MUL(GV_SET(m[5]), tz));
        nz = GV_ADD(GV_ADD(GV_MUL(GV_SET(m[6]), tx), GV_MUL(GV_SET(m[7]), ty)), GV_MUL(GV_SET(m[8]), tz));
    }
    len2 = GV_ADD(GV_ADD(GV_MUL(nx, nx), GV_MUL(ny, ny)), GV_MUL(nz, nz));
    scaled = GM_ANDNOT(GV_LE(zero, zero), GV_LE(GV_ABS(GV_SUB(len2, one)), GV_SET(GTAOI_UNIT))); /* NaN too */
    missing = GV_LT(one, zero);
    if (GM_ANY(scaled)) {
        GV scale = GV_DIV(one, GV_SQRT(len2));
        missing = GM_ANDNOT(scaled, GM_AND(GV_LE(GV_SET(1e-30f), len2), GV_LE(len2, GV_SET(FLT_MAX))));
        nx = GV_SELECT(scaled, GV_MUL(nx, scale), nx), ny = GV_SELECT(scaled, GV_MUL(ny, scale), ny);
        nz = GV_SELECT(scaled, GV_MUL(nz, scale), nz);
    }
    p->nx = nx, p->ny = ny, p->nz = nz;
    return missing;
}

/* n.v, with normals that face away tilted until they just face the eye; the tangent plane's gradient. */
GTAOI_FI void GTAOI_NAME(gtaoi_face)(const gtao_context *c, GTAOI_PIXEL *p, GM active) {
    GTAOI_NO_CONTRACT
    const GV zero = GV_SET(0.0f), least = GV_SET(GTAOI_FACING_MIN);
    GV nr = GV_ADD(GV_ADD(GV_MUL(p->nx, p->rx), GV_MUL(p->ny, p->ry)), p->nz), scale;
    GM away;
    p->nv = GV_SUB(zero, GV_MUL(nr, p->inv_len));
    away = GM_AND(active, GV_LT(p->nv, least));
    if (GM_ANY(away)) {
        GV lift = GV_MUL(GV_SUB(least, p->nv), p->inv_len);
        GV nx = GV_SUB(p->nx, GV_MUL(lift, p->rx)), ny = GV_SUB(p->ny, GV_MUL(lift, p->ry)), nz = GV_SUB(p->nz, lift);
        GV len2 = GV_ADD(GV_ADD(GV_MUL(nx, nx), GV_MUL(ny, ny)), GV_MUL(nz, nz));
        GM valid = GV_LE(GV_SET(1e-12f), len2); /* straight away from the eye: towards it */
        scale = GV_DIV(GV_SET(1.0f), GV_SQRT(len2));
        nx = GV_SELECT(valid, GV_MUL(nx, scale), GV_SUB(zero, GV_MUL(p->rx, p->inv_len)));
        ny = GV_SELECT(valid, GV_MUL(ny, scale), GV_SUB(zero, GV_MUL(p->ry, p->inv_len)));
        nz = GV_SELECT(valid, GV_MUL(nz, scale), GV_SUB(zero, p->inv_len));
        p->nx = GV_SELECT(away, nx, p->nx), p->ny = GV_SELECT(away, ny, p->ny), p->nz = GV_SELECT(away, nz, p->nz);
        nr = GV_ADD(GV_ADD(GV_MUL(p->nx, p->rx), GV_MUL(p->ny, p->ry)), p->nz);
        p->nv = GV_MAX(GV_SUB(zero, GV_MUL(nr, p->inv_len)), GV_MUL(GV_SET(0.5f), least));
    }
    p->inv_nv = GV_DIV(GV_SET(1.0f), p->nv);
    /* g = w0 / (n.r0) (nx / fx, ny / fy), n.r0 = -|r0| n.v; orthographic (nx, ny sy / sx) / nz */
    scale = GV_SUB(zero, GV_MUL(p->inv_nv, p->inv_len));
    if (!c->orthographic)
        scale = GV_MUL(scale, p->w0);
    p->gx = GV_MUL(scale, GV_MUL(p->nx, GV_SET(c->bx1)));
    p->gy = GV_MUL(scale, GV_MUL(p->ny, GV_SET(c->by1)));
}

/* ---- rows ------------------------------------------------------------------------------------------------------- */

/* Rays, distances and normals of a group; which of its pixels are to be computed. `want` is positive where a result is
 * wanted, negative outside the image. */
GTAOI_FI GM GTAOI_NAME(gtaoi_setup)(const gtao_context *c, GTAOI_PIXEL *p, const float *at, int x, int y, GV want,
                                    const GV *normals, gtao_stats *stats) {
    GTAOI_NO_CONTRACT
    const GV zero = GV_SET(0.0f), one = GV_SET(1.0f);
    GM inside = GV_LE(zero, want), solid, active, near_enough;
    p->w0 = GV_LOAD(at);
    p->x = GV_ADD(GV_SET((float)x), GV_MUL(GTAOI_NAME(gtaoi_iota)(), GV_SET((float)c->period)));
    p->y = GV_SET((float)y);
    solid = GM_AND(inside, GV_LT(GV_SET(GTAOI_SKY_LIMIT), p->w0));
    active = GM_AND(solid, GV_LT(zero, want));
    if (c->orthographic) {
        p->rx = p->ry = zero, p->len = p->inv_len = p->inv_w0 = one;
        p->extent = GV_SET(c->reach);
    } else {
        GV rr;
        p->rx = GV_MUL(GV_SUB(GV_ADD(p->x, GV_SET(0.5f)), GV_SET(c->cx)), GV_SET(c->bx1));
        p->rx = GV_MAX(GV_MIN(p->rx, GV_SET(GTAOI_RAY_LIMIT)), GV_SET(-GTAOI_RAY_LIMIT));
        p->ry = GV_SET(gtaoi_clamp(((float)y + 0.5f - c->cy) * c->by1, -GTAOI_RAY_LIMIT, GTAOI_RAY_LIMIT));
        rr = GV_ADD(GV_ADD(GV_MUL(p->rx, p->rx), GV_MUL(p->ry, p->ry)), one);
        p->len = GV_SQRT(rr), p->inv_len = GV_DIV(one, p->len);
        p->w0 = GV_SELECT(solid, p->w0, one);
        p->inv_w0 = GV_DIV(one, p->w0);
        p->extent = c->bounded ? GV_MUL(GV_MUL(p->w0, p->len), GV_SET(c->reach)) : GV_SET(c->extent_max);
        if (c->bounded && c->every_pixel) {
            /* The whole sphere: its silhouette, at angle a about r0 with sin a = radius / |P|, lies farthest from the
             * pixel away from the image centre: |r0| tan a / (1/|r0| - tan a sqrt(1 - 1/|r0|^2)). */
            GV sine = GV_MUL(GV_MUL(p->w0, p->inv_len), GV_SET(c->reach)), tangent, room;
            tangent = GV_DIV(sine, GV_SQRT(GV_SUB(one, GV_MUL(sine, sine))));
            room = GV_MUL(tangent, GV_SQRT(GV_MAX(GV_SUB(one, GV_MUL(p->inv_len, p->inv_len)), zero)));
            room = GV_SUB(p->inv_len, room);
            p->extent = GV_SELECT(GM_AND(GV_LT(sine, one), GV_LT(zero, room)), GV_DIV(GV_MUL(p->len, tangent), room),
                                  GV_SET(c->extent_max));
        }
    }
    if (GM_BITS(active) != GTAOI_ALL) {
        stats->sky += (uint64_t)gtaoi_popcount(GM_BITS(GM_ANDNOT(inside, solid)));
        stats->masked += (uint64_t)gtaoi_popcount(GM_BITS(GM_ANDNOT(solid, active)));
    }
    near_enough = GV_LE(GV_SET(c->extent_min), p->extent);
    if (GM_BITS(near_enough) != GTAOI_ALL)
        stats->small_radius += (uint64_t)gtaoi_popcount(GM_BITS(GM_ANDNOT(active, near_enough)));
    active = GM_AND(active, near_enough);

    p->nx = p->ny = p->nz = zero;
    if (c->bent || GM_ANY(active)) {
        GTAOI_PIXEL copy;
        GM missing = GV_LE(zero, zero);
        if (normals)
            missing = GTAOI_NAME(gtaoi_load_normals)(c, p, normals[0], normals[1], normals[2]);
        if (GM_ANY(GM_AND(missing, solid))) {
            stats->derived_normals += (uint64_t)gtaoi_popcount(GM_BITS(GM_AND(missing, active)));
            copy = *p; /* so that the pixels themselves need not lie in memory */
            GTAOI_NAME(gtaoi_derive_normals)(c, &copy, at, x & (c->period - 1), y, GM_AND(missing, solid));
            p->nx = copy.nx, p->ny = copy.ny, p->nz = copy.nz;
        }
        missing = GM_ANDNOT(missing, solid); /* sky without a normal: towards the eye */
        if (GM_ANY(missing)) {
            p->nx = GV_SELECT(missing, GV_SUB(zero, GV_MUL(p->rx, p->inv_len)), p->nx);
            p->ny = GV_SELECT(missing, GV_SUB(zero, GV_MUL(p->ry, p->inv_len)), p->ny);
            p->nz = GV_SELECT(missing, GV_SUB(zero, p->inv_len), p->nz);
        }
    }
    if (GM_ANY(active)) {
        GV extent = GV_MIN(GV_MAX(p->extent, GV_SET(c->extent_min)), GV_SET(c->extent_max));
        GTAOI_NAME(gtaoi_face)(c, p, active);
        p->key = GV_CLASS(extent);
        p->direction = p->offset = zero;
        if (c->per_pixel_noise) {
            const float *noise = c->noise + 2 * (y & 63) * (64 + GTAOI_LANES) + (x & 63);
            p->direction = GV_LOAD(noise), p->offset = GV_LOAD(noise + 64 + GTAOI_LANES);
        }
    }
    return active;
}

/* Direction of slice k at each pixel of per-pixel noise: pi (k + direction) / slices. */
GTAOI_FI void GTAOI_NAME(gtaoi_turn)(const gtao_context *c, const GTAOI_PIXEL *p, int k, GTAOI_FRAME *f) {
    GTAOI_NO_CONTRACT
    const GV one = GV_SET(1.0f);
    /* sin(pi u) = cos(pi (u - 1/2)), cos(pi u) = -sin(pi (u - 1/2)) by Taylor's series; error 1e-7 */
    GV a = GV_DIV(GV_ADD(GV_SET((float)k), p->direction), GV_SET((float)c->slices)), aa, sine, cosine;
    a = GV_MUL(GV_SET((float)GTAOI_PI), GV_SUB(a, GV_SET(0.5f)));
    aa = GV_MUL(a, a);
    sine = GV_ADD(GV_SET(2.7557319e-6f), GV_MUL(aa, GV_SET(-2.5052108e-8f)));
    sine = GV_ADD(GV_SET(-1.9841270e-4f), GV_MUL(aa, sine));
    sine = GV_ADD(GV_SET(8.3333333e-3f), GV_MUL(aa, sine));
    sine = GV_ADD(GV_SET(-1.6666667e-1f), GV_MUL(aa, sine));
    sine = GV_ADD(a, GV_MUL(GV_MUL(a, aa), sine));
    cosine = GV_ADD(GV_SET(-2.7557319e-7f), GV_MUL(aa, GV_SET(2.0876757e-9f)));
    cosine = GV_ADD(GV_SET(2.4801587e-5f), GV_MUL(aa, cosine));
    cosine = GV_ADD(GV_SET(-1.3888889e-3f), GV_MUL(aa, cosine));
    cosine = GV_ADD(GV_SET(4.1666667e-2f), GV_MUL(aa, cosine));
    cosine = GV_ADD(GV_SET(-0.5f), GV_MUL(aa, cosine));
    cosine = GV_ADD(one, GV_MUL(aa, cosine));
    f->dx = GV_SUB(GV_SET(0.0f), sine), f->dy = cosine;
    f->bx = GV_MUL(f->dx, GV_SET(c->bx1)), f->by = GV_MUL(f->dy, GV_SET(c->by1));
    f->bb = GV_ADD(GV_MUL(f->bx, f->bx), GV_MUL(f->by, f->by));
}

/* A slice in the pixels' view: o = b_perp / |b_perp|, b_perp = b - (b.v) v; tan n = n.o / n.v; the open arc. */
GTAOI_FI void GTAOI_NAME(gtaoi_slice)(const gtao_context *c, const GTAOI_PIXEL *p, const gtaoi_slice *slice, int k,
                                      GTAOI_FRAME *f, GTAOI_HORIZONS *s) {
    GTAOI_NO_CONTRACT
    const GV zero = GV_SET(0.0f), one = GV_SET(1.0f);
    GV perp2, perp, tangent, np;
    if (c->per_pixel_noise) {
        GTAOI_NAME(gtaoi_turn)(c, p, k, f);
    } else {
        f->dx = GV_SET(slice->dx), f->dy = GV_SET(slice->dy);
        f->bx = GV_SET(slice->bx), f->by = GV_SET(slice->by), f->bb = GV_SET(slice->bb);
    }
    if (c->orthographic && !c->per_pixel_noise) { /* b_perp = b; the same bits */
        float length = sqrtf(slice->bb);
        f->along = zero;
        perp = GV_SET(length), f->inv_perp = GV_SET(1.0f / length);
        f->no = GV_MUL(GV_ADD(GV_MUL(p->nx, f->bx), GV_MUL(p->ny, f->by)), f->inv_perp);
    } else {
        f->along = GV_MUL(GV_ADD(GV_MUL(f->bx, p->rx), GV_MUL(f->by, p->ry)), p->inv_len);
        perp2 = GV_MAX(GV_SUB(f->bb, GV_MUL(f->along, f->along)), GV_MUL(f->bb, GV_SET(1e-6f)));
        perp = GV_SQRT(perp2);
        f->inv_perp = GV_DIV(one, perp);
        f->no =
            GV_MUL(GV_ADD(GV_ADD(GV_MUL(p->nx, f->bx), GV_MUL(p->ny, f->by)), GV_MUL(f->along, p->nv)), f->inv_perp);
    }
    tangent = GV_MUL(f->no, p->inv_nv);
    f->kappa_tangent = GV_SUB(zero, tangent);
    f->kappa_scale = GV_MUL(GV_MUL(p->len, p->inv_w0), f->inv_perp);
    f->reach = GV_MUL(GV_SET(c->reach), f->inv_perp);
    f->floor = GV_MUL(GV_MUL(perp, GV_SET(c->rise_min)), c->orthographic ? one : GV_MUL(p->w0, p->inv_len));
    f->cos_tangent = s->cosine[0] = s->cosine[1] = zero;
    np = GV_SQRT(GV_ADD(GV_MUL(p->nv, p->nv), GV_MUL(f->no, f->no)));
    if (c->cosines || c->inv_falloff > 0.0f) {
        s->cosine[1] = GV_DIV(f->no, np);
        s->cosine[0] = f->cos_tangent = GV_SUB(zero, s->cosine[1]);
    }
    s->rise[0] = s->rise[1] = f->floor;
    f->n = zero, f->open = GV_SET(2.0f);
    if (c->d.weighting == GTAO_WEIGHTING_COSINE) { /* tan(n / 2) = sin n / (1 + cos n) */
        f->n = GTAOI_NAME(gtaoi_atan)(GV_DIV(f->no, GV_ADD(np, p->nv)));
        f->n = GV_ADD(f->n, f->n);
        f->open = GV_ADD(p->nv, GV_MUL(f->n, f->no));
    }
}

/* The sums of a pixel to its visibility, its bent normal (p->n) and, at signal[0], [4], ..., the signal's other planes.
 */
GTAOI_FI GV GTAOI_NAME(gtaoi_finish)(const gtao_context *c, GTAOI_PIXEL *p, const GTAOI_SUM *sum, GM active,
                                     GV *signal) {
    GTAOI_NO_CONTRACT
    const GV zero = GV_SET(0.0f), one = GV_SET(1.0f);
    int cosine_weighted = c->d.weighting == GTAO_WEIGHTING_COSINE;
    GV open =
        c->d.estimator == GTAO_ESTIMATOR_MEMO ? GV_SET((float)c->slices * (cosine_weighted ? 1.0f : 2.0f)) : sum->open;
    GV visible = GV_DIV(sum->visible, open);
    GM good = GV_LE(zero, GV_ABS(visible)); /* not NaN */
    visible = GV_SELECT(good, GV_MIN(GV_MAX(visible, zero), one), one);
    visible = GV_SELECT(active, visible, one);
    if (c->signal)
        signal[0] = GTAOI_NAME(gtaoi_weight)(c, p, sum, active);
    if (c->bent) {
        /* [J19 Eq. 20-21] exact off axis: b = (2/3) n - sum J ((T_open - T)_o o + (T_open - T)_v v) / sum J a_open */
        GV share = GV_SET(cosine_weighted ? 2.0f / 3.0f : 0.5f), scale = GV_DIV(one, sum->jacobian_open), len2;
        GV along = GV_MUL(sum->bv, p->inv_len);
        GV bx = GV_SUB(GV_MUL(share, p->nx), GV_MUL(scale, GV_SUB(sum->bx, GV_MUL(along, p->rx))));
        GV by = GV_SUB(GV_MUL(share, p->ny), GV_MUL(scale, GV_SUB(sum->by, GV_MUL(along, p->ry))));
        GV bz = GV_SUB(GV_MUL(share, p->nz), GV_MUL(scale, GV_SUB(sum->bz, along)));
        len2 = GV_ADD(GV_ADD(GV_MUL(bx, bx), GV_MUL(by, by)), GV_MUL(bz, bz));
        scale = GV_DIV(one, GV_SQRT(len2));
        /* nothing visible, or not finite: the normal */
        good = GM_AND(GM_AND(active, sum->occluded), GM_AND(GV_LE(GV_SET(1e-12f), len2), GV_LE(len2, GV_SET(FLT_MAX))));
        if (c->signal == 5) {
            signal[4] = GV_SELECT(good, bx, GV_MUL(share, p->nx));
            signal[8] = GV_SELECT(good, by, GV_MUL(share, p->ny));
            signal[12] = GV_SELECT(good, bz, GV_MUL(share, p->nz));
        }
        p->nx = GV_SELECT(good, GV_MUL(bx, scale), p->nx);
        p->ny = GV_SELECT(good, GV_MUL(by, scale), p->ny);
        p->nz = GV_SELECT(good, GV_MUL(bz, scale), p->nz);
    }
    return visible;
}

/* ---- the sweep -------------------------------------------------------------------------------------------------- */

/* out[j][i] = in[i][j] of 16 x 16. */
GTAOI_FI void GTAOI_NAME(gtaoi_turn16)(const float *in, float *out, ptrdiff_t pitch) {
    int i, j, k;
    for (i = 0; i < GTAOI_TILE; i += GTAOI_W)
        for (j = 0; j < GTAOI_TILE; j += 4) {
            GV v[4];
            GTAOI_NAME(gtaoi_load4)(in + i * GTAOI_TILE + j, GTAOI_TILE, v);
            for (k = 0; k < 4; k++)
                GV_STORE(out + (j + k) * pitch + i, v[k]);
        }
}

/* Heights of 16 lines at 16 positions. A height on a line is linear
 * between two pixels of one surface (the step is small, or goes on from either side); else the nearer one's surface goes
 * on. */
GTAOI_FN void GTAOI_NAME(gtaoi_sweep_read)(const gtaoi_lines *l, int tile) {
    GTAOI_NO_CONTRACT
    enum { HEIGHTS, AHEAD };
    float block[2][GTAOI_TILE * GTAOI_TILE];
    const gtao_context *c = l->c;
    const int soon = 32, soon_minor = (int)(l->slope * 32.0);
    int u, k, wrap = c->d.border == GTAO_BORDER_WRAP;
    for (u = 0; u < GTAOI_TILE; u++) {
        int position = tile * GTAOI_TILE + u, i = l->first + position, whole, up, at;
        double place = l->slope * (double)i + l->phase, fraction;
        float aside, ahead;
        const float *p;
        if (position >= l->count) {
            gtaoi_fill_sky(block[HEIGHTS] + u * GTAOI_TILE, GTAOI_TILE);
            memset(block[AHEAD] + u * GTAOI_TILE, 0, GTAOI_TILE * sizeof(float));
            l->minor[position] = 0;
            continue;
        }
        whole = (int)place - ((double)(int)place > place);
        fraction = place - (double)whole;
        up = fraction >= 0.5;
        aside = (float)(fraction - (double)up);
        at = l->line + whole;
        if (wrap)
            at = gtaoi_wrap(at, l->n_minor), i = gtaoi_wrap(i, l->n_major);
        l->minor[position] = at + up;
        if (!wrap)
            at = gtaoi_imin(gtaoi_imax(at, -18), l->n_minor + 1), i = gtaoi_imin(gtaoi_imax(i, 0), l->n_major - 1);
        p = l->plane + (ptrdiff_t)i * l->pitch + at;
        if (i + soon < l->n_major && at >= 0) /* each position is another page */
            GTAOI_PREFETCH(p + soon * l->pitch + soon_minor, 24);
        for (k = 0; k < GTAOI_TILE; k += GTAOI_W) {
            GV a = GV_LOAD(p + k), b = GV_LOAD(p + k + 1), before = GV_LOAD(p + k - 1), after = GV_LOAD(p + k + 2);
            GV step = GV_SUB(b, a), limit = GV_SET(c->same_surface), nearest = up ? b : a, own, further;
            GM small, from_a, from_b;
            if (!c->orthographic)
                limit = GV_MUL(limit, GV_MIN(GV_ABS(a), GV_ABS(b)));
            small = GV_LE(GV_ABS(step), limit);
            from_a = GV_LE(GV_ABS(GV_SUB(step, GV_SUB(a, before))), limit);
            from_b = GV_LE(GV_ABS(GV_SUB(step, GV_SUB(after, b))), limit);
            small = GM_OR(small, from_a), small = GM_OR(small, from_b);
            own = up ? GV_SUB(after, b) : GV_SUB(a, before);
            further = up ? GV_SUB(GV_LOAD(p + k + 3), after) : GV_SUB(before, GV_LOAD(p + k - 2));
            from_a = GV_LE(GV_ABS(own), limit);
            from_b = GV_LE(GV_ABS(GV_SUB(own, further)), limit);
            own = GV_SELECT(small, step, GV_IF(GM_OR(from_a, from_b), own));
            GV_STORE(block[HEIGHTS] + u * GTAOI_TILE + k, GV_ADD(nearest, GV_MUL(own, GV_SET(aside))));
        }
        for (k = 0; c->bounded && k < GTAOI_TILE; k++) { /* gradients are not padded */
            int y = at + up + k;
            if (wrap && y >= l->n_minor)
                y = gtaoi_wrap(y, l->n_minor);
            if (y >= 0 && y < l->n_minor) {
                ptrdiff_t here = (ptrdiff_t)i * l->pitch + y;
                ahead = l->tilt_along[here] + l->tilt_across[here] * (float)l->slope;
            } else {
                ahead = 0.0f;
            }
            block[AHEAD][u * GTAOI_TILE + k] = ahead;
        }
    }
    GTAOI_NAME(gtaoi_turn16)(block[HEIGHTS], l->strip + tile * GTAOI_TILE, l->length);
    if (c->bounded)
        GTAOI_NAME(gtaoi_turn16)(block[AHEAD], l->ahead + tile * GTAOI_TILE, l->length);
}

/* Which of the samples [at, at + 16) of a line lie on the hull of their neighbours, where every slope from one side is
 * greater than every one to the other. */
GTAOI_FN unsigned GTAOI_NAME(gtaoi_sweep_above)(const float *strip) {
    GTAOI_NO_CONTRACT
    unsigned bits = 0;
    int i, k;
    for (i = 0; i < GTAOI_TILE; i += GTAOI_W, strip += GTAOI_W) {
        GV w = GV_LOAD(strip), left = GV_SUB(w, GV_LOAD(strip - 1)), right = GV_SUB(GV_LOAD(strip + 1), w);
        for (k = 2; k <= GTAOI_LAG; k += k < 4 ? 1 : k < 8 ? 2 : 4) {
            GV inv = GV_SET(1.0f / (float)k);
            left = GV_MIN(left, GV_MUL(GV_SUB(w, GV_LOAD(strip - k)), inv));
            right = GV_MAX(right, GV_MUL(GV_SUB(GV_LOAD(strip + k), w), inv));
        }
        bits |= GM_BITS(GV_LT(right, left)) << i;
    }
    return bits;
}

/* Largest slopes from the 16 receivers of one line and tile to what lies more than GTAO_SWEEP_NEAR before (after) them:
 * one by one the samples that may see more than the hull's vertices, since these were compared with samples so near, or
 * are not in the hull yet; then the vertices, nearest first. From each receiver their slopes rise up to its horizon and
 * fall beyond, so four that do not rise for any of the 16 end the search; what is looked at for another's sake could only
 * exceed the horizon by its rounding, and the 16 are the same for every kernel. Receivers stand on the line, too, as if
 * their pixel's surface had been moved there: what lies beside the line is taken to be so inclined. */
GTAOI_FN void GTAOI_NAME(gtaoi_sweep_query)(const gtaoi_lines *l, int line, int tile, int backward, float *out) {
    GTAOI_NO_CONTRACT
    enum { N = GTAOI_TILE / GTAOI_W, FIRST = GTAO_SWEEP_NEAR + 1, LAST = GTAO_SWEEP_NEAR + GTAOI_LAG };
    ptrdiff_t at = (ptrdiff_t)line * l->length + tile * GTAOI_TILE, step = backward ? 1 : -1;
    const float *sample = l->strip + at + FIRST * step;
    const gtaoi_vertex *v = l->vertex + (ptrdiff_t)line * l->room;
    int at_vertex = l->start[line * l->tiles + tile], k, n, rising, i;
    GV b[N], best[N], hull[N];
    for (n = 0; n < N; n++) {
        b[n] = GV_LOAD(l->strip + at + n * GTAOI_W);
        best[n] = hull[n] = GV_SET(GTAOI_SKY);
    }
    for (k = FIRST; k <= LAST; k += 2, sample += 2 * step) {
        GV inv = GV_SET(l->inverse[k]), further_inv = GV_SET(l->inverse[k + 1]);
        for (n = 0; n < N; n++) {
            const float *p = sample + n * GTAOI_W;
            best[n] = GV_MAX(best[n], GV_MUL(GV_SUB(GV_LOAD(p), b[n]), inv));
            hull[n] = GV_MAX(hull[n], GV_MUL(GV_SUB(GV_LOAD(p + step), b[n]), further_inv));
        }
    }
    for (n = 0; n < N; n++)
        best[n] = GV_MAX(best[n], hull[n]), hull[n] = GV_SET(GTAOI_SKY);
    do
        for (i = 0; i < 4; i++) {
            GV w = GV_SET(v[at_vertex].w);
            const float *inv = l->inverse + (tile * GTAOI_TILE - v[at_vertex].t);
            at_vertex = v[at_vertex].before;
            for (rising = 0, n = 0; n < N; n++) {
                GV slope = GV_MUL(GV_SUB(w, b[n]), GV_LOAD(inv + n * GTAOI_W));
                if (i == 3)
                    rising |= GM_ANY(GV_LT(hull[n], slope));
                hull[n] = GV_MAX(hull[n], slope);
            }
        }
    while (rising);
    for (n = 0; n < N; n++)
        GV_STORE(out + n * GTAOI_W, GV_MAX(best[n], hull[n]));
}

/* The highest sample of each tile and of each block of tiles. */
GTAOI_FN void GTAOI_NAME(gtaoi_sweep_highest)(const gtaoi_lines *l) {
    int line, tile, i, blocks = l->tiles / GTAOI_BLOCK + 1;
    for (line = 0; line < GTAOI_TILE; line++) {
        float *block = l->highest_block + line * blocks;
        gtaoi_fill_sky(block, blocks);
        for (tile = 0; tile < l->tiles; tile++) {
            const float *strip = l->strip + line * l->length + tile * GTAOI_TILE;
            float lanes[GTAOI_W];
            GV high = GV_LOAD(strip);
            for (i = GTAOI_W; i < GTAOI_TILE; i += GTAOI_W)
                high = GV_MAX(high, GV_LOAD(strip + i));
            GV_STORE(lanes, high);
            for (i = 1; i < GTAOI_W; i++)
                lanes[0] = gtaoi_max(lanes[0], lanes[i]);
            l->highest[line * l->tiles + tile] = lanes[0];
            block[tile / GTAOI_BLOCK] = gtaoi_max(block[tile / GTAOI_BLOCK], lanes[0]);
        }
    }
}

/* Whether samples at the distances k0 .. k1 may raise the horizon of any receiver of a tile: the highest of the tiles
 * from `t` to `t_end` that they lie in, `high` of `count` tiles or blocks of tiles each, at either distance. The same
 * operations in the same order as for a sample, and each is monotonic, rounding included: what is passed over changes no
 * bit. */
GTAOI_FI int GTAOI_NAME(gtaoi_sweep_matters)(const gtaoi_lines *l, const float *high, int count, int t, int t_end,
                                             int k0, int k1, GV unit, const GV *b, const GV *tangent,
                                             const GTAOI_HORIZONS *s) {
    GTAOI_NO_CONTRACT
    float top =
        gtaoi_max(t >= 0 && t < count ? high[t] : GTAOI_SKY, t_end >= 0 && t_end < count ? high[t_end] : GTAOI_SKY);
    int n, any = 0;
    for (n = 0; n < GTAOI_TILE / GTAOI_W; n++) {
        GV up = GV_SUB(GV_SET(top), b[n]);
        up = GV_MAX(GV_MUL(up, GV_MUL(GV_SET(l->inverse[k0]), unit)), GV_MUL(up, GV_MUL(GV_SET(l->inverse[k1]), unit)));
        any |= GM_ANY(GV_LT(s[n].rise[0], GV_SUB(up, tangent[n])));
    }
    return any;
}

/* The same as gtaoi_sweep_query within a radius, where no hull will do: every sample, but for tiles that lie too low to
 * matter; each weighted as in the march. */
GTAOI_FN void GTAOI_NAME(gtaoi_sweep_within)(const gtaoi_lines *l, int line, int tile, int backward, float *out) {
    GTAOI_NO_CONTRACT
    enum { N = GTAOI_TILE / GTAOI_W };
    const gtao_context *c = l->c;
    const GV zero = GV_SET(0.0f), one = GV_SET(1.0f);
    int step = backward ? 1 : -1, at = tile * GTAOI_TILE, k, n, t, ring = c->inv_falloff > 0.0f;
    int blocks = l->tiles / GTAOI_BLOCK + 1, end = (backward ? l->tiles - tile : tile + 1) * GTAOI_TILE;
    const float *sample_at = l->strip + (ptrdiff_t)line * l->length + at;
    float sign = backward ? 1.0f : -1.0f, reach[GTAOI_TILE], high = GTAOI_SKY, range = 0.0f;
    GV unit = GV_ABS(GV_SET(l->x_major ? l->slice->dx : l->slice->dy));
    GV b[N], tangent[N];
    GTAOI_FRAME f[N];
    GTAOI_HORIZONS s[N];
    for (n = 0; n < N; n++) {
        GV w0 = one, len = one, along = zero, perp = GV_SET(l->slice->bb), rx = zero, ry = zero;
        ptrdiff_t here = (ptrdiff_t)line * l->length + at + n * GTAOI_W;
        b[n] = GV_LOAD(l->strip + here);
        tangent[n] = GV_MUL(GV_MUL(GV_LOAD(l->ahead + here), GV_SET(sign)), unit);
        if (!c->orthographic) {
            GV major = GV_ADD(GV_SET((float)(l->first + at + n * GTAOI_W)), GTAOI_NAME(gtaoi_iota)()), minor;
            for (k = 0; k < GTAOI_W; k++)
                reach[k] = (float)(l->minor[at + n * GTAOI_W + k] + line);
            minor = GV_LOAD(reach);
            GV toward = GV_SET((l->backward[0] == backward) ? 1.0f : -1.0f);
            rx = GV_SUB(GV_ADD(l->x_major ? major : minor, GV_SET(0.5f)), GV_SET(c->cx));
            ry = GV_SUB(GV_ADD(l->x_major ? minor : major, GV_SET(0.5f)), GV_SET(c->cy));
            rx = GV_MUL(rx, GV_SET(c->bx1)), ry = GV_MUL(ry, GV_SET(c->by1));
            len = GV_SQRT(GV_ADD(GV_ADD(GV_MUL(rx, rx), GV_MUL(ry, ry)), one));
            along = GV_DIV(GV_ADD(GV_MUL(rx, GV_SET(l->slice->bx)), GV_MUL(ry, GV_SET(l->slice->by))), len);
            along = GV_MUL(along, toward);
            perp = GV_MAX(GV_SUB(perp, GV_MUL(along, along)), GV_MUL(perp, GV_SET(1e-6f)));
            w0 = GV_SELECT(GV_LT(zero, b[n]), b[n], one);
        }
        f[n].inv_perp = GV_DIV(one, GV_SQRT(perp));
        f[n].kappa_scale = GV_MUL(GV_DIV(len, w0), f[n].inv_perp);
        f[n].kappa_tangent = GV_SUB(GV_MUL(tangent[n], f[n].kappa_scale), GV_MUL(along, f[n].inv_perp));
        f[n].cos_tangent =
            GV_DIV(f[n].kappa_tangent, GV_SQRT(GV_ADD(one, GV_MUL(f[n].kappa_tangent, f[n].kappa_tangent))));
        f[n].reach = GV_MUL(GV_SET(c->reach), f[n].inv_perp);
        f[n].floor = s[n].rise[0] = zero;
        s[n].cosine[0] = f[n].cos_tangent;
    }
    for (n = 0; n < N; n++)
        GV_STORE(reach + n * GTAOI_W, GV_MUL(f[n].reach, unit));
    /* samples farther than this are out of reach: reach w / t >= 1, orthographic reach / t >= 1 */
    for (k = 0; k < GTAOI_TILE; k++)
        range = gtaoi_max(range, reach[k]);
    for (t = 0; !c->orthographic && t < blocks; t++)
        high = gtaoi_max(high, l->highest_block[line * blocks + t]);
    range = gtaoi_min(c->orthographic ? range : range * gtaoi_max(high, 0.0f), (float)end);
    for (k = GTAO_SWEEP_NEAR + 1; (float)k <= range; k++) {
        GV inv;
        if (k % GTAOI_TILE == 1) { /* from here on the samples are those of tiles t and beyond */
            const float *highest = l->highest + line * l->tiles;
            t = tile + step * (k / GTAOI_TILE);
            if (k % (GTAOI_TILE * GTAOI_BLOCK) == 1) {
                int further = t + step * GTAOI_BLOCK;
                if (!GTAOI_NAME(gtaoi_sweep_matters)(l, l->highest_block + line * blocks, blocks, t / GTAOI_BLOCK,
                                                     further < 0 ? -1 : further / GTAOI_BLOCK, k,
                                                     k + GTAOI_TILE * GTAOI_BLOCK - 1, unit, b, tangent, s)) {
                    k += GTAOI_TILE * GTAOI_BLOCK - 1;
                    continue;
                }
            }
            if (!GTAOI_NAME(gtaoi_sweep_matters)(l, highest, l->tiles, t, t + step, k, k + GTAOI_TILE - 1, unit, b,
                                                 tangent, s)) {
                k += GTAOI_TILE - 1;
                continue;
            }
        }
        inv = GV_MUL(GV_SET(l->inverse[k]), unit);
        for (n = 0; n < N; n++) {
            GTAOI_SAMPLE sample;
            GM fading;
            GV w = GV_LOAD(sample_at + step * k + n * GTAOI_W), rise;
            rise = GV_SUB(GV_MUL(GV_SUB(w, b[n]), inv), tangent[n]);
            fading = GTAOI_NAME(gtaoi_rise)(c, &f[n], &s[n], 0, w, inv, rise, rise, &sample, c->orthographic, 1, 1, 0);
            if (ring && GM_ANY(fading))
                GTAOI_NAME(gtaoi_fade)(c, &f[n], &s[n], 0, &sample, fading);
        }
    }
    for (n = 0; n < N; n++) {
        GM occluded = GV_LT(one, zero);
        GV kappa = GTAOI_NAME(gtaoi_kappa)(c, &f[n], &s[n], 0, &occluded);
        GV rise = GV_DIV(GV_SUB(kappa, f[n].kappa_tangent), f[n].kappa_scale);
        GV_STORE(out + n * GTAOI_W, GV_DIV(GV_ADD(rise, tangent[n]), unit));
    }
}

/* One group of lines: read, then swept either way. */
GTAOI_FN void GTAOI_NAME(gtaoi_sweep_lines)(gtaoi_lines *l) {
    int tile, line, side, i, tiles = l->tiles;
    for (tile = 0; tile < tiles; tile++)
        GTAOI_NAME(gtaoi_sweep_read)(l, tile);
    for (line = 0; line < GTAOI_TILE && !l->c->bounded; line++)
        for (tile = 0; tile < tiles; tile++)
            l->above[line * (tiles + 4) + tile + 2] =
                (uint16_t)GTAOI_NAME(gtaoi_sweep_above)(l->strip + line * l->length + tile * GTAOI_TILE);
    if (l->c->bounded)
        GTAOI_NAME(gtaoi_sweep_highest)(l);
    for (side = 0; side < 2; side++) {
        int backward = l->backward[side];
        gtaoi_sweep_start(l, backward);
        for (line = 0; l->options->beyond && line < GTAOI_TILE; line++)
            gtaoi_seed_vertices(l, line, backward);
        for (line = 0; line < GTAOI_TILE && !l->c->bounded; line++)
            gtaoi_push_vertices(l, line, backward);
        for (i = 0; i < tiles; i++) {
            float found[GTAOI_TILE * GTAOI_TILE], turned[GTAOI_TILE * GTAOI_TILE];
            int at;
            tile = backward ? tiles - 1 - i : i, at = tile * GTAOI_TILE;
            if (at + GTAOI_TILE <= l->begin || at >= l->end)
                continue;
            for (line = 0; line < GTAOI_TILE; line++) {
                if (l->c->bounded)
                    GTAOI_NAME(gtaoi_sweep_within)(l, line, tile, backward, found + line * GTAOI_TILE);
                else
                    GTAOI_NAME(gtaoi_sweep_query)(l, line, tile, backward, found + line * GTAOI_TILE);
            }
            if (!l->x_major)
                GTAOI_NAME(gtaoi_turn16)(found, turned, GTAOI_TILE);
            gtaoi_sweep_store(l, side, tile, l->x_major ? found : turned);
        }
    }
}

/* Gradients of the tangent planes of a block of pixels; zero where there are none. */
GTAOI_FN void GTAOI_NAME(gtaoi_keep_tilts)(const gtaoi_pass *pass, const GTAOI_PIXEL *p, const GM *active, int groups,
                                           int x, int y) {
    int g;
    for (g = 0; g < groups; g++, x += GTAOI_W) {
        GV_STORE(pass->tilt_x + (ptrdiff_t)y * pass->tilt_pitch + x, GV_IF(active[g], p[g].gx));
        GV_STORE(pass->tilt_y + (ptrdiff_t)y * pass->tilt_pitch + x, GV_IF(active[g], p[g].gy));
    }
}

/* Sums of a block between the batches of a sweep: read, or kept. */
GTAOI_FN void GTAOI_NAME(gtaoi_sums)(const gtao_context *c, GTAOI_SUM *sum, GTAOI_MOMENTS *moments, int groups, int x,
                                     int y, int keep) {
    float *at = c->pass->sums + (size_t)y * c->pass->sums_row + (size_t)x * (size_t)c->pass->fields;
    int g, i, n = c->pass->fields;
    for (g = 0; g < groups; g++) {
        GTAOI_MOMENTS *m = moments + g;
        GV *field[14];
        field[0] = &sum[g].visible, field[1] = &sum[g].open, field[2] = &sum[g].jacobian_open;
        field[3] = &sum[g].bx, field[4] = &sum[g].by, field[5] = &sum[g].bz, field[6] = &sum[g].bv;
        field[7] = &m->lost, field[8] = &m->vv, field[9] = &m->xv, field[10] = &m->yv;
        field[11] = &m->xx, field[12] = &m->xy, field[13] = &m->yy;
        for (i = 0; i < (n > 2 ? n - 1 : 2); i++, at += GTAOI_W) {
            if (keep)
                GV_STORE(at, *field[i]);
            else
                *field[i] = GV_LOAD(at);
        }
        if (n > 2) {
            if (keep)
                GV_STORE(at, GV_IF(sum[g].occluded, GV_SET(1.0f)));
            else
                sum[g].occluded = GV_LT(GV_SET(0.5f), GV_LOAD(at));
            at += GTAOI_W;
        }
    }
}

/* A group's share of a horizon map; pixels without a horizon see half of the circle. */
GTAOI_FN void GTAOI_NAME(gtaoi_store_horizons)(const gtao_context *c, const GTAOI_FRAME *f, const GTAOI_HORIZONS *s,
                                               GM active, int k, int side, int x, int y) {
    GTAOI_NO_CONTRACT
    GV open = GV_SET((float)(0.5 * GTAOI_PI)), h = open;
    float angle[GTAOI_W];
    if (GM_ANY(active)) {
        GM occluded = active;
        h = GTAOI_NAME(gtaoi_atan2)(GV_SET(1.0f), GTAOI_NAME(gtaoi_kappa)(c, f, s, side, &occluded));
        h = GV_SELECT(active, GV_MAX(h, GV_SET(0.0f)), open);
    }
    GV_STORE(angle, h);
    gtaoi_store_lanes(c, c->o.horizons, 2 * k + side, angle, GTAOI_W, x, y);
}

/* Intermediates of a slice of a group; frame, horizons and arcs are there where anything is active. */
GTAOI_FN void GTAOI_NAME(gtaoi_store_slice)(const gtao_context *c, const GTAOI_FRAME *f, const GTAOI_HORIZONS *s,
                                            const GTAOI_ARCS *a, GM active, int k, int x, int y) {
    GTAOI_NO_CONTRACT
    GV zero = GV_SET(0.0f), terms[3];
    float lanes[GTAOI_W];
    int i, some = GM_ANY(active);
    for (i = 0; c->o.horizons && i < 2; i++)
        GTAOI_NAME(gtaoi_store_horizons)(c, f, s, active, k, i, x, y);
    for (i = 0; c->o.arcs && i < 2; i++) {
        uint32_t bits[GTAOI_W];
        memset(bits, 0, sizeof bits);
        if (some && c->arcs) {
            GI mask = GI_IF(active, a->mask[i]);
            memcpy(bits, &mask, sizeof bits);
        }
        gtaoi_store_lanes(c, c->o.arcs, 2 * k + i, bits, GTAOI_W, x, y);
    }
    terms[0] = terms[1] = terms[2] = zero;
    if (some)
        terms[0] = f->n, terms[1] = GV_MUL(f->inv_perp, f->inv_perp), terms[2] = f->open;
    for (i = 0; c->o.slices && i < 3; i++) {
        GV_STORE(lanes, GV_IF(active, terms[i]));
        gtaoi_store_lanes(c, c->o.slices, 3 * k + i, lanes, GTAOI_W, x, y);
    }
}

GTAOI_FN void GTAOI_NAME(gtaoi_store_surface)(const gtao_context *c, const GTAOI_PIXEL *p, GM active, int x, int y) {
    GTAOI_NO_CONTRACT
    GV values[7];
    float keys[GTAOI_W];
    int i;
    for (i = 0; i < 7; i++)
        values[i] = GV_SET(0.0f);
    if (GM_ANY(active)) {
        GV_STORE(keys, GV_SELECT(active, p->key, GV_SET(c->extent_min)));
        for (i = 0; i < GTAOI_W; i++)
            keys[i] = (float)gtaoi_class(c, keys[i]);
        values[0] = p->nx, values[1] = p->ny, values[2] = p->nz, values[3] = p->gx, values[4] = p->gy;
        values[5] = p->extent, values[6] = GV_LOAD(keys);
    }
    for (i = 0; i < 7; i++) {
        GV_STORE(keys, GV_SELECT(active, values[i], GV_SET(i == 6 ? -1.0f : 0.0f)));
        gtaoi_store_lanes(c, c->o.surface, i, keys, GTAOI_W, x, y);
    }
}

/* The far horizons join the near ones. */
GTAOI_FN void GTAOI_NAME(gtaoi_add_far)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                        GTAOI_HORIZONS *s, const GM *active, int groups, int k, int x, int y) {
    GTAOI_NO_CONTRACT
    const gtaoi_pass *pass = c->pass;
    const float *from =
        pass->beyond + (size_t)(2 * (k - c->slice_begin)) * pass->beyond_plane + (ptrdiff_t)y * pass->beyond_pitch;
    int g, side;
    for (g = 0; g < groups; g++, x += GTAOI_W) {
        for (side = 0; side < 2; side++) {
            if (GM_ANY(active[g])) {
                GV unit = GV_MAX(GV_ABS(f[g].dx), GV_ABS(f[g].dy));
                GV tangent = GV_ADD(GV_MUL(p[g].gx, f[g].dx), GV_MUL(p[g].gy, f[g].dy));
                GV slope = GV_MUL(GV_LOAD(from + (size_t)side * pass->beyond_plane + x), unit);
                s[g].rise[side] = GV_MAX(s[g].rise[side], side ? GV_ADD(slope, tangent) : GV_SUB(slope, tangent));
            }
            if (c->o.horizons)
                GTAOI_NAME(gtaoi_store_horizons)(c, &f[g], &s[g], active[g], k, side, x, y);
        }
    }
}

/* ---- what can rise: tiles --------------------------------------------------------------------------------------- */

/* Cells [cx, cx_end) of row cy, moved by (shift_x, shift_y) pixels, as a tile sees them. */
GTAOI_FN void GTAOI_NAME(gtaoi_look_at)(const gtao_context *c, gtaoi_tile *t, gtaoi_looking *l, int cx, int cx_end,
                                        int cy, float shift_x, float shift_y) {
    GTAOI_NO_CONTRACT
    const float half = 0.5f * (float)(GTAOI_CELL - 1), last = (float)(GTAOI_CELL - 1),
                taps = c->every_pixel ? 2.0f : 0.0f;
    const GV zero = GV_SET(0.0f), one = GV_SET(1.0f);
    const float y = (float)(cy * GTAOI_CELL) + shift_y;
    const float gap_y = gtaoi_max(gtaoi_max(y - l->y1, l->y0 - (y + last)), 0.0f);
    const GV gx = GV_SET(t->gx), gy = GV_SET(t->gy), along_y = GV_SET(t->gy * (y + half - l->y));
    for (; cx < cx_end; cx += GTAOI_W) {
        ptrdiff_t at = cy * c->cell_pitch + cx;
        GV x = GV_ADD(GV_SET((float)(cx * GTAOI_CELL) + shift_x),
                      GV_MUL(GTAOI_NAME(gtaoi_iota)(), GV_SET((float)GTAOI_CELL)));
        GV gap = GV_MAX(GV_MAX(GV_SUB(x, GV_SET(l->x1)), GV_SUB(GV_SET(l->x0 - last), x)), zero);
        GV distance = GV_SQRT(GV_ADD(GV_MUL(gap, gap), GV_SET(gap_y * gap_y)));
        GV w = GV_SUB(GV_LOAD(c->cell[GTAOI_CELL_W0] + at), GV_SET(l->w));
        GV along_x = GV_MUL(gx, GV_SUB(x, GV_SET(l->x - half))), up = GV_LOAD(c->cell[GTAOI_CELL_UP] + at), top, size;
        GV turn = GV_ADD(GV_ABS(GV_SUB(GV_LOAD(c->cell[GTAOI_CELL_GX] + at), gx)),
                         GV_ABS(GV_SUB(GV_LOAD(c->cell[GTAOI_CELL_GY] + at), gy)));
        GM closed;
        unsigned bits;
        turn = GV_MUL(turn, GV_SET(half));
        size = GV_ADD(GV_ADD(GV_ABS(w), turn), GV_ADD(GV_ABS(along_x), GV_ABS(along_y)));
        top = GV_ADD(GV_SUB(w, GV_ADD(along_x, along_y)), GV_ADD(turn, GV_SUB(up, GV_SET(l->low))));
        size = GV_ADD(size, GV_ADD(GV_ABS(up), GV_SET(gtaoi_abs(l->low))));
        top = GV_ADD(top, GV_MUL(size, GV_SET(2.9802322e-7f))); /* rounding of the above: 5 times 2^-24 */
        distance = GV_MAX(GV_SUB(distance, GV_SET(taps)), one);
        closed = GM_OR(GV_LE(top, GV_MUL(GV_SET(l->room), distance)), GV_LT(GV_SET(l->radius), distance));
        /* all of it farther behind, or in front, than the radius */
        closed = GM_OR(closed, GV_LT(GV_LOAD(c->cell[GTAOI_CELL_MOST] + at), GV_SET(l->behind)));
        closed = GM_OR(closed, GV_LT(GV_SET(l->before), GV_LOAD(c->cell[GTAOI_CELL_LEAST] + at)));
        bits = GTAOI_ALL & ~GM_BITS(closed);
        if (cx_end - cx < GTAOI_W)
            bits &= (1u << (cx_end - cx)) - 1u;
        if (bits) {
            float nearest[GTAOI_W];
            GV_STORE(nearest, distance);
            for (; bits; bits &= bits - 1u) {
                int i = gtaoi_lowest(bits);
                float left = (float)((cx + i) * GTAOI_CELL) + shift_x, x0 = left - l->x1, x1 = left + last - l->x0;
                float y0 = y - l->y1, y1 = y + last - l->y0, farthest = l->radius;
                double above = gtaoi_cell_top(c, t, l, at + i, left, y), enough = above * (double)l->inv_room;
                if (above <= (double)l->room * (double)nearest[i])
                    continue; /* it was rounding */
                if (--l->candidates < 0)
                    return;
                if (enough < (double)farthest)
                    farthest = (float)(enough * 1.000001);
                gtaoi_may_rise(t, l->all, x0 - 2.0f, x1 + 2.0f, y0 - 2.0f, y1 + 2.0f, nearest[i], farthest);
            }
        }
    }
}

/* Rows [y, y_last] of cells [cx, cx_end), not all sky: finds a plane close below their pixels, and what may rise above
 * it around. Returns whether nothing does. */
GTAOI_FN int GTAOI_NAME(gtaoi_look_around)(const gtao_context *c, const uint8_t *known, int cx, int cx_end, int y,
                                           int y_last, int candidates, gtaoi_tile *t) {
    GTAOI_NO_CONTRACT
    const float half = 0.5f * (float)(GTAOI_CELL - 1), inf = (float)HUGE_VAL;
    const float *w0 = c->cell[GTAOI_CELL_W0], *gx = c->cell[GTAOI_CELL_GX], *gy = c->cell[GTAOI_CELL_GY],
                *up = c->cell[GTAOI_CELL_UP], *down = c->cell[GTAOI_CELL_DOWN];
    int x = cx * GTAOI_CELL, x_last = gtaoi_imin(cx_end * GTAOI_CELL, c->d.width) - 1, cy = y / GTAOI_CELL;
    int i, k, n = 0, first = -1, far_y, far_x;
    int w = c->d.width, h = c->d.height, kx, ky, kx1 = 0, ky1 = 0, reach_y, wrap = c->d.border == GTAO_BORDER_WRAP;
    ptrdiff_t row = cy * c->cell_pitch;
    float nearest = -FLT_MAX, farthest = FLT_MAX, bottom = -FLT_MAX, high = -FLT_MAX, len2 = 1.0f, len2_min = 1.0f,
          floor_, size, extent;
    double most, least;
    gtaoi_looking l;
    t->known = t->deep = t->fits = 0;
    t->gx = t->gy = t->slack = 0.0f;
    for (i = cx; i < cx_end; i++)
        if (down[row + i] < 0.5f * -GTAOI_CELL_NONE)
            t->gx += gx[row + i], t->gy += gy[row + i], n++, first = first < 0 ? i : first;
    t->gx /= (float)n, t->gy /= (float)n;
    l.w = w0[row + first], l.x = (float)(first * GTAOI_CELL) + half, l.y = (float)(cy * GTAOI_CELL) + half;
    l.x0 = (float)x, l.x1 = (float)x_last;
    l.y0 = (float)y, l.y1 = (float)y_last;
    l.low = FLT_MAX;
    for (i = cx; i < cx_end; i++) {
        ptrdiff_t at = row + i;
        double ax = (double)gx[at] - (double)t->gx, ay = (double)gy[at] - (double)t->gy, d;
        if (!(down[at] < 0.5f * -GTAOI_CELL_NONE))
            continue;
        ax = (double)half * ((ax < 0.0 ? -ax : ax) + (ay < 0.0 ? -ay : ay));
        d = (((double)w0[at] - (double)l.w) - (double)t->gx * ((i - first) * GTAOI_CELL)) - ax;
        l.low = gtaoi_min(l.low, (float)(d + (double)down[at]));
        bottom = gtaoi_max(bottom, (float)(d + (double)up[at]));
        high = gtaoi_max(high, (float)(d + 2.0 * ax + (double)up[at]));
        nearest = gtaoi_max(nearest, c->cell[GTAOI_CELL_MOST][at]);
        farthest = gtaoi_min(farthest, c->cell[GTAOI_CELL_LEAST][at]);
    }
    /* What the plane says of these rows, when they are not all. */
    least = (double)l.w + (double)t->gx * (double)((t->gx > 0.0f ? l.x0 : l.x1) - l.x) +
            (double)t->gy * (double)((t->gy > 0.0f ? l.y0 : l.y1) - l.y);
    most = (double)l.w + (double)t->gx * (double)((t->gx > 0.0f ? l.x1 : l.x0) - l.x) +
           (double)t->gy * (double)((t->gy > 0.0f ? l.y1 : l.y0) - l.y);
    nearest = gtaoi_min(nearest, (float)((most + (double)high) * (most > 0.0 ? 1.000001 : 0.999999)));
    farthest = gtaoi_max(farthest, (float)((least + (double)l.low) * (least > 0.0 ? 0.999999 : 1.000001)));
    t->deep = !c->orthographic && bottom - l.low < 1e-3f * nearest && nearest > GTAOI_DEEP * farthest;
    /* The floor of gtaoi_slice, floor = rise_min |b_perp| w0 / |r0|, from below: |b_perp| >= |b| / |r0|. */
    if (!c->orthographic) {
        float ax = ((l.x0 + 0.5f) - c->cx) * c->bx1, bx = ((l.x1 + 0.5f) - c->cx) * c->bx1;
        float ay = ((l.y0 + 0.5f) - c->cy) * c->by1, by = ((l.y1 + 0.5f) - c->cy) * c->by1;
        len2 = 1.0f + gtaoi_max(ax * ax, bx * bx) + gtaoi_max(ay * ay, by * by);
        len2_min = 1.0f + (ax * bx > 0.0f ? gtaoi_min(ax * ax, bx * bx) : 0.0f) +
                   (ay * by > 0.0f ? gtaoi_min(ay * ay, by * by) : 0.0f);
        if (!(len2 < 256.0f))
            return 0;
    }
    floor_ = 0.999f * c->rise_min * gtaoi_min(c->bx1, c->by1) * (c->orthographic ? 1.0f : farthest / len2);
    /* Derived normals have the noise of depth, bumpy ground has its own. */
    t->slack = (c->rise_min > GTAOI_RISE_MIN ? 0.5f : c->d.normals ? 0.125f : 0.25f) * floor_;
    size = gtaoi_abs(t->gx) + gtaoi_abs(t->gy);
    l.room = 0.999f * floor_ - t->slack - 3.8146973e-6f * (size + t->slack); /* 64 times 2^-24: rounding of g.q */
    l.inv_room = 1.001f / l.room;
    if (!(l.room > 0.0f && l.inv_room < FLT_MAX && bottom - l.low < 16.0f * l.room))
        return 0;
    t->fits = 1;
    /* How far the search goes, in pixels: classes are rounded up by a quarter at most. */
    extent = c->extent_max;
    if (c->orthographic) {
        extent = c->reach;
    } else if (c->bounded && !c->every_pixel) {
        extent = nearest * sqrtf(len2) * c->reach;
    } else if (c->bounded) { /* gtaoi_setup */
        float sine = nearest * c->reach / sqrtf(len2_min), tangent = sine / sqrtf(1.0f - sine * sine), room;
        room = 1.0f / sqrtf(len2) - tangent * sqrtf(1.0f - 1.0f / len2);
        if (sine < 1.0f && room > 0.0f)
            extent = sqrtf(len2) * tangent / room;
    }
    l.radius = extent * 1.26f / gtaoi_min(c->bx1, c->by1) + 2.0f;
    if (!(l.radius < c->max_radius + 2.0f))
        l.radius = c->max_radius + 2.0f;
    if (c->pass)
        l.radius = gtaoi_min(l.radius, (float)GTAO_SWEEP_NEAR * 1.5f + 2.0f);
    /* The search takes a sample q of a slice of direction d for one at |q| d with a rise as great: of height
     * w' = w - g.(q - |q| d), which is off by less than 0.8 |g| because q is rounded to whole pixels. With
     * distance^2 = (|q| |b_perp| / w)^2 (1 + kappa^2) it is within the radius R only if |1 / w' - 1 / w0| w' / w <= R:
     *   (w0 - 0.8 |g|) / (1 + R w0) <= w <= (w0 + 0.8 |g|) / (1 - R w0),   orthographic |w' - w0| <= R. */
    l.behind = -FLT_MAX, l.before = FLT_MAX;
    if (c->bounded && size < 500.0f * gtaoi_min(c->bx1, c->by1) * (c->orthographic ? 1.0f : farthest)) {
        float reach = 1.01f * c->reach, off = 0.8f * (size + t->slack);
        l.behind = c->orthographic ? (farthest - reach) - off : (farthest - off) / (1.0f + reach * farthest);
        if (!(c->arcs && (c->clip || c->layer_count > 1)))
            l.before = c->orthographic           ? (nearest + reach) + off
                       : reach * nearest < 0.99f ? (nearest + off) / (1.0f - reach * nearest)
                                                 : FLT_MAX;
    }
    /* Worth it? A cell costs about as much as three samples of a group. */
    size = (2.0f * l.radius + (float)(x_last + 1 - x)) * (2.0f * l.radius + (float)(y_last + 1 - y)) /
           (float)(GTAOI_CELL * GTAOI_CELL);
    if (size >
        24.0f * (float)(cx_end - cx) * 2.0f * (float)c->slices * (c->every_pixel ? l.radius : (float)c->max_steps))
        return 0;
    for (i = 0; i < GTAOI_DIRECTIONS; i++)
        t->lo[i] = inf, t->hi[i] = 0.0f;
    l.all[0] = inf, l.all[1] = 0.0f;
    l.candidates = candidates;
    far_x = far_y = (int)l.radius + 1;
    if (wrap) {
        kx1 = (x_last + far_x) / w, ky1 = (y_last + far_y) / h;
    }
    for (ky = wrap ? -((far_y - y + h - 1) / h) : 0; ky <= ky1; ky++) {
        int begin = gtaoi_imax(y - far_y - ky * h, 0) / GTAOI_CELL;
        int end = (gtaoi_imin(y_last + 1 + far_y - ky * h, h) + GTAOI_CELL - 1) / GTAOI_CELL;
        for (k = begin; k < end; k++) { /* what is near may rise first: down from the own row, then up */
            float top, gap;
            i = ky ? k : k - begin < end - cy ? cy + k - begin : cy - 1 - (k - begin - (end - cy));
            top = (float)(i * GTAOI_CELL + ky * h);
            gap = gtaoi_max(gtaoi_max(top - l.y1, l.y0 - (top + 2.0f * half)), 0.0f);
            reach_y = gap < l.radius ? (int)sqrtf(l.radius * l.radius - gap * gap) + 2 : 2;
            for (kx = wrap ? -((reach_y - x + w - 1) / w) : 0; kx <= kx1; kx++) {
                int from = gtaoi_imax(x - reach_y - kx * w, 0) / GTAOI_CELL;
                int to = gtaoi_imin(x_last + 1 + reach_y - kx * w, w);
                to = (to + GTAOI_CELL - 1) / GTAOI_CELL;
                if (from >= to)
                    continue;
                if (known[i])
                    GTAOI_NAME(gtaoi_look_at)(c, t, &l, from, to, i, (float)(kx * w), (float)(ky * h));
                else
                    gtaoi_may_rise(t, l.all, (float)(from * GTAOI_CELL + kx * w) - l.x1 - 2.0f,
                                   (float)(to * GTAOI_CELL + kx * w) - l.x0 + 2.0f, top - l.y1 - 2.0f,
                                   top + 2.0f * half - l.y0 + 2.0f, gtaoi_max(gap - 2.0f, 1.0f), l.radius);
                if (l.candidates < 0)
                    return 0;
            }
        }
    }
    if (c->d.border == GTAO_BORDER_CLAMP) { /* what lies beyond the image is level, and may rise above a slope */
        float r = l.radius + 2.0f, left = l.x0 + 1.0f, right = (float)w - l.x1, above = l.y0 + 1.0f,
              below = (float)h - l.y1;
        if (left < r)
            gtaoi_may_rise(t, l.all, -r, -left + (l.x1 - l.x0) + 3.0f, -r, r, gtaoi_max(left - 2.0f, 1.0f), l.radius);
        if (right < r)
            gtaoi_may_rise(t, l.all, right - (l.x1 - l.x0) - 3.0f, r, -r, r, gtaoi_max(right - 2.0f, 1.0f), l.radius);
        if (above < r)
            gtaoi_may_rise(t, l.all, -r, r, -r, -above + (l.y1 - l.y0) + 3.0f, gtaoi_max(above - 2.0f, 1.0f), l.radius);
        if (below < r)
            gtaoi_may_rise(t, l.all, -r, r, below - (l.y1 - l.y0) - 3.0f, r, gtaoi_max(below - 2.0f, 1.0f), l.radius);
    }
    t->known = 1;
    t->lo_all = l.all[0], t->hi_all = l.all[1];
    for (i = 0; i < GTAOI_DIRECTIONS; i++) {
        t->lo[i] = gtaoi_min(t->lo[i], l.all[0]), t->hi[i] = gtaoi_max(t->hi[i], l.all[1]);
        t->lo_all = gtaoi_min(t->lo_all, t->lo[i]), t->hi_all = gtaoi_max(t->hi_all, t->hi[i]);
    }
    if (t->lo_all <= t->hi_all)
        return 0;
    gtaoi_tile_normal(c, t, &l, bottom - l.low, farthest, len2);
    return 1;
}

/* Cell i of a tile is open, `of` says why. */
GTAOI_FN void GTAOI_NAME(gtaoi_open_cell)(const gtao_context *c, gtaoi_tile *t, const gtaoi_tile *of, int i,
                                          ptrdiff_t at) {
    int solid = c->cell[GTAOI_CELL_DOWN][at] < 0.5f * -GTAOI_CELL_NONE, k, component, flat;
    int components = c->normal_plane ? 3 : c->d.normal_components;
    t->open |= 1u << i;
    for (k = 4 * i; k < 4 * i + 4; k++) {
        t->plane[0][k] = solid ? of->gx : 0.0f, t->plane[1][k] = solid ? of->gy : 0.0f;
        t->plane[2][k] = solid ? of->slack : 0.0f;
    }
    flat = solid && of->within > 0.0f && c->cell[GTAOI_CELL_SKY][at] == 0.0f;
    for (k = component = 0; k < GTAOI_LANES + 4; k++, component = component < components - 1 ? component + 1 : 0) {
        t->normals[i][k] = flat && component < 3 ? of->normal[component] : 0.0f;
        t->allowed[i][k] = !flat ? -1.0f : component < 3 ? of->within : FLT_MAX;
    }
}

/* A tile of 64x16 pixels from (x, y) on, as one plane or, if that tells little, cell by cell. */
GTAOI_FN void GTAOI_NAME(gtaoi_look)(const gtao_context *c, const uint8_t *known, unsigned skips, int x, int y,
                                     gtaoi_tile *t) {
    GTAOI_NO_CONTRACT
    const float roughest = 16.0f * c->rise_min * gtaoi_min(c->bx1, c->by1); /* of gtaoi_look_around, from above */
    int cx = x / GTAOI_CELL, cx_end = gtaoi_imin(cx + 4, c->cells_x), cy = y / GTAOI_CELL, i;
    int y_last = gtaoi_imin(y + GTAOI_CELL, c->d.height) - 1;
    int some_sky = 0, smooth = 0, solid = 0;
    float least = FLT_MAX;
    const ptrdiff_t at = cy * c->cell_pitch;
    gtaoi_tile one;
    t->sky = t->some_blank = t->known = t->deep = t->fits = 0, t->open = 0;
    t->blank = -FLT_MAX;
    if (!known[cy])
        return;
    for (i = cx; i < cx_end; i++) {
        const float down = c->cell[GTAOI_CELL_DOWN][at + i], w = c->cell[GTAOI_CELL_LEAST][at + i];
        if (down < 0.5f * -GTAOI_CELL_NONE) {
            float rough = roughest * (c->orthographic ? 1.0f : w);
            solid |= 1 << (i - cx), smooth |= (c->cell[GTAOI_CELL_UP][at + i] - down < rough) << (i - cx);
        }
        some_sky |= c->cell[GTAOI_CELL_SKY][at + i] > 0.0f;
        least = gtaoi_min(least, w);
    }
    t->sky = !solid;
    if (skips & GTAO_SKIP_SKY)
        t->blank = GTAOI_SKY_LIMIT, t->some_blank = some_sky;
    if ((skips & GTAO_SKIP_RADIUS) && !c->d.mask && !t->sky) {
        t->blank = gtaoi_max(t->blank, gtaoi_small_height(c, (float)x, (float)(x + 63), (float)y, (float)y_last));
        t->some_blank |= least <= t->blank;
    }
    if (t->sky || !(skips & (GTAO_SKIP_OPEN | GTAO_SKIP_SECTORS)))
        return;
    if (smooth == solid && GTAOI_NAME(gtaoi_look_around)(c, known, cx, cx_end, y, y_last, gtaoi_candidates(c), t)) {
        for (i = cx; i < cx_end; i++)
            GTAOI_NAME(gtaoi_open_cell)(c, t, t, i - cx, at + i);
    } else if ((skips & GTAO_SKIP_OPEN) && !t->fits) {
        for (i = 0; i < cx_end - cx; i++)
            if (!(solid >> i & 1) ||
                ((smooth >> i & 1) && GTAOI_NAME(gtaoi_look_around)(c, known, cx + i, cx + i + 1, y, y_last, 0, &one)))
                GTAOI_NAME(gtaoi_open_cell)(c, t, &one, i, at + cx + i);
    }
    for (i = cx_end; i < cx + 4; i++)
        t->open |= 1u << (i - cx);
}

/* Some rows of a tile that runs far into the distance: what is near enough to matter, and how exactly it can be told,
 * differs much from its first row to its last. Returns whether they are open. */
GTAOI_FN int GTAOI_NAME(gtaoi_look_band)(const gtao_context *c, const uint8_t *known, int x, int y, gtaoi_tile *t) {
    int cx = x / GTAOI_CELL, cx_end = gtaoi_imin(cx + 4, c->cells_x), i;
    memset(t, 0, sizeof *t);
    if (!GTAOI_NAME(gtaoi_look_around)(c, known, cx, cx_end, y, gtaoi_imin(y + GTAOI_BAND, c->d.height) - 1,
                                       gtaoi_candidates(c), t))
        return t->known;
    for (i = cx; i < cx_end; i++)
        GTAOI_NAME(gtaoi_open_cell)(c, t, t, i - cx, y / GTAOI_CELL * c->cell_pitch + i);
    for (; i < cx + 4; i++)
        t->open |= 1u << (i - cx);
    return 1;
}

/* The cells of a tile that a block, or if the phases of the noise do not interleave them a group of it, from column x
 * on lies in: as bits of gtaoi_tile.open. */
GTAOI_FI unsigned GTAOI_NAME(gtaoi_cells_of)(int x, int pixels) {
    int first = (x & 63) / GTAOI_CELL;
    return ((2u << ((pixels - 1) / GTAOI_CELL)) - 1u) << first;
}

/* gtaoi_tile.plane for the lanes of a group that starts at column x. */
GTAOI_FI GV GTAOI_NAME(gtaoi_plane_of)(const gtao_context *c, const gtaoi_tile *t, int which, int x) {
    const float *plane = t->plane[which];
    return c->period == 4 ? GV_LOAD(plane + ((x & 63) >> 2)) : GV_SET(plane[((x & 63) / GTAOI_CELL) * 4]);
}

/* ---- effort by need ---------------------------------------------------------------------------------------------- */

/* Heights and tilts of a block of pixels, in image order, for gtaoi_share. */
GTAOI_FN void GTAOI_NAME(gtaoi_keep)(const gtao_context *c, const GTAOI_PIXEL *p, const GM *active, int groups, int x,
                                     int y) {
    float *at = c->keep + (ptrdiff_t)y * (c->o.signal_stride / 4) + x;
    GV v[4];
    int k, g;
    for (k = 0; k < 3; k++, at += c->o.signal_plane_stride / 4) {
        for (g = 0; g < 4; g++) {
            v[g] = GV_SET(k ? 0.0f : GTAOI_SKY);
            if (g < groups && GM_ANY(active[g]))
                v[g] = GV_SELECT(active[g], k == 0 ? p[g].w0 : k == 1 ? p[g].gx : p[g].gy, v[g]);
        }
        GTAOI_NAME(gtaoi_store4)(at, 4, v);
    }
}

/* How far a pixel's neighbours may be from its tangent plane: a quarter of its depth's change over a pixel. Sky has no
 * neighbours. */
GTAOI_FI GV GTAOI_NAME(gtaoi_close)(const gtaoi_effort *e, ptrdiff_t at) {
    GTAOI_NO_CONTRACT
    GV w = GV_LOAD(e->planes[GTAOI_EFFORT_HEIGHT] + at),
       foot = GV_ADD(GV_MUL(w, GV_SET(e->foot)), GV_SET(e->foot_bias));
    foot = GV_ADD(foot, GV_ABS(GV_LOAD(e->planes[GTAOI_EFFORT_TILT_X] + at)));
    foot = GV_ADD(foot, GV_ABS(GV_LOAD(e->planes[GTAOI_EFFORT_TILT_Y] + at)));
    return GV_SELECT(GV_LT(GV_SET(GTAOI_SKY_LIMIT), w), GV_MUL(GV_SET(0.25f), foot), GV_SET(-1.0f));
}

/* Whether the pixels at `at` and, `steps` further along an axis, at `there` lie on each other's tangent planes; `tilt`
 * is the plane of tilts along that axis. */
GTAOI_FI GM GTAOI_NAME(gtaoi_coplanar)(const gtaoi_effort *e, ptrdiff_t at, ptrdiff_t there, const float *tilt,
                                       int steps, GV close) {
    GTAOI_NO_CONTRACT
    const float *height = e->planes[GTAOI_EFFORT_HEIGHT];
    GV away = GV_SUB(GV_LOAD(height + there), GV_LOAD(height + at)), step = GV_SET((float)steps);
    GM of_own = GV_LE(GV_ABS(GV_SUB(away, GV_MUL(GV_LOAD(tilt + at), step))), close);
    GM of_other = GV_LE(GV_ABS(GV_SUB(away, GV_MUL(GV_LOAD(tilt + there), step))), close);
    return GM_AND(of_own, of_other);
}

/* Neighbours share their slices: means over 5x5 pixels, the outer ones half, so that each of the 16 phases of the noise
 * has the same weight and what varies linearly stays; of those that lie on one surface, along the row and then along
 * the column. Columns x .. x + 63 of rows [y0, y1), whole tiles.
 * The window's variance D, as the first level has it, is mostly that of one slice. With n slices s^2 = D / n^1.5 is
 * left of it, and the rest of what the window then varies by, S^2, is the image: so the mean counts s^2 / S^2. */
GTAOI_FI void GTAOI_NAME(gtaoi_share_planes)(const gtao_context *c, int x, int y0, int y1, int more_planes) {
    GTAOI_NO_CONTRACT
    enum { TAPS, WEIGHT, SQUARES, VISIBLE, MORE, FIELDS = MORE + 12 };
    static const float window[5] = {0.5f, 1.0f, 1.0f, 1.0f, 0.5f};
    const gtaoi_effort *e = c->effort;
    const GV zero = GV_SET(0.0f), one = GV_SET(1.0f), limit = GV_SET(GTAOI_SKY_LIMIT), most = GV_SET(FLT_MAX);
    float *const visible = e->planes[GTAOI_EFFORT_SIGNAL], *const weights = visible + e->plane;
    float *const more = weights + e->plane + (c->bent ? 0 : 3 * e->plane);
    float ring[5][FIELDS][GTAOI_EFFORT_W], result[1 + 12][GTAOI_EFFORT_W], tile[5][GTAOI_EFFORT_W];
    int i, j, k, y;
    for (y = y0 - 2; y < y1 + 2; y++) {
        int row = y - 2;
        gtaoi_effort_tile *t;
        float n, settled;
        for (i = 0; y >= 0 && y < c->d.height && i < GTAOI_EFFORT_W; i += GTAOI_W) { /* sums along the row */
            ptrdiff_t at = (ptrdiff_t)y * e->pitch + x + i;
            GV close = GTAOI_NAME(gtaoi_close)(e, at), sum[FIELDS];
            float(*to)[GTAOI_EFFORT_W] = ring[y % 5];
            for (k = 0; k < MORE + more_planes; k++)
                sum[k] = zero;
            for (j = -2; j <= 2; j++) {
                GV share = GV_SET(window[j + 2]), weight = GV_MUL(GV_LOAD(weights + at + j), share), term;
                GM same = GV_LE(zero, one); /* the pixel itself, sky too */
                if (j)
                    same = GTAOI_NAME(gtaoi_coplanar)(e, at, at + j, e->planes[GTAOI_EFFORT_TILT_X], j, close);
                term = GV_MUL(weight, GV_LOAD(visible + at + j));
                sum[TAPS] = GV_ADD(sum[TAPS], GV_IF(same, share));
                sum[WEIGHT] = GV_ADD(sum[WEIGHT], GV_IF(same, weight));
                sum[VISIBLE] = GV_ADD(sum[VISIBLE], GV_IF(same, term));
                term = GV_MUL(term, GV_LOAD(visible + at + j)); /* masked last: outside the image is anything */
                sum[SQUARES] = GV_ADD(sum[SQUARES], GV_IF(same, term));
                for (k = 0; k < more_planes; k++) {
                    term = GV_MUL(weight, GV_LOAD(more + k * e->plane + at + j));
                    sum[MORE + k] = GV_ADD(sum[MORE + k], GV_IF(same, term));
                }
            }
            for (k = 0; k < MORE + more_planes; k++)
                GV_STORE(to[k] + i, sum[k]);
        }
        if (row < y0)
            continue;
        t = e->tile + row / GTAOI_EFFORT_H * e->tiles_x + x / GTAOI_EFFORT_W;
        n = (float)gtaoi_levels[t->level].slices;
        settled = gtaoi_levels[t->level].settled;
        for (i = 0; i < GTAOI_EFFORT_W; i += GTAOI_W) { /* and along the column */
            ptrdiff_t at = (ptrdiff_t)row * e->pitch + x + i;
            GV close = GTAOI_NAME(gtaoi_close)(e, at), sum[FIELDS], variance, share = one;
            for (k = 0; k < MORE + more_planes; k++)
                sum[k] = GV_LOAD(ring[row % 5][k] + i);
            for (j = -2; j <= 2; j++) {
                GM same;
                if (j == 0 || row + j < 0 || row + j >= c->d.height)
                    continue;
                same = GTAOI_NAME(gtaoi_coplanar)(e, at, at + j * e->pitch, e->planes[GTAOI_EFFORT_TILT_Y], j, close);
                for (k = 0; k < MORE + more_planes; k++) {
                    GV term = GV_MUL(GV_LOAD(ring[(row + j) % 5][k] + i), GV_SET(window[j + 2]));
                    sum[k] = GV_ADD(sum[k], GV_IF(same, term));
                }
            }
            for (k = VISIBLE; k < MORE + more_planes; k++)
                sum[k] = GV_DIV(sum[k], sum[WEIGHT]);
            variance = GV_SUB(GV_DIV(sum[SQUARES], sum[WEIGHT]), GV_MUL(sum[VISIBLE], sum[VISIBLE]));
            variance = GV_MAX(variance, zero);
            if (e->second) {
                GV left = GV_MUL(GV_LOAD(e->planes[GTAOI_EFFORT_VARIANCE] + at), GV_SET(settled));
                share = GV_MIN(GV_DIV(left, GV_ADD(variance, GV_SET(1e-7f))), one);
            } else {
                /* the variance of n values is (n - 1) / n of what they are drawn from; one value's is not known */
                GV w = GV_LOAD(e->planes[GTAOI_EFFORT_HEIGHT] + at), mean = sum[VISIBLE];
                GV of_mean = GV_DIV(variance, GV_SUB(sum[TAPS], one)), alone = GV_MUL(mean, GV_SUB(one, mean));
                GM solid = GV_LT(limit, w), single = GV_LT(sum[TAPS], GV_SET(1.25f));
                int fresh = row % GTAOI_EFFORT_H == 0;
                of_mean = GV_SELECT(single, zero, of_mean);
                alone = GV_IF(GM_AND(solid, single), alone);
                GV_STORE(tile[4] + i, GV_ADD(fresh ? zero : GV_LOAD(tile[4] + i), alone));
                GV_STORE(e->planes[GTAOI_EFFORT_VARIANCE] + at, variance);
                GV_STORE(tile[0] + i, GV_ADD(fresh ? zero : GV_LOAD(tile[0] + i), GV_IF(solid, of_mean)));
                GV_STORE(tile[1] + i, GV_ADD(fresh ? zero : GV_LOAD(tile[1] + i), GV_IF(solid, one)));
                GV_STORE(tile[2] + i, GV_MIN(fresh ? most : GV_LOAD(tile[2] + i), GV_SELECT(solid, w, most)));
                GV_STORE(tile[3] + i, GV_MAX(fresh ? limit : GV_LOAD(tile[3] + i), w));
            }
            sum[VISIBLE] = GV_MIN(GV_MAX(sum[VISIBLE], zero), one);
            for (k = 0; k < 1 + more_planes; k++) {
                GV own = GV_LOAD((k ? more + (k - 1) * e->plane : visible) + at);
                GV mean = sum[VISIBLE + k];
                /* equal ones stay as they are */
                GV_STORE(result[k] + i, GV_ADD(mean, GV_MUL(GV_SUB(one, share), GV_SUB(own, mean))));
            }
        }
        gtaoi_store_shared(c, x, row, n, result);
        if (!e->second && (row % GTAOI_EFFORT_H == GTAOI_EFFORT_H - 1 || row == c->d.height - 1))
            gtaoi_sum_tile(t, tile);
    }
}

GTAOI_FN void GTAOI_NAME(gtaoi_share)(const gtao_context *c, int x, int y0, int y1) {
    if (c->effort->more == 0)
        GTAOI_NAME(gtaoi_share_planes)(c, x, y0, y1, 0);
    else
        GTAOI_NAME(gtaoi_share_planes)(c, x, y0, y1, c->effort->more);
}

/* Four groups of pixels: the phases of one stretch of a row, or, if all directions are alike or each pixel has its own,
 * one group after the other. */
typedef struct GTAOI_GROUPS {
    int x, y, count;            /* of its pixels in the image */
    int groups, step;           /* columns from one group to the next */
    const float *at[4];         /* the groups' heights */
    const GV *normals;          /* the caller's: [group][component], or null */
    GV want[4];                 /* positive where a result is wanted, negative outside the image */
    GV v[4], b[12], s[16];      /* visibility, bent normals: [group][component], signal: [plane][group] */
    float keys[4][GTAOI_LANES]; /* classes of the radius */
    gtaoi_over over[4][4];      /* of this row, by group and slice */
    const gtaoi_tile *tile;     /* what they may see */
    unsigned skips;
    const gtaoi_tile *seen[4]; /* the same, null for groups that march everything */
} GTAOI_GROUPS;

/* Which pixels of a group remain to be computed; in *seen what their search may leave out: null if nothing. */
GTAOI_FI GM GTAOI_NAME(gtaoi_open_group)(const gtao_context *c, const GTAOI_PIXEL *p, GM active,
                                         const GTAOI_GROUPS *block, int g, const gtaoi_tile **seen, gtao_stats *stats) {
    GTAOI_NO_CONTRACT
    const gtaoi_tile *t = block->tile;
    int x = block->x + g * block->step, pixels = c->period == 4 ? 4 * GTAOI_W : GTAOI_W, open = 0;
    unsigned of = GTAOI_NAME(gtaoi_cells_of)(x, pixels);
    *seen = 0;
    if ((t->open & of) == of && (block->skips & GTAO_SKIP_OPEN)) {
        GV turn = GV_ABS(GV_SUB(p->gx, GTAOI_NAME(gtaoi_plane_of)(c, t, 0, x)));
        turn = GV_ADD(turn, GV_ABS(GV_SUB(p->gy, GTAOI_NAME(gtaoi_plane_of)(c, t, 1, x))));
        open = !GM_ANY(GM_ANDNOT(active, GV_LE(turn, GTAOI_NAME(gtaoi_plane_of)(c, t, 2, x))));
    } else if (t->known) {
        GV turn = GV_ADD(GV_ABS(GV_SUB(p->gx, GV_SET(t->gx))), GV_ABS(GV_SUB(p->gy, GV_SET(t->gy))));
        if (GM_ANY(GM_ANDNOT(active, GV_LE(turn, GV_SET(t->slack)))) || !(block->skips & GTAO_SKIP_SECTORS))
            return active;
        if (!c->per_pixel_noise && (block->skips & GTAO_SKIP_OPEN))
            open = gtaoi_directions_open(
                c, t, ((block->y & (c->period - 1)) * c->period + (c->period == 4 ? g : 0)) * c->slices);
        if (!open)
            *seen = t;
    }
    if (!open)
        return active;
    stats->open += (uint64_t)gtaoi_popcount(GM_BITS(active));
    return GV_LT(GV_SET(1.0f), GV_SET(0.0f));
}

/* A group of pixels that occlude nothing and have no result: sky, masked. */
GTAOI_FI void GTAOI_NAME(gtaoi_leave)(const gtao_context *c, const GTAOI_PIXEL *p, GTAOI_GROUPS *block, int g) {
    block->v[g] = GV_SET(1.0f);
    if (c->signal) {
        GV share = GV_SET(c->d.weighting == GTAO_WEIGHTING_COSINE ? 2.0f / 3.0f : 0.5f);
        block->s[g] = GV_SET(1.0f), block->s[4 + g] = GV_MUL(share, p->nx);
        block->s[8 + g] = GV_MUL(share, p->ny), block->s[12 + g] = GV_MUL(share, p->nz);
    }
}

GTAOI_FI void GTAOI_NAME(gtaoi_clear)(GTAOI_SUM *sum) {
    const GV zero = GV_SET(0.0f);
    sum->visible = sum->open = sum->bx = sum->by = sum->bz = sum->bv = sum->jacobian_open = zero;
    sum->occluded = GV_LT(GV_SET(1.0f), zero);
}

/* Any settings: stage by stage over the four groups, so that the stages' long dependency chains overlap. Returns whether
 * all slices are in. */
GTAOI_FN int GTAOI_NAME(gtaoi_block_any)(const gtao_context *c, GTAOI_GROUPS *block, gtao_stats *stats) {
    GTAOI_PIXEL pixel[4];
    GTAOI_SUM sum[4];
    GTAOI_MOMENTS moments[4];
    GM active[4];
    int period = c->period, g, k, any = 0, groups = block->groups, step = block->step, x0 = block->x, y = block->y;
    int keep = !c->pass && (c->o.horizons || c->o.arcs || c->o.slices);
    for (g = 0; g < groups; g++) {
        active[g] = GTAOI_NAME(gtaoi_setup)(c, &pixel[g], block->at[g], x0 + g * step, y, block->want[g],
                                            block->normals ? block->normals + 3 * g : 0, stats);
        GTAOI_NAME(gtaoi_clear)(&sum[g]);
        if (c->o.sh)
            memset(&moments[g], 0, sizeof moments[g]);
    }
    if (c->keep)
        GTAOI_NAME(gtaoi_keep)(c, pixel, active, groups, x0, y);
    for (g = 0; g < groups; g++) {
        active[g] = GTAOI_NAME(gtaoi_open_group)(c, &pixel[g], active[g], block, g, &block->seen[g], stats);
        any |= GM_ANY(active[g]);
    }
    if (c->pass && c->pass->tilt_x) {
        GTAOI_NAME(gtaoi_keep_tilts)(c->pass, pixel, active, groups, x0, y);
        return 0;
    }
    if (c->slice_begin > 0)
        GTAOI_NAME(gtaoi_sums)(c, sum, moments, groups, x0, y, 0);
    any |= c->o.horizons || keep;
    for (g = 0; c->o.surface && g < groups; g++)
        GTAOI_NAME(gtaoi_store_surface)(c, &pixel[g], active[g], x0 + g * step, y);
    for (k = c->slice_begin; any && k < c->slice_end; k++) {
        GTAOI_FRAME frame[4];
        GTAOI_HORIZONS found[4];
        GTAOI_ARCS arcs[4];
        int first = (y & (period - 1)) * period * c->slices + k, stride = period == 4 ? c->slices : 0;
        for (g = 0; g < groups; g++)
            if (GM_ANY(active[g]))
                GTAOI_NAME(gtaoi_slice)(c, &pixel[g], c->slice + first + g * stride, k, &frame[g], &found[g]);
        for (g = c->arcs ? groups : 0; g < groups; g++)
            if (GM_ANY(active[g])) {
                if (c->per_pixel_noise)
                    GTAOI_NAME(gtaoi_search_noise)
                (c, &pixel[g], &frame[g], &found[g], active[g], block->seen[g], stats);
                else GTAOI_NAME(gtaoi_search_table)(c, &pixel[g], &frame[g], &found[g], block->at[g],
                                                    first + g * stride, active[g], x0 + g * step, y, block->seen[g],
                                                    stats);
            }
        for (g = c->arcs ? 0 : groups; g < groups; g++)
            if (GM_ANY(active[g]))
                GTAOI_NAME(gtaoi_search_arcs)
        (c, &pixel[g], &frame[g], &found[g], &arcs[g], block->at[g], first + g * stride, k, active[g], x0 + g * step, y,
         block->seen[g], stats);
        for (g = 0; keep && g < groups; g++)
            GTAOI_NAME(gtaoi_store_slice)(c, &frame[g], &found[g], &arcs[g], active[g], k, x0 + g * step, y);
        if (c->pass)
            GTAOI_NAME(gtaoi_add_far)(c, pixel, frame, found, active, groups, k, x0, y);
        for (g = 0; g < groups; g++)
            if (GM_ANY(active[g]))
                GTAOI_NAME(gtaoi_integrate)(c, &pixel[g], &frame[g], &found[g], &sum[g]);
        for (g = 0; c->o.sh && g < groups; g++)
            if (GM_ANY(active[g]))
                GTAOI_NAME(gtaoi_integrate_sh)(c, &pixel[g], &frame[g], &found[g], &moments[g]);
        for (g = 0; c->arcs && g < groups; g++)
            if (GM_ANY(active[g]))
                GTAOI_NAME(gtaoi_integrate_arcs)
        (c, &pixel[g], &frame[g], &arcs[g], &sum[g], c->o.sh ? &moments[g] : 0);
    }
    if (c->slice_end < c->slices) { /* more to come */
        GTAOI_NAME(gtaoi_sums)(c, sum, moments, groups, x0, y, 1);
        return 0;
    }
    if (c->o.sh)
        GTAOI_NAME(gtaoi_store_sh)(c, pixel, sum, moments, active, groups, x0, y, block->count);
    for (g = 0; g < groups; g++) {
        if (GM_ANY(active[g]))
            block->v[g] = GTAOI_NAME(gtaoi_finish)(c, &pixel[g], &sum[g], active[g], block->s + g);
        else
            GTAOI_NAME(gtaoi_leave)(c, &pixel[g], block, g);
        if (c->bent)
            block->b[3 * g] = pixel[g].nx, block->b[3 * g + 1] = pixel[g].ny, block->b[3 * g + 2] = pixel[g].nz;
    }
    return 1;
}

/* Samples in the falloff ring that rise above what had been found before them, of a block's groups. They are looked at
 * when all groups have marched: fewer of them rise then, and it is once a block that a loop of unknown length ends. */
#define GTAOI_NOTES GTAOI_NAME(gtaoi_notes)
typedef struct GTAOI_NOTES {
    int count;
    struct { /* of eight samples */
        const gtaoi_sample *list;
        int group;
        GM own; /* lanes that the list is for */
    } of[GTAOI_NOTES_MAX];
    uint16_t lanes[GTAOI_NOTES_MAX][16]; /* that note a sample, [note][sample][side] */
} GTAOI_NOTES;

/* Which of them any lane notes. */
GTAOI_FI unsigned GTAOI_NAME(gtaoi_noted)(const uint16_t lanes[16]) {
#if GTAOI_W > 1 && GTAOI_X86
    const __m128i zero = _mm_setzero_si128(), *at = (const __m128i *)(const void *)lanes;
    __m128i a = _mm_cmpeq_epi16(_mm_loadu_si128(at), zero), b = _mm_cmpeq_epi16(_mm_loadu_si128(at + 1), zero);
    return (unsigned)_mm_movemask_epi8(_mm_packs_epi16(a, b)) ^ 0xffffu;
#else
    unsigned bits = 0, i;
    for (i = 0; i < 16; i++)
        bits |= (unsigned)(lanes[i] != 0) << i;
    return bits;
#endif
}

/* A sample on the side of `sign`, as gtaoi_visit has it. */
GTAOI_FI GM GTAOI_NAME(gtaoi_visit_signed)(const GTAOI_PIXEL *p, const GTAOI_FRAME *f, GV sign, const float *at,
                                           const gtaoi_sample *q, GTAOI_SAMPLE *sample, GV *rise) {
    GTAOI_NO_CONTRACT
    GV inv = GV_SET(q->inv_length), slope = GV_MUL(GV_LOAD(at), inv), reach2;
    GV tangent = GV_ADD(GV_MUL(p->gx, GV_SET(q->ux)), GV_MUL(p->gy, GV_SET(q->uy)));
    *rise = GV_SUB(slope, GV_ADD(GV_MUL(p->w0, inv), GV_MUL(sign, tangent)));
    sample->kappa = GV_ADD(GV_MUL(*rise, f->kappa_scale), GV_MUL(sign, f->kappa_tangent));
    sample->rho = GV_ADD(GV_MUL(sample->kappa, sample->kappa), GV_SET(1.0f));
    sample->reach = GV_MUL(slope, f->reach);
    reach2 = GV_MUL(sample->reach, sample->reach);
    return GV_LT(sample->rho, reach2);
}

GTAOI_FN void GTAOI_NAME(gtaoi_fade_noted)(const gtao_context *c, GTAOI_NOTES *notes, const GTAOI_PIXEL *p,
                                           const GTAOI_FRAME *f, GTAOI_HORIZONS *s, const float *const *at) {
    GTAOI_NO_CONTRACT
    int i, k;
    for (i = 0; i < notes->count; i += 4) {
        uint64_t noted = 0;
        for (k = 0; k < gtaoi_imin(notes->count - i, 4); k++)
            noted |= (uint64_t)GTAOI_NAME(gtaoi_noted)(notes->lanes[i + k]) << 16 * k;
        for (; noted; noted &= noted - 1) {
            int bit = gtaoi_lowest(noted), n = i + (bit >> 4), side = bit & 1, g = notes->of[n].group;
            const gtaoi_sample *q = notes->of[n].list + (bit >> 1 & 7);
            GV sign = GV_SET(side ? -1.0f : 1.0f), rise, faded;
            GTAOI_SAMPLE sample;
            GM fade = GTAOI_NAME(gtaoi_visit_signed)(&p[g], &f[g], sign, at[g] + q->offset[side], q, &sample, &rise);
            fade = GM_AND(GM_AND(fade, GV_LT(s[g].rise[side], rise)), notes->of[n].own);
            faded = GTAOI_NAME(gtaoi_faded)(c, &sample, GV_MUL(sign, f[g].cos_tangent));
            s[g].cosine[side] = GV_MAX(s[g].cosine[side], GV_SELECT(fade, faded, s[g].cosine[side]));
        }
    }
    notes->count = 0;
}

/* The horizon search of the plain kind in one chunk: gtaoi_march up to what it notes, eight samples a note. */
GTAOI_FI void GTAOI_NAME(gtaoi_march_plain)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                            GTAOI_HORIZONS *horizons, const float *at, const gtaoi_sample *q, int n0,
                                            int n1, uint16_t *lanes) {
    GTAOI_NO_CONTRACT
    GTAOI_HORIZONS s = *horizons;
    GTAOI_SAMPLE a, b;
    const gtaoi_sample *end = q + (n0 < n1 ? n0 : n1);
    for (; q < end; q++, lanes += 2) {
        lanes[0] = (uint16_t)GM_BITS(GTAOI_NAME(gtaoi_visit)(c, p, f, &s, 0, at, q, &a, 0, 1, 1));
        lanes[1] = (uint16_t)GM_BITS(GTAOI_NAME(gtaoi_visit)(c, p, f, &s, 1, at, q, &b, 0, 1, 1));
    }
    if (n0 != n1) { /* one side has left the image */
        int side = n1 > n0;
        GV sign = GV_SET(side ? -1.0f : 1.0f), most = s.rise[side], rise;
        for (end += side ? n1 - n0 : n0 - n1; q < end; q++, lanes += 2) {
            GM ring = GTAOI_NAME(gtaoi_visit_signed)(p, f, sign, at + q->offset[side], q, &a, &rise);
            GV reach2 = GV_MUL(a.reach, a.reach);
            most = GV_MAX_IF(GV_LE(a.rho, GV_MUL(reach2, GV_SET(c->inner2))), most, rise);
            lanes[side] = (uint16_t)GM_BITS(GM_AND(ring, GV_LT(most, rise)));
        }
        s.rise[side] = most;
    }
    *horizons = s;
}

/* Samples i .. n0 - 1 and i .. n1 - 1 of a list for the lanes `own` of group g, and notes of them. */
GTAOI_FI void GTAOI_NAME(gtaoi_search_chunk)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                             GTAOI_HORIZONS *s, const float *at, int g, const gtaoi_sample *q, int n0,
                                             int n1, GM own, GTAOI_NOTES *notes) {
    GTAOI_HORIZONS found;
    int first = notes->count, note = first, k = n0 > n1 ? n0 : n1;
    const gtaoi_sample *list = q;
    do {
        notes->of[note].list = list, notes->of[note].group = g, notes->of[note].own = own;
        memset(notes->lanes[note++], 0, sizeof notes->lanes[0]);
        list += 8;
    } while ((k -= 8) > 0);
    notes->count = note;
    /* Lanes of another class note nothing. */
    found.rise[0] = GV_SELECT(own, s->rise[0], GV_SET(FLT_MAX));
    found.rise[1] = GV_SELECT(own, s->rise[1], GV_SET(FLT_MAX));
    found.cosine[0] = found.cosine[1] = found.rise[0]; /* not looked at */
    GTAOI_NAME(gtaoi_march_plain)(c, p, f, &found, at, q, n0, n1, notes->lanes[first]);
    s->rise[0] = GV_SELECT(own, found.rise[0], s->rise[0]);
    s->rise[1] = GV_SELECT(own, found.rise[1], s->rise[1]);
}

/* A list that the border or what the tile may see shortens, or of several chunks. */
GTAOI_FN void GTAOI_NAME(gtaoi_search_part)(const gtao_context *c, const GTAOI_PIXEL *pixels, const GTAOI_FRAME *frames,
                                            GTAOI_HORIZONS *horizons, const GTAOI_GROUPS *block, int g, int index,
                                            GM own, const gtaoi_over *over, GTAOI_NOTES *notes, gtao_stats *stats) {
    GTAOI_HORIZONS *s = &horizons[g];
    const gtaoi_sample *q = over->list;
    int n = over->n, n0 = over->rows[0], n1 = over->rows[1], x = block->x + g * block->step, y = block->y;
    int x1 = x + (GTAOI_W - 1) * c->period, ax = over->columns, range[3], i, end;
    int over_columns = ax < GTAOI_PAD * c->period - c->period || (x >= ax && x1 + ax < c->d.width);
    gtaoi_range(c, block->seen[g], index, q, n, range);
    gtaoi_count_samples(range, 0, n, gtaoi_popcount(GM_BITS(own)), stats);
    if (c->d.border != GTAO_BORDER_OPEN && !(over_columns && n0 == n && n1 == n)) {
        GTAOI_HORIZONS moved = *s;
        GTAOI_NAME(gtaoi_search_list)
        (c, &pixels[g], &frames[g], &moved, block->at[g], index, q, range[0], range[1], range[2], x, y);
        for (i = 0; i < 2; i++) {
            s->rise[i] = GV_SELECT(own, moved.rise[i], s->rise[i]);
            s->cosine[i] = GV_SELECT(own, moved.cosine[i], s->cosine[i]);
        }
        return;
    }
    if (!over_columns)
        n0 = gtaoi_reach(c, q, n, 1, x, x1, y), n1 = gtaoi_reach(c, q, n, -1, x, x1, y);
    n0 = gtaoi_imin(n0, range[1]), n1 = gtaoi_imin(n1, range[2]);
    for (i = range[0]; i < n0 || i < n1; i = end) {
        end = i - i % GTAOI_MARCH + GTAOI_MARCH;
        if (i > range[0] || notes->count + GTAOI_MARCH / 8 > GTAOI_NOTES_MAX)
            GTAOI_NAME(gtaoi_fade_noted)(c, notes, pixels, frames, horizons, block->at);
        GTAOI_NAME(gtaoi_search_chunk)
        (c, &pixels[g], &frames[g], s, block->at[g], g, q + i, gtaoi_imax(gtaoi_imin(n0, end) - i, 0),
         gtaoi_imax(gtaoi_imin(n1, end) - i, 0), own, notes);
    }
}

/* Search one slice of group g of the plain kind: lanes by radius class, nearly always of one. */
GTAOI_FI void GTAOI_NAME(gtaoi_search_plain)(const gtao_context *c, const GTAOI_PIXEL *p, const GTAOI_FRAME *f,
                                             GTAOI_HORIZONS *s, GTAOI_GROUPS *block, int g, int index, GM active,
                                             gtaoi_over *over, GTAOI_NOTES *notes, gtao_stats *stats) {
    GTAOI_NO_CONTRACT
    do {
        float key = block->keys[g][gtaoi_lowest(GM_BITS(active))];
        GM own = GM_AND(active, GV_EQ(p[g].key, GV_SET(key)));
        if (over->key != key || over->index != index)
            gtaoi_find_list(c, index, key, block->y, over);
        if (block->seen[g] || over->n > GTAOI_MARCH || over->rows[0] + over->rows[1] < 2 * over->n ||
            over->columns >= (GTAOI_PAD - 1) * 4 || notes->count > GTAOI_NOTES_MAX - GTAOI_MARCH / 8) {
            GTAOI_NAME(gtaoi_search_part)(c, p, f, s, block, g, index, own, over, notes, stats);
        } else {
            stats->samples += (uint64_t)(unsigned)(2 * over->n * gtaoi_popcount(GM_BITS(own)));
            GTAOI_NAME(gtaoi_search_chunk)
            (c, &p[g], &f[g], &s[g], block->at[g], g, over->list, over->n, over->n, own, notes);
        }
        active = GM_ANDNOT(active, own);
    } while (GM_ANY(active));
}

/* The same for what most images are made with (c->plain), all in one piece. */
GTAOI_FN void GTAOI_NAME(gtaoi_block_plain)(const gtao_context *c, GTAOI_GROUPS *block, gtao_stats *stats) {
    GTAOI_NO_CONTRACT
    int period = c->period, y = block->y, g, k, any = 0, stride = period == 4 ? c->slices : 0;
    GTAOI_PIXEL p[4];
    GTAOI_SUM sum[4];
    GM active[4];
    for (g = 0; g < block->groups; g++) {
        active[g] = GTAOI_NAME(gtaoi_setup)(c, &p[g], block->at[g], block->x + g * block->step, y, block->want[g],
                                            block->normals ? block->normals + 3 * g : 0, stats);
        if (GM_ANY(active[g]))
            GV_STORE(block->keys[g], p[g].key);
        GTAOI_NAME(gtaoi_clear)(&sum[g]);
    }
    if (c->keep)
        GTAOI_NAME(gtaoi_keep)(c, p, active, block->groups, block->x, y);
    for (g = 0; g < block->groups; g++) {
        active[g] = GTAOI_NAME(gtaoi_open_group)(c, &p[g], active[g], block, g, &block->seen[g], stats);
        any |= GM_ANY(active[g]);
    }
    for (k = 0; any && k < c->slices; k++) {
        int first = (y & (period - 1)) * period * c->slices + k;
        GTAOI_FRAME f[4];
        GTAOI_HORIZONS s[4];
        GTAOI_NOTES notes;
        for (g = 0; g < block->groups; g++)
            if (GM_ANY(active[g]))
                GTAOI_NAME(gtaoi_slice)(c, &p[g], c->slice + first + g * stride, k, &f[g], &s[g]);
        notes.count = 0;
        for (g = 0; g < block->groups; g++)
            if (GM_ANY(active[g]))
                GTAOI_NAME(gtaoi_search_plain)
        (c, p, f, s, block, g, first + g * stride, active[g], &block->over[g][k & 3], &notes, stats);
        GTAOI_NAME(gtaoi_fade_noted)(c, &notes, p, f, s, block->at);
        for (g = 0; g < block->groups; g++)
            if (GM_ANY(active[g]))
                GTAOI_NAME(gtaoi_integrate)(c, &p[g], &f[g], &s[g], &sum[g]);
    }
    for (g = 0; g < block->groups; g++) {
        if (GM_ANY(active[g]))
            block->v[g] = GTAOI_NAME(gtaoi_finish)(c, &p[g], &sum[g], active[g], block->s + g);
        else
            GTAOI_NAME(gtaoi_leave)(c, &p[g], block, g);
        if (c->bent)
            block->b[3 * g] = p[g].nx, block->b[3 * g + 1] = p[g].ny, block->b[3 * g + 2] = p[g].nz;
    }
}

/* A whole block in an open tile: whether all its tangent planes are the tile's, told without the work of gtaoi_setup.
 * With n.r0 < 0 and g = w0 (nx / fx, ny / fy) / n.r0, |g - G| <= slack is
 * |w0 (nx / fx, ny / fy) - G n.r0| <= -slack n.r0; the margin is the rounding of both. */
GTAOI_FN int GTAOI_NAME(gtaoi_block_open)(const gtao_context *c, GTAOI_GROUPS *block, gtao_stats *stats) {
    GTAOI_NO_CONTRACT
    const gtaoi_tile *t = block->tile;
    const GV zero = GV_SET(0.0f), limit = GV_SET(GTAOI_SKY_LIMIT);
    float ry = gtaoi_clamp(((float)block->y + 0.5f - c->cy) * c->by1, -GTAOI_RAY_LIMIT, GTAOI_RAY_LIMIT);
    int g;
    for (g = 0; g < block->groups; g++) {
        int at = block->x + g * block->step;
        GV gx = GTAOI_NAME(gtaoi_plane_of)(c, t, 0, at), gy = GTAOI_NAME(gtaoi_plane_of)(c, t, 1, at);
        GV slack = GTAOI_NAME(gtaoi_plane_of)(c, t, 2, at), least = GV_ADD(GV_ADD(GV_ABS(gx), GV_ABS(gy)), slack);
        GTAOI_PIXEL p;
        GV w0 = GV_LOAD(block->at[g]), rr = GV_SET(1.0f), nr, off;
        GM good = GV_LT(limit, w0), missing;
        p.rx = p.ry = zero;
        if (!c->orthographic) {
            GV x = GV_SET((float)(block->x + g * block->step));
            p.x = GV_ADD(x, GV_MUL(GTAOI_NAME(gtaoi_iota)(), GV_SET((float)c->period)));
            p.rx = GV_MUL(GV_SUB(GV_ADD(p.x, GV_SET(0.5f)), GV_SET(c->cx)), GV_SET(c->bx1));
            p.ry = GV_SET(ry);
            rr = GV_ADD(GV_ADD(GV_MUL(p.rx, p.rx), GV_SET(ry * ry)), rr);
        } else {
            w0 = rr;
        }
        missing = GTAOI_NAME(gtaoi_load_normals)(c, &p, block->normals[3 * g], block->normals[3 * g + 1],
                                                 block->normals[3 * g + 2]);
        least = GV_SUB(GV_MUL(slack, GV_SET(0.999f)), GV_MUL(least, GV_SET(9.5367432e-7f)));
        nr = GV_ADD(GV_ADD(GV_MUL(p.nx, p.rx), GV_MUL(p.ny, p.ry)), p.nz);
        off = GV_ABS(GV_SUB(GV_MUL(w0, GV_MUL(p.nx, GV_SET(c->bx1))), GV_MUL(gx, nr)));
        off = GV_ADD(off, GV_ABS(GV_SUB(GV_MUL(w0, GV_MUL(p.ny, GV_SET(c->by1))), GV_MUL(gy, nr))));
        good = GM_ANDNOT(GM_AND(good, GV_LE(off, GV_MUL(GV_SUB(zero, nr), least))), missing);
        good = GM_AND(good, GV_LT(GV_MUL(rr, GV_SET(1.01f * GTAOI_FACING_MIN * GTAOI_FACING_MIN)), GV_MUL(nr, nr)));
        if (GM_BITS(good) != GTAOI_ALL)
            return 0;
        block->v[g] = GV_SET(1.0f);
        if (c->bent)
            block->b[3 * g] = p.nx, block->b[3 * g + 1] = p.ny, block->b[3 * g + 2] = p.nz;
    }
    stats->open += (uint64_t)block->count;
    return 1;
}

/* The same of `n` pixels from column x on for results without normals, told without even a look at their heights:
 * whether the caller's normals all are those of the planes. */
GTAOI_FN int GTAOI_NAME(gtaoi_block_flat)(const gtao_context *c, const gtaoi_tile *t, const float *normals, int x,
                                          int n) {
    GTAOI_NO_CONTRACT
    int part = (x & 63) / GTAOI_CELL, pixels = gtaoi_imin(n, GTAOI_CELL), components = c->d.normal_components, end, i,
        k;
    GM flat = GV_LE(GV_SET(0.0f), GV_SET(t->allowed[part][0]));
    for (end = part + (n + GTAOI_CELL - 1) / GTAOI_CELL; part < end; part++, normals += components * GTAOI_CELL) {
        const float *normal = t->normals[part], *allowed = t->allowed[part];
        const int turn = components == 4 ? GTAOI_W % 4 : GTAOI_W % 3;
        if (c->normal_plane) {
            for (k = 0; k < 3; k++)
                for (i = 0; i < pixels; i += GTAOI_W) {
                    GV off = GV_SUB(GV_LOAD(normals + k * c->normal_plane + i), GV_SET(normal[k]));
                    flat = GM_AND(flat, GV_LE(GV_ABS(off), GV_SET(allowed[k])));
                }
        } else {
            for (i = k = 0; i < components * pixels; i += GTAOI_W) {
                GV off = GV_SUB(GV_LOAD(normals + i), GV_LOAD(normal + k));
                flat = GM_AND(flat, GV_LE(GV_ABS(off), GV_LOAD(allowed + k)));
                k += turn, k -= k < components ? 0 : components;
            }
        }
    }
    return GM_BITS(flat) == GTAOI_ALL;
}

/* Whether no height of a block is above a limit; what lies past the end of a row does not matter. Such pixels are sky
 * or their radius is less than a pixel. */
GTAOI_FN int GTAOI_NAME(gtaoi_block_blank)(const gtao_context *c, float limit, const float *row, int x, int count,
                                           gtao_stats *stats) {
    const GV sky = GV_SET(GTAOI_SKY_LIMIT);
    int g, i, n = 0, step = c->period == 4 ? 1 : GTAOI_W;
    GM above = GV_LT(sky, sky), solid[4];
    for (g = 0; g < 4; g++) {
        GV w = GV_LOAD(row + (c->period == 4 ? g * c->segment + x / 4 : x + g * GTAOI_W));
        above = GM_OR(above, GV_LT(GV_SET(limit), w)), solid[g] = GV_LT(sky, w);
    }
    if (GM_ANY(above))
        return 0;
    for (g = 0; limit > GTAOI_SKY_LIMIT && g < 4; g++)
        for (i = 0; i < GTAOI_W; i++)
            n += (GM_BITS(solid[g]) >> i & 1u) && g * step + i * c->period < count;
    stats->pixels += (uint64_t)count, stats->small_radius += (uint64_t)n, stats->radius_skipped += (uint64_t)n;
    stats->sky += (uint64_t)(count - n), stats->sky_skipped += (uint64_t)(count - n);
    return 1;
}

/* Visibility 1, for pixels without horizons. */
GTAOI_FN void GTAOI_NAME(gtaoi_store_ones)(const gtao_context *c, int x, int y, int n) {
    float ones[4 * GTAOI_LANES], s[4][4 * GTAOI_LANES];
    int i = gtaoi_imax(c->x_begin - x, 0);
    x += i, n = gtaoi_imin(n - i, c->x_end - x);
    if (!c->signal && c->o.visibility && c->o.visibility_format == GTAO_FORMAT_FLOAT && !c->o.packed) {
        float *to = (float *)(void *)((char *)c->o.visibility + (ptrdiff_t)y * c->o.visibility_stride) + x;
        for (i = 0; i + GTAOI_W <= n; i += GTAOI_W)
            GV_STORE(to + i, GV_SET(1.0f));
        for (; i < n; i++)
            to[i] = 1.0f;
    } else {
        for (i = 0; i < 4 * GTAOI_LANES; i++)
            ones[i] = s[0][i] = 1.0f;
        gtaoi_store(c, x, y, n, ones, 0, s);
    }
}

/* Joins a block's results with those of the slices before. */
GTAOI_FN void GTAOI_NAME(gtaoi_continue)(const gtao_context *c, GTAOI_GROUPS *block) {
    const char *row = (const char *)c->o.signal + (ptrdiff_t)block->y * c->o.signal_stride;
    GV part[4], whole[4];
    int i;
    GTAOI_NAME(gtaoi_part)(c, block->x, block->y, block->s, part, whole);
    GTAOI_NAME(gtaoi_average)((const float *)(const void *)row + block->x, part, block->v);
    memcpy(block->s, whole, sizeof whole);
    for (i = 1; i < c->signal - 1; i++) {
        const char *plane = row + (i + 1) * c->o.signal_plane_stride;
        GTAOI_NAME(gtaoi_average)((const float *)(const void *)plane + block->x, part, block->s + 4 * i);
    }
}

/* The block's results to the caller's buffers, in image order. */
GTAOI_FN void GTAOI_NAME(gtaoi_block_store)(const gtao_context *c, const GTAOI_GROUPS *block) {
    enum { BLOCK = 4 * GTAOI_W };
    float image_v[BLOCK], image_b[3 * BLOCK], image_s[4][4 * GTAOI_LANES];
    int g, i, j, last;
    if (c->period == 4) {
        GTAOI_NAME(gtaoi_store4)(image_v, 4, block->v);
        if (c->bent)
            for (i = 0; i < 3; i++)
                GTAOI_NAME(gtaoi_store4)(image_b + 4 * i, 12, block->b + 4 * i);
        for (i = 0; i < c->signal - 1; i++)
            GTAOI_NAME(gtaoi_store4)(image_s[i], 4, block->s + 4 * i);
    } else {
        for (g = 0; g < block->groups; g++) {
            GV_STORE(image_v + g * GTAOI_W, block->v[g]);
            for (i = 0; i < c->signal - 1; i++)
                GV_STORE(image_s[i] + g * GTAOI_W, block->s[4 * i + g]);
            for (j = 0; c->bent && j < 3; j++) {
                float component[GTAOI_W];
                GV_STORE(component, block->b[3 * g + j]);
                for (i = 0; i < GTAOI_W; i++)
                    image_b[3 * (g * GTAOI_W + i) + j] = component[i];
            }
        }
    }
    j = gtaoi_imax(c->x_begin - block->x, 0), last = gtaoi_imin(block->count, c->x_end - block->x);
    if (j < last)
        gtaoi_store(c, block->x + j, block->y, last - j, image_v + j, image_b + 3 * j, image_s);
}

GTAOI_FN void GTAOI_NAME(gtaoi_rows)(const gtao_context *c, int y0, int y1, int x_from, int x_to,
                                     const gtaoi_tile *const *tiles, unsigned skips, gtao_stats *stats) {
    enum { BLOCK = 4 * GTAOI_W };
    const gtao_desc *d = &c->d;
    int x0, y, i, g, k, period = c->period, components = d->normal_components;
    GTAOI_GROUPS block;
    block.step = period == 4 ? 1 : GTAOI_W;
    for (y = y0; y < y1; y++) {
        const char *normals = d->normals ? (const char *)d->normals + (ptrdiff_t)y * d->normal_stride : 0;
        const uint8_t *mask = d->mask ? d->mask + (ptrdiff_t)y * d->mask_stride : 0;
        const float *row_normals = (const float *)(const void *)normals;
        const float *row = gtaoi_row(c, y) + GTAOI_PAD;
        memset(block.over, 0, sizeof block.over);
        for (x0 = x_from; x0 < x_to; x0 += BLOCK) {
            float wanted[BLOCK];
            GV n[12];
            int count = gtaoi_imin(BLOCK, d->width - x0), open, j;
            if (c->frame && gtaoi_at_rest(c->frame, x0 / GTAOI_TILE_W, y / GTAOI_TILE_H, 2)) {
                stats->unchanged += (uint64_t)count;
                continue;
            }
            block.tile = tiles[(x0 - x_from) >> 6], block.skips = skips;
            if (!c->bent && block.tile->sky && (skips & GTAO_SKIP_SKY)) {
                GTAOI_NAME(gtaoi_store_ones)(c, x0, y, count);
                stats->pixels += (uint64_t)count, stats->sky += (uint64_t)count, stats->sky_skipped += (uint64_t)count;
                continue;
            }
            if (!c->bent && block.tile->some_blank &&
                GTAOI_NAME(gtaoi_block_blank)(c, block.tile->blank, row, x0, count, stats)) {
                GTAOI_NAME(gtaoi_store_ones)(c, x0, y, count);
                continue;
            }
            open = (block.tile->open & GTAOI_NAME(gtaoi_cells_of)(x0, BLOCK)) == GTAOI_NAME(gtaoi_cells_of)(x0, BLOCK);
            open = open && (skips & GTAO_SKIP_OPEN) && normals && !mask && count == BLOCK && !c->o.sh;
            if (open && !c->bent &&
                GTAOI_NAME(gtaoi_block_flat)(c, block.tile, row_normals + x0 * (c->normal_plane ? 1 : components), x0,
                                             count)) {
                GTAOI_NAME(gtaoi_store_ones)(c, x0, y, count);
                stats->pixels += (uint64_t)count, stats->open += (uint64_t)count;
                continue;
            }
            block.x = x0, block.y = y, block.count = count;
            block.groups = period == 4 ? 4 : (count + GTAOI_W - 1) / GTAOI_W;
            block.normals = normals ? n : 0;
            for (g = 0; g < block.groups; g++) {
                block.at[g] = row + (period == 4 ? g * c->segment + x0 / 4 : x0 + g * GTAOI_W);
                block.want[g] = GV_SET(1.0f);
            }
            if (mask || count < BLOCK) {
                for (g = 0; g < block.groups; g++) {
                    for (i = 0, j = g * block.step; i < GTAOI_W; i++, j += period)
                        wanted[i] = j >= count ? -1.0f : mask ? (float)mask[x0 + j] : 1.0f;
                    block.want[g] = GV_LOAD(wanted);
                }
            }
            if (normals && c->normal_plane) {
                for (k = 0; k < 3; k++) {
                    const float *from = (const float *)(const void *)normals + k * c->normal_plane + x0;
                    GV plane[4];
                    if (period == 4)
                        GTAOI_NAME(gtaoi_load4)(from, 4, plane);
                    for (g = 0; g < 4; g++)
                        n[3 * g + k] = period == 4 ? plane[g] : GV_LOAD(from + g * GTAOI_W);
                }
            } else if (normals) {
                const float *from = (const float *)(const void *)normals + (ptrdiff_t)x0 * components;
                GTAOI_PREFETCH(from + 8 * BLOCK * components, BLOCK * components);
                GTAOI_NAME(gtaoi_read_normals)(from, components, period, count, n);
            }
            if (open && GTAOI_NAME(gtaoi_block_open)(c, &block, stats))
                ; /* nothing is left to do */
            else if (c->plain)
                GTAOI_NAME(gtaoi_block_plain)(c, &block, stats);
            else if (!GTAOI_NAME(gtaoi_block_any)(c, &block, stats))
                continue;
            stats->pixels += (uint64_t)count;
            if (c->before)
                GTAOI_NAME(gtaoi_continue)(c, &block);
            GTAOI_NAME(gtaoi_block_store)(c, &block);
        }
    }
}

/* Strips of rows, in stretches of tiles: first what can rise in them, then row by row. */
GTAOI_FN void GTAOI_NAME(gtaoi_visibility)(const gtao_context *c, int y0, int y1, gtao_stats *stats) {
    gtaoi_tile tiles[GTAOI_SPAN], bands[GTAOI_SPAN];
    const gtaoi_tile *seen[GTAOI_SPAN];
    uint8_t known[32768 / GTAOI_CELL];
    unsigned skips = c->skips;
    int x, y, i, n, end, right, row, row_end;
    const int first = c->x_begin & ~63;
    /* not all: a tile's single row (gtao_refine_rows) takes little longer than they */
    const size_t size = (size_t)gtaoi_imin((c->x_end - first + 63) / 64, GTAOI_SPAN) * sizeof *tiles;
    memset(tiles, 0, size);
    if (c->pass) /* far horizons join: only samples can be left out */
        skips &= c->pass->tilt_x ? 0u : (unsigned)GTAO_SKIP_SECTORS;
    if (skips)
        gtaoi_known_cells(c, known);
    for (y = y0; y < y1; y = end) {
        int worth_it = skips != 0;
        end = gtaoi_imin((y / GTAOI_CELL + 1) * GTAOI_CELL, y1);
        if (worth_it && end - y < GTAOI_CELL / 4 && end < c->d.height) /* a few rows do not pay for it */
            worth_it = 0, memset(tiles, 0, size);
        for (x = first; x < c->x_end; x = right) {
            int deep = 0;
            right = gtaoi_imin(x + 64 * GTAOI_SPAN, c->x_end);
            n = (right - x + 63) / 64;
            for (i = 0; i < n; i++) {
                if (worth_it)
                    GTAOI_NAME(gtaoi_look)(c, known, skips, x + 64 * i, y - y % GTAOI_CELL, &tiles[i]);
                seen[i] = &tiles[i], deep |= tiles[i].deep && tiles[i].open != 15;
            }
            for (row = y; row < end; row = row_end) {
                row_end = deep ? gtaoi_imin((row / GTAOI_BAND + 1) * GTAOI_BAND, end) : end;
                for (i = 0; deep && i < n; i++)
                    if (tiles[i].deep && tiles[i].open != 15)
                        seen[i] = GTAOI_NAME(gtaoi_look_band)(c, known, x + 64 * i, row - row % GTAOI_BAND, &bands[i])
                                      ? &bands[i]
                                      : &tiles[i];
                GTAOI_NAME(gtaoi_rows)(c, row, row_end, x, right, seen, skips, stats);
            }
        }
    }
}

/* ---- frames: reduce --------------------------------------------------------------------------------------------- */

/* Heights of a row of the caller's depth from column x on, `n` of them; what lies past its end repeats its last pixel.
 */
GTAOI_FN void GTAOI_NAME(gtaoi_height_row)(const gtao_context *c, int x, int y, int n, float *out) {
    const gtao_desc *d = &c->d;
    float ry2, in[2 * GTAOI_TILE_W];
    const float *from;
    int i, have;
    y = gtaoi_imin(y, d->height - 1);
    ry2 = gtaoi_ry2(c, y);
    from = (const float *)(const void *)((const char *)d->depth + (ptrdiff_t)y * d->depth_stride) + x;
    have = gtaoi_imin(n, d->width - x);
    if (have < n) {
        for (i = 0; i < n; i++)
            in[i] = from[gtaoi_imin(i, have - 1)];
        from = in;
    }
    for (i = 0; i < n; i += GTAOI_W) {
        GV column = GV_ADD(GV_SET((float)(x + i)), GTAOI_NAME(gtaoi_iota)());
        GV_STORE(out + i, GTAOI_NAME(gtaoi_height)(c, GV_LOAD(from + i), column, ry2));
    }
}

/* The height that stands for 2x2 pixels and which of them it is, 0 .. 3; within one surface moved to the block's
 * centre, so that planes stay the planes that the normals tell. */
GTAOI_FI GV GTAOI_NAME(gtaoi_choose)(const gtao_frame_context *f, const GV w[4], GV parity, GV *which) {
    GTAOI_NO_CONTRACT
    const GV limit = GV_SET(GTAOI_SKY_LIMIT), zero = GV_SET(0.0f), half = GV_SET(0.5f);
    GV nearest = w[0], farthest = GV_SELECT(GV_LT(limit, w[0]), w[0], GV_SET(FLT_MAX)), of_nearest = zero;
    GV of_farthest = zero, chosen, across, down, scale;
    GM far_one, smooth;
    int i;
    GTAOI_UNROLL
    for (i = 1; i < 4; i++) {
        GM nearer = GV_LT(nearest, w[i]), farther = GM_AND(GV_LT(limit, w[i]), GV_LT(w[i], farthest));
        nearest = GV_SELECT(nearer, w[i], nearest), of_nearest = GV_SELECT(nearer, GV_SET((float)i), of_nearest);
        farthest = GV_SELECT(farther, w[i], farthest), of_farthest = GV_SELECT(farther, GV_SET((float)i), of_farthest);
    }
    farthest = GV_SELECT(GV_LT(limit, nearest), farthest, nearest); /* all sky */
    far_one = f->f.reduction == GTAO_REDUCE_NEAREST    ? GV_LT(zero, zero)
              : f->f.reduction == GTAO_REDUCE_FARTHEST ? GV_LE(zero, zero)
                                                       : GV_LT(half, parity);
    *which = GV_SELECT(far_one, of_farthest, of_nearest);
    chosen = GV_SELECT(far_one, farthest, nearest);
    /* its neighbours in the block along x and y: 0 <-> 1, 2 <-> 3; 0 <-> 2, 1 <-> 3 */
    across = GV_SELECT(GV_LT(*which, GV_SET(1.5f)), GV_SELECT(GV_LT(*which, half), w[1], w[0]),
                       GV_SELECT(GV_LT(*which, GV_SET(2.5f)), w[3], w[2]));
    down = GV_SELECT(GV_LT(*which, GV_SET(1.5f)), GV_SELECT(GV_LT(*which, half), w[2], w[3]),
                     GV_SELECT(GV_LT(*which, GV_SET(2.5f)), w[0], w[1]));
    scale = GV_MUL(f->full.orthographic ? GV_SET(1.0f) : chosen, GV_SET(f->full.same_surface));
    across = GV_SUB(across, chosen), down = GV_SUB(down, chosen);
    smooth = GV_LE(GV_MAX(GV_ABS(across), GV_ABS(down)), scale);
    return GV_ADD(chosen, GV_IF(smooth, GV_MUL(half, GV_ADD(across, down))));
}

/* Components 0 .. 2 (of fewer: those) of the chosen pixels of one image, as planes. `which` is 0 .. 3 in each block. */
GTAOI_FN void GTAOI_NAME(gtaoi_pick)(const gtao_frame_context *f, const void *image, ptrdiff_t stride, int components,
                                     int x0, int y, int count, const float *which, float values[3][GTAOI_TILE_W]) {
    const int s = f->scale, row = y * s, width = f->full.d.width;
    const char *above = (const char *)image + (ptrdiff_t)row * stride;
    const char *below = (const char *)image + (ptrdiff_t)gtaoi_imin(row + 1, f->full.d.height - 1) * stride;
    const float *from[4];
    float in[4 * GTAOI_TILE_W];
    size_t bytes = components > 2 ? 16 : 8; /* one move; what is too much belongs to the next pixel, */
    int i, j, whole = gtaoi_imin(count, (width - 1) / s - x0); /* which the last block has not */
    for (i = 0; i < 4; i++)
        from[i] = (const float *)(const void *)(i & 2 ? below : above) + (x0 * s + (i & 1)) * components;
    GTAOI_PREFETCH(from[0] + 2 * GTAOI_TILE_W * components, s * GTAOI_TILE_W * components);
    if (s == 2)
        GTAOI_PREFETCH(from[2] + 2 * GTAOI_TILE_W * components, s * GTAOI_TILE_W * components);
    for (i = 0; i < whole; i++)
        if (bytes == 16)
            memcpy(in + 4 * i, from[(int)which[i]] + i * s * components, 16);
        else
            memcpy(in + 4 * i, from[(int)which[i]] + i * s * components, 8);
    for (i = gtaoi_imax(whole, 0); i < count; i++) {
        int x = gtaoi_imin((x0 + i) * s + ((int)which[i] & 1), width - 1);
        const char *of = which[i] > 1.5f ? below : above;
        for (j = 0; j < gtaoi_imin(components, 3); j++)
            in[4 * i + j] = ((const float *)(const void *)of)[x * components + j];
    }
    for (i *= 4; i < 4 * GTAOI_TILE_W; i++)
        in[i] = 0.0f;
    for (i = 0; i < GTAOI_TILE_W; i += GTAOI_W) {
        GV v[4];
        GTAOI_NAME(gtaoi_load4)(in + 4 * i, 4, v);
        GTAOI_UNROLL
        for (j = 0; j < 3; j++)
            GV_STORE(values[j] + i, v[j]);
    }
}

/* The chosen pixels' normals, made unit length, motion and mask; returns whether any of them differs from before. */
GTAOI_FN int GTAOI_NAME(gtaoi_reduce_rest)(const gtao_frame_context *f, int x0, int y, int count, const float *which) {
    GTAOI_NO_CONTRACT
    const gtao_desc *d = &f->full.d;
    float *normal = f->normals + (ptrdiff_t)y * f->pitch + x0, *motion = f->motion + (ptrdiff_t)y * f->pitch + x0;
    float values[3][GTAOI_TILE_W];
    int i, k, changed = 0;
    if (d->normals) {
        GTAOI_NAME(gtaoi_pick)
        (f, d->normals, d->normal_stride, d->normal_components, x0, y, count, which, values);
        for (i = 0; i < count; i += GTAOI_W) {
            GV n[3], len2, scale;
            GM valid;
            GTAOI_UNROLL
            for (k = 0; k < 3; k++)
                n[k] = GV_LOAD(values[k] + i);
            len2 = GV_ADD(GV_ADD(GV_MUL(n[0], n[0]), GV_MUL(n[1], n[1])), GV_MUL(n[2], n[2]));
            valid = GM_AND(GV_LE(GV_SET(1e-30f), len2), GV_LE(len2, GV_SET(FLT_MAX)));
            scale = GV_DIV(GV_SET(1.0f), GV_SQRT(len2));
            GTAOI_UNROLL
            for (k = 0; k < 3; k++) {
                GV unit = GV_SELECT(valid, GV_MUL(n[k], scale), GV_SET(0.0f));
                changed |= GM_BITS(GV_EQ(unit, GV_LOAD(normal + k * f->plane + i))) != GTAOI_ALL;
                GV_STORE(normal + k * f->plane + i, unit);
            }
        }
    }
    if (f->f.motion) {
        int components = f->f.motion_components;
        GV to_pass = GV_SET(1.0f / (float)f->scale), zero = GV_SET(0.0f);
        GTAOI_NAME(gtaoi_pick)(f, f->f.motion, f->f.motion_stride, components, x0, y, count, which, values);
        for (i = 0; i < count; i += GTAOI_W)
            for (k = 0; k < components; k++) { /* the third plane of two stays zero */
                GV m = GV_LOAD(values[k] + i);
                changed |= GM_BITS(GV_EQ(m, zero)) != GTAOI_ALL;
                GV_STORE(motion + k * f->plane + i, k < 2 ? GV_MUL(m, to_pass) : m);
            }
    }
    if (d->thickness_map) {
        float *to = f->thickness + (ptrdiff_t)y * f->pitch + x0;
        GTAOI_NAME(gtaoi_pick)(f, d->thickness_map, d->thickness_stride, 1, x0, y, count, which, values);
        for (i = 0; i < count; i += GTAOI_W) {
            GV t = GV_LOAD(values[0] + i);
            t = GV_IF(GV_LT(GV_SET(0.0f), t), t);
            changed |= GM_BITS(GV_EQ(t, GV_LOAD(to + i))) != GTAOI_ALL;
            GV_STORE(to + i, t);
        }
    }
    if (d->mask) {
        uint8_t *mask = f->mask + (ptrdiff_t)y * f->pass->d.mask_stride + x0;
        for (i = 0; i < count; i++) {
            uint8_t any = 0;
            for (k = 0; k < f->scale * f->scale; k++) {
                int x = gtaoi_imin((x0 + i) * f->scale + (k & 1), d->width - 1);
                int row = gtaoi_imin(y * f->scale + (k >> 1), d->height - 1);
                any |= d->mask[(ptrdiff_t)row * d->mask_stride + x];
            }
            changed |= any != mask[i];
            mask[i] = any;
        }
    }
    return changed;
}

/* The caller's depth, normals, motion and mask to the filters' resolution, and which tiles of them changed; rows
 * [ty0, ty1) of tiles. Row by row, not tile by tile: for the sake of the caches. */
GTAOI_FN void GTAOI_NAME(gtaoi_reduce)(const gtao_frame_context *f, int ty0, int ty1) {
    GTAOI_NO_CONTRACT
    const GV sky = GV_SET(GTAOI_SKY), width = GV_SET((float)f->width);
    int tx, x, y, i, k, s = f->scale, y1 = gtaoi_imin(ty1 * GTAOI_TILE_H, f->height);
    for (y = ty0 * GTAOI_TILE_H; y < y1; y++)
        for (tx = 0; tx < f->tiles_x; tx++) {
            int x0 = tx * GTAOI_TILE_W, at = y / GTAOI_TILE_H * f->tiles_x + tx, changed = 0;
            int count = gtaoi_imin(GTAOI_TILE_W, f->width - x0), lanes = (count + GTAOI_W - 1) / GTAOI_W * GTAOI_W;
            float *to = f->height_now + (ptrdiff_t)y * f->pitch + x0, rows[2][2 * GTAOI_TILE_W];
            const float *before = f->height_before + (ptrdiff_t)y * f->pitch + x0;
            float which[GTAOI_TILE_W], greatest_lanes[GTAOI_W];
            GV greatest = sky;
            for (k = 0; k < s; k++) {
                const char *ahead = (const char *)f->full.d.depth + (ptrdiff_t)(y * s + k) * f->full.d.depth_stride;
                GTAOI_PREFETCH(ahead + (x0 + 3 * GTAOI_TILE_W) * s * 4, GTAOI_TILE_W * s);
            }
            for (k = 0; k < 3; k++) {
                if (f->full.d.normals)
                    GTAOI_PREFETCH(f->normals + (ptrdiff_t)y * f->pitch + k * f->plane + x0 + 2 * GTAOI_TILE_W,
                                   GTAOI_TILE_W);
                if (f->f.motion && k < f->f.motion_components)
                    GTAOI_PREFETCH(f->motion + (ptrdiff_t)y * f->pitch + k * f->plane + x0 + 2 * GTAOI_TILE_W,
                                   GTAOI_TILE_W);
            }
            for (k = 0; k < s; k++)
                GTAOI_NAME(gtaoi_height_row)(&f->full, x0 * s, y * s + k, lanes * s, rows[k]);
            if (s == 2 && y * 2 + 1 == f->full.d.height && y > 0) {
                float above[2 * GTAOI_TILE_W];
                GTAOI_NAME(gtaoi_height_row)(&f->full, x0 * s, y * s - 1, lanes * s, above);
                for (i = 0; i < 2 * count; i++)
                    rows[1][i] = gtaoi_beyond(f, rows[0][i], above[i]);
            }
            i = f->full.d.width - x0 * s;
            if (s == 2 && i < 2 * count && i > 1)
                for (k = 0; k < 2; k++)
                    rows[k][i] = gtaoi_beyond(f, rows[k][i - 1], rows[k][i - 2]);
            for (i = 0; i < count; i += GTAOI_W) {
                GV column = GV_ADD(GV_SET((float)(x0 + i)), GTAOI_NAME(gtaoi_iota)()), w[4], height, index;
                if (s == 1) {
                    height = GV_LOAD(rows[0] + i), index = GV_SET(0.0f);
                } else {
                    GV half = GV_MUL(GV_ADD(column, GV_SET((float)y)), GV_SET(0.5f));
                    GTAOI_NAME(gtaoi_load2)(rows[0] + 2 * i, &w[0], &w[1]);
                    GTAOI_NAME(gtaoi_load2)(rows[1] + 2 * i, &w[2], &w[3]);
                    height = GTAOI_NAME(gtaoi_choose)(
                        f, w, GV_MUL(GV_SET(2.0f), GV_SUB(half, GTAOI_NAME(gtaoi_floor)(half))), &index);
                }
                height = GV_SELECT(GV_LT(column, width), height, sky);
                changed |= GM_BITS(GV_EQ(height, GV_LOAD(before + i))) != GTAOI_ALL;
                greatest = GV_MAX(greatest, height);
                GV_STORE(to + i, height);
                GV_STORE(which + i, index);
            }
            changed |= GTAOI_NAME(gtaoi_reduce_rest)(f, x0, y, count, which);
            if (tx == f->tiles_x - 1)
                gtaoi_pad_plane(f, to - x0, 0);
            GV_STORE(greatest_lanes, greatest);
            for (x = 1; x < GTAOI_W; x++)
                greatest_lanes[0] = gtaoi_max(greatest_lanes[0], greatest_lanes[x]);
            if (y % GTAOI_TILE_H == 0)
                f->nearest[at] = greatest_lanes[0], f->changed[at] = (uint8_t)changed;
            f->nearest[at] = gtaoi_max(f->nearest[at], greatest_lanes[0]);
            f->changed[at] |= (uint8_t)changed;
        }
}

/* ---- frames: spatial filter ------------------------------------------------------------------------------------- */

/* How far heights may differ and still belong together. */
GTAOI_FI GV GTAOI_NAME(gtaoi_tolerance)(const gtao_frame_context *f, GV w) {
    GTAOI_NO_CONTRACT
    return GV_ADD(GV_MUL(w, GV_SET(f->tolerance_scale)), GV_SET(f->tolerance_bias));
}

/* The slope of the surface at a pixel of the height plane, zero where there is none to be trusted, and by how much it
 * bends: first and second derivatives [J16]. */
GTAOI_FI void GTAOI_NAME(gtaoi_slope)(const float *const rows[5], int x, GV w0, GV tolerance, GV *gx, GV *gy,
                                      GV *bend) {
    GTAOI_NO_CONTRACT
    const GM always = GV_LE(tolerance, tolerance);
    const float *at = rows[2] + x;
    GV ex, ey;
    GM trust_x, trust_y;
    *gx = GTAOI_NAME(gtaoi_gradient)(w0, GV_LOAD(at - 1), GV_LOAD(at - 2), GV_LOAD(at + 1), GV_LOAD(at + 2), always,
                                     always, &ex);
    *gy = GTAOI_NAME(gtaoi_gradient)(w0, GV_LOAD(rows[1] + x), GV_LOAD(rows[0] + x), GV_LOAD(rows[3] + x),
                                     GV_LOAD(rows[4] + x), always, always, &ey);
    trust_x = GV_LE(ex, tolerance), trust_y = GV_LE(ey, tolerance);
    *gx = GV_IF(trust_x, *gx), *gy = GV_IF(trust_y, *gy);
    *bend = GV_ADD(GV_IF(trust_x, ex), GV_IF(trust_y, ey));
}

/* [J16] bilateral filter over up to 5x5 pixels: weights fall linearly with the distance from the pixel's plane. Means
 * are taken of differences from the pixel itself, so that what is constant stays so to the bit. Of the further planes
 * those of one set; visibility and weight are the same each time. */
GTAOI_FN void GTAOI_NAME(gtaoi_spatial)(const gtao_frame_context *f, int pass, int set, int y0, int y1) {
    GTAOI_NO_CONTRACT
    const float *window = f->window[pass > 0], *in = pass ? f->filtered[!(pass & 1)] : f->raw;
    float *out = f->filtered[pass & 1];
    const GV zero = GV_SET(0.0f), one = GV_SET(1.0f), limit = GV_SET(GTAOI_SKY_LIMIT);
    const int first = window[0] == 0.0f, taps = 4 + (!first && window[4] > 0.0f) - (first && window[4] == 0.0f);
    const int plain = window[first] == 1.0f, planes = f->bent ? 5 : 2, width = f->width;
    const ptrdiff_t more = gtaoi_signal_set(f, set), plane = f->plane;
    ptrdiff_t begin[5];
    int x, y, i, j, k;
    for (k = 0; k < 5; k++)
        begin[k] = k < 2 ? k * plane : more + (k - 2) * plane;
    for (y = y0; y < y1; y++) {
        const float *heights[5], *signal[5];
        float *to = out + (ptrdiff_t)y * f->pitch;
        for (j = 0; j < 5; j++) {
            heights[j] = gtaoi_plane_row(f, f->height_now, y + j - 2);
            signal[j] = gtaoi_plane_row(f, in, y + j - 2);
        }
        for (x = 0; x < width; x += GTAOI_W) {
            GV w0 = GV_LOAD(heights[2] + x), tolerance = GTAOI_NAME(gtaoi_tolerance)(f, w0), inv, gx, gy, bend;
            GV centre[5], sum[5], total = zero, shares = zero, across[5];
            GM solid = GV_LT(limit, w0), good;
            if (x % GTAOI_TILE_W == 0 && gtaoi_at_rest(f, x / GTAOI_TILE_W, y / GTAOI_TILE_H, 1)) {
                x += GTAOI_TILE_W - GTAOI_W;
                continue;
            }
            if (x % 16 == 0) {
                GTAOI_PREFETCH(heights[4] + x + 64, 16);
                for (k = 0; k < planes; k++) {
                    GTAOI_PREFETCH(signal[4] + begin[k] + x + 64, 16);
                    GTAOI_PREFETCH(to + begin[k] + x + 64, 16);
                }
            }
            GTAOI_UNROLL
            for (k = 0; k < 5; k++) {
                sum[k] = zero;
                if (k < planes)
                    centre[k] = GV_LOAD(signal[2] + begin[k] + x);
            }
            if (GM_ANY(solid)) {
                GTAOI_NAME(gtaoi_slope)(heights, x, w0, tolerance, &gx, &gy, &bend);
                /* no more than 1e28, from which the sky is still far */
                inv = GV_MIN(GV_ADD(tolerance, GV_MIN(GV_ADD(bend, bend), tolerance)), GV_SET(1e28f));
                inv = GV_DIV(one, inv);
                GTAOI_UNROLL
                for (i = 0; i < 5; i++)
                    across[i] = GV_MUL(gx, GV_SET((float)(first + i - 2)));
                for (j = first; j < first + taps; j++) {
                    const float *from = signal[j] + x + first - 2, *near_by = heights[j] + x + first - 2;
                    GV along = GV_ADD(w0, GV_MUL(gy, GV_SET((float)(j - 2))));
                    GTAOI_UNROLL
                    for (i = 0; i < 5; i++, from++) {
                        GV share, weight;
                        if (i == taps)
                            break;
                        share = GV_ABS(GV_SUB(GV_LOAD(near_by + i), GV_ADD(along, across[i])));
                        share = GV_MAX(GV_SUB(one, GV_MUL(share, inv)), zero);
                        if (!plain)
                            share = GV_MUL(share, GV_SET(window[first + i] * window[j]));
                        weight = GV_MUL(share, GV_LOAD(from + plane));
                        shares = GV_ADD(shares, share), total = GV_ADD(total, weight);
                        sum[0] = GV_ADD(sum[0], GV_MUL(weight, GV_SUB(GV_LOAD(from), centre[0])));
                        if (planes > 2) {
                            GTAOI_UNROLL
                            for (k = 2; k < 5; k++)
                                sum[k] = GV_ADD(
                                    sum[k], GV_MUL(weight, GV_SUB(GV_LOAD(from + more + (k - 2) * plane), centre[k])));
                        }
                    }
                }
                good = GM_AND(solid, GV_LT(zero, total));
                inv = GV_DIV(one, total);
                centre[1] = GV_SELECT(good, GV_DIV(total, shares), centre[1]);
                GTAOI_UNROLL
                for (k = 0; k < 5; k++)
                    if (k != 1 && k < planes)
                        centre[k] = GV_SELECT(good, GV_ADD(centre[k], GV_MUL(sum[k], inv)), centre[k]);
            }
            GTAOI_UNROLL
            for (k = 0; k < 5; k++)
                if (k < planes)
                    GV_STORE(to + begin[k] + x, centre[k]);
        }
        for (k = 0; k < planes; k++)
            gtaoi_pad_plane(f, to + begin[k], 1);
    }
}

/* ---- frames: temporal filter ------------------------------------------------------------------------------------ */

/* Where the pixels' surfaces were in the previous frame: pixel coordinates (centres at whole numbers) and height. */
GTAOI_FI GM GTAOI_NAME(gtaoi_reproject)(const gtao_frame_context *f, GV x, GV y, int xi, int yi, GV w, GV *px, GV *py,
                                        GV *pw) {
    GTAOI_NO_CONTRACT
    const gtao_context *c = f->pass;
    const float *m = f->before;
    const GV half = GV_SET(0.5f), zero = GV_SET(0.0f);
    GM valid;
    *px = x, *py = y, *pw = w;
    valid = GV_LT(GV_SET(GTAOI_SKY_LIMIT), w);
    if (f->f.motion) {
        const float *motion = f->motion + (ptrdiff_t)yi * f->pitch + xi;
        *px = GV_ADD(x, GV_LOAD(motion)), *py = GV_ADD(y, GV_LOAD(motion + f->plane));
        if (f->f.motion_components == 3) {
            GV dz = GV_MUL(GV_LOAD(motion + 2 * f->plane), GV_SET(1.0f / gtaoi_height_unit(c)));
            if (c->orthographic)
                *pw = GV_SUB(w, dz);
            else /* 1 / (1 / w + dz) */
                *pw = GV_DIV(w, GV_ADD(GV_SET(1.0f), GV_MUL(w, dz)));
        }
    } else if (f->moved) {
        GV rx, ry, rz, t, qx, qy, qz;
        if (c->orthographic) {
            rx = GV_ADD(x, half), ry = GV_MUL(GV_ADD(y, half), GV_SET(c->by1)), rz = GV_SUB(zero, w);
            t = GV_SET(1.0f);
        } else {
            rx = GV_MUL(GV_SUB(GV_ADD(x, half), GV_SET(c->cx)), GV_SET(c->bx1));
            ry = GV_MUL(GV_SUB(GV_ADD(y, half), GV_SET(c->cy)), GV_SET(c->by1));
            rz = GV_SET(1.0f), t = w;
        }
        qx = GV_ADD(GV_ADD(GV_MUL(GV_SET(m[0]), rx), GV_MUL(GV_SET(m[1]), ry)),
                    GV_ADD(GV_MUL(GV_SET(m[2]), rz), GV_MUL(GV_SET(m[3]), t)));
        qy = GV_ADD(GV_ADD(GV_MUL(GV_SET(m[4]), rx), GV_MUL(GV_SET(m[5]), ry)),
                    GV_ADD(GV_MUL(GV_SET(m[6]), rz), GV_MUL(GV_SET(m[7]), t)));
        qz = GV_ADD(GV_ADD(GV_MUL(GV_SET(m[8]), rx), GV_MUL(GV_SET(m[9]), ry)),
                    GV_ADD(GV_MUL(GV_SET(m[10]), rz), GV_MUL(GV_SET(m[11]), t)));
        if (c->orthographic) {
            *px = GV_SUB(qx, half), *py = GV_SUB(GV_DIV(qy, GV_SET(c->by1)), half), *pw = GV_SUB(zero, qz);
        } else {
            GV inv = GV_DIV(GV_SET(1.0f), qz);
            valid = GM_AND(valid, GV_LT(GV_SET(1e-6f), qz));
            *px = GV_ADD(GV_MUL(GV_MUL(qx, inv), GV_SET(f->before_fx)), GV_SET(f->before_cx - 0.5f));
            *py = GV_ADD(GV_MUL(GV_MUL(qy, inv), GV_SET(f->before_fy)), GV_SET(f->before_cy - 0.5f));
            *pw = GV_MUL(w, inv);
        }
    }
    /* In reach of the previous image, and not NaN. */
    valid = GM_AND(valid, GM_AND(GM_AND(GV_LT(GV_SET(-1.0f), *px), GV_LT(*px, GV_SET((float)f->width))),
                                 GM_AND(GV_LT(GV_SET(-1.0f), *py), GV_LT(*py, GV_SET((float)f->height)))));
    valid = GM_AND(valid, GV_LT(GV_ABS(*pw), GV_SET(1e30f)));
    *px = GV_SELECT(valid, *px, x), *py = GV_SELECT(valid, *py, y), *pw = GV_SELECT(valid, *pw, w);
    /* to 1/256 pixel: rounding alone must not blur a surface at rest */
    *px = GV_MUL(GTAOI_NAME(gtaoi_nearest)(GV_MUL(*px, GV_SET(256.0f))), GV_SET(1.0f / 256.0f));
    *py = GV_MUL(GTAOI_NAME(gtaoi_nearest)(GV_MUL(*py, GV_SET(256.0f))), GV_SET(1.0f / 256.0f));
    return valid;
}

/* What the history holds at the reprojected pixels. */
typedef struct GTAOI_HISTORY {
    GV value[5]; /* sums of weight x (difference from the new frame): visibility, -, bent normal */
    GV weight, length, speed, last, deviation;
    GV blur; /* how far between pixels it was read: variance of the bilinear taps, pixels^2 */
} GTAOI_HISTORY;

/* [J16] each of the four bilinear taps is tested on its own, in the one direction that tells disocclusion: a history
 * that was nearer than the surface is another's. Lanes that moved by nearly the same whole pixels are taken together, so
 * that all loads are contiguous: a bilinear weight is the product of two hats, and zero beyond the four taps. */
GTAOI_FN void GTAOI_NAME(gtaoi_fetch_history)(const gtao_frame_context *f, int set, int x0, GM valid, GV px, GV py,
                                              GV pw, GV gx, GV gy, const GV *now, GTAOI_HISTORY *h) {
    GTAOI_NO_CONTRACT
    const GV zero = GV_SET(0.0f), one = GV_SET(1.0f), limit = GV_SET(GTAOI_SKY_LIMIT);
    GV bx = GTAOI_NAME(gtaoi_floor)(px), by = GTAOI_NAME(gtaoi_floor)(py), fx = GV_SUB(px, bx), fy = GV_SUB(py, by);
    GV inv = GV_DIV(one, GV_ADD(GV_MUL(pw, GV_SET(f->disocclusion_scale)), GV_SET(f->disocclusion_bias)));
    GV here = GV_ADD(GV_SET((float)x0), GTAOI_NAME(gtaoi_iota)()), step_x = GV_SUB(bx, here), shift = GV_SUB(px, here);
    GV value[5], weight = zero, length = zero, speed = zero, last = zero, deviation = zero;
    float steps[GTAOI_W], rows[GTAOI_W];
    const ptrdiff_t more = gtaoi_history_set(f, set);
    int i, j, k;
    GV_STORE(steps, step_x), GV_STORE(rows, by);
    h->blur = GV_ADD(GV_MUL(fx, GV_SUB(one, fx)), GV_MUL(fy, GV_SUB(one, fy)));
    value[0] = value[2] = value[3] = value[4] = zero;
    while (GM_ANY(valid)) {
        int first = gtaoi_lowest(GM_BITS(valid));
        GM near_x = GV_LE(GV_ABS(GV_SUB(step_x, GV_SET(steps[first]))), one), lanes = GM_AND(valid, near_x);
        GM near_y = GV_LE(GV_ABS(GV_SUB(by, GV_SET(rows[first]))), one);
        lanes = GM_AND(lanes, near_y);
        for (j = -1; j < 3; j++) {
            int row = (int)rows[first] + j, column = x0 + (int)steps[first] - 1;
            GV dy = GV_SUB(GV_SET((float)row), py), wy = GV_MAX(GV_SUB(one, GV_ABS(dy)), zero), expected;
            const float *heights, *history;
            if (!GM_ANY(GM_AND(lanes, GV_LT(zero, wy))))
                continue;
            heights = gtaoi_plane_row(f, f->height_before, row) + column;
            history = gtaoi_plane_row(f, f->history_before, row) + column;
            expected = GV_ADD(pw, GV_MUL(gy, dy));
            for (i = 0; i < 4; i++, heights++, history++) {
                GV dx = GV_SUB(GV_SET(steps[first] - 1.0f + (float)i), shift), w, share;
                GM used;
                share = GV_MUL(GV_MAX(GV_SUB(one, GV_ABS(dx)), zero), wy);
                used = GM_AND(lanes, GV_LT(zero, share));
                if (!GM_ANY(used))
                    continue;
                w = GV_LOAD(heights);
                used = GM_AND(used, GV_LT(limit, w));
                w = GV_SUB(one, GV_MUL(GV_SUB(w, GV_ADD(expected, GV_MUL(gx, dx))), inv));
                share = GV_IF(used, GV_MUL(share, GV_MIN(GV_MAX(w, zero), one)));
                weight = GV_ADD(weight, share);
                length = GV_ADD(length, GV_MUL(share, GV_LOAD(history + GTAOI_HISTORY_LENGTH * f->plane)));
                speed = GV_ADD(speed, GV_MUL(share, GV_LOAD(history + GTAOI_HISTORY_SPEED * f->plane)));
                last = GV_ADD(last, GV_MUL(share, GV_LOAD(history + GTAOI_HISTORY_LAST * f->plane)));
                deviation = GV_ADD(deviation, GV_MUL(share, GV_LOAD(history + GTAOI_HISTORY_DEVIATION * f->plane)));
                value[0] = GV_ADD(value[0], GV_MUL(share, GV_SUB(GV_LOAD(history), now[0])));
                if (f->bent) {
                    GTAOI_UNROLL
                    for (k = 2; k < 5; k++)
                        value[k] = GV_ADD(value[k],
                                          GV_MUL(share, GV_SUB(GV_LOAD(history + more + (k - 2) * f->plane), now[k])));
                }
            }
        }
        valid = GM_ANDNOT(valid, lanes);
    }
    h->weight = weight, h->length = length, h->speed = speed, h->last = last, h->deviation = deviation;
    h->value[0] = value[0], h->value[1] = zero, h->value[2] = value[2], h->value[3] = value[3], h->value[4] = value[4];
}

/* [J16] exponential accumulation. A pixel's history counts its frames, so that the first ones are averaged; it is at
 * most max_history frames long, less for what moves. */
GTAOI_FN void GTAOI_NAME(gtaoi_temporal)(const gtao_frame_context *f, int set, int y0, int y1) {
    GTAOI_NO_CONTRACT
    const GV zero = GV_SET(0.0f), one = GV_SET(1.0f), quarter = GV_SET(0.25f), most = GV_SET((float)f->f.max_history);
    const GV at_speed = GV_SET(gtaoi_min((float)f->f.max_history, 8.0f));
    const ptrdiff_t more_now = gtaoi_signal_set(f, set), more = gtaoi_history_set(f, set);
    const int planes = f->bent ? 5 : 1, kept = 5 + 3 * gtaoi_imax(f->sets, 1), width = f->width;
    const ptrdiff_t plane = f->plane;
    ptrdiff_t begin_now[5], begin[8];
    int x, y, j, k;
    for (k = 0; k < 8; k++)
        begin[k] = k >= 2 && k < 5 ? more + (k - 2) * plane : k * plane;
    for (k = 0; k < 5; k++)
        begin_now[k] = k ? more_now + (k - 2) * plane : 0;
    for (y = y0; y < y1; y++) {
        const float *heights[5], *signal[3];
        float *to = f->history_now + (ptrdiff_t)y * f->pitch;
        GV row = GV_SET((float)y);
        ptrdiff_t ahead = gtaoi_imin(y + 1, f->height) * f->pitch;
        for (j = 0; j < 5; j++)
            heights[j] = gtaoi_plane_row(f, f->height_now, y + j - 2);
        for (j = 0; j < 3; j++) {
            int at = f->pass->d.border == GTAO_BORDER_WRAP ? gtaoi_wrap(y + j - 1, f->height)
                                                           : gtaoi_imin(gtaoi_imax(y + j - 1, 0), f->height - 1);
            signal[j] = f->signal + (ptrdiff_t)at * f->pitch;
        }
        for (x = 0; x < width; x += GTAOI_W) {
            GV column = GV_ADD(GV_SET((float)x), GTAOI_NAME(gtaoi_iota)()), w0 = GV_LOAD(heights[2] + x);
            GV px, py, pw, gx = zero, gy = zero, bend, now[5], past[5], length, speed, calm, limit, alpha, moved,
                           deviation, change;
            GTAOI_HISTORY h;
            GM valid, has;
            if (x % GTAOI_TILE_W == 0 && f->rest[y / GTAOI_TILE_H * f->tiles_x + x / GTAOI_TILE_W]) {
                const float *from = f->history_before + (ptrdiff_t)y * f->pitch + x;
                size_t n = (size_t)gtaoi_imin(GTAOI_TILE_W, f->width - x) * sizeof(float);
                /* once both histories hold it, it stands */
                if (f->still[y / GTAOI_TILE_H * f->tiles_x + x / GTAOI_TILE_W] <= GTAOI_AT_REST + 1 || f->f.no_skip)
                    for (k = set ? kept : 0; k < kept; k++)
                        memcpy(to + k * f->plane + x, from + k * f->plane, n);
                x += GTAOI_TILE_W - GTAOI_W;
                continue;
            }
            if (x % 16 == 0) { /* more streams than processors follow on their own */
                const int off = x + 4 * 16;
                GTAOI_PREFETCH(f->height_before + ahead + off, 16);
                for (k = 0; k < 8; k++)
                    if (k < planes || k == GTAOI_HISTORY_LENGTH || k >= GTAOI_HISTORY_SPEED) {
                        GTAOI_PREFETCH(f->history_before + begin[k] + ahead + off, 16);
                        GTAOI_PREFETCH(to + begin[k] + off, 16);
                    }
                for (k = 0; f->f.motion && k < f->f.motion_components; k++)
                    GTAOI_PREFETCH(f->motion + (ptrdiff_t)y * f->pitch + k * plane + off, 16);
            }
            GTAOI_UNROLL
            for (k = 0; k < 5; k++)
                if (k < planes && k != 1)
                    now[k] = GV_LOAD(signal[1] + begin_now[k] + x);
            valid = GTAOI_NAME(gtaoi_reproject)(f, column, row, x, y, w0, &px, &py, &pw);
            if (f->moved || f->f.motion) {
                float columns[GTAOI_W], rows[GTAOI_W];
                GTAOI_NAME(gtaoi_slope)(heights, x, w0, GTAOI_NAME(gtaoi_tolerance)(f, w0), &gx, &gy, &bend);
                /* the next ones moved about as far */
                GV_STORE(columns, px), GV_STORE(rows, py);
                ahead = gtaoi_imin((int)rows[0] + 2, f->height) * f->pitch + (int)columns[0] - x;
            }
            GTAOI_NAME(gtaoi_fetch_history)(f, set, x, valid, px, py, pw, gx, gy, now, &h);

            has = GV_LT(GV_SET(1.0f / 16.0f), h.weight);
            limit = GV_DIV(one, GV_SELECT(has, h.weight, one));
            GTAOI_UNROLL
            for (k = 0; k < 5; k++)
                if (k < planes && k != 1)
                    past[k] = GV_SELECT(has, GV_ADD(now[k], GV_MUL(h.value[k], limit)), now[k]);
            /* Shorter by the taps that were rejected, and by the detail that reading between pixels costs. */
            length = GV_IF(has, GV_MUL(h.length, GV_SUB(one, GV_MUL(h.blur, GV_SET(GTAOI_BLUR_COST)))));
            moved = GV_SUB(px, column), speed = GV_SUB(py, row);
            speed = GV_SQRT(GV_ADD(GV_MUL(moved, moved), GV_MUL(speed, speed)));
            speed = GV_IF(valid, GV_MUL(speed, GV_SET((float)f->scale)));
            calm = GV_ABS(GV_SUB(speed, GV_SELECT(has, GV_MUL(h.speed, limit), speed)));
            calm = GV_MAX(GV_SUB(one, GV_MUL(calm, quarter)), zero); /* [J16] velocity weight: 0 at 4 pixels a frame */

            deviation = GV_IF(has, GV_MUL(h.deviation, limit));
            change = GV_ABS(GV_SUB(now[0], GV_MUL(h.last, limit)));
            deviation = GV_IF(has, GV_ADD(deviation, GV_MUL(GV_SET(0.125f), GV_SUB(change, deviation))));
            change = GV_ABS(GV_SUB(now[0], past[0]));
            if (f->f.history == GTAO_HISTORY_CLAMP) {
                /* the four 2x2 means around the pixel, as bilinear taps at its corners fetch them; and what one frame
                 * deviates from the history by chance */
                GV means[4], least, greatest, window, clamped, part;
                GTAOI_UNROLL
                for (j = 0; j < 4; j++) {
                    const float *across = signal[1] + x, *down = signal[j & 2] + x;
                    int side = j & 1 ? 1 : -1;
                    means[j] =
                        GV_ADD(GV_ADD(now[0], GV_LOAD(across + side)), GV_ADD(GV_LOAD(down), GV_LOAD(down + side)));
                    means[j] = GV_MUL(means[j], quarter);
                }
                least = GV_MIN(GV_MIN(means[0], means[1]), GV_MIN(GV_MIN(means[2], means[3]), now[0]));
                greatest = GV_MAX(GV_MAX(means[0], means[1]), GV_MAX(GV_MAX(means[2], means[3]), now[0]));
                window = GV_MUL(GV_MUL(calm, GV_SET(f->f.clamp_window)), GV_SUB(greatest, least));
                window = GV_MAX(window, GV_MUL(deviation, GV_SET(GTAOI_CLAMP_NOISE)));
                clamped = GV_MAX(GV_MIN(past[0], GV_ADD(greatest, window)), GV_SUB(least, window));
                /* the rest of the signal goes as far towards the new frame as the visibility did, and as much of the
                 * history counts no more */
                part = GV_DIV(GV_ABS(GV_SUB(past[0], clamped)), GV_MAX(change, GV_SET(1e-12f)));
                part = GV_MIN(part, one);
                GTAOI_UNROLL
                for (k = 2; k < 5; k++)
                    if (k < planes)
                        past[k] = GV_ADD(past[k], GV_MUL(part, GV_SUB(now[k], past[k])));
                length = GV_MUL(length, GV_SUB(one, part));
                past[0] = clamped;
            } else if (f->f.history == GTAO_HISTORY_VARIANCE) {
                /* beyond three deviations (of a normal distribution: 1.25 times the mean one) the history is shortened
                 * by the square of the excess */
                GV chance = GV_MAX(GV_MUL(deviation, GV_SET(3.75f)), GV_SET(1e-3f));
                GV excess = GV_DIV(chance, GV_MAX(change, chance));
                length = GV_MUL(length, GV_MUL(excess, excess));
            }

            /* at rest max_history frames, falling to 8 at 16 pixels a frame */
            limit =
                GV_MAX(GV_SUB(most, GV_MUL(speed, GV_SET((float)(f->f.max_history - 8) * (1.0f / 16.0f)))), at_speed);
            length = GV_ADD(GV_MIN(length, GV_SUB(limit, one)), one);
            alpha = GV_DIV(one, length);
            GTAOI_UNROLL
            for (k = 0; k < 5; k++)
                if (k < planes && k != 1)
                    GV_STORE(to + begin[k] + x, GV_ADD(past[k], GV_MUL(alpha, GV_SUB(now[k], past[k]))));
            GV_STORE(to + GTAOI_HISTORY_LENGTH * plane + x, length);
            GV_STORE(to + GTAOI_HISTORY_SPEED * plane + x, speed);
            GV_STORE(to + GTAOI_HISTORY_LAST * plane + x, now[0]);
            GV_STORE(to + GTAOI_HISTORY_DEVIATION * plane + x, deviation);
        }
        for (k = 0; k < kept; k++)
            gtaoi_pad_plane(f, to + k * f->plane, 0);
    }
}

/* ---- frames: output --------------------------------------------------------------------------------------------- */

/* Unit bent normals of W pixels from their means; where nothing is visible or known, the normal (three
 * planes, or null) or towards the eye. */
GTAOI_FI void GTAOI_NAME(gtaoi_unit_bent)(const gtao_context *c, GV b[3], const float *normals, ptrdiff_t plane, GV x,
                                          int y) {
    GTAOI_NO_CONTRACT
    const GV one = GV_SET(1.0f), zero = GV_SET(0.0f);
    GV len2 = GV_ADD(GV_ADD(GV_MUL(b[0], b[0]), GV_MUL(b[1], b[1])), GV_MUL(b[2], b[2])), scale, r[3], n[3], inv;
    GM good = GV_LT(GV_SET(1e-12f), len2), has_normal;
    int k;
    scale = GV_DIV(one, GV_SQRT(len2));
    if (GM_BITS(good) != GTAOI_ALL) {
        r[0] = r[1] = zero, r[2] = GV_SET(-1.0f);
        if (!c->orthographic) {
            float ry = gtaoi_clamp(((float)y + 0.5f - c->cy) * c->by1, -GTAOI_RAY_LIMIT, GTAOI_RAY_LIMIT);
            r[0] = GV_MUL(GV_SUB(GV_ADD(x, GV_SET(0.5f)), GV_SET(c->cx)), GV_SET(c->bx1));
            r[0] = GV_MAX(GV_MIN(r[0], GV_SET(GTAOI_RAY_LIMIT)), GV_SET(-GTAOI_RAY_LIMIT));
            inv = GV_DIV(GV_SET(-1.0f), GV_SQRT(GV_ADD(GV_ADD(GV_MUL(r[0], r[0]), GV_SET(ry * ry)), one)));
            r[0] = GV_MUL(r[0], inv), r[1] = GV_MUL(GV_SET(ry), inv), r[2] = inv;
        }
        for (k = 0; k < 3; k++)
            n[k] = normals ? GV_LOAD(normals + k * plane) : zero;
        if (normals && c->transform_normals) {
            const float *m = c->to_view;
            GV t[3];
            for (k = 0; k < 3; k++)
                t[k] = GV_ADD(GV_ADD(GV_MUL(GV_SET(m[3 * k]), n[0]), GV_MUL(GV_SET(m[3 * k + 1]), n[1])),
                              GV_MUL(GV_SET(m[3 * k + 2]), n[2]));
            n[0] = t[0], n[1] = t[1], n[2] = t[2];
        }
        has_normal = GV_LT(GV_SET(0.5f), GV_ADD(GV_ADD(GV_MUL(n[0], n[0]), GV_MUL(n[1], n[1])), GV_MUL(n[2], n[2])));
        for (k = 0; k < 3; k++)
            b[k] = GV_SELECT(good, b[k], GV_SELECT(has_normal, n[k], r[k]));
        scale = GV_SELECT(good, scale, one);
    }
    GTAOI_UNROLL
    for (k = 0; k < 3; k++)
        b[k] = GV_MUL(b[k], scale);
}

/* The four neighbours at the filters' resolution of a caller's pixel: itself's block, beside, above or below, diagonal,
 * each with its bilinear weight times how well its height fits. */
typedef struct GTAOI_TAPS {
    const float *height[4]; /* the blocks' heights and signals */
    const float *signal[4];
    GV rise[4];  /* from the pixel to the middle of the block, where both are of one surface */
    GV alike[4]; /* how well their normals fit */
    GM crease;   /* whether any fits badly */
} GTAOI_TAPS;

GTAOI_FI GV GTAOI_NAME(gtaoi_dot)(const GV a[3], const GV b[3]) {
    GTAOI_NO_CONTRACT
    return GV_ADD(GV_ADD(GV_MUL(a[0], b[0]), GV_MUL(a[1], b[1])), GV_MUL(a[2], b[2]));
}

/* How well the normals of the blocks fit that of one of the caller's pixels, column + 2 lane of row y; 1 everywhere, and
 * the caller's normals are not read, where those of the blocks are alike. n: normals of the four blocks. */
GTAOI_FN void GTAOI_NAME(gtaoi_alike)(const gtao_frame_context *f, GTAOI_TAPS *taps, GV n[4][3], GM solid, int column,
                                      int y) {
    GTAOI_NO_CONTRACT
    const gtao_desc *d = &f->full.d;
    const GV one = GV_SET(1.0f), zero = GV_SET(0.0f);
    GV least = one, own[3], len2, scale;
    GM known, given[4];
    float values[3][GTAOI_W];
    int i, k, t;
    GTAOI_UNROLL
    for (t = 0; t < 4; t++) {
        given[t] = GV_LT(GV_SET(0.5f), GTAOI_NAME(gtaoi_dot)(n[t], n[t])); /* or 0: unknown */
        least = GV_SELECT(GM_AND(given[0], given[t]), GV_MIN(least, GTAOI_NAME(gtaoi_dot)(n[0], n[t])), least);
    }
    taps->crease = GM_AND(solid, GV_LT(least, GV_SET(0.9f)));
    if (!GM_ANY(taps->crease))
        return;
    for (i = 0; i < GTAOI_W; i++) {
        const char *row = (const char *)d->normals + (ptrdiff_t)y * d->normal_stride;
        const float *from = (const float *)(const void *)row +
                            (ptrdiff_t)gtaoi_imin(column + 2 * i, d->width - 1) * d->normal_components;
        for (k = 0; k < 3; k++)
            values[k][i] = from[k];
    }
    for (k = 0; k < 3; k++)
        own[k] = GV_LOAD(values[k]);
    len2 = GTAOI_NAME(gtaoi_dot)(own, own);
    known = GM_AND(GV_LE(GV_SET(1e-30f), len2), GV_LE(len2, GV_SET(FLT_MAX)));
    scale = GV_DIV(one, GV_SQRT(GV_SELECT(known, len2, one)));
    taps->crease = GM_AND(taps->crease, known);
    GTAOI_UNROLL
    for (t = 0; t < 4; t++) { /* all at 26 degrees, nothing at 60 */
        GV dot = GTAOI_NAME(gtaoi_dot)(own, n[t]);
        dot = GV_MIN(GV_MAX(GV_MUL(GV_SUB(GV_MUL(dot, scale), GV_SET(0.5f)), GV_SET(2.5f)), zero), one);
        taps->alike[t] = GV_SELECT(GM_AND(taps->crease, given[t]), dot, one);
    }
}

/* What the height rises from a block to the next, along x or y, by the smoother side; 0 where neither side belongs to
 * it. */
GTAOI_FI GV GTAOI_NAME(gtaoi_step)(GV before, GV w, GV after, GV tolerance) {
    GTAOI_NO_CONTRACT
    GV a = GV_SUB(w, before), b = GV_SUB(after, w), step = GV_SELECT(GV_LE(GV_ABS(a), GV_ABS(b)), a, b);
    GM trusted = GV_LE(GV_MIN(GV_ABS(GV_SUB(a, b)), GV_ABS(step)), tolerance);
    return GV_IF(trusted, step);
}

/* `inv`: one over the tolerance; `more_at`: where the three further planes begin. */
GTAOI_FI void GTAOI_NAME(gtaoi_join)(const gtao_frame_context *f, const GTAOI_TAPS *taps, int i, GV w, GV inv,
                                     ptrdiff_t more_at, GV *out) {
    GTAOI_NO_CONTRACT
    static const float bilinear[4] = {9.0f / 16.0f, 3.0f / 16.0f, 3.0f / 16.0f, 1.0f / 16.0f};
    const GV zero = GV_SET(0.0f), one = GV_SET(1.0f), limit = GV_SET(GTAOI_SKY_LIMIT);
    GV total = zero, share[4], away[4], least;
    const ptrdiff_t plane = f->plane;
    const int planes = f->bent ? 5 : 1;
    int t, k, same;
    GM solid = GV_LT(limit, w), fits;
    GTAOI_UNROLL
    for (t = 0; t < 4; t++)
        away[t] = GV_MUL(GV_ABS(GV_SUB(GV_LOAD(taps->height[t] + i), GV_ADD(w, taps->rise[t]))), inv);
    fits = GV_LE(GV_MAX(GV_MAX(away[0], away[1]), GV_MAX(away[2], away[3])), one);
    same = !GM_ANY(GM_OR(GM_ANDNOT(solid, fits), taps->crease));
    GTAOI_UNROLL
    for (t = 0; t < 4; t++)
        share[t] = GV_SET(bilinear[t]);
    if (!same) { /* full weight up to the tolerance, none at twice that; if all are beyond, the closest */
        least = GV_MIN(GV_MIN(away[0], away[1]), GV_MIN(away[2], away[3]));
        GTAOI_UNROLL
        for (t = 0; t < 4; t++) {
            away[t] = GV_MAX(GV_SUB(GV_SET(2.0f), away[t]), GV_IF(GV_LE(away[t], least), GV_SET(1e-6f)));
            away[t] = GV_MIN(GV_MAX(away[t], zero), one);
            if (GM_ANY(taps->crease))
                away[t] = GV_MAX(GV_MUL(away[t], taps->alike[t]), GV_IF(GV_LT(zero, away[t]), GV_SET(1e-6f)));
            away[t] = GV_MUL(away[t], share[t]);
            total = GV_ADD(total, away[t]);
        }
        total = GV_DIV(one, total); /* 1 to the bit where all fit */
        GTAOI_UNROLL
        for (t = 0; t < 4; t++)
            share[t] = GV_MUL(away[t], total);
    }
    GTAOI_UNROLL
    for (k = 0; k < 5; k++)
        if (k < planes && k != 1) {
            ptrdiff_t at = (k ? more_at + (k - 2) * plane : 0) + i;
            GV own = GV_LOAD(taps->signal[0] + at), more = zero;
            GTAOI_UNROLL
            for (t = 1; t < 4; t++)
                more = GV_ADD(more, GV_MUL(share[t], GV_SUB(GV_LOAD(taps->signal[t] + at), own)));
            out[k] = GV_ADD(own, GV_IF(solid, more));
        }
    out[0] = GV_SELECT(solid, out[0], one);
}

/* A row of `count` of the caller's pixels to the caller: visibility and three further planes of a set. */
GTAOI_FN void GTAOI_NAME(gtaoi_put_row)(const gtao_frame_context *f, int set, int x, int y, int count,
                                        float planar[4][GTAOI_TILE_W]) {
    const gtao_context *c = &f->full;
    const int to = c->o.bent_normals && !c->o.packed;
    float bent[3 * GTAOI_TILE_W];
    int i, k;
    if (set) {
        for (k = 0; k < 3 && 3 * (set - 1) + k < gtaoi_sh_count(&c->o); k++)
            memcpy((char *)c->o.sh + (3 * (set - 1) + k) * c->o.sh_plane_stride + (ptrdiff_t)y * c->o.sh_stride +
                       (ptrdiff_t)x * 4,
                   planar[k + 1], (size_t)count * 4);
        return;
    }
    for (i = 0; f->bent && i < count; i += GTAOI_W) {
        const int last = gtaoi_imin(GTAOI_W, count - i) - 1;
        float records[4 * GTAOI_W], *at = bent + 3 * i;
        GV rows[4];
        GTAOI_UNROLL
        for (k = 0; k < 4; k++)
            rows[k] = GV_LOAD(planar[(k + 1) & 3] + i);
        GTAOI_NAME(gtaoi_store4)(records, 4, rows);
        if (to) /* straight to the caller */
            at = (float *)(void *)((char *)c->o.bent_normals + (ptrdiff_t)y * c->o.bent_stride) +
                 (x + i) * c->o.bent_components;
        if (to && c->o.bent_components == 4) {
            memcpy(at, records, (size_t)(last + 1) * 16);
        } else { /* a fourth component too many, which the next one overwrites */
            if (last == GTAOI_W - 1) {
                GTAOI_UNROLL
                for (k = 0; k < GTAOI_W - 1; k++)
                    memcpy(at + 3 * k, records + 4 * k, 16);
            } else {
                for (k = 0; k < last; k++)
                    memcpy(at + 3 * k, records + 4 * k, 16);
            }
            memcpy(at + 3 * last, records + 4 * last, 12);
        }
    }
    gtaoi_store(c, x, y, count, planar[0], c->o.packed ? bent : 0, 0);
}

/* Joint bilateral upsampling and output; [y0, y1) are rows of the filters. The first set is the bent normal, the others
 * are three spherical harmonics each. */
GTAOI_FN void GTAOI_NAME(gtaoi_upsample)(const gtao_frame_context *f, int set, int y0, int y1) {
    GTAOI_NO_CONTRACT
    const gtao_context *c = &f->full;
    const GV zero = GV_SET(0.0f);
    const ptrdiff_t more = f->temporal ? gtaoi_history_set(f, set) : gtaoi_signal_set(f, set), plane = f->plane;
    const int s = f->scale, planes = f->bent ? 5 : 1, guided = c->d.normals && f->f.upsample_normals;
    int x, x0, y, full_y, i, j, k, r;
    for (full_y = y0 * s; full_y < gtaoi_imin(y1 * s, c->d.height); full_y++) {
        const float *h[3], *v[3];
        y = full_y / s, r = full_y % s;
        for (j = -1; j <= 1; j++) {
            h[j + 1] = gtaoi_plane_row(f, f->height_now, y + j);
            v[j + 1] = gtaoi_plane_row(f, f->result, y + j);
        }
        for (x0 = 0; x0 < f->width; x0 += GTAOI_TILE_W / 2) {
            int lanes = gtaoi_imin(GTAOI_TILE_W / 2, f->width - x0);
            int count = gtaoi_imin(GTAOI_TILE_W / 2 * s, c->d.width - x0 * s);
            float heights[GTAOI_TILE_W], planar[4][GTAOI_TILE_W];
            if (s == 2)
                GTAOI_NAME(gtaoi_height_row)
            (c, x0 * s, full_y, (lanes + GTAOI_W - 1) / GTAOI_W * GTAOI_W * 2, heights);
            for (i = 0; i < lanes; i += GTAOI_W) {
                const float *normals = c->d.normals ? f->normals + (ptrdiff_t)y * f->pitch + x0 + i : 0;
                GV pixel[2][5];
                x = x0 + i;
                if (s == 1) {
                    GTAOI_UNROLL
                    for (k = 0; k < 5; k++)
                        if (k < planes && k != 1)
                            pixel[0][k] = GV_LOAD(v[1] + (k ? more + (k - 2) * plane : 0) + x);
                } else {
                    int other = r ? 2 : 0;
                    GV w0 = GV_LOAD(h[1] + x), w[2], rise_x, near_x, rise, near_y, tolerance, inv;
                    GTAOI_TAPS even, odd;
                    /* the sky never fits */
                    tolerance = GV_MIN(GTAOI_NAME(gtaoi_tolerance)(f, GV_MAX(w0, zero)), GV_SET(1e28f));
                    inv = GV_DIV(GV_SET(1.0f), GV_MAX(tolerance, GV_SET(1e-28f)));
                    rise_x = GTAOI_NAME(gtaoi_step)(GV_LOAD(h[1] + x - 1), w0, GV_LOAD(h[1] + x + 1), tolerance);
                    rise = GTAOI_NAME(gtaoi_step)(GV_LOAD(h[0] + x), w0, GV_LOAD(h[2] + x), tolerance);
                    if (r) /* upwards for the upper row, downwards for the lower */
                        rise = GV_SUB(zero, rise);
                    near_x = GV_MUL(rise_x, GV_SET(0.25f)), rise_x = GV_MUL(rise_x, GV_SET(-0.75f));
                    near_y = GV_MUL(rise, GV_SET(0.25f)), rise = GV_MUL(rise, GV_SET(-0.75f));
                    even.rise[0] = GV_ADD(near_y, near_x), odd.rise[0] = GV_SUB(near_y, near_x);
                    even.rise[1] = GV_ADD(near_y, rise_x), odd.rise[1] = GV_SUB(near_y, rise_x);
                    even.rise[2] = GV_ADD(rise, near_x), odd.rise[2] = GV_SUB(rise, near_x);
                    even.rise[3] = GV_ADD(rise, rise_x), odd.rise[3] = GV_SUB(rise, rise_x);
                    even.height[0] = odd.height[0] = h[1], even.signal[0] = odd.signal[0] = v[1];
                    even.height[2] = odd.height[2] = h[other], even.signal[2] = odd.signal[2] = v[other];
                    even.height[1] = h[1] - 1, even.height[3] = h[other] - 1;
                    even.signal[1] = v[1] - 1, even.signal[3] = v[other] - 1;
                    odd.height[1] = h[1] + 1, odd.height[3] = h[other] + 1;
                    odd.signal[1] = v[1] + 1, odd.signal[3] = v[other] + 1;
                    GTAOI_NAME(gtaoi_load2)(heights + 2 * i, &w[0], &w[1]);
                    even.crease = odd.crease = GV_LT(zero, zero);
                    if (guided) {
                        const float *at = normals;
                        ptrdiff_t down = r ? f->pitch : -f->pitch;
                        GV n[4][3], m[4][3];
                        if (y + 2 * r - 1 < 0 || y + 2 * r - 1 >= f->height)
                            down = 0;
                        for (k = 0; k < 3; k++, at += plane) {
                            n[0][k] = m[0][k] = GV_LOAD(at), n[2][k] = m[2][k] = GV_LOAD(at + down);
                            n[1][k] = GV_LOAD(at - 1), n[3][k] = GV_LOAD(at + down - 1);
                            m[1][k] = GV_LOAD(at + 1), m[3][k] = GV_LOAD(at + down + 1);
                        }
                        GTAOI_NAME(gtaoi_alike)
                        (f, &even, n, GV_LT(GV_SET(GTAOI_SKY_LIMIT), w[0]), 2 * x, full_y);
                        GTAOI_NAME(gtaoi_alike)
                        (f, &odd, m, GV_LT(GV_SET(GTAOI_SKY_LIMIT), w[1]), 2 * x + 1, full_y);
                    }
                    GTAOI_NAME(gtaoi_join)(f, &even, x, w[0], inv, more, pixel[0]);
                    GTAOI_NAME(gtaoi_join)(f, &odd, x, w[1], inv, more, pixel[1]);
                }
                if (f->bent && !set) {
                    GV column = GV_ADD(GV_SET((float)x), GTAOI_NAME(gtaoi_iota)());
                    if (s == 2)
                        column = GV_MUL(column, GV_SET(2.0f));
                    GTAOI_NAME(gtaoi_unit_bent)(c, pixel[0] + 2, normals, plane, column, full_y);
                    if (s == 2)
                        GTAOI_NAME(gtaoi_unit_bent)
                    (c, pixel[1] + 2, normals, plane, GV_ADD(column, GV_SET(1.0f)), full_y);
                }
                GTAOI_UNROLL
                for (k = 0; k < 5; k++)
                    if (k < planes && k != GTAOI_SIGNAL_WEIGHT) {
                        float *to = planar[k ? k - 1 : 0] + i * s;
                        if (s == 1)
                            GV_STORE(to, pixel[0][k]);
                        else
                            GTAOI_NAME(gtaoi_store2)(to, pixel[0][k], pixel[1][k]);
                    }
            }
            GTAOI_NAME(gtaoi_put_row)(f, set, x0 * s, full_y, count, planar);
        }
    }
}
#endif /* GTAOI_KERNELS */

#undef GTAOI_FN
#undef GTAOI_FI
#undef GTAOI_ALL
#undef GV
#undef GM
#undef GI
#undef GTAOI_PIXEL
#undef GTAOI_FRAME
#undef GTAOI_HORIZONS
#undef GTAOI_ARCS
#undef GTAOI_COLUMN
#undef GTAOI_WALK
#undef GTAOI_SAMPLE
#undef GTAOI_SUM
#undef GTAOI_MOMENTS
#undef GTAOI_HISTORY
#undef GTAOI_TAPS
#undef GTAOI_GROUPS
#undef GTAOI_NOTES
#undef GV_SET
#undef GV_LOAD
#undef GV_STORE
#undef GV_ADD
#undef GV_SUB
#undef GV_MUL
#undef GV_DIV
#undef GV_SQRT
#undef GV_MIN
#undef GV_MAX
#undef GV_ABS
#undef GV_LT
#undef GV_LE
#undef GV_EQ
#undef GV_IF
#undef GV_SELECT
#undef GV_MAX_IF
#undef GM_AND
#undef GM_OR
#undef GM_ANDNOT
#undef GM_BITS
#undef GM_ANY
#undef GV_CLASS
#undef GI_SET
#undef GI_OR
#undef GI_AND
#undef GI_ANDNOT
#undef GI_ADD
#undef GI_IF
#undef GI_SELECT
#undef GI_IS_ZERO
#undef GI_FROM
#undef GI_INDEX
#undef GTAOI_W
#undef GTAOI_NAME
#undef GTAOI_ATTRIBUTE

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
