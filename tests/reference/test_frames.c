/* How good a sequence of frames is: against the mean over all phases of the noise, against the height-field truth, and
 * where things move. The scene is spheres before walls, cast here; truth is the library's own horizons with many slices,
 * which test_accuracy checks. */
#include "check.h"

#include "gtao.h"
#include "scene.h"
#include "tests/compute.h"

enum { W = 320, H = 180, N = W * H, SPHERES = 7 };

/* ---- a scene that moves ----------------------------------------------------------------------------------------- */

typedef struct view {
    double x, z;   /* of the eye */
    double object; /* how far the first sphere is along x */
} view;

typedef struct picture {
    float depth[N], normals[3 * N], motion[2 * N];
    int surface[N];
} picture;

static const double focal = 253;
static const double spheres[SPHERES][4] = {{-0.5, 0.5, 4.8, 0.5}, {-1.6, 0.7, 4.2, 0.3},  {1.7, 0.6, 5.3, 0.4},
                                           {1.2, 0.8, 3.4, 0.2},  {-0.9, -0.6, 5.7, 0.3}, {0.6, -0.9, 5.6, 0.35},
                                           {-2.2, -0.4, 5.5, 0.5}};

static void cast(const view *v, const view *before, picture *p) {
    for (int i = 0; i < N; i++) {
        double dx = (i % W + 0.5 - W / 2.0) / focal, dy = (i / W + 0.5 - H / 2.0) / focal, best = 6 - v->z;
        double n[3] = {0, 0, -1}, shift;
        int surface = 0;
        if (dy > 0 && 1 / dy < best) {
            best = 1 / dy, surface = 1;
            n[1] = -1, n[2] = 0;
        }
        if (dx < 0 && (-3 - v->x) / dx < best) {
            best = (-3 - v->x) / dx, surface = 2;
            n[0] = 1, n[1] = n[2] = 0;
        }
        for (int s = 0; s < SPHERES; s++) {
            double cx = spheres[s][0] + (s == 0 ? v->object : 0) - v->x, cy = spheres[s][1], cz = spheres[s][2] - v->z;
            double r = spheres[s][3], a = dx * dx + dy * dy + 1, b = dx * cx + dy * cy + cz;
            double root = b * b - a * (cx * cx + cy * cy + cz * cz - r * r), t;
            if (root < 0)
                continue;
            t = (b - sqrt(root)) / a;
            if (t > 0 && t < best) {
                best = t, surface = 3 + s;
                n[0] = (dx * t - cx) / r, n[1] = (dy * t - cy) / r, n[2] = (t - cz) / r;
            }
        }
        p->depth[i] = (float)best;
        for (int k = 0; k < 3; k++)
            p->normals[3 * i + k] = (float)n[k];
        p->surface[i] = surface;
        shift = v->x - before->x - (surface == 3 ? v->object - before->object : 0);
        p->motion[2 * i] = (float)(focal * (best * dx + shift) / (best + v->z - before->z) + W / 2.0 - 0.5 - i % W);
        p->motion[2 * i + 1] = (float)(focal * best * dy / (best + v->z - before->z) + H / 2.0 - 0.5 - i / W);
        if (v->x == before->x && v->z == before->z && v->object == before->object)
            p->motion[2 * i] = p->motion[2 * i + 1] = 0;
    }
}

/* ---- runs ------------------------------------------------------------------------------------------------------- */

typedef struct runner {
    gtao_frame_desc frame;
    void *state;
    size_t size;
} runner;

static runner runner_make(const gtao_frame_desc *frame) {
    runner r = {*frame, NULL, gtao_frame_state_size(frame)};
    r.state = calloc(1, r.size);
    CHECK(r.state != NULL && r.size > 0, "no state");
    return r;
}

static void runner_frame(runner *r, float *visibility) {
    gtao_output output;
    gtao_result result;
    memset(&output, 0, sizeof output);
    output.visibility = visibility;
    result = gtao_frame(&r->frame, &output, r->state, r->size, NULL);
    CHECK(result == GTAO_OK, "%s", gtao_result_string(result));
}

