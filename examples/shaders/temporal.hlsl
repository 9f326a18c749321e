/* temporal.hlsl - exponential accumulation in time [J16]. A pixel's history counts its frames, so that the first ones
 * are averaged; it is at most max_history frames long, less for what moves.
 *
 *     in   height, signal (after the spatial filter), motion (x, y, z)
 *          height_before, history_before    of the frame before; not read if `fresh`
 *     out  history    visibility, length, bent x, y, z, speed, last, deviation */
#include "gtao.hlsli"

StructuredBuffer<float> height : register(t0);
StructuredBuffer<float> signal : register(t1);
StructuredBuffer<float> motion : register(t2);
StructuredBuffer<float> height_before : register(t3);
StructuredBuffer<float> history_before : register(t4);
RWStructuredBuffer<float> history : register(u10);

#include "filters.hlsli"

static const float CLAMP_NOISE = 1.2; /* the clamp's least window, in mean changes of a pixel from frame to frame */
static const float BLUR_COST = 0.6;   /* part of its length that a history loses when read between pixels, x 1/4 */
static const int HISTORY_CLAMP = 0, HISTORY_VARIANCE = 1;
static const int LENGTH = 1, SPEED = 5, LAST = 6, DEVIATION = 7; /* planes of a history */

/* Where the pixel's surface was in the previous frame: pixel coordinates (centres at whole numbers) and height; false
 * if nowhere. P' = R P + t; with P = z r and heights unit / z that is R r + t w. */
bool gtaoi_reproject(int2 p, float w, out float2 q, out float qw) {
    bool valid = SKY_LIMIT < w;
    q = (float2)p;
    qw = w;
    if (input_motion) {
        int i = at_filter(p), plane = filter_plane();
        q += float2(motion[i], motion[i + plane]);
        if (input_motion == 3) {
            float dz = motion[i + 2 * plane] * (1.0 / unit_length);
            qw = orthographic ? w - dz : w / (1.0 + w * dz);
        }
    } else if (moved) {
        float4 r;
#if MISTAKE == 17 /* half a pixel lost on the way */
        float2 centre = (float2)p;
#else
        float2 centre = (float2)p + 0.5;
#endif
        if (orthographic)
            r = float4(centre.x, centre.y * by1, -w, 1.0);
        else
            r = float4((centre.x - cx) * bx1, (centre.y - cy) * by1, 1.0, w);
        float3 s = float3(dot(before[0], r), dot(before[1], r), dot(before[2], r));
        if (orthographic) {
            q = float2(s.x, s.y / by1) - 0.5;
            qw = -s.z;
        } else {
            float inv = 1.0 / s.z;
            valid = valid && 1e-6 < s.z;
            q = float2(s.x * inv * before_fx + (before_cx - 0.5), s.y * inv * before_fy + (before_cy - 0.5));
            qw = w * inv;
        }
    }
    /* In reach of the previous image, and not NaN. */
    valid = valid && -1.0 < q.x && q.x < (float)filter_width && -1.0 < q.y && q.y < (float)filter_height &&
            abs(qw) < 1e30;
    q = valid ? q : (float2)p;
    qw = valid ? qw : w;
    q = round(q * 256.0) * (1.0 / 256.0); /* rounding alone must not blur a surface at rest */
    return valid;
}

/* The signal of a pixel beside, which goes on beyond the border. */
float signal_beside(int2 p) {
    int2 size = int2(filter_width, filter_height);
    return (float)(real)signal[at_filter(border == BORDER_WRAP ? at_border(p, size) : clamp(p, 0, size - 1))];
}

