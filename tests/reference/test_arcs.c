/* Occluders with thickness: gtao.h against brute force with sorted intervals, closed forms, ray tracing, and the height
 * field that it must become again when thickness is endless. */
#include "tests/reference/library.h"

/* ---- helpers ---- */

static gtao_desc desc_of(const ref_image *img) {
    gtao_desc desc = describe_image(img);
    desc.noise = GTAO_NOISE_NONE;
    desc.preset = GTAO_PRESET_REFERENCE;
    return desc;
}

static ref_image cluttered(int width, int height, int orthographic) {
    static const double eye[3] = {-1.0, -2.5, -1.0}, target[3] = {0.0, 0.8, 3.5}, up[3] = {0.0, -1.0, 0.0};
    ref_shape shapes[32];
    const int count = ref_cluttered_scene(shapes, 32);
    ref_image img;
    if (orthographic) {
        ref_pose pose = ref_pose_look(eye, target, up);
        img = ref_image_orthographic(width, height, 4.5 / width);
        for (int i = 0; i < 3; i++)
            pose.eye[i] -= 2.2 * pose.right[i] + 1.5 * pose.down[i] + 2.0 * pose.forward[i];
        ref_render(&img, &pose, shapes, count);
    } else {
        img = ref_image_perspective(width, height, 60.0);
        ref_render(&img, NULL, shapes, count);
    }
    return img;
}

typedef struct difference {
    double rmse, mean, worst, bent_95;
    int pixels;
} difference;

