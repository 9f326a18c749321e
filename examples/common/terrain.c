/* terrain.c - see terrain.h */
#include "terrain.h"

#include "raster.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static int join(char *path, size_t size, const char *directory, const char *name) {
    return snprintf(path, size, "%s/%s", directory, name) < (int)size;
}

static int read_at(int file, void *to, size_t bytes, long long at) {
    char *p = to;
    while (bytes > 0) {
        ssize_t n = pread(file, p, bytes, (off_t)at);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return 0;
        p += n;
        at += n;
        bytes -= (size_t)n;
    }
    return 1;
}

/* ---- levels ------------------------------------------------------------------------------------------------------ */

typedef struct cell {
    float least, mean, greatest, weight; /* weight: pixels that hold data; 0: the others mean nothing */
} cell;

static void cell_add(cell *to, float least, double *sum, float greatest, float weight, float mean) {
    if (!(weight > 0.0f))
        return;
    if (!(to->weight > 0.0f) || least < to->least)
        to->least = least;
    if (!(to->weight > 0.0f) || greatest > to->greatest)
        to->greatest = greatest;
    *sum += (double)mean * (double)weight;
    to->weight += weight;
}

static int first_shift(int overlap) {
    int shift = 0;
    while (TERRAIN_RINGS << (shift + 1) <= overlap)
        ++shift;
    return shift;
}

/* From the first that the overlap calls for until a level is a few dozen cells; no cell is near the size of the map,
 * whose mean would then stand for everything. */
static void plan_levels(terrain *t) {
    t->levels = 0;
    for (int shift = first_shift(t->overlap); t->levels < TERRAIN_MAX_LEVELS; ++shift) {
        terrain_level *l = t->level + t->levels++;
        int size = 1 << shift;
        l->shift = shift;
        l->width = (t->width + size - 1) / size;
        l->height = (t->height + size - 1) / size;
        l->file = -1;
        if (l->width <= 64 || l->height <= 64)
            break;
    }
}

static void level_name(int shift, char *name, size_t size) {
    snprintf(name, size, "level-%d", shift);
}

/* Rows of heights into one row of cells. */
static void pool_heights(const float *rows, int width, int row_count, int shift, cell *to) {
    int size = 1 << shift, cells = (width + size - 1) / size;
    for (int i = 0; i < cells; ++i) {
        cell *c = to + i;
        double sum = 0.0;
        int end = (i + 1) * size < width ? (i + 1) * size : width;
        memset(c, 0, sizeof *c);
        for (int y = 0; y < row_count; ++y)
            for (int x = i * size; x < end; ++x) {
                float h = rows[(size_t)y * (size_t)width + (size_t)x];
                cell_add(c, h, &sum, h, isnan(h) ? 0.0f : 1.0f, h);
            }
        c->mean = c->weight > 0.0f ? (float)(sum / (double)c->weight) : 0.0f;
    }
}

/* Two rows of cells (the second may be missing) into one row of the next level. */
static void pool_cells(const cell *a, const cell *b, int width, cell *to) {
    for (int i = 0; 2 * i < width; ++i) {
        cell *c = to + i;
        double sum = 0.0;
        memset(c, 0, sizeof *c);
        for (int k = 0; k < 4; ++k) {
            const cell *row = k < 2 ? a : b;
            int x = 2 * i + (k & 1);
            if (row && x < width)
                cell_add(c, row[x].least, &sum, row[x].greatest, row[x].weight, row[x].mean);
        }
        c->mean = c->weight > 0.0f ? (float)(sum / (double)c->weight) : 0.0f;
    }
}

