/* viewer - a software renderer that uses gtao.h: an OBJ file or a built-in scene under an ambient dome, in a window, or
 * without one into a file. `viewer --help` lists the options and keys. */
#include "gtao.h"

#include "canvas.h"
#include "cli.h"
#include "court.h"
#include "image.h"
#include "render.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef __has_include
#if __has_include(<SDL2/SDL.h>)
#define VIEWER_WINDOW 1
#define SDL_MAIN_HANDLED
#include <SDL2/SDL.h>
#endif
#endif
#ifndef VIEWER_WINDOW
#define VIEWER_WINDOW 0
#endif

/* ---- options ------------------------------------------------------------------------------------------------------ */

enum {
    OPT_OBJ,
    OPT_SIZE,
    OPT_RADIUS,
    OPT_VIEW,
    OPT_WITHOUT,
    OPT_THREADS,
    OPT_FRAMES,
    OPT_SCREENSHOT,
    OPT_WINDOW,
    OPT_BENCHMARK,
    OPT_COUNT
};

typedef struct options {
    const char *obj, *screenshot;
    int size[2], show, frames, threads, window, benchmark;
    float radius; /* 0: from the size of the scene */
    render_settings settings;
    unsigned char given[OPT_COUNT];
} options;

static const char *const stage_names[] = {"occlusion", "half", "spatial", "temporal", "bounce", "bent", NULL};

static int *stage_switch(render_settings *s, int stage) { /* in the order of the names and of the keys 1 .. 6 */
    int *const switches[] = {&s->no_occlusion, &s->no_half,   &s->no_spatial,
                             &s->no_temporal,  &s->no_bounce, &s->no_bent};
    return switches[stage];
}

/* Names separated by commas, each a stage to switch off. */
static int set_without(void *settings, const cli_option *option, const char *value) {
    options *o = settings;
    do {
        int stage = cli_next_choice(&value, stage_names);
        if (stage < 0)
            return cli_bad_value(option, value, "occlusion, half, spatial, temporal, bounce or bent");
        *stage_switch(&o->settings, stage) = 1;
    } while (*value);
    return 1;
}

static const cli_option option_table[OPT_COUNT] = {
    [OPT_OBJ] = {"FILE.obj", "", "without: a scene of its own", CLI_INPUT(options, obj), .expected = "a scene"},
    [OPT_SIZE] = {"--size", "WIDTHxHEIGHT", "(1280x720)", CLI_SIZE(options, size, 16, 8192, NULL)},
    [OPT_RADIUS] = {"--radius", "R", "reach of occluders in the units of the scene",
                    CLI_FLOAT(options, radius, CLI_ABOVE_0, 1e9, "a positive number")},
    [OPT_VIEW] = {"--view", "NAME", "shaded, visibility, bent, depth, normals, albedo, motion",
                  CLI_CHOICE(options, show, render_show_names),
                  .expected = "shaded, visibility, bent, depth, normals, albedo or motion"},
    [OPT_WITHOUT] = {"--without", "STAGE,...", "occlusion, half, spatial, temporal, bounce, bent",
                     CLI_OWN(set_without)},
    [OPT_THREADS] = {"--threads", "N", "(all processors)", CLI_THREADS(options, threads)},
    [OPT_FRAMES] = {"--frames", "N", "stop after N frames (--screenshot, --benchmark: 30)",
                    CLI_INTEGER(options, frames, 1, 1000000, NULL)},
    [OPT_SCREENSHOT] = {"--screenshot", "FILE", "the last frame, .png; no window unless --window is given",
                        CLI_OUTPUT(options, screenshot, ".png")},
    [OPT_WINDOW] = {"--window", NULL, "a window too", CLI_FLAG(options, window)},
    [OPT_BENCHMARK] = {"--benchmark", NULL, "milliseconds of each stage, with occlusion and without; no window",
                       CLI_FLAG(options, benchmark)},
};

static const cli_program program = {
    "viewer",
    "a scene under an ambient dome, with the visibility and bent normals of gtao.h",
    "[FILE.obj] [options]",
    "drag: turn     right drag: move     wheel: nearer, farther     r: reset     space: stop what moves\n"
    "1 occlusion  2 half resolution  3 spatial filter  4 temporal filter  5 interreflection  6 bent normals\n"
    "s shaded  v visibility  b bent normals  d depth  n normals  a albedo  m motion  (tab: the next)\n"
    "+ - radius     t threads     h panel     p picture into viewer.png     escape: leave",
    option_table,
    OPT_COUNT,
    0};

/* ---- the scene and its camera ------------------------------------------------------------------------------------- */

