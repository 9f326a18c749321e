#include <float.h>
#include <string.h>

#include "rivals.h"
#include "tests/bench/sampling.h"

const rival *const rivals[] = {&rival_mittring2007,
                               &rival_filion2008,
                               &rival_bavoil2008,
                               &rival_volumetric,
                               &rival_alchemy,
                               &rival_mittring2012,
                               &rival_hbao,
                               &rival_gtao_memo,
                               &rival_xegtao,
                               &rival_bitmask,
                               NULL};

/* A copy of the image, and a depth pyramid with edge weights. */
size_t rival_scratch_floats(const view *v) {
    return 4 * (view_pixels(v) + 4 * (size_t)(v->width + v->height) + 64);
}

void rival_apply_output(const view *v, const rival_output *o, float *visibility) {
    size_t n = view_pixels(v);
    for (size_t i = 0; i < n; ++i)
        if (v->z[i] < VIEW_SKY)
            visibility[i] = clampf(powf(fmaxf(0, o->b * (visibility[i] + o->a)), o->c), 0, 1);
}

void rival_fit_add(rival_fit *fit, const view *v, const float *raw, const float *truth) {
    size_t n = view_pixels(v);
    for (size_t i = 0; i < n; ++i)
        if (v->z[i] < VIEW_SKY) {
            /* bins over [-0.5, 1.5]: some raw values leave [0, 1] */
            int bin = clampi((int)((raw[i] + 0.5f) * 0.5f * RIVAL_BINS), 0, RIVAL_BINS - 1);
            fit->count[bin] += 1;
            fit->truth[bin] += (double)truth[i];
            fit->truth2[bin] += (double)truth[i] * (double)truth[i];
        }
}

static double bin_value(int k) {
    return (k + 0.5) * 2 / RIVAL_BINS - 0.5;
}

static double output_at(const double p[3], double raw) {
    return fmin(1, pow(fmax(0, p[1] * (raw + p[0])), p[2]));
}

static double fit_error(const rival_fit *fit, const double p[3]) {
    double sum = 0;
    for (int k = 0; k < RIVAL_BINS; ++k)
        if (fit->count[k] > 0) {
            double f = output_at(p, bin_value(k));
            sum += fit->count[k] * f * f - 2 * f * fit->truth[k] + fit->truth2[k];
        }
    return sum;
}

/* One damped Gauss-Newton step from p with numeric derivatives; false if the system is singular. */
static bool fit_step(const rival_fit *fit, const double p[3], double damping, double q[3]) {
    double m[3][4];
    memset(m, 0, sizeof m);
    for (int k = 0; k < RIVAL_BINS; ++k)
        if (fit->count[k] > 0) {
            double raw = bin_value(k), f = output_at(p, raw), row[4];
            for (int j = 0; j < 3; ++j) {
                double r[3];
                memcpy(r, p, sizeof r);
                r[j] += 1e-5;
                row[j] = (output_at(r, raw) - f) * 1e5;
            }
            row[3] = fit->truth[k] / fit->count[k] - f;
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 4; ++j)
                    m[i][j] += fit->count[k] * row[i] * row[j];
        }
    for (int i = 0; i < 3; ++i)
        m[i][i] = m[i][i] * (1 + damping) + 1e-9;
    for (int i = 0; i < 3; ++i) {
        if (!(m[i][i] > 0))
            return false;
        for (int k = 0; k < 3; ++k)
            for (int j = 3; k != i && j >= i; --j)
                m[k][j] -= m[k][i] / m[i][i] * m[i][j];
    }
    for (int i = 0; i < 3; ++i)
        q[i] = p[i] + m[i][3] / m[i][i];
    return q[1] > 1e-3 && q[2] > 1e-2 && q[2] < 50;
}

