# Largest error of the printed bent normal against the angle off the optical axis: one slice, and an open plane (any
# tilt, many slices).
FIG_WIDTH = 760; FIG_HEIGHT = 440
load "docs/figures/style.inc"

# On the open plane all are (p1 n1, p2 n2, n3) for n = (n1, n2, n3) on (e1, e2, v); the largest angle between the two vectors is
# asin(|p1 - p2| / (p1 + p2)), at grazing tilt. psi: azimuth around v of the slice at screen angle p.
psi(p, a) = atan2(sin(p), cos(p) * cos(a))
J(p, a) = cos(a) / (cos(p)**2 * cos(a)**2 + sin(p)**2)
M = 180
p(k) = pi * (k + 0.5) / M
# as printed: the slice's screen direction, rotated from (0, 0, -1) to v; slices weigh alike
a1(a) = 2.0 / M * (sum [k = 0:M-1] cos(p(k)) * cos(psi(p(k), a)))
a2(a) = 2.0 / M * (sum [k = 0:M-1] sin(p(k)) * sin(psi(p(k), a)))
# a single slice: the largest difference between p and psi
b(a) = asin((1 - cos(a)) / (1 + cos(a))) / deg
# o and J
c1(a) = 2.0 / M * (sum [k = 0:M-1] J(p(k), a) * cos(psi(p(k), a))**2)
c2(a) = 2.0 / M * (sum [k = 0:M-1] J(p(k), a) * sin(psi(p(k), a))**2)
# as printed, but slices weigh J
d1(a) = 2.0 / M * (sum [k = 0:M-1] J(p(k), a) * cos(p(k)) * cos(psi(p(k), a)))
d2(a) = 2.0 / M * (sum [k = 0:M-1] J(p(k), a) * sin(p(k)) * sin(psi(p(k), a)))
err(u, v) = asin(abs(u - v) / (u + v)) / deg

set xlabel "angle off the optical axis, degrees"
set ylabel "largest error of the direction, degrees"
set xrange [0:65]; set yrange [-0.6:24]
set key top left Left reverse spacing 1.3
set samples 66
plot b(x*deg) w l lw 2.5 lc rgb ORANGE title "[J19] as printed, direction of one slice", \
     err(a1(x*deg), a2(x*deg)) w l lw 2.5 lc rgb RED title "[J19] as printed, open plane", \
     err(d1(x*deg), d2(x*deg)) w l lw 2.5 dt 2 lc rgb PURPLE title "printed rotation with J, open plane", \
     err(c1(x*deg), c2(x*deg)) w l lw 2.5 lc rgb BLUE title "o in space with J, open plane"
