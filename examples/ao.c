/* ao - ambient visibility and bent normals of a depth buffer, file to file. `ao --help` lists the options.
 *
 * Everything is read and checked first, computed second, and written last: a run that ends with an error leaves no
 * output behind. */
#include "gtao.h"

#include "cli.h"
#include "image.h"
#include "pool.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- options ------------------------------------------------------------------------------------------------------ */

typedef struct options {
    const char *depth, *normal, *output, *bent, *sh, *stats; /* files */
    const char *sequence, *camera;                           /* pattern of the depth files; motion of the camera */
    const char *thickness_map, *layer[GTAO_MAX_LAYERS], *back[1 + GTAO_MAX_LAYERS]; /* backs: of the depth first */
    int layers;
    int depth_kind;
    float device_scale, device_bias;
    char axis_name[3]; /* which of the file's axes the library's x, y, z are read from, 0..2 */
    float axis_sign[3];
    float normal_to_view[9];
    int focal_count;
    float focal[2], center[2], fov_y_degrees, pixel_size;
    float radius, falloff, thin_blend, thickness, albedo[3];
    double sky;
    int max_radius_px, preset, slices, steps, every_pixel, estimator, weighting, noise, border, isa;
    uint32_t frame;
    int half, denoise, no_skip;
    int threads, repeat;
    uint64_t given; /* bit per option id */
} options;

enum {
    OPT_DEPTH,
    OPT_SEQUENCE,
    OPT_CAMERA,
    OPT_DEPTH_KIND,
    OPT_DEVICE_SCALE,
    OPT_DEVICE_BIAS,
    OPT_SKY,
    OPT_NORMAL,
    OPT_NORMAL_AXES,
    OPT_NORMAL_TO_VIEW,
    OPT_FOCAL,
    OPT_CENTER,
    OPT_FOV_Y,
    OPT_ORTHO,
    OPT_RADIUS,
    OPT_FALLOFF,
    OPT_MAX_RADIUS_PX,
    OPT_THIN_BLEND,
    OPT_THICKNESS,
    OPT_THICKNESS_MAP,
    OPT_BACK,
    OPT_LAYER,
    OPT_PRESET,
    OPT_SLICES,
    OPT_STEPS,
    OPT_ESTIMATOR,
    OPT_WEIGHTING,
    OPT_NOISE,
    OPT_FRAME,
    OPT_HALF,
    OPT_DENOISE,
    OPT_ALBEDO,
    OPT_BORDER,
    OPT_BENT,
    OPT_SH,
    OPT_OUTPUT,
    OPT_ISA,
    OPT_THREADS,
    OPT_NO_SKIP,
    OPT_REPEAT,
    OPT_STATS,
    OPT_HELP,
    OPT_COUNT
};

typedef struct option_info {
    const char *name, *value, *help; /* value null: a flag */
} option_info;

static const option_info option_table[OPT_COUNT] = {
    {"--depth", "FILE[:CHANNEL]", "depth, .exr or .pfm"},
    {"--sequence", "PATTERN",
     "instead: depth of frames from --frame on, such as depth.%04d.exr; --normal, --bent and"
     " -o are patterns then, and frames are filtered in time"},
    {"--camera", "FILE", "of a sequence: a line a frame, world to view, row-major 3x4; without: at rest"},
    {"--depth-kind", "z|distance|device|height", "planar z (default), ray length, device depth, ortho height"},
    {"--device-scale", "A", "device depth d: 1/z = A d + B (ortho: -z = A d + B)"},
    {"--device-bias", "B", ""},
    {"--sky", "Z", "depth at or beyond Z is sky (1e9)"},
    {"--normal", "FILE[:LAYER]", "normals, .exr or .pfm; without: derived from depth"},
    {"--normal-axes", "+x+y+z", "the file's axes that the library's x (right), y (down), z (forward) are"},
    {"--normal-to-view", "m00,...,m22", "row-major 3x3, applied before the axes"},
    {"--focal", "FX[,FY]", "perspective: focal length in pixels"},
    {"--center", "CX,CY", "perspective: principal point in pixels (image centre)"},
    {"--fov-y", "DEGREES", "perspective: vertical field of view, square pixels"},
    {"--ortho", "PIXEL_SIZE", "orthographic: world units per pixel"},
    {"--radius", "R", "reach of occluders, world units (1); inf: all"},
    {"--falloff", "F", "part of the radius over which occlusion fades out, 0..1 (0)"},
    {"--max-radius-px", "N", "cap of the search in pixels (0: none)"},
    {"--thin-blend", "B", "thickness heuristic of [J16], 0..1 (0: off)"},
    {"--thickness", "T", "occluders are slabs of T world units (0: height field)"},
    {"--thickness-map", "FILE[:CHANNEL]", "thickness of each pixel, world units; where not above 0: --thickness"},
    {"--back", "FILE[:CHANNEL]", "depth of the back faces of the --layer before it, or of --depth"},
    {"--layer", "FILE[:CHANNEL]", "a further layer of depth, behind; up to 8 times"},
    {"--preset", "low|medium|high|ultra|reference", "(medium)"},
    {"--slices", "N", "directions per pixel, 1..64"},
    {"--steps", "N", "samples a side of a slice, 1..256; 0: every pixel"},
    {"--estimator", "normalized|memo", "(normalized)"},
    {"--weighting", "cosine|uniform", "(cosine)"},
    {"--noise", "memo|hilbert|none", "(memo)"},
    {"--frame", "N", "frame of the temporal noise (0)"},
    {"--half", NULL, "compute at half resolution, upsample by depth"},
    {"--denoise", "N", "passes of the spatial filter, 0..3 (0; of a sequence 1)"},
    {"--albedo", "R,G,B", "coloured visibility with multiple bounces, 0..1 each"},
    {"--border", "clamp|wrap|open", "what lies outside the image (open: nothing)"},
    {"--bent", "FILE", "also write bent normals, view space; .exr, .pfm or .png"},
    {"--sh", "FILE", "also write spherical harmonics of visibility times cosine, view space; .exr"},
    {"-o", "FILE", "visibility, 1 = open; .exr, .pfm or .png (8 bit, linear)"},
    {"--isa", "auto|scalar|sse2|avx2|avx512|neon", "(auto) the results are the same bits"},
    {"--threads", "N", "(all processors) the results are the same bits"},
    {"--no-skip", NULL, "compute what could be skipped; the results are the same bits"},
    {"--repeat", "N", "compute N times, report medians (1)"},
    {"--stats", "FILE", "write times and counts as JSON"},
    {"--help", NULL, ""},
};

