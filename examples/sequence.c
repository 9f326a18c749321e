/* sequence - a camera path through the built-in scene, frame by frame through gtao.h's pipeline: how far one noisy
 * frame, the spatial filter and the temporal one are from 96 directions at every pixel.
 *
 *     build/sequence [options] [DIRECTORY]        `build/sequence --help` lists them
 *
 * writes DIRECTORY/error.txt (a line a frame: its number; for each variant the root mean square and the mean of the
 * error, and its flicker, the root mean square of the error's change since the frame before where visibility is smooth),
 * strip.png, and frame000.png ... for the animation. The camera rests, moves, rests while the hoop moves, and cuts to
 * another view. */
#include "gtao.h"

#include "canvas.h"
#include "cli.h"
#include "court.h"
#include "image.h"
#include "render.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* ---- the path ----------------------------------------------------------------------------------------------------- */

enum { REST = 36, CAMERA = 48, OBJECT = 48, CUT = 36, FRAMES = REST + CAMERA + OBJECT + CUT };
enum { CUT_FRAME = REST + CAMERA + OBJECT };

static double ease(double t) { /* from rest to rest */
    t = t < 0 ? 0 : t > 1 ? 1 : t;
    return t * t * (3 - 2 * t);
}

static void place(int frame, raster_view *view) {
    double moved = ease((double)(frame - REST) / CAMERA), flown = (double)(frame - REST - CAMERA) / OBJECT;
    flown = flown < 0 ? 0 : flown > 1 ? 1 : flown;
    double yaw = 0.15 + 0.75 * moved, pitch = 0.36 - 0.1 * moved, distance = 6.4 - 1.2 * moved;
    vec3 target = v3(0.5, 0.75, -0.2);
    if (frame >= CUT_FRAME)
        yaw = -0.75, pitch = 0.22, distance = 6.0, target = v3(-0.6, 0.9, -0.6);
    vec3 d = v3(cos(pitch) * sin(yaw), sin(pitch), cos(pitch) * cos(yaw));
    view->world_to_view = raster_look_at(v3_mad(target, d, distance), target);
    for (int i = 0; i < COURT_PARTS; ++i) {
        mesh_frame f = court_part(i, 1.2 + 2.6 * flown);
        view->part_to_world[i] = raster_of_frame(&f);
    }
}

/* ---- what is compared --------------------------------------------------------------------------------------------- */

enum { NOISY, SPATIAL, TEMPORAL, HALF, VARIANTS };

typedef struct variant {
    const char *name;
    render_settings settings;
    render_memory memory;
    float *visibility, *error, *error_before; /* infinite where there is no surface */
    double rmse, mean, flicker;
} variant;

typedef struct reference {
    void *scratch;
    size_t size;
    float *one, *mean;
} reference;

static void prepare_rows(void *user, int thread, int row_begin, int row_end) {
    (void)thread;
    gtao_prepare_rows(user, row_begin, row_end);
}

static void visibility_rows(void *user, int thread, int row_begin, int row_end) {
    (void)thread;
    gtao_visibility_rows(user, row_begin, row_end, NULL);
}

/* The mean of all 24 frames of noise, four slices each: 96 slices at every pixel, sampled as the pipeline does. */
static int compute_reference(const gtao_desc *frame, reference *ref, pool *workers, const char **error) {
    enum { PHASES = 24 };
    size_t pixels = (size_t)frame->width * (size_t)frame->height;
    gtao_desc desc = *frame;
    gtao_output output;
    gtao_context *context;
    memset(&output, 0, sizeof output);
    memset(ref->mean, 0, pixels * sizeof *ref->mean);
    output.visibility = ref->one;
    desc.slices = 4;
    for (uint32_t k = 0; k < PHASES; ++k) {
        desc.frame = k;
        size_t size = gtao_scratch_size(&desc);
        if (size > ref->size) {
            free(ref->scratch);
            ref->scratch = malloc(size);
            ref->size = ref->scratch ? size : 0;
        }
        gtao_result result = gtao_begin(&desc, &output, ref->scratch, ref->size, &context);
        if (result != GTAO_OK) {
            *error = gtao_result_string(result);
            return 0;
        }
        pool_run(workers, desc.height, GTAO_STRIP, prepare_rows, NULL, context);
        pool_run(workers, desc.height, GTAO_STRIP, visibility_rows, NULL, context);
        for (size_t i = 0; i < pixels; ++i)
            ref->mean[i] += ref->one[i] / (float)PHASES;
    }
    return 1;
}

