/* Data never fails: whatever the depth, the normals and the camera, visibility is in [0, 1], bent normals are unit
 * vectors, every kernel gives the same bits, and one bad pixel stays where it is. Run under ASan and UBSan too: every
 * buffer here has exactly the promised size. */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <float.h>
#include <math.h>
#include <stdio.h>

#include "inputs.h"

static const layout tight = {0, 0, 0};

/* What a buffer should not hold, or hardly. */
static const uint32_t bad_bits[] = {
    0x7FC00000u, /* NaN */
    0xFFC00000u, /* -NaN */
    0x7F800001u, /* signalling NaN */
    0x7F800000u, /* inf */
    0xFF800000u, /* -inf */
    0x00000000u, /* 0 */
    0x80000000u, /* -0 */
    0x00000001u, /* smallest denormal */
    0x007FFFFFu, /* largest denormal */
    0x80000001u, /* smallest negative denormal */
    0x00800000u, /* smallest normal */
    0x0DA24260u, /* 1e-30 */
    0x7149F2CAu, /* 1e30 */
    0x7F7FFFFFu, /* largest */
    0xFF7FFFFFu, /* largest negative */
    0xBF800000u, /* -1 */
};
enum { BAD_COUNT = (int)(sizeof bad_bits / sizeof bad_bits[0]) };

static void plane_set(plane *p, int y, int i, uint32_t bits) {
    memcpy(plane_row(p, y) + sizeof bits * (size_t)i, &bits, sizeof bits);
}

static float plane_get(const plane *p, int y, int i) {
    float f;
    memcpy(&f, plane_row(p, y) + sizeof f * (size_t)i, sizeof f);
    return f;
}

static void check_values(const result *r, int width, int height, const char *what) {
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            float v = plane_get(&r->visibility, y, x), bx = plane_get(&r->bent, y, 3 * x),
                  by = plane_get(&r->bent, y, 3 * x + 1), bz = plane_get(&r->bent, y, 3 * x + 2);
            double length = sqrt((double)bx * (double)bx + (double)by * (double)by + (double)bz * (double)bz);
            for (int i = 0; i < 9; i++) {
                float c = plane_get(&r->sh, i * height + y, x);
                if (!float_finite(c) || !(fabs((double)c) < 1.3))
                    fail_msg("%s: coefficient %d is %g at (%d, %d)", what, i, (double)c, x, y);
            }
            double first = 0.0; /* a bent normal before it gets unit length: at most 1 and what few slices overshoot */
            for (int i = 1; i < 4; i++)
                first += pow((double)plane_get(&r->sh, i * height + y, x) / 0.48860251, 2.0);
            if (!(first < 2.9))
                fail_msg("%s: first band of length %g at (%d, %d)", what, sqrt(first), x, y);
            if (!float_finite(v) || !(v >= 0.0f && v <= 1.0f))
                fail_msg("%s: visibility %g at (%d, %d)", what, (double)v, x, y);
            if (!float_finite(bx) || !float_finite(by) || !float_finite(bz) || !(fabs(length - 1.0) < 1e-4))
                fail_msg("%s: bent normal (%g, %g, %g) at (%d, %d)", what, (double)bx, (double)by, (double)bz, x, y);
        }
}

/* Computes with every kernel, checks each, and returns the scalar result. */
static result compute_checked(gtao_desc desc, const char *what) {
    result scalar = {0};
    for (int isa = GTAO_ISA_SCALAR; isa <= GTAO_ISA_NEON; isa++) {
        result r;
        gtao_result status;
        if (!gtao_isa_available((gtao_isa)isa))
            continue;
        desc.isa = (gtao_isa)isa;
        r = result_make(&desc, WANT_EVERYTHING, GTAO_FORMAT_FLOAT, 3, tight, 0);
        memset(r.scratch, 0xFF, r.scratch_size); /* all NaN */
        status = gtao_compute(&desc, &r.output, r.scratch, r.scratch_size, NULL);
        if (status != GTAO_OK)
            fail_msg("%s: %s", what, gtao_result_string(status));
        check_values(&r, desc.width, desc.height, what);
        if (isa == GTAO_ISA_SCALAR) {
            scalar = r;
        } else {
            if (!result_equal(&r, &scalar))
                fail_msg("%s: %s differs from scalar", what, gtao_isa_name((gtao_isa)isa));
            result_free(&r);
        }
    }
    return scalar;
}

