#include "dataset.h"

#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "examples/common/image.h"
#include "march.h"
#include "trace.h"

#define CACHE "build/bench/scenes"
/* Raise when trace.c or march.c change what they compute. */
#define TRUTH_VERSION 2

static const char *const channels[] = {"Z", "N.X", "N.Y", "N.Z", "truth.rays", "truth.view"};
enum { CHANNELS = 6 };

bool make_folders(const char *path) {
    char part[1024];
    size_t n = strlen(path);
    if (n >= sizeof part)
        return false;
    for (size_t i = 0; i <= n; ++i) {
        part[i] = path[i];
        if ((path[i] == '/' && i > 0) || path[i] == '\0') {
            part[i] = '\0';
            if (mkdir(part, 0777) != 0 && errno != EEXIST) {
                fprintf(stderr, "%s: %s\n", part, strerror(errno));
                return false;
            }
            part[i] = path[i];
        }
    }
    return true;
}

static uint64_t hash_bytes(uint64_t h, const void *data, size_t size) {
    const unsigned char *p = data;
    for (size_t i = 0; i < size; ++i)
        h = (h ^ p[i]) * 0x100000001b3u;
    return h;
}

/* One line that changes with anything the images depend on. */
static void describe(const dataset *d, const dataset_options *o, char *text, size_t size) {
    const mesh *m = &d->scene.mesh;
    uint64_t h = hash_bytes(0xcbf29ce484222325u, m->positions, m->vertex_count * 3 * sizeof *m->positions);
    h = hash_bytes(h, m->indices, m->triangle_count * 3 * sizeof *m->indices);
    h = hash_bytes(h, &d->scene.camera.eye, 4 * sizeof(vec3));
    snprintf(
        text, size,
        "{\"version\": %d, \"scene\": \"%s\", \"triangles\": %zu, \"width\": %d, \"height\": %d, \"focal_px\": %.9g, "
        "\"radius\": %.9g, \"falloff\": %.9g, \"rays\": %d, \"hash\": \"%016llx\"}\n",
        TRUTH_VERSION, d->scene.name, m->triangle_count, o->width, o->height, (double)d->view.focal_px,
        (double)d->view.radius, (double)d->view.falloff, o->strata * o->strata, (unsigned long long)h);
}

static bool file_equals(const char *path, const char *text) {
    char have[1024];
    FILE *file = fopen(path, "rb");
    if (!file)
        return false;
    size_t n = fread(have, 1, sizeof have - 1, file);
    fclose(file);
    have[n] = '\0';
    return strcmp(have, text) == 0;
}

typedef struct render {
    dataset *d;
    const trace *rays;
    const march *heights;
    int strata;
} render;

static void primary_rows(void *user, int thread, int row_begin, int row_end) {
    const render *r = user;
    (void)thread;
    trace_primary_rows(r->rays, &r->d->scene.camera, r->d->z, r->d->normals, row_begin, row_end);
}

static void rays_rows(void *user, int thread, int row_begin, int row_end) {
    const render *r = user;
    (void)thread;
    trace_visibility_rows(r->rays, &r->d->view, r->strata, r->d->truth_rays, row_begin, row_end);
}

static void view_rows(void *user, int thread, int row_begin, int row_end) {
    const render *r = user;
    (void)thread;
    march_visibility_rows(r->heights, r->strata, r->d->truth_view, row_begin, row_end);
}

static bool render_all(dataset *d, int strata, pool *threads) {
    trace *rays = trace_open(&d->scene);
    if (!rays)
        return false;
    render r = {d, rays, NULL, strata};
    pool_run(threads, d->view.height, 0, primary_rows, NULL, &r);
    pool_run(threads, d->view.height, 0, rays_rows, NULL, &r);
    trace_close(rays);
    march *heights = march_open(&d->view);
    if (!heights)
        return false;
    r.heights = heights;
    pool_run(threads, d->view.height, 0, view_rows, NULL, &r);
    march_close(heights);
    return true;
}

