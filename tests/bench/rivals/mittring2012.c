/* [Mittring 2012], Unreal Engine 4, as in [A13] section 5.2.6 and listing 6: the mean angle between the two directions to
 * a pair of opposite points of the depth buffer. `directions` counts the pairs. */
#include "rivals.h"

static float acos_approximation(float x) {
    return (-0.69813170f * x * x - 0.87266463f) * x + 1.57079633f;
}

typedef struct receiver {
    v3f point, n, eye;
    float reach;
} receiver;

static float free_angle(const receiver *o, v3f sample, float bias, float *pair_weight) {
    v3f d = v3f_sub(sample, o->point);
    float length2 = v3f_dot(d, d);
    if (!(length2 > 0)) /* the pixel itself: nothing in the way down to the tangent plane */
        return 1.57079633f;
    v3f s = v3f_scale(d, 1 / sqrtf(length2));
    float sn = v3f_dot(s, o->n), cosine = v3f_dot(o->eye, s);
    if (sn < 0) /* capped to the tangent plane */
        cosine = v3f_dot(o->eye, v3f_normalize(v3f_mad(s, o->n, -sn)));
    /* too far in front: the partner stands in */
    if (o->point.z - sample.z > o->reach) {
        *pair_weight -= 0.5f;
        cosine = fmaxf(-v3f_dot(o->eye, s), 0);
    }
    return fmaxf(acos_approximation(cosine - bias), 0);
}

static void run(const view *v, const rival_preset *p, float *scratch, float *raw) {
    const float bias = 0.08f, projection_factor = 0.75f;
    rival_random random;
    (void)scratch;
    rival_random_fill(&random, p->directions);
    for (int y = 0; y < v->height; ++y)
        for (int x = 0; x < v->width; ++x) {
            size_t i = rival_index(v, x, y);
            raw[i] = 1;
            if (!(v->z[i] < VIEW_SKY))
                continue;
            float z = v->z[i], cx = (float)x + 0.5f, cy = (float)y + 0.5f;
            float radius_px = projection_factor * v->radius * v->focal_px / z, sum = 0, weights = 0.0001f;
            receiver o;
            o.point = rival_point(v, x, y, z), o.n = rival_normal(v, i);
            o.eye = v3f_scale(v3f_normalize(o.point), -1);
            o.reach = 2 * v->radius; /* 20 units */
            const float *turn = random.angle[rival_tile_index(x, y)];
            for (int k = 0; k < p->directions; ++k) {
                const float *s = random.disk[k];
                float dx = (s[0] * turn[0] - s[1] * turn[1]) * radius_px,
                      dy = (s[1] * turn[0] + s[0] * turn[1]) * radius_px;
                float weight = 1, angle = free_angle(&o, rival_fetch(v, cx + dx, cy + dy), bias, &weight);
                angle += free_angle(&o, rival_fetch(v, cx - dx, cy - dy), bias, &weight);
                sum += angle * weight;
                weights += weight;
            }
            raw[i] = sum / (weights * 3.14159265f);
        }
}

const rival rival_mittring2012 = {
    "mittring2012",
    "Mittring 2012 (Unreal Engine 4)",
    "[A13] listing 6",
    run,
    rival_blur_preset,
    2,
    {{"performance", 6, 1, 12, 2, {0.0f, 1.0f, 3.0f}}, {"quality", 32, 1, 64, 0, {0.0f, 1.0f, 3.0f}}}};
