/* diff - compares two images, or two dumps stage by stage: how far apart, where, and which stage differs first. */
#include "canvas.h"
#include "cli.h"
#include "image.h"
#include "settings.h"

#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* ---- options ------------------------------------------------------------------------------------------------------ */

enum { MAX_TOLERANCES = 64, MAX_NAMES = 512, GROUP = 8, PATH_SIZE = 4096 };

typedef struct tolerance {
    char stage[64]; /* or STAGE.CHANNEL; "": all */
    double value;
} tolerance;

typedef struct options {
    const char *a, *b, *heat, *only;
    tolerance tolerances[MAX_TOLERANCES];
    int count;
    double outliers;
    int partial, quiet;
} options;

static int set_tolerance(void *settings, const cli_option *option, const char *value) {
    options *o = settings;
    tolerance *t = o->tolerances + o->count;
    const char *equals = strrchr(value, '='), *number = equals ? equals + 1 : value;
    if (o->count == MAX_TOLERANCES)
        return cli_error("%s %s: more than %d", option->name, value, MAX_TOLERANCES);
    if (!cli_number(number, &t->value) || !(t->value >= 0.0) || (equals && (equals == value || equals - value > 63)))
        return cli_bad_value(option, value, "T or STAGE=T or STAGE.CHANNEL=T, T 0 or more");
    if (equals)
        memcpy(t->stage, value, (size_t)(equals - value));
    o->count++;
    return 1;
}

static int set_input(void *settings, const cli_option *option, const char *value) {
    options *o = settings;
    const char **to = o->a ? &o->b : &o->a;
    (void)option;
    if (*to)
        return cli_error("%s: there are two already, %s and %s", value, o->a, o->b);
    *to = value;
    return 1;
}

enum { OPT_INPUT, OPT_TOLERANCE, OPT_OUTLIERS, OPT_ONLY, OPT_PARTIAL, OPT_HEAT, OPT_QUIET, OPT_COUNT };

static const cli_option option_table[OPT_COUNT] = {
    [OPT_INPUT] = {"A B", "", "images (.exr, .pfm) or directories of `ao --dump`: the reference, and what is compared",
                   CLI_OWN(set_input)},
    [OPT_TOLERANCE] = {"--tolerance", "[STAGE[.CHANNEL]=]T",
                       "equal is |A - B| <= T max(1, |A|) (0); several times: the last that names a channel counts",
                       CLI_OWN(set_tolerance)},
    [OPT_OUTLIERS] = {"--outliers", "F", "part of a channel's pixels that may be farther apart, 0..1 (0)",
                      CLI_DOUBLE(options, outliers, 0, 1, "0..1")},
    [OPT_ONLY] = {"--only", "STAGE,...", "of dumps: only these stages", CLI_TEXT(options, only)},
    [OPT_PARTIAL] = {"--partial", NULL, "of dumps: B may lack stages and channels", CLI_FLAG(options, partial)},
    [OPT_HEAT] = {"--heat", "FILE.png|DIR",
                  "pictures of the differences: of images a file, of dumps one for each stage",
                  CLI_TEXT(options, heat)},
    [OPT_QUIET] = {"--quiet", NULL, "print only what differs", CLI_FLAG(options, quiet)},
};

static const cli_program program = {
    "diff",
    "compares images, or dumps stage by stage",
    "A B [options]",
    "Exit status: 0 equal within the tolerance, 1 different, 2 bad input. NaN equals NaN, an infinity itself.\n"
    "Heat maps: black is equal, blue below the tolerance, yellow to red above (a factor of 10^4), magenta not\n"
    "finite. Where the tolerance is 0 they take 1e-5.",
    option_table,
    OPT_COUNT,
    0};

static double tolerance_of(const options *o, const char *stage, const char *channel) {
    double value = 0.0;
    size_t n = strlen(stage);
    for (int i = 0; i < o->count; ++i) {
        const char *name = o->tolerances[i].stage;
        if (!name[0] || strcmp(name, stage) == 0 ||
            (channel && strncmp(name, stage, n) == 0 && name[n] == '.' && strcmp(name + n + 1, channel) == 0))
            value = o->tolerances[i].value;
    }
    return value;
}

/* ---- one channel -------------------------------------------------------------------------------------------------- */

