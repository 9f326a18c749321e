/* image.c - see image.h */
#include "image.h"

#include "exr_chunk.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb/stb_image_write.h>

/* ---- helpers ---------------------------------------------------------------------------------------------------- */

int image_fail(image_error *error, const char *path, const char *format, ...) {
    va_list args;
    va_start(args, format);
    int n = snprintf(error->text, sizeof error->text, "%s: ", path);
    if (n > 0 && (size_t)n < sizeof error->text)
        vsnprintf(error->text + n, sizeof error->text - (size_t)n, format, args);
    va_end(args);
    for (char *c = error->text; *c; ++c)
        if ((unsigned char)*c < 0x20 || *c == 0x7f)
            *c = '?';
    return 0;
}

int image_create(image *out, int width, int height, int channels, image_error *error) {
    memset(out, 0, sizeof *out);
    if (width < 1 || height < 1 || width > IMAGE_MAX_SIZE || height > IMAGE_MAX_SIZE || channels < 1) {
        snprintf(error->text, sizeof error->text, "%d x %d: width and height must be 1..%d", width, height,
                 IMAGE_MAX_SIZE);
        return 0;
    }
    size_t pixels = (size_t)width * (size_t)height;
    float *data = NULL;
    if (pixels <= SIZE_MAX / sizeof(float) / (size_t)channels)
        data = calloc(pixels * (size_t)channels, sizeof(float));
    if (!data) {
        snprintf(error->text, sizeof error->text, "%d x %d: not enough memory", width, height);
        return 0;
    }
    out->data = data;
    out->width = out->display_width = width;
    out->height = out->display_height = height;
    out->channels = channels;
    return 1;
}

void image_free(image *img) {
    free(img->data);
    memset(img, 0, sizeof *img);
}

static int create_for(const char *path, image *out, int width, int height, int channels, image_error *error) {
    image_error inner;
    return image_create(out, width, height, channels, &inner) ? 1 : image_fail(error, path, "%s", inner.text);
}

static int ends_with(const char *text, size_t length, const char *ending) {
    size_t n = strlen(ending);
    return length > n && strncasecmp(text + length - n, ending, n) == 0;
}

image_format image_format_of(const char *path) {
    size_t n = strlen(path);
    if (ends_with(path, n, ".exr"))
        return IMAGE_EXR;
    if (ends_with(path, n, ".pfm"))
        return IMAGE_PFM;
    return ends_with(path, n, ".png") ? IMAGE_PNG : IMAGE_UNKNOWN;
}

/* FILE[:CHANNEL]. Both may contain colons: a file of that very name wins, then the last colon after .exr or .pfm. */
static void split_spec(const char *spec, size_t *path_length, const char **selection) {
    size_t n = strlen(spec);
    struct stat info;
    *path_length = n;
    *selection = NULL;
    if (stat(spec, &info) == 0)
        return;
    for (size_t i = n; i-- > 1;)
        if (spec[i] == ':' && (ends_with(spec, i, ".exr") || ends_with(spec, i, ".pfm"))) {
            *path_length = i;
            *selection = spec + i + 1;
            return;
        }
}

int image_spec_path(const char *spec, char *path, size_t size) {
    size_t n;
    const char *selection;
    split_spec(spec, &n, &selection);
    if (n >= size)
        return 0;
    memcpy(path, spec, n);
    path[n] = 0;
    return 1;
}

/* ---- PFM -------------------------------------------------------------------------------------------------------- */

/* The next word of a PFM header and the one white-space character that ends it. */
static int pfm_word(FILE *file, char *word, size_t size) {
    int c = getc(file);
    while (c == ' ' || c == '\t' || c == '\r' || c == '\n')
        c = getc(file);
    size_t n = 0;
    for (; c > ' ' && c < 0x7f; c = getc(file)) {
        if (n + 1 >= size)
            return 0;
        word[n++] = (char)c;
    }
    word[n] = 0;
    return n > 0 && (c == ' ' || c == '\t' || c == '\r' || c == '\n');
}

static int pfm_number(FILE *file, double *value) {
    char word[64], *end;
    if (!pfm_word(file, word, sizeof word))
        return 0;
    *value = strtod(word, &end);
    return *end == 0 && isfinite(*value);
}

int image_pfm_header(FILE *file, const char *path, int most, image_pfm *header, image_error *error) {
    char magic[8];
    double width, height, scale;
    if (!pfm_word(file, magic, sizeof magic) || (strcmp(magic, "Pf") != 0 && strcmp(magic, "PF") != 0))
        return image_fail(error, path, "not a PFM file (it must begin with Pf or PF)");
    if (!pfm_number(file, &width) || !pfm_number(file, &height) || !pfm_number(file, &scale))
        return image_fail(error, path, "corrupt PFM header (width, height and scale must be numbers)");
    if (!(width >= 1.0 && width <= most && height >= 1.0 && height <= most) || width != floor(width) ||
        height != floor(height))
        return image_fail(error, path, "%.9g x %.9g: width and height must be 1..%d", width, height, most);
    if (!(fabs(scale) > 0.0))
        return image_fail(error, path, "corrupt PFM header (scale 0 leaves the byte order open)");
    header->width = (int)width;
    header->height = (int)height;
    header->channels = magic[1] == 'F' ? 3 : 1;
    header->little = scale < 0.0;
    return 1;
}

static int pfm_read_file(FILE *file, const char *path, image *out, image_error *error) {
    image_pfm header;
    if (!image_pfm_header(file, path, IMAGE_MAX_SIZE, &header, error))
        return 0;
    size_t row = (size_t)header.width * (size_t)header.channels;

    /* Believe the header's size only if the file is that long, so a bad header costs no memory. */
    struct stat info;
    long position = ftell(file);
    if (position >= 0 && fstat(fileno(file), &info) == 0 && S_ISREG(info.st_mode)) {
        double need = (double)row * header.height * 4.0 + (double)position;
        if ((double)info.st_size < need)
            return image_fail(error, path, "truncated: %.0f bytes, %.0f expected", (double)info.st_size, need);
    }
    if (!create_for(path, out, header.width, header.height, header.channels, error))
        return 0;

    const uint16_t one = 1;
    uint8_t low_byte;
    memcpy(&low_byte, &one, 1);
    int swap = header.little != (low_byte == 1);

    for (int y = out->height; y-- > 0;) { /* bottom row first in the file */
        float *line = out->data + (size_t)y * row;
        if (fread(line, 4, row, file) != row) {
            image_free(out);
            return image_fail(error, path, "truncated");
        }
        for (size_t i = 0; swap && i < row; ++i) {
            uint32_t v;
            memcpy(&v, line + i, 4);
            v = v >> 24 | (v >> 8 & 0xff00u) | (v << 8 & 0xff0000u) | v << 24;
            memcpy(line + i, &v, 4);
        }
    }
    return 1;
}

