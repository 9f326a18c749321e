/* height.hlsli - depth to height, for prepare.hlsl, reduce.hlsl and upsample.hlsl. They read depth. */
#ifndef HEIGHT_HLSLI
#define HEIGHT_HLSLI

/* w of depth z at column x, row y of the image it belongs to: perspective unit / z, orthographic height / unit. SKY
 * where there is nothing. Read the device depth, if there is one: w is linear in it, which no z is. */
float gtaoi_height(float z, int2 p, float bx1, float by1, float cx, float cy) {
    float w;
    bool visible;
    if (depth_kind == DEPTH_DEVICE) { /* w_far is the far plane */
        w = z * w_scale + w_bias;
        visible = w_far < w && w < FLOAT_MAX;
    } else if (orthographic) {
        w = z * w_scale;
        visible = abs(z) <= FLOAT_MAX && (depth_kind == DEPTH_HEIGHT || (0.0 < z && z < z_sky));
    } else {
        float numerator = w_numerator;
        visible = 0.0 < z && z < z_sky;
#if MISTAKE == 1 /* planar z taken for the length of the ray, and the other way round */
        if (depth_kind != DEPTH_DISTANCE) {
#else
        if (depth_kind == DEPTH_DISTANCE) { /* z = distance / |r| */
#endif
            float2 r = ray((float2)p, bx1, by1, cx, cy);
            numerator *= sqrt(dot(r, r) + 1.0);
        }
        w = numerator / z;
    }
    if (orthographic) {
        w = clamp(w, -ORTHO_LIMIT, ORTHO_LIMIT);
    } else {
        visible = visible && W_MIN < w;
        w = min(w, w_max);
    }
    return visible ? w : SKY;
}

#endif