typedef struct app {
    const options *options;
    mesh mesh;
    int built_in;
    renderer renderer;
    raster_view view;
    pool *workers;
    render_settings settings;
    render_show show;
    int frame;

    vec3 target;
    double yaw, pitch, distance, size; /* radians; size: half the scene's diagonal */
    double seconds;                    /* of what moves */
} app;

static void reset_camera(app *a) {
    vec3 lowest, highest;
    mesh_bounds(&a->mesh, &lowest, &highest);
    a->size = 0.5 * v3_length(v3_sub(highest, lowest));
    a->size = a->size > 1e-9 ? a->size : 1;
    if (a->built_in) {
        a->target = v3(0.15, 1.0, -1.0);
        a->yaw = 0.42, a->pitch = 0.30, a->distance = 8.2;
    } else {
        a->target = v3_scale(v3_add(lowest, highest), 0.5);
        a->yaw = 0.6, a->pitch = 0.35, a->distance = 2.3 * a->size;
    }
}

static vec3 eye_of(const app *a) {
    vec3 d = v3(cos(a->pitch) * sin(a->yaw), sin(a->pitch), cos(a->pitch) * cos(a->yaw));
    return v3_mad(a->target, d, a->distance);
}

static int open_scene(app *a) {
    char error[512];
    if (!a->options->obj) {
        a->built_in = 1;
        court_build(&a->mesh);
        a->settings.radius = 1.25f;
    } else {
        if (!mesh_read_obj(a->options->obj, &a->mesh, error, sizeof error))
            return cli_error("%s", error);
        mesh_smooth(&a->mesh, 40);
    }
    reset_camera(a);
    if (!a->built_in)
        a->settings.radius = (float)(0.12 * a->size);
    if (a->options->radius > 0.0f)
        a->settings.radius = a->options->radius;
    a->view = raster_view_of(a->options->size[0], a->options->size[1], 50, 0.002 * a->size);
    a->workers = pool_create(a->options->threads);
    if (!a->workers || !render_create(&a->renderer, &a->mesh, a->options->size[0], a->options->size[1]))
        return cli_error("out of memory");
    return 1;
}

static void close_scene(app *a) {
    render_free(&a->renderer);
    pool_destroy(a->workers);
    mesh_free(&a->mesh);
}

static int next_frame(app *a, double step_seconds) {
    const char *error = NULL;
    a->seconds += step_seconds;
    raster_view_advance(&a->view);
    a->view.world_to_view = raster_look_at(eye_of(a), a->target);
    for (int i = 0; a->built_in && i < COURT_PARTS; ++i) {
        mesh_frame f = court_part(i, a->seconds);
        a->view.part_to_world[i] = raster_of_frame(&f);
    }
    if (a->frame == 0)
        raster_view_advance(&a->view);
    a->settings.cut = a->frame == 0;
    ++a->frame;
    return render_frame(&a->renderer, &a->view, &a->settings, a->show, a->workers, &error) ? 1 : cli_error("%s", error);
}

/* ---- files -------------------------------------------------------------------------------------------------------- */

static int save_picture(const char *path, const uint32_t *pixels, int width, int height) {
    image picture;
    image_error error;
    image_pending pending = {NULL, NULL};
    if (!image_create(&picture, width, height, 3, &error))
        return cli_error("%s", error.text);
    for (size_t i = 0; i < (size_t)width * (size_t)height; ++i)
        for (int k = 0; k < 3; ++k)
            picture.data[3 * i + (size_t)k] = (float)(pixels[i] >> (16 - 8 * k) & 255u) / 255.0f;
    int ok = image_write(path, &picture, NULL, IMAGE_RANGE_UNIT, &pending, &error) && image_commit(&pending, &error);
    image_discard(&pending);
    image_free(&picture);
    return ok ? 1 : cli_error("--screenshot %s", error.text);
}

static int take_screenshot(app *a) {
    int frames = a->options->frames ? a->options->frames : 30;
    for (int i = 0; i < frames; ++i)
        if (!next_frame(a, 1.0 / 30.0))
            return 0;
    return save_picture(a->options->screenshot, a->renderer.picture, a->renderer.width, a->renderer.height);
}

/* ---- benchmark ---------------------------------------------------------------------------------------------------- */

enum { BENCH_RUNS = 4, BENCH_STAGES = 16, BENCH_FRAMES = 1000 };

typedef struct bench_run {
    const char *title;
    int no_half, no_occlusion, rest;
    const char *names[BENCH_STAGES];
    double ms[BENCH_STAGES], total; /* medians */
    int stages;
} bench_run;