static int pfm_read(const char *path, image *out, image_error *error) {
    FILE *file = fopen(path, "rb");
    if (!file)
        return image_fail(error, path, "%s", strerror(errno));
    int ok = pfm_read_file(file, path, out, error);
    fclose(file);
    return ok;
}

/* Keep the given components of each pixel. */
static void keep_components(image *img, const int *component, int count) {
    size_t pixels = (size_t)img->width * (size_t)img->height;
    size_t channels = (size_t)img->channels;
    for (size_t i = 0; i < pixels; ++i) {
        float value[4];
        for (int c = 0; c < count; ++c)
            value[c] = img->data[i * channels + (size_t)component[c]];
        for (int c = 0; c < count; ++c)
            img->data[i * (size_t)count + (size_t)c] = value[c];
    }
    img->channels = count;
}

/* ---- EXR: parts, channels, layers --------------------------------------------------------------------------------- */

typedef struct exr_channel {
    int part;
    const char *part_name; /* or "" */
    const char *name;      /* layer.layer.channel; memory of the context */
    int usable;            /* flat, not subsampled */
} exr_channel;

typedef struct exr_file {
    const char *path;
    exr_context_t context;
    exr_channel *channels;
    int count;
    int deep; /* a deep part was left out */
} exr_file;

static void exr_silent(exr_const_context_t context, exr_result_t code, const char *message) {
    (void)context;
    (void)code;
    (void)message; /* the result code says it, in a line of ours */
}

static int exr_fail(image_error *error, const char *path, exr_result_t code) {
    switch (code) {
    case EXR_ERR_OUT_OF_MEMORY:
        return image_fail(error, path, "not enough memory");
    case EXR_ERR_FILE_BAD_HEADER:
        return image_fail(error, path, "not an EXR file, or its header is corrupt");
    case EXR_ERR_INVALID_ATTR:
        return image_fail(error, path, "corrupt EXR header, or width and height not 1..%d", IMAGE_MAX_SIZE);
    default:
        return image_fail(error, path, "corrupt or truncated EXR file (%s)", exr_get_default_error_message(code));
    }
}

static void exr_close(exr_file *file) {
    if (file->context)
        exr_finish(&file->context);
    free(file->channels);
    memset(file, 0, sizeof *file);
}

static int exr_open(const char *path, exr_file *file, image_error *error) {
    memset(file, 0, sizeof *file);
    file->path = path;

    FILE *probe = fopen(path, "rb"); /* for the system's own words on why not */
    if (!probe)
        return image_fail(error, path, "%s", strerror(errno));
    unsigned char magic[4];
    size_t got = fread(magic, 1, 4, probe);
    int read_errno = ferror(probe) ? errno : 0;
    fclose(probe);
    if (read_errno)
        return image_fail(error, path, "%s", strerror(read_errno));
    if (got != 4 || memcmp(magic, "\x76\x2f\x31\x01", 4) != 0)
        return image_fail(error, path, "not an EXR file");

    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    init.error_handler_fn = exr_silent;
    init.max_image_width = init.max_image_height = IMAGE_MAX_SIZE;
    init.max_tile_width = init.max_tile_height = IMAGE_MAX_SIZE;
    init.flags = EXR_CONTEXT_FLAG_SILENT_HEADER_PARSE | EXR_CONTEXT_FLAG_DISABLE_CHUNK_RECONSTRUCTION;
    exr_result_t result = exr_start_read(&file->context, path, &init);
    if (result != EXR_ERR_SUCCESS) {
        file->context = NULL;
        return exr_fail(error, path, result);
    }

    int parts = 0, total = 0;
    exr_get_count(file->context, &parts);
    for (int pass = 0; pass < 2; ++pass) { /* count, then fill */
        if (pass == 1 && total > 0) {
            file->channels = calloc((size_t)total, sizeof *file->channels);
            if (!file->channels) {
                exr_close(file);
                return image_fail(error, path, "not enough memory");
            }
        }
        for (int part = 0; part < parts; ++part) {
            const exr_attr_chlist_t *list = NULL;
            const char *part_name = NULL;
            exr_storage_t storage = EXR_STORAGE_LAST_TYPE;
            if (exr_get_channels(file->context, part, &list) != EXR_ERR_SUCCESS || !list ||
                exr_get_storage(file->context, part, &storage) != EXR_ERR_SUCCESS)
                continue;
            if (storage != EXR_STORAGE_SCANLINE && storage != EXR_STORAGE_TILED) {
                file->deep = 1;
                continue;
            }
            if (exr_get_name(file->context, part, &part_name) != EXR_ERR_SUCCESS || !part_name)
                part_name = "";
            if (pass == 0)
                total += list->num_channels;
            for (int c = 0; pass == 1 && c < list->num_channels; ++c) {
                const exr_attr_chlist_entry_t *entry = list->entries + c;
                exr_channel *channel = file->channels + file->count++;
                channel->part = part;
                channel->part_name = part_name;
                channel->name = entry->name.str ? entry->name.str : "";
                channel->usable = entry->x_sampling == 1 && entry->y_sampling == 1;
            }
        }
    }
    if (file->count == 0) {
        int deep = file->deep;
        exr_close(file);
        return image_fail(error, path, deep ? "only deep pixels, which are not supported" : "no channels");
    }
    return 1;
}

/* "a, b, c" of at most `size` bytes, and "..." if there was more. */
static void list_add(char *text, size_t size, const char *item) {
    size_t n = strlen(text);
    if (n >= 3 && strcmp(text + n - 3, "...") == 0)
        return;
    if (n + strlen(item) + 8 < size)
        snprintf(text + n, size - n, "%s%s", n ? ", " : "", item);
    else
        snprintf(text + n, size - n, "%s...", n ? ", " : "");
}

static void list_channels(const exr_file *file, char *text, size_t size) {
    text[0] = 0;
    for (int i = 0; i < file->count; ++i)
        list_add(text, size, file->channels[i].name);
}

static const char *last_component(const char *name) {
    const char *dot = strrchr(name, '.');
    return dot ? dot + 1 : name;
}

/* The layer is what stands before the last dot; its own last component, as pointer and length. */
static size_t layer_length(const char *name) {
    const char *dot = strrchr(name, '.');
    return dot ? (size_t)(dot - name) : 0;
}

