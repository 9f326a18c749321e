#!/bin/sh
# pick.sh SCENE TRUTH OUTPUT FAMILY [front]: time, RMSE and setting from build/bench/error.csv, by time; `front` leaves
# out what something faster beats.
awk -F, -v scene="$1" -v truth="$2" -v output="$3" -v family="$4" '
    $1 == scene && $8 == truth && $9 == output && $2 == family { print $7, $10, $3 }' build/bench/error.csv |
    sort -g | if [ "${5-}" = front ]; then awk 'NR == 1 || $2 < least { least = $2; print }'; else cat; fi
