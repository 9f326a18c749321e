/* gpu.c - see gpu.h */
#include "gpu.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <vulkan/vulkan.h>

struct gpu {
    VkInstance instance;
    VkPhysicalDevice physical;
    VkDevice device;
    VkQueue queue;
    VkCommandPool commands;
    VkDescriptorPool descriptors;
    VkFence fence;
    uint32_t family;
    VkPhysicalDeviceMemoryProperties memory;
    VkPhysicalDeviceLimits limits;
    char name[VK_MAX_PHYSICAL_DEVICE_NAME_SIZE];
    int halves;
};

struct gpu_buffer {
    VkBuffer buffer;
    VkDeviceMemory memory;
    float *data;
    size_t count;
};

enum { MAX_CONSTANTS = 128, NAME_SIZE = 32 };

typedef struct constant {
    char name[NAME_SIZE];
    uint32_t offset;
    int rows;     /* of float4; 0: a scalar */
    int floating; /* or an integer */
} constant;

typedef struct binding {
    char name[NAME_SIZE];
    uint32_t slot;
    int written;
} binding;

struct gpu_shader {
    binding buffers[GPU_MAX_BUFFERS];
    constant constants[MAX_CONSTANTS];
    int buffer_count, constant_count;
    uint32_t constants_slot, constants_size;
    gpu_buffer *values; /* of the constants */
    VkShaderModule module;
    VkDescriptorSetLayout set_layout;
    VkPipelineLayout layout;
    VkPipeline pipeline;
};

static int fail(gpu_error *error, const char *format, ...) {
    va_list args;
    va_start(args, format);
    vsnprintf(error->text, sizeof error->text, format, args);
    va_end(args);
    return 0;
}

/* ---- device ------------------------------------------------------------------------------------------------------ */

/* A real device before an emulated one. */
static int choose_device(gpu *g, gpu_error *error) {
    enum { MOST = 16 };
    VkPhysicalDevice devices[MOST];
    uint32_t count = MOST;
    int best = -1;
    VkResult result = vkEnumeratePhysicalDevices(g->instance, &count, devices);
    if ((result != VK_SUCCESS && result != VK_INCOMPLETE) || count == 0)
        return fail(error, "no Vulkan driver");
    for (uint32_t i = 0; i < count; ++i) {
        VkQueueFamilyProperties families[MOST];
        VkPhysicalDeviceProperties properties;
        uint32_t family_count = MOST;
        vkGetPhysicalDeviceProperties(devices[i], &properties);
        vkGetPhysicalDeviceQueueFamilyProperties(devices[i], &family_count, families);
        int rank = properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU     ? 3
                   : properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU ? 2
                   : properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU            ? 0
                                                                                     : 1;
        for (uint32_t f = 0; f < family_count; ++f)
            if ((families[f].queueFlags & VK_QUEUE_COMPUTE_BIT) && rank > best) {
                best = rank;
                g->physical = devices[i];
                g->family = f;
                g->limits = properties.limits;
                snprintf(g->name, sizeof g->name, "%s", properties.deviceName);
            }
    }
    return best >= 0 ? 1 : fail(error, "no Vulkan device can compute");
}

