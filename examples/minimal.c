/* A depth buffer in, visibility out:  build/minimal > visibility.pgm */
#define GTAO_IMPLEMENTATION
#include "gtao.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { WIDTH = 640, HEIGHT = 480 };

int main(void) {
    static float depth[WIDTH * HEIGHT];
    static unsigned char visibility[WIDTH * HEIGHT];
    gtao_desc desc = {0};
    gtao_output output = {0};
    desc.width = WIDTH;
    desc.height = HEIGHT;
    desc.depth = depth;
    desc.camera = gtao_camera_from_fov(45.0f, WIDTH, HEIGHT);
    desc.radius = 1.5f; /* world units */
    desc.preset = GTAO_PRESET_ULTRA;
    output.visibility = visibility;
    output.visibility_format = GTAO_FORMAT_UNORM8;

    for (int i = 0; i < WIDTH * HEIGHT; ++i) { /* your renderer's z; here a ball on a floor */
        float x = ((float)(i % WIDTH) + 0.5f - 0.5f * WIDTH) / desc.camera.fx;
        float y = ((float)(i / WIDTH) + 0.5f - 0.5f * HEIGHT) / desc.camera.fy;
        float rr = x * x + y * y + 1.0f, rc = 0.2f * y + 4.0f, disc = rc * rc - rr * (0.04f + 16.0f - 0.64f);
        depth[i] = disc > 0.0f ? (rc - sqrtf(disc)) / rr : 1.0f / y; /* above the horizon z <= 0: sky */
    }

    size_t size = gtao_scratch_size(&desc);
    gtao_result result = gtao_compute(&desc, &output, malloc(size), size, NULL);
    if (result != GTAO_OK)
        return fprintf(stderr, "%s\n", gtao_result_string(result)), 1;
    printf("P5 %d %d 255\n", WIDTH, HEIGHT);
    return fwrite(visibility, 1, sizeof visibility, stdout) != sizeof visibility;
}
