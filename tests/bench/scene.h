/* Test scenes of different character as triangle soups: procedural, deterministic, no files but one height map.
 * World space: y up, right-handed. View space is the library's: x right, y down, z forward. */
#ifndef BENCH_SCENE_H
#define BENCH_SCENE_H

#include <stdbool.h>
#include <stddef.h>

#include "vec.h"

typedef struct scene_mesh {
    float *positions; /* x, y, z of each vertex, world space */
    size_t vertex_count, vertex_capacity;
    unsigned *indices; /* three per triangle */
    size_t triangle_count, triangle_capacity;
} scene_mesh;

/* Pixel (x, y) looks along right (x + 0.5 - cx) / focal_px + down (y + 0.5 - cy) / focal_px + forward. */
typedef struct scene_camera {
    vec3 eye, right, down, forward;
    double focal_px, cx, cy;
    int width, height;
} scene_camera;

typedef struct scene {
    const char *name, *title;
    scene_mesh mesh;
    scene_camera camera;
    double radius; /* reach of the occlusion, world units */
} scene;

int scene_count(void);
const char *scene_name(int index);

/* Scene `index` seen by an image of width x height pixels. Needs the repository root as working directory (the terrain
 * reads tests/data/jacksboro.pfm). Prints the reason and returns false if that fails. */
bool scene_build(scene *out, int index, int width, int height);
void scene_free(scene *s);

#endif
