/* Image files: round trips, every way a file may store its channels, channel selection, damaged files. The EXR files
 * that our own writer cannot make (half, tiles, layers, parts) are written here with OpenEXRCore. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "examples/common/image.h"

#include <OpenEXR/openexr.h>
#include <float.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

static char directory[256];

static const char *in_directory(const char *name) {
    static char path[4][512];
    static int next;
    char *p = path[next++ % 4];
    snprintf(p, sizeof path[0], "%s/%s", directory, name);
    return p;
}

static int setup(void **state) {
    (void)state;
    const char *base = getenv("TMPDIR");
    snprintf(directory, sizeof directory, "%s/gtao-image-XXXXXX", base && base[0] ? base : "/tmp");
    return mkdtemp(directory) ? 0 : -1;
}

static int teardown(void **state) {
    (void)state;
    return rmdir(directory); /* every test removes what it wrote; this fails if a temporary was left behind */
}

static void write_bytes(const char *path, const void *bytes, size_t count) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, count, file), count);
    assert_int_equal(fclose(file), 0);
}

static unsigned char *read_bytes(const char *path, size_t *count) {
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    *count = (size_t)ftell(file);
    rewind(file);
    unsigned char *bytes = malloc(*count + 1);
    assert_non_null(bytes);
    assert_int_equal(fread(bytes, 1, *count, file), *count);
    fclose(file);
    return bytes;
}

/* One line, and it names the file. */
static void check_message(const image_error *error, const char *path) {
    assert_non_null(strstr(error->text, path));
    assert_null(strchr(error->text, '\n'));
    assert_true(strlen(error->text) > strlen(path) + 2);
}

static void fill(image *img, uint32_t seed) {
    size_t count = (size_t)img->width * (size_t)img->height * (size_t)img->channels;
    for (size_t i = 0; i < count; ++i) {
        seed = seed * 1664525u + 1013904223u;
        img->data[i] = (float)(int32_t)seed * 1e-6f;
    }
}

/* ---- round trips -------------------------------------------------------------------------------------------------- */

static void round_trip(const char *name, int width, int height, int channels) {
    static const char *const names[] = {"N.X", "N.Y", "N.Z"}, *const single[] = {"Z"};
    const char *path = in_directory(name);
    image written, read;
    image_error error;
    image_pending pending;
    assert_true(image_create(&written, width, height, channels, &error));
    fill(&written, (uint32_t)(width * 31 + height));
    written.data[0] = INFINITY; /* bits must survive */
    written.data[channels - 1] = -0.0f;
    written.data[(size_t)width * (size_t)height * (size_t)channels - 1] = FLT_MIN / 2.0f;
    assert_true(image_write(path, &written, channels == 1 ? single : names, IMAGE_RANGE_UNIT, &pending, &error));
    assert_int_not_equal(access(path, F_OK), 0); /* not before the commit */
    assert_true(image_commit(&pending, &error));
    assert_true(channels == 1 ? image_read_depth(path, &read, &error) : image_read_normals(path, &read, &error));
    assert_int_equal(read.width, width);
    assert_int_equal(read.height, height);
    assert_int_equal(read.channels, channels);
    assert_int_equal(read.display_width, width);
    assert_memory_equal(read.data, written.data, sizeof(float) * (size_t)(width * height * channels));
    image_free(&written);
    image_free(&read);
    unlink(path);
}

static void test_round_trips(void **state) {
    (void)state;
    for (int channels = 1; channels <= 3; channels += 2) {
        round_trip("a.pfm", 7, 5, channels);
        round_trip("a.PFM", 1, 1, channels);
        round_trip("a.exr", 7, 5, channels);
        round_trip("a.exr", 1, 1, channels);
        round_trip("a.exr", 67, 33, channels); /* more than one block of 16 lines, the last one short */
        round_trip("a.exr", 1, 40, channels);
    }
}

static void test_exr_keeps_windows(void **state) {
    (void)state;
    static const char *const names[] = {"Y"};
    const char *path = in_directory("window.exr");
    image written, read;
    image_error error;
    image_pending pending;
    assert_true(image_create(&written, 10, 20, 1, &error));
    fill(&written, 1);
    written.origin_x = -3;
    written.origin_y = 5;
    written.display_width = 30;
    written.display_height = 40;
    assert_true(image_write(path, &written, names, IMAGE_RANGE_UNIT, &pending, &error));
    assert_true(image_commit(&pending, &error));
    assert_true(image_read_depth(path, &read, &error)); /* the only channel, whatever its name */
    assert_int_equal(read.origin_x, -3);
    assert_int_equal(read.origin_y, 5);
    assert_int_equal(read.display_width, 30);
    assert_int_equal(read.display_height, 40);
    assert_memory_equal(read.data, written.data, sizeof(float) * 200);
    image_free(&written);
    image_free(&read);
    unlink(path);
}

