/* court.c - see court.h */
#include "court.h"

#include <string.h>

typedef struct palette {
    unsigned char plaster, stone, slab, dark_slab, marble, wood, terracotta, glaze, cloth, leaf, brass, red;
} palette;

static palette add_materials(mesh *m) {
    palette p;
    p.plaster = mesh_add_material(m, 0.74f, 0.64f, 0.50f);
    p.stone = mesh_add_material(m, 0.58f, 0.53f, 0.46f);
    p.slab = mesh_add_material(m, 0.56f, 0.50f, 0.42f);
    p.dark_slab = mesh_add_material(m, 0.42f, 0.37f, 0.31f);
    p.marble = mesh_add_material(m, 0.80f, 0.77f, 0.72f);
    p.wood = mesh_add_material(m, 0.36f, 0.20f, 0.10f);
    p.terracotta = mesh_add_material(m, 0.62f, 0.27f, 0.14f);
    p.glaze = mesh_add_material(m, 0.08f, 0.26f, 0.38f);
    p.cloth = mesh_add_material(m, 0.74f, 0.70f, 0.62f);
    p.leaf = mesh_add_material(m, 0.16f, 0.34f, 0.08f);
    p.brass = mesh_add_material(m, 0.80f, 0.56f, 0.20f);
    p.red = mesh_add_material(m, 0.70f, 0.10f, 0.06f);
    return p;
}

/* Slabs with joints between them, every third one darker. */
static void add_floor(mesh *m, const palette *p) {
    m->material = p->stone;
    mesh_add_box(m, mesh_world, -6.4, -0.5, -5.4, 6.4, -0.03, 5.4);
    for (int j = 0; j < 9; ++j)
        for (int i = 0; i < 11; ++i) {
            double x = -6.05 + 1.1 * i, z = -4.95 + 1.1 * j;
            m->material = (i + 2 * j) % 3 ? p->slab : p->dark_slab;
            mesh_add_box(m, mesh_world, x, -0.2, z, x + 1.08, 0, z + 1.08);
        }
}

static void add_column(mesh *m, double x, double z, double h) {
    double profile[][2] = {{0, 0.14},        {0.25, 0.14},     {0.27, 0.18},      {0.25, 0.22},     {0.205, 0.25},
                           {0.2, 0.3},       {0.195, h * 0.5}, {0.165, h - 0.34}, {0.19, h - 0.32}, {0.19, h - 0.29},
                           {0.17, h - 0.27}, {0.19, h - 0.2},  {0.26, h - 0.12},  {0, h - 0.12}};
    mesh_lathe l = {(const double(*)[2])profile, 14, 64, 16, 0.09, 5, 7};
    mesh_frame f = mesh_moved(mesh_world, x, 0, z);
    mesh_add_lathe(m, f, &l);
    mesh_add_block(m, f, 0, 0.07, 0, 0.58, 0.14, 0.58);
    mesh_add_block(m, f, 0, h - 0.06, 0, 0.56, 0.12, 0.56);
}

/* A wall along x from x0 to x1 of thickness `deep` behind z, with round-arched niches at `centers`. */
static void add_niche_wall(mesh *m, mesh_frame f, double x0, double x1, double top, double deep, const double *centers,
                           int count) {
    enum { ARC = 24 };
    const double r = 0.55, sill = 0.7, spring = 1.75;
    double x = x0;
    for (int i = 0; i < count; ++i) {
        double c = centers[i];
        mesh_add_box(m, f, x, 0, -deep, c - r, top, 0);
        mesh_add_box(m, f, c - r, 0, -deep, c + r, sill, 0);
        mesh_add_box(m, f, c - r, sill, -deep, c + r, top, -0.5 * deep); /* its back */
        for (int k = 0; k < ARC; ++k) {                                  /* the wall over the arch, in strips */
            double a0 = V3_PI * k / ARC, a1 = V3_PI * (k + 1) / ARC;
            double xa = c - r * cos(a0), xb = c - r * cos(a1), ya = spring + r * sin(a0), yb = spring + r * sin(a1);
            unsigned v[6];
            v[0] = mesh_add_vertex(m, &f, v3(xa, ya, 0)), v[1] = mesh_add_vertex(m, &f, v3(xb, yb, 0));
            v[2] = mesh_add_vertex(m, &f, v3(xb, top, 0)), v[3] = mesh_add_vertex(m, &f, v3(xa, top, 0));
            v[4] = mesh_add_vertex(m, &f, v3(xb, yb, -0.5 * deep)),
            v[5] = mesh_add_vertex(m, &f, v3(xa, ya, -0.5 * deep));
            mesh_add_quad(m, v[0], v[1], v[2], v[3]);
            mesh_add_quad(m, v[1], v[0], v[5], v[4]);
        }
        x = c + r;
    }
    mesh_add_box(m, f, x, 0, -deep, x1, top, 0);
}

