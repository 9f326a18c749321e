/* What gtao.h costs: build/bench/speed.csv. */
#ifndef BENCH_SPEED_H
#define BENCH_SPEED_H

#include <stdbool.h>

/* Prints progress and a summary; prints the reason and returns false on failure. */
bool speed_run(bool quick);
/* What skips save: build/bench/skips.csv, skips_scenes.csv. */
bool speed_skips(bool quick);

#endif
