# Visibility of a wall behind a thin bar and behind an animal, along the middle row.
FIG_WIDTH = 980; FIG_HEIGHT = 460
load "docs/figures/style.inc"
set datafile separator ","
FILE = "build/bench/thickness_profile.csv"
wall(study, name) = sprintf("< awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) if ($i == \"%s\") c = i } $1 == \"%s\" { print $4 ? $3 \",\" $c : \"\" }' %s", name, study, FILE)
METHODS = "height_field constant estimate back_faces layers rays"
array LABEL[6] = ["height field", "constant thickness, R / 5", "estimated thickness", "back faces", "four layers", "ray tracing"]
array COLOUR[6] = [GREY, ORANGE, GREEN, PURPLE, BLUE, INK]
array WIDTH[6] = [2, 2, 2.5, 2, 3.5, 1.2]
set multiplot
set bmargin at screen 0.27; set tmargin at screen 0.92
set yrange [0.2:1.03]
set xlabel "position on the wall (the radius is 2)"
unset key
set lmargin at screen 0.065; set rmargin at screen 0.49
set title "behind a thin bar" offset 0,-0.5
set ylabel "visibility"
set xrange [-2.7:2.7]
plot for [k = 1:6] wall("bar", word(METHODS, k)) u 1:2 w l lw WIDTH[k] lc rgb COLOUR[k]
set title "behind an elephant" offset 0,-0.5
unset ylabel
set lmargin at screen 0.555; set rmargin at screen 0.98
set xrange [-2.7:2.7]
set key Left reverse at screen 0.08,0.135 left top maxrows 2 samplen 3 spacing 1.2 width 2
plot for [k = 1:6] wall("elephant", word(METHODS, k)) u 1:2 w l lw WIDTH[k] lc rgb COLOUR[k] title LABEL[k]
unset multiplot
