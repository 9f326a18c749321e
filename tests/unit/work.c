/* work - one of five standard settings on a small scene, for tests/instructions.sh to count the instructions of.
 *
 *     work N      setting N, 0 .. 4; prints its name and the number of pixels
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define GTAO_IMPLEMENTATION
#include "gtao.h"

enum { WIDTH = 320, HEIGHT = 180 };

static float depth[WIDTH * HEIGHT], normals[3 * WIDTH * HEIGHT], visibility[WIDTH * HEIGHT], bent[3 * WIDTH * HEIGHT];

static void hit(size_t i, float z, float nx, float ny, float nz) {
    if (z > 0.0f && z < depth[i]) {
        depth[i] = z;
        normals[3 * i] = nx, normals[3 * i + 1] = ny, normals[3 * i + 2] = nz;
    }
}

/* A floor, a wall that ends below the sky, and 24 balls. */
static void scene(void) {
    for (int y = 0; y < HEIGHT; ++y)
        for (int x = 0; x < WIDTH; ++x) {
            size_t i = (size_t)(y * WIDTH + x);
            float rx = ((float)x + 0.5f - 160.0f) / 200.0f, ry = ((float)y + 0.5f - 90.0f) / 200.0f;
            depth[i] = HUGE_VALF;
            hit(i, ry > 0.0f ? 1.0f / ry : 0.0f, 0.0f, -1.0f, 0.0f);
            if (8.0f * ry > -1.5f)
                hit(i, 8.0f, 0.0f, 0.0f, -1.0f);
            for (int k = 0; k < 24; ++k) {
                float cx = (float)(k % 6) - 2.5f, cy = 0.6f - 0.25f * (float)(k % 4), cz = 3.0f + 0.9f * (float)(k / 5);
                float r = 0.25f + 0.05f * (float)(k % 5), a = rx * rx + ry * ry + 1.0f, b = rx * cx + ry * cy + cz;
                float d = b * b - a * (cx * cx + cy * cy + cz * cz - r * r), z;
                if (d < 0.0f)
                    continue;
                z = (b - sqrtf(d)) / a;
                hit(i, z, (z * rx - cx) / r, (z * ry - cy) / r, (z - cz) / r);
            }
        }
}

int main(int argc, char **argv) {
    static const char *const names[] = {"1 slice x 8 steps, falloff 0.25", "2 x 12, falloff 0.25, bent normals",
                                        "4 x 16, hard cutoff", "4 slices of every pixel, falloff 0.25",
                                        "2 x 12, thickness 0.3"};
    int n = argc == 2 ? atoi(argv[1]) : -1;
    gtao_desc d;
    gtao_output o;
    if (n < 0 || n >= (int)(sizeof names / sizeof *names)) {
        fprintf(stderr, "usage: work 0..4\n");
        return 2;
    }
    scene();
    memset(&d, 0, sizeof d);
    memset(&o, 0, sizeof o);
    d.width = WIDTH, d.height = HEIGHT;
    d.depth = depth, d.normals = normals;
    d.camera.fx = 200.0f;
    d.radius = 1.0f;
    d.falloff = n == 2 ? 0.0f : 0.25f;
    d.slices = n == 0 ? 1 : n == 1 || n == 4 ? 2 : 4;
    d.steps = n == 0 ? 8 : n == 2 ? 16 : 12;
    d.every_pixel = n == 3;
    d.thickness = n == 4 ? 0.3f : 0.0f;
    d.isa = GTAO_ISA_AVX2;
    o.visibility = visibility;
    o.bent_normals = n == 1 ? bent : NULL;
    size_t size = gtao_scratch_size(&d);
    void *scratch = malloc(size);
    gtao_result r = scratch ? gtao_compute(&d, &o, scratch, size, NULL) : GTAO_ERROR_SCRATCH;
    free(scratch);
    if (r != GTAO_OK) {
        fprintf(stderr, "work: %s\n", gtao_result_string(r));
        return 1;
    }
    printf("%d %s\n", WIDTH * HEIGHT, names[n]);
    return 0;
}
