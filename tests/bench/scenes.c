#include "scenes.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- deterministic noise ---------------------------------------------------------------------------------------- */

static uint32_t hash_u32(uint32_t a) {
    a ^= a >> 16;
    a *= 0x7feb352du;
    a ^= a >> 15;
    a *= 0x846ca68bu;
    a ^= a >> 16;
    return a;
}

static uint32_t hash_cell(int x, int y, int z) {
    return hash_u32((uint32_t)x + hash_u32((uint32_t)y + hash_u32((uint32_t)z)));
}

/* [0, 1) */
static double hash_unit(uint32_t a) {
    return hash_u32(a) * (1.0 / 4294967296.0);
}

/* The n-th number of a scene's own sequence, in [lo, hi). */
static double random_in(uint32_t *state, double lo, double hi) {
    *state += 1;
    return lo + (hi - lo) * hash_unit(*state);
}

static double fade(double t) {
    return t * t * t * (t * (t * 6 - 15) + 10);
}

/* Value noise in [-1, 1] on the integer lattice, twice differentiable. */
static double noise3(vec3 p) {
    double fx = floor(p.x), fy = floor(p.y), fz = floor(p.z);
    double u = fade(p.x - fx), v = fade(p.y - fy), w = fade(p.z - fz), sum = 0;
    for (int k = 0; k < 8; ++k) {
        int i = k & 1, j = k >> 1 & 1, l = k >> 2;
        double corner = hash_cell((int)fx + i, (int)fy + j, (int)fz + l) * (2.0 / 4294967296.0) - 1.0;
        sum += corner * (i ? u : 1 - u) * (j ? v : 1 - v) * (l ? w : 1 - w);
    }
    return sum;
}

static double fbm(vec3 p, int octaves) {
    double sum = 0, gain = 0.5;
    for (int i = 0; i < octaves; ++i, gain *= 0.5) {
        sum += gain * noise3(p);
        p = v3_add(v3_scale(p, 2.03), v3(17.1, 5.3, 9.7));
    }
    return sum;
}

/* ---- surfaces --------------------------------------------------------------------------------------------------- */

/* Grid of (nx + 1) x (nz + 1) vertices over [x0, x1] x [z0, z1]. */
typedef double height_function(double x, double z, const void *context);

static void add_relief(mesh *m, mesh_frame f, double x0, double z0, double x1, double z1, int nx, int nz,
                       height_function *height, const void *context) {
    unsigned first = (unsigned)m->vertex_count, row = (unsigned)nx + 1;
    for (int j = 0; j <= nz; ++j)
        for (int i = 0; i <= nx; ++i) {
            double x = x0 + (x1 - x0) * i / nx, z = z0 + (z1 - z0) * j / nz;
            mesh_add_vertex(m, &f, v3(x, height(x, z, context), z));
        }
    for (unsigned j = 0; j < (unsigned)nz; ++j)
        for (unsigned i = 0; i < (unsigned)nx; ++i) {
            unsigned a = first + j * row + i;
            mesh_add_quad(m, a, a + 1, a + row + 1, a + row);
        }
}

/* Zero set of a signed distance (negative inside) on a grid of cells, by naive surface nets: one vertex per cell that
 * the surface crosses, at the mean of the crossings of its edges. */
typedef double distance_function(vec3 p, const void *context);

static void add_implicit(mesh *m, mesh_frame f, distance_function *distance, const void *context, vec3 lo, vec3 hi,
                         double cell) {
    int nx = (int)((hi.x - lo.x) / cell) + 1, ny = (int)((hi.y - lo.y) / cell) + 1,
        nz = (int)((hi.z - lo.z) / cell) + 1;
    size_t plane = (size_t)(nx + 1) * (size_t)(ny + 1);
    float *d = mesh_grown(NULL, plane * (size_t)(nz + 1) * sizeof *d);
    unsigned *vertex = mesh_grown(NULL, plane * (size_t)(nz + 1) * sizeof *vertex);
#define AT(i, j, k) ((size_t)(k)*plane + (size_t)(j) * (size_t)(nx + 1) + (size_t)(i))
    for (int k = 0; k <= nz; ++k)
        for (int j = 0; j <= ny; ++j)
            for (int i = 0; i <= nx; ++i)
                d[AT(i, j, k)] = (float)distance(v3_add(lo, v3(i * cell, j * cell, k * cell)), context);
    for (int k = 0; k < nz; ++k)
        for (int j = 0; j < ny; ++j)
            for (int i = 0; i < nx; ++i) {
                vec3 sum = v3(0, 0, 0);
                int crossings = 0;
                for (int e = 0; e < 12; ++e) {
                    int axis = e >> 2, a[3] = {0, 0, 0}, b[3];
                    a[(axis + 1) % 3] = e & 1, a[(axis + 2) % 3] = e >> 1 & 1;
                    memcpy(b, a, sizeof b);
                    b[axis] = 1;
                    double da = (double)d[AT(i + a[0], j + a[1], k + a[2])];
                    double db = (double)d[AT(i + b[0], j + b[1], k + b[2])];
                    if ((da < 0) == (db < 0))
                        continue;
                    double t = da / (da - db);
                    vec3 pa = v3(a[0], a[1], a[2]), pb = v3(b[0], b[1], b[2]);
                    sum = v3_add(sum, v3_mad(pa, v3_sub(pb, pa), t));
                    ++crossings;
                }
                if (crossings)
                    vertex[AT(i, j, k)] = mesh_add_vertex(
                        m, &f, v3_mad(v3_add(lo, v3(i * cell, j * cell, k * cell)), sum, cell / crossings));
            }
    /* Each crossed grid edge joins the four cells around it. */
    for (int k = 1; k < nz; ++k)
        for (int j = 1; j < ny; ++j)
            for (int i = 1; i < nx; ++i) {
                bool inside = d[AT(i, j, k)] < 0;
                if (inside != (d[AT(i + 1, j, k)] < 0))
                    mesh_add_quad(m, vertex[AT(i, j - 1, k - 1)], vertex[AT(i, j, k - 1)], vertex[AT(i, j, k)],
                                  vertex[AT(i, j - 1, k)]);
                if (inside != (d[AT(i, j + 1, k)] < 0))
                    mesh_add_quad(m, vertex[AT(i - 1, j, k - 1)], vertex[AT(i, j, k - 1)], vertex[AT(i, j, k)],
                                  vertex[AT(i - 1, j, k)]);
                if (inside != (d[AT(i, j, k + 1)] < 0))
                    mesh_add_quad(m, vertex[AT(i - 1, j - 1, k)], vertex[AT(i, j - 1, k)], vertex[AT(i, j, k)],
                                  vertex[AT(i - 1, j, k)]);
            }
#undef AT
    free(vertex);
    free(d);
}

/* Smooth union of two distances, blended over the length k. */
static double smooth_union(double a, double b, double k) {
    double h = fmax(k - fabs(a - b), 0) / k;
    return fmin(a, b) - h * h * k * 0.25;
}

static double capsule_distance(vec3 p, vec3 a, vec3 b, double ra, double rb) {
    vec3 pa = v3_sub(p, a), ba = v3_sub(b, a);
    double h = fmax(0, fmin(1, v3_dot(pa, ba) / v3_dot(ba, ba)));
    return v3_length(v3_mad(pa, ba, -h)) - (ra + (rb - ra) * h);
}

static double ellipsoid_distance(vec3 p, vec3 c, double rx, double ry, double rz) {
    vec3 q = v3_sub(p, c), s = v3(q.x / rx, q.y / ry, q.z / rz);
    double k0 = v3_length(s), k1 = v3_length(v3(s.x / rx, s.y / ry, s.z / rz));
    return k1 > 0 ? k0 * (k0 - 1) / k1 : -fmin(rx, fmin(ry, rz));
}

/* ---- camera ------------------------------------------------------------------------------------------------------ */

void bench_scene_look_at(bench_scene *s, vec3 eye, vec3 target, double focal_widths, int width, int height) {
    bench_scene_camera *c = &s->camera;
    c->eye = eye;
    c->forward = v3_normalize(v3_sub(target, eye));
    c->right = v3_normalize(v3_cross(c->forward, v3(0, 1, 0)));
    c->down = v3_cross(c->forward, c->right);
    c->focal_px = focal_widths * width;
    c->cx = 0.5 * width, c->cy = 0.5 * height;
    c->width = width, c->height = height;
}

/* ---- the scenes -------------------------------------------------------------------------------------------------- */

typedef struct height_map {
    int width, height;
    float *rows; /* top row first */
} height_map;