/* Levenberg-Marquardt from several starts: the clamps make local minima. */
rival_output rival_fit_solve(const rival_fit *fit, double *rmse) {
    static const double starts[][3] = {{0, 1, 1},   {0, 1, 3},    {0, 1.1, 0.5}, {0.5, 1, 1},
                                       {0.5, 1, 4}, {0.5, 1, 10}, {-0.3, 1.4, 1}};
    double best[3] = {0, 1, 1}, best_error = DBL_MAX, count = 0;
    for (size_t s = 0; s < sizeof starts / sizeof *starts; ++s) {
        double p[3], q[3], damping = 1e-2, error;
        memcpy(p, starts[s], sizeof p);
        error = fit_error(fit, p);
        for (int step = 0; step < 200 && damping < 1e8; ++step) {
            double e = fit_step(fit, p, damping, q) ? fit_error(fit, q) : DBL_MAX;
            if (e < error) {
                memcpy(p, q, sizeof p);
                damping *= 0.3;
                if (error - e < 1e-9 * error)
                    break;
                error = e;
            } else {
                damping *= 4;
            }
        }
        if (error < best_error) {
            best_error = error;
            memcpy(best, p, sizeof best);
        }
    }
    for (int k = 0; k < RIVAL_BINS; ++k)
        count += fit->count[k];
    *rmse = sqrt(fmax(0, best_error) / fmax(1, count));
    return (rival_output){(float)best[0], (float)best[1], (float)best[2]};
}

void rival_random_fill(rival_random *r, int count) {
    for (uint32_t i = 0; i < RIVAL_TILE * RIVAL_TILE; ++i) {
        double u[2], w[2];
        sample_jitter(i, 0, u);
        sample_jitter(i, 1, w);
        double z = 1 - 2 * u[0], s = sqrt(1 - z * z), phi = 2 * V3_PI * u[1], turn = 2 * V3_PI * w[0];
        r->unit[i] = (v3f){(float)(s * cos(phi)), (float)(s * sin(phi)), (float)z};
        r->angle[i][0] = (float)cos(turn), r->angle[i][1] = (float)sin(turn);
        r->jitter[i] = (float)w[1];
    }
    const double golden = V3_PI * (3 - sqrt(5.0));
    for (int i = 0; i < count; ++i) {
        /* radii by a second sequence, so that neither depends on the other */
        double z = 1 - (2 * i + 1.0) / count, s = sqrt(1 - z * z), phi = golden * i;
        double shell = cbrt(radical_inverse((uint32_t)i) + 0.5 / count), ring = sqrt((i + 0.5) / count);
        shell = shell > 1 ? 1 : shell;
        r->ball[i] = (v3f){(float)(shell * s * cos(phi)), (float)(shell * s * sin(phi)), (float)(shell * z)};
        r->disk[i][0] = (float)(ring * cos(phi)), r->disk[i][1] = (float)(ring * sin(phi));
    }
}

/* One pass; stride 1 and the width, or the width and the height. */
static void blur_pass(const view *v, int half_width, bool vertical, const float *in, float *out) {
    /* depth differences in [A13]'s units */
    float unit = 10 / v->radius;
    int extent = vertical ? v->height : v->width;
    ptrdiff_t stride = vertical ? v->width : 1;
    for (int y = 0; y < v->height; ++y)
        for (int x = 0; x < v->width; ++x) {
            size_t i = rival_index(v, x, y);
            out[i] = in[i];
            if (!(v->z[i] < VIEW_SKY))
                continue;
            v3f n = rival_normal(v, i);
            float sum = in[i], weights = 1;
            int at = vertical ? y : x;
            for (int k = -half_width; k <= half_width; ++k) {
                if (k == 0 || at + k < 0 || at + k >= extent)
                    continue;
                size_t j = (size_t)((ptrdiff_t)i + k * stride);
                /* normal_power 10, depth_power 0.5 */
                float c = v3f_dot(rival_normal(v, j), n) * 0.5f + 0.5f, c2 = c * c, c4 = c2 * c2;
                float weight = c4 * c4 * c2 / sqrtf(1 + unit * fabsf(v->z[i] - v->z[j]));
                sum += in[j] * weight;
                weights += weight;
            }
            out[i] = sum / weights;
        }
}

void rival_blur(const view *v, int half_width, float *scratch, float *visibility) {
    blur_pass(v, half_width, false, visibility, scratch);
    blur_pass(v, half_width, true, scratch, visibility);
}

void rival_blur_preset(const view *v, const rival_preset *p, float *scratch, float *visibility) {
    rival_blur(v, p->blur, scratch, visibility);
}
