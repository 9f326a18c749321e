/* bench_multibounce - path-traced visibility with interreflection against the cubic of [J16], and a refit of it.
 *
 *     build/bench_multibounce [--size WIDTHxHEIGHT] [--paths N] [--threads N]
 *
 * One set of paths gives the truth at every albedo (trace.h). Errors are root mean squares over the pixels with a
 * surface, every scene with the same weight, for albedos 0.1 to 0.9; "spread" is that of the truth about its own mean in
 * 64 bins of visibility: what no function of visibility and albedo can remove.
 *   published   max(V, ((a V + b) V + c) V), coefficients linear in the albedo, [J16]
 *   refit       the same form by least squares over these scenes, with a + b + c = 1 so that open stays open
 *   balanced    the refit with every bin of visibility weighing the same in place of every pixel
 *   series      V / (1 - albedo (1 - V)): every bounce sees the visibility of the first
 *   series k    V / (1 - k albedo (1 - V)), k by least squares
 * Writes build/bench/multibounce.csv: mean and spread of the truth for each scene, albedo and bin. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "dataset.h"
#include "trace.h"

enum { BINS = 64, BOUNCES = 24, ALBEDOS = 9, MOST_SCENES = 16, MODELS = 5 };

typedef struct bin {
    double count, sum[ALBEDOS], sum2[ALBEDOS];
} bin;

/* f(V, rho) = V + a (V^3 - V) + b (V^2 - V), a = a1 rho + a0, b = b1 rho + b0; c = 1 - a - b */
typedef struct cubic {
    double a1, a0, b1, b0, c1, c0;
} cubic;

static const cubic published = {2.0404, -0.3324, -4.7951, 0.6417, 2.7552, 0.6903};

static double cubic_at(const cubic *q, double v, double rho) {
    double a = q->a1 * rho + q->a0, b = q->b1 * rho + q->b0, c = q->c1 * rho + q->c0;
    return fmax(v, ((a * v + b) * v + c) * v);
}

/* Normal equations of the four free coefficients. */
typedef struct normal_equations {
    double m[4][5];
} normal_equations;

static void accumulate(normal_equations *e, double v, double rho, double target, double weight) {
    double p = v * v * v - v, q = v * v - v, row[5] = {p * rho, p, q * rho, q, target - v};
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 5; ++j)
            e->m[i][j] += weight * row[i] * row[j];
}

static cubic solve(const normal_equations *e) {
    double m[4][5];
    memcpy(m, e->m, sizeof m);
    for (int i = 0; i < 4; ++i) {
        int pivot = i;
        for (int k = i + 1; k < 4; ++k)
            if (fabs(m[k][i]) > fabs(m[pivot][i]))
                pivot = k;
        for (int j = 0; j < 5; ++j) {
            double swap = m[i][j];
            m[i][j] = m[pivot][j];
            m[pivot][j] = swap;
        }
        for (int k = 0; k < 4; ++k)
            if (k != i) {
                double f = m[k][i] / m[i][i];
                for (int j = i; j < 5; ++j)
                    m[k][j] -= f * m[i][j];
            }
    }
    cubic q = {m[0][4] / m[0][0], m[1][4] / m[1][1], m[2][4] / m[2][2], m[3][4] / m[3][3], 0, 0};
    q.c1 = -q.a1 - q.b1;
    q.c0 = 1 - q.a0 - q.b0;
    return q;
}

static double series_at(double k, double v, double rho) {
    return v / (1 - k * rho * (1 - v));
}

static double albedo_of(int k) {
    return 0.1 * (k + 1);
}

static double light(const float *escaped, double rho) {
    double sum = 0, power = 1;
    for (int k = 0; k <= BOUNCES; ++k, power *= rho)
        sum += (double)escaped[k] * power;
    return sum;
}

