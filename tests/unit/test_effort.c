/* Effort by need (gtao_desc.error_target): the error it promises, the same bits however the work is cut, every output,
 * the stages, and time budgets. */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include "inputs.h"
#include "../reference/reference.h"

static const layout tight = {0, 0, 0};

static float float_at(const plane *p, int y, int i) {
    float f;
    memcpy(&f, plane_row(p, y) + sizeof f * (size_t)i, sizeof f);
    return f;
}

static result compute(const gtao_desc *desc, int want, gtao_stats *stats) {
    result r = result_make(desc, want, GTAO_FORMAT_FLOAT, 4, tight, 0);
    assert_int_equal(gtao_compute(desc, &r.output, r.scratch, r.scratch_size, stats), GTAO_OK);
    return r;
}

/* ---- error -------------------------------------------------------------------------------------------------------- */

enum { W = 240, H = 150, SCENES = 2 };

/* A cluttered room; a rough height field. */
static gtao_desc scene(int which, ref_image *image) {
    gtao_desc d;
    memset(&d, 0, sizeof d);
    if (which == 0) {
        ref_shape shapes[64];
        *image = ref_image_perspective(W, H, 60);
        ref_render(image, NULL, shapes, ref_cluttered_scene(shapes, 64));
        d.camera.fx = (float)image->fx;
        d.radius = 0.6f;
    } else {
        *image = ref_image_orthographic(W, H, 1);
        for (int y = 0; y < H; y++)
            for (int x = 0; x < W; x++) {
                float flat = x < W / 2 ? 0.0f : 1.0f;
                image->z[y * W + x] = 100 - flat * (float)(hash_cell(x / 9, y / 9, 3) & 15u) -
                                      (y < 50 ? 4 * sinf(0.13f * (float)x) * sinf(0.2f * (float)y) : 0.0f);
            }
        d.camera.projection = GTAO_ORTHOGRAPHIC;
        d.camera.sx = 1;
        d.radius = 24;
    }
    d.width = W, d.height = H;
    d.depth = image->z;
    d.normals = which == 0 ? image->normals : NULL;
    return d;
}

static double rmse(const result *a, const result *b) {
    double sum = 0;
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++) {
            double e = (double)float_at(&a->visibility, y, x) - (double)float_at(&b->visibility, y, x);
            sum += e * e;
        }
    return sqrt(sum / (W * H));
}

/* To 64 slices of every pixel. Smaller targets: less error, more samples, by less than the settings of equal error. */
static void meets_its_target(void **state) {
    static const float targets[] = {0.05f, 0.03f, 0.022f, 0.017f, 0.013f};
    (void)state;
    for (int which = 0; which < SCENES; which++) {
        ref_image image;
        gtao_desc d = scene(which, &image);
        result truth, r;
        double last = 1, first = 0;
        uint64_t samples = 0;
        d.slices = 64, d.every_pixel = 1;
        truth = compute(&d, WANT_VISIBILITY, NULL);
        d.slices = 0, d.every_pixel = 0;
        for (size_t k = 0; k < sizeof targets / sizeof *targets; k++) {
            gtao_stats stats = {0};
            double e;
            d.error_target = targets[k];
            r = compute(&d, WANT_VISIBILITY, &stats);
            e = rmse(&r, &truth);
            print_message("scene %d, target %.3f: RMSE %.4f, refined %.2f, %.0f samples a pixel\n", which,
                          (double)targets[k], e, (double)stats.refined / (W * H), (double)stats.samples / (W * H));
            if (!(e <= 1.25 * (double)targets[k]))
                fail_msg("scene %d: RMSE %g at a target of %g", which, e, (double)targets[k]);
            if (!(e <= last) || stats.samples < samples)
                fail_msg("scene %d: target %g has more error, or fewer samples, than the one before", which,
                         (double)targets[k]);
            last = e, samples = stats.samples, first = k ? first : e;
            assert_int_equal(stats.pixels, W * H);
            result_free(&r);
        }
        if (!(last < 0.8 * first))
            fail_msg("scene %d: the least target has RMSE %g, the greatest %g", which, last, first);
        /* uniform effort with as many samples */
        d.error_target = 0, d.slices = 1, d.steps = 24;
        r = compute(&d, WANT_VISIBILITY, NULL);
        if (!(rmse(&r, &truth) > 2 * first))
            fail_msg("scene %d: one slice a pixel, not shared, is as good", which);
        result_free(&r);
        result_free(&truth);
        ref_image_free(&image);
    }
}

