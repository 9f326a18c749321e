/* horizons.hlsl - the search: of each slice the horizons on both sides, and with thickness what hangs free above them.
 *
 *     in   height (with thickness per layer: heights, backs), surface, noise, slice_table
 *          samples        qx, qy, inv_length, ux, uy; `steps` columns, rows (phase slices + slice) classes + class,
 *                         in every-pixel mode phase slices + slice; not with Hilbert noise
 *          sample_count   of (phase slices + slice) classes + class
 *     out  slices         of each slice n, Jacobian, open arc
 *          horizons       of each slice the angle from the view vector on the + and the - side
 *          arcs           of each slice masks of the + and the - side, as low and high 16 bits
 *
 * [J16, J19] search for the greatest cosine; here for the greatest rise above the tangent plane, as slopes of w, which
 * is linear in screen space: no position is rebuilt and a plane occludes nothing (docs/theory.md). Samples are at
 * centres of pixels: fetch with Load, not with a filter. */
#include "gtao.hlsli"

StructuredBuffer<float> height : register(t0);
StructuredBuffer<float> surface : register(t1);
StructuredBuffer<float> noise : register(t2);
StructuredBuffer<float> slice_table : register(t3);
StructuredBuffer<float> samples : register(t4);
StructuredBuffer<float> sample_count : register(t5);
RWStructuredBuffer<float> slices : register(u10);
RWStructuredBuffer<float> horizons : register(u11);
RWStructuredBuffer<float> arcs : register(u12);

#include "pixel.hlsli"

/* What the search of a slice finds, on its + and - side. */
struct Horizons {
    float2 rise;   /* largest slope above the tangent plane of full-weight samples, height per pixel */
    float2 cosine; /* largest attenuated cosine of samples in the falloff ring */
};

/* ---- where samples are ------------------------------------------------------------------------------------------- */

/* Sample j of the + side; the - side's is its mirror image. In every-pixel mode it lies between two taps. */
struct Sample {
    int2 q;         /* first tap, whole pixels */
    float inv;      /* 1 / distance in pixels */
    float fraction; /* weight of the second tap, one pixel further along `across` */
    float2 u;       /* unit direction */
};

/* Length of the radius along the slice, in pixels. */
float radius_px(Pixel p, Frame f) {
    return clamp(p.extent / sqrt(f.bb), 1.0, max_radius);
}

/* The first row of this slice in `samples`, and how many samples it has. */
void sample_list(Pixel p, Frame f, int k, out int row, out int count) {
    int list = (p.phase * slice_count + k) * classes + p.radius_class;
    row = every_pixel ? p.phase * slice_count + k : list;
    if (noise_kind != NOISE_HILBERT)
        count = (int)sample_count[list];
    else if (every_pixel)
        count = (int)max(floor(radius_px(p, f) * max(abs(f.d.x), abs(f.d.y))), 1.0);
    else
        count = steps;
}

Sample sample_at(Pixel p, Frame f, int row, int j) {
    Sample s;
    bool along_x = abs(f.d.y) <= abs(f.d.x);
    s.fraction = 0.0;
    if (noise_kind != NOISE_HILBERT) {
        int i = row * steps + j, plane = period * period * slice_count * (every_pixel ? 1 : classes) * steps;
        s.q = int2((int)samples[i], (int)samples[i + plane]);
        s.inv = samples[i + 2 * plane];
        s.u = float2(samples[i + 3 * plane], samples[i + 4 * plane]);
        if (every_pixel) {
            s.fraction = s.u.x;
            s.u = f.d;
        }
    } else if (every_pixel) {
        float t = (float)(j + 1) / max(abs(f.d.x), abs(f.d.y));
        float2 at = t * f.d, whole = along_x ? float2(round(at.x), floor(at.y)) : float2(floor(at.x), round(at.y));
        s.q = (int2)whole;
        s.fraction = along_x ? at.y - whole.y : at.x - whole.x;
        s.inv = 1.0 / t;
        s.u = f.d;
    } else { /* 1 + (radius - 1) ((j + offset) / steps)^power, to whole pixels */
        float part = ((float)j + ((float)p.level + 0.5) * (1.0 / 64.0)) / (float)steps;
        float t = 1.0 + (radius_px(p, f) - 1.0) * (step_power == 2.0 ? part * part : pow(part, step_power));
        float2 whole = round(t * f.d);
        s.q = (int2)whole;
        s.inv = 1.0 / sqrt(dot(whole, whole));
        s.u = whole * s.inv;
    }
#if MISTAKE == 6 /* the sample's exact position with the height of the nearest pixel */
    if (!every_pixel) {
        float t = dot((float2)s.q, f.d);
        s.inv = 1.0 / max(t, 1.0);
        s.u = f.d;
    }
#endif
    return s;
}