/* Where pixel i's surface was in the previous frame, or -1 where that did not see it. */
static ptrdiff_t pixel_before(const renderer *r, const float *depth_before, size_t i) {
    const float *motion = r->buffers.motion + 3 * i;
    float x = floorf((float)(i % (size_t)r->width) + 0.5f + motion[0]);
    float y = floorf((float)(i / (size_t)r->width) + 0.5f + motion[1]);
    float z = r->buffers.depth[i] + motion[2];
    if (!(x >= 0.0f && y >= 0.0f && x < (float)r->width && y < (float)r->height))
        return -1;
    ptrdiff_t before = (ptrdiff_t)y * r->width + (ptrdiff_t)x;
    return fabsf(depth_before[before] - z) < 0.02f * z ? before : -1;
}

/* Away from edges of the truth, where a shift by part of a pixel alone would change the error. */
static int is_smooth(const renderer *r, const float *truth, size_t i) {
    size_t x = i % (size_t)r->width, y = i / (size_t)r->width, row = (size_t)r->width;
    if (x == 0 || y == 0 || x + 1 == row || y + 1 == (size_t)r->height)
        return 0;
    return fabsf(truth[i] - truth[i - 1]) < 0.03f && fabsf(truth[i] - truth[i + 1]) < 0.03f &&
           fabsf(truth[i] - truth[i - row]) < 0.03f && fabsf(truth[i] - truth[i + row]) < 0.03f;
}

static void compare(const renderer *r, const float *depth_before, const float *truth, variant *v) {
    double sum = 0, squares = 0, count = 0, changes = 0, changed = 0;
    float *swap = v->error;
    v->error = v->error_before;
    v->error_before = swap;
    for (size_t i = 0; i < (size_t)r->width * (size_t)r->height; ++i) {
        v->error[i] = HUGE_VALF;
        if (!isfinite(r->buffers.depth[i]))
            continue;
        double e = (double)v->visibility[i] - (double)truth[i];
        ptrdiff_t before = pixel_before(r, depth_before, i);
        v->error[i] = (float)e;
        sum += e, squares += e * e, count += 1;
        if (before >= 0 && is_smooth(r, truth, i)) {
            double change = e - (double)v->error_before[before];
            changes += change * change, changed += 1;
        }
    }
    v->mean = count > 0 ? sum / count : 0;
    v->rmse = count > 0 ? sqrt(squares / count) : 0;
    v->flicker = changed > 0 ? sqrt(changes / changed) : 0;
}

/* ---- pictures ----------------------------------------------------------------------------------------------------- */

enum { LABEL = 26, GAP = 6, HEADER = 34 };

/* The middle `columns` of a picture, which the renderer's pixels (null) or a visibility buffer give. */
static void draw_tile(image *canvas, int x, int y, const renderer *r, int columns, const float *visibility) {
    int first = (r->width - columns) / 2;
    for (int j = 0; j < r->height; ++j)
        for (int i = 0; i < columns; ++i) {
            size_t p = (size_t)j * (size_t)r->width + (size_t)(first + i);
            float *to = canvas->data + 3 * ((size_t)(y + j) * (size_t)canvas->width + (size_t)(x + i));
            for (int k = 0; k < 3; ++k)
                to[k] = !visibility                     ? (float)(r->picture[p] >> (16 - 8 * k) & 255u) / 255.0f
                        : isfinite(r->buffers.depth[p]) ? visibility[p]
                                                        : 0.12f;
        }
}

static void draw_label(image *canvas, int x, int y, const char *left, const char *right, int width) {
    canvas_text(canvas, (float)x + 6.0f, (float)y + 18.0f, CANVAS_LEFT, CANVAS_BOLD, 14.0f, color_hex(0xf2f2f0), left);
    canvas_text(canvas, (float)(x + width) - 6.0f, (float)y + 18.0f, CANVAS_RIGHT, CANVAS_REGULAR, 14.0f,
                color_hex(0xec9a45), right);
}

