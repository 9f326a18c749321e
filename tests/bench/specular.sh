#!/bin/sh
# specular.sh [--quick | docs]: figures and tables of specular occlusion into build/bench/specular; with `docs` also into
# docs/specular.md and docs/figures.
set -eu
export LC_ALL=C.UTF-8
out=build/bench/specular
mkdir -p $out
quick=
[ "${1-}" = --quick ] && quick="--size 96x60 --rays 6 --cones 1000"

# shellcheck disable=SC2086 # several options
build/bench_shading $quick $out > $out/all.txt
awk -v dir=$out '/^## / { file = dir "/" $2 ".md"; printf "" > file; next } file && (NF || !blank[file]) { print > file; blank[file] = !NF }' $out/all.txt

# What the reference suite measures.
if [ -z "$quick" ]; then
    CMOCKA_MESSAGE_OUTPUT=TAP build/tests/test_specular > $out/suite.txt 2>&1
    sed -n 's/^# note: V_s of cones, \(.*\): mean error \(.*\), max \(.*\)$/| \1 | \2 | \3 |/p' $out/suite.txt |
        { printf '| approximation | mean error of V_s | largest |\n|---|--:|--:|\n'; cat; } > $out/caps.md
    sed -n 's/^# note: \(.*[^ ]\)  *RMSE \(.*\), near silhouettes \(.*\)$/| \1 | \2 | \3 |/p' $out/suite.txt |
        { printf '| V_s by | RMSE | near silhouettes, n·v below 0.35 |\n|---|--:|--:|\n'; cat; } > $out/horizons.md
    sed -n 's/^# note: 16^3, \(.*\) by \(.*\): RMSE \(.*\)$/| \1 | \2 | \3 |/p' $out/suite.txt |
        { printf '| axis | by | RMSE |\n|---|---|--:|\n'; cat; } > $out/scales.md
fi

stats() { # NAME OPTION...
    name=$1
    shift
    build/lut --stats ${quick:+--points 200} "$@" > "$out/$name.md"
}
stats lut-lobe
stats lut-reflection --lobe ggx --frame reflection
stats lut-cone --kind cone
if [ -z "$quick" ]; then
    stats lut-brdf --kind brdf
    stats lut-bent --kind bent --points 5000
fi
{ echo '```'; build/bench_specular ${quick:+--quick}; echo '```'; } > $out/cost.md
build/lut --slices $out/table_lobe.png
build/lut --kind brdf --slices $out/table_brdf.png

[ "${1-}" = docs ] || exit 0
for name in spheres scan table_lobe table_brdf; do cp $out/$name.png docs/figures/specular_$name.png; done
exec tests/bench/insert.sh $out docs/specular.md
