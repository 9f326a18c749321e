/* build/bake and build/bake-mpi as a user meets them: child processes on small maps. */
#include "tool.h"

#include "examples/common/raster.h"
#include "gtao.h"

#include <math.h>
#include <signal.h>
#include <time.h>

#ifdef __has_include
#if __has_include(<tiffio.h>)
#define HAS_TIFF 1
#include <tiffio.h>
#endif
#if __has_include(<png.h>)
#define HAS_PNG 1
#endif
#endif
#ifndef HAS_TIFF
#define HAS_TIFF 0
#endif
#ifndef HAS_PNG
#define HAS_PNG 0
#endif

enum { WIDTH = 75, HEIGHT = 58, PIXELS = WIDTH * HEIGHT };
enum { BIG = 420, BIG_PIXELS = BIG * BIG };

static float heights[PIXELS]; /* whole numbers, so that 16-bit files hold them too */
static float big[BIG_PIXELS];

static void save(const char *name, int width, int height, int channels, const float *data, int bits) {
    static const char *const names[] = {"Y", "G", "B"}, *const normals[] = {"N.X", "N.Y", "N.Z"};
    image_pending pending;
    image_error error;
    raster_writer *w =
        raster_writer_create(in_directory(name), width, height, channels, channels == 3 ? normals : names,
                             channels == 3 ? IMAGE_RANGE_SIGNED : IMAGE_RANGE_UNIT, bits, &pending, &error);
    if (!w || !raster_write(w, height, data, &error) || !raster_finish(w, &error) || !image_commit(&pending, &error))
        fail_msg("%s", error.text);
}

static float *load(const char *name, int channels, size_t pixels) {
    raster_info info;
    image_error error;
    float *data = malloc(pixels * (size_t)channels * sizeof *data);
    int raw_width = pixels == PIXELS ? WIDTH : BIG, raw_height = (int)(pixels / (size_t)raw_width);
    char spec[600];
    snprintf(spec, sizeof spec, "%s%s", in_directory(name), channels == 3 && strstr(name, ".exr") ? ":bent" : "");
    raster_reader *r = raster_open(spec, channels, raw_width, raw_height, &info, &error);
    if (!r || !data)
        fail_msg("%s", error.text);
    assert_int_equal((size_t)info.width * (size_t)info.height, pixels);
    if (!raster_read(r, info.height, data, &error))
        fail_msg("%s", error.text);
    raster_close(r);
    return data;
}

/* A range of mountains in the west, a plain with ripples before it, a pit. */
static float big_height(int x, int y) {
    float ripple = 3.0f * sinf(0.21f * (float)x) * cosf(0.17f * (float)y);
    float a = ((float)x - 20.0f) / 30.0f, px = ((float)x - 330.0f) / 14.0f, py = ((float)y - 200.0f) / 14.0f;
    float range = (90.0f + 25.0f * sinf(0.11f * (float)y)) * expf(-a * a);
    float pit = -30.0f * expf(-px * px - py * py);
    return ripple + range + pit;
}

static int setup(void **state) {
    (void)state;
    if (make_directory("bake") != 0)
        return -1;
    for (int y = 0; y < HEIGHT; ++y)
        for (int x = 0; x < WIDTH; ++x) {
            float v = 400.0f + 60.0f * sinf(0.19f * (float)x) * cosf(0.23f * (float)y) + 40.0f * (float)(x > 50);
            heights[y * WIDTH + x] = floorf(v);
        }
    for (int i = 0; i < BIG_PIXELS; ++i)
        big[i] = big_height(i % BIG, i / BIG);
    save("h.pfm", WIDTH, HEIGHT, 1, heights, 8);
    save("h.exr", WIDTH, HEIGHT, 1, heights, 8);
    save("h.raw", WIDTH, HEIGHT, 1, heights, 8);
    save("big.raw", BIG, BIG, 1, big, 8);
    return 0;
}

static void remove_all(const char *path) {
    DIR *d = opendir(path);
    char inner[1024];
    for (struct dirent *e; d && (e = readdir(d)) != NULL;) {
        if (strcmp(e->d_name, ".") == 0 || strcmp(e->d_name, "..") == 0)
            continue;
        snprintf(inner, sizeof inner, "%s/%s", path, e->d_name);
        if (unlink(inner) != 0)
            remove_all(inner);
    }
    if (d)
        closedir(d);
    rmdir(path);
}

static int teardown(void **state) {
    (void)state;
    remove_all(directory);
    return 0;
}

/* Names in the test's directory that the tests did not make themselves. */
static void check_nothing_left(const char *command) {
    static const char *const ours[] = {".", "..", "stderr", "stdout", "h.", "big.", "in.", NULL};
    DIR *d = opendir(directory);
    assert_non_null(d);
    for (struct dirent *e; (e = readdir(d)) != NULL;) {
        int known = 0;
        for (int i = 0; ours[i]; ++i)
            known |= i < 4 ? strcmp(e->d_name, ours[i]) == 0 : strncmp(e->d_name, ours[i], strlen(ours[i])) == 0;
        if (!known)
            fail_msg("bake %s left %s", command, e->d_name);
    }
    closedir(d);
}

static void drop(const char *name) {
    assert_int_equal(unlink(in_directory(name)), 0);
}

static void check_equal(const char *name, int channels, size_t pixels, const float *expected) {
    float *data = load(name, channels, pixels);
    for (size_t i = 0; i < pixels * (size_t)channels; ++i)
        if (memcmp(data + i, expected + i, 4) != 0)
            fail_msg("%s: %.9g at %zu, expected %.9g", name, (double)data[i], i, (double)expected[i]);
    free(data);
}

