/* The formulas of gtao.h's third level against long double libm, quadrature and the papers. */
#include "gtao.h"
#include "tests/reference/check.h"
#include "tests/reference/reference.h"

static const double pi = REF_PI;

/* Uniform in [low, high), from a fixed seed. */
static double between(uint32_t *seed, double low, double high) {
    *seed = *seed * 1664525u + 1013904223u;
    return low + (high - low) * ((*seed >> 8) / 16777216.0);
}

static void keep_largest(double *largest, double value) {
    /* Keeps NaN, too, so that the check afterwards fails. */
    if (!(value <= *largest))
        *largest = value;
}

/* ---- elementary functions ---- */

static void acos_error(void **state) {
    (void)state;
    double error = 0.0;
    for (int i = -200000; i <= 200000; i++) {
        const float x = (float)i / 200000.0f;
        keep_largest(&error, (double)fabsl((long double)gtao_acos(x) - acosl((long double)x)));
    }
    /* Every float next to the ends, where the derivative is infinite, and around 0. */
    float x = 1.0f;
    for (int i = 0; i < 20000; i++, x = nextafterf(x, 0.0f)) {
        keep_largest(&error, (double)fabsl((long double)gtao_acos(x) - acosl((long double)x)));
        keep_largest(&error, (double)fabsl((long double)gtao_acos(-x) - acosl(-(long double)x)));
    }
    for (x = 1e-3f; x > 1e-38f; x *= 0.7f) {
        keep_largest(&error, (double)fabsl((long double)gtao_acos(x) - acosl((long double)x)));
        keep_largest(&error, (double)fabsl((long double)gtao_acos(-x) - acosl(-(long double)x)));
    }
    printf("# note: acos: max error %.2g rad\n", error);
    CHECK(error < 1e-6, "error %g", error);
}

static void acos_clamps(void **state) {
    (void)state;
    CHECK_NEAR(gtao_acos(1.0f), 0.0, 0.0, "acos(1)");
    CHECK_NEAR(gtao_acos(1.5f), 0.0, 0.0, "acos(1.5)");
    CHECK_NEAR(gtao_acos(INFINITY), 0.0, 0.0, "acos(inf)");
    CHECK_NEAR(gtao_acos(-1.5f), pi, 1e-6, "acos(-1.5)");
    CHECK_NEAR(gtao_acos(-INFINITY), pi, 1e-6, "acos(-inf)");
    CHECK(isfinite(gtao_acos(NAN)), "acos(NaN) is not finite");
}

static void acos_decreases(void **state) {
    (void)state;
    /* A horizon that rises must not open the arc by more than rounding. */
    float last = gtao_acos(-1.0f);
    for (int i = -99999; i <= 100000; i++) {
        const float now = gtao_acos((float)i / 100000.0f);
        CHECK(now <= last, "acos rises at %g: %.9g after %.9g", i / 100000.0, (double)now, (double)last);
        last = now;
    }
}

static void sincos_error(void **state) {
    (void)state;
    double error = 0.0;
    for (int i = -400000; i <= 400000; i++) {
        const float a = (float)(2.0 * pi * i / 400000.0);
        float sine, cosine;
        gtao_sincos(a, &sine, &cosine);
        keep_largest(&error, (double)fabsl((long double)sine - sinl((long double)a)));
        keep_largest(&error, (double)fabsl((long double)cosine - cosl((long double)a)));
    }
    printf("# note: sin, cos: max error %.2g on [-2 pi, 2 pi]\n", error);
    CHECK(error < 1e-6, "error %g", error);
}

