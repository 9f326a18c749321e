/* bench_thickness - what occluders with thickness are worth against ray tracing, into build/bench/.
 *
 *     build/bench_thickness [--quick] [--only SCENE|profile] [--no-rivals] [--no-fit]
 *
 * thickness.csv          error of every method on every scene, against all geometry and against what is inside the view
 * thickness_fit.csv      the estimate's constants, fitted to one half of the scenes and tried on the other
 * thickness_scenes.csv   what peeling found
 * thickness_resolution.csv  what the size of a pixel costs: the prototype at 240x135, 480x270 and 960x540
 * thickness_profile.csv  visibility of a wall behind a bar and behind an animal
 * thickness_crops.png    pictures
 * All scenes are those of bench-run, from the same cache. --quick: small images, few directions. --only: one scene, or the profiles. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "crops.h"
#include "dataset.h"
#include "examples/common/cli.h"
#include "measure.h"
#include "peel.h"
#include "rivals/rivals.h"
#include "slabs.h"
#include "thickness.h"
#include "trace.h"

enum { MOST_SCENES = 16, MOST_METHODS = 80, TRUTHS = 2, LAYERS = 8, PICTURES = 8 };
static const char *const truth_names[TRUTHS] = {"rays", "inside"};

typedef enum kind {
    LIBRARY,   /* gtao.h with what `layers`, `thickness`, `map`, `thin_blend` say */
    COMPOSED,  /* [TP16]: two results by mask and minimum */
    PROTOTYPE, /* slabs.h */
    RIVAL,
    VOXELS,
    RAYS,
    TRUTH /* rays inside the view, as a method */
} kind;

typedef enum map_kind { NO_MAP, WIDTH_MAP, FITTED_MAP } map_kind;

typedef struct method {
    kind kind;
    char family[32], setting[24];
    double thickness; /* fraction of the radius; 0: endless */
    double thin_blend;
    map_kind map;
    int layers;  /* two-sided, of the peeled ones */
    int fronts;  /* these without their backs: sheets */
    int count;   /* cones, rays */
    int picture; /* 1 + its row among the pictures */
    const rival *rival;
    const rival_preset *preset;
} method;

typedef struct errors {
    double rmse, mean;
} errors;

typedef struct bench {
    method methods[MOST_METHODS];
    int count, scenes;
    bool quick;
    pool *threads;
    int slices;
    const char *names[MOST_SCENES];
    errors plain[MOST_METHODS][MOST_SCENES][TRUTHS], fitted[MOST_METHODS][MOST_SCENES][TRUTHS];
    double seconds[MOST_METHODS];
    float *keep[MOST_SCENES][MOST_METHODS]; /* raw results of rivals, whose output function is fitted later */
    float *truths[MOST_SCENES][TRUTHS];
    float *pictures[MOST_SCENES][PICTURES];
    view views[MOST_SCENES];
    float *z[MOST_SCENES];
} bench;

/* One scene's data while its methods run. */
typedef struct stage {
    bench *b;
    dataset data;
    peel peel;
    float *inside, *width, *fitted, *work, *scratch;
    float *out[MOST_METHODS];
    bool failed;
} stage;

/* ---- the list ---------------------------------------------------------------------------------------------------- */

static method *add(bench *b, kind k, const char *family, const char *setting) {
    if (b->count == MOST_METHODS) {
        fprintf(stderr, "bench_thickness: too many methods\n");
        exit(1);
    }
    method *m = &b->methods[b->count++];
    memset(m, 0, sizeof *m);
    m->kind = k;
    snprintf(m->family, sizeof m->family, "%s", family);
    snprintf(m->setting, sizeof m->setting, "%s", setting);
    return m;
}

