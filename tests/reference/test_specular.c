/* gtso.h against long double quadrature, nested adaptive quadrature and brute force; its tables' errors. */
#include "gtso.h"
#include "tests/reference/check.h"
#include "tests/reference/reference.h"

#include <time.h>

static const float pi_f = 3.14159265f;

/* Uniform in [low, high), from a fixed seed. */
static double between(uint64_t *seed, double low, double high) {
    *seed ^= *seed << 13;
    *seed ^= *seed >> 7;
    *seed ^= *seed << 17;
    return low + (high - low) * (double)(*seed >> 11) / 9007199254740992.0;
}
static const uint64_t start = 88172645463325252u;

static void keep_largest(double *largest, double value) {
    if (!(value <= *largest))
        *largest = value;
}

/* ---- caps ---- */

static double cap_error(float a, float b, float d) {
    const double got = (double)gtso_cap_intersection(GTSO_CAPS_EXACT, a, b, d);
    return fabs(got - (double)ref_cap_intersection((long double)a, (long double)b, (long double)d));
}

static void caps_random(void **state) {
    (void)state;
    uint64_t seed = start;
    double error = 0.0;
    /* A tenth of a million against quadrature; the other 900,000 against what needs none: symmetry and the part of the
     * other cap outside, cap(a) = (a and b) + (a and the complement of b), at the antipode. */
    for (int i = 0; i < 100000; i++)
        keep_largest(&error, cap_error((float)between(&seed, 0.0, REF_PI), (float)between(&seed, 0.0, REF_PI),
                                       (float)between(&seed, 0.0, REF_PI)));
    for (int i = 0; i < 900000; i++) {
        const float a = (float)between(&seed, 0.0, REF_PI), b = (float)between(&seed, 0.0, REF_PI);
        const float d = (float)between(&seed, 0.0, REF_PI);
        const double ab = (double)gtso_cap_intersection(GTSO_CAPS_EXACT, a, b, d);
        const double rest = (double)gtso_cap_intersection(GTSO_CAPS_EXACT, a, pi_f - b, pi_f - d);
        const double whole = 2.0 * REF_PI * (1.0 - cos((double)a));
        if (ab != (double)gtso_cap_intersection(GTSO_CAPS_EXACT, b, a, d))
            fail_msg("not symmetric at %g %g %g", (double)a, (double)b, (double)d);
        /* rounding pi - b and pi - d moves the rest by their ulp times the arc */
        if (fabs(ab + rest - whole) > 4e-6)
            fail_msg("%g + %g is not the cap %g at %g %g %g", ab, rest, whole, (double)a, (double)b, (double)d);
    }
    printf("# note: cap intersection: max error %.2g sr over 100,000 random triples\n", error);
    CHECK(error < 1e-6, "error %g", error);
}

static void caps_small_ones_keep_relative_precision(void **state) {
    (void)state;
    uint64_t seed = start;
    double error = 0.0;
    for (int i = 0; i < 2000; i++) {
        const double scale = pow(10.0, between(&seed, -4.0, -1.0));
        const float a = (float)(scale * between(&seed, 0.1, 1.0)), b = (float)(scale * between(&seed, 0.1, 1.0));
        const float d = (float)(scale * between(&seed, 0.0, 2.0));
        keep_largest(&error, cap_error(a, b, d) / (scale * scale));
    }
    CHECK(error < 1e-6, "relative to the caps: %g", error);
}

