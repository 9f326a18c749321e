#!/usr/bin/env bash
# inside.sh DIRECTORY: in which parts of gtao.h the instructions of the five settings of tests/unit/work.c (AVX2) are,
# counted by callgrind, told apart by the names of the functions, also of those that were inlined: DIRECTORY/inside.md.
# Where there is no valgrind or no AVX2 that says so.
set -eu
export LC_ALL=C
dir=$1
out=build/instructions
mkdir -p "$out" "$dir"
if ! command -v valgrind >/dev/null || ! grep -qw avx2 /proc/cpuinfo; then
    echo 'Not measured: no valgrind, or no AVX2.' >"$dir/inside.md"
    exit
fi
gcc -std=gnu99 -O2 -g -no-pie -I. tests/unit/work.c -o "$out/work-lines" -lm

for n in 0 1 2 3 4; do
    valgrind --tool=callgrind --dump-instr=yes --dump-line=no --compress-pos=no --compress-strings=no \
        --toggle-collect=gtao_compute --callgrind-out-file="$out/lines.$n" "$out/work-lines" "$n" \
        >"$out/lines.$n.name" 2>/dev/null
    # Own costs by address; what follows a line calls= is the callee's.
    awk '/^ob=/ { own = /work-lines/; if (!own) file = $0 }
        /^calls=/ { skip = 1; next }
        /^0x/ { if (!skip) { if (own) cost[$1] += $2; else other += $2 } skip = 0 }
        END { for (a in cost) print a, cost[a]; print "other", other + 0 }' "$out/lines.$n" >"$out/lines.$n.cost"
    # The part of each address: of the functions that it is inlined into, the innermost that belongs to one.
    grep '^0x' "$out/lines.$n.cost" | cut -d' ' -f1 | addr2line -a -i -f -e "$out/work-lines" |
        awk 'function part(f) {
                if (f ~ /cell|look|open|range|block_leave/) return "skips"
                if (f ~ /march|visit|take|rise|fade|between|arc_|arcs|sector/) return "march: samples"
                if (f ~ /search|count_samples|rows_over|reach|interior|remap/) return "march: which samples"
                if (f ~ /integrate|finish|kappa|bent|harmonic|_sh/) return "integration"
                if (f ~ /slice|frame|direction/) return "slice set-up"
                if (f ~ /setup|normal|face|gradient|class$|radius/) return "pixel set-up"
                if (f ~ /store/) return "output"
                if (f ~ /prepare|height|pad_row|border|fill_sky|clear/) return "prepare"
                if (f ~ /begin|fill_|sample_offsets|plan|noise|sincospi|_pow|resolve|check/) return "begin"
                return ""
            }
            /^0x/ { at = $1; sub(/^0x0*/, "0x", at); name[at] = ""; odd = 0; next }
            { odd = !odd } odd && name[at] == "" && /^gtaoi?_/ { sub(/_(scalar|sse2|avx2|avx512)$/, ""); name[at] = part($0) }
            END { for (a in name) print a, name[a] == "" ? "rest" : name[a] }' >"$out/lines.$n.names"
    awk -v n="$n" 'FNR == NR { at = $1; sub(/^[^ ]* /, ""); name[at] = $0; next }
        { f = $1 in name ? name[$1] : "rest"; sum[f] += $2 } END { for (f in sum) print n "," f "," sum[f] }' \
        "$out/lines.$n.names" "$out/lines.$n.cost"
done >"$out/lines"

for n in 0 1 2 3 4; do cut -d' ' -f2- "$out/lines.$n.name"; done >"$out/lines.settings"
read -r pixels _ <"$out/lines.0.name"
awk -F, -v pixels="$pixels" 'FILENAME ~ /settings$/ { set[m++] = $0; next }
    { c[$1, $2] = $3 / pixels; sum[$1] += $3 / pixels }
    END {
        k = split("begin;prepare;skips;pixel set-up;slice set-up;march: which samples;march: samples;integration;output;rest", part, ";")
        printf "| instructions a pixel |"; for (n = 0; n < m; n++) printf " %s |", set[n]
        printf "\n|---|"; for (n = 0; n < m; n++) printf "--:|"; print ""
        for (i = 1; i <= k; i++) {
            printf "| %s |", part[i]
            for (n = 0; n < m; n++) { v = c[n, part[i]]; total[n] += v; printf " %.1f (%.0f %%) |", v, 100 * v / sum[n] }
            print ""
        }
        printf "| all |"; for (n = 0; n < m; n++) printf " %.0f |", total[n]; print ""
    }' "$out/lines.settings" "$out/lines" >"$dir/inside.md"
