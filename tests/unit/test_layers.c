/* build/layers as a user meets it: depth layers of small meshes, and what it says to bad input. */
#include "tool.h"

#include "examples/common/image.h"

#include <math.h>

enum { SIZE = 40 };

static int setup(void **state) {
    (void)state;
    return make_directory("layers");
}

static int teardown(void **state) {
    static const char *const names[] = {"mesh.obj", "out.exr", "ao.pfm"};
    (void)state;
    for (size_t i = 0; i < sizeof names / sizeof *names; ++i)
        remove_file(names[i]);
    return remove_directory();
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
    image img;
    image_error error;
    if (!image_read_channels(in_directory("out.exr"), names, count, &img, &error))
        fail_msg("%s", error.text);
    return img;
}

#define GOOD "@/mesh.obj --size 40x40 --fov-y 40 --eye 0,0,10 --target 0,0,0 --layers 3 -o @/out.exr"

static void test_layers(void **state) {
    static const double expected[7] = {6, 8, -1, 9, 9, 10, 11};
    (void)state;
    write_mesh();
    run_well(GOOD);
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
    char command[1100];
    (void)state;
    write_mesh();
    run_well(GOOD);
    snprintf(command, sizeof command, "build/%s --radius 2 -o @/ao.pfm", strtok(printed, "\n"));
    if (finish(start(command, 0)) != 0)
        fail_msg("%s: %s", command, message);
    run_well("@/mesh.obj --size 40x40 --eye 0,0,2.5 --target 0,0,0 -o @/out.exr");
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
    (void)state;
    write_mesh();
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i)
        run_badly(bad[i].words, bad[i].says);
    for (size_t i = 0; i < sizeof meshes / sizeof *meshes; ++i) {
        write_text("mesh.obj", meshes[i].text);
        run_badly("@/mesh.obj -o @/none.exr", meshes[i].says);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_layers), cmocka_unit_test(test_command),
                                       cmocka_unit_test(test_errors)};
    return cmocka_run_group_tests_name("layers", tests, setup, teardown);
}
