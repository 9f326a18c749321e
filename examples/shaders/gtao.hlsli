/* gtao.hlsli - what the stages share: settings, buffers, rays, slices, elementary functions.
 *
 * gtao.h's kernels once more, for compute shaders, one thread a pixel. Functions and fields bear the names they have
 * there, so that the two read side by side; [J16], [J19] are its references. docs/porting.md tells the stages, their
 * buffers and what may be approximated; examples/port runs them and tests/unit/test_port.c compares them with the C.
 *
 * A buffer holds the planes of the dump's file of the same name one after another, `plane` floats each, rows from the
 * top. On a console they would be textures, a plane a channel. t registers are read, u registers written, numbered as
 * one.
 *
 * Define HALF=1 for half-precision arithmetic and storage where it is enough (type real), MISTAKE=n for one of the
 * mistakes that ports make, listed in docs/porting.md: to see what each does to the picture. */
#ifndef GTAO_HLSLI
#define GTAO_HLSLI

#ifndef HALF
#define HALF 0
#endif
#ifndef MISTAKE
#define MISTAKE 0
#endif

/* What HALF makes small: visibilities, weights, bent normals, angles. Never heights, slopes, positions in pixels, nor
 * sums over slices: their differences need the bits. */
#if HALF
typedef min16float real;
typedef min16float3 real3;
#else
typedef float real;
typedef float3 real3;
#endif

/* Keys of the dump's settings.json, but where a buffer has the name: filter_width and filter_height are its width and
 * height, slice_count, layer_count, arcs_on, noise_kind, history_kind, unit_length its slices, layers, arcs, noise,
 * history, unit. Scalars of 4 bytes and rows of float4: the same in every packing. */
cbuffer settings : register(b0) {
    float4 to_view[3]; /* rows */
    float4 before[3];  /* rows of view_to_previous, translation in height units */
    float4 window[5];  /* x: weights of the spatial filter's pass, offsets -2 .. 2 */
    float4 albedo_rgb; /* one row: albedo */

    int full_width, full_height;     /* of the image */
    int filter_width, filter_height; /* of the stages between reduce and upsample */
    int scale;                       /* pixels of the image for one of those */
    int depth_kind, border, estimator, weighting, noise_kind;
    int orthographic, bounded, every_pixel, arcs_on, cosines;
    int slice_count, steps, period, classes, class_base;
    int input_normals, input_motion; /* whether there are any */
    int spherical;                   /* spherical harmonics are wanted */
    int clip;                        /* bit k: backs of layer k are depths of back faces, not assumed */
    int layer_count;
    float thin_blend, step_power;
    float extent_min, extent_max, max_radius;
    float bx1, by1, cx, cy;
    float unit_length, reach, inner2, inv_falloff, rise_min;
    float w_scale, w_bias, w_numerator, w_far, w_max, z_sky;
    float same_surface, connect, thickness, weight_scale;
    float full_bx1, full_by1, full_cx, full_cy, full_same_surface;
    float tolerance_scale, tolerance_bias;
    int fresh, moved, history_kind, max_history, reduction;
    float clamp_window, disocclusion_scale, disocclusion_bias;
    float before_fx, before_fy, before_cx, before_cy;
    int table_aperture, table_beta, table_roughness; /* specular table's size */
    int specular_plane;
    float roughness;
};

/* ---- constants, GTAOI_ in gtao.h --------------------------------------------------------------------------------- */

static const float PI = 3.14159265;
static const float SKY = -1.2676506e30;      /* -2^100: height of sky and of anything invalid */
static const float SKY_LIMIT = -6.338253e29; /* -2^99: heights below are sky */
static const float RAY_LIMIT = 1e15;
static const float W_MIN = 8.67361738e-19;
static const float ORTHO_LIMIT = 274877906944.0;
static const float KAPPA_LIMIT = 1099511627776.0;
static const float FACING_MIN = 1e-4;        /* least n.v */
static const float FLOAT_MAX = 3.402823466e38;
static const float ARC_LIMIT = 1048576.0;
static const int SECTORS = 32;
static const int NEAR_SAMPLES = 8; /* first samples in every-pixel mode whose taps also bound them from above */

static const int DEPTH_Z = 0, DEPTH_DISTANCE = 1, DEPTH_DEVICE = 2, DEPTH_HEIGHT = 3;
static const int BORDER_OPEN = 0, BORDER_CLAMP = 1, BORDER_WRAP = 2;
static const int ESTIMATOR_NORMALIZED = 0, ESTIMATOR_MEMO = 1;
static const int WEIGHTING_COSINE = 0, WEIGHTING_UNIFORM = 1;
static const int NOISE_HILBERT = 1;

/* ---- elementary functions ---------------------------------------------------------------------------------------- */

/* acos, x in [-1, 1]: Abramowitz & Stegun 4.4.46, error 3e-7 rad. MISTAKE 13: the two-term fit that many shaders use,
 * 0.009 rad. */