static void add_urn(mesh *m, mesh_frame f, double s) {
    double p[][2] = {{0, 0},       {0.16, 0},    {0.17, 0.03}, {0.09, 0.08}, {0.08, 0.12}, {0.16, 0.2},
                     {0.24, 0.34}, {0.26, 0.46}, {0.22, 0.58}, {0.14, 0.66}, {0.13, 0.7},  {0.19, 0.75},
                     {0.19, 0.77}, {0.11, 0.72}, {0.12, 0.64}, {0.18, 0.5},  {0, 0.4}};
    mesh_add_revolved(m, mesh_scaled(f, s, s, s), (const double(*)[2])p, 17, 48);
}

static void add_portico(mesh *m, const palette *p) {
    static const double niches[] = {-4.05, -1.35, 1.35, 4.05};
    m->material = p->plaster;
    add_niche_wall(m, mesh_moved(mesh_world, 0, 0, -5), -6.3, 6.3, 3.9, 0.7, niches, 4);
    m->material = p->stone;
    mesh_add_box(m, mesh_world, -5.4, 0, -5, 5.4, 0.16, -2.75);
    mesh_add_box(m, mesh_world, -5.4, 0, -2.75, 5.4, 0.08, -2.45);
    m->material = p->marble;
    for (int i = 0; i < 5; ++i)
        add_column(m, -5.0 + 2.5 * i, -3.1, 3.0);
    mesh_add_box(m, mesh_world, -5.35, 3.0, -3.36, 5.35, 3.28, -2.84);
    mesh_add_box(m, mesh_world, -5.4, 3.28, -3.42, 5.4, 3.36, -2.78);
    m->material = p->terracotta; /* a tiled roof */
    for (int i = 0; i < 48; ++i) {
        double x = -5.4 + 10.8 / 47 * i;
        mesh_add_rod(m, mesh_world, v3(x, 3.42, -2.6), v3(x, 3.98, -5.0), 0.11, 0.11, 12);
    }
    m->material = p->wood;
    for (int i = 0; i < 13; ++i) {
        double x = -5.1 + 0.85 * i;
        mesh_add_box(m, mesh_world, x, 3.2, -5.0, x + 0.12, 3.36, -3.3);
    }
    m->material = p->terracotta;
    add_urn(m, mesh_moved(mesh_world, -1.35, 0.7, -5.12), 1.0);
    m->material = p->glaze;
    add_urn(m, mesh_moved(mesh_world, 1.35, 0.7, -5.12), 1.1);
    m->material = p->marble;
    mesh_add_ellipsoid(m, mesh_moved(mesh_world, 4.05, 1.0, -5.12), v3(0, 0, 0), 0.2, 0.3, 0.2, 32);
    mesh_add_block(m, mesh_world, 4.05, 0.76, -5.14, 0.3, 0.12, 0.26);
}

static void add_walls(mesh *m, const palette *p) {
    m->material = p->plaster;
    mesh_add_box(m, mesh_world, -6.6, -0.5, -5.7, -6.0, 3.0, 5.0);
    mesh_add_box(m, mesh_world, 6.0, -0.5, -5.7, 6.6, 3.0, 1.2);
    m->material = p->stone;
    mesh_add_box(m, mesh_world, -6.7, 3.0, -5.7, -5.9, 3.14, 5.1);
    mesh_add_box(m, mesh_world, 5.9, 3.0, -5.7, 6.7, 3.14, 1.3);
    mesh_add_box(m, mesh_world, -6.0, 0, -5.0, -5.93, 0.5, 5.0); /* skirting */
    mesh_add_box(m, mesh_world, 5.93, 0, -5.0, 6.0, 0.5, 1.2);
    for (int i = 0; i < 5; ++i) { /* steps up to a door in the right wall */
        double h = 0.18 * (5 - i);
        mesh_add_box(m, mesh_world, 6.0 - 0.9 - 0.32 * i - 0.32, 0, -1.9, 6.0 - 0.9 - 0.32 * i, h - 0.03, -0.3);
        mesh_add_box(m, mesh_world, 6.0 - 0.9 - 0.32 * i - 0.36, h - 0.03, -1.93, 6.0 - 0.9 - 0.32 * i, h, -0.27);
    }
    mesh_add_box(m, mesh_world, 5.1, 0, -1.9, 6.0, 0.9, -0.3);
    m->material = p->wood;
    mesh_add_box(m, mesh_world, 5.96, 0.9, -1.6, 6.02, 2.7, -0.6);
    for (int i = 0; i < 4; ++i)
        mesh_add_box(m, mesh_world, 5.92, 0.98 + 0.43 * i, -1.52, 6.0, 1.32 + 0.43 * i, -0.68);
    m->material = p->marble;
    mesh_add_box(m, mesh_world, 5.88, 0.9, -1.75, 6.02, 2.85, -1.6);
    mesh_add_box(m, mesh_world, 5.88, 0.9, -0.6, 6.02, 2.85, -0.45);
    mesh_add_box(m, mesh_world, 5.86, 2.7, -1.8, 6.02, 2.88, -0.4);
}

