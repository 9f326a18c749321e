/* bench_sweep - what the sweep costs, beside a plain convex-hull sweep and the march at the same error.
 *
 *     build/bench_sweep [--quick] [--size N] [FILE.pfm]
 *
 * Writes build/bench/sweep.csv and prints the same. Nanoseconds per pixel, slice and side (= direction), processor time
 * of one thread, medians of interleaved runs. `lines` are the horizons alone, `all` is everything from heights and
 * derived normals to visibility. Without a file: a fractal terrain. */
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "examples/common/image.h"
#include "gtao.h"
#include "measure.h"
#include "rivals/hullsweep.h"

typedef struct map {
    int size;
    float *height;
} map;

static void *take(size_t size) {
    void *memory = malloc(size);
    if (!memory)
        fprintf(stderr, "bench_sweep: out of memory\n"), exit(1);
    return memory;
}

static uint32_t cell(int x, int y, uint32_t seed) {
    uint32_t h = (uint32_t)x * 0x9E3779B1u ^ (uint32_t)y * 0x85EBCA77u ^ seed * 0xC2B2AE3Du;
    h = (h ^ (h >> 15)) * 0x2C1B3C6Du;
    return h ^ (h >> 13);
}

/* Value noise in octaves, heights in pixels; the same features whatever the size. */
static map fractal(int size) {
    map m = {size, take((size_t)size * (size_t)size * sizeof(float))};
    for (int y = 0; y < size; y++)
        for (int x = 0; x < size; x++) {
            double sum = 0.0;
            for (int octave = 0; octave < 7; octave++) {
                const int step = 128 >> octave, i = x / step, j = y / step;
                double u = (double)(x % step) / step, v = (double)(y % step) / step, c[4];
                for (int k = 0; k < 4; k++)
                    c[k] = (double)(cell(i + k % 2, j + k / 2, (uint32_t)octave) >> 8) / 16777216.0;
                u = u * u * (3.0 - 2.0 * u), v = v * v * (3.0 - 2.0 * v);
                sum += 0.45 * step * ((c[0] * (1 - u) + c[1] * u) * (1 - v) + (c[2] * (1 - u) + c[3] * u) * v);
            }
            m.height[(size_t)y * (size_t)size + (size_t)x] = (float)sum;
        }
    return m;
}

static map repeated(const image *from, int size) {
    map m = {size, take((size_t)size * (size_t)size * sizeof(float))};
    for (int y = 0; y < size; y++)
        for (int x = 0; x < size; x++)
            m.height[(size_t)y * (size_t)size + (size_t)x] =
                from->data[(size_t)(y % from->height) * (size_t)from->width + (size_t)(x % from->width)];
    return m;
}

static gtao_desc describe(const map *m, int slices, float radius, gtao_isa isa) {
    gtao_desc d = {0};
    d.width = d.height = m->size;
    d.depth = m->height;
    d.depth_kind = GTAO_DEPTH_HEIGHT;
    d.camera.projection = GTAO_ORTHOGRAPHIC;
    d.camera.sx = 1.0f;
    d.radius = radius;
    d.slices = slices;
    d.isa = isa;
    return d;
}

typedef struct sweep_job {
    gtao_desc desc;
    gtao_output output;
    void *scratch, *work[2];
    size_t size;
    gtao_sweep *sweep;
    int threads;
    double lines; /* seconds of the last run */
} sweep_job;

typedef struct share {
    sweep_job *job;
    int phase, thread;
} share;

static void *run_share(void *argument) {
    const share *s = (const share *)argument;
    for (int u = s->thread; u < gtao_sweep_units(s->job->sweep, s->phase); u += s->job->threads)
        gtao_sweep_run(s->job->sweep, s->phase, u, u + 1, s->job->work[s->thread]);
    return NULL;
}