/* The greatest difference of heights within 3 x 3 cells; across the seam too, as the map may be wrapped. */
static int measure_level(terrain_level *l) {
    size_t row = (size_t)l->width * sizeof(cell);
    cell *rows = malloc(3 * row);
    int ok = rows != NULL;
    l->deviation = 0.0;
    for (int y = 0; ok && y < l->height; ++y) {
        for (int k = 0; ok && k < 3; ++k)
            ok = read_at(l->file, rows + (size_t)k * (size_t)l->width, row,
                         (long long)row * ((y + k - 1 + l->height) % l->height));
        for (int x = 0; ok && x < l->width; ++x) {
            double least = HUGE_VAL, greatest = -HUGE_VAL;
            for (int k = 0; k < 9; ++k) {
                const cell *c = rows + (size_t)(k / 3) * (size_t)l->width + (x + k % 3 - 1 + l->width) % l->width;
                if (!(c->weight > 0.0f))
                    continue;
                least = (double)c->least < least ? (double)c->least : least;
                greatest = (double)c->greatest > greatest ? (double)c->greatest : greatest;
            }
            if (greatest - least > l->deviation)
                l->deviation = greatest - least;
        }
    }
    free(rows);
    return ok;
}

static int make_level(const char *directory, const terrain_level *from, terrain_level *to, image_error *error) {
    char name[32], path[4096];
    level_name(to->shift, name, sizeof name);
    if (!join(path, sizeof path, directory, name))
        return image_fail(error, directory, "name too long");
    cell *rows = malloc((2 * (size_t)from->width + (size_t)to->width) * sizeof *rows);
    FILE *file = rows ? fopen(path, "wb") : NULL;
    int ok = file != NULL;
    for (int y = 0; ok && y < to->height; ++y) {
        size_t width = (size_t)from->width;
        int count = from->height - 2 * y >= 2 ? 2 : 1;
        ok = read_at(from->file, rows, (size_t)count * width * sizeof *rows,
                     (long long)(2 * (size_t)y * width * sizeof *rows));
        if (!ok)
            break;
        pool_cells(rows, count == 2 ? rows + width : NULL, from->width, rows + 2 * width);
        ok = fwrite(rows + 2 * width, sizeof *rows, (size_t)to->width, file) == (size_t)to->width;
    }
    if (file)
        ok = fclose(file) == 0 && ok;
    if (!ok)
        image_fail(error, path, "cannot write: %s", rows ? strerror(errno) : "not enough memory");
    free(rows);
    return ok;
}

/* ---- copying in -------------------------------------------------------------------------------------------------- */

static raster_reader *open_heights(const terrain_source *source, raster_info *info, image_error *error) {
    return raster_open(source->heights, 1, source->raw_width, source->raw_height, info, error);
}

static void set_size(const raster_info *info, const terrain_source *source, terrain *t) {
    memset(t, 0, sizeof *t);
    t->heights_file = t->normals_file = -1;
    t->width = info->width;
    t->height = info->height;
    t->pixel_x = info->pixel_x;
    t->pixel_y = info->pixel_y;
    t->geographic = info->geographic;
    t->has_normals = source->normals != NULL;
    t->overlap = source->overlap;
    plan_levels(t);
}

int terrain_inspect(const terrain_source *source, terrain *t, image_error *error) {
    raster_info info;
    raster_reader *reader = open_heights(source, &info, error);
    if (!reader)
        return 0;
    raster_close(reader);
    set_size(&info, source, t);
    if (!source->normals)
        return 1;
    raster_info n;
    reader = raster_open(source->normals, 3, info.width, info.height, &n, error);
    if (!reader)
        return 0;
    raster_close(reader);
    if (n.width != info.width || n.height != info.height)
        return image_fail(error, source->normals, "%d x %d, but the heights are %d x %d", n.width, n.height, info.width,
                          info.height);
    return 1;
}

typedef struct height_rule {
    double scale;
    int has_no_data, no_data_nan;
    float no_data;
} height_rule;

static height_rule rule_of(const terrain_source *source, const raster_info *info) {
    height_rule rule;
    int unit = source->integers == 2 ||
               (source->integers == 0 && !info->georeferenced && raster_format_of(source->heights) == RASTER_PNG);
    double no_data = source->has_no_data ? source->no_data : info->no_data;
    rule.scale = source->height_scale * (unit && info->full_scale > 0.0 ? 1.0 / info->full_scale : 1.0);
    rule.has_no_data = source->has_no_data || info->has_no_data;
    rule.no_data_nan = rule.has_no_data && isnan(no_data);
    rule.no_data = (float)no_data;
    return rule;
}

