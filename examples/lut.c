/* lut - bakes gtso.h's tables of specular visibility into volume textures, and measures them. `lut --help` lists the
 * options.
 *
 * Everything is checked first, computed second, and written last: a run that ends with an error leaves no output
 * behind. */
#include "gtso.h"

#include "canvas.h"
#include "cli.h"
#include "dump.h"
#include "image.h"
#include "pool.h"
#include "volume.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

/* ---- options ------------------------------------------------------------------------------------------------------ */

enum { KIND_ENV = GTSO_KIND_BENT + 1 }; /* the tool's own: the environment BRDF */

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
    OPT_DUMP,
    OPT_COUNT
};

typedef struct options {
    gtso_table_desc table;
    int kind, lobe, frame, fit, caps, format, threads, stats, points;
    int sizes, scales; /* how many were given */
    const char *output, *slices, *dump;
    unsigned char given[OPT_COUNT];
} options;

static const char *const kinds[] = {"lobe", "cone", "brdf", "bent", "env", NULL};
static const char *const lobes[] = {"brdf", "ggx", "beckmann", "blinn", "phong", NULL};
static const char *const frames[] = {"bent", "reflection", NULL};
static const char *const fits[] = {"jimenez", "drobot", "uludag", NULL};
static const char *const caps[] = {"exact", "oat", "smoothstep", NULL};
static const char *const scales[] = {"default", "angle", "cosine", "half-sine", "edge", "roughness", "alpha", NULL};
static const char *const formats[] = {"float", "unorm8", "unorm16", "bc4", NULL};
static const char *const axes[] = {"aperture", "beta", "roughness", "view", "azimuth"};

static int set_sizes(void *settings, const cli_option *option, const char *value) {
    options *o = settings;
    float n[GTSO_AXIS_COUNT];
    o->sizes = cli_numbers(value, 1, GTSO_AXIS_COUNT, n);
    for (int i = 0; i < o->sizes; ++i) {
        if (!(n[i] >= 2.0f && n[i] <= 256.0f) || floorf(n[i]) < n[i])
            return cli_bad_value(option, value, "whole numbers, 8..64 (azimuth 4..64, env 2..256)");
        o->table.size[i] = (int)n[i];
    }
    return o->sizes ? 1 : cli_bad_value(option, value, "one number, or one for each axis");
}

static int set_scales(void *settings, const cli_option *option, const char *value) {
    options *o = settings;
    const char *c = value;
    o->scales = 0;
    do {
        int scale = o->scales < GTSO_AXIS_COUNT ? cli_next_choice(&c, scales) : -1;
        if (scale < 0)
            return cli_bad_value(option, value, "a list of default, angle, cosine, half-sine, edge, roughness, alpha");
        o->table.scale[o->scales++] = (gtso_scale)scale;
    } while (*c);
    return 1;
}

static const cli_option option_table[OPT_COUNT] = {
    [OPT_KIND] = {"--kind", "lobe|cone|brdf|bent|env",
                  "3 axes: cone against lobe (lobe) or cone; 4: full BRDF; 5: any bent normal",
                  CLI_CHOICE(options, kind, kinds)},
    [OPT_LOBE] = {"--lobe", "brdf|ggx|beckmann|blinn|phong", "of --kind lobe (brdf)", CLI_CHOICE(options, lobe, lobes)},
    [OPT_FRAME] = {"--frame", "bent|reflection",
                   "of --kind lobe: where n is, the bent normal (default) or the reflection",
                   CLI_CHOICE(options, frame, frames)},
    [OPT_FIT] = {"--fit", "jimenez|drobot|uludag", "of --kind cone: the lobe's aperture (jimenez)",
                 CLI_CHOICE(options, fit, fits)},
    [OPT_CAPS] = {"--caps", "exact|oat|smoothstep", "of --kind cone: intersection of the cones (exact)",
                  CLI_CHOICE(options, caps, caps)},
    [OPT_F0] = {"--f0", "F", "of --kind brdf and bent: reflectance at normal incidence, 0..1 (0.04)",
                CLI_FLOAT(options, table.f0, CLI_ABOVE_0, 1, "above 0, at most 1")},
    [OPT_SIZE] = {"--size", "N|A,B,R[,V[,Z]]", "texels: aperture, beta, roughness, view, azimuth; env: n.v, roughness",
                  CLI_OWN(set_sizes)},
    [OPT_SCALE] = {"--scale", "A,B,R[,V[,Z]]",
                   "of each axis: default, angle, cosine, half-sine, edge, roughness, alpha", CLI_OWN(set_scales)},
    [OPT_FORMAT] = {"--format", "float|unorm8|unorm16|bc4", "texels in the file (unorm8)",
                    CLI_CHOICE(options, format, formats)},
    [OPT_OUTPUT] = {"-o", "FILE", ".dds, .ktx2, .h, .c or .inc; .exr or .pfm: slices from top to bottom, floats",
                    CLI_OUTPUT(options, output, ".dds, .ktx2, .h, .c, .inc, .exr or .pfm")},
    [OPT_SLICES] = {"--slices", "FILE.png", "picture of the table", CLI_OUTPUT(options, slices, ".png")},
    [OPT_STATS] = {"--stats", NULL, "print the error of every size and format against direct integration",
                   CLI_FLAG(options, stats)},
    [OPT_POINTS] = {"--points", "N", "points at which --stats compares (20000)",
                    CLI_INTEGER(options, points, 100, 10000000, NULL)},
    [OPT_THREADS] = {"--threads", "N", "(all processors) the results are the same bits", CLI_THREADS(options, threads)},
    [OPT_DUMP] = {"--dump", "DIR", "the table and the point of every texel, for ports to compare: docs/porting.md",
                  CLI_TEXT(options, dump)},
};

