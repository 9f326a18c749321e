/* How thick is what a depth buffer shows? An estimate from the depth alone, with its constants open, so that they can be
 * fitted (bench_thickness --fit); gtao_estimate_thickness has them fixed. */
#ifndef BENCH_THICKNESS_H
#define BENCH_THICKNESS_H

#include <stdbool.h>

#include "view.h"

typedef struct thickness_rule {
    float factor;  /* thickness = factor x width of the surface on the screen, the lesser of row and column */
    float endless; /* surfaces wider than so many radii are endless; so are those that reach the border of the image */
    float slope;   /* one surface: its depth changes by no more than so many footprints a pixel */
    bool flat;     /* without the factor for surfaces seen at an angle */
} thickness_rule;

extern const thickness_rule thickness_fitted;

/* World units along the view ray, INFINITY: endless, 0: sky. False if there is no memory. */
bool thickness_estimate(const view *v, const thickness_rule *rule, float *map);

#endif
