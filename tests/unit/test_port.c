/* The shaders of examples/shaders against the C, stage by stage: build/ao writes what lies between its stages,
 * build/port runs each shader on what the C wrote before that stage, and every channel is compared. Without a Vulkan
 * driver, or without build/port, all of it is skipped. */
#include "tool.h"

#include "examples/common/dump.h"
#include "examples/common/image.h"
#include "gtao.h"

#include <math.h>

static char why_not[200]; /* shaders cannot run */
static int halves = 1;    /* half precision can */

/* ---- scenes ------------------------------------------------------------------------------------------------------ */

enum { CROP_W = 200, CROP_H = 120 };

static const char *const names_z[] = {"Z"}, *const names_n[] = {"N.X", "N.Y", "N.Z"};

/* Pixels from (x0, y0) on of an image in memory, which is freed. */
static void crop(image *img, int x0, int y0, const char *name) {
    image part;
    image_error error;
    size_t c = (size_t)img->channels;
    assert_true(image_create(&part, CROP_W, CROP_H, img->channels, &error));
    for (size_t y = 0; y < CROP_H; ++y)
        memcpy(part.data + y * CROP_W * c, img->data + (((size_t)y0 + y) * (size_t)img->width + (size_t)x0) * c,
               CROP_W * c * sizeof(float));
    save_image(name, &part, c == 3 ? names_n : names_z);
    image_free(&part);
    image_free(img);
}

static void crop_file(const char *path, int x0, int y0, const char *depth, const char *normals) {
    image img;
    image_error error;
    assert_true(image_read_depth(path, &img, &error));
    crop(&img, x0, y0, depth);
    if (normals) {
        assert_true(image_read_normals(path, &img, &error));
        crop(&img, x0, y0, normals);
    }
}

/* A ball in front of a tilted floor that ends in the sky, as distances along the rays, what is behind it: its back, and a
 * fence with a back of its own; and heights: grooves, a pit with upright walls, a spire. */
static void write_analytic(void) {
    image img;
    image_error error;
    assert_true(image_create(&img, 101, 67, 1, &error));
    for (int i = 0; i < 101 * 67; ++i) {
        float x = ((float)(i % 101) + 0.5f - 50.5f) / 80.0f, y = ((float)(i / 101) + 0.5f - 33.5f) / 80.0f;
        float rr = x * x + y * y + 1.0f, disc = 9.0f - rr * (9.0f - 0.49f), z = 2.2f / (0.8f * y + 0.6f);
        if (disc > 0.0f)
            z = (3.0f - sqrtf(disc)) / rr;
        else if (y < -0.3f)
            z = 1e10f;
        img.data[i] = z * sqrtf(rr);
    }
    save_image("ball.exr", &img, names_z);
    for (int i = 0; i < 101 * 67; ++i)
        img.data[i] += i % 101 < 50 ? 0.2f : 0.7f;
    save_image("back.exr", &img, names_z);
    for (int i = 0; i < 2 * 101 * 67; ++i) {
        img.data[i % (101 * 67)] = i % 7 < 3 ? (i < 101 * 67 ? 3.4f : 3.5f) : 1e10f;
        if (i == 101 * 67 - 1)
            save_image("fence.exr", &img, names_z);
    }
    save_image("fence.back.exr", &img, names_z);
    for (int i = 0; i < 101 * 67; ++i) {
        float x = (float)(i % 101), y = (float)(i / 101), dx = x - 60.0f, dy = y - 30.0f, r = sqrtf(dx * dx + dy * dy);
        float h = fabsf(fmodf(0.31f * x + 0.12f * y, 8.0f) - 4.0f);
        h = r < 16.0f ? -9.0f : h;
        img.data[i] = r < 3.0f ? 7.0f : h;
    }
    save_image("pit.exr", &img, names_z);
    image_free(&img);
}

#define STUDY                                                                                                          \
    "--depth @/study.exr --normal @/study.n.exr --normal-axes +x-y-z --normal-to-view "                                \
    "0.954480,-0.298275,0,0.058173,0.186153,0.980797,-0.292547,-0.936151,0.195031 --focal 656.0972 --center 100,80 "
