/* The renderer in examples/: meshes, the rasteriser against projecting by hand, and build/viewer as a user meets it,
 * without a display and on a virtual one. */
#include "tool.h"

#include "examples/common/court.h"
#include "examples/common/raster3d.h"

#include <float.h>
#include <signal.h>

#define STB_IMAGE_IMPLEMENTATION
#define STBI_ONLY_PNG
#include <stb/stb_image.h>

enum { WIDTH = 96, HEIGHT = 64, PIXELS = WIDTH * HEIGHT };

static float depth[PIXELS], normals[3 * PIXELS], albedo[3 * PIXELS], motion[3 * PIXELS];
static const raster_buffers buffers = {depth, normals, albedo, motion};

static void draw(const mesh *m, const raster_view *view, int threads) {
    pool *workers = pool_create(threads);
    raster *r = raster_create(m, view->width, view->height);
    assert_non_null(workers);
    assert_non_null(r);
    assert_true(raster_draw(r, view, workers));
    raster_shade(r, &buffers, workers);
    raster_free(r);
    pool_destroy(workers);
}

static double random_in(double lowest, double highest) {
    static uint32_t state = 1;
    state = state * 1664525u + 1013904223u;
    return lowest + (highest - lowest) * (double)(state >> 8) / 16777216.0;
}

static vec3 ray_of(const raster_view *v, int i) {
    return v3((i % WIDTH + 0.5 - v->cx) / v->focal_px, (i / WIDTH + 0.5 - v->cy) / v->focal_px, 1);
}

/* What the identity pose calls view space is y down; these meshes are built in it. */
static raster_view plain_view(void) {
    return raster_view_of(WIDTH, HEIGHT, 60, 0.1);
}

/* ---- the rasteriser ----------------------------------------------------------------------------------------------- */

/* Tilted planes that fill the picture, parts of them behind the eye: depth is that of the plane at every pixel. */
static void planes_are_exact(void **state) {
    (void)state;
    raster_view view = plain_view();
    int drawn = 0;
    for (int k = 0; k < 40; ++k) {
        vec3 n = v3_normalize(v3(random_in(-1, 1), random_in(-1, 1), random_in(-1, 1))), a, b;
        vec3 at = v3(random_in(-1, 1), random_in(-1, 1), random_in(1, 4));
        if (k < 4) /* close under the eye: the near plane cuts through the picture */
            n = v3(k % 2 ? 0.6 : -0.6, k < 2 ? 0.8 : -0.8, 0), at = v3_scale(n, 0.03);
        v3_frame(n, &a, &b);
        mesh m;
        memset(&m, 0, sizeof m);
        mesh_add_material(&m, 0.25f, 0.5f, 0.75f);
        unsigned v[4];
        for (int i = 0; i < 4; ++i)
            v[i] = mesh_add_vertex(&m, &mesh_world,
                                   v3_mad(v3_mad(at, a, i == 1 || i == 2 ? 30 : -30), b, i >= 2 ? 30 : -30));
        mesh_add_quad(&m, v[0], v[1], v[2], v[3]);
        mesh_smooth(&m, 30);
        draw(&m, &view, 2);
        /* The plane of the corners as they are stored. */
        vec3 p[3];
        for (int i = 0; i < 3; ++i)
            p[i] = v3((double)m.positions[3 * i], (double)m.positions[3 * i + 1], (double)m.positions[3 * i + 2]);
        vec3 q = v3_normalize(v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0])));
        for (int i = 0; i < PIXELS; ++i) {
            vec3 r = ray_of(&view, i);
            double slope = v3_dot(q, r), z = v3_dot(q, p[0]) / slope;
            if (!isfinite(depth[i])) { /* beyond the quad, or not in front of the near plane */
                assert_true(!(z >= view.near_z) || v3_length(v3_sub(v3_scale(r, z), at)) > 29.9);
                continue;
            }
            ++drawn;
            assert_true(depth[i] >= (float)view.near_z);
            /* The corners are floats, so the fourth may lie off the plane of the first three by 30 FLT_EPSILON. */
            assert_true(fabs((double)depth[i] - z) <= z * (1e-6 + 2e-6 * z / fabs(slope * z)));
            double facing = slope > 0 ? -1 : 1;
            assert_true(fabs((double)normals[3 * i] - facing * q.x) < 1e-5);
            assert_true(fabs((double)normals[3 * i + 1] - facing * q.y) < 1e-5);
            assert_true(fabs((double)normals[3 * i + 2] - facing * q.z) < 1e-5);
            assert_true(albedo[3 * i] == 0.25f && albedo[3 * i + 2] == 0.75f);
        }
        mesh_free(&m);
    }
    assert_true(drawn > 20 * PIXELS);
}

