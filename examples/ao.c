/* ao - ambient visibility and bent normals of a depth buffer, file to file. `ao --help` lists the options.
 *
 * Everything is read and checked first, computed second, and written last: a run that ends with an error leaves no
 * output behind. */
#include "gtao.h"

#include "cli.h"
#include "dump.h"
#include "image.h"
#include "pool.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* ---- options ------------------------------------------------------------------------------------------------------ */

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
    OPT_TOLERANCE,
    OPT_THIN_BLEND,
    OPT_THICKNESS,
    OPT_THICKNESS_MAP,
    OPT_BACK,
    OPT_LAYER,
    OPT_PRESET,
    OPT_SLICES,
    OPT_STEPS,
    OPT_ERROR_TARGET,
    OPT_BUDGET_MS,
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
    OPT_DUMP,
    OPT_COUNT
};

typedef struct options {
    const char *depth, *normal, *output, *bent, *sh, *stats, *dump; /* files */
    const char *sequence, *camera; /* pattern of the depth files; motion of the camera */
    const char *thickness_map, *layer[GTAO_MAX_LAYERS], *back[1 + GTAO_MAX_LAYERS]; /* backs: of the depth first */
    int layers;
    int depth_kind;
    float device_scale, device_bias, sky;
    cli_axes normal_axes; /* which of the file's axes the library's x, y, z are read from */
    float normal_to_view[9];
    float focal[2], center[2], fov_y_degrees, pixel_size;
    float radius, falloff, tolerance, thin_blend, thickness, albedo[3];
    float error_target, budget_ms;
    int max_radius_px, preset, slices, steps, estimator, weighting, noise, frame, border, isa;
    int half, denoise, no_skip;
    int threads, repeat;
    unsigned char given[OPT_COUNT];
} options;

static int set_back(void *settings, const cli_option *option, const char *value) {
    options *o = settings;
    if (o->back[o->layers])
        return cli_error("%s %s: the layer has one already", option->name, value);
    o->back[o->layers] = value;
    return 1;
}

static int set_layer(void *settings, const cli_option *option, const char *value) {
    options *o = settings;
    if (o->layers == GTAO_MAX_LAYERS)
        return cli_error("%s %s: more than %d", option->name, value, GTAO_MAX_LAYERS);
    o->layer[o->layers++] = value;
    return 1;
}

static const char *const depth_kinds[] = {"z", "distance", "device", "height", NULL};
static const char *const presets[] = {"medium", "low", "high", "ultra", "reference", NULL};
static const char *const estimators[] = {"normalized", "memo", NULL};
static const char *const weightings[] = {"cosine", "uniform", NULL};
static const char *const noises[] = {"memo", "hilbert", "none", NULL};
static const char *const borders[] = {"open", "clamp", "wrap", NULL};