static void expect_sane(const gtao_desc *desc, const char *what) {
    result r = compute_checked(*desc, what);
    result_free(&r);
}

/* ---- depth and normals ---------------------------------------------------------------------------------------- */

/* Distance along one axis, around the edge if the image repeats. */
static int separation(int a, int b, int size, int wraps) {
    int d = a < b ? b - a : a - b;
    return wraps && size - d < d ? size - d : d;
}

/* One bad depth changes nothing farther away than the search reaches, plus the neighbours a normal derived from depth
 * looks at and the rounding of a sample to its pixel. */
static void one_bad_depth_stays_in_reach(void **state) {
    enum { WIDTH = 35, HEIGHT = 29, REACH = 4, MARGIN = 3 };
    const setting *s = (const setting *)*state;
    static const int at[][2] = {{17, 14}, {0, 0}, {34, 11}, {5, 28}};
    setting capped = *s;
    input clean;
    result expected;
    capped.desc.max_radius_px = REACH;
    clean = input_make(&capped, WIDTH, HEIGHT, tight);
    expected = compute_checked(clean.desc, s->name);
    for (int k = 0; k < BAD_COUNT; k++) {
        input in = input_make(&capped, WIDTH, HEIGHT, tight);
        const int *p = at[k % 4];
        int wraps = s->desc.border == GTAO_BORDER_WRAP;
        char what[80];
        result r;
        snprintf(what, sizeof what, "%s, depth %08x at (%d, %d)", s->name, (unsigned)bad_bits[k], p[0], p[1]);
        plane_set(&in.depth, p[1], p[0], bad_bits[k]);
        r = compute_checked(in.desc, what);
        for (int y = 0; y < HEIGHT; y++)
            for (int x = 0; x < WIDTH; x++) {
                int dx = separation(x, p[0], WIDTH, wraps), dy = separation(y, p[1], HEIGHT, wraps);
                if (dx <= REACH + MARGIN && dy <= REACH + MARGIN)
                    continue;
                if (memcmp(plane_row(&r.visibility, y) + 4 * x, plane_row(&expected.visibility, y) + 4 * x, 4) != 0 ||
                    memcmp(plane_row(&r.bent, y) + 12 * x, plane_row(&expected.bent, y) + 12 * x, 12) != 0)
                    fail_msg("%s: (%d, %d) changed", what, x, y);
            }
        result_free(&r);
        input_free(&in);
    }
    result_free(&expected);
    input_free(&clean);
}

/* A normal is nobody's business but its pixel's. */
static void one_bad_normal_changes_its_pixel_only(void **state) {
    enum { WIDTH = 23, HEIGHT = 13, X = 9, Y = 6 };
    const setting *s = (const setting *)*state;
    input clean = input_make(s, WIDTH, HEIGHT, tight);
    int components = s->desc.normal_components == 4 ? 4 : 3;
    result expected;
    if (!s->normals) {
        input_free(&clean);
        return;
    }
    expected = compute_checked(clean.desc, s->name);
    for (int k = 0; k < BAD_COUNT; k++) {
        input in = input_make(s, WIDTH, HEIGHT, tight);
        char what[80];
        result r;
        snprintf(what, sizeof what, "%s, normal %08x", s->name, (unsigned)bad_bits[k]);
        for (int i = 0; i < 3; i++) /* one component, two, or all */
            if (k % 3 >= i)
                plane_set(&in.normals, Y, components * X + i, bad_bits[k]);
        r = compute_checked(in.desc, what);
        for (int y = 0; y < HEIGHT; y++)
            for (int x = 0; x < WIDTH; x++)
                if ((x != X || y != Y) &&
                    (memcmp(plane_row(&r.visibility, y) + 4 * x, plane_row(&expected.visibility, y) + 4 * x, 4) != 0 ||
                     memcmp(plane_row(&r.bent, y) + 12 * x, plane_row(&expected.bent, y) + 12 * x, 12) != 0))
                    fail_msg("%s: (%d, %d) changed", what, x, y);
        result_free(&r);
        input_free(&in);
    }
    result_free(&expected);
    input_free(&clean);
}

