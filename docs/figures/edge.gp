# Interpolating between pixels across a silhouette invents occluders.
FIG_WIDTH = 980; FIG_HEIGHT = 380
load "docs/figures/style.inc"

N = 11                          # rows of pixels the slice crosses; the slice runs along +x here, its minor axis is y
slope = 0.16
minor(t) = slope * t            # position on the minor axis
w(y) = y < 1.5 ? 0.18 : 0.32    # the far wall fills rows 0 and 1, the near box rows 2 and up
below(t) = floor(minor(t)); frac(t) = minor(t) - floor(minor(t))
lerped(t) = w(below(t)) * (1 - frac(t)) + w(below(t) + 1) * frac(t)
nearest(t) = w(floor(minor(t) + 0.5))

set multiplot
unset key; unset border; unset tics; unset grid
set lmargin at screen 0.02; set rmargin at screen 0.50; set tmargin at screen 0.74; set bmargin at screen 0.28
set title "a slice beside a silhouette" offset 0,0.4
set size ratio -1
set xrange [-0.6:11.6]; set yrange [-0.6:3.6]
do for [i = 0:11] { do for [j = 0:3] {
    set object 1 + i * 4 + j rect from i-0.5,j-0.5 to i+0.5,j+0.5 fc rgb (j < 2 ? "#F4F8FB" : "#CDE9DF") \
        fs solid border lc rgb "#C8C8C8" back
} }
set label 1 "near box" at 3.0,3.0 center tc rgb GREEN front
set label 2 "P" at -0.05,0.55 center front
set label 3 "far wall" at 8.0,0.0 center tc rgb BLUE front
plot sample [t=0:1:1] "+" using (0):(0) every ::0::0 w p pt 7 ps 1.2 lc rgb INK, \
     [t=1:N:1] "+" using (t):(below(t)):(0):(1) w vectors nohead lw 1.2 lc rgb GREY, \
     [t=0:N:1] "+" using (t):(minor(t)) w l lw 2 lc rgb INK, \
     [t=1:N:1] "+" using (t):(minor(t)) w p pt 6 ps 1.0 lw 1.8 lc rgb RED
unset object; unset label

set lmargin at screen 0.60; set rmargin at screen 0.98; set tmargin at screen 0.90; set bmargin at screen 0.17
set size noratio
set border lc rgb INK; set xtics nomirror; set ytics nomirror; set grid lc rgb "#E4E4E4" lt 1
set title "what the slice reads" offset 0,0
set xlabel "t (pixels along the major axis)"; set ylabel "height w"
set xrange [0:12]; set yrange [0.14:0.40]
set key top left Left reverse spacing 1.3
plot sample [t=1:N:1] "+" using (t):(lerped(t)) w lp pt 6 ps 1.1 lw 2 lc rgb RED title "interpolated everywhere: phantom depths", \
     [t=1:N:1] "+" using (t):(nearest(t)) w lp pt 7 ps 0.8 lw 2 lc rgb BLUE title "within a surface, else the nearest"
unset multiplot
