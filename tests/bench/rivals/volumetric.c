/* Volumetric obscurance [Loos and Sloan 2010; Szirmay-Kalos et al. 2009] with the paired samples of [Ownby et al. 2010],
 * as in [A13] section 5.2.4 and listing 4: the occluded share of line segments through a sphere about the pixel.
 * `directions` counts the pairs.
 *
 * Deviation: listing 4 takes the height of the sphere at the sample's texture coordinate; it must be at its offset. */
#include "rivals.h"

static void run(const view *v, const rival_preset *p, float *scratch, float *raw) {
    const float lower = 0.35f, upper = 1.0f;
    rival_random random;
    (void)scratch;
    rival_random_fill(&random, p->directions);
    for (int y = 0; y < v->height; ++y)
        for (int x = 0; x < v->width; ++x) {
            size_t i = rival_index(v, x, y);
            raw[i] = 1;
            if (!(v->z[i] < VIEW_SKY))
                continue;
            float z = v->z[i], cx = (float)x + 0.5f, cy = (float)y + 0.5f, radius_px = v->radius * v->focal_px / z;
            float sum = 0.5f; /* the pixel itself */
            const float *turn = random.angle[rival_tile_index(x, y)];
            for (int k = 0; k < p->directions; ++k) {
                const float *s = random.disk[k];
                float dx = s[0] * turn[0] - s[1] * turn[1], dy = s[1] * turn[0] + s[0] * turn[1];
                float height = v->radius * sqrtf(1 - (s[0] * s[0] + s[1] * s[1])), inverse = 0.5f / height;
                float r1 = (height + z - rival_fetch(v, cx + dx * radius_px, cy + dy * radius_px).z) * inverse;
                float r2 = (height + z - rival_fetch(v, cx - dx * radius_px, cy - dy * radius_px).z) * inverse;
                bool valid1 = lower <= r1 && r1 <= upper, valid2 = lower <= r2 && r2 <= upper;
                if (valid1 || valid2) {
                    sum += valid1 ? r1 : 1 - r2;
                    sum += valid2 ? r2 : 1 - r1;
                } else {
                    sum += 1;
                }
            }
            raw[i] = 1 - sum / (2 * (float)p->directions + 1);
        }
}

const rival rival_volumetric = {
    "volumetric",
    "Volumetric obscurance (Loos and Sloan 2010)",
    "[A13] listing 4",
    run,
    rival_blur_preset,
    2,
    {{"performance", 24, 1, 48, 1, {0.5f, 1.01f, 8.0f}}, {"quality", 40, 1, 80, 0, {0.5f, 1.0f, 3.0f}}}};
