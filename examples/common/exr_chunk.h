/* exr_chunk.h - OpenEXRCore's routines for writing chunks, less a fault of version 3.1: a chunk that compresses to exactly
 * its own size is stored compressed, but taken for uncompressed when it is read. */
#ifndef EXAMPLES_EXR_CHUNK_H
#define EXAMPLES_EXR_CHUNK_H

#include <OpenEXR/openexr.h> /* so, not through -I: the headers are C11 and stay "system" to the compiler */
#include <string.h>

typedef struct exr_chunk {
    exr_result_t (*compress)(exr_encode_pipeline_t *pipeline);
} exr_chunk;

static exr_result_t exr_chunk_compress(exr_encode_pipeline_t *pipeline) {
    const exr_chunk *own = pipeline->encoding_user_data;
    exr_result_t result = own->compress(pipeline);
    if (result == EXR_ERR_SUCCESS && pipeline->compressed_bytes == pipeline->packed_bytes)
        memcpy(pipeline->compressed_buffer, pipeline->packed_buffer, pipeline->packed_bytes);
    return result;
}

/* Instead of exr_encoding_choose_default_routines; `own` lives as long as the pipeline. */
static exr_result_t exr_chunk_routines(exr_const_context_t context, int part, exr_encode_pipeline_t *pipeline,
                                       exr_chunk *own) {
    exr_result_t result = exr_encoding_choose_default_routines(context, part, pipeline);
    own->compress = pipeline->compress_fn;
    pipeline->encoding_user_data = own;
    if (own->compress)
        pipeline->compress_fn = exr_chunk_compress;
    return result;
}

#endif
