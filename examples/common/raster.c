/* raster.c - see raster.h */
#include "raster.h"

#include "exr_chunk.h"

#include <errno.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#ifdef __has_include
#if __has_include(<png.h>)
#define RASTER_HAS_PNG 1
#include <png.h>
#endif
#if __has_include(<tiffio.h>)
#define RASTER_HAS_TIFF 1
#include <tiffio.h>
#endif
#endif
#ifndef RASTER_HAS_PNG
#define RASTER_HAS_PNG 0
#endif
#ifndef RASTER_HAS_TIFF
#define RASTER_HAS_TIFF 0
#endif

/* ---- helpers ----------------------------------------------------------------------------------------------------- */

static int ends_with(const char *text, const char *ending) {
    size_t length = strlen(text), n = strlen(ending);
    return length > n && strcasecmp(text + length - n, ending) == 0;
}

raster_format raster_format_of(const char *path) {
    if (ends_with(path, ".exr"))
        return RASTER_EXR;
    if (ends_with(path, ".pfm"))
        return RASTER_PFM;
    if (ends_with(path, ".png"))
        return RASTER_PNG;
    if (ends_with(path, ".tif") || ends_with(path, ".tiff"))
        return RASTER_TIFF;
    return ends_with(path, ".raw") || ends_with(path, ".f32") ? RASTER_RAW : RASTER_UNKNOWN;
}

static int little_endian(void) {
    const uint16_t one = 1;
    uint8_t low_byte;
    memcpy(&low_byte, &one, 1);
    return low_byte == 1;
}

static void swap_floats(float *values, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        uint32_t v;
        memcpy(&v, values + i, 4);
        v = v >> 24 | (v >> 8 & 0xff00u) | (v << 8 & 0xff0000u) | v << 24;
        memcpy(values + i, &v, 4);
    }
}

static int size_ok(double width, double height, double limit) {
    return width >= 1.0 && height >= 1.0 && width <= limit && height <= limit;
}

/* ---- reading: what the formats share ----------------------------------------------------------------------------- */

struct raster_reader {
    raster_format format;
    char path[4096];
    raster_info info;
    int stored_channels; /* in the file, of which `first` .. first + info.channels - 1 are handed out */
    int first, next_row;
    FILE *file;        /* PFM, raw, PNG */
    long long data_at; /* PFM, raw: where the rows begin */
    int swap, bottom_up;
    float *line; /* one stored row, or a row of tiles */
    image_stream *stream;
#if RASTER_HAS_PNG
    png_structp png;
    png_infop png_info;
    png_bytep png_line;
    png_bytep png_whole; /* interlaced: all rows at once */
    size_t png_row;
    int bit_depth;
#endif
#if RASTER_HAS_TIFF
    TIFF *tiff;
    uint8_t *tiff_line; /* one scanline, or one tile */
    uint32_t tile_width, tile_height;
    int sample_format, sample_bytes;
    char tiff_message[200];
#endif
};

static int open_file(raster_reader *r, image_error *error) {
    struct stat info;
    r->file = fopen(r->path, "rb");
    if (!r->file)
        return image_fail(error, r->path, "%s", strerror(errno));
    if (fstat(fileno(r->file), &info) != 0 || !S_ISREG(info.st_mode))
        return image_fail(error, r->path, "not a regular file");
    return 1;
}

static long long file_size(FILE *file) {
    struct stat info;
    return fstat(fileno(file), &info) == 0 ? (long long)info.st_size : -1;
}

static int make_line(raster_reader *r, size_t floats, image_error *error) {
    r->line = malloc((floats + 1) * sizeof(float));
    return r->line ? 1 : image_fail(error, r->path, "not enough memory");
}

/* ---- reading: PFM, raw ------------------------------------------------------------------------------------------- */

/* Rows lie at data_at, one after the other. */
static int open_rows(raster_reader *r, image_error *error) {
    size_t row = (size_t)r->info.width * (size_t)r->stored_channels;
    double need = (double)r->data_at + 4.0 * (double)row * r->info.height, have = (double)file_size(r->file);
    if (have < need)
        return image_fail(error, r->path, "truncated: %.0f bytes, %.0f expected", have, need);
    if (r->format == RASTER_RAW && have > need)
        return image_fail(error, r->path, "%.0f bytes, but %d x %d floats are %.0f", have, r->info.width,
                          r->info.height, need);
    return make_line(r, row, error);
}

static int open_pfm(raster_reader *r, const char *selection, image_error *error) {
    image_pfm header;
    if (!open_file(r, error) || !image_pfm_header(r->file, r->path, RASTER_MAX_SIZE, &header, error))
        return 0;
    r->stored_channels = header.channels;
    r->swap = header.little != little_endian();
    r->bottom_up = 1;
    r->data_at = ftell(r->file);
    r->info.width = header.width;
    r->info.height = header.height;
    if (r->info.channels == 3 && (r->stored_channels != 3 || selection))
        return image_fail(error, r->path, "three channels (PF) and no layer are expected");
    if (r->info.channels == 1 && r->stored_channels == 3) {
        static const char names[] = "RGBrgbXYZxyz";
        const char *at = selection && selection[0] && !selection[1] ? strchr(names, selection[0]) : NULL;
        if (!at)
            return image_fail(error, r->path, "three channels (PF), choose with FILE:R, FILE:G or FILE:B");
        r->first = (int)(at - names) % 3;
    } else if (selection && r->info.channels == 1 && strcasecmp(selection, "Y") != 0 &&
               strcasecmp(selection, "Z") != 0) {
        return image_fail(error, r->path, "no channel %s in a PFM with one channel", selection);
    }
    return open_rows(r, error);
}

