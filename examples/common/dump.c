#include "dump.h"

#include "gtso.h"

#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PATH_SIZE = 4096, STAGES_SIZE = 1024, BUFFERS = 8 };

struct dump {
    char path[PATH_SIZE], temporary[PATH_SIZE], frame[64]; /* subdirectory of a sequence, or "" */
    char stages[STAGES_SIZE];                              /* items of the array */
    char *settings;
    size_t used, room;
    int failed; /* no memory for the settings */
    void *buffers[BUFFERS];
    int buffer_count;
};

static int no_memory(const dump *d, image_error *error) {
    return image_fail(error, d->path, "not enough memory");
}

static void *keep(dump *d, size_t bytes) {
    void *p = d->buffer_count < BUFFERS ? calloc(1, bytes) : NULL;
    if (p)
        d->buffers[d->buffer_count++] = p;
    return p;
}

/* ---- the directory ------------------------------------------------------------------------------------------------ */

static int is_empty(const char *path) {
    DIR *dir = opendir(path);
    int count = 0;
    if (!dir)
        return 0;
    for (const struct dirent *e; (e = readdir(dir)) != NULL;)
        count += strcmp(e->d_name, ".") != 0 && strcmp(e->d_name, "..") != 0;
    closedir(dir);
    return count == 0;
}

/* A directory of this file's making: files, and directories of files. */
static void remove_tree(const char *path, int depth) {
    DIR *dir = opendir(path);
    char name[PATH_SIZE + 260];
    if (!dir)
        return;
    for (const struct dirent *e; (e = readdir(dir)) != NULL;) {
        if (strcmp(e->d_name, ".") == 0 || strcmp(e->d_name, "..") == 0)
            continue;
        snprintf(name, sizeof name, "%s/%s", path, e->d_name);
        if (unlink(name) != 0 && depth > 0)
            remove_tree(name, depth - 1);
    }
    closedir(dir);
    rmdir(path);
}

dump *dump_create(const char *directory, image_error *error) {
    dump *d = calloc(1, sizeof *d);
    size_t n = strlen(directory);
    struct stat info;
    while (n > 1 && directory[n - 1] == '/')
        --n;
    if (!d || n + 40 > PATH_SIZE) {
        image_fail(error, directory, d ? "name too long" : "not enough memory");
        free(d);
        return NULL;
    }
    memcpy(d->path, directory, n);
    if (stat(d->path, &info) == 0 && !(S_ISDIR(info.st_mode) && is_empty(d->path))) {
        image_fail(error, d->path, "exists already");
        free(d);
        return NULL;
    }
    snprintf(d->temporary, sizeof d->temporary, "%.*s.%ld.tmp", PATH_SIZE - 40, d->path, (long)getpid());
    if (mkdir(d->temporary, 0777) != 0) {
        image_fail(error, d->path, "cannot create: %s", strerror(errno));
        free(d);
        return NULL;
    }
    return d;
}

static void file_name(const dump *d, const char *stage, const char *ending, char *path, size_t size) {
    snprintf(path, size, "%s/%s%s%s%s", d->temporary, d->frame, d->frame[0] ? "/" : "", stage, ending);
}

static void append(dump *d, const char *format, ...) {
    va_list args;
    for (int attempt = 0; attempt < 2; ++attempt) {
        va_start(args, format);
        int n = vsnprintf(d->settings ? d->settings + d->used : NULL, d->room - d->used, format, args);
        va_end(args);
        if (n >= 0 && d->used + (size_t)n < d->room) {
            d->used += (size_t)n;
            return;
        }
        size_t room = 2 * d->room + (size_t)n + 4096;
        char *more = realloc(d->settings, room);
        d->failed |= !more;
        if (!more)
            return;
        d->settings = more;
        d->room = room;
    }
}