static void atan2_error(void **state) {
    (void)state;
    static const double sizes[] = {1e-18, 1e-9, 1e-3, 1.0, 37.0, 1e6, 9e17};
    double error = 0.0;
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
        for (int i = -30000; i <= 30000; i++) {
            const float y = (float)(sizes[s] * sin(pi * i / 30000.0)), x = (float)(sizes[s] * cos(pi * i / 30000.0));
            /* -pi and pi are the same direction; which one depends on the sign of a zero. */
            const long double off =
                remainderl((long double)gtao_atan2(y, x) - atan2l((long double)y, (long double)x), 2.0L * acosl(-1.0L));
            keep_largest(&error, (double)fabsl(off));
        }
    }
    printf("# note: atan2: max error %.2g rad\n", error);
    CHECK(error < 1e-6, "error %g", error);
    CHECK_NEAR(gtao_atan2(1.0f, 0.0f), 0.5 * pi, 1e-6, "atan2(1, 0)");
    CHECK_NEAR(gtao_atan2(-1.0f, 0.0f), -0.5 * pi, 1e-6, "atan2(-1, 0)");
    CHECK_NEAR(gtao_atan2(0.0f, 1.0f), 0.0, 0.0, "atan2(0, 1)");
    CHECK_NEAR(fabs((double)gtao_atan2(0.0f, -1.0f)), pi, 1e-6, "atan2(0, -1)");
    CHECK(isfinite(gtao_atan2(0.0f, 0.0f)), "atan2(0, 0) is not finite");
}

/* ---- [J19], [J16] integrals of a slice ---- */

static void arc_error(void **state) {
    (void)state;
    double error = 0.0;
    for (int i = -180; i <= 180; i++) {
        const float n = (float)(0.5 * pi * i / 180.0);
        for (int j = -180; j <= 180; j++) {
            const float h = (float)(0.5 * pi * (i + j) / 180.0);
            keep_largest(&error, (double)fabsl((long double)gtao_arc(h, n) - ref_arc((long double)h, (long double)n)));
        }
    }
    printf("# note: arc: max error %.2g\n", error);
    CHECK(error < 1e-6, "error %g", error);
}

static void open_slices_add_up(void **state) {
    (void)state;
    for (int i = -1800; i <= 1800; i++) {
        const double n = 0.5 * pi * i / 1800.0;
        const float nf = (float)n, quarter = (float)(0.5 * pi);
        const double sum = (double)gtao_arc(nf - quarter, nf) + (double)gtao_arc(nf + quarter, nf);
        CHECK_NEAR(sum, cos(n) + n * sin(n), 1e-6, "n = %g", n);
    }
}

static void arc_uniform_error(void **state) {
    (void)state;
    double error = 0.0;
    for (int i = -20000; i <= 20000; i++) {
        const float h = (float)(pi * i / 20000.0);
        keep_largest(&error, (double)fabsl((long double)gtao_arc_uniform(h) - ref_arc_uniform((long double)h)));
    }
    printf("# note: uniform arc: max error %.2g\n", error);
    CHECK(error < 1e-6, "error %g", error);
}

static void arc_bent_error(void **state) {
    (void)state;
    enum { STEPS = 60 };
    double error = 0.0;
    for (int i = -STEPS; i <= STEPS; i++) {
        const float n = (float)(0.5 * pi * i / STEPS);
        float h[2][2 * STEPS + 1];
        long double side[2][2 * STEPS + 1][2];
        int count[2] = {0, 0};
        /* The integral from h0 to h1 by definition is that from h0 to 0 and that from 0 to h1. */
        for (int j = -STEPS; j <= STEPS; j++) {
            const float angle = (float)(0.5 * pi * (i + j) / STEPS);
            if (i + j <= 0) {
                h[0][count[0]] = angle;
                ref_arc_bent((long double)angle, 0.0L, (long double)n, side[0][count[0]++]);
            }
            if (i + j >= 0) {
                h[1][count[1]] = angle;
                ref_arc_bent(0.0L, (long double)angle, (long double)n, side[1][count[1]++]);
            }
        }
        for (int a = 0; a < count[0]; a++) {
            for (int b = 0; b < count[1]; b++) {
                float t[2];
                gtao_arc_bent(h[0][a], h[1][b], n, t);
                for (int k = 0; k < 2; k++) {
                    const long double expected = side[0][a][k] + side[1][b][k];
                    keep_largest(&error, (double)fabsl((long double)t[k] - expected));
                }
            }
        }
    }
    printf("# note: bent normal of a slice: max error %.2g\n", error);
    CHECK(error < 1e-6, "error %g", error);
}

