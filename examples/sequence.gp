# Error of each frame of build/demo-sequence/error.txt, which build/sequence writes.
FIG_WIDTH = 900; FIG_HEIGHT = 620
load "docs/figures/style.inc"
data = "build/demo-sequence/error.txt"
REST = 36; CAMERA = 48; OBJECT = 48; CUT = 36 # as in sequence.c
set xrange [0:REST + CAMERA + OBJECT + CUT]; set logscale y
set lmargin at screen 0.09; set rmargin at screen 0.98
do for [x in sprintf("%d %d %d", REST, REST + CAMERA, REST + CAMERA + OBJECT)] {
    set arrow from real(x), graph 0 to real(x), graph 1 nohead dt 3 lc rgb GREY
}
set multiplot

set tmargin at screen 0.97; set bmargin at screen 0.61
set yrange [0.03:0.4]; set ytics ("0.05" 0.05, "0.1" 0.1, "0.2" 0.2, "0.4" 0.4)
set ylabel "RMS error of visibility"; unset key; set format x ""
set label 1 "at rest" at REST / 2., graph 0.93 center tc rgb GREY
set label 2 "camera moves" at REST + CAMERA / 2., graph 0.93 center tc rgb GREY
set label 3 "hoop moves" at REST + CAMERA + OBJECT / 2., graph 0.93 center tc rgb GREY
set label 4 "after a cut" at REST + CAMERA + OBJECT + CUT / 2., graph 0.93 center tc rgb GREY
plot data u 1:2 w l lw 2 lc rgb GREY, data u 1:5 w l lw 2 lc rgb ORANGE, \
     data u 1:8 w l lw 2.5 lc rgb BLUE, data u 1:11 w l lw 2 dt 2 lc rgb GREEN

unset label; set tmargin at screen 0.57; set bmargin at screen 0.21
set yrange [0.0005:0.4]; set ytics ("0.001" 0.001, "0.01" 0.01, "0.1" 0.1)
set ylabel "change between frames"; set xlabel "frame"; set format x "%g"
set key at screen 0.53, 0.06 center horizontal maxrows 2 samplen 2 spacing 1.2
shown(v) = v > 0 ? v : NaN # nothing to compare a first frame with
plot data u 1:(shown($4)) w l lw 2 lc rgb GREY title "one frame", \
     data u 1:(shown($7)) w l lw 2 lc rgb ORANGE title "spatial filter", \
     data u 1:(shown($10)) w l lw 2.5 lc rgb BLUE title "spatial and temporal", \
     data u 1:(shown($13)) w l lw 2 dt 2 lc rgb GREEN title "the same at half resolution"