static const char *const depth_kinds[] = {"z", "distance", "device", "height", NULL};
static const char *const presets[] = {"medium", "low", "high", "ultra", "reference", NULL};
static const char *const estimators[] = {"normalized", "memo", NULL};
static const char *const weightings[] = {"cosine", "uniform", NULL};
static const char *const noises[] = {"memo", "hilbert", "none", NULL};
static const char *const borders[] = {"open", "clamp", "wrap", NULL};
static const char *const isas[] = {"auto", "scalar", "sse2", "avx2", "avx512", "neon", NULL};

static int error_line(const char *format, ...) {
    va_list args;
    va_start(args, format);
    fputs("ao: ", stderr);
    vfprintf(stderr, format, args);
    fputc('\n', stderr);
    va_end(args);
    return 0;
}

static int bad_value(int id, const char *value, const char *expected) {
    return error_line("%s %s: must be %s", option_table[id].name, value, expected);
}

static int given(const options *o, int id) {
    return (int)(o->given >> id & 1);
}

static void print_help(void) {
    puts("ao - ambient visibility and bent normals of a depth buffer\n\n"
         "usage: ao --depth FILE[:CHANNEL] (--focal FX | --fov-y DEGREES | --ortho PIXEL_SIZE) [options] -o FILE\n");
    for (int i = 0; i < OPT_COUNT; ++i) {
        char left[64];
        const option_info *info = option_table + i;
        snprintf(left, sizeof left, "%s %s", info->name, info->value ? info->value : "");
        if (strlen(left) > 30)
            printf("  %s\n  %-30s %s\n", left, "", info->help);
        else
            printf("  %-30s %s\n", left, info->help);
    }
    puts("\nThe library's axes are x right, y down, z into the screen; OpenGL's normals are --normal-axes +x-y-z.\n"
         "Without :CHANNEL and :LAYER the depth channel and the layer of normals are found by name.");
}

/* "+x-y+z": three signed axes, each once. */
static int parse_axes(const char *text, options *o) {
    int seen = 0;
    for (int i = 0; i < 3; ++i, text += 2) {
        if ((text[0] != '+' && text[0] != '-') || text[1] < 'x' || text[1] > 'z')
            return 0;
        o->axis_sign[i] = text[0] == '-' ? -1.0f : 1.0f;
        o->axis_name[i] = (char)(text[1] - 'x');
        seen |= 1 << o->axis_name[i];
    }
    return *text == 0 && seen == 7;
}

static int set_choice(int id, const char *value, const char *const *names, int *choice) {
    *choice = cli_choice(value, names);
    if (*choice >= 0)
        return 1;
    return bad_value(id, value, option_table[id].value);
}

static int set_float(int id, const char *value, double lowest, double highest, const char *expected, float *number) {
    double v;
    if (!cli_number(value, &v) || !(v >= lowest && v <= highest))
        return bad_value(id, value, expected);
    *number = (float)v;
    if (isinf(*number) && !isinf(v))
        return bad_value(id, value, expected);
    return 1;
}

static int set_integer(int id, const char *value, long lowest, long highest, const char *expected, int *number) {
    long v;
    if (!cli_integer(value, lowest, highest, &v))
        return bad_value(id, value, expected);
    *number = (int)v;
    return 1;
}

static int set_numbers(int id, const char *value, int lowest, int highest, float above, float upto,
                       const char *expected, float *numbers, int *count) {
    *count = cli_numbers(value, lowest, highest, numbers);
    int ok = *count > 0;
    for (int i = 0; i < *count; ++i)
        ok = ok && isfinite(numbers[i]) && numbers[i] >= above && numbers[i] <= upto;
    return ok ? 1 : bad_value(id, value, expected);
}

