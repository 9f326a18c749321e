/* The sweep of gtao.h against closed forms and against brute force over every pixel to the image border. */
#include "examples/common/image.h"
#include "tests/reference/library.h"

static const double pi = REF_PI;

/* ---- helpers ---- */

static gtao_desc desc_of(const ref_image *img, double radius, int slices) {
    gtao_desc desc = describe_image(img);
    desc.radius = (float)radius;
    desc.slices = slices;
    return desc;
}

static result sweep(const gtao_desc *desc, const gtao_sweep_options *given, int horizons) {
    const size_t count = (size_t)desc->width * (size_t)desc->height;
    result r = result_of(desc);
    gtao_sweep_options options = {0};
    gtao_output output = {0};
    if (given)
        options = *given;
    output.visibility = r.visibility;
    output.bent_normals = r.bent;
    if (horizons)
        options.horizons = r.horizons = allocate(2 * (size_t)desc->slices * count * sizeof(float));
    const size_t size = gtao_sweep_scratch_size(desc, &output, &options) + gtao_sweep_work_size(desc, &options);
    void *scratch = allocate(size);
    const gtao_result status = gtao_sweep_compute(desc, &output, &options, scratch, size, NULL, NULL);
    CHECK(status == GTAO_OK, "%s", gtao_result_string(status));
    free(scratch);
    return r;
}

static void set_normal(ref_image *img, int x, int y, double nx, double ny, double nz) {
    float *to = &img->normals[3 * ((size_t)y * (size_t)img->width + (size_t)x)];
    const double size = sqrt(nx * nx + ny * ny + nz * nz);
    to[0] = (float)(nx / size);
    to[1] = (float)(ny / size);
    to[2] = (float)(nz / size);
}

/* Normals of a height map by central differences. */
static void derive_normals(ref_image *img, int wrap) {
    const int w = img->width, h = img->height;
    for (int y = 0; y < h; y++) {
        for (int x = 0; x < w; x++) {
            const int x0 = x > 0 ? x - 1 : wrap ? w - 1 : x, x1 = x < w - 1 ? x + 1 : wrap ? 0 : x;
            const int y0 = y > 0 ? y - 1 : wrap ? h - 1 : y, y1 = y < h - 1 ? y + 1 : wrap ? 0 : y;
            const double across = wrap || (x > 0 && x < w - 1) ? 2.0 : 1.0,
                         down = wrap || (y > 0 && y < h - 1) ? 2.0 : 1.0;
            const double dx = ((double)img->z[y * w + x1] - (double)img->z[y * w + x0]) / (across * img->sx);
            const double dy = ((double)img->z[y1 * w + x] - (double)img->z[y0 * w + x]) / (down * img->sy);
            set_normal(img, x, y, dx, dy, -1.0);
        }
    }
}

/* ---- open planes ---- */

/* Nothing lies above a plane, whatever its tilt, the camera and the radius. */
static void open_planes(void **state) {
    (void)state;
    for (int orthographic = 0; orthographic < 2; orthographic++) {
        for (int tilt = 0; tilt <= 80; tilt += 20) {
            for (int variant = 0; variant < 4; variant++) {
                const double a = tilt * pi / 180.0, azimuth = 0.7 + 1.9 * variant;
                const ref_shape plane = {REF_PLANE,
                                         {0.0, 0.0, orthographic ? 100.0 : 10.0},
                                         {sin(a) * cos(azimuth), sin(a) * sin(azimuth), -cos(a)},
                                         0.0,
                                         0.0};
                ref_image img =
                    orthographic ? ref_image_orthographic(97, 66, 0.125) : ref_image_perspective(97, 66, 80.0);
                ref_render(&img, NULL, &plane, 1);
                gtao_desc desc = desc_of(&img, variant & 1 ? 2.0 : HUGE_VAL, 5 + variant);
                desc.falloff = variant == 3 ? 0.25f : 0.0f;
                result r = sweep(&desc, NULL, 0);
                for (int y = 0; y < img.height; y++) {
                    for (int x = 0; x < img.width; x++) {
                        const int at = y * img.width + x;
                        const float *n = &img.normals[3 * at];
                        double facing = -(double)n[2];
                        if (!orthographic) {
                            const double rx = (x + 0.5 - img.cx) / img.fx, ry = (y + 0.5 - img.cy) / img.fy;
                            facing =
                                -((double)n[0] * rx + (double)n[1] * ry + (double)n[2]) / sqrt(rx * rx + ry * ry + 1);
                        }
                        if (!isfinite(img.z[at]) || facing < 0.01 ||
                            img.z[at] > 1000.0f) /* not at the vanishing line */
                            continue;
                        CHECK_NEAR(r.visibility[at], 1.0, 1e-3, "plane, tilt %d, variant %d, at %d %d", tilt, variant,
                                   x, y);
                        const double normal[3] = {(double)n[0], (double)n[1], (double)n[2]};
                        CHECK(degrees_between(&r.bent[3 * at], normal) < 0.1, "plane: bent normal off by %g degrees",
                              degrees_between(&r.bent[3 * at], normal));
                    }
                }
                result_free(&r);
                ref_image_free(&img);
            }
        }
    }
}

