#!/usr/bin/env bash
# Builds gtao.h and gtso.h in every language standard, with every compiler, for every target, at every optimisation level, as one
# implementation used by two translation units and as GTAO_STATIC copies in each; warnings are errors; what can run here
# runs. Also prints how long the implementation takes to compile. Writes the Test Anything Protocol.
set -u
export LC_ALL=C

out=build/strict
rm -rf "$out"
mkdir -p "$out"
warnings="-Wall -Wextra -Wpedantic -Wshadow -Wundef -Wconversion -Wsign-conversion -Wdouble-promotion -Werror -I."

# compiler|flags|run or link
builds=()
for standard in c99 c11 c17; do
    builds+=("gcc|-std=$standard -O1|run" "clang|-std=$standard -O1|run")
done
for standard in c++11 c++14 c++17 c++20; do
    builds+=("g++|-std=$standard -O1|run" "clang++|-std=$standard -O1|run")
done
for level in -O0 -Og -O2 -O3 "-O3 -march=native" "-Os" "-O2 -DNDEBUG -fno-math-errno"; do
    for compiler in "gcc|-std=c99" "clang|-std=c99" "g++|-std=c++17" "clang++|-std=c++17"; do
        builds+=("$compiler $level|run")
    done
done
for compiler in "gcc|-std=c99" "clang|-std=c99" "g++|-std=c++11" "clang++|-std=c++11"; do
    builds+=("$compiler -O1 -DGTAO_STATIC -DGTAO_IMPLEMENTATION -DGTSO_IMPLEMENTATION|run")
done
builds+=("gcc|-std=c99 -O2 -flto|run" "gcc|-std=gnu17 -O2 -fsanitize=undefined|run")
for level in -O0 -O2 "-O3 -msse2 -mfpmath=sse"; do
    builds+=("i686-linux-gnu-gcc|-std=c99 $level -static|run")
done
builds+=("clang|--target=i686-linux-gnu -std=c99 -O2 -static|run")
for level in -O0 -Og -O2 -O3; do
    builds+=("aarch64-linux-gnu-gcc|-std=c99 $level|link")
done
builds+=("clang|--target=aarch64-linux-gnu -std=c99 -O2|link")

check() { # number build
    local compiler flags how language= units="tests/strict/use.c tests/strict/second.c" log=$out/$1.log
    IFS='|' read -r compiler flags how <<<"$2"
    [[ $compiler = *++ ]] && language="-x c++"
    [[ $flags = *GTAO_STATIC* ]] || units+=" tests/strict/impl.c"
    # shellcheck disable=SC2086 # flags and units are words
    if { $compiler $flags $warnings $language $units -o "$out/$1" -lm && { [ "$how" = link ] || "$out/$1"; }; } \
        >"$log" 2>&1; then
        echo "ok $1 - $compiler $flags" >"$out/$1.tap"
    else
        { echo "not ok $1 - $compiler $flags"; sed 's/^/# /' "$log" | head -n 30; } >"$out/$1.tap"
    fi
    rm -f "$out/$1"
}

# The benches, which no test builds: only that they still compile.
benches=$((${#builds[@]} + 1))
check_benches() {
    local file bad=
    for file in tests/bench/*.c tests/bench/rivals/*.c; do
        # shellcheck disable=SC2086 # warnings are words
        gcc -std=c99 -D_POSIX_C_SOURCE=200809L $warnings -Iexamples/common -fsyntax-only "$file" >>"$out/$benches.log" 2>&1 || bad=1
    done
    if [ ! "$bad" ]; then
        echo "ok $benches - tests/bench compiles" >"$out/$benches.tap"
    else
        { echo "not ok $benches - tests/bench compiles"; sed 's/^/# /' "$out/$benches.log" | head -n 30; } >"$out/$benches.tap"
    fi
}

echo "1..$benches"
for i in "${!builds[@]}"; do
    while [ "$(jobs -rp | wc -l)" -ge "$(nproc)" ]; do wait -n; done
    check $((i + 1)) "${builds[$i]}" &
done
wait
check_benches
for i in "${!builds[@]}" "${#builds[@]}"; do cat "$out/$((i + 1)).tap"; done

# Processor time, so that what else runs does not count.
TIMEFORMAT=%U
for compiler in gcc clang; do
    seconds=$({ time "$compiler" -std=c99 -O2 -I. -c tests/strict/impl.c -o "$out/time.o"; } 2>&1)
    echo "# note: $compiler -O2 compiles the implementation in $seconds s"
done
! grep -q '^not ok' "$out"/*.tap
