/* integrate.hlsl - horizons to visibility, bent normal and spherical harmonics.
 *
 *     in   height, normals (only for pixels that are not computed), surface, noise, slice_table, horizons, arcs
 *     out  raw   visibility; weight (gtao_output.signal); bent normal x, y, z, before it is normalised
 *          sh    9 coefficients of visibility times cosine (gtao_output.sh); only if `spherical` */
#define DERIVES_NORMALS
#include "gtao.hlsli"

StructuredBuffer<float> height : register(t0);
StructuredBuffer<float> normals : register(t1);
StructuredBuffer<float> surface : register(t2);
StructuredBuffer<float> noise : register(t3);
StructuredBuffer<float> slice_table : register(t4);
StructuredBuffer<float> horizons : register(t5);
StructuredBuffer<float> arcs : register(t6);
RWStructuredBuffer<float> raw : register(u10);
RWStructuredBuffer<float> sh : register(u11);

#include "pixel.hlsli"
#include "normals.hlsli"

/* Sums over the slices of a pixel. `lost_`: the open hemisphere less what is seen, subtracted in the end, so that what
 * is open stays exact. */
struct Sum {
    float visible, open; /* sum J a, sum J a of an open slice */
    float jacobian_open; /* the latter with the Jacobian, whatever the estimator */
    float3 lost_bent;    /* sum J (T_open - T) w: moments of first order */
    float lost;          /* of order zero, with the Jacobian */
    float3 lost_diagonal, lost_other; /* and of second order: xx, yy, zz; xy, yz, xz */
};

/* A horizon at angle h from v: sine, cosine and their products. */
struct Side {
    float h, s, c, ss, cc;
};

Side side_at(float h) {
    Side a;
    a.h = h;
    gtao_sincos(h, a.s, a.c);
    a.ss = a.s * a.s;
    a.cc = a.c * a.c;
    return a;
}

/* What a slice holds between two angles, as moments along o and v. */
struct Moments {
    float a, to, tv, vv, ov; /* of order 0; 1: along o, v; 2: v v^T, o v^T + v o^T, and a - vv: o o^T */
};

/* Between angles h0 < h1 on one side, cosine-weighted, with np the normal projected into the slice: n.v = |np| cos n,
 * n.o = |np| sin n. The [J19] arc integral and Eq. 20-21, but with no other angle than h1 - h0:
 *   a   = ((s1^2 - s0^2) n.v + D n.o) / 2,   D = h1 - h0 - s1 c1 + s0 c0
 *   T_o = (s1^3 - s0^3) n.v / 3 + (c0 - c1 + (c1^3 - c0^3) / 3) n.o
 *   T_v = (c0^3 - c1^3) n.v / 3 + (s1^3 - s0^3) n.o / 3
 *   M_vv = (c0^4 - c1^4) n.v / 4 + E n.o / 8,   M_ov = E n.v / 8 + (s1^4 - s0^4) n.o / 4
 *   E = D + 2 (s1^3 c1 - s0^3 c0)
 * and uniformly weighted 1, w and w w^T instead of (n.w) times that. */
Moments between(Side h0, Side h1, float nv, float no) {
    Moments m;
    float d = h1.h - h0.h - h1.s * h1.c + h0.s * h0.c, sss = (h1.s * h1.ss - h0.s * h0.ss) / 3.0;
    float ccc = (h0.c * h0.cc - h1.c * h1.cc) / 3.0;
    if (weighting == WEIGHTING_UNIFORM) {
        m.a = h0.c - h1.c;
        m.to = 0.5 * d;
        m.tv = 0.5 * (h1.ss - h0.ss);
        m.vv = ccc;
        m.ov = sss;
    } else {
        float e = 0.125 * (d + 2.0 * (h1.s * h1.ss * h1.c - h0.s * h0.ss * h0.c));
        m.a = 0.5 * ((h1.ss - h0.ss) * nv + d * no);
        m.to = sss * nv + (h0.c - h1.c - ccc) * no;
        m.tv = ccc * nv + sss * no;
        m.vv = 0.25 * (h0.cc * h0.cc - h1.cc * h1.cc) * nv + e * no;
        m.ov = e * nv + 0.25 * (h1.ss * h1.ss - h0.ss * h0.ss) * no;
    }
    return m;
}

