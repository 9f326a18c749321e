/* Preconditions, defaults, strings and scratch: everything about the interface but the picture. */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include "inputs.h"

enum { WIDTH = 19, HEIGHT = 11 };

/* A valid call, for the tests to break. */
typedef struct call {
    input in;
    result out;
    gtao_desc desc;
    gtao_output output;
    void *scratch;
    size_t scratch_size;
} call;

static const layout tight = {0, 0, 0};

static call call_make(void) {
    const setting base = {"api", 1, 1, {.camera = {.fx = 20}, .radius = 1}};
    call c;
    c.in = input_make(&base, WIDTH, HEIGHT, tight);
    c.desc = c.in.desc;
    c.out = result_make(&c.desc, WANT_EVERYTHING, GTAO_FORMAT_FLOAT, 3, tight, 0);
    c.output = c.out.output;
    c.scratch = c.out.scratch;
    c.scratch_size = c.out.scratch_size;
    return c;
}

static void call_free(call *c) {
    input_free(&c->in);
    result_free(&c->out);
}

/* ---- errors --------------------------------------------------------------------------------------------------- */

enum { NULL_DESC = 1, NULL_OUTPUT = 2 };

/* X(name, expected, change): every way to break the call. */
#define BREAKAGES(X)                                                                                                   \
    X(desc_null, GTAO_ERROR_DESC, return NULL_DESC)                                                                    \
    X(width_zero, GTAO_ERROR_SIZE, c->desc.width = 0)                                                                  \
    X(width_negative, GTAO_ERROR_SIZE, c->desc.width = -1)                                                             \
    X(width_large, GTAO_ERROR_SIZE, c->desc.width = 32769)                                                             \
    X(height_zero, GTAO_ERROR_SIZE, c->desc.height = 0)                                                                \
    X(height_negative, GTAO_ERROR_SIZE, c->desc.height = INT32_MIN)                                                    \
    X(height_large, GTAO_ERROR_SIZE, c->desc.height = INT32_MAX)                                                       \
    X(depth_null, GTAO_ERROR_DEPTH, c->desc.depth = NULL)                                                              \
    X(depth_stride_short, GTAO_ERROR_DEPTH_STRIDE, c->desc.depth_stride = 4 * WIDTH - 4)                               \
    X(depth_stride_negative, GTAO_ERROR_DEPTH_STRIDE, c->desc.depth_stride = -(4 * WIDTH - 4))                         \
    X(depth_stride_odd, GTAO_ERROR_DEPTH_STRIDE, c->desc.depth_stride = 4 * WIDTH + 2)                                 \
    X(depth_kind_unknown, GTAO_ERROR_DEPTH_KIND, c->desc.depth_kind = (gtao_depth_kind)4)                              \
    X(height_in_perspective, GTAO_ERROR_DEPTH_KIND, c->desc.depth_kind = GTAO_DEPTH_HEIGHT)                            \
    X(device_scale_zero, GTAO_ERROR_DEVICE, c->desc.depth_kind = GTAO_DEPTH_DEVICE)                                    \
    X(device_scale_nan, GTAO_ERROR_DEVICE, device(&c->desc, float_nan(), 0))                                           \
    X(device_scale_inf, GTAO_ERROR_DEVICE, device(&c->desc, float_inf(), 0))                                           \
    X(device_bias_nan, GTAO_ERROR_DEVICE, device(&c->desc, 1, float_nan()))                                            \
    X(device_bias_inf, GTAO_ERROR_DEVICE, device(&c->desc, 1, -float_inf()))                                           \
    X(sky_negative, GTAO_ERROR_SKY, c->desc.sky_z = -1)                                                                \
    X(sky_nan, GTAO_ERROR_SKY, c->desc.sky_z = float_nan())                                                            \
    X(normal_components_two, GTAO_ERROR_NORMALS, c->desc.normal_components = 2)                                        \
    X(normal_components_five, GTAO_ERROR_NORMALS, c->desc.normal_components = 5)                                       \
    X(normal_components_negative, GTAO_ERROR_NORMALS, c->desc.normal_components = -3)                                  \
    X(normal_stride_short, GTAO_ERROR_NORMALS, c->desc.normal_stride = 12 * WIDTH - 4)                                 \
    X(normal_stride_odd, GTAO_ERROR_NORMALS, c->desc.normal_stride = 12 * WIDTH + 1)                                   \
    X(normal_matrix_nan, GTAO_ERROR_NORMAL_AXES, c->desc.normal_to_view[8] = float_nan())                              \
    X(normal_axes_inf, GTAO_ERROR_NORMAL_AXES, c->desc.normal_axes[1] = float_inf())                                   \
    X(mask_stride_short, GTAO_ERROR_MASK, c->desc.mask_stride = WIDTH - 1)                                             \
    X(mask_stride_negative, GTAO_ERROR_MASK, c->desc.mask_stride = 1 - WIDTH)                                          \
    X(projection_unknown, GTAO_ERROR_PROJECTION, c->desc.camera.projection = (gtao_projection)2)                       \
    X(fx_zero, GTAO_ERROR_FOCAL, c->desc.camera.fx = 0)                                                                \
    X(fx_negative, GTAO_ERROR_FOCAL, c->desc.camera.fx = -20)                                                          \
    X(fx_nan, GTAO_ERROR_FOCAL, c->desc.camera.fx = float_nan())                                                       \
    X(fx_inf, GTAO_ERROR_FOCAL, c->desc.camera.fx = float_inf())                                                       \
    X(fy_negative, GTAO_ERROR_FOCAL, c->desc.camera.fy = -20)                                                          \
    X(fy_nan, GTAO_ERROR_FOCAL, c->desc.camera.fy = float_nan())                                                       \
    X(cx_nan, GTAO_ERROR_CENTER, center(&c->desc, float_nan(), 0))                                                     \
    X(cy_inf, GTAO_ERROR_CENTER, center(&c->desc, 0, float_inf()))                                                     \
    X(sx_zero, GTAO_ERROR_PIXEL_SIZE, ortho(&c->desc, 0, 0))                                                           \
    X(sx_negative, GTAO_ERROR_PIXEL_SIZE, ortho(&c->desc, -1, 0))                                                      \
    X(sx_inf, GTAO_ERROR_PIXEL_SIZE, ortho(&c->desc, float_inf(), 0))                                                  \
    X(sy_negative, GTAO_ERROR_PIXEL_SIZE, ortho(&c->desc, 1, -1))                                                      \
    X(sy_nan, GTAO_ERROR_PIXEL_SIZE, ortho(&c->desc, 1, float_nan()))                                                  \
    X(border_unknown, GTAO_ERROR_BORDER, c->desc.border = (gtao_border)3)                                              \
    X(radius_negative, GTAO_ERROR_RADIUS, c->desc.radius = -1)                                                         \
    X(radius_nan, GTAO_ERROR_RADIUS, c->desc.radius = float_nan())                                                     \
    X(falloff_negative, GTAO_ERROR_FALLOFF, c->desc.falloff = -0.01f)                                                  \
    X(falloff_large, GTAO_ERROR_FALLOFF, c->desc.falloff = 1.01f)                                                      \
    X(falloff_nan, GTAO_ERROR_FALLOFF, c->desc.falloff = float_nan())                                                  \
    X(max_radius_negative, GTAO_ERROR_MAX_RADIUS, c->desc.max_radius_px = -1)                                          \
    X(preset_unknown, GTAO_ERROR_PRESET, c->desc.preset = (gtao_preset)5)                                              \
    X(slices_negative, GTAO_ERROR_SLICES, c->desc.slices = -1)                                                         \
    X(slices_many, GTAO_ERROR_SLICES, c->desc.slices = 65)                                                             \
    X(steps_negative, GTAO_ERROR_STEPS, c->desc.steps = -1)                                                            \
    X(steps_many, GTAO_ERROR_STEPS, c->desc.steps = 257)                                                               \
    X(step_power_negative, GTAO_ERROR_STEP_POWER, c->desc.step_power = -1)                                             \
    X(step_power_small, GTAO_ERROR_STEP_POWER, c->desc.step_power = 0.2f)                                              \
    X(step_power_large, GTAO_ERROR_STEP_POWER, c->desc.step_power = 8.1f)                                              \
    X(step_power_nan, GTAO_ERROR_STEP_POWER, c->desc.step_power = float_nan())                                         \
    X(thin_blend_negative, GTAO_ERROR_THIN_BLEND, c->desc.thin_blend = -0.01f)                                         \
    X(thin_blend_large, GTAO_ERROR_THIN_BLEND, c->desc.thin_blend = 1.01f)                                             \
    X(thin_blend_nan, GTAO_ERROR_THIN_BLEND, c->desc.thin_blend = float_nan())                                         \
    X(tolerance_negative, GTAO_ERROR_ALLOWED, c->desc.tolerance = -0.01f)                                              \
    X(tolerance_large, GTAO_ERROR_ALLOWED, c->desc.tolerance = 1.01f)                                                  \
    X(tolerance_nan, GTAO_ERROR_ALLOWED, c->desc.tolerance = float_nan())                                              \
    X(thickness_negative, GTAO_ERROR_THICKNESS, c->desc.thickness = -0.01f)                                            \
    X(thickness_nan, GTAO_ERROR_THICKNESS, c->desc.thickness = float_nan())                                            \
    X(thickness_map_stride_short, GTAO_ERROR_THICKNESS_MAP, behind(&c->desc, 1, 4 * WIDTH - 4))                        \
    X(thickness_map_stride_odd, GTAO_ERROR_THICKNESS_MAP, behind(&c->desc, 1, 4 * WIDTH + 2))                          \
    X(back_stride_short, GTAO_ERROR_BACK, behind(&c->desc, 2, 4 - 4 * WIDTH))                                          \
    X(back_stride_odd, GTAO_ERROR_BACK, behind(&c->desc, 2, 4 * WIDTH + 1))                                            \
    X(layers_null, GTAO_ERROR_LAYERS, c->desc.layer_count = 1)                                                         \
    X(layers_negative, GTAO_ERROR_LAYERS, c->desc.layer_count = -1)                                                    \
    X(layers_many, GTAO_ERROR_LAYERS, layers(&c->desc, GTAO_MAX_LAYERS + 1, 0, 0))                                     \
    X(layers_depth_null, GTAO_ERROR_LAYERS, layers(&c->desc, 3, 0, 0))                                                 \
    X(layers_depth_stride, GTAO_ERROR_LAYERS, layers(&c->desc, 2, 4 * WIDTH - 4, 0))                                   \
    X(layers_back_stride, GTAO_ERROR_LAYERS, layers(&c->desc, 2, 0, 4 * WIDTH + 2))                                    \
    X(thickness_memo, GTAO_ERROR_ARCS, (c->desc.thickness = 1, c->desc.estimator = GTAO_ESTIMATOR_MEMO))               \
    X(back_thin_blend, GTAO_ERROR_ARCS, (behind(&c->desc, 2, 0), c->desc.thin_blend = 0.5f))                           \
    X(layers_memo, GTAO_ERROR_ARCS, (layers(&c->desc, 1, 0, 0), c->desc.estimator = GTAO_ESTIMATOR_MEMO))              \
    X(estimator_unknown, GTAO_ERROR_ESTIMATOR, c->desc.estimator = (gtao_estimator)2)                                  \
    X(weighting_unknown, GTAO_ERROR_WEIGHTING, c->desc.weighting = (gtao_weighting)2)                                  \
    X(noise_unknown, GTAO_ERROR_NOISE, c->desc.noise = (gtao_noise)3)                                                  \
    X(target_negative, GTAO_ERROR_TARGET, c->desc.error_target = -0.1f)                                                \
    X(target_nan, GTAO_ERROR_TARGET, c->desc.error_target = float_nan())                                               \
    X(target_noise, GTAO_ERROR_TARGET, (c->desc.error_target = 0.1f, c->desc.noise = GTAO_NOISE_NONE))                 \
    X(far_unknown, GTAO_ERROR_FAR, c->desc.far_depth = (gtao_far)3)                                                    \
    X(far_px_small, GTAO_ERROR_FAR, c->desc.far_px = 7)                                                                \
    X(far_px_negative, GTAO_ERROR_FAR, c->desc.far_px = -16)                                                           \
    X(far_hilbert, GTAO_ERROR_FAR, far_with(&c->desc)->noise = GTAO_NOISE_HILBERT)                                     \
    X(far_clamp, GTAO_ERROR_FAR, far_with(&c->desc)->border = GTAO_BORDER_CLAMP)                                       \
    X(far_every_pixel, GTAO_ERROR_FAR, far_with(&c->desc)->every_pixel = 1)                                            \
    X(far_reference, GTAO_ERROR_FAR, far_with(&c->desc)->preset = GTAO_PRESET_REFERENCE)                               \
    X(far_thickness, GTAO_ERROR_FAR, far_with(&c->desc)->thickness = 1)                                                \
    X(far_thin_blend, GTAO_ERROR_FAR, far_with(&c->desc)->thin_blend = 0.5f)                                           \
    X(far_memo, GTAO_ERROR_FAR, far_with(&c->desc)->estimator = GTAO_ESTIMATOR_MEMO)                                   \
    X(isa_unknown, GTAO_ERROR_ISA, c->desc.isa = (gtao_isa)6)                                                          \
    X(isa_of_another_machine, GTAO_ERROR_ISA,                                                                          \
      c->desc.isa = gtao_isa_available(GTAO_ISA_NEON) ? GTAO_ISA_SSE2 : GTAO_ISA_NEON)                                 \
    X(output_null, GTAO_ERROR_OUTPUT, return NULL_OUTPUT)                                                              \
    X(output_empty, GTAO_ERROR_OUTPUT, memset(&c->output, 0, sizeof c->output))                                        \
    X(format_unknown, GTAO_ERROR_OUTPUT_FORMAT, c->output.visibility_format = (gtao_format)3)                          \
    X(visibility_stride_short, GTAO_ERROR_OUTPUT_STRIDE, c->output.visibility_stride = 4 * WIDTH - 4)                  \
    X(visibility_stride_odd, GTAO_ERROR_OUTPUT_STRIDE, c->output.visibility_stride = -(4 * WIDTH + 2))                 \
    X(bent_components_two, GTAO_ERROR_OUTPUT_STRIDE, c->output.bent_components = 2)                                    \
    X(bent_stride_short, GTAO_ERROR_OUTPUT_STRIDE, c->output.bent_stride = 12 * WIDTH - 4)                             \
    X(bent_stride_odd, GTAO_ERROR_OUTPUT_STRIDE, c->output.bent_stride = 12 * WIDTH + 3)                               \
    X(packed_stride_short, GTAO_ERROR_OUTPUT_STRIDE, c->output.packed_stride = 4 * WIDTH - 4)                          \
    X(packed_stride_odd, GTAO_ERROR_OUTPUT_STRIDE, c->output.packed_stride = 4 * WIDTH + 1)                            \
    X(sh_bands_one, GTAO_ERROR_OUTPUT_SH, c->output.sh_bands = 1)                                                      \
    X(sh_bands_four, GTAO_ERROR_OUTPUT_SH, c->output.sh_bands = 4)                                                     \
    X(sh_bands_negative, GTAO_ERROR_OUTPUT_SH, c->output.sh_bands = -3)                                                \
    X(sh_stride_short, GTAO_ERROR_OUTPUT_SH, c->output.sh_stride = 4 * WIDTH - 4)                                      \
    X(sh_stride_odd, GTAO_ERROR_OUTPUT_SH, c->output.sh_stride = 4 * WIDTH + 2)                                        \
    X(sh_plane_stride_short, GTAO_ERROR_OUTPUT_SH, c->output.sh_plane_stride = 4 * WIDTH * HEIGHT - 4)                 \
    X(sh_plane_stride_negative, GTAO_ERROR_OUTPUT_SH, c->output.sh_plane_stride = 4 - 4 * WIDTH * HEIGHT)              \
    X(sh_plane_stride_odd, GTAO_ERROR_OUTPUT_SH, c->output.sh_plane_stride = 4 * WIDTH * HEIGHT + 1)                   \
    X(sh_rows_interleaved_short, GTAO_ERROR_OUTPUT_SH, interleave(&c->output, 4 * WIDTH, 4 * WIDTH * 9 - 4))           \
    X(sh_planes_interleaved_short, GTAO_ERROR_OUTPUT_SH, interleave(&c->output, 4 * WIDTH - 4, 4 * WIDTH * 9))         \
    X(scratch_null, GTAO_ERROR_SCRATCH, c->scratch = NULL)                                                             \
    X(scratch_small, GTAO_ERROR_SCRATCH, c->scratch_size -= 1)                                                         \
    X(scratch_none, GTAO_ERROR_SCRATCH, c->scratch_size = 0)

