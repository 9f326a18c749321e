/* bench_memory - memory and what it does to gtao.h: bandwidth, large images with and without huge pages, and what
 * heights in 16 bits would save and cost.
 *
 *     build/bench_memory [--quick] DIRECTORY
 *
 * Writes build/bench/memory.csv and the tables memory-streams.md, memory-images.md, memory-buffers.md, half-error.md,
 * half-floor.md and half-gain.md into DIRECTORY. One thread and its processor time, medians of interleaved runs. */
#define _DEFAULT_SOURCE /* madvise */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#include "dataset.h"
#include "examples/common/cli.h"
#include "half.h"
#include "loadmax.h"
#include "picture.h"

static FILE *csv;
static const char *directory;

static void out_of_memory(void) {
    fprintf(stderr, "bench_memory: out of memory\n");
    exit(1);
}

/* ---- pages ------------------------------------------------------------------------------------------------------- */

enum { HUGE_PAGE = 2 << 20 };

typedef struct block {
    void *at, *mapped;
    size_t size;
} block;

/* Touched memory on pages of 4 KiB, or where the system gives them of 2 MiB. */
static block block_open(size_t size, bool huge) {
    block b;
    b.size = (size + 2 * HUGE_PAGE - 1) / HUGE_PAGE * HUGE_PAGE;
    b.mapped = mmap(NULL, b.size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (b.mapped == MAP_FAILED)
        out_of_memory();
#if defined(MADV_HUGEPAGE) && defined(MADV_NOHUGEPAGE)
    if (madvise(b.mapped, b.size, huge ? MADV_HUGEPAGE : MADV_NOHUGEPAGE) != 0 && huge)
        fprintf(stderr, "bench_memory: no huge pages here\n");
#endif
    b.at = (char *)b.mapped + (HUGE_PAGE - (size_t)((uintptr_t)b.mapped % HUGE_PAGE)) % HUGE_PAGE;
    memset(b.mapped, 0, b.size);
    return b;
}

static void block_close(block *b) {
    munmap(b->mapped, b->size);
}

/* MiB of the process that lie on huge pages. */
static double huge_mib(void) {
    char line[256];
    double kib = 0;
    FILE *file = fopen("/proc/self/smaps_rollup", "r");
    while (file && fgets(line, sizeof line, file))
        if (sscanf(line, "AnonHugePages: %lf", &kib) == 1)
            break;
    if (file)
        fclose(file);
    return kib / 1024;
}

/* ---- bandwidth --------------------------------------------------------------------------------------------------- */

typedef struct stream {
    char *at;
    size_t size;
    int times;
    uint32_t sum;
} stream;

static void run_read(void *user) {
    enum { N = 64 };
    stream *s = user;
    uint32_t sum[N] = {0};
    const uint32_t *p = (const uint32_t *)(const void *)s->at;
    for (int r = 0; r < s->times; ++r)
        for (size_t i = 0; i < s->size / sizeof *p; i += N)
            for (int k = 0; k < N; ++k)
                sum[k] += p[i + (size_t)k];
    for (int k = 0; k < N; ++k)
        s->sum += sum[k];
}

static void run_write(void *user) {
    stream *s = user;
    volatile int byte = 1; /* each round is to be written */
    for (int r = 0; r < s->times; ++r)
        memset(s->at, byte + r, s->size);
}

static void run_copy(void *user) {
    stream *s = user;
    for (int r = 0; r < s->times; ++r) {
        memcpy(s->at, s->at + s->size / 2, s->size / 2);
        s->sum += (unsigned char)s->at[(size_t)r % s->size];
    }
}

/* Returns ns for each byte read and written, from memory of 4 KiB pages. */
static void streams(bool quick, double *read_ns, double *write_ns) {
    static const size_t sizes[] = {32 << 10, 512 << 10, 8 << 20, 64 << 20};
    enum { SIZES = 6 };
    size_t large = quick ? (size_t)256 << 20 : (size_t)1 << 30;
    FILE *to = table_open(directory, "memory-streams");
    fprintf(to, "| memory | read: GB/s | write | copy (bytes copied) |\n|---|--:|--:|--:|\n");
    for (int k = 0; k < SIZES; ++k) {
        bool huge = k == SIZES - 1;
        size_t size = k < 4 ? sizes[k] : large;
        block b = block_open(size, huge);
        stream s = {b.at, size, (int)((quick ? large / 2 : large) / size), 0};
        s.times = s.times ? s.times : 1;
        timed t[3] = {{run_read, &s, 0}, {run_write, &s, 0}, {run_copy, &s, 0}};
        measure(t, 3, 5, thread_seconds);
        double bytes = (double)size * s.times, mib = (double)size / (1 << 20);
        fprintf(to, mib < 1 ? "| %.0f KiB%s |" : "| %.0f MiB%s |", mib < 1 ? 1024 * mib : mib,
                huge    ? ", huge pages"
                : k < 4 ? ""
                        : ", 4 KiB pages");
        fprintf(to, " %.1f | %.1f | %.1f |\n", 1e-9 * bytes / t[0].seconds, 1e-9 * bytes / t[1].seconds,
                0.5e-9 * bytes / t[2].seconds);
        if (!huge)
            *read_ns = 1e9 * t[0].seconds / bytes, *write_ns = 1e9 * t[1].seconds / bytes;
        block_close(&b);
    }
    fclose(to);
}

/* ---- large images ------------------------------------------------------------------------------------------------ */

enum { KINDS = 2 }; /* pages of 4 KiB; huge pages for the scratch */

/* Two settings on two kinds of pages: radius at most 100 pixels, and growing with the width of the image. */
static void image_rows(FILE *to, const picture *p, double read_ns, double write_ns, int repeat) {
    static const char *const kinds[KINDS] = {"4 KiB", "huge"};
    enum { N = 2 * KINDS };
    size_t n = view_pixels(&p->view), size = 0;
    job jobs[N];
    timed t[3 * N];
    block scratch[KINDS];
    picture copies[KINDS];
    int settings = p->view.width > 4 * p->view.height || p->view.width == PICTURE_WIDTH ? 1 : 2;
    float *out = malloc(n * sizeof *out);
    if (!out)
        out_of_memory();
    memset(out, 0, n * sizeof *out);
    for (int k = 0; k < N; ++k) {
        jobs[k] = production(p);
        if (k >= KINDS)
            jobs[k].desc.max_radius_px = (int)((long)PICTURE_CAP_PX * p->view.width / PICTURE_WIDTH);
        size_t need = gtao_scratch_size(&jobs[k].desc);
        size = need > size ? need : size;
    }
    for (int kind = 0; kind < KINDS; ++kind) {
        scratch[kind] = block_open(size, kind > 0);
        copies[kind] = *p;
        copies[kind].scratch = scratch[kind].at, copies[kind].scratch_size = size;
    }
    double mib = huge_mib();
    for (int k = 0; k < N; ++k) {
        jobs[k].picture = &copies[k % KINDS];
        jobs[k].output.visibility = out;
        t[3 * k] = (timed){run_begin, &jobs[k], 0};
        t[3 * k + 1] = (timed){run_prepare, &jobs[k], 0};
        t[3 * k + 2] = (timed){run_visibility, &jobs[k], 0};
    }
    measure(t, 3 * KINDS * settings, repeat, thread_seconds);
    for (int half = 0; half < settings; ++half) {
        int cap = jobs[half * KINDS].desc.max_radius_px, w = p->view.width;
        double reach = 4.0 * w * (2 * cap + GTAO_STRIP) / (1 << 20);
        fprintf(to, "| %dx%d | %d px | %.1f | %.1f | %.0f |", w, p->view.height, cap, 4.0 * (double)n / (1 << 20),
                reach, reach * 256);
        for (int stage = 1; stage < 3; ++stage) {
            for (int kind = 0; kind < KINDS; ++kind) {
                double ns = ns_a_pixel(&t[3 * (half * KINDS + kind) + stage], p);
                fprintf(to, " %.2f |", ns);
                fprintf(csv, "%s,%s%s %s,%.4g,%.4g\n", stage == 1 ? "prepare" : "visibility",
                        half ? "growing" : "100 px", w > 4 * p->view.height ? " wide" : "", kinds[kind],
                        1e-6 * (double)n, ns);
            }
            /* depth in, heights out; heights, normals in, visibility out */
            fprintf(to, " %.2f |", stage == 1 ? 4 * read_ns + 4 * write_ns : 16 * read_ns + 4 * write_ns);
        }
        fprintf(to, " %.0f |\n", mib);
    }
    for (int kind = 0; kind < KINDS; ++kind)
        block_close(&scratch[kind]);
    free(out);
}

/* Leaves the largest of 16:9 open. */
static void images(picture *largest, bool quick, pool *threads, double read_ns, double write_ns) {
    static const int sizes[][2] = {{640, 480}, {960, 540}, {1920, 1080}, {3840, 2160}, {16384, 2048}, {7680, 4320}};
    FILE *to = table_open(directory, "memory-images");
    fprintf(to, "| image | radius at most | heights: MiB | rows in reach: MiB | 4 KiB pages of them | prepare: ns a "
                "pixel | huge pages | streaming it | visibility | huge pages | streaming it | MiB on huge pages |\n"
                "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    int count = quick ? 3 : 6;
    for (int k = 0; k < count; ++k) {
        picture p;
        if (!picture_render(&p, "stairs", sizes[k][0], sizes[k][1], threads))
            exit(1);
        image_rows(to, &p, read_ns, write_ns, quick ? 3 : k < 3 ? 9 : 2 + (k == 3));
        if (k == count - 1)
            *largest = p;
        else
            picture_close(&p);
    }
    fclose(to);
}

/* ---- the caller's buffers ---------------------------------------------------------------------------------------- */

typedef struct fresh {
    job job;
    bool output; /* visibility, too, in memory that was not touched before */
} fresh;

static void *untouched(size_t size) {
    void *at = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (at == MAP_FAILED)
        out_of_memory();
    return at;
}

static void run_fresh(void *user) {
    fresh *f = user;
    picture p = *f->job.picture;
    job j = f->job;
    size_t bytes = view_pixels(&p.view) * sizeof(float);
    p.scratch_size = gtao_scratch_size(&j.desc);
    p.scratch = untouched(p.scratch_size);
    j.picture = &p;
    if (f->output)
        j.output.visibility = untouched(bytes);
    run_library(&j);
    if (f->output)
        munmap(j.output.visibility, bytes);
    munmap(p.scratch, p.scratch_size);
}

/* Rows `stride` bytes apart, or the last one first. */
static float *spread(const float *from, int width, int height, size_t stride, bool flip) {
    char *to = calloc((size_t)height, stride);
    if (!to)
        out_of_memory();
    for (int y = 0; from && y < height; ++y)
        memcpy(to + (size_t)(flip ? height - 1 - y : y) * stride, from + (size_t)y * (size_t)width,
               (size_t)width * sizeof *from);
    return (float *)(void *)to;
}

static void buffers(bool quick, pool *threads) {
    static const char *const names[] = {"scratch used again, rows tightly packed",
                                        "rows of depth, normals and output 8, 32 and 8 KiB apart",
                                        "bottom row first (negative strides)", "scratch that was not touched before",
                                        "scratch and output that were not touched before"};
    enum { N = 5, WIDTH = 1920, HEIGHT = 1080 };
    picture p;
    if (!picture_open(&p, "stairs", WIDTH, HEIGHT, threads))
        exit(1);
    FILE *to = table_open(directory, "memory-buffers");
    job tight = production(&p), spaced = tight, flipped = tight;
    fresh scratch = {tight, false}, both = {tight, true};
    float *z = spread(p.z, WIDTH, HEIGHT, 8192, false), *normals = spread(p.normals, 3 * WIDTH, HEIGHT, 32768, false);
    float *last_z = spread(p.z, WIDTH, HEIGHT, 4 * WIDTH, true);
    float *last_normals = spread(p.normals, 3 * WIDTH, HEIGHT, 12 * WIDTH, true);
    float *out = spread(NULL, WIDTH, HEIGHT, 8192, false);
    spaced.desc.depth = z, spaced.desc.depth_stride = 8192;
    spaced.desc.normals = normals, spaced.desc.normal_stride = 32768;
    spaced.output.visibility = out, spaced.output.visibility_stride = 8192;
    flipped.desc.depth = last_z + (HEIGHT - 1) * WIDTH, flipped.desc.depth_stride = -4 * WIDTH;
    flipped.desc.normals = last_normals + (HEIGHT - 1) * 3 * WIDTH, flipped.desc.normal_stride = -12 * WIDTH;
    flipped.output.visibility = (float *)flipped.output.visibility + (HEIGHT - 1) * WIDTH;
    flipped.output.visibility_stride = -4 * WIDTH;
    timed t[N] = {{run_library, &tight, 0},
                  {run_library, &spaced, 0},
                  {run_library, &flipped, 0},
                  {run_fresh, &scratch, 0},
                  {run_fresh, &both, 0}};
    measure(t, N, quick ? 3 : 15, thread_seconds);
    fprintf(to, "| 1920x1080, 1 x 8 | ns a pixel | ratio |\n|---|--:|--:|\n");
    for (int k = 0; k < N; ++k)
        fprintf(to, "| %s | %.2f | %.2f |\n", names[k], ns_a_pixel(&t[k], &p), t[k].seconds / t[0].seconds);
    fclose(to);
    free(z), free(normals), free(last_z), free(last_normals), free(out);
    picture_close(&p);
}

/* ---- heights in 16 bits ------------------------------------------------------------------------------------------ */

enum { DEPTH_HALF, HEIGHT_HALF, HEIGHT_FIXED, HEIGHT_NEAR, FORMATS };

/* z as it comes back from 16 bits. Heights 1 / z are scaled to at most 2^15, or to the range of the integers; or to a
 * 32nd of it, as when there is something so much nearer elsewhere in the picture. */
static void round_depth(float *to, const picture *p, int format) {
    size_t n = view_pixels(&p->view);
    float most = 0;
    int exponent;
    for (size_t i = 0; i < n; ++i)
        if (p->z[i] < VIEW_SKY)
            most = fmaxf(most, 1 / p->z[i]);
    frexpf(most, &exponent);
    float scale = ldexpf(1, 15 - exponent), steps = format == HEIGHT_NEAR ? 65535.0f / 32 : 65535.0f;
    for (size_t i = 0; i < n; ++i) {
        float w = p->z[i] < VIEW_SKY ? 1 / p->z[i] : 0;
        if (format == DEPTH_HALF)
            to[i] = half_to_float(half_from(p->z[i]));
        else if (format == HEIGHT_HALF)
            to[i] = 1 / (half_to_float(half_from(w * scale)) / scale);
        else
            to[i] = 1 / (roundf(w / most * steps) / steps * most);
    }
}

typedef struct difference {
    double rmse, most;
} difference;

static difference compare(const picture *p, const float *a, const float *b) {
    difference d = {0, 0};
    double count = 0;
    for (size_t i = 0; i < view_pixels(&p->view); ++i)
        if (p->z[i] < VIEW_SKY) {
            double e = fabs((double)a[i] - (double)b[i]);
            d.rmse += e * e, count += 1;
            d.most = fmax(d.most, e);
        }
    d.rmse = sqrt(d.rmse / fmax(count, 1));
    return d;
}

/* Returns the share of open pixels. */
static float compute(const job *j) {
    gtao_stats stats;
    memset(&stats, 0, sizeof stats);
    if (gtao_compute(&j->desc, &j->output, j->picture->scratch, j->picture->scratch_size, &stats) != GTAO_OK)
        out_of_memory();
    return (float)stats.open / (float)stats.pixels;
}

static void half_errors(bool quick, pool *threads) {
    static const float tolerances[] = {0, 0.001f, 0.01f, 0.1f};
    enum { TOLERANCES = 4 };
    FILE *to = table_open(directory, "half-error"), *floor = table_open(directory, "half-floor");
    int scenes = quick ? 2 : bench_scene_count();
    double square[TOLERANCES][1 + FORMATS] = {{0}}, most[TOLERANCES][1 + FORMATS] = {{0}};
    double open[TOLERANCES][1 + FORMATS] = {{0}}, derived_square[FORMATS] = {0}, derived_most[FORMATS] = {0};
    fprintf(to,
            "| scene | z in a half: RMSE (largest) | 1/z in a half | 1/z in 16 bits | of a range 32 times as large | "
            "normals derived: z in a half | 1/z in a half | 1/z in 16 bits | of 32 times the range |\n"
            "|---|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (int s = 0; s < scenes; ++s) {
        picture p;
        if (!picture_open(&p, bench_scene_name(s), PICTURE_WIDTH, PICTURE_HEIGHT, threads))
            exit(1);
        size_t n = view_pixels(&p.view);
        float *z = malloc(n * sizeof *z), *exact = malloc(n * sizeof *exact);
        if (!z || !exact)
            out_of_memory();
        fprintf(to, "| %s |", p.name);
        for (int derived = 0; derived < 2; ++derived) {
            job j = production(&p);
            j.desc.slices = 4, j.desc.steps = 16;
            if (derived)
                j.desc.normals = NULL;
            j.output.visibility = exact;
            compute(&j);
            j.output.visibility = p.visibility;
            for (int k = 0; k < (derived ? 1 : TOLERANCES); ++k)
                for (int f = 0; f <= FORMATS; ++f) { /* the last: floats */
                    if (f < FORMATS)
                        round_depth(z, &p, f);
                    j.desc.depth = f < FORMATS ? z : p.z;
                    j.desc.tolerance = tolerances[k];
                    double known = (double)compute(&j);
                    difference d = compare(&p, p.visibility, exact);
                    if (derived && f < FORMATS) {
                        derived_square[f] += d.rmse * d.rmse / scenes;
                        derived_most[f] = fmax(derived_most[f], d.most);
                    } else if (!derived) {
                        square[k][f] += d.rmse * d.rmse / scenes, open[k][f] += known / scenes;
                        most[k][f] = fmax(most[k][f], d.most);
                    }
                    if (k == 0 && f < FORMATS)
                        fprintf(to, " %.4f (%.2f) |", d.rmse, d.most);
                }
        }
        fprintf(to, "\n");
        free(z), free(exact);
        picture_close(&p);
    }
    fprintf(to, "| pooled |");
    for (int f = 0; f < FORMATS; ++f)
        fprintf(to, " %.4f (%.2f) |", sqrt(square[0][f]), most[0][f]);
    for (int f = 0; f < FORMATS; ++f)
        fprintf(to, " %.4f (%.2f) |", sqrt(derived_square[f]), derived_most[f]);
    fprintf(to, "\n");
    fprintf(floor, "| tolerance | floats: RMSE (largest), open pixels | z in a half | 1/z in a half | 1/z in 16 bits | "
                   "of a range 32 times as large |\n|--:|--:|--:|--:|--:|--:|\n");
    for (int k = 0; k < TOLERANCES; ++k) {
        fprintf(floor, "| %g |", (double)tolerances[k]);
        for (int f = 0; f <= FORMATS; ++f) {
            int column = (f + FORMATS) % (FORMATS + 1); /* floats first */
            fprintf(floor, " %.4f (%.2f), %.1f %% |", sqrt(square[k][column]), most[k][column], 100 * open[k][column]);
        }
        fprintf(floor, "\n");
    }
    fclose(to), fclose(floor);
}

static void run_floats(void *user) {
    loadmax_run(user);
}

static void run_halves(void *user) {
    loadmax_half_run(user);
}

/* Halves loaded as halves and the same values loaded as floats have the same maxima. */
static void check_halves(const picture *p) {
    size_t n = view_pixels(&p->view);
    float *z = malloc(n * sizeof *z);
    if (!z)
        out_of_memory();
    for (size_t i = 0; i < n; ++i)
        z[i] = half_to_float(half_from(p->z[i]));
    view v = p->view;
    v.z = z;
    loadmax *a = loadmax_open(&v, 8, PICTURE_CAP_PX), *b = loadmax_half_open(&p->view, 8, PICTURE_CAP_PX);
    if (!a || !b)
        out_of_memory();
    loadmax_run(a), loadmax_half_run(b);
    if (!(loadmax_sum(a) == loadmax_half_sum(b))) {
        fprintf(stderr, "bench_memory: halves differ: %g, %g\n", loadmax_sum(a), loadmax_half_sum(b));
        exit(1);
    }
    loadmax_close(a), loadmax_half_close(b);
    free(z);
}

/* The loads alone, both ways; all of gtao.h; and what it has for large radii, far samples of 4x4 pixels as one. */
static void half_gain(FILE *to, const picture *p, int cap, int steps, int repeat) {
    enum { FLOATS, HALVES, EXACT, FAR, N };
    static const int formats[] = {HEIGHT_HALF, HEIGHT_FIXED};
    picture copy = *p;
    size_t n = view_pixels(&p->view);
    float *exact = malloc(n * sizeof *exact), *z = malloc(n * sizeof *z);
    loadmax *floats = loadmax_open(&p->view, steps, (float)cap);
    loadmax *halves = loadmax_half_open(&p->view, steps, (float)cap);
    copy.scratch = NULL, copy.scratch_size = 0;
    copy.visibility = malloc(n * sizeof(float));
    if (!copy.visibility || !exact || !z || !floats || !halves)
        out_of_memory();
    job j = production(&copy), far_samples;
    j.desc.steps = steps, j.desc.max_radius_px = cap;
    far_samples = j;
    far_samples.desc.far_depth = GTAO_FAR_AVERAGE;
    picture_reserve(&copy, &j.desc);
    picture_reserve(&copy, &far_samples.desc);
    timed t[N] = {
        {run_floats, floats, 0}, {run_halves, halves, 0}, {run_library, &j, 0}, {run_library, &far_samples, 0}};
    measure(t, N, repeat, thread_seconds);
    fprintf(to, "| %dx%d | %d px | %d | %.2f | %.2f | %.1f | %.0f %% |", p->view.width, p->view.height, cap, steps,
            ns_a_pixel(&t[FLOATS], p), ns_a_pixel(&t[HALVES], p), ns_a_pixel(&t[EXACT], p),
            100 * (t[FLOATS].seconds - t[HALVES].seconds) / t[EXACT].seconds);
    compute(&far_samples);
    memcpy(z, copy.visibility, n * sizeof *z);
    compute(&j);
    memcpy(exact, copy.visibility, n * sizeof *exact);
    fprintf(to, " %.1f (%.4f) |", ns_a_pixel(&t[FAR], p), compare(p, z, exact).rmse);
    j.desc.depth = z;
    for (int f = 0; f < 2; ++f) {
        round_depth(z, p, formats[f]);
        compute(&j);
        fprintf(to, " %.4f |", compare(p, copy.visibility, exact).rmse);
    }
    fprintf(to, "\n");
    loadmax_close(floats), loadmax_half_close(halves);
    free(copy.visibility), free(copy.scratch), free(exact), free(z);
}

int main(int argc, char **argv) {
    bool quick = argc == 3 && strcmp(argv[1], "--quick") == 0;
    if (argc != 2 + quick) {
        fprintf(stderr, "usage: bench_memory [--quick] DIRECTORY\n");
        return 2;
    }
    directory = argv[argc - 1];
    double start = wall_seconds(), read_ns = 0, write_ns = 0;
    pool *threads = pool_create(cli_processors());
    picture large, small;
    if (!threads || !make_folders("build/bench") || !make_folders(directory) ||
        !(csv = fopen("build/bench/memory.csv", "w")))
        return 1;
    fprintf(csv, "stage,what,megapixels,ns\n");
    streams(quick, &read_ns, &write_ns);
    buffers(quick, threads);
    half_errors(quick, threads);
    printf("  streams, halves' errors: %.0f s\n", wall_seconds() - start);
    images(&large, quick, threads, read_ns, write_ns);
    printf("  images: %.0f s\n", wall_seconds() - start);
    if (!picture_render(&small, "stairs", PICTURE_WIDTH, PICTURE_HEIGHT, threads))
        return 1;
    check_halves(&small);
    FILE *to = table_open(directory, "half-gain");
    fprintf(to,
            "| image | radius at most | samples a side | loads only, floats: ns a pixel | halves | all of gtao.h, "
            "floats | the difference, of all | far samples of 4x4 pixels: ns a pixel (RMSE) | 1/z in a half: RMSE | "
            "1/z in 16 bits |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    half_gain(to, &small, PICTURE_CAP_PX, 8, quick ? 3 : 9);
    half_gain(to, &small, PICTURE_CAP_PX, 64, quick ? 3 : 9);
    half_gain(to, &large, PICTURE_CAP_PX, 16, 2);
    half_gain(to, &large, PICTURE_CAP_PX * large.view.width / PICTURE_WIDTH, 64, 2);
    fclose(to);
    picture_close(&small), picture_close(&large);
    pool_destroy(threads);
    printf("%.0f s\n", wall_seconds() - start);
    return fclose(csv) == 0 ? 0 : 1;
}
