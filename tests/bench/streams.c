#include "streams.h"

#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

/* RUN: pixels of one plane after as many of another. Fewer cost up to twice the time, whole rows about the same. PAD:
 * columns beside a row of the state. */
enum { RUN = 240, PAD = 32, MOST = 24, READ = 1, WRITE = 2 };
enum { HEIGHT, NORMALS = 2, MOTION = 5, PREPARED = 8, RAW, FILTERED = 11, HISTORY = 13, PLANES = 23 };

/* A buffer, row after row: `per` rows of it, each `bytes` long, for one of the stage's. */
typedef struct stream {
    char *at;
    ptrdiff_t stride;
    size_t bytes;
    int per, use;
} stream;

struct streams {
    int width, height; /* at half resolution */
    ptrdiff_t pitch;
    void *memory;
    float *planes;
};

streams *streams_open(int width, int height) {
    streams *s = calloc(1, sizeof *s);
    if (!s)
        return NULL;
    s->width = width / 2, s->height = height / 2;
    s->pitch = (s->width + 2 * PAD + 15) & ~15;
    s->memory = calloc((size_t)PLANES * (size_t)s->pitch * (size_t)(s->height + 1) + 16, sizeof(float));
    if (!s->memory) {
        free(s);
        return NULL;
    }
    s->planes = (float *)(((uintptr_t)s->memory + 63) & ~(uintptr_t)63);
    return s;
}

void streams_close(streams *s) {
    if (s)
        free(s->memory);
    free(s);
}

/* n bytes, a multiple of 4, at p; and as many from there on are asked for. */
static uint32_t touch(char *p, size_t n, int use) {
    uint32_t *words = (uint32_t *)(void *)p, sum = 0;
    size_t count = n / sizeof *words;
    for (size_t i = 0; i < n; i += 64)
        __builtin_prefetch((const void *)((uintptr_t)p + n + i));
    for (size_t i = 0; use & READ && i < count; ++i)
        sum |= words[i];
    for (size_t i = 0; use & WRITE && i < count; ++i)
        words[i] = 0x3f000000u;
    return sum;
}

static int add_planes(const streams *s, stream *list, int n, int plane, int count, int use) {
    for (int k = 0; k < count; ++k) {
        float *at = s->planes + (plane + k) * s->pitch * (s->height + 1) + PAD;
        list[n++] = (stream){(char *)at, s->pitch * 4, (size_t)s->width * 4, 1, use};
    }
    return n;
}

/* One of the caller's. */
static int add_image(const streams *s, stream *list, int n, const float *image, int components, int use) {
    size_t bytes = 2 * (size_t)s->width * (size_t)components * 4;
    if (image)
        list[n++] = (stream){(char *)(uintptr_t)image, (ptrdiff_t)bytes, bytes, 2, use};
    return n;
}

unsigned streams_run(streams *s, const stream_frame *f, stream_stage stage, double *bytes) {
    stream list[MOST];
    const int odd = (int)(f->number & 1), now = HISTORY + 5 * odd, before = HISTORY + 5 * !odd;
    const int normals = f->normals ? 3 : 0, motion = f->motion ? 3 : 0;
    uint32_t sum = 0;
    int n = 0;
    switch (stage) {
    case STREAM_REDUCE: /* what is new is compared with what was */
        n = add_image(s, list, n, f->depth, 1, READ);
        n = add_image(s, list, n, f->normals, 3, READ);
        n = add_image(s, list, n, f->motion, 3, READ);
        n = add_planes(s, list, n, HEIGHT + odd, 1, WRITE);
        n = add_planes(s, list, n, HEIGHT + !odd, 1, READ);
        n = add_planes(s, list, n, NORMALS, normals, READ | WRITE);
        n = add_planes(s, list, n, MOTION, motion, WRITE);
        break;
    case STREAM_PREPARE:
        n = add_planes(s, list, n, HEIGHT + odd, 1, READ);
        n = add_planes(s, list, n, PREPARED, 1, WRITE);
        break;
    case STREAM_HORIZONS:
        n = add_planes(s, list, n, PREPARED, 1, READ);
        n = add_planes(s, list, n, NORMALS, normals, READ);
        n = add_planes(s, list, n, RAW, 2, WRITE);
        break;
    case STREAM_SPATIAL:
        n = add_planes(s, list, n, HEIGHT + odd, 1, READ);
        n = add_planes(s, list, n, RAW, 2, READ);
        n = add_planes(s, list, n, FILTERED, 2, WRITE);
        break;
    case STREAM_TEMPORAL:
        n = add_planes(s, list, n, HEIGHT, 2, READ);
        n = add_planes(s, list, n, MOTION, motion, READ);
        n = add_planes(s, list, n, FILTERED, 1, READ);
        n = add_planes(s, list, n, before, 5, READ);
        n = add_planes(s, list, n, now, 5, WRITE);
        break;
    default:
        n = add_image(s, list, n, f->depth, 1, READ);
        n = add_planes(s, list, n, HEIGHT + odd, 1, READ);
        n = add_planes(s, list, n, now, 1, READ);
        n = add_image(s, list, n, f->visibility, 1, WRITE);
    }
    for (int k = 0; k < n; ++k)
        *bytes += (double)list[k].bytes * list[k].per * s->height * (list[k].use == (READ | WRITE) ? 2 : 1);
    for (int y = 0; y < s->height; ++y)
        for (int x = 0; x < s->width; x += RUN)
            for (int k = 0; k < n; ++k) {
                const size_t pixel = list[k].bytes / (size_t)s->width;
                const size_t length = (size_t)(s->width - x < RUN ? s->width - x : RUN) * pixel;
                for (int r = 0; r < list[k].per; ++r)
                    sum |= touch(list[k].at + (y * list[k].per + r) * list[k].stride + (size_t)x * pixel, length,
                                 list[k].use);
            }
    return sum;
}
