/* Error against time, for every method and setting on every scene: build/bench/error.csv, build/bench/crops.png. */
#ifndef BENCH_QUALITY_H
#define BENCH_QUALITY_H

#include <stdbool.h>

/* Prints progress; prints the reason and returns false on failure. */
bool quality_run(bool quick);

#endif
