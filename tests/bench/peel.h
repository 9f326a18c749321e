/* Depth peeling with Embree: what the view rays enter and leave, one after the other.
 *
 * A *piece* is a set of triangles joined by their corners. If less than a twentieth of its edges lie on its border (none
 * if it is closed), it is a solid: its hits along a view ray enter and leave it in turn, and a last one without a partner
 * (the ground, which has no underside) is a sheet. Pieces with more border are sheets (leaves): each hit both enters and
 * leaves. A *layer* is what a ray passes between coming out of everything and coming out of everything again, so solids
 * that overlap make one layer, and the layers of a pixel lie apart: front[0] <= back[0] < front[1] ... A sheet's back is
 * its front. */
#ifndef BENCH_PEEL_H
#define BENCH_PEEL_H

#include "examples/common/pool.h"
#include "scenes.h"
#include "view.h"

enum { PEEL_MOST = 8 };

typedef struct peel {
    int count;                                 /* layers */
    float *front[PEEL_MOST], *back[PEEL_MOST]; /* planar z, VIEW_SKY where there is none */
    float
        *slope[PEEL_MOST]; /* x, y: change of the front's 1/z over a pixel, on the plane of the triangle that was hit */
    double pieces, solids;
    double deeper; /* share of the pixels that have more layers than `count` */
} peel;

/* Prints the reason and returns false on failure. */
bool peel_open(peel *p, const bench_scene *s, int layers, pool *threads);
void peel_close(peel *p);

#endif
