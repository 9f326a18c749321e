/* mesh.c - see mesh.h */
#include "mesh.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- transforms -------------------------------------------------------------------------------------------------- */

const mesh_frame mesh_world = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}};

vec3 mesh_apply(const mesh_frame *f, vec3 p) {
    return v3_mad(v3_mad(v3_mad(f->o, f->x, p.x), f->y, p.y), f->z, p.z);
}

mesh_frame mesh_moved(mesh_frame f, double x, double y, double z) {
    f.o = mesh_apply(&f, v3(x, y, z));
    return f;
}

mesh_frame mesh_scaled(mesh_frame f, double x, double y, double z) {
    f.x = v3_scale(f.x, x), f.y = v3_scale(f.y, y), f.z = v3_scale(f.z, z);
    return f;
}

mesh_frame mesh_turned_y(mesh_frame f, double degrees) {
    double a = degrees * V3_PI / 180, c = cos(a), s = sin(a);
    vec3 x = v3_mad(v3_scale(f.x, c), f.z, -s), z = v3_mad(v3_scale(f.z, c), f.x, s);
    f.x = x, f.z = z;
    return f;
}

mesh_frame mesh_turned_x(mesh_frame f, double degrees) {
    double a = degrees * V3_PI / 180, c = cos(a), s = sin(a);
    vec3 y = v3_mad(v3_scale(f.y, c), f.z, s), z = v3_mad(v3_scale(f.z, c), f.y, -s);
    f.y = y, f.z = z;
    return f;
}

mesh_frame mesh_turned_z(mesh_frame f, double degrees) {
    double a = degrees * V3_PI / 180, c = cos(a), s = sin(a);
    vec3 x = v3_mad(v3_scale(f.x, c), f.y, s), y = v3_mad(v3_scale(f.y, c), f.x, -s);
    f.x = x, f.y = y;
    return f;
}

/* The mesh_frame whose y axis runs from a to b. */
mesh_frame mesh_along(mesh_frame f, vec3 a, vec3 b) {
    vec3 axis = v3_normalize(v3_sub(b, a)), p, q;
    v3_frame(axis, &p, &q);
    mesh_frame local = {p, axis, q, a};
    mesh_frame out;
    out.o = mesh_apply(&f, a);
    out.x = v3_sub(mesh_apply(&f, v3_add(a, local.x)), out.o);
    out.y = v3_sub(mesh_apply(&f, v3_add(a, local.y)), out.o);
    out.z = v3_sub(mesh_apply(&f, v3_add(a, local.z)), out.o);
    return out;
}

/* ---- building ---------------------------------------------------------------------------------------------------- */

void *mesh_grown(void *old, size_t bytes) {
    void *p = realloc(old, bytes);
    if (!p) {
        fprintf(stderr, "mesh: out of memory (%zu bytes)\n", bytes);
        exit(1);
    }
    return p;
}

void mesh_free(mesh *m) {
    free(m->positions);
    free(m->parts);
    free(m->indices);
    free(m->materials);
    free(m->normals);
    memset(m, 0, sizeof *m);
}

unsigned mesh_add_vertex(mesh *m, const mesh_frame *f, vec3 p) {
    if (m->vertex_count == m->vertex_capacity) {
        m->vertex_capacity = m->vertex_capacity ? m->vertex_capacity * 2 : 4096;
        m->positions = mesh_grown(m->positions, m->vertex_capacity * 3 * sizeof *m->positions);
        m->parts = mesh_grown(m->parts, m->vertex_capacity * sizeof *m->parts);
    }
    vec3 q = mesh_apply(f, p);
    float *v = m->positions + 3 * m->vertex_count;
    v[0] = (float)q.x, v[1] = (float)q.y, v[2] = (float)q.z;
    m->parts[m->vertex_count] = m->part;
    return (unsigned)m->vertex_count++;
}

void mesh_add_triangle(mesh *m, unsigned a, unsigned b, unsigned c) {
    if (m->triangle_count == m->triangle_capacity) {
        m->triangle_capacity = m->triangle_capacity ? m->triangle_capacity * 2 : 4096;
        m->indices = mesh_grown(m->indices, m->triangle_capacity * 3 * sizeof *m->indices);
        m->materials = mesh_grown(m->materials, m->triangle_capacity * sizeof *m->materials);
    }
    unsigned *t = m->indices + 3 * m->triangle_count;
    t[0] = a, t[1] = b, t[2] = c;
    m->materials[m->triangle_count++] = m->material;
}

