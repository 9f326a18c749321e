/* cli.c - see cli.h */
#include "cli.h"

#include "gtao.h"
#include "image.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

static cli_program program;
static int bar_shown;

/* ---- messages ----------------------------------------------------------------------------------------------------- */

int cli_error(const char *format, ...) {
    va_list args;
    if (program.quiet)
        return 0;
    cli_progress_end();
    va_start(args, format);
    fprintf(stderr, "%s: ", program.name);
    vfprintf(stderr, format, args);
    fputc('\n', stderr);
    va_end(args);
    return 0;
}

int cli_bad_value(const cli_option *option, const char *value, const char *expected) {
    return cli_error("%s %s: must be %s", option->name, value, expected);
}

static void print_help(void) {
    printf("%s - %s\n\nusage: %s %s\n\n", program.name, program.about, program.name, program.usage);
    for (int i = 0; i < program.count; ++i) {
        char left[96];
        const cli_option *o = program.options + i;
        snprintf(left, sizeof left, "%s %s", o->name, o->value && o->name[0] == '-' ? o->value : "");
        if (strlen(left) > 30)
            printf("  %s\n  %-30s %s\n", left, "", o->help);
        else
            printf("  %-30s %s\n", left, o->help);
    }
    if (program.notes)
        printf("\n%s\n", program.notes);
}

/* ---- values ------------------------------------------------------------------------------------------------------- */

int cli_number(const char *text, double *value) {
    char *end;
    if (!text[0] || isspace((unsigned char)text[0]))
        return 0;
    *value = strtod(text, &end);
    return end != text && *end == 0 && !isnan(*value);
}

int cli_integer(const char *text, long lowest, long highest, long *value) {
    char *end;
    if (!text[0] || isspace((unsigned char)text[0]))
        return 0;
    errno = 0;
    *value = strtol(text, &end, 10);
    return end != text && *end == 0 && errno == 0 && *value >= lowest && *value <= highest;
}

/* What stands before the next comma, or x; false if that is too long. The text moves behind it. */
static int next_part(const char **text, const char *ends, char *part, size_t size) {
    size_t n = strcspn(*text, ends);
    if (n >= size)
        return 0;
    memcpy(part, *text, n);
    part[n] = 0;
    *text += n;
    return 1;
}

int cli_numbers(const char *text, int lowest, int highest, float *values) {
    char part[64];
    for (int count = 0; count < highest; ++text) {
        double value;
        if (!next_part(&text, ",", part, sizeof part) || !cli_number(part, &value))
            return 0;
        values[count] = (float)value;
        if (isinf(values[count]) && !isinf(value))
            return 0;
        ++count;
        if (*text == 0)
            return count >= lowest ? count : 0;
    }
    return 0;
}

int cli_axes_of(const char *text, cli_axes *axes) {
    int seen = 0;
    for (int i = 0; i < 3; ++i, text += 2) {
        if ((text[0] != '+' && text[0] != '-') || text[1] < 'x' || text[1] > 'z')
            return 0;
        axes->sign[i] = text[0] == '-' ? -1.0f : 1.0f;
        axes->axis[i] = (signed char)(text[1] - 'x');
        seen |= 1 << axes->axis[i];
    }
    return *text == 0 && seen == 7;
}

int cli_choice(const char *text, const char *const *names) {
    for (int i = 0; names[i]; ++i)
        if (strcmp(text, names[i]) == 0)
            return i;
    return -1;
}

int cli_next_choice(const char **text, const char *const *names) {
    const char *at = *text;
    char part[64];
    int choice = next_part(&at, ",", part, sizeof part) ? cli_choice(part, names) : -1;
    if (choice < 0 || (*at && !at[1]))
        return -1;
    *text = at + (*at == ',');
    return choice;
}

/* ---- setters, one for each kind ----------------------------------------------------------------------------------- */

