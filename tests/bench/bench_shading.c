/* bench_shading - specular occlusion of scenes against ray tracing, and of random cones against integration.
 *
 *     build/bench_shading [--size WIDTHxHEIGHT] [--rays N] [--cones N] [--threads N] [DIRECTORY]
 *
 * Prints tables for docs/specular.md, each after a line "## NAME", and writes DIRECTORY/spheres.png and scan.png
 * (build/bench/specular): the same view with each method, lit by a white dome and by a probe with a lamp.
 *
 * The methods take visibility and bent normals either from rays without a limit or from gtao.h on the depth buffer, its
 * radius being that of the scene. Truth: GGX with height-correlated Smith and Schlick's Fresnel, N x N rays a pixel by
 * the density of visible normals, through Embree. It shares no code with gtso.h. */
#include <embree3/rtcore.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "examples/common/canvas.h"
#include "examples/common/pool.h"
#include "examples/common/volume.h"
#include "gtso.h"
#include "tests/compute.h"

#include "dataset.h"
#include "sampling.h"
#include "scenes.h"

enum { PACKET = 8, MOST_SPHERES = 16 };

static const double reflectance = 0.9; /* a grey metal: shows occlusion where a dielectric would hardly reflect */

/* ---- scene -------------------------------------------------------------------------------------------------------- */

typedef struct ball {
    vec3 center;
    double radius, roughness;
} ball;

typedef struct stage {
    const char *name;
    bench_scene scene; /* triangles and camera */
    float *smooth;     /* normal of each vertex, view space */
    ball balls[MOST_SPHERES];
    int ball_count;
    double roughness; /* of the triangles */
    RTCDevice device;
    RTCScene rays; /* view space */
} stage;

static vec3 to_view(const bench_scene_camera *c, vec3 d) {
    return v3(v3_dot(d, c->right), v3_dot(d, c->down), v3_dot(d, c->forward));
}

static vec3 to_world(const bench_scene_camera *c, vec3 d) {
    return v3_mad(v3_mad(v3_scale(c->right, d.x), c->down, d.y), c->forward, d.z);
}

static void *allocate(size_t bytes) {
    void *p = calloc(1, bytes ? bytes : 1);
    if (!p) {
        fprintf(stderr, "bench_shading: not enough memory\n");
        exit(1);
    }
    return p;
}

/* Balls of growing roughness in niches of a wall: each is open on one side. Smaller balls lie between them. */
static bool build_spheres(stage *s, int width, int height) {
    mesh *m = &s->scene.mesh;
    s->name = "spheres";
    s->roughness = 0.4;
    mesh_add_box(m, mesh_world, -8, -0.2, -1.2, 8, 0, 8);
    mesh_add_box(m, mesh_world, -8, 0, -1.3, 8, 1.5, -1.1);
    for (int i = -3; i <= 2; ++i)
        mesh_add_box(m, mesh_world, i + 0.46, 0, -1.15, i + 0.54, 0.95, -0.25);
    for (int i = 0; i < 5; ++i) {
        ball b = {v3(i - 2, 0.38, -0.62), 0.38, 0.1 + 0.2 * i};
        s->balls[s->ball_count++] = b;
        ball small = {v3(i - 1.72, 0.16, 0.02), 0.16, 0.1 + 0.2 * i};
        s->balls[s->ball_count++] = small;
    }
    bench_scene_look_at(&s->scene, v3(0.35, 1.25, 3.6), v3(0.06, 0.38, -0.4), 0.74, width, height);
    s->scene.radius = 3;
    return true;
}

static bool build_scan(stage *s, int width, int height) {
    s->name = "scan";
    s->roughness = 0.35;
    for (int i = 0; i < bench_scene_count(); ++i)
        if (strcmp(bench_scene_name(i), "scan") == 0)
            return bench_scene_build(&s->scene, i, width, height) && (s->scene.radius = 1) > 0;
    return false;
}

static vec3 read3(const float *p) {
    return v3((double)p[0], (double)p[1], (double)p[2]);
}

static void write3(float *p, vec3 v) {
    p[0] = (float)v.x, p[1] = (float)v.y, p[2] = (float)v.z;
}

/* Normals of vertices in view space, the mean of their triangles' weighted by area. */
static void smooth_normals(stage *s, const float *vertices) {
    const mesh *m = &s->scene.mesh;
    s->smooth = allocate(m->vertex_count * 3 * sizeof(float));
    for (size_t t = 0; t < m->triangle_count; ++t) {
        const unsigned *corner = m->indices + 3 * t;
        vec3 p = read3(vertices + 3 * corner[0]);
        vec3 n = v3_cross(v3_sub(read3(vertices + 3 * corner[1]), p), v3_sub(read3(vertices + 3 * corner[2]), p));
        for (int k = 0; k < 3; ++k) {
            float *sum = s->smooth + 3 * corner[k];
            write3(sum, v3_add(read3(sum), n));
        }
    }
}