typedef struct result {
    double most, rmse, percentile[4];
    int x, y; /* of the worst */
    float a, b;
    size_t outside, unlike; /* pixels beyond the tolerance; of these not finite in one, or differently */
} result;

static const double percents[4] = {0.5, 0.95, 0.99, 0.999};

/* The rank-th smallest, from 0, of non-negative floats, whose bits are in their order: by the upper half, then the
 * lower. */
static double ranked(const float *values, size_t count, size_t rank, const size_t upper[65536]) {
    static size_t lower[65536];
    uint32_t high = 0, low = 0, bits;
    while (rank >= upper[high])
        rank -= upper[high++];
    memset(lower, 0, sizeof lower);
    for (size_t i = 0; i < count; ++i) {
        memcpy(&bits, values + i, 4);
        if (bits >> 16 == high)
            lower[bits & 0xffffu]++;
    }
    while (rank >= lower[low])
        rank -= lower[low++];
    bits = high << 16 | low;
    float value;
    memcpy(&value, &bits, 4);
    return (double)value;
}

static int same_bits(float a, float b) {
    return memcmp(&a, &b, sizeof a) == 0;
}

/* `distance` receives |A - B|, infinite where only one is finite; `heat` the largest of (|A - B| / allowed) so far, -1
 * for what is not finite, and may be null. */
static result compare(const image *a, const image *b, int channel, double allowed, float *distance, float *heat) {
    static size_t upper[65536];
    size_t count = (size_t)a->width * (size_t)a->height, stride = (size_t)a->channels;
    double sum = 0.0, worst = -1.0;
    result r;
    memset(&r, 0, sizeof r);
    memset(upper, 0, sizeof upper);
    for (size_t i = 0; i < count; ++i) {
        float x = a->data[i * stride + (size_t)channel], y = b->data[i * stride + (size_t)channel];
        int alike = same_bits(x, y) || (isnan(x) && isnan(y));
        double d = alike ? 0.0 : fabs((double)x - (double)y);
        uint32_t bits;
        if (!(d <= 1.7e308)) /* NaN, too */
            d = HUGE_VAL, r.unlike++;
        distance[i] = (float)d;
        memcpy(&bits, distance + i, 4);
        upper[bits >> 16]++;
        sum += d * d;
        if (d > allowed * fmax(1.0, fabs((double)x)) || d > 1e300)
            r.outside++;
        if (d > worst) {
            worst = d;
            r.x = (int)(i % (size_t)a->width), r.y = (int)(i / (size_t)a->width), r.a = x, r.b = y;
        }
        if (heat && heat[i] >= 0.0f) {
            float part = (float)(d / ((allowed > 0.0 ? allowed : 1e-5) * fmax(1.0, fabs((double)x))));
            heat[i] = d > 1e300 ? -1.0f : fmaxf(heat[i], part);
        }
    }
    r.most = worst;
    r.rmse = sqrt(sum / (double)count);
    for (int p = 0; p < 4; ++p) {
        size_t rank = (size_t)ceil(percents[p] * (double)count);
        r.percentile[p] = ranked(distance, count, rank > 0 ? rank - 1 : 0, upper);
    }
    return r;
}

/* ---- pictures ----------------------------------------------------------------------------------------------------- */

/* heat: distance in tolerances. */
static int write_heat(const char *path, int width, int height, const float *heat, image_error *error) {
    image picture;
    image_pending pending;
    const color stops[] = {{0.0f, 0.0f, 0.0f}, {0.1f, 0.2f, 0.6f}, {0.95f, 0.85f, 0.1f}, {0.85f, 0.05f, 0.05f}};
    if (!image_create(&picture, width, height, 3, error))
        return 0;
    for (size_t i = 0; i < (size_t)width * (size_t)height; ++i) {
        color c = {1.0f, 0.0f, 1.0f};
        if (heat[i] >= 0.0f) {
            if (heat[i] <= 1.0f)
                c = color_mix(stops[0], stops[1], heat[i]);
            else /* a factor of 10000 from yellow to red */
                c = color_mix(stops[2], stops[3], fminf(0.25f * log10f(heat[i]), 1.0f));
        }
        picture.data[3 * i] = c.r, picture.data[3 * i + 1] = c.g, picture.data[3 * i + 2] = c.b;
    }
    int ok = image_write(path, &picture, NULL, IMAGE_RANGE_UNIT, &pending, error) && image_commit(&pending, error);
    image_free(&picture);
    return ok;
}

