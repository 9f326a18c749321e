#include "trace.h"

#include <embree3/rtcore.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sampling.h"

struct trace {
    RTCDevice device;
    RTCScene scene;
};

enum { PACKET = 8 };

static trace *open_scene(const bench_scene *s, enum RTCSceneFlags flags) {
    trace *t = calloc(1, sizeof *t);
    if (!t)
        return NULL;
    t->device = rtcNewDevice("threads=1");
    if (!t->device) {
        fprintf(stderr, "embree: no device (error %d)\n", (int)rtcGetDeviceError(NULL));
        free(t);
        return NULL;
    }
    t->scene = rtcNewScene(t->device);
    RTCGeometry geometry = rtcNewGeometry(t->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    float *vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                              s->mesh.vertex_count);
    unsigned *indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                3 * sizeof(unsigned), s->mesh.triangle_count);
    if (vertices && indices) {
        for (size_t i = 0; i < s->mesh.vertex_count; ++i) {
            const float *p = s->mesh.positions + 3 * i;
            vec3 d = v3_sub(v3((double)p[0], (double)p[1], (double)p[2]), s->camera.eye);
            vertices[3 * i] = (float)v3_dot(d, s->camera.right);
            vertices[3 * i + 1] = (float)v3_dot(d, s->camera.down);
            vertices[3 * i + 2] = (float)v3_dot(d, s->camera.forward);
        }
        memcpy(indices, s->mesh.indices, 3 * sizeof(unsigned) * s->mesh.triangle_count);
    }
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(t->scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcSetSceneBuildQuality(t->scene, RTC_BUILD_QUALITY_HIGH);
    /* Rays that graze an edge shared by two triangles must not slip between them. */
    rtcSetSceneFlags(t->scene, RTC_SCENE_FLAG_ROBUST | flags);
    rtcCommitScene(t->scene);
    enum RTCError error = rtcGetDeviceError(t->device);
    if (error != RTC_ERROR_NONE) {
        fprintf(stderr, "embree: scene %s: error %d\n", s->name, (int)error);
        trace_close(t);
        return NULL;
    }
    return t;
}

trace *trace_open(const bench_scene *s) {
    return open_scene(s, RTC_SCENE_FLAG_NONE);
}

trace *trace_open_hits(const bench_scene *s) {
    return open_scene(s, RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
}

void trace_close(trace *t) {
    if (!t)
        return;
    rtcReleaseScene(t->scene);
    rtcReleaseDevice(t->device);
    free(t);
}

static struct RTCRayHit ray_hit(vec3 origin, vec3 direction, double reach) {
    struct RTCRayHit r;
    memset(&r, 0, sizeof r);
    r.ray.org_x = (float)origin.x, r.ray.org_y = (float)origin.y, r.ray.org_z = (float)origin.z;
    r.ray.dir_x = (float)direction.x, r.ray.dir_y = (float)direction.y, r.ray.dir_z = (float)direction.z;
    r.ray.tfar = (float)reach;
    r.ray.mask = ~0u;
    r.hit.geomID = r.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    return r;
}

/* Unit normal of the hit face on the side that `direction` came from. */
static vec3 facing_normal(const struct RTCRayHit *r, vec3 direction) {
    vec3 n = v3((double)r->hit.Ng_x, (double)r->hit.Ng_y, (double)r->hit.Ng_z);
    double length = v3_length(n);
    if (!(length > 0))
        return v3_scale(v3_normalize(direction), -1);
    return v3_scale(n, (v3_dot(n, direction) > 0 ? -1 : 1) / length);
}

void trace_primary_rows(const trace *t, const bench_scene_camera *camera, float *z, float *normals, int row_begin,
                        int row_end) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (int y = row_begin; y < row_end; ++y)
        for (int x = 0; x < camera->width; ++x) {
            size_t i = (size_t)y * (size_t)camera->width + (size_t)x;
            vec3 d = v3((x + 0.5 - camera->cx) / camera->focal_px, (y + 0.5 - camera->cy) / camera->focal_px, 1);
            struct RTCRayHit r = ray_hit(v3(0, 0, 0), d, (double)INFINITY);
            rtcIntersect1(t->scene, &context, &r);
            bool hit = r.hit.geomID != RTC_INVALID_GEOMETRY_ID && r.ray.tfar < VIEW_SKY;
            vec3 n = hit ? facing_normal(&r, d) : v3_scale(v3_normalize(d), -1);
            z[i] = hit ? r.ray.tfar : VIEW_SKY;
            normals[3 * i] = (float)n.x, normals[3 * i + 1] = (float)n.y, normals[3 * i + 2] = (float)n.z;
        }
}

