/* Golden hashes: a stand-alone program that needs nothing but a C library, to be built by every compiler for every
 * target.
 *
 *   golden                prints a name and a hash for every setting, scalar kernel
 *   golden FILE           compares every kernel that runs here with FILE; exit status 1 if any hash differs
 */
#define GTAO_IMPLEMENTATION
#define GTSO_IMPLEMENTATION
#include "gtao.h"
#include "gtso.h"

#include "inputs.h"

#include <stdio.h>

/* FNV-1a, 64 bits. */
static uint64_t hash_bytes(uint64_t h, const void *data, size_t size) {
    const unsigned char *bytes = (const unsigned char *)data;
    for (size_t i = 0; i < size; i++)
        h = (h ^ bytes[i]) * 1099511628211u;
    return h;
}

/* Through memory, so that no excess precision of a register enters. */
static uint64_t hash_float(uint64_t h, float f) {
    return hash_bytes(h, &f, sizeof f);
}

static uint64_t hash_plane(uint64_t h, const plane *p) {
    for (int y = 0; p->memory && y < p->rows; y++)
        h = hash_bytes(h, plane_row(p, y), p->row_bytes);
    return h;
}

static const uint64_t hash_start = 14695981039346656037u;

static uint64_t hash_setting(const setting *s, gtao_isa isa, gtao_format format, int want) {
    layout tight = {0, 0, 0};
    input in = input_make(s, 67, 45, tight);
    result r;
    uint64_t h = hash_start;
    in.desc.isa = isa;
    r = result_make(&in.desc, want, format, 3, tight, 0);
    if (gtao_compute(&in.desc, &r.output, r.scratch, r.scratch_size, NULL) != GTAO_OK)
        h = 0;
    h = hash_plane(hash_plane(hash_plane(hash_plane(h, &r.visibility), &r.bent), &r.packed), &r.sh);
    result_free(&r);
    input_free(&in);
    return h;
}

static uint64_t hash_estimate(const setting *s) {
    layout tight = {0, 0, 0};
    input in = input_make(s, 67, 45, tight);
    size_t size = gtao_thickness_scratch_size(&in.desc);
    plane map = plane_make(45, sizeof(float) * 67, tight);
    void *scratch = malloc(size);
    uint64_t h = 0;
    if (scratch && gtao_estimate_thickness(&in.desc, (float *)(void *)map.first, 0, scratch, size) == GTAO_OK)
        h = hash_plane(hash_start, &map);
    free(scratch);
    free(map.memory);
    input_free(&in);
    return h;
}

/* Sweeps with and without a radius, their horizon maps, and sums kept between batches. */
static uint64_t hash_sweep(const setting *s, gtao_isa isa, int wrap, int want) {
    layout tight = {0, 0, 0};
    input in = input_make(s, 67, 45, tight);
    gtao_sweep_options options = {0};
    plane horizons;
    result r;
    uint64_t h = hash_start;
    for (int bounded = 0; bounded < 2; bounded++) {
        size_t size;
        void *scratch;
        in.desc.isa = isa;
        in.desc.slices = 3;
        in.desc.radius = bounded ? 1.5f : HUGE_VALF;
        in.desc.border = wrap ? GTAO_BORDER_WRAP : GTAO_BORDER_OPEN;
        r = result_make(&in.desc, want, GTAO_FORMAT_FLOAT, 3, tight, 0);
        horizons = plane_make(6 * 45, sizeof(float) * 67, tight);
        options.horizons = (float *)(void *)horizons.first;
        options.batch = 2;
        size = gtao_sweep_scratch_size(&in.desc, &r.output, &options) + gtao_sweep_work_size(&in.desc, &options);
        scratch = malloc(size);
        if (gtao_sweep_compute(&in.desc, &r.output, &options, scratch, size, NULL, NULL) != GTAO_OK)
            h = 0;
        h = want == WANT_SH
                ? hash_plane(h, &r.sh)
                : hash_plane(hash_plane(hash_plane(hash_plane(h, &r.visibility), &r.bent), &r.packed), &horizons);
        free(scratch);
        free(horizons.memory);
        result_free(&r);
    }
    input_free(&in);
    return h;
}

