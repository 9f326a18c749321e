# Multiple bounces [J16].
FIG_WIDTH = 620; FIG_HEIGHT = 440
load "docs/figures/style.inc"
larger(a, b) = a > b ? a : b
bounce(x, rho) = larger(x, (((2.0404 * rho - 0.3324) * x + (-4.7951 * rho + 0.6417)) * x + (2.7552 * rho + 0.6903)) * x)
set xlabel "visibility, one bounce"; set ylabel "visibility, multiple bounces"
set xrange [0:1]; set yrange [0:1]
set size ratio 0.8
set key bottom right spacing 1.3
plot bounce(x, 0.9) w l lw 2.5 lc rgb RED title "albedo 0.9", \
     bounce(x, 0.7) w l lw 2.5 lc rgb ORANGE title "albedo 0.7", \
     bounce(x, 0.5) w l lw 2.5 lc rgb GREEN title "albedo 0.5", \
     bounce(x, 0.3) w l lw 2.5 lc rgb BLUE title "albedo 0.3", \
     x w l lw 2 dt 2 lc rgb INK title "albedo 0 (identity)"
