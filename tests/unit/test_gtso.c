/* gtso.h: errors, exact ends, equal bits from every kernel and split, finite results for every float. */
#include "gtso.h"
#include "inputs.h"
#include "tests/reference/check.h"

#include <pthread.h>

/* Fails on NaN, too. */
#define NEAR(actual, expected, tolerance) CHECK_NEAR(actual, expected, tolerance, "%s", #actual)

static const float pi_f = 3.14159265f;

static uint32_t random_bits(uint32_t *state) {
    const uint32_t high = next_random(state) >> 8;
    return high << 16 | next_random(state) >> 8;
}

/* Any float: half of them random bits, half of a moderate size, some special. */
static float any_float(uint32_t *state) {
    static const float special[] = {0.0f, -0.0f, 1.0f, -1.0f, 0.5f, 1e-45f, -1e-40f, 3e38f, -3e38f, 1.5707964f};
    const uint32_t kind = next_random(state) % 8;
    uint32_t bits;
    float f;
    if (kind == 0)
        return special[next_random(state) % 10];
    if (kind == 1)
        return next_random(state) % 2 ? INFINITY : NAN;
    if (kind < 5)
        return (float)next_random(state) / 4194304.0f - 2.0f;
    bits = random_bits(state);
    memcpy(&f, &bits, sizeof f);
    return f;
}

static float uniform(uint32_t *state) {
    return (float)next_random(state) / 16777215.0f;
}

static void any_unit(uint32_t *state, float v[3]) {
    float length;
    do {
        for (int i = 0; i < 3; i++)
            v[i] = 2.0f * uniform(state) - 1.0f;
        length = sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    } while (length < 0.1f || length > 1.0f);
    for (int i = 0; i < 3; i++)
        v[i] /= length;
}

static int in_unit(float x) {
    return x >= 0.0f && x <= 1.0f;
}

/* Small tables of every kind. */
static gtso_table_desc small_table(int which) {
    gtso_table_desc t;
    memset(&t, 0, sizeof t);
    t.kind = (gtso_kind)(which < 4 ? which : which == 4 ? 0 : which - 5 + 1);
    for (int i = 0; i < 5; i++)
        t.size[i] = 8 + (t.kind == GTSO_KIND_BENT ? i == 1 : i);
    t.size[4] = 4;
    if (which == 4) { /* [J16] */
        t.lobe = GTSO_LOBE_GGX;
        t.frame = GTSO_FRAME_REFLECTION;
        t.scale[0] = GTSO_SCALE_COSINE;
        t.scale[1] = GTSO_SCALE_COSINE;
        t.scale[2] = GTSO_SCALE_ALPHA;
    }
    if (which == 5) {
        t.scale[0] = GTSO_SCALE_HALF_SINE;
        t.scale[1] = GTSO_SCALE_HALF_SINE;
    }
    if (which == 6) {
        t.scale[1] = GTSO_SCALE_ANGLE;
        t.scale[3] = GTSO_SCALE_COSINE;
    }
    return t;
}
enum { TABLES = 7 };

/* Baked once; not to be freed. */
static float *baked(int which) {
    static float *tables[TABLES];
    if (!tables[which]) {
        const gtso_table_desc t = small_table(which);
        tables[which] = (float *)malloc(gtso_table_count(&t) * sizeof(float));
        assert_non_null(tables[which]);
        assert_int_equal(gtso_bake(&t, tables[which], NULL), GTSO_OK);
    }
    return tables[which];
}

/* Stands for a baked one where only its size matters. */
static float *noise_table(const gtso_table_desc *t, uint32_t seed) {
    const size_t count = gtso_table_count(t);
    float *data = (float *)malloc(count * sizeof(float));
    assert_non_null(data);
    for (size_t i = 0; i < count; i++)
        data[i] = uniform(&seed);
    return data;
}

/* ---- results ---- */

static void every_result_has_a_message(void **state) {
    (void)state;
    for (int i = 0; i < GTSO_RESULT_COUNT; i++) {
        assert_true(strlen(gtso_result_string((gtso_result)i)) > 1);
        for (int j = 0; j < i; j++)
            assert_string_not_equal(gtso_result_string((gtso_result)i), gtso_result_string((gtso_result)j));
    }
    assert_string_equal(gtso_result_string((gtso_result)-1), "unknown result");
    assert_string_equal(gtso_result_string(GTSO_RESULT_COUNT), "unknown result");
}