static int save(const char *directory, const char *name, const image *picture) {
    char path[4096];
    image_error error;
    image_pending pending = {NULL, NULL};
    snprintf(path, sizeof path, "%s/%s", directory, name);
    int ok = image_write(path, picture, NULL, IMAGE_RANGE_UNIT, &pending, &error) && image_commit(&pending, &error);
    image_discard(&pending);
    if (!ok)
        cli_error("%s", error.text);
    return ok;
}

/* ---- the program -------------------------------------------------------------------------------------------------- */

typedef struct sequence {
    int width, height, threads;
    const char *directory;
    mesh mesh;
    renderer renderer;
    raster_view view;
    pool *workers;
    variant variants[VARIANTS];
    reference reference;
    image strip, tiles;
    int strip_tile; /* pixels across */
    float *depth_before;
    double rmse[VARIANTS][FRAMES], flicker[VARIANTS][FRAMES];
    char text[FRAMES * 160]; /* error.txt */
    size_t text_length;
} sequence;

/* Frames of the strip, and what to notice in them. */
static const struct {
    int frame;
    const char *title;
} columns[] = {{0, "first frame"},
               {REST - 1, "at rest"},
               {REST + CAMERA / 2, "camera moves"},
               {REST + CAMERA + OBJECT / 2, "hoop moves"},
               {CUT_FRAME, "after a cut"},
               {CUT_FRAME + 8, "8 frames later"}};
enum { COLUMNS = 6, STRIP_ROWS = 5 };

static void add_to_strip(sequence *s, int frame) {
    static const char *const rows[STRIP_ROWS] = {"one frame", "spatial", "spatial + temporal", "96 directions", "lit"};
    int tile = s->strip_tile;
    for (int c = 0; c < COLUMNS; ++c) {
        if (columns[c].frame != frame)
            continue;
        int x = c * (tile + GAP);
        canvas_text(&s->strip, (float)x + 6.0f, 23.0f, CANVAS_LEFT, CANVAS_BOLD, 17.0f, color_hex(0xf2f2f0),
                    columns[c].title);
        for (int k = 0; k < STRIP_ROWS; ++k) {
            int y = HEADER + k * (s->height + LABEL);
            const float *shown = k < 3 ? s->variants[k].visibility : k == 3 ? s->reference.mean : NULL;
            char right[32] = "";
            if (k < 3)
                snprintf(right, sizeof right, "RMSE %.3f", s->variants[k].rmse);
            draw_tile(&s->strip, x, y + LABEL, &s->renderer, tile, shown);
            draw_label(&s->strip, x, y, rows[k], right, tile);
        }
    }
}

static int add_to_animation(sequence *s, int frame) {
    static const char *const titles[3] = {"one frame", "spatial filter", "spatial and temporal"};
    char name[32], right[32];
    canvas_fill(&s->tiles, 0, 0, s->tiles.width, s->tiles.height, color_hex(0x121316));
    for (int k = 0; k < 4; ++k) {
        int x = k % 2 * (s->width + GAP), y = k / 2 * (s->height + LABEL);
        if (k < 3) {
            draw_tile(&s->tiles, x, y + LABEL, &s->renderer, s->width, s->variants[k].visibility);
            snprintf(right, sizeof right, "RMSE %.3f", s->variants[k].rmse);
            draw_label(&s->tiles, x, y, titles[k], right, s->width);
        } else {
            draw_tile(&s->tiles, x, y + LABEL, &s->renderer, s->width, NULL);
            draw_label(&s->tiles, x, y, "in the light of a dome",
                       frame < REST                     ? "at rest"
                       : frame < REST + CAMERA          ? "camera moves"
                       : frame < REST + CAMERA + OBJECT ? "hoop moves"
                                                        : "after a cut",
                       s->width);
        }
    }
    snprintf(name, sizeof name, "frame%03d.png", frame / 3);
    return save(s->directory, name, &s->tiles);
}

