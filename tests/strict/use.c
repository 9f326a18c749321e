/* Uses every public function, as C and as C++; with -DGTAO_STATIC -DGTAO_IMPLEMENTATION on its own, else with impl.c. */
#include "gtao.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int strict_second_unit(void);

int main(void) {
    enum { WIDTH = 8, HEIGHT = 6 };
    float depth[WIDTH * HEIGHT], visibility[WIDTH * HEIGHT], bent[3], t[2], rgb[3], s, c, scale, bias;
    float sh[9], rotated[9];
    const float albedo[3] = {0.5f, 0.25f, 0.75f}, probe[27] = {1.0f}, identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const float projection[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, -1, 0, 0, -1, 0};
    gtao_desc desc;
    gtao_output output;
    gtao_stats stats;
    gtao_context *context = NULL;
    gtao_camera camera;
    size_t size;
    void *scratch;
    int ok = 1;

    memset(&desc, 0, sizeof desc);
    memset(&output, 0, sizeof output);
    memset(&stats, 0, sizeof stats);

    for (int i = 0; i < WIDTH * HEIGHT; i++)
        depth[i] = 2.0f;
    desc.width = WIDTH;
    desc.height = HEIGHT;
    desc.depth = depth;
    desc.camera = gtao_camera_from_fov(60.0f, WIDTH, HEIGHT);
    desc.radius = 1.0f;
    output.visibility = visibility;
    size = gtao_scratch_size(&desc);
    scratch = malloc(size);
    ok &= gtao_compute(&desc, &output, scratch, size, &stats) == GTAO_OK;
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        ok &= visibility[i] > 0.99f && visibility[i] <= 1.0f;
    ok &= gtao_begin(&desc, &output, scratch, size, &context) == GTAO_OK;
    gtao_prepare_rows(context, 0, HEIGHT);
    gtao_visibility_rows(context, 0, HEIGHT, &stats);
    ok &= gtao_context_slices(context) > 0 && gtao_context_steps(context) > 0;
    ok &= gtao_isa_available(gtao_context_isa(context));
    printf("%s %s\n", gtao_result_string(GTAO_OK), gtao_isa_name(gtao_context_isa(context)));

    gtao_sincos(1.0f, &s, &c);
    ok &= gtao_atan2(s, c) > 0.999f && gtao_acos(c) > 0.999f;
    gtao_arc_bent(-1.0f, 1.0f, 0.0f, t);
    ok &= gtao_arc(1.0f, 0.0f) > 0.0f && gtao_arc_uniform(1.0f) > 0.0f && t[1] > 0.0f;
    bent[0] = bent[1] = 0.0f, bent[2] = -1.0f;
    gtao_sh_basis(bent, sh);
    gtao_sh_rotate(identity, sh, rotated);
    gtao_arc_sh(-1.0f, 1.0f, 0.0f, identity, bent, sh);
    gtao_sh_from_cone(gtao_cone_cosine(0.5f, 1.0f), bent, bent, sh);
    gtao_irradiance(sh, probe, rgb);
    gtao_irradiance_rows(&desc, &output, probe, rgb, 0, 0, 0);
    ok &= sh[0] > 0.0f && rotated[0] > 0.0f;
    gtao_multi_bounce_rgb(gtao_multi_bounce(0.5f, gtao_multi_bounce_series(0.5f, 0.5f)), albedo, rgb);
    gtao_noise_at(GTAO_NOISE_MEMO, 1, 2, 3, &s, &c);
    bent[0] = bent[1] = 0.0f;
    bent[2] = -1.0f;
    gtao_unpack(gtao_pack(rgb[0], bent), &s, bent);
    ok &= gtao_camera_from_projection(projection, GTAO_CLIP_ZERO_TO_ONE, 0, WIDTH, HEIGHT, &camera, &scale, &bias) ==
          GTAO_OK;
    free(scratch);
    return ok && strict_second_unit() == 1 ? 0 : 1;
}
