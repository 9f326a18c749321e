/* The table baker as a user meets it: build/lut is run as a child process, and its files are read by parsers of this
 * test's own, from the formats' specifications. */
#include "tool.h"

#include "examples/common/image.h"
#include "examples/common/volume.h"
#include "gtso.h"

#include <math.h>
#include <sys/stat.h>

static int setup(void **state) {
    (void)state;
    return make_directory("lut");
}

static int teardown(void **state) {
    (void)state;
    return remove_directory();
}

/* ---- readers ------------------------------------------------------------------------------------------------------ */

static uint32_t u32(const uint8_t *b, size_t at) {
    return (uint32_t)b[at] | (uint32_t)b[at + 1] << 8 | (uint32_t)b[at + 2] << 16 | (uint32_t)b[at + 3] << 24;
}

static float f32(const uint8_t *b, size_t at) {
    uint32_t bits = u32(b, at);
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* Texel (x, y) of a BC4 block, from the definition: 8 bits of either end, 3 bits of index a texel. */
static double bc4_texel(const uint8_t *block, int x, int y) {
    uint64_t bits = 0;
    for (int i = 7; i >= 2; --i)
        bits = bits << 8 | block[i];
    int index = (int)(bits >> (3 * (4 * y + x)) & 7);
    double a = block[0] / 255.0, b = block[1] / 255.0;
    if (index < 2)
        return index ? b : a;
    if (block[0] > block[1])
        return ((8 - index) * a + (index - 1) * b) / 7;
    return index == 6 ? 0 : index == 7 ? 1 : ((6 - index) * a + (index - 1) * b) / 5;
}

enum { FORMAT_FLOAT, FORMAT_8, FORMAT_16, FORMAT_BC4 };

static double texel(const uint8_t *data, int format, const int size[3], int x, int y, int z) {
    size_t w = (size_t)size[0], h = (size_t)size[1], i = ((size_t)z * h + (size_t)y) * w + (size_t)x;
    switch (format) {
    case FORMAT_FLOAT:
        return (double)f32(data, 4 * i);
    case FORMAT_8:
        return data[i] / 255.0;
    case FORMAT_16:
        return (data[2 * i] + 256 * data[2 * i + 1]) / 65535.0;
    default: {
        size_t across = (w + 3) / 4, down = (h + 3) / 4;
        size_t block = ((size_t)z * down + (size_t)y / 4) * across + (size_t)x / 4;
        return bc4_texel(data + 8 * block, x % 4, y % 4);
    }
    }
}

static size_t data_bytes(int format, const int size[3]) {
    size_t texels = (size_t)size[0] * (size_t)size[1] * (size_t)size[2];
    size_t blocks = (size_t)((size[0] + 3) / 4) * (size_t)((size[1] + 3) / 4) * (size_t)size[2];
    return format == FORMAT_FLOAT ? 4 * texels
           : format == FORMAT_8   ? texels
           : format == FORMAT_16  ? 2 * texels
                                  : 8 * blocks;
}

static const uint8_t *parse_dds(const uint8_t *b, size_t bytes, int format, const int size[3]) {
    static const uint32_t dxgi[] = {41, 61, 56, 80};
    assert_memory_equal(b, "DDS ", 4);
    assert_int_equal(u32(b, 4), 124);
    assert_int_equal(u32(b, 8) & 0x801007u, 0x801007u); /* caps, height, width, pixel format, depth */
    assert_int_equal(u32(b, 16), size[0]);
    assert_int_equal(u32(b, 12), size[1]);
    assert_int_equal(u32(b, 24), size[2]);
    size_t pitch = data_bytes(format, size) / (size_t)size[2];
    if (format == FORMAT_BC4) {
        assert_int_equal(u32(b, 8) & 0x80008u, 0x80000u);
        assert_int_equal(u32(b, 20), pitch);
    } else {
        assert_int_equal(u32(b, 8) & 0x80008u, 0x8u);
        assert_int_equal(u32(b, 20), pitch / (size_t)size[1]);
    }
    assert_int_equal(u32(b, 76), 32);
    assert_int_equal(u32(b, 80), 4);
    assert_memory_equal(b + 84, "DX10", 4);
    assert_int_equal(u32(b, 108) & 0x1000u, 0x1000u);
    assert_int_equal(u32(b, 112), 0x200000u);
    assert_int_equal(u32(b, 128), dxgi[format]);
    assert_int_equal(u32(b, 132), 4);
    assert_int_equal(u32(b, 140), 1);
    assert_int_equal(bytes, 148 + data_bytes(format, size));
    return b + 148;
}

static const uint8_t *parse_ktx2(const uint8_t *b, size_t bytes, int format, const int size[3]) {
    static const uint32_t vulkan[] = {100, 9, 70, 139}, type_size[] = {4, 1, 2, 1}, planes[] = {4, 1, 2, 8};
    static const uint8_t identifier[] = {0xab, 0x4b, 0x54, 0x58, 0x20, 0x32, 0x30, 0xbb, 0x0d, 0x0a, 0x1a, 0x0a};
    assert_memory_equal(b, identifier, sizeof identifier);
    assert_int_equal(u32(b, 12), vulkan[format]);
    assert_int_equal(u32(b, 16), type_size[format]);
    for (size_t k = 0; k < 3; ++k)
        assert_int_equal(u32(b, 20 + 4 * k), size[k]);
    assert_int_equal(u32(b, 32), 0); /* layers, faces, levels, supercompression */
    assert_int_equal(u32(b, 36), 1);
    assert_int_equal(u32(b, 40), 1);
    assert_int_equal(u32(b, 44), 0);
    /* the data format descriptor follows the one level's index */
    size_t dfd = u32(b, 48), kvd = u32(b, 56), end = kvd + u32(b, 60);
    assert_int_equal(dfd, 80 + 24);
    assert_int_equal(u32(b, 52), u32(b, dfd));
    assert_int_equal(u32(b, 52), 4 + 24 + 16);
    assert_int_equal(u32(b, dfd + 8), 2u | 40u << 16);
    assert_int_equal(b[dfd + 12], format == FORMAT_BC4 ? 131 : 1);
    assert_int_equal(b[dfd + 14], 1);
    assert_int_equal(b[dfd + 16], format == FORMAT_BC4 ? 3 : 0);
    assert_int_equal(b[dfd + 17], format == FORMAT_BC4 ? 3 : 0);
    assert_int_equal(b[dfd + 20], planes[format]);
    assert_int_equal(b[dfd + 30], 8 * planes[format] - 1);
    assert_int_equal(b[dfd + 31], format == FORMAT_FLOAT ? 0xc0 : 0);
    assert_int_equal(kvd, dfd + u32(b, 52));
    /* keys in order, each pair padded to 4 bytes */
    char last[64] = "";
    int pairs = 0;
    size_t at = kvd;
    while (at < end) {
        size_t n = u32(b, at);
        const char *key = (const char *)b + at + 4;
        assert_true(n >= 2 && at + 4 + n <= end && memchr(key, 0, n));
        assert_true(strcmp(last, key) < 0);
        assert_int_equal(key[n - 1], 0);
        snprintf(last, sizeof last, "%s", key);
        if (strcmp(key, "KTXorientation") == 0)
            assert_string_equal(key + 15, "rdi");
        at += 4 + (n + 3) / 4 * 4;
        ++pairs;
    }
    assert_int_equal(at, end);
    assert_int_equal(pairs, 3);
    assert_int_equal(u32(b, 64) | u32(b, 68) | u32(b, 72) | u32(b, 76), 0);
    size_t begin = u32(b, 80), length = u32(b, 88);
    assert_int_equal(u32(b, 84) | u32(b, 92) | u32(b, 100), 0);
    assert_true(begin >= end && begin % 8 == 0 && begin - end < 8);
    assert_int_equal(length, data_bytes(format, size));
    assert_int_equal(u32(b, 96), length);
    assert_int_equal(bytes, begin + length);
    return b + begin;
}

/* ---- tests -------------------------------------------------------------------------------------------------------- */

static float *bake(const gtso_table_desc *t) {
    float *data = malloc(gtso_table_count(t) * sizeof *data);
    assert_non_null(data);
    assert_int_equal(gtso_bake(t, data, NULL), GTSO_OK);
    return data;
}

/* Every texel format in both containers against the library's own bake. */
static void test_volumes(void **state) {
    (void)state;
    static const char *const formats[] = {"float", "unorm8", "unorm16", "bc4"};
    static const double bound[] = {0, 0.5 / 255 + 1e-7, 0.5 / 65535 + 1e-7, 0.08};
    gtso_table_desc t;
    memset(&t, 0, sizeof t);
    t.size[0] = 16, t.size[1] = 12, t.size[2] = 9;
    float *want = bake(&t);
    for (int file = 0; file < 2; ++file)
        for (int format = 0; format < 4; ++format) {
            char command[256];
            snprintf(command, sizeof command, "--size 16,12,9 --format %s -o @/t.%s", formats[format],
                     file ? "ktx2" : "dds");
            run_well(command);
            size_t bytes;
            uint8_t *b = read_bytes(file ? "t.ktx2" : "t.dds", &bytes);
            const int size[3] = {16, 12, 9};
            const uint8_t *data = (file ? parse_ktx2 : parse_dds)(b, bytes, format, size);
            double squares = 0;
            for (int i = 0; i < 16 * 12 * 9; ++i) {
                double e = texel(data, format, size, i % 16, i / 16 % 12, i / 192) - (double)want[i];
                assert_true(fabs(e) <= bound[format]);
                squares += e * e;
            }
            assert_true(sqrt(squares / (16 * 12 * 9)) < 0.02);
            free(b);
            /* and as the programs read it back */
            volume v;
            volume_format stored;
            image_error error;
            assert_true(volume_read(in_directory(file ? "t.ktx2" : "t.dds"), &v, &stored, &error));
            assert_int_equal(stored, format);
            for (int i = 0; i < 16 * 12 * 9; ++i)
                assert_true(fabs((double)v.texels[i] - (double)want[i]) <= bound[format]);
            volume_free(&v);
            remove_file(file ? "t.ktx2" : "t.dds");
        }
    free(want);
}

/* Kinds and options reach the library: each table is that of the description they stand for. */
static void test_kinds(void **state) {
    (void)state;
    static const struct {
        const char *options;
        gtso_table_desc table;
    } cases[] = {
        {"", {GTSO_KIND_LOBE, GTSO_LOBE_BRDF, GTSO_FRAME_BENT, GTSO_FIT_JIMENEZ, GTSO_CAPS_EXACT, 0, {0}, {0}}},
        {"--lobe ggx --frame reflection",
         {GTSO_KIND_LOBE, GTSO_LOBE_GGX, GTSO_FRAME_REFLECTION, GTSO_FIT_JIMENEZ, GTSO_CAPS_EXACT, 0, {0}, {0}}},
        {"--lobe beckmann",
         {GTSO_KIND_LOBE, GTSO_LOBE_BECKMANN, GTSO_FRAME_BENT, GTSO_FIT_JIMENEZ, GTSO_CAPS_EXACT, 0, {0}, {0}}},
        {"--lobe blinn",
         {GTSO_KIND_LOBE, GTSO_LOBE_BLINN, GTSO_FRAME_BENT, GTSO_FIT_JIMENEZ, GTSO_CAPS_EXACT, 0, {0}, {0}}},
        {"--lobe phong",
         {GTSO_KIND_LOBE, GTSO_LOBE_PHONG, GTSO_FRAME_BENT, GTSO_FIT_JIMENEZ, GTSO_CAPS_EXACT, 0, {0}, {0}}},
        {"--kind cone",
         {GTSO_KIND_CONE, GTSO_LOBE_BRDF, GTSO_FRAME_BENT, GTSO_FIT_JIMENEZ, GTSO_CAPS_EXACT, 0, {0}, {0}}},
        {"--kind cone --fit drobot --caps oat",
         {GTSO_KIND_CONE, GTSO_LOBE_BRDF, GTSO_FRAME_BENT, GTSO_FIT_DROBOT, GTSO_CAPS_OAT, 0, {0}, {0}}},
        {"--kind cone --fit uludag --caps smoothstep",
         {GTSO_KIND_CONE, GTSO_LOBE_BRDF, GTSO_FRAME_BENT, GTSO_FIT_ULUDAG, GTSO_CAPS_SMOOTHSTEP, 0, {0}, {0}}},
        {"--kind brdf --f0 0.5",
         {GTSO_KIND_BRDF, GTSO_LOBE_BRDF, GTSO_FRAME_BENT, GTSO_FIT_JIMENEZ, GTSO_CAPS_EXACT, 0.5f, {0}, {0}}},
        {"--kind bent",
         {GTSO_KIND_BENT, GTSO_LOBE_BRDF, GTSO_FRAME_BENT, GTSO_FIT_JIMENEZ, GTSO_CAPS_EXACT, 0, {0}, {0}}},
        {"--scale cosine,half-sine,alpha",
         {GTSO_KIND_LOBE,
          GTSO_LOBE_BRDF,
          GTSO_FRAME_BENT,
          GTSO_FIT_JIMENEZ,
          GTSO_CAPS_EXACT,
          0,
          {0},
          {GTSO_SCALE_COSINE, GTSO_SCALE_HALF_SINE, GTSO_SCALE_ALPHA, GTSO_SCALE_DEFAULT, GTSO_SCALE_DEFAULT}}},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; ++k) {
        gtso_table_desc t = cases[k].table;
        char command[256];
        for (int i = 0; i < GTSO_AXIS_COUNT; ++i)
            t.size[i] = 8;
        float *want = bake(&t);
        size_t count = gtso_table_count(&t), bytes;
        int size[3] = {8, 8, (int)(count / 64)};
        snprintf(command, sizeof command, "%s --size 8 --format float -o @/t.dds", cases[k].options);
        run_well(command);
        uint8_t *b = read_bytes("t.dds", &bytes);
        const uint8_t *data = parse_dds(b, bytes, FORMAT_FLOAT, size);
        for (size_t i = 0; i < count; ++i)
            if (f32(data, 4 * i) < want[i] || f32(data, 4 * i) > want[i])
                fail_msg("%s: texel %zu is %g, not %g", cases[k].options, i, (double)f32(data, 4 * i), (double)want[i]);
        free(b);
        free(want);
        remove_file("t.dds");
    }
}

static void test_env(void **state) {
    (void)state;
    run_well("--kind env --size 9,5 --format float -o @/e.dds");
    const int size[3] = {9, 5, 2};
    size_t bytes;
    uint8_t *b = read_bytes("e.dds", &bytes);
    const uint8_t *data = parse_dds(b, bytes, FORMAT_FLOAT, size);
    for (int y = 0; y < 5; ++y)
        for (int x = 0; x < 9; ++x) {
            float env[2];
            gtso_env_brdf((float)x / 8.0f, (float)y / 4.0f, env);
            for (int k = 0; k < 2; ++k)
                assert_true(fabs(texel(data, FORMAT_FLOAT, size, x, y, k) - (double)env[k]) < 1e-5);
        }
    free(b);
    remove_file("e.dds");
}

/* One thread and many give the same file; so does a second run over an old file. */
static void test_threads(void **state) {
    (void)state;
    size_t a_size, b_size;
    run_well("--size 12 --threads 1 --format bc4 -o @/a.ktx2");
    run_well("--size 12 --threads 5 --format bc4 -o @/b.ktx2");
    run_well("--size 12 --threads 3 --format bc4 -o @/b.ktx2");
    uint8_t *a = read_bytes("a.ktx2", &a_size), *b = read_bytes("b.ktx2", &b_size);
    assert_int_equal(a_size, b_size);
    assert_memory_equal(a, b, a_size);
    free(a);
    free(b);
    remove_file("a.ktx2");
    remove_file("b.ktx2");
}

/* A C array compiles and holds the texels; the numbers are read from its text here. */
static void test_c_array(void **state) {
    (void)state;
    static const char *const formats[] = {"float", "unorm8", "unorm16", "bc4"};
    static const char *const heads[] = {
        "static const float my_table[512] = {", "static const uint8_t my_table[512] = {",
        "static const uint16_t my_table[512] = {", "static const uint8_t my_table[256] = {"};
    gtso_table_desc t;
    memset(&t, 0, sizeof t);
    t.size[0] = t.size[1] = t.size[2] = 8;
    float *want = bake(&t);
    for (int format = 0; format < 4; ++format) {
        char command[256];
        snprintf(command, sizeof command, "--size 8 --format %s -o @/my-table.h", formats[format]);
        run_well(command);
        size_t bytes, count = 0;
        uint8_t *b = read_bytes("my-table.h", &bytes);
        const char *at = strstr((const char *)b, heads[format]);
        assert_non_null(at);
        assert_non_null(strstr((const char *)b, "aperture 8 angle"));
        at += strlen(heads[format]);
        uint8_t blocks[256];
        for (;; ++count) {
            char *end;
            double v = strtod(at, &end);
            if (end == at)
                break;
            at = end + strspn(end, "f,");
            if (format == FORMAT_BC4) {
                assert_true(count < sizeof blocks);
                blocks[count] = (uint8_t)v;
                continue;
            }
            assert_true(count < 512);
            double scale = format == FORMAT_8 ? 255 : format == FORMAT_16 ? 65535 : 1;
            assert_true(fabs(v / scale - (double)want[count]) <= (format ? 0.5 / scale : 0) + 1e-7);
        }
        assert_int_equal(count, format == FORMAT_BC4 ? 256 : 512);
        assert_non_null(strstr(at, "};"));
        const int size[3] = {8, 8, 8};
        for (int i = 0; format == FORMAT_BC4 && i < 512; ++i)
            assert_true(fabs(texel(blocks, format, size, i % 8, i / 8 % 8, i / 64) - (double)want[i]) < 0.12);
        free(b);
    }
    remove_file("my-table.h");
    free(want);
}

static void test_exr(void **state) {
    (void)state;
    static const char *const names[] = {"Y"};
    gtso_table_desc t;
    memset(&t, 0, sizeof t);
    t.size[0] = 8, t.size[1] = 9, t.size[2] = 10;
    float *want = bake(&t);
    run_well("--size 8,9,10 -o @/t.exr");
    image img;
    image_error error;
    assert_true(image_read_channels(in_directory("t.exr"), names, 1, &img, &error));
    assert_int_equal(img.width, 8);
    assert_int_equal(img.height, 90);
    assert_memory_equal(img.data, want, 720 * sizeof *want);
    image_free(&img);
    free(want);
    remove_file("t.exr");
}

static void test_slices(void **state) {
    (void)state;
    size_t bytes;
    run_well("--kind brdf --size 8 --slices @/s.png -o @/t.dds");
    uint8_t *b = read_bytes("s.png", &bytes);
    assert_memory_equal(b, "\x89PNG\r\n\x1a\n", 8);
    assert_memory_equal(b + 12, "IHDR", 4);
    assert_true(b[18] * 256 + b[19] > 500 && bytes > 10000);
    free(b);
    assert_true(exists("t.dds"));
    remove_file("t.dds");
    remove_file("s.png");
}

/* Rows for each size, errors falling with it; those of one row are recomputed here. */
static void test_stats(void **state) {
    (void)state;
    run_well("--kind cone --stats --points 2000 --size 12");
    double last = 1;
    int rows = 0, own = 0;
    for (char *line = printed; line && *line; line = strchr(line, '\n')) {
        int a, b, c;
        double bytes, seconds, rmse, p999, most, rmse16, rmse8, bc4;
        line += *line == '\n';
        if (sscanf(line, "| %d x %d x %d | %lf | %lf | %lf | %lf | %lf | %lf | %lf | %lf |", &a, &b, &c, &bytes,
                   &seconds, &rmse, &p999, &most, &rmse16, &rmse8, &bc4) != 11)
            continue;
        ++rows;
        assert_true(a == b && b == c && fabs(bytes - (double)a * b * c) < 0.5);
        assert_true(rmse > 0 && p999 > rmse && most >= p999 && most <= 1 && fabs(rmse16 - rmse) < 1e-4);
        assert_true(rmse8 > 0.9 * rmse && bc4 > 0.9 * rmse8);
        if (a == 12) {
            own = 1;
            continue;
        }
        assert_true(rmse < last);
        last = rmse;
        if (a != 32)
            continue;
        /* other points, so about the same */
        gtso_table_desc t;
        memset(&t, 0, sizeof t);
        t.kind = GTSO_KIND_CONE;
        float *data = bake(&t);
        double squares = 0;
        uint32_t seed = 1;
        for (int i = 0; i < 2000; ++i) {
            float u[3];
            gtso_point p;
            memset(&p, 0, sizeof p);
            for (int k = 0; k < 3; ++k) {
                seed = seed * 1664525u + 1013904223u;
                u[k] = (float)(seed >> 8) / 16777216.0f;
            }
            p.aperture_rad = 1.57079633f * u[0], p.beta_rad = 3.14159265f * u[1], p.roughness = u[2];
            double e = (double)gtso_table_sample(&t, data, &p) - (double)gtso_table_exact(&t, &p);
            squares += e * e;
        }
        double mine = sqrt(squares / 2000);
        if (rmse > 1.6 * mine || mine > 1.6 * rmse)
            fail_msg("RMSE of 32^3: %g printed, %g here", rmse, mine);
        free(data);
    }
    assert_int_equal(rows, 7);
    assert_true(own);
}

static void test_help(void **state) {
    (void)state;
    run_well("--help");
    assert_non_null(strstr(printed, "--kind lobe|cone|brdf|bent|env"));
}

static void test_errors(void **state) {
    (void)state;
    run_badly("", "-o, --slices, --stats or --dump");
    run_badly("--bogus", "--bogus: unknown option");
    run_badly("-o", "-o: needs a value");
    run_badly("--kind --size 8", "--kind: needs a value");
    run_badly("--stats=1", "--stats: takes no value");
    run_badly("--kind disc -o @/t.dds", "--kind disc");
    run_badly("--lobe disc -o @/t.dds", "--lobe disc");
    run_badly("--frame x -o @/t.dds", "--frame x");
    run_badly("--kind cone --fit x -o @/t.dds", "--fit x");
    run_badly("--kind cone --caps x -o @/t.dds", "--caps x");
    run_badly("--format rgb -o @/t.dds", "--format rgb");
    run_badly("--kind brdf --f0 0 -o @/t.dds", "--f0 0");
    run_badly("--kind brdf --f0 nan -o @/t.dds", "--f0 nan");
    run_badly("--kind brdf --f0 1.5 -o @/t.dds", "--f0 1.5");
    run_badly("--size 8,8 -o @/t.dds", "--size: 2 numbers");
    run_badly("--size 8,8,8,8 -o @/t.dds", "--size: 4 numbers");
    run_badly("--size 8.5 -o @/t.dds", "--size 8.5");
    run_badly("--size nan -o @/t.dds", "--size nan");
    run_badly("--size 8,,8 -o @/t.dds", "--size 8,,8");
    run_badly("--size 4 -o @/t.dds", "--size: ");
    run_badly("--size 100 -o @/t.dds", "--size: ");
    run_badly("--size 9 --format bc4 -o @/t.dds", "--size: BC4");
    run_badly("--kind brdf --size 8,8,64,64 -o @/t.dds", "--size: 4096 slices");
    run_badly("--scale angle,angle -o @/t.dds", "--scale: 2 names");
    run_badly("--scale angle,angle,bogus -o @/t.dds", "--scale angle,angle,bogus");
    run_badly("--scale edge,angle,angle -o @/t.dds", "--scale: ");
    run_badly("--kind cone --lobe ggx -o @/t.dds", "--lobe: not with --kind cone");
    run_badly("--kind brdf --frame bent -o @/t.dds", "--frame: not with --kind brdf");
    run_badly("--fit drobot -o @/t.dds", "--fit: not with --kind lobe");
    run_badly("--caps oat -o @/t.dds", "--caps: not with --kind lobe");
    run_badly("--f0 0.1 -o @/t.dds", "--f0: not with --kind lobe");
    run_badly("--kind env --stats", "--stats: not with --kind env");
    run_badly("--kind env --slices @/s.png", "--slices: not with --kind env");
    run_badly("--kind env --size 300 -o @/t.dds", "--size 300");
    run_badly("--points 10 --stats", "--points 10");
    run_badly("--points 1000 -o @/t.dds", "--points: only with --stats");
    run_badly("--format float --stats", "--format: only with -o");
    run_badly("--format bc4 -o @/t.exr", "--format bc4");
    run_badly("--threads 0 -o @/t.dds", "--threads 0");
    run_badly("-o @/t.tga", "-o ");
    run_badly("-o @/t", "unknown format");
    run_badly("-o @/missing/t.dds", "its directory is missing");
    run_badly("-o @/t.dds --slices @/t.dds", "must end in .png");
    run_badly("-o @", "unknown format");
    run_badly("--slices @/s.exr", "must end in .png");
}

/* The second file cannot be written: the first does not appear either. */
static void test_all_or_nothing(void **state) {
    (void)state;
    assert_int_equal(mkdir(in_directory("s.png"), 0777), 0);
    assert_int_equal(run("--size 8 -o @/t.dds --slices @/s.png"), 2);
    assert_non_null(strstr(message, "not a regular file"));
    assert_false(exists("t.dds"));
    assert_int_equal(rmdir(in_directory("s.png")), 0);
}

/* Files that are not what they say. */
static void test_reader_refuses(void **state) {
    (void)state;
    run_well("--size 8 -o @/t.dds");
    run_well("--size 8 -o @/t.ktx2");
    for (int file = 0; file < 2; ++file) {
        const char *name = file ? "t.ktx2" : "t.dds";
        size_t bytes;
        uint8_t *b = read_bytes(name, &bytes);
        for (int damage = 0; damage < 5; ++damage) {
            uint8_t *copy = malloc(bytes);
            size_t length = bytes;
            assert_non_null(copy);
            memcpy(copy, b, bytes);
            if (damage == 0)
                length -= 1;
            else if (damage == 1)
                length = 40;
            else if (damage == 2)
                memset(copy + (file ? 12 : 128), 0xee, 4); /* format */
            else if (damage == 3)
                memset(copy + (file ? 20 : 12), 0xff, 4); /* width, height */
            else
                copy[1] ^= 1;
            write_bytes("bad", copy, length);
            volume v;
            volume_format format;
            image_error error;
            assert_false(volume_read(in_directory("bad"), &v, &format, &error));
            assert_non_null(strstr(error.text, "/bad: "));
            assert_null(v.texels);
            free(copy);
        }
        free(b);
        remove_file(name);
    }
    remove_file("bad");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_volumes), cmocka_unit_test(test_kinds),          cmocka_unit_test(test_env),
        cmocka_unit_test(test_threads), cmocka_unit_test(test_c_array),        cmocka_unit_test(test_exr),
        cmocka_unit_test(test_slices),  cmocka_unit_test(test_stats),          cmocka_unit_test(test_help),
        cmocka_unit_test(test_errors),  cmocka_unit_test(test_all_or_nothing), cmocka_unit_test(test_reader_refuses),
    };
    return cmocka_run_group_tests_name("lut", tests, setup, teardown);
}
