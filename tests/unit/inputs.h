/* Inputs for the tests that compare bits: images made from integers, so that every compiler and machine gets the same
 * floats, in buffers of exactly the size promised, so that a sanitizer sees every overrun. */
#ifndef TESTS_INPUTS_H
#define TESTS_INPUTS_H

#include "gtao.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- planes: rows somewhere in memory ------------------------------------------------------------------------- */

/* How rows lie: bytes before the first and between two of them, and whether the last comes first. */
typedef struct layout {
    size_t offset, pad;
    int flipped;
} layout;

typedef struct plane {
    unsigned char *memory, *first; /* row y is at first + y stride */
    size_t size, row_bytes;
    ptrdiff_t stride;
    int rows;
} plane;

enum { CANARY = 0xA5 };

static inline plane plane_make(int rows, size_t row_bytes, layout l) {
    plane p;
    size_t step = row_bytes + l.pad, last = (size_t)(rows - 1) * step;
    p.rows = rows;
    p.row_bytes = row_bytes;
    p.size = l.offset + last + row_bytes;
    p.memory = (unsigned char *)malloc(p.size);
    if (!p.memory)
        abort();
    memset(p.memory, CANARY, p.size);
    p.first = p.memory + l.offset + (l.flipped ? last : 0);
    p.stride = l.flipped ? -(ptrdiff_t)step : (ptrdiff_t)step;
    return p;
}

static inline unsigned char *plane_row(const plane *p, int y) {
    return p->first + y * p->stride;
}

/* The stride a caller would pass: 0 where the default says the same. */
static inline ptrdiff_t plane_stride(const plane *p) {
    return p->stride == (ptrdiff_t)p->row_bytes ? 0 : p->stride;
}

/* Nonzero if bytes that belong to no row were written. */
static inline int plane_spilled(const plane *p) {
    for (size_t i = 0; i < p->size; i++) {
        int inside = 0;
        for (int y = 0; y < p->rows && !inside; y++) {
            const unsigned char *row = plane_row(p, y), *at = p->memory + i;
            inside = at >= row && at < row + p->row_bytes;
        }
        if (!inside && p->memory[i] != CANARY)
            return 1;
    }
    return 0;
}

static inline int planes_equal(const plane *a, const plane *b) {
    for (int y = 0; y < a->rows; y++)
        if (memcmp(plane_row(a, y), plane_row(b, y), a->row_bytes) != 0)
            return 0;
    return 1;
}

/* ---- numbers -------------------------------------------------------------------------------------------------- */

static inline uint32_t next_random(uint32_t *state) {
    *state = *state * 1664525u + 1013904223u;
    return *state >> 8; /* 24 bits */
}

static inline uint32_t hash_cell(int x, int y, uint32_t seed) {
    uint32_t h = (uint32_t)x * 0x9E3779B1u ^ (uint32_t)y * 0x85EBCA77u ^ seed * 0xC2B2AE3Du;
    h = (h ^ (h >> 15)) * 0x2C1B3C6Du;
    return h ^ (h >> 13);
}

static inline float float_from_bits(uint32_t bits) {
    float f;
    memcpy(&f, &bits, sizeof f);
    return f;
}

static inline float float_inf(void) {
    return float_from_bits(0x7F800000u);
}
static inline float float_nan(void) {
    return float_from_bits(0x7FC00000u);
}

/* Neither NaN nor infinite, judged by the bits: holds under any floating-point flags. */
static inline int float_finite(float f) {
    uint32_t bits;
    memcpy(&bits, &f, sizeof bits);
    return (bits & 0x7F800000u) != 0x7F800000u;
}

/* ---- scenes --------------------------------------------------------------------------------------------------- */

/* Depth in 1/1024: a receding floor with boxes on it and a rough surface, 0 for sky. */
static inline int32_t scene_z(int x, int y, uint32_t seed) {
    uint32_t box = hash_cell(x / 11, y / 7, seed), gap = hash_cell(x / 17, y / 13, seed + 1);
    int32_t z = 7168 - 16 * (y < 256 ? y : 256) + (int32_t)(hash_cell(x, y, seed) & 15u);
    if ((box & 3u) == 0)
        z -= 256 + (int32_t)((box >> 8) & 1023u);
    return (gap & 15u) == 0 ? 0 : z;
}

