#include "hullsweep.h"

#include <math.h>
#include <string.h>

typedef struct point {
    float x, y, z;
} point;

/* Rise from p to q by the distance in space. */
static float slope(const point *p, const point *q) {
    const float dx = q->x - p->x, dy = q->y - p->y, dz = q->z - p->z;
    return dz / sqrtf(dx * dx + dy * dy + dz * dz);
}

/* What the horizon q hides of one direction: the unit vector towards it, its cosine with up, and an angle of that. */
static float hidden(const point *p, const point *q) {
    point d = {q->x - p->x, q->y - p->y, q->z - p->z};
    const float scale = 1.0f / sqrtf(d.x * d.x + d.y * d.y + d.z * d.z);
    d.x *= scale, d.y *= scale, d.z *= scale;
    const float up = d.x * 0.0f + d.y * 0.0f + d.z * 1.0f;
    return (float)(atan((double)fmaxf(up, 0.0f)) * 0.63661977236758134);
}

void hull_sweep(const float *height, int width, int rows, float pixel_size, int directions, float *stack, float *out) {
    point *hull = (point *)(void *)stack;
    memset(out, 0, (size_t)width * (size_t)rows * sizeof *out);
    for (int k = 0; k < directions; k++) {
        const double angle = 2.0 * 3.14159265358979323846 * (k + 0.5) / directions;
        const double dx = cos(angle), dy = sin(angle), major = fmax(fabs(dx), fabs(dy));
        const float sx = (float)(dx / major), sy = (float)(dy / major);
        const int x_major = fabs(dx) >= fabs(dy), n_major = x_major ? width : rows, n_minor = x_major ? rows : width;
        const float step = x_major ? sy : sx;
        const int forward = (x_major ? sx : sy) > 0.0f, skew = (int)(fabsf(step) * (float)(n_major - 1)) + 1;
        /* Lines by where they cross the first column of the longer axis; half of them begin beside the map. */
        for (int line = -(step > 0.0f ? skew : 0); line < n_minor + (step > 0.0f ? 0 : skew); line++) {
            int count = 0;
            for (int i = 0; i < n_major; i++) {
                const float minor = (float)line + step * (float)i * (forward ? 1.0f : -1.0f) + 0.5f;
                const int m = (int)floorf(minor), a = forward ? i : n_major - 1 - i;
                const int x = x_major ? a : m, y = x_major ? m : a;
                float occlusion = 0.0f;
                if (m < 0 || m >= n_minor)
                    continue;
                const point p = {(float)x * pixel_size, (float)y * pixel_size, height[y * width + x]};
                while (count > 1 && slope(&p, &hull[count - 2]) >= slope(&p, &hull[count - 1]))
                    count--;
                if (count > 0)
                    occlusion = hidden(&p, &hull[count - 1]);
                hull[count++] = p;
                out[y * width + x] += 1.0f - occlusion;
            }
        }
    }
    for (int i = 0; i < width * rows; i++)
        out[i] /= (float)directions;
}
