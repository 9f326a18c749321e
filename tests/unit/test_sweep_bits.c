/* The sweep: the same bits from every kernel, order of units, number of threads, batch and region; every broken
 * precondition; data that is none; cancelling. Run under ASan and UBSan too: every buffer has exactly the promised size. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <pthread.h>
#include <stdio.h>

#include "inputs.h"

static const layout tight = {0, 0, 0};

typedef struct swept {
    result r;
    plane horizons;
    gtao_sweep_options options;
    void *scratch, *work;
    size_t size;
} swept;

static swept swept_make(const gtao_desc *desc, const gtao_sweep_options *options, layout l) {
    swept s;
    memset(&s, 0, sizeof s);
    if (options)
        s.options = *options;
    s.r = result_make(desc, WANT_EVERYTHING, GTAO_FORMAT_FLOAT, 3, l, 0);
    s.horizons = plane_make(2 * desc->slices * desc->height, sizeof(float) * (size_t)desc->width, l);
    s.options.horizons = (float *)(void *)s.horizons.first;
    s.options.horizon_stride = s.horizons.stride;
    s.options.horizon_plane = s.horizons.stride * desc->height;
    s.size = gtao_sweep_scratch_size(desc, &s.r.output, &s.options);
    s.scratch = malloc(s.size);
    s.work = malloc(gtao_sweep_work_size(desc, &s.options));
    return s;
}

static void swept_free(swept *s) {
    result_free(&s->r);
    free(s->horizons.memory);
    free(s->scratch);
    free(s->work);
}

static int swept_equal(const swept *a, const swept *b) {
    return result_equal(&a->r, &b->r) && planes_equal(&a->horizons, &b->horizons);
}

/* order 1: as they come; -1: last unit first. */
static swept swept_run(const gtao_desc *desc, const gtao_sweep_options *options, layout l, int order) {
    swept s = swept_make(desc, options, l);
    gtao_sweep *sweep;
    assert_int_equal(gtao_sweep_begin(desc, &s.r.output, &s.options, s.scratch, s.size, &sweep), GTAO_OK);
    for (int phase = 0; phase < gtao_sweep_phases(sweep); phase++) {
        const int units = gtao_sweep_units(sweep, phase);
        for (int i = 0; i < units; i++) {
            const int unit = order > 0 ? i : units - 1 - i;
            gtao_sweep_run(sweep, phase, unit, unit + 1, s.work);
        }
    }
    return s;
}

/* clang-format off */
static const setting sweeps[] = {
    {"height", 0, 0, {ORTHO, .depth_kind = GTAO_DEPTH_HEIGHT, .radius = HUGE_VALF, .slices = 5}},
    {"height-wrap", 1, 0, {ORTHO, .depth_kind = GTAO_DEPTH_HEIGHT, .radius = HUGE_VALF, .slices = 3,
                           .border = GTAO_BORDER_WRAP}},
    {"height-clamp", 1, 1, {ORTHO, .depth_kind = GTAO_DEPTH_HEIGHT, .radius = HUGE_VALF, .slices = 4,
                            .border = GTAO_BORDER_CLAMP, .weighting = GTAO_WEIGHTING_UNIFORM}},
    {"height-radius", 1, 0, {ORTHO, .depth_kind = GTAO_DEPTH_HEIGHT, .radius = 1.5f, .falloff = 0.25f, .slices = 4}},
    {"perspective", 1, 0, {WIDE, .radius = HUGE_VALF, .slices = 5}},
    {"perspective-radius", 1, 1, {PERSPECTIVE, .radius = 2, .falloff = 0.5f, .slices = 4}},
    {"perspective-cutoff-wrap", 0, 0, {PERSPECTIVE, .radius = 2, .slices = 3, .border = GTAO_BORDER_WRAP}},
};
/* clang-format on */
enum { SWEEPS = (int)(sizeof sweeps / sizeof sweeps[0]) };

static void kernels_agree(void **state) {
    static const int sizes[][2] = {{67, 45}, {1, 1}, {1, 40}, {33, 2}, {16, 16}, {130, 5}};
    (void)state;
    for (int i = 0; i < SWEEPS; i++)
        for (int j = 0; j < 6; j++) {
            input in = input_make(&sweeps[i], sizes[j][0], sizes[j][1], tight);
            swept expected;
            in.desc.isa = GTAO_ISA_SCALAR;
            expected = swept_run(&in.desc, NULL, tight, 1);
            for (int isa = GTAO_ISA_SSE2; isa <= GTAO_ISA_NEON; isa++) {
                swept other;
                if (!gtao_isa_available((gtao_isa)isa))
                    continue;
                in.desc.isa = (gtao_isa)isa;
                other = swept_run(&in.desc, NULL, tight, 1);
                if (!swept_equal(&expected, &other))
                    fail_msg("%s, %dx%d: %s differs", sweeps[i].name, sizes[j][0], sizes[j][1],
                             gtao_isa_name((gtao_isa)isa));
                swept_free(&other);
            }
            swept_free(&expected);
            input_free(&in);
        }
}

