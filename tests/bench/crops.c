/* See crops.h. */
#include "crops.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { WIDTH = 160, HEIGHT = 112, GAP = 6, LABEL = 17, TITLE = 22 };

static int left_of(const crops *c, int column) {
    return c->margin + column * (WIDTH + GAP);
}

static int top_of(int row) {
    return TITLE + row * (HEIGHT + LABEL + GAP);
}

static void text(crops *c, int x, int y, canvas_face face, float size, const char *s) {
    canvas_text(&c->page, (float)x, (float)y, CANVAS_LEFT, face, size, color_hex(0x202020), s);
}

bool crops_open(crops *c, int rows, int columns, int margin) {
    image_error error;
    c->margin = margin;
    if (!image_create(&c->page, left_of(c, columns), top_of(rows), 3, &error))
        return false;
    canvas_load_fonts();
    canvas_fill(&c->page, 0, 0, c->page.width, c->page.height, color_hex(0xffffff));
    return true;
}

void crops_title(crops *c, int row, const char *s) {
    text(c, 4, top_of(row) + LABEL + HEIGHT / 2 + 4, CANVAS_BOLD, 13, s);
}

void crops_scene(crops *c, int column, const char *name) {
    text(c, left_of(c, column), 16, CANVAS_BOLD, 13, name);
}

/* The first of `size` pixels about `center`, within `whole`. */
static int begin(double center, int size, int whole) {
    int at = (int)(center * whole) - size / 2;
    at = at < whole - size ? at : whole - size;
    return at > 0 ? at : 0;
}

void crops_draw(crops *c, int row, int column, const crops_column *where, const view *v, const float *from,
                const char *label) {
    int w = v->width < WIDTH ? v->width : WIDTH, h = v->height < HEIGHT ? v->height : HEIGHT;
    int x0 = begin(where->x, w, v->width), y0 = begin(where->y, h, v->height);
    image crop;
    image_error error;
    if (!image_create(&crop, w, h, 3, &error))
        return;
    for (int j = 0; j < h; ++j)
        for (int i = 0; i < 3 * w; ++i) /* 27 levels keep the file small */
            crop.data[3 * j * w + i] =
                roundf(from[(size_t)(y0 + j) * (size_t)v->width + (size_t)(x0 + i / 3)] * 26) / 26;
    canvas_draw(&c->page, left_of(c, column), top_of(row) + LABEL, &crop);
    image_free(&crop);
    text(c, left_of(c, column), top_of(row) + 13, CANVAS_REGULAR, 11.5f, label);
}

bool crops_save(crops *c, const char *path) {
    image grey;
    image_error error;
    image_pending file;
    memset(&file, 0, sizeof file);
    canvas_free_fonts();
    bool ok = image_create(&grey, c->page.width, c->page.height, 1, &error);
    for (size_t i = 0; ok && i < (size_t)grey.width * (size_t)grey.height; ++i)
        grey.data[i] = c->page.data[3 * i];
    ok = ok && image_write(path, &grey, NULL, IMAGE_RANGE_UNIT, &file, &error) && image_commit(&file, &error);
    if (!ok)
        fprintf(stderr, "%s\n", error.text);
    image_discard(&file);
    image_free(&grey);
    image_free(&c->page);
    return ok;
}