static void device(gtao_desc *d, float scale, float bias) {
    d->depth_kind = GTAO_DEPTH_DEVICE;
    d->device_scale = scale;
    d->device_bias = bias;
}

static void center(gtao_desc *d, float cx, float cy) {
    d->camera.off_center = 1;
    d->camera.cx = cx;
    d->camera.cy = cy;
}

static void ortho(gtao_desc *d, float sx, float sy) {
    d->camera.projection = GTAO_ORTHOGRAPHIC;
    d->camera.sx = sx;
    d->camera.sy = sy;
}

static void interleave(gtao_output *o, ptrdiff_t step, ptrdiff_t row) {
    o->sh_plane_stride = step;
    o->sh_stride = row;
}

static gtao_desc *far_with(gtao_desc *d) {
    d->far_depth = GTAO_FAR_NEAREST;
    return d;
}

static void behind(gtao_desc *d, int which, ptrdiff_t stride) {
    if (which == 1)
        d->thickness_map = d->depth, d->thickness_stride = stride;
    else
        d->back = d->depth, d->back_stride = stride;
}

/* Two layers; the last has a back. */
static void layers(gtao_desc *d, int count, ptrdiff_t stride, ptrdiff_t back_stride) {
    static gtao_layer layer[GTAO_MAX_LAYERS + 1];
    memset(layer, 0, sizeof layer);
    layer[0].depth = layer[1].depth = layer[1].back = d->depth;
    layer[1].depth_stride = stride, layer[1].back_stride = back_stride;
    d->layers = layer, d->layer_count = count;
}

