/* Spherical harmonics of the visible hemisphere, as an output: what is open, what agrees with the other outputs, where
 * the planes lie, and what one does with them. Against quadrature: tests/reference/test_directional.c. */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include "inputs.h"

static const layout tight = {0, 0, 0};
static const float y0 = 0.28209479f, y1 = 0.48860251f;

static float at(const plane *p, int y, int i) {
    float f;
    memcpy(&f, plane_row(p, y) + sizeof f * (size_t)i, sizeof f);
    return f;
}

static result compute(const gtao_desc *desc, int want) {
    result r = result_make(desc, want, GTAO_FORMAT_FLOAT, 3, tight, 0);
    assert_int_equal(gtao_compute(desc, &r.output, r.scratch, r.scratch_size, NULL), GTAO_OK);
    return r;
}

static void near_to(float got, float expected, float tolerance, const char *what, int i) {
    if (!(fabsf(got - expected) <= tolerance))
        fail_msg("%s, %d: %g instead of %g", what, i, (double)got, (double)expected);
}

/* The coefficients of the open hemisphere about n: 1, 2/3 n, (I + n n^T) / 4; uniformly 1, n / 2, I / 3. */
static void open_hemisphere(const float n[3], int uniform, float sh[9]) {
    const float cone = uniform ? 0.0f : 0.25f;
    gtao_sh_basis(n, sh);
    for (int i = 1; i < 9; i++)
        sh[i] *= i < 4 ? (uniform ? 0.5f : 2.0f / 3.0f) : cone;
}

/* ---- results ----------------------------------------------------------------------------------------------------- */

/* On planes, and where nothing is computed, to the last bits, for any number of slices. */
static void open_surfaces_are_exact(void **state) {
    enum { SIZE = 33 };
    static float depth[SIZE * SIZE], normals[3 * SIZE * SIZE];
    (void)state;
    for (int trial = 0; trial < 40; trial++) {
        gtao_desc desc;
        result r;
        float n[3], length, k = (float)(trial % 8) * 0.25f - 1.0f, l = (float)(trial % 5) * 0.3f - 0.6f;
        memset(&desc, 0, sizeof desc);
        length = sqrtf(k * k + l * l + 1.0f);
        n[0] = k / length, n[1] = l / length, n[2] = -1.0f / length;
        desc.width = desc.height = SIZE;
        desc.camera.fx = 40;
        desc.depth = depth;
        desc.normals = normals;
        desc.radius = 3;
        desc.slices = 1 + trial % 3;
        desc.weighting = trial & 8 ? GTAO_WEIGHTING_UNIFORM : GTAO_WEIGHTING_COSINE;
        desc.noise = (gtao_noise)(trial % 3);
        for (int y = 0; y < SIZE; y++)
            for (int x = 0; x < SIZE; x++) {
                float rx = ((float)x + 0.5f - 0.5f * SIZE) / 40, ry = ((float)y + 0.5f - 0.5f * SIZE) / 40;
                depth[y * SIZE + x] = trial % 4 == 3 ? float_inf() : -5.0f / (n[0] * rx + n[1] * ry + n[2]) / length;
                memcpy(&normals[3 * (y * SIZE + x)], n, sizeof n);
            }
        r = compute(&desc, WANT_EVERYTHING);
        for (int y = 0; y < SIZE; y++)
            for (int x = 0; x < SIZE; x++) {
                float expected[9];
                open_hemisphere(n, desc.weighting == GTAO_WEIGHTING_UNIFORM, expected);
                if (at(&r.visibility, y, x) != 1.0f)
                    fail_msg("trial %d: visibility %g", trial, (double)at(&r.visibility, y, x));
                for (int i = 0; i < 9; i++)
                    near_to(at(&r.sh, i * SIZE + y, x), expected[i], 3e-7f, "open", trial);
            }
        result_free(&r);
    }
}