/* device depth d: 1/z = 2 d - 1/16, for any projection in use */
#define SCENE_DEVICE_SCALE 2.0f
#define SCENE_DEVICE_BIAS (-0.0625f)

static inline float scene_depth_of(int32_t z, gtao_depth_kind kind) {
    switch (kind) {
    case GTAO_DEPTH_DEVICE:
        return (float)((z ? 4194304 / z : 0) + 256) / 8192.0f;
    case GTAO_DEPTH_HEIGHT:
        return z ? (float)-z / 1024.0f : float_nan();
    case GTAO_DEPTH_Z:
    case GTAO_DEPTH_DISTANCE:
        break;
    }
    return z ? (float)z / 1024.0f : float_inf();
}

static inline float scene_depth(int x, int y, uint32_t seed, gtao_depth_kind kind) {
    return scene_depth_of(scene_z(x, y, seed), kind);
}

/* Behind the scene: back faces of layer `which` (0: of the scene itself), and the fronts of the layers behind it; some
 * missing, some in front of the front. */
static inline float scene_behind(int x, int y, uint32_t seed, int which, int back, gtao_depth_kind kind) {
    uint32_t h = hash_cell(x / 5, y / 4, seed + 3 + (uint32_t)which);
    int32_t z = scene_z(x, y, seed) + 512 * which;
    if ((h & 7u) < (back ? 1u : 4u * (uint32_t)(which > 0)))
        return scene_depth_of(0, kind);
    return scene_depth_of(z + (back ? (int32_t)(h >> 8 & 511u) - 32 : 0), kind);
}

/* Normals of any length, some behind the surface, some zero or not a number. */
static inline void scene_normal(int x, int y, uint32_t seed, float n[4]) {
    uint32_t h = hash_cell(x / 3, y / 3, seed + 2);
    n[0] = (float)((int32_t)(h & 31u) - 16);
    n[1] = (float)((int32_t)((h >> 5) & 31u) - 24);
    n[2] = -(float)((int32_t)((h >> 10) & 31u) - 2);
    n[3] = 0.0f;
    if ((h >> 15 & 31u) == 0)
        n[0] = n[1] = n[2] = 0.0f;
    if ((h >> 15 & 31u) == 1)
        n[1] = float_nan();
}

/* ---- settings: every option at least once --------------------------------------------------------------------- */

enum { WITH_MASK = 1, WITH_MAP = 2, WITH_BACK = 4, WITH_LAYERS = 8, LAYERS = 2 };

typedef struct setting {
    const char *name;
    int normals, given; /* whether there are normals; what else there is, WITH_* */
    gtao_desc desc;     /* without size and buffers */
} setting;

#define PERSPECTIVE .camera = {.fx = 60}
#define WIDE .camera = {.fx = 14, .fy = 17, .cx = 21.25f, .cy = 30.5f, .off_center = 1}
#define ORTHO .camera = {.projection = GTAO_ORTHOGRAPHIC, .sx = 0.0625f, .sy = 0.078125f}

