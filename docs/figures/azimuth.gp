# Slices that are uniform on the screen are not uniform around the view vector.
FIG_WIDTH = 980; FIG_HEIGHT = 400
load "docs/figures/style.inc"

alpha = 60 * deg                # angle of the pixel off the optical axis, towards +x
K = 12
ca = cos(alpha)
# Perpendicular to v, with e1 in the plane of the axis: b - (b.v) v = cos(phi) cos(alpha) e1 + sin(phi) e2.
psi(p) = atan2(sin(p), cos(p) * ca)
J(p) = ca / (cos(p)**2 * ca**2 + sin(p)**2)

set multiplot
unset key; unset border; unset tics; unset grid
set size ratio -1
set xrange [-1.25:1.25]; set yrange [-1.25:1.25]
set tmargin at screen 0.88; set bmargin at screen 0.04
set samples 361

set lmargin at screen 0.00; set rmargin at screen 0.28
set title "slices on the screen"
set for [k = 0:K-1] arrow from -cos(pi*(k+0.5)/K),-sin(pi*(k+0.5)/K) to cos(pi*(k+0.5)/K),sin(pi*(k+0.5)/K) \
    nohead lw 1.8 lc rgb BLUE
plot sample [-pi:pi] "+" using (cos($1)):(sin($1)) w l lw 1.5 lc rgb GREY
unset arrow

set lmargin at screen 0.28; set rmargin at screen 0.56
set title "the same around v, 60° off axis"
set for [k = 0:K-1] arrow from -cos(psi(pi*(k+0.5)/K)),-sin(psi(pi*(k+0.5)/K)) \
    to cos(psi(pi*(k+0.5)/K)),sin(psi(pi*(k+0.5)/K)) nohead lw 1.8 lc rgb RED
plot sample [-pi:pi] "+" using (cos($1)):(sin($1)) w l lw 1.5 lc rgb GREY
unset arrow

set lmargin at screen 0.66; set rmargin at screen 0.97; set tmargin at screen 0.90; set bmargin at screen 0.16
set size noratio
set border lc rgb INK; set tics nomirror; set grid lc rgb "#E4E4E4" lt 1
set title "weight of a slice, J"
set xlabel "angle φ on the screen, degrees"
set xrange [0:180]; set yrange [0:2.2]
set xtics nomirror 0,45,180; set ytics nomirror 0,0.5,2
set key top right
Ja(p, a) = cos(a) / (cos(p)**2 * cos(a)**2 + sin(p)**2)
plot Ja(x*deg, 0) w l lw 2 dt 2 lc rgb INK title "on axis", \
     Ja(x*deg, 30*deg) w l lw 2.5 lc rgb BLUE title "30° off axis", \
     Ja(x*deg, 60*deg) w l lw 2.5 lc rgb RED title "60° off axis"
unset multiplot
