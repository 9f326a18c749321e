/* filters.hlsli - what the filters in space and time share. They read height. */
#ifndef FILTERS_HLSLI
#define FILTERS_HLSLI

/* How far heights may differ and still belong together. */
float gtaoi_tolerance(float w) {
    return w * tolerance_scale + tolerance_bias;
}

/* Outside the image there is nothing, unless it wraps around. */
float filter_height_at(int2 p) {
    int2 size = int2(filter_width, filter_height);
    if (border == BORDER_WRAP)
        p = at_border(p, size);
    return any(p < 0) || any(p >= size) ? SKY : height[at_filter(p)];
}

/* The slope of the surface at a pixel, zero where there is none to be trusted, and by how much it bends: first and
 * second derivatives [J16]. */
float2 gtaoi_slope(int2 p, float w0, float tolerance, out float bend) {
    float2 g, e;
    g.x = gtaoi_gradient(w0, filter_height_at(p - int2(1, 0)), filter_height_at(p - int2(2, 0)),
                         filter_height_at(p + int2(1, 0)), filter_height_at(p + int2(2, 0)), e.x);
    g.y = gtaoi_gradient(w0, filter_height_at(p - int2(0, 1)), filter_height_at(p - int2(0, 2)),
                         filter_height_at(p + int2(0, 1)), filter_height_at(p + int2(0, 2)), e.y);
    g = float2(e.x <= tolerance ? g.x : 0.0, e.y <= tolerance ? g.y : 0.0);
    bend = (e.x <= tolerance ? e.x : 0.0) + (e.y <= tolerance ? e.y : 0.0);
    return g;
}

#endif
