# One slice of a scene seen in the world and in (t, w): lines stay lines, the horizon is the largest slope.
FIG_WIDTH = 980; FIG_HEIGHT = 440
load "docs/figures/style.inc"

F = 100.0                       # focal length, pixels
t(X, z) = F * X / z             # pixels from the principal point
w(z) = 1.0 / z                  # height

# A wall z = 6 + 0.35 X behind a box with corners C and D.
wall(X) = 6.0 + 0.35 * X
Px = -1.7; Pz = wall(Px)
Cx = 1.1;  Cz = 3.1
Dx = 2.3;  Dz = 3.5
# The wall's point in the direction of C, and of D: where the box starts and ends to hide it.
hit(k) = 6.0 / (1 - 0.35 * k)
Bz = hit(Cx / Cz); Bx = Bz * Cx / Cz
Ez = hit(Dx / Dz); Ex = Ez * Dx / Dz

$wall1 << EOD
EOD
set print $wall1
print -3.9, wall(-3.9)
print Bx, Bz
unset print
$box << EOD
EOD
set print $box
print Cx, Cz
print Dx, Dz
unset print
$curtain << EOD
EOD
set print $curtain
print Bx, Bz
print Cx, Cz
unset print
$wall2 << EOD
EOD
set print $wall2
print Ex, Ez
print 7.0, wall(7.0)
unset print
$horizon << EOD
EOD
set print $horizon
print Px, Pz
do for [i = 1:20] { print Px + (Cx - Px) * i * 0.065, Pz + (Cz - Pz) * i * 0.065 }
unset print

set multiplot layout 1,2 margins 0.07,0.98,0.14,0.90 spacing 0.10
unset key

set title "the slice in the world"
set xlabel "X (world units)"; set ylabel "z (world units)"
set xrange [-4.2:6.2]; set yrange [8.6:-0.5]
set label 1 "eye" at 0.25,-0.05 left
set label 2 "P" at Px-0.1,Pz+0.55 center
set label 3 "horizon sample" at Cx+0.35,Cz-0.15 left tc rgb RED
set label 4 "what the buffer" at 2.0,4.70 left tc rgb GREY
set label 5 "does not show" at 2.0,5.15 left tc rgb GREY
set arrow 1 from 0,0 to Px*0.96,Pz*0.96 nohead lc rgb GREY dt 3
plot $wall1 w l lw 3 lc rgb BLUE, $wall2 w l lw 3 lc rgb BLUE, $box w l lw 3 lc rgb GREEN, \
     $curtain w l lw 1.5 dt 2 lc rgb GREY, $horizon w l lw 2 lc rgb RED, \
     "+" using (0):(0) every ::0::0 w p pt 7 ps 0.9 lc rgb INK, \
     "+" using (Px):(Pz) every ::0::0 w p pt 7 ps 1.0 lc rgb INK, \
     "+" using (Cx):(Cz) every ::0::0 w p pt 7 ps 1.0 lc rgb RED

unset arrow 1; unset label 1
set title "the same slice in the depth buffer, as height"
set xlabel "t (pixels)"; set ylabel "height w = 1/z"
set xrange [-85:110]; set yrange [0.08:0.40]
set label 2 "P" at t(Px,Pz)+1,w(Pz)+0.020 right
set label 3 "horizon sample" at t(Cx,Cz)+5,w(Cz)+0.004 left tc rgb RED
set label 4 "slope s = (wₜ − w₀) / t" at -78,0.300 left tc rgb RED
set label 5 "a plane: a straight line" at -78,0.132 left tc rgb BLUE
set arrow 1 from -28,0.290 to t(-0.29,4.25)-1,w(4.15) lc rgb RED lw 1 size 4,20 filled
plot $wall1 using (t($1,$2)):(w($2)) w l lw 3 lc rgb BLUE, $wall2 using (t($1,$2)):(w($2)) w l lw 3 lc rgb BLUE, \
     $box using (t($1,$2)):(w($2)) w l lw 3 lc rgb GREEN, \
     $curtain using (t($1,$2)):(w($2)) w l lw 1.5 dt 2 lc rgb GREY, \
     $horizon using (t($1,$2)):(w($2)) w l lw 2 lc rgb RED, \
     "+" using (t(Px,Pz)):(w(Pz)) every ::0::0 w p pt 7 ps 1.0 lc rgb INK, \
     "+" using (t(Cx,Cz)):(w(Cz)) every ::0::0 w p pt 7 ps 1.0 lc rgb RED
unset multiplot
