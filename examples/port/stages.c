/* stages.c - see stages.h */
#include "stages.h"

#include "settings.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

enum { MOST_AT_ONCE = 8 }; /* channels that image_read_channels takes */
enum { PATH_SIZE = 4096, MAX_SHADERS = 16, MAX_POOL = 48, MAX_NAMES = 4 * 64, NAME_SIZE = 24 };

/* ---- shaders ----------------------------------------------------------------------------------------------------- */

struct shaders {
    gpu *g;
    char compiled[PATH_SIZE], sources[PATH_SIZE], defines[256];
    int own; /* `compiled` is a directory of ours, to be removed */
    char name[MAX_SHADERS][NAME_SIZE];
    gpu_shader *shader[MAX_SHADERS];
    int count;
};

shaders *shaders_open(gpu *g, const char *compiled, const char *sources, const char *defines, image_error *error) {
    shaders *s = calloc(1, sizeof *s);
    const char *base = getenv("TMPDIR");
    if (!s || strlen(compiled) + 64 > PATH_SIZE || strlen(sources) + 64 > PATH_SIZE ||
        strlen(defines) >= sizeof s->defines) {
        image_fail(error, compiled, s ? "name too long" : "not enough memory");
        free(s);
        return NULL;
    }
    s->g = g;
    strcpy(s->compiled, compiled);
    strcpy(s->sources, sources);
    strcpy(s->defines, defines);
    if (defines[0]) {
        snprintf(s->compiled, sizeof s->compiled, "%.4000s/gtao-shaders-XXXXXX", base && base[0] ? base : "/tmp");
        s->own = mkdtemp(s->compiled) != NULL;
        if (!s->own) {
            image_fail(error, s->compiled, "cannot be created");
            free(s);
            return NULL;
        }
    }
    return s;
}

void shaders_close(shaders *s) {
    char path[PATH_SIZE + 64];
    if (!s)
        return;
    for (int i = 0; i < s->count; ++i) {
        gpu_shader_destroy(s->g, s->shader[i]);
        snprintf(path, sizeof path, "%s/%s.spv", s->compiled, s->name[i]);
        if (s->own)
            unlink(path);
    }
    if (s->own)
        rmdir(s->compiled);
    free(s);
}

/* The same command as the Makefile's. */
static int compile(const shaders *s, const char *name, image_error *error) {
    enum { MOST = 24 };
    char source[PATH_SIZE + 64], target[PATH_SIZE + 64], defines[sizeof s->defines + 2 * MOST], *at = defines;
    const char *args[MOST + 16] = {
        "glslangValidator",     "--quiet", "-D", "-V", "-S", "comp", "-e", "main", "--hlsl-enable-16bit-types",
        "--shift-ssbo-binding", "1"};
    int n = 11, status = 0;
    snprintf(source, sizeof source, "%s/%s.hlsl", s->sources, name);
    snprintf(target, sizeof target, "%s/%s.spv", s->compiled, name);
    for (const char *from = s->defines; *from && n < MOST;) {
        size_t length = strcspn(from, " ");
        args[n++] = at;
        at += sprintf(at, "-D%.*s", (int)length, from) + 1;
        from += length + strspn(from + length, " ");
    }
    args[n++] = source;
    args[n++] = "-o";
    args[n] = target;
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        if (dup2(STDERR_FILENO, STDOUT_FILENO) >= 0) /* its messages are errors */
            execvp(args[0], (char *const *)(uintptr_t)args);
        _exit(127);
    }
    if (child < 0 || waitpid(child, &status, 0) < 0 || !WIFEXITED(status))
        return image_fail(error, source, "cannot be compiled");
    if (WEXITSTATUS(status) == 127)
        return image_fail(error, source, "needs glslangValidator, which is not installed");
    return WEXITSTATUS(status) == 0 || image_fail(error, source, "does not compile");
}

