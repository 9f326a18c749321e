/* [Bavoil et al. 2008], HBAO, as [A13] has it (section 5.2.3, listing 3): `directions` marches of `steps` depth samples,
 * whose horizontal offset is taken as the marched length (no reconstruction), tangents from depth differences, angle
 * bias 0.3, weight 1 - r^2. hbao.c is the method as its authors present it. */
#include "rivals.h"

static v3f smaller(v3f p, v3f right, v3f left) {
    v3f a = v3f_sub(right, p), b = v3f_sub(p, left);
    return v3f_dot(a, a) < v3f_dot(b, b) ? a : b;
}

static void run(const view *v, const rival_preset *p, float *scratch, float *raw) {
    rival_random random;
    float direction[RIVAL_MOST_SAMPLES][2];
    const float bias = tanf(0.3f), radius2 = v->radius * v->radius;
    (void)scratch;
    rival_random_fill(&random, 1);
    rival_directions(p->directions, direction);
    for (int y = 0; y < v->height; ++y)
        for (int x = 0; x < v->width; ++x) {
            size_t i = rival_index(v, x, y);
            raw[i] = 1;
            if (!(v->z[i] < VIEW_SKY))
                continue;
            float z = v->z[i], cx = (float)x + 0.5f, cy = (float)y + 0.5f, sum = 0;
            float step_px = v->radius * v->focal_px / z / (float)p->steps, step = v->radius / (float)p->steps;
            v3f point = rival_point(v, x, y, z);
            v3f du = smaller(point, rival_fetch(v, cx + 1, cy), rival_fetch(v, cx - 1, cy));
            v3f dv = smaller(point, rival_fetch(v, cx, cy + 1), rival_fetch(v, cx, cy - 1));
            const float *turn = random.angle[rival_tile_index(x, y)];
            for (int k = 0; k < p->directions; ++k) {
                float dx = direction[k][0] * turn[0] - direction[k][1] * turn[1];
                float dy = direction[k][1] * turn[0] + direction[k][0] * turn[1];
                v3f tangent = v3f_mad(v3f_scale(du, dx), dv, dy);
                /* "up" is towards the eye: -z */
                float tan_h = -tangent.z / sqrtf(tangent.x * tangent.x + tangent.y * tangent.y) + bias;
                float sin_h = rival_tan_to_sin(tan_h);
                for (int j = 1; j <= p->steps; ++j) {
                    float s = rival_fetch(v, cx + dx * step_px * (float)j, cy + dy * step_px * (float)j).z;
                    float across = step * (float)j, up = z - s, length2 = across * across + up * up, t = up / across;
                    if (length2 <= radius2 && t > tan_h) {
                        float sin_s = rival_tan_to_sin(t);
                        sum += (sin_s - sin_h) * (1 - length2 / radius2);
                        tan_h = t, sin_h = sin_s;
                    }
                }
            }
            raw[i] = 1 - sum / (float)p->directions;
        }
}

const rival rival_bavoil2008 = {
    "bavoil2008",
    "Bavoil et al. 2008, as in [A13]",
    "[A13] listing 3",
    run,
    rival_blur_preset,
    2,
    {{"performance", 8, 6, 52, 1, {0.0f, 1.03f, 4.0f}}, {"quality", 80, 6, 484, 0, {0.0f, 1.0f, 3.0f}}}};