unsigned char mesh_add_material(mesh *m, float r, float g, float b) {
    if (m->material_count < MESH_MATERIALS)
        ++m->material_count;
    m->material = (unsigned char)(m->material_count - 1);
    float *albedo = m->albedo[m->material];
    albedo[0] = r, albedo[1] = g, albedo[2] = b;
    return m->material;
}

void mesh_add_quad(mesh *m, unsigned a, unsigned b, unsigned c, unsigned d) {
    mesh_add_triangle(m, a, b, c);
    mesh_add_triangle(m, a, c, d);
}

void mesh_add_box(mesh *m, mesh_frame f, double x0, double y0, double z0, double x1, double y1, double z1) {
    unsigned v[8];
    for (int i = 0; i < 8; ++i)
        v[i] = mesh_add_vertex(m, &f, v3(i & 1 ? x1 : x0, i & 2 ? y1 : y0, i & 4 ? z1 : z0));
    static const int sides[6][4] = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};
    for (int i = 0; i < 6; ++i)
        mesh_add_quad(m, v[sides[i][0]], v[sides[i][1]], v[sides[i][2]], v[sides[i][3]]);
}

/* Box by centre and full size. */
void mesh_add_block(mesh *m, mesh_frame f, double x, double y, double z, double sx, double sy, double sz) {
    mesh_add_box(m, f, x - sx / 2, y - sy / 2, z - sz / 2, x + sx / 2, y + sy / 2, z + sz / 2);
}

void mesh_add_lathe(mesh *m, mesh_frame f, const mesh_lathe *l) {
    unsigned previous = 0;
    for (int i = 0; i < l->points; ++i) {
        unsigned first = (unsigned)m->vertex_count;
        for (int k = 0; k < l->sides; ++k) {
            double a = 2 * V3_PI * k / l->sides, r = l->profile[i][0];
            if (l->flutes && i >= l->first_fluted && i <= l->last_fluted)
                r *= 1 - l->flute_depth * sqrt(fabs(sin(a * l->flutes / 2)));
            mesh_add_vertex(m, &f, v3(r * cos(a), l->profile[i][1], r * sin(a)));
        }
        for (unsigned k = 0; i > 0 && k < (unsigned)l->sides; ++k) {
            unsigned next = (k + 1) % (unsigned)l->sides;
            mesh_add_quad(m, previous + k, first + k, first + next, previous + next);
        }
        previous = first;
    }
}

void mesh_add_revolved(mesh *m, mesh_frame f, const double (*profile)[2], int points, int sides) {
    mesh_lathe l = {profile, points, sides, 0, 0, 0, 0};
    mesh_add_lathe(m, f, &l);
}

/* Closed cylinder or cone from a to b. */
void mesh_add_rod(mesh *m, mesh_frame f, vec3 a, vec3 b, double ra, double rb, int sides) {
    double h = v3_length(v3_sub(b, a)), profile[4][2] = {{0, 0}, {ra, 0}, {rb, h}, {0, h}};
    mesh_add_revolved(m, mesh_along(f, a, b), (const double(*)[2])profile, 4, sides);
}

/* Rod with spherical ends: two spheres of radii ra and rb and the cone between them. */
void mesh_add_capsule(mesh *m, mesh_frame f, vec3 a, vec3 b, double ra, double rb, int sides) {
    enum { ARC = 8 };
    double h = v3_length(v3_sub(b, a)), profile[2 * ARC + 2][2];
    /* The cone touches the spheres where its normal leans by asin((ra - rb) / h). */
    double lean = asin(fmax(-1, fmin(1, (ra - rb) / h)));
    for (int i = 0; i <= ARC; ++i) {
        double lo = -V3_PI / 2 + (lean + V3_PI / 2) * i / ARC, hi = lean + (V3_PI / 2 - lean) * i / ARC;
        profile[i][0] = ra * cos(lo), profile[i][1] = ra * sin(lo);
        profile[ARC + 1 + i][0] = rb * cos(hi), profile[ARC + 1 + i][1] = h + rb * sin(hi);
    }
    mesh_add_revolved(m, mesh_along(f, a, b), (const double(*)[2])profile, 2 * ARC + 2, sides);
}