#define COURT "--depth @/court.exr --focal 532.5694 --center 20,100 "
#define SCANS "--depth @/scans.exr --focal 577.2953 --center 120,60 "
#define TERRAIN "--depth @/terrain.exr --depth-kind height --ortho 92 "
#define BALL "--depth @/ball.exr --depth-kind distance --focal 80 "
#define PIT "--depth @/pit.exr --depth-kind height --ortho 1 "

static const struct scene {
    const char *name, *options;
} scenes[] = {
    {"study, normals, falloff, 3 slices", STUDY "--radius 0.6 --slices 3 --falloff 0.25"},
    {"courtyard, derived normals, thickness, falloff", COURT "--radius 1 --slices 2 --thickness 0.2 --falloff 0.4"},
    {"terrain, uniform weighting, wrapping border, 4 slices",
     TERRAIN "--radius 3000 --slices 4 --steps 8 --falloff 0.3 --weighting uniform --border wrap"},
    {"ball, every pixel, noise of each pixel", BALL "--radius 0.8 --steps 0 --slices 2 --noise hilbert"},
    {"ball, backs and a layer behind",
     BALL "--radius 0.8 --slices 2 --falloff 0.3 --thickness 0.1 --back @/back.exr --layer @/fence.exr "
          "--back @/fence.back.exr"},
    {"ball, a layer of which backs are not known",
     BALL "--radius 0.8 --slices 1 --back @/back.exr --layer @/fence.exr --thickness 0.2"},
    {"pit, every pixel, thickness, clamped border, no bound",
     PIT "--radius inf --max-radius-px 30 --steps 0 --slices 3 --noise none --thickness 4 --border clamp"},
    {"scans, half resolution, two passes", SCANS "--radius 0.4 --slices 1 --steps 8 --half --denoise 2"},
    {"pit, half resolution, thickness, orthographic",
     PIT "--radius 12 --half --denoise 1 --thickness 3 --noise hilbert"},
    {"study, the memo's estimator, thickness heuristic", STUDY "--radius 0.6 --estimator memo --thin-blend 0.2"},
    {"study, four frames, a moving camera", "--sequence @/seq.%04d.exr --camera @/camera.txt --focal 656.0972 --center "
                                            "100,80 --radius 0.6 --half --preset low"},
};
enum { SCENES = sizeof scenes / sizeof *scenes, FRAMES = 4 };

/* ---- comparing --------------------------------------------------------------------------------------------------- */

/* How far a shader's channel may be from the C's: |a - b| <= tolerance max(1, |a|) but for `outliers` of the pixels,
 * where one of the two lies on the other side of a comparison. The first that the channel's name starts with counts. */
typedef struct bound {
    const char *channel;
    double tolerance, outliers;
} bound;

/* Single precision: 1e-4, and RMSE 1e-4. Horizons: a sample just within the radius for one and just beyond it for the
 * other, a sample's position rounded to another pixel, a grazing normal's rounding; in the weighted sum no more than
 * the bound of raw. Masks: an end of an arc between two sectors. Bytes: values between two. Length of the history:
 * nothing left of it by the clamp or a little. Result: of blocks that are all too far the closest, by the last bit. */
static const bound single_bounds[] = {
    {"horizons.", 1e-4, 1e-3},
    {"arcs.", 0.0, 1e-3},
    {"raw.visibility", 1e-4, 2e-3},
    {"packed.", 1e-4, 1e-3},
    {"temporal.length", 1e-4, 5e-3},
    {"result.", 1e-4, 1e-3},
    {"", 1e-4, 0.0},
};

/* Half precision: storage of all that HALF makes small and arithmetic of the filters. Angles up to pi, visibilities and
 * bent normals up to 1: half a unit in the last place, and what filters make of that. Where the directions cancel, a
 * bent normal is what is left: outliers of result. The table is steep where a cone's edge meets a mirror's lobe. */
