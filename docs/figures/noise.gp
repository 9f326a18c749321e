# The slice directions of all 16 pixels of a tile over six frames, three readings of the printed noise.
FIG_WIDTH = 880; FIG_HEIGHT = 330
load "docs/figures/style.inc"

array ROT[6] = [60, 300, 180, 240, 120, 0]
$literal << EOD
EOD
$meant << EOD
EOD
$ours << EOD
EOD
fract(v) = v - floor(v)
set print $literal
do for [f = 0:5] { do for [i = 0:15] {
    x = i % 4; y = i / 4
    print 180 * fract((((x + y) & 3) * 4) / 16.0 + (x & 3) + ROT[f + 1] / 360.0)
} }
set print $meant
do for [f = 0:5] { do for [i = 0:15] { print 180 * fract(i / 16.0 + ROT[f + 1] / 360.0) } }
set print $ours
do for [f = 0:5] { do for [i = 0:15] { print 180 * fract(i / 16.0 + ROT[f + 1] / 360.0 + (f >= 3) / 96.0) } }
unset print

unset key; unset grid; set border 1 lc rgb INK
set xrange [0:180]; set yrange [0:3]
set xtics nomirror 0,30,180
set ytics nomirror scale 0 ("as printed:\n12 directions" 2.5, "parentheses added:\n48 directions" 1.5, \
    "three frames shifted:\n96 directions" 0.5)
set xlabel "slice angle, degrees (one slice)"
set lmargin 22
plot $literal using 1:(2.15):(0):(0.7) w vectors nohead lw 1.6 lc rgb RED, \
     $meant using 1:(1.15):(0):(0.7) w vectors nohead lw 1.6 lc rgb ORANGE, \
     $ours using 1:(0.15):(0):(0.7) w vectors nohead lw 1.6 lc rgb BLUE
