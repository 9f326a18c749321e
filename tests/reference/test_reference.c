/* The references agree with each other, with closed forms, and with the formulas the library is built on, so that the
 * other suites may trust them. Nothing of gtao.h is used here. */
#include "tests/reference/check.h"
#include "tests/reference/reference.h"

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double norm(const double a[3]) {
    return sqrt(dot(a, a));
}

/* Uniform in [0, 1), from a fixed seed. */
static double uniform(uint32_t *state) {
    *state = *state * 1664525u + 1013904223u;
    return (*state >> 8) / 16777216.0;
}

static double between(uint32_t *state, double low, double high) {
    return low + (high - low) * uniform(state);
}

/* ---- integrals ---- */

static void quadrature_of_open_slices(void **state) {
    (void)state;
    for (int i = -90; i <= 90; i += 5) {
        const long double n = i * (long double)REF_PI / 180.0L, half = 0.5L * (long double)REF_PI;
        CHECK_NEAR(ref_arc(n - half, n) + ref_arc(n + half, n), cosl(n) + n * sinl(n), 1e-14, "n = %d degrees", i);
        CHECK_NEAR(ref_arc_uniform(n), 1.0L - cosl(n), 1e-14, "uniform, h = %d degrees", i);
    }
}

/* [J19]: line 28 of Algorithm 1 and Eq. 20-21 are the integrals they claim to be. */
static void printed_formulas_are_the_integrals(void **state) {
    (void)state;
    for (int i = -90; i <= 90; i += 6) {
        for (int j = 0; j <= 180; j += 9) {
            for (int k = 0; k <= 180; k += 9) {
                const long double degree = (long double)REF_PI / 180.0L;
                const long double n = i * degree, h0 = fmaxl(n - 90 * degree, -j * degree);
                const long double h1 = fminl(n + 90 * degree, k * degree);
                const long double arc = (cosl(n) + 2.0L * h1 * sinl(n) - cosl(2.0L * h1 - n)) / 4.0L;
                CHECK_NEAR(arc, ref_arc(h1, n), 1e-14, "arc");
                if (h0 > 0.0L || h1 < 0.0L)
                    continue;
                const long double t0 = (6 * sinl(h0 - n) - sinl(3 * h0 - n) + 6 * sinl(h1 - n) - sinl(3 * h1 - n) +
                                        16 * sinl(n) - 3 * (sinl(h0 + n) + sinl(h1 + n))) /
                                       12.0L;
                const long double t1 =
                    (-cosl(3 * h0 - n) - cosl(3 * h1 - n) + 8 * cosl(n) - 3 * (cosl(h0 + n) + cosl(h1 + n))) / 12.0L;
                long double t[2];
                ref_arc_bent(h0, h1, n, t);
                CHECK_NEAR(t0, t[0], 1e-14, "t0 at n = %d, h0 = -%d, h1 = %d", i, j, k);
                CHECK_NEAR(t1, t[1], 1e-14, "t1 at n = %d, h0 = -%d, h1 = %d", i, j, k);
            }
        }
    }
}

/* ---- the height formulation (docs/theory.md), on random cameras, points and lines ---- */

typedef struct line {
    int orthographic;
    double fx, fy; /* or world units per pixel */
    double u, v;   /* of the pixel, from the principal point */
    double dx, dy;
} line;

static line random_line(uint32_t *seed, int orthographic) {
    line l;
    const double angle = between(seed, 0.0, 2.0 * REF_PI);
    l.orthographic = orthographic;
    l.fx = orthographic ? between(seed, 0.1, 2.0) : between(seed, 200.0, 900.0);
    l.fy = orthographic ? between(seed, 0.1, 2.0) : between(seed, 200.0, 900.0);
    l.u = between(seed, -500.0, 500.0);
    l.v = between(seed, -500.0, 500.0);
    l.dx = cos(angle);
    l.dy = sin(angle);
    return l;
}

/* The point t pixels along the line at height w: 1/z, or -z. */
static void point_at(const line *l, double t, double w, double position[3]) {
    const double z = l->orthographic ? -w : 1.0 / w;
    position[0] = (l->u + t * l->dx) * (l->orthographic ? l->fx : z / l->fx);
    position[1] = (l->v + t * l->dy) * (l->orthographic ? l->fy : z / l->fy);
    position[2] = z;
}