static bool read_height_map(const char *path, height_map *map) {
    FILE *file = fopen(path, "rb");
    double scale = 0;
    bool ok = file && fscanf(file, "Pf %d %d %lf", &map->width, &map->height, &scale) == 3 && scale < 0 &&
              map->width > 1 && map->height > 1 && map->width < 10000 && map->height < 10000 && fgetc(file) == '\n';
    if (ok) {
        size_t row = (size_t)map->width;
        map->rows = mesh_grown(NULL, row * (size_t)map->height * sizeof *map->rows);
        for (int y = map->height - 1; y >= 0 && ok; --y)
            ok = fread(map->rows + (size_t)y * row, sizeof *map->rows, row, file) == row;
    }
    if (!ok)
        fprintf(stderr, "%s: not a little-endian one-channel PFM\n", path);
    if (file)
        fclose(file);
    return ok;
}

static double map_height(double x, double z, const void *context) {
    const height_map *map = context;
    int i = (int)fmax(0, fmin(map->width - 1, x)), j = (int)fmax(0, fmin(map->height - 1, z));
    return (double)map->rows[(size_t)j * (size_t)map->width + (size_t)i];
}

/* Open ground with real relief: one unit is one cell (92 m), heights exaggerated three times. */
static bool build_terrain(bench_scene *s, int width, int height) {
    height_map map = {0, 0, NULL};
    if (!read_height_map("tests/data/jacksboro.pfm", &map))
        return false;
    mesh_frame f = mesh_scaled(mesh_world, 1, 3.0 / 92.0, 1);
    add_relief(&s->mesh, f, 0, 0, map.width - 1, map.height - 1, map.width - 1, map.height - 1, map_height, &map);
    double ground = map_height(172, 250, &map) * 3.0 / 92.0;
    free(map.rows);
    bench_scene_look_at(s, v3(160, ground + 45, 370), v3(185, ground - 12, 230), 1.0, width, height);
    s->radius = 12;
    return true;
}

/* A stairwell: corners, treads, a landing, balusters, beams, a door reveal and a window. */
static bool build_stairs(bench_scene *s, int width, int height) {
    mesh *m = &s->mesh;
    mesh_frame f = mesh_world;
    mesh_add_box(m, f, -3, -0.1, -4, 3, 0, 4);     /* floor */
    mesh_add_box(m, f, -3, 3.2, -4, 3, 3.3, 4);    /* ceiling */
    mesh_add_box(m, f, -3.1, 0, -4, -3, 3.2, 4);   /* left wall */
    mesh_add_box(m, f, 3, 0, -4, 3.15, 3.2, -2.2); /* right wall with a window */
    mesh_add_box(m, f, 3, 0, -2.2, 3.15, 1.0, -0.9);
    mesh_add_box(m, f, 3, 2.3, -2.2, 3.15, 3.2, -0.9);
    mesh_add_box(m, f, 3, 0, -0.9, 3.15, 3.2, 4);
    mesh_add_box(m, f, 2.94, 0.95, -2.3, 3.1, 1.0, -0.8); /* sill */
    mesh_add_box(m, f, 3.04, 1.62, -2.2, 3.09, 1.67, -0.9);
    mesh_add_box(m, f, 3.04, 1.0, -1.57, 3.09, 2.3, -1.53);
    /* back wall with a door opening */
    mesh_add_box(m, f, -3, 0, -4.2, -0.4, 3.2, -4);
    mesh_add_box(m, f, 0.6, 0, -4.2, 3, 3.2, -4);
    mesh_add_box(m, f, -0.4, 2.1, -4.2, 0.6, 3.2, -4);
    mesh_add_box(m, f, -0.4, 0, -4.6, 0.6, 2.1, -4.5);
    mesh_add_box(m, f, -0.48, 0, -4.0, -0.4, 2.18, -3.95);
    mesh_add_box(m, f, 0.6, 0, -4.0, 0.68, 2.18, -3.95);
    mesh_add_box(m, f, -0.48, 2.1, -4.0, 0.68, 2.18, -3.95);
    mesh_add_box(m, f, 0.52, 0, -4.45, 0.56, 2.1, -4.0);
    for (int i = 0; i < 4; ++i)
        mesh_add_box(m, f, -3, 2.98, -3.4 + 1.7 * i, 3, 3.2, -3.2 + 1.7 * i); /* beams */
    mesh_add_box(m, f, -3, 0, -4, -2.97, 0.12, 4);                            /* skirting */
    mesh_add_box(m, f, -0.98, 0, -4, -0.48, 0.12, -3.97);
    mesh_add_box(m, f, 0.68, 0, -4, 3, 0.12, -3.97);
    mesh_add_box(m, f, 2.97, 0, -4, 3, 0.12, 4);
    /* twelve steps along the left wall, up to a landing at the back */
    for (int i = 0; i < 12; ++i) {
        double z = 1.6 - 0.32 * i, y = 0.17 * (i + 1);
        mesh_add_box(m, f, -3, y - 0.17, z - 0.32, -1.6, y - 0.03, z);
        mesh_add_box(m, f, -3, y - 0.03, z - 0.32, -1.57, y, z + 0.03);
        for (int k = 0; k < 2; ++k) {
            double bz = z - 0.08 - 0.16 * k, top = y + 0.85 + 0.085 * k;
            mesh_add_rod(m, f, v3(-1.65, y, bz), v3(-1.65, top, bz), 0.014, 0.014, 10);
        }
    }
    mesh_add_box(m, f, -3, 1.87, -4, -1.57, 2.04, -2.24);
    mesh_add_capsule(m, f, v3(-1.65, 0.98, 1.7), v3(-1.65, 3.02, -2.15), 0.032, 0.032, 14);
    mesh_add_box(m, f, -1.71, 0, 1.6, -1.59, 1.12, 1.72);
    mesh_add_ellipsoid(m, f, v3(-1.65, 1.18, 1.66), 0.075, 0.075, 0.075, 24);
    /* something under the landing and by the door */
    mesh_add_box(m, mesh_turned_y(mesh_moved(f, -1.1, 0, -3.3), 20), -0.25, 0, -0.25, 0.25, 0.45, 0.25);
    mesh_add_box(m, mesh_turned_y(mesh_moved(f, -1.12, 0.45, -3.32), -12), -0.17, 0, -0.17, 0.17, 0.3, 0.17);
    static const double umbrella_stand[][2] = {{0, 0},       {0.14, 0},    {0.15, 0.02}, {0.13, 0.3}, {0.17, 0.58},
                                               {0.15, 0.58}, {0.115, 0.3}, {0.12, 0.04}, {0, 0.04}};
    mesh_add_revolved(m, mesh_moved(f, 1.05, 0, -3.6), umbrella_stand, 9, 40);
    mesh_add_rod(m, f, v3(1.02, 0.05, -3.6), v3(0.93, 0.95, -3.66), 0.02, 0.02, 10);
    mesh_add_rod(m, f, v3(1.1, 0.05, -3.62), v3(1.2, 0.9, -3.6), 0.02, 0.03, 10);
    bench_scene_look_at(s, v3(1.75, 1.75, 3.5), v3(-0.75, 1.05, -2.2), 0.72, width, height);
    s->radius = 1;
    return true;
}

static void add_column(mesh *m, mesh_frame f, double h) {
    double p[][2] = {{0.48, 0.16},    {0.5, 0.2},       {0.5, 0.26},      {0.47, 0.3},      {0.42, 0.32},
                     {0.42, 0.36},    {0.44, 0.4},      {0.44, 0.44},     {0.4, 0.48},      {0.36, 0.52},
                     {0.36, 0.56},    {0.345, h * 0.5}, {0.31, h - 0.62}, {0.31, h - 0.58}, {0.34, h - 0.55},
                     {0.34, h - 0.5}, {0.31, h - 0.47}, {0.32, h - 0.36}, {0.37, h - 0.26}, {0.45, h - 0.18},
                     {0.47, h - 0.14}};
    mesh_lathe l = {(const double(*)[2])p, 21, 120, 20, 0.1, 10, 12};
    mesh_add_lathe(m, f, &l);
    mesh_add_block(m, f, 0, 0.08, 0, 1.08, 0.16, 1.08);
    mesh_add_block(m, f, 0, h - 0.07, 0, 1.04, 0.14, 1.04);
}

