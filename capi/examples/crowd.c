/* A crowd: thousands of figures, each at its own time in its own clips, evaluated on the CPU and on a
   device, and compared byte for byte. With a motion file that has a hierarchy, such as a glTF model, some
   hundred that play its clips, too.

   crowd DEVICE [FILE]

   cc -I capi/include capi/examples/crowd.c -L target/release -ltumble_capi -o crowd */

#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tumble.h"

#define FRAMES 4
#define JOINTS 13
#define KEYS 31
#define CLIPS 3

/* Ends the program with the words of the last error, unless a call did what it says. */
static void check(TumbleResult result, const char *call) {
    if (result != TUMBLE_RESULT_OK) {
        fprintf(stderr, "%s: %d: %s\n", call, (int)result, tumble_last_error());
        exit(1);
    }
}

static void *memory_for(size_t count, size_t each) {
    void *memory = malloc((count > 0 ? count : 1) * each);
    if (memory == NULL) {
        fprintf(stderr, "no memory for %lu values\n", (unsigned long)count);
        exit(1);
    }
    return memory;
}

/* Hips with a spine of three and a head, two arms and two legs of two joints each. */
static const int32_t parents[JOINTS] = {-1, 0, 1, 2, 3, 2, 5, 2, 7, 0, 9, 0, 11};
static const float offsets[JOINTS][3] = {
    {0.0f, 1.0f, 0.0f},   {0.0f, 0.15f, 0.0f},  {0.0f, 0.2f, 0.0f},  {0.0f, 0.2f, 0.0f},
    {0.0f, 0.1f, 0.0f},   {-0.2f, 0.15f, 0.0f}, {-0.3f, 0.0f, 0.0f}, {0.2f, 0.15f, 0.0f},
    {0.3f, 0.0f, 0.0f},   {-0.1f, -0.1f, 0.0f}, {0.0f, -0.45f, 0.0f}, {0.1f, -0.1f, 0.0f},
    {0.0f, -0.45f, 0.0f}};

/* A swing there and back within two seconds, from the tangent of half of its angle. */
static void push_joint(TumbleSet *set, int number, int joint) {
    double times[KEYS];
    float keys[KEYS][4];
    int axis = joint % 3, key;
    for (key = 0; key < KEYS; key++) {
        double phase = (double)((key + joint * 7) % (KEYS - 1)) / (KEYS - 1);
        double swing = phase < 0.5 ? 4.0 * phase - 1.0 : 3.0 - 4.0 * phase;
        double tangent = swing * (0.1 + 0.08 * number + 0.01 * joint);
        double square = tangent * tangent;
        times[key] = key / 15.0;
        memset(keys[key], 0, sizeof keys[key]);
        keys[key][axis] = (float)(2.0 * tangent / (1.0 + square));
        keys[key][3] = (float)((1.0 - square) / (1.0 + square));
    }
    check(tumble_set_push(set, NULL, times, keys[0], KEYS), "tumble_set_push");
}

/* The figure's clips, a mask of its upper body, and inverse bind matrices for the pose in which nothing
   turns. */
static TumbleCrowdLibrary *figures(void) {
    TumbleCrowdLibrary *library;
    TumbleInterpolation how;
    float mask[JOINTS], bind[JOINTS][3][4], place[JOINTS][3];
    const double bob_times[3] = {0.0, 1.0, 2.0};
    const float bob[3][3] = {{0.0f, 1.0f, 0.0f}, {0.0f, 0.95f, 0.02f}, {0.0f, 1.0f, 0.0f}};
    size_t clip, mask_number;
    int number, joint, i;

    memset(&how, 0, sizeof how);
    how.size = sizeof how;
    how.method = "slerp";
    check(tumble_crowd_library_new(parents, offsets[0], JOINTS, 0, &library),
          "tumble_crowd_library_new");
    for (number = 0; number < CLIPS; number++) {
        TumbleSet *set;
        check(tumble_set_new(&set), "tumble_set_new");
        for (joint = 0; joint < JOINTS; joint++) {
            push_joint(set, number, joint);
        }
        check(tumble_set_translations(set, 0, bob_times, bob[0], NULL, 3),
              "tumble_set_translations");
        check(tumble_crowd_library_push(library, set, &how, "linear", &clip),
              "tumble_crowd_library_push");
        check(tumble_set_free(set), "tumble_set_free");
    }
    memset(bind, 0, sizeof bind);
    for (joint = 0; joint < JOINTS; joint++) {
        mask[joint] = joint >= 1 && joint <= 8 ? 1.0f : 0.0f;
        for (i = 0; i < 3; i++) {
            place[joint][i] = offsets[joint][i];
            if (parents[joint] >= 0) {
                place[joint][i] += place[parents[joint]][i];
            }
            bind[joint][i][i] = 1.0f;
            bind[joint][i][3] = -place[joint][i];
        }
    }
    check(tumble_crowd_library_push_mask(library, mask, JOINTS, &mask_number),
          "tumble_crowd_library_push_mask");
    check(tumble_crowd_library_set_inverse_bind(library, bind[0][0], JOINTS),
          "tumble_crowd_library_set_inverse_bind");
    return library;
}

