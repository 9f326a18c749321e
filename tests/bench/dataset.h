/* A scene's buffers and both of its ground truths, rendered once and kept in build/bench/scenes. */
#ifndef BENCH_DATASET_H
#define BENCH_DATASET_H

#include "examples/common/pool.h"
#include "scenes.h"
#include "view.h"

typedef struct dataset_options {
    int width, height;
    int strata;          /* both truths take strata^2 directions a pixel */
    double falloff;      /* fraction of the radius, 0: hard cutoff */
    double radius_scale; /* of the scene's own radius, 0: 1 */
} dataset_options;

typedef struct dataset {
    bench_scene scene;
    view view;
    float *z, *normals;
    float *truth_rays; /* visibility by ray tracing the meshes (trace.h) */
    float *truth_view; /* visibility by marching the depth buffer (march.h) */
} dataset;

/* Scene `index`, from the cache if it holds just this, else rendered and cached. Needs the repository root as working
 * directory. Prints the reason and returns false on failure. */
bool dataset_open(dataset *d, int index, const dataset_options *options, pool *threads);
void dataset_close(dataset *d);

/* Root mean square and mean (a - b) difference where there is a surface. */
typedef struct dataset_error {
    double rmse, mean;
} dataset_error;
dataset_error dataset_compare(const dataset *d, const float *a, const float *b);

/* Creates a folder and those above it. */
bool make_folders(const char *path);

#endif
