/* The least that a stage of a frame can do with memory: read what it reads, write what it writes, nothing else. */
#ifndef BENCH_STREAMS_H
#define BENCH_STREAMS_H

typedef struct streams streams;

typedef enum stream_stage {
    STREAM_REDUCE,
    STREAM_PREPARE,
    STREAM_HORIZONS,
    STREAM_SPATIAL,
    STREAM_TEMPORAL,
    STREAM_UPSAMPLE,
    STREAM_STAGES
} stream_stage;

/* The caller's buffers, tightly packed, 3 floats a pixel of normals and motion; these two null: not given. */
typedef struct stream_frame {
    const float *depth, *normals, *motion;
    float *visibility;
    unsigned number; /* planes of heights and histories alternate */
} stream_frame;

/* A frame's state for images of width x height pixels at half resolution, both even; visibility alone. Null if there is
 * no memory. */
streams *streams_open(int width, int height);
void streams_close(streams *s);

/* Every line of memory that the stage needs, once, in the order of rows. Returns something that depends on all of them.
 * `bytes`: gets what it read and wrote added. */
unsigned streams_run(streams *s, const stream_frame *f, stream_stage stage, double *bytes);

#endif