static int set_option(options *o, int id, const char *value) {
    const double any = HUGE_VAL;
    const float anyf = HUGE_VALF;
    int count;
    long frame;
    double number;
    switch (id) {
    case OPT_DEPTH:
        o->depth = value;
        return 1;
    case OPT_SEQUENCE:
        o->sequence = value;
        return 1;
    case OPT_CAMERA:
        o->camera = value;
        return 1;
    case OPT_NORMAL:
        o->normal = value;
        return 1;
    case OPT_BENT:
        o->bent = value;
        return 1;
    case OPT_SH:
        o->sh = value;
        if (image_format_of(value) != IMAGE_EXR)
            return error_line("--sh %s: nine channels need an .exr", value);
        return 1;
    case OPT_OUTPUT:
        o->output = value;
        return 1;
    case OPT_STATS:
        o->stats = value;
        return 1;
    case OPT_DEPTH_KIND:
        return set_choice(id, value, depth_kinds, &o->depth_kind);
    case OPT_DEVICE_SCALE:
        if (!set_numbers(id, value, 1, 1, -anyf, anyf, "a finite number, not 0", &o->device_scale, &count))
            return 0;
        return o->device_scale < 0.0f || o->device_scale > 0.0f ? 1 : bad_value(id, value, "a finite number, not 0");
    case OPT_DEVICE_BIAS:
        return set_numbers(id, value, 1, 1, -anyf, anyf, "a finite number", &o->device_bias, &count);
    case OPT_SKY:
        if (!cli_number(value, &number) || !(number > 0.0) || (float)number <= 0.0f)
            return bad_value(id, value, "a depth above 0, or inf");
        o->sky = number;
        return 1;
    case OPT_NORMAL_AXES:
        return parse_axes(value, o) ? 1 : bad_value(id, value, "three signed axes, each once, such as +x-y-z");
    case OPT_NORMAL_TO_VIEW: {
        float *m = o->normal_to_view;
        if (!set_numbers(id, value, 9, 9, -anyf, anyf, "nine finite numbers, row by row", m, &count))
            return 0;
        float det = m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
                    m[2] * (m[3] * m[7] - m[4] * m[6]);
        return fabsf(det) > 0.0f ? 1 : bad_value(id, value, "an invertible matrix");
    }
    case OPT_FOCAL:
        return set_numbers(id, value, 1, 2, 1e-30f, 1e30f, "one or two positive, finite numbers", o->focal,
                           &o->focal_count);
    case OPT_CENTER:
        return set_numbers(id, value, 2, 2, -1e30f, 1e30f, "two finite numbers", o->center, &count);
    case OPT_FOV_Y:
        if (!cli_number(value, &number) || !((float)number > 0.0f && (float)number < 180.0f))
            return bad_value(id, value, "between 0 and 180 degrees");
        o->fov_y_degrees = (float)number;
        return 1;
    case OPT_ORTHO:
        return set_numbers(id, value, 1, 1, 1e-30f, 1e30f, "a positive, finite number", &o->pixel_size, &count);
    case OPT_RADIUS:
        return set_float(id, value, 0.0, any, "a number, 0 or more", &o->radius);
    case OPT_FALLOFF:
        return set_float(id, value, 0.0, 1.0, "0..1", &o->falloff);
    case OPT_MAX_RADIUS_PX:
        return set_integer(id, value, 0, 1 << 20, "an integer, 0 or more", &o->max_radius_px);
    case OPT_THIN_BLEND:
        return set_float(id, value, 0.0, 1.0, "0..1", &o->thin_blend);
    case OPT_THICKNESS:
        return set_float(id, value, 0.0, any, "a number, 0 or more", &o->thickness);
    case OPT_THICKNESS_MAP:
        o->thickness_map = value;
        return 1;
    case OPT_BACK:
        if (o->back[o->layers])
            return error_line("--back %s: the layer has one already", value);
        o->back[o->layers] = value;
        return 1;
    case OPT_LAYER:
        if (o->layers == GTAO_MAX_LAYERS)
            return error_line("--layer %s: more than %d", value, GTAO_MAX_LAYERS);
        o->layer[o->layers++] = value;
        return 1;
    case OPT_PRESET:
        return set_choice(id, value, presets, &o->preset);
    case OPT_SLICES:
        return set_integer(id, value, 1, 64, "an integer, 1..64", &o->slices);
    case OPT_STEPS:
        if (!set_integer(id, value, 0, 256, "an integer, 0..256", &o->steps))
            return 0;
        o->every_pixel = o->steps == 0;
        return 1;
    case OPT_ESTIMATOR:
        return set_choice(id, value, estimators, &o->estimator);
    case OPT_WEIGHTING:
        return set_choice(id, value, weightings, &o->weighting);
    case OPT_NOISE:
        return set_choice(id, value, noises, &o->noise);
    case OPT_FRAME:
        if (!cli_integer(value, 0, 0x7fffffff, &frame))
            return bad_value(id, value, "an integer, 0 or more");
        o->frame = (uint32_t)frame;
        return 1;
    case OPT_DENOISE:
        return set_integer(id, value, 0, 3, "an integer, 0..3", &o->denoise);
    case OPT_ALBEDO:
        return set_numbers(id, value, 3, 3, 0.0f, 1.0f, "three numbers, 0..1", o->albedo, &count);
    case OPT_BORDER:
        return set_choice(id, value, borders, &o->border);
    case OPT_ISA:
        if (!set_choice(id, value, isas, &o->isa))
            return 0;
        if (o->isa != GTAO_ISA_AUTO && !gtao_isa_available((gtao_isa)o->isa))
            return error_line("--isa %s: not compiled in, or not supported by this machine", value);
        return 1;
    case OPT_THREADS:
        return set_integer(id, value, 1, 1024, "an integer, 1..1024", &o->threads);
    case OPT_REPEAT:
        return set_integer(id, value, 1, 100000, "an integer, 1..100000", &o->repeat);
    case OPT_HALF:
        o->half = 1;
        return 1;
    case OPT_NO_SKIP:
        o->no_skip = 1;
        return 1;
    default:
        return 1;
    }
}

static int parse_options(int argc, char **argv, options *o) {
    memset(o, 0, sizeof *o);
    o->radius = 1.0f;
    o->sky = 1e9;
    o->threads = cli_processors();
    o->repeat = 1;
    parse_axes("+x+y+z", o);
    for (int i = 1; i < argc; ++i) {
        const char *name = argv[i], *value = NULL;
        const char *equals = strncmp(name, "--", 2) == 0 ? strchr(name, '=') : NULL;
        size_t length = equals ? (size_t)(equals - name) : strlen(name);
        int id = 0;
        while (id < OPT_COUNT &&
               (strlen(option_table[id].name) != length || memcmp(option_table[id].name, name, length) != 0))
            ++id;
        if (id == OPT_COUNT)
            return error_line("%s: unknown option, see --help", name);
        if (option_table[id].value) {
            value = equals ? equals + 1 : i + 1 < argc ? argv[++i] : NULL;
            if (!value || !value[0] || (!equals && strncmp(value, "--", 2) == 0))
                return error_line("%s: needs a value, %s", option_table[id].name, option_table[id].value);
        } else if (equals) {
            return error_line("%s: takes no value", option_table[id].name);
        }
        o->given |= (uint64_t)1 << id;
        if (!set_option(o, id, value))
            return 0;
    }
    return 1;
}

/* ---- sequences ---------------------------------------------------------------------------------------------------- */

/* A name with one %d, %4d or %04d and no other conversion. */
static int is_pattern(const char *text) {
    int count = 0;
    for (; *text; ++text)
        if (*text == '%') {
            size_t digits = strspn(text + 1, "0123456789");
            if (digits > 2 || text[1 + digits] != 'd')
                return 0;
            count++;
            text += 1 + digits;
        }
    return count == 1;
}

/* The name for a frame; itself if there is no sequence. */
static const char *frame_name(const options *o, const char *pattern, uint32_t frame, char *buffer, size_t size) {
    size_t before, digits;
    int zeros, width;
    if (!o->sequence || !pattern)
        return pattern;
    before = strcspn(pattern, "%");
    digits = strspn(pattern + before + 1, "0123456789");
    zeros = pattern[before + 1] == '0';
    width = (int)strtol(pattern + before + 1, NULL, 10);
    if (zeros)
        snprintf(buffer, size, "%.*s%0*lu%s", (int)before, pattern, width, (unsigned long)frame,
                 pattern + before + digits + 2);
    else
        snprintf(buffer, size, "%.*s%*lu%s", (int)before, pattern, width, (unsigned long)frame,
                 pattern + before + digits + 2);
    return buffer;
}