/* A pot with leaves that arch over. */
static void add_plant(mesh *m, const palette *p, double x, double z, double size) {
    static const double pot[][2] = {{0, 0},      {0.2, 0},    {0.28, 0.42}, {0.32, 0.43},
                                    {0.32, 0.5}, {0.27, 0.5}, {0.25, 0.42}, {0, 0.42}};
    mesh_frame f = mesh_scaled(mesh_moved(mesh_world, x, 0, z), size, size, size);
    m->material = p->terracotta;
    mesh_add_revolved(m, f, pot, 8, 40);
    m->material = p->leaf;
    for (int i = 0; i < 46; ++i) {
        enum { N = 8 };
        double turn = 137.5 * i, rise = 0.25 + 0.55 * (i % 9) / 8.0, length = 0.75 + 0.35 * (i % 5) / 4.0;
        mesh_frame leaf = mesh_turned_y(mesh_moved(f, 0, 0.42, 0), turn);
        unsigned row[3] = {0, 0, 0};
        for (int k = 0; k <= N; ++k) {
            double t = (double)k / N, half = 0.065 * sin(V3_PI * (0.12 + 0.88 * t));
            double out = 0.05 + length * t * (0.55 + 0.2 * t),
                   up = length * (1.7 * rise * t - (0.4 + rise) * t * t) + 0.45 * t;
            unsigned next[3];
            for (int c = 0; c < 3; ++c)
                next[c] = mesh_add_vertex(m, &leaf, v3(half * (c - 1), up + 0.35 * half * (c != 1), out));
            if (k)
                for (int c = 0; c < 2; ++c)
                    mesh_add_quad(m, row[c], row[c + 1], next[c + 1], next[c]);
            memcpy(row, next, sizeof row);
        }
    }
}

static void add_table(mesh *m, const palette *p) {
    mesh_frame f = mesh_turned_y(mesh_moved(mesh_world, 0.2, 0, 0.2), 12);
    m->material = p->wood;
    for (int i = 0; i < 5; ++i)
        mesh_add_box(m, f, -1.2, 0.72, -0.6 + 0.244 * i, 1.2, 0.78, -0.6 + 0.244 * i + 0.236);
    mesh_add_box(m, f, -1.05, 0.6, -0.5, 1.05, 0.72, -0.46);
    mesh_add_box(m, f, -1.05, 0.6, 0.46, 1.05, 0.72, 0.5);
    for (int i = 0; i < 4; ++i)
        mesh_add_rod(m, f, v3(i & 1 ? 1.0 : -1.0, 0, i & 2 ? 0.45 : -0.45),
                     v3(i & 1 ? 1.0 : -1.0, 0.72, i & 2 ? 0.45 : -0.45), 0.04, 0.06, 20);
    m->material = p->glaze;
    add_urn(m, mesh_moved(f, -0.75, 0.78, -0.1), 0.75);
    static const double bowl[][2] = {{0, 0},        {0.1, 0},      {0.11, 0.02}, {0.2, 0.07}, {0.29, 0.17},
                                     {0.275, 0.17}, {0.19, 0.085}, {0.09, 0.04}, {0, 0.035}};
    mesh_frame b = mesh_moved(f, 0.15, 0.78, 0.1);
    m->material = p->marble;
    mesh_add_revolved(m, b, bowl, 9, 48);
    m->material = p->brass;
    mesh_add_ellipsoid(m, b, v3(0.06, 0.13, 0.04), 0.085, 0.08, 0.085, 28);
    m->material = p->red;
    mesh_add_ellipsoid(m, b, v3(-0.1, 0.125, 0.03), 0.075, 0.072, 0.075, 28);
    m->material = p->leaf;
    mesh_add_ellipsoid(m, b, v3(0.0, 0.125, -0.11), 0.075, 0.075, 0.075, 28);
    for (int i = 0; i < 3; ++i) { /* books */
        unsigned char cover[] = {p->red, p->glaze, p->wood};
        mesh_frame k = mesh_turned_y(mesh_moved(f, 0.8, 0.78 + 0.062 * i, -0.12), 14.0 * i - 10);
        m->material = cover[i];
        mesh_add_block(m, k, 0, 0.004, 0, 0.36, 0.008, 0.26);
        mesh_add_block(m, k, 0, 0.056, 0, 0.36, 0.008, 0.26);
        mesh_add_block(m, k, 0, 0.03, -0.126, 0.36, 0.06, 0.008);
        m->material = p->cloth;
        mesh_add_block(m, k, 0, 0.03, 0.004, 0.345, 0.046, 0.245);
    }
    for (int side = -1; side <= 1; side += 2) { /* a bench on either side */
        m->material = p->wood;
        mesh_add_box(m, f, -1.1, 0.42, side * 1.05 - 0.17, 1.1, 0.47, side * 1.05 + 0.17);
        mesh_add_box(m, f, -0.95, 0, side * 1.05 - 0.13, -0.88, 0.42, side * 1.05 + 0.13);
        mesh_add_box(m, f, 0.88, 0, side * 1.05 - 0.13, 0.95, 0.42, side * 1.05 + 0.13);
        mesh_add_box(m, f, -0.88, 0.2, side * 1.05 - 0.02, 0.88, 0.26, side * 1.05 + 0.02);
    }
}

