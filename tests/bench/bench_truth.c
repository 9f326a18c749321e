/* bench_truth - renders every scene's buffers and ground truths (build/bench/scenes/NAME-WxH-RADIUS-FALLOFF.exr) and a
 * sheet of pictures of each (NAME.png: depth, normals, ray-traced visibility, visibility of the depth buffer).
 *
 *     build/bench_truth [--size WIDTHxHEIGHT] [--rays N] [--falloff F] [--threads N] [SCENE...]
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "dataset.h"
#include "examples/common/image.h"

static double seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Quarters: depth (near is light, by the logarithm) and normals above, the two truths below. */
static bool write_sheet(const dataset *d) {
    int w = d->view.width, h = d->view.height;
    image sheet;
    image_error error;
    image_pending file;
    char path[256];
    memset(&file, 0, sizeof file);
    if (!image_create(&sheet, 2 * w, 2 * h, 3, &error)) {
        fprintf(stderr, "%s\n", error.text);
        return false;
    }
    float nearest = VIEW_SKY, farthest = 0;
    for (size_t i = 0; i < view_pixels(&d->view); ++i)
        if (d->z[i] < VIEW_SKY) {
            nearest = fminf(nearest, d->z[i]);
            farthest = fmaxf(farthest, d->z[i]);
        }
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) {
            size_t i = (size_t)y * (size_t)w + (size_t)x, row = 3 * 2 * (size_t)w;
            float *out[4];
            for (int k = 0; k < 4; ++k)
                out[k] = sheet.data + row * (size_t)(y + (k >> 1) * h) + 3 * (size_t)(x + (k & 1) * w);
            float depth = d->z[i] < VIEW_SKY ? 1 - 0.9f * logf(d->z[i] / nearest) / logf(farthest / nearest) : 0;
            for (int c = 0; c < 3; ++c) {
                float n = d->normals[3 * i + (size_t)c] * (c ? -1.0f : 1.0f);
                out[0][c] = depth;
                out[1][c] = 0.5f + 0.5f * n;
                out[2][c] = d->truth_rays[i];
                out[3][c] = d->truth_view[i];
            }
        }
    snprintf(path, sizeof path, "build/bench/scenes/%s.png", d->scene.name);
    bool ok = image_write(path, &sheet, NULL, IMAGE_RANGE_UNIT, &file, &error) && image_commit(&file, &error);
    if (!ok)
        fprintf(stderr, "%s\n", error.text);
    image_discard(&file);
    image_free(&sheet);
    return ok;
}

static int usage(void) {
    fprintf(stderr, "usage: bench_truth [--size WIDTHxHEIGHT] [--rays N] [--falloff F] [--threads N] [SCENE...]\n");
    return 2;
}

int main(int argc, char **argv) {
    dataset_options o = {480, 270, 16, 0, 1};
    int rays = 256, threads = (int)sysconf(_SC_NPROCESSORS_ONLN), first = 1;
    for (; first + 1 < argc && strncmp(argv[first], "--", 2) == 0; first += 2) {
        const char *name = argv[first], *value = argv[first + 1];
        bool ok = strcmp(name, "--size") == 0      ? sscanf(value, "%dx%d", &o.width, &o.height) == 2
                  : strcmp(name, "--rays") == 0    ? sscanf(value, "%d", &rays) == 1
                  : strcmp(name, "--falloff") == 0 ? sscanf(value, "%lf", &o.falloff) == 1
                  : strcmp(name, "--threads") == 0 ? sscanf(value, "%d", &threads) == 1
                                                   : false;
        if (!ok)
            return usage();
    }
    if (!bench_scenes_exist("bench_truth", argc - first, argv + first))
        return 2;
    o.strata = (int)(sqrt((double)rays) + 0.5);
    if (o.width < 1 || o.height < 1 || o.width > 4096 || o.height > 4096 || o.strata < 1 ||
        !(o.falloff >= 0 && o.falloff <= 1))
        return usage();
    pool *p = pool_create(threads);
    if (!p) {
        fprintf(stderr, "bench_truth: out of memory\n");
        return 1;
    }
    int status = 0;
    printf("%-10s %9s %9s %8s %8s %8s %8s %8s\n", "scene", "triangles", "radius px", "sky", "rays", "view", "rmse",
           "s");
    for (int i = 0; i < bench_scene_count() && !status; ++i) {
        if (!bench_scene_chosen(i, argc - first, argv + first))
            continue;
        dataset d;
        double start = seconds();
        if (!dataset_open(&d, i, &o, p) || !write_sheet(&d)) {
            status = 1;
            break;
        }
        double sky = 0, mean_rays = 0, mean_view = 0, radius_px = 0;
        size_t n = view_pixels(&d.view);
        for (size_t k = 0; k < n; ++k) {
            bool surface = d.z[k] < VIEW_SKY;
            sky += !surface;
            mean_rays += surface ? (double)d.truth_rays[k] : 0;
            mean_view += surface ? (double)d.truth_view[k] : 0;
            radius_px += surface ? (double)(d.view.radius * d.view.focal_px / d.z[k]) : 0;
        }
        double surfaces = (double)n - sky;
        printf("%-10s %9zu %9.1f %8.3f %8.4f %8.4f %8.4f %8.1f\n", d.scene.name, d.scene.mesh.triangle_count,
               radius_px / surfaces, sky / (double)n, mean_rays / surfaces, mean_view / surfaces,
               dataset_compare(&d, d.truth_view, d.truth_rays).rmse, seconds() - start);
        fflush(stdout);
        dataset_close(&d);
    }
    pool_destroy(p);
    return status;
}