static int copy_row(const height_rule *rule, const char *path, int y, float *row, terrain *t, image_error *error) {
    for (int x = 0; x < t->width; ++x) {
        float v = row[x];
        int hole = rule->has_no_data &&
                   (rule->no_data_nan ? isnan(v) : !isnan(v) && !(v < rule->no_data) && !(v > rule->no_data));
        double h = (double)v * rule->scale;
        row[x] = (float)h;
        if (hole) {
            row[x] = NAN;
            ++t->holes;
        } else if (!isfinite(v) || !isfinite(row[x])) {
            return isfinite(v)
                       ? image_fail(error, path, "the height at column %d, row %d is out of range when scaled", x, y)
                       : image_fail(error, path, "%s at column %d, row %d; --no-data %s would make it a hole",
                                    isnan(v) ? "not a number" : "infinity", x, y,
                                    isnan(v)   ? "nan"
                                    : v > 0.0f ? "inf"
                                               : "-inf");
        } else {
            t->lowest = (double)row[x] < t->lowest ? (double)row[x] : t->lowest;
            t->highest = (double)row[x] > t->highest ? (double)row[x] : t->highest;
        }
    }
    return 1;
}

static int copy_heights(const char *directory, const terrain_source *source, terrain_progress progress, void *user,
                        terrain *t, image_error *error) {
    char path[4096], level_path[4096], name[32];
    raster_info info;
    level_name(t->level[0].shift, name, sizeof name);
    if (!join(path, sizeof path, directory, "heights") || !join(level_path, sizeof level_path, directory, name))
        return image_fail(error, directory, "name too long");
    raster_reader *reader = open_heights(source, &info, error);
    if (!reader)
        return 0;
    height_rule rule = rule_of(source, &info);
    int shift = t->level[0].shift, band = 1 << shift, ok = 1;
    size_t width = (size_t)t->width, cells = (size_t)t->level[0].width;
    float *rows = malloc((size_t)band * width * sizeof *rows);
    cell *level = malloc(cells * sizeof *level);
    FILE *file = fopen(path, "wb"), *level_file = fopen(level_path, "wb");
    if (!rows || !level || !file || !level_file)
        ok = image_fail(error, rows && level ? path : source->heights, "%s",
                        rows && level ? strerror(errno) : "not enough memory");
    t->lowest = HUGE_VAL;
    t->highest = -HUGE_VAL;
    t->holes = 0;
    for (int y = 0; ok && y < t->height; y += band) {
        int count = t->height - y < band ? t->height - y : band;
        for (int k = 0; ok && k < count; ++k)
            ok = raster_read(reader, 1, rows + (size_t)k * width, error) &&
                 copy_row(&rule, source->heights, y + k, rows + (size_t)k * width, t, error);
        if (!ok)
            break;
        pool_heights(rows, t->width, count, shift, level);
        if (fwrite(rows, sizeof *rows, (size_t)count * width, file) != (size_t)count * width ||
            fwrite(level, sizeof *level, cells, level_file) != cells)
            ok = image_fail(error, path, "cannot write: %s", strerror(errno));
        if (progress)
            progress(user, (double)(y + count) / t->height);
    }
    if (file && fclose(file) != 0 && ok)
        ok = image_fail(error, path, "cannot write: %s", strerror(errno));
    if (level_file && fclose(level_file) != 0 && ok)
        ok = image_fail(error, level_path, "cannot write: %s", strerror(errno));
    raster_close(reader);
    free(rows);
    free(level);
    if (ok && t->holes == (long long)t->width * t->height)
        ok = image_fail(error, source->heights, "no cell holds data");
    return ok;
}

