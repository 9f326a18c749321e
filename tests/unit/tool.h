/* What the suites of the command-line tools share: a directory of the suite's own, files in it, and the tool as a child
 * process, as a user meets it. Include once, in the suite's file. */
#ifndef TESTS_TOOL_H
#define TESTS_TOOL_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <dirent.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "examples/common/image.h"

enum { TOOL_MOST_WORDS = 64 };

static const char *tool;                                   /* run() runs build/TOOL */
static char directory[256];                                /* the suite's */
static char message[4096], printed[65536];                 /* of the last run: its standard error and output */
static const char *const streams[] = {"stderr", "stdout"}; /* where it writes them, in the directory */

/* ---- files -------------------------------------------------------------------------------------------------------- */

/* Valid until 16 calls later. */
static inline const char *in_directory(const char *name) {
    static char path[16][600];
    static int next;
    char *p = path[next++ % 16];
    snprintf(p, sizeof path[0], "%s/%s", directory, name);
    return p;
}

static inline int exists(const char *name) {
    return access(in_directory(name), F_OK) == 0;
}

static inline void remove_file(const char *name) {
    unlink(in_directory(name));
}

static inline int make_directory(const char *name) {
    const char *base = getenv("TMPDIR");
    tool = name;
    snprintf(directory, sizeof directory, "%s/gtao-%s-XXXXXX", base && base[0] && strlen(base) < 200 ? base : "/tmp",
             name);
    return mkdtemp(directory) ? 0 : -1;
}

/* Fails if the tests left anything in it. */
static inline int remove_directory(void) {
    for (int i = 0; i < 2; ++i)
        remove_file(streams[i]);
    return rmdir(directory);
}

/* A directory in it, with all that it holds; nothing if there is none. */
static inline void remove_tree(const char *name) {
    char path[300];
    DIR *dir = opendir(in_directory(name));
    for (struct dirent *e; dir && (e = readdir(dir)) != NULL;) {
        if (strcmp(e->d_name, ".") == 0 || strcmp(e->d_name, "..") == 0)
            continue;
        snprintf(path, sizeof path, "%.150s/%.140s", name, e->d_name);
        if (unlink(in_directory(path)) != 0)
            remove_tree(path);
    }
    if (dir)
        closedir(dir);
    rmdir(in_directory(name));
}

/* A whole file and a zero after it; the caller frees it. */
static inline uint8_t *read_bytes(const char *name, size_t *size) {
    FILE *file = fopen(in_directory(name), "rb");
    assert_non_null(file);
    assert_int_equal(fseek(file, 0, SEEK_END), 0);
    long length = ftell(file);
    assert_true(length >= 0);
    rewind(file);
    uint8_t *bytes = malloc((size_t)length + 1);
    assert_non_null(bytes);
    *size = fread(bytes, 1, (size_t)length, file);
    assert_int_equal(*size, length);
    bytes[*size] = 0;
    fclose(file);
    return bytes;
}

static inline void write_bytes(const char *name, const void *bytes, size_t size) {
    FILE *file = fopen(in_directory(name), "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

static inline void write_text(const char *name, const char *text) {
    write_bytes(name, text, strlen(text));
}

/* Empty where there is no file. */
static inline void read_text(const char *name, char *text, size_t size) {
    FILE *file = fopen(in_directory(name), "rb");
    size_t n = file ? fread(text, 1, size - 1, file) : 0;
    text[n] = 0;
    if (file)
        fclose(file);
}

/* A number from JSON text, NaN where there is no such key. */
static inline double number_in(const char *text, const char *key) {
    char quoted[64];
    snprintf(quoted, sizeof quoted, "\"%s\": ", key);
    const char *at = strstr(text, quoted);
    return at ? strtod(at + strlen(quoted), NULL) : strtod("nan", NULL);
}

/* ---- the tool ----------------------------------------------------------------------------------------------------- */

/* Starts the words of `command`, in which @ stands for the directory, in at most `limit` bytes of address space (0: any). */
static inline pid_t start(const char *command, size_t limit) {
    static char words[8192];
    char *argv[TOOL_MOST_WORDS + 1];
    size_t n = 0, used = 0;
    for (const char *c = command; *c;) {
        c += strspn(c, " ");
        size_t length = strcspn(c, " ");
        if (!length)
            break;
        assert_true(n < TOOL_MOST_WORDS);
        argv[n++] = words + used;
        for (; length; --length, ++c) {
            assert_true(used + sizeof directory + 2 < sizeof words);
            if (*c == '@')
                used += (size_t)sprintf(words + used, "%s", directory);
            else
                words[used++] = *c;
        }
        words[used++] = 0;
    }
    argv[n] = NULL;
    fflush(NULL);
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        int err = open(in_directory(streams[0]), O_WRONLY | O_CREAT | O_TRUNC, 0666);
        int out = open(in_directory(streams[1]), O_WRONLY | O_CREAT | O_TRUNC, 0666);
        struct rlimit most = {limit, limit};
        if (err < 0 || out < 0 || dup2(err, 2) < 0 || dup2(out, 1) < 0 || (limit && setrlimit(RLIMIT_AS, &most) != 0))
            _exit(100);
        execvp(argv[0], argv);
        _exit(101);
    }
    return child;
}

/* The exit status, or -1. */
static inline int finish(pid_t child) {
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    read_text(streams[0], message, sizeof message);
    read_text(streams[1], printed, sizeof printed);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static inline int run(const char *arguments) {
    char command[4096];
    assert_true(snprintf(command, sizeof command, "build/%s %s", tool, arguments) < (int)sizeof command);
    return finish(start(command, 0));
}

static inline void run_well(const char *arguments) {
    int status = run(arguments);
    if (status != 0 || message[0])
        fail_msg("%s %s: exit status %d, %s", tool, arguments, status, message);
}

/* Names in the directory but for the two streams, and a number that changes when one of them does. */
static inline size_t names_in_directory(void) {
    DIR *d = opendir(directory);
    size_t sum = 0;
    assert_non_null(d);
    for (struct dirent *e; (e = readdir(d)) != NULL;) {
        size_t hash = 5381;
        for (const char *c = e->d_name; *c; ++c)
            hash = 33 * hash + (unsigned char)*c;
        if (strcmp(e->d_name, streams[0]) != 0 && strcmp(e->d_name, streams[1]) != 0)
            sum += hash * hash; /* in any order */
    }
    closedir(d);
    return sum;
}

/* Exit status 2; one line, which begins with the tool's name and names the culprit; no file more or less. */
static inline void run_badly(const char *arguments, const char *culprit) {
    size_t before = names_in_directory(), length = strlen(tool);
    int status = run(arguments);
    const char *end = strchr(message, '\n');
    if (status != 2)
        fail_msg("%s %s: exit status %d, %s", tool, arguments, status, message);
    if (!end || end[1])
        fail_msg("%s %s: not one line: %s", tool, arguments, message);
    if (strncmp(message, tool, length) != 0 || strncmp(message + length, ": ", 2) != 0 || !strstr(message, culprit))
        fail_msg("%s %s: does not name %s: %s", tool, arguments, culprit, message);
    if (names_in_directory() != before)
        fail_msg("%s %s: wrote or removed a file", tool, arguments);
}

/* An image into the test's directory. */
static inline void save_image(const char *name, const image *img, const char *const *names) {
    image_pending pending;
    image_error error;
    if (!image_write(in_directory(name), img, names, IMAGE_RANGE_UNIT, &pending, &error) ||
        !image_commit(&pending, &error))
        fail_msg("%s", error.text);
}

#endif
