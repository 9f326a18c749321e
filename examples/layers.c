/* layers - the depth layers of a mesh, front and back, for `ao --layer --back`: depth peeling on the CPU.
 *
 *     layers MESH.obj [options] -o LAYERS.exr        `layers --help` lists them
 *
 * Every triangle is sampled at the pixel centres it covers, and each pixel keeps all that it saw. Sorted by depth, that is
 * what a view ray enters and leaves:
 *   - A face turned to the eye is entered. The next face of the same piece that is turned away leaves it (pieces:
 *     triangles joined by vertices; faces counter-clockwise from outside, as OBJ has it).
 *   - A face without a partner is a sheet: its back is its front.
 *   - A layer lasts until everything that was entered has been left, so things that overlap make one layer, and the
 *     layers of a pixel lie one behind the other.
 * Channels: Z, ZBack, N.X, N.Y, N.Z of the first layer, layer2.Z, layer2.ZBack, ... of the others; 1e10 where there is
 * nothing. View space is the library's: x right, y down, z forward. */
#include "gtao.h"

#include "cli.h"
#include "image.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SKY 1e10f

typedef struct vec {
    double x, y, z;
} vec;

static vec sub(vec a, vec b) {
    return (vec){a.x - b.x, a.y - b.y, a.z - b.z};
}