/* What a ray meets on its way, nearest first. */
typedef struct collector {
    struct RTCIntersectContext context; /* first: the filter gets its address */
    trace_hit *hits;
    int count, most;
} collector;

static void collect(const struct RTCFilterFunctionNArguments *a) {
    collector *c = (collector *)(void *)a->context;
    /* with one ray at a time the packets are the plain structures */
    float distance = ((const struct RTCRay *)(const void *)a->ray)->tfar;
    unsigned triangle = ((const struct RTCHit *)(const void *)a->hit)->primID;
    a->valid[0] = 0; /* go on */
    int i = c->count < c->most ? c->count++ : c->most;
    if (i == c->most && !(distance < c->hits[--i].distance))
        return;
    for (; i > 0 && c->hits[i - 1].distance > distance; --i)
        c->hits[i] = c->hits[i - 1];
    c->hits[i] = (trace_hit){distance, triangle};
}

int trace_hits(const trace *t, vec3 origin, vec3 direction, trace_hit *hits, int most) {
    collector c;
    struct RTCRayHit r = ray_hit(origin, direction, (double)VIEW_SKY);
    rtcInitIntersectContext(&c.context);
    c.context.filter = collect;
    c.hits = hits, c.count = 0, c.most = most;
    rtcIntersect1(t->scene, &c.context, &r);
    return c.count;
}

/* A pixel's point and hemisphere. */
typedef struct origin {
    vec3 p, n, a, b; /* a, b: any two directions perpendicular to n */
} origin;

static bool origin_at(const view *v, int x, int y, origin *o) {
    size_t i = (size_t)y * (size_t)v->width + (size_t)x;
    double z = (double)v->z[i], f = (double)v->focal_px;
    if (!(z < (double)VIEW_SKY))
        return false;
    const float *n = v->normals + 3 * i;
    o->n = v3_normalize(v3((double)n[0], (double)n[1], (double)n[2]));
    v3_frame(o->n, &o->a, &o->b);
    vec3 p = v3((x + 0.5 - (double)v->cx) / f * z, (y + 0.5 - (double)v->cy) / f * z, z);
    /* Off the surface by more than its rounding (z and the vertices are floats), by far less than the radius. */
    o->p = v3_mad(p, o->n, 1e-4 * (double)v->radius + 4e-6 * z);
    return true;
}

static double hit_occlusion(double d, const view *v) {
    double reach = (double)v->radius, f = (double)v->falloff;
    return f > 0 ? fmin(1, fmax(0, (reach - d) / (f * reach))) : 1;
}

/* How far a ray from a pixel's point goes before it leaves the pyramid that the image shows. Rays that end behind the
 * eye leave it before. */
static double inside_view(const view *v, vec3 p, vec3 d) {
    double f = (double)v->focal_px, cx = (double)v->cx, cy = (double)v->cy, reach = (double)INFINITY;
    /* outside where side . point < 0 */
    const vec3 sides[] = {
        {f, 0, cx}, {-f, 0, v->width - cx}, {0, f, cy}, {0, -f, v->height - cy}}; /* 0 <= f x / z + cx and so on */
    for (size_t k = 0; k < sizeof sides / sizeof *sides; ++k) {
        double there = v3_dot(sides[k], p), rate = v3_dot(sides[k], d);
        if (rate < 0)
            reach = fmin(reach, fmax(there, 0) / -rate);
    }
    return reach;
}

