/* The command-line tool as a user meets it: build/ao is run as a child process on small files. */
#include "tool.h"

#include "examples/common/image.h"
#include "gtao.h"
#include "tests/compute.h"

#include <math.h>

#define STB_IMAGE_IMPLEMENTATION
#define STBI_ONLY_PNG
#include <stb/stb_image.h>

enum { WIDTH = 37, HEIGHT = 29, PIXELS = WIDTH * HEIGHT };

static const float focal_px = 40.0f;
static image depth, normals; /* the input, normals in the library's axes */

/* A tilted floor, a ball in front of it, and a corner of sky. */
static int setup(void **state) {
    static const char *const names_z[] = {"Z"}, *const names_n[] = {"N.X", "N.Y", "N.Z"};
    (void)state;
    image_error error;
    if (make_directory("ao") != 0 || !image_create(&depth, WIDTH, HEIGHT, 1, &error) ||
        !image_create(&normals, WIDTH, HEIGHT, 3, &error))
        return -1;
    for (int i = 0; i < PIXELS; ++i) {
        float x = ((float)(i % WIDTH) + 0.5f - 0.5f * WIDTH) / focal_px;
        float y = ((float)(i / WIDTH) + 0.5f - 0.5f * HEIGHT) / focal_px;
        float rr = x * x + y * y + 1.0f, rc = 3.0f, disc = rc * rc - rr * (9.0f - 0.36f);
        float *n = normals.data + 3 * i;
        if (disc > 0.0f) {
            float z = (rc - sqrtf(disc)) / rr;
            depth.data[i] = z;
            n[0] = x * z / 0.6f;
            n[1] = y * z / 0.6f;
            n[2] = (z - 3.0f) / 0.6f;
        } else if (x > 0.2f && y < -0.2f) {
            depth.data[i] = 1e10f;
        } else { /* 0.8 y + 0.6 z = 2 */
            depth.data[i] = 2.0f / (0.8f * y + 0.6f);
            n[1] = -0.8f;
            n[2] = -0.6f;
        }
    }
    save_image("z.exr", &depth, names_z);
    save_image("z.pfm", &depth, names_z);
    save_image("n.exr", &normals, names_n);
    save_image("n.pfm", &normals, names_n);
    return 0;
}

static int teardown(void **state) {
    (void)state;
    static const char *const names[] = {"z.exr", "z.pfm", "n.exr", "n.pfm"};
    image_free(&depth);
    image_free(&normals);
    for (size_t i = 0; i < sizeof names / sizeof *names; ++i)
        remove_file(names[i]);
    return remove_directory();
}

static void load(const char *name, int channels, image *img) {
    static const char *const one[] = {"Y"}, *const three[] = {"X", "Y", "Z"}, *const rgb[] = {"R", "G", "B"};
    image_error error;
    if (!image_read_channels(in_directory(name), channels == 1 ? one : three, channels, img, &error) &&
        !image_read_channels(in_directory(name), rgb, channels, img, &error))
        fail_msg("%s", error.text);
    assert_int_equal(img->channels, channels);
}

static void check_same(const char *name, int channels, const float *expected, size_t pixels) {
    image img;
    load(name, channels, &img);
    assert_int_equal((size_t)img.width * (size_t)img.height, pixels);
    assert_memory_equal(img.data, expected, sizeof(float) * pixels * (size_t)channels);
    image_free(&img);
}

/* What the library itself makes of the input. */
static void describe(gtao_desc *desc) {
    memset(desc, 0, sizeof *desc);
    desc->width = WIDTH;
    desc->height = HEIGHT;
    desc->depth = depth.data;
    desc->normals = normals.data;
    desc->sky_z = 1e9f;
    desc->camera.fx = focal_px;
    desc->radius = 1.0f;
}

static void compute(const gtao_desc *desc, float *visibility, float *bent) {
    gtao_output output;
    memset(&output, 0, sizeof output);
    output.visibility = visibility;
    output.bent_normals = bent;
    assert_int_equal(compute_output(desc, &output), GTAO_OK);
}

#define INPUT "--depth @/z.exr --normal @/n.exr --focal 40 "

/* ---- good runs ---------------------------------------------------------------------------------------------------- */

