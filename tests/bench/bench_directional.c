/* bench_directional - diffuse light of a probe behind occluders: methods against ray tracing.
 *
 *     build/bench_directional [--size WIDTHxHEIGHT] [--rays N] [--threads N] [SCENE...]
 *
 * Truth: the mean over cosine-distributed rays of V(w) L(w), rays as long as the scene's radius, L the probe itself,
 * not its coefficients. All methods get the probe's nine coefficients, and visibility, bent normal and coefficients of
 * visibility from the depth buffer (gtao.h, 32 slices, every pixel), as a height field or with a thickness of a fifth
 * of the radius, or from the same rays, which leaves the error of the method alone:
 *   ao x irradiance   A E(n)
 *   bent normal       A E(b), [Lan02]
 *   triple product    probe, visibility cone and clamped cosine, three bands each, multiplied [Sny06]
 *   triple with horizons: that, the visibility's own coefficients in place of the cone's
 *   cone              gtao_sh_from_cone
 *   horizons          gtao_output.sh
 * Writes build/bench/directional.csv and directional.png; prints the errors as published. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "dataset.h"
#include "examples/common/canvas.h"
#include "gtao.h"
#include "tests/compute.h"
#include "trace.h"

enum { PROBES = 3, METHODS = 6, SOURCES = 3, MOST_SCENES = 16 };

static const char *const probe_names[PROBES] = {"sun and sky", "window", "lamps"};
static const char *const source_names[SOURCES] = {"depth", "thick", "rays"};
static const char *const method_names[METHODS] = {"ao x irradiance",      "bent normal", "triple product",
                                                  "triple with horizons", "cone",        "horizons"};

/* ---- probes: radiance in world space, y up ----------------------------------------------------------------------- */

static double lobe(vec3 d, double elevation_degrees, double azimuth_degrees, double sharpness) {
    double e = elevation_degrees * V3_PI / 180, a = azimuth_degrees * V3_PI / 180;
    return exp(sharpness * (v3_dot(d, v3(cos(e) * sin(a), sin(e), cos(e) * cos(a))) - 1));
}

static double step_between(double a, double b, double x) {
    double t = fmin(1, fmax(0, (x - a) / (b - a)));
    return t * t * (3 - 2 * t);
}

static vec3 radiance(int probe, vec3 d) {
    vec3 l;
    if (probe == 0) { /* afternoon: the sun's disc blurred to some ten degrees, blue sky, pale horizon, earth below */
        double up = step_between(0, 0.6, d.y), ground = step_between(-0.02, 0.02, -d.y), haze = lobe(d, 35, 40, 4);
        l = v3_add(v3_scale(v3(0.75, 0.8, 0.85), 1 - up), v3_scale(v3(0.15, 0.3, 0.7), up));
        l = v3_add(v3_scale(l, 1 - ground), v3_scale(v3(0.22, 0.18, 0.12), ground));
        l = v3_mad(l, v3(0.5, 0.42, 0.3), haze);
        return v3_mad(l, v3(14, 12, 9), lobe(d, 35, 40, 80) * (1 - ground));
    }
    if (probe == 1) { /* a room with one window and its light on the floor */
        double azimuth = atan2(d.x, d.z) * 180 / V3_PI + 70, elevation = asin(fmin(1, fmax(-1, d.y))) * 180 / V3_PI;
        double window = step_between(-27, -23, azimuth) * step_between(-27, -23, -azimuth) *
                        step_between(-2, 2, elevation) * step_between(-47, -43, -elevation);
        l = v3_scale(v3(0.12, 0.11, 0.1), 1 + 0.5 * d.y);
        l = v3_mad(l, v3(0.6, 0.55, 0.5), lobe(d, -55, -70, 6));
        return v3_mad(l, v3(7, 8, 10), window);
    }
    l = v3(0.04, 0.04, 0.05); /* night: a sodium lamp high on the left, a blue sign low on the right */
    l = v3_mad(l, v3(9, 4.5, 1), lobe(d, 50, -80, 40));
    return v3_mad(l, v3(1, 3, 8), lobe(d, 10, 75, 25));
}

