/* [J19] Algorithm 1 transcribed line by line: per pixel, slice, side and sample, positions reconstructed, no tables.
 * Deviations: the slice's axis is normalised, as it has to be off the optical axis; samples lie at whole pixels; and
 * the conservative attenuation of [J16] fades a sample towards the edge of the hemisphere. */
#include "reference.h"

#include <math.h>
#include <stddef.h>

static const float pi_f = 3.14159265f;

typedef struct vec3 {
    float x, y, z;
} vec3;

static vec3 add_scaled(vec3 a, vec3 b, float s) {
    const vec3 r = {a.x + b.x * s, a.y + b.y * s, a.z + b.z * s};
    return r;
}

static float dot(vec3 a, vec3 b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static vec3 cross(vec3 a, vec3 b) {
    const vec3 r = {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    return r;
}

static float length(vec3 a) {
    return sqrtf(dot(a, a));
}

static vec3 normalize(vec3 a) {
    const float inverse = 1.0f / length(a);
    const vec3 r = {a.x * inverse, a.y * inverse, a.z * inverse};
    return r;
}

static float clamp(float x, float low, float high) {
    return x < low ? low : x > high ? high : x;
}

/* Nearest whole number, halves away from zero, also halves that rounding has made a little less. */
static int nearest(float a) {
    return (int)(a + (a < 0.0f ? -0.500001f : 0.500001f));
}

void memo_noise(unsigned frame, float direction[16], float offset[16]) {
    static const float rotations[6] = {60.0f, 300.0f, 180.0f, 240.0f, 120.0f, 0.0f};
    static const float offsets[4] = {0.0f, 0.5f, 0.25f, 0.75f};
    for (int y = 0; y < 4; y++) {
        for (int x = 0; x < 4; x++) {
            const float spatial = (1.0f / 16.0f) * (float)((((x + y) & 3) << 2) + (x & 3));
            float temporal = rotations[frame % 6] / 360.0f;
            /* As printed, the six rotations give 48 directions twice. */
            if (frame % 6 >= 3)
                temporal += 1.0f / 96.0f;
            direction[4 * y + x] = spatial + temporal - floorf(spatial + temporal);
            offset[4 * y + x] = 0.25f * (float)((y - x) & 3) + 0.25f * offsets[frame / 6 % 4];
        }
    }
}

/* True if the pixel has a surface. */
static int position_at(int width, const float *z, float focal_px, float cx, float cy, int x, int y, vec3 *position) {
    const float depth = z[(ptrdiff_t)y * width + x];
    if (!(depth > 0.0f) || isinf(depth))
        return 0;
    position->x = depth * ((float)x + 0.5f - cx) / focal_px;
    position->y = depth * ((float)y + 0.5f - cy) / focal_px;
    position->z = depth;
    return 1;
}

void memo_gtao(int width, int height, const float *z, const float *normals, float focal_px, float cx, float cy,
               const memo_settings *settings, const float direction[16], const float offset[16], float *visibility) {
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            const ptrdiff_t at = (ptrdiff_t)y * width + x;
            const int tile = 4 * (y & 3) + (x & 3);
            vec3 cPosV;
            if (!position_at(width, z, focal_px, cx, cy, x, y, &cPosV)) {
                visibility[at] = 1.0f;
                continue;
            }
            const vec3 normalV = {normals[3 * at], normals[3 * at + 1], normals[3 * at + 2]};
            const vec3 eye = {-cPosV.x, -cPosV.y, -cPosV.z};
            const vec3 viewV = normalize(eye);

            /* The radius in pixels, radially, which is the longer way off axis; rounded up to a quarter of its octave. */
            int exponent;
            const float extent = settings->radius * length(cPosV) / (cPosV.z * cPosV.z);
            if (extent * focal_px < 1.0f) {
                visibility[at] = 1.0f;
                continue;
            }
            const float steps = floorf(8.0f * frexpf(extent, &exponent)) + 1.0f;
            const float radius_px = fminf(ldexpf(steps / 8.0f, exponent) * focal_px, (float)settings->max_radius_px);

            float sum = 0.0f;
            for (int slice = 0; slice < settings->slices; slice++) {
                const float phi = (pi_f / (float)settings->slices) * ((float)slice + direction[tile]);
                const float omega[2] = {cosf(phi), sinf(phi)};

                const vec3 directionV = {omega[0], omega[1], 0.0f};
                const vec3 orthoDirectionV = add_scaled(directionV, viewV, -dot(directionV, viewV));
                const vec3 axisV = normalize(cross(directionV, viewV));
                const vec3 projNormalV = add_scaled(normalV, axisV, -dot(normalV, axisV));
                const float projLength = length(projNormalV);

                const float sgnN = dot(orthoDirectionV, projNormalV) < 0.0f ? -1.0f : 1.0f;
                const float cosN = clamp(dot(projNormalV, viewV) / projLength, 0.0f, 1.0f);
                const float n = sgnN * acosf(cosN);
                const float sinN = sinf(n);

                for (int side = 0; side < 2; side++) {
                    const float sign = (float)(-1 + 2 * side);
                    const float cLimitCos = -sign * sinN; /* cos(n +- pi/2) */
                    float cHorizonCos = -1.0f;
                    for (int sample = 0; sample < settings->steps; sample++) {
                        const float s = ((float)sample + offset[tile]) / (float)settings->steps;
                        const float t = 1.0f + (radius_px - 1.0f) * s * s;
                        const int sx = x + (int)sign * nearest(t * omega[0]);
                        const int sy = y + (int)sign * nearest(t * omega[1]);
                        vec3 sPosV;
                        if (sx < 0 || sy < 0 || sx >= width || sy >= height)
                            continue;
                        if (!position_at(width, z, focal_px, cx, cy, sx, sy, &sPosV))
                            continue;
                        const vec3 delta = add_scaled(sPosV, cPosV, -1.0f);
                        const float distance = length(delta);
                        float sCos = dot(delta, viewV) / distance;
                        if (settings->falloff > 0.0f) {
                            const float weight = clamp(
                                (settings->radius - distance) / (settings->falloff * settings->radius), 0.0f, 1.0f);
                            sCos = cLimitCos + weight * (sCos - cLimitCos);
                        } else if (distance > settings->radius) {
                            continue;
                        }
                        cHorizonCos = fmaxf(cHorizonCos, sCos);
                    }
                    const float h = n + clamp(sign * acosf(cHorizonCos) - n, -0.5f * pi_f, 0.5f * pi_f);
                    sum += projLength * (cosN + 2.0f * h * sinN - cosf(2.0f * h - n)) / 4.0f;
                }
            }
            visibility[at] = sum / (float)settings->slices;
        }
    }
}
