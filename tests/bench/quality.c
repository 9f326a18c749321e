#include "quality.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "crops.h"
#include "dataset.h"
#include "examples/common/cli.h"
#include "march.h"
#include "measure.h"
#include "rivals/rivals.h"
#include "trace.h"

enum { MOST_METHODS = 512, MOST_SCENES = 16, TRUTHS = 2 };
static const char *const truth_names[TRUTHS] = {"view", "rays"};

typedef enum kind { LIBRARY, RIVAL, VOXELS, RAYS } kind;

typedef struct method {
    char family[32], setting[40];
    kind kind;
    gtao_desc desc; /* slices, steps and the like; the scene's part is filled in */
    const rival *rival;
    const rival_preset *preset;
    int count;    /* cones or rays */
    int source;   /* index of the method this one denoises, or -1 */
    bool filter;  /* the library's result through the 4 x 4 filter of [J16] */
    bool derived; /* the library derives the normals */
    rival_output fit[TRUTHS];
} method;

typedef struct result {
    float *raw; /* as the method leaves it */
    double ns;
    double times[8];
    int rounds;
} result;

typedef struct bench {
    method methods[MOST_METHODS];
    int count;
    dataset data[MOST_SCENES];
    result *results[MOST_SCENES];
    int scenes;
    float *scratch, *work;
    void *library;
    size_t library_size;
} bench;

/* ---- the list ---------------------------------------------------------------------------------------------------- */

static method *add(bench *b, kind k, const char *family) {
    if (b->count == MOST_METHODS) {
        fprintf(stderr, "bench: too many methods\n");
        exit(1);
    }
    method *m = &b->methods[b->count++];
    memset(m, 0, sizeof *m);
    m->kind = k;
    m->source = -1;
    snprintf(m->family, sizeof m->family, "%s", family);
    return m;
}

/* steps 0: every pixel. */
static method *add_library(bench *b, const char *family, int slices, int steps) {
    method *m = add(b, LIBRARY, family);
    m->desc.slices = slices;
    m->desc.steps = steps;
    m->desc.every_pixel = steps == 0;
    if (steps)
        snprintf(m->setting, sizeof m->setting, "%dx%d", slices, steps);
    else
        snprintf(m->setting, sizeof m->setting, "%dxall", slices);
    return m;
}

/* What a preset stands for. */
static void resolve_preset(gtao_preset preset, int *slices, int *steps) {
    float z = 1, out;
    gtao_desc d;
    gtao_output o;
    gtao_context *context;
    memset(&d, 0, sizeof d);
    memset(&o, 0, sizeof o);
    d.width = d.height = 1, d.depth = &z, d.camera.fx = 1, d.preset = preset;
    o.visibility = &out;
    size_t size = gtao_scratch_size(&d);
    void *scratch = malloc(size);
    if (scratch && gtao_begin(&d, &o, scratch, size, &context) == GTAO_OK) {
        *slices = gtao_context_slices(context);
        *steps = gtao_context_steps(context);
    }
    free(scratch);
}