/* Further slices join the first one as if all had been computed at once: with no limit, nearly as good
 * as uniform effort with as many slices of every pixel, though one of them has but 24 samples. */
static void slices_join(void **state) {
    (void)state;
    for (int which = 0; which < SCENES; which++) {
        ref_image image;
        gtao_desc d = scene(which, &image);
        gtao_stats stats = {0}, uniform_stats = {0};
        result truth, r, uniform;
        double e, of_uniform;
        d.slices = 64, d.every_pixel = 1;
        truth = compute(&d, WANT_VISIBILITY, NULL);
        d.slices = 17;
        uniform = compute(&d, WANT_VISIBILITY, &uniform_stats);
        d.error_target = 1e-6f;
        r = compute(&d, WANT_VISIBILITY, &stats);
        e = rmse(&r, &truth), of_uniform = rmse(&uniform, &truth);
        print_message("scene %d: RMSE %.4f, uniform effort %.4f\n", which, e, of_uniform);
        if (!(e <= 1.2 * of_uniform))
            fail_msg("scene %d: RMSE %g, uniform effort %g", which, e, of_uniform);
        assert_true(stats.samples < uniform_stats.samples);
        result_free(&r);
        result_free(&uniform);
        result_free(&truth);
        ref_image_free(&image);
    }
}

/* ---- bits --------------------------------------------------------------------------------------------------------- */

static int has_target(const setting *s) {
    return s->desc.noise == GTAO_NOISE_MEMO && !s->desc.far_depth;
}

static void isas_agree(void **state) {
    static const int sizes[][2] = {{131, 45}, {64, 4}, {1, 1}, {65, 9}, {3, 70}, {200, 3}};
    int refined = 0;
    (void)state;
    for (int k = 0; k < SETTING_COUNT; k++)
        for (int i = 0; i < (int)(sizeof sizes / sizeof *sizes) && has_target(&settings[k]); i++) {
            input in = input_make(&settings[k], sizes[i][0], sizes[i][1], tight);
            result expected;
            gtao_stats stats = {0};
            in.desc.error_target = k % 2 ? 0.02f : 0.05f;
            in.desc.isa = GTAO_ISA_SCALAR;
            expected = compute(&in.desc, WANT_EVERYTHING, &stats);
            refined += stats.refined > 0;
            for (int isa = GTAO_ISA_SSE2; isa <= GTAO_ISA_NEON; isa++) {
                gtao_stats other = {0};
                result r;
                if (!gtao_isa_available((gtao_isa)isa))
                    continue;
                in.desc.isa = (gtao_isa)isa;
                r = compute(&in.desc, WANT_EVERYTHING, &other);
                if (!result_equal(&r, &expected) || memcmp(&stats, &other, sizeof stats) != 0)
                    fail_msg("%s, %dx%d: %s differs from scalar", settings[k].name, sizes[i][0], sizes[i][1],
                             gtao_isa_name((gtao_isa)isa));
                result_free(&r);
            }
            result_free(&expected);
            input_free(&in);
        }
    assert_true(refined > 40);
}

/* Bands of any height, from the last to the first; each buffer alone like all together. */
static void splits_agree(void **state) {
    enum { ROWS = 43 };
    (void)state;
    for (int k = 0; k < SETTING_COUNT; k += 4) {
        input in = input_make(&settings[k], 141, ROWS, tight);
        result whole;
        if (!has_target(&settings[k])) {
            input_free(&in);
            continue;
        }
        in.desc.error_target = 0.02f;
        whole = compute(&in.desc, WANT_EVERYTHING, NULL);
        for (int rows = 1; rows <= 45; rows += rows < 5 ? 1 : 20) {
            result r = result_make(&in.desc,
                                   rows % 2   ? WANT_EVERYTHING
                                   : rows % 4 ? WANT_VISIBILITY
                                              : WANT_BENT,
                                   GTAO_FORMAT_FLOAT, 4, tight, 12);
            gtao_context *context = NULL;
            memset(r.scratch, 0xFF, r.scratch_size);
            assert_int_equal(gtao_begin(&in.desc, &r.output, r.scratch, r.scratch_size, &context), GTAO_OK);
            for (int stage = 0; stage < 5; stage++) {
                if (stage == 3)
                    gtao_refine_begin(context, 0);
                for (int y = (ROWS - 1) / rows * rows; y >= 0; y -= rows) {
                    if (stage == 0)
                        gtao_prepare_rows(context, y, y + rows);
                    else if (stage == 1)
                        gtao_visibility_rows(context, y, y + rows, NULL);
                    else if (stage == 3)
                        gtao_refine_rows(context, y, y + rows, NULL);
                    else
                        gtao_share_rows(context, y, y + rows);
                }
            }
            if (!result_equal(&r, &whole))
                fail_msg("%s: bands of %d rows differ from the whole image", settings[k].name, rows);
            if (result_spilled(&r))
                fail_msg("%s: bands of %d rows write outside", settings[k].name, rows);
            result_free(&r);
        }
        result_free(&whole);
        input_free(&in);
    }
}