static size_t layer_tail(const char *name, const char **tail) {
    size_t n = layer_length(name), begin = n;
    while (begin > 0 && name[begin - 1] != '.')
        --begin;
    *tail = name + begin;
    return n - begin;
}

static int equal_nocase(const char *text, size_t length, const char *other) {
    return length == strlen(other) && strncasecmp(text, other, length) == 0;
}

/* Does `name` of `length` end in the dotted components `wanted`? */
static int has_suffix(const char *name, size_t length, const char *wanted) {
    size_t n = strlen(wanted);
    return n > 0 && n <= length && memcmp(name + length - n, wanted, n) == 0 &&
           (n == length || name[length - n - 1] == '.');
}

static int find_in_layer(const exr_file *file, const exr_channel *like, const char *component) {
    size_t n = layer_length(like->name);
    for (int i = 0; i < file->count; ++i) {
        const exr_channel *c = file->channels + i;
        if (c->part == like->part && layer_length(c->name) == n && memcmp(c->name, like->name, n) == 0 &&
            strcasecmp(last_component(c->name), component) == 0)
            return i;
    }
    return -1;
}

/* How much a channel looks like depth: 1 is best, 0 not at all. */
static int depth_rank(const exr_file *file, const exr_channel *c) {
    const char *last = last_component(c->name), *tail;
    size_t tail_length = layer_tail(c->name, &tail);
    int vector = find_in_layer(file, c, "X") >= 0 || find_in_layer(file, c, "G") >= 0; /* position, normal, colour */
    int in_depth_layer =
        equal_nocase(tail, tail_length, "depth") || (tail_length == 0 && strcasecmp(c->part_name, "depth") == 0);
    if (strcmp(c->name, "Z") == 0 && find_in_layer(file, c, "X") < 0)
        return 1;
    if (strcasecmp(c->name, "depth") == 0)
        return 2;
    if (in_depth_layer && strcasecmp(last, "Z") == 0 && find_in_layer(file, c, "X") < 0)
        return 3;
    if (strcasecmp(last, "depth") == 0)
        return 4;
    if (in_depth_layer && !vector && last[0] && !last[1])
        return 5; /* depth.R, depth.V, ... alone in its layer */
    if (strcasecmp(last, "Z") == 0 && !vector)
        return 6;
    return 0;
}

static int find_depth(const exr_file *file, image_error *error) {
    if (file->count == 1)
        return 0;
    char names[300] = "";
    int best = 0, best_rank = 0, tied = 0;
    for (int i = 0; i < file->count; ++i) {
        int rank = depth_rank(file, file->channels + i);
        if (!rank || (best_rank && rank > best_rank))
            continue;
        /* the same name in another part: the first part wins */
        int repeated = rank == best_rank && strcmp(file->channels[best].name, file->channels[i].name) == 0;
        if (rank != best_rank) {
            best = i;
            best_rank = rank;
            tied = 0;
            names[0] = 0;
        } else if (!repeated) {
            tied = 1;
        }
        if (!repeated)
            list_add(names, sizeof names, file->channels[i].name);
    }
    if (best_rank && !tied)
        return best;
    if (tied) {
        image_fail(error, file->path, "more than one depth channel, choose with FILE:CHANNEL among %s", names);
    } else {
        list_channels(file, names, sizeof names);
        image_fail(error, file->path, "no depth channel found, choose with FILE:CHANNEL among %s", names);
    }
    return -1;
}

/* By full name; with the part's name before it; without leading layers; or as a layer with a single channel. */
static int find_channel(const exr_file *file, const char *wanted, image_error *error) {
    size_t n = strlen(wanted);
    for (int i = 0; i < file->count; ++i)
        if (strcmp(file->channels[i].name, wanted) == 0)
            return i;
    for (int i = 0; i < file->count; ++i) {
        const exr_channel *c = file->channels + i;
        size_t part = strlen(c->part_name);
        if (part && n > part && memcmp(wanted, c->part_name, part) == 0 && wanted[part] == '.' &&
            strcmp(wanted + part + 1, c->name) == 0)
            return i;
    }
    char names[300] = "";
    for (int pass = 0; pass < 2; ++pass) {
        int found = -1, several = 0;
        for (int i = 0; i < file->count; ++i) {
            const char *name = file->channels[i].name;
            if (!has_suffix(name, pass == 0 ? strlen(name) : layer_length(name), wanted))
                continue;
            several = found >= 0;
            found = found >= 0 ? found : i;
            list_add(names, sizeof names, name);
            if (several && pass == 0)
                break;
        }
        if (found >= 0 && !several)
            return found;
        if (several) {
            image_fail(error, file->path, "%s is more than one channel: %s", wanted, names);
            return -1;
        }
    }
    list_channels(file, names, sizeof names);
    image_fail(error, file->path, "no channel %s, there are %s", wanted, names);
    return -1;
}

/* The X, Y, Z or R, G, B channels of the layer that channel `x` opens. */
static int layer_triple(const exr_file *file, int x, int triple[3]) {
    const exr_channel *c = file->channels + x;
    const char *last = last_component(c->name);
    int rgb = strcasecmp(last, "R") == 0;
    if (!rgb && strcasecmp(last, "X") != 0)
        return 0;
    if (rgb && find_in_layer(file, c, "X") >= 0 && find_in_layer(file, c, "Z") >= 0)
        return 0; /* the same layer again */
    triple[0] = x;
    triple[1] = find_in_layer(file, c, rgb ? "G" : "Y");
    triple[2] = find_in_layer(file, c, rgb ? "B" : "Z");
    return triple[1] >= 0 && triple[2] >= 0;
}

static void layer_name(const exr_channel *c, char *text, size_t size) {
    int n = (int)layer_length(c->name);
    if (n == 0)
        snprintf(text, size, "%s", c->part_name[0] ? c->part_name : "(unnamed)");
    else
        snprintf(text, size, "%.*s", n, c->name);
}

static int contains_nocase(const char *text, size_t length, const char *word) {
    size_t n = strlen(word);
    for (size_t i = 0; i + n <= length; ++i)
        if (strncasecmp(text + i, word, n) == 0)
            return 1;
    return 0;
}

