#include "speed.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "examples/common/cli.h"
#include "picture.h"
#include "scenes.h"
#include "tests/reference/reference.h"

static const char *const setting = "1 slice x 8 steps";

static FILE *csv;

static void row(const char *group, const char *scene, const char *what, double x, double value, const char *unit,
                double ratio, const char *baseline) {
    fprintf(csv, "%s,%s,%s,%.6g,%.6g,%s,%.4g,%s\n", group, scene, what, x, value, unit, ratio, baseline);
    fflush(csv);
}

static void run_transcription(void *user) {
    const job *j = user;
    const view *v = &j->picture->view;
    float direction[16], offset[16];
    memo_settings s = {PICTURE_SLICES, PICTURE_STEPS, v->radius, v->falloff, PICTURE_CAP_PX};
    memo_noise(0, direction, offset);
    memo_gtao(v->width, v->height, v->z, v->normals, v->focal_px, v->cx, v->cy, &s, direction, offset,
              j->picture->visibility);
}

static void run_floor(void *user) {
    const job *j = user;
    loadmax_run(j->floor);
}

/* ---- the groups -------------------------------------------------------------------------------------------------- */

static void instruction_sets(const picture *p, int repeat) {
    static const gtao_isa isas[] = {GTAO_ISA_SCALAR, GTAO_ISA_SSE2, GTAO_ISA_AVX2, GTAO_ISA_AVX512, GTAO_ISA_NEON};
    job j[8];
    timed t[8];
    const char *name[8];
    int n = 0;
    j[n] = production(p), name[n] = "transcription", t[n] = (timed){run_transcription, &j[n], 0}, ++n;
    for (size_t k = 0; k < sizeof isas / sizeof *isas; ++k)
        if (gtao_isa_available(isas[k])) {
            j[n] = production(p);
            j[n].desc.isa = isas[k];
            name[n] = gtao_isa_name(isas[k]);
            t[n] = (timed){run_library, &j[n], 0}, ++n;
        }
    measure(t, n, repeat, thread_seconds);
    for (int k = 0; k < n; ++k)
        row("isa", p->name, name[k], radius_px(p, PICTURE_CAP_PX), ns_a_pixel(&t[k], p), "ns/pixel",
            t[0].seconds / t[k].seconds, "transcription of the memo");
    printf("  %-10s transcription %.0f ns/pixel, %s %.2f: %.1f times\n", p->name, ns_a_pixel(&t[0], p), name[n - 1],
           ns_a_pixel(&t[n - 1], p), t[0].seconds / t[n - 1].seconds);
}

/* Slope of ns/pixel over samples a pixel by least squares. */
static double slope(const double *x, const double *y, int n) {
    double mx = 0, my = 0, xx = 0, xy = 0;
    for (int k = 0; k < n; ++k)
        mx += x[k] / n, my += y[k] / n;
    for (int k = 0; k < n; ++k)
        xx += (x[k] - mx) * (x[k] - mx), xy += (x[k] - mx) * (y[k] - my);
    return xy / xx;
}

/* The cost of one more sample, beside loading the same samples and taking their maximum. `capped`: the radius is beyond
 * the cap at every pixel, so both read exactly the same samples; else the floor takes the mean radius. */
static void marginal(const picture *p, int repeat, bool capped, float f) {
    static const int steps[] = {8, 16, 32};
    enum { N = 3 };
    job j[2 * N];
    timed t[2 * N];
    double samples[2 * N], ns[2 * N], reach = capped ? PICTURE_CAP_PX : radius_px(p, PICTURE_CAP_PX);
    char what[64];
    for (int k = 0; k < N; ++k) {
        j[k] = production(p);
        j[k].desc.steps = steps[k];
        j[k].desc.falloff = f;
        if (capped)
            j[k].desc.radius = p->view.radius * 1e4f;
        j[N + k] = j[k];
        j[N + k].floor = loadmax_open(&p->view, steps[k], (float)reach);
        if (!j[N + k].floor)
            exit(1);
        samples[k] = samples_a_pixel(&j[k]);
        samples[N + k] = loadmax_samples(j[N + k].floor);
        t[k] = (timed){run_library, &j[k], 0};
        t[N + k] = (timed){run_floor, &j[N + k], 0};
    }
    measure(t, 2 * N, repeat, thread_seconds);
    for (int k = 0; k < 2 * N; ++k)
        ns[k] = ns_a_pixel(&t[k], p);
    double ours = slope(samples, ns, N), least = slope(samples + N, ns + N, N);
    const char *kind = capped ? "beyond the cap" : "scene's radius";
    snprintf(what, sizeof what, "%s; falloff %g", kind, (double)f);
    for (int k = 0; k < N; ++k) {
        row("marginal_points", p->name, what, samples[k], ns[k], "ns/pixel", ns[k] / ns[0], "8 steps");
        row("floor_points", p->name, what, samples[N + k], ns[N + k], "ns/pixel", ns[N + k] / ns[N], "8 steps");
        loadmax_close(j[N + k].floor);
    }
    row("marginal", p->name, what, reach, ours, "ns/sample", ours / least, "load and maximum");
    row("floor", p->name, what, reach, least, "ns/sample", 1, "load and maximum");
    printf("  %-10s %s: %.3f ns a sample, %.2f times load and maximum (%.3f)\n", p->name, what, ours, ours / least,
           least);
}

