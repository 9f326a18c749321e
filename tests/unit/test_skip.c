/* Skips change no bit and do happen. Scenes of planes, with what is hardest for bounds: edges, creases, bumps of about the
 * size of what counts as rounding, sky, specks of anything. `test_skip N` tries N random scenes instead of 400. */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <stdio.h>

#include "inputs.h"

static const layout tight = {0, 0, 0};
static int cases = 400;

/* ---- scenes of planes ------------------------------------------------------------------------------------------ */

typedef struct facet {
    double n[3], d; /* n.P = d */
    int x0, y0, x1, y1;
} facet;

typedef struct world {
    int width, height, orthographic;
    double fx, fy, cx, cy;
    facet f[6];
    int facets;
    double bump;  /* relative */
    int sky_rows; /* rows of sky at the top */
    int specks;
} world;

static uint32_t seed_of(uint32_t *state, uint32_t limit) {
    return next_random(state) % limit;
}
static double unit_of(uint32_t *state) {
    return (double)next_random(state) / 16777216.0;
}

static void world_random(world *s, uint32_t *state) {
    memset(s, 0, sizeof *s);
    s->width = 40 + (int)seed_of(state, 200);
    s->height = 20 + (int)seed_of(state, 100);
    s->orthographic = seed_of(state, 4) == 0;
    s->fx = (double)s->width * (seed_of(state, 5) == 0 ? 8.0 : 0.5 + unit_of(state));
    s->fy = seed_of(state, 3) == 0 ? s->fx * 1.25 : s->fx;
    s->cx = 0.5 * s->width, s->cy = 0.5 * s->height;
    if (seed_of(state, 4) == 0)
        s->cx *= 1.5, s->cy *= 0.25;
    s->facets = seed_of(state, 2) ? 1 : 1 + (int)seed_of(state, 4);
    for (int i = 0; i < s->facets; i++) {
        facet *f = &s->f[i];
        double tilt = seed_of(state, 3) == 0 ? 3.0 : 0.5;
        f->n[0] = tilt * (unit_of(state) - 0.5) * (seed_of(state, 3) ? 1 : 0);
        f->n[1] = tilt * (unit_of(state) - 0.5) * (seed_of(state, 3) ? 1 : 0);
        f->n[2] = -1.0;
        f->d = -(3.0 + (seed_of(state, 2) ? 8.0 * unit_of(state) : 0.0));
        f->x0 = i ? (int)seed_of(state, (uint32_t)s->width) : 0, f->x1 = i ? f->x0 + (int)seed_of(state, 90) : s->width;
        f->y0 = i ? (int)seed_of(state, (uint32_t)s->height) : 0;
        f->y1 = i ? f->y0 + (int)seed_of(state, 60) : s->height;
    }
    for (int i = 1; i < s->facets; i++) { /* half of them cross the first one's plane where they are */
        facet *f = &s->f[i];
        double scale = s->orthographic ? 3.0 : 1.0, x = scale * (0.5 * (f->x0 + f->x1) - s->cx) / s->fx,
               y = scale * (0.5 * (f->y0 + f->y1) - s->cy) / s->fy, z;
        if (seed_of(state, 2))
            continue;
        if (s->orthographic) {
            z = (s->f[0].d - s->f[0].n[0] * x - s->f[0].n[1] * y) / s->f[0].n[2];
            f->d = f->n[0] * x + f->n[1] * y + f->n[2] * z;
        } else {
            z = s->f[0].d / (s->f[0].n[0] * x + s->f[0].n[1] * y + s->f[0].n[2]);
            f->d = z * (f->n[0] * x + f->n[1] * y + f->n[2]);
        }
    }
    s->bump = seed_of(state, 3) ? 0.0 : 1e-8 * (double)(1u << seed_of(state, 20));
    s->sky_rows = seed_of(state, 3) ? 0 : (int)seed_of(state, (uint32_t)s->height);
    s->specks = seed_of(state, 4) == 0;
}

