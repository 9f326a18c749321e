/* canvas.c - see canvas.h */
#include "canvas.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <stb/stb_easy_font.h>
#define STBTT_STATIC
#define STB_TRUETYPE_IMPLEMENTATION
#include <stb/stb_truetype.h>

/* ---- colours ------------------------------------------------------------------------------------------------------ */

color color_hex(unsigned rgb) {
    color c;
    c.r = (float)(rgb >> 16 & 255u) / 255.0f;
    c.g = (float)(rgb >> 8 & 255u) / 255.0f;
    c.b = (float)(rgb & 255u) / 255.0f;
    return c;
}

color color_mix(color a, color b, float t) {
    color c;
    c.r = a.r + (b.r - a.r) * t;
    c.g = a.g + (b.g - a.g) * t;
    c.b = a.b + (b.b - a.b) * t;
    return c;
}

static float encode(float v) {
    v = v > 0.0f ? v < 1.0f ? v : 1.0f : 0.0f;
    return v <= 0.0031308f ? 12.92f * v : 1.055f * powf(v, 1.0f / 2.4f) - 0.055f;
}

color color_encode(color linear) {
    color c;
    c.r = encode(linear.r);
    c.g = encode(linear.g);
    c.b = encode(linear.b);
    return c;
}

static color ramp(const unsigned *stops, int count, float t) {
    t = t > 0.0f ? t < 1.0f ? t : 1.0f : 0.0f;
    float at = t * (float)(count - 1);
    int i = (int)at;
    i = i > count - 2 ? count - 2 : i;
    return color_mix(color_hex(stops[i]), color_hex(stops[i + 1]), at - (float)i);
}

color color_depth(float t) {
    static const unsigned stops[] = {0xf4ecd8, 0xc3d3b9, 0x86b8a9, 0x51979c, 0x33728a, 0x254d73, 0x1f2c52, 0x15142c};
    return ramp(stops, 8, t);
}

color color_difference(float t) {
    static const unsigned stops[] = {0xb5e0ff, 0x5fb0ec, 0x2f7fc0, 0x1d4f7d, 0x1b2b3d, 0x17181b,
                                     0x39251b, 0x74401c, 0xba661e, 0xec9a45, 0xffdcaa};
    return ramp(stops, 11, 0.5f + 0.5f * t);
}

/* ---- text --------------------------------------------------------------------------------------------------------- */

typedef struct font {
    unsigned char *file;
    stbtt_fontinfo info;
} font;

static font fonts[3];

static int load_font(font *f, const char *path) {
    FILE *file = fopen(path, "rb");
    if (!file)
        return 0;
    long size = fseek(file, 0, SEEK_END) == 0 ? ftell(file) : -1;
    rewind(file);
    unsigned char *bytes = size > 0 && size < (1 << 26) ? malloc((size_t)size) : NULL;
    int ok = bytes && fread(bytes, 1, (size_t)size, file) == (size_t)size;
    fclose(file);
    if (ok && stbtt_InitFont(&f->info, bytes, stbtt_GetFontOffsetForIndex(bytes, 0))) {
        f->file = bytes;
        return 1;
    }
    free(bytes);
    return 0;
}

void canvas_load_fonts(void) {
    static const char *const directories[] = {
        "/usr/share/fonts/truetype/dejavu/DejaVuSans",
        "/usr/share/fonts/dejavu-sans-fonts/DejaVuSans",
        "/usr/share/fonts/TTF/DejaVuSans",
        "/usr/share/fonts/dejavu/DejaVuSans",
        "/usr/local/share/fonts/dejavu/DejaVuSans",
        "/opt/homebrew/share/fonts/DejaVuSans",
        "/usr/share/fonts/truetype/liberation/LiberationSans-",
        "/usr/share/fonts/truetype/liberation2/LiberationSans-",
    };
    static const char *const endings[3][2] = {
        {".ttf", "Regular.ttf"}, {"-Bold.ttf", "Bold.ttf"}, {"Mono.ttf", "Regular.ttf"}};
    for (int face = 0; face < 3; ++face)
        for (size_t i = 0; i < sizeof directories / sizeof *directories && !fonts[face].file; ++i)
            for (int k = 0; k < 2 && !fonts[face].file; ++k) {
                char path[256];
                snprintf(path, sizeof path, "%s%s", directories[i], endings[face][k]);
                load_font(fonts + face, path);
            }
}

void canvas_free_fonts(void) {
    for (int i = 0; i < 3; ++i)
        free(fonts[i].file);
    memset(fonts, 0, sizeof fonts);
}

/* The next code point; anything malformed counts as one Latin-1 character. */
static int next_code(const char **text) {
    const unsigned char *s = (const unsigned char *)*text;
    int extra = s[0] >= 0xf0 ? 3 : s[0] >= 0xe0 ? 2 : s[0] >= 0xc0 ? 1 : 0;
    int code = extra == 3 ? s[0] & 7 : extra == 2 ? s[0] & 15 : extra ? s[0] & 31 : s[0];
    for (int i = 1; i <= extra; ++i) {
        if ((s[i] & 0xc0) != 0x80) {
            *text += 1;
            return s[0];
        }
        code = code << 6 | (s[i] & 63);
    }
    *text += 1 + extra;
    return code;
}