static bool open_rays(stage *s) {
    const mesh *m = &s->scene.mesh;
    s->device = rtcNewDevice("threads=1");
    if (!s->device)
        return false;
    s->rays = rtcNewScene(s->device);
    RTCGeometry triangles = rtcNewGeometry(s->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    float *vertices = rtcSetNewGeometryBuffer(triangles, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                              3 * sizeof(float), m->vertex_count);
    unsigned *indices = rtcSetNewGeometryBuffer(triangles, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                3 * sizeof(unsigned), m->triangle_count);
    if (!vertices || !indices)
        return false;
    for (size_t i = 0; i < m->vertex_count; ++i)
        write3(vertices + 3 * i, to_view(&s->scene.camera, v3_sub(read3(m->positions + 3 * i), s->scene.camera.eye)));
    memcpy(indices, m->indices, 3 * sizeof(unsigned) * m->triangle_count);
    smooth_normals(s, vertices);
    rtcCommitGeometry(triangles);
    rtcAttachGeometryByID(s->rays, triangles, 0);
    rtcReleaseGeometry(triangles);
    if (s->ball_count) {
        RTCGeometry balls = rtcNewGeometry(s->device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
        float *points = rtcSetNewGeometryBuffer(balls, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 4 * sizeof(float),
                                                (size_t)s->ball_count);
        for (int i = 0; points && i < s->ball_count; ++i) {
            write3(points + 4 * i, to_view(&s->scene.camera, v3_sub(s->balls[i].center, s->scene.camera.eye)));
            points[4 * i + 3] = (float)s->balls[i].radius;
        }
        rtcCommitGeometry(balls);
        rtcAttachGeometryByID(s->rays, balls, 1);
        rtcReleaseGeometry(balls);
    }
    rtcSetSceneFlags(s->rays, RTC_SCENE_FLAG_ROBUST);
    rtcCommitScene(s->rays);
    return rtcGetDeviceError(s->device) == RTC_ERROR_NONE;
}

static void close_stage(stage *s) {
    free(s->smooth);
    if (s->device) {
        rtcReleaseScene(s->rays);
        rtcReleaseDevice(s->device);
    }
    bench_scene_free(&s->scene);
}

/* ---- light -------------------------------------------------------------------------------------------------------- */

static double smoothstep(double a, double b, double x) {
    double t = fmin(1, fmax(0, (x - a) / (b - a)));
    return t * t * (3 - 2 * t);
}

/* Radiance from a world direction: a sky brighter above, dark ground, a warm lamp at the front left and a cold window on
 * the right. */
static vec3 probe(vec3 d) {
    vec3 light = v3_scale(v3(0.20, 0.25, 0.34), 0.5 + 0.9 * smoothstep(-0.1, 1, d.y));
    light = v3_scale(light, 1 - 0.65 * smoothstep(0.05, -0.25, d.y));
    double lamp = smoothstep(0.955, 0.985, v3_dot(d, v3_normalize(v3(-0.55, 0.75, 0.8))));
    double window = smoothstep(0.80, 0.90, v3_dot(d, v3_normalize(v3(1, 0.35, 0.45))));
    light = v3_mad(light, v3(1.0, 0.86, 0.66), 9 * lamp);
    return v3_mad(light, v3(0.5, 0.65, 0.9), 0.9 * window);
}

/* ---- BRDF --------------------------------------------------------------------------------------------------------- */

/* Heitz 2018: a half vector by the density of normals visible from v (local frame, n = z), then the light's direction;
 * returns the weight f n.l / density, 0 below the horizon. */
static double sample_ggx(vec3 v, double alpha, double f0, double u1, double u2, vec3 *l) {
    vec3 vh = v3_normalize(v3(alpha * v.x, alpha * v.y, v.z));
    double length2 = vh.x * vh.x + vh.y * vh.y;
    vec3 t1 = length2 > 1e-20 ? v3_scale(v3(-vh.y, vh.x, 0), 1 / sqrt(length2)) : v3(1, 0, 0);
    vec3 t2 = v3_cross(vh, t1);
    double r = sqrt(u1), phi = 2 * V3_PI * u2, a = r * cos(phi), b = r * sin(phi), s = 0.5 * (1 + vh.z);
    b = (1 - s) * sqrt(fmax(0, 1 - a * a)) + s * b;
    vec3 nh = v3_mad(v3_mad(v3_scale(t1, a), t2, b), vh, sqrt(fmax(0, 1 - a * a - b * b)));
    vec3 h = v3_normalize(v3(alpha * nh.x, alpha * nh.y, fmax(1e-9, nh.z)));
    double vdh = v3_dot(v, h), aa = alpha * alpha, away = 1 - vdh;
    *l = v3_sub(v3_scale(h, 2 * vdh), v);
    if (l->z <= 0 || vdh <= 0)
        return 0;
    double sv = sqrt(aa + (1 - aa) * v.z * v.z), sl = sqrt(aa + (1 - aa) * l->z * l->z);
    /* correlated masking by that of the view alone */
    double g = l->z * (v.z + sv) / (v.z * sl + l->z * sv);
    return g * (f0 + (1 - f0) * away * away * away * away * away);
}

/* ---- rendering ---------------------------------------------------------------------------------------------------- */

/* Where the methods' visibility and bent normals come from. */
enum { INPUT_RAYS, INPUT_BUFFER, INPUT_COUNT };

enum {
    METHOD_NONE,
    METHOD_AO,
    METHOD_LAGARDE,
    METHOD_CONES,
    METHOD_CONES_SMOOTH,
    METHOD_LOBE_GGX,
    METHOD_LOBE,
    METHOD_BRDF,
    METHOD_BENT,
    METHOD_INTEGRAL,
    METHOD_RAYS, /* V_s by rays: what is left is the split of light from BRDF */
    METHOD_COUNT
};

static const char *const method_names[METHOD_COUNT] = {
    "none",
    "AO as specular",
    "Lagarde",
    "cone/cone, exact",
    "cone/cone, smoothstep",
    "cone/lobe 32^3, D of GGX about R",
    "cone/lobe 32^3, BRDF about b",
    "full BRDF 16^4",
    "full BRDF 16^4 x 8, any b",
    "full BRDF, integral",
    "V_s by rays",
};

typedef struct render {
    const stage *s;
    int strata;
    size_t pixels;
    float *z, *normal, *eye, *roughness;                /* per pixel, view space */
    float *visibility[INPUT_COUNT], *bent[INPUT_COUNT]; /* cosine-weighted */
    float *vs[INPUT_COUNT][METHOD_COUNT];
    vec3 *truth[2];        /* reflected radiance: the dome, the probe */
    vec3 *prefiltered;     /* the probe about R, by D n.l with n = v = R */
    double *open;          /* reflected of the white dome without occluders */
    double *difference[2]; /* squared, between the two halves of the truth's rays */
} render;

static bool is_sky(const render *r, size_t i) {
    return !(r->z[i] < 1e8f);
}

static void primary_rows(void *user, int thread, int row_begin, int row_end) {
    render *r = user;
    const stage *s = r->s;
    const bench_scene_camera *c = &s->scene.camera;
    struct RTCIntersectContext context;
    (void)thread;
    rtcInitIntersectContext(&context);
    for (int y = row_begin; y < row_end; ++y)
        for (int x = 0; x < c->width; ++x) {
            size_t i = (size_t)y * (size_t)c->width + (size_t)x;
            vec3 d = v3((x + 0.5 - c->cx) / c->focal_px, (y + 0.5 - c->cy) / c->focal_px, 1);
            vec3 v = v3_scale(v3_normalize(d), -1), n = v;
            struct RTCRayHit h;
            memset(&h, 0, sizeof h);
            h.ray.dir_x = (float)d.x, h.ray.dir_y = (float)d.y, h.ray.dir_z = (float)d.z;
            h.ray.tfar = INFINITY;
            h.ray.mask = ~0u;
            h.hit.geomID = h.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
            rtcIntersect1(s->rays, &context, &h);
            bool hit = h.hit.geomID != RTC_INVALID_GEOMETRY_ID;
            r->z[i] = hit ? h.ray.tfar : INFINITY;
            r->roughness[i] = (float)(hit && h.hit.geomID == 1 ? s->balls[h.hit.primID].roughness : s->roughness);
            if (hit) {
                n = v3_normalize(v3((double)h.hit.Ng_x, (double)h.hit.Ng_y, (double)h.hit.Ng_z));
                n = v3_dot(n, v) < 0 ? v3_scale(n, -1) : n;
            }
            if (hit && h.hit.geomID == 0) {
                const unsigned *t = s->scene.mesh.indices + 3 * (size_t)h.hit.primID;
                double w[3] = {1 - (double)h.hit.u - (double)h.hit.v, (double)h.hit.u, (double)h.hit.v};
                vec3 sum = v3(0, 0, 0);
                for (int k = 0; k < 3; ++k) {
                    vec3 m = read3(s->smooth + 3 * t[k]);
                    if (v3_length(m) > 0)
                        sum = v3_mad(sum, v3_normalize(m), w[k]);
                }
                if (v3_length(sum) > 0) {
                    sum = v3_normalize(sum);
                    sum = v3_dot(sum, n) < 0 ? v3_scale(sum, -1) : sum;
                    if (v3_dot(sum, n) > 0.85 && v3_dot(sum, v) > 0.02) /* edges of boxes stay sharp */
                        n = sum;
                }
            }
            write3(r->normal + 3 * i, n);
            write3(r->eye + 3 * i, v);
        }
}

typedef struct packet {
    int count;
    vec3 dir[PACKET];
    double weight[PACKET];
    int half[PACKET];
} packet;

typedef struct sums {
    double weight, visible, half_visible[2];
    vec3 direction; /* visible ones */
    vec3 light, half_light[2];
} sums;

static void trace_packet(const stage *s, vec3 origin, packet *p, bool lit, sums *t) {
    struct RTCIntersectContext context;
    struct RTCRay8 r;
    int valid[PACKET] __attribute__((aligned(32)));
    rtcInitIntersectContext(&context);
    for (int k = 0; k < PACKET; ++k) {
        vec3 d = p->dir[k < p->count ? k : 0];
        valid[k] = k < p->count ? -1 : 0;
        r.org_x[k] = (float)origin.x, r.org_y[k] = (float)origin.y, r.org_z[k] = (float)origin.z;
        r.dir_x[k] = (float)d.x, r.dir_y[k] = (float)d.y, r.dir_z[k] = (float)d.z;
        r.tnear[k] = 0, r.tfar[k] = INFINITY;
        r.time[k] = 0, r.mask[k] = ~0u, r.id[k] = 0, r.flags[k] = 0;
    }
    rtcOccluded8(valid, s->rays, &context, &r);
    for (int k = 0; k < p->count; ++k) {
        if (r.tfar[k] < 0)
            continue;
        t->visible += p->weight[k];
        t->half_visible[p->half[k]] += p->weight[k];
        t->direction = v3_mad(t->direction, p->dir[k], p->weight[k]);
        if (lit) {
            vec3 light = v3_scale(probe(to_world(&s->scene.camera, p->dir[k])), p->weight[k]);
            t->light = v3_add(t->light, light);
            t->half_light[p->half[k]] = v3_add(t->half_light[p->half[k]], light);
        }
    }
    p->count = 0;
}

/* A point of stratum s of strata x strata in the unit square. */
static void stratified(size_t pixel, int s, int set, int strata, double u[2]) {
    sample_jitter((uint32_t)pixel, (uint32_t)(s + set * strata * strata), u);
    u[0] = (s % strata + u[0]) / strata;
    u[1] = (s / strata + u[1]) / strata;
}

static vec3 from_frame(vec3 d, vec3 a, vec3 b, vec3 n) {
    return v3_mad(v3_mad(v3_scale(a, d.x), b, d.y), n, d.z);
}

/* The probe as an engine would look it up: filtered by the lobe of n = v = R, weighted by n.l [Kar13]. */
static vec3 prefilter(const render *r, size_t i, vec3 reflection, double alpha) {
    vec3 sum = v3(0, 0, 0), a, b, d;
    double weight = 0, u[2];
    v3_frame(reflection, &a, &b);
    for (int s = 0; s < r->strata * r->strata; ++s) {
        stratified(i, s, 2, r->strata, u);
        if (sample_ggx(v3(0, 0, 1), alpha, 1, u[0], u[1], &d) <= 0)
            continue;
        sum = v3_mad(sum, probe(to_world(&r->s->scene.camera, from_frame(d, a, b, reflection))), d.z);
        weight += d.z;
    }
    return v3_scale(sum, weight > 0 ? 1 / weight : 0);
}

static void truth_pixel(render *r, int x, int y) {
    const bench_scene_camera *c = &r->s->scene.camera;
    size_t i = (size_t)y * (size_t)c->width + (size_t)x;
    int total = r->strata * r->strata;
    vec3 n = read3(r->normal + 3 * i), v = read3(r->eye + 3 * i), a, b;
    double z = (double)r->z[i], alpha = (double)r->roughness[i] * (double)r->roughness[i];
    for (int m = 0; m < INPUT_COUNT; ++m) {
        r->visibility[m][i] = 1;
        write3(r->bent[m] + 3 * i, n);
    }
    if (is_sky(r, i))
        return;
    v3_frame(n, &a, &b);
    vec3 p = v3((x + 0.5 - c->cx) / c->focal_px * z, (y + 0.5 - c->cy) / c->focal_px * z, z);
    p = v3_mad(p, n, 2e-4 + 1e-5 * z);
    vec3 local = v3(v3_dot(v, a), v3_dot(v, b), fmax(1e-3, v3_dot(v, n)));
    sums t[2]; /* cosine-weighted, reflected */
    packet rays;
    memset(t, 0, sizeof t);
    memset(&rays, 0, sizeof rays);
    for (int pass = 0; pass < 2; ++pass)
        for (int s = 0; s < total; ++s) {
            double u[2], weight = 1;
            vec3 d;
            stratified(i, s, pass, r->strata, u);
            if (pass) {
                weight = sample_ggx(local, alpha, reflectance, u[0], u[1], &d);
                d = from_frame(d, a, b, n);
            } else {
                d = cosine_direction(n, a, b, u[0], u[1]);
            }
            t[pass].weight += weight;
            if (weight > 0) {
                rays.dir[rays.count] = d;
                rays.weight[rays.count] = weight;
                rays.half[rays.count++] = (s + s / r->strata) & 1;
            }
            if (rays.count == PACKET || (s == total - 1 && rays.count))
                trace_packet(r->s, p, &rays, pass, t + pass);
        }
    r->visibility[INPUT_RAYS][i] = (float)(t[0].visible / t[0].weight);
    if (v3_length(t[0].direction) > 0)
        write3(r->bent[INPUT_RAYS] + 3 * i, v3_normalize(t[0].direction));
    for (int m = 0; m < INPUT_COUNT; ++m)
        r->vs[m][METHOD_RAYS][i] = (float)(t[1].weight > 0 ? t[1].visible / t[1].weight : 1);
    r->open[i] = t[1].weight / total;
    r->truth[0][i] = v3_scale(v3(1, 1, 1), t[1].visible / total);
    r->truth[1][i] = v3_scale(t[1].light, 1.0 / total);
    double dome = (t[1].half_visible[0] - t[1].half_visible[1]) / total;
    vec3 lit = v3_scale(v3_sub(t[1].half_light[0], t[1].half_light[1]), 1.0 / total);
    r->difference[0][i] = dome * dome;
    r->difference[1][i] = v3_dot(lit, lit) / 3;
    r->prefiltered[i] = prefilter(r, i, v3_sub(v3_scale(n, 2 * v3_dot(n, v)), v), alpha);
}

static void truth_rows(void *user, int thread, int row_begin, int row_end) {
    render *r = user;
    (void)thread;
    for (int y = row_begin; y < row_end; ++y)
        for (int x = 0; x < r->s->scene.camera.width; ++x)
            truth_pixel(r, x, y);
}

/* Visibility and bent normals of the depth buffer. */
static bool from_buffer(render *r) {
    const bench_scene_camera *c = &r->s->scene.camera;
    gtao_desc d;
    gtao_output o;
    memset(&d, 0, sizeof d);
    memset(&o, 0, sizeof o);
    d.width = c->width, d.height = c->height;
    d.depth = r->z;
    d.normals = r->normal;
    d.camera.fx = (float)c->focal_px;
    d.radius = (float)r->s->scene.radius;
    d.preset = GTAO_PRESET_REFERENCE;
    o.visibility = r->visibility[INPUT_BUFFER];
    o.bent_normals = r->bent[INPUT_BUFFER];
    gtao_result result = compute_output(&d, &o);
    if (result != GTAO_OK)
        fprintf(stderr, "bench_shading: %s\n", gtao_result_string(result));
    return result == GTAO_OK;
}

/* ---- methods ------------------------------------------------------------------------------------------------------ */

/* Lagarde and de Rousiers 2014, from the visibility alone; alpha is the width of the lobe. */
static double lagarde(double n_dot_v, double ao, double alpha) {
    return fmin(1, fmax(0, pow(n_dot_v + ao, exp2(-16 * alpha - 1)) - 1 + ao));
}

typedef struct table {
    gtso_table_desc desc;
    float *data;
} table;

static void bake_rows(void *user, int thread, int row_begin, int row_end) {
    table *t = user;
    (void)thread;
    gtso_bake_rows(&t->desc, t->data, row_begin, row_end, NULL);
}

static void bake_table(table *t, pool *threads) {
    gtso_table_desc resolved;
    gtso_result result = gtso_table_resolve(&t->desc, &resolved);
    if (result != GTSO_OK) {
        fprintf(stderr, "bench_shading: %s\n", gtso_result_string(result));
        exit(1);
    }
    t->desc = resolved;
    t->data = allocate(gtso_table_count(&t->desc) * sizeof *t->data);
    pool_run(threads, gtso_table_rows(&t->desc), 0, bake_rows, NULL, t);
}

static bool look_up(const render *r, int input, const table *t, float *output) {
    gtso_lookup_desc d;
    memset(&d, 0, sizeof d);
    d.width = r->s->scene.camera.width, d.height = r->s->scene.camera.height;
    d.table = &t->desc, d.data = t->data;
    d.visibility = r->visibility[input];
    d.bent_normals = r->bent[input];
    d.normals = r->normal, d.views = r->eye;
    d.roughness = r->roughness;
    d.output = output;
    gtso_result result = gtso_lookup(&d);
    if (result != GTSO_OK)
        fprintf(stderr, "bench_shading: %s\n", gtso_result_string(result));
    return result == GTSO_OK;
}

static float angle_between(vec3 a, vec3 b) {
    return (float)acos(fmin(1, fmax(-1, v3_dot(a, b))));
}

static void method_rows(void *user, int thread, int row_begin, int row_end) {
    render *r = user;
    size_t width = (size_t)r->s->scene.camera.width;
    (void)thread;
    for (int input = 0; input < INPUT_COUNT; ++input)
        for (size_t i = (size_t)row_begin * width; i < (size_t)row_end * width; ++i) {
            vec3 n = read3(r->normal + 3 * i), v = read3(r->eye + 3 * i), b = read3(r->bent[input] + 3 * i);
            float *const *vs = r->vs[input], ao = r->visibility[input][i], roughness = r->roughness[i];
            float beta = angle_between(b, v3_sub(v3_scale(n, 2 * v3_dot(n, v)), v));
            float aperture = (float)acos((double)gtso_cos_aperture_tilted(ao, (float)v3_dot(n, b)));
            float lobe = gtso_lobe_aperture(GTSO_FIT_JIMENEZ, roughness);
            vs[METHOD_NONE][i] = 1;
            vs[METHOD_AO][i] = ao;
            vs[METHOD_LAGARDE][i] = (float)lagarde(v3_dot(n, v), (double)ao, (double)roughness * (double)roughness);
            vs[METHOD_CONES][i] = gtso_cone_visibility(GTSO_CAPS_EXACT, aperture, lobe, beta);
            vs[METHOD_CONES_SMOOTH][i] = gtso_cone_visibility(GTSO_CAPS_SMOOTHSTEP, aperture, lobe, beta);
            vs[METHOD_INTEGRAL][i] = 1;
            if (!is_sky(r, i))
                vs[METHOD_INTEGRAL][i] = gtso_brdf_visibility(r->normal + 3 * i, r->eye + 3 * i, r->bent[input] + 3 * i,
                                                              aperture, roughness, (float)reflectance, NULL, NULL);
        }
}

/* ---- comparison --------------------------------------------------------------------------------------------------- */

/* V_s times what the open surface reflects: of the dome by rays, of the probe by the split sum. */
static vec3 shaded(const render *r, int input, int m, int light, size_t i) {
    double reflected = (double)r->vs[input][m][i] * r->open[i];
    return light ? v3_scale(r->prefiltered[i], reflected) : v3_scale(v3(1, 1, 1), reflected);
}

typedef struct error_sums {
    double rmse, mean, edge_rmse; /* edge: n.v below 0.35 */
} error_sums;

static error_sums compare(const render *r, int input, int m, int light) {
    double squares = 0, sum = 0, count = 0, edge_squares = 0, edge_count = 0;
    for (size_t i = 0; i < r->pixels; ++i) {
        if (is_sky(r, i))
            continue;
        vec3 d = v3_sub(shaded(r, input, m, light, i), r->truth[light][i]);
        squares += v3_dot(d, d) / 3;
        sum += (d.x + d.y + d.z) / 3;
        count += 1;
        if (v3_dot(read3(r->normal + 3 * i), read3(r->eye + 3 * i)) < 0.35) {
            edge_squares += v3_dot(d, d) / 3;
            edge_count += 1;
        }
    }
    error_sums e = {sqrt(squares / count), sum / count, sqrt(edge_squares / fmax(1, edge_count))};
    return e;
}

static void print_scene(const render *r) {
    double noise[2] = {0, 0}, count = 0;
    for (size_t i = 0; i < r->pixels; ++i)
        if (!is_sky(r, i)) {
            noise[0] += r->difference[0][i];
            noise[1] += r->difference[1][i];
            count += 1;
        }
    printf("## scene-%s\n", r->s->name);
    printf(
        "| V_s by | dome: RMSE | mean | silhouettes | probe: RMSE | mean | gtao.h, dome: RMSE | mean | silhouettes | "
        "gtao.h, probe: RMSE | mean |\n|---|");
    for (int k = 0; k < 10; ++k)
        printf("--:|");
    printf("\n");
    for (int m = 0; m < METHOD_COUNT; ++m) {
        printf("| %s |", method_names[m]);
        for (int input = 0; input < (m == METHOD_RAYS ? 1 : INPUT_COUNT); ++input) {
            error_sums dome = compare(r, input, m, 0), lit = compare(r, input, m, 1);
            if (m == METHOD_RAYS)
                printf(" | | |");
            else
                printf(" %.4f | %+.4f | %.4f |", dome.rmse, dome.mean, dome.edge_rmse);
            printf(" %.4f | %+.4f |", lit.rmse, lit.mean);
        }
        printf("%s\n", m == METHOD_RAYS ? " | | | | |" : "");
    }
    /* The halves differ by twice the noise of their mean. */
    printf("\nNoise of the truth, %d rays a pixel: at most %.4f (dome), %.4f (probe).\n\n", r->strata * r->strata,
           sqrt(noise[0] / count), sqrt(noise[1] / count));
}

/* ---- sheet -------------------------------------------------------------------------------------------------------- */

static void draw_pixels(const render *r, int input, int m, int light, image *panel) {
    double exposure = light ? 1.25 : 1;
    for (size_t i = 0; i < r->pixels; ++i) {
        vec3 l = m < METHOD_COUNT ? shaded(r, input, m, light, i) : r->truth[light][i];
        if (is_sky(r, i))
            l = light ? probe(to_world(&r->s->scene.camera, v3_scale(read3(r->eye + 3 * i), -1))) : v3(0.9, 0.9, 0.9);
        color c = {(float)(exposure * l.x), (float)(exposure * l.y), (float)(exposure * l.z)};
        c = color_encode(c);
        float *p = panel->data + 3 * i;
        p[0] = c.r, p[1] = c.g, p[2] = c.b;
    }
}

static bool write_sheet(const render *r, const char *directory) {
    static const struct {
        int input, method;
        const char *title;
    } panels[] = {{INPUT_RAYS, METHOD_NONE, "no specular occlusion"},
                  {INPUT_RAYS, METHOD_AO, "AO as specular occlusion"},
                  {INPUT_RAYS, METHOD_LAGARDE, "Lagarde's formula"},
                  {INPUT_RAYS, METHOD_CONES, "cone/cone, exact"},
                  {INPUT_RAYS, METHOD_CONES_SMOOTH, "cone/cone, smoothstep"},
                  {INPUT_RAYS, METHOD_LOBE, "cone/lobe table 32³"},
                  {INPUT_RAYS, METHOD_BRDF, "full BRDF table 16⁴"},
                  {INPUT_BUFFER, METHOD_BRDF, "full BRDF, inputs of gtao.h"},
                  {INPUT_RAYS, METHOD_RAYS, "V_s by rays"},
                  {INPUT_RAYS, METHOD_COUNT, "truth, ray-traced"}};
    enum { COLUMNS = 5, PANELS = 10, GAP = 6, CAPTION = 38, HEADING = 30 };
    int width = r->s->scene.camera.width, height = r->s->scene.camera.height;
    int block = HEADING + PANELS / COLUMNS * (height + CAPTION + GAP);
    image sheet, panel;
    image_error error;
    image_pending pending;
    char path[512], text[128];
    if (!image_create(&sheet, COLUMNS * (width + GAP) + GAP, 2 * block + GAP, 3, &error) ||
        !image_create(&panel, width, height, 3, &error)) {
        fprintf(stderr, "bench_shading: %s\n", error.text);
        return false;
    }
    canvas_fill(&sheet, 0, 0, sheet.width, sheet.height, color_hex(0x121316));
    for (int light = 0; light < 2; ++light) {
        canvas_text(&sheet, GAP, (float)(light * block + 21), CANVAS_LEFT, CANVAS_BOLD, 15, color_hex(0xf2f2f0),
                    light ? "lit by a probe with a lamp and a window" : "lit by a white dome");
        for (int k = 0; k < PANELS; ++k) {
            int x = GAP + k % COLUMNS * (width + GAP), m = panels[k].method;
            int y = light * block + HEADING + k / COLUMNS * (height + CAPTION + GAP);
            draw_pixels(r, panels[k].input, m, light, &panel);
            canvas_draw(&sheet, x, y, &panel);
            canvas_text(&sheet, (float)x, (float)(y + height + 15), CANVAS_LEFT, CANVAS_REGULAR, 13,
                        color_hex(0xf2f2f0), panels[k].title);
            text[0] = 0;
            if (m == METHOD_RAYS && !light) {
                snprintf(text, sizeof text, "the truth itself");
            } else if (m < METHOD_COUNT) {
                error_sums e = compare(r, panels[k].input, m, light);
                snprintf(text, sizeof text, "RMSE %.3f, mean %+.3f", e.rmse, e.mean);
            }
            canvas_text(&sheet, (float)x, (float)(y + height + 31), CANVAS_LEFT, CANVAS_REGULAR, 12,
                        color_hex(0x9ba1a8), text);
        }
    }
    snprintf(path, sizeof path, "%s/%s.png", directory, r->s->name);
    bool ok = image_write(path, &sheet, NULL, IMAGE_RANGE_UNIT, &pending, &error) && image_commit(&pending, &error);
    if (!ok)
        fprintf(stderr, "bench_shading: %s\n", error.text);
    image_free(&panel);
    image_free(&sheet);
    return ok;
}

enum { TABLES = 4 };

static bool run_stage(const stage *s, int strata, const table *tables, pool *threads, const char *directory) {
    static const int method_of[TABLES] = {METHOD_LOBE_GGX, METHOD_LOBE, METHOD_BRDF, METHOD_BENT};
    int width = s->scene.camera.width, height = s->scene.camera.height;
    render r;
    memset(&r, 0, sizeof r);
    r.s = s;
    r.strata = strata;
    r.pixels = (size_t)width * (size_t)height;
    r.z = allocate(r.pixels * sizeof(float));
    r.roughness = allocate(r.pixels * sizeof(float));
    r.normal = allocate(3 * r.pixels * sizeof(float));
    r.eye = allocate(3 * r.pixels * sizeof(float));
    r.prefiltered = allocate(r.pixels * sizeof(vec3));
    r.open = allocate(r.pixels * sizeof(double));
    for (int k = 0; k < INPUT_COUNT; ++k) { /* and as many lights */
        r.truth[k] = allocate(r.pixels * sizeof(vec3));
        r.difference[k] = allocate(r.pixels * sizeof(double));
        r.visibility[k] = allocate(r.pixels * sizeof(float));
        r.bent[k] = allocate(3 * r.pixels * sizeof(float));
        for (int m = 0; m < METHOD_COUNT; ++m)
            r.vs[k][m] = allocate(r.pixels * sizeof(float));
    }
    pool_run(threads, height, 0, primary_rows, NULL, &r);
    pool_run(threads, height, 1, truth_rows, NULL, &r);
    bool ok = from_buffer(&r);
    if (ok)
        pool_run(threads, height, 1, method_rows, NULL, &r);
    for (int k = 0; ok && k < INPUT_COUNT; ++k)
        for (int t = 0; ok && t < TABLES; ++t)
            ok = look_up(&r, k, tables + t, r.vs[k][method_of[t]]);
    if (ok)
        print_scene(&r);
    ok = ok && write_sheet(&r, directory);
    for (int k = 0; k < INPUT_COUNT; ++k) {
        free(r.truth[k]);
        free(r.difference[k]);
        free(r.visibility[k]);
        free(r.bent[k]);
        for (int m = 0; m < METHOD_COUNT; ++m)
            free(r.vs[k][m]);
    }
    free(r.z);
    free(r.roughness);
    free(r.normal);
    free(r.eye);
    free(r.prefiltered);
    free(r.open);
    return ok;
}

/* ---- random cones ------------------------------------------------------------------------------------------------- */

enum { BINS = 6 };
static const char *const bin_names[BINS] = {"all",    "roughness below 0.25", "to 0.5", "to 0.75",
                                            "to 1.0", "view 70° and more"};

typedef struct cone_case {
    float n[3], v[3], b[3], aperture, beta, roughness, visibility, exact;
} cone_case;

/* Visibility cones above the tangent plane: the aperture uniform in angle, the tilt of the bent normal uniform in what
 * that leaves, any azimuth; view and roughness uniform. */
static void cone_rows(void *user, int thread, int row_begin, int row_end) {
    cone_case *cases = user;
    (void)thread;
    for (int i = row_begin; i < row_end; ++i) {
        cone_case *c = cases + i;
        double u[6];
        for (int k = 0; k < 3; ++k)
            sample_jitter((uint32_t)i, (uint32_t)(k + 77), u + 2 * k);
        double aperture = (0.02 + 0.98 * u[0]) * 0.5 * V3_PI, tilt = u[1] * (0.5 * V3_PI - aperture);
        double slant = u[2] * 0.49 * V3_PI, phi = 2 * V3_PI * u[3];
        vec3 b = v3(sin(tilt) * cos(phi), sin(tilt) * sin(phi), cos(tilt));
        write3(c->n, v3(0, 0, 1));
        write3(c->v, v3(sin(slant), 0, cos(slant)));
        write3(c->b, b);
        c->aperture = (float)aperture;
        c->roughness = (float)u[4];
        c->visibility = (float)(cos(tilt) * sin(aperture) * sin(aperture));
        c->beta = angle_between(b, v3(-sin(slant), 0, cos(slant)));
        c->exact = gtso_brdf_visibility(c->n, c->v, c->b, c->aperture, c->roughness, 0.04f, NULL, NULL);
    }
}

static void print_errors(const char *name, const cone_case *cases, const float *values, int count) {
    double squares[BINS] = {0}, n[BINS] = {0}, most = 0, sum = 0;
    for (int i = 0; i < count; ++i) {
        double e = (double)values[i] - (double)cases[i].exact;
        int bin[3] = {0, 1 + (cases[i].roughness < 1 ? (int)(4 * cases[i].roughness) : 3),
                      (double)cases[i].v[2] < cos(70 * V3_PI / 180) ? 5 : 0};
        for (int k = 0; k < (bin[2] ? 3 : 2); ++k)
            squares[bin[k]] += e * e, n[bin[k]] += 1;
        most = fmax(most, fabs(e));
        sum += e;
    }
    printf("| %s |", name);
    for (int k = 0; k < BINS; ++k)
        printf(" %.4f |", sqrt(squares[k] / n[k]));
    printf(" %+.4f | %.3f |\n", sum / count, most);
}

static void look_up_cones(const char *name, const cone_case *cases, int count, const table *t, volume_format format,
                          float *values) {
    volume v = {t->desc.size[0], t->desc.size[1], t->desc.size[2] * t->desc.size[3] * t->desc.size[4], t->data};
    float *data = allocate(gtso_table_count(&t->desc) * sizeof *data);
    if (!volume_quantise(&v, format, data))
        exit(1);
    for (int i = 0; i < count; ++i) {
        const cone_case *c = cases + i;
        values[i] = gtso_lookup_at(&t->desc, data, c->visibility, c->b, c->n, c->v, c->roughness);
    }
    print_errors(name, cases, values, count);
    free(data);
}

static void print_tables(const cone_case *cases, int count, pool *threads, float *values) {
    static const struct {
        gtso_kind kind;
        int size;
        const char *name;
    } rows[] = {{GTSO_KIND_LOBE, 16, "table, cone/lobe BRDF 16^3"},
                {GTSO_KIND_LOBE, 32, "table, cone/lobe BRDF 32^3"},
                {GTSO_KIND_BRDF, 16, "table, full BRDF 16^4"},
                {GTSO_KIND_BENT, 16, "table, full BRDF 16^4 x 8, any b"}};
    static const struct {
        volume_format format;
        const char *name;
    } formats[] = {{VOLUME_FLOAT, "float"}, {VOLUME_UNORM8, "8 bits"}, {VOLUME_BC4, "BC4"}};
    char name[96];
    for (size_t k = 0; k < sizeof rows / sizeof *rows; ++k) {
        table t;
        memset(&t, 0, sizeof t);
        t.desc.kind = rows[k].kind;
        for (int a = 0; a < GTSO_AXIS_AZIMUTH; ++a)
            t.desc.size[a] = rows[k].size;
        bake_table(&t, threads);
        for (size_t f = 0; f < sizeof formats / sizeof *formats; ++f) {
            snprintf(name, sizeof name, "%s, %s", rows[k].name, formats[f].name);
            look_up_cones(name, cases, count, &t, formats[f].format, values);
        }
        free(t.data);
    }
}

static void print_cones(int count, pool *threads) {
    static const char *const fits[] = {"[J16]", "Drobot", "Uludag"}, *const caps[] = {"exact", "Oat", "smoothstep"};
    static const char *const lobes[] = {"BRDF", "D of GGX", "D of Beckmann", "D of Blinn-Phong", "Phong"};
    static const char *const frames[] = {"n = b", "n = R"};
    cone_case *cases = allocate((size_t)count * sizeof *cases);
    float *values = allocate((size_t)count * sizeof *values);
    char name[96];
    pool_run(threads, count, 0, cone_rows, NULL, cases);
    printf("## cones\n| V_s by |");
    for (int k = 0; k < BINS; ++k)
        printf(" %s |", bin_names[k]);
    printf(" mean | largest |\n|---|");
    for (int k = 0; k < BINS + 2; ++k)
        printf("--:|");
    printf("\n");
    for (int i = 0; i < count; ++i)
        values[i] = 1;
    print_errors("none", cases, values, count);
    for (int i = 0; i < count; ++i)
        values[i] = cases[i].visibility;
    print_errors("AO as specular", cases, values, count);
    for (int i = 0; i < count; ++i)
        values[i] = (float)lagarde((double)cases[i].v[2], (double)cases[i].visibility,
                                   (double)cases[i].roughness * (double)cases[i].roughness);
    print_errors("Lagarde", cases, values, count);
    for (int f = 0; f < 3; ++f)
        for (int k = 0; k < (f ? 1 : 3); ++k) {
            for (int i = 0; i < count; ++i)
                values[i] = gtso_cone_visibility((gtso_caps)k, cases[i].aperture,
                                                 gtso_lobe_aperture((gtso_fit)f, cases[i].roughness), cases[i].beta);
            snprintf(name, sizeof name, "cone/cone, %s, aperture of %s", caps[k], fits[f]);
            print_errors(name, cases, values, count);
        }
    for (int frame = 1; frame >= 0; --frame)
        for (int lobe = 4; lobe >= 0; --lobe) {
            for (int i = 0; i < count; ++i)
                values[i] = gtso_lobe_visibility((gtso_lobe)lobe, (gtso_frame)frame, cases[i].aperture, cases[i].beta,
                                                 cases[i].roughness);
            snprintf(name, sizeof name, "cone/lobe, %s, %s", lobes[lobe], frames[frame]);
            print_errors(name, cases, values, count);
        }
    for (int i = 0; i < count; ++i)
        values[i] = gtso_brdf_visibility(cases[i].n, cases[i].v, cases[i].b, cases[i].aperture, cases[i].roughness,
                                         (float)reflectance, NULL, NULL);
    print_errors("full BRDF, integral, f0 = 0.9 in place of 0.04", cases, values, count);
    print_tables(cases, count, threads, values);
    printf("\n%d cones.\n\n", count);
    free(values);
    free(cases);
}

/* ---- the whole ---------------------------------------------------------------------------------------------------- */

static int usage(void) {
    fprintf(stderr, "usage: bench_shading [--size WIDTHxHEIGHT] [--rays N] [--cones N] [--threads N] [DIRECTORY]\n");
    return 2;
}

int main(int argc, char **argv) {
    int width = 304, height = 190, strata = 24, cones = 20000, threads = (int)sysconf(_SC_NPROCESSORS_ONLN), status = 0;
    const char *directory = "build/bench/specular";
    for (int k = 1; k < argc; ++k) {
        if (argv[k][0] != '-') {
            directory = argv[k];
            continue;
        }
        const char *name = argv[k], *value = ++k < argc ? argv[k] : "";
        bool known = false;
        if (strcmp(name, "--size") == 0)
            known = sscanf(value, "%dx%d", &width, &height) == 2 && width >= 8 && height >= 8 && width <= 4096 &&
                    height <= 4096;
        else if (strcmp(name, "--rays") == 0)
            known = (strata = atoi(value)) >= 1 && strata <= 256;
        else if (strcmp(name, "--cones") == 0)
            known = (cones = atoi(value)) >= 100;
        else if (strcmp(name, "--threads") == 0)
            known = (threads = atoi(value)) >= 1;
        if (!known)
            return usage();
    }
    if (!make_folders(directory))
        return 1;
    pool *workers = pool_create(threads);
    if (!workers)
        return 1;
    canvas_load_fonts();
    print_cones(cones, workers);
    fflush(stdout);
    table tables[TABLES];
    memset(tables, 0, sizeof tables);
    tables[0].desc.lobe = GTSO_LOBE_GGX;
    tables[0].desc.frame = GTSO_FRAME_REFLECTION;
    tables[2].desc.kind = GTSO_KIND_BRDF;
    tables[3].desc.kind = GTSO_KIND_BENT;
    tables[2].desc.f0 = tables[3].desc.f0 = (float)reflectance;
    for (int t = 0; t < TABLES; ++t)
        bake_table(tables + t, workers);
    bool (*const builders[])(stage *, int, int) = {build_spheres, build_scan};
    for (int i = 0; i < 2 && !status; ++i) {
        stage s;
        memset(&s, 0, sizeof s);
        /* the row of spheres is a wide picture */
        if (!builders[i](&s, width, i ? height : height * 3 / 4) || !open_rays(&s) ||
            !run_stage(&s, strata, tables, workers, directory)) {
            fprintf(stderr, "bench_shading: scene %d failed\n", i);
            status = 1;
        }
        close_stage(&s);
        fflush(stdout);
    }
    for (int t = 0; t < TABLES; ++t)
        free(tables[t].data);
    canvas_free_fonts();
    pool_destroy(workers);
    return status;
}
