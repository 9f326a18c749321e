/* bench_rivals - runs every rival on every scene and prints time and error, to see that each does what its source says.
 *
 *     build/bench_rivals [--size WIDTHxHEIGHT] [--rays N] [--threads N] [--repeat N] [--only TEXT] [SCENE...]
 *
 * Times are of one thread, medians over --repeat (3), method and denoiser together. For each method and preset the
 * output function (b (AO + a))^c is fitted over the pixels of all scenes, once to each truth; the first two columns of
 * errors are without that, as published. --only: methods with this in their name. Writes
 * build/bench/rivals.csv and a sheet of pictures per scene, build/bench/rivals/NAME.png. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "dataset.h"
#include "examples/common/canvas.h"
#include "rivals/rivals.h"
#include "trace.h"

enum { MOST_METHODS = 64, MOST_SCENES = 16 };

typedef struct method {
    char name[48];
    const rival *rival; /* null: ray tracing or voxels */
    const rival_preset *preset;
    int rays, cones;
    bool denoised; /* ray tracing through rival_blur */
    rival_output fit_rays, fit_view;
} method;

typedef struct result {
    float *raw; /* before any output function */
    double ns, extra_ms;
} result;

static double seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int list_methods(method *m, const char *only) {
    static const int rays[] = {1, 4, 16, 64, 256};
    int n = 0;
    memset(m, 0, MOST_METHODS * sizeof *m);
    for (int i = 0; rivals[i]; ++i)
        for (int k = 0; k < rivals[i]->presets; ++k, ++n) {
            m[n].rival = rivals[i], m[n].preset = &rivals[i]->preset[k];
            snprintf(m[n].name, sizeof m[n].name, "%s %s", rivals[i]->name, m[n].preset->name);
        }
    for (int cones = 6; cones <= 16; cones += 10, ++n) {
        m[n].cones = cones;
        snprintf(m[n].name, sizeof m[n].name, "voxels %d cones", cones);
    }
    for (int denoised = 0; denoised < 2; ++denoised)
        for (size_t k = 0; k < sizeof rays / sizeof *rays; ++k, ++n) {
            m[n].rays = rays[k], m[n].denoised = denoised;
            snprintf(m[n].name, sizeof m[n].name, "rays %d%s", rays[k], denoised ? " denoised" : "");
        }
    int kept = 0;
    for (int k = 0; k < n; ++k)
        if (strstr(m[k].name, only))
            m[kept++] = m[k];
    return kept;
}