static void caps_degenerate(void **state) {
    (void)state;
    static const float angles[] = {0.0f,        1e-30f,     1e-7f,     1e-4f,      0.3f,       0.78539816f, 1.0f,
                                   1.57079625f, 1.5707963f, 1.570797f, 2.0f,       2.3561945f, 3.0f,        3.1414f,
                                   3.1415925f,  3.1415927f, 0.6f,      0.2999999f, 0.3000001f, 1.3f,        0.7f};
    enum { COUNT = sizeof angles / sizeof angles[0] };
    double error = 0.0;
    for (int i = 0; i < COUNT; i++)
        for (int j = 0; j < COUNT; j++) {
            const float a = angles[i], b = angles[j];
            const float touching[] = {a + b,
                                      fabsf(a - b),
                                      2.0f * pi_f - a - b,
                                      nextafterf(a + b, 0.0f),
                                      nextafterf(a + b, 9.0f),
                                      nextafterf(fabsf(a - b), 9.0f),
                                      a,
                                      b};
            for (int k = 0; k < COUNT + 8; k++) {
                const float d = k < COUNT ? angles[k] : touching[k - COUNT];
                if (d >= 0.0f && d <= pi_f) {
                    const double e = cap_error(a, b, d);
                    CHECK(e < 1e-6, "%.9g %.9g %.9g: off by %g", (double)a, (double)b, (double)d, e);
                    keep_largest(&error, e);
                }
            }
        }
    printf("# note: cap intersection: max error %.2g sr over degenerate triples\n", error);
}

static void caps_grow_with_each(void **state) {
    (void)state;
    uint64_t seed = start;
    for (int i = 0; i < 300; i++) {
        const float b = (float)between(&seed, 0.0, REF_PI), d = (float)between(&seed, 0.0, REF_PI);
        for (int caps = 0; caps < 3; caps++) {
            float last = -1.0f;
            for (int k = 0; k <= 600; k++) {
                const float a = pi_f * (float)k / 600.0f, now = gtso_cap_intersection((gtso_caps)caps, a, b, d);
                if (caps != GTSO_CAPS_EXACT && a > b) /* the approximations need not, once the other is the smaller */
                    break;
                CHECK(now >= last - 1e-6f, "caps %d: %.9g after %.9g at a %g b %g d %g", caps, (double)now,
                      (double)last, (double)a, (double)b, (double)d);
                last = now;
            }
        }
    }
}

static void caps_approximations(void **state) {
    (void)state;
    static const char *const names[] = {"exact", "Oat", "smoothstep"};
    for (int caps = 1; caps < 3; caps++) {
        uint64_t seed = start;
        double sum = 0.0, largest = 0.0;
        enum { COUNT = 100000 };
        for (int i = 0; i < COUNT; i++) {
            const float av = 0.5f * pi_f * (float)between(&seed, 0.0, 1.0);
            const float as = gtso_lobe_aperture(GTSO_FIT_JIMENEZ, (float)between(&seed, 0.0, 1.0));
            const float beta = pi_f * (float)between(&seed, 0.0, 1.0);
            const double e = fabs((double)gtso_cone_visibility((gtso_caps)caps, av, as, beta) -
                                  (double)gtso_cone_visibility(GTSO_CAPS_EXACT, av, as, beta));
            sum += e;
            keep_largest(&largest, e);
        }
        printf("# note: V_s of cones, %s: mean error %.4f, max %.3f\n", names[caps], sum / COUNT, largest);
        CHECK(sum / COUNT < (caps == 1 ? 0.01 : 0.025) && largest < (caps == 1 ? 0.17 : 0.46), "%s: mean %g, max %g",
              names[caps], sum / COUNT, largest);
    }
}

/* ---- lobes ---- */

static void lobe_at(ref_lobe *lobe, gtso_lobe kind, float roughness, double view) {
    static const int kinds[] = {REF_BRDF, REF_GGX, REF_BECKMANN, REF_BLINN, REF_PHONG};
    memset(lobe, 0, sizeof *lobe);
    lobe->kind = kinds[kind];
    lobe->alpha = (double)roughness * (double)roughness;
    lobe->f0 = 0.04;
    lobe->n[2] = 1.0;
    lobe->v[0] = sin(view);
    lobe->v[2] = cos(view);
}