/* Depth and unit normal of a pixel. */
static float world_at(const world *s, int x, int y, uint32_t seed, float n[3]) {
    static const uint32_t odd[] = {0x7FC00000u, 0x7F800000u, 0xFF800000u, 0,           0x80000000u, 1,
                                   0x7F7FFFFFu, 0x0DA24260u, 0x7149F2CAu, 0x3F800000u, 0x40A00000u, 0x00800000u};
    const facet *f = &s->f[0];
    double rx = ((double)x + 0.5 - s->cx) / s->fx, ry = ((double)y + 0.5 - s->cy) / s->fy, z, length;
    uint32_t h = hash_cell(x, y, seed);
    n[0] = n[1] = 0.0f, n[2] = -1.0f;
    for (int i = 1; i < s->facets; i++)
        if (x >= s->f[i].x0 && x < s->f[i].x1 && y >= s->f[i].y0 && y < s->f[i].y1)
            f = &s->f[i];
    if (s->specks && (h & 255u) == 0) {
        float z_odd = float_from_bits(odd[h >> 8 & 7u]);
        if ((h >> 16 & 7u) == 0)
            n[0] = z_odd;
        return (h >> 16 & 1u) ? float_from_bits(odd[(h >> 8) % 12u]) : z_odd;
    }
    if (y < s->sky_rows)
        return float_inf();
    if (s->orthographic)
        z = (f->d - f->n[0] * rx * 3.0 - f->n[1] * ry * 3.0) / f->n[2];
    else
        z = f->d / (f->n[0] * rx + f->n[1] * ry + f->n[2]);
    z *= 1.0 + s->bump * ((double)(h & 0xFFFFu) / 65536.0 - 0.5);
    length = sqrt(f->n[0] * f->n[0] + f->n[1] * f->n[1] + f->n[2] * f->n[2]);
    for (int i = 0; i < 3; i++)
        n[i] = (float)(f->n[i] / length);
    return z > 0.0 && z < 1e6 ? (float)z : float_inf();
}

typedef struct buffers {
    float *depth, *normals, *turned, *back; /* turned: in other axes, four floats each */
    uint8_t *mask;
    gtao_layer layer;
    float *behind;
} buffers;

/* Normals are stored in axes turned about two of them, and upside down: y = axes (M stored). */
static const float turn[9] = {0.6f, 0.8f, 0.0f, -0.48f, 0.36f, 0.8f, 0.64f, -0.48f, 0.6f}, turn_axes[3] = {1, -1, -1};

static float turn_of(const float n[3], int k) {
    double sum = 0.0;
    for (int i = 0; i < 3; i++)
        sum += (double)turn[3 * i + k] * (double)turn_axes[i] * (double)n[i];
    return (float)sum;
}

static void buffers_fill(buffers *b, const world *s, uint32_t seed) {
    size_t n = (size_t)s->width * (size_t)s->height;
    b->depth = (float *)malloc(n * 4), b->normals = (float *)malloc(n * 12);
    b->turned = (float *)malloc(n * 16), b->mask = (uint8_t *)malloc(n);
    b->behind = (float *)malloc(n * 4);
    if (!b->depth || !b->normals || !b->turned || !b->mask || !b->behind)
        abort();
    for (int y = 0; y < s->height; y++)
        for (int x = 0; x < s->width; x++) {
            size_t i = (size_t)y * (size_t)s->width + (size_t)x;
            b->depth[i] = world_at(s, x, y, seed, b->normals + 3 * i);
            for (int k = 0; k < 4; k++)
                b->turned[4 * i + (size_t)k] = k == 3 ? (float)(i % 7) : turn_of(b->normals + 3 * i, k);
            b->mask[i] = (uint8_t)(hash_cell(x / 9, y / 7, seed) & 3u);
            b->behind[i] = b->depth[i] + (float)(hash_cell(x / 30, y / 30, seed + 1) & 7u) * 0.25f - 0.2f;
        }
    memset(&b->layer, 0, sizeof b->layer);
    b->layer.depth = b->behind;
}