static int open_raw(raster_reader *r, int width, int height, image_error *error) {
    if (!size_ok(width, height, RASTER_MAX_SIZE))
        return image_fail(error, r->path, "the size of a raw file must be given, 1..%d", RASTER_MAX_SIZE);
    r->info.width = width;
    r->info.height = height;
    r->stored_channels = r->info.channels;
    r->swap = !little_endian();
    return open_file(r, error) && open_rows(r, error);
}

static int read_rows(raster_reader *r, float *to, image_error *error) {
    size_t row = (size_t)r->info.width * (size_t)r->stored_channels;
    int y = r->bottom_up ? r->info.height - 1 - r->next_row : r->next_row;
    if (fseeko(r->file, (off_t)(r->data_at + 4ll * (long long)row * y), SEEK_SET) != 0 ||
        fread(r->line, 4, row, r->file) != row)
        return image_fail(error, r->path, ferror(r->file) && errno ? strerror(errno) : "truncated");
    if (r->swap)
        swap_floats(r->line, row);
    for (int x = 0; x < r->info.width; ++x)
        for (int c = 0; c < r->info.channels; ++c)
            *to++ = r->line[(size_t)x * (size_t)r->stored_channels + (size_t)(r->first + c)];
    return 1;
}

/* ---- reading: PNG ------------------------------------------------------------------------------------------------ */

#if RASTER_HAS_PNG

static void png_failed(png_structp png, png_const_charp message) {
    raster_reader *r = png_get_error_ptr(png);
    (void)r;
    (void)message;
    png_longjmp(png, 1);
}

static void png_ignored(png_structp png, png_const_charp message) {
    (void)png;
    (void)message;
}

/* Whatever setjmp's return might spoil lies in *r. */
static int open_png(raster_reader *r, image_error *error) {
    unsigned char magic[8];
    if (!open_file(r, error))
        return 0;
    if (fread(magic, 1, 8, r->file) != 8 || png_sig_cmp(magic, 0, 8) != 0)
        return image_fail(error, r->path, "not a PNG file");
    r->png = png_create_read_struct(PNG_LIBPNG_VER_STRING, r, png_failed, png_ignored);
    r->png_info = r->png ? png_create_info_struct(r->png) : NULL;
    if (!r->png_info)
        return image_fail(error, r->path, "not enough memory");
    if (setjmp(png_jmpbuf(r->png)))
        return image_fail(error, r->path, "corrupt PNG header, or width and height not 1..%d", IMAGE_MAX_SIZE);
    png_init_io(r->png, r->file);
    png_set_sig_bytes(r->png, 8);
    png_set_user_limits(r->png, IMAGE_MAX_SIZE, IMAGE_MAX_SIZE);
    png_read_info(r->png, r->png_info);
    int colour = png_get_color_type(r->png, r->png_info);
    r->bit_depth = png_get_bit_depth(r->png, r->png_info) == 16 ? 16 : 8;
    png_set_expand(r->png);
    png_set_strip_alpha(r->png);
    int interlaced = png_set_interlace_handling(r->png) > 1;
    png_read_update_info(r->png, r->png_info);
    r->stored_channels = png_get_channels(r->png, r->png_info);
    r->png_row = png_get_rowbytes(r->png, r->png_info);
    r->info.width = (int)png_get_image_width(r->png, r->png_info);
    r->info.height = (int)png_get_image_height(r->png, r->png_info);
    r->info.full_scale = r->bit_depth == 16 ? 65535.0 : 255.0;
    if (r->info.channels == 3 && r->stored_channels != 3)
        return image_fail(error, r->path, "a grey PNG, three channels are expected");
    if (r->info.channels == 1 && (colour & PNG_COLOR_MASK_PALETTE))
        return image_fail(error, r->path, "a PNG with a palette, grey is expected");
    r->png_line = malloc(r->png_row + 1);
    if (r->png_line && interlaced)
        r->png_whole = malloc(r->png_row * (size_t)r->info.height);
    return r->png_line && (!interlaced || r->png_whole) ? 1 : image_fail(error, r->path, "not enough memory");
}

/* Nothing that is live across setjmp changes. */
static int next_png_line(raster_reader *r, image_error *error) {
    if (setjmp(png_jmpbuf(r->png)))
        return image_fail(error, r->path, "corrupt or truncated PNG file");
    if (!r->png_whole)
        png_read_row(r->png, r->png_line, NULL);
    for (int pass = 0; r->png_whole && r->next_row == 0 && pass < 7; ++pass)
        for (int y = 0; y < r->info.height; ++y)
            png_read_row(r->png, r->png_whole + r->png_row * (size_t)y, NULL);
    if (r->next_row + 1 == r->info.height)
        png_read_end(r->png, NULL); /* the checksum of the last rows */
    return 1;
}

