/* Occluders with thickness: gtao.h against brute force with sorted intervals, closed forms, ray tracing, and the height
 * field that it must become again when thickness is endless. */
#include "gtao.h"
#include "tests/reference/check.h"
#include "tests/reference/reference.h"

/* ---- helpers ---- */

typedef struct result {
    float *visibility, *bent; /* 1 and 3 a pixel */
} result;

static void *allocate(size_t size) {
    void *memory = malloc(size ? size : 1);
    if (!memory)
        fail_msg("out of memory");
    return memory;
}

static gtao_desc desc_of(const ref_image *img) {
    gtao_desc desc = {0};
    desc.width = img->width;
    desc.height = img->height;
    desc.depth = img->z;
    desc.normals = img->normals;
    if (img->orthographic) {
        desc.camera.projection = GTAO_ORTHOGRAPHIC;
        desc.camera.sx = (float)img->sx;
        desc.camera.sy = (float)img->sy;
    } else {
        desc.camera.fx = (float)img->fx;
        desc.camera.fy = (float)img->fy;
        desc.camera.cx = (float)img->cx;
        desc.camera.cy = (float)img->cy;
        desc.camera.off_center = 1;
    }
    desc.noise = GTAO_NOISE_NONE;
    desc.preset = GTAO_PRESET_REFERENCE;
    return desc;
}

static void result_free(result *r) {
    free(r->visibility);
    free(r->bent);
}

static result compute(const gtao_desc *desc) {
    const size_t count = (size_t)desc->width * (size_t)desc->height, size = gtao_scratch_size(desc);
    result r = {allocate(count * sizeof(float)), allocate(3 * count * sizeof(float))};
    void *scratch = allocate(size);
    gtao_output output = {0};
    output.visibility = r.visibility;
    output.bent_normals = r.bent;
    const gtao_result status = gtao_compute(desc, &output, scratch, size, NULL);
    CHECK(status == GTAO_OK, "%s", gtao_result_string(status));
    free(scratch);
    return r;
}

static double degrees_between(const float a[3], const double b[3]) {
    double d2 = 0.0;
    for (int i = 0; i < 3; i++)
        d2 += ((double)a[i] - b[i]) * ((double)a[i] - b[i]);
    return 2.0 * asin(fmin(1.0, 0.5 * sqrt(d2))) * 180.0 / REF_PI;
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
        {0, 0.2, 0.0, 0.02, 0.005, 5.0, GTAO_NOISE_NONE},       {0, 0.03, 0.0, 0.02, 0.005, 5.0, GTAO_NOISE_NONE},
        {0, 0.2, 0.25, 0.02, 0.005, 5.0, GTAO_NOISE_NONE},      {1, 0.1, 0.0, 0.02, 0.005, 5.0, GTAO_NOISE_NONE},
        {0, INFINITY, 0.25, 0.02, 0.005, 5.0, GTAO_NOISE_NONE},
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

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(endless_is_height_field),
        cmocka_unit_test(brute_force),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
