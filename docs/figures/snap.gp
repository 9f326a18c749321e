# Samples snapped to pixel centres: their slope is off on a tilted plane, their height above the tangent plane is not.
FIG_WIDTH = 980; FIG_HEIGHT = 400
load "docs/figures/style.inc"

phi = 0.40                      # angle of the slice on the screen
dx = cos(phi); dy = sin(phi)
gx = 0.10; gy = -0.62           # gradient of the height of a steep plane, per pixel, in units of w0
steps = 8; R = 12.0             # samples as the library distributes them: t = 1 + (R - 1) ((j + offset) / steps)^2
t(j) = 1 + (R - 1) * ((j + 0.5) / steps)**2
qx(j) = floor(t(j) * dx + 0.5)
qy(j) = floor(t(j) * dy + 0.5)
len(j) = sqrt(qx(j)**2 + qy(j)**2)

$samples << EOD
EOD
set print $samples
do for [j = 0:steps-1] { print t(j)*dx, t(j)*dy, qx(j), qy(j), t(j), (gx*qx(j) + gy*qy(j)) / len(j), len(j) }
unset print

set multiplot
unset key
set lmargin at screen 0.03; set rmargin at screen 0.50; set tmargin at screen 0.82; set bmargin at screen 0.20
set title "eight samples of a slice and the pixels they read" offset 0,0.4
set size ratio -1
set xrange [-0.9:11.9]; set yrange [5.4:-0.9]
unset border; unset tics; unset grid
set for [i = -0:12] arrow from i-0.5,-0.5 to i-0.5,5.5 nohead lc rgb "#DDDDDD" lw 1 back
set for [i = 0:6] arrow from -0.5,i-0.5 to 11.5,i-0.5 nohead lc rgb "#DDDDDD" lw 1 back
set arrow 100 from 0,0 to 11.6*dx,11.6*dy lw 2 lc rgb INK size 0.35,18 filled
set label 1 "d" at 11.0*dx+0.1,11.0*dy+0.85 center
set label 2 "q" at 8.75,2.75 center tc rgb RED
set label 3 "P" at -0.05,0.62 center
plot $samples using 1:2:($3-$1):($4-$2) w vectors nohead lw 1.5 lc rgb RED, \
     $samples using 1:2 w p pt 7 ps 0.5 lc rgb INK, \
     $samples using 3:4 w p pt 6 ps 1.3 lw 2 lc rgb RED, \
     "+" using (0):(0) every ::0::0 w p pt 7 ps 1.2 lc rgb INK
unset arrow; unset label

set lmargin at screen 0.60; set rmargin at screen 0.98; set tmargin at screen 0.89; set bmargin at screen 0.16
set size noratio
set border lc rgb INK; set xtics nomirror; set ytics nomirror; set grid lc rgb "#E4E4E4" lt 1
set title "what they say about a steep plane" offset 0,0
set xlabel "t (pixels)"; set ylabel "slope / w₀"
set xrange [0:12]; set yrange [-0.45:0.6]
set key top right spacing 1.3
plot gx*dx + gy*dy w l lw 2 dt 2 lc rgb INK title "slope of the plane along d", \
     $samples using 5:6 w p pt 6 ps 1.2 lw 2 lc rgb RED title "(wₜ − w₀) / |q|", \
     $samples using 5:(0) w p pt 7 ps 0.9 lc rgb BLUE title "(wₜ − w₀ − g·q) / |q|"
unset multiplot