static void list_methods(bench *b, bool quick) {
    static const int slices[] = {1, 2, 3, 4, 6, 8, 12, 16, 32, 64}, steps[] = {2, 3, 4, 6, 8, 12, 16, 24, 32, 64, 0};
    static const int some[][2] = {{1, 4}, {1, 8}, {2, 6}, {3, 8}, {4, 8}, {8, 16}, {16, 32}, {32, 64}, {64, 0}};
    static const char *const presets[] = {"medium", "low", "high", "ultra", "reference"};
    static const int order[] = {1, 0, 2, 3, 4}, rays[] = {1, 4, 16, 64, 256};
    static const float powers[] = {1, 1.5f, 2, 3};
    for (size_t i = 0; i < sizeof slices / sizeof *slices; ++i)
        for (size_t k = 0; k < sizeof steps / sizeof *steps; ++k)
            if (!quick || ((slices[i] & (slices[i] - 1)) == 0 && steps[k] % 4 == 0 && slices[i] < 64))
                add_library(b, "gtao", slices[i], steps[k]);
    for (size_t i = 0; i < sizeof some / sizeof *some; ++i) {
        if (quick && some[i][0] > 16)
            continue;
        add_library(b, "gtao memo estimator", some[i][0], some[i][1])->desc.estimator = GTAO_ESTIMATOR_MEMO;
        add_library(b, "gtao hilbert", some[i][0], some[i][1])->desc.noise = GTAO_NOISE_HILBERT;
        add_library(b, "gtao no noise", some[i][0], some[i][1])->desc.noise = GTAO_NOISE_NONE;
        if (some[i][0] <= 16) {
            add_library(b, "gtao scalar", some[i][0], some[i][1])->desc.isa = GTAO_ISA_SCALAR;
            add_library(b, "gtao 4x4 filter", some[i][0], some[i][1])->filter = true;
        }
    }
    for (int k = 0; k < 5; ++k) {
        method *m = add(b, LIBRARY, "gtao preset");
        m->desc.preset = (gtao_preset)order[k];
        snprintf(m->setting, sizeof m->setting, "%s", presets[order[k]]);
        resolve_preset(m->desc.preset, &m->desc.slices, &m->desc.steps);
        m->desc.every_pixel = m->desc.steps == 0;
    }
    /* what other settings than the truth's change */
    add_library(b, "gtao falloff 0.25", 32, 0)->desc.falloff = 0.25f;
    add_library(b, "gtao radius capped", 32, 0)->desc.max_radius_px = 50;
    add_library(b, "gtao derived normals", 32, 0)->derived = true;
    /* step_power is judged where few samples must cover the radius */
    for (size_t i = 0; i < 3; ++i)
        for (size_t k = 0; k < sizeof powers / sizeof *powers; ++k)
            for (int n = 4; n <= 16 && (!quick || n == 4); n += n < 8 ? 2 : 4) {
                char family[32];
                snprintf(family, sizeof family, "gtao power %g", (double)powers[k]);
                add_library(b, family, slices[i], n)->desc.step_power = powers[k];
            }
    for (int i = 0; rivals[i]; ++i)
        for (int k = 0; k < rivals[i]->presets && (!quick || k < 1 || rivals[i] == &rival_gtao_memo); ++k) {
            method *m = add(b, RIVAL, rivals[i]->name);
            m->rival = rivals[i], m->preset = &rivals[i]->preset[k];
            snprintf(m->setting, sizeof m->setting, "%s", m->preset->name);
        }
    for (int cones = 6; cones <= 16; cones += 10) {
        method *m = add(b, VOXELS, "voxel cones");
        m->count = cones;
        snprintf(m->setting, sizeof m->setting, "%d", cones);
    }
    for (int k = 0; k < (quick ? 3 : 5); ++k) {
        method *m = add(b, RAYS, "rays");
        m->count = rays[k];
        snprintf(m->setting, sizeof m->setting, "%d", rays[k]);
        m = add(b, RAYS, "rays denoised");
        m->count = rays[k];
        m->source = b->count - 2;
        snprintf(m->setting, sizeof m->setting, "%d", rays[k]);
    }
}

/* ---- runs -------------------------------------------------------------------------------------------------------- */

static bool run_library(bench *b, const view *v, const method *m, float *out) {
    gtao_desc d = view_describe(v);
    gtao_output o;
    d.slices = m->desc.slices, d.steps = m->desc.steps, d.every_pixel = m->desc.every_pixel;
    d.preset = m->desc.preset, d.estimator = m->desc.estimator, d.noise = m->desc.noise, d.isa = m->desc.isa;
    d.step_power = m->desc.step_power;
    d.max_radius_px = m->desc.max_radius_px;
    if (m->desc.falloff > 0)
        d.falloff = m->desc.falloff;
    if (m->derived)
        d.normals = NULL;
    memset(&o, 0, sizeof o);
    o.visibility = out;
    size_t size = gtao_scratch_size(&d);
    if (size > b->library_size) {
        free(b->library);
        b->library = calloc(1, size);
        b->library_size = b->library ? size : 0;
    }
    gtao_result r = gtao_compute(&d, &o, b->library, b->library_size, NULL);
    if (r != GTAO_OK)
        fprintf(stderr, "%s %s: %s\n", m->family, m->setting, gtao_result_string(r));
    return r == GTAO_OK;
}