/* How well a layer answers: 1 is best, 0 not at all. */
static int normal_rank(const exr_channel *c, const char *wanted) {
    const char *tail;
    size_t tail_length = layer_tail(c->name, &tail), length = layer_length(c->name);
    if (wanted) {
        if (length == strlen(wanted) && memcmp(c->name, wanted, length) == 0)
            return 1;
        if (length == 0 && strcmp(c->part_name, wanted) == 0)
            return 2;
        return has_suffix(c->name, length, wanted) ? 3 : 0;
    }
    if (tail_length == 0) {
        tail = c->part_name;
        tail_length = strlen(tail);
    }
    if (equal_nocase(tail, tail_length, "normal") || equal_nocase(tail, tail_length, "n") ||
        equal_nocase(tail, tail_length, "normals"))
        return 1;
    return contains_nocase(tail, tail_length, "normal") ? 2 : 0;
}

static int find_normals(const exr_file *file, const char *wanted, int triple[3], image_error *error) {
    char matching[300] = "", all[300] = "", name[128], best_name[128] = "";
    int best_rank = 0, tied = 0, count = 0, t[3], only[3] = {0, 0, 0};
    for (int i = 0; i < file->count; ++i) {
        if (!layer_triple(file, i, t))
            continue;
        const exr_channel *c = file->channels + i;
        layer_name(c, name, sizeof name);
        list_add(all, sizeof all, name);
        if (count++ == 0)
            memcpy(only, t, sizeof t);
        int rank = normal_rank(c, wanted);
        if (!rank || (best_rank && rank > best_rank))
            continue;
        if (rank != best_rank) {
            best_rank = rank;
            tied = 0;
            matching[0] = 0;
            snprintf(best_name, sizeof best_name, "%s", name);
            memcpy(triple, t, sizeof t);
        } else if (strcmp(name, best_name) != 0) {
            tied = 1;
        } else {
            continue; /* the same layer in another part */
        }
        list_add(matching, sizeof matching, name);
    }
    if (best_rank && !tied)
        return 1;
    if (tied)
        return image_fail(error, file->path, "more than one layer of normals, choose with FILE:LAYER among %s",
                          matching);
    if (wanted)
        return image_fail(error, file->path, "no layer %s with channels X, Y, Z or R, G, B; there are %s", wanted,
                          all[0] ? all : "none");
    if (count == 1 && layer_length(file->channels[only[0]].name) == 0) {
        memcpy(triple, only, sizeof only); /* a file that holds nothing else */
        return 1;
    }
    return image_fail(error, file->path, "no layer of normals found, choose with FILE:LAYER among %s",
                      all[0] ? all : "none");
}

/* ---- EXR: pixels -------------------------------------------------------------------------------------------------- */

typedef struct exr_reader {
    const exr_file *file;
    int part;
    const char *const *names; /* wanted channels of this part, null where another part has them */
    int count;
    image *out;
    int x, y; /* the image's pixel where the current block begins */
    exr_decode_pipeline_t pipeline;
    int begun;
} exr_reader;

static float half_to_float(uint32_t half) {
    uint32_t sign = (half & 0x8000u) << 16, exponent = half >> 10 & 31u, mantissa = half & 0x3ffu, bits;
    float value;
    if (exponent == 0) { /* zero or denormal: mantissa 2^-24, exact */
        value = (float)mantissa * 5.9604644775390625e-8f;
        return sign ? -value : value;
    }
    bits = sign | (exponent == 31 ? 0x7f800000u : (exponent + 112u) << 23) | mantissa << 13;
    memcpy(&value, &bits, 4);
    return value;
}

static void convert_line(const uint8_t *from, int type, int width, float *to, int stride) {
    for (int x = 0; x < width; ++x, to += stride) {
        if (type == EXR_PIXEL_HALF) {
            *to = half_to_float((uint32_t)from[2 * x] | (uint32_t)from[2 * x + 1] << 8);
        } else {
            const uint8_t *f = from + 4 * x;
            uint32_t bits = (uint32_t)f[0] | (uint32_t)f[1] << 8 | (uint32_t)f[2] << 16 | (uint32_t)f[3] << 24;
            if (type == EXR_PIXEL_UINT)
                *to = (float)bits;
            else
                memcpy(to, &bits, 4);
        }
    }
}

/* A decompressed block holds, line by line, the channels one after the other, little endian. OpenEXRCore's own unpacking
 * is not used: 3.1 dereferences the null pointers of unwanted channels in files of 3 or 4 half channels. */
static exr_result_t exr_unpack(exr_decode_pipeline_t *pipeline) {
    exr_reader *r = pipeline->decoding_user_data;
    const uint8_t *from = pipeline->unpacked_buffer ? pipeline->unpacked_buffer : pipeline->packed_buffer;
    uint64_t left = from ? pipeline->chunk.unpacked_size : 0;
    image *out = r->out;
    for (int y = 0; y < pipeline->chunk.height; ++y)
        for (int c = 0; c < pipeline->channel_count; ++c) {
            const exr_coding_channel_info_t *info = pipeline->channels + c;
            if (info->y_samples > 1 && (pipeline->chunk.start_y + y) % info->y_samples != 0)
                continue;
            uint64_t bytes = (uint64_t)info->width * (uint64_t)info->bytes_per_element;
            if (info->width < 0 || bytes > left)
                return EXR_ERR_CORRUPT_CHUNK;
            for (int k = 0; k < r->count; ++k) {
                if (!r->names[k] || strcmp(r->names[k], info->channel_name) != 0)
                    continue;
                if (info->width != pipeline->chunk.width)
                    return EXR_ERR_CORRUPT_CHUNK;
                size_t pixel = (size_t)(r->y + y) * (size_t)out->width + (size_t)r->x;
                convert_line(from, info->data_type, info->width, out->data + pixel * (size_t)out->channels + k,
                             out->channels);
            }
            from += bytes;
            left -= bytes;
        }
    return EXR_ERR_SUCCESS;
}

/* One block of lines or one tile whose first pixel is (x, y) of the image. */
static exr_result_t exr_read_block(exr_reader *r, const exr_chunk_info_t *chunk, int x, int y) {
    exr_const_context_t context = r->file->context;
    const image *out = r->out;
    /* What comes from the file decides where we write: check it against the image first. */
    if (x < 0 || y < 0 || chunk->width < 1 || chunk->height < 1 || x > out->width - chunk->width ||
        y > out->height - chunk->height || chunk->unpacked_size > INT32_MAX)
        return EXR_ERR_BAD_CHUNK_LEADER;
    exr_result_t result = r->begun ? exr_decoding_update(context, r->part, chunk, &r->pipeline)
                                   : exr_decoding_initialize(context, r->part, chunk, &r->pipeline);
    r->begun = 1;
    if (result == EXR_ERR_SUCCESS) /* sets the routines that read and decompress */
        result = exr_decoding_choose_default_routines(context, r->part, &r->pipeline);
    if (result != EXR_ERR_SUCCESS)
        return result;
    r->x = x;
    r->y = y;
    r->pipeline.decoding_user_data = r;
    r->pipeline.unpack_and_convert_fn = exr_unpack;
    return exr_decoding_run(context, r->part, &r->pipeline);
}

