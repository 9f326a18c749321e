/* settings.h - reads the settings.json of a dump: one flat object of numbers, strings and arrays of them. */
#ifndef EXAMPLES_SETTINGS_H
#define EXAMPLES_SETTINGS_H

#include <stddef.h>

/* The text of a file, ended by a null; null if it cannot be read. To be freed. */
char *settings_read(const char *path);
/* Where the value of a key of `length` letters begins, or null. */
const char *settings_value(const char *json, const char *key, size_t length);
/* The numbers of a key, at most `most`; how many there are. */
int settings_floats(const char *json, const char *key, float *values, int most);
double settings_number(const char *json, const char *key, double otherwise);
/* Whether two values are the same: numbers within `allowed` times the greater of 1 and the first's size. */
int settings_same(const char *a, const char *b, double allowed);

#endif
