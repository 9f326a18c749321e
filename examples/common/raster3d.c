/* raster3d.c - see raster3d.h
 *
 * Homogeneous rasterisation (Olano and Greer, Triangle scan conversion using 2D homogeneous coordinates, 1997): with
 * the corners A, B, C of a triangle as the columns of a matrix, the point P = z r that the ray r of a pixel meets has
 * barycentric coordinates b = z inv([A B C]) r. So b_k / z is an affine function of the pixel, its sign tells on which
 * side of an edge the pixel lies, and the sum of the three is 1 / z: no vertex is projected, and a triangle that
 * reaches behind the eye needs no clipping. Its rows are (B x C, C x A, A x B) / det. Two triangles on an edge get the
 * cross product of the same two points with opposite signs, bit for bit, so that a pixel belongs to exactly one. */
#include "raster3d.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { BAND = 16 }; /* rows that one thread draws at a time */

typedef struct bounds {
    uint16_t x0, x1, y0, y1; /* pixels that the triangle may cover, the upper ends excluded; empty: culled */
} bounds;

struct raster {
    const mesh *m;
    raster_view view;
    raster_buffers out;
    raster_pose to_view[MESH_PARTS], to_view_before[MESH_PARTS];
    vec3 *now, *before; /* the vertices in view space */
    bounds *boxes;
    uint32_t *band_first, *band_triangles; /* the triangles of each band of rows, in the order of the mesh */
    size_t band_capacity;
    double *nearness; /* 1 / z of each pixel, 0: nothing */
    uint32_t *triangle;
};

/* ---- poses -------------------------------------------------------------------------------------------------------- */

raster_pose raster_identity(void) {
    return (raster_pose){{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
}

raster_pose raster_look_at(vec3 eye, vec3 target) {
    vec3 forward = v3_normalize(v3_sub(target, eye));
    vec3 right = v3_normalize(v3_cross(forward, v3(0, 1, 0)));
    vec3 down = v3_cross(forward, right);
    return (raster_pose){{right.x, right.y, right.z, -v3_dot(right, eye), down.x, down.y, down.z, -v3_dot(down, eye),
                          forward.x, forward.y, forward.z, -v3_dot(forward, eye)}};
}

raster_pose raster_of_frame(const mesh_frame *f) {
    return (raster_pose){
        {f->x.x, f->y.x, f->z.x, f->o.x, f->x.y, f->y.y, f->z.y, f->o.y, f->x.z, f->y.z, f->z.z, f->o.z}};
}

raster_pose raster_compose(const raster_pose *a, const raster_pose *b) {
    raster_pose c;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 4; ++j)
            c.m[4 * i + j] = a->m[4 * i] * b->m[j] + a->m[4 * i + 1] * b->m[4 + j] + a->m[4 * i + 2] * b->m[8 + j] +
                             (j == 3 ? a->m[4 * i + 3] : 0.0);
    return c;
}

raster_pose raster_inverse(const raster_pose *p) {
    raster_pose q;
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j)
            q.m[4 * i + j] = p->m[4 * j + i];
        q.m[4 * i + 3] = -(p->m[i] * p->m[3] + p->m[4 + i] * p->m[7] + p->m[8 + i] * p->m[11]);
    }
    return q;
}

static vec3 rotate(const raster_pose *p, vec3 v) {
    const double *m = p->m;
    return v3(m[0] * v.x + m[1] * v.y + m[2] * v.z, m[4] * v.x + m[5] * v.y + m[6] * v.z,
              m[8] * v.x + m[9] * v.y + m[10] * v.z);
}

static vec3 transform(const raster_pose *p, vec3 v) {
    return v3_add(rotate(p, v), v3(p->m[3], p->m[7], p->m[11]));
}

raster_view raster_view_of(int width, int height, double fov_y_degrees, double near_z) {
    raster_view v;
    v.width = width;
    v.height = height;
    v.focal_px = 0.5 * height / tan(0.5 * fov_y_degrees * V3_PI / 180);
    v.cx = 0.5 * width;
    v.cy = 0.5 * height;
    v.near_z = near_z;
    v.world_to_view = raster_identity();
    for (int i = 0; i < MESH_PARTS; ++i)
        v.part_to_world[i] = raster_identity();
    raster_view_advance(&v);
    return v;
}