/* ---- closed forms ---- */

static void check_center(const ref_image *img, double radius, double visibility, double tolerance, const char *what,
                         double parameter) {
    const gtao_desc desc = desc_of(img, radius, 64);
    const int at = (img->height / 2) * img->width + img->width / 2;
    const double up[3] = {0.0, 0.0, -1.0};
    result r = sweep(&desc, NULL, 0);
    CHECK_NEAR(r.visibility[at], visibility, tolerance, "%s %g", what, parameter);
    if (what[0] != 'w')
        CHECK(degrees_between(&r.bent[3 * at], up) < 0.2, "%s %g: bent normal off by %g degrees", what, parameter,
              degrees_between(&r.bent[3 * at], up));
    result_free(&r);
}

/* The bottom line of a groove sees cos(beta). */
static void grooves(void **state) {
    (void)state;
    for (int beta = 5; beta <= 75; beta += 5) {
        for (int turn = 0; turn < 4; turn++) {
            const double b = beta * pi / 180.0, c = cos(0.25 * pi * turn), s = sin(0.25 * pi * turn);
            const ref_shape groove[2] = {{REF_PLANE, {5.05, 5.05, 20.0}, {-sin(b) * c, -sin(b) * s, -cos(b)}, 0.0, 0.0},
                                         {REF_PLANE, {5.05, 5.05, 20.0}, {sin(b) * c, sin(b) * s, -cos(b)}, 0.0, 0.0}};
            ref_image img = ref_image_orthographic(101, 101, 0.1);
            ref_render(&img, NULL, groove, 2);
            set_normal(&img, 50, 50, 0.0, 0.0, -1.0);
            check_center(&img, HUGE_VAL, cos(b), 0.003, "groove", beta);
            ref_image_free(&img);
        }
    }
}

/* The apex of a cone sees cos^2(beta); and a cone whose bottom is flat, whose walls leave the radius at elevation b. */
static void pits(void **state) {
    (void)state;
    for (int beta = 5; beta <= 75; beta += 5) {
        const double b = beta * pi / 180.0;
        const ref_shape pit = {REF_CONE, {5.05, 5.05, 100.0}, {0.0, 0.0, -1.0}, tan(b), 0.0};
        ref_image img = ref_image_orthographic(101, 101, 0.1);
        ref_render(&img, NULL, &pit, 1);
        img.z[50 * 101 + 50] = 100.0f;
        set_normal(&img, 50, 50, 0.0, 0.0, -1.0);
        check_center(&img, HUGE_VAL, cos(b) * cos(b), 0.003, "pit", beta);
        ref_image_free(&img);
    }
    for (int wall = 10; wall <= 70; wall += 10) {
        const double slope = tan(wall * pi / 180.0);
        double low = 0.0, high = 0.5 * pi;
        for (int i = 0; i < 60; i++) {
            const double middle = 0.5 * (low + high);
            if (slope * (cos(middle) - 0.2) > sin(middle))
                low = middle;
            else
                high = middle;
        }
        const ref_shape pit[2] = {{REF_CONE, {15.05, 15.05, 100.0 + 2.4 * slope}, {0.0, 0.0, -1.0}, slope, 0.0},
                                  {REF_PLANE, {15.05, 15.05, 100.0}, {0.0, 0.0, -1.0}, 0.0, 0.0}};
        ref_image img = ref_image_orthographic(301, 301, 0.1);
        ref_render(&img, NULL, pit, 2);
        check_center(&img, 12.0, cos(low) * cos(low), 0.003, "pit within a radius", wall);
        ref_image_free(&img);
    }
}

