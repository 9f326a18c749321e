/* Frames: half resolution, filters in space and time, upsampling. The same bits from every kernel and split, what is
 * constant stays so, nothing bad spreads or stays, and what is skipped would have come out the same. How good the result
 * is: tests/reference/test_frames.c. */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <stdio.h>

#include "inputs.h"

static const layout tight = {0, 0, 0};

static void run(sequence *q, int k, gtao_stats *stats) {
    assert_int_equal(sequence_run(q, k, stats), GTAO_OK);
}

/* ---- bits ------------------------------------------------------------------------------------------------------- */

/* All settings, each with another of the frame's options. */
static void isas_agree(void **state) {
    const setting *s = (const setting *)*state;
    for (size_t o = (size_t)(s - settings) % 4; o < FRAME_SETTING_COUNT; o += 4) {
        int width = 131 - 9 * (int)o, height = 9 + 5 * (int)o;
        sequence scalar = sequence_make(s, width, height, &frame_settings[o].frame, tight);
        scalar.frame.desc.isa = GTAO_ISA_SCALAR;
        for (int isa = GTAO_ISA_SSE2; isa <= GTAO_ISA_NEON; isa++) {
            sequence q;
            if (!gtao_isa_available((gtao_isa)isa))
                continue;
            q = sequence_make(s, width, height, &frame_settings[o].frame, tight);
            q.frame.desc.isa = (gtao_isa)isa;
            for (int k = 0; k < 4; k++) {
                sequence_fill(&scalar, s, k);
                sequence_fill(&q, s, k);
                run(&scalar, k, NULL);
                run(&q, k, NULL);
                if (!result_equal(&scalar.out, &q.out))
                    fail_msg("%s, %s, frame %d: %s differs from scalar", s->name, frame_settings[o].name, k,
                             gtao_isa_name((gtao_isa)isa));
            }
            sequence_free(&q);
        }
        sequence_free(&scalar);
    }
}

/* Units in any order, one by one; rows anywhere in memory. */
static void splits_and_strides_agree(void **state) {
    static const layout odd = {12, 20, 1};
    (void)state;
    for (size_t o = 0; o < FRAME_SETTING_COUNT; o++) {
        const setting *s = &settings[o % 2];
        sequence whole = sequence_make(s, 91, 45, &frame_settings[o].frame, tight);
        sequence split = sequence_make(s, 91, 45, &frame_settings[o].frame, odd);
        for (int k = 0; k < 4; k++) {
            gtao_frame_context *context;
            gtao_stats one = {0}, many = {0};
            sequence_fill(&whole, s, k);
            sequence_fill(&split, s, k);
            run(&whole, k, &one);
            split.frame.cut = k == 0;
            assert_int_equal(gtao_frame_begin(&split.frame, &split.out.output, split.state, split.state_size, &context),
                             GTAO_OK);
            for (int stage = 0; stage < gtao_frame_stages(context); stage++) {
                int units = gtao_frame_units(context, stage);
                assert_non_null(gtao_frame_stage_name(context, stage));
                for (int i = 0; i < units; i++) {
                    int unit = (i * 5 + 3) % units;
                    if (units % 5 == 0)
                        unit = units - 1 - i;
                    gtao_frame_run(context, stage, unit, unit + 1, &many);
                }
            }
            if (!result_equal(&whole.out, &split.out))
                fail_msg("%s, frame %d: units one by one differ from the whole", frame_settings[o].name, k);
            assert_memory_equal(&one, &many, sizeof one);
        }
        assert_false(result_spilled(&split.out));
        sequence_free(&whole);
        sequence_free(&split);
    }
}