/* Seconds of the work itself; negative on failure. */
static double run_once(bench *b, const dataset *d, const trace *t, const voxel_grid *g, result *results, int index) {
    const method *m = &b->methods[index];
    const view *v = &d->view;
    float *raw = results[index].raw;
    if (m->source >= 0)
        memcpy(raw, results[m->source].raw, view_pixels(v) * sizeof *raw);
    double start = thread_seconds();
    bool ok = true;
    switch (m->kind) {
    case LIBRARY:
        ok = run_library(b, v, m, raw);
        if (m->filter)
            rival_gtao_memo.denoise(v, &rival_gtao_memo.preset[0], b->scratch, raw);
        break;
    case RIVAL:
        m->rival->run(v, m->preset, b->scratch, raw);
        if (m->rival->denoise && m->preset->blur)
            m->rival->denoise(v, m->preset, b->scratch, raw);
        break;
    case VOXELS:
        voxel_visibility(g, v, m->count, raw);
        break;
    case RAYS:
        if (m->source >= 0)
            rival_blur(v, 3, b->scratch, raw);
        else
            trace_few_rows(t, v, m->count, raw, 0, v->height);
        break;
    }
    return ok ? thread_seconds() - start : -1;
}

/* Every method in turn, several rounds; those that take long only in the first. */
static bool run_scene(bench *b, const dataset *d, result *results, bool quick) {
    trace *t = trace_open(&d->scene);
    voxel_grid *g = voxel_open(&d->scene, &d->view, 128);
    bool ok = t && g;
    for (int k = 0; k < b->count && ok; ++k) {
        results[k].raw = malloc(view_pixels(&d->view) * sizeof(float));
        ok = results[k].raw != NULL;
    }
    for (int round = 0; round < (quick ? 2 : 7) && ok; ++round)
        for (int k = 0; k < b->count && ok; ++k) {
            result *r = &results[k];
            double first = round ? r->times[0] : 0;
            if ((round >= 1 && first > 0.2) || (round >= 3 && first > 0.02))
                continue;
            double s = run_once(b, d, t, g, results, k);
            r->times[r->rounds++] = s;
            ok = s >= 0;
        }
    for (int k = 0; k < b->count && ok; ++k) {
        results[k].ns = 1e9 * median(results[k].times, results[k].rounds) / (double)view_pixels(&d->view);
        if (b->methods[k].source >= 0)
            results[k].ns += results[b->methods[k].source].ns;
    }
    voxel_close(g);
    trace_close(t);
    return ok;
}

/* ---- output ------------------------------------------------------------------------------------------------------ */

static const float *truth_of(const dataset *d, int truth) {
    return truth ? d->truth_rays : d->truth_view;
}

/* Ray tracing and the library estimate the truth itself; the others have an output function. */
static bool has_output(const method *m) {
    return m->kind == RIVAL || m->kind == VOXELS;
}

static void finish(const dataset *d, const method *m, const rival_output *o, const float *raw, float *out) {
    static const rival_output identity = {0, 1, 1};
    memcpy(out, raw, view_pixels(&d->view) * sizeof *out);
    if (memcmp(o, &identity, sizeof identity) != 0 || has_output(m))
        rival_apply_output(&d->view, o, out);
}

static void fit_outputs(bench *b) {
    rival_fit *fit = malloc(sizeof *fit);
    for (int k = 0; k < b->count && fit; ++k)
        for (int truth = 0; truth < TRUTHS; ++truth) {
            double rmse;
            memset(fit, 0, sizeof *fit);
            for (int s = 0; s < b->scenes; ++s)
                rival_fit_add(fit, &b->data[s].view, b->results[s][k].raw, truth_of(&b->data[s], truth));
            b->methods[k].fit[truth] = rival_fit_solve(fit, &rmse);
        }
    free(fit);
}

