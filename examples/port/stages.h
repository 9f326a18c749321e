/* stages.h - gtao's stages as compute shaders, on what a dump of build/ao holds (docs/porting.md): its input, constants
 * and tables. Results are planes of the same names, to compare with those of the dump and to write as another one. */
#ifndef PORT_STAGES_H
#define PORT_STAGES_H

#include "dump.h"
#include "gpu.h"
#include "image.h"

/* Shaders, compiled when first used. */
typedef struct shaders shaders;
/* `compiled`: directory of NAME.spv. If `defines` is not empty, "HALF=1" or "MISTAKE=3" or several with spaces between,
 * the shaders are instead compiled from `sources` by glslangValidator. */
shaders *shaders_open(gpu *g, const char *compiled, const char *sources, const char *defines, image_error *error);
void shaders_close(shaders *s);

typedef struct frame frame;
/* A dump, or one frame of a sequence's. Files are read when they are needed. */
frame *frame_open(gpu *g, const char *directory, image_error *error);
void frame_close(frame *f);

/* Runs all stages. `before` is the frame before, or null. isolated: each stage reads what the library wrote before it;
 * otherwise the results of the shaders before it. */
int frame_run(frame *f, shaders *s, frame *before, int isolated, image_error *error);
/* Every file of the dump, with the shaders' results where there are any, and two more: octahedral, halves. */
int frame_write(frame *f, dump *d, image_error *error);

/* Planes by name: depth, height, surface, slices, horizons, arcs, raw, sh, spatial1, history, result ... One after
 * another in data. */
typedef struct planes {
    char name[24];
    int width, height, count;
    gpu_buffer *buffer;
    const float *data;
} planes;
const planes *frame_reference(frame *f, const char *name); /* the library's, null if there are none */
const planes *frame_result(const frame *f, const char *name);
/* Result i, null behind the last. */
const planes *frame_result_at(const frame *f, int i);
/* A number of settings.json. */
float frame_setting(const frame *f, const char *key, float otherwise);
/* Its strings: stages. */
int frame_has_stage(const frame *f, const char *stage);

#endif