static const cli_option option_table[OPT_COUNT] = {
    [OPT_DEPTH] = {"--depth", "FILE[:CHANNEL]", "depth, .exr or .pfm", CLI_INPUT(options, depth)},
    [OPT_SEQUENCE] = {"--sequence", "PATTERN",
                      "instead: depth of frames from --frame on, such as depth.%04d.exr; --normal, --bent and"
                      " -o are patterns then, and frames are filtered in time",
                      CLI_INPUT(options, sequence)},
    [OPT_CAMERA] = {"--camera", "FILE", "of a sequence: a line a frame, world to view, row-major 3x4; without: at rest",
                    CLI_INPUT(options, camera)},
    [OPT_DEPTH_KIND] = {"--depth-kind", "z|distance|device|height",
                        "planar z (default), ray length, device depth, ortho height",
                        CLI_CHOICE(options, depth_kind, depth_kinds)},
    [OPT_DEVICE_SCALE] = {"--device-scale", "A", "device depth d: 1/z = A d + B (ortho: -z = A d + B)",
                          CLI_FLOAT(options, device_scale, -CLI_FINITE, CLI_FINITE, "a finite number, not 0"),
                          .not_0 = 1},
    [OPT_DEVICE_BIAS] = {"--device-bias", "B", "",
                         CLI_FLOAT(options, device_bias, -CLI_FINITE, CLI_FINITE, "a finite number")},
    [OPT_SKY] = {"--sky", "Z", "depth at or beyond Z is sky (1e9)",
                 CLI_FLOAT(options, sky, CLI_ABOVE_0, HUGE_VAL, "a depth above 0, or inf")},
    [OPT_NORMAL] = {"--normal", "FILE[:LAYER]", "normals, .exr or .pfm; without: derived from depth",
                    CLI_INPUT(options, normal)},
    [OPT_NORMAL_AXES] = {"--normal-axes", "+x+y+z",
                         "the file's axes that the library's x (right), y (down), z (forward) are",
                         CLI_AXES(options, normal_axes, "three signed axes, each once, such as +x-y-z")},
    [OPT_NORMAL_TO_VIEW] = {"--normal-to-view", "m00,...,m22", "row-major 3x3, applied before the axes",
                            CLI_FLOATS(options, normal_to_view, 9, 9, -CLI_FINITE, CLI_FINITE,
                                       "nine finite numbers, row by row")},
    [OPT_FOCAL] = {"--focal", "FX[,FY]", "perspective: focal length in pixels",
                   CLI_FLOATS(options, focal, 1, 2, 1e-30, 1e30, "one or two positive, finite numbers")},
    [OPT_CENTER] = {"--center", "CX,CY", "perspective: principal point in pixels (image centre)",
                    CLI_FLOATS(options, center, 2, 2, -1e30, 1e30, "two finite numbers")},
    [OPT_FOV_Y] = {"--fov-y", "DEGREES", "perspective: vertical field of view, square pixels",
                   CLI_FLOAT(options, fov_y_degrees, CLI_ABOVE_0, 179.9999, "between 0 and 180 degrees")},
    [OPT_ORTHO] = {"--ortho", "PIXEL_SIZE", "orthographic: world units per pixel",
                   CLI_FLOAT(options, pixel_size, 1e-30, 1e30, "a positive, finite number")},
    [OPT_RADIUS] = {"--radius", "R", "reach of occluders, world units (1); inf: all",
                    CLI_FLOAT(options, radius, 0, HUGE_VAL, "a number, 0 or more")},
    [OPT_FALLOFF] = {"--falloff", "F", "part of the radius over which occlusion fades out, 0..1 (0)",
                     CLI_FLOAT(options, falloff, 0, 1, "0..1")},
    [OPT_MAX_RADIUS_PX] = {"--max-radius-px", "N", "cap of the search in pixels (0: none)",
                           CLI_INTEGER(options, max_radius_px, 0, 1 << 20, "an integer, 0 or more")},
    [OPT_TOLERANCE] = {"--tolerance", "E", "error of the visibility that may be traded for speed, 0..1 (0)",
                       CLI_FLOAT(options, tolerance, 0, 1, "0..1")},
    [OPT_THIN_BLEND] = {"--thin-blend", "B", "thickness heuristic of [J16], 0..1 (0: off)",
                        CLI_FLOAT(options, thin_blend, 0, 1, "0..1")},
    [OPT_THICKNESS] = {"--thickness", "T", "occluders are slabs of T world units (0: height field)",
                       CLI_FLOAT(options, thickness, 0, HUGE_VAL, "a number, 0 or more")},
    [OPT_THICKNESS_MAP] = {"--thickness-map", "FILE[:CHANNEL]",
                           "thickness of each pixel, world units; where not above 0: --thickness",
                           CLI_INPUT(options, thickness_map)},
    [OPT_BACK] = {"--back", "FILE[:CHANNEL]", "depth of the back faces of the --layer before it, or of --depth",
                  CLI_INPUTS(options, back, 1 + GTAO_MAX_LAYERS, set_back)},
    [OPT_LAYER] = {"--layer", "FILE[:CHANNEL]", "a further layer of depth, behind; up to 8 times",
                   CLI_INPUTS(options, layer, GTAO_MAX_LAYERS, set_layer)},
    [OPT_PRESET] = {"--preset", "low|medium|high|ultra|reference", "(medium)", CLI_CHOICE(options, preset, presets)},
    [OPT_SLICES] = {"--slices", "N", "directions per pixel, 1..64", CLI_INTEGER(options, slices, 1, 64, NULL)},
    [OPT_STEPS] = {"--steps", "N", "samples a side of a slice, 1..256; 0: every pixel",
                   CLI_INTEGER(options, steps, 0, 256, NULL)},
    [OPT_ERROR_TARGET] = {"--error-target", "E",
                          "instead: effort where the image needs it, for an RMSE of E (such as 0.04)",
                          CLI_FLOAT(options, error_target, CLI_ABOVE_0, 1, "above 0, up to 1")},
    [OPT_BUDGET_MS] = {"--budget-ms", "MS", "the same, for the least error in MS milliseconds",
                       CLI_FLOAT(options, budget_ms, CLI_ABOVE_0, 1e9, "a time above 0")},
    [OPT_ESTIMATOR] = {"--estimator", "normalized|memo", "(normalized)", CLI_CHOICE(options, estimator, estimators)},
    [OPT_WEIGHTING] = {"--weighting", "cosine|uniform", "(cosine)", CLI_CHOICE(options, weighting, weightings)},
    [OPT_NOISE] = {"--noise", "memo|hilbert|none", "(memo)", CLI_CHOICE(options, noise, noises)},
    [OPT_FRAME] = {"--frame", "N", "frame of the temporal noise (0)",
                   CLI_INTEGER(options, frame, 0, 0x7fffffff, "an integer, 0 or more")},
    [OPT_HALF] = {"--half", NULL, "compute at half resolution, upsample by depth", CLI_FLAG(options, half)},
    [OPT_DENOISE] = {"--denoise", "N", "passes of the spatial filter, 0..3 (0; of a sequence 1)",
                     CLI_INTEGER(options, denoise, 0, 3, NULL)},
    [OPT_ALBEDO] = {"--albedo", "R,G,B", "coloured visibility with multiple bounces, 0..1 each",
                    CLI_FLOATS(options, albedo, 3, 3, 0, 1, "three numbers, 0..1")},
    [OPT_BORDER] = {"--border", "clamp|wrap|open", "what lies outside the image (open: nothing)",
                    CLI_CHOICE(options, border, borders)},
    [OPT_BENT] = {"--bent", "FILE", "also write bent normals, view space; .exr, .pfm or .png",
                  CLI_OUTPUT(options, bent, IMAGE_ENDINGS)},
    [OPT_SH] = {"--sh", "FILE", "also write spherical harmonics of visibility times cosine, view space; .exr",
                CLI_OUTPUT(options, sh, ".exr")},
    [OPT_OUTPUT] = {"-o", "FILE", "visibility, 1 = open; .exr, .pfm or .png (8 bit, linear)",
                    CLI_OUTPUT(options, output, IMAGE_ENDINGS)},
    [OPT_ISA] = {"--isa", "auto|scalar|sse2|avx2|avx512|neon", "(auto) the results are the same bits",
                 CLI_ISA(options, isa)},
    [OPT_THREADS] = {"--threads", "N", "(all processors) the results are the same bits", CLI_THREADS(options, threads)},
    [OPT_NO_SKIP] = {"--no-skip", NULL, "compute what could be skipped; the results are the same bits",
                     CLI_FLAG(options, no_skip)},
    [OPT_REPEAT] = {"--repeat", "N", "compute N times, report medians (1)",
                    CLI_INTEGER(options, repeat, 1, 100000, NULL)},
    [OPT_STATS] = {"--stats", "FILE", "write times and counts as JSON", CLI_OUTPUT(options, stats, NULL)},
    [OPT_DUMP] = {"--dump", "DIR", "also write what lies between the stages, for ports to compare: docs/porting.md",
                  CLI_TEXT(options, dump)},
};

