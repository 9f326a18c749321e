/* raster.h - maps that need not fit into memory: rows in and rows out, top to bottom.
 *
 * In: EXR, PFM, PNG (8 and 16 bit), TIFF and GeoTIFF (8 to 32 bit integers, floats; strips or tiles), raw floats.
 * Out: EXR, PFM, PNG (8 or 16 bit), TIFF (tiled floats), raw floats. TIFF and PNG need libtiff and libpng when this is
 * compiled; without them the functions say so in their error.
 *
 * As in image.h: 0 or null on failure and one line in *error that names the file. Nothing is printed. */
#ifndef EXAMPLES_RASTER_H
#define EXAMPLES_RASTER_H

#include "image.h"

#define RASTER_MAX_SIZE 262144 /* pixels a side; EXR and PNG: IMAGE_MAX_SIZE */
#define RASTER_MAX_CHANNELS 128

typedef enum raster_format {
    RASTER_UNKNOWN,
    RASTER_EXR,
    RASTER_PFM,
    RASTER_PNG,
    RASTER_TIFF,
    RASTER_RAW /* .raw or .f32: little-endian floats, the top row first, nothing else */
} raster_format;

#define RASTER_ENDINGS ".exr, .pfm, .png, .tif, .tiff, .raw or .f32"
raster_format raster_format_of(const char *path); /* by its ending, in any case of letters */

typedef struct raster_info {
    int width, height, channels;
    double full_scale;       /* integer files: the greatest value, 255 or 65535 ...; floats: 0. Rows are as stored */
    double pixel_x, pixel_y; /* GeoTIFF: world units per pixel; 0: not stated */
    int geographic;          /* GeoTIFF: pixel_x and pixel_y are degrees */
    int georeferenced;       /* GeoTIFF */
    int has_no_data;         /* GeoTIFF: no_data marks missing cells; it may be NaN */
    double no_data;
} raster_info;

typedef struct raster_reader raster_reader;

/* `spec` is FILE[:CHANNEL] or FILE[:LAYER] for EXR and PFM, FILE for the rest. `channels`: 1 or 3. Raw files have the
 * size raw_width x raw_height. */
raster_reader *raster_open(const char *spec, int channels, int raw_width, int raw_height, raster_info *info,
                           image_error *error);
int raster_read(raster_reader *reader, int rows, float *to, image_error *error); /* the next rows */
void raster_close(raster_reader *reader);                                        /* null is harmless */

typedef struct raster_writer raster_writer;

/* names[c] for the channels of an EXR. `range`: what PNG's integers of `bits` (8 or 16) hold; ignored by the others.
 * PFM and PNG take 1 or 3 channels. */
raster_writer *raster_writer_create(const char *path, int width, int height, int channels, const char *const *names,
                                    image_range range, int bits, image_pending *pending, image_error *error);
/* Before the first rows: a TIFF gets the GeoTIFF tags of the file `like`, if that is one. */
int raster_place(raster_writer *writer, const char *like, image_error *error);
int raster_write(raster_writer *writer, int rows, const float *from, image_error *error);
/* All rows are there: completes the file, which waits for image_commit. Frees the writer in any case. */
int raster_finish(raster_writer *writer, image_error *error);
void raster_abandon(raster_writer *writer); /* removes the file; null is harmless */

#endif
