/* bench_frames - what a frame of a sequence costs, stage by stage, beside the same frame written straight and what reading
 * and writing takes alone; and what the depth chain for far samples gains and costs. Tables in Markdown into a directory.
 *
 *     build/bench_frames [--quick] [--size WxH] [DIRECTORY]        (1920x1080, build/bench/tables)
 *
 * The scene is the viewer's, its camera circles and its hoop flies. One thread, processor time, medians; whatever is
 * compared takes turns within the same run. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cli.h"
#include "court.h"
#include "measure.h"
#include "render.h"
#include "straight.h"
#include "streams.h"

enum { REPEAT_MOST = 63, STAGES = 8, WARM = 4, REST_WARM = 76 };
static const float radius = 1.25f, falloff = 0.25f;

static void fail(const char *what) {
    fprintf(stderr, "bench_frames: %s\n", what);
    exit(1);
}

static void *take(size_t size) {
    void *memory = calloc(1, size);
    if (!memory)
        fail("out of memory");
    return memory;
}

/* ---- the scene ---------------------------------------------------------------------------------------------------- */

typedef struct stage_set {
    mesh mesh;
    renderer renderer;
    raster_view view;
    pool *workers;
} stage_set;

static void set_open(stage_set *s, int width, int height) {
    court_build(&s->mesh);
    s->view = raster_view_of(width, height, 50, 0.02);
    s->workers = pool_create(cli_processors());
    if (!s->workers || !render_create(&s->renderer, &s->mesh, width, height))
        fail("out of memory");
}

static void set_close(stage_set *s) {
    render_free(&s->renderer);
    pool_destroy(s->workers);
    mesh_free(&s->mesh);
}

/* Depth, normals and motion of frame k. */
static void set_draw(stage_set *s, int k) {
    static const render_settings nothing = {.no_occlusion = 1};
    const double yaw = 0.42 + 0.01 * k, pitch = 0.3, away = 8.2;
    const vec3 target = v3(0.15, 1.0, -1.0), d = v3(cos(pitch) * sin(yaw), sin(pitch), cos(pitch) * cos(yaw));
    const char *error = NULL;
    raster_view_advance(&s->view);
    s->view.world_to_view = raster_look_at(v3_mad(target, d, away), target);
    for (int i = 0; i < COURT_PARTS; ++i) {
        mesh_frame f = court_part(i, 1 + k / 30.0);
        s->view.part_to_world[i] = raster_of_frame(&f);
    }
    if (k == 0)
        raster_view_advance(&s->view);
    if (!render_frame(&s->renderer, &s->view, &nothing, RENDER_ALBEDO, s->workers, &error))
        fail(error);
}

/* From this frame's view space to the previous one's. */
static void camera_motion(const stage_set *s, float m[12]) {
    const raster_pose back = raster_inverse(&s->view.world_to_view);
    const raster_pose step = raster_compose(&s->view.world_to_view_before, &back);
    for (int i = 0; i < 12; ++i)
        m[i] = (float)step.m[i];
}

static gtao_frame_desc describe(const stage_set *s) {
    static const render_settings plain = {.radius = 1.25f};
    gtao_frame_desc f;
    render_describe(&s->renderer, &plain, &f);
    f.desc.max_radius_px = 100;
    return f;
}

/* ---- frames ------------------------------------------------------------------------------------------------------- */

typedef struct variant {
    const char *title;
    int full, bent, guided, rest, least; /* least: neither normals nor motion are given */
    gtao_isa isa;
    float view_to_previous[12]; /* if least */
    void *state;
    size_t size;
    const char *names[STAGES];
    double times[STAGES + 1][REPEAT_MOST], ms[STAGES + 1]; /* the last: all of the frame */
    int stages;                                            /* with "begin" */
} variant;

