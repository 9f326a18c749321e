/* Alchemy AO [McGuire et al. 2011], as in [A13] section 5.2.5 and listing 5: sum of (v.n - bias) / (v.v + eps) over points
 * of the depth buffer in a disk about the pixel. `directions` counts the points. */
#include "rivals.h"

static void run(const view *v, const rival_preset *p, float *scratch, float *raw) {
    const float sigma = 2.0f, epsilon = 0.00001f, bias = 1.0f, projection_factor = 0.75f;
    const float unit = 10 / v->radius; /* to [A13]'s units */
    rival_random random;
    (void)scratch;
    rival_random_fill(&random, p->directions);
    for (int y = 0; y < v->height; ++y)
        for (int x = 0; x < v->width; ++x) {
            size_t i = rival_index(v, x, y);
            raw[i] = 1;
            if (!(v->z[i] < VIEW_SKY))
                continue;
            float z = v->z[i], cx = (float)x + 0.5f, cy = (float)y + 0.5f, sum = 0;
            float radius_px = projection_factor * v->radius * v->focal_px / z;
            v3f point = rival_point(v, x, y, z), n = rival_normal(v, i);
            const float *turn = random.angle[rival_tile_index(x, y)];
            for (int k = 0; k < p->directions; ++k) {
                const float *s = random.disk[k];
                float dx = s[0] * turn[0] - s[1] * turn[1], dy = s[1] * turn[0] + s[0] * turn[1];
                v3f d = v3f_scale(v3f_sub(rival_fetch(v, cx + dx * radius_px, cy + dy * radius_px), point), unit);
                sum += fmaxf(0, v3f_dot(d, n) - bias) / (v3f_dot(d, d) + epsilon);
            }
            raw[i] = fmaxf(0, 1 - 2 * sigma / (float)p->directions * sum);
        }
}

const rival rival_alchemy = {
    "alchemy",
    "Alchemy AO (McGuire et al. 2011)",
    "[A13] listing 5",
    run,
    rival_blur_preset,
    2,
    {{"performance", 6, 1, 6, 2, {0.0f, 1.005f, 5.0f}}, {"quality", 64, 1, 64, 0, {0.0f, 1.0f, 5.0f}}}};