static int bench(app *a, bench_run *run, int frames) {
    static double times[BENCH_STAGES + 1][BENCH_FRAMES];
    const renderer *r = &a->renderer;
    a->settings.no_half = run->no_half;
    a->settings.no_occlusion = run->no_occlusion;
    reset_camera(a);
    a->frame = 0;
    for (int i = run->rest ? -90 : -8; i < frames; ++i) { /* some to warm up and fill the history */
        if (!run->rest)
            a->yaw += 0.01;
        if (!next_frame(a, 1.0 / 30.0))
            return 0;
        for (int s = 0; i >= 0 && s < r->stage_count; ++s)
            times[s][i] = r->stages[s].ms;
        if (i >= 0)
            times[BENCH_STAGES][i] = render_total_ms(r);
    }
    run->stages = r->stage_count;
    run->total = cli_median(times[BENCH_STAGES], frames);
    for (int s = 0; s < run->stages; ++s) {
        run->names[s] = r->stages[s].name;
        run->ms[s] = cli_median(times[s], frames);
    }
    return 1;
}

static double bench_ms(const bench_run *run, const char *name) {
    for (int s = 0; s < run->stages; ++s)
        if (strcmp(run->names[s], name) == 0)
            return run->ms[s];
    return 0.0;
}

/* A table in Markdown: the camera circles the scene, or rests while the hoop flies. */
static int benchmark(app *a) {
    bench_run runs[BENCH_RUNS] = {{.title = "half resolution"},
                                  {.title = "full resolution", .no_half = 1},
                                  {.title = "half, camera at rest", .rest = 1},
                                  {.title = "no occlusion", .no_occlusion = 1}};
    int frames = a->options->frames ? a->options->frames : 30;
    frames = frames > BENCH_FRAMES ? BENCH_FRAMES : frames;
    for (int k = 0; k < BENCH_RUNS; ++k)
        if (!bench(a, runs + k, frames))
            return 0;
    printf("%dx%d, %d thread%s, %zu triangles, medians of %d frames, ms:\n\n| stage |", a->renderer.width,
           a->renderer.height, pool_threads(a->workers), pool_threads(a->workers) > 1 ? "s" : "",
           a->mesh.triangle_count, frames);
    for (int k = 0; k < BENCH_RUNS; ++k)
        printf(" %s |", runs[k].title);
    printf("\n|---|--:|--:|--:|--:|\n");
    for (int s = 0; s < runs[0].stages; ++s) { /* which has every stage */
        printf("| %s |", runs[0].names[s]);
        for (int k = 0; k < BENCH_RUNS; ++k)
            if (bench_ms(runs + k, runs[0].names[s]) > 0.0)
                printf(" %.2f |", bench_ms(runs + k, runs[0].names[s]));
            else
                printf(" |");
        printf("\n");
    }
    printf("| **all** |");
    for (int k = 0; k < BENCH_RUNS; ++k)
        printf(" %.1f |", runs[k].total);
    printf("\n| **frames a second** |");
    for (int k = 0; k < BENCH_RUNS; ++k)
        printf(" %.1f |", 1e3 / runs[k].total);
    printf("\n");
    return 1;
}

/* ---- the window --------------------------------------------------------------------------------------------------- */

#if VIEWER_WINDOW

typedef struct window {
    SDL_Window *handle;
    SDL_Renderer *target;
    SDL_Texture *texture;
    image panel; /* times and switches, drawn a few times a second */
    uint32_t *pixels;
    double smooth[16], frame_ms; /* averages over time, as drawn */
    int hide_panel, paused, quit;
} window;

enum { PANEL_WIDTH = 268, PANEL_HEIGHT = 404, PANEL_LINE = 20 };

static void panel_line(image *panel, int line, canvas_face face, color c, const char *left, const char *right) {
    float y = 12.0f + (float)(PANEL_LINE * (line + 1)) - 6.0f;
    canvas_text(panel, 14.0f, y, CANVAS_LEFT, face, 14.0f, c, left);
    canvas_text(panel, PANEL_WIDTH - 14.0f, y, CANVAS_RIGHT, face, 14.0f, c, right);
}

