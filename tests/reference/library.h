/* What the suites share that hold gtao.h against references: the library on a reference's image. Include once, in the
 * suite's file. */
#ifndef GTAO_TESTS_LIBRARY_H
#define GTAO_TESTS_LIBRARY_H

#include "gtao.h"
#include "tests/reference/check.h"
#include "tests/reference/reference.h"

typedef struct result {
    float *visibility, *bent; /* 1 and 3 a pixel */
    float *horizons;          /* the sweep's, 2 * slices a pixel, or null */
} result;

static inline void *allocate(size_t size) {
    void *memory = malloc(size ? size : 1);
    if (!memory)
        fail_msg("out of memory");
    return memory;
}

static inline result result_of(const gtao_desc *desc) {
    const size_t count = (size_t)desc->width * (size_t)desc->height;
    result r = {allocate(count * sizeof(float)), allocate(3 * count * sizeof(float)), NULL};
    return r;
}

static inline void result_free(result *r) {
    free(r->visibility);
    free(r->bent);
    free(r->horizons);
}

/* Size, buffers and camera; the rest is the library's default. */
static inline gtao_desc describe_image(const ref_image *img) {
    gtao_desc desc = {0};
    desc.width = img->width;
    desc.height = img->height;
    desc.depth = img->z;
    desc.normals = img->normals;
    if (img->orthographic) {
        desc.camera.projection = GTAO_ORTHOGRAPHIC;
        desc.camera.sx = (float)img->sx;
        desc.camera.sy = (float)img->sy;
    } else {
        desc.camera.fx = (float)img->fx;
        desc.camera.fy = (float)img->fy;
        desc.camera.cx = (float)img->cx;
        desc.camera.cy = (float)img->cy;
        desc.camera.off_center = 1;
    }
    return desc;
}

/* Rows [row_begin, row_end) only; the rest of the result is NaN. */
static inline result compute_rows(const gtao_desc *desc, int row_begin, int row_end) {
    const size_t count = (size_t)desc->width * (size_t)desc->height, size = gtao_scratch_size(desc);
    result r = result_of(desc);
    for (size_t i = 0; i < 3 * count; i++)
        r.visibility[i / 3] = r.bent[i] = NAN;
    gtao_output output = {0};
    output.visibility = r.visibility;
    output.bent_normals = r.bent;
    void *scratch = allocate(size);
    gtao_context *context;
    const gtao_result status = gtao_begin(desc, &output, scratch, size, &context);
    CHECK(status == GTAO_OK, "%s", gtao_result_string(status));
    gtao_prepare_rows(context, 0, desc->height);
    gtao_visibility_rows(context, row_begin, row_end, NULL);
    free(scratch);
    return r;
}

static inline result compute(const gtao_desc *desc) {
    return compute_rows(desc, 0, desc->height);
}

/* Of any lengths; by the chord, which keeps its precision at small angles. */
static inline double degrees_between(const float a[3], const double b[3]) {
    const double la = sqrt((double)a[0] * (double)a[0] + (double)a[1] * (double)a[1] + (double)a[2] * (double)a[2]);
    const double lb = sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2]);
    double chord = 0.0;
    for (int i = 0; i < 3; i++)
        chord += ((double)a[i] / la - b[i] / lb) * ((double)a[i] / la - b[i] / lb);
    return 2.0 * asin(fmin(1.0, 0.5 * sqrt(chord))) * 180.0 / REF_PI;
}

#endif