/* Writes the settings of this frame, or of the whole, and forgets them. */
static int finish(dump *d, image_error *error) {
    char path[PATH_SIZE + 200];
    image_pending pending;
    int ok;
    if (!d->used)
        return 1;
    append(d, "  \"stages\": [%s]\n}\n", d->stages);
    if (d->failed)
        return no_memory(d, error);
    file_name(d, "settings", ".json", path, sizeof path);
    ok = image_write_text(path, d->settings, &pending, error) && image_commit(&pending, error);
    d->used = 0;
    d->stages[0] = 0;
    return ok;
}

int dump_frame(dump *d, const char *name, image_error *error) {
    char path[PATH_SIZE + 200];
    if (!finish(d, error))
        return 0;
    snprintf(d->frame, sizeof d->frame, "%s", name);
    snprintf(path, sizeof path, "%s/%s", d->temporary, d->frame);
    return mkdir(path, 0777) == 0 || image_fail(error, d->path, "cannot create %s: %s", name, strerror(errno));
}

void dump_discard(dump *d) {
    if (!d)
        return;
    if (d->temporary[0])
        remove_tree(d->temporary, 1);
    for (int i = 0; i < d->buffer_count; ++i)
        free(d->buffers[i]);
    free(d->settings);
    free(d);
}

int dump_commit(dump *d, image_error *error) {
    int ok = finish(d, error);
    if (ok && rename(d->temporary, d->path) != 0)
        ok = image_fail(error, d->path, "cannot rename: %s", strerror(errno));
    if (ok)
        d->temporary[0] = 0;
    dump_discard(d);
    return ok;
}

/* ---- files and keys ----------------------------------------------------------------------------------------------- */

int dump_stage(dump *d, const char *stage, int width, int height, const image_plane *planes, int count,
               image_error *error) {
    char path[PATH_SIZE + 200];
    size_t n = strlen(d->stages);
    snprintf(d->stages + n, sizeof d->stages - n, "%s\"%s\"", n ? ", " : "", stage);
    file_name(d, stage, ".exr", path, sizeof path);
    return image_write_planes(path, width, height, planes, count, error);
}

static void key(dump *d, const char *name) {
    append(d, d->used ? "  \"%s\": " : "{\n  \"%s\": ", name);
}

void dump_integer(dump *d, const char *name, long value) {
    key(d, name);
    append(d, "%ld,\n", value);
}

void dump_floats(dump *d, const char *name, const float *values, int count) {
    key(d, name);
    for (int i = 0; i < count; ++i) {
        double v = (double)values[i], most = 3.4028234663852886e38; /* JSON has no infinity */
        append(d, "%s%.9g", i ? ", " : count > 1 ? "[" : "", v > most ? most : v < -most ? -most : v);
    }
    append(d, count > 1 ? "],\n" : ",\n");
}

void dump_text(dump *d, const char *name, const char *value) {
    key(d, name);
    append(d, "\"%s\",\n", value);
}

/* ---- of gtao.h ---------------------------------------------------------------------------------------------------- */

enum { MAX_PLANES = IMAGE_MAX_PLANES };

/* Planes by name, as they are collected. */
typedef struct planes {
    image_plane plane[MAX_PLANES];
    char name[MAX_PLANES][24];
    int count;
} planes;

static void add(planes *p, const float *data, int step, ptrdiff_t stride, const char *format, ...) {
    va_list args;
    image_plane *to = p->plane + p->count;
    if (p->count == MAX_PLANES)
        return;
    va_start(args, format);
    vsnprintf(p->name[p->count], sizeof p->name[0], format, args);
    va_end(args);
    to->name = p->name[p->count++];
    to->data = data;
    to->step = step;
    to->stride = stride;
}

/* Three planes name.X, name.Y, name.Z of interleaved pixels. */
static void add_vector(planes *p, const float *data, int step, ptrdiff_t stride, const char *name) {
    for (int i = 0; i < 3; ++i)
        add(p, data + i, step, stride, "%s.%c", name, "XYZ"[i]);
}

