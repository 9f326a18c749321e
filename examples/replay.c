/* replay - the stages once more, written as a port would be: plain scalar C in double precision from docs/porting.md, the
 * papers' formulas with the C library's functions, no code of the library. It reads a dump's input and settings and
 * writes a dump of its own, so that build/diff can compare the two.
 *
 * With --mistake it makes one of the mistakes that ports make, to see in which stage build/diff finds it. Without a
 * history (no sequences), without thickness, with the memo's noise or none, and with samples at steps. */
#include "gtao.h"

#include "canvas.h"
#include "cli.h"
#include "dump.h"
#include "image.h"
#include "settings.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

/* ---- mistakes ----------------------------------------------------------------------------------------------------- */

/* Numbers as in examples/shaders, which are compiled with MISTAKE=n; those above 23 are only here. */
enum {
    MISTAKE_NONE = 0,
    MISTAKE_DISTANCE = 1,
    MISTAKE_CORNER = 2,
    MISTAKE_AXIS_EYE = 3,
    MISTAKE_Y_UP = 4,
    MISTAKE_SNAPPED = 6,
    MISTAKE_RIGHT_ANGLE = 7,
    MISTAKE_NO_RADIUS = 8,
    MISTAKE_BORDER = 9,
    MISTAKE_LONG_AXIS = 10,
    MISTAKE_COUNT_SLICES = 11,
    MISTAKE_NO_JACOBIAN = 12,
    MISTAKE_ACOS = 13,
    MISTAKE_ROTATION = 14,
    MISTAKE_FLAT_FILTER = 15,
    MISTAKE_BILINEAR = 19,
    MISTAKE_BOUNCE = 20,
    MISTAKE_TRANSPOSED = 21,
    MISTAKE_APERTURE = 22,
    MISTAKE_TRUNCATED = 23,
    MISTAKE_PARENTHESES = 24,
    MISTAKE_NOT_LINEAR = 25,
    MISTAKE_INTERPOLATED = 26,
    MISTAKE_COSINE = 27,
    MISTAKE_LENGTH = 28,
    MISTAKE_UNSIGNED = 29,
    MISTAKE_RADIUS_PX = 30,
    MISTAKE_EQUAL_PIXELS = 31,
    MISTAKE_NEAR_SKY = 32
};

static const struct mistake {
    int number;
    const char *name, *stage, *text; /* stage: where build/diff finds it first */
    int half;                        /* only at half resolution */
} mistakes[] = {
    {MISTAKE_DISTANCE, "distance", "reduce", "z taken for the length of the ray", 0},
    {MISTAKE_NOT_LINEAR, "not-linear", "reduce", "depth in place of 1 / z", 0},
    {MISTAKE_NEAR_SKY, "near-sky", "reduce", "sky as the nearest there is", 0},
    {MISTAKE_CORNER, "corner", "surface", "the pixel's corner for its centre", 0},
    {MISTAKE_AXIS_EYE, "axis-eye", "surface", "view vector of the optical axis everywhere", 0},
    {MISTAKE_Y_UP, "y-up", "surface", "normals with y up", 0},
    {MISTAKE_RADIUS_PX, "radius-px", "surface", "radius constant in pixels", 0},
    {MISTAKE_TRANSPOSED, "transposed", "noise", "rows and columns of the noise exchanged", 0},
    {MISTAKE_PARENTHESES, "parentheses", "noise", "parentheses missing in the noise, as printed", 0},
    {MISTAKE_LONG_AXIS, "long-axis", "slices", "slice axis not normalised", 0},
    {MISTAKE_NO_JACOBIAN, "no-jacobian", "slices", "slices weighted equally off the axis", 0},
    {MISTAKE_LENGTH, "length", "slices", "length of the projected normal left out", 0},
    {MISTAKE_UNSIGNED, "unsigned", "slices", "angle of the normal without its sign", 0},
    {MISTAKE_RIGHT_ANGLE, "right-angle", "horizons", "horizons start at cos = 0", 0},
    {MISTAKE_SNAPPED, "snapped", "horizons", "exact position, nearest pixel's height", 0},
    {MISTAKE_INTERPOLATED, "interpolated", "horizons", "depth interpolated across edges", 0},
    {MISTAKE_NO_RADIUS, "no-radius", "horizons", "no test of the radius", 0},
    {MISTAKE_BORDER, "border", "horizons", "clamping sampler at the border", 0},
    {MISTAKE_COSINE, "cosine", "horizons", "-cos for acos, as printed", 0},
    {MISTAKE_ACOS, "acos", "horizons", "two-term acos", 0},
    {MISTAKE_COUNT_SLICES, "count-slices", "raw", "divided by the number of slices", 0},
    {MISTAKE_ROTATION, "rotation", "raw", "bent normal in screen axes", 0},
    {MISTAKE_FLAT_FILTER, "flat-filter", "spatial1", "filter by depth, not by the plane", 0},
    {MISTAKE_EQUAL_PIXELS, "equal-pixels", "spatial1", "filter without the pixels' weights", 0},
    {MISTAKE_BILINEAR, "bilinear", "result", "upsampled whatever the depth", 1},
    {MISTAKE_TRUNCATED, "truncated", "packed", "cut off instead of rounded", 0},
    {MISTAKE_BOUNCE, "bounce", "multi_bounce", "the fit without the maximum", 0},
    {MISTAKE_APERTURE, "aperture", "specular", "aperture of an upright cone", 0},
};
enum { MISTAKES = sizeof mistakes / sizeof *mistakes };

/* What a GPU may round, in place of a mistake. */
enum {
    ROUGH_HALF_HEIGHT = 101,
    ROUGH_HALF_DEPTH,
    ROUGH_NORMAL_10,
    ROUGH_NORMAL_8,
    ROUGH_RECIPROCAL,
    ROUGH_HALF_COTANGENT,
    ROUGH_ACOS_2,
    ROUGH_ACOS_4,
    ROUGH_HALF_ANGLE,
    ROUGH_NO_FLOOR,
    ROUGH_HALF_SIGNAL,
    ROUGH_BYTES
};

static const struct roughness {
    int number;
    const char *text;
} roughnesses[] = {
    {ROUGH_HALF_HEIGHT, "heights stored in half"},
    {ROUGH_HALF_DEPTH, "z stored in half, height from it"},
    {ROUGH_NORMAL_10, "normals of 10 bits a component"},
    {ROUGH_NORMAL_8, "normals of 8 bits a component"},
    {ROUGH_RECIPROCAL, "reciprocals and roots of 12 bits"},
    {ROUGH_HALF_COTANGENT, "cotangents in half"},
    {ROUGH_ACOS_2, "acos of two terms"},
    {ROUGH_ACOS_4, "acos of four terms"},
    {ROUGH_HALF_ANGLE, "angles in half"},
    {ROUGH_NO_FLOOR, "without rise_min"},
    {ROUGH_HALF_SIGNAL, "visibility, weight, bent normal in half"},
    {ROUGH_BYTES, "the same in 8 bits"},
};
enum { ROUGHNESSES = sizeof roughnesses / sizeof *roughnesses };

/* To `bits` significant bits, no finer than `least`. */
static double to_bits(double x, int bits, double least) {
    int exponent;
    double quantum;
    frexp(x, &exponent);
    quantum = fmax(ldexp(1.0, exponent - bits), least);
    return floor(x / quantum + 0.5) * quantum;
}

static double to_half(double x) {
    return to_bits(x, 11, 1.0 / 16777216.0);
}

/* acos by sqrt(1 - |x|) times a polynomial: of two terms, max error 0.009 rad; of four [Abramowitz, Stegun 4.4.45],
 * 7e-5. */
static double acos_fit(double x, int terms) {
    double a = fabs(x), h = 1.5707963 - 0.156583 * a;
    if (terms == 4)
        h = 1.5707288 + a * (-0.2121144 + a * (0.0742610 - 0.0187293 * a));
    h *= sqrt(1.0 - a);
    return x < 0.0 ? 3.14159265358979 - h : h;
}

/* ---- what is computed --------------------------------------------------------------------------------------------- */

/* Planes of doubles; a stage rounds them to float when it is done, as a port that stores 32 bits does. */
typedef struct replay {
    int mistake, framed;
    gtao_constants c, full; /* of the search; of the image */
    gtao_frame_constants f;
    image depth, normals; /* normals.data null: derived */
    float albedo[3], roughness[3];
    image table; /* of specular visibility */
    int table_size[3];
    size_t count, full_count; /* pixels */
    float *height, *reduced_normal, *surface[7], *bare[3], *noise[3], *slices, *horizons, *raw[5], *filtered[5],
        *result[4];
    unsigned char *occluded; /* of each side of each slice: anything at all */
    float *packed[4], *bounce[4], *specular[3];
    gtao_tap *taps; /* (phase, slice, class), steps each */
    int *tap_count;
    double *directions; /* (phase, slice): dx, dy */
    void *memory[128];
    int allocations;
} replay;