static int run_frame(sequence *s, int frame) {
    const char *error = NULL;
    gtao_frame_desc desc;
    raster_view_advance(&s->view);
    place(frame, &s->view);
    int cut = frame == 0 || frame == CUT_FRAME;
    if (cut)
        raster_view_advance(&s->view);
    render_settings all = s->variants[TEMPORAL].settings;
    all.cut = cut;
    int ok = render_frame(&s->renderer, &s->view, &all, RENDER_SHADED, s->workers, &error);
    s->text_length += (size_t)snprintf(s->text + s->text_length, sizeof s->text - s->text_length, "%d", frame);
    for (int k = 0; ok && k < VARIANTS; ++k) {
        variant *v = s->variants + k;
        gtao_output output;
        memset(&output, 0, sizeof output);
        output.visibility = v->visibility;
        v->settings.cut = cut;
        render_describe(&s->renderer, &v->settings, &desc);
        ok = render_occlude(&desc, &output, &v->memory, s->workers, NULL, &error);
    }
    ok = ok && compute_reference(&desc.desc, &s->reference, s->workers, &error);
    if (!ok) {
        cli_error("%s", error);
        return 0;
    }
    for (int k = 0; k < VARIANTS; ++k) {
        variant *v = s->variants + k;
        compare(&s->renderer, s->depth_before, s->reference.mean, v);
        s->rmse[k][frame] = v->rmse;
        s->flicker[k][frame] = v->flicker;
        s->text_length += (size_t)snprintf(s->text + s->text_length, sizeof s->text - s->text_length,
                                           " %.5f %+.5f %.5f", v->rmse, v->mean, cut ? 0.0 : v->flicker);
    }
    s->text_length += (size_t)snprintf(s->text + s->text_length, sizeof s->text - s->text_length, "\n");
    memcpy(s->depth_before, s->renderer.buffers.depth, (size_t)s->width * (size_t)s->height * sizeof *s->depth_before);
    add_to_strip(s, frame);
    return frame % 3 || add_to_animation(s, frame);
}

/* Means over the parts of the path, as a table in Markdown. */
static void print_summary(const sequence *s) {
    static const struct {
        const char *name;
        int first, last;
    } parts[] = {{"at rest, last 6 frames", REST - 6, REST},
                 {"camera moves", REST, REST + CAMERA},
                 {"hoop moves", REST + CAMERA, CUT_FRAME},
                 {"first frame after the cut", CUT_FRAME, CUT_FRAME + 1},
                 {"6th to 11th", CUT_FRAME + 6, CUT_FRAME + 12}};
    printf("| RMSE of visibility (change of the error) |");
    for (int k = 0; k < VARIANTS; ++k)
        printf(" %s |", s->variants[k].name);
    printf("\n|---|--:|--:|--:|--:|\n");
    for (size_t p = 0; p < sizeof parts / sizeof *parts; ++p) {
        printf("| %s |", parts[p].name);
        for (int k = 0; k < VARIANTS; ++k) {
            double rmse = 0, flicker = 0, frames = parts[p].last - parts[p].first;
            for (int frame = parts[p].first; frame < parts[p].last; ++frame)
                rmse += s->rmse[k][frame] / frames, flicker += s->flicker[k][frame] / frames;
            printf(" %.4f", rmse);
            if (parts[p].first != CUT_FRAME) /* which has nothing to change from */
                printf(" (%.4f)", flicker);
            printf(" |");
        }
        printf("\n");
    }
}

static int run_all(sequence *s) {
    char path[4096];
    image_error error;
    image_pending pending = {NULL, NULL};
    cli_progress progress = {"frames", 0.0, 0.0, 0};
    for (int frame = 0; frame < FRAMES; ++frame) {
        if (!run_frame(s, frame))
            return 0;
        cli_progress_show(&progress, (frame + 1.0) / FRAMES);
    }
    cli_progress_end();
    print_summary(s);
    snprintf(path, sizeof path, "%s/error.txt", s->directory);
    int ok = image_write_text(path, s->text, &pending, &error) && image_commit(&pending, &error);
    image_discard(&pending);
    if (!ok)
        cli_error("%s", error.text);
    return ok && save(s->directory, "strip.png", &s->strip);
}

