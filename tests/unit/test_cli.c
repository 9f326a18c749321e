/* The command line that the tools share: every kind of value, its bounds and what is said of a bad one, arguments without
 * a name, and files that must not be written. */
#include "tool.h"

#include "examples/common/cli.h"
#include "gtao.h"

#include <math.h>
#include <sys/stat.h>

enum {
    OPT_FLAG,
    OPT_TEXT,
    OPT_IN,
    OPT_IMAGE,
    OPT_REPORT,
    OPT_CHOICE,
    OPT_INTEGER,
    OPT_NUMBERS,
    OPT_POSITIVE,
    OPT_DOUBLE,
    OPT_SIZE,
    OPT_MEMORY,
    OPT_AXES,
    OPT_ISA,
    OPT_LIST,
    OPT_PLACE,
    OPT_COUNT
};

typedef struct options {
    const char *text, *in, *image, *report, *place;
    int flag, choice, integer, size[2], isa, list[3], listed;
    float numbers[3], positive;
    double real, memory;
    cli_axes axes;
    unsigned char given[OPT_COUNT];
} options;

static const char *const colors[] = {"red", "green", "blue", NULL};

static int set_list(void *settings, const cli_option *option, const char *value) {
    options *o = settings;
    const char *at = value;
    o->listed = 0;
    do {
        int i = o->listed < 3 ? cli_next_choice(&at, colors) : -1;
        if (i < 0)
            return cli_bad_value(option, value, "colours");
        o->list[o->listed++] = i;
    } while (*at);
    return 1;
}

static const cli_option option_table[OPT_COUNT] = {
    [OPT_FLAG] = {"--flag", NULL, "a flag", CLI_FLAG(options, flag)},
    [OPT_TEXT] = {"--text", "TEXT", "", CLI_TEXT(options, text)},
    [OPT_IN] = {"--in", "FILE[:CHANNEL]", "", CLI_INPUT(options, in)},
    [OPT_IMAGE] = {"-o", "FILE", "", CLI_OUTPUT(options, image, ".exr or .png")},
    [OPT_REPORT] = {"--report", "FILE", "", CLI_OUTPUT(options, report, NULL)},
    [OPT_CHOICE] = {"--choice", "red|green|blue", "", CLI_CHOICE(options, choice, colors)},
    [OPT_INTEGER] = {"--integer", "N", "", CLI_INTEGER(options, integer, -3, 12, NULL)},
    [OPT_NUMBERS] = {"--numbers", "A,B[,C]", "", CLI_FLOATS(options, numbers, 2, 3, -CLI_FINITE, CLI_FINITE, "2 or 3"),
                     .not_0 = 1},
    [OPT_POSITIVE] = {"--positive", "X", "", CLI_FLOAT(options, positive, CLI_ABOVE_0, HUGE_VAL, "above 0")},
    [OPT_DOUBLE] = {"--double", "X", "", CLI_DOUBLE(options, real, 0, CLI_FINITE, "0 or more")},
    [OPT_SIZE] = {"--size", "WxH", "", CLI_SIZE(options, size, 4, 100, NULL)},
    [OPT_MEMORY] = {"--memory", "SIZE", "", CLI_MEMORY(options, memory)},
    [OPT_AXES] = {"--axes", "+x+y+z", "", CLI_AXES(options, axes, "axes")},
    [OPT_ISA] = {"--isa", "auto|...", "", CLI_ISA(options, isa)},
    [OPT_LIST] = {"--list", "COLOUR,...", "", CLI_OWN(set_list)},
    [OPT_PLACE] = {"PLACE", "", "where", CLI_TEXT(options, place), .expected = "a place"},
};

static const cli_program program = {"cli", "a test", "[options] [PLACE]", "The end.", option_table, OPT_COUNT, 0};

static options o;

/* The status for arguments, in which @ stands for the directory; what is said is in `message` and `printed`. */
static int parse(const char *arguments) {
    static char text[2048], name[] = "cli";
    char *argv[TOOL_MOST_WORDS];
    int argc = 1, saved[2];
    size_t n = 0;
    for (const char *c = arguments; *c; ++c)
        n += (size_t)snprintf(text + n, sizeof text - n, *c == '@' ? "%s" : "%.1s", *c == '@' ? directory : c);
    text[n] = 0;
    argv[0] = name;
    for (char *word = strtok(text, " "); word; word = strtok(NULL, " "))
        argv[argc++] = word;
    argv[argc] = NULL;
    memset(&o, 0, sizeof o);
    fflush(NULL);
    for (int i = 0; i < 2; ++i) {
        int file = open(in_directory(streams[i]), O_WRONLY | O_CREAT | O_TRUNC, 0666);
        saved[i] = dup(2 - i);
        assert_true(file >= 0 && saved[i] >= 0 && dup2(file, 2 - i) >= 0);
        close(file);
    }
    int status = cli_parse(&program, argc, argv, &o, o.given);
    fflush(NULL);
    for (int i = 0; i < 2; ++i) {
        dup2(saved[i], 2 - i);
        close(saved[i]);
    }
    read_text(streams[0], message, sizeof message);
    read_text(streams[1], printed, sizeof printed);
    return status;
}