static void buffers_free(buffers *b) {
    free(b->depth), free(b->normals), free(b->turned), free(b->mask), free(b->behind);
}

/* Any setting. */
static void desc_random(gtao_desc *d, const world *s, const buffers *b, uint32_t *state) {
    memset(d, 0, sizeof *d);
    d->width = s->width, d->height = s->height;
    d->depth = b->depth;
    d->normals = seed_of(state, 4) ? b->normals : NULL;
    if (d->normals && seed_of(state, 3) == 0) {
        d->normals = b->turned, d->normal_components = 4;
        memcpy(d->normal_to_view, turn, sizeof turn), memcpy(d->normal_axes, turn_axes, sizeof turn_axes);
    }
    d->mask = seed_of(state, 6) ? NULL : b->mask;
    d->camera.projection = s->orthographic ? GTAO_ORTHOGRAPHIC : GTAO_PERSPECTIVE;
    d->camera.fx = (float)s->fx, d->camera.fy = (float)s->fy;
    d->camera.off_center = 1, d->camera.cx = (float)s->cx, d->camera.cy = (float)s->cy;
    d->camera.sx = (float)(3.0 / s->fx), d->camera.sy = (float)(3.0 / s->fy);
    d->border = (gtao_border)(seed_of(state, 2) ? 0 : seed_of(state, 3));
    d->radius = seed_of(state, 10) == 0 ? HUGE_VALF : 0.05f * (float)(1u << seed_of(state, 7));
    d->falloff = 0.25f * (float)seed_of(state, 5);
    d->slices = 1 + (int)seed_of(state, 4);
    d->steps = 1 + (int)seed_of(state, 12);
    d->every_pixel = seed_of(state, 4) == 0;
    d->max_radius_px = seed_of(state, 3) ? 0 : 1 + (int)seed_of(state, 60);
    d->noise = (gtao_noise)(seed_of(state, 2) ? 0 : seed_of(state, 3));
    d->frame = seed_of(state, 30);
    d->weighting = (gtao_weighting)(seed_of(state, 5) == 0);
    if (seed_of(state, 8) == 0)
        d->estimator = GTAO_ESTIMATOR_MEMO;
    else if (seed_of(state, 8) == 0)
        d->thin_blend = 0.25f;
    else if (seed_of(state, 4) == 0) {
        d->thickness = 0.05f * (float)(1u << seed_of(state, 5));
        if (seed_of(state, 2))
            d->back = b->behind;
        if (seed_of(state, 2))
            d->layers = &b->layer, d->layer_count = 1;
    }
}

/* The whole image, in ranges of `cut` rows. */
static void compute(const gtao_desc *d, result *r, int cut, gtao_stats *stats) {
    gtao_context *context = NULL;
    memset(r->scratch, 0xFF, r->scratch_size);
    assert_int_equal(gtao_begin(d, &r->output, r->scratch, r->scratch_size, &context), GTAO_OK);
    for (int y = 0; y < d->height; y += cut)
        gtao_prepare_rows(context, y, y + cut);
    for (int y = 0; y < d->height; y += cut)
        gtao_visibility_rows(context, y, y + cut, stats);
}