static void slopes_give_directions_and_distances(void **state) {
    (void)state;
    uint32_t seed = 1;
    for (int trial = 0; trial < 20000; trial++) {
        const line l = random_line(&seed, trial & 1);
        const double w0 = between(&seed, 0.1, 2.0), wt = between(&seed, 0.1, 2.0), t = between(&seed, 0.5, 200.0);
        double p0[3], pt[3];
        point_at(&l, 0.0, w0, p0);
        point_at(&l, t, wt, pt);
        const double delta[3] = {pt[0] - p0[0], pt[1] - p0[1], pt[2] - p0[2]};
        const double view[3] = {l.orthographic ? 0.0 : -p0[0] / norm(p0), l.orthographic ? 0.0 : -p0[1] / norm(p0),
                                l.orthographic ? -1.0 : -p0[2] / norm(p0)};

        const double s = (wt - w0) / t;
        const double r0[3] = {l.orthographic ? 0.0 : l.u / l.fx, l.orthographic ? 0.0 : l.v / l.fy, 1.0};
        const double b[3] = {l.orthographic ? l.dx * l.fx : l.dx / l.fx, l.orthographic ? l.dy * l.fy : l.dy / l.fy,
                             0.0};
        const double wf = l.orthographic ? 1.0 : w0;
        const double direction[3] = {wf * b[0] - s * r0[0], wf * b[1] - s * r0[1], wf * b[2] - s * r0[2]};
        const double dv = (s * dot(r0, r0) - wf * dot(b, r0)) / norm(r0);
        const double dd = wf * wf * dot(b, b) - 2.0 * s * wf * dot(b, r0) + s * s * dot(r0, r0);
        const double scale = l.orthographic ? t : t / (w0 * wt);

        for (int i = 0; i < 3; i++)
            CHECK_NEAR(direction[i] * scale, delta[i], 1e-9 * (1.0 + norm(delta)), "direction, trial %d", trial);
        CHECK_NEAR(dv / sqrt(dd), dot(delta, view) / norm(delta), 1e-9, "cosine, trial %d", trial);
        CHECK_NEAR(scale * sqrt(dd) / norm(delta), 1.0, 1e-9, "distance, trial %d", trial);
    }
}

static void tangent_planes_are_affine_in_height(void **state) {
    (void)state;
    uint32_t seed = 2;
    for (int trial = 0; trial < 20000; trial++) {
        const line l = random_line(&seed, trial & 1);
        const double w0 = between(&seed, 0.1, 2.0), t = between(&seed, -3.0, 3.0);
        double normal[3] = {between(&seed, -0.7, 0.7), between(&seed, -0.7, 0.7), -1.0}, p0[3], pt[3];
        point_at(&l, 0.0, w0, p0);
        double gx, gy;
        if (l.orthographic) {
            gx = normal[0] * l.fx / normal[2];
            gy = normal[1] * l.fy / normal[2];
        } else {
            const double nr = normal[0] * l.u / l.fx + normal[1] * l.v / l.fy + normal[2];
            if (nr > -0.1)
                continue;
            gx = w0 / nr * normal[0] / l.fx;
            gy = w0 / nr * normal[1] / l.fy;
        }
        const double wt = w0 + t * (gx * l.dx + gy * l.dy);
        point_at(&l, t, wt, pt);
        CHECK_NEAR(dot(normal, pt) - dot(normal, p0), 0.0, 1e-9 * (norm(p0) + norm(pt)), "trial %d", trial);
    }
}

/* d(azimuth around v) / d(screen angle), measured, is proportional to 1 / |b - (b.v) v|^2. */
static void screen_angle_jacobian(void **state) {
    (void)state;
    uint32_t seed = 3;
    for (int trial = 0; trial < 200; trial++) {
        const line l = random_line(&seed, trial & 1);
        const double r0[3] = {l.orthographic ? 0.0 : l.u / l.fx, l.orthographic ? 0.0 : l.v / l.fy, 1.0};
        const double v[3] = {-r0[0] / norm(r0), -r0[1] / norm(r0), -r0[2] / norm(r0)};
        /* Two axes perpendicular to v to measure azimuths with. */
        const double e_size = hypot(v[0], v[2]), e[3] = {-v[2] / e_size, 0.0, v[0] / e_size};
        const double f[3] = {v[1] * e[2] - v[2] * e[1], v[2] * e[0] - v[0] * e[2], v[0] * e[1] - v[1] * e[0]};
        double constant = 0.0;
        for (int k = 0; k < 32; k++) {
            const double phi = REF_PI * k / 32.0, step = 1e-5;
            double azimuth[2], perpendicular = 0.0;
            for (int i = 0; i < 3; i++) {
                const double at = phi + (i - 1) * step;
                const double sx = l.orthographic ? l.fx : 1.0 / l.fx, sy = l.orthographic ? l.fy : 1.0 / l.fy;
                const double b[3] = {cos(at) * sx, sin(at) * sy, 0.0}, bv = dot(b, v);
                const double o[3] = {b[0] - bv * v[0], b[1] - bv * v[1], b[2] - bv * v[2]};
                if (i == 1)
                    perpendicular = dot(o, o);
                else
                    azimuth[i / 2] = atan2(dot(o, f), dot(o, e));
            }
            const double rate = fabs(remainder(azimuth[1] - azimuth[0], 2.0 * REF_PI)) / (2.0 * step) * perpendicular;
            if (k == 0)
                constant = rate;
            CHECK_NEAR(rate / constant, 1.0, 1e-5, "trial %d, slice %d", trial, k);
        }
    }
}

