/* bench-run - time and error of gtao.h and of every rival method, into build/bench/.
 *
 *     build/bench-run [--quick] [--only speed|skips|error]
 *
 * speed.csv  what the library costs: instruction sets, samples, radius, resolution, threads, outputs
 * skips.csv  what skipping saves, only if asked for; skips_scenes.csv: on every scene
 * error.csv  error against time of every method and setting on every scene, against both truths
 * truth.csv  the random error of the truths themselves
 * crops.png  the methods side by side
 * host.csv   where this was measured
 * The scenes are rendered on the first run and kept in build/bench/scenes. --quick: small images, fewer settings and
 * repetitions; under two minutes, for a look, not for the record. */
#include <stdio.h>
#include <string.h>
#include <sys/utsname.h>
#include <time.h>

#include "dataset.h"
#include "examples/common/cli.h"
#include "gtao.h"
#include "loadmax.h"
#include "measure.h"
#include "quality.h"
#include "speed.h"

static bool write_host(bool quick) {
    static const gtao_isa isas[] = {GTAO_ISA_SCALAR, GTAO_ISA_SSE2, GTAO_ISA_NEON, GTAO_ISA_AVX2, GTAO_ISA_AVX512};
    char line[512], cpu[256] = "unknown", date[32] = "";
    const char *isa = "scalar";
    struct utsname u;
    time_t now = time(NULL);
    FILE *info = fopen("/proc/cpuinfo", "r"), *out;
    while (info && fgets(line, sizeof line, info))
        if (sscanf(line, "model name : %255[^\n]", cpu) == 1)
            break;
    if (info)
        fclose(info);
    for (size_t k = 0; k < sizeof isas / sizeof *isas; ++k)
        if (gtao_isa_available(isas[k]))
            isa = gtao_isa_name(isas[k]);
    strftime(date, sizeof date, "%Y-%m-%d", gmtime(&now));
    if (uname(&u) != 0 || !(out = fopen("build/bench/host.csv", "w")))
        return false;
    fprintf(out, "cpu,processors,machine,isa,compiler,date,mode\n%s,%d,%s,%s,%s,%s,%s\n", cpu, cli_processors(),
            u.machine, isa, __VERSION__, date, quick ? "quick" : "full");
    return fclose(out) == 0;
}

int main(int argc, char **argv) {
    bool quick = false, speed = true, error = true, skips = false;
    for (int i = 1; i < argc; ++i) {
        const char *value = i + 1 < argc ? argv[i + 1] : "";
        if (strcmp(argv[i], "--quick") == 0)
            quick = true;
        else if (strcmp(argv[i], "--only") == 0 && (strcmp(value, "speed") == 0 || strcmp(value, "error") == 0))
            speed = strcmp(value, "speed") == 0, error = !speed, ++i;
        else if (strcmp(argv[i], "--only") == 0 && strcmp(value, "skips") == 0)
            speed = error = false, skips = true, ++i;
        else {
            fprintf(stderr, "usage: bench-run [--quick] [--only speed|skips|error]\n");
            return 2;
        }
    }
    double start = wall_seconds();
    if (!make_folders("build/bench") || !write_host(quick))
        return 1;
    if (speed) {
        printf("speed (one thread, medians of processor time; floor: %s)\n", loadmax_isa());
        if (!speed_run(quick))
            return 1;
    }
    if (skips && !speed_skips(quick))
        return 1;
    if (error) {
        printf("error against time\n");
        if (!quality_run(quick))
            return 1;
    }
    printf("%.0f s\n", wall_seconds() - start);
    return 0;
}