float fetch(int plane, int2 p) {
    p = at_border(p, int2(filter_width, filter_height));
    return p.x < 0 ? SKY : height[plane * filter_plane() + at_filter(p)];
}

/* Between two pixels: linear within one surface; across an edge the nearer pixel, moved onto the slice's line along the
 * receiver's tangent plane (g_across: its gradient from a to b). `a`, `b`: fronts, which tell; a_value, b_value: what
 * is interpolated. */
float gtaoi_between(float a, float b, float a_value, float b_value, float fraction, float g_across) {
    float limit = same_surface * (orthographic ? 1.0 : min(abs(a), abs(b)));
    if (abs(b - a) <= limit)
        return a_value + fraction * (b_value - a_value);
    return fraction < 0.5 ? a_value + fraction * g_across : b_value + (fraction - 1.0) * g_across;
}

/* Rise above the tangent plane of the pixel at q, of height w, in its own direction. */
float gtaoi_own_rise(Pixel p, float2 q, float w) {
    return (w - p.w0 - dot(p.g, q)) / sqrt(dot(q, q));
}

/* A sample on one side: its height w and rise above the tangent plane, height per pixel; it occludes up to `least`,
 * which is the same but on hollow surfaces: a straight line between two taps lies above those, so of the first samples
 * no higher than either tap in its own direction. */
void gtaoi_take(Pixel p, Frame f, Sample s, int side, int layer, int j, out float w, out float w_back, out float rise,
                out float least) {
    int2 sign = side ? int2(-1, -1) : int2(1, 1), q = sign * s.q;
    float2 u = (float2)sign * s.u;
    float a = fetch(2 * layer, p.at + q), b = a;
    w = a;
    w_back = arcs_on ? fetch(2 * layer + 1, p.at + q) : SKY;
    bool two = every_pixel && s.fraction > 0.0;
    int2 next = q;
    if (two) {
        bool along_x = abs(f.d.y) <= abs(f.d.x);
        next = q + sign * (along_x ? int2(0, 1) : int2(1, 0));
        float across = (float)sign.x * (along_x ? p.g.y : p.g.x);
        b = fetch(2 * layer, p.at + next);
        w = gtaoi_between(a, b, a, b, s.fraction, across);
        if (arcs_on)
            w_back = gtaoi_between(a, b, w_back, fetch(2 * layer + 1, p.at + next), s.fraction, across);
    }
    rise = w * s.inv - (p.w0 * s.inv + dot(p.g, u));
    least = rise;
    if (every_pixel && j < NEAR_SAMPLES)
        least = min(rise, max(gtaoi_own_rise(p, (float2)q, a), gtaoi_own_rise(p, (float2)next, b)));
}

/* ---- height fields ----------------------------------------------------------------------------------------------- */

float side_of(int side, float plus) {
    return side ? -plus : plus;
}

/* distance^2 = t^2 |b_perp|^2 (1 + kappa^2) / w^2 = (radius / reach)^2 rho. Within the radius, all of a sample counts;
 * in the ring where occlusion fades out, its cosine is lerped from the tangent plane's [J16]:
 * distance / radius = rho / (sqrt(rho) reach), cos h = kappa / sqrt(rho). */
void gtaoi_rise(Pixel p, Frame f, inout Horizons s, int side, Sample q, float w, float rise, float least) {
    if (w <= SKY_LIMIT)
        return;
    if (!bounded) {
        s.rise[side] = max(s.rise[side], least);
        return;
    }
    float kappa = rise * f.kappa_scale + side_of(side, f.kappa_tangent), rho = kappa * kappa + 1.0;
    float to_reach = (orthographic ? q.inv : w * q.inv) * f.reach, reach2 = to_reach * to_reach;
#if MISTAKE == 8 /* no test of the distance: everything on the line occludes */
    s.rise[side] = max(s.rise[side], least);
#else
    bool inside = rho <= reach2 * inner2;
    if (inside)
        s.rise[side] = max(s.rise[side], least);
    if (inv_falloff > 0.0 && !inside && rho < reach2 && s.rise[side] < least) {
        float both = 1.0 / (sqrt(rho) * to_reach), weight = (1.0 - rho * both) * inv_falloff;
        float start = side_of(side, f.cos_tangent), cosine = kappa * (to_reach * both);
        s.cosine[side] = max(s.cosine[side], start + weight * (cosine - start));
    }
#endif
}