static void lobes_against_quadrature(void **state) {
    (void)state;
    static const char *const names[] = {"BRDF", "GGX", "Beckmann", "Blinn-Phong", "Phong"};
    for (int kind = 0; kind < 5; kind++) {
        uint64_t seed = start + (uint64_t)kind;
        double largest = 0.0, square = 0.0;
        const int count = kind == GTSO_LOBE_PHONG ? 8 : 120;
        for (int i = 0; i < count; i++) {
            const float r = (float)between(&seed, kind == GTSO_LOBE_PHONG ? 0.35 : 0.2, 1.0);
            const float av = (float)between(&seed, 0.0, 1.57);
            const gtso_frame frame = (gtso_frame)(i % 2);
            const float beta = (float)between(&seed, 0.0, frame == GTSO_FRAME_BENT ? 1.5 : 2.5);
            ref_lobe lobe;
            double b[3] = {0.0, 0.0, 1.0}, truth, e;
            if (frame == GTSO_FRAME_REFLECTION) {
                b[0] = sin((double)beta);
                b[2] = cos((double)beta);
            }
            lobe_at(&lobe, (gtso_lobe)kind, r, frame == GTSO_FRAME_BENT ? (double)beta : 0.0);
            truth = ref_lobe_integral(&lobe, b, (double)av) / ref_lobe_integral(&lobe, lobe.n, REF_PI / 2.0);
            e = fabs((double)gtso_lobe_visibility((gtso_lobe)kind, frame, av, beta, r) - truth);
            CHECK(e < 3e-4, "%s frame %d: off by %g at aperture %g beta %g roughness %g", names[kind], (int)frame, e,
                  (double)av, (double)beta, (double)r);
            keep_largest(&largest, e);
            square += e * e;
        }
        printf("# note: V_s of the %s lobe: RMS error %.1e, max %.1e\n", names[kind], sqrt(square / count), largest);
        CHECK(sqrt(square / count) < 4e-5, "%s: RMS error %g", names[kind], sqrt(square / count));
    }
}

/* Any bent normal, any view; and V_s times the environment BRDF is the occluded integral of a white dome. */
static void white_dome(void **state) {
    (void)state;
    uint64_t seed = start;
    double largest = 0.0, square = 0.0, env_error = 0.0, identity = 0.0;
    enum { COUNT = 150 };
    for (int i = 0; i < COUNT; i++) {
        const double view = between(&seed, 0.0, 1.5), c = sqrt(between(&seed, 0.0, 1.0));
        const double phi = between(&seed, 0.0, 2.0 * REF_PI), s = sqrt(1.0 - c * c);
        const float av = (float)between(&seed, 0.0, 1.57), r = (float)between(&seed, 0.05, 1.0);
        const float f0 = i % 2 ? 0.04f : 0.9f;
        const float n[3] = {0.0f, 0.0f, 1.0f}, v[3] = {(float)sin(view), 0.0f, (float)cos(view)};
        const float bent[3] = {(float)(s * cos(phi)), (float)(s * sin(phi)), (float)c};
        const double b[3] = {s * cos(phi), s * sin(phi), c};
        double occluded, open;
        float vs, env[2], got_occluded, got_open;
        ref_lobe lobe;
        lobe_at(&lobe, GTSO_LOBE_BRDF, r, view);
        lobe.f0 = (double)f0;
        occluded = ref_lobe_integral(&lobe, b, (double)av);
        open = ref_lobe_integral(&lobe, lobe.n, REF_PI / 2.0);
        vs = gtso_brdf_visibility(n, v, bent, av, r, f0, &got_occluded, &got_open);
        gtso_env_brdf(v[2], r, env);
        keep_largest(&largest, fabs((double)vs - occluded / open));
        square += pow((double)vs - occluded / open, 2.0);
        keep_largest(&env_error, fabs((double)(f0 * env[0] + env[1]) - open));
        keep_largest(&identity, fabs((double)(vs * (f0 * env[0] + env[1])) - occluded));
        CHECK_NEAR(got_occluded, vs * got_open, 1e-6, "the parts of V_s");
        CHECK_NEAR(vs, occluded / open, 3e-4, "V_s of the BRDF at r %.9g view %.9g av %.9g b %.9g %.9g %.9g f0 %g",
                   (double)r, view, (double)av, b[0], b[1], b[2], (double)f0);
    }
    printf("# note: V_s of the full BRDF: RMS error %.1e, max %.1e; environment BRDF: max %.1e; identity: %.1e\n",
           sqrt(square / COUNT), largest, env_error, identity);
    CHECK(env_error < 1e-4, "environment BRDF off by %g", env_error);
    CHECK(identity < 1e-4, "white-dome identity off by %g", identity);
    CHECK(sqrt(square / COUNT) < 4e-5, "RMS error %g", sqrt(square / COUNT));
}