/* Rays from o in the directions dir[0..count), count <= PACKET. */
static void packet_of(const view *v, const origin *o, bool inside, const vec3 *dir, int count, struct RTCRayHit8 *rays,
                      int *valid) {
    struct RTCRayHit8 r;
    for (int k = 0; k < PACKET; ++k) {
        vec3 d = dir[k < count ? k : 0];
        valid[k] = k < count ? -1 : 0;
        r.ray.org_x[k] = (float)o->p.x, r.ray.org_y[k] = (float)o->p.y, r.ray.org_z[k] = (float)o->p.z;
        r.ray.dir_x[k] = (float)d.x, r.ray.dir_y[k] = (float)d.y, r.ray.dir_z[k] = (float)d.z;
        r.ray.tnear[k] = 0, r.ray.time[k] = 0;
        r.ray.tfar[k] = inside ? (float)fmin((double)v->radius, inside_view(v, o->p, d)) : v->radius;
        r.ray.mask[k] = ~0u, r.ray.id[k] = 0, r.ray.flags[k] = 0;
        r.hit.geomID[k] = r.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
    }
    *rays = r;
}

/* Sum of occlusion of the directions. */
static double occlusion_of(const trace *t, const view *v, const origin *o, bool inside, const vec3 *dir, int count) {
    struct RTCIntersectContext context;
    struct RTCRayHit8 r;
    int valid[PACKET] __attribute__((aligned(32)));
    rtcInitIntersectContext(&context);
    packet_of(v, o, inside, dir, count, &r, valid);
    double sum = 0;
    if (v->falloff > 0) {
        rtcIntersect8(valid, t->scene, &context, &r);
        for (int k = 0; k < count; ++k)
            if (r.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID)
                sum += hit_occlusion((double)r.ray.tfar[k], v);
    } else {
        rtcOccluded8(valid, t->scene, &context, &r.ray);
        for (int k = 0; k < count; ++k)
            sum += r.ray.tfar[k] < 0; /* Embree's mark of an occluded ray */
    }
    return sum;
}

static void visibility_rows(const trace *t, const view *v, int strata, bool inside, float *visibility, int row_begin,
                            int row_end) {
    vec3 dir[PACKET];
    origin o;
    for (int y = row_begin; y < row_end; ++y)
        for (int x = 0; x < v->width; ++x) {
            size_t i = (size_t)y * (size_t)v->width + (size_t)x;
            double occluded = 0;
            int n = 0, total = strata * strata;
            bool surface = origin_at(v, x, y, &o);
            for (int s = 0; surface && s < total; ++s) {
                double jitter[2];
                sample_jitter((uint32_t)i, (uint32_t)s, jitter);
                dir[n++] = cosine_direction(o.n, o.a, o.b, (s % strata + jitter[0]) / strata,
                                            (s / strata + jitter[1]) / strata);
                if (n == PACKET || s == total - 1) {
                    occluded += occlusion_of(t, v, &o, inside, dir, n);
                    n = 0;
                }
            }
            visibility[i] = (float)(1 - occluded / total);
        }
}

void trace_each_rows(const trace *t, const view *v, int strata, trace_sink sink, void *user, int row_begin,
                     int row_end) {
    struct RTCIntersectContext context;
    struct RTCRayHit8 r;
    int valid[PACKET] __attribute__((aligned(32)));
    vec3 dir[PACKET];
    origin o;
    rtcInitIntersectContext(&context);
    for (int y = row_begin; y < row_end; ++y)
        for (int x = 0; x < v->width; ++x) {
            size_t i = (size_t)y * (size_t)v->width + (size_t)x;
            int n = 0, total = strata * strata;
            bool surface = origin_at(v, x, y, &o);
            for (int s = 0; surface && s < total; ++s) {
                double jitter[2];
                sample_jitter((uint32_t)i, (uint32_t)s, jitter);
                dir[n++] = cosine_direction(o.n, o.a, o.b, (s % strata + jitter[0]) / strata,
                                            (s / strata + jitter[1]) / strata);
                if (n < PACKET && s < total - 1)
                    continue;
                packet_of(v, &o, false, dir, n, &r, valid);
                rtcOccluded8(valid, t->scene, &context, &r.ray);
                for (int k = 0; k < n; ++k)
                    sink(user, i, dir[k], !(r.ray.tfar[k] < 0));
                n = 0;
            }
        }
}