static float *plane(replay *r, size_t count) {
    float *p = r->allocations < 128 ? calloc(count ? count : 1, sizeof *p) : NULL;
    if (p)
        r->memory[r->allocations++] = p;
    return p;
}

static double clamp(double x, double lo, double hi) {
    return x < lo ? lo : x > hi ? hi : x;
}

/* ---- depth to height ---------------------------------------------------------------------------------------------- */

static double height_of(const replay *r, int x, int y) {
    const gtao_constants *c = &r->full;
    double z = (double)r->depth.data[(size_t)y * (size_t)c->width + (size_t)x], w = (double)c->sky, rx, ry;
    int kind = c->depth_kind;
    if (r->mistake == MISTAKE_DISTANCE)
        kind = kind == GTAO_DEPTH_DISTANCE ? GTAO_DEPTH_Z : GTAO_DEPTH_DISTANCE;
    if (kind == GTAO_DEPTH_DEVICE) {
        w = z * (double)c->w_scale + (double)c->w_bias;
        if (!(w > (double)c->w_far && w < 3e38))
            return (double)c->sky;
    } else if (c->orthographic) {
        if (!isfinite(z) || (kind != GTAO_DEPTH_HEIGHT && !(z > 0.0 && z < (double)c->z_sky)))
            return (double)c->sky;
        w = z * (double)c->w_scale;
    } else {
        if (!(z > 0.0 && z < (double)c->z_sky))
            return r->mistake == MISTAKE_NEAR_SKY ? 1.0 : (double)c->sky;
        rx = ((double)x + 0.5 - (double)c->cx) * (double)c->bx1;
        ry = ((double)y + 0.5 - (double)c->cy) * (double)c->by1;
        w = (double)c->w_numerator / z;
        if (kind == GTAO_DEPTH_DISTANCE)
            w *= sqrt(rx * rx + ry * ry + 1.0);
        if (r->mistake == MISTAKE_NOT_LINEAR)
            w = z / (double)c->w_numerator;
    }
    if (c->orthographic)
        return clamp(w, -(double)c->ortho_limit, (double)c->ortho_limit);
    return w > (double)c->w_min ? fmin(w, (double)c->w_max) : (double)c->sky;
}

/* Height of the pixel past an odd image's last, along a line on which `a` is the last and `b` the one before. */
static double beyond(const replay *r, double a, double b) {
    double tolerance = (r->full.orthographic ? 1.0 : a) * (double)r->full.same_surface;
    return a > (double)r->c.sky_limit && fabs(a - b) <= tolerance ? 2.0 * a - b : a;
}

static double block_height(const replay *r, int x, int y) {
    int w = r->full.width, h = r->full.height;
    if (y >= h)
        return h > 1 ? beyond(r, block_height(r, x, h - 1), block_height(r, x, h - 2)) : block_height(r, x, h - 1);
    if (x >= w)
        return w > 1 ? beyond(r, height_of(r, w - 1, y), height_of(r, w - 2, y)) : height_of(r, w - 1, y);
    return height_of(r, x, y);
}

/* Heights at the filters' resolution, and which pixels' normals go with them. */
static void reduce(replay *r) {
    const gtao_constants *c = &r->c;
    int scale = r->framed ? r->f.scale : 1;
    for (int y = 0; y < c->height; ++y)
        for (int x = 0; x < c->width; ++x) {
            size_t at = (size_t)y * (size_t)c->width + (size_t)x;
            double w[4], chosen;
            int which = 0, px = x, py = y;
            if (scale == 2) {
                for (int i = 0; i < 4; ++i)
                    w[i] = (double)(float)block_height(r, 2 * x + i % 2, 2 * y + i / 2);
                for (int i = 1; i < 4; ++i) { /* the nearest; r.f.reduction 0 */
                    which = w[i] > w[which] ? i : which;
                }
                chosen = w[which];
                double across = w[which ^ 1] - chosen, down = w[which ^ 2] - chosen;
                double same = (c->orthographic ? 1.0 : chosen) * (double)r->full.same_surface;
                if (fmax(fabs(across), fabs(down)) <= same)
                    chosen += 0.5 * (across + down);
                px = 2 * x + which % 2 < r->full.width ? 2 * x + which % 2 : r->full.width - 1;
                py = 2 * y + which / 2 < r->full.height ? 2 * y + which / 2 : r->full.height - 1;
            } else {
                chosen = height_of(r, x, y);
            }
            if (chosen > (double)c->sky_limit) {
                if (r->mistake == ROUGH_HALF_HEIGHT)
                    chosen = to_half(chosen);
                if (r->mistake == ROUGH_HALF_DEPTH)
                    chosen = c->orthographic ? to_half(chosen * (double)c->unit) / (double)c->unit
                                             : (double)c->unit / to_half((double)c->unit / chosen);
            }
            r->height[at] = (float)chosen;
            for (size_t k = 0; r->normals.data && k < 3; ++k) {
                const float *n = r->normals.data + 3 * ((size_t)py * (size_t)r->full.width + (size_t)px);
                double len2 = (double)n[0] * (double)n[0] + (double)n[1] * (double)n[1] + (double)n[2] * (double)n[2];
                r->reduced_normal[3 * at + k] =
                    len2 >= 1e-30 && len2 < 3e38 ? (r->framed ? (float)((double)n[k] / sqrt(len2)) : n[k]) : 0.0f;
            }
        }
}

/* Height of a pixel, borders applied; sky outside an open one. */
static double at(const replay *r, int x, int y) {
    const gtao_constants *c = &r->c;
    if (c->border == GTAO_BORDER_WRAP) {
        x = (x % c->width + c->width) % c->width, y = (y % c->height + c->height) % c->height;
    } else if (c->border == GTAO_BORDER_CLAMP || r->mistake == MISTAKE_BORDER) {
        x = x < 0 ? 0 : x >= c->width ? c->width - 1 : x, y = y < 0 ? 0 : y >= c->height ? c->height - 1 : y;
    } else if (x < 0 || y < 0 || x >= c->width || y >= c->height) {
        return (double)c->sky;
    }
    return (double)r->height[(size_t)y * (size_t)c->width + (size_t)x];
}

/* ---- surface ------------------------------------------------------------------------------------------------------ */

static void ray(const replay *r, const gtao_constants *c, int x, int y, double out[3]) {
    double half = r->mistake == MISTAKE_CORNER ? 0.0 : 0.5;
    out[0] = out[1] = 0.0, out[2] = 1.0;
    if (!c->orthographic && r->mistake != MISTAKE_AXIS_EYE) {
        out[0] = ((double)x + half - (double)c->cx) * (double)c->bx1;
        out[1] = ((double)y + half - (double)c->cy) * (double)c->by1;
    }
}

/* Derivative along one axis at a pixel whose neighbours are v[0 .. 4], v[2] itself: of the side whose further pixel it
 * predicts better. *error: by how much it misses. */
static double derivative(const gtao_constants *c, const double v[5], double *error) {
    double limit = (double)c->sky_limit, before = v[2] - v[1], after = v[3] - v[2];
    double miss_before = v[0] > limit ? fabs(v[1] - v[0] - before) : fabs(before);
    double miss_after = v[4] > limit ? fabs(v[4] - v[3] - after) : fabs(after);
    int has_before = v[1] > limit, has_after = v[3] > limit;
    miss_before = has_before ? miss_before : 3e38, miss_after = has_after ? miss_after : 3e38;
    before = has_before ? before : 0.0, after = has_after ? after : 0.0;
    *error = fmin(miss_before, miss_after);
    return miss_before < miss_after ? before : miss_after < miss_before ? after : 0.5 * (before + after);
}

static int normalise(double v[3]) {
    double len2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    for (int k = 0; k < 3; ++k)
        v[k] /= sqrt(len2);
    return len2 > 0.0 && len2 < 3e38;
}

/* Neighbours along x and y, as the derivatives take them; outside is sky but where the image wraps. */
static void neighbours(const replay *r, int x, int y, double along[5], double down[5]) {
    for (int i = -2; i <= 2; ++i) {
        int wrap = r->c.border == GTAO_BORDER_WRAP;
        along[i + 2] = wrap || (x + i >= 0 && x + i < r->c.width) ? at(r, x + i, y) : (double)r->c.sky;
        down[i + 2] = wrap || (y + i >= 0 && y + i < r->c.height) ? at(r, x, y + i) : (double)r->c.sky;
    }
}

