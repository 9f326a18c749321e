/* pool.c - see pool.h */
#include "pool.h"

#include <pthread.h>
#include <stdlib.h>

typedef struct pool_worker {
    pool *owner;
    pthread_t thread;
    int index;
} pool_worker;

struct pool {
    pthread_mutex_t mutex;
    pthread_cond_t wake, idle;
    pool_worker *workers; /* threads - 1 of them */
    int threads;
    unsigned job; /* counts jobs: a worker that sees a new number has work */
    int quit, busy;

    pool_rows work;
    void *user;
    int rows, chunk, next, done;
};

/* Take chunks until none is left. Holds the mutex only to take and to report one. */
static void take_chunks(pool *p, int thread, pool_progress progress) {
    pthread_mutex_lock(&p->mutex);
    while (p->next < p->rows) {
        int begin = p->next, end = p->rows - begin > p->chunk ? begin + p->chunk : p->rows;
        p->next = end;
        pthread_mutex_unlock(&p->mutex);
        p->work(p->user, thread, begin, end);
        pthread_mutex_lock(&p->mutex);
        p->done += end - begin;
        int done = p->done;
        if (progress) {
            pthread_mutex_unlock(&p->mutex);
            progress(p->user, done, p->rows);
            pthread_mutex_lock(&p->mutex);
        }
    }
    pthread_mutex_unlock(&p->mutex);
}

static void *worker_main(void *argument) {
    pool_worker *self = argument;
    pool *p = self->owner;
    unsigned seen = 0;
    for (;;) {
        pthread_mutex_lock(&p->mutex);
        while (p->job == seen && !p->quit)
            pthread_cond_wait(&p->wake, &p->mutex);
        int quit = p->quit;
        seen = p->job;
        pthread_mutex_unlock(&p->mutex);
        if (quit)
            return NULL;
        take_chunks(p, self->index, NULL);
        pthread_mutex_lock(&p->mutex);
        if (--p->busy == 0)
            pthread_cond_signal(&p->idle);
        pthread_mutex_unlock(&p->mutex);
    }
}

pool *pool_create(int threads) {
    pool *p = calloc(1, sizeof *p);
    if (!p)
        return NULL;
    threads = threads > 1 ? threads : 1;
    p->threads = 1;
    pthread_mutex_init(&p->mutex, NULL);
    pthread_cond_init(&p->wake, NULL);
    pthread_cond_init(&p->idle, NULL);
    p->workers = threads > 1 ? calloc((size_t)threads - 1, sizeof *p->workers) : NULL;
    for (int i = 0; p->workers && i < threads - 1; ++i) {
        pool_worker *w = p->workers + i;
        w->owner = p;
        w->index = i + 1;
        if (pthread_create(&w->thread, NULL, worker_main, w) != 0)
            break;
        ++p->threads;
    }
    return p;
}

void pool_destroy(pool *p) {
    if (!p)
        return;
    pthread_mutex_lock(&p->mutex);
    p->quit = 1;
    pthread_cond_broadcast(&p->wake);
    pthread_mutex_unlock(&p->mutex);
    for (int i = 0; i < p->threads - 1; ++i)
        pthread_join(p->workers[i].thread, NULL);
    pthread_cond_destroy(&p->idle);
    pthread_cond_destroy(&p->wake);
    pthread_mutex_destroy(&p->mutex);
    free(p->workers);
    free(p);
}

int pool_threads(const pool *p) {
    return p->threads;
}

void pool_run(pool *p, int rows, int chunk, pool_rows work, pool_progress progress, void *user) {
    if (chunk < 1) { /* small enough that threads end together, large enough that the mutex does not show */
        chunk = rows / (p->threads * 16);
        chunk = chunk < 1 ? 1 : chunk > 32 ? 32 : chunk;
    }
    pthread_mutex_lock(&p->mutex);
    p->work = work;
    p->user = user;
    p->rows = rows;
    p->chunk = chunk;
    p->next = p->done = 0;
    p->busy = p->threads - 1;
    ++p->job;
    pthread_cond_broadcast(&p->wake);
    pthread_mutex_unlock(&p->mutex);

    take_chunks(p, 0, progress);

    pthread_mutex_lock(&p->mutex);
    while (p->busy > 0)
        pthread_cond_wait(&p->idle, &p->mutex);
    pthread_mutex_unlock(&p->mutex);
}
