/* GTAO with the constants and heuristics of XeGTAO 1.30 (Intel), written from their description: radius x 1.457 with a
 * falloff over 61.5 % of it, squared steps on whole pixels, a weighted depth pyramid, Hilbert-R2 noise, the projected
 * normal's length drawn towards 1, visibility^2.2, and the 3x3 edge-stopping denoiser.
 * `directions` counts the slices, `steps` the samples on each side, `blur` the denoiser's passes. */
#include "rivals.h"
#include "tests/bench/sampling.h"

enum { LEVELS = 5 };

typedef struct pyramid {
    const float *level[LEVELS];
    int width[LEVELS], height[LEVELS];
} pyramid;

static const float radius_multiplier = 1.457f, falloff_share = 0.615f;

/* Averages 2 x 2 depths, weighted so that those much nearer than the farthest drop out. */
static float *fill_pyramid(const view *v, pyramid *p, float *storage) {
    float reach = 0.75f * v->radius * radius_multiplier, range = falloff_share * reach;
    float mul = -1 / range, add = reach * (1 - falloff_share) / range + 1;
    p->level[0] = v->z, p->width[0] = v->width, p->height[0] = v->height;
    for (int l = 1; l < LEVELS; ++l) {
        int w0 = p->width[l - 1], h0 = p->height[l - 1], w = w0 > 1 ? w0 / 2 : 1, h = h0 > 1 ? h0 / 2 : 1;
        const float *from = p->level[l - 1];
        for (int y = 0; y < h; ++y)
            for (int x = 0; x < w; ++x) {
                float z[4], farthest = 0, sum = 0, weights = 0;
                for (int k = 0; k < 4; ++k) {
                    int sx = clampi(2 * x + (k & 1), 0, w0 - 1), sy = clampi(2 * y + (k >> 1), 0, h0 - 1);
                    z[k] = from[(size_t)sy * (size_t)w0 + (size_t)sx];
                    farthest = fmaxf(farthest, z[k]);
                }
                for (int k = 0; k < 4; ++k) {
                    float weight = clampf((farthest - z[k]) * mul + add, 0, 1);
                    sum += weight * z[k];
                    weights += weight;
                }
                storage[(size_t)y * (size_t)w + (size_t)x] = sum / weights;
            }
        p->level[l] = storage, p->width[l] = w, p->height[l] = h;
        storage += (size_t)w * (size_t)h;
    }
    return storage;
}

/* Point whose pixel offset from (x, y) is (ox, oy), depth from level `mip`. */
static v3f sample_point(const view *v, const pyramid *p, int x, int y, float ox, float oy, int mip) {
    float px = (float)x + 0.5f + ox, py = (float)y + 0.5f + oy;
    int w = p->width[mip], h = p->height[mip];
    int sx = clampi((int)floorf(px * (float)w / (float)v->width), 0, w - 1);
    int sy = clampi((int)floorf(py * (float)h / (float)v->height), 0, h - 1);
    float z = p->level[mip][(size_t)sy * (size_t)w + (size_t)sx], s = z / v->focal_px;
    return (v3f){(px - v->cx) * s, (py - v->cy) * s, z};
}