static void surface(replay *r) {
    const gtao_constants *c = &r->c;
    for (int y = 0; y < c->height; ++y)
        for (int x = 0; x < c->width; ++x) {
            size_t i = (size_t)y * (size_t)c->width + (size_t)x;
            double w = (double)r->height[i], p[3], n[3] = {0.0, 0.0, 0.0}, length, extent, nv, scale;
            uint32_t bits;
            float key;
            r->surface[6][i] = -1.0f;
            ray(r, c, x, y, p);
            length = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
            extent = c->orthographic ? (double)c->reach
                     : c->bounded    ? w * length * (double)c->reach
                                     : (double)c->extent_max;
            if (r->mistake == MISTAKE_RADIUS_PX)
                extent = 50.0 * (double)c->bx1;
            int solid = w > (double)c->sky_limit;
            if (r->normals.data) {
                const float *from = r->reduced_normal + 3 * i;
                for (int k = 0; k < 3; ++k)
                    n[k] = (double)c->to_view[3 * k] * (double)from[0] +
                           (double)c->to_view[3 * k + 1] * (double)from[1] +
                           (double)c->to_view[3 * k + 2] * (double)from[2];
            }
            if (solid && n[0] * n[0] + n[1] * n[1] + n[2] * n[2] < 1e-30) {
                double along[5], down[5], gx, gy, unused;
                neighbours(r, x, y, along, down);
                gx = derivative(c, along, &unused), gy = derivative(c, down, &unused);
                n[0] = -gx / (double)c->bx1, n[1] = -gy / (double)c->by1;
                n[2] = c->orthographic ? -1.0 : -(w + n[0] * p[0] + n[1] * p[1]);
            }
            if (!normalise(n))
                n[0] = -p[0] / length, n[1] = -p[1] / length, n[2] = -p[2] / length;
            if (r->mistake == MISTAKE_Y_UP)
                n[1] = -n[1];
            if (r->mistake == ROUGH_NORMAL_10 || r->mistake == ROUGH_NORMAL_8) {
                double steps = r->mistake == ROUGH_NORMAL_10 ? 511.0 : 127.0;
                for (int k = 0; k < 3; ++k)
                    n[k] = floor(n[k] * steps + 0.5) / steps;
                normalise(n);
            }
            for (int k = 0; k < 3; ++k)
                r->bare[k][i] = (float)n[k];
            if (!solid || !(extent >= (double)c->extent_min))
                continue;
            nv = -(n[0] * p[0] + n[1] * p[1] + n[2] * p[2]) / length;
            if (nv < (double)c->facing_min) { /* tilted until it faces the eye */
                double lift = ((double)c->facing_min - nv) / length;
                for (int k = 0; k < 3; ++k)
                    n[k] -= lift * p[k];
                if (n[0] * n[0] + n[1] * n[1] + n[2] * n[2] < 1e-12 || !normalise(n))
                    for (int k = 0; k < 3; ++k)
                        n[k] = -p[k] / length;
                nv = fmax(-(n[0] * p[0] + n[1] * p[1] + n[2] * p[2]) / length, 0.5 * (double)c->facing_min);
            }
            scale = -(c->orthographic ? 1.0 : w) / (nv * length);
            r->surface[3][i] = (float)(scale * n[0] * (double)c->bx1);
            r->surface[4][i] = (float)(scale * n[1] * (double)c->by1);
            for (int k = 0; k < 3; ++k)
                r->surface[k][i] = (float)n[k];
            r->surface[5][i] = (float)extent;
            key = (float)clamp((double)(float)extent, (double)c->extent_min, (double)c->extent_max);
            memcpy(&bits, &key, 4);
            r->surface[6][i] = (float)clamp((double)(int)(bits >> 21) - (double)c->class_base, 0.0, c->classes - 1.0);
        }
}

/* ---- noise and samples -------------------------------------------------------------------------------------------- */

/* [J16] as meant: 16 directions and 4 offsets over 4x4 pixels; 6 rotations, the last three moved by a sixth of a
 * direction, and 4 offsets a quarter apart, over 24 frames. */
static void noise_at(const replay *r, int x, int y, double *direction, double *offset) {
    static const double rotations[6] = {60, 300, 180, 240, 120, 0}, offsets[4] = {0, 2, 1, 3};
    int turn = r->c.frame % 6, spatial, i;
    double part;
    *direction = *offset = 0.5;
    if (r->c.noise != GTAO_NOISE_MEMO)
        return;
    if (r->mistake == MISTAKE_TRANSPOSED)
        i = x, x = y, y = i;
    spatial = (((x + y) & 3) << 2) + (x & 3);
    if (r->mistake == MISTAKE_PARENTHESES)
        spatial = ((x + y) & 3) << (2 + (x & 3)) & 15;
    part = (double)spatial / 16.0 + rotations[turn] / 360.0 + (turn >= 3 ? 1.0 / 96.0 : 0.0);
    *direction = part - floor(part + 1e-9);
    *offset = (double)((y - x) & 3) / 4.0 + offsets[r->c.frame / 6 % 4] / 16.0;
}

static void noise(replay *r) {
    const gtao_constants *c = &r->c;
    for (int y = 0; y < c->height; ++y)
        for (int x = 0; x < c->width; ++x) {
            size_t i = (size_t)y * (size_t)c->width + (size_t)x;
            double direction, offset;
            noise_at(r, x, y, &direction, &offset);
            r->noise[0][i] = (float)direction, r->noise[1][i] = (float)offset;
            r->noise[2][i] = (float)(y % c->period * c->period + x % c->period);
        }
}

static void samples(replay *r) {
    const gtao_constants *c = &r->c;
    for (int phase = 0; phase < c->period * c->period; ++phase)
        for (int k = 0; k < c->slices; ++k) {
            double direction, offset, angle, dx, dy, b;
            double *d = r->directions + 2 * (phase * c->slices + k);
            noise_at(r, phase % c->period, phase / c->period, &direction, &offset);
            angle = pi * ((double)k + direction) / (double)c->slices;
            d[0] = dx = cos(angle), d[1] = dy = sin(angle);
            b = sqrt(dx * dx * (double)c->bx1 * (double)c->bx1 + dy * dy * (double)c->by1 * (double)c->by1);
            for (int class = 0; class < c->classes; ++class) {
                int list = (phase * c->slices + k) * c->classes + class, n = 0;
                gtao_tap *tap = r->taps + (size_t)list * (size_t)c->steps;
                uint32_t bits = (uint32_t)(c->class_base + class + 1) << 21;
                float edge;
                memcpy(&edge, &bits, 4);
                double radius = clamp((double)edge / b, 1.0, (double)c->max_radius);
                for (int j = 0; j < c->steps; ++j) {
                    double t = 1.0 + (radius - 1.0) * pow(((double)j + offset) / c->steps, (double)c->step_power);
                    int qx = (int)lround(t * dx + (dx < 0 ? -1e-9 : 1e-9)),
                        qy = (int)lround(t * dy + (dy < 0 ? -1e-9 : 1e-9));
                    double length = sqrt((double)qx * qx + (double)qy * qy);
                    if (n > 0 && tap[n - 1].qx == qx && tap[n - 1].qy == qy)
                        continue;
                    tap[n].qx = qx, tap[n].qy = qy;
                    tap[n].inv_length = (float)(1.0 / length);
                    tap[n].ux = (float)(qx / length), tap[n++].uy = (float)(qy / length);
                }
                r->tap_count[list] = n;
            }
        }
}

/* ---- slices and horizons ------------------------------------------------------------------------------------------ */

/* A slice at a pixel. */
typedef struct slice {
    double dx, dy, bx, by, length, nv; /* length: of the ray */
    double perp, no;                   /* |b_perp|; n.o */
    double o[3], v[3];
} slice;

static void make_slice(const replay *r, int x, int y, int k, slice *s) {
    const gtao_constants *c = &r->c;
    size_t i = (size_t)y * (size_t)c->width + (size_t)x;
    int phase = y % c->period * c->period + x % c->period;
    double p[3], along, b[3];
    ray(r, c, x, y, p);
    s->length = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    s->dx = r->directions[2 * (phase * c->slices + k)], s->dy = r->directions[2 * (phase * c->slices + k) + 1];
    b[0] = s->bx = s->dx * (double)c->bx1, b[1] = s->by = s->dy * (double)c->by1, b[2] = 0.0;
    s->nv = 0.0;
    for (int j = 0; j < 3; ++j) {
        s->v[j] = -p[j] / s->length;
        s->nv += (double)r->surface[j][i] * s->v[j];
    }
    along = b[0] * s->v[0] + b[1] * s->v[1]; /* b.v */
    s->perp = s->no = 0.0;
    for (int j = 0; j < 3; ++j) {
        s->o[j] = b[j] - along * s->v[j];
        s->perp += s->o[j] * s->o[j];
    }
    s->perp = sqrt(s->perp);
    for (int j = 0; j < 3; ++j) {
        s->o[j] /= s->perp;
        s->no += (double)r->surface[j][i] * s->o[j];
    }
    if (r->mistake == MISTAKE_LONG_AXIS)
        s->no *= s->perp / sqrt(s->bx * s->bx + s->by * s->by);
}

