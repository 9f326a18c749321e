/* Occluders with a front and a back: each sample hides an arc of its slice, the visible part is the complement of their
 * union. The arcs are kept as they are, sorted and merged, in double precision. */
#include "reference.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>

typedef struct arc {
    double from, to; /* angles from the view vector towards this side */
} arc;

typedef struct arc_list {
    arc *arcs;
    size_t count, capacity;
} arc_list;

/* What one layer shows at one sample of the march. */
typedef struct sample {
    int present, x, y; /* pixel */
    double z;          /* of its front */
    int hides;
    arc hidden;
} sample;

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double length(const double a[3]) {
    return sqrt(dot(a, a));
}

static void add_arc(arc_list *list, double from, double to) {
    if (list->count == list->capacity) {
        list->capacity = list->capacity ? 2 * list->capacity : 256;
        list->arcs = realloc(list->arcs, list->capacity * sizeof *list->arcs);
        if (!list->arcs)
            abort();
    }
    list->arcs[list->count++] = (arc){from, to};
}

static int compare_arcs(const void *a, const void *b) {
    const double p = ((const arc *)a)->from, q = ((const arc *)b)->from;
    return (p > q) - (p < q);
}

static int is_depth(const ref_image *image, double z) {
    return isfinite(z) && (image->orthographic || z > 0.0);
}

/* The pixel that holds a position, with the border's rule; 0 outside an image that ends there. */
static int pixel_at(const ref_image *image, ref_border border, double u, double v, int *x, int *y) {
    int i = (int)floor(u), j = (int)floor(v);
    const int w = image->width, h = image->height;
    if (i < 0 || j < 0 || i >= w || j >= h) {
        if (border == REF_BORDER_OPEN)
            return 0;
        if (border == REF_BORDER_WRAP) {
            i = (i % w + w) % w;
            j = (j % h + h) % h;
        } else {
            i = i < 0 ? 0 : i >= w ? w - 1 : i;
            j = j < 0 ? 0 : j >= h ? h - 1 : j;
        }
    }
    *x = i, *y = j;
    return 1;
}

static void ray_at(const ref_image *image, double u, double v, double z, double position[3]) {
    position[0] = image->orthographic ? u * image->sx : z * (u - image->cx) / image->fx;
    position[1] = image->orthographic ? v * image->sy : z * (v - image->cy) / image->fy;
    position[2] = z;
}

/* Whether the depth that pixel a's tangent plane has at pixel b is b's, within a footprint of the image's pixels. */
static int plane_leads_to(const ref_image *image, const sample *a, const sample *b) {
    const float *n = image->normals + 3 * ((size_t)a->y * (size_t)image->width + (size_t)a->x);
    const double normal[3] = {(double)n[0], (double)n[1], (double)n[2]};
    double p[3], q[3];
    ray_at(image, a->x + 0.5, a->y + 0.5, a->z, p);
    ray_at(image, b->x + 0.5, b->y + 0.5, b->z, q);
    const double footprint = image->orthographic ? image->sx : 0.5 * (a->z + b->z) / image->fx;
    return fabs(dot(normal, q) - dot(normal, p)) <= footprint;
}

static int one_surface(const ref_image *image, const ref_slabs *slabs, const sample *a, const sample *b, int planes) {
    if (slabs->surface_px < 0.0)
        return 0;
    if (a->x == b->x && a->y == b->y)
        return 1;
    const double footprint = image->orthographic ? image->sx : fmin(a->z, b->z) / image->fx;
    if (fabs(a->z - b->z) <= slabs->surface_px * footprint)
        return 1;
    return planes && plane_leads_to(image, a, b) && plane_leads_to(image, b, a);
}

/* Angle from the view vector of the direction to a point in the slice's plane. */
static double angle_to(const ref_slice *slice, double sign, const double to[3]) {
    return atan2(sign * dot(to, slice->o), dot(to, slice->view));
}

