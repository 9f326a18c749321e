# Error against slices and against samples, all scenes; the truth's own noise is taken off in quadrature.
FIG_WIDTH = 1100; FIG_HEIGHT = 660
load "docs/figures/style.inc"

noise2 = real(system("awk -F, 'NR > 1 { s += $3 * $3 } END { print s / (NR - 1) }' build/bench/truth.csv"))
less(rmse) = rmse * rmse > 1.3 * noise2 ? sqrt(rmse * rmse - noise2) : NaN
of(column, value, other) = sprintf("< awk -F, '$1 == \"pooled\" && $2 == \"gtao\" && $8 == \"view\" && $9 == \"plain\" && $%d == %d { print $%d, $10 }' build/bench/error.csv | sort -g", column, value, other)
SLICES = 4; STEPS = 5
MOST = int(system("awk -F, '$1 == \"pooled\" && $2 == \"gtao\" && $4 > m { m = $4 } END { print m }' build/bench/error.csv"))
set fit quiet logfile "/dev/null"

set logscale xy
set yrange [0.004:0.4]
set ytics ("0.002" 0.002, "0.005" 0.005, "0.01" 0.01, "0.02" 0.02, "0.05" 0.05, "0.1" 0.1, "0.2" 0.2)
set xtics (1, 2, 4, 8, 16, 32, 64)
set xrange [0.9:72]
set ylabel "RMSE against the depth buffer's truth"
set key Left reverse at graph 0.02,-0.2 left top maxrows 8 spacing 1.1 samplen 2.5 width 1
set multiplot layout 1,2
set bmargin at screen 0.37

f(x) = a * x**b; a = 0.2; b = -1
fit [1:8] log(f(x)) of(STEPS, 0, SLICES) u 1:(log(less($2))) via a, b
set xlabel "slices"
set title "more slices"
plot of(STEPS, 4, SLICES) u 1:(less($2)) w lp lw 2 pt 4 lc rgb GREY title "4 samples a side", \
     of(STEPS, 8, SLICES) u 1:(less($2)) w lp lw 2 pt 5 lc rgb "#7FB8DD" title "8", \
     of(STEPS, 16, SLICES) u 1:(less($2)) w lp lw 2 pt 6 lc rgb GREEN title "16", \
     of(STEPS, 32, SLICES) u 1:(less($2)) w lp lw 2 pt 8 lc rgb ORANGE title "32", \
     of(STEPS, 0, SLICES) u 1:(less($2)) w lp lw 3 pt 7 lc rgb BLUE title "every pixel", \
     f(x) w l lw 1.5 dt 2 lc rgb INK title sprintf("slope %.2f (1 to 8 slices)", b), \
     sqrt(noise2) w l lw 1 dt 3 lc rgb GREY title "noise of the truth, taken off"

g(x) = p * x**q; p = 0.5; q = -1
fit [2:16] log(g(x)) of(SLICES, MOST, STEPS) u ($1 > 0 ? $1 : NaN):(log(less($2))) via p, q
set xlabel "samples a side"
set title "more samples"
plot of(SLICES, 1, STEPS) u ($1 > 0 ? $1 : NaN):(less($2)) w lp lw 2 pt 4 lc rgb GREY title "1 slice", \
     of(SLICES, 2, STEPS) u ($1 > 0 ? $1 : NaN):(less($2)) w lp lw 2 pt 5 lc rgb "#7FB8DD" title "2", \
     of(SLICES, 4, STEPS) u ($1 > 0 ? $1 : NaN):(less($2)) w lp lw 2 pt 6 lc rgb GREEN title "4", \
     of(SLICES, 16, STEPS) u ($1 > 0 ? $1 : NaN):(less($2)) w lp lw 2 pt 8 lc rgb ORANGE title "16", \
     of(SLICES, MOST, STEPS) u ($1 > 0 ? $1 : NaN):(less($2)) w lp lw 3 pt 7 lc rgb BLUE title sprintf("%d", MOST), \
     g(x) w l lw 1.5 dt 2 lc rgb INK title sprintf("slope %.2f (2 to 16 samples)", q)
unset multiplot