/* Bilinear height at (x, y), and that of the nearest pixel. */
static double interpolated(const replay *r, double x, double y) {
    int ix = (int)floor(x), iy = (int)floor(y);
    double fx = x - ix, fy = y - iy;
    return (at(r, ix, iy) * (1.0 - fx) + at(r, ix + 1, iy) * fx) * (1.0 - fy) +
           (at(r, ix, iy + 1) * (1.0 - fx) + at(r, ix + 1, iy + 1) * fx) * fy;
}

/* Cotangent of the horizon on a side (0: +, 1: -) [J16]; in height space, see docs/theory.md. */
static double search(const replay *r, int x, int y, int k, int side, const slice *s, int *occluded) {
    const gtao_constants *c = &r->c;
    size_t i = (size_t)y * (size_t)c->width + (size_t)x;
    int phase = y % c->period * c->period + x % c->period, sign = side ? -1 : 1;
    int list = (phase * c->slices + k) * c->classes + (int)r->surface[6][i];
    const gtao_tap *taps = r->taps + (size_t)list * (size_t)c->steps;
    double w0 = (double)r->height[i], unit = c->orthographic ? 1.0 : w0;
    double scale = s->length / (unit * s->perp), tangent = -sign * s->no / s->nv, start;
    double gx = (double)r->surface[3][i], gy = (double)r->surface[4][i];
    double floor_rise = s->perp * (double)c->rise_min * unit / s->length, rise_most = floor_rise, cosine, kappa;
    if (r->mistake == ROUGH_RECIPROCAL)
        scale = to_bits(scale, 12, 0.0), tangent = to_bits(tangent, 12, 0.0);
    if (r->mistake == ROUGH_NO_FLOOR)
        floor_rise = rise_most = 0.0;
    start = cosine = tangent / sqrt(1.0 + tangent * tangent);
    if (r->mistake == MISTAKE_RIGHT_ANGLE)
        rise_most = -tangent / scale; /* cot h = 0 */
    for (int j = 0; j < r->tap_count[list]; ++j) {
        double inv = (double)taps[j].inv_length, ux = sign * (double)taps[j].ux, uy = sign * (double)taps[j].uy;
        double w = at(r, x + sign * taps[j].qx, y + sign * taps[j].qy), rise, own, rho, reach;
        if (r->mistake == MISTAKE_SNAPPED || r->mistake == MISTAKE_INTERPOLATED) {
            ux = sign * s->dx, uy = sign * s->dy; /* the exact position on the slice's line */
            if (r->mistake == MISTAKE_INTERPOLATED)
                w = interpolated(r, x + ux / inv, y + uy / inv);
        }
        if (!(w > (double)c->sky_limit))
            continue;
        rise = (w - w0) * inv - (gx * ux + gy * uy);
        if (r->mistake == ROUGH_RECIPROCAL)
            rise = (w - w0) * to_bits(inv, 12, 0.0) - (gx * ux + gy * uy);
        own = rise * scale + tangent;
        rho = 1.0 + own * own;
        reach = (double)c->reach / s->perp * inv * (c->orthographic ? 1.0 : w);
        if (!c->bounded || r->mistake == MISTAKE_NO_RADIUS || rho <= reach * reach * (double)c->inner2) {
            rise_most = fmax(rise_most, rise);
        } else if (rho < reach * reach && c->inv_falloff > 0.0f && rise > rise_most) {
            double weight = (1.0 - sqrt(rho) / reach) * (double)c->inv_falloff;
            cosine = fmax(cosine, start + weight * (own / sqrt(rho) - start));
        }
    }
    if (rise_most == floor_rise)
        rise_most = 0.0;
    kappa = rise_most * scale + tangent;
    *occluded = rise_most > floor_rise || cosine > start;
    if (cosine > start)
        kappa = fmax(kappa, cosine / sqrt(fmax(1.0 - cosine * cosine, 1e-12)));
    if (r->mistake == ROUGH_HALF_COTANGENT)
        kappa = to_half(clamp(kappa, -65504.0, 65504.0));
    return clamp(kappa, -(double)c->kappa_limit, (double)c->kappa_limit);
}

static void slices_and_horizons(replay *r) {
    const gtao_constants *c = &r->c;
    for (int k = 0; k < c->slices; ++k)
        for (int y = 0; y < c->height; ++y)
            for (int x = 0; x < c->width; ++x) {
                size_t i = (size_t)y * (size_t)c->width + (size_t)x;
                float *terms = r->slices + 3 * (size_t)k * r->count + i;
                slice s;
                double n, length, open;
                if (r->surface[6][i] < 0.0f) {
                    for (size_t side = 0; side < 2; ++side)
                        r->horizons[(2 * (size_t)k + side) * r->count + i] = (float)(0.5 * pi);
                    continue;
                }
                make_slice(r, x, y, k, &s);
                n = atan2(s.no, s.nv);
                length = sqrt(s.no * s.no + s.nv * s.nv);
                if (r->mistake == MISTAKE_LENGTH)
                    length = 1.0;
                if (r->mistake == MISTAKE_UNSIGNED)
                    n = fabs(n);
                if (r->mistake == ROUGH_HALF_ANGLE)
                    n = to_half(n);
                open = c->weighting == GTAO_WEIGHTING_UNIFORM ? 2.0 : length * (cos(n) + n * sin(n));
                terms[0] = c->weighting == GTAO_WEIGHTING_UNIFORM ? 0.0f : (float)n;
                terms[r->count] = r->mistake == MISTAKE_NO_JACOBIAN ? 1.0f : (float)(1.0 / (s.perp * s.perp));
                terms[2 * r->count] = (float)open;
                for (int side = 0; side < 2; ++side) {
                    int occluded;
                    double kappa = search(r, x, y, k, side, &s, &occluded), h = atan2(1.0, kappa);
                    size_t to = (size_t)(2 * k + side) * r->count + i;
                    double cosine = kappa / sqrt(1.0 + kappa * kappa);
                    if (r->mistake == MISTAKE_COSINE)
                        h = -cosine;
                    if (r->mistake == MISTAKE_ACOS || r->mistake == ROUGH_ACOS_2 || r->mistake == ROUGH_ACOS_4)
                        h = acos_fit(cosine, r->mistake == ROUGH_ACOS_4 ? 4 : 2);
                    if (r->mistake == ROUGH_HALF_ANGLE)
                        h = to_half(h);
                    r->horizons[to] = (float)h;
                    r->occluded[to] = (unsigned char)occluded;
                }
            }
}

/* ---- integration -------------------------------------------------------------------------------------------------- */

static double arc(double h, double n) { /* [J19] */
    return 0.25 * (cos(n) + 2.0 * h * sin(n) - cos(2.0 * h - n));
}

/* [J19 Eq. 20-21]: along o and v. */
static void arc_bent(double h0, double h1, double n, double t[2]) {
    t[0] = (6.0 * sin(h0 - n) - sin(3.0 * h0 - n) + 6.0 * sin(h1 - n) - sin(3.0 * h1 - n) + 16.0 * sin(n) -
            3.0 * (sin(h0 + n) + sin(h1 + n))) /
           12.0;
    t[1] = (-cos(3.0 * h0 - n) - cos(3.0 * h1 - n) + 8.0 * cos(n) - 3.0 * (cos(h0 + n) + cos(h1 + n))) / 12.0;
}

/* The normal, where nothing is computed as it came. */
static double normal(const replay *r, size_t i, int k) {
    return (double)(r->surface[6][i] < 0.0f ? r->bare : r->surface)[k][i];
}