typedef struct light {
    double scale;              /* to a mean radiance of 1 */
    vec3 right, down, forward; /* of the camera */
    float sh[27];              /* view space */
} light;

/* Radiance in the direction d of view space. */
static vec3 light_at(const light *l, int probe, vec3 d) {
    vec3 world = v3_add(v3_add(v3_scale(l->right, d.x), v3_scale(l->down, d.y)), v3_scale(l->forward, d.z));
    return v3_scale(radiance(probe, world), l->scale);
}

static vec3 sphere_direction(int i, int j, int rings, int sectors) {
    double z = 1 - 2 * (i + 0.5) / rings, r = sqrt(1 - z * z), phi = 2 * V3_PI * (j + 0.5) / sectors;
    return v3(r * cos(phi), z, r * sin(phi));
}

static void basis(vec3 d, float sh[9]) {
    const float f[3] = {(float)d.x, (float)d.y, (float)d.z};
    gtao_sh_basis(f, sh);
}

static void light_setup(light *l, int probe, const bench_scene_camera *camera) {
    enum { RINGS = 512, SECTORS = 512 };
    double sum = 0, sh[27] = {0};
    l->right = camera->right, l->down = camera->down, l->forward = camera->forward, l->scale = 1;
    for (int i = 0; i < RINGS; ++i)
        for (int j = 0; j < SECTORS; ++j) {
            vec3 d = sphere_direction(i, j, RINGS, SECTORS), c = light_at(l, probe, d);
            float y[9];
            basis(d, y);
            sum += (c.x + c.y + c.z) / 3;
            for (int k = 0; k < 9; ++k)
                sh[3 * k] += c.x * (double)y[k], sh[3 * k + 1] += c.y * (double)y[k],
                    sh[3 * k + 2] += c.z * (double)y[k];
        }
    l->scale = RINGS * SECTORS / sum;
    for (int k = 0; k < 27; ++k)
        l->sh[k] = (float)(sh[k] * l->scale * 4 * V3_PI / (RINGS * SECTORS));
}

/* ---- methods ----------------------------------------------------------------------------------------------------- */

/* Integrals of three harmonics' product. */
static double triple[9][9][9];

static void triple_setup(void) {
    enum { RINGS = 1000, SECTORS = 16 };
    for (int i = 0; i < RINGS; ++i)
        for (int j = 0; j < SECTORS; ++j) {
            float y[9];
            basis(sphere_direction(i, j, RINGS, SECTORS), y);
            for (int a = 0; a < 9; ++a)
                for (int b = 0; b < 9; ++b)
                    for (int c = 0; c < 9; ++c)
                        triple[a][b][c] += (double)(y[a] * y[b] * y[c]) * 4 * V3_PI / (RINGS * SECTORS);
        }
}

/* Zonal harmonics k0, k1, k2 about d. */
static void zonal(double k0, double k1, double k2, const float d[3], float sh[9]) {
    gtao_sh_basis(d, sh);
    for (int i = 0; i < 9; ++i)
        sh[i] *= (float)(i == 0 ? k0 : i < 4 ? k1 : k2);
}

/* Coefficients of the product of visibility and clamped cosine, over pi. */
static void product(const float visibility[9], const float normal[3], float sh[9]) {
    float cosine[9];
    zonal(V3_PI, 2 * V3_PI / 3, V3_PI / 4, normal, cosine);
    for (int i = 0; i < 9; ++i) {
        double sum = 0;
        for (int j = 0; j < 9; ++j)
            for (int k = 0; k < 9; ++k)
                sum += triple[i][j][k] * (double)visibility[j] * (double)cosine[k];
        sh[i] = (float)(sum / V3_PI);
    }
}

typedef struct pixel {
    float visibility, normal[3], bent[3];
    float sh[9];   /* of visibility times cosine over pi */
    float cone[9]; /* of visibility alone */
} pixel;

