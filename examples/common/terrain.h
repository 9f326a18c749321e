/* terrain.h - a height map in a directory on disk, laid out for tiles: any window of it at full resolution, and what
 * lies far beyond a window through coarser levels.
 *
 * The map is copied once, checked value by value on the way: `heights` row by row, `normals` if there are any, and the
 * levels, in which a cell is the least, mean and greatest height of a square of 2^level pixels. Missing cells are NaN.
 *
 * Errors as in image.h. */
#ifndef EXAMPLES_TERRAIN_H
#define EXAMPLES_TERRAIN_H

#include "image.h"

#include <stdint.h>

#define TERRAIN_MAX_LEVELS 24
#define TERRAIN_RINGS 64 /* a cell of 2^l pixels is looked at from at least TERRAIN_RINGS 2^l pixels away */

typedef enum terrain_border { TERRAIN_OPEN, TERRAIN_CLAMP, TERRAIN_WRAP } terrain_border; /* as gtao_border */

typedef struct terrain_source {
    const char *heights; /* FILE[:CHANNEL] */
    const char *normals; /* FILE[:LAYER], or null */
    int raw_width, raw_height;
    int integers; /* of integer files: 0 as the file says, 1 as stored, 2 full scale is 1 */
    double height_scale;
    int has_no_data; /* 0: as the file says */
    double no_data;  /* may be NaN, infinity */
    int green_down;  /* normals: y points down the image, as in DirectX; else up, as in OpenGL */
    int overlap;     /* pixels around a tile at full resolution, a power of two, at least 2 TERRAIN_RINGS */
} terrain_source;

typedef struct terrain_level {
    int shift, width, height;
    double deviation; /* greatest difference of heights within 3 x 3 cells */
    int file;
} terrain_level;

typedef struct terrain {
    int width, height;
    double pixel_x, pixel_y; /* stated by the file; 0: not */
    int geographic;
    double lowest, highest;
    long long holes;
    int has_normals;
    int overlap;
    int levels;
    terrain_level level[TERRAIN_MAX_LEVELS]; /* level[i].shift = first shift + i */
    int heights_file, normals_file;
} terrain;

/* Size and what the file says about its pixels, without reading them. */
int terrain_inspect(const terrain_source *source, terrain *t, image_error *error);

/* Copies `source` into `directory`, or takes what is already there complete. `progress` (null: none) is called with the
 * part done. */
typedef void (*terrain_progress)(void *user, double part);
int terrain_create(const char *directory, const terrain_source *source, terrain_progress progress, void *user,
                   terrain *t, image_error *error);
/* What terrain_create left in `directory`. */
int terrain_open(const char *directory, terrain *t, image_error *error);
void terrain_close(terrain *t);

/* Rows of heights (1 float) or normals (3) of a window that may reach beyond the map: wrapped, continued, or NaN (0). */
int terrain_heights(const terrain *t, terrain_border border, int x, int y, int width, int height, float *to,
                    image_error *error);
int terrain_normals(const terrain *t, terrain_border border, int x, int y, int width, int height, float *to,
                    image_error *error);

/* ---- far terrain ------------------------------------------------------------------------------------------------- */

/* The cells that lines starting at a window's edges can meet, in memory. */
typedef struct terrain_view {
    const terrain *terrain;
    terrain_border border;
    int window_x, window_y, window_width, window_height;
    double reach_px; /* nothing beyond it counts */
    struct {
        int x, y, width, height;    /* in cells; may be beyond the map if it wraps */
        int periodic_x, periodic_y; /* they are the whole map that way, and coordinates are brought into it */
        float *cells;               /* one height each, NaN where missing */
    } level[TERRAIN_MAX_LEVELS];
} terrain_view;

int terrain_view_create(const terrain *t, terrain_border border, int x, int y, int width, int height, double reach_px,
                        terrain_view *view, image_error *error);
void terrain_view_free(terrain_view *view);
size_t terrain_view_bytes(const terrain *t, int width, int height); /* at most, for a window of this size */

/* What lies beyond the window on the line from (x, y), window coordinates in pixels, in the unit direction (dx, dy): an
 * upper hull of at most `capacity` points, farthest first, distance[] in pixels from (x, y), height[]. Returns how many.
 * Pure: any threads at once. */
int terrain_far_line(const terrain_view *view, double x, double y, double dx, double dy, int capacity, float *distance,
                     float *height);

/* Bound of the error of a horizon's slope, in world units of height per pixel of distance, for a receiver at least
 * `overlap` pixels inside the window: it sees each cell from TERRAIN_RINGS of its sizes away or more, and the height
 * that stands for a pixel differs from it by no more than heights differ within 3 x 3 cells. */
double terrain_slope_error(const terrain *t);

#endif