float gtao_acos(float x) {
    float a = min(abs(x), 1.0), p;
#if MISTAKE == 13
    p = (-0.156583 * a + 1.570796) * sqrt(1.0 - a);
#else
    p = -0.0012624911;
    p = p * a + 0.0066700901;
    p = p * a - 0.0170881256;
    p = p * a + 0.0308918810;
    p = p * a - 0.0501743046;
    p = p * a + 0.0889789874;
    p = p * a - 0.2145988016;
    p = p * a + 1.5707963050;
    p *= sqrt(1.0 - a);
#endif
    return x < 0.0 ? PI - p : p;
}

/* Reduction to [-pi/4, pi/4] in two parts, then odd and even polynomials; error 2e-7. The sin and cos of a GPU may be
 * off by 5e-4 and still conform. */
void gtao_sincos(float a_rad, out float sine, out float cosine) {
    int q = (int)(a_rad * 0.636619772 + (a_rad < 0.0 ? -0.5 : 0.5));
    float k = (float)q, r = (a_rad - k * 1.5703125) - k * 4.83826794897e-4, rr = r * r;
    float s = ((-1.9515295891e-4 * rr + 8.3321608736e-3) * rr - 1.6666654611e-1) * rr * r + r;
    float c = ((2.443315711809948e-5 * rr - 1.388731625493765e-3) * rr + 4.166664568298827e-2) * rr * rr - 0.5 * rr +
              1.0;
    if (q & 1) {
        float swap = s;
        s = c;
        c = -swap;
    }
    sine = q & 2 ? -s : s;
    cosine = q & 2 ? -c : c;
}

/* Abramowitz & Stegun 4.4.49, error 2e-8 on [0, 1] before rounding. Not for (0, 0). */
float gtao_atan2(float y, float x) {
    float ay = abs(y), ax = abs(x), q = min(ax, ay) / max(ax, ay), qq = q * q, q4 = qq * qq;
    float low = (-0.3333314528 + qq * 0.1999355085) + q4 * (-0.1420889944 + qq * 0.1065626393);
    float high = (-0.0752896400 + qq * 0.0429096138) + q4 * (-0.0161657367 + qq * 0.0028662257);
    float a = (low + q4 * q4 * high) * qq * q + q;
    a = ax < ay ? 1.57079633 - a : a;
    a = x < 0.0 ? PI - a : a;
    return y < 0.0 ? -a : a;
}

/* ---- pixels ------------------------------------------------------------------------------------------------------ */

int filter_plane() {
    return filter_width * filter_height;
}
int image_plane() {
    return full_width * full_height;
}
int at_filter(int2 p) {
    return p.y * filter_width + p.x;
}
int at_image(int2 p) {
    return p.y * full_width + p.x;
}

/* Where a pixel beyond the border lies in the image; x < 0: nowhere. */
int2 at_border(int2 p, int2 size) {
    if (all(p >= 0) && all(p < size))
        return p;
#if MISTAKE == 9 /* a sampler that clamps, where nothing is known */
    return clamp(p, 0, size - 1);
#else
    if (border == BORDER_CLAMP)
        return clamp(p, 0, size - 1);
    if (border == BORDER_WRAP)
        return int2((p.x % size.x + size.x) % size.x, (p.y % size.y + size.y) % size.y);
    return int2(-1, -1);
#endif
}

/* r0 = (x, y, 1), P = z r0; orthographic (0, 0, 1). The pixel's centre is at +0.5. */
float2 ray(float2 p, float bx1, float by1, float cx, float cy) {
    if (orthographic)
        return float2(0.0, 0.0);
#if MISTAKE == 2 /* the pixel's corner for its centre */
    float2 r = float2((p.x - cx) * bx1, (p.y - cy) * by1);
#else
    float2 r = float2((p.x + 0.5 - cx) * bx1, (p.y + 0.5 - cy) * by1);
#endif
    return clamp(r, -RAY_LIMIT, RAY_LIMIT);
}

/* Derivative of w along one axis: of the two sides the one whose next pixel it predicts better; zero if neither side is
 * there. `error`: by how much it misses. a2, a1, w0, b1, b2 are neighbours in order. */
float gtaoi_gradient(float w0, float a1, float a2, float b1, float b2, out float error) {
    float ga = w0 - a1, gb = b1 - w0;
    float ea = SKY_LIMIT < a2 ? abs((a1 - a2) - ga) : abs(ga);
    float eb = SKY_LIMIT < b2 ? abs((b2 - b1) - gb) : abs(gb);
    bool has_a = SKY_LIMIT < a1, has_b = SKY_LIMIT < b1;
    ga = has_a ? ga : 0.0;
    gb = has_b ? gb : 0.0;
    ea = has_a ? ea : FLOAT_MAX;
    eb = has_b ? eb : FLOAT_MAX;
    error = min(ea, eb);
#if MISTAKE == 5 && defined(DERIVES_NORMALS) /* central differences, across edges too */
    return 0.5 * (ga + gb);
#else
    return ea < eb ? ga : eb < ea ? gb : 0.5 * (ga + gb);
#endif
}

#endif
