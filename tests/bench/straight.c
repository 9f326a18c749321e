#include "straight.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "measure.h"
#include "tests/reference/reference.h"

/* Constants of gtao.h and of the memo's production setting. */
enum { SLICES = 1, STEPS = 8, CAP_PX = 50, MAX_HISTORY = 24 };
static const float same_surface_px = 4.0f, disocclusion = 0.025f, clamp_window = 0.5f, clamp_noise = 1.2f,
                   blur_cost = 0.6f;

typedef struct history {
    float visibility, length, speed, last, deviation;
} history;

struct straight {
    int width, height; /* at half resolution */
    bool has_history;
    float *z, *z_before, *normals, *motion, *raw, *filtered;
    history *now, *before;
};

straight *straight_open(int width, int height) {
    straight *s = calloc(1, sizeof *s);
    size_t n = (size_t)(width / 2) * (size_t)(height / 2);
    if (!s)
        return NULL;
    s->width = width / 2, s->height = height / 2;
    s->z = calloc(n, sizeof(float)), s->z_before = calloc(n, sizeof(float));
    s->normals = calloc(3 * n, sizeof(float)), s->motion = calloc(3 * n, sizeof(float));
    s->raw = calloc(n, sizeof(float)), s->filtered = calloc(n, sizeof(float));
    s->now = calloc(n, sizeof(history)), s->before = calloc(n, sizeof(history));
    if (!s->z || !s->z_before || !s->normals || !s->motion || !s->raw || !s->filtered || !s->now || !s->before) {
        straight_close(s);
        return NULL;
    }
    return s;
}

void straight_close(straight *s) {
    if (!s)
        return;
    free(s->z), free(s->z_before), free(s->normals), free(s->motion);
    free(s->raw), free(s->filtered), free(s->now), free(s->before);
    free(s);
}

static float clamp(float x, float low, float high) {
    return x < low ? low : x > high ? high : x;
}

/* 1 / z; 0 in the sky and outside. */
static float height_at(const straight *s, const float *z, int x, int y) {
    float depth;
    if (x < 0 || y < 0 || x >= s->width || y >= s->height)
        return 0;
    depth = z[y * s->width + x];
    return depth > 0 && depth < VIEW_SKY ? 1.0f / depth : 0.0f;
}

/* The nearest of 2x2, moved to the middle where all is one surface. */
static void reduce(straight *s, const view *v, const float *motion) {
    for (int y = 0; y < s->height; ++y)
        for (int x = 0; x < s->width; ++x) {
            int at = y * s->width + x, best = 2 * y * v->width + 2 * x;
            int beside, below;
            for (int k = 1; k < 4; ++k) {
                int i = (2 * y + k / 2) * v->width + 2 * x + k % 2;
                if (v->z[i] < v->z[best])
                    best = i;
            }
            beside = best ^ 1;
            below = best / v->width % 2 ? best - v->width : best + v->width;
            s->z[at] = v->z[best];
            if (v->z[best] < VIEW_SKY) {
                float w = 1.0f / v->z[best], wx = 1.0f / v->z[beside], wy = 1.0f / v->z[below];
                float limit = same_surface_px / v->focal_px * w;
                if (fabsf(wx - w) <= limit && fabsf(wy - w) <= limit)
                    s->z[at] = 1.0f / (0.5f * (wx + wy));
            }
            for (int k = 0; k < 3; ++k) {
                s->normals[3 * at + k] = v->normals[3 * best + k];
                s->motion[3 * at + k] = motion[3 * best + k] * (k < 2 ? 0.5f : 1.0f);
            }
        }
}

/* The slope of 1/z along (dx, dy), from the smoother side, where it can be trusted; how much it bends is added. */
static float slope(const straight *s, int x, int y, int dx, int dy, float tolerance, float *bend) {
    float w0 = height_at(s, s->z, x, y);
    float a = w0 - height_at(s, s->z, x - dx, y - dy), b = height_at(s, s->z, x + dx, y + dy) - w0;
    float a2 = height_at(s, s->z, x - dx, y - dy) - height_at(s, s->z, x - 2 * dx, y - 2 * dy);
    float b2 = height_at(s, s->z, x + 2 * dx, y + 2 * dy) - height_at(s, s->z, x + dx, y + dy);
    float error_a = fabsf(a - a2), error_b = fabsf(b - b2), error = fminf(error_a, error_b);
    if (error > tolerance)
        return 0;
    *bend += error;
    return error_a < error_b ? a : b;
}

