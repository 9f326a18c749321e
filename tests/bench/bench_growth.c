/* bench_growth - what the time of gtao.h is made of, and how it grows.
 *
 *     build/bench_growth [--quick] DIRECTORY
 *
 * Writes build/bench/growth.csv and the tables cost-stages.md, cost-model.md, growth-radius.md, growth-settings.md and
 * growth-threads.md into DIRECTORY. One thread and its processor time, medians of interleaved runs, unless a table says
 * otherwise.
 *
 * The model: gtao_visibility_rows takes a + slices (b + c samples) ns a pixel, `samples` as counted by gtao_stats, a
 * slice and pixel. a, b, c by least squares of the relative error over a grid of settings. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "dataset.h"
#include "examples/common/cli.h"
#include "picture.h"

static FILE *csv;
static const char *directory;
static pool *render; /* what scenes are rendered by */

static void point(const char *group, const char *what, double x, double y) {
    fprintf(csv, "%s,%s,%.6g,%.6g\n", group, what, x, y);
}

static double process_seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* ---- the model --------------------------------------------------------------------------------------------------- */

typedef struct model {
    double a, b, c;
    double rms, most; /* relative residuals */
} model;

/* Least squares of (f(x) - y) / y over a + b u + c v, by Cramer's rule. */
static model fit(const double *slices, const double *samples, const double *ns, int count) {
    double m[3][3] = {{0}}, r[3] = {0};
    model f = {0, 0, 0, 0, 0};
    for (int k = 0; k < count; ++k) {
        double x[3] = {1 / ns[k], slices[k] / ns[k], slices[k] * samples[k] / ns[k]};
        for (int i = 0; i < 3; ++i) {
            r[i] += x[i];
            for (int j = 0; j < 3; ++j)
                m[i][j] += x[i] * x[j];
        }
    }
#define DET(a, b, c)                                                                                                   \
    (a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0]))
    double d = DET(m[0], m[1], m[2]); /* symmetric: rows are columns */
    f.a = DET(r, m[1], m[2]) / d, f.b = DET(m[0], r, m[2]) / d, f.c = DET(m[0], m[1], r) / d;
#undef DET
    for (int k = 0; k < count; ++k) {
        double e = (f.a + slices[k] * (f.b + f.c * samples[k])) / ns[k] - 1;
        f.rms += e * e / count;
        f.most = fmax(f.most, fabs(e));
    }
    f.rms = sqrt(f.rms);
    return f;
}

/* Both sides. */
static double samples_a_slice(const job *j) {
    return samples_a_pixel(j) / gtao_desc_slices(&j->desc);
}

/* A setting with other slices and samples: steps of 4 to 32, in every-pixel mode radii of 12 to 100 pixels. */
enum { GRID = 12 };

static void grid(const job *setting, job *jobs) {
    static const int slices[] = {1, 2, 4}, steps[] = {4, 8, 16, 32}, caps[] = {12, 25, 50, 100};
    for (int k = 0; k < GRID; ++k) {
        jobs[k] = *setting;
        jobs[k].desc.slices = slices[k / 4];
        if (setting->desc.every_pixel)
            jobs[k].desc.max_radius_px = caps[k % 4];
        else
            jobs[k].desc.steps = steps[k % 4];
    }
}

/* Three for a job: the stages one after the other. */
static void stages_of(job *j, timed *t) {
    t[0] = (timed){run_begin, j, 0};
    t[1] = (timed){run_prepare, j, 0};
    t[2] = (timed){run_visibility, j, 0};
}

static model fit_grid(const job *jobs, const timed *t) {
    double s[GRID], m[GRID], ns[GRID];
    for (int k = 0; k < GRID; ++k) {
        s[k] = jobs[k].desc.slices, m[k] = samples_a_slice(&jobs[k]);
        ns[k] = ns_a_pixel(&t[3 * k + 2], jobs[k].picture);
    }
    return fit(s, m, ns, GRID);
}