static void run_sweep(void *user) {
    sweep_job *j = (sweep_job *)user;
    if (gtao_sweep_begin(&j->desc, &j->output, NULL, j->scratch, j->size, &j->sweep) != GTAO_OK)
        fprintf(stderr, "bench_sweep: sweep failed\n"), exit(1);
    j->lines = 0.0;
    for (int phase = 0; phase < gtao_sweep_phases(j->sweep); phase++) {
        const double start = thread_seconds();
        if (j->threads > 1) {
            share shares[2] = {{j, phase, 0}, {j, phase, 1}};
            pthread_t other;
            pthread_create(&other, NULL, run_share, &shares[1]);
            run_share(&shares[0]);
            pthread_join(other, NULL);
        } else {
            gtao_sweep_run(j->sweep, phase, 0, gtao_sweep_units(j->sweep, phase), j->work[0]);
        }
        if (phase >= 2 && phase % 2 == 0)
            j->lines += thread_seconds() - start;
    }
}

static sweep_job sweep_make(const map *m, int slices, float radius, gtao_isa isa, int threads) {
    sweep_job j = {0};
    j.desc = describe(m, slices, radius, isa);
    j.output.visibility = take((size_t)m->size * (size_t)m->size * sizeof(float));
    j.size = gtao_sweep_scratch_size(&j.desc, &j.output, NULL);
    j.scratch = take(j.size);
    j.threads = threads;
    for (int t = 0; t < threads; t++)
        j.work[t] = take(gtao_sweep_work_size(&j.desc, NULL));
    return j;
}

static void sweep_free(sweep_job *j) {
    free(j->output.visibility);
    free(j->scratch);
    free(j->work[0]);
    free(j->work[1]);
}

typedef struct march_job {
    gtao_desc desc;
    gtao_output output;
    void *scratch;
    size_t size;
} march_job;

static void run_march(void *user) {
    march_job *j = (march_job *)user;
    gtao_compute(&j->desc, &j->output, j->scratch, j->size, NULL);
}

typedef struct hull_job {
    const map *m;
    int directions;
    float *stack, *out;
} hull_job;

static void run_hull(void *user) {
    hull_job *j = (hull_job *)user;
    hull_sweep(j->m->height, j->m->size, j->m->size, 1.0f, j->directions, j->stack, j->out);
}

static FILE *csv;

static void row(const char *method, const map *m, int slices, double radius, double seconds, double lines) {
    const double per = 1e9 / ((double)m->size * (double)m->size * 2.0 * slices);
    fprintf(csv, "%s,%d,%d,%g,%.3f,%.3f\n", method, m->size, slices, radius, seconds * per, lines * per);
    printf("%-24s %5d^2, %2d slices, radius %-5g: all %7.2f ns, lines %6.2f ns\n", method, m->size, slices, radius,
           seconds * per, lines * per);
    fflush(stdout);
}