/* Between the four arrays and the six interleaved channels. */
static void pack(const dataset *d, float *data, bool unpack) {
    size_t n = view_pixels(&d->view);
    for (size_t i = 0; i < n; ++i) {
        float *c = data + CHANNELS * i;
        float *mine[CHANNELS] = {d->z + i,          d->normals + 3 * i, d->normals + 3 * i + 1, d->normals + 3 * i + 2,
                                 d->truth_rays + i, d->truth_view + i};
        for (int k = 0; k < CHANNELS; ++k) {
            if (unpack)
                *mine[k] = c[k];
            else
                c[k] = *mine[k];
        }
    }
}

static bool read_cached(dataset *d, const char *path) {
    image img;
    image_error error;
    if (!image_read_channels(path, channels, CHANNELS, &img, &error))
        return false;
    bool fits = img.width == d->view.width && img.height == d->view.height;
    if (fits)
        pack(d, img.data, true);
    image_free(&img);
    return fits;
}

static bool write_cached(const dataset *d, const char *path, const char *stamp, const char *text) {
    image img;
    image_error error;
    image_pending files[2];
    memset(files, 0, sizeof files);
    bool ok = image_create(&img, d->view.width, d->view.height, CHANNELS, &error);
    if (ok) {
        pack(d, img.data, false);
        ok = image_write(path, &img, channels, IMAGE_RANGE_UNIT, &files[0], &error) &&
             image_write_text(stamp, text, &files[1], &error) && image_commit(&files[0], &error) &&
             image_commit(&files[1], &error);
        image_free(&img);
    }
    if (!ok)
        fprintf(stderr, "%s\n", error.text);
    image_discard(&files[0]);
    image_discard(&files[1]);
    return ok;
}

bool dataset_open(dataset *d, int index, const dataset_options *o, pool *threads) {
    memset(d, 0, sizeof *d);
    if (!make_folders(CACHE) || !bench_scene_build(&d->scene, index, o->width, o->height))
        return false;
    const bench_scene_camera *c = &d->scene.camera;
    d->view.width = o->width, d->view.height = o->height;
    d->view.focal_px = (float)c->focal_px, d->view.cx = (float)c->cx, d->view.cy = (float)c->cy;
    d->view.radius = (float)(d->scene.radius * (o->radius_scale > 0 ? o->radius_scale : 1));
    d->view.falloff = (float)o->falloff;
    size_t n = view_pixels(&d->view);
    d->z = malloc(n * sizeof(float));
    d->normals = malloc(3 * n * sizeof(float));
    d->truth_rays = malloc(n * sizeof(float));
    d->truth_view = malloc(n * sizeof(float));
    d->view.z = d->z, d->view.normals = d->normals;
    if (!d->z || !d->normals || !d->truth_rays || !d->truth_view) {
        fprintf(stderr, "%s: out of memory\n", d->scene.name);
        dataset_close(d);
        return false;
    }
    char base[256], path[300], stamp[300], text[1024];
    snprintf(base, sizeof base, CACHE "/%s-%dx%d-%g-%g", d->scene.name, o->width, o->height, (double)d->view.radius,
             (double)d->view.falloff);
    snprintf(path, sizeof path, "%s.exr", base);
    snprintf(stamp, sizeof stamp, "%s.json", base);
    describe(d, o, text, sizeof text);
    if (file_equals(stamp, text) && read_cached(d, path))
        return true;
    if (render_all(d, o->strata, threads) && write_cached(d, path, stamp, text))
        return true;
    dataset_close(d);
    return false;
}

void dataset_close(dataset *d) {
    free(d->z);
    free(d->normals);
    free(d->truth_rays);
    free(d->truth_view);
    bench_scene_free(&d->scene);
    memset(d, 0, sizeof *d);
}

dataset_error dataset_compare(const dataset *d, const float *a, const float *b) {
    dataset_error e = {0, 0};
    size_t n = view_pixels(&d->view), count = 0;
    for (size_t i = 0; i < n; ++i)
        if (d->z[i] < VIEW_SKY) {
            double difference = (double)a[i] - (double)b[i];
            e.rmse += difference * difference;
            e.mean += difference;
            ++count;
        }
    if (count) {
        e.rmse = sqrt(e.rmse / (double)count);
        e.mean /= (double)count;
    }
    return e;
}
