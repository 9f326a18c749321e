/* vec.h - three-component vectors in double precision. */
#ifndef EXAMPLES_VEC_H
#define EXAMPLES_VEC_H

#include <math.h>

#define V3_PI 3.14159265358979323846

typedef struct vec3 {
    double x, y, z;
} vec3;

static inline vec3 v3(double x, double y, double z) {
    return (vec3){x, y, z};
}
static inline vec3 v3_add(vec3 a, vec3 b) {
    return v3(a.x + b.x, a.y + b.y, a.z + b.z);
}
static inline vec3 v3_sub(vec3 a, vec3 b) {
    return v3(a.x - b.x, a.y - b.y, a.z - b.z);
}
static inline vec3 v3_scale(vec3 a, double s) {
    return v3(a.x * s, a.y * s, a.z * s);
}
static inline vec3 v3_mad(vec3 a, vec3 b, double s) {
    return v3(a.x + b.x * s, a.y + b.y * s, a.z + b.z * s);
}
static inline double v3_dot(vec3 a, vec3 b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
static inline vec3 v3_cross(vec3 a, vec3 b) {
    return v3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
static inline double v3_length(vec3 a) {
    return sqrt(v3_dot(a, a));
}
static inline vec3 v3_normalize(vec3 a) {
    return v3_scale(a, 1.0 / v3_length(a));
}

/* Two unit vectors perpendicular to the unit vector n and to each other. */
static inline void v3_frame(vec3 n, vec3 *a, vec3 *b) {
    vec3 up = fabs(n.x) < 0.6 ? v3(1, 0, 0) : v3(0, 1, 0);
    *a = v3_normalize(v3_cross(up, n));
    *b = v3_cross(n, *a);
}

#endif