/* What a method takes for the coefficients of visibility times cosine over pi. */
static void coefficients(int method, const pixel *p, float sh[9]) {
    float v[9], nb = p->normal[0] * p->bent[0] + p->normal[1] * p->bent[1] + p->normal[2] * p->bent[2];
    double u = (double)gtao_cone_cosine(p->visibility, nb);
    switch (method) {
    case 0:
        zonal((double)p->visibility, 2.0 / 3 * (double)p->visibility, 0.25 * (double)p->visibility, p->normal, sh);
        break;
    case 1:
        zonal((double)p->visibility, 2.0 / 3 * (double)p->visibility, 0.25 * (double)p->visibility, p->bent, sh);
        break;
    case 2:
        zonal(2 * V3_PI * (1 - u), V3_PI * (1 - u * u), V3_PI * (u - u * u * u), p->bent, v);
        product(v, p->normal, sh);
        break;
    case 3:
        product(p->cone, p->normal, sh);
        break;
    case 4:
        gtao_sh_from_cone(p->visibility, p->bent, p->normal, sh);
        break;
    default:
        memcpy(sh, p->sh, sizeof p->sh);
        break;
    }
}

/* ---- one scene --------------------------------------------------------------------------------------------------- */

typedef struct work {
    bench_scene scene;
    view v;
    trace *rays;
    int strata;
    light lights[PROBES];
    float *z, *normals;
    float
        *traced; /* per pixel: light of the probes, 3 each; SH of visibility times cosine, and of visibility, by rays */
    struct {
        float *visibility, *bent, *sh, *uniform; /* the last two as planes */
    } own[SOURCES - 1];                          /* by gtao.h, without and with thickness */
} work;

enum { TRACED = 3 * PROBES + 18 };

static void sink(void *user, size_t i, vec3 direction, bool visible) {
    work *w = user;
    if (!visible)
        return;
    float *out = w->traced + TRACED * i, y[9];
    const float *n = w->normals + 3 * i;
    double cosine = direction.x * (double)n[0] + direction.y * (double)n[1] + direction.z * (double)n[2];
    float share = 1.0f / (float)(w->strata * w->strata);
    for (int k = 0; k < PROBES; ++k) {
        vec3 c = light_at(&w->lights[k], k, direction);
        out[3 * k] += (float)c.x * share, out[3 * k + 1] += (float)c.y * share, out[3 * k + 2] += (float)c.z * share;
    }
    basis(direction, y);
    for (int k = 0; k < 9; ++k) {
        out[3 * PROBES + k] += y[k] * share;
        out[3 * PROBES + 9 + k] += y[k] * share * (float)(V3_PI / fmax(cosine, 1e-3));
    }
}

static void primary_rows(void *user, int thread, int row_begin, int row_end) {
    work *w = user;
    (void)thread;
    trace_primary_rows(w->rays, &w->scene.camera, w->z, w->normals, row_begin, row_end);
}

static void traced_rows(void *user, int thread, int row_begin, int row_end) {
    work *w = user;
    (void)thread;
    trace_each_rows(w->rays, &w->v, w->strata, sink, w, row_begin, row_end);
}

static void work_free(work *w) {
    trace_close(w->rays);
    free(w->z);
    free(w->normals);
    free(w->traced);
    for (int k = 0; k < SOURCES - 1; ++k) {
        free(w->own[k].visibility);
        free(w->own[k].bent);
        free(w->own[k].sh);
        free(w->own[k].uniform);
    }
    bench_scene_free(&w->scene);
    memset(w, 0, sizeof *w);
}

static gtao_desc desc_of(const view *v) {
    gtao_desc desc = {0};
    desc.width = v->width, desc.height = v->height;
    desc.depth = v->z, desc.sky_z = VIEW_SKY;
    desc.normals = v->normals;
    desc.camera.fx = v->focal_px;
    desc.camera.off_center = 1, desc.camera.cx = v->cx, desc.camera.cy = v->cy;
    desc.radius = v->radius;
    desc.preset = GTAO_PRESET_REFERENCE;
    return desc;
}

