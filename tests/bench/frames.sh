#!/bin/sh
# frames.sh [--quick] [docs]: what frames cost and how good they are, into build/bench/tables/; with `docs` also into
# docs/frames.md and docs/viewer.md.
set -eu
export LC_ALL=C.UTF-8
out=build/bench/tables
quick=
[ "${1-}" != --quick ] || { quick=--quick; shift; }
mkdir -p $out build/bench/sequence

# Where and when: processor time hardly suffers from other work on the machine, frames per second do.
awk -F': *' '/^model name/ { n++; cpu = $2 } END { printf "%s, %d processors", cpu, n }' /proc/cpuinfo > $out/frames-host.md
awk '{ printf "; other work kept %.1f of them busy when this began.\n", $1 }' /proc/loadavg >> $out/frames-host.md
build/bench_frames $quick $out
build/viewer --benchmark --threads 2 ${quick:+--frames 5} > $out/viewer.md
[ -n "$quick" ] || build/sequence build/bench/sequence > $out/sequence.md

[ "${1-}" = docs ] || exit 0
exec tests/bench/insert.sh $out docs/frames.md docs/viewer.md