#define DEFINE(name, expected, change)                                                                                 \
    static int break_##name(call *c) {                                                                                 \
        (void)c;                                                                                                       \
        change;                                                                                                        \
        return 0;                                                                                                      \
    }
BREAKAGES(DEFINE)
#undef DEFINE

static const struct {
    const char *name;
    gtao_result expected;
    int (*apply)(call *c); /* returns NULL_DESC, NULL_OUTPUT or 0 */
} breakages[] = {
#define ENTRY(name, expected, change) {#name, expected, break_##name},
    BREAKAGES(ENTRY)
#undef ENTRY
};

enum { BREAKAGE_COUNT = (int)(sizeof breakages / sizeof breakages[0]) };

static int untouched(const plane *p) {
    for (size_t i = 0; i < p->size; i++)
        if (p->memory[i] != CANARY)
            return 0;
    return 1;
}

static void every_error_fires(void **state) {
    (void)state;
    for (int i = 0; i < BREAKAGE_COUNT; i++) {
        call c = call_make();
        int null = breakages[i].apply(&c);
        const gtao_desc *desc = null == NULL_DESC ? NULL : &c.desc;
        const gtao_output *output = null == NULL_OUTPUT ? NULL : &c.output;
        gtao_context *context = NULL;
        gtao_stats stats = {0};
        gtao_result got = gtao_compute(desc, output, c.scratch, c.scratch_size, &stats);
        if (got != breakages[i].expected)
            fail_msg("%s: \"%s\" instead of \"%s\"", breakages[i].name, gtao_result_string(got),
                     gtao_result_string(breakages[i].expected));
        got = gtao_begin(desc, output, c.scratch, c.scratch_size, &context);
        if (got != breakages[i].expected)
            fail_msg("%s: gtao_begin: \"%s\"", breakages[i].name, gtao_result_string(got));
        if (!untouched(&c.out.visibility) || !untouched(&c.out.bent) || !untouched(&c.out.packed) ||
            !untouched(&c.out.sh) || stats.pixels != 0)
            fail_msg("%s: something was written all the same", breakages[i].name);
        /* Only what the description says decides about the size. */
        if (breakages[i].expected < GTAO_ERROR_OUTPUT && gtao_scratch_size(desc) != 0)
            fail_msg("%s: gtao_scratch_size() is not 0", breakages[i].name);
        if (breakages[i].expected >= GTAO_ERROR_OUTPUT && gtao_scratch_size(desc) == 0)
            fail_msg("%s: gtao_scratch_size() is 0", breakages[i].name);
        call_free(&c);
    }
}

