/* What `make bench-bake` and `make bench-gis` need: a large terrain that repeats, and the difference of two results.
 *
 *   bake_bench terrain N FILE     N x N raw floats: ridges N / 4 to 8 pixels apart, heights up to N / 8
 *   bake_bench compare A B        raw files of one size: RMSE, mean and greatest difference B - A
 *   bake_bench rows N A B         the rows of N floats in the opposite order */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static float lattice(int x, int y, int seed, int period) {
    uint32_t u = (uint32_t)(x % period) * 73856093u ^ (uint32_t)(y % period) * 19349663u ^ (uint32_t)seed * 83492791u;
    u ^= u >> 13;
    u *= 0x5bd1e995u;
    u ^= u >> 15;
    return (float)(u & 0xffffu) / 65535.0f;
}

static float noise(float x, float y, int seed, int period) {
    int ix = (int)x, iy = (int)y;
    float fx = x - (float)ix, fy = y - (float)iy;
    fx = fx * fx * (3.0f - 2.0f * fx);
    fy = fy * fy * (3.0f - 2.0f * fy);
    float a = lattice(ix, iy, seed, period), b = lattice(ix + 1, iy, seed, period);
    float c = lattice(ix, iy + 1, seed, period), d = lattice(ix + 1, iy + 1, seed, period);
    float top = a + (b - a) * fx, bottom = c + (d - c) * fx;
    return top + (bottom - top) * fy;
}

static int terrain(int n, const char *path) {
    float *row = malloc((size_t)n * sizeof *row);
    FILE *file = fopen(path, "wb");
    if (!row || !file)
        return 2;
    for (int y = 0; y < n; ++y) {
        for (int x = 0; x < n; ++x) {
            float sum = 0.0f, part = 1.0f;
            for (int o = 0, period = 4; period <= n / 8; ++o, part *= 0.5f, period *= 2) {
                float scale = (float)period / (float)n;
                float r = 1.0f - fabsf(2.0f * noise((float)x * scale, (float)y * scale, o, period) - 1.0f);
                sum += part * r * r;
            }
            row[x] = sum * (float)n / 16.0f;
        }
        if (fwrite(row, sizeof *row, (size_t)n, file) != (size_t)n)
            return 2;
    }
    free(row);
    return fclose(file) == 0 ? 0 : 2;
}

static int compare(const char *a, const char *b) {
    FILE *x = fopen(a, "rb"), *y = fopen(b, "rb");
    double squares = 0.0, sum = 0.0, worst = 0.0, count = 0.0;
    float u, v;
    if (!x || !y)
        return 2;
    while (fread(&u, 4, 1, x) == 1 && fread(&v, 4, 1, y) == 1) {
        double d = (double)v - (double)u;
        squares += d * d;
        sum += d;
        worst = fabs(d) > worst ? fabs(d) : worst;
        count += 1.0;
    }
    fclose(x);
    fclose(y);
    printf("%.5f %+.5f %.4f\n", sqrt(squares / count), sum / count, worst);
    return 0;
}

static int reverse_rows(int n, const char *a, const char *b) {
    float *rows = malloc((size_t)n * (size_t)n * sizeof *rows);
    FILE *x = fopen(a, "rb"), *y = fopen(b, "wb");
    if (!rows || !x || !y || fread(rows, sizeof *rows * (size_t)n, (size_t)n, x) != (size_t)n)
        return 2;
    for (int i = n; i-- > 0;)
        if (fwrite(rows + (size_t)i * (size_t)n, sizeof *rows, (size_t)n, y) != (size_t)n)
            return 2;
    free(rows);
    fclose(x);
    return fclose(y) == 0 ? 0 : 2;
}

int main(int argc, char **argv) {
    if (argc == 4 && strcmp(argv[1], "terrain") == 0 && atoi(argv[2]) > 0)
        return terrain(atoi(argv[2]), argv[3]);
    if (argc == 4 && strcmp(argv[1], "compare") == 0)
        return compare(argv[2], argv[3]);
    if (argc == 5 && strcmp(argv[1], "rows") == 0 && atoi(argv[2]) > 0)
        return reverse_rows(atoi(argv[2]), argv[3], argv[4]);
    fputs("usage: bake_bench terrain N FILE | compare A B | rows N A B\n", stderr);
    return 2;
}
