/* bench_effort - error against time of effort by need (gtao_desc.error_target) beside the same effort everywhere.
 *
 *     build/bench_effort [--quick] [--size WIDTHxHEIGHT]
 *
 * Writes build/bench/effort.csv and prints tables. Errors are to 64 slices of every pixel of the same depth buffer,
 * root mean squares over the pixels with a surface, scenes pooled with equal weight. Times are processor time of one
 * thread, medians of interleaved runs, ns per pixel: `all` is gtao_compute; `rows` the same without gtao_begin and
 * gtao_refine_begin, whose tables cost less the larger the image is. Uniform effort at equal error: interpolated along
 * the front of all uniform settings. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dataset.h"
#include "examples/common/pool.h"
#include "gtao.h"
#include "measure.h"

enum { SCENES = 10, MOST = 48 };

static const struct {
    int slices, steps;
} uniform[] = {{1, 4},  {1, 8},  {1, 16}, {2, 6},   {2, 8},   {2, 12},  {2, 16},  {2, 24},  {3, 12}, {3, 16},
               {3, 24}, {3, 32}, {4, 16}, {4, 24},  {4, 32},  {4, 48},  {6, 24},  {6, 32},  {6, 48}, {6, 64},
               {8, 32}, {8, 48}, {8, 64}, {12, 48}, {12, 64}, {16, 48}, {16, 64}, {24, 48}, {24, 64}};
static const float targets[] = {1.0f, 0.06f, 0.05f, 0.04f, 0.035f, 0.03f, 0.025f, 0.022f, 0.02f};
enum { UNIFORM = sizeof uniform / sizeof *uniform, TARGETS = sizeof targets / sizeof *targets };

typedef struct job {
    gtao_desc desc;
    gtao_output output;
    void *scratch;
    size_t size;
    gtao_context *context;
    gtao_stats stats;
} job;

static void run(void *user) {
    job *j = user;
    memset(&j->stats, 0, sizeof j->stats);
    if (gtao_compute(&j->desc, &j->output, j->scratch, j->size, &j->stats) != GTAO_OK)
        fprintf(stderr, "bench_effort: failed\n"), exit(1);
}

static void begin(void *user) {
    job *j = user;
    if (gtao_begin(&j->desc, &j->output, j->scratch, j->size, &j->context) != GTAO_OK)
        fprintf(stderr, "bench_effort: failed\n"), exit(1);
}

/* The plan and its tables once more, after `run`. */
static void plan(void *user) {
    gtao_refine_begin(((job *)user)->context, 0);
}

typedef struct row {
    char name[32];
    double rmse[SCENES], all[SCENES], rows[SCENES], refined[SCENES], samples[SCENES];
    double pooled, all_mean, rows_mean, refined_mean, samples_mean;
} row;

static void pool_row(row *r, int scenes) {
    r->pooled = r->all_mean = r->rows_mean = r->refined_mean = r->samples_mean = 0;
    for (int i = 0; i < scenes; ++i) {
        r->pooled += r->rmse[i] * r->rmse[i] / scenes;
        r->all_mean += r->all[i] / scenes, r->rows_mean += r->rows[i] / scenes;
        r->refined_mean += r->refined[i] / scenes, r->samples_mean += r->samples[i] / scenes;
    }
    r->pooled = sqrt(r->pooled);
}

/* Time of uniform effort at this error, along the front of its settings, of a scene or (-1) pooled; 0 where the front
 * does not reach. `rows`: without tables. */
static double at_error(const row *r, int count, double error, int scene, bool rows) {
    double best = 0;
    for (int a = 0; a < count; ++a)
        for (int b = 0; b < count; ++b) { /* any two settings on both sides: the front is the least of all */
            double ea = scene < 0 ? r[a].pooled : r[a].rmse[scene], eb = scene < 0 ? r[b].pooled : r[b].rmse[scene];
            double ta = scene >= 0 ? r[a].rows[scene] : rows ? r[a].rows_mean : r[a].all_mean;
            double tb = scene >= 0 ? r[b].rows[scene] : rows ? r[b].rows_mean : r[b].all_mean;
            if (ea < error || eb > error || tb < ta)
                continue;
            double u = ea > eb ? log(ea / error) / log(ea / eb) : 1, t = exp(log(ta) + u * (log(tb) - log(ta)));
            best = best == 0 || t < best ? t : best;
        }
    return best;
}