/* ---- a stage ------------------------------------------------------------------------------------------------------ */

typedef struct report {
    const options *o;
    int printed, differs;
    char first[256], prefix[64]; /* of the first that differs; the frame of a sequence and a slash, or "" */
} report;

static void header(report *r) {
    if (!r->printed++)
        printf("%-28s %10s %10s %10s %10s %10s %10s  %-12s %14s %14s %s\n", "stage.channel", "max", "RMSE", "50 %",
               "95 %", "99 %", "99.9 %", "worst at", "A", "B", "outside");
}

static void differs(report *r, const char *name, const char *what) {
    if (!r->differs++)
        snprintf(r->first, sizeof r->first, "%s%.60s%s%.100s", r->prefix, name, what[0] ? ": " : "", what);
}

static void print_result(report *r, const char *name, const result *s, int bad) {
    char at[32];
    if (r->o->quiet && !bad)
        return;
    header(r);
    snprintf(at, sizeof at, "%d,%d", s->x, s->y);
    printf("%s%-*s %10.3g %10.3g %10.3g %10.3g %10.3g %10.3g  %-12s %14.7g %14.7g %zu%s\n", r->prefix,
           28 - (int)strlen(r->prefix), name, s->most, s->rmse, s->percentile[0], s->percentile[1], s->percentile[2],
           s->percentile[3], at, (double)s->a, (double)s->b, s->outside, s->unlike ? " (not finite)" : "");
}

/* R and X, G and Y, B and Z, by the last component of a name; else -1. */
static int component(const char *name) {
    const char *dot = strrchr(name, '.');
    const char *at;
    name = dot ? dot + 1 : name;
    if (!name[0] || name[1])
        return -1;
    at = strchr("RXGYBZ", name[0]);
    return at ? (int)(at - "RXGYBZ") / 2 : -1;
}

/* Which channel of `names` stands for names_a[i]: by name, or as X, Y, Z do for R, G, B; the only one for the only one. */
static int partner(char *const *names_a, int count_a, int i, char *const *names, int count) {
    for (int k = 0; k < count; ++k)
        if (strcmp(names_a[i], names[k]) == 0)
            return k;
    if (count_a == 1 && count == 1)
        return 0;
    if (count_a == 3 && count == 3 && component(names_a[i]) >= 0)
        for (int k = 0; k < 3; ++k)
            if (component(names[k]) == component(names_a[i]))
                return k;
    return -1;
}

/* 0 after an error. `stage` is null for two images. */
static int compare_files(report *r, const char *stage, const char *path_a, const char *path_b, const char *heat_path) {
    const options *o = r->o;
    image_error error;
    char **names_a, **names_b = NULL;
    float *distance = NULL, *heat = NULL;
    int count_a = 0, count_b = 0, ok, width = 0, height = 0;
    names_a = image_list_channels(path_a, &count_a, &error);
    if (names_a)
        names_b = image_list_channels(path_b, &count_b, &error);
    ok = (names_a && names_b) || cli_error("%s", error.text);
    for (int i = 0; ok && i < count_a;) {
        const char *group_a[GROUP], *group_b[GROUP];
        image a, b;
        int n = 0;
        for (; n < GROUP && i < count_a; ++i) {
            int k = partner(names_a, count_a, i, names_b, count_b);
            if (k >= 0) {
                group_a[n] = names_a[i], group_b[n++] = names_b[k];
            } else if (!o->partial) {
                char name[160];
                header(r);
                snprintf(name, sizeof name, "%s%s%.100s", stage ? stage : "", stage ? "." : "", names_a[i]);
                printf("%s%-*s not in B\n", r->prefix, 28 - (int)strlen(r->prefix), name);
                differs(r, name, "not in B");
            }
        }
        if (n == 0)
            continue;
        ok = image_read_channels(path_a, group_a, n, &a, &error) || cli_error("%s", error.text);
        if (!ok)
            break;
        ok = image_read_channels(path_b, group_b, n, &b, &error) || cli_error("%s", error.text);
        if (!ok) {
            image_free(&a);
            break;
        }
        if (a.width != b.width || a.height != b.height)
            ok = cli_error("%s: %d x %d, but %s is %d x %d", path_b, b.width, b.height, path_a, a.width, a.height);
        if (ok && !distance) {
            size_t pixels = (size_t)a.width * (size_t)a.height;
            width = a.width, height = a.height;
            distance = malloc(pixels * sizeof *distance);
            heat = heat_path ? calloc(pixels, sizeof *heat) : NULL;
            if (!distance || (heat_path && !heat))
                ok = cli_error("%s: not enough memory", path_a);
        }
        for (int c = 0; ok && c < n; ++c) {
            char name[160];
            double allowed = tolerance_of(o, stage ? stage : "", group_a[c]);
            result s = compare(&a, &b, c, allowed, distance, heat);
            int bad = (double)s.outside > o->outliers * (double)a.width * (double)a.height;
            snprintf(name, sizeof name, "%s%s%.100s", stage ? stage : "", stage ? "." : "", group_a[c]);
            print_result(r, name, &s, bad);
            if (bad)
                differs(r, name, "");
        }
        image_free(&a);
        image_free(&b);
    }
    if (ok && heat)
        ok = write_heat(heat_path, width, height, heat, &error) || cli_error("--heat %s", error.text);
    image_free_names(names_a);
    image_free_names(names_b);
    free(distance);
    free(heat);
    return ok;
}