static int create_device(gpu *g, gpu_error *error) {
    const float priority = 1.0f;
    VkPhysicalDeviceShaderFloat16Int8Features small = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SHADER_FLOAT16_INT8_FEATURES};
    VkPhysicalDeviceFeatures2 features = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, .pNext = &small};
    VkDeviceQueueCreateInfo queue = {.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO,
                                     .queueFamilyIndex = g->family,
                                     .queueCount = 1,
                                     .pQueuePriorities = &priority};
    VkDeviceCreateInfo info = {.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
                               .pNext = &features,
                               .queueCreateInfoCount = 1,
                               .pQueueCreateInfos = &queue};
    VkCommandPoolCreateInfo commands = {.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
                                        .queueFamilyIndex = g->family};
    VkDescriptorPoolSize sizes[] = {{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, GPU_MAX_BUFFERS},
                                    {VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, 1}};
    VkDescriptorPoolCreateInfo descriptors = {
        .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO, .maxSets = 1, .poolSizeCount = 2, .pPoolSizes = sizes};
    VkFenceCreateInfo fence = {.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO};
    vkGetPhysicalDeviceFeatures2(g->physical, &features);
    memset(&features.features, 0, sizeof features.features);
    small.shaderInt8 = VK_FALSE;
    g->halves = small.shaderFloat16 == VK_TRUE;
    if (vkCreateDevice(g->physical, &info, NULL, &g->device) != VK_SUCCESS)
        return fail(error, "%s: cannot create a Vulkan device", g->name);
    vkGetDeviceQueue(g->device, g->family, 0, &g->queue);
    vkGetPhysicalDeviceMemoryProperties(g->physical, &g->memory);
    if (vkCreateCommandPool(g->device, &commands, NULL, &g->commands) != VK_SUCCESS ||
        vkCreateDescriptorPool(g->device, &descriptors, NULL, &g->descriptors) != VK_SUCCESS ||
        vkCreateFence(g->device, &fence, NULL, &g->fence) != VK_SUCCESS)
        return fail(error, "%s: not enough memory", g->name);
    return 1;
}

gpu *gpu_create(gpu_error *error) {
    VkApplicationInfo application = {.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO, .apiVersion = VK_API_VERSION_1_2};
    VkInstanceCreateInfo info = {.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO, .pApplicationInfo = &application};
    gpu *g = calloc(1, sizeof *g);
    if (!g) {
        fail(error, "not enough memory");
        return NULL;
    }
    if (vkCreateInstance(&info, NULL, &g->instance) != VK_SUCCESS) {
        g->instance = VK_NULL_HANDLE;
        fail(error, "no Vulkan driver");
    } else if (choose_device(g, error) && create_device(g, error)) {
        return g;
    }
    gpu_destroy(g);
    return NULL;
}

void gpu_destroy(gpu *g) {
    if (!g)
        return;
    if (g->device) {
        vkDestroyFence(g->device, g->fence, NULL);
        vkDestroyDescriptorPool(g->device, g->descriptors, NULL);
        vkDestroyCommandPool(g->device, g->commands, NULL);
        vkDestroyDevice(g->device, NULL);
    }
    if (g->instance)
        vkDestroyInstance(g->instance, NULL);
    free(g);
}

const char *gpu_name(const gpu *g) {
    return g->name;
}

/* ---- buffers ----------------------------------------------------------------------------------------------------- */

/* Memory the host sees; cached if there is such, since results are read back. */
static int memory_type(const gpu *g, uint32_t types, uint32_t *chosen) {
    const VkMemoryPropertyFlags needed = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    int found = 0;
    for (uint32_t i = 0; i < g->memory.memoryTypeCount; ++i) {
        VkMemoryPropertyFlags flags = g->memory.memoryTypes[i].propertyFlags;
        int cached = (flags & VK_MEMORY_PROPERTY_HOST_CACHED_BIT) != 0;
        if ((types >> i & 1) && (flags & needed) == needed && (!found || cached)) {
            *chosen = i;
            found = 1;
            if (cached)
                break;
        }
    }
    return found;
}