/* Into the library's axes: x right, y down, z into the surface. */
static int copy_normals(const char *directory, const terrain_source *source, const terrain *t, image_error *error) {
    char path[4096];
    raster_info info;
    if (!join(path, sizeof path, directory, "normals"))
        return image_fail(error, directory, "name too long");
    raster_reader *reader = raster_open(source->normals, 3, t->width, t->height, &info, error);
    if (!reader)
        return 0;
    int ok = info.width == t->width && info.height == t->height;
    if (!ok)
        image_fail(error, source->normals, "%d x %d, but the heights are %d x %d", info.width, info.height, t->width,
                   t->height);
    size_t width = (size_t)t->width;
    float *row = malloc(3 * width * sizeof *row), scale = info.full_scale > 0.0 ? (float)(2.0 / info.full_scale) : 1.0f;
    float bias = info.full_scale > 0.0 ? -1.0f : 0.0f;
    FILE *file = row ? fopen(path, "wb") : NULL;
    if (ok && !file)
        ok = image_fail(error, path, "cannot write: %s", row ? strerror(errno) : "not enough memory");
    for (int y = 0; ok && y < t->height; ++y) {
        ok = raster_read(reader, 1, row, error);
        for (size_t x = 0; ok && x < width; ++x) {
            float *n = row + 3 * x;
            n[0] = scale * n[0] + bias;
            n[1] = (scale * n[1] + bias) * (source->green_down ? 1.0f : -1.0f);
            n[2] = -(scale * n[2] + bias);
            if (!isfinite(n[0]) || !isfinite(n[1]) || !isfinite(n[2]))
                n[0] = n[1] = n[2] = 0.0f; /* the library derives one */
        }
        if (ok && fwrite(row, 3 * sizeof *row, width, file) != width)
            ok = image_fail(error, path, "cannot write: %s", strerror(errno));
    }
    if (file && fclose(file) != 0 && ok)
        ok = image_fail(error, path, "cannot write: %s", strerror(errno));
    raster_close(reader);
    free(row);
    return ok;
}

/* ---- the description on disk --------------------------------------------------------------------------------------- */

/* Numbers as %a, so that what is read is what was written. */
static int write_description(const char *directory, const terrain *t, image_error *error) {
    char path[4096], text[4096];
    size_t n = 0;
    image_pending pending;
    if (!join(path, sizeof path, directory, "terrain"))
        return image_fail(error, directory, "name too long");
    n += (size_t)snprintf(text, sizeof text, "1 %d %d %a %a %d %a %a %lld %d %d %d", t->width, t->height, t->pixel_x,
                          t->pixel_y, t->geographic, t->lowest, t->highest, t->holes, t->has_normals, t->overlap,
                          t->levels);
    for (int i = 0; i < t->levels; ++i)
        n += (size_t)snprintf(text + n, sizeof text - n, " %a", t->level[i].deviation);
    snprintf(text + n, sizeof text - n, " end\n");
    return image_write_text(path, text, &pending, error) && image_commit(&pending, error);
}

static int read_description(const char *path, terrain *t) {
    FILE *file = fopen(path, "rb");
    int version = 0, levels = 0, ok;
    char end[8] = "";
    if (!file)
        return 0;
    memset(t, 0, sizeof *t);
    ok = fscanf(file, "%d %d %d %la %la %d %la %la %lld %d %d %d", &version, &t->width, &t->height, &t->pixel_x,
                &t->pixel_y, &t->geographic, &t->lowest, &t->highest, &t->holes, &t->has_normals, &t->overlap,
                &levels) == 12 &&
         version == 1 && t->width > 0 && t->height > 0 && t->overlap >= 2 * TERRAIN_RINGS;
    if (ok) {
        plan_levels(t);
        ok = t->levels == levels;
    }
    for (int i = 0; ok && i < t->levels; ++i)
        ok = fscanf(file, "%la", &t->level[i].deviation) == 1;
    ok = ok && fscanf(file, "%7s", end) == 1 && strcmp(end, "end") == 0;
    fclose(file);
    return ok;
}

