/* render.h - a small deferred renderer around gtao.h: meshes are rasterised into depth, normals, albedo and motion,
 * gtao.h makes visibility and bent normals of them, and both meet in the light of a dome. */
#ifndef EXAMPLES_RENDER_H
#define EXAMPLES_RENDER_H

#include <stdint.h>

#include "gtao.h"
#include "pool.h"
#include "raster3d.h"

typedef struct render_settings {
    int no_occlusion, no_half, no_spatial, no_temporal; /* zero: everything that gtao.h offers */
    int no_bounce, no_bent;                             /* interreflection; light from along the bent normal */
    float radius;                                       /* world units */
    int cut;                                            /* the picture has nothing to do with the previous one */
} render_settings;

typedef struct render_stage {
    const char *name;
    double ms;
} render_stage;

typedef enum render_show {
    RENDER_SHADED,
    RENDER_VISIBILITY,
    RENDER_BENT,
    RENDER_DEPTH,
    RENDER_NORMALS,
    RENDER_ALBEDO,
    RENDER_MOTION,
    RENDER_SHOWS
} render_show;
extern const char *const render_show_names[RENDER_SHOWS + 1]; /* ends with null */

typedef struct render_memory { /* gtao.h's of the frames before; starts as zero */
    void *state;
    size_t size;
} render_memory;

typedef struct renderer {
    int width, height;
    raster *raster;
    raster_view view; /* of the last frame */
    raster_buffers buffers;
    float *visibility, *bent;
    uint32_t *picture; /* 0x00rrggbb, sRGB */
    render_memory memory;
    float probe[3][4][4];       /* the dome's light */
    unsigned char encode[4096]; /* linear [0, 4) to the screen */

    render_stage stages[16]; /* what the last frame spent its time on */
    int stage_count;
} renderer;

/* `m` has to outlive it. 0 if there is no memory. */
int render_create(renderer *r, const mesh *m, int width, int height);
void render_free(renderer *r);

/* Draws a frame into the buffers and, as `show` asks, the picture. 0 on failure, with the reason in *error. */
int render_frame(renderer *r, const raster_view *view, const render_settings *settings, render_show show, pool *workers,
                 const char **error);

/* What gtao.h is told of the last frame; and its stages, on all threads. `times` may be null. */
void render_describe(const renderer *r, const render_settings *settings, gtao_frame_desc *frame);
int render_occlude(const gtao_frame_desc *frame, const gtao_output *output, render_memory *memory, pool *workers,
                   renderer *times, const char **error);

double render_total_ms(const renderer *r);

#endif
