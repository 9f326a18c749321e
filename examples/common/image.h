/* image.h - float images: EXR and PFM in; EXR, PFM and 8-bit PNG out.
 *
 * The one place for image files in this project's programs. Rows run top to bottom in memory whatever the file does.
 * Every function that can fail returns 0 on failure and leaves one line in *error that names the file; on success it
 * returns 1. Nothing is printed. */
#ifndef EXAMPLES_IMAGE_H
#define EXAMPLES_IMAGE_H

#include <stddef.h>
#include <stdio.h>

#define IMAGE_MAX_SIZE 32768 /* pixels a side, the library's own limit */

typedef struct image_error {
    char text[512];
} image_error;

/* "PATH: what" as one printable line, whatever the names from files hold; returns 0. */
int image_fail(image_error *error, const char *path, const char *format, ...);

typedef struct image {
    int width, height;
    int channels; /* interleaved floats per pixel */
    float *data;  /* width * height * channels, tightly packed */

    /* Where the pixels lie in the picture the camera frames: an EXR's data window within its display window. For every
     * other file the origin is 0 and the display size is the size. */
    int origin_x, origin_y;
    int display_width, display_height;
} image;

/* A black image; display window = size. */
int image_create(image *out, int width, int height, int channels, image_error *error);
void image_free(image *img); /* harmless twice and on a zeroed struct */

/* `spec` is FILE[:CHANNEL]: one channel. Without CHANNEL the depth channel: the only one there is, or Z, depth,
 * Depth.Z and the like in any layer. CHANNEL may leave out leading layer names as long as it stays unambiguous. */
int image_read_depth(const char *spec, image *out, image_error *error);

/* `spec` is FILE[:LAYER]: three channels X, Y, Z or R, G, B of a layer. Without LAYER the one called Normal or N. */
int image_read_normals(const char *spec, image *out, image_error *error);

/* The same, EXR only, a band of rows at a time for images that shall not be in memory whole: 1 channel (depth) or 3
 * (normals). `size` receives everything but data, which stays null. Channels must lie in one part. */
typedef struct image_stream image_stream;
image_stream *image_stream_open(const char *spec, int channels, image *size, image_error *error);
/* The next `rows` rows, interleaved floats, top to bottom. */
int image_stream_read(image_stream *stream, int rows, float *to, image_error *error);
void image_stream_close(image_stream *stream); /* null is harmless */

/* `count` channels by name from a file whose name is taken as it is. */
int image_read_channels(const char *path, const char *const *names, int count, image *out, image_error *error);

/* Names of all channels of a file, ended by a null; null on failure. To be freed by image_free_names. */
char **image_list_channels(const char *path, int *count, image_error *error);
void image_free_names(char **names); /* null is harmless */

/* The file part of FILE[:CHANNEL] into `path`. False if it does not fit. */
int image_spec_path(const char *spec, char *path, size_t size);

/* What a PFM file begins with, up to `most` pixels a side; the floats follow, bottom row first. */
typedef struct image_pfm {
    int width, height, channels, little; /* channels: 1 or 3; little: the order of the bytes */
} image_pfm;
int image_pfm_header(FILE *file, const char *path, int most, image_pfm *header, image_error *error);

typedef enum image_format { IMAGE_UNKNOWN, IMAGE_EXR, IMAGE_PFM, IMAGE_PNG } image_format;
#define IMAGE_ENDINGS ".exr, .pfm or .png"
image_format image_format_of(const char *path); /* by its ending, in any case of letters */

/* What values an 8-bit format has to hold: [0, 1] -> 255 v, or [-1, 1] -> 255 (0.5 + 0.5 v); rounded, linear. */
typedef enum image_range { IMAGE_RANGE_UNIT, IMAGE_RANGE_SIGNED } image_range;

/* A file that was written under a temporary name beside its own, and waits to take that name: several outputs can be
 * finished first and then appear together, or not at all. */
typedef struct image_pending {
    char *path, *temporary;
} image_pending;

/* Format by the ending. EXR: 32-bit float, ZIP, names[c] for channel c. PFM and PNG: 1 or 3 channels. */
int image_write(const char *path, const image *img, const char *const *names, image_range range, image_pending *pending,
                image_error *error);

/* An EXR of planes, not compressed, straight to its name: for files within a directory that is renamed when complete. */
#define IMAGE_MAX_PLANES 256
typedef struct image_plane {
    const char *name;
    const float *data;
    int step;         /* floats from pixel to pixel */
    ptrdiff_t stride; /* bytes from row to row */
} image_plane;
int image_write_planes(const char *path, int width, int height, const image_plane *planes, int count,
                       image_error *error);

int image_write_text(const char *path, const char *text, image_pending *pending, image_error *error);
int image_write_bytes(const char *path, const void *bytes, size_t size, image_pending *pending, image_error *error);
/* For other writers: a new file under a temporary name, null on failure; then the close that reports what failed. */
FILE *image_open_pending(const char *path, image_pending *pending, image_error *error);
int image_close_pending(FILE *file, int ok, const char *path, image_pending *pending, image_error *error);
int image_commit(image_pending *pending, image_error *error); /* rename into place */
void image_discard(image_pending *pending);                   /* remove; harmless after a commit or twice */

#endif
