# A slice: view vector, projected normal, tangent plane, horizons, visible arc; and the integrand over the angle.
FIG_WIDTH = 980; FIG_HEIGHT = 440
load "docs/figures/style.inc"

n  = 22 * deg                   # signed angle of the projected normal, positive towards o
h1 = 58 * deg                   # horizon on the side of o
h0 = 41 * deg                   # horizon on the other side, positive
X(r, a) = r * sin(a)
Y(r, a) = r * cos(a)

set samples 400
set multiplot layout 1,2 margins 0.02,0.97,0.14,0.90 spacing 0.10
unset key; unset border; unset tics; unset grid
set size ratio -1
set xrange [-1.42:1.42]; set yrange [-0.72:1.42]
set title "the slice plane"
set arrow 1 from 0,0 to 0,1.27 lw 2 lc rgb INK size 0.06,20 filled front
set label 1 "v" at -0.05,1.32 right front
set arrow 2 from 0,0 to 1.27,0 lw 2 lc rgb INK size 0.06,20 filled front
set label 2 "o" at 1.30,-0.02 left front
set arrow 3 from 0,0 to X(1.27,n),Y(1.27,n) lw 2.5 lc rgb GREEN size 0.06,20 filled front
set label 3 "n projected" at X(1.36,n),Y(1.36,n) center tc rgb GREEN front
set arrow 4 from X(1.3,n-pi/2),Y(1.3,n-pi/2) to X(1.3,n+pi/2),Y(1.3,n+pi/2) nohead lw 1.5 dt 2 lc rgb GREEN front
set label 4 "tangent plane" at 0.72,-0.55 left tc rgb GREEN front
set arrow 5 from 0,0 to X(1.30,h1),Y(1.30,h1) nohead lw 2 lc rgb RED front
set arrow 6 from 0,0 to X(1.32,-h0),Y(1.32,-h0) nohead lw 2 lc rgb RED front
set label 5 "h₁" at X(0.50,h1*0.70),Y(0.50,h1*0.70) center tc rgb RED front
set label 6 "h₀" at X(0.42,-h0*0.58),Y(0.42,-h0*0.58) center tc rgb RED front
set label 7 "n" at X(0.68,n*0.52),Y(0.68,n*0.52) center tc rgb GREEN front
set label 8 "P" at -0.07,-0.12 center front
set label 9 "visible" at X(0.84,-17*deg),Y(0.84,-17*deg) center tc rgb BLUE front

# The surface in the slice: rises to a point on either horizon.
$surface << EOD
EOD
set print $surface
print -1.42, 0.62
print -1.20, 0.84
print X(1.22,-h0), Y(1.22,-h0)
print -0.62, 0.34
print -0.40, 0.17
print 0, 0
print 0.34, -0.13
print 0.62, -0.10
print X(1.12,h1), Y(1.12,h1)
print 1.10, 0.30
print 1.26, -0.18
print 1.42, -0.30
unset print

set samples 400
plot sample [-h0:h1] "+" using (X(1.0,$1)):(Y(1.0,$1)) w filledcurves xy=0,0 fc rgb PALE fs solid noborder, \
     $surface using 1:2 w filledcurves y1=-0.72 fc rgb LIGHT fs solid noborder, \
     $surface using 1:2 w l lw 2 lc rgb GREY, \
     [0:h1] "+" using (X(0.40,$1)):(Y(0.40,$1)) w l lw 1.5 lc rgb RED, \
     [-h0:0] "+" using (X(0.32,$1)):(Y(0.32,$1)) w l lw 1.5 lc rgb RED, \
     [0:n] "+" using (X(0.60,$1)):(Y(0.60,$1)) w l lw 1.5 lc rgb GREEN, \
     [-h0:h1] "+" using (X(1.0,$1)):(Y(1.0,$1)) w l lw 2 lc rgb BLUE, \
     [0:1] "+" using (0):(0) every ::0::0 w p pt 7 ps 1.0 lc rgb INK

unset arrow; unset label
set size noratio
set border 3 lc rgb INK; set tics nomirror; set grid lc rgb "#E4E4E4" lt 1
set title "what is integrated over the angle from v"
set xlabel "angle θ from v, degrees"
set xrange [-90:120]; set yrange [0:0.75]
set xtics nomirror -90,30,120; set ytics nomirror 0,0.2,0.6
f(a) = (a < n - pi/2 || a > n + pi/2) ? NaN : cos(a - n) * abs(sin(a))
set label 1 "−h₀" at -h0/deg,0.035 right offset -0.4,0 tc rgb RED front
set label 2 "h₁" at h1/deg,0.035 left offset 0.6,0 tc rgb RED front
set label 3 "cos(θ − n) |sin θ|" at 22,0.715 right tc rgb INK
set arrow 1 from -h0/deg,0 to -h0/deg,f(-h0) nohead lw 2 lc rgb RED front
set arrow 2 from h1/deg,0 to h1/deg,f(h1) nohead lw 2 lc rgb RED front
set label 4 "a(−h₀, n)" at -25,0.11 center tc rgb BLUE front
set label 5 "a(h₁, n)" at 36,0.14 center tc rgb BLUE front
plot sample [-h0/deg:h1/deg] "+" using 1:(f($1*deg)) w filledcurves y1=0 fc rgb PALE fs solid noborder, \
     [-90:120] "+" using 1:(f($1*deg)) w l lw 2.5 lc rgb BLUE
unset multiplot
