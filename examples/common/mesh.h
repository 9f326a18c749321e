/* mesh.h - triangle meshes: shapes to build scenes from, smooth normals, Wavefront OBJ.
 *
 * World space: y up, right-handed. Running out of memory ends the program. */
#ifndef EXAMPLES_MESH_H
#define EXAMPLES_MESH_H

#include <stddef.h>

#include "vec.h"

enum { MESH_PARTS = 16, MESH_MATERIALS = 255 };

typedef struct mesh {
    float *positions;     /* x, y, z of each vertex */
    unsigned char *parts; /* of each vertex: what moves together, < MESH_PARTS */
    size_t vertex_count, vertex_capacity;
    unsigned *indices;        /* three per triangle, wound either way */
    unsigned char *materials; /* of each triangle: index into albedo */
    size_t triangle_count, triangle_capacity;
    float *normals; /* of each corner, 3 x 3 floats a triangle; null before mesh_smooth */

    float albedo[MESH_MATERIALS][3]; /* linear, 0..1 */
    int material_count;
    unsigned char part, material; /* of what is added next */
} mesh;

void mesh_free(mesh *m);
void *mesh_grown(void *old, size_t bytes); /* realloc that never returns null */

/* ---- transforms: columns x, y, z are the images of the axes, o that of the origin ---- */

typedef struct mesh_frame {
    vec3 x, y, z, o;
} mesh_frame;

extern const mesh_frame mesh_world;
vec3 mesh_apply(const mesh_frame *f, vec3 p);
mesh_frame mesh_moved(mesh_frame f, double x, double y, double z);
mesh_frame mesh_scaled(mesh_frame f, double x, double y, double z);
mesh_frame mesh_turned_x(mesh_frame f, double degrees);
mesh_frame mesh_turned_y(mesh_frame f, double degrees);
mesh_frame mesh_turned_z(mesh_frame f, double degrees);
mesh_frame mesh_along(mesh_frame f, vec3 a, vec3 b); /* its y axis runs from a to b */

/* ---- shapes ---- */

unsigned char mesh_add_material(mesh *m, float r, float g, float b); /* and makes it the current one */
unsigned mesh_add_vertex(mesh *m, const mesh_frame *f, vec3 p);
void mesh_add_triangle(mesh *m, unsigned a, unsigned b, unsigned c);
void mesh_add_quad(mesh *m, unsigned a, unsigned b, unsigned c, unsigned d);
void mesh_add_box(mesh *m, mesh_frame f, double x0, double y0, double z0, double x1, double y1, double z1);
void mesh_add_block(mesh *m, mesh_frame f, double x, double y, double z, double sx, double sy, double sz);

/* Surface of revolution about y through the (radius, height) pairs of `profile`; flutes > 0 carves that many grooves of
 * relative depth flute_depth between the pairs first_fluted and last_fluted. */
typedef struct mesh_lathe {
    const double (*profile)[2];
    int points, sides, flutes;
    double flute_depth;
    int first_fluted, last_fluted;
} mesh_lathe;

void mesh_add_lathe(mesh *m, mesh_frame f, const mesh_lathe *l);
void mesh_add_revolved(mesh *m, mesh_frame f, const double (*profile)[2], int points, int sides);
void mesh_add_rod(mesh *m, mesh_frame f, vec3 a, vec3 b, double ra, double rb, int sides);
void mesh_add_capsule(mesh *m, mesh_frame f, vec3 a, vec3 b, double ra, double rb, int sides);
void mesh_add_ellipsoid(mesh *m, mesh_frame f, vec3 c, double rx, double ry, double rz, int sides);
void mesh_add_ring(mesh *m, mesh_frame f, double radius, double r, int around, int sides);

/* ---- whole meshes ---- */

/* Normals for the corners that have none: the mean of the faces around the vertex that meet at less than the crease
 * angle, weighted by area. */
void mesh_smooth(mesh *m, double crease_degrees);

void mesh_bounds(const mesh *m, vec3 *lowest, vec3 *highest);

/* Positions, normals, polygons, and the diffuse colours of its materials. On failure returns 0 and leaves one line that
 * names the file in `error`. mesh_smooth comes after it. */
int mesh_read_obj(const char *path, mesh *out, char *error, size_t error_size);

#endif