static void table_errors(void **state) {
    (void)state;
    gtso_table_desc t, r;
    float cell = 0.0f;
#define BROKEN(change, error)                                                                                          \
    memset(&t, 0, sizeof t);                                                                                           \
    change;                                                                                                            \
    assert_int_equal(gtso_table_resolve(&t, &r), error);                                                               \
    assert_int_equal(gtso_bake(&t, &cell, NULL), error);                                                               \
    assert_int_equal(gtso_table_axes(&t), 0);                                                                          \
    assert_int_equal(gtso_table_rows(&t), 0);                                                                          \
    assert_int_equal(gtso_table_count(&t), 0)
    BROKEN(t.kind = (gtso_kind)4, GTSO_ERROR_KIND);
    BROKEN(t.lobe = (gtso_lobe)5, GTSO_ERROR_LOBE);
    BROKEN(t.frame = (gtso_frame)2, GTSO_ERROR_FRAME);
    BROKEN(t.fit = (gtso_fit)3, GTSO_ERROR_FIT);
    BROKEN(t.caps = (gtso_caps)3, GTSO_ERROR_CAPS);
    BROKEN(t.f0 = -0.1f, GTSO_ERROR_F0);
    BROKEN(t.f0 = 1.5f, GTSO_ERROR_F0);
    BROKEN(t.f0 = NAN, GTSO_ERROR_F0);
    BROKEN(t.size[0] = 7, GTSO_ERROR_TABLE_SIZE);
    BROKEN(t.size[2] = 65, GTSO_ERROR_TABLE_SIZE);
    BROKEN(t.size[1] = -1, GTSO_ERROR_TABLE_SIZE);
    BROKEN((t.kind = GTSO_KIND_BENT, t.size[4] = 3), GTSO_ERROR_TABLE_SIZE);
    BROKEN((t.kind = GTSO_KIND_BENT, t.size[0] = t.size[1] = t.size[2] = t.size[3] = 64), GTSO_ERROR_TABLE_SIZE);
    BROKEN(t.scale[0] = GTSO_SCALE_EDGE, GTSO_ERROR_SCALE);
    BROKEN(t.scale[1] = GTSO_SCALE_ALPHA, GTSO_ERROR_SCALE);
    BROKEN(t.scale[2] = GTSO_SCALE_COSINE, GTSO_ERROR_SCALE);
    BROKEN((t.kind = GTSO_KIND_BRDF, t.scale[3] = GTSO_SCALE_COUNT), GTSO_ERROR_SCALE);
    BROKEN((t.kind = GTSO_KIND_BENT, t.scale[4] = (gtso_scale)-1), GTSO_ERROR_SCALE);
#undef BROKEN
    assert_int_equal(gtso_table_resolve(NULL, &r), GTSO_ERROR_DESC);
    assert_int_equal(gtso_table_resolve(&t, NULL), GTSO_ERROR_DESC);
    assert_int_equal(gtso_bake(NULL, &cell, NULL), GTSO_ERROR_DESC);
    memset(&t, 0, sizeof t);
    assert_int_equal(gtso_bake(&t, NULL, NULL), GTSO_ERROR_DATA);
    assert_int_equal(gtso_bake_rows(&t, &cell, -1, 0, NULL), GTSO_ERROR_ROWS);
    assert_int_equal(gtso_bake_rows(&t, &cell, 2, 1, NULL), GTSO_ERROR_ROWS);
    assert_int_equal(gtso_bake_rows(&t, &cell, 0, 1025, NULL), GTSO_ERROR_ROWS);
    assert_int_equal(gtso_env_bake_rows(1, 8, &cell, 0, 0, NULL), GTSO_ERROR_TABLE_SIZE);
    assert_int_equal(gtso_env_bake_rows(8, 257, &cell, 0, 0, NULL), GTSO_ERROR_TABLE_SIZE);
    assert_int_equal(gtso_env_bake_rows(8, 8, NULL, 0, 0, NULL), GTSO_ERROR_DATA);
    assert_int_equal(gtso_env_bake_rows(8, 8, &cell, 0, 9, NULL), GTSO_ERROR_ROWS);
}

static void table_defaults(void **state) {
    (void)state;
    gtso_table_desc t, r;
    memset(&t, 0, sizeof t);
    assert_int_equal(gtso_table_resolve(&t, &r), GTSO_OK);
    assert_int_equal(gtso_table_axes(&t), 3);
    assert_int_equal(gtso_table_count(&t), 32768);
    assert_int_equal(gtso_table_rows(&t), 1024);
    assert_true(r.f0 > 0.039f && r.f0 < 0.041f);
    for (int i = 0; i < 5; i++)
        assert_int_not_equal(r.scale[i], GTSO_SCALE_DEFAULT);
    assert_int_equal(r.size[3], 1);
    t.kind = GTSO_KIND_BRDF;
    assert_int_equal(gtso_table_axes(&t), 4);
    assert_int_equal(gtso_table_count(&t), 65536);
    t.kind = GTSO_KIND_BENT;
    assert_int_equal(gtso_table_axes(&t), 5);
    assert_int_equal(gtso_table_count(&t), 524288);
    /* resolving twice changes nothing */
    gtso_table_desc again;
    assert_int_equal(gtso_table_resolve(&r, &again), GTSO_OK);
    assert_memory_equal(&again.size, &r.size, sizeof r.size);
}

typedef struct scene {
    gtso_table_desc table;
    float data[8 * 8 * 8], visibility[4], bent[12], normals[12], views[12], roughness[4], output[4];
    gtso_lookup_desc desc;
} scene;

static void scene_make(scene *s) {
    memset(s, 0, sizeof *s);
    for (int i = 0; i < 3; i++)
        s->table.size[i] = 8;
    s->desc.width = 4;
    s->desc.height = 1;
    s->desc.table = &s->table;
    s->desc.data = s->data;
    s->desc.visibility = s->visibility;
    s->desc.bent_normals = s->bent;
    s->desc.normals = s->normals;
    s->desc.views = s->views;
    s->desc.roughness = s->roughness;
    s->desc.output = s->output;
}

