/* What the benchmark measures with: processor time, interleaved repetitions, and the distance between images. */
#ifndef BENCH_MEASURE_H
#define BENCH_MEASURE_H

#include <stdio.h>

#include "gtao.h"
#include "view.h"

/* Processor time of the calling thread: waiting for a busy machine does not count. */
double thread_seconds(void);
double wall_seconds(void);

/* One thing to time: `run` does the work once. */
typedef struct timed {
    void (*run)(void *user);
    void *user;
    double seconds; /* out: median */
} timed;

/* Runs A B C A B C ... `repeat` times (at most 64) after one round that does not count, so that a slow moment of the
 * machine falls on all alike. `clock` is one of the two above. */
void measure(timed *list, int count, int repeat, double (*clock)(void));

/* DIRECTORY/NAME.md, to be written. Ends the program if it cannot be. */
FILE *table_open(const char *directory, const char *name);

double median(double *values, int count); /* sorts them */

/* Over the pixels that have a surface. */
typedef struct distance {
    double rmse, mean, psnr, ssim, most; /* mean: a - b; psnr in dB for a range of 1; most: largest |a - b| */
} distance;

/* SSIM as published: Gaussian window of 11 x 11, sigma 1.5, K1 = 0.01, K2 = 0.03, range 1. */
distance image_distance(const view *v, const float *a, const float *b);

/* The description of a view: perspective, z and normals in view space, sky, radius and falloff. */
gtao_desc view_describe(const view *v);

#endif