static void test_png_rounds(void **state) {
    (void)state;
    const char *path = in_directory("a.png");
    image img;
    image_error error;
    image_pending pending;
    assert_true(image_create(&img, 3, 2, 1, &error));
    img.data[0] = NAN;
    img.data[1] = 2.0f;
    assert_true(image_write(path, &img, NULL, IMAGE_RANGE_UNIT, &pending, &error));
    assert_true(image_commit(&pending, &error));
    size_t count;
    unsigned char *bytes = read_bytes(path, &count);
    assert_memory_equal(bytes, "\x89PNG\r\n\x1a\n", 8);
    assert_int_equal(bytes[19], 3); /* width */
    assert_int_equal(bytes[23], 2);
    free(bytes);
    image_free(&img);
    unlink(path);
}

static void test_write_errors(void **state) {
    (void)state;
    static const char *const names[] = {"Y"};
    static const char *const bad[] = {"no/such/directory/a.exr", "no/such/directory/a.pfm", "a.jpg", "a", ".exr"};
    image img;
    image_error error;
    image_pending pending;
    assert_true(image_create(&img, 3, 2, 1, &error));
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
        assert_false(image_write(bad[i], &img, names, IMAGE_RANGE_UNIT, &pending, &error));
        check_message(&error, bad[i]);
        assert_false(image_commit(&pending, &error));
    }
    /* discarded: neither the file nor the temporary stays (teardown's rmdir sees to the latter) */
    assert_true(image_write(in_directory("d.exr"), &img, names, IMAGE_RANGE_UNIT, &pending, &error));
    image_discard(&pending);
    image_discard(&pending);
    assert_int_not_equal(access(in_directory("d.exr"), F_OK), 0);
    image_free(&img);
}

/* A disk that fills up while the file is written: a message, and nothing stays (teardown's rmdir sees to that). */
static void test_full_disk(void **state) {
    (void)state;
    static const char *const names[] = {"Y"};
    static const char *const files[] = {"full.exr", "full.pfm", "full.png"};
    struct rlimit old, small;
    image img;
    image_error error;
    image_pending pending;
    assert_true(image_create(&img, 200, 100, 1, &error));
    fill(&img, 7); /* noise, so that compression does not make it fit */
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &old), 0);
    small = old;
    small.rlim_cur = 2000;
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
    for (size_t i = 0; i < sizeof files / sizeof *files; ++i) {
        int ok = image_write(in_directory(files[i]), &img, names, IMAGE_RANGE_UNIT, &pending, &error);
        if (ok || !strstr(error.text, files[i])) {
            setrlimit(RLIMIT_FSIZE, &old);
            fail_msg("%s: %s", files[i], ok ? "written" : error.text);
        }
    }
    setrlimit(RLIMIT_FSIZE, &old);
    signal(SIGXFSZ, SIG_DFL);
    image_free(&img);
}

/* ---- PFM ---------------------------------------------------------------------------------------------------------- */

static void test_pfm_orders(void **state) {
    (void)state;
    const char *path = in_directory("o.pfm");
    /* two rows of two: bottom row first; 1.0 = 3f800000 */
    static const unsigned char little[] = "Pf\n2 2\n-1.0\n\0\0\x40\x40\0\0\x80\x40\0\0\x80\x3f\0\0\0\x40";
    static const unsigned char big[] = "Pf 2 2 1\n\x40\x40\0\0\x40\x80\0\0\x3f\x80\0\0\x40\0\0\0";
    static const float expected[] = {1.0f, 2.0f, 3.0f, 4.0f};
    image img;
    image_error error;
    for (int order = 0; order < 2; ++order) {
        write_bytes(path, order ? big : little, (order ? sizeof big : sizeof little) - 1);
        assert_true(image_read_depth(path, &img, &error));
        assert_memory_equal(img.data, expected, sizeof expected);
        image_free(&img);
    }
    unlink(path);
}