static gpu_shader *shader_of(shaders *s, const char *name, image_error *error) {
    char path[PATH_SIZE + 64];
    gpu_error why;
    for (int i = 0; i < s->count; ++i)
        if (strcmp(s->name[i], name) == 0)
            return s->shader[i];
    if (s->count == MAX_SHADERS || (s->own && !compile(s, name, error)))
        return NULL;
    snprintf(path, sizeof path, "%s/%s.spv", s->compiled, name);
    gpu_shader *shader = gpu_shader_read(s->g, path, &why);
    if (!shader) {
        snprintf(error->text, sizeof error->text, "%s", why.text);
        return NULL;
    }
    snprintf(s->name[s->count], NAME_SIZE, "%s", name);
    return s->shader[s->count++] = shader;
}

/* ---- settings ---------------------------------------------------------------------------------------------------- */

/* A key of settings.json. */
typedef struct setting {
    char *key, *text; /* of its value, as it stands in the file */
    float *values;
    int count, whole; /* whole: an integer */
} setting;

struct frame {
    gpu *g;
    char directory[PATH_SIZE];
    setting *settings;
    int setting_count;
    planes reference[MAX_POOL], result[MAX_POOL];
    int reference_count, result_count;
    gpu_buffer *nothing; /* bound where there is nothing to read */
    int width, height, full_width, full_height, slices, layers, arcs, framed;
};

/* The dump writes a key a line. */
static int read_settings(frame *f, image_error *error) {
    char path[PATH_SIZE + 64];
    snprintf(path, sizeof path, "%s/settings.json", f->directory);
    char *json = settings_read(path);
    int room = 0, ok = json != NULL;
    if (!json)
        return image_fail(error, path, "cannot be read");
    for (const char *at = json; ok && *at;) {
        size_t line = strcspn(at, "\n"), indent = strspn(at, " {"), length = 0, value = 0;
        if (indent < line && at[indent] == '"') {
            length = strcspn(at + indent + 1, "\"");
            value = indent + length + 2;
        }
        if (value && value < line) {
            int numbers = 1;
            setting *s = f->settings;
            for (size_t i = value; i < line; ++i)
                numbers += at[i] == ',';
            if (f->setting_count == room)
                s = realloc(f->settings, sizeof *s * (size_t)(room = 2 * room + 64));
            ok = s != NULL;
            if (!ok)
                break;
            f->settings = s;
            s += f->setting_count++;
            s->key = strndup(at + indent + 1, length);
            s->text = strndup(at + value, line - value);
            s->values = malloc(sizeof(float) * (size_t)numbers);
            s->count = 0;
            ok = s->key && s->text && s->values;
            if (ok && !strchr(s->text, '"'))
                s->count = settings_floats(json, s->key, s->values, numbers);
            s->whole = ok && s->count == 1 && !strpbrk(s->text, ".eE");
        }
        at += line + (at[line] == '\n');
    }
    free(json);
    return ok ? 1 : image_fail(error, path, "not enough memory");
}

static const setting *find(const frame *f, const char *key) {
    for (int i = 0; i < f->setting_count; ++i)
        if (strcmp(f->settings[i].key, key) == 0)
            return f->settings + i;
    return NULL;
}

float frame_setting(const frame *f, const char *key, float otherwise) {
    const setting *s = find(f, key);
    return s && s->count == 1 ? s->values[0] : otherwise;
}

int frame_has_stage(const frame *f, const char *stage) {
    const setting *s = find(f, "stages");
    char quoted[NAME_SIZE + 2];
    snprintf(quoted, sizeof quoted, "\"%s\"", stage);
    return s && strstr(s->text, quoted) != NULL;
}

static int integer(const frame *f, const char *key, int otherwise) {
    return (int)frame_setting(f, key, (float)otherwise);
}

/* ---- planes ------------------------------------------------------------------------------------------------------ */

/* Where planes are in the dump: some of the channels of a file; # stands for the number of each slice. */
typedef struct place {
    const char *name, *file;
    const char *channels[10];
} place;

