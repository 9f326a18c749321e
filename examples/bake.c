/* bake - ambient visibility, bent normals and horizons of height maps, also of those larger than memory.
 * `bake --help` lists the options; docs/baking.md shows how to use them. */
#include "baking.h"

#include <stdlib.h>

int main(int argc, char **argv) {
    int status;
    baking *b = baking_parse("bake", 0, argc, argv, &status);
    if (!b)
        return status;
    int ok = baking_begin(b), count = ok ? baking_tiles(b) : 0, done = 0;
    unsigned char *finished = malloc((size_t)count + 1); /* by an earlier run */
    for (int tile = 0; finished && tile < count; ++tile)
        done += finished[tile] = (unsigned char)baking_tile_done(b, tile);
    for (int tile = 0; finished && ok && tile < count; ++tile) {
        if (finished[tile])
            continue;
        baking_progress(b, done, count, 0.0);
        ok = baking_tile(b, tile);
        ++done;
    }
    ok = ok && finished && baking_finish(b);
    free(finished);
    baking_free(b);
    return ok ? 0 : 2;
}