static bool run_gtao(const gtao_desc *desc, const gtao_output *output) {
    gtao_result result = compute_output(desc, output);
    if (result != GTAO_OK)
        fprintf(stderr, "%s\n", gtao_result_string(result));
    return result == GTAO_OK;
}

static bool work_open(work *w, int index, int width, int height, int strata, pool *threads) {
    memset(w, 0, sizeof *w);
    if (!bench_scene_build(&w->scene, index, width, height))
        return false;
    const bench_scene_camera *c = &w->scene.camera;
    size_t n = (size_t)width * (size_t)height;
    w->strata = strata;
    w->z = calloc(n, sizeof(float));
    w->normals = calloc(3 * n, sizeof(float));
    w->traced = calloc(TRACED * n, sizeof(float));
    w->rays = trace_open(&w->scene);
    if (!w->z || !w->normals || !w->traced || !w->rays)
        return false;
    w->v.width = width, w->v.height = height;
    w->v.focal_px = (float)c->focal_px, w->v.cx = (float)c->cx, w->v.cy = (float)c->cy;
    w->v.radius = (float)w->scene.radius;
    w->v.z = w->z, w->v.normals = w->normals;
    for (int k = 0; k < PROBES; ++k)
        light_setup(&w->lights[k], k, c);
    pool_run(threads, height, 0, primary_rows, NULL, w);
    pool_run(threads, height, 0, traced_rows, NULL, w);

    for (int k = 0; k < SOURCES - 1; ++k) {
        gtao_desc desc = desc_of(&w->v);
        gtao_output output = {0}, uniform = {0};
        output.visibility = w->own[k].visibility = calloc(n, sizeof(float));
        output.bent_normals = w->own[k].bent = calloc(3 * n, sizeof(float));
        output.sh = w->own[k].sh = calloc(9 * n, sizeof(float));
        uniform.sh = w->own[k].uniform = calloc(9 * n, sizeof(float));
        if (!output.visibility || !output.bent_normals || !output.sh || !uniform.sh)
            return false;
        if (k == 1)
            desc.thickness = 0.2f * w->v.radius;
        bool ok = run_gtao(&desc, &output);
        desc.weighting = GTAO_WEIGHTING_UNIFORM;
        if (!ok || !run_gtao(&desc, &uniform))
            return false;
    }
    return true;
}

static pixel pixel_at(const work *w, size_t i, int source) {
    size_t n = view_pixels(&w->v);
    pixel p;
    memcpy(p.normal, w->normals + 3 * i, sizeof p.normal);
    if (source < SOURCES - 1) {
        p.visibility = w->own[source].visibility[i];
        memcpy(p.bent, w->own[source].bent + 3 * i, sizeof p.bent);
        for (int k = 0; k < 9; ++k) {
            p.sh[k] = w->own[source].sh[(size_t)k * n + i];
            p.cone[k] = w->own[source].uniform[(size_t)k * n + i] * (float)(2 * V3_PI);
        }
        return p;
    }
    memcpy(p.sh, w->traced + TRACED * i + 3 * PROBES, sizeof p.sh);
    memcpy(p.cone, w->traced + TRACED * i + 3 * PROBES + 9, sizeof p.cone);
    p.visibility = fminf(p.sh[0] / 0.28209479f, 1.0f);
    float length = sqrtf(p.sh[1] * p.sh[1] + p.sh[2] * p.sh[2] + p.sh[3] * p.sh[3]);
    for (int k = 0; k < 3; ++k)
        p.bent[k] = length > 0 ? p.sh[k == 0 ? 3 : k] / length : p.normal[k];
    return p;
}

typedef struct error {
    double rmse, mean;
} error;