static const cli_program program = {
    "lut",
    "tables of specular visibility as volume textures",
    "[options] (-o FILE | --slices FILE.png | --stats)",
    "x is the aperture, y beta, z the roughness; slices of further axes follow one another in z. A texel i of N\n"
    "stands for the coordinate i / (N - 1), as gtso_table_coords of gtso.h computes it. env: x is n.v, y roughness,\n"
    "slice 0 the factor of f0, slice 1 what is added.",
    option_table,
    OPT_COUNT,
    0};

static int check_options(const options *o) {
    if (!o->output && !o->slices && !o->stats && !o->dump)
        return cli_error("-o, --slices, --stats or --dump: one of them is required, see --help");
    if (o->given[OPT_POINTS] && !o->stats)
        return cli_error("--points: only with --stats");
    if (o->given[OPT_FORMAT] && !o->output)
        return cli_error("--format: only with -o");
    if (o->given[OPT_FORMAT] && o->format != VOLUME_FLOAT && volume_file_of(o->output) == VOLUME_IMAGE)
        return cli_error("--format %s: %s holds floats", formats[o->format], o->output);
    return 1;
}

/* The option behind a field of the description that the library refuses. */
static int library_error(gtso_result result) {
    const char *name = result == GTSO_ERROR_TABLE_SIZE ? "--size"
                       : result == GTSO_ERROR_SCALE    ? "--scale"
                       : result == GTSO_ERROR_F0       ? "--f0"
                                                       : "--kind";
    return cli_error("%s: %s", name, gtso_result_string(result));
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
        if (o->given[only[i].id] && !(only[i].kinds >> o->kind & 1))
            return cli_error("%s: not with --kind %s", option_table[only[i].id].name, kinds[o->kind]);
    int count = axes_of[o->kind];
    if (o->sizes > 1 && o->sizes != count)
        return cli_error("--size: %d numbers, but --kind %s has %d axes", o->sizes, kinds[o->kind], count);
    if (o->scales && o->scales != count)
        return cli_error("--scale: %d names, but --kind %s has %d axes", o->scales, kinds[o->kind], count);
    for (int i = o->sizes; o->sizes == 1 && i < count; ++i)
        o->table.size[i] = o->table.size[0];
    if (o->format == VOLUME_BC4 && ((o->table.size[0] | o->table.size[1]) & 3))
        return cli_error("--size: BC4 needs the first two to be multiples of 4");
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
        return cli_error("--size: %d slices, but a volume texture has %d at most",
                         table->size[2] * table->size[3] * table->size[4], VOLUME_MAX_SIZE);
    return 1;
}

/* ---- baking ------------------------------------------------------------------------------------------------------- */

typedef struct bake {
    const gtso_table_desc *table; /* null: the environment BRDF */
    const int *size;
    float *data;
    cli_progress progress;
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
    cli_progress_show(&((bake *)user)->progress, (double)rows_done / rows);
}

static int bake_table(pool *workers, const gtso_table_desc *table, volume *v) {
    if (!volume_create(v, table->size[0], table->size[1], table->size[2] * table->size[3] * table->size[4]))
        return cli_error("--size: not enough memory");
    bake b = {table, table->size, v->texels, {"baking", 0.0, 0.0, 0}};
    pool_run(workers, gtso_table_rows(table), 0, bake_rows, bake_progress, &b);
    cli_progress_end();
    return 1;
}

/* Pairs to slices. */
static int bake_env(pool *workers, const int *size, volume *v) {
    size_t count = (size_t)size[0] * (size_t)size[1];
    bake b = {NULL, size, malloc(2 * count * sizeof(float)), {"baking", 0.0, 0.0, 0}};
    int ok = b.data && volume_create(v, size[0], size[1], 2);
    if (ok) {
        pool_run(workers, size[1], 1, bake_rows, bake_progress, &b);
        cli_progress_end();
        for (size_t i = 0; i < count; ++i) {
            v->texels[i] = b.data[2 * i];
            v->texels[count + i] = b.data[2 * i + 1];
        }
    }
    free(b.data);
    return ok ? 1 : cli_error("--size: not enough memory");
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
    cli_progress progress;
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
    cli_progress_show(&((comparison *)user)->progress, (double)rows_done / rows);
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
        return cli_error("--points %d: not enough memory", points);
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
    comparison c = {table, {0}, malloc((size_t)o->points * sizeof(float)), {"integrating", 0.0, 0.0, 0}};
    char text[512];
    if (!c.exact)
        return cli_error("--points %d: not enough memory", o->points);
    set_domain(&c);
    pool_run(workers, o->points, 0, exact_rows, exact_progress, &c);
    cli_progress_end();
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
            ok = data && volume_quantise(&v, (volume_format)k, data) ? 1 : cli_error("--stats: not enough memory");
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
        return cli_error("--slices %s: %s", o->slices, error.text);
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
    return ok ? 1 : cli_error("%s %s", option_table[id].name, error.text);
}