static void parse_well(const char *arguments) {
    int status = parse(arguments);
    if (status != CLI_GO || message[0])
        fail_msg("%s: status %d, %s", arguments, status, message);
}

static void parse_badly(const char *arguments, const char *whole) {
    char expected[700];
    int status = parse(arguments);
    snprintf(expected, sizeof expected, "cli: %s\n", whole);
    if (status != 2)
        fail_msg("%s: status %d", arguments, status);
    assert_string_equal(message, expected);
}

static int setup(void **state) {
    (void)state;
    return make_directory("cli");
}

static int teardown(void **state) {
    (void)state;
    return remove_directory();
}

static void values_arrive(void **state) {
    (void)state;
    parse_well("");
    for (int i = 0; i < OPT_COUNT; ++i)
        assert_int_equal(o.given[i], 0);
    parse_well("--flag --text=a=b --choice blue --integer -3 --numbers 1.5,-2 --positive inf --double 1e300 here");
    assert_true(o.flag == 1 && o.choice == 2 && o.integer == -3 && isinf(o.positive) && o.given[OPT_PLACE]);
    assert_true(o.numbers[0] == 1.5f && o.numbers[1] == -2.0f && o.numbers[2] == 0.0f);
    assert_true(o.real > 0.9e300 && !o.given[OPT_SIZE] && o.given[OPT_FLAG]);
    assert_string_equal(o.text, "a=b");
    assert_string_equal(o.place, "here");
    parse_well("--size 64x100 --memory 1.5k --axes -z+x-y --isa scalar --list blue,red --numbers 1,2,3 --numbers 4,5");
    assert_true(o.size[0] == 64 && o.size[1] == 100 && o.memory == 1536.0 && o.isa == GTAO_ISA_SCALAR);
    assert_true(o.axes.axis[0] == 2 && o.axes.axis[1] == 0 && o.axes.axis[2] == 1);
    assert_true(o.axes.sign[0] == -1.0f && o.axes.sign[1] == 1.0f && o.axes.sign[2] == -1.0f);
    assert_true(o.listed == 2 && o.list[0] == 2 && o.list[1] == 0);
    assert_true(o.numbers[1] == 5.0f && o.numbers[2] == 0.0f); /* the last one counts, and all of it */
    parse_well("--numbers -.5,-1e3 --report=-o --text -");
    assert_true(o.numbers[0] == -0.5f && o.numbers[1] == -1000.0f);
    assert_string_equal(o.report, "-o");
    assert_string_equal(o.text, "-");
    parse_well("--size 4,5 --memory 2T --isa auto --positive 1e-45");
    assert_true(o.size[1] == 5 && o.memory == 2199023255552.0 && o.isa == GTAO_ISA_AUTO && o.positive > 0.0f);
}