/* Golden section over k, on the bins, every scene with the same weight. */
static double fit_series(bin (*bins)[BINS], int scenes) {
    double lo = 0.5, hi = 1.1;
    for (int step = 0; step < 40; ++step) {
        double k[2] = {hi - 0.618034 * (hi - lo), lo + 0.618034 * (hi - lo)}, error[2] = {0, 0};
        for (int i = 0; i < scenes; ++i) {
            double count = 0;
            for (int b = 0; b < BINS; ++b)
                count += bins[i][b].count;
            for (int b = 0; b < BINS; ++b)
                for (int a = 0; a < ALBEDOS && bins[i][b].count > 0; ++a)
                    for (int e = 0; e < 2; ++e) {
                        double miss =
                            series_at(k[e], (b + 0.5) / BINS, albedo_of(a)) - bins[i][b].sum[a] / bins[i][b].count;
                        error[e] += miss * miss * bins[i][b].count / count;
                    }
        }
        if (error[0] < error[1])
            hi = k[1];
        else
            lo = k[0];
    }
    return 0.5 * (lo + hi);
}

typedef struct render {
    const trace *rays;
    const view *v;
    int strata;
    float *escaped;
} render;

static void bounce_rows(void *user, int thread, int row_begin, int row_end) {
    const render *r = user;
    (void)thread;
    trace_bounce_rows(r->rays, r->v, r->strata, BOUNCES, r->escaped, row_begin, row_end);
}

static int usage(void) {
    fprintf(stderr, "usage: bench_multibounce [--size WIDTHxHEIGHT] [--paths N] [--threads N]\n");
    return 2;
}