static void list_methods(bench *b, bool with_rivals) {
    static const double blends[] = {0.002, 0.005, 0.01, 0.02};
    static const double constants[] = {0.05, 0.1, 0.15, 0.2, 0.3, 0.5};
    char text[24];
    add(b, LIBRARY, "height field", "")->picture = 1;
    for (size_t k = 0; k < sizeof blends / sizeof *blends; ++k) {
        snprintf(text, sizeof text, "%g", blends[k]);
        add(b, LIBRARY, "slides' blend", text)->thin_blend = blends[k];
    }
    for (size_t k = 0; k < sizeof constants / sizeof *constants; ++k) {
        snprintf(text, sizeof text, "%g", constants[k]);
        add(b, LIBRARY, "constant", text)->thickness = constants[k];
        if (constants[k] == 0.2)
            b->methods[b->count - 1].picture = 2;
    }
    add(b, LIBRARY, "screen width", "")->map = WIDTH_MAP;
    method *m = add(b, LIBRARY, "estimate", "");
    m->map = FITTED_MAP, m->picture = 3;
    m = add(b, LIBRARY, "back faces", "1");
    m->layers = 1, m->picture = 4;
    add(b, COMPOSED, "mask and minimum", "2");
    add(b, LIBRARY, "layers", "2")->layers = 2;
    m = add(b, LIBRARY, "layers", "4");
    m->layers = 4, m->picture = 5;
    add(b, LIBRARY, "layers", "8")->layers = 8;
    add(b, LIBRARY, "fronts only", "4")->fronts = 4;
    m = add(b, LIBRARY, "estimate for the first", "4");
    m->layers = 4, m->map = FITTED_MAP;
    add(b, PROTOTYPE, "prototype", "4")->layers = 4;
    add(b, TRUTH, "rays inside the view", "");
    for (int i = 0; with_rivals && rivals[i]; ++i) {
        const rival_preset *p = &rivals[i]->preset[rivals[i]->presets - 1];
        m = add(b, RIVAL, rivals[i]->name, p->name);
        m->rival = rivals[i], m->preset = p;
    }
    if (with_rivals) {
        add(b, VOXELS, "voxel cones", "16")->count = 16;
        add(b, RAYS, "rays", "16")->count = 16;
    }
}

/* ---- gtao.h ------------------------------------------------------------------------------------------------------ */

typedef struct stages {
    const gtao_context *context;
} stages;

static void prepare_rows(void *user, int thread, int row_begin, int row_end) {
    (void)thread;
    gtao_prepare_rows(((const stages *)user)->context, row_begin, row_end);
}

static void visibility_rows(void *user, int thread, int row_begin, int row_end) {
    (void)thread;
    gtao_visibility_rows(((const stages *)user)->context, row_begin, row_end, NULL);
}

static bool compute(const bench *b, const gtao_desc *d, float *out) {
    gtao_output o;
    gtao_context *context;
    memset(&o, 0, sizeof o);
    o.visibility = out;
    size_t size = gtao_scratch_size(d);
    void *scratch = malloc(size ? size : 1);
    gtao_result r = scratch ? gtao_begin(d, &o, scratch, size, &context) : GTAO_ERROR_SCRATCH;
    if (r == GTAO_OK) {
        stages s = {context};
        pool_run(b->threads, d->height, GTAO_STRIP, prepare_rows, NULL, &s);
        pool_run(b->threads, d->height, GTAO_STRIP, visibility_rows, NULL, &s);
    } else {
        fprintf(stderr, "bench_thickness: %s\n", gtao_result_string(r));
    }
    free(scratch);
    return r == GTAO_OK;
}

static gtao_desc describe(const bench *b, const view *v) {
    gtao_desc d = view_describe(v);
    d.slices = b->slices;
    d.every_pixel = 1;
    return d;
}

/* The peeled layers from the second on. */
static void set_layers(gtao_desc *d, gtao_layer *layers, const peel *p, int count, bool backs) {
    memset(layers, 0, LAYERS * sizeof *layers);
    for (int k = 1; k < count; ++k) {
        layers[k - 1].depth = p->front[k];
        layers[k - 1].back = backs ? p->back[k] : p->front[k];
    }
    d->layers = layers;
    d->layer_count = count - 1;
    d->back = backs ? p->back[0] : p->front[0];
}

static bool run_library(stage *s, const method *m, float *out) {
    gtao_desc d = describe(s->b, &s->data.view);
    gtao_layer layers[LAYERS];
    d.thickness = (float)(m->thickness * (double)d.radius);
    d.thin_blend = (float)m->thin_blend;
    if (m->layers)
        set_layers(&d, layers, &s->peel, m->layers, true);
    if (m->fronts)
        set_layers(&d, layers, &s->peel, m->fronts, false);
    if (m->map) {
        d.thickness_map = m->map == WIDTH_MAP ? s->width : s->fitted;
        d.back = NULL;
    }
    return compute(s->b, &d, out);
}

/* [TP16]: two results by mask and minimum. With two peeled layers the second result is that of the depth behind the first
 * layer, wherever there is one; it counts where nothing stands in front. */
static bool run_composed(stage *s, float *out) {
    const view *v = &s->data.view;
    size_t n = view_pixels(v);
    gtao_desc d = describe(s->b, v);
    unsigned char *moving = malloc(n);
    bool ok = moving && compute(s->b, &d, out);
    for (size_t i = 0; ok && i < n; ++i) {
        moving[i] = s->peel.front[1][i] < VIEW_SKY;
        s->scratch[i] = moving[i] ? s->peel.front[1][i] : v->z[i];
    }
    d.depth = s->scratch;
    ok = ok && compute(s->b, &d, s->work);
    if (ok)
        gtao_compose_layers(n, s->work, NULL, moving, out, NULL);
    free(moving);
    return ok;
}

/* ---- the others --------------------------------------------------------------------------------------------------- */

