// Reads damaged FBX files as `formats/src/fbx` does, compiled with ufbx by gcc's AddressSanitizer and
// UndefinedBehaviorSanitizer (scripts/soundness.sh): rustc's sanitizers do not see into C.
// Arguments: seconds, files. Each file is read whole, then damaged: bytes changed, cut out, repeated, and cut off.
#include "ufbx.h"
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static uint64_t state = 0x9e3779b97f4a7c15;

static uint64_t random_below(uint64_t end) {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return end ? state % end : 0;
}

static unsigned long long scenes, refusals;

static void read_bytes(const unsigned char *bytes, size_t length) {
    // A copy of exactly this length: a byte read behind it is found.
    unsigned char *copy = malloc(length ? length : 1);
    memcpy(copy, bytes, length);
    ufbx_load_opts options = {
        .temp_allocator = {.memory_limit = 32 << 20},
        .result_allocator = {.memory_limit = 32 << 20},
        .ignore_geometry = true,
        .ignore_embedded = true,
        .skip_skin_vertices = true,
        .skip_mesh_parts = true,
        .node_depth_limit = 1024,
        .file_format = UFBX_FILE_FORMAT_FBX,
        .inherit_mode_handling = UFBX_INHERIT_MODE_HANDLING_COMPENSATE,
    };
    ufbx_error error;
    ufbx_scene *scene = ufbx_load_memory(copy, length, &options, &error);
    free(copy); // a scene copies what it keeps
    if (!scene) {
        refusals++;
        return;
    }
    scenes++;
    for (size_t s = 0; s < scene->anim_stacks.count && s < 8; s++) {
        const ufbx_anim *anim = scene->anim_stacks.data[s]->anim;
        for (size_t n = 0; n < scene->nodes.count && n < 16; n++)
            for (int k = -1; k < 4; k++) ufbx_evaluate_transform(anim, scene->nodes.data[n], k * 0.37);
    }
    for (size_t c = 0; c < scene->anim_curves.count && c < 64; c++)
        for (int k = -1; k < 8; k++) ufbx_evaluate_curve(scene->anim_curves.data[c], k * 0.21, 0.0);
    ufbx_free_scene(scene);
}

static size_t damage(unsigned char *bytes, size_t length) {
    for (uint64_t times = 1 + random_below(6); times > 0 && length > 0; times--) {
        size_t at = random_below(length), some = 1 + random_below(length - at < 64 ? length - at : 64);
        switch (random_below(5)) {
        case 0: bytes[at] = (unsigned char)random_below(256); break;
        case 1: bytes[at] ^= (unsigned char)(1 << random_below(8)); break;
        case 2: // lengths and counts
            memset(bytes + at, random_below(2) ? 0xff : 0, some < 8 ? some : 8);
            break;
        case 3:
            memmove(bytes + at, bytes + at + some, length - at - some);
            length -= some;
            break;
        default: memmove(bytes + at, bytes + random_below(length - some + 1), some);
        }
    }
    return random_below(8) ? length : random_below(length + 1);
}

int main(int count, char **arguments) {
    if (count < 3) return 2;
    time_t end = time(NULL) + atoi(arguments[1]);
    unsigned long long round = 0;
    do {
        for (int f = 2; f < count; f++) {
            FILE *file = fopen(arguments[f], "rb");
            if (!file) return 2;
            fseek(file, 0, SEEK_END);
            size_t length = (size_t)ftell(file);
            rewind(file);
            unsigned char *bytes = malloc(length + 1);
            if (fread(bytes, 1, length, file) != length) return 2;
            fclose(file);
            if (round == 0) read_bytes(bytes, length);
            else read_bytes(bytes, damage(bytes, length));
            free(bytes);
        }
        round++;
    } while (time(NULL) < end);
    printf("%llu rounds of %d files: %llu scenes, %llu refused\n", round, count - 2, scenes, refusals);
    return 0;
}