void raster_view_advance(raster_view *view) {
    view->world_to_view_before = view->world_to_view;
    memcpy(view->part_to_world_before, view->part_to_world, sizeof view->part_to_world);
}

/* ---- memory ------------------------------------------------------------------------------------------------------- */

raster *raster_create(const mesh *m, int width, int height) {
    raster *r = calloc(1, sizeof *r);
    if (!r)
        return NULL;
    size_t pixels = (size_t)width * (size_t)height;
    r->m = m;
    r->view.width = width;
    r->view.height = height;
    r->now = malloc((m->vertex_count + 1) * sizeof *r->now);
    r->before = malloc((m->vertex_count + 1) * sizeof *r->before);
    r->boxes = malloc((m->triangle_count + 1) * sizeof *r->boxes);
    r->band_first = malloc(((size_t)height / BAND + 3) * sizeof *r->band_first);
    r->nearness = malloc(pixels * sizeof *r->nearness);
    r->triangle = malloc(pixels * sizeof *r->triangle);
    if (r->now && r->before && r->boxes && r->band_first && r->nearness && r->triangle)
        return r;
    raster_free(r);
    return NULL;
}

void raster_free(raster *r) {
    if (!r)
        return;
    free(r->now);
    free(r->before);
    free(r->boxes);
    free(r->band_first);
    free(r->band_triangles);
    free(r->nearness);
    free(r->triangle);
    free(r);
}

/* ---- vertices and bounds ------------------------------------------------------------------------------------------ */

enum { CHUNK = 1024 }; /* vertices or triangles handed to a thread at a time */

static void transform_chunks(void *user, int thread, int begin, int end) {
    raster *r = user;
    (void)thread;
    size_t last = (size_t)end * CHUNK < r->m->vertex_count ? (size_t)end * CHUNK : r->m->vertex_count;
    for (size_t v = (size_t)begin * CHUNK; v < last; ++v) {
        const float *f = r->m->positions + 3 * v;
        vec3 p = v3((double)f[0], (double)f[1], (double)f[2]);
        r->now[v] = transform(r->to_view + r->m->parts[v], p);
        r->before[v] = transform(r->to_view_before + r->m->parts[v], p);
    }
}

typedef struct box2 {
    double x0, x1, y0, y1;
} box2;

static void add_projected(const raster_view *v, vec3 p, box2 *box) {
    double x = v->cx + v->focal_px * p.x / p.z, y = v->cy + v->focal_px * p.y / p.z;
    box->x0 = x < box->x0 ? x : box->x0;
    box->x1 = x > box->x1 ? x : box->x1;
    box->y0 = y < box->y0 ? y : box->y0;
    box->y1 = y > box->y1 ? y : box->y1;
}

/* Of the part of the triangle beyond the near plane. */
static bounds bounds_of(const raster_view *v, const vec3 corner[3]) {
    const double slack = 1e-3; /* pixels; whether a centre is inside is decided exactly later */
    box2 box = {HUGE_VAL, -HUGE_VAL, HUGE_VAL, -HUGE_VAL};
    for (int i = 0; i < 3; ++i) {
        vec3 a = corner[i], b = corner[(i + 1) % 3];
        double da = a.z - v->near_z, db = b.z - v->near_z;
        if (da >= 0)
            add_projected(v, a, &box);
        if ((da >= 0) != (db >= 0)) {
            vec3 p = v3_mad(a, v3_sub(b, a), da / (da - db));
            p.z = v->near_z;
            add_projected(v, p, &box);
        }
    }
    box.x0 = fmax(ceil(box.x0 - 0.5 - slack), 0), box.x1 = fmin(floor(box.x1 - 0.5 + slack) + 1, v->width);
    box.y0 = fmax(ceil(box.y0 - 0.5 - slack), 0), box.y1 = fmin(floor(box.y1 - 0.5 + slack) + 1, v->height);
    if (!(box.x0 < box.x1 && box.y0 < box.y1))
        return (bounds){0, 0, 0, 0};
    return (bounds){(uint16_t)box.x0, (uint16_t)box.x1, (uint16_t)box.y0, (uint16_t)box.y1};
}