/* The arc that the slab from `front` to depth `back_z` behind it hides. */
static int hidden_arc(const ref_image *image, const ref_settings *settings, const ref_slabs *slabs,
                      const double center[3], const ref_slice *slice, double sign, double limit, const double front[3],
                      double back_z, arc *out) {
    double a[3], b[3], along[3];
    const int endless = !isfinite(back_z);
    for (int i = 0; i < 3; i++) {
        a[i] = front[i] - center[i];
        along[i] = image->orthographic ? (i == 2) : front[i] / front[2]; /* of the view ray, 1 deep */
        b[i] = endless ? along[i] : a[i] + along[i] * (back_z - front[2]);
    }
    double nearest = length(a);
    if (nearest < 1e-9 * length(center)) /* the pixel itself */
        return 0;
    if (endless || slabs->whole) {
        if (nearest > settings->radius)
            return 0;
    } else {
        /* |a + s along| <= radius for s between 0 and the depth */
        const double depth = back_z - front[2], aa = dot(along, along), half = dot(a, along) / aa;
        const double root = half * half - (dot(a, a) - settings->radius * settings->radius) / aa;
        if (root < 0.0)
            return 0;
        const double enter = fmax(0.0, -half - sqrt(root)), leave = fmin(depth, -half + sqrt(root));
        if (leave < enter)
            return 0;
        const double closest = fmin(leave, fmax(enter, -half));
        double c[3];
        for (int i = 0; i < 3; i++) {
            c[i] = a[i] + closest * along[i];
            b[i] = a[i] + leave * along[i];
            a[i] += enter * along[i];
        }
        nearest = length(c);
    }
    out->from = angle_to(slice, sign, a);
    out->to = endless ? REF_PI : angle_to(slice, sign, b);
    double weight = 1.0;
    if (settings->falloff > 0.0)
        weight = fmin(1.0, (settings->radius - nearest) / (settings->falloff * settings->radius));
    if (weight < 1.0) {
        /* towards its lower end, at most the tangent plane: for endless ones that is the height field's falloff */
        const double low = fmin(out->to, limit), cos_low = cos(low);
        out->from = acos(fmax(-1.0, fmin(1.0, cos_low + weight * (cos(out->from) - cos_low))));
    }
    return out->to >= out->from;
}

/* Where layer `k` is entered at a point of the march, and left. */
static int slab_at(const ref_image *image, const ref_settings *settings, const ref_slabs *slabs, int k, double u,
                   double v, double du, double dv, sample *s, double front[3], double *back_z) {
    const ref_layer *layer = slabs->layers ? &slabs->layers[k] : NULL;
    if (!pixel_at(image, settings->border, u, v, &s->x, &s->y))
        return 0;
    const size_t at = (size_t)s->y * (size_t)image->width + (size_t)s->x;
    s->z = (double)(layer && layer->front ? layer->front : image->z)[at];
    if (!is_depth(image, s->z))
        return 0;
    if (layer && layer->front) {
        /* known at its centre only: the point of the line beside it */
        const double along = (floor(u) + 0.5 - u) * du + (floor(v) + 0.5 - v) * dv;
        ray_at(image, u + along * du, v + along * dv, s->z, front);
    } else if (!ref_surface_at(image, settings->border, u, v, du, dv, front)) {
        return 0;
    }
    if (layer && layer->back) {
        const double back = (double)layer->back[at];
        *back_z = is_depth(image, back) ? fmax(back, front[2]) : front[2];
    } else {
        const double t = slabs->thickness_map ? (double)slabs->thickness_map[at] : slabs->thickness;
        *back_z = front[2] + (image->orthographic ? t : t * front[2] / length(front));
    }
    return 1;
}

enum { MOST_LAYERS = 16 };

static void march(const ref_image *image, const ref_settings *settings, const ref_slabs *slabs, const double center[3],
                  int x, int y, const ref_slice *slice, double sign, double limit, arc_list *list) {
    const int layers = slabs->layers ? slabs->layer_count : 1;
    const double du = sign * slice->du, dv = sign * slice->dv;
    sample last[MOST_LAYERS], now[MOST_LAYERS];
    for (int k = 0; k < layers && k < MOST_LAYERS; k++)
        last[k].present = 0;
    /* The surface that begins at the pixel begins in its tangent plane. */
    last[0] = (sample){1, x, y, center[2], 1, {limit, limit}};
    for (int i = 1;; i++) {
        const double t = i * settings->step_px, u = x + 0.5 + t * du, v = y + 0.5 + t * dv;
        if (ref_march_ends(image, settings, center, u, v, t * du, t * dv))
            break;
        for (int k = 0; k < layers && k < MOST_LAYERS; k++) {
            double front[3], back_z;
            sample *s = &now[k];
            s->present = slab_at(image, settings, slabs, k, u, v, du, dv, s, front, &back_z);
            s->hides =
                s->present && hidden_arc(image, settings, slabs, center, slice, sign, limit, front, back_z, &s->hidden);
            if (!s->hides)
                continue;
            /* Nothing between two samples of one surface, whichever layers it is in, is open. */
            arc all = s->hidden;
            for (int j = 0; j < layers && j < MOST_LAYERS; j++) {
                if (last[j].present && last[j].hides && one_surface(image, slabs, &last[j], s, j == 0 && k == 0)) {
                    all.from = fmin(all.from, last[j].hidden.from);
                    all.to = fmax(all.to, last[j].hidden.to);
                }
            }
            add_arc(list, all.from, all.to);
        }
        for (int k = 0; k < layers && k < MOST_LAYERS; k++)
            last[k] = now[k];
    }
}