static const cli_program program = {
    "ao",
    "ambient visibility and bent normals of a depth buffer",
    "--depth FILE[:CHANNEL] (--focal FX | --fov-y DEGREES | --ortho PIXEL_SIZE) [options] -o FILE",
    "The library's axes are x right, y down, z into the screen; OpenGL's normals are --normal-axes +x-y-z.\n"
    "Without :CHANNEL and :LAYER the depth channel and the layer of normals are found by name.",
    option_table,
    OPT_COUNT,
    0};

static void set_defaults(options *o) {
    memset(o, 0, sizeof *o);
    o->radius = 1.0f;
    o->sky = 1e9f;
    o->threads = cli_processors();
    o->repeat = 1;
    cli_axes_of("+x+y+z", &o->normal_axes);
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
        return o->camera ? cli_error("--camera: only with --sequence") : 1;
    if (o->depth)
        return cli_error("--depth: cannot be combined with --sequence");
    if (o->given[OPT_REPEAT])
        return cli_error("--repeat: cannot be combined with --sequence");
    for (int i = 0; i < 4; ++i)
        if (names[i] && !is_pattern(names[i]))
            return cli_error("%s %s: of a sequence, must contain the frame's number once, as %%d or %%04d",
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
        return cli_error("--camera %s: cannot be opened", o->camera);
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
            return cli_error("--camera %s: line %d: expected 12 finite numbers", o->camera, number);
        }
        count++;
    }
    fclose(file);
    return count ? count : cli_error("--camera %s: no matrices", o->camera);
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

