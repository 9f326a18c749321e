/* Visibility bitmask [Therrien et al. 2023], with the settings of its widespread Unity version: one slice of 12 samples a
 * side, 32 sectors of equal angle, every sample a slab of constant thickness (1 unit there for a radius of 5: here a
 * fifth of the radius), no falloff, no denoiser of its own at one frame (the blur of [A13] stands in).
 * `directions` counts the slices, `steps` the samples on each side. */
#include "rivals.h"

static int bits_set(uint32_t m) {
    m -= m >> 1 & 0x55555555u;
    m = (m & 0x33333333u) + (m >> 2 & 0x33333333u);
    return (int)(((m + (m >> 4)) & 0x0f0f0f0fu) * 0x01010101u >> 24);
}

/* Sectors whose centre lies between the fractions lo and hi of the half circle. */
static uint32_t sectors(float lo, float hi) {
    int first = (int)floorf(clampf(lo, 0, 1) * 32 + 0.5f), last = (int)floorf(clampf(hi, 0, 1) * 32 + 0.5f);
    if (last <= first)
        return 0;
    return (0xffffffffu >> (32 - (last - first))) << first;
}

static void run(const view *v, const rival_preset *p, float *scratch, float *raw) {
    const float pi = 3.14159265f, thickness = 0.2f * v->radius;
    rival_random random;
    (void)scratch;
    rival_random_fill(&random, 1);
    for (int y = 0; y < v->height; ++y)
        for (int x = 0; x < v->width; ++x) {
            size_t i = rival_index(v, x, y);
            raw[i] = 1;
            if (!(v->z[i] < VIEW_SKY))
                continue;
            v3f point = rival_point(v, x, y, v->z[i]), n = rival_normal(v, i),
                eye = v3f_scale(v3f_normalize(point), -1);
            float radius_px = v->radius * v->focal_px / v->z[i], radius2 = v->radius * v->radius, visible = 0;
            /* interleaved gradient noise */
            float wave = 0.06711056f * (float)x + 0.00583715f * (float)y, noise = 52.9829189f * (wave - floorf(wave));
            noise -= floorf(noise);
            float jitter = random.jitter[rival_tile_index(x, y)];
            for (int slice = 0; slice < p->directions; ++slice) {
                float phi = pi / (float)p->directions * ((float)slice + noise), c = cosf(phi), s = sinf(phi);
                v3f d = {c, s, 0}, ortho = v3f_mad(d, eye, -v3f_dot(d, eye)), axis = v3f_normalize(v3f_cross(d, eye));
                v3f projected = v3f_mad(n, axis, -v3f_dot(n, axis));
                float length = sqrtf(v3f_dot(projected, projected));
                float cos_n = length > 0 ? clampf(v3f_dot(projected, eye) / length, -1, 1) : 1;
                float angle = rival_acos(cos_n) * (v3f_dot(ortho, projected) < 0 ? -1.0f : 1.0f);
                uint32_t hidden = 0;
                for (int side = 0; side < 2; ++side)
                    for (int j = 0; j < p->steps; ++j) {
                        float sign = side ? 1.0f : -1.0f, t = ((float)j + jitter) / (float)p->steps;
                        float at = sign * fmaxf(1, t * radius_px);
                        v3f front = v3f_sub(rival_fetch(v, (float)x + 0.5f + c * at, (float)y + 0.5f + s * at), point);
                        v3f back = v3f_mad(front, eye, -thickness);
                        float f2 = v3f_dot(front, front);
                        if (!(f2 > 0) || f2 > radius2)
                            continue;
                        float a = sign * rival_acos(clampf(v3f_dot(front, eye) / sqrtf(f2), -1, 1));
                        float b = sign * rival_acos(clampf(v3f_dot(back, eye) / sqrtf(v3f_dot(back, back)), -1, 1));
                        a = (a - angle) / pi + 0.5f, b = (b - angle) / pi + 0.5f;
                        hidden |= a < b ? sectors(a, b) : sectors(b, a);
                    }
                visible += 1 - (float)bits_set(hidden) / 32;
            }
            raw[i] = visible / (float)p->directions;
        }
}

const rival rival_bitmask = {"bitmask",
                             "Visibility bitmask (Therrien et al. 2023)",
                             "Therrien et al. 2023",
                             run,
                             rival_blur_preset,
                             2,
                             {{"1x12", 1, 12, 24, 2, {0, 1, 1}}, {"4x12", 4, 12, 96, 2, {0, 1, 1}}}};