/* Any order of the units, any batch, any layout of the buffers; nothing is written beside them. */
static void orders_agree(void **state) {
    const layout loose = {4, 12, 1};
    (void)state;
    for (int i = 0; i < SWEEPS; i++) {
        input in = input_make(&sweeps[i], 67, 45, tight);
        swept expected = swept_run(&in.desc, NULL, tight, 1);
        for (int batch = 1; batch <= 64; batch *= 4) {
            gtao_sweep_options options = {0};
            swept other;
            options.batch = batch;
            other = swept_run(&in.desc, &options, loose, -1);
            if (!swept_equal(&expected, &other))
                fail_msg("%s: batches of %d, in reverse order, differ", sweeps[i].name, batch);
            assert_false(result_spilled(&other.r) || plane_spilled(&other.horizons));
            swept_free(&other);
        }
        swept_free(&expected);
        input_free(&in);
    }
}

typedef struct job {
    gtao_sweep *sweep;
    void *work;
    int phase, first;
} job;

static void *odd_or_even(void *argument) {
    const job *j = (const job *)argument;
    for (int unit = j->first; unit < gtao_sweep_units(j->sweep, j->phase); unit += 2)
        gtao_sweep_run(j->sweep, j->phase, unit, unit + 1, j->work);
    return NULL;
}

static void threads_agree(void **state) {
    (void)state;
    for (int i = 0; i < SWEEPS; i++) {
        input in = input_make(&sweeps[i], 67, 45, tight);
        swept expected = swept_run(&in.desc, NULL, tight, 1), other = swept_make(&in.desc, NULL, tight);
        job jobs[2] = {{NULL, other.work, 0, 0}, {NULL, malloc(gtao_sweep_work_size(&in.desc, &other.options)), 0, 1}};
        assert_int_equal(
            gtao_sweep_begin(&in.desc, &other.r.output, &other.options, other.scratch, other.size, &jobs[0].sweep),
            GTAO_OK);
        jobs[1].sweep = jobs[0].sweep;
        for (int phase = 0; phase < gtao_sweep_phases(jobs[0].sweep); phase++) {
            pthread_t threads[2];
            for (int t = 0; t < 2; t++) {
                jobs[t].phase = phase;
                assert_int_equal(pthread_create(&threads[t], NULL, odd_or_even, &jobs[t]), 0);
            }
            for (int t = 0; t < 2; t++)
                pthread_join(threads[t], NULL);
        }
        if (!swept_equal(&expected, &other))
            fail_msg("%s: two threads differ", sweeps[i].name);
        free(jobs[1].work);
        swept_free(&expected);
        swept_free(&other);
        input_free(&in);
    }
}

/* Within the region the same bits, outside nothing is written. */
static void regions_agree(void **state) {
    static const int regions[][4] = {{0, 0, 67, 45}, {5, 3, 66, 44}, {64, 40, 67, 45}, {20, 17, 21, 18}};
    (void)state;
    for (int i = 0; i < SWEEPS; i++) {
        input in = input_make(&sweeps[i], 67, 45, tight);
        swept whole = swept_run(&in.desc, NULL, tight, 1);
        for (int k = 0; k < 4; k++) {
            const int *g = regions[k];
            gtao_sweep_options options = {0};
            swept part;
            memcpy(options.region, g, sizeof options.region);
            part = swept_run(&in.desc, &options, tight, 1);
            for (int y = 0; y < 45; y++)
                for (int x = 0; x < 67; x++) {
                    const unsigned char *a = plane_row(&whole.r.visibility, y) + 4 * x;
                    const unsigned char *b = plane_row(&part.r.visibility, y) + 4 * x;
                    const int inside = x >= g[0] && x < g[2] && y >= g[1] && y < g[3];
                    if (inside ? memcmp(a, b, 4) != 0 : b[0] != CANARY || b[3] != CANARY)
                        fail_msg("%s: region %d: (%d, %d)", sweeps[i].name, k, x, y);
                    for (int h = 0; h < 9; h++) {
                        a = plane_row(&whole.r.sh, h * 45 + y) + 4 * x;
                        b = plane_row(&part.r.sh, h * 45 + y) + 4 * x;
                        if (inside ? memcmp(a, b, 4) != 0 : b[0] != CANARY || b[3] != CANARY)
                            fail_msg("%s: region %d: coefficient %d of (%d, %d)", sweeps[i].name, k, h, x, y);
                    }
                    for (int h = 0; h < 2 * in.desc.slices; h++) {
                        a = plane_row(&whole.horizons, h * 45 + y) + 4 * x;
                        b = plane_row(&part.horizons, h * 45 + y) + 4 * x;
                        if (inside ? memcmp(a, b, 4) != 0 : b[0] != CANARY || b[3] != CANARY)
                            fail_msg("%s: region %d: horizon %d of (%d, %d)", sweeps[i].name, k, h, x, y);
                    }
                }
            swept_free(&part);
        }
        swept_free(&whole);
        input_free(&in);
    }
}