enum { SPRINKLED, WHOLE, RANDOM_BITS };

static void spoil(plane *p, int floats, int how, int k, uint32_t *random) {
    for (int y = 0; y < p->rows; y++)
        for (int i = 0; i < floats; i++) {
            uint32_t chance = next_random(random) % 8;
            if (how == RANDOM_BITS)
                plane_set(p, y, i, next_random(random) << 8 | next_random(random) >> 16);
            else if (how == WHOLE)
                plane_set(p, y, i, bad_bits[k]);
            else if (chance == 0)
                plane_set(p, y, i, bad_bits[next_random(random) % BAD_COUNT]);
        }
}

static void expect_sane_estimate(const gtao_desc *desc, const char *what) {
    size_t size = gtao_thickness_scratch_size(desc), count = (size_t)(desc->width * desc->height);
    void *scratch = malloc(size);
    float *map = (float *)malloc(count * sizeof *map);
    assert_true(scratch && map);
    assert_int_equal(gtao_estimate_thickness(desc, map, 0, scratch, size), GTAO_OK);
    for (size_t i = 0; i < count; i++)
        if (!(map[i] >= 0.0f)) /* infinite is allowed */
            fail_msg("%s: estimated thickness %g", what, (double)map[i]);
    free(scratch);
    free(map);
}

static void spoiled_buffers_give_sane_results(void **state) {
    enum { WIDTH = 21, HEIGHT = 13 };
    const setting *s = (const setting *)*state;
    uint32_t random = 99;
    int components = s->desc.normal_components == 4 ? 4 : 3;
    for (int how = SPRINKLED; how <= RANDOM_BITS; how++)
        for (int k = 0; k < (how == WHOLE ? BAD_COUNT : 4); k++)
            for (int which = 1; which <= (s->given > WITH_MASK ? 7 : s->normals ? 3 : 1); which++) {
                input in = input_make(s, WIDTH, HEIGHT, tight);
                char what[80];
                snprintf(what, sizeof what, "%s, spoiled %d %d %d", s->name, how, k, which);
                if (which & 1)
                    spoil(&in.depth, WIDTH, how, k, &random);
                if (which & 4) {
                    spoil(&in.map, WIDTH, how, k, &random);
                    spoil(&in.back, WIDTH, how, k, &random);
                    for (int i = 0; i < 2 * LAYERS; i++)
                        spoil(&in.layer[i], WIDTH, how, k, &random);
                }
                if (which & 2 && s->normals)
                    spoil(&in.normals, WIDTH * components, how, k, &random);
                expect_sane(&in.desc, what);
                expect_sane_estimate(&in.desc, what);
                input_free(&in);
            }
}