/* For the fallback: ASCII for the few other characters that our captions use. */
static void to_ascii(const char *utf8, char *out, size_t size) {
    size_t n = 0;
    while (*utf8 && n + 1 < size) {
        int code = next_code(&utf8);
        out[n++] = (char)(code < 127 ? code : code == 0xd7 ? 'x' : code == 0x2212 || code == 0x2013 ? '-' : ' ');
    }
    out[n] = 0;
}

static const font *font_of(canvas_face face) {
    return fonts[face].file ? fonts + face : fonts[CANVAS_REGULAR].file ? fonts + CANVAS_REGULAR : NULL;
}

#define EASY_FONT_HEIGHT 9.0f /* of its capitals, which are about 0.73 em */

float canvas_text_width(canvas_face face, float size_px, const char *utf8) {
    const font *f = font_of(face);
    if (!f) {
        char ascii[512];
        to_ascii(utf8, ascii, sizeof ascii);
        return (float)stb_easy_font_width(ascii) * size_px * 0.73f / EASY_FONT_HEIGHT;
    }
    float scale = stbtt_ScaleForMappingEmToPixels(&f->info, size_px), width = 0.0f;
    while (*utf8) {
        int advance, bearing;
        stbtt_GetCodepointHMetrics(&f->info, next_code(&utf8), &advance, &bearing);
        width += scale * (float)advance;
    }
    return width;
}

static void blend(image *canvas, int x, int y, color c, float alpha) {
    if (x < 0 || y < 0 || x >= canvas->width || y >= canvas->height)
        return;
    float *p = canvas->data + 3 * ((size_t)y * (size_t)canvas->width + (size_t)x);
    p[0] += (c.r - p[0]) * alpha;
    p[1] += (c.g - p[1]) * alpha;
    p[2] += (c.b - p[2]) * alpha;
}

static void easy_text(image *canvas, float x, float baseline, float size_px, color c, const char *utf8) {
    static char quads[64000]; /* four vertices of x, y, z and a colour: 16 bytes each */
    char ascii[512];
    float scale = size_px * 0.73f / EASY_FONT_HEIGHT;
    to_ascii(utf8, ascii, sizeof ascii);
    int count = stb_easy_font_print(0.0f, 0.0f, ascii, NULL, quads, sizeof quads);
    for (int q = 0; q < count; ++q) {
        float a[2], b[2];
        memcpy(a, quads + 64 * q, sizeof a);
        memcpy(b, quads + 64 * q + 32, sizeof b);
        int x0 = (int)floorf(x + a[0] * scale + 0.5f), x1 = (int)floorf(x + b[0] * scale + 0.5f);
        int y0 = (int)floorf(baseline + (a[1] - 7.0f) * scale + 0.5f);
        int y1 = (int)floorf(baseline + (b[1] - 7.0f) * scale + 0.5f);
        canvas_fill(canvas, x0, y0, x1 > x0 ? x1 - x0 : 1, y1 > y0 ? y1 - y0 : 1, c);
    }
}

void canvas_text(image *canvas, float x, float baseline, canvas_align align, canvas_face face, float size_px, color c,
                 const char *utf8) {
    const font *f = font_of(face);
    if (align != CANVAS_LEFT)
        x -= canvas_text_width(face, size_px, utf8) * (align == CANVAS_CENTER ? 0.5f : 1.0f);
    if (!f) {
        easy_text(canvas, x, baseline, size_px, c, utf8);
        return;
    }
    float scale = stbtt_ScaleForMappingEmToPixels(&f->info, size_px);
    while (*utf8) {
        int code = next_code(&utf8), advance, bearing, width, height, dx, dy;
        float whole = floorf(x);
        stbtt_GetCodepointHMetrics(&f->info, code, &advance, &bearing);
        unsigned char *glyph =
            stbtt_GetCodepointBitmapSubpixel(&f->info, scale, scale, x - whole, 0.0f, code, &width, &height, &dx, &dy);
        for (int i = 0; glyph && i < width * height; ++i)
            blend(canvas, (int)whole + dx + i % width, (int)baseline + dy + i / width, c, (float)glyph[i] / 255.0f);
        stbtt_FreeBitmap(glyph, NULL);
        x += scale * (float)advance;
    }
}

/* ---- areas -------------------------------------------------------------------------------------------------------- */

void canvas_fill(image *canvas, int x, int y, int width, int height, color c) {
    for (int j = y; j < y + height; ++j)
        for (int i = x; i < x + width; ++i)
            blend(canvas, i, j, c, 1.0f);
}

void canvas_draw(image *canvas, int x, int y, const image *picture) {
    for (int j = 0; j < picture->height; ++j)
        for (int i = 0; i < picture->width; ++i) {
            const float *p = picture->data + 3 * ((size_t)j * (size_t)picture->width + (size_t)i);
            color c;
            c.r = p[0];
            c.g = p[1];
            c.b = p[2];
            blend(canvas, x + i, y + j, c, 1.0f);
        }
}