static const place places[] = {
    {"depth", "input", {"depth"}},
    {"given_normals", "input", {"normal.X", "normal.Y", "normal.Z"}},
    {"given_motion", "input", {"motion.X", "motion.Y", "motion.Z"}},
    {"reduced_height", "reduce", {"height"}},
    {"reduced_normals", "reduce", {"normal.X", "normal.Y", "normal.Z"}},
    {"reduced_motion", "reduce", {"motion.X", "motion.Y", "motion.Z"}},
    {"height", "height", {"height", "back"}},
    {"surface", "surface", {"normal.X", "normal.Y", "normal.Z", "gradient.X", "gradient.Y", "extent", "class"}},
    {"noise", "noise", {"direction", "offset", "phase"}},
    {"samples", "samples", {"qx", "qy", "inv_length", "ux", "uy"}},
    {"slices", "slices", {"#.n", "#.jacobian", "#.open"}},
    {"horizons", "horizons", {"#.plus", "#.minus"}},
    {"arcs", "arcs", {"#.plus.low", "#.plus.high", "#.minus.low", "#.minus.high"}},
    {"raw", "raw", {"visibility", "weight", "bent.X", "bent.Y", "bent.Z"}},
    {"spatial1", "spatial1", {"visibility", "weight", "bent.X", "bent.Y", "bent.Z"}},
    {"spatial2", "spatial2", {"visibility", "weight", "bent.X", "bent.Y", "bent.Z"}},
    {"spatial3", "spatial3", {"visibility", "weight", "bent.X", "bent.Y", "bent.Z"}},
    {"history", "temporal", {"visibility", "length", "bent.X", "bent.Y", "bent.Z", "speed", "last", "deviation"}},
    {"result", "result", {"visibility", "bent.X", "bent.Y", "bent.Z"}},
    {"packed", "packed", {"visibility", "bent.X", "bent.Y", "bent.Z"}},
    {"sh", "sh", {"sh.0", "sh.1", "sh.2", "sh.3", "sh.4", "sh.5", "sh.6", "sh.7", "sh.8"}},
    {"multi_bounce", "multi_bounce", {"visibility", "R", "G", "B"}},
    {"specular_table", "specular_table", {"table"}},
    {"specular", "specular", {"roughness.20", "roughness.50", "roughness.80"}},
    {"octahedral", "octahedral", {"visibility", "bent.X", "bent.Y", "bent.Z"}},
    {"halves", "halves", {"visibility", "bent.X", "bent.Y", "bent.Z"}},
};
enum { PLACES = sizeof places / sizeof *places };

static const place *place_of(const char *name) {
    for (int i = 0; i < PLACES; ++i)
        if (strcmp(places[i].name, name) == 0)
            return places + i;
    return NULL;
}

/* Names of the channels, in the order of the planes; how many. */
static int channels_of(const frame *f, const place *p, char names[MAX_NAMES][NAME_SIZE]) {
    int each = 0, count, repeat = 1, n = 0;
    while (each < 10 && p->channels[each])
        ++each;
    if (strcmp(p->name, "height") == 0) {
        each = f->arcs ? 2 : 1;
        repeat = f->layers;
    } else if (p->channels[0][0] == '#') {
        repeat = f->slices;
    }
    count = each * repeat;
    for (; n < count && n < MAX_NAMES; ++n) {
        const char *name = p->channels[n % each];
        if (name[0] == '#')
            snprintf(names[n], NAME_SIZE, "%02d%s", n / each % 100, name + 1);
        else if (n >= each)
            snprintf(names[n], NAME_SIZE, "%.16s%d", name, n / each % 100);
        else
            snprintf(names[n], NAME_SIZE, "%s", name);
    }
    return n;
}

static planes *search(planes *pool, int count, const char *name) {
    for (int i = 0; i < count; ++i)
        if (strcmp(pool[i].name, name) == 0)
            return pool + i;
    return NULL;
}

/* A new item of a pool. */
static planes *create(frame *f, planes *pool, int *count, const char *name, int width, int height, int number,
                      image_error *error) {
    gpu_error why;
    planes *p = pool + *count;
    if (*count == MAX_POOL) {
        image_fail(error, name, "too many buffers");
        return NULL;
    }
    p->buffer = gpu_buffer_create(f->g, (size_t)width * (size_t)height * (size_t)number, &why);
    if (!p->buffer) {
        image_fail(error, name, "%s", why.text);
        return NULL;
    }
    snprintf(p->name, sizeof p->name, "%s", name);
    p->width = width;
    p->height = height;
    p->count = number;
    p->data = gpu_buffer_data(p->buffer);
    ++*count;
    return p;
}