static void constants(dump *d, const gtao_context *context, const char *prefix) {
    char name[64];
    gtao_constants c;
    gtao_context_constants(context, &c);
#define INTEGER(field) snprintf(name, sizeof name, "%s" #field, prefix), dump_integer(d, name, c.field);
#define FLOAT(field) snprintf(name, sizeof name, "%s" #field, prefix), dump_floats(d, name, &c.field, 1);
#define FLOATS(field, count) snprintf(name, sizeof name, "%s" #field, prefix), dump_floats(d, name, c.field, count);
    GTAO_CONSTANTS(INTEGER, FLOAT, FLOATS)
#undef INTEGER
#undef FLOAT
#undef FLOATS
}

static void frame_constants(dump *d, const gtao_frame_context *frame) {
    gtao_frame_constants c;
    gtao_frame_get_constants(frame, &c);
#define INTEGER(field) dump_integer(d, #field, c.field);
#define FLOAT(field) dump_floats(d, #field, &c.field, 1);
#define FLOATS(field, count) dump_floats(d, #field, c.field, count);
    GTAO_FRAME_CONSTANTS(INTEGER, FLOAT, FLOATS)
#undef INTEGER
#undef FLOAT
#undef FLOATS
}

static void begin_settings(dump *d, const gtao_context *search) {
    dump_integer(d, "dump", 1);
    dump_integer(d, "version", GTAO_VERSION);
    dump_text(d, "isa", gtao_isa_name(gtao_context_isa(search)));
    constants(d, search, "");
}

int dump_planes(dump *d, int width, int height, int slices, int arcs, int signal, gtao_output *output,
                image_error *error) {
    size_t plane = (size_t)width * (size_t)height * sizeof(float), k = (size_t)slices;
    output->surface = keep(d, 7 * plane);
    output->slices = keep(d, 3 * k * plane);
    output->horizons = keep(d, 2 * k * plane);
    output->arcs = arcs ? keep(d, 2 * k * plane) : NULL;
    output->signal_planes = signal ? 5 : 0;
    output->signal = signal ? keep(d, 5 * plane) : NULL;
    if (signal && !output->signal)
        return no_memory(d, error);
    return output->surface && output->slices && output->horizons && (output->arcs || !arcs) ? 1 : no_memory(d, error);
}

int dump_input(dump *d, const gtao_desc *desc, const gtao_frame_desc *frame, image_error *error) {
    planes p;
    ptrdiff_t row = (ptrdiff_t)desc->width * 4;
    int n = desc->normal_components ? desc->normal_components : 3;
    p.count = 0;
    add(&p, desc->depth, 1, desc->depth_stride ? desc->depth_stride : row, "depth");
    if (desc->normals)
        add_vector(&p, desc->normals, n, desc->normal_stride ? desc->normal_stride : row * n, "normal");
    if (frame && frame->motion) {
        n = frame->motion_components ? frame->motion_components : 2;
        for (int i = 0; i < n; ++i)
            add(&p, frame->motion + i, n, frame->motion_stride ? frame->motion_stride : row * n, "motion.%c", "XYZ"[i]);
    }
    return dump_stage(d, "input", desc->width, desc->height, p.plane, p.count, error);
}

static int dump_heights(dump *d, const gtao_context *context, const gtao_constants *c, image_error *error) {
    size_t row = (size_t)c->width, plane = row * (size_t)c->height;
    int count = c->layers * (c->arcs ? 2 : 1), ok;
    float *heights = malloc(plane * (size_t)count * sizeof *heights);
    planes p;
    if (!heights)
        return no_memory(d, error);
    p.count = 0;
    for (int i = 0; i < count; ++i) {
        int layer = c->arcs ? i / 2 : 0, back = c->arcs && i % 2;
        for (int y = 0; y < c->height; ++y)
            gtao_context_heights(context, layer, back, y, heights + (size_t)i * plane + (size_t)y * row);
        add(&p, heights + (size_t)i * plane, 1, (ptrdiff_t)row * 4, layer ? "%s%d" : "%s", back ? "back" : "height",
            layer);
    }
    ok = dump_stage(d, "height", c->width, c->height, p.plane, p.count, error);
    free(heights);
    return ok;
}

