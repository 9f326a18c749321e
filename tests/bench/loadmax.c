#include "loadmax.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "gtao.h"
#include "half.h"
#include "vec.h"

/* loadmax_half.c is this file with heights in 16 bits, converted as they are loaded. */
#ifdef LOADMAX_HALF
typedef uint16_t height;
#define HEIGHT(z) half_from(z)
#else
typedef float height;
#define HEIGHT(z) (z)
#endif

#if defined(__AVX512F__)
#include <immintrin.h>
typedef __m512 lanes;
enum { LANES = 16 };
#ifdef LOADMAX_HALF
#define LOAD(p) _mm512_cvtph_ps(_mm256_loadu_si256((const __m256i *)(const void *)(p)))
#else
#define LOAD(p) _mm512_loadu_ps(p)
#endif
#define STORE(p, a) _mm512_storeu_ps(p, a)
#define LARGER(a, b) _mm512_max_ps(a, b)
#define ISA "avx512"
#elif defined(__AVX__) && (defined(__F16C__) || !defined(LOADMAX_HALF))
#include <immintrin.h>
typedef __m256 lanes;
enum { LANES = 8 };
#ifdef LOADMAX_HALF
#define LOAD(p) _mm256_cvtph_ps(_mm_loadu_si128((const __m128i *)(const void *)(p)))
#else
#define LOAD(p) _mm256_loadu_ps(p)
#endif
#define STORE(p, a) _mm256_storeu_ps(p, a)
#define LARGER(a, b) _mm256_max_ps(a, b)
#define ISA "avx"
#else
typedef float lanes;
enum { LANES = 1 };
#ifdef LOADMAX_HALF
#define LOAD(p) half_to_float(*(p))
#else
#define LOAD(p) (*(p))
#endif
#define STORE(p, a) (*(p) = (a))
#define LARGER(a, b) ((a) > (b) ? (a) : (b))
#define ISA "scalar"
#endif

enum { REACH = 128, BLOCK = 4 * LANES, MOST_STEPS = 64 }; /* REACH: at least so far beyond the image */

struct loadmax {
    int width, height, per_segment, pad;
    ptrdiff_t segment, pitch;
    height *rows; /* image row 0 */
    float *out;
    void *memory;
    int count[16];
    ptrdiff_t offset[16][2 * MOST_STEPS]; /* +q and -q of one sample after the other */
};

const char *loadmax_isa(void) {
    return ISA;
}

static ptrdiff_t offset_of(const loadmax *l, int phase_x, int qx, int qy) {
    int x = phase_x + qx, phase = x & 3;
    return qy * l->pitch + (phase - phase_x) * l->segment + (x - phase) / 4;
}

loadmax *loadmax_open(const view *v, int steps, float radius_px) {
    loadmax *l = calloc(1, sizeof *l);
    if (!l || steps > MOST_STEPS || !(radius_px <= 4096)) {
        free(l);
        return NULL;
    }
    int reach = radius_px > REACH ? (int)radius_px + 1 : REACH;
    l->width = v->width, l->height = v->height;
    l->pad = reach / 4 + 64;
    l->per_segment = (v->width + 3) / 4;
    l->segment = l->per_segment + 2 * l->pad;
    l->pitch = 4 * l->segment;
    size_t rows = (size_t)(v->height + 2 * reach), outs = (size_t)(l->per_segment + BLOCK) * 4;
    size_t heights = rows * (size_t)l->pitch * sizeof(height);
    l->memory = calloc(heights + outs * sizeof(float), 1);
    if (!l->memory) {
        free(l);
        return NULL;
    }
    l->rows = (height *)l->memory + reach * l->pitch;
    l->out = (float *)(void *)((char *)l->memory + heights); /* pitch is even: aligned */
    for (int y = 0; y < v->height; ++y)
        for (int x = 0; x < v->width; ++x)
            l->rows[y * l->pitch + (x & 3) * l->segment + l->pad + (x >> 2)] =
                HEIGHT(v->z[(ptrdiff_t)y * v->width + x]);
    for (int phase = 0; phase < 16; ++phase) {
        float direction, jitter;
        gtao_noise_at(GTAO_NOISE_MEMO, phase & 3, phase >> 2, 0, &direction, &jitter);
        double dx = cos(V3_PI * (double)direction), dy = sin(V3_PI * (double)direction);
        int last_x = 0, last_y = 0;
        for (int j = 0; j < steps; ++j) {
            double s = (j + (double)jitter) / steps, t = 1 + ((double)radius_px - 1) * s * s;
            int qx = (int)lround(t * dx), qy = (int)lround(t * dy);
            if (qx == last_x && qy == last_y)
                continue;
            l->offset[phase][2 * l->count[phase]] = offset_of(l, phase & 3, qx, qy);
            l->offset[phase][2 * l->count[phase] + 1] = offset_of(l, phase & 3, -qx, -qy);
            l->count[phase]++;
            last_x = qx, last_y = qy;
        }
    }
    return l;
}

void loadmax_close(loadmax *l) {
    if (l)
        free(l->memory);
    free(l);
}

double loadmax_samples(const loadmax *l) {
    double sum = 0;
    for (int phase = 0; phase < 16; ++phase)
        sum += 2.0 * l->count[phase] / 16;
    return sum;
}

/* Four groups of lanes at a time, both sides, in eight accumulators. */
void loadmax_run(loadmax *l) {
    for (int y = 0; y < l->height; ++y)
        for (int px = 0; px < 4; ++px) {
            int phase = 4 * (y & 3) + px, count = l->count[phase];
            const ptrdiff_t *offset = l->offset[phase];
            const height *row = l->rows + y * l->pitch + px * l->segment + l->pad;
            float *out = l->out + px * (l->per_segment + BLOCK);
            for (int i = 0; i < l->per_segment; i += BLOCK) {
                lanes a[4], b[4];
                for (int g = 0; g < 4; ++g)
                    a[g] = b[g] = LOAD(row + i + g * LANES);
                for (int k = 0; k < count; ++k) {
                    const height *p = row + i + offset[2 * k], *q = row + i + offset[2 * k + 1];
                    for (int g = 0; g < 4; ++g) {
                        a[g] = LARGER(a[g], LOAD(p + g * LANES));
                        b[g] = LARGER(b[g], LOAD(q + g * LANES));
                    }
                }
                for (int g = 0; g < 4; ++g)
                    STORE(out + i + g * LANES, LARGER(a[g], b[g]));
            }
        }
}

double loadmax_sum(const loadmax *l) {
    double sum = 0;
    for (int px = 0; px < 4; ++px)
        for (int i = 0; i < l->per_segment; ++i)
            sum += (double)l->out[px * (l->per_segment + BLOCK) + i];
    return sum;
}