/* ---- settings ----------------------------------------------------------------------------------------------------- */

/* How much of a value to show: without the comma that ends its line. */
static int shown(const char *value) {
    int n = (int)strcspn(value, "\n");
    n -= n > 0 && value[n - 1] == ',';
    return n < 60 ? n : 60;
}

/* Numbers of the keys that both have. */
static void compare_settings(report *r, const char *a, const char *b) {
    double allowed = tolerance_of(r->o, "settings", NULL);
    for (const char *at = a; (at = strchr(at, '"')) != NULL;) {
        size_t n = strcspn(at + 1, "\"");
        const char *value = settings_value(at, at + 1, n), *other = settings_value(b, at + 1, n);
        int number = value && (*value == '[' ? value[1] : *value) != '"';
        if (number && other && strncmp(at + 1, "version", n) != 0 && !settings_same(value, other, allowed)) {
            char name[80];
            snprintf(name, sizeof name, "settings.%.*s", (int)(n < 60 ? n : 60), at + 1);
            header(r);
            printf("%s%-*s A %.*s, B %.*s\n", r->prefix, 28 - (int)strlen(r->prefix), name, shown(value), value,
                   shown(other), other);
            differs(r, name, "");
        }
        at += n + (at[n + 1] != 0) + 1;
    }
}

/* ---- dumps -------------------------------------------------------------------------------------------------------- */

static int by_name(const void *a, const void *b) {
    return strcmp(*(char *const *)a, *(char *const *)b);
}

static int is_directory(const char *path) {
    struct stat info;
    return stat(path, &info) == 0 && S_ISDIR(info.st_mode);
}

/* Names in a directory, sorted: of files .exr without their ending, or of directories. */
static int list(const char *path, int directories, char *names[MAX_NAMES]) {
    DIR *dir = opendir(path);
    int count = 0;
    for (const struct dirent *e; dir && count < MAX_NAMES && (e = readdir(dir)) != NULL;) {
        char full[PATH_SIZE + 300];
        size_t n = strlen(e->d_name);
        snprintf(full, sizeof full, "%s/%s", path, e->d_name);
        if (e->d_name[0] == '.' || is_directory(full) != directories ||
            (!directories && (n < 5 || strcmp(e->d_name + n - 4, ".exr") != 0)))
            continue;
        n -= directories ? 0 : 4;
        names[count] = calloc(1, n + 1);
        if (names[count])
            memcpy(names[count++], e->d_name, n);
    }
    if (dir)
        closedir(dir);
    qsort(names, (size_t)count, sizeof *names, by_name);
    return count;
}

/* The order of the stages, from the settings, to the front of the sorted names. */
static void order(const char *settings, char *names[MAX_NAMES], int count) {
    const char *at = settings ? settings_value(settings, "stages", 6) : NULL, *close = at ? strchr(at, ']') : NULL;
    int done = 0;
    while (at && close && (at = strchr(at, '"')) != NULL && at < close) {
        size_t n = strcspn(++at, "\"");
        for (int i = done; i < count; ++i)
            if (strlen(names[i]) == n && memcmp(names[i], at, n) == 0) {
                char *name = names[i];
                memmove(names + done + 1, names + done, (size_t)(i - done) * sizeof *names);
                names[done++] = name;
                break;
            }
        at += n + 1;
    }
}

