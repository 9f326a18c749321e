/* Voxel cone-traced ambient occlusion [TP16] on the meshes: opacity in a clipmap of nested cubes ahead of the camera,
 * each twice as large and twice as coarse as the one before; cones accumulate opacity front to back.
 *
 * Triangles are rasterised along their dominant axis into 2 x 2 x 2 binary cells per cube; where a finer level exists, a
 * cube's opacity is the mean of the eight finer ones. The finest cube side is a fixed part of the radius. */
#include "rivals.h"

#include <stdlib.h>
#include <string.h>

enum { MOST_LEVELS = 8 };

struct voxel_grid {
    int resolution, levels;
    float size;                          /* of the finest cubes */
    v3f corner[MOST_LEVELS];             /* least corner of each level, view space */
    unsigned char *opacity[MOST_LEVELS]; /* 255: opaque */
};

/* Marks the binary cells that the triangle p (in cells) touches, seen along axis `a`. */
static void rasterise(unsigned char *cells, int n, float p[3][3]) {
    float e1[3], e2[3], normal[3];
    for (int k = 0; k < 3; ++k)
        e1[k] = p[1][k] - p[0][k], e2[k] = p[2][k] - p[0][k];
    for (int k = 0; k < 3; ++k)
        normal[k] = e1[(k + 1) % 3] * e2[(k + 2) % 3] - e1[(k + 2) % 3] * e2[(k + 1) % 3];
    int a = fabsf(normal[0]) > fabsf(normal[1]) ? 0 : 1;
    a = fabsf(normal[2]) > fabsf(normal[a]) ? 2 : a;
    if (!(fabsf(normal[a]) > 0))
        return;
    int u = (a + 1) % 3, w = (a + 2) % 3;
    float lo[3], hi[3];
    for (int k = 0; k < 3; ++k) {
        lo[k] = fminf(p[0][k], fminf(p[1][k], p[2][k])), hi[k] = fmaxf(p[0][k], fmaxf(p[1][k], p[2][k]));
        if (hi[k] < 0 || lo[k] >= (float)n)
            return;
    }
    /* edge functions, inside >= 0, widened by half a cell (conservative) */
    float ex[3], ey[3], ec[3], turn = normal[a] > 0 ? 1.0f : -1.0f;
    for (int k = 0; k < 3; ++k) {
        const float *q = p[k], *r = p[(k + 1) % 3];
        ex[k] = -(r[w] - q[w]) * turn, ey[k] = (r[u] - q[u]) * turn;
        ec[k] = -(ex[k] * q[u] + ey[k] * q[w]) + 0.5f * (fabsf(ex[k]) + fabsf(ey[k]));
    }
    float du = -normal[u] / normal[a], dw = -normal[w] / normal[a], half = 0.5f * (fabsf(du) + fabsf(dw));
    int u0 = clampi((int)floorf(fmaxf(lo[u], 0)), 0, n - 1), u1 = clampi((int)floorf(fminf(hi[u], (float)n)), 0, n - 1);
    int w0 = clampi((int)floorf(fmaxf(lo[w], 0)), 0, n - 1), w1 = clampi((int)floorf(fminf(hi[w], (float)n)), 0, n - 1);
    size_t stride[3] = {1, (size_t)n, (size_t)n * (size_t)n};
    for (int j = w0; j <= w1; ++j)
        for (int i = u0; i <= u1; ++i) {
            float cu = (float)i + 0.5f, cw = (float)j + 0.5f;
            if (ex[0] * cu + ey[0] * cw + ec[0] < 0 || ex[1] * cu + ey[1] * cw + ec[1] < 0 ||
                ex[2] * cu + ey[2] * cw + ec[2] < 0)
                continue;
            float at = p[0][a] + du * (cu - p[0][u]) + dw * (cw - p[0][w]);
            int from = (int)floorf(fmaxf(at - half, lo[a])), to = (int)floorf(fminf(at + half, hi[a]));
            for (int k = from < 0 ? 0 : from; k <= to && k < n; ++k)
                cells[(size_t)i * stride[u] + (size_t)j * stride[w] + (size_t)k * stride[a]] = 1;
        }
}