static const bound half_bounds[] = {
    {"horizons.", 1e-3, 1e-3}, {"arcs.", 0.0, 1e-3},
    {"raw.", 5e-4, 1e-3},      {"sh.", 3e-4, 1e-3},
    {"spatial", 3e-3, 1e-3},   {"temporal.length", 0.02, 0.1},
    {"temporal.", 2e-3, 5e-3}, {"result.visibility", 1e-3, 1e-3},
    {"result.", 1e-3, 5e-3},   {"multi_bounce.", 2.5e-3, 0.0},
    {"specular.", 0.01, 5e-3}, {"packed.", 1e-4, 1e-3},
    {"octahedral.", 1.0, 0.0}, {"", 1e-4, 0.0},
};

static const char *const files[] = {"reduce", "height",   "surface",      "slices",   "horizons", "arcs",
                                    "raw",    "spatial1", "spatial2",     "spatial3", "temporal", "result",
                                    "packed", "sh",       "multi_bounce", "specular"};
enum { FILES = sizeof files / sizeof *files };

typedef struct difference {
    double rmse, most, outliers; /* relative to max(1, |a|); part of the pixels beyond the tolerance */
} difference;

static difference compare(const image *a, const image *b, double tolerance) {
    difference d = {0.0, 0.0, 0.0};
    size_t n = (size_t)a->width * (size_t)a->height;
    assert_true(a->width == b->width && a->height == b->height);
    for (size_t i = 0; i < n; ++i) {
        double x = (double)a->data[i], y = (double)b->data[i], e = fabs(x - y) / fmax(1.0, fabs(x));
        e = x == y ? 0.0 : e <= 1e30 ? e : 1e30; /* infinities; NaN */
        d.rmse += e * e / (double)n;
        d.most = fmax(d.most, e);
        d.outliers += e > tolerance ? 1.0 / (double)n : 0.0;
    }
    d.rmse = sqrt(d.rmse);
    return d;
}

static void read_channels(const char *in, const char *file, const char *const *names, int count, image *img) {
    char path[300];
    image_error error;
    snprintf(path, sizeof path, "%s/%s.exr", in, file);
    if (!image_read_channels(in_directory(path), names, count, img, &error))
        fail_msg("%s", error.text);
}

/* Fails where a channel is beyond its bound; the number of the first such file if that is wanted instead, or -1. */
static int compare_dumps(const char *scene, const char *a, const char *b, const bound *bounds, int first) {
    for (int f = 0; f < FILES; ++f) {
        char path[300];
        int bad = 0, count;
        image_error error;
        snprintf(path, sizeof path, "%s/%s.exr", a, files[f]);
        if (!exists(path))
            continue;
        char **names = image_list_channels(in_directory(path), &count, &error);
        assert_non_null(names);
        for (int c = 0; c < count; ++c) {
            char channel[100];
            const bound *limit = bounds;
            image image_a, image_b;
            snprintf(channel, sizeof channel, "%s.%s", files[f], names[c]);
            while (strncmp(channel, limit->channel, strlen(limit->channel)) != 0)
                ++limit;
            read_channels(a, files[f], (const char *const *)(names + c), 1, &image_a);
            read_channels(b, files[f], (const char *const *)(names + c), 1, &image_b);
            difference d = compare(&image_a, &image_b, limit->tolerance);
            image_free(&image_a);
            image_free(&image_b);
            int alike = d.outliers <= limit->outliers && (limit->outliers > 0.0 || d.rmse <= limit->tolerance);
            if (getenv("TESTS_PORT_VERBOSE"))
                printf("%-50s %-22s RMSE %.3g, at most %.3g, %.3g %% beyond %g\n", scene, channel, d.rmse, d.most,
                       100.0 * d.outliers, limit->tolerance);
            if (!alike && !first)
                fail_msg("%s: %s: RMSE %.3g, at most %.3g, %.3g %% beyond %g", scene, channel, d.rmse, d.most,
                         100.0 * d.outliers, limit->tolerance);
            bad |= !alike;
        }
        image_free_names(names);
        if (bad)
            return f;
    }
    return -1;
}

/* ---- running ----------------------------------------------------------------------------------------------------- */

static void run_ao(const char *options, const char *to) {
    char line[1000];
    tool = "ao";
    snprintf(line, sizeof line, "%s --dump @/%s -o @/v%s.exr", options, to,
             strstr(options, "--sequence") ? "%04d" : "");
    run_well(line);
}