/* Each pixel of a net of triangles is drawn by exactly one of them. With `snap` the vertices lie on pixel centres, so
 * that edges run through centres and only the rule for ties decides. */
static void check_net(double jitter, int snap) {
    enum { NX = 13, NY = 9 };
    raster_view view = plain_view();
    mesh net;
    memset(&net, 0, sizeof net);
    mesh_add_material(&net, 1, 1, 1);
    view.focal_px = 64; /* a power of two: centres are exact */
    unsigned v[NX * NY];
    for (int i = 0; i < NX * NY; ++i) {
        int x = i % NX, y = i / NX, rim = x == 0 || y == 0 || x == NX - 1 || y == NY - 1;
        double px = -16 + 128.0 * x / (NX - 1), py = -16 + 96.0 * y / (NY - 1), z = 1;
        if (!rim) {
            px += random_in(-jitter, jitter), py += random_in(-jitter, jitter);
            z = snap ? 1 : random_in(0.5, 2);
        }
        if (snap)
            px = floor(px) + 0.5, py = floor(py) + 0.5;
        v[i] = mesh_add_vertex(&net, &mesh_world, v3((px - 48) / 64 * z, (py - 32) / 64 * z, z));
    }
    for (int i = 0; i + NX + 1 < NX * NY; ++i)
        if (i % NX < NX - 1) {
            unsigned a = v[i], b = v[i + 1], c = v[i + NX + 1], d = v[i + NX];
            mesh_add_quad(&net, i % 2 ? a : b, i % 2 ? b : c, i % 2 ? c : d, i % 2 ? d : a);
        }
    int covered[PIXELS] = {0};
    mesh one = net; /* one triangle at a time */
    one.triangle_count = 1;
    for (size_t t = 0; t < net.triangle_count; ++t) {
        one.indices = net.indices + 3 * t;
        one.materials = net.materials + t;
        one.normals = NULL;
        mesh_smooth(&one, 30);
        draw(&one, &view, 1);
        free(one.normals);
        for (int i = 0; i < PIXELS; ++i)
            covered[i] += isfinite(depth[i]) != 0;
    }
    mesh_free(&net);
    for (int i = 0; i < PIXELS; ++i)
        assert_int_equal(covered[i], 1);
}

static void shared_edges_leave_no_gap(void **state) {
    (void)state;
    for (int k = 0; k < 4; ++k) {
        check_net(2.5, 0); /* less than a quarter of the spacing: nothing folds over */
        check_net(2.1, 1);
    }
    check_net(0.0, 1);
}

static int nearest_part(const raster_view *view, const double position[3], int i) {
    vec3 p = v3_scale(ray_of(view, i), (double)depth[i]);
    double best = HUGE_VAL;
    int part = 0;
    for (int k = 0; k < 3; ++k) {
        double d = fabs(v3_length(v3_sub(p, v3(position[k], 0.1 * k, 4))) - 0.8);
        if (d < best)
            best = d, part = k;
    }
    return part;
}

/* Three balls that move and turn on their own under a camera that moves: by hand, back to the ball, to where that was,
 * to the camera as it was, to the screen. */