static void lookup_errors(void **state) {
    (void)state;
    scene s;
    scene_make(&s);
    assert_int_equal(gtso_lookup(&s.desc), GTSO_OK);
    assert_int_equal(gtso_lookup_rows(&s.desc, 0, 1), GTSO_OK);
    assert_int_equal(gtso_lookup(NULL), GTSO_ERROR_DESC);
    assert_int_equal(gtso_lookup_rows(&s.desc, 0, 2), GTSO_ERROR_ROWS);
    assert_int_equal(gtso_lookup_rows(&s.desc, -1, 1), GTSO_ERROR_ROWS);
#define BROKEN(change, error)                                                                                          \
    scene_make(&s);                                                                                                    \
    change;                                                                                                            \
    s.output[0] = 7.0f;                                                                                                \
    assert_int_equal(gtso_lookup(&s.desc), error);                                                                     \
    assert_true(s.output[0] == 7.0f)
    BROKEN(s.desc.width = 0, GTSO_ERROR_SIZE);
    BROKEN(s.desc.height = 32769, GTSO_ERROR_SIZE);
    BROKEN(s.desc.table = NULL, GTSO_ERROR_DESC);
    BROKEN(s.table.kind = (gtso_kind)9, GTSO_ERROR_KIND);
    BROKEN(s.desc.data = NULL, GTSO_ERROR_DATA);
    BROKEN(s.desc.visibility = NULL, GTSO_ERROR_VISIBILITY);
    BROKEN(s.desc.visibility_stride = 12, GTSO_ERROR_VISIBILITY);
    BROKEN(s.desc.weighting = (gtao_weighting)2, GTSO_ERROR_WEIGHTING);
    BROKEN(s.desc.bent_normals = NULL, GTSO_ERROR_BENT);
    BROKEN(s.desc.bent_components = 2, GTSO_ERROR_BENT);
    BROKEN(s.desc.bent_stride = 50, GTSO_ERROR_BENT);
    BROKEN(s.desc.normals = NULL, GTSO_ERROR_NORMALS);
    BROKEN(s.desc.normal_components = 5, GTSO_ERROR_NORMALS);
    BROKEN(s.desc.normal_stride = -44, GTSO_ERROR_NORMALS);
    BROKEN(s.desc.view_components = 1, GTSO_ERROR_VIEWS);
    BROKEN(s.desc.view_stride = 8, GTSO_ERROR_VIEWS);
    BROKEN(s.desc.view[1] = NAN, GTSO_ERROR_VIEWS);
    BROKEN(s.desc.roughness_stride = 4, GTSO_ERROR_ROUGHNESS);
    BROKEN(s.desc.constant_roughness = 1.1f, GTSO_ERROR_ROUGHNESS);
    BROKEN(s.desc.constant_roughness = NAN, GTSO_ERROR_ROUGHNESS);
    BROKEN(s.desc.fade_begin = 0.2f, GTSO_ERROR_FADE);
    BROKEN(s.desc.fade_end = 2.0f, GTSO_ERROR_FADE);
    BROKEN((s.desc.output = NULL), GTSO_ERROR_OUTPUT);
    BROKEN(s.desc.output_stride = 6, GTSO_ERROR_OUTPUT);
    BROKEN(s.desc.isa = (gtao_isa)77, GTSO_ERROR_ISA);
#undef BROKEN
}

/* ---- cones ---- */

static void apertures(void **state) {
    (void)state;
    assert_true(gtso_cos_aperture(0.0f) == 1.0f && gtso_cos_aperture(1.0f) == 0.0f);
    assert_true(gtso_cos_aperture_uniform(0.0f) == 1.0f && gtso_cos_aperture_uniform(1.0f) == 0.0f);
    assert_true(gtso_cos_aperture_tilted(0.5f, 1.0f) == gtso_cos_aperture(0.5f));
    assert_true(gtso_cos_aperture_tilted(0.6f, 0.6f) == 0.0f);
    assert_true(gtso_cos_aperture_tilted(0.6f, -0.6f) == 0.0f && gtso_cos_aperture_tilted(0.0f, -0.6f) == 1.0f);
    /* The visibility of a cone of half angle 0.5 about an axis tilted by 0.8 is cos(0.8) sin^2(0.5). */
    NEAR(gtso_cos_aperture_tilted(cosf(0.8f) * sinf(0.5f) * sinf(0.5f), cosf(0.8f)), cosf(0.5f), 1e-6);
    /* [J16]: p = 2 / alpha^2 - 2 = 30 at alpha = 1/4, roughness 1/2 */
    NEAR(gtso_lobe_aperture(GTSO_FIT_JIMENEZ, 0.5f), acos(pow(0.01, 1.0 / 32.0)), 1e-6);
    NEAR(gtso_lobe_aperture(GTSO_FIT_JIMENEZ, 0.5f), acos(exp2(-3.32193 / 16.0)), 1e-5);
    NEAR(gtso_lobe_aperture(GTSO_FIT_DROBOT, 0.5f), 2.0 * sqrt(2.0 / 32.0), 1e-6);
    NEAR(gtso_lobe_aperture(GTSO_FIT_ULUDAG, 0.5f), acos(pow(0.244, 1.0 / 31.0)), 1e-6);
    for (int fit = 0; fit < 3; fit++) {
        float last = 0.0f;
        for (int i = 0; i <= 100; i++) {
            const float a = gtso_lobe_aperture((gtso_fit)fit, (float)i / 100.0f);
            assert_true(a >= last && a <= 1.5707964f);
            last = a;
        }
    }
}

static void full_and_empty_cones(void **state) {
    (void)state;
    uint32_t seed = 1;
    for (int i = 0; i < 20000; i++) {
        const float a = pi_f * uniform(&seed), beta = pi_f * uniform(&seed), r = uniform(&seed);
        for (int caps = 0; caps < 3; caps++) {
            assert_true(gtso_cone_visibility((gtso_caps)caps, pi_f, a, beta) == 1.0f);
            assert_true(gtso_cone_visibility((gtso_caps)caps, 0.0f, a, beta) == 0.0f);
        }
        if (i % 100)
            continue;
        for (int lobe = 0; lobe < 5; lobe++) {
            assert_true(gtso_lobe_visibility((gtso_lobe)lobe, GTSO_FRAME_BENT, 0.5f * pi_f, 0.5f * beta, r) == 1.0f);
            assert_true(gtso_lobe_visibility((gtso_lobe)lobe, GTSO_FRAME_BENT, 0.0f, beta, r) == 0.0f);
            assert_true(gtso_lobe_visibility((gtso_lobe)lobe, GTSO_FRAME_REFLECTION, 0.0f, beta, r) == 0.0f);
            assert_true(gtso_lobe_visibility((gtso_lobe)lobe, GTSO_FRAME_REFLECTION, 0.5f * pi_f, 0.0f, r) == 1.0f);
        }
    }
}

