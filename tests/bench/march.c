#include "march.h"

#include <stdbool.h>
#include <stdlib.h>

#include "sampling.h"

typedef struct cell {
    double w, gx, gy; /* 1 / z, 0 for sky; gradient of the tangent plane's w per pixel */
} cell;

struct march {
    const view *v;
    cell *cells;
};

march *march_open(const view *v) {
    march *m = malloc(sizeof *m);
    cell *cells = malloc(view_pixels(v) * sizeof *cells);
    if (!m || !cells) {
        free(m);
        free(cells);
        return NULL;
    }
    m->v = v;
    m->cells = cells;
    double f = (double)v->focal_px;
    for (int y = 0; y < v->height; ++y)
        for (int x = 0; x < v->width; ++x) {
            size_t i = (size_t)y * (size_t)v->width + (size_t)x;
            const float *n = v->normals + 3 * i;
            double z = (double)v->z[i], w = z < (double)VIEW_SKY ? 1 / z : 0;
            /* n . (r / w) is the same all over the plane, so w is proportional to n . r */
            double nr = (double)n[0] * (x + 0.5 - (double)v->cx) / f + (double)n[1] * (y + 0.5 - (double)v->cy) / f +
                        (double)n[2];
            cells[i] = (cell){w, w * (double)n[0] / (f * nr), w * (double)n[1] / (f * nr)};
        }
    return m;
}

void march_close(march *m) {
    if (m) {
        free(m->cells);
        free(m);
    }
}

/* Height where the line crosses the column (major = x) or row (major = y) `line`, at `at` along the other axis. `plane`
 * is the receiver's tangent plane's gradient along that axis: a pixel beside the line keeps its height above this plane,
 * so that a plane stays open where it borders on something else. False outside the image. */
static bool crossing_height(const march *m, bool major_x, int line, double at, double plane, double *w) {
    const view *v = m->v;
    int count = major_x ? v->height : v->width, low = (int)floor(at), nearest = (int)floor(at + 0.5);
    if (line < 0 || line >= (major_x ? v->width : v->height) || nearest < 0 || nearest >= count)
        return false;
    size_t step = major_x ? (size_t)v->width : 1;
    const cell *c = m->cells + (major_x ? (size_t)line : (size_t)line * (size_t)v->width);
    *w = c[(size_t)nearest * step].w;
    if (*w > 0)
        *w = fmax(*w + plane * (at - nearest), 1e-30);
    if (low < 0 || low + 1 >= count)
        return true;
    const cell *a = c + (size_t)low * step, *b = a + step;
    /* One surface: either tangent plane meets the other pixel within its footprint, dz = z / f, which is w / f in w. */
    double tolerance = fmin(a->w, b->w) / (double)v->focal_px;
    double miss_a = fabs(a->w + (major_x ? a->gy : a->gx) - b->w),
           miss_b = fabs(b->w - (major_x ? b->gy : b->gx) - a->w);
    if (fmin(miss_a, miss_b) < tolerance)
        *w = a->w + (b->w - a->w) * (at - low);
    return true;
}

typedef struct receiver {
    int x, y;
    vec3 p, n, eye; /* eye: unit vector to the eye */
    const cell *cell;
    double p2, cos2_reach;
} receiver;

static bool occluded(const march *m, const receiver *o, vec3 ray) {
    const view *v = m->v;
    double f = (double)v->focal_px, radius = (double)v->radius, falloff = (double)v->falloff;
    /* d(x / z) along the ray is proportional to (ray.x z - P.x ray.z) / z^2, and dw to -ray.z / z^2. */
    double ux = f * (ray.x * o->p.z - o->p.x * ray.z), uy = f * (ray.y * o->p.z - o->p.y * ray.z);
    bool major_x = fabs(ux) >= fabs(uy);
    double major = major_x ? ux : uy, minor = major_x ? uy : ux;
    if (!(fabs(major) > 0))
        return false; /* straight at the eye */
    double slope = -ray.z / fabs(major), drift = minor / fabs(major);
    int sign = major > 0 ? 1 : -1;
    double tangent_cos = 0, ray_cos = v3_dot(ray, o->eye);
    if (falloff > 0) {
        vec3 out = v3_normalize(v3_mad(ray, o->eye, -ray_cos));
        double no = v3_dot(o->n, out), nv = v3_dot(o->n, o->eye);
        tangent_cos = -no / sqrt(no * no + nv * nv);
    }
    for (int k = 1;; ++k) {
        int line = (major_x ? o->x : o->y) + sign * k;
        double at = (major_x ? o->y : o->x) + drift * k, w;
        if (!crossing_height(m, major_x, line, at, major_x ? o->cell->gy : o->cell->gx, &w))
            return false;
        vec3 r =
            v3(((major_x ? line : at) + 0.5 - (double)v->cx) / f, ((major_x ? at : line) + 0.5 - (double)v->cy) / f, 1);
        /* Once the view ray misses the sphere of the radius, all further ones do. */
        double pr = v3_dot(o->p, r), r2 = v3_dot(r, r);
        if (pr <= 0 || pr * pr < o->cos2_reach * o->p2 * r2)
            return false;
        if (!(w > 0))
            continue;
        if (falloff <= 0 && w <= o->cell->w + slope * k)
            continue;
        vec3 to = v3_sub(v3_scale(r, 1 / w), o->p);
        double d2 = v3_dot(to, to);
        if (d2 > radius * radius)
            continue;
        if (falloff <= 0)
            return true;
        double d = sqrt(d2), weight = fmin(1, (radius - d) / (falloff * radius));
        double sample_cos = v3_dot(to, o->eye) / d;
        if (ray_cos < tangent_cos + (sample_cos - tangent_cos) * weight)
            return true;
    }
}

void march_visibility_rows(const march *m, int strata, float *visibility, int row_begin, int row_end) {
    const view *v = m->v;
    double f = (double)v->focal_px, radius = (double)v->radius;
    int total = strata * strata;
    for (int y = row_begin; y < row_end; ++y)
        for (int x = 0; x < v->width; ++x) {
            size_t i = (size_t)y * (size_t)v->width + (size_t)x;
            visibility[i] = 1;
            if (!(m->cells[i].w > 0))
                continue;
            double z = (double)v->z[i];
            const float *normal = v->normals + 3 * i;
            receiver o;
            o.x = x, o.y = y;
            o.p = v3((x + 0.5 - (double)v->cx) / f * z, (y + 0.5 - (double)v->cy) / f * z, z);
            o.n = v3_normalize(v3((double)normal[0], (double)normal[1], (double)normal[2]));
            o.cell = &m->cells[i];
            o.p2 = v3_dot(o.p, o.p);
            o.eye = v3_scale(o.p, -1 / sqrt(o.p2));
            o.cos2_reach = fmax(0, 1 - radius * radius / o.p2);
            vec3 a, b;
            v3_frame(o.n, &a, &b);
            int hidden = 0;
            for (int s = 0; s < total; ++s) {
                double jitter[2];
                sample_jitter((uint32_t)i, (uint32_t)s + 0x51ed2701u, jitter);
                vec3 ray =
                    cosine_direction(o.n, a, b, (s % strata + jitter[0]) / strata, (s / strata + jitter[1]) / strata);
                hidden += occluded(m, &o, ray);
            }
            visibility[i] = (float)(1 - (double)hidden / total);
        }
}
