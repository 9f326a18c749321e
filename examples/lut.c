/* lut - bakes gtso.h's tables of specular visibility into volume textures, and measures them. `lut --help` lists the
 * options.
 *
 * Everything is checked first, computed second, and written last: a run that ends with an error leaves no output
 * behind. */
#include "gtso.h"

#include "canvas.h"
#include "cli.h"
#include "image.h"
#include "pool.h"
#include "volume.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define PI 3.14159265358979323846

/* ---- options ------------------------------------------------------------------------------------------------------ */

enum { KIND_ENV = GTSO_KIND_BENT + 1 }; /* the tool's own: the environment BRDF */

typedef struct options {
    gtso_table_desc table;
    int kind, lobe, frame, fit, caps, format, threads, stats, points;
    int sizes, scales; /* how many were given */
    const char *output, *slices;
    unsigned given; /* bit per option id */
} options;

enum {
    OPT_KIND,
    OPT_LOBE,
    OPT_FRAME,
    OPT_FIT,
    OPT_CAPS,
    OPT_F0,
    OPT_SIZE,
    OPT_SCALE,
    OPT_FORMAT,
    OPT_OUTPUT,
    OPT_SLICES,
    OPT_STATS,
    OPT_POINTS,
    OPT_THREADS,
    OPT_HELP,
    OPT_COUNT
};

typedef struct option_info {
    const char *name, *value, *help; /* value null: a flag */
} option_info;

static const option_info option_table[OPT_COUNT] = {
    {"--kind", "lobe|cone|brdf|bent|env", "3 axes: cone against lobe (lobe) or cone; 4: full BRDF; 5: any bent normal"},
    {"--lobe", "brdf|ggx|beckmann|blinn|phong", "of --kind lobe (brdf)"},
    {"--frame", "bent|reflection", "of --kind lobe: where n is, the bent normal (default) or the reflection"},
    {"--fit", "jimenez|drobot|uludag", "of --kind cone: the lobe's aperture (jimenez)"},
    {"--caps", "exact|oat|smoothstep", "of --kind cone: intersection of the cones (exact)"},
    {"--f0", "F", "of --kind brdf and bent: reflectance at normal incidence, 0..1 (0.04)"},
    {"--size", "N|A,B,R[,V[,Z]]", "texels: aperture, beta, roughness, view, azimuth; env: n.v, roughness"},
    {"--scale", "A,B,R[,V[,Z]]", "of each axis: default, angle, cosine, half-sine, edge, roughness, alpha"},
    {"--format", "float|unorm8|unorm16|bc4", "texels in the file (unorm8)"},
    {"-o", "FILE", ".dds, .ktx2, .h, .c or .inc; .exr or .pfm: slices from top to bottom, floats"},
    {"--slices", "FILE.png", "picture of the table"},
    {"--stats", NULL, "print the error of every size and format against direct integration"},
    {"--points", "N", "points at which --stats compares (20000)"},
    {"--threads", "N", "(all processors) the results are the same bits"},
    {"--help", NULL, ""},
};

static const char *const kinds[] = {"lobe", "cone", "brdf", "bent", "env", NULL};
static const char *const lobes[] = {"brdf", "ggx", "beckmann", "blinn", "phong", NULL};
static const char *const frames[] = {"bent", "reflection", NULL};
static const char *const fits[] = {"jimenez", "drobot", "uludag", NULL};
static const char *const caps[] = {"exact", "oat", "smoothstep", NULL};
static const char *const scales[] = {"default", "angle", "cosine", "half-sine", "edge", "roughness", "alpha", NULL};
static const char *const formats[] = {"float", "unorm8", "unorm16", "bc4", NULL};
static const char *const axes[] = {"aperture", "beta", "roughness", "view", "azimuth"};

static int error_line(const char *format, ...) {
    va_list args;
    va_start(args, format);
    fputs("lut: ", stderr);
    vfprintf(stderr, format, args);
    fputc('\n', stderr);
    va_end(args);
    return 0;
}

static int bad_value(int id, const char *value, const char *expected) {
    return error_line("%s %s: must be %s", option_table[id].name, value, expected);
}

