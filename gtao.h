#ifndef GTAOI_W
/* gtao.h - ground-truth ambient occlusion on a CPU - v0.1
 *
 * (the doc block stands here; written last)
 */
#ifndef GTAO_H
#define GTAO_H

#include <stddef.h>
#include <stdint.h>

#define GTAO_VERSION 100 /* major * 10000 + minor * 100 + patch */

#ifndef GTAO_API
#ifdef GTAO_STATIC
#define GTAO_API static
#else
#define GTAO_API extern
#endif
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- results -------------------------------------------------------------------------------------------------- */

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
    X(GTAO_ERROR_NORMALS, "normal_stride, normal_components: 0 (3), 3 or 4 floats, rows apart by multiples of 4 bytes")  \
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
    X(GTAO_ERROR_ESTIMATOR, "estimator: unknown")                                                                      \
    X(GTAO_ERROR_WEIGHTING, "weighting: unknown")                                                                      \
    X(GTAO_ERROR_NOISE, "noise: unknown")                                                                              \
    X(GTAO_ERROR_ISA, "isa: unknown, not compiled in, or not supported by this machine")                               \
    X(GTAO_ERROR_OUTPUT, "output: null, or no buffer in it")                                                           \
    X(GTAO_ERROR_OUTPUT_FORMAT, "visibility_format: unknown")                                                          \
    X(GTAO_ERROR_OUTPUT_STRIDE, "visibility_stride, bent_stride, bent_components, packed_stride: rows overlap or are misaligned") \
    X(GTAO_ERROR_SCRATCH, "scratch: null or smaller than gtao_scratch_size()")                                         \
    X(GTAO_ERROR_MATRIX, "projection matrix: neither perspective nor orthographic")

typedef enum gtao_result {
#define GTAOI_X(name, text) name,
    GTAO_RESULTS(GTAOI_X)
#undef GTAOI_X
    GTAO_RESULT_COUNT
} gtao_result;

/* "field: what is wrong with it", never null. */
GTAO_API const char *gtao_result_string(gtao_result result);

/* ---- input ---------------------------------------------------------------------------------------------------- */

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
    float fx, fy;     /* perspective: focal length in pixels, > 0; fy = 0 takes fx */
    float cx, cy;     /* perspective: principal point in pixels, read only if off_center is set */
    int off_center;   /* 0: the principal point is the image centre */
    float sx, sy;     /* orthographic: world units per pixel, > 0; sy = 0 takes sx */
} gtao_camera;

typedef enum gtao_border {
    GTAO_BORDER_OPEN = 0,  /* nothing outside the image occludes */
    GTAO_BORDER_CLAMP = 1, /* the edge pixel's height goes on outside, as a clamping sampler reads it */
    GTAO_BORDER_WRAP = 2   /* the image repeats: tileable maps */
} gtao_border;

typedef enum gtao_preset {
    GTAO_PRESET_MEDIUM = 0,
    GTAO_PRESET_LOW = 1,
    GTAO_PRESET_HIGH = 2,
    GTAO_PRESET_ULTRA = 3,
    GTAO_PRESET_REFERENCE = 4
} gtao_preset;

typedef enum gtao_estimator {
    GTAO_ESTIMATOR_NORMALIZED = 0, /* unbiased: screen-angle Jacobian, divided by the same sum for an open surface */
    GTAO_ESTIMATOR_MEMO = 1        /* the pseudo-code of [J19] to the letter, for porting and comparison */
} gtao_estimator;

typedef enum gtao_weighting { GTAO_WEIGHTING_COSINE = 0, GTAO_WEIGHTING_UNIFORM = 1 } gtao_weighting;

typedef enum gtao_noise {
    GTAO_NOISE_MEMO = 0,    /* [J16] 16 directions and 4 offsets in 4x4 tiles, 6 rotations and 4 offsets over 24 frames */
    GTAO_NOISE_HILBERT = 1, /* Hilbert index of a 64x64 tile into the R2 sequence, 64 frames */
    GTAO_NOISE_NONE = 2     /* slice angles pi (k + 1/2) / slices and step offset 1/2 at every pixel */
} gtao_noise;

typedef enum gtao_isa {
    GTAO_ISA_AUTO = 0,
    GTAO_ISA_SCALAR = 1,
    GTAO_ISA_SSE2 = 2,
    GTAO_ISA_AVX2 = 3,
    GTAO_ISA_AVX512 = 4,
    GTAO_ISA_NEON = 5
} gtao_isa;

