/* Independent references for the tests, written from the definitions in double and long double (memo.c: a float
 * transcription). They share no code with gtao.h: not its functions, not its approximations, not its height buffer. */
#ifndef GTAO_TESTS_REFERENCE_H
#define GTAO_TESTS_REFERENCE_H

#define REF_PI 3.14159265358979323846

/* ---- quadrature.c: the integrals over a slice, by definition ---------------------------------------------------- */

/* Angles in radians from the view vector, signed; the slice's direction o is at +pi/2, the view vector v at 0. */

/* Nodes and weights on [-1, 1]. */
void ref_gauss_legendre(int count, long double *node, long double *weight);

/* Integral of cos(theta - n) |sin(theta)| between 0 and h. */
long double ref_arc(long double h_rad, long double n_rad);
/* Integral of |sin(theta)| between 0 and h. */
long double ref_arc_uniform(long double h_rad);
/* Integral of cos(theta - n) |sin(theta)| (sin(theta), cos(theta)) from h0 to h1: components along o and v. */
void ref_arc_bent(long double h0_rad, long double h1_rad, long double n_rad, long double t[2]);
/* Real spherical harmonic of the unit vector d: index l (l + 1) + m, l <= 2. */
long double ref_sh(int index, const long double d[3]);
/* Integral of cos(theta - n) |sin(theta)| Y_i(sin(theta) o + cos(theta) v) from h0 to h1, uniform: without the cosine. */
void ref_arc_sh(long double h0_rad, long double h1_rad, long double n_rad, int uniform, const double o[3],
                const double v[3], double sh[9]);

/* ---- scenes.c: images with exact depth and normals --------------------------------------------------------------- */

typedef enum ref_border { REF_BORDER_OPEN, REF_BORDER_CLAMP, REF_BORDER_WRAP } ref_border;

/* View space is x right, y down, z forward; pixel (x, y) has its centre at (x + 0.5, y + 0.5). */
typedef struct ref_image {
    int width, height;
    int orthographic;
    double fx, fy, cx, cy; /* perspective, pixels: P = z ((x - cx) / fx, (y - cy) / fy, 1) */
    double sx, sy;         /* orthographic, world units per pixel: P = (x sx, y sy, z) */
    float *z;              /* planar depth; sky where not finite, and in perspective where <= 0 */
    float *normals;        /* 3 a pixel, towards the viewer */
} ref_image;

/* Square pixels, centred; all sky. Release with ref_image_free. */
ref_image ref_image_perspective(int width, int height, double fov_y_degrees);
ref_image ref_image_orthographic(int width, int height, double pixel_size);
void ref_image_free(ref_image *image);

/* What a ray hits. distance is in units of the direction's length; normals need not face the ray. */
typedef struct ref_hit {
    double distance;
    double normal[3];
} ref_hit;

typedef struct ref_shape {
    enum { REF_PLANE, REF_SPHERE, REF_BOX, REF_CYLINDER, REF_CONE } kind;
    double center[3]; /* a point of the plane, the apex of the cone, the centre otherwise */
    double axis[3]; /* plane: normal; box: half extents; cylinder: unit direction; cone: opens to this unit direction */
    double radius;  /* sphere, cylinder; cone: tangent of its wall's elevation */
    double length;  /* cylinder: half length, without caps */
} ref_shape;

/* Nearest hit with distance > 0, or 0. */
int ref_trace(const ref_shape *shapes, int count, const double origin[3], const double direction[3], ref_hit *hit);

/* The camera in the scene's space; a rotation. */
typedef struct ref_pose {
    double eye[3];
    double right[3], down[3], forward[3];
} ref_pose;

ref_pose ref_pose_look(const double eye[3], const double target[3], const double up[3]);

/* Depth and normals at the pixel centres. pose may be null: the scene is in view space. */
void ref_render(ref_image *image, const ref_pose *pose, const ref_shape *shapes, int count);

/* Room with spheres, boxes and thin rods in front of the identity pose: number of shapes, 0 if there is no room. */
int ref_cluttered_scene(ref_shape *shapes, int capacity);

/* ---- heightfield.c: brute force ------------------------------------------------------------------------------------ */

typedef struct ref_settings {
    double radius;  /* world units */
    double falloff; /* fraction of the radius over which occlusion fades out, 0: hard cutoff */
    int slices;
    const double *angles; /* `slices` screen angles, or null for pi (k + 1/2) / slices */
    double step_px;       /* distance between samples along the screen line */
    ref_border border;
    int uniform; /* nonzero: uniform weighting instead of cosine */
} ref_settings;

/* Visibility and unit bent normal of one pixel by marching the image as a height field. `bent` may be null. */
double ref_heightfield(const ref_image *image, const ref_settings *settings, int x, int y, double bent[3]);

/* The surface that the image shows on the screen line through (u, v) along (du, dv), at or beside that point: in view
 * space; 0 if there is none. */
int ref_surface_at(const ref_image *image, ref_border border, double u, double v, double du, double dv,
                   double position[3]);

