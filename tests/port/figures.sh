#!/bin/sh
# figures.sh [DOCS]: the tables and the picture of docs/porting.md, into build/port-docs and, with DOCS, into that
# directory. Reads tests/data; needs build/ao, build/diff, build/replay, build/mesh_to_map,
# build/port and a Vulkan driver.
set -eu
export LC_ALL=C.UTF-8
out=build/port-docs
rm -rf "$out"
mkdir -p "$out"

# dump DIRECTORY SCENE OPTION...: the scene's camera from its JSON.
dump() {
    dir=$1 scene=$2
    shift 2
    matrix=$(sed -n '/world_to_view/,$p' "tests/data/$scene.json" | grep -Eo -- '-?[0-9]+\.[0-9]+(e-?[0-9]+)?' |
        head -9 | paste -sd,)
    focal=$(sed -n 's/.*"focal_px": \([0-9.]*\).*/\1/p' "tests/data/$scene.json")
    build/ao --depth "tests/data/$scene.exr:ViewLayer.Depth.Z" --normal "tests/data/$scene.exr:ViewLayer.Normal" \
        --normal-axes +x-y-z --normal-to-view "$matrix" --focal "$focal" "$@" --dump "$dir" -o "$out/visibility.exr"
}

# What may be rounded: one table of each scene, and their mean is left to the reader.
for scene in study courtyard; do
    dump "$out/$scene" $scene --radius 1 --preset high
    build/replay "$out/$scene" --rough > "$out/rough-$scene.md"
done

# Every mistake. One slice and the filter, as consoles run it.
dump "$out/full" courtyard --radius 1.5 --slices 1 --steps 12 --denoise 1
dump "$out/half" courtyard --radius 1.5 --slices 1 --steps 12 --denoise 1 --half
build/replay "$out/full" --half "$out/half" --sheet "$out/mistakes.png"
{
    echo '| | mistake | found in | largest difference there | what it is |'
    echo '|--:|---|---|--:|---|'
    build/replay x --list | while read -r number name stage half text; do
        from=full
        [ "$half" = 0 ] || from=half
        rm -rf "$out/mistake"
        build/replay "$out/$from" -o "$out/mistake" --mistake "$name"
        build/diff "$out/$from" "$out/mistake" --partial --quiet --tolerance 3e-4 --tolerance surface=1e-5 --outliers 0.004 \
            --tolerance packed=0.5 --tolerance specular=0.01 > "$out/diff.txt" || true
        found=$(sed -n 's/^first difference: //p' "$out/diff.txt")
        most=$(awk -v name="$found" '$1 == name { print $2 }' "$out/diff.txt")
        [ "${found%%.*}" = "$stage" ] || { echo "figures.sh: $name found in $found, not $stage" >&2; exit 1; }
        echo "| $number | $name | $found | $most | $text |"
    done
} > "$out/mistakes.md"
rm -rf "$out/mistake"

# The time of a dump of 1440x1440, as many pixels as 1920x1080.
build/mesh_to_map --size 1440 --height "$out/large.exr" --normal "$out/normal.exr" > /dev/null
start=$(date +%s%N)
build/ao --depth "$out/large.exr" --normal "$out/normal.exr" --depth-kind height --ortho 0.001 --radius 0.05 \
    --dump "$out/large" -o "$out/visibility.exr"
end=$(date +%s%N)
echo "1440x1440, as many pixels as 1920x1080, two slices: $(((end - start) / 1000000)) ms on two cores for reading," \
    "computing and writing $(du -sm "$out/large" | cut -f1) MB." > "$out/dump-time.md"
rm -rf "$out/large" "$out/large.exr" "$out/normal.exr"

tests/port/shaders.sh "$out"

if [ $# -gt 0 ]; then
    cp "$out/mistakes.png" "$1/figures/mistakes.png"
    tests/bench/insert.sh "$out" "$1/porting.md"
fi
cat "$out/dump-time.md"