static void motion_is_that_of_the_surface(void **state) {
    (void)state;
    static const double position[3] = {-1.8, 0, 1.8};
    raster_view view = plain_view();
    mesh m;
    memset(&m, 0, sizeof m);
    mesh_add_material(&m, 1, 1, 1);
    for (int k = 0; k < 3; ++k) {
        m.part = (unsigned char)k;
        mesh_add_ellipsoid(&m, mesh_world, v3(0, 0, 0), 0.8, 0.8, 0.8, 40);
        mesh_frame now = mesh_moved(mesh_world, position[k], 0.1 * k, 4);
        mesh_frame then =
            mesh_turned_y(mesh_turned_x(mesh_moved(mesh_world, position[k] - 0.1 * k, 0.3, 4.2 + 0.1 * k), 20 * k), 7);
        view.part_to_world[k] = raster_of_frame(&now);
        view.part_to_world_before[k] = raster_of_frame(&then);
    }
    mesh_smooth(&m, 60);
    mesh_frame camera = mesh_turned_y(mesh_moved(mesh_world, 0.05, -0.02, 0.1), 3);
    view.world_to_view_before = raster_of_frame(&camera);
    draw(&m, &view, 2);
    int drawn = 0;
    for (int i = 0; i < PIXELS; ++i) {
        vec3 r = ray_of(&view, i), p;
        double scale = 1;
        if (isfinite(depth[i])) {
            int part = nearest_part(&view, position, i);
            vec3 on_ball = v3_sub(v3_scale(r, (double)depth[i]), v3(position[part], 0.1 * part, 4));
            mesh_frame then = mesh_turned_y(
                mesh_turned_x(mesh_moved(mesh_world, position[part] - 0.1 * part, 0.3, 4.2 + 0.1 * part), 20 * part),
                7);
            p = mesh_apply(&camera, mesh_apply(&then, on_ball));
            ++drawn;
            assert_true(fabs((double)motion[3 * i + 2] - (p.z - (double)depth[i])) < 1e-5);
        } else { /* infinitely far: the camera's rotation alone */
            p = v3_sub(mesh_apply(&camera, r), camera.o);
        }
        double x = view.cx + view.focal_px * scale * p.x / p.z, y = view.cy + view.focal_px * p.y / p.z;
        assert_true(fabs((double)motion[3 * i] - (x - (i % WIDTH + 0.5))) < 1e-4);
        assert_true(fabs((double)motion[3 * i + 1] - (y - (i / WIDTH + 0.5))) < 1e-4);
    }
    assert_true(drawn > PIXELS / 8);

    raster_view_advance(&view); /* at rest: exactly nothing */
    draw(&m, &view, 2);
    for (int i = 0; i < 3 * PIXELS; ++i)
        assert_true(fabsf(motion[i]) <= 0.0f);
    mesh_free(&m);
}

/* A surface that the camera turned round to was behind it. */
static void motion_from_behind_is_infinite(void **state) {
    (void)state;
    raster_view view = plain_view();
    mesh m;
    memset(&m, 0, sizeof m);
    mesh_add_material(&m, 1, 1, 1);
    mesh_add_block(&m, mesh_world, 0, 0, 5, 100, 100, 0.1);
    mesh_smooth(&m, 30);
    mesh_frame turned = mesh_turned_y(mesh_world, 180);
    view.world_to_view_before = raster_of_frame(&turned);
    draw(&m, &view, 1);
    for (int i = 0; i < PIXELS; ++i)
        assert_true(isinf(motion[3 * i]) && isinf(motion[3 * i + 1]));
    mesh_free(&m);
}

/* Normals of a ball, whichever way its triangles are wound: unit, outwards, those of the sphere. */
static void normals_are_smooth(void **state) {
    (void)state;
    raster_view view = plain_view();
    for (int wound = 0; wound < 2; ++wound) {
        mesh m;
        memset(&m, 0, sizeof m);
        mesh_add_material(&m, 1, 1, 1);
        mesh_add_ellipsoid(&m, mesh_world, v3(0, 0, 3), 1, 1, 1, 96);
        for (size_t t = 0; t < m.triangle_count; ++t)
            if (wound && t % 2) {
                unsigned swap = m.indices[3 * t];
                m.indices[3 * t] = m.indices[3 * t + 1], m.indices[3 * t + 1] = swap;
            }
        mesh_smooth(&m, 40);
        draw(&m, &view, 1);
        int drawn = 0;
        for (int i = 0; i < PIXELS; ++i) {
            if (!isfinite(depth[i]))
                continue;
            vec3 n = v3((double)normals[3 * i], (double)normals[3 * i + 1], (double)normals[3 * i + 2]);
            vec3 outwards = v3_normalize(v3_sub(v3_scale(ray_of(&view, i), (double)depth[i]), v3(0, 0, 3)));
            assert_true(fabs(v3_length(n) - 1) < 1e-6);
            assert_true(v3_dot(n, outwards) > 0.999);
            ++drawn;
        }
        assert_true(drawn > 500);
        mesh_free(&m);
    }
}

