/* Adaptive Gauss-Legendre quadrature in long double of the slice integrals, straight from their definitions. */
#include "reference.h"

#include <math.h>

enum { POINTS = 12, MAX_DEPTH = 24 };

static const long double pi_l = 3.14159265358979323846264338327950288L;

typedef struct integrand {
    enum { ARC, ARC_UNIFORM, BENT_O, BENT_V, ARC_SH, ARC_SH_UNIFORM } kind;
    long double n;
    const double *o, *v; /* ARC_SH: the slice's plane, and which coefficient */
    int index;
} integrand;

/* By the associated Legendre functions without the Condon-Shortley phase; m > 0 with cos(m phi), m < 0 with
 * sin(-m phi). */
long double ref_sh(int index, const long double d[3]) {
    const int band = index == 0 ? 0 : index < 4 ? 1 : 2, m = index - band * (band + 1), k = m < 0 ? -m : m;
    const long double s = sqrtl(d[0] * d[0] + d[1] * d[1]), c = d[2], phi = atan2l(d[1], d[0]);
    const long double legendre[3][3] = {{1, 0, 0}, {c, s, 0}, {0.5L * (3 * c * c - 1), 3 * s * c, 3 * s * s}};
    long double ratio = 1;
    for (int i = band - k + 1; i <= band + k; i++)
        ratio /= i; /* (band - k)! / (band + k)! */
    const long double scale = sqrtl((2 * band + 1) / (4 * pi_l) * ratio);
    return scale * legendre[band][k] * (m == 0 ? 1 : sqrtl(2) * (m > 0 ? cosl(k * phi) : sinl(k * phi)));
}

static long double evaluate(const integrand *f, long double theta) {
    const long double area = fabsl(sinl(theta)); /* solid angle per azimuth and theta */
    switch (f->kind) {
    case ARC:
        return cosl(theta - f->n) * area;
    case ARC_UNIFORM:
        return area;
    case BENT_O:
        return cosl(theta - f->n) * area * sinl(theta);
    case BENT_V:
        return cosl(theta - f->n) * area * cosl(theta);
    case ARC_SH:
    case ARC_SH_UNIFORM: {
        long double d[3];
        for (int i = 0; i < 3; i++)
            d[i] = sinl(theta) * (long double)f->o[i] + cosl(theta) * (long double)f->v[i];
        return (f->kind == ARC_SH ? cosl(theta - f->n) : 1.0L) * area * ref_sh(f->index, d);
    }
    }
    return 0.0L;
}

/* Roots of the Legendre polynomial by Newton's method. */
void ref_gauss_legendre(int count, long double *node, long double *weight) {
    for (int i = 0; i < count; i++) {
        long double x = cosl(pi_l * ((long double)i + 0.75L) / ((long double)count + 0.5L));
        long double derivative = 1.0L;
        for (int iteration = 0; iteration < 20; iteration++) {
            long double p0 = 1.0L, p1 = x;
            for (int k = 2; k <= count; k++) {
                const long double kl = (long double)k;
                const long double p2 = ((2.0L * kl - 1.0L) * x * p1 - (kl - 1.0L) * p0) / kl;
                p0 = p1;
                p1 = p2;
            }
            derivative = (long double)count * (x * p1 - p0) / (x * x - 1.0L);
            x -= p1 / derivative;
        }
        node[i] = x;
        weight[i] = 2.0L / ((1.0L - x * x) * derivative * derivative);
    }
}

static long double panel(const integrand *f, long double a, long double b) {
    static long double node[POINTS], weight[POINTS];
    if (weight[0] == 0.0L)
        ref_gauss_legendre(POINTS, node, weight);
    const long double middle = 0.5L * (a + b), half = 0.5L * (b - a);
    long double sum = 0.0L;
    for (int i = 0; i < POINTS; i++)
        sum += weight[i] * evaluate(f, middle + half * node[i]);
    return sum * half;
}

static long double adaptive(const integrand *f, long double a, long double b, long double whole, int depth) {
    const long double middle = 0.5L * (a + b);
    const long double left = panel(f, a, middle), right = panel(f, middle, b);
    if (depth >= MAX_DEPTH || fabsl(left + right - whole) < 1e-15L)
        return left + right;
    return adaptive(f, a, middle, left, depth + 1) + adaptive(f, middle, b, right, depth + 1);
}

/* Smooth on either side of theta = 0, so in two pieces. */
static long double integrate(const integrand *f, long double a, long double b) {
    if (a < 0.0L && b > 0.0L)
        return integrate(f, a, 0.0L) + integrate(f, 0.0L, b);
    return adaptive(f, a, b, panel(f, a, b), 0);
}

long double ref_arc(long double h_rad, long double n_rad) {
    const integrand f = {ARC, n_rad, 0, 0, 0};
    return h_rad < 0.0L ? integrate(&f, h_rad, 0.0L) : integrate(&f, 0.0L, h_rad);
}

long double ref_arc_uniform(long double h_rad) {
    const integrand f = {ARC_UNIFORM, 0.0L, 0, 0, 0};
    return h_rad < 0.0L ? integrate(&f, h_rad, 0.0L) : integrate(&f, 0.0L, h_rad);
}

void ref_arc_bent(long double h0_rad, long double h1_rad, long double n_rad, long double t[2]) {
    const integrand fo = {BENT_O, n_rad, 0, 0, 0}, fv = {BENT_V, n_rad, 0, 0, 0};
    t[0] = integrate(&fo, h0_rad, h1_rad);
    t[1] = integrate(&fv, h0_rad, h1_rad);
}

void ref_arc_sh(long double h0_rad, long double h1_rad, long double n_rad, int uniform, const double o[3],
                const double v[3], double sh[9]) {
    for (int i = 0; i < 9; i++) {
        const integrand f = {uniform ? ARC_SH_UNIFORM : ARC_SH, n_rad, o, v, i};
        sh[i] = (double)integrate(&f, h0_rad, h1_rad);
    }
}