/* 4x4 pixels, the window moved by one on odd frames. */
static void spatial(straight *s, const view *v, unsigned frame) {
    int first = frame & 1 ? -2 : -1;
    for (int y = 0; y < s->height; ++y)
        for (int x = 0; x < s->width; ++x) {
            int at = y * s->width + x;
            float w0 = height_at(s, s->z, x, y), tolerance = w0 * 2.0f / v->focal_px, bend = 0, sum = 0, total = 0;
            float gx, gy;
            s->filtered[at] = s->raw[at];
            if (w0 == 0)
                continue;
            gx = slope(s, x, y, 1, 0, tolerance, &bend), gy = slope(s, x, y, 0, 1, tolerance, &bend);
            tolerance += fminf(2 * bend, tolerance);
            for (int j = first; j < first + 4; ++j)
                for (int i = first; i < first + 4; ++i) {
                    float w = height_at(s, s->z, x + i, y + j), share;
                    if (w == 0)
                        continue;
                    share = 1 - fabsf(w - (w0 + gx * (float)i + gy * (float)j)) / tolerance;
                    if (share <= 0)
                        continue;
                    sum += share * s->raw[at + j * s->width + i], total += share;
                }
            s->filtered[at] = sum / total;
        }
}

static void temporal(straight *s, const view *v) {
    for (int y = 0; y < s->height; ++y)
        for (int x = 0; x < s->width; ++x) {
            int at = y * s->width + x;
            const float *motion = s->motion + 3 * at;
            float w0 = height_at(s, s->z, x, y), now = s->filtered[at], weight = 0, bend = 0;
            float px = (float)x + motion[0], py = (float)y + motion[1];
            history h = {0, 0, 0, 0, 0};
            s->now[at] = (history){now, 1, 0, now, 0};
            if (w0 == 0 || !s->has_history || !(px > -1 && py > -1 && px < (float)s->width && py < (float)s->height))
                continue;
            int ix = (int)floorf(px), iy = (int)floorf(py);
            float fx = px - (float)ix, fy = py - (float)iy, expected = 1 / (1 / w0 + motion[2]);
            float gx = slope(s, x, y, 1, 0, w0 * 2.0f / v->focal_px, &bend);
            float gy = slope(s, x, y, 0, 1, w0 * 2.0f / v->focal_px, &bend);
            for (int k = 0; k < 4; ++k) {
                int i = k & 1, j = k >> 1;
                float w = height_at(s, s->z_before, ix + i, iy + j);
                float share = (i ? fx : 1 - fx) * (j ? fy : 1 - fy);
                float here = expected + gx * ((float)i - fx) + gy * ((float)j - fy);
                const history *b;
                if (w == 0 || share == 0)
                    continue;
                b = s->before + (iy + j) * s->width + ix + i;
                share *= clamp(1 - (w - here) / (disocclusion * expected), 0, 1); /* nearer: another surface's */
                weight += share;
                h.visibility += share * b->visibility, h.length += share * b->length, h.speed += share * b->speed;
                h.last += share * b->last, h.deviation += share * b->deviation;
            }
            if (weight <= 1.0f / 16)
                continue;
            float past = h.visibility / weight, speed = 2 * hypotf(motion[0], motion[1]);
            float blur = fx * (1 - fx) + fy * (1 - fy), length = h.length * (1 - blur_cost * blur);
            float calm = fmaxf(0, 1 - 0.25f * fabsf(speed - h.speed / weight));
            float deviation = h.deviation / weight;
            deviation += 0.125f * (fabsf(now - h.last / weight) - deviation);
            float least = now, greatest = now;
            for (int k = 0; k < 4; ++k) {
                int across = (k & 1 ? 1 : -1), down = (k & 2 ? 1 : -1);
                int nx = x + across, ny = y + down;
                nx = nx < 0 ? 0 : nx >= s->width ? s->width - 1 : nx;
                ny = ny < 0 ? 0 : ny >= s->height ? s->height - 1 : ny;
                float mean = 0.25f * (now + s->filtered[y * s->width + nx] + s->filtered[ny * s->width + x] +
                                      s->filtered[ny * s->width + nx]);
                least = fminf(least, mean), greatest = fmaxf(greatest, mean);
            }
            float window = fmaxf(calm * clamp_window * (greatest - least), clamp_noise * deviation);
            float clamped = clamp(past, least - window, greatest + window);
            length *= 1 - fminf(1, fabsf(past - clamped) / fmaxf(fabsf(now - past), 1e-12f));
            length = 1 + fminf(length, fmaxf(MAX_HISTORY - speed, 8) - 1);
            s->now[at] = (history){clamped + (now - clamped) / length, length, speed, now, deviation};
        }
}

