/* port - the stages of gtao.h as compute shaders (examples/shaders), to compare with the library's. `port --help`.
 *
 * It reads what build/ao --dump writes, or has it written first, and writes a dump with the same files. */
#include "stages.h"

#include "cli.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

enum { PATH_SIZE = 4096, NO_DRIVER = 3 };

typedef struct options {
    const char *from, *to, *defines, *shaders, *sources;
    int isolated;
} options;

static const cli_option option_table[] = {
    {.name = "--from",
     .value = "DUMP",
     .help = "a dump of build/ao: its input, constants and tables",
     CLI_TEXT(options, from)},
    {.name = "--dump", .value = "DIR", .help = "where to write the shaders' dump", CLI_TEXT(options, to)},
    {.name = "--isolated",
     .help = "each stage reads what the library's stages before it wrote; otherwise what the shaders wrote",
     CLI_FLAG(options, isolated)},
    {.name = "--define",
     .value = "LIST",
     .help = "compile the shaders anew with these: \"HALF=1\", \"MISTAKE=7\", spaces between",
     CLI_TEXT(options, defines)},
    {.name = "--shaders",
     .value = "DIR",
     .help = "compiled shaders (shaders beside this program)",
     CLI_TEXT(options, shaders)},
    {.name = "--sources",
     .value = "DIR",
     .help = "their sources, for --define (examples/shaders)",
     CLI_TEXT(options, sources)},
};

static const cli_program program = {
    .name = "port",
    .about = "the stages of gtao.h as compute shaders, on the input of build/ao",
    .usage = "--from DUMP --dump DIR [options]\n       port --dump DIR [options] -- OPTIONS OF AO",
    .notes = "Exit status 3: there is no Vulkan driver. build/diff compares two dumps.\n"
             "Behind -- stand the input and settings as build/ao takes them, without -o and --dump.\n"
             "Thickness maps, --back and --layer: the heights of backs are taken from the dump.",
    .options = option_table,
    .count = sizeof option_table / sizeof *option_table,
};

/* The directory of this program. */
static void beside(const char *name, char *path, size_t size) {
    char self[PATH_SIZE];
    ssize_t n = readlink("/proc/self/exe", self, sizeof self - 1);
    self[n > 0 ? n : 0] = 0;
    char *slash = strrchr(self, '/');
    if (slash)
        *slash = 0;
    snprintf(path, size, "%.3000s%s%s", slash ? self : "build", name[0] ? "/" : "", name);
}

/* ---- build/ao ---------------------------------------------------------------------------------------------------- */

/* Runs it with `count` options of its own, into `directory`/dump. */
static int run_ao(char **args, int count, const char *directory) {
    char ao[PATH_SIZE], dump_path[PATH_SIZE], output[PATH_SIZE];
    const char **all = malloc(sizeof *all * (size_t)(count + 6));
    int n = 0, status = 0, sequence = 0;
    if (!all)
        return cli_error("not enough memory");
    beside("ao", ao, sizeof ao);
    snprintf(dump_path, sizeof dump_path, "%.4000s/dump", directory);
    all[n++] = ao;
    for (int i = 0; i < count; ++i) {
        all[n++] = args[i];
        sequence |= strncmp(args[i], "--sequence", 10) == 0;
    }
    snprintf(output, sizeof output, "%.4000s/visibility%s.exr", directory, sequence ? "%04d" : "");
    all[n++] = "--dump";
    all[n++] = dump_path;
    all[n++] = "-o";
    all[n++] = output;
    all[n] = NULL;
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        execv(ao, (char *const *)(uintptr_t)all);
        _exit(127);
    }
    free(all);
    if (child < 0 || waitpid(child, &status, 0) < 0 || !WIFEXITED(status) || WEXITSTATUS(status) == 127)
        return cli_error("%s: cannot be run", ao);
    return WEXITSTATUS(status) == 0; /* it has said why */
}

/* What run_ao wrote: files, and directories of files, two deep. */
static void remove_all(const char *path, int depth) {
    DIR *dir = opendir(path);
    for (const struct dirent *e; dir && (e = readdir(dir)) != NULL;) {
        char name[PATH_SIZE];
        if (strcmp(e->d_name, ".") == 0 || strcmp(e->d_name, "..") == 0)
            continue;
        snprintf(name, sizeof name, "%.3000s/%.255s", path, e->d_name);
        if (unlink(name) != 0 && depth > 0)
            remove_all(name, depth - 1);
    }
    if (dir)
        closedir(dir);
    rmdir(path);
}

/* ---- frames ------------------------------------------------------------------------------------------------------ */

