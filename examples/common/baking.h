/* baking.h - what build/bake and build/bake-mpi share: a map to visibility, bent normals and horizons, tile by tile.
 *
 * Everything unfinished lies in one directory beside the output: the copy of the map (terrain.h), one file for each
 * finished tile, the settings. A killed job goes on from there; the outputs get their names together when all is done,
 * and the directory goes. Functions that can fail return 0 and have printed one line. */
#ifndef EXAMPLES_BAKING_H
#define EXAMPLES_BAKING_H

typedef struct baking baking;

/* Reads the command line. quiet: print nothing, ever. On null: *status is the exit status, 0 after --help. */
baking *baking_parse(const char *program, int quiet, int argc, char **argv, int *status);
void baking_free(baking *b);

/* Checks the input, copies it in, or finds what an earlier run left. One process, before the others. */
int baking_begin(baking *b);
/* The other processes of the same command, after it. */
int baking_join(baking *b);

int baking_tiles(const baking *b);
/* Finished by an earlier run? Ask once for each. */
int baking_tile_done(baking *b, int tile);
/* Any tile in any process; writes its file. */
int baking_tile(baking *b, int tile);

/* Progress on a terminal: `done` of `count` tiles, and the part of the one in work. */
void baking_progress(baking *b, int done, int count, double part);

/* Puts the outputs together once all tiles are done. One process. */
int baking_finish(baking *b);

#endif
