/* The same bits whatever the kernel, the rows and threads, and the way rows lie in memory. The compilers' part is in
 * tests/determinism.sh. */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <pthread.h>
#include <stdio.h>

#include "inputs.h"

static const layout tight = {0, 0, 0};

static int isa_list(gtao_isa isas[5]) {
    int count = 0;
    for (int isa = GTAO_ISA_SCALAR; isa <= GTAO_ISA_NEON; isa++)
        if (gtao_isa_available((gtao_isa)isa))
            isas[count++] = (gtao_isa)isa;
    return count;
}

static result compute(const gtao_desc *desc, int want, gtao_format format, int bent_components) {
    result r = result_make(desc, want, format, bent_components, tight, 0);
    assert_int_equal(gtao_compute(desc, &r.output, r.scratch, r.scratch_size, NULL), GTAO_OK);
    return r;
}

/* All kernels against scalar code at one size. */
static void compare_isas(const setting *s, int width, int height) {
    gtao_isa isas[5];
    int count = isa_list(isas);
    input in = input_make(s, width, height, tight);
    result scalar;
    in.desc.isa = GTAO_ISA_SCALAR;
    scalar = compute(&in.desc, WANT_EVERYTHING, GTAO_FORMAT_FLOAT, 3);
    for (int i = 1; i < count; i++) {
        result r;
        in.desc.isa = isas[i];
        r = compute(&in.desc, WANT_EVERYTHING, GTAO_FORMAT_FLOAT, 3);
        if (!result_equal(&r, &scalar))
            fail_msg("%s, %dx%d: %s differs from scalar", s->name, width, height, gtao_isa_name(isas[i]));
        result_free(&r);
    }
    result_free(&scalar);
    input_free(&in);
}

static void isas_agree(void **state) {
    compare_isas((const setting *)*state, 67, 45);
}

/* Odd sizes: every remainder of every kernel's width, and the edges of the 4x4 and 64x64 noise tiles. */
static void isas_agree_at_all_sizes(void **state) {
    const setting *s = (const setting *)*state;
    for (int width = 1; width <= 67; width++)
        compare_isas(s, width, (width * 7) % 13 + 1);
    for (int height = 1; height <= 9; height++)
        compare_isas(s, 17, height);
    compare_isas(s, 129, 65);
    compare_isas(s, 64, 64);
}

/* A row range must not depend on which others have run, nor in what order. */
static void row_splits_agree(void **state) {
    const setting *s = (const setting *)*state;
    input in = input_make(s, 61, 43, tight);
    result whole = result_make(&in.desc, WANT_EVERYTHING, GTAO_FORMAT_FLOAT, 4, tight, 0);
    gtao_stats whole_stats = {0};
    assert_int_equal(gtao_compute(&in.desc, &whole.output, whole.scratch, whole.scratch_size, &whole_stats), GTAO_OK);
    for (int rows = 1; rows <= 45; rows += rows < 6 ? 1 : 13) {
        result r = result_make(&in.desc, WANT_EVERYTHING, GTAO_FORMAT_FLOAT, 4, tight, 0);
        gtao_context *context = NULL;
        gtao_stats stats = {0};
        int bands = (43 + rows - 1) / rows;
        memset(r.scratch, 0xFF, r.scratch_size); /* all NaN: whatever is read must have been written */
        assert_int_equal(gtao_begin(&in.desc, &r.output, r.scratch, r.scratch_size, &context), GTAO_OK);
        for (int i = 0; i < bands; i++) { /* from the last band to the first, then every other */
            int begin = (bands - 1 - i) * rows;
            gtao_prepare_rows(context, begin, begin + rows < 43 ? begin + rows : 43);
        }
        for (int parity = 1; parity >= 0; parity--)
            for (int i = parity; i < bands; i += 2)
                gtao_visibility_rows(context, i * rows, i * rows + rows < 43 ? i * rows + rows : 43, &stats);
        if (!result_equal(&r, &whole))
            fail_msg("%s: bands of %d rows differ from the whole image", s->name, rows);
        if (memcmp(&stats, &whole_stats, sizeof stats) != 0)
            fail_msg("%s: bands of %d rows count differently", s->name, rows);
        result_free(&r);
    }
    result_free(&whole);
    input_free(&in);
}

typedef struct worker {
    pthread_t thread;
    const gtao_context *context;
    int first, step, rows, stage;
    gtao_stats stats;
} worker;

