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

/* ---- options ------------------------------------------------------------------------------------------------------ */

enum { OPT_MESH, OPT_SIZE, OPT_LAYERS, OPT_FOV_Y, OPT_EYE, OPT_TARGET, OPT_UP, OPT_OUTPUT, OPT_COUNT };

typedef struct options {
    const char *mesh, *output;
    int size[2], layers;
    float fov_y_degrees;
    float eye[3], target[3], up[3];
    unsigned char given[OPT_COUNT];
} options;

#define VECTOR(m) CLI_FLOATS(options, m, 3, 3, -CLI_FINITE, CLI_FINITE, "three finite numbers")

static const cli_option option_table[OPT_COUNT] = {
    [OPT_MESH] = {"MESH.obj", "", "what is peeled", CLI_INPUT(options, mesh), .expected = "a mesh"},
    [OPT_SIZE] = {"--size", "WIDTHxHEIGHT", "(960x540)", CLI_SIZE(options, size, 1, 16384, NULL)},
    [OPT_LAYERS] = {"--layers", "N", "1..9 (4)", CLI_INTEGER(options, layers, 1, 1 + GTAO_MAX_LAYERS, NULL)},
    [OPT_FOV_Y] = {"--fov-y", "DEGREES", "vertical field of view (45)",
                   CLI_FLOAT(options, fov_y_degrees, 1e-3, 179.99, "between 0 and 180 degrees")},
    [OPT_EYE] = {"--eye", "X,Y,Z", "where the camera is (in front of the mesh, a little above)", VECTOR(eye)},
    [OPT_TARGET] = {"--target", "X,Y,Z", "what it looks at (the middle of the mesh)", VECTOR(target)},
    [OPT_UP] = {"--up", "X,Y,Z", "(0,1,0)", VECTOR(up)},
    [OPT_OUTPUT] = {"-o", "FILE", ".exr with channels Z, ZBack, N.X, N.Y, N.Z, layer2.Z, layer2.ZBack, ...",
                    CLI_OUTPUT(options, output, ".exr")},
};

static const cli_program program = {"layers",
                                    "depth layers of a mesh for ao: fronts and backs, peeled",
                                    "MESH.obj [options] -o LAYERS.exr",
                                    "It prints the ao command that reads them.",
                                    option_table,
                                    OPT_COUNT,
                                    0};

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
        cli_error("out of memory");
        exit(2);
    }
    return p;
}

/* OBJ: `v x y z` and `f a b c ...`, a = index[/texture[/normal]], from 1, or from the end if negative. */
static int read_mesh(const char *path, mesh *m) {
    char line[4096];
    FILE *file = fopen(path, "r");
    int number = 0;
    if (!file)
        return cli_error("%s: cannot be opened", path);
    while (fgets(line, sizeof line, file)) {
        ++number;
        if (line[0] == 'v' && line[1] == ' ') {
            vec v;
            if (sscanf(line + 2, "%lf %lf %lf", &v.x, &v.y, &v.z) != 3 || !isfinite(v.x) || !isfinite(v.y) ||
                !isfinite(v.z)) {
                fclose(file);
                return cli_error("%s: line %d: a vertex needs three finite numbers", path, number);
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
                    return cli_error("%s: line %d: no vertex %s", path, number, text);
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
        return cli_error("%s: cannot be read", path);
    return m->triangle_count ? 1 : cli_error("%s: no faces", path);
}

static int root_of(int *parent, int i) {
    while (parent[i] != i)
        i = parent[i] = parent[parent[i]];
    return i;
}

static int find_pieces(mesh *m) {
    m->piece = malloc((size_t)m->vertex_count * sizeof *m->piece);
    if (!m->piece)
        return cli_error("out of memory");
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
    vec target =
        o->given[OPT_TARGET] ? (vec){(double)o->target[0], (double)o->target[1], (double)o->target[2]} : middle;
    vec eye = o->given[OPT_EYE]
                  ? (vec){(double)o->eye[0], (double)o->eye[1], (double)o->eye[2]}
                  : (vec){target.x + 0.3 * far_enough, target.y + 0.35 * far_enough, target.z + far_enough};
    vec up = {(double)o->up[0], (double)o->up[1], (double)o->up[2]}, forward = sub(target, eye);
    vec right = cross(forward, up);
    if (!(dot(right, right) > 1e-12 * dot(forward, forward) * dot(up, up)))
        return cli_error("--eye, --target, --up: the camera looks nowhere, or along up");
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
    int behind = 0, x0 = 0, x1 = o->size[0] - 1, y0 = 0, y1 = o->size[1] - 1;
    double cx = 0.5 * o->size[0], cy = 0.5 * o->size[1], u0 = 1e30, u1 = -1e30, v0 = 1e30, v1 = -1e30;
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
            size_t pixel = (size_t)y * (size_t)o->size[0] + (size_t)x;
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
    gtao_camera camera = gtao_camera_from_fov(o->fov_y_degrees, o->size[0], o->size[1]);
    size_t pixels = (size_t)o->size[0] * (size_t)o->size[1];
    int channels = 3 + 2 * o->layers;
    h->first = malloc(pixels * sizeof *h->first);
    if (!h->first || !image_create(img, o->size[0], o->size[1], channels, &error)) {
        cli_error("out of memory");
        return 2;
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
        cli_error("%s", error.text);
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
    memset(&o, 0, sizeof o);
    o.size[0] = 960, o.size[1] = 540, o.layers = 4, o.fov_y_degrees = 45.0f, o.up[1] = 1.0f;
    int parsed = cli_parse(&program, argc, argv, &o, o.given);
    if (parsed != CLI_GO)
        return parsed;
    if (!o.mesh || !o.output) {
        cli_error(o.mesh ? "-o: missing" : "no mesh; --help lists the options");
        return 2;
    }
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