/* Does a march from the surface point `center` have nothing more to find from (u, v) on, (along_u, along_v) pixels from
 * where it began: past an open border, far outside, or out of the radius? */
int ref_march_ends(const ref_image *image, const ref_settings *settings, const double center[3], double u, double v,
                   double along_u, double along_v);

/* A slice of a pixel. Angles are signed, from the view vector, positive towards o. */
typedef struct ref_slice {
    double du, dv;    /* screen direction */
    double view[3];   /* unit vector to the eye */
    double o[3];      /* unit, perpendicular to it, along (du, dv) */
    double azimuth;   /* d(azimuth around the view vector) / d(screen angle) */
    double projected; /* length of the unit normal projected to the slice, */
    double n;         /* and its angle */
} ref_slice;
ref_slice ref_slice_at(const ref_image *image, const ref_settings *settings, const double position[3],
                       const double normal[3], int k);

/* Antiderivatives of cos(theta - n) sin(theta) times 1, sin(theta) and cos(theta), zero at theta = 0. */
double ref_arc_integral(double theta, double n);
double ref_arc_integral_o(double theta, double n);
double ref_arc_integral_v(double theta, double n);

/* ---- arcs.c: occluders with a front and a back ---------------------------------------------------------------------- */

/* One depth layer: where view rays through the pixel centres enter something, and where they leave it. Planar z; no
 * occluder where `front` is sky (as in ref_image). */
typedef struct ref_layer {
    const float *front; /* null: the image's own z */
    const float *back;  /* null: no backs here, thickness instead; where it is sky or before the front: the front */
} ref_layer;

typedef struct ref_slabs {
    double thickness;           /* along the view ray, world units; HUGE_VAL: endless, the height field */
    const float *thickness_map; /* null, or one for every pixel, instead; inf: endless */
    const ref_layer *layers;    /* null: one, the image's z without a back */
    int layer_count;
    double
        surface_px; /* Neighbours on the screen line are one surface where their depths differ by no more than so many
                        * pixel footprints, or, for the image's own z, where a tangent plane of either leads to the
                        * other (heightfield.c's rule). One surface has no gap between samples. < 0: gaps everywhere. */
    int whole; /* nonzero: a slab counts as a whole, and does if its front is within the radius. 0: the part of it that
                * is within the radius; endless slabs are always whole */
} ref_slabs;

/* Visibility and unit bent normal (may be null) of one pixel: per side of each slice the union of the arcs that slabs
 * hide, sorted and merged, and the exact integral over what is left. Cosine weighting only. With a falloff an arc
 * shrinks towards its lower end (the tangent plane at most), in cosines, by the weight of the slab's nearest point. */
double ref_arcs(const ref_image *image, const ref_settings *settings, const ref_slabs *slabs, int x, int y,
                double bent[3]);
/* Spherical harmonics of what is visible there times the cosine, over pi. Not of sky. */
void ref_arcs_sh(const ref_image *image, const ref_settings *settings, const ref_slabs *slabs, int x, int y,
                 double sh[9]);

/* ---- memo.c: [J19] Algorithm 1, straight and scalar ---------------------------------------------------------------- */

typedef struct memo_settings {
    int slices, steps; /* directions a pixel, samples on each side of one */
    float radius;      /* world units */
    float falloff;     /* [J16] conservative attenuation: fraction of the radius over which samples fade */
    int max_radius_px; /* cap of the search */
} memo_settings;

/* [J16] noise of a 4x4 tile, index 4 (y & 3) + (x & 3): slice direction and sample offset, both in [0, 1). */
void memo_noise(unsigned frame, float direction[16], float offset[16]);

/* Visibility of a perspective image with square pixels: z and normals (3 a pixel) in view space, sky where z <= 0 or
 * not finite. All buffers are tightly packed. */
void memo_gtao(int width, int height, const float *z, const float *normals, float focal_px, float cx, float cy,
               const memo_settings *settings, const float direction[16], const float offset[16], float *visibility);

/* ---- specular.c: specular visibility by its definitions ------------------------------------------------------------ */

/* Solid angle common to two caps of half angles a and b whose axes are d apart: quadrature over the circles of one. */
long double ref_cap_intersection(long double a, long double b, long double d);

typedef struct ref_lobe {
    enum { REF_GGX, REF_BECKMANN, REF_BLINN, REF_PHONG, REF_BRDF } kind;
    double alpha;
    double f0;         /* REF_BRDF */
    double n[3], v[3]; /* unit */
} ref_lobe;

/* D(h) n.l or (R.l)^p n.l, not normalised for Phong; REF_BRDF: GGX, height-correlated Smith, Schlick, times n.l. */
double ref_lobe_value(const ref_lobe *lobe, const double l[3]);
/* Its integral over the cone of unit axis b and half angle a (a = pi: all directions). */
double ref_lobe_integral(const ref_lobe *lobe, const double b[3], double a);

#endif