static int listed(const char *names, const char *name) {
    size_t n = strlen(name);
    for (; names; names = strchr(names, ','), names = names ? names + 1 : NULL)
        if (strncmp(names, name, n) == 0 && (names[n] == ',' || !names[n]))
            return 1;
    return 0;
}

static int compare_dumps(report *r, const char *path_a, const char *path_b, int depth) {
    const options *o = r->o;
    char *names[MAX_NAMES], a[PATH_SIZE + 300], b[PATH_SIZE + 300], heat[PATH_SIZE + 300];
    char *settings_a, *settings_b;
    int count = list(path_a, 0, names), ok = 1, seen = 0;
    snprintf(a, sizeof a, "%s/settings.json", path_a);
    snprintf(b, sizeof b, "%s/settings.json", path_b);
    settings_a = settings_read(a);
    settings_b = settings_read(b);
    if (settings_a && settings_b && (!o->only || listed(o->only, "settings")))
        compare_settings(r, settings_a, settings_b), seen++;
    order(settings_a, names, count);
    for (int i = 0; i < count; ++i) {
        struct stat info;
        if (ok && (!o->only || listed(o->only, names[i]))) {
            snprintf(a, sizeof a, "%s/%s.exr", path_a, names[i]);
            snprintf(b, sizeof b, "%s/%s.exr", path_b, names[i]);
            snprintf(heat, sizeof heat, "%s/%.40s%s%s.png", o->heat ? o->heat : "", r->prefix, "", names[i]);
            for (char *c = heat + (o->heat ? strlen(o->heat) + 1 : 0); *c; ++c)
                *c = *c == '/' ? '-' : *c;
            if (stat(b, &info) == 0) {
                ok = compare_files(r, names[i], a, b, o->heat ? heat : NULL);
                seen++;
            } else if (!o->partial) {
                header(r);
                printf("%s%-*s not in B\n", r->prefix, 28 - (int)strlen(r->prefix), names[i]);
                differs(r, names[i], "not in B");
            }
        }
        free(names[i]);
    }
    free(settings_a);
    free(settings_b);
    if (!ok || count > 0)
        return ok && (seen || r->differs || cli_error("%s, %s: no stage in common", path_a, path_b));
    count = depth > 0 ? list(path_a, 1, names) : 0;
    if (count == 0)
        return cli_error("%s: no stages", path_a);
    for (int i = 0; i < count; ++i) {
        snprintf(a, sizeof a, "%s/%s", path_a, names[i]);
        snprintf(b, sizeof b, "%s/%s", path_b, names[i]);
        snprintf(r->prefix, sizeof r->prefix, "%.60s/", names[i]);
        if (ok && is_directory(b)) {
            ok = compare_dumps(r, a, b, depth - 1);
        } else if (ok && !o->partial) {
            header(r);
            printf("%-28s not in B\n", r->prefix);
            differs(r, "", "not in B");
        }
        free(names[i]);
    }
    return ok;
}

int main(int argc, char **argv) {
    static options o;
    static unsigned char given[OPT_COUNT];
    report r;
    int status = cli_parse(&program, argc, argv, &o, given), ok;
    if (status != CLI_GO)
        return status;
    memset(&r, 0, sizeof r);
    r.o = &o;
    if (!o.a || !o.b)
        return cli_error("A and B: two images or two dumps are needed, see --help"), 2;
    if (is_directory(o.a) != is_directory(o.b))
        return cli_error("%s, %s: one is a directory, the other not", o.a, o.b), 2;
    if (is_directory(o.a)) {
        if (o.heat && mkdir(o.heat, 0777) != 0 && errno != EEXIST)
            return cli_error("--heat %s: %s", o.heat, strerror(errno)), 2;
        ok = compare_dumps(&r, o.a, o.b, 1);
    } else {
        if (o.only || o.partial)
            return cli_error("--only, --partial: not with images"), 2;
        if (o.heat && image_format_of(o.heat) != IMAGE_PNG)
            return cli_error("--heat %s: the name must end in .png", o.heat), 2;
        ok = compare_files(&r, NULL, o.a, o.b, o.heat);
    }
    if (!ok)
        return 2;
    if (r.differs)
        printf("first difference: %s\n", r.first);
    else if (!o.quiet)
        printf("equal\n");
    return r.differs > 0;
}