void mesh_add_ellipsoid(mesh *m, mesh_frame f, vec3 c, double rx, double ry, double rz, int sides) {
    enum { ARC = 24 };
    double profile[ARC + 1][2];
    for (int i = 0; i <= ARC; ++i) {
        double a = -V3_PI / 2 + V3_PI * i / ARC;
        profile[i][0] = cos(a), profile[i][1] = sin(a);
    }
    mesh_add_revolved(m, mesh_scaled(mesh_moved(f, c.x, c.y, c.z), rx, ry, rz), (const double(*)[2])profile, ARC + 1,
                      sides);
}

/* Ring of wire radius r around the y axis. */
void mesh_add_ring(mesh *m, mesh_frame f, double radius, double r, int around, int sides) {
    unsigned first = (unsigned)m->vertex_count, n = (unsigned)around, s = (unsigned)sides;
    for (int i = 0; i < around; ++i)
        for (int k = 0; k < sides; ++k) {
            double a = 2 * V3_PI * i / around, b = 2 * V3_PI * k / sides, q = radius + r * cos(b);
            mesh_add_vertex(m, &f, v3(q * cos(a), r * sin(b), q * sin(a)));
        }
    for (unsigned i = 0; i < n; ++i)
        for (unsigned k = 0; k < s; ++k) {
            unsigned i1 = (i + 1) % n, k1 = (k + 1) % s;
            mesh_add_quad(m, first + i * s + k, first + i1 * s + k, first + i1 * s + k1, first + i * s + k1);
        }
}

/* ---- normals ----------------------------------------------------------------------------------------------------- */

static vec3 mesh_position(const mesh *m, unsigned vertex) {
    const float *p = m->positions + 3 * (size_t)vertex;
    return v3((double)p[0], (double)p[1], (double)p[2]);
}

void mesh_smooth(mesh *m, double crease_degrees) {
    size_t corners = 3 * m->triangle_count;
    vec3 *faces =
        mesh_grown(NULL, (m->triangle_count + 1) * sizeof *faces); /* cross products: length is twice the area */
    unsigned *first = mesh_grown(NULL, (m->vertex_count + 2) * sizeof *first), *at = NULL;
    if (!m->normals) {
        m->normals = mesh_grown(NULL, (corners + 1) * 3 * sizeof *m->normals);
        memset(m->normals, 0, corners * 3 * sizeof *m->normals);
    }
    for (size_t t = 0; t < m->triangle_count; ++t) {
        vec3 a = mesh_position(m, m->indices[3 * t]);
        faces[t] = v3_cross(v3_sub(mesh_position(m, m->indices[3 * t + 1]), a),
                            v3_sub(mesh_position(m, m->indices[3 * t + 2]), a));
    }
    /* The corners at each vertex: at[first[v]] .. at[first[v + 1] - 1]. */
    memset(first, 0, (m->vertex_count + 2) * sizeof *first);
    for (size_t c = 0; c < corners; ++c)
        ++first[m->indices[c] + 2];
    for (size_t v = 2; v < m->vertex_count + 2; ++v)
        first[v] += first[v - 1];
    at = mesh_grown(NULL, (corners + 1) * sizeof *at);
    for (size_t c = 0; c < corners; ++c)
        at[first[m->indices[c] + 1]++] = (unsigned)c;

    double crease = cos(crease_degrees * V3_PI / 180);
    for (size_t c = 0; c < corners; ++c) {
        float *n = m->normals + 3 * c;
        if (n[0] * n[0] + n[1] * n[1] + n[2] * n[2] > 0)
            continue;
        vec3 own = faces[c / 3], sum = v3(0, 0, 0);
        unsigned v = m->indices[c];
        for (unsigned i = first[v]; i < first[v + 1]; ++i) {
            vec3 other = faces[at[i] / 3];
            double d = v3_dot(own, other), limit = crease * v3_length(own) * v3_length(other);
            if (fabs(d) >= limit)
                sum = v3_mad(sum, other, d < 0 ? -1 : 1); /* neighbours may be wound the other way */
        }
        double length = v3_length(sum);
        sum = length > 0 ? v3_scale(sum, 1 / length) : v3(0, 1, 0);
        n[0] = (float)sum.x, n[1] = (float)sum.y, n[2] = (float)sum.z;
    }
    free(faces);
    free(first);
    free(at);
}