/* What an instance plays: a clip, and where there is a second layer, one over it or added to it. */
static size_t plays(TumbleCrowdLayer *layers, size_t instance, size_t frame, size_t clips,
                    size_t of_each) {
    size_t layer;
    for (layer = 0; layer < of_each; layer++) {
        TumbleCrowdLayer *own = &layers[layer];
        memset(own, 0, sizeof *own);
        own->size = sizeof *own;
        own->instance = instance;
        own->layer = layer;
        own->clip = (instance + frame + layer) % clips;
        own->time = (int64_t)(instance * 9973);
        own->speed = 0.75f + 0.0625f * (float)(instance % 9);
        own->wrap = instance % 5 == 0 ? TUMBLE_WRAP_MIRROR : TUMBLE_WRAP_LOOP;
        if (layer > 0) {
            own->weight = 0.25f * (float)(instance % 5);
            own->additive = instance % 2;
            own->mask = 1;
        }
    }
    return of_each;
}

/* The CPU's crowd, and the device's. */
typedef struct Both {
    TumbleCrowd *crowds[2];
    size_t instances, layers, clips;
} Both;

/* Everybody plays something; in later frames one in ten does something new. */
static void go_on(const Both *both, size_t frame) {
    TumbleCrowdLayer *layers =
        (TumbleCrowdLayer *)memory_for(both->instances * both->layers, sizeof *layers);
    size_t instance, count = 0;
    int i;
    for (instance = 0; instance < both->instances; instance++) {
        if (frame == 0 || instance % 10 == frame) {
            count += plays(&layers[count], instance, frame, both->clips, both->layers);
        }
    }
    for (i = 0; i < 2; i++) {
        check(tumble_crowd_set(both->crowds[i], layers, count), "tumble_crowd_set");
        check(tumble_crowd_advance(both->crowds[i], 1.0 / 60.0), "tumble_crowd_advance");
    }
    free(layers);
}

/* Evaluates both; the device works while the CPU does. Prints a hash of the bytes, which are the same. */
static void compare(const Both *both, const char *what, uint32_t values, uint32_t half) {
    size_t count, bytes, i;
    void *found[2];
    bool done = false;
    uint64_t hash = UINT64_C(14695981039346656037); /* FNV-1a */
    check(tumble_crowd_output_count(both->crowds[0], values, &count), "tumble_crowd_output_count");
    bytes = count * (half ? 2 : 4);
    for (i = 0; i < 2; i++) {
        found[i] = memory_for(bytes, 1);
    }
    check(tumble_crowd_submit(both->crowds[1], values, half), "tumble_crowd_submit");
    if (half) {
        check(tumble_crowd_evaluate_half(both->crowds[0], values, (uint16_t *)found[0], count),
              "tumble_crowd_evaluate_half");
    } else {
        check(tumble_crowd_evaluate(both->crowds[0], values, (float *)found[0], count),
              "tumble_crowd_evaluate");
    }
    while (!done) {
        check(tumble_crowd_poll(both->crowds[1], &done), "tumble_crowd_poll");
    }
    if (half) {
        check(tumble_crowd_wait_half(both->crowds[1], (uint16_t *)found[1], count),
              "tumble_crowd_wait_half");
    } else {
        check(tumble_crowd_wait(both->crowds[1], (float *)found[1], count), "tumble_crowd_wait");
    }
    if (memcmp(found[0], found[1], bytes) != 0) {
        fprintf(stderr, "%s: the bytes differ\n", what);
        exit(1);
    }
    for (i = 0; i < bytes; i++) {
        hash = (hash ^ ((const unsigned char *)found[0])[i]) * UINT64_C(1099511628211);
    }
    printf("%s %s %s %016" PRIx64 "\n", what,
           values == TUMBLE_CROWD_VALUES_ROTATIONS ? "rotations"
           : values == TUMBLE_CROWD_VALUES_LOCAL   ? "local"
           : values == TUMBLE_CROWD_VALUES_MODEL   ? "model"
                                                   : "skinning",
           half ? "f16" : "f32", hash);
    for (i = 0; i < 2; i++) {
        free(found[i]);
    }
}