static void brdf_value(void **state) {
    (void)state;
    uint64_t seed = start;
    for (int i = 0; i < 5000; i++) {
        const double view = between(&seed, 0.0, 1.55), polar = between(&seed, 0.0, 1.8);
        const double phi = between(&seed, 0.0, 2.0 * REF_PI);
        const float r = (float)between(&seed, 0.1, 1.0);
        const float n[3] = {0.0f, 0.0f, 1.0f}, v[3] = {(float)sin(view), 0.0f, (float)cos(view)};
        const float l[3] = {(float)(sin(polar) * cos(phi)), (float)(sin(polar) * sin(phi)), (float)cos(polar)};
        const double d[3] = {sin(polar) * cos(phi), sin(polar) * sin(phi), cos(polar)};
        ref_lobe lobe;
        double value;
        lobe_at(&lobe, GTSO_LOBE_BRDF, r, view);
        value = ref_lobe_value(&lobe, d);
        CHECK_NEAR(gtso_brdf(n, v, l, r, 0.04f), value, 1e-6 + 1e-4 * value, "BRDF");
    }
}

/* ---- horizons ---- */

enum { SLICES = 16 };

typedef struct pixel {
    float normal[3], view[3], bent[3], visibility, roughness;
    gtso_slice slices[SLICES];
} pixel;

/* A pixel seen along +z with occluders around it that rise, above the tangent plane, by a random smooth elevation. */
static pixel random_pixel(uint64_t *seed) {
    pixel p;
    const double tilt = acos(1.0 - 0.97 * between(seed, 0.0, 1.0)), turn = between(seed, 0.0, 2.0 * REF_PI);
    const double base = between(seed, 0.0, 1.2);
    const double n[3] = {sin(tilt) * cos(turn), sin(tilt) * sin(turn), cos(tilt)};
    double amplitude[4], phase[4], sum = 0.0, bent[3] = {0.0, 0.0, 0.0}, length = 0.0;
    memset(&p, 0, sizeof p);
    for (int k = 0; k < 4; k++) {
        amplitude[k] = between(seed, 0.0, 1.0 / (2.0 + k));
        phase[k] = between(seed, 0.0, 2.0 * REF_PI);
    }
    p.view[2] = 1.0f;
    p.roughness = (float)between(seed, 0.05, 1.0);
    for (int k = 0; k < SLICES; k++)
        for (int side = 0; side < 2; side++) {
            const double phi = REF_PI * k / SLICES + side * REF_PI;
            const double o[2] = {cos(phi), sin(phi)}, along = n[0] * o[0] + n[1] * o[1];
            double rise = base, horizon;
            for (int q = 0; q < 4; q++)
                rise += amplitude[q] * sin((q + 1) * phi + phase[q]);
            horizon = atan2(along, n[2]) + REF_PI / 2.0 - (rise > 0.0 ? rise : 0.0);
            horizon = horizon < 0.0 ? 0.0 : horizon;
            if (side == 0) {
                p.slices[k].direction[0] = (float)o[0];
                p.slices[k].direction[1] = (float)o[1];
                p.slices[k].h1_rad = (float)horizon;
            } else {
                p.slices[k].h0_rad = -(float)horizon;
            }
            for (int i = 0; i < 64; i++) { /* [J19] cosine-weighted */
                const double theta = (i + 0.5) / 64.0 * horizon,
                             l[3] = {sin(theta) * o[0], sin(theta) * o[1], cos(theta)};
                double w = l[0] * n[0] + l[1] * n[1] + l[2] * n[2];
                w = (w > 0.0 ? w : 0.0) * sin(theta) * horizon / 64.0 * REF_PI / SLICES;
                sum += w / REF_PI;
                for (int j = 0; j < 3; j++)
                    bent[j] += w * l[j];
            }
        }
    for (int j = 0; j < 3; j++)
        length += bent[j] * bent[j];
    for (int j = 0; j < 3; j++) {
        p.normal[j] = (float)n[j];
        p.bent[j] = length > 1e-12 ? (float)(bent[j] / sqrt(length)) : (float)n[j];
    }
    p.visibility = (float)(sum < 1.0 ? sum : 1.0);
    return p;
}

