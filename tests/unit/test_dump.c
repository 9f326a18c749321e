/* What lies between the stages: build/ao --dump writes it, build/replay computes it once more with code of its own,
 * build/diff tells them apart; and the planes of gtao_output themselves. */
#include "tool.h"

#include "examples/common/image.h"
#include "gtao.h"
#include "gtso.h"

#include <math.h>
#include <sys/stat.h>

enum { WIDTH = 93, HEIGHT = 65, PIXELS = WIDTH * HEIGHT };

static float z[PIXELS], n[3 * PIXELS]; /* the scene, normals in the library's axes */

static void save(const char *name, const float *data, int width, int height, int channels, const char *const *names) {
    image img;
    image_pending pending;
    image_error error;
    assert_true(image_create(&img, width, height, channels, &error));
    memcpy(img.data, data, sizeof *data * (size_t)(width * height * channels));
    if (!image_write(in_directory(name), &img, names, IMAGE_RANGE_UNIT, &pending, &error) ||
        !image_commit(&pending, &error))
        fail_msg("%s", error.text);
    image_free(&img);
}

/* A floor that rises into the distance, a ball on it, thin posts before it, and sky above; at the left edge a wall. */
static int setup(void **state) {
    static const char *const names_z[] = {"Z"}, *const names_n[] = {"N.X", "N.Y", "N.Z"};
    float heights[PIXELS], hills[PIXELS], distance[PIXELS];
    (void)state;
    for (int i = 0; i < PIXELS; ++i) {
        float x = ((float)(i % WIDTH) + 0.5f - 0.5f * WIDTH) / 70.0f;
        float y = ((float)(i / WIDTH) + 0.5f - 0.5f * HEIGHT) / 70.0f;
        float rr = x * x + y * y + 1.0f, rc = 3.0f, disc = rc * rc - rr * (9.0f - 0.36f);
        float *normal = n + 3 * i;
        z[i] = 2.2f / (0.8f * y + 0.6f); /* 0.8 y + 0.6 z = 2.2 */
        normal[0] = 0.0f, normal[1] = -0.8f, normal[2] = -0.6f;
        if (disc > 0.0f) {
            z[i] = (rc - sqrtf(disc)) / rr;
            normal[0] = x * z[i] / 0.6f, normal[1] = y * z[i] / 0.6f, normal[2] = (z[i] - 3.0f) / 0.6f;
        } else if (y < -0.35f) {
            z[i] = 1e10f;
        }
        if (i % WIDTH % 23 == 11 && y > -0.2f)
            z[i] = 2.113f, normal[0] = normal[1] = 0.0f, normal[2] = -1.0f;
        if (i % WIDTH < 3)
            z[i] = 2.437f, normal[0] = 0.6f, normal[1] = 0.0f, normal[2] = -0.8f;
        distance[i] = z[i] * sqrtf(rr);
        hills[i] = 3.0f * sinf(0.11f * (float)(i % WIDTH)) * cosf(0.13f * (float)(i / WIDTH));
        heights[i] = 0.8f * sinf(0.37f * (float)(i % WIDTH)) * cosf(0.23f * (float)(i / WIDTH)) +
                     (i % 7 == 0 ? 1.3f : 0.0f) + 0.07f * sinf(0.0013f * (float)i * (float)i);
    }
    if (make_directory("ao") != 0)
        return -1;
    save("z.exr", z, WIDTH, HEIGHT, 1, names_z);
    save("d.exr", distance, WIDTH, HEIGHT, 1, names_z);
    save("n.exr", n, WIDTH, HEIGHT, 3, names_n);
    save("h.exr", heights, WIDTH, HEIGHT, 1, names_z);
    save("g.exr", hills, WIDTH, HEIGHT, 1, names_z);
    return 0;
}

/* A dump, or a sequence of them. */
static void remove_dump(const char *name) {
    char path[300];
    DIR *dir = opendir(in_directory(name));
    if (!dir)
        return;
    for (struct dirent *e; (e = readdir(dir)) != NULL;) {
        snprintf(path, sizeof path, "%s/%s", name, e->d_name);
        if (strcmp(e->d_name, ".") == 0 || strcmp(e->d_name, "..") == 0)
            continue;
        if (unlink(in_directory(path)) != 0)
            remove_dump(path);
    }
    closedir(dir);
    rmdir(in_directory(name));
}

