/* Fuzz target over description and data: no crash, no sanitizer report, results in range, and the widest kernel gives
 * the same bits as the scalar one, the first with all that can be skipped skipped and the second with nothing.
 *
 *   clang -fsanitize=fuzzer,address,undefined    the libFuzzer target (tests/fuzz/fuzz.sh)
 *   -DFUZZ_STANDALONE                            a program: replays the files named, or N random inputs (default 1000)
 */
#define GTAO_IMPLEMENTATION
#include "gtao.h"

#include "../unit/inputs.h"

#include <stdio.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* ---- a description from bytes --------------------------------------------------------------------------------- */

typedef struct reader {
    const uint8_t *data;
    size_t size, at;
} reader;

/* Starts over at the end, so that few bytes fill an image. */
static uint32_t take(reader *r) {
    if (r->at >= r->size)
        r->at = 0;
    return r->size ? r->data[r->at++] : 0;
}

static uint32_t take32(reader *r) {
    uint32_t a = take(r), b = take(r), c = take(r);
    return a << 24 | b << 16 | c << 8 | take(r);
}

static int take_below(reader *r, int limit) {
    return (int)(take(r) % (uint32_t)limit);
}

/* Mostly plain numbers, sometimes any bits at all. */
static float take_float(reader *r) {
    static const uint32_t special[] = {0x7FC00000u, 0x7F800000u, 0xFF800000u, 0,           0x80000000u,
                                       1,           0x7F7FFFFFu, 0x0DA24260u, 0x7149F2CAu, 0xBF800000u};
    uint32_t tag = take(r);
    if (tag < 160)
        return (float)(tag + 1) / 16.0f;
    if (tag < 200)
        return -(float)(tag - 159) / 8.0f;
    if (tag < 230)
        return float_from_bits(special[tag % 10]);
    return float_from_bits(take32(r));
}

static float take_fraction(reader *r) {
    return (float)take_below(r, 65) / 64.0f;
}

static layout take_layout(reader *r) {
    layout l = {0, 0, 0};
    uint32_t tag = take(r);
    l.offset = (tag & 3u) * 4;
    l.pad = (tag >> 2 & 3u) * 4;
    l.flipped = (int)(tag >> 4 & 1u);
    return l;
}

static void take_setting(reader *r, setting *s, int *width, int *height) {
    gtao_desc *d = &s->desc;
    uint32_t flags = take32(r);
    memset(s, 0, sizeof *s);
    *width = 1 + take_below(r, 37);
    *height = 1 + take_below(r, 19);
    s->normals = (flags & 1u) != 0;
    s->given = flags & 2u ? WITH_MASK : 0;
    d->depth_kind = (gtao_depth_kind)take_below(r, 4);
    d->camera.projection = (flags & 4u) || d->depth_kind == GTAO_DEPTH_HEIGHT ? GTAO_ORTHOGRAPHIC : GTAO_PERSPECTIVE;
    d->device_scale = take_float(r);
    d->device_bias = take_float(r);
    if (flags & 8u)
        d->sky_z = take_float(r);
    if (flags & 16u)
        d->normal_components = 4;
    for (int i = 0; i < 9 && (flags & 32u); i++)
        d->normal_to_view[i] = take_float(r);
    for (int i = 0; i < 3 && (flags & 64u); i++)
        d->normal_axes[i] = take_float(r);
    d->camera.fx = d->camera.sx = take_float(r);
    if (flags & 128u)
        d->camera.fy = d->camera.sy = take_float(r);
    d->camera.off_center = (flags & 256u) != 0;
    d->camera.cx = take_float(r);
    d->camera.cy = take_float(r);
    d->border = (gtao_border)take_below(r, 3);
    d->radius = take_float(r);
    d->falloff = flags & 512u ? take_fraction(r) : 0.0f;
    d->max_radius_px = flags & 1024u ? take_below(r, 64) : 0;
    d->preset = (gtao_preset)take_below(r, 4);
    d->slices = flags & 2048u ? take_below(r, 9) : 0;
    d->steps = flags & 4096u ? take_below(r, 33) : 0;
    d->every_pixel = (flags & 8192u) != 0;
    d->step_power = flags & 16384u ? 0.25f + 7.75f * take_fraction(r) : 0.0f;
    d->thin_blend = flags & 32768u ? take_fraction(r) : 0.0f;
    d->estimator = (gtao_estimator)(flags >> 16 & 1u);
    d->weighting = (gtao_weighting)(flags >> 17 & 1u);
    d->noise = (gtao_noise)take_below(r, 3);
    d->frame = take32(r);
    if (flags >> 30 == 3) { /* occluders with thickness */
        s->given |= (int)(take(r) & (WITH_MAP | WITH_BACK | WITH_LAYERS));
        d->thickness = take_float(r);
        d->estimator = GTAO_ESTIMATOR_NORMALIZED;
        d->thin_blend = 0.0f;
    }
    /* Now and then a description that should be rejected. */
    switch (flags >> 18) {
    case 1:
        d->slices = (int)take32(r);
        break;
    case 2:
        d->steps = (int)take32(r);
        break;
    case 3:
        d->falloff = take_float(r);
        break;
    case 4:
        d->thin_blend = take_float(r);
        break;
    case 5:
        d->step_power = take_float(r);
        break;
    case 6:
        d->border = (gtao_border)(int)take32(r);
        break;
    case 7:
        d->max_radius_px = (int)take32(r);
        break;
    case 8:
        d->noise = (gtao_noise)(int)take32(r);
        break;
    case 9:
        d->preset = (gtao_preset)(int)take32(r);
        break;
    }
    /* Enough samples to go everywhere, few enough to be quick. */
    if (d->slices > 16 && d->slices <= 64)
        d->slices %= 16;
    if (d->steps > 64 && d->steps <= 256)
        d->steps %= 64;
    if ((flags & 31u) == 31u)
        d->tolerance = take_fraction(r);
}