static void horizons_against_brute_force(void **state) {
    (void)state;
    enum { POLAR = 600, AZIMUTH = 640 };
    uint64_t seed = start;
    double largest = 0.0;
    for (int i = 0; i < 12; i++) {
        pixel p = random_pixel(&seed);
        ref_lobe lobe;
        double visible = 0.0, whole = 0.0;
        float occluded, open, vs;
        memset(&lobe, 0, sizeof lobe);
        p.roughness = 0.4f + 0.6f * p.roughness;
        lobe.kind = REF_BRDF;
        lobe.alpha = (double)p.roughness * (double)p.roughness;
        lobe.f0 = 0.04;
        lobe.v[2] = 1.0;
        for (int k = 0; k < 3; k++)
            lobe.n[k] = (double)p.normal[k];
        for (int j = 0; j < AZIMUTH; j++) {
            const double phi = 2.0 * REF_PI * (j + 0.5) / AZIMUTH;
            /* nearest slice in azimuth */
            const int half = (int)floor(phi / REF_PI * SLICES + 0.5) % (2 * SLICES);
            const double limit =
                half < SLICES ? (double)p.slices[half].h1_rad : -(double)p.slices[half - SLICES].h0_rad;
            for (int k = 0; k < POLAR; k++) {
                const double theta = REF_PI * (k + 0.5) / POLAR;
                const double l[3] = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
                const double value = ref_lobe_value(&lobe, l) * sin(theta);
                whole += value;
                visible += theta < limit ? value : 0.0;
            }
        }
        vs = gtso_horizon_visibility(p.normal, p.view, p.slices, SLICES, p.roughness, 0.04f, &occluded, &open);
        keep_largest(&largest, fabs((double)vs - visible / whole));
        CHECK_NEAR(vs, visible / whole, 4e-3, "V_s against horizons");
        CHECK_NEAR(open, whole * REF_PI / POLAR * 2.0 * REF_PI / AZIMUTH, 1e-3, "open integral");
    }
    printf("# note: horizons against a grid of 384,000 directions: max error %.1e\n", largest);
}

/* Open on all sides it is the environment BRDF, which integrates about the normal instead of the view. */
static void open_horizons(void **state) {
    (void)state;
    uint64_t seed = start;
    double largest = 0.0;
    for (int i = 0; i < 300; i++) {
        pixel p = random_pixel(&seed);
        const int count = 1 + i % SLICES;
        float open, occluded, env[2];
        gtso_slice slices[SLICES];
        for (int k = 0; k < count; k++) {
            slices[k].direction[0] = (float)cos(0.3 + REF_PI * k / count);
            slices[k].direction[1] = (float)sin(0.3 + REF_PI * k / count);
            slices[k].direction[2] = 0.0f;
            slices[k].h0_rad = -pi_f;
            slices[k].h1_rad = pi_f;
        }
        CHECK(gtso_horizon_visibility(p.normal, p.view, slices, count, p.roughness, 0.04f, &occluded, &open) == 1.0f,
              "open horizons, but V_s is not 1");
        gtso_env_brdf(p.normal[2], p.roughness, env);
        keep_largest(&largest, fabs((double)open - (double)(0.04f * env[0] + env[1])));
    }
    printf("# note: open horizons against the environment BRDF: max difference %.1e\n", largest);
    CHECK(largest < 1e-4, "%g", largest);
}

/* ---- how near each approximation comes ---- */

static double lagarde(double nv, double visibility, double alpha) {
    const double v = pow(nv + visibility, exp2(-16.0 * alpha - 1.0)) - 1.0 + visibility;
    return v < 0.0 ? 0.0 : v > 1.0 ? 1.0 : v;
}

