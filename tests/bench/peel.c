#include "peel.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "trace.h"

/* ---- pieces ------------------------------------------------------------------------------------------------------ */

typedef struct corner {
    vec3 p;
    unsigned index;
} corner;

typedef struct edge {
    unsigned a, b;
} edge;

static int compare_corners(const void *a, const void *b) {
    const vec3 *p = &((const corner *)a)->p, *q = &((const corner *)b)->p;
    return (p->x > q->x) - (p->x < q->x);
}

static int compare_edges(const void *a, const void *b) {
    const edge *p = a, *q = b;
    return p->a != q->a ? (p->a > q->a) - (p->a < q->a) : (p->b > q->b) - (p->b < q->b);
}

static unsigned root_of(unsigned *parent, unsigned i) {
    while (parent[i] != i)
        i = parent[i] = parent[parent[i]];
    return i;
}

typedef struct pieces {
    unsigned *of;             /* piece of each triangle */
    unsigned *edges, *border; /* of each piece: its edges, and those that an odd number of triangles share */
} pieces;

static bool is_solid(const pieces *p, unsigned piece) {
    return p->border[piece] * 20u < p->edges[piece];
}

static void pieces_free(pieces *p) {
    free(p->of);
    free(p->edges);
    free(p->border);
}

/* Corners at one place become one: parent[] is a forest over the vertices. */
static bool weld(const mesh *m, unsigned *parent) {
    corner *c = malloc(m->vertex_count * sizeof *c);
    if (!c)
        return false;
    vec3 lo = v3(1e30, 1e30, 1e30), hi = v3(-1e30, -1e30, -1e30);
    for (size_t i = 0; i < m->vertex_count; ++i) {
        const float *p = m->positions + 3 * i;
        c[i] = (corner){v3((double)p[0], (double)p[1], (double)p[2]), (unsigned)i};
        lo = v3(fmin(lo.x, c[i].p.x), fmin(lo.y, c[i].p.y), fmin(lo.z, c[i].p.z));
        hi = v3(fmax(hi.x, c[i].p.x), fmax(hi.y, c[i].p.y), fmax(hi.z, c[i].p.z));
        parent[i] = (unsigned)i;
    }
    qsort(c, m->vertex_count, sizeof *c, compare_corners);
    for (size_t i = 0; i < m->vertex_count; ++i) {
        /* vertices are floats: within their rounding, and some */
        double tolerance = 4e-7 * (fabs(c[i].p.x) + fabs(c[i].p.y) + fabs(c[i].p.z)) + 1e-9;
        for (size_t j = i + 1; j < m->vertex_count && c[j].p.x - c[i].p.x <= tolerance; ++j)
            if (fabs(c[j].p.y - c[i].p.y) <= tolerance && fabs(c[j].p.z - c[i].p.z) <= tolerance)
                parent[root_of(parent, c[j].index)] = root_of(parent, c[i].index);
    }
    free(c);
    return true;
}

static bool find_pieces(const mesh *m, pieces *out, peel *p) {
    size_t n = m->vertex_count, t = m->triangle_count, edges = 0;
    unsigned *place = malloc(n * sizeof *place), *piece = malloc(n * sizeof *piece);
    edge *e = malloc(3 * t * sizeof *e);
    out->of = malloc(t * sizeof *out->of);
    out->edges = calloc(n, sizeof *out->edges);
    out->border = calloc(n, sizeof *out->border);
    bool ok = place && piece && e && out->of && out->edges && out->border && weld(m, place);
    for (size_t i = 0; ok && i < n; ++i)
        piece[i] = (unsigned)i;
    for (size_t i = 0; ok && i < t; ++i) {
        unsigned v[3];
        for (size_t k = 0; k < 3; ++k)
            v[k] = root_of(place, m->indices[3 * i + k]);
        out->of[i] = v[0];
        if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0])
            continue; /* no area, no edges */
        for (int k = 0; k < 3; ++k) {
            unsigned a = v[k], b = v[(k + 1) % 3];
            piece[root_of(piece, a)] = root_of(piece, b);
            e[edges++] = a < b ? (edge){a, b} : (edge){b, a};
        }
    }
    if (ok) {
        qsort(e, edges, sizeof *e, compare_edges);
        for (size_t i = 0, j; i < edges; i = j) {
            for (j = i; j < edges && compare_edges(&e[i], &e[j]) == 0;)
                ++j;
            ++out->edges[root_of(piece, e[i].a)];
            out->border[root_of(piece, e[i].a)] += (j - i) % 2;
        }
        for (size_t i = 0; i < t; ++i)
            out->of[i] = root_of(piece, out->of[i]);
        for (unsigned i = 0; i < n; ++i)
            if (out->edges[i])
                p->pieces += 1, p->solids += is_solid(out, i);
    }
    free(place);
    free(piece);
    free(e);
    if (!ok)
        fprintf(stderr, "peel: out of memory\n");
    return ok;
}

/* ---- layers ------------------------------------------------------------------------------------------------------ */

enum { MOST_HITS = 128 };