static int by_name(const void *a, const void *b) {
    return strcmp(a, b);
}

enum { FRAME_SIZE = 64 };

/* Names of the frames of a sequence's dump, in order; one empty name if it is none. */
static char (*list_frames(const char *directory, int *count))[FRAME_SIZE] {
    char(*names)[FRAME_SIZE] = calloc(1, sizeof *names), path[PATH_SIZE];
    struct stat info;
    int room = 1;
    *count = names ? 1 : 0;
    snprintf(path, sizeof path, "%.4000s/settings.json", directory);
    if (!names || stat(path, &info) == 0)
        return names;
    DIR *dir = opendir(directory);
    for (const struct dirent *e; dir && (e = readdir(dir)) != NULL;) {
        size_t n = strlen(e->d_name);
        if (n >= FRAME_SIZE || strspn(e->d_name, "0123456789") != n)
            continue;
        *count += names[0][0] != 0;
        if (*count > room) {
            char(*more)[FRAME_SIZE] = realloc(names, sizeof *names * (size_t)(room *= 2));
            if (!more)
                break;
            names = more;
        }
        memcpy(names[*count - 1], e->d_name, n + 1);
    }
    if (dir)
        closedir(dir);
    qsort(names, (size_t)*count, sizeof *names, by_name);
    return names;
}

static int run_frames(const options *o, gpu *g, shaders *s, const char *from, dump *d, image_error *error) {
    int count, ok;
    char(*names)[FRAME_SIZE] = list_frames(from, &count), path[PATH_SIZE + FRAME_SIZE];
    frame *before = NULL;
    ok = names != NULL;
    if (!ok)
        snprintf(error->text, sizeof error->text, "%.200s: not enough memory", from);
    for (int i = 0; ok && i < count; ++i) {
        snprintf(path, sizeof path, "%.4000s%s%s", from, names[i][0] ? "/" : "", names[i]);
        frame *f = frame_open(g, path, error);
        ok = f && (!names[i][0] || dump_frame(d, names[i], error)) && frame_run(f, s, before, o->isolated, error) &&
             frame_write(f, d, error);
        frame_close(before);
        before = f;
    }
    frame_close(before);
    free(names);
    return ok;
}

static int run(const options *o, char **ao, int ao_count) {
    char temporary[PATH_SIZE], made[PATH_SIZE], compiled[PATH_SIZE], sources[PATH_SIZE];
    const char *base = getenv("TMPDIR"), *from = o->from;
    gpu_error why;
    image_error error;
    gpu *g = gpu_create(&why);
    if (!g) {
        cli_error("%s", why.text);
        return NO_DRIVER;
    }
    temporary[0] = 0;
    int ok = 1;
    if (!from) {
        snprintf(temporary, sizeof temporary, "%.3000s/gtao-port-XXXXXX", base && base[0] ? base : "/tmp");
        if (!mkdtemp(temporary)) {
            ok = cli_error("%s: cannot be created", temporary);
            temporary[0] = 0;
        }
        ok = ok && run_ao(ao, ao_count, temporary);
        snprintf(made, sizeof made, "%.4000s/dump", temporary);
        from = made;
    }
    if (ok) {
        beside("shaders", compiled, sizeof compiled);
        beside("../examples/shaders", sources, sizeof sources);
        shaders *s = shaders_open(g, o->shaders ? o->shaders : compiled, o->sources ? o->sources : sources,
                                  o->defines ? o->defines : "", &error);
        dump *d = s ? dump_create(o->to, &error) : NULL;
        ok = d && run_frames(o, g, s, from, d, &error);
        if (ok)
            ok = dump_commit(d, &error);
        else
            dump_discard(d);
        if (!ok)
            cli_error("%s", error.text);
        shaders_close(s);
    }
    if (temporary[0])
        remove_all(temporary, 2);
    gpu_destroy(g);
    return ok ? 0 : 2;
}

int main(int argc, char **argv) {
    options o;
    unsigned char given[sizeof option_table / sizeof *option_table];
    int own = 1;
    memset(&o, 0, sizeof o);
    while (own < argc && strcmp(argv[own], "--") != 0)
        ++own;
    int status = cli_parse(&program, own, argv, &o, given);
    if (status != CLI_GO)
        return status;
    if (!o.to)
        status = cli_error("--dump: required, see --help");
    else if (!o.from && own == argc)
        status = cli_error("--from, or options of ao behind --: one of them is required");
    else if (o.from && own < argc)
        status = cli_error("--from: not together with options of ao");
    else
        return run(&o, argv + own + 1, argc - own - 1);
    return 2;
}
