#!/usr/bin/env bash
# Instructions per pixel of five standard settings (tests/unit/work.c, the AVX2 kernel), counted by callgrind, beside
# the record in tests/bench/instructions.txt: fails where one has grown by more than 3 %. Writes the Test Anything
# Protocol.
#
#   tests/instructions.sh            compare
#   tests/instructions.sh --write    write the record, on purpose
#
# Counts depend on the compiler, so the record names the one that it holds for; with others the tests are skipped.
set -u
export LC_ALL=C

record=tests/bench/instructions.txt
out=build/instructions
settings=5
mkdir -p "$out"

compiler="gcc $(gcc -dumpfullversion 2>/dev/null) $(gcc -dumpmachine 2>/dev/null)"
reason=
command -v valgrind >/dev/null || reason="valgrind is not installed"
grep -qw avx2 /proc/cpuinfo || reason="no AVX2 here"
if [ "${1-}" != --write ] && [ "$(head -n 1 "$record")" != "# $compiler" ]; then
    reason="recorded for $(head -n 1 "$record" | cut -c3-), not for $compiler"
fi
[ "${1-}" = --write ] || echo "1..$settings"
if [ -n "$reason" ]; then
    for n in $(seq $settings); do echo "ok $n # SKIP $reason"; done
    [ "${1-}" = --write ] && exit 1
    exit 0
fi

gcc -std=gnu99 -O2 -I. tests/unit/work.c -o "$out/work" -lm || exit 1

# count N: "INSTRUCTIONS-PER-PIXEL NAME"
count() {
    local pixels name total
    valgrind --tool=callgrind --toggle-collect=gtao_compute --callgrind-out-file="$out/$1.out" "$out/work" "$1" \
        >"$out/$1.name" 2>"$out/$1.log"
    read -r pixels name <"$out/$1.name"
    total=$(awk '/^summary:/ { print $2 }' "$out/$1.out")
    awk -v t="${total:-0}" -v p="${pixels:-1}" -v n="$name" 'BEGIN { printf "%.2f %s\n", t / p, n }'
}

if [ "${1-}" = --write ]; then
    {
        echo "# $compiler"
        echo "# instructions per pixel, setting"
        for n in $(seq 0 $((settings - 1))); do count "$n"; done
    } >"$out/record" && mv "$out/record" "$record" && cat "$record"
    exit
fi

failed=0
for n in $(seq 0 $((settings - 1))); do
    read -r before name < <(grep -v '^#' "$record" | sed -n "$((n + 1))p")
    read -r now _ < <(count "$n")
    verdict=$(awk -v a="$before" -v b="$now" 'BEGIN { print (b > 0 && b <= 1.03 * a) ? "ok" : "not ok" }')
    [ "$verdict" = ok ] || failed=1
    echo "$verdict $((n + 1)) - $name: $now instructions per pixel, recorded $before"
    awk -v a="$before" -v b="$now" 'BEGIN { exit !(b < 0.97 * a) }' &&
        echo "# note: $name: fewer than recorded ($now, $before): make instructions-record"
done
exit $failed