static void every_error_is_tested(void **state) {
    int seen[GTAO_RESULT_COUNT] = {0};
    (void)state;
    for (int i = 0; i < BREAKAGE_COUNT; i++)
        seen[breakages[i].expected]++;
    seen[GTAO_OK]++;           /* every other test */
    seen[GTAO_ERROR_MATRIX]++; /* matrices_that_are_no_projection */
    for (int i = GTAO_ERROR_FRAME; i <= GTAO_ERROR_STATE; i++)
        seen[i]++; /* test_frame.c */
    for (int i = GTAO_ERROR_SWEEP; i <= GTAO_CANCELLED; i++)
        seen[i]++; /* test_sweep_bits.c */
    seen[GTAO_ERROR_SIGNAL]++;
    for (int i = 0; i < GTAO_RESULT_COUNT; i++)
        if (seen[i] == 0)
            fail_msg("no test for \"%s\"", gtao_result_string((gtao_result)i));
}

static void matrices_that_are_no_projection(void **state) {
    float m[16] = {0}, scale = 7, bias = 7;
    gtao_camera camera;
    (void)state;
    memset(&camera, 0, sizeof camera);
    assert_int_equal(gtao_camera_from_projection(m, GTAO_CLIP_ZERO_TO_ONE, 0, 16, 16, &camera, &scale, &bias),
                     GTAO_ERROR_MATRIX);
    for (int i = 0; i < 16; i++) {
        const float bad[2] = {float_nan(), float_inf()};
        for (int k = 0; k < 2; k++) {
            const float p[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, -1, 0, 0, -1, 0};
            memcpy(m, p, sizeof m);
            m[i] = bad[k];
            assert_int_equal(gtao_camera_from_projection(m, GTAO_CLIP_ZERO_TO_ONE, 0, 16, 16, &camera, &scale, &bias),
                             GTAO_ERROR_MATRIX);
        }
    }
    /* Sheared, or with an oblique near plane: no camera of ours. */
    for (int i = 0; i < 4; i++) {
        static const int at[4] = {1, 4, 8, 9};
        const float p[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, -1, 0, 0, -1, 0};
        memcpy(m, p, sizeof m);
        m[at[i]] = 0.25f;
        assert_int_equal(gtao_camera_from_projection(m, GTAO_CLIP_ZERO_TO_ONE, 0, 16, 16, &camera, &scale, &bias),
                         GTAO_ERROR_MATRIX);
    }
}