typedef struct job {
    const view *view;
    const slabs *slabs;
    const trace *trace;
    int count;
    float *out;
} job;

static void slab_rows(void *user, int thread, int row_begin, int row_end) {
    const job *j = user;
    (void)thread;
    slab_visibility_rows(j->view, j->slabs, j->out, row_begin, row_end);
}

static void inside_rows(void *user, int thread, int row_begin, int row_end) {
    const job *j = user;
    (void)thread;
    trace_visibility_inside_rows(j->trace, j->view, j->count, j->out, row_begin, row_end);
}

static void few_rows(void *user, int thread, int row_begin, int row_end) {
    const job *j = user;
    (void)thread;
    trace_few_rows(j->trace, j->view, j->count, j->out, row_begin, row_end);
}

static void run_prototype(stage *s, int layers, int stride, float *out) {
    slabs set;
    memset(&set, 0, sizeof set);
    for (int k = 0; k < layers; ++k)
        set.layer[k] = (slab_layer){s->peel.front[k], s->peel.back[k], s->peel.slope[k]};
    set.count = layers, set.clip = true, set.connect_px = 4, set.cell_px = 1, set.steep = 8;
    set.slices = s->b->slices, set.stride = stride;
    for (size_t i = 0; i < view_pixels(&s->data.view); ++i)
        out[i] = NAN;
    job j = {&s->data.view, &set, NULL, 0, out};
    pool_run(s->b->threads, s->data.view.height, 0, slab_rows, NULL, &j);
}

static bool run_rays(stage *s, int rays, bool inside, int strata, float *out) {
    trace *t = trace_open(&s->data.scene);
    job j = {&s->data.view, NULL, t, inside ? strata : rays, out};
    if (t)
        pool_run(s->b->threads, s->data.view.height, 0, inside ? inside_rows : few_rows, NULL, &j);
    trace_close(t);
    return t != NULL;
}

static bool run_method(stage *s, const method *m, float *out) {
    const view *v = &s->data.view;
    switch (m->kind) {
    case LIBRARY:
        return run_library(s, m, out);
    case COMPOSED:
        return run_composed(s, out);
    case PROTOTYPE:
        run_prototype(s, m->layers, 3, out);
        return true;
    case RIVAL: {
        float *scratch = malloc(rival_scratch_floats(v) * sizeof *scratch);
        if (scratch)
            m->rival->run(v, m->preset, scratch, out);
        if (scratch && m->rival->denoise && m->preset->blur)
            m->rival->denoise(v, m->preset, scratch, out);
        free(scratch);
        return scratch != NULL;
    }
    case VOXELS: {
        voxel_grid *g = voxel_open(&s->data.scene, v, 128);
        if (g)
            voxel_visibility(g, v, m->count, out);
        voxel_close(g);
        return g != NULL;
    }
    case RAYS:
        return run_rays(s, m->count, false, 0, out);
    case TRUTH:
        memcpy(out, s->inside, view_pixels(v) * sizeof *out);
        return true;
    }
    return false;
}

/* ---- one scene --------------------------------------------------------------------------------------------------- */

/* Over the surface; pixels that the prototype leaves out are NaN. */
static errors compare(const view *v, const float *a, const float *b) {
    errors e = {0, 0};
    double n = 0;
    for (size_t i = 0; i < view_pixels(v); ++i)
        if (v->z[i] < VIEW_SKY && !isnan(a[i])) {
            double d = (double)a[i] - (double)b[i];
            e.rmse += d * d, e.mean += d, n += 1;
        }
    e.rmse = sqrt(e.rmse / fmax(n, 1)), e.mean /= fmax(n, 1);
    return e;
}

static float *copied(const float *from, size_t n) {
    float *to = malloc(n * sizeof *to);
    if (!to) {
        fprintf(stderr, "bench_thickness: out of memory\n");
        exit(1);
    }
    memcpy(to, from, n * sizeof *to);
    return to;
}

static void stage_close(stage *s) {
    peel_close(&s->peel);
    dataset_close(&s->data);
    free(s->inside);
    free(s->width);
    free(s->fitted);
    free(s->work);
    free(s->scratch);
}

/* The library's estimate, which must be that of thickness.c with the constants that were chosen. */
static bool estimate(const view *v, float *map, float *work) {
    gtao_desc d = view_describe(v);
    size_t size = gtao_thickness_scratch_size(&d), differ = 0;
    void *scratch = malloc(size);
    bool ok = scratch && gtao_estimate_thickness(&d, map, 0, scratch, size) == GTAO_OK &&
              thickness_estimate(v, &thickness_fitted, work);
    for (size_t i = 0; ok && i < view_pixels(v); ++i)
        differ += isinf(map[i]) ? !isinf(work[i]) : !(fabsf(map[i] - work[i]) <= 1e-3f * map[i]);
    if (differ * 1000 > view_pixels(v))
        printf("  %zu pixels differ from thickness.c\n", differ);
    free(scratch);
    return ok;
}

