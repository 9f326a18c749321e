/* HBAO [B08]: sin h - sin t over `directions` of `steps` samples each, directions turned and samples jittered per pixel,
 * points reconstructed at snapped pixels, angle bias 30 degrees, per-sample attenuation W(r) = 1 - r^2, then a 15 x 15
 * cross-bilateral filter applied along x and y. Presets are the slides': 6x6 with blur, 16x16 and 16x32 without. */
#include "rivals.h"

static void run(const view *v, const rival_preset *p, float *scratch, float *raw) {
    rival_random random;
    float direction[RIVAL_MOST_SAMPLES][2];
    const float bias = 0.57735027f, radius2 = v->radius * v->radius;
    (void)scratch;
    rival_random_fill(&random, 1);
    rival_directions(p->directions, direction);
    for (int y = 0; y < v->height; ++y)
        for (int x = 0; x < v->width; ++x) {
            size_t i = rival_index(v, x, y);
            raw[i] = 1;
            if (!(v->z[i] < VIEW_SKY))
                continue;
            float z = v->z[i], cx = (float)x + 0.5f, cy = (float)y + 0.5f, sum = 0,
                  radius_px = v->radius * v->focal_px / z;
            if (radius_px < 1)
                continue;
            int steps = radius_px < (float)p->steps ? (int)radius_px : p->steps;
            float step_px = radius_px / (float)(steps + 1);
            size_t tile = rival_tile_index(x, y);
            const float *turn = random.angle[tile];
            float first = step_px * (1 + random.jitter[tile]);
            v3f point = rival_point(v, x, y, z), n = rival_normal(v, i);
            /* the face's tangents to one pixel in x and in y: the plane met by the neighbouring view rays */
            float inverse = 1 / v->focal_px, nr = v3f_dot(n, point) / z;
            float zx = -z * n.x * inverse / nr, zy = -z * n.y * inverse / nr;
            v3f du = {(point.x / z) * zx + z * inverse, (point.y / z) * zx, zx};
            v3f dv = {(point.x / z) * zy, (point.y / z) * zy + z * inverse, zy};
            for (int k = 0; k < p->directions; ++k) {
                float dx = direction[k][0] * turn[0] - direction[k][1] * turn[1];
                float dy = direction[k][1] * turn[0] + direction[k][0] * turn[1];
                v3f tangent = v3f_mad(v3f_scale(du, dx), dv, dy);
                float tan_h = -tangent.z / sqrtf(tangent.x * tangent.x + tangent.y * tangent.y) + bias;
                float sin_h = rival_tan_to_sin(tan_h);
                for (int j = 0; j < steps; ++j) {
                    float at = first + step_px * (float)j;
                    v3f d = v3f_sub(rival_fetch(v, cx + dx * at, cy + dy * at), point);
                    float d2 = v3f_dot(d, d), across = sqrtf(d.x * d.x + d.y * d.y);
                    if (d2 <= radius2 && -d.z > tan_h * across) {
                        float tan_s = -d.z / across, sin_s = across > 0 ? rival_tan_to_sin(tan_s) : 1;
                        sum += (1 - d2 / radius2) * (sin_s - sin_h);
                        tan_h = tan_s, sin_h = sin_s;
                    }
                }
            }
            raw[i] = 1 - sum / (float)p->directions;
        }
}

/* Gaussian in the image (sigma 4 pixels) times Gaussian in depth (sigma a sixteenth of the radius). */
static void bilateral_pass(const view *v, int half_width, bool vertical, const float *in, float *out) {
    float kernel[33];
    const float sharpness = 16 / v->radius * 0.84932180f; /* exp2(-(s dz)^2) = exp(-dz^2 / (2 sigma^2)) */
    int extent = vertical ? v->height : v->width;
    ptrdiff_t stride = vertical ? v->width : 1;
    for (int k = 0; k <= half_width; ++k)
        kernel[k] = 0.5f * (float)(k * k) / (16.0f * 0.69314718f);
    for (int y = 0; y < v->height; ++y)
        for (int x = 0; x < v->width; ++x) {
            size_t i = rival_index(v, x, y);
            out[i] = in[i];
            if (!(v->z[i] < VIEW_SKY))
                continue;
            float sum = in[i], weights = 1;
            int at = vertical ? y : x;
            for (int k = -half_width; k <= half_width; ++k) {
                if (k == 0 || at + k < 0 || at + k >= extent)
                    continue;
                size_t j = (size_t)((ptrdiff_t)i + k * stride);
                float dz = sharpness * (v->z[i] - v->z[j]);
                float weight = exp2f(-kernel[k < 0 ? -k : k] - fminf(dz * dz, 100));
                sum += in[j] * weight;
                weights += weight;
            }
            out[i] = sum / weights;
        }
}

static void denoise(const view *v, const rival_preset *p, float *scratch, float *raw) {
    bilateral_pass(v, p->blur, false, raw, scratch);
    bilateral_pass(v, p->blur, true, scratch, raw);
}

const rival rival_hbao = {"hbao",
                          "HBAO (Bavoil and Sainz 2008)",
                          "[B08]",
                          run,
                          denoise,
                          3,
                          {{"6x6 blurred", 6, 6, 36, 7, {0, 1, 1}},
                           {"16x16", 16, 16, 256, 0, {0, 1, 1}},
                           {"16x32", 16, 32, 512, 0, {0, 1, 1}}}};
