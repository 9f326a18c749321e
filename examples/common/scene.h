/* scene.h - a rendered scene: depth, normals and ray-traced visibility in one EXR, its camera in a JSON beside it. */
#ifndef EXAMPLES_SCENE_H
#define EXAMPLES_SCENE_H

#include "gtao.h"
#include "image.h"

typedef struct scene {
    image depth;   /* planar z, sky 1e10 */
    image normals; /* world space */
    image truth;   /* ray-traced visibility, cosine-weighted, hard cutoff at ao_distance */
    float focal_px, ao_distance;
    int rays_per_pixel;     /* of the truth; 0 if not stated */
    float world_to_view[9]; /* rows right, up, back */
} scene;

/* `json_path` null: the EXR's name with .json. */
int scene_read(const char *exr_path, const char *json_path, scene *out, image_error *error);
void scene_free(scene *s);

/* Input, camera, and the truth's radius and cutoff; the rest keeps its defaults. */
void scene_describe(const scene *s, gtao_desc *desc);

/* False for sky: no surface, so nothing to compare. */
int scene_visible(const scene *s, size_t pixel);

#endif
