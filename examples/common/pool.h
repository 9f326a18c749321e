/* pool.h - a small thread pool that hands out ranges of rows.
 *
 * Chunks go to whichever thread is free, so the order is arbitrary; that results do not depend on it is for the
 * caller's function to see to (gtao.h's stages write only the rows they are given). */
#ifndef EXAMPLES_POOL_H
#define EXAMPLES_POOL_H

typedef struct pool pool;

/* Rows [row_begin, row_end) on thread 0 .. pool_threads() - 1; thread 0 is the caller's. */
typedef void (*pool_rows)(void *user, int thread, int row_begin, int row_end);
/* Called on the caller's thread between its chunks. */
typedef void (*pool_progress)(void *user, int rows_done, int rows);

/* Null if there is no memory. Fewer threads than asked for if the system gives no more. */
pool *pool_create(int threads);
void pool_destroy(pool *p); /* null is harmless */
int pool_threads(const pool *p);

/* Returns when all rows are done. `chunk` rows at a time, 0: chosen by the number of rows. `progress` may be null. */
void pool_run(pool *p, int rows, int chunk, pool_rows work, pool_progress progress, void *user);

#endif