/* Tables that settings.json holds, as planes of rows. */
static planes *load_table(frame *f, const char *name, const char *const *keys, int count, image_error *error) {
    const setting *first = find(f, keys[0]);
    planes *p = first ? create(f, f->reference, &f->reference_count, name, first->count, 1, count, error) : NULL;
    for (int i = 0; p && i < count; ++i) {
        const setting *s = find(f, keys[i]);
        if (s && s->count == first->count)
            memcpy(gpu_buffer_data(p->buffer) + (size_t)i * (size_t)s->count, s->values,
                   sizeof(float) * (size_t)s->count);
    }
    return p;
}

/* From the dump's file. Null, without an error, if it has no such channels. */
static planes *load(frame *f, const char *name, image_error *error) {
    static const char *const directions[] = {"slice_dx", "slice_dy", "slice_bx", "slice_by", "slice_bb"};
    static const char *const counts[] = {"sample_count"};
    char names[MAX_NAMES][NAME_SIZE], path[PATH_SIZE + 64];
    const char *wanted[MAX_NAMES];
    const place *p = place_of(name);
    planes *found = search(f->reference, f->reference_count, name);
    image img;
    error->text[0] = 0;
    if (found)
        return found;
    if (strcmp(name, "slice_table") == 0)
        return load_table(f, name, directions, 5, error);
    if (strcmp(name, "sample_count") == 0)
        return load_table(f, name, counts, 1, error);
    if (!p || !frame_has_stage(f, p->file))
        return NULL;
    int count = channels_of(f, p, names), there = 0;
    snprintf(path, sizeof path, "%s/%s.exr", f->directory, p->file);
    char **all = image_list_channels(path, &there, error);
    if (!all)
        return NULL;
    for (int i = 0; i < count; ++i) {
        int has = 0;
        for (int k = 0; k < there; ++k)
            has |= strcmp(all[k], names[i]) == 0;
        wanted[i] = names[i];
        if (!has)
            count = i;
    }
    image_free_names(all);
    for (int from = 0; from < count; from += MOST_AT_ONCE) {
        int n = count - from < MOST_AT_ONCE ? count - from : MOST_AT_ONCE;
        if (!image_read_channels(path, wanted + from, n, &img, error))
            return NULL;
        if (!found)
            found = create(f, f->reference, &f->reference_count, name, img.width, img.height, count, error);
        size_t pixels = (size_t)img.width * (size_t)img.height, step = (size_t)n;
        float *to = found ? gpu_buffer_data(found->buffer) + pixels * (size_t)from : NULL;
        for (size_t c = 0; to && c < step; ++c)
            for (size_t i = 0; i < pixels; ++i)
                *to++ = img.data[step * i + c];
        image_free(&img);
        if (!found)
            return NULL;
    }
    return found;
}

const planes *frame_reference(frame *f, const char *name) {
    image_error ignored;
    return load(f, name, &ignored);
}

const planes *frame_result(const frame *f, const char *name) {
    return search((planes *)(uintptr_t)f->result, f->result_count, name);
}

const planes *frame_result_at(const frame *f, int i) {
    return i < f->result_count ? f->result + i : NULL;
}

/* ---- frames ------------------------------------------------------------------------------------------------------ */

frame *frame_open(gpu *g, const char *directory, image_error *error) {
    frame *f = calloc(1, sizeof *f);
    gpu_error why;
    if (!f || strlen(directory) + 64 > PATH_SIZE) {
        image_fail(error, directory, f ? "name too long" : "not enough memory");
        free(f);
        return NULL;
    }
    f->g = g;
    strcpy(f->directory, directory);
    int ok = read_settings(f, error);
    if (ok) {
        f->width = integer(f, "width", 0);
        f->height = integer(f, "height", 0);
        f->full_width = integer(f, "full_width", f->width);
        f->full_height = integer(f, "full_height", f->height);
        f->slices = integer(f, "slices", 0);
        f->layers = integer(f, "layers", 1);
        f->arcs = integer(f, "arcs", 0);
        f->framed = frame_has_stage(f, "reduce");
        ok = f->width > 0 && f->height > 0 && f->full_width > 0 && f->full_height > 0 && f->slices > 0 &&
             f->slices <= 64 && f->layers > 0 && f->layers <= 9;
        if (!ok || integer(f, "dump", 0) != 1)
            ok = image_fail(error, directory, "not a dump, or one of another version");
    }
    if (ok && !(f->nothing = gpu_buffer_create(g, 1, &why)))
        ok = image_fail(error, directory, "%s", why.text);
    if (ok)
        return f;
    frame_close(f);
    return NULL;
}