static int open_level(const char *directory, terrain_level *l, image_error *error) {
    char name[32], path[4096];
    level_name(l->shift, name, sizeof name);
    if (!join(path, sizeof path, directory, name))
        return image_fail(error, directory, "name too long");
    l->file = open(path, O_RDONLY);
    return l->file >= 0 ? 1 : image_fail(error, path, "%s", strerror(errno));
}

static int open_whole(const char *directory, const char *name, long long bytes, int *file, image_error *error) {
    char path[4096];
    struct stat info;
    if (!join(path, sizeof path, directory, name))
        return image_fail(error, directory, "name too long");
    *file = open(path, O_RDONLY);
    if (*file < 0)
        return image_fail(error, path, "%s", strerror(errno));
    return fstat(*file, &info) == 0 && (long long)info.st_size == bytes ? 1 : image_fail(error, path, "truncated");
}

int terrain_open(const char *directory, terrain *t, image_error *error) {
    char path[4096];
    if (!join(path, sizeof path, directory, "terrain"))
        return image_fail(error, directory, "name too long");
    if (!read_description(path, t))
        return image_fail(error, path, "missing or not complete");
    long long pixels = (long long)t->width * t->height;
    t->heights_file = t->normals_file = -1;
    for (int i = 0; i < t->levels; ++i)
        t->level[i].file = -1;
    int ok = open_whole(directory, "heights", 4 * pixels, &t->heights_file, error) &&
             (!t->has_normals || open_whole(directory, "normals", 12 * pixels, &t->normals_file, error));
    for (int i = 0; ok && i < t->levels; ++i)
        ok = open_level(directory, t->level + i, error);
    if (!ok)
        terrain_close(t);
    return ok;
}

int terrain_create(const char *directory, const terrain_source *source, terrain_progress progress, void *user,
                   terrain *t, image_error *error) {
    image_error ignored;
    if (terrain_open(directory, t, &ignored))
        return 1;
    if (!terrain_inspect(source, t, error) || !copy_heights(directory, source, progress, user, t, error) ||
        (source->normals && !copy_normals(directory, source, t, error)))
        return 0;
    int ok = open_level(directory, t->level, error);
    for (int i = 1; ok && i < t->levels; ++i)
        ok = make_level(directory, t->level + i - 1, t->level + i, error) && open_level(directory, t->level + i, error);
    for (int i = 0; ok && i < t->levels; ++i)
        if (!measure_level(t->level + i))
            ok = image_fail(error, directory, "cannot read back");
    ok = ok && write_description(directory, t, error);
    terrain_close(t);
    return ok && terrain_open(directory, t, error);
}

void terrain_close(terrain *t) {
    for (int i = 0; i < t->levels; ++i)
        if (t->level[i].file >= 0)
            close(t->level[i].file);
    if (t->heights_file >= 0)
        close(t->heights_file);
    if (t->normals_file >= 0)
        close(t->normals_file);
    t->levels = 0;
    t->heights_file = t->normals_file = -1;
}

/* ---- windows ----------------------------------------------------------------------------------------------------- */

/* The map's coordinate that stands for one beyond it, or -1. */
static int inside(long long i, int size, terrain_border border) {
    if (i >= 0 && i < size)
        return (int)i;
    if (border == TERRAIN_CLAMP)
        return i < 0 ? 0 : size - 1;
    return border == TERRAIN_WRAP ? (int)(((i % size) + size) % size) : -1;
}

static int read_window(const terrain *t, int file, int channels, float missing, terrain_border border, int x, int y,
                       int width, int height, float *to, image_error *error) {
    size_t pixel = (size_t)channels * sizeof(float);
    for (int row = 0; row < height; ++row) {
        int from_y = inside((long long)y + row, t->height, border);
        for (int column = 0; column < width;) {
            int from_x = from_y < 0 ? -1 : inside((long long)x + column, t->width, border), count = 1;
            float *at = to + ((size_t)row * (size_t)width + (size_t)column) * (size_t)channels;
            if (from_x < 0) {
                for (int c = 0; c < channels; ++c)
                    at[c] = missing;
            } else {
                if ((long long)x + column >= 0 || border == TERRAIN_WRAP) /* as far as the map goes on */
                    count = width - column < t->width - from_x ? width - column : t->width - from_x;
                if (!read_at(file, at, (size_t)count * pixel,
                             ((long long)from_y * t->width + from_x) * (long long)pixel))
                    return image_fail(error, "heights", "cannot read the copy of the map: %s", strerror(errno));
            }
            column += count;
        }
    }
    return 1;
}

