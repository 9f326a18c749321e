/* Uses every public function, as C and as C++; with -DGTAO_STATIC -DGTAO_IMPLEMENTATION on its own, else with impl.c. */
#include "gtao.h"
#include "gtso.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int strict_second_unit(void);

static int use_specular(void) {
    static float data[8 * 8 * 8], env_table[2 * 8 * 8];
    const float n[3] = {0, 0, 1}, visibility = 0.5f, roughness = 0.5f;
    float u[GTSO_AXIS_COUNT], env[2], texels[16] = {0}, occluded, open, out = 0.0f;
    uint8_t block[8];
    gtso_table_desc table, resolved;
    gtso_lookup_desc lookup;
    gtso_slice slice;
    gtso_point point;
    int ok = 1;

    memset(&table, 0, sizeof table);
    memset(&lookup, 0, sizeof lookup);
    memset(&slice, 0, sizeof slice);
    table.size[0] = table.size[1] = table.size[2] = 8;
    ok &= gtso_table_resolve(&table, &resolved) == GTSO_OK && gtso_table_axes(&table) == 3;
    ok &= gtso_table_count(&table) == 512 && gtso_table_rows(&table) == 64;
    ok &= gtso_bake(&table, data, NULL) == GTSO_OK && gtso_bake_rows(&table, data, 1, 2, NULL) == GTSO_OK;
    lookup.width = lookup.height = 1;
    lookup.table = &table;
    lookup.data = data;
    lookup.visibility = &visibility;
    lookup.bent_normals = lookup.normals = lookup.views = n;
    lookup.roughness = &roughness;
    lookup.output = &out;
    ok &= gtso_lookup(&lookup) == GTSO_OK && gtso_lookup_rows(&lookup, 0, 1) == GTSO_OK;
    ok &= out > 0.5f && out < 1.0f && gtso_lookup_at(&table, data, visibility, n, n, n, roughness) == out;
    point.aperture_rad = gtao_acos(gtso_cos_aperture_tilted(visibility, 1.0f));
    point.beta_rad = point.view_rad = point.azimuth_rad = 0.0f;
    point.roughness = roughness;
    gtso_table_coords(&table, &point, u);
    gtso_table_point(&table, u, &point);
    ok &= gtso_table_sample(&table, data, &point) > 0.5f && gtso_table_exact(&table, &point) > 0.5f;
    ok &= gtso_cap_intersection(GTSO_CAPS_EXACT, 1.0f, 1.0f, 1.0f) > 0.5f;
    ok &= gtso_cone_visibility(GTSO_CAPS_OAT, 1.0f, gtso_lobe_aperture(GTSO_FIT_ULUDAG, roughness), 0.0f) > 0.9f;
    ok &= gtso_cos_aperture_uniform(visibility) == 0.5f;
    ok &= gtso_lobe_visibility(GTSO_LOBE_PHONG, GTSO_FRAME_REFLECTION, 1.0f, 0.0f, roughness) > 0.5f;
    ok &= gtso_brdf_visibility(n, n, n, 1.0f, roughness, 0.04f, &occluded, &open) > 0.5f && open > occluded;
    slice.direction[0] = 1.0f;
    slice.h0_rad = -1.5f;
    slice.h1_rad = 1.5f;
    ok &= gtso_horizon_visibility(n, n, &slice, 1, roughness, 0.04f, NULL, NULL) > 0.9f;
    ok &= gtso_brdf(n, n, n, roughness, 0.04f) > 0.0f;
    gtso_env_brdf(1.0f, roughness, env);
    ok &= gtso_env_bake_rows(8, 8, env_table, 0, 8, NULL) == GTSO_OK && env[0] > 0.5f;
    gtso_env_lookup(8, 8, env_table, 1.0f, roughness, env);
    ok &= env[0] > 0.5f;
    gtso_bc4_encode_block(texels, block);
    gtso_bc4_decode_block(block, texels);
    return ok && texels[0] == 0.0f && strcmp(gtso_result_string(GTSO_OK), "ok") == 0;
}

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
    int ok = use_specular();

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