/* What the library itself makes of a map. */
static void sweep_outputs(int width, int height, const float *map, const float *normals, float pixel,
                          gtao_border border, int slices, const gtao_output *output) {
    gtao_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.width = width;
    desc.height = height;
    desc.depth = map;
    desc.depth_kind = GTAO_DEPTH_HEIGHT;
    desc.normals = normals;
    desc.camera.projection = GTAO_ORTHOGRAPHIC;
    desc.camera.sx = pixel;
    desc.border = border;
    desc.radius = HUGE_VALF;
    desc.slices = slices;
    size_t size = gtao_sweep_scratch_size(&desc, output, NULL) + gtao_sweep_work_size(&desc, NULL);
    void *scratch = malloc(size);
    assert_non_null(scratch);
    assert_int_equal(gtao_sweep_compute(&desc, output, NULL, scratch, size, NULL, NULL), GTAO_OK);
    free(scratch);
}

static void sweep(int width, int height, const float *map, const float *normals, float pixel, gtao_border border,
                  int slices, float *visibility, float *bent) {
    gtao_output output;
    memset(&output, 0, sizeof output);
    output.visibility = visibility;
    output.bent_normals = bent;
    sweep_outputs(width, height, map, normals, pixel, border, slices, &output);
}

#define SMALL "--height @/h.pfm --pixel-size 20 --directions 8 "
#define LARGE "--height @/big.raw --raw-size 420,420 --pixel-size 1 --directions 16 "

/* ---- files ------------------------------------------------------------------------------------------------------- */

/* Noise with ever more zeros, so that chunks compress to a little more than their own size, just that, and less. */
static void test_exr_chunks(void **state) {
    (void)state;
    enum { W = 225, H = 16, FLOATS = W * H };
    static float data[FLOATS];
    for (int zeros = 0; zeros < 300; ++zeros) {
        unsigned seed = 1;
        for (int i = 0; i < FLOATS; ++i) {
            seed = seed * 1664525u + 1013904223u;
            unsigned bits = (seed & 0x80000000u) | 0x3f000000u | (seed >> 9 & 0x7fffffu);
            memcpy(data + i, &bits, 4);
        }
        for (int i = 0; i < zeros; ++i)
            data[i * 12] = 0.0f;
        save("c.exr", W, H, 1, data, 8);
        float *read = load("c.exr", 1, FLOATS);
        if (memcmp(read, data, sizeof data) != 0)
            fail_msg("%d zeros: differs", zeros);
        free(read);
    }
    drop("c.exr");
}

/* ---- results ----------------------------------------------------------------------------------------------------- */

static void test_equals_library(void **state) {
    (void)state;
    static float v[PIXELS], bent[3 * PIXELS];
    static const char *const border[] = {"open", "clamp", "wrap"};
    for (int k = 0; k < 3; ++k) {
        char command[400];
        sweep(WIDTH, HEIGHT, heights, NULL, 20.0f, (gtao_border)k, 8, v, bent);
        for (int i = 0; i < PIXELS; ++i) { /* into tangent space */
            bent[3 * i + 1] = -bent[3 * i + 1];
            bent[3 * i + 2] = -bent[3 * i + 2];
        }
        snprintf(command, sizeof command, SMALL "--border %s -o @/v.pfm --bent @/b.exr", border[k]);
        run_well(command);
        check_equal("v.pfm", 1, PIXELS, v);
        check_equal("b.exr", 3, PIXELS, bent);
        drop("v.pfm");
        drop("b.exr");
    }
    check_nothing_left("borders");
}

static void test_output_formats(void **state) {
    (void)state;
    static float v[PIXELS];
    sweep(WIDTH, HEIGHT, heights, NULL, 20.0f, GTAO_BORDER_OPEN, 8, v, NULL);
    static const char *const names[] = {"v.exr", "v.raw", "v.f32", "v.pfm", "v.tif"};
    for (int i = 0; i < (HAS_TIFF ? 5 : 4); ++i) {
        char command[400];
        snprintf(command, sizeof command, SMALL "-o @/%s", names[i]);
        run_well(command);
        check_equal(names[i], 1, PIXELS, v);
        drop(names[i]);
    }
    if (HAS_PNG) {
        run_well(SMALL "-o @/v.png --bits 16");
        float *data = load("v.png", 1, PIXELS);
        for (int i = 0; i < PIXELS; ++i)
            assert_true(fabsf(data[i] / 65535.0f - v[i]) <= 0.51f / 65535.0f);
        free(data);
        drop("v.png");
    }
}

static void test_input_formats(void **state) {
    (void)state;
    static float v[PIXELS], scaled[PIXELS];
    sweep(WIDTH, HEIGHT, heights, NULL, 20.0f, GTAO_BORDER_OPEN, 8, v, NULL);
    run_well("--height @/h.exr --pixel-size 20 --directions 8 -o @/v.raw");
    check_equal("v.raw", 1, PIXELS, v);
    run_well("--height @/h.raw --raw-size 75,58 --pixel-size 20 --directions 8 -o @/v.raw");
    check_equal("v.raw", 1, PIXELS, v);
    if (HAS_PNG) { /* full scale is 1 */
        for (int i = 0; i < PIXELS; ++i)
            scaled[i] = heights[i] / 65535.0f;
        save("in.png", WIDTH, HEIGHT, 1, scaled, 16);
        run_well("--height @/in.png --integers stored --pixel-size 20 --directions 8 -o @/v.raw");
        check_equal("v.raw", 1, PIXELS, v);
        for (int i = 0; i < PIXELS; ++i)
            scaled[i] = (float)((double)heights[i] * (1.0 / 65535.0));
        sweep(WIDTH, HEIGHT, scaled, NULL, 1e-3f, GTAO_BORDER_OPEN, 8, v, NULL);
        run_well("--height @/in.png --pixel-size 1e-3 --directions 8 -o @/v.raw");
        check_equal("v.raw", 1, PIXELS, v);
        drop("in.png");
    }
    drop("v.raw");
}

