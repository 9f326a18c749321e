# Weight of a sample against its distance.
FIG_WIDTH = 620; FIG_HEIGHT = 340
load "docs/figures/style.inc"
clamp(v) = v < 0 ? 0 : v > 1 ? 1 : v
weight(d, f) = clamp((1 - d) / f)
set xlabel "distance / radius"; set ylabel "weight"
set xrange [0:1.15]; set yrange [0:1.12]
set key bottom left Left reverse spacing 1.3
set samples 1000
plot (x < 1 ? 1 : 0) w l lw 2.5 dt 2 lc rgb INK title "f = 0: hard cutoff", \
     weight(x, 0.25) w l lw 2.5 lc rgb BLUE title "f = 0.25: [J16], 150 of 200 inches", \
     weight(x, 1.0) w l lw 2.5 lc rgb RED title "f = 1"
