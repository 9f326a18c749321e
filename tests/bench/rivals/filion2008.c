/* [Filion and McNaughton 2008], StarCraft II, as in [A13] section 5.2.2 and listing 2: points in the hemisphere about the
 * normal, projected to the depth buffer; an occluder farther in front than the radius fades out. `directions` counts the
 * points. */
#include "rivals.h"

static void run(const view *v, const rival_preset *p, float *scratch, float *raw) {
    rival_random random;
    (void)scratch;
    rival_random_fill(&random, p->directions);
    for (int y = 0; y < v->height; ++y)
        for (int x = 0; x < v->width; ++x) {
            size_t i = rival_index(v, x, y);
            raw[i] = 1;
            if (!(v->z[i] < VIEW_SKY))
                continue;
            v3f point = rival_point(v, x, y, v->z[i]), n = rival_normal(v, i),
                mirror = random.unit[rival_tile_index(x, y)];
            float sum = 0;
            for (int k = 0; k < p->directions; ++k) {
                v3f d = v3f_reflect(random.ball[k], mirror);
                if (v3f_dot(d, n) < 0)
                    d = v3f_scale(d, -1);
                v3f s = v3f_mad(point, d, v->radius);
                if (!(s.z > 0)) { /* behind the eye */
                    sum += 1;
                    continue;
                }
                float scale = v->focal_px / s.z;
                float difference = s.z - rival_fetch(v, v->cx + s.x * scale, v->cy + s.y * scale).z;
                /* rho = clamp((difference - radius) / difference, 0, 1), which is 1 where the point is in front */
                sum += difference <= 0 ? 1 : clampf((difference - v->radius) / difference, 0, 1);
            }
            raw[i] = sum / (float)p->directions;
        }
}

const rival rival_filion2008 = {
    "filion2008",
    "Filion and McNaughton 2008 (StarCraft II)",
    "[A13] listing 2",
    run,
    rival_blur_preset,
    2,
    {{"performance", 15, 1, 15, 2, {0.0f, 1.12f, 2.5f}}, {"quality", 80, 1, 80, 0, {0.0f, 1.1f, 2.0f}}}};