/* ---- the brute force on analytic height fields ---- */

static double degrees_between(const double a[3], const double b[3]) {
    const double c = dot(a, b) / (norm(a) * norm(b));
    return acos(fmax(-1.0, fmin(1.0, c))) * 180.0 / REF_PI;
}

static void normal_of(const ref_image *image, int x, int y, double normal[3]) {
    for (int i = 0; i < 3; i++)
        normal[i] = (double)image->normals[3 * (y * image->width + x) + i];
}

static void open_planes(void **state) {
    (void)state;
    static const double fovs[] = {0.0, 30.0, 90.0, 130.0};
    for (int f = 0; f < 4; f++) {
        for (int tilt = 0; tilt <= 75; tilt += 25) {
            ref_image image = f ? ref_image_perspective(41, 31, fovs[f]) : ref_image_orthographic(41, 31, 0.1);
            const double a = tilt * REF_PI / 180.0;
            const ref_shape plane = {REF_PLANE, {0.0, 0.0, 100.0}, {0.6 * sin(a), 0.8 * sin(a), -cos(a)}, 0.0, 0.0};
            const ref_settings settings = {1e9, 0.0, 64, NULL, 0.5, REF_BORDER_OPEN, 0};
            ref_render(&image, NULL, &plane, 1);
            for (int y = 2; y < image.height; y += 9) {
                for (int x = 2; x < image.width; x += 9) {
                    if (!(isfinite(image.z[y * image.width + x])))
                        continue;
                    double bent[3], normal[3];
                    normal_of(&image, x, y, normal);
                    CHECK_NEAR(ref_heightfield(&image, &settings, x, y, bent), 1.0, 2e-3,
                               "tilt %d, fov %g, pixel %d %d", tilt, fovs[f], x, y);
                    CHECK(degrees_between(bent, normal) < 0.3, "bent normal off by %g degrees: tilt %d, fov %g",
                          degrees_between(bent, normal), tilt, fovs[f]);
                }
            }
            ref_image_free(&image);
        }
    }
}

/* Bottom of a V-groove: cos(beta); apex of a cone: cos(beta)^2. */
static void groove_and_pit(void **state) {
    (void)state;
    for (int beta = 10; beta <= 80; beta += 10) {
        const double b = beta * REF_PI / 180.0;
        const ref_shape groove[2] = {{REF_PLANE, {2.05, 0.0, 9.0}, {-sin(b), 0.0, -cos(b)}, 0.0, 0.0},
                                     {REF_PLANE, {2.05, 0.0, 9.0}, {sin(b), 0.0, -cos(b)}, 0.0, 0.0}};
        const ref_shape pit = {REF_CONE, {2.05, 2.05, 9.0}, {0.0, 0.0, -1.0}, tan(b), 0.0};
        const ref_settings settings = {1e9, 0.0, 128, NULL, 1.0, REF_BORDER_OPEN, 0};
        ref_image image = ref_image_orthographic(41, 41, 0.1);
        const double up[3] = {0.0, 0.0, -1.0};
        const int at = 20 * image.width + 20;
        double bent[3];

        ref_render(&image, NULL, groove, 2);
        for (int i = 0; i < 3; i++)
            image.normals[3 * at + i] = (float)up[i];
        CHECK_NEAR(ref_heightfield(&image, &settings, 20, 20, bent), cos(b), 1e-3, "groove, %d degrees", beta);
        CHECK(degrees_between(bent, up) < 0.01, "groove, %d degrees: bent normal", beta);

        /* Steep cones curve too much for interpolation next to the apex; see surface_at. */
        if (beta <= 60) {
            ref_render(&image, NULL, &pit, 1);
            image.z[at] = 9.0f;
            for (int i = 0; i < 3; i++)
                image.normals[3 * at + i] = (float)up[i];
            CHECK_NEAR(ref_heightfield(&image, &settings, 20, 20, bent), cos(b) * cos(b), 0.05, "pit, %d degrees",
                       beta);
        }
        ref_image_free(&image);
    }
}