static double dot(vec a, vec b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static vec cross(vec a, vec b) {
    return (vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static vec scaled(vec a, double s) {
    return (vec){a.x * s, a.y * s, a.z * s};
}

static int error_line(const char *format, ...) {
    va_list args;
    va_start(args, format);
    fputs("layers: ", stderr);
    vfprintf(stderr, format, args);
    fputc('\n', stderr);
    va_end(args);
    return 0;
}

/* ---- options ------------------------------------------------------------------------------------------------------ */

typedef struct options {
    const char *mesh, *output;
    int width, height, layers;
    float fov_y_degrees;
    float eye[3], target[3], up[3];
    int has_eye, has_target;
} options;

static const char usage[] =
    "layers - depth layers of a mesh for ao: fronts and backs, peeled\n\n"
    "usage: layers MESH.obj [options] -o LAYERS.exr\n\n"
    "  --size WIDTHxHEIGHT            (960x540)\n"
    "  --layers N                     1..9 (4)\n"
    "  --fov-y DEGREES                vertical field of view (45)\n"
    "  --eye X,Y,Z                    where the camera is (in front of the mesh, a little above)\n"
    "  --target X,Y,Z                 what it looks at (the middle of the mesh)\n"
    "  --up X,Y,Z                     (0,1,0)\n"
    "  -o FILE                        .exr with channels Z, ZBack, N.X, N.Y, N.Z, layer2.Z, layer2.ZBack, ...\n\n"
    "It prints the ao command that reads them.\n";

static int set_vector(const char *name, const char *value, float v[3]) {
    int ok = cli_numbers(value, 3, 3, v) == 3 && isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]);
    return ok ? 1 : error_line("%s %s: must be three finite numbers", name, value);
}

static int parse_options(int argc, char **argv, options *o) {
    memset(o, 0, sizeof *o);
    o->width = 960, o->height = 540, o->layers = 4, o->fov_y_degrees = 45.0f, o->up[1] = 1.0f;
    for (int i = 1; i < argc; ++i) {
        const char *name = argv[i], *value = argv[i + 1];
        double number;
        long count;
        char end;
        if (strcmp(name, "--help") == 0) {
            fputs(usage, stdout);
            exit(0);
        }
        if (name[0] != '-') {
            if (o->mesh)
                return error_line("%s: there is a mesh already, %s", name, o->mesh);
            o->mesh = name;
            continue;
        }
        if (!value && (strcmp(name, "-o") == 0 || strncmp(name, "--", 2) == 0))
            return error_line("%s: unknown option, or its value is missing", name);
        ++i;
        if (strcmp(name, "-o") == 0) {
            o->output = value;
        } else if (strcmp(name, "--size") == 0) {
            if (sscanf(value, "%dx%d%c", &o->width, &o->height, &end) != 2 || o->width < 1 || o->height < 1 ||
                o->width > 16384 || o->height > 16384)
                return error_line("--size %s: must be WIDTHxHEIGHT, 1..16384 each", value);
        } else if (strcmp(name, "--layers") == 0) {
            if (!cli_integer(value, 1, 1 + GTAO_MAX_LAYERS, &count))
                return error_line("--layers %s: must be an integer, 1..%d", value, 1 + GTAO_MAX_LAYERS);
            o->layers = (int)count;
        } else if (strcmp(name, "--fov-y") == 0) {
            if (!cli_number(value, &number) || !(number >= 1e-3 && number < 179.99))
                return error_line("--fov-y %s: must be between 0 and 180 degrees", value);
            o->fov_y_degrees = (float)number;
        } else if (strcmp(name, "--eye") == 0) {
            if (!set_vector(name, value, o->eye))
                return 0;
            o->has_eye = 1;
        } else if (strcmp(name, "--target") == 0) {
            if (!set_vector(name, value, o->target))
                return 0;
            o->has_target = 1;
        } else if (strcmp(name, "--up") == 0) {
            if (!set_vector(name, value, o->up))
                return 0;
        } else {
            return error_line("%s: unknown option; --help lists them", name);
        }
    }
    if (!o->mesh)
        return error_line("no mesh; --help lists the options");
    if (!o->output)
        return error_line("-o: missing");
    if (image_format_of(o->output) != IMAGE_EXR)
        return error_line("-o %s: must end in .exr", o->output);
    return 1;
}

/* ---- mesh --------------------------------------------------------------------------------------------------------- */

typedef struct mesh {
    vec *vertices;
    int vertex_count, vertex_room;
    int (*triangles)[3];
    int triangle_count, triangle_room;
    int *piece; /* of each vertex */
} mesh;

static void *grown(void *p, int count, int *room, size_t size) {
    if (count < *room)
        return p;
    *room = *room ? 2 * *room : 1024;
    p = realloc(p, (size_t)*room * size);
    if (!p) {
        error_line("out of memory");
        exit(1);
    }
    return p;
}

/* OBJ: `v x y z` and `f a b c ...`, a = index[/texture[/normal]], from 1, or from the end if negative. */
static int read_mesh(const char *path, mesh *m) {
    char line[4096];
    FILE *file = fopen(path, "r");
    int number = 0;
    if (!file)
        return error_line("%s: cannot be opened", path);
    while (fgets(line, sizeof line, file)) {
        ++number;
        if (line[0] == 'v' && line[1] == ' ') {
            vec v;
            if (sscanf(line + 2, "%lf %lf %lf", &v.x, &v.y, &v.z) != 3 || !isfinite(v.x) || !isfinite(v.y) ||
                !isfinite(v.z)) {
                fclose(file);
                return error_line("%s: line %d: a vertex needs three finite numbers", path, number);
            }
            m->vertices = grown(m->vertices, m->vertex_count, &m->vertex_room, sizeof *m->vertices);
            m->vertices[m->vertex_count++] = v;
        } else if (line[0] == 'f' && line[1] == ' ') {
            int corner[3], corners = 0;
            for (char *text = strtok(line + 2, " \t\r\n"); text; text = strtok(NULL, " \t\r\n")) {
                long index = strtol(text, NULL, 10);
                index = index < 0 ? m->vertex_count + index : index - 1;
                if (index < 0 || index >= m->vertex_count) {
                    fclose(file);
                    return error_line("%s: line %d: no vertex %s", path, number, text);
                }
                corner[corners < 2 ? corners : 2] = (int)index;
                if (++corners >= 3) { /* a fan */
                    m->triangles = grown(m->triangles, m->triangle_count, &m->triangle_room, sizeof *m->triangles);
                    memcpy(m->triangles[m->triangle_count++], corner, sizeof corner);
                    corner[1] = corner[2];
                }
            }
        }
    }
    int failed = ferror(file);
    fclose(file);
    if (failed)
        return error_line("%s: cannot be read", path);
    return m->triangle_count ? 1 : error_line("%s: no faces", path);
}

static int root_of(int *parent, int i) {
    while (parent[i] != i)
        i = parent[i] = parent[parent[i]];
    return i;
}

static int find_pieces(mesh *m) {
    m->piece = malloc((size_t)m->vertex_count * sizeof *m->piece);
    if (!m->piece)
        return error_line("out of memory");
    for (int i = 0; i < m->vertex_count; ++i)
        m->piece[i] = i;
    for (int i = 0; i < m->triangle_count; ++i)
        for (int k = 1; k < 3; ++k)
            m->piece[root_of(m->piece, m->triangles[i][0])] = root_of(m->piece, m->triangles[i][k]);
    for (int i = 0; i < m->vertex_count; ++i)
        m->piece[i] = root_of(m->piece, i);
    return 1;
}

/* To view space; the focal length in pixels. */
static int look(const options *o, mesh *m) {
    vec lo = m->vertices[0], hi = lo;
    for (int i = 1; i < m->vertex_count; ++i) {
        vec v = m->vertices[i];
        lo = (vec){fmin(lo.x, v.x), fmin(lo.y, v.y), fmin(lo.z, v.z)};
        hi = (vec){fmax(hi.x, v.x), fmax(hi.y, v.y), fmax(hi.z, v.z)};
    }
    vec middle = scaled((vec){lo.x + hi.x, lo.y + hi.y, lo.z + hi.z}, 0.5), size = sub(hi, lo);
    double far_enough = 0.45 * sqrt(dot(size, size)) / tan((double)o->fov_y_degrees * (3.14159265358979323846 / 360));
    vec target = o->has_target ? (vec){(double)o->target[0], (double)o->target[1], (double)o->target[2]} : middle;
    vec eye = o->has_eye ? (vec){(double)o->eye[0], (double)o->eye[1], (double)o->eye[2]}
                         : (vec){target.x + 0.3 * far_enough, target.y + 0.35 * far_enough, target.z + far_enough};
    vec up = {(double)o->up[0], (double)o->up[1], (double)o->up[2]}, forward = sub(target, eye);
    vec right = cross(forward, up);
    if (!(dot(right, right) > 1e-12 * dot(forward, forward) * dot(up, up)))
        return error_line("--eye, --target, --up: the camera looks nowhere, or along up");
    forward = scaled(forward, 1 / sqrt(dot(forward, forward)));
    right = scaled(right, 1 / sqrt(dot(right, right)));
    vec down = cross(forward, right);
    for (int i = 0; i < m->vertex_count; ++i) {
        vec v = sub(m->vertices[i], eye);
        m->vertices[i] = (vec){dot(v, right), dot(v, down), dot(v, forward)};
    }
    return 1;
}

/* ---- rasteriser --------------------------------------------------------------------------------------------------- */

typedef struct hit {
    float z;
    int triangle;
    int next; /* of the same pixel, -1: none */
} hit;

typedef struct hits {
    hit *list;
    int count, room;
    int *first; /* of each pixel */
} hits;

/* Twice the signed volume of the eye and an edge, as seen along the ray r; the same bits from both of its triangles. */
static double beside(vec a, vec b, vec r) {
    return dot(cross(a, b), r);
}

/* Pixel centres within a triangle: on the same side of its three planes through the eye. That needs no clipping; what
 * lies on an edge belongs to one of the two triangles that share it. */
static void draw(const options *o, const mesh *m, double focal, int index, hits *h) {
    const int *corner = m->triangles[index];
    vec p[3], n;
    int behind = 0, x0 = 0, x1 = o->width - 1, y0 = 0, y1 = o->height - 1;
    double cx = 0.5 * o->width, cy = 0.5 * o->height, u0 = 1e30, u1 = -1e30, v0 = 1e30, v1 = -1e30;
    for (int k = 0; k < 3; ++k) {
        p[k] = m->vertices[corner[k]];
        behind += !(p[k].z > 0);
        u0 = fmin(u0, p[k].x / p[k].z), u1 = fmax(u1, p[k].x / p[k].z);
        v0 = fmin(v0, p[k].y / p[k].z), v1 = fmax(v1, p[k].y / p[k].z);
    }
    if (behind == 3)
        return;
    if (!behind) {
        x0 = (int)fmax(x0, floor(u0 * focal + cx - 0.5)), x1 = (int)fmin(x1, ceil(u1 * focal + cx - 0.5));
        y0 = (int)fmax(y0, floor(v0 * focal + cy - 0.5)), y1 = (int)fmin(y1, ceil(v1 * focal + cy - 0.5));
    }
    n = cross(sub(p[1], p[0]), sub(p[2], p[0]));
    for (int y = y0; y <= y1; ++y)
        for (int x = x0; x <= x1; ++x) {
            vec r = {(x + 0.5 - cx) / focal, (y + 0.5 - cy) / focal, 1};
            double facing = dot(n, r), sign = facing < 0 ? -1 : 1, z = dot(n, p[0]) / facing;
            int inside = z > 0 && z < (double)SKY;
            for (int k = 0; k < 3 && inside; ++k) {
                int a = k, b = (k + 1) % 3;
                double e = beside(p[a], p[b], r) * sign;
                inside = e > 0 || (!(e < 0) && (corner[a] < corner[b]) == (sign > 0));
            }
            if (!inside)
                continue;
            size_t pixel = (size_t)y * (size_t)o->width + (size_t)x;
            h->list = grown(h->list, h->count, &h->room, sizeof *h->list);
            h->list[h->count] = (hit){(float)z, index, h->first[pixel]};
            h->first[pixel] = h->count++;
        }
}

/* ---- layers ------------------------------------------------------------------------------------------------------- */

enum { MOST_HITS = 256 }; /* the rest of a pixel is left out */

static int by_depth(const void *a, const void *b) {
    const hit *p = a, *q = b;
    return p->z < q->z ? -1 : p->z > q->z ? 1 : (p->triangle > q->triangle) - (p->triangle < q->triangle);
}

/* In OBJ's right-handed space a face turned to the eye runs counter-clockwise; the view space's y and z both point the
 * other way, so its normal still points outwards. */
static vec normal_of(const mesh *m, int triangle) {
    const int *c = m->triangles[triangle];
    return cross(sub(m->vertices[c[1]], m->vertices[c[0]]), sub(m->vertices[c[2]], m->vertices[c[0]]));
}

static int faces_eye(const mesh *m, int triangle) {
    return dot(normal_of(m, triangle), m->vertices[m->triangles[triangle][0]]) < 0;
}

/* Channels of one pixel. */
static void write_pixel(const options *o, const mesh *m, const hits *h, size_t pixel, float *out) {
    hit list[MOST_HITS];
    float back[MOST_HITS];
    int count = 0, used[MOST_HITS] = {0}, layer = -1;
    for (int i = h->first[pixel]; i >= 0 && count < MOST_HITS; i = h->list[i].next)
        list[count++] = h->list[i];
    qsort(list, (size_t)count, sizeof *list, by_depth);
    for (int c = 0; c < 3 + 2 * o->layers; ++c)
        out[c] = c >= 2 && c < 5 ? 0.0f : SKY;
    out[4] = -1.0f; /* normal of the sky: towards the eye */
    /* the face that leaves what each face enters: the next one of the piece without a partner */
    for (int i = count - 1; i >= 0; --i) {
        back[i] = list[i].z;
        if (!faces_eye(m, list[i].triangle))
            continue;
        for (int j = i + 1; j < count; ++j)
            if (!used[j] && !faces_eye(m, list[j].triangle) &&
                m->piece[m->triangles[list[i].triangle][0]] == m->piece[m->triangles[list[j].triangle][0]]) {
                used[j] = 1;
                back[i] = list[j].z;
                break;
            }
    }
    float end = 0.0f;
    for (int i = 0; i < count; ++i) {
        if (used[i]) /* left, not entered */
            continue;
        if (layer < 0 || list[i].z > end) {
            if (++layer == o->layers)
                break;
            float *z = layer ? out + 3 + 2 * layer : out;
            z[0] = list[i].z;
            end = list[i].z;
            if (layer == 0) {
                vec n = normal_of(m, list[i].triangle);
                n = scaled(n, (faces_eye(m, list[i].triangle) ? 1 : -1) / sqrt(dot(n, n)));
                out[2] = (float)n.x, out[3] = (float)n.y, out[4] = (float)n.z;
            }
        }
        end = fmaxf(end, back[i]);
        (layer ? out + 3 + 2 * layer : out)[1] = end;
    }
}

/* The whole job; what it allocates is the caller's to free. */
static int run(const options *o, mesh *m, hits *h, image *img) {
    image_error error;
    image_pending file;
    memset(&file, 0, sizeof file);
    if (!find_pieces(m))
        return 2;
    gtao_camera camera = gtao_camera_from_fov(o->fov_y_degrees, o->width, o->height);
    size_t pixels = (size_t)o->width * (size_t)o->height;
    int channels = 3 + 2 * o->layers;
    h->first = malloc(pixels * sizeof *h->first);
    if (!h->first || !image_create(img, o->width, o->height, channels, &error)) {
        error_line("out of memory");
        return 1;
    }
    for (size_t i = 0; i < pixels; ++i)
        h->first[i] = -1;
    for (int i = 0; i < m->triangle_count; ++i)
        draw(o, m, (double)camera.fx, i, h);
    for (size_t i = 0; i < pixels; ++i)
        write_pixel(o, m, h, i, img->data + i * (size_t)channels);

    char text[2 * GTAO_MAX_LAYERS][24];
    const char *names[5 + 2 * GTAO_MAX_LAYERS] = {"Z", "ZBack", "N.X", "N.Y", "N.Z"};
    for (int k = 1; k < o->layers; ++k) {
        snprintf(text[2 * k - 2], sizeof text[0], "layer%d.Z", k + 1);
        snprintf(text[2 * k - 1], sizeof text[0], "layer%d.ZBack", k + 1);
        names[3 + 2 * k] = text[2 * k - 2], names[4 + 2 * k] = text[2 * k - 1];
    }
    if (!image_write(o->output, img, names, IMAGE_RANGE_UNIT, &file, &error) || !image_commit(&file, &error)) {
        error_line("%s", error.text);
        image_discard(&file);
        return 2;
    }
    printf("ao --depth %s:Z --back %s:ZBack --normal %s:N", o->output, o->output, o->output);
    for (int k = 1; k < o->layers; ++k)
        printf(" --layer %s:layer%d.Z --back %s:layer%d.ZBack", o->output, k + 1, o->output, k + 1);
    printf(" --fov-y %.9g\n", (double)o->fov_y_degrees);
    return 0;
}

int main(int argc, char **argv) {
    options o;
    mesh m;
    hits h;
    image img;
    int status = 2;
    memset(&m, 0, sizeof m);
    memset(&h, 0, sizeof h);
    memset(&img, 0, sizeof img);
    if (!parse_options(argc, argv, &o))
        return 2;
    if (read_mesh(o.mesh, &m) && look(&o, &m))
        status = run(&o, &m, &h, &img);
    image_free(&img);
    free(m.vertices);
    free(m.triangles);
    free(m.piece);
    free(h.list);
    free(h.first);
    return status;
}
