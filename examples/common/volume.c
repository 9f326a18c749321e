/* volume.c - see volume.h */
#include "volume.h"

#include "gtso.h"

#include <ctype.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

typedef struct format_info {
    uint32_t dxgi, vulkan;
    int bytes; /* of a texel, or of a block */
    int block; /* texels a side of a block */
} format_info;

static const format_info formats[VOLUME_FORMAT_COUNT] = {
    {41, 100, 4, 1}, /* R32_FLOAT, R32_SFLOAT */
    {61, 9, 1, 1},   /* R8_UNORM */
    {56, 70, 2, 1},  /* R16_UNORM */
    {80, 139, 8, 4}, /* BC4_UNORM, BC4_UNORM_BLOCK */
};

static int fail(image_error *error, const char *path, const char *format, ...) {
    int n = snprintf(error->text, sizeof error->text, "%s: ", path);
    if (n > 0 && (size_t)n < sizeof error->text) {
        va_list args;
        va_start(args, format);
        vsnprintf(error->text + n, sizeof error->text - (size_t)n, format, args);
        va_end(args);
    }
    return 0;
}

volume_file volume_file_of(const char *path) {
    static const struct {
        const char *ending;
        volume_file file;
    } endings[] = {{".dds", VOLUME_DDS}, {".ktx2", VOLUME_KTX2}, {".c", VOLUME_C},      {".h", VOLUME_C},
                   {".inc", VOLUME_C},   {".exr", VOLUME_IMAGE}, {".pfm", VOLUME_IMAGE}};
    const char *dot = strrchr(path, '.');
    for (size_t i = 0; dot && i < sizeof endings / sizeof *endings; ++i)
        if (strcasecmp(dot, endings[i].ending) == 0)
            return endings[i].file;
    return VOLUME_UNKNOWN;
}

int volume_create(volume *v, int width, int height, int depth) {
    v->width = width, v->height = height, v->depth = depth;
    v->texels = calloc((size_t)width * (size_t)height, (size_t)depth * sizeof(float));
    return v->texels != NULL;
}

void volume_free(volume *v) {
    free(v->texels);
    memset(v, 0, sizeof *v);
}

static size_t volume_count(const volume *v) {
    return (size_t)v->width * (size_t)v->height * (size_t)v->depth;
}

/* ---- texels ------------------------------------------------------------------------------------------------------- */

/* Files are little-endian on every machine. */
static void put16(uint8_t *p, uint32_t x) {
    p[0] = (uint8_t)x, p[1] = (uint8_t)(x >> 8);
}

static void put32(uint8_t *p, uint32_t x) {
    put16(p, x), put16(p + 2, x >> 16);
}