static void random_scenes(void **state) {
    uint32_t random = 20261122u, seed;
    gtao_stats total = {0};
    (void)state;
    for (int k = 0; k < cases; k++) {
        static const int cuts[] = {1000, 1000, 64, 24, 16, 13, 40};
        static const unsigned subsets[] = {0, GTAO_SKIP_ALL & ~GTAO_SKIP_SKY, GTAO_SKIP_ALL & ~GTAO_SKIP_OPEN,
                                           GTAO_SKIP_ALL & ~GTAO_SKIP_SECTORS, GTAO_SKIP_ALL & ~GTAO_SKIP_RADIUS};
        world s;
        buffers b;
        gtao_desc d;
        result none, r;
        gtao_stats all = {0};
        int want = WANT_VISIBILITY, cut;
        float *signal[2] = {NULL, NULL};
        seed = random;
        world_random(&s, &random);
        buffers_fill(&b, &s, seed);
        desc_random(&d, &s, &b, &random);
        if (seed_of(&random, 3) == 0)
            want |= WANT_BENT | (seed_of(&random, 2) ? WANT_SH : 0);
        d.isa = GTAO_ISA_AUTO;
        d.no_skip = GTAO_SKIP_ALL;
        none = result_make(&d, want, GTAO_FORMAT_FLOAT, 3, tight, 0);
        r = result_make(&d, want, GTAO_FORMAT_FLOAT, 3, tight, 0);
        if (seed_of(&random, 4) == 0)
            for (int i = 0; i < 2; i++) {
                result *to = i ? &r : &none;
                to->output.signal = signal[i] = (float *)malloc((size_t)d.width * (size_t)d.height * 20);
                to->output.signal_planes = want & WANT_BENT ? 5 : 2;
            }
        compute(&d, &none, 1000, &all);
        assert_true(all.open == 0 && all.samples_skipped == 0 && all.sky_skipped == 0 && all.radius_skipped == 0);
        cut = cuts[seed_of(&random, 7)];
        for (int i = 0; i < 5; i++) {
            gtao_stats some = {0};
            d.no_skip = subsets[i];
            if (i == 0) { /* any instruction set */
                gtao_isa isa = (gtao_isa)(1 + seed_of(&random, 5));
                d.isa = gtao_isa_available(isa) ? isa : GTAO_ISA_AUTO;
            }
            compute(&d, &r, i == 0 ? cut : 1000, &some);
            if (!result_equal(&none, &r) ||
                (signal[0] && memcmp(signal[0], signal[1],
                                     (size_t)d.width * (size_t)d.height * 4 * (size_t)r.output.signal_planes) != 0))
                fail_msg("scene %d (seed %u), without skips %u: other bits", k, seed, subsets[i]);
            assert_true(some.pixels == all.pixels && some.sky == all.sky && some.masked == all.masked);
            total.open += some.open, total.samples_skipped += some.samples_skipped;
            total.sky_skipped += some.sky_skipped, total.pixels += some.pixels, total.samples += some.samples;
        }
        free(signal[0]), free(signal[1]);
        result_free(&none), result_free(&r);
        buffers_free(&b);
    }
    print_message("open %.1f %%, sky skipped %.1f %%, samples skipped %.1f %%\n",
                  100.0 * (double)total.open / (double)total.pixels,
                  100.0 * (double)total.sky_skipped / (double)total.pixels,
                  100.0 * (double)total.samples_skipped / (double)(total.samples + total.samples_skipped));
    assert_true(total.open > total.pixels / 50 && total.sky_skipped > total.pixels / 50);
    assert_true(total.samples_skipped > total.samples / 30);
}