/* The slides' order, near silhouettes and in all: nothing, visibility itself, Lagarde, cone/cone, cone/lobe, full. */
static void approximations_against_horizons(void **state) {
    (void)state;
    enum { NONE, AO, LAGARDE, CONE, CONE_OAT, CONE_SMOOTH, LOBE, BRDF, VIEW, HONEST, METHODS, COUNT = 1500 };
    static const char *const names[] = {"none",
                                        "visibility as it is",
                                        "Lagarde",
                                        "cone/cone, exact",
                                        "cone/cone, Oat",
                                        "cone/cone, smoothstep",
                                        "cone/lobe [J16], GGX about R",
                                        "cone/BRDF, n = b (default)",
                                        "cone/BRDF, 4 axes",
                                        "cone/BRDF, any bent normal"};
    uint64_t seed = start;
    double square[METHODS] = {0.0}, grazing[METHODS] = {0.0};
    int near_silhouette = 0;
    gtso_table_desc four;
    memset(&four, 0, sizeof four);
    four.kind = GTSO_KIND_BRDF;
    for (int i = 0; i < COUNT; i++) {
        const pixel p = random_pixel(&seed);
        const double truth =
            (double)gtso_horizon_visibility(p.normal, p.view, p.slices, SLICES, p.roughness, 0.04f, NULL, NULL);
        double nb = 0.0, rb = 0.0, value[METHODS];
        gtso_point at;
        float lobe;
        for (int k = 0; k < 3; k++) {
            nb += (double)p.normal[k] * (double)p.bent[k];
            rb += (2.0 * (double)p.normal[2] * (double)p.normal[k] - (double)p.view[k]) * (double)p.bent[k];
        }
        at.aperture_rad = acosf(gtso_cos_aperture_tilted(p.visibility, (float)nb));
        at.beta_rad = (float)acos(rb > 1.0 ? 1.0 : rb < -1.0 ? -1.0 : rb);
        at.roughness = p.roughness;
        at.view_rad = acosf(p.normal[2]);
        at.azimuth_rad = 0.0f;
        lobe = gtso_lobe_aperture(GTSO_FIT_JIMENEZ, p.roughness);
        value[NONE] = 1.0;
        value[AO] = (double)p.visibility;
        value[LAGARDE] = lagarde((double)p.normal[2], (double)p.visibility, pow((double)p.roughness, 2.0));
        for (int caps = 0; caps < 3; caps++)
            value[CONE + caps] = (double)gtso_cone_visibility((gtso_caps)caps, at.aperture_rad, lobe, at.beta_rad);
        value[LOBE] = (double)gtso_lobe_visibility(GTSO_LOBE_GGX, GTSO_FRAME_REFLECTION, at.aperture_rad, at.beta_rad,
                                                   p.roughness);
        value[BRDF] =
            (double)gtso_lobe_visibility(GTSO_LOBE_BRDF, GTSO_FRAME_BENT, at.aperture_rad, at.beta_rad, p.roughness);
        value[VIEW] = (double)gtso_table_exact(&four, &at);
        value[HONEST] =
            (double)gtso_brdf_visibility(p.normal, p.view, p.bent, at.aperture_rad, p.roughness, 0.04f, NULL, NULL);
        near_silhouette += p.normal[2] < 0.35f;
        for (int m = 0; m < METHODS; m++) {
            square[m] += pow(value[m] - truth, 2.0);
            grazing[m] += p.normal[2] < 0.35f ? pow(value[m] - truth, 2.0) : 0.0;
        }
    }
    for (int m = 0; m < METHODS; m++) {
        square[m] = sqrt(square[m] / COUNT);
        grazing[m] = sqrt(grazing[m] / near_silhouette);
        printf("# note: %-30s RMSE %.4f, near silhouettes %.4f\n", names[m], square[m], grazing[m]);
    }
    CHECK(square[CONE] < square[AO] && square[CONE] < square[LAGARDE], "cone/cone is worse than a guess");
    CHECK(square[LOBE] < square[CONE] && grazing[LOBE] < grazing[CONE], "cone/lobe does not beat cone/cone");
    CHECK(square[BRDF] < 0.9 * square[LOBE] && grazing[BRDF] < 0.9 * grazing[LOBE],
          "the full BRDF does not beat its distribution");
    CHECK(square[VIEW] < square[BRDF] && fabs(square[VIEW] - square[HONEST]) < 0.005,
          "the view angle does not help, or the bent normal's azimuth would");
}