/* ---- outputs ------------------------------------------------------------------------------------------------------ */

/* A plane at any tilt stays open to the bit and its bent normal stays the normal; so does sky. */
static void open_surfaces_are_exact(void **state) {
    enum { SIZE = 70 };
    static float depth[SIZE * SIZE], normals[3 * SIZE * SIZE];
    (void)state;
    for (int trial = 0; trial < 12; trial++) {
        float n[3], k = (float)(trial % 4) * 0.5f - 1.0f, l = (float)(trial % 3) * 0.4f - 0.4f;
        float length = sqrtf(k * k + l * l + 1.0f);
        gtao_desc d;
        gtao_stats stats = {0};
        result r;
        memset(&d, 0, sizeof d);
        n[0] = k / length, n[1] = l / length, n[2] = -1.0f / length;
        d.width = d.height = SIZE, d.camera.fx = 60, d.depth = depth, d.normals = normals;
        d.radius = 3, d.error_target = 0.001f;
        d.weighting = trial & 8 ? GTAO_WEIGHTING_UNIFORM : GTAO_WEIGHTING_COSINE;
        for (int y = 0; y < SIZE; y++)
            for (int x = 0; x < SIZE; x++) {
                float rx = ((float)x + 0.5f - 0.5f * SIZE) / 60, ry = ((float)y + 0.5f - 0.5f * SIZE) / 60;
                depth[y * SIZE + x] = x > y + 40 ? float_inf() : -5.0f / (n[0] * rx + n[1] * ry + n[2]) / length;
                memcpy(&normals[3 * (y * SIZE + x)], n, sizeof n);
            }
        r = compute(&d, WANT_VISIBILITY | WANT_BENT, &stats);
        assert_int_equal(stats.refined, 0); /* and nothing is spent on it */
        for (int y = 0; y < SIZE; y++)
            for (int x = 0; x < SIZE; x++) {
                if (float_at(&r.visibility, y, x) != 1.0f)
                    fail_msg("trial %d: visibility %g", trial, (double)float_at(&r.visibility, y, x));
                for (int i = 0; i < 3; i++)
                    if (!(fabsf(float_at(&r.bent, y, 4 * x + i) - n[i]) <= 3e-7f))
                        fail_msg("trial %d: bent normal", trial);
            }
        result_free(&r);
    }
}

static void outputs_agree(void **state) {
    enum { WIDTH = 131, HEIGHT = 45 };
    static float signal[5 * WIDTH * HEIGHT];
    (void)state;
    for (int k = 0; k < SETTING_COUNT; k++) {
        input in = input_make(&settings[k], WIDTH, HEIGHT, tight);
        result r;
        if (!has_target(&settings[k])) {
            input_free(&in);
            continue;
        }
        in.desc.error_target = 0.025f;
        r = result_make(&in.desc, WANT_EVERYTHING, GTAO_FORMAT_FLOAT, 4, tight, 0);
        r.output.signal = signal, r.output.signal_planes = 5;
        assert_int_equal(gtao_compute(&in.desc, &r.output, r.scratch, r.scratch_size, NULL), GTAO_OK);
        for (int y = 0; y < HEIGHT; y++)
            for (int x = 0; x < WIDTH; x++) {
                float v = float_at(&r.visibility, y, x), b[4], length = 0, weight, sum = 0;
                uint32_t packed;
                memcpy(&packed, plane_row(&r.packed, y) + sizeof packed * (size_t)x, sizeof packed);
                for (int i = 0; i < 4; i++)
                    b[i] = float_at(&r.bent, y, 4 * x + i);
                for (int i = 0; i < 3; i++) {
                    float s = signal[((2 + i) * HEIGHT + y) * WIDTH + x];
                    length += b[i] * b[i], sum += s * b[i];
                }
                weight = signal[(HEIGHT + y) * WIDTH + x];
                if (!(v >= 0 && v <= 1) || !(fabsf(length - 1) < 1e-5f) || b[3] != v || !(weight > 0 && weight < 1e4f))
                    fail_msg("%s at %d, %d: visibility %g, bent normal of length^2 %g, weight %g", settings[k].name, x,
                             y, (double)v, (double)length, (double)weight);
                assert_int_equal(packed, gtao_pack(v, b));
                assert_true(signal[y * WIDTH + x] == v && sum >= 0);
                if (settings[k].desc.estimator == GTAO_ESTIMATOR_NORMALIZED &&
                    !(fabsf(float_at(&r.sh, y, x) / 0.28209479f - v) < 1e-4f))
                    fail_msg("%s at %d, %d: band 0 is %g, visibility %g", settings[k].name, x, y,
                             (double)(float_at(&r.sh, y, x) / 0.28209479f), (double)v);
            }
        assert_false(result_spilled(&r));
        result_free(&r);
        input_free(&in);
    }
}

