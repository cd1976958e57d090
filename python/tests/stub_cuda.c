/* A CUDA driver that is none, for tests: memory is mapped where the Vulkan driver's file lies, every call is written
 * down (STUB_CUDA_LOG), and one of them can be made to fail (STUB_CUDA_FAIL). Its devices have the UUIDs of
 * STUB_CUDA_UUIDS. */

#define _GNU_SOURCE
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

enum { OK = 0, INVALID_VALUE = 1, INVALID_CONTEXT = 201, FAILS = 999 };

/* What is alive: memories, mappings, semaphores. */
int stub_alive = 0;
static int depth = 0;

static int called(const char *name, long long argument) {
    const char *log = getenv("STUB_CUDA_LOG");
    if (log) {
        FILE *file = fopen(log, "a");
        fprintf(file, "%s %lld\n", name, argument);
        fclose(file);
    }
    const char *fails = getenv("STUB_CUDA_FAIL");
    return fails && strcmp(fails, name) == 0 ? FAILS : OK;
}

#define CALLED(argument)                                                                                               \
    do {                                                                                                               \
        int code = called(__func__, (long long)(argument));                                                            \
        if (code != OK)                                                                                                \
            return code;                                                                                               \
    } while (0)
#define IN_CONTEXT                                                                                                     \
    if (depth != 1)                                                                                                    \
    return INVALID_CONTEXT

int cuInit(unsigned flags) {
    CALLED(flags);
    return flags == 0 ? OK : INVALID_VALUE;
}

int cuGetErrorName(int code, const char **name) {
    *name = code == FAILS ? "CUDA_ERROR_UNKNOWN" : code == INVALID_CONTEXT ? "CUDA_ERROR_INVALID_CONTEXT" : NULL;
    return *name ? OK : INVALID_VALUE;
}

static const char *uuids(void) {
    const char *found = getenv("STUB_CUDA_UUIDS");
    return found ? found : "";
}

int cuDeviceGetCount(int *count) {
    CALLED(0);
    *count = (int)(strlen(uuids()) + 1) / 37;
    return OK;
}

int cuDeviceGet(int *device, int ordinal) {
    CALLED(ordinal);
    *device = 100 + ordinal;
    return OK;
}

int cuDeviceGetUuid(unsigned char *uuid, int device) {
    CALLED(device);
    const char *text = uuids() + 37 * (device - 100);
    for (int i = 0; i < 16; i++) {
        text += *text == '-';
        unsigned byte;
        sscanf(text, "%2x", &byte);
        uuid[i] = (unsigned char)byte;
        text += 2;
    }
    return OK;
}

int cuDevicePrimaryCtxRetain(void **context, int device) {
    CALLED(device);
    *context = (void *)(intptr_t)(1000 + device);
    return OK;
}

int cuCtxPushCurrent_v2(void *context) {
    CALLED(context);
    depth++;
    return OK;
}

int cuCtxPopCurrent_v2(void **context) {
    CALLED(0);
    depth--;
    *context = NULL;
    return OK;
}

int cuCtxSynchronize(void) {
    CALLED(0);
    IN_CONTEXT;
    return OK;
}

struct file {
    int number;
    int unused[3];
} __attribute__((aligned(8)));
struct memory_handle {
    int kind;
    struct file file;
    unsigned long long size;
    unsigned flags, reserved[16];
};
struct buffer_range {
    unsigned long long offset, size;
    unsigned flags, reserved[16];
};
struct semaphore_handle {
    int kind;
    struct file file;
    unsigned flags, reserved[16];
};
struct wait {
    unsigned long long value, others[3];
    unsigned other[10], flags, reserved[16];
};
struct memory {
    char *start;
    size_t length, size;
    int mapped;
};

int cuImportExternalMemory(struct memory **memory, const struct memory_handle *handle) {
    CALLED(handle->size);
    IN_CONTEXT;
    struct stat about;
    if (handle->kind != 1 || handle->flags != 1 || fstat(handle->file.number, &about))
        return INVALID_VALUE;
    size_t length = (size_t)about.st_size;
    char *start = mmap(NULL, length, PROT_READ | PROT_WRITE, MAP_SHARED, handle->file.number, 0);
    if (start == MAP_FAILED || length < handle->size)
        return INVALID_VALUE;
    close(handle->file.number);
    struct memory *made = malloc(sizeof *made);
    *made = (struct memory){start, length, handle->size, 0};
    *memory = made;
    stub_alive++;
    return OK;
}

int cuExternalMemoryGetMappedBuffer(uint64_t *address, struct memory *memory, const struct buffer_range *range) {
    CALLED(range->size);
    IN_CONTEXT;
    if (range->offset + range->size > memory->size)
        return INVALID_VALUE;
    /* lavapipe's files begin with a header, whose second word says where the memory starts. */
    uint64_t header = ((uint64_t *)memory->start)[1];
    header = header <= memory->length - memory->size ? header : 0;
    memory->mapped++;
    *address = (uint64_t)(intptr_t)(memory->start + header + range->offset);
    stub_alive++;
    return OK;
}

int cuDestroyExternalMemory(struct memory *memory) {
    CALLED(memory->size);
    IN_CONTEXT;
    munmap(memory->start, memory->length);
    free(memory);
    stub_alive--;
    return OK;
}

int cuImportExternalSemaphore(void **semaphore, const struct semaphore_handle *handle) {
    CALLED(handle->kind);
    IN_CONTEXT;
    if (handle->kind != 9 || close(handle->file.number))
        return INVALID_VALUE;
    *semaphore = malloc(1);
    stub_alive++;
    return OK;
}

#ifndef WITHOUT_WAIT
int cuWaitExternalSemaphoresAsync(void *const *semaphores, const struct wait *waits, unsigned count, void *stream) {
    CALLED(stream);
    IN_CONTEXT;
    return count == 1 && *semaphores && waits->value > 0 && waits->flags == 0 ? OK : INVALID_VALUE;
}
#endif

int cuDestroyExternalSemaphore(void *semaphore) {
    CALLED(0);
    IN_CONTEXT;
    free(semaphore);
    stub_alive--;
    return OK;
}

int cuMemFree_v2(uint64_t address) {
    CALLED(0);
    IN_CONTEXT;
    stub_alive--;
    return address ? OK : INVALID_VALUE;
}

int cuMemcpyDtoH_v2(void *to, uint64_t from, size_t size) {
    CALLED(size);
    IN_CONTEXT;
    memcpy(to, (const void *)(intptr_t)from, size);
    return OK;
}
