/* [Mittring 2007], CryEngine 2, as in [A13] section 5.2.1 and listing 1: the share of points in a sphere about the pixel
 * that lie in front of the depth buffer. No normals, no range check. `directions` counts the points.
 *
 * Deviation: listing 1 compares device depths with a scale for its far plane; this compares linear depths. */
#include "rivals.h"

static void run(const view *v, const rival_preset *p, float *scratch, float *raw) {
    rival_random random;
    (void)scratch;
    rival_random_fill(&random, p->directions);
    for (int y = 0; y < v->height; ++y)
        for (int x = 0; x < v->width; ++x) {
            size_t i = rival_index(v, x, y);
            float z = v->z[i], sum = 0, radius_px = v->radius * v->focal_px / z;
            raw[i] = 1;
            if (!(z < VIEW_SKY))
                continue;
            v3f mirror = random.unit[rival_tile_index(x, y)];
            for (int k = 0; k < p->directions; ++k) {
                v3f s = v3f_reflect(random.ball[k], mirror);
                float px = (float)x + 0.5f + s.x * radius_px, py = (float)y + 0.5f + s.y * radius_px;
                sum += rival_fetch(v, px, py).z > z + s.z * v->radius;
            }
            raw[i] = sum / (float)p->directions;
        }
}

const rival rival_mittring2007 = {
    "mittring2007",
    "Mittring 2007 (CryEngine 2)",
    "[A13] listing 1",
    run,
    rival_blur_preset,
    2,
    {{"performance", 24, 1, 24, 3, {0.57f, 1.0f, 5.0f}}, {"quality", 200, 1, 200, 0, {0.55f, 1.0f, 4.0f}}}};