static void bound_chunks(void *user, int thread, int begin, int end) {
    raster *r = user;
    (void)thread;
    size_t last = (size_t)end * CHUNK < r->m->triangle_count ? (size_t)end * CHUNK : r->m->triangle_count;
    for (size_t t = (size_t)begin * CHUNK; t < last; ++t) {
        const unsigned *index = r->m->indices + 3 * t;
        vec3 corner[3] = {r->now[index[0]], r->now[index[1]], r->now[index[2]]};
        r->boxes[t] = bounds_of(&r->view, corner);
    }
}

/* Lists of triangles by band of rows: counted, then filled. False if there is no memory. */
static int sort_into_bands(raster *r) {
    int bands = (r->view.height + BAND - 1) / BAND;
    uint32_t *first = r->band_first;
    memset(first, 0, ((size_t)bands + 2) * sizeof *first);
    for (size_t t = 0; t < r->m->triangle_count; ++t)
        for (int b = r->boxes[t].y0 / BAND; b * BAND < r->boxes[t].y1; ++b)
            ++first[b + 2];
    for (int b = 2; b < bands + 2; ++b)
        first[b] += first[b - 1];
    if (first[bands + 1] > r->band_capacity) {
        r->band_capacity = (size_t)first[bands + 1] * 3 / 2;
        free(r->band_triangles);
        r->band_triangles = malloc(r->band_capacity * sizeof *r->band_triangles);
        if (!r->band_triangles) {
            r->band_capacity = 0;
            return 0;
        }
    }
    for (size_t t = 0; t < r->m->triangle_count; ++t)
        for (int b = r->boxes[t].y0 / BAND; b * BAND < r->boxes[t].y1; ++b)
            r->band_triangles[first[b + 1]++] = (uint32_t)t;
    return 1;
}

/* ---- edges -------------------------------------------------------------------------------------------------------- */

/* dx x + dy y + c at the centre of pixel (x, y). */
typedef struct edge {
    double dx, dy, c;
} edge;

/* A plane through the eye with normal n, as a function of the pixel: n.r. */
static edge edge_of(const raster_view *v, vec3 n) {
    edge e;
    e.dx = n.x / v->focal_px;
    e.dy = n.y / v->focal_px;
    e.c = n.z - e.dx * (v->cx - 0.5) - e.dy * (v->cy - 0.5);
    return e;
}

static double edge_at(const edge *e, int x, int y) {
    return (e->dy * y + e->c) + e->dx * x;
}

/* b_k / z times |det|, so positive inside; *scale = 1 / |det|. False for a triangle seen edge-on. */
static int edges_of(const raster *r, uint32_t t, edge e[3], double *scale) {
    const unsigned *index = r->m->indices + 3 * (size_t)t;
    vec3 a = r->now[index[0]], b = r->now[index[1]], c = r->now[index[2]];
    vec3 n[3] = {v3_cross(b, c), v3_cross(c, a), v3_cross(a, b)};
    double det = v3_dot(a, n[0]);
    if (!(fabs(det) > 0))
        return 0;
    for (int k = 0; k < 3; ++k)
        e[k] = edge_of(&r->view, det < 0 ? v3_scale(n[k], -1) : n[k]);
    *scale = 1 / fabs(det);
    return 1;
}

/* A pixel on an edge belongs to the triangle on its right, or below it. */
static int inside(const edge *e, double value) {
    return value > 0 || (!(value < 0) && (e->dx > 0 || (!(e->dx < 0) && e->dy > 0)));
}

/* Shrinks [*first, *last) of row y to the pixels inside. The value is monotonous in x, rounding included, so they are
 * one interval whose end is near the root; near enough is inverse_dx = 1 / e->dx. */
static void clip_row(const edge *e, double inverse_dx, int y, int *first, int *last) {
    int lo = *first, hi = *last;
    if (!(fabs(e->dx) > 0)) {
        if (!inside(e, edge_at(e, lo, y)))
            *last = lo;
        return;
    }
    double root = -(e->dy * y + e->c) * inverse_dx;
    int x = root > lo ? root < hi ? (int)root : hi : lo;
    int rising = e->dx > 0;
    while (x > lo && inside(e, edge_at(e, x - 1, y)) == rising)
        --x;
    while (x < hi && inside(e, edge_at(e, x, y)) != rising)
        ++x;
    if (rising)
        *first = x;
    else
        *last = x;
}