static int in_bounds(const cli_option *o, double v) {
    return v >= o->lowest && v <= o->highest && !(o->not_0 && !(v < 0.0) && !(v > 0.0));
}

static int set_integer(const cli_option *o, const char *value, int *to) {
    long v;
    char text[64];
    if (!cli_integer(value, (long)o->lowest, (long)o->highest, &v)) {
        snprintf(text, sizeof text, "an integer, %.0f..%.0f", o->lowest, o->highest);
        return cli_bad_value(o, value, o->expected ? o->expected : text);
    }
    *to = (int)v;
    return 1;
}

static int set_floats(const cli_option *o, const char *value, float *to) {
    int count = cli_numbers(value, o->least, o->most, to), ok = count > 0;
    for (int i = 0; ok && i < o->most; ++i) {
        to[i] = i < count ? to[i] : 0.0f;
        ok = i >= count || in_bounds(o, (double)to[i]);
    }
    return ok ? 1 : cli_bad_value(o, value, o->expected);
}

static int set_double(const cli_option *o, const char *value, double *to) {
    return cli_number(value, to) && in_bounds(o, *to) ? 1 : cli_bad_value(o, value, o->expected);
}

static int set_size(const cli_option *o, const char *value, int *to) {
    char first[16], text[64];
    const char *at = value;
    long w, h, lowest = (long)o->lowest, highest = (long)o->highest;
    if (next_part(&at, "x,", first, sizeof first) && *at && cli_integer(first, lowest, highest, &w) &&
        cli_integer(at + 1, lowest, highest, &h)) {
        to[0] = (int)w;
        to[1] = (int)h;
        return 1;
    }
    snprintf(text, sizeof text, "WIDTHxHEIGHT, %ld..%ld each", lowest, highest);
    return cli_bad_value(o, value, o->expected ? o->expected : text);
}

static int set_memory(const cli_option *o, const char *value, double *to) {
    static const char letters[] = "kKmMgGtT";
    char text[64];
    size_t n = strlen(value);
    double factor = 1.0;
    if (n > 1 && n < sizeof text) {
        memcpy(text, value, n + 1);
        const char *letter = strchr(letters, text[n - 1]);
        for (long k = letter ? (letter - letters) / 2 : -1; k >= 0; --k)
            factor *= 1024.0;
        text[n - 1] = letter ? 0 : text[n - 1];
        value = text;
    }
    if (!cli_number(value, to) || !(*to > 0.0) || isinf(*to))
        return cli_bad_value(o, value, "a size such as 512M or 2G");
    *to *= factor;
    return 1;
}

static int set_choice(const cli_option *o, const char *value, int *to) {
    *to = cli_choice(value, o->names);
    return *to >= 0 ? 1 : cli_bad_value(o, value, o->expected ? o->expected : o->value);
}

static int set_isa(const cli_option *o, const char *value, int *to) {
    for (*to = GTAO_ISA_AUTO; *to <= GTAO_ISA_NEON; ++*to)
        if (strcmp(value, gtao_isa_name((gtao_isa)*to)) == 0)
            break;
    if (*to > GTAO_ISA_NEON)
        return cli_bad_value(o, value, o->value);
    if (*to != GTAO_ISA_AUTO && !gtao_isa_available((gtao_isa)*to))
        return cli_error("%s %s: not compiled in, or not supported by this machine", o->name, value);
    return 1;
}

/* Does the name end in one of ".exr, .pfm or .png", in any case of letters? */
static int ends_in(const char *path, const char *endings) {
    size_t length = strlen(path);
    for (const char *e = strchr(endings, '.'); e; e = strchr(e + 1, '.')) {
        size_t n = strcspn(e, ", "), i = 0;
        while (n < length && i < n && tolower((unsigned char)path[length - n + i]) == e[i])
            ++i;
        if (i == n)
            return 1;
    }
    return 0;
}