/* Next to a long wall of elevation beta: (1 + cos(beta)) / 2, and the bent normal of the visible wedge. */
static void wall(void **state) {
    (void)state;
    enum { SIZE = 801 };
    ref_image image = ref_image_orthographic(SIZE, SIZE, 1.0);
    for (int distance = 10; distance <= 20; distance += 10) {
        for (int beta = 20; beta <= 80; beta += 20) {
            const double b = beta * REF_PI / 180.0;
            const int x0 = SIZE / 2;
            for (int y = 0; y < SIZE; y++) {
                for (int x = 0; x < SIZE; x++) {
                    const int at = y * SIZE + x;
                    image.z[at] = (float)(x < x0 + distance ? 1000.0 : 1000.0 - distance * tan(b));
                    image.normals[3 * at + 2] = -1.0f;
                }
            }
            const ref_settings settings = {1e9, 0.0, 128, NULL, 0.5, REF_BORDER_OPEN, 0};
            double bent[3], expected[3] = {0.0, 0.0, 0.0};
            CHECK_NEAR(ref_heightfield(&image, &settings, x0, SIZE / 2, bent), 0.5 * (1.0 + cos(b)), 4e-3,
                       "distance %d, beta %d", distance, beta);
            /* By hemispherical quadrature. */
            for (int i = 0; i < 400; i++) {
                for (int j = 0; j < 400; j++) {
                    const double theta = 0.5 * REF_PI * (i + 0.5) / 400.0, psi = 2.0 * REF_PI * (j + 0.5) / 400.0;
                    const double w[3] = {sin(theta) * cos(psi), sin(theta) * sin(psi), -cos(theta)};
                    if (w[0] > 0.0 && -w[2] < w[0] * tan(b))
                        continue;
                    for (int k = 0; k < 3; k++)
                        expected[k] += w[k] * cos(theta) * sin(theta);
                }
            }
            CHECK(degrees_between(bent, expected) < 0.3, "distance %d, beta %d: bent normal off by %g degrees",
                  distance, beta, degrees_between(bent, expected));
        }
    }
    ref_image_free(&image);
}

/* A sampled scene against rays through the same scene's height field: every ray is marched in 3D and tested against the
 * depth of the pixel it is over, which knows nothing of slices, horizons or Jacobians. */
static double hemisphere_by_rays(const ref_image *image, const ref_shape *shapes, int count, int x, int y,
                                 double radius, double sum[3]) {
    enum { ELEVATIONS = 16, AZIMUTHS = 64, STEPS = 800 };
    const int at = y * image->width + x;
    const double z = (double)image->z[at];
    double normal[3], p[3] = {z * (x + 0.5 - image->cx) / image->fx, z * (y + 0.5 - image->cy) / image->fy, z};
    normal_of(image, x, y, normal);
    const double e_size = hypot(normal[0], normal[2]), e[3] = {-normal[2] / e_size, 0.0, normal[0] / e_size};
    const double f[3] = {normal[1] * e[2] - normal[2] * e[1], normal[2] * e[0] - normal[0] * e[2],
                         normal[0] * e[1] - normal[1] * e[0]};
    double visible = 0.0;
    sum[0] = sum[1] = sum[2] = 0.0;
    for (int i = 0; i < ELEVATIONS; i++) {
        for (int j = 0; j < AZIMUTHS; j++) {
            /* Cosine-distributed: equal weights. */
            const double sine = sqrt((i + 0.5) / ELEVATIONS), cosine = sqrt(1.0 - (i + 0.5) / ELEVATIONS);
            const double psi = 2.0 * REF_PI * (j + 0.5) / AZIMUTHS;
            double ray[3];
            for (int k = 0; k < 3; k++)
                ray[k] = cosine * normal[k] + sine * (cos(psi) * e[k] + sin(psi) * f[k]);
            int hit = 0;
            for (int step = 1; step <= STEPS && !hit; step++) {
                const double t = 3.0 * radius * step / STEPS; /* it may pass behind a near occluder far away */
                const double q[3] = {p[0] + t * ray[0], p[1] + t * ray[1], p[2] + t * ray[2]};
                if (q[2] <= 1e-3)
                    break;
                /* Only what the image sees occludes. */
                const double u = q[0] / q[2] * image->fx + image->cx, v = q[1] / q[2] * image->fy + image->cy;
                if (u < 0.0 || v < 0.0 || u >= image->width || v >= image->height)
                    break;
                const double origin[3] = {0.0, 0.0, 0.0}, direction[3] = {q[0] / q[2], q[1] / q[2], 1.0};
                ref_hit surface;
                if (!ref_trace(shapes, count, origin, direction, &surface))
                    continue;
                /* The occluder has to lie within the radius itself, not only the ray that passes behind it. */
                if (q[2] > surface.distance * (1.0 + 1e-6)) {
                    const double d[3] = {direction[0] * surface.distance - p[0], direction[1] * surface.distance - p[1],
                                         surface.distance - p[2]};
                    hit = norm(d) <= radius;
                }
            }
            if (hit)
                continue;
            visible += 1.0 / (ELEVATIONS * AZIMUTHS);
            for (int k = 0; k < 3; k++)
                sum[k] += ray[k];
        }
    }
    return visible;
}