/* The points that texels stand for; a row of the file is a row of the table, slices from top to bottom. */
static int write_dump(const options *o, const gtso_table_desc *t, const volume *v) {
    static const char *const env[] = {"f0_factor", "bias"}, *const env_axes[] = {"n_dot_v", "roughness"};
    int is_env = o->kind == KIND_ENV, axis_count = is_env ? 2 : gtso_table_axes(t), planes = is_env ? 2 : 1;
    int width = v->width, height = is_env ? v->height : v->height * v->depth, ok;
    size_t count = (size_t)width * (size_t)height;
    float *points = malloc(count * (size_t)axis_count * sizeof *points);
    image_plane plane[GTSO_AXIS_COUNT];
    image_error error;
    dump *d = points ? dump_create(o->dump, &error) : NULL;
    if (!d) {
        free(points);
        return points ? cli_error("--dump %s", error.text) : cli_error("--size: not enough memory");
    }
    for (size_t i = 0; i < count; ++i) {
        float u[GTSO_AXIS_COUNT];
        gtso_point p;
        size_t rest = i;
        memset(u, 0, sizeof u);
        for (int a = 0; a < axis_count; ++a) {
            size_t n = (size_t)(is_env ? o->table.size[a] : t->size[a]);
            u[a] = (float)(rest % n) / (float)(n - 1);
            rest /= n;
        }
        memset(&p, 0, sizeof p);
        if (!is_env)
            gtso_table_point(t, u, &p);
        const float values[GTSO_AXIS_COUNT] = {p.aperture_rad, p.beta_rad, p.roughness, p.view_rad, p.azimuth_rad};
        for (int a = 0; a < axis_count; ++a)
            points[(size_t)axis_count * i + (size_t)a] = is_env ? u[a] : values[a];
    }
    dump_integer(d, "dump", 1);
    dump_text(d, "kind", kinds[o->kind]);
    for (int a = 0; a < axis_count; ++a) {
        char key[40];
        const char *name = is_env ? env_axes[a] : axes[a];
        plane[a].name = name, plane[a].data = points + a, plane[a].step = axis_count;
        plane[a].stride = (ptrdiff_t)width * axis_count * 4;
        snprintf(key, sizeof key, "size_%s", name);
        dump_integer(d, key, is_env ? o->table.size[a] : t->size[a]);
        snprintf(key, sizeof key, "scale_%s", name);
        dump_text(d, key, is_env ? "linear" : scales[t->scale[a]]);
    }
    if (!is_env) {
        dump_text(d, "lobe", lobes[t->lobe]);
        dump_text(d, "frame", frames[t->frame]);
        dump_text(d, "fit", fits[t->fit]);
        dump_text(d, "caps", caps[t->caps]);
        dump_floats(d, "f0", &t->f0, 1);
    }
    ok = dump_stage(d, "points", width, height, plane, axis_count, &error);
    for (int k = 0; k < planes; ++k) {
        plane[k].name = is_env ? env[k] : "table";
        plane[k].data = v->texels + (size_t)k * count, plane[k].step = 1, plane[k].stride = (ptrdiff_t)width * 4;
    }
    ok = ok && dump_stage(d, "table", width, height, plane, planes, &error);
    if (ok)
        ok = dump_commit(d, &error);
    else
        dump_discard(d);
    free(points);
    return ok ? 1 : cli_error("--dump %s", error.text);
}

int main(int argc, char **argv) {
    options o;
    gtso_table_desc table;
    memset(&table, 0, sizeof table);
    memset(&o, 0, sizeof o);
    o.threads = cli_processors();
    o.format = VOLUME_UNORM8;
    o.points = 20000;
    int status = cli_parse(&program, argc, argv, &o, o.given);
    if (status != CLI_GO)
        return status;
    if (!check_options(&o) || !resolve(&o, &table))
        return 2;
    pool *workers = pool_create(o.threads);
    volume v = {0, 0, 0, NULL};
    int ok = workers ? 1 : cli_error("--threads: not enough memory");
    if (ok && (o.output || o.slices || o.dump)) {
        ok = o.kind == KIND_ENV ? bake_env(workers, o.table.size, &v) : bake_table(workers, &table, &v);
        ok = ok && (!o.dump || write_dump(&o, &table, &v)) && write_outputs(&o, &table, &v);
    }
    ok = ok && (!o.stats || print_stats(&o, &table, workers));
    volume_free(&v);
    pool_destroy(workers);
    return ok ? 0 : 2;
}
