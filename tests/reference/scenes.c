/* Analytic scenes, ray traced at pixel centres in double precision. */
#include "reference.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static ref_image image_new(int width, int height) {
    ref_image image = {0};
    const size_t count = (size_t)width * (size_t)height;
    image.width = width;
    image.height = height;
    image.z = malloc(count * sizeof *image.z);
    image.normals = calloc(count * 3, sizeof *image.normals);
    if (!image.z || !image.normals)
        abort();
    for (size_t i = 0; i < count; i++)
        image.z[i] = INFINITY;
    return image;
}

ref_image ref_image_perspective(int width, int height, double fov_y_degrees) {
    ref_image image = image_new(width, height);
    image.fx = image.fy = 0.5 * height / tan(fov_y_degrees * REF_PI / 360.0);
    image.cx = 0.5 * width;
    image.cy = 0.5 * height;
    return image;
}

ref_image ref_image_orthographic(int width, int height, double pixel_size) {
    ref_image image = image_new(width, height);
    image.orthographic = 1;
    image.sx = image.sy = pixel_size;
    return image;
}

void ref_image_free(ref_image *image) {
    free(image->z);
    free(image->normals);
    image->z = image->normals = NULL;
}

/* Keeps the nearest of the candidates. */
static void offer(ref_hit *best, double distance, const double normal[3]) {
    if (!(distance > 1e-9) || !(distance < best->distance))
        return;
    best->distance = distance;
    for (int i = 0; i < 3; i++)
        best->normal[i] = normal[i];
}

static void trace_plane(const ref_shape *s, const double o[3], const double d[3], ref_hit *best) {
    const double to[3] = {s->center[0] - o[0], s->center[1] - o[1], s->center[2] - o[2]};
    offer(best, dot(s->axis, to) / dot(s->axis, d), s->axis);
}

static void trace_sphere(const ref_shape *s, const double o[3], const double d[3], ref_hit *best) {
    const double to[3] = {o[0] - s->center[0], o[1] - s->center[1], o[2] - s->center[2]};
    const double a = dot(d, d), b = dot(d, to), c = dot(to, to) - s->radius * s->radius;
    const double root = b * b - a * c;
    if (root < 0.0)
        return;
    for (int side = -1; side <= 1; side += 2) {
        const double t = (-b + side * sqrt(root)) / a;
        const double normal[3] = {(to[0] + t * d[0]) / s->radius, (to[1] + t * d[1]) / s->radius,
                                  (to[2] + t * d[2]) / s->radius};
        offer(best, t, normal);
    }
}

static void trace_box(const ref_shape *s, const double o[3], const double d[3], ref_hit *best) {
    for (int axis = 0; axis < 3; axis++) {
        for (int side = -1; side <= 1; side += 2) {
            const double t = (s->center[axis] + side * s->axis[axis] - o[axis]) / d[axis];
            const int u = (axis + 1) % 3, v = (axis + 2) % 3;
            double normal[3] = {0};
            normal[axis] = side;
            if (fabs(o[u] + t * d[u] - s->center[u]) <= s->axis[u] &&
                fabs(o[v] + t * d[v] - s->center[v]) <= s->axis[v])
                offer(best, t, normal);
        }
    }
}

static void trace_cylinder(const ref_shape *s, const double o[3], const double d[3], ref_hit *best) {
    const double to[3] = {o[0] - s->center[0], o[1] - s->center[1], o[2] - s->center[2]};
    const double da = dot(d, s->axis), ta = dot(to, s->axis);
    double dp[3], tp[3];
    for (int i = 0; i < 3; i++) {
        dp[i] = d[i] - da * s->axis[i];
        tp[i] = to[i] - ta * s->axis[i];
    }
    const double a = dot(dp, dp), b = dot(dp, tp), c = dot(tp, tp) - s->radius * s->radius;
    const double root = b * b - a * c;
    if (root < 0.0)
        return;
    for (int side = -1; side <= 1; side += 2) {
        const double t = (-b + side * sqrt(root)) / a;
        const double normal[3] = {(tp[0] + t * dp[0]) / s->radius, (tp[1] + t * dp[1]) / s->radius,
                                  (tp[2] + t * dp[2]) / s->radius};
        if (fabs(ta + t * da) <= s->length)
            offer(best, t, normal);
    }
}

/* The inside of a cone that opens along its axis: a pit. */
static void trace_cone(const ref_shape *s, const double o[3], const double d[3], ref_hit *best) {
    const double to[3] = {o[0] - s->center[0], o[1] - s->center[1], o[2] - s->center[2]};
    const double slope2 = s->radius * s->radius;
    const double da = dot(d, s->axis), ta = dot(to, s->axis);
    /* height^2 = slope^2 (distance from the apex squared - height^2) */
    const double a = (1.0 + slope2) * da * da - slope2 * dot(d, d);
    const double b = (1.0 + slope2) * da * ta - slope2 * dot(d, to);
    const double c = (1.0 + slope2) * ta * ta - slope2 * dot(to, to);
    const double root = b * b - a * c;
    if (root < 0.0)
        return;
    for (int side = -1; side <= 1; side += 2) {
        const double t = (-b + side * sqrt(root)) / a, height = ta + t * da;
        double normal[3];
        for (int i = 0; i < 3; i++)
            normal[i] = (1.0 + slope2) * height * s->axis[i] - slope2 * (to[i] + t * d[i]);
        if (height > 0.0)
            offer(best, t, normal);
    }
}