static int check_options(const options *o) {
    static const int cameras[] = {OPT_FOCAL, OPT_FOV_Y, OPT_ORTHO};
    int count = 0, last = 0;
    if (!check_sequence(o))
        return 0;
    if (!o->depth && !o->sequence)
        return cli_error("--depth: required, see --help");
    if (!o->output)
        return cli_error("-o: required, see --help");
    if (o->dump && o->given[OPT_REPEAT])
        return cli_error("--dump: cannot be combined with --repeat");
    for (int i = 0; i < 3; ++i)
        if (o->given[cameras[i]]) {
            if (count++)
                return cli_error("%s: cannot be combined with %s", option_table[cameras[i]].name,
                                 option_table[last].name);
            last = cameras[i];
        }
    if (!count)
        return cli_error("--focal, --fov-y or --ortho: one of them is required");
    if (o->given[OPT_CENTER] && o->given[OPT_ORTHO])
        return cli_error("--center: cannot be combined with --ortho");
    if (o->depth_kind == GTAO_DEPTH_HEIGHT && !o->given[OPT_ORTHO])
        return cli_error("--depth-kind height: needs --ortho");
    if (o->depth_kind == GTAO_DEPTH_DEVICE && !(o->given[OPT_DEVICE_SCALE] && o->given[OPT_DEVICE_BIAS]))
        return cli_error("--depth-kind device: needs --device-scale and --device-bias");
    for (int id = OPT_DEVICE_SCALE; id <= OPT_DEVICE_BIAS; ++id)
        if (o->given[id] && o->depth_kind != GTAO_DEPTH_DEVICE)
            return cli_error("%s: only with --depth-kind device", option_table[id].name);
    const float *m = o->normal_to_view;
    if (o->given[OPT_NORMAL_TO_VIEW] &&
        !(fabsf(m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
                m[2] * (m[3] * m[7] - m[4] * m[6])) > 0.0f))
        return cli_error("--normal-to-view: must be an invertible matrix");
    for (int id = OPT_NORMAL_AXES; id <= OPT_NORMAL_TO_VIEW; ++id)
        if (o->given[id] && !o->normal)
            return cli_error("%s: only with --normal", option_table[id].name);
    if (o->given[OPT_ERROR_TARGET] || o->given[OPT_BUDGET_MS]) {
        static const int others[] = {OPT_PRESET, OPT_SLICES, OPT_STEPS, OPT_HALF, OPT_DENOISE, OPT_SEQUENCE};
        const int id = o->given[OPT_ERROR_TARGET] ? OPT_ERROR_TARGET : OPT_BUDGET_MS;
        for (size_t i = 0; i < sizeof others / sizeof *others; ++i)
            if (o->given[others[i]])
                return cli_error("%s: cannot be combined with %s", option_table[id].name, option_table[others[i]].name);
        if (o->noise != GTAO_NOISE_MEMO)
            return cli_error("%s: needs --noise memo", option_table[id].name);
    }
    if (o->given[OPT_SKY] && o->depth_kind == GTAO_DEPTH_HEIGHT)
        return cli_error("--sky: not with --depth-kind height");
    if (o->sh && (o->half || o->denoise > 0 || o->sequence))
        return cli_error("--sh: not with --half, --denoise or --sequence");
    for (int id = OPT_THICKNESS_MAP; id <= OPT_LAYER; ++id)
        if (o->given[id] && (o->half || o->denoise > 0 || o->sequence))
            return cli_error("%s: not with --half, --denoise or --sequence", option_table[id].name);
    return 1;
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

    dump *dump; /* or null */

    int stages;
    const char *stage_names[STAGES_MAX];
    double deadline; /* of refine_rows, by cli_seconds */
    int run, runs;
    cli_progress progress;
    gtao_stats total;
} job;

