#include "picture.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "examples/common/scene.h"
#include "trace.h"

void picture_close(picture *p) {
    free(p->z);
    free(p->normals);
    free(p->visibility);
    free(p->bent);
    free(p->packed);
    free(p->scratch);
    memset(p, 0, sizeof *p);
}

typedef struct primary {
    const trace *rays;
    const bench_scene_camera *camera;
    picture *out;
} primary;

static void primary_rows(void *user, int thread, int row_begin, int row_end) {
    const primary *p = user;
    (void)thread;
    trace_primary_rows(p->rays, p->camera, p->out->z, p->out->normals, row_begin, row_end);
}

bool picture_render(picture *p, const char *name, int width, int height, pool *threads) {
    bench_scene s;
    int index = 0;
    memset(p, 0, sizeof *p);
    while (index < bench_scene_count() && strcmp(bench_scene_name(index), name) != 0)
        ++index;
    if (!(index < bench_scene_count() ? bench_scene_build(&s, index, width, height)
                                      : bench_study_build(&s, name, width, height)))
        return false;
    size_t n = (size_t)width * (size_t)height;
    p->name = s.name;
    p->z = malloc(n * sizeof(float));
    p->normals = malloc(3 * n * sizeof(float));
    trace *t = trace_open(&s);
    bool ok = p->z && p->normals && t;
    if (ok) {
        primary work = {t, &s.camera, p};
        pool_run(threads, height, 0, primary_rows, NULL, &work);
        /* The transcription knows sky by infinity. */
        for (size_t i = 0; i < n; ++i)
            if (!(p->z[i] < VIEW_SKY))
                p->z[i] = HUGE_VALF;
        p->view = (view){width,
                         height,
                         (float)s.camera.focal_px,
                         (float)s.camera.cx,
                         (float)s.camera.cy,
                         (float)s.radius,
                         picture_falloff,
                         p->z,
                         p->normals};
    }
    trace_close(t);
    bench_scene_free(&s);
    if (!ok)
        picture_close(p);
    return ok;
}

/* tests/data/NAME.exr with normals in world space, or NAME.pfm, a map of 3 arc seconds a pixel. */
static bool picture_read(picture *p, const char *name) {
    static const char *const files[] = {"courtyard", "scans", "study"};
    char path[256];
    image_error error;
    memset(p, 0, sizeof *p);
    for (size_t k = 0; k < sizeof files / sizeof *files; ++k) {
        scene s;
        if (strcmp(name, files[k]) != 0)
            continue;
        snprintf(path, sizeof path, "tests/data/%s.exr", name);
        if (!scene_read(path, NULL, &s, &error)) {
            fprintf(stderr, "%s\n", error.text);
            return false;
        }
        int w = s.depth.width, h = s.depth.height;
        size_t n = (size_t)w * (size_t)h;
        p->name = files[k];
        p->z = malloc(n * sizeof(float));
        p->normals = malloc(3 * n * sizeof(float));
        for (size_t i = 0; p->z && p->normals && i < n; ++i) {
            const float *from = s.normals.data + 3 * i, *m = s.world_to_view;
            p->z[i] = scene_visible(&s, i) ? s.depth.data[i] : HUGE_VALF;
            for (int c = 0; c < 3; ++c) /* right, up, back to right, down, forward */
                p->normals[3 * i + (size_t)c] =
                    (c ? -1.0f : 1.0f) * (m[3 * c] * from[0] + m[3 * c + 1] * from[1] + m[3 * c + 2] * from[2]);
        }
        p->view =
            (view){w, h, s.focal_px, (float)w / 2, (float)h / 2, s.ao_distance, picture_falloff, p->z, p->normals};
        scene_free(&s);
        return p->z && p->normals;
    }
    image map;
    if (!image_read_depth("tests/data/jacksboro.pfm", &map, &error)) {
        fprintf(stderr, "%s\n", error.text);
        return false;
    }
    p->name = "jacksboro";
    p->z = map.data; /* both from malloc */
    p->pixel_size[0] = 75.0f, p->pixel_size[1] = 92.0f;
    p->view = (view){map.width, map.height, 1, 0, 0, 100 * p->pixel_size[0], picture_falloff, p->z, NULL};
    return true;
}