/* Depth of any bits gives results in range. */
static void bad_data(void **state) {
    enum { WIDTH = 90, HEIGHT = 40 };
    static float depth[WIDTH * HEIGHT], normals[3 * WIDTH * HEIGHT];
    uint32_t random = 5;
    (void)state;
    for (int trial = 0; trial < 30; trial++) {
        gtao_desc d;
        result r;
        memset(&d, 0, sizeof d);
        for (int i = 0; i < WIDTH * HEIGHT; i++)
            depth[i] = trial % 3 == 0 || next_random(&random) % 8 == 0
                           ? float_from_bits(next_random(&random) << 8 ^ next_random(&random))
                           : 5.0f + 0.01f * (float)(next_random(&random) % 200);
        for (int i = 0; i < 3 * WIDTH * HEIGHT; i++)
            normals[i] = float_from_bits(next_random(&random) << 8 ^ next_random(&random));
        d.width = WIDTH, d.height = HEIGHT, d.depth = depth, d.normals = trial % 2 ? normals : NULL;
        d.camera.fx = 50, d.camera.sx = 0.1f;
        d.camera.projection = trial % 5 ? GTAO_PERSPECTIVE : GTAO_ORTHOGRAPHIC;
        d.radius = trial % 7 ? 1.0f : float_inf();
        d.error_target = trial % 2 ? 1e-6f : 0.03f;
        d.thickness = trial % 4 ? 0.0f : 0.2f;
        r = result_make(&d, WANT_EVERYTHING, GTAO_FORMAT_FLOAT, 4, tight, 0);
        memset(r.scratch, 0xFF, r.scratch_size); /* all NaN: whatever is read must have been written */
        assert_int_equal(gtao_compute(&d, &r.output, r.scratch, r.scratch_size, NULL), GTAO_OK);
        for (int y = 0; y < HEIGHT; y++)
            for (int x = 0; x < WIDTH; x++) {
                float v = float_at(&r.visibility, y, x);
                assert_true(v >= 0 && v <= 1);
                for (int i = 0; i < 3; i++)
                    assert_true(fabsf(float_at(&r.bent, y, 4 * x + i)) <= 1.0001f);
                for (int i = 0; i < 9; i++)
                    assert_true(float_finite(float_at(&r.sh, i * HEIGHT + y, x)));
            }
        result_free(&r);
    }
}

/* ---- stages and budgets ------------------------------------------------------------------------------------------- */

static gtao_context *first_stages(const gtao_desc *d, result *r) {
    gtao_context *context = NULL;
    assert_int_equal(gtao_begin(d, &r->output, r->scratch, r->scratch_size, &context), GTAO_OK);
    gtao_prepare_rows(context, 0, d->height);
    gtao_visibility_rows(context, 0, d->height, NULL);
    gtao_share_rows(context, 0, d->height);
    return context;
}