static int given(const options *o, int id) {
    return (int)(o->given >> id & 1u);
}

static void print_help(void) {
    puts("lut - tables of specular visibility as volume textures\n\n"
         "usage: lut [options] (-o FILE | --slices FILE.png | --stats)\n");
    for (int i = 0; i < OPT_COUNT; ++i) {
        char left[64];
        const option_info *info = option_table + i;
        snprintf(left, sizeof left, "%s %s", info->name, info->value ? info->value : "");
        printf("  %-38s %s\n", left, info->help);
    }
    puts(
        "\nx is the aperture, y beta, z the roughness; slices of further axes follow one another in z. A texel i of N\n"
        "stands for the coordinate i / (N - 1), as gtso_table_coords of gtso.h computes it. env: x is n.v, y "
        "roughness,\n"
        "slice 0 the factor of f0, slice 1 what is added.");
}

static int set_choice(int id, const char *value, const char *const *names, int *choice) {
    *choice = cli_choice(value, names);
    return *choice >= 0 ? 1 : bad_value(id, value, option_table[id].value);
}

static int set_integer(int id, const char *value, long lowest, long highest, const char *expected, int *number) {
    long v;
    if (!cli_integer(value, lowest, highest, &v))
        return bad_value(id, value, expected);
    *number = (int)v;
    return 1;
}

static int set_sizes(options *o, const char *value) {
    float n[GTSO_AXIS_COUNT];
    o->sizes = cli_numbers(value, 1, GTSO_AXIS_COUNT, n);
    for (int i = 0; i < o->sizes; ++i) {
        if (!(n[i] >= 2.0f && n[i] <= 256.0f) || floorf(n[i]) < n[i])
            return bad_value(OPT_SIZE, value, "whole numbers, 8..64 (azimuth 4..64, env 2..256)");
        o->table.size[i] = (int)n[i];
    }
    return o->sizes ? 1 : bad_value(OPT_SIZE, value, "one number, or one for each axis");
}

static int set_scales(options *o, const char *value) {
    const char *c = value;
    for (o->scales = 0; o->scales < GTSO_AXIS_COUNT;) {
        char name[16];
        size_t n = strcspn(c, ",");
        int scale = -1;
        if (n < sizeof name) {
            memcpy(name, c, n);
            name[n] = 0;
            scale = cli_choice(name, scales);
        }
        if (scale < 0)
            break;
        o->table.scale[o->scales++] = (gtso_scale)scale;
        c += n;
        if (!*c)
            return 1;
        ++c;
    }
    return bad_value(OPT_SCALE, value, "a list of default, angle, cosine, half-sine, edge, roughness, alpha");
}

static int set_option(options *o, int id, const char *value) {
    double number;
    switch (id) {
    case OPT_KIND:
        return set_choice(id, value, kinds, &o->kind);
    case OPT_LOBE:
        return set_choice(id, value, lobes, &o->lobe);
    case OPT_FRAME:
        return set_choice(id, value, frames, &o->frame);
    case OPT_FIT:
        return set_choice(id, value, fits, &o->fit);
    case OPT_CAPS:
        return set_choice(id, value, caps, &o->caps);
    case OPT_F0:
        if (!cli_number(value, &number) || !((float)number > 0.0f && number <= 1.0))
            return bad_value(id, value, "above 0, at most 1");
        o->table.f0 = (float)number;
        return 1;
    case OPT_SIZE:
        return set_sizes(o, value);
    case OPT_SCALE:
        return set_scales(o, value);
    case OPT_FORMAT:
        return set_choice(id, value, formats, &o->format);
    case OPT_OUTPUT:
        o->output = value;
        return 1;
    case OPT_SLICES:
        o->slices = value;
        return 1;
    case OPT_STATS:
        o->stats = 1;
        return 1;
    case OPT_POINTS:
        return set_integer(id, value, 100, 10000000, "an integer, 100..10000000", &o->points);
    case OPT_THREADS:
        return set_integer(id, value, 1, 1024, "an integer, 1..1024", &o->threads);
    default:
        return 1;
    }
}