static void test_equals_library(void **state) {
    (void)state;
    static float visibility[PIXELS], bent[3 * PIXELS];
    gtao_desc desc;
    describe(&desc);
    compute(&desc, visibility, bent);
    run_well(INPUT "--bent @/b.exr -o @/v.exr");
    check_same("v.exr", 1, visibility, PIXELS);
    check_same("b.exr", 3, bent, PIXELS);
    assert_true(visibility[WIDTH - 1] == 1.0f); /* sky */

    desc.radius = 0.7f;
    desc.falloff = 0.25f;
    desc.max_radius_px = 9;
    desc.slices = 3;
    desc.every_pixel = 1;
    desc.thin_blend = 0.1f;
    desc.estimator = GTAO_ESTIMATOR_MEMO;
    desc.noise = GTAO_NOISE_HILBERT;
    desc.frame = 5;
    desc.border = GTAO_BORDER_CLAMP;
    desc.normals = NULL;
    desc.camera.off_center = 1;
    desc.camera.fy = 41.0f;
    desc.camera.cx = 18.0f;
    desc.camera.cy = 15.5f;
    compute(&desc, visibility, bent);
    run_well("--depth @/z.pfm --focal 40,41 --center 18,15.5 --radius 0.7 --falloff 0.25 --max-radius-px 9 --slices 3 "
             "--steps 0 --thin-blend 0.1 --estimator memo --noise hilbert --frame 5 --border clamp --thickness 0 "
             "--denoise 0 --no-skip --bent @/b.exr -o @/v.exr");
    check_same("v.exr", 1, visibility, PIXELS);
    check_same("b.exr", 3, bent, PIXELS);

    describe(&desc);
    desc.camera.fx = 0.0f;
    desc.camera.projection = GTAO_ORTHOGRAPHIC;
    desc.camera.sx = 0.05f;
    desc.border = GTAO_BORDER_WRAP;
    desc.weighting = GTAO_WEIGHTING_UNIFORM;
    desc.noise = GTAO_NOISE_NONE;
    desc.preset = GTAO_PRESET_HIGH;
    desc.steps = 7;
    compute(&desc, visibility, bent);
    run_well("--depth @/z.exr:Z --normal @/n.exr:N --ortho 0.05 --border wrap --weighting uniform --noise=none "
             "--preset high --steps 7 --bent=@/b.exr -o @/v.exr");
    check_same("v.exr", 1, visibility, PIXELS);
    check_same("b.exr", 3, bent, PIXELS);

    describe(&desc); /* effort by need: as by one call, with any threads; and within any time */
    desc.error_target = 0.02f;
    compute(&desc, visibility, bent);
    run_well(INPUT "--error-target 0.02 --threads 3 --bent @/b.exr -o @/v.exr");
    check_same("v.exr", 1, visibility, PIXELS);
    check_same("b.exr", 3, bent, PIXELS);
    run_well(INPUT "--budget-ms 0.001 -o @/v.exr");
    desc.error_target = HUGE_VALF; /* nothing refined */
    compute(&desc, visibility, bent);
    check_same("v.exr", 1, visibility, PIXELS);
    desc.error_target = 1e-6f; /* everything */
    compute(&desc, visibility, bent);
    run_well(INPUT "--budget-ms 1e6 --threads 2 -o @/v.exr");
    check_same("v.exr", 1, visibility, PIXELS);
    remove_file("v.exr");
    remove_file("b.exr");
}

static void test_depth_kinds(void **state) {
    (void)state;
    static const char *const name[] = {"Z"};
    static float visibility[PIXELS], other[PIXELS];
    gtao_desc desc;
    image d;
    image_error error;
    assert_true(image_create(&d, WIDTH, HEIGHT, 1, &error));
    for (int i = 0; i < PIXELS; ++i)
        d.data[i] = 1.0f - 0.1f / depth.data[i]; /* 1/z = -10 d + 10 */
    save_image("d.pfm", &d, name);
    describe(&desc);
    desc.depth = d.data;
    desc.depth_kind = GTAO_DEPTH_DEVICE;
    desc.device_scale = -10.0f;
    desc.device_bias = 10.0f;
    desc.normals = NULL;
    compute(&desc, visibility, NULL);
    run_well("--depth @/d.pfm --depth-kind device --device-scale -10 --device-bias 10 --focal 40 -o @/v.pfm");
    check_same("v.pfm", 1, visibility, PIXELS);

    desc.depth = depth.data;
    desc.depth_kind = GTAO_DEPTH_DISTANCE;
    compute(&desc, visibility, NULL);
    run_well("--depth @/z.pfm --depth-kind distance --focal 40 -o @/v.pfm");
    check_same("v.pfm", 1, visibility, PIXELS);

    memset(&desc.camera, 0, sizeof desc.camera);
    desc.camera.projection = GTAO_ORTHOGRAPHIC;
    desc.camera.sx = 0.05f;
    desc.depth_kind = GTAO_DEPTH_HEIGHT;
    desc.depth = d.data;
    desc.sky_z = 0.0f;
    compute(&desc, visibility, NULL);
    run_well("--depth @/d.pfm --depth-kind height --ortho 0.05 -o @/v.pfm");
    check_same("v.pfm", 1, visibility, PIXELS);

    /* --sky moves the limit: everything at or beyond 2.5 is open */
    run_well("--depth @/z.pfm --focal 40 --sky 2.5 -o @/v.pfm");
    image v;
    load("v.pfm", 1, &v);
    memcpy(other, v.data, sizeof other);
    image_free(&v);
    for (int i = 0; i < PIXELS; ++i)
        if (depth.data[i] >= 2.5f)
            assert_true(other[i] == 1.0f);
    image_free(&d);
    remove_file("d.pfm");
    remove_file("v.pfm");
}