/* Adds what a slice loses: moments `m` on the + side (sign 1) or the - side (-1), in view space. o is linear in b:
 * o = (b - along r0 / |r0|) / |b_perp|. */
void gtaoi_lose(Pixel p, Frame f, Moments m, float sign, inout Sum sum) {
    float jacobian = slice_jacobian(f), along = f.along * p.inv_len;
    float3 v = float3(-p.r * p.inv_len, -p.inv_len);
    float3 o = float3(f.b - along * p.r, -along) * f.inv_perp * sign;
#if MISTAKE == 14 /* axes of the screen for those of the pixel's view */
    v = float3(0.0, 0.0, -1.0);
    o = float3(f.d * sign, 0.0);
#endif
    float oo = m.a - m.vv;
    sum.lost += jacobian * m.a;
    sum.lost_bent += jacobian * (m.to * o + m.tv * v);
    sum.lost_diagonal += jacobian * (oo * o * o + 2.0 * m.ov * o * v + m.vv * v * v);
    sum.lost_other += jacobian * (oo * o * o.yzx + m.ov * (o * v.yzx + v * o.yzx) + m.vv * v * v.yzx);
}

/* The two sides of a slice: from the horizon to the tangent plane all is lost. */
void gtaoi_integrate(Pixel p, Frame f, float2 h, inout Sum sum) {
    float jacobian = slice_jacobian(f), weight = estimator == ESTIMATOR_MEMO ? 1.0 : jacobian, lost = 0.0;
    float open = f.open;
    /* The slice is open where both sides are at the tangent plane: a rise in cot h is sin(limit - h) / (sin limit sin h)
     * there, and rises below rise_min have become 0. */
    Side at[2], limit[2];
    int side;
    bool occluded = false;
    for (side = 0; side < 2; side++) {
        limit[side] = side_at(gtao_atan2(1.0, side ? -f.kappa_tangent : f.kappa_tangent));
        at[side] = side_at(h[side]);
        occluded = occluded || limit[side].s * at[side].c - limit[side].c * at[side].s >
                                   0.5 * rise_min * limit[side].s * at[side].s;
    }
    for (side = 0; occluded && side < 2; side++) {
        float sign = side ? -1.0 : 1.0;
        if (at[side].h < limit[side].h) {
            Moments m = between(at[side], limit[side], p.nv, sign * f.no);
            lost += m.a;
            gtaoi_lose(p, f, m, sign, sum);
        }
    }
    sum.visible += weight * (open - lost);
#if MISTAKE == 11 /* slices divided by their number instead of by what they would be when open */
    sum.open += weight;
#else
    sum.open += weight * open;
#endif
    sum.jacobian_open += jacobian * open;
}

/* What hangs free above the horizons: run by run of the masks, each an interval of t. */
void gtaoi_integrate_arcs(Pixel p, Frame f, int k, uint mask, int side, inout Sum sum) {
    float sign = side ? -1.0 : 1.0, tangent = sign * f.kappa_tangent, sec = sqrt(1.0 + tangent * tangent);
    float shift = sector_shift(k), jacobian = slice_jacobian(f);
    while (mask) {
        int low = (int)firstbitlow(mask);
        uint rest = mask + (1u << low), after = rest & ~mask;
        int high = after ? (int)firstbitlow(after) : SECTORS;
        float k0 = min(gtaoi_border(low, shift) * sec + tangent, KAPPA_LIMIT);
        float k1 = min(gtaoi_border(high, shift) * sec + tangent, KAPPA_LIMIT);
        Moments m = between(side_at(gtao_atan2(1.0, k1)), side_at(gtao_atan2(1.0, k0)), p.nv, sign * f.no);
        gtaoi_lose(p, f, m, sign, sum);
        sum.visible -= jacobian * m.a;
        mask &= rest;
    }
}