static int parse_options(int argc, char **argv, options *o) {
    memset(o, 0, sizeof *o);
    o->threads = cli_processors();
    o->format = VOLUME_UNORM8;
    o->points = 20000;
    for (int i = 1; i < argc; ++i) {
        const char *name = argv[i], *value = NULL;
        const char *equals = strncmp(name, "--", 2) == 0 ? strchr(name, '=') : NULL;
        size_t length = equals ? (size_t)(equals - name) : strlen(name);
        int id = 0;
        while (id < OPT_COUNT &&
               (strlen(option_table[id].name) != length || memcmp(option_table[id].name, name, length) != 0))
            ++id;
        if (id == OPT_COUNT)
            return error_line("%s: unknown option, see --help", name);
        if (option_table[id].value) {
            value = equals ? equals + 1 : i + 1 < argc ? argv[++i] : NULL;
            if (!value || !value[0] || (!equals && strncmp(value, "--", 2) == 0))
                return error_line("%s: needs a value, %s", option_table[id].name, option_table[id].value);
        } else if (equals) {
            return error_line("%s: takes no value", option_table[id].name);
        }
        o->given |= 1u << id;
        if (!set_option(o, id, value))
            return 0;
    }
    return 1;
}

static int same_file(const char *a, const char *b) {
    struct stat x, y;
    if (strcmp(a, b) == 0)
        return 1;
    return stat(a, &x) == 0 && stat(b, &y) == 0 && x.st_dev == y.st_dev && x.st_ino == y.st_ino;
}

/* A file that can be written beside its temporary name. */
static int check_output(int id, const char *path) {
    const char *name = option_table[id].name, *slash = strrchr(path, '/');
    size_t n = slash == path ? 1 : slash ? (size_t)(slash - path) : 0;
    struct stat info;
    char directory[4096];
    if (stat(path, &info) == 0 && !S_ISREG(info.st_mode))
        return error_line("%s %s: not a regular file", name, path);
    if (n >= sizeof directory)
        return error_line("%s %s: name too long", name, path);
    memcpy(directory, path, n);
    directory[n] = 0;
    if (access(n ? directory : ".", W_OK | X_OK) != 0) {
        int there = stat(n ? directory : ".", &info) == 0;
        return error_line("%s %s: its directory is %s", name, path, there ? "not writable" : "missing");
    }
    return 1;
}

static int check_outputs(const options *o) {
    if (!o->output && !o->slices && !o->stats)
        return error_line("-o, --slices or --stats: one of them is required, see --help");
    if (given(o, OPT_POINTS) && !o->stats)
        return error_line("--points: only with --stats");
    if (given(o, OPT_FORMAT) && !o->output)
        return error_line("--format: only with -o");
    if (o->output && volume_file_of(o->output) == VOLUME_UNKNOWN)
        return error_line("-o %s: unknown format, the name must end in .dds, .ktx2, .h, .c, .inc, .exr or .pfm",
                          o->output);
    if (o->output && given(o, OPT_FORMAT) && o->format != VOLUME_FLOAT && volume_file_of(o->output) == VOLUME_IMAGE)
        return error_line("--format %s: %s holds floats", formats[o->format], o->output);
    if (o->slices && image_format_of(o->slices) != IMAGE_PNG)
        return error_line("--slices %s: the name must end in .png", o->slices);
    if (o->output && !check_output(OPT_OUTPUT, o->output))
        return 0;
    if (o->slices && !check_output(OPT_SLICES, o->slices))
        return 0;
    if (o->output && o->slices && same_file(o->output, o->slices))
        return error_line("--slices %s: the same file as -o", o->slices);
    return 1;
}

/* The option behind a field of the description that the library refuses. */
static int library_error(gtso_result result) {
    const char *name = result == GTSO_ERROR_TABLE_SIZE ? "--size"
                       : result == GTSO_ERROR_SCALE    ? "--scale"
                       : result == GTSO_ERROR_F0       ? "--f0"
                                                       : "--kind";
    return error_line("%s: %s", name, gtso_result_string(result));
}

