/* cli.h - what the command-line programs share: numbers from text, time, medians. */
#ifndef EXAMPLES_CLI_H
#define EXAMPLES_CLI_H

/* The whole text must be the number; false otherwise and for NaN. Infinity is spelled inf. */
int cli_number(const char *text, double *value);
int cli_integer(const char *text, long lowest, long highest, long *value);
/* "a,b,c": at least `lowest` and at most `highest` numbers that fit a float; how many, or 0. */
int cli_numbers(const char *text, int lowest, int highest, float *values);
/* Index of `text` in `names`, which a null ends; or -1. */
int cli_choice(const char *text, const char *const *names);
/* "1280x720", each within the bounds. */
int cli_size(const char *text, long lowest, long highest, int *width, int *height);

int cli_processors(void);

double cli_seconds(void);                     /* monotonic */
double cli_median(double *values, int count); /* sorts them */

#endif