static void open_and_closed_pixels(void **state) {
    (void)state;
    for (int which = 0; which < TABLES; which++) {
        const gtso_table_desc t = small_table(which);
        float *data = baked(which);
        uint32_t seed = 7;
        for (int i = 0; i < 500; i++) {
            float n[3], v[3];
            any_unit(&seed, n);
            any_unit(&seed, v);
            assert_true(gtso_lookup_at(&t, data, 0.0f, n, n, v, uniform(&seed)) == 0.0f);
            /* Cone/cone and a lobe of revolution know of no horizon, as in [J16]. */
            if (t.kind != GTSO_KIND_CONE && t.frame == GTSO_FRAME_BENT)
                assert_true(gtso_lookup_at(&t, data, 1.0f, n, n, v, uniform(&seed)) == 1.0f);
        }
    }
}

/* ---- tables ---- */

static void coordinates_round_trip(void **state) {
    (void)state;
    for (int which = 0; which < TABLES; which++) {
        const gtso_table_desc t = small_table(which);
        const int axes = gtso_table_axes(&t);
        uint32_t seed = 3;
        for (int i = 0; i < 3000; i++) {
            float u[5] = {0}, back[5];
            gtso_point p;
            for (int k = 0; k < axes; k++)
                u[k] = uniform(&seed);
            if (i < 32)
                for (int k = 0; k < axes; k++)
                    u[k] = (float)(i >> k & 1);
            gtso_table_point(&t, u, &p);
            assert_true(p.aperture_rad >= 0.0f && p.aperture_rad <= 1.5707964f);
            assert_true(p.beta_rad >= 0.0f && p.beta_rad <= 3.1415928f && in_unit(p.roughness));
            gtso_table_coords(&t, &p, back);
            for (int k = 0; k < axes; k++) {
                /* The edge's place among very narrow lobes: an ulp of beta is much. */
                const float tolerance = k == 1 && p.roughness < 0.1f ? 0.02f : 2e-3f;
                if (!(k == 1 && u[0] == 0.0f) && fabsf(back[k] - u[k]) > tolerance)
                    fail_msg("table %d axis %d: %g came back as %g (roughness %g)", which, k, (double)u[k],
                             (double)back[k], (double)p.roughness);
            }
        }
    }
}

/* At its texels a table is what it stands for. */
static void texels_are_exact(void **state) {
    (void)state;
    for (int which = 0; which < TABLES; which++) {
        gtso_table_desc t = small_table(which), r;
        float *data = baked(which);
        uint32_t seed = 5;
        assert_int_equal(gtso_table_resolve(&t, &r), GTSO_OK);
        for (int i = 0; i < 200; i++) {
            size_t at = 0, pitch = 1;
            float u[5] = {0}, exact;
            gtso_point p;
            for (int k = 0; k < gtso_table_axes(&t); k++) {
                const int texel = (int)(next_random(&seed) % (uint32_t)r.size[k]);
                u[k] = (float)texel / (float)(r.size[k] - 1);
                at += (size_t)texel * pitch;
                pitch *= (size_t)r.size[k];
            }
            gtso_table_point(&t, u, &p);
            exact = gtso_table_exact(&t, &p);
            if (fabsf(data[at] - exact) > 2e-3f * (p.roughness < 0.2f ? 20.0f : 1.0f))
                fail_msg("table %d: texel %zu is %g, not %g (aperture %g beta %g roughness %g)", which, at,
                         (double)data[at], (double)exact, (double)p.aperture_rad, (double)p.beta_rad,
                         (double)p.roughness);
        }
        for (size_t i = 0; i < gtso_table_count(&t); i++)
            assert_true(in_unit(data[i]));
    }
}

typedef struct baker {
    pthread_t thread;
    const gtso_table_desc *table;
    float *data;
    int begin, end;
} baker;

static void *bake_rows(void *argument) {
    baker *b = (baker *)argument;
    gtso_bake_rows(b->table, b->data, b->begin, b->end, NULL);
    return NULL;
}

static void bake_splits_agree(void **state) {
    (void)state;
    for (int which = 0; which < TABLES; which++) {
        const gtso_table_desc t = small_table(which);
        const int rows = gtso_table_rows(&t);
        const size_t bytes = gtso_table_count(&t) * sizeof(float);
        float *whole = baked(which), *parts = (float *)malloc(bytes);
        for (int threads = 2; threads <= (t.kind == GTSO_KIND_BENT ? 2 : 4); threads++) {
            baker bakers[4];
            memset(parts, 0xFF, bytes);
            for (int i = 0; i < threads; i++) {
                bakers[i].table = &t;
                bakers[i].data = parts;
                bakers[i].begin = i * rows / threads;
                bakers[i].end = (i + 1) * rows / threads;
                assert_int_equal(pthread_create(&bakers[i].thread, NULL, bake_rows, &bakers[i]), 0);
            }
            for (int i = 0; i < threads; i++)
                pthread_join(bakers[i].thread, NULL);
            assert_memory_equal(parts, whole, bytes);
        }
        free(parts);
    }
}

typedef struct report {
    int calls, last, total, cancel_at;
} report;