static void run(const view *v, const rival_preset *preset, float *scratch, float *raw) {
    const float pi = 3.14159265f, radius = v->radius * radius_multiplier;
    const int slices = preset->directions, steps = preset->steps;
    pyramid p;
    fill_pyramid(v, &p, scratch);
    for (int y = 0; y < v->height; ++y)
        for (int x = 0; x < v->width; ++x) {
            size_t i = rival_index(v, x, y);
            raw[i] = 1;
            if (!(v->z[i] < VIEW_SKY))
                continue;
            /* a little nearer, against self-occlusion by rounding */
            float z = v->z[i] * 0.99999f;
            v3f point = rival_point(v, x, y, z), n = rival_normal(v, i), eye = v3f_scale(v3f_normalize(point), -1);
            float radius_px = radius * v->focal_px / z, nearest = 1.3f / radius_px;
            float visibility = clampf((10 - radius_px) / 100, 0, 1) * 0.5f;
            double noise[2];
            pixel_noise(x, y, noise);
            for (int slice = 0; slice < slices; ++slice) {
                float phi = ((float)slice + (float)noise[0]) / (float)slices * pi, c = cosf(phi), s = sinf(phi);
                v3f d = {c, s, 0}, ortho = v3f_mad(d, eye, -v3f_dot(d, eye)),
                    axis = v3f_normalize(v3f_cross(ortho, eye));
                v3f projected = v3f_mad(n, axis, -v3f_dot(n, axis));
                float length = sqrtf(v3f_dot(projected, projected));
                float cos_n = length > 0 ? clampf(v3f_dot(projected, eye) / length, 0, 1) : 1;
                float angle = rival_acos(cos_n) * (v3f_dot(ortho, projected) < 0 ? -1.0f : 1.0f);
                float low0 = cosf(angle + 0.5f * pi), low1 = cosf(angle - 0.5f * pi), horizon0 = low0, horizon1 = low1;
                for (int step = 0; step < steps; ++step) {
                    float jitter = (float)noise[1] + (float)(slice + step * steps) * 0.6180339887f;
                    float t = ((float)step + jitter - floorf(jitter)) / (float)steps;
                    float at = (t * t + nearest) * radius_px;
                    int mip = (int)(clampf(log2f(at) - 3.3f, 0, LEVELS - 1) + 0.5f);
                    float ox = roundf(c * at), oy = roundf(s * at);
                    v3f d0 = v3f_sub(sample_point(v, &p, x, y, ox, oy, mip), point);
                    v3f d1 = v3f_sub(sample_point(v, &p, x, y, -ox, -oy, mip), point);
                    float l0 = sqrtf(v3f_dot(d0, d0)), l1 = sqrtf(v3f_dot(d1, d1));
                    float w0 = clampf((radius - l0) / (falloff_share * radius), 0, 1);
                    float w1 = clampf((radius - l1) / (falloff_share * radius), 0, 1);
                    float cos0 = l0 > 0 ? v3f_dot(d0, eye) / l0 : low0, cos1 = l1 > 0 ? v3f_dot(d1, eye) / l1 : low1;
                    horizon0 = fmaxf(horizon0, low0 + (cos0 - low0) * w0);
                    horizon1 = fmaxf(horizon1, low1 + (cos1 - low1) * w1);
                }
                length = length + (1 - length) * 0.05f;
                float h0 = -rival_acos(clampf(horizon1, -1, 1)), h1 = rival_acos(clampf(horizon0, -1, 1)),
                      sin_n = sinf(angle);
                float arc0 = (cos_n + 2 * h0 * sin_n - cosf(2 * h0 - angle)) / 4;
                float arc1 = (cos_n + 2 * h1 * sin_n - cosf(2 * h1 - angle)) / 4;
                visibility += length * (arc0 + arc1);
            }
            visibility /= (float)slices;
            raw[i] = fmaxf(0.03f, powf(fmaxf(0, visibility), 2.2f));
        }
}

/* Left, right, top, bottom edges in 2 bits each: 3 where the surface goes on. */
static unsigned char edges_at(const view *v, int x, int y) {
    float z = v->z[rival_index(v, x, y)], d[4];
    d[0] = v->z[rival_index(v, x > 0 ? x - 1 : x, y)] - z;
    d[1] = v->z[rival_index(v, x + 1 < v->width ? x + 1 : x, y)] - z;
    d[2] = v->z[rival_index(v, x, y > 0 ? y - 1 : y)] - z;
    d[3] = v->z[rival_index(v, x, y + 1 < v->height ? y + 1 : y)] - z;
    float slope_x = 0.5f * (d[1] - d[0]), slope_y = 0.5f * (d[3] - d[2]);
    float along[4] = {d[0] + slope_x, d[1] - slope_x, d[2] + slope_y, d[3] - slope_y};
    unsigned packed = 0;
    for (int k = 0; k < 4; ++k) {
        float e = clampf(1.25f - fminf(fabsf(d[k]), fabsf(along[k])) / (z * 0.011f), 0, 1);
        packed |= (unsigned)(e * 2.9f + 0.5f) << (2 * k);
    }
    return (unsigned char)packed;
}