static void test_pfm_selection(void **state) {
    (void)state;
    const char *path = in_directory("s.pfm");
    char spec[600];
    static const unsigned char color[] = "PF\n1 1\n-1.0\n\0\0\x80\x3f\0\0\0\x40\0\0\x40\x40";
    image img;
    image_error error;
    write_bytes(path, color, sizeof color - 1);
    assert_false(image_read_depth(path, &img, &error));
    check_message(&error, path);
    snprintf(spec, sizeof spec, "%s:G", path);
    assert_true(image_read_depth(spec, &img, &error));
    assert_true(img.channels == 1 && img.data[0] == 2.0f);
    image_free(&img);
    snprintf(spec, sizeof spec, "%s:Q", path);
    assert_false(image_read_depth(spec, &img, &error));
    check_message(&error, path);
    assert_false(image_read_normals(spec, &img, &error));
    snprintf(spec, sizeof spec, "%s:", path);
    assert_false(image_read_depth(spec, &img, &error));
    unlink(path);
}

static void test_bad_pfm(void **state) {
    (void)state;
    static const char *const bad[] = {
        "",
        "Pf",
        "Pf\n",
        "P6\n2 2\n255\n0123456789abcdef",
        "Pf\n2\n-1\n",
        "Pf\n2 2\n-1.0",
        "Pf\n2 2\n-1.0\n",
        "Pf\n2 2\n-1.0\n0123456789abcde", /* a byte short */
        "PF\n2 2\n-1.0\n0123456789abcdef",
        "Pf\n0 2\n-1.0\n0123456789abcdef",
        "Pf\n-2 2\n-1.0\n0123456789abcdef",
        "Pf\n2.5 2\n-1.0\n0123456789abcdef",
        "Pf\n2 2\n0\n0123456789abcdef",
        "Pf\n2 2\nnan\n0123456789abcdef",
        "Pf\n2 2\nabc\n0123456789abcdef",
        "Pf\n1e9 1e9\n-1.0\n0123456789abcdef",
        "Pf\n32768 32768\n-1.0\n0123456789abcdef",
        "Pf\n99999999999999999999 2\n-1.0\n0123456789abcdef",
        "Pf\n2 22222222222222222222222222222222222222222222222222222222222222222222222222222222222222222\n-1\n",
    };
    const char *path = in_directory("bad.pfm");
    image img;
    image_error error;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
        write_bytes(path, bad[i], strlen(bad[i]));
        assert_false(image_read_depth(path, &img, &error));
        assert_null(img.data);
        check_message(&error, path);
        assert_false(image_read_normals(path, &img, &error));
        check_message(&error, path);
    }
    unlink(path);
}

/* ---- EXR ---------------------------------------------------------------------------------------------------------- */

typedef struct channel_spec {
    const char *name;
    exr_pixel_type_t type;
} channel_spec;

typedef struct exr_spec {
    exr_storage_t storage;
    exr_compression_t compression;
    exr_tile_level_mode_t levels;
    int min_x, min_y, width, height, tile;
    channel_spec channels[8];
    const char *part;
} exr_spec;

static uint16_t half_of(int i) { /* exact: small integers 0..15 */
    uint16_t e = 0;
    if (i == 0)
        return 0;
    while (i >> (e + 1))
        ++e;
    return (uint16_t)((uint16_t)((e + 15) << 10) | (uint16_t)(((i << (10 - e)) & 0x3ff)));
}

static int value_at(int channel, int x, int y) {
    return (x * 3 + y * 5 + channel * 7 + (x * y) / 3) & 15;
}

static void exr_ok(exr_result_t result) {
    if (result != EXR_ERR_SUCCESS)
        fail_msg("%s", exr_get_default_error_message(result));
}

static void fill_block(exr_encode_pipeline_t *pipe, const exr_spec *spec, int x0, int y0, unsigned char *buffer) {
    size_t used = 0;
    for (int c = 0; c < pipe->channel_count; ++c) {
        exr_coding_channel_info_t *info = pipe->channels + c;
        int index = 0, size = info->data_type == EXR_PIXEL_HALF ? 2 : 4;
        while (strcmp(spec->channels[index].name, info->channel_name) != 0)
            ++index;
        info->encode_from_ptr = buffer + used;
        info->user_pixel_stride = size;
        info->user_line_stride = size * info->width;
        for (int y = 0; y < info->height; ++y)
            for (int x = 0; x < info->width; ++x, used += (size_t)size) {
                int v = value_at(index, x0 + x, y0 + y);
                float f = (float)v;
                uint32_t u = (uint32_t)v;
                uint16_t h = half_of(v);
                memcpy(buffer + used,
                       size == 2                           ? (void *)&h
                       : info->data_type == EXR_PIXEL_UINT ? (void *)&u
                                                           : (void *)&f,
                       (size_t)size);
            }
    }
}