static int count_report(void *user, int done, int total) {
    report *r = (report *)user;
    r->calls++;
    assert_int_equal(done, r->last + 1);
    r->last = done;
    r->total = total;
    return done == r->cancel_at;
}

static void progress_and_cancel(void **state) {
    (void)state;
    const gtso_table_desc t = small_table(1);
    float *data = (float *)malloc(gtso_table_count(&t) * sizeof(float));
    float env[2 * 8 * 8];
    report r = {0, 0, 0, 0};
    gtso_progress progress = {count_report, NULL};
    progress.user = &r;
    assert_int_equal(gtso_bake_rows(&t, data, 10, 30, &progress), GTSO_OK);
    assert_int_equal(r.calls, 20);
    assert_int_equal(r.total, 20);
    memset(&r, 0, sizeof r);
    r.cancel_at = 3;
    assert_int_equal(gtso_bake(&t, data, &progress), GTSO_CANCELLED);
    assert_int_equal(r.calls, 3);
    memset(&r, 0, sizeof r);
    r.cancel_at = 2;
    assert_int_equal(gtso_env_bake_rows(8, 8, env, 0, 8, &progress), GTSO_CANCELLED);
    assert_int_equal(r.calls, 2);
    free(data);
}

/* ---- lookup ---- */

typedef struct planes {
    plane visibility, bent, normals, views, roughness, output;
    gtso_lookup_desc desc;
} planes;

/* kind of values: 0 sensible, 1 any floats. Components alternate between 3 and 4. */
static planes planes_make(int width, int height, layout l, const gtso_table_desc *table, const float *data, int wild,
                          uint32_t seed) {
    planes p;
    const int components = 3 + width % 2;
    memset(&p.desc, 0, sizeof p.desc);
    p.visibility = plane_make(height, (size_t)width * 4, l);
    p.bent = plane_make(height, (size_t)(width * components) * 4, l);
    p.normals = plane_make(height, (size_t)(width * 3) * 4, l);
    p.views = plane_make(height, (size_t)(width * (7 - components)) * 4, l);
    p.roughness = plane_make(height, (size_t)width * 4, l);
    p.output = plane_make(height, (size_t)width * 4, l);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            float n[4], b[4], v[4], s;
            any_unit(&seed, n);
            any_unit(&seed, v);
            any_unit(&seed, b);
            n[3] = b[3] = v[3] = NAN;
            if (wild)
                for (int i = 0; i < 3; i++) {
                    if (next_random(&seed) % 4 == 0)
                        n[i] = any_float(&seed);
                    if (next_random(&seed) % 4 == 0)
                        b[i] = any_float(&seed);
                    if (next_random(&seed) % 4 == 0)
                        v[i] = any_float(&seed);
                }
            memcpy(plane_row(&p.bent, y) + x * components * 4, b, (size_t)components * 4);
            memcpy(plane_row(&p.normals, y) + x * 12, n, 12);
            memcpy(plane_row(&p.views, y) + x * (7 - components) * 4, v, (size_t)(7 - components) * 4);
            s = wild ? any_float(&seed) : uniform(&seed);
            memcpy(plane_row(&p.visibility, y) + x * 4, &s, 4);
            s = wild ? any_float(&seed) : uniform(&seed);
            memcpy(plane_row(&p.roughness, y) + x * 4, &s, 4);
        }
    p.desc.width = width;
    p.desc.height = height;
    p.desc.table = table;
    p.desc.data = data;
    p.desc.visibility = (const float *)(const void *)p.visibility.first;
    p.desc.visibility_stride = plane_stride(&p.visibility);
    p.desc.bent_normals = (const float *)(const void *)p.bent.first;
    p.desc.bent_stride = plane_stride(&p.bent);
    p.desc.bent_components = components;
    p.desc.normals = (const float *)(const void *)p.normals.first;
    p.desc.normal_stride = plane_stride(&p.normals);
    p.desc.views = (const float *)(const void *)p.views.first;
    p.desc.view_stride = plane_stride(&p.views);
    p.desc.view_components = 7 - components;
    p.desc.roughness = (const float *)(const void *)p.roughness.first;
    p.desc.roughness_stride = plane_stride(&p.roughness);
    p.desc.output = (float *)(void *)p.output.first;
    p.desc.output_stride = plane_stride(&p.output);
    return p;
}

static void planes_free(planes *p) {
    free(p->visibility.memory);
    free(p->bent.memory);
    free(p->normals.memory);
    free(p->views.memory);
    free(p->roughness.memory);
    free(p->output.memory);
}