static int check_sequence(const options *o) {
    const int ids[] = {OPT_SEQUENCE, OPT_NORMAL, OPT_BENT, OPT_OUTPUT};
    const char *names[] = {o->sequence, o->normal, o->bent, o->output};
    if (!o->sequence)
        return o->camera ? error_line("--camera: only with --sequence") : 1;
    if (o->depth)
        return error_line("--depth: cannot be combined with --sequence");
    if (given(o, OPT_REPEAT))
        return error_line("--repeat: cannot be combined with --sequence");
    for (int i = 0; i < 4; ++i)
        if (names[i] && !is_pattern(names[i]))
            return error_line("%s %s: of a sequence, must contain the frame's number once, as %%d or %%04d",
                              option_table[ids[i]].name, names[i]);
    return 1;
}

/* Row-major 3x4 matrices, one a line; '#' begins a comment. Returns their number, 0 after an error. */
static int read_cameras(const options *o, float (**cameras)[12]) {
    FILE *file = fopen(o->camera, "r");
    char line[1024];
    int count = 0, number = 0, room = 0;
    *cameras = NULL;
    if (!file)
        return error_line("--camera %s: cannot be opened", o->camera);
    while (fgets(line, sizeof line, file)) {
        char *at = line, *end;
        int n = 0;
        number++;
        line[strcspn(line, "#\r\n")] = 0;
        if (line[strspn(line, " \t")] == 0)
            continue;
        if (count == room) {
            float(*more)[12] = realloc(*cameras, sizeof **cameras * (size_t)(room = 2 * room + 64));
            if (!more)
                break;
            *cameras = more;
        }
        for (; n < 12; ++n, at = end) {
            double v = strtod(at, &end);
            if (end == at || !isfinite((float)v))
                break;
            (*cameras)[count][n] = (float)v;
        }
        if (n < 12 || at[strspn(at, " \t")] != 0) {
            fclose(file);
            free(*cameras);
            *cameras = NULL;
            return error_line("--camera %s: line %d: expected 12 finite numbers", o->camera, number);
        }
        count++;
    }
    fclose(file);
    return count ? count : error_line("--camera %s: no matrices", o->camera);
}

/* previous * inverse(now), of affine 3x4 matrices; 0 if `now` is singular. */
static int relative_camera(const float now[12], const float previous[12], float out[12]) {
    double inv[9], t[3], det;
    const float *m = now;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) {
            int r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
            inv[3 * c + r] =
                (double)m[4 * r1 + c1] * (double)m[4 * r2 + c2] - (double)m[4 * r1 + c2] * (double)m[4 * r2 + c1];
        }
    det = (double)m[0] * inv[0] + (double)m[1] * inv[3] + (double)m[2] * inv[6];
    if (!(fabs(det) > 1e-30))
        return 0;
    for (int r = 0; r < 3; ++r) {
        t[r] = 0.0;
        for (int c = 0; c < 3; ++c) {
            inv[3 * r + c] /= det;
            t[r] -= inv[3 * r + c] * (double)m[4 * c + 3];
        }
    }
    for (int r = 0; r < 3; ++r) {
        double shift = (double)previous[4 * r + 3];
        for (int c = 0; c < 3; ++c) {
            double sum = 0.0;
            for (int k = 0; k < 3; ++k)
                sum += (double)previous[4 * r + k] * inv[3 * k + c];
            out[4 * r + c] = (float)sum;
            shift += (double)previous[4 * r + c] * t[c];
        }
        out[4 * r + 3] = (float)shift;
    }
    return 1;
}

static int same_file(const char *a, const char *b) {
    struct stat x, y;
    if (strcmp(a, b) == 0)
        return 1;
    return stat(a, &x) == 0 && stat(b, &y) == 0 && x.st_dev == y.st_dev && x.st_ino == y.st_ino;
}

/* Nothing that is written may be read, or written twice. */
static int check_outputs(const options *o) {
    const int ids[] = {OPT_OUTPUT, OPT_BENT, OPT_SH, OPT_STATS};
    const char *files[] = {o->output, o->bent, o->sh, o->stats};
    const char *inputs[3 + GTAO_MAX_LAYERS + 1 + GTAO_MAX_LAYERS] = {o->depth, o->normal, o->thickness_map};
    const int input_count = (int)(sizeof inputs / sizeof *inputs);
    memcpy(inputs + 3, o->layer, sizeof o->layer);
    memcpy(inputs + 3 + GTAO_MAX_LAYERS, o->back, sizeof o->back);
    for (int i = 0; i < 4; ++i) {
        if (!files[i])
            continue;
        const char *name = option_table[ids[i]].name;
        if (i < 3 && image_format_of(files[i]) == IMAGE_UNKNOWN)
            return error_line("%s %s: unknown format, the name must end in .exr, .pfm or .png", name, files[i]);
        struct stat info;
        if (stat(files[i], &info) == 0 && !S_ISREG(info.st_mode))
            return error_line("%s %s: not a regular file", name, files[i]);
        char directory[4096];
        const char *slash = strrchr(files[i], '/');
        size_t n = slash == files[i] ? 1 : slash ? (size_t)(slash - files[i]) : 0;
        if (n >= sizeof directory)
            return error_line("%s %s: name too long", name, files[i]);
        memcpy(directory, files[i], n);
        directory[n] = 0;
        if (access(n ? directory : ".", W_OK | X_OK) != 0) {
            int there = stat(n ? directory : ".", &info) == 0;
            return error_line("%s %s: its directory is %s", name, files[i], there ? "not writable" : "missing");
        }
        for (int k = 0; k < i; ++k)
            if (files[k] && same_file(files[i], files[k]))
                return error_line("%s %s: the same file as %s", name, files[i], option_table[ids[k]].name);
        for (int k = 0; k < input_count; ++k) {
            char path[4096];
            if (inputs[k] && image_spec_path(inputs[k], path, sizeof path) && same_file(files[i], path))
                return error_line("%s %s: would overwrite the input", name, files[i]);
        }
    }
    return 1;
}