static void run_variant(variant *v, const gtao_frame_desc *frame, float *visibility, float *bent, int repeat) {
    gtao_frame_desc f = *frame;
    gtao_output output;
    gtao_frame_context *context;
    double start = thread_seconds(), t = start;
    memset(&output, 0, sizeof output);
    output.visibility = visibility;
    if (v->bent)
        output.bent_normals = bent;
    f.half = !v->full;
    f.desc.isa = v->isa;
    f.unchanged = v->rest == 2;
    f.upsample_normals = v->guided;
    if (v->least) {
        f.desc.normals = NULL, f.motion = NULL;
        memcpy(f.view_to_previous, v->view_to_previous, sizeof f.view_to_previous);
    }
    if (!v->state) {
        v->size = gtao_frame_state_size(&f);
        v->state = take(v->size);
        start = t = thread_seconds();
    }
    gtao_result result = gtao_frame_begin(&f, &output, v->state, v->size, &context);
    if (result != GTAO_OK)
        fail(gtao_result_string(result));
    v->stages = gtao_frame_stages(context) + 1;
    for (int k = 0; k < v->stages; ++k) {
        double now;
        if (k > 0)
            gtao_frame_run(context, k - 1, 0, gtao_frame_units(context, k - 1), NULL);
        now = thread_seconds();
        v->names[k] = k ? gtao_frame_stage_name(context, k - 1) : "begin";
        if (repeat >= 0)
            v->times[k][repeat] = 1e3 * (now - t);
        t = now;
    }
    if (repeat >= 0)
        v->times[STAGES][repeat] = 1e3 * (t - start);
}

static double ms_of(const variant *v, const char *name) {
    for (int k = 0; k < v->stages; ++k)
        if (strcmp(v->names[k], name) == 0)
            return v->ms[k];
    return 0;
}

static FILE *table(const char *directory, const char *name) {
    char path[4096];
    snprintf(path, sizeof path, "%s/%s.md", directory, name);
    FILE *file = fopen(path, "w");
    if (!file)
        fail("cannot write its tables");
    return file;
}

static void close_table(FILE *file) {
    if (fclose(file) != 0)
        fail("cannot write its tables");
}

/* What reading and writing alone takes. */
typedef struct stream_times {
    streams *memory;
    double ms[STREAM_STAGES + 1][REPEAT_MOST], bytes[STREAM_STAGES + 1];
    unsigned sum;
} stream_times;

static void run_streams(stream_times *t, const stream_frame *f, int repeat) {
    double start = thread_seconds(), at = start;
    for (int k = 0; k < STREAM_STAGES; ++k) {
        double now;
        t->bytes[k] = 0;
        t->sum += streams_run(t->memory, f, (stream_stage)k, &t->bytes[k]);
        now = thread_seconds();
        if (repeat >= 0)
            t->ms[k][repeat] = 1e3 * (now - at);
        at = now;
    }
    if (repeat >= 0)
        t->ms[STREAM_STAGES][repeat] = 1e3 * (at - start);
}

/* Beside the stages, for two settings. */
static void write_streams(const char *directory, const variant *const v[2], stream_times s[2],
                          const char *const names[], size_t pixels, int repeat) {
    double alone[2][STREAM_STAGES + 1];
    FILE *out = table(directory, "frames-streams");
    fprintf(out, "| stage | all inputs | its streams | MB | ratio | depth alone | its streams | MB | ratio "
                 "|\n|---|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (int k = 0; k <= STREAM_STAGES; ++k) {
        fprintf(out, k < STREAM_STAGES ? "| %s |" : "| **%s** |", k < STREAM_STAGES ? names[k] : "frame");
        for (int i = 0; i < 2; ++i) {
            const double ms = k < STREAM_STAGES ? ms_of(v[i], names[k]) : v[i]->ms[STAGES];
            alone[i][k] = median(s[i].ms[k], repeat);
            s[i].bytes[STREAM_STAGES] += k < STREAM_STAGES ? s[i].bytes[k] : 0;
            fprintf(out, " %.2f | %.2f | %.0f | %.1f |", ms, alone[i][k], 1e-6 * s[i].bytes[k], ms / alone[i][k]);
        }
        fprintf(out, "\n");
    }
    fprintf(out, "\n- ns a pixel of the %zu at half resolution (goal: 12, %s):", pixels,
            1e6 * v[1]->ms[STAGES] <= 12 * (double)pixels ? "met with depth alone" : "not met");
    for (int i = 0; i < 2; ++i)
        fprintf(out, " %s %.1f, its streams %.1f%s", i ? "depth alone" : "all inputs",
                1e6 * v[i]->ms[STAGES] / (double)pixels, 1e6 * alone[i][STREAM_STAGES] / (double)pixels,
                i ? "\n" : ";");
    close_table(out);
}

