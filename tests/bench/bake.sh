#!/usr/bin/env bash
# The tables of docs/baking.md: tiles against one piece, cost by size, radius and threads, ranks. `make bench-bake`.
#
#   tests/bench/bake.sh [SIZE]     of the terrain, pixels a side (2048)
#
# Times are processor seconds, which a busy machine changes less than the clock. LARGE=1 adds 8192 x 8192 in an address
# space of 512 MiB and sizes up to 16384 x 16384 in one of 1 GiB: some minutes, and 6 GiB of disk.
set -eu
export LC_ALL=C
size=${1:-2048}
out=build/bench/bake
mkdir -p "$out"
bake=build/bake tool=build/bake_bench

map() { [ -s "$out/$1.raw" ] || $tool terrain "$1" "$out/$1.raw"; }
# run NAME SIZE OPTION...: result in $out/NAME.raw, statistics in $out/NAME.json
run() {
    local name=$1 size=$2
    shift 2
    $bake --height "$out/$size.raw" --raw-size "$size,$size" --pixel-size 1 -o "$out/$name.raw" \
        --stats "$out/$name.json" --fresh "$@"
}
stat() { sed -n "s/^ *\"$2\": \([-0-9.e+]*\),*/\1/p" "$out/$1.json"; }
# Nanoseconds of a processor for each pixel, direction and side.
cost() { awk -v s="$(stat "$1" cpu_seconds)" -v n="$2" -v k="$3" 'BEGIN { printf "%.1f", s * 1e9 / (n * n * k * 2) }'; }

echo "## Tiles against one piece: $size x $size, 32 directions, the whole map in reach"
echo
echo "| tile | overlap | RMSE | mean | greatest | bound of a slope | ns per pixel, direction and side | peak memory, MiB |"
echo "| --- | --- | --- | --- | --- | --- | --- | --- |"
map "$size"
run whole "$size" --memory 8G
echo "| one piece | | | | | | $(cost whole "$size" 32) | $(stat whole peak_memory_mib) |"
for tile in $((size / 2)) $((size / 4)); do
    for overlap in 128 256 512; do
        run tiled "$size" --tile "$tile" --overlap "$overlap"
        read -r rmse mean worst < <($tool compare "$out/whole.raw" "$out/tiled.raw")
        echo "| $tile | $overlap | $rmse | $mean | $worst | $(stat tiled far_slope_error_bound) |" \
            "$(cost tiled "$size" 32) | $(stat tiled peak_memory_mib) |"
    done
done

echo
echo "## Cost by size and radius: one piece, 8 directions"
echo
echo "| map | radius, pixels | ns per pixel, direction and side |"
echo "| --- | --- | --- |"
for n in $((size / 4)) $((size / 2)) "$size"; do
    map "$n"
    for radius in 32 128 512 inf; do
        run cost "$n" --directions 8 --memory 8G --radius "$radius"
        echo "| $n x $n | $radius | $(cost cost "$n" 8) |"
    done
done

echo
echo "## Two ranks: $((size / 2)) x $((size / 2)), 8 directions, tiles of $((size / 8))"
echo
if command -v mpirun >/dev/null && [ -x build/bake-mpi ]; then
    export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
    n=$((size / 2))
    map "$n"
    for ranks in 1 2; do
        start=$EPOCHREALTIME
        mpirun --oversubscribe -n "$ranks" build/bake-mpi --height "$out/$n.raw" --raw-size "$n,$n" --pixel-size 1 \
            --directions 8 --tile $((size / 8)) --overlap 128 --fresh -o "$out/ranks$ranks.raw"
        echo "$ranks rank(s): $(((${EPOCHREALTIME/./} - ${start/./}) / 1000)) ms by the clock"
    done
    cmp "$out/ranks1.raw" "$out/ranks2.raw" && echo "the same bits"
else
    echo "no MPI here"
fi

if [ "${LARGE:-}" ]; then
    echo
    echo "## 8192 x 8192, 32 directions, address space of 512 MiB"
    echo
    map 8192
    (ulimit -v 524288 && run large 8192 --memory 480M)
    rm "$out/large.raw"
    echo "tiles of $(stat large tile_width), peak $(stat large peak_memory_mib) MiB, $(stat large cpu_seconds) s of" \
        "processors, $(cost large 8192 32) ns per pixel, direction and side"
fi

if [ "${LARGE:-}" ]; then
    echo
    echo "## Tiles, 4 directions, address space of 1 GiB"
    echo
    echo "| map | tiles | processor seconds | ns per pixel, direction and side | peak memory, MiB |"
    echo "| --- | --- | --- | --- | --- |"
    for n in 2048 4096 8192 16384; do
        map "$n"
        (ulimit -v 1048576 && run size "$n" --memory 960M --tile 2048 --directions 4)
        echo "| $n x $n | $(stat size tiles) | $(stat size cpu_seconds) | $(cost size "$n" 4) |" \
            "$(stat size peak_memory_mib) |"
        rm "$out/size.raw"
        [ "$n" -lt 8192 ] || rm "$out/$n.raw"
    done
fi