static void draw_panel(const app *a, window *w) {
    static const char *const labels[] = {"1 occlusion",       "2 half resolution", "3 spatial filter",
                                         "4 temporal filter", "5 interreflection", "6 bent normals"};
    const color text = color_hex(0xf2f2f0), soft = color_hex(0x9ba1a8), on = color_hex(0xec9a45);
    char left[64], right[64];
    render_settings settings = a->settings;
    int line = 0;
    canvas_fill(&w->panel, 0, 0, PANEL_WIDTH, PANEL_HEIGHT, color_hex(0x121316));
    snprintf(left, sizeof left, "%.1f frames / s", w->frame_ms > 0.0 ? 1e3 / w->frame_ms : 0.0);
    snprintf(right, sizeof right, "%d thread%s", pool_threads(a->workers), pool_threads(a->workers) > 1 ? "s" : "");
    panel_line(&w->panel, line++, CANVAS_BOLD, text, left, right);
    for (int i = 0; i < a->renderer.stage_count; ++i) {
        snprintf(right, sizeof right, "%.2f ms", w->smooth[i]);
        panel_line(&w->panel, line++, CANVAS_REGULAR, soft, a->renderer.stages[i].name, right);
    }
    ++line;
    snprintf(right, sizeof right, "radius %.3g", (double)settings.radius);
    panel_line(&w->panel, line++, CANVAS_REGULAR, text, render_show_names[a->show], right);
    for (int i = 0; i < 6; ++i) {
        int off = *stage_switch(&settings, i);
        panel_line(&w->panel, line++, CANVAS_REGULAR, off ? soft : on, labels[i], off ? "off" : "on");
    }
}

/* The panel over the picture, so that screenshots show what the window does. */
static void blend_panel(app *a, const window *w) {
    int margin = 12;
    for (int y = 0; y < PANEL_HEIGHT && y + margin < a->renderer.height; ++y)
        for (int x = 0; x < PANEL_WIDTH && x + margin < a->renderer.width; ++x) {
            uint32_t *to = a->renderer.picture + (size_t)(y + margin) * (size_t)a->renderer.width + (x + margin),
                     packed = 0;
            const float *from = w->panel.data + 3 * ((size_t)y * PANEL_WIDTH + (size_t)x);
            for (int k = 0; k < 3; ++k) {
                float under = (float)(*to >> (16 - 8 * k) & 255u);
                packed = packed << 8 | (uint32_t)(0.18f * under + 0.82f * 255.0f * from[k] + 0.5f);
            }
            *to = packed;
        }
}

static void move_target(app *a, double right_px, double down_px) {
    const double *m = a->view.world_to_view.m, scale = a->distance / a->view.focal_px;
    a->target = v3_mad(a->target, v3(m[0], m[1], m[2]), -right_px * scale);
    a->target = v3_mad(a->target, v3(m[4], m[5], m[6]), -down_px * scale);
}

static void press(app *a, window *w, SDL_Keycode key) {
    static const char shows[] = "svbdnam"; /* in the order of render_show */
    const char *show = key > 0 && key < 128 ? strchr(shows, (char)key) : NULL;
    if (key >= SDLK_1 && key <= SDLK_6)
        *stage_switch(&a->settings, key - SDLK_1) ^= 1;
    else if (show)
        a->show = (render_show)(show - shows);
    else if (key == SDLK_TAB)
        a->show = (render_show)((a->show + 1) % RENDER_SHOWS);
    else if (key == SDLK_PLUS || key == SDLK_EQUALS || key == SDLK_KP_PLUS)
        a->settings.radius *= 1.25f;
    else if (key == SDLK_MINUS || key == SDLK_KP_MINUS)
        a->settings.radius *= 0.8f;
    else if (key == SDLK_SPACE)
        w->paused ^= 1;
    else if (key == SDLK_h)
        w->hide_panel ^= 1;
    else if (key == SDLK_r)
        reset_camera(a);
    else if (key == SDLK_p)
        save_picture("viewer.png", a->renderer.picture, a->renderer.width, a->renderer.height);
    else if (key == SDLK_ESCAPE)
        w->quit = 1;
    else if (key == SDLK_t) {
        pool *workers = pool_create(pool_threads(a->workers) % cli_processors() + 1);
        if (workers) {
            pool_destroy(a->workers);
            a->workers = workers;
        }
    }
}

static void handle(app *a, window *w, const SDL_Event *e) {
    if (e->type == SDL_QUIT)
        w->quit = 1;
    else if (e->type == SDL_KEYDOWN)
        press(a, w, e->key.keysym.sym);
    else if (e->type == SDL_MOUSEWHEEL)
        a->distance *= pow(0.9, e->wheel.y);
    else if (e->type == SDL_MOUSEMOTION && (e->motion.state & SDL_BUTTON_LMASK)) {
        a->yaw -= 0.006 * e->motion.xrel;
        a->pitch = fmax(-1.5, fmin(1.5, a->pitch + 0.006 * e->motion.yrel));
    } else if (e->type == SDL_MOUSEMOTION && (e->motion.state & (SDL_BUTTON_RMASK | SDL_BUTTON_MMASK)))
        move_target(a, e->motion.xrel, e->motion.yrel);
}