/* What settings change of the memo's: all that the model's coefficients depend on. */
enum { VARIANTS = 12, SCENES = 6 };
static const struct {
    const char *name;
    gtao_isa isa; /* AUTO: the best one */
} variants[VARIANTS] = {{"falloff 0.25 (the memo's)", GTAO_ISA_AUTO},
                        {"hard cutoff", GTAO_ISA_AUTO},
                        {"bent normals", GTAO_ISA_AUTO},
                        {"harmonics, 9", GTAO_ISA_AUTO},
                        {"normals derived from depth", GTAO_ISA_AUTO},
                        {"thickness", GTAO_ISA_AUTO},
                        {"estimator of the memo", GTAO_ISA_AUTO},
                        {"hilbert noise", GTAO_ISA_AUTO},
                        {"every pixel", GTAO_ISA_AUTO},
                        {"avx2", GTAO_ISA_AVX2},
                        {"sse2", GTAO_ISA_SSE2},
                        {"scalar", GTAO_ISA_SCALAR}};
enum { PLAIN, HARD, BENT, HARMONICS, DERIVED, THICK, MEMO, HILBERT, EVERY };

static job variant(const picture *p, int k, float *sh) {
    job j = production(p);
    j.desc.isa = variants[k].isa;
    if (k == HARD)
        j.desc.falloff = 0;
    if (k == BENT)
        j.output.bent_normals = p->bent;
    if (k == HARMONICS)
        j.output.sh = sh;
    if (k == DERIVED)
        j.desc.normals = NULL;
    if (k == THICK)
        j.desc.thickness = 0.3f * j.desc.radius;
    if (k == MEMO)
        j.desc.estimator = GTAO_ESTIMATOR_MEMO;
    if (k == HILBERT)
        j.desc.noise = GTAO_NOISE_HILBERT;
    j.desc.every_pixel = k == EVERY;
    return j;
}

static void model_row(FILE *to, const char *scene, const char *what, const model *f) {
    fprintf(to, "| %s | %s | %.2f | %.2f | %.3f | %.1f %% | %.1f %% |\n", scene, what, f->a, f->b, f->c, 100 * f->rms,
            100 * f->most);
}

static const struct {
    const char *name;
    int slices; /* 0: the preset's */
    gtao_preset preset;
    int variant;                                 /* its model */
} listed[] = {{NULL, 1, GTAO_PRESET_LOW, PLAIN}, /* not counted: it brings the picture back into the caches */
              {"1 x 8, the memo's", 1, GTAO_PRESET_LOW, PLAIN},
              {"low: 1 x 8, hard cutoff", 0, GTAO_PRESET_LOW, HARD},
              {"medium: 2 x 12", 0, GTAO_PRESET_MEDIUM, HARD},
              {"high: 4 x 16", 0, GTAO_PRESET_HIGH, HARD},
              {"ultra: 8 x 32", 0, GTAO_PRESET_ULTRA, HARD},
              {"reference: 32 x every pixel, falloff 0.25", 0, GTAO_PRESET_REFERENCE, EVERY},
              {"1 x every pixel", 1, GTAO_PRESET_LOW, EVERY},
              {"1 x 8, bent normals", 1, GTAO_PRESET_LOW, BENT},
              {"1 x 8, harmonics", 1, GTAO_PRESET_LOW, HARMONICS},
              {"1 x 8, derived normals", 1, GTAO_PRESET_LOW, DERIVED},
              {"1 x 8, thickness", 1, GTAO_PRESET_LOW, THICK},
              {"1 x 8, estimator of the memo", 1, GTAO_PRESET_LOW, MEMO}};
enum { LISTED = sizeof listed / sizeof *listed };

