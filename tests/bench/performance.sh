#!/bin/sh
# performance.sh [--quick] [docs]: what the time is made of, how it grows, what skips and effort save, into
# build/bench/tables/; with `docs` also into docs/performance.md, docs/tuning.md and docs/figures/.
set -eu
export LC_ALL=C.UTF-8
out=build/bench/tables
quick=
[ "${1-}" != --quick ] || { quick=--quick; shift; }
mkdir -p $out

tests/bench/inside.sh $out
build/bench_growth $quick $out
build/bench_memory $quick $out
build/bench-run $quick --only skips
build/bench_effort $quick > build/bench/effort.txt
cp build/bench/effort.txt $out/effort.md
gnuplot tests/bench/growth.gp > build/bench/bench_growth.svg

awk -F, 'NR > 1 {
    if (!($2 in known)) { known[$2] = 1; set[++m] = $2 }
    if (!($1 in seen)) { seen[$1] = 1; scene[++n] = $1 }
    if (n == 1 && m == 1) what[++k] = $3
    ns[$1, $2, $3] = $4; f[$1, $2, $3] = $5; e[$1, $3] = $9 > e[$1, $3] ? $9 : e[$1, $3]; sky[$1] = $6 > sky[$1] ? $6 : sky[$1]
    if ($3 == "all" && $10 > 0) { open[$1] = $7; samples[$1] = $8; memo[$1] = $10 }
} END {
    for (q = 1; q <= m; q++) {
        printf "| %s |", set[q]; for (i = 1; i <= k; i++) printf " %s |", what[i] == "none" ? "no skip" : what[i]; print ""
        printf "|---|"; for (i = 1; i <= k; i++) printf "--:|"; print ""
        for (s = 1; s <= n; s++) {
            printf "| %s |", scene[s]
            for (i = 1; i <= k; i++) printf (i == 1 ? " %.1f ns |" : " %.1f ns (%.2f) |"), ns[scene[s], set[q], what[i]], f[scene[s], set[q], what[i]]
            print ""
        }
        print ""
    }
    print "| scene | sky blocks | open pixels | samples left out of the others | times the transcription | largest error at tolerance 0.001 | 0.01 |"
    print "|---|--:|--:|--:|--:|--:|--:|"
    for (s = 1; s <= n; s++) printf "| %s | %.0f %% | %.0f %% | %.0f %% | %.0f | %.5f | %.4f |\n", scene[s], 100 * sky[scene[s]], 100 * open[scene[s]], 100 * samples[scene[s]], memo[scene[s]], e[scene[s], "tolerance 0.001"], e[scene[s], "tolerance 0.01"]
}' build/bench/skips.csv > $out/skips.md

awk -F, 'NR > 1 {
    key = $1 " (" $2 "x" $3 ")"; if (!(key in seen)) { seen[key] = 1; scene[++n] = key }
    i = $4 ~ /every/; none[key, i] = $5; all[key, i] = $6
    if (!i) { sky[key] = $7; blocks[key] = $8; open[key] = $9 } else samples[key] = $10
} END {
    print "| scene | sky | of it in blocks left out | open pixels | samples left out, every pixel | 1 x 8: no skip | all skips | times as fast | 1 x every pixel: no skip | all skips | times as fast |"
    print "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
    for (s = 1; s <= n; s++) {
        k = scene[s]
        printf "| %s | %.0f %% | %.0f %% | %.0f %% | %.0f %% |", k, 100 * sky[k], 100 * blocks[k], 100 * open[k], 100 * samples[k]
        for (i = 0; i < 2; i++) printf " %.1f ns | %.1f ns | %.2f |", none[k, i], all[k, i], none[k, i] / all[k, i]
        print ""
    }
}' build/bench/skips_scenes.csv > $out/skips-scenes.md

# The best that a time allows: of the settings on the front (docs/benchmark.md), of presets of effort (above). The front
# is that of the last full make bench.
awk -F' *[|] *' '
    FILENAME ~ /benchmark/ { if (/^<!-- begin: front/) on = 1; if (/^<!-- end/) on = 0
        if (on && $2 ~ /^[0-9]+x/) { set[++n] = $2; ns[n] = $3; e[n] = $4 } next }
    /^\| (none|0\.[0-9]+)/ && NF > 10 && $3 !~ /[(]/ { target[++m] = $2; ens[m] = $6; ee[m] = $3 }
    END {
        print "| ns a pixel | 1920x1080, one thread | uniform: slices x samples a side | RMSE | by need: error_target | RMSE |"
        print "|--:|--:|---|--:|---|--:|"
        split("11 15 20 30 40 60 100 150 200 400 800 1500", budget, " ")
        for (b = 1; b in budget; b++) {
            i = j = 0
            for (k = 1; k <= n; k++) if (ns[k] + 0 <= budget[b] && (!i || e[k] < e[i])) i = k
            for (k = 1; k <= m; k++) if (ens[k] + 0 <= budget[b] && (!j || ee[k] < ee[j])) j = k
            split(set[i], part, "x"); name = part[1] " x " (part[2] == "all" ? "every pixel" : part[2])
            need = j ? (target[j] ~ /none/ ? "1 (sharing alone)" : target[j]) : ""
            if (ens[m] + 0 > 0 && budget[b] > 2 * ens[m]) need = ""
            printf "| %d | %.0f ms | %s | %s | %s | %s |\n", budget[b], budget[b] * 1920 * 1080 / 1e6, name, e[i], need, need == "" ? "" : ee[j]
        }
    }' docs/benchmark.md $out/effort.md > $out/budget.md

[ "${1-}" = docs ] || exit 0
cp build/bench/bench_growth.svg docs/figures/
exec tests/bench/insert.sh $out docs/performance.md docs/tuning.md