static void add_things(mesh *m, const palette *p) {
    add_plant(m, p, -5.2, 1.2, 1.1);
    add_plant(m, p, 5.25, 0.55, 0.95);
    add_plant(m, p, -5.1, -1.6, 0.8);
    m->material = p->wood; /* crates */
    for (int i = 0; i < 3; ++i) {
        static const double at[3][5] = {
            {-3.9, 0, -1.55, 0.75, 12}, {-3.25, 0, -0.85, 0.55, -20}, {-3.85, 0.75, -1.6, 0.45, 35}};
        mesh_frame f = mesh_turned_y(mesh_moved(mesh_world, at[i][0], at[i][1], at[i][2]), at[i][4]);
        double s = at[i][3];
        mesh_add_block(m, f, 0, 0.5 * s, 0, s - 0.04, s - 0.02, s - 0.04);
        for (int k = 0; k < 4; ++k) {
            double cx = (k & 1 ? 1 : -1) * (0.5 * s - 0.03), cz = (k & 2 ? 1 : -1) * (0.5 * s - 0.03);
            mesh_add_block(m, f, cx, 0.5 * s, cz, 0.06, s, 0.06);
        }
        for (int k = 0; k < 2; ++k) {
            double y = k ? s - 0.04 : 0.04;
            mesh_add_block(m, f, 0, y, 0, s, 0.08, s);
        }
    }
    m->material = p->marble; /* a fallen drum and stone balls */
    static const double drum[][2] = {{0, 0}, {0.3, 0}, {0.3, 0.7}, {0, 0.7}};
    mesh_lathe l = {drum, 4, 64, 16, 0.1, 1, 2};
    mesh_add_lathe(m, mesh_turned_x(mesh_turned_y(mesh_moved(mesh_world, 2.8, 0.28, 1.5), 35), 90), &l);
    mesh_add_ellipsoid(m, mesh_world, v3(3.5, 0.32, 0.2), 0.32, 0.32, 0.32, 48);
    mesh_add_ellipsoid(m, mesh_world, v3(3.98, 0.2, 0.72), 0.2, 0.2, 0.2, 40);
    m->material = p->brass;
    mesh_add_ring(m, mesh_turned_x(mesh_turned_y(mesh_moved(mesh_world, -2.7, 0.46, 1.9), 25), 78), 0.4, 0.075, 64, 24);
    mesh_add_ellipsoid(m, mesh_world, v3(-2.62, 0.24, 1.45), 0.24, 0.24, 0.24, 40);
}

void court_build(mesh *out) {
    memset(out, 0, sizeof *out);
    palette p = add_materials(out);
    add_floor(out, &p);
    add_portico(out, &p);
    add_walls(out, &p);
    add_table(out, &p);
    add_things(out, &p);
    out->part = COURT_HOOP;
    out->material = p.brass;
    mesh_add_ring(out, mesh_world, 0.55, 0.06, 72, 24);
    mesh_add_ring(out, mesh_turned_x(mesh_world, 90), 0.46, 0.03, 72, 16);
    out->part = COURT_BALL;
    out->material = p.red;
    mesh_add_ellipsoid(out, mesh_world, v3(0, 0, 0), 0.3, 0.3, 0.3, 48);
    mesh_smooth(out, 38);
}

/* Around the table in twelve seconds, low enough to darken the floor. */
mesh_frame court_part(int part, double seconds) {
    double a = 2 * V3_PI * seconds / 12.0;
    mesh_frame f = mesh_moved(mesh_world, 0.2 + 2.35 * cos(a), 0.85 + 0.25 * sin(3 * a), 0.3 + 1.75 * sin(a));
    if (part == COURT_FIXED)
        return mesh_world;
    if (part == COURT_BALL)
        return mesh_turned_y(f, -90 * seconds);
    return mesh_turned_x(mesh_turned_y(f, 75 * seconds), 60 + 40 * seconds);
}
