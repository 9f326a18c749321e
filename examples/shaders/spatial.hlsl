/* spatial.hlsl - one pass of the bilateral filter over up to 5x5 pixels [J16].
 *
 *     in   height, signal    visibility, weight, bent x, y, z: raw, or the pass before
 *     out  filtered          the same
 *
 * Weights fall linearly with the distance from the pixel's plane. Means are taken of differences from the pixel itself,
 * so that what is constant stays so to the bit. */
#include "gtao.hlsli"

StructuredBuffer<float> height : register(t0);
StructuredBuffer<float> signal : register(t1);
RWStructuredBuffer<float> filtered : register(u10);

#include "filters.hlsli"

[numthreads(8, 8, 1)]
void main(uint3 id : SV_DispatchThreadID) {
    int2 p = (int2)id.xy, size = int2(filter_width, filter_height);
    if (p.x >= size.x || p.y >= size.y)
        return;
    int at = at_filter(p), plane = filter_plane();
    float w0 = height[at], tolerance = gtaoi_tolerance(w0), bend, shares = 0.0;
    real v0 = (real)signal[at], v = (real)0.0, total = (real)0.0;
    real weight0 = (real)signal[at + plane];
    real3 b0 = real3((real)signal[at + 2 * plane], (real)signal[at + 3 * plane], (real)signal[at + 4 * plane]);
    real3 b = real3((real)0.0, (real)0.0, (real)0.0);
    if (SKY_LIMIT < w0) {
        float2 g = gtaoi_slope(p, w0, tolerance, bend);
        float inv = 1.0 / (tolerance + min(bend + bend, tolerance));
#if MISTAKE == 15 /* the difference of depth for the distance from the plane: slopes are not filtered */
        g = float2(0.0, 0.0);
#endif
        for (int y = -2; y <= 2; y++)
            for (int x = -2; x <= 2; x++) {
                float wanted = window[x + 2].x * window[y + 2].x, w = filter_height_at(p + int2(x, y)), share;
                if (wanted == 0.0 || w <= SKY_LIMIT)
                    continue;
                share = max(1.0 - abs(w - (w0 + g.y * (float)y + g.x * (float)x)) * inv, 0.0) * wanted;
                int i = at_filter(at_border(p + int2(x, y), size));
                real weight = (real)share * (real)signal[i + plane];
                shares += share;
                total += weight;
                v += weight * ((real)signal[i] - v0);
                b.x += weight * ((real)signal[i + 2 * plane] - b0.x);
                b.y += weight * ((real)signal[i + 3 * plane] - b0.y);
                b.z += weight * ((real)signal[i + 4 * plane] - b0.z);
            }
        if ((float)total > 0.0) {
            v0 += v / total;
            weight0 = total / (real)shares;
            b0.x += b.x / total;
            b0.y += b.y / total;
            b0.z += b.z / total;
        }
    }
    filtered[at] = (float)v0;
    filtered[at + plane] = (float)weight0;
    filtered[at + 2 * plane] = (float)b0.x;
    filtered[at + 3 * plane] = (float)b0.y;
    filtered[at + 4 * plane] = (float)b0.z;
}
