/* raster3d.h - a software rasteriser of triangle meshes into what a deferred renderer keeps of a frame: depth, normals,
 * albedo and motion.
 *
 * View space is gtao.h's: x right, y down, z forward; pixel (x, y) has its centre at (x + 0.5, y + 0.5). Triangles are
 * seen from both sides. Edges shared by two triangles leave no gap and draw no pixel twice; the result does not depend
 * on the number of threads. */
#ifndef EXAMPLES_RASTER3D_H
#define EXAMPLES_RASTER3D_H

#include "mesh.h"
#include "pool.h"

/* Row-major 3x4 matrix: [rotation | translation]. */
typedef struct raster_pose {
    double m[12];
} raster_pose;

raster_pose raster_identity(void);
raster_pose raster_look_at(vec3 eye, vec3 target);                      /* world to view; up is +y */
raster_pose raster_of_frame(const mesh_frame *f);                       /* part to world */
raster_pose raster_compose(const raster_pose *a, const raster_pose *b); /* a after b */
raster_pose raster_inverse(const raster_pose *rigid);

typedef struct raster_view {
    int width, height;
    double focal_px, cx, cy;                         /* pixels */
    double near_z;                                   /* nothing nearer is drawn; > 0 */
    raster_pose world_to_view, world_to_view_before; /* now, and in the previous frame */
    raster_pose part_to_world[MESH_PARTS], part_to_world_before[MESH_PARTS];
} raster_view;

/* Tightly packed; any but depth may be null. Where there is no surface: depth infinite, normal and albedo 0. */
typedef struct raster_buffers {
    float *depth;   /* planar z */
    float *normals; /* 3 floats: unit, view space, facing the eye */
    float *albedo;  /* 3 floats */
    float *motion;  /* 3 floats: from the pixel to where its surface was in the previous frame, in pixels, and the depth
                     * there minus the depth now; infinite if that was behind the eye */
} raster_buffers;

/* A centred camera; everything in its place, at rest. */
raster_view raster_view_of(int width, int height, double fov_y_degrees, double near_z);
/* The next frame: what is now was before. */
void raster_view_advance(raster_view *view);

typedef struct raster raster;

/* `m` needs normals and stays as it is as long as the rasteriser lives. Null if there is no memory. */
raster *raster_create(const mesh *m, int width, int height);
void raster_free(raster *r); /* null is harmless */

/* Which triangle each pixel sees, then what it looks like there; draw before shade. raster_draw returns 0 if there is no
 * memory. */
int raster_draw(raster *r, const raster_view *view, pool *workers);
void raster_shade(raster *r, const raster_buffers *out, pool *workers);

#endif
