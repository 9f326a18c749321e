/* render.c - see render.h */
#include "render.h"

#include "canvas.h"
#include "cli.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const char *const render_show_names[RENDER_SHOWS + 1] = {"shaded",  "visibility", "bent",   "depth",
                                                         "normals", "albedo",     "motion", NULL};

/* ---- the dome ----------------------------------------------------------------------------------------------------- */

static float clamp01(float v) {
    return v > 0.0f ? v < 1.0f ? v : 1.0f : 0.0f;
}

static float mix(float a, float b, float t) {
    return a + (b - a) * t;
}

/* Radiance from a unit direction, y up: a blue zenith, a pale horizon, a broad warm glow where the sun is behind haze,
 * and sunlit ground below. */
static void dome_radiance(const float d[3], float rgb[3]) {
    static const float zenith[3] = {0.20f, 0.38f, 0.78f}, horizon[3] = {0.80f, 0.86f, 0.92f},
                       ground[3] = {0.34f, 0.26f, 0.18f}, glow[3] = {5.2f, 3.9f, 2.4f}, sun[3] = {-0.60f, 0.60f, 0.53f};
    float up = d[1], at_sun = clamp01(d[0] * sun[0] + d[1] * sun[1] + d[2] * sun[2]);
    float lobe = at_sun * at_sun;
    lobe *= lobe * lobe * at_sun; /* cos^7 */
    for (int k = 0; k < 3; ++k) {
        float sky = mix(horizon[k], zenith[k], sqrtf(clamp01(up)));
        rgb[k] = mix(ground[k], sky + glow[k] * lobe, clamp01(0.5f + 8.0f * up));
    }
}

static void probe_basis(const float d[3], float b[9]) {
    float x = d[0], y = d[1], z = d[2];
    b[0] = 1.0f;
    b[1] = x, b[2] = y, b[3] = z;
    b[4] = x * y, b[5] = y * z, b[6] = x * z, b[7] = x * x - y * y, b[8] = 3.0f * z * z - 1.0f;
}

/* Irradiance over pi from the direction n is (n, 1)^T M (n, 1) for each colour: the dome in nine spherical harmonics,
 * convolved with the cosine (Ramamoorthi and Hanrahan 2001, An efficient representation for irradiance environment
 * maps). */
static void probe_of_dome(float matrix[3][4][4]) {
    enum { ROWS = 64, COLUMNS = 128 };
    static const double mean_square[9] = {1.0,      1 / 3.0,  1 / 3.0,  1 / 3.0, 1 / 15.0,
                                          1 / 15.0, 1 / 15.0, 4 / 15.0, 4 / 5.0};
    double sum[9][3] = {{0}};
    for (int j = 0; j < ROWS; ++j)
        for (int i = 0; i < COLUMNS; ++i) {
            double up = 1 - 2 * (j + 0.5) / ROWS, a = 2 * V3_PI * (i + 0.5) / COLUMNS, s = sqrt(1 - up * up);
            float d[3] = {(float)(s * cos(a)), (float)up, (float)(s * sin(a))}, rgb[3], b[9];
            dome_radiance(d, rgb);
            probe_basis(d, b);
            for (int c = 0; c < 9; ++c)
                for (int k = 0; k < 3; ++k)
                    sum[c][k] += (double)rgb[k] * (double)b[c] / (ROWS * COLUMNS);
        }
    for (int k = 0; k < 3; ++k) {
        float c[9], (*m)[4] = matrix[k];
        for (int i = 0; i < 9; ++i)
            c[i] = (float)(sum[i][k] / mean_square[i] * (i == 0 ? 1 : i < 4 ? 2 / 3.0 : 1 / 4.0));
        m[0][0] = c[7], m[1][1] = -c[7], m[2][2] = 3.0f * c[8], m[3][3] = c[0] - c[8];
        m[0][1] = m[1][0] = 0.5f * c[4], m[1][2] = m[2][1] = 0.5f * c[5], m[0][2] = m[2][0] = 0.5f * c[6];
        for (int i = 0; i < 3; ++i)
            m[i][3] = m[3][i] = 0.5f * c[1 + i];
    }
}

