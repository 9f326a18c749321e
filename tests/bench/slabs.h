/* A prototype of occluders with thickness, in double precision: what the idea is worth, without a kernel's economies.
 * Every pixel along each slice is visited, the arcs that are hidden are kept as intervals and merged. Written for the
 * benchmark, independent of gtao.h and of tests/reference/arcs.c, and faster than the latter. */
#ifndef BENCH_SLABS_H
#define BENCH_SLABS_H

#include <stdbool.h>

#include "view.h"

enum { SLAB_LAYERS = 8 };

/* Planar z, front <= back, VIEW_SKY: nothing there. An endless back (INFINITY) hides everything below its front. */
typedef struct slab_layer {
    const float *front, *back;
    const float *slope; /* null, or x, y: change of the front's 1/z over a pixel */
} slab_layer;

typedef struct slabs {
    slab_layer layer[SLAB_LAYERS];
    int count;
    bool clip; /* only what lies within the radius of a slab hides; else all of it, if its front is within */
    double
        connect_px; /* neighbours along a slice that are no more than so many footprints apart in depth for each pixel
                        * between them are one surface without a gap; < 0: none are */
    double cell_px; /* a sample reaches over so many pixels of the line, on its own plane if the slope is known */
    double steep;   /* slopes of a cell are limited to so many footprints */
    int slices;
    int stride; /* of the pixels that are computed, in x and y; the rest is left alone */
} slabs;

void slab_visibility_rows(const view *v, const slabs *s, float *visibility, int row_begin, int row_end);

#endif