static int open_window(const app *a, window *w) {
    image_error error;
    memset(w, 0, sizeof *w);
    SDL_SetMainReady();
    if (SDL_Init(SDL_INIT_VIDEO) != 0)
        return cli_error("no window: %s (--screenshot needs none)", SDL_GetError());
    w->handle = SDL_CreateWindow("gtao.h", SDL_WINDOWPOS_UNDEFINED, SDL_WINDOWPOS_UNDEFINED, a->renderer.width,
                                 a->renderer.height, 0);
    w->target = w->handle ? SDL_CreateRenderer(w->handle, -1, 0) : NULL;
    w->texture = w->target ? SDL_CreateTexture(w->target, SDL_PIXELFORMAT_XRGB8888, SDL_TEXTUREACCESS_STREAMING,
                                               a->renderer.width, a->renderer.height)
                           : NULL;
    if (!w->texture)
        return cli_error("no window: %s (--screenshot needs none)", SDL_GetError());
    return image_create(&w->panel, PANEL_WIDTH, PANEL_HEIGHT, 3, &error) ? 1 : cli_error("%s", error.text);
}

static void close_window(window *w) {
    image_free(&w->panel);
    if (w->texture)
        SDL_DestroyTexture(w->texture);
    if (w->target)
        SDL_DestroyRenderer(w->target);
    if (w->handle)
        SDL_DestroyWindow(w->handle);
    SDL_Quit();
}

/* What the window shows, read back from it. */
static int save_window(const app *a, const window *w) {
    size_t pixels = (size_t)a->renderer.width * (size_t)a->renderer.height;
    uint32_t *shown = malloc(pixels * sizeof *shown);
    int ok = shown && SDL_RenderReadPixels(w->target, NULL, SDL_PIXELFORMAT_XRGB8888, shown,
                                           a->renderer.width * (int)sizeof *shown) == 0;
    ok = ok ? save_picture(a->options->screenshot, shown, a->renderer.width, a->renderer.height)
            : cli_error("--screenshot: the window cannot be read");
    free(shown);
    return ok;
}

static int run_window(app *a) {
    window w;
    int ok = open_window(a, &w);
    double last = cli_seconds(), panel_due = 0.0;
    canvas_load_fonts();
    while (ok && !w.quit) {
        SDL_Event event;
        while (SDL_PollEvent(&event))
            handle(a, &w, &event);
        double now = cli_seconds(), elapsed = now - last;
        last = now;
        ok = next_frame(a, w.paused ? 0.0 : a->options->frames ? 1.0 / 30.0 : fmin(elapsed, 0.1));
        w.frame_ms += (1e3 * elapsed - w.frame_ms) * (a->frame < 4 ? 1.0 : 0.1);
        for (int i = 0; i < a->renderer.stage_count; ++i)
            w.smooth[i] += (a->renderer.stages[i].ms - w.smooth[i]) * (a->frame < 4 ? 1.0 : 0.1);
        if (ok && !w.hide_panel) {
            if (now >= panel_due) {
                draw_panel(a, &w);
                panel_due = now + 0.25;
            }
            blend_panel(a, &w);
        }
        SDL_UpdateTexture(w.texture, NULL, a->renderer.picture, a->renderer.width * (int)sizeof *a->renderer.picture);
        SDL_RenderCopy(w.target, w.texture, NULL, NULL);
        if (a->options->frames && a->frame >= a->options->frames) {
            w.quit = 1;
            ok = ok && (!a->options->screenshot || save_window(a, &w));
        }
        SDL_RenderPresent(w.target);
    }
    canvas_free_fonts();
    close_window(&w);
    return ok;
}

#else

static int run_window(app *a) {
    (void)a;
    return cli_error("built without SDL2, so without a window: only --screenshot and --benchmark");
}

#endif

int main(int argc, char **argv) {
    options o;
    app a;
    memset(&o, 0, sizeof o);
    o.size[0] = 1280, o.size[1] = 720;
    o.threads = cli_processors();
    int status = cli_parse(&program, argc, argv, &o, o.given);
    if (status != CLI_GO)
        return status;
    memset(&a, 0, sizeof a);
    a.options = &o;
    a.settings = o.settings;
    a.show = (render_show)o.show;
    int ok = open_scene(&a);
    if (ok)
        ok = o.benchmark ? benchmark(&a) : o.screenshot && !o.window ? take_screenshot(&a) : run_window(&a);
    close_scene(&a);
    return ok ? 0 : 2;
}