static void spans_of_depth(void **state) {
    /* Everything far, everything near, and both next to each other. */
    static const float scales[] = {1e-38f, 1e-30f, 1e-20f, 1e-10f, 1e10f, 1e20f, 1e30f, 1e37f};
    enum { WIDTH = 21, HEIGHT = 13, SCALES = (int)(sizeof scales / sizeof scales[0]) };
    const setting *s = (const setting *)*state;
    for (int k = 0; k < SCALES; k++)
        for (int mixed = 0; mixed < 2; mixed++)
            for (int with_radius = 0; with_radius < 2; with_radius++) {
                input in = input_make(s, WIDTH, HEIGHT, tight);
                char what[80];
                snprintf(what, sizeof what, "%s, depth times %g%s%s", s->name, (double)scales[k],
                         mixed ? " in places" : "", with_radius ? ", radius too" : "");
                for (int y = 0; y < HEIGHT; y++)
                    for (int x = 0; x < WIDTH; x++)
                        if (!mixed || (hash_cell(x / 3, y / 3, 5) & 1u)) {
                            float z = plane_get(&in.depth, y, x) * scales[k];
                            memcpy(plane_row(&in.depth, y) + sizeof z * (size_t)x, &z, sizeof z);
                        }
                if (with_radius)
                    in.desc.radius *= scales[k];
                expect_sane(&in.desc, what);
                input_free(&in);
            }
}

/* ---- sizes and numbers of the description --------------------------------------------------------------------- */

/* As tall as can be, searched from end to end: offsets beyond 16 bits would wrap around. */
static void tallest_image(void **state) {
    enum { WIDTH = 20, HEIGHT = 32768, LAST = 16 };
    float *depth = calloc((size_t)WIDTH * HEIGHT, sizeof *depth),
          *visibility = calloc((size_t)WIDTH * HEIGHT, sizeof *depth);
    gtao_desc desc = {0};
    gtao_output output = {0};
    gtao_context *context;
    size_t size;
    void *scratch;
    (void)state;
    assert_non_null(depth);
    assert_non_null(visibility);
    desc.width = WIDTH;
    desc.height = HEIGHT;
    desc.depth = depth;
    desc.depth_kind = GTAO_DEPTH_HEIGHT;
    desc.camera.projection = GTAO_ORTHOGRAPHIC;
    desc.camera.sx = 1;
    desc.radius = float_inf();
    desc.slices = 1;
    desc.noise = GTAO_NOISE_NONE;
    output.visibility = visibility;
    for (desc.every_pixel = 0; desc.every_pixel < 2; desc.every_pixel++) {
        size = gtao_scratch_size(&desc);
        scratch = malloc(size);
        assert_non_null(scratch);
        assert_int_equal(gtao_begin(&desc, &output, scratch, size, &context), GTAO_OK);
        gtao_prepare_rows(context, 0, HEIGHT);
        gtao_visibility_rows(context, 0, LAST, NULL);
        gtao_visibility_rows(context, HEIGHT - LAST, HEIGHT, NULL);
        for (size_t i = 0; i < (size_t)WIDTH * LAST; i++) {
            assert_true(visibility[i] == 1.0f);
            assert_true(visibility[(size_t)WIDTH * HEIGHT - 1 - i] == 1.0f);
        }
        free(scratch);
    }
    free(depth);
    free(visibility);
}

/* Wires a radius and more in front of a wall leave it open, however few pixels wide they are. */
static void occluders_out_of_reach(void **state) {
    enum { SIZE = 48 };
    static float depth[SIZE * SIZE], normals[3 * SIZE * SIZE], visibility[SIZE * SIZE];
    (void)state;
    for (int wire = 1; wire <= 3; wire++)
        for (int gap = 1; gap <= 7; gap++)
            for (int noise = GTAO_NOISE_MEMO; noise <= GTAO_NOISE_NONE; noise++) {
                gtao_desc desc = {0};
                gtao_output output = {0};
                size_t size;
                void *scratch;
                for (int y = 0; y < SIZE; y++)
                    for (int x = 0; x < SIZE; x++) {
                        int bar = x % (wire + gap) < wire || y % (wire + 2 * gap) < wire;
                        normals[3 * (y * SIZE + x) + 2] = -1.0f;
                        depth[y * SIZE + x] = bar ? 3.8f + 0.01f * (float)gap : 5.0f;
                    }
                desc.width = desc.height = SIZE;
                desc.depth = depth;
                desc.normals = normals;
                desc.camera = gtao_camera_from_fov(60, SIZE, SIZE);
                desc.radius = 1.0f;
                desc.slices = 8;
                desc.every_pixel = 1;
                desc.noise = (gtao_noise)noise;
                desc.falloff = gap & 1 ? 0.25f : 0.0f;
                output.visibility = visibility;
                size = gtao_scratch_size(&desc);
                scratch = malloc(size);
                assert_non_null(scratch);
                assert_int_equal(gtao_compute(&desc, &output, scratch, size, NULL), GTAO_OK);
                for (int i = 0; i < SIZE * SIZE; i++)
                    if (depth[i] > 4.5f && visibility[i] < 0.999f)
                        fail_msg("wires of %d, gaps of %d, noise %d: visibility %g at (%d, %d)", wire, gap, noise,
                                 (double)visibility[i], i % SIZE, i / SIZE);
                free(scratch);
            }
}

