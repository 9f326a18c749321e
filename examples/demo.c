/* demo - what the library makes of a rendered scene, beside ray-traced truth: a contact sheet, and what it cost.
 *
 *     build/demo-sheet [SCENE.exr [SCENE.json]] [DIRECTORY]      (tests/data/study.exr, build/demo)
 *
 * writes DIRECTORY/sheet.png, strip.png (depth, visibility, truth), visibility.exr and bent.exr. */
#include "gtao.h"

#include "canvas.h"
#include "cli.h"
#include "image.h"
#include "pool.h"
#include "scene.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static const float demo_albedo[3] = {0.78f, 0.40f, 0.20f}; /* fired clay: bright enough that light bounces visibly */

/* ---- computing ---------------------------------------------------------------------------------------------------- */

typedef struct result {
    image visibility, bent;
    double prepare_ms, visibility_ms, total_ms; /* medians */
    double rmse, mean_error;                    /* against the truth, where there is a surface */
    int slices, steps, threads;
    gtao_isa isa;
} result;

typedef struct task {
    gtao_context *context;
} task;

static void prepare_rows(void *user, int thread, int row_begin, int row_end) {
    (void)thread;
    gtao_prepare_rows(((task *)user)->context, row_begin, row_end);
}

static void visibility_rows(void *user, int thread, int row_begin, int row_end) {
    (void)thread;
    gtao_visibility_rows(((task *)user)->context, row_begin, row_end, NULL);
}

static void free_result(result *r) {
    image_free(&r->visibility);
    image_free(&r->bent);
}

static void compare(const scene *s, result *r) {
    double sum = 0.0, squares = 0.0, count = 0.0;
    size_t pixels = (size_t)s->depth.width * (size_t)s->depth.height;
    for (size_t i = 0; i < pixels; ++i) {
        if (!scene_visible(s, i))
            continue;
        double e = (double)r->visibility.data[i] - (double)s->truth.data[i];
        sum += e;
        squares += e * e;
        count += 1.0;
    }
    r->mean_error = count > 0.0 ? sum / count : 0.0;
    r->rmse = count > 0.0 ? sqrt(squares / count) : 0.0;
}

/* `repeat` runs on `threads` threads; what the descriptor asks for, bent normals included. */
static int compute(const scene *s, const gtao_desc *desc, int threads, int repeat, result *r) {
    enum { MAX_REPEAT = 16 };
    double prepare[MAX_REPEAT], march[MAX_REPEAT], total[MAX_REPEAT];
    image_error error;
    gtao_output output;
    task t = {NULL};
    size_t size = gtao_scratch_size(desc);
    void *scratch = malloc(size ? size : 1);
    pool *workers = pool_create(threads);
    memset(r, 0, sizeof *r);
    memset(&output, 0, sizeof output);
    gtao_result code = GTAO_ERROR_SCRATCH;
    int ok = scratch && workers && image_create(&r->visibility, desc->width, desc->height, 1, &error) &&
             image_create(&r->bent, desc->width, desc->height, 3, &error);
    output.visibility = r->visibility.data;
    output.bent_normals = r->bent.data;
    repeat = repeat < MAX_REPEAT ? repeat : MAX_REPEAT;
    for (int i = 0; ok && i < repeat; ++i) {
        double t0 = cli_seconds();
        code = gtao_begin(desc, &output, scratch, size, &t.context);
        ok = code == GTAO_OK;
        if (!ok)
            break;
        double t1 = cli_seconds();
        pool_run(workers, desc->height, GTAO_STRIP, prepare_rows, NULL, &t);
        double t2 = cli_seconds();
        pool_run(workers, desc->height, GTAO_STRIP, visibility_rows, NULL, &t);
        double t3 = cli_seconds();
        prepare[i] = 1e3 * (t2 - t1);
        march[i] = 1e3 * (t3 - t2);
        total[i] = 1e3 * (t3 - t0);
    }
    if (ok) {
        r->prepare_ms = cli_median(prepare, repeat);
        r->visibility_ms = cli_median(march, repeat);
        r->total_ms = cli_median(total, repeat);
        r->slices = gtao_context_slices(t.context);
        r->steps = gtao_context_steps(t.context);
        r->isa = gtao_context_isa(t.context);
        r->threads = pool_threads(workers);
        compare(s, r);
    } else {
        fprintf(stderr, "demo: %s\n", gtao_result_string(code));
        free_result(r);
    }
    pool_destroy(workers);
    free(scratch);
    return ok;
}

