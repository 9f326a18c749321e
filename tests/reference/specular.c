/* Specular visibility from the definitions: nested adaptive quadrature, over caps in polar coordinates about one axis,
 * over lobes about the cone's. */
#include "reference.h"

#include <math.h>
#include <string.h>

static const long double pi_l = 3.14159265358979323846264338327950288L;

/* ---- caps ---- */

enum { NODES = 20 };

/* Azimuth range, of 2 pi, of the circle at theta around one axis that lies within b of an axis d away. As
 * 2 asin(sqrt(q)) of half angles, which does not cancel. */
static long double covered(long double theta, long double b, long double d) {
    if (theta + d <= b || theta + b >= 2.0L * pi_l - d)
        return 2.0L * pi_l;
    if (theta >= b + d || d >= theta + b)
        return 0.0L;
    const long double q = sinl(0.5L * (b + theta - d)) * sinl(0.5L * (b - theta + d)) / (sinl(theta) * sinl(d));
    return 4.0L * asinl(sqrtl(q < 0.0L ? 0.0L : q > 1.0L ? 1.0L : q));
}

long double ref_cap_intersection(long double a, long double b, long double d) {
    static long double node[NODES], weight[NODES];
    if (weight[0] == 0.0L)
        ref_gauss_legendre(NODES, node, weight);
    if (a > b) { /* around the axis of the smaller */
        const long double swap = a;
        a = b;
        b = swap;
    }
    /* The covered range behaves like a square root where circles touch; both ends of each piece are taken so. */
    long double cut[4] = {0.0L, fabsl(b - d), b + d < pi_l ? b + d : 2.0L * pi_l - b - d, a}, sum = 0.0L, from = 0.0L;
    for (int i = 1; i < 4; i++) {
        const long double to = i == 3 || cut[i] > a ? a : cut[i];
        if (!(to > from))
            continue;
        for (int part = 0; part < 4; part++)
            for (int k = 0; k < NODES; k++) {
                const long double x = pi_l * (0.25L * (long double)part + 0.125L * (node[k] + 1.0L));
                const long double theta = 0.5L * (from + to) - 0.5L * (to - from) * cosl(x);
                sum += 0.125L * pi_l * weight[k] * 0.5L * (to - from) * sinl(x) * covered(theta, b, d) * sinl(theta);
            }
        from = to;
    }
    return sum;
}

/* ---- lobes ---- */

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

double ref_lobe_value(const ref_lobe *lobe, const double l[3]) {
    const double nl = dot(lobe->n, l), nv = dot(lobe->n, lobe->v), aa = lobe->alpha * lobe->alpha;
    if (nl <= 0.0)
        return 0.0;
    if (lobe->kind == REF_PHONG) {
        const double rl = 2.0 * nv * nl - dot(lobe->v, l);
        return rl > 0.0 ? pow(rl, 2.0 / aa - 2.0) * nl : 0.0;
    }
    double h[3];
    for (int i = 0; i < 3; i++)
        h[i] = l[i] + lobe->v[i];
    const double length = sqrt(dot(h, h)), nh = dot(lobe->n, h) / length, vh = dot(lobe->v, h) / length;
    if (!(nh > 0.0))
        return 0.0;
    const double tt = 1.0 / (nh * nh) - 1.0;
    if (lobe->kind == REF_BECKMANN)
        return exp(-tt / aa) / (REF_PI * aa * pow(nh, 4.0)) * nl;
    if (lobe->kind == REF_BLINN)
        return (2.0 / aa) / (2.0 * REF_PI) * pow(nh, 2.0 / aa - 2.0) * nl;
    const double d = aa / (REF_PI * pow(nh * nh * (aa - 1.0) + 1.0, 2.0));
    if (lobe->kind == REF_GGX)
        return d * nl;
    const double lambda_v = 0.5 * (sqrt(1.0 + aa * (1.0 / (nv * nv) - 1.0)) - 1.0);
    const double lambda_l = 0.5 * (sqrt(1.0 + aa * (1.0 / (nl * nl) - 1.0)) - 1.0);
    const double f = lobe->f0 + (1.0 - lobe->f0) * pow(1.0 - vh, 5.0);
    return d * f / ((1.0 + lambda_v + lambda_l) * 4.0 * nv);
}

/* Polar coordinates about the cone's axis, azimuth from the direction of R. */
typedef struct polar {
    const ref_lobe *lobe;
    double axis[3], x[3], y[3];
    double theta; /* of the circle being integrated */
    double scale; /* of the whole, for the tolerance */
} polar;