/* ---- tables ---- */

static double seconds(void) {
    return (double)clock() / CLOCKS_PER_SEC;
}

/* Through BC4 as volumes are stored: 4 x 4 blocks of each slice. */
static void through_bc4(const gtso_table_desc *t, const float *data, float *out) {
    const int width = t->size[0], height = t->size[1], depth = gtso_table_rows(t) / height;
    for (int z = 0; z < depth; z++)
        for (int y = 0; y < height; y += 4)
            for (int x = 0; x < width; x += 4) {
                float texels[16];
                uint8_t block[8];
                for (int k = 0; k < 16; k++)
                    texels[k] = data[(z * height + y + k / 4) * width + x + k % 4];
                gtso_bc4_encode_block(texels, block);
                gtso_bc4_decode_block(block, texels);
                for (int k = 0; k < 16; k++)
                    out[(z * height + y + k / 4) * width + x + k % 4] = texels[k];
            }
}

typedef struct errors {
    double as_float, unorm8, bc4, seconds, largest;
} errors;

/* Point i of the R5 sequence: evenly spread, so that the rare large errors weigh what they should. */
static void spread(int i, double x[5]) {
    double step = 1.0;
    for (int k = 0; k < 5; k++) {
        step /= 1.1347241384015194;
        x[k] = fmod(0.5 + (i + 1) * step, 1.0);
    }
}

/* RMSE over points uniform in aperture, roughness, and, for three axes, beta in [0, pi/2]; for four, bent normals up to
 * 60 degrees off the normal and uniform view angles. */
static errors measure(gtso_table_desc t, int count) {
    const size_t cells = gtso_table_count(&t);
    float *data = (float *)malloc(3 * cells * sizeof(float)), *eight = data + cells, *blocks = eight + cells;
    errors e = {0.0, 0.0, 0.0, 0.0, 0.0};
    double before = seconds();
    assert_int_equal(gtso_table_resolve(&t, &t), GTSO_OK);
    assert_int_equal(gtso_bake(&t, data, NULL), GTSO_OK);
    e.seconds = seconds() - before;
    for (size_t i = 0; i < cells; i++)
        eight[i] = (float)(int)(data[i] * 255.0f + 0.5f) / 255.0f;
    through_bc4(&t, data, blocks);
    for (int i = 0; i < count; i++) {
        gtso_point p;
        double exact, x[5];
        spread(i, x);
        p.aperture_rad = (float)(x[0] * REF_PI / 2.0);
        p.beta_rad = (float)(x[1] * REF_PI / 2.0);
        p.roughness = (float)x[2];
        p.view_rad = (float)(x[3] * REF_PI / 2.0);
        p.azimuth_rad = 0.0f;
        if (t.kind == GTSO_KIND_BRDF) {
            const double tilt = x[1] * REF_PI / 3.0, turn = 2.0 * REF_PI * x[4];
            const double c = cos((double)p.view_rad) * cos(tilt) - sin((double)p.view_rad) * sin(tilt) * cos(turn);
            p.beta_rad = (float)acos(c);
        }
        exact = (double)gtso_table_exact(&t, &p);
        e.as_float += pow((double)gtso_table_sample(&t, data, &p) - exact, 2.0);
        e.unorm8 += pow((double)gtso_table_sample(&t, eight, &p) - exact, 2.0);
        e.bc4 += pow((double)gtso_table_sample(&t, blocks, &p) - exact, 2.0);
        keep_largest(&e.largest, fabs((double)gtso_table_sample(&t, data, &p) - exact));
    }
    e.as_float = sqrt(e.as_float / count);
    e.unorm8 = sqrt(e.unorm8 / count);
    e.bc4 = sqrt(e.bc4 / count);
    free(data);
    return e;
}