bool picture_open(picture *p, const char *name, int width, int height, pool *threads) {
    static const char *const files[] = {"courtyard", "scans", "study", "jacksboro"};
    bool file = false;
    for (size_t k = 0; k < sizeof files / sizeof *files; ++k)
        file = file || strcmp(name, files[k]) == 0;
    if (!(file ? picture_read(p, name) : picture_render(p, name, width, height, threads)))
        return false;
    size_t n = view_pixels(&p->view);
    p->scratch_size = 160 * n + (1u << 22);
    p->visibility = calloc(n, sizeof(float));
    p->bent = calloc(n, 4 * sizeof(float));
    p->packed = calloc(n, sizeof(uint32_t));
    p->scratch = malloc(p->scratch_size);
    if (!p->visibility || !p->bent || !p->packed || !p->scratch) {
        picture_close(p);
        return false;
    }
    /* Touched: no page is missing when the clock runs. */
    memset(p->visibility, 0, n * sizeof(float));
    memset(p->bent, 0, 4 * n * sizeof(float));
    memset(p->packed, 0, n * sizeof(uint32_t));
    memset(p->scratch, 0, p->scratch_size);
    return true;
}

void picture_reserve(picture *p, const gtao_desc *desc) {
    size_t size = gtao_scratch_size(desc);
    if (size <= p->scratch_size)
        return;
    free(p->scratch);
    p->scratch = malloc(size);
    if (!p->scratch) {
        fprintf(stderr, "bench: out of memory\n");
        exit(1);
    }
    p->scratch_size = size;
    memset(p->scratch, 0, size);
}

double radius_px(const picture *p, double cap) {
    double sum = 0, count = 0;
    for (size_t i = 0; i < view_pixels(&p->view); ++i)
        if (p->z[i] < VIEW_SKY) {
            sum += fmin(cap, (double)(p->view.radius * p->view.focal_px / p->z[i]));
            count += 1;
        }
    return count > 0 ? sum / count : 0;
}

double ns_a_pixel(const timed *t, const picture *p) {
    return 1e9 * t->seconds / (double)view_pixels(&p->view);
}

job production(const picture *p) {
    job j;
    memset(&j, 0, sizeof j);
    j.picture = p;
    j.desc = view_describe(&p->view);
    if (p->pixel_size[0] > 0) {
        j.desc.depth_kind = GTAO_DEPTH_HEIGHT;
        j.desc.camera.projection = GTAO_ORTHOGRAPHIC;
        j.desc.camera.sx = p->pixel_size[0], j.desc.camera.sy = p->pixel_size[1];
        j.desc.sky_z = 0;
    }
    j.desc.max_radius_px = PICTURE_CAP_PX;
    j.desc.slices = PICTURE_SLICES;
    j.desc.steps = PICTURE_STEPS;
    j.output.visibility = p->visibility;
    return j;
}

static void check(gtao_result r) {
    if (r != GTAO_OK) {
        fprintf(stderr, "bench: %s\n", gtao_result_string(r));
        exit(1);
    }
}

double samples_a_pixel(const job *j) {
    gtao_stats stats;
    memset(&stats, 0, sizeof stats);
    check(gtao_compute(&j->desc, &j->output, j->picture->scratch, j->picture->scratch_size, &stats));
    return (double)stats.samples / (double)view_pixels(&j->picture->view);
}

void run_library(void *user) {
    const job *j = user;
    check(gtao_compute(&j->desc, &j->output, j->picture->scratch, j->picture->scratch_size, NULL));
}

void run_begin(void *user) {
    job *j = user;
    check(gtao_begin(&j->desc, &j->output, j->picture->scratch, j->picture->scratch_size, &j->context));
}

static void prepare_rows(void *user, int thread, int row_begin, int row_end) {
    const job *j = user;
    (void)thread;
    gtao_prepare_rows(j->context, row_begin, row_end);
}

static void visibility_rows(void *user, int thread, int row_begin, int row_end) {
    const job *j = user;
    (void)thread;
    gtao_visibility_rows(j->context, row_begin, row_end, NULL);
}

void run_prepare(void *user) {
    prepare_rows(user, 0, 0, ((job *)user)->desc.height);
}

void run_visibility(void *user) {
    visibility_rows(user, 0, 0, ((job *)user)->desc.height);
}

void run_threads(void *user) {
    job *j = user;
    int chunk = j->chunk ? j->chunk : GTAO_STRIP;
    run_begin(j);
    pool_run(j->threads, j->desc.height, chunk, prepare_rows, NULL, j);
    pool_run(j->threads, j->desc.height, chunk, visibility_rows, NULL, j);
}
