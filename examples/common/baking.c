/* baking.c - see baking.h */
#include "baking.h"

#include "canvas.h"
#include "cli.h"
#include "dump.h"
#include "gtao.h"
#include "pool.h"
#include "raster.h"
#include "terrain.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#define MIB 1048576.0

enum { OUT_VISIBILITY, OUT_BENT, OUT_HORIZONS, OUT_SH, OUT_COUNT };

enum {
    OPT_HEIGHT,
    OPT_RAW_SIZE,
    OPT_PIXEL_SIZE,
    OPT_HEIGHT_SCALE,
    OPT_INTEGERS,
    OPT_NO_DATA,
    OPT_NORMAL,
    OPT_NORMAL_GREEN,
    OPT_WRAP,
    OPT_BORDER,
    OPT_DIRECTIONS,
    OPT_RADIUS,
    OPT_FALLOFF,
    OPT_OUTPUT,
    OPT_BENT,
    OPT_BENT_SPACE,
    OPT_GREEN,
    OPT_WORLD_AXES,
    OPT_HORIZONS,
    OPT_SH,
    OPT_PICTURE,
    OPT_BITS,
    OPT_MEMORY,
    OPT_TILE,
    OPT_OVERLAP,
    OPT_WORK,
    OPT_FRESH,
    OPT_THREADS,
    OPT_ISA,
    OPT_STATS,
    OPT_DUMP,
    OPT_COUNT
};

typedef struct settings {
    terrain_source source;
    const char *output[OUT_COUNT];
    const char *stats, *work, *picture, *dump;
    int raw_size[2];
    float pixel_size[2]; /* as given: 0 where not */
    double pixel[2];
    float radius, falloff;
    int border, wrap, directions, isa, threads, tile, fresh, sixteen;
    double memory;
    int bent_world, green_down;
    cli_axes world; /* which axis of the world the image's right, up and outward are */
    unsigned char given[OPT_COUNT];
} settings;

struct baking {
    settings o;
    terrain map;
    int has_map, created_work, lock, limited; /* limited: tiles of at most 1024 pixels, to share them out */
    char work[4096];
    int tile_width, tile_height, columns, rows;
    pool *workers;
    double started, seconds_reading, seconds_computing, seconds_writing;
    cli_progress reading, tiles; /* bars */
    char tiles_what[48];
    int progress_count, progress_done, tiles_found, tiles_computed;
    long long pixels_computed;

    /* the tile in work */
    gtao_sweep *sweep;
    char *work_memory; /* of each thread */
    size_t work_bytes;
    int phase;
    dump *dump; /* of the only tile, or null */
};

/* ---- options ----------------------------------------------------------------------------------------------------- */

static int set_no_data(void *to, const cli_option *option, const char *value) {
    settings *o = to;
    o->source.has_no_data = 1;
    if (strcmp(value, "nan") == 0 || strcmp(value, "NaN") == 0) {
        o->source.no_data = (double)NAN;
        return 1;
    }
    return cli_number(value, &o->source.no_data) ? 1 : cli_bad_value(option, value, "a number, or nan");
}

static int set_overlap(void *to, const cli_option *option, const char *value) {
    settings *o = to;
    long n;
    if (!cli_integer(value, 2 * TERRAIN_RINGS, 4096, &n) || (n & (n - 1)) != 0)
        return cli_bad_value(option, value, "128, 256, 512, 1024, 2048 or 4096");
    o->source.overlap = (int)n;
    return 1;
}

static const char *const integer_kinds[] = {"", "stored", "unit", NULL};
static const char *const greens[] = {"opengl", "directx", NULL};
static const char *const spaces[] = {"tangent", "world", NULL};
static const char *const borders[] = {"open", "clamp", "wrap", NULL};
static const char *const bit_counts[] = {"8", "16", NULL};
static const int output_option[OUT_COUNT] = {OPT_OUTPUT, OPT_BENT, OPT_HORIZONS, OPT_SH};

static const cli_option option_table[OPT_COUNT] = {
    [OPT_HEIGHT] = {"--height", "FILE[:CHANNEL]", "heights: .exr, .pfm, .png, .tif, .raw or .f32 (floats)",
                    CLI_INPUT(settings, source.heights)},
    [OPT_RAW_SIZE] = {"--raw-size", "W,H", "size of a raw file",
                      CLI_SIZE(settings, raw_size, 1, RASTER_MAX_SIZE, "two sizes in pixels, W,H")},
    [OPT_PIXEL_SIZE] = {"--pixel-size", "SX[,SY]", "world units per pixel (a GeoTIFF states its own)",
                        CLI_FLOATS(settings, pixel_size, 1, 2, CLI_ABOVE_0, CLI_FINITE, "one or two positive numbers")},
    [OPT_HEIGHT_SCALE] = {"--height-scale", "S", "world units per unit of height (1)",
                          CLI_DOUBLE(settings, source.height_scale, -CLI_FINITE, CLI_FINITE, "a finite number, not 0"),
                          .not_0 = 1},
    [OPT_INTEGERS] = {"--integers", "unit|stored", "integer heights: full scale is 1 (PNG), or as stored (TIFF)",
                      CLI_CHOICE(settings, source.integers, integer_kinds)},
    [OPT_NO_DATA] = {"--no-data", "VALUE", "cells of this value are holes; nan and inf too (a GeoTIFF states its own)",
                     CLI_OWN(set_no_data)},
    [OPT_NORMAL] = {"--normal", "FILE[:LAYER]", "normal map in tangent space; without: from the heights",
                    CLI_INPUT(settings, source.normals)},
    [OPT_NORMAL_GREEN] = {"--normal-green", "opengl|directx", "its green is up (opengl) or down the image",
                          CLI_CHOICE(settings, source.green_down, greens)},
    [OPT_WRAP] = {"--wrap", NULL, "the map repeats: --border wrap", CLI_FLAG(settings, wrap)},
    [OPT_BORDER] = {"--border", "open|clamp|wrap", "beyond the map is nothing (open), its edge, or the map again",
                    CLI_CHOICE(settings, border, borders)},
    [OPT_DIRECTIONS] = {"--directions", "N", "1..64 directions, each to both sides (32)",
                        CLI_INTEGER(settings, directions, 1, 64, NULL)},
    [OPT_RADIUS] = {"--radius", "R", "reach of occluders, world units (inf: the whole map)",
                    CLI_FLOAT(settings, radius, CLI_ABOVE_0, HUGE_VAL, "a positive number, or inf")},
    [OPT_FALLOFF] = {"--falloff", "F", "part of the radius over which occlusion fades out, 0..1 (0)",
                     CLI_FLOAT(settings, falloff, 0, 1, "0..1")},
    [OPT_OUTPUT] = {"-o", "FILE", "visibility, 1 = open; .exr, .pfm, .png, .tif, .raw or .f32",
                    CLI_OUTPUT(settings, output[OUT_VISIBILITY], RASTER_ENDINGS)},
    [OPT_BENT] = {"--bent", "FILE", "bent normals", CLI_OUTPUT(settings, output[OUT_BENT], RASTER_ENDINGS)},
    [OPT_BENT_SPACE] = {"--bent-space", "tangent|world", "of --bent and --sh (tangent: x right, z out of the map)",
                        CLI_CHOICE(settings, bent_world, spaces)},
    [OPT_GREEN] = {"--green", "opengl|directx", "green of the tangent space is up (opengl) or down the image",
                   CLI_CHOICE(settings, green_down, greens)},
    [OPT_WORLD_AXES] = {"--world-axes", "+x+y+z",
                        "world: the axes that right, up and out of the map are; +x-z+y: y is up",
                        CLI_AXES(settings, world, "three signed axes, each once, such as +x-z+y")},
    [OPT_HORIZONS] = {"--horizons", "FILE",
                      "sine of the horizon's elevation, a channel for each side of each direction",
                      CLI_OUTPUT(settings, output[OUT_HORIZONS], RASTER_ENDINGS)},
    [OPT_SH] = {"--sh", "FILE", "spherical harmonics of visibility times cosine, nine channels",
                CLI_OUTPUT(settings, output[OUT_SH], RASTER_ENDINGS)},
    [OPT_PICTURE] = {"--picture", "FILE.png", "a look at it: heights, visibility, bent normals, and lit by sun and sky",
                     CLI_OUTPUT(settings, picture, ".png")},
    [OPT_BITS] = {"--bits", "8|16", "of PNG files (8)", CLI_CHOICE(settings, sixteen, bit_counts)},
    [OPT_MEMORY] = {"--memory", "SIZE", "to use at most, such as 512M or 2G (1G); decides the size of the tiles",
                    CLI_MEMORY(settings, memory)},
    [OPT_TILE] = {"--tile", "N", "pixels a side of a tile instead", CLI_INTEGER(settings, tile, 16, 16384, NULL)},
    [OPT_OVERLAP] = {"--overlap", "N", "pixels around a tile at full resolution, 128, 256, 512 ... (256)",
                     CLI_OWN(set_overlap)},
    [OPT_WORK] = {"--work", "DIR", "for what is unfinished (the first output's name and .work)",
                  CLI_TEXT(settings, work)},
    [OPT_FRESH] = {"--fresh", NULL, "do not go on with what an earlier run left there", CLI_FLAG(settings, fresh)},
    [OPT_THREADS] = {"--threads", "N", "(all processors) the results are the same bits",
                     CLI_THREADS(settings, threads)},
    [OPT_ISA] = {"--isa", "auto|scalar|sse2|avx2|avx512|neon", "(auto) the results are the same bits",
                 CLI_ISA(settings, isa)},
    [OPT_STATS] = {"--stats", "FILE", "write times and bounds as JSON", CLI_OUTPUT(settings, stats, NULL)},
    [OPT_DUMP] = {"--dump", "DIR", "also write what lies between the stages, for ports to compare: docs/porting.md",
                  CLI_TEXT(settings, dump)},
};