static gpu_buffer *buffer_create(gpu *g, size_t count, VkBufferUsageFlags usage, size_t largest, gpu_error *error) {
    VkBufferCreateInfo info = {
        .sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO, .size = (count ? count : 1) * sizeof(float), .usage = usage};
    VkMemoryAllocateInfo allocate = {.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO};
    VkMemoryRequirements needs;
    gpu_buffer *b = calloc(1, sizeof *b);
    void *data = NULL;
    if (info.size > largest) {
        fail(error, "%s: buffers of at most %zu MiB, one of %zu is wanted", g->name, largest >> 20,
             (size_t)(info.size >> 20));
        free(b);
        return NULL;
    }
    int ok = b && vkCreateBuffer(g->device, &info, NULL, &b->buffer) == VK_SUCCESS;
    if (ok) {
        vkGetBufferMemoryRequirements(g->device, b->buffer, &needs);
        allocate.allocationSize = needs.size;
        ok = memory_type(g, needs.memoryTypeBits, &allocate.memoryTypeIndex) &&
             vkAllocateMemory(g->device, &allocate, NULL, &b->memory) == VK_SUCCESS &&
             vkBindBufferMemory(g->device, b->buffer, b->memory, 0) == VK_SUCCESS &&
             vkMapMemory(g->device, b->memory, 0, VK_WHOLE_SIZE, 0, &data) == VK_SUCCESS;
    }
    if (!ok) {
        gpu_buffer_destroy(g, b);
        fail(error, "%s: not enough memory", g->name);
        return NULL;
    }
    b->data = data;
    b->count = count;
    memset(data, 0, info.size);
    return b;
}

gpu_buffer *gpu_buffer_create(gpu *g, size_t count, gpu_error *error) {
    return buffer_create(g, count, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, g->limits.maxStorageBufferRange, error);
}

void gpu_buffer_destroy(gpu *g, gpu_buffer *b) {
    if (!b)
        return;
    vkDestroyBuffer(g->device, b->buffer, NULL);
    vkFreeMemory(g->device, b->memory, NULL);
    free(b);
}

float *gpu_buffer_data(gpu_buffer *b) {
    return b->data;
}
size_t gpu_buffer_count(const gpu_buffer *b) {
    return b->count;
}

/* ---- names in SPIR-V --------------------------------------------------------------------------------------------- */

enum { /* instructions, decorations and storage classes of the SPIR-V specification */
       OP_NAME = 5,
       OP_MEMBER_NAME = 6,
       OP_CAPABILITY = 17,
       OP_TYPE_INT = 21,
       OP_TYPE_FLOAT = 22,
       OP_TYPE_VECTOR = 23,
       OP_TYPE_ARRAY = 28,
       OP_TYPE_STRUCT = 30,
       OP_TYPE_POINTER = 32,
       OP_CONSTANT = 43,
       OP_VARIABLE = 59,
       OP_DECORATE = 71,
       OP_MEMBER_DECORATE = 72,
       CAPABILITY_FLOAT16 = 9,
       DECORATION_BUFFER_BLOCK = 3,
       DECORATION_NON_WRITABLE = 24,
       DECORATION_BINDING = 33,
       DECORATION_OFFSET = 35,
       STORAGE_UNIFORM = 2,
       STORAGE_BUFFER = 12
};

/* What is known of an id. */
typedef struct spirv_id {
    int op;
    const uint32_t *operands;
    const char *name;
    uint32_t slot;
    int has_slot, is_buffer, read_only;
} spirv_id;

static void copy_name(char to[NAME_SIZE], const char *name) {
    snprintf(to, NAME_SIZE, "%s", name ? name : "");
}

/* The members of the constant buffer: ints, floats and arrays of float4. */
static void read_constants(gpu_shader *s, const spirv_id *ids, uint32_t structure, const uint32_t *code, size_t words) {
    int count = 0;
    uint32_t end = 0;
    for (size_t at = 5; at < words && code[at] >> 16; at += code[at] >> 16) {
        const uint32_t *o = code + at + 1;
        uint32_t op = code[at] & 0xffff;
        if (op == OP_MEMBER_NAME && o[0] == structure && o[1] < MAX_CONSTANTS) {
            copy_name(s->constants[o[1]].name, (const char *)(o + 2));
            count = (int)o[1] + 1 > count ? (int)o[1] + 1 : count;
        }
        if (op == OP_MEMBER_DECORATE && o[0] == structure && o[1] < MAX_CONSTANTS && o[2] == DECORATION_OFFSET)
            s->constants[o[1]].offset = o[3];
    }
    for (int i = 0; i < count; ++i) {
        constant *c = &s->constants[i];
        const spirv_id *type = ids + ids[structure].operands[1 + i];
        if (type->op == OP_TYPE_ARRAY) {
            c->rows = (int)ids[type->operands[2]].operands[2];
            type = ids + type->operands[1];
        } else if (type->op == OP_TYPE_VECTOR) {
            c->rows = 1;
        }
        c->floating = type->op != OP_TYPE_INT;
        uint32_t after = c->offset + (c->rows ? 16u * (uint32_t)c->rows : 4u);
        end = after > end ? after : end;
    }
    s->constant_count = count;
    s->constants_size = (end + 15u) & ~15u;
}