static int dump_noise(dump *d, const gtao_constants *c, image_error *error) {
    static const char *const names[] = {"direction", "offset", "phase"};
    size_t count = (size_t)c->width * (size_t)c->height;
    float *noise = malloc(3 * count * sizeof *noise), *to = noise;
    planes p;
    int ok;
    if (!noise)
        return no_memory(d, error);
    for (int y = 0; y < c->height; ++y)
        for (int x = 0; x < c->width; ++x, to += 3) {
            gtao_noise_at((gtao_noise)c->noise, x, y, (uint32_t)c->frame, to, to + 1);
            to[2] = (float)(y % c->period * c->period + x % c->period);
        }
    p.count = 0;
    for (int i = 0; i < 3; ++i)
        add(&p, noise + i, 3, (ptrdiff_t)c->width * 12, "%s", names[i]);
    ok = dump_stage(d, "noise", c->width, c->height, p.plane, p.count, error);
    free(noise);
    return ok;
}

static int dump_directions(dump *d, const gtao_context *context, const gtao_constants *c, image_error *error) {
    static const char *const fields[] = {"slice_dx", "slice_dy", "slice_bx", "slice_by", "slice_bb"};
    size_t directions = (size_t)(c->period * c->period * c->slices);
    float *values = malloc(5 * directions * sizeof *values);
    if (!values)
        return no_memory(d, error);
    for (size_t i = 0; i < directions; ++i) {
        gtao_direction s = gtao_context_direction(context, (int)i / c->slices, (int)i % c->slices);
        values[i] = s.dx, values[directions + i] = s.dy, values[2 * directions + i] = s.bx;
        values[3 * directions + i] = s.by, values[4 * directions + i] = s.bb;
    }
    for (size_t i = 0; i < 5; ++i)
        dump_floats(d, fields[i], values + i * directions, (int)directions);
    free(values);
    return 1;
}

/* The directions and the numbers of samples as keys, the samples as an image. */
static int dump_tables(dump *d, const gtao_context *context, const gtao_constants *c, image_error *error) {
    static const char *const names[] = {"qx", "qy", "inv_length", "ux", "uy"};
    size_t directions = (size_t)(c->period * c->period * c->slices), lists = directions * (size_t)c->classes;
    size_t rows = c->every_pixel ? directions : lists, steps = (size_t)c->steps;
    float *counts = malloc(lists * sizeof *counts);
    gtao_tap *taps = malloc(steps * sizeof *taps);
    float *samples = rows <= IMAGE_MAX_SIZE ? calloc(rows * steps * 5, sizeof *samples) : NULL;
    int ok = counts && taps && (samples || rows > IMAGE_MAX_SIZE);
    for (size_t i = 0; ok && i < directions; ++i) {
        int phase = (int)i / c->slices, k = (int)i % c->slices;
        for (int r = 0; r < c->classes; ++r) {
            size_t list = i * (size_t)c->classes + (size_t)r;
            int n = gtao_context_taps(context, phase, k, r, taps);
            float *to = samples ? samples + (c->every_pixel ? i : list) * steps * 5 : NULL;
            counts[list] = (float)n;
            for (int j = 0; to && j < n; ++j, to += 5) {
                to[0] = (float)taps[j].qx, to[1] = (float)taps[j].qy;
                to[2] = taps[j].inv_length, to[3] = taps[j].ux, to[4] = taps[j].uy;
            }
        }
    }
    if (ok) {
        planes p;
        p.count = 0;
        for (int i = 0; i < 5; ++i)
            add(&p, samples + i, 5, (ptrdiff_t)steps * 20, "%s", names[i]);
        ok = dump_directions(d, context, c, error);
        dump_floats(d, "sample_count", counts, (int)lists);
        if (ok && samples)
            ok = dump_stage(d, "samples", c->steps, (int)rows, p.plane, p.count, error);
    } else {
        no_memory(d, error);
    }
    free(counts);
    free(taps);
    free(samples);
    return ok;
}