static void fill(plane *p, size_t floats, reader *r) {
    for (int y = 0; y < p->rows; y++)
        for (size_t i = 0; i < floats; i++) {
            float f = take_float(r);
            memcpy(plane_row(p, y) + i * sizeof f, &f, sizeof f);
        }
}

/* ---- checks --------------------------------------------------------------------------------------------------- */

/* What is being computed, for the message. */
static gtao_desc current;

static void complain(const char *what, float value) {
    const gtao_desc *d = &current;
    fprintf(stderr, "fuzz_compute: %s (%g)\n", what, (double)value);
    fprintf(stderr, "%dx%d, depth kind %d, device %g %g, sky %g, %s normals of %d, camera %d: f %g %g, c %g %g (%d), ",
            d->width, d->height, (int)d->depth_kind, (double)d->device_scale, (double)d->device_bias, (double)d->sky_z,
            d->normals ? "given" : "derived", d->normal_components, (int)d->camera.projection, (double)d->camera.fx,
            (double)d->camera.fy, (double)d->camera.cx, (double)d->camera.cy, d->camera.off_center);
    fprintf(stderr, "border %d, radius %g, falloff %g, cap %d, preset %d, %d slices of %d, every pixel %d, power %g, ",
            (int)d->border, (double)d->radius, (double)d->falloff, d->max_radius_px, (int)d->preset, d->slices,
            d->steps, d->every_pixel, (double)d->step_power);
    fprintf(stderr, "thin blend %g, estimator %d, weighting %d, noise %d, frame %u\n", (double)d->thin_blend,
            (int)d->estimator, (int)d->weighting, (int)d->noise, (unsigned)d->frame);
    for (int i = 0; i < 9; i++)
        fprintf(stderr, "%s%g", i ? ", " : "normal_to_view ", (double)d->normal_to_view[i]);
    fprintf(stderr, ", axes %g %g %g\n", (double)d->normal_axes[0], (double)d->normal_axes[1],
            (double)d->normal_axes[2]);
    abort();
}

static float plane_float(const plane *p, int y, int i) {
    float f;
    memcpy(&f, plane_row(p, y) + sizeof f * (size_t)i, sizeof f);
    return f;
}