static void test_fov(void **state) {
    (void)state;
    static float visibility[PIXELS];
    gtao_desc desc;
    describe(&desc);
    desc.camera = gtao_camera_from_fov(50.0f, WIDTH, HEIGHT);
    compute(&desc, visibility, NULL);
    run_well("--depth @/z.pfm --normal @/n.pfm --fov-y 50 -o @/v.pfm");
    check_same("v.pfm", 1, visibility, PIXELS);
    remove_file("v.pfm");
}

static void test_formats_agree(void **state) {
    (void)state;
    image v, b;
    run_well(INPUT "--bent @/b.exr -o @/v.exr");
    run_well(INPUT "--bent @/b.pfm -o @/v.pfm");
    run_well(INPUT "--bent @/b.png -o @/v.png");
    load("v.exr", 1, &v);
    load("b.exr", 3, &b);
    check_same("v.pfm", 1, v.data, PIXELS);
    check_same("b.pfm", 3, b.data, PIXELS);
    int w, h, n;
    unsigned char *png = stbi_load(in_directory("v.png"), &w, &h, &n, 0);
    assert_non_null(png);
    assert_true(w == WIDTH && h == HEIGHT && n == 1);
    for (int i = 0; i < PIXELS; ++i)
        assert_int_equal(png[i], (int)(255.0f * v.data[i] + 0.5f));
    stbi_image_free(png);
    png = stbi_load(in_directory("b.png"), &w, &h, &n, 0);
    assert_non_null(png);
    assert_true(w == WIDTH && h == HEIGHT && n == 3);
    for (int i = 0; i < 3 * PIXELS; ++i)
        assert_true(fabsf((float)png[i] - 255.0f * (0.5f + 0.5f * b.data[i])) <= 0.501f);
    stbi_image_free(png);
    image_free(&v);
    image_free(&b);
    static const char *const names[] = {"v.exr", "v.pfm", "v.png", "b.exr", "b.pfm", "b.png"};
    for (size_t i = 0; i < sizeof names / sizeof *names; ++i)
        remove_file(names[i]);
}

/* Channels sh.0 to sh.8 are the library's planes. */
static void test_spherical_harmonics(void **state) {
    (void)state;
    static const char *const names[9] = {"sh.0", "sh.1", "sh.2", "sh.3", "sh.4", "sh.5", "sh.6", "sh.7", "sh.8"};
    static float planes[9][PIXELS];
    gtao_desc desc;
    gtao_output output;
    image_error error;
    describe(&desc);
    memset(&output, 0, sizeof output);
    output.sh = planes[0];
    assert_int_equal(compute_output(&desc, &output), GTAO_OK);
    run_well(INPUT "--sh @/s.exr -o @/v.exr");
    for (int c = 0; c < 9; ++c) {
        image one;
        if (!image_read_channels(in_directory("s.exr"), names + c, 1, &one, &error))
            fail_msg("%s", error.text);
        assert_true(one.width == WIDTH && one.height == HEIGHT);
        assert_memory_equal(one.data, planes[c], sizeof planes[c]);
        image_free(&one);
    }
    remove_file("s.exr");
    remove_file("v.exr");
}

static void test_albedo(void **state) {
    (void)state;
    static const float albedo[3] = {0.9f, 0.5f, 0.0f};
    image v, c;
    run_well(INPUT "-o @/v.exr");
    run_well(INPUT "--albedo 0.9,0.5,0 -o @/c.exr");
    load("v.exr", 1, &v);
    load("c.exr", 3, &c);
    for (int i = 0; i < PIXELS; ++i) {
        float rgb[3];
        gtao_multi_bounce_rgb(v.data[i], albedo, rgb);
        assert_memory_equal(rgb, c.data + 3 * i, sizeof rgb);
    }
    run_well(INPUT "--albedo 0.9,0.5,0 -o @/c.pfm");
    check_same("c.pfm", 3, c.data, PIXELS);
    image_free(&v);
    image_free(&c);
    remove_file("v.exr");
    remove_file("c.exr");
    remove_file("c.pfm");
}