static exr_result_t exr_read_part(exr_reader *r, int min_y) {
    exr_const_context_t context = r->file->context;
    exr_storage_t storage = EXR_STORAGE_LAST_TYPE;
    exr_chunk_info_t chunk;
    exr_result_t result = exr_get_storage(context, r->part, &storage);
    if (result != EXR_ERR_SUCCESS)
        return result;
    if (storage == EXR_STORAGE_SCANLINE) {
        int lines = 0;
        result = exr_get_scanlines_per_chunk(context, r->part, &lines);
        if (result == EXR_ERR_SUCCESS && lines < 1)
            return EXR_ERR_BAD_CHUNK_LEADER;
        for (int y = 0; result == EXR_ERR_SUCCESS && y < r->out->height; y += lines) {
            result = exr_read_scanline_chunk_info(context, r->part, min_y + y, &chunk);
            if (result == EXR_ERR_SUCCESS)
                result = exr_read_block(r, &chunk, 0, y);
        }
        return result;
    }
    int32_t tile_width = 0, tile_height = 0;
    result = exr_get_tile_sizes(context, r->part, 0, 0, &tile_width, &tile_height);
    if (result == EXR_ERR_SUCCESS && (tile_width < 1 || tile_height < 1))
        return EXR_ERR_BAD_CHUNK_LEADER;
    for (int y = 0, ty = 0; result == EXR_ERR_SUCCESS && y < r->out->height; y += tile_height, ++ty)
        for (int x = 0, tx = 0; result == EXR_ERR_SUCCESS && x < r->out->width; x += tile_width, ++tx) {
            result = exr_read_tile_chunk_info(context, r->part, tx, ty, 0, 0, &chunk);
            if (result == EXR_ERR_SUCCESS)
                result = exr_read_block(r, &chunk, x, y);
        }
    return result;
}

static int exr_window(const exr_file *file, int part, exr_attr_box2i_t *data, exr_attr_box2i_t *display,
                      image_error *error) {
    exr_result_t result = exr_get_data_window(file->context, part, data);
    if (result == EXR_ERR_SUCCESS)
        result = exr_get_display_window(file->context, part, display);
    if (result != EXR_ERR_SUCCESS)
        return exr_fail(error, file->path, result);
    int64_t w = (int64_t)data->max.x - data->min.x + 1, h = (int64_t)data->max.y - data->min.y + 1;
    if (w < 1 || h < 1 || w > IMAGE_MAX_SIZE || h > IMAGE_MAX_SIZE)
        return image_fail(error, file->path, "%lld x %lld: width and height must be 1..%d", (long long)w, (long long)h,
                          IMAGE_MAX_SIZE);
    return 1;
}

/* Channels by index, interleaved in that order. They may lie in several parts of one size. */
static int exr_read_indices(const exr_file *file, const int *index, int count, image *out, image_error *error) {
    exr_attr_box2i_t data, display;
    const char *names[8];
    if (count > 8)
        return image_fail(error, file->path, "more than 8 channels asked for");
    if (!exr_window(file, file->channels[index[0]].part, &data, &display, error))
        return 0;
    for (int i = 0; i < count; ++i) {
        const exr_channel *c = file->channels + index[i];
        exr_attr_box2i_t other, ignored;
        if (!c->usable)
            return image_fail(error, file->path, "channel %s is subsampled, which is not supported", c->name);
        if (!exr_window(file, c->part, &other, &ignored, error))
            return 0;
        if (memcmp(&other, &data, sizeof data) != 0)
            return image_fail(error, file->path, "channel %s has another size", c->name);
    }
    if (!create_for(file->path, out, data.max.x - data.min.x + 1, data.max.y - data.min.y + 1, count, error))
        return 0;
    int64_t dw = (int64_t)display.max.x - display.min.x + 1, dh = (int64_t)display.max.y - display.min.y + 1;
    int64_t ox = (int64_t)data.min.x - display.min.x, oy = (int64_t)data.min.y - display.min.y;
    if (dw >= 1 && dh >= 1 && dw <= IMAGE_MAX_SIZE && dh <= IMAGE_MAX_SIZE && llabs(ox) <= IMAGE_MAX_SIZE &&
        llabs(oy) <= IMAGE_MAX_SIZE) { /* an absurd display window is as good as none */
        out->display_width = (int)dw;
        out->display_height = (int)dh;
        out->origin_x = (int)ox;
        out->origin_y = (int)oy;
    }

    for (int i = 0; i < count; ++i) {
        int part = file->channels[index[i]].part, seen = 0;
        for (int k = 0; k < i; ++k)
            seen |= file->channels[index[k]].part == part;
        if (seen)
            continue;
        for (int k = 0; k < count; ++k)
            names[k] = file->channels[index[k]].part == part ? file->channels[index[k]].name : NULL;
        exr_reader reader;
        memset(&reader, 0, sizeof reader);
        reader.file = file;
        reader.part = part;
        reader.names = names;
        reader.count = count;
        reader.out = out;
        exr_result_t result = exr_read_part(&reader, data.min.y);
        if (reader.begun)
            exr_decoding_destroy(file->context, &reader.pipeline);
        if (result != EXR_ERR_SUCCESS) {
            image_free(out);
            return exr_fail(error, file->path, result);
        }
    }
    return 1;
}

/* ---- EXR: bands of rows --------------------------------------------------------------------------------------------- */

struct image_stream {
    exr_file file;
    char *path;
    int index[3];
    const char *names[3];
    image block; /* the rows of one row of blocks or tiles, of which [used, filled) are still to be handed out */
    int used, filled, next_y, height, min_y;
    int tiled, tile_width;
    exr_reader reader;
};

static exr_result_t exr_stream_fill(image_stream *s) {
    exr_const_context_t context = s->file.context;
    exr_chunk_info_t chunk;
    exr_result_t result = EXR_ERR_SUCCESS;
    int rows = s->block.height, left = s->height - s->next_y;
    if (!s->tiled) {
        result = exr_read_scanline_chunk_info(context, s->reader.part, s->min_y + s->next_y, &chunk);
        if (result == EXR_ERR_SUCCESS)
            result = exr_read_block(&s->reader, &chunk, 0, 0);
    }
    for (int x = 0, tx = 0; s->tiled && result == EXR_ERR_SUCCESS && x < s->block.width; x += s->tile_width, ++tx) {
        result = exr_read_tile_chunk_info(context, s->reader.part, tx, s->next_y / rows, 0, 0, &chunk);
        if (result == EXR_ERR_SUCCESS)
            result = exr_read_block(&s->reader, &chunk, x, 0);
    }
    s->used = 0;
    s->filled = left < rows ? left : rows;
    s->next_y += s->filled;
    return result;
}

