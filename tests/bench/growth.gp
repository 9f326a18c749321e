# How the time of gtao.h grows with radius, settings and image, and the model of docs/performance.md beside it.
FIG_WIDTH = 1100; FIG_HEIGHT = 820
load "docs/figures/style.inc"
of(group, what) = sprintf("< awk -F, '$1 == \"%s\" && $2 == \"%s\" { print $3, $4 }' build/bench/growth.csv", group, what)
image(stage, what) = sprintf("< awk -F, '$1 == \"%s\" && $2 == \"%s\" { print $3, $4 }' build/bench/memory.csv | sort -g", stage, what)

set multiplot layout 2,2
set key top left Left reverse spacing 1.15 samplen 2.5
set logscale xy

set title "radius (stairs, 1 slice, no cap)"
set xlabel "mean radius, pixels"; set ylabel "ns per pixel"
set xtics (8, 16, 32, 64, 128, 256, 512, 1024)
set ytics (5, 10, 20, 50, 100, 200, 500, 1000)
set xrange [7:1200]; set yrange [4:1000]
plot of("radius", "every pixel") w lp lw 2 pt 6 lc rgb RED title "every pixel", \
     of("radius", "64 samples a side") w lp lw 2 pt 7 lc rgb ORANGE title "64 samples a side", \
     of("radius", "16 samples a side") w lp lw 2 pt 7 lc rgb GREEN title "16", \
     of("radius", "8 samples a side") w lp lw 3 pt 7 lc rgb BLUE title "8"

set title "slices and samples (furniture), lines: the model"
set xlabel "samples a side"
set xtics (4, 8, 16, 32, 64, 128, 256)
set ytics (5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000)
set xrange [3.5:360]; set yrange [4:8000]
plot for [k in "32 16 8 4 2 1"] of("settings", "model ".k." slices") w l lw 1.5 lc rgb GREY notitle, \
     for [k in "32 16 8 4 2 1"] of("settings", k." slices") w p pt 7 lc rgb BLUE notitle, \
     for [k in "32 16 8 4 2 1"] of("settings", k." slices") u ($1 == 256 ? $1 * 1.05 : NaN):2:(k) w labels left notitle

unset logscale
set logscale x
set title "image (stairs, 1 slice x 8)"
set xlabel "megapixels"; set ylabel "ns per pixel"
set xtics (0.3, 0.5, 1, 2, 4, 8, 16, 33); set ytics autofreq
set xrange [0.25:45]; set yrange [0:28]
plot image("visibility", "growing 4 KiB") w lp lw 2 pt 6 lc rgb ORANGE title "visibility, cap growing with the image", \
     image("visibility", "growing huge") w lp lw 1 dt 2 pt 4 lc rgb RED title "on huge pages", \
     image("visibility", "100 px 4 KiB") w lp lw 3 pt 7 lc rgb BLUE title "visibility, cap 100 pixels", \
     image("visibility", "100 px huge") w lp lw 1 dt 2 pt 5 lc rgb PURPLE title "on huge pages", \
     image("visibility", "100 px wide 4 KiB") w p pt 9 ps 1.5 lc rgb INK title "16384x2048, cap 100 pixels", \
     image("prepare", "100 px 4 KiB") w lp lw 2 pt 7 lc rgb GREEN title "prepare"

set title "rows that a thread takes at a time (two threads)"
set xlabel "rows, halves at the right"; set ylabel "times as fast as one thread"
set xtics (8, 16, 32, 64, 128, 272, 544)
set xrange [7:650]; set yrange [0:2.2]
set key bottom left
plot of("chunks", "furniture 960x540 low") w lp lw 2 pt 6 lc rgb ORANGE title "furniture, 960x540, low", \
     of("chunks", "furniture 1920x1080 high") w lp lw 2 pt 7 lc rgb BLUE title "furniture, 1920x1080, high", \
     of("chunks", "village 1920x1080 low") w lp lw 2 pt 7 lc rgb GREEN title "village, low", \
     of("chunks", "village 1920x1080 high") w lp lw 2 pt 7 lc rgb RED title "village, high"
unset multiplot