/* ---- what is allowed ------------------------------------------------------------------------------------------ */

static void bounds_are_inclusive(void **state) {
    (void)state;
    for (int i = 0; i < 12; i++) {
        call c = call_make();
        size_t size;
        void *scratch;
        switch (i) {
        case 0:
            c.desc.radius = float_inf();
            break;
        case 1:
            c.desc.radius = 0;
            break;
        case 2:
            c.desc.falloff = 1;
            break;
        case 3:
            c.desc.slices = 64, c.desc.steps = 256;
            break;
        case 4:
            c.desc.slices = 1, c.desc.steps = 1;
            break;
        case 5:
            c.desc.step_power = 0.25f;
            break;
        case 6:
            c.desc.step_power = 8;
            break;
        case 7:
            c.desc.thin_blend = 1;
            break;
        case 8:
            c.desc.max_radius_px = INT32_MAX;
            break;
        case 9:
            c.desc.sky_z = float_inf();
            break;
        case 10:
            c.desc.frame = UINT32_MAX;
            break;
        case 11:
            c.desc.width = c.desc.height = 1;
            break;
        }
        size = gtao_scratch_size(&c.desc);
        assert_int_not_equal(size, 0);
        scratch = malloc(size);
        assert_non_null(scratch);
        if (gtao_compute(&c.desc, &c.output, scratch, size, NULL) != GTAO_OK)
            fail_msg("case %d was rejected", i);
        free(scratch);
        call_free(&c);
    }
}