static uint32_t get32(const uint8_t *p) {
    return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

static uint32_t round_unit(float v, uint32_t largest) {
    v = v > 0.0f ? v : 0.0f; /* NaN is 0 */
    v = v < 1.0f ? v : 1.0f;
    return (uint32_t)((double)v * largest + 0.5);
}

size_t volume_bytes(const volume *v, volume_format format) {
    const format_info *f = formats + format;
    int across = (v->width + f->block - 1) / f->block, down = (v->height + f->block - 1) / f->block;
    return (size_t)across * (size_t)down * (size_t)v->depth * (size_t)f->bytes;
}

/* Block (bx, by) of slice z; texels beyond the edge repeat it. */
static float *block_texel(const volume *v, float *texels, int bx, int by, int z, int k) {
    int x = 4 * bx + k % 4, y = 4 * by + k / 4;
    x = x < v->width ? x : v->width - 1;
    y = y < v->height ? y : v->height - 1;
    return texels + ((size_t)z * (size_t)v->height + (size_t)y) * (size_t)v->width + (size_t)x;
}

void *volume_encode(const volume *v, volume_format format) {
    size_t count = volume_count(v);
    uint8_t *bytes = malloc(volume_bytes(v, format)), *p = bytes;
    if (!bytes)
        return NULL;
    if (format == VOLUME_BC4) {
        for (int z = 0; z < v->depth; ++z)
            for (int by = 0; by < (v->height + 3) / 4; ++by)
                for (int bx = 0; bx < (v->width + 3) / 4; ++bx, p += 8) {
                    float block[16];
                    for (int k = 0; k < 16; ++k)
                        block[k] = *block_texel(v, v->texels, bx, by, z, k);
                    gtso_bc4_encode_block(block, p);
                }
        return bytes;
    }
    for (size_t i = 0; i < count; ++i, p += formats[format].bytes) {
        uint32_t bits;
        memcpy(&bits, v->texels + i, sizeof bits);
        if (format == VOLUME_UNORM8)
            *p = (uint8_t)round_unit(v->texels[i], 255);
        else if (format == VOLUME_UNORM16)
            put16(p, round_unit(v->texels[i], 65535));
        else
            put32(p, bits);
    }
    return bytes;
}

static void decode(const volume *v, volume_format format, const uint8_t *p, float *out) {
    size_t count = volume_count(v);
    if (format == VOLUME_BC4) {
        for (int z = 0; z < v->depth; ++z)
            for (int by = 0; by < (v->height + 3) / 4; ++by)
                for (int bx = 0; bx < (v->width + 3) / 4; ++bx, p += 8) {
                    float block[16];
                    gtso_bc4_decode_block(p, block);
                    for (int k = 0; k < 16; ++k)
                        if (4 * bx + k % 4 < v->width && 4 * by + k / 4 < v->height)
                            *block_texel(v, out, bx, by, z, k) = block[k];
                }
        return;
    }
    for (size_t i = 0; i < count; ++i, p += formats[format].bytes) {
        uint32_t bits;
        if (format == VOLUME_UNORM8)
            out[i] = (float)p[0] / 255.0f;
        else if (format == VOLUME_UNORM16)
            out[i] = (float)(p[0] | p[1] << 8) / 65535.0f;
        else
            bits = get32(p), memcpy(out + i, &bits, sizeof bits);
    }
}

int volume_quantise(const volume *v, volume_format format, float *out) {
    void *bytes = volume_encode(v, format);
    if (!bytes)
        return 0;
    decode(v, format, bytes, out);
    free(bytes);
    return 1;
}

/* ---- DDS ---------------------------------------------------------------------------------------------------------- */

enum { DDS_HEADER = 4 + 124 + 20 };

static void dds_header(const volume *v, volume_format format, uint8_t h[DDS_HEADER]) {
    const format_info *f = formats + format;
    int compressed = format == VOLUME_BC4;
    size_t slice = volume_bytes(v, format) / (size_t)v->depth;
    memset(h, 0, DDS_HEADER);
    memcpy(h, "DDS ", 4);
    put32(h + 4, 124);
    /* caps, height, width, pixel format, depth, and the size of the slice (compressed) or of the row */
    put32(h + 8, 0x1u | 0x2u | 0x4u | 0x1000u | 0x800000u | (compressed ? 0x80000u : 0x8u));
    put32(h + 12, (uint32_t)v->height);
    put32(h + 16, (uint32_t)v->width);
    put32(h + 20, compressed ? (uint32_t)slice : (uint32_t)(v->width * f->bytes));
    put32(h + 24, (uint32_t)v->depth);
    put32(h + 28, 1); /* mip levels */
    put32(h + 76, 32);
    put32(h + 80, 0x4u); /* a four-character code: */
    memcpy(h + 84, "DX10", 4);
    put32(h + 108, 0x8u | 0x1000u); /* complex, texture */
    put32(h + 112, 0x200000u);      /* volume */
    put32(h + 128, f->dxgi);
    put32(h + 132, 4); /* texture of three dimensions */
    put32(h + 140, 1); /* array of one */
}

/* ---- KTX2 --------------------------------------------------------------------------------------------------------- */

static const uint8_t ktx2_identifier[12] = {0xab, 'K', 'T', 'X', ' ', '2', '0', 0xbb, '\r', '\n', 0x1a, '\n'};
enum { KTX2_HEADER = 80, KTX2_LEVEL = 24, KTX2_DFD = 44 };

/* Basic data format descriptor (Khronos Data Format Specification 1.3, section 5): one sample, the red channel. */
static void ktx2_descriptor(volume_format format, uint8_t d[KTX2_DFD]) {
    const format_info *f = formats + format;
    static const uint32_t lower[] = {0xbf800000u, 0, 0, 0}, upper[] = {0x3f800000u, 255, 65535, 0xffffffffu};
    memset(d, 0, KTX2_DFD);
    put32(d, KTX2_DFD);
    put32(d + 8, 2 | (KTX2_DFD - 4) << 16); /* version, size of the block */
    d[12] = format == VOLUME_BC4 ? 131 : 1; /* colour model: BC4 or RGBSDA */
    d[14] = 1;                              /* linear */
    d[16] = d[17] = (uint8_t)(f->block - 1);
    d[20] = (uint8_t)f->bytes;
    d[30] = (uint8_t)(8 * f->bytes - 1);              /* bits - 1 */
    d[31] = format == VOLUME_FLOAT ? 0x80 | 0x40 : 0; /* float, signed; channel 0 */
    put32(d + 36, lower[format]);
    put32(d + 40, upper[format]);
}

static size_t ktx2_pair(uint8_t *p, const char *key, const char *value) {
    size_t k = strlen(key) + 1, n = k + strlen(value) + 1;
    put32(p, (uint32_t)n);
    memcpy(p + 4, key, k);
    memcpy(p + 4 + k, value, n - k);
    memset(p + 4 + n, 0, (4 - n % 4) % 4);
    return 4 + (n + 3) / 4 * 4;
}

/* The header up to the texels; its size. `h` has room for 512 bytes and the comment. */
static size_t ktx2_header(const volume *v, volume_format format, const char *comment, uint8_t *h) {
    size_t size = volume_bytes(v, format), dfd = KTX2_HEADER + KTX2_LEVEL, kvd = dfd + KTX2_DFD, end = kvd;
    memset(h, 0, dfd);
    memcpy(h, ktx2_identifier, sizeof ktx2_identifier);
    put32(h + 12, formats[format].vulkan);
    put32(h + 16, format == VOLUME_BC4 ? 1 : (uint32_t)formats[format].bytes); /* size of what is swapped */
    put32(h + 20, (uint32_t)v->width);
    put32(h + 24, (uint32_t)v->height);
    put32(h + 28, (uint32_t)v->depth);
    put32(h + 36, 1); /* faces */
    put32(h + 40, 1); /* levels */
    ktx2_descriptor(format, h + dfd);
    end += ktx2_pair(h + end, "KTXorientation", "rdi"); /* keys in order */
    end += ktx2_pair(h + end, "KTXwriter", "gtso.h lut");
    if (comment && comment[0])
        end += ktx2_pair(h + end, "gtso.table", comment);
    put32(h + 48, (uint32_t)dfd);
    put32(h + 52, KTX2_DFD);
    put32(h + 56, (uint32_t)kvd);
    put32(h + 60, (uint32_t)(end - kvd));
    size_t begin = (end + 7) / 8 * 8; /* a multiple of every format's bytes, and of 4 */
    memset(h + end, 0, begin - end);
    put32(h + KTX2_HEADER, (uint32_t)begin);
    put32(h + KTX2_HEADER + 8, (uint32_t)size);
    put32(h + KTX2_HEADER + 16, (uint32_t)size);
    return begin;
}

/* ---- C ------------------------------------------------------------------------------------------------------------ */

typedef struct text {
    char *data;
    size_t size, room;
    int ok;
} text;

static void append(text *t, const char *format, ...) {
    char part[1024];
    va_list args;
    va_start(args, format);
    int n = vsnprintf(part, sizeof part, format, args);
    va_end(args);
    t->ok = t->ok && n >= 0 && (size_t)n < sizeof part;
    if (t->ok && t->size + (size_t)n + 1 > t->room) {
        size_t room = 2 * t->room + (size_t)n + 4096;
        char *grown = realloc(t->data, room);
        t->ok = grown != NULL;
        if (t->ok)
            t->data = grown, t->room = room;
    }
    if (t->ok)
        memcpy(t->data + t->size, part, (size_t)n + 1), t->size += (size_t)n;
}

/* File name without folder and ending, as an identifier. */
static void identifier(const char *path, char *name, size_t size) {
    const char *slash = strrchr(path, '/'), *from = slash ? slash + 1 : path;
    size_t n = 0;
    if (isdigit((unsigned char)from[0]))
        name[n++] = '_';
    for (; *from && *from != '.' && n + 1 < size; ++from)
        name[n++] = isalnum((unsigned char)*from) ? *from : '_';
    if (!n)
        name[n++] = '_';
    name[n] = 0;
}

static int write_c(const char *path, const volume *v, volume_format format, const char *comment, image_pending *pending,
                   image_error *error) {
    static const char *const types[] = {"float", "uint8_t", "uint16_t", "uint8_t"};
    static const char *const names[] = {"floats", "8-bit unorm", "16-bit unorm", "BC4 blocks of 4 x 4 texels, 8 bytes"};
    char name[64];
    identifier(path, name, sizeof name);
    size_t count = format == VOLUME_BC4 ? volume_bytes(v, format) : volume_count(v);
    uint8_t *bytes = volume_encode(v, format);
    text t = {NULL, 0, 0, bytes != NULL};
    append(&t, "/* %d x %d x %d, %s. */\n", v->width, v->height, v->depth, names[format]);
    for (const char *line = comment; line && *line;) {
        size_t n = strcspn(line, "\n");
        append(&t, "/* %.*s */\n", (int)n, line);
        line += n + (line[n] == '\n');
    }
    if (format != VOLUME_FLOAT)
        append(&t, "#include <stdint.h>\n\n");
    append(&t, "static const %s %s[%zu] = {", types[format], name, count);
    for (size_t i = 0; t.ok && i < count; ++i) {
        append(&t, i % 16 == 0 ? "\n    " : " ");
        if (format == VOLUME_FLOAT) {
            char number[32];
            snprintf(number, sizeof number, "%.9g", (double)v->texels[i]);
            append(&t, strpbrk(number, ".e") ? "%sf," : "%s.0f,", number);
        } else if (format == VOLUME_UNORM16) {
            append(&t, "%d,", bytes[2 * i] | bytes[2 * i + 1] << 8);
        } else {
            append(&t, "%d,", bytes[i]);
        }
    }
    append(&t, "\n};\n");
    int ok = t.ok ? image_write_bytes(path, t.data, t.size, pending, error) : fail(error, path, "not enough memory");
    free(t.data);
    free(bytes);
    return ok;
}

/* ---- files -------------------------------------------------------------------------------------------------------- */

static int write_image(const char *path, const volume *v, image_pending *pending, image_error *error) {
    static const char *const names[] = {"Y"};
    image slices;
    memset(&slices, 0, sizeof slices);
    slices.width = slices.display_width = v->width;
    slices.height = slices.display_height = v->height * v->depth;
    slices.channels = 1;
    slices.data = v->texels;
    if (v->height > IMAGE_MAX_SIZE / v->depth)
        return fail(error, path, "%d slices of %d rows are more than an image of %d", v->depth, v->height,
                    IMAGE_MAX_SIZE);
    return image_write(path, &slices, names, IMAGE_RANGE_UNIT, pending, error);
}

int volume_write(const char *path, const volume *v, volume_format format, const char *comment, image_pending *pending,
                 image_error *error) {
    volume_file file = volume_file_of(path);
    memset(pending, 0, sizeof *pending);
    if (file == VOLUME_IMAGE)
        return write_image(path, v, pending, error);
    if (file == VOLUME_C)
        return write_c(path, v, format, comment, pending, error);
    if (file == VOLUME_UNKNOWN)
        return fail(error, path, "unknown format, the name must end in .dds, .ktx2, .exr, .pfm, .h, .c or .inc");
    if (v->width > VOLUME_MAX_SIZE || v->height > VOLUME_MAX_SIZE || v->depth > VOLUME_MAX_SIZE)
        return fail(error, path, "%d x %d x %d, but a volume texture has %d a side at most", v->width, v->height,
                    v->depth, VOLUME_MAX_SIZE);
    size_t size = volume_bytes(v, format), header = DDS_HEADER;
    uint8_t *texels = volume_encode(v, format);
    uint8_t *bytes = malloc(size + 512 + (comment ? strlen(comment) : 0));
    int ok = texels && bytes ? 1 : fail(error, path, "not enough memory");
    if (ok && file == VOLUME_DDS)
        dds_header(v, format, bytes);
    else if (ok)
        header = ktx2_header(v, format, comment, bytes);
    if (ok) {
        memcpy(bytes + header, texels, size);
        ok = image_write_bytes(path, bytes, header + size, pending, error);
    }
    free(texels);
    free(bytes);
    return ok;
}

static uint8_t *read_file(const char *path, size_t *size, image_error *error) {
    FILE *file = fopen(path, "rb");
    long length = file && fseek(file, 0, SEEK_END) == 0 ? ftell(file) : -1;
    uint8_t *bytes = length >= 0 && length < 1 << 30 ? malloc((size_t)length + 1) : NULL;
    if (bytes) {
        rewind(file);
        *size = fread(bytes, 1, (size_t)length, file);
    } else {
        fail(error, path, "cannot read");
    }
    if (file)
        fclose(file);
    return bytes;
}

int volume_read(const char *path, volume *v, volume_format *format, image_error *error) {
    size_t size = 0, begin = DDS_HEADER;
    uint8_t *b = read_file(path, &size, error);
    uint32_t code = 0, dimension[3] = {0, 0, 0};
    int ok = 0, f = 0;
    memset(v, 0, sizeof *v);
    if (!b)
        return 0;
    if (size >= DDS_HEADER && memcmp(b, "DDS ", 4) == 0 && memcmp(b + 84, "DX10", 4) == 0 && get32(b + 132) == 4) {
        dimension[0] = get32(b + 16), dimension[1] = get32(b + 12), dimension[2] = get32(b + 24);
        code = get32(b + 128);
        while (f < VOLUME_FORMAT_COUNT && formats[f].dxgi != code)
            ++f;
        ok = 1;
    } else if (size >= KTX2_HEADER + KTX2_LEVEL && memcmp(b, ktx2_identifier, sizeof ktx2_identifier) == 0 &&
               get32(b + 44) == 0) {
        for (int i = 0; i < 3; ++i)
            dimension[i] = get32(b + 20 + 4 * i);
        code = get32(b + 12);
        while (f < VOLUME_FORMAT_COUNT && formats[f].vulkan != code)
            ++f;
        begin = get32(b + KTX2_HEADER);
        ok = get32(b + KTX2_HEADER + 4) == 0;
    }
    if (!ok)
        fail(error, path, "not a DDS (DX10) or KTX2 volume texture");
    for (int i = 0; ok && i < 3; ++i)
        if (dimension[i] < 1 || dimension[i] > VOLUME_MAX_SIZE)
            ok = fail(error, path, "%u texels a side, must be 1..%d", (unsigned)dimension[i], VOLUME_MAX_SIZE);
    if (ok && f == VOLUME_FORMAT_COUNT)
        ok = fail(error, path, "format %u, must be R8, R16, R32F or BC4", (unsigned)code);
    volume want = {(int)dimension[0], (int)dimension[1], (int)dimension[2], NULL};
    if (ok && (begin > size || size - begin < volume_bytes(&want, (volume_format)f)))
        ok = fail(error, path, "ends early");
    if (ok && !volume_create(v, want.width, want.height, want.depth))
        ok = fail(error, path, "not enough memory");
    if (ok) {
        *format = (volume_format)f;
        decode(v, *format, b + begin, v->texels);
    }
    free(b);
    return ok;
}