/* A plane, tilted: visibility 1 and bent normal = normal, to the bit and to rounding, through every stage. */
static void open_planes_stay_open(void **state) {
    (void)state;
    for (size_t o = 0; o < FRAME_SETTING_COUNT; o++) {
        static const setting s = {"plane", 1, 0, {PERSPECTIVE, .radius = 1.5f, .slices = 1, .steps = 8}};
        const int width = 75, height = 41;
        sequence q = sequence_make(&s, width, height, &frame_settings[o].frame, tight);
        const float n[3] = {0.3f, -0.6f, -0.741619848f};
        for (int y = 0; y < height; y++)
            for (int x = 0; x < width; x++) {
                float rx = ((float)x + 0.5f - 37.5f) / 60, ry = ((float)y + 0.5f - 20.5f) / 60;
                float z = 4 * n[2] / (n[0] * rx + n[1] * ry + n[2]), still[3] = {0, 0, 0};
                memcpy(plane_row(&q.in.depth, y) + 4 * x, &z, 4);
                memcpy(plane_row(&q.in.normals, y) + 12 * x, n, 12);
                memcpy(plane_row(&q.motion, y) + 4 * q.frame.motion_components * x, still,
                       4 * (size_t)q.frame.motion_components);
            }
        for (int k = 0; k < 3; k++) {
            float tolerance = frame_settings[o].frame.reduction == GTAO_REDUCE_CHECKERBOARD ? 1e-3f : 0.0f;
            run(&q, k, NULL);
            for (int y = 0; y < height; y++)
                for (int x = 0; x < width; x++) {
                    float v, b[4];
                    memcpy(&v, plane_row(&q.out.visibility, y) + 4 * x, 4);
                    memcpy(b, plane_row(&q.out.bent, y) + 16 * x, 16);
                    if (!(v >= 1.0f - tolerance && v <= 1.0f))
                        fail_msg("%s, frame %d, (%d, %d): visibility %.8g", frame_settings[o].name, k, x, y, (double)v);
                    for (int i = 0; i < 3; i++)
                        if (!(fabsf(b[i] - n[i]) < 2e-5f + tolerance))
                            fail_msg("%s, frame %d, (%d, %d): bent normal %.7g %.7g %.7g", frame_settings[o].name, k, x,
                                     y, (double)b[0], (double)b[1], (double)b[2]);
                }
        }
        sequence_free(&q);
    }
}

/* ---- bad values ------------------------------------------------------------------------------------------------- */

/* Whatever the input: visibility in [0, 1], unit bent normals. */
static void bad_values_give_good_ones(void **state) {
    static const uint32_t bad[] = {0x7FC00000u, 0x7F800000u, 0xFF800000u, 0, 0x80000000u, 1, 0x7F7FFFFFu, 0x0DA24260u};
    uint32_t random = 5;
    (void)state;
    for (size_t o = 0; o < FRAME_SETTING_COUNT; o++) {
        const setting *s = &settings[o * 2 % (sizeof settings / sizeof settings[0])];
        sequence q = sequence_make(s, 53, 31, &frame_settings[o].frame, tight);
        for (int k = 0; k < 6; k++) {
            sequence_fill(&q, s, k);
            for (int i = 0; i < 40; i++) {
                float f = float_from_bits(bad[next_random(&random) % 8]);
                size_t x = next_random(&random) % 53, y = next_random(&random) % 31;
                plane *p = i % 3 == 0 ? &q.in.depth : i % 3 == 1 && q.in.has_normals ? &q.in.normals : &q.motion;
                memcpy(plane_row(p, (int)y) + 4 * x, &f, 4);
            }
            run(&q, k, NULL);
            for (int y = 0; y < 31; y++)
                for (int x = 0; x < 53; x++) {
                    float v, b[4], length;
                    memcpy(&v, plane_row(&q.out.visibility, y) + 4 * x, 4);
                    memcpy(b, plane_row(&q.out.bent, y) + 16 * x, 16);
                    length = b[0] * b[0] + b[1] * b[1] + b[2] * b[2];
                    if (!float_finite(v) || !(v >= 0.0f && v <= 1.0f))
                        fail_msg("%s, %s, frame %d, (%d, %d): visibility %g", s->name, frame_settings[o].name, k, x, y,
                                 (double)v);
                    if (!float_finite(length) || !(length > 0.999f && length < 1.001f))
                        fail_msg("%s, %s, frame %d, (%d, %d): bent normal %g %g %g", s->name, frame_settings[o].name, k,
                                 x, y, (double)b[0], (double)b[1], (double)b[2]);
                }
        }
        sequence_free(&q);
    }
}