static void write_exr_file(const char *path, const exr_spec *parts, int count) {
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    exr_context_t context;
    exr_ok(exr_start_write(&context, path, EXR_WRITE_FILE_DIRECTLY, &init));
    for (int p = 0; p < count; ++p) {
        const exr_spec *spec = parts + p;
        int index;
        exr_attr_box2i_t display, data;
        exr_attr_v2f_t center;
        memset(&center, 0, sizeof center);
        display.min.x = display.min.y = 0;
        display.max.x = spec->width - 1;
        display.max.y = spec->height - 1;
        data.min.x = spec->min_x;
        data.min.y = spec->min_y;
        data.max.x = spec->min_x + spec->width - 1;
        data.max.y = spec->min_y + spec->height - 1;
        exr_ok(exr_add_part(context, spec->part ? spec->part : "p", spec->storage, &index));
        exr_ok(exr_initialize_required_attr(context, index, &display, &data, 1.0f, &center, 1.0f,
                                            EXR_LINEORDER_INCREASING_Y, spec->compression));
        for (int c = 0; spec->channels[c].name; ++c)
            exr_ok(exr_add_channel(context, index, spec->channels[c].name, spec->channels[c].type,
                                   EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1));
        if (spec->storage == EXR_STORAGE_TILED)
            exr_ok(exr_set_tile_descriptor(context, index, (uint32_t)spec->tile, (uint32_t)spec->tile, spec->levels,
                                           EXR_TILE_ROUND_DOWN));
    }
    exr_ok(exr_write_header(context));
    unsigned char *buffer = malloc(1 << 20);
    assert_non_null(buffer);
    for (int p = 0; p < count; ++p) {
        const exr_spec *spec = parts + p;
        exr_chunk_info_t chunk;
        if (spec->storage == EXR_STORAGE_SCANLINE) {
            int lines;
            exr_ok(exr_get_scanlines_per_chunk(context, p, &lines));
            for (int y = 0; y < spec->height; y += lines) {
                exr_encode_pipeline_t pipe = EXR_ENCODE_PIPELINE_INITIALIZER;
                exr_ok(exr_write_scanline_chunk_info(context, p, spec->min_y + y, &chunk));
                exr_ok(exr_encoding_initialize(context, p, &chunk, &pipe));
                fill_block(&pipe, spec, 0, y, buffer);
                exr_ok(exr_encoding_choose_default_routines(context, p, &pipe));
                exr_ok(exr_encoding_run(context, p, &pipe));
                exr_ok(exr_encoding_destroy(context, &pipe));
            }
            continue;
        }
        int levels = 1;
        if (spec->levels == EXR_TILE_MIPMAP_LEVELS)
            exr_ok(exr_get_tile_levels(context, p, &levels, &levels));
        for (int level = 0; level < levels; ++level) {
            int lw = spec->width >> level, lh = spec->height >> level;
            lw = lw ? lw : 1;
            lh = lh ? lh : 1;
            for (int ty = 0; ty * spec->tile < lh; ++ty)
                for (int tx = 0; tx * spec->tile < lw; ++tx) {
                    exr_encode_pipeline_t pipe = EXR_ENCODE_PIPELINE_INITIALIZER;
                    exr_ok(exr_write_tile_chunk_info(context, p, tx, ty, level, level, &chunk));
                    exr_ok(exr_encoding_initialize(context, p, &chunk, &pipe));
                    fill_block(&pipe, spec, tx * spec->tile + level, ty * spec->tile, buffer);
                    exr_ok(exr_encoding_choose_default_routines(context, p, &pipe));
                    exr_ok(exr_encoding_run(context, p, &pipe));
                    exr_ok(exr_encoding_destroy(context, &pipe));
                }
        }
    }
    free(buffer);
    exr_ok(exr_finish(&context));
}

static void check_channel(const image *img, int channel, int index) {
    for (int y = 0; y < img->height; ++y)
        for (int x = 0; x < img->width; ++x) {
            float v = img->data[(y * img->width + x) * img->channels + channel];
            if (v != (float)value_at(index, x, y))
                fail_msg("channel %d at %d, %d: %g instead of %d", index, x, y, (double)v, value_at(index, x, y));
        }
}

