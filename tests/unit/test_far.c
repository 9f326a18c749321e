/* The depth chain for far samples: what is near stays as it is, planes stay open, and a far block of 4x4 pixels is as
 * high as its highest pixel, or as their mean. */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "gtao.h"
#include "tests/compute.h"

enum { W = 96, H = 72, N = W * H, TOWER_X = 40, TOWER_Y = 32 };

typedef struct ground {
    gtao_desc desc;
    float height[N], normals[3 * N];
} ground;

/* A height map of one unit a pixel, flat but for a tower of h, `size` pixels wide, in one block. */
static void ground_make(ground *g, int size, float h) {
    memset(g, 0, sizeof *g);
    for (int i = 0; i < N; i++) {
        int x = i % W - TOWER_X, y = i / W - TOWER_Y;
        g->height[i] = x >= 0 && x < size && y >= 0 && y < size ? h : 0;
        g->normals[3 * i + 2] = -1;
    }
    g->desc.width = W, g->desc.height = H;
    g->desc.depth = g->height, g->desc.depth_kind = GTAO_DEPTH_HEIGHT;
    g->desc.normals = g->normals;
    g->desc.camera.projection = GTAO_ORTHOGRAPHIC;
    g->desc.camera.sx = 1;
    g->desc.radius = 1000;
    g->desc.max_radius_px = 48;
    g->desc.slices = 16, g->desc.steps = 48;
    g->desc.far_px = 8;
}

static void compute(const gtao_desc *desc, float *visibility) {
    gtao_output output = {0};
    output.visibility = visibility;
    assert_int_equal(compute_output(desc, &output), GTAO_OK);
}

/* Largest difference over pixels that see the block by far samples only; *most: the largest occlusion there. */
static float difference(const float *a, const float *b, float *most) {
    float worst = 0;
    *most = 0;
    for (int i = 0; i < N; i++) {
        int x = i % W - TOWER_X, y = i / W - TOWER_Y, dx = x < 0 ? -x : x - 3, dy = y < 0 ? -y : y - 3;
        if (dx < 12 && dy < 12)
            continue;
        worst = fmaxf(worst, fabsf(a[i] - b[i]));
        *most = fmaxf(*most, 1 - a[i]);
    }
    return worst;
}

static void nearest_is_the_highest_pixel(void **state) {
    static ground g;
    static float exact[N], block[N], pixel[N];
    float most;
    (void)state;
    ground_make(&g, 4, 20);
    compute(&g.desc, exact);
    g.desc.far_depth = GTAO_FAR_NEAREST;
    compute(&g.desc, block);
    /* A sample anywhere in the block stands in its middle, at most 2.1 of at least 12 pixels off. */
    assert_true(difference(exact, block, &most) < 0.15f * most && most > 0.02f);
    assert_true(difference(exact, block, &most) > 0);
    ground_make(&g, 1, 20);
    g.desc.far_depth = GTAO_FAR_NEAREST;
    compute(&g.desc, pixel);
    assert_true(difference(block, pixel, &most) == 0);
}

static void average_is_the_mean(void **state) {
    static ground g;
    static float block[N], pixel[N];
    float most;
    (void)state;
    ground_make(&g, 4, 320.0f / 16);
    g.desc.far_depth = GTAO_FAR_NEAREST;
    compute(&g.desc, block);
    ground_make(&g, 1, 320);
    g.desc.radius = 1e6f; /* which the tower is not to be measured by */
    g.desc.far_depth = GTAO_FAR_AVERAGE;
    compute(&g.desc, pixel);
    assert_true(difference(block, pixel, &most) < 0.01f * most && most > 0.02f);
    g.desc.radius = 100; /* it stands more than 3/4 of that before the ground: left out */
    compute(&g.desc, pixel);
    assert_true(difference(pixel, block, &most) > 0.02f && most == 0);
}

static void near_samples_stay(void **state) {
    static ground g;
    static float exact[N], v[N];
    (void)state;
    for (int kind = GTAO_FAR_NEAREST; kind <= GTAO_FAR_AVERAGE; kind++) {
        ground_make(&g, 3, 20);
        compute(&g.desc, exact);
        g.desc.far_depth = (gtao_far)kind;
        g.desc.far_px = 60;
        compute(&g.desc, v);
        assert_memory_equal(exact, v, sizeof v);
        g.desc.far_px = 40;
        compute(&g.desc, v);
        assert_true(memcmp(exact, v, sizeof v) != 0);
    }
}

/* Tilted, in perspective, and odd sizes: what the border leaves of a block holds nothing. */
static void planes_stay_open(void **state) {
    static float depth[N], normals[3 * N], v[N], exact[N];
    (void)state;
    for (int tilt = 0; tilt < 6; tilt++)
        for (int kind = GTAO_FAR_NEAREST; kind <= GTAO_FAR_AVERAGE; kind++) {
            static const float normal[3][3] = {{0, 0, -1}, {0.3f, -0.6f, -0.741619848f}, {-0.8f, 0.1f, -0.591607978f}};
            const float *n = normal[tilt % 3];
            int odd = tilt >= 3, width = W - 3 * odd, height = H - 2 * odd;
            gtao_desc d = {0};
            for (int i = 0; i < width * height; i++) {
                float rx = ((float)(i % width) + 0.5f - 0.5f * (float)width) / 150,
                      ry = ((float)(i / width) + 0.5f - 0.5f * (float)height) / 150;
                depth[i] = 4 * n[2] / (n[0] * rx + n[1] * ry + n[2]);
                memcpy(normals + 3 * i, n, 3 * sizeof *n);
            }
            d.width = width, d.height = height;
            d.depth = depth, d.normals = normals;
            d.camera.fx = 150;
            d.radius = 1.5f;
            d.slices = 4, d.steps = 24;
            d.far_depth = (gtao_far)kind, d.far_px = 8;
            compute(&d, v);
            for (int i = 0; i < width * height; i++)
                if (v[i] != 1)
                    fail_msg("tilt %d, kind %d, (%d, %d): %.8g", tilt, kind, i % width, i / width, (double)v[i]);
            for (int i = 30; i < 34; i++) /* something to see */
                depth[40 * width + i] *= 0.8f;
            compute(&d, v);
            d.far_depth = GTAO_FAR_EXACT;
            compute(&d, exact);
            assert_true(memcmp(exact, v, sizeof v) != 0);
        }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nearest_is_the_highest_pixel),
        cmocka_unit_test(average_is_the_mean),
        cmocka_unit_test(near_samples_stay),
        cmocka_unit_test(planes_stay_open),
    };
    return cmocka_run_group_tests_name("far", tests, NULL, NULL);
}