static int channels_of(const baking *b, int output) {
    return output == OUT_BENT ? 3 : output == OUT_HORIZONS ? 2 * b->o.directions : output == OUT_SH ? 9 : 1;
}

static int check_options(baking *b) {
    settings *o = &b->o;
    const char *first = NULL;
    if (!o->source.heights)
        return cli_error("--height: required, see --help");
    for (int k = OUT_COUNT - 1; k >= 0; --k)
        first = o->output[k] ? o->output[k] : first;
    if (!first)
        return cli_error("-o, --bent, --horizons or --sh: one of them is required, see --help");
    for (int k = OUT_HORIZONS; k <= OUT_SH; ++k) {
        raster_format format = o->output[k] ? raster_format_of(o->output[k]) : RASTER_UNKNOWN;
        if (format == RASTER_PNG || format == RASTER_PFM)
            return cli_error("%s %s: %d channels need .exr, .tif or .raw", option_table[output_option[k]].name,
                             o->output[k], channels_of(b, k));
    }
    if (o->picture && !o->output[OUT_VISIBILITY])
        return cli_error("--picture: only with -o");
    if (o->wrap && o->given[OPT_BORDER] && o->border != GTAO_BORDER_WRAP)
        return cli_error("--wrap: cannot be combined with --border %s", borders[o->border]);
    if (o->given[OPT_NORMAL_GREEN] && !o->source.normals)
        return cli_error("--normal-green: only with --normal");
    for (int id = OPT_BENT_SPACE; id <= OPT_WORLD_AXES; ++id)
        if (o->given[id] && !o->output[OUT_BENT] && !o->output[OUT_SH])
            return cli_error("%s: only with --bent or --sh", option_table[id].name);
    if (o->given[OPT_GREEN] && o->bent_world)
        return cli_error("--green: only with --bent-space tangent");
    if (o->given[OPT_WORLD_AXES] && !o->bent_world)
        return cli_error("--world-axes: only with --bent-space world");
    if (snprintf(b->work, sizeof b->work, "%s%s", o->work ? o->work : first, o->work ? "" : ".work") >=
        (int)sizeof b->work - 64)
        return cli_error("--work %s: name too long", o->work ? o->work : first);
    o->border = o->wrap ? GTAO_BORDER_WRAP : o->border;
    o->source.raw_width = o->raw_size[0];
    o->source.raw_height = o->raw_size[1];
    return 1;
}

baking *baking_parse(const char *name, int quiet, int argc, char **argv, int *status) {
    baking *b = calloc(1, sizeof *b);
    *status = 2;
    if (!b) {
        fprintf(stderr, "%s: not enough memory\n", name);
        return NULL;
    }
    const cli_program program = {name,
                                 "ambient visibility, bent normals and horizons of a height map of any size",
                                 "--height FILE --pixel-size S [options] -o FILE",
                                 "A run that was killed goes on where it stopped when the same command is given again.",
                                 option_table,
                                 OPT_COUNT,
                                 quiet};
    b->lock = -1;
    b->limited = strcmp(name, "bake-mpi") == 0;
    b->o.source.height_scale = 1.0;
    b->o.source.overlap = 256;
    b->o.radius = HUGE_VALF;
    b->o.directions = 32;
    b->o.memory = 1024.0 * MIB;
    b->o.threads = b->limited ? 1 : cli_processors();
    cli_axes_of("+x+y+z", &b->o.world);
    int parsed = cli_parse(&program, argc, argv, &b->o, b->o.given);
    if (parsed == CLI_GO && check_options(b))
        return b;
    *status = parsed == CLI_GO ? 2 : parsed;
    free(b);
    return NULL;
}

void baking_free(baking *b) {
    if (!b)
        return;
    if (b->has_map)
        terrain_close(&b->map);
    dump_discard(b->dump);
    pool_destroy(b->workers);
    if (b->lock >= 0)
        close(b->lock);
    free(b);
}

/* ---- the size of the tiles --------------------------------------------------------------------------------------- */

typedef struct box {
    int x, y, width, height;
} box;