/* Everything interleaved in one measurement, so that the model and what it is compared with saw the same machine. */
static void models(const picture *p, model *out, float *sh, int repeat) {
    static job jobs[VARIANTS * GRID + LISTED];
    static timed t[3 * (VARIANTS * GRID + LISTED)];
    FILE *to = table_open(directory, "cost-model");
    fprintf(to, "| scene | setting | a: a pixel | b: a slice | c: a sample | residuals: root mean square | largest |\n"
                "|---|---|--:|--:|--:|--:|--:|\n");
    for (int k = 0; k < VARIANTS; ++k) {
        job j = variant(p, k, sh);
        if (!gtao_isa_available(j.desc.isa))
            j.desc.isa = GTAO_ISA_AUTO; /* not printed */
        grid(&j, jobs + k * GRID);
    }
    for (int k = 0; k < LISTED; ++k) {
        job *j = &jobs[VARIANTS * GRID + k];
        *j = variant(p, listed[k].variant, sh);
        j->desc.preset = listed[k].preset;
        if (!listed[k].slices)
            j->desc.slices = j->desc.steps = 0;
    }
    for (int k = 0; k < VARIANTS * GRID + LISTED; ++k)
        stages_of(&jobs[k], t + 3 * k);
    measure(t, 3 * (VARIANTS * GRID + LISTED), repeat, thread_seconds);
    for (int k = 0; k < VARIANTS; ++k) {
        out[k] = fit_grid(jobs + k * GRID, t + 3 * k * GRID);
        if (gtao_isa_available(variants[k].isa))
            model_row(to, p->name, variants[k].name, &out[k]);
    }
    for (int k = 0; k < SCENES; ++k) {
        static const char *const scenes[SCENES] = {"stairs", "columns", "foliage", "terrain", "far", "village"};
        job few[GRID];
        timed times[3 * GRID];
        picture q;
        if (!picture_open(&q, scenes[k], p->view.width, p->view.height, render))
            exit(1);
        job j = production(&q);
        grid(&j, few);
        for (int i = 0; i < GRID; ++i)
            stages_of(&few[i], times + 3 * i);
        measure(times, 3 * GRID, repeat, thread_seconds);
        model f = fit_grid(few, times);
        model_row(to, q.name, variants[PLAIN].name, &f);
        picture_close(&q);
    }
    fclose(to);
    to = table_open(directory, "cost-stages");
    fprintf(to, "| setting | begin: ms | prepare: ns a pixel | visibility: ns a pixel | by the model: a pixel's own | "
                "its slices' | its samples' | sum | against measured |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (int k = 1; k < LISTED; ++k) {
        const model *m = &out[listed[k].variant];
        const job *j = &jobs[VARIANTS * GRID + k];
        const timed *of = t + 3 * (VARIANTS * GRID + k);
        double ns = ns_a_pixel(&of[2], p), slices = m->b * gtao_desc_slices(&j->desc);
        double samples = m->c * samples_a_pixel(j), sum = m->a + slices + samples;
        fprintf(to,
                "| %s | %.2f | %.2f | %.1f | %.1f (%.0f %%) | %.1f (%.0f %%) | %.1f (%.0f %%) | %.1f | %+.0f %% |\n",
                listed[k].name, 1e3 * of[0].seconds, ns_a_pixel(&of[1], p), ns, m->a, 100 * m->a / sum, slices,
                100 * slices / sum, samples, 100 * samples / sum, sum, 100 * (sum / ns - 1));
    }
    fclose(to);
}

/* ---- growth ------------------------------------------------------------------------------------------------------ */

/* The radius without a cap, so many pixels on average. */
static void radii(const picture *p, int repeat) {
    static const int steps[] = {8, 16, 64, 0};
    enum { RADII = 8, KINDS = 4, N = RADII * KINDS };
    job jobs[N];
    timed t[N];
    double all = radius_px(p, 1e30);
    FILE *to = table_open(directory, "growth-radius");
    for (int k = 0; k < N; ++k) {
        jobs[k] = production(p);
        jobs[k].desc.max_radius_px = 0;
        jobs[k].desc.radius = (float)((double)p->view.radius * (8 << k / KINDS) / all);
        jobs[k].desc.steps = steps[k % KINDS];
        jobs[k].desc.every_pixel = !steps[k % KINDS];
        t[k] = (timed){run_library, &jobs[k], 0};
    }
    measure(t, N, repeat, thread_seconds);
    fprintf(to, "| radius, pixels |");
    for (int r = 0; r < RADII; ++r)
        fprintf(to, " %d |", 8 << r);
    fprintf(to, "\n|---|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (int k = 0; k < KINDS; ++k) {
        char name[64];
        snprintf(name, sizeof name, steps[k] ? "%d samples a side" : "every pixel", steps[k]);
        fprintf(to, "| %s: ns a pixel |", name);
        for (int r = 0; r < RADII; ++r) {
            double ns = ns_a_pixel(&t[r * KINDS + k], p);
            fprintf(to, ns < 100 ? " %.1f |" : " %.0f |", ns);
            point("radius", name, 8 << r, ns);
        }
        fprintf(to, "\n| samples a pixel |");
        for (int r = 0; r < RADII; ++r)
            fprintf(to, " %.0f |", samples_a_pixel(&jobs[r * KINDS + k]));
        fprintf(to, "\n");
    }
    fclose(to);
}