/* A filmic curve (Narkowicz 2015, ACES filmic tone mapping curve), then sRGB. */
static void tone_table(unsigned char encode[4096]) {
    for (int i = 0; i < 4096; ++i) {
        float v = 0.56f * ((float)i + 0.5f) / 1024.0f, t = v * (2.51f * v + 0.03f) / (v * (2.43f * v + 0.59f) + 0.14f);
        color c = {t, t, t};
        encode[i] = (unsigned char)(color_encode(c).r * 255.0f + 0.5f);
    }
}

/* ---- frames ------------------------------------------------------------------------------------------------------- */

int render_create(renderer *r, const mesh *m, int width, int height) {
    memset(r, 0, sizeof *r);
    size_t pixels = (size_t)width * (size_t)height;
    r->width = width;
    r->height = height;
    r->raster = raster_create(m, width, height);
    r->buffers.depth = malloc(pixels * sizeof(float));
    r->buffers.normals = malloc(pixels * 3 * sizeof(float));
    r->buffers.albedo = malloc(pixels * 3 * sizeof(float));
    r->buffers.motion = malloc(pixels * 3 * sizeof(float));
    r->visibility = malloc(pixels * sizeof(float));
    r->bent = malloc(pixels * 3 * sizeof(float));
    r->picture = malloc(pixels * sizeof *r->picture);
    probe_of_dome(r->probe);
    tone_table(r->encode);
    if (r->raster && r->buffers.depth && r->buffers.normals && r->buffers.albedo && r->buffers.motion &&
        r->visibility && r->bent && r->picture)
        return 1;
    render_free(r);
    return 0;
}

void render_free(renderer *r) {
    raster_free(r->raster);
    free(r->buffers.depth);
    free(r->buffers.normals);
    free(r->buffers.albedo);
    free(r->buffers.motion);
    free(r->visibility);
    free(r->bent);
    free(r->picture);
    free(r->memory.state);
    memset(r, 0, sizeof *r);
}

static void add_stage(renderer *r, const char *name, double since) {
    if (r->stage_count < (int)(sizeof r->stages / sizeof *r->stages)) {
        r->stages[r->stage_count].name = name;
        r->stages[r->stage_count++].ms = 1e3 * (cli_seconds() - since);
    }
}

double render_total_ms(const renderer *r) {
    double sum = 0.0;
    for (int i = 0; i < r->stage_count; ++i)
        sum += r->stages[i].ms;
    return sum;
}

/* ---- occlusion ---------------------------------------------------------------------------------------------------- */

void render_describe(const renderer *r, const render_settings *settings, gtao_frame_desc *frame) {
    gtao_desc *desc = &frame->desc;
    memset(frame, 0, sizeof *frame);
    desc->width = r->width;
    desc->height = r->height;
    desc->depth = r->buffers.depth;
    desc->normals = r->buffers.normals;
    desc->camera.fx = (float)r->view.focal_px;
    desc->radius = settings->radius;
    desc->falloff = 0.25f;
    desc->preset = GTAO_PRESET_LOW;
    frame->half = !settings->no_half;
    frame->no_spatial = settings->no_spatial;
    frame->no_temporal = settings->no_temporal;
    frame->motion = r->buffers.motion;
    frame->motion_components = 3;
    frame->cut = settings->cut;
}

typedef struct stage_run {
    gtao_frame_context *context;
    int stage;
} stage_run;

static void run_units(void *user, int thread, int unit_begin, int unit_end) {
    const stage_run *run = user;
    (void)thread;
    gtao_frame_run(run->context, run->stage, unit_begin, unit_end, NULL);
}

int render_occlude(const gtao_frame_desc *frame, const gtao_output *output, render_memory *memory, pool *workers,
                   renderer *times, const char **error) {
    stage_run run = {NULL, 0};
    size_t size = gtao_frame_state_size(frame);
    if (size > memory->size) {
        free(memory->state);
        memory->state = calloc(1, size);
        memory->size = memory->state ? size : 0;
    }
    gtao_result result = gtao_frame_begin(frame, output, memory->state, memory->size, &run.context);
    if (result != GTAO_OK) {
        *error = gtao_result_string(result);
        return 0;
    }
    for (; run.stage < gtao_frame_stages(run.context); ++run.stage) {
        double t = cli_seconds();
        pool_run(workers, gtao_frame_units(run.context, run.stage), 0, run_units, NULL, &run);
        if (times)
            add_stage(times, gtao_frame_stage_name(run.context, run.stage), t);
    }
    return 1;
}