static void *work(void *argument) {
    worker *w = (worker *)argument;
    for (int y = w->first; y < w->rows; y += w->step)
        if (w->stage == 0)
            gtao_prepare_rows(w->context, y, y + 1);
        else
            gtao_visibility_rows(w->context, y, y + 1, &w->stats);
    return NULL;
}

static void threads_agree(void **state) {
    const setting *s = (const setting *)*state;
    input in = input_make(s, 61, 43, tight);
    result one = compute(&in.desc, WANT_EVERYTHING, GTAO_FORMAT_FLOAT, 3);
    for (int threads = 2; threads <= 5; threads++) {
        result r = result_make(&in.desc, WANT_EVERYTHING, GTAO_FORMAT_FLOAT, 3, tight, 0);
        gtao_context *context = NULL;
        worker workers[5];
        assert_int_equal(gtao_begin(&in.desc, &r.output, r.scratch, r.scratch_size, &context), GTAO_OK);
        for (int stage = 0; stage < 2; stage++) {
            for (int i = 0; i < threads; i++) {
                memset(&workers[i], 0, sizeof workers[i]);
                workers[i].context = context;
                workers[i].first = i;
                workers[i].step = threads;
                workers[i].rows = 43;
                workers[i].stage = stage;
                assert_int_equal(pthread_create(&workers[i].thread, NULL, work, &workers[i]), 0);
            }
            for (int i = 0; i < threads; i++)
                pthread_join(workers[i].thread, NULL);
        }
        if (!result_equal(&r, &one))
            fail_msg("%s: %d threads differ from one", s->name, threads);
        result_free(&r);
    }
    result_free(&one);
    input_free(&in);
}

/* Padded, flipped and misaligned rows, in and out; nothing but the pixels is written, nothing of the input. */
static void layouts_agree(void **state) {
    static const layout layouts[] = {{4, 0, 0}, {0, 4, 0}, {12, 60, 0}, {0, 0, 1}, {8, 20, 1}, {4, 4, 1}};
    const setting *s = (const setting *)*state;
    const int count = (int)(sizeof layouts / sizeof layouts[0]);
    input plain = input_make(s, 37, 23, tight);
    result expected = compute(&plain.desc, WANT_EVERYTHING, GTAO_FORMAT_FLOAT, 3);
    for (int i = 0; i < count; i++) {
        /* A different one for the output, so that nothing relies on both being alike. */
        input in = input_make(s, 37, 23, layouts[i]);
        result r =
            result_make(&in.desc, WANT_EVERYTHING, GTAO_FORMAT_FLOAT, 3, layouts[(i + 1) % count], (size_t)(i + 1));
        assert_int_equal(gtao_compute(&in.desc, &r.output, r.scratch, r.scratch_size, NULL), GTAO_OK);
        if (!result_equal(&r, &expected))
            fail_msg("%s: layout %d differs", s->name, i);
        if (result_spilled(&r))
            fail_msg("%s: layout %d: written outside the rows", s->name, i);
        if (!planes_equal(&in.depth, &plain.depth) || (s->normals && !planes_equal(&in.normals, &plain.normals)) ||
            (s->given & WITH_MASK && !planes_equal(&in.mask, &plain.mask)) || plane_spilled(&in.depth))
            fail_msg("%s: layout %d: the input was modified", s->name, i);
        result_free(&r);
        input_free(&in);
    }
    result_free(&expected);
    input_free(&plain);
}

static float float_at(const plane *p, int y, int i) {
    float f;
    memcpy(&f, plane_row(p, y) + sizeof f * (size_t)i, sizeof f);
    return f;
}