static int teardown(void **state) {
    static const char *const names[] = {"g.exr", "z.exr",   "d.exr",   "n.exr",   "h.exr",  "v.exr",
                                        "w.exr", "z.0.exr", "z.1.exr", "v.0.exr", "v.1.exr"};
    static const char *const dumps[] = {"a", "b", "half", "replayed", "heat"};
    (void)state;
    for (size_t i = 0; i < sizeof names / sizeof *names; ++i)
        remove_file(names[i]);
    for (size_t i = 0; i < sizeof dumps / sizeof *dumps; ++i)
        remove_dump(dumps[i]);
    return remove_directory();
}

static int run_tool(const char *name, const char *arguments) {
    const char *before = tool;
    tool = name;
    int status = run(arguments);
    tool = before;
    return status;
}

static void run_tool_well(const char *name, const char *arguments, int expected) {
    int status = run_tool(name, arguments);
    if (status != expected)
        fail_msg("%s %s: exit status %d, %s%s", name, arguments, status, message, printed);
}

#define CAMERA "--depth @/z.exr --normal @/n.exr --focal 70 --radius 0.7 -o @/v.exr "

/* ---- the dump ------------------------------------------------------------------------------------------------------ */

static int has(const char *dump, const char *file) {
    char path[200];
    snprintf(path, sizeof path, "%s/%s", dump, file);
    return exists(path);
}

/* The results are the same with a dump as without, and the dump is the same whatever the kernel and the threads. */
static void test_same_bits(void **state) {
    static const char *const settings[] = {"",
                                           "--falloff 0.4 --noise none --border clamp",
                                           "--noise hilbert --slices 3",
                                           "--thickness 0.2 --falloff 0.3",
                                           "--steps 0 --noise none --thickness 0.1",
                                           "--half --denoise 2",
                                           "--estimator memo --thin-blend 0.1 --border wrap"};
    static const char *const isas[] = {"scalar", "sse2", "avx2", "avx512", "neon"};
    (void)state;
    for (size_t i = 0; i < sizeof settings / sizeof *settings; ++i) {
        char line[400];
        snprintf(line, sizeof line, CAMERA "%s", settings[i]);
        run_well(line);
        assert_int_equal(rename(in_directory("v.exr"), in_directory("w.exr")), 0);
        snprintf(line, sizeof line, CAMERA "--dump @/a --isa scalar --threads 1 %s", settings[i]);
        run_well(line);
        run_tool_well("diff", "@/w.exr @/v.exr --quiet", 0);
        assert_true(has("a", "settings.json") && has("a", "horizons.exr") && has("a", "result.exr"));
        assert_int_equal(has("a", "arcs.exr"), strstr(settings[i], "--thickness") != NULL);
        assert_int_equal(has("a", "samples.exr"), strstr(settings[i], "hilbert") == NULL);
        assert_int_equal(has("a", "spatial2.exr"), strstr(settings[i], "--denoise 2") != NULL);
        for (int isa = GTAO_ISA_SSE2; isa <= GTAO_ISA_NEON; ++isa) {
            if (!gtao_isa_available((gtao_isa)isa))
                continue;
            snprintf(line, sizeof line, CAMERA "--dump @/b --isa %s --threads 3 %s", isas[isa - 1], settings[i]);
            run_well(line);
            run_tool_well("diff", "@/a @/b --quiet", 0);
            remove_dump("b");
        }
        remove_dump("a");
    }
}

static void test_sequence(void **state) {
    uint8_t *bytes;
    size_t size;
    (void)state;
    bytes = read_bytes("z.exr", &size);
    write_bytes("z.0.exr", bytes, size);
    write_bytes("z.1.exr", bytes, size);
    free(bytes);
    run_well("--sequence @/z.%d.exr --focal 70 --radius 0.7 -o @/v.%d.exr --dump @/a");
    assert_true(has("a", "0000/temporal.exr") && has("a", "0001/temporal.exr") && has("a", "0001/settings.json"));
    run_tool_well("diff", "@/a @/a", 0);
    assert_non_null(strstr(printed, "0001/temporal.deviation"));
    run_tool_well("diff", "@/a/0000 @/a/0001 --only settings,reduce,noise", 1);
    assert_non_null(strstr(printed, "settings.fresh")); /* a history */
    assert_non_null(strstr(printed, "first difference: settings.frame"));
    remove_dump("a");
}