static void test_threads_and_kernels(void **state) {
    (void)state;
    static const char *const variants[] = {
        "--threads 2",  "--threads 7 --repeat 3",   "--threads 64",
        "--isa scalar", "--isa scalar --threads 3", "--no-skip",
    };
    size_t size[2], n;
    run_well(INPUT "--threads 1 --bent @/b.exr -o @/v.exr");
    uint8_t *v = read_bytes("v.exr", size), *b = read_bytes("b.exr", size + 1);
    for (size_t i = 0; i < sizeof variants / sizeof *variants; ++i) {
        char command[256];
        snprintf(command, sizeof command, INPUT "%s --bent @/b.exr -o @/v.exr", variants[i]);
        run_well(command);
        uint8_t *again = read_bytes("v.exr", &n);
        assert_int_equal(n, size[0]);
        assert_memory_equal(again, v, n);
        free(again);
        again = read_bytes("b.exr", &n);
        assert_int_equal(n, size[1]);
        assert_memory_equal(again, b, n);
        free(again);
    }
    free(v);
    free(b);
    remove_file("v.exr");
    remove_file("b.exr");
}

/* Files in other axes give the same picture. */
static void test_axes(void **state) {
    (void)state;
    static const char *const names[] = {"N.X", "N.Y", "N.Z"};
    static const struct {
        int axis[3];
        float sign[3];
        const char *options;
    } cases[] = {
        {{0, 1, 2}, {1, -1, -1}, "--normal-axes +x-y-z"},
        {{2, 0, 1}, {1, -1, 1}, "--normal-axes -y+z+x"}, /* file x is the library's z, y is -x, z is y */
        {{0, 1, 2}, {1, -1, -1}, "--normal-to-view 1,0,0,0,-1,0,0,0,-1"},
        {{1, 0, 2}, {1, 1, -1}, "--normal-to-view 0,1,0,1,0,0,0,0,1 --normal-axes +x+y-z"},
    };
    image v, n;
    image_error error;
    run_well(INPUT "-o @/v.exr");
    load("v.exr", 1, &v);
    for (size_t c = 0; c < sizeof cases / sizeof *cases; ++c) {
        char command[256];
        assert_true(image_create(&n, WIDTH, HEIGHT, 3, &error));
        for (int i = 0; i < PIXELS; ++i)
            for (int k = 0; k < 3; ++k)
                n.data[3 * i + k] = cases[c].sign[k] * normals.data[3 * i + cases[c].axis[k]];
        save_image("m.exr", &n, names);
        image_free(&n);
        snprintf(command, sizeof command, "--depth @/z.exr --normal @/m.exr --focal 40 %s -o @/v.exr",
                 cases[c].options);
        run_well(command);
        check_same("v.exr", 1, v.data, PIXELS);
    }
    image_free(&v);
    remove_file("v.exr");
    remove_file("m.exr");
}

/* A part of a larger picture: the camera's axis stays in the middle of the whole, and so does the output. */
static void test_data_window(void **state) {
    (void)state;
    static const char *const name[] = {"Z"};
    image part = depth, v;
    part.origin_x = 11;
    part.origin_y = -4;
    part.display_width = 80;
    part.display_height = 60;
    save_image("part.exr", &part, name);
    run_well("--depth @/z.exr --focal 40 --center 29,34 -o @/v.exr");
    load("v.exr", 1, &v);
    run_well("--depth @/part.exr --focal 40 -o @/p.exr");
    check_same("p.exr", 1, v.data, PIXELS);
    image_free(&v);
    load("p.exr", 1, &v);
    assert_true(v.origin_x == 11 && v.origin_y == -4 && v.display_width == 80 && v.display_height == 60);
    image_free(&v);
    remove_file("part.exr");
    remove_file("v.exr");
    remove_file("p.exr");
}

static void test_stats(void **state) {
    (void)state;
    char text[4096];
    run_well(INPUT "--threads 2 --repeat 4 --isa scalar --albedo 1,1,1 --steps 0 --stats @/s.json -o @/v.pfm");
    read_text("s.json", text, sizeof text);
    assert_int_equal(text[0], '{');
    assert_true(number_in(text, "width") == WIDTH);
    assert_true(number_in(text, "height") == HEIGHT);
    assert_true(number_in(text, "refined") == 0.0);
    assert_true(number_in(text, "threads") == 2.0);
    assert_non_null(strstr(text, "\"isa\": \"scalar\""));
    double total = number_in(text, "total_ms"), first = number_in(text, "ms");
    assert_true(total > 0.0 && first >= 0.0 && first <= total);
    assert_non_null(strstr(text, "\"stages\": ["));
    assert_non_null(strstr(text, "{\"name\": \"visibility\", \"ms\": "));
    assert_non_null(strstr(text, "{\"name\": \"multi_bounce\", \"ms\": "));
    assert_non_null(strstr(text, "\"skipped\": {"));
    int sky = 0, braces = 0;
    for (int i = 0; i < PIXELS; ++i)
        sky += depth.data[i] > 1e9f;
    assert_true(sky > 0 && (int)number_in(text, "sky") == sky);
    for (const char *c = text; *c; ++c)
        braces += *c == '{' || *c == '[' ? 1 : *c == '}' || *c == ']' ? -1 : 0;
    assert_int_equal(braces, 0);
    remove_file("s.json");
    remove_file("v.pfm");
}