static int read_png(raster_reader *r, float *to, image_error *error) {
    if (!next_png_line(r, error))
        return 0;
    const png_byte *line = r->png_whole ? r->png_whole + r->png_row * (size_t)r->next_row : r->png_line;
    for (int x = 0; x < r->info.width; ++x)
        for (int c = 0; c < r->info.channels; ++c) {
            size_t i = (size_t)x * (size_t)r->stored_channels + (size_t)c;
            *to++ = r->bit_depth == 16 ? (float)(line[2 * i] << 8 | line[2 * i + 1]) : (float)line[i];
        }
    return 1;
}

#endif

/* ---- reading: TIFF ----------------------------------------------------------------------------------------------- */

#if RASTER_HAS_TIFF

enum {
    TAG_PIXEL_SCALE = 33550,
    TAG_TIE_POINTS = 33922,
    TAG_TRANSFORMATION = 34264,
    TAG_GEO_KEYS = 34735,
    TAG_GEO_NUMBERS = 34736,
    TAG_GEO_TEXTS = 34737,
    TAG_GDAL_NO_DATA = 42113
};

static int tiff_failed(TIFF *tiff, void *user, const char *module, const char *format, va_list args) {
    char *message = user;
    (void)tiff;
    (void)module;
    if (message && !message[0])
        vsnprintf(message, 200, format, args);
    return 1;
}

static int tiff_warned(TIFF *tiff, void *user, const char *module, const char *format, va_list args) {
    (void)tiff;
    (void)user;
    (void)module;
    (void)format;
    (void)args;
    return 1;
}

static TIFF *tiff_open(const char *path, const char *mode, char *message) {
    TIFFOpenOptions *options = TIFFOpenOptionsAlloc();
    if (!options)
        return NULL;
    TIFFOpenOptionsSetErrorHandlerExtR(options, tiff_failed, message);
    TIFFOpenOptionsSetWarningHandlerExtR(options, tiff_warned, NULL);
    TIFF *tiff = TIFFOpenExt(path, mode, options);
    TIFFOpenOptionsFree(options);
    return tiff;
}

/* Tags that libtiff does not know come as a count and an array. Null unless it is there and of this type. */
static const void *tiff_tag(TIFF *tiff, uint32_t tag, TIFFDataType type, uint32_t *count) {
    void *data = NULL;
    const TIFFField *field = TIFFFindField(tiff, tag, TIFF_ANY);
    *count = 0;
    if (!field || TIFFFieldDataType(field) != type || !TIFFFieldPassCount(field) ||
        TIFFFieldReadCount(field) != TIFF_VARIABLE2 || !TIFFGetField(tiff, tag, count, &data))
        return NULL;
    return *count > 0 ? data : NULL;
}

static void tiff_geography(raster_reader *r) {
    uint32_t count = 0;
    raster_info *info = &r->info;
    const void *data = tiff_tag(r->tiff, TAG_PIXEL_SCALE, TIFF_DOUBLE, &count);
    if (data && count >= 2) {
        double scale[2];
        memcpy(scale, data, sizeof scale);
        if (isfinite(scale[0]) && isfinite(scale[1]) && scale[0] > 0.0 && scale[1] > 0.0) {
            info->pixel_x = scale[0];
            info->pixel_y = scale[1];
        }
    }
    data = tiff_tag(r->tiff, TAG_GEO_KEYS, TIFF_SHORT, &count);
    if (data && count >= 4) {
        const uint16_t *keys = data;
        info->georeferenced = 1;
        for (uint32_t i = 4; i + 3 < count; i += 4)
            if (keys[i] == 1024) /* GTModelTypeGeoKey: 2 is geographic, degrees */
                info->geographic = keys[i + 3] == 2;
    }
    data = tiff_tag(r->tiff, TAG_GDAL_NO_DATA, TIFF_ASCII, &count);
    if (data) {
        char text[64], *end;
        size_t n = count < sizeof text ? count : sizeof text - 1;
        memcpy(text, data, n);
        text[n] = 0;
        info->no_data = strtod(text, &end);
        info->has_no_data = end != text;
    }
}