static void nearness(const picture *p, int repeat) {
    enum { N = 7 };
    job j[N];
    timed t[N];
    picture scaled[N];
    for (int k = 0; k < N; ++k) {
        /* Nearer by 2^k: the image is the same, the radius reaches further over it. */
        scaled[k] = *p;
        j[k] = production(&scaled[k]);
        j[k].desc.radius = p->view.radius * (float)(1 << k);
        t[k] = (timed){run_library, &j[k], 0};
    }
    measure(t, N, repeat, thread_seconds);
    for (int k = 0; k < N; ++k)
        row("nearness", p->name, setting, 1.0 / (1 << k), ns_a_pixel(&t[k], p), "ns/pixel", t[k].seconds / t[0].seconds,
            "depth times 1");
}

/* Without the cap, at the radius that is so many pixels long on average. */
static void radii(const picture *p, int repeat) {
    enum { N = 8 };
    job j[2 * N];
    timed t[2 * N];
    double all = radius_px(p, 1e30);
    for (int k = 0; k < 2 * N; ++k) {
        j[k] = production(p);
        j[k].desc.max_radius_px = 0;
        j[k].desc.every_pixel = k >= N;
        j[k].desc.radius = p->view.radius * (float)((4 << (k % N)) / all);
        t[k] = (timed){run_library, &j[k], 0};
    }
    measure(t, 2 * N, repeat, thread_seconds);
    for (int k = 0; k < 2 * N; ++k)
        row(k < N ? "radius" : "radius_every_pixel", p->name, k < N ? setting : "1 slice; every pixel", 4 << (k % N),
            ns_a_pixel(&t[k], p), "ns/pixel", t[k].seconds / t[k < N ? 0 : N].seconds, "4 pixels");
}

static void slices_and_steps(const picture *p, int repeat) {
    static const int slices[] = {1, 2, 4, 8, 16, 32, 64}, steps[] = {1, 2, 4, 8, 16, 32, 64};
    enum { N = 7 };
    job j[2 * N];
    timed t[2 * N];
    for (int k = 0; k < N; ++k) {
        j[k] = j[N + k] = production(p);
        j[k].desc.slices = slices[k];
        j[N + k].desc.steps = steps[k];
        t[k] = (timed){run_library, &j[k], 0};
        t[N + k] = (timed){run_library, &j[N + k], 0};
    }
    measure(t, 2 * N, repeat, thread_seconds);
    for (int k = 0; k < N; ++k)
        row("slices", p->name, "8 steps", slices[k], ns_a_pixel(&t[k], p), "ns/pixel", t[k].seconds / t[0].seconds,
            "1 slice");
    for (int k = 0; k < N; ++k)
        row("steps", p->name, "1 slice", steps[k], ns_a_pixel(&t[N + k], p), "ns/pixel",
            t[N + k].seconds / t[N].seconds, "1 step");
}