static void stages_and_straight(const char *directory, int width, int height, int repeat) {
    enum { MOVING, BENT, GUIDED, AVX2, FULL, REST, TOLD, VARIANTS, LEAST = VARIANTS, ALL };
    static variant v[ALL] = {{.title = "half"},
                             {.title = "half, with bent normals", .bent = 1},
                             {.title = "half, normals guide upsampling", .guided = 1},
                             {.title = "half, AVX2", .isa = GTAO_ISA_AVX2},
                             {.title = "full", .full = 1},
                             {.title = "half, nothing moves", .rest = 1},
                             {.title = "and `unchanged`", .rest = 2},
                             {.title = "half, depth alone", .least = 1}};
    static stream_times alone[2];
    static const char *const names[] = {"begin", "reduce", "prepare", "horizons", "spatial", "temporal", "upsample"};
    size_t n = (size_t)width * (size_t)height;
    float *visibility = take(n * 4), *other = take(n * 4), *bent = take(12 * n), *straight_v = take(n * 4);
    double seconds[STRAIGHT_STAGES] = {0}, each[STRAIGHT_STAGES + 1][REPEAT_MOST], straight_ms[STRAIGHT_STAGES + 1];
    double difference = 0;
    stage_set moving, still;
    straight *plain = straight_open(width, height);
    for (int i = 0; i < 2; ++i)
        alone[i].memory = streams_open(width, height);
    if (!plain || !alone[0].memory || !alone[1].memory)
        fail("out of memory");
    if (!gtao_isa_available(GTAO_ISA_AVX2))
        v[AVX2].isa = GTAO_ISA_AUTO;
    set_open(&moving, width, height);
    set_open(&still, width, height);
    set_draw(&still, 0);
    gtao_frame_desc rest = describe(&still);
    for (int k = 0; k < REST_WARM; ++k) {
        run_variant(&v[REST], &rest, visibility, bent, -1);
        run_variant(&v[TOLD], &rest, visibility, bent, -1);
    }
    for (int k = 0; k < WARM + repeat; ++k) {
        set_draw(&moving, k);
        gtao_frame_desc f = describe(&moving);
        view seen = {width,
                     height,
                     f.desc.camera.fx,
                     0.5f * (float)width,
                     0.5f * (float)height,
                     radius,
                     falloff,
                     moving.renderer.buffers.depth,
                     moving.renderer.buffers.normals};
        camera_motion(&moving, v[LEAST].view_to_previous);
        for (int i = 0; i < ALL; ++i)
            run_variant(&v[i], v[i].rest ? &rest : &f, i == MOVING ? visibility : other, bent, k - WARM);
        for (int i = 0; i < 2; ++i) {
            stream_frame inputs = {f.desc.depth, i ? NULL : f.desc.normals, i ? NULL : f.motion, other, (unsigned)k};
            run_streams(&alone[i], &inputs, k - WARM);
        }
        memset(seconds, 0, sizeof seconds);
        straight_frame(plain, &seen, f.motion, (unsigned)k, straight_v, seconds);
        each[STRAIGHT_STAGES][k < WARM ? 0 : k - WARM] = 0;
        for (int s = 0; s < STRAIGHT_STAGES; ++s) {
            each[s][k < WARM ? 0 : k - WARM] = 1e3 * seconds[s];
            each[STRAIGHT_STAGES][k < WARM ? 0 : k - WARM] += 1e3 * seconds[s];
        }
    }
    for (size_t i = 0; i < n; ++i)
        difference += ((double)visibility[i] - (double)straight_v[i]) * ((double)visibility[i] - (double)straight_v[i]);
    for (int i = 0; i < ALL; ++i) {
        for (int k = 0; k < v[i].stages; ++k)
            v[i].ms[k] = median(v[i].times[k], repeat);
        v[i].ms[STAGES] = median(v[i].times[STAGES], repeat);
    }
    for (int s = 0; s <= STRAIGHT_STAGES; ++s)
        straight_ms[s] = median(each[s], repeat);

    FILE *out = table(directory, "frames-stages");
    fprintf(out, "%dx%d, one thread, ms, medians of %d frames; the %s kernel unless named:\n\n| stage |", width, height,
            repeat, gtao_isa_name(gtao_isa_available(GTAO_ISA_AVX512) ? GTAO_ISA_AVX512 : GTAO_ISA_AUTO));
    for (int i = 0; i < VARIANTS; ++i)
        fprintf(out, " %s |", v[i].title);
    fprintf(out, " straight, half | of half |\n|---|");
    for (int i = 0; i < VARIANTS + 2; ++i)
        fprintf(out, "--:|");
    for (size_t k = 0; k < sizeof names / sizeof *names; ++k) {
        static const int straight_stage[] = {
            -1, STRAIGHT_REDUCE, -1, STRAIGHT_HORIZONS, STRAIGHT_SPATIAL, STRAIGHT_TEMPORAL, STRAIGHT_UPSAMPLE};
        fprintf(out, "\n| %s |", names[k]);
        for (int i = 0; i < VARIANTS; ++i)
            fprintf(out, " %.2f |", ms_of(&v[i], names[k]));
        if (straight_stage[k] >= 0)
            fprintf(out, " %.1f | %.0f x |", straight_ms[straight_stage[k]],
                    straight_ms[straight_stage[k]] / ms_of(&v[MOVING], names[k]));
        else
            fprintf(out, " | |");
    }
    fprintf(out, "\n| **frame** |");
    for (int i = 0; i < VARIANTS; ++i)
        fprintf(out, " %.2f |", v[i].ms[STAGES]);
    fprintf(out, " %.1f | %.1f x |\n\n", straight_ms[STRAIGHT_STAGES],
            straight_ms[STRAIGHT_STAGES] / v[MOVING].ms[STAGES]);

    double filters = ms_of(&v[MOVING], "spatial") + ms_of(&v[MOVING], "temporal") + ms_of(&v[MOVING], "upsample");
    double horizons = ms_of(&v[MOVING], "horizons"), told = v[TOLD].ms[STAGES] / v[MOVING].ms[STAGES];
    double ratio = straight_ms[STRAIGHT_STAGES] / v[MOVING].ms[STAGES];
    fprintf(out, "- filters and upsampling over the horizons: %.2f (goal: below 1, %s)\n", filters / horizons,
            filters < horizons ? "met" : "not met");
    fprintf(out,
            "- the straight frame over ours: %.1f, with AVX2 %.1f (goal: 40, %s); RMSE between the two results %.3f\n",
            ratio, straight_ms[STRAIGHT_STAGES] / v[AVX2].ms[STAGES], ratio >= 40 ? "met" : "not met",
            sqrt(difference / (double)n));
    fprintf(out,
            "- a frame in which nothing moves over a moving one: %.2f; where the caller says so: %.2f (goal: below "
            "0.25, %s)\n",
            v[REST].ms[STAGES] / v[MOVING].ms[STAGES], told, told < 0.25 ? "met" : "not met");
    close_table(out);
    const variant *const compared[2] = {&v[MOVING], &v[LEAST]};
    write_streams(directory, compared, alone, names + 1, n / 4, repeat);
    for (int i = 0; i < ALL; ++i)
        free(v[i].state);
    for (int i = 0; i < 2; ++i)
        streams_close(alone[i].memory);
    free(visibility), free(other), free(bent), free(straight_v);
    straight_close(plain);
    set_close(&moving);
    set_close(&still);
}