/* Two rows of fluted columns under arches on three steps, a coffered ceiling, the sky at the end. */
static bool build_columns(bench_scene *s, int width, int height) {
    mesh *m = &s->mesh;
    mesh_frame f = mesh_world;
    const double h = 4.2, pitch = 3.0;
    mesh_add_box(m, f, -60, -1.2, -90, 60, -0.75, 30);
    mesh_add_box(m, f, -4.2, -0.75, -22, 4.2, -0.5, 9);
    mesh_add_box(m, f, -3.8, -0.5, -21.6, 3.8, -0.25, 9);
    mesh_add_box(m, f, -3.4, -0.25, -21.2, 3.4, 0, 9);
    for (int i = 0; i < 9; ++i)
        for (int side = -1; side <= 1; side += 2) {
            double z = 4 - pitch * i;
            add_column(m, mesh_moved(f, 2.5 * side, 0, z), h);
            if (i == 8)
                continue;
            /* a round arch to the next column: voussoirs of a half ring, and the wall above it */
            enum { N = 20 };
            double c = z - pitch / 2, r = pitch / 2 - 0.42;
            for (int k = 0; k < N; ++k) {
                double a0 = V3_PI * k / N, a1 = V3_PI * (k + 1) / N, ro = r + (k % 2 ? 0.2 : 0.26);
                double px = 2.5 * side, x0 = px - 0.4, x1 = px + 0.4;
                unsigned v[8];
                for (int q = 0; q < 8; ++q) {
                    double a = q & 2 ? a1 : a0, rr = q & 4 ? ro : r;
                    v[q] = mesh_add_vertex(m, &f, v3(q & 1 ? x1 : x0, h + rr * sin(a), c + rr * cos(a)));
                }
                mesh_add_quad(m, v[0], v[1], v[3], v[2]);
                mesh_add_quad(m, v[4], v[6], v[7], v[5]);
                mesh_add_quad(m, v[0], v[2], v[6], v[4]);
                mesh_add_quad(m, v[1], v[5], v[7], v[3]);
            }
            for (int k = 0; k < N; ++k) {
                double z0 = c - pitch / 2 + pitch * k / N, z1 = z0 + pitch / N, mid = 0.5 * (z0 + z1) - c;
                double inside = r * r - mid * mid, y = h + (inside > 0 ? sqrt(inside) : 0);
                mesh_add_box(m, f, 2.5 * side - 0.34, y, z0, 2.5 * side + 0.34, h + 1.75, z1);
            }
        }
    /* cornice and coffered ceiling */
    for (int side = -1; side <= 1; side += 2) {
        mesh_add_box(m, f, 2.5 * side - 0.5, h + 1.55, -21, 2.5 * side + 0.5, h + 1.65, 9);
        mesh_add_box(m, f, 2.5 * side - 0.6, h + 1.65, -21, 2.5 * side + 0.6, h + 1.8, 9);
    }
    mesh_add_box(m, f, -3.1, h + 2.1, -21, 3.1, h + 2.3, 9);
    for (int i = 0; i < 21; ++i)
        mesh_add_box(m, f, -2.9, h + 1.8, 7.6 - 1.5 * i, 2.9, h + 2.1, 7.9 - 1.5 * i);
    for (int i = 0; i < 4; ++i)
        mesh_add_box(m, f, -2.1 + 1.3 * i, h + 1.8, -21, -1.8 + 1.3 * i, h + 2.1, 9);
    /* a broken drum and rubble in the nave, a bench */
    static const double drum[][2] = {{0, 0}, {0.36, 0}, {0.36, 0.9}, {0, 0.9}};
    mesh_lathe l = {drum, 4, 80, 20, 0.1, 1, 2};
    mesh_add_lathe(m, mesh_turned_x(mesh_turned_y(mesh_moved(f, -0.9, 0.33, -1.5), 30), 90), &l);
    uint32_t seed = 40;
    for (int i = 0; i < 14; ++i) {
        double size = random_in(&seed, 0.08, 0.3);
        mesh_frame r = mesh_moved(f, random_in(&seed, -2.0, 0.6), size * 0.4, random_in(&seed, -4.0, -0.2));
        r = mesh_turned_x(mesh_turned_y(r, random_in(&seed, 0, 360)), random_in(&seed, -25, 25));
        mesh_add_block(m, r, 0, 0, 0, size, size * 0.8, size * 1.3);
    }
    mesh_add_box(m, f, 1.2, 0.38, -3.6, 1.7, 0.46, -1.8);
    mesh_add_box(m, f, 1.25, 0, -3.4, 1.65, 0.38, -3.2);
    mesh_add_box(m, f, 1.25, 0, -2.2, 1.65, 0.38, -2.0);
    bench_scene_look_at(s, v3(0.9, 1.9, 4.6), v3(-0.75, 2.0, -6), 0.78, width, height);
    s->radius = 1.5;
    return true;
}

/* A leaf along +z from the origin, bent down and folded along its rib. */
static void add_leaf(mesh *m, mesh_frame f, double length, double breadth, double droop, double fold) {
    enum { N = 7 };
    unsigned row[3] = {0, 0, 0};
    for (int i = 0; i <= N; ++i) {
        double t = (double)i / N, half = breadth * sin(V3_PI * pow(t, 0.75)) * 0.5;
        double z = length * t, y = -droop * length * t * t;
        unsigned next[3];
        for (int k = 0; k < 3; ++k)
            next[k] = mesh_add_vertex(m, &f, v3((k - 1) * half, y + (k == 1 ? 0 : fold * half), z));
        for (int k = 0; i > 0 && k < 2; ++k)
            mesh_add_quad(m, row[k], row[k + 1], next[k + 1], next[k]);
        memcpy(row, next, sizeof row);
    }
}

static double soil_height(double x, double z, const void *context) {
    (void)context;
    return 0.05 * fbm(v3(3 * x, 0.5, 3 * z), 5);
}

/* A shrub in a pot, ferns and grass on bumpy ground. */
static bool build_foliage(bench_scene *s, int width, int height) {
    mesh *m = &s->mesh;
    mesh_frame f = mesh_world;
    uint32_t seed = 7;
    add_relief(m, f, -6, -9, 6, 4, 260, 280, soil_height, NULL);
    static const double pot[][2] = {{0, 0},      {0.2, 0},   {0.3, 0.42},  {0.34, 0.42},
                                    {0.35, 0.5}, {0.3, 0.5}, {0.28, 0.44}, {0, 0.44}};
    mesh_frame p = mesh_moved(f, 0, 0.03, 0);
    mesh_add_revolved(m, p, pot, 8, 64);
    /* branches from the pot, each with leaves on a golden-angle spiral */
    for (int b = 0; b < 26; ++b) {
        double azimuth = 137.508 * b, spread = 0.15 + 0.75 * sqrt((b + 0.5) / 26.0);
        vec3 at = v3(0, 0.45, 0);
        double a = azimuth * V3_PI / 180, pitch = V3_PI / 2 - spread, step = 0.085;
        for (int i = 0; i < 11; ++i) {
            vec3 next = v3_add(at, v3(step * cos(pitch) * cos(a), step * sin(pitch), step * cos(pitch) * sin(a)));
            mesh_add_rod(m, p, at, next, 0.012 * (1 - i / 13.0), 0.012 * (1 - (i + 1) / 13.0), 6);
            for (int k = 0; i > 1 && k < 3; ++k) {
                mesh_frame leaf = mesh_turned_y(mesh_moved(p, next.x, next.y, next.z), 137.508 * (3 * i + k) + azimuth);
                leaf = mesh_turned_z(mesh_turned_x(leaf, random_in(&seed, -35, 15)), random_in(&seed, -25, 25));
                add_leaf(m, leaf, random_in(&seed, 0.13, 0.22), random_in(&seed, 0.06, 0.1), 0.3, 0.3);
            }
            at = next;
            pitch -= 0.06;
            a += random_in(&seed, -0.12, 0.12);
        }
    }
    /* ferns */
    for (int n = 0; n < 9; ++n) {
        double x = random_in(&seed, -2.2, 2.2), z = random_in(&seed, -2.8, -0.3);
        if (fabs(x) < 0.65 && z > -0.9)
            x += x < 0 ? -0.8 : 0.8;
        mesh_frame base = mesh_turned_y(mesh_moved(f, x, soil_height(x, z, NULL), z), random_in(&seed, 0, 360));
        for (int b = 0; b < 12; ++b) {
            mesh_frame frond =
                mesh_turned_x(mesh_turned_y(base, 30 * b + random_in(&seed, -8, 8)), random_in(&seed, -62, -38));
            double size = random_in(&seed, 0.5, 0.9);
            for (int i = 1; i < 22; ++i) {
                double t = i / 22.0, y = -0.9 * size * t * t * t, zz = size * t;
                for (int side = -1; side <= 1; side += 2)
                    add_leaf(m, mesh_turned_y(mesh_moved(frond, 0, y, zz), side * 68),
                             0.25 * size * sin(V3_PI * pow(t, 0.6)) + 0.01, 0.035 * size, 0.25, 0.1);
            }
            mesh_add_rod(m, frond, v3(0, 0, 0), v3(0, -0.1 * size, 0.5 * size), 0.006, 0.004, 5);
        }
    }
    /* grass */
    for (int n = 0; n < 2600; ++n) {
        double x = random_in(&seed, -3.5, 3.5), z = random_in(&seed, -4.5, 1.6);
        mesh_frame blade =
            mesh_turned_y(mesh_moved(f, x, soil_height(x, z, NULL) - 0.005, z), random_in(&seed, 0, 360));
        add_leaf(m, mesh_turned_x(blade, random_in(&seed, -85, -60)), random_in(&seed, 0.07, 0.22), 0.012,
                 random_in(&seed, 0.2, 0.9), 0.2);
    }
    bench_scene_look_at(s, v3(0.55, 1.35, 2.35), v3(0.0, 0.5, -0.35), 0.85, width, height);
    s->radius = 0.4;
    return true;
}