void mesh_bounds(const mesh *m, vec3 *lowest, vec3 *highest) {
    *lowest = v3(HUGE_VAL, HUGE_VAL, HUGE_VAL);
    *highest = v3_scale(*lowest, -1);
    for (unsigned v = 0; v < m->vertex_count; ++v) {
        vec3 p = mesh_position(m, v);
        *lowest = v3(fmin(lowest->x, p.x), fmin(lowest->y, p.y), fmin(lowest->z, p.z));
        *highest = v3(fmax(highest->x, p.x), fmax(highest->y, p.y), fmax(highest->z, p.z));
    }
}

/* ---- Wavefront OBJ ------------------------------------------------------------------------------------------------ */

typedef struct obj {
    mesh *m;
    const char *path;
    unsigned line;
    float *normals; /* of the file: 3 floats each */
    size_t normal_count, normal_capacity;
    char (*names)[64]; /* of the materials, in the order of mesh.albedo */
    char *error;
    size_t error_size;
} obj;

static int obj_error(const obj *o, const char *what) {
    snprintf(o->error, o->error_size, "%.300s:%u: %s", o->path, o->line, what);
    return 0;
}

static int obj_floats(const char *text, int count, float *values) {
    for (int i = 0; i < count; ++i) {
        char *end;
        values[i] = strtof(text, &end);
        if (end == text || !isfinite(values[i]))
            return 0;
        text = end;
    }
    return 1;
}

/* The word after the keyword, without the spaces around it. */
static const char *obj_word(char *text) {
    while (isspace((unsigned char)*text))
        ++text;
    size_t n = strlen(text);
    while (n && isspace((unsigned char)text[n - 1]))
        text[--n] = 0;
    return text;
}

static int obj_material(const obj *o, const char *name) {
    for (int i = 0; i < o->m->material_count; ++i)
        if (strncmp(o->names[i], name, sizeof o->names[i] - 1) == 0)
            return i;
    return -1;
}

/* Diffuse colours of a material library. A missing one is not an error: everything stays grey. */
static void obj_read_materials(obj *o, const char *name) {
    char path[4096], line[1024];
    const char *slash = strrchr(o->path, '/');
    int folder = slash ? (int)(slash - o->path) + 1 : 0, current = -1;
    float kd[3];
    if (snprintf(path, sizeof path, "%.*s%s", folder, o->path, name) >= (int)sizeof path)
        return;
    FILE *file = fopen(path, "r");
    while (file && fgets(line, sizeof line, file)) {
        char *s = line + strspn(line, " \t");
        if (strncmp(s, "newmtl ", 7) == 0) {
            const char *word = obj_word(s + 7);
            current = o->m->material_count < MESH_MATERIALS ? mesh_add_material(o->m, 0.8f, 0.8f, 0.8f) : -1;
            if (current >= 0)
                snprintf(o->names[current], sizeof o->names[current], "%s", word);
        } else if (strncmp(s, "Kd ", 3) == 0 && current >= 0 && obj_floats(s + 3, 3, kd)) {
            for (int k = 0; k < 3; ++k)
                o->m->albedo[current][k] = kd[k] < 0 ? 0 : kd[k] > 1 ? 1 : kd[k];
        }
    }
    if (file)
        fclose(file);
}

/* 1-based, or negative from the end; the index from 0, or -1. */
static long obj_index(long i, size_t count) {
    i = i < 0 ? (long)count + i : i - 1;
    return i >= 0 && i < (long)count ? i : -1;
}