static void threads_draw_the_same(void **state) {
    (void)state;
    static float first[4][3 * PIXELS];
    mesh m;
    court_build(&m);
    raster_view view = raster_view_of(WIDTH, HEIGHT, 50, 0.02);
    view.world_to_view = raster_look_at(v3(3, 3, 6), v3(0, 1, 0));
    view.world_to_view_before = raster_look_at(v3(3, 3, 6.1), v3(0, 1, 0));
    for (int k = 0; k < COURT_PARTS; ++k) {
        mesh_frame now = court_part(k, 1.0), before = court_part(k, 0.9);
        view.part_to_world[k] = raster_of_frame(&now);
        view.part_to_world_before[k] = raster_of_frame(&before);
    }
    for (int threads = 1; threads <= 4; ++threads) {
        draw(&m, &view, threads);
        if (threads == 1) {
            memcpy(first[0], depth, sizeof depth);
            memcpy(first[1], normals, sizeof normals);
            memcpy(first[2], albedo, sizeof albedo);
            memcpy(first[3], motion, sizeof motion);
        }
        assert_memory_equal(first[0], depth, sizeof depth);
        assert_memory_equal(first[1], normals, sizeof normals);
        assert_memory_equal(first[2], albedo, sizeof albedo);
        assert_memory_equal(first[3], motion, sizeof motion);
    }
    mesh_free(&m);
}

/* ---- files -------------------------------------------------------------------------------------------------------- */

static int setup(void **state) {
    (void)state;
    return make_directory("viewer");
}

static int teardown(void **state) {
    (void)state;
    static const char *const names[] = {"a.obj", "a.mtl", "a.png"};
    for (size_t i = 0; i < sizeof names / sizeof *names; ++i)
        remove_file(names[i]);
    return remove_directory();
}

static void obj_is_read(void **state) {
    (void)state;
    char error[512];
    mesh m;
    write_text("a.mtl", "newmtl red\nKd 1 0.25 0\nnewmtl blue\n  Kd 0 0 2\n");
    write_text("a.obj", "# a quad, then a triangle by negative indices\nmtllib a.mtl\no thing\n"
                        "v 0 0 0\nv 1 0 0\nv 1 1 0 1.0\nv 0 1 0\nvt 0 0\nvn 0 0 -2\nusemtl blue\n"
                        "f 1/1/1 2/1/1 3//1 4\nusemtl red\nf -4 -3 -2\r\nusemtl nothing\nf 1 2 4\n");
    assert_true(mesh_read_obj(in_directory("a.obj"), &m, error, sizeof error));
    assert_int_equal(m.vertex_count, 4);
    assert_int_equal(m.triangle_count, 4);
    static const unsigned indices[] = {0, 1, 2, 0, 2, 3, 0, 1, 2, 0, 1, 3};
    for (int i = 0; i < 12; ++i)
        assert_int_equal(m.indices[i], indices[i]);
    assert_true(m.albedo[m.materials[0]][2] == 1.0f && m.albedo[m.materials[2]][1] == 0.25f);
    assert_int_equal(m.materials[3], 0);
    mesh_smooth(&m, 40);
    assert_true(m.normals[2] == -2.0f); /* the file's, as it is; the rasteriser makes it unit */
    assert_true(fabsf(m.normals[9 + 8]) == 1.0f);
    mesh_free(&m);
}

static void bad_obj_is_refused(void **state) {
    (void)state;
    static const char *const bad[][2] = {
        {"", "no face in it"},
        {"v 0 0 0\nf 1 2 3\n", ":2: a face names a vertex that does not exist"},
        {"v 0 0 0\nv 1 0 nan\n", ":2: not a vertex of three finite numbers"},
        {"v 0 0\n", ":1: not a vertex of three finite numbers"},
        {"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", ":4: a face of fewer than three corners"},
        {"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1//1 2 3\n", ":4: a face names a normal that does not exist"},
        {"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3x\n", ":4: not a face"},
        {"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", ":4: a face names a vertex that does not exist"},
        {"vn 1 2 x\n", ":1: not a normal of three finite numbers"},
    };
    char error[512];
    mesh m;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
        write_text("a.obj", bad[i][0]);
        assert_false(mesh_read_obj(in_directory("a.obj"), &m, error, sizeof error));
        if (!strstr(error, bad[i][1]) || !strstr(error, "a.obj"))
            fail_msg("%s: expected '%s'", error, bad[i][1]);
    }
    assert_false(mesh_read_obj(in_directory("none.obj"), &m, error, sizeof error));
    assert_non_null(strstr(error, "none.obj: cannot be read"));
}

/* ---- the program -------------------------------------------------------------------------------------------------- */