/* Five frames of a sequence. */
static uint64_t hash_frames(const frame_setting *f, gtao_isa isa) {
    layout tight = {0, 0, 0};
    const setting *s = &settings[(f - frame_settings) % SETTING_COUNT];
    sequence q = sequence_make(s, 91, 45, &f->frame, tight);
    uint64_t h = hash_start;
    q.frame.desc.isa = isa;
    for (int k = 0; k < 5; k++) {
        sequence_fill(&q, s, k);
        if (sequence_run(&q, k, NULL) != GTAO_OK)
            h = 0;
        h = hash_plane(hash_plane(hash_plane(h, &q.out.visibility), &q.out.bent), &q.out.packed);
        if (q.out.sh.memory)
            h = hash_plane(h, &q.out.sh);
    }
    sequence_free(&q);
    return h;
}

/* The formulas of level 3 over a sweep. */
static uint64_t hash_formulas(void) {
    uint64_t h = hash_start;
    uint32_t state = 1;
    for (int i = 0; i < 4096; i++) {
        float a = (float)((int32_t)next_random(&state) - 8388608) / 8388608.0f; /* [-1, 1) */
        float b = (float)((int32_t)next_random(&state) - 8388608) / 8388608.0f;
        float t[2], n[3], s, c, direction, offset, visibility;
        uint32_t packed;
        h = hash_float(h, gtao_acos(a));
        gtao_sincos(6.25f * b, &s, &c);
        h = hash_float(hash_float(h, s), c);
        h = hash_float(h, gtao_atan2(a, b));
        h = hash_float(h, gtao_arc(1.5f * a, 1.5f * b));
        h = hash_float(h, gtao_arc_uniform(1.5f * a));
        gtao_arc_bent(a > 0 ? -a : a, b > 0 ? b : -b, 0.5f * (a + b), t);
        h = hash_float(hash_float(h, t[0]), t[1]);
        h = hash_float(h, gtao_multi_bounce(a * a, b * b));
        gtao_noise_at((gtao_noise)(i % 3), i & 127, i >> 5, (uint32_t)i, &direction, &offset);
        h = hash_float(hash_float(h, direction), offset);
        n[0] = a;
        n[1] = b;
        n[2] = -1.0f;
        packed = gtao_pack(a * b, n);
        h = hash_bytes(h, &packed, sizeof packed);
        gtao_unpack(packed, &visibility, n);
        h = hash_float(hash_float(hash_float(h, visibility), n[0]), n[2]);
    }
    return h;
}

/* Those of spherical harmonics. */
static uint64_t hash_sh_formulas(void) {
    uint64_t h = hash_start;
    uint32_t state = 2;
    for (int i = 0; i < 1024; i++) {
        float a[12], n[3] = {0, 0.6f, -0.8f}, b[3] = {0.48f, 0.6f, -0.64f}, sh[9], turned[9], probe[27], rgb[3];
        for (int k = 0; k < 12; k++)
            a[k] = (float)((int32_t)next_random(&state) - 8388608) / 8388608.0f;
        gtao_sh_basis(a, sh);
        gtao_sh_rotate(a + 3, sh, turned);
        for (int k = 0; k < 9; k++) {
            h = hash_float(h, turned[k]);
            probe[3 * k] = turned[k], probe[3 * k + 1] = sh[k], probe[3 * k + 2] = -sh[k];
        }
        gtao_arc_sh(a[0] < 0 ? a[0] : -a[0], a[1] < 0 ? -a[1] : a[1], 0.5f * (a[2] + a[3]), n, b, sh);
        gtao_irradiance(sh, probe, rgb);
        h = hash_float(hash_float(hash_float(h, rgb[0]), rgb[1]), rgb[2]);
        gtao_sh_from_cone(a[4] * a[4], b, n, sh);
        for (int k = 0; k < 9; k++)
            h = hash_float(h, sh[k]);
        h = hash_float(h, gtao_cone_cosine(a[5], a[6]));
    }
    return h;
}