int main(int argc, char **argv) {
    dataset_options o = {240, 135, 4, 0, 1};
    int paths = 400, threads = (int)sysconf(_SC_NPROCESSORS_ONLN), status = 1, scenes = 0;
    for (int k = 1; k < argc; k += 2) {
        const char *name = argv[k], *value = k + 1 < argc ? argv[k + 1] : "";
        bool ok = strcmp(name, "--size") == 0      ? sscanf(value, "%dx%d", &o.width, &o.height) == 2
                  : strcmp(name, "--paths") == 0   ? sscanf(value, "%d", &paths) == 1
                  : strcmp(name, "--threads") == 0 ? sscanf(value, "%d", &threads) == 1
                                                   : false;
        if (!ok)
            return usage();
    }
    int strata = (int)(sqrt((double)paths) + 0.5);
    if (o.width < 1 || o.height < 1 || o.width > 4096 || o.height > 4096 || strata < 1)
        return usage();

    static float *escaped[MOST_SCENES];
    static dataset data[MOST_SCENES];
    static bin bins[MOST_SCENES][BINS];
    normal_equations by_pixel, by_bin;
    memset(&by_pixel, 0, sizeof by_pixel);
    memset(&by_bin, 0, sizeof by_bin);
    FILE *csv = NULL;
    pool *p = pool_create(threads);
    if (!p || !make_folders("build/bench"))
        goto done;
    for (int i = 0; i < bench_scene_count() && i < MOST_SCENES; ++i) {
        dataset *d = &data[i];
        if (!dataset_open(d, i, &o, p))
            goto done;
        scenes = i + 1;
        size_t n = view_pixels(&d->view), surfaces = 0;
        escaped[i] = malloc(n * (BOUNCES + 1) * sizeof(float));
        trace *rays = trace_open(&d->scene);
        if (!escaped[i] || !rays) {
            trace_close(rays);
            goto done;
        }
        render r = {rays, &d->view, strata, escaped[i]};
        pool_run(p, d->view.height, 0, bounce_rows, NULL, &r);
        trace_close(rays);
        for (size_t k = 0; k < n; ++k)
            surfaces += d->z[k] < VIEW_SKY;
        for (size_t k = 0; k < n; ++k) {
            if (!(d->z[k] < VIEW_SKY))
                continue;
            const float *e = escaped[i] + k * (BOUNCES + 1);
            double v = (double)e[0];
            bin *b = &bins[i][v < 1 ? (int)(v * BINS) : BINS - 1];
            b->count += 1;
            for (int a = 0; a < ALBEDOS; ++a) {
                double l = light(e, albedo_of(a));
                b->sum[a] += l;
                b->sum2[a] += l * l;
                accumulate(&by_pixel, v, albedo_of(a), l, 1 / (double)surfaces);
            }
        }
    }
    csv = fopen("build/bench/multibounce.csv", "w");
    if (!csv) {
        perror("build/bench/multibounce.csv");
        goto done;
    }
    fprintf(csv, "scene,albedo,visibility,pixels,mean,spread\n");
    for (int i = 0; i < scenes; ++i)
        for (int a = 0; a < ALBEDOS; ++a)
            for (int k = 0; k < BINS; ++k) {
                const bin *b = &bins[i][k];
                if (b->count < 20)
                    continue;
                double mean = b->sum[a] / b->count, v = (k + 0.5) / BINS;
                fprintf(csv, "%s,%.1f,%.5f,%.0f,%.5f,%.5f\n", data[i].scene.name, albedo_of(a), v, b->count, mean,
                        sqrt(fmax(0, b->sum2[a] / b->count - mean * mean)));
                accumulate(&by_bin, v, albedo_of(a), mean, 1);
            }
    cubic fits[3] = {published, solve(&by_pixel), solve(&by_bin)};
    static const char *const names[MODELS] = {"published", "refit", "balanced", "series", "series k"};
    double k_fit = fit_series(bins, scenes);
    for (int k = 0; k < 3; ++k)
        printf("%-10s a = %+.4f rho %+.4f   b = %+.4f rho %+.4f   c = %+.4f rho %+.4f\n", names[k], fits[k].a1,
               fits[k].a0, fits[k].b1, fits[k].b0, fits[k].c1, fits[k].c0);
    printf("%-10s k = %.4f\n", names[4], k_fit);

    /* by scene (all albedos), then by albedo (all scenes) */
    double by_albedo[ALBEDOS][MODELS + 3];
    memset(by_albedo, 0, sizeof by_albedo);
    printf("\n%-10s %9s %9s %9s %9s %9s %9s %9s %9s\n", "rmse", names[0], names[1], names[2], names[3], names[4],
           "V alone", "spread", "mean V");
    for (int i = 0; i < scenes; ++i) {
        const dataset *d = &data[i];
        double total[MODELS + 3], count = 0, mean_v = 0;
        memset(total, 0, sizeof total);
        for (int k = 0; k < BINS; ++k)
            count += bins[i][k].count;
        for (int a = 0; a < ALBEDOS; ++a) {
            double rho = albedo_of(a), sum[MODELS + 3];
            memset(sum, 0, sizeof sum);
            for (size_t k = 0; k < view_pixels(&d->view); ++k) {
                if (!(d->z[k] < VIEW_SKY))
                    continue;
                const float *e = escaped[i] + k * (BOUNCES + 1);
                double v = (double)e[0], l = light(e, rho);
                for (int m = 0; m < MODELS + 1; ++m) {
                    double f = m < 3        ? cubic_at(&fits[m], v, rho)
                               : m < MODELS ? series_at(m == 3 ? 1 : k_fit, v, rho)
                                            : v;
                    sum[m] += (f - l) * (f - l) / count;
                    if (m == 0)
                        sum[MODELS + 2] += (f - l) / count;
                }
                mean_v += v / count / ALBEDOS;
            }
            for (int k = 0; k < BINS; ++k)
                if (bins[i][k].count > 0)
                    sum[MODELS + 1] +=
                        (bins[i][k].sum2[a] - bins[i][k].sum[a] * bins[i][k].sum[a] / bins[i][k].count) / count;
            for (int m = 0; m < MODELS + 3; ++m) {
                total[m] += sum[m] / ALBEDOS;
                by_albedo[a][m] += sum[m] / scenes;
            }
        }
        printf("%-10s", d->scene.name);
        for (int m = 0; m < MODELS + 2; ++m)
            printf(" %9.4f", sqrt(fmax(0, total[m])));
        printf(" %9.4f\n", mean_v);
    }
    printf("\n%-10s %9s %9s %9s %9s %9s %9s %9s %9s\n", "albedo", names[0], names[1], names[2], names[3], names[4],
           "V alone", "spread", "mean pub.");
    for (int a = 0; a < ALBEDOS; ++a) {
        printf("%-10.1f", albedo_of(a));
        for (int m = 0; m < MODELS + 2; ++m)
            printf(" %9.4f", sqrt(fmax(0, by_albedo[a][m])));
        printf(" %+9.4f\n", by_albedo[a][MODELS + 2]);
    }
    status = 0;
done:
    if (csv)
        fclose(csv);
    for (int i = 0; i < scenes; ++i) {
        dataset_close(&data[i]);
        free(escaped[i]);
    }
    pool_destroy(p);
    return status;
}