/* Ranges of unused fields are not looked at. */
static void unused_fields_are_ignored(void **state) {
    call c = call_make();
    (void)state;
    c.desc.device_scale = float_nan();
    c.desc.camera.cx = float_nan();
    c.desc.camera.sx = -1;
    c.desc.mask = NULL;
    c.desc.mask_stride = 1;
    c.output.packed = NULL;
    c.output.packed_stride = 1;
    assert_int_equal(gtao_compute(&c.desc, &c.output, c.scratch, c.scratch_size, NULL), GTAO_OK);
    call_free(&c);
}

static void zero_means_the_documented_default(void **state) {
    call zero = call_make(), full = call_make();
    gtao_desc *d = &full.desc;
    (void)state;
    d->depth_stride = 4 * WIDTH;
    d->normal_stride = 12 * WIDTH;
    d->normal_components = 3;
    d->normal_to_view[0] = d->normal_to_view[4] = d->normal_to_view[8] = 1;
    d->normal_axes[0] = d->normal_axes[1] = d->normal_axes[2] = 1;
    d->mask_stride = WIDTH;
    d->camera.fy = d->camera.fx;
    center(d, 0.5f * WIDTH, 0.5f * HEIGHT);
    d->step_power = 2;
    d->sky_z = float_inf();
    d->max_radius_px = WIDTH + HEIGHT; /* more than the diagonal reaches no further */
    full.output.visibility_stride = 4 * WIDTH;
    full.output.bent_stride = 12 * WIDTH;
    full.output.bent_components = 3;
    full.output.packed_stride = 4 * WIDTH;
    assert_int_equal(gtao_compute(&zero.desc, &zero.output, zero.scratch, zero.scratch_size, NULL), GTAO_OK);
    {
        size_t size = gtao_scratch_size(d);
        void *scratch = malloc(size);
        assert_non_null(scratch);
        assert_int_equal(gtao_compute(d, &full.output, scratch, size, NULL), GTAO_OK);
        free(scratch);
    }
    assert_true(result_equal(&zero.out, &full.out));
    call_free(&zero);
    call_free(&full);
}

static void presets_resolve(void **state) {
    static const gtao_preset cheaper_to_dearer[] = {GTAO_PRESET_LOW, GTAO_PRESET_MEDIUM, GTAO_PRESET_HIGH,
                                                    GTAO_PRESET_ULTRA, GTAO_PRESET_REFERENCE};
    int before = 0;
    (void)state;
    for (int i = 0; i < 5; i++) {
        call c = call_make();
        gtao_context *context = NULL;
        size_t size;
        void *scratch;
        int cost;
        c.desc.preset = cheaper_to_dearer[i];
        size = gtao_scratch_size(&c.desc);
        scratch = malloc(size);
        assert_int_equal(gtao_begin(&c.desc, &c.output, scratch, size, &context), GTAO_OK);
        assert_int_equal(gtao_context_steps(context) == 0, cheaper_to_dearer[i] == GTAO_PRESET_REFERENCE);
        cost = gtao_context_slices(context) * (gtao_context_steps(context) ? gtao_context_steps(context) : 1000);
        assert_true(cost > before);
        before = cost;
        assert_int_not_equal(gtao_context_isa(context), GTAO_ISA_AUTO);
        assert_true(gtao_isa_available(gtao_context_isa(context)));
        free(scratch);
        c.desc.slices = 5;
        c.desc.steps = 7;
        size = gtao_scratch_size(&c.desc);
        scratch = malloc(size);
        assert_int_equal(gtao_begin(&c.desc, &c.output, scratch, size, &context), GTAO_OK);
        assert_int_equal(gtao_context_slices(context), 5);
        if (cheaper_to_dearer[i] != GTAO_PRESET_REFERENCE)
            assert_int_equal(gtao_context_steps(context), 7);
        free(scratch);
        call_free(&c);
    }
}

static void level_one_is_level_two(void **state) {
    call one = call_make(), two = call_make();
    gtao_context *context = NULL;
    (void)state;
    assert_int_equal(gtao_compute(&one.desc, &one.output, one.scratch, one.scratch_size, NULL), GTAO_OK);
    assert_int_equal(gtao_begin(&two.desc, &two.output, two.scratch, two.scratch_size, &context), GTAO_OK);
    assert_non_null(context);
    gtao_prepare_rows(context, 0, 0);
    gtao_prepare_rows(context, 0, HEIGHT);
    gtao_visibility_rows(context, 4, 4, NULL);
    gtao_visibility_rows(context, 0, HEIGHT, NULL);
    assert_true(result_equal(&one.out, &two.out));
    call_free(&one);
    call_free(&two);
}