static void test_scene(void **state) {
    (void)state;
    image v, truth, z;
    image_error error;
    run_well("--depth tests/data/scans.exr --normal tests/data/scans.exr --normal-axes +x-y-z --normal-to-view "
             "0.98935914,0.145494,0,-0.03493372,0.23754929,0.97074711,0.14123787,-0.96041751,0.24010421 "
             "--focal 577.2953 --radius 0.5 --preset high -o @/v.exr");
    load("v.exr", 1, &v);
    if (!image_read_depth("tests/data/scans.exr:AO.R", &truth, &error) ||
        !image_read_depth("tests/data/scans.exr", &z, &error))
        fail_msg("%s", error.text);
    double squares = 0.0, count = 0.0;
    for (int i = 0; i < 640 * 360; ++i) {
        if (z.data[i] < 1e9f) {
            squares += (double)((v.data[i] - truth.data[i]) * (v.data[i] - truth.data[i]));
            count += 1.0;
        } else {
            assert_true(v.data[i] == 1.0f);
        }
    }
    /* 0.11 here, of which much is what one depth layer cannot know; a flipped axis or a wrong focal length costs more */
    assert_true(sqrt(squares / count) < 0.13);
    image_free(&v);
    image_free(&truth);
    image_free(&z);
    remove_file("v.exr");
}

/* Thickness, a map of it, back faces and layers, each of them with its own depth. */
static void test_occluders_with_thickness(void **state) {
    (void)state;
    static const char *const names[] = {"0.pfm", "1.pfm", "2.pfm", "3.pfm", "4.pfm"}, *const names_z[] = {"Z"};
    static float visibility[PIXELS], bent[3 * PIXELS];
    image behind[5];
    image_error error;
    gtao_layer layers[2];
    gtao_desc desc;
    for (int k = 0; k < 5; ++k) {
        assert_true(image_create(&behind[k], WIDTH, HEIGHT, 1, &error));
        for (int i = 0; i < PIXELS; ++i)
            behind[k].data[i] = k == 0 ? 0.01f * (float)(i % 30) : depth.data[i] + 0.15f * (float)k;
        save_image(names[k], &behind[k], names_z);
    }
    describe(&desc);
    desc.thickness = 0.2f;
    compute(&desc, visibility, bent);
    run_well(INPUT "--thickness 0.2 --bent @/b.exr -o @/v.exr");
    check_same("v.exr", 1, visibility, PIXELS);
    check_same("b.exr", 3, bent, PIXELS);

    desc.thickness_map = behind[0].data;
    compute(&desc, visibility, NULL);
    run_well(INPUT "--thickness 0.2 --thickness-map @/0.pfm -o @/v.exr");
    check_same("v.exr", 1, visibility, PIXELS);

    memset(layers, 0, sizeof layers);
    layers[0].depth = behind[2].data;
    layers[1].depth = behind[3].data;
    layers[1].back = behind[4].data;
    desc.layers = layers;
    desc.layer_count = 2;
    desc.back = behind[1].data;
    desc.thickness_map = NULL;
    desc.thickness = 0.0f;
    compute(&desc, visibility, NULL);
    run_well(INPUT "--back @/1.pfm --layer @/2.pfm --layer @/3.pfm --back @/4.pfm -o @/v.exr");
    check_same("v.exr", 1, visibility, PIXELS);

    remove_file("v.exr");
    remove_file("b.exr");
    for (int k = 0; k < 5; ++k) {
        remove_file(names[k]);
        image_free(&behind[k]);
    }
}

static void test_help(void **state) {
    (void)state;
    static const char *const options[] = {
        "--depth ",        "--depth-kind ",  "--device-scale ",  "--device-bias ",
        "--normal ",       "--normal-axes ", "--focal ",         "--center ",
        "--fov-y ",        "--ortho ",       "--radius ",        "--normal-to-view ",
        "--falloff",       "--tolerance ",   "--thin-blend ",    "--thickness ",
        "--preset ",       "--slices ",      "--max-radius-px ", "--steps ",
        "--estimator ",    "--weighting ",   "--noise ",         "--frame ",
        "--half ",         "--denoise",      "--albedo ",        "--border ",
        "--sky ",          "--bent ",        "--isa ",           "--sh ",
        "--threads",       "--no-skip ",     "--repeat ",        "--stats ",
        "-o FILE",         "--back ",        "--layer ",         "--thickness-map ",
        "--error-target ", "--budget-ms ",
    };
    run_well("--help");
    for (size_t i = 0; i < sizeof options / sizeof *options; ++i)
        if (!strstr(printed, options[i]))
            fail_msg("--help does not say %s", options[i]);
}