static int same_window(const job *j, int id, const char *spec, const image *img) {
    const image *d = &j->depth;
    const char *name = option_table[id].name;
    if (d->width != img->width || d->height != img->height)
        return cli_error("%s %s: %d x %d, but the depth is %d x %d", name, spec, img->width, img->height, d->width,
                         d->height);
    if (d->origin_x != img->origin_x || d->origin_y != img->origin_y)
        return cli_error("%s %s: its data window lies elsewhere than the depth's", name, spec);
    return 1;
}

/* One channel that goes with the depth; nothing if `spec` is null. */
static int read_plane(const job *j, int id, const char *spec, image *out) {
    image_error error;
    if (!spec)
        return 1;
    if (!image_read_depth(spec, out, &error))
        return cli_error("%s %s", option_table[id].name, error.text);
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
        return cli_error("%s %s", o->sequence ? "--sequence" : "--depth", error.text);
    if (o->normal &&
        !image_read_normals(frame_name(o, o->normal, frame, normal_name, sizeof normal_name), &j->normals, &error))
        return cli_error("--normal %s", error.text);
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
    const float *m = o->given[OPT_NORMAL_TO_VIEW] ? o->normal_to_view : identity;
    desc->normals = j->normals.data;
    for (int row = 0; row < 3; ++row)
        for (int k = 0; k < 3; ++k)
            desc->normal_to_view[3 * row + k] = o->normal_axes.sign[row] * m[3 * o->normal_axes.axis[row] + k];
}

/* Without --center the principal point is the middle of the picture that the camera frames, which is not the middle
 * of the pixels if the file holds only a part of the picture. */
static void set_camera(const job *j, gtao_desc *desc) {
    const options *o = j->options;
    const image *d = &j->depth;
    gtao_camera *camera = &desc->camera;
    if (o->given[OPT_ORTHO]) {
        camera->projection = GTAO_ORTHOGRAPHIC;
        camera->sx = o->pixel_size;
        return;
    }
    if (o->given[OPT_FOV_Y])
        *camera = gtao_camera_from_fov(o->fov_y_degrees, d->display_width, d->display_height);
    else {
        camera->fx = o->focal[0];
        camera->fy = o->focal[1];
    }
    camera->off_center = 1;
    camera->cx = o->given[OPT_CENTER] ? o->center[0] : 0.5f * (float)d->display_width - (float)d->origin_x;
    camera->cy = o->given[OPT_CENTER] ? o->center[1] : 0.5f * (float)d->display_height - (float)d->origin_y;
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
    if (o->depth_kind != GTAO_DEPTH_HEIGHT && o->sky <= FLT_MAX) /* 0 is the library's for: only infinity */
        desc->sky_z = o->sky;
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
    desc->every_pixel = o->given[OPT_STEPS] && o->steps == 0;
    desc->tolerance = o->tolerance;
    desc->no_skip = o->no_skip ? (unsigned)GTAO_SKIP_ALL : 0;
    desc->error_target = o->given[OPT_ERROR_TARGET] ? o->error_target : o->given[OPT_BUDGET_MS] ? 1e-6f : 0.0f;
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
    desc->frame = (uint32_t)o->frame;
    desc->isa = (gtao_isa)o->isa;

    j->framed = o->half || o->denoise > 0 || o->sequence;
    j->frame.desc = *desc;
    j->frame.half = o->half;
    j->frame.spatial_passes = o->denoise;
    j->frame.no_spatial = o->denoise == 0 && (!o->sequence || o->given[OPT_DENOISE]);
    j->frame.no_temporal = !o->sequence;
    j->frame.no_skip = o->no_skip || o->dump; /* the same results, but all that lies between */
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
    case GTAO_ERROR_ALLOWED:
        return "--tolerance";
    case GTAO_ERROR_TARGET:
        return o->given[OPT_ERROR_TARGET] ? "--error-target" : "--budget-ms";
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
    return cli_error("%s: %s", option_of(j->options, result), gtao_result_string(result));
}