/* clang-format off */
static const setting settings[] = {
    {"default", 1, 0, {PERSPECTIVE, .radius = 1.5f}},
    {"production", 1, 0, {PERSPECTIVE, .radius = 1, .falloff = 0.25f, .slices = 1, .steps = 8, .max_radius_px = 40}},
    {"memo", 1, 0, {PERSPECTIVE, .radius = 1, .falloff = 0.25f, .slices = 2, .steps = 8,
                    .estimator = GTAO_ESTIMATOR_MEMO}},
    {"memo-uniform", 1, 0, {WIDE, .radius = 2, .slices = 3, .thin_blend = 0.25f, .estimator = GTAO_ESTIMATOR_MEMO,
                            .weighting = GTAO_WEIGHTING_UNIFORM, .border = GTAO_BORDER_CLAMP}},
    {"memo-ortho", 0, 0, {ORTHO, .radius = 1, .falloff = 1, .estimator = GTAO_ESTIMATOR_MEMO}},
    {"memo-every-pixel", 1, 0, {PERSPECTIVE, .radius = 1, .slices = 2, .every_pixel = 1, .max_radius_px = 9,
                                .estimator = GTAO_ESTIMATOR_MEMO}},
    {"low", 1, 0, {PERSPECTIVE, .radius = 0.5f, .preset = GTAO_PRESET_LOW}},
    {"high-derived-normals", 0, 0, {PERSPECTIVE, .radius = 1, .preset = GTAO_PRESET_HIGH}},
    {"ultra", 1, 0, {WIDE, .radius = 1, .preset = GTAO_PRESET_ULTRA, .frame = 3}},
    {"reference", 1, 0, {PERSPECTIVE, .radius = 1, .preset = GTAO_PRESET_REFERENCE, .max_radius_px = 8}},
    {"every-pixel-wide", 0, 0, {WIDE, .radius = 1, .slices = 3, .every_pixel = 1, .border = GTAO_BORDER_CLAMP}},
    {"every-pixel-falloff", 1, 0, {PERSPECTIVE, .radius = 2, .falloff = 0.5f, .slices = 2, .every_pixel = 1}},
    {"height-wrap", 0, 0, {ORTHO, .depth_kind = GTAO_DEPTH_HEIGHT, .radius = 2, .border = GTAO_BORDER_WRAP}},
    {"height-every-pixel", 0, 0, {ORTHO, .depth_kind = GTAO_DEPTH_HEIGHT, .radius = 1, .slices = 4, .every_pixel = 1,
                                  .border = GTAO_BORDER_WRAP, .falloff = 0.25f}},
    {"ortho-uniform", 1, 0, {ORTHO, .radius = 1, .weighting = GTAO_WEIGHTING_UNIFORM}},
    {"ortho-device", 1, 0, {ORTHO, .depth_kind = GTAO_DEPTH_DEVICE, .device_scale = 4, .device_bias = -8,
                            .radius = 1}},
    {"uniform", 1, 0, {WIDE, .radius = 1, .weighting = GTAO_WEIGHTING_UNIFORM, .falloff = 0.25f}},
    {"thin-blend", 1, 0, {PERSPECTIVE, .radius = 1.5f, .thin_blend = 0.3f}},
    {"thin-blend-falloff", 0, 0, {PERSPECTIVE, .radius = 1.5f, .thin_blend = 1, .falloff = 0.25f}},
    {"hilbert", 1, 0, {PERSPECTIVE, .radius = 1, .noise = GTAO_NOISE_HILBERT, .frame = 5}},
    {"no-noise", 1, 0, {PERSPECTIVE, .radius = 1, .noise = GTAO_NOISE_NONE, .slices = 5, .steps = 3}},
    {"frame", 1, 0, {PERSPECTIVE, .radius = 1, .frame = 4000000019u, .step_power = 1, .steps = 5}},
    {"distance", 0, 0, {WIDE, .depth_kind = GTAO_DEPTH_DISTANCE, .radius = 1}},
    {"device-clamp", 1, 0, {PERSPECTIVE, .depth_kind = GTAO_DEPTH_DEVICE, .device_scale = SCENE_DEVICE_SCALE,
                            .device_bias = SCENE_DEVICE_BIAS, .radius = 1, .border = GTAO_BORDER_CLAMP}},
    {"perspective-wrap", 1, 0, {PERSPECTIVE, .radius = 1, .border = GTAO_BORDER_WRAP, .step_power = 4}},
    {"radius-infinite", 1, 0, {PERSPECTIVE, .radius = HUGE_VALF, .slices = 2, .steps = 12}},
    {"radius-small", 1, 0, {PERSPECTIVE, .radius = 0.095f}},
    {"mask-sky", 1, WITH_MASK, {PERSPECTIVE, .radius = 1, .sky_z = 6.75f}},
    {"axes", 1, 0, {PERSPECTIVE, .radius = 1, .normal_components = 4, .normal_axes = {1, -1, 0.5f},
                    .normal_to_view = {0, 1, 0, -1, 0, 0.25f, 0, 0, 1}}},
    {"thickness", 1, 0, {PERSPECTIVE, .radius = 1.5f, .thickness = 0.25f}},
    {"thickness-falloff", 1, 0, {WIDE, .radius = 2, .thickness = 0.125f, .falloff = 0.5f, .slices = 3,
                                 .border = GTAO_BORDER_CLAMP}},
    {"thickness-every-pixel", 1, 0, {PERSPECTIVE, .radius = 1, .thickness = 0.0625f, .slices = 3, .every_pixel = 1,
                                     .border = GTAO_BORDER_WRAP, .weighting = GTAO_WEIGHTING_UNIFORM}},
    {"thickness-hilbert", 1, 0, {PERSPECTIVE, .radius = 1, .thickness = 0.25f, .noise = GTAO_NOISE_HILBERT}},
    {"back-hilbert-every-pixel", 0, WITH_BACK, {ORTHO, .radius = 1, .slices = 2, .every_pixel = 1, .falloff = 0.25f,
                                                .noise = GTAO_NOISE_HILBERT}},
    {"thickness-map", 1, WITH_MASK | WITH_MAP, {ORTHO, .radius = 1, .thickness = 0.5f}},
    {"thickness-infinite", 1, WITH_MAP, {PERSPECTIVE, .radius = HUGE_VALF, .thickness = 0.25f}},
    {"back", 1, WITH_BACK, {WIDE, .depth_kind = GTAO_DEPTH_DISTANCE, .radius = 1, .falloff = 0.25f}},
    {"back-no-noise", 1, WITH_BACK, {PERSPECTIVE, .radius = 0.25f, .noise = GTAO_NOISE_NONE, .steps = 5}},
    {"layers", 1, WITH_BACK | WITH_LAYERS, {PERSPECTIVE, .depth_kind = GTAO_DEPTH_DEVICE, .radius = 2, .thickness = 0.25f,
                                            .device_scale = SCENE_DEVICE_SCALE, .device_bias = SCENE_DEVICE_BIAS}},
    {"layers-height", 0, WITH_LAYERS | WITH_MAP, {ORTHO, .depth_kind = GTAO_DEPTH_HEIGHT, .radius = 2,
                                                  .border = GTAO_BORDER_WRAP}},
    {"far-nearest", 1, 0, {PERSPECTIVE, .radius = 4, .far_depth = GTAO_FAR_NEAREST, .far_px = 8}},
    {"far-average", 0, 0, {ORTHO, .radius = 2, .falloff = 0.5f, .slices = 3, .steps = 9,
                           .far_depth = GTAO_FAR_AVERAGE, .far_px = 9}},
};
/* clang-format on */