/* One result in every format, and each buffer alone like all together. */
static void formats_agree(void **state) {
    const setting *s = (const setting *)*state;
    const int width = 45, height = 19;
    input in = input_make(s, width, height, tight);
    result all = compute(&in.desc, WANT_EVERYTHING, GTAO_FORMAT_FLOAT, 3);
    result four = compute(&in.desc, WANT_EVERYTHING, GTAO_FORMAT_FLOAT, 4);
    result bytes = compute(&in.desc, WANT_EVERYTHING, GTAO_FORMAT_UNORM8, 3);
    result words = compute(&in.desc, WANT_VISIBILITY, GTAO_FORMAT_UNORM16, 3);
    for (int want = 1; want < WANT_EVERYTHING; want++) {
        result r = compute(&in.desc, want, GTAO_FORMAT_FLOAT, 3);
        if (!result_equal(&r, &all))
            fail_msg("%s: outputs %d alone differ from all together", s->name, want);
        result_free(&r);
    }
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            float visibility = float_at(&all.visibility, y, x), bent[3];
            uint32_t packed;
            uint16_t word;
            memcpy(&packed, plane_row(&all.packed, y) + sizeof packed * (size_t)x, sizeof packed);
            memcpy(&word, plane_row(&words.visibility, y) + sizeof word * (size_t)x, sizeof word);
            for (int i = 0; i < 3; i++) {
                bent[i] = float_at(&all.bent, y, 3 * x + i);
                assert_memory_equal(&bent[i], plane_row(&four.bent, y) + sizeof(float) * (size_t)(4 * x + i),
                                    sizeof(float));
            }
            assert_memory_equal(&visibility, plane_row(&four.bent, y) + sizeof(float) * (size_t)(4 * x + 3),
                                sizeof(float));
            assert_int_equal(packed, gtao_pack(visibility, bent));
            assert_int_equal(plane_row(&bytes.visibility, y)[x], (int)(visibility * 255.0f + 0.5f));
            assert_int_equal(word, (int)(visibility * 65535.0f + 0.5f));
        }
    result_free(&all);
    result_free(&four);
    result_free(&bytes);
    result_free(&words);
    input_free(&in);
}

/* The automatic choice is one of the kernels. The counts are the same for all, but for what skips leave out by blocks
 * that are as wide as the kernel. */
static void statistics_agree(void **state) {
    const setting *s = (const setting *)*state;
    gtao_isa isas[5];
    int count = isa_list(isas);
    input in = input_make(s, 67, 45, tight);
    gtao_stats expected[2];
    memset(expected, 0, sizeof expected);
    for (int i = 0; i <= count; i++) {
        in.desc.isa = i < count ? isas[i] : GTAO_ISA_AUTO;
        for (int skip = 0; skip < 2; skip++) {
            const char *name = i < count ? gtao_isa_name(isas[i]) : "auto";
            gtao_stats stats = {0}, *first = &expected[skip];
            result r;
            in.desc.no_skip = skip ? 0 : GTAO_SKIP_ALL;
            r = result_make(&in.desc, WANT_VISIBILITY, GTAO_FORMAT_FLOAT, 3, tight, 0);
            assert_int_equal(gtao_compute(&in.desc, &r.output, r.scratch, r.scratch_size, &stats), GTAO_OK);
            assert_int_equal(stats.pixels, 67 * 45);
            if (i == 0)
                *first = stats;
            else if (!skip && memcmp(&stats, first, sizeof stats) != 0)
                fail_msg("%s: %s counts differently", s->name, name);
            else if (skip && (stats.sky != first->sky || stats.masked != first->masked ||
                              stats.derived_normals != first->derived_normals))
                fail_msg("%s: %s counts other pixels", s->name, name);
            result_free(&r);
        }
        assert_true(expected[0].sky == expected[1].sky && expected[0].masked == expected[1].masked);
    }
    input_free(&in);
}

typedef struct check {
    const char *name;
    CMUnitTestFunction run;
    int every; /* one setting in so many, the slow ones */
} check;

int main(void) {
    static const check checks[] = {
        {"isas", isas_agree, 1},
        {"sizes", isas_agree_at_all_sizes, 4},
        {"rows", row_splits_agree, 1},
        {"threads", threads_agree, 1},
        {"layouts", layouts_agree, 1},
        {"formats", formats_agree, 1},
        {"statistics", statistics_agree, 1},
    };
    enum { CHECK_COUNT = (int)(sizeof checks / sizeof checks[0]) };
    static struct CMUnitTest tests[CHECK_COUNT * SETTING_COUNT];
    static char names[CHECK_COUNT * SETTING_COUNT][64];
    static setting copies[SETTING_COUNT]; /* cmocka's state is not const */
    size_t count = 0;
    memcpy(copies, settings, sizeof settings);
    for (int c = 0; c < CHECK_COUNT; c++)
        for (int i = 0; i < SETTING_COUNT; i += checks[c].every, count++) {
            snprintf(names[count], sizeof names[count], "%s_agree: %s", checks[c].name, settings[i].name);
            tests[count].name = names[count];
            tests[count].test_func = checks[c].run;
            tests[count].initial_state = &copies[i];
        }
    /* What cmocka_run_group_tests() expands to, which wants an array's size. */
    return _cmocka_run_group_tests("determinism", tests, count, NULL, NULL);
}