/* ---- error ---------------------------------------------------------------------------------------------------------- */

static double rmse(const float *a, const float *b, size_t n) {
    double sum = 0;
    for (size_t i = 0; i < n; ++i)
        sum += ((double)a[i] - (double)b[i]) * ((double)a[i] - (double)b[i]);
    return sqrt(sum / (double)n);
}

/* Seconds it took. */
static double compute(const gtao_desc *desc, float *visibility) {
    gtao_output output;
    size_t size = gtao_scratch_size(desc);
    void *scratch = take(size);
    memset(&output, 0, sizeof output);
    output.visibility = visibility;
    double start = thread_seconds();
    gtao_result result = gtao_compute(desc, &output, scratch, size, NULL);
    double seconds = thread_seconds() - start;
    if (result != GTAO_OK)
        fail(gtao_result_string(result));
    free(scratch);
    return seconds;
}

/* A camera at rest: one frame with the spatial filter, and 24 with both, against the mean of 96 slices at every pixel. */
static void tolerances(const char *directory, int width, int height) {
    static const struct {
        const char *name;
        float depth_tolerance;
        int half, guided;
    } rows[] = {{"full, a pixel's footprint", 0, 0, 0},
                {"full, a tenth of the depth [J16]", 0.1f, 0, 0},
                {"half, a pixel's footprint", 0, 1, 0},
                {"and normals guide upsampling", 0, 1, 1},
                {"half, a tenth of the depth [J16]", 0.1f, 1, 0}};
    size_t n = (size_t)width * (size_t)height;
    float *truth = take(n * 4), *one = take(n * 4), *visibility = take(n * 4);
    stage_set set;
    set_open(&set, width, height);
    set_draw(&set, 0);
    gtao_frame_desc frame = describe(&set);
    frame.motion = NULL;
    gtao_desc desc = frame.desc;
    desc.slices = 4;
    for (desc.frame = 0; desc.frame < 24; ++desc.frame) {
        compute(&desc, one);
        for (size_t i = 0; i < n; ++i)
            truth[i] += one[i] / 24;
    }
    FILE *out = table(directory, "frames-error");
    fprintf(
        out,
        "%dx%d, RMSE against 96 slices at every pixel:\n\n| spatial filter | one frame | 24 frames |\n|---|--:|--:|\n",
        width, height);
    for (size_t k = 0; k < sizeof rows / sizeof *rows; ++k) {
        gtao_frame_desc f = frame;
        gtao_output output;
        double error[2];
        memset(&output, 0, sizeof output);
        output.visibility = visibility;
        f.depth_tolerance = rows[k].depth_tolerance;
        f.half = rows[k].half;
        f.upsample_normals = rows[k].guided;
        for (int temporal = 0; temporal < 2; ++temporal) {
            f.no_temporal = !temporal;
            size_t size = gtao_frame_state_size(&f);
            void *state = take(size);
            for (int i = 0; i < (temporal ? 24 : 1); ++i)
                if (gtao_frame(&f, &output, state, size, NULL) != GTAO_OK)
                    fail("gtao_frame failed");
            error[temporal] = rmse(visibility, truth, n);
            free(state);
        }
        fprintf(out, "| %s | %.4f | %.4f |\n", rows[k].name, error[0], error[1]);
    }
    close_table(out);
    free(truth), free(one), free(visibility);
    set_close(&set);
}