static int check_options(const options *o) {
    static const int cameras[] = {OPT_FOCAL, OPT_FOV_Y, OPT_ORTHO};
    int count = 0, last = 0;
    if (!check_sequence(o))
        return 0;
    if (!o->depth && !o->sequence)
        return error_line("--depth: required, see --help");
    if (!o->output)
        return error_line("-o: required, see --help");
    for (int i = 0; i < 3; ++i)
        if (given(o, cameras[i])) {
            if (count++)
                return error_line("%s: cannot be combined with %s", option_table[cameras[i]].name,
                                  option_table[last].name);
            last = cameras[i];
        }
    if (!count)
        return error_line("--focal, --fov-y or --ortho: one of them is required");
    if (given(o, OPT_CENTER) && given(o, OPT_ORTHO))
        return error_line("--center: cannot be combined with --ortho");
    if (o->depth_kind == GTAO_DEPTH_HEIGHT && !given(o, OPT_ORTHO))
        return error_line("--depth-kind height: needs --ortho");
    if (o->depth_kind == GTAO_DEPTH_DEVICE && !(given(o, OPT_DEVICE_SCALE) && given(o, OPT_DEVICE_BIAS)))
        return error_line("--depth-kind device: needs --device-scale and --device-bias");
    for (int id = OPT_DEVICE_SCALE; id <= OPT_DEVICE_BIAS; ++id)
        if (given(o, id) && o->depth_kind != GTAO_DEPTH_DEVICE)
            return error_line("%s: only with --depth-kind device", option_table[id].name);
    for (int id = OPT_NORMAL_AXES; id <= OPT_NORMAL_TO_VIEW; ++id)
        if (given(o, id) && !o->normal)
            return error_line("%s: only with --normal", option_table[id].name);
    if (given(o, OPT_SKY) && o->depth_kind == GTAO_DEPTH_HEIGHT)
        return error_line("--sky: not with --depth-kind height");
    if (o->sh && (o->half || o->denoise > 0 || o->sequence))
        return error_line("--sh: not with --half, --denoise or --sequence");
    for (int id = OPT_THICKNESS_MAP; id <= OPT_LAYER; ++id)
        if (given(o, id) && (o->half || o->denoise > 0 || o->sequence))
            return error_line("%s: not with --half, --denoise or --sequence", option_table[id].name);
    return check_outputs(o);
}

/* ---- the work ----------------------------------------------------------------------------------------------------- */

enum { STAGES_MAX = 12 };

typedef struct job {
    const options *options;
    image depth, normals, visibility, bent, sh, color;
    float *sh_planes;
    image thickness, layer[GTAO_MAX_LAYERS], back[1 + GTAO_MAX_LAYERS];
    gtao_layer layers[GTAO_MAX_LAYERS];
    void *scratch;
    size_t scratch_size;
    pool *workers;
    gtao_stats *stats; /* per thread */

    gtao_desc desc;
    gtao_output output;
    gtao_context *context;
    gtao_frame_desc frame; /* if `framed`: half resolution, filters, or a sequence */
    gtao_frame_context *frame_context;
    int framed;
    float (*cameras)[12];  /* world to view, of each frame */
    uint32_t first, count; /* frames of a sequence; 0 and 1 otherwise */

    int stages;
    const char *stage_names[STAGES_MAX];
    int terminal, shown, run, runs; /* progress line */
    double started;
    gtao_stats total;
} job;

static int same_window(const job *j, int id, const char *spec, const image *img) {
    const image *d = &j->depth;
    const char *name = option_table[id].name;
    if (d->width != img->width || d->height != img->height)
        return error_line("%s %s: %d x %d, but the depth is %d x %d", name, spec, img->width, img->height, d->width,
                          d->height);
    if (d->origin_x != img->origin_x || d->origin_y != img->origin_y)
        return error_line("%s %s: its data window lies elsewhere than the depth's", name, spec);
    return 1;
}

/* One channel that goes with the depth; nothing if `spec` is null. */
static int read_plane(const job *j, int id, const char *spec, image *out) {
    image_error error;
    if (!spec)
        return 1;
    if (!image_read_depth(spec, out, &error))
        return error_line("%s %s", option_table[id].name, error.text);
    return same_window(j, id, spec, out);
}

static int read_inputs(job *j, uint32_t frame) {
    const options *o = j->options;
    image_error error;
    int ok;
    char depth_name[4096], normal_name[4096];
    image_free(&j->depth);
    image_free(&j->normals);
    if (!image_read_depth(frame_name(o, o->sequence ? o->sequence : o->depth, frame, depth_name, sizeof depth_name),
                          &j->depth, &error))
        return error_line("%s %s", o->sequence ? "--sequence" : "--depth", error.text);
    if (o->normal &&
        !image_read_normals(frame_name(o, o->normal, frame, normal_name, sizeof normal_name), &j->normals, &error))
        return error_line("--normal %s", error.text);
    ok = !o->normal || same_window(j, OPT_NORMAL, o->normal, &j->normals);
    ok = ok && read_plane(j, OPT_THICKNESS_MAP, o->thickness_map, &j->thickness);
    for (int i = 0; ok && i <= o->layers; ++i)
        ok = read_plane(j, OPT_BACK, o->back[i], &j->back[i]);
    for (int i = 0; ok && i < o->layers; ++i)
        ok = read_plane(j, OPT_LAYER, o->layer[i], &j->layer[i]);
    return ok;
}

/* The axes are a signed permutation of the matrix's rows, which is exact. */
static void set_normals(const job *j, gtao_desc *desc) {
    static const float identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const options *o = j->options;
    const float *m = given(o, OPT_NORMAL_TO_VIEW) ? o->normal_to_view : identity;
    desc->normals = j->normals.data;
    for (int row = 0; row < 3; ++row)
        for (int k = 0; k < 3; ++k)
            desc->normal_to_view[3 * row + k] = o->axis_sign[row] * m[3 * o->axis_name[row] + k];
}

/* Without --center the principal point is the middle of the picture that the camera frames, which is not the middle
 * of the pixels if the file holds only a part of the picture. */
static void set_camera(const job *j, gtao_desc *desc) {
    const options *o = j->options;
    const image *d = &j->depth;
    gtao_camera *camera = &desc->camera;
    if (given(o, OPT_ORTHO)) {
        camera->projection = GTAO_ORTHOGRAPHIC;
        camera->sx = o->pixel_size;
        return;
    }
    if (given(o, OPT_FOV_Y))
        *camera = gtao_camera_from_fov(o->fov_y_degrees, d->display_width, d->display_height);
    else {
        camera->fx = o->focal[0];
        camera->fy = o->focal_count > 1 ? o->focal[1] : 0.0f;
    }
    camera->off_center = 1;
    camera->cx = given(o, OPT_CENTER) ? o->center[0] : 0.5f * (float)d->display_width - (float)d->origin_x;
    camera->cy = given(o, OPT_CENTER) ? o->center[1] : 0.5f * (float)d->display_height - (float)d->origin_y;
}