static int dump_error(const image_error *error) {
    return cli_error("--dump %s", error->text);
}

/* Memory for what only the dump needs. */
static int begin_dump(job *j) {
    const options *o = j->options;
    image_error error;
    int scale = o->half ? 2 : 1;
    j->dump = dump_create(o->dump, &error);
    return j->dump && dump_planes(j->dump, (j->desc.width + scale - 1) / scale, (j->desc.height + scale - 1) / scale,
                                  gtao_desc_slices(&j->desc),
                                  o->thickness > 0.0f || o->thickness_map || o->layers || o->back[0], !j->framed,
                                  &j->output, &error)
               ? 1
               : dump_error(&error);
}

/* What is known before the stages. */
static int dump_inputs(job *j) {
    char name[16];
    image_error error;
    snprintf(name, sizeof name, "%04lu", (unsigned long)j->first + (unsigned long)j->run);
    return (!j->options->sequence || dump_frame(j->dump, name, &error)) &&
                   dump_input(j->dump, &j->frame.desc, j->framed ? &j->frame : NULL, &error)
               ? 1
               : dump_error(&error);
}

static int dump_outputs(job *j) {
    static const float albedo[3] = {0.9f, 0.5f, 0.05f};
    const options *o = j->options;
    const gtao_context *whole = j->framed ? gtao_frame_image(j->frame_context) : j->context;
    image_error error;
    int ok = j->framed || (dump_search(j->dump, whole, whole, &j->output, &error) &&
                           dump_signal(j->dump, whole, j->output.signal, j->output.signal_planes, &error));
    ok = ok && dump_result(j->dump, whole, j->visibility.data, j->bent.data, j->sh_planes,
                           o->half ? NULL : j->output.surface, o->given[OPT_ALBEDO] ? o->albedo : albedo, &error);
    return ok ? 1 : dump_error(&error);
}