static int set_output(const cli_option *o, const char *value, const char **to) {
    *to = value;
    return !o->expected || ends_in(value, o->expected)
               ? 1
               : cli_error("%s %s: unknown format, the name must end in %s", o->name, value, o->expected);
}

static int set_text(const cli_option *o, const char *value, const char **to) {
    if (o->name[0] != '-' && *to)
        return cli_error("%s: there is %s already, %s", value, o->expected, *to);
    *to = value;
    return 1;
}

static int set_option(void *settings, const cli_option *o, const char *value) {
    void *to = (char *)settings + o->to;
    if (o->set)
        return o->set(settings, o, value);
    switch (o->kind) {
    case CLI_KIND_FLAG:
        *(int *)to = 1;
        return 1;
    case CLI_KIND_TEXT:
    case CLI_KIND_INPUT:
        return set_text(o, value, to);
    case CLI_KIND_OUTPUT:
        return set_output(o, value, to);
    case CLI_KIND_CHOICE:
        return set_choice(o, value, to);
    case CLI_KIND_INTEGER:
        return set_integer(o, value, to);
    case CLI_KIND_FLOATS:
        return set_floats(o, value, to);
    case CLI_KIND_DOUBLE:
        return set_double(o, value, to);
    case CLI_KIND_SIZE:
        return set_size(o, value, to);
    case CLI_KIND_MEMORY:
        return set_memory(o, value, to);
    case CLI_KIND_AXES:
        return cli_axes_of(value, to) ? 1 : cli_bad_value(o, value, o->expected);
    case CLI_KIND_ISA:
        return set_isa(o, value, to);
    case CLI_KIND_OWN:
        break;
    }
    return 0;
}

/* ---- files -------------------------------------------------------------------------------------------------------- */

static int same_file(const char *a, const char *b) {
    struct stat x, y;
    return strcmp(a, b) == 0 || (stat(a, &x) == 0 && stat(b, &y) == 0 && x.st_dev == y.st_dev && x.st_ino == y.st_ino);
}

/* A file that can be written beside its temporary name. */
static int check_output(const char *name, const char *path) {
    const char *slash = strrchr(path, '/');
    size_t n = slash == path ? 1 : slash ? (size_t)(slash - path) : 0;
    struct stat info;
    char directory[4096];
    if (stat(path, &info) == 0 && !S_ISREG(info.st_mode))
        return cli_error("%s %s: not a regular file", name, path);
    if (n >= sizeof directory)
        return cli_error("%s %s: name too long", name, path);
    memcpy(directory, n ? path : ".", n ? n : 1);
    directory[n ? n : 1] = 0;
    if (access(directory, W_OK | X_OK) != 0)
        return cli_error("%s %s: its directory is %s", name, path,
                         stat(directory, &info) == 0 ? "not writable" : "missing");
    return 1;
}

static const char *const *files_of(const void *settings, const cli_option *o) {
    return (const char *const *)(const void *)((const char *)settings + o->to);
}

static int check_outputs(const void *settings) {
    const cli_option *options = program.options;
    for (int i = 0; i < program.count; ++i) {
        const char *name = options[i].name, *path = NULL, *other;
        if (options[i].kind == CLI_KIND_OUTPUT)
            path = *files_of(settings, options + i);
        if (!path)
            continue;
        if (!check_output(name, path))
            return 0;
        for (int k = 0; k < program.count; ++k) {
            const cli_option *o = options + k;
            if (o->kind == CLI_KIND_OUTPUT && k < i && (other = *files_of(settings, o)) && same_file(path, other))
                return cli_error("%s %s: the same file as %s", name, path, o->name);
            for (int m = 0; o->kind == CLI_KIND_INPUT && m < o->most; ++m) {
                char file[4096];
                other = files_of(settings, o)[m];
                if (other && image_spec_path(other, file, sizeof file) && same_file(path, file))
                    return cli_error("%s %s: would overwrite the input", name, path);
            }
        }
    }
    return 1;
}

/* ---- the command line --------------------------------------------------------------------------------------------- */