/* Far samples from blocks, at a radius of hundreds of pixels. */
static void far_samples(const char *directory, int width, int height, int repeat) {
    enum { FARS = 7 };
    static const struct {
        gtao_far kind;
        int px;
    } rows[FARS] = {{GTAO_FAR_EXACT, 0},    {GTAO_FAR_NEAREST, 16}, {GTAO_FAR_NEAREST, 32}, {GTAO_FAR_NEAREST, 64},
                    {GTAO_FAR_AVERAGE, 16}, {GTAO_FAR_AVERAGE, 32}, {GTAO_FAR_AVERAGE, 64}};
    static const int steps[] = {12, 32};
    static double seconds[2][FARS][REPEAT_MOST];
    double error[2][FARS], mean[2][FARS];
    size_t n = (size_t)width * (size_t)height;
    float *truth = take(n * 4), *visibility = take(n * 4);
    stage_set set;
    set_open(&set, width, height);
    set_draw(&set, 0);
    gtao_desc desc = describe(&set).desc;
    desc.max_radius_px = 0;
    desc.radius = 4;
    desc.slices = 32, desc.steps = 128;
    compute(&desc, truth);
    desc.slices = 2;
    for (int r = 0; r < repeat; ++r)
        for (int m = 0; m < 2; ++m)
            for (int k = 0; k < FARS; ++k) {
                desc.steps = steps[m];
                desc.far_depth = rows[k].kind, desc.far_px = rows[k].px;
                seconds[m][k][r] = 1e3 * compute(&desc, visibility);
                error[m][k] = rmse(visibility, truth, n);
                mean[m][k] = 0;
                for (size_t i = 0; i < n; ++i)
                    mean[m][k] += ((double)visibility[i] - (double)truth[i]) / (double)n;
            }
    FILE *out = table(directory, "frames-far");
    fprintf(
        out,
        "%dx%d, radius %.0f pixels at the scene's distance, 2 slices, one thread, against 32 slices x 128 samples:\n\n",
        width, height, (double)(desc.radius * desc.camera.fx) / 8.2);
    fprintf(out, "| far samples | 12 samples: ms | RMSE | mean | 32 samples: ms | RMSE | mean "
                 "|\n|---|--:|--:|--:|--:|--:|--:|\n");
    for (int k = 0; k < FARS; ++k) {
        if (rows[k].kind)
            fprintf(out, "| %s from %d pixels |", rows[k].kind == GTAO_FAR_NEAREST ? "nearest" : "average", rows[k].px);
        else
            fprintf(out, "| exact |");
        for (int m = 0; m < 2; ++m)
            fprintf(out, " %.1f | %.4f | %+.4f |", median(seconds[m][k], repeat), error[m][k], mean[m][k]);
        fprintf(out, "\n");
    }
    close_table(out);
    free(truth), free(visibility);
    set_close(&set);
}