static int allocate(job *j) {
    const options *o = j->options;
    image_error error;
    int w = j->depth.width, h = j->depth.height;
    int ok = image_create(&j->visibility, w, h, 1, &error);
    ok = ok && (!(o->bent || o->dump) || image_create(&j->bent, w, h, 3, &error));
    ok = ok && (!o->sh || image_create(&j->sh, w, h, 9, &error));
    ok = ok && (!o->given[OPT_ALBEDO] || image_create(&j->color, w, h, 3, &error));
    if (!ok)
        return cli_error("--depth %s: %s", o->depth, error.text);
    j->output.visibility = j->visibility.data;
    j->output.bent_normals = j->bent.data;
    if (o->sh || (o->dump && !j->framed)) {
        j->sh_planes = malloc(sizeof(float) * 9 * (size_t)w * (size_t)h);
        if (!j->sh_planes)
            return cli_error("--depth %s: not enough memory", o->depth);
    }
    j->output.sh = j->sh_planes;

    if (o->dump && !begin_dump(j))
        return 0;
    j->scratch_size = j->framed ? gtao_frame_state_size(&j->frame) : gtao_scratch_size(&j->desc);
    if (j->scratch_size == 0) {
        gtao_result why = gtao_begin(&j->desc, &j->output, NULL, 0, &j->context);
        return library_error(j, why);
    }
    j->scratch = calloc(1, j->scratch_size);
    j->workers = pool_create(o->threads);
    j->stats = j->workers ? calloc((size_t)pool_threads(j->workers), sizeof *j->stats) : NULL;
    if (!j->scratch || !j->stats)
        return cli_error("--depth %s: not enough memory", o->depth);
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

static void share_rows(void *user, int thread, int row_begin, int row_end) {
    job *j = user;
    (void)thread;
    gtao_share_rows(j->context, row_begin, row_end);
}

/* Past the time limit rows keep their first result. */
static void refine_rows(void *user, int thread, int row_begin, int row_end) {
    job *j = user;
    if (cli_seconds() < j->deadline)
        gtao_refine_rows(j->context, row_begin, row_end, j->stats + thread);
}

static void multi_bounce_rows(void *user, int thread, int row_begin, int row_end) {
    job *j = user;
    (void)thread;
    size_t width = (size_t)j->depth.width, end = (size_t)row_end * width;
    for (size_t i = (size_t)row_begin * width; i < end; ++i)
        gtao_multi_bounce_rgb(j->visibility.data[i], j->options->albedo, j->color.data + 3 * i);
}

static void show_progress(void *user, int rows_done, int rows) {
    job *j = user;
    cli_progress_show(&j->progress, ((double)j->run + (double)rows_done / (double)rows) / (double)j->runs);
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

/* What --error-target and --budget-ms do after the first slice of each pixel. `end`: when time is up, by cli_seconds. */
static void refine(job *j, double seconds[STAGES_MAX], double *since, double end) {
    int rows = j->depth.height;
    double first = seconds[j->stages - 1], left;
    float most = 0;
    pool_run(j->workers, rows, 0, share_rows, NULL, j);
    stage_done(j, "share", seconds, since);
    j->deadline = HUGE_VAL;
    if (j->options->given[OPT_BUDGET_MS]) { /* without the share of what is refined, and of tables for that */
        j->deadline = end - seconds[j->stages - 1];
        left = 0.9 * (j->deadline - *since) - 0.1 * first;
        most = (float)(left / fmax(first, 1e-9));
        if (!(most > 0.01f))
            return;
    }
    most = gtao_refine_begin(j->context, most);
    stage_done(j, "plan", seconds, since);
    if (!(most > 0.0f))
        return;
    pool_run(j->workers, rows, 32, refine_rows, NULL, j);
    stage_done(j, "refine", seconds, since);
    pool_run(j->workers, rows, 0, share_rows, NULL, j);
    stage_done(j, "share_refined", seconds, since);
}

static int compute_once(job *j, double seconds[STAGES_MAX]) {
    int rows = j->depth.height;
    double since = cli_seconds(), end = since + 1e-3 * (double)j->options->budget_ms;
    gtao_result result;
    image_error error;
    j->stages = 0;
    if (j->dump && !dump_inputs(j))
        return 0;
    if (j->framed) {
        frame_stage s = {j, 0};
        result = gtao_frame_begin(&j->frame, &j->output, j->scratch, j->scratch_size, &j->frame_context);
        if (result != GTAO_OK)
            return library_error(j, result);
        stage_done(j, "begin", seconds, &since);
        for (; s.stage < gtao_frame_stages(j->frame_context); ++s.stage) {
            pool_run(j->workers, gtao_frame_units(j->frame_context, s.stage), 0, frame_units, NULL, &s);
            stage_done(j, gtao_frame_stage_name(j->frame_context, s.stage), seconds, &since);
            if (j->dump && !dump_frame_stage(j->dump, j->frame_context, s.stage, &j->output, &error))
                return dump_error(&error);
        }
    } else {
        result = gtao_begin(&j->desc, &j->output, j->scratch, j->scratch_size, &j->context);
        if (result != GTAO_OK)
            return library_error(j, result);
        stage_done(j, "begin", seconds, &since);
        pool_run(j->workers, rows, GTAO_STRIP, prepare_rows, NULL, j);
        stage_done(j, "prepare", seconds, &since);
        pool_run(j->workers, rows, GTAO_STRIP, visibility_rows, show_progress, j);
        stage_done(j, "visibility", seconds, &since);
        if (j->desc.error_target > 0.0f)
            refine(j, seconds, &since, end);
    }
    if (j->color.data) {
        pool_run(j->workers, rows, 0, multi_bounce_rows, NULL, j);
        stage_done(j, "multi_bounce", seconds, &since);
    }
    return !j->dump || dump_outputs(j);
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
             "  ],\n  \"samples\": %llu,\n  \"refined\": %llu,\n  \"derived_normals\": %llu,\n"
             "  \"skipped\": {\"sky\": %llu, \"masked\": %llu, \"small_radius\": %llu, \"sky_blocks\": %llu, "
             "\"radius_blocks\": %llu, \"open\": %llu, \"samples\": %llu, \"unchanged\": %llu}\n}\n",
             (unsigned long long)j->total.samples, (unsigned long long)j->total.refined,
             (unsigned long long)j->total.derived_normals, (unsigned long long)j->total.sky,
             (unsigned long long)j->total.masked, (unsigned long long)j->total.small_radius,
             (unsigned long long)j->total.sky_skipped, (unsigned long long)j->total.radius_skipped,
             (unsigned long long)j->total.open, (unsigned long long)j->total.samples_skipped,
             (unsigned long long)j->total.unchanged);
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
    return ok ? 1 : cli_error("%s %s", option_table[id].name, error.text);
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
    return ok ? 1 : cli_error("--stats %s", error.text);
}

/* ---- frames of a sequence ----------------------------------------------------------------------------------------- */

/* How many there are from --frame on. */
static int count_frames(job *j) {
    const options *o = j->options;
    char name[4096], path[4096];
    struct stat info;
    j->first = (uint32_t)o->frame;
    for (j->count = 0; j->count < 1000000; ++j->count) {
        frame_name(o, o->sequence, j->first + j->count, name, sizeof name);
        if (!image_spec_path(name, path, sizeof path) || stat(path, &info) != 0)
            break;
    }
    return j->count
               ? 1
               : cli_error("--sequence %s: there is no file", frame_name(o, o->sequence, j->first, name, sizeof name));
}

/* Input and motion of frame k. */
static int begin_frame(job *j, int k) {
    const options *o = j->options;
    int width = j->desc.width, height = j->desc.height;
    if (k > 0 && !read_inputs(j, j->first + (uint32_t)k))
        return 0;
    if (j->depth.width != width || j->depth.height != height) {
        char name[4096];
        return cli_error("--sequence %s: %d x %d, but the first frame is %d x %d",
                         frame_name(o, o->sequence, j->first + (uint32_t)k, name, sizeof name), j->depth.width,
                         j->depth.height, width, height);
    }
    j->frame.desc.depth = j->depth.data;
    j->frame.desc.normals = o->normal ? j->normals.data : NULL;
    if (k > 0 && j->cameras && !relative_camera(j->cameras[k], j->cameras[k - 1], j->frame.view_to_previous))
        return cli_error("--camera %s: the matrix of frame %d cannot be inverted", o->camera, k);
    return 1;
}

/* Runs it --repeat times, or once for each frame. ms[stage] and the total are medians. */
static int compute(job *j, double ms[STAGES_MAX], double *total_ms) {
    int repeat = j->runs, ok = 1;
    double *times = malloc(sizeof *times * (STAGES_MAX + 1) * (size_t)repeat);
    if (!times)
        return cli_error("--repeat %d: not enough memory", repeat);
    j->progress.what = j->options->sequence ? "frames" : "visibility";
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
            j->total.sky_skipped += j->stats[t].sky_skipped;
            j->total.radius_skipped += j->stats[t].radius_skipped;
            j->total.open += j->stats[t].open;
            j->total.samples_skipped += j->stats[t].samples_skipped;
            j->total.refined += j->stats[t].refined;
            j->total.unchanged += j->stats[t].unchanged;
            memset(&j->stats[t], 0, sizeof j->stats[t]);
        }
    }
    cli_progress_end();
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
    dump_discard(j->dump);
    pool_destroy(j->workers);
    free(j->cameras);
    free(j->stats);
    free(j->scratch);
}