static void draw_triangle(raster *r, uint32_t t, int row_begin, int row_end) {
    const raster_view *v = &r->view;
    const unsigned *index = r->m->indices + 3 * (size_t)t;
    bounds box = r->boxes[t];
    edge e[3];
    double scale;
    if (!edges_of(r, t, e, &scale))
        return;
    edge w = {(e[0].dx + e[1].dx + e[2].dx) * scale, (e[0].dy + e[1].dy + e[2].dy) * scale,
              (e[0].c + e[1].c + e[2].c) * scale}; /* 1 / z */
    edge clip = {-w.dx, -w.dy, 1 / v->near_z - w.c};
    int reaches_eye = 0;
    for (int k = 0; k < 3; ++k)
        reaches_eye |= r->now[index[k]].z < v->near_z;
    double inverse_dx[3] = {1 / e[0].dx, 1 / e[1].dx, 1 / e[2].dx};
    int y0 = box.y0 > row_begin ? box.y0 : row_begin, y1 = box.y1 < row_end ? box.y1 : row_end;
    for (int y = y0; y < y1; ++y) {
        int first = box.x0, last = box.x1;
        for (int k = 0; k < 3 && first < last; ++k)
            clip_row(e + k, inverse_dx[k], y, &first, &last);
        if (reaches_eye && first < last)
            clip_row(&clip, 1 / clip.dx, y, &first, &last);
        double *nearness = r->nearness + (size_t)y * (size_t)v->width;
        uint32_t *triangle = r->triangle + (size_t)y * (size_t)v->width;
        for (int x = first; x < last; ++x) {
            double here = edge_at(&w, x, y);
            if (here > nearness[x]) {
                nearness[x] = here;
                triangle[x] = t;
            }
        }
    }
}

static void draw_bands(void *user, int thread, int begin, int end) {
    raster *r = user;
    (void)thread;
    for (int b = begin; b < end; ++b) {
        int y0 = b * BAND, y1 = y0 + BAND < r->view.height ? y0 + BAND : r->view.height;
        size_t from = (size_t)y0 * (size_t)r->view.width;
        memset(r->nearness + from, 0, (size_t)(y1 - y0) * (size_t)r->view.width * sizeof *r->nearness);
        for (uint32_t i = r->band_first[b]; i < r->band_first[b + 1]; ++i)
            draw_triangle(r, r->band_triangles[i], y0, y1);
    }
}

int raster_draw(raster *r, const raster_view *view, pool *workers) {
    r->view = *view;
    for (int i = 0; i < MESH_PARTS; ++i) {
        r->to_view[i] = raster_compose(&view->world_to_view, view->part_to_world + i);
        r->to_view_before[i] = raster_compose(&view->world_to_view_before, view->part_to_world_before + i);
    }
    pool_run(workers, (int)((r->m->vertex_count + CHUNK - 1) / CHUNK), 1, transform_chunks, NULL, r);
    pool_run(workers, (int)((r->m->triangle_count + CHUNK - 1) / CHUNK), 1, bound_chunks, NULL, r);
    if (!sort_into_bands(r))
        return 0;
    pool_run(workers, (view->height + BAND - 1) / BAND, 1, draw_bands, NULL, r);
    return 1;
}

/* ---- attributes --------------------------------------------------------------------------------------------------- */

/* What the pixels of one triangle share. */
typedef struct surface {
    edge e[3];
    double scale;
    vec3 normal[3]; /* view space, towards the eye */
    vec3 then[3];   /* corners in the previous frame's view space minus those in this one's */
    const float *albedo;
} surface;