/* gtso.h: tables of every kind, the largest in part, and lookups in them. */
static uint64_t hash_specular(gtso_kind kind, gtao_isa isa) {
    enum { WIDTH = 67, HEIGHT = 16 };
    static float tables[4][8 * 8 * 8 * 8 * 4], visibility[WIDTH * HEIGHT], roughness[WIDTH * HEIGHT];
    static float bent[3 * WIDTH * HEIGHT], normals[3 * WIDTH * HEIGHT], views[4 * WIDTH * HEIGHT];
    static float output[WIDTH * HEIGHT];
    /* Unit vectors without a root: nothing here is told to round as the library does. */
    static const int quadruples[9][4] = {{1, 2, 2, 3},  {2, 3, 6, 7},   {1, 4, 8, 9},   {4, 4, 7, 9},   {2, 6, 9, 11},
                                         {6, 6, 7, 11}, {3, 4, 12, 13}, {2, 5, 14, 15}, {2, 10, 11, 15}};
    gtso_table_desc table;
    gtso_lookup_desc lookup;
    float *data = tables[kind];
    uint32_t state = 1;
    uint64_t h = hash_start;
    memset(&table, 0, sizeof table);
    memset(&lookup, 0, sizeof lookup);
    table.kind = kind;
    for (int i = 0; i < 4; i++)
        table.size[i] = 8;
    table.size[4] = 4;
    /* Baking knows no kernels: once. */
    if (isa == GTAO_ISA_SCALAR) {
        int rows = gtso_table_rows(&table), baked = rows < 256 ? rows : 256;
        if (gtso_bake_rows(&table, data, 0, baked, NULL) != GTSO_OK)
            return 0;
        for (size_t i = (size_t)baked * 8; i < gtso_table_count(&table); i++)
            data[i] = (float)next_random(&state) / 16777216.0f;
    }
    h = hash_bytes(h, data, gtso_table_count(&table) * sizeof *data);
    state = 1;
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        float n[3][3]; /* mostly towards the eye */
        for (int k = 0; k < 3; k++) {
            const uint32_t pick = next_random(&state);
            const int *q = quadruples[pick % 9];
            const int turn = (int)(pick / 16 % 3);
            for (int j = 0; j < 3; j++)
                n[k][j] = (float)q[(j + turn) % 3] / (float)q[3];
            n[k][0] = pick & 1024 ? -n[k][0] : n[k][0];
            n[k][1] = pick & 2048 ? -n[k][1] : n[k][1];
            n[k][2] = -n[k][2];
        }
        memcpy(bent + 3 * i, n[0], sizeof n[0]);
        memcpy(normals + 3 * i, n[1], sizeof n[1]);
        memcpy(views + 4 * i, n[2], sizeof n[2]);
        visibility[i] = (float)next_random(&state) / 16777216.0f;
        roughness[i] = (float)next_random(&state) / 16777216.0f;
    }
    lookup.width = WIDTH;
    lookup.height = HEIGHT;
    lookup.table = &table;
    lookup.data = data;
    lookup.visibility = visibility;
    lookup.bent_normals = bent;
    lookup.normals = normals;
    lookup.views = views;
    lookup.view_components = 4;
    lookup.roughness = roughness;
    lookup.output = output;
    lookup.isa = isa;
    if (gtso_lookup(&lookup) != GTSO_OK)
        return 0;
    return hash_bytes(h, output, sizeof output);
}

