#include "measure.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static double seconds_of(clockid_t clock) {
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

double thread_seconds(void) {
    return seconds_of(CLOCK_THREAD_CPUTIME_ID);
}

double wall_seconds(void) {
    return seconds_of(CLOCK_MONOTONIC);
}

FILE *table_open(const char *directory, const char *name) {
    char path[512];
    snprintf(path, sizeof path, "%s/%s.md", directory, name);
    FILE *to = fopen(path, "w");
    if (!to) {
        fprintf(stderr, "%s: cannot be written\n", path);
        exit(1);
    }
    return to;
}

static int compare_doubles(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double median(double *values, int count) {
    qsort(values, (size_t)count, sizeof *values, compare_doubles);
    return count % 2 ? values[count / 2] : 0.5 * (values[count / 2 - 1] + values[count / 2]);
}

void measure(timed *list, int count, int repeat, double (*clock)(void)) {
    enum { MOST = 64 };
    double *times = malloc((size_t)count * MOST * sizeof *times);
    if (!times) {
        fprintf(stderr, "measure: out of memory\n");
        exit(1);
    }
    repeat = repeat < 1 ? 1 : repeat > MOST ? MOST : repeat;
    for (int r = -1; r < repeat; ++r)
        for (int k = 0; k < count; ++k) {
            double start = clock();
            list[k].run(list[k].user);
            if (r >= 0)
                times[k * MOST + r] = clock() - start;
        }
    for (int k = 0; k < count; ++k)
        list[k].seconds = median(times + k * MOST, repeat);
    free(times);
}

/* ---- distance ---------------------------------------------------------------------------------------------------- */

enum { HALF_WINDOW = 5 };

/* Blurs along x, then y; clamps at the edges. `work` holds an image. */
static void gaussian(const view *v, float *image, float *work) {
    float kernel[2 * HALF_WINDOW + 1], sum = 0;
    int w = v->width, h = v->height;
    for (int k = -HALF_WINDOW; k <= HALF_WINDOW; ++k)
        sum += kernel[k + HALF_WINDOW] = expf(-(float)(k * k) / (2 * 1.5f * 1.5f));
    for (int k = 0; k <= 2 * HALF_WINDOW; ++k)
        kernel[k] /= sum;
    for (int y = 0; y < h; ++y) {
        const float *row = image + (size_t)y * (size_t)w;
        float *out = work + (size_t)y * (size_t)w;
        memset(out, 0, (size_t)w * sizeof *out);
        for (int k = -HALF_WINDOW; k <= HALF_WINDOW; ++k) {
            float weight = kernel[k + HALF_WINDOW];
            int first = k < 0 ? -k : 0, last = k > 0 ? w - k : w;
            first = first < w ? first : w, last = last > first ? last : first;
            for (int x = 0; x < first; ++x)
                out[x] += weight * row[0];
            for (int x = first; x < last; ++x)
                out[x] += weight * row[x + k];
            for (int x = last; x < w; ++x)
                out[x] += weight * row[w - 1];
        }
    }
    for (int y = 0; y < h; ++y) {
        float *out = image + (size_t)y * (size_t)w;
        memset(out, 0, (size_t)w * sizeof *out);
        for (int k = -HALF_WINDOW; k <= HALF_WINDOW; ++k) {
            int at = y + k < 0 ? 0 : y + k >= h ? h - 1 : y + k;
            const float *row = work + (size_t)at * (size_t)w;
            for (int x = 0; x < w; ++x)
                out[x] += kernel[k + HALF_WINDOW] * row[x];
        }
    }
}

static double similarity(const view *v, const float *a, const float *b) {
    const double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;
    size_t n = view_pixels(v), count = 0;
    double sum = 0;
    float *m = malloc(6 * n * sizeof *m);
    if (!m)
        return 0;
    float *ma = m, *mb = m + n, *aa = m + 2 * n, *bb = m + 3 * n, *ab = m + 4 * n, *work = m + 5 * n;
    for (size_t i = 0; i < n; ++i) {
        ma[i] = a[i], mb[i] = b[i];
        aa[i] = a[i] * a[i], bb[i] = b[i] * b[i], ab[i] = a[i] * b[i];
    }
    for (int k = 0; k < 5; ++k)
        gaussian(v, m + (size_t)k * n, work);
    for (size_t i = 0; i < n; ++i)
        if (v->z[i] < VIEW_SKY) {
            double x = (double)ma[i], y = (double)mb[i];
            double xx = (double)aa[i] - x * x, yy = (double)bb[i] - y * y, xy = (double)ab[i] - x * y;
            sum += (2 * x * y + c1) * (2 * xy + c2) / ((x * x + y * y + c1) * (xx + yy + c2));
            ++count;
        }
    free(m);
    return count ? sum / (double)count : 1;
}

distance image_distance(const view *v, const float *a, const float *b) {
    distance d = {0, 0, 0, 0, 0};
    size_t n = view_pixels(v), count = 0;
    for (size_t i = 0; i < n; ++i)
        if (v->z[i] < VIEW_SKY) {
            double difference = (double)a[i] - (double)b[i];
            d.rmse += difference * difference;
            d.mean += difference;
            d.most = fmax(d.most, fabs(difference));
            ++count;
        }
    if (count) {
        d.rmse = sqrt(d.rmse / (double)count);
        d.mean /= (double)count;
    }
    d.psnr = -20 * log10(fmax(d.rmse, 1e-9));
    d.ssim = similarity(v, a, b);
    return d;
}

gtao_desc view_describe(const view *v) {
    gtao_desc d;
    memset(&d, 0, sizeof d);
    d.width = v->width, d.height = v->height;
    d.depth = v->z;
    d.normals = v->normals;
    d.sky_z = VIEW_SKY;
    d.camera.fx = v->focal_px;
    d.camera.off_center = 1;
    d.camera.cx = v->cx, d.camera.cy = v->cy;
    d.radius = v->radius;
    d.falloff = v->falloff;
    return d;
}