/* NaN, infinities and the like anywhere: results in range. */
static void anything_is_finite(void **state) {
    static const uint32_t bad[] = {0x7FC00000u, 0x7F800000u, 0xFF800000u, 0u,          0x80000000u, 1u,
                                   0x7149F2CAu, 0x7F7FFFFFu, 0xFF7FFFFFu, 0x0DA24260u, 0xBF800000u};
    (void)state;
    for (int i = 0; i < SWEEPS; i++)
        for (int some = 2; some <= 64; some *= 4) {
            input in = input_make(&sweeps[i], 67, 45, tight);
            uint32_t seed = (uint32_t)some;
            swept s;
            for (int y = 0; y < 45; y++)
                for (int x = 0; x < 67; x++)
                    if (next_random(&seed) % (uint32_t)some == 0)
                        memcpy(plane_row(&in.depth, y) + 4 * x, &bad[next_random(&seed) % 11], 4);
            s = swept_run(&in.desc, NULL, tight, 1);
            for (int y = 0; y < 45; y++)
                for (int x = 0; x < 67; x++) {
                    float v, b[3], length = 0.0f;
                    memcpy(&v, plane_row(&s.r.visibility, y) + 4 * x, 4);
                    memcpy(b, plane_row(&s.r.bent, y) + 12 * x, 12);
                    for (int k = 0; k < 3; k++)
                        length += b[k] * b[k];
                    if (!float_finite(v) || !(v >= 0.0f && v <= 1.0f) || !(length > 0.999f && length < 1.001f))
                        fail_msg("%s: visibility %g, length %g at (%d, %d)", sweeps[i].name, (double)v, (double)length,
                                 x, y);
                    for (int h = 0; h < 9; h++) {
                        float coefficient;
                        memcpy(&coefficient, plane_row(&s.r.sh, h * 45 + y) + 4 * x, 4);
                        if (!float_finite(coefficient) || !(coefficient >= -1.5f && coefficient <= 1.5f))
                            fail_msg("%s: coefficient %g at (%d, %d)", sweeps[i].name, (double)coefficient, x, y);
                    }
                    for (int h = 0; h < 2 * in.desc.slices; h++) {
                        float angle;
                        memcpy(&angle, plane_row(&s.horizons, h * 45 + y) + 4 * x, 4);
                        if (!(angle >= 0.0f && angle <= 3.1416f))
                            fail_msg("%s: horizon %g at (%d, %d)", sweeps[i].name, (double)angle, x, y);
                    }
                }
            swept_free(&s);
            input_free(&in);
        }
}

/* A hole in a plane is no cliff, and nothing beside it is occluded. */
static void holes_are_holes(void **state) {
    (void)state;
    for (int radius = 0; radius < 2; radius++) {
        input in = input_make(&sweeps[0], 67, 45, tight);
        swept s;
        in.desc.radius = radius ? 1.0f : HUGE_VALF;
        for (int y = 0; y < 45; y++)
            for (int x = 0; x < 67; x++) {
                const float z = x > 20 && x < 40 && y > 10 && y < 30 ? float_nan() : 0.25f;
                memcpy(plane_row(&in.depth, y) + 4 * x, &z, 4);
            }
        s = swept_run(&in.desc, NULL, tight, 1);
        for (int y = 0; y < 45; y++)
            for (int x = 0; x < 67; x++) {
                float v;
                memcpy(&v, plane_row(&s.r.visibility, y) + 4 * x, 4);
                if (v != 1.0f)
                    fail_msg("visibility %g at (%d, %d)", (double)v, x, y);
            }
        swept_free(&s);
        input_free(&in);
    }
}