static uint64_t hash_specular_formulas(void) {
    uint64_t h = hash_start;
    uint32_t state = 1;
    for (int i = 0; i < 512; i++) {
        float x[5], occluded, open, env[2], texels[16];
        const float n[3] = {0.25f, -0.5f, -1.0f};
        float v[3] = {0.0f, 0.0f, -1.0f}, b[3];
        gtso_slice slices[2];
        uint8_t block[8];
        for (int k = 0; k < 5; k++)
            x[k] = (float)next_random(&state) / 16777216.0f;
        v[0] = x[0] - 0.5f;
        b[0] = x[1] - 0.5f;
        b[1] = x[2] - 0.5f;
        b[2] = -1.0f;
        h = hash_float(h, gtso_cos_aperture(x[0]));
        h = hash_float(h, gtso_cos_aperture_tilted(x[0], x[1]));
        for (int k = 0; k < 3; k++) {
            h = hash_float(h, gtso_lobe_aperture((gtso_fit)k, x[1]));
            h = hash_float(h, gtso_cap_intersection((gtso_caps)k, 3.0f * x[0], 3.0f * x[1], 3.0f * x[2]));
            h = hash_float(h, gtso_cone_visibility((gtso_caps)k, 1.5f * x[0], 1.5f * x[1], 3.0f * x[2]));
        }
        h = hash_float(h, gtso_brdf(n, v, b, x[3], x[4]));
        for (int k = 0; k < 16; k++)
            texels[k] = (float)next_random(&state) / 16777216.0f * x[k % 5];
        gtso_bc4_encode_block(texels, block);
        h = hash_bytes(h, block, sizeof block);
        gtso_bc4_decode_block(block, texels);
        h = hash_bytes(h, texels, sizeof texels);
        if (i % 8)
            continue;
        h = hash_float(
            h, gtso_lobe_visibility((gtso_lobe)(i / 8 % 5), (gtso_frame)(i / 16 % 2), 1.5f * x[0], 2.5f * x[1], x[2]));
        h = hash_float(h, gtso_brdf_visibility(n, v, b, 1.5f * x[3], x[4], 0.04f, &occluded, &open));
        h = hash_float(hash_float(h, occluded), open);
        for (int k = 0; k < 2; k++) {
            slices[k].direction[0] = (float)!k;
            slices[k].direction[1] = (float)k;
            slices[k].direction[2] = 0.0f;
            slices[k].h0_rad = -1.5f * x[k];
            slices[k].h1_rad = 1.5f * x[k + 2];
        }
        h = hash_float(h, gtso_horizon_visibility(n, b, slices, 2, x[4], 0.5f, &occluded, &open));
        h = hash_float(hash_float(h, occluded), open);
        gtso_env_brdf(x[0], x[1], env);
        h = hash_float(hash_float(h, env[0]), env[1]);
    }
    return h;
}

typedef struct entry {
    const char *name;
    uint64_t hash;
} entry;