/* Band 0 is the visibility and band 1 the bent normal, before it gets unit length. */
static void bands_agree_with_the_other_outputs(void **state) {
    const int width = 61, height = 43;
    int occluded = 0;
    (void)state;
    for (int k = 0; k < 2 * SETTING_COUNT; k++) {
        const int s = k / 2, thick = k % 2;
        input in = input_make(&settings[s], width, height, tight);
        result r;
        if (thick && (in.desc.estimator == GTAO_ESTIMATOR_MEMO || in.desc.thin_blend > 0.0f || in.desc.far_depth)) {
            input_free(&in);
            continue;
        }
        if (thick)
            in.desc.thickness = 0.15f;
        r = compute(&in.desc, WANT_EVERYTHING);
        for (int y = 0; y < height; y++)
            for (int x = 0; x < width; x++) {
                float v = at(&r.visibility, y, x), b[3], length = 0;
                for (int i = 0; i < 3; i++) {
                    b[i] = at(&r.sh, (i == 0 ? 3 : i) * height + y, x) / y1;
                    length += b[i] * b[i];
                }
                length = sqrtf(length);
                occluded += v < 0.99f;
                if (settings[s].desc.estimator == GTAO_ESTIMATOR_NORMALIZED)
                    near_to(at(&r.sh, y, x) / y0, v, 2e-6f, settings[s].name, y * width + x);
                for (int i = 0; i < 3 && length > 0.05f; i++)
                    near_to(b[i] / length, at(&r.bent, y, 3 * x + i), 2e-5f, settings[s].name, y * width + x);
            }
        result_free(&r);
        input_free(&in);
    }
    assert_true(occluded > 10000);
}

/* Two bands are the first four of nine coefficients; nothing is written but them, wherever the planes lie. */
static void planes_lie_where_they_are_told(void **state) {
    enum { W = 37, H = 11, MARGIN = 5 };
    static float memory[9 * W * (H + MARGIN) + 2 * MARGIN];
    input in = input_make(&settings[0], W, H, tight);
    result r = compute(&in.desc, WANT_SH), s = compute(&in.desc, WANT_VISIBILITY);
    (void)state;
    for (int bands = 2; bands <= 3; bands++)
        for (int order = 0; order < 4; order++) {
            const int count = bands == 2 ? 4 : 9;
            gtao_output o = {0};
            ptrdiff_t row = order & 1 ? count * W : W, step = order & 1 ? W : H * W + MARGIN, first = MARGIN;
            int written = 0;
            for (size_t i = 0; i < sizeof memory / sizeof memory[0]; i++)
                memory[i] = -77.0f;
            if (order & 2) { /* upwards, and the last coefficient first */
                first += (H - 1) * row + (count - 1) * step;
                row = -row, step = -step;
            }
            o.sh = memory + first;
            o.sh_bands = bands;
            o.sh_stride = row * (ptrdiff_t)sizeof(float);
            o.sh_plane_stride = step * (ptrdiff_t)sizeof(float);
            assert_int_equal(gtao_compute(&in.desc, &o, s.scratch, s.scratch_size, NULL), GTAO_OK);
            for (int i = 0; i < count; i++)
                for (int y = 0; y < H; y++)
                    for (int x = 0; x < W; x++) {
                        float expected = at(&r.sh, i * H + y, x);
                        assert_memory_equal(memory + first + i * step + y * row + x, &expected, sizeof expected);
                    }
            for (size_t i = 0; i < sizeof memory / sizeof memory[0]; i++)
                written += memory[i] != -77.0f;
            assert_int_equal(written, count * W * H);
        }
    result_free(&r);
    result_free(&s);
    input_free(&in);
}

/* ---- what one does with them ------------------------------------------------------------------------------------- */

static void a_white_probe_gives_the_visibility(void **state) {
    enum { W = 45, H = 19 };
    static float rgb[H][W + 2][3];
    float probe[27] = {0};
    input in = input_make(&settings[0], W, H, tight);
    (void)state;
    probe[0] = 1.0f / y0, probe[1] = 2.0f / y0, probe[2] = -1.0f / y0;
    for (int bands = 2; bands <= 3; bands++) {
        result r = result_make(&in.desc, WANT_EVERYTHING, GTAO_FORMAT_FLOAT, 3, tight, 0);
        r.output.sh_bands = bands;
        assert_int_equal(gtao_compute(&in.desc, &r.output, r.scratch, r.scratch_size, NULL), GTAO_OK);
        for (int y = 0; y < H; y++)
            for (int x = 0; x < W + 2; x++)
                rgb[y][x][0] = rgb[y][x][1] = rgb[y][x][2] = -77.0f;
        gtao_irradiance_rows(&in.desc, &r.output, probe, &rgb[0][0][0], sizeof rgb[0], -5, 7);
        gtao_irradiance_rows(&in.desc, &r.output, probe, &rgb[0][0][0], sizeof rgb[0], 7, H + 5);
        for (int y = 0; y < H; y++) {
            for (int x = 0; x < W; x++) {
                float v = at(&r.visibility, y, x);
                near_to(rgb[y][x][0], v, 2e-6f, "red", x);
                near_to(rgb[y][x][1], 2.0f * v, 4e-6f, "green", x);
                near_to(rgb[y][x][2], 0.0f, 0.0f, "blue", x);
            }
            assert_true(rgb[y][W][0] == -77.0f && rgb[y][W + 1][2] == -77.0f);
        }
        result_free(&r);
    }
    input_free(&in);
}