static void integrate(replay *r) {
    const gtao_constants *c = &r->c;
    int uniform = c->weighting == GTAO_WEIGHTING_UNIFORM;
    double share = uniform ? 0.5 : 2.0 / 3.0;
    for (int y = 0; y < c->height; ++y)
        for (int x = 0; x < c->width; ++x) {
            size_t i = (size_t)y * (size_t)c->width + (size_t)x;
            double visible = 0.0, open = 0.0, whole = 0.0, lost[3] = {0.0, 0.0, 0.0}, v, p[3], weight, len2 = 0.0;
            int any = 0;
            ray(r, c, x, y, p);
            for (int k = 0; r->surface[6][i] >= 0.0f && k < c->slices; ++k) {
                size_t side = 2 * (size_t)k * r->count + i;
                const float *terms = r->slices + 3 * (size_t)k * r->count + i;
                double h1 = (double)r->horizons[side], h0 = -(double)r->horizons[side + r->count];
                double n = (double)terms[0], jacobian = (double)terms[r->count], full = (double)terms[2 * r->count];
                double length, seen = full, t[2], open_t[2];
                slice s;
                make_slice(r, x, y, k, &s);
                length = r->mistake == MISTAKE_LENGTH ? 1.0 : sqrt(s.no * s.no + s.nv * s.nv);
                if (r->occluded[side] || r->occluded[side + r->count]) {
                    any = 1;
                    seen = uniform ? 2.0 - cos(h0) - cos(h1) : length * (arc(h0, n) + arc(h1, n));
                    if (uniform) {
                        double m = atan2(s.no, s.nv), hi = m + 0.5 * pi, lo = m - 0.5 * pi;
                        t[0] = 0.5 * (h1 + h0 - sin(h1) * cos(h1) - sin(h0) * cos(h0));
                        t[1] = 0.5 * (sin(h0) * sin(h0) + sin(h1) * sin(h1));
                        open_t[0] = 0.5 * (hi + lo - sin(hi) * cos(hi) - sin(lo) * cos(lo));
                        open_t[1] = 0.5 * (sin(hi) * sin(hi) + sin(lo) * sin(lo));
                    } else {
                        arc_bent(h0, h1, n, t);
                        t[0] *= length, t[1] *= length;
                        open_t[0] = 4.0 / 3.0 * length * sin(n), open_t[1] = 2.0 / 3.0 * length * cos(n);
                    }
                    for (int j = 0; j < 3; ++j) {
                        double o = s.o[j], view = s.v[j];
                        if (r->mistake == MISTAKE_ROTATION)
                            o = j == 0 ? s.dx : j == 1 ? s.dy : 0.0, view = j == 2 ? -1.0 : 0.0;
                        lost[j] += jacobian * ((open_t[0] - t[0]) * o + (open_t[1] - t[1]) * view);
                    }
                }
                visible += jacobian * seen;
                open += full;
                whole += jacobian * full;
            }
            v = visible / (r->mistake == MISTAKE_COUNT_SLICES ? c->slices * (uniform ? 2.0 : 1.0) : whole);
            if (r->mistake == MISTAKE_COUNT_SLICES) /* and without the Jacobian, which has the wrong size then */
                v *= open / whole;
            r->raw[0][i] = r->surface[6][i] < 0.0f ? 1.0f : (float)clamp(v, 0.0, 1.0);
            weight = whole / sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) * (double)c->weight_scale;
            r->raw[1][i] = r->surface[6][i] < 0.0f ? 1.0f : (float)clamp(weight, 1e-3, 1e3);
            for (int j = 0; j < 3; ++j) {
                lost[j] = share * normal(r, i, j) - (any ? lost[j] / whole : 0.0);
                len2 += lost[j] * lost[j];
            }
            for (int j = 0; j < 3; ++j)
                r->raw[2 + j][i] = (float)(len2 >= 1e-12 ? lost[j] : share * normal(r, i, j));
        }
}

static void round_signal(replay *r) {
    for (size_t i = 0; i < r->count; ++i)
        for (int k = 0; k < 5; ++k) {
            double x = (double)r->raw[k][i];
            if (r->mistake == ROUGH_HALF_SIGNAL)
                x = to_half(x);
            if (r->mistake == ROUGH_BYTES && k != 1)
                x = k ? floor(x * 127.0 + 0.5) / 127.0 : floor(x * 255.0 + 0.5) / 255.0;
            r->raw[k][i] = (float)x;
        }
}

/* ---- the spatial filter ------------------------------------------------------------------------------------------- */

static void spatial(replay *r) {
    const gtao_constants *c = &r->c;
    for (int y = 0; y < c->height; ++y)
        for (int x = 0; x < c->width; ++x) {
            size_t i = (size_t)y * (size_t)c->width + (size_t)x;
            double w = (double)r->height[i], tolerance, along[5], down[5], gx, gy, ex, ey, room;
            double sum[5] = {0}, total = 0.0, shares = 0.0;
            for (int k = 0; k < 5; ++k)
                r->filtered[k][i] = r->raw[k][i];
            if (!(w > (double)c->sky_limit))
                continue;
            tolerance = w * (double)r->f.tolerance_scale + (double)r->f.tolerance_bias;
            neighbours(r, x, y, along, down);
            gx = derivative(c, along, &ex), gy = derivative(c, down, &ey);
            if (!(ex <= tolerance))
                gx = ex = 0.0;
            if (!(ey <= tolerance))
                gy = ey = 0.0;
            if (r->mistake == MISTAKE_FLAT_FILTER)
                gx = gy = 0.0;
            room = tolerance + fmin(2.0 * (ex + ey), tolerance);
            for (int j = -2; j <= 2; ++j)
                for (int k = -2; k <= 2; ++k) {
                    double part = (double)(r->f.window0[j + 2] * r->f.window0[k + 2]), other, share, weight;
                    int wrap = c->border == GTAO_BORDER_WRAP;
                    if (part == 0.0 || (!wrap && (x + k < 0 || y + j < 0 || x + k >= c->width || y + j >= c->height)))
                        continue;
                    other = at(r, x + k, y + j);
                    if (!(other > (double)c->sky_limit))
                        continue;
                    share = part * fmax(0.0, 1.0 - fabs(other - (w + gx * k + gy * j)) / room);
                    size_t from = (size_t)((y + j + c->height) % c->height) * (size_t)c->width +
                                  (size_t)((x + k + c->width) % c->width);
                    weight = share * (r->mistake == MISTAKE_EQUAL_PIXELS ? 1.0 : (double)r->raw[1][from]);
                    shares += share, total += weight;
                    for (int m = 0; m < 5; ++m)
                        sum[m] += weight * (double)r->raw[m][from];
                }
            if (total > 0.0) {
                for (int m = 0; m < 5; ++m)
                    r->filtered[m][i] = (float)(sum[m] / total);
                r->filtered[1][i] = (float)(total / shares);
            }
        }
}

/* ---- result ------------------------------------------------------------------------------------------------------- */

static double tolerance_of(const replay *r, double w) {
    return w * (double)r->f.tolerance_scale + (double)r->f.tolerance_bias;
}

static double plane_at(const replay *r, const float *values, int x, int y, double outside) {
    const gtao_constants *c = &r->c;
    if (c->border == GTAO_BORDER_WRAP)
        x = (x + c->width) % c->width, y = (y + c->height) % c->height;
    if (x < 0 || y < 0 || x >= c->width || y >= c->height)
        return outside;
    return (double)values[(size_t)y * (size_t)c->width + (size_t)x];
}

/* The step of the height by one block: the lesser of two first differences, if they agree or it is small. */
static double block_step(double before, double w, double after, double allowed) {
    double a = w - before, b = after - w, least = fabs(a) <= fabs(b) ? a : b;
    return fmin(fabs(a - b), fabs(least)) <= allowed ? least : 0.0;
}

static void upsample(replay *r) {
    static const double bilinear[4] = {9.0 / 16.0, 3.0 / 16.0, 3.0 / 16.0, 1.0 / 16.0};
    const gtao_constants *c = &r->full;
    float *const *from = r->framed && r->f.spatial_passes ? r->filtered : r->raw;
    int scale = r->framed ? r->f.scale : 1;
    for (int y = 0; y < c->height; ++y)
        for (int x = 0; x < c->width; ++x) {
            size_t i = (size_t)y * (size_t)c->width + (size_t)x;
            int bx = x / scale, by = y / scale, sx = x % 2 ? 1 : -1, sy = y % 2 ? 1 : -1;
            size_t block = (size_t)by * (size_t)r->c.width + (size_t)bx;
            double out[4] = {0}, total = 0.0, w = (double)(float)height_of(r, x, y), p[3];
            const int planes[4] = {0, 2, 3, 4};
            if (scale == 2) {
                double w0 = (double)r->height[block], sky = (double)c->sky, tap[4], away[4], least = 1e300, most = 0.0;
                double allowed = tolerance_of(r, fmax(w0, 0.0));
                double gx = block_step(plane_at(r, r->height, bx - 1, by, sky), w0,
                                       plane_at(r, r->height, bx + 1, by, sky), allowed);
                double gy = block_step(plane_at(r, r->height, bx, by - 1, sky), w0,
                                       plane_at(r, r->height, bx, by + 1, sky), allowed);
                for (int t = 0; t < 4; ++t) {
                    double dx = sx * (t % 2 ? 0.75 : -0.25), dy = sy * (t / 2 ? 0.75 : -0.25);
                    tap[t] = plane_at(r, r->height, bx + (t % 2 ? sx : 0), by + (t / 2 ? sy : 0), sky);
                    away[t] = fabs(tap[t] - (w + gx * dx + gy * dy)) / fmax(allowed, 1e-28);
                    least = fmin(least, away[t]), most = fmax(most, away[t]);
                }
                for (int t = 0; t < 4; ++t) {
                    int tx = bx + (t % 2 ? sx : 0), ty = by + (t / 2 ? sy : 0);
                    double share = clamp(fmax(2.0 - away[t], away[t] <= least ? 1e-6 : 0.0), 0.0, 1.0);
                    if (!(tap[t] > (double)c->sky_limit))
                        continue;
                    share = bilinear[t] * (most <= 1.0 || r->mistake == MISTAKE_BILINEAR ? 1.0 : share);
                    total += share;
                    for (int k = 0; k < 4; ++k)
                        out[k] += share * plane_at(r, from[planes[k]], tx, ty, 0.0);
                }
            }
            for (int k = 0; k < 4; ++k)
                out[k] = scale == 2 && total > 0.0 && w > (double)c->sky_limit ? out[k] / total
                                                                               : (double)from[planes[k]][block];
            if (scale == 2 && !(w > (double)c->sky_limit))
                out[0] = 1.0;
            double len2 = out[1] * out[1] + out[2] * out[2] + out[3] * out[3];
            if (len2 < 1e-12) { /* nothing visible or known: the eye */
                ray(r, c, x, y, p);
                len2 = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
                out[1] = -p[0], out[2] = -p[1], out[3] = -p[2];
            }
            r->result[0][i] = (float)out[0];
            for (int k = 1; k < 4; ++k)
                r->result[k][i] = (float)(out[k] / sqrt(len2));
        }
}