static void run_port(const char *from, const char *to, const char *options) {
    char line[1000];
    tool = "port";
    snprintf(line, sizeof line, "--from @/%s --dump @/%s %s", from, to, options);
    run_well(line);
}

#define NEEDS_A_DRIVER()                                                                                               \
    do {                                                                                                               \
        if (why_not[0])                                                                                                \
            skip();                                                                                                    \
        remove_tree("a"); /* of a test that failed */                                                                  \
        remove_tree("b");                                                                                              \
    } while (0)

static void compare_scene(const struct scene *s, const bound *bounds, const char *options) {
    run_port("a", "b", options);
    if (strstr(s->options, "--sequence")) {
        for (int k = 0; k < FRAMES; ++k) {
            char a[16], b[16];
            snprintf(a, sizeof a, "a/%04d", k);
            snprintf(b, sizeof b, "b/%04d", k);
            compare_dumps(s->name, a, b, bounds, 0);
        }
    } else {
        compare_dumps(s->name, "a", "b", bounds, 0);
    }
    remove_tree("b");
}

/* ---- tests ------------------------------------------------------------------------------------------------------- */

static void test_stages(void **state) {
    (void)state;
    NEEDS_A_DRIVER();
    for (int i = 0; i < SCENES; ++i) {
        run_ao(scenes[i].options, "a");
        compare_scene(scenes + i, single_bounds, "--isolated");
        if (halves)
            compare_scene(scenes + i, half_bounds, "--isolated --shaders build/shaders/half");
        remove_tree("a");
    }
}

/* Two frames with motion vectors, which build/ao has no option for: between whole pixels, towards the eye, some of them
 * not finite. */
static void test_motion(void **state) {
    enum { W = 61, H = 45, N = W * H };
    static float depth[N], motion[3 * N], visibility[N], bent[3 * N];
    static const float albedo[3] = {0.9f, 0.5f, 0.1f};
    gtao_frame_desc frame;
    gtao_output output;
    image_error error;
    (void)state;
    NEEDS_A_DRIVER();
    memset(&frame, 0, sizeof frame);
    memset(&output, 0, sizeof output);
    for (int i = 0; i < N; ++i) {
        int x = i % W, y = i / W;
        depth[i] = 3.0f - 0.02f * (float)y - (x / 9 % 3 == 1 && y > 12 ? 0.4f : 0.0f);
        motion[3 * i] = 0.7f + 0.1f * (float)(x / 9 % 3), motion[3 * i + 1] = -1.3f, motion[3 * i + 2] = 0.01f;
        if (i % 97 == 0)
            motion[3 * i] = (float)HUGE_VAL;
    }
    frame.desc.width = W, frame.desc.height = H;
    frame.desc.depth = depth;
    frame.desc.camera = gtao_camera_from_fov(50.0f, W, H);
    frame.desc.radius = 0.5f;
    frame.desc.slices = 1, frame.desc.steps = 6;
    frame.motion = motion, frame.motion_components = 3;
    frame.no_skip = 1;
    frame.history = GTAO_HISTORY_VARIANCE;
    output.visibility = visibility, output.bent_normals = bent;
    size_t size = gtao_frame_state_size(&frame);
    void *memory = calloc(1, size);
    dump *d = dump_create(in_directory("a"), &error);
    assert_true(memory && d && dump_planes(d, W, H, 1, 0, 0, &output, &error));
    for (int k = 0; k < 2; ++k) {
        gtao_frame_context *context;
        assert_true(dump_frame(d, k ? "0001" : "0000", &error) && dump_input(d, &frame.desc, &frame, &error));
        assert_int_equal(gtao_frame_begin(&frame, &output, memory, size, &context), GTAO_OK);
        for (int s = 0; s < gtao_frame_stages(context); ++s) {
            gtao_frame_run(context, s, 0, gtao_frame_units(context, s), NULL);
            assert_true(dump_frame_stage(d, context, s, &output, &error));
        }
        assert_true(dump_result(d, gtao_frame_image(context), visibility, bent, NULL, output.surface, albedo, &error));
    }
    assert_true(dump_commit(d, &error));
    free(memory);
    run_port("a", "b", "--isolated");
    for (int k = 0; k < 2; ++k)
        compare_dumps("motion", k ? "a/0001" : "a/0000", k ? "b/0001" : "b/0000", single_bounds, 0);
}