/* Everything but the dataset. */
static bool stage_fill(stage *s, int strata) {
    static const thickness_rule screen_width = {1, INFINITY, 6, true};
    const view *v = &s->data.view;
    size_t n = view_pixels(v), scratch = rival_scratch_floats(v);
    s->inside = malloc(n * sizeof(float));
    s->width = malloc(n * sizeof(float));
    s->fitted = malloc(n * sizeof(float));
    s->work = malloc(n * sizeof(float));
    s->scratch = malloc((scratch > n ? scratch : n) * sizeof(float));
    return s->inside && s->width && s->fitted && s->work && s->scratch &&
           peel_open(&s->peel, &s->data.scene, LAYERS, s->b->threads) && run_rays(s, 0, true, strata, s->inside) &&
           thickness_estimate(v, &screen_width, s->width) && estimate(v, s->fitted, s->work);
}

static void describe_scene(const stage *s, FILE *csv) {
    const view *v = &s->data.view;
    double surface = 0, sheets = 0, have[LAYERS] = {0};
    for (size_t i = 0; i < view_pixels(v); ++i) {
        for (int k = 0; k < LAYERS; ++k)
            have[k] += s->peel.front[k][i] < VIEW_SKY;
        surface += v->z[i] < VIEW_SKY;
        sheets += v->z[i] < VIEW_SKY && !(s->peel.back[0][i] > s->peel.front[0][i]);
    }
    double n = (double)view_pixels(v);
    fprintf(csv, "%s,%.0f,%.0f,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f\n", s->data.scene.name, s->peel.pieces, s->peel.solids,
            sheets / fmax(surface, 1), have[1] / n, have[2] / n, have[3] / n, have[4] / n, s->peel.deeper);
}

/* Methods that have no threads of their own run beside one another. */
static bool is_serial(const method *m) {
    return m->kind == RIVAL || m->kind == VOXELS;
}

static void serial_methods(void *user, int thread, int begin, int end) {
    stage *s = user;
    (void)thread;
    for (int k = begin; k < end; ++k)
        if (is_serial(&s->b->methods[k])) {
            s->out[k] = malloc(view_pixels(&s->data.view) * sizeof(float));
            if (!s->out[k] || !run_method(s, &s->b->methods[k], s->out[k]))
                s->failed = true;
        }
}

static bool run_scene(bench *b, int index, const dataset_options *o, FILE *csv) {
    stage s;
    memset(&s, 0, sizeof s);
    s.b = b;
    bool ok = dataset_open(&s.data, index, o, b->threads) && stage_fill(&s, o->strata);
    double start = wall_seconds();
    if (ok) {
        const view *v = &s.data.view;
        size_t n = view_pixels(v);
        int at = b->scenes++;
        b->names[at] = bench_scene_name(index);
        b->truths[at][0] = copied(s.data.truth_rays, n);
        b->truths[at][1] = copied(s.inside, n);
        b->z[at] = copied(v->z, n);
        b->views[at] = *v;
        b->views[at].z = b->z[at], b->views[at].normals = NULL;
        describe_scene(&s, csv);
        float *out = malloc(n * sizeof *out);
        pool_run(b->threads, b->count, 1, serial_methods, NULL, &s);
        ok = out && !s.failed;
        for (int k = 0; k < b->count && ok; ++k) {
            const method *m = &b->methods[k];
            double begin = wall_seconds();
            if (is_serial(m))
                b->keep[at][k] = s.out[k];
            else
                ok = run_method(&s, m, out);
            b->seconds[k] += wall_seconds() - begin;
            for (int t = 0; t < TRUTHS; ++t)
                b->plain[k][at][t] = compare(v, is_serial(m) ? s.out[k] : out, b->truths[at][t]);
            if (m->picture)
                b->pictures[at][m->picture - 1] = copied(out, n);
        }
        free(out);
    }
    printf("  %-10s %5.1f s\n", bench_scene_name(index), wall_seconds() - start);
    fflush(stdout);
    stage_close(&s);
    return ok;
}

/* ---- tables ------------------------------------------------------------------------------------------------------ */