/* ---- what is made of it ------------------------------------------------------------------------------------------- */

static double chord(double a) {
    return 2.0 * sin(0.5 * a);
}

static double compress(double e, double w) {
    return e / (w + fabs(e));
}

static double table_at(const replay *r, const double u[3]) {
    double sum = 0.0;
    int cell[3];
    double f[3];
    for (int k = 0; k < 3; ++k) {
        double t = clamp(u[k], 0.0, 1.0) * (r->table_size[k] - 1);
        cell[k] = (int)fmin(floor(t), r->table_size[k] - 2);
        f[k] = t - cell[k];
    }
    for (int i = 0; i < 8; ++i) {
        int a = cell[0] + (i & 1), b = cell[1] + (i >> 1 & 1), g = cell[2] + (i >> 2);
        double weight = (i & 1 ? f[0] : 1 - f[0]) * (i >> 1 & 1 ? f[1] : 1 - f[1]) * (i >> 2 ? f[2] : 1 - f[2]);
        sum += weight * (double)r->table.data[(g * r->table_size[1] + b) * r->table_size[0] + a];
    }
    return sum;
}

static void finish(replay *r) {
    const gtao_constants *c = &r->full;
    for (size_t i = 0; i < r->full_count; ++i) {
        double v = (double)r->result[0][i], b[3], n[3], p[3], rr = 0.0, bn = 0.0, nv = 0.0, beta = 0.0, aperture;
        for (int k = 0; k < 4; ++k) {
            double unit = k ? 0.5 + 0.5 * (double)r->result[k][i] : v;
            r->packed[k][i] =
                (float)floor(clamp(unit, 0.0, 1.0) * 255.0 + (r->mistake == MISTAKE_TRUNCATED ? 0.0 : 0.5));
        }
        for (int k = 0; k < 4; ++k) { /* [J16] */
            double albedo = k ? (double)r->albedo[k - 1] : 0.5;
            double fit =
                ((v * (2.0404 * albedo - 0.3324) + (-4.7951 * albedo + 0.6417)) * v + (2.7552 * albedo + 0.6903)) * v;
            r->bounce[k][i] = (float)fmin(r->mistake == MISTAKE_BOUNCE ? fit : fmax(v, fit), 1.0);
        }
        if (!r->table.data)
            continue;
        ray(r, c, (int)(i % (size_t)c->width), (int)(i / (size_t)c->width), p);
        rr = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
        for (int k = 0; k < 3; ++k) {
            b[k] = (double)r->result[1 + k][i];
            n[k] = r->surface[6][i] < 0.0f ? b[k] : (double)r->surface[k][i];
            bn += b[k] * n[k], nv -= n[k] * p[k] / rr;
        }
        for (int k = 0; k < 3; ++k) /* R = 2 (n.v) n - v */
            beta += b[k] * (2.0 * nv * n[k] + p[k] / rr);
        beta = acos(clamp(beta, -1.0, 1.0));
        v = c->weighting == GTAO_WEIGHTING_UNIFORM ? 1.0 - v
            : r->mistake == MISTAKE_APERTURE       ? sqrt(1.0 - v)
                                                   : sqrt(1.0 - clamp(v / fmax(bn, 1e-6), 0.0, 1.0));
        aperture = acos(clamp(v, 0.0, 1.0));
        for (int k = 0; k < 3; ++k) {
            double rough = (double)r->roughness[k], w = 2.0 * fmax(rough * rough, 1e-4), u[3], lo, hi, a;
            a = chord(aperture), lo = compress(a - 2.0, w), hi = compress(a, w);
            u[0] = aperture / (0.5 * pi);
            u[1] = hi > lo ? (compress(a - chord(beta), w) - lo) / (hi - lo) : 0.0;
            u[2] = rough;
            r->specular[k][i] = (float)table_at(r, u);
        }
    }
}

/* ---- reading, running, writing ------------------------------------------------------------------------------------ */