/* Options that the kind of table has no use for; then the description, its defaults replaced. */
static int resolve(options *o, gtso_table_desc *table) {
    static const int axes_of[] = {3, 3, 4, 5, 2};
    const int lobe = 1 << GTSO_KIND_LOBE, cone = 1 << GTSO_KIND_CONE;
    const int brdf = 1 << GTSO_KIND_BRDF | 1 << GTSO_KIND_BENT, env = 1 << KIND_ENV;
    const struct {
        int id, kinds;
    } only[] = {{OPT_LOBE, lobe}, {OPT_FRAME, lobe}, {OPT_FIT, cone},    {OPT_CAPS, cone},
                {OPT_F0, brdf},   {OPT_SCALE, ~env}, {OPT_SLICES, ~env}, {OPT_STATS, ~env}};
    for (size_t i = 0; i < sizeof only / sizeof *only; ++i)
        if (given(o, only[i].id) && !(only[i].kinds >> o->kind & 1))
            return error_line("%s: not with --kind %s", option_table[only[i].id].name, kinds[o->kind]);
    int count = axes_of[o->kind];
    if (o->sizes > 1 && o->sizes != count)
        return error_line("--size: %d numbers, but --kind %s has %d axes", o->sizes, kinds[o->kind], count);
    if (o->scales && o->scales != count)
        return error_line("--scale: %d names, but --kind %s has %d axes", o->scales, kinds[o->kind], count);
    for (int i = o->sizes; o->sizes == 1 && i < count; ++i)
        o->table.size[i] = o->table.size[0];
    if (o->format == VOLUME_BC4 && ((o->table.size[0] | o->table.size[1]) & 3))
        return error_line("--size: BC4 needs the first two to be multiples of 4");
    if (o->kind == KIND_ENV) {
        for (int i = 0; i < 2; ++i)
            o->table.size[i] = o->table.size[i] ? o->table.size[i] : 32;
        return 1;
    }
    o->table.kind = (gtso_kind)o->kind;
    o->table.lobe = (gtso_lobe)o->lobe;
    o->table.frame = (gtso_frame)o->frame;
    o->table.fit = (gtso_fit)o->fit;
    o->table.caps = (gtso_caps)o->caps;
    gtso_result result = gtso_table_resolve(&o->table, table);
    if (result != GTSO_OK)
        return library_error(result);
    if (o->output && volume_file_of(o->output) != VOLUME_C && volume_file_of(o->output) != VOLUME_IMAGE &&
        table->size[2] * table->size[3] * table->size[4] > VOLUME_MAX_SIZE)
        return error_line("--size: %d slices, but a volume texture has %d at most",
                          table->size[2] * table->size[3] * table->size[4], VOLUME_MAX_SIZE);
    return 1;
}

/* ---- baking ------------------------------------------------------------------------------------------------------- */

/* A bar, only on a terminal, and only once the work has taken a second. */
typedef struct progress {
    const char *what;
    double started;
    int shown;
} progress;

static void show_progress(progress *p, int done, int all) {
    enum { WIDTH = 40 };
    if (p->shown < 0 || cli_seconds() - p->started < 1.0)
        return;
    if (!isatty(STDERR_FILENO)) {
        p->shown = -1;
        return;
    }
    int percent = (int)(100.0 * done / all);
    if (percent == p->shown)
        return;
    char bar[WIDTH + 1];
    for (int i = 0; i < WIDTH; ++i)
        bar[i] = i * 100 < percent * WIDTH ? '#' : '.';
    bar[WIDTH] = 0;
    fprintf(stderr, "\rlut: %s [%s] %3d %%", p->what, bar, percent);
    fflush(stderr);
    p->shown = percent;
}

static void end_progress(const progress *p) {
    if (p->shown > 0)
        fprintf(stderr, "\r%*s\r", (int)strlen(p->what) + 64, "");
}

typedef struct bake {
    const gtso_table_desc *table; /* null: the environment BRDF */
    const int *size;
    float *data;
    progress shown;
} bake;