/* Grilles: a fan behind its guard, a lattice, louvres and a chain-link panel before a wall. */
static bool build_grilles(bench_scene *s, int width, int height) {
    mesh *m = &s->mesh;
    mesh_frame f = mesh_world;
    mesh_add_box(m, f, -5, -0.1, -0.9, 5, 0, 5);
    mesh_add_box(m, f, -5, 0, -1.0, 5, 4, -0.9);
    /* table fan */
    mesh_frame fan = mesh_moved(f, -0.05, 0, 0.1);
    static const double foot[][2] = {{0, 0},       {0.3, 0},     {0.31, 0.02}, {0.28, 0.05}, {0.1, 0.08},
                                     {0.05, 0.12}, {0.035, 0.2}, {0.03, 0.62}, {0, 0.62}};
    mesh_add_revolved(m, fan, foot, 9, 48);
    mesh_frame head =
        mesh_turned_x(mesh_turned_y(mesh_moved(fan, 0, 0.8, 0), 18), 90 - 8); /* y axis: towards the viewer */
    mesh_add_capsule(m, head, v3(0, -0.26, 0), v3(0, -0.08, 0), 0.1, 0.11, 32);
    static const double hub[][2] = {{0, 0.1}, {0.05, 0.1}, {0.075, 0.07}, {0.08, -0.02}, {0, -0.02}};
    mesh_add_revolved(m, head, hub, 5, 36);
    for (int i = 0; i < 4; ++i)
        add_leaf(m, mesh_turned_z(mesh_moved(mesh_turned_y(head, 90 * i + 20), 0, 0.04, 0.05), 32), 0.42, 0.3, 0.05,
                 0.15);
    for (int i = 1; i <= 9; ++i) {
        double r = 0.055 * i, y = 0.14 - 0.09 * pow(i / 9.0, 3);
        mesh_add_ring(m, mesh_moved(head, 0, y, 0), r, 0.005, 96, 8);
        if (i > 2)
            mesh_add_ring(m, mesh_moved(head, 0, -0.1 + 0.05 * pow(i / 9.0, 3), 0), r, 0.005, 96, 8);
    }
    mesh_add_ring(m, head, 0.5, 0.014, 96, 10);
    for (int i = 0; i < 40; ++i) {
        double a = 2 * V3_PI * i / 40, c = cos(a), q = sin(a);
        mesh_add_rod(m, head, v3(0.05 * c, 0.14, 0.05 * q), v3(0.36 * c, 0.11, 0.36 * q), 0.004, 0.004, 6);
        mesh_add_rod(m, head, v3(0.36 * c, 0.11, 0.36 * q), v3(0.5 * c, 0.01, 0.5 * q), 0.004, 0.004, 6);
        mesh_add_rod(m, head, v3(0.11 * c, -0.1, 0.11 * q), v3(0.5 * c, -0.01, 0.5 * q), 0.004, 0.004, 6);
    }
    /* louvred vent in the wall */
    mesh_frame vent = mesh_moved(f, -1.25, 0.95, -0.9);
    mesh_add_box(m, vent, -0.55, -0.5, 0, -0.48, 0.5, 0.08);
    mesh_add_box(m, vent, 0.48, -0.5, 0, 0.55, 0.5, 0.08);
    mesh_add_box(m, vent, -0.55, 0.45, 0, 0.55, 0.52, 0.08);
    mesh_add_box(m, vent, -0.55, -0.52, 0, 0.55, -0.45, 0.08);
    for (int i = 0; i < 9; ++i)
        mesh_add_block(m, mesh_turned_x(mesh_moved(vent, 0, -0.4 + 0.1 * i, 0.04), -40), 0, 0, 0, 0.96, 0.012, 0.1);
    /* wooden lattice leaning against the wall */
    mesh_frame lattice = mesh_turned_x(mesh_moved(f, 1.2, 0.0, -0.25), -14);
    mesh_add_box(m, lattice, -0.62, 0, -0.03, -0.55, 1.6, 0.03);
    mesh_add_box(m, lattice, 0.55, 0, -0.03, 0.62, 1.6, 0.03);
    mesh_add_box(m, lattice, -0.62, 1.55, -0.03, 0.62, 1.62, 0.03);
    mesh_add_box(m, lattice, -0.62, 0, -0.03, 0.62, 0.07, 0.03);
    for (int i = -3; i <= 10; ++i)
        for (int side = -1; side <= 1; side += 2) {
            /* a slat at 45 degrees, cut by the frame */
            double y0 = 0.15 * i, x0 = -0.55, x1 = 0.55;
            double ya = y0 + (side > 0 ? 0 : 1.1), yb = y0 + (side > 0 ? 1.1 : 0);
            double t0 = 0, t1 = 1;
            for (int e = 0; e < 2; ++e) { /* clip to 0.07 .. 1.55 */
                double limit = e ? 1.55 : 0.07, t = (limit - ya) / (yb - ya);
                bool enters = (yb > ya) == (e == 0);
                if (enters)
                    t0 = fmax(t0, t);
                else
                    t1 = fmin(t1, t);
            }
            if (t1 - t0 < 0.02)
                continue;
            vec3 a = v3(x0 + (x1 - x0) * t0, ya + (yb - ya) * t0, side * 0.008);
            vec3 b = v3(x0 + (x1 - x0) * t1, ya + (yb - ya) * t1, side * 0.008);
            mesh_frame slat = lattice;
            vec3 d = v3_normalize(v3_sub(b, a));
            slat.o = mesh_apply(&lattice, a);
            slat.x = v3_add(v3_scale(lattice.x, d.x), v3_scale(lattice.y, d.y));
            slat.y = v3_add(v3_scale(lattice.x, -d.y), v3_scale(lattice.y, d.x));
            mesh_add_box(m, slat, 0, -0.018, -0.007, v3_length(v3_sub(b, a)), 0.018, 0.007);
        }
    /* wire basket on the floor with balls in it */
    mesh_frame basket = mesh_moved(f, 0.62, 0.0, 0.75);
    for (int i = 0; i < 7; ++i)
        mesh_add_ring(m, mesh_moved(basket, 0, 0.02 + 0.05 * i, 0), 0.16 + 0.012 * i, 0.0045, 64, 8);
    for (int i = 0; i < 24; ++i) {
        double a = 2 * V3_PI * i / 24;
        mesh_add_rod(m, basket, v3(0.16 * cos(a), 0.02, 0.16 * sin(a)), v3(0.232 * cos(a), 0.32, 0.232 * sin(a)), 0.004,
                     0.004, 6);
    }
    static const double balls[6][4] = {{0, 0.08, 0.06, 0.08},      {-0.08, 0.08, -0.05, 0.07},
                                       {0.09, 0.07, -0.06, 0.065}, {-0.01, 0.2, -0.01, 0.075},
                                       {0.1, 0.18, 0.05, 0.06},    {-0.1, 0.17, 0.06, 0.055}};
    for (int i = 0; i < 6; ++i)
        mesh_add_ellipsoid(m, basket, v3(balls[i][0], balls[i][1], balls[i][2]), balls[i][3], balls[i][3], balls[i][3],
                           32);
    bench_scene_look_at(s, v3(0.35, 1.25, 3.1), v3(-0.02, 0.68, -0.3), 0.95, width, height);
    s->radius = 0.5;
    return true;
}