[numthreads(8, 8, 1)]
void main(uint3 id : SV_DispatchThreadID) {
    int2 p = (int2)id.xy, size = int2(filter_width, filter_height);
    if (p.x >= size.x || p.y >= size.y)
        return;
    int at = at_filter(p), plane = filter_plane(), i, k;
    float w0 = height[at], bend, qw;
    float2 q, g = float2(0.0, 0.0);
    bool valid = gtaoi_reproject(p, w0, q, qw);
    if (moved || input_motion)
        g = gtaoi_slope(p, w0, gtaoi_tolerance(w0), bend);
    /* Half precision here only for what is stored: the clamp weighs differences of nearly equal numbers. */
    float now[5], past[5];
    for (k = 0; k < 5; k++)
        now[k] = (float)(real)signal[at + k * plane];

    /* [J16] each of the four bilinear taps is tested on its own, in the one direction that tells disocclusion: a
     * history that was nearer than the surface is another's. */
    float share_sum = 0.0, length_sum = 0.0, speed_sum = 0.0;
    float2 base = floor(q), part = q - base;
    float inv = 1.0 / (qw * disocclusion_scale + disocclusion_bias);
    float value[5], last = 0.0, deviation = 0.0;
    for (k = 0; k < 5; k++)
        value[k] = 0.0;
    for (i = 0; valid && !fresh && i < 4; i++) {
        int2 corner = int2(i & 1, i >> 1), tap = (int2)base + corner;
        float share = (corner.x ? part.x : 1.0 - part.x) * (corner.y ? part.y : 1.0 - part.y);
        if (border == BORDER_WRAP)
            tap = at_border(tap, size);
        if (!(0.0 < share) || any(tap < 0) || any(tap >= size))
            continue;
        int from = at_filter(tap);
        float w = height_before[from], expected = qw + dot(g, (float2)corner - part);
        if (w <= SKY_LIMIT)
            continue;
#if MISTAKE != 16 /* whatever was there is taken */
        share *= clamp(1.0 - (w - expected) * inv, 0.0, 1.0);
#endif
        share_sum += share;
        length_sum += share * history_before[from + LENGTH * plane];
        speed_sum += share * history_before[from + SPEED * plane];
        last += share * (float)(real)history_before[from + LAST * plane];
        deviation += share * (float)(real)history_before[from + DEVIATION * plane];
        for (k = 0; k < 5; k++)
            if (k != LENGTH)
                value[k] += share * ((float)(real)history_before[from + k * plane] - now[k]);
    }
    bool has = 1.0 / 16.0 < share_sum;
    float norm = 1.0 / (has ? share_sum : 1.0);
    for (k = 0; k < 5; k++)
        past[k] = has ? now[k] + value[k] * norm : now[k];

    /* Shorter by the taps that were rejected, and by the detail that reading between pixels costs. */
    float blur = dot(part, 1.0 - part), length_now = has ? length_sum * (1.0 - blur * BLUR_COST) : 0.0;
    float2 step = q - (float2)p;
    float speed = valid ? sqrt(dot(step, step)) * (float)scale : 0.0;
    /* [J16] velocity weight: 0 at 4 pixels a frame */
    float calm = max(1.0 - abs(speed - (has ? speed_sum * norm : speed)) * 0.25, 0.0);
    float change = abs(now[0] - last * norm);
    deviation = has ? deviation * norm : 0.0;
    deviation = has ? deviation + 0.125 * (change - deviation) : 0.0;
    change = abs(now[0] - past[0]);
#if MISTAKE == 18 /* histories that nothing clamps */
    bool clamps = false;
#else
    bool clamps = history_kind == HISTORY_CLAMP;
#endif
    if (clamps) {
        /* the four 2x2 means around the pixel, as bilinear taps at its corners fetch them; and what one frame deviates
         * from the history by chance */
        float least = now[0], greatest = now[0];
        for (i = 0; i < 4; i++) {
            int2 side = int2(i & 1 ? 1 : -1, i & 2 ? 1 : -1);
            float mean = 0.25 * ((now[0] + signal_beside(p + int2(side.x, 0))) +
                                 (signal_beside(p + int2(0, side.y)) + signal_beside(p + side)));
            least = min(least, mean);
            greatest = max(greatest, mean);
        }
        float wider = max(calm * clamp_window * (greatest - least), deviation * CLAMP_NOISE);
        float clamped = max(min(past[0], greatest + wider), least - wider);
        /* the rest of the signal goes as far towards the new frame as the visibility did, and as much of the history
         * counts no more */
        float away = min(abs(past[0] - clamped) / max(change, 1e-12), 1.0);
        for (k = 2; k < 5; k++)
            past[k] += away * (now[k] - past[k]);
        length_now *= 1.0 - away;
        past[0] = clamped;
    } else if (history_kind == HISTORY_VARIANCE) {
        /* beyond three deviations (of a normal distribution: 1.25 times the mean one) the history is shortened by the
         * square of the excess */
        float chance = max(deviation * 3.75, 1e-3), excess = chance / max(change, chance);
        length_now *= excess * excess;
    }

    /* at rest max_history frames, falling to 8 at 16 pixels a frame */
    float most = (float)max_history;
    float limit = max(most - speed * ((most - 8.0) * (1.0 / 16.0)), min(most, 8.0));
    length_now = min(length_now, limit - 1.0) + 1.0;
    for (k = 0; k < 5; k++)
        if (k != LENGTH)
            history[at + k * plane] = (float)(real)(past[k] + 1.0 / length_now * (now[k] - past[k]));
    history[at + LENGTH * plane] = length_now;
    history[at + SPEED * plane] = speed;
    history[at + LAST * plane] = (float)(real)now[0];
    history[at + DEVIATION * plane] = (float)(real)deviation;
}