/* Where every cosine is taken: [J16] thickness heuristic, and the memo's search [J19], where kappa and reach belong to
 * the sample's own direction instead of the slice's. */
void gtaoi_visit_cosine(Pixel p, Frame f, inout Horizons s, int side, Sample q, float w, float rise) {
    float slope = orthographic ? q.inv : w * q.inv, kappa, to_reach, weight = 1.0;
    float start = side_of(side, f.cos_tangent);
    if (estimator == ESTIMATOR_MEMO) {
        /* D = w0 b - s r0 with b of the sample; cot h = D.v / |D_perp|, as if it lay in the slice. */
        float w0 = orthographic ? 1.0 : p.w0;
        float2 b = (side ? -q.u : q.u) * float2(bx1, by1);
        float along = dot(b, p.r) * p.inv_len, perp = sqrt(dot(b, b) - along * along);
        kappa = ((w - p.w0) * q.inv * p.len - w0 * along) / (w0 * perp);
        to_reach = reach * slope / perp;
    } else {
        kappa = rise * f.kappa_scale + side_of(side, f.kappa_tangent);
        to_reach = slope * f.reach;
    }
    kappa = clamp(kappa, -KAPPA_LIMIT, KAPPA_LIMIT);
    float rho = kappa * kappa + 1.0, cosine = kappa / sqrt(rho);
    if (bounded) {
        float reach2 = to_reach * to_reach;
        weight = clamp((1.0 - sqrt(rho) / abs(to_reach)) * inv_falloff, 0.0, 1.0);
        weight = rho <= reach2 * inner2 ? 1.0 : rho < reach2 ? weight : 0.0;
    }
    float faded = max(start + weight * (cosine - start), start);
    s.cosine[side] = s.cosine[side] < faded ? faded : s.cosine[side] + thin_blend * (faded - s.cosine[side]);
}

void gtaoi_search(Pixel p, Frame f, int k, inout Horizons s) {
    int row, count;
    sample_list(p, f, k, row, count);
    for (int j = 0; j < count; j++) {
        Sample q = sample_at(p, f, row, j);
        for (int side = 0; side < 2; side++) {
            float w, w_back, rise, least;
            gtaoi_take(p, f, q, side, 0, j, w, w_back, rise, least);
            if (cosines)
                gtaoi_visit_cosine(p, f, s, side, q, w, rise);
            else
                gtaoi_rise(p, f, s, side, q, w, rise, least);
        }
    }
}

/* cot h of a side from what the search found. */
float gtaoi_kappa(Frame f, Horizons s, int side) {
    float rise = s.rise[side] > f.least_rise ? s.rise[side] : 0.0, cosine = s.cosine[side];
    float kappa = rise * f.kappa_scale + side_of(side, f.kappa_tangent);
    if (side_of(side, f.cos_tangent) < cosine && (cosines || inv_falloff > 0.0))
        kappa = max(cosine / sqrt(max(1.0 - cosine * cosine, 1e-12)), kappa);
#if MISTAKE == 7 /* horizons that start at a right angle to the view vector instead of at the tangent plane */
    kappa = max(kappa, 0.0);
#endif
    return clamp(kappa, -KAPPA_LIMIT, KAPPA_LIMIT);
}

/* ---- occluders with thickness ------------------------------------------------------------------------------------ */

/* A sample is a column along its view ray, from front to back: an interval of rises. What reaches down to the tangent
 * plane is kept as a horizon, exactly; what hangs free above it as a mask of sectors (pixel.hlsli). */
struct Arcs {
    uint2 mask;
    float to_t, from_t; /* rise to t, and back */
    float shift;
    float chord, denominator; /* the sphere of the radius along view rays, where backs are known */
};

/* The column before, for the surface between. */
struct Column {
    float w, front, back;
    bool connected;
};

Arcs gtaoi_begin_slice_arcs(Pixel p, Frame f, int k) {
    Arcs a;
    float sec = sqrt(1.0 + f.kappa_tangent * f.kappa_tangent);
    a.mask = uint2(0, 0);
    a.to_t = f.kappa_scale / sec;
    a.from_t = sec / f.kappa_scale;
    a.shift = sector_shift(k);
    /* Of the ray r the sphere about P0 holds w0 (r.r0 -+ sqrt((R w0)^2 r^2 - (r x r0)^2)) / (r0^2 - (R w0)^2). */
    a.chord = reach * p.w0 * (reach * p.w0);
    a.denominator = p.len * p.len - a.chord;
    return a;
}