static void settings(picture *p, const model *f, int repeat) {
    static const int steps[] = {4, 8, 16, 32, 64, 128, 256}, slices[] = {1, 2, 4, 8, 16, 32};
    enum { STEPS = 7, SLICES = 6, N = STEPS * SLICES };
    job jobs[N];
    timed all[N + 1], *t = all + 1; /* the first is not counted: it brings the picture back into the caches */
    double samples[STEPS], square = 0;
    FILE *to = table_open(directory, "growth-settings");
    for (int k = 0; k < N; ++k) {
        jobs[k] = production(p);
        jobs[k].desc.slices = slices[k / STEPS];
        jobs[k].desc.steps = steps[k % STEPS];
        picture_reserve(p, &jobs[k].desc);
        t[k] = (timed){run_library, &jobs[k], 0};
        if (k < STEPS)
            samples[k] = samples_a_pixel(&jobs[k]);
    }
    all[0] = (timed){run_library, &jobs[1], 0};
    measure(all, N + 1, repeat, thread_seconds);
    fprintf(to, "| samples a side |");
    for (int s = 0; s < STEPS; ++s)
        fprintf(to, " %d |", steps[s]);
    fprintf(to, "\n|---|--:|--:|--:|--:|--:|--:|--:|\n| counted, both sides |");
    for (int s = 0; s < STEPS; ++s)
        fprintf(to, " %.0f |", samples[s]);
    for (int i = 0; i < SLICES; ++i) {
        fprintf(to, "\n| %d slice%s |", slices[i], i ? "s" : "");
        for (int s = 0; s < STEPS; ++s) {
            char name[64];
            double ns = ns_a_pixel(&t[i * STEPS + s], p), guess = f->a + slices[i] * (f->b + f->c * samples[s]);
            fprintf(to, ns < 100 ? " %.1f |" : " %.0f |", ns);
            snprintf(name, sizeof name, "%d slices", slices[i]);
            point("settings", name, steps[s], ns);
            snprintf(name, sizeof name, "model %d slices", slices[i]);
            point("settings", name, steps[s], guess);
            square += (guess / ns - 1) * (guess / ns - 1) / N;
        }
    }
    fprintf(to,
            "\n\nThe model, fitted to 4 to 32 samples and 1 to 4 slices, without begin and prepare: %.0f %% off "
            "(root mean square) over this table.\n",
            100 * sqrt(square));
    fclose(to);
}