static int reflect(const gpu *g, gpu_shader *s, const uint32_t *code, size_t words, gpu_error *error) {
    if (words < 5 || code[0] != 0x07230203u || code[3] > 1u << 20)
        return fail(error, "not SPIR-V");
    uint32_t bound = code[3];
    spirv_id *ids = calloc(bound, sizeof *ids);
    int ok = ids != NULL, halves = 0;
    for (size_t at = 5; ok && at < words;) {
        const uint32_t *o = code + at + 1;
        uint32_t op = code[at] & 0xffff, length = code[at] >> 16;
        if (length == 0 || at + length > words) {
            ok = 0;
            break;
        }
        halves |= op == OP_CAPABILITY && o[0] == CAPABILITY_FLOAT16;
        if (op == OP_NAME && o[0] < bound)
            ids[o[0]].name = (const char *)(o + 1);
        if (op == OP_DECORATE && o[0] < bound) {
            if (o[1] == DECORATION_BINDING)
                ids[o[0]].slot = o[2], ids[o[0]].has_slot = 1;
            ids[o[0]].is_buffer |= o[1] == DECORATION_BUFFER_BLOCK;
            ids[o[0]].read_only |= o[1] == DECORATION_NON_WRITABLE;
        }
        if (op == OP_MEMBER_DECORATE && o[0] < bound && o[2] == DECORATION_NON_WRITABLE)
            ids[o[0]].read_only = 1;
        if (op >= OP_TYPE_INT && op <= OP_TYPE_POINTER && o[0] < bound)
            ids[o[0]].op = (int)op, ids[o[0]].operands = o;
        if ((op == OP_CONSTANT || op == OP_VARIABLE) && o[1] < bound)
            ids[o[1]].op = (int)op, ids[o[1]].operands = o;
        at += length;
    }
    for (uint32_t i = 0; ok && i < bound; ++i) {
        const spirv_id *v = ids + i;
        if (v->op != OP_VARIABLE || !v->has_slot ||
            (v->operands[2] != STORAGE_UNIFORM && v->operands[2] != STORAGE_BUFFER))
            continue;
        uint32_t structure = ids[v->operands[0]].operands[2];
        if (ids[structure].is_buffer || v->operands[2] == STORAGE_BUFFER) {
            if (s->buffer_count == GPU_MAX_BUFFERS) {
                ok = 0;
                break;
            }
            binding *b = &s->buffers[s->buffer_count++];
            copy_name(b->name, v->name);
            b->slot = v->slot;
            b->written = !v->read_only && !ids[structure].read_only;
        } else {
            s->constants_slot = v->slot;
            read_constants(s, ids, structure, code, words);
        }
    }
    free(ids);
    if (halves && !g->halves)
        return fail(error, "%.120s has no arithmetic of 16-bit floats", g->name);
    return ok ? 1 : fail(error, "not SPIR-V that this program understands");
}

/* ---- shaders ----------------------------------------------------------------------------------------------------- */