static void variants(const picture *p, int repeat) {
    enum { N = 15 };
    job j[N];
    timed t[N];
    static const char *const names[N] = {"visibility",
                                         "visibility in 8 bits",
                                         "visibility and bent normals",
                                         "packed visibility and bent normals",
                                         "derived normals",
                                         "derived normals; bent normals",
                                         "hard cutoff",
                                         "unbounded radius",
                                         "memo estimator",
                                         "uniform weighting",
                                         "thickness heuristic",
                                         "hilbert noise",
                                         "no noise",
                                         "clamped border",
                                         "every pixel"};
    for (int k = 0; k < N; ++k)
        j[k] = production(p);
    j[1].output.visibility_format = GTAO_FORMAT_UNORM8;
    j[2].output.bent_normals = p->bent;
    j[3].output.visibility = NULL, j[3].output.packed = p->packed;
    j[4].desc.normals = NULL;
    j[5].desc.normals = NULL, j[5].output.bent_normals = p->bent;
    j[6].desc.falloff = 0;
    j[7].desc.radius = HUGE_VALF;
    j[8].desc.estimator = GTAO_ESTIMATOR_MEMO;
    j[9].desc.weighting = GTAO_WEIGHTING_UNIFORM;
    j[10].desc.thin_blend = 0.1f;
    j[11].desc.noise = GTAO_NOISE_HILBERT;
    j[12].desc.noise = GTAO_NOISE_NONE;
    j[13].desc.border = GTAO_BORDER_CLAMP;
    j[14].desc.every_pixel = 1;
    for (int k = 0; k < N; ++k)
        t[k] = (timed){run_library, &j[k], 0};
    measure(t, N, repeat, thread_seconds);
    for (int k = 0; k < N; ++k)
        row("variant", p->name, names[k], k, ns_a_pixel(&t[k], p), "ns/pixel", t[k].seconds / t[0].seconds,
            "visibility");
}

static void scratch(const picture *p) {
    static const struct {
        const char *name;
        gtao_preset preset;
        int slices;
    } settings[] = {{"1 slice x 8 steps", GTAO_PRESET_LOW, 1}, {"low", GTAO_PRESET_LOW, 0},
                    {"medium", GTAO_PRESET_MEDIUM, 0},         {"high", GTAO_PRESET_HIGH, 0},
                    {"ultra", GTAO_PRESET_ULTRA, 0},           {"reference", GTAO_PRESET_REFERENCE, 0}};
    for (size_t k = 0; k < sizeof settings / sizeof *settings; ++k) {
        job j = production(p);
        j.desc.preset = settings[k].preset;
        j.desc.slices = settings[k].slices;
        j.desc.steps = settings[k].slices ? PICTURE_STEPS : 0;
        double bytes = (double)gtao_scratch_size(&j.desc);
        row("scratch", p->name, settings[k].name, p->view.width, bytes / (double)view_pixels(&p->view), "bytes/pixel",
            bytes, "bytes");
    }
}

/* Scenes at several resolutions; the cap in pixels stays, or grows with the image. */
static bool resolutions(pool *threads, int repeat, bool quick) {
    static const int widths[] = {480, 960, 1280, 1920, 3840};
    enum { N = 5 };
    int n = quick ? 4 : N;
    picture p[N];
    job j[2 * N];
    timed t[2 * N];
    for (int k = 0; k < n; ++k) {
        if (!picture_open(&p[k], "stairs", widths[k], widths[k] * 9 / 16, threads))
            return false;
        j[k] = j[n + k] = production(&p[k]);
        j[n + k].desc.max_radius_px = PICTURE_CAP_PX * widths[k] / PICTURE_WIDTH;
        t[k] = (timed){run_library, &j[k], 0};
        t[n + k] = (timed){run_library, &j[n + k], 0};
    }
    measure(t, 2 * n, repeat, thread_seconds);
    for (int k = 0; k < 2 * n; ++k)
        row(k < n ? "resolution" : "resolution_scaled_cap", "stairs", setting, widths[k % n],
            ns_a_pixel(&t[k], &p[k % n]), "ns/pixel", t[k].seconds / t[k < n ? 1 : n + 1].seconds, "960x540");
    printf("  1920x1080 costs %.2f times 960x540\n", t[3].seconds / t[1].seconds);
    for (int k = 0; k < n; ++k)
        picture_close(&p[k]);
    return true;
}