/* Before a long wall whose upper edge stands at elevation beta: (1 + cos(beta)) / 2. */
static void walls(void **state) {
    (void)state;
    enum { SIZE = 801, HERE = SIZE / 2 };
    for (int distance = 10; distance <= 30; distance += 10) {
        for (int beta = 10; beta <= 70; beta += 20) {
            const double b = beta * pi / 180.0;
            ref_image img = ref_image_orthographic(SIZE, SIZE, 0.5);
            for (int y = 0; y < SIZE; y++) {
                for (int x = 0; x < SIZE; x++) {
                    const int along = beta % 40 == 10 ? x : y;
                    img.z[y * SIZE + x] = (float)(along < HERE + distance ? 500.0 : 500.0 - 0.5 * distance * tan(b));
                    set_normal(&img, x, y, 0.0, 0.0, -1.0);
                }
            }
            check_center(&img, HUGE_VAL, 0.5 * (1.0 + cos(b)), 0.003, "wall", beta);
            ref_image_free(&img);
        }
    }
}

/* ---- brute force ---- */

static ref_image terrain(void) {
    image elevation;
    image_error error;
    CHECK(image_read_depth("tests/data/jacksboro.pfm", &elevation, &error), "%s", error.text);
    ref_image img = ref_image_orthographic(elevation.width, elevation.height, 92.0);
    img.sx = 75.0;
    for (int i = 0; i < img.width * img.height; i++)
        img.z[i] = 5000.0f - elevation.data[i];
    derive_normals(&img, 0);
    image_free(&elevation);
    return img;
}

static double random_unit(unsigned *state) {
    *state = *state * 1664525u + 1013904223u;
    return (double)(*state >> 8) / 16777216.0;
}

/* Cobbles with grooves between them and a rough surface; repeats. */
static ref_image material(int size) {
    enum { CELLS = 8 };
    ref_image img = ref_image_orthographic(size, size, 1.0);
    double cell[CELLS * CELLS][3];
    unsigned seed = 1;
    for (int i = 0; i < CELLS * CELLS; i++) {
        cell[i][0] = (i % CELLS + random_unit(&seed)) * size / CELLS;
        cell[i][1] = (i / CELLS + random_unit(&seed)) * size / CELLS;
        cell[i][2] = random_unit(&seed);
    }
    for (int y = 0; y < size; y++) {
        for (int x = 0; x < size; x++) {
            double first = HUGE_VAL, second = HUGE_VAL, level = 0.0, height;
            for (int i = 0; i < CELLS * CELLS; i++) {
                double dx = fabs(x + 0.5 - cell[i][0]), dy = fabs(y + 0.5 - cell[i][1]), d;
                dx = fmin(dx, size - dx);
                dy = fmin(dy, size - dy);
                d = hypot(dx, dy);
                if (d < first)
                    second = first, first = d, level = cell[i][2];
                else if (d < second)
                    second = d;
            }
            const double edge = 4.0 * (second - first) * CELLS / size;
            height = (0.6 + 0.15 * level) * (1.0 - exp(-edge * edge));
            for (int octave = 1; octave <= 5; octave++) {
                const double f = (double)(1 << octave) * 6.0 * pi / size;
                height += 0.03 / octave * sin(f * x + 1.3 * octave) * cos(f * y + 2.1 * octave);
            }
            img.z[y * size + x] = (float)(1000.0 - height * size / 16.0);
        }
    }
    derive_normals(&img, 1);
    return img;
}

/* Blocks and sheds of a town on a plain: upright walls, flat and slanted roofs. */
static ref_image town(void) {
    enum { W = 480, H = 360 };
    ref_image img = ref_image_orthographic(W, H, 0.25);
    unsigned seed = 5;
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++)
            img.z[y * W + x] = 100.0f, set_normal(&img, x, y, 0.0, 0.0, -1.0);
    for (int i = 0; i < 30; i++) {
        const int w = 16 + (int)(60.0 * random_unit(&seed)), h = 16 + (int)(60.0 * random_unit(&seed));
        const int x0 = (int)((W - w) * random_unit(&seed)), y0 = (int)((H - h) * random_unit(&seed));
        const double top = 4.0 + 12.0 * random_unit(&seed), slope = i % 3 == 0 ? 0.3 * random_unit(&seed) : 0.0;
        for (int y = y0; y < y0 + h; y++) {
            for (int x = x0; x < x0 + w; x++) {
                const double z = 100.0 - top - slope * 0.25 * (x - x0);
                if (z > (double)img.z[y * W + x])
                    continue;
                img.z[y * W + x] = (float)z;
                set_normal(&img, x, y, -slope, 0.0, -1.0);
            }
        }
    }
    return img;
}