/* An animal as a scanner would see it: smooth limbs under wrinkles and grain. */
static double beast_distance(vec3 p, const void *context) {
    (void)context;
    /* left and right alike but for the pose of the legs */
    vec3 q = v3(fabs(p.x), p.y, p.z);
    double d = ellipsoid_distance(p, v3(0, 1.02, 0), 0.42, 0.45, 0.72);
    d = smooth_union(d, ellipsoid_distance(p, v3(0, 1.12, 0.45), 0.36, 0.4, 0.42), 0.15);
    d = smooth_union(d, ellipsoid_distance(p, v3(0, 1.32, 0.98), 0.25, 0.3, 0.28), 0.14);  /* head */
    d = smooth_union(d, ellipsoid_distance(q, v3(0.1, 1.53, 0.95), 0.13, 0.1, 0.14), 0.1); /* brow */
    double step = p.x < 0 ? 0.12 : -0.06;
    d = smooth_union(d, capsule_distance(q, v3(0.22, 0.9, 0.42), v3(0.24, 0.12, 0.47 + step), 0.19, 0.14), 0.12);
    d = smooth_union(d, capsule_distance(q, v3(0.22, 0.9, -0.42), v3(0.25, 0.12, -0.5 - step), 0.22, 0.145), 0.12);
    for (int k = 0; k < 3; ++k) /* toes */
        d = smooth_union(
            d, ellipsoid_distance(q, v3(0.17 + 0.08 * k, 0.05, 0.59 + step - 0.03 * abs(k - 1)), 0.05, 0.05, 0.06),
            0.03);
    /* trunk */
    vec3 a = v3(0, 1.22, 1.2);
    static const double trunk[6][2] = {{0.98, 1.36}, {0.72, 1.44}, {0.48, 1.46}, {0.3, 1.5}, {0.22, 1.6}, {0.26, 1.7}};
    for (int k = 0; k < 6; ++k) {
        vec3 b = v3(0.03 * sin(k * 1.3), trunk[k][0], trunk[k][1]);
        d = smooth_union(d, capsule_distance(p, a, b, 0.13 - 0.014 * k, 0.116 - 0.014 * k), 0.05);
        a = b;
    }
    /* ears: thin dished plates */
    vec3 e = v3_sub(q, v3(0.36, 1.32, 0.86));
    double bowl = 0.16 * (e.x * e.x + e.y * e.y) * 3 + 0.35 * e.x;
    double plate = fmax(fabs(e.z + bowl) - 0.022, ellipsoid_distance(v3(e.x, e.y, 0), v3(0, 0, 0), 0.24, 0.34, 1));
    d = smooth_union(d, plate, 0.05);
    d = smooth_union(d, capsule_distance(q, v3(0.12, 1.14, 1.14), v3(0.18, 1.0, 1.48), 0.045, 0.014), 0.03); /* tusks */
    d = smooth_union(d, capsule_distance(p, v3(0, 1.15, -0.7), v3(0.1, 0.5, -0.88), 0.04, 0.02), 0.05);      /* tail */
    if (d < 0.1 && d > -0.1) {
        double folds = sin(38 * p.y + 5 * fbm(v3_scale(p, 3), 3)) * (0.5 + fbm(v3_scale(p, 2.1), 2));
        d += 0.02 * fbm(v3_scale(p, 7), 5) + 0.011 * folds + 0.008 * fbm(v3_scale(p, 45), 2);
    }
    return d;
}

static double coral_distance(vec3 p, const void *context) {
    (void)context;
    double r = v3_length(p), d = r - 0.36;
    return d + 0.17 * noise3(v3_scale(p, 6.5)) + 0.05 * noise3(v3_scale(p, 15)) + 0.015 * fbm(v3_scale(p, 34), 3);
}

static bool build_scan(bench_scene *s, int width, int height) {
    mesh *m = &s->mesh;
    mesh_frame f = mesh_world;
    mesh_add_box(m, f, -20, -0.62, -20, 20, -0.5, 20);
    static const double plinth[][2] = {{1.45, -0.5}, {1.45, -0.36}, {1.4, -0.34}, {1.34, -0.3},
                                       {1.3, -0.1},  {1.34, -0.06}, {1.36, 0},    {0, 0}};
    mesh_add_revolved(m, mesh_turned_y(f, 0), plinth, 8, 8);
    add_implicit(m, mesh_turned_y(mesh_moved(f, -0.1, 0.01, -0.2), 48), beast_distance, NULL, v3(-0.75, -0.05, -1.05),
                 v3(0.75, 1.9, 1.9), 0.014);
    add_implicit(m, mesh_moved(f, 0.98, 0.22, 0.15), coral_distance, NULL, v3(-0.65, -0.65, -0.65),
                 v3(0.65, 0.65, 0.65), 0.012);
    bench_scene_look_at(s, v3(2.2, 1.65, 3.5), v3(0.32, 0.72, 0.2), 1.02, width, height);
    s->radius = 0.5;
    return true;
}

static void add_chair(mesh *m, mesh_frame f) {
    for (int i = 0; i < 4; ++i) {
        double x = i & 1 ? 0.19 : -0.19, z = i & 2 ? 0.19 : -0.19, top = i & 2 ? 0.44 : 0.95;
        mesh_add_rod(m, f, v3(x * 1.1, 0, z * 1.12), v3(x, 0.44, z), 0.016, 0.022, 12);
        if (!(i & 2))
            mesh_add_rod(m, f, v3(x, 0.44, z), v3(x, top, z - 0.08), 0.022, 0.016, 12);
    }
    mesh_add_block(m, f, 0, 0.455, 0.01, 0.46, 0.035, 0.46);
    for (int i = 0; i < 3; ++i)
        mesh_add_block(m, mesh_turned_x(mesh_moved(f, 0, 0.62 + 0.13 * i, -0.215 - 0.02 * i), -9), 0, 0, 0, 0.38, 0.06,
                       0.014);
    for (int i = 0; i < 2; ++i)
        mesh_add_rod(m, f, v3(-0.2, 0.2, i ? 0.2 : -0.2), v3(0.2, 0.2, i ? 0.2 : -0.2), 0.011, 0.011, 8);
}

/* A study full of things: desk, chairs, shelves with books, lamp, boxes, cables, a crumpled rug. */
static double rug_height(double x, double z, const void *context) {
    (void)context;
    double fold = exp(-8 * (x - 0.4) * (x - 0.4)) * 0.05 * (1 + sin(9 * z + 3 * x));
    return 0.012 + fold + 0.006 * fbm(v3(4 * x, 0, 4 * z), 3);
}