void frame_close(frame *f) {
    if (!f)
        return;
    for (int i = 0; i < f->setting_count; ++i) {
        free(f->settings[i].key);
        free(f->settings[i].text);
        free(f->settings[i].values);
    }
    free(f->settings);
    for (int i = 0; i < f->reference_count; ++i)
        gpu_buffer_destroy(f->g, f->reference[i].buffer);
    for (int i = 0; i < f->result_count; ++i)
        gpu_buffer_destroy(f->g, f->result[i].buffer);
    gpu_buffer_destroy(f->g, f->nothing);
    free(f);
}

/* ---- stages ------------------------------------------------------------------------------------------------------ */

typedef struct run {
    frame *f, *before;
    shaders *s;
    int isolated;
    image_error *error;
} run;

/* Names that a stage uses for planes of others: pairs, ended by a null. And what differs of its constants. */
typedef struct call {
    const char *shader;
    const char *names[9];
    int full_size, full_constants; /* runs on the image's pixels; depth to height by the constants full_ */
    const char *window;            /* key */
    int plane;
    float roughness;
} call;

/* Constants whose names in the shaders are not the keys, since buffers have these. */
static const char *const renamed[][2] = {
    {"filter_width", "width"},   {"filter_height", "height"}, {"noise_kind", "noise"},
    {"arcs_on", "arcs"},         {"slice_count", "slices"},   {"layer_count", "layers"},
    {"history_kind", "history"}, {"unit_length", "unit"},     {"albedo_rgb", "albedo"},
};

static void set_constants(const run *r, const call *c, gpu_shader *shader) {
    static const char *const heights[] = {"depth_kind", "w_scale", "w_bias", "w_numerator", "w_far", "w_max", "z_sky"};
    static const char *const sizes[] = {"table_aperture", "table_beta", "table_roughness"};
    frame *f = r->f;
    const char *name;
    int rows;
    for (int i = 0; (name = gpu_shader_constant(shader, i, &rows)) != NULL; ++i) {
        const char *key = name;
        char full[64];
        float own = 0.0f;
        for (size_t k = 0; k < sizeof renamed / sizeof *renamed; ++k)
            if (strcmp(name, renamed[k][0]) == 0)
                key = renamed[k][1];
        for (size_t k = 0; c->full_constants && k < sizeof heights / sizeof *heights; ++k)
            if (strcmp(name, heights[k]) == 0) {
                snprintf(full, sizeof full, "full_%s", name);
                key = find(f, full) ? full : key;
            }
        if (strcmp(name, "window") == 0 && c->window)
            key = c->window;
        const setting *s = find(f, key);
        if (s && s->count >= (rows ? rows : 1)) {
            gpu_shader_set(shader, i, s->values, rows ? s->count / rows : 1);
            continue;
        }
        if (rows)
            continue;
        if (strcmp(name, "scale") == 0)
            own = 1.0f;
        if (strcmp(name, "input_normals") == 0)
            own = frame_reference(f, "given_normals") ? 1.0f : 0.0f;
        if (strcmp(name, "input_motion") == 0)
            own = frame_setting(f, "motion_components", 0.0f);
        if (strcmp(name, "spherical") == 0)
            own = frame_has_stage(f, "sh") ? 1.0f : 0.0f;
        if (strcmp(name, "specular_plane") == 0)
            own = (float)c->plane;
        if (strcmp(name, "roughness") == 0)
            own = c->roughness;
        for (int k = 0; k < 3; ++k)
            if (strcmp(name, sizes[k]) == 0 && (s = find(f, "specular_size")) != NULL && s->count == 3)
                own = s->values[k];
        gpu_shader_set(shader, i, &own, 1);
    }
}