static int dump_horizons(dump *d, const gtao_constants *c, const float *horizons, image_error *error) {
    planes p;
    p.count = 0;
    for (int i = 0; i < 2 * c->slices; ++i)
        add(&p, horizons + (size_t)i * (size_t)c->width * (size_t)c->height, 1, (ptrdiff_t)c->width * 4, "%02d.%s",
            i / 2, i % 2 ? "minus" : "plus");
    return dump_stage(d, "horizons", c->width, c->height, p.plane, p.count, error);
}

int dump_search(dump *d, const gtao_context *search, const gtao_context *whole, const gtao_output *output,
                image_error *error) {
    gtao_constants c;
    planes p;
    size_t plane;
    ptrdiff_t row;
    int ok;
    gtao_context_constants(search, &c);
    plane = (size_t)c.width * (size_t)c.height, row = (ptrdiff_t)c.width * 4;
    begin_settings(d, search);
    constants(d, whole, "full_");
    ok = dump_heights(d, search, &c, error);
    if (ok) {
        static const char *const names[] = {"normal.X",   "normal.Y", "normal.Z", "gradient.X",
                                            "gradient.Y", "extent",   "class"};
        p.count = 0;
        for (size_t i = 0; i < 7; ++i)
            add(&p, output->surface + i * plane, 1, row, "%s", names[i]);
        ok = dump_stage(d, "surface", c.width, c.height, p.plane, p.count, error);
    }
    ok = ok && dump_noise(d, &c, error);
    if (c.noise != GTAO_NOISE_HILBERT)
        ok = ok && dump_tables(d, search, &c, error);
    if (ok) {
        static const char *const names[] = {"n", "jacobian", "open"};
        p.count = 0;
        for (int i = 0; i < 3 * c.slices; ++i)
            add(&p, output->slices + (size_t)i * plane, 1, row, "%02d.%s", i / 3, names[i % 3]);
        ok = dump_stage(d, "slices", c.width, c.height, p.plane, p.count, error);
    }
    ok = ok && dump_horizons(d, &c, output->horizons, error);
    if (ok && output->arcs) { /* halves of the masks, which floats hold exactly */
        size_t count = 2 * (size_t)c.slices * plane;
        float *halves = malloc(2 * count * sizeof *halves);
        p.count = 0;
        for (size_t i = 0; halves && i < count; ++i) {
            halves[2 * i] = (float)(output->arcs[i] & 0xffffu);
            halves[2 * i + 1] = (float)(output->arcs[i] >> 16);
        }
        for (int i = 0; halves && i < 4 * c.slices; ++i)
            add(&p, halves + 2 * (size_t)(i / 2) * plane + i % 2, 2, 2 * row, "%02d.%s.%s", i / 4,
                i / 2 % 2 ? "minus" : "plus", i % 2 ? "high" : "low");
        ok = halves ? dump_stage(d, "arcs", c.width, c.height, p.plane, p.count, error) : no_memory(d, error);
        free(halves);
    }
    return ok;
}

int dump_signal(dump *d, const gtao_context *context, const float *signal, int count, image_error *error) {
    static const char *const names[] = {"visibility", "weight", "bent.X", "bent.Y", "bent.Z"};
    gtao_constants c;
    planes p;
    gtao_context_constants(context, &c);
    p.count = 0;
    for (int i = 0; i < count; ++i)
        add(&p, signal + (size_t)i * (size_t)c.width * (size_t)c.height, 1, (ptrdiff_t)c.width * 4, "%s", names[i]);
    return dump_stage(d, "raw", c.width, c.height, p.plane, p.count, error);
}