typedef struct span {
    float front, back;
    unsigned triangle; /* of the front */
} span;

/* Solids and sheets along a ray, in order of their fronts. */
static int spans_of(const pieces *p, const trace_hit *hits, int count, span *spans) {
    bool used[MOST_HITS] = {false};
    int n = 0;
    for (int i = 0; i < count; ++i) {
        if (used[i])
            continue;
        unsigned piece = p->of[hits[i].triangle];
        int j = i;
        if (is_solid(p, piece))
            for (j = i + 1; j < count && p->of[hits[j].triangle] != piece;)
                ++j;
        if (j == count)
            j = i; /* grazed, or the exit is beyond the hits that were kept */
        used[j] = true;
        spans[n++] = (span){hits[i].distance, hits[j].distance, hits[i].triangle};
    }
    return n;
}

typedef struct work {
    peel *p;
    const bench_scene *scene;
    const trace *t;
    const pieces *pieces;
    double *deeper; /* by row */
} work;

/* Gradient of 1/z per pixel on a triangle's plane: n . P = c for all its points P = r / w, so w = n . r / c. */
static void slope_of(const bench_scene *s, unsigned triangle, float slope[2]) {
    vec3 p[3];
    for (size_t k = 0; k < 3; ++k) {
        const float *v = s->mesh.positions + 3 * (size_t)s->mesh.indices[3 * (size_t)triangle + k];
        vec3 d = v3_sub(v3((double)v[0], (double)v[1], (double)v[2]), s->camera.eye);
        p[k] = v3(v3_dot(d, s->camera.right), v3_dot(d, s->camera.down), v3_dot(d, s->camera.forward));
    }
    vec3 n = v3_cross(v3_sub(p[1], p[0]), v3_sub(p[2], p[0]));
    double c = v3_dot(n, p[0]) * s->camera.focal_px;
    slope[0] = fabs(c) > 0 ? (float)(n.x / c) : 0;
    slope[1] = fabs(c) > 0 ? (float)(n.y / c) : 0;
}

static void peel_rows(void *user, int thread, int row_begin, int row_end) {
    const work *w = user;
    const bench_scene_camera *c = &w->scene->camera;
    trace_hit hits[MOST_HITS];
    span spans[MOST_HITS];
    (void)thread;
    for (int y = row_begin; y < row_end; ++y) {
        w->deeper[y] = 0;
        for (int x = 0; x < c->width; ++x) {
            size_t i = (size_t)y * (size_t)c->width + (size_t)x;
            vec3 d = v3((x + 0.5 - c->cx) / c->focal_px, (y + 0.5 - c->cy) / c->focal_px, 1);
            int n = spans_of(w->pieces, hits, trace_hits(w->t, v3(0, 0, 0), d, hits, MOST_HITS), spans);
            int layer = -1;
            for (int k = 0; k < w->p->count; ++k) {
                w->p->front[k][i] = w->p->back[k][i] = VIEW_SKY;
                w->p->slope[k][2 * i] = w->p->slope[k][2 * i + 1] = 0;
            }
            float end = 0;
            for (int k = 0; k < n; ++k) {
                if (layer < 0 || spans[k].front > end) {
                    if (++layer == w->p->count) {
                        w->deeper[y] += 1;
                        break;
                    }
                    w->p->front[layer][i] = spans[k].front;
                    slope_of(w->scene, spans[k].triangle, w->p->slope[layer] + 2 * i);
                    end = spans[k].back;
                }
                end = fmaxf(end, spans[k].back);
                w->p->back[layer][i] = end;
            }
        }
    }
}

bool peel_open(peel *p, const bench_scene *s, int layers, pool *threads) {
    size_t n = (size_t)s->camera.width * (size_t)s->camera.height;
    pieces found = {NULL, NULL, NULL};
    memset(p, 0, sizeof *p);
    p->count = layers;
    bool ok = find_pieces(&s->mesh, &found, p);
    double *deeper = calloc((size_t)s->camera.height, sizeof *deeper);
    for (int k = 0; k < layers; ++k) {
        p->front[k] = malloc(n * sizeof(float));
        p->back[k] = malloc(n * sizeof(float));
        p->slope[k] = malloc(2 * n * sizeof(float));
        ok = ok && p->front[k] && p->back[k] && p->slope[k];
    }
    trace *t = ok && deeper ? trace_open_hits(s) : NULL;
    if (t) {
        work w = {p, s, t, &found, deeper};
        pool_run(threads, s->camera.height, 0, peel_rows, NULL, &w);
        for (int y = 0; y < s->camera.height; ++y)
            p->deeper += deeper[y] / (double)n;
    } else {
        peel_close(p);
    }
    trace_close(t);
    free(deeper);
    pieces_free(&found);
    return t != NULL;
}

void peel_close(peel *p) {
    for (int k = 0; k < PEEL_MOST; ++k) {
        free(p->front[k]);
        free(p->back[k]);
        free(p->slope[k]);
    }
    memset(p, 0, sizeof *p);
}
