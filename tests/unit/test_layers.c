/* build/layers as a user meets it: depth layers of small meshes, and what it says to bad input. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "examples/common/image.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

enum { SIZE = 40 };

static char directory[200];

/* Runs a program with @ for the directory; its exit status. The last line it said is in `said`. */
static int run(const char *words, char said[512]) {
    char command[2048], at[300];
    size_t n = 0;
    for (const char *c = words; *c && n + sizeof directory < sizeof command; ++c)
        n += (size_t)snprintf(command + n, sizeof command - n, *c == '@' ? "%s" : "%.1s", *c == '@' ? directory : c);
    snprintf(at, sizeof at, "%s/said", directory);
    snprintf(command + n, sizeof command - n, " > %s 2>&1", at);
    int status = system(command);
    FILE *file = fopen(at, "r");
    size_t got = file ? fread(said, 1, 511, file) : 0;
    said[got] = '\0';
    if (file)
        fclose(file);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static void write_text(const char *name, const char *text) {
    char path[300];
    snprintf(path, sizeof path, "%s/%s", directory, name);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
}

static int setup(void **state) {
    const char *base = getenv("TMPDIR");
    (void)state;
    snprintf(directory, sizeof directory, "%s/gtao-layers-XXXXXX",
             base && base[0] && strlen(base) < 150 ? base : "/tmp");
    return mkdtemp(directory) ? 0 : -1;
}

static int teardown(void **state) {
    static const char *const names[] = {"mesh.obj", "said", "out.exr", "ao.pfm"};
    char path[300];
    (void)state;
    for (size_t i = 0; i < sizeof names / sizeof *names; ++i) {
        snprintf(path, sizeof path, "%s/%s", directory, names[i]);
        unlink(path);
    }
    return rmdir(directory); /* fails if anything else was left behind */
}

/* Seen from z = 10 down the z axis, near to far: a box from 4 to 3 (view depth 6 to 7), another that overlaps it from 3.5
 * to 2 (to 8) and is turned inside by nothing, a sheet at 1 (9), a box from 0 to -1 (10 to 11). All cover the centre; the
 * first box is narrow. */
static int add_box(char *text, int size, int first, double half, double z0, double z1) {
    int n = 0;
    for (int i = 0; i < 8; ++i)
        n += snprintf(text + n, (size_t)(size - n), "v %g %g %g\n", i & 1 ? half : -half, i & 2 ? half : -half,
                      i & 4 ? z1 : z0);
    static const int quads[6][4] = {{4, 5, 7, 6}, {1, 0, 2, 3}, {5, 1, 3, 7}, {0, 4, 6, 2}, {6, 7, 3, 2}, {0, 1, 5, 4}};
    for (int q = 0; q < 6; ++q)
        n += snprintf(text + n, (size_t)(size - n), "f %d/1/1 %d %d//3 %d\n", first + quads[q][0], first + quads[q][1],
                      first + quads[q][2], first + quads[q][3]);
    return n;
}

static void write_mesh(void) {
    char text[4096];
    int n = 0;
    n += add_box(text + n, (int)sizeof text - n, 1, 0.5, 3, 4);
    n += add_box(text + n, (int)sizeof text - n, 9, 1, 2, 3.5);
    n += snprintf(text + n, sizeof text - (size_t)n, "v -2 -2 1\nv 2 -2 1\nv 0 3 1\nf -3 -2 -1\n");
    n += add_box(text + n, (int)sizeof text - n, 20, 2, -1, 0);
    assert_true(n < (int)sizeof text - 1);
    write_text("mesh.obj", text);
}

static image read_layers(int count) {
    static const char *const names[] = {"Z", "ZBack", "N.Z", "layer2.Z", "layer2.ZBack", "layer3.Z", "layer3.ZBack"};
    char path[300];
    image img;
    image_error error;
    snprintf(path, sizeof path, "%s/out.exr", directory);
    if (!image_read_channels(path, names, count, &img, &error))
        fail_msg("%s", error.text);
    return img;
}

static const char *const camera = "--size 40x40 --fov-y 40 --eye 0,0,10 --target 0,0,0 ";

static void test_layers(void **state) {
    char said[512], command[512];
    static const double expected[7] = {6, 8, -1, 9, 9, 10, 11};
    (void)state;
    write_mesh();
    snprintf(command, sizeof command, "build/layers @/mesh.obj %s --layers 3 -o @/out.exr", camera);
    assert_int_equal(run(command, said), 0);
    image img = read_layers(7);
    const float *centre = img.data + 7 * (size_t)(SIZE / 2 * SIZE + SIZE / 2);
    for (int c = 0; c < 7; ++c)
        if (!(fabs((double)centre[c] - expected[c]) <= 1e-5))
            fail_msg("channel %d: %g, expected %g", c, (double)centre[c], expected[c]);
    const float *corner = img.data;
    assert_true(corner[0] >= 1e9f && corner[1] >= 1e9f && corner[3] >= 1e9f);
    /* beside the first box the second begins the first layer: 0.75 at depth 6.5 */
    int x = (int)(SIZE / 2 + 0.75 / 6.5 * (SIZE / 2 / tan(20 * 3.14159265358979 / 180)));
    const float *beside = img.data + 7 * (size_t)(SIZE / 2 * SIZE + x);
    assert_true(fabsf(beside[0] - 6.5f) < 1e-5f && fabsf(beside[1] - 8) < 1e-5f);
    /* every pixel that is covered is covered once: no crack and no double along shared edges */
    for (int i = 0; i < SIZE * SIZE; ++i) {
        const float *p = img.data + 7 * (size_t)i;
        float end = 0;
        for (int k = 0; k < 3; ++k) {
            const float *z = k ? p + 1 + 2 * k : p;
            if (z[0] >= 1e9f)
                break;
            assert_true(z[0] > end && z[1] >= z[0]);
            end = z[1];
        }
        float u = ((float)(i % SIZE) + 0.5f - 20) / (20 / tanf(0.34906585f)),
              v = ((float)(i / SIZE) + 0.5f - 20) / (20 / tanf(0.34906585f));
        if (fabsf(u) < 0.0769f && fabsf(v) < 0.0769f) /* the first box's face */
            assert_true(fabsf(p[0] - 6) < 1e-5f && p[1] > 7.9f);
    }
    image_free(&img);
}

/* What it prints runs, and a camera within the mesh needs no clipping. */
static void test_command(void **state) {
    char said[512], command[1100], printed[512];
    (void)state;
    write_mesh();
    snprintf(command, sizeof command, "build/layers @/mesh.obj %s --layers 3 -o @/out.exr", camera);
    assert_int_equal(run(command, printed), 0);
    printed[strcspn(printed, "\n")] = '\0';
    snprintf(command, sizeof command, "build/%s --radius 2 -o @/ao.pfm", printed);
    if (run(command, said) != 0)
        fail_msg("%s: %s", printed, said);
    snprintf(command, sizeof command, "build/layers @/mesh.obj --size 40x40 --eye 0,0,2.5 --target 0,0,0 -o @/out.exr");
    assert_int_equal(run(command, said), 0);
    image img = read_layers(2);
    const float *centre = img.data + 2 * (size_t)(SIZE / 2 * SIZE + SIZE / 2);
    assert_true(fabsf(centre[0] - 0.5f) < 1e-5f); /* the face through which one leaves the second box */
    image_free(&img);
}

static void test_errors(void **state) {
    static const struct {
        const char *words, *says;
    } bad[] = {{"", "no mesh"},
               {"@/mesh.obj", "-o: missing"},
               {"@/mesh.obj -o @/out.png", "must end in .exr"},
               {"@/none.obj -o @/out.exr", "cannot be opened"},
               {"@/mesh.obj @/mesh.obj -o @/out.exr", "a mesh already"},
               {"@/mesh.obj -o", "-o: "},
               {"@/mesh.obj --depth 3 -o @/out.exr", "--depth: unknown option"},
               {"@/mesh.obj --size 10 -o @/out.exr", "--size 10: must be"},
               {"@/mesh.obj --size 0x10 -o @/out.exr", "--size 0x10: must be"},
               {"@/mesh.obj --layers 10 -o @/out.exr", "--layers 10: must be"},
               {"@/mesh.obj --fov-y 180 -o @/out.exr", "--fov-y 180: must be"},
               {"@/mesh.obj --eye 1,2 -o @/out.exr", "--eye 1,2: must be"},
               {"@/mesh.obj --eye 1,2,3 --target 1,2,3 -o @/out.exr", "looks nowhere"},
               {"@/mesh.obj --eye 0,9,0 --target 0,0,0 -o @/out.exr", "along up"}};
    static const struct {
        const char *text, *says;
    } meshes[] = {{"v 1 2\n", "line 1: a vertex"},
                  {"v 1 2 nan\n", "line 1: a vertex"},
                  {"v 0 0 0\nf 1 2 3\n", "no vertex 2"},
                  {"v 0 0 0\nf 1 1 -2\n", "no vertex -2"},
                  {"v 0 0 0\n", "no faces"}};
    char said[512], command[600], path[300];
    (void)state;
    write_mesh();
    snprintf(path, sizeof path, "%s/out.exr", directory);
    unlink(path);
    for (size_t i = 0; i < sizeof bad / sizeof *bad + sizeof meshes / sizeof *meshes; ++i) {
        size_t k = i - sizeof bad / sizeof *bad;
        bool file = i >= sizeof bad / sizeof *bad;
        if (file)
            write_text("mesh.obj", meshes[k].text);
        snprintf(command, sizeof command, "build/layers %s", file ? "@/mesh.obj -o @/out.exr" : bad[i].words);
        int status = run(command, said);
        const char *says = file ? meshes[k].says : bad[i].says;
        if (status != 2 || !strstr(said, says) || strncmp(said, "layers: ", 8) != 0 ||
            strchr(said, '\n') != said + strlen(said) - 1)
            fail_msg("%s: status %d, said: %s, not: %s", command, status, said, says);
        if (access(path, F_OK) == 0)
            fail_msg("%s: left a file", command);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_layers), cmocka_unit_test(test_command),
                                       cmocka_unit_test(test_errors)};
    return cmocka_run_group_tests_name("layers", tests, setup, teardown);
}
