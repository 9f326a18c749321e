/* bench_specular - cost of specular visibility: lookups in tables of every kind, kernel by kernel, and baking.
 *
 *     build/bench_specular [--quick]
 *
 * Processor time of one thread, median of interleaved repetitions, 960 x 540 random pixels (half of them open, as in
 * most images). "straight" is a scalar lookup as one writes it from the definition, with libm and the default table,
 * compiled as the rest of this program: -O3 -march=native. "scalar" is the library's own kernel of width 1. */
#include "gtso.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "measure.h"

enum { WIDTH = 960, HEIGHT = 540, PIXELS = WIDTH * HEIGHT };

typedef struct job {
    gtso_lookup_desc lookup;
} job;

static float visibility[PIXELS], bent[3 * PIXELS], normals[3 * PIXELS], views[3 * PIXELS], roughness[PIXELS];
static float output[PIXELS];

static float next_float(uint32_t *state) {
    *state = *state * 1664525u + 1013904223u;
    return (float)(*state >> 8) / 16777216.0f;
}

static void unit_about(uint32_t *state, float spread, float out[3]) {
    float length = 1.0f;
    out[0] = spread * (2.0f * next_float(state) - 1.0f);
    out[1] = spread * (2.0f * next_float(state) - 1.0f);
    out[2] = -1.0f;
    length = sqrtf(out[0] * out[0] + out[1] * out[1] + 1.0f);
    for (int k = 0; k < 3; ++k)
        out[k] /= length;
}

static void run_lookup(void *user) {
    const job *j = (const job *)user;
    if (gtso_lookup(&j->lookup) != GTSO_OK)
        abort();
}

static float compress(float e, float w) {
    return e / (w + fabsf(e));
}

/* From gtso_table_coords' documentation: aperture by angle, beta by its distance from the cone's edge. */
static void run_straight(void *user) {
    const job *j = (const job *)user;
    const float *data = j->lookup.data;
    const int size = j->lookup.table->size[0];
    for (int i = 0; i < PIXELS; ++i) {
        const float *n = normals + 3 * i, *b = bent + 3 * i, *v = views + 3 * i;
        float nv = fminf(fmaxf(n[0] * v[0] + n[1] * v[1] + n[2] * v[2], 0.0f), 1.0f);
        float nb = fminf(fmaxf(n[0] * b[0] + n[1] * b[1] + n[2] * b[2], -1.0f), 1.0f);
        float bv = fminf(fmaxf(b[0] * v[0] + b[1] * v[1] + b[2] * v[2], -1.0f), 1.0f);
        float aperture = acosf(sqrtf(1.0f - fminf(visibility[i] / fmaxf(nb, 1e-6f), 1.0f)));
        float beta = acosf(fminf(fmaxf(2.0f * nv * nb - bv, -1.0f), 1.0f));
        float w = 2.0f * fmaxf(roughness[i] * roughness[i], 1e-4f), a = 2.0f * sinf(0.5f * aperture);
        float lo = compress(a - 2.0f, w), hi = compress(a, w), g = compress(a - 2.0f * sinf(0.5f * beta), w);
        float u[3] = {aperture * 0.63661977f, (g - lo) / (hi - lo), roughness[i]}, f[3], value[8];
        int whole[3];
        for (int k = 0; k < 3; ++k) {
            float at = fminf(fmaxf(u[k], 0.0f), 1.0f) * (float)(size - 1);
            whole[k] = (int)at < size - 2 ? (int)at : size - 2;
            f[k] = at - (float)whole[k];
        }
        for (int k = 0; k < 8; ++k)
            value[k] = data[((whole[2] + (k >> 2)) * size + whole[1] + (k >> 1 & 1)) * size + whole[0] + (k & 1)];
        for (int k = 0; k < 4; ++k)
            value[k] = value[2 * k] + f[0] * (value[2 * k + 1] - value[2 * k]);
        for (int k = 0; k < 2; ++k)
            value[k] = value[2 * k] + f[1] * (value[2 * k + 1] - value[2 * k]);
        output[i] = value[0] + f[2] * (value[1] - value[0]);
    }
}

