#include "slabs.h"

#include <stdlib.h>

#include "sampling.h"

/* Directions of a side of a slice by the cotangent of their angle to the view vector: hidden from `high` (towards the
 * eye) down to `low`. */
typedef struct interval {
    double high, low;
} interval;

/* On the screen line P + t d a point of height w = 1 / z is seen from the pixel at slope (w - w0) / t, and the cotangent
 * of its angle is affine in the slope. */
typedef struct side {
    vec3 p;            /* the pixel's point */
    double w0, gx, gy; /* its height, and the gradient of its tangent plane's */
    double dx, dy, major;
    double scale, shift; /* cotangent = scale slope + shift */
    double cos2_reach, p2, radius;
} side;

typedef struct sample {
    bool hides;
    double z;
    interval hidden;
} sample;

static int descending(const void *a, const void *b) {
    double p = ((const interval *)a)->high, q = ((const interval *)b)->high;
    return (p < q) - (p > q);
}

static double cotangent(const side *s, double t, double w, double lift) {
    return s->scale * (w + lift - s->w0) / t + s->shift;
}

/* `r`: the ray of the sample, `lift`: what its height lacks at the line. */
static bool hide(const side *s, const slabs *set, vec3 r, double t, double lift, double front, double back,
                 interval *out) {
    vec3 to = v3_sub(v3_scale(r, front), s->p);
    bool endless = !(back < (double)VIEW_SKY);
    if (endless || !set->clip) {
        if (v3_dot(to, to) > s->radius * s->radius)
            return false;
    } else {
        double rr = v3_dot(r, r), half = v3_dot(to, r) / rr,
               root = half * half - (v3_dot(to, to) - s->radius * s->radius) / rr;
        if (root < 0)
            return false;
        double enter = fmax(0, -half - sqrt(root)), leave = fmin(back - front, -half + sqrt(root));
        if (leave < enter)
            return false;
        back = front + leave, front += enter;
    }
    if (!(front > 0))
        return false;
    out->high = cotangent(s, t, 1 / front, lift);
    out->low = endless ? -1e30 : cotangent(s, t, 1 / back, lift);
    return true;
}

static int gather(const view *v, const slabs *set, const side *s, int x, int y, double limit, interval *list,
                  int most) {
    double f = (double)v->focal_px;
    sample last[SLAB_LAYERS], now[SLAB_LAYERS];
    int n = 0;
    for (int k = 0; k < set->count; ++k)
        last[k].hides = false;
    last[0] = (sample){true, s->p.z, {limit, limit}};
    for (int i = 1; n + SLAB_LAYERS <= most; ++i) {
        double t = i / s->major, u = x + t * s->dx, w = y + t * s->dy;
        int qx = (int)floor(u + 0.5), qy = (int)floor(w + 0.5);
        if (qx < 0 || qy < 0 || qx >= v->width || qy >= v->height)
            break;
        size_t at = (size_t)qy * (size_t)v->width + (size_t)qx;
        vec3 r = v3((u + 0.5 - (double)v->cx) / f, (w + 0.5 - (double)v->cy) / f, 1);
        double pr = v3_dot(s->p, r);
        if (pr <= 0 || pr * pr < s->cos2_reach * s->p2 * v3_dot(r, r))
            break;
        double lift = s->gx * (u - qx) + s->gy * (w - qy);
        for (int k = 0; k < set->count; ++k) {
            sample *a = &now[k];
            a->z = (double)set->layer[k].front[at];
            a->hides =
                a->z < (double)VIEW_SKY && hide(s, set, r, t, lift, a->z, (double)set->layer[k].back[at], &a->hidden);
            if (!a->hides)
                continue;
            if (set->cell_px > 0 && set->layer[k].slope && !((double)set->layer[k].back[at] > a->z)) {
                /* a sheet: on its own plane, for it may be steep and a pixel wide */
                const float *slope = set->layer[k].slope + 2 * at;
                double half = 0.5 * set->cell_px / s->major, steepest = set->steep / (a->z * f);
                double rise = fmax(-steepest, fmin(steepest, (double)slope[0] * s->dx + (double)slope[1] * s->dy));
                for (int e = -1; e <= 1; e += 2) {
                    double end = cotangent(s, t + e * half, 1 / a->z + e * half * rise, lift);
                    a->hidden.high = fmax(a->hidden.high, end);
                    a->hidden.low = fmin(a->hidden.low, end);
                }
            }
            interval all = a->hidden;
            for (int j = 0; j < set->count; ++j)
                if (last[j].hides && fabs(last[j].z - a->z) <= set->connect_px / s->major * fmin(last[j].z, a->z) / f) {
                    all.high = fmax(all.high, last[j].hidden.high);
                    all.low = fmin(all.low, last[j].hidden.low);
                }
            if (all.high > limit)
                list[n++] = all;
        }
        for (int k = 0; k < set->count; ++k)
            last[k] = now[k];
    }
    return n;
}