/* The picture a.png has the size asked for and is not blank: its brightness varies, and it has many colours. */
static void check_picture(int width, int height, double least_deviation) {
    int w, h, channels;
    unsigned char *p = stbi_load(in_directory("a.png"), &w, &h, &channels, 3);
    if (!p)
        fail_msg("a.png: %s; %s", stbi_failure_reason(), message);
    assert_int_equal(w, width);
    assert_int_equal(h, height);
    double sum = 0, squares = 0;
    for (int i = 0; i < 3 * w * h; ++i) {
        sum += p[i];
        squares += (double)p[i] * p[i];
    }
    double mean = sum / (3.0 * w * h), deviation = sqrt(squares / (3.0 * w * h) - mean * mean);
    stbi_image_free(p);
    unlink(in_directory("a.png"));
    if (!(deviation >= least_deviation && mean > 5 && mean < 250))
        fail_msg("mean %g, deviation %g", mean, deviation);
}

static void screenshot_needs_no_display(void **state) {
    (void)state;
    static const char *const views[] = {"shaded", "visibility", "bent", "depth", "normals", "albedo", "motion"};
    unsetenv("DISPLAY");
    unsetenv("WAYLAND_DISPLAY");
    for (int i = 0; i < 7; ++i) {
        char arguments[256];
        snprintf(arguments, sizeof arguments, "--screenshot @/a.png --frames 2 --size 200x121 --view %s", views[i]);
        int status = run(arguments);
        if (status)
            fail_msg("%s: status %d, %s", views[i], status, message);
        assert_string_equal(message, "");
        check_picture(200, 121, strcmp(views[i], "motion") == 0 ? 2 : 10); /* little moves */
    }
    assert_int_equal(run("--screenshot @/a.png --frames 1 --size 160x90 --without occlusion,bounce --threads 3"), 0);
    check_picture(160, 90, 10);
}

static void obj_is_shown(void **state) {
    (void)state;
    write_text("a.obj",
               "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv 0 1.5 0\nf 1 2 3 4\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n");
    assert_int_equal(run("@/a.obj --screenshot @/a.png --frames 1 --size 160x90 --view normals"), 0);
    check_picture(160, 90, 10);
}

static void benchmark_prints_a_table(void **state) {
    (void)state;
    assert_int_equal(run("--benchmark --frames 2 --size 64x64 --threads 2"), 0);
    assert_non_null(strstr(printed, "64x64, 2 threads"));
    assert_non_null(strstr(printed, "no occlusion"));
    assert_non_null(strstr(printed, "frames a second"));
}

/* All of the sequence, small: each stage does its part, before and after the cut. */
static void sequence_is_denoised(void **state) {
    (void)state;
    enum { NOISY, SPATIAL, TEMPORAL, VARIANTS = 4, FRAMES = 168, REST = 36, CUT = 132 };
    double rmse[VARIANTS][FRAMES], flicker[VARIANTS][FRAMES], mean;
    tool = "sequence";
    run_well("--size 64x64 @/sequence");
    FILE *file = fopen(in_directory("sequence/error.txt"), "r");
    assert_non_null(file);
    for (int i = 0, frame; i < FRAMES; ++i) {
        assert_int_equal(fscanf(file, "%d", &frame), 1);
        assert_int_equal(frame, i);
        for (int k = 0; k < VARIANTS; ++k)
            assert_int_equal(fscanf(file, "%lf %lf %lf", &rmse[k][i], &mean, &flicker[k][i]), 3);
    }
    fclose(file);
    for (int k = 0; k < 2; ++k) {
        int last = (k ? FRAMES : REST) - 1;
        assert_true(rmse[SPATIAL][last] < 0.8 * rmse[NOISY][last]);
        assert_true(rmse[TEMPORAL][last] < rmse[SPATIAL][last]);
        assert_true(flicker[TEMPORAL][last] < 0.1 * flicker[SPATIAL][last]);
    }
    assert_true(rmse[TEMPORAL][CUT] < 1.2 * rmse[SPATIAL][CUT]); /* nothing of the view before */
    char command[512];
    snprintf(command, sizeof command, "cd %s && test -s strip.png && test -s frame055.png && rm *.png error.txt",
             in_directory("sequence"));
    assert_int_equal(system(command), 0);
    assert_int_equal(rmdir(in_directory("sequence")), 0);
}

