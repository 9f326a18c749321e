/* mesh_to_map - from a detailed mesh to the maps that build/bake takes: heights and normals of what a camera straight
 * above sees. And, to see what such maps cannot hold, visibility by rays traced in the mesh itself.
 *
 *   mesh_to_map [--mesh FILE.obj] [options] --height FILE        `mesh_to_map --help` lists them
 *
 * Without --mesh it makes one: paving of stones, which a height map holds, and an arch, which it does not. With --traced
 * and --baked, visibility from rays and from build/bake, it says how far apart they are. docs/baking.md walks through. */
#include "cli.h"
#include "pool.h"
#include "raster.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct vec {
    float x, y, z; /* right, up the map, out of it */
} vec;

typedef struct corner {
    int position, normal; /* normal -1: the face's */
} corner;

typedef struct mesh {
    vec *positions, *normals;
    corner *corners; /* three a triangle */
    size_t position_count, normal_count, corner_count, position_room, normal_room, corner_room;
} mesh;

static vec sub(vec a, vec b) {
    vec c = {a.x - b.x, a.y - b.y, a.z - b.z};
    return c;
}

static vec cross(vec a, vec b) {
    vec c = {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    return c;
}

static float dot(vec a, vec b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static vec unit(vec a) {
    float length = sqrtf(dot(a, a));
    vec up = {0.0f, 0.0f, 1.0f}, c = {a.x / length, a.y / length, a.z / length};
    return length > 0.0f ? c : up;
}

/* ---- the mesh ---------------------------------------------------------------------------------------------------- */

static int grow(void **data, size_t *room, size_t count, size_t size) {
    if (count < *room)
        return 1;
    size_t more = *room ? 2 * *room : 4096;
    void *larger = realloc(*data, more * size);
    if (!larger)
        return cli_error("not enough memory");
    *data = larger;
    *room = more;
    return 1;
}

static int add_vec(vec **list, size_t *count, size_t *room, vec v) {
    void *data = *list;
    int ok = grow(&data, room, *count, sizeof v);
    *list = data;
    if (ok)
        (*list)[(*count)++] = v;
    return ok;
}

static int add_position(mesh *m, float x, float y, float z) {
    vec v = {x, y, z};
    return add_vec(&m->positions, &m->position_count, &m->position_room, v);
}

static int add_normal(mesh *m, vec n) {
    return add_vec(&m->normals, &m->normal_count, &m->normal_room, n);
}

static int add_corner(mesh *m, int position, int normal) {
    void *data = m->corners;
    int ok = grow(&data, &m->corner_room, m->corner_count, sizeof *m->corners);
    m->corners = data;
    if (ok) {
        m->corners[m->corner_count].position = position;
        m->corners[m->corner_count++].normal = normal;
    }
    return ok;
}

/* A sheet of columns x rows points that were just added, as triangles. */
static int add_sheet(mesh *m, int columns, int rows) {
    int first = (int)m->position_count - columns * rows, ok = 1;
    for (int y = 0; ok && y + 1 < rows; ++y)
        for (int x = 0; ok && x + 1 < columns; ++x) {
            int a = first + y * columns + x, b = a + 1, c = a + columns, d = c + 1;
            const int order[6] = {a, b, d, a, d, c};
            for (int k = 0; ok && k < 6; ++k)
                ok = add_corner(m, order[k], order[k]);
        }
    return ok;
}

static float wobble(int i, int seed) { /* -1..1 */
    uint32_t u = (uint32_t)i * 2654435761u ^ (uint32_t)seed * 40503u;
    u ^= u >> 15;
    u *= 2246822519u;
    u ^= u >> 13;
    return (float)(u & 0xffffu) / 32767.5f - 1.0f;
}

/* An upright ellipsoid's upper part, down to below the ground. */
static int add_stone(mesh *m, float x, float y, float rx, float ry, float rz) {
    enum { AROUND = 49, DOWN = 17 };
    int ok = 1;
    for (int j = 0; ok && j < DOWN; ++j)
        for (int i = 0; ok && i < AROUND; ++i) {
            float a = 6.2831853f * (float)i / (AROUND - 1), b = 1.75f * (float)j / (DOWN - 1);
            vec n = {cosf(a) * sinf(b) / rx, sinf(a) * sinf(b) / ry, cosf(b) / rz};
            ok = add_position(m, x + rx * cosf(a) * sinf(b), y + ry * sinf(a) * sinf(b), rz * (cosf(b) - 0.1f)) &&
                 add_normal(m, unit(n));
        }
    return ok && add_sheet(m, AROUND, DOWN);
}

/* Half a ring that stands on the ground, across y. */
static int add_arch(mesh *m, float x, float y, float ring, float tube) {
    enum { ALONG = 97, AROUND = 25 };
    int ok = 1;
    for (int j = 0; ok && j < ALONG; ++j)
        for (int i = 0; ok && i < AROUND; ++i) {
            float a = 3.1415927f * (float)j / (ALONG - 1), b = 6.2831853f * (float)i / (AROUND - 1);
            vec n = {cosf(b) * cosf(a), sinf(b), cosf(b) * sinf(a)};
            ok = add_position(m, x + ring * cosf(a) + tube * n.x, y + tube * n.y, ring * sinf(a) + tube * n.z) &&
                 add_normal(m, n);
        }
    return ok && add_sheet(m, ALONG, AROUND);
}

static int make_mesh(mesh *m) {
    enum { SIDE = 129, STONES = 9 };
    int ok = 1;
    for (int j = 0; ok && j < SIDE; ++j)
        for (int i = 0; ok && i < SIDE; ++i) {
            vec up = {0.0f, 0.0f, 1.0f};
            ok = add_position(m, 1.04f * (float)i / (SIDE - 1) - 0.02f, 1.04f * (float)j / (SIDE - 1) - 0.02f, 0.0f) &&
                 add_normal(m, up);
        }
    ok = ok && add_sheet(m, SIDE, SIDE);
    for (int k = 0; ok && k < STONES * STONES; ++k) {
        float x = ((float)(k % STONES) + 0.5f + 0.12f * wobble(k, 1)) / STONES;
        float y = ((float)(k / STONES) + 0.5f + 0.12f * wobble(k, 2)) / STONES;
        float r = (0.40f + 0.06f * wobble(k, 3)) / STONES;
        if (fabsf(x - 0.5f) < 0.32f && fabsf(y - 0.5f) < 0.14f)
            continue; /* room for the arch */
        ok = add_stone(m, x, y, r * (1.0f + 0.1f * wobble(k, 4)), r * (1.0f + 0.1f * wobble(k, 5)), 0.9f * r);
    }
    return ok && add_arch(m, 0.5f, 0.5f, 0.2f, 0.035f);
}

/* "7", "7/1", "7/1/3", "7//3", negative from the end. */
static int parse_corner(const char *text, const mesh *m, corner *c) {
    char *end;
    long v = strtol(text, &end, 10), n = 0;
    if (end == text)
        return 0;
    if (*end == '/') {
        ++end;
        if (*end != '/')
            strtol(end, &end, 10);
        if (*end == '/')
            n = strtol(end + 1, &end, 10);
    }
    v = v < 0 ? v + (long)m->position_count : v - 1;
    n = n < 0 ? n + (long)m->normal_count : n - 1;
    c->position = (int)v;
    c->normal = (int)n;
    return *end == 0 && v >= 0 && v < (long)m->position_count && n < (long)m->normal_count;
}

static int read_mesh(const char *path, int up_y, mesh *m) {
    char line[4096];
    int number = 0, ok = 1;
    FILE *file = fopen(path, "rb");
    if (!file)
        return cli_error("--mesh %s: cannot open", path);
    while (ok && fgets(line, sizeof line, file)) {
        float x, y, z;
        ++number;
        int normal = strncmp(line, "vn ", 3) == 0;
        if (normal || strncmp(line, "v ", 2) == 0) {
            if (sscanf(line + (normal ? 3 : 2), "%f %f %f", &x, &y, &z) != 3 || !isfinite(x) || !isfinite(y) ||
                !isfinite(z)) {
                ok = cli_error("--mesh %s: line %d: three finite numbers are expected", path, number);
                break;
            }
            vec v = {x, up_y ? -z : y, up_y ? y : z};
            ok = normal ? add_normal(m, unit(v)) : add_position(m, v.x, v.y, v.z);
        } else if (strncmp(line, "f ", 2) == 0) {
            corner first = {0, 0}, last = {0, 0}, c = {0, 0};
            int count = 0;
            for (char *word = strtok(line + 2, " \t\r\n"); ok && word; word = strtok(NULL, " \t\r\n"), ++count) {
                if (!parse_corner(word, m, &c))
                    ok = cli_error("--mesh %s: line %d: no such vertex %s", path, number, word);
                else if (count >= 2)
                    ok = add_corner(m, first.position, first.normal) && add_corner(m, last.position, last.normal) &&
                         add_corner(m, c.position, c.normal);
                else if (count == 0)
                    first = c;
                last = c;
            }
        }
    }
    fclose(file);
    return ok && m->corner_count == 0 ? cli_error("--mesh %s: no faces", path) : ok;
}

/* ---- the maps ---------------------------------------------------------------------------------------------------- */

typedef struct maps {
    const mesh *m;
    int width, height, rays;
    float x0, y1, pixel; /* left and upper edge */
    float *heights, *normals, *traced;
    /* the triangles over each cell of a grid, for the rays */
    int columns, rows, *begin, *triangles;
    float cell, top, *tops; /* greatest heights: of all, over each cell */
} maps;

static void triangle_of(const mesh *m, size_t t, vec p[3]) {
    for (int k = 0; k < 3; ++k)
        p[k] = m->positions[m->corners[3 * t + (size_t)k].position];
}

/* The highest surface at the centre of each pixel. */
static void rasterise(maps *o) {
    const mesh *m = o->m;
    for (size_t i = 0; i < (size_t)o->width * (size_t)o->height; ++i)
        o->heights[i] = NAN;
    for (size_t t = 0; t < m->corner_count / 3; ++t) {
        vec p[3], n[3];
        triangle_of(m, t, p);
        vec face = unit(cross(sub(p[1], p[0]), sub(p[2], p[0])));
        for (int k = 0; k < 3; ++k) {
            int id = m->corners[3 * t + (size_t)k].normal;
            n[k] = id >= 0 ? m->normals[id] : face;
            p[k].x = (p[k].x - o->x0) / o->pixel - 0.5f; /* pixels */
            p[k].y = (o->y1 - p[k].y) / o->pixel - 0.5f;
        }
        float area = (p[1].x - p[0].x) * (p[2].y - p[0].y) - (p[2].x - p[0].x) * (p[1].y - p[0].y);
        if (!(fabsf(area) > 0.0f))
            continue;
        int x0 = (int)ceilf(fminf(p[0].x, fminf(p[1].x, p[2].x))),
            x1 = (int)floorf(fmaxf(p[0].x, fmaxf(p[1].x, p[2].x)));
        int y0 = (int)ceilf(fminf(p[0].y, fminf(p[1].y, p[2].y))),
            y1 = (int)floorf(fmaxf(p[0].y, fmaxf(p[1].y, p[2].y)));
        for (int y = y0 < 0 ? 0 : y0; y <= y1 && y < o->height; ++y)
            for (int x = x0 < 0 ? 0 : x0; x <= x1 && x < o->width; ++x) {
                float fx = (float)x, fy = (float)y;
                float b = ((fx - p[0].x) * (p[2].y - p[0].y) - (p[2].x - p[0].x) * (fy - p[0].y)) / area;
                float c = ((p[1].x - p[0].x) * (fy - p[0].y) - (fx - p[0].x) * (p[1].y - p[0].y)) / area;
                float a = 1.0f - b - c, z = a * p[0].z + b * p[1].z + c * p[2].z;
                size_t i = (size_t)y * (size_t)o->width + (size_t)x;
                if (a < -1e-5f || b < -1e-5f || c < -1e-5f || z <= o->heights[i])
                    continue;
                vec normal = {a * n[0].x + b * n[1].x + c * n[2].x, a * n[0].y + b * n[1].y + c * n[2].y,
                              a * n[0].z + b * n[1].z + c * n[2].z};
                normal = unit(normal);
                o->heights[i] = z;
                o->normals[3 * i] = normal.x;
                o->normals[3 * i + 1] = normal.y;
                o->normals[3 * i + 2] = normal.z > 0.0f ? normal.z : 0.0f;
            }
    }
}

static int cell_at(float v, int count) {
    int i = (int)floorf(v);
    return i < 0 ? 0 : i >= count ? count - 1 : i;
}

static void cells_of(const maps *o, const vec p[3], int range[4]) {
    float x0 = fminf(p[0].x, fminf(p[1].x, p[2].x)), x1 = fmaxf(p[0].x, fmaxf(p[1].x, p[2].x));
    float y0 = fminf(p[0].y, fminf(p[1].y, p[2].y)), y1 = fmaxf(p[0].y, fmaxf(p[1].y, p[2].y));
    range[0] = cell_at((x0 - o->x0) / o->cell, o->columns);
    range[1] = cell_at((x1 - o->x0) / o->cell, o->columns);
    range[2] = cell_at((o->y1 - y1) / o->cell, o->rows);
    range[3] = cell_at((o->y1 - y0) / o->cell, o->rows);
}

static int make_grid(maps *o) {
    const mesh *m = o->m;
    size_t total = 0;
    o->cell = o->pixel * (float)(o->width > o->height ? o->width : o->height) / 256.0f;
    o->columns = (int)ceilf(o->pixel * (float)o->width / o->cell);
    o->rows = (int)ceilf(o->pixel * (float)o->height / o->cell);
    size_t cells = (size_t)o->columns * (size_t)o->rows;
    o->begin = calloc(cells + 2, sizeof *o->begin);
    o->tops = malloc(cells * sizeof *o->tops);
    if (!o->begin || !o->tops)
        return cli_error("not enough memory");
    o->top = -HUGE_VALF;
    for (size_t i = 0; i < cells; ++i)
        o->tops[i] = -HUGE_VALF;
    for (int pass = 0; pass < 2; ++pass) {
        for (size_t t = 0; t < m->corner_count / 3; ++t) {
            vec p[3];
            int r[4];
            triangle_of(m, t, p);
            cells_of(o, p, r);
            float top = fmaxf(p[0].z, fmaxf(p[1].z, p[2].z));
            o->top = fmaxf(o->top, top);
            for (int y = r[2]; y <= r[3]; ++y)
                for (int x = r[0]; x <= r[1]; ++x) {
                    size_t cell = (size_t)y * (size_t)o->columns + (size_t)x;
                    o->tops[cell] = fmaxf(o->tops[cell], top);
                    if (pass == 0)
                        ++o->begin[cell + 2];
                    else
                        o->triangles[o->begin[cell + 1]++] = (int)t;
                }
        }
        if (pass == 1)
            break;
        for (size_t i = 0; i < cells; ++i)
            o->begin[i + 2] += o->begin[i + 1];
        total = (size_t)o->begin[cells + 1];
        o->triangles = malloc((total + 1) * sizeof *o->triangles);
        if (!o->triangles)
            return cli_error("not enough memory");
    }
    return 1;
}

static int hits(const maps *o, int t, vec from, vec to) {
    vec p[3];
    triangle_of(o->m, (size_t)t, p);
    vec e1 = sub(p[1], p[0]), e2 = sub(p[2], p[0]), h = cross(to, e2), s = sub(from, p[0]), q = cross(s, e1);
    float a = dot(e1, h);
    if (!(fabsf(a) > 1e-20f))
        return 0;
    float u = dot(s, h) / a, v = dot(to, q) / a, d = dot(e2, q) / a;
    return u >= 0.0f && v >= 0.0f && u + v <= 1.0f && d > 0.0f;
}

/* Cell by cell, until the ray is above everything or off the map. */
static int blocked(const maps *o, vec from, vec to) {
    float gx = (from.x - o->x0) / o->cell, gy = (o->y1 - from.y) / o->cell, dx = to.x / o->cell, dy = -to.y / o->cell;
    int x = cell_at(gx, o->columns), y = cell_at(gy, o->rows), step_x = dx < 0.0f ? -1 : 1, step_y = dy < 0.0f ? -1 : 1;
    float next_x = fabsf(dx) > 0.0f ? ((float)(x + (step_x > 0)) - gx) / dx : HUGE_VALF;
    float next_y = fabsf(dy) > 0.0f ? ((float)(y + (step_y > 0)) - gy) / dy : HUGE_VALF, along = 0.0f;
    while (x >= 0 && y >= 0 && x < o->columns && y < o->rows && !(to.z > 0.0f && from.z + along * to.z > o->top)) {
        size_t cell = (size_t)y * (size_t)o->columns + (size_t)x;
        float leaves = next_x < next_y ? next_x : next_y, lowest = from.z + (to.z > 0.0f ? along : leaves) * to.z;
        for (int i = o->begin[cell]; lowest <= o->tops[cell] && i < o->begin[cell + 1]; ++i)
            if (hits(o, o->triangles[i], from, to))
                return 1;
        if (next_x < next_y) {
            along = next_x;
            x += step_x;
            next_x += fabsf(1.0f / dx);
        } else {
            along = next_y;
            if (isinf(along))
                break;
            y += step_y;
            next_y += fabsf(1.0f / dy);
        }
    }
    return 0;
}

/* Cosine-weighted: stratified on a disc, turned by pixel. */
static void trace_rows(void *user, int thread, int begin, int end) {
    maps *o = user;
    int side = (int)floorf(sqrtf((float)o->rays));
    (void)thread;
    for (int y = begin; y < end; ++y)
        for (int x = 0; x < o->width; ++x) {
            size_t i = (size_t)y * (size_t)o->width + (size_t)x;
            const float *normal = o->normals + 3 * i;
            vec n = {normal[0], normal[1], normal[2]},
                axis = {fabsf(n.x) < 0.5f ? 1.0f : 0.0f, fabsf(n.x) < 0.5f ? 0.0f : 1.0f, 0.0f};
            vec s = unit(cross(n, axis)), t = cross(n, s);
            float lift = 0.02f * o->pixel, open = 0.0f;
            if (isnan(o->heights[i])) {
                o->traced[i] = 1.0f;
                continue;
            }
            vec from = {o->x0 + ((float)x + 0.5f) * o->pixel + lift * n.x,
                        o->y1 - ((float)y + 0.5f) * o->pixel + lift * n.y, o->heights[i] + lift * n.z};
            for (int k = 0; k < side * side; ++k) {
                float u = ((float)(k % side) + 0.5f + 0.5f * wobble((int)i * 7 + k, 11)) / (float)side;
                float v = ((float)(k / side) + 0.5f + 0.5f * wobble((int)i * 7 + k, 12)) / (float)side;
                float r = sqrtf(u), a = 6.2831853f * v, c = sqrtf(fmaxf(0.0f, 1.0f - u));
                float sx = r * cosf(a), sy = r * sinf(a);
                vec to = {sx * s.x + sy * t.x + c * n.x, sx * s.y + sy * t.y + c * n.y, sx * s.z + sy * t.z + c * n.z};
                open += blocked(o, from, to) ? 0.0f : 1.0f;
            }
            o->traced[i] = open / (float)(side * side);
        }
}

/* ---- the program ------------------------------------------------------------------------------------------------- */

static int write_map(const char *path, const maps *o, int channels, const float *data) {
    static const char *const one[] = {"Y"}, *const three[] = {"N.X", "N.Y", "N.Z"};
    image_pending pending;
    image_error error;
    raster_writer *w =
        raster_writer_create(path, o->width, o->height, channels, channels == 3 ? three : one,
                             channels == 3 ? IMAGE_RANGE_SIGNED : IMAGE_RANGE_UNIT, 16, &pending, &error);
    int ok = w != NULL;
    if (ok && !raster_write(w, o->height, data, &error)) {
        raster_abandon(w);
        ok = 0;
    } else if (ok) {
        ok = raster_finish(w, &error) && image_commit(&pending, &error);
    }
    return ok ? 1 : cli_error("%s", error.text);
}

/* Root mean square and mean of baked - traced, where the built-in scene has its arch and elsewhere. */
static int compare(const char *path, const maps *o, int arch) {
    raster_info info;
    image_error error;
    size_t pixels = (size_t)o->width * (size_t)o->height;
    float *baked = malloc(pixels * sizeof *baked);
    raster_reader *r = raster_open(path, 1, o->width, o->height, &info, &error);
    int ok = r && baked;
    if (ok && (info.width != o->width || info.height != o->height))
        ok = cli_error("--baked %s: %d x %d, but the maps are %d x %d", path, info.width, info.height, o->width,
                       o->height);
    else if (!ok || !raster_read(r, info.height, baked, &error))
        ok = cli_error("--baked %s", r && !baked ? "not enough memory" : error.text);
    for (int near_arch = 0; ok && near_arch <= arch; ++near_arch) {
        double sum = 0.0, squares = 0.0, count = 0.0;
        for (size_t i = 0; i < pixels; ++i) {
            float x = ((float)(i % (size_t)o->width) + 0.5f) / (float)o->width;
            float y = ((float)(i / (size_t)o->width) + 0.5f) / (float)o->height;
            int is_near = fabsf(x - 0.5f) < 0.3f && fabsf(y - 0.5f) < 0.12f;
            double d = (double)(baked[i] - o->traced[i]);
            if (isnan(o->heights[i]) || (arch && is_near != near_arch))
                continue;
            sum += d;
            squares += d * d;
            count += 1.0;
        }
        count = count > 0.0 ? count : 1.0;
        printf("%s: RMSE %.4f, mean %+.4f\n",
               !arch       ? "baked - traced"
               : near_arch ? "around the arch"
                           : "stones",
               sqrt(squares / count), sum / count);
    }
    raster_close(r);
    free(baked);
    return ok;
}

static void bounds_of(const mesh *m, int size, maps *o) {
    float x1 = -HUGE_VALF, y0 = HUGE_VALF;
    o->x0 = HUGE_VALF;
    o->y1 = -HUGE_VALF;
    for (size_t i = 0; i < m->corner_count; ++i) {
        vec p = m->positions[m->corners[i].position];
        o->x0 = fminf(o->x0, p.x);
        x1 = fmaxf(x1, p.x);
        y0 = fminf(y0, p.y);
        o->y1 = fmaxf(o->y1, p.y);
    }
    float wide = x1 - o->x0, high = o->y1 - y0, side = fmaxf(wide, high);
    o->pixel = side > 0.0f ? side / (float)size : 1.0f;
    o->width = (int)fmaxf(1.0f, floorf(wide / o->pixel + 0.5f));
    o->height = (int)fmaxf(1.0f, floorf(high / o->pixel + 0.5f));
}

enum { OPT_MESH, OPT_UP, OPT_SIZE, OPT_HEIGHT, OPT_NORMAL, OPT_TRACED, OPT_RAYS, OPT_BAKED, OPT_COUNT };

typedef struct options {
    const char *mesh, *height, *normal, *traced, *baked;
    int up, size, rays;
    unsigned char given[OPT_COUNT];
} options;

static const char *const ups[] = {"z", "y", NULL};

static const cli_option option_table[OPT_COUNT] = {
    [OPT_MESH] = {"--mesh", "FILE.obj",
                  "without: paving of stones, which a height map holds, and an arch, which it does not",
                  CLI_INPUT(options, mesh)},
    [OPT_UP] = {"--up", "y|z", "which way is up in FILE.obj (z)", CLI_CHOICE(options, up, ups), .expected = "y or z"},
    [OPT_SIZE] = {"--size", "N", "pixels of the longer side (512)",
                  CLI_INTEGER(options, size, 1, IMAGE_MAX_SIZE, NULL)},
    [OPT_HEIGHT] = {"--height", "FILE", "heights", CLI_OUTPUT(options, height, RASTER_ENDINGS)},
    [OPT_NORMAL] = {"--normal", "FILE", "normals, tangent space", CLI_OUTPUT(options, normal, RASTER_ENDINGS)},
    [OPT_TRACED] = {"--traced", "FILE", "visibility by rays traced in the mesh itself",
                    CLI_OUTPUT(options, traced, RASTER_ENDINGS)},
    [OPT_RAYS] = {"--rays", "N", "of each pixel (256)", CLI_INTEGER(options, rays, 1, 65536, NULL)},
    [OPT_BAKED] = {"--baked", "FILE", "visibility from build/bake: how far it is from that by rays",
                   CLI_INPUT(options, baked)},
};

static const cli_program program = {"mesh_to_map",
                                    "heights and normals of a mesh, seen from above, for bake",
                                    "[options] --height FILE",
                                    NULL,
                                    option_table,
                                    OPT_COUNT,
                                    0};

int main(int argc, char **argv) {
    options settings;
    memset(&settings, 0, sizeof settings);
    settings.size = 512;
    settings.rays = 256;
    int status = cli_parse(&program, argc, argv, &settings, settings.given);
    if (status != CLI_GO)
        return status;
    if (!settings.height)
        return cli_error("--height: required"), 2;
    if (settings.baked && !settings.traced)
        return cli_error("--baked: only with --traced"), 2;

    mesh m;
    maps o;
    memset(&m, 0, sizeof m);
    memset(&o, 0, sizeof o);
    o.m = &m;
    o.rays = settings.rays;
    int ok = settings.mesh ? read_mesh(settings.mesh, settings.up, &m) : make_mesh(&m);
    if (ok) {
        bounds_of(&m, settings.size, &o);
        size_t pixels = (size_t)o.width * (size_t)o.height;
        o.heights = malloc(pixels * sizeof *o.heights);
        o.normals = calloc(3 * pixels, sizeof *o.normals);
        o.traced = malloc(pixels * sizeof *o.traced);
        ok = o.heights && o.normals && o.traced ? 1 : cli_error("not enough memory");
    }
    if (ok)
        rasterise(&o);
    if (ok && settings.traced) {
        pool *workers = pool_create(cli_processors());
        ok = workers ? make_grid(&o) : cli_error("not enough memory");
        if (ok)
            pool_run(workers, o.height, 0, trace_rows, NULL, &o);
        pool_destroy(workers);
    }
    ok = ok && write_map(settings.height, &o, 1, o.heights) &&
         (!settings.normal || write_map(settings.normal, &o, 3, o.normals)) &&
         (!settings.traced || write_map(settings.traced, &o, 1, o.traced));
    if (ok && settings.baked)
        ok = compare(settings.baked, &o, !settings.mesh);
    else if (ok)
        printf("%d x %d pixels of %.9g; %s", o.width, o.height, (double)o.pixel,
               settings.normal ? "bake with:\n" : "\n");
    if (ok && !settings.baked && settings.normal)
        printf("build/bake --height %s --normal %s --pixel-size %.9g --no-data nan -o FILE\n", settings.height,
               settings.normal, (double)o.pixel);
    free(m.positions);
    free(m.normals);
    free(m.corners);
    free(o.heights);
    free(o.normals);
    free(o.traced);
    free(o.begin);
    free(o.tops);
    free(o.triangles);
    return ok ? 0 : 2;
}