static int open_tiff(raster_reader *r, image_error *error) {
    uint32_t width = 0, height = 0;
    uint16_t bits = 1, samples = 1, format = SAMPLEFORMAT_UINT, planar = PLANARCONFIG_CONTIG, photometric = 0;
    if (!open_file(r, error)) /* for the system's own words on why not */
        return 0;
    fclose(r->file);
    r->file = NULL;
    r->tiff = tiff_open(r->path, "r", r->tiff_message);
    if (!r->tiff)
        return image_fail(error, r->path, "not a TIFF file, or its header is corrupt");
    TIFFGetField(r->tiff, TIFFTAG_IMAGEWIDTH, &width);
    TIFFGetField(r->tiff, TIFFTAG_IMAGELENGTH, &height);
    TIFFGetFieldDefaulted(r->tiff, TIFFTAG_BITSPERSAMPLE, &bits);
    TIFFGetFieldDefaulted(r->tiff, TIFFTAG_SAMPLESPERPIXEL, &samples);
    TIFFGetFieldDefaulted(r->tiff, TIFFTAG_SAMPLEFORMAT, &format);
    TIFFGetFieldDefaulted(r->tiff, TIFFTAG_PLANARCONFIG, &planar);
    TIFFGetField(r->tiff, TIFFTAG_PHOTOMETRIC, &photometric);
    if (!size_ok(width, height, RASTER_MAX_SIZE))
        return image_fail(error, r->path, "%lu x %lu: width and height must be 1..%d", (unsigned long)width,
                          (unsigned long)height, RASTER_MAX_SIZE);
    int known = format == SAMPLEFORMAT_IEEEFP ? bits == 32 || bits == 64
                                              : (format == SAMPLEFORMAT_UINT || format == SAMPLEFORMAT_INT) &&
                                                    (bits == 8 || bits == 16 || bits == 32);
    if (!known || photometric == PHOTOMETRIC_PALETTE)
        return image_fail(error, r->path, "samples of %d bits (format %d) are not supported", bits, format);
    if (samples < r->info.channels || (samples > 1 && planar != PLANARCONFIG_CONTIG))
        return image_fail(error, r->path, "%d %s channel(s), %d expected", samples,
                          planar == PLANARCONFIG_CONTIG ? "interleaved" : "separate", r->info.channels);
    r->info.width = (int)width;
    r->info.height = (int)height;
    r->stored_channels = samples;
    r->sample_format = format;
    r->sample_bytes = bits / 8;
    if (format != SAMPLEFORMAT_IEEEFP)
        r->info.full_scale = ldexp(1.0, format == SAMPLEFORMAT_INT ? bits - 1 : bits) - 1.0;
    tiff_geography(r);
    size_t bytes, floats = (size_t)width * (size_t)r->info.channels;
    if (TIFFIsTiled(r->tiff)) {
        TIFFGetField(r->tiff, TIFFTAG_TILEWIDTH, &r->tile_width);
        TIFFGetField(r->tiff, TIFFTAG_TILELENGTH, &r->tile_height);
        if (!size_ok(r->tile_width, r->tile_height, RASTER_MAX_SIZE))
            return image_fail(error, r->path, "corrupt TIFF header (size of the tiles)");
        bytes = (size_t)TIFFTileSize(r->tiff);
        /* what the reader indexes must be what libtiff fills */
        if (bytes / r->tile_width / r->tile_height < (size_t)(samples * r->sample_bytes))
            return image_fail(error, r->path, "corrupt TIFF header (size of the tiles)");
        floats *= r->tile_height < height ? r->tile_height : height;
    } else {
        bytes = (size_t)TIFFScanlineSize(r->tiff);
        if (bytes / width < (size_t)(samples * r->sample_bytes))
            return image_fail(error, r->path, "corrupt TIFF header (size of a row)");
    }
    r->tiff_line = malloc(bytes + 8);
    if (!r->tiff_line)
        return image_fail(error, r->path, "not enough memory");
    return r->tile_width ? make_line(r, floats, error) : 1;
}

static float tiff_sample(const raster_reader *r, const uint8_t *at) {
    union {
        uint16_t u16;
        int16_t i16;
        uint32_t u32;
        int32_t i32;
        float f32;
        double f64;
    } v;
    memcpy(&v, at, (size_t)r->sample_bytes);
    if (r->sample_format == SAMPLEFORMAT_IEEEFP) {
        if (r->sample_bytes == 4)
            return v.f32;
        return (float)v.f64; /* beyond float's range: infinity, which the caller refuses */
    }
    if (r->sample_bytes == 1)
        return r->sample_format == SAMPLEFORMAT_INT ? (float)(int8_t)*at : (float)*at;
    if (r->sample_bytes == 2)
        return r->sample_format == SAMPLEFORMAT_INT ? (float)v.i16 : (float)v.u16;
    return r->sample_format == SAMPLEFORMAT_INT ? (float)v.i32 : (float)v.u32;
}

static int tiff_corrupt(raster_reader *r, image_error *error) {
    return image_fail(error, r->path, "corrupt or truncated TIFF file%s%s%s", r->tiff_message[0] ? " (" : "",
                      r->tiff_message, r->tiff_message[0] ? ")" : "");
}

/* A row of tiles into r->line. */
static int read_tiles(raster_reader *r, image_error *error) {
    uint32_t width = (uint32_t)r->info.width, height = (uint32_t)r->info.height, y0 = (uint32_t)r->next_row;
    size_t pixel = (size_t)(r->stored_channels * r->sample_bytes), channels = (size_t)r->info.channels;
    for (uint32_t x0 = 0; x0 < width; x0 += r->tile_width) {
        if (TIFFReadTile(r->tiff, r->tiff_line, x0, y0, 0, 0) < 0)
            return tiff_corrupt(r, error);
        for (uint32_t y = 0; y < r->tile_height && y0 + y < height; ++y)
            for (uint32_t x = 0; x < r->tile_width && x0 + x < width; ++x)
                for (size_t c = 0; c < channels; ++c)
                    r->line[((size_t)y * width + x0 + x) * channels + c] = tiff_sample(
                        r, r->tiff_line + ((size_t)y * r->tile_width + x) * pixel + c * (size_t)r->sample_bytes);
    }
    return 1;
}

static int read_tiff(raster_reader *r, float *to, image_error *error) {
    size_t row = (size_t)r->info.width * (size_t)r->info.channels;
    if (r->tile_width) {
        size_t y = (size_t)r->next_row % r->tile_height;
        if (y == 0 && !read_tiles(r, error))
            return 0;
        memcpy(to, r->line + y * row, row * sizeof(float));
        return 1;
    }
    if (TIFFReadScanline(r->tiff, r->tiff_line, (uint32_t)r->next_row, 0) < 0)
        return tiff_corrupt(r, error);
    for (int x = 0; x < r->info.width; ++x)
        for (int c = 0; c < r->info.channels; ++c)
            *to++ = tiff_sample(r, r->tiff_line + (size_t)((x * r->stored_channels + c) * r->sample_bytes));
    return 1;
}