/* Every storage, compression and pixel type; the layer's channels in an order of the writer's choosing. */
static void test_exr_storage(void **state) {
    (void)state;
    static const exr_compression_t compressions[] = {EXR_COMPRESSION_NONE, EXR_COMPRESSION_RLE, EXR_COMPRESSION_ZIPS,
                                                     EXR_COMPRESSION_ZIP, EXR_COMPRESSION_PIZ};
    static const exr_pixel_type_t types[] = {EXR_PIXEL_HALF, EXR_PIXEL_FLOAT, EXR_PIXEL_UINT};
    const char *path = in_directory("storage.exr");
    for (int storage = 0; storage < 3; ++storage) /* lines, tiles, tiles with levels */
        for (size_t c = 0; c < sizeof compressions / sizeof *compressions; ++c)
            for (int t = 0; t < 3; ++t) {
                exr_spec spec;
                image img;
                image_error error;
                memset(&spec, 0, sizeof spec);
                spec.storage = storage ? EXR_STORAGE_TILED : EXR_STORAGE_SCANLINE;
                spec.levels = storage == 2 ? EXR_TILE_MIPMAP_LEVELS : EXR_TILE_ONE_LEVEL;
                spec.compression = compressions[c];
                spec.min_x = storage == 1 ? 4 : 0;
                spec.min_y = storage == 1 ? -7 : 3;
                spec.width = 45;
                spec.height = 70;
                spec.tile = 16;
                spec.channels[0].name = "left.Normal.Z";
                spec.channels[1].name = "left.Normal.X";
                spec.channels[2].name = "left.Normal.Y";
                spec.channels[3].name = "left.Depth.Z";
                for (int k = 0; k < 4; ++k) /* mixed types in one file, too */
                    spec.channels[k].type = types[(t + (k == 3)) % 3];
                write_exr_file(path, &spec, 1);
                if (!image_read_depth(path, &img, &error))
                    fail_msg("%s", error.text);
                assert_int_equal(img.width, 45);
                assert_int_equal(img.height, 70);
                assert_int_equal(img.origin_x, spec.min_x);
                assert_int_equal(img.origin_y, spec.min_y);
                check_channel(&img, 0, 3);
                image_free(&img);
                if (!image_read_normals(path, &img, &error))
                    fail_msg("%s", error.text);
                check_channel(&img, 0, 1);
                check_channel(&img, 1, 2);
                check_channel(&img, 2, 0);
                image_free(&img);
            }
    unlink(path);
}

static void test_exr_parts(void **state) {
    (void)state;
    const char *path = in_directory("parts.exr");
    char spec[600];
    static const exr_spec parts[3] = {
        {.storage = EXR_STORAGE_SCANLINE,
         .compression = EXR_COMPRESSION_ZIP,
         .width = 9,
         .height = 5,
         .channels = {{"R", EXR_PIXEL_HALF}, {"G", EXR_PIXEL_HALF}, {"B", EXR_PIXEL_HALF}},
         .part = "beauty"},
        {.storage = EXR_STORAGE_TILED,
         .compression = EXR_COMPRESSION_PIZ,
         .width = 9,
         .height = 5,
         .tile = 4,
         .channels = {{"a", EXR_PIXEL_FLOAT}, {"Z", EXR_PIXEL_FLOAT}},
         .part = "depth"},
        {.storage = EXR_STORAGE_SCANLINE,
         .compression = EXR_COMPRESSION_NONE,
         .width = 8,
         .height = 5,
         .channels = {{"b", EXR_PIXEL_FLOAT},
                      {"c", EXR_PIXEL_FLOAT},
                      {"X", EXR_PIXEL_FLOAT},
                      {"Y", EXR_PIXEL_FLOAT},
                      {"Z", EXR_PIXEL_FLOAT}},
         .part = "normal"}};
    image img;
    image_error error;
    write_exr_file(path, parts, 3);
    if (!image_read_depth(path, &img, &error)) /* Z of the part that has no X beside it */
        fail_msg("%s", error.text);
    assert_int_equal(img.width, 9);
    check_channel(&img, 0, 1);
    image_free(&img);
    if (!image_read_normals(path, &img, &error)) /* the part called normal */
        fail_msg("%s", error.text);
    check_channel(&img, 0, 2);
    check_channel(&img, 2, 4);
    image_free(&img);
    snprintf(spec, sizeof spec, "%s:normal.Z", path);
    assert_true(image_read_depth(spec, &img, &error));
    check_channel(&img, 0, 4);
    image_free(&img);
    snprintf(spec, sizeof spec, "%s:beauty", path);
    assert_true(image_read_normals(spec, &img, &error));
    check_channel(&img, 1, 1);
    image_free(&img);
    static const char *const across[] = {"R", "depth.Z"}, *const sizes[] = {"R", "b"};
    assert_true(image_read_channels(path, across, 2, &img, &error));
    check_channel(&img, 0, 0);
    check_channel(&img, 1, 1);
    image_free(&img);
    assert_false(image_read_channels(path, sizes, 2, &img, &error));
    check_message(&error, path);
    unlink(path);
}

