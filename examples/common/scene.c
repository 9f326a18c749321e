/* scene.c - see scene.h */
#include "scene.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SCENE_SKY_Z 1e9f /* renderers write 1e10 where there is nothing */

/* `count` numbers after "key":, brackets between them skipped. Enough for files of our own. */
static int json_numbers(const char *text, const char *key, int count, float *numbers) {
    char quoted[64];
    snprintf(quoted, sizeof quoted, "\"%s\"", key);
    const char *at = strstr(text, quoted);
    if (!at)
        return 0;
    at += strlen(quoted);
    for (int i = 0; i < count; ++i) {
        at += strspn(at, " \t\r\n:,[]");
        char *end;
        numbers[i] = (float)strtod(at, &end);
        if (end == at)
            return 0;
        at = end;
    }
    return 1;
}

static int read_camera(const char *path, scene *s, image_error *error) {
    char text[8192];
    FILE *file = fopen(path, "rb");
    if (!file) {
        snprintf(error->text, sizeof error->text, "%.400s: cannot be read", path);
        return 0;
    }
    size_t n = fread(text, 1, sizeof text - 1, file);
    fclose(file);
    text[n] = 0;
    float rays = 0.0f;
    if (json_numbers(text, "rays_per_pixel", 1, &rays) && rays > 0.0f && rays < 1e9f)
        s->rays_per_pixel = (int)rays;
    static const char *const keys[] = {"focal_px", "ao_distance", "world_to_view_rows_right_up_back"};
    float *const targets[] = {&s->focal_px, &s->ao_distance, s->world_to_view};
    static const int counts[] = {1, 1, 9};
    for (int i = 0; i < 3; ++i)
        if (!json_numbers(text, keys[i], counts[i], targets[i])) {
            snprintf(error->text, sizeof error->text, "%.400s: %s missing", path, keys[i]);
            return 0;
        }
    return 1;
}

int scene_read(const char *exr_path, const char *json_path, scene *out, image_error *error) {
    static const char *const truth[] = {"AO.R"};
    char beside[4096];
    memset(out, 0, sizeof *out);
    if (!json_path) {
        size_t n = strlen(exr_path);
        n = n > 4 ? n - 4 : n;
        if (n + 6 > sizeof beside) {
            snprintf(error->text, sizeof error->text, "%.400s: name too long", exr_path);
            return 0;
        }
        memcpy(beside, exr_path, n);
        memcpy(beside + n, ".json", 6);
        json_path = beside;
    }
    int ok = image_read_depth(exr_path, &out->depth, error) && image_read_normals(exr_path, &out->normals, error) &&
             image_read_channels(exr_path, truth, 1, &out->truth, error) && read_camera(json_path, out, error);
    if (ok && (out->normals.width != out->depth.width || out->normals.height != out->depth.height ||
               out->truth.width != out->depth.width || out->truth.height != out->depth.height)) {
        snprintf(error->text, sizeof error->text, "%.400s: depth, normals and AO differ in size", exr_path);
        ok = 0;
    }
    if (!ok)
        scene_free(out);
    return ok;
}

void scene_free(scene *s) {
    image_free(&s->depth);
    image_free(&s->normals);
    image_free(&s->truth);
}

void scene_describe(const scene *s, gtao_desc *desc) {
    memset(desc, 0, sizeof *desc);
    desc->width = s->depth.width;
    desc->height = s->depth.height;
    desc->depth = s->depth.data;
    desc->sky_z = SCENE_SKY_Z;
    desc->normals = s->normals.data;
    memcpy(desc->normal_to_view, s->world_to_view, sizeof desc->normal_to_view);
    desc->normal_axes[0] = 1.0f; /* right, up, back -> right, down, forward */
    desc->normal_axes[1] = desc->normal_axes[2] = -1.0f;
    desc->camera.fx = s->focal_px;
    desc->radius = s->ao_distance;
}

int scene_visible(const scene *s, size_t pixel) {
    float z = s->depth.data[pixel];
    return z > 0.0f && z < SCENE_SKY_Z;
}