static void marching_rays_sees_the_same(void **state) {
    (void)state;
    ref_shape shapes[16];
    /* Without the rods, which come last and are as thin as pixels. */
    const int count = ref_cluttered_scene(shapes, 16) - 3;
    ref_image image = ref_image_perspective(640, 480, 60.0);
    const ref_settings settings = {0.6, 0.0, 64, NULL, 0.5, REF_BORDER_OPEN, 0};
    double square = 0.0, bent_square = 0.0;
    int pixels = 0, bent_pixels = 0;
    ref_render(&image, NULL, shapes, count);
    for (int y = 26; y < image.height; y += 74) {
        for (int x = 22; x < image.width; x += 82) {
            double bent[3], expected_bent[3];
            const double expected = hemisphere_by_rays(&image, shapes, count, x, y, settings.radius, expected_bent);
            const double actual = ref_heightfield(&image, &settings, x, y, bent);
            square += (actual - expected) * (actual - expected);
            pixels++;
            if (expected > 0.1) {
                bent_square += pow(degrees_between(bent, expected_bent), 2.0);
                bent_pixels++;
            }
        }
    }
    const double rmse = sqrt(square / pixels), bent_rms = sqrt(bent_square / bent_pixels);
    printf("# note: height field by slices against rays through it: %d pixels, RMSE %.4f, bent normals %.2f degrees\n",
           pixels, rmse, bent_rms);
    CHECK(rmse < 0.01, "RMSE %g", rmse);
    CHECK(bent_rms < 1.0, "bent normals: RMS %g degrees", bent_rms);
    ref_image_free(&image);
}

/* The memo's pseudo-code and the brute force estimate the same thing near the optical axis. */
static void memo_agrees_on_the_axis(void **state) {
    (void)state;
    enum { SIZE = 128 };
    ref_shape shapes[16];
    const int count = ref_cluttered_scene(shapes, 16);
    ref_image image = ref_image_perspective(SIZE, SIZE, 12.0);
    float *visibility = malloc(SIZE * SIZE * sizeof *visibility), direction[16], offset[16];
    assert_non_null(visibility);
    const memo_settings memo = {32, 64, 0.15f, 0.25f, 1000};
    const ref_settings settings = {0.15, 0.25, 32, NULL, 1.0, REF_BORDER_OPEN, 0};
    double square = 0.0;
    int pixels = 0;
    ref_render(&image, NULL, shapes, count);
    memo_noise(0, direction, offset);
    memo_gtao(SIZE, SIZE, image.z, image.normals, (float)image.fx, (float)image.cx, (float)image.cy, &memo, direction,
              offset, visibility);
    for (int y = 3; y < SIZE; y += 8) {
        for (int x = 3; x < SIZE; x += 8) {
            const double expected = ref_heightfield(&image, &settings, x, y, NULL);
            square += ((double)visibility[y * SIZE + x] - expected) * ((double)visibility[y * SIZE + x] - expected);
            pixels++;
        }
    }
    CHECK(sqrt(square / pixels) < 0.03, "RMSE %g", sqrt(square / pixels));
    free(visibility);
    ref_image_free(&image);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(quadrature_of_open_slices),
        cmocka_unit_test(printed_formulas_are_the_integrals),
        cmocka_unit_test(slopes_give_directions_and_distances),
        cmocka_unit_test(tangent_planes_are_affine_in_height),
        cmocka_unit_test(screen_angle_jacobian),
        cmocka_unit_test(open_planes),
        cmocka_unit_test(groove_and_pit),
        cmocka_unit_test(wall),
        cmocka_unit_test(marching_rays_sees_the_same),
        cmocka_unit_test(memo_agrees_on_the_axis),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
