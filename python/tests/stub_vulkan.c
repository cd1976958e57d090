/* The Vulkan loader (REAL_LOADER) with devices that also export timeline semaphores, as cards do and software devices
 * do not: the files are empty. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

typedef void (*function)(void);
typedef function (*get_proc)(void *, const char *);
typedef int (*create)(void *, const void *, const void *, void *);

enum { OPAQUE_FILE = 1, EXPORTABLE = 1, EXPORT_SEMAPHORE = 1000077000, LOST = -4 };
static const char extension[] = "VK_KHR_external_semaphore_fd";

static get_proc real_instance, real_device;
static int (*real_extensions)(void *, const char *, uint32_t *, void *);
static create real_create_device;
static void (*real_semaphore_properties)(void *, const void *, void *);

struct property {
    char name[256];
    uint32_t version;
};
struct device_info {
    uint32_t type;
    const void *next;
    uint32_t flags, queues;
    const void *queue;
    uint32_t layers;
    const void *layer;
    uint32_t extensions;
    const char *const *extension;
    const void *features;
};
struct chained {
    uint32_t type;
    const struct chained *next;
    uint32_t flags;
};
struct semaphore_properties {
    uint32_t type;
    void *next;
    uint32_t from_imported, compatible, features;
};

static int extensions(void *device, const char *layer, uint32_t *count, struct property *properties) {
    if (!properties) {
        int result = real_extensions(device, layer, count, NULL);
        *count += 1;
        return result;
    }
    *count -= 1;
    int result = real_extensions(device, layer, count, properties);
    memset(&properties[*count], 0, sizeof *properties);
    strcpy(properties[*count].name, extension);
    *count += 1;
    return result;
}

static int create_device(void *physical, const struct device_info *asked, const void *allocator, void *device) {
    struct device_info info = *asked;
    const char **kept = calloc(info.extensions + 1, sizeof *kept);
    info.extensions = 0;
    for (uint32_t i = 0; i < asked->extensions; i++)
        if (strcmp(asked->extension[i], extension))
            kept[info.extensions++] = asked->extension[i];
    info.extension = kept;
    int result = real_create_device(physical, &info, allocator, device);
    free(kept);
    return result;
}

static void semaphore_properties(void *physical, const void *info, struct semaphore_properties *properties) {
    real_semaphore_properties(physical, info, properties);
    properties->compatible |= OPAQUE_FILE;
    properties->features |= EXPORTABLE;
}

static int create_semaphore(void *device, const struct chained *info, const void *allocator, void *semaphore) {
    struct chained plain = *info;
    if (plain.next && plain.next->type == EXPORT_SEMAPHORE)
        plain.next = plain.next->next;
    /* Each device has a function of its own. */
    function found = real_device(device, "vkCreateSemaphore");
    return ((create)found)(device, &plain, allocator, semaphore);
}

/* A device that is lost (STUB_VULKAN_LOST) before a result is waited for. */
static int wait_for(void *device, const void *info, uint64_t timeout) {
    if (getenv("STUB_VULKAN_LOST"))
        return LOST;
    function found = real_device(device, "vkWaitSemaphores");
    return ((int (*)(void *, const void *, uint64_t))found)(device, info, timeout);
}

static int counter(void *device, uint64_t semaphore, uint64_t *value) {
    if (getenv("STUB_VULKAN_LOST"))
        return LOST;
    function found = real_device(device, "vkGetSemaphoreCounterValue");
    return ((int (*)(void *, uint64_t, uint64_t *))found)(device, semaphore, value);
}

static int semaphore_file(void *device, const void *info, int *file) {
    (void)device, (void)info;
    *file = memfd_create("semaphore", MFD_CLOEXEC);
    return 0;
}

#define OVERRIDE(function_name, real, from, ours)                                                                      \
    if (!strcmp(name, function_name)) {                                                                                \
        function found = from(object, name);                                                                           \
        memcpy(&real, &found, sizeof found);                                                                           \
        return (function)ours;                                                                                         \
    }

static function device_function(void *object, const char *name) {
    if (!strcmp(name, "vkGetSemaphoreFdKHR"))
        return (function)semaphore_file;
    if (!strcmp(name, "vkCreateSemaphore"))
        return (function)create_semaphore;
    if (!strcmp(name, "vkWaitSemaphores"))
        return (function)wait_for;
    if (!strcmp(name, "vkGetSemaphoreCounterValue"))
        return (function)counter;
    return real_device(object, name);
}

function vkGetInstanceProcAddr(void *object, const char *name) {
    if (!real_instance) {
        void *library = dlopen(getenv("REAL_LOADER"), RTLD_NOW | RTLD_LOCAL);
        real_instance = library ? (get_proc)dlsym(library, "vkGetInstanceProcAddr") : NULL;
        if (!real_instance)
            return NULL;
    }
    OVERRIDE("vkGetDeviceProcAddr", real_device, real_instance, device_function)
    OVERRIDE("vkEnumerateDeviceExtensionProperties", real_extensions, real_instance, extensions)
    OVERRIDE("vkCreateDevice", real_create_device, real_instance, create_device)
    OVERRIDE("vkGetPhysicalDeviceExternalSemaphoreProperties", real_semaphore_properties, real_instance,
             semaphore_properties)
    return real_instance(object, name);
}
