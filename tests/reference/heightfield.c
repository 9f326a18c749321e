/* Brute force: march every slice of a pixel over the depth image in 3D, in double precision, and integrate the arcs
 * between the horizons in closed form. Slow on purpose; nothing here relies on heights, slopes or tables. */
#include "reference.h"

#include <math.h>
#include <stddef.h>

/* Two pixels show one surface when each lies this near to the other's tangent plane, in pixel footprints. */
static const double surface_tolerance = 1.0;
/* A tangent plane is not followed further than this towards or away from the viewer, in pixel footprints. */
static const double plane_limit = 4.0;
/* A march over a repeating or clamped image has no end of its own; this is in image diagonals. */
static const double march_limit = 4.0;

typedef struct texel {
    int present;
    int beyond;  /* outside an image that ends at its border: not present */
    int outside; /* repeats an edge pixel, so its tangent plane says nothing */
    double u, v; /* pixel coordinates of the centre */
    double position[3];
    double normal[3];
    double footprint; /* world size of a pixel at this depth */
} texel;

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double length(const double a[3]) {
    return sqrt(dot(a, a));
}

static void position_at(const ref_image *image, double u, double v, double z, double position[3]) {
    if (image->orthographic) {
        position[0] = u * image->sx;
        position[1] = v * image->sy;
    } else {
        position[0] = z * (u - image->cx) / image->fx;
        position[1] = z * (v - image->cy) / image->fy;
    }
    position[2] = z;
}

static int wrapped(int i, int count) {
    const int rest = i % count;
    return rest < 0 ? rest + count : rest;
}

static texel fetch(const ref_image *image, ref_border border, int x, int y) {
    texel p = {0};
    int from_x = x, from_y = y;
    if (x < 0 || y < 0 || x >= image->width || y >= image->height) {
        if (border == REF_BORDER_OPEN) {
            p.beyond = 1;
            return p;
        }
        if (border == REF_BORDER_WRAP) {
            from_x = wrapped(x, image->width);
            from_y = wrapped(y, image->height);
        } else {
            from_x = x < 0 ? 0 : x >= image->width ? image->width - 1 : x;
            from_y = y < 0 ? 0 : y >= image->height ? image->height - 1 : y;
            p.outside = 1;
        }
    }
    const size_t at = (size_t)from_y * (size_t)image->width + (size_t)from_x;
    const double z = (double)image->z[at];
    if (!isfinite(z) || (!image->orthographic && z <= 0.0))
        return p;
    p.present = 1;
    p.u = x + 0.5;
    p.v = y + 0.5;
    position_at(image, p.u, p.v, z, p.position);
    for (size_t i = 0; i < 3; i++)
        p.normal[i] = (double)image->normals[3 * at + i];
    p.footprint = image->orthographic ? image->sx : z / image->fx;
    return p;
}

static int same_surface(const texel *a, const texel *b) {
    const double step[3] = {b->position[0] - a->position[0], b->position[1] - a->position[1],
                            b->position[2] - a->position[2]};
    const double reach = surface_tolerance * 0.5 * (a->footprint + b->footprint);
    return fabs(dot(a->normal, step)) <= reach && fabs(dot(b->normal, step)) <= reach;
}

/* What is linear over a plane: 1/z in perspective, z otherwise; and back. */
static double planar(const ref_image *image, double z) {
    return image->orthographic ? z : 1.0 / z;
}

/* The same at (u, v), of the plane through a pixel with the pixel's normal; of the pixel itself where that leads off by
 * so many footprints that the normal is hardly that of the surface, as at silhouettes and in corners. */
static double plane_at(const ref_image *image, const texel *p, double u, double v, double limit_px) {
    const double z = p->position[2];
    double value, limit = limit_px * p->footprint;
    if (p->outside)
        return planar(image, z);
    if (image->orthographic) {
        const double du = (u - p->u) * image->sx, dv = (v - p->v) * image->sy;
        value = z - (p->normal[0] * du + p->normal[1] * dv) / p->normal[2];
    } else {
        const double ray[3] = {(u - image->cx) / image->fx, (v - image->cy) / image->fy, 1.0};
        value = dot(p->normal, ray) / dot(p->normal, p->position);
        limit /= z * z;
    }
    return fabs(value - planar(image, z)) <= limit ? value : planar(image, z);
}