/* Which channel is taken for depth, and which layer for normals; null: the file leaves it open, and the message lists
 * what there is. */
static void test_exr_guesses(void **state) {
    (void)state;
    static const struct {
        const char *names[7], *depth, *normals;
    } cases[] = {
        {{"anything"}, "anything", NULL},
        {{"R", "G", "B", "Z"}, "Z", "R"},
        {{"R", "G", "B", "A", "depth"}, "depth", "R"},
        {{"R", "G", "B", "Depth.Z", "N.X", "N.Y", "N.Z"}, "Depth.Z", "N.X"},
        {{"View.Depth.Z", "View.Normal.X", "View.Normal.Y", "View.Normal.Z"}, "View.Depth.Z", "View.Normal.X"},
        {{"depth.R", "View.normals.R", "View.normals.G", "View.normals.B"}, "depth.R", "View.normals.R"},
        {{"Position.X", "Position.Y", "Position.Z", "Mist.Z"}, "Mist.Z", NULL},
        {{"Position.X", "Position.Y", "Position.Z"}, NULL, NULL},
        {{"X", "Y", "Z"}, NULL, "X"},
        {{"R", "G", "B"}, NULL, "R"},
        {{"a.Depth.Z", "b.Depth.Z"}, NULL, NULL},
        {{"a.Normal.X", "a.Normal.Y", "a.Normal.Z", "b.Normal.X", "b.Normal.Y", "b.Normal.Z"}, NULL, NULL},
        {{"Normal.X", "Normal.Y", "Normal.Z", "DenoisingNormal.X", "DenoisingNormal.Y", "DenoisingNormal.Z", "Z"},
         "Z",
         "Normal.X"},
    };
    const char *path = in_directory("guess.exr");
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i)
        for (int what = 0; what < 2; ++what) {
            const char *expected = what ? cases[i].normals : cases[i].depth;
            exr_spec spec;
            image img;
            image_error error;
            int index = -1, count = 0;
            memset(&spec, 0, sizeof spec);
            spec.width = 6;
            spec.height = 4;
            for (; count < 7 && cases[i].names[count]; ++count) {
                spec.channels[count].name = cases[i].names[count];
                spec.channels[count].type = EXR_PIXEL_HALF;
                if (expected && strcmp(expected, cases[i].names[count]) == 0)
                    index = count;
            }
            write_exr_file(path, &spec, 1);
            int ok = what ? image_read_normals(path, &img, &error) : image_read_depth(path, &img, &error);
            if (ok != (expected != NULL))
                fail_msg("case %d, %s: %s", (int)i, what ? "normals" : "depth", ok ? "found one" : error.text);
            if (ok) {
                check_channel(&img, 0, index);
                image_free(&img);
            } else {
                check_message(&error, path);
                if (count > 1 && !what)
                    assert_non_null(strstr(error.text, cases[i].names[0]));
            }
        }
    unlink(path);
}

static void test_exr_selection(void **state) {
    (void)state;
    static const struct {
        const char *selection;
        int normals, index; /* expected channel, -1: an error */
    } cases[] = {
        {"view.Depth.Z", 0, 0}, {"Depth.Z", 0, 0},  {"Depth", 0, 0},   {"Z", 0, -1},     {"epth.Z", 0, -1},
        {"AO.R", 0, 4},         {"nothing", 0, -1}, {"view.AO", 0, 4}, {"Normal", 1, 1}, {"view.Normal", 1, 1},
        {"view", 1, -1},        {"AO", 1, -1},      {"Norma", 1, -1},  {"", 0, -1},      {"Normal", 0, -1},
    };
    static const exr_spec file = {.width = 6,
                                  .height = 4,
                                  .channels = {{"view.Depth.Z", EXR_PIXEL_FLOAT},
                                               {"view.Normal.X", EXR_PIXEL_FLOAT},
                                               {"view.Normal.Y", EXR_PIXEL_FLOAT},
                                               {"view.Normal.Z", EXR_PIXEL_FLOAT},
                                               {"view.AO.R", EXR_PIXEL_HALF}}};
    const char *path = in_directory("select.exr");
    char spec[600];
    write_exr_file(path, &file, 1);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        image img;
        image_error error;
        snprintf(spec, sizeof spec, "%s:%s", path, cases[i].selection);
        int ok = cases[i].normals ? image_read_normals(spec, &img, &error) : image_read_depth(spec, &img, &error);
        if (ok != (cases[i].index >= 0))
            fail_msg("%s: %s", cases[i].selection, ok ? "found one" : error.text);
        if (ok) {
            check_channel(&img, 0, cases[i].index);
            image_free(&img);
        } else {
            check_message(&error, path);
        }
    }
    unlink(path);
}