/* Adds the harmonics over the visible directions from a to b, by the midpoint rule. */
static void add_harmonics(const ref_slice *slice, double sign, double a, double b, double sh[9]) {
    enum { POINTS = 24 };
    for (int j = 0; j < POINTS; j++) {
        const double theta = a + (b - a) * (j + 0.5) / POINTS;
        const double weight = slice->azimuth * slice->projected * cos(theta - sign * slice->n) * sin(theta);
        long double d[3];
        for (int i = 0; i < 3; i++)
            d[i] = (long double)(sign * sin(theta) * slice->o[i] + cos(theta) * slice->view[i]);
        for (int i = 0; i < 9; i++)
            sh[i] += weight * (b - a) / POINTS * (double)ref_sh(i, d);
    }
}

static double arcs_at(const ref_image *image, const ref_settings *settings, const ref_slabs *slabs, int x, int y,
                      double bent[3], double sh[9]) {
    const size_t at = (size_t)y * (size_t)image->width + (size_t)x;
    const double z = (double)image->z[at];
    double sum[3] = {0.0, 0.0, 0.0}, visible = 0.0, total = 0.0;
    if (!is_depth(image, z))
        return 1.0;
    double center[3], normal[3];
    ray_at(image, x + 0.5, y + 0.5, z, center);
    for (size_t i = 0; i < 3; i++)
        normal[i] = (double)image->normals[3 * at + i];

    arc_list list = {NULL, 0, 0};
    for (int k = 0; k < settings->slices; k++) {
        const ref_slice slice = ref_slice_at(image, settings, center, normal, k);
        double open = 0.0, to = 0.0, tv = 0.0;
        for (int side = 0; side < 2; side++) {
            /* Angles from the view vector towards this side; mirrored, the normal lies at sign n. */
            const double sign = side ? 1.0 : -1.0, n = sign * slice.n, limit = n + 0.5 * REF_PI;
            list.count = 0;
            march(image, settings, slabs, center, x, y, &slice, sign, limit, &list);
            if (list.count)
                qsort(list.arcs, list.count, sizeof *list.arcs, compare_arcs);
            double seen = 0.0; /* everything up to here is accounted for */
            for (size_t i = 0; i <= list.count && seen < limit; i++) {
                const double from = i < list.count ? fmin(list.arcs[i].from, limit) : limit;
                if (from > seen) {
                    open += ref_arc_integral(from, n) - ref_arc_integral(seen, n);
                    to += sign * (ref_arc_integral_o(from, n) - ref_arc_integral_o(seen, n));
                    tv += ref_arc_integral_v(from, n) - ref_arc_integral_v(seen, n);
                    if (sh)
                        add_harmonics(&slice, sign, seen, from, sh);
                }
                if (i < list.count)
                    seen = fmax(seen, list.arcs[i].to);
            }
        }
        visible += slice.azimuth * slice.projected * open;
        total += slice.azimuth;
        for (int i = 0; i < 3; i++)
            sum[i] += slice.azimuth * slice.projected * (to * slice.o[i] + tv * slice.view[i]);
    }
    free(list.arcs);
    if (bent) {
        const double size = length(sum), unit = length(normal);
        for (int i = 0; i < 3; i++)
            bent[i] = size > 0.0 ? sum[i] / size : normal[i] / unit;
    }
    for (int i = 0; sh && i < 9; i++)
        sh[i] /= total;
    return visible / total;
}

double ref_arcs(const ref_image *image, const ref_settings *settings, const ref_slabs *slabs, int x, int y,
                double bent[3]) {
    return arcs_at(image, settings, slabs, x, y, bent, NULL);
}

void ref_arcs_sh(const ref_image *image, const ref_settings *settings, const ref_slabs *slabs, int x, int y,
                 double sh[9]) {
    for (int i = 0; i < 9; i++)
        sh[i] = 0.0;
    arcs_at(image, settings, slabs, x, y, NULL, sh);
}