/* The surface on the screen line through (u, v) along (du, dv). Where the pixels around belong to one surface: bilinear
 * between them, at (u, v). Otherwise the nearest pixel, which is known at its centre only: its tangent plane at the
 * point of the line beside that centre, so that no surface reaches further along the line than has been seen. */
int ref_surface_at(const ref_image *image, ref_border border, double u, double v, double du, double dv,
                   double position[3]) {
    const double left = floor(u - 0.5), top = floor(v - 0.5);
    const double a = u - 0.5 - left, b = v - 0.5 - top;
    const int x = (int)left, y = (int)top;
    const int near_x = x + (a >= 0.5), near_y = y + (b >= 0.5);
    const texel nearest = fetch(image, border, near_x, near_y);
    if (!nearest.present)
        return 0;
    double value = 0.0, limit_px = HUGE_VAL;
    int one_surface = 1;
    for (int j = 0; j < 2; j++) {
        for (int i = 0; i < 2; i++) {
            const double weight = (i ? a : 1.0 - a) * (j ? b : 1.0 - b);
            if (weight == 0.0)
                continue;
            const texel other = fetch(image, border, x + i, y + j);
            if (other.beyond) { /* a surface at the edge of the image goes on for the rest of its pixel */
                value += weight * plane_at(image, &nearest, x + i + 0.5, y + j + 0.5, HUGE_VAL);
                continue;
            }
            if (!other.present) {
                one_surface = 0;
            } else if (!same_surface(&nearest, &other)) {
                one_surface = 0;
                limit_px = plane_limit;
            } else {
                value += weight * planar(image, other.position[2]);
            }
        }
    }
    if (!one_surface) {
        const double along = (nearest.u - u) * du + (nearest.v - v) * dv;
        u += along * du;
        v += along * dv;
        value = plane_at(image, &nearest, u, v, limit_px);
    }
    if (!image->orthographic && value <= 0.0)
        return 0; /* past the plane's horizon */
    position_at(image, u, v, planar(image, value), position);
    return 1;
}

int ref_march_ends(const ref_image *image, const ref_settings *settings, const double center[3], double u, double v,
                   double along_u, double along_v) {
    const double distance = length(center), radius = settings->radius;
    if (settings->border == REF_BORDER_OPEN && (u < 0.0 || v < 0.0 || u >= image->width || v >= image->height))
        return 1;
    if (hypot(along_u, along_v) > march_limit * hypot(image->width, image->height))
        return 1;
    if (image->orthographic)
        return hypot(along_u * image->sx, along_v * image->sy) > radius;
    /* The sphere of the radius is seen from the eye within this angle of its centre. */
    const double cos_sphere = radius < distance ? sqrt(1.0 - radius * radius / (distance * distance)) : -1.0;
    const double ray[3] = {(u - image->cx) / image->fx, (v - image->cy) / image->fy, 1.0};
    return dot(ray, center) < cos_sphere * length(ray) * distance;
}

/* Largest cosine between the view vector and the samples along one side of a slice. */
static double march(const ref_image *image, const ref_settings *settings, const double center[3], const double view[3],
                    double u0, double v0, double du, double dv, double cos_limit) {
    const double distance = length(center);
    double best = cos_limit;
    for (int i = 1;; i++) {
        const double t = i * settings->step_px, u = u0 + t * du, v = v0 + t * dv;
        if (ref_march_ends(image, settings, center, u, v, t * du, t * dv))
            break;
        double position[3];
        if (!ref_surface_at(image, settings->border, u, v, du, dv, position))
            continue;
        const double to[3] = {position[0] - center[0], position[1] - center[1], position[2] - center[2]};
        const double reach = length(to);
        if (reach > settings->radius || reach < 1e-9 * distance) /* the pixel itself */
            continue;
        const double cosine = dot(to, view) / reach;
        double weight = 1.0;
        if (settings->falloff > 0.0)
            weight = (settings->radius - reach) / (settings->falloff * settings->radius);
        if (weight > 1.0)
            weight = 1.0;
        const double weighted = cos_limit + weight * (cosine - cos_limit);
        if (weighted > best)
            best = weighted;
    }
    return best;
}

double ref_arc_integral(double theta, double n) {
    return 0.5 * (cos(n) * sin(theta) * sin(theta) + sin(n) * (theta - sin(theta) * cos(theta)));
}

double ref_arc_integral_o(double theta, double n) {
    const double s = sin(theta), c = cos(theta);
    return cos(n) * s * s * s / 3.0 + sin(n) * (2.0 / 3.0 - c + c * c * c / 3.0);
}