/* Output functions of the older methods, to each truth over all scenes; theirs as published is what `plain` gets. */
static void fit_outputs(bench *b) {
    rival_fit *fit = malloc(sizeof *fit);
    for (int k = 0; k < b->count && fit; ++k) {
        const method *m = &b->methods[k];
        memcpy(b->fitted[k], b->plain[k], sizeof b->fitted[k]);
        if (m->kind != RIVAL && m->kind != VOXELS)
            continue;
        for (int t = 0; t < TRUTHS; ++t) {
            double rmse;
            memset(fit, 0, sizeof *fit);
            for (int s = 0; s < b->scenes; ++s)
                rival_fit_add(fit, &b->views[s], b->keep[s][k], b->truths[s][t]);
            rival_output o = rival_fit_solve(fit, &rmse);
            for (int s = 0; s < b->scenes; ++s) {
                float *out = copied(b->keep[s][k], view_pixels(&b->views[s]));
                rival_apply_output(&b->views[s], &o, out);
                b->fitted[k][s][t] = compare(&b->views[s], out, b->truths[s][t]);
                if (m->kind == RIVAL) {
                    memcpy(out, b->keep[s][k], view_pixels(&b->views[s]) * sizeof *out);
                    rival_apply_output(&b->views[s], &m->preset->published, out);
                    b->plain[k][s][t] = compare(&b->views[s], out, b->truths[s][t]);
                }
                free(out);
            }
        }
    }
    free(fit);
}

static errors pooled(errors by_scene[MOST_SCENES][TRUTHS], int scenes, int truth) {
    errors e = {0, 0};
    for (int s = 0; s < scenes; ++s) {
        e.rmse += by_scene[s][truth].rmse * by_scene[s][truth].rmse / scenes;
        e.mean += by_scene[s][truth].mean / scenes;
    }
    e.rmse = sqrt(e.rmse);
    return e;
}

static void write_rows(FILE *csv, bench *b, const char *family, const char *setting, const char *output,
                       errors by_scene[MOST_SCENES][TRUTHS]) {
    for (int t = 0; t < TRUTHS; ++t) {
        errors all = pooled(by_scene, b->scenes, t);
        for (int s = 0; s < b->scenes; ++s)
            fprintf(csv, "%s,%s,%s,%s,%s,%.5f,%+.5f\n", b->names[s], family, setting, truth_names[t], output,
                    by_scene[s][t].rmse, by_scene[s][t].mean);
        fprintf(csv, "pooled,%s,%s,%s,%s,%.5f,%+.5f\n", family, setting, truth_names[t], output, all.rmse, all.mean);
    }
}

/* The best setting of a family: one for all scenes, and each scene's own. */
static void write_best(FILE *csv, bench *b, const char *family) {
    char text[64];
    errors own[MOST_SCENES][TRUTHS], one[MOST_SCENES][TRUTHS];
    memset(own, 0, sizeof own);
    memset(one, 0, sizeof one);
    text[0] = '\0';
    for (int t = 0; t < TRUTHS; ++t) {
        int best = -1;
        for (int k = 0; k < b->count; ++k) {
            if (strcmp(b->methods[k].family, family) != 0)
                continue;
            if (best < 0 || pooled(b->plain[k], b->scenes, t).rmse < pooled(b->plain[best], b->scenes, t).rmse)
                best = k;
            for (int s = 0; s < b->scenes; ++s)
                if (!(own[s][t].rmse > 0) || b->plain[k][s][t].rmse < own[s][t].rmse)
                    own[s][t] = b->plain[k][s][t];
        }
        for (int s = 0; s < b->scenes && best >= 0; ++s)
            one[s][t] = b->plain[best][s][t];
        if (t == 0 && best >= 0)
            snprintf(text, sizeof text, "one for all: %s", b->methods[best].setting);
    }
    write_rows(csv, b, family, text, "best", one);
    write_rows(csv, b, family, "each scene's own", "best", own);
}

static bool write_csv(bench *b) {
    FILE *csv = fopen("build/bench/thickness.csv", "w");
    if (!csv) {
        perror("build/bench/thickness.csv");
        return false;
    }
    fprintf(csv, "scene,method,setting,truth,output,rmse,mean\n");
    for (int k = 0; k < b->count; ++k) {
        const method *m = &b->methods[k];
        write_rows(csv, b, m->family, m->setting, "plain", b->plain[k]);
        if (m->kind == RIVAL || m->kind == VOXELS)
            write_rows(csv, b, m->family, m->setting, "fitted", b->fitted[k]);
    }
    write_best(csv, b, "slides' blend");
    write_best(csv, b, "constant");
    bool ok = !ferror(csv);
    return fclose(csv) == 0 && ok;
}

/* ---- the fit ------------------------------------------------------------------------------------------------------ */

enum { FACTORS = 4, ENDS = 3, SLOPES = 2, RULES = FACTORS * ENDS * SLOPES };

static thickness_rule rule_of(int k) {
    static const float factors[FACTORS] = {0.25f, 0.35f, 0.5f, 0.7f}, ends[ENDS] = {1, 1.5f, 2},
                       slopes[SLOPES] = {6, 8};
    thickness_rule r = {factors[k % FACTORS], ends[k / FACTORS % ENDS], slopes[k / (FACTORS * ENDS)], false};
    return r;
}