/* Bilinear from four blocks, weighted by how well their heights fit. */
static void upsample(const straight *s, const view *v, float *visibility) {
    for (int y = 0; y < v->height; ++y)
        for (int x = 0; x < v->width; ++x) {
            size_t at = (size_t)y * (size_t)v->width + (size_t)x;
            int hx = x / 2, hy = y / 2, side_x = x & 1 ? 1 : -1, side_y = y & 1 ? 1 : -1;
            float sum = 0, total = 0, w, w0, tolerance;
            visibility[at] = 1;
            if (!(v->z[at] < VIEW_SKY))
                continue;
            w = 1 / v->z[at], w0 = height_at(s, s->z, hx, hy), tolerance = w * 2.0f / v->focal_px;
            tolerance += fminf(
                1.25f * (fminf(fabsf(w0 - height_at(s, s->z, hx - 1, hy)), fabsf(w0 - height_at(s, s->z, hx + 1, hy))) +
                         fminf(fabsf(w0 - height_at(s, s->z, hx, hy - 1)), fabsf(w0 - height_at(s, s->z, hx, hy + 1)))),
                2 * tolerance);
            for (int k = 0; k < 4; ++k) {
                int i = k & 1 ? side_x : 0, j = k & 2 ? side_y : 0;
                float tap = height_at(s, s->z, hx + i, hy + j), e, share, close;
                if (tap == 0)
                    continue;
                e = fabsf(tap - w) / tolerance, close = 1.0f / 64 / (1 + e);
                share = clamp(2 - e, 0, 1) + close * close * close * close;
                share *= (i ? 0.25f : 0.75f) * (j ? 0.25f : 0.75f);
                sum += share * s->now[(hy + j) * s->width + hx + i].visibility, total += share;
            }
            if (total > 0)
                visibility[at] = sum / total;
        }
}

void straight_frame(straight *s, const view *v, const float *motion, unsigned frame, float *visibility,
                    double seconds[STRAIGHT_STAGES]) {
    const memo_settings settings = {SLICES, STEPS, v->radius, v->falloff, CAP_PX};
    float direction[16], offset[16], *z = s->z_before;
    history *before = s->now;
    double t[STRAIGHT_STAGES + 1];
    s->now = s->before, s->before = before;
    s->z_before = s->z, s->z = z;
    t[0] = thread_seconds();
    reduce(s, v, motion);
    t[1] = thread_seconds();
    memo_noise(frame, direction, offset);
    memo_gtao(s->width, s->height, s->z, s->normals, 0.5f * v->focal_px, 0.5f * v->cx, 0.5f * v->cy, &settings,
              direction, offset, s->raw);
    t[2] = thread_seconds();
    spatial(s, v, frame);
    t[3] = thread_seconds();
    temporal(s, v);
    t[4] = thread_seconds();
    upsample(s, v, visibility);
    t[5] = thread_seconds();
    for (int k = 0; k < STRAIGHT_STAGES; ++k)
        seconds[k] += t[k + 1] - t[k];
    s->has_history = true;
}
