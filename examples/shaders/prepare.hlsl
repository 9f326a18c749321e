/* prepare.hlsl - depth to height, and the backs of occluders that have a thickness.
 *
 *     in   depth      of layer 0; after reduce its height (depth_kind DEVICE with scale 1, bias 0)
 *     out  height     plane 0 height, plane 1 back
 *
 * Keep heights in 32 bits. In 16 a plane becomes stairs whose steps occlude. */
#include "gtao.hlsli"

StructuredBuffer<float> depth : register(t0);
RWStructuredBuffer<float> height : register(u10);

#include "height.hlsli"

/* With T along the view ray and z along the axis, w' = 1 / (1 / w + T / |r|); orthographic w' = w - T. Endless: sky. */
float gtaoi_back(float w, int2 p) {
    if (w <= SKY_LIMIT || !(thickness > 0.0 && thickness < 1e30))
        return SKY;
    if (orthographic)
        return max(w - thickness, SKY);
    float2 r = ray((float2)p, bx1, by1, cx, cy);
    return w / (1.0 + thickness * w / sqrt(dot(r, r) + 1.0));
}

[numthreads(8, 8, 1)]
void main(uint3 id : SV_DispatchThreadID) {
    int2 p = (int2)id.xy;
    if (p.x >= filter_width || p.y >= filter_height)
        return;
    int i = at_filter(p);
    float w = gtaoi_height(depth[i], p, bx1, by1, cx, cy);
    height[i] = w;
    if (arcs_on)
        height[i + filter_plane()] = gtaoi_back(w, p);
}