static void compute(const gtao_desc *desc, float *visibility) {
    gtao_output output;
    memset(&output, 0, sizeof output);
    output.visibility = visibility;
    gtao_result result = compute_output(desc, &output);
    CHECK(result == GTAO_OK, "%s", gtao_result_string(result));
}

static double rmse(const float *a, const float *b, size_t n) {
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        sum += ((double)a[i] - (double)b[i]) * ((double)a[i] - (double)b[i]);
    return sqrt(sum / (double)n);
}

static gtao_frame_desc moving_frame(picture *p) {
    gtao_frame_desc f;
    memset(&f, 0, sizeof f);
    f.desc.width = W, f.desc.height = H;
    f.desc.depth = p->depth, f.desc.normals = p->normals;
    f.desc.camera.fx = (float)focal;
    f.desc.radius = 1.0f;
    f.desc.falloff = 0.25f;
    f.desc.slices = 1, f.desc.steps = 8;
    f.motion = p->motion;
    return f;
}

/* ---- tests ------------------------------------------------------------------------------------------------------ */

/* A camera at rest on a rendered scene: 24 frames are the mean of the 24 phases, and as near to the truth as 96
 * directions of one frame; one frame with the spatial filter, as 16. */
static void still_frames_average_the_noise(void **state) {
    scene s;
    image_error error;
    gtao_frame_desc f;
    runner r, single;
    (void)state;
    CHECK(scene_read("tests/data/study.exr", NULL, &s, &error), "%s", error.text);
    memset(&f, 0, sizeof f);
    scene_describe(&s, &f.desc);
    f.desc.slices = 1, f.desc.steps = 24, f.desc.falloff = 0.25f;
    for (f.half = 0; f.half < 2; f.half++) {
        size_t n = (size_t)f.desc.width * (size_t)f.desc.height;
        float *truth = malloc(n * 4), *many = malloc(n * 4), *v = malloc(n * 4), *mean = calloc(n, 4),
              *one = malloc(n * 4);
        double e_one, e_16, e_24, e_96, gap;
        gtao_desc d = f.desc;
        d.slices = 32, d.every_pixel = 1;
        compute(&d, truth);
        r = runner_make(&f);
        single = runner_make(&f);
        single.frame.cut = 1;
        for (int k = 0; k < 24; k++) {
            single.frame.desc.frame = (uint32_t)k;
            runner_frame(&single, one);
            for (size_t i = 0; i < n; i++)
                mean[i] += one[i] / 24;
            runner_frame(&r, v);
        }
        gap = rmse(v, mean, n);
        e_24 = rmse(v, truth, n);
        single.frame.desc.frame = 0;
        runner_frame(&single, one);
        e_one = rmse(one, truth, n);
        d = f.desc, d.slices = 16;
        compute(&d, many);
        e_16 = rmse(many, truth, n);
        d.slices = 48; /* twice: 96 */
        compute(&d, many);
        d.frame = 3;
        compute(&d, mean);
        for (size_t i = 0; i < n; i++)
            many[i] = 0.5f * (many[i] + mean[i]);
        e_96 = rmse(many, truth, n);
        print_message(
            "half %d: 24 frames against the mean of 24 phases %.4f; against the truth %.4f, 96 directions %.4f; "
            "one frame %.4f, 16 directions %.4f\n",
            f.half, gap, e_24, e_96, e_one, e_16);
        CHECK(gap < 0.005, "half %d: 24 frames differ by %g from the mean of 24 phases", f.half, gap);
        if (!f.half) {
            CHECK(e_24 < 1.5 * e_96, "24 frames err by %g, 96 directions by %g", e_24, e_96);
            CHECK(e_one < 1.8 * e_16, "one filtered frame errs by %g, 16 directions by %g", e_one, e_16);
        }
        free(truth), free(many), free(v), free(mean), free(one);
        free(r.state), free(single.state);
    }
    scene_free(&s);
}

/* Things and cameras that move: the error stays within 1.3 times that of the same view at rest; what comes into sight
 * is what the spatial filter alone makes of it; nothing stays behind where a shadow was. */