static int exr_stream_begin(image_stream *s, int channels, image *size, image_error *error) {
    exr_attr_box2i_t data, display;
    exr_storage_t storage = EXR_STORAGE_LAST_TYPE;
    int part = s->file.channels[s->index[0]].part, lines = 0;
    for (int i = 0; i < channels; ++i) {
        const exr_channel *c = s->file.channels + s->index[i];
        if (!c->usable)
            return image_fail(error, s->path, "channel %s is subsampled, which is not supported", c->name);
        if (c->part != part)
            return image_fail(error, s->path, "channels in several parts, which is not supported here");
        s->names[i] = c->name;
    }
    if (!exr_window(&s->file, part, &data, &display, error))
        return 0;
    memset(size, 0, sizeof *size);
    size->width = size->display_width = data.max.x - data.min.x + 1;
    size->height = size->display_height = s->height = data.max.y - data.min.y + 1;
    size->channels = channels;
    s->min_y = data.min.y;
    exr_result_t result = exr_get_storage(s->file.context, part, &storage);
    s->tiled = storage == EXR_STORAGE_TILED;
    if (result == EXR_ERR_SUCCESS && s->tiled)
        result = exr_get_tile_sizes(s->file.context, part, 0, 0, &s->tile_width, &lines);
    else if (result == EXR_ERR_SUCCESS)
        result = exr_get_scanlines_per_chunk(s->file.context, part, &lines);
    if (result == EXR_ERR_SUCCESS && (lines < 1 || (s->tiled && s->tile_width < 1)))
        result = EXR_ERR_BAD_CHUNK_LEADER;
    if (result != EXR_ERR_SUCCESS)
        return exr_fail(error, s->path, result);
    if (!create_for(s->path, &s->block, size->width, lines, channels, error))
        return 0;
    s->reader.file = &s->file;
    s->reader.part = part;
    s->reader.names = s->names;
    s->reader.count = channels;
    s->reader.out = &s->block;
    return 1;
}

image_stream *image_stream_open(const char *spec, int channels, image *size, image_error *error) {
    size_t length;
    const char *selection;
    int ok = 0;
    image_stream *s = calloc(1, sizeof *s);
    split_spec(spec, &length, &selection);
    if (s)
        s->path = strndup(spec, length);
    if (!s || !s->path) {
        image_fail(error, spec, "not enough memory");
    } else if (selection && !selection[0]) {
        image_fail(error, s->path, "nothing after the colon");
    } else if (exr_open(s->path, &s->file, error)) {
        if (channels == 1)
            ok =
                (s->index[0] = selection ? find_channel(&s->file, selection, error) : find_depth(&s->file, error)) >= 0;
        else
            ok = find_normals(&s->file, selection, s->index, error);
        ok = ok && exr_stream_begin(s, channels, size, error);
    }
    if (ok)
        return s;
    image_stream_close(s);
    return NULL;
}

int image_stream_read(image_stream *s, int rows, float *to, image_error *error) {
    size_t row = (size_t)s->block.width * (size_t)s->block.channels;
    for (; rows > 0; --rows, ++s->used, to += row) {
        if (s->used == s->filled) {
            exr_result_t result = s->next_y < s->height ? exr_stream_fill(s) : EXR_ERR_ARGUMENT_OUT_OF_RANGE;
            if (result != EXR_ERR_SUCCESS)
                return exr_fail(error, s->path, result);
        }
        memcpy(to, s->block.data + (size_t)s->used * row, row * sizeof(float));
    }
    return 1;
}

void image_stream_close(image_stream *s) {
    if (!s)
        return;
    if (s->reader.begun)
        exr_decoding_destroy(s->file.context, &s->reader.pipeline);
    exr_close(&s->file);
    image_free(&s->block);
    free(s->path);
    free(s);
}

/* ---- reading ------------------------------------------------------------------------------------------------------ */

static int pfm_component(const image *img, const char *name) {
    if (img->channels == 1)
        return strcasecmp(name, "Y") == 0 || strcasecmp(name, "Z") == 0 ? 0 : -1;
    for (int c = 0; c < 3; ++c)
        if (name[0] && !name[1] && (strchr("Rr", name[0]) || strchr("Xx", name[0])) && c == 0)
            return 0;
        else if (name[0] && !name[1] && (strchr("Gg", name[0]) || strchr("Yy", name[0])) && c == 1)
            return 1;
        else if (name[0] && !name[1] && (strchr("Bb", name[0]) || strchr("Zz", name[0])) && c == 2)
            return 2;
    return -1;
}

static int bad_ending(const char *path, image_error *error) {
    return image_fail(error, path, "unknown format, the name must end in .exr or .pfm");
}

typedef enum read_what { READ_DEPTH, READ_NORMALS } read_what;

static int read_spec(const char *spec, read_what what, image *out, image_error *error) {
    size_t length;
    const char *selection;
    memset(out, 0, sizeof *out);
    split_spec(spec, &length, &selection);
    char *path = strndup(spec, length);
    if (!path)
        return image_fail(error, spec, "not enough memory");
    int ok = 0;
    if (selection && !selection[0]) {
        image_fail(error, path, "nothing after the colon");
    } else if (image_format_of(path) == IMAGE_PFM) {
        ok = pfm_read(path, out, error);
        int component = 0;
        if (ok && what == READ_DEPTH) {
            if (selection && (component = pfm_component(out, selection)) < 0)
                ok = image_fail(error, path, "no channel %s in a PFM with %d channel(s)", selection, out->channels);
            else if (!selection && out->channels != 1)
                ok = image_fail(error, path, "3 channels (PF), depth is one (Pf)");
            else
                keep_components(out, &component, 1);
        } else if (ok && selection) {
            ok = image_fail(error, path, "no layer %s in a PFM", selection);
        } else if (ok && out->channels != 3) {
            ok = image_fail(error, path, "one channel (Pf), normals are three (PF)");
        }
        if (!ok)
            image_free(out);
    } else if (image_format_of(path) == IMAGE_EXR) {
        exr_file file;
        int index[3], count = what == READ_DEPTH ? 1 : 3;
        if (exr_open(path, &file, error)) {
            if (what == READ_DEPTH) {
                index[0] = selection ? find_channel(&file, selection, error) : find_depth(&file, error);
                ok = index[0] >= 0;
            } else {
                ok = find_normals(&file, selection, index, error);
            }
            ok = ok && exr_read_indices(&file, index, count, out, error);
            exr_close(&file);
        }
    } else {
        bad_ending(path, error);
    }
    free(path);
    return ok;
}

