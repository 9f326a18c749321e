/* What a depth and normal buffer holds of a scene, as the library, its rivals and the ground truth read it. */
#ifndef BENCH_VIEW_H
#define BENCH_VIEW_H

#include <stddef.h>

#define VIEW_SKY 1e9f /* planar depth of the background; anything at or beyond it is sky */

/* Conventions of gtao.h: pixel centres at + 0.5, view space x right, y down, z forward, P = z r with
 * r = ((x - cx) / f, (y - cy) / f, 1). */
typedef struct view {
    int width, height;
    float focal_px, cx, cy;
    float radius, falloff; /* world units; fraction of the radius, 0 = hard cutoff */
    const float *z;        /* planar depth */
    const float *normals;  /* x, y, z per pixel: unit, view space, facing the eye */
} view;

static inline size_t view_pixels(const view *v) {
    return (size_t)v->width * (size_t)v->height;
}

#endif