static void set_desc(job *j) {
    const options *o = j->options;
    gtao_desc *desc = &j->desc;
    desc->width = j->depth.width;
    desc->height = j->depth.height;
    desc->depth = j->depth.data;
    desc->depth_kind = (gtao_depth_kind)o->depth_kind;
    desc->device_scale = o->device_scale;
    desc->device_bias = o->device_bias;
    if (o->depth_kind != GTAO_DEPTH_HEIGHT && o->sky < 3e38) /* 0 is the library's for: only infinity */
        desc->sky_z = (float)o->sky;
    if (o->normal)
        set_normals(j, desc);
    set_camera(j, desc);
    desc->border = (gtao_border)o->border;
    desc->radius = o->radius;
    desc->falloff = o->falloff;
    desc->max_radius_px = o->max_radius_px;
    desc->preset = (gtao_preset)o->preset;
    desc->slices = o->slices;
    desc->steps = o->steps;
    desc->every_pixel = o->every_pixel;
    desc->thin_blend = o->thin_blend;
    desc->thickness = o->thickness;
    desc->thickness_map = j->thickness.data;
    desc->back = j->back[0].data;
    for (int i = 0; i < o->layers; ++i) {
        j->layers[i].depth = j->layer[i].data;
        j->layers[i].back = j->back[1 + i].data;
    }
    desc->layers = j->layers;
    desc->layer_count = o->layers;
    desc->estimator = (gtao_estimator)o->estimator;
    desc->weighting = (gtao_weighting)o->weighting;
    desc->noise = (gtao_noise)o->noise;
    desc->frame = o->frame;
    desc->isa = (gtao_isa)o->isa;

    j->framed = o->half || o->denoise > 0 || o->sequence;
    j->frame.desc = *desc;
    j->frame.half = o->half;
    j->frame.spatial_passes = o->denoise;
    j->frame.no_spatial = o->denoise == 0 && (!o->sequence || given(o, OPT_DENOISE));
    j->frame.no_temporal = !o->sequence;
    j->frame.no_skip = o->no_skip;
}

/* The option behind a field of the descriptor that the library refuses. */
static const char *option_of(const options *o, gtao_result result) {
    switch (result) {
    case GTAO_ERROR_DEVICE:
        return "--device-scale, --device-bias";
    case GTAO_ERROR_SKY:
        return "--sky";
    case GTAO_ERROR_NORMALS:
        return "--normal";
    case GTAO_ERROR_NORMAL_AXES:
        return "--normal-to-view";
    case GTAO_ERROR_FOCAL:
        return "--focal, --fov-y";
    case GTAO_ERROR_CENTER:
        return "--center";
    case GTAO_ERROR_PIXEL_SIZE:
        return "--ortho";
    case GTAO_ERROR_BORDER:
        return "--border";
    case GTAO_ERROR_RADIUS:
        return "--radius";
    case GTAO_ERROR_FALLOFF:
        return "--falloff";
    case GTAO_ERROR_MAX_RADIUS:
        return "--max-radius-px";
    case GTAO_ERROR_PRESET:
        return "--preset";
    case GTAO_ERROR_SLICES:
        return "--slices";
    case GTAO_ERROR_STEPS:
        return "--steps";
    case GTAO_ERROR_THIN_BLEND:
        return "--thin-blend";
    case GTAO_ERROR_THICKNESS:
    case GTAO_ERROR_ARCS:
        return o->thickness > 0.0f ? "--thickness"
               : o->thickness_map  ? "--thickness-map"
               : o->layers         ? "--layer"
                                   : "--back";
    case GTAO_ERROR_ESTIMATOR:
        return "--estimator";
    case GTAO_ERROR_WEIGHTING:
        return "--weighting";
    case GTAO_ERROR_NOISE:
        return "--noise";
    case GTAO_ERROR_ISA:
        return "--isa";
    case GTAO_ERROR_OUTPUT_SH:
        return "--sh";
    default:
        return "--depth";
    }
}

static int library_error(const job *j, gtao_result result) {
    return error_line("%s: %s", option_of(j->options, result), gtao_result_string(result));
}

static int allocate(job *j) {
    const options *o = j->options;
    image_error error;
    int w = j->depth.width, h = j->depth.height;
    int ok = image_create(&j->visibility, w, h, 1, &error);
    ok = ok && (!o->bent || image_create(&j->bent, w, h, 3, &error));
    ok = ok && (!o->sh || image_create(&j->sh, w, h, 9, &error));
    ok = ok && (!given(o, OPT_ALBEDO) || image_create(&j->color, w, h, 3, &error));
    if (!ok)
        return error_line("--depth %s: %s", o->depth, error.text);
    j->output.visibility = j->visibility.data;
    j->output.bent_normals = j->bent.data;
    if (o->sh) {
        j->sh_planes = malloc(sizeof(float) * 9 * (size_t)w * (size_t)h); /* as large as j->sh.data, which is there */
        if (!j->sh_planes)
            return error_line("--sh %s: not enough memory", o->sh);
    }
    j->output.sh = j->sh_planes;

    j->scratch_size = j->framed ? gtao_frame_state_size(&j->frame) : gtao_scratch_size(&j->desc);
    if (j->scratch_size == 0) {
        gtao_result why = gtao_begin(&j->desc, &j->output, NULL, 0, &j->context);
        return library_error(j, why);
    }
    j->scratch = calloc(1, j->scratch_size);
    j->workers = pool_create(o->threads);
    j->stats = j->workers ? calloc((size_t)pool_threads(j->workers), sizeof *j->stats) : NULL;
    if (!j->scratch || !j->stats)
        return error_line("--depth %s: not enough memory", o->depth);
    return 1;
}

static void prepare_rows(void *user, int thread, int row_begin, int row_end) {
    job *j = user;
    (void)thread;
    gtao_prepare_rows(j->context, row_begin, row_end);
}

static void visibility_rows(void *user, int thread, int row_begin, int row_end) {
    job *j = user;
    gtao_visibility_rows(j->context, row_begin, row_end, j->stats + thread);
}

static void multi_bounce_rows(void *user, int thread, int row_begin, int row_end) {
    job *j = user;
    (void)thread;
    size_t width = (size_t)j->depth.width, end = (size_t)row_end * width;
    for (size_t i = (size_t)row_begin * width; i < end; ++i)
        gtao_multi_bounce_rgb(j->visibility.data[i], j->options->albedo, j->color.data + 3 * i);
}