enum { SETTING_COUNT = (int)(sizeof settings / sizeof settings[0]) };

/* Input buffers with the description that points to them. */
typedef struct input {
    gtao_desc desc;
    plane depth, normals, mask;
    int has_normals, has_mask;
    plane map, back, layer[2 * LAYERS]; /* fronts, then backs */
    gtao_layer *layers;
} input;

/* Thickness, back faces and layers of the scene, of those that the setting has. */
static inline void input_behind(input *in, int behind, int width, int height, uint32_t seed, layout l) {
    plane *planes[2 + 2 * LAYERS] = {&in->map, &in->back};
    for (int i = 0; i < 2 * LAYERS; i++)
        planes[2 + i] = &in->layer[i];
    for (int i = 0; i < 2 + 2 * LAYERS; i++) {
        if (!(behind & (i == 0 ? WITH_MAP : i == 1 ? WITH_BACK : WITH_LAYERS)))
            continue;
        *planes[i] = plane_make(height, sizeof(float) * (size_t)width, l);
        for (int y = 0; y < height; y++)
            for (int x = 0; x < width; x++) {
                int which = i < 2 ? 0 : 1 + (i - 2) % LAYERS, back = i == 1 || i >= 2 + LAYERS;
                uint32_t h = hash_cell(x / 4, y / 4, seed + 9);
                float f = scene_behind(x, y, seed, which, back, in->desc.depth_kind);
                if (i == 0)
                    f = (h & 7u) == 0 ? 0.0f : (h & 7u) == 1 ? float_inf() : (float)(h >> 8 & 255u) / 256.0f;
                memcpy(plane_row(planes[i], y) + sizeof f * (size_t)x, &f, sizeof f);
            }
    }
    in->desc.thickness_map = (const float *)(const void *)in->map.first;
    in->desc.back = (const float *)(const void *)in->back.first;
    if (in->map.memory)
        in->desc.thickness_stride = plane_stride(&in->map);
    if (in->back.memory)
        in->desc.back_stride = plane_stride(&in->back);
    if (behind & WITH_LAYERS) {
        in->layers = (gtao_layer *)calloc(LAYERS, sizeof *in->layers);
        if (!in->layers)
            abort();
        for (int i = 0; i < LAYERS; i++) {
            in->layers[i].depth = (const float *)(const void *)in->layer[i].first;
            in->layers[i].depth_stride = plane_stride(&in->layer[i]);
            in->layers[i].back = (const float *)(const void *)in->layer[LAYERS + i].first;
            in->layers[i].back_stride = plane_stride(&in->layer[LAYERS + i]);
        }
        in->layers[1].back = NULL;
        in->desc.layers = in->layers;
        in->desc.layer_count = LAYERS;
    }
}

