#!/usr/bin/env bash
# Golden hashes and random inputs under MemorySanitizer (clang): nothing that was never written decides a result.
# Writes the Test Anything Protocol.
set -u

out=build/fuzz
mkdir -p "$out"
flags=(-std=c99 -I. -g -O1 -fsanitize=memory -fsanitize-memory-track-origins -fno-sanitize-recover=all)
number=0 failed=0

check() { # name source-and-flags -- arguments
    local name=$1 source=()
    shift
    while [ "$1" != -- ]; do
        source+=("$1")
        shift
    done
    shift
    number=$((number + 1))
    if { clang "${flags[@]}" "${source[@]}" -o "$out/msan$number" -lm && "$out/msan$number" "$@"; } >"$out/msan.log" 2>&1
    then
        echo "ok $number - $name"
    else
        failed=1
        echo "not ok $number - $name"
        sed 's/^/# /' "$out/msan.log" | head -n 60
    fi
}

echo "1..2"
check "golden hashes" tests/unit/golden.c -- tests/data/golden.txt
check "random inputs" -DFUZZ_STANDALONE tests/fuzz/fuzz_compute.c -- 1000
[ "$failed" = 0 ]