/* Wall time on two threads, and the processor time of both. */
static void threads_and_chunks(int repeat) {
    static const struct {
        const char *scene, *name;
        int width;
        gtao_preset preset;
    } work[] = {{"furniture", "furniture 960x540 low", 960, GTAO_PRESET_LOW},
                {"furniture", "furniture 1920x1080 high", 1920, GTAO_PRESET_HIGH},
                {"village", "village 1920x1080 low", 1920, GTAO_PRESET_LOW},
                {"village", "village 1920x1080 high", 1920, GTAO_PRESET_HIGH}};
    static const int chunks[] = {8, 16, 32, 64, 128, 0}; /* 0: halves */
    enum { CHUNKS = 6, N = CHUNKS + 1 };
    int most = cli_processors() < 2 ? 1 : 2;
    double best = 0;
    FILE *to = table_open(directory, "growth-threads");
    fprintf(to, "| scene, image, preset | one thread: ns a pixel | %d threads, rows at a time:", most);
    for (int c = 0; c + 1 < CHUNKS; ++c)
        fprintf(to, " %d |", chunks[c]);
    fprintf(to, " halves |\n|---|--:|--:|--:|--:|--:|--:|--:|\n");
    for (size_t w = 0; w < sizeof work / sizeof *work; ++w) {
        picture p;
        job jobs[N];
        timed t[N];
        double wall[N];
        pool *one = pool_create(1), *two = pool_create(most);
        if (!one || !two || !picture_open(&p, work[w].scene, work[w].width, work[w].width * 9 / 16, render))
            exit(1);
        for (int k = 0; k < N; ++k) {
            jobs[k] = production(&p);
            jobs[k].desc.preset = work[w].preset, jobs[k].desc.slices = jobs[k].desc.steps = 0;
            jobs[k].threads = k ? two : one;
            jobs[k].chunk = k == 0 ? 16 : chunks[k - 1] ? chunks[k - 1] : ((p.view.height + 1) / 2 + 15) / 16 * 16;
            t[k] = (timed){run_threads, &jobs[k], 0};
        }
        measure(t, N, repeat, wall_seconds);
        for (int k = 0; k < N; ++k)
            wall[k] = t[k].seconds;
        measure(t, N, repeat, process_seconds);
        fprintf(to, "| %s: times as fast | %.1f |", work[w].name, 1e9 * wall[0] / (double)view_pixels(&p.view));
        for (int k = 1; k < N; ++k) {
            fprintf(to, " %.2f |", wall[0] / wall[k]);
            best = fmax(best, wall[0] / wall[k]);
            point("chunks", work[w].name, jobs[k].chunk, wall[0] / wall[k]);
        }
        fprintf(to, "\n| processor time of both, ns a pixel | %.1f |",
                1e9 * t[0].seconds / (double)view_pixels(&p.view));
        for (int k = 1; k < N; ++k)
            fprintf(to, " %.1f |", 1e9 * t[k].seconds / (double)view_pixels(&p.view));
        fprintf(to, "\n");
        pool_destroy(one), pool_destroy(two);
        picture_close(&p);
    }
    if (most > 1 && best < 1.5)
        fprintf(to, "\n*Not to be relied on: other work had the second processor.*\n");
    fclose(to);
}

int main(int argc, char **argv) {
    bool quick = argc == 3 && strcmp(argv[1], "--quick") == 0;
    if (argc != 2 + quick) {
        fprintf(stderr, "usage: bench_growth [--quick] DIRECTORY\n");
        return 2;
    }
    directory = argv[argc - 1];
    double start = wall_seconds();
    picture p;
    model f[VARIANTS];
    pool *threads = pool_create(cli_processors());
    if (!threads || !make_folders("build/bench") || !make_folders(directory) ||
        !(csv = fopen("build/bench/growth.csv", "w")) ||
        !picture_open(&p, "furniture", PICTURE_WIDTH / (1 + quick), PICTURE_HEIGHT / (1 + quick), threads))
        return 1;
    fprintf(csv, "group,what,x,y\n");
    float *sh = calloc(9 * view_pixels(&p.view), sizeof *sh);
    if (!sh)
        return 1;
    render = threads;
    models(&p, f, sh, quick ? 1 : 3);
    printf("  model: %.0f s\n", wall_seconds() - start);
    settings(&p, &f[PLAIN], quick ? 1 : 2);
    free(sh);
    picture_close(&p);
    if (!picture_open(&p, "stairs", quick ? 480 : 1920, quick ? 270 : 1080, threads))
        return 1;
    printf("  slices and samples: %.0f s\n", wall_seconds() - start);
    radii(&p, quick ? 1 : 2);
    picture_close(&p);
    printf("  radii: %.0f s\n", wall_seconds() - start);
    threads_and_chunks(quick ? 3 : 7);
    pool_destroy(threads);
    printf("%.0f s\n", wall_seconds() - start);
    return fclose(csv) == 0 ? 0 : 1;
}
