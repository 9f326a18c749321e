#!/usr/bin/env bash
# Builds the fuzz target and runs it for a while; ends with 'N passed, N failed'.
#
#   tests/fuzz/fuzz.sh SECONDS
#
# What it finds is kept in build/fuzz/; replay one with build/fuzz/replay FILE.
set -u

seconds=${1:-60}
out=build/fuzz
mkdir -p "$out/corpus"
flags=(-std=c99 -I. -g -O1 -fno-sanitize-recover=all)

clang "${flags[@]}" -fsanitize=fuzzer,address,undefined,float-cast-overflow tests/fuzz/fuzz_compute.c \
    -o "$out/fuzz_compute" -lm &&
    gcc "${flags[@]}" -fsanitize=address,undefined,float-cast-overflow -DFUZZ_STANDALONE tests/fuzz/fuzz_compute.c \
        -o "$out/replay" -lm || { echo "0 passed, 1 failed"; exit 1; }

passed=0 failed=0
count() { if "$@"; then passed=$((passed + 1)); else failed=$((failed + 1)); fi; }

# The same seed and an empty corpus every time would only repeat itself: the corpus is kept in build/.
count "$out/fuzz_compute" -max_total_time="$seconds" -max_len=1024 -timeout=20 -print_final_stats=1 \
    -verbosity=0 -artifact_prefix="$out/" "$out/corpus"
count "$out/replay" 2000
count "$out/replay" tests/fuzz/found/*.bin # what was found before and must stay fixed
echo "$passed passed, $failed failed"
[ "$failed" = 0 ]