/* Nothing is left behind, and what is there is left alone. */
static void test_bad_dumps(void **state) {
    (void)state;
    assert_int_equal(mkdir(in_directory("a"), 0777), 0);
    run_well(CAMERA "--dump @/a/"); /* empty: taken */
    run_badly(CAMERA "--dump @/a", "--dump");
    run_badly(CAMERA "--dump @/z.exr", "exists already");
    run_badly(CAMERA "--dump @/no/where", "cannot create");
    run_badly(CAMERA "--dump @/b --repeat 2", "--repeat");
    remove_file("v.exr");
    run_badly("--depth @/no.exr --focal 70 -o @/v.exr --dump @/b", "no.exr");
    remove_dump("a");
}

/* Tables: what is stored at a texel is what gtso_table_exact says of the point that the dump gives for it. */
static void test_lut(void **state) {
    static const char *const axes[] = {"aperture", "beta", "roughness"}, *const value[] = {"table"};
    gtso_table_desc table;
    image points, texels;
    image_error error;
    (void)state;
    memset(&table, 0, sizeof table);
    table.size[0] = 9, table.size[1] = 8, table.size[2] = 10;
    run_tool_well("lut", "--size 9,8,10 --dump @/a", 0);
    assert_true(image_read_channels(in_directory("a/points.exr"), axes, 3, &points, &error));
    assert_true(image_read_channels(in_directory("a/table.exr"), value, 1, &texels, &error));
    assert_true(points.width == 9 && points.height == 80 && texels.width == 9 && texels.height == 80);
    for (int i = 0; i < 9 * 80; i += 37) {
        gtso_point p = {points.data[3 * i], points.data[3 * i + 1], points.data[3 * i + 2], 0.0f, 0.0f};
        assert_true(fabsf(gtso_table_exact(&table, &p) - texels.data[i]) < 2e-4f);
    }
    image_free(&points);
    image_free(&texels);
    remove_dump("a");
}

/* A sweep: the dump's visibility is the file's, with the dump and without, and its horizons are those of the march. */
static void test_bake(void **state) {
    static const char line[] = "--height @/g.exr --pixel-size 0.5 --directions 5";
    char arguments[400];
    (void)state;
    snprintf(arguments, sizeof arguments, "%s -o @/w.exr", line);
    run_tool_well("bake", arguments, 0);
    snprintf(arguments, sizeof arguments, "%s -o @/v.exr --dump @/b", line);
    run_tool_well("bake", arguments, 0);
    run_tool_well("diff", "@/w.exr @/v.exr", 0);
    run_well("--depth @/g.exr --depth-kind height --ortho 0.5 --radius inf --slices 5 --steps 0 --noise none"
             " -o @/v.exr --dump @/a");
    run_tool_well("diff",
                  "@/a @/b --partial --only input,height,horizons,result --tolerance horizons=0.02"
                  " --tolerance result=0.02 --outliers 0.08",
                  0);
    remove_dump("a");
    remove_dump("b");
    tool = "bake";
    snprintf(arguments, sizeof arguments, "%s -o @/v.exr --tile 30 --dump @/b", line);
    run_badly(arguments, "--dump");
    tool = "ao";
}

/* ---- diff ---------------------------------------------------------------------------------------------------------- */

static void test_diff_of_images(void **state) {
    static const char *const names[] = {"Y"};
    float a[PIXELS], b[PIXELS];
    (void)state;
    for (int i = 0; i < PIXELS; ++i)
        a[i] = b[i] = (float)i / PIXELS;
    for (int i = 0; i < 100; ++i)
        b[10 * i] += 0.001f * (float)(i + 1);
    a[7] = b[7] = NAN, a[8] = b[8] = INFINITY;
    save("v.exr", a, WIDTH, HEIGHT, 1, names);
    save("w.exr", b, WIDTH, HEIGHT, 1, names);
    run_tool_well("diff", "@/v.exr @/v.exr", 0);
    assert_non_null(strstr(printed, "equal"));
    run_tool_well("diff", "@/v.exr @/w.exr", 1);
    {
        double most, rmse, p[4];
        int x, y;
        const char *line = strchr(printed, '\n');
        assert_int_equal(sscanf(line, " Y %lf %lf %lf %lf %lf %lf %d,%d", &most, &rmse, p, p + 1, p + 2, p + 3, &x, &y),
                         8);
        assert_true(fabs(most - 0.1) < 1e-6 && x == 990 % WIDTH && y == 990 / WIDTH);
        /* sum i^2 = 100 101 201 / 6 */
        assert_true(fabs(rmse - 1e-3 * sqrt(338350.0 / PIXELS)) < 1e-5);
        /* 100 of 6045 differ: ranks 5743, 5985, 6039 of the sorted are the 0th, 40th, 94th of them */
        assert_true(p[0] < 1e-9 && p[1] < 1e-9 && fabs(p[2] - 0.040) < 2e-4 && fabs(p[3] - 0.094) < 2e-4);
    }
    run_tool_well("diff", "@/v.exr @/w.exr --tolerance 0.1001", 0);
    run_tool_well("diff", "@/v.exr @/w.exr --tolerance 0.09", 1);
    run_tool_well("diff", "@/v.exr @/w.exr --tolerance 0.09 --outliers 0.002", 0);
    b[9] = NAN;
    save("w.exr", b, WIDTH, HEIGHT, 1, names);
    run_tool_well("diff", "@/v.exr @/w.exr --tolerance 0.2 --heat @/z.0.exr.png", 1);
    assert_non_null(strstr(printed, "(not finite)"));
    assert_true(exists("z.0.exr.png"));
    remove_file("z.0.exr.png");
}