static double at_azimuth(polar *p, double azimuth) {
    double l[3];
    for (int i = 0; i < 3; i++)
        l[i] = cos(p->theta) * p->axis[i] + sin(p->theta) * (cos(azimuth) * p->x[i] + sin(azimuth) * p->y[i]);
    return ref_lobe_value(p->lobe, l);
}

static double circle(polar *p, double theta);

/* Gauss 7, Kronrod 15. */
static double kronrod(double (*f)(polar *, double), polar *p, double a, double b, double tolerance, int depth,
                      int least) {
    static const double node[8] = {0.0,
                                   0.2077849550078985,
                                   0.4058451513773972,
                                   0.5860872354676911,
                                   0.7415311855993945,
                                   0.8648644233597691,
                                   0.9491079123427585,
                                   0.9914553711208126};
    static const double wide[8] = {0.2094821410847278, 0.2044329400752989, 0.1903505780647854, 0.1690047266392679,
                                   0.1406532597159259, 0.1047900103222502, 0.0630920926299786, 0.0229353220105292};
    static const double narrow[8] = {0.4179591836734694, 0.0, 0.3818300505051189, 0.0,
                                     0.2797053914892767, 0.0, 0.1294849661688697, 0.0};
    const double middle = 0.5 * (a + b), half = 0.5 * (b - a);
    double fine = 0.0, coarse = 0.0;
    for (int i = 0; i < 8; i++)
        for (int side = 0; side < (i ? 2 : 1); side++) {
            const double value = f(p, middle + (side ? -1.0 : 1.0) * half * node[i]);
            fine += wide[i] * value;
            coarse += narrow[i] * value;
        }
    fine *= half;
    coarse *= half;
    if (least <= 0 && (depth <= 0 || fabs(fine - coarse) < tolerance))
        return fine;
    return kronrod(f, p, a, middle, 0.5 * tolerance, depth - 1, least - 1) +
           kronrod(f, p, middle, b, 0.5 * tolerance, depth - 1, least - 1);
}

static double circle(polar *p, double theta) {
    const double saved = p->theta;
    p->theta = theta;
    /* R's azimuth is 0; its opposite, pi. */
    double sum = kronrod(at_azimuth, p, 0.0, 0.1, 1e-9 * p->scale, 14, 0);
    sum += kronrod(at_azimuth, p, 0.1, REF_PI, 1e-9 * p->scale, 14, 1);
    sum += kronrod(at_azimuth, p, -0.1, 0.0, 1e-9 * p->scale, 14, 0);
    sum += kronrod(at_azimuth, p, -REF_PI, -0.1, 1e-9 * p->scale, 14, 1);
    p->theta = saved;
    return sum * sin(theta);
}

double ref_lobe_integral(const ref_lobe *lobe, const double b[3], double a) {
    polar p;
    double r[3], length = 0.0, sum = 0.0, along, from = 0.0;
    memset(&p, 0, sizeof p);
    p.lobe = lobe;
    for (int i = 0; i < 3; i++) {
        p.axis[i] = b[i];
        r[i] = 2.0 * dot(lobe->n, lobe->v) * lobe->n[i] - lobe->v[i];
    }
    along = dot(r, b);
    for (int i = 0; i < 3; i++) {
        p.x[i] = r[i] - along * b[i];
        length += p.x[i] * p.x[i];
    }
    if (length < 1e-20) {
        const int k = fabs(b[0]) < 0.6 ? 0 : 1;
        length = 0.0;
        for (int i = 0; i < 3; i++) {
            p.x[i] = (i == k ? 1.0 : 0.0) - b[k] * b[i];
            length += p.x[i] * p.x[i];
        }
    }
    for (int i = 0; i < 3; i++)
        p.x[i] /= sqrt(length);
    p.y[0] = b[1] * p.x[2] - b[2] * p.x[1];
    p.y[1] = b[2] * p.x[0] - b[0] * p.x[2];
    p.y[2] = b[0] * p.x[1] - b[1] * p.x[0];
    /* A tolerance for what a lobe of this height and width integrates to. */
    p.scale = 1.0;
    /* Cuts at R and a little around it. */
    const double beta = acos(along > 1.0 ? 1.0 : along < -1.0 ? -1.0 : along), w = 3.0 * lobe->alpha;
    const double cut[4] = {beta - w, beta, beta + w, a};
    for (int i = 0; i < 4; i++) {
        const double to = i == 3 || cut[i] > a ? a : cut[i];
        if (!(to > from))
            continue;
        sum += kronrod(circle, &p, from, to, 1e-8, 12, 1);
        from = to;
    }
    return sum;
}