/* A tolerance makes nothing darker and nothing lighter by more than itself; and it opens bumpy ground. */
static void tolerances(void **state) {
    uint32_t random = 7u;
    uint64_t open = 0, pixels = 0;
    double worst = 0.0;
    (void)state;
    for (int k = 0; k < cases / 4; k++) {
        static const float allowed[] = {0.001f, 0.004f, 0.02f, 0.1f, 0.5f, 1.0f};
        uint32_t seed = random;
        world s;
        buffers b;
        gtao_desc d;
        result exact, r;
        gtao_stats stats = {0};
        world_random(&s, &random);
        if (k % 2) /* bumps of up to a hundredth of the depth */
            s.bump = 0.01 * unit_of(&random) * unit_of(&random);
        buffers_fill(&b, &s, seed);
        desc_random(&d, &s, &b, &random);
        d.estimator = GTAO_ESTIMATOR_NORMALIZED;
        d.thin_blend = d.thickness = 0.0f, d.back = NULL, d.layer_count = 0, d.layers = NULL;
        exact = result_make(&d, WANT_VISIBILITY, GTAO_FORMAT_FLOAT, 3, tight, 0);
        compute(&d, &exact, 1000, &stats);
        d.tolerance = allowed[k % 6];
        r = result_make(&d, WANT_VISIBILITY, GTAO_FORMAT_FLOAT, 3, tight, 0);
        memset(&stats, 0, sizeof stats);
        compute(&d, &r, 1000, &stats);
        for (int y = 0; y < s.height; y++)
            for (int x = 0; x < s.width; x++) {
                float a, c;
                double more;
                memcpy(&a, plane_row(&exact.visibility, y) + 4 * (size_t)x, 4);
                memcpy(&c, plane_row(&r.visibility, y) + 4 * (size_t)x, 4);
                more = (double)c - (double)a;
                if (more < -1e-6 || more > (double)d.tolerance + 1e-6)
                    fail_msg("scene %d (seed %u), tolerance %g: %.7g became %.7g at %d, %d", k, seed,
                             (double)d.tolerance, (double)a, (double)c, x, y);
                worst = more / (double)d.tolerance > worst ? more / (double)d.tolerance : worst;
            }
        if (k % 2)
            open += stats.open, pixels += stats.pixels - stats.sky;
        result_free(&exact), result_free(&r);
        buffers_free(&b);
    }
    print_message("largest error %.2f of the tolerance; of bumpy scenes open: %.1f %%\n", worst,
                  100.0 * (double)open / (double)pixels);
    assert_true(worst > 0.3 && open > pixels / 40);
}

/* A scene of one facet, of any size. */
static world plane_world(int width, double nx, double ny, double nz, double d, int sky_rows) {
    world s;
    memset(&s, 0, sizeof s);
    s.width = width, s.height = width * 9 / 16;
    s.fx = s.fy = 0.8 * (double)width;
    s.cx = 0.5 * (double)s.width, s.cy = 0.5 * (double)s.height;
    s.f[0].n[0] = nx, s.f[0].n[1] = ny, s.f[0].n[2] = nz, s.f[0].d = d;
    s.facets = 1, s.sky_rows = sky_rows;
    return s;
}

/* What should be skipped is: planes, whatever their slant, and sky; nothing of it where one thing stands in between. */
static void planes_are_open(void **state) {
    const struct {
        const char *name;
        world s;
        double open, sky;
    } scenes[] = {
        {"wall", plane_world(640, 0, 0, -1, -6, 0), 0.99, 0},
        {"slant", plane_world(640, 0.7, 0.3, -1, -6, 0), 0.99, 0},
        {"floor under half a sky", plane_world(640, 0, -1, 0, -1.7, 0), 0.3, 0.45},
        {"wall, 2560 pixels wide", plane_world(2560, 0, 0, -1, -6, 0), 0.6, 0},
    };
    (void)state;
    for (size_t k = 0; k < sizeof scenes / sizeof *scenes; k++) {
        const world *s = &scenes[k].s;
        double pixels = (double)s->width * (double)s->height;
        buffers b;
        gtao_desc d;
        buffers_fill(&b, s, 1);
        for (int derived = 0; derived < 2; derived++)
            for (int every = 0; every < 2; every++) {
                gtao_stats stats = {0};
                result r;
                memset(&d, 0, sizeof d);
                d.width = s->width, d.height = s->height;
                d.depth = b.depth, d.normals = derived ? NULL : b.normals;
                d.camera.fx = (float)s->fx;
                d.radius = 0.5f, d.falloff = 0.25f, d.slices = 1, d.steps = 8, d.every_pixel = every;
                if (s->width > 1000 && (derived || every))
                    continue;
                r = result_make(&d, WANT_VISIBILITY, GTAO_FORMAT_FLOAT, 3, tight, 0);
                compute(&d, &r, 1000, &stats);
                if ((double)stats.open < scenes[k].open * pixels || (double)stats.sky_skipped < scenes[k].sky * pixels)
                    fail_msg("%s, %s normals, %s: open %.3f, sky skipped %.3f", scenes[k].name,
                             derived ? "derived" : "given", every ? "every pixel" : "8 steps",
                             (double)stats.open / pixels, (double)stats.sky_skipped / pixels);
                for (int y = 0; y < s->height; y++)
                    for (int x = 0; x < s->width; x++) {
                        float v;
                        memcpy(&v, plane_row(&r.visibility, y) + 4 * (size_t)x, 4);
                        if (b.depth[(size_t)y * (size_t)s->width + (size_t)x] < 50.0f)
                            assert_true(v > 0.99999f);
                    }
                result_free(&r);
            }
        buffers_free(&b);
    }
}