static void smallest_images(void **state) {
    static const int sizes[][2] = {{1, 1}, {1, 2}, {2, 1}, {1, 67}, {67, 1}, {2, 2}, {3, 2}, {5, 3}, {4, 4}, {2, 31}};
    const setting *s = (const setting *)*state;
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        input in = input_make(s, sizes[i][0], sizes[i][1], tight);
        char what[80];
        snprintf(what, sizeof what, "%s, %dx%d", s->name, sizes[i][0], sizes[i][1]);
        expect_sane(&in.desc, what);
        input_free(&in);
    }
}

/* Calls f with the description of a small image and an absurd value. */
static void with_extremes(const setting *s, const char *name, void (*set)(gtao_desc *desc, float value)) {
    static const float values[] = {0,    FLT_MIN, 1e-30f, 1e-10f,  1e-3f,  0.5f,  1,
                                   1e3f, 1e10f,   1e30f,  FLT_MAX, 1e-38f, 1e19f, 1.8e19f};
    for (size_t i = 0; i <= sizeof values / sizeof values[0]; i++) {
        /* the last: a denormal */
        float value = i < sizeof values / sizeof values[0] ? values[i] : float_from_bits(1);
        input in = input_make(s, 21, 13, tight);
        char what[80];
        snprintf(what, sizeof what, "%s, %s %g", s->name, name, (double)value);
        set(&in.desc, value);
        expect_sane(&in.desc, what);
        input_free(&in);
    }
}

static void set_radius(gtao_desc *d, float value) {
    d->radius = value;
}
static void set_radius_infinite(gtao_desc *d, float value) {
    d->radius = float_inf();
    d->falloff = value < 1.0f ? value : 1.0f;
}
static void set_radius_all_falloff(gtao_desc *d, float value) {
    d->radius = value;
    d->falloff = 1;
}
static void set_falloff_tiny(gtao_desc *d, float value) {
    d->falloff = value < 1.0f ? value : 1e-30f;
}
static void set_focal(gtao_desc *d, float value) {
    value = value > 0.0f ? value : 1.0f;
    d->camera.fx = d->camera.sx = value;
    d->camera.fy = d->camera.sy = 0;
}
static void set_focal_x(gtao_desc *d, float value) {
    d->camera.fx = d->camera.sx = value > 0.0f ? value : 1.0f;
    d->camera.fy = d->camera.sy = 1;
}
static void set_center(gtao_desc *d, float value) {
    d->camera.off_center = 1;
    d->camera.cx = value;
    d->camera.cy = -value;
}
static void set_center_y(gtao_desc *d, float value) {
    d->camera.off_center = 1;
    d->camera.cx = 3;
    d->camera.cy = value;
}
static void set_device_scale(gtao_desc *d, float value) {
    if (d->depth_kind == GTAO_DEPTH_DEVICE)
        d->device_scale = value > 0.0f ? value : -1.0f;
}
static void set_device_bias(gtao_desc *d, float value) {
    if (d->depth_kind == GTAO_DEPTH_DEVICE)
        d->device_bias = value;
}
static void set_sky(gtao_desc *d, float value) {
    d->sky_z = value;
}
static void set_axes(gtao_desc *d, float value) {
    d->normal_axes[0] = d->normal_axes[2] = value;
}
static void set_matrix(gtao_desc *d, float value) {
    for (int i = 0; i < 9; i++)
        d->normal_to_view[i] = i % 4 == 0 ? value : i == 5 ? -value : 0.0f;
}
static void set_singular_matrix(gtao_desc *d, float value) {
    memset(d->normal_to_view, 0, sizeof d->normal_to_view);
    d->normal_to_view[1] = value;
}
static void set_thickness(gtao_desc *d, float value) {
    if (d->estimator != GTAO_ESTIMATOR_MEMO && d->thin_blend == 0.0f && !d->far_depth)
        d->thickness = value;
}
static void set_thickness_and_radius(gtao_desc *d, float value) {
    set_thickness(d, 1.0f);
    d->radius = value;
}
static void set_max_radius(gtao_desc *d, float value) {
    d->max_radius_px = value < 1e6f ? (int)value : INT32_MAX;
}