static void moving_frames_stay_accurate(void **state) {
    static picture now, still;
    static float v[N], alone[N], truth[24][N];
    static int before[N];
    const char *const names[] = {"object", "camera sideways", "camera around"};
    (void)state;
    for (int mode = 0; mode < 3; mode++)
        for (int half = 0; half < 2; half++) {
            gtao_frame_desc f = moving_frame(&now);
            runner moving, single, rest;
            view last = {0, 0, 0};
            double worst_trail = 0, worst_ratio = 0, hidden = 0, hidden_alone = 0;
            int revealed = 0;
            gtao_desc reference = f.desc;
            reference.slices = 64;
            f.half = half;
            moving = runner_make(&f);
            single = runner_make(&f);
            single.frame.cut = 1;
            for (int k = 0; k < 40; k++) {
                float *t = truth[k % 24];
                view eye = {0, 0, 0};
                if (mode == 0)
                    eye.object = k < 10 ? 0 : 0.05 * (k - 10);
                if (mode == 1)
                    eye.x = 0.02 * k;
                if (mode == 2)
                    eye.x = 0.5 * sin(0.05 * k), eye.z = 0.01 * k;
                cast(&eye, k ? &last : &eye, &now);
                compute(&reference, t);
                runner_frame(&moving, v);
                single.frame.desc.frame = (uint32_t)k;
                runner_frame(&single, alone);
                for (int i = 0; k > 0 && !half && i < N; i++) { /* all four taps on another surface */
                    int x = (int)floor(i % W + (double)now.motion[2 * i]);
                    int y = (int)floor(i / W + (double)now.motion[2 * i + 1]), other = 0;
                    for (int c = 0; c < 4 && x >= 0 && y >= 0 && x + 1 < W && y + 1 < H; c++)
                        other += before[(y + (c >> 1)) * W + x + (c & 1)] != now.surface[i];
                    if (other == 4) {
                        hidden += (double)((v[i] - t[i]) * (v[i] - t[i]));
                        hidden_alone += (double)((alone[i] - t[i]) * (alone[i] - t[i]));
                        revealed++;
                    }
                }
                if (mode == 0 && k >= 20) { /* where the shadow was six frames ago and four frames ago no more */
                    const float *was = truth[(k - 6) % 24], *left = truth[(k - 4) % 24];
                    double sum = 0, shadow = 0;
                    int count = 0;
                    for (int i = 0; i < N; i++)
                        if (t[i] - was[i] > 0.1f && t[i] - left[i] < 0.05f && now.surface[i] < 3) {
                            sum += (double)(v[i] - t[i]);
                            shadow += (double)(t[i] - was[i]);
                            count++;
                        }
                    if (count > 20 && sum / shadow < worst_trail)
                        worst_trail = sum / shadow;
                }
                if (k >= 16 && k % 8 == 0) {
                    double e = rmse(v, t, N), e_rest;
                    still = now;
                    memset(still.motion, 0, sizeof still.motion);
                    rest = runner_make(&f);
                    rest.frame.motion = still.motion;
                    for (int i = 0; i < 24; i++)
                        runner_frame(&rest, alone);
                    e_rest = rmse(alone, t, N);
                    worst_ratio = e / e_rest > worst_ratio ? e / e_rest : worst_ratio;
                    free(rest.state);
                }
                memcpy(before, now.surface, sizeof before);
                last = eye;
            }
            print_message("%s, half %d: error at most %.2f times that at rest, of a shadow 4 to 6 frames later %.2f is "
                          "left, revealed %.4f, alone %.4f\n",
                          names[mode], half, worst_ratio, -worst_trail, revealed ? sqrt(hidden / revealed) : 0.0,
                          revealed ? sqrt(hidden_alone / revealed) : 0.0);
            CHECK(worst_ratio < 1.3, "%s, half %d: error %g times that at rest", names[mode], half, worst_ratio);
            CHECK(worst_trail > (half ? -0.45 : -0.25),
                  "half %d: of a shadow that left four to six frames ago %g is left", half, -worst_trail);
            CHECK(revealed == 0 || hidden <= 1.05 * hidden_alone, "%s: revealed pixels err by %g, alone by %g",
                  names[mode], sqrt(hidden / revealed), sqrt(hidden_alone / revealed));
            free(moving.state), free(single.state);
        }
}