/* The shaders one after another, each on what the shaders before it wrote. */
static void test_chain(void **state) {
    static const bound bounds[] = {
        {"horizons.", 1e-4, 1e-3}, {"packed.", 1.0, 0.01}, {"specular.", 1e-3, 1e-3}, {"", 1e-4, 1e-3}};
    (void)state;
    NEEDS_A_DRIVER();
    run_ao(scenes[0].options, "a");
    compare_scene(scenes, bounds, "");
    remove_tree("a");
}

/* Each mistake shows first in the file of the stage that it is made in. */
static void test_mistakes(void **state) {
    static const struct mistake {
        int number, scene;
        const char *file;
    } mistakes[] = {
        {1, 0, "height"},     {2, 7, "surface"},    {3, 0, "slices"},     {4, 0, "surface"},  {5, 1, "surface"},
        {6, 0, "horizons"},   {7, 0, "horizons"},   {8, 0, "horizons"},   {9, 0, "horizons"}, {10, 0, "slices"},
        {11, 0, "raw"},       {12, 0, "slices"},    {13, 0, "horizons"},  {14, 0, "raw"},     {15, 7, "spatial1"},
        {16, 10, "temporal"}, {17, 10, "temporal"}, {18, 10, "temporal"}, {19, 7, "result"},  {20, 0, "multi_bounce"},
        {21, 0, "slices"},    {22, 0, "specular"},  {23, 0, "packed"},
    };
    static const bound bounds[] = {
        {"packed.", 1e-4, 0.02}, {"specular.", 1e-3, 2e-3}, {"temporal.length", 1e-3, 0.01}, {"", 1e-4, 2e-3}};
    (void)state;
    NEEDS_A_DRIVER();
    for (int scene = 0; scene < SCENES; ++scene) {
        int made = 0;
        for (size_t i = 0; i < sizeof mistakes / sizeof *mistakes; ++i) {
            const struct mistake *m = mistakes + i;
            char options[100];
            int sequence = strstr(scenes[scene].options, "--sequence") != NULL, file;
            if (m->scene != scene)
                continue;
            if (!made++)
                run_ao(scenes[scene].options, "a");
            snprintf(options, sizeof options, "--define MISTAKE=%d", m->number);
            run_port("a", "b", options);
            file = compare_dumps("", sequence ? "a/0001" : "a", sequence ? "b/0001" : "b", bounds, 1);
            if (file < 0 || strcmp(files[file], m->file) != 0)
                fail_msg("mistake %d shows first in %s, not in %s", m->number, file < 0 ? "nothing" : files[file],
                         m->file);
            remove_tree("b");
        }
        if (made)
            remove_tree("a");
    }
}

/* Half floats and 10 + 11 + 11 bits against what was packed. */
static void test_packings(void **state) {
    static const char *const names[] = {"bent.X", "bent.Y", "bent.Z", "visibility"};
    image result, packed;
    (void)state;
    NEEDS_A_DRIVER();
    run_ao(scenes[0].options, "a");
    run_port("a", "b", "--isolated");
    for (int i = 0; i < 2; ++i) {
        double most = 0.0, angle = 0.0;
        read_channels("a", "result", names, 4, &result);
        read_channels("b", i ? "halves" : "octahedral", names, 4, &packed);
        for (int k = 0; k < result.width * result.height; ++k) {
            const float *a = result.data + 4 * k, *b = packed.data + 4 * k;
            double x = (double)a[1] * (double)b[2] - (double)a[2] * (double)b[1];
            double y = (double)a[2] * (double)b[0] - (double)a[0] * (double)b[2];
            double z = (double)a[0] * (double)b[1] - (double)a[1] * (double)b[0];
            angle = fmax(angle, sqrt(x * x + y * y + z * z) * 57.29578); /* sine of a small angle */
            most = fmax(most, fabs((double)a[3] - (double)b[3]));
            assert_true((double)a[0] * (double)b[0] + (double)a[1] * (double)b[1] + (double)a[2] * (double)b[2] > 0.9);
        }
        assert_true(most > 1e-5 && most <= (i ? 0x1p-12 : 0.5001 / 1023.0));
        assert_true(angle > 1e-4 && angle <= (i ? 0.03 : 0.12));
        image_free(&result);
        image_free(&packed);
    }
    remove_tree("a");
    remove_tree("b");
}

