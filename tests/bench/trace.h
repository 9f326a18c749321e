/* Ray-traced ground truth through Embree 3. Everything in view space, so a pixel's point is z r as in view.h. */
#ifndef BENCH_TRACE_H
#define BENCH_TRACE_H

#include "scenes.h"
#include "view.h"

typedef struct trace trace;

/* Null (and a printed reason) if Embree fails. */
trace *trace_open(const bench_scene *s);
trace *trace_open_hits(const bench_scene *s); /* for trace_hits too, which costs the others a little */
void trace_close(trace *t);

/* Depth and geometric normal at the pixel centres of rows [row_begin, row_end). Faces are two-sided; the normal is the
 * one towards the eye. Sky: z = VIEW_SKY, normal towards the eye. */
void trace_primary_rows(const trace *t, const bench_scene_camera *camera, float *z, float *normals, int row_begin,
                        int row_end);

/* Visibility by `strata` x `strata` rays a pixel, cosine-distributed about the normal and of length R = v->radius. A hit
 * at distance d occludes by saturate((R - d) / (f R)), f = v->falloff; f = 0: by 1. This weights each ray by its own
 * hit, while [J16]'s attenuation weights a sample's horizon and so everything below it: the two agree for f = 0 and
 * differ by up to about f / 2 of the occlusion otherwise. */
void trace_visibility_rows(const trace *t, const view *v, int strata, float *visibility, int row_begin, int row_end);

/* The same rays, hard cutoff, one by one: `sink` learns of each pixel's directions whether they are visible. Sky: none. */
typedef void (*trace_sink)(void *user, size_t pixel, vec3 direction, bool visible);
void trace_each_rows(const trace *t, const view *v, int strata, trace_sink sink, void *user, int row_begin,
                     int row_end);

/* The same without the geometry outside the pyramid that the image shows, which no number of depth layers holds: a hit
 * counts if it projects into the image. (The pyramid is convex, so a ray that has left it does not come back.) */
void trace_visibility_inside_rows(const trace *t, const view *v, int strata, float *visibility, int row_begin,
                                  int row_end);

/* As a renderer would do it: `rays` a pixel (a power of two up to 256), a low-discrepancy set rotated per pixel by
 * noise. Falloff as above. */
void trace_few_rows(const trace *t, const view *v, int rays, float *visibility, int row_begin, int row_end);

/* Light of a white dome after diffuse reflections among surfaces within the radius of one another:
 * L = mean over cosine-distributed rays of (miss ? 1 : albedo * L at the hit). A path that escapes after k hits carries
 * albedo^k, so the light at every albedo is the polynomial sum_k escaped[k] albedo^k. Per pixel bounces + 1 shares, of
 * which escaped[0] is the visibility; the last one holds all paths with `bounces` hits or more. */
void trace_bounce_rows(const trace *t, const view *v, int strata, int bounces, float *escaped, int row_begin,
                       int row_end);

/* The nearest `most` hits of a ray nearer than VIEW_SKY, in order; distance in lengths of the direction. */
typedef struct trace_hit {
    float distance;
    unsigned triangle;
} trace_hit;
int trace_hits(const trace *t, vec3 origin, vec3 direction, trace_hit *hits, int most);

#endif