#endif

/* ---- reading: the interface -------------------------------------------------------------------------------------- */

static int open_exr(raster_reader *r, const char *spec, image_error *error) {
    image size;
    r->stream = image_stream_open(spec, r->info.channels, &size, error);
    if (!r->stream)
        return 0;
    r->info.width = size.width;
    r->info.height = size.height;
    return 1;
}

raster_reader *raster_open(const char *spec, int channels, int raw_width, int raw_height, raster_info *info,
                           image_error *error) {
    const char *selection = NULL;
    int ok = 0;
    raster_reader *r = calloc(1, sizeof *r);
    if (!r || !image_spec_path(spec, r->path, sizeof r->path)) {
        image_fail(error, spec, r ? "name too long" : "not enough memory");
        free(r);
        return NULL;
    }
    if (strlen(r->path) < strlen(spec))
        selection = spec + strlen(r->path) + 1;
    r->info.channels = channels;
    r->format = raster_format_of(r->path);
    switch (r->format) {
    case RASTER_EXR:
        ok = open_exr(r, spec, error);
        break;
    case RASTER_PFM:
        ok = open_pfm(r, selection, error);
        break;
    case RASTER_RAW:
        ok = open_raw(r, raw_width, raw_height, error);
        break;
    case RASTER_PNG:
#if RASTER_HAS_PNG
        ok = open_png(r, error);
#else
        image_fail(error, r->path, "compiled without libpng, so PNG files cannot be read");
#endif
        break;
    case RASTER_TIFF:
#if RASTER_HAS_TIFF
        ok = open_tiff(r, error);
#else
        image_fail(error, r->path, "compiled without libtiff, so TIFF files cannot be read");
#endif
        break;
    default:
        image_fail(error, r->path, "unknown format, the name must end in .exr, .pfm, .png, .tif, .tiff, .raw or .f32");
    }
    if (!ok) {
        raster_close(r);
        return NULL;
    }
    *info = r->info;
    return r;
}

int raster_read(raster_reader *r, int rows, float *to, image_error *error) {
    size_t row = (size_t)r->info.width * (size_t)r->info.channels;
    for (int i = 0; i < rows; ++i, to += row, ++r->next_row) {
        int ok = r->next_row < r->info.height ? 1 : image_fail(error, r->path, "no more rows");
        switch (ok ? r->format : RASTER_UNKNOWN) {
        case RASTER_EXR:
            ok = image_stream_read(r->stream, 1, to, error);
            break;
        case RASTER_PFM:
        case RASTER_RAW:
            ok = read_rows(r, to, error);
            break;
#if RASTER_HAS_PNG
        case RASTER_PNG:
            ok = read_png(r, to, error);
            break;
#endif
#if RASTER_HAS_TIFF
        case RASTER_TIFF:
            ok = read_tiff(r, to, error);
            break;
#endif
        default:
            ok = 0;
        }
        if (!ok)
            return 0;
    }
    return 1;
}

void raster_close(raster_reader *r) {
    if (!r)
        return;
    image_stream_close(r->stream);
#if RASTER_HAS_PNG
    if (r->png)
        png_destroy_read_struct(&r->png, &r->png_info, NULL);
    free(r->png_line);
    free(r->png_whole);
#endif
#if RASTER_HAS_TIFF
    if (r->tiff)
        TIFFClose(r->tiff);
    free(r->tiff_line);
#endif
    if (r->file)
        fclose(r->file);
    free(r->line);
    free(r);
}

/* ---- writing ----------------------------------------------------------------------------------------------------- */

enum { TILE = 256 };

struct raster_writer {
    raster_format format;
    int width, height, channels, next_row;
    char path[4096];
    image_pending *pending;
    const char *names[RASTER_MAX_CHANNELS];
    image_range range;
    int bits;
    FILE *file;
    long long data_at;
    float *band; /* EXR: the rows of a chunk; TIFF: of a row of tiles */
    int band_rows, band_filled;
    uint8_t *bytes; /* PNG: a row; TIFF: a tile */
    exr_context_t exr;
    exr_encode_pipeline_t pipeline;
    exr_chunk chunk;
    int part, begun;
#if RASTER_HAS_PNG
    png_structp png;
    png_infop png_info;
#endif
#if RASTER_HAS_TIFF
    TIFF *tiff;
    char tiff_message[200];
#endif
};

static int cannot_write(const raster_writer *w, const char *why, image_error *error) {
    return image_fail(error, w->path, "cannot write: %s", why && why[0] ? why : "out of space?");
}

static void exr_silent(exr_const_context_t context, exr_result_t code, const char *message) {
    (void)context;
    (void)code;
    (void)message;
}

