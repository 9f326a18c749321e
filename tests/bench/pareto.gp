# Error against time, all scenes with the same weight.
FIG_WIDTH = 1180; FIG_HEIGHT = 670
load "docs/figures/style.inc"
load "tests/bench/rivals.inc"

set logscale xy
set xlabel "time, ns per pixel, one thread"
set format x "%.0f"
set xrange [5:200000]; set yrange [0.008:0.5]
set ytics ("0.01" 0.01, "0.02" 0.02, "0.05" 0.05, "0.1" 0.1, "0.2" 0.2, "0.5" 0.5)
set xtics ("10" 10, "100" 100, "1 000" 1000, "10 000" 10000, "100 000" 100000)
set multiplot
set bmargin at screen 0.33; set tmargin at screen 0.93

set title "against the truth of the depth buffer" offset 0,-0.5
set ylabel "root mean square error of visibility"
set lmargin at screen 0.065; set rmargin at screen 0.49
unset key
plot for [i = 1:RIVALS] pick("pooled", "view", "fitted", FAMILY[i]) u 1:2 w lp lw 1.2 ps 1 pt SHAPE[i] lc rgb COLOUR[i], \
     front("pooled", "view", "plain", "gtao scalar") u 1:2 w l lw 2 dt 2 lc rgb BLUE, \
     front("pooled", "view", "plain", "gtao memo estimator") u 1:2 w l lw 2 dt 4 lc rgb RED, \
     front("pooled", "view", "plain", "gtao") u 1:2 w l lw 3.5 lc rgb BLUE, \
     pick("pooled", "view", "plain", "gtao preset") u 1:2 w p pt 7 ps 1.3 lc rgb BLUE, \
     pick("pooled", "view", "plain", "gtao preset") u 1:2:3 w labels right offset -1.1,-0.8 font ",12" tc rgb BLUE

set title "against ray tracing of the scene"
unset ylabel
set lmargin at screen 0.565; set rmargin at screen 0.99
set key Left reverse at screen 0.05,0.215 left top maxrows 5 samplen 2 spacing 1.15 width 1
plot front("pooled", "rays", "fitted", "gtao") u 1:2 w l lw 3.5 lc rgb BLUE title "gtao.h, best settings", \
     front("pooled", "rays", "plain", "gtao") u 1:2 w l lw 2.5 lc rgb "#7FB8DD" title "gtao.h, not fitted", \
     1/0 w lp pt 7 lw 2 lc rgb BLUE title "gtao.h, presets", \
     1/0 w l lw 2 dt 2 lc rgb BLUE title "gtao.h, scalar kernel", \
     1/0 w l lw 2 dt 4 lc rgb RED title "gtao.h, memo estimator", \
     for [i = 1:RIVALS] pick("pooled", "rays", "fitted", FAMILY[i]) u 1:2 w lp lw 1.2 ps 1 pt SHAPE[i] lc rgb COLOUR[i] title LABEL[i], \
     pick("pooled", "rays", "fitted", "voxel cones") u 1:2 w lp lw 1.5 ps 1 pt 2 lc rgb GREEN title "voxel cones", \
     pick("pooled", "rays", "plain", "rays") u 1:2 w lp lw 2 ps 1 pt 3 lc rgb INK title "Embree rays", \
     pick("pooled", "rays", "plain", "rays denoised") u 1:2 w lp lw 1.5 dt 2 ps 1 pt 3 lc rgb INK title "Embree rays, blurred"
unset multiplot