static void isas_and_layouts_agree(void **state) {
    (void)state;
    static const layout layouts[] = {{0, 0, 0}, {4, 12, 0}, {4, 8, 1}};
    for (int which = 0; which < TABLES; which++) {
        const gtso_table_desc t = small_table(which);
        float *data = noise_table(&t, 11);
        for (int width = 1; width <= 67; width += which == 0 ? 1 : 6) {
            const int wild = width % 2;
            planes scalar = planes_make(width, 3, layouts[0], &t, data, wild, (uint32_t)width);
            scalar.desc.isa = GTAO_ISA_SCALAR;
            scalar.desc.no_tilt = width % 3 == 0;
            scalar.desc.weighting = width % 5 == 0 ? GTAO_WEIGHTING_UNIFORM : GTAO_WEIGHTING_COSINE;
            scalar.desc.fade_begin = 0.1f;
            scalar.desc.fade_end = width % 7 == 0 ? 0.1f : 0.3f;
            assert_int_equal(gtso_lookup(&scalar.desc), GTSO_OK);
            for (int y = 0; y < 3; y++)
                for (int x = 0; x < width; x++) {
                    float value;
                    memcpy(&value, plane_row(&scalar.output, y) + 4 * x, 4);
                    if (!in_unit(value))
                        fail_msg("table %d: %g", which, (double)value);
                }
            for (int isa = GTAO_ISA_SCALAR; isa <= GTAO_ISA_NEON; isa++)
                for (int l = 0; l < 3; l++) {
                    planes p;
                    if (!gtao_isa_available((gtao_isa)isa))
                        continue;
                    p = planes_make(width, 3, layouts[l], &t, data, wild, (uint32_t)width);
                    p.desc.isa = (gtao_isa)isa;
                    p.desc.no_tilt = scalar.desc.no_tilt;
                    p.desc.weighting = scalar.desc.weighting;
                    p.desc.fade_begin = scalar.desc.fade_begin;
                    p.desc.fade_end = scalar.desc.fade_end;
                    for (int y = 2; y >= 0; y--)
                        assert_int_equal(gtso_lookup_rows(&p.desc, y, y + 1), GTSO_OK);
                    if (!planes_equal(&p.output, &scalar.output))
                        fail_msg("table %d, width %d, layout %d: %s differs from scalar", which, width, l,
                                 gtao_isa_name((gtao_isa)isa));
                    assert_false(plane_spilled(&p.output));
                    planes_free(&p);
                }
            planes_free(&scalar);
        }
        free(data);
    }
}

static double dot3(const float a[3], const float b[3]) {
    return (double)a[0] * (double)b[0] + (double)a[1] * (double)b[1] + (double)a[2] * (double)b[2];
}

/* The lookup of a pixel is the table's sample at the pixel's angles. */
static void lookup_is_the_sample(void **state) {
    (void)state;
    double worst = 0.0;
    for (int which = 0; which < TABLES; which++) {
        const gtso_table_desc t = small_table(which);
        float *data = baked(which);
        uint32_t seed = 21;
        for (int i = 0; i < 3000; i++) {
            float n[3], b[3], v[3], r[3], visibility = uniform(&seed), roughness = 0.2f + 0.8f * uniform(&seed), u[5];
            float got, want;
            double nb, nr, br, bn, length = 0.0;
            gtso_point p;
            do { /* b and v above the horizon */
                any_unit(&seed, n);
                any_unit(&seed, b);
                any_unit(&seed, v);
                nb = dot3(n, b);
            } while (nb < 0.1 || dot3(n, v) < 0.05);
            for (int k = 0; k < 3; k++)
                r[k] = (float)(2.0 * dot3(n, v) * (double)n[k] - (double)v[k]);
            nr = dot3(n, r);
            br = dot3(b, r);
            br = br > 1.0 ? 1.0 : br < -1.0 ? -1.0 : br;
            bn = (nb - nr * br) / sqrt((1.0 - nr * nr) * (1.0 - br * br) + 1e-30);
            p.aperture_rad = (float)acos(sqrt(1.0 - fmin(1.0, (double)visibility / nb)));
            p.beta_rad = (float)acos(br);
            if (t.kind == GTSO_KIND_LOBE && t.frame == GTSO_FRAME_BENT && t.scale[1] != GTSO_SCALE_DEFAULT)
                p.beta_rad = fminf(p.beta_rad, 1.5707964f);
            p.roughness = roughness;
            p.view_rad = (float)acos(fmin(dot3(n, v), 1.0));
            p.azimuth_rad = (float)acos(bn > 1.0 ? 1.0 : bn < -1.0 ? -1.0 : bn);
            (void)length;
            gtso_table_coords(&t, &p, u);
            got = gtso_lookup_at(&t, data, visibility, b, n, v, roughness);
            want = gtso_table_sample(&t, data, &p);
            worst = fmax(worst, fabs((double)got - (double)want));
            if (fabsf(got - want) > 2e-3f)
                fail_msg("table %d: %g, not %g (aperture %g beta %g roughness %g view %g azimuth %g)", which,
                         (double)got, (double)want, (double)p.aperture_rad, (double)p.beta_rad, (double)p.roughness,
                         (double)p.view_rad, (double)p.azimuth_rad);
        }
    }
    printf("# note: lookup against samples in double: within %.1e\n", worst);
}

static void fade_opens_mirrors(void **state) {
    (void)state;
    scene s;
    scene_make(&s);
    float *data = (float *)malloc(gtso_table_count(&s.table) * sizeof(float));
    assert_int_equal(gtso_bake(&s.table, data, NULL), GTSO_OK);
    s.desc.data = data;
    for (int x = 0; x < 4; x++) {
        s.visibility[x] = 0.3f;
        s.bent[3 * x + 2] = s.normals[3 * x + 2] = s.views[3 * x + 2] = 1.0f;
        s.bent[3 * x] = 0.0f;
    }
    s.roughness[0] = 0.0f;
    s.roughness[1] = 0.1f;
    s.roughness[2] = 0.2f;
    s.roughness[3] = 0.9f;
    for (int x = 0; x < 4; x++) { /* look from the side, so that the mirror sees the wall */
        s.views[3 * x] = 0.8f;
        s.views[3 * x + 2] = 0.6f;
    }
    float plain[4];
    assert_int_equal(gtso_lookup(&s.desc), GTSO_OK);
    memcpy(plain, s.output, sizeof plain);
    assert_true(plain[0] < 0.05f);
    s.desc.fade_begin = 0.1f;
    s.desc.fade_end = 0.3f;
    assert_int_equal(gtso_lookup(&s.desc), GTSO_OK);
    assert_true(s.output[0] == 1.0f && s.output[1] == 1.0f && s.output[3] == plain[3]);
    NEAR(s.output[2], 0.5 + 0.5 * (double)plain[2], 1e-5);
    /* constants instead of buffers */
    s.desc.roughness = NULL;
    s.desc.constant_roughness = 0.9f;
    s.desc.views = NULL;
    s.desc.view[0] = 0.8f;
    s.desc.view[2] = 0.6f;
    assert_int_equal(gtso_lookup(&s.desc), GTSO_OK);
    for (int x = 0; x < 4; x++)
        assert_true(s.output[x] == plain[3]);
    free(data);
}

