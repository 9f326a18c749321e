/* volume.h - tables as volume textures: DDS, KTX2, a C array; the slices as one EXR or PFM image.
 *
 * A volume is width x height x depth floats, x fastest. Errors and pending files are those of image.h. */
#ifndef EXAMPLES_VOLUME_H
#define EXAMPLES_VOLUME_H

#include "image.h"

#include <stdint.h>

#define VOLUME_MAX_SIZE 2048 /* texels a side, what Direct3D and Vulkan promise of a volume texture */

typedef enum volume_format {
    VOLUME_FLOAT, /* 32 bits */
    VOLUME_UNORM8,
    VOLUME_UNORM16,
    VOLUME_BC4, /* 4 x 4 blocks of each slice, 4 bits a texel */
    VOLUME_FORMAT_COUNT
} volume_format;

typedef enum volume_file { VOLUME_UNKNOWN, VOLUME_DDS, VOLUME_KTX2, VOLUME_C, VOLUME_IMAGE } volume_file;
volume_file volume_file_of(const char *path); /* .dds; .ktx2; .c, .h, .inc; .exr, .pfm */

typedef struct volume {
    int width, height, depth;
    float *texels;
} volume;

int volume_create(volume *v, int width, int height, int depth); /* false: no memory */
void volume_free(volume *v);                                    /* harmless twice and on a zeroed struct */

/* Texels as a file stores them: [0, 1] rounded to 8 or 16 bits, or BC4 blocks, slice by slice, row by row. Null if there
 * is no memory; free() it. */
size_t volume_bytes(const volume *v, volume_format format);
void *volume_encode(const volume *v, volume_format format);
/* What is left of the texels after a format: `out` has as many. */
int volume_quantise(const volume *v, volume_format format, float *out);

/* Format of the file by its ending. `comment`, lines without newline at the end, goes where the file has room for it:
 * the C comment, the metadata of KTX2. An EXR or PFM holds the slices from top to bottom, floats whatever `format`. */
int volume_write(const char *path, const volume *v, volume_format format, const char *comment, image_pending *pending,
                 image_error *error);
/* A DDS or KTX2 file as volume_write makes them. */
int volume_read(const char *path, volume *v, volume_format *format, image_error *error);

#endif