static void absurd_descriptions(void **state) {
    const setting *s = (const setting *)*state;
    with_extremes(s, "radius", set_radius);
    with_extremes(s, "infinite radius, falloff", set_radius_infinite);
    with_extremes(s, "falloff 1, radius", set_radius_all_falloff);
    with_extremes(s, "falloff", set_falloff_tiny);
    with_extremes(s, "fx and sx", set_focal);
    with_extremes(s, "fy = 1, fx", set_focal_x);
    with_extremes(s, "cx = -cy", set_center);
    with_extremes(s, "cy", set_center_y);
    with_extremes(s, "device_scale", set_device_scale);
    with_extremes(s, "device_bias", set_device_bias);
    with_extremes(s, "sky_z", set_sky);
    with_extremes(s, "normal_axes", set_axes);
    with_extremes(s, "normal_to_view", set_matrix);
    with_extremes(s, "singular normal_to_view", set_singular_matrix);
    with_extremes(s, "max_radius_px", set_max_radius);
    with_extremes(s, "thickness", set_thickness);
    with_extremes(s, "thickness 1, radius", set_thickness_and_radius);
}

/* ---- formulas ------------------------------------------------------------------------------------------------- */

static void formulas_are_finite(void **state) {
    (void)state;
    for (int i = 0; i < BAD_COUNT; i++)
        for (int k = 0; k < BAD_COUNT; k++) {
            float a = float_from_bits(bad_bits[i]), b = float_from_bits(bad_bits[k]);
            float t[2], rgb[3], s, c, albedo[3];
            albedo[0] = albedo[1] = albedo[2] = b;
            gtao_sincos(a, &s, &c);
            gtao_arc_bent(a, b, a, t);
            gtao_multi_bounce_rgb(a, albedo, rgb);
            if (!float_finite(gtao_acos(a)))
                fail_msg("gtao_acos(%g)", (double)a);
            if (!float_finite(s) || !float_finite(c))
                fail_msg("gtao_sincos(%g)", (double)a);
            if (!float_finite(gtao_atan2(a, b)))
                fail_msg("gtao_atan2(%g, %g)", (double)a, (double)b);
            if (!float_finite(gtao_arc(a, b)))
                fail_msg("gtao_arc(%g, %g)", (double)a, (double)b);
            if (!float_finite(gtao_arc_uniform(a)))
                fail_msg("gtao_arc_uniform(%g)", (double)a);
            if (!float_finite(t[0]) || !float_finite(t[1]))
                fail_msg("gtao_arc_bent(%g, %g)", (double)a, (double)b);
            if (!(gtao_multi_bounce(a, b) >= 0.0f && gtao_multi_bounce(a, b) <= 1.0f))
                fail_msg("gtao_multi_bounce(%g, %g)", (double)a, (double)b);
            if (!(gtao_multi_bounce_series(a, b) >= 0.0f && gtao_multi_bounce_series(a, b) <= 1.0f))
                fail_msg("gtao_multi_bounce_series(%g, %g)", (double)a, (double)b);
            if (!(rgb[0] >= 0.0f && rgb[2] <= 1.0f))
                fail_msg("gtao_multi_bounce_rgb(%g, %g)", (double)a, (double)b);
        }
}

