/* bake-mpi - build/bake on many machines that share a file system: mpirun -n 8 build/bake-mpi OPTIONS as of bake.
 *
 * Rank 0 keeps the list of tiles and gives the next one to whoever asks; it computes too, in a thread beside. A tile is
 * the same whoever computes it, so the outputs do not depend on the number of ranks. A job that dies (one rank that
 * fails ends all) goes on with the tiles that are on disk when it is started again. */
#include "baking.h"

#include <mpi.h>

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { TAG_ASK = 1, TAG_TILE };
enum { NO_TILE = -1 };

typedef struct tile_list {
    baking *b;
    pthread_mutex_t mutex;
    unsigned char *finished; /* by an earlier run */
    int count, next, done, failed;
} tile_list;

static int next_tile(tile_list *l) {
    pthread_mutex_lock(&l->mutex);
    while (l->next < l->count && l->finished[l->next])
        ++l->next;
    int tile = l->next < l->count && !l->failed ? l->next++ : NO_TILE;
    pthread_mutex_unlock(&l->mutex);
    return tile;
}

static void report(tile_list *l, int ok) {
    pthread_mutex_lock(&l->mutex);
    l->done += ok;
    l->failed |= !ok;
    pthread_mutex_unlock(&l->mutex);
}

static void *compute_beside(void *argument) {
    tile_list *l = argument;
    for (int tile; (tile = next_tile(l)) != NO_TILE;)
        report(l, baking_tile(l->b, tile));
    return NULL;
}

/* Answers until every other rank has been told that there is nothing left. A message is the result of the last tile:
 * 1 done, 0 failed, -1 none yet. */
static void serve(tile_list *l, int ranks) {
    const struct timespec moment = {0, 1000000}; /* MPI_Recv would keep a processor busy */
    for (int left = ranks - 1; left > 0;) {
        MPI_Status status;
        int there = 0, last = 0;
        MPI_Iprobe(MPI_ANY_SOURCE, TAG_ASK, MPI_COMM_WORLD, &there, &status);
        if (!there) {
            nanosleep(&moment, NULL);
            continue;
        }
        MPI_Recv(&last, 1, MPI_INT, status.MPI_SOURCE, TAG_ASK, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
        if (last >= 0)
            report(l, last);
        int tile = next_tile(l);
        MPI_Send(&tile, 1, MPI_INT, status.MPI_SOURCE, TAG_TILE, MPI_COMM_WORLD);
        left -= tile == NO_TILE;
    }
}

static int lead(baking *b, int ranks) {
    tile_list l;
    pthread_t thread;
    int ok = baking_begin(b);
    MPI_Bcast(&ok, 1, MPI_INT, 0, MPI_COMM_WORLD);
    if (!ok)
        return 0;
    l.b = b;
    l.count = baking_tiles(b);
    l.next = l.done = l.failed = 0;
    l.finished = malloc((size_t)l.count);
    pthread_mutex_init(&l.mutex, NULL);
    for (int i = 0; l.finished && i < l.count; ++i)
        l.done += l.finished[i] = (unsigned char)baking_tile_done(b, i);
    if (!l.finished || pthread_create(&thread, NULL, compute_beside, &l) != 0) {
        fputs("bake-mpi: not enough memory\n", stderr);
        MPI_Abort(MPI_COMM_WORLD, 2);
        return 0;
    }
    serve(&l, ranks);
    pthread_join(thread, NULL);
    pthread_mutex_destroy(&l.mutex);
    free(l.finished);
    return !l.failed && l.done == l.count && baking_finish(b);
}

static int follow(baking *b) {
    int ok = 0, last = -1, tile = NO_TILE;
    MPI_Bcast(&ok, 1, MPI_INT, 0, MPI_COMM_WORLD);
    if (!ok)
        return 0;
    if (!baking_join(b))
        MPI_Abort(MPI_COMM_WORLD, 2);
    for (;;) {
        MPI_Send(&last, 1, MPI_INT, 0, TAG_ASK, MPI_COMM_WORLD);
        MPI_Recv(&tile, 1, MPI_INT, 0, TAG_TILE, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
        if (tile == NO_TILE)
            return last != 0;
        last = baking_tile(b, tile);
    }
}

int main(int argc, char **argv) {
    int provided, rank = 0, ranks = 1, status = 2, ok = 0;
    MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &provided); /* only the main threads speak MPI */
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    baking *b = baking_parse("bake-mpi", rank != 0, argc, argv, &status);
    if (b)
        ok = rank == 0 ? lead(b, ranks) : follow(b);
    baking_free(b);
    if (b)
        status = ok ? 0 : 2;
    MPI_Finalize();
    return status;
}