static int beyond_nothing(void *user, double x, double y, double dx, double dy, int capacity, float *distance,
                          float *depth) {
    (void)user, (void)x, (void)y, (void)dx, (void)dy, (void)capacity, (void)distance, (void)depth;
    return 0;
}

static void errors(void **state) {
    float depth[6] = {0}, visibility[6], horizons[6 * 2 * 3];
    char scratch[65536];
    gtao_sweep *sweep;
    (void)state;
#define EXPECT(result, change)                                                                                         \
    do {                                                                                                               \
        gtao_desc d = {0};                                                                                             \
        gtao_output o = {0};                                                                                           \
        gtao_sweep_options s = {0};                                                                                    \
        size_t size = sizeof scratch;                                                                                  \
        d.width = 3, d.height = 2, d.depth = depth, d.depth_kind = GTAO_DEPTH_HEIGHT, d.slices = 3, d.radius = 1;      \
        d.camera.projection = GTAO_ORTHOGRAPHIC, d.camera.sx = 1, o.visibility = visibility;                           \
        change;                                                                                                        \
        if (gtao_sweep_begin(&d, &o, &s, scratch, size, &sweep) != (result))                                           \
            fail_msg("%s: not %s", #change, gtao_result_string(result));                                               \
    } while (0)
    EXPECT(GTAO_OK, s.batch = 1);
    EXPECT(GTAO_OK, s.horizons = horizons);
    EXPECT(GTAO_OK, (s.beyond = beyond_nothing, s.beyond_reach = 9));
    EXPECT(GTAO_ERROR_SIZE, d.width = 0);
    EXPECT(GTAO_ERROR_OUTPUT, o.visibility = NULL);
    EXPECT(GTAO_ERROR_SWEEP, d.thin_blend = 0.5f);
    EXPECT(GTAO_ERROR_SWEEP, d.estimator = GTAO_ESTIMATOR_MEMO);
    EXPECT(GTAO_ERROR_REGION, s.region[0] = 1);
    EXPECT(GTAO_ERROR_REGION, (s.region[2] = 4, s.region[3] = 2));
    EXPECT(GTAO_ERROR_REGION, (s.region[0] = -1, s.region[2] = 2, s.region[3] = 2));
    EXPECT(GTAO_ERROR_HORIZONS, (s.horizons = horizons, s.horizon_stride = 8));
    EXPECT(GTAO_ERROR_HORIZONS, (s.horizons = horizons, s.horizon_plane = 20));
    EXPECT(GTAO_ERROR_BEYOND, s.beyond = beyond_nothing);
    EXPECT(GTAO_ERROR_BEYOND, (s.beyond = beyond_nothing, s.beyond_reach = 9, d.border = GTAO_BORDER_WRAP));
    EXPECT(GTAO_ERROR_BATCH, s.batch = 65);
    EXPECT(GTAO_ERROR_BATCH, s.batch = -1);
    EXPECT(GTAO_ERROR_SCRATCH, size = gtao_sweep_scratch_size(&d, &o, &s) - 1);
#undef EXPECT
}

static int stop(void *user, double done) {
    double *last = (double *)user;
    assert_true(done > *last && done <= 1.0);
    *last = done;
    return done >= 0.5;
}

static int go_on(void *user, double done) {
    *(double *)user = done;
    return 0;
}

static void progress(void **state) {
    input in = input_make(&sweeps[0], 67, 45, tight);
    swept a = swept_run(&in.desc, NULL, tight, 1), b = swept_make(&in.desc, NULL, tight);
    const size_t size = b.size + gtao_sweep_work_size(&in.desc, &b.options);
    void *scratch = malloc(size);
    double done = 0.0;
    (void)state;
    assert_int_equal(gtao_sweep_compute(&in.desc, &b.r.output, &b.options, scratch, size, stop, &done), GTAO_CANCELLED);
    assert_true(done >= 0.5 && done < 1.0);
    assert_int_equal(gtao_sweep_compute(&in.desc, &b.r.output, &b.options, scratch, size, go_on, &done), GTAO_OK);
    assert_true(done == 1.0);
    assert_true(swept_equal(&a, &b));
    assert_int_equal(gtao_sweep_compute(&in.desc, &b.r.output, &b.options, scratch, size - 1, go_on, &done),
                     GTAO_ERROR_SCRATCH);
    free(scratch);
    swept_free(&a);
    swept_free(&b);
    input_free(&in);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(kernels_agree),      cmocka_unit_test(orders_agree),    cmocka_unit_test(threads_agree),
        cmocka_unit_test(regions_agree),      cmocka_unit_test(holes_are_holes), cmocka_unit_test(errors),
        cmocka_unit_test(anything_is_finite), cmocka_unit_test(progress),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