/* That skips change no bit. Returns what they left out, and the visibility in *exact, to be freed, if that is wanted. */
static gtao_stats skips_change_nothing(gtao_desc d, const char *what, int k, result *exact) {
    result r[2];
    gtao_stats stats[2];
    memset(stats, 0, sizeof stats);
    for (int i = 0; i < 2; i++) {
        d.no_skip = i ? GTAO_SKIP_ALL : 0;
        r[i] = result_make(&d, WANT_VISIBILITY, GTAO_FORMAT_FLOAT, 3, tight, 0);
        compute(&d, &r[i], 1000, &stats[i]);
    }
    if (!result_equal(&r[0], &r[1]))
        fail_msg("%s %d: other bits", what, k);
    result_free(&r[0]);
    if (exact)
        *exact = r[1];
    else
        result_free(&r[1]);
    return stats[0];
}

/* A floor to the horizon and cells of it that stand higher, lean or end: what their tops, tilts and distances decide is
 * decided right to the last bit, for all radii. */
static void steps_on_the_floor(void **state) {
    uint64_t open = 0, pixels = 0;
    (void)state;
    for (int k = 0; k < 96; k++) {
        world s = plane_world(448, 0, -1, 0, -1.7, 0);
        buffers b;
        gtao_desc d;
        gtao_stats stats;
        s.facets = 4;
        for (int i = 1; i < 4; i++) {
            facet *f = &s.f[i];
            double lean = ldexp(k & 1 ? 1 : -1, -3 - (k + 5 * i) % 14), x, y, z;
            *f = s.f[0];
            f->x0 = 16 * ((7 * k + 9 * i) % 26) + (k % 3 == 0 ? 5 : 0), f->y0 = 16 * (8 + (k / 4 + 2 * i) % 7);
            f->x1 = f->x0 + 16, f->y1 = f->y0 + (k % 5 == 0 ? 3 : 16);
            x = (f->x0 + 8 - s.cx) / s.fx, y = (f->y0 + 8 - s.cy) / s.fy;
            f->n[0] += k % 2 ? lean : 0, f->n[1] += k % 3 ? 0.3 * lean : 0;
            z = -1.7 / -y;
            f->d = z * (f->n[0] * x + f->n[1] * y + f->n[2]);
            if (k % 4 == 3)
                f->d += ldexp(1.7, -2 - k % 9); /* higher, without a lean */
        }
        buffers_fill(&b, &s, 1);
        memset(&d, 0, sizeof d);
        d.width = s.width, d.height = s.height;
        d.depth = b.depth, d.normals = b.normals;
        d.camera.fx = (float)s.fx;
        d.radius = 0.08f * powf(1.06f, (float)k), d.slices = 1 + k % 2, d.steps = k % 7 == 6 ? 20 : 8;
        d.falloff = k % 2 ? 0.0f : 0.25f;
        d.every_pixel = k % 6 == 5;
        stats = skips_change_nothing(d, "floor", k, NULL);
        open += stats.open, pixels += stats.pixels - stats.sky;
        buffers_free(&b);
    }
    print_message("of the floors open: %.1f %%\n", 100.0 * (double)open / (double)pixels);
    assert_true(open > pixels / 3);
}