static void table_errors(void **state) {
    (void)state;
    static const struct {
        const char *name;
        gtso_kind kind;
        gtso_lobe lobe;
        gtso_frame frame;
        int size;
        double unorm8;
    } tables[] = {
        {"full BRDF, n = b", GTSO_KIND_LOBE, GTSO_LOBE_BRDF, GTSO_FRAME_BENT, 32, 0.004},
        {"full BRDF, n = b", GTSO_KIND_LOBE, GTSO_LOBE_BRDF, GTSO_FRAME_BENT, 16, 0.010},
        {"GGX about R", GTSO_KIND_LOBE, GTSO_LOBE_GGX, GTSO_FRAME_REFLECTION, 32, 0.004},
        {"GGX about R", GTSO_KIND_LOBE, GTSO_LOBE_GGX, GTSO_FRAME_REFLECTION, 16, 0.008},
        {"cone/cone", GTSO_KIND_CONE, GTSO_LOBE_BRDF, GTSO_FRAME_BENT, 32, 0.004},
        {"full BRDF, 4 axes", GTSO_KIND_BRDF, GTSO_LOBE_BRDF, GTSO_FRAME_BENT, 16, 0.006},
    };
    for (size_t i = 0; i < sizeof tables / sizeof tables[0]; i++) {
        gtso_table_desc t;
        errors e;
        memset(&t, 0, sizeof t);
        t.kind = tables[i].kind;
        t.lobe = tables[i].lobe;
        t.frame = tables[i].frame;
        for (int k = 0; k < 4; k++)
            t.size[k] = tables[i].size;
        e = measure(t, 60000);
        printf("# note: %-18s %d^%d: RMSE float %.4f, 8 bits %.4f, BC4 %.4f, max %.2f; baked in %.2f s\n",
               tables[i].name, tables[i].size, gtso_table_axes(&t), e.as_float, e.unorm8, e.bc4, e.largest, e.seconds);
        CHECK(e.unorm8 < tables[i].unorm8, "%s %d: 8-bit RMSE %g", tables[i].name, tables[i].size, e.unorm8);
        CHECK(e.bc4 < e.unorm8 + 0.003, "%s %d: BC4 adds %g", tables[i].name, tables[i].size, e.bc4 - e.unorm8);
        /* Debuggers, sanitizers and coverage are slower. */
#if defined(__OPTIMIZE__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
        if (gtso_table_axes(&t) == 3)
            CHECK(e.seconds < 2.0, "%s %d: baked in %g s", tables[i].name, tables[i].size, e.seconds);
#endif
    }
}

/* No other scale is better than the default by more than so few points can tell, and most are far worse. */
static void scales(void **state) {
    (void)state;
    static const char *const names[] = {"default", "angle", "cosine", "half sine", "edge", "roughness", "alpha"};
    gtso_table_desc t;
    double best;
    memset(&t, 0, sizeof t);
    t.size[0] = t.size[1] = t.size[2] = 16;
    best = measure(t, 8000).as_float;
    for (int axis = 0; axis < 3; axis++)
        for (int scale = 1; scale < GTSO_SCALE_COUNT; scale++) {
            gtso_table_desc other = t, resolved;
            double rmse;
            other.scale[axis] = (gtso_scale)scale;
            if (gtso_table_resolve(&other, &resolved) != GTSO_OK)
                continue;
            rmse = measure(other, 8000).as_float;
            printf("# note: 16^3, %s by %s: RMSE %.4f\n",
                   axis == 0   ? "aperture"
                   : axis == 1 ? "beta"
                               : "roughness",
                   names[scale], rmse);
            CHECK(rmse >= 0.93 * best, "axis %d: %s does better than the default, %g < %g", axis, names[scale], rmse,
                  best);
        }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(caps_random),
        cmocka_unit_test(caps_small_ones_keep_relative_precision),
        cmocka_unit_test(caps_degenerate),
        cmocka_unit_test(caps_grow_with_each),
        cmocka_unit_test(caps_approximations),
        cmocka_unit_test(lobes_against_quadrature),
        cmocka_unit_test(white_dome),
        cmocka_unit_test(brdf_value),
        cmocka_unit_test(horizons_against_brute_force),
        cmocka_unit_test(open_horizons),
        cmocka_unit_test(approximations_against_horizons),
        cmocka_unit_test(table_errors),
        cmocka_unit_test(scales),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