/* V (1 + q + q^2 + ...), q = albedo (1 - V): summed bounce by bounce. */
static void multi_bounce_series_is_the_sum_of_bounces(void **state) {
    (void)state;
    for (int i = 0; i <= 20; i++)
        for (int j = 0; j <= 19; j++) {
            const double v = i / 20.0, albedo = j / 20.0;
            double sum = 0.0, bounce = v;
            for (int k = 0; k < 2000; k++, bounce *= albedo * (1.0 - v))
                sum += bounce;
            CHECK(fabs((double)gtao_multi_bounce_series((float)v, (float)albedo) - sum) < 1e-6,
                  "visibility %g albedo %g", v, albedo);
        }
    CHECK(gtao_multi_bounce_series(0.0f, 1.0f) == 0.0f && gtao_multi_bounce_series(1.0f, 1.0f) == 1.0f, "limits");
}

static void multi_bounce_is_the_printed_cubic(void **state) {
    (void)state;
    double error = 0.0;
    for (int i = 0; i <= 200; i++) {
        for (int j = 0; j <= 200; j++) {
            const float visibility = (float)i / 200.0f, albedo = (float)j / 200.0f;
            const double v = (double)visibility, rho = (double)albedo;
            const double a = 2.0404 * rho - 0.3324, b = -4.7951 * rho + 0.6417, c = 2.7552 * rho + 0.6903;
            const double expected = fmin(1.0, fmax(v, ((v * a + b) * v + c) * v)); /* 1.0001 at v = rho = 1 */
            keep_largest(&error, fabs((double)gtao_multi_bounce(visibility, albedo) - expected));
            const float albedo3[3] = {albedo, 0.0f, 1.0f};
            float rgb[3];
            gtao_multi_bounce_rgb(visibility, albedo3, rgb);
            for (int k = 0; k < 3; k++)
                CHECK(memcmp(&rgb[k], &(float){gtao_multi_bounce(visibility, albedo3[k])}, sizeof rgb[k]) == 0,
                      "colour differs from grey");
        }
    }
    CHECK(error < 1e-6, "error %g", error);
}

/* ---- packing ---- */

static void pack_round_trip(void **state) {
    (void)state;
    uint32_t seed = 1;
    for (int trial = 0; trial < 100000; trial++) {
        const double polar = acos(between(&seed, -1.0, 1.0)), azimuth = between(&seed, 0.0, 2.0 * pi);
        const float visibility = (float)between(&seed, 0.0, 1.0);
        const float n[3] = {(float)(sin(polar) * cos(azimuth)), (float)(sin(polar) * sin(azimuth)), (float)cos(polar)};
        float back, m[3];
        gtao_unpack(gtao_pack(visibility, n), &back, m);
        CHECK_NEAR(back, visibility, 0.5 / 255.0 + 1e-6, "visibility");
        /* Unpacked normals may be renormalised. */
        for (int k = 0; k < 3; k++)
            CHECK_NEAR(m[k], n[k], 0.012, "component %d", k);
        const double size = sqrt((double)(m[0] * m[0] + m[1] * m[1] + m[2] * m[2]));
        CHECK_NEAR(size, 1.0, 0.01, "length");
    }
}

static void pack_layout(void **state) {
    (void)state;
    const float x[3] = {1.0f, 0.0f, -1.0f};
    const uint32_t packed = gtao_pack(1.0f, x);
    assert_int_equal(packed & 255u, 255);
    assert_int_equal(packed >> 8 & 255u, 255);
    assert_true((packed >> 16 & 255u) == 127 || (packed >> 16 & 255u) == 128);
    assert_int_equal(packed >> 24, 0);
    for (unsigned i = 0; i < 256; i++) {
        float visibility, n[3];
        gtao_unpack(i | 0x80808000u, &visibility, n);
        CHECK_NEAR(visibility, i / 255.0, 1e-6, "visibility %u", i);
    }
}

/* ---- noise ---- */