/* What is computed for a core: at an open border the map ends, beyond others something goes on. */
static box window_of(const baking *b, box core) {
    int m = b->map.overlap, beyond = b->o.border == GTAO_BORDER_OPEN ? 0 : m;
    if (core.width == b->map.width && core.height == b->map.height)
        return core; /* the library knows borders itself */
    int x0 = core.x - m, y0 = core.y - m, x1 = core.x + core.width + m, y1 = core.y + core.height + m;
    x0 = x0 < -beyond ? -beyond : x0;
    y0 = y0 < -beyond ? -beyond : y0;
    x1 = x1 > b->map.width + beyond ? b->map.width + beyond : x1;
    y1 = y1 > b->map.height + beyond ? b->map.height + beyond : y1;
    box w = {x0, y0, x1 - x0, y1 - y0};
    return w;
}

static void describe(baking *b, box window, int whole, gtao_desc *desc) {
    memset(desc, 0, sizeof *desc);
    desc->width = window.width;
    desc->height = window.height;
    desc->depth = (const float *)b; /* not null; set before it is read */
    desc->depth_kind = GTAO_DEPTH_HEIGHT;
    desc->camera.projection = GTAO_ORTHOGRAPHIC;
    desc->camera.sx = (float)b->o.pixel[0];
    desc->camera.sy = (float)b->o.pixel[1];
    desc->border = whole ? (gtao_border)b->o.border : GTAO_BORDER_OPEN;
    desc->radius = b->o.radius;
    desc->falloff = b->o.falloff;
    desc->slices = b->o.directions;
    desc->isa = (gtao_isa)b->o.isa;
}

/* What is asked of the library. The buffers' contents do not matter when sizes are asked for. */
static void describe_outputs(box window, box core, float *const planes[OUT_COUNT], gtao_output *output,
                             gtao_sweep_options *options) {
    memset(output, 0, sizeof *output);
    memset(options, 0, sizeof *options);
    output->visibility = planes[OUT_VISIBILITY];
    output->bent_normals = planes[OUT_BENT];
    output->sh = planes[OUT_SH];
    options->horizons = planes[OUT_HORIZONS];
    options->region[0] = core.x - window.x;
    options->region[1] = core.y - window.y;
    options->region[2] = core.x - window.x + core.width;
    options->region[3] = core.y - window.y + core.height;
}

static int is_whole(const baking *b, box core) {
    return core.width == b->map.width && core.height == b->map.height;
}

/* Bytes while a tile is in work, 0 if the library refuses the description. Memory of 16 threads, however many there
 * are, so that the tiles do not depend on them. */
static double tile_bytes(baking *b, int width, int height) {
    float something, *planes[OUT_COUNT];
    box core = {0, 0, width, height}, window = window_of(b, core);
    gtao_desc desc;
    gtao_output output;
    gtao_sweep_options options;
    if (!is_whole(b, core)) { /* in the middle of the map */
        core.x = core.y = b->map.overlap;
        window.x = window.y = 0;
        window.width = width + 2 * b->map.overlap;
        window.height = height + 2 * b->map.overlap;
    }
    for (int k = 0; k < OUT_COUNT; ++k)
        planes[k] = b->o.output[k] || k == OUT_VISIBILITY || b->o.dump ? &something : NULL;
    describe(b, window, is_whole(b, core), &desc);
    describe_outputs(window, core, planes, &output, &options);
    double scratch = (double)gtao_sweep_scratch_size(&desc, &output, &options);
    double pixels = (double)window.width * window.height, floats = 1.0 + (b->map.has_normals ? 3.0 : 0.0);
    if (!(scratch > 0.0))
        return 0.0;
    for (int k = 0; k < OUT_COUNT; ++k)
        floats += planes[k] ? (double)channels_of(b, k) : 0.0;
    return scratch + 16.0 * (double)gtao_sweep_work_size(&desc, &options) + 4.0 * floats * pixels +
           (is_whole(b, core) ? 0.0 : (double)terrain_view_bytes(&b->map, window.width, window.height));
}

static void set_tiles(baking *b, int side) {
    b->columns = (b->map.width + side - 1) / side;
    b->rows = (b->map.height + side - 1) / side;
    /* of about one size, but no larger */
    b->tile_width = (b->map.width + b->columns - 1) / b->columns;
    b->tile_height = (b->map.height + b->rows - 1) / b->rows;
}

static int choose_tiles(baking *b) {
    const double fixed = 48.0 * MIB; /* the program, its libraries, buffers of files */
    double budget = b->o.memory - fixed;
    if (!(tile_bytes(b, 256, 256) > 0.0)) {
        gtao_desc desc;
        box probe = {0, 0, 256, 256};
        describe(b, probe, 0, &desc);
        gtao_result why = gtao_sweep_compute(&desc, NULL, NULL, NULL, 0, NULL, NULL);
        return cli_error("%s: %s", b->o.source.heights, gtao_result_string(why));
    }
    if (b->o.given[OPT_TILE]) {
        set_tiles(b, b->o.tile);
        double bytes = tile_bytes(b, b->tile_width, b->tile_height);
        if (b->o.given[OPT_MEMORY] && bytes > budget)
            return cli_error("--tile %d: needs %.0f MiB, more than --memory", b->o.tile, (bytes + fixed) / MIB);
        return 1;
    }
    double whole = tile_bytes(b, b->map.width, b->map.height);
    if (!b->limited && whole > 0.0 && whole <= budget && b->map.width <= 32768 && b->map.height <= 32768) {
        set_tiles(b, b->map.width > b->map.height ? b->map.width : b->map.height);
        return 1;
    }
    for (int side = b->limited ? 1024 : 16384; side >= 256; side -= side > 2048 ? 256 : 64) {
        double bytes = tile_bytes(b, side, side);
        if (bytes > 0.0 && bytes <= budget) {
            set_tiles(b, side);
            return 1;
        }
    }
    return cli_error("--memory: %.0f MiB are needed at least", ceil((tile_bytes(b, 256, 256) + fixed) / MIB));
}

static box core_of(const baking *b, int tile) {
    box c = {tile % b->columns * b->tile_width, tile / b->columns * b->tile_height, b->tile_width, b->tile_height};
    c.width = c.x + c.width > b->map.width ? b->map.width - c.x : c.width;
    c.height = c.y + c.height > b->map.height ? b->map.height - c.y : c.height;
    return c;
}

/* ---- the work directory ------------------------------------------------------------------------------------------ */

static void work_path(const baking *b, const char *name, char *path, size_t size) {
    snprintf(path, size, "%s/%s", b->work, name); /* check_options left room */
}

/* Only what this program makes; the directory stays if something else is in it. */
static void remove_work(const baking *b) {
    char path[4096 + 256];
    DIR *directory = opendir(b->work);
    for (struct dirent *entry; directory && (entry = readdir(directory)) != NULL;) {
        const char *n = entry->d_name;
        if (strcmp(n, "heights") == 0 || strcmp(n, "normals") == 0 || strncmp(n, "level-", 6) == 0 ||
            strncmp(n, "terrain", 7) == 0 || strncmp(n, "tile-", 5) == 0 || strncmp(n, "job", 3) == 0 ||
            strcmp(n, "lock") == 0 || strcmp(n, "pending") == 0) {
            snprintf(path, sizeof path, "%s/%s", b->work, n);
            unlink(path);
        }
    }
    if (directory)
        closedir(directory);
    rmdir(b->work);
}