static void bad_values_are_named(void **state) {
    (void)state;
    static const char *const bad[][2] = {
        {"--nothing", "--nothing: unknown option, see --help"},
        {"-x", "-x: unknown option, see --help"},
        {"--text", "--text: needs a value, TEXT"},
        {"--text=", "--text: needs a value, TEXT"},
        {"--text --flag", "--text: needs a value, got option --flag"},
        {"--report -o a.exr", "--report: needs a value, got option -o"},
        {"-o -x.exr", "-o: needs a value, got option -x.exr"},
        {"--integer -o", "--integer: needs a value, got option -o"},
        {"--numbers --double 1", "--numbers: needs a value, got option --double"},
        {"--axes -o", "--axes: needs a value, got option -o"},
        {"--numbers -inf,1", "--numbers -inf,1: must be 2 or 3"},
        {"--flag=1", "--flag: takes no value"},
        {"here there", "there: there is a place already, here"},
        {"--choice Red", "--choice Red: must be red|green|blue"},
        {"--integer 13", "--integer 13: must be an integer, -3..12"},
        {"--integer 1.0", "--integer 1.0: must be an integer, -3..12"},
        {"--integer 99999999999999999999", "--integer 99999999999999999999: must be an integer, -3..12"},
        {"--numbers 1", "--numbers 1: must be 2 or 3"},
        {"--numbers 1,2,3,4", "--numbers 1,2,3,4: must be 2 or 3"},
        {"--numbers 1,0", "--numbers 1,0: must be 2 or 3"},
        {"--numbers 1,inf", "--numbers 1,inf: must be 2 or 3"},
        {"--numbers 1,1e39", "--numbers 1,1e39: must be 2 or 3"},
        {"--numbers 1,,2", "--numbers 1,,2: must be 2 or 3"},
        {"--positive 0", "--positive 0: must be above 0"},
        {"--positive nan", "--positive nan: must be above 0"},
        {"--positive 1e-60", "--positive 1e-60: must be above 0"},
        {"--double -1", "--double -1: must be 0 or more"},
        {"--double inf", "--double inf: must be 0 or more"},
        {"--size 4x", "--size 4x: must be WIDTHxHEIGHT, 4..100 each"},
        {"--size 4x101", "--size 4x101: must be WIDTHxHEIGHT, 4..100 each"},
        {"--size 10", "--size 10: must be WIDTHxHEIGHT, 4..100 each"},
        {"--memory 0", "--memory 0: must be a size such as 512M or 2G"},
        {"--memory M", "--memory M: must be a size such as 512M or 2G"},
        {"--memory 1MB", "--memory 1MB: must be a size such as 512M or 2G"},
        {"--axes +x+y+y", "--axes +x+y+y: must be axes"},
        {"--isa other", "--isa other: must be auto|..."},
        {"--list red,", "--list red,: must be colours"},
        {"--list red,grey", "--list red,grey: must be colours"},
        {"--list red,red,red,red", "--list red,red,red,red: must be colours"},
        {"-o a.jpg", "-o a.jpg: unknown format, the name must end in .exr or .png"},
        {"-o exr", "-o exr: unknown format, the name must end in .exr or .png"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i)
        parse_badly(bad[i][0], bad[i][1]);
}

static void outputs_are_checked(void **state) {
    (void)state;
    char expected[600];
    write_text("a.exr", "");
    assert_int_equal(mkdir(in_directory("d.png"), 0777), 0);
    assert_int_equal(link(in_directory("a.exr"), in_directory("b.exr")), 0);
    static const char *const bad[][2] = {
        {"-o @/d.png", "-o %s/d.png: not a regular file"},
        {"-o @/none/a.EXR", "-o %s/none/a.EXR: its directory is missing"},
        {"-o @/new.exr --report @/new.exr", "--report %s/new.exr: the same file as -o"},
        {"-o @/a.exr --report @/b.exr", "--report %s/b.exr: the same file as -o"},
        {"--in @/a.exr:Z -o @/a.exr", "-o %s/a.exr: would overwrite the input"},
        {"--report @/b.exr --in @/a.exr", "--report %s/b.exr: would overwrite the input"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
        const char *at = strstr(bad[i][1], "%s");
        snprintf(expected, sizeof expected, "%.*s%s%s", (int)(at - bad[i][1]), bad[i][1], directory, at + 2);
        parse_badly(bad[i][0], expected);
    }
    parse_well("--in @/a.exr -o @/new.png --report @/b.txt");
    parse_well("-o @/none/a.exr -o @/a.exr --report @/none/b -o x.exr --report y"); /* only the last is written */
    remove_file("a.exr");
    remove_file("b.exr");
    assert_int_equal(rmdir(in_directory("d.png")), 0);
}

static void help_lists_everything(void **state) {
    (void)state;
    assert_int_equal(parse("--nothing --help"), 0);
    assert_string_equal(message, "");
    assert_non_null(strstr(printed, "cli - a test\n\nusage: cli [options] [PLACE]\n\n"));
    assert_non_null(strstr(printed, "\n\nThe end.\n"));
    for (int i = 0; i < OPT_COUNT; ++i) {
        char row[64];
        snprintf(row, sizeof row, "\n  %s ", option_table[i].name);
        assert_non_null(strstr(printed, row));
    }
    assert_int_equal(parse("-h"), 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_arrive),
        cmocka_unit_test(bad_values_are_named),
        cmocka_unit_test(outputs_are_checked),
        cmocka_unit_test(help_lists_everything),
    };
    return cmocka_run_group_tests_name("cli", tests, setup, teardown);
}
