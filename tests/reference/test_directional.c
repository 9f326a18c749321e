/* Spherical harmonics of gtao.h against quadrature of their definition, slice by slice and over the sphere. */
#include "gtao.h"
#include "tests/compute.h"
#include "tests/reference/check.h"
#include "tests/reference/reference.h"

static const double pi = REF_PI;

static double uniform(uint32_t *state) {
    *state = *state * 1664525u + 1013904223u;
    return (*state >> 8) / 16777216.0;
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void normalize(double a[3]) {
    const double size = sqrt(dot(a, a));
    for (int i = 0; i < 3; i++)
        a[i] /= size;
}

static void cross(const double a[3], const double b[3], double out[3]) {
    for (int i = 0; i < 3; i++)
        out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

static void random_direction(uint32_t *seed, double d[3]) {
    do
        for (int i = 0; i < 3; i++)
            d[i] = 2.0 * uniform(seed) - 1.0;
    while (dot(d, d) > 1.0 || dot(d, d) < 0.01);
    normalize(d);
}

/* Two unit vectors that make a right-handed frame with the unit vector d. */
static void frame_of(const double d[3], double a[3], double b[3]) {
    const double axis[3] = {fabs(d[0]) < 0.6 ? 1.0 : 0.0, fabs(d[0]) < 0.6 ? 0.0 : 1.0, 0.0};
    cross(axis, d, a);
    normalize(a);
    cross(d, a, b);
}

static void to_floats(const double *from, float *to, int count) {
    for (int i = 0; i < count; i++)
        to[i] = (float)from[i];
}

static double basis(int index, const double d[3]) {
    const long double l[3] = {(long double)d[0], (long double)d[1], (long double)d[2]};
    return (double)ref_sh(index, l);
}

static void close_to(const float *sh, const double *expected, double tolerance, const char *what, int trial) {
    for (int i = 0; i < 9; i++)
        CHECK_NEAR(sh[i], expected[i], tolerance, "%s, trial %d, coefficient %d", what, trial, i);
}

/* ---- the formulas ---- */

static void basis_is_the_definition(void **state) {
    (void)state;
    uint32_t seed = 1;
    for (int trial = 0; trial < 1000; trial++) {
        double d[3], expected[9];
        float f[3], sh[9];
        random_direction(&seed, d);
        to_floats(d, f, 3);
        gtao_sh_basis(f, sh);
        for (int i = 0; i < 9; i++)
            expected[i] = basis(i, d);
        close_to(sh, expected, 1e-6, "basis", trial);
    }
}

/* Any two functions' coefficients: of the product of two different ones the integral is 0, of equal ones 1. */
static void basis_is_orthonormal(void **state) {
    (void)state;
    enum { RINGS = 400, POINTS = 16 };
    double gram[9][9] = {{0.0}};
    for (int i = 0; i < RINGS; i++)
        for (int j = 0; j < POINTS; j++) {
            const double z = (2.0 * i + 1.0) / RINGS - 1.0, phi = 2.0 * pi * j / POINTS, s = sqrt(1.0 - z * z);
            const float d[3] = {(float)(s * cos(phi)), (float)(s * sin(phi)), (float)z};
            float sh[9];
            gtao_sh_basis(d, sh);
            for (int a = 0; a < 9; a++)
                for (int b = 0; b < 9; b++)
                    gram[a][b] += (double)sh[a] * (double)sh[b] * 4.0 * pi / (RINGS * POINTS);
        }
    for (int a = 0; a < 9; a++)
        for (int b = 0; b < 9; b++)
            CHECK_NEAR(gram[a][b], a == b ? 1.0 : 0.0, 1e-4, "<Y%d, Y%d>", a, b);
}

static void rotations_turn_the_function(void **state) {
    (void)state;
    uint32_t seed = 2;
    for (int trial = 0; trial < 200; trial++) {
        double r[3][3], d[3], turned[3];
        float m[9], sh[9], out[9], f[3], before[9], after[9];
        double value = 0.0, expected = 0.0;
        random_direction(&seed, r[0]);
        frame_of(r[0], r[1], r[2]);
        if (trial % 2) /* a reflection: another handedness */
            for (int i = 0; i < 3; i++)
                r[2][i] = -r[2][i];
        for (int i = 0; i < 9; i++) {
            m[i] = (float)r[i / 3][i % 3];
            sh[i] = (float)(2.0 * uniform(&seed) - 1.0);
        }
        gtao_sh_rotate(m, sh, out);
        random_direction(&seed, d);
        for (int i = 0; i < 3; i++)
            turned[i] = dot(r[i], d);
        to_floats(d, f, 3);
        gtao_sh_basis(f, before);
        to_floats(turned, f, 3);
        gtao_sh_basis(f, after);
        for (int i = 0; i < 9; i++)
            expected += (double)sh[i] * (double)before[i], value += (double)out[i] * (double)after[i];
        CHECK_NEAR(value, expected, 3e-6, "trial %d", trial);
    }
}

static void arcs_are_the_integrals(void **state) {
    (void)state;
    uint32_t seed = 3;
    for (int trial = 0; trial < 400; trial++) {
        double v[3], o[3], unused[3], expected[9];
        float of[3], vf[3], sh[9];
        random_direction(&seed, v);
        frame_of(v, o, unused);
        const double n = pi * (uniform(&seed) - 0.5), share = trial % 5 == 0 ? 1.0 : uniform(&seed);
        const double h0 = fmin(0.0, (n - 0.5 * pi) * share),
                     h1 = fmax(0.0, (n + 0.5 * pi) * (trial % 7 == 0 ? 1.0 : uniform(&seed)));
        to_floats(o, of, 3);
        to_floats(v, vf, 3);
        gtao_arc_sh((float)h0, (float)h1, (float)n, of, vf, sh);
        ref_arc_sh((long double)(float)h0, (long double)(float)h1, (long double)(float)n, 0, o, v, expected);
        close_to(sh, expected, 1e-6, "arc", trial);
    }
}

/* Of a point whose horizons are any function of the azimuth, from 64 slices; numerically, from the definition. */
static void slices_add_up_to_the_projection(void **state) {
    (void)state;
    enum { SLICES = 64, RINGS = 400, SECTORS = 128 };
    uint32_t seed = 4;
    for (int trial = 0; trial < 6; trial++) {
        double v[3], a[3], b[3], n[3], sum[9] = {0.0}, projection[9] = {0.0}, wave[3];
        float vf[3], total[9];
        random_direction(&seed, v);
        frame_of(v, a, b);
        for (int i = 0; i < 3; i++)
            wave[i] = 2.0 * pi * uniform(&seed);
        const double lean = uniform(&seed), turn = 2.0 * pi * uniform(&seed);
        for (int i = 0; i < 3; i++)
            n[i] = cos(lean) * v[i] + sin(lean) * (cos(turn) * a[i] + sin(turn) * b[i]);
#define HORIZON(psi)                                                                                                   \
    (0.6 + 0.3 * sin((psi) + wave[0]) + 0.1 * cos(2.0 * (psi) + wave[1]) + 0.1 * sin(3.0 * (psi) + wave[2]))
        to_floats(v, vf, 3);
        for (int k = 0; k < SLICES; k++) {
            const double psi = pi * (k + 0.5) / SLICES;
            double o[3], sh_d;
            float of[3], sh[9];
            for (int i = 0; i < 3; i++)
                o[i] = cos(psi) * a[i] + sin(psi) * b[i];
            const double no = dot(n, o), nv = dot(n, v), angle = atan2(no, nv);
            const double h0 = fmax(-HORIZON(psi + pi), angle - 0.5 * pi), h1 = fmin(HORIZON(psi), angle + 0.5 * pi);
            to_floats(o, of, 3);
            gtao_arc_sh((float)h0, (float)h1, (float)angle, of, vf, sh);
            for (int i = 0; i < 9; i++) {
                sh_d = (double)sh[i] * hypot(no, nv);
                sum[i] += sh_d / SLICES; /* d psi = pi / slices, over pi */
            }
        }
        for (int j = 0; j < SECTORS; j++) {
            const double psi = 2.0 * pi * (j + 0.5) / SECTORS, horizon = HORIZON(psi);
            for (int k = 0; k < RINGS; k++) {
                const double theta = horizon * (k + 0.5) / RINGS;
                double w[3];
                for (int i = 0; i < 3; i++)
                    w[i] = sin(theta) * (cos(psi) * a[i] + sin(psi) * b[i]) + cos(theta) * v[i];
                const double weight = fmax(dot(n, w), 0.0) * sin(theta) * horizon / RINGS * 2.0 / SECTORS;
                if (weight > 0.0)
                    for (int i = 0; i < 9; i++)
                        projection[i] += weight * basis(i, w);
            }
        }
#undef HORIZON
        to_floats(sum, total, 9);
        close_to(total, projection, 1e-4, "sphere", trial);
    }
}

/* What the cone sees, numerically; the cone stays above the tangent plane. */
static void cones_are_the_integrals(void **state) {
    (void)state;
    enum { RINGS = 1000, SECTORS = 16 };
    uint32_t seed = 5;
    for (int trial = 0; trial < 60; trial++) {
        double n[3], a[3], c[3], b[3], u[3], w[3], projection[9] = {0.0};
        float nf[3], bf[3], sh[9];
        random_direction(&seed, n);
        frame_of(n, a, c);
        const double lean = trial < 4 ? 0.0 : 1.4 * uniform(&seed), turn = 2.0 * pi * uniform(&seed);
        const double angle = trial == 0 ? 0.5 * pi : trial == 1 ? 1e-3 : (0.5 * pi - lean) * uniform(&seed);
        for (int i = 0; i < 3; i++)
            b[i] = cos(lean) * n[i] + sin(lean) * (cos(turn) * a[i] + sin(turn) * c[i]);
        frame_of(b, u, w);
        for (int k = 0; k < RINGS; k++)
            for (int j = 0; j < SECTORS; j++) {
                const double theta = angle * (k + 0.5) / RINGS, phi = 2.0 * pi * j / SECTORS;
                double d[3];
                for (int i = 0; i < 3; i++)
                    d[i] = cos(theta) * b[i] + sin(theta) * (cos(phi) * u[i] + sin(phi) * w[i]);
                for (int i = 0; i < 9; i++)
                    projection[i] += dot(n, d) * sin(theta) * angle / RINGS * 2.0 / SECTORS * basis(i, d);
            }
        to_floats(n, nf, 3);
        to_floats(b, bf, 3);
        const double visibility = cos(lean) * sin(angle) * sin(angle);
        CHECK_NEAR(gtao_cone_cosine((float)visibility, (float)cos(lean)), cos(angle), 1e-3, "aperture, trial %d",
                   trial);
        gtao_sh_from_cone((float)visibility, bf, nf, sh);
        close_to(sh, projection, 1e-5, "cone", trial);
    }
}

/* ---- the kernels ---- */

typedef struct occluder {
    int dx, dy; /* from the pixel, on a slice */
    float z;
} occluder;

typedef struct receiver {
    gtao_desc desc;
    int x, y;
    float normal[3];
} receiver;

enum { SIZE = 41 };

static void position_of(const gtao_desc *d, int x, int y, double z, double p[3]) {
    const gtao_camera *c = &d->camera;
    const int flat = c->projection == GTAO_ORTHOGRAPHIC;
    p[0] = flat ? (x + 0.5) * (double)c->sx : (x + 0.5 - (double)c->cx) / (double)c->fx * z;
    p[1] = flat ? (y + 0.5) * (double)c->sy : (y + 0.5 - (double)c->cy) / (double)c->fy * z;
    p[2] = z;
}

/* The estimator by its definition: C_open(n) - sum J (S_open - S) / sum J a_open, S by quadrature, with the horizons of
 * the one occluder that lies on each side of a slice. */
static void expected_sh(const receiver *r, float z0, const occluder *at, int slices, double sh[9]) {
    const gtao_desc *d = &r->desc;
    const int flat = d->camera.projection == GTAO_ORTHOGRAPHIC, even = d->weighting == GTAO_WEIGHTING_UNIFORM;
    double p[3], v[3] = {0.0, 0.0, -1.0}, n[3], a[3], b[3], total = 0.0, lost[9] = {0.0};
    position_of(d, r->x, r->y, (double)z0, p);
    for (int i = 0; i < 3; i++) {
        v[i] = flat ? v[i] : -p[i];
        n[i] = (double)r->normal[i];
    }
    normalize(v);
    normalize(n);
    for (int k = 0; k < slices; k++) {
        const double phi = pi * (k + 0.5) / slices, c = cos(phi), s = sin(phi);
        const double bx = flat ? c * (double)d->camera.sx : c / (double)d->camera.fx,
                     by = flat ? s * (double)d->camera.sy : s / (double)d->camera.fy;
        double o[3] = {bx, by, 0.0}, h[2], open[9], seen[9];
        const double along = dot(o, v);
        for (int i = 0; i < 3; i++)
            o[i] -= along * v[i];
        const double jacobian = 1.0 / dot(o, o);
        normalize(o);
        const double angle = atan2(dot(n, o), dot(n, v)), projected = hypot(dot(n, o), dot(n, v));
        for (int side = 0; side < 2; side++) {
            const occluder *q = &at[2 * k + side];
            const double limit = angle + (side ? 0.5 : -0.5) * pi;
            double to[3];
            h[side] = limit;
            if (!(q->z > 0.0f))
                continue;
            position_of(d, r->x + q->dx, r->y + q->dy, (double)q->z, to);
            for (int i = 0; i < 3; i++)
                to[i] -= p[i];
            const double horizon = atan2(dot(to, o), dot(to, v));
            h[side] = side ? fmin(limit, horizon) : fmax(limit, horizon);
        }
        ref_arc_sh((long double)angle - 0.5L * (long double)pi, (long double)angle + 0.5L * (long double)pi,
                   (long double)angle, even, o, v, open);
        ref_arc_sh((long double)h[0], (long double)h[1], (long double)angle, even, o, v, seen);
        for (int i = 0; i < 9; i++)
            lost[i] += jacobian * (even ? 1.0 : projected) * (open[i] - seen[i]);
        total += jacobian * (even ? 2.0 : projected * (cos(angle) + angle * sin(angle)));
    }
    frame_of(n, a, b);
    for (int i = 0; i < 9; i++) {
        double whole = 0.0;
        for (int k = 0; k < 4; k++) /* Gauss-Legendre over the cosine u: exact */
            for (int j = 0; j < 8; j++) {
                static const double node[2] = {0.86113631159405258, 0.33998104358485626},
                                    weight[2] = {0.34785484513745386, 0.65214515486254614};
                const double u = 0.5 + (k < 2 ? 0.5 : -0.5) * node[k % 2], turn = 2.0 * pi * j / 8.0;
                double dir[3];
                for (int m = 0; m < 3; m++)
                    dir[m] = u * n[m] + sqrt(1.0 - u * u) * (cos(turn) * a[m] + sin(turn) * b[m]);
                whole += (even ? 0.5 : u) * weight[k % 2] / 8.0 * basis(i, dir);
            }
        sh[i] = whole - lost[i] / total;
    }
}

/* One visible pixel, and on each side of each slice one more at most: horizons are known, and so is the answer. */
static void kernels_are_the_estimator(void **state) {
    (void)state;
    uint32_t seed = 6;
    double worst[2] = {0.0, 0.0};
    for (int trial = 0; trial < 240; trial++) {
        static float z[SIZE * SIZE], normals[3 * SIZE * SIZE], sh[9 * SIZE * SIZE];
        const int slices = 1 + trial % 2; /* vertical; or the diagonals */
        receiver r;
        occluder at[4];
        double expected[9];
        memset(&r, 0, sizeof r);
        for (int i = 0; i < SIZE * SIZE; i++) {
            z[i] = INFINITY;
            normals[3 * i] = normals[3 * i + 1] = 0.0f, normals[3 * i + 2] = -1.0f;
        }
        gtao_desc *d = &r.desc;
        d->width = d->height = SIZE;
        d->depth = z;
        d->normals = normals;
        d->radius = trial % 5 ? INFINITY : 50.0f;
        d->slices = slices;
        d->every_pixel = trial % 3 != 0;
        d->steps = 255;
        d->step_power = 1.0f;
        d->noise = GTAO_NOISE_NONE;
        d->weighting = trial % 4 == 3 ? GTAO_WEIGHTING_UNIFORM : GTAO_WEIGHTING_COSINE;
        d->isa = (gtao_isa)(trial % 3);
        if (d->isa == GTAO_ISA_SSE2 && !gtao_isa_available(d->isa))
            d->isa = GTAO_ISA_AUTO;
        if (trial % 6 == 5) {
            d->camera.projection = GTAO_ORTHOGRAPHIC;
            d->camera.sx = 0.3f, d->camera.sy = slices == 1 ? 0.45f : 0.3f;
        } else {
            d->camera.fx = (float)(20.0 + 60.0 * uniform(&seed));
            d->camera.fy = d->camera.fx * (float)(0.7 + 0.6 * uniform(&seed));
            d->camera.off_center = 1;
            d->camera.cx = (float)(SIZE * uniform(&seed)), d->camera.cy = (float)(SIZE * uniform(&seed));
        }
        r.x = 12 + (int)(16 * uniform(&seed)), r.y = 12 + (int)(16 * uniform(&seed));
        const float z0 = 10.0f;
        z[r.y * SIZE + r.x] = z0;
        for (int k = 0; k < 2 * slices; k++) {
            const int t = (k % 2 ? 1 : -1) * (1 + (int)(11 * uniform(&seed)));
            at[k].dx = slices == 1 ? 0 : k < 2 ? t : -t, at[k].dy = t;
            at[k].z = uniform(&seed) < 0.15 ? 0.0f : z0 + (float)(6.0 * uniform(&seed) - 5.0);
            if (at[k].z > 0.0f)
                z[(r.y + at[k].dy) * SIZE + r.x + at[k].dx] = at[k].z;
        }
        double p[3], n[3], v[3];
        position_of(d, r.x, r.y, (double)z0, p);
        for (int i = 0; i < 3; i++)
            v[i] = d->camera.projection == GTAO_ORTHOGRAPHIC ? (i == 2 ? -1.0 : 0.0) : -p[i];
        normalize(v);
        do
            random_direction(&seed, n);
        while (dot(n, v) < 0.15);
        to_floats(n, r.normal, 3);
        memcpy(&normals[3 * (r.y * SIZE + r.x)], r.normal, sizeof r.normal);

        gtao_output output = {0};
        output.sh = sh;
        const gtao_result status = compute_output(d, &output);
        CHECK(status == GTAO_OK, "%s", gtao_result_string(status));
        expected_sh(&r, z0, at, slices, expected);
        for (int i = 0; i < 9; i++) {
            const double got = (double)sh[i * SIZE * SIZE + r.y * SIZE + r.x];
            worst[d->weighting] = fmax(worst[d->weighting], fabs(got - expected[i]));
            /* Rises taken for rounding, up to 2.4e-4 in cot h, count in the first order if weighted uniformly. */
            CHECK_NEAR(got, expected[i], d->weighting == GTAO_WEIGHTING_COSINE ? 4e-6 : 1e-4,
                       "trial %d, coefficient %d", trial, i);
        }
    }
    printf("# note: kernels against quadrature of the estimator: %.2g at most, uniformly weighted %.2g\n", worst[0],
           worst[1]);
}

/* A cluttered room, as a height field and with columns of some thickness, against brute force with sorted intervals. */
static void scenes_against_brute_force(void **state) {
    (void)state;
    static const double eye[3] = {-1.0, -2.5, -1.0}, target[3] = {0.0, 0.8, 3.5}, up[3] = {0.0, -1.0, 0.0};
    ref_shape shapes[32];
    static const double most[] = {0.005, 0.015, 0.012, 0.004};
    const int count = ref_cluttered_scene(shapes, 32);
    for (int variant = 0; variant < 4; variant++) {
        ref_image img;
        gtao_desc desc = {0};
        gtao_output output = {0};
        if (variant < 3) {
            img = ref_image_perspective(160, 90, 60.0);
            ref_render(&img, NULL, shapes, count);
            desc.camera.fx = (float)img.fx, desc.camera.fy = (float)img.fy;
        } else {
            ref_pose pose = ref_pose_look(eye, target, up);
            img = ref_image_orthographic(160, 90, 4.5 / 160);
            for (int i = 0; i < 3; i++)
                pose.eye[i] -= 2.2 * pose.right[i] + 1.5 * pose.down[i] + 2.0 * pose.forward[i];
            ref_render(&img, &pose, shapes, count);
            desc.camera.projection = GTAO_ORTHOGRAPHIC;
            desc.camera.sx = (float)img.sx, desc.camera.sy = (float)img.sy;
        }
        const ref_settings settings = {1.0, 0.0, 32, NULL, 1.0, REF_BORDER_OPEN, 0};
        const double thickness = variant == 0 ? (double)INFINITY : variant == 1 ? 0.1 : 0.3;
        ref_slabs slabs = {0};
        slabs.thickness = thickness, slabs.surface_px = 4.0, slabs.whole = 1;
        const size_t plane = (size_t)img.width * (size_t)img.height;
        float *sh = malloc(9 * plane * sizeof *sh);
        desc.width = img.width, desc.height = img.height;
        desc.depth = img.z, desc.normals = img.normals;
        desc.radius = 1.0f;
        desc.thickness = (float)thickness;
        desc.preset = GTAO_PRESET_REFERENCE;
        desc.noise = GTAO_NOISE_NONE;
        output.sh = sh;
        CHECK(sh, "out of memory");
        const gtao_result status = compute_output(&desc, &output);
        CHECK(status == GTAO_OK, "%s", gtao_result_string(status));
        double squares[9] = {0.0}, worst = 0.0;
        int pixels = 0;
        for (int y = 4; y < img.height; y += 9)
            for (int x = 4; x < img.width; x += 9) {
                double expected[9];
                const size_t at = (size_t)(y * img.width + x);
                if (!isfinite(img.z[at]))
                    continue;
                ref_arcs_sh(&img, &settings, &slabs, x, y, expected);
                for (size_t i = 0; i < 9; i++) {
                    const double off = (double)sh[i * plane + at] - expected[i];
                    squares[i] += off * off;
                }
                pixels++;
            }
        for (int i = 0; i < 9; i++)
            worst = fmax(worst, sqrt(squares[i] / pixels));
        printf("# note: room, %s, thickness %g: %d pixels, coefficients within RMSE %.4f\n",
               variant < 3 ? "perspective" : "orthographic", thickness, pixels, worst);
        CHECK(pixels > 100 && worst < most[variant], "variant %d: %d pixels, RMSE %g", variant, pixels, worst);
        free(sh);
        ref_image_free(&img);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(basis_is_the_definition),         cmocka_unit_test(basis_is_orthonormal),
        cmocka_unit_test(rotations_turn_the_function),     cmocka_unit_test(arcs_are_the_integrals),
        cmocka_unit_test(slices_add_up_to_the_projection), cmocka_unit_test(cones_are_the_integrals),
        cmocka_unit_test(kernels_are_the_estimator),       cmocka_unit_test(scenes_against_brute_force),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