int dump_frame_stage(dump *d, const gtao_frame_context *frame, int stage, const gtao_output *output,
                     image_error *error) {
    const char *name = gtao_frame_stage_name(frame, stage), *plane_name;
    char file[32];
    gtao_constants c;
    ptrdiff_t stride;
    planes p;
    int spatial = 0;
    gtao_context_constants(gtao_frame_horizons(frame), &c);
    p.count = 0;
    for (const float *at; (at = gtao_frame_stage_plane(frame, stage, p.count, &plane_name, &stride)) != NULL;)
        add(&p, at, 1, stride, "%s", plane_name);
    if (p.count == 0)
        return 1;
    for (int i = 0; i <= stage; ++i)
        spatial += strcmp(gtao_frame_stage_name(frame, i), "spatial") == 0;
    snprintf(file, sizeof file, strcmp(name, "spatial") == 0 ? "%s%d" : "%s", name, spatial);
    if (strcmp(name, "horizons") == 0) {
        if (!dump_search(d, gtao_frame_horizons(frame), gtao_frame_image(frame), output, error))
            return 0;
        frame_constants(d, frame);
        snprintf(file, sizeof file, "raw");
    }
    return dump_stage(d, file, c.width, c.height, p.plane, p.count, error);
}

/* Specular visibility by the default table at three roughnesses. */
static int dump_specular(dump *d, const gtao_constants *c, const float *visibility, const float *bent,
                         const float *surface, image_error *error) {
    static const float roughness[] = {0.2f, 0.5f, 0.8f};
    size_t count = (size_t)c->width * (size_t)c->height;
    gtso_table_desc table, resolved;
    gtso_lookup_desc lookup;
    planes p;
    float *normals = malloc(3 * count * sizeof *normals), *views = malloc(3 * count * sizeof *views);
    float *out = malloc(3 * count * sizeof *out), *data = NULL;
    int ok = normals && views && out;
    memset(&table, 0, sizeof table);
    if (ok)
        data = malloc(gtso_table_count(&table) * sizeof *data);
    ok = data && gtso_bake(&table, data, NULL) == GTSO_OK && gtso_table_resolve(&table, &resolved) == GTSO_OK;
    for (size_t i = 0; ok && i < count; ++i) {
        float x = 0.0f, y = 0.0f, scale;
        for (size_t k = 0; k < 3; ++k) /* where nothing was computed the bent normal is the normal */
            normals[3 * i + k] = surface[6 * count + i] < 0.0f ? bent[3 * i + k] : surface[k * count + i];
        if (!c->orthographic) {
            x = ((float)(i % (size_t)c->width) + 0.5f - c->cx) * c->bx1;
            y = ((float)(i / (size_t)c->width) + 0.5f - c->cy) * c->by1;
        }
        scale = -1.0f / sqrtf(x * x + y * y + 1.0f);
        views[3 * i] = x * scale, views[3 * i + 1] = y * scale, views[3 * i + 2] = scale;
    }
    memset(&lookup, 0, sizeof lookup);
    lookup.width = c->width, lookup.height = c->height;
    lookup.table = &table, lookup.data = data;
    lookup.visibility = visibility, lookup.weighting = (gtao_weighting)c->weighting;
    lookup.bent_normals = bent, lookup.normals = normals, lookup.views = views;
    p.count = 0;
    for (size_t i = 0; ok && i < 3; ++i) {
        lookup.constant_roughness = roughness[i];
        lookup.output = out + i * count;
        ok = gtso_lookup(&lookup) == GTSO_OK;
        add(&p, out + i * count, 1, (ptrdiff_t)c->width * 4, "roughness.%02d", (int)(100.0f * roughness[i] + 0.5f));
    }
    if (ok) {
        float f0 = resolved.f0, size[3];
        planes t;
        t.count = 0;
        for (int i = 0; i < 3; ++i)
            size[i] = (float)resolved.size[i];
        dump_floats(d, "specular_roughness", roughness, 3);
        dump_floats(d, "specular_f0", &f0, 1);
        dump_floats(d, "specular_size", size, 3);
        add(&t, data, 1, (ptrdiff_t)resolved.size[0] * 4, "table");
        ok = dump_stage(d, "specular_table", resolved.size[0], resolved.size[1] * resolved.size[2], t.plane, t.count,
                        error) &&
             dump_stage(d, "specular", c->width, c->height, p.plane, p.count, error);
    } else {
        no_memory(d, error);
    }
    free(normals);
    free(views);
    free(out);
    free(data);
    return ok;
}

