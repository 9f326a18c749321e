/* upsample.hlsl - joint bilateral upsampling, and bent normals to unit length.
 *
 *     in   depth (image), height, signal (history, or what is there without one), reduced_normals
 *     out  result    visibility, bent x, y, z */
#include "gtao.hlsli"

StructuredBuffer<float> depth : register(t0);
StructuredBuffer<float> height : register(t1);
StructuredBuffer<float> signal : register(t2);
StructuredBuffer<float> reduced_normals : register(t3);
RWStructuredBuffer<float> result : register(u10);

#include "filters.hlsli"
#include "height.hlsli"

/* Where nothing is visible or known, the normal or towards the eye. */
float3 gtaoi_unit_bent(float3 b, int2 block, int2 p) {
    float len2 = dot(b, b);
    float3 n = float3(0.0, 0.0, 0.0);
    if (1e-12 < len2)
        return b * (1.0 / sqrt(len2));
    if (input_normals) {
        int i = at_filter(block), plane = filter_plane();
        float3 given = float3(reduced_normals[i], reduced_normals[i + plane], reduced_normals[i + 2 * plane]);
        n = float3(dot(to_view[0].xyz, given), dot(to_view[1].xyz, given), dot(to_view[2].xyz, given));
    }
    if (0.5 < dot(n, n))
        return n;
    float2 r = ray((float2)p, full_bx1, full_by1, full_cx, full_cy);
    return float3(r, 1.0) * (-1.0 / sqrt(dot(r, r) + 1.0));
}

/* The step in height from one block to the next: the smaller of the two, where they agree or it is small. */
float gtaoi_step(float before, float w, float after, float tolerance) {
    precise float a = w - before, b = after - w;
    float step = abs(a) <= abs(b) ? a : b;
    return min(abs(a - b), abs(step)) <= tolerance ? step : 0.0;
}

[numthreads(8, 8, 1)]
void main(uint3 id : SV_DispatchThreadID) {
    int2 p = (int2)id.xy, size = int2(filter_width, filter_height), block = p / scale;
    if (p.x >= full_width || p.y >= full_height)
        return;
    int plane = filter_plane(), at = at_filter(block), i, k;
    real out_value[5];
    for (k = 0; k < 5; k++)
        out_value[k] = (real)signal[at + k * plane];
    if (scale == 2) {
        /* The four blocks around the pixel: its own, beside, above or below, diagonal, each with its bilinear weight
         * times how well its height fits the pixel's plane, whose slope is that of its block: full weight up to the
         * tolerance, none at twice that; if all are beyond, the closest. Where all fit, just bilinear. */
        static const float bilinear[4] = {9.0 / 16.0, 3.0 / 16.0, 3.0 / 16.0, 1.0 / 16.0};
        int2 side = int2(p.x & 1 ? 1 : -1, p.y & 1 ? 1 : -1), taps[4];
        float w = gtaoi_height(depth[at_image(p)], p, full_bx1, full_by1, full_cx, full_cy), w0 = height[at];
        float tolerance = min(gtaoi_tolerance(max(w0, 0.0)), 1e28), inv = 1.0 / max(tolerance, 1e-28);
        float left = filter_height_at(block - int2(1, 0)), right = filter_height_at(block + int2(1, 0));
        float above = filter_height_at(block - int2(0, 1)), below = filter_height_at(block + int2(0, 1));
        float rise_x = gtaoi_step(left, w0, right, tolerance), rise_y = gtaoi_step(above, w0, below, tolerance);
        float away[4], least = 3e38, most = 0.0, total = 0.0;
        float sum[5];
        for (i = 0; i < 4; i++) {
            float dx = (i & 1 ? 0.75 : -0.25) * (float)side.x, dy = (i & 2 ? 0.75 : -0.25) * (float)side.y;
            taps[i] = block + int2(i & 1 ? side.x : 0, i & 2 ? side.y : 0);
            /* A block and the one its slope came from are equally far: only rounding says which is closer. */
            precise float rise = rise_y * dy + rise_x * dx, difference = filter_height_at(taps[i]) - (w + rise);
            away[i] = min(abs(difference) * inv, 3e38);
            least = min(least, away[i]);
            most = max(most, away[i]);
        }
        for (k = 0; k < 5; k++)
            sum[k] = 0.0;
        for (i = 0; SKY_LIMIT < w && i < 4; i++) {
            float share = clamp(max(2.0 - away[i], away[i] <= least ? 1e-6 : 0.0), 0.0, 1.0) * bilinear[i];
            if (most <= 1.0)
                share = bilinear[i];
#if MISTAKE == 19 /* bilinear, whatever the depth */
            share = bilinear[i];
#endif
            if (share <= 0.0)
                continue;
            total += share;
            int from = at_filter(at_border(taps[i], size));
            for (k = 0; k < 5; k++)
                sum[k] += share * (float)((real)signal[from + k * plane] - out_value[k]);
        }
        /* Sums in 32 bits: where all taps are beyond the tolerance their weights are less than half precision holds. */
        for (k = 0; 0.0 < total && k < 5; k++)
            out_value[k] += (real)(sum[k] / total);
        if (w <= SKY_LIMIT)
            out_value[0] = (real)1.0;
    }
    float3 bent = gtaoi_unit_bent(float3((float)out_value[2], (float)out_value[3], (float)out_value[4]), block, p);
    result[at_image(p)] = (float)out_value[0];
    result[at_image(p) + image_plane()] = (float)(real)bent.x;
    result[at_image(p) + 2 * image_plane()] = (float)(real)bent.y;
    result[at_image(p) + 3 * image_plane()] = (float)(real)bent.z;
}