/* The part of level l that level l - 1 covers: the mean of its cubes. */
static void average_finer(voxel_grid *g, int l) {
    size_t n = (size_t)g->resolution, quarter = n / 4;
    for (size_t z = 0; z < n / 2; ++z)
        for (size_t y = 0; y < n / 2; ++y)
            for (size_t x = 0; x < n / 2; ++x) {
                const unsigned char *c = g->opacity[l - 1] + (2 * z * n + 2 * y) * n + 2 * x, *d = c + n * n;
                unsigned sum = 0u + c[0] + c[1] + c[n] + c[n + 1] + d[0] + d[1] + d[n] + d[n + 1];
                g->opacity[l][(z * n + y + quarter) * n + x + quarter] = (unsigned char)((sum + 4) / 8);
            }
}

voxel_grid *voxel_open(const bench_scene *s, const view *v, int resolution) {
    voxel_grid *g = calloc(1, sizeof *g);
    int n = 2 * resolution;
    size_t cells = (size_t)n * (size_t)n * (size_t)n, cubes = cells / 8;
    unsigned char *binary = malloc(cells);
    float *points = malloc(s->mesh.vertex_count * 3 * sizeof *points);
    float nearest = VIEW_SKY, farthest = 0;
    if (!g || !binary || !points)
        goto failed;
    for (size_t i = 0; i < view_pixels(v); ++i)
        if (v->z[i] < VIEW_SKY) {
            nearest = fminf(nearest, v->z[i]);
            farthest = fmaxf(farthest, v->z[i]);
        }
    g->resolution = resolution;
    g->size = v->radius / 16;
    for (size_t i = 0; i < s->mesh.vertex_count; ++i) {
        const float *p = s->mesh.positions + 3 * i;
        vec3 d = v3_sub(v3((double)p[0], (double)p[1], (double)p[2]), s->camera.eye);
        points[3 * i] = (float)v3_dot(d, s->camera.right);
        points[3 * i + 1] = (float)v3_dot(d, s->camera.down);
        points[3 * i + 2] = (float)v3_dot(d, s->camera.forward);
    }
    for (int l = 0; l < MOST_LEVELS; ++l) {
        float side = g->size * (float)(1 << l), extent = side * (float)resolution, inverse = 2 / side;
        v3f corner = {-0.5f * extent, -0.5f * extent, nearest - v->radius};
        memset(binary, 0, cells);
        for (size_t t = 0; t < s->mesh.triangle_count; ++t) {
            float p[3][3];
            for (int k = 0; k < 3; ++k) {
                const float *q = points + 3 * s->mesh.indices[3 * t + (size_t)k];
                p[k][0] = (q[0] - corner.x) * inverse, p[k][1] = (q[1] - corner.y) * inverse,
                p[k][2] = (q[2] - corner.z) * inverse;
            }
            rasterise(binary, n, p);
        }
        unsigned char *out = malloc(cubes);
        if (!out)
            goto failed;
        g->opacity[l] = out;
        g->corner[l] = corner;
        g->levels = l + 1;
        for (int z = 0; z < resolution; ++z)
            for (int y = 0; y < resolution; ++y)
                for (int x = 0; x < resolution; ++x) {
                    const unsigned char *c =
                        binary + ((size_t)(2 * z) * (size_t)n + (size_t)(2 * y)) * (size_t)n + (size_t)(2 * x);
                    const unsigned char *d = c + (size_t)n * (size_t)n;
                    int filled = c[0] + c[1] + c[n] + c[n + 1] + d[0] + d[1] + d[n] + d[n + 1];
                    /* a sheet through the cube fills half of its cells and is opaque */
                    *out++ = (unsigned char)(filled >= 4 ? 255 : filled * 64);
                }
        if (l > 0)
            average_finer(g, l);
        if (corner.z + extent > farthest + v->radius && l > 3)
            break;
    }
    free(points);
    free(binary);
    return g;
failed:
    free(points);
    free(binary);
    voxel_close(g);
    return NULL;
}

void voxel_close(voxel_grid *g) {
    if (!g)
        return;
    for (int l = 0; l < MOST_LEVELS; ++l)
        free(g->opacity[l]);
    free(g);
}

double voxel_size(const voxel_grid *g) {
    return (double)g->size;
}

/* Finest level that holds p with a margin of one cube. */
static int finest_level(const voxel_grid *g, v3f p) {
    int l = 0;
    for (; l < g->levels - 1; ++l) {
        float side = g->size * (float)(1 << l), last = side * (float)(g->resolution - 1);
        v3f q = v3f_sub(p, g->corner[l]);
        if (q.x > side && q.y > side && q.z > side && q.x < last && q.y < last && q.z < last)
            break;
    }
    return l;
}