gpu_shader *gpu_shader_create(gpu *g, const uint32_t *code, size_t words, gpu_error *error) {
    VkDescriptorSetLayoutBinding slots[GPU_MAX_BUFFERS + 1];
    VkShaderModuleCreateInfo module = {
        .sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO, .codeSize = words * 4, .pCode = code};
    VkDescriptorSetLayoutCreateInfo set = {.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
                                           .pBindings = slots};
    VkPipelineLayoutCreateInfo layout = {.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO, .setLayoutCount = 1};
    VkComputePipelineCreateInfo pipeline = {.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO};
    gpu_shader *s = calloc(1, sizeof *s);
    if (!s) {
        fail(error, "not enough memory");
        return NULL;
    }
    memset(slots, 0, sizeof slots);
    int ok = reflect(g, s, code, words, error);
    if (ok && s->constants_size)
        ok = (s->values = buffer_create(g, s->constants_size / 4, VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT,
                                        g->limits.maxUniformBufferRange, error)) != NULL;
    for (int i = 0; i < s->buffer_count; ++i) {
        slots[i].binding = s->buffers[i].slot;
        slots[i].descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    }
    set.bindingCount = (uint32_t)s->buffer_count;
    if (s->values) {
        slots[set.bindingCount].binding = s->constants_slot;
        slots[set.bindingCount++].descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
    }
    for (uint32_t i = 0; i < set.bindingCount; ++i) {
        slots[i].descriptorCount = 1;
        slots[i].stageFlags = VK_SHADER_STAGE_COMPUTE_BIT;
    }
    if (ok) {
        ok = vkCreateShaderModule(g->device, &module, NULL, &s->module) == VK_SUCCESS &&
             vkCreateDescriptorSetLayout(g->device, &set, NULL, &s->set_layout) == VK_SUCCESS;
        layout.pSetLayouts = &s->set_layout;
        ok = ok && vkCreatePipelineLayout(g->device, &layout, NULL, &s->layout) == VK_SUCCESS;
        pipeline.layout = s->layout;
        pipeline.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
        pipeline.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
        pipeline.stage.module = s->module;
        pipeline.stage.pName = "main";
        ok = ok && vkCreateComputePipelines(g->device, VK_NULL_HANDLE, 1, &pipeline, NULL, &s->pipeline) == VK_SUCCESS;
        if (!ok)
            fail(error, "%s: does not take the shader", g->name);
    }
    if (ok)
        return s;
    gpu_shader_destroy(g, s);
    return NULL;
}

gpu_shader *gpu_shader_read(gpu *g, const char *path, gpu_error *error) {
    FILE *file = fopen(path, "rb");
    uint32_t *code = NULL;
    long size = -1;
    gpu_shader *s = NULL;
    if (file && fseek(file, 0, SEEK_END) == 0)
        size = ftell(file);
    if (size >= 0 && size < 1 << 24 && fseek(file, 0, SEEK_SET) == 0)
        code = malloc((size_t)size + 4);
    if (code && fread(code, 1, (size_t)size, file) == (size_t)size) {
        gpu_error why;
        s = gpu_shader_create(g, code, (size_t)size / 4, &why);
        if (!s)
            fail(error, "%.100s: %.140s", path, why.text);
    } else {
        fail(error, "%.200s: cannot be read", path);
    }
    free(code);
    if (file)
        fclose(file);
    return s;
}

void gpu_shader_destroy(gpu *g, gpu_shader *s) {
    if (!s)
        return;
    vkDestroyPipeline(g->device, s->pipeline, NULL);
    vkDestroyPipelineLayout(g->device, s->layout, NULL);
    vkDestroyDescriptorSetLayout(g->device, s->set_layout, NULL);
    vkDestroyShaderModule(g->device, s->module, NULL);
    gpu_buffer_destroy(g, s->values);
    free(s);
}

const char *gpu_shader_buffer(const gpu_shader *s, int i, int *written) {
    if (i >= s->buffer_count)
        return NULL;
    *written = s->buffers[i].written;
    return s->buffers[i].name;
}

const char *gpu_shader_constant(const gpu_shader *s, int i, int *rows) {
    if (i >= s->constant_count)
        return NULL;
    *rows = s->constants[i].rows;
    return s->constants[i].name;
}

