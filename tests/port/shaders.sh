#!/bin/sh
# shaders.sh DIRECTORY: how far each shader is from the C in single and half precision, a table into
# DIRECTORY/shaders.md. Needs build/ao, build/diff, build/port, a Vulkan driver and tests/data.
set -eu
export LC_ALL=C.UTF-8
out=$1
work=$out/shaders-work
rm -rf "$work"
mkdir -p "$work"
focal=$(sed -n 's/.*"focal_px": \([0-9.]*\).*/\1/p' tests/data/courtyard.json)

# A frame with spherical harmonics and specular; and the second of two at half resolution, filtered, the camera moving.
build/ao --depth tests/data/courtyard.exr --focal "$focal" --radius 1.5 --slices 2 --steps 12 --falloff 0.25 \
    --dump "$work/one" -o "$work/v.exr"
for k in 0 1; do ln -s "$PWD/tests/data/courtyard.exr" "$work/depth.$k.exr"; done
printf '1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0.03 0 1 0 -0.01 0 0 1 -0.05\n' > "$work/camera.txt"
build/ao --sequence "$work/depth.%d.exr" --camera "$work/camera.txt" --focal "$focal" --radius 1.5 --slices 1 --steps 8 \
    --half --dump "$work/two" -o "$work/v.%d.exr"

for precision in single half; do
    [ $precision = half ] && shaders=build/shaders/half || shaders=build/shaders
    for frame in one two; do
        build/port --from "$work/$frame" --dump "$work/$frame-$precision" --isolated --shaders "$shaders"
    done
    {
        build/diff "$work/one" "$work/one-$precision" | grep -E '^(surface|horizons|raw|sh|multi_bounce|specular)\.' || true
        build/diff "$work/two/0001" "$work/two-$precision/0001" | grep -E '^(reduce|spatial1|temporal|result)\.' || true
    } | awk -v precision=$precision '
        { split($1, name, "."); stage = name[1] }
        $1 == "temporal.length" { stage = "temporal, length" }
        stage == "specular" { stage = "specular, roughness 0." name[3] }
        !(stage in most) { order[++n] = stage; most[stage] = rmse[stage] = high[stage] = 0 }
        { if ($2 + 0 > most[stage]) most[stage] = $2 + 0
          if ($3 + 0 > rmse[stage]) rmse[stage] = $3 + 0
          if ($7 + 0 > high[stage]) high[stage] = $7 + 0 }
        END { for (i = 1; i <= n; ++i) { s = order[i]; printf "%s|%.1e|%.1e|%.1e\n", s, rmse[s], high[s], most[s] } }
    ' > "$work/$precision.txt"
done
{
    echo '| stage | single: RMSE | 99.9 % | largest | half: RMSE | 99.9 % | largest |'
    echo '|---|--:|--:|--:|--:|--:|--:|'
    paste -d '|' "$work/single.txt" "$work/half.txt" | awk -F '|' '
        function number(x) { return x + 0 == 0 ? "0" : x }
        { printf "| %s | %s | %s | %s | %s | %s | %s |\n", $1, number($2), number($3), number($4), number($6),
              number($7), number($8) }'
} > "$out/shaders.md"
rm -rf "$work"