/* Temporary files that a killed run was putting together. */
static void remove_pending(const baking *b) {
    char path[4096 + 64], line[4096 + 64];
    work_path(b, "pending", path, sizeof path);
    FILE *file = fopen(path, "rb");
    while (file && fgets(line, sizeof line, file)) {
        line[strcspn(line, "\n")] = 0;
        if (line[0])
            unlink(line);
    }
    if (file)
        fclose(file);
    unlink(path);
}

static void identify(const char *spec, char *text, size_t size) {
    char path[4096];
    struct stat info;
    if (spec && image_spec_path(spec, path, sizeof path) && stat(path, &info) == 0)
        snprintf(text, size, "%s %lld %lld.%09ld", spec, (long long)info.st_size, (long long)info.st_mtim.tv_sec,
                 (long)info.st_mtim.tv_nsec);
    else
        snprintf(text, size, "none");
}

/* Everything that the tiles depend on. */
static int job_text(const baking *b, char *text, size_t size) {
    const settings *o = &b->o;
    char heights[4600], normals[4600];
    identify(o->source.heights, heights, sizeof heights);
    identify(o->source.normals, normals, sizeof normals);
    return snprintf(text, size,
                    "library %d\nheights %s\nnormals %s\nraw %d %d\nintegers %d\nscale %a\nno_data %d %a\n"
                    "normal_green %d\noverlap %d\npixel %a %a\nborder %d\ndirections %d\nradius %a\nfalloff %a\n"
                    "outputs %d %d %d %d\ntile %d %d\n",
                    GTAO_VERSION, heights, normals, o->source.raw_width, o->source.raw_height, o->source.integers,
                    o->source.height_scale, o->source.has_no_data, o->source.no_data, o->source.green_down,
                    o->source.overlap, o->pixel[0], o->pixel[1], o->border, o->directions, (double)o->radius,
                    (double)o->falloff, o->output[0] != NULL, o->output[1] != NULL, o->output[2] != NULL,
                    o->output[3] != NULL, b->tile_width, b->tile_height) < (int)size;
}

/* Byte 0 of the lock's file is the process that leads a job, byte 1 is shared by those that joined it: a rank that
 * outlives its job keeps the next one from starting. */
static int lock_byte(const baking *b, short type, off_t byte) {
    struct flock lock;
    memset(&lock, 0, sizeof lock);
    lock.l_type = type;
    lock.l_whence = SEEK_SET;
    lock.l_start = byte;
    lock.l_len = 1;
    return fcntl(b->lock, F_SETLK, &lock) == 0 || (errno != EACCES && errno != EAGAIN); /* no locks: go on without */
}

static int lock_work(baking *b, int leads) {
    char path[4096 + 64];
    work_path(b, "lock", path, sizeof path);
    b->lock = open(path, O_RDWR | O_CREAT, 0666);
    if (b->lock < 0)
        return cli_error("--work %s: %s", b->work, strerror(errno));
    if (leads ? lock_byte(b, F_WRLCK, 0) && lock_byte(b, F_WRLCK, 1) : lock_byte(b, F_RDLCK, 1))
        return !leads || lock_byte(b, F_UNLCK, 1);
    return cli_error("--work %s: in use by another process", b->work);
}

/* No directory of somebody else's: empty, but for what is made first. */
static int is_untouched(const baking *b) {
    DIR *directory = opendir(b->work);
    int untouched = directory != NULL;
    for (struct dirent *entry; directory && (entry = readdir(directory)) != NULL;) {
        const char *n = entry->d_name;
        untouched = untouched && (strcmp(n, ".") == 0 || strcmp(n, "..") == 0 || strcmp(n, "lock") == 0 ||
                                  strncmp(n, "job.", 4) == 0);
    }
    if (directory)
        closedir(directory);
    return untouched;
}

/* A directory of our own, new or left by the same job. */
static int enter_work(baking *b) {
    char path[4096 + 64], text[16384], found[16384] = "";
    image_error error;
    image_pending pending;
    if (!job_text(b, text, sizeof text))
        return cli_error("%s: name too long", b->o.source.heights);
    int there = mkdir(b->work, 0777) != 0 && errno == EEXIST;
    if (!there && access(b->work, W_OK | X_OK) != 0)
        return cli_error("--work %s: %s", b->work, strerror(errno));
    work_path(b, "job", path, sizeof path);
    if (there && access(path, F_OK) != 0 && !is_untouched(b))
        return cli_error("--work %s: is there, but is not the unfinished work of this program", b->work);
    b->created_work = !there;
    if (!lock_work(b, 1))
        return 0;
    work_path(b, "job", path, sizeof path);
    FILE *file = there ? fopen(path, "rb") : NULL;
    if (file) {
        found[fread(found, 1, sizeof found - 1, file)] = 0;
        fclose(file);
        remove_pending(b);
    }
    if (there && strcmp(found, text) != 0) {
        if (found[0] && !b->o.fresh)
            return cli_error("--work %s: holds the unfinished work of other settings; --fresh discards it", b->work);
    }
    if (there && (b->o.fresh || !found[0])) {
        remove_work(b); /* the lock's file goes too */
        close(b->lock);
        mkdir(b->work, 0777);
        b->created_work = 1;
        if (!lock_work(b, 1))
            return 0;
    }
    if (b->created_work && (!image_write_text(path, text, &pending, &error) || !image_commit(&pending, &error)))
        return cli_error("--work %s", error.text);
    return 1;
}

/* ---- begin ------------------------------------------------------------------------------------------------------- */

/* Which option an input file came from. */
static const char *input_option(const baking *b, const char *message) {
    char path[4096];
    return b->o.source.normals && image_spec_path(b->o.source.normals, path, sizeof path) &&
                   strncmp(message, path, strlen(path)) == 0
               ? "--normal"
               : "--height";
}

static int settle(baking *b) {
    settings *o = &b->o;
    image_error error;
    if (!terrain_inspect(&o->source, &b->map, &error))
        return cli_error("%s %s", input_option(b, error.text), error.text);
    o->pixel[0] = (double)o->pixel_size[0];
    o->pixel[1] = (double)o->pixel_size[o->pixel_size[1] > 0.0f];
    if (!o->given[OPT_PIXEL_SIZE]) {
        if (b->map.geographic)
            return cli_error("--pixel-size: required, %s states degrees", o->source.heights);
        if (!(b->map.pixel_x > 0.0) || !(b->map.pixel_y > 0.0))
            return cli_error("--pixel-size: required, %s does not state it", o->source.heights);
        o->pixel[0] = b->map.pixel_x;
        o->pixel[1] = b->map.pixel_y;
    }
    for (int k = 0; k < OUT_COUNT; ++k) {
        raster_format format = o->output[k] ? raster_format_of(o->output[k]) : RASTER_UNKNOWN;
        if ((format == RASTER_EXR || format == RASTER_PNG) &&
            (b->map.width > IMAGE_MAX_SIZE || b->map.height > IMAGE_MAX_SIZE))
            return cli_error("%s %s: %d x %d is too large for this format", option_table[output_option[k]].name,
                             o->output[k], b->map.width, b->map.height);
    }
    if (!choose_tiles(b))
        return 0;
    if (o->dump && baking_tiles(b) > 1)
        return cli_error("--dump: of a map in one piece, this takes %d tiles; give more --memory", baking_tiles(b));
    b->dump = o->dump ? dump_create(o->dump, &error) : NULL;
    return !o->dump || b->dump || cli_error("--dump %s", error.text);
}