static bool thread_counts(pool *threads, int repeat) {
    static const struct {
        const char *name;
        int width;
        gtao_preset preset;
    } work[] = {{"960x540 medium", 960, GTAO_PRESET_MEDIUM}, {"1920x1080 high", 1920, GTAO_PRESET_HIGH}};
    enum { MOST = 8 };
    int most = pool_threads(threads);
    most = most > MOST ? MOST : most;
    for (size_t w = 0; w < sizeof work / sizeof *work; ++w) {
        picture p;
        job j[MOST];
        timed t[MOST];
        bool ok = picture_open(&p, "furniture", work[w].width, work[w].width * 9 / 16, threads);
        for (int k = 0; k < most; ++k) {
            j[k] = production(&p);
            j[k].desc.slices = j[k].desc.steps = 0;
            j[k].desc.preset = work[w].preset;
            j[k].threads = pool_create(k + 1);
            ok = ok && j[k].threads;
            t[k] = (timed){run_threads, &j[k], 0};
        }
        if (ok)
            measure(t, most, 2 * repeat + 1, wall_seconds);
        for (int k = 0; k < most; ++k) {
            if (ok)
                row("threads", "furniture", work[w].name, k + 1, ns_a_pixel(&t[k], &p), "ns/pixel",
                    t[0].seconds / t[k].seconds, "1 thread");
            pool_destroy(j[k].threads);
        }
        if (!ok)
            return false;
        if (most > 1)
            printf("  %s: two threads are %.2f times as fast as one\n", work[w].name, t[0].seconds / t[1].seconds);
        picture_close(&p);
    }
    return true;
}

/* What each skip saves, alone and with the others, at two settings; and what a tolerance adds. */
static void skips(const picture *p, FILE *to, int repeat) {
    static const struct {
        const char *name;
        unsigned no_skip;
        float tolerance;
    } kinds[] = {{"none", GTAO_SKIP_ALL, 0},
                 {"sky", GTAO_SKIP_ALL & ~GTAO_SKIP_SKY, 0},
                 {"open", GTAO_SKIP_ALL & ~GTAO_SKIP_OPEN, 0},
                 {"sectors", GTAO_SKIP_ALL & ~GTAO_SKIP_SECTORS, 0},
                 {"all", 0, 0},
                 {"tolerance 0.001", 0, 0.001f},
                 {"tolerance 0.01", 0, 0.01f}};
    enum { N = (int)(sizeof kinds / sizeof *kinds) };
    float *exact = malloc(view_pixels(&p->view) * sizeof(float));
    for (int every = 0; exact && every < 2; ++every) {
        job j[N];
        timed t[N + 2];
        for (int k = 0; k < N; ++k) {
            j[k] = production(p);
            j[k].desc.every_pixel = every;
            j[k].desc.no_skip = kinds[k].no_skip;
            j[k].desc.tolerance = kinds[k].tolerance;
            t[k] = (timed){run_library, &j[k], 0};
        }
        t[N] = (timed){run_transcription, &j[0], 0};
        t[N + 1] = (timed){run_library, &j[0], 0}; /* not counted: it brings the picture back into the caches */
        measure(t, every ? N : N + 2, repeat, thread_seconds);
        for (int k = 0; k < N; ++k) {
            gtao_stats stats;
            double pixels = (double)view_pixels(&p->view), worst = 0;
            memset(&stats, 0, sizeof stats);
            gtao_compute(&j[k].desc, &j[k].output, p->scratch, p->scratch_size, &stats);
            if (k == 0)
                memcpy(exact, p->visibility, view_pixels(&p->view) * sizeof(float));
            for (size_t i = 0; i < view_pixels(&p->view); ++i)
                worst = fmax(worst, fabs((double)p->visibility[i] - (double)exact[i]));
            fprintf(to, "%s,%s,%s,%.4g,%.4g,%.4f,%.4f,%.4f,%.2g,%.4g\n", p->name,
                    every ? "1 slice x every pixel" : setting, kinds[k].name, ns_a_pixel(&t[k], p),
                    t[0].seconds / t[k].seconds, (double)stats.sky_skipped / pixels, (double)stats.open / pixels,
                    (double)stats.samples_skipped / (double)(stats.samples + stats.samples_skipped + 1), worst,
                    every ? 0 : t[N].seconds / t[k].seconds);
        }
        if (!every)
            printf("  %s: %.1f times as fast with skips as without, %.0f times as fast as the transcription\n", p->name,
                   t[0].seconds / t[4].seconds, t[N].seconds / t[4].seconds);
    }
    free(exact);
}

