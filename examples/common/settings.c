#include "settings.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char blanks[] = " \t\r\n";

char *settings_read(const char *path) {
    FILE *file = fopen(path, "rb");
    char *text = NULL;
    size_t size = 0, room = 0, n = 1;
    while (file && n > 0) {
        if (size + 65536 > room) {
            char *more = realloc(text, room = 2 * room + 131072);
            if (!more)
                break;
            text = more;
        }
        n = fread(text + size, 1, 65535, file);
        size += n;
    }
    if (file)
        fclose(file);
    if (text)
        text[size] = 0;
    return text;
}

const char *settings_value(const char *json, const char *key, size_t length) {
    for (const char *at = json; (at = strchr(at, '"')) != NULL;) {
        const char *end = strchr(at + 1, '"'), *colon;
        if (!end)
            return NULL;
        colon = end + 1 + strspn(end + 1, blanks);
        if (*colon == ':' && (size_t)(end - at - 1) == length && memcmp(at + 1, key, length) == 0)
            return colon + 1 + strspn(colon + 1, blanks);
        at = end + 1;
    }
    return NULL;
}

/* The number at *text, which then is behind it and any comma; 0 if there is none or, within an array, no more. */
static int next_number(const char **text, int array, double *value) {
    char *end;
    *text += strspn(*text, blanks);
    *value = strtod(*text, &end);
    if (end == *text)
        return 0;
    *text = end + strspn(end, blanks);
    *text += array && **text == ',';
    return 1;
}

int settings_floats(const char *json, const char *key, float *values, int most) {
    const char *at = settings_value(json, key, strlen(key));
    int count = 0, array = at && *at == '[';
    double value;
    for (at += array; at && (count == 0 || array) && next_number(&at, array, &value); ++count)
        if (count < most)
            values[count] = (float)value;
    return count;
}

double settings_number(const char *json, const char *key, double otherwise) {
    const char *at = settings_value(json, key, strlen(key));
    double value;
    return at && next_number(&at, 0, &value) ? value : otherwise;
}

int settings_same(const char *a, const char *b, double allowed) {
    int array = *a == '[';
    if (array != (*b == '['))
        return 0;
    a += array;
    b += array;
    do {
        double x, y;
        int more = next_number(&a, array, &x);
        if (more != next_number(&b, array, &y))
            return 0;
        if (!more)
            break;
        if (!(fabs(x - y) <= allowed * fmax(1.0, fabs(x))))
            return 0;
    } while (array);
    return 1;
}