/* A file whose own name looks like FILE:CHANNEL. */
static void test_colon_in_name(void **state) {
    (void)state;
    static const exr_spec file = {.width = 6, .height = 4, .channels = {{"q", EXR_PIXEL_FLOAT}}};
    const char *path = in_directory("a.exr:q");
    char spec[600], found[600];
    image img;
    image_error error;
    write_exr_file(in_directory("b:c.exr"), &file, 1);
    assert_true(image_read_depth(in_directory("b:c.exr"), &img, &error));
    image_free(&img);
    snprintf(spec, sizeof spec, "%s:q", in_directory("b:c.exr"));
    assert_true(image_read_depth(spec, &img, &error));
    image_free(&img);
    assert_true(image_spec_path(spec, found, sizeof found));
    assert_string_equal(found, in_directory("b:c.exr"));
    write_bytes(path, "x", 1);
    assert_true(image_spec_path(path, found, sizeof found));
    assert_string_equal(found, path);
    unlink(path);
    unlink(in_directory("b:c.exr"));
}

static void test_missing(void **state) {
    (void)state;
    static const char *const bad[] = {"missing.exr", "missing.pfm", "missing.png", "missing"};
    image img;
    image_error error;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
        assert_false(image_read_depth(in_directory(bad[i]), &img, &error));
        check_message(&error, bad[i]);
        assert_false(image_read_normals(in_directory(bad[i]), &img, &error));
        check_message(&error, bad[i]);
    }
    assert_false(image_read_depth("tests/data", &img, &error));
}

/* ---- damage ------------------------------------------------------------------------------------------------------- */

/* Whatever the bytes: an image of the promised size, or a message; no crash, no leak (run under a sanitizer). */
static void try_read(const char *path) {
    for (int what = 0; what < 2; ++what) {
        image img;
        image_error error;
        int ok = what ? image_read_normals(path, &img, &error) : image_read_depth(path, &img, &error);
        if (ok) {
            float sum = 0.0f;
            for (size_t i = 0; i < (size_t)img.width * (size_t)img.height * (size_t)img.channels; ++i)
                sum += img.data[i];
            assert_true(sum <= 0.0f || sum > 0.0f || isnan(sum));
            image_free(&img);
        } else {
            assert_null(img.data);
            check_message(&error, path);
        }
    }
}

static exr_spec damaged_spec(int variant) {
    static const exr_compression_t compressions[] = {EXR_COMPRESSION_NONE, EXR_COMPRESSION_RLE, EXR_COMPRESSION_ZIPS,
                                                     EXR_COMPRESSION_ZIP, EXR_COMPRESSION_PIZ};
    exr_spec spec;
    memset(&spec, 0, sizeof spec);
    spec.storage = variant % 2 ? EXR_STORAGE_TILED : EXR_STORAGE_SCANLINE;
    spec.compression = compressions[variant / 2];
    spec.width = 21;
    spec.height = 37;
    spec.tile = 16;
    spec.channels[0].name = "N.X";
    spec.channels[1].name = "N.Y";
    spec.channels[2].name = "N.Z";
    spec.channels[3].name = "Z";
    spec.channels[0].type = spec.channels[1].type = spec.channels[2].type = EXR_PIXEL_HALF;
    spec.channels[3].type = EXR_PIXEL_FLOAT;
    return spec;
}

static void test_truncated_exr(void **state) {
    (void)state;
    const char *path = in_directory("cut.exr");
    for (int variant = 0; variant < 10; ++variant) {
        exr_spec spec = damaged_spec(variant);
        size_t size;
        image img;
        image_error error;
        write_exr_file(path, &spec, 1);
        unsigned char *bytes = read_bytes(path, &size);
        for (size_t cut = 0; cut < size; cut += cut < 600 || cut + 40 > size ? 7 : 97) {
            write_bytes(path, bytes, cut);
            try_read(path);
        }
        write_bytes(path, bytes, size - 1); /* the last block is incomplete: no image with a hole in it */
        assert_false(image_read_depth(path, &img, &error));
        check_message(&error, path);
        write_bytes(path, bytes, size / 2);
        assert_false(image_read_depth(path, &img, &error));
        free(bytes);
    }
    unlink(path);
}