static void packing_takes_anything(void **state) {
    (void)state;
    for (int i = 0; i < BAD_COUNT; i++)
        for (int k = 0; k < BAD_COUNT; k++) {
            float n[3] = {float_from_bits(bad_bits[k]), 0, -1}, visibility;
            gtao_unpack(gtao_pack(float_from_bits(bad_bits[i]), n), &visibility, n);
            assert_true(visibility >= 0.0f && visibility <= 1.0f);
            for (int j = 0; j < 3; j++)
                assert_true(n[j] >= -1.01f && n[j] <= 1.01f);
        }
}

static void noise_is_a_fraction(void **state) {
    static const int at[] = {0, 1, 2, 3, 63, 64, 4095, 32767, -1, INT32_MAX, INT32_MIN};
    static const uint32_t frames[] = {0, 1, 5, 6, 23, 24, 63, 64, UINT32_MAX};
    (void)state;
    for (int noise = GTAO_NOISE_MEMO; noise <= GTAO_NOISE_NONE; noise++)
        for (size_t i = 0; i < sizeof at / sizeof at[0]; i++)
            for (size_t j = 0; j < sizeof at / sizeof at[0]; j++)
                for (size_t k = 0; k < sizeof frames / sizeof frames[0]; k++) {
                    float direction, offset;
                    gtao_noise_at((gtao_noise)noise, at[i], at[j], frames[k], &direction, &offset);
                    if (!(direction >= 0.0f && direction < 1.0f && offset >= 0.0f && offset < 1.0f))
                        fail_msg("noise %d at (%d, %d), frame %u: %g, %g", noise, at[i], at[j], (unsigned)frames[k],
                                 (double)direction, (double)offset);
                }
}

int main(void) {
    static const struct {
        const char *name;
        CMUnitTestFunction run;
    } checks[] = {
        {"one_bad_depth_stays_in_reach", one_bad_depth_stays_in_reach},
        {"one_bad_normal_changes_its_pixel_only", one_bad_normal_changes_its_pixel_only},
        {"spoiled_buffers_give_sane_results", spoiled_buffers_give_sane_results},
        {"spans_of_depth", spans_of_depth},
        {"smallest_images", smallest_images},
        {"absurd_descriptions", absurd_descriptions},
    };
    enum { CHECK_COUNT = (int)(sizeof checks / sizeof checks[0]) };
    static struct CMUnitTest tests[CHECK_COUNT * SETTING_COUNT + 5];
    static char names[CHECK_COUNT * SETTING_COUNT][64];
    static setting copies[SETTING_COUNT]; /* cmocka's state is not const */
    const struct CMUnitTest others[5] = {cmocka_unit_test(formulas_are_finite),
                                         cmocka_unit_test(packing_takes_anything),
                                         cmocka_unit_test(noise_is_a_fraction), cmocka_unit_test(tallest_image),
                                         cmocka_unit_test(occluders_out_of_reach)};
    size_t count = 0;
    memcpy(copies, settings, sizeof settings);
    for (int c = 0; c < CHECK_COUNT; c++)
        for (int i = 0; i < SETTING_COUNT; i++, count++) {
            snprintf(names[count], sizeof names[count], "%s: %s", checks[c].name, settings[i].name);
            tests[count].name = names[count];
            tests[count].test_func = checks[c].run;
            tests[count].initial_state = &copies[i];
        }
    memcpy(tests + count, others, sizeof others);
    /* What cmocka_run_group_tests() expands to, which wants an array's size. */
    return _cmocka_run_group_tests("robust", tests, count + 5, NULL, NULL);
}