typedef struct baking {
    gtso_table_desc table;
    float *data;
} baking;

static void run_bake(void *user) {
    const baking *b = (const baking *)user;
    if (gtso_bake(&b->table, b->data, NULL) != GTSO_OK)
        abort();
}

int main(int argc, char **argv) {
    static const char *const kinds[] = {"full BRDF, 32^3", "cone/cone, 32^3", "full BRDF, 16^4", "bent, 16^4 x 8"};
    int repeat = argc > 1 && strcmp(argv[1], "--quick") == 0 ? 5 : 21;
    uint32_t seed = 1;
    for (int i = 0; i < PIXELS; ++i) {
        unit_about(&seed, 1.0f, normals + 3 * i);
        unit_about(&seed, 0.5f, views + 3 * i);
        unit_about(&seed, 1.0f, bent + 3 * i);
        for (int k = 0; i % 2 && k < 3; ++k)
            bent[3 * i + k] = normals[3 * i + k];
        visibility[i] = i % 2 ? 1.0f : next_float(&seed);
        roughness[i] = next_float(&seed);
    }
    printf("lookup, ns a pixel\n");
    for (int kind = 0; kind < 4; ++kind) {
        gtso_table_desc table = {0};
        float *data;
        job jobs[7];
        timed list[7];
        const char *names[7];
        int count = 0, scalar = 0;
        table.kind = (gtso_kind)kind;
        if (gtso_table_resolve(&table, &table) != GTSO_OK || !(data = malloc(gtso_table_count(&table) * sizeof *data)))
            return 1;
        if (kind == 3) /* its values do not matter here, and it takes long */
            for (size_t i = 0; i < gtso_table_count(&table); ++i)
                data[i] = next_float(&seed);
        else if (gtso_bake(&table, data, NULL) != GTSO_OK)
            return 1;
        for (int isa = kind == 0 ? GTAO_ISA_AUTO : GTAO_ISA_SCALAR; isa <= GTAO_ISA_NEON; ++isa) {
            gtso_lookup_desc *l = &jobs[count].lookup;
            if (!gtao_isa_available((gtao_isa)isa))
                continue;
            memset(l, 0, sizeof *l);
            l->width = WIDTH;
            l->height = HEIGHT;
            l->table = &table;
            l->data = data;
            l->visibility = visibility;
            l->bent_normals = bent;
            l->normals = normals;
            l->views = views;
            l->roughness = roughness;
            l->output = output;
            l->isa = (gtao_isa)isa;
            list[count].run = isa == GTAO_ISA_AUTO ? run_straight : run_lookup;
            list[count].user = &jobs[count];
            names[count] = isa == GTAO_ISA_AUTO ? "straight" : gtao_isa_name((gtao_isa)isa);
            if (isa == GTAO_ISA_SCALAR)
                scalar = count;
            ++count;
        }
        measure(list, count, repeat, thread_seconds);
        printf("  %-16s", kinds[kind]);
        for (int i = 0; i < count; ++i)
            printf("  %s %.2f (%.1fx)", names[i], list[i].seconds * 1e9 / PIXELS,
                   list[scalar].seconds / list[i].seconds);
        printf("\n");
        free(data);
    }
    printf("baking, s\n");
    for (int kind = 0; kind < 3; ++kind) {
        baking b;
        timed t;
        memset(&b, 0, sizeof b);
        b.table.kind = (gtso_kind)kind;
        b.data = malloc(gtso_table_count(&b.table) * sizeof *b.data);
        if (!b.data)
            return 1;
        t.run = run_bake;
        t.user = &b;
        measure(&t, 1, 3, thread_seconds);
        printf("  %-16s  %.3f\n", kinds[kind], t.seconds);
        free(b.data);
    }
    return 0;
}