static void write_row(FILE *csv, const char *scene, const method *m, double ns, int truth, const char *output,
                      const distance *e) {
    int taps = m->kind == RIVAL ? m->preset->taps : m->kind == LIBRARY ? 2 * m->desc.slices * m->desc.steps : m->count;
    fprintf(csv, "%s,%s,%s,%d,%d,%d,%.3f,%s,%s,%.6f,%.6f,%.3f,%.5f,%.5f\n", scene, m->family, m->setting,
            m->desc.slices, m->desc.steps, taps, ns, truth_names[truth], output, e->rmse, e->mean, e->psnr, e->ssim,
            e->most);
}

/* Distances of every scene, truth and output: plain, as the source has it, and fitted, through the output function
 * (b (x + a))^c fitted to this truth over all scenes. */
typedef distance method_errors[MOST_SCENES][TRUTHS][2];

typedef struct comparison {
    bench *b;
    float *work; /* an image a thread */
    method_errors *errors;
} comparison;

static void compare_methods(void *user, int thread, int begin, int end) {
    const comparison *c = user;
    bench *b = c->b;
    float *work = c->work + (size_t)thread * view_pixels(&b->data[0].view);
    const rival_output identity = {0, 1, 1};
    for (int k = begin; k < end; ++k)
        for (int s = 0; s < b->scenes; ++s)
            for (int truth = 0; truth < TRUTHS; ++truth)
                for (int fitted = 0; fitted < 2; ++fitted) {
                    const method *m = &b->methods[k];
                    const dataset *d = &b->data[s];
                    const rival_output *o = fitted             ? &m->fit[truth]
                                            : m->kind == RIVAL ? &m->preset->published
                                                               : &identity;
                    finish(d, m, o, b->results[s][k].raw, work);
                    c->errors[k][s][truth][fitted] = image_distance(&d->view, work, truth_of(d, truth));
                }
}

/* Pooled: every scene with the same weight. */
static bool write_csv(bench *b, pool *threads) {
    comparison c = {b, malloc((size_t)pool_threads(threads) * view_pixels(&b->data[0].view) * sizeof(float)),
                    malloc((size_t)b->count * sizeof *c.errors)};
    FILE *csv = fopen("build/bench/error.csv", "w");
    if (!csv || !c.work || !c.errors) {
        perror("build/bench/error.csv");
        return false;
    }
    pool_run(threads, b->count, 1, compare_methods, NULL, &c);
    fprintf(csv, "scene,family,setting,slices,steps,taps,ns_per_pixel,truth,output,rmse,mean,psnr,ssim,max\n");
    for (int k = 0; k < b->count; ++k)
        for (int truth = 0; truth < TRUTHS; ++truth)
            for (int fitted = 0; fitted < 2; ++fitted) {
                const method *m = &b->methods[k];
                distance pooled = {0, 0, 0, 0, 0};
                double ns = 0;
                for (int s = 0; s < b->scenes; ++s) {
                    const result *r = &b->results[s][k];
                    distance e = c.errors[k][s][truth][fitted];
                    write_row(csv, b->data[s].scene.name, m, r->ns, truth, fitted ? "fitted" : "plain", &e);
                    pooled.rmse += e.rmse * e.rmse / b->scenes;
                    pooled.mean += e.mean / b->scenes;
                    pooled.ssim += e.ssim / b->scenes;
                    pooled.most = fmax(pooled.most, e.most);
                    ns += r->ns / b->scenes;
                }
                pooled.rmse = sqrt(pooled.rmse);
                pooled.psnr = -20 * log10(fmax(pooled.rmse, 1e-9));
                write_row(csv, "pooled", m, ns, truth, fitted ? "fitted" : "plain", &pooled);
            }
    /* what the depth buffer alone cannot tell */
    for (int s = 0; s < b->scenes; ++s) {
        const dataset *d = &b->data[s];
        method gap;
        memset(&gap, 0, sizeof gap);
        snprintf(gap.family, sizeof gap.family, "depth buffer");
        snprintf(gap.setting, sizeof gap.setting, "truth");
        distance e = image_distance(&d->view, d->truth_view, d->truth_rays);
        write_row(csv, d->scene.name, &gap, 0, 1, "plain", &e);
    }
    free(c.work);
    free(c.errors);
    bool ok = !ferror(csv);
    return fclose(csv) == 0 && ok;
}

