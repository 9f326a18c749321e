/* Test scenes of different character as triangle soups: procedural, deterministic, no files but one height map.
 * World space: y up, right-handed. View space is the library's: x right, y down, z forward. */
#ifndef BENCH_SCENES_H
#define BENCH_SCENES_H

#include <stdbool.h>
#include <stddef.h>

#include "mesh.h"

/* Pixel (x, y) looks along right (x + 0.5 - cx) / focal_px + down (y + 0.5 - cy) / focal_px + forward. */
typedef struct bench_scene_camera {
    vec3 eye, right, down, forward;
    double focal_px, cx, cy;
    int width, height;
} bench_scene_camera;

typedef struct bench_scene {
    const char *name, *title;
    mesh mesh;
    bench_scene_camera camera;
    double radius; /* reach of the occlusion, world units */
} bench_scene;

int bench_scene_count(void);
const char *bench_scene_name(int index);
/* Whether a command line's scene names, none meaning all, include scene `index`; whether all of them exist, which prints
 * the first that does not. */
int bench_scene_chosen(int index, int count, char *const *names);
int bench_scenes_exist(const char *program, int count, char *const *names);

/* Scene `index` seen by an image of width x height pixels. Needs the repository root as working directory (the terrain
 * reads tests/data/jacksboro.pfm). Prints the reason and returns false if that fails. */
bool bench_scene_build(bench_scene *out, int index, int width, int height);
/* Three more, not counted above. To look at what is behind things: "bar", a thin bar in front of a plain wall, and
 * "elephant", an animal in front of one; "village", houses on flat ground under half a sky, of which most can be skipped.
 * False if there is no such study. */
bool bench_study_build(bench_scene *out, const char *name, int width, int height);
/* focal_widths: focal length in image widths, so that the field of view does not depend on the resolution. */
void bench_scene_look_at(bench_scene *s, vec3 eye, vec3 target, double focal_widths, int width, int height);
void bench_scene_free(bench_scene *s);

#endif