static void show_reading(void *user, double part) {
    baking *b = user;
    b->reading.what = "reading";
    cli_progress_show(&b->reading, part);
}

static int begin_workers(baking *b) {
    b->workers = pool_create(b->o.threads);
    return b->workers ? 1 : cli_error("--threads %d: not enough memory", b->o.threads);
}

int baking_begin(baking *b) {
    image_error error;
    b->started = cli_seconds();
    if (!settle(b) || !enter_work(b))
        return 0;
    if (!terrain_create(b->work, &b->o.source, show_reading, b, &b->map, &error)) {
        const char *option = input_option(b, error.text);
        if (strncmp(error.text, b->work, strlen(b->work)) == 0)
            option = "--work";
        cli_error("%s %s", option, error.text);
        if (b->created_work)
            remove_work(b);
        return 0;
    }
    b->has_map = 1;
    b->seconds_reading = cli_seconds() - b->started;
    return begin_workers(b);
}

int baking_join(baking *b) {
    image_error error;
    b->started = cli_seconds();
    if (!settle(b))
        return 0;
    if (!lock_work(b, 0))
        return 0;
    if (!terrain_open(b->work, &b->map, &error))
        return cli_error("--work %s", error.text);
    b->has_map = 1;
    return begin_workers(b);
}

int baking_tiles(const baking *b) {
    return b->columns * b->rows;
}

/* ---- a tile ------------------------------------------------------------------------------------------------------ */

typedef struct tile_header {
    uint64_t magic, tile, width, height, floats;
} tile_header;

#define TILE_MAGIC 0x31656c69745f6f61u

static uint64_t checksum(uint64_t sum, const void *data, size_t bytes) { /* FNV-1a over words of 4 bytes */
    const char *p = data;
    for (; bytes >= 4; bytes -= 4, p += 4) {
        uint32_t v;
        memcpy(&v, p, 4);
        sum = (sum ^ v) * 1099511628211u;
    }
    return sum;
}

static int tile_floats(const baking *b) {
    int floats = 0;
    for (int k = 0; k < OUT_COUNT; ++k)
        floats += b->o.output[k] ? channels_of(b, k) : 0;
    return floats;
}

static tile_header header_of(const baking *b, int tile) {
    box core = core_of(b, tile);
    tile_header h = {TILE_MAGIC, (uint64_t)tile, (uint64_t)core.width, (uint64_t)core.height, 0};
    h.floats = h.width * h.height * (uint64_t)tile_floats(b);
    return h;
}

static void tile_path(const baking *b, int tile, char *path, size_t size) {
    snprintf(path, size, "%s/tile-%06d", b->work, tile);
}

int baking_tile_done(baking *b, int tile) {
    char path[4096 + 64];
    float buffer[4096];
    tile_path(b, tile, path, sizeof path);
    FILE *file = b->dump ? NULL : fopen(path, "rb"); /* a dump needs the tile's horizons, too */
    if (!file)
        return 0;
    tile_header header, expected = header_of(b, tile);
    uint64_t sum = checksum(14695981039346656037u, &expected, sizeof expected), stored = 0;
    int ok = fread(&header, sizeof header, 1, file) == 1 && memcmp(&header, &expected, sizeof header) == 0;
    for (uint64_t left = expected.floats; ok && left > 0;) {
        size_t n = left < 4096 ? (size_t)left : 4096;
        ok = fread(buffer, 4, n, file) == n;
        sum = checksum(sum, buffer, 4 * n);
        left -= n;
    }
    ok = ok && fread(&stored, sizeof stored, 1, file) == 1 && stored == sum && getc(file) == EOF;
    fclose(file);
    b->tiles_found += ok;
    return ok;
}

/* Sines of elevation, by azimuth, from the library's planes of angles: + and - side of a slice in turn. */
static void horizon_row(const baking *b, const float *planes, size_t plane, int width, float *row) {
    int slices = b->o.directions;
    for (int x = 0; x < width; ++x)
        for (int i = 0; i < 2 * slices; ++i) {
            float sine;
            gtao_sincos(planes[(size_t)(i < slices ? 2 * i : 2 * (i - slices) + 1) * plane + (size_t)x], &sine, row++);
        }
}

/* From planes of coefficients. */
static void sh_row(const float *planes, size_t plane, int width, float *row) {
    for (int x = 0; x < width; ++x)
        for (size_t i = 0; i < 9; ++i)
            *row++ = planes[i * plane + (size_t)x];
}

/* Under its own name only when it is complete and on the disk. */
static int write_tile(baking *b, int tile, box window, float *const planes[OUT_COUNT]) {
    char path[4096 + 64];
    image_error error;
    image_pending pending;
    box core = core_of(b, tile);
    tile_header header = header_of(b, tile);
    uint64_t sum = checksum(14695981039346656037u, &header, sizeof header);
    tile_path(b, tile, path, sizeof path);
    FILE *file = image_open_pending(path, &pending, &error);
    if (!file)
        return cli_error("--work %s", error.text);
    int widest = 2 * b->o.directions > 9 ? 2 * b->o.directions : 9;
    float *line = malloc((size_t)core.width * (size_t)widest * sizeof *line);
    int ok = line && fwrite(&header, sizeof header, 1, file) == 1;
    for (int k = 0; k < OUT_COUNT; ++k) {
        size_t channels = (size_t)channels_of(b, k), floats = (size_t)core.width * channels;
        size_t plane = (size_t)window.width * (size_t)window.height;
        for (int y = 0; b->o.output[k] && ok && y < core.height; ++y) {
            size_t pixel = (size_t)(y + core.y - window.y) * (size_t)window.width + (size_t)(core.x - window.x);
            const float *row = line;
            if (k == OUT_HORIZONS)
                horizon_row(b, planes[k] + pixel, plane, core.width, line);
            else if (k == OUT_SH)
                sh_row(planes[k] + pixel, plane, core.width, line);
            else
                row = planes[k] + pixel * channels;
            sum = checksum(sum, row, floats * 4);
            ok = fwrite(row, 4, floats, file) == floats;
        }
    }
    free(line);
    ok = ok && fwrite(&sum, sizeof sum, 1, file) == 1 && fflush(file) == 0 && fsync(fileno(file)) == 0;
    if (!image_close_pending(file, ok, path, &pending, &error) || !image_commit(&pending, &error))
        return cli_error("--work %s", error.text);
    return 1;
}

static void run_units(void *user, int thread, int begin, int end) {
    baking *b = user;
    gtao_sweep_run(b->sweep, b->phase, begin, end, b->work_memory + (size_t)thread * b->work_bytes);
}

static void show_units(void *user, int done, int units) {
    baking *b = user;
    baking_progress(b, b->progress_done, b->progress_count,
                    (b->phase + (double)done / units) / gtao_sweep_phases(b->sweep));
}

static int out_of_memory(void) {
    return cli_error("--memory: not enough memory for a tile, give less");
}