/* Blocks in which the radius is less than a pixel, and how many pixels that are. */
static void far_away(void **state) {
    world s = plane_world(640, 0, -1, 0, -1.7, 0); /* the floor from 3 units to the horizon under half a sky */
    (void)state;
    for (int every = 0; every < 2; every++) {
        gtao_stats counts[2];
        result r[2];
        buffers b;
        gtao_desc d;
        buffers_fill(&b, &s, 1);
        memset(&d, 0, sizeof d);
        d.width = s.width, d.height = s.height;
        d.depth = b.depth, d.normals = b.normals;
        d.camera.fx = (float)s.fx;
        d.radius = 0.03f, d.slices = 1, d.steps = 8, d.every_pixel = every;
        memset(counts, 0, sizeof counts);
        for (int i = 0; i < 2; i++) {
            d.no_skip = i ? GTAO_SKIP_ALL & ~GTAO_SKIP_RADIUS : GTAO_SKIP_ALL;
            r[i] = result_make(&d, WANT_VISIBILITY, GTAO_FORMAT_FLOAT, 3, tight, 0);
            compute(&d, &r[i], 1000, &counts[i]);
        }
        assert_true(result_equal(&r[0], &r[1]));
        assert_true(counts[0].radius_skipped == 0 && counts[0].small_radius > (uint64_t)(s.width * s.height / 20));
        assert_true(counts[1].small_radius == counts[0].small_radius && counts[1].sky == counts[0].sky);
        assert_true(counts[1].radius_skipped > counts[1].small_radius / 2);
        result_free(&r[0]), result_free(&r[1]);
        buffers_free(&b);
    }
}

/* Pixels whose normal is not their plane's see something, however little it leans. */
static void leaning_normals(void **state) {
    int darker = 0;
    (void)state;
    for (int k = 0; k < 16; k++) {
        world s = plane_world(320, 0.2, 0.1, -1, -6, 0);
        size_t n = (size_t)s.width * (size_t)s.height;
        buffers b;
        gtao_desc d;
        result none;
        gtao_stats stats;
        buffers_fill(&b, &s, 1);
        for (size_t i = 0; i < n; i += 97)
            b.normals[3 * i + i % 3] += (float)(ldexp(1.0, -22 + k) * (i & 1 ? 1 : -1));
        memset(&d, 0, sizeof d);
        d.width = s.width, d.height = s.height;
        d.depth = b.depth, d.normals = b.normals;
        d.camera.fx = (float)s.fx;
        d.radius = 1.0f, d.slices = 1, d.steps = 8;
        stats = skips_change_nothing(d, "normals, lean", k, &none);
        if (k == 0)
            assert_true(stats.open > n * 9 / 10);
        for (size_t i = 0; i < n; i += 97) {
            float v;
            memcpy(&v, plane_row(&none.visibility, (int)(i / (size_t)s.width)) + 4 * (i % (size_t)s.width), 4);
            darker += v < 1.0f;
        }
        result_free(&none);
        buffers_free(&b);
    }
    assert_true(darker > 100);
}

/* A wall and one cell of it that turns through its plane: the cell's centre does not rise, its edge does. Then one that
 * stands before the wall, by a part of the radius. */