static bool build_furniture(bench_scene *s, int width, int height) {
    mesh *m = &s->mesh;
    mesh_frame f = mesh_world;
    uint32_t seed = 99;
    mesh_add_box(m, f, -3, -0.1, -2, 3, 0, 4);
    mesh_add_box(m, f, -3, 0, -2.1, 3, 3, -2);
    mesh_add_box(m, f, -3.1, 0, -2, -3, 3, 4);
    mesh_add_box(m, f, -3, 0, -2, 3, 0.1, -1.975);
    add_relief(m, f, -1.5, -0.5, 1.4, 1.3, 120, 80, rug_height, NULL);
    /* desk with drawers */
    mesh_frame desk = mesh_moved(f, -0.2, 0, -1.5);
    mesh_add_block(m, desk, 0, 0.745, 0, 1.7, 0.035, 0.8);
    for (int i = 0; i < 4; ++i)
        mesh_add_block(m, desk, i & 1 ? 0.8 : -0.8, 0.365, i & 2 ? 0.35 : -0.35, 0.06, 0.73, 0.06);
    mesh_add_block(m, desk, 0.55, 0.5, 0, 0.44, 0.46, 0.7);
    for (int i = 0; i < 3; ++i) {
        mesh_add_block(m, desk, 0.55, 0.35 + 0.15 * i, 0.355, 0.41, 0.135, 0.02);
        mesh_add_rod(m, desk, v3(0.48, 0.36 + 0.15 * i, 0.39), v3(0.62, 0.36 + 0.15 * i, 0.39), 0.007, 0.007, 8);
    }
    /* on the desk: screen, keyboard, mug, lamp, papers, pens */
    mesh_frame top = mesh_moved(desk, 0, 0.7625, 0);
    mesh_add_block(m, mesh_turned_y(mesh_moved(top, -0.1, 0, -0.18), 6), 0, 0.33, 0, 0.62, 0.37, 0.025);
    mesh_add_block(m, mesh_turned_y(mesh_moved(top, -0.1, 0, -0.2), 6), 0, 0.1, -0.02, 0.05, 0.2, 0.03);
    mesh_add_block(m, mesh_turned_y(mesh_moved(top, -0.1, 0, -0.2), 6), 0, 0.006, 0, 0.24, 0.012, 0.17);
    mesh_frame keys = mesh_turned_y(mesh_moved(top, -0.1, 0, 0.17), 3);
    mesh_add_block(m, keys, 0, 0.008, 0, 0.44, 0.016, 0.14);
    for (int i = 0; i < 15; ++i)
        for (int j = 0; j < 5; ++j)
            mesh_add_block(m, keys, -0.2 + 0.0285 * i, 0.02, -0.052 + 0.026 * j, 0.023, 0.009, 0.021);
    static const double mug[][2] = {{0, 0}, {0.04, 0}, {0.042, 0.1}, {0.038, 0.1}, {0.036, 0.01}, {0, 0.01}};
    mesh_add_revolved(m, mesh_moved(top, 0.42, 0, 0.14), mug, 6, 32);
    mesh_add_ring(m, mesh_turned_x(mesh_moved(top, 0.472, 0.05, 0.14), 90), 0.026, 0.006, 28, 8);
    mesh_frame lamp = mesh_moved(top, 0.68, 0, -0.2);
    static const double lamp_foot[][2] = {{0, 0}, {0.1, 0}, {0.1, 0.015}, {0.02, 0.03}, {0, 0.03}};
    mesh_add_revolved(m, lamp, lamp_foot, 5, 40);
    mesh_add_rod(m, lamp, v3(0, 0.02, 0), v3(0.08, 0.32, -0.02), 0.009, 0.009, 10);
    mesh_add_rod(m, lamp, v3(0.08, 0.32, -0.02), v3(-0.12, 0.52, 0.1), 0.008, 0.008, 10);
    static const double shade[][2] = {{0.025, 0},    {0.03, 0.04},   {0.085, 0.14},
                                      {0.081, 0.14}, {0.027, 0.045}, {0, 0.03}};
    mesh_add_revolved(m, mesh_turned_x(mesh_moved(lamp, -0.12, 0.54, 0.1), 155), shade, 6, 40);
    for (int i = 0; i < 6; ++i)
        mesh_add_block(m, mesh_turned_y(mesh_moved(top, -0.6, 0.004 + 0.006 * i, 0.1), random_in(&seed, -14, 14)), 0, 0,
                       0, 0.21, 0.005, 0.297);
    for (int i = 0; i < 4; ++i)
        mesh_add_block(m, mesh_turned_y(mesh_moved(top, -0.62, 0.055 + 0.03 * i, -0.22), random_in(&seed, -25, 25)), 0,
                       0, 0, 0.17, 0.028, 0.24);
    add_chair(m, mesh_turned_y(mesh_moved(f, -0.45, 0.02, -0.55), 205));
    add_chair(m, mesh_turned_y(mesh_moved(f, 1.35, 0, 0.35), 250));
    /* shelves with books, on the left wall */
    mesh_frame shelf = mesh_turned_y(mesh_moved(f, -2.72, 0, -0.55), 90);
    for (int i = 0; i < 6; ++i)
        mesh_add_block(m, shelf, 0, 0.06 + 0.38 * i, 0, 1.5, 0.025, 0.3);
    mesh_add_block(m, shelf, -0.76, 1.0, 0, 0.025, 2.0, 0.3);
    mesh_add_block(m, shelf, 0.76, 1.0, 0, 0.025, 2.0, 0.3);
    mesh_add_block(m, shelf, 0, 1.0, -0.145, 1.5, 2.0, 0.01);
    for (int i = 0; i < 5; ++i) {
        double x = -0.72;
        while (x < 0.66) {
            double w = random_in(&seed, 0.018, 0.05), h = random_in(&seed, 0.19, 0.31),
                   d = random_in(&seed, 0.16, 0.23);
            if (random_in(&seed, 0, 1) < 0.08) {
                x += random_in(&seed, 0.08, 0.25);
                continue;
            }
            double tilt = random_in(&seed, 0, 1) < 0.12 ? random_in(&seed, -10, 0) : 0;
            mesh_add_box(m, mesh_turned_z(mesh_moved(shelf, x, 0.0725 + 0.38 * i, -0.12), tilt), 0, 0, 0, w, h, d);
            x += w + 0.002;
        }
    }
    /* boxes and a bin */
    mesh_frame box = mesh_turned_y(mesh_moved(f, 2.1, 0, -1.3), 15);
    mesh_add_block(m, box, 0, 0.2, 0, 0.6, 0.4, 0.5);
    mesh_add_block(m, mesh_turned_x(mesh_moved(box, 0, 0.4, 0.25), 35), 0, 0, 0.12, 0.6, 0.006, 0.24);
    mesh_add_block(m, mesh_turned_y(mesh_moved(box, -0.05, 0.4, -0.06), 20), 0, 0.14, 0, 0.36, 0.28, 0.32);
    static const double bin[][2] = {{0, 0}, {0.12, 0}, {0.16, 0.34}, {0.155, 0.34}, {0.115, 0.01}, {0, 0.01}};
    mesh_add_revolved(m, mesh_moved(f, 1.15, 0, -1.45), bin, 6, 40);
    for (int i = 0; i < 7; ++i)
        mesh_add_ellipsoid(m, mesh_turned_y(mesh_moved(f, 1.15, 0.1 + 0.04 * i, -1.45), 57 * i), v3(0.05, 0, 0.02),
                           0.055, 0.045, 0.05, 7);
    /* picture frames, a shelf board and a clock on the wall */
    mesh_frame wall = mesh_moved(f, 0, 0, -2);
    for (int i = 0; i < 3; ++i) {
        mesh_frame p = mesh_moved(wall, -1.5 + 0.62 * i, 1.75 + 0.12 * (i == 1), 0.02);
        mesh_add_block(m, p, 0, 0, -0.008, 0.42, 0.3, 0.012);
        mesh_add_block(m, p, 0, 0.16, 0, 0.48, 0.03, 0.04);
        mesh_add_block(m, p, 0, -0.16, 0, 0.48, 0.03, 0.04);
        mesh_add_block(m, p, 0.225, 0, 0, 0.03, 0.34, 0.04);
        mesh_add_block(m, p, -0.225, 0, 0, 0.03, 0.34, 0.04);
    }
    mesh_add_block(m, wall, 1.1, 1.45, 0.12, 1.2, 0.03, 0.24);
    for (int i = 0; i < 5; ++i) {
        static const double vase[][2] = {{0, 0},      {0.05, 0},     {0.08, 0.07},  {0.06, 0.15},
                                         {0.03, 0.2}, {0.045, 0.24}, {0.035, 0.24}, {0, 0.2}};
        double k = random_in(&seed, 0.6, 1.1);
        mesh_add_revolved(
            m, mesh_scaled(mesh_moved(wall, 0.65 + 0.22 * i, 1.465, 0.13), k, k * random_in(&seed, 0.7, 1.3), k), vase,
            8, 32);
    }
    bench_scene_look_at(s, v3(1.55, 1.75, 2.6), v3(-0.55, 0.72, -1.1), 0.78, width, height);
    s->radius = 0.6;
    return true;
}