static float edge(unsigned char packed, int k) {
    return (float)(packed >> (2 * k) & 3) * (1.0f / 3);
}

static void denoise(const view *v, const rival_preset *preset, float *scratch, float *raw) {
    enum { L, R, T, B };
    size_t n = view_pixels(v);
    float *copy = scratch;
    unsigned char *edges = (unsigned char *)(scratch + n);
    for (int y = 0; y < v->height; ++y)
        for (int x = 0; x < v->width; ++x)
            edges[rival_index(v, x, y)] = edges_at(v, x, y);
    for (int pass = 0; pass < preset->blur; ++pass) {
        float centre = pass == preset->blur - 1 ? 1.2f : 1.2f / 5;
        for (size_t i = 0; i < n; ++i)
            copy[i] = raw[i];
        for (int y = 0; y < v->height; ++y)
            for (int x = 0; x < v->width; ++x) {
                size_t i = rival_index(v, x, y);
                if (!(v->z[i] < VIEW_SKY))
                    continue;
                int xl = x > 0 ? x - 1 : x, xr = x + 1 < v->width ? x + 1 : x, yt = y > 0 ? y - 1 : y,
                    yb = y + 1 < v->height ? y + 1 : y;
                size_t l = rival_index(v, xl, y), r = rival_index(v, xr, y), t = rival_index(v, x, yt),
                       b = rival_index(v, x, yb);
                float e[4] = {edge(edges[i], L) * edge(edges[l], R), edge(edges[i], R) * edge(edges[r], L),
                              edge(edges[i], T) * edge(edges[t], B), edge(edges[i], B) * edge(edges[b], T)};
                /* pixels with edges on three sides or more leak a little, against aliasing */
                float leak = clampf(1.5f - (e[0] + e[1] + e[2] + e[3]), 0, 1) / 1.5f * 0.5f;
                for (int k = 0; k < 4; ++k)
                    e[k] = clampf(e[k] + leak, 0, 1);
                float tl = 0.425f * (e[L] * edge(edges[l], T) + e[T] * edge(edges[t], L));
                float tr = 0.425f * (e[T] * edge(edges[t], R) + e[R] * edge(edges[r], T));
                float bl = 0.425f * (e[B] * edge(edges[b], L) + e[L] * edge(edges[l], B));
                float br = 0.425f * (e[R] * edge(edges[r], B) + e[B] * edge(edges[b], R));
                float sum = copy[i] * centre + copy[l] * e[L] + copy[r] * e[R] + copy[t] * e[T] + copy[b] * e[B];
                sum += copy[rival_index(v, xl, yt)] * tl + copy[rival_index(v, xr, yt)] * tr;
                sum += copy[rival_index(v, xl, yb)] * bl + copy[rival_index(v, xr, yb)] * br;
                raw[i] = sum / (centre + e[L] + e[R] + e[T] + e[B] + tl + tr + bl + br);
            }
    }
}

const rival rival_xegtao = {"xegtao",
                            "GTAO with XeGTAO's constants",
                            "XeGTAO 1.30",
                            run,
                            denoise,
                            4,
                            {{"low", 1, 2, 4, 1, {0, 1, 1}},
                             {"medium", 2, 2, 8, 1, {0, 1, 1}},
                             {"high", 3, 3, 18, 1, {0, 1, 1}},
                             {"ultra", 9, 3, 54, 1, {0, 1, 1}}}};
