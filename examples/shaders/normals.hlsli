/* normals.hlsli - the normal of a pixel, for surface.hlsl and integrate.hlsl. They read height and normals. */
#ifndef NORMALS_HLSLI
#define NORMALS_HLSLI
#include "gtao.hlsli"

/* Height of a neighbour; beyond the border only what wraps around is there. */
float height_beside(int2 p) {
    if (border == BORDER_WRAP)
        p = at_border(p, int2(filter_width, filter_height));
    if (any(p < 0) || p.x >= filter_width || p.y >= filter_height)
        return SKY;
    return height[at_filter(p)];
}

/* What the gradient looks at beyond the neighbours may be beyond a clamped border, where heights go on along a row. */
float height_next(int2 p) {
    if (border == BORDER_CLAMP)
        p.x = clamp(p.x, 0, filter_width - 1);
    return height_beside(p);
}

/* The normal of the surface w = w0 + g.q: n = -(fx gx, fy gy, w0 - g.(x - c)), normalised; orthographic -(g / size, 1).
 * Where nothing can be told: towards the eye. */
float3 gtaoi_derive_normals(int2 p, float w0, float2 r, float inv_len) {
    float unused;
    float gx = gtaoi_gradient(w0, height_beside(p - int2(1, 0)), height_next(p - int2(2, 0)),
                              height_beside(p + int2(1, 0)), height_next(p + int2(2, 0)), unused);
    float gy = gtaoi_gradient(w0, height_beside(p - int2(0, 1)), height_beside(p - int2(0, 2)),
                              height_beside(p + int2(0, 1)), height_beside(p + int2(0, 2)), unused);
    float3 n = float3(gx / bx1, gy / by1, 1.0);
    if (!orthographic)
        n.z = w0 - n.x * r.x - n.y * r.y;
    float len2 = dot(n, n);
    if (0.0 < len2 && len2 <= FLOAT_MAX)
        return n * (-1.0 / sqrt(len2));
    return float3(-r * inv_len, -inv_len);
}

/* The given normal in view space, unit length; zero where there is none. */
float3 gtaoi_load_normals(int2 p) {
    int i = at_filter(p), plane = filter_plane();
    float3 n, given = float3(normals[i], normals[i + plane], normals[i + 2 * plane]);
#if MISTAKE == 4 /* the engine's y up for the library's y down */
    given.y = -given.y;
#endif
    n = float3(dot(to_view[0].xyz, given), dot(to_view[1].xyz, given), dot(to_view[2].xyz, given));
    float len2 = dot(n, n);
    return 1e-30 <= len2 && len2 <= FLOAT_MAX ? n * (1.0 / sqrt(len2)) : float3(0.0, 0.0, 0.0);
}

/* As given; derived where missing; of sky without one towards the eye. */
float3 gtaoi_normal(int2 p, float w0, float2 r, float inv_len) {
    float3 n = float3(0.0, 0.0, 0.0);
    if (input_normals)
        n = gtaoi_load_normals(p);
    if (any(n != 0.0))
        return n;
    return SKY_LIMIT < w0 ? gtaoi_derive_normals(p, w0, r, inv_len) : float3(-r * inv_len, -inv_len);
}

#endif
