/* cli.c - see cli.h */
#include "cli.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

int cli_number(const char *text, double *value) {
    char *end;
    if (!text[0] || isspace((unsigned char)text[0]))
        return 0;
    *value = strtod(text, &end);
    return end != text && *end == 0 && !isnan(*value);
}

int cli_integer(const char *text, long lowest, long highest, long *value) {
    char *end;
    if (!text[0] || isspace((unsigned char)text[0]))
        return 0;
    errno = 0;
    *value = strtol(text, &end, 10);
    return end != text && *end == 0 && errno == 0 && *value >= lowest && *value <= highest;
}

int cli_numbers(const char *text, int lowest, int highest, float *values) {
    char part[64];
    for (int count = 0; count < highest;) {
        size_t n = strcspn(text, ",");
        double value;
        if (n >= sizeof part)
            return 0;
        memcpy(part, text, n);
        part[n] = 0;
        if (!cli_number(part, &value))
            return 0;
        values[count] = (float)value;
        if (isinf(values[count]) && !isinf(value))
            return 0;
        ++count;
        text += n;
        if (*text == 0)
            return count >= lowest ? count : 0;
        ++text;
    }
    return 0;
}

int cli_size(const char *text, long lowest, long highest, int *width, int *height) {
    char first[16];
    long w, h;
    size_t n = strcspn(text, "x");
    if (text[n] != 'x' || n >= sizeof first)
        return 0;
    memcpy(first, text, n);
    first[n] = 0;
    if (!cli_integer(first, lowest, highest, &w) || !cli_integer(text + n + 1, lowest, highest, &h))
        return 0;
    *width = (int)w;
    *height = (int)h;
    return 1;
}

int cli_choice(const char *text, const char *const *names) {
    for (int i = 0; names[i]; ++i)
        if (strcmp(text, names[i]) == 0)
            return i;
    return -1;
}

int cli_processors(void) {
    long n = sysconf(_SC_NPROCESSORS_ONLN);
    return n < 1 ? 1 : n > 1024 ? 1024 : (int)n;
}

double cli_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static int compare_doubles(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double cli_median(double *values, int count) {
    qsort(values, (size_t)count, sizeof *values, compare_doubles);
    return count % 2 ? values[count / 2] : 0.5 * (values[count / 2 - 1] + values[count / 2]);
}
