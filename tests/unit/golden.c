/* Golden hashes: a stand-alone program that needs nothing but a C library, to be built by every compiler for every
 * target.
 *
 *   golden                prints a name and a hash for every setting, scalar kernel
 *   golden FILE           compares every kernel that runs here with FILE; exit status 1 if any hash differs
 */
#define GTAO_IMPLEMENTATION
#include "gtao.h"

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

static uint64_t hash_setting(const setting *s, gtao_isa isa, gtao_format format) {
    layout tight = {0, 0, 0};
    input in = input_make(s, 67, 45, tight);
    result r;
    uint64_t h = hash_start;
    in.desc.isa = isa;
    r = result_make(&in.desc, format == GTAO_FORMAT_FLOAT ? WANT_ALL : WANT_VISIBILITY, format, 3, tight, 0);
    if (gtao_compute(&in.desc, &r.output, r.scratch, r.scratch_size, NULL) != GTAO_OK)
        h = 0;
    h = hash_plane(hash_plane(hash_plane(h, &r.visibility), &r.bent), &r.packed);
    result_free(&r);
    input_free(&in);
    return h;
}

/* Sweeps with and without a radius, their horizon maps, and sums kept between batches. */
static uint64_t hash_sweep(const setting *s, gtao_isa isa, int wrap) {
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
        r = result_make(&in.desc, WANT_ALL, GTAO_FORMAT_FLOAT, 3, tight, 0);
        horizons = plane_make(6 * 45, sizeof(float) * 67, tight);
        options.horizons = (float *)(void *)horizons.first;
        options.batch = 2;
        size = gtao_sweep_scratch_size(&in.desc, &r.output, &options) + gtao_sweep_work_size(&in.desc, &options);
        scratch = malloc(size);
        if (gtao_sweep_compute(&in.desc, &r.output, &options, scratch, size, NULL, NULL) != GTAO_OK)
            h = 0;
        h = hash_plane(hash_plane(hash_plane(hash_plane(h, &r.visibility), &r.bent), &r.packed), &horizons);
        free(scratch);
        free(horizons.memory);
        result_free(&r);
    }
    input_free(&in);
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

typedef struct entry {
    const char *name;
    uint64_t hash;
} entry;

/* Every hash with one kernel; returns how many. */
static int hash_all(gtao_isa isa, entry *entries) {
    int count = 0;
    for (int i = 0; i < SETTING_COUNT; i++, count++) {
        entries[count].name = settings[i].name;
        entries[count].hash = hash_setting(&settings[i], isa, GTAO_FORMAT_FLOAT);
    }
    entries[count].name = "unorm8";
    entries[count++].hash = hash_setting(&settings[0], isa, GTAO_FORMAT_UNORM8);
    entries[count].name = "unorm16";
    entries[count++].hash = hash_setting(&settings[0], isa, GTAO_FORMAT_UNORM16);
    entries[count].name = "formulas";
    entries[count++].hash = hash_formulas();
    for (int i = 0, k = 0; i < SETTING_COUNT; i++)
        if (strcmp(settings[i].name, "default") == 0 || strcmp(settings[i].name, "height-every-pixel") == 0) {
            entries[count].name = k++ ? "sweep-height" : "sweep-perspective";
            entries[count++].hash = hash_sweep(&settings[i], isa, k == 2);
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
    static entry entries[SETTING_COUNT + 5];
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
