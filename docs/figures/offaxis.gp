# Converged visibility of an open plane against the angle of the pixel off the optical axis, over all directions of tilt.
FIG_WIDTH = 760; FIG_HEIGHT = 440
load "docs/figures/style.inc"

# n = cos(tau) v + sin(tau) (cos(chi) e1 + sin(chi) e2); a slice at screen angle p lies at azimuth psi around v.
psi(p, a) = atan2(sin(p), cos(p) * cos(a))
open(tau, c) = cos(tau) + sin(tau) * c * atan2(sin(tau) * c, cos(tau))
M = 90
memo(tau, chi, a) = (sum [k = 0:M-1] open(tau, cos(psi(pi * (k + 0.5) / M, a) - chi))) / M
lo(tau, a) = memo(tau, 0, a)        # tilted towards or away from the axis
hi(tau, a) = memo(tau, pi / 2, a)   # tilted sideways

set xlabel "angle off the optical axis, degrees"
set ylabel "visibility (the truth is 1)"
set xrange [0:65]; set yrange [0.7:1.3]
set key top left Left reverse spacing 1.3
set samples 66
set style fill solid 1.0 noborder
plot "+" using 1:(lo(80*deg,$1*deg)):(hi(80*deg,$1*deg)) w filledcurves fc rgb "#F6D2BC" \
         title "uniform slices, plane tilted by 80°", \
     "+" using 1:(lo(60*deg,$1*deg)):(hi(60*deg,$1*deg)) w filledcurves fc rgb ORANGE \
         title "uniform slices, plane tilted by 60°", \
     "+" using 1:(lo(30*deg,$1*deg)):(hi(30*deg,$1*deg)) w filledcurves fc rgb RED \
         title "uniform slices, plane tilted by 30°", \
     1 w l lw 2.5 lc rgb BLUE title "normalized"