/* An interval from l to u in the falloff ring shrinks to its lower end, cos u' = lerp(cos l, cos u, weight). For an
 * endless column l is the tangent plane: the attenuation of the height field. */
float gtaoi_fade_interval(Frame f, float tangent, float l, float u, float rho, float to_reach) {
    float weight = clamp((1.0 - sqrt(rho) / abs(to_reach)) * inv_falloff, 0.0, 1.0);
    float kl = min(max(l, 0.0) * f.kappa_scale + tangent, KAPPA_LIMIT);
    float ku = min(u * f.kappa_scale + tangent, KAPPA_LIMIT);
    kl = kl / sqrt(kl * kl + 1.0);
    ku = ku / sqrt(ku * ku + 1.0);
    float cosine = kl + weight * (ku - kl);
    return (cosine / sqrt(max(1.0 - cosine * cosine, 1e-12)) - tangent) / f.kappa_scale;
}

/* Bits from `from` on, 0 .. 32. */
uint bits_from(int from) {
    return from >= 32 ? 0u : from <= 0 ? 0xffffffffu : 0xffffffffu << from;
}

/* The sectors between l and u. A sample stands for the stretch of the slice between it and its neighbours: a sheet that
 * hangs free is as wide, `half_step` to both sides, but where a surface goes on; what has a depth is a quarter of a
 * pixel narrower. */
uint gtaoi_hang(Arcs a, Column c, float l, float u, float half_step, float inv) {
    bool sheet = c.front - c.back <= abs(c.front) * 1e-3;
    half_step = sheet ? half_step : half_step - 0.25 * inv;
    float il = round(gtaoi_sector(l / (1.0 + half_step) * a.to_t, a.shift));
    float iu = round(gtaoi_sector(u / (c.connected ? 1.0 : 1.0 - half_step) * a.to_t, a.shift));
    return bits_from((int)il) & ~bits_from((int)iu);
}

/* A column at distance t = 1 / inv, its front at `rise`. `gap`: the height difference (perspective: relative) that a
 * surface makes from the one before. Raises the horizon where it joins it, or else sets sectors. */
void gtaoi_visit_column(Pixel p, Frame f, inout Arcs a, inout Column before, inout Horizons s, int side, Sample q,
                        float w, float w_back, float rise, float least, float gap, float half_step, bool clips) {
    float tangent = side_of(side, f.kappa_tangent), inv = q.inv;
    if (w <= SKY_LIMIT) {
        before.w = SKY;
        return;
    }
    float base = w * inv - rise; /* of the tangent plane */
    float back = max(w_back, -1e30) * inv - base;
    bool connected = SKY_LIMIT < before.w && abs(w - before.w) <= gap * (orthographic ? 1.0 : min(w, before.w));
    float l = connected ? min(before.front, back) : back, u = max(least, connected ? before.back : 0.0);
    before.w = w;
    before.front = least;
    before.back = back;
    before.connected = connected;
    if (bounded) {
        float slope = w * inv, kappa, rho, to_reach, reach2;
        if (clips) { /* the column's point nearest to the pixel decides, and only what is within the sphere counts */
            float lowest, highest;
            rise = min(max(-tangent / f.kappa_scale, back), rise);
            slope = rise + base;
            if (orthographic) {
                float room = inv * f.reach;
                room = sqrt(max(room * room - 1.0, 0.0));
                lowest = (-room - tangent) / f.kappa_scale;
                highest = (room - tangent) / f.kappa_scale;
            } else {
                float t = 1.0 / inv, tt = t * t, len2 = p.len * p.len, br = side_of(side, t * f.along * p.len);
                float along = len2 + br, rr = along + br + tt * f.bb;
                float root = sqrt(max(a.chord * rr - tt * len2 * (f.bb - f.along * f.along), 0.0));
                lowest = (along - root) * (p.w0 / a.denominator) * inv - base;
                highest = (along + root) * (p.w0 / a.denominator) * inv - base;
                highest = 0.0 < a.denominator ? highest : u; /* else the eye is within the sphere */
            }
            l = max(lowest, l);
            u = min(highest, u);
        }
        kappa = rise * f.kappa_scale + tangent;
        rho = kappa * kappa + 1.0;
        to_reach = (orthographic ? inv : slope) * f.reach;
        reach2 = to_reach * to_reach;
        if (rho > reach2 * inner2) {
            float most = max(u, rise);
            if (inv_falloff <= 0.0 || rho >= reach2)
                return;
            if (s.rise[side] < most)
                u = gtaoi_fade_interval(f, tangent, l, most, rho, to_reach);
        }
    }
    if (u <= s.rise[side])
        return;
    if (l <= s.rise[side])
        s.rise[side] = u;
    else
        a.mask[side] |= gtaoi_hang(a, before, l, u, half_step, inv);
}