static error compare(const work *w, int source, int method, int probe) {
    error e = {0, 0};
    double count = 0;
    for (size_t i = 0; i < view_pixels(&w->v); ++i) {
        if (!(w->z[i] < VIEW_SKY))
            continue;
        pixel p = pixel_at(w, i, source);
        float sh[9], rgb[3];
        coefficients(method, &p, sh);
        gtao_irradiance(sh, w->lights[probe].sh, rgb);
        for (int k = 0; k < 3; ++k) {
            double off = (double)rgb[k] - (double)w->traced[TRACED * i + 3 * (size_t)probe + (size_t)k];
            e.rmse += off * off, e.mean += off, count += 1;
        }
    }
    e.rmse = sqrt(e.rmse / count), e.mean /= count;
    return e;
}

/* ---- picture ----------------------------------------------------------------------------------------------------- */

static const int shown[] = {0, 1, 2, 4, 5};
enum { SHOWN = 5, TEXT = 26, GAP = 4 };

static bool draw(const work *w, int probe, const char *path) {
    image canvas, one;
    image_error problem;
    image_pending file;
    int width = w->v.width, height = w->v.height;
    if (!image_create(&canvas, (SHOWN + 1) * (width + GAP) - GAP, 2 * height + GAP + TEXT, 3, &problem) ||
        !image_create(&one, width, height, 3, &problem)) {
        fprintf(stderr, "%s\n", problem.text);
        return false;
    }
    canvas_load_fonts();
    canvas_fill(&canvas, 0, 0, canvas.width, canvas.height, color_hex(0xffffff));
    for (int column = 0; column <= SHOWN; ++column) {
        int left = column * (width + GAP);
        canvas_text(&canvas, (float)left + 2, TEXT - 9, CANVAS_LEFT, CANVAS_REGULAR, 14, color_hex(0x222222),
                    column ? method_names[shown[column - 1]] : "ray-traced");
        for (int difference = 0; difference < (column ? 2 : 1); ++difference) {
            for (size_t i = 0; i < view_pixels(&w->v); ++i) {
                const float *truth = w->traced + TRACED * i + 3 * probe;
                float rgb[3] = {truth[0], truth[1], truth[2]}, off = 0;
                bool surface = w->z[i] < VIEW_SKY;
                if (column) {
                    pixel p = pixel_at(w, i, 1);
                    float sh[9];
                    coefficients(shown[column - 1], &p, sh);
                    gtao_irradiance(sh, w->lights[probe].sh, rgb);
                    for (int k = 0; k < 3; ++k)
                        off += (rgb[k] - truth[k]) / 3;
                }
                color c = {rgb[0] * 0.35f, rgb[1] * 0.35f, rgb[2] * 0.35f};
                c = difference ? color_difference(fminf(1, fmaxf(-1, off))) : color_encode(c);
                if (!surface)
                    c = color_hex(0x808080);
                one.data[3 * i] = c.r, one.data[3 * i + 1] = c.g, one.data[3 * i + 2] = c.b;
            }
            canvas_draw(&canvas, left, TEXT + difference * (height + GAP), &one);
        }
    }
    canvas_text(&canvas, 2, (float)(TEXT + height + GAP + 22), CANVAS_LEFT, CANVAS_REGULAR, 14, color_hex(0x222222),
                "below: difference");
    canvas_text(&canvas, 2, (float)(TEXT + height + GAP + 40), CANVAS_LEFT, CANVAS_REGULAR, 14, color_hex(0x222222),
                "(blue: too dark)");
    canvas_free_fonts();
    bool ok = image_write(path, &canvas, NULL, IMAGE_RANGE_UNIT, &file, &problem) && image_commit(&file, &problem);
    if (!ok)
        fprintf(stderr, "%s\n", problem.text);
    image_free(&canvas);
    image_free(&one);
    return ok;
}

/* ---- cost -------------------------------------------------------------------------------------------------------- */