/* The result, as floats and as bytes. */
static int dump_packed(dump *d, const gtao_constants *c, const float *visibility, const float *bent,
                       image_error *error) {
    size_t count = (size_t)c->width * (size_t)c->height;
    ptrdiff_t row = (ptrdiff_t)c->width * 4;
    float *four = malloc(4 * count * sizeof *four);
    planes p;
    int ok;
    if (!four)
        return no_memory(d, error);
    p.count = 0;
    add(&p, visibility, 1, row, "visibility");
    add_vector(&p, bent, 3, 3 * row, "bent");
    ok = dump_stage(d, "result", c->width, c->height, p.plane, p.count, error);
    for (size_t i = 0; i < count; ++i) {
        uint32_t bytes = gtao_pack(visibility[i], bent + 3 * i);
        for (size_t k = 0; k < 4; ++k)
            four[4 * i + k] = (float)(bytes >> 8 * k & 255u);
    }
    p.count = 0;
    add(&p, four, 4, 4 * row, "visibility");
    add_vector(&p, four + 1, 4, 4 * row, "bent");
    ok = ok && dump_stage(d, "packed", c->width, c->height, p.plane, p.count, error);
    free(four);
    return ok;
}

int dump_result(dump *d, const gtao_context *whole, const float *visibility, const float *bent, const float *sh,
                const float *surface, const float albedo[3], image_error *error) {
    static const char *const rgb[] = {"visibility", "R", "G", "B"};
    gtao_constants c;
    size_t count;
    ptrdiff_t row;
    float *four;
    planes p;
    int ok;
    gtao_context_constants(whole, &c);
    count = (size_t)c.width * (size_t)c.height, row = (ptrdiff_t)c.width * 4;
    four = malloc(4 * count * sizeof *four);
    if (!four)
        return no_memory(d, error);

    ok = dump_packed(d, &c, visibility, bent, error);

    if (sh) {
        p.count = 0;
        for (int i = 0; i < 9; ++i)
            add(&p, sh + (size_t)i * count, 1, row, "sh.%d", i);
        ok = ok && dump_stage(d, "sh", c.width, c.height, p.plane, p.count, error);
    }

    for (size_t i = 0; i < count; ++i) {
        four[4 * i] = gtao_multi_bounce(visibility[i], 0.5f);
        gtao_multi_bounce_rgb(visibility[i], albedo, four + 4 * i + 1);
    }
    p.count = 0;
    for (int i = 0; i < 4; ++i)
        add(&p, four + i, 4, 4 * row, "%s", rgb[i]);
    dump_floats(d, "albedo", albedo, 3);
    ok = ok && dump_stage(d, "multi_bounce", c.width, c.height, p.plane, p.count, error);
    free(four);
    if (surface)
        ok = ok && dump_specular(d, &c, visibility, bent, surface, error);
    return ok;
}

int dump_sweep(dump *d, const gtao_desc *desc, const gtao_sweep *sweep, const float *visibility, const float *bent,
               const float *horizons, image_error *error) {
    const gtao_context *context = gtao_sweep_context(sweep);
    gtao_constants c;
    gtao_context_constants(context, &c);
    if (!dump_input(d, desc, NULL, error))
        return 0;
    begin_settings(d, context);
    return dump_directions(d, context, &c, error) && dump_heights(d, context, &c, error) &&
           dump_horizons(d, &c, horizons, error) && dump_packed(d, &c, visibility, bent, error);
}
