/* A float in 16 bits: sign, 5 bits of exponent, 10 of fraction (IEEE 754 binary16), rounded to nearest even. */
#ifndef BENCH_HALF_H
#define BENCH_HALF_H

#include <stdint.h>
#include <string.h>

static inline uint16_t half_from(float value) {
    uint32_t bits, sign, magnitude;
    memcpy(&bits, &value, sizeof bits);
    sign = bits >> 16 & 0x8000u, magnitude = bits & 0x7fffffffu;
    if (magnitude > 0x7f800000u)
        return (uint16_t)(sign | 0x7e00u);
    if (magnitude >= 0x477ff000u) /* rounds to 65536 or more */
        return (uint16_t)(sign | 0x7c00u);
    if (magnitude < 0x38800000u) { /* below 2^-14: multiples of 2^-24, which adding 1/2 rounds to */
        float f;
        memcpy(&f, &magnitude, sizeof f);
        f += 0.5f;
        memcpy(&magnitude, &f, sizeof f);
        return (uint16_t)(sign | (magnitude - 0x3f000000u));
    }
    magnitude += 0xfffu + (magnitude >> 13 & 1);
    return (uint16_t)(sign | (magnitude - 0x38000000u) >> 13);
}

static inline float half_to_float(uint16_t half) {
    uint32_t sign = (uint32_t)(half & 0x8000u) << 16, magnitude = half & 0x7fffu;
    float f;
    if (magnitude < 0x400u) {
        f = (float)magnitude * 5.9604644775390625e-8f; /* 2^-24 */
        memcpy(&magnitude, &f, sizeof magnitude);
    } else
        magnitude = (magnitude << 13) + (magnitude < 0x7c00u ? 0x38000000u : 0x70000000u);
    magnitude |= sign;
    memcpy(&f, &magnitude, sizeof f);
    return f;
}

#endif