/* A lamp above, seen as far as the bands go: the lit side is the one that faces it, and a wall in between shades. */
static void irradiance_is_the_dot_product(void **state) {
    const float up[3] = {0, -1, 0}, tilted[3] = {0, -0.8f, -0.6f};
    float probe[27] = {0}, y[9], sh[9], rgb[3], open;
    (void)state;
    gtao_sh_basis(up, y);
    for (int i = 0; i < 9; i++)
        probe[3 * i] = y[i];
    gtao_sh_from_cone(1.0f, tilted, tilted, sh);
    gtao_irradiance(sh, probe, rgb);
    open = rgb[0];
    assert_true(open > 0.2f && rgb[1] == 0.0f && rgb[2] == 0.0f);
    gtao_sh_from_cone(0.4f, tilted, tilted, sh);
    gtao_irradiance(sh, probe, rgb);
    assert_true(rgb[0] < open && rgb[0] > 0.2f * open);
}

static void a_full_cone_is_the_open_hemisphere(void **state) {
    const float n[3] = {0.36f, 0.48f, -0.8f};
    float sh[9], expected[9];
    (void)state;
    open_hemisphere(n, 0, expected);
    gtao_sh_from_cone(1.0f, n, n, sh);
    for (int i = 0; i < 9; i++)
        near_to(sh[i], expected[i], 1e-6f, "full", i);
    gtao_sh_from_cone(0.0f, n, n, sh);
    for (int i = 0; i < 9; i++)
        near_to(sh[i], 0.0f, 0.0f, "empty", i);
    assert_true(gtao_cone_cosine(1.0f, 1.0f) == 0.0f && gtao_cone_cosine(0.0f, 0.5f) == 1.0f);
    assert_true(gtao_cone_cosine(0.75f, 1.0f) == 0.5f);
}

static void formulas_take_anything(void **state) {
    const float any[] = {0.0f, -0.0f, 1.0f, -1.0f, 0.5f, 1e30f, -1e30f, float_nan(), float_inf(), -float_inf()};
    const float n[3] = {0, 0, -1}, o[3] = {1, 0, 0};
    (void)state;
    for (int i = 0; i < 10; i++)
        for (int k = 0; k < 10; k++) {
            float c = gtao_cone_cosine(any[i], any[k]), sh[9];
            assert_true(c >= 0.0f && c <= 1.0f);
            gtao_sh_from_cone(any[i], n, n, sh);
            for (int m = 0; m < 9; m++)
                assert_true(float_finite(sh[m]));
            gtao_arc_sh(any[i], any[k], any[(i + k) % 10], o, n, sh);
            for (int m = 0; m < 9; m++)
                assert_true(float_finite(sh[m]));
        }
}

/* A filter across pixels has no use for what it cannot filter: refused, not forgotten. */
static void frames_refuse_it(void **state) {
    input in = input_make(&settings[0], 16, 8, tight);
    result r = result_make(&in.desc, WANT_EVERYTHING, GTAO_FORMAT_FLOAT, 3, tight, 0);
    gtao_frame_desc frame;
    size_t size;
    void *memory;
    (void)state;
    memset(&frame, 0, sizeof frame);
    frame.desc = in.desc;
    frame.cut = 1;
    size = gtao_frame_state_size(&frame);
    memory = calloc(1, size);
    assert_true(size > 0 && memory);
    assert_int_equal(gtao_frame(&frame, &r.output, memory, size, NULL), GTAO_ERROR_SH_BANDS);
    r.output.sh = NULL;
    assert_int_equal(gtao_frame(&frame, &r.output, memory, size, NULL), GTAO_OK);
    free(memory);
    result_free(&r);
    input_free(&in);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(open_surfaces_are_exact),        cmocka_unit_test(bands_agree_with_the_other_outputs),
        cmocka_unit_test(planes_lie_where_they_are_told), cmocka_unit_test(a_white_probe_gives_the_visibility),
        cmocka_unit_test(irradiance_is_the_dot_product),  cmocka_unit_test(a_full_cone_is_the_open_hemisphere),
        cmocka_unit_test(formulas_take_anything),         cmocka_unit_test(frames_refuse_it),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
