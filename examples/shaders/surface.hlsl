/* surface.hlsl - what the search needs to know of each pixel. In gtao.h it is the first part of the kernel that
 * searches (gtaoi_setup, gtaoi_face); here a stage, so that it can be compared.
 *
 *     in   height, normals (planes x, y, z; before to_view)
 *     out  surface    normal x, y, z; gradient of w on the tangent plane x, y; extent of the radius; radius class
 *
 * Class -1 and all else 0: sky, or a radius below a pixel: nothing to compute, visibility 1. */
#define DERIVES_NORMALS
#include "gtao.hlsli"

StructuredBuffer<float> height : register(t0);
StructuredBuffer<float> normals : register(t1);
RWStructuredBuffer<float> surface : register(u10);

#include "normals.hlsli"

/* Classes of the radius: exponent and 2 bits of mantissa of the extent, 4 an octave. */
int gtaoi_class(float extent) {
    return clamp((int)(asuint(extent) >> 21) - class_base, 0, classes - 1);
}

/* Extent of the radius on the plane z = 1, in units of r. In every-pixel mode of the whole sphere: its silhouette, at
 * angle a about r0 with sin a = radius / |P|, lies farthest from the pixel away from the image centre:
 * |r0| tan a / (1 / |r0| - tan a sqrt(1 - 1 / |r0|^2)). */
float extent_of(float w0, float len, float inv_len) {
    if (orthographic)
        return reach;
    if (!bounded)
        return extent_max;
    if (!every_pixel)
        return w0 * len * reach;
    float sine = w0 * inv_len * reach;
    if (!(sine < 1.0))
        return extent_max;
    float tangent = sine / sqrt(1.0 - sine * sine);
    float room = inv_len - tangent * sqrt(max(1.0 - inv_len * inv_len, 0.0));
    return 0.0 < room ? len * tangent / room : extent_max;
}

[numthreads(8, 8, 1)]
void main(uint3 id : SV_DispatchThreadID) {
    int2 p = (int2)id.xy;
    if (p.x >= filter_width || p.y >= filter_height)
        return;
    int i = at_filter(p), plane = filter_plane();
    float w0 = height[i];
    float2 r = ray((float2)p, bx1, by1, cx, cy);
    float len = sqrt(dot(r, r) + 1.0), inv_len = 1.0 / len, extent = 0.0;
    int radius_class = -1;
    float3 n = float3(0.0, 0.0, 0.0);
    float2 g = float2(0.0, 0.0);
    if (SKY_LIMIT < w0)
        extent = extent_of(w0, len, inv_len);
    if (SKY_LIMIT < w0 && extent_min <= extent) {
        n = gtaoi_normal(p, w0, r, inv_len);
        /* A normal that faces away is tilted until it just faces the eye; straight away from it: towards it. */
        float nv = -(n.x * r.x + n.y * r.y + n.z) * inv_len;
        if (nv < FACING_MIN) {
            float3 lifted = n - (FACING_MIN - nv) * inv_len * float3(r, 1.0);
            float len2 = dot(lifted, lifted);
            n = 1e-12 <= len2 ? lifted * (1.0 / sqrt(len2)) : float3(-r * inv_len, -inv_len);
            nv = max(-(n.x * r.x + n.y * r.y + n.z) * inv_len, 0.5 * FACING_MIN);
        }
        /* g = w0 / (n.r0) (nx / fx, ny / fy), n.r0 = -|r0| n.v; orthographic (nx, ny sy / sx) / nz */
        g = -(1.0 / nv) * inv_len * (orthographic ? 1.0 : w0) * float2(n.x * bx1, n.y * by1);
        radius_class = gtaoi_class(clamp(extent, extent_min, extent_max));
    } else {
        extent = 0.0;
    }
    surface[i] = n.x;
    surface[i + plane] = n.y;
    surface[i + 2 * plane] = n.z;
    surface[i + 3 * plane] = g.x;
    surface[i + 4 * plane] = g.y;
    surface[i + 5 * plane] = extent;
    surface[i + 6 * plane] = (float)radius_class;
}