/* Only on a terminal, and only once the work has taken a second. */
static void show_progress(void *user, int rows_done, int rows) {
    job *j = user;
    if (!j->terminal || cli_seconds() - j->started < 1.0)
        return;
    double part = ((double)j->run + (double)rows_done / (double)rows) / (double)j->runs;
    int percent = (int)(100.0 * part);
    if (percent != j->shown || !j->shown) {
        fprintf(stderr, "\rao: %3d %%", percent);
        fflush(stderr);
        j->shown = percent ? percent : 1;
    }
}

/* Notes the time of a stage, by its name. */
static void stage_done(job *j, const char *name, double *seconds, double *since) {
    double now = cli_seconds();
    j->stage_names[j->stages] = name;
    seconds[j->stages++] = now - *since;
    *since = now;
}

typedef struct frame_stage {
    job *job;
    int stage;
} frame_stage;

static void frame_units(void *user, int thread, int begin, int end) {
    const frame_stage *s = user;
    gtao_frame_run(s->job->frame_context, s->stage, begin, end, s->job->stats + thread);
}

static int compute_once(job *j, double seconds[STAGES_MAX]) {
    int rows = j->depth.height;
    double since = cli_seconds();
    gtao_result result;
    j->stages = 0;
    if (j->framed) {
        frame_stage s = {j, 0};
        result = gtao_frame_begin(&j->frame, &j->output, j->scratch, j->scratch_size, &j->frame_context);
        if (result != GTAO_OK)
            return library_error(j, result);
        stage_done(j, "begin", seconds, &since);
        for (; s.stage < gtao_frame_stages(j->frame_context); ++s.stage) {
            pool_run(j->workers, gtao_frame_units(j->frame_context, s.stage), 0, frame_units, NULL, &s);
            stage_done(j, gtao_frame_stage_name(j->frame_context, s.stage), seconds, &since);
        }
    } else {
        result = gtao_begin(&j->desc, &j->output, j->scratch, j->scratch_size, &j->context);
        if (result != GTAO_OK)
            return library_error(j, result);
        stage_done(j, "begin", seconds, &since);
        pool_run(j->workers, rows, 0, prepare_rows, NULL, j);
        stage_done(j, "prepare", seconds, &since);
        pool_run(j->workers, rows, 0, visibility_rows, show_progress, j);
        stage_done(j, "visibility", seconds, &since);
    }
    if (j->color.data) {
        pool_run(j->workers, rows, 0, multi_bounce_rows, NULL, j);
        stage_done(j, "multi_bounce", seconds, &since);
    }
    return 1;
}

/* ---- output ------------------------------------------------------------------------------------------------------- */

static void stats_text(const job *j, const double ms[STAGES_MAX], double total_ms, char *text, size_t size) {
    size_t n = 0;
    const gtao_context *context = j->framed ? gtao_frame_horizons(j->frame_context) : j->context;
    n +=
        (size_t)snprintf(text + n, size - n,
                         "{\n  \"width\": %d,\n  \"height\": %d,\n  \"isa\": \"%s\",\n  \"threads\": %d,\n"
                         "  \"slices\": %d,\n  \"steps\": %d,\n  \"total_ms\": %.6f,\n  \"stages\": [\n",
                         j->depth.width, j->depth.height, gtao_isa_name(gtao_context_isa(context)),
                         pool_threads(j->workers), gtao_context_slices(context), gtao_context_steps(context), total_ms);
    for (int s = 0; s < j->stages; ++s)
        n += (size_t)snprintf(text + n, size - n, "    {\"name\": \"%s\", \"ms\": %.6f}%s\n", j->stage_names[s], ms[s],
                              s + 1 < j->stages ? "," : "");
    snprintf(text + n, size - n,
             "  ],\n  \"samples\": %llu,\n  \"derived_normals\": %llu,\n"
             "  \"skipped\": {\"sky\": %llu, \"masked\": %llu, \"small_radius\": %llu, "
             "\"unchanged\": %llu}\n}\n",
             (unsigned long long)j->total.samples, (unsigned long long)j->total.derived_normals,
             (unsigned long long)j->total.sky, (unsigned long long)j->total.masked,
             (unsigned long long)j->total.small_radius, (unsigned long long)j->total.unchanged);
}

/* The pixels lie in the picture where the depth's did. */
static void place(image *img, const image *like) {
    img->origin_x = like->origin_x;
    img->origin_y = like->origin_y;
    img->display_width = like->display_width;
    img->display_height = like->display_height;
}

/* The library's planes to an image's pixels. */
static void interleave_sh(job *j) {
    size_t pixels = (size_t)j->sh.width * (size_t)j->sh.height;
    for (size_t c = 0; c < 9; ++c)
        for (size_t i = 0; i < pixels; ++i)
            j->sh.data[9 * i + c] = j->sh_planes[c * pixels + i];
}

/* The images, of a frame if there are several, and the statistics if `ms` is not null. All files are complete under
 * temporary names before the first gets its own. */
static int write_outputs(job *j, uint32_t frame, const double ms[STAGES_MAX], double total_ms) {
    static const char *const names_y[] = {"Y"}, *const names_rgb[] = {"R", "G", "B"};
    static const char *const names_bent[] = {"bent.X", "bent.Y", "bent.Z"};
    const options *o = j->options;
    image_error error;
    static const char *const names_sh[] = {"sh.0", "sh.1", "sh.2", "sh.3", "sh.4", "sh.5", "sh.6", "sh.7", "sh.8"};
    image_pending pending[4];
    char text[2048], name[4096];
    int ids[4], count = 0, ok, id = OPT_OUTPUT;
    memset(pending, 0, sizeof pending);
    place(&j->visibility, &j->depth);
    place(&j->bent, &j->depth);
    place(&j->color, &j->depth);

    ok = image_write(frame_name(o, o->output, frame, name, sizeof name), j->color.data ? &j->color : &j->visibility,
                     j->color.data ? names_rgb : names_y, IMAGE_RANGE_UNIT, pending + count, &error);
    ids[count++] = id;
    if (ok && o->bent) {
        id = OPT_BENT;
        ok = image_write(frame_name(o, o->bent, frame, name, sizeof name), &j->bent, names_bent, IMAGE_RANGE_SIGNED,
                         pending + count, &error);
        ids[count++] = id;
    }
    if (ok && o->sh) {
        id = OPT_SH;
        interleave_sh(j);
        place(&j->sh, &j->depth);
        ok = image_write(o->sh, &j->sh, names_sh, IMAGE_RANGE_SIGNED, pending + count, &error);
        ids[count++] = id;
    }
    if (ok && o->stats && ms) {
        id = OPT_STATS;
        stats_text(j, ms, total_ms, text, sizeof text);
        ok = image_write_text(o->stats, text, pending + count, &error);
        ids[count++] = id;
    }
    for (int i = 0; ok && i < count; ++i) {
        id = ids[i];
        ok = image_commit(pending + i, &error);
    }
    for (int i = 0; i < count; ++i)
        image_discard(pending + i);
    return ok ? 1 : error_line("%s %s", option_table[id].name, error.text);
}