/* One NaN changes nothing beyond its reach, and is forgotten once it is gone. */
static void one_nan_neither_spreads_nor_stays(void **state) {
    static const setting s = {"nan", 0, 0, {PERSPECTIVE, .radius = 0.5f, .slices = 1, .steps = 8}};
    const int width = 96, height = 64;
    (void)state;
    for (int half = 0; half < 2; half++) {
        gtao_frame_desc with = {.half = half};
        sequence clean = sequence_make(&s, width, height, &with, tight),
                 hit = sequence_make(&s, width, height, &with, tight);
        float nan = float_nan(), left = 0;
        for (int k = 0; k < 60; k++) {
            sequence_fill(&clean, &s, 0);
            sequence_fill(&hit, &s, 0);
            if (k == 5)
                memcpy(plane_row(&hit.in.depth, 30) + 4 * 40, &nan, 4);
            run(&clean, k, NULL);
            run(&hit, k, NULL);
            left = 0;
            for (int y = 0; y < height; y++)
                for (int x = 0; x < width; x++) {
                    float a, b;
                    memcpy(&a, plane_row(&clean.out.visibility, y) + 4 * x, 4);
                    memcpy(&b, plane_row(&hit.out.visibility, y) + 4 * x, 4);
                    left = fabsf(a - b) > left ? fabsf(a - b) : left;
                    if (memcmp(&a, &b, 4) != 0 && (abs(x - 40) > 32 || abs(y - 30) > 32))
                        fail_msg("half %d, frame %d, (%d, %d): %g instead of %g", half, k, x, y, (double)b, (double)a);
                }
            if (k < 5)
                assert_true(left == 0.0f);
        }
        if (!(left < 0.01f))
            fail_msg("half %d: %g left of it after 55 frames", half, (double)left);
        sequence_free(&clean);
        sequence_free(&hit);
    }
}

/* ---- skipping --------------------------------------------------------------------------------------------------- */

/* A long sequence that comes to rest, is disturbed in one place, and comes to rest again. */
static void skipping_changes_no_bit(void **state) {
    static const setting s = {"skip", 1, 1, {PERSPECTIVE, .radius = 0.25f, .slices = 1, .steps = 4}};
    (void)state;
    for (int half = 0; half < 2; half++) {
        const int width = 330 * (1 + half), height = 60 * (1 + half);
        gtao_frame_desc with = {.half = half};
        sequence all = sequence_make(&s, width, height, &with, tight),
                 some = sequence_make(&s, width, height, &with, tight);
        sequence told = sequence_make(&s, width, height, &with, tight);
        uint64_t at_rest = 0, disturbed = 0;
        all.frame.no_skip = 1;
        sequence_fill(&all, &s, 0);
        sequence_fill(&some, &s, 0);
        for (int k = 0; k < 90; k++) {
            gtao_stats stats = {0};
            if (k == 80)
                for (int y = 20; y < 24; y++)
                    for (int x = 30; x < 40; x++) {
                        float z = 1.0f;
                        memcpy(plane_row(&all.in.depth, y) + 4 * x, &z, 4);
                        memcpy(plane_row(&some.in.depth, y) + 4 * x, &z, 4);
                    }
            run(&all, k, NULL);
            run(&some, k, &stats);
            if (!result_equal(&all.out, &some.out))
                fail_msg("half %d: frame %d differs", half, k);
            /* What does not change need not be read: in the first frame and the disturbed one only. Upsampling reads. */
            told.frame.unchanged = k != 0 && k != 80;
            for (int y = 0; y < height; y++) {
                memcpy(plane_row(&told.in.depth, y), plane_row(&some.in.depth, y), (size_t)width * 4);
                if (told.frame.unchanged && !half)
                    memset(plane_row(&told.in.depth, y), 0xFF, (size_t)width * 4);
            }
            run(&told, k, NULL);
            if (!result_equal(&all.out, &told.out))
                fail_msg("half %d: frame %d differs where the caller says that nothing changes", half, k);
            if (k == 79)
                at_rest = stats.unchanged;
            if (k == 81)
                disturbed = stats.unchanged;
        }
        assert_int_equal(at_rest, 330 * 60);
        assert_true(disturbed > 0 && disturbed < at_rest);
        sequence_free(&all);
        sequence_free(&some);
        sequence_free(&told);
    }
}

/* ---- history ---------------------------------------------------------------------------------------------------- */

static float pixel(const sequence *q, int x, int y) {
    float v;
    memcpy(&v, plane_row(&q->out.visibility, y) + 4 * x, 4);
    return v;
}

