/* Ground truth of what the depth buffer itself says: a Monte Carlo ray marcher over it as an infinitely thick layer. */
#ifndef BENCH_MARCH_H
#define BENCH_MARCH_H

#include "view.h"

typedef struct march march;

/* Tabulates heights and tangent planes of v, which must outlive it. Null if there is no memory. */
march *march_open(const view *v);
void march_close(march *m);

/* Visibility by `strata` x `strata` directions a pixel, cosine-distributed about the normal, in double precision.
 *
 * A direction is occluded if the depth buffer, on the screen line the ray projects to, holds a point S in front of the
 * ray and within the radius of the pixel's point; S is read at every pixel of the line's major axis, interpolated to
 * the line between two neighbours on one surface, else from the nearer one. Nothing outside the image occludes. With a
 * falloff f, S acts as [J16] has it: its cosine to the view vector is drawn towards the tangent plane's by
 * 1 - saturate((R - d) / (f R)), and the direction is occluded if it lies below that. */
void march_visibility_rows(const march *m, int strata, float *visibility, int row_begin, int row_end);

#endif