void gpu_shader_set(gpu_shader *s, int i, const float *values, int columns) {
    const constant *c = &s->constants[i];
    char *to = (char *)s->values->data + c->offset;
    if (c->rows) {
        for (int row = 0; row < c->rows; ++row)
            memcpy(to + 16 * row, values + row * columns, (size_t)columns * sizeof *values);
    } else if (c->floating) {
        memcpy(to, values, sizeof *values);
    } else {
        int32_t value = (int32_t)*values;
        memcpy(to, &value, sizeof value);
    }
}

int gpu_run(gpu *g, gpu_shader *s, gpu_buffer *const *buffers, int width, int height, gpu_error *error) {
    VkDescriptorBufferInfo ranges[GPU_MAX_BUFFERS + 1];
    VkWriteDescriptorSet writes[GPU_MAX_BUFFERS + 1];
    VkDescriptorSetAllocateInfo allocate = {.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO,
                                            .descriptorPool = g->descriptors,
                                            .descriptorSetCount = 1,
                                            .pSetLayouts = &s->set_layout};
    VkCommandBufferAllocateInfo record = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
                                          .commandPool = g->commands,
                                          .level = VK_COMMAND_BUFFER_LEVEL_PRIMARY,
                                          .commandBufferCount = 1};
    VkCommandBufferBeginInfo begin = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
    /* What the shader writes, the host reads. */
    VkMemoryBarrier barrier = {.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER,
                               .srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT,
                               .dstAccessMask = VK_ACCESS_HOST_READ_BIT};
    VkSubmitInfo submit = {.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO, .commandBufferCount = 1};
    VkDescriptorSet set;
    VkCommandBuffer commands = VK_NULL_HANDLE;
    uint32_t count = (uint32_t)s->buffer_count;
    vkResetDescriptorPool(g->device, g->descriptors, 0);
    int ok = vkAllocateDescriptorSets(g->device, &allocate, &set) == VK_SUCCESS &&
             vkAllocateCommandBuffers(g->device, &record, &commands) == VK_SUCCESS;
    memset(writes, 0, sizeof writes);
    for (uint32_t i = 0; i <= count; ++i) {
        int is_buffer = i < count;
        ranges[i] = (VkDescriptorBufferInfo){VK_NULL_HANDLE, 0, VK_WHOLE_SIZE};
        if (is_buffer || s->values)
            ranges[i].buffer = (is_buffer ? buffers[i] : s->values)->buffer;
        writes[i].sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
        writes[i].dstSet = set;
        writes[i].dstBinding = is_buffer ? s->buffers[i].slot : s->constants_slot;
        writes[i].descriptorCount = 1;
        writes[i].descriptorType = is_buffer ? VK_DESCRIPTOR_TYPE_STORAGE_BUFFER : VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
        writes[i].pBufferInfo = &ranges[i];
    }
    if (ok) {
        vkUpdateDescriptorSets(g->device, count + (s->values ? 1 : 0), writes, 0, NULL);
        ok = vkBeginCommandBuffer(commands, &begin) == VK_SUCCESS;
    }
    if (ok) {
        vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, s->pipeline);
        vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, s->layout, 0, 1, &set, 0, NULL);
        vkCmdDispatch(commands, (uint32_t)(width + 7) / 8, (uint32_t)(height + 7) / 8, 1);
        vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &barrier,
                             0, NULL, 0, NULL);
        submit.pCommandBuffers = &commands;
        ok = vkEndCommandBuffer(commands) == VK_SUCCESS && vkResetFences(g->device, 1, &g->fence) == VK_SUCCESS &&
             vkQueueSubmit(g->queue, 1, &submit, g->fence) == VK_SUCCESS &&
             vkWaitForFences(g->device, 1, &g->fence, VK_TRUE, UINT64_MAX) == VK_SUCCESS;
    }
    if (commands)
        vkFreeCommandBuffers(g->device, g->commands, 1, &commands);
    return ok ? 1 : fail(error, "%s: a shader did not run to its end", g->name);
}