/* A cut and every change of a setting start the history anew; a state of zeros needs no cut. */
static void history_starts_anew(void **state) {
    static const gtao_frame_desc plain = {.half = 1};
    sequence q = sequence_make(&settings[1], 64, 48, &plain, tight), fresh;
    gtao_frame_context *context;
    int width, height;
    ptrdiff_t stride;
    (void)state;
    for (int change = 0; change < 3; change++) {
        for (int k = 0; k < 5; k++) {
            sequence_fill(&q, &settings[1], 0);
            run(&q, k, NULL);
        }
        if (change == 0)
            q.frame.cut = 1;
        if (change == 1)
            q.frame.desc.radius *= 1.5f;
        if (change == 2)
            q.frame.history = GTAO_HISTORY_FREE;
        fresh = sequence_make(&settings[1], 64, 48, &plain, tight);
        fresh.frame.desc.radius = q.frame.desc.radius;
        fresh.frame.history = q.frame.history;
        sequence_fill(&fresh, &settings[1], 0);
        memset(fresh.state, 0, fresh.state_size);
        assert_int_equal(gtao_frame(&fresh.frame, &fresh.out.output, fresh.state, fresh.state_size, NULL), GTAO_OK);
        assert_int_equal(gtao_frame(&q.frame, &q.out.output, q.state, q.state_size, NULL), GTAO_OK);
        assert_true(result_equal(&q.out, &fresh.out));
        sequence_free(&fresh);
    }
    assert_int_equal(gtao_frame_begin(&q.frame, &q.out.output, q.state, q.state_size, &context), GTAO_OK);
    for (int stage = 0; stage < gtao_frame_stages(context); stage++)
        gtao_frame_run(context, stage, 0, gtao_frame_units(context, stage), NULL);
    for (int i = 0; i <= GTAO_PLANE_LENGTH; i++)
        assert_non_null(gtao_frame_plane(context, (gtao_plane)i, &width, &height, &stride));
    assert_int_equal(width, 32);
    assert_int_equal(height, 24);
    assert_true(stride >= 128 && pixel(&q, 3, 3) <= 1.0f);
    assert_null(gtao_frame_plane(context, (gtao_plane)99, &width, &height, &stride));
    sequence_free(&q);
}

/* Motion in three components, then in two: what is shown of the third is zero. */
static void motion_has_no_third_component(void **state) {
    enum { W = 64, H = 48 };
    static const gtao_frame_desc options = {.half = 1, .motion_components = 3};
    static float motion[W * H * 3];
    sequence q = sequence_make(&settings[1], W, H, &options, tight);
    (void)state;
    for (int i = 0; i < W * H * 3; i++)
        motion[i] = 0.25f;
    for (int components = 3; components >= 2; components--) {
        gtao_frame_context *context;
        const float *third = NULL;
        const char *name;
        ptrdiff_t stride;
        q.frame.motion = motion, q.frame.motion_stride = 0, q.frame.motion_components = components;
        sequence_fill(&q, &settings[1], 0);
        assert_int_equal(gtao_frame_begin(&q.frame, &q.out.output, q.state, q.state_size, &context), GTAO_OK);
        gtao_frame_run(context, 0, 0, gtao_frame_units(context, 0), NULL);
        for (int k = 0; gtao_frame_stage_plane(context, 0, k, &name, &stride); k++)
            if (strcmp(name, "motion.Z") == 0)
                third = gtao_frame_stage_plane(context, 0, k, &name, &stride);
        assert_non_null(third);
        for (int i = 0; i < W / 2 * (H / 2); i++)
            assert_true(third[i / (W / 2) * (stride / 4) + i % (W / 2)] == (components == 3 ? 0.25f : 0.0f));
    }
    sequence_free(&q);
}

/* ---- spherical harmonics ----------------------------------------------------------------------------------------- */

/* They go through the filters with the weights of visibility and bent normals: so the first coefficient stays 0.28 of the
 * visibility, and the next three stay along the bent normal. */