/* A person walking 1.2 m in front of a wall: the silhouette case of [TP16]. */
static bool build_figure(bench_scene *s, int width, int height) {
    mesh *m = &s->mesh;
    mesh_frame f = mesh_world;
    mesh_add_box(m, f, -8, -0.1, -1.6, 8, 0, 6);
    /* a wall of bricks in running bond, a ledge and a kerb */
    mesh_add_box(m, f, -8, 0, -1.8, 8, 4, -1.608);
    for (int j = 0; j < 18; ++j)
        for (int i = -16; i < 16; ++i) {
            double x = 0.32 * i + (j & 1 ? 0.16 : 0), y = 0.16 * j + 0.1;
            double out = 0.006 * hash_unit(hash_cell(i, j, 3));
            mesh_add_box(m, f, x + 0.006, y + 0.006, -1.64, x + 0.314, y + 0.154, -1.6 + out);
        }
    mesh_add_box(m, f, -8, 0, -1.62, 8, 0.1, -1.45);
    mesh_add_box(m, f, -8, 2.98, -1.62, 8, 3.1, -1.4);
    mesh_frame p = mesh_turned_y(mesh_moved(f, 0.05, 0, -0.3), 62);           /* walks along its own +z */
    mesh_add_capsule(m, p, v3(0, 1.0, 0), v3(0, 1.36, 0.02), 0.15, 0.17, 40); /* trunk */
    mesh_add_capsule(m, p, v3(-0.17, 1.4, 0.02), v3(0.17, 1.4, 0.02), 0.07, 0.07, 24);
    mesh_add_capsule(m, p, v3(0, 1.42, 0.03), v3(0, 1.54, 0.05), 0.055, 0.05, 24); /* neck */
    mesh_add_ellipsoid(m, p, v3(0, 1.66, 0.06), 0.088, 0.125, 0.108, 40);
    mesh_add_ellipsoid(m, p, v3(0, 1.64, 0.165), 0.018, 0.03, 0.025, 16);
    /* legs: hip, knee, ankle, toe */
    vec3 hip[2] = {{-0.09, 0.95, 0}, {0.09, 0.95, 0}}, knee[2] = {{-0.1, 0.52, 0.17}, {0.1, 0.5, -0.02}};
    vec3 ankle[2] = {{-0.1, 0.1, 0.3}, {0.1, 0.14, -0.36}}, toe[2] = {{-0.11, 0.06, 0.5}, {0.11, 0.045, -0.2}};
    vec3 shoulder[2] = {{-0.21, 1.39, 0.02}, {0.21, 1.39, 0.02}}, elbow[2] = {{-0.27, 1.12, -0.12}, {0.27, 1.11, 0.08}};
    vec3 wrist[2] = {{-0.25, 0.9, -0.05}, {0.24, 0.94, 0.3}};
    for (int i = 0; i < 2; ++i) {
        mesh_add_capsule(m, p, hip[i], knee[i], 0.095, 0.065, 28);
        mesh_add_capsule(m, p, knee[i], ankle[i], 0.063, 0.042, 28);
        mesh_add_capsule(m, p, ankle[i], toe[i], 0.05, 0.036, 20);
        mesh_add_capsule(m, p, shoulder[i], elbow[i], 0.056, 0.045, 24);
        mesh_add_capsule(m, p, elbow[i], wrist[i], 0.043, 0.032, 24);
        mesh_add_ellipsoid(m, p, v3_add(wrist[i], v3(0, -0.06, 0.02)), 0.028, 0.07, 0.042, 20);
    }
    mesh_add_block(m, mesh_turned_x(mesh_moved(p, 0, 1.2, -0.2), 4), 0, 0, 0, 0.3, 0.42, 0.14); /* rucksack */
    mesh_add_block(m, mesh_turned_x(mesh_moved(p, 0, 1.12, -0.29), 4), 0, 0, 0, 0.22, 0.2, 0.06);
    /* a bench and a bin by the wall, a lamp post near the camera */
    mesh_frame bench = mesh_moved(f, -1.6, 0, -1.15);
    for (int i = 0; i < 4; ++i)
        mesh_add_block(m, bench, 0, 0.45, -0.18 + 0.12 * i, 1.5, 0.03, 0.1);
    for (int i = 0; i < 3; ++i)
        mesh_add_block(m, mesh_turned_x(mesh_moved(bench, 0, 0.58 + 0.12 * i, -0.28), -12), 0, 0, 0, 1.5, 0.1, 0.025);
    for (int i = -1; i <= 1; i += 2) {
        mesh_add_block(m, bench, 0.65 * i, 0.22, 0.14, 0.05, 0.44, 0.05);
        mesh_add_block(m, bench, 0.65 * i, 0.42, -0.22, 0.05, 0.84, 0.05);
    }
    mesh_add_rod(m, f, v3(1.75, 0, -1.1), v3(1.75, 0.8, -1.1), 0.2, 0.23, 40);
    mesh_add_rod(m, f, v3(1.12, 0, 1.0), v3(1.12, 4, 1.0), 0.045, 0.04, 24);
    mesh_add_rod(m, f, v3(1.12, 0, 1.0), v3(1.12, 0.3, 1.0), 0.09, 0.07, 24);
    bench_scene_look_at(s, v3(0.15, 1.5, 4.1), v3(0.05, 1.02, -0.6), 1.05, width, height);
    s->radius = 1;
    return true;
}

static void add_nut(mesh *m, mesh_frame f, double size, double thickness) {
    /* a hexagonal prism with chamfered rims around a threaded hole */
    enum { SIDES = 48 };
    double hole = size * 0.5;
    double levels[6][2] = {{hole, 0},         {0.93, 0},        {1, 0.07}, {1, thickness - 0.07},
                           {0.93, thickness}, {hole, thickness}};
    unsigned ring[6];
    for (int i = 0; i < 6; ++i) {
        ring[i] = (unsigned)m->vertex_count;
        for (int k = 0; k < SIDES; ++k) {
            double a = 2 * V3_PI * k / SIDES, wedge = fmod(a, V3_PI / 3) - V3_PI / 6;
            double r = i == 0 || i == 5
                           ? hole
                           : fmin(size * levels[i][0] / cos(wedge), size * 1.09 * (i == 1 || i == 4 ? 0.93 : 1.06));
            mesh_add_vertex(m, &f, v3(r * cos(a), levels[i][1] * 1.0, r * sin(a)));
        }
    }
    for (int i = 0; i < 5; ++i)
        for (unsigned k = 0; k < SIDES; ++k)
            mesh_add_quad(m, ring[i] + k, ring[i + 1] + k, ring[i + 1] + (k + 1) % SIDES, ring[i] + (k + 1) % SIDES);
    for (int i = 0; i < 6; ++i)
        mesh_add_ring(m, mesh_moved(f, 0, thickness * (i + 0.5) / 6, 0), hole, thickness / 14, 40, 6);
}

static void add_bolt(mesh *m, mesh_frame f, double length) {
    enum { TURNS = 26 };
    double p[2 * TURNS + 4][2];
    int n = 0;
    p[n][0] = 0, p[n++][1] = 0;
    p[n][0] = 0.36, p[n++][1] = 0;
    for (int i = 0; i < TURNS; ++i) {
        double y = 0.05 + length * 0.7 * i / TURNS;
        p[n][0] = 0.42, p[n++][1] = y;
        p[n][0] = 0.5, p[n++][1] = y + length * 0.35 / TURNS;
    }
    p[n][0] = 0.47, p[n++][1] = length * 0.72;
    p[n][0] = 0.47, p[n++][1] = length;
    mesh_add_revolved(m, f, (const double(*)[2])p, n, 48);
    add_nut(m, mesh_moved(f, 0, length, 0), 0.85, 0.6);
    static const double cap[][2] = {{0, 0}, {0.5, 0}};
    mesh_add_revolved(m, mesh_moved(f, 0, length + 0.55, 0), cap, 2, 32);
}

static double scratch_height(double x, double z, const void *context) {
    (void)context;
    return 0.02 * fbm(v3(0.8 * x, 0, 9 * z), 4) + 0.03 * fbm(v3(0.7 * x, 3, 0.7 * z), 2);
}

/* Macro view (units: millimetres, seen from 12): bolts, nuts, washers, a gear and a spring; the radius spans hundreds of
 * pixels. */
static bool build_near(bench_scene *s, int width, int height) {
    mesh *m = &s->mesh;
    mesh_frame f = mesh_world;
    add_relief(m, f, -25, -30, 25, 15, 300, 500, scratch_height, NULL);
    add_bolt(m, mesh_turned_x(mesh_turned_y(mesh_moved(f, -3.6, 0.62, 1.2), 72), 88), 5);
    add_bolt(m, mesh_turned_z(mesh_moved(f, 2.6, 0.05, -1.4), -6), 3.4);
    add_bolt(m, mesh_turned_x(mesh_turned_y(mesh_moved(f, -0.4, 0.7, -3.2), 20), 96), 5.5);
    add_nut(m, mesh_turned_y(mesh_moved(f, 0.4, 0.03, 1.5), 10), 1.0, 0.8);
    add_nut(m, mesh_turned_x(mesh_turned_y(mesh_moved(f, 1.45, 0.55, 2.5), 40), 38), 0.85, 0.65);
    add_nut(m, mesh_turned_y(mesh_moved(f, 0.2, 0.85, 1.4), 31), 0.85, 0.65);
    add_nut(m, mesh_turned_y(mesh_moved(f, -2.4, 0.03, -1.7), 4), 1.25, 1.0);
    for (int i = 0; i < 4; ++i) {
        static const double washer[][2] = {{0.5, 0},     {1.05, 0},   {1.1, 0.03}, {1.1, 0.11},
                                           {1.05, 0.14}, {0.5, 0.14}, {0.5, 0}};
        mesh_frame w = mesh_moved(f, -1.6 + 0.33 * i, 0.04 + 0.13 * i, 2.6 - 0.15 * i);
        mesh_add_revolved(m, mesh_turned_z(w, 4 * i), washer, 7, 64);
    }
    /* gear */
    mesh_frame gear = mesh_turned_x(mesh_turned_y(mesh_moved(f, -3.2, 1.9, -4.2), 25), 62);
    static const double body[][2] = {{0.6, -0.4}, {1.1, -0.4}, {1.1, -0.2}, {2.1, -0.2}, {2.1, -0.4},
                                     {2.5, -0.4}, {2.5, 0.4},  {2.1, 0.4},  {2.1, 0.2},  {1.1, 0.2},
                                     {1.1, 0.4},  {0.6, 0.4},  {0.6, -0.4}};
    mesh_add_revolved(m, gear, body, 13, 96);
    for (int i = 0; i < 22; ++i) {
        mesh_frame tooth = mesh_turned_y(gear, 360.0 / 22 * i);
        mesh_add_box(m, tooth, 2.4, -0.4, -0.17, 3.0, 0.4, 0.17);
    }
    /* spring */
    vec3 a = v3(0, 0, 0);
    for (int i = 0; i <= 220; ++i) {
        double t = 2 * V3_PI * i / 24.0;
        vec3 b = v3(0.7 * cos(t), 0.014 * i, 0.7 * sin(t));
        if (i)
            mesh_add_capsule(m, mesh_turned_x(mesh_turned_y(mesh_moved(f, 3.6, 0.85, 2.3), -38), -84), a, b, 0.09, 0.09,
                             10);
        a = b;
    }
    bench_scene_look_at(s, v3(1.2, 5.6, 8.6), v3(-0.2, 0.1, -0.4), 1.25, width, height);
    s->radius = 2.5;
    return true;
}