static int read_constants(replay *r, const char *settings) {
    char name[64];
#define INTEGER(field) r->c.field = (int)settings_number(settings, #field, 0);
#define FLOAT(field) r->c.field = (float)settings_number(settings, #field, 0);
#define FLOATS(field, count) settings_floats(settings, #field, r->c.field, count);
    GTAO_CONSTANTS(INTEGER, FLOAT, FLOATS)
#undef INTEGER
#undef FLOAT
#undef FLOATS
#define INTEGER(field) r->f.field = (int)settings_number(settings, #field, 0);
#define FLOAT(field) r->f.field = (float)settings_number(settings, #field, 0);
#define FLOATS(field, count) settings_floats(settings, #field, r->f.field, count);
    GTAO_FRAME_CONSTANTS(INTEGER, FLOAT, FLOATS)
#undef INTEGER
#undef FLOAT
#undef FLOATS
#define INTEGER(field)                                                                                                 \
    snprintf(name, sizeof name, "full_" #field);                                                                       \
    r->full.field = (int)settings_number(settings, name, 0);
#define FLOAT(field)                                                                                                   \
    snprintf(name, sizeof name, "full_" #field);                                                                       \
    r->full.field = (float)settings_number(settings, name, 0);
#define FLOATS(field, count)                                                                                           \
    snprintf(name, sizeof name, "full_" #field);                                                                       \
    settings_floats(settings, name, r->full.field, count);
    GTAO_CONSTANTS(INTEGER, FLOAT, FLOATS)
#undef INTEGER
#undef FLOAT
#undef FLOATS
    r->framed = r->f.scale > 0;
    settings_floats(settings, "albedo", r->albedo, 3);
    settings_floats(settings, "specular_roughness", r->roughness, 3);
    if (r->c.arcs || r->c.cosines || r->c.every_pixel || r->c.noise == GTAO_NOISE_HILBERT || r->f.temporal ||
        r->f.reduction || r->f.spatial_passes > 1)
        return cli_error(
            "not replayed: thickness, thin-blend, memo estimator, Hilbert noise, every pixel, sequences, and"
            " more than one pass of the filter");
    return 1;
}

static void free_replay(replay *r) {
    for (int i = 0; i < r->allocations; ++i)
        free(r->memory[i]);
    image_free(&r->depth);
    image_free(&r->normals);
    image_free(&r->table);
}

static int load(replay *r, const char *directory) {
    static const char *const depth[] = {"depth"}, *const names_n[] = {"normal.X", "normal.Y", "normal.Z"};
    static const char *const table[] = {"table"};
    char path[4096], **names;
    image_error error;
    float size[3] = {0, 0, 0};
    int count, ok;
    snprintf(path, sizeof path, "%s/settings.json", directory);
    char *settings = settings_read(path);
    if (!settings)
        return cli_error("%s: cannot be read", path);
    ok = read_constants(r, settings);
    for (int k = settings_floats(settings, "specular_size", size, 3) - 1; k >= 0 && k < 3; --k)
        r->table_size[k] = (int)size[k];
    free(settings);
    if (!ok)
        return 0;
    snprintf(path, sizeof path, "%s/input.exr", directory);
    names = image_list_channels(path, &count, &error);
    ok = names && image_read_channels(path, depth, 1, &r->depth, &error);
    ok = ok && (count == 1 || image_read_channels(path, names_n, 3, &r->normals, &error));
    image_free_names(names);
    if (ok && size[0] > 0.0f) {
        snprintf(path, sizeof path, "%s/specular_table.exr", directory);
        ok = image_read_channels(path, table, 1, &r->table, &error);
    }
    if (!ok)
        return cli_error("%s", error.text);
    if (r->depth.width != r->full.width || r->depth.height != r->full.height || r->c.slices < 1 || r->c.slices > 64 ||
        r->c.steps < 1 || r->c.steps > 256 || r->c.classes < 1 || r->c.classes > 128 || r->c.period < 1 ||
        r->c.period > 4 || r->c.width < 1 || r->c.height < 1 || r->c.width > r->full.width ||
        r->c.height > r->full.height ||
        (r->table.data && (r->table.width != r->table_size[0] ||
                           r->table.height != r->table_size[1] * r->table_size[2] || r->table_size[2] < 2)))
        return cli_error("%s: its files do not go together", directory);
    r->count = (size_t)r->c.width * (size_t)r->c.height;
    r->full_count = (size_t)r->full.width * (size_t)r->full.height;
    return 1;
}

static int allocate(replay *r) {
    size_t n = r->count, m = r->full_count, k = (size_t)r->c.slices;
    size_t directions = (size_t)(r->c.period * r->c.period) * k, lists = directions * (size_t)r->c.classes;
    float **groups[] = {r->surface, r->bare, r->noise, r->raw, r->filtered};
    const int sizes[] = {7, 3, 3, 5, 5};
    int start = r->allocations;
    r->height = plane(r, n), r->reduced_normal = plane(r, 3 * n);
    r->slices = plane(r, 3 * k * n), r->horizons = plane(r, 2 * k * n);
    r->occluded = (unsigned char *)plane(r, k * n);
    r->taps = (gtao_tap *)(void *)plane(r, lists * (size_t)r->c.steps * sizeof(gtao_tap) / sizeof(float));
    r->tap_count = (int *)(void *)plane(r, lists);
    r->directions = (double *)(void *)plane(r, 4 * directions);
    start += 8;
    for (int g = 0; g < 5; ++g, start += sizes[g - 1])
        for (int i = 0; i < sizes[g]; ++i)
            groups[g][i] = plane(r, n);
    for (int i = 0; i < 4; ++i, start += 3)
        r->result[i] = plane(r, m), r->packed[i] = plane(r, m), r->bounce[i] = plane(r, m);
    for (int i = 0; i < 3; ++i, ++start)
        r->specular[i] = plane(r, m);
    return r->allocations == start || cli_error("not enough memory");
}

static void run(replay *r, int mistake) {
    r->mistake = mistake;
    reduce(r);
    surface(r);
    noise(r);
    samples(r);
    slices_and_horizons(r);
    integrate(r);
    round_signal(r);
    if (r->framed && r->f.spatial_passes)
        spatial(r);
    upsample(r);
    finish(r);
}

/* Planes of one size under their names. */
static int save(dump *d, const char *stage, int w, int h, float *const *planes, const char *const *names, int count) {
    image_plane p[16];
    image_error error;
    for (int i = 0; i < count; ++i) {
        p[i].name = names[i], p[i].data = planes[i], p[i].step = 1, p[i].stride = (ptrdiff_t)w * 4;
    }
    return dump_stage(d, stage, w, h, p, count, &error) || cli_error("%s", error.text);
}

static int save_numbered(dump *d, const replay *r, const char *stage, float *planes, const char *const *names,
                         int each) {
    image_plane p[IMAGE_MAX_PLANES];
    char name[IMAGE_MAX_PLANES][24];
    image_error error;
    int count = each * r->c.slices;
    for (int i = 0; i < count; ++i) {
        snprintf(name[i], sizeof name[i], "%02d.%s", i / each, names[i % each]);
        p[i].name = name[i], p[i].data = planes + (size_t)i * r->count, p[i].step = 1;
        p[i].stride = (ptrdiff_t)r->c.width * 4;
    }
    return dump_stage(d, stage, r->c.width, r->c.height, p, count, &error) || cli_error("%s", error.text);
}

static int save_samples(dump *d, const replay *r) {
    static const char *const names[] = {"qx", "qy", "inv_length", "ux", "uy"};
    size_t lists = (size_t)(r->c.period * r->c.period * r->c.slices * r->c.classes), steps = (size_t)r->c.steps;
    float *all = calloc(5 * lists * steps, sizeof *all), *planes[5];
    int ok;
    if (!all)
        return cli_error("not enough memory");
    for (size_t i = 0; i < lists; ++i)
        for (size_t j = 0; j < (size_t)r->tap_count[i]; ++j) {
            const gtao_tap *t = r->taps + i * steps + j;
            const float values[5] = {(float)t->qx, (float)t->qy, t->inv_length, t->ux, t->uy};
            for (size_t k = 0; k < 5; ++k)
                all[(k * lists + i) * steps + j] = values[k];
        }
    for (size_t k = 0; k < 5; ++k)
        planes[k] = all + k * lists * steps;
    ok = lists > IMAGE_MAX_SIZE || save(d, "samples", (int)steps, (int)lists, planes, names, 5);
    free(all);
    return ok;
}

static int write_dump(replay *r, const char *directory) {
    static const char *const height[] = {"height"};
    static const char *const surfaces[] = {"normal.X",   "normal.Y", "normal.Z", "gradient.X",
                                           "gradient.Y", "extent",   "class"};
    static const char *const noises[] = {"direction", "offset", "phase"}, *const terms[] = {"n", "jacobian", "open"};
    static const char *const sides[] = {"plus", "minus"};
    static const char *const signals[] = {"visibility", "weight", "bent.X", "bent.Y", "bent.Z"};
    static const char *const results[] = {"visibility", "bent.X", "bent.Y", "bent.Z"};
    static const char *const rgb[] = {"visibility", "R", "G", "B"};
    static const char *const specular[] = {"roughness.20", "roughness.50", "roughness.80"};
    const int w = r->c.width, h = r->c.height, fw = r->full.width, fh = r->full.height;
    image_error error;
    dump *d = dump_create(directory, &error);
    int ok = d || cli_error("%s", error.text);
    if (!ok)
        return 0;
    dump_integer(d, "dump", 1);
    ok = (!r->framed || save(d, "reduce", w, h, &r->height, height, 1)) &&
         save(d, "height", w, h, &r->height, height, 1);
    ok = ok && save(d, "surface", w, h, r->surface, surfaces, 7) && save(d, "noise", w, h, r->noise, noises, 3);
    ok = ok && save_samples(d, r) && save_numbered(d, r, "slices", r->slices, terms, 3);
    ok = ok && save_numbered(d, r, "horizons", r->horizons, sides, 2) && save(d, "raw", w, h, r->raw, signals, 5);
    if (r->framed && r->f.spatial_passes)
        ok = ok && save(d, "spatial1", w, h, r->filtered, signals, 5);
    ok = ok && save(d, "result", fw, fh, r->result, results, 4) && save(d, "packed", fw, fh, r->packed, results, 4);
    ok = ok && save(d, "multi_bounce", fw, fh, r->bounce, rgb, 4);
    if (r->table.data)
        ok = ok && save(d, "specular", fw, fh, r->specular, specular, 3);
    if (!ok)
        dump_discard(d);
    return ok && (dump_commit(d, &error) || cli_error("%s", error.text));
}

/* ---- the sheet of mistakes ---------------------------------------------------------------------------------------- */

/* What shows a mistake best: visibility, or a bent normal, or specular visibility. */
static color shade(const replay *r, const struct mistake *m, size_t i) {
    color c;
    float v = r->result[0][i];
    c.r = c.g = c.b = v;
    if (m->number == MISTAKE_ROTATION || m->number == MISTAKE_TRUNCATED) {
        c.r = 0.5f + 0.5f * r->result[1][i], c.g = 0.5f - 0.5f * r->result[2][i], c.b = 0.5f - 0.5f * r->result[3][i];
        if (m->number == MISTAKE_TRUNCATED) {
            c.r = r->packed[1][i] / 255.0f, c.g = 1.0f - r->packed[2][i] / 255.0f,
            c.b = 1.0f - r->packed[3][i] / 255.0f;
        }
    } else if (m->number == MISTAKE_BOUNCE) {
        c.r = c.g = c.b = r->bounce[3][i];
    } else if (m->number == MISTAKE_APERTURE && r->table.data) {
        c.r = c.g = c.b = r->specular[0][i];
    }
    return c;
}

/* Half the size of what a mistake makes: on the left what comes out, on the right the difference times a power of 4, grey
 * where there is none. `right` is as large as the image. */
static void draw_mistake(replay *r, const struct mistake *m, image *sheet, int x0, int y0, int text, color *right) {
    const color ink = color_hex(0x202020);
    const size_t row = (size_t)r->full.width, four[4] = {0, 1, row, row + 1};
    int w = r->full.width / 2, h = r->full.height / 2;
    double sum = 0.0;
    float gain = 1.0f;
    char label[160];
    run(r, MISTAKE_NONE);
    for (size_t i = 0; i < r->full_count; ++i)
        right[i] = shade(r, m, i);
    run(r, m->number);
    for (size_t i = 0; i < r->full_count; ++i) {
        color c = shade(r, m, i), d = right[i];
        sum += (double)((c.r - d.r) * (c.r - d.r) + (c.g - d.g) * (c.g - d.g) + (c.b - d.b) * (c.b - d.b)) / 3.0;
    }
    sum = sqrt(sum / (double)r->full_count);
    while (gain < 256.0f && (double)gain * sum < 0.04)
        gain *= 4.0f;
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) {
            float *to = sheet->data + 3 * ((size_t)(y0 + text + y) * (size_t)sheet->width + (size_t)(x0 + x));
            color c = {0, 0, 0}, was = {0, 0, 0};
            for (int k = 0; k < 4; ++k) {
                size_t from = (size_t)(2 * y) * row + (size_t)(2 * x) + four[k];
                color part = shade(r, m, from), p = right[from];
                c.r += 0.25f * part.r, c.g += 0.25f * part.g, c.b += 0.25f * part.b;
                was.r += 0.25f * p.r, was.g += 0.25f * p.g, was.b += 0.25f * p.b;
            }
            if (x > w / 2) {
                c.r = 0.5f + gain * (c.r - was.r), c.g = 0.5f + gain * (c.g - was.g), c.b = 0.5f + gain * (c.b - was.b);
            }
            to[0] = c.r, to[1] = c.g, to[2] = c.b;
        }
    snprintf(label, sizeof label, "%d %s: %s, RMSE %.4f, x%d", m->number, m->name, m->stage, sum, (int)gain);
    canvas_text(sheet, (float)x0, (float)(y0 + 13), CANVAS_LEFT, CANVAS_BOLD, 12.0f, ink, label);
    canvas_text(sheet, (float)x0, (float)(y0 + 28), CANVAS_LEFT, CANVAS_REGULAR, 12.0f, ink, m->text);
}

/* Of every mistake what comes out, and the difference from what should. `half` has no pixels, or is the same image at half
 * resolution. */
static int write_sheet(replay *r, replay *half, const char *path) {
    enum { COLUMNS = 4, MARGIN = 8, TEXT = 34 };
    int w = r->full.width / 2, h = r->full.height / 2, shown = 0, rows = (MISTAKES + COLUMNS - 1) / COLUMNS, ok;
    image sheet;
    image_pending pending;
    image_error error;
    color *right;
    if (half->full_count && half->full_count != r->full_count)
        return cli_error("--half: its image has another size");
    right = malloc(r->full_count * sizeof *right);
    if (!right ||
        !image_create(&sheet, COLUMNS * (w + MARGIN) + MARGIN, rows * (h + TEXT + MARGIN) + MARGIN, 3, &error)) {
        free(right);
        return cli_error("not enough memory");
    }
    canvas_fill(&sheet, 0, 0, sheet.width, sheet.height, color_hex(0xffffff));
    canvas_load_fonts();
    for (int i = 0; i < MISTAKES; ++i) {
        const struct mistake *m = mistakes + i;
        if (m->half && !half->full_count)
            continue;
        draw_mistake(m->half ? half : r, m, &sheet, MARGIN + shown % COLUMNS * (w + MARGIN),
                     MARGIN + shown / COLUMNS * (h + TEXT + MARGIN), TEXT, right);
        shown++;
    }
    sheet.height = (shown + COLUMNS - 1) / COLUMNS * (h + TEXT + MARGIN) + MARGIN;
    ok = (image_write(path, &sheet, NULL, IMAGE_RANGE_UNIT, &pending, &error) && image_commit(&pending, &error)) ||
         cli_error("--sheet %s", error.text);
    canvas_free_fonts();
    image_free(&sheet);
    free(right);
    return ok;
}

/* ---- the table of what may be rounded ------------------------------------------------------------------------------ */

static double angle_between(const replay *r, float *const *b, size_t i) {
    double dot = 0.0, cross = 0.0;
    for (int k = 1; k < 4; ++k) {
        double x = (double)r->result[k][i], y = (double)b[k][i];
        dot += x * y, cross += (x - y) * (x - y);
    }
    return dot > 0.0 ? 2.0 * asin(fmin(0.5 * sqrt(cross), 1.0)) : acos(clamp(dot, -1.0, 1.0));
}

static int by_size(const void *a, const void *b) {
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* Against the same without: how far the results are off. */
static int print_roughness(replay *r) {
    size_t count = r->full_count;
    float *right[4], *off[2];
    for (int k = 0; k < 4; ++k)
        right[k] = plane(r, count);
    for (int k = 0; k < 2; ++k)
        off[k] = plane(r, count);
    if (!off[1])
        return cli_error("not enough memory");
    run(r, MISTAKE_NONE);
    for (int k = 0; k < 4; ++k)
        memcpy(right[k], r->result[k], count * sizeof(float));
    puts("| rounded | visibility: RMSE | mean | 99.9 % | bent normal: RMSE, degrees | 99.9 % |\n"
         "|---|--:|--:|--:|--:|--:|");
    for (int m = 0; m < ROUGHNESSES; ++m) {
        double sum = 0.0, mean = 0.0, turned = 0.0;
        run(r, roughnesses[m].number);
        for (size_t i = 0; i < count; ++i) {
            double d = (double)r->result[0][i] - (double)right[0][i], a = angle_between(r, right, i) * 180.0 / pi;
            sum += d * d, mean += d, turned += a * a;
            off[0][i] = (float)fabs(d), off[1][i] = (float)a;
        }
        for (int k = 0; k < 2; ++k)
            qsort(off[k], count, sizeof(float), by_size);
        printf("| %s | %.1e | %+.1e | %.1e | %.3f | %.2f |\n", roughnesses[m].text, sqrt(sum / (double)count),
               mean / (double)count, (double)off[0][count - 1 - count / 1000], sqrt(turned / (double)count),
               (double)off[1][count - 1 - count / 1000]);
    }
    return 1;
}

/* ---- options ------------------------------------------------------------------------------------------------------ */

enum { OPT_DUMP, OPT_OUTPUT, OPT_MISTAKE, OPT_LIST, OPT_SHEET, OPT_HALF, OPT_ROUGH, OPT_COUNT };

typedef struct options {
    const char *dump, *output, *sheet, *half;
    int mistake, list, rough;
} options;

static int set_mistake(void *settings, const cli_option *option, const char *value) {
    options *o = settings;
    long number;
    for (int i = 0; i < MISTAKES; ++i)
        if (strcmp(value, mistakes[i].name) == 0 ||
            (cli_integer(value, 1, 99, &number) && number == mistakes[i].number)) {
            o->mistake = mistakes[i].number;
            return 1;
        }
    return cli_bad_value(option, value, "a name or number of --list");
}

static int set_dump(void *settings, const cli_option *option, const char *value) {
    options *o = settings;
    (void)option;
    if (o->dump)
        return cli_error("%s: there is one already, %s", value, o->dump);
    o->dump = value;
    return 1;
}

static const cli_option option_table[OPT_COUNT] = {
    [OPT_DUMP] = {"DUMP", "", "directory of `ao --dump`; its input.exr, settings and specular table are read",
                  CLI_OWN(set_dump)},
    [OPT_OUTPUT] = {"-o", "DIR", "the dump to write", CLI_TEXT(options, output)},
    [OPT_MISTAKE] = {"--mistake", "NAME", "make this mistake", CLI_OWN(set_mistake)},
    [OPT_LIST] = {"--list", NULL, "print the mistakes: number, name, stage, 1 if only at half resolution, what it is",
                  CLI_FLAG(options, list)},
    [OPT_SHEET] = {"--sheet", "FILE.png", "a picture of every mistake", CLI_OUTPUT(options, sheet, ".png")},
    [OPT_HALF] = {"--half", "DIR", "for --sheet: a dump at half resolution, for the mistakes that need one",
                  CLI_TEXT(options, half)},
    [OPT_ROUGH] = {"--rough", NULL, "print what comes of what a GPU may round", CLI_FLAG(options, rough)},
};

static const cli_program program = {"replay",
                                    "the stages of a dump once more, as a plain port computes them",
                                    "DUMP [-o DIR] [--mistake NAME] | --list",
                                    NULL,
                                    option_table,
                                    OPT_COUNT,
                                    0};

int main(int argc, char **argv) {
    static options o;
    static unsigned char given[OPT_COUNT];
    static replay r, half;
    int status = cli_parse(&program, argc, argv, &o, given), ok;
    if (status != CLI_GO)
        return status;
    if (o.list) {
        for (int i = 0; i < MISTAKES; ++i)
            printf("%d %s %s %d %s\n", mistakes[i].number, mistakes[i].name, mistakes[i].stage, mistakes[i].half,
                   mistakes[i].text);
        return 0;
    }
    if (!o.dump || (!o.output && !o.sheet && !o.rough))
        return cli_error("DUMP, and -o, --sheet or --rough are needed, see --help"), 2;
    ok = load(&r, o.dump) && allocate(&r);
    if (ok && o.output) {
        run(&r, o.mistake);
        ok = write_dump(&r, o.output);
    }
    if (ok && o.sheet)
        ok = (!o.half || (load(&half, o.half) && allocate(&half))) && write_sheet(&r, &half, o.sheet);
    if (ok && o.rough)
        ok = print_roughness(&r);
    free_replay(&r);
    free_replay(&half);
    return ok ? 0 : 2;
}