/* What to read under a name of the pool. */
static int input_of(const run *r, const char *name, gpu_buffer **buffer) {
    static const char suffix[] = "_before";
    frame *f = r->f;
    char other[NAME_SIZE];
    size_t n = strlen(name);
    *buffer = f->nothing;
    if (n > sizeof suffix && n < sizeof other && strcmp(name + n + 1 - sizeof suffix, suffix) == 0) {
        memcpy(other, name, n);
        other[n + 1 - sizeof suffix] = 0;
        name = other;
        f = r->before;
    }
    if (!f)
        return 1;
    planes *own = search(f->result, f->result_count, name), *from = NULL;
    if (!own || r->isolated) {
        from = load(f, name, r->error);
        if (!from && r->error->text[0])
            return 0;
    }
    if (from || own)
        *buffer = (from ? from : own)->buffer;
    return 1;
}

static int output_of(const run *r, const char *name, int width, int height, gpu_buffer **buffer) {
    char names[MAX_NAMES][NAME_SIZE];
    frame *f = r->f;
    const place *p = place_of(name);
    planes *own = search(f->result, f->result_count, name);
    int wanted = p && (strcmp(name, "sh") != 0 || frame_has_stage(f, "sh")) && (strcmp(name, "arcs") != 0 || f->arcs);
    if (strcmp(name, "reduced_normals") == 0)
        wanted = frame_reference(f, "given_normals") != NULL;
    if (strcmp(name, "reduced_motion") == 0)
        wanted = frame_reference(f, "given_motion") != NULL;
    *buffer = f->nothing;
    if (!wanted)
        return 1;
    if (!own)
        own = create(f, f->result, &f->result_count, name, width, height, channels_of(f, p, names), r->error);
    if (!own)
        return 0;
    *buffer = own->buffer;
    return 1;
}

static int run_stage(const run *r, const call *c) {
    gpu_shader *shader = shader_of(r->s, c->shader, r->error);
    gpu_buffer *buffers[GPU_MAX_BUFFERS];
    gpu_error why;
    const frame *f = r->f;
    const char *name;
    int ok = shader != NULL, written = 0;
    int width = c->full_size ? f->full_width : f->width, height = c->full_size ? f->full_height : f->height;
    for (int i = 0; ok && (name = gpu_shader_buffer(shader, i, &written)) != NULL; ++i) {
        for (int k = 0; c->names[k]; k += 2)
            if (strcmp(name, c->names[k]) == 0)
                name = c->names[k + 1];
        ok = written ? output_of(r, name, width, height, &buffers[i]) : input_of(r, name, &buffers[i]);
    }
    if (!ok)
        return 0;
    set_constants(r, c, shader);
    return gpu_run(f->g, shader, buffers, width, height, &why) || image_fail(r->error, c->shader, "%s", why.text);
}

/* Backs of a thickness map, given backs and further layers are not in the dump's input: they are taken as they are. */
static int take_backs(const run *r) {
    planes *own = search(r->f->result, r->f->result_count, "height"), *from = load(r->f, "height", r->error);
    size_t plane = (size_t)r->f->width * (size_t)r->f->height;
    int by_thickness = r->f->layers == 1 && !integer(r->f, "clip", 0) && frame_setting(r->f, "thickness", 0.0f) < 1e30f;
    if (!r->f->arcs || by_thickness || !own || !from || own->count != from->count)
        return 1;
    memcpy(gpu_buffer_data(own->buffer) + plane, from->data + plane, sizeof(float) * plane * (size_t)(own->count - 1));
    return 1;
}