static inline input input_make(const setting *s, int width, int height, layout l) {
    input in;
    int components = s->desc.normal_components == 4 ? 4 : 3;
    uint32_t seed = 7;
    memset(&in, 0, sizeof in);
    in.desc = s->desc;
    in.desc.width = width;
    in.desc.height = height;
    in.has_normals = s->normals;
    in.has_mask = s->given & WITH_MASK;
    in.depth = plane_make(height, sizeof(float) * (size_t)width, l);
    if (s->normals)
        in.normals = plane_make(height, sizeof(float) * (size_t)(components * width), l);
    if (s->given & WITH_MASK)
        in.mask = plane_make(height, (size_t)width, l);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            float z = scene_depth(x, y, seed, s->desc.depth_kind), n[4];
            memcpy(plane_row(&in.depth, y) + sizeof z * (size_t)x, &z, sizeof z);
            scene_normal(x, y, seed, n);
            if (s->normals)
                memcpy(plane_row(&in.normals, y) + sizeof(float) * (size_t)(components * x), n,
                       sizeof(float) * (size_t)components);
            if (s->given & WITH_MASK)
                plane_row(&in.mask, y)[x] = (unsigned char)(hash_cell(x / 5, y, seed) & 3u);
        }
    in.desc.depth = (const float *)(const void *)in.depth.first;
    in.desc.depth_stride = plane_stride(&in.depth);
    if (s->normals) {
        in.desc.normals = (const float *)(const void *)in.normals.first;
        in.desc.normal_stride = plane_stride(&in.normals);
    }
    if (s->given & WITH_MASK) {
        in.desc.mask = in.mask.first;
        in.desc.mask_stride = plane_stride(&in.mask);
    }
    input_behind(&in, s->given, width, height, seed, l);
    return in;
}

static inline void input_free(input *in) {
    free(in->depth.memory);
    free(in->normals.memory);
    free(in->mask.memory);
    free(in->map.memory);
    free(in->back.memory);
    for (int i = 0; i < 2 * LAYERS; i++)
        free(in->layer[i].memory);
    free(in->layers);
}

/* ---- results -------------------------------------------------------------------------------------------------- */

enum { WANT_VISIBILITY = 1, WANT_BENT = 2, WANT_PACKED = 4, WANT_ALL = 7, WANT_SH = 8, WANT_EVERYTHING = 15 };