static int occlude(renderer *r, const render_settings *settings, pool *workers, const char **error) {
    gtao_frame_desc frame;
    gtao_output output;
    render_describe(r, settings, &frame);
    memset(&output, 0, sizeof output);
    output.visibility = r->visibility;
    output.bent_normals = r->bent;
    return render_occlude(&frame, &output, &r->memory, workers, r, error);
}

/* ---- pictures ----------------------------------------------------------------------------------------------------- */

typedef struct paint {
    renderer *r;
    const render_settings *settings;
    render_show show;
    float view_to_world[9];
    float light[10][4]; /* coefficients of xx, xy, xz, x, yy, yz, y, zz, z, 1 of a view space direction, by colour */
} paint;

static void paint_begin(paint *p) {
    const double *m = p->r->view.world_to_view.m;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            p->view_to_world[3 * i + j] = (float)m[4 * j + i];
    /* The probe's matrices turned to view space: R M R^T. */
    memset(p->light, 0, sizeof p->light);
    for (int k = 0; k < 3; ++k) {
        float turned[4][4] = {{0}}, r[4][4] = {{0}};
        r[3][3] = 1.0f;
        for (int i = 0; i < 9; ++i)
            r[i / 3][i % 3] = (float)m[4 * (i / 3) + i % 3];
        for (int i = 0; i < 256; ++i) {
            int a = i >> 6, b = i >> 4 & 3, c = i >> 2 & 3, d = i & 3;
            turned[a][b] += r[a][c] * p->r->probe[k][c][d] * r[b][d];
        }
        for (int i = 0, n = 0; i < 4; ++i)
            for (int j = i; j < 4; ++j, ++n)
                p->light[n][k] = turned[i][j] * (i == j ? 1.0f : 2.0f);
    }
}

static void light_at(const paint *p, const float n[3], float rgb[4]) {
    float x = n[0], y = n[1], z = n[2];
    const float f[10] = {x * x, x * y, x * z, x, y * y, y * z, y, z * z, z, 1.0f};
    for (int k = 0; k < 4; ++k) /* four, for vectors */
        rgb[k] = 0.0f;
    for (int i = 0; i < 10; ++i)
        for (int k = 0; k < 4; ++k)
            rgb[k] += p->light[i][k] * f[i];
}

static void to_world(const paint *p, const float v[3], float w[3]) {
    const float *m = p->view_to_world;
    for (int i = 0; i < 3; ++i)
        w[i] = m[3 * i] * v[0] + m[3 * i + 1] * v[1] + m[3 * i + 2] * v[2];
}

static uint32_t pack_linear(const paint *p, const float rgb[3]) {
    uint32_t packed = 0;
    for (int k = 0; k < 3; ++k) {
        float v = rgb[k] * 1024.0f;
        packed = packed << 8 | p->r->encode[v > 0.0f ? v < 4095.0f ? (int)v : 4095 : 0];
    }
    return packed;
}

static uint32_t pack_color(color c) {
    uint32_t r = (uint32_t)(clamp01(c.r) * 255.0f + 0.5f), g = (uint32_t)(clamp01(c.g) * 255.0f + 0.5f),
             b = (uint32_t)(clamp01(c.b) * 255.0f + 0.5f);
    return r << 16 | g << 8 | b;
}

/* Albedo times the dome's light from along the bent normal, as far as it gets here. */
static uint32_t shaded(const paint *p, int x, int y, size_t i) {
    const renderer *r = p->r;
    float world[3], light[4], rgb[3];
    if (!isfinite(r->buffers.depth[i])) {
        float ray[3] = {((float)x + 0.5f - (float)r->view.cx) / (float)r->view.focal_px,
                        ((float)y + 0.5f - (float)r->view.cy) / (float)r->view.focal_px, 1.0f};
        to_world(p, ray, world);
        float scale = 1.0f / sqrtf(world[0] * world[0] + world[1] * world[1] + world[2] * world[2]);
        for (int k = 0; k < 3; ++k)
            world[k] *= scale;
        dome_radiance(world, rgb);
        return pack_linear(p, rgb);
    }
    const float *albedo = r->buffers.albedo + 3 * i;
    float v = p->settings->no_occlusion ? 1.0f : r->visibility[i];
    const float *n = r->buffers.normals + 3 * i, *bent = r->bent + 3 * i;
    float direction[3] = {n[0], n[1], n[2]};
    if (!p->settings->no_occlusion && !p->settings->no_bent) {
        /* Filters wash detail out of bent normals; where little is hidden the surface's own normal is nearer to truth. */
        float square = 0.0f, scale;
        for (int k = 0; k < 3; ++k) {
            direction[k] = mix(bent[k], n[k], v * v);
            square += direction[k] * direction[k];
        }
        scale = 1.0f / sqrtf(square > 1e-12f ? square : 1.0f);
        for (int k = 0; k < 3; ++k)
            direction[k] *= scale;
    }
    light_at(p, direction, light);
    for (int k = 0; k < 3; ++k)
        rgb[k] = albedo[k] * light[k] * (p->settings->no_bounce ? v : gtao_multi_bounce_series(v, albedo[k]));
    return pack_linear(p, rgb);
}