/* Only none and all: what skips save on a scene. */
static void skips_in_short(const picture *p, FILE *to, int repeat) {
    for (int every = 0; every < 2; ++every) {
        job j[2];
        timed t[2];
        gtao_stats stats;
        double pixels = (double)view_pixels(&p->view);
        for (int k = 0; k < 2; ++k) {
            j[k] = production(p);
            j[k].desc.every_pixel = every;
            j[k].desc.no_skip = k == 0 ? GTAO_SKIP_ALL : 0;
            t[k] = (timed){run_library, &j[k], 0};
        }
        measure(t, 2, repeat, thread_seconds);
        memset(&stats, 0, sizeof stats);
        gtao_compute(&j[1].desc, &j[1].output, p->scratch, p->scratch_size, &stats);
        fprintf(to, "%s,%d,%d,%s,%.4g,%.4g,%.4f,%.4f,%.4f,%.4f\n", p->name, p->view.width, p->view.height,
                every ? "1 slice x every pixel" : setting, ns_a_pixel(&t[0], p), ns_a_pixel(&t[1], p),
                (double)stats.sky / pixels, (double)stats.sky_skipped / pixels, (double)stats.open / pixels,
                (double)stats.samples_skipped / (double)(stats.samples + stats.samples_skipped + 1));
    }
}

static bool skips_of_scenes(bool quick, pool *threads) {
    static const char *const more[] = {"bar", "elephant", "village", "courtyard", "scans", "study", "jacksboro"};
    int count = bench_scene_count(), all = count + (int)(sizeof more / sizeof *more);
    FILE *to = fopen("build/bench/skips_scenes.csv", "w");
    if (!to)
        return false;
    fprintf(to, "scene,width,height,setting,none,all,sky,sky_skipped,open,samples\n");
    bool ok = true;
    for (int k = 0; ok && k < all; ++k) {
        picture p;
        ok =
            picture_open(&p, k < count ? bench_scene_name(k) : more[k - count], PICTURE_WIDTH, PICTURE_HEIGHT, threads);
        if (ok) {
            skips_in_short(&p, to, quick ? 3 : 9);
            picture_close(&p);
        }
    }
    return fclose(to) == 0 && ok;
}

bool speed_skips(bool quick) {
    static const char *const names[] = {"village", "stairs", "furniture", "far", "terrain"};
    pool *threads = pool_create(cli_processors());
    FILE *to = fopen("build/bench/skips.csv", "w");
    bool ok = to && threads;
    if (to)
        fprintf(to, "scene,setting,skips,ns,factor,sky,open,samples,error,transcription\n");
    for (int k = 0; ok && k < 5; ++k) {
        picture p;
        ok = picture_open(&p, names[k], PICTURE_WIDTH, PICTURE_HEIGHT, threads);
        if (ok) {
            skips(&p, to, quick ? 3 : 9);
            picture_close(&p);
        }
    }
    ok = ok && skips_of_scenes(quick, threads);
    if (!ok)
        fprintf(stderr, "speed: build/bench/skips.csv: failed\n");
    if (to)
        fclose(to);
    pool_destroy(threads);
    return ok;
}

bool speed_run(bool quick) {
    static const char *const names[] = {"stairs", "foliage", "furniture", "terrain"};
    int repeat = quick ? 3 : 11, scenes = quick ? 3 : 4;
    pool *threads = pool_create(cli_processors());
    csv = fopen("build/bench/speed.csv", "w");
    if (!csv || !threads) {
        perror("build/bench/speed.csv");
        return false;
    }
    fprintf(csv, "group,scene,setting,x,value,unit,ratio,baseline\n");
    bool ok = true;
    for (int k = 0; k < scenes && ok; ++k) {
        picture p;
        ok = picture_open(&p, names[k], PICTURE_WIDTH, PICTURE_HEIGHT, threads);
        if (!ok)
            break;
        instruction_sets(&p, repeat);
        marginal(&p, repeat, false, picture_falloff);
        marginal(&p, repeat, false, 0);
        marginal(&p, repeat, true, picture_falloff);
        if (k == 0 || !quick) {
            nearness(&p, repeat);
            radii(&p, quick ? 2 : 5);
            slices_and_steps(&p, quick ? 2 : 5);
            variants(&p, repeat);
        }
        if (k == 0)
            scratch(&p);
        picture_close(&p);
    }
    ok = ok && resolutions(threads, quick ? 3 : 7, quick) && thread_counts(threads, repeat);
    pool_destroy(threads);
    fclose(csv);
    return ok;
}