static void statistics_are_added(void **state) {
    call c = call_make();
    gtao_stats once = {0}, twice;
    (void)state;
    assert_int_equal(gtao_compute(&c.desc, &c.output, c.scratch, c.scratch_size, &once), GTAO_OK);
    twice = once;
    assert_int_equal(gtao_compute(&c.desc, &c.output, c.scratch, c.scratch_size, &twice), GTAO_OK);
    assert_int_equal(once.pixels, WIDTH * HEIGHT);
    assert_true(once.sky + once.masked + once.small_radius < once.pixels && once.samples > once.pixels);
    assert_int_equal(twice.pixels, 2 * once.pixels);
    assert_int_equal(twice.sky, 2 * once.sky);
    assert_int_equal(twice.masked, 2 * once.masked);
    assert_int_equal(twice.small_radius, 2 * once.small_radius);
    assert_int_equal(twice.derived_normals, 2 * once.derived_normals);
    assert_int_equal(twice.samples, 2 * once.samples);
    call_free(&c);
}

/* Sky and masked pixels are counted as what they are, and come out open. */
static void skipped_pixels_are_counted(void **state) {
    call c = call_make();
    gtao_stats stats = {0};
    uint64_t sky = 0, masked = 0;
    (void)state;
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            int is_sky = scene_z(x, y, 7) == 0, is_masked = plane_row(&c.in.mask, y)[x] == 0;
            sky += (uint64_t)is_sky;
            masked += (uint64_t)is_masked;
        }
    assert_int_equal(gtao_compute(&c.desc, &c.output, c.scratch, c.scratch_size, &stats), GTAO_OK);
    assert_true(masked > 0 && stats.masked <= masked && stats.sky <= sky);
    assert_true(stats.sky + stats.masked >= masked && stats.sky + stats.masked <= sky + masked);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++)
            if (scene_z(x, y, 7) == 0 || plane_row(&c.in.mask, y)[x] == 0) {
                float v;
                memcpy(&v, plane_row(&c.out.visibility, y) + sizeof v * (size_t)x, sizeof v);
                assert_true(v == 1.0f);
            }
    call_free(&c);
}

static void radius_zero_is_open(void **state) {
    call c = call_make();
    gtao_stats stats = {0};
    (void)state;
    c.desc.radius = 0;
    assert_int_equal(gtao_compute(&c.desc, &c.output, c.scratch, c.scratch_size, &stats), GTAO_OK);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            float v;
            memcpy(&v, plane_row(&c.out.visibility, y) + sizeof v * (size_t)x, sizeof v);
            assert_true(v == 1.0f);
        }
    assert_int_equal(stats.samples, 0);
    call_free(&c);
}

/* ---- strings and scratch -------------------------------------------------------------------------------------- */

static void strings_are_there_and_differ(void **state) {
    (void)state;
    for (int i = 0; i < GTAO_RESULT_COUNT; i++) {
        assert_non_null(gtao_result_string((gtao_result)i));
        for (int k = 0; k < i; k++)
            assert_string_not_equal(gtao_result_string((gtao_result)i), gtao_result_string((gtao_result)k));
    }
    assert_string_equal(gtao_result_string(GTAO_OK), "ok");
    assert_non_null(gtao_result_string(GTAO_RESULT_COUNT));
    assert_non_null(gtao_result_string((gtao_result)-1));
    for (int i = 0; i <= GTAO_ISA_NEON; i++)
        for (int k = 0; k < i; k++)
            assert_string_not_equal(gtao_isa_name((gtao_isa)i), gtao_isa_name((gtao_isa)k));
    assert_string_equal(gtao_isa_name(GTAO_ISA_SCALAR), "scalar");
    assert_non_null(gtao_isa_name((gtao_isa)99));
    assert_false(gtao_isa_available((gtao_isa)99));
    assert_true(gtao_isa_available(GTAO_ISA_SCALAR));
}

static void scratch_size_of_null_is_zero(void **state) {
    (void)state;
    assert_int_equal(gtao_scratch_size(NULL), 0);
}

/* The largest image must not wrap around in size_t (64-bit), nor be accepted where it cannot be had (32-bit). */
static void scratch_size_does_not_overflow(void **state) {
    call c = call_make();
    size_t size;
    (void)state;
    c.desc.width = c.desc.height = 32768;
    c.desc.depth_stride = c.desc.normal_stride = c.desc.mask_stride = 0;
    size = gtao_scratch_size(&c.desc);
    assert_true(size == 0 || size / 32768 / 4 >= 32768);
    call_free(&c);
}

static void scratch_is_at_most_48_bytes_a_pixel(void **state) {
    gtao_desc desc = {.width = 960,
                      .height = 540,
                      .camera = {.fx = 800},
                      .radius = 1,
                      .falloff = 0.25f,
                      .max_radius_px = 100,
                      .slices = 1,
                      .steps = 8};
    float depth = 1;
    double derived, given;
    (void)state;
    desc.depth = &depth; /* not read here */
    derived = (double)gtao_scratch_size(&desc) / (960.0 * 540.0);
    desc.normals = &depth;
    given = (double)gtao_scratch_size(&desc) / (960.0 * 540.0);
    print_message(
        "# note: scratch, 960x540, 1 slice of 8 steps, cap 100 px: %.1f bytes a pixel with normals, %.1f without\n",
        given, derived);
    assert_true(given > 0 && given <= 48 && derived > 0 && derived <= 48);
}