static int compare_doubles(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static bool measure(const dataset *d, const trace *t, const voxel_grid *g, const method *m, int repeat, float *scratch,
                    result *r) {
    double times[64];
    r->raw = malloc(view_pixels(&d->view) * sizeof(float));
    if (!r->raw)
        return false;
    repeat = repeat < 1 ? 1 : repeat > 64 ? 64 : repeat;
    for (int k = 0; k < repeat; ++k) {
        double start = seconds();
        if (m->rival) {
            m->rival->run(&d->view, m->preset, scratch, r->raw);
            if (m->rival->denoise && m->preset->blur)
                m->rival->denoise(&d->view, m->preset, scratch, r->raw);
        } else if (m->cones) {
            voxel_visibility(g, &d->view, m->cones, r->raw);
        } else {
            trace_few_rows(t, &d->view, m->rays, r->raw, 0, d->view.height);
            if (m->denoised)
                rival_blur(&d->view, 3, scratch, r->raw);
        }
        times[k] = seconds() - start;
    }
    qsort(times, (size_t)repeat, sizeof *times, compare_doubles);
    r->ns = 1e9 * times[repeat / 2] / (double)view_pixels(&d->view);
    return true;
}

/* Ray tracing estimates the truth itself; everything else has an output function. */
static void finish(const dataset *d, const method *m, const rival_output *o, const float *raw, float *out) {
    memcpy(out, raw, view_pixels(&d->view) * sizeof *out);
    if (!m->rays)
        rival_apply_output(&d->view, o, out);
}

static bool draw_cell(image *sheet, int cell, const dataset *d, const float *visibility, const char *label) {
    image picture;
    image_error error;
    int w = d->view.width, h = d->view.height, x = (cell % 4) * w, y = (cell / 4) * (h + 16);
    if (!image_create(&picture, w, h, 3, &error))
        return false;
    for (size_t i = 0; i < view_pixels(&d->view); ++i)
        for (size_t c = 0; c < 3; ++c)
            picture.data[3 * i + c] = visibility[i];
    canvas_draw(sheet, x, y + 16, &picture);
    canvas_text(sheet, (float)x + 4, (float)y + 12, CANVAS_LEFT, CANVAS_REGULAR, 12, color_hex(0xffffff), label);
    image_free(&picture);
    return true;
}

static bool write_sheet(const dataset *d, const method *methods, int count, const result *results, float *work) {
    char label[128], path[256];
    image sheet;
    image_error error;
    image_pending file;
    int cells = 2;
    memset(&file, 0, sizeof file);
    for (int m = 0; m < count; ++m)
        cells +=
            !methods[m].rival || methods[m].preset == methods[m].rival->preset || methods[m].rival == &rival_gtao_memo;
    if (!image_create(&sheet, 4 * d->view.width, (cells + 3) / 4 * (d->view.height + 16), 3, &error)) {
        fprintf(stderr, "%s\n", error.text);
        return false;
    }
    bool ok = draw_cell(&sheet, 0, d, d->truth_rays, "truth: rays") &&
              draw_cell(&sheet, 1, d, d->truth_view, "truth: depth buffer");
    for (int m = 0, cell = 2; ok && m < count; ++m) {
        const method *q = &methods[m];
        if (q->rival && q->preset != q->rival->preset && q->rival != &rival_gtao_memo)
            continue;
        finish(d, q, &q->fit_rays, results[m].raw, work);
        snprintf(label, sizeof label, "%.47s: %.0f ns, rmse %.3f", q->name, results[m].ns,
                 dataset_compare(d, work, d->truth_rays).rmse);
        ok = draw_cell(&sheet, cell++, d, work, label);
    }
    snprintf(path, sizeof path, "build/bench/rivals/%s.png", d->scene.name);
    ok = ok && image_write(path, &sheet, NULL, IMAGE_RANGE_UNIT, &file, &error) && image_commit(&file, &error);
    if (!ok)
        fprintf(stderr, "%s: not written\n", path);
    image_discard(&file);
    image_free(&sheet);
    return ok;
}

static int usage(void) {
    fprintf(
        stderr,
        "usage: bench_rivals [--size WIDTHxHEIGHT] [--rays N] [--threads N] [--repeat N] [--only TEXT] [SCENE...]\n");
    return 2;
}

int main(int argc, char **argv) {
    dataset_options o = {480, 270, 16, 0, 1};
    int rays = 256, threads = (int)sysconf(_SC_NPROCESSORS_ONLN), repeat = 3, first = 1, status = 1;
    const char *only = "";
    for (; first + 1 < argc && strncmp(argv[first], "--", 2) == 0; first += 2) {
        const char *name = argv[first], *value = argv[first + 1];
        bool ok = strcmp(name, "--size") == 0      ? sscanf(value, "%dx%d", &o.width, &o.height) == 2
                  : strcmp(name, "--rays") == 0    ? sscanf(value, "%d", &rays) == 1
                  : strcmp(name, "--threads") == 0 ? sscanf(value, "%d", &threads) == 1
                  : strcmp(name, "--only") == 0    ? (only = value, true)
                  : strcmp(name, "--repeat") == 0  ? sscanf(value, "%d", &repeat) == 1
                                                   : false;
        if (!ok)
            return usage();
    }
    if (!bench_scenes_exist("bench_rivals", argc - first, argv + first))
        return 2;
    o.strata = (int)(sqrt((double)rays) + 0.5);
    if (o.width < 1 || o.height < 1 || o.width > 4096 || o.height > 4096 || o.strata < 1)
        return usage();

    static method methods[MOST_METHODS];
    static result results[MOST_SCENES][MOST_METHODS];
    static dataset data[MOST_SCENES];
    int count = list_methods(methods, only), scenes = 0;
    rival_fit *fit = malloc(sizeof *fit);
    float *scratch = NULL, *work = NULL;
    FILE *csv = NULL;
    pool *p = pool_create(threads);
    if (!p || !fit || !make_folders("build/bench/rivals"))
        goto done;
    for (int i = 0; i < bench_scene_count() && scenes < MOST_SCENES; ++i) {
        if (!bench_scene_chosen(i, argc - first, argv + first))
            continue;
        dataset *d = &data[scenes];
        if (!dataset_open(d, i, &o, p))
            goto done;
        ++scenes;
        if (!scratch) {
            scratch = malloc(rival_scratch_floats(&d->view) * sizeof *scratch);
            work = malloc(view_pixels(&d->view) * sizeof *work);
        }
        double start = seconds();
        voxel_grid *g = voxel_open(&d->scene, &d->view, 128);
        double voxel_ms = 1e3 * (seconds() - start);
        trace *t = trace_open(&d->scene);
        bool ok = scratch && work && g && t;
        for (int m = 0; ok && m < count; ++m) {
            result *r = &results[scenes - 1][m];
            ok = measure(d, t, g, &methods[m], methods[m].rays > 16 ? 1 : repeat, scratch, r);
            r->extra_ms = methods[m].cones ? voxel_ms : 0;
        }
        trace_close(t);
        voxel_close(g);
        if (!ok)
            goto done;
        fprintf(stderr, "%s\n", d->scene.name);
    }
    for (int m = 0; m < count; ++m)
        for (int buffer = 0; buffer < 2; ++buffer) {
            double rmse;
            memset(fit, 0, sizeof *fit);
            for (int s = 0; s < scenes; ++s)
                rival_fit_add(fit, &data[s].view, results[s][m].raw, buffer ? data[s].truth_view : data[s].truth_rays);
            *(buffer ? &methods[m].fit_view : &methods[m].fit_rays) = rival_fit_solve(fit, &rmse);
        }
    csv = fopen("build/bench/rivals.csv", "w");
    if (!csv)
        goto done;
    fprintf(csv, "scene,method,taps,ns_per_pixel,prepare_ms,published_rmse_rays,published_rmse_view,fitted_rmse_rays,"
                 "fitted_mean_rays,fitted_rmse_view,"
                 "fitted_mean_view,a,b,c\n");
    printf("%-24s %8s %10s %10s %9s %9s %9s %9s   %s\n", "method (mean of scenes)", "ns/pixel", "rays", "view",
           "rays fit", "mean", "view fit", "mean", "a, b, c fitted to rays");
    for (int m = 0; m < count; ++m) {
        double ns = 0, sum[6] = {0, 0, 0, 0, 0, 0};
        method *q = &methods[m];
        for (int s = 0; s < scenes; ++s) {
            dataset *d = &data[s];
            const result *r = &results[s][m];
            rival_output identity = {0, 1, 1};
            finish(d, q, q->rival ? &q->preset->published : &identity, r->raw, work);
            double printed_rays = dataset_compare(d, work, d->truth_rays).rmse;
            double printed_view = dataset_compare(d, work, d->truth_view).rmse;
            finish(d, q, &q->fit_rays, r->raw, work);
            dataset_error e = dataset_compare(d, work, d->truth_rays);
            finish(d, q, &q->fit_view, r->raw, work);
            dataset_error f = dataset_compare(d, work, d->truth_view);
            fprintf(csv, "%s,%s,%d,%.2f,%.1f,%.5f,%.5f,%.5f,%.5f,%.5f,%.5f,%.4f,%.4f,%.4f\n", d->scene.name, q->name,
                    q->rival ? q->preset->taps : q->rays, r->ns, r->extra_ms, printed_rays, printed_view, e.rmse,
                    e.mean, f.rmse, f.mean, (double)q->fit_rays.a, (double)q->fit_rays.b, (double)q->fit_rays.c);
            double all[6] = {printed_rays, printed_view, e.rmse, e.mean, f.rmse, f.mean};
            for (int k = 0; k < 6; ++k)
                sum[k] += all[k] / scenes;
            ns += r->ns / scenes;
        }
        printf("%-24s %8.0f %10.4f %10.4f %9.4f %+9.4f %9.4f %+9.4f   %.3f %.3f %.3f\n", q->name, ns, sum[0], sum[1],
               sum[2], sum[3], sum[4], sum[5], (double)q->fit_rays.a, (double)q->fit_rays.b, (double)q->fit_rays.c);
    }
    canvas_load_fonts();
    status = 0;
    for (int s = 0; s < scenes && !status; ++s)
        status = !write_sheet(&data[s], methods, count, results[s], work);
    canvas_free_fonts();
done:
    if (csv)
        fclose(csv);
    for (int s = 0; s < scenes; ++s) {
        dataset_close(&data[s]);
        for (int m = 0; m < count; ++m)
            free(results[s][m].raw);
    }
    pool_destroy(p);
    free(fit);
    free(scratch);
    free(work);
    return status;
}