/* ---- any float ---- */

static void any_float_is_finite(void **state) {
    (void)state;
    uint32_t seed = 99;
    for (int i = 0; i < 20000; i++) {
        const float a = any_float(&seed), b = any_float(&seed), c = any_float(&seed), r = any_float(&seed);
        float n[3], v[3], d[3], occluded, open, env[2], vs;
        gtso_slice slices[3];
        gtso_point point;
        gtso_table_desc t = small_table(i % TABLES);
        for (int k = 0; k < 3; k++) {
            n[k] = any_float(&seed);
            v[k] = any_float(&seed);
            d[k] = any_float(&seed);
            for (int j = 0; j < 3; j++)
                slices[j].direction[k] = any_float(&seed);
            slices[k].h0_rad = any_float(&seed);
            slices[k].h1_rad = any_float(&seed);
        }
        assert_true(in_unit(gtso_cos_aperture(a)) && in_unit(gtso_cos_aperture_uniform(a)));
        assert_true(in_unit(gtso_cos_aperture_tilted(a, b)));
        for (int k = 0; k < 3; k++) {
            assert_true(gtso_lobe_aperture((gtso_fit)k, r) >= 0.0f && gtso_lobe_aperture((gtso_fit)k, r) < 1.6f);
            vs = gtso_cap_intersection((gtso_caps)k, a, b, c);
            assert_true(vs >= 0.0f && vs < 12.6f);
            assert_true(in_unit(gtso_cone_visibility((gtso_caps)k, a, b, c)));
        }
        assert_true(gtso_brdf(n, v, d, r, a) >= 0.0f && gtso_brdf(n, v, d, r, a) < 1e12f);
        if (i % 20)
            continue;
        vs = gtso_lobe_visibility((gtso_lobe)(i / 20 % 5), (gtso_frame)(i / 100 % 2), a, b, r);
        if (!in_unit(vs))
            fail_msg("lobe %d frame %d: %g (%g %g %g)", i / 20 % 5, i / 100 % 2, (double)vs, (double)a, (double)b,
                     (double)r);
        vs = gtso_brdf_visibility(n, v, d, a, r, b, &occluded, &open);
        assert_true(in_unit(vs) && occluded >= 0.0f && occluded <= open && open < 10.0f);
        vs = gtso_horizon_visibility(n, v, slices, 1 + i % 3, r, b, &occluded, &open);
        if (!(in_unit(vs) && occluded >= 0.0f && open < 10.0f))
            fail_msg("horizons: %g = %g / %g, n %g %g %g v %g %g %g roughness %g", (double)vs, (double)occluded,
                     (double)open, (double)n[0], (double)n[1], (double)n[2], (double)v[0], (double)v[1], (double)v[2],
                     (double)r);
        gtso_env_brdf(a, r, env);
        assert_true(in_unit(env[0]) && in_unit(env[1]));
        point.aperture_rad = a;
        point.beta_rad = b;
        point.roughness = r;
        point.view_rad = c;
        point.azimuth_rad = n[0];
        vs = gtso_table_exact(&t, &point);
        assert_true(in_unit(vs));
    }
}

static void any_bits_in_a_lookup(void **state) {
    (void)state;
    for (int which = 0; which < TABLES; which++) {
        const gtso_table_desc t = small_table(which);
        float *data = noise_table(&t, 5);
        uint32_t seed = 1234;
        planes p = planes_make(96, 64, (layout){0, 0, 0}, &t, data, 0, 1);
        p.desc.views = NULL;
        plane *const all[] = {&p.visibility, &p.bent, &p.normals, &p.roughness};
        for (int k = 0; k < 4; k++)
            for (size_t i = 0; i < all[k]->size; i += 4) {
                const uint32_t bits = random_bits(&seed);
                memcpy(all[k]->memory + i, &bits, 4);
            }
        assert_int_equal(gtso_lookup(&p.desc), GTSO_OK);
        for (int y = 0; y < 64; y++)
            for (int x = 0; x < 96; x++) {
                float value;
                memcpy(&value, plane_row(&p.output, y) + 4 * x, 4);
                assert_true(in_unit(value));
            }
        planes_free(&p);
        free(data);
    }
}

/* ---- environment BRDF, BC4 ---- */

