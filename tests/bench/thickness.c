#include "thickness.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const thickness_rule thickness_fitted = {0.35f, 1.5f, 6, false};

typedef struct run {
    float z;      /* where it was last seen */
    int last, id; /* pixel at which that was, and at which it was first seen */
} run;

typedef struct line {
    int *id, *first, *end; /* run at each pixel; where runs, by id, begin and end */
} line;

static bool is_surface(float z) {
    return z > 0 && z < VIEW_SKY;
}

/* Pixels that the surface seen at each of n pixels of a row or column takes up on it, with what nearer things hide of
 * it. A run goes on while its depth changes little; something nearer interrupts it, and behind that it is resumed if the
 * depth fits; it ends where something farther shows, which in turn may begin behind it. */
static void widths(const float *z, size_t stride, int n, float focal_px, float slope, const line *l, float *width) {
    enum { MOST = 32 };
    run stack[MOST]; /* nearest on top */
    int top = 0;
    for (int i = 0; i < n; ++i) {
        float d = z[(size_t)i * stride];
        int start = i;
        bool found = false;
        l->id[i] = -1;
        l->end[i] = n;
        if (!is_surface(d)) {
            while (top)
                l->end[stack[--top].id] = i;
            continue;
        }
        while (top && !found) {
            const run *r = &stack[top - 1];
            float tolerance = slope * fminf(d, r->z) / focal_px * (float)(i - r->last), behind = d - r->z;
            if (behind < -tolerance)
                break;
            found = behind <= tolerance;
            if (!found) {
                l->end[r->id] = i;
                start = l->first[r->id];
                --top;
            }
        }
        if (!found) {
            if (top == MOST)
                memmove(stack, stack + 1, (size_t)--top * sizeof *stack);
            l->first[i] = start;
            stack[top++].id = i;
        }
        stack[top - 1].z = d;
        stack[top - 1].last = i;
        l->id[i] = stack[top - 1].id;
    }
    for (int i = 0; i < n; ++i) {
        int id = l->id[i];
        bool border = id >= 0 && (l->first[id] == 0 || l->end[id] == n);
        width[(size_t)i * stride] = id < 0 ? 0 : border ? INFINITY : (float)(l->end[id] - l->first[id]);
    }
}

/* Change of depth from pixel to pixel, the lesser of both sides. */
static float change(const float *z, bool before, bool after, size_t step) {
    float a = before && is_surface(z[-(ptrdiff_t)step]) ? fabsf(z[-(ptrdiff_t)step] - *z) : INFINITY;
    float b = after && is_surface(z[step]) ? fabsf(z[step] - *z) : INFINITY;
    return fminf(a, b);
}

bool thickness_estimate(const view *v, const thickness_rule *rule, float *map) {
    int w = v->width, h = v->height, longest = w > h ? w : h;
    int *lines = malloc(3 * (size_t)longest * sizeof *lines);
    float *across = malloc(view_pixels(v) * sizeof *across);
    if (!lines || !across) {
        free(lines);
        free(across);
        return false;
    }
    line l = {lines, lines + longest, lines + 2 * longest};
    for (int y = 0; y < h; ++y)
        widths(v->z + (size_t)y * (size_t)w, 1, w, v->focal_px, rule->slope, &l, across + (size_t)y * (size_t)w);
    for (int x = 0; x < w; ++x)
        widths(v->z + x, (size_t)w, h, v->focal_px, rule->slope, &l, map + x);
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) {
            size_t i = (size_t)y * (size_t)w + (size_t)x;
            float footprint = v->z[i] / v->focal_px, width = fminf(map[i], across[i]) * footprint;
            if (!is_surface(v->z[i])) {
                map[i] = 0;
                continue;
            }
            if (!rule->flat) {
                float sx = change(v->z + i, x > 0, x + 1 < w, 1) / footprint;
                float sy = change(v->z + i, y > 0, y + 1 < h, (size_t)w) / footprint;
                width *= fminf(5, sqrtf(1 + sx * sx + sy * sy));
            }
            map[i] = width > rule->endless * v->radius ? INFINITY : rule->factor * width;
        }
    free(lines);
    free(across);
    return true;
}