static int compare_doubles(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static difference to_brute_force(const gtao_desc *desc, const ref_image *img, const ref_slabs *slabs,
                                 const ref_settings *settings, int stride) {
    result r = compute(desc);
    difference d = {0};
    double *degrees = allocate((size_t)(img->width * img->height) * sizeof *degrees);
    for (int y = stride / 2; y < img->height; y += stride) {
        for (int x = stride / 2; x < img->width; x += stride) {
            const size_t at = (size_t)(y * img->width + x);
            double bent[3];
            if (!isfinite(img->z[at]))
                continue;
            const double off = (double)r.visibility[at] - ref_arcs(img, settings, slabs, x, y, bent);
            d.rmse += off * off;
            d.mean += off;
            d.worst = fmax(d.worst, fabs(off));
            degrees[d.pixels++] = degrees_between(&r.bent[3 * at], bent);
        }
    }
    CHECK(d.pixels > 200, "only %d pixels", d.pixels);
    d.rmse = sqrt(d.rmse / d.pixels), d.mean /= d.pixels;
    qsort(degrees, (size_t)d.pixels, sizeof *degrees, compare_doubles);
    d.bent_95 = degrees[d.pixels * 95 / 100];
    free(degrees);
    result_free(&r);
    return d;
}

/* ---- endless columns are a height field ---- */

static void endless_is_height_field(void **state) {
    (void)state;
    for (int i = 0; i < 12; i++) {
        ref_image img = cluttered(160, 90, i & 1);
        gtao_desc desc = desc_of(&img);
        desc.radius = 1.0f;
        desc.falloff = i & 2 ? 0.25f : 0.0f;
        desc.noise = (gtao_noise)(i % 3);
        desc.slices = 4;
        desc.steps = i >= 6 ? 12 : 0;
        desc.every_pixel = i < 6;
        desc.preset = GTAO_PRESET_MEDIUM;
        result field = compute(&desc);
        desc.thickness = i & 4 ? INFINITY : 1e30f;
        result arcs = compute(&desc);
        double worst = 0.0, worst_bent = 0.0;
        for (int k = 0; k < img.width * img.height; k++)
            worst = fmax(worst, fabs((double)field.visibility[k] - (double)arcs.visibility[k]));
        for (int k = 0; k < 3 * img.width * img.height; k++)
            worst_bent = fmax(worst_bent, fabs((double)field.bent[k] - (double)arcs.bent[k]));
        print_message("endless, setting %d: %.2g, bent normal %.2g\n", i, worst, worst_bent);
        CHECK(worst <= 1e-4 && worst_bent <= 3e-4, "setting %d: off by %g, bent %g", i, worst, worst_bent);
        result_free(&field);
        result_free(&arcs);
        ref_image_free(&img);
    }
}

/* ---- brute force ---- */

static void brute_force(void **state) {
    (void)state;
    static const struct {
        int orthographic;
        double thickness, falloff, rmse, mean, degrees;
        gtao_noise noise;
    } cases[] = {
        {0, 0.2, 0.0, 0.008, 0.003, 1.0, GTAO_NOISE_NONE},       {0, 0.03, 0.0, 0.013, 0.004, 1.3, GTAO_NOISE_NONE},
        {0, 0.2, 0.25, 0.008, 0.003, 1.0, GTAO_NOISE_NONE},      {1, 0.1, 0.0, 0.012, 0.003, 1.0, GTAO_NOISE_NONE},
        {0, HUGE_VAL, 0.25, 0.005, 0.003, 0.7, GTAO_NOISE_NONE},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        ref_image img = cluttered(320, 180, cases[i].orthographic);
        gtao_desc desc = desc_of(&img);
        const ref_settings settings = {
            .radius = 1.0, .falloff = cases[i].falloff, .slices = 32, .step_px = 0.5, .border = REF_BORDER_OPEN};
        const ref_slabs slabs = {.thickness = cases[i].thickness, .surface_px = 4.0, .whole = 1};
        desc.radius = 1.0f;
        desc.falloff = (float)cases[i].falloff;
        desc.thickness = (float)cases[i].thickness;
        desc.noise = cases[i].noise;
        const difference d = to_brute_force(&desc, &img, &slabs, &settings, 12);
        print_message("brute force, case %d: RMSE %.4f, mean %+.4f, worst %.3f, bent normal %.2f degrees at 95 %%\n",
                      (int)i, d.rmse, d.mean, d.worst, d.bent_95);
        CHECK(d.rmse < cases[i].rmse && fabs(d.mean) < cases[i].mean && d.bent_95 < cases[i].degrees,
              "case %d: RMSE %g, mean %g, bent normal %g degrees", (int)i, d.rmse, d.mean, d.bent_95);
        ref_image_free(&img);
    }
}

/* ---- closed forms: boxes that float above a plane, seen from straight above ---- */

/* Visibility and bent normal of a point of the plane z = floor: in each of many azimuths a box is a rectangle, which
 * covers the angles between its nearest upper and its farthest lower edge. */
static double boxes_exactly(const ref_shape *boxes, int count, double floor_z, const double p[2], int uniform,
                            double bent[3]) {
    enum { AZIMUTHS = 2048, MOST = 32 };
    double visible = 0.0, open = 0.0;
    bent[0] = bent[1] = bent[2] = 0.0;
    for (int k = 0; k < AZIMUTHS; k++) {
        const double phi = 2.0 * REF_PI * (k + 0.5) / AZIMUTHS, d[2] = {cos(phi), sin(phi)};
        double from[MOST], to[MOST], end = 0.0;
        int n = 0;
        for (int i = 0; i < count; i++) {
            double t0 = 0.0, t1 = HUGE_VAL;
            for (int a = 0; a < 2; a++) {
                const double u = (boxes[i].center[a] - boxes[i].axis[a] - p[a]) / d[a],
                             v = (boxes[i].center[a] + boxes[i].axis[a] - p[a]) / d[a];
                t0 = fmax(t0, fmin(u, v)), t1 = fmin(t1, fmax(u, v));
            }
            if (t0 >= t1)
                continue;
            from[n] = atan2(t0, floor_z - boxes[i].center[2] + boxes[i].axis[2]);
            to[n++] = atan2(t1, floor_z - boxes[i].center[2] - boxes[i].axis[2]);
        }
        open += uniform ? 1.0 : ref_arc_integral(0.5 * REF_PI, 0.0);
        for (;;) { /* the next gap, from `end` */
            double next = 0.5 * REF_PI, after = -1.0;
            for (int i = 0; i < n; i++) {
                if (from[i] <= end && to[i] > end)
                    after = fmax(after, to[i]);
                if (from[i] > end)
                    next = fmin(next, from[i]);
            }
            if (after > end) {
                end = after;
                continue;
            }
            if (uniform) {
                visible += cos(end) - cos(next);
                bent[0] += d[0] * 0.5 * (next - end - sin(next) * cos(next) + sin(end) * cos(end));
                bent[1] += d[1] * 0.5 * (next - end - sin(next) * cos(next) + sin(end) * cos(end));
                bent[2] -= 0.5 * (sin(next) * sin(next) - sin(end) * sin(end));
            } else {
                visible += ref_arc_integral(next, 0.0) - ref_arc_integral(end, 0.0);
                const double along = ref_arc_integral_o(next, 0.0) - ref_arc_integral_o(end, 0.0);
                bent[0] += d[0] * along, bent[1] += d[1] * along;
                bent[2] -= ref_arc_integral_v(next, 0.0) - ref_arc_integral_v(end, 0.0);
            }
            if (next >= 0.5 * REF_PI)
                break;
            end = next;
        }
    }
    const double size = sqrt(bent[0] * bent[0] + bent[1] * bent[1] + bent[2] * bent[2]);
    for (int i = 0; i < 3; i++)
        bent[i] /= size;
    return visible / open;
}

static void check_boxes(const ref_shape *boxes, int count, int uniform, const char *name) {
    const double floor_z = 10.0, pixel = 1.0 / 256.0;
    const int width = 1024, height = 512;
    const ref_shape floor_plane = {REF_PLANE, {0.0, 0.0, floor_z}, {0.0, 0.0, -1.0}, 0.0, 0.0};
    ref_shape shapes[32];
    ref_image img = ref_image_orthographic(width, height, pixel);
    shapes[0] = floor_plane;
    for (int i = 0; i < count; i++)
        shapes[i + 1] = boxes[i];
    ref_render(&img, NULL, shapes, count + 1);
    gtao_desc desc = desc_of(&img);
    desc.radius = INFINITY;
    desc.slices = 64;
    desc.thickness = (float)(2.0 * boxes[0].axis[2]);
    desc.weighting = uniform ? GTAO_WEIGHTING_UNIFORM : GTAO_WEIGHTING_COSINE;
    /* Some pixels of some rows: a mask with one pixel of 80 leaves most groups out. */
    uint8_t *mask = allocate((size_t)(width * height));
    for (int i = 0; i < width * height; i++)
        mask[i] = (uint8_t)(i / width % 48 == 16 && i % width % 80 == 20 && img.z[i] == (float)floor_z);
    desc.mask = mask;
    result r = compute(&desc);
    double rmse = 0.0, mean = 0.0, worst = 0.0, degrees = 0.0, lowest = 1.0;
    int pixels = 0;
    for (int i = 0; i < width * height; i++) {
        if (!mask[i])
            continue;
        const double p[2] = {(i % width + 0.5) * pixel, (i / width + 0.5) * pixel};
        double bent[3];
        const double exact = boxes_exactly(boxes, count, floor_z, p, uniform, bent);
        const double off = (double)r.visibility[i] - exact;
        rmse += off * off, mean += off, worst = fmax(worst, fabs(off)), lowest = fmin(lowest, exact);
        degrees = fmax(degrees, degrees_between(&r.bent[3 * (size_t)i], bent));
        pixels++;
    }
    rmse = sqrt(rmse / pixels), mean /= pixels;
    print_message("%s: %d pixels, visibility from %.3f, RMSE %.4f, mean %+.4f, worst %.4f, bent normal %.2f degrees\n",
                  name, pixels, lowest, rmse, mean, worst, degrees);
    CHECK(pixels > 100 && lowest < 0.9, "%s: %d pixels, visibility from %g", name, pixels, lowest);
    CHECK(rmse < 0.003 && fabs(mean) < 0.002 && worst < 0.01 && degrees < 1.0,
          "%s: RMSE %g, mean %g, worst %g, bent normal %g degrees", name, rmse, mean, worst, degrees);
    result_free(&r);
    free(mask);
    ref_image_free(&img);
}

static void slab(void **state) {
    (void)state;
    const ref_shape box = {REF_BOX, {1.9, 1.0, 9.3}, {0.5, 0.4, 0.05}, 0.0, 0.0};
    check_boxes(&box, 1, 0, "slab");
    check_boxes(&box, 1, 1, "slab, uniform weighting");
}

static void grille(void **state) {
    (void)state;
    ref_shape bars[12];
    for (int i = 0; i < 12; i++) {
        const ref_shape bar = {REF_BOX, {0.7 + 0.22 * i, 1.0, 9.4}, {0.05, 0.7, 0.04}, 0.0, 0.0};
        bars[i] = bar;
    }
    check_boxes(bars, 12, 0, "grille");
    check_boxes(bars, 12, 1, "grille, uniform weighting");
}

/* ---- ray tracing: backs and layers that hold all of the scene ---- */

/* Rays of the length of the radius, stratified, cosine-weighted. */
static double traced(const ref_shape *shapes, int count, const double p[3], const double n[3], double radius) {
    enum { SIDE = 48 };
    uint32_t seed = 1;
    int hits = 0;
    const double helper[3] = {fabs(n[0]) < 0.9 ? 1.0 : 0.0, fabs(n[0]) < 0.9 ? 0.0 : 1.0, 0.0};
    const double along = helper[0] * n[0] + helper[1] * n[1];
    double t[3], b[3];
    for (int i = 0; i < 3; i++)
        t[i] = helper[i] - along * n[i];
    const double size = sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]);
    for (int i = 0; i < 3; i++)
        t[i] /= size;
    for (int i = 0; i < 3; i++)
        b[i] = n[(i + 1) % 3] * t[(i + 2) % 3] - n[(i + 2) % 3] * t[(i + 1) % 3];
    for (int k = 0; k < SIDE * SIDE; k++) {
        double jitter[2], direction[3], origin[3];
        for (int i = 0; i < 2; i++) {
            seed = seed * 1664525u + 1013904223u;
            jitter[i] = (seed >> 8) / 16777216.0;
        }
        const double u = (k / SIDE + jitter[0]) / SIDE, phi = 2.0 * REF_PI * (k % SIDE + jitter[1]) / SIDE;
        for (int i = 0; i < 3; i++) {
            direction[i] = sqrt(u) * (cos(phi) * t[i] + sin(phi) * b[i]) + sqrt(1.0 - u) * n[i];
            origin[i] = p[i] + 1e-6 * n[i];
        }
        ref_hit hit;
        hits += ref_trace(shapes, count, origin, direction, &hit) && hit.distance < radius;
    }
    return 1.0 - (double)hits / (SIDE * SIDE);
}