static int look_beyond(void *user, double x, double y, double dx, double dy, int capacity, float *distance_px,
                       float *depth) {
    return terrain_far_line(user, x, y, dx, dy, capacity, distance_px, depth);
}

static int compute_window(baking *b, box window, box core, const float *heights, const float *normals,
                          float *const planes[OUT_COUNT]) {
    image_error error;
    gtao_desc desc;
    gtao_output output;
    gtao_sweep_options options;
    terrain_view view;
    memset(&view, 0, sizeof view);
    describe(b, window, is_whole(b, core), &desc);
    desc.depth = heights;
    desc.normals = normals;
    describe_outputs(window, core, planes, &output, &options);
    double pixel = b->o.pixel[0] < b->o.pixel[1] ? b->o.pixel[0] : b->o.pixel[1];
    double reach = (double)b->o.radius / pixel - b->map.overlap; /* beyond the window */
    if (!is_whole(b, core) && reach > 0.0) {
        if (!terrain_view_create(&b->map, (terrain_border)b->o.border, window.x, window.y, window.width, window.height,
                                 reach, &view, &error))
            return cli_error("--work %s: %s", b->work, error.text);
        options.beyond = look_beyond;
        options.beyond_user = &view;
        options.beyond_reach = (int)view.reach_px + 1;
    }
    size_t size = gtao_sweep_scratch_size(&desc, &output, &options);
    void *scratch = malloc(size ? size : 1);
    b->work_bytes = (gtao_sweep_work_size(&desc, &options) + 63) / 64 * 64;
    b->work_memory = malloc(b->work_bytes * (size_t)pool_threads(b->workers));
    int ok = scratch && b->work_memory ? 1 : out_of_memory();
    gtao_result result = ok ? gtao_sweep_begin(&desc, &output, &options, scratch, size, &b->sweep) : GTAO_OK;
    if (result != GTAO_OK)
        ok = cli_error("%s: %s", b->o.source.heights, gtao_result_string(result));
    for (b->phase = 0; ok && b->phase < gtao_sweep_phases(b->sweep); ++b->phase)
        pool_run(b->workers, gtao_sweep_units(b->sweep, b->phase), 0, run_units, show_units, b);
    if (ok && b->dump) {
        dump *d = b->dump;
        b->dump = NULL;
        ok = dump_sweep(d, &desc, b->sweep, planes[OUT_VISIBILITY], planes[OUT_BENT], planes[OUT_HORIZONS], &error);
        if (ok)
            ok = dump_commit(d, &error);
        else
            dump_discard(d);
        ok = ok || cli_error("--dump %s", error.text);
    }
    free(scratch);
    free(b->work_memory);
    terrain_view_free(&view);
    return ok;
}

int baking_tile(baking *b, int tile) {
    image_error error;
    box core = core_of(b, tile), window = window_of(b, core);
    size_t pixels = (size_t)window.width * (size_t)window.height;
    float *heights = malloc(pixels * sizeof(float)), *planes[OUT_COUNT] = {NULL};
    float *normals = b->map.has_normals ? malloc(3 * pixels * sizeof(float)) : NULL;
    terrain_border border = (terrain_border)b->o.border;
    int ok = heights && (normals || !b->map.has_normals);
    for (int k = 0; k < OUT_COUNT; ++k)
        if (b->o.output[k] || k == OUT_VISIBILITY || b->dump) {
            planes[k] = malloc(pixels * (size_t)channels_of(b, k) * sizeof(float));
            ok = ok && planes[k];
        }
    double t0 = cli_seconds();
    if (!ok)
        out_of_memory();
    else if (!terrain_heights(&b->map, border, window.x, window.y, window.width, window.height, heights, &error) ||
             (normals &&
              !terrain_normals(&b->map, border, window.x, window.y, window.width, window.height, normals, &error)))
        ok = cli_error("--work %s", error.text);
    double t1 = cli_seconds();
    ok = ok && compute_window(b, window, core, heights, normals, planes);
    double t2 = cli_seconds();
    ok = ok && write_tile(b, tile, window, planes);
    b->seconds_reading += t1 - t0;
    b->seconds_computing += t2 - t1;
    b->seconds_writing += cli_seconds() - t2;
    b->pixels_computed += (long long)core.width * core.height;
    ++b->tiles_computed;
    for (int k = 0; k < OUT_COUNT; ++k)
        free(planes[k]);
    free(heights);
    free(normals);
    return ok;
}

void baking_progress(baking *b, int done, int count, double part) {
    b->progress_done = done;
    b->progress_count = count;
    snprintf(b->tiles_what, sizeof b->tiles_what, "tile %d of %d", done < count ? done + 1 : count, count);
    b->tiles.what = b->tiles_what;
    cli_progress_show(&b->tiles, count > 0 ? (done + part) / count : 1.0);
}

/* ---- the outputs ------------------------------------------------------------------------------------------------- */

/* From the library's axes, x right, y down, z into the map. */
static void turn_bent(const baking *b, float *n, size_t pixels) {
    const settings *o = &b->o;
    for (size_t i = 0; i < pixels; ++i, n += 3) {
        const float local[3] = {n[0], -n[1], -n[2]}; /* right, up, out */
        if (!o->bent_world) {
            n[1] = o->green_down ? n[1] : local[1];
            n[2] = local[2];
            continue;
        }
        for (int k = 0; k < 3; ++k)
            n[o->world.axis[k]] = o->world.sign[k] * local[k];
    }
}

/* The same of functions of the direction. */
static void turn_sh(const baking *b, float *sh, size_t pixels) {
    float columns[3][3] = {{1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}, {0.0f, 0.0f, 1.0f}}, r[9], turned[9];
    turn_bent(b, columns[0], 3); /* where the axes go */
    for (int i = 0; i < 9; ++i)
        r[i] = columns[i % 3][i / 3];
    for (size_t i = 0; i < pixels; ++i, sh += 9) {
        gtao_sh_rotate(r, sh, turned);
        memcpy(sh, turned, sizeof turned);
    }
}

/* `count` rows from row `y` of a row of tiles, of one output. */
static int gather_rows(const baking *b, int tile_row, int y, int count, int output, float *band) {
    size_t channels = (size_t)channels_of(b, output), row = (size_t)b->map.width * channels;
    for (int column = 0; column < b->columns; ++column) {
        char path[4096 + 64];
        int tile = tile_row * b->columns + column;
        box core = core_of(b, tile);
        long long before = 0;
        for (int k = 0; k < output; ++k)
            before += b->o.output[k] ? channels_of(b, k) : 0;
        tile_path(b, tile, path, sizeof path);
        FILE *file = fopen(path, "rb");
        int ok = file != NULL;
        long long at = (long long)sizeof(tile_header) + 4ll * ((long long)core.width * core.height * before +
                                                               (long long)y * core.width * (long long)channels);
        ok = ok && fseeko(file, (off_t)at, SEEK_SET) == 0;
        for (int k = 0; ok && k < count; ++k)
            ok = fread(band + (size_t)k * row + (size_t)core.x * channels, 4, (size_t)core.width * channels, file) ==
                 (size_t)core.width * channels;
        if (file)
            fclose(file);
        if (!ok)
            return cli_error("--work %s: cannot read", path);
    }
    return 1;
}

