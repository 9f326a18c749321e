#ifndef BENCH_HULLSWEEP_H
#define BENCH_HULLSWEEP_H

/* Sky visibility of a height map by a plain sweep, one thread, scalar: for each of `directions` azimuths (one side
 * each), lines of the nearest pixels from border to border, each with a stack of the points on its convex hull; slopes
 * between points in 3D. A direction is hidden by 2 / pi atan(cosine between the horizon and up); the mean visibility to
 * `out`. This is how [TW10: Timonen, Westerholm, Scalable height field self-shadowing, 2010] sweeps, and what libraries
 * for height maps that follow it do: no normals, no integral of the arc. `stack`: 3 (width + height) floats. */
void hull_sweep(const float *height, int width, int rows, float pixel_size, int directions, float *stack, float *out);

#endif