/* More time, less error, and no more time than was given; left half done, the image is valid everywhere. */
static void budgets(void **state) {
    ref_image image;
    gtao_desc d = scene(0, &image);
    result truth, r, half;
    double last = 1;
    gtao_context *context;
    const int middle = 72;
    (void)state;
    d.slices = 64, d.every_pixel = 1;
    truth = compute(&d, WANT_VISIBILITY, NULL);
    d.slices = 0, d.every_pixel = 0, d.error_target = 1e-6f;
    r = result_make(&d, WANT_VISIBILITY, GTAO_FORMAT_FLOAT, 3, tight, 0);
    half = result_make(&d, WANT_VISIBILITY, GTAO_FORMAT_FLOAT, 3, tight, 0);
    for (float most = 0.25f; most < 70.0f; most *= 2) {
        gtao_stats stats = {0};
        float cost;
        double e;
        context = first_stages(&d, &r);
        cost = gtao_refine_begin(context, most);
        assert_true(cost <= most && cost >= 0);
        gtao_refine_rows(context, 0, H, &stats);
        gtao_share_rows(context, 0, H);
        e = rmse(&r, &truth);
        print_message("at most %.2f times the first stage: %.2f, RMSE %.4f\n", (double)most, (double)cost, e);
        assert_true(e <= last + 1e-4);
        last = e;
    }
    assert_true(last < 0.025);
    context = first_stages(&d, &half);
    gtao_refine_begin(context, 0); /* r: all of it; truth: the first result */
    memcpy(truth.visibility.memory, half.visibility.memory, half.visibility.size);
    gtao_refine_rows(context, 0, middle, NULL);
    gtao_share_rows(context, 0, H);
    for (int y = 0; y < H; y++) {
        const result *like = y < middle ? &r : &truth;
        if ((y < middle - 2 || y >= middle) &&
            memcmp(plane_row(&half.visibility, y), plane_row(&like->visibility, y), W * sizeof(float)) != 0)
            fail_msg("row %d is not %s", y, y < middle ? "refined" : "the first result");
    }
    assert_false(planes_equal(&r.visibility, &truth.visibility));
    result_free(&r);
    result_free(&half);
    result_free(&truth);
    ref_image_free(&image);
}

/* Without a target the further stages do nothing. */
static void stages_without_a_target(void **state) {
    input in = input_make(&settings[0], 61, 43, tight);
    result expected = compute(&in.desc, WANT_ALL, NULL),
           r = result_make(&in.desc, WANT_ALL, GTAO_FORMAT_FLOAT, 4, tight, 0);
    gtao_context *context;
    (void)state;
    context = first_stages(&in.desc, &r);
    assert_true(gtao_refine_begin(context, 0) == 0.0f);
    gtao_refine_rows(context, 0, 43, NULL);
    assert_true(result_equal(&r, &expected));
    result_free(&r);
    result_free(&expected);
    input_free(&in);
}

static void errors(void **state) {
    static const float bad[] = {-0.1f, -HUGE_VALF};
    float v[4], depth[4] = {1, 1, 1, 1};
    gtao_desc d;
    gtao_frame_desc frame;
    gtao_sweep *sweep = NULL;
    gtao_output o;
    gtao_context *context;
    (void)state;
    memset(&d, 0, sizeof d), memset(&o, 0, sizeof o), memset(&frame, 0, sizeof frame);
    d.width = d.height = 2, d.depth = depth, d.camera.fx = 1, d.radius = 1, o.visibility = v;
    for (int i = 0; i < 4; i++) {
        d.error_target = i < 2 ? bad[i] : i == 2 ? float_nan() : 0.05f;
        d.noise = i == 3 ? GTAO_NOISE_HILBERT : GTAO_NOISE_MEMO;
        assert_int_equal(gtao_begin(&d, &o, NULL, 0, &context), GTAO_ERROR_TARGET);
        assert_int_equal(gtao_scratch_size(&d), 0);
    }
    assert_non_null(strstr(gtao_result_string(GTAO_ERROR_TARGET), "error_target"));
    d.noise = GTAO_NOISE_MEMO;
    frame.desc = d;
    assert_int_equal(gtao_frame_state_size(&frame), 0);
    assert_int_equal(gtao_sweep_begin(&d, &o, NULL, NULL, 0, &sweep), GTAO_ERROR_TARGET);
    d.error_target = HUGE_VALF; /* whatever the first stage gives */
    assert_int_equal(gtao_begin(&d, &o, NULL, 0, &context), GTAO_ERROR_SCRATCH);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(meets_its_target),
        cmocka_unit_test(slices_join),
        cmocka_unit_test(isas_agree),
        cmocka_unit_test(splits_agree),
        cmocka_unit_test(open_surfaces_are_exact),
        cmocka_unit_test(outputs_agree),
        cmocka_unit_test(bad_data),
        cmocka_unit_test(budgets),
        cmocka_unit_test(stages_without_a_target),
        cmocka_unit_test(errors),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