static int write_rows(const baking *b, raster_writer *const writers[OUT_COUNT]) {
    image_error error;
    size_t widest = 0;
    for (int k = 0; k < OUT_COUNT; ++k)
        if (b->o.output[k] && (size_t)channels_of(b, k) > widest)
            widest = (size_t)channels_of(b, k);
    size_t row = (size_t)b->map.width * widest;
    int band_rows = (int)(2097152 / row), ok = 1;
    band_rows = band_rows < 1 ? 1 : band_rows;
    float *band = malloc(row * (size_t)band_rows * sizeof *band);
    if (!band)
        return cli_error("--memory: not enough memory");
    for (int tile_row = 0; ok && tile_row < b->rows; ++tile_row) {
        int height = core_of(b, tile_row * b->columns).height;
        for (int y = 0; ok && y < height; y += band_rows) {
            int count = height - y < band_rows ? height - y : band_rows;
            for (int k = 0; ok && k < OUT_COUNT; ++k) {
                if (!writers[k])
                    continue;
                ok = gather_rows(b, tile_row, y, count, k, band);
                if (ok && k == OUT_BENT)
                    turn_bent(b, band, (size_t)count * (size_t)b->map.width);
                if (ok && k == OUT_SH)
                    turn_sh(b, band, (size_t)count * (size_t)b->map.width);
                if (ok && !raster_write(writers[k], count, band, &error))
                    ok = cli_error("%s %s", option_table[output_option[k]].name, error.text);
            }
        }
    }
    free(band);
    return ok;
}

/* ---- the picture ------------------------------------------------------------------------------------------------- */

enum { PICTURE_SIDE = 400, PICTURE_MARGIN = 12, PICTURE_TITLE = 30 };

/* `factor` x `factor` pixels to one, of the heights (output < 0) or an output. */
static int shrink(const baking *b, int output, int factor, image *small) {
    image_error error;
    int channels = output < 0 ? 1 : channels_of(b, output), ok = 1;
    if (!image_create(small, (b->map.width + factor - 1) / factor, (b->map.height + factor - 1) / factor, channels,
                      &error))
        return cli_error("--picture %s", error.text);
    size_t row = (size_t)b->map.width * (size_t)channels, wide = (size_t)small->width * (size_t)channels;
    float *line = malloc(row * sizeof *line);
    float *weight = calloc((size_t)small->width * (size_t)small->height, sizeof *weight);
    ok = line && weight ? 1 : cli_error("--picture: not enough memory");
    for (int y = 0; ok && y < b->map.height; ++y) {
        int tile_row = y / b->tile_height;
        if (output < 0)
            ok = terrain_heights(&b->map, TERRAIN_OPEN, 0, y, b->map.width, 1, line, &error);
        else
            ok = gather_rows(b, tile_row, y - tile_row * b->tile_height, 1, output, line);
        for (int x = 0; ok && x < b->map.width; ++x) {
            size_t to = (size_t)(x / factor), cell = (size_t)(y / factor) * (size_t)small->width + to;
            const float *from = line + (size_t)x * (size_t)channels;
            float *sum = small->data + (size_t)(y / factor) * wide + to * (size_t)channels;
            if (isnan(from[0]))
                continue;
            weight[cell] += 1.0f;
            for (int c = 0; c < channels; ++c)
                sum[c] += (from[c] - sum[c]) / weight[cell];
        }
    }
    for (size_t i = 0; ok && output < 0 && i < (size_t)small->width * (size_t)small->height; ++i)
        if (!(weight[i] > 0.0f))
            small->data[i] = NAN;
    free(line);
    free(weight);
    return ok;
}

static float clamp_index(const image *img, int x, int y) {
    x = x < 0 ? 0 : x >= img->width ? img->width - 1 : x;
    y = y < 0 ? 0 : y >= img->height ? img->height - 1 : y;
    return img->data[(size_t)y * (size_t)img->width + (size_t)x];
}

/* Light of a low sun in the north-west by the surface's slope, 0..1; cells that miss a neighbour are level. */
static float sun_on(const baking *b, const image *h, int factor, int x, int y) {
    float gx = (clamp_index(h, x + 1, y) - clamp_index(h, x - 1, y)) / (2.0f * (float)factor * (float)b->o.pixel[0]);
    float gy = (clamp_index(h, x, y + 1) - clamp_index(h, x, y - 1)) / (2.0f * (float)factor * (float)b->o.pixel[1]);
    if (isnan(gx) || isnan(gy))
        gx = gy = 0.0f;
    float light = (0.5f * gx + 0.5f * gy + 0.7f) / sqrtf(1.0f + gx * gx + gy * gy);
    return light > 0.0f ? light : 0.0f;
}

/* The land's colours by height, from green to white. */
static color land(float t) {
    static const unsigned stops[] = {0x4f7d5a, 0x8fa76b, 0xcfc08a, 0xb08a66, 0xf2efe9};
    t = t > 0.0f ? t < 1.0f ? t : 1.0f : 0.0f;
    int i = (int)(4.0f * t);
    i = i > 3 ? 3 : i;
    return color_mix(color_hex(stops[i]), color_hex(stops[i + 1]), 4.0f * t - (float)i);
}

static void paint(const baking *b, const image small[3], int factor, int kind, image *panel) {
    const image *h = small;
    float low = (float)b->map.lowest, range = (float)(b->map.highest - b->map.lowest);
    for (int y = 0; y < h->height; ++y)
        for (int x = 0; x < h->width; ++x) {
            size_t i = (size_t)y * (size_t)h->width + (size_t)x;
            float v = small[1].data[i], *to = panel->data + 3 * i;
            color c = land(range > 0.0f ? (h->data[i] - low) / range : 0.5f);
            float sun = sun_on(b, h, factor, x, y);
            if (isnan(h->data[i]))
                c = color_hex(0x808080); /* a hole */
            if (kind == 0) {
                c = color_mix(color_hex(0x000000), c, sun < 0.7f ? 0.3f + sun : 1.0f);
            } else if (kind == 1) {
                c.r = c.g = c.b = v;
            } else if (kind == 2) {
                const float *n = small[2].data + 3 * i;
                float length = sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
                length = length > 0.0f ? length : 1.0f; /* from the library's axes to right, up, out */
                c.r = 0.5f + 0.5f * n[0] / length;
                c.g = 0.5f - 0.5f * n[1] / length;
                c.b = 0.5f - 0.5f * n[2] / length;
            } else {
                float sky = 0.9f * v * v, direct = sun > 0.3f ? 1.1f * (sun - 0.3f) : 0.0f; /* v^2: some contrast */
                color light = {(sky * 0.80f + direct) * c.r * c.r, (sky * 0.95f + direct * 0.92f) * c.g * c.g,
                               (sky * 1.15f + direct * 0.75f) * c.b * c.b};
                c = color_encode(light);
            }
            to[0] = c.r < 1.0f ? c.r : 1.0f;
            to[1] = c.g < 1.0f ? c.g : 1.0f;
            to[2] = c.b < 1.0f ? c.b : 1.0f;
        }
}