/* The visibility of one frame with the spatial filter behind it, on one thread. */
static int compute_filtered(const scene *s, const gtao_desc *desc, int repeat, result *r) {
    enum { MAX_REPEAT = 16 };
    double total[MAX_REPEAT];
    image_error error;
    gtao_output output;
    gtao_frame_desc frame;
    memset(&frame, 0, sizeof frame);
    memset(&output, 0, sizeof output);
    memset(r, 0, sizeof *r);
    frame.desc = *desc;
    frame.no_temporal = 1;
    frame.cut = 1; /* so that each run is a first frame */
    size_t size = gtao_frame_state_size(&frame);
    void *state = calloc(1, size ? size : 1);
    gtao_result code = GTAO_ERROR_SCRATCH;
    int ok = state && image_create(&r->visibility, desc->width, desc->height, 1, &error);
    output.visibility = r->visibility.data;
    repeat = repeat < MAX_REPEAT ? repeat : MAX_REPEAT;
    for (int i = 0; ok && i < repeat; ++i) {
        double t0 = cli_seconds();
        code = gtao_frame(&frame, &output, state, size, NULL);
        ok = code == GTAO_OK;
        total[i] = 1e3 * (cli_seconds() - t0);
    }
    if (ok) {
        r->total_ms = cli_median(total, repeat);
        compare(s, r);
    } else {
        fprintf(stderr, "demo: %s\n", gtao_result_string(code));
        free_result(r);
    }
    free(state);
    return ok;
}

/* ---- panels ------------------------------------------------------------------------------------------------------- */

static const unsigned ink_paper = 0x121316, ink_bar = 0x1b1d21, ink_text = 0xf2f2f0, ink_soft = 0x9ba1a8,
                      ink_rule = 0x2c2f35, ink_accent = 0xec9a45, ink_sky = 0x1e2126;

static color grey(float v) {
    color c;
    v = v > 0.0f ? v < 1.0f ? v : 1.0f : 0.0f;
    c.r = c.g = c.b = v;
    return c;
}

static void put(image *picture, size_t pixel, color c) {
    picture->data[3 * pixel] = c.r;
    picture->data[3 * pixel + 1] = c.g;
    picture->data[3 * pixel + 2] = c.b;
}

