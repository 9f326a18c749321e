/* The least that a horizon search can do: load the samples of a slice and take their maximum. */
#ifndef BENCH_LOADMAX_H
#define BENCH_LOADMAX_H

#include "view.h"

typedef struct loadmax loadmax;

/* The depth of v in rows de-interleaved by 4 columns, as gtao.h lays out its heights, and the whole-pixel offsets of one
 * slice of `steps` samples a side out to `radius_px` (at most 4096) with the noise of gtao.h. Null if there is no memory. */
loadmax *loadmax_open(const view *v, int steps, float radius_px);
void loadmax_close(loadmax *l);
double loadmax_samples(const loadmax *l); /* per pixel, mean over the 16 phases */
const char *loadmax_isa(void);

void loadmax_run(loadmax *l);
double loadmax_sum(const loadmax *l); /* of the last rows' results: to check one against another */

/* The same with depth in half floats. */
loadmax *loadmax_half_open(const view *v, int steps, float radius_px);
void loadmax_half_close(loadmax *l);
void loadmax_half_run(loadmax *l);
double loadmax_half_sum(const loadmax *l);

#endif