/* Output buffers, and scratch of exactly the promised size. */
typedef struct result {
    gtao_output output;
    plane visibility, bent, packed, sh; /* sh: 9 times the rows */
    unsigned char *scratch_memory;
    void *scratch;
    size_t scratch_size;
} result;

/* bent_components 3 or 4; scratch_offset bytes off malloc's alignment. */
static inline result result_make(const gtao_desc *desc, int want, gtao_format format, int bent_components, layout l,
                                 size_t scratch_offset) {
    static const size_t bytes[] = {sizeof(float), 1, 2};
    size_t width = (size_t)desc->width;
    result r;
    memset(&r, 0, sizeof r);
    if (want & WANT_VISIBILITY) {
        r.visibility = plane_make(desc->height, bytes[format] * width, l);
        r.output.visibility = r.visibility.first;
        r.output.visibility_stride = plane_stride(&r.visibility);
        r.output.visibility_format = format;
    }
    if (want & WANT_BENT) {
        r.bent = plane_make(desc->height, sizeof(float) * (size_t)bent_components * width, l);
        r.output.bent_normals = (float *)(void *)r.bent.first;
        r.output.bent_stride = plane_stride(&r.bent);
        r.output.bent_components = bent_components;
    }
    if (want & WANT_PACKED) {
        r.packed = plane_make(desc->height, sizeof(uint32_t) * width, l);
        r.output.packed = (uint32_t *)(void *)r.packed.first;
        r.output.packed_stride = plane_stride(&r.packed);
    }
    if (want & WANT_SH) {
        r.sh = plane_make(9 * desc->height, sizeof(float) * width, l);
        r.output.sh = (float *)(void *)r.sh.first;
        r.output.sh_stride = plane_stride(&r.sh);
        r.output.sh_plane_stride = plane_stride(&r.sh) * desc->height;
    }
    r.scratch_size = gtao_scratch_size(desc);
    r.scratch_memory = (unsigned char *)malloc(r.scratch_size + scratch_offset);
    if (!r.scratch_memory)
        abort();
    r.scratch = r.scratch_memory + scratch_offset;
    return r;
}

static inline void result_free(result *r) {
    free(r->visibility.memory);
    free(r->bent.memory);
    free(r->packed.memory);
    free(r->sh.memory);
    free(r->scratch_memory);
}

static inline int result_equal(const result *a, const result *b) {
    return (!a->visibility.memory || !b->visibility.memory || planes_equal(&a->visibility, &b->visibility)) &&
           (!a->bent.memory || !b->bent.memory || planes_equal(&a->bent, &b->bent)) &&
           (!a->packed.memory || !b->packed.memory || planes_equal(&a->packed, &b->packed)) &&
           (!a->sh.memory || !b->sh.memory || planes_equal(&a->sh, &b->sh));
}

static inline int result_spilled(const result *r) {
    return (r->visibility.memory && plane_spilled(&r->visibility)) || (r->bent.memory && plane_spilled(&r->bent)) ||
           (r->packed.memory && plane_spilled(&r->packed)) || (r->sh.memory && plane_spilled(&r->sh));
}

/* ---- a sequence of frames -------------------------------------------------------------------------------------- */

typedef struct sequence {
    gtao_frame_desc frame;
    input in;
    plane motion;
    int width, height;
    void *state;
    size_t state_size;
    result out;
} sequence;

static inline sequence sequence_make(const setting *s, int width, int height, const gtao_frame_desc *options,
                                     layout l) {
    sequence q;
    setting plain = *s; /* frames take neither backs nor layers */
    plain.given &= WITH_MASK | WITH_MAP;
    memset(&q, 0, sizeof q);
    q.width = width, q.height = height;
    q.in = input_make(&plain, width, height, l);
    q.frame = *options;
    q.frame.desc = q.in.desc;
    q.motion = plane_make(height, (size_t)width * 3 * sizeof(float), l);
    if (options->motion_components) {
        q.frame.motion = (const float *)(const void *)plane_row(&q.motion, 0);
        q.frame.motion_stride = options->motion_components == 3 ? plane_stride(&q.motion) : q.motion.stride;
    }
    q.state_size = gtao_frame_state_size(&q.frame);
    q.state = malloc(q.state_size);
    if (!q.state || !q.state_size)
        abort();
    memset(q.state, 0xFF, q.state_size); /* whatever is read must have been written */
    q.out = result_make(&q.in.desc, options->sh_bands ? WANT_EVERYTHING : WANT_ALL, GTAO_FORMAT_FLOAT, 4, l, 0);
    q.out.output.sh_bands = options->sh_bands;
    return q;
}