static int compare_floats(const void *a, const void *b) {
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* Nearest and farthest but for a few outliers. */
static int depth_range(const scene *s, float *near_z, float *far_z) {
    size_t pixels = (size_t)s->depth.width * (size_t)s->depth.height, count = 0;
    float *sorted = malloc(pixels * sizeof *sorted);
    if (!sorted)
        return 0;
    for (size_t i = 0; i < pixels; ++i)
        if (scene_visible(s, i))
            sorted[count++] = s->depth.data[i];
    qsort(sorted, count, sizeof *sorted, compare_floats);
    *near_z = count ? sorted[count / 500] : 1.0f;
    *far_z = count ? sorted[count - 1 - count / 100] : 2.0f;
    free(sorted);
    return 1;
}

/* Logarithmic, as perspective sees it: equal ratios of distance, equal steps of tone. */
static void paint_depth(image *picture, const scene *s, float near_z, float far_z) {
    float range = logf(far_z / near_z);
    for (size_t i = 0; i < (size_t)picture->width * (size_t)picture->height; ++i)
        put(picture, i,
            scene_visible(s, i) ? color_depth(logf(s->depth.data[i] / near_z) / (range > 0.0f ? range : 1.0f))
                                : color_hex(ink_sky));
}

/* Shown with y up and z to the viewer, the way normal maps are. */
static color normal_color(const float n[3], int library_axes) {
    float flip = library_axes ? -1.0f : 1.0f;
    color c;
    c.r = 0.5f + 0.5f * n[0];
    c.g = 0.5f + 0.5f * flip * n[1];
    c.b = 0.5f + 0.5f * flip * n[2];
    return c;
}

static void paint_normals(image *picture, const scene *s) {
    const float *m = s->world_to_view;
    for (size_t i = 0; i < (size_t)picture->width * (size_t)picture->height; ++i) {
        const float *w = s->normals.data + 3 * i;
        float v[3];
        for (int k = 0; k < 3; ++k)
            v[k] = m[3 * k] * w[0] + m[3 * k + 1] * w[1] + m[3 * k + 2] * w[2];
        put(picture, i, scene_visible(s, i) ? normal_color(v, 0) : color_hex(ink_sky));
    }
}

static void paint_bent(image *picture, const scene *s, const image *bent) {
    for (size_t i = 0; i < (size_t)picture->width * (size_t)picture->height; ++i)
        put(picture, i, scene_visible(s, i) ? normal_color(bent->data + 3 * i, 1) : color_hex(ink_sky));
}

/* Two halves, or twice the same. */
static void paint_visibility(image *picture, const scene *s, const image *left, const image *right) {
    for (size_t i = 0; i < (size_t)picture->width * (size_t)picture->height; ++i) {
        const image *from = (int)(i % (size_t)picture->width) < picture->width / 2 ? left : right;
        put(picture, i, scene_visible(s, i) ? grey(from->data[i]) : color_hex(ink_sky));
    }
}

static const float difference_range = 0.5f;

static void paint_difference(image *picture, const scene *s, const image *visibility) {
    for (size_t i = 0; i < (size_t)picture->width * (size_t)picture->height; ++i)
        put(picture, i,
            scene_visible(s, i) ? color_difference((visibility->data[i] - s->truth.data[i]) / difference_range)
                                : color_hex(ink_sky));
}

/* Left of the middle one bounce (albedo times visibility), right of it all of them. */
static void paint_multi_bounce(image *picture, const scene *s, const image *visibility) {
    for (size_t i = 0; i < (size_t)picture->width * (size_t)picture->height; ++i) {
        float rgb[3], v = visibility->data[i];
        int right = (int)(i % (size_t)picture->width) >= picture->width / 2;
        gtao_multi_bounce_rgb(v, demo_albedo, rgb);
        color c;
        c.r = demo_albedo[0] * (right ? rgb[0] : v);
        c.g = demo_albedo[1] * (right ? rgb[1] : v);
        c.b = demo_albedo[2] * (right ? rgb[2] : v);
        put(picture, i, scene_visible(s, i) ? color_encode(c) : color_hex(ink_sky));
    }
}

/* Light of an evening sky from a direction in view space (right, up, back) and its part upwards in the world: blue
 * above, a low sun over the viewer's left shoulder, little from below. Linear. */
static color sky_light(const float v[3], float up) {
    float sun = -0.80f * v[0] + 0.28f * v[1] + 0.53f * v[2], sky = 0.5f + 0.5f * up;
    sun = sun > 0.0f ? sun * sun * sun : 0.0f;
    color c;
    c.r = 0.06f + 0.17f * sky * sky + 1.00f * sun;
    c.g = 0.06f + 0.25f * sky * sky + 0.63f * sun;
    c.b = 0.06f + 0.43f * sky * sky + 0.31f * sun;
    return c;
}

/* Irradiance looked up along the bent normal, times visibility with bounces: ambient light as a renderer applies it. */
static void paint_ambient(image *picture, const scene *s, const result *r) {
    const float *m = s->world_to_view;
    for (size_t i = 0; i < (size_t)picture->width * (size_t)picture->height; ++i) {
        const float *b = r->bent.data + 3 * i;
        float v[3], light = 1.0f;
        if (scene_visible(s, i)) {
            v[0] = b[0]; /* right, down, forward to right, up, back */
            v[1] = -b[1];
            v[2] = -b[2];
            light = gtao_multi_bounce(r->visibility.data[i], 0.6f);
        } else { /* the sky itself, along the view ray */
            v[0] = ((float)(i % (size_t)picture->width) + 0.5f - 0.5f * (float)picture->width) / s->focal_px;
            v[1] = (0.5f * (float)picture->height - 0.5f - (float)(i / (size_t)picture->width)) / s->focal_px;
            v[2] = -1.0f;
            float scale = 1.0f / sqrtf(v[0] * v[0] + v[1] * v[1] + 1.0f);
            for (int k = 0; k < 3; ++k)
                v[k] *= scale;
        }
        float up = m[2] * v[0] + m[5] * v[1] + m[8] * v[2]; /* world z: the transpose's last row */
        color c = sky_light(v, up);
        c.r *= light;
        c.g *= light;
        c.b *= light;
        put(picture, i, color_encode(c));
    }
}

/* ---- the sheet ---------------------------------------------------------------------------------------------------- */

enum { MARGIN = 40, GAP = 22, LABEL = 44, HEADER = 118, COLUMNS = 3, ROWS = 3 };

typedef struct sheet {
    image canvas;
    int panel_width, panel_height;
    int left, top; /* of the first panel */
} sheet;

static void panel_at(const sheet *s, int index, int *x, int *y) {
    *x = s->left + index % COLUMNS * (s->panel_width + GAP);
    *y = s->top + index / COLUMNS * (s->panel_height + LABEL + GAP);
}

/* A label bar with the picture under it. */
static void place_panel(sheet *s, int index, const image *picture, const char *title, const char *note) {
    int x, y;
    panel_at(s, index, &x, &y);
    canvas_fill(&s->canvas, x, y, s->panel_width, LABEL, color_hex(ink_bar));
    canvas_text(&s->canvas, (float)x + 14.0f, (float)y + 29.0f, CANVAS_LEFT, CANVAS_BOLD, 19.0f, color_hex(ink_text),
                title);
    canvas_text(&s->canvas, (float)(x + s->panel_width) - 14.0f, (float)y + 29.0f, CANVAS_RIGHT, CANVAS_REGULAR, 15.0f,
                color_hex(ink_soft), note);
    canvas_draw(&s->canvas, x, y + LABEL, picture);
}

/* A colour scale at the right of a panel's label bar, where it covers no pixel. */
static void place_scale(sheet *s, int index, color (*map)(float), float first, float last, const char *low,
                        const char *high) {
    enum { BAR_WIDTH = 128, BAR_HEIGHT = 14 };
    int x, y;
    panel_at(s, index, &x, &y);
    float right = (float)(x + s->panel_width) - 14.0f, baseline = (float)y + 29.0f;
    canvas_text(&s->canvas, right, baseline, CANVAS_RIGHT, CANVAS_REGULAR, 15.0f, color_hex(ink_soft), high);
    int left = (int)(right - canvas_text_width(CANVAS_REGULAR, 15.0f, high)) - 10 - BAR_WIDTH;
    canvas_text(&s->canvas, (float)left - 10.0f, baseline, CANVAS_RIGHT, CANVAS_REGULAR, 15.0f, color_hex(ink_soft),
                low);
    for (int i = 0; i < BAR_WIDTH; ++i)
        canvas_fill(&s->canvas, left + i, y + (LABEL - BAR_HEIGHT) / 2, 1, BAR_HEIGHT,
                    map(first + (last - first) * ((float)i + 0.5f) / (float)BAR_WIDTH));
    canvas_fill(&s->canvas, left + BAR_WIDTH / 2, y + (LABEL + BAR_HEIGHT) / 2 + 1, 1, 4, color_hex(ink_soft));
}

/* A second, quieter part of the title. */
static void place_subtitle(sheet *s, int index, const char *title, const char *text) {
    int x, y;
    panel_at(s, index, &x, &y);
    canvas_text(&s->canvas, (float)x + 14.0f + canvas_text_width(CANVAS_BOLD, 19.0f, title) + 14.0f, (float)y + 29.0f,
                CANVAS_LEFT, CANVAS_REGULAR, 15.0f, color_hex(ink_soft), text);
}

/* "+0.042" with a minus sign that is one. */
static void signed_text(double value, char *text, size_t size) {
    snprintf(text, size, "%s%.3f", value < 0.0 ? "−" : "+", fabs(value));
}

static void place_tag(sheet *s, int index, int right, const char *text) {
    int x, y, width = (int)canvas_text_width(CANVAS_REGULAR, 14.0f, text) + 20;
    panel_at(s, index, &x, &y);
    x += right ? s->panel_width / 2 + 10 : s->panel_width / 2 - 10 - width;
    y += LABEL + 10;
    canvas_fill(&s->canvas, x, y, width, 26, color_hex(ink_paper));
    canvas_text(&s->canvas, (float)x + 10.0f, (float)y + 18.0f, CANVAS_LEFT, CANVAS_REGULAR, 14.0f, color_hex(ink_text),
                text);
}

/* A line between a panel's halves, and what each shows. */
static void place_halves(sheet *s, int index, const char *left, const char *right) {
    int x, y;
    panel_at(s, index, &x, &y);
    canvas_fill(&s->canvas, x + s->panel_width / 2 - 1, y + LABEL, 2, s->panel_height, color_hex(ink_paper));
    place_tag(s, index, 0, left);
    place_tag(s, index, 1, right);
}

typedef struct preset_row {
    const char *name;
    gtao_preset preset;
    int repeat;
    result result, filtered; /* filtered: of those rows whose pictures show it */
} preset_row;

enum {
    PRESETS = 5,
    PICTURE_RAW = 1,
    PICTURE_STRIP = 3,
    PICTURE_BEST = 4
}; /* rows of the table whose pictures are shown */

static void sampling_text(const result *r, char *text, size_t size) {
    if (r->steps)
        snprintf(text, size, "%d slice%s × 2 × %d samples", r->slices, r->slices > 1 ? "s" : "", r->steps);
    else
        snprintf(text, size, "%d slices × every pixel", r->slices);
}

/* What it costs and how far it is from the truth, one line a preset, the error as bars. */
static void place_table(sheet *s, const preset_row *rows, const scene *sc) {
    static const char *const heads[] = {"preset", "sampling", "ms", "ns / pixel", "mean error", "RMSE"};
    static const float columns[] = {0.0f, 150.0f, 500.0f, 640.0f, 800.0f, 930.0f};
    enum { LINE = 34 };
    float left = MARGIN, top = HEADER + ROWS * (float)(s->panel_height + LABEL + GAP) + 26.0f, worst = 1e-6f;
    char text[200];
    double pixels = (double)sc->depth.width * (double)sc->depth.height;
    for (int i = 0; i < PRESETS; ++i)
        worst = rows[i].result.rmse > (double)worst ? (float)rows[i].result.rmse : worst;
    for (int c = 0; c < 6; ++c)
        canvas_text(&s->canvas, left + columns[c], top, c < 2 ? CANVAS_LEFT : CANVAS_RIGHT, CANVAS_REGULAR, 15.0f,
                    color_hex(ink_soft), heads[c]);
    canvas_fill(&s->canvas, MARGIN, (int)top + 11, s->canvas.width - 2 * MARGIN, 1, color_hex(ink_rule));
    for (int i = 0; i < PRESETS; ++i) {
        const result *r = &rows[i].result;
        float y = top + 38.0f + (float)(i * LINE);
        canvas_text(&s->canvas, left, y, CANVAS_LEFT, CANVAS_BOLD, 17.0f, color_hex(ink_text), rows[i].name);
        sampling_text(r, text, sizeof text);
        canvas_text(&s->canvas, left + columns[1], y, CANVAS_LEFT, CANVAS_REGULAR, 17.0f, color_hex(ink_soft), text);
        for (int c = 2; c < 6; ++c) {
            double value = c == 2   ? r->total_ms
                           : c == 3 ? 1e6 * r->total_ms / pixels
                           : c == 4 ? r->mean_error
                                    : r->rmse;
            if (c == 4)
                signed_text(value, text, sizeof text);
            else
                snprintf(text, sizeof text, c == 2 ? "%.1f" : c == 3 ? "%.0f" : "%.3f", value);
            canvas_text(&s->canvas, left + columns[c], y, CANVAS_RIGHT, CANVAS_MONO, 17.0f, color_hex(ink_text), text);
        }
        float full = (float)(s->canvas.width - MARGIN) - (left + columns[5] + 26.0f);
        canvas_fill(&s->canvas, (int)(left + columns[5]) + 26, (int)y - 13, (int)full, 14, color_hex(ink_bar));
        canvas_fill(&s->canvas, (int)(left + columns[5]) + 26, (int)y - 13, (int)(full * (float)r->rmse / worst), 14,
                    color_hex(ink_accent));
    }
    canvas_text(
        &s->canvas, left, top + 38.0f + (float)(PRESETS * LINE) + 14.0f, CANVAS_LEFT, CANVAS_REGULAR, 14.0f,
        color_hex(ink_soft),
        "One frame, not filtered; one thread, median of several runs, bent normals included. Error over surface "
        "pixels against the ray-traced truth, which sees what one depth layer cannot: the sides that are "
        "hidden, and what lies outside the picture.");
}

static void place_depth(sheet *s, int index, image *picture, const scene *sc, float near_z, float far_z) {
    char low[32], high[32];
    paint_depth(picture, sc, near_z, far_z);
    place_panel(s, index, picture, "Depth", "");
    place_subtitle(s, index, "Depth", "input");
    snprintf(low, sizeof low, "z  %.1f", (double)near_z);
    snprintf(high, sizeof high, "%.1f", (double)far_z);
    place_scale(s, index, color_depth, 0.0f, 1.0f, low, high);
}

static void scene_name(const char *path, char *name, size_t size) {
    const char *slash = strrchr(path, '/');
    snprintf(name, size, "%s", slash ? slash + 1 : path);
    char *dot = strrchr(name, '.');
    if (dot)
        *dot = 0;
}

static int make_sheet(sheet *s, const char *path, const scene *sc, const gtao_desc *desc, const preset_row *rows,
                      image_error *error) {
    const result *best = &rows[PICTURE_BEST].result, *raw = &rows[PICTURE_RAW].result;
    int w = sc->depth.width, h = sc->depth.height;
    char text[200], note[300];
    image picture;
    float near_z, far_z;
    s->panel_width = w;
    s->panel_height = h;
    s->left = MARGIN;
    s->top = HEADER;
    if (!depth_range(sc, &near_z, &far_z) || !image_create(&picture, w, h, 3, error))
        return 0;
    int width = 2 * MARGIN + COLUMNS * w + (COLUMNS - 1) * GAP;
    int height = HEADER + ROWS * (h + LABEL + GAP) + 286;
    if (!image_create(&s->canvas, width, height, 3, error)) {
        image_free(&picture);
        return 0;
    }
    canvas_fill(&s->canvas, 0, 0, width, height, color_hex(ink_paper));

    canvas_text(&s->canvas, MARGIN, 72.0f, CANVAS_LEFT, CANVAS_BOLD, 42.0f, color_hex(ink_text), "gtao.h");
    float after = MARGIN + canvas_text_width(CANVAS_BOLD, 42.0f, "gtao.h") + 22.0f;
    canvas_text(&s->canvas, after, 72.0f, CANVAS_LEFT, CANVAS_REGULAR, 22.0f, color_hex(ink_soft),
                "ground-truth ambient occlusion from depth and normals, on a CPU");
    char name[128];
    scene_name(path, name, sizeof name);
    snprintf(text, sizeof text, "%s  ·  %d × %d  ·  radius %g  ·  hard cutoff  ·  %s kernel", name, w, h,
             (double)desc->radius, gtao_isa_name(best->isa));
    canvas_text(&s->canvas, (float)(width - MARGIN), 72.0f, CANVAS_RIGHT, CANVAS_REGULAR, 19.0f, color_hex(ink_soft),
                text);

    place_depth(s, 0, &picture, sc, near_z, far_z);
    paint_normals(&picture, sc);
    place_panel(s, 1, &picture, "Normals", "input, view space");
    paint_bent(&picture, sc, &best->bent);
    place_panel(s, 2, &picture, "Bent normals", "mean unoccluded direction");

    paint_visibility(&picture, sc, &best->visibility, &best->visibility);
    sampling_text(best, text, sizeof text);
    snprintf(note, sizeof note, "%s, %s", rows[PICTURE_BEST].name, text);
    place_panel(s, 3, &picture, "Visibility", note);
    paint_visibility(&picture, sc, &sc->truth, &sc->truth);
    snprintf(note, sizeof note, "%d rays a pixel", sc->rays_per_pixel);
    place_panel(s, 4, &picture, "Ray-traced truth", sc->rays_per_pixel ? note : "");
    paint_difference(&picture, sc, &best->visibility);
    place_panel(s, 5, &picture, "Difference", "");
    snprintf(note, sizeof note, "RMSE %.3f", best->rmse);
    place_subtitle(s, 5, "Difference", note);
    place_scale(s, 5, color_difference, -1.0f, 1.0f, "too dark  −0.5", "+0.5  too bright");

    const result *filtered = &rows[PICTURE_RAW].filtered;
    paint_visibility(&picture, sc, &raw->visibility, &filtered->visibility);
    sampling_text(raw, text, sizeof text);
    snprintf(note, sizeof note, "%s, %.1f ms", text, filtered->total_ms);
    snprintf(text, sizeof text, "Visibility, %s preset", rows[PICTURE_RAW].name);
    place_panel(s, 6, &picture, text, note);
    place_halves(s, 6, "as computed", "filtered");
    paint_multi_bounce(&picture, sc, &best->visibility);
    snprintf(note, sizeof note, "albedo %.2f, %.2f, %.2f", (double)demo_albedo[0], (double)demo_albedo[1],
             (double)demo_albedo[2]);
    place_panel(s, 7, &picture, "Multiple bounces", note);
    place_halves(s, 7, "one bounce", "all bounces");
    paint_ambient(&picture, sc, best);
    place_panel(s, 8, &picture, "Ambient light", "evening sky along the bent normal");
    place_table(s, rows, sc);
    image_free(&picture);
    return 1;
}

/* The three pictures that say it shortest. */
static int make_strip(sheet *s, const scene *sc, const preset_row *row, image_error *error) {
    int w = sc->depth.width, h = sc->depth.height;
    float near_z, far_z;
    char text[64], note[300];
    image picture;
    s->panel_width = w;
    s->panel_height = h;
    s->left = s->top = MARGIN / 2;
    if (!depth_range(sc, &near_z, &far_z) || !image_create(&picture, w, h, 3, error))
        return 0;
    int ok = image_create(&s->canvas, MARGIN + COLUMNS * w + (COLUMNS - 1) * GAP, MARGIN + LABEL + h, 3, error);
    if (ok) {
        canvas_fill(&s->canvas, 0, 0, s->canvas.width, s->canvas.height, color_hex(ink_paper));
        place_depth(s, 0, &picture, sc, near_z, far_z);
        paint_visibility(&picture, sc, &row->filtered.visibility, &row->filtered.visibility);
        sampling_text(&row->result, text, sizeof text);
        snprintf(note, sizeof note, "%s, filtered, %.0f ms on one core", text, row->filtered.total_ms);
        place_panel(s, 1, &picture, "Visibility", note);
        paint_visibility(&picture, sc, &sc->truth, &sc->truth);
        snprintf(note, sizeof note, "%d rays a pixel", sc->rays_per_pixel);
        place_panel(s, 2, &picture, "Ray-traced truth", sc->rays_per_pixel ? note : "");
    }
    image_free(&picture);
    return ok;
}

/* ---- main --------------------------------------------------------------------------------------------------------- */

static int make_directory(const char *path) {
    char partial[1024];
    size_t n = strlen(path);
    if (n >= sizeof partial)
        return 0;
    for (size_t i = 1; i <= n; ++i)
        if (path[i] == '/' || path[i] == 0) {
            memcpy(partial, path, i);
            partial[i] = 0;
            if (mkdir(partial, 0777) != 0 && errno != EEXIST)
                return 0;
        }
    return 1;
}

static int write_file(const char *directory, const char *name, const image *img, const char *const *channels) {
    char path[1200];
    image_pending pending;
    image_error error;
    snprintf(path, sizeof path, "%s/%s", directory, name);
    if (!image_write(path, img, channels, IMAGE_RANGE_UNIT, &pending, &error) || !image_commit(&pending, &error)) {
        fprintf(stderr, "demo: %s\n", error.text);
        return 0;
    }
    printf("  %s\n", path);
    return 1;
}

static void print_results(const preset_row *rows, const scene *sc) {
    double pixels = (double)sc->depth.width * (double)sc->depth.height;
    printf("%-10s %6s %6s %10s %14s %10s %10s %8s %8s\n", "preset", "slices", "steps", "prepare ms", "visibility ms",
           "total ms", "ns/pixel", "RMSE", "mean");
    for (int i = 0; i < PRESETS; ++i) {
        const result *r = &rows[i].result;
        char steps[16];
        snprintf(steps, sizeof steps, "%d", r->steps);
        printf("%-10s %6d %6s %10.2f %14.2f %10.2f %10.1f %8.4f %+8.4f\n", rows[i].name, r->slices,
               r->steps ? steps : "all", r->prepare_ms, r->visibility_ms, r->total_ms, 1e6 * r->total_ms / pixels,
               r->rmse, r->mean_error);
    }
}

int main(int argc, char **argv) {
    static const char *const names_y[] = {"Y"}, *const names_bent[] = {"bent.X", "bent.Y", "bent.Z"};
    preset_row rows[PRESETS] = {
        {.name = "low", .preset = GTAO_PRESET_LOW, .repeat = 9},
        {.name = "medium", .preset = GTAO_PRESET_MEDIUM, .repeat = 9},
        {.name = "high", .preset = GTAO_PRESET_HIGH, .repeat = 9},
        {.name = "ultra", .preset = GTAO_PRESET_ULTRA, .repeat = 5},
        {.name = "reference", .preset = GTAO_PRESET_REFERENCE, .repeat = 1},
    };
    const char *exr = argc > 1 ? argv[1] : "tests/data/study.exr";
    const char *json = argc > 3 ? argv[2] : NULL, *directory = argc > 3 ? argv[3] : argc > 2 ? argv[2] : "build/demo";
    size_t n = strlen(directory);
    if (argc == 3 && n > 5 && strcmp(directory + n - 5, ".json") == 0) {
        json = directory;
        directory = "build/demo";
    }
    if (argc > 4 || (argc > 1 && argv[1][0] == '-')) {
        fprintf(stderr, "usage: demo-sheet [SCENE.exr [SCENE.json]] [DIRECTORY]\n");
        return 2;
    }
    scene sc;
    image_error error;
    if (!scene_read(exr, json, &sc, &error)) {
        fprintf(stderr, "demo: %s\n", error.text);
        return 2;
    }
    gtao_desc desc;
    scene_describe(&sc, &desc);
    int ok = make_directory(directory);
    if (!ok)
        fprintf(stderr, "demo: %s: cannot be made\n", directory);
    for (int i = 0; ok && i < PRESETS; ++i) {
        desc.preset = rows[i].preset;
        ok = compute(&sc, &desc, 1, rows[i].repeat, &rows[i].result);
        if (ok && (i == PICTURE_RAW || i == PICTURE_STRIP))
            ok = compute_filtered(&sc, &desc, rows[i].repeat, &rows[i].filtered);
    }
    if (ok) {
        sheet s;
        memset(&s, 0, sizeof s);
        printf("%s: %d x %d, radius %g, %s kernel, 1 thread; error against %d rays a pixel\n\n", exr, desc.width,
               desc.height, (double)desc.radius, gtao_isa_name(rows[0].result.isa), sc.rays_per_pixel);
        print_results(rows, &sc);
        printf("\n");
        canvas_load_fonts();
        ok = make_sheet(&s, exr, &sc, &desc, rows, &error);
        if (!ok)
            fprintf(stderr, "demo: %s\n", error.text);
        ok = ok && write_file(directory, "sheet.png", &s.canvas, NULL) &&
             write_file(directory, "visibility.exr", &rows[PICTURE_BEST].result.visibility, names_y) &&
             write_file(directory, "bent.exr", &rows[PICTURE_BEST].result.bent, names_bent);
        image_free(&s.canvas);
        ok = ok && make_strip(&s, &sc, rows + PICTURE_STRIP, &error) &&
             write_file(directory, "strip.png", &s.canvas, NULL);
        image_free(&s.canvas);
        canvas_free_fonts();
    }
    for (int i = 0; i < PRESETS; ++i) {
        free_result(&rows[i].result);
        free_result(&rows[i].filtered);
    }
    scene_free(&sc);
    return ok ? 0 : 2;
}
