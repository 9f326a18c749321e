# Error of each frame of build/demo-sequence/error.txt, which build/sequence writes.
FIG_WIDTH = 900; FIG_HEIGHT = 430
load "docs/figures/style.inc"
data = "build/demo-sequence/error.txt"
REST = 36; CAMERA = 48; OBJECT = 48; CUT = 36
set xlabel "frame"; set ylabel "root mean square error of visibility"
set xrange [0:REST + CAMERA + OBJECT + CUT]; set logscale y; set yrange [0.01:0.4]
set ytics ("0.01" 0.01, "0.02" 0.02, "0.05" 0.05, "0.1" 0.1, "0.2" 0.2, "0.4" 0.4)
set key outside below center horizontal samplen 2 spacing 1.2
do for [x in sprintf("%d %d %d", REST, REST + CAMERA, REST + CAMERA + OBJECT)] { set arrow from real(x), graph 0 to real(x), graph 1 nohead dt 3 lc rgb GREY }
set label "at rest" at REST / 2., graph 0.95 center tc rgb GREY
set label "camera moves" at REST + CAMERA / 2., graph 0.95 center tc rgb GREY
set label "hoop moves" at REST + CAMERA + OBJECT / 2., graph 0.95 center tc rgb GREY
set label "after a cut" at REST + CAMERA + OBJECT + CUT / 2., graph 0.95 center tc rgb GREY
plot data u 1:2 w l lw 2 lc rgb GREY title "one frame", \
     data u 1:4 w l lw 2 lc rgb ORANGE title "spatial filter", \
     data u 1:6 w l lw 2.5 lc rgb BLUE title "spatial and temporal", \
     data u 1:8 w l lw 2 dt 2 lc rgb GREEN title "the same at half resolution"