static uint32_t direction_color(const float n[3]) { /* the way normal maps look: y up, z to the eye */
    color c = {0.5f + 0.5f * n[0], 0.5f - 0.5f * n[1], 0.5f - 0.5f * n[2]};
    return pack_color(c);
}

/* Hue by direction, strength by speed on a logarithmic scale. */
static uint32_t motion_color(const float motion[3]) {
    color still = {0.12f, 0.12f, 0.13f}, c;
    float speed = sqrtf(motion[0] * motion[0] + motion[1] * motion[1]);
    if (!isfinite(speed))
        return 0xff00ff;
    float scale = speed > 1e-4f ? 1.0f / speed : 0.0f, strength = clamp01(log2f(1.0f + 8.0f * speed) / 8.0f);
    float a = motion[0] * scale, b = motion[1] * scale;
    c.r = clamp01(0.5f + 0.5f * a);
    c.g = clamp01(0.5f - 0.25f * a - 0.43f * b);
    c.b = clamp01(0.5f - 0.25f * a + 0.43f * b);
    return pack_color(color_mix(still, c, strength));
}

static void paint_rows(void *user, int thread, int row_begin, int row_end) {
    const paint *p = user;
    const renderer *r = p->r;
    (void)thread;
    for (int y = row_begin; y < row_end; ++y)
        for (int x = 0; x < r->width; ++x) {
            size_t i = (size_t)y * (size_t)r->width + (size_t)x;
            const float *albedo = r->buffers.albedo + 3 * i;
            float z = r->buffers.depth[i], v = r->visibility[i];
            color c;
            uint32_t packed = 0x1e2126; /* sky */
            if (p->show == RENDER_SHADED)
                packed = shaded(p, x, y, i);
            else if (p->show == RENDER_MOTION)
                packed = motion_color(r->buffers.motion + 3 * i);
            else if (isfinite(z))
                switch (p->show) {
                case RENDER_VISIBILITY:
                    c.r = c.g = c.b = p->settings->no_occlusion ? 1.0f : v;
                    packed = pack_color(c);
                    break;
                case RENDER_DEPTH: /* equal ratios of distance, equal steps of tone */
                    packed = pack_color(color_depth(0.5f + 0.4f * logf(z / (6.0f * p->settings->radius))));
                    break;
                case RENDER_ALBEDO:
                    c.r = albedo[0], c.g = albedo[1], c.b = albedo[2];
                    packed = pack_color(color_encode(c));
                    break;
                case RENDER_BENT:
                    packed = direction_color((p->settings->no_occlusion ? r->buffers.normals : r->bent) + 3 * i);
                    break;
                default:
                    packed = direction_color(r->buffers.normals + 3 * i);
                    break;
                }
            r->picture[i] = packed;
        }
}

int render_frame(renderer *r, const raster_view *view, const render_settings *settings, render_show show, pool *workers,
                 const char **error) {
    r->stage_count = 0;
    r->view = *view;
    double t = cli_seconds();
    if (!raster_draw(r->raster, view, workers)) {
        *error = "out of memory";
        return 0;
    }
    add_stage(r, "draw", t);
    t = cli_seconds();
    raster_shade(r->raster, &r->buffers, workers);
    add_stage(r, "attributes", t);
    if (!settings->no_occlusion && !occlude(r, settings, workers, error))
        return 0;
    paint p;
    t = cli_seconds();
    p.r = r;
    p.settings = settings;
    p.show = show;
    paint_begin(&p);
    pool_run(workers, r->height, 0, paint_rows, NULL, &p);
    add_stage(r, "light", t);
    return 1;
}