/* ---- command line --------------------------------------------------------------------------------------------------- */

typedef struct options {
    int quick, size[2];
    const char *directory;
} options;

int main(int argc, char **argv) {
    static const cli_option table_of[] = {
        {"--quick", NULL, "few repetitions", CLI_FLAG(options, quick)},
        {"--size", "WxH", "of the frame (1920x1080)", CLI_SIZE(options, size, 64, 4096, NULL)},
        {"DIRECTORY", "", "of the tables (build/bench/tables)", CLI_TEXT(options, directory),
         .expected = "a directory"}};
    enum { COUNT = sizeof table_of / sizeof *table_of };
    static const cli_program program = {
        "bench_frames", "what frames cost", "[options] [DIRECTORY]", NULL, table_of, COUNT, 0};
    unsigned char given[COUNT] = {0};
    options o = {0, {1920, 1080}, NULL};
    int status = cli_parse(&program, argc, argv, &o, given);
    if (status != CLI_GO)
        return status;
    if (!o.directory)
        o.directory = "build/bench/tables";
    int width = o.size[0] & ~1, height = o.size[1] & ~1;
    stages_and_straight(o.directory, width, height, o.quick ? 3 : 15);
    tolerances(o.directory, width / 2, height / 2);
    far_samples(o.directory, width, height, o.quick ? 1 : 5);
    return 0;
}