/* What hangs free but touches the horizon raises it; what lies below it is forgotten. */
void gtaoi_absorb(inout Arcs a, inout Horizons s, int side) {
    uint mask = a.mask[side];
    if (!mask)
        return;
    int i = clamp((int)floor(gtaoi_sector(s.rise[side] * a.to_t, a.shift)), 0, SECTORS - 1);
    mask &= bits_from(i);
    if (mask >> i & 1u) { /* through the run of set bits that starts in the horizon's sector */
        uint ends = mask + (1u << i), after = ends & ~mask;
        int top = after ? (int)firstbitlow(after) : SECTORS;
        s.rise[side] = max(s.rise[side], gtaoi_border(top, a.shift) * a.from_t);
        mask &= ends;
    }
    a.mask[side] = mask;
}

void gtaoi_search_arcs(Pixel p, Frame f, int k, inout Horizons s, inout Arcs a) {
    int row, count, side;
    sample_list(p, f, k, row, count);
    for (int layer = 0; layer < layer_count; layer++) {
        Column column[2];
        float t_before = 0.0;
        for (side = 0; side < 2; side++) {
            column[side].w = layer == 0 ? p.w0 : SKY; /* the pixel itself is on the first layer */
            column[side].front = 0.0;
            column[side].back = 0.0;
            column[side].connected = false;
        }
        for (int j = 0; j < count; j++) {
            Sample q = sample_at(p, f, row, j);
            float t = 1.0 / q.inv, spacing = t - t_before;
            t_before = t;
            for (side = 0; side < 2; side++) {
                float w, w_back, rise, least;
                gtaoi_take(p, f, q, side, layer, j, w, w_back, rise, least);
                gtaoi_visit_column(p, f, a, column[side], s, side, q, w, w_back, rise, least, spacing * connect,
                                   0.5 * spacing * q.inv, (clip >> layer & 1) != 0);
            }
        }
    }
    for (side = 0; side < 2; side++)
        gtaoi_absorb(a, s, side);
}

/* ---- the stage --------------------------------------------------------------------------------------------------- */

/* The angle whose cotangent is kappa, 0 .. pi. */
float angle_of(float kappa) {
#if MISTAKE == 13 /* the angle through a cheap acos */
    return gtao_acos(kappa / sqrt(1.0 + kappa * kappa));
#else
    return gtao_atan2(1.0, kappa);
#endif
}

void store_slice(int i, int k, float n, float jacobian, float open, float2 h, uint2 mask) {
    int plane = filter_plane();
    slices[i + 3 * k * plane] = n;
    slices[i + (3 * k + 1) * plane] = jacobian;
    slices[i + (3 * k + 2) * plane] = open;
#if HALF
    h = f16tof32(f32tof16(h));
#endif
    horizons[i + 2 * k * plane] = h.x;
    horizons[i + (2 * k + 1) * plane] = h.y;
    if (arcs_on)
        for (int side = 0; side < 2; side++) {
            arcs[i + (4 * k + 2 * side) * plane] = (float)(mask[side] & 0xffffu);
            arcs[i + (4 * k + 2 * side + 1) * plane] = (float)(mask[side] >> 16);
        }
}

[numthreads(8, 8, 1)]
void main(uint3 id : SV_DispatchThreadID) {
    if (id.x >= (uint)filter_width || id.y >= (uint)filter_height)
        return;
    int i = at_filter((int2)id.xy), k;
    Pixel p = read_pixel((int2)id.xy, height[i]);
    for (k = 0; k < slice_count; k++) {
        if (p.radius_class < 0) {
            store_slice(i, k, 0.0, 0.0, 0.0, float2(0.5 * PI, 0.5 * PI), uint2(0, 0));
            continue;
        }
        Frame f = gtaoi_slice(p, k);
        Horizons s;
        Arcs a = gtaoi_begin_slice_arcs(p, f, k);
        s.rise = float2(f.least_rise, f.least_rise);
        s.cosine = float2(f.cos_tangent, -f.cos_tangent);
        if (arcs_on)
            gtaoi_search_arcs(p, f, k, s, a);
        else
            gtaoi_search(p, f, k, s);
        store_slice(i, k, f.n, slice_jacobian(f), f.open,
                    float2(angle_of(gtaoi_kappa(f, s, 0)), angle_of(gtaoi_kappa(f, s, 1))), a.mask);
    }
}