/* ---- bad runs ----------------------------------------------------------------------------------------------------- */

static void test_bad_options(void **state) {
    (void)state;
    static const char *const bad[][2] = {
        /* added to a good command, and what the message must name */
        {"--unknown 1", "--unknown"},
        {"stray", "stray"},
        {"--radius", "--radius"},
        {"--radius --frame 1", "--radius"},
        {"--radius nan", "--radius"},
        {"--radius -1", "--radius"},
        {"--radius 1x", "--radius"},
        {"--radius=", "--radius"},
        {"--radius 1e60", "--radius"},
        {"--no-skip=1", "--no-skip"},
        {"--falloff 1.5", "--falloff"},
        {"--falloff -0.1", "--falloff"},
        {"--max-radius-px -1", "--max-radius-px"},
        {"--max-radius-px 1.5", "--max-radius-px"},
        {"--thin-blend 2", "--thin-blend"},
        {"--tolerance 1.5", "--tolerance"},
        {"--preset best", "--preset"},
        {"--slices 0", "--slices"},
        {"--slices 65", "--slices"},
        {"--steps -1", "--steps"},
        {"--steps 257", "--steps"},
        {"--steps 99999999999999999999", "--steps"},
        {"--error-target 0", "--error-target"},
        {"--error-target nan", "--error-target"},
        {"--error-target 0.1 --slices 2", "--error-target"},
        {"--error-target 0.1 --noise none", "--error-target"},
        {"--error-target 0.1 --half", "--error-target"},
        {"--budget-ms -1", "--budget-ms"},
        {"--budget-ms 10 --preset low", "--budget-ms"},
        {"--estimator other", "--estimator"},
        {"--weighting other", "--weighting"},
        {"--noise white", "--noise"},
        {"--frame -1", "--frame"},
        {"--border mirror", "--border"},
        {"--isa sse9", "--isa"},
        {"--threads 0", "--threads"},
        {"--threads 5000", "--threads"},
        {"--repeat 0", "--repeat"},
        {"--albedo 0.5", "--albedo"},
        {"--albedo 0.5,0.5,1.5", "--albedo"},
        {"--albedo 0.5,0.5,nan", "--albedo"},
        {"--sky 0", "--sky"},
        {"--sky nan", "--sky"},
        {"--depth-kind w", "--depth-kind"},
        {"--depth-kind device", "--device-scale"},
        {"--depth-kind device --device-scale 0 --device-bias 1", "--device-scale"},
        {"--depth-kind height", "--ortho"},
        {"--device-scale 1", "--device-scale"},
        {"--normal-axes +x+y", "--normal-axes"},
        {"--normal-axes +x+x+z", "--normal-axes"},
        {"--normal-axes xyz", "--normal-axes"},
        {"--normal-to-view 1,0,0", "--normal-to-view"},
        {"--normal-to-view 0,0,0,0,0,0,0,0,0", "--normal-to-view"},
        {"--normal-to-view 1,0,0,0,1,0,0,0,inf", "--normal-to-view"},
        {"--focal 0", "--focal"},
        {"--focal -5", "--focal"},
        {"--focal nan", "--focal"},
        {"--focal inf", "--focal"},
        {"--focal 1,2,3", "--focal"},
        {"--center 1", "--center"},
        {"--center nan,1", "--center"},
        {"--fov-y 60", "--fov-y"},
        {"--fov-y 180", "--fov-y"},
        {"--ortho 0", "--ortho"},
        {"--ortho 1", "--ortho"},
        {"--thickness -1", "--thickness"},
        {"--thickness nan", "--thickness"},
        {"--thickness 0.1 --estimator memo", "--thickness"},
        {"--layer @/z.exr --thin-blend 0.5", "--layer"},
        {"--thickness-map @/missing.pfm", "missing.pfm"},
        {"--thickness-map tests/data/scans.exr", "scans.exr"}, /* another size */
        {"--back @/missing.pfm", "missing.pfm"},
        {"--back @/z.exr --back @/z.exr", "--back"},
        {"--layer @/missing.pfm", "missing.pfm"},
        {"--layer @/n.exr", "n.exr"},
        {"--layer tests/data/scans.exr", "scans.exr"},
        {"--layer @/z.exr --back tests/data/scans.exr", "--back"},
        {"--layer @/z.exr --layer @/z.exr --layer @/z.exr --layer @/z.exr --layer @/z.exr --layer @/z.exr "
         "--layer @/z.exr --layer @/z.exr --layer @/z.exr",
         "--layer"},
        {"--layer @/z.pfm -o @/z.pfm", "z.pfm"},
        {"--layer @/z.pfm --half", "--layer"},
        {"--thickness-map @/z.pfm --denoise 1", "--thickness-map"},
        {"--denoise 1000", "--denoise"},
        {"--depth @/missing.exr", "missing.exr"},
        {"--depth @/z.exr:Q", "z.exr"},
        {"--depth @/n.exr", "n.exr"},
        {"--depth @/n.pfm", "n.pfm"},
        {"--depth tests/data/README.md", "README.md"},
        {"--depth tests/data", "tests/data"},
        {"--normal @/missing.pfm", "missing.pfm"},
        {"--normal @/z.exr", "z.exr"},
        {"--normal tests/data/scans.exr", "scans.exr"}, /* another size */
        {"-o @/v.jpg", "v.jpg"},
        {"-o @/no/v.exr", "/no/v.exr"},
        {"-o /dev/null.png/x.exr", "x.exr"},
        {"-o @/z.exr", "z.exr"}, /* the input */
        {"--bent @/b", "--bent"},
        {"--bent @/v.exr", "--bent"}, /* as -o */
        {"--bent @/no/b.exr", "--bent"},
        {"--sh @/s.pfm", "--sh"},
        {"--sh @/v.exr", "--sh"}, /* as -o */
        {"--sh @/no/s.exr", "--sh"},
        {"--sh @/s.exr --half", "--sh"},
        {"--sh @/s.exr --denoise 1", "--sh"},
        {"--stats @/no/s.json", "--stats"},
        {"--stats @/n.exr", "--stats"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
        char command[512];
        snprintf(command, sizeof command, INPUT "-o @/v.exr %s", bad[i][0]);
        run_badly(command, bad[i][1]);
    }
    run_badly("", "--depth");
    run_badly("--depth @/z.exr --focal 40", "-o");
    run_badly("--depth @/z.exr -o @/v.exr", "--focal");
    run_badly("--depth @/z.exr --ortho 1 --center 1,1 -o @/v.exr", "--center");
    run_badly("--depth @/z.exr --focal 40 --normal-axes +x+y+z -o @/v.exr", "--normal-axes");
    run_badly("--depth @/z.exr --depth-kind height --ortho 1 --sky 5 -o @/v.exr", "--sky");
    assert_true(exists("z.exr"));
}

/* The tool against gtao_frame on the same buffers: one frame, then a sequence with a moving camera. */
static void test_frames(void **state) {
    (void)state;
    enum { FRAMES = 3 };
    static const float step[12] = {1, 0, 0, 0.125f, 0, 1, 0, 0, 0, 0, 1, 0};
    static float visibility[PIXELS], bent[3 * PIXELS];
    gtao_frame_desc f;
    gtao_output output;
    size_t size;
    image v, b;
    memset(&f, 0, sizeof f);
    memset(&output, 0, sizeof output);
    output.visibility = visibility;
    output.bent_normals = bent;
    f.desc.width = WIDTH, f.desc.height = HEIGHT;
    f.desc.depth = depth.data, f.desc.normals = normals.data;
    f.desc.sky_z = 1e9f;
    f.desc.camera.fx = focal_px;
    f.desc.radius = 1.0f;
    f.desc.preset = GTAO_PRESET_LOW;
    f.half = 1, f.spatial_passes = 2, f.no_temporal = 1;
    size = gtao_frame_state_size(&f);
    void *memory = calloc(1, size);
    assert_int_equal(gtao_frame(&f, &output, memory, size, NULL), GTAO_OK);
    run_well(INPUT "--preset low --half --denoise 2 --bent @/b.exr -o @/v.exr --stats @/s.json");
    load("v.exr", 1, &v);
    load("b.exr", 3, &b);
    assert_memory_equal(v.data, visibility, sizeof visibility);
    assert_memory_equal(b.data, bent, sizeof bent);
    image_free(&v);
    image_free(&b);
    remove_file("v.exr");
    remove_file("b.exr");
    remove_file("s.json");
    free(memory);

    f.spatial_passes = 0, f.no_temporal = 0;
    size = gtao_frame_state_size(&f);
    memory = calloc(1, size);
    static const char *const names_z[] = {"Z"}, *const names_n[] = {"N.X", "N.Y", "N.Z"};
    char name[32], text[256] = "# world to view\n";
    for (int k = 0; k < FRAMES; ++k) {
        snprintf(name, sizeof name, "z.%03d.exr", 7 + k);
        save_image(name, &depth, names_z);
        snprintf(name, sizeof name, "n.%03d.exr", 7 + k);
        save_image(name, &normals, names_n);
        snprintf(text + strlen(text), sizeof text - strlen(text), "1 0 0 %g  0 1 0 0  0 0 1 0\n", -0.125 * k);
    }
    write_text("camera.txt", text);
    run_well("--sequence @/z.%03d.exr --normal @/n.%03d.exr --frame 7 --focal 40 --preset low --half "
             "--camera @/camera.txt --bent @/b.%d.exr -o @/v.%d.exr --threads 3 --stats @/s.json");
    load("v.9.exr", 1, &v);
    load("b.9.exr", 3, &b);
    f.desc.frame = 7; /* the tool's frames count on from --frame */
    for (int k = 0; k < FRAMES; ++k) {
        memset(f.view_to_previous, 0, sizeof f.view_to_previous);
        if (k > 0)
            memcpy(f.view_to_previous, step, sizeof step);
        assert_int_equal(gtao_frame(&f, &output, memory, size, NULL), GTAO_OK);
    }
    assert_memory_equal(v.data, visibility, sizeof visibility);
    assert_memory_equal(b.data, bent, sizeof bent);
    image_free(&v);
    image_free(&b);
    free(memory);

    run_badly("--sequence @/z.%03d.exr --frame 7 --focal 40 -o @/w.exr", "-o");
    run_badly("--sequence @/z.exr --focal 40 -o @/w.%d.exr", "--sequence");
    run_badly("--sequence @/z.%s.exr --focal 40 -o @/w.%d.exr", "--sequence");
    run_badly("--sequence @/z.%03d.exr --focal 40 -o @/w.%d.exr", "z.000.exr");
    run_badly("--sequence @/z.%03d.exr --frame 7 --depth @/z.exr --focal 40 -o @/w.%d.exr", "--depth");
    run_badly("--sequence @/z.%03d.exr --frame 7 --repeat 2 --focal 40 -o @/w.%d.exr", "--repeat");
    run_badly("--sequence @/z.%03d.exr --frame 7 --camera @/missing.txt --focal 40 -o @/w.%d.exr", "missing.txt");
    run_badly("--sequence @/z.%03d.exr --frame 7 --camera @/z.exr --focal 40 -o @/w.%d.exr", "line 1");
    run_badly(INPUT "--camera @/camera.txt -o @/w.exr", "--camera");
    run_badly(INPUT "--denoise 4 -o @/w.exr", "--denoise");
    for (int k = 0; k < FRAMES; ++k) {
        static const char *const patterns[] = {"z.%03d.exr", "n.%03d.exr", "v.%d.exr", "b.%d.exr"};
        for (int i = 0; i < 4; ++i) {
            snprintf(name, sizeof name, i < 2 ? "%.2s%03d.exr" : "%.2s%d.exr", patterns[i], 7 + k);
            remove_file(name);
        }
    }
    remove_file("camera.txt");
    remove_file("s.json");
}

/* An earlier result survives a failed run. */
static void test_keeps_old_output(void **state) {
    (void)state;
    run_well(INPUT "-o @/v.exr");
    size_t size, again;
    uint8_t *before = read_bytes("v.exr", &size);
    run_badly(INPUT "--radius nan -o @/v.exr", "--radius");
    run_badly("--depth @/z.exr --normal @/missing.exr --focal 40 -o @/v.exr", "missing.exr");
    uint8_t *after = read_bytes("v.exr", &again);
    assert_int_equal(size, again);
    assert_memory_equal(before, after, size);
    free(before);
    free(after);
    remove_file("v.exr");
}

static void test_damaged_files(void **state) {
    (void)state;
    static const char *const names[] = {"z.exr", "z.pfm"};
    for (int k = 0; k < 2; ++k) {
        size_t size;
        uint8_t *bytes = read_bytes(names[k], &size);
        char cut[32], command[256];
        snprintf(cut, sizeof cut, "cut.%s", names[k]);
        for (int part = 0; part < 4; ++part) {
            write_bytes(cut, bytes, size * (size_t)part / 4);
            snprintf(command, sizeof command, "--depth @/%s --focal 40 -o @/v.exr", cut);
            run_badly(command, cut);
        }
        remove_file(cut);
        free(bytes);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_equals_library),
        cmocka_unit_test(test_depth_kinds),
        cmocka_unit_test(test_fov),
        cmocka_unit_test(test_formats_agree),
        cmocka_unit_test(test_spherical_harmonics),
        cmocka_unit_test(test_albedo),
        cmocka_unit_test(test_threads_and_kernels),
        cmocka_unit_test(test_axes),
        cmocka_unit_test(test_data_window),
        cmocka_unit_test(test_stats),
        cmocka_unit_test(test_scene),
        cmocka_unit_test(test_occluders_with_thickness),
        cmocka_unit_test(test_help),
        cmocka_unit_test(test_bad_options),
        cmocka_unit_test(test_frames),
        cmocka_unit_test(test_keeps_old_output),
        cmocka_unit_test(test_damaged_files),
    };
    return cmocka_run_group_tests_name("tool", tests, setup, teardown);
}