static void test_corrupt_exr(void **state) {
    (void)state;
    const char *path = in_directory("bad.exr");
    const char *rounds_text = getenv("GTAO_IMAGE_FUZZ"); /* more of the same, by hand */
    int rounds = rounds_text ? atoi(rounds_text) : 60;
    uint32_t seed = 1;
    for (int variant = 0; variant < 10; ++variant) {
        exr_spec spec = damaged_spec(variant);
        size_t size;
        write_exr_file(path, &spec, 1);
        unsigned char *bytes = read_bytes(path, &size), *copy = malloc(size);
        assert_non_null(copy);
        for (int round = 0; round < rounds; ++round) {
            memcpy(copy, bytes, size);
            for (int k = 0; k < 1 + round % 4; ++k) {
                seed = seed * 1664525u + 1013904223u;
                size_t range = round % 2 && size > 700 ? 700 : size; /* the header and its tables, half of the time */
                size_t at = 4 + (seed >> 8) % (range - 4);
                copy[at] = (unsigned char)(seed >> 4 & 1 ? seed >> 24 : copy[at] ^ (1u << (seed >> 5 & 7)));
            }
            write_bytes(path, copy, size);
            try_read(path);
        }
        free(copy);
        free(bytes);
    }
    unlink(path);
}

/* A data window of the size of a small country must cost neither memory nor time. */
static void test_huge_exr(void **state) {
    (void)state;
    static const int32_t sizes[][4] = {{0, 0, 0x7ffffffe, 0x7ffffffe},
                                       {0, 0, 40000, 10},
                                       {0, 0, 10, 40000},
                                       {-2000000000, -2000000000, 2000000000, 2000000000},
                                       {5, 5, 4, 4},
                                       {0, 0, 32767, 32767}};
    const char *path = in_directory("huge.exr");
    exr_spec spec = damaged_spec(6);
    size_t size, at = 0;
    write_exr_file(path, &spec, 1);
    unsigned char *bytes = read_bytes(path, &size);
    for (size_t i = 0; i + 11 < size && !at; ++i)
        if (memcmp(bytes + i, "dataWindow\0", 11) == 0)
            at = i + 11 + 6 + 4; /* "box2i\0", size */
    assert_true(at > 0);
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; ++i) {
        image img;
        image_error error;
        for (int k = 0; k < 4; ++k)
            for (int b = 0; b < 4; ++b)
                bytes[at + (size_t)(4 * k + b)] = (unsigned char)((uint32_t)sizes[i][k] >> (8 * b));
        write_bytes(path, bytes, size);
        assert_false(image_read_depth(path, &img, &error));
        check_message(&error, path);
    }
    free(bytes);
    unlink(path);
}

static void test_scenes(void **state) {
    (void)state;
    static const char *const scenes[] = {"study", "courtyard", "scans"};
    for (int i = 0; i < 3; ++i) {
        char path[64];
        image img;
        image_error error;
        snprintf(path, sizeof path, "tests/data/%s.exr", scenes[i]);
        if (!image_read_depth(path, &img, &error))
            fail_msg("%s", error.text);
        assert_int_equal(img.width, 640);
        assert_int_equal(img.height, 360);
        assert_true(img.data[0] > 0.0f);
        image_free(&img);
        if (!image_read_normals(path, &img, &error))
            fail_msg("%s", error.text);
        const float *n = img.data + 3 * (300 * 640 + 320);
        assert_true(fabsf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1.0f) < 1e-3f);
        image_free(&img);
        strcat(path, ":AO.R");
        assert_true(image_read_depth(path, &img, &error));
        image_free(&img);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trips),   cmocka_unit_test(test_exr_keeps_windows),
        cmocka_unit_test(test_png_rounds),    cmocka_unit_test(test_write_errors),
        cmocka_unit_test(test_full_disk),     cmocka_unit_test(test_pfm_orders),
        cmocka_unit_test(test_pfm_selection), cmocka_unit_test(test_bad_pfm),
        cmocka_unit_test(test_exr_storage),   cmocka_unit_test(test_exr_parts),
        cmocka_unit_test(test_exr_guesses),   cmocka_unit_test(test_exr_selection),
        cmocka_unit_test(test_colon_in_name), cmocka_unit_test(test_missing),
        cmocka_unit_test(test_truncated_exr), cmocka_unit_test(test_corrupt_exr),
        cmocka_unit_test(test_huge_exr),      cmocka_unit_test(test_scenes),
    };
    return cmocka_run_group_tests_name("image", tests, setup, teardown);
}
