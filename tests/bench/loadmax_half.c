#define LOADMAX_HALF
#define loadmax loadmax_half
#define loadmax_open loadmax_half_open
#define loadmax_close loadmax_half_close
#define loadmax_run loadmax_half_run
#define loadmax_sum loadmax_half_sum
#define loadmax_samples loadmax_half_samples
#define loadmax_isa loadmax_half_isa
#include "loadmax.c"