static void env_table(void **state) {
    (void)state;
    enum { SIZE = 32 };
    static float data[2 * SIZE * SIZE], again[2 * SIZE * SIZE];
    double square = 0.0;
    uint32_t seed = 3;
    assert_int_equal(gtso_env_bake_rows(SIZE, SIZE, data, 0, SIZE, NULL), GTSO_OK);
    for (int y = SIZE - 1; y >= 0; y--)
        assert_int_equal(gtso_env_bake_rows(SIZE, SIZE, again, y, y + 1, NULL), GTSO_OK);
    assert_memory_equal(again, data, sizeof data);
    for (int i = 0; i < 400; i++) {
        const float nv = uniform(&seed), r = uniform(&seed);
        float exact[2], got[2];
        gtso_env_brdf(nv, r, exact);
        gtso_env_lookup(SIZE, SIZE, data, nv, r, got);
        assert_true(in_unit(exact[0]) && in_unit(exact[1]) && exact[0] + exact[1] <= 1.0f + 1e-4f);
        square += (double)((exact[0] - got[0]) * (exact[0] - got[0]) + (exact[1] - got[1]) * (exact[1] - got[1]));
    }
    printf("# note: environment BRDF %d x %d: RMSE %.5f\n", SIZE, SIZE, sqrt(square / 400));
    assert_true(sqrt(square / 400) < 0.006);
    /* texels */
    for (int i = 0; i < SIZE; i += 5) {
        float exact[2], got[2];
        gtso_env_brdf((float)i / (SIZE - 1), (float)(SIZE - 1 - i) / (SIZE - 1), exact);
        gtso_env_lookup(SIZE, SIZE, data, (float)i / (SIZE - 1), (float)(SIZE - 1 - i) / (SIZE - 1), got);
        NEAR(exact[0], got[0], 1e-4);
        NEAR(exact[1], got[1], 1e-4);
    }
    float env[2];
    gtso_env_lookup(SIZE, SIZE, data, NAN, NAN, env);
    assert_true(in_unit(env[0]));
}

/* By the format's definition, apart from the library's. */
static double bc4_texel(const uint8_t block[8], int i) {
    const int e0 = block[0], e1 = block[1];
    uint64_t bits = 0;
    for (int k = 7; k >= 2; k--)
        bits = bits << 8 | block[k];
    const int code = (int)(bits >> (3 * i) & 7);
    if (code == 0)
        return e0 / 255.0;
    if (code == 1)
        return e1 / 255.0;
    if (e0 > e1)
        return ((8 - code) * e0 + (code - 1) * e1) / 7.0 / 255.0;
    if (code >= 6)
        return code - 6;
    return ((6 - code) * e0 + (code - 1) * e1) / 5.0 / 255.0;
}

static void bc4_decodes_as_defined(void **state) {
    (void)state;
    uint32_t seed = 17;
    for (int i = 0; i < 5000; i++) {
        uint8_t block[8];
        float texels[16];
        for (int k = 0; k < 8; k++)
            block[k] = (uint8_t)(next_random(&seed) >> 4);
        gtso_bc4_decode_block(block, texels);
        for (int k = 0; k < 16; k++)
            NEAR(texels[k], bc4_texel(block, k), 1e-6);
    }
}

static void bc4_encodes_well(void **state) {
    (void)state;
    uint32_t seed = 23;
    float texels[16], out[16];
    uint8_t block[8];
    /* Constants; ramps along either axis; 0 and 1 beside a ramp stay what they are. */
    for (int v = 0; v <= 255; v++) {
        for (int k = 0; k < 16; k++)
            texels[k] = (float)v / 255.0f;
        gtso_bc4_encode_block(texels, block);
        gtso_bc4_decode_block(block, out);
        for (int k = 0; k < 16; k++)
            NEAR(out[k], texels[k], 1e-6);
    }
    for (int i = 0; i < 2000; i++) {
        const float low = uniform(&seed), high = uniform(&seed);
        double worst = 0.0;
        for (int k = 0; k < 16; k++)
            texels[k] = low + (high - low) * (float)(i % 2 ? k % 4 : k / 4) / 3.0f;
        gtso_bc4_encode_block(texels, block);
        gtso_bc4_decode_block(block, out);
        for (int k = 0; k < 16; k++)
            worst = fmax(worst, fabs((double)out[k] - (double)texels[k]));
        /* four equally spaced values of eight: half a step of 1/7 at most, and less for a good choice of ends */
        if (worst > fabs((double)high - (double)low) / 14.0 + 0.5 / 255.0)
            fail_msg("ramp from %g to %g: off by %g", (double)low, (double)high, worst);
    }
    for (int i = 0; i < 2000; i++) {
        const float low = 0.2f + 0.3f * uniform(&seed), high = 0.5f + 0.3f * uniform(&seed);
        for (int k = 0; k < 16; k++)
            texels[k] = k % 4 == 0 ? 0.0f : k % 4 == 3 ? 1.0f : k < 8 ? low : high;
        gtso_bc4_encode_block(texels, block);
        gtso_bc4_decode_block(block, out);
        for (int k = 0; k < 16; k++)
            if (k % 4 == 0 || k % 4 == 3)
                assert_true(out[k] == texels[k]);
            else
                NEAR(out[k], texels[k], 0.5 / 255.0 + 1e-5);
    }
    /* Nothing breaks it. */
    for (int i = 0; i < 2000; i++) {
        for (int k = 0; k < 16; k++)
            texels[k] = any_float(&seed);
        gtso_bc4_encode_block(texels, block);
        gtso_bc4_decode_block(block, out);
        for (int k = 0; k < 16; k++)
            assert_true(in_unit(out[k]));
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_result_has_a_message),
        cmocka_unit_test(table_errors),
        cmocka_unit_test(table_defaults),
        cmocka_unit_test(lookup_errors),
        cmocka_unit_test(apertures),
        cmocka_unit_test(full_and_empty_cones),
        cmocka_unit_test(open_and_closed_pixels),
        cmocka_unit_test(coordinates_round_trip),
        cmocka_unit_test(texels_are_exact),
        cmocka_unit_test(bake_splits_agree),
        cmocka_unit_test(progress_and_cancel),
        cmocka_unit_test(isas_and_layouts_agree),
        cmocka_unit_test(lookup_is_the_sample),
        cmocka_unit_test(fade_opens_mirrors),
        cmocka_unit_test(any_float_is_finite),
        cmocka_unit_test(any_bits_in_a_lookup),
        cmocka_unit_test(env_table),
        cmocka_unit_test(bc4_decodes_as_defined),
        cmocka_unit_test(bc4_encodes_well),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