static void harmonics_follow_the_rest(void **state) {
    static const setting s = {"sh", 1, 0, {PERSPECTIVE, .radius = 1.5f, .falloff = 0.25f, .slices = 1, .steps = 8}};
    (void)state;
    for (size_t o = 0; o < FRAME_SETTING_COUNT; o++) {
        gtao_frame_desc with = frame_settings[o].frame;
        const int width = 91, height = 45;
        with.sh_bands = 3;
        sequence q = sequence_make(&s, width, height, &with, tight);
        double along = 0;
        for (int k = 0; k < 5; k++) {
            sequence_fill(&q, &s, k);
            run(&q, k, NULL);
            for (int y = 0; y < height; y++)
                for (int x = 0; x < width; x++) {
                    float v, z, b[4], c[4], length;
                    memcpy(&z, plane_row(&q.in.depth, y) + 4 * x, 4);
                    memcpy(&v, plane_row(&q.out.visibility, y) + 4 * x, 4);
                    memcpy(b, plane_row(&q.out.bent, y) + 16 * x, 16);
                    for (int i = 0; i < 4; i++)
                        memcpy(&c[i], plane_row(&q.out.sh, i * height + y) + 4 * x, 4);
                    length = sqrtf(c[1] * c[1] + c[2] * c[2] + c[3] * c[3]);
                    if (!(z > 0 && float_finite(z)) || length < 1e-3f)
                        continue;
                    if (!(fabsf(c[0] / 0.2820948f - v) < 2e-5f))
                        fail_msg("%s, frame %d, (%d, %d): visibility %g, c0 %g", frame_settings[o].name, k, x, y,
                                 (double)v, (double)(c[0] / 0.2820948f));
                    if (!(b[0] * c[3] + b[1] * c[1] + b[2] * c[2] > 0.9999f * length))
                        fail_msg("%s, frame %d, (%d, %d): bent normal %g %g %g, harmonics %g %g %g",
                                 frame_settings[o].name, k, x, y, (double)b[0], (double)b[1], (double)b[2],
                                 (double)(c[3] / length), (double)(c[1] / length), (double)(c[2] / length));
                    along += 1;
                }
        }
        assert_true(along > 5000);
        assert_false(result_spilled(&q.out));
        sequence_free(&q);
    }
}

/* Bent normals go straight to the caller unless they are packed, too: the same ones, of three and four components. */
static void bent_normals_alone_are_the_same(void **state) {
    static const layout odd = {12, 20, 1};
    (void)state;
    for (int half = 0; half < 2; half++)
        for (int width = 61; width < 70; width++) {
            const gtao_frame_desc with = {.half = half};
            const int height = 7;
            sequence q = sequence_make(&settings[1], width, height, &with, tight);
            for (int components = 3; components <= 4; components++) {
                result alone = result_make(&q.in.desc, WANT_BENT, GTAO_FORMAT_FLOAT, components, odd, 0);
                sequence_fill(&q, &settings[1], 0);
                run(&q, 0, NULL);
                q.frame.cut = 1;
                assert_int_equal(gtao_frame(&q.frame, &alone.output, q.state, q.state_size, NULL), GTAO_OK);
                for (int y = 0; y < height; y++)
                    for (int x = 0; x < width; x++)
                        assert_memory_equal(plane_row(&alone.bent, y) + (size_t)(4 * components * x),
                                            plane_row(&q.out.bent, y) + 16 * x, (size_t)(4 * components));
                assert_false(result_spilled(&alone));
                result_free(&alone);
            }
            sequence_free(&q);
        }
}

/* ---- thickness --------------------------------------------------------------------------------------------------- */

/* A map of one value is that thickness, at both resolutions; without filters a frame is gtao_compute; and a change of
 * the map wakes what is at rest. */