/* A town of blocks, towers and trees from 900 m away; the radius (25 m) spans a dozen pixels. */
static bool build_far(bench_scene *s, int width, int height) {
    mesh *m = &s->mesh;
    mesh_frame f = mesh_world;
    uint32_t seed = 2024;
    mesh_add_box(m, f, -3000, -30, -5000, 3000, 0, 1500);
    for (int j = -14; j < 10; ++j)
        for (int i = -14; i < 14; ++i) {
            double bx = 70.0 * i, bz = 90.0 * j, core = exp(-(bx * bx + bz * bz) / (380.0 * 380.0));
            mesh_frame block = mesh_turned_y(mesh_moved(f, bx, 0, bz), 6 * fbm(v3(0.1 * i, 0, 0.1 * j), 2));
            double kind = random_in(&seed, 0, 1);
            mesh_add_box(m, block, -29, 0, -38, 29, 0.5, 38); /* pavement */
            if (kind < 0.1) {                                 /* park */
                for (int k = 0; k < 24; ++k) {
                    double x = random_in(&seed, -25, 25), z = random_in(&seed, -34, 34), r = random_in(&seed, 2.5, 5);
                    mesh_add_rod(m, block, v3(x, 0, z), v3(x, r, z), 0.5, 0.4, 6);
                    mesh_add_ellipsoid(m, block, v3(x, r * 1.9, z), r, r * 1.2, r, 10);
                }
                continue;
            }
            for (int b = 0; b < 6; ++b) {
                double cx = (b & 1 ? 14.0 : -14.0), cz = -25.0 + 25.0 * (b >> 1);
                double w = random_in(&seed, 18, 26), d = random_in(&seed, 16, 23), h = random_in(&seed, 8, 22);
                if (random_in(&seed, 0, 1) < 0.5 * core)
                    h += random_in(&seed, 20, 130) * core;
                mesh_add_block(m, block, cx, h / 2, cz, w, h, d);
                if (h > 40) { /* stepped tower */
                    mesh_add_block(m, block, cx, h + 6, cz, w * 0.7, 12, d * 0.7);
                    mesh_add_block(m, block, cx, h + 16, cz, w * 0.4, 10, d * 0.4);
                } else if (random_in(&seed, 0, 1) < 0.45) { /* gabled roof */
                    unsigned v[6];
                    for (int k = 0; k < 4; ++k)
                        v[k] = mesh_add_vertex(m, &block,
                                               v3(cx + (k & 1 ? w : -w) * 0.52, h, cz + (k & 2 ? d : -d) * 0.52));
                    v[4] = mesh_add_vertex(m, &block, v3(cx - w * 0.52, h + 0.4 * d, cz));
                    v[5] = mesh_add_vertex(m, &block, v3(cx + w * 0.52, h + 0.4 * d, cz));
                    mesh_add_quad(m, v[0], v[1], v[5], v[4]);
                    mesh_add_quad(m, v[3], v[2], v[4], v[5]);
                    mesh_add_triangle(m, v[0], v[4], v[2]);
                    mesh_add_triangle(m, v[1], v[3], v[5]);
                } else { /* parapet and plant room */
                    mesh_add_box(m, block, cx - w / 2, h, cz - d / 2, cx + w / 2, h + 1.2, cz - d / 2 + 0.6);
                    mesh_add_box(m, block, cx - w / 2, h, cz + d / 2 - 0.6, cx + w / 2, h + 1.2, cz + d / 2);
                    mesh_add_block(m, block, cx + random_in(&seed, -3, 3), h + 1.5, cz, w * 0.35, 3, d * 0.35);
                }
            }
        }
    bench_scene_look_at(s, v3(420, 520, 980), v3(-20, 0, -40), 1.5, width, height);
    s->radius = 25;
    return true;
}

/* ---- table ------------------------------------------------------------------------------------------------------- */

static const struct {
    const char *name, *title;
    bool (*build)(bench_scene *s, int width, int height);
} scenes[] = {
    {"terrain", "open terrain", build_terrain},          {"stairs", "interior with corners and stairs", build_stairs},
    {"columns", "columns and arches", build_columns},    {"foliage", "foliage", build_foliage},
    {"grilles", "grilles and wires", build_grilles},     {"scan", "organic scan", build_scan},
    {"furniture", "furniture clutter", build_furniture}, {"figure", "a character in front of a wall", build_figure},
    {"near", "very near: small parts", build_near},      {"far", "very far: a town", build_far},
};

int bench_scene_count(void) {
    return (int)(sizeof scenes / sizeof *scenes);
}

const char *bench_scene_name(int index) {
    return scenes[index].name;
}

bool bench_scene_build(bench_scene *out, int index, int width, int height) {
    memset(out, 0, sizeof *out);
    out->name = scenes[index].name;
    out->title = scenes[index].title;
    return scenes[index].build(out, width, height);
}

/* Flat ground to the horizon and some houses under half a sky: what most of an outdoor frame is. */
static bool build_village(bench_scene *s, int width, int height) {
    mesh *m = &s->mesh;
    uint32_t seed = 5;
    mesh_add_box(m, mesh_world, -2000, -1, -4000, 2000, 0, 100);
    for (int k = 0; k < 9; ++k) {
        double w = random_in(&seed, 7, 11), h = random_in(&seed, 3, 6), x = (k % 2 ? 1 : -1) * random_in(&seed, 12, 45);
        mesh_frame f = mesh_turned_y(mesh_moved(mesh_world, x, 0, -30 - 14.0 * k), random_in(&seed, -20, 20));
        unsigned v[6];
        mesh_add_box(m, f, -w / 2, 0, -4, w / 2, h, 4);
        for (int i = 0; i < 4; ++i)
            v[i] = mesh_add_vertex(m, &f, v3((i & 1 ? w : -w) * 0.55, h, i & 2 ? 4.6 : -4.6));
        v[4] = mesh_add_vertex(m, &f, v3(-w * 0.55, h + 3, 0));
        v[5] = mesh_add_vertex(m, &f, v3(w * 0.55, h + 3, 0));
        mesh_add_quad(m, v[0], v[1], v[5], v[4]);
        mesh_add_quad(m, v[3], v[2], v[4], v[5]);
        mesh_add_triangle(m, v[0], v[4], v[2]);
        mesh_add_triangle(m, v[1], v[3], v[5]);
    }
    bench_scene_look_at(s, v3(0, 1.7, 0), v3(0, 1.7, -50), 0.85, width, height);
    s->radius = 2;
    return true;
}

bool bench_study_build(bench_scene *out, const char *name, int width, int height) {
    memset(out, 0, sizeof *out);
    if (strcmp(name, "village") == 0) {
        out->name = "village", out->title = "houses on flat ground";
        return build_village(out, width, height);
    }
    bool bar = strcmp(name, "bar") == 0;
    if (!bar && strcmp(name, "elephant") != 0)
        return false;
    out->name = bar ? "bar" : "elephant";
    out->title = bar ? "a thin bar in front of a wall" : "an animal in front of a wall";
    mesh *m = &out->mesh;
    mesh_add_box(m, mesh_world, -8, -8, -0.3, 8, 8, 0);
    if (bar)
        mesh_add_box(m, mesh_world, -0.05, -8, 0.4, 0.05, 8, 0.5);
    else
        add_implicit(m, mesh_turned_y(mesh_moved(mesh_world, 0, -1, 1.0), 62), beast_distance, NULL,
                     v3(-0.75, -0.05, -1.05), v3(0.75, 1.9, 1.9), 0.02);
    bench_scene_look_at(out, v3(0, 0.1, 6), v3(0, 0, 0), 1.1, width, height);
    out->radius = 2;
    return true;
}

void bench_scene_free(bench_scene *s) {
    mesh_free(&s->mesh);
    memset(s, 0, sizeof *s);
}

int bench_scene_chosen(int index, int count, char *const *names) {
    int k = 0;
    while (k < count && strcmp(names[k], bench_scene_name(index)) != 0)
        ++k;
    return count == 0 || k < count;
}

int bench_scenes_exist(const char *program, int count, char *const *names) {
    for (int k = 0; k < count; ++k) {
        int i = 0;
        while (i < bench_scene_count() && strcmp(names[k], bench_scene_name(i)) != 0)
            ++i;
        if (i == bench_scene_count()) {
            fprintf(stderr, "%s: %s: no such scene or option\n", program, names[k]);
            return 0;
        }
    }
    return 1;
}