/* A polygon as a fan around its first corner. */
static int obj_face(obj *o, const char *s) {
    mesh *m = o->m;
    long vertex[3] = {-1, -1, -1}, normal[3] = {-1, -1, -1};
    int corners = 0;
    while (*(s += strspn(s, " \t\r\n\\"))) {
        char *end;
        long v = obj_index(strtol(s, &end, 10), m->vertex_count), n = -1;
        if (end == s || v < 0)
            return obj_error(o, "a face names a vertex that does not exist");
        if (*end == '/') {
            strtol(end + 1, &end, 10); /* texture coordinates are not used */
            if (*end == '/') {
                n = obj_index(strtol(end + 1, &end, 10), o->normal_count);
                if (n < 0)
                    return obj_error(o, "a face names a normal that does not exist");
            }
        }
        if (*end && !isspace((unsigned char)*end))
            return obj_error(o, "not a face");
        s = end;
        int k = corners < 2 ? corners : 2;
        if (corners > 2)
            vertex[1] = vertex[2], normal[1] = normal[2];
        vertex[k] = v, normal[k] = n;
        if (++corners < 3)
            continue;
        size_t before = m->triangle_capacity;
        mesh_add_triangle(m, (unsigned)vertex[0], (unsigned)vertex[1], (unsigned)vertex[2]);
        if (m->triangle_capacity != before)
            m->normals = mesh_grown(m->normals, m->triangle_capacity * 9 * sizeof *m->normals);
        float *to = m->normals + 9 * (m->triangle_count - 1);
        for (int i = 0; i < 3; ++i)
            for (int c = 0; c < 3; ++c)
                to[3 * i + c] = normal[i] >= 0 ? o->normals[3 * normal[i] + c] : 0.0f;
    }
    return corners >= 3 ? 1 : obj_error(o, "a face of fewer than three corners");
}

static int obj_line(obj *o, char *line) {
    char *s = line + strspn(line, " \t");
    float v[3];
    if (strncmp(s, "v ", 2) == 0) {
        if (!obj_floats(s + 2, 3, v))
            return obj_error(o, "not a vertex of three finite numbers");
        mesh_add_vertex(o->m, &mesh_world, v3((double)v[0], (double)v[1], (double)v[2]));
    } else if (strncmp(s, "vn ", 3) == 0) {
        if (!obj_floats(s + 3, 3, v))
            return obj_error(o, "not a normal of three finite numbers");
        if (o->normal_count == o->normal_capacity) {
            o->normal_capacity = o->normal_capacity ? o->normal_capacity * 2 : 4096;
            o->normals = mesh_grown(o->normals, o->normal_capacity * 3 * sizeof *o->normals);
        }
        memcpy(o->normals + 3 * o->normal_count++, v, sizeof v);
    } else if (strncmp(s, "f ", 2) == 0) {
        return obj_face(o, s + 2);
    } else if (strncmp(s, "mtllib ", 7) == 0) {
        obj_read_materials(o, obj_word(s + 7));
    } else if (strncmp(s, "usemtl ", 7) == 0) {
        int found = obj_material(o, obj_word(s + 7));
        o->m->material = (unsigned char)(found < 0 ? 0 : found);
    }
    return 1;
}

int mesh_read_obj(const char *path, mesh *out, char *error, size_t error_size) {
    static char line[1 << 16];
    obj o;
    memset(&o, 0, sizeof o);
    memset(out, 0, sizeof *out);
    o.m = out;
    o.path = path;
    o.error = error;
    o.error_size = error_size;
    o.names = mesh_grown(NULL, MESH_MATERIALS * sizeof *o.names);
    memset(o.names, 0, MESH_MATERIALS * sizeof *o.names);
    mesh_add_material(out, 0.8f, 0.8f, 0.8f);
    FILE *file = fopen(path, "r");
    int ok = file != NULL;
    if (!file)
        snprintf(error, error_size, "%.300s: cannot be read", path);
    while (ok && fgets(line, sizeof line, file)) {
        ++o.line;
        ok = obj_line(&o, line);
    }
    if (ok && !out->triangle_count) {
        snprintf(error, error_size, "%.300s: no face in it", path);
        ok = 0;
    }
    if (file)
        fclose(file);
    free(o.normals);
    free(o.names);
    if (!ok)
        mesh_free(out);
    return ok;
}