static void set_surface(const raster *r, uint32_t t, surface *s) {
    const mesh *m = r->m;
    const unsigned *index = m->indices + 3 * (size_t)t;
    vec3 corner[3];
    edges_of(r, t, s->e, &s->scale);
    for (int k = 0; k < 3; ++k) {
        const float *n = m->normals + 9 * (size_t)t + 3 * k;
        corner[k] = r->now[index[k]];
        s->normal[k] = rotate(r->to_view + m->parts[index[k]], v3((double)n[0], (double)n[1], (double)n[2]));
        s->then[k] = v3_sub(r->before[index[k]], corner[k]);
    }
    /* Turn the normals to the side of the face that is seen; the winding need not tell. */
    vec3 face = v3_cross(v3_sub(corner[1], corner[0]), v3_sub(corner[2], corner[0]));
    if (v3_dot(face, corner[0]) > 0)
        face = v3_scale(face, -1);
    for (int k = 0; k < 3; ++k)
        if (v3_dot(s->normal[k], face) < 0)
            s->normal[k] = v3_scale(s->normal[k], -1);
    s->albedo = m->albedo[m->materials[t]];
}

static vec3 mix3(const vec3 v[3], const double b[3]) {
    return v3_mad(v3_mad(v3_scale(v[0], b[0]), v[1], b[1]), v[2], b[2]);
}

/* Of a point on ray (rx, ry, 1) that moved by `d` to depth then_z, backwards in time. */
static void put_motion(const raster *r, size_t i, double rx, double ry, vec3 d, double then_z, double dz) {
    double scale = r->view.focal_px / then_z;
    float *motion = r->out.motion + 3 * i;
    motion[0] = then_z > 0 ? (float)((d.x - rx * d.z) * scale) : HUGE_VALF;
    motion[1] = then_z > 0 ? (float)((d.y - ry * d.z) * scale) : HUGE_VALF;
    motion[2] = (float)dz;
}

static void shade_rows(void *user, int thread, int begin, int end) {
    raster *r = user;
    const raster_view *v = &r->view;
    const raster_buffers *out = &r->out;
    surface s;
    uint32_t current = UINT32_MAX;
    (void)thread;
    /* The sky moves with the camera's rotation only. */
    raster_pose back = raster_inverse(&v->world_to_view), turn = raster_compose(&v->world_to_view_before, &back);
    if (memcmp(&v->world_to_view, &v->world_to_view_before, sizeof back) == 0)
        turn = raster_identity(); /* to the last bit: at rest means that */
    for (int y = begin; y < end; ++y)
        for (int x = 0; x < v->width; ++x) {
            size_t i = (size_t)y * (size_t)v->width + (size_t)x;
            double rx = (x + 0.5 - v->cx) / v->focal_px, ry = (y + 0.5 - v->cy) / v->focal_px;
            vec3 normal = {0, 0, 0};
            const float *albedo = NULL;
            if (r->nearness[i] > 0) {
                if (r->triangle[i] != current) {
                    current = r->triangle[i];
                    set_surface(r, current, &s);
                }
                double z = 1 / r->nearness[i], b[3];
                for (int k = 0; k < 3; ++k)
                    b[k] = edge_at(s.e + k, x, y) * s.scale * z;
                normal = mix3(s.normal, b);
                normal = v3_scale(normal, 1 / sqrt(v3_dot(normal, normal)));
                albedo = s.albedo;
                out->depth[i] = (float)z;
                if (out->motion) {
                    vec3 d = mix3(s.then, b);
                    put_motion(r, i, rx, ry, d, z + d.z, d.z);
                }
            } else {
                vec3 ray = {rx, ry, 1}, then = rotate(&turn, ray);
                out->depth[i] = HUGE_VALF;
                if (out->motion)
                    put_motion(r, i, rx, ry, v3_sub(then, ray), then.z, 0);
            }
            if (out->normals) {
                out->normals[3 * i] = (float)normal.x;
                out->normals[3 * i + 1] = (float)normal.y;
                out->normals[3 * i + 2] = (float)normal.z;
            }
            if (out->albedo)
                for (int k = 0; k < 3; ++k)
                    out->albedo[3 * i + (size_t)k] = albedo ? albedo[k] : 0.0f;
        }
}

void raster_shade(raster *r, const raster_buffers *out, pool *workers) {
    r->out = *out;
    pool_run(workers, r->view.height, 0, shade_rows, NULL, r);
}