/* Everything that is read. Zero-initialise, then set what differs: zero always means the default.
 * Strides are in bytes from one row to the next, may be negative (then the pointer is the first row of the image in
 * memory order last), 0 = tightly packed. Float buffers need float alignment only. */
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

    float radius;      /* world units; 0: nothing is in reach; INFINITY: no bound. There is no default. */
    float falloff;     /* fraction f of the radius over which occlusion fades out, [J16] conservative attenuation:
                        * weight(d) = saturate((radius - d) / (f radius)). 0: hard cutoff; the memo's is 0.25 */
    int max_radius_px; /* cap of the search in pixels; 0: the image diagonal */

    gtao_preset preset;
    int slices;       /* directions per pixel, 1..64; 0: from the preset */
    int steps;        /* samples on each side of a slice, 1..256; 0: from the preset */
    int every_pixel;  /* nonzero: visit every pixel out to the radius instead of `steps` samples */
    float step_power; /* samples lie at 1 + (radius_px - 1) ((j + offset) / steps)^power; 0: 2 */
    float thin_blend; /* [J16] thickness heuristic: a sample below the horizon pulls it down by this factor; 0: off */
    gtao_estimator estimator;
    gtao_weighting weighting;
    gtao_noise noise;
    uint32_t frame; /* selects the temporal rotation and offset of the noise */

    gtao_isa isa;
} gtao_desc;

/* ---- output --------------------------------------------------------------------------------------------------- */

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
} gtao_output;

/* Counts, added to what is already there; a thread passes its own and sums them afterwards. */
typedef struct gtao_stats {
    uint64_t pixels;  /* pixels visited */
    uint64_t sky;     /* of these: skipped as sky or invalid depth, */
    uint64_t masked;  /* as masked out, */
    uint64_t small_radius; /* because the radius projects to less than a pixel */
    uint64_t derived_normals; /* pixels whose normal came from depth */
    uint64_t samples; /* horizon samples, all pixels */
} gtao_stats;

/* ---- level 1: one call ---------------------------------------------------------------------------------------- */

/* Bytes of scratch for this description, or 0 if the description is invalid (gtao_compute says why). */
GTAO_API size_t gtao_scratch_size(const gtao_desc *desc);

/* Visibility and bent normals of the whole image. `scratch` needs no alignment and no initialisation.
 * `stats` may be null. On an error nothing is written. */
GTAO_API gtao_result gtao_compute(const gtao_desc *desc, const gtao_output *output, void *scratch, size_t scratch_size,
                                  gtao_stats *stats);

/* ---- level 2: the stages, on row ranges ----------------------------------------------------------------------- */

/* Lives inside the scratch buffer; valid as long as that and the caller's buffers are. Read-only between stages. */
typedef struct gtao_context gtao_context;

/* Checks everything, resolves defaults, fills the sample tables. Cheap; one thread. */
GTAO_API gtao_result gtao_begin(const gtao_desc *desc, const gtao_output *output, void *scratch, size_t scratch_size,
                                gtao_context **context);

/* Depth to height, rows [row_begin, row_end). Ranges may run at once on any threads; all must be done before ... */
GTAO_API void gtao_prepare_rows(const gtao_context *context, int row_begin, int row_end);

/* ... horizons, integration and output, rows [row_begin, row_end), again in any order on any threads. */
GTAO_API void gtao_visibility_rows(const gtao_context *context, int row_begin, int row_end, gtao_stats *stats);

/* What was resolved: the preset's slices and steps, the kernel in use. */
GTAO_API int gtao_context_slices(const gtao_context *context);
GTAO_API int gtao_context_steps(const gtao_context *context); /* 0: every pixel */
GTAO_API gtao_isa gtao_context_isa(const gtao_context *context);
GTAO_API const char *gtao_isa_name(gtao_isa isa);         /* "scalar", "sse2", ... */
GTAO_API int gtao_isa_available(gtao_isa isa);            /* compiled in and supported here */

/* ---- level 3: the formulas ------------------------------------------------------------------------------------ */

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

/* [J16] multiple bounces: visibility and albedo in [0, 1] to the visibility that includes interreflection. */
GTAO_API float gtao_multi_bounce(float visibility, float albedo);
GTAO_API void gtao_multi_bounce_rgb(float visibility, const float albedo[3], float rgb[3]);

/* Noise of a pixel: *direction and *offset in [0, 1). The slice angle is pi (k + direction) / slices, the sample
 * position as at gtao_desc.step_power. */
GTAO_API void gtao_noise_at(gtao_noise noise, int x, int y, uint32_t frame, float *direction, float *offset);

/* 8 bits each: visibility in the lowest, then bent normal x, y, z as round(127.5 + 127.5 c). */
GTAO_API uint32_t gtao_pack(float visibility, const float bent_normal[3]);
GTAO_API void gtao_unpack(uint32_t packed, float *visibility, float bent_normal[3]);

/* ---- cameras -------------------------------------------------------------------------------------------------- */

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
#endif /* GTAOI_W */