static void bake_rows(void *user, int thread, int row_begin, int row_end) {
    bake *b = user;
    (void)thread;
    if (b->table)
        gtso_bake_rows(b->table, b->data, row_begin, row_end, NULL);
    else
        gtso_env_bake_rows(b->size[0], b->size[1], b->data, row_begin, row_end, NULL);
}

static void bake_progress(void *user, int rows_done, int rows) {
    show_progress(&((bake *)user)->shown, rows_done, rows);
}

static int bake_table(pool *workers, const gtso_table_desc *table, volume *v) {
    if (!volume_create(v, table->size[0], table->size[1], table->size[2] * table->size[3] * table->size[4]))
        return error_line("--size: not enough memory");
    bake b = {table, table->size, v->texels, {"baking", cli_seconds(), 0}};
    pool_run(workers, gtso_table_rows(table), 0, bake_rows, bake_progress, &b);
    end_progress(&b.shown);
    return 1;
}

/* Pairs to slices. */
static int bake_env(pool *workers, const int *size, volume *v) {
    size_t count = (size_t)size[0] * (size_t)size[1];
    bake b = {NULL, size, malloc(2 * count * sizeof(float)), {"baking", cli_seconds(), 0}};
    int ok = b.data && volume_create(v, size[0], size[1], 2);
    if (ok) {
        pool_run(workers, size[1], 1, bake_rows, bake_progress, &b);
        end_progress(&b.shown);
        for (size_t i = 0; i < count; ++i) {
            v->texels[i] = b.data[2 * i];
            v->texels[count + i] = b.data[2 * i + 1];
        }
    }
    free(b.data);
    return ok ? 1 : error_line("--size: not enough memory");
}

/* What the axes mean, for whoever opens the file. */
static void describe(const options *o, const gtso_table_desc *t, char *text, size_t size) {
    if (o->kind == KIND_ENV) {
        snprintf(text, size, "environment BRDF: x n.v, y roughness; slice 0 the factor of f0, slice 1 what is added");
        return;
    }
    size_t n = (size_t)snprintf(text, size, "specular visibility, kind %s", kinds[o->kind]);
    if (o->kind == GTSO_KIND_LOBE)
        n += (size_t)snprintf(text + n, size - n, ", lobe %s, frame %s", lobes[o->lobe], frames[o->frame]);
    else if (o->kind == GTSO_KIND_CONE)
        n += (size_t)snprintf(text + n, size - n, ", fit %s, caps %s", fits[o->fit], caps[o->caps]);
    else
        n += (size_t)snprintf(text + n, size - n, ", f0 %g", (double)t->f0);
    for (int i = 0; i < gtso_table_axes(t); ++i)
        n += (size_t)snprintf(text + n, size - n, "%s%s %d %s", i ? ", " : "; ", axes[i], t->size[i],
                              scales[t->scale[i]]);
}

/* ---- statistics --------------------------------------------------------------------------------------------------- */

typedef struct comparison {
    const gtso_table_desc *table;
    float largest[GTSO_AXIS_COUNT]; /* of each parameter */
    float *exact;
    progress shown;
} comparison;

/* Point i of a low-discrepancy sequence over the domain, uniform in every angle and in roughness. */
static void point_at(const comparison *c, int i, gtso_point *p) {
    double step = 1.0;
    float v[GTSO_AXIS_COUNT];
    for (int k = 0; k < GTSO_AXIS_COUNT; ++k) {
        step /= 1.13472413840151949; /* the root of x^6 = x + 1 */
        double u = 0.5 + step * (i + 1);
        v[k] = (float)(u - floor(u)) * c->largest[k];
    }
    p->aperture_rad = v[0], p->beta_rad = v[1], p->roughness = v[2], p->view_rad = v[3], p->azimuth_rad = v[4];
}