static double seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* ns per pixel of the preset for: visibility; and bent normals; and coefficients. The least of several runs in turn. */
static bool cost(const work *w, double ns[3]) {
    gtao_desc desc = desc_of(&w->v);
    desc.preset = GTAO_PRESET_MEDIUM;
    for (int run = 0; run < 9; ++run)
        for (int k = 0; k < 3; ++k) {
            gtao_output output = {0};
            output.visibility = w->own[0].visibility;
            output.bent_normals = k ? w->own[0].bent : NULL;
            output.sh = k > 1 ? w->own[0].sh : NULL;
            double start = seconds(), took;
            if (!run_gtao(&desc, &output))
                return false;
            took = 1e9 * (seconds() - start) / (double)view_pixels(&w->v);
            if (run == 0 || took < ns[k])
                ns[k] = took;
        }
    return true;
}

static int usage(void) {
    fprintf(stderr, "usage: bench_directional [--size WIDTHxHEIGHT] [--rays N] [--threads N] [SCENE...]\n");
    return 2;
}

int main(int argc, char **argv) {
    int width = 240, height = 135, rays = 1024, threads = (int)sysconf(_SC_NPROCESSORS_ONLN), k = 1, status = 1;
    for (; k + 1 < argc && argv[k][0] == '-'; k += 2) {
        const char *name = argv[k], *value = argv[k + 1];
        bool ok = strcmp(name, "--size") == 0      ? sscanf(value, "%dx%d", &width, &height) == 2
                  : strcmp(name, "--rays") == 0    ? sscanf(value, "%d", &rays) == 1
                  : strcmp(name, "--threads") == 0 ? sscanf(value, "%d", &threads) == 1
                                                   : false;
        if (!ok)
            return usage();
    }
    int strata = (int)(sqrt((double)rays) + 0.5);
    if ((k < argc && argv[k][0] == '-') || width < 1 || height < 1 || width > 4096 || height > 4096 || strata < 1 ||
        !bench_scenes_exist("bench_directional", argc - k, argv + k))
        return usage();
    pool *p = pool_create(threads);
    FILE *csv = p && make_folders("build/bench") ? fopen("build/bench/directional.csv", "w") : NULL;
    if (!csv) {
        perror("build/bench/directional.csv");
        pool_destroy(p);
        return 1;
    }
    triple_setup();
    fprintf(csv, "scene,source,method,probe,rmse,mean\n");
    for (int i = 0; i < bench_scene_count(); ++i) {
        static work w;
        double ns[3];
        if (!bench_scene_chosen(i, argc - k, argv + k))
            continue;
        if (!work_open(&w, i, width, height, strata, p)) {
            work_free(&w);
            goto done;
        }
        for (int source = 0; source < SOURCES; ++source) {
            printf("%-10s %-5s", w.scene.name, source_names[source]);
            for (int method = 0; method < METHODS; ++method) {
                double mean = 0;
                for (int probe = 0; probe < PROBES; ++probe) {
                    error e = compare(&w, source, method, probe);
                    fprintf(csv, "%s,%s,%s,%s,%.6f,%.6f\n", w.scene.name, source_names[source], method_names[method],
                            probe_names[probe], e.rmse, e.mean);
                    mean += e.rmse * e.rmse / PROBES;
                }
                printf("  %s %.4f", method_names[method], sqrt(mean));
            }
            printf("\n");
        }
        bool ok =
            (strcmp(w.scene.name, "furniture") != 0 || draw(&w, 2, "build/bench/directional.png")) && cost(&w, ns);
        fprintf(csv, "%s,cost,medium,ns,%.3f,%.3f\n%s,cost,medium,ns sh,%.3f,0\n", w.scene.name, ns[0], ns[1],
                w.scene.name, ns[2]);
        printf("%-10s ns per pixel, 2 x 12: visibility %.1f, bent normals %.1f, coefficients %.1f\n", w.scene.name,
               ns[0], ns[1], ns[2]);
        work_free(&w);
        if (!ok)
            goto done;
    }
    status = 0;
done:
    if (fclose(csv) != 0)
        status = 1;
    pool_destroy(p);
    return status;
}