int main(int argc, char **argv) {
    int quick = 0, size = 0;
    const char *file = NULL;
    image from = {0};
    image_error error;
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--quick") == 0)
            quick = 1;
        else if (strcmp(argv[i], "--size") == 0 && i + 1 < argc && atoi(argv[i + 1]) >= 64)
            size = atoi(argv[++i]);
        else if (argv[i][0] != '-')
            file = argv[i];
        else
            return fprintf(stderr, "usage: bench_sweep [--quick] [--size N] [FILE.pfm]\n"), 2;
    }
    if (file && !image_read_depth(file, &from, &error))
        return fprintf(stderr, "%s: %s\n", file, error.text), 2;
    size = size ? size : quick ? 512 : 1024;
    csv = fopen("build/bench/sweep.csv", "w");
    if (!csv)
        return fprintf(stderr, "build/bench/sweep.csv: cannot be written\n"), 2;
    fprintf(csv, "method,size,slices,radius,ns,ns_lines\n");

    const int slices = 8, repeat = quick ? 3 : 7;
    map m = file ? repeated(&from, size) : fractal(size);
    {
        static const gtao_isa isas[] = {GTAO_ISA_SCALAR, GTAO_ISA_SSE2, GTAO_ISA_NEON, GTAO_ISA_AVX2, GTAO_ISA_AVX512};
        sweep_job jobs[5];
        timed list[6];
        int count = 0;
        for (int i = 0; i < 5; i++)
            if (gtao_isa_available(isas[i])) {
                jobs[count] = sweep_make(&m, slices, INFINITY, isas[i], 1);
                list[count] = (timed){run_sweep, &jobs[count], 0.0};
                count++;
            }
        hull_job hull = {&m, 2 * slices, take((size_t)(6 * size) * sizeof(float)),
                         take((size_t)size * (size_t)size * sizeof(float))};
        list[count] = (timed){run_hull, &hull, 0.0};
        measure(list, count + 1, repeat, thread_seconds);
        for (int i = 0; i < count; i++)
            row(gtao_isa_name(jobs[i].desc.isa), &m, slices, INFINITY, list[i].seconds, jobs[i].lines);
        row("plain hull sweep", &m, slices, INFINITY, list[count].seconds, list[count].seconds);
        printf("plain / %s: %.1f times, lines alone %.1f times\n", gtao_isa_name(jobs[count - 1].desc.isa),
               list[count].seconds / list[count - 1].seconds, list[count].seconds / jobs[count - 1].lines);
        for (int i = 0; i < count; i++)
            sweep_free(&jobs[i]);
        free(hull.stack);
        free(hull.out);
    }
    {
        /* The radius, and the march of every pixel, whose error is the same. */
        static const float radii[] = {16, 64, 256, INFINITY};
        for (int i = 0; i < 4; i++) {
            const int marched = i < (quick ? 2 : 3);
            sweep_job j = sweep_make(&m, slices, radii[i], GTAO_ISA_AUTO, 1);
            march_job n = {j.desc, j.output, NULL, 0};
            n.desc.every_pixel = 1;
            n.desc.noise = GTAO_NOISE_NONE;
            n.size = gtao_scratch_size(&n.desc);
            n.scratch = take(n.size);
            timed list[2] = {{run_sweep, &j, 0.0}, {run_march, &n, 0.0}};
            measure(list, 1 + marched, quick ? 1 : 3, thread_seconds);
            row("sweep", &m, slices, (double)radii[i], list[0].seconds, j.lines);
            if (marched)
                row("march", &m, slices, (double)radii[i], list[1].seconds, list[1].seconds);
            free(n.scratch);
            sweep_free(&j);
        }
    }
    for (int s = size / 2; s <= (quick ? size : 4 * size); s *= 2) { /* linear in pixels */
        map other = file ? repeated(&from, s) : fractal(s);
        sweep_job j = sweep_make(&other, slices, INFINITY, GTAO_ISA_AUTO, 1);
        timed list[1] = {{run_sweep, &j, 0.0}};
        measure(list, 1, quick ? 1 : 3, thread_seconds);
        row("size", &other, slices, INFINITY, list[0].seconds, j.lines);
        sweep_free(&j);
        free(other.height);
    }
    {
        sweep_job one = sweep_make(&m, slices, INFINITY, GTAO_ISA_AUTO, 1);
        sweep_job two = sweep_make(&m, slices, INFINITY, GTAO_ISA_AUTO, 2);
        timed list[2] = {{run_sweep, &one, 0.0}, {run_sweep, &two, 0.0}};
        measure(list, 2, repeat, wall_seconds);
        printf("two threads: %.2f times one (wall time)\n", list[0].seconds / list[1].seconds);
        fprintf(csv, "threads,%d,%d,2,%.3f,0\n", size, slices, list[0].seconds / list[1].seconds);
        sweep_free(&one);
        sweep_free(&two);
    }
    free(m.height);
    image_free(&from);
    return fclose(csv) != 0;
}