/* ---- thickness ------------------------------------------------------------------------------------------------ */

/* A wall from edge to edge, in front of it a plate, and in front of that a bar that hides a part of the plate. */
static void thickness_is_estimated(void **state) {
    (void)state;
    for (int k = 0; k < 2; k++) {
        enum { W = 64, H = 48 };
        static float z[W * H], map[W * (H + 1)];
        const float unit = k ? 0.1f : 1.0f / 80.0f; /* of a pixel: orthographic; at depth 1 */
        gtao_desc d;
        void *scratch;
        size_t size;
        memset(&d, 0, sizeof d);
        d.width = W, d.height = H, d.depth = z, d.radius = k ? 3.0f : 2.0f;
        d.camera.fx = 80;
        if (k)
            d.camera.projection = GTAO_ORTHOGRAPHIC, d.camera.sx = unit;
        for (int i = 0; i < W * H; i++) {
            int x = i % W, y = i / W, plate = x >= 12 && x < 36 && y >= 8 && y < 40, bar = x >= 20 && x < 24 && y >= 4;
            z[i] = bar && y < 44 ? 4.0f : plate ? 6.0f : x >= 50 && y < 10 ? float_inf() : 9.0f;
        }
        size = gtao_thickness_scratch_size(&d);
        scratch = malloc(size);
        assert_non_null(scratch);
        assert_int_equal(gtao_estimate_thickness(&d, map, 4 * W, scratch, size), GTAO_OK);
        for (int i = 0; i < W * H; i++) {
            float want = z[i] < 5.0f    ? 0.35f * 4.0f * unit * (k ? 1.0f : 4.0f)
                         : z[i] < 7.0f  ? 0.35f * 24.0f * unit * (k ? 1.0f : 6.0f) /* as if the bar were not there */
                         : z[i] < 10.0f ? float_inf()
                                        : 0.0f;
            if (want > 0.35f * 1.5f * d.radius)
                want = float_inf();
            if (!(map[i] == want || fabsf(map[i] - want) < 1e-5f * want))
                fail_msg("%d: thickness %g, expected %g at (%d, %d)", k, (double)map[i], (double)want, i % W, i / W);
        }
        assert_int_equal(gtao_estimate_thickness(&d, NULL, 0, scratch, size), GTAO_ERROR_THICKNESS_MAP);
        assert_int_equal(gtao_estimate_thickness(&d, map, 4 * W - 4, scratch, size), GTAO_ERROR_THICKNESS_MAP);
        assert_int_equal(gtao_estimate_thickness(&d, map, 0, scratch, size - 1), GTAO_ERROR_SCRATCH);
        assert_int_equal(gtao_estimate_thickness(&d, map, 0, NULL, size), GTAO_ERROR_SCRATCH);
        d.width = 0;
        assert_int_equal(gtao_estimate_thickness(&d, map, 0, scratch, size), GTAO_ERROR_SIZE);
        assert_int_equal(gtao_thickness_scratch_size(&d), 0);
        free(scratch);
    }
}

static void layers_are_composed(void **state) {
    const float scene[4] = {0.5f, 0.5f, 0.2f, 0.9f}, scene_bent[12] = {1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0};
    float all[4] = {0.25f, 0.75f, 0.75f, 0.75f}, bent[12] = {0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0};
    const uint8_t moving[4] = {0, 0, 1, 1};
    (void)state;
    gtao_compose_layers(4, scene, scene_bent, moving, all, bent);
    assert_true(all[0] == 0.25f && all[1] == 0.5f && all[2] == 0.75f && all[3] == 0.75f);
    assert_true(bent[0] == 0.0f && bent[3] == 1.0f && bent[6] == 0.0f && bent[9] == 0.0f);
    gtao_compose_layers(4, scene, NULL, moving, all, NULL);
    assert_true(all[0] == 0.25f && all[1] == 0.5f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_error_fires),
        cmocka_unit_test(every_error_is_tested),
        cmocka_unit_test(matrices_that_are_no_projection),
        cmocka_unit_test(bounds_are_inclusive),
        cmocka_unit_test(unused_fields_are_ignored),
        cmocka_unit_test(zero_means_the_documented_default),
        cmocka_unit_test(presets_resolve),
        cmocka_unit_test(level_one_is_level_two),
        cmocka_unit_test(statistics_are_added),
        cmocka_unit_test(skipped_pixels_are_counted),
        cmocka_unit_test(radius_zero_is_open),
        cmocka_unit_test(strings_are_there_and_differ),
        cmocka_unit_test(scratch_size_of_null_is_zero),
        cmocka_unit_test(scratch_size_does_not_overflow),
        cmocka_unit_test(scratch_is_at_most_48_bytes_a_pixel),
        cmocka_unit_test(thickness_is_estimated),
        cmocka_unit_test(layers_are_composed),
    };
    return cmocka_run_group_tests_name("api", tests, NULL, NULL);
}