int main(int argc, char **argv) {
    options o;
    set_defaults(&o);
    int status = cli_parse(&program, argc, argv, &o, o.given);
    if (status != CLI_GO)
        return status;
    if (!check_options(&o))
        return 2;
    job j;
    memset(&j, 0, sizeof j);
    j.options = &o;
    double ms[STAGES_MAX] = {0}, total_ms = 0.0;
    int ok = (!o.sequence || count_frames(&j)) && read_inputs(&j, (uint32_t)o.frame);
    j.runs = o.sequence ? (int)j.count : o.repeat;
    if (ok && o.camera) {
        int matrices = read_cameras(&o, &j.cameras);
        ok = matrices > 0;
        if (ok && matrices < j.runs)
            ok = cli_error("--camera %s: %d matrices for %d frames", o.camera, matrices, j.runs);
    }
    if (ok)
        set_desc(&j);
    ok = ok && allocate(&j) && compute(&j, ms, &total_ms);
    if (ok && j.dump) {
        image_error error;
        dump *d = j.dump;
        j.dump = NULL;
        ok = dump_commit(d, &error) ? 1 : dump_error(&error);
    }
    if (ok)
        ok = o.sequence ? write_stats(&j, ms, total_ms) : write_outputs(&j, 0, ms, total_ms);
    free_job(&j);
    return ok ? 0 : 2;
}
