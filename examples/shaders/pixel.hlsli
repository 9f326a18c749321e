/* pixel.hlsli - a pixel and its slices, for horizons.hlsl and integrate.hlsl. They read surface, noise and slice_table:
 *
 *     surface      normal x, y, z; gradient x, y; extent; class
 *     noise        direction, offset, phase
 *     slice_table  dx, dy, bx, by, bb of row phase * slices + slice; not with Hilbert noise */
#ifndef PIXEL_HLSLI
#define PIXEL_HLSLI

struct Pixel {
    int2 at;
    float w0;             /* height; orthographic: 1 in formulas */
    float2 r;             /* r0 = (r.x, r.y, 1) */
    float len, inv_len;   /* |r0| */
    float3 n;             /* unit normal, n.v > 0 */
    float nv, inv_nv;     /* v = -r0 / |r0| */
    float2 g;             /* gradient of w on the tangent plane, per pixel */
    float extent;         /* of the radius, on the plane z = 1 (orthographic: in pixels) */
    int radius_class;     /* -1: not computed */
    float direction;      /* noise */
    int level, phase;
};

/* A slice as the pixel sees it. */
struct Frame {
    float2 d;            /* unit screen direction */
    float2 b;            /* the same in units of r */
    float bb;            /* |b|^2 */
    float along;         /* b.r0 / |r0| */
    float inv_perp;      /* 1 / |b_perp| */
    float no;            /* n.o, o = b_perp / |b_perp| */
    float kappa_scale;   /* |r0| / (w0 |b_perp|): height per pixel to cot h */
    float kappa_tangent; /* cot of the tangent plane's horizon on the + side: -tan n; the - side's is its negative */
    float reach;         /* radius / |b_perp| */
    float cos_tangent;   /* cosine of the tangent plane's horizon on the + side: -sin n */
    float least_rise;    /* rises below do not count, rise_min in cot h; `floor` in gtao.h */
    float n, open;       /* angle n, and the integral over the open slice: |np| (cos n + n sin n), uniform: 2 */
};

Pixel read_pixel(int2 at, float w0) {
    Pixel p;
    int i = at_filter(at), plane = filter_plane();
    p.at = at;
    p.w0 = w0;
    p.r = ray((float2)at, bx1, by1, cx, cy);
#if MISTAKE == 3 /* the eye as if it were straight ahead of every pixel */
    p.r = float2(0.0, 0.0);
#endif
    p.len = sqrt(dot(p.r, p.r) + 1.0);
    p.inv_len = 1.0 / p.len;
    p.n = float3(surface[i], surface[i + plane], surface[i + 2 * plane]);
    /* n.v of a normal at the silhouette is what cancellation leaves: another order or a fused multiply-add gives
     * another one, and from the third digit on other horizons (not another visibility, which weighs them by n.v). */
    precise float nr = p.n.x * p.r.x + p.n.y * p.r.y + p.n.z;
    p.nv = max(-nr * p.inv_len, 0.5 * FACING_MIN);
    p.inv_nv = 1.0 / p.nv;
    p.g = float2(surface[i + 3 * plane], surface[i + 4 * plane]);
    p.extent = surface[i + 5 * plane];
    p.radius_class = (int)surface[i + 6 * plane];
    p.direction = noise[i];
    p.level = (int)(noise[i + plane] * 64.0);
    p.phase = (int)noise[i + 2 * plane];
#if MISTAKE == 21 /* rows and columns of the noise exchanged */
    p.phase = (p.phase % period) * period + p.phase / period;
#endif
    return p;
}

/* Direction of slice k with a direction for each pixel: pi (k + direction) / slices. sin(pi u) = cos(pi (u - 1/2)),
 * cos(pi u) = -sin(pi (u - 1/2)) by Taylor's series; error 1e-7. */
void gtaoi_turn(Pixel p, int k, inout Frame f) {
    float a = PI * (((float)k + p.direction) / (float)slice_count - 0.5), aa = a * a, sine, cosine;
    sine = -1.9841270e-4 + aa * (2.7557319e-6 + aa * -2.5052108e-8);
    sine = -1.6666667e-1 + aa * (8.3333333e-3 + aa * sine);
    sine = a + a * aa * sine;
    cosine = 2.4801587e-5 + aa * (-2.7557319e-7 + aa * 2.0876757e-9);
    cosine = 4.1666667e-2 + aa * (-1.3888889e-3 + aa * cosine);
    cosine = 1.0 + aa * (-0.5 + aa * cosine);
    f.d = float2(-sine, cosine);
    f.b = f.d * float2(bx1, by1);
    f.bb = dot(f.b, f.b);
}

/* o = b_perp / |b_perp|, b_perp = b - (b.v) v; tan n = n.o / n.v; the open arc. */
Frame gtaoi_slice(Pixel p, int k) {
    Frame f;
    if (noise_kind == NOISE_HILBERT) {
        gtaoi_turn(p, k, f);
    } else {
        int row = p.phase * slice_count + k, rows = period * period * slice_count;
        f.d = float2(slice_table[row], slice_table[row + rows]);
        f.b = float2(slice_table[row + 2 * rows], slice_table[row + 3 * rows]);
        f.bb = slice_table[row + 4 * rows];
    }
    f.along = dot(f.b, p.r) * p.inv_len;
#if MISTAKE == 10 /* the slice's axis, a cross product, left unnormalised */
    float perp2 = f.bb;
#else
    float perp2 = max(f.bb - f.along * f.along, f.bb * 1e-6);
#endif
    float perp = sqrt(perp2);
    f.inv_perp = 1.0 / perp;
    f.no = (p.n.x * f.b.x + p.n.y * f.b.y + f.along * p.nv) * f.inv_perp;
    float tangent = f.no * p.inv_nv;
    f.kappa_tangent = -tangent;
    f.kappa_scale = p.len * (orthographic ? 1.0 : 1.0 / p.w0) * f.inv_perp;
    f.reach = reach * f.inv_perp;
    f.least_rise = perp * rise_min * (orthographic ? 1.0 : p.w0 * p.inv_len);
    f.cos_tangent = -(tangent * (1.0 / sqrt(1.0 + tangent * tangent)));
    f.n = weighting == WEIGHTING_COSINE ? gtao_atan2(f.no, p.nv) : 0.0;
    f.open = weighting == WEIGHTING_COSINE ? p.nv + f.n * f.no : 2.0;
    return f;
}

/* Between the angle on the screen and the azimuth about v: by how much the slice counts. */
float slice_jacobian(Frame f) {
#if MISTAKE == 12 /* slices equally weighted, off the axis too */
    return 1.0;
#else
    return f.inv_perp * f.inv_perp;
#endif
}

/* What hangs free above the horizon (gtao.h, "arcs"): sectors of a side, equidistant in y = t^2 / (1 + t^2),
 * t = (kappa - kappa_tangent) cos n; borders move by a fraction from slice to slice. */
float sector_shift(int k) {
    float turn = 0.618034 * (float)k;
    return (turn - (float)(int)turn) * 0.96875 - 0.484375;
}
float gtaoi_sector(float t, float shift) {
    float tt;
    t = min(t, ARC_LIMIT);
    tt = t * t;
    return tt / (tt + 1.0) * (float)SECTORS - shift;
}
/* t of border i, 0 .. SECTORS. */
float gtaoi_border(int i, float shift) {
    float y = ((float)i + shift) * (1.0 / (float)SECTORS);
    return i >= SECTORS ? ARC_LIMIT : sqrt((i > 0 ? y : 0.0) / (1.0 - y));
}

#endif