/* Coefficients of gtao_sh_basis from moments of order 0, 1 and 2. */
void gtaoi_sh_of_moments(float a, float3 b, float3 diagonal, float3 other, out float c[9]) {
    c[0] = 0.28209479 * a;
    c[1] = 0.48860251 * b.y;
    c[2] = 0.48860251 * b.z;
    c[3] = 0.48860251 * b.x;
    c[4] = 1.09254843 * other.x;
    c[5] = 1.09254843 * other.y;
    c[6] = 0.31539157 * (3.0 * diagonal.z - a);
    c[7] = 1.09254843 * other.z;
    c[8] = 0.5 * 1.09254843 * (diagonal.x - diagonal.y);
}

[numthreads(8, 8, 1)]
void main(uint3 id : SV_DispatchThreadID) {
    if (id.x >= (uint)filter_width || id.y >= (uint)filter_height)
        return;
    int i = at_filter((int2)id.xy), plane = filter_plane(), k, j;
    Pixel p = read_pixel((int2)id.xy, height[i]);
    Sum sum = (Sum)0;
    float visibility = 1.0, weight = 1.0, share = weighting == WEIGHTING_COSINE ? 2.0 / 3.0 : 0.5, scale_sum = 0.0;
    if (p.radius_class < 0) {
        p.n = gtaoi_normal(p.at, p.w0, p.r, p.inv_len);
    } else {
        for (k = 0; k < slice_count; k++) {
            Frame f = gtaoi_slice(p, k);
            gtaoi_integrate(p, f, float2(horizons[i + 2 * k * plane], horizons[i + (2 * k + 1) * plane]), sum);
            if (arcs_on)
                for (j = 0; j < 2; j++) {
                    uint low = (uint)arcs[i + (4 * k + 2 * j) * plane];
                    gtaoi_integrate_arcs(p, f, k, low | (uint)arcs[i + (4 * k + 2 * j + 1) * plane] << 16, j, sum);
                }
        }
        float open = sum.open;
        if (estimator == ESTIMATOR_MEMO)
            open = (float)slice_count * (weighting == WEIGHTING_COSINE ? 1.0 : 2.0);
#if MISTAKE == 11
        open = weighting == WEIGHTING_COSINE ? sum.open : 2.0 * sum.open;
#endif
        visibility = clamp(sum.visible / open, 0.0, 1.0);
        if (estimator != ESTIMATOR_MEMO)
            weight = clamp(sum.jacobian_open * p.inv_len * weight_scale, 1e-3, 1e3);
        scale_sum = 1.0 / sum.jacobian_open;
    }
    /* [J19 Eq. 20-21], exact off axis: (2/3) n less what is lost; where nothing is visible, the normal */
    float3 bent = share * p.n - scale_sum * sum.lost_bent;
    if (dot(bent, bent) < 1e-12)
        bent = share * p.n;
    raw[i] = (float)(real)visibility;
    raw[i + plane] = (float)(real)weight;
    raw[i + 2 * plane] = (float)(real)bent.x;
    raw[i + 3 * plane] = (float)(real)bent.y;
    raw[i + 4 * plane] = (float)(real)bent.z;

    if (spherical) {
        /* open: 1, 2/3 n, (I + n n^T) / 4, or uniformly weighted 1, n / 2, I / 3 */
        float c[9];
        float3 third = float3(1.0, 1.0, 1.0) / 3.0, diagonal = third, other = float3(0.0, 0.0, 0.0);
        if (weighting == WEIGHTING_COSINE) {
            diagonal = 0.25 * (1.0 + p.n * p.n);
            other = 0.25 * p.n * p.n.yzx;
        }
        gtaoi_sh_of_moments(clamp(1.0 - scale_sum * sum.lost, 0.0, 1.0),
                            clamp(share * p.n - scale_sum * sum.lost_bent, -1.0, 1.0),
                            clamp(diagonal - scale_sum * sum.lost_diagonal, -1.0, 1.0),
                            clamp(other - scale_sum * sum.lost_other, -1.0, 1.0), c);
        for (k = 0; k < 9; k++)
            sh[i + k * plane] = (float)(real)c[k];
    }
}