static void check_values(const result *r, const input *in, int width, int height) {
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            float v = plane_float(&r->visibility, y, x), n[4], length2;
            const char *bad = NULL;
            for (int i = 0; i < 4; i++)
                n[i] = plane_float(&r->bent, y, 4 * x + i);
            length2 = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
            for (int i = 0; i < 9; i++)
                if (!(fabsf(plane_float(&r->sh, i * height + y, x)) < 1.3f))
                    bad = "spherical harmonic out of range";
            if (!float_finite(v) || !(v >= 0.0f && v <= 1.0f))
                bad = "visibility outside [0, 1]";
            else if (memcmp(&v, &n[3], sizeof v) != 0)
                bad = "visibility differs from the fourth component";
            else if (!float_finite(length2) || !(length2 > 0.9998f && length2 < 1.0002f))
                bad = "bent normal is not a unit vector";
            if (bad) {
                fprintf(stderr, "(%d, %d): visibility %g, bent normal %g %g %g, depth %g\n", x, y, (double)v,
                        (double)n[0], (double)n[1], (double)n[2], (double)plane_float(&in->depth, y, x));
                complain(bad, v);
            }
        }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    reader r = {NULL, 0, 0};
    setting s;
    input in;
    result scalar, wide, visibility;
    int width, height;
    layout l;
    gtao_result status;
    gtao_stats stats = {0};

    r.data = data;
    r.size = size;
    take_setting(&r, &s, &width, &height);
    in = input_make(&s, width, height, take_layout(&r));
    fill(&in.depth, (size_t)width, &r);
    if (in.has_normals)
        fill(&in.normals, (size_t)(width * (s.desc.normal_components == 4 ? 4 : 3)), &r);
    if (in.map.memory)
        fill(&in.map, (size_t)width, &r);
    if (in.back.memory)
        fill(&in.back, (size_t)width, &r);
    for (int i = 0; i < 2 * LAYERS; i++)
        if (in.layer[i].memory)
            fill(&in.layer[i], (size_t)width, &r);

    in.desc.isa = GTAO_ISA_SCALAR;
    in.desc.no_skip = GTAO_SKIP_ALL;
    current = in.desc;
    l = take_layout(&r);
    scalar = result_make(&in.desc, WANT_EVERYTHING, GTAO_FORMAT_FLOAT, 4, l, 1);
    status = gtao_compute(&in.desc, &scalar.output, scalar.scratch, scalar.scratch_size, &stats);
    if ((status == GTAO_OK) != (scalar.scratch_size != 0))
        complain("gtao_scratch_size and gtao_compute disagree on", (float)status);
    if (status == GTAO_OK) {
        check_values(&scalar, &in, width, height);
        if (stats.pixels != (uint64_t)(width * height))
            complain("pixels counted", (float)stats.pixels);
    }

    in.desc.isa = GTAO_ISA_AUTO;
    in.desc.no_skip = 0;
    wide = result_make(&in.desc, WANT_EVERYTHING, GTAO_FORMAT_FLOAT, 4, l, 0);
    if (gtao_compute(&in.desc, &wide.output, wide.scratch, wide.scratch_size, NULL) != status)
        complain("kernels disagree on the status", (float)status);
    if (!result_equal(&scalar, &wide))
        complain("kernels, or skips, disagree", 0);
    visibility = result_make(&in.desc, WANT_VISIBILITY, GTAO_FORMAT_FLOAT, 4, l, 0); /* sky is skipped only then */
    if (gtao_compute(&in.desc, &visibility.output, visibility.scratch, visibility.scratch_size, NULL) == GTAO_OK &&
        !result_equal(&scalar, &visibility))
        complain("visibility alone differs", 0);
    if (result_spilled(&scalar) || result_spilled(&wide))
        complain("written outside the rows", 0);

    result_free(&scalar);
    result_free(&wide);
    result_free(&visibility);
    input_free(&in);
    return 0;
}

#ifdef FUZZ_STANDALONE
static int replay(const char *path) {
    static uint8_t data[1 << 16];
    FILE *file = fopen(path, "rb");
    size_t size;
    if (!file) {
        fprintf(stderr, "%s: cannot be opened\n", path);
        return 1;
    }
    size = fread(data, 1, sizeof data, file);
    fclose(file);
    LLVMFuzzerTestOneInput(data, size);
    return 0;
}

int main(int argc, char **argv) {
    uint8_t data[512];
    uint32_t random = 1;
    long count = argc == 2 ? strtol(argv[1], NULL, 10) : 1000;
    int status = 0;
    if (argc > 1 && count == 0) {
        for (int i = 1; i < argc; i++)
            status |= replay(argv[i]);
        return status;
    }
    for (long i = 0; i < count; i++) {
        size_t size = next_random(&random) % sizeof data;
        for (size_t k = 0; k < size; k++)
            data[k] = (uint8_t)next_random(&random);
        LLVMFuzzerTestOneInput(data, size);
    }
    printf("%ld random inputs\n", count);
    return 0;
}
#endif