int frame_run(frame *f, shaders *s, frame *before, int isolated, image_error *error) {
    const run r = {f, before, s, isolated, error};
    const char *normals = f->framed ? "reduced_normals" : "given_normals", *signal = "raw";
    int ok = 1;
    error->text[0] = 0;
    if (f->framed)
        ok = run_stage(&r, &(call){.shader = "reduce", .full_constants = 1});
    ok = ok && run_stage(&r, &(call){.shader = "prepare", .names = {f->framed ? "depth" : NULL, "reduced_height"}});
    ok = ok && take_backs(&r);
    ok = ok && run_stage(&r, &(call){.shader = "surface", .names = {"normals", normals}});
    ok = ok && run_stage(&r, &(call){.shader = "horizons"});
    ok = ok && run_stage(&r, &(call){.shader = "integrate", .names = {"normals", normals}});
    for (int pass = 0; ok && f->framed && pass < integer(f, "spatial_passes", 0) && pass < 3; ++pass) {
        static const char *const names[] = {"spatial1", "spatial2", "spatial3"};
        ok = run_stage(&r, &(call){.shader = "spatial",
                                   .names = {"signal", signal, "filtered", names[pass]},
                                   .window = pass ? "window1" : "window0"});
        signal = names[pass];
    }
    if (ok && f->framed && integer(f, "temporal", 0)) {
        ok = run_stage(&r, &(call){.shader = "temporal", .names = {"signal", signal, "motion", "reduced_motion"}});
        signal = "history";
    }
    ok = ok && run_stage(&r, &(call){.shader = "upsample",
                                     .names = {"signal", signal, "reduced_normals", normals},
                                     .full_size = 1,
                                     .full_constants = 1});
    ok = ok && run_stage(&r, &(call){.shader = "pack", .full_size = 1});
    ok = ok && run_stage(&r, &(call){.shader = "multi_bounce", .full_size = 1});
    const setting *roughness = find(f, "specular_roughness");
    for (int i = 0; ok && frame_has_stage(f, "specular") && roughness && i < roughness->count && i < 3; ++i)
        ok =
            run_stage(&r, &(call){.shader = "specular", .full_size = 1, .plane = i, .roughness = roughness->values[i]});
    return ok;
}

/* ---- output ------------------------------------------------------------------------------------------------------ */

/* All planes of a file. */
static int write_file(frame *f, dump *d, const char *file, image_error *error) {
    char names[MAX_NAMES][NAME_SIZE];
    image_plane list[MAX_NAMES];
    int count = 0, width = 0, height = 0;
    char *kept = malloc(sizeof names);
    if (!kept)
        return image_fail(error, file, "not enough memory");
    for (int i = 0; i < PLACES; ++i) {
        if (strcmp(places[i].file, file) != 0)
            continue;
        const planes *p = frame_result(f, places[i].name);
        if (!p)
            p = load(f, places[i].name, error);
        if (!p)
            continue;
        channels_of(f, places + i, names);
        width = p->width;
        height = p->height;
        for (int k = 0; k < p->count && count < MAX_NAMES; ++k, ++count) {
            char *name = kept + count * NAME_SIZE;
            memcpy(name, names[k], NAME_SIZE);
            list[count] = (image_plane){name, p->data + (size_t)k * (size_t)width * (size_t)height, 1,
                                        (ptrdiff_t)width * (ptrdiff_t)sizeof(float)};
        }
    }
    int ok = count == 0 || dump_stage(d, file, width, height, list, count, error);
    free(kept);
    return ok;
}

int frame_write(frame *f, dump *d, image_error *error) {
    const setting *stages = find(f, "stages");
    int ok = 1;
    for (int i = 0; i < f->setting_count; ++i) {
        const setting *s = f->settings + i;
        if (strcmp(s->key, "stages") == 0)
            continue;
        if (strcmp(s->key, "isa") == 0)
            dump_text(d, "isa", gpu_name(f->g));
        else if (s->whole)
            dump_integer(d, s->key, strtol(s->text + strspn(s->text, ": "), NULL, 10));
        else if (s->count)
            dump_floats(d, s->key, s->values, s->count);
    }
    for (const char *at = stages ? stages->text : ""; ok && (at = strchr(at, '"')) != NULL;) {
        char file[NAME_SIZE];
        size_t n = strcspn(++at, "\"");
        snprintf(file, sizeof file, "%.*s", (int)n, at);
        at += n + 1;
        ok = write_file(f, d, file, error);
    }
    return ok && write_file(f, d, "octahedral", error) && write_file(f, d, "halves", error);
}