int ref_trace(const ref_shape *shapes, int count, const double origin[3], const double direction[3], ref_hit *hit) {
    hit->distance = DBL_MAX;
    for (int i = 0; i < count; i++) {
        switch (shapes[i].kind) {
        case REF_PLANE:
            trace_plane(&shapes[i], origin, direction, hit);
            break;
        case REF_SPHERE:
            trace_sphere(&shapes[i], origin, direction, hit);
            break;
        case REF_BOX:
            trace_box(&shapes[i], origin, direction, hit);
            break;
        case REF_CYLINDER:
            trace_cylinder(&shapes[i], origin, direction, hit);
            break;
        case REF_CONE:
            trace_cone(&shapes[i], origin, direction, hit);
            break;
        }
    }
    return hit->distance < DBL_MAX;
}

/* A view-space vector in the scene's space. */
static void to_scene(const ref_pose *pose, const double a[3], double scene[3]) {
    for (int i = 0; i < 3; i++)
        scene[i] = pose->right[i] * a[0] + pose->down[i] * a[1] + pose->forward[i] * a[2];
}

ref_pose ref_pose_look(const double eye[3], const double target[3], const double up[3]) {
    ref_pose pose;
    for (int i = 0; i < 3; i++) {
        pose.eye[i] = eye[i];
        pose.forward[i] = target[i] - eye[i];
    }
    const double forward_length = sqrt(dot(pose.forward, pose.forward));
    for (int i = 0; i < 3; i++)
        pose.forward[i] /= forward_length;
    const double *f = pose.forward;
    const double right[3] = {f[1] * up[2] - f[2] * up[1], f[2] * up[0] - f[0] * up[2], f[0] * up[1] - f[1] * up[0]};
    const double right_length = sqrt(dot(right, right));
    for (int i = 0; i < 3; i++)
        pose.right[i] = right[i] / right_length;
    const double *r = pose.right;
    const double down[3] = {f[1] * r[2] - f[2] * r[1], f[2] * r[0] - f[0] * r[2], f[0] * r[1] - f[1] * r[0]};
    for (int i = 0; i < 3; i++)
        pose.down[i] = down[i];
    return pose;
}

void ref_render(ref_image *image, const ref_pose *pose, const ref_shape *shapes, int count) {
    static const ref_pose identity = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    if (!pose)
        pose = &identity;
    for (int y = 0; y < image->height; y++) {
        for (int x = 0; x < image->width; x++) {
            const size_t at = (size_t)y * (size_t)image->width + (size_t)x;
            double start[3] = {0.0, 0.0, 0.0}, ray[3] = {0.0, 0.0, 1.0}, origin[3], direction[3];
            if (image->orthographic) {
                start[0] = (x + 0.5) * image->sx;
                start[1] = (y + 0.5) * image->sy;
            } else {
                ray[0] = (x + 0.5 - image->cx) / image->fx;
                ray[1] = (y + 0.5 - image->cy) / image->fy;
            }
            to_scene(pose, start, origin);
            to_scene(pose, ray, direction);
            for (int i = 0; i < 3; i++)
                origin[i] += pose->eye[i];
            ref_hit hit;
            image->z[at] = INFINITY;
            if (!ref_trace(shapes, count, origin, direction, &hit))
                continue;
            /* The ray's z is 1 in view space, so the distance is planar depth. */
            image->z[at] = (float)hit.distance;
            const double sign = dot(hit.normal, direction) < 0.0 ? 1.0 : -1.0;
            const double scale = sign / sqrt(dot(hit.normal, hit.normal));
            image->normals[3 * at] = (float)(scale * dot(hit.normal, pose->right));
            image->normals[3 * at + 1] = (float)(scale * dot(hit.normal, pose->down));
            image->normals[3 * at + 2] = (float)(scale * dot(hit.normal, pose->forward));
        }
    }
}

int ref_cluttered_scene(ref_shape *shapes, int capacity) {
    static const ref_shape scene[] = {
        {REF_PLANE, {0.0, 1.2, 0.0}, {0.05, -1.0, -0.15}, 0.0, 0.0}, /* floor */
        {REF_PLANE, {0.0, 0.0, 6.0}, {0.2, 0.0, -1.0}, 0.0, 0.0},    /* back wall */
        {REF_PLANE, {-2.6, 0.0, 0.0}, {1.0, 0.0, -0.1}, 0.0, 0.0},   /* left wall */
        {REF_SPHERE, {0.1, 0.75, 3.6}, {0.0}, 0.55, 0.0},
        {REF_SPHERE, {0.9, 1.2, 3.1}, {0.0}, 0.32, 0.0},
        {REF_SPHERE, {-0.9, 0.2, 4.6}, {0.0}, 0.7, 0.0},
        {REF_BOX, {1.5, 0.8, 4.4}, {0.45, 0.7, 0.4}, 0.0, 0.0},
        {REF_BOX, {-1.5, 1.3, 3.9}, {0.4, 0.35, 0.5}, 0.0, 0.0},
        {REF_BOX, {0.5, -0.9, 5.4}, {0.9, 0.05, 0.5}, 0.0, 0.0},                   /* shelf */
        {REF_CYLINDER, {-0.35, 0.5, 2.9}, {0.1961161, 0.9805807, 0.0}, 0.02, 1.0}, /* rods */
        {REF_CYLINDER, {-0.55, 0.5, 3.0}, {0.0, 1.0, 0.0}, 0.03, 1.0},
        {REF_CYLINDER, {0.6, -0.3, 4.2}, {0.8, 0.6, 0.0}, 0.05, 0.9},
    };
    const int count = (int)(sizeof scene / sizeof scene[0]);
    if (count > capacity)
        return 0;
    for (int i = 0; i < count; i++)
        shapes[i] = scene[i];
    return count;
}