/* Some frames of a crowd of a library on both engines, which takes the library. */
static void play(TumbleEngine *const engines[2], TumbleCrowdLibrary *library, const char *what,
                 size_t instances, size_t layers, uint32_t last_values) {
    Both both;
    size_t i, frame;
    uint32_t values, half;
    both.instances = instances;
    both.layers = layers;
    both.clips = tumble_crowd_library_clip_count(library);
    for (i = 0; i < 2; i++) {
        check(tumble_crowd_new(engines[i], library, instances, layers, &both.crowds[i]),
              "tumble_crowd_new");
    }
    printf("%s: %lu instances of %lu joints, %lu clips\n", what, (unsigned long)instances,
           (unsigned long)tumble_crowd_library_joint_count(library), (unsigned long)both.clips);
    check(tumble_crowd_library_free(library), "tumble_crowd_library_free");
    for (frame = 0; frame < FRAMES; frame++) {
        go_on(&both, frame);
        for (values = TUMBLE_CROWD_VALUES_ROTATIONS; values <= last_values; values++) {
            for (half = 0; half < 2; half++) {
                compare(&both, what, values, half);
            }
        }
    }
    for (i = 0; i < 2; i++) {
        check(tumble_crowd_free(both.crowds[i]), "tumble_crowd_free");
    }
}

/* The clips of a file as a library. What is wrong with one is said, and it is left out. */
static TumbleCrowdLibrary *of_file(const char *path) {
    TumbleFile *file;
    TumbleCrowdLibrary *library;
    size_t clip, number;
    check(tumble_file_load(path, &file), "tumble_file_load");
    check(tumble_crowd_library_of_file(file, 0, &library), "tumble_crowd_library_of_file");
    for (clip = 0; clip < tumble_file_clip_count(file); clip++) {
        if (tumble_crowd_library_push_clip(library, file, clip, NULL, NULL, &number) !=
            TUMBLE_RESULT_OK) {
            fprintf(stderr, "left out: %s\n", tumble_last_error());
        }
    }
    check(tumble_file_free(file), "tumble_file_free");
    return library;
}

int main(int argument_count, char **arguments) {
    TumbleEngine *engines[2];
    if (argument_count < 2 || argument_count > 3) {
        fprintf(stderr, "usage: crowd DEVICE [FILE]\n");
        return 2;
    }
    if (tumble_version() != TUMBLE_VERSION) {
        fprintf(stderr, "the library is version %" PRIu32 ", the header %d\n", tumble_version(),
                TUMBLE_VERSION);
        return 2;
    }
    check(tumble_engine_open("cpu", NULL, &engines[0]), "tumble_engine_open");
    check(tumble_engine_open(arguments[1], NULL, &engines[1]), "tumble_engine_open");
    fprintf(stderr, "comparing %s with the CPU\n", tumble_engine_device_name(engines[1]));
    play(engines, figures(), "figures", 3000, 2, TUMBLE_CROWD_VALUES_SKINNING);
    if (argument_count == 3) {
        play(engines, of_file(arguments[2]), "file", 300, 1, TUMBLE_CROWD_VALUES_MODEL);
    }
    check(tumble_engine_free(engines[0]), "tumble_engine_free");
    check(tumble_engine_free(engines[1]), "tumble_engine_free");
    printf("all bytes are the same\n");
    return 0;
}