int terrain_heights(const terrain *t, terrain_border border, int x, int y, int width, int height, float *to,
                    image_error *error) {
    return read_window(t, t->heights_file, 1, NAN, border, x, y, width, height, to, error);
}

int terrain_normals(const terrain *t, terrain_border border, int x, int y, int width, int height, float *to,
                    image_error *error) {
    return read_window(t, t->normals_file, 3, 0.0f, border, x, y, width, height, to, error);
}

/* ---- far terrain ------------------------------------------------------------------------------------------------- */

/* How far beyond a window's edge level i is looked at. */
static double level_reach(const terrain *t, int i, double reach_px) {
    double reach = (double)(TERRAIN_RINGS * 2) * (double)(1 << t->level[i].shift) - t->overlap;
    return i + 1 == t->levels || reach > reach_px ? reach_px : reach;
}

static long long floor_shift(double x, int shift) {
    return (long long)floor(ldexp(x, -shift));
}

/* The range of a level's cells, in cells, that lines from a window of `size` pixels at `at` meet, and one around them.
 * True if that is more than a map that wraps: then it is the map. */
static int level_range(double reach, int shift, int at, int size, int map, terrain_border border, long long *begin,
                       long long *end) {
    double low = at - reach, high = (double)at + size + reach;
    if (border != TERRAIN_WRAP) {
        low = low < 0.0 ? 0.0 : low;
        high = high > map ? map : high;
    }
    int periodic = high - low > map;
    if (periodic) {
        low = 0.0;
        high = map;
    }
    *begin = floor_shift(low, shift) - 1;
    *end = floor_shift(high, shift) + 2;
    return periodic;
}

void terrain_view_free(terrain_view *view) {
    for (int i = 0; i < TERRAIN_MAX_LEVELS; ++i)
        free(view->level[i].cells);
    memset(view, 0, sizeof *view);
}

/* What stands for a cell: a line over it meets its ridges and not its hollows, so a height between its mean and its
 * greatest. Measured on fractal ridges of slope 0.2, horizons beyond an overlap of 256 come out low by 0.006 in slope
 * with the mean, high by 0.002 with the greatest, and unbiased with this: RMSE 0.003. */
#define TOWARDS_GREATEST 0.75f

/* As far as the library goes on beyond a border: the map's diagonal. What is farther is seen under small slopes. */
static double useful_reach(const terrain *t, double reach_px) {
    double diagonal = sqrt((double)t->width * t->width + (double)t->height * t->height);
    return reach_px < diagonal ? reach_px : diagonal;
}