/* Options of build/ao go to it; what is wrong is said in one line. */
static void test_host(void **state) {
    (void)state;
    NEEDS_A_DRIVER();
    tool = "port";
    run_well("--dump @/b -- " BALL "--radius 0.5 --steps 4 --slices 1");
    assert_true(exists("b/horizons.exr") && exists("b/octahedral.exr") && exists("b/settings.json"));
    run_badly("--from @/b --dump @/b", "exists");
    run_badly("--from @/none --dump @/c", "settings.json");
    run_badly("--from @/b", "--dump");
    run_badly("--dump @/c", "--from");
    run_badly("--from @/b --dump @/c -- --depth x", "--from");
    run_badly("--from @/b --dump @/c --shaders @/none", "none/prepare.spv");
    run_badly("--from @/b --dump @/c --sideways", "--sideways");
    remove_tree("b");
}

static int setup(void **state) {
    static const char *const cameras = "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0.02 0 1 0 0.01 0 0 1 -0.03\n0.9998 0.02 0 0.03 "
                                       "-0.02 0.9998 0 0.01 0 0 1 -0.05\n"
                                       "1 0 0 0.05 0 1 0 0 0 0 1 -0.05\n";
    (void)state;
    if (make_directory("port") != 0)
        return -1;
    setenv("ASAN_OPTIONS", "detect_leaks=0", 1); /* the driver leaks */
    if (access("build/port", X_OK) != 0)
        snprintf(why_not, sizeof why_not, "there is no build/port (glslangValidator or Vulkan's headers are missing)");
    else if (run("--from @/none --dump @/none") == 3)
        snprintf(why_not, sizeof why_not, "%.*s", (int)strcspn(message, "\n"), message);
    if (why_not[0]) {
        print_message("# note: shaders not tested: %s\n", why_not);
        return 0;
    }
    crop_file("tests/data/study.exr", 220, 100, "study.exr", "study.n.exr");
    for (int k = 0; k < FRAMES; ++k) {
        char name[32];
        snprintf(name, sizeof name, "seq.%04d.exr", k);
        crop_file("tests/data/study.exr", 220 + 2 * k, 100, name, NULL);
    }
    crop_file("tests/data/courtyard.exr", 300, 80, "court.exr", NULL);
    crop_file("tests/data/scans.exr", 200, 120, "scans.exr", NULL);
    crop_file("tests/data/jacksboro.pfm", 40, 90, "terrain.exr", NULL);
    write_analytic();
    write_text("camera.txt", cameras);
    run_ao(BALL "--radius 0.5 --steps 1 --slices 1", "a");
    tool = "port";
    if (run("--from @/a --dump @/b --shaders build/shaders/half") != 0 && strstr(message, "16-bit")) {
        print_message("# note: half precision not tested: %s", message);
        halves = 0;
    }
    return 0;
}

static int teardown(void **state) {
    static const char *const names[] = {"study.exr",    "study.n.exr", "court.exr",    "scans.exr",      "terrain.exr",
                                        "ball.exr",     "back.exr",    "fence.exr",    "fence.back.exr", "pit.exr",
                                        "camera.txt",   "v.exr",       "seq.0000.exr", "seq.0001.exr",   "seq.0002.exr",
                                        "seq.0003.exr", "v0000.exr",   "v0001.exr",    "v0002.exr",      "v0003.exr"};
    (void)state;
    for (size_t i = 0; i < sizeof names / sizeof *names; ++i)
        remove_file(names[i]);
    remove_tree("a");
    remove_tree("b");
    return remove_directory();
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_stages),   cmocka_unit_test(test_motion),   cmocka_unit_test(test_chain),
        cmocka_unit_test(test_mistakes), cmocka_unit_test(test_packings), cmocka_unit_test(test_host),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
