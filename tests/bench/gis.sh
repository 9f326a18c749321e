#!/usr/bin/env bash
# build/bake beside the sky view factor of SAGA GIS, on one raster, one processor. `make bench-gis`.
#
#   tests/bench/gis.sh [SIZE]     pixels a side (1024)
set -eu
export LC_ALL=C TIMEFORMAT=%U
size=${1:-1024}
out=build/bench/gis
mkdir -p "$out"
build/bake_bench terrain "$size" "$out/dem.sdat"
cp "$out/dem.sdat" "$out/dem.raw"
# SAGA's rows run from the south unless told otherwise.
cat >"$out/dem.sgrd" <<END
NAME = dem
DATAFORMAT = FLOAT
BYTEORDER_BIG = FALSE
POSITION_XMIN = 0.5
POSITION_YMIN = 0.5
CELLCOUNT_X = $size
CELLCOUNT_Y = $size
CELLSIZE = 1.0
Z_FACTOR = 1.0
NODATA_VALUE = -99999.0
TOPTOBOTTOM = TRUE
END

echo "| tool | sectors | radius, pixels | processor seconds | RMSE to build/bake |"
echo "| --- | --- | --- | --- | --- |"
for radius in 32 128 512; do
    bake=$({ time build/bake --height "$out/dem.raw" --raw-size "$size,$size" --pixel-size 1 --directions 16 \
        --radius "$radius" --threads 1 --memory 4G -o "$out/bake.raw" --fresh; } 2>&1)
    saga=$({ time saga_cmd -c=1 ta_lighting 3 -DEM="$out/dem.sgrd" -SVF="$out/svf.sgrd" -VISIBLE="$out/visible.sgrd" \
        -RADIUS="$radius" -NDIRS=32 -METHOD=0 >"$out/saga.log" 2>&1; } 2>&1)
    build/bake_bench rows "$size" "$out/svf.sdat" "$out/svf.raw"
    read -r rmse _ < <(build/bake_bench compare "$out/bake.raw" "$out/svf.raw")
    echo "| build/bake | 32 | $radius | $bake | |"
    echo "| SAGA $(saga_cmd --version 2>/dev/null | sed -n 's/.*Version: *\([0-9.]*\).*/\1/p' | head -n 1) | 32 | $radius | $saga | $rmse |"
done