int terrain_view_create(const terrain *t, terrain_border border, int x, int y, int width, int height, double reach_px,
                        terrain_view *view, image_error *error) {
    memset(view, 0, sizeof *view);
    view->terrain = t;
    view->border = border;
    view->window_x = x;
    view->window_y = y;
    view->window_width = width;
    view->window_height = height;
    view->reach_px = useful_reach(t, reach_px);
    for (int i = 0; i < t->levels; ++i) {
        const terrain_level *l = t->level + i;
        double reach = level_reach(t, i, view->reach_px);
        long long x0, x1, y0, y1;
        view->level[i].periodic_x = level_range(reach, l->shift, x, width, t->width, border, &x0, &x1);
        view->level[i].periodic_y = level_range(reach, l->shift, y, height, t->height, border, &y0, &y1);
        size_t columns = (size_t)(x1 - x0), rows = (size_t)(y1 - y0);
        float *cells = malloc(columns * rows * sizeof *cells);
        cell *line = malloc((size_t)l->width * sizeof *line);
        view->level[i].x = (int)x0;
        view->level[i].y = (int)y0;
        view->level[i].width = (int)columns;
        view->level[i].height = (int)rows;
        view->level[i].cells = cells;
        int ok = cells && line ? 1 : image_fail(error, "far terrain", "not enough memory");
        for (size_t row = 0; ok && row < rows; ++row) {
            /* by the pixel in the middle of the cell, since a map that wraps need not be whole cells wide */
            long long half = l->shift ? 1ll << (l->shift - 1) : 0,
                      py = (y0 + (long long)row) * (1ll << l->shift) + half;
            int from_y = inside(py, t->height, border == TERRAIN_WRAP ? border : TERRAIN_CLAMP) >> l->shift;
            if (!read_at(l->file, line, (size_t)l->width * sizeof *line,
                         (long long)from_y * l->width * (long long)sizeof *line))
                ok = image_fail(error, "far terrain", "cannot read: %s", strerror(errno));
            for (size_t column = 0; ok && column < columns; ++column) {
                long long px = (x0 + (long long)column) * (1ll << l->shift) + half;
                int from_x = inside(px, t->width, border == TERRAIN_WRAP ? border : TERRAIN_CLAMP) >> l->shift;
                const cell *c = line + from_x;
                cells[row * columns + column] =
                    c->weight > 0.0f ? c->mean + TOWARDS_GREATEST * (c->greatest - c->mean) : NAN;
            }
        }
        free(line);
        if (!ok) {
            terrain_view_free(view);
            return 0;
        }
    }
    return 1;
}

size_t terrain_view_bytes(const terrain *t, int width, int height) {
    double sum = 0.0;
    for (int i = 0; i < t->levels; ++i) {
        const terrain_level *l = t->level + i;
        double reach = i + 1 == t->levels ? HUGE_VAL : (double)(TERRAIN_RINGS * 2) * (double)(1 << l->shift);
        double columns = ldexp(width + 2.0 * reach, -l->shift) + 4.0,
               rows = ldexp(height + 2.0 * reach, -l->shift) + 4.0;
        columns = columns < l->width + 4.0 ? columns : l->width + 4.0;
        rows = rows < l->height + 4.0 ? rows : l->height + 4.0;
        sum += columns * rows * sizeof(float) + (double)l->width * sizeof(cell);
    }
    return sum < 1e15 ? (size_t)sum : (size_t)1e15;
}

/* A line through the cells of a level, in cells from the centre of the first. */
typedef struct cell_line {
    const float *cells;
    ptrdiff_t width, height;
    double u, v, du, dv, period_u, period_v; /* period: 0, or of a map that wraps */
} cell_line;

static cell_line line_of(const terrain_view *view, int i, double x, double y, double dx, double dy) {
    const terrain *t = view->terrain;
    double cells_per_pixel = ldexp(1.0, -t->level[i].shift);
    cell_line l = {view->level[i].cells,
                   view->level[i].width,
                   view->level[i].height,
                   x * cells_per_pixel - 0.5 - view->level[i].x,
                   y * cells_per_pixel - 0.5 - view->level[i].y,
                   dx,
                   dy,
                   view->level[i].periodic_x ? t->width * cells_per_pixel : 0.0,
                   view->level[i].periodic_y ? t->height * cells_per_pixel : 0.0};
    return l;
}

/* floor() of what is small, without the call. */
static double whole_below(double x) {
    double whole = (double)(long)x;
    return whole > x ? whole - 1.0 : whole;
}