static void thickness_maps_are_read(void **state) {
    static const setting with_map = {"map", 1, WITH_MAP, {PERSPECTIVE, .radius = 1.5f, .slices = 1, .steps = 8}};
    enum { WIDTH = 93, HEIGHT = 47 };
    (void)state;
    for (int half = 0; half < 2; half++) {
        const gtao_frame_desc filters = {.half = half};
        sequence map = sequence_make(&with_map, WIDTH, HEIGHT, &filters, tight), constant;
        setting one = with_map;
        one.given = 0, one.desc.thickness = 0.25f;
        constant = sequence_make(&one, WIDTH, HEIGHT, &filters, tight);
        for (int y = 0; y < HEIGHT; y++)
            for (int x = 0; x < WIDTH; x++)
                memcpy(plane_row(&map.in.map, y) + 4 * x, &one.desc.thickness, 4);
        for (int k = 0; k < 90; k++) {
            if (k < 4) {
                sequence_fill(&map, &with_map, k);
                sequence_fill(&constant, &one, k);
            }
            run(&map, k, NULL);
            run(&constant, k, NULL);
            assert_true(result_equal(&map.out, &constant.out));
        }
        memset(plane_row(&map.in.map, 10), 0, 4 * WIDTH); /* endless */
        memset(plane_row(&map.in.map, 11), 0, 4 * WIDTH);
        run(&map, 90, NULL);
        run(&constant, 90, NULL);
        assert_false(result_equal(&map.out, &constant.out));
        sequence_free(&map);
        sequence_free(&constant);
    }
    {
        const gtao_frame_desc plain = {.no_spatial = 1, .no_temporal = 1};
        sequence q = sequence_make(&with_map, WIDTH, HEIGHT, &plain, tight);
        result r = result_make(&q.in.desc, WANT_ALL, GTAO_FORMAT_FLOAT, 4, tight, 0);
        sequence_fill(&q, &with_map, 0);
        run(&q, 0, NULL);
        assert_int_equal(gtao_compute(&q.in.desc, &r.output, r.scratch, r.scratch_size, NULL), GTAO_OK);
        for (int y = 0; y < HEIGHT; y++) /* but for the normals' rounding */
            for (int x = 0; x < WIDTH; x++) {
                float a, b;
                memcpy(&a, plane_row(&q.out.visibility, y) + 4 * x, 4);
                memcpy(&b, plane_row(&r.visibility, y) + 4 * x, 4);
                if (!(fabsf(a - b) < 1e-3f))
                    fail_msg("(%d, %d): %g, gtao_compute %g", x, y, (double)a, (double)b);
            }
        result_free(&r);
        sequence_free(&q);
    }
}

/* ---- errors ----------------------------------------------------------------------------------------------------- */

static void every_error_fires(void **state) {
    static const gtao_frame_desc plain = {.half = 1};
    sequence q = sequence_make(&settings[1], 16, 16, &plain, tight);
    gtao_frame_desc f;
    gtao_output output = q.out.output;
    float buffer[2 * 16 * 16];
    gtao_layer layer = {NULL, 0, NULL, 0};
    (void)state;
#define EXPECT(result, change)                                                                                         \
    do {                                                                                                               \
        f = q.frame;                                                                                                   \
        change;                                                                                                        \
        assert_int_equal(gtao_frame(&f, &output, q.state, q.state_size, NULL), result);                                \
        if (result != GTAO_ERROR_STATE && result != GTAO_ERROR_SIGNAL && result != GTAO_ERROR_OUTPUT)                  \
            assert_int_equal(gtao_frame_state_size(&f), 0);                                                            \
    } while (0)
    assert_int_equal(gtao_frame(NULL, &output, q.state, q.state_size, NULL), GTAO_ERROR_FRAME);
    assert_int_equal(gtao_frame_state_size(NULL), 0);
    EXPECT(GTAO_ERROR_SIZE, f.desc.width = 0);
    EXPECT(GTAO_ERROR_FRAME_ARCS, f.desc.back = f.desc.depth);
    EXPECT(GTAO_ERROR_FRAME_ARCS, (layer.depth = f.desc.depth, f.desc.layers = &layer, f.desc.layer_count = 1));
    EXPECT(GTAO_ERROR_REDUCTION, f.reduction = (gtao_reduction)3);
    EXPECT(GTAO_ERROR_SH_BANDS, f.sh_bands = 1);
    EXPECT(GTAO_ERROR_SH_BANDS, f.sh_bands = 4);
    EXPECT(GTAO_ERROR_SPATIAL, f.spatial_passes = 4);
    EXPECT(GTAO_ERROR_SPATIAL, f.spatial_passes = -1);
    EXPECT(GTAO_ERROR_TOLERANCE, f.depth_tolerance = -0.1f);
    EXPECT(GTAO_ERROR_TOLERANCE, f.depth_tolerance = float_nan());
    EXPECT(GTAO_ERROR_TOLERANCE, f.depth_tolerance = float_inf());
    EXPECT(GTAO_ERROR_HISTORY, f.history = (gtao_history)3);
    EXPECT(GTAO_ERROR_MAX_HISTORY, f.max_history = 256);
    EXPECT(GTAO_ERROR_MAX_HISTORY, f.max_history = -1);
    EXPECT(GTAO_ERROR_CLAMP_WINDOW, f.clamp_window = float_nan());
    EXPECT(GTAO_ERROR_VIEW_TO_PREVIOUS, f.view_to_previous[7] = float_inf());
    EXPECT(GTAO_ERROR_MOTION, (f.motion = buffer, f.motion_components = 4));
    EXPECT(GTAO_ERROR_MOTION, (f.motion = buffer, f.motion_stride = 12));
    f = q.frame;
    f.sh_bands = 2; /* what is wanted, but not where to */
    assert_int_equal(gtao_frame(&f, &output, q.state, 1u << 30, NULL), GTAO_ERROR_SH_BANDS);
    output.signal = buffer;
    EXPECT(GTAO_ERROR_SIGNAL, (void)0);
    output = q.out.output;
    memset(&output, 0, sizeof output);
    EXPECT(GTAO_ERROR_OUTPUT, (void)0);
    output = q.out.output;
    assert_int_equal(gtao_frame(&q.frame, &output, NULL, q.state_size, NULL), GTAO_ERROR_STATE);
    assert_int_equal(gtao_frame(&q.frame, &output, q.state, q.state_size - 1, NULL), GTAO_ERROR_STATE);
    assert_int_equal(gtao_frame_begin(&q.frame, &output, q.state, q.state_size, NULL), GTAO_ERROR_STATE);
#undef EXPECT
    sequence_free(&q);
}