static void test_bad_diffs(void **state) {
    static const char *const names[] = {"Y"};
    const float small[4] = {0, 0, 0, 0};
    const char *before = tool;
    (void)state;
    save("v.exr", z, WIDTH, HEIGHT, 1, names);
    save("w.exr", small, 2, 2, 1, names);
    tool = "diff";
    run_badly("@/v.exr", "A and B");
    run_badly("@/v.exr @/w.exr", "2 x 2");
    run_badly("@/v.exr @/no.exr", "no.exr");
    run_badly("@/v.exr @/", "directory");
    assert_int_equal(mkdir(in_directory("heat"), 0777), 0);
    run_badly("@/heat @/heat", "no stage");
    remove_dump("heat");
    run_badly("@/v.exr @/v.exr @/v.exr", "two already");
    run_badly("@/v.exr @/v.exr --tolerance -1", "--tolerance");
    run_badly("@/v.exr @/v.exr --tolerance raw=", "--tolerance");
    run_badly("@/v.exr @/v.exr --outliers 2", "--outliers");
    run_badly("@/v.exr @/v.exr --heat @/v.exr", "--heat");
    run_badly("@/v.exr @/v.exr --partial", "--partial");
    tool = before;
}

/* ---- a port -------------------------------------------------------------------------------------------------------- */

/* A port with code of its own agrees at every stage. Rounding decides here and there whether a sample is within the
 * radius, which of two slopes is the smoother, or which byte is the nearer. */
static void test_replay(void **state) {
    static const char *const settings[] = {
        "--depth @/z.exr --normal @/n.exr --focal 70 --radius 0.7",
        "--depth @/z.exr --focal 70,90 --center 40,30 --radius 0.5 --falloff 0.5 --slices 3 --steps 5 --frame 9",
        "--depth @/d.exr --depth-kind distance --normal @/n.exr --focal 70 --radius 0.7 --half --denoise 1",
        "--depth @/h.exr --depth-kind height --ortho 0.5 --radius 6 --border wrap --weighting uniform --denoise 1",
        "--depth @/h.exr --depth-kind height --ortho 0.5 --radius inf --border clamp --noise none --half --denoise 1",
        "--depth @/z.exr --depth-kind device --device-scale 0.3 --device-bias -0.4 --focal 70 --radius 0.7 --sky 40"};
    (void)state;
    for (size_t i = 0; i < sizeof settings / sizeof *settings; ++i) {
        char line[500];
        snprintf(line, sizeof line, "%s --dump @/a -o @/v.exr", settings[i]);
        run_well(line);
        run_tool_well("replay", "@/a -o @/replayed", 0);
        run_tool_well("diff",
                      "@/a @/replayed --partial --quiet --tolerance 3e-4 --outliers 0.004 --tolerance packed=1"
                      " --tolerance specular=0.01",
                      0);
        remove_dump("a");
        remove_dump("replayed");
    }
}

