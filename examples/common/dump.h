/* dump.h - what lies between the library's stages, to files: one EXR a stage and settings.json with every constant, for
 * ports to compare with. docs/porting.md lists the files, their channels and the keys.
 *
 * Everything is written into a directory beside the one asked for, which takes its name when all is there. As in
 * image.h: 0 or null on failure and one line in *error. */
#ifndef EXAMPLES_DUMP_H
#define EXAMPLES_DUMP_H

#include "image.h"

#include "gtao.h"

typedef struct dump dump;

/* `directory` must not exist, or be empty. */
dump *dump_create(const char *directory, image_error *error);
int dump_commit(dump *d, image_error *error); /* and frees it, in any case */
void dump_discard(dump *d);                   /* removes what was written; null is harmless */

/* Of a sequence: what follows goes into the subdirectory `name`, until the next or the end. */
int dump_frame(dump *d, const char *name, image_error *error);

/* A stage: the file STAGE.exr, and an item of "stages". Call in the order of the stages. */
int dump_stage(dump *d, const char *stage, int width, int height, const image_plane *planes, int count,
               image_error *error);
/* Keys of settings.json. */
void dump_integer(dump *d, const char *key, long value);
void dump_floats(dump *d, const char *key, const float *values, int count); /* one: a number; else an array */
void dump_text(dump *d, const char *key, const char *value);

/* ---- of gtao.h ---------------------------------------------------------------------------------------------------- */

/* Memory for the intermediates at the resolution of the search, and for the signal if asked for, into output; freed with
 * the dump. */
int dump_planes(dump *d, int width, int height, int slices, int arcs, int signal, gtao_output *output,
                image_error *error);

/* depth and normals, and motion if `frame` is not null, as handed to the library. */
int dump_input(dump *d, const gtao_desc *desc, const gtao_frame_desc *frame, image_error *error);
/* height, surface, noise, samples, slices, horizons, arcs: after the search. Constants of `whole` get the prefix
 * full_; it may be `search`. */
int dump_search(dump *d, const gtao_context *search, const gtao_context *whole, const gtao_output *output,
                image_error *error);
/* A stage of the filters, after it has run. The horizons' is dump_search and raw; those without planes write nothing. */
int dump_frame_stage(dump *d, const gtao_frame_context *frame, int stage, const gtao_output *output,
                     image_error *error);
/* raw, of gtao_output.signal. */
int dump_signal(dump *d, const gtao_context *context, const float *signal, int planes, image_error *error);
/* result, packed, sh (nine planes, or null), multi_bounce, and specular where surface.exr has the image's size. */
int dump_result(dump *d, const gtao_context *whole, const float *visibility, const float *bent, const float *sh,
                const float *surface, const float albedo[3], image_error *error);
/* Of a sweep, after its last phase: input, height, horizons (planes as gtao_sweep_options has them), result, packed. */
int dump_sweep(dump *d, const gtao_desc *desc, const gtao_sweep *sweep, const float *visibility, const float *bent,
               const float *horizons, image_error *error);

#endif
