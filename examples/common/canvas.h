/* canvas.h - drawing for pictures of results: text, boxes, pictures, colour maps. A canvas is an image of 3 channels,
 * display-encoded in [0, 1]. Coordinates in pixels, y down; text is placed by its baseline. */
#ifndef EXAMPLES_CANVAS_H
#define EXAMPLES_CANVAS_H

#include "image.h"

typedef struct color {
    float r, g, b;
} color;

color color_hex(unsigned rgb); /* 0xrrggbb */
color color_mix(color a, color b, float t);
color color_encode(color linear); /* to sRGB */

/* Depth: t = 0 near (light) .. 1 far (dark). Difference: t = -1 (blue) .. 0 (dark) .. 1 (orange). Both perceptually even
 * in lightness. */
color color_depth(float t);
color color_difference(float t);

typedef enum canvas_face { CANVAS_REGULAR, CANVAS_BOLD, CANVAS_MONO } canvas_face;
typedef enum canvas_align { CANVAS_LEFT, CANVAS_CENTER, CANVAS_RIGHT } canvas_align;

/* Looks for an outline font once; without one, text falls back to stb_easy_font's strokes. Free at the end. */
void canvas_load_fonts(void);
void canvas_free_fonts(void);

void canvas_fill(image *canvas, int x, int y, int width, int height, color c);
void canvas_draw(image *canvas, int x, int y, const image *picture); /* 3 channels */
float canvas_text_width(canvas_face face, float size_px, const char *utf8);
void canvas_text(image *canvas, float x, float baseline, canvas_align align, canvas_face face, float size_px, color c,
                 const char *utf8);

#endif