/* Each mistake that ports make is found in the stage where it is made. */
static void test_mistakes(void **state) {
    static char list[sizeof printed];
    char *line = list;
    int count = 0;
    (void)state;
    run_well(CAMERA "--denoise 1 --dump @/a");
    run_well(CAMERA "--denoise 1 --half --dump @/half");
    run_tool_well("replay", "--list", 0);
    memcpy(list, printed, sizeof list);
    while (line[0]) {
        char name[40], stage[40], arguments[200], found[80];
        int half, number;
        assert_int_equal(sscanf(line, "%d %39s %39s %d", &number, name, stage, &half), 4);
        snprintf(arguments, sizeof arguments, "@/%s -o @/replayed --mistake %s", half ? "half" : "a", name);
        run_tool_well("replay", arguments, 0);
        snprintf(arguments, sizeof arguments,
                 "@/%s @/replayed --partial --quiet --tolerance 3e-4 --outliers 0.004 --tolerance packed=0.5"
                 " --tolerance specular=0.01 --heat @/heat",
                 half ? "half" : "a");
        if (run_tool("diff", arguments) != 1)
            fail_msg("%s is not found: %s", name, printed);
        snprintf(found, sizeof found, "first difference: %s.", stage);
        if (!strstr(printed, found))
            fail_msg("%s is not found in %s but: %s", name, stage, printed);
        snprintf(found, sizeof found, "%s.png", stage);
        assert_true(has("heat", found));
        remove_dump("replayed");
        remove_dump("heat");
        line += strcspn(line, "\n") + 1;
        count++;
    }
    assert_true(count >= 25);
    remove_dump("a");
    remove_dump("half");
}

/* One stage in another language, from docs/porting.md alone. */
static void test_python(void **state) {
    (void)state;
    if (finish(start("python3 -c pass", 0)) != 0) {
        print_message("skipped: there is no python3\n");
        skip();
    }
    run_well(CAMERA "--falloff 0.3 --dump @/a");
    if (finish(start("python3 tests/port/stage.py @/a", 0)) != 0)
        fail_msg("%s%s", printed, message);
    print_message("%.500s", printed);
    remove_dump("a");
}

/* ---- the planes ---------------------------------------------------------------------------------------------------- */

static float *floats(size_t count) {
    float *p = calloc(count, sizeof *p);
    assert_non_null(p);
    return p;
}

/* A wall, endless along y and up to a height, before a plain: its horizon is known in every direction. What
 * gtso_horizon_visibility makes of the horizons of gtao_output is what it makes of these. */
static void test_horizons_to_specular(void **state) {
    enum { SIZE = 96, SLICES = 16, AT = 40, WALL = 60 };
    const float up[3] = {0, 0, -1}, tilted[3] = {0.6f, 0, -0.8f};
    const double height = 12.0;
    float *depth = floats(SIZE * SIZE), *horizons = floats(2 * SLICES * SIZE * SIZE);
    gtao_desc desc;
    gtao_output output;
    gtao_context *context;
    gtso_slice fed[SLICES], known[SLICES];
    void *scratch;
    (void)state;
    for (int i = 0; i < SIZE * SIZE; ++i)
        depth[i] = i % SIZE >= WALL ? (float)height : 0.0f;
    memset(&desc, 0, sizeof desc);
    memset(&output, 0, sizeof output);
    desc.width = desc.height = SIZE;
    desc.depth = depth, desc.depth_kind = GTAO_DEPTH_HEIGHT;
    desc.camera.projection = GTAO_ORTHOGRAPHIC, desc.camera.sx = 1.0f;
    desc.radius = INFINITY, desc.border = GTAO_BORDER_CLAMP;
    desc.slices = SLICES, desc.every_pixel = 1, desc.noise = GTAO_NOISE_NONE;
    output.horizons = horizons;
    assert_int_equal(gtao_desc_slices(&desc), SLICES);
    scratch = malloc(gtao_scratch_size(&desc));
    assert_int_equal(gtao_begin(&desc, &output, scratch, gtao_scratch_size(&desc), &context), GTAO_OK);
    gtao_prepare_rows(context, 0, SIZE);
    gtao_visibility_rows(context, 0, SIZE, NULL);
    for (int k = 0; k < SLICES; ++k) {
        size_t at = AT * SIZE + AT, plane = SIZE * SIZE;
        double angle = 3.14159265358979 * (k + 0.5) / SLICES, along = cos(angle), distance = WALL - AT;
        float v[3];
        gtao_context_slice(context, AT, AT, k, fed[k].direction, v);
        assert_true(fabs((double)fed[k].direction[0] - along) < 1e-6 && fabsf(v[2] + 1.0f) < 1e-6f);
        fed[k].h1_rad = horizons[2 * (size_t)k * plane + at];
        fed[k].h0_rad = -horizons[(2 * (size_t)k + 1) * plane + at];
        known[k] = fed[k];
        known[k].h1_rad = (float)atan2(1.0, along > 0.0 ? height / distance * along : 0.0);
        known[k].h0_rad = -(float)atan2(1.0, along < 0.0 ? height / distance * -along : 0.0);
        /* The edge is between pixels; slices along the wall reach it only outside the image. */
        if (fabs(along) > 0.4)
            assert_true(fabsf(fed[k].h1_rad - known[k].h1_rad) < 0.02f &&
                        fabsf(fed[k].h0_rad - known[k].h0_rad) < 0.02f);
    }
    for (int i = 1; i < 6; ++i) {
        float roughness = 0.15f * (float)i;
        float a = gtso_horizon_visibility(up, up, fed, SLICES, roughness, 0.04f, NULL, NULL);
        float b = gtso_horizon_visibility(up, up, known, SLICES, roughness, 0.04f, NULL, NULL);
        assert_true(fabsf(a - b) < 0.02f && a > 0.5f);
        a = gtso_horizon_visibility(tilted, up, fed, SLICES, roughness, 0.04f, NULL, NULL);
        b = gtso_horizon_visibility(tilted, up, known, SLICES, roughness, 0.04f, NULL, NULL);
        assert_true(fabsf(a - b) < 0.02f && a < 0.9f); /* it reflects the wall */
    }
    free(depth);
    free(horizons);
    free(scratch);
}

