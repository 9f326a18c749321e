/* gpu.h - compute shaders on whatever Vulkan driver there is: without a window, one queue, buffers of floats.
 *
 * What a shader reads and writes is found by the names in its SPIR-V: buffers, and the scalars of its one constant
 * buffer. So the host states nothing about bindings and offsets, and cannot be wrong about them. */
#ifndef PORT_GPU_H
#define PORT_GPU_H

#include <stddef.h>
#include <stdint.h>

typedef struct gpu_error {
    char text[256];
} gpu_error;

typedef struct gpu gpu;
/* Null where there is no driver, with the reason. */
gpu *gpu_create(gpu_error *error);
void gpu_destroy(gpu *g); /* after everything made with it */
const char *gpu_name(const gpu *g);

typedef struct gpu_buffer gpu_buffer;
gpu_buffer *gpu_buffer_create(gpu *g, size_t count, gpu_error *error); /* of zeros */
void gpu_buffer_destroy(gpu *g, gpu_buffer *b);
float *gpu_buffer_data(gpu_buffer *b); /* read and written in place */
size_t gpu_buffer_count(const gpu_buffer *b);

enum { GPU_MAX_BUFFERS = 16 };
typedef struct gpu_shader gpu_shader;
gpu_shader *gpu_shader_create(gpu *g, const uint32_t *code, size_t words, gpu_error *error);
gpu_shader *gpu_shader_read(gpu *g, const char *path, gpu_error *error);
void gpu_shader_destroy(gpu *g, gpu_shader *s);
/* Buffer i, null behind the last. */
const char *gpu_shader_buffer(const gpu_shader *s, int i, int *written);
/* Constant i, null behind the last: a number, or `rows` of float4. */
const char *gpu_shader_constant(const gpu_shader *s, int i, int *rows);
/* Sets constant i: one value, or rows of `columns` values. */
void gpu_shader_set(gpu_shader *s, int i, const float *values, int columns);

/* Runs it over width x height threads in groups of 8 x 8, buffers in the order of gpu_shader_buffer, and waits. */
int gpu_run(gpu *g, gpu_shader *s, gpu_buffer *const *buffers, int width, int height, gpu_error *error);

#endif