/* Antiderivative of cos(theta - n) sin(theta), zero at 0. */
static double integral(double theta, double n) {
    double s = sin(theta), c = cos(theta);
    return 0.5 * (cos(n) * s * s + sin(n) * (theta - s * c));
}

void slab_visibility_rows(const view *v, const slabs *set, float *visibility, int row_begin, int row_end) {
    enum { MOST = 8192 };
    interval *list = malloc(MOST * sizeof *list);
    double f = (double)v->focal_px;
    for (int y = row_begin; list && y < row_end; ++y)
        for (int x = 0; x < v->width; ++x) {
            if (y % set->stride || x % set->stride)
                continue;
            size_t i = (size_t)y * (size_t)v->width + (size_t)x;
            double z = (double)v->z[i];
            visibility[i] = 1;
            if (!(z < (double)VIEW_SKY))
                continue;
            vec3 n = v3_normalize(
                v3((double)v->normals[3 * i], (double)v->normals[3 * i + 1], (double)v->normals[3 * i + 2]));
            vec3 r0 = v3((x + 0.5 - (double)v->cx) / f, (y + 0.5 - (double)v->cy) / f, 1),
                 eye = v3_scale(v3_normalize(r0), -1);
            double length = v3_length(r0), nr = v3_dot(n, r0), open = 0, total = 0;
            side s;
            s.p = v3_scale(r0, z), s.w0 = 1 / z;
            s.gx = s.w0 * n.x / (f * nr), s.gy = s.w0 * n.y / (f * nr);
            s.radius = (double)v->radius, s.p2 = v3_dot(s.p, s.p),
            s.cos2_reach = fmax(0, 1 - s.radius * s.radius / s.p2);
            double noise[2];
            pixel_noise(x, y, noise);
            for (int k = 0; k < set->slices; ++k)
                for (int sign = -1; sign <= 1; sign += 2) {
                    double phi = V3_PI * (k + noise[0]) / set->slices;
                    s.dx = sign * cos(phi), s.dy = sign * sin(phi), s.major = fmax(fabs(s.dx), fabs(s.dy));
                    vec3 b = v3(s.dx / f, s.dy / f, 0), across = v3_mad(b, eye, -v3_dot(b, eye));
                    double size = v3_length(across);
                    vec3 o = v3_scale(across, 1 / size);
                    double no = v3_dot(n, o), nv = v3_dot(n, eye), angle = atan2(no, nv), projected = hypot(no, nv);
                    double limit = angle + 0.5 * V3_PI, jacobian = 1 / (size * size);
                    s.scale = length / (s.w0 * size), s.shift = -v3_dot(b, r0) / (length * size);
                    int count = gather(v, set, &s, x, y, cos(limit) / sin(limit), list, MOST);
                    qsort(list, (size_t)count, sizeof *list, descending);
                    double seen = 0, sum = 0;
                    for (int j = 0; j <= count && seen < limit; ++j) {
                        double from = j < count ? fmin(limit, atan2(1, list[j].high)) : limit;
                        if (from > seen)
                            sum += integral(from, angle) - integral(seen, angle);
                        if (j < count)
                            seen = fmax(seen, atan2(1, list[j].low));
                    }
                    open += jacobian * projected * sum;
                    total += jacobian * projected * integral(limit, angle);
                }
            visibility[i] = (float)(open / total);
        }
    free(list);
}
