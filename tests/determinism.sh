#!/usr/bin/env bash
# The same bits from every compiler, optimisation level, machine and kernel: builds tests/unit/golden.c in many ways and
# compares what each prints with tests/data/golden.txt. Writes the Test Anything Protocol.
#
#   tests/determinism.sh            compare
#   tests/determinism.sh --write    write tests/data/golden.txt
set -u
export LC_ALL=C

golden=tests/data/golden.txt
out=build/golden
mkdir -p "$out"
# gnu99, not c99: there gcc contracts unless told otherwise.
base="-std=gnu99 -I."

if [ "${1-}" = --write ]; then
    # shellcheck disable=SC2086 # flags are words
    gcc $base -O2 tests/unit/golden.c -o "$out/write" -lm && "$out/write" >"$golden" && cat "$golden"
    exit
fi

# name:compiler and flags:what runs it. The header must guard itself against contraction, so only one build of each
# compiler is told -ffp-contract=off.
builds=()
for cc in gcc clang; do
    for flags in -O0 -Og -O2 -O3 "-O3 -march=native" "-O3 -march=native -std=c99 -ffp-contract=off"; do
        builds+=("$cc $flags:$cc $flags:")
    done
done
builds+=("gcc gnu17 -O2 -flto:gcc -std=gnu17 -O2 -flto:")
builds+=("gcc i686 x87 -O2:i686-linux-gnu-gcc -static -O2:")
builds+=("gcc i686 sse2 -O0:i686-linux-gnu-gcc -static -O0 -msse2 -mfpmath=sse:")
builds+=("gcc i686 sse2 -O3:i686-linux-gnu-gcc -static -O3 -msse2 -mfpmath=sse:")
builds+=("clang i686 -O2:clang --target=i686-linux-gnu -static -O2:")
builds+=("gcc aarch64 -O0:aarch64-linux-gnu-gcc -static -O0:qemu-aarch64")
builds+=("gcc aarch64 -O3:aarch64-linux-gnu-gcc -static -O3:qemu-aarch64")
builds+=("clang aarch64 -O2:clang --target=aarch64-linux-gnu -static -O2:qemu-aarch64")

check() { # number build
    local name compiler runner log=$out/$1.log
    IFS=: read -r name compiler runner <<<"$2"
    # shellcheck disable=SC2086 # flags are words
    if { ${compiler%% *} $base ${compiler#* } tests/unit/golden.c -o "$out/$1" -lm && $runner "$out/$1" "$golden"; } \
        >"$log" 2>&1; then
        echo "ok $1 - $name: $(tail -n 1 "$log")" >"$out/$1.tap"
    else
        { echo "not ok $1 - $name"; sed 's/^/# /' "$log" | head -n 50; } >"$out/$1.tap"
    fi
}

echo "1..${#builds[@]}"
rm -f "$out"/*.tap
for i in "${!builds[@]}"; do
    while [ "$(jobs -rp | wc -l)" -ge "$(nproc)" ]; do wait -n; done
    check $((i + 1)) "${builds[$i]}" &
done
wait
for i in "${!builds[@]}"; do cat "$out/$((i + 1)).tap"; done
! grep -q '^not ok' "$out"/*.tap