static void bad_options_are_named(void **state) {
    (void)state;
    static const char *const of_sequence[][2] = {
        {"--size 1x1", "--size 1x1"},
        {"--threads 0", "--threads 0"},
        {"--nonsense", "--nonsense"},
        {"@/none/none", "none/none"},
    };
    static const char *const bad[][2] = {
        {"--nonsense", "--nonsense"},
        {"--size 20", "--size 20"},
        {"--size 8x8", "--size 8x8"},
        {"--size 200x", "--size 200x"},
        {"--view nothing", "--view nothing"},
        {"--without occlusion,nothing", "--without nothing"},
        {"--frames 0", "--frames 0"},
        {"--frames", "--frames: needs a value"},
        {"--threads x", "--threads x"},
        {"--radius -1", "--radius -1"},
        {"--radius nan", "--radius nan"},
        {"--screenshot @/a.jpg", "a.jpg"},
        {"--screenshot @/none/a.png --frames 1 --size 16x16", "none/a.png"},
        {"@/none.obj --screenshot @/a.png", "none.obj: cannot be read"},
        {"a.obj b.obj", "b.obj"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i)
        run_badly(bad[i][0], bad[i][1]);
    tool = "sequence";
    for (size_t i = 0; i < sizeof of_sequence / sizeof *of_sequence; ++i)
        run_badly(of_sequence[i][0], of_sequence[i][1]);
}

static void no_display_is_said(void **state) {
    (void)state;
    unsetenv("DISPLAY");
    unsetenv("WAYLAND_DISPLAY");
    setenv("SDL_VIDEODRIVER", "x11", 1);
    assert_int_equal(run("--frames 1 --size 64x64"), 2);
    unsetenv("SDL_VIDEODRIVER");
    assert_non_null(strstr(message, "window"));
}

/* The window on a virtual display, read back from there: it also has the panel, whose text is bright. */
static void window_shows_the_scene(void **state) {
    (void)state;
    if (system("nm -D build/viewer | grep -q SDL_Init") != 0 || system("command -v Xvfb >/dev/null") != 0) {
        print_message("# note: no SDL2 or no Xvfb: the window was not tested\n");
        skip();
    }
    int ends[2];
    assert_int_equal(pipe(ends), 0);
    pid_t server = fork();
    assert_true(server >= 0);
    if (server == 0) {
        char number[16], program[] = "Xvfb", option[] = "-displayfd", screen[] = "-screen", zero[] = "0",
                         mode[] = "800x600x24", quiet[] = "-nolisten", tcp[] = "tcp";
        char *argv[] = {program, option, number, screen, zero, mode, quiet, tcp, NULL};
        snprintf(number, sizeof number, "%d", ends[1]);
        close(ends[0]);
        if (!freopen("/dev/null", "w", stderr))
            _exit(127);
        execvp(argv[0], argv);
        _exit(127);
    }
    close(ends[1]);
    char display[32] = ":";
    ssize_t got = read(ends[0], display + 1, sizeof display - 2); /* when it accepts connections */
    close(ends[0]);
    int status = -1;
    if (got > 0) {
        display[1 + strcspn(display + 1, "\r\n")] = 0;
        setenv("DISPLAY", display, 1);
        setenv("ASAN_OPTIONS", "detect_leaks=0", 1); /* what lies under SDL leaks, and has races of its own */
        setenv("TSAN_OPTIONS", "ignore_noninstrumented_modules=1", 1);
        status = run("--window --screenshot @/a.png --frames 4 --size 640x480");
        unsetenv("DISPLAY");
        unsetenv("ASAN_OPTIONS");
        unsetenv("TSAN_OPTIONS");
    }
    kill(server, SIGTERM);
    waitpid(server, NULL, 0);
    assert_true(got > 0);
    if (status)
        fail_msg("status %d, %s", status, message);
    check_picture(640, 480, 20);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(planes_are_exact),
        cmocka_unit_test(shared_edges_leave_no_gap),
        cmocka_unit_test(motion_is_that_of_the_surface),
        cmocka_unit_test(motion_from_behind_is_infinite),
        cmocka_unit_test(normals_are_smooth),
        cmocka_unit_test(threads_draw_the_same),
        cmocka_unit_test_setup_teardown(obj_is_read, setup, teardown),
        cmocka_unit_test_setup_teardown(bad_obj_is_refused, setup, teardown),
        cmocka_unit_test_setup_teardown(screenshot_needs_no_display, setup, teardown),
        cmocka_unit_test_setup_teardown(obj_is_shown, setup, teardown),
        cmocka_unit_test_setup_teardown(benchmark_prints_a_table, setup, teardown),
        cmocka_unit_test_setup_teardown(sequence_is_denoised, setup, teardown),
        cmocka_unit_test_setup_teardown(bad_options_are_named, setup, teardown),
        cmocka_unit_test_setup_teardown(no_display_is_said, setup, teardown),
        cmocka_unit_test_setup_teardown(window_shows_the_scene, setup, teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