/* Every hash with one kernel; returns how many. */
static int hash_all(gtao_isa isa, entry *entries) {
    int count = 0;
    for (int i = 0; i < SETTING_COUNT; i++, count++) {
        entries[count].name = settings[i].name;
        entries[count].hash = hash_setting(&settings[i], isa, GTAO_FORMAT_FLOAT, WANT_ALL);
    }
    entries[count].name = "unorm8";
    entries[count++].hash = hash_setting(&settings[0], isa, GTAO_FORMAT_UNORM8, WANT_VISIBILITY);
    entries[count].name = "unorm16";
    entries[count++].hash = hash_setting(&settings[0], isa, GTAO_FORMAT_UNORM16, WANT_VISIBILITY);
    for (int i = 0; i < FRAME_SETTING_COUNT; i++, count++) {
        entries[count].name = frame_settings[i].name;
        entries[count].hash = hash_frames(&frame_settings[i], isa);
    }
    entries[count].name = "estimate";
    entries[count++].hash = hash_estimate(&settings[0]);
    entries[count].name = "formulas";
    entries[count++].hash = hash_formulas();
    entries[count].name = "sh";
    entries[count].hash = hash_sh_formulas();
    for (int i = 0; i < SETTING_COUNT; i++)
        if (!settings[i].desc.far_depth)
            entries[count].hash =
                entries[count].hash * 31u + hash_setting(&settings[i], isa, GTAO_FORMAT_FLOAT, WANT_SH);
    count++;
    entries[count].name = "sh-thickness";
    entries[count].hash = hash_start;
    for (int i = 0; i < SETTING_COUNT; i++) {
        setting thick = settings[i];
        thick.desc.thickness = 0.15f;
        if (thick.desc.estimator == GTAO_ESTIMATOR_NORMALIZED && thick.desc.thin_blend == 0.0f && !thick.desc.far_depth)
            entries[count].hash = entries[count].hash * 31u + hash_setting(&thick, isa, GTAO_FORMAT_FLOAT, WANT_SH);
    }
    count++;
    for (int kind = 0; kind < 4; kind++) {
        static const char *const names[] = {"specular-lobe", "specular-cone", "specular-brdf", "specular-bent"};
        entries[count].name = names[kind];
        entries[count++].hash = hash_specular((gtso_kind)kind, isa);
    }
    entries[count].name = "specular-formulas";
    entries[count++].hash = hash_specular_formulas();
    for (int i = 0, k = 0; i < SETTING_COUNT; i++)
        if (strcmp(settings[i].name, "default") == 0 || strcmp(settings[i].name, "height-every-pixel") == 0) {
            entries[count].name = k ? "sweep-height" : "sweep-perspective";
            entries[count++].hash = hash_sweep(&settings[i], isa, k, WANT_ALL);
            entries[count].name = k ? "sweep-height-sh" : "sweep-perspective-sh";
            entries[count++].hash = hash_sweep(&settings[i], isa, k++, WANT_SH);
        }
    return count;
}

/* Returns the number of hashes that differ from the file's. */
static int compare(FILE *file, gtao_isa isa, const entry *entries, int count) {
    char name[64];
    unsigned long high, low;
    int bad = 0, lines = 0;
    for (; fscanf(file, "%63s %8lx%8lx", name, &high, &low) == 3; lines++) {
        uint64_t want = (uint64_t)high << 32 | (uint64_t)low;
        if (lines >= count || strcmp(name, entries[lines].name) != 0) {
            printf("%s: unknown setting, or out of order\n", name);
            return bad + 1;
        }
        if (entries[lines].hash != want) {
            printf("%s %s: %08lx%08lx, not %08lx%08lx\n", gtao_isa_name(isa), name,
                   (unsigned long)(entries[lines].hash >> 32), (unsigned long)(entries[lines].hash & 0xFFFFFFFFu), high,
                   low);
            bad++;
        }
    }
    if (lines != count) {
        printf("%d settings, but %d hashes on file\n", count, lines);
        bad++;
    }
    return bad;
}

int main(int argc, char **argv) {
    static entry entries[SETTING_COUNT + FRAME_SETTING_COUNT + 15];
    int bad = 0;
    if (argc < 2) {
        int count = hash_all(GTAO_ISA_SCALAR, entries);
        for (int i = 0; i < count; i++)
            printf("%s %08lx%08lx\n", entries[i].name, (unsigned long)(entries[i].hash >> 32),
                   (unsigned long)(entries[i].hash & 0xFFFFFFFFu));
        return 0;
    }
    for (int isa = GTAO_ISA_SCALAR; isa <= GTAO_ISA_NEON; isa++) {
        FILE *file;
        if (!gtao_isa_available((gtao_isa)isa))
            continue;
        file = fopen(argv[1], "r");
        if (!file) {
            printf("%s: cannot be opened\n", argv[1]);
            return 1;
        }
        printf("%s ", gtao_isa_name((gtao_isa)isa));
        bad += compare(file, (gtao_isa)isa, entries, hash_all((gtao_isa)isa, entries));
        fclose(file);
    }
    printf(bad ? "differ: %d hashes\n" : "agree\n", bad);
    return bad != 0;
}
