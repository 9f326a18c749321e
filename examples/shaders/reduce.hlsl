/* reduce.hlsl - the caller's depth, normals and motion to half resolution, or at full resolution to heights.
 *
 *     in   depth, given_normals (x, y, z; image), given_motion (x, y and perhaps z; image)
 *     out  reduced_height;  reduced_normals, reduced_motion: planes x, y, z
 *
 * Of four heights one is taken, never the mean: between two surfaces there is none. */
#include "gtao.hlsli"

StructuredBuffer<float> depth : register(t0);
StructuredBuffer<float> given_normals : register(t1);
StructuredBuffer<float> given_motion : register(t2);
RWStructuredBuffer<float> reduced_height : register(u10);
RWStructuredBuffer<float> reduced_normals : register(u11);
RWStructuredBuffer<float> reduced_motion : register(u12);

#include "height.hlsli"

static const int REDUCE_NEAREST = 0, REDUCE_FARTHEST = 1, REDUCE_CHECKERBOARD = 2;

float height_of(int2 p) {
    p = min(p, int2(full_width, full_height) - 1);
    return gtaoi_height(depth[at_image(p)], p, full_bx1, full_by1, full_cx, full_cy);
}

/* Height of the pixel that the last block of an odd image lacks, from the two before it: so that planes go on. */
float gtaoi_beyond(float a, float b) {
    float d = a - b, tolerance = (orthographic ? 1.0 : a) * full_same_surface;
    return SKY_LIMIT < a && abs(d) <= tolerance ? a + d : a;
}

/* The height that stands for 2x2 pixels and which of them it is, 0 .. 3; within one surface moved to the block's
 * centre, so that planes stay the planes that the normals tell. */
float gtaoi_choose(float w[4], int2 p, out int which) {
    float nearest = w[0], farthest = SKY_LIMIT < w[0] ? w[0] : FLOAT_MAX;
    int of_nearest = 0, of_farthest = 0;
    for (int i = 1; i < 4; i++) {
        if (nearest < w[i]) {
            nearest = w[i];
            of_nearest = i;
        }
        if (SKY_LIMIT < w[i] && w[i] < farthest) {
            farthest = w[i];
            of_farthest = i;
        }
    }
    farthest = SKY_LIMIT < nearest ? farthest : nearest; /* all sky */
    bool far_one = reduction == REDUCE_FARTHEST || (reduction == REDUCE_CHECKERBOARD && ((p.x + p.y) & 1) != 0);
    which = far_one ? of_farthest : of_nearest;
    float chosen = far_one ? farthest : nearest;
    float across = w[which ^ 1] - chosen, down = w[which ^ 2] - chosen;
    bool smooth = max(abs(across), abs(down)) <= (orthographic ? 1.0 : chosen) * full_same_surface;
    return chosen + (smooth ? 0.5 * (across + down) : 0.0);
}

[numthreads(8, 8, 1)]
void main(uint3 id : SV_DispatchThreadID) {
    int2 p = (int2)id.xy;
    if (p.x >= filter_width || p.y >= filter_height)
        return;
    int i = at_filter(p), plane = filter_plane(), which = 0, k;
    int2 q = p * scale;
    if (scale == 1) {
        reduced_height[i] = height_of(p);
    } else {
        float w[4];
        for (k = 0; k < 4; k++)
            w[k] = height_of(q + int2(k & 1, k >> 1));
        if (q.y + 1 == full_height && q.y > 0)
            for (k = 0; k < 2; k++)
                w[2 + k] = gtaoi_beyond(w[k], height_of(q + int2(k, -1)));
        if (q.x + 1 == full_width && q.x > 0) {
            w[1] = gtaoi_beyond(w[0], height_of(q + int2(-1, 0)));
            w[3] = gtaoi_beyond(w[2], height_of(q + int2(-1, 1)));
        }
        reduced_height[i] = gtaoi_choose(w, p, which);
    }
    int at = at_image(min(q + int2(which & 1, which >> 1), int2(full_width, full_height) - 1));
    if (input_normals) {
        float3 n = float3(given_normals[at], given_normals[at + image_plane()], given_normals[at + 2 * image_plane()]);
        float len2 = dot(n, n);
        n = 1e-30 <= len2 && len2 <= FLOAT_MAX ? n * (1.0 / sqrt(len2)) : float3(0.0, 0.0, 0.0);
        for (k = 0; k < 3; k++)
            reduced_normals[i + k * plane] = n[k];
    }
    if (input_motion) {
        for (k = 0; k < 3; k++)
            reduced_motion[i + k * plane] =
                k < input_motion ? given_motion[at + k * image_plane()] * (k < 2 ? 1.0 / (float)scale : 1.0) : 0.0;
    }
}