/* Trilinear opacity in one level, 0 outside. */
static float opacity_at(const voxel_grid *g, int l, v3f p) {
    float inverse = 1 / (g->size * (float)(1 << l));
    v3f q = v3f_scale(v3f_sub(p, g->corner[l]), inverse);
    float fx = q.x - 0.5f, fy = q.y - 0.5f, fz = q.z - 0.5f;
    int n = g->resolution, x = (int)floorf(fx), y = (int)floorf(fy), z = (int)floorf(fz);
    if (x < 0 || y < 0 || z < 0 || x + 1 >= n || y + 1 >= n || z + 1 >= n)
        return 0;
    fx -= (float)x, fy -= (float)y, fz -= (float)z;
    const unsigned char *c = g->opacity[l] + ((size_t)z * (size_t)n + (size_t)y) * (size_t)n + (size_t)x;
    float row[4];
    for (int k = 0; k < 4; ++k) {
        const unsigned char *d = c + ((size_t)(k >> 1) * (size_t)n + (size_t)(k & 1)) * (size_t)n;
        row[k] = (float)d[0] + ((float)d[1] - (float)d[0]) * fx;
    }
    float near_z = row[0] + (row[1] - row[0]) * fy, far_z = row[2] + (row[3] - row[2]) * fy;
    return (near_z + (far_z - near_z) * fz) * (1.0f / 255);
}

/* What passes through a cone of the given slope (diameter per length) from p up to the distance reach. */
static float trace_cone(const voxel_grid *g, v3f p, v3f d, float start, float slope, float reach) {
    float t = start, clear = 1;
    while (t < reach && clear > 0.02f) {
        v3f q = v3f_mad(p, d, t);
        int finest = finest_level(g, q);
        float diameter = fmaxf(slope * t, g->size * (float)(1 << finest));
        float level = log2f(diameter / g->size);
        int l = clampi((int)level, finest, g->levels - 1), m = l + 1 < g->levels ? l + 1 : l;
        float blend = clampf(level - (float)l, 0, 1), a = opacity_at(g, l, q);
        a += (opacity_at(g, m, q) - a) * blend;
        /* steps of half a diameter: opacity for half the length */
        clear *= sqrtf(1 - clampf(a, 0, 1));
        t += 0.5f * diameter;
    }
    return clear;
}

void voxel_visibility(const voxel_grid *g, const view *v, int cones, float *visibility) {
    enum { MOST = 16 };
    v3f direction[MOST];
    float weight[MOST], slope;
    if (cones < MOST) {
        /* the customary six of 60 degrees: one along the normal, five at 60 degrees from it */
        cones = 6;
        slope = 2 * tanf(0.52359878f);
        direction[0] = (v3f){0, 0, 1}, weight[0] = 0.25f;
        for (int k = 1; k < 6; ++k) {
            float a = 1.25663706f * (float)k;
            direction[k] = (v3f){0.8660254f * cosf(a), 0.8660254f * sinf(a), 0.5f}, weight[k] = 0.15f;
        }
    } else {
        cones = MOST;
        slope = 2 * tanf(0.31415927f);
        for (int k = 0; k < MOST; ++k) {
            float u = ((float)k + 0.5f) / MOST, a = 2.39996323f * (float)k;
            direction[k] = (v3f){sqrtf(u) * cosf(a), sqrtf(u) * sinf(a), sqrtf(1 - u)}, weight[k] = 1.0f / MOST;
        }
    }
    for (int y = 0; y < v->height; ++y)
        for (int x = 0; x < v->width; ++x) {
            size_t i = rival_index(v, x, y);
            visibility[i] = 1;
            if (!(v->z[i] < VIEW_SKY))
                continue;
            v3f p = rival_point(v, x, y, v->z[i]), n = rival_normal(v, i), up = {1, 0, 0};
            if (fabsf(n.x) > 0.6f)
                up = (v3f){0, 1, 0};
            v3f a = v3f_normalize(v3f_cross(up, n)), b = v3f_cross(n, a);
            /* clear of the surface's own cubes */
            float side = g->size * (float)(1 << finest_level(g, p)), sum = 0;
            v3f from = v3f_mad(p, n, 1.0f * side);
            for (int k = 0; k < cones; ++k) {
                v3f d = v3f_mad(v3f_mad(v3f_scale(n, direction[k].z), a, direction[k].x), b, direction[k].y);
                sum += weight[k] * trace_cone(g, from, d, side, slope, v->radius);
            }
            visibility[i] = sum;
        }
}