/* Squared error of every rule on every scene; then the best rule of one half of the scenes, on both. */
static bool run_fit(bench *b, const dataset_options *o) {
    static double square[RULES + 1][MOST_SCENES];
    FILE *csv = fopen("build/bench/thickness_fit.csv", "w");
    int slices = b->slices;
    bool ok = csv != NULL;
    b->slices = 6;
    for (int s = 0; s < bench_scene_count() && ok; ++s) {
        dataset d;
        ok = dataset_open(&d, s, o, b->threads);
        float *map = ok ? malloc(view_pixels(&d.view) * sizeof *map) : NULL;
        float *out = ok ? malloc(view_pixels(&d.view) * sizeof *out) : NULL;
        for (int k = 0; k <= RULES && map && out && ok; ++k) {
            thickness_rule rule = rule_of(k < RULES ? k : 0);
            if (b->quick && k < RULES && k / FACTORS != 1) { /* only the factor */
                square[k][s] = 1e30;
                continue;
            }
            gtao_desc desc = describe(b, &d.view);
            if (k < RULES) {
                ok = thickness_estimate(&d.view, &rule, map);
                desc.thickness_map = map;
            }
            ok = ok && compute(b, &desc, out);
            double e = compare(&d.view, out, d.truth_rays).rmse;
            square[k][s] = e * e;
        }
        free(map);
        free(out);
        if (ok)
            dataset_close(&d);
    }
    b->slices = slices;
    if (ok)
        fprintf(csv, "fitted_to,factor,endless,slope,rmse,height_field,others_rmse,others_height_field\n");
    for (int fold = 0; fold < 3 && ok; ++fold) { /* every other scene, the rest, all */
        double least = 1e30, sums[RULES + 1][2];
        int best = 0, count[2] = {0, 0};
        memset(sums, 0, sizeof sums);
        for (int s = 0; s < bench_scene_count(); ++s) {
            int other = fold < 2 && s % 2 != fold;
            ++count[other];
            for (int k = 0; k <= RULES; ++k)
                sums[k][other] += square[k][s];
        }
        for (int k = 0; k < RULES; ++k)
            if (sums[k][0] < least)
                least = sums[k][0], best = k;
        thickness_rule r = rule_of(best);
        fprintf(csv, "%s,%g,%g,%g,%.5f,%.5f,%.5f,%.5f\n",
                fold == 0   ? "first half"
                : fold == 1 ? "second half"
                            : "all",
                (double)r.factor, (double)r.endless, (double)r.slope, sqrt(sums[best][0] / count[0]),
                sqrt(sums[RULES][0] / count[0]), sqrt(sums[best][1] / fmax(count[1], 1)),
                sqrt(sums[RULES][1] / fmax(count[1], 1)));
        printf("  fit to %s: factor %g, endless %g, slope %g\n",
               fold == 0   ? "first half"
               : fold == 1 ? "second half"
                           : "all",
               (double)r.factor, (double)r.endless, (double)r.slope);
    }
    if (csv && fclose(csv) != 0)
        ok = false;
    return ok;
}

/* ---- resolution --------------------------------------------------------------------------------------------------- */

/* The prototype with four layers on the same views at other sizes, on every tenth row and column of 960x540 and as many of the others. */
static bool resolution_of(bench *b, int index, int width, int height, int stride, int strata, FILE *csv) {
    stage s;
    memset(&s, 0, sizeof s);
    s.b = b;
    if (!bench_scene_build(&s.data.scene, index, width, height))
        return false;
    const bench_scene_camera *c = &s.data.scene.camera;
    size_t n = (size_t)width * (size_t)height;
    float *z = malloc(n * sizeof *z), *normals = malloc(3 * n * sizeof *normals);
    s.data.z = z, s.data.normals = normals;
    s.data.view = (view){width, height, (float)c->focal_px, (float)c->cx, (float)c->cy, (float)s.data.scene.radius, 0,
                         z,     normals};
    s.inside = malloc(n * sizeof *s.inside);
    s.work = malloc(n * sizeof *s.work);
    trace *t = z && normals && s.inside && s.work ? trace_open(&s.data.scene) : NULL;
    bool ok = t && peel_open(&s.peel, &s.data.scene, 4, b->threads);
    if (ok) {
        trace_primary_rows(t, c, z, normals, 0, height);
        for (int y = 0; y < height; y += stride)
            trace_visibility_inside_rows(t, &s.data.view, strata, s.inside, y, y + 1);
        run_prototype(&s, 4, stride, s.work);
        errors e = compare(&s.data.view, s.work, s.inside);
        fprintf(csv, "%s,%d,%.5f\n", bench_scene_name(index), width, e.rmse);
    }
    trace_close(t);
    stage_close(&s);
    return ok;
}