static int create(sequence *s) {
    image_error error;
    size_t pixels = (size_t)s->width * (size_t)s->height;
    variant *v = s->variants;
    s->strip_tile = s->width * 2 / 3;
    v[NOISY].name = "one frame", v[SPATIAL].name = "spatial", v[TEMPORAL].name = "spatial + temporal";
    v[HALF].name = "half resolution";
    v[NOISY].settings.no_spatial = 1;
    v[NOISY].settings.no_temporal = v[SPATIAL].settings.no_temporal = 1;
    for (int k = 0; k < VARIANTS; ++k) {
        v[k].settings.no_half = k != HALF;
        v[k].settings.radius = 1.0f;
        v[k].visibility = malloc(pixels * sizeof *v[k].visibility);
        v[k].error = malloc(pixels * sizeof *v[k].error);
        v[k].error_before = malloc(pixels * sizeof *v[k].error_before);
        if (!v[k].visibility || !v[k].error || !v[k].error_before)
            return 0;
    }
    s->depth_before = calloc(pixels, sizeof *s->depth_before); /* 0: nothing was seen */
    s->reference.one = malloc(pixels * sizeof *s->reference.one);
    s->reference.mean = malloc(pixels * sizeof *s->reference.mean);
    s->workers = pool_create(s->threads);
    court_build(&s->mesh);
    s->view = raster_view_of(s->width, s->height, 45, 0.02);
    return s->depth_before && s->reference.one && s->reference.mean && s->workers &&
           render_create(&s->renderer, &s->mesh, s->width, s->height) &&
           image_create(&s->strip, COLUMNS * (s->strip_tile + GAP) - GAP, HEADER + STRIP_ROWS * (s->height + LABEL), 3,
                        &error) &&
           image_create(&s->tiles, 2 * s->width + GAP, 2 * (s->height + LABEL), 3, &error);
}

static void destroy(sequence *s) {
    for (int k = 0; k < VARIANTS; ++k) {
        free(s->variants[k].memory.state);
        free(s->variants[k].visibility);
        free(s->variants[k].error);
        free(s->variants[k].error_before);
    }
    free(s->depth_before);
    free(s->reference.scratch);
    free(s->reference.one);
    free(s->reference.mean);
    image_free(&s->strip);
    image_free(&s->tiles);
    render_free(&s->renderer);
    pool_destroy(s->workers);
    mesh_free(&s->mesh);
}

enum { OPT_SIZE, OPT_THREADS, OPT_DIRECTORY, OPT_COUNT };

typedef struct options {
    int size[2], threads;
    const char *directory;
    unsigned char given[OPT_COUNT];
} options;

static const cli_option option_table[OPT_COUNT] = {
    [OPT_SIZE] = {"--size", "WIDTHxHEIGHT", "(480x270)", CLI_SIZE(options, size, 64, 4096, NULL)},
    [OPT_THREADS] = {"--threads", "N", "(all processors)", CLI_THREADS(options, threads)},
    [OPT_DIRECTORY] = {"DIRECTORY", "", "where the files go (build/demo-sequence)", CLI_TEXT(options, directory),
                       .expected = "a directory"},
};

static const cli_program program = {"sequence",
                                    "a moving camera and a moving thing, denoised: errors and pictures",
                                    "[options] [DIRECTORY]",
                                    NULL,
                                    option_table,
                                    OPT_COUNT,
                                    0};

int main(int argc, char **argv) {
    static sequence s;
    options o;
    memset(&o, 0, sizeof o);
    o.size[0] = 480, o.size[1] = 270;
    o.threads = cli_processors();
    int status = cli_parse(&program, argc, argv, &o, o.given);
    if (status != CLI_GO)
        return status;
    s.width = o.size[0], s.height = o.size[1];
    s.threads = o.threads;
    s.directory = o.directory ? o.directory : "build/demo-sequence";
    if (mkdir(s.directory, 0777) != 0 && errno != EEXIST) {
        cli_error("%s: %s", s.directory, strerror(errno));
        return 2;
    }
    canvas_load_fonts();
    int ok = create(&s);
    if (!ok)
        cli_error("out of memory");
    ok = ok && run_all(&s);
    destroy(&s);
    canvas_free_fonts();
    return ok ? 0 : 2;
}
