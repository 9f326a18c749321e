# Error against time on each scene, against the truth of the depth buffer.
FIG_WIDTH = 1180; FIG_HEIGHT = 720
load "docs/figures/style.inc"
load "tests/bench/rivals.inc"

SCENES = "terrain stairs columns foliage grilles scan furniture figure near far"
set logscale xy
set xrange [5:20000]; set yrange [0.005:0.5]
set multiplot
set xtics ("10" 10, "100" 100, "1 000" 1000, "10 000" 10000) font ",11"
unset key
do for [k = 0:9] {
    column = k % 5; line = k / 5
    set lmargin at screen 0.06 + 0.19 * column; set rmargin at screen 0.235 + 0.19 * column
    set tmargin at screen 0.95 - 0.41 * line; set bmargin at screen 0.65 - 0.41 * line
    set title word(SCENES, k + 1) offset 0,-0.6
    if (column == 0) { set ytics ("0.01" 0.01, "0.02" 0.02, "0.05" 0.05, "0.1" 0.1, "0.2" 0.2, "0.5" 0.5) font ",11"; set ylabel "RMSE" offset 1,0
    } else { set ytics ("" 0.01, "" 0.02, "" 0.05, "" 0.1, "" 0.2, "" 0.5); unset ylabel }
    if (line == 1) { set xlabel "ns per pixel" offset 0,0.5 } else { unset xlabel }
    scene = word(SCENES, k + 1)
    if (k == 9) { set key Left reverse at screen 0.06,0.14 left top maxrows 4 samplen 2 spacing 1.15 width 1 }
    plot for [i = 1:RIVALS] pick(scene, "view", "fitted", FAMILY[i]) u 1:2 w lp lw 1.2 ps 0.8 pt SHAPE[i] lc rgb COLOUR[i] title LABEL[i], \
         front(scene, "view", "plain", "gtao memo estimator") u 1:2 w l lw 2 dt 4 lc rgb RED title "gtao.h, memo estimator", \
         front(scene, "view", "plain", "gtao scalar") u 1:2 w l lw 2 dt 2 lc rgb BLUE title "gtao.h, scalar kernel", \
         front(scene, "view", "plain", "gtao") u 1:2 w l lw 3 lc rgb BLUE title "gtao.h"
}
unset multiplot