/* Where the view rays leave the boxes that `img` shows; nothing behind the plane. */
static float *backs_of(const ref_image *img, const ref_shape *boxes, int count) {
    float *backs = allocate((size_t)(img->width * img->height) * sizeof *backs);
    for (int i = 0; i < img->width * img->height; i++) {
        const double z = (double)img->z[i];
        const double ray[3] = {(i % img->width + 0.5 - img->cx) / img->fx, (i / img->width + 0.5 - img->cy) / img->fy,
                               1.0};
        backs[i] = NAN;
        for (int k = 0; k < count && isfinite(z); k++) {
            const double start[3] = {z * ray[0], z * ray[1], z},
                         deeper[3] = {1.0001 * start[0], 1.0001 * start[1], 1.0001 * z};
            int inside = 1;
            ref_hit hit;
            for (int a = 0; a < 3; a++)
                inside &= fabs(deeper[a] - boxes[k].center[a]) <= boxes[k].axis[a];
            if (inside && ref_trace(&boxes[k], 1, deeper, ray, &hit))
                backs[i] = (float)(1.0001 * z + hit.distance);
        }
    }
    return backs;
}

/* Boxes above a tilted floor: the second half of them stands behind the first as seen from the eye. */
enum { FLOOR_AND_BOXES = 7 };
static const ref_shape scene[FLOOR_AND_BOXES] = {
    {REF_PLANE, {0.0, 1.3, 4.0}, {0.0, -0.85, -0.53}, 0.0, 0.0},
    {REF_BOX, {-0.9, 0.35, 3.5}, {0.35, 0.12, 0.1}, 0.0, 0.0},
    {REF_BOX, {0.1, 0.2, 3.6}, {0.06, 0.5, 0.06}, 0.0, 0.0},
    {REF_BOX, {0.9, 0.5, 3.4}, {0.4, 0.05, 0.2}, 0.0, 0.0},
    {REF_BOX, {-0.95, 0.25, 4.3}, {0.4, 0.2, 0.15}, 0.0, 0.0},
    {REF_BOX, {0.15, 0.1, 4.5}, {0.1, 0.6, 0.1}, 0.0, 0.0},
    {REF_BOX, {1.1, 0.3, 4.4}, {0.3, 0.3, 0.1}, 0.0, 0.0},
};