static inline void sequence_free(sequence *q) {
    result_free(&q->out);
    free(q->state);
    free(q->motion.memory);
    input_free(&q->in);
}

/* Depth of frame k: a part of the image changes, and the rest now and then. */
static inline void sequence_fill(sequence *q, const setting *s, int k) {
    for (int y = 0; y < q->height; y++) {
        float *depth = (float *)(void *)plane_row(&q->in.depth, y), *motion = (float *)(void *)plane_row(&q->motion, y);
        for (int x = 0; x < q->width; x++) {
            float z = scene_depth(x + (x > 20 && y > 5 ? k : 0), y, 7u + (uint32_t)(k / 3), s->desc.depth_kind);
            uint32_t h = hash_cell(x / 5, y / 3, (uint32_t)k);
            memcpy(depth + x, &z, sizeof z);
            for (int i = 0; i < q->frame.motion_components; i++) {
                float m = (float)((int)(h >> (8 * i) & 63u) - 32) / 16.0f;
                if ((h >> 24) == 1)
                    m = float_nan();
                if ((h >> 24) == 2)
                    m = 1e30f;
                memcpy(motion + x * q->frame.motion_components + i, &m, sizeof m);
            }
        }
    }
}

/* The first frame cuts. */
static inline gtao_result sequence_run(sequence *q, int k, gtao_stats *stats) {
    q->frame.cut = k == 0;
    return gtao_frame(&q->frame, &q->out.output, q->state, q->state_size, stats);
}

/* Every option of a frame at least once. */
typedef struct frame_setting {
    const char *name;
    gtao_frame_desc frame;
} frame_setting;

static const frame_setting frame_settings[] = {
    {"frame-full", {.depth_tolerance = 0}},
    {"frame-half", {.half = 1}},
    {"frame-half-farthest-two-passes", {.half = 1, .reduction = GTAO_REDUCE_FARTHEST, .spatial_passes = 2}},
    {"frame-half-checkerboard-three-passes", {.half = 1, .reduction = GTAO_REDUCE_CHECKERBOARD, .spatial_passes = 3}},
    {"frame-no-spatial", {.half = 1, .no_spatial = 1}},
    {"frame-no-temporal", {.no_temporal = 1, .spatial_passes = 2}},
    {"frame-upsampling-only", {.half = 1, .no_temporal = 1, .no_spatial = 1}},
    {"frame-variance", {.history = GTAO_HISTORY_VARIANCE, .max_history = 5}},
    {"frame-free", {.half = 1, .history = GTAO_HISTORY_FREE, .depth_tolerance = 0.02f}},
    {"frame-moving-camera",
     {.half = 1, .view_to_previous = {1, 0, 0.01f, 0.02f, 0, 1, 0, -0.01f, -0.01f, 0, 1, 0.05f}}},
    {"frame-motion", {.half = 1, .motion_components = 2}},
    {"frame-motion-in-depth", {.motion_components = 3, .clamp_window = 0.1f}},
    {"frame-upsample-normals", {.half = 1, .upsample_normals = 1}},
    {"frame-sh", {.half = 1, .sh_bands = 3, .motion_components = 2}},
    {"frame-sh-two-bands", {.sh_bands = 2, .spatial_passes = 2, .no_temporal = 1}},
};

enum { FRAME_SETTING_COUNT = (int)(sizeof frame_settings / sizeof frame_settings[0]) };

#endif