static int write_picture(const baking *b, image_pending *pending) {
    static const char *const titles[] = {"heights", "visibility", "bent normals", "lit by sun and sky"};
    int side = b->map.width > b->map.height ? b->map.width : b->map.height;
    int factor = (side + PICTURE_SIDE - 1) / PICTURE_SIDE, panels = b->o.output[OUT_BENT] ? 4 : 3;
    image small[3], panel, canvas;
    image_error error;
    memset(small, 0, sizeof small);
    memset(&panel, 0, sizeof panel);
    memset(&canvas, 0, sizeof canvas);
    int ok = shrink(b, -1, factor, small) && shrink(b, OUT_VISIBILITY, factor, small + 1) &&
             (!b->o.output[OUT_BENT] || shrink(b, OUT_BENT, factor, small + 2));
    int w = small[0].width, h = small[0].height;
    if (ok && (!image_create(&panel, w, h, 3, &error) ||
               !image_create(&canvas, panels * (w + PICTURE_MARGIN) + PICTURE_MARGIN,
                             h + PICTURE_TITLE + PICTURE_MARGIN, 3, &error)))
        ok = cli_error("--picture %s: %s", b->o.picture, error.text);
    if (ok) {
        canvas_load_fonts();
        canvas_fill(&canvas, 0, 0, canvas.width, canvas.height, color_hex(0xffffff));
        for (int i = 0, x = PICTURE_MARGIN; i < 4; ++i) {
            if (i == 2 && panels == 3)
                continue;
            paint(b, small, factor, i, &panel);
            canvas_draw(&canvas, x, PICTURE_TITLE, &panel);
            canvas_text(&canvas, (float)x, PICTURE_TITLE - 9.0f, CANVAS_LEFT, CANVAS_REGULAR, 15.0f,
                        color_hex(0x202020), titles[i]);
            x += w + PICTURE_MARGIN;
        }
        canvas_free_fonts();
        ok = image_write(b->o.picture, &canvas, NULL, IMAGE_RANGE_UNIT, pending, &error);
        if (!ok)
            cli_error("--picture %s", error.text);
    }
    for (int i = 0; i < 3; ++i)
        image_free(small + i);
    image_free(&panel);
    image_free(&canvas);
    return ok;
}

/* ---- the end ----------------------------------------------------------------------------------------------------- */

static int note_pending(const baking *b, const image_pending *pending, int count) {
    char path[4096 + 64];
    work_path(b, "pending", path, sizeof path);
    FILE *file = fopen(path, "wb");
    int ok = file != NULL;
    for (int i = 0; ok && i < count; ++i)
        ok = !pending[i].temporary || fprintf(file, "%s\n", pending[i].temporary) > 0;
    if (file)
        ok = fclose(file) == 0 && ok;
    return ok ? 1 : cli_error("--work %s: cannot write", path);
}

static void stats_text(const baking *b, double seconds, char *text, size_t size) {
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    int whole = b->columns * b->rows == 1;
    double slope =
        whole ? 0.0 : terrain_slope_error(&b->map) / (b->o.pixel[0] < b->o.pixel[1] ? b->o.pixel[0] : b->o.pixel[1]);
    snprintf(text, size,
             "{\n  \"width\": %d,\n  \"height\": %d,\n  \"directions\": %d,\n  \"threads\": %d,\n  \"tiles\": %d,\n"
             "  \"tile_width\": %d,\n  \"tile_height\": %d,\n  \"overlap\": %d,\n  \"holes\": %lld,\n"
             "  \"far_slope_error_bound\": %.6f,\n  \"seconds\": %.3f,\n  \"seconds_reading\": %.3f,\n"
             "  \"seconds_computing\": %.3f,\n  \"seconds_writing\": %.3f,\n  \"tiles_found\": %d,\n  "
             "\"tiles_computed\": %d,\n  \"pixels_computed\": %lld,\n"
             "  \"cpu_seconds\": %.3f,\n  \"peak_memory_mib\": %.1f\n}\n",
             b->map.width, b->map.height, b->o.directions, pool_threads(b->workers), baking_tiles(b), b->tile_width,
             b->tile_height, whole ? 0 : b->map.overlap, b->map.holes, slope, seconds, b->seconds_reading,
             b->seconds_computing, b->seconds_writing, b->tiles_found, b->tiles_computed, b->pixels_computed,
             (double)(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
                 1e-6 * (double)(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec),
             (double)usage.ru_maxrss / 1024.0);
}

int baking_finish(baking *b) {
    static const char *const names_y[] = {"Y"}, *const names_bent[] = {"bent.X", "bent.Y", "bent.Z"};
    static const char *const names_sh[] = {"sh.0", "sh.1", "sh.2", "sh.3", "sh.4", "sh.5", "sh.6", "sh.7", "sh.8"};
    char horizon_names[2 * 64][16], text[2048];
    const char *names_horizon[2 * 64];
    raster_writer *writers[OUT_COUNT] = {NULL};
    image_pending pending[OUT_COUNT + 2]; /* the picture, the statistics */
    image_error error;
    int ok = 1;
    memset(pending, 0, sizeof pending);
    double t0 = cli_seconds();
    for (int i = 0; i < 2 * b->o.directions; ++i) {
        snprintf(horizon_names[i], sizeof horizon_names[i], "h%03d", i);
        names_horizon[i] = horizon_names[i];
    }
    for (int k = 0; ok && k < OUT_COUNT; ++k) {
        if (!b->o.output[k])
            continue;
        writers[k] = raster_writer_create(b->o.output[k], b->map.width, b->map.height, channels_of(b, k),
                                          k == OUT_BENT       ? names_bent
                                          : k == OUT_HORIZONS ? names_horizon
                                          : k == OUT_SH       ? names_sh
                                                              : names_y,
                                          k == OUT_BENT ? IMAGE_RANGE_SIGNED : IMAGE_RANGE_UNIT, b->o.sixteen ? 16 : 8,
                                          pending + k, &error);
        if (!writers[k] || !raster_place(writers[k], b->o.source.heights, &error))
            ok = cli_error("%s %s", option_table[output_option[k]].name, error.text);
    }
    ok = ok && note_pending(b, pending, OUT_COUNT) && write_rows(b, writers);
    for (int k = 0; k < OUT_COUNT; ++k) {
        if (!writers[k])
            continue;
        if (!ok)
            raster_abandon(writers[k]);
        else if (!raster_finish(writers[k], &error))
            ok = cli_error("%s %s", option_table[output_option[k]].name, error.text);
    }
    if (ok && b->o.picture)
        ok = write_picture(b, pending + OUT_COUNT);
    b->seconds_writing += cli_seconds() - t0;
    if (ok && b->o.stats) {
        stats_text(b, cli_seconds() - b->started, text, sizeof text);
        if (!image_write_text(b->o.stats, text, pending + OUT_COUNT + 1, &error))
            ok = cli_error("--stats %s", error.text);
    }
    for (int k = 0; ok && k < OUT_COUNT + 2; ++k)
        if (pending[k].temporary && !image_commit(pending + k, &error))
            ok = cli_error("%s", error.text);
    for (int k = 0; k < OUT_COUNT + 2; ++k)
        image_discard(pending + k);
    if (ok)
        remove_work(b);
    cli_progress_end();
    return ok;
}