/* Random error of the truths themselves: they are estimates from `strata`^2 directions, whose error falls as the power
 * -3/4 of their number, so that of a quarter of them is sqrt(8) times as large; the two differ by sqrt(1 + 8) times it. */
static bool write_noise(const bench *b, int strata) {
    FILE *csv = fopen("build/bench/truth.csv", "w");
    if (!csv)
        return false;
    fprintf(csv, "scene,rays,noise_view,noise_rays,pixels,sky,radius_px\n");
    for (int s = 0; s < b->scenes; ++s) {
        const dataset *d = &b->data[s];
        double noise[TRUTHS] = {0, 0}, sky = 0, radius = 0;
        march *h = march_open(&d->view);
        trace *t = trace_open(&d->scene);
        if (h && t)
            for (int truth = 0; truth < TRUTHS; ++truth) {
                double sum = 0, count = 0;
                for (int y = 4; y < d->view.height; y += 8) { /* every eighth row tells enough */
                    size_t first = (size_t)y * (size_t)d->view.width;
                    if (truth)
                        trace_visibility_rows(t, &d->view, strata / 2, b->work, y, y + 1);
                    else
                        march_visibility_rows(h, strata / 2, b->work, y, y + 1);
                    for (size_t i = first; i < first + (size_t)d->view.width; ++i)
                        if (d->z[i] < VIEW_SKY) {
                            double e = (double)b->work[i] - (double)truth_of(d, truth)[i];
                            sum += e * e, count += 1;
                        }
                }
                noise[truth] = sqrt(sum / fmax(count, 1)) / 3;
            }
        march_close(h);
        trace_close(t);
        size_t n = view_pixels(&d->view);
        for (size_t i = 0; i < n; ++i) {
            sky += !(d->z[i] < VIEW_SKY);
            radius += d->z[i] < VIEW_SKY ? (double)(d->view.radius * d->view.focal_px / d->z[i]) : 0;
        }
        fprintf(csv, "%s,%d,%.5f,%.5f,%zu,%.4f,%.1f\n", d->scene.name, strata * strata, noise[0], noise[1], n,
                sky / (double)n, radius / fmax(1, (double)n - sky));
    }
    return fclose(csv) == 0;
}

/* ---- the page of crops ------------------------------------------------------------------------------------------- */

static int scene_named(const bench *b, const char *name) {
    for (int s = 0; s < b->scenes; ++s)
        if (strcmp(b->data[s].scene.name, name) == 0)
            return s;
    return -1;
}