/* Bilinear between the centres of cells, `along` cells from the line's begin; NaN if the nearest is missing. */
static float height_on(const cell_line *l, double along) {
    double u = l->u + along * l->du, v = l->v + along * l->dv;
    if (l->period_u > 0.0) /* the first cell stored is the last of the period before */
        u -= l->period_u * whole_below((u - 0.5) / l->period_u);
    if (l->period_v > 0.0)
        v -= l->period_v * whole_below((v - 0.5) / l->period_v);
    u = u < 0.0 ? 0.0 : u > (double)l->width - 1.001 ? (double)l->width - 1.001 : u;
    v = v < 0.0 ? 0.0 : v > (double)l->height - 1.001 ? (double)l->height - 1.001 : v;
    ptrdiff_t iu = (ptrdiff_t)u, iv = (ptrdiff_t)v;
    float fu = (float)(u - (double)iu), fv = (float)(v - (double)iv);
    const float *c = l->cells + iv * l->width + iu;
    float a = c[0] + (c[1] - c[0]) * fu, b = c[l->width] + (c[l->width + 1] - c[l->width]) * fu, h = a + (b - a) * fv;
    return h == h ? h : c[(fv >= 0.5f ? l->width : 0) + (fu >= 0.5f ? 1 : 0)];
}

/* Removes the points that no receiver at distance <= 0 can see over the others. Points come farthest first. */
static int add_to_hull(int count, int capacity, float *distance, float *height, float d, float h) {
    while (count >= 2) { /* the last is below the line from the one before it to the new one */
        double d0 = (double)distance[count - 2], d1 = (double)distance[count - 1];
        double h0 = (double)height[count - 2], h1 = (double)height[count - 1];
        if ((h1 - h0) * (d0 - (double)d) > ((double)h - h0) * (d0 - d1))
            break;
        --count;
    }
    if (count == capacity) { /* too round a landscape: every other point, the nearest and the farthest kept */
        int kept = 1;
        for (int i = 2; i < count; i += 2, ++kept) {
            distance[kept] = distance[i];
            height[kept] = height[i];
        }
        count = kept;
    }
    distance[count] = d;
    height[count] = h;
    return count + 1;
}

/* Distance from x to where a line of slope dx leaves [0, size]. */
static double distance_to_border(double x, double dx, double size) {
    if (dx > 0.0)
        return (size - x) / dx;
    return dx < 0.0 ? -x / dx : HUGE_VAL;
}

int terrain_far_line(const terrain_view *view, double x, double y, double dx, double dy, int capacity, float *distance,
                     float *height) {
    const terrain *t = view->terrain;
    double px = x + view->window_x, py = y + view->window_y, end = view->reach_px;
    /* (x, y) may be a pixel's centre just inside: what is in the window is the window's */
    double wx = distance_to_border(x, dx, view->window_width), wy = distance_to_border(y, dy, view->window_height);
    double inside_px = wx < wy ? wx : wy;
    int count = 0;
    if (view->border == TERRAIN_OPEN) {
        double bx = distance_to_border(px, dx, t->width), by = distance_to_border(py, dy, t->height);
        double leaves = bx < by ? bx : by;
        end = leaves < end ? leaves : end;
    }
    for (int i = t->levels; i-- > 0;) {
        double step = (double)(1 << t->level[i].shift), ring = TERRAIN_RINGS * step;
        double begin = i == 0 ? 0.0 : ring - t->overlap, limit = i + 1 == t->levels ? end : 2.0 * ring - t->overlap;
        limit = limit < end ? limit : end;
        /* samples at begin + step / 2, begin + 3 step / 2, ...: whole steps in every ring */
        long long k = (long long)floor((limit - begin) / step - 0.5);
        if (k < 0)
            continue;
        cell_line l = line_of(view, i, px + dx * begin, py + dy * begin, dx, dy);
        for (; k >= 0; --k) {
            double d = begin + ((double)k + 0.5) * step;
            float h = height_on(&l, (double)k + 0.5);
            if (h == h && d > inside_px)
                count = add_to_hull(count, capacity, distance, height, (float)d, h);
        }
    }
    return count;
}

double terrain_slope_error(const terrain *t) {
    double worst = 0.0;
    for (int i = 0; i < t->levels; ++i) {
        double nearest = (double)TERRAIN_RINGS * (double)(1 << t->level[i].shift);
        double height = t->level[i].deviation, all = t->highest - t->lowest;
        double error = (height + all / (2.0 * TERRAIN_RINGS)) / nearest; /* in height, and half a cell in distance */
        worst = error > worst ? error : worst;
    }
    return worst;
}