int main(int argc, char **argv) {
    dataset_options o = {480, 270, 16, 0, 1};
    bool quick = false;
    for (int i = 1; i < argc; ++i) {
        if (strcmp(argv[i], "--quick") == 0)
            quick = true;
        else if (!(strcmp(argv[i], "--size") == 0 && i + 1 < argc &&
                   sscanf(argv[i + 1], "%dx%d", &o.width, &o.height) == 2 && o.width > 0 && o.height > 0 &&
                   o.width <= 4096 && o.height <= 4096 && ++i)) {
            fprintf(stderr, "usage: bench_effort [--quick] [--size WIDTHxHEIGHT]\n");
            return 2;
        }
    }
    if (quick)
        o.width = 240, o.height = 135;
    int scenes = bench_scene_count() < SCENES ? bench_scene_count() : SCENES;
    const char *names[SCENES];
    static row rows[UNIFORM + TARGETS];
    static job jobs[UNIFORM + TARGETS];
    static timed list[UNIFORM + TARGETS];
    pool *threads = pool_create(1);
    FILE *csv;
    if (!threads || !make_folders("build/bench") || !(csv = fopen("build/bench/effort.csv", "w"))) {
        fprintf(stderr, "bench_effort: cannot write build/bench/effort.csv\n");
        return 1;
    }
    for (int i = 0; i < scenes; ++i) {
        dataset d;
        if (!dataset_open(&d, i, &o, threads))
            return 1;
        names[i] = bench_scene_name(i);
        size_t n = view_pixels(&d.view);
        float *truth = malloc(n * sizeof *truth), *v = malloc(n * sizeof *v);
        size_t most = 0;
        job reference = {view_describe(&d.view), {0}, NULL, 0, NULL, {0}};
        reference.desc.slices = 64, reference.desc.every_pixel = 1, reference.output.visibility = truth;
        most = reference.size = gtao_scratch_size(&reference.desc);
        for (int k = 0; k < UNIFORM + TARGETS; ++k) {
            jobs[k].desc = view_describe(&d.view), jobs[k].output.visibility = v;
            if (k < UNIFORM) {
                jobs[k].desc.slices = uniform[k].slices, jobs[k].desc.steps = uniform[k].steps;
                snprintf(rows[k].name, sizeof rows[k].name, "%dx%d", uniform[k].slices, uniform[k].steps);
            } else {
                jobs[k].desc.error_target = targets[k - UNIFORM];
                snprintf(rows[k].name, sizeof rows[k].name, "target %g", (double)targets[k - UNIFORM]);
            }
            jobs[k].size = gtao_scratch_size(&jobs[k].desc);
            most = jobs[k].size > most ? jobs[k].size : most;
        }
        void *scratch = malloc(most);
        if (!truth || !v || !scratch) {
            fprintf(stderr, "bench_effort: out of memory\n");
            return 1;
        }
        reference.scratch = scratch;
        run(&reference);
        for (int k = 0; k < UNIFORM + TARGETS; ++k) {
            jobs[k].scratch = scratch;
            run(&jobs[k]);
            rows[k].rmse[i] = image_distance(&d.view, v, truth).rmse;
            rows[k].refined[i] = (double)jobs[k].stats.refined / (double)n;
            rows[k].samples[i] = (double)jobs[k].stats.samples / (double)n;
            list[k].run = run, list[k].user = &jobs[k];
        }
        measure(list, UNIFORM + TARGETS, quick ? 3 : 7, thread_seconds);
        for (int k = 0; k < UNIFORM + TARGETS; ++k)
            rows[k].all[i] = list[k].seconds * 1e9 / (double)n, list[k].run = begin;
        measure(list, UNIFORM + TARGETS, quick ? 3 : 7, thread_seconds);
        for (int k = 0; k < UNIFORM + TARGETS; ++k)
            rows[k].rows[i] = rows[k].all[i] - list[k].seconds * 1e9 / (double)n;
        for (int k = UNIFORM; k < UNIFORM + TARGETS; ++k) {
            timed one = {plan, &jobs[k], 0};
            begin(&jobs[k]), run(&jobs[k]); /* the context lies at the same place */
            measure(&one, 1, 5, thread_seconds);
            rows[k].rows[i] -= one.seconds * 1e9 / (double)n;
        }
        free(scratch), free(truth), free(v);
        dataset_close(&d);
    }
    fprintf(csv, "setting,scene,rmse,ns_all,ns_rows,refined,samples\n");
    for (int k = 0; k < UNIFORM + TARGETS; ++k) {
        pool_row(&rows[k], scenes);
        for (int i = 0; i < scenes; ++i)
            fprintf(csv, "%s,%s,%.5f,%.2f,%.2f,%.4f,%.1f\n", rows[k].name, names[i], rows[k].rmse[i], rows[k].all[i],
                    rows[k].rows[i], rows[k].refined[i], rows[k].samples[i]);
        fprintf(csv, "%s,pooled,%.5f,%.2f,%.2f,%.4f,%.1f\n", rows[k].name, rows[k].pooled, rows[k].all_mean,
                rows[k].rows_mean, rows[k].refined_mean, rows[k].samples_mean);
    }
    if (fclose(csv) != 0) {
        fprintf(stderr, "bench_effort: cannot write build/bench/effort.csv\n");
        return 1;
    }
    printf("| target | RMSE | tiles refined | samples a pixel | ns a pixel: all | uniform effort, same RMSE | times | "
           "without "
           "tables: ns | uniform | times |\n|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (int k = UNIFORM; k < UNIFORM + TARGETS; ++k) {
        const row *r = &rows[k];
        double all = at_error(rows, UNIFORM, r->pooled, -1, false);
        double part = at_error(rows, UNIFORM, r->pooled, -1, true);
        printf("| %s | %.4f | %.0f %% | %.0f | %.1f | %.1f | %.2f | %.1f | %.1f | %.2f |\n",
               k == UNIFORM ? "none: sharing alone" : r->name + 7, r->pooled, 100 * r->refined_mean, r->samples_mean,
               r->all_mean, all, all / r->all_mean, r->rows_mean, part, part / r->rows_mean);
    }
    printf("\n| target |");
    for (int i = 0; i < scenes; ++i)
        printf(" %s |", names[i]);
    printf("\n|--:|");
    for (int i = 0; i < scenes; ++i)
        printf("--:|");
    for (int k = UNIFORM; k < UNIFORM + TARGETS; ++k) {
        printf("\n| %s |", k == UNIFORM ? "none" : rows[k].name + 7);
        for (int i = 0; i < scenes; ++i) {
            double uniform_time = at_error(rows, UNIFORM, rows[k].rmse[i], i, true);
            if (uniform_time > 0)
                printf(" %.4f (%.1f) |", rows[k].rmse[i], uniform_time / rows[k].rows[i]);
            else /* out of their reach */
                printf(" %.4f (-) |", rows[k].rmse[i]);
        }
    }
    printf("\n");
    pool_destroy(threads);
    return 0;
}