/* The largest value of every parameter, from the corners of the table. */
static void set_domain(comparison *c) {
    memset(c->largest, 0, sizeof c->largest);
    for (int corner = 0; corner < 1 << GTSO_AXIS_COUNT; ++corner) {
        float u[GTSO_AXIS_COUNT];
        gtso_point p;
        for (int k = 0; k < GTSO_AXIS_COUNT; ++k)
            u[k] = (float)(corner >> k & 1);
        gtso_table_point(c->table, u, &p);
        const float v[] = {p.aperture_rad, p.beta_rad, p.roughness, p.view_rad, p.azimuth_rad};
        for (int k = 0; k < gtso_table_axes(c->table); ++k)
            c->largest[k] = v[k] > c->largest[k] ? v[k] : c->largest[k];
    }
    /* Beyond it no reflection is above the horizon of n = b. */
    if (c->table->kind == GTSO_KIND_LOBE && c->table->frame == GTSO_FRAME_BENT)
        c->largest[GTSO_AXIS_BETA] = (float)(0.5 * PI);
}

static void exact_rows(void *user, int thread, int row_begin, int row_end) {
    const comparison *c = user;
    (void)thread;
    for (int i = row_begin; i < row_end; ++i) {
        gtso_point p;
        point_at(c, i, &p);
        c->exact[i] = gtso_table_exact(c->table, &p);
    }
}

static void exact_progress(void *user, int rows_done, int rows) {
    show_progress(&((comparison *)user)->shown, rows_done, rows);
}