/* Strides, guards, and what is refused. Planes are written at every pixel and nowhere else. */
static void test_planes(void **state) {
    enum { W = 37, H = 9, PITCH = 45, SLICES = 3 };
    const size_t plane = PITCH * (H + 1), guard = 77;
    const float mark = -12345.0f;
    float depth[W * H], *all = floats(2 * guard + plane * 6), visibility[W * H];
    gtao_desc desc;
    gtao_output output;
    size_t size;
    void *scratch;
    (void)state;
    for (int i = 0; i < W * H; ++i)
        depth[i] = i % 11 == 3 ? INFINITY : 2.0f + 0.1f * (float)(i % 5);
    memset(&desc, 0, sizeof desc);
    desc.width = W, desc.height = H, desc.depth = depth, desc.slices = SLICES;
    desc.camera = gtao_camera_from_fov(70.0f, W, H);
    desc.radius = 0.3f;
    size = gtao_scratch_size(&desc);
    scratch = malloc(size);
    for (int isa = GTAO_ISA_SCALAR; isa <= GTAO_ISA_NEON; ++isa) {
        if (!gtao_isa_available((gtao_isa)isa))
            continue;
        desc.isa = (gtao_isa)isa;
        memset(&output, 0, sizeof output);
        for (size_t i = 0; i < 2 * guard + plane * 6; ++i)
            all[i] = mark;
        output.horizons = all + guard;
        output.horizon_stride = PITCH * 4, output.horizon_plane = (ptrdiff_t)plane * 4;
        assert_int_equal(gtao_compute(&desc, &output, scratch, size, NULL), GTAO_OK); /* horizons alone are enough */
        for (size_t i = 0; i < 2 * guard + plane * 6; ++i) {
            size_t at = i - guard, x = at % plane % PITCH, y = at % plane / PITCH;
            int inside = i >= guard && at < plane * 6 && x < W && y < H;
            assert_true(inside ? all[i] > 0.0f && all[i] < 3.1416f : all[i] <= mark);
            if (inside && (y * W + x) % 11 == 3)
                assert_true(fabsf(all[i] - 1.5707963f) < 1e-6f);
        }
    }
    memset(&output, 0, sizeof output);
    output.visibility = visibility, output.surface = all;
    output.horizon_stride = 4;
    assert_int_equal(gtao_compute(&desc, &output, scratch, size, NULL), GTAO_ERROR_HORIZONS);
    output.horizon_stride = 0, output.horizon_plane = 4;
    assert_int_equal(gtao_compute(&desc, &output, scratch, size, NULL), GTAO_ERROR_HORIZONS);
    output.horizon_plane = 0;
    assert_int_equal(gtao_sweep_scratch_size(&desc, &output, NULL), 0);
    free(scratch);
    free(all);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_same_bits), cmocka_unit_test(test_sequence), cmocka_unit_test(test_bad_dumps),
        cmocka_unit_test(test_lut),       cmocka_unit_test(test_bake),     cmocka_unit_test(test_diff_of_images),
        cmocka_unit_test(test_bad_diffs), cmocka_unit_test(test_replay),   cmocka_unit_test(test_mistakes),
        cmocka_unit_test(test_python),    cmocka_unit_test(test_planes),   cmocka_unit_test(test_horizons_to_specular),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