static ref_image room(int orthographic) {
    ref_shape shapes[16];
    const int count = ref_cluttered_scene(shapes, 16);
    const ref_pose pose = {
        {-2.4, -1.4, 0.0}, {1.0, 0.0, 0.0}, {0.0, 0.9805807, -0.1961161}, {0.0, 0.1961161, 0.9805807}};
    ref_image img = orthographic ? ref_image_orthographic(300, 220, 0.017) : ref_image_perspective(300, 220, 60.0);
    ref_render(&img, orthographic ? &pose : NULL, shapes, count);
    return img;
}

typedef struct comparison {
    double rmse, mean, worst, bent_95;
} comparison;

static int compare_doubles(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static comparison compare(const ref_image *img, const gtao_desc *desc, ref_border border, int stride) {
    const ref_settings settings = {(double)desc->radius,
                                   (double)desc->falloff,
                                   desc->slices,
                                   NULL,
                                   0.5,
                                   border,
                                   desc->weighting == GTAO_WEIGHTING_UNIFORM};
    double *degrees = allocate((size_t)(img->width * img->height) * sizeof *degrees);
    comparison c = {0};
    int pixels = 0;
    result r = sweep(desc, NULL, 0);
    for (int y = stride / 2; y < img->height; y += stride) {
        for (int x = stride / 2; x < img->width; x += stride) {
            const int at = y * img->width + x;
            double bent[3];
            if (!isfinite(img->z[at])) {
                CHECK(r.visibility[at] == 1.0f, "sky at %d %d: %g", x, y, (double)r.visibility[at]);
                continue;
            }
            const double off = (double)r.visibility[at] - ref_heightfield(img, &settings, x, y, bent);
            c.rmse += off * off;
            c.mean += off;
            c.worst = fmax(c.worst, fabs(off));
            degrees[pixels++] = degrees_between(&r.bent[3 * at], bent);
        }
    }
    CHECK(pixels > 100, "only %d pixels", pixels);
    c.rmse = sqrt(c.rmse / pixels);
    c.mean /= pixels;
    qsort(degrees, (size_t)pixels, sizeof *degrees, compare_doubles);
    c.bent_95 = degrees[pixels * 95 / 100];
    free(degrees);
    result_free(&r);
    return c;
}

static void check_brute_force(const ref_image *img, gtao_desc desc, ref_border border, int stride, double rmse,
                              double degrees, const char *what) {
    desc.border = (gtao_border)border;
    const comparison c = compare(img, &desc, border, stride);
    printf("# note: sweep, %s: RMSE %.4f, mean %+.4f, worst %.3f, bent normals %.2f degrees at 95 %%\n", what, c.rmse,
           c.mean, c.worst, c.bent_95);
    CHECK(c.rmse < rmse, "%s: RMSE %g", what, c.rmse);
    CHECK(c.bent_95 < degrees, "%s: bent normals off by %g degrees", what, c.bent_95);
}

static void check_scene(ref_image img, ref_border border, double radius, int stride, const char *name) {
    char what[96];
    gtao_desc desc = desc_of(&img, HUGE_VAL, 64);
    snprintf(what, sizeof what, "%s, 64 slices", name);
    check_brute_force(&img, desc, border, stride, 0.004, 1.2, what);
    desc.slices = 32;
    snprintf(what, sizeof what, "%s, 32 slices", name);
    check_brute_force(&img, desc, border, stride, 0.006, 1.5, what);
    desc.radius = (float)radius;
    desc.falloff = 0.25f;
    snprintf(what, sizeof what, "%s, radius, falloff 0.25", name);
    check_brute_force(&img, desc, border, stride, 0.006, 1.5, what);
    desc.falloff = 0.0f;
    desc.weighting = GTAO_WEIGHTING_UNIFORM;
    snprintf(what, sizeof what, "%s, radius, no falloff, uniform", name);
    check_brute_force(&img, desc, border, stride, 0.01, 2.5, what);
    ref_image_free(&img);
}

static void brute_force_terrain(void **state) {
    (void)state;
    check_scene(terrain(), REF_BORDER_OPEN, 4000.0, 28, "terrain");
}

static void brute_force_material(void **state) {
    (void)state;
    check_scene(material(320), REF_BORDER_WRAP, 50.0, 29, "tileable material");
}

static void brute_force_clamped(void **state) {
    (void)state;
    ref_image img = material(160);
    gtao_desc desc = desc_of(&img, HUGE_VAL, 32);
    check_brute_force(&img, desc, REF_BORDER_CLAMP, 12, 0.006, 1.2, "clamped material, 32 slices");
    ref_image_free(&img);
}

static void brute_force_town(void **state) {
    (void)state;
    check_scene(town(), REF_BORDER_OPEN, 20.0, 33, "town");
}

static void brute_force_room(void **state) {
    (void)state;
    check_scene(room(1), REF_BORDER_OPEN, 1.0, 17, "room, orthographic");
    check_scene(room(0), REF_BORDER_OPEN, 1.0, 17, "room, perspective");
}

static double rms_difference(const float *a, const float *b, int count) {
    double sum = 0.0;
    for (int i = 0; i < count; i++)
        sum += ((double)a[i] - (double)b[i]) * ((double)a[i] - (double)b[i]);
    return sqrt(sum / count);
}

/* Spherical harmonics, 9 planes. march: by gtao_compute, every pixel. */
static float *coefficients(const gtao_desc *given, int march) {
    gtao_desc desc = *given;
    gtao_output output = {0};
    output.sh = allocate(9 * (size_t)desc.width * (size_t)desc.height * sizeof(float));
    desc.every_pixel = march;
    desc.noise = GTAO_NOISE_NONE;
    const size_t size = march ? gtao_scratch_size(&desc)
                              : gtao_sweep_scratch_size(&desc, &output, NULL) + gtao_sweep_work_size(&desc, NULL);
    void *scratch = allocate(size);
    const gtao_result status = march ? gtao_compute(&desc, &output, scratch, size, NULL)
                                     : gtao_sweep_compute(&desc, &output, NULL, scratch, size, NULL, NULL);
    CHECK(status == GTAO_OK, "%s", gtao_result_string(status));
    free(scratch);
    return output.sh;
}

/* Against the exact integrals over what sorted intervals leave open; 32 slices. */
static void check_coefficients(ref_image img, double radius, int stride, double most, const char *what) {
    const ref_settings settings = {radius, 0.0, 32, NULL, 1.0, REF_BORDER_OPEN, 0};
    const ref_slabs slabs = {.thickness = HUGE_VAL, .surface_px = 4.0, .whole = 1};
    const gtao_desc desc = desc_of(&img, radius, 32);
    const size_t plane = (size_t)img.width * (size_t)img.height;
    float *sh = coefficients(&desc, 0);
    double squares[9] = {0.0}, worst = 0.0;
    int pixels = 0;
    for (int y = stride / 2; y < img.height; y += stride)
        for (int x = stride / 2; x < img.width; x += stride) {
            double expected[9];
            const size_t at = (size_t)(y * img.width + x);
            if (!isfinite(img.z[at]))
                continue;
            ref_arcs_sh(&img, &settings, &slabs, x, y, expected);
            for (size_t i = 0; i < 9; i++)
                squares[i] += ((double)sh[i * plane + at] - expected[i]) * ((double)sh[i * plane + at] - expected[i]);
            pixels++;
        }
    for (int i = 0; i < 9; i++)
        worst = fmax(worst, sqrt(squares[i] / pixels));
    printf("# note: sweep, %s: %d pixels, coefficients within RMSE %.4f\n", what, pixels, worst);
    CHECK(pixels > 100 && worst < most, "%s: %d pixels, RMSE %g", what, pixels, worst);
    free(sh);
    ref_image_free(&img);
}

static void harmonics(void **state) {
    (void)state;
    check_coefficients(terrain(), HUGE_VAL, 28, 0.001, "terrain, harmonics");
    check_coefficients(town(), HUGE_VAL, 37, 0.006, "town, harmonics");
    check_coefficients(room(0), HUGE_VAL, 17, 0.006, "room, perspective, harmonics");
    check_coefficients(room(1), 1.0, 17, 0.006, "room, radius, harmonics");
}

/* Uniformly weighted, wrapped and with a falloff: as the march, which is compared with quadrature elsewhere. */
static void harmonics_of_the_march(void **state) {
    (void)state;
    ref_image img = material(128);
    gtao_desc desc = desc_of(&img, 25.0, 16);
    desc.border = GTAO_BORDER_WRAP;
    desc.falloff = 0.25f;
    desc.weighting = GTAO_WEIGHTING_UNIFORM;
    float *a = coefficients(&desc, 0), *b = coefficients(&desc, 1);
    for (int i = 0; i < 9; i++) {
        const double rms = rms_difference(a + 128 * 128 * i, b + 128 * 128 * i, 128 * 128);
        CHECK(rms < 0.004, "coefficient %d: RMS %g", i, rms);
    }
    free(a);
    free(b);
    ref_image_free(&img);
}

/* ---- what only the sweep has ---- */

/* A map that repeats may begin anywhere: moved, it gives the moved result, and no seam. */
static void seams(void **state) {
    (void)state;
    enum { SIZE = 160, DX = 61, DY = 94 };
    ref_image img = material(SIZE), moved = ref_image_orthographic(SIZE, SIZE, 1.0);
    float *expected = allocate(SIZE * SIZE * sizeof *expected);
    for (int y = 0; y < SIZE; y++)
        for (int x = 0; x < SIZE; x++) {
            const int from = (y + DY) % SIZE * SIZE + (x + DX) % SIZE;
            moved.z[y * SIZE + x] = img.z[from];
            memcpy(&moved.normals[3 * (y * SIZE + x)], &img.normals[3 * from], 3 * sizeof(float));
        }
    for (int radius = 0; radius < 2; radius++) {
        gtao_desc desc = desc_of(&img, radius ? 30.0 : HUGE_VAL, 32);
        desc.border = GTAO_BORDER_WRAP;
        desc.falloff = radius ? 0.25f : 0.0f;
        result a = sweep(&desc, NULL, 0);
        desc.depth = moved.z;
        desc.normals = moved.normals;
        result b = sweep(&desc, NULL, 0);
        double seam = 0.0;
        for (int y = 0; y < SIZE; y++)
            for (int x = 0; x < SIZE; x++)
                expected[y * SIZE + x] = a.visibility[(y + DY) % SIZE * SIZE + (x + DX) % SIZE];
        /* the old seam in the new map, and the other way round */
        for (int i = 0; i < SIZE; i++)
            for (int k = -1; k <= 1; k++) {
                const int at[2] = {i * SIZE + (SIZE + k) % SIZE, (SIZE + k) % SIZE * SIZE + i};
                for (int j = 0; j < 2; j++)
                    seam += pow((double)b.visibility[at[j]] - (double)expected[at[j]], 2.0);
            }
        seam = sqrt(seam / (6.0 * SIZE));
        const double all = rms_difference(expected, b.visibility, SIZE * SIZE);
        printf("# note: sweep, moved by %d %d: RMS %.5f, at the seam %.5f\n", DX, DY, all, seam);
        CHECK(all < 0.005, "moved: RMS %g", all);
        CHECK(seam < 1.5 * all + 1e-4, "moved: RMS %g, at the seam %g", all, seam);
        result_free(&a);
        result_free(&b);
    }
    free(expected);
    ref_image_free(&img);
    ref_image_free(&moved);
}

/* In a groove along y the horizon in the direction phi stands at tan(beta) |cos(phi)|. */
static void horizon_maps(void **state) {
    (void)state;
    enum { SIZE = 101, SLICES = 12 };
    const double tangent = 0.8;
    ref_image img = ref_image_orthographic(SIZE, SIZE, 0.1);
    for (int y = 0; y < SIZE; y++)
        for (int x = 0; x < SIZE; x++) {
            img.z[y * SIZE + x] = (float)(20.0 - tangent * 0.1 * abs(x - SIZE / 2));
            set_normal(&img, x, y, x < SIZE / 2 ? tangent : x > SIZE / 2 ? -tangent : 0.0, 0.0, -1.0);
        }
    const gtao_desc desc = desc_of(&img, HUGE_VAL, SLICES);
    result r = sweep(&desc, NULL, 1);
    for (int k = 0; k < 2 * SLICES; k++) {
        const double phi = pi * (k / 2 + 0.5) / SLICES + (k & 1 ? pi : 0.0);
        const size_t plane = (size_t)k * SIZE * SIZE;
        CHECK_NEAR(r.horizons[plane + 50 * SIZE + 50], atan2(1.0, tangent * fabs(cos(phi))), 0.01, "direction %d", k);
        /* on the left wall, the wall itself, which is the normal's hemisphere, or the other one, far off */
        if (cos(phi) < 0.0)
            CHECK_NEAR(r.horizons[plane + 50 * SIZE + 20], atan2(1.0, -tangent * cos(phi)), 0.01, "wall, direction %d",
                       k);
    }
    result_free(&r);
    ref_image_free(&img);
}

typedef struct tile {
    const ref_image *whole;
    int x, y;
    int calls;
} tile;

/* Every pixel of the whole map on the line beyond the tile, the nearest one, farthest first. */
static int beyond_tile(void *user, double x, double y, double dx, double dy, int capacity, float *distance,
                       float *depth) {
    tile *t = user;
    const double unit = 1.0 / fmax(fabs(dx), fabs(dy));
    int n = 0;
    CHECK(fabs(hypot(dx, dy) - 1.0) < 1e-9, "direction %g %g", dx, dy);
    for (int k = capacity; k >= 1; k--) {
        const double u = x + t->x + k * unit * dx, v = y + t->y + k * unit * dy;
        const int i = (int)floor(u), j = (int)floor(v);
        if (i < 0 || j < 0 || i >= t->whole->width || j >= t->whole->height)
            continue;
        distance[n] = (float)(k * unit);
        depth[n++] = t->whole->z[j * t->whole->width + i];
    }
    t->calls++;
    return n;
}

/* A tile that is told what lies beyond it sees what the whole map sees; without, it would not. */
static void tiles(void **state) {
    (void)state;
    enum { X = 130, Y = 110, W = 120, H = 100 };
    ref_image img = terrain(), part = ref_image_orthographic(W, H, 92.0);
    part.sx = img.sx;
    float *expected = allocate(W * H * sizeof *expected);
    gtao_desc desc = desc_of(&img, HUGE_VAL, 16);
    result all = sweep(&desc, NULL, 0);
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++) {
            const int from = (y + Y) * img.width + x + X;
            part.z[y * W + x] = img.z[from];
            memcpy(&part.normals[3 * (y * W + x)], &img.normals[3 * from], 3 * sizeof(float));
            expected[y * W + x] = all.visibility[from];
        }
    {
        tile t = {&img, X, Y, 0};
        gtao_sweep_options options = {0};
        desc = desc_of(&part, HUGE_VAL, 16);
        result alone = sweep(&desc, NULL, 0);
        options.beyond = beyond_tile;
        options.beyond_user = &t;
        options.beyond_reach = 400;
        result told = sweep(&desc, &options, 0);
        const double without = rms_difference(expected, alone.visibility, W * H),
                     with = rms_difference(expected, told.visibility, W * H);
        printf("# note: sweep, tile: RMS %.5f alone, %.5f told what lies beyond\n", without, with);
        CHECK(t.calls > 0 && with < 0.001 && with < 0.1 * without, "tile: RMS %g, %g without", with, without);
        result_free(&alone);
        result_free(&told);
    }
    result_free(&all);
    free(expected);
    ref_image_free(&img);
    ref_image_free(&part);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(open_planes),
        cmocka_unit_test(grooves),
        cmocka_unit_test(pits),
        cmocka_unit_test(walls),
        cmocka_unit_test(brute_force_terrain),
        cmocka_unit_test(brute_force_material),
        cmocka_unit_test(brute_force_clamped),
        cmocka_unit_test(brute_force_town),
        cmocka_unit_test(brute_force_room),
        cmocka_unit_test(harmonics),
        cmocka_unit_test(harmonics_of_the_march),
        cmocka_unit_test(seams),
        cmocka_unit_test(horizon_maps),
        cmocka_unit_test(tiles),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
