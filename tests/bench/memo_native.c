/* The straight transcription of [J19] again, with the bench's flags (-O3 -march=native): what timings are compared with.
 * The bench's archive comes before the references', so its programs link this one. */
#include "tests/reference/memo.c"