static void a_cell_apart(void **state) {
    (void)state;
    for (int k = 0; k < 16; k++) {
        world s = plane_world(320, 0.2, 0.1, -1, -6, 0);
        facet *f = &s.f[1];
        buffers b;
        gtao_desc d;
        double x, y, z;
        s.facets = 2;
        f->x0 = 16 * (4 + k), f->y0 = 16 * (3 + k / 2), f->x1 = f->x0 + 16, f->y1 = f->y0 + 16;
        f->n[0] = 0.2 + (k & 1 ? 0.2 : -0.3), f->n[1] = 0.1 + (k & 2 ? 0.25 : 0.0), f->n[2] = -1;
        x = (f->x0 + 8 - s.cx) / s.fx, y = (f->y0 + 8 - s.cy) / s.fy;
        z = s.f[0].d / (s.f[0].n[0] * x + s.f[0].n[1] * y + s.f[0].n[2]);
        if (k >= 8)
            f->n[0] = s.f[0].n[0], f->n[1] = s.f[0].n[1], z -= 0.2 + 0.1 * (k - 8);
        f->d = z * (f->n[0] * x + f->n[1] * y + f->n[2]);
        buffers_fill(&b, &s, 1);
        memset(&d, 0, sizeof d);
        d.width = s.width, d.height = s.height;
        d.depth = b.depth, d.normals = b.normals;
        d.camera.fx = (float)s.fx;
        d.radius = 1.0f, d.slices = 4, d.every_pixel = k / 4 % 2;
        assert_true(skips_change_nothing(d, "cell", k, NULL).open > 0);
        buffers_free(&b);
    }
}

/* The sweep's search of near pixels, and frames, whose horizons are those of an image of half the size. */
static void sweeps_and_frames(void **state) {
    uint32_t random = 99u;
    (void)state;
    for (int k = 0; k < cases / 20; k++) {
        uint32_t seed = random;
        world s;
        buffers b;
        gtao_desc d;
        result all, none;
        world_random(&s, &random);
        buffers_fill(&b, &s, seed);
        desc_random(&d, &s, &b, &random);
        d.estimator = GTAO_ESTIMATOR_NORMALIZED;
        d.thin_blend = d.thickness = 0.0f, d.back = NULL, d.layer_count = 0, d.layers = NULL;
        all = result_make(&d, WANT_VISIBILITY | WANT_BENT, GTAO_FORMAT_FLOAT, 3, tight, 0);
        none = result_make(&d, WANT_VISIBILITY | WANT_BENT, GTAO_FORMAT_FLOAT, 3, tight, 0);
        for (int skip = 0; skip < 2; skip++) {
            result *r = skip ? &all : &none;
            size_t size;
            void *scratch;
            d.no_skip = skip ? 0 : GTAO_SKIP_ALL;
            if (k % 2) {
                size = gtao_sweep_scratch_size(&d, &r->output, NULL) + gtao_sweep_work_size(&d, NULL);
                scratch = malloc(size);
                assert_non_null(scratch);
                assert_int_equal(gtao_sweep_compute(&d, &r->output, NULL, scratch, size, NULL, NULL), GTAO_OK);
            } else {
                gtao_frame_desc f;
                memset(&f, 0, sizeof f);
                f.desc = d;
                f.half = k / 2 % 2;
                size = gtao_frame_state_size(&f);
                scratch = calloc(size, 1);
                assert_non_null(scratch);
                for (int i = 0; i < 3; i++)
                    assert_int_equal(gtao_frame(&f, &r->output, scratch, size, NULL), GTAO_OK);
            }
            free(scratch);
        }
        if (!result_equal(&all, &none))
            fail_msg("scene %d (seed %u), %s: other bits", k, seed, k % 2 ? "sweep" : "frames");
        result_free(&all), result_free(&none);
        buffers_free(&b);
    }
}

int main(int argc, char **argv) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_scenes),      cmocka_unit_test(tolerances),        cmocka_unit_test(planes_are_open),
        cmocka_unit_test(a_cell_apart),       cmocka_unit_test(sweeps_and_frames), cmocka_unit_test(far_away),
        cmocka_unit_test(steps_on_the_floor), cmocka_unit_test(leaning_normals),
    };
    if (argc > 1)
        cases = atoi(argv[1]);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
