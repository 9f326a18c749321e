/* GTAO, the pseudo-code of [J19] transcribed line by line as a shader would run it: points reconstructed at every
 * sample, no angular Jacobian, divided by the number of slices; noise and the 4 x 4 bilateral filter of [J16].
 * `directions` counts the slices, `steps` the samples on each side, which lie at squared distances as the library's do
 * ([J19] leaves the spacing open), so that the presets of the same name differ in the estimator and in speed only. */
#include "rivals.h"

static void run(const view *v, const rival_preset *p, float *scratch, float *raw) {
    const float pi = 3.14159265f;
    (void)scratch;
    for (int y = 0; y < v->height; ++y)
        for (int x = 0; x < v->width; ++x) {
            size_t i = rival_index(v, x, y);
            raw[i] = 1;
            if (!(v->z[i] < VIEW_SKY))
                continue;
            v3f point = rival_point(v, x, y, v->z[i]), n = rival_normal(v, i),
                eye = v3f_scale(v3f_normalize(point), -1);
            float scaling = v->radius * v->focal_px / v->z[i], visibility = 0;
            float direction = (1.0f / 16) * (float)((((x + y) & 3) << 2) + (x & 3)),
                  offset = 0.25f * (float)((y - x) & 3);
            for (int slice = 0; slice < p->directions; ++slice) {
                float phi = pi / (float)p->directions * ((float)slice + direction), c = cosf(phi), s = sinf(phi);
                v3f d = {c, s, 0}, ortho = v3f_mad(d, eye, -v3f_dot(d, eye)), axis = v3f_normalize(v3f_cross(d, eye));
                v3f projected = v3f_mad(n, axis, -v3f_dot(n, axis));
                float length = sqrtf(v3f_dot(projected, projected));
                float cos_n = length > 0 ? clampf(v3f_dot(projected, eye) / length, -1, 1) : 1;
                float angle = rival_acos(cos_n) * (v3f_dot(ortho, projected) < 0 ? -1.0f : 1.0f), sin_n = sinf(angle);
                for (int side = 0; side < 2; ++side) {
                    float horizon_cos = -1, sign = side ? 1.0f : -1.0f;
                    /* the falloff lerps towards the tangent plane's horizon */
                    float low_cos = cosf(angle + sign * 0.5f * pi);
                    for (int j = 0; j < p->steps; ++j) {
                        float t = ((float)j + offset) / (float)p->steps, at = fmaxf(1, t * t * scaling) * sign;
                        v3f delta = v3f_sub(rival_fetch(v, (float)x + 0.5f + c * at, (float)y + 0.5f + s * at), point);
                        float distance = sqrtf(v3f_dot(delta, delta));
                        if (!(distance > 0) || distance > v->radius)
                            continue;
                        float cosine = v3f_dot(delta, eye) / distance;
                        if (v->falloff > 0) {
                            float weight = clampf((v->radius - distance) / (v->falloff * v->radius), 0, 1);
                            cosine = low_cos + (cosine - low_cos) * weight;
                        }
                        horizon_cos = fmaxf(horizon_cos, cosine);
                    }
                    float h =
                        angle + clampf(sign * rival_acos(clampf(horizon_cos, -1, 1)) - angle, -0.5f * pi, 0.5f * pi);
                    visibility += length * (cos_n + 2 * h * sin_n - cosf(2 * h - angle)) / 4;
                }
            }
            raw[i] = visibility / (float)p->directions;
        }
}

/* [J16]: the 4 x 4 pixels that hold all directions, thresholded by depth (a linear ramp to 10 %) against the slope. */
static void denoise(const view *v, const rival_preset *p, float *scratch, float *raw) {
    (void)p;
    size_t count = view_pixels(v);
    for (size_t i = 0; i < count; ++i)
        scratch[i] = raw[i];
    for (int y = 0; y < v->height; ++y)
        for (int x = 0; x < v->width; ++x) {
            size_t i = rival_index(v, x, y);
            float z = v->z[i], sum = 0, weights = 0;
            if (!(z < VIEW_SKY))
                continue;
            v3f n = rival_normal(v, i), r = v3f_scale(rival_point(v, x, y, z), 1 / z);
            float nr = v3f_dot(n, r), scale = -z / (v->focal_px * nr), limit = 0.1f * z;
            for (int dy = -2; dy < 2; ++dy)
                for (int dx = -2; dx < 2; ++dx) {
                    int qx = clampi(x + dx, 0, v->width - 1), qy = clampi(y + dy, 0, v->height - 1);
                    size_t j = rival_index(v, qx, qy);
                    float expected = z + scale * (n.x * (float)(qx - x) + n.y * (float)(qy - y));
                    float weight = fmaxf(0, 1 - fabsf(v->z[j] - expected) / limit);
                    sum += scratch[j] * weight;
                    weights += weight;
                }
            raw[i] = sum / weights;
        }
}

const rival rival_gtao_memo = {"gtao-memo",
                               "GTAO, the memo's pseudo-code",
                               "[J19], [J16]",
                               run,
                               denoise,
                               6,
                               {{"1x4", 1, 4, 8, 1, {0, 1, 1}},
                                {"2x6", 2, 6, 24, 1, {0, 1, 1}},
                                {"3x8", 3, 8, 48, 1, {0, 1, 1}},
                                {"1x4 raw", 1, 4, 8, 0, {0, 1, 1}},
                                {"3x8 raw", 3, 8, 48, 0, {0, 1, 1}},
                                {"8x16 raw", 8, 16, 256, 0, {0, 1, 1}}}};