static int compare_floats(const void *a, const void *b) {
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* [J16] 16 directions in space by 6 in time, as evenly spaced as 96 can be; 4 offsets by 4. */
static void memo_noise_directions(void **state) {
    (void)state;
    float all[96];
    for (uint32_t frame = 0; frame < 6; frame++) {
        for (int i = 0; i < 16; i++) {
            float direction, offset;
            gtao_noise_at(GTAO_NOISE_MEMO, i % 4, i / 4, frame, &direction, &offset);
            CHECK(direction >= 0.0f && direction < 1.0f, "direction %g", (double)direction);
            all[frame * 16 + (uint32_t)i] = direction;
        }
    }
    qsort(all, 96, sizeof all[0], compare_floats);
    for (int i = 1; i < 96; i++)
        CHECK_NEAR(all[i] - all[i - 1], 1.0 / 96.0, 1e-5, "gap %d", i);
}

static void memo_noise_rows(void **state) {
    (void)state;
    /* Each row of a tile has one direction in every quarter turn, and so has each column. */
    for (uint32_t frame = 0; frame < 12; frame++) {
        for (int y = 0; y < 4; y++) {
            unsigned row = 0, column = 0;
            float direction, offset, first;
            gtao_noise_at(GTAO_NOISE_MEMO, 0, 0, frame, &first, &offset);
            for (int x = 0; x < 4; x++) {
                gtao_noise_at(GTAO_NOISE_MEMO, x, y, frame, &direction, &offset);
                row |= 1u << (int)floor(4.0 * fmod((double)(direction - first) + 2.0 + 1e-4, 1.0));
                gtao_noise_at(GTAO_NOISE_MEMO, y, x, frame, &direction, &offset);
                column |= 1u << (int)floor(4.0 * fmod((double)(direction - first) + 2.0 + 1e-4, 1.0));
            }
            CHECK(row == 15u && column == 15u, "frame %u, row %d: %x, column: %x", frame, y, row, column);
        }
    }
}

static void memo_noise_offsets(void **state) {
    (void)state;
    unsigned seen = 0;
    for (uint32_t frame = 0; frame < 24; frame += 6) {
        for (int y = 0; y < 4; y++) {
            for (int x = 0; x < 4; x++) {
                float direction, offset;
                gtao_noise_at(GTAO_NOISE_MEMO, x, y, frame, &direction, &offset);
                CHECK(offset >= 0.0f && offset < 1.0f, "offset %g", (double)offset);
                CHECK_NEAR(16.0 * (double)offset, round(16.0 * (double)offset), 0.0, "a sixteenth");
                seen |= 1u << (int)(16.0f * offset);
            }
        }
    }
    assert_int_equal(seen, 0xffff);
}

static void memo_noise_is_the_printed_one(void **state) {
    (void)state;
    for (unsigned frame = 0; frame < 48; frame++) {
        float directions[16], offsets[16];
        memo_noise(frame, directions, offsets);
        for (int y = 0; y < 9; y++) {
            for (int x = 0; x < 9; x++) {
                float direction, offset;
                gtao_noise_at(GTAO_NOISE_MEMO, x, y, frame, &direction, &offset);
                CHECK_NEAR(direction, directions[4 * (y & 3) + (x & 3)], 1e-6, "frame %u, %d %d", frame, x, y);
                CHECK_NEAR(offset, offsets[4 * (y & 3) + (x & 3)], 0.0, "frame %u, %d %d", frame, x, y);
            }
        }
    }
}

static void no_noise(void **state) {
    (void)state;
    for (int i = 0; i < 100; i++) {
        float direction, offset;
        gtao_noise_at(GTAO_NOISE_NONE, i, 3 * i, (uint32_t)i, &direction, &offset);
        CHECK_NEAR(direction, 0.5, 0.0, "direction");
        CHECK_NEAR(offset, 0.5, 0.0, "offset");
    }
}

/* Index of each pixel's noise in the R2 sequence, found by its value: -1 if it is none of the tile's. */
static int r2_index(double direction, double offset) {
    /* 1/g and 1/g^2, g the root of g^3 = g + 1. */
    double g = 1.3;
    for (int i = 0; i < 60; i++)
        g = cbrt(g + 1.0);
    int best = -1;
    double best_distance = 1e-4;
    for (int i = 0; i < 4096; i++) {
        const double a = direction - (0.5 + i / g), b = offset - (0.5 + i / (g * g));
        const double distance = fabs(a - round(a)) + fabs(b - round(b));
        if (distance < best_distance) {
            best_distance = distance;
            best = i;
        }
    }
    return best;
}

static void hilbert_noise(void **state) {
    (void)state;
    static int where[4096];
    memset(where, -1, sizeof where);
    for (int y = 0; y < 64; y++) {
        for (int x = 0; x < 64; x++) {
            float direction, offset, other[2];
            gtao_noise_at(GTAO_NOISE_HILBERT, x, y, 0, &direction, &offset);
            CHECK(direction >= 0.0f && direction < 1.0f && offset >= 0.0f && offset < 1.0f, "at %d %d", x, y);
            gtao_noise_at(GTAO_NOISE_HILBERT, x + 64, y + 128, 64, &other[0], &other[1]);
            CHECK_NEAR(other[0], direction, 0.0, "period, %d %d", x, y);
            CHECK_NEAR(other[1], offset, 0.0, "period, %d %d", x, y);
            const int index = r2_index((double)direction, (double)offset);
            CHECK(index >= 0, "%d %d: %g, %g is not in the sequence", x, y, (double)direction, (double)offset);
            CHECK(where[index] < 0, "%d %d: index %d again", x, y, index);
            where[index] = 64 * y + x;
        }
    }
    /* The curve visits every pixel and goes from each to a neighbour. */
    for (int i = 1; i < 4096; i++) {
        const int dx = abs(where[i] % 64 - where[i - 1] % 64), dy = abs(where[i] / 64 - where[i - 1] / 64);
        CHECK(dx + dy == 1, "from index %d to %d: %d %d pixels", i - 1, i, dx, dy);
    }
}

static void hilbert_noise_over_time(void **state) {
    (void)state;
    /* A pixel's 64 frames are spread evenly: about 8 in each eighth. */
    for (int plane = 0; plane < 2; plane++) {
        int bins[8] = {0};
        for (uint32_t frame = 0; frame < 64; frame++) {
            float value[2];
            gtao_noise_at(GTAO_NOISE_HILBERT, 5, 9, frame, &value[0], &value[1]);
            bins[(int)(8.0f * value[plane])]++;
        }
        for (int i = 0; i < 8; i++)
            CHECK(bins[i] >= 6 && bins[i] <= 10, "plane %d, eighth %d: %d of 64", plane, i, bins[i]);
    }
}

/* ---- cameras ---- */

static void camera_from_fov(void **state) {
    (void)state;
    for (int fov = 1; fov < 180; fov += 7) {
        const gtao_camera camera = gtao_camera_from_fov((float)fov, 640, 360);
        const double expected = 180.0 / tan(fov * pi / 360.0);
        CHECK(camera.projection == GTAO_PERSPECTIVE && !camera.off_center, "kind");
        CHECK_NEAR(camera.fx, expected, 2e-6 * expected, "fov %d", fov);
        CHECK(camera.fy == 0.0f || camera.fy == camera.fx, "square pixels");
    }
}

typedef struct frustum {
    int left_handed; /* forward is +z, not -z */
    int clip_y_down; /* Vulkan: clip y = -1 is the top row */
    int zero_to_one; /* device depth is clip z / w, else half of it plus a half */
    int reversed;    /* 1 at the near plane */
    int infinite;    /* no far plane */
    int orthographic;
    double left, right, bottom, top; /* at the near plane, y up */
    double z_near, z_far;
} frustum;

/* The textbook matrix: rows of clip = M (right, up, +-forward, 1). */
static void projection_of(const frustum *f, double m[4][4]) {
    const double forward = f->left_handed ? 1.0 : -1.0;
    const double d_near = f->reversed ? 1.0 : f->zero_to_one ? 0.0 : -1.0;
    const double d_far = f->reversed ? (f->zero_to_one ? 0.0 : -1.0) : 1.0;
    memset(m, 0, 16 * sizeof m[0][0]);
    if (f->orthographic) {
        m[0][0] = 2.0 / (f->right - f->left);
        m[0][3] = -(f->right + f->left) / (f->right - f->left);
        m[1][1] = 2.0 / (f->top - f->bottom);
        m[1][3] = -(f->top + f->bottom) / (f->top - f->bottom);
        m[2][2] = forward * (d_far - d_near) / (f->z_far - f->z_near);
        m[2][3] = d_near - (d_far - d_near) / (f->z_far - f->z_near) * f->z_near;
        m[3][3] = 1.0;
    } else {
        m[0][0] = 2.0 * f->z_near / (f->right - f->left);
        m[0][2] = -forward * (f->right + f->left) / (f->right - f->left);
        m[1][1] = 2.0 * f->z_near / (f->top - f->bottom);
        m[1][2] = -forward * (f->top + f->bottom) / (f->top - f->bottom);
        /* clip z = a z + b with a + b / z the device depth at z = near and far. */
        const double b =
            f->infinite ? (d_near - d_far) * f->z_near : (d_near - d_far) / (1.0 / f->z_near - 1.0 / f->z_far);
        const double a = d_near - b / f->z_near;
        m[2][2] = forward * a;
        m[2][3] = b;
        m[3][2] = forward;
    }
    if (f->clip_y_down)
        for (int k = 0; k < 4; k++)
            m[1][k] = -m[1][k];
}

static void check_frustum(const frustum *f, uint32_t *seed) {
    enum { WIDTH = 640, HEIGHT = 360 };
    double m[4][4];
    float mf[16], scale, bias;
    gtao_camera camera;
    projection_of(f, m);
    for (int i = 0; i < 16; i++)
        mf[i] = (float)m[i / 4][i % 4];
    const gtao_clip clip = f->zero_to_one ? GTAO_CLIP_ZERO_TO_ONE : GTAO_CLIP_MINUS_ONE_TO_ONE;
    const gtao_result result =
        gtao_camera_from_projection(mf, clip, f->clip_y_down, WIDTH, HEIGHT, &camera, &scale, &bias);
    CHECK(result == GTAO_OK, "%s", gtao_result_string(result));
    CHECK(camera.projection == (f->orthographic ? GTAO_ORTHOGRAPHIC : GTAO_PERSPECTIVE), "projection");
    double last_x = 0.0, last_y = 0.0, last_right = 0.0, last_down = 0.0;
    for (int trial = 0; trial < 200; trial++) {
        const double depth = between(seed, 1.0, 60.0), right = between(seed, -5.0, 5.0),
                     down = between(seed, -5.0, 5.0);
        const double view[4] = {right, -down, f->left_handed ? depth : -depth, 1.0};
        double c[4] = {0.0, 0.0, 0.0, 0.0};
        for (int i = 0; i < 4; i++)
            for (int k = 0; k < 4; k++)
                c[i] += m[i][k] * view[k];
        const double x = 0.5 * (c[0] / c[3] + 1.0) * WIDTH;
        const double y = 0.5 * (f->clip_y_down ? 1.0 + c[1] / c[3] : 1.0 - c[1] / c[3]) * HEIGHT;
        const double device = f->zero_to_one ? c[2] / c[3] : 0.5 * (c[2] / c[3] + 1.0);
        const double height = (double)scale * device + (double)bias;
        if (f->orthographic) {
            CHECK_NEAR(height, -depth, 1e-5 * f->z_far, "height");
            const double sy = camera.sy > 0.0f ? (double)camera.sy : (double)camera.sx;
            if (trial) {
                CHECK_NEAR((x - last_x) * (double)camera.sx, right - last_right, 1e-4, "x");
                CHECK_NEAR((y - last_y) * sy, down - last_down, 1e-4, "y");
            }
            last_x = x, last_y = y, last_right = right, last_down = down;
        } else {
            const double fy = camera.fy > 0.0f ? (double)camera.fy : (double)camera.fx;
            const double cx = camera.off_center ? (double)camera.cx : 0.5 * WIDTH;
            const double cy = camera.off_center ? (double)camera.cy : 0.5 * HEIGHT;
            CHECK_NEAR((double)camera.fx * right / depth + cx, x, 1e-5 * (fabs(x) + WIDTH), "x");
            CHECK_NEAR(fy * down / depth + cy, y, 1e-5 * (fabs(y) + HEIGHT), "y");
            /* The bias of a plane far away is a small difference of floats; the height is what is exact. */
            CHECK_NEAR(height, 1.0 / depth, 2e-6 / f->z_near, "height");
        }
    }
}

static void camera_from_projection(void **state) {
    (void)state;
    uint32_t seed = 5;
    for (int bits = 0; bits < 128; bits++) {
        frustum f;
        f.left_handed = bits & 1;
        f.clip_y_down = bits >> 1 & 1;
        f.zero_to_one = bits >> 2 & 1;
        f.reversed = bits >> 3 & 1;
        f.infinite = bits >> 4 & 1;
        f.orthographic = bits >> 5 & 1;
        const int off_center = bits >> 6 & 1;
        f.z_near = 0.5;
        f.z_far = 80.0;
        f.left = off_center ? -0.2 : -0.4;
        f.right = off_center ? 0.5 : 0.4;
        f.bottom = off_center ? -0.31 : -0.225;
        f.top = off_center ? 0.11 : 0.225;
        if (f.orthographic) {
            if (f.infinite)
                continue;
            f.left *= 10.0, f.right *= 10.0, f.bottom *= 10.0, f.top *= 10.0;
        }
        print_message("%s %s %s %s%s %s %s\n", f.left_handed ? "left-handed" : "right-handed",
                      f.clip_y_down ? "y down" : "y up", f.zero_to_one ? "[0, 1]" : "[-1, 1]",
                      f.reversed ? "reversed " : "", f.infinite ? "infinite" : "finite",
                      f.orthographic ? "orthographic" : "perspective", off_center ? "off-centre" : "centred");
        check_frustum(&f, &seed);
    }
}

static void camera_from_nonsense(void **state) {
    (void)state;
    gtao_camera camera;
    float scale, bias, m[16] = {0.0f};
    assert_int_not_equal(gtao_camera_from_projection(m, GTAO_CLIP_ZERO_TO_ONE, 0, 8, 8, &camera, &scale, &bias),
                         GTAO_OK);
    for (int i = 0; i < 16; i++)
        m[i] = NAN;
    assert_int_not_equal(gtao_camera_from_projection(m, GTAO_CLIP_ZERO_TO_ONE, 0, 8, 8, &camera, &scale, &bias),
                         GTAO_OK);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(acos_error),
        cmocka_unit_test(acos_clamps),
        cmocka_unit_test(acos_decreases),
        cmocka_unit_test(sincos_error),
        cmocka_unit_test(atan2_error),
        cmocka_unit_test(arc_error),
        cmocka_unit_test(open_slices_add_up),
        cmocka_unit_test(arc_uniform_error),
        cmocka_unit_test(arc_bent_error),
        cmocka_unit_test(multi_bounce_is_the_printed_cubic),
        cmocka_unit_test(multi_bounce_series_is_the_sum_of_bounces),
        cmocka_unit_test(pack_round_trip),
        cmocka_unit_test(pack_layout),
        cmocka_unit_test(memo_noise_directions),
        cmocka_unit_test(memo_noise_rows),
        cmocka_unit_test(memo_noise_offsets),
        cmocka_unit_test(memo_noise_is_the_printed_one),
        cmocka_unit_test(no_noise),
        cmocka_unit_test(hilbert_noise),
        cmocka_unit_test(hilbert_noise_over_time),
        cmocka_unit_test(camera_from_fov),
        cmocka_unit_test(camera_from_projection),
        cmocka_unit_test(camera_from_nonsense),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