#if HAS_TIFF

/* A GeoTIFF of 16-bit integers in strips, as elevation models come: cells of 20 units, -9999 where nothing is known. */
static const double geotiff_place[6] = {0.0, 0.0, 0.0, 512000.0, 4030000.0, 0.0};
static const char geotiff_text[] = "somewhere|";

static void save_geotiff(const char *name, int compressed) {
    static const TIFFFieldInfo fields[] = {
        {33550, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, (char *)(uintptr_t) "ModelPixelScale"},
        {34735, -1, -1, TIFF_SHORT, FIELD_CUSTOM, 1, 1, (char *)(uintptr_t) "GeoKeyDirectory"},
        {33922, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, (char *)(uintptr_t) "ModelTiepoint"},
        {34737, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, (char *)(uintptr_t) "GeoAsciiParams"},
        {42113, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, (char *)(uintptr_t) "GDALNoData"}};
    double scale[3] = {20.0, 20.0, 0.0};
    uint16_t keys[8] = {1, 1, 0, 1, 1024, 0, 1, 1};
    int16_t row[WIDTH];
    TIFF *t = TIFFOpen(in_directory(name), "w");
    assert_non_null(t);
    TIFFMergeFieldInfo(t, fields, 5);
    TIFFSetField(t, TIFFTAG_IMAGEWIDTH, WIDTH);
    TIFFSetField(t, TIFFTAG_IMAGELENGTH, HEIGHT);
    TIFFSetField(t, TIFFTAG_BITSPERSAMPLE, 16);
    TIFFSetField(t, TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(t, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_INT);
    TIFFSetField(t, TIFFTAG_ROWSPERSTRIP, 7);
    TIFFSetField(t, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(t, TIFFTAG_COMPRESSION, compressed ? COMPRESSION_ADOBE_DEFLATE : COMPRESSION_NONE);
    TIFFSetField(t, 33550, 3, scale);
    TIFFSetField(t, 34735, 8, keys);
    TIFFSetField(t, 33922, 6, geotiff_place);
    TIFFSetField(t, 34737, geotiff_text);
    TIFFSetField(t, 42113, "-9999");
    for (int y = 0; y < HEIGHT; ++y) {
        for (int x = 0; x < WIDTH; ++x)
            row[x] = (int16_t)(x > 20 && x < 30 && y > 20 && y < 25 ? -9999 : (int)heights[y * WIDTH + x]);
        assert_int_equal(TIFFWriteScanline(t, row, (uint32_t)y, 0), 1);
    }
    TIFFClose(t);
}

static void test_geotiff(void **state) {
    (void)state;
    static float v[PIXELS], holes[PIXELS];
    for (int i = 0; i < PIXELS; ++i) {
        int x = i % WIDTH, y = i / WIDTH;
        holes[i] = x > 20 && x < 30 && y > 20 && y < 25 ? NAN : heights[i];
    }
    sweep(WIDTH, HEIGHT, holes, NULL, 20.0f, GTAO_BORDER_OPEN, 8, v, NULL);
    for (int compressed = 0; compressed < 2; ++compressed) {
        save_geotiff("in.tif", compressed);
        run_well("--height @/in.tif --directions 8 -o @/v.raw"); /* it states the size of its pixels */
        check_equal("v.raw", 1, PIXELS, v);
        run_well("--height @/in.tif --directions 8 -o @/v.tif"); /* and where it lies: so does the result */
        check_equal("v.tif", 1, PIXELS, v);
        TIFF *t = TIFFOpen(in_directory("v.tif"), "r");
        uint32_t count = 0;
        void *data = NULL;
        assert_non_null(t);
        assert_int_equal(TIFFGetField(t, 33922, &count, &data), 1);
        assert_int_equal(count, 6);
        assert_memory_equal(data, geotiff_place, sizeof geotiff_place);
        assert_int_equal(TIFFGetField(t, 34737, &count, &data), 1);
        assert_string_equal(data, geotiff_text);
        assert_int_equal(TIFFGetField(t, 34735, &count, &data), 1);
        assert_int_equal(count, 8);
        assert_int_equal(TIFFGetField(t, 33550, &count, &data), 1);
        assert_int_equal(count, 3);
        TIFFClose(t);
    }
    drop("v.raw");
    drop("v.tif");
    drop("in.tif");
}

#endif

static void test_normals(void **state) {
    (void)state;
    static float v[PIXELS], n[3 * PIXELS], file[3 * PIXELS];
    for (int i = 0; i < PIXELS; ++i) {
        float x = 0.4f * sinf(0.3f * (float)(i % WIDTH)), y = 0.5f * cosf(0.2f * (float)(i / WIDTH));
        n[3 * i] = file[3 * i] = x; /* the file: right, up, out */
        file[3 * i + 1] = y;
        n[3 * i + 1] = -y;
        file[3 * i + 2] = 1.0f;
        n[3 * i + 2] = -1.0f;
    }
    save("in.exr", WIDTH, HEIGHT, 3, file, 8);
    sweep(WIDTH, HEIGHT, heights, n, 20.0f, GTAO_BORDER_OPEN, 8, v, NULL);
    run_well(SMALL "--normal @/in.exr -o @/v.raw");
    check_equal("v.raw", 1, PIXELS, v);
    for (int i = 0; i < PIXELS; ++i)
        file[3 * i + 1] = -file[3 * i + 1];
    save("in.exr", WIDTH, HEIGHT, 3, file, 8);
    run_well(SMALL "--normal @/in.exr --normal-green directx -o @/v.raw");
    check_equal("v.raw", 1, PIXELS, v);
    drop("v.raw");
    drop("in.exr");
}

static void test_bent_spaces(void **state) {
    (void)state;
    static float v[PIXELS], bent[3 * PIXELS], turned[3 * PIXELS];
    sweep(WIDTH, HEIGHT, heights, NULL, 20.0f, GTAO_BORDER_OPEN, 8, v, bent);
    for (int k = 0; k < 3; ++k) {
        for (int i = 0; i < PIXELS; ++i) {
            float right = bent[3 * i], up = -bent[3 * i + 1], out = -bent[3 * i + 2], *t = turned + 3 * i;
            t[0] = right;
            t[1] = k == 0 ? up : k == 1 ? -up : out;
            t[2] = k == 2 ? -up : out;
        }
        run_well(k == 0   ? SMALL "--bent @/b.pfm"
                 : k == 1 ? SMALL "--bent @/b.pfm --green directx"
                          : SMALL "--bent @/b.pfm --bent-space world --world-axes +x-z+y");
        check_equal("b.pfm", 3, PIXELS, turned);
    }
    drop("b.pfm");
}

static double sum_of(const float sh[9], float x, float y, float z) {
    const float d[3] = {x, y, z};
    float basis[9];
    double sum = 0.0;
    gtao_sh_basis(d, basis);
    for (int i = 0; i < 9; ++i)
        sum += (double)sh[i] * (double)basis[i];
    return sum;
}

/* The same function in every space: of the library's coefficients in its axes, at the same direction in both. */
static void test_harmonics(void **state) {
    (void)state;
    static float sh[9 * PIXELS];
    gtao_output output;
    memset(&output, 0, sizeof output);
    output.sh = sh;
    sweep_outputs(WIDTH, HEIGHT, heights, NULL, 20.0f, GTAO_BORDER_OPEN, 8, &output);
    for (int k = 0; k < 3; ++k) {
        run_well(k == 0   ? SMALL "--sh @/s.tif"
                 : k == 1 ? SMALL "--sh @/s.tif --green directx"
                          : SMALL "--sh @/s.tif --bent-space world --world-axes +x-z+y");
        float *baked = load("s.tif", 9, PIXELS);
        for (int i = 0; i < PIXELS; ++i) {
            const float right = 0.36f, up = -0.48f, out = 0.8f;
            float library[9];
            for (int c = 0; c < 9; ++c)
                library[c] = sh[c * PIXELS + i];
            double expected = sum_of(library, right, -up, -out);
            double found = sum_of(baked + 9 * i, right, k == 0 ? up : k == 1 ? -up : out, k == 2 ? -up : out);
            if (fabs(found - expected) > 1e-5)
                fail_msg("space %d, pixel %d: %g, expected %g", k, i, found, expected);
        }
        free(baked);
    }
    run_well(SMALL "--sh @/s.exr");
    float *baked = load("s.exr:sh.6", 1, PIXELS);
    for (int i = 0; i < PIXELS; ++i)
        if (fabsf(baked[i] - sh[6 * PIXELS + i]) > 1e-5f) /* even in y and z */
            fail_msg("channel sh.6, pixel %d: %g, expected %g", i, (double)baked[i], (double)sh[6 * PIXELS + i]);
    free(baked);
    drop("s.tif");
    drop("s.exr");
}

/* A wall in the east of a plain: its horizon is at atan(height / distance) eastwards, level elsewhere. */
static void test_horizons(void **state) {
    (void)state;
    enum { N = 16 };
    static float map[PIXELS];
    for (int i = 0; i < PIXELS; ++i)
        map[i] = i % WIDTH >= 60 ? 300.0f : 0.0f;
    save("in.pfm", WIDTH, HEIGHT, 1, map, 8);
    run_well("--height @/in.pfm --pixel-size 20 --directions 8 --horizons @/x.raw");
    FILE *file = fopen(in_directory("x.raw"), "rb");
    static float h[PIXELS * N];
    assert_non_null(file);
    assert_int_equal(fread(h, 4, PIXELS * N, file), PIXELS * N);
    assert_int_equal(getc(file), EOF);
    fclose(file);
    int x = 35, y = HEIGHT / 2;
    for (int i = 0; i < N; ++i) { /* azimuth from the right towards the bottom */
        double azimuth = 6.283185307179586 * (i + 0.5) / N, expected = 0.0;
        double distance = 20.0 * (60 - x) / cos(azimuth), across = distance / 20.0 * sin(azimuth);
        if (cos(azimuth) > 0.0 && fabs(across) < HEIGHT / 2 - 1)
            expected = 300.0 / sqrt(300.0 * 300.0 + distance * distance);
        double found = (double)h[(y * WIDTH + x) * N + i];
        if (fabs(found - expected) > 0.02)
            fail_msg("azimuth %g: %g, expected %g", azimuth, found, expected);
    }
    drop("in.pfm");
    drop("x.raw");
}

/* A plane with holes is open: their edges are no cliffs, and the holes are open too. */
static void test_holes(void **state) {
    (void)state;
    static float map[PIXELS];
    static const struct {
        float value;
        const char *text;
    } kinds[] = {{-32768.0f, "-32768"}, {9999.0f, "9999"}, {NAN, "nan"}, {INFINITY, "inf"}};
    for (int k = 0; k < 4; ++k) {
        for (int i = 0; i < PIXELS; ++i) {
            int x = i % WIDTH, y = i / WIDTH;
            map[i] = (x - 30) * (x - 30) + (y - 25) * (y - 25) < 90 || x == 70 ? kinds[k].value : 0.5f * (float)x;
        }
        save("in.pfm", WIDTH, HEIGHT, 1, map, 8);
        char command[300];
        for (int tiles = 0; tiles < 2; ++tiles) {
            snprintf(command, sizeof command,
                     "--height @/in.pfm --pixel-size 1 --directions 8 --no-data %s -o @/v.raw%s", kinds[k].text,
                     tiles ? " --tile 24 --overlap 128" : "");
            run_well(command);
            float *v = load("v.raw", 1, PIXELS);
            for (int i = 0; i < PIXELS; ++i)
                if (v[i] < 0.999f)
                    fail_msg("%s: %g at %d, %d", command, (double)v[i], i % WIDTH, i / WIDTH);
            free(v);
        }
    }
    drop("in.pfm");
    drop("v.raw");
}

/* A map that repeats, shifted, gives the same picture shifted. */
static void test_wrap(void **state) {
    (void)state;
    enum { SX = 31, SY = 17 };
    static float map[PIXELS], shifted[PIXELS];
    for (int i = 0; i < PIXELS; ++i) {
        int x = i % WIDTH, y = i / WIDTH;
        float a = 6.2831853f * (float)x / WIDTH, b = 6.2831853f * (float)y / HEIGHT;
        map[i] = 6.0f * sinf(3.0f * a + cosf(b)) + 4.0f * cosf(4.0f * b) + (x > 10 && x < 20 ? 8.0f : 0.0f);
    }
    for (int y = 0; y < HEIGHT; ++y)
        for (int x = 0; x < WIDTH; ++x)
            shifted[(y + SY) % HEIGHT * WIDTH + (x + SX) % WIDTH] = map[y * WIDTH + x];
    save("in.a.pfm", WIDTH, HEIGHT, 1, map, 8);
    save("in.b.pfm", WIDTH, HEIGHT, 1, shifted, 8);
    for (int tiles = 0; tiles < 2; ++tiles) {
        run_well(tiles ? "--height @/in.a.pfm --wrap --pixel-size 1 --tile 40 --overlap 128 -o @/a.raw"
                       : "--height @/in.a.pfm --wrap --pixel-size 1 -o @/a.raw");
        run_well("--height @/in.b.pfm --wrap --pixel-size 1 -o @/b.raw");
        float *a = load("a.raw", 1, PIXELS), *b = load("b.raw", 1, PIXELS);
        double inner = 0.0, inners = 0.0, seam = 0.0, seams = 0.0;
        for (int y = 0; y < HEIGHT; ++y)
            for (int x = 0; x < WIDTH; ++x) {
                int bx = (x + SX) % WIDTH, by = (y + SY) % HEIGHT;
                double d = (double)(a[y * WIDTH + x] - b[by * WIDTH + bx]);
                int near_seam = x < 2 || y < 2 || x >= WIDTH - 2 || y >= HEIGHT - 2 || bx < 2 || by < 2 ||
                                bx >= WIDTH - 2 || by >= HEIGHT - 2;
                *(near_seam ? &seam : &inner) += d * d;
                *(near_seam ? &seams : &inners) += 1.0;
            }
        free(a);
        free(b);
        /* lines pass pixels differently after a shift: the sweep's own error, the same at the seam as elsewhere */
        inner = sqrt(inner / inners);
        seam = sqrt(seam / seams);
        if (inner > 0.005 || seam > 1.3 * inner + 0.0005)
            fail_msg("%s: rmse %g, at the seam %g", tiles ? "tiles" : "whole", inner, seam);
    }
    drop("a.raw");
    drop("b.raw");
    drop("in.a.pfm");
    drop("in.b.pfm");
}

/* ---- tiles ------------------------------------------------------------------------------------------------------- */

static double json_number(const char *name, const char *key) {
    char text[4096];
    read_text(name, text, sizeof text);
    return number_in(text, key);
}

/* Tiles against the map in one piece: mountains that lie beyond the overlap are seen, to the bound that the tool states
 * and far better on average; and the error has no step at the borders of the tiles. */
static void test_tiles(void **state) {
    (void)state;
    enum { TILE = 84 };
    static const char *const border[] = {"open", "clamp", "wrap"};
    for (int k = 0; k < 3; ++k) {
        char command[400];
        snprintf(command, sizeof command, LARGE "--border %s -o @/a.raw", border[k]);
        run_well(command);
        snprintf(command, sizeof command, LARGE "--border %s -o @/b.raw --tile 84 --overlap 128 --stats @/s.json",
                 border[k]);
        run_well(command);
        double bound = json_number("s.json", "far_slope_error_bound");
        assert_true(json_number("s.json", "tiles") == 25.0);
        float *a = load("a.raw", 1, BIG_PIXELS), *b = load("b.raw", 1, BIG_PIXELS);
        double sum = 0.0, worst = 0.0, seam = 0.0, inner = 0.0, seams = 0.0, inners = 0.0;
        for (int y = 0; y < BIG; ++y)
            for (int x = 0; x < BIG; ++x) {
                double d = (double)(b[y * BIG + x] - a[y * BIG + x]);
                if (k == 1 && (x < 2 || y < 2 || x >= BIG - 2 || y >= BIG - 2))
                    continue; /* the slope at a clamped edge is one-sided in one piece, and that of the edge going on */
                sum += d * d;
                worst = fabs(d) > worst ? fabs(d) : worst;
                if (x + 1 == BIG)
                    continue;
                double step = (double)(b[y * BIG + x + 1] - a[y * BIG + x + 1]) - d;
                if (x % TILE == TILE - 1)
                    seam += step * step, seams += 1.0;
                else
                    inner += step * step, inners += 1.0;
            }
        free(a);
        free(b);
        double rmse = sqrt(sum / BIG_PIXELS);
        seam = sqrt(seam / seams);
        inner = sqrt(inner / inners);
        print_message("# note: tiles, %s: rmse %.5f, greatest %.5f, bound %.4f; step at seams %.5f, elsewhere %.5f\n",
                      border[k], rmse, worst, bound, seam, inner);
        /* open: the sweep's own error, lines passing the pixels of a tile differently, and that of what is far. The
         * others end elsewhere: one piece sees a diagonal beyond its border, a tile one beyond its window. */
        const double limit[] = {0.0015, 0.005, 0.004};
        if (rmse > limit[k] || worst > bound || worst > 0.06 || seam > inner + 0.001)
            fail_msg("%s: rmse %g, greatest %g, bound %g, seam %g, elsewhere %g", border[k], rmse, worst, bound, seam,
                     inner);
    }
    /* that the mountains matter out there: without them it is another picture */
    run_well(LARGE "--radius 128 -o @/b.raw");
    run_well(LARGE "-o @/a.raw");
    float *a = load("a.raw", 1, BIG_PIXELS), *b = load("b.raw", 1, BIG_PIXELS);
    double sum = 0.0;
    for (int i = 0; i < BIG_PIXELS; ++i)
        sum += (double)((a[i] - b[i]) * (a[i] - b[i]));
    free(a);
    free(b);
    assert_true(sqrt(sum / BIG_PIXELS) > 0.01);
    drop("a.raw");
    drop("b.raw");
    drop("s.json");
}

#define TILED LARGE "--tile 60 --overlap 128 --bent @/b.raw "

static int file_same(const char *a, const char *b) {
    size_t size[2];
    uint8_t *x = read_bytes(a, size), *y = read_bytes(b, size + 1);
    int same = size[0] == size[1] && memcmp(x, y, size[0]) == 0;
    free(x);
    free(y);
    return same;
}

static void test_threads(void **state) {
    (void)state;
    run_well(TILED "--threads 1 -o @/a.raw");
    run_well(TILED "--threads 3 -o @/c.raw");
    assert_true(file_same("a.raw", "c.raw"));
    run_well(TILED "--isa scalar -o @/c.raw");
    assert_true(file_same("a.raw", "c.raw"));
    drop("a.raw");
    drop("b.raw");
    drop("c.raw");
}

static int count_tiles(const char *work) {
    DIR *d = opendir(in_directory(work));
    int count = 0;
    for (struct dirent *e; d && (e = readdir(d)) != NULL;)
        count += strncmp(e->d_name, "tile-", 5) == 0 && !strstr(e->d_name, ".tmp");
    if (d)
        closedir(d);
    return count;
}

static void pause_a_little(void) {
    struct timespec t = {0, 1000000};
    nanosleep(&t, NULL);
}

/* Kills the process group once `tiles` tiles are on disk. False if it was done before that. */
static int kill_after(pid_t child, const char *work, int tiles) {
    for (int i = 0; i < 60000; ++i) {
        int status;
        if (count_tiles(work) >= tiles) {
            kill(child, SIGKILL);
            assert_int_equal(waitpid(child, &status, 0), child);
            return WIFSIGNALED(status);
        }
        if (waitpid(child, &status, WNOHANG) != 0)
            return 0;
        pause_a_little();
    }
    return 0;
}

static void test_restart(void **state) {
    (void)state;
    run_well(TILED "-o @/a.raw");
    pid_t child = start("build/bake " TILED "-o @/c.raw --threads 1", 0);
    assert_true(kill_after(child, "c.raw.work", 5));
    assert_false(exists("c.raw"));
    int before = count_tiles("c.raw.work");
    assert_true(before >= 5 && before < 49);

    /* other settings do not go on with it, and do not spoil it */
    assert_int_equal(run(LARGE "--tile 60 --overlap 128 --radius 7 --bent @/b.raw -o @/c.raw"), 2);
    assert_non_null(strstr(message, "--fresh"));
    assert_int_equal(count_tiles("c.raw.work"), before);

    /* a damaged tile is computed again */
    char path[200];
    for (int i = 0; i < 49; ++i) {
        snprintf(path, sizeof path, "c.raw.work/tile-%06d", i);
        if (exists(path))
            break;
    }
    FILE *file = fopen(in_directory(path), "r+b");
    assert_non_null(file);
    fseek(file, 1000, SEEK_SET);
    fputs("damage", file);
    fclose(file);

    run_well(TILED "-o @/c.raw --stats @/s.json");
    assert_true(file_same("a.raw", "c.raw"));
    assert_true(json_number("s.json", "tiles_computed") == 49 - before + 1);
    assert_false(exists("c.raw.work"));
    drop("s.json");

    /* --fresh; and what a run that was killed while it put the output together left behind goes too */
    child = start("build/bake " TILED "-o @/c.raw --threads 1", 0);
    assert_true(kill_after(child, "c.raw.work", 3));
    char pending[300];
    snprintf(pending, sizeof pending, "%s/c.raw.123-0.tmp\n", directory);
    write_text("c.raw.work/pending", pending);
    write_text("c.raw.123-0.tmp", "");
    run_well(TILED "-o @/c.raw --fresh --stats @/s.json");
    assert_true(json_number("s.json", "tiles_computed") == 49);
    assert_true(file_same("a.raw", "c.raw"));
    drop("a.raw");
    drop("b.raw");
    drop("c.raw");
    drop("s.json");
    check_nothing_left("restart");
}

/* A map whose buffers would take 250 MiB in one piece, in an address space of 112 MiB. */
static void test_memory(void **state) {
    (void)state;
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    skip();
#else
    enum { SIDE = 2048 };
    image_error error;
    image_pending pending;
    float *row = malloc(SIDE * sizeof *row);
    raster_writer *w =
        raster_writer_create(in_directory("in.raw"), SIDE, SIDE, 1, NULL, IMAGE_RANGE_UNIT, 8, &pending, &error);
    assert_true(w && row);
    for (int y = 0; y < SIDE; ++y) {
        for (int x = 0; x < SIDE; ++x)
            row[x] = (float)((x * 7 ^ y * 3) & 63) + 0.05f * (float)x;
        assert_true(raster_write(w, 1, row, &error));
    }
    free(row);
    assert_true(raster_finish(w, &error) && image_commit(&pending, &error));
    const char *command =
        "build/bake --height @/in.raw --raw-size 2048,2048 --pixel-size 1 --directions 1 --overlap 128 "
        "--memory 96M --threads 2 -o @/v.png --stats @/s.json";
    int status = finish(start(command, (size_t)112 << 20));
    if (status != 0)
        fail_msg("exit status %d, %s", status, message);
    assert_true(json_number("s.json", "peak_memory_mib") < 96.0);
    assert_true(json_number("s.json", "tiles") > 1.0);
    assert_int_not_equal(finish(start("build/bake --height @/in.raw --raw-size 2048,2048 --pixel-size 1 --directions 1 "
                                      "--tile 2048 --threads 2 -o @/v2.png",
                                      (size_t)112 << 20)),
                         0);
    assert_false(exists("v2.png"));
    remove_all(in_directory("v2.png.work"));
    drop("in.raw");
    drop("v.png");
    drop("s.json");
#endif
}

/* ---- MPI --------------------------------------------------------------------------------------------------------- */

#define MPI "mpirun --oversubscribe -n %d build/bake-mpi " TILED

static int has_mpi(void) {
    setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
    setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
    setenv("OMPI_MCA_btl_base_warn_component_unused", "0", 1);
    return access("build/bake-mpi", X_OK) == 0 && system("command -v mpirun >/dev/null") == 0;
}

static void test_mpi(void **state) {
    (void)state;
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    skip();
#endif
    if (!has_mpi())
        skip();
    run_well(TILED "-o @/a.raw");
    for (int ranks = 1; ranks <= 3; ++ranks) {
        char command[600];
        snprintf(command, sizeof command, MPI "-o @/c.raw", ranks);
        int status = finish(start(command, 0));
        if (status != 0)
            fail_msg("%d ranks: exit status %d, %s", ranks, status, message);
        assert_true(file_same("a.raw", "c.raw"));
        drop("c.raw");
    }
    /* killed with two ranks, restarted with two, and what was done before is not done again */
    char command[600];
    snprintf(command, sizeof command, MPI "-o @/c.raw", 2);
    pid_t child = start(command, 0);
    int killed = kill_after(child, "c.raw.work", 6);
    assert_true(killed);
    int before = count_tiles("c.raw.work"), status = -1;
    for (int i = 0; i < 200;
         ++i) { /* the ranks end when they see that mpirun is gone; until then the directory is locked */
        snprintf(command, sizeof command, MPI "-o @/c.raw --stats @/s.json", 2);
        status = finish(start(command, 0));
        if (status == 0 || !strstr(message, "in use"))
            break;
        pause_a_little();
    }
    if (status != 0)
        fail_msg("restart: exit status %d, %s", status, message);
    if (json_number("s.json", "tiles_found") < before - 2) /* unless they were quicker than their end and finished */
        assert_true(json_number("s.json", "tiles_computed") > 0);
    drop("s.json");
    assert_true(file_same("a.raw", "c.raw"));
    drop("a.raw");
    drop("b.raw");
    drop("c.raw");

    /* one line from the first rank, no output */
    snprintf(command, sizeof command,
             "mpirun --oversubscribe -n 2 build/bake-mpi --height @/none.pfm --pixel-size 1 -o @/c.raw");
    assert_int_not_equal(finish(start(command, 0)), 0);
    const char *line = strstr(message, "bake-mpi: --height");
    assert_non_null(line);
    assert_null(strstr(line + 1, "bake-mpi: --height"));
    check_nothing_left("mpi");
}

/* ---- bad input --------------------------------------------------------------------------------------------------- */

/* The first `bytes` of a file, with byte `flip` (if not negative) inverted. */
static void cut(const uint8_t *whole, const char *to, long bytes, long flip) {
    uint8_t *part = malloc((size_t)bytes + 1);
    assert_non_null(part);
    memcpy(part, whole, (size_t)bytes);
    if (flip >= 0)
        part[flip] ^= 0xff;
    write_bytes(to, part, (size_t)bytes);
    free(part);
}

static void test_damaged(void **state) {
    (void)state;
    static const char *const kinds[] = {"pfm", "exr", "raw", "tif", "png"};
    save("in.pfm", WIDTH, HEIGHT, 1, heights, 8);
    save("in.exr", WIDTH, HEIGHT, 1, heights, 8);
    save("in.raw", WIDTH, HEIGHT, 1, heights, 8);
    if (HAS_TIFF)
        save("in.tif", WIDTH, HEIGHT, 1, heights, 8);
    if (HAS_PNG)
        save("in.png", WIDTH, HEIGHT, 1, heights, 16);
    for (int k = 0; k < 5; ++k) {
        char whole[32], part[32], command[300];
        if ((k == 3 && !HAS_TIFF) || (k == 4 && !HAS_PNG))
            continue;
        snprintf(whole, sizeof whole, "in.%s", kinds[k]);
        snprintf(part, sizeof part, "in.cut.%s", kinds[k]);
        snprintf(command, sizeof command, "--height @/%s --raw-size 75,58 --pixel-size 1 --directions 2 -o @/v.pfm",
                 part);
        size_t size;
        uint8_t *content = read_bytes(whole, &size);
        long length = (long)size;
        for (int i = 0; i < 12; ++i) { /* 0 bytes, 1 byte, ... all but one */
            long bytes = i == 0 ? 0 : i == 1 ? 1 : i == 11 ? length - 1 : length * i / 12;
            if (k == 3 && i == 11)
                continue; /* ends with the place of a next directory, which nobody needs */
            cut(content, part, bytes, -1);
            run_badly(command, part);
        }
        for (long at = 0; k != 2 && at < 200 && at < length; at += 11) { /* damage: an error, or a result */
            cut(content, part, length, at);
            int status = run(command);
            const char *end = strchr(message, '\n');
            if (status == 0) {
                assert_int_equal(message[0], 0);
                drop("v.pfm");
            } else if (status != 2 || !end || end[1] || !strstr(message, part))
                fail_msg("%s with byte %ld inverted: exit status %d, %s", whole, at, status, message);
            check_nothing_left(command);
        }
        free(content);
        drop(part);
        drop(whole);
    }
    run_badly("--height @/h.raw --raw-size 75,59 --pixel-size 1 -o @/v.pfm", "truncated");
    run_badly("--height @/h.raw --raw-size 75,57 --pixel-size 1 -o @/v.pfm", "75 x 57 floats are");
    run_badly("--height @/h.raw --pixel-size 1 -o @/v.pfm", "size of a raw file");
}

static void test_not_finite(void **state) {
    (void)state;
    static float map[PIXELS];
    static const float values[] = {NAN, INFINITY, -INFINITY};
    for (int k = 0; k < 3; ++k) {
        memcpy(map, heights, sizeof map);
        map[12 * WIDTH + 34] = values[k];
        save("in.pfm", WIDTH, HEIGHT, 1, map, 8);
        run_badly("--height @/in.pfm --pixel-size 1 -o @/v.pfm", "column 34, row 12");
        run_badly("--height @/in.pfm --pixel-size 1 --no-data 5 -o @/v.pfm", "column 34, row 12");
    }
    for (int i = 0; i < PIXELS; ++i)
        map[i] = 7.0f;
    save("in.pfm", WIDTH, HEIGHT, 1, map, 8);
    run_badly("--height @/in.pfm --pixel-size 1 --no-data 7 -o @/v.pfm", "no cell holds data");
    run_badly("--height @/in.pfm --pixel-size 1 --height-scale 1e38 -o @/v.pfm", "out of range");
    drop("in.pfm");
}

static void test_bad_options(void **state) {
    (void)state;
    run_badly("", "--height: required");
    run_badly("--height @/h.pfm --pixel-size 1", "-o, --bent, --horizons or --sh");
    run_badly("--height @/h.pfm -o @/v.pfm", "--pixel-size: required");
    run_badly("--height @/missing.pfm --pixel-size 1 -o @/v.pfm", "missing.pfm: No such file");
    run_badly("--height @/h.xyz --pixel-size 1 -o @/v.pfm", "unknown format");
    run_badly(SMALL "-o @/v.jpg", "unknown format");
    run_badly(SMALL "-o @/none/v.pfm", "its directory is missing");
    run_badly(SMALL "-o @/h.pfm", "would overwrite the input");
    run_badly(SMALL "-o @/v.pfm --bent @/v.pfm", "the same file");
    run_badly(SMALL "--horizons @/h2.png", "channels need");
    run_badly(SMALL "--sh @/s.pfm", "9 channels need");
    run_badly(SMALL "-o @/v.pfm --directions 65", "--directions 65");
    run_badly(SMALL "-o @/v.pfm --radius 0", "--radius 0");
    run_badly(SMALL "-o @/v.pfm --radius nan", "--radius nan");
    run_badly(SMALL "-o @/v.pfm --falloff 2", "--falloff 2");
    run_badly(SMALL "-o @/v.pfm --memory 12Q", "--memory 12Q");
    run_badly(SMALL "-o @/v.pfm --memory 1M --tile 30", "--memory");
    run_badly(SMALL "-o @/v.pfm --overlap 100", "--overlap 100");
    run_badly(SMALL "-o @/v.pfm --overlap 384", "--overlap 384");
    run_badly(SMALL "-o @/v.pfm --height-scale 0", "--height-scale 0");
    run_badly(SMALL "-o @/v.pfm --pixel-size 0", "--pixel-size 0");
    run_badly(SMALL "-o @/v.pfm --world-axes +x+y+y", "--world-axes");
    run_badly(SMALL "-o @/v.pfm --green directx", "only with --bent");
    run_badly(SMALL "-o @/v.pfm --wrap --border open", "cannot be combined");
    run_badly(SMALL "-o @/v.pfm --bits 12", "--bits 12");
    run_badly(SMALL "-o @/v.pfm --frobnicate", "unknown option");
    run_badly(SMALL "-o", "needs a value");
    run_badly(SMALL "--work @ -o @/v.pfm", "not the unfinished work");
    assert_true(exists("h.pfm"));
    save("in.pfm", 10, 10, 3, big, 8);
    run_badly(SMALL "-o @/v.pfm --normal @/in.pfm", "10 x 10, but the heights are 75 x 58");
    run_badly("--height @/in.pfm --pixel-size 1 -o @/v.pfm", "three channels");
    drop("in.pfm");
    assert_int_equal(run("--help"), 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_equals_library),
        cmocka_unit_test(test_output_formats),
        cmocka_unit_test(test_input_formats),
#if HAS_TIFF
        cmocka_unit_test(test_geotiff),
#endif
        cmocka_unit_test(test_normals),
        cmocka_unit_test(test_bent_spaces),
        cmocka_unit_test(test_exr_chunks),
        cmocka_unit_test(test_horizons),
        cmocka_unit_test(test_harmonics),
        cmocka_unit_test(test_holes),
        cmocka_unit_test(test_wrap),
        cmocka_unit_test(test_tiles),
        cmocka_unit_test(test_threads),
        cmocka_unit_test(test_restart),
        cmocka_unit_test(test_memory),
        cmocka_unit_test(test_mpi),
        cmocka_unit_test(test_damaged),
        cmocka_unit_test(test_not_finite),
        cmocka_unit_test(test_bad_options),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