/* The signal of one frame: its visibility is the output's, weights are 1 on average over directions. */
static void signal_is_the_output_before_filters(void **state) {
    static const setting s = {"signal", 1, 0, {PERSPECTIVE, .radius = 1.5f, .slices = 1, .steps = 8}};
    enum { W = 64, H = 48 };
    input in = input_make(&s, W, H, tight);
    static float visibility[W * H], signal[5 * W * H], bent[3 * W * H];
    gtao_output output = {0};
    size_t size = gtao_scratch_size(&in.desc);
    void *scratch = malloc(size);
    double weight = 0;
    (void)state;
    output.visibility = visibility;
    output.bent_normals = bent;
    output.signal = signal;
    output.signal_planes = 5;
    assert_int_equal(gtao_compute(&in.desc, &output, scratch, size, NULL), GTAO_OK);
    assert_memory_equal(visibility, signal, sizeof visibility);
    for (int i = 0; i < W * H; i++) {
        const float *b = signal + 2 * W * H + i;
        float length = sqrtf(b[0] * b[0] + b[W * H] * b[W * H] + b[2 * W * H] * b[2 * W * H]);
        weight += (double)signal[W * H + i];
        if (!(fabsf(b[0] / length - bent[3 * i]) < 1e-5f && fabsf(b[2 * W * H] / length - bent[3 * i + 2]) < 1e-5f))
            fail_msg("pixel %d: the signal's bent normal is another", i);
    }
    weight /= W * H;
    if (!(weight > 0.9 && weight < 1.1))
        fail_msg("weights are %g on average", weight);
    output.signal_planes = 3;
    assert_int_equal(gtao_compute(&in.desc, &output, scratch, size, NULL), GTAO_ERROR_SIGNAL);
    free(scratch);
    input_free(&in);
}

int main(void) {
    enum { SETTINGS = sizeof settings / sizeof settings[0] };
    struct CMUnitTest tests[SETTINGS + 12] = {cmocka_unit_test(thickness_maps_are_read),
                                              cmocka_unit_test(harmonics_follow_the_rest),
                                              cmocka_unit_test(bent_normals_alone_are_the_same),
                                              cmocka_unit_test(splits_and_strides_agree),
                                              cmocka_unit_test(open_planes_stay_open),
                                              cmocka_unit_test(bad_values_give_good_ones),
                                              cmocka_unit_test(one_nan_neither_spreads_nor_stays),
                                              cmocka_unit_test(skipping_changes_no_bit),
                                              cmocka_unit_test(history_starts_anew),
                                              cmocka_unit_test(motion_has_no_third_component),
                                              cmocka_unit_test(every_error_fires),
                                              cmocka_unit_test(signal_is_the_output_before_filters)};
    static char names[SETTINGS][64];
    for (int i = 0; i < SETTINGS; i++) {
        struct CMUnitTest test = {names[i], isas_agree, NULL, NULL, (void *)(uintptr_t)&settings[i]};
        snprintf(names[i], sizeof names[i], "isas_agree: %s", settings[i].name);
        tests[12 + i] = test;
    }
    return cmocka_run_group_tests_name("frame", tests, NULL, NULL);
}