static bool run_resolution(bench *b, int strata) {
    FILE *csv = fopen("build/bench/thickness_resolution.csv", "w");
    bool ok = csv != NULL;
    for (int i = 0; i < bench_scene_count() && ok; ++i)
        for (int k = b->quick ? 2 : 1; k <= 4 && ok; k *= 2)
            ok = resolution_of(b, i, 960 / k, 540 / k, k == 4 ? 3 : k == 2 ? 5 : 10, strata, csv);
    if (csv && fclose(csv) != 0)
        ok = false;
    return ok;
}

/* ---- profiles ---------------------------------------------------------------------------------------------------- */

/* A row of wall behind a thin bar and behind an animal. */
static bool run_profile(bench *b, const char *name, FILE *csv, int strata) {
    stage s;
    memset(&s, 0, sizeof s);
    s.b = b;
    int width = b->quick ? 240 : 480, height = b->quick ? 135 : 270;
    if (!bench_study_build(&s.data.scene, name, width, height))
        return false;
    const bench_scene_camera *c = &s.data.scene.camera;
    size_t n = (size_t)width * (size_t)height;
    float *z = malloc(n * sizeof *z), *normals = malloc(3 * n * sizeof *normals), *rays = malloc(n * sizeof *rays);
    float *out[5] = {NULL, NULL, NULL, NULL, NULL};
    bool ok = z && normals && rays;
    s.data.z = z, s.data.normals = normals, s.data.truth_rays = rays;
    s.data.view = (view){width, height, (float)c->focal_px, (float)c->cx, (float)c->cy, (float)s.data.scene.radius, 0,
                         z,     normals};
    trace *t = ok ? trace_open(&s.data.scene) : NULL;
    if (t) {
        trace_primary_rows(t, c, z, normals, 0, height);
        trace_visibility_rows(t, &s.data.view, 2 * strata, rays, height / 2, height / 2 + 1);
    }
    trace_close(t);
    ok = t && stage_fill(&s, 1);
    static const method methods[] = {{LIBRARY, "height field", "", 0, 0, NO_MAP, 0, 0, 0, 0, NULL, NULL},
                                     {LIBRARY, "constant", "", 0.2, 0, NO_MAP, 0, 0, 0, 0, NULL, NULL},
                                     {LIBRARY, "estimate", "", 0, 0, FITTED_MAP, 0, 0, 0, 0, NULL, NULL},
                                     {LIBRARY, "back faces", "", 0, 0, NO_MAP, 1, 0, 0, 0, NULL, NULL},
                                     {LIBRARY, "layers", "", 0, 0, NO_MAP, 4, 0, 0, 0, NULL, NULL}};
    for (int k = 0; k < 5 && ok; ++k) {
        out[k] = malloc(n * sizeof(float));
        ok = out[k] && run_method(&s, &methods[k], out[k]);
    }
    for (int x = 0; x < width && ok; ++x) {
        size_t i = (size_t)(height / 2) * (size_t)width + (size_t)x;
        bool wall = z[i] > 5.9f;
        fprintf(csv, "%s,%d,%.4f,%d,%.4f", name, x, ((double)x + 0.5 - c->cx) / c->focal_px * (double)z[i], wall,
                (double)rays[i]);
        for (int k = 0; k < 5; ++k)
            fprintf(csv, ",%.4f", (double)out[k][i]);
        fprintf(csv, "\n");
    }
    for (int k = 0; k < 5; ++k)
        free(out[k]);
    stage_close(&s);
    return ok;
}

static bool run_profiles(bench *b, int strata) {
    FILE *csv = fopen("build/bench/thickness_profile.csv", "w");
    if (!csv)
        return false;
    fprintf(csv, "study,x,position,wall,rays,height_field,constant,estimate,back_faces,layers\n");
    bool ok = run_profile(b, "bar", csv, strata) && run_profile(b, "elephant", csv, strata);
    return fclose(csv) == 0 && ok;
}

/* ---- pictures ---------------------------------------------------------------------------------------------------- */

static int scene_named(const bench *b, const char *name) {
    for (int s = 0; s < b->scenes; ++s)
        if (strcmp(b->names[s], name) == 0)
            return s;
    return -1;
}