double ref_arc_integral_v(double theta, double n) {
    const double s = sin(theta), c = cos(theta);
    return cos(n) * (1.0 - c * c * c) / 3.0 + sin(n) * s * s * s / 3.0;
}

ref_slice ref_slice_at(const ref_image *image, const ref_settings *settings, const double position[3],
                       const double normal[3], int k) {
    const double phi = settings->angles ? settings->angles[k] : REF_PI * (k + 0.5) / settings->slices;
    const double scale_x = image->orthographic ? image->sx : 1.0 / image->fx;
    const double scale_y = image->orthographic ? image->sy : 1.0 / image->fy;
    ref_slice slice = {cos(phi), sin(phi), {0.0, 0.0, -1.0}, {0.0, 0.0, 0.0}, 0.0, 0.0, 0.0};
    if (!image->orthographic) {
        for (int i = 0; i < 3; i++)
            slice.view[i] = -position[i] / length(position);
    }

    /* Perpendicular to the view vector: the screen direction, and how it turns with phi. */
    const double along[3] = {slice.du * scale_x, slice.dv * scale_y, 0.0};
    const double turn[3] = {-slice.dv * scale_x, slice.du * scale_y, 0.0};
    double turned[3];
    for (int i = 0; i < 3; i++) {
        slice.o[i] = along[i] - dot(along, slice.view) * slice.view[i];
        turned[i] = turn[i] - dot(turn, slice.view) * slice.view[i];
    }
    /* d(azimuth around v) / d(phi): the turn of o across itself, over its length. */
    const double cross[3] = {slice.o[1] * turned[2] - slice.o[2] * turned[1],
                             slice.o[2] * turned[0] - slice.o[0] * turned[2],
                             slice.o[0] * turned[1] - slice.o[1] * turned[0]};
    slice.azimuth = fabs(dot(cross, slice.view)) / dot(slice.o, slice.o);
    const double o_length = length(slice.o);
    for (int i = 0; i < 3; i++)
        slice.o[i] /= o_length;

    const double size = length(normal);
    const double along_o = dot(normal, slice.o) / size, along_v = dot(normal, slice.view) / size;
    slice.projected = hypot(along_o, along_v);
    slice.n = atan2(along_o, along_v);
    return slice;
}

double ref_heightfield(const ref_image *image, const ref_settings *settings, int x, int y, double bent[3]) {
    const texel here = fetch(image, REF_BORDER_OPEN, x, y);
    double sum[3] = {0.0, 0.0, 0.0}, visible = 0.0, total = 0.0;
    if (!here.present)
        return 1.0;

    for (int k = 0; k < settings->slices; k++) {
        const ref_slice slice = ref_slice_at(image, settings, here.position, here.normal, k);
        const double n = slice.n;

        /* Horizons, clamped to the hemisphere of the normal. */
        double h[2];
        for (int side = 0; side < 2; side++) {
            const double sign = side ? 1.0 : -1.0;
            const double cos_limit = cos(n + sign * 0.5 * REF_PI);
            const double cosine = march(image, settings, here.position, slice.view, x + 0.5, y + 0.5, sign * slice.du,
                                        sign * slice.dv, cos_limit);
            const double limited = fmax(-0.5 * REF_PI, fmin(0.5 * REF_PI, sign * acos(fmin(cosine, 1.0)) - n));
            h[side] = n + limited;
        }

        /* |sin(theta)| is -sin(theta) on side 0, and the range runs upwards there to 0. */
        double to = 0.0, tv = 0.0;
        for (int side = 0; side < 2; side++) {
            if (settings->uniform) {
                visible += slice.azimuth * 0.5 * (1.0 - cos(h[side]));
                to += 0.5 * (h[side] - sin(h[side]) * cos(h[side]));
                tv += 0.5 * sin(h[side]) * sin(h[side]);
            } else {
                visible += slice.azimuth * slice.projected * ref_arc_integral(h[side], n);
                to += slice.projected * ref_arc_integral_o(h[side], n);
                tv += slice.projected * ref_arc_integral_v(h[side], n);
            }
        }
        total += slice.azimuth;
        for (int i = 0; i < 3; i++)
            sum[i] += slice.azimuth * (to * slice.o[i] + tv * slice.view[i]);
    }
    if (bent) {
        const double size = length(sum);
        for (int i = 0; i < 3; i++)
            bent[i] = size > 0.0 ? sum[i] / size : here.normal[i] / length(here.normal);
    }
    return visible / total;
}