/* The window of the spatial filter is not symmetric; over 200 frames nothing may wander off. */
static void nothing_drifts(void **state) {
    static picture p;
    static float v[N], early[N], truth[N];
    view eye = {0.1, 0, 0};
    (void)state;
    cast(&eye, &eye, &p);
    for (int half = 0; half < 2; half++) {
        gtao_frame_desc f = moving_frame(&p);
        gtao_desc reference = f.desc;
        runner r;
        f.half = half, f.no_skip = 1;
        reference.slices = 64;
        compute(&reference, truth);
        r = runner_make(&f);
        for (int k = 0; k < 200; k++) {
            runner_frame(&r, v);
            if (k == 23)
                memcpy(early, v, sizeof v);
        }
        for (int axis = 0; axis < 2; axis++) { /* least squares: v(x) = truth(x - shift) */
            int step = axis ? W : 1;
            double above = 0, below = 0;
            for (int i = W; i < N - W; i++) {
                double slope = 0.5 * ((double)truth[i + step] - (double)truth[i - step]);
                if (p.surface[i] != p.surface[i - step] || p.surface[i] != p.surface[i + step])
                    continue;
                above += slope * ((double)truth[i] - (double)v[i]);
                below += slope * slope;
            }
            print_message("half %d: shift along %c %.3f pixels\n", half, "xy"[axis], above / below);
            CHECK(fabs(above / below) < (half ? 0.22 : 0.05), "half %d: shifted by %g pixels along %c", half,
                  above / below, "xy"[axis]);
        }
        CHECK(rmse(v, early, N) < 0.005, "half %d: %g between frames 24 and 200", half, rmse(v, early, N));
        free(r.state);
    }
}

/* A plate before a wall: visibility jumps at its edge and stays what it is on either side. */
static void edges_stay_sharp(void **state) {
    static picture p;
    static float v[N], truth[N];
    (void)state;
    for (int i = 0; i < N; i++) {
        int x = i % W, y = i / W, plate = x >= 101 && x < 219 && y >= 41 && y < 139;
        p.depth[i] = plate ? 4.0f : 4.6f;
        p.normals[3 * i] = p.normals[3 * i + 1] = 0, p.normals[3 * i + 2] = -1;
        p.motion[2 * i] = p.motion[2 * i + 1] = 0;
        p.surface[i] = plate;
    }
    for (int half = 0; half < 2; half++) {
        gtao_frame_desc f = moving_frame(&p);
        gtao_desc reference = f.desc;
        runner r;
        double plate_worst = 0, wall = 0, near_wall = 0;
        int count = 0, near_count = 0;
        f.half = half;
        f.desc.steps = reference.steps = 32;
        reference.slices = 64;
        compute(&reference, truth);
        r = runner_make(&f);
        for (int k = 0; k < 24; k++)
            runner_frame(&r, v);
        for (int i = 0; i < N; i++) {
            int x = i % W, y = i / W;
            double e = (double)v[i] - (double)truth[i];
            if (p.surface[i]) {
                plate_worst = fabs(e) > plate_worst ? fabs(e) : plate_worst;
            } else if (y > 60 && y < 120 && x > 60 && x < 101) {
                wall += e * e, count++;
                if (x > 96)
                    near_wall += e * e, near_count++;
            }
        }
        print_message("half %d: plate off by at most %.4f, wall %.4f, of that 4 pixels beside the edge %.4f\n", half,
                      plate_worst, sqrt(wall / count), sqrt(near_wall / near_count));
        CHECK(plate_worst < 0.001, "half %d: the plate is off by %g", half, plate_worst);
        CHECK(sqrt(wall / count) < (half ? 0.015 : 0.005), "half %d: the wall errs by %g", half, sqrt(wall / count));
        CHECK(sqrt(near_wall / near_count) < (half ? 0.03 : 0.012), "half %d: beside the edge the wall errs by %g",
              half, sqrt(near_wall / near_count));
        free(r.state);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(still_frames_average_the_noise),
        cmocka_unit_test(moving_frames_stay_accurate),
        cmocka_unit_test(nothing_drifts),
        cmocka_unit_test(edges_stay_sharp),
    };
    return cmocka_run_group_tests_name("frames", tests, NULL, NULL);
}