static bool write_crops(bench *b) {
    static const char *const rows[] = {"height field", "constant, R / 5",      "estimate",          "back faces",
                                       "four layers",  "rays inside the view", "rays, all geometry"};
    static const crops_column columns[] = {{"grilles", 0.42, 0.55}, {"figure", 0.5, 0.5},   {"furniture", 0.45, 0.55},
                                           {"foliage", 0.5, 0.5},   {"stairs", 0.27, 0.45}, {"scan", 0.35, 0.45}};
    enum { ROWS = sizeof rows / sizeof *rows, COLUMNS = sizeof columns / sizeof *columns };
    crops page;
    if (!crops_open(&page, ROWS, COLUMNS, 160))
        return false;
    for (int r = 0; r < ROWS; ++r)
        crops_title(&page, r, rows[r]);
    for (int c = 0; c < COLUMNS; ++c) {
        int s = scene_named(b, columns[c].scene);
        if (s < 0)
            continue;
        const view *v = &b->views[s];
        crops_scene(&page, c, columns[c].scene);
        for (int r = 0; r < ROWS; ++r) {
            const float *from = r == ROWS - 1 ? b->truths[s][0] : r == ROWS - 2 ? b->truths[s][1] : b->pictures[s][r];
            char label[64] = "";
            if (!from)
                continue;
            if (r < ROWS - 2)
                snprintf(label, sizeof label, "RMSE %.3f, inside %.3f", compare(v, from, b->truths[s][0]).rmse,
                         compare(v, from, b->truths[s][1]).rmse);
            else if (r == ROWS - 2)
                snprintf(label, sizeof label, "RMSE %.3f", compare(v, from, b->truths[s][0]).rmse);
            crops_draw(&page, r, c, &columns[c], v, from, label);
        }
    }
    return crops_save(&page, "build/bench/thickness_crops.png");
}

/* ---- all of it --------------------------------------------------------------------------------------------------- */

static void print_summary(bench *b) {
    printf("%-32s %-8s %16s %16s %8s\n", "pooled", "", "rays", "inside the view", "s");
    for (int k = 0; k < b->count; ++k) {
        const method *m = &b->methods[k];
        errors r = pooled(b->fitted[k], b->scenes, 0), i = pooled(b->fitted[k], b->scenes, 1);
        printf("%-32s %-8s  %.4f %+.4f   %.4f %+.4f %8.1f\n", m->family, m->setting, r.rmse, r.mean, i.rmse, i.mean,
               b->seconds[k]);
    }
}

int main(int argc, char **argv) {
    static bench b;
    dataset_options o = {480, 270, 16, 0, 1};
    bool with_rivals = true, fit = true;
    const char *only = NULL;
    b.slices = 32;
    for (int i = 1; i < argc; ++i) {
        if (strcmp(argv[i], "--quick") == 0)
            b.quick = true;
        else if (strcmp(argv[i], "--no-rivals") == 0)
            with_rivals = false;
        else if (strcmp(argv[i], "--no-fit") == 0)
            fit = false;
        else if (strcmp(argv[i], "--only") == 0 && i + 1 < argc && strcmp(argv[i + 1], "profile") == 0)
            only = argv[++i];
        else if (strcmp(argv[i], "--only") == 0 && i + 1 < argc &&
                 bench_scenes_exist("bench_thickness", 1, argv + i + 1))
            only = argv[++i];
        else {
            fprintf(stderr, "usage: bench_thickness [--quick] [--only SCENE|profile] [--no-rivals] [--no-fit]\n");
            return 2;
        }
    }
    if (b.quick)
        o.width = 240, o.height = 135, o.strata = 8, b.slices = 8;
    double start = wall_seconds();
    b.threads = pool_create(cli_processors());
    if (b.threads && only && strcmp(only, "profile") == 0) {
        bool done = make_folders("build/bench") && run_profiles(&b, o.strata);
        pool_destroy(b.threads);
        return done ? 0 : 1;
    }
    FILE *csv = b.threads && make_folders("build/bench") ? fopen("build/bench/thickness_scenes.csv", "w") : NULL;
    if (!csv) {
        perror("build/bench/thickness_scenes.csv");
        return 1;
    }
    printf("occluders with thickness\n");
    fprintf(csv, "scene,pieces,solids,sheets,second,third,fourth,fifth,deeper\n");
    list_methods(&b, with_rivals);
    bool ok = true;
    for (int i = 0; i < bench_scene_count() && i < MOST_SCENES && ok; ++i)
        if (!only || strcmp(only, bench_scene_name(i)) == 0)
            ok = run_scene(&b, i, &o, csv);
    ok = fclose(csv) == 0 && ok;
    if (ok) {
        fit_outputs(&b);
        ok = write_csv(&b) && write_crops(&b) && run_profiles(&b, o.strata);
        print_summary(&b);
    }
    if (ok && fit && !only)
        ok = run_fit(&b, &o) && run_resolution(&b, o.strata);
    for (int s = 0; s < b.scenes; ++s) {
        for (int k = 0; k < b.count; ++k)
            free(b.keep[s][k]);
        for (int k = 0; k < PICTURES; ++k)
            free(b.pictures[s][k]);
        free(b.truths[s][0]);
        free(b.truths[s][1]);
        free(b.z[s]);
    }
    pool_destroy(b.threads);
    printf("%.0f s\n", wall_seconds() - start);
    return ok ? 0 : 1;
}
