/* The frame of gtao_frame at half resolution, written straight: a pixel at a time, scalar, no tables. What timings are
 * compared with. Visibility only. */
#ifndef BENCH_STRAIGHT_H
#define BENCH_STRAIGHT_H

#include <stdbool.h>

#include "view.h"

enum { STRAIGHT_REDUCE, STRAIGHT_HORIZONS, STRAIGHT_SPATIAL, STRAIGHT_TEMPORAL, STRAIGHT_UPSAMPLE, STRAIGHT_STAGES };

typedef struct straight straight;

/* For images of width x height pixels, both even. Null if there is no memory. */
straight *straight_open(int width, int height);
void straight_close(straight *s);

/* One frame. `motion`: 3 floats a pixel, as gtao_frame_desc.motion. `seconds` gets the time of each stage added. */
void straight_frame(straight *s, const view *v, const float *motion, unsigned frame, float *visibility,
                    double seconds[STRAIGHT_STAGES]);

#endif