void trace_visibility_rows(const trace *t, const view *v, int strata, float *visibility, int row_begin, int row_end) {
    visibility_rows(t, v, strata, false, visibility, row_begin, row_end);
}

void trace_visibility_inside_rows(const trace *t, const view *v, int strata, float *visibility, int row_begin,
                                  int row_end) {
    visibility_rows(t, v, strata, true, visibility, row_begin, row_end);
}

void trace_few_rows(const trace *t, const view *v, int rays, float *visibility, int row_begin, int row_end) {
    /* The set is the same for all pixels, so its square roots and angles are tabulated (one turn in azimuth by noise
     * costs one rotation per ray). */
    enum { MOST = 256 };
    double lift[MOST], cosine[MOST], sine[MOST];
    rays = rays < 1 ? 1 : rays > MOST ? MOST : rays;
    for (int s = 0; s < rays; ++s) {
        /* Hammersley points in azimuth order: neighbours in a packet are neighbours in space. */
        double u = radical_inverse((uint32_t)s), azimuth = 2 * V3_PI * (s + 0.5) / rays;
        lift[s] = u + 0.5 / rays, cosine[s] = cos(azimuth), sine[s] = sin(azimuth);
    }
    vec3 dir[PACKET];
    origin o;
    for (int y = row_begin; y < row_end; ++y)
        for (int x = 0; x < v->width; ++x) {
            size_t i = (size_t)y * (size_t)v->width + (size_t)x;
            double occluded = 0;
            int n = 0;
            bool surface = origin_at(v, x, y, &o);
            double noise[2] = {0, 0};
            if (surface)
                pixel_noise(x, y, noise);
            double turn = 2 * V3_PI * noise[0], c = cos(turn), q = sin(turn);
            for (int s = 0; surface && s < rays; ++s) {
                double u = lift[s] + noise[1];
                u -= floor(u);
                double r = sqrt(u), h = sqrt(1 - u);
                double ca = cosine[s] * c - sine[s] * q, sa = sine[s] * c + cosine[s] * q;
                dir[n++] = v3_mad(v3_mad(v3_scale(o.n, h), o.a, r * ca), o.b, r * sa);
                if (n == PACKET || s == rays - 1) {
                    occluded += occlusion_of(t, v, &o, false, dir, n);
                    n = 0;
                }
            }
            visibility[i] = (float)(1 - occluded / rays);
        }
}

void trace_bounce_rows(const trace *t, const view *v, int strata, int bounces, float *escaped, int row_begin,
                       int row_end) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    origin first;
    int total = strata * strata;
    for (int y = row_begin; y < row_end; ++y)
        for (int x = 0; x < v->width; ++x) {
            size_t i = (size_t)y * (size_t)v->width + (size_t)x;
            float *out = escaped + i * (size_t)(bounces + 1);
            memset(out, 0, (size_t)(bounces + 1) * sizeof *out);
            if (!origin_at(v, x, y, &first)) {
                out[0] = 1;
                continue;
            }
            for (int s = 0; s < total; ++s) {
                double j[2];
                sample_jitter((uint32_t)i, (uint32_t)s, j);
                double u = (s % strata + j[0]) / strata, w = (s / strata + j[1]) / strata;
                vec3 n = first.n, p = first.p, a = first.a, b = first.b;
                int k = 0;
                for (;; ++k) {
                    vec3 d = cosine_direction(n, a, b, u, w);
                    struct RTCRayHit r = ray_hit(p, d, (double)v->radius);
                    if (k == bounces)
                        break;
                    rtcIntersect1(t->scene, &context, &r);
                    if (r.hit.geomID == RTC_INVALID_GEOMETRY_ID)
                        break;
                    n = facing_normal(&r, d);
                    v3_frame(n, &a, &b);
                    p = v3_mad(v3_mad(p, d, (double)r.ray.tfar), n, 1e-4 * (double)v->radius + 4e-6 * fabs(p.z));
                    sample_jitter((uint32_t)i, (uint32_t)(s + total * (k + 1)), j);
                    u = j[0], w = j[1];
                }
                out[k] += 1.0f / (float)total;
            }
        }
}
