# Visibility of an open plane on the optical axis against its tilt, one to three slices: the range over slice directions.
FIG_WIDTH = 760; FIG_HEIGHT = 440
load "docs/figures/style.inc"

# An open slice integrates to n.v + (n.o) atan2(n.o, n.v); psi is the slice's angle from the direction of the tilt.
open(tau, psi) = cos(tau) + sin(tau) * cos(psi) * atan2(sin(tau) * cos(psi), cos(tau))
memo(tau, psi, K) = (sum [k = 0:K-1] open(tau, psi + pi * k / K)) / K
# The extremes lie at psi = 0 and halfway between two slices.
hi(tau, K) = memo(tau, 0, K)
lo(tau, K) = memo(tau, pi / (2.0 * K), K)

set xlabel "tilt of the plane against the view vector, degrees"
set ylabel "visibility (the truth is 1)"
set xrange [0:90]; set yrange [0:1.7]
set key bottom left Left reverse spacing 1.3
set samples 181
set style fill solid 1.0 noborder
plot "+" using 1:(lo($1*deg,1)):(hi($1*deg,1)) w filledcurves fc rgb "#F6D2BC" title "[J19] as printed, 1 slice", \
     "+" using 1:(lo($1*deg,2)):(hi($1*deg,2)) w filledcurves fc rgb ORANGE title "[J19] as printed, 2 slices", \
     "+" using 1:(lo($1*deg,3)):(hi($1*deg,3)) w filledcurves fc rgb RED title "[J19] as printed, 3 slices", \
     1 w l lw 2.5 lc rgb BLUE title "normalized, any number of slices"