/* Each method with the output function that suits it best, against the truth it aims at. */
static bool write_crops(bench *b) {
    static const struct {
        const char *family, *setting, *title;
        int truth;
    } rows[] = {{"", "view", "depth buffer, truth", 0},
                {"gtao preset", "low", "gtao.h low", 0},
                {"gtao preset", "medium", "gtao.h medium", 0},
                {"gtao preset", "high", "gtao.h high", 0},
                {"gtao preset", "ultra", "gtao.h ultra", 0},
                {"gtao preset", "reference", "gtao.h reference", 0},
                {"gtao-memo", "3x8", "memo, scalar, filtered", 0},
                {"xegtao", "high", "XeGTAO constants", 0},
                {"hbao", "6x6 blurred", "HBAO 2008", 0},
                {"bitmask", "", "visibility bitmask", 1},
                {"alchemy", "", "Alchemy 2011", 0},
                {"volumetric", "", "volumetric 2010", 0},
                {"mittring2012", "", "Mittring 2012", 0},
                {"bavoil2008", "", "Bavoil 2008", 0},
                {"filion2008", "", "Filion 2008", 0},
                {"mittring2007", "", "Mittring 2007", 0},
                {"", "rays", "ray tracing, truth", 1},
                {"voxel cones", "16", "voxel cones, 16", 1},
                {"rays", "4", "Embree, 4 rays", 1},
                {"rays denoised", "16", "Embree, 16 rays, blurred", 1}};
    static const crops_column columns[] = {{"stairs", 0.27, 0.45},
                                           {"foliage", 0.5, 0.6},
                                           {"furniture", 0.45, 0.55},
                                           {"figure", 0.5, 0.45},
                                           {"grilles", 0.5, 0.5}};
    enum { ROWS = sizeof rows / sizeof *rows, COLUMNS = sizeof columns / sizeof *columns };
    crops page;
    if (!crops_open(&page, ROWS, COLUMNS, 190))
        return false;
    for (int r = 0; r < ROWS; ++r)
        crops_title(&page, r, rows[r].title);
    for (int c = 0; c < COLUMNS; ++c) {
        int s = scene_named(b, columns[c].scene);
        if (s < 0)
            continue;
        const dataset *d = &b->data[s];
        crops_scene(&page, c, columns[c].scene);
        for (int r = 0; r < ROWS; ++r) {
            int truth = rows[r].truth, k = -1;
            char label[96];
            label[0] = '\0';
            if (rows[r].family[0]) {
                for (k = 0; k < b->count && (strcmp(b->methods[k].family, rows[r].family) != 0 ||
                                             (rows[r].setting[0] && strcmp(b->methods[k].setting, rows[r].setting)));)
                    ++k;
                if (k == b->count)
                    continue;
                const method *m = &b->methods[k];
                static const rival_output identity = {0, 1, 1};
                finish(d, m, has_output(m) ? &m->fit[truth] : &identity, b->results[s][k].raw, b->work);
                snprintf(label, sizeof label, "RMSE %.3f, %.0f ns/px",
                         image_distance(&d->view, b->work, truth_of(d, truth)).rmse, b->results[s][k].ns);
            } else {
                memcpy(b->work, truth_of(d, truth), view_pixels(&d->view) * sizeof *b->work);
                if (truth)
                    snprintf(label, sizeof label, "depth buffer: RMSE %.3f",
                             image_distance(&d->view, d->truth_view, d->truth_rays).rmse);
            }
            crops_draw(&page, r, c, &columns[c], &d->view, b->work, label);
        }
    }
    return crops_save(&page, "build/bench/crops.png");
}

/* ---- all of it --------------------------------------------------------------------------------------------------- */

bool quality_run(bool quick) {
    static bench b;
    dataset_options o = {480, 270, 16, 0, 1};
    if (quick)
        o.width = 240, o.height = 135, o.strata = 8;
    list_methods(&b, quick);
    pool *threads = pool_create(cli_processors());
    bool ok = threads != NULL;
    for (int i = 0; i < bench_scene_count() && i < MOST_SCENES && ok; ++i) {
        dataset *d = &b.data[i];
        double start = wall_seconds();
        ok = dataset_open(d, i, &o, threads);
        if (!ok)
            break;
        ++b.scenes;
        double rendered = wall_seconds();
        if (!b.scratch) {
            b.scratch = malloc(rival_scratch_floats(&d->view) * sizeof *b.scratch);
            b.work = malloc(view_pixels(&d->view) * sizeof *b.work);
        }
        b.results[i] = calloc((size_t)b.count, sizeof *b.results[i]);
        ok = b.scratch && b.work && b.results[i] && run_scene(&b, d, b.results[i], quick);
        printf("  %-10s data %5.1f s, %d methods %5.1f s\n", d->scene.name, rendered - start, b.count,
               wall_seconds() - rendered);
        fflush(stdout);
    }
    if (ok) {
        double start = wall_seconds();
        fit_outputs(&b);
        ok = write_csv(&b, threads) && write_noise(&b, o.strata) && write_crops(&b);
        printf("  errors %.1f s\n", wall_seconds() - start);
    }
    for (int s = 0; s < b.scenes; ++s) {
        for (int k = 0; k < b.count && b.results[s]; ++k)
            free(b.results[s][k].raw);
        free(b.results[s]);
        dataset_close(&b.data[s]);
    }
    free(b.scratch);
    free(b.work);
    free(b.library);
    pool_destroy(threads);
    return ok;
}
