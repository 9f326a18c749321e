/* Sample positions and directions of the ground truth. */
#ifndef BENCH_SAMPLING_H
#define BENCH_SAMPLING_H

#include <stdint.h>

#include "vec.h"

static inline uint32_t sample_hash(uint32_t a) {
    a ^= a >> 16;
    a *= 0x7feb352du;
    a ^= a >> 15;
    a *= 0x846ca68bu;
    return a ^ a >> 16;
}

/* Two independent numbers in [0, 1) for sample `s` of pixel `i`. */
static inline void sample_jitter(uint32_t i, uint32_t s, double jitter[2]) {
    uint32_t h = sample_hash(i ^ sample_hash(s + 0x9e3779b9u));
    jitter[0] = h * (1.0 / 4294967296.0);
    jitter[1] = sample_hash(h + 0x85ebca6bu) * (1.0 / 4294967296.0);
}

/* Reversed bits of s as a fraction: the van der Corput sequence. */
static inline double radical_inverse(uint32_t s) {
    s = (s << 16) | (s >> 16);
    s = (s & 0x00ff00ffu) << 8 | (s & 0xff00ff00u) >> 8;
    s = (s & 0x0f0f0f0fu) << 4 | (s & 0xf0f0f0f0u) >> 4;
    s = (s & 0x33333333u) << 2 | (s & 0xccccccccu) >> 2;
    s = (s & 0x55555555u) << 1 | (s & 0xaaaaaaaau) >> 1;
    return s * (1.0 / 4294967296.0);
}

/* Index of (x, y) along the Hilbert curve of a 64 x 64 tile. */
static inline uint32_t hilbert_index(uint32_t x, uint32_t y) {
    uint32_t index = 0;
    for (uint32_t level = 32; level > 0; level /= 2) {
        uint32_t rx = (x & level) > 0, ry = (y & level) > 0;
        index += level * level * ((3 * rx) ^ ry);
        if (!ry) {
            if (rx) {
                x = 63 - x;
                y = 63 - y;
            }
            uint32_t swap = x;
            x = y;
            y = swap;
        }
    }
    return index;
}

/* Noise that differs as much as it can between neighbouring pixels: the R2 sequence along a Hilbert curve. */
static inline void pixel_noise(int x, int y, double noise[2]) {
    double index = hilbert_index((uint32_t)x & 63u, (uint32_t)y & 63u);
    noise[0] = 0.5 + 0.754877666246693 * index;
    noise[1] = 0.5 + 0.569840290998053 * index;
    noise[0] -= floor(noise[0]);
    noise[1] -= floor(noise[1]);
}

/* Malley: density cos / pi about n for u, w uniform in the unit square; a, b perpendicular to n. */
static inline vec3 cosine_direction(vec3 n, vec3 a, vec3 b, double u, double w) {
    double r = sqrt(u), phi = 2 * V3_PI * w;
    return v3_mad(v3_mad(v3_scale(n, sqrt(1 - u)), a, r * cos(phi)), b, r * sin(phi));
}

#endif
