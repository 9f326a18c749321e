/* What timings run on: a scene's depth and normals with buffers for every output, and the settings of the record. */
#ifndef BENCH_PICTURE_H
#define BENCH_PICTURE_H

#include <stdbool.h>

#include "examples/common/pool.h"
#include "loadmax.h"
#include "measure.h"

/* The memo's production setting [J19]: one slice of 8 samples a side, attenuation over the last quarter of the radius,
 * the radius at most 100 pixels. */
enum { PICTURE_SLICES = 1, PICTURE_STEPS = 8, PICTURE_CAP_PX = 100, PICTURE_WIDTH = 960, PICTURE_HEIGHT = 540 };
static const float picture_falloff = 0.25f;

typedef struct picture {
    const char *name;
    view view;
    float pixel_size[2]; /* not 0: z are heights of a map, in pixels of this size, without normals */
    float *z, *normals, *visibility, *bent;
    uint32_t *packed;
    void *scratch;
    size_t scratch_size;
} picture;

/* Depth and normals only, from a scene or study of scenes.h. */
bool picture_render(picture *p, const char *name, int width, int height, pool *threads);
/* And the rest. Also of the files in tests/data, at their own size: courtyard, scans, study, jacksboro. */
bool picture_open(picture *p, const char *name, int width, int height, pool *threads);
void picture_close(picture *p);
/* Makes the scratch of p, at least 160 bytes a pixel, large enough for these settings. Ends the program if it cannot. */
void picture_reserve(picture *p, const gtao_desc *desc);

typedef struct job {
    gtao_desc desc;
    gtao_output output;
    const picture *picture;
    gtao_context *context; /* of run_begin */
    pool *threads;
    int chunk; /* rows that a thread takes at a time; 0: GTAO_STRIP */
    loadmax *floor;
} job;

job production(const picture *p);               /* the memo's production setting */
double radius_px(const picture *p, double cap); /* mean over the surface of the radius in pixels, capped */
double ns_a_pixel(const timed *t, const picture *p);
double samples_a_pixel(const job *j);

/* For `timed`, with a job. They end the program on an error. */
void run_library(void *user);
void run_begin(void *user); /* ... and its stages, whole images on the calling thread */
void run_prepare(void *user);
void run_visibility(void *user);
void run_threads(void *user); /* all three, rows on j->threads */

#endif