static int compare_floats(const void *a, const void *b) {
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

typedef struct figures {
    double rmse, most, most_of_999; /* of 1000 points the worst but one */
    double added;                   /* RMS difference to the table of floats */
} figures;

static int measure(const comparison *c, const gtso_table_desc *t, const float *data, const float *floats, int points,
                   figures *f) {
    float *error = malloc((size_t)points * sizeof *error);
    double sum = 0.0, added = 0.0;
    if (!error)
        return error_line("--points %d: not enough memory", points);
    for (int i = 0; i < points; ++i) {
        gtso_point p;
        point_at(c, i, &p);
        float value = gtso_table_sample(t, data, &p), change = value - gtso_table_sample(t, floats, &p);
        error[i] = fabsf(value - c->exact[i]);
        added += (double)change * (double)change;
        sum += (double)error[i] * (double)error[i];
    }
    qsort(error, (size_t)points, sizeof *error, compare_floats);
    f->rmse = sqrt(sum / points);
    f->added = sqrt(added / points);
    f->most = (double)error[points - 1];
    f->most_of_999 = (double)error[points - 1 - points / 1000];
    free(error);
    return 1;
}

static int print_stats(const options *o, const gtso_table_desc *table, pool *workers) {
    static const int sizes3[] = {8, 16, 24, 32, 48, 64, 0}, sizes4[] = {8, 12, 16, 24, 32, 0},
                     sizes5[] = {8, 12, 16, 0};
    int count = gtso_table_axes(table), own = 0, ok = 1;
    const int *sizes = count == 3 ? sizes3 : count == 4 ? sizes4 : sizes5;
    comparison c = {table, {0}, malloc((size_t)o->points * sizeof(float)), {"integrating", cli_seconds(), 0}};
    char text[512];
    if (!c.exact)
        return error_line("--points %d: not enough memory", o->points);
    set_domain(&c);
    pool_run(workers, o->points, 0, exact_rows, exact_progress, &c);
    end_progress(&c.shown);
    describe(o, table, text, sizeof text);
    text[strcspn(text, ";")] = 0;
    printf("%s; %d points, uniform in angles (beta to %.0f degrees) and roughness\n\n", text, o->points,
           (double)c.largest[GTSO_AXIS_BETA] * 180.0 / PI);
    printf("| texels | 8-bit bytes | baking, s | float: RMSE | 99.9 %% | largest | 16 bits: RMSE | 8 bits: RMSE | BC4: "
           "RMSE | BC4 adds | largest |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    /* the usual sizes, and the one that was asked for */
    for (int i = 0; ok && (sizes[i] || !own); ++i) {
        gtso_table_desc t = *table;
        if (!sizes[i] && !o->sizes)
            break;
        for (int k = 0; k < count; ++k)
            t.size[k] = sizes[i] ? (k == GTSO_AXIS_AZIMUTH ? sizes[i] / 2 : sizes[i]) : table->size[k];
        own = own || !sizes[i] || memcmp(t.size, table->size, sizeof t.size) == 0;
        volume v = {0, 0, 0, NULL};
        figures f[VOLUME_FORMAT_COUNT];
        double begun = cli_seconds();
        ok = bake_table(workers, &t, &v);
        double seconds = cli_seconds() - begun;
        size_t texels = gtso_table_count(&t);
        float *data = ok ? malloc(texels * sizeof *data) : NULL;
        for (int k = 0; ok && k < VOLUME_FORMAT_COUNT; ++k) {
            ok = data && volume_quantise(&v, (volume_format)k, data) ? 1 : error_line("--stats: not enough memory");
            ok = ok && measure(&c, &t, data, v.texels, o->points, f + k);
        }
        if (ok) {
            for (int k = 0; k < count; ++k)
                printf("%s%d", k ? " x " : "| ", t.size[k]);
            printf(" | %zu | %.2f | %.5f | %.4f | %.4f | %.5f | %.5f | %.5f | %.5f | %.4f |\n", texels, seconds,
                   f[VOLUME_FLOAT].rmse, f[VOLUME_FLOAT].most_of_999, f[VOLUME_FLOAT].most, f[VOLUME_UNORM16].rmse,
                   f[VOLUME_UNORM8].rmse, f[VOLUME_BC4].rmse, f[VOLUME_BC4].added, f[VOLUME_BC4].most);
            fflush(stdout);
        }
        free(data);
        volume_free(&v);
        if (!sizes[i])
            break;
    }
    if (ok)
        printf("\nBaked on %d thread(s).\n", pool_threads(workers));
    free(c.exact);
    return ok;
}

/* ---- picture ------------------------------------------------------------------------------------------------------ */

enum { PANEL = 150, GAP = 8, LEFT = 96, TOP = 56, BOTTOM = 46, COLUMNS = 6, MOST_ROWS = 6 };

static const unsigned ink_paper = 0x121316, ink_text = 0xf2f2f0, ink_soft = 0x9ba1a8;

/* As stored: texel by texel; over angles: aperture to the right, beta downwards. */
static void draw_panel(const gtso_table_desc *t, const volume *v, int stored, float roughness, float view, int px,
                       int py, float largest_beta, image *canvas) {
    for (int y = 0; y < PANEL; ++y)
        for (int x = 0; x < PANEL; ++x) {
            float value;
            if (stored) {
                int a = x * t->size[0] / PANEL, b = y * t->size[1] / PANEL;
                int r = (int)(roughness * (float)(t->size[2] - 1) + 0.5f), w = (t->size[3] - 1) / 2;
                size_t slice = (size_t)w * (size_t)t->size[2] + (size_t)r;
                value = v->texels[(slice * (size_t)t->size[1] + (size_t)b) * (size_t)t->size[0] + (size_t)a];
            } else {
                gtso_point p;
                memset(&p, 0, sizeof p);
                p.aperture_rad = ((float)x + 0.5f) / PANEL * (float)(0.5 * PI);
                p.beta_rad = ((float)y + 0.5f) / PANEL * largest_beta;
                p.roughness = roughness;
                p.view_rad = view;
                value = gtso_table_sample(t, v->texels, &p);
            }
            color c = {value, value, value};
            canvas_fill(canvas, px + x, py + y, 1, 1, c);
        }
}

static int draw_slices(const options *o, const gtso_table_desc *t, const volume *v, image *canvas) {
    static const float views[] = {0.0f, 0.5f, 1.0f, 1.5f};
    const color soft = color_hex(ink_soft), bright = color_hex(ink_text);
    int has_views = gtso_table_axes(t) > 3, rows = has_views ? 5 : 2;
    char text[512];
    image_error error;
    const float largest_beta = (float)PI;
    if (!image_create(canvas, LEFT + COLUMNS * (PANEL + GAP) + GAP, TOP + rows * (PANEL + GAP) + BOTTOM, 3, &error))
        return error_line("--slices %s: %s", o->slices, error.text);
    canvas_load_fonts();
    canvas_fill(canvas, 0, 0, canvas->width, canvas->height, color_hex(ink_paper));
    describe(o, t, text, sizeof text);
    canvas_text(canvas, GAP, 20, CANVAS_LEFT, CANVAS_REGULAR, 12, bright, text);
    for (int k = 0; k < COLUMNS; ++k) {
        float roughness = (float)k / (COLUMNS - 1);
        int x = LEFT + k * (PANEL + GAP);
        snprintf(text, sizeof text, "roughness %.1f", (double)roughness);
        canvas_text(canvas, (float)x, TOP - 8, CANVAS_LEFT, CANVAS_REGULAR, 12, soft, text);
        for (int r = 0; r < rows; ++r) {
            int y = TOP + r * (PANEL + GAP);
            float view = r > 0 && has_views ? views[r - 1] : 0.0f;
            draw_panel(t, v, r == 0, roughness, view, x, y, largest_beta, canvas);
            if (k > 0)
                continue;
            canvas_text(canvas, GAP, (float)(y + 16), CANVAS_LEFT, CANVAS_BOLD, 12, bright,
                        r == 0 ? "texels" : "angles");
            if (r > 0 && has_views) {
                snprintf(text, sizeof text, "view %.0f°", (double)view * 180.0 / PI);
                canvas_text(canvas, GAP, (float)(y + 34), CANVAS_LEFT, CANVAS_REGULAR, 12, soft, text);
            }
        }
    }
    snprintf(text, sizeof text,
             "White: V_s = 1, black: 0. Right: aperture, 0 to 90°. Down: beta, 0 to %.0f° (angles), or its coordinate "
             "0 to 1 (texels).",
             (double)largest_beta * 180.0 / PI);
    canvas_text(canvas, GAP, (float)(canvas->height - 18), CANVAS_LEFT, CANVAS_REGULAR, 12, soft, text);
    canvas_free_fonts();
    return 1;
}

/* ---- the whole ---------------------------------------------------------------------------------------------------- */

/* Both files are complete under temporary names before the first gets its own. */
static int write_outputs(const options *o, const gtso_table_desc *table, const volume *v) {
    image_error error;
    image_pending pending[2];
    image canvas;
    char comment[512];
    int ok = 1, id = OPT_OUTPUT, ids[2], count = 0;
    memset(pending, 0, sizeof pending);
    memset(&canvas, 0, sizeof canvas);
    describe(o, table, comment, sizeof comment);
    if (o->slices && !draw_slices(o, table, v, &canvas))
        return 0;
    if (o->output) {
        ok = volume_write(o->output, v, (volume_format)o->format, comment, pending + count, &error);
        ids[count++] = id;
    }
    if (ok && o->slices) {
        id = OPT_SLICES;
        ok = image_write(o->slices, &canvas, NULL, IMAGE_RANGE_UNIT, pending + count, &error);
        ids[count++] = id;
    }
    for (int i = 0; ok && i < count; ++i) {
        id = ids[i];
        ok = image_commit(pending + i, &error);
    }
    for (int i = 0; i < count; ++i)
        image_discard(pending + i);
    image_free(&canvas);
    return ok ? 1 : error_line("%s %s", option_table[id].name, error.text);
}

int main(int argc, char **argv) {
    options o;
    gtso_table_desc table;
    memset(&table, 0, sizeof table);
    for (int i = 1; i < argc; ++i)
        if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0) {
            print_help();
            return 0;
        }
    if (!parse_options(argc, argv, &o) || !check_outputs(&o) || !resolve(&o, &table))
        return 2;
    pool *workers = pool_create(o.threads);
    volume v = {0, 0, 0, NULL};
    int ok = workers ? 1 : error_line("--threads: not enough memory");
    if (ok && (o.output || o.slices)) {
        ok = o.kind == KIND_ENV ? bake_env(workers, o.table.size, &v) : bake_table(workers, &table, &v);
        ok = ok && write_outputs(&o, &table, &v);
    }
    ok = ok && (!o.stats || print_stats(&o, &table, workers));
    volume_free(&v);
    pool_destroy(workers);
    return ok ? 0 : 2;
}