/* `layers` shown of what there is: the first shows the nearest, the second what stands behind the front boxes. */
static double error_to_tracing(int backs, int layers, double radius, double thickness) {
    ref_image img = ref_image_perspective(480, 270, 50.0), behind = ref_image_perspective(480, 270, 50.0);
    ref_render(&img, NULL, scene, FLOOR_AND_BOXES);
    ref_render(&behind, NULL, scene + 4, FLOOR_AND_BOXES - 4);
    for (int i = 0; i < img.width * img.height; i++)
        if (behind.z[i] <= img.z[i])
            behind.z[i] = INFINITY;
    float *back = backs_of(&img, scene + 1, FLOOR_AND_BOXES - 1);
    float *back_behind = backs_of(&behind, scene + 4, FLOOR_AND_BOXES - 4);
    const gtao_layer layer = {behind.z, 0, back_behind, 0};
    gtao_desc desc = desc_of(&img);
    desc.radius = (float)radius;
    desc.thickness = (float)thickness;
    desc.back = backs ? back : NULL;
    desc.layers = &layer;
    desc.layer_count = layers - 1;
    uint8_t *mask = allocate((size_t)(img.width * img.height)); /* rows 8, 24, ... */
    for (int i = 0; i < img.width * img.height; i++)
        mask[i] = i / img.width % 16 == 8;
    desc.mask = mask;
    result r = compute(&desc);
    double rmse = 0.0;
    int pixels = 0;
    for (int y = 8; y < img.height; y += 16)
        for (int x = 8; x < img.width; x += 16) {
            const size_t at = (size_t)(y * img.width + x);
            const double z = (double)img.z[at],
                         p[3] = {z * (x + 0.5 - img.cx) / img.fx, z * (y + 0.5 - img.cy) / img.fy, z};
            const double n[3] = {(double)img.normals[3 * at], (double)img.normals[3 * at + 1],
                                 (double)img.normals[3 * at + 2]};
            if (!isfinite(z) ||
                fabs(n[1] - scene[0].axis[1]) > 0.01) /* on boxes floor that is off-screen would count */
                continue;
            const double off = (double)r.visibility[at] - traced(scene, FLOOR_AND_BOXES, p, n, radius);
            rmse += off * off;
            pixels++;
        }
    CHECK(pixels > 200, "only %d pixels", pixels);
    result_free(&r);
    free(back);
    free(back_behind);
    free(mask);
    ref_image_free(&img);
    ref_image_free(&behind);
    return sqrt(rmse / pixels);
}

static void layers_converge_to_tracing(void **state) {
    (void)state;
    for (int i = 0; i < 2; i++) {
        const double radius = i ? 0.6 : 1e30;
        const double field = error_to_tracing(0, 1, radius, 0.0), thick = error_to_tracing(0, 1, radius, 0.2),
                     two_sided = error_to_tracing(1, 1, radius, 0.0), all = error_to_tracing(1, 2, radius, 0.0);
        print_message("RMSE to ray tracing, radius %g: height field %.4f, thickness 0.2 %.4f, backs %.4f, two layers "
                      "%.4f\n",
                      radius, field, thick, two_sided, all);
        CHECK(thick < field && two_sided < thick && all < 0.7 * two_sided && all < 0.006, "out of order");
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(endless_is_height_field),
        cmocka_unit_test(brute_force),
        cmocka_unit_test(slab),
        cmocka_unit_test(grille),
        cmocka_unit_test(layers_converge_to_tracing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
