/* A page of grey crops: a column for each scene, a row for each method, a line of text over each crop. */
#ifndef BENCH_CROPS_H
#define BENCH_CROPS_H

#include <stdbool.h>

#include "examples/common/canvas.h"
#include "view.h"

typedef struct crops_column {
    const char *scene;
    double x, y; /* centre of the crop, in parts of the image */
} crops_column;

typedef struct crops {
    image page;
    int margin; /* where the titles of the rows stand */
} crops;

bool crops_open(crops *c, int rows, int columns, int margin);
void crops_title(crops *c, int row, const char *text);
void crops_scene(crops *c, int column, const char *name);
void crops_draw(crops *c, int row, int column, const crops_column *where, const view *v, const float *from,
                const char *label);
bool crops_save(crops *c, const char *path); /* and closes; prints the reason and returns false on failure */

#endif