static int create_exr(raster_writer *w, image_error *error) {
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    exr_attr_box2i_t window;
    exr_attr_v2f_t center;
    const exr_encode_pipeline_t fresh = EXR_ENCODE_PIPELINE_INITIALIZER;
    w->pipeline = fresh;
    init.error_handler_fn = exr_silent;
    memset(&center, 0, sizeof center);
    memset(&window, 0, sizeof window);
    window.max.x = w->width - 1;
    window.max.y = w->height - 1;
    fclose(w->file); /* the name is ours now; OpenEXR opens it again */
    w->file = NULL;
    exr_result_t result = exr_start_write(&w->exr, w->pending->temporary, EXR_WRITE_FILE_DIRECTLY, &init);
    if (result == EXR_ERR_SUCCESS)
        result = exr_add_part(w->exr, "image", EXR_STORAGE_SCANLINE, &w->part);
    if (result == EXR_ERR_SUCCESS)
        result = exr_initialize_required_attr(w->exr, w->part, &window, &window, 1.0f, &center, 1.0f,
                                              EXR_LINEORDER_INCREASING_Y, EXR_COMPRESSION_ZIP);
    for (int c = 0; result == EXR_ERR_SUCCESS && c < w->channels; ++c)
        result = exr_add_channel(w->exr, w->part, w->names[c], EXR_PIXEL_FLOAT, EXR_PERCEPTUALLY_LINEAR, 1, 1);
    if (result == EXR_ERR_SUCCESS)
        result = exr_write_header(w->exr);
    if (result == EXR_ERR_SUCCESS)
        result = exr_get_scanlines_per_chunk(w->exr, w->part, &w->band_rows);
    return result == EXR_ERR_SUCCESS ? 1 : cannot_write(w, exr_get_default_error_message(result), error);
}

static int flush_exr(raster_writer *w, image_error *error) {
    exr_chunk_info_t chunk;
    exr_result_t result = exr_write_scanline_chunk_info(w->exr, w->part, w->next_row - w->band_filled, &chunk);
    if (result == EXR_ERR_SUCCESS)
        result = w->begun ? exr_encoding_update(w->exr, w->part, &chunk, &w->pipeline)
                          : exr_encoding_initialize(w->exr, w->part, &chunk, &w->pipeline);
    if (result != EXR_ERR_SUCCESS)
        return cannot_write(w, exr_get_default_error_message(result), error);
    int pixel = w->channels * (int)sizeof(float);
    for (int i = 0; i < w->pipeline.channel_count; ++i) {
        exr_coding_channel_info_t *info = w->pipeline.channels + i;
        int c = 0;
        while (c + 1 < w->channels && strcmp(w->names[c], info->channel_name) != 0)
            ++c;
        info->user_data_type = EXR_PIXEL_FLOAT;
        info->user_bytes_per_element = 4;
        info->user_pixel_stride = pixel;
        info->user_line_stride = pixel * w->width;
        info->encode_from_ptr = (const uint8_t *)(w->band + c);
    }
    if (!w->begun)
        result = exr_chunk_routines(w->exr, w->part, &w->pipeline, &w->chunk);
    w->begun = 1;
    if (result == EXR_ERR_SUCCESS)
        result = exr_encoding_run(w->exr, w->part, &w->pipeline);
    w->band_filled = 0;
    return result == EXR_ERR_SUCCESS ? 1 : cannot_write(w, exr_get_default_error_message(result), error);
}

#if RASTER_HAS_PNG

static void png_write_failed(png_structp png, png_const_charp message) {
    (void)message;
    png_longjmp(png, 1);
}

static int create_png(raster_writer *w, image_error *error) {
    w->png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, png_write_failed, png_ignored);
    w->png_info = w->png ? png_create_info_struct(w->png) : NULL;
    w->bytes = malloc((size_t)w->width * (size_t)w->channels * 2);
    if (!w->png_info || !w->bytes)
        return image_fail(error, w->path, "not enough memory");
    if (setjmp(png_jmpbuf(w->png)))
        return cannot_write(w, NULL, error);
    png_init_io(w->png, w->file);
    png_set_IHDR(w->png, w->png_info, (png_uint_32)w->width, (png_uint_32)w->height, w->bits,
                 w->channels == 3 ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_filter(w->png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB); /* fast; trying all of them gains little here */
    png_set_compression_level(w->png, 4);
    png_write_info(w->png, w->png_info);
    return 1;
}

static int write_png_row(raster_writer *w, const float *row, image_error *error) {
    size_t count = (size_t)w->width * (size_t)w->channels;
    if (setjmp(png_jmpbuf(w->png)))
        return cannot_write(w, NULL, error);
    for (size_t i = 0; i < count; ++i) {
        float v = w->range == IMAGE_RANGE_SIGNED ? 0.5f + 0.5f * row[i] : row[i];
        v = v > 0.0f ? v : 0.0f; /* NaN is 0 */
        v = v < 1.0f ? v : 1.0f;
        if (w->bits == 8) {
            w->bytes[i] = (uint8_t)(255.0f * v + 0.5f);
        } else {
            unsigned u = (unsigned)(65535.0f * v + 0.5f);
            w->bytes[2 * i] = (uint8_t)(u >> 8);
            w->bytes[2 * i + 1] = (uint8_t)(u & 255u);
        }
    }
    png_write_row(w->png, w->bytes);
    if (w->next_row + 1 == w->height)
        png_write_end(w->png, NULL);
    return 1;
}

#endif

#if RASTER_HAS_TIFF