/* The option of this name, of `length` letters; otherwise, without a dash, the argument that has no name. */
static const cli_option *find_option(const char *name, size_t length) {
    for (int i = 0; i < program.count; ++i) {
        const cli_option *o = program.options + i;
        if (o->name[0] == '-' ? strlen(o->name) == length && memcmp(o->name, name, length) == 0 : name[0] != '-')
            return o;
    }
    return NULL;
}

/* An option where a value should be: a dash, and no number or axes. "-" alone is a name, and so is --option=-anything. */
static int is_option(const cli_option *o, const char *value) {
    char *end;
    if (value[0] != '-' || !value[1] || (o->kind == CLI_KIND_AXES && strchr("xyz", value[1])))
        return 0;
    (void)strtod(value, &end);
    return end == value;
}

int cli_parse(const cli_program *p, int argc, char **argv, void *settings, unsigned char *given) {
    program = *p;
    for (int i = 1; i < argc; ++i)
        if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0) {
            if (!p->quiet)
                print_help();
            return 0;
        }
    for (int i = 1; i < argc; ++i) {
        const char *name = argv[i], *value = name, *equals = strncmp(name, "--", 2) == 0 ? strchr(name, '=') : NULL;
        const cli_option *o = find_option(name, equals ? (size_t)(equals - name) : strlen(name));
        int ok = 1;
        if (!o) {
            ok = cli_error("%s: unknown option, see --help", name);
        } else if (name[0] == '-' && o->value) {
            value = equals ? equals + 1 : i + 1 < argc ? argv[++i] : NULL;
            if (!value || !value[0])
                ok = cli_error("%s: needs a value, %s", o->name, o->value);
            else if (!equals && is_option(o, value))
                ok = cli_error("%s: needs a value, got option %s", o->name, value);
        } else if (equals) {
            ok = cli_error("%s: takes no value", o->name);
        }
        if (!ok || !set_option(settings, o, value))
            return 2;
        given[o - p->options] = 1;
    }
    return check_outputs(settings) ? CLI_GO : 2;
}

/* ---- progress ----------------------------------------------------------------------------------------------------- */

void cli_progress_show(cli_progress *p, double part) {
    enum { WIDTH = 32 };
    static double drawn;
    double now = cli_seconds();
    char bar[WIDTH + 1];
    if (!p->running) {
        p->running = 1;
        p->started = now;
        p->first = part;
    }
    if (program.quiet || now - p->started < 1.0 || now - drawn < 0.2 || !isatty(STDERR_FILENO))
        return;
    for (int i = 0; i < WIDTH; ++i)
        bar[i] = i < (int)(WIDTH * part) ? '#' : '.';
    bar[WIDTH] = 0;
    fprintf(stderr, "\r%s: %s %3.0f %%  %s", program.name, bar, 100.0 * part, p->what);
    if (part - p->first > 0.01) { /* what was done before it began took it no time */
        double left = (now - p->started) * (1.0 - part) / (part - p->first);
        fprintf(stderr, "  %d:%02d:%02d left", (int)(left / 3600.0), (int)(left / 60.0) % 60, (int)left % 60);
    }
    fputs("\033[K", stderr);
    fflush(stderr);
    bar_shown = 1;
    drawn = now;
}

void cli_progress_end(void) {
    if (bar_shown)
        fputs("\r\033[K", stderr);
    bar_shown = 0;
}

/* ---- the machine -------------------------------------------------------------------------------------------------- */

int cli_processors(void) {
    long n = sysconf(_SC_NPROCESSORS_ONLN);
    return n < 1 ? 1 : n > 1024 ? 1024 : (int)n;
}

double cli_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static int compare_doubles(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double cli_median(double *values, int count) {
    qsort(values, (size_t)count, sizeof *values, compare_doubles);
    return count % 2 ? values[count / 2] : 0.5 * (values[count / 2 - 1] + values[count / 2]);
}