int image_read_depth(const char *spec, image *out, image_error *error) {
    return read_spec(spec, READ_DEPTH, out, error);
}

int image_read_normals(const char *spec, image *out, image_error *error) {
    return read_spec(spec, READ_NORMALS, out, error);
}

int image_read_channels(const char *path, const char *const *names, int count, image *out, image_error *error) {
    int index[8], ok = count >= 1 && count <= 8;
    memset(out, 0, sizeof *out);
    if (!ok)
        return image_fail(error, path, "1 to 8 channels can be read at once");
    if (image_format_of(path) == IMAGE_PFM) {
        if (!pfm_read(path, out, error))
            return 0;
        for (int i = 0; ok && i < count; ++i)
            if ((index[i] = pfm_component(out, names[i])) < 0 || count > 4)
                ok = image_fail(error, path, "no channel %s in a PFM with %d channel(s)", names[i], out->channels);
        if (ok && count > out->channels)
            ok = image_fail(error, path, "%d channels asked for, %d there", count, out->channels);
        if (ok)
            keep_components(out, index, count);
        else
            image_free(out);
        return ok;
    }
    if (image_format_of(path) != IMAGE_EXR)
        return bad_ending(path, error);
    exr_file file;
    if (!exr_open(path, &file, error))
        return 0;
    for (int i = 0; ok && i < count; ++i)
        ok = (index[i] = find_channel(&file, names[i], error)) >= 0;
    ok = ok && exr_read_indices(&file, index, count, out, error);
    exr_close(&file);
    return ok;
}

char **image_list_channels(const char *path, int *count, image_error *error) {
    static const char *const pfm[] = {"R", "G", "B"};
    char **names = NULL;
    exr_file file;
    image img;
    *count = 0;
    memset(&file, 0, sizeof file);
    if (image_format_of(path) == IMAGE_PFM) {
        if (!pfm_read(path, &img, error))
            return NULL;
        file.count = img.channels;
        image_free(&img);
    } else if (image_format_of(path) != IMAGE_EXR) {
        bad_ending(path, error);
        return NULL;
    } else if (!exr_open(path, &file, error)) {
        return NULL;
    }
    names = calloc((size_t)file.count + 1, sizeof *names);
    for (int i = 0; names && i < file.count; ++i) {
        const char *name = file.channels ? file.channels[i].name : file.count == 1 ? "Y" : pfm[i];
        names[i] = strdup(name);
        *count = names[i] ? i + 1 : *count;
    }
    if (!names || *count < file.count)
        image_fail(error, path, "not enough memory");
    exr_close(&file);
    return names;
}

void image_free_names(char **names) {
    for (int i = 0; names && names[i]; ++i)
        free(names[i]);
    free(names);
}

/* ---- writing ------------------------------------------------------------------------------------------------------ */

/* `like` has the windows; the pixels are the planes'. */
static int write_exr(const char *temporary, const char *path, const image *like, const image_plane *planes, int count,
                     exr_compression_t compression, image_error *error) {
    exr_context_t context = NULL;
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    exr_encode_pipeline_t pipeline = EXR_ENCODE_PIPELINE_INITIALIZER;
    exr_chunk own;
    exr_attr_box2i_t display, data;
    exr_attr_v2f_t center;
    exr_chunk_info_t chunk;
    int part = 0, lines = 0, begun = 0;
    init.error_handler_fn = exr_silent;
    memset(&center, 0, sizeof center);
    display.min.x = display.min.y = 0;
    display.max.x = like->display_width - 1;
    display.max.y = like->display_height - 1;
    data.min.x = like->origin_x;
    data.min.y = like->origin_y;
    data.max.x = like->origin_x + like->width - 1;
    data.max.y = like->origin_y + like->height - 1;

    exr_result_t result = exr_start_write(&context, temporary, EXR_WRITE_FILE_DIRECTLY, &init);
    if (result != EXR_ERR_SUCCESS)
        return image_fail(error, path, "cannot write (%s)", exr_get_default_error_message(result));
    result = exr_add_part(context, "image", EXR_STORAGE_SCANLINE, &part);
    if (result == EXR_ERR_SUCCESS)
        result = exr_initialize_required_attr(context, part, &display, &data, 1.0f, &center, 1.0f,
                                              EXR_LINEORDER_INCREASING_Y, compression);
    for (int c = 0; result == EXR_ERR_SUCCESS && c < count; ++c)
        result = exr_add_channel(context, part, planes[c].name, EXR_PIXEL_FLOAT, EXR_PERCEPTUALLY_LINEAR, 1, 1);
    if (result == EXR_ERR_SUCCESS)
        result = exr_write_header(context);
    if (result == EXR_ERR_SUCCESS)
        result = exr_get_scanlines_per_chunk(context, part, &lines);
    for (int y = 0; result == EXR_ERR_SUCCESS && y < like->height; y += lines) {
        result = exr_write_scanline_chunk_info(context, part, data.min.y + y, &chunk);
        if (result == EXR_ERR_SUCCESS)
            result = begun ? exr_encoding_update(context, part, &chunk, &pipeline)
                           : exr_encoding_initialize(context, part, &chunk, &pipeline);
        if (result != EXR_ERR_SUCCESS)
            break;
        for (int i = 0; i < pipeline.channel_count; ++i) {
            exr_coding_channel_info_t *info = pipeline.channels + i;
            int c = 0;
            while (c + 1 < count && strcmp(planes[c].name, info->channel_name) != 0)
                ++c;
            info->user_data_type = EXR_PIXEL_FLOAT;
            info->user_bytes_per_element = 4;
            info->user_pixel_stride = planes[c].step * (int)sizeof(float);
            info->user_line_stride = (int32_t)planes[c].stride;
            info->encode_from_ptr = (const uint8_t *)planes[c].data + (ptrdiff_t)y * planes[c].stride;
        }
        if (!begun)
            result = exr_chunk_routines(context, part, &pipeline, &own);
        begun = 1;
        if (result == EXR_ERR_SUCCESS)
            result = exr_encoding_run(context, part, &pipeline);
    }
    exr_encoding_destroy(context, &pipeline);
    exr_result_t closed = exr_finish(&context);
    result = result == EXR_ERR_SUCCESS ? closed : result;
    return result == EXR_ERR_SUCCESS
               ? 1
               : image_fail(error, path, "cannot write (%s)", exr_get_default_error_message(result));
}