static int create_tiff(raster_writer *w, image_error *error) {
    double bytes = 4.0 * w->width * w->height * w->channels;
    fclose(w->file);
    w->file = NULL;
    w->tiff = tiff_open(w->pending->temporary, bytes > 3e9 ? "w8" : "w", w->tiff_message);
    w->bytes = malloc((size_t)TILE * TILE * (size_t)w->channels * sizeof(float));
    w->band_rows = TILE;
    if (!w->tiff || !w->bytes)
        return w->tiff ? image_fail(error, w->path, "not enough memory") : cannot_write(w, w->tiff_message, error);
    TIFFSetField(w->tiff, TIFFTAG_IMAGEWIDTH, (uint32_t)w->width);
    TIFFSetField(w->tiff, TIFFTAG_IMAGELENGTH, (uint32_t)w->height);
    TIFFSetField(w->tiff, TIFFTAG_TILEWIDTH, (uint32_t)TILE);
    TIFFSetField(w->tiff, TIFFTAG_TILELENGTH, (uint32_t)TILE);
    TIFFSetField(w->tiff, TIFFTAG_BITSPERSAMPLE, 32);
    TIFFSetField(w->tiff, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
    TIFFSetField(w->tiff, TIFFTAG_SAMPLESPERPIXEL, w->channels);
    TIFFSetField(w->tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(w->tiff, TIFFTAG_PHOTOMETRIC, w->channels == 3 ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK);
    if (w->channels != 1 && w->channels != 3) {
        uint16_t extra[RASTER_MAX_CHANNELS] = {0}; /* unspecified */
        TIFFSetField(w->tiff, TIFFTAG_EXTRASAMPLES, w->channels - 1, extra);
    }
    return 1;
}

/* Where on the earth it is. */
static int copy_geography(raster_writer *w, const char *from) {
    /* libtiff keeps the pointers to the names, which are not to const */
    static char names[6][24] = {"ModelPixelScale", "ModelTiepoint",   "ModelTransformation",
                                "GeoKeyDirectory", "GeoDoubleParams", "GeoAsciiParams"};
    static const struct {
        uint32_t tag;
        TIFFDataType type;
    } tags[6] = {{TAG_PIXEL_SCALE, TIFF_DOUBLE}, {TAG_TIE_POINTS, TIFF_DOUBLE},  {TAG_TRANSFORMATION, TIFF_DOUBLE},
                 {TAG_GEO_KEYS, TIFF_SHORT},     {TAG_GEO_NUMBERS, TIFF_DOUBLE}, {TAG_GEO_TEXTS, TIFF_ASCII}};
    TIFF *tiff = tiff_open(from, "r", NULL);
    int ok = tiff != NULL;
    for (int i = 0; ok && i < 6; ++i) {
        uint32_t count;
        const void *data = tiff_tag(tiff, tags[i].tag, tags[i].type, &count);
        TIFFFieldInfo info = {tags[i].tag, TIFF_VARIABLE2, TIFF_VARIABLE2, tags[i].type, FIELD_CUSTOM, 1, 1, names[i]};
        if (data)
            ok = TIFFMergeFieldInfo(w->tiff, &info, 1) == 0 && TIFFSetField(w->tiff, tags[i].tag, count, data);
    }
    if (tiff)
        TIFFClose(tiff);
    return ok;
}

static int flush_tiff(raster_writer *w, image_error *error) {
    size_t pixel = (size_t)w->channels * sizeof(float);
    int y0 = w->next_row - w->band_filled;
    for (int x0 = 0; x0 < w->width; x0 += TILE) {
        size_t columns = (size_t)(w->width - x0 < TILE ? w->width - x0 : TILE);
        memset(w->bytes, 0, (size_t)TILE * TILE * pixel);
        for (int y = 0; y < w->band_filled; ++y)
            memcpy(w->bytes + (size_t)y * TILE * pixel,
                   w->band + ((size_t)y * (size_t)w->width + (size_t)x0) * (size_t)w->channels, columns * pixel);
        if (TIFFWriteTile(w->tiff, w->bytes, (uint32_t)x0, (uint32_t)y0, 0, 0) < 0)
            return cannot_write(w, w->tiff_message, error);
    }
    w->band_filled = 0;
    return 1;
}

#endif

static int create_rows(raster_writer *w, image_error *error) {
    if (w->format == RASTER_PFM && fprintf(w->file, "%s\n%d %d\n%s\n", w->channels == 3 ? "PF" : "Pf", w->width,
                                           w->height, little_endian() ? "-1.0" : "1.0") < 0)
        return cannot_write(w, strerror(errno), error);
    w->data_at = ftell(w->file);
    return 1;
}

static int write_row(raster_writer *w, const float *row, image_error *error) {
    size_t floats = (size_t)w->width * (size_t)w->channels, done = 0;
    if (w->format == RASTER_PFM) { /* bottom row first in the file */
        long long y = w->height - 1 - w->next_row;
        if (fseeko(w->file, (off_t)(w->data_at + 4ll * (long long)floats * y), SEEK_SET) == 0)
            done = fwrite(row, 4, floats, w->file);
    } else {
        for (; done < floats; ++done) {
            float v = row[done];
            if (!little_endian())
                swap_floats(&v, 1);
            if (fwrite(&v, 4, 1, w->file) != 1)
                break;
        }
    }
    return done == floats ? 1 : cannot_write(w, strerror(errno), error);
}

raster_writer *raster_writer_create(const char *path, int width, int height, int channels, const char *const *names,
                                    image_range range, int bits, image_pending *pending, image_error *error) {
    raster_format format = raster_format_of(path);
    int ok = 1;
    memset(pending, 0, sizeof *pending);
    if (format == RASTER_UNKNOWN)
        ok =
            image_fail(error, path, "unknown format, the name must end in .exr, .pfm, .png, .tif, .tiff, .raw or .f32");
    else if (strlen(path) >= sizeof((raster_writer *)0)->path)
        ok = image_fail(error, path, "name too long");
    else if ((format == RASTER_PFM || format == RASTER_PNG) && channels != 1 && channels != 3)
        ok = image_fail(error, path, "%d channels do not fit this format", channels);
    else if (channels < 1 || channels > RASTER_MAX_CHANNELS)
        ok = image_fail(error, path, "%d channels, 1..%d are possible", channels, RASTER_MAX_CHANNELS);
    else if (!size_ok(width, height, format == RASTER_EXR || format == RASTER_PNG ? IMAGE_MAX_SIZE : RASTER_MAX_SIZE))
        ok = image_fail(error, path, "%d x %d is too large for this format", width, height);
    raster_writer *w = ok ? calloc(1, sizeof *w) : NULL;
    if (!w) {
        if (ok)
            image_fail(error, path, "not enough memory");
        return NULL;
    }
    snprintf(w->path, sizeof w->path, "%s", path);
    w->format = format;
    w->width = width;
    w->height = height;
    w->channels = channels;
    w->range = range;
    w->bits = bits == 16 ? 16 : 8;
    w->pending = pending;
    for (int c = 0; c < channels; ++c)
        w->names[c] = names ? names[c] : "Y";
    w->file = image_open_pending(path, pending, error);
    ok = w->file != NULL;
    if (ok && format == RASTER_EXR)
        ok = create_exr(w, error);
    else if (ok && format == RASTER_PNG)
#if RASTER_HAS_PNG
        ok = create_png(w, error);
#else
        ok = image_fail(error, path, "compiled without libpng, so PNG files cannot be written");
#endif
    else if (ok && format == RASTER_TIFF)
#if RASTER_HAS_TIFF
        ok = create_tiff(w, error);
#else
        ok = image_fail(error, path, "compiled without libtiff, so TIFF files cannot be written");
#endif
    else if (ok)
        ok = create_rows(w, error);
    if (ok && w->band_rows) {
        w->band = malloc((size_t)w->band_rows * (size_t)width * (size_t)channels * sizeof(float));
        ok = w->band ? 1 : image_fail(error, path, "not enough memory");
    }
    if (ok)
        return w;
    raster_abandon(w);
    return NULL;
}

int raster_place(raster_writer *w, const char *like, image_error *error) {
#if RASTER_HAS_TIFF
    if (w->format == RASTER_TIFF && raster_format_of(like) == RASTER_TIFF && !copy_geography(w, like))
        return image_fail(error, w->path, "cannot take over the georeference of %s", like);
#else
    (void)w, (void)like, (void)error;
#endif
    return 1;
}

int raster_write(raster_writer *w, int rows, const float *from, image_error *error) {
    size_t row = (size_t)w->width * (size_t)w->channels;
    int ok = 1;
    for (int i = 0; ok && i < rows; ++i, from += row) {
        if (w->next_row >= w->height)
            return image_fail(error, w->path, "too many rows");
        if (w->band) {
            memcpy(w->band + row * (size_t)w->band_filled++, from, row * sizeof(float));
            ++w->next_row;
            if (w->band_filled < w->band_rows && w->next_row < w->height)
                continue;
#if RASTER_HAS_TIFF
            if (w->format == RASTER_TIFF)
                ok = flush_tiff(w, error);
#endif
            if (w->format == RASTER_EXR)
                ok = flush_exr(w, error);
            continue;
        }
#if RASTER_HAS_PNG
        if (w->format == RASTER_PNG)
            ok = write_png_row(w, from, error);
#endif
        if (w->format != RASTER_PNG)
            ok = write_row(w, from, error);
        ++w->next_row;
    }
    return ok;
}

/* Closes what is open; false if that failed. */
static int close_writer(raster_writer *w, image_error *error) {
    int ok = 1;
    if (w->exr) {
        exr_encoding_destroy(w->exr, &w->pipeline);
        exr_result_t result = exr_finish(&w->exr);
        ok = result == EXR_ERR_SUCCESS ? 1 : cannot_write(w, exr_get_default_error_message(result), error);
    }
#if RASTER_HAS_PNG
    if (w->png)
        png_destroy_write_struct(&w->png, &w->png_info);
#endif
#if RASTER_HAS_TIFF
    if (w->tiff) {
        w->tiff_message[0] = 0;
        ok = TIFFFlush(w->tiff) ? 1 : cannot_write(w, w->tiff_message, error);
        TIFFClose(w->tiff);
    }
#endif
    if (w->file) {
        errno = 0;
        ok = !ferror(w->file);
        ok = fclose(w->file) == 0 && ok;
        ok = ok ? 1 : cannot_write(w, strerror(errno), error);
    }
    free(w->band);
    free(w->bytes);
    return ok;
}

int raster_finish(raster_writer *w, image_error *error) {
    int complete = w->next_row == w->height;
    int ok = close_writer(w, error);
    if (ok && !complete)
        ok = image_fail(error, w->path, "rows are missing");
    if (!ok)
        image_discard(w->pending);
    free(w);
    return ok;
}

void raster_abandon(raster_writer *w) {
    image_error ignored;
    if (!w)
        return;
    close_writer(w, &ignored);
    image_discard(w->pending);
    free(w);
}