/* Only the statistics: the images of a sequence are written frame by frame. */
static int write_stats(const job *j, const double ms[STAGES_MAX], double total_ms) {
    image_error error;
    image_pending pending;
    char text[2048];
    int ok;
    if (!j->options->stats)
        return 1;
    memset(&pending, 0, sizeof pending);
    stats_text(j, ms, total_ms, text, sizeof text);
    ok = image_write_text(j->options->stats, text, &pending, &error) && image_commit(&pending, &error);
    image_discard(&pending);
    return ok ? 1 : error_line("--stats %s", error.text);
}

/* ---- frames of a sequence ----------------------------------------------------------------------------------------- */

/* How many there are from --frame on. */
static int count_frames(job *j) {
    const options *o = j->options;
    char name[4096], path[4096];
    struct stat info;
    j->first = o->frame;
    for (j->count = 0; j->count < 1000000; ++j->count) {
        frame_name(o, o->sequence, j->first + j->count, name, sizeof name);
        if (!image_spec_path(name, path, sizeof path) || stat(path, &info) != 0)
            break;
    }
    return j->count
               ? 1
               : error_line("--sequence %s: there is no file", frame_name(o, o->sequence, j->first, name, sizeof name));
}

/* Input and motion of frame k. */
static int begin_frame(job *j, int k) {
    const options *o = j->options;
    int width = j->desc.width, height = j->desc.height;
    if (k > 0 && !read_inputs(j, j->first + (uint32_t)k))
        return 0;
    if (j->depth.width != width || j->depth.height != height) {
        char name[4096];
        return error_line("--sequence %s: %d x %d, but the first frame is %d x %d",
                          frame_name(o, o->sequence, j->first + (uint32_t)k, name, sizeof name), j->depth.width,
                          j->depth.height, width, height);
    }
    j->frame.desc.depth = j->depth.data;
    j->frame.desc.normals = o->normal ? j->normals.data : NULL;
    if (k > 0 && j->cameras && !relative_camera(j->cameras[k], j->cameras[k - 1], j->frame.view_to_previous))
        return error_line("--camera %s: the matrix of frame %d cannot be inverted", o->camera, k);
    return 1;
}

/* Runs it --repeat times, or once for each frame. ms[stage] and the total are medians. */
static int compute(job *j, double ms[STAGES_MAX], double *total_ms) {
    int repeat = j->runs, ok = 1;
    double *times = malloc(sizeof *times * (STAGES_MAX + 1) * (size_t)repeat);
    if (!times)
        return error_line("--repeat %d: not enough memory", repeat);
    j->terminal = isatty(STDERR_FILENO);
    j->started = cli_seconds();
    for (j->run = 0; ok && j->run < repeat; ++j->run) {
        double seconds[STAGES_MAX], sum = 0.0;
        ok = (!j->options->sequence || begin_frame(j, j->run)) && compute_once(j, seconds);
        for (int s = 0; ok && s < j->stages; ++s) {
            times[s * repeat + j->run] = 1e3 * seconds[s];
            sum += 1e3 * seconds[s];
        }
        if (ok)
            times[STAGES_MAX * repeat + j->run] = sum;
        if (ok && j->options->sequence) {
            ok = write_outputs(j, j->first + (uint32_t)j->run, NULL, 0.0);
            show_progress(j, 1, 1);
        }
        for (int t = 0; ok && (j->run == 0 || j->options->sequence) && t < pool_threads(j->workers); ++t) {
            j->total.sky += j->stats[t].sky;
            j->total.masked += j->stats[t].masked;
            j->total.small_radius += j->stats[t].small_radius;
            j->total.derived_normals += j->stats[t].derived_normals;
            j->total.samples += j->stats[t].samples;
            j->total.unchanged += j->stats[t].unchanged;
            memset(&j->stats[t], 0, sizeof j->stats[t]);
        }
    }
    if (j->shown)
        fputs("\r          \r", stderr);
    for (int s = 0; ok && s < j->stages; ++s)
        ms[s] = cli_median(times + s * repeat, repeat);
    *total_ms = ok ? cli_median(times + STAGES_MAX * repeat, repeat) : 0.0;
    free(times);
    return ok;
}

static void free_job(job *j) {
    image_free(&j->depth);
    image_free(&j->normals);
    image_free(&j->visibility);
    image_free(&j->bent);
    image_free(&j->sh);
    free(j->sh_planes);
    image_free(&j->color);
    image_free(&j->thickness);
    for (int i = 0; i < GTAO_MAX_LAYERS; ++i)
        image_free(&j->layer[i]);
    for (int i = 0; i <= GTAO_MAX_LAYERS; ++i)
        image_free(&j->back[i]);
    pool_destroy(j->workers);
    free(j->cameras);
    free(j->stats);
    free(j->scratch);
}

int main(int argc, char **argv) {
    options o;
    for (int i = 1; i < argc; ++i)
        if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0) {
            print_help();
            return 0;
        }
    if (!parse_options(argc, argv, &o) || !check_options(&o))
        return 2;
    job j;
    memset(&j, 0, sizeof j);
    j.options = &o;
    double ms[STAGES_MAX] = {0}, total_ms = 0.0;
    int ok = (!o.sequence || count_frames(&j)) && read_inputs(&j, o.frame);
    j.runs = o.sequence ? (int)j.count : o.repeat;
    if (ok && o.camera) {
        int matrices = read_cameras(&o, &j.cameras);
        ok = matrices > 0;
        if (ok && matrices < j.runs)
            ok = error_line("--camera %s: %d matrices for %d frames", o.camera, matrices, j.runs);
    }
    if (ok)
        set_desc(&j);
    ok = ok && allocate(&j) && compute(&j, ms, &total_ms);
    if (ok)
        ok = o.sequence ? write_stats(&j, ms, total_ms) : write_outputs(&j, 0, ms, total_ms);
    free_job(&j);
    return ok ? 0 : 2;
}