static int write_pfm(FILE *file, const image *img) {
    const uint16_t one = 1;
    uint8_t low_byte;
    memcpy(&low_byte, &one, 1);
    size_t row = (size_t)img->width * (size_t)img->channels;
    int ok = fprintf(file, "%s\n%d %d\n%s\n", img->channels == 3 ? "PF" : "Pf", img->width, img->height,
                     low_byte ? "-1.0" : "1.0") > 0;
    for (int y = img->height; ok && y-- > 0;)
        ok = fwrite(img->data + (size_t)y * row, sizeof(float), row, file) == row;
    return ok;
}

static void png_sink(void *context, void *data, int size) {
    fwrite(data, 1, (size_t)size, (FILE *)context);
}

static int write_png(FILE *file, const image *img, image_range range) {
    size_t count = (size_t)img->width * (size_t)img->height * (size_t)img->channels;
    uint8_t *bytes = malloc(count);
    if (!bytes)
        return 0;
    for (size_t i = 0; i < count; ++i) {
        float v = range == IMAGE_RANGE_SIGNED ? 0.5f + 0.5f * img->data[i] : img->data[i];
        v = v > 0.0f ? v : 0.0f; /* NaN is 0 */
        v = v < 1.0f ? v : 1.0f;
        bytes[i] = (uint8_t)(255.0f * v + 0.5f);
    }
    int ok = stbi_write_png_to_func(png_sink, file, img->width, img->height, img->channels, bytes,
                                    img->width * img->channels);
    free(bytes);
    return ok;
}

/* A new, empty file beside `path`. It keeps the permissions a plain fopen would give, unlike mkstemp's. */
FILE *image_open_pending(const char *path, image_pending *pending, image_error *error) {
    memset(pending, 0, sizeof *pending);
    size_t n = strlen(path);
    pending->path = strndup(path, n);
    pending->temporary = malloc(n + 40);
    int descriptor = -1;
    if (!pending->path || !pending->temporary) {
        errno = ENOMEM;
    } else {
        for (int attempt = 0; descriptor < 0 && attempt < 100; ++attempt) {
            snprintf(pending->temporary, n + 40, "%s.%ld-%d.tmp", path, (long)getpid(), attempt);
            descriptor = open(pending->temporary, O_WRONLY | O_CREAT | O_EXCL, 0666);
            if (descriptor < 0 && errno != EEXIST)
                break;
        }
    }
    FILE *file = descriptor >= 0 ? fdopen(descriptor, "wb") : NULL;
    if (!file) {
        image_fail(error, path, "cannot write: %s", strerror(errno));
        if (descriptor >= 0) {
            close(descriptor);
            unlink(pending->temporary);
        }
        free(pending->path);
        free(pending->temporary);
        memset(pending, 0, sizeof *pending);
    }
    return file;
}

/* Close after writing; on failure nothing stays behind. */
int image_close_pending(FILE *file, int ok, const char *path, image_pending *pending, image_error *error) {
    ok = ok && !ferror(file);
    ok = fclose(file) == 0 && ok;
    if (!ok) {
        image_fail(error, path, "cannot write: %s", errno ? strerror(errno) : "not enough memory");
        image_discard(pending);
    }
    return ok;
}

int image_write(const char *path, const image *img, const char *const *names, image_range range, image_pending *pending,
                image_error *error) {
    image_format format = image_format_of(path);
    memset(pending, 0, sizeof *pending);
    if (format == IMAGE_UNKNOWN)
        return image_fail(error, path, "unknown format, the name must end in .exr, .pfm or .png");
    if (format != IMAGE_EXR && img->channels != 1 && img->channels != 3)
        return image_fail(error, path, "%d channels do not fit this format", img->channels);
    if (format == IMAGE_PNG && (int64_t)img->width * img->height > INT32_MAX / 4)
        return image_fail(error, path, "too large for a PNG, use .exr or .pfm");
    FILE *file = image_open_pending(path, pending, error);
    if (!file)
        return 0;
    errno = 0;
    if (format == IMAGE_EXR) {
        image_plane planes[IMAGE_MAX_PLANES];
        fclose(file); /* the name is ours now; OpenEXR opens it again */
        for (int c = 0; c < img->channels && c < IMAGE_MAX_PLANES; ++c) {
            planes[c].name = names[c];
            planes[c].data = img->data + c;
            planes[c].step = img->channels;
            planes[c].stride = (ptrdiff_t)sizeof(float) * img->channels * img->width;
        }
        if (img->channels <= IMAGE_MAX_PLANES
                ? write_exr(pending->temporary, path, img, planes, img->channels, EXR_COMPRESSION_ZIP, error)
                : image_fail(error, path, "more than %d channels", IMAGE_MAX_PLANES))
            return 1;
        image_discard(pending);
        return 0;
    }
    int ok = format == IMAGE_PFM ? write_pfm(file, img) : write_png(file, img, range);
    return image_close_pending(file, ok, path, pending, error);
}

int image_write_planes(const char *path, int width, int height, const image_plane *planes, int count,
                       image_error *error) {
    image like;
    memset(&like, 0, sizeof like);
    like.width = like.display_width = width;
    like.height = like.display_height = height;
    return write_exr(path, path, &like, planes, count, EXR_COMPRESSION_NONE, error);
}

int image_write_text(const char *path, const char *text, image_pending *pending, image_error *error) {
    FILE *file = image_open_pending(path, pending, error);
    if (!file)
        return 0;
    errno = 0;
    return image_close_pending(file, fputs(text, file) >= 0, path, pending, error);
}

int image_write_bytes(const char *path, const void *bytes, size_t size, image_pending *pending, image_error *error) {
    FILE *file = image_open_pending(path, pending, error);
    if (!file)
        return 0;
    errno = 0;
    return image_close_pending(file, fwrite(bytes, 1, size, file) == size, path, pending, error);
}

int image_commit(image_pending *pending, image_error *error) {
    int ok = pending->temporary && rename(pending->temporary, pending->path) == 0;
    if (!ok)
        image_fail(error, pending->path ? pending->path : "(nothing)", "cannot write: %s", strerror(errno));
    else {
        free(pending->temporary); /* nothing left to remove */
        pending->temporary = NULL;
    }
    image_discard(pending);
    return ok;
}

void image_discard(image_pending *pending) {
    if (pending->temporary)
        unlink(pending->temporary);
    free(pending->temporary);
    free(pending->path);
    memset(pending, 0, sizeof *pending);
}
