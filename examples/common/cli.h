/* cli.h - what the command-line programs share: options from a table, messages, help, a progress bar, time, medians.
 *
 * An option is one row of a table: its name, what --help says of it, the kind of its value, and where in the program's
 * settings that goes. cli_parse() does the rest, including the checks of files that will be written. A mistake is said
 * in one line on standard error, which begins with the program's name and the option's; the exit status is then 2. */
#ifndef EXAMPLES_CLI_H
#define EXAMPLES_CLI_H

#include <stddef.h>

typedef enum cli_kind {
    CLI_KIND_FLAG,    /* int, set to 1; an option without a value */
    CLI_KIND_TEXT,    /* const char * */
    CLI_KIND_INPUT,   /* const char *: FILE[:CHANNEL]; no output may be the same file */
    CLI_KIND_OUTPUT,  /* const char *: FILE; `expected` lists the endings it may have, null: any */
    CLI_KIND_CHOICE,  /* int: the index in `names` */
    CLI_KIND_INTEGER, /* int */
    CLI_KIND_FLOATS,  /* float [most]: "a,b,c", at least `least`, the rest 0. Infinity is spelled inf */
    CLI_KIND_DOUBLE,  /* double */
    CLI_KIND_SIZE,    /* int [2]: "1280x720", or a comma between */
    CLI_KIND_MEMORY,  /* double, bytes: 512M, 1.5g; bytes without a letter */
    CLI_KIND_AXES,    /* cli_axes */
    CLI_KIND_ISA,     /* int: a gtao_isa that this machine has */
    CLI_KIND_OWN      /* only `set` knows */
} cli_kind;

/* "+x-z+y": three signed axes, each once. */
typedef struct cli_axes {
    signed char axis[3]; /* 0..2 */
    float sign[3];
} cli_axes;

typedef struct cli_option cli_option;
struct cli_option {
    const char *name, *value, *help; /* value: what stands for it in --help; null: a flag. A name without a leading dash
                                      * is an argument that has none, such as MESH.obj; it is given once */
    cli_kind kind;
    size_t to; /* where in the settings */
    int least, most;
    double lowest, highest;   /* what numbers may be; HUGE_VAL includes infinity */
    const char *expected;     /* "must be ..."; null: from the kind and its bounds */
    const char *const *names; /* ended by a null */
    int not_0;
    int (*set)(void *settings, const cli_option *option, const char *value); /* instead; 0 after an error */
};

/* The kind and place of a row: CLI_FLOAT(options, radius, 0, HUGE_VAL, "a number, 0 or more"). Does not compile where
 * the member's type is another. CLI_OWN: only the function knows. */
#define CLI_TO(type, s, m) .to = offsetof(s, m) + 0 * sizeof(1 ? (type *)0 : &((s *)0)->m)
#define CLI_FLAG(s, m) .kind = CLI_KIND_FLAG, CLI_TO(int, s, m)
#define CLI_TEXT(s, m) .kind = CLI_KIND_TEXT, CLI_TO(const char *, s, m)
#define CLI_INPUT(s, m) .kind = CLI_KIND_INPUT, CLI_TO(const char *, s, m), .most = 1
#define CLI_INPUTS(s, m, count, function)                                                                              \
    .kind = CLI_KIND_INPUT, CLI_TO(const char *, s, m[0]), .most = (count), .set = (function)
#define CLI_OUTPUT(s, m, endings) .kind = CLI_KIND_OUTPUT, CLI_TO(const char *, s, m), .expected = (endings)
#define CLI_CHOICE(s, m, choices) .kind = CLI_KIND_CHOICE, CLI_TO(int, s, m), .names = (choices)
#define CLI_INTEGER(s, m, low, high, text)                                                                             \
    .kind = CLI_KIND_INTEGER, CLI_TO(int, s, m), .lowest = (low), .highest = (high), .expected = (text)
#define CLI_FLOATS(s, m, fewest, count, low, high, text)                                                               \
    .kind = CLI_KIND_FLOATS, CLI_TO(float, s, m[0]), .least = (fewest), .most = (count), .lowest = (low),              \
    .highest = (high), .expected = (text)
#define CLI_FLOAT(s, m, low, high, text)                                                                               \
    .kind = CLI_KIND_FLOATS, CLI_TO(float, s, m), .least = 1, .most = 1, .lowest = (low), .highest = (high),           \
    .expected = (text)
#define CLI_DOUBLE(s, m, low, high, text)                                                                              \
    .kind = CLI_KIND_DOUBLE, CLI_TO(double, s, m), .lowest = (low), .highest = (high), .expected = (text)
#define CLI_SIZE(s, m, low, high, text)                                                                                \
    .kind = CLI_KIND_SIZE, CLI_TO(int, s, m[0]), .lowest = (low), .highest = (high), .expected = (text)
#define CLI_MEMORY(s, m) .kind = CLI_KIND_MEMORY, CLI_TO(double, s, m)
#define CLI_AXES(s, m, text) .kind = CLI_KIND_AXES, CLI_TO(cli_axes, s, m), .expected = (text)
#define CLI_ISA(s, m) .kind = CLI_KIND_ISA, CLI_TO(int, s, m)
#define CLI_OWN(function) .kind = CLI_KIND_OWN, .set = (function)

#define CLI_THREADS(s, m) CLI_INTEGER(s, m, 1, 1024, NULL)
#define CLI_ABOVE_0 1e-45  /* as a lower bound of floats: below the smallest of them */
#define CLI_FINITE 1.7e308 /* as an upper bound */

typedef struct cli_program {
    const char *name, *about, *usage, *notes; /* usage: what follows the name. notes: the end of --help, or null */
    const cli_option *options;
    int count;
    int quiet; /* say nothing, ever */
} cli_program;

enum { CLI_GO = -1 };

/* Reads the command line into `settings`, which hold the defaults; given[i] tells whether option i was there. Then checks
 * the files to write: they and their directories can be written, no two are the same, and none is read. The exit status
 * if there is nothing more to do: 0 after --help, 2 after an error; otherwise CLI_GO. The program is remembered, in a copy. */
int cli_parse(const cli_program *program, int argc, char **argv, void *settings, unsigned char *given);

/* One line after the program's name; a bar goes first. Returns 0. */
int cli_error(const char *format, ...);
/* "OPTION VALUE: must be EXPECTED". Returns 0. */
int cli_bad_value(const cli_option *option, const char *value, const char *expected);

/* A bar on a terminal, once the work has taken a second: how much is done, and how long the rest will take. */
typedef struct cli_progress {
    const char *what; /* is done */
    double started, first;
    int running;
} cli_progress;

void cli_progress_show(cli_progress *p, double part); /* p zeroed at first, part 0..1 */
void cli_progress_end(void);                          /* wipes whatever is shown */

/* The whole text must be the number; false otherwise and for NaN. */
int cli_number(const char *text, double *value);
int cli_integer(const char *text, long lowest, long highest, long *value);
/* "a,b,c": at least `lowest` and at most `highest` numbers that fit a float; how many, or 0. */
int cli_numbers(const char *text, int lowest, int highest, float *values);
int cli_axes_of(const char *text, cli_axes *axes);
/* Index of `text` in `names`, which a null ends; or -1. */
int cli_choice(const char *text, const char *const *names);
/* The same for the first of a list with commas; *text moves on to the next, the end or, after -1, nowhere. */
int cli_next_choice(const char **text, const char *const *names);

int cli_processors(void);

double cli_seconds(void);                     /* monotonic */
double cli_median(double *values, int count); /* sorts them */

#endif
