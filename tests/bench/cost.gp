# What the memo's production setting costs as its circumstances change.
FIG_WIDTH = 1100; FIG_HEIGHT = 820
load "docs/figures/style.inc"
of(group, scene, setting) = sprintf("< awk -F, '$1 == \"%s\" && $2 == \"%s\" && $3 ~ /%s/ { print $4, $5, $7 }' build/bench/speed.csv", group, scene, setting)

set multiplot layout 2,2
set key top left Left reverse spacing 1.15 samplen 2.5

set logscale x 2
set title "radius (stairs, 960x540, no cap)"
set xlabel "mean radius, pixels"; set ylabel "ns per pixel"
set xrange [3.5:600]; set yrange [0:*]
plot of("radius", "stairs", "1 slice x 8 steps") u 1:2 w lp lw 3 pt 7 lc rgb BLUE title "1 slice, 8 samples a side", \
     of("radius_every_pixel", "stairs", "") u 1:2 w lp lw 2 pt 6 lc rgb ORANGE title "1 slice, every pixel"

set title "slices and samples (stairs, 960x540, cap 100 pixels)"
set logscale xy
set xtics (1, 2, 4, 8, 16, 32, 64)
set xlabel "slices, or samples a side"; set ylabel "ns per pixel"
set xrange [0.9:72]; set yrange [5:2000]
plot of("slices", "stairs", "") u 1:2 w lp lw 3 pt 7 lc rgb BLUE title "slices of 8 samples a side", \
     of("steps", "stairs", "") u 1:2 w lp lw 2 pt 6 lc rgb GREEN title "samples a side of 1 slice"

unset logscale
set xtics autofreq
set title "resolution (stairs)"
set xlabel "megapixels"; set ylabel "milliseconds"
set xrange [0:*]; set yrange [0:*]
plot of("resolution", "stairs", "") u ($1*$1*9/16/1e6):($2*$1*$1*9/16/1e6) w lp lw 3 pt 7 lc rgb BLUE title "cap 100 pixels", \
     of("resolution_scaled_cap", "stairs", "") u ($1*$1*9/16/1e6):($2*$1*$1*9/16/1e6) w lp lw 2 pt 6 lc rgb ORANGE title "cap grows with the image"

set title "threads (furniture)"
set xlabel "threads"; set ylabel "times as fast as one thread"
set xtics 1
stats of("threads", "furniture", "") u 1 nooutput
set xrange [0.8:STATS_max + 0.2]; set yrange [0:STATS_max * 1.15]
plot of("threads", "furniture", "960x540") u 1:3 w lp lw 2 pt 6 lc rgb ORANGE title "960x540, medium", \
     of("threads", "furniture", "1920x1080") u 1:3 w lp lw 3 pt 7 lc rgb BLUE title "1920x1080, high", \
     x w l lw 1.5 dt 2 lc rgb GREY title "linear"
unset multiplot
