/* Evaluates keys of its own and the tracks of a motion file, and prints every bit.

   evaluate DEVICE FILE

   cc -I capi/include capi/examples/evaluate.c -L target/release -ltumble_capi -o evaluate */

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tumble.h"

/* Ends the program with the words of the last error, unless a call did what it says. */
static void check(TumbleResult result, const char *call) {
    if (result != TUMBLE_RESULT_OK) {
        fprintf(stderr, "%s: %d: %s\n", call, (int)result, tumble_last_error());
        exit(1);
    }
}

/* Prints the rotations as the bits of their components. */
static void print_bits(const char *what, const float *rotations, size_t count) {
    size_t i;
    for (i = 0; i < count; i++) {
        uint32_t bits;
        memcpy(&bits, &rotations[i], sizeof bits);
        printf("%s %08" PRIx32 "\n", what, bits);
    }
}

static float *floats(size_t count) {
    float *memory = (float *)malloc((count > 0 ? count : 1) * sizeof *memory);
    if (memory == NULL) {
        fprintf(stderr, "no memory for %lu floats\n", (unsigned long)count);
        exit(1);
    }
    return memory;
}

/* An elbow that turns about z, at 60 frames per second, by slerp. */
static void elbow(TumbleEngine *engine) {
    const double times[3] = {0.0, 0.5, 1.25};
    const float keys[3][4] = {
        {0.0f, 0.0f, 0.0f, 1.0f}, {0.0f, 0.0f, 0.6f, 0.8f}, {0.0f, 0.0f, 0.8f, 0.6f}};
    TumbleInterpolation how;
    TumbleSamples samples;
    TumbleSet *set;
    size_t count;
    float *rotations;

    memset(&how, 0, sizeof how);
    how.size = sizeof how;
    how.method = "slerp";
    memset(&samples, 0, sizeof samples);
    samples.size = sizeof samples;
    samples.sampling = TUMBLE_SAMPLING_KEYS;
    samples.rate_frames = 60;

    check(tumble_set_new(&set), "tumble_set_new");
    check(tumble_set_push(set, "elbow", times, keys[0], 3), "tumble_set_push");
    check(tumble_set_sample_count(set, &samples, &count), "tumble_set_sample_count");
    rotations = floats(4 * count);
    check(tumble_evaluate(engine, set, &how, &samples, TUMBLE_LAYOUT_TRACK_MAJOR, rotations,
                          4 * count),
          "tumble_evaluate");
    print_bits("elbow", rotations, 4 * count);

    /* What is wrong is said, and nothing is written. */
    if (tumble_evaluate(engine, set, &how, &samples, TUMBLE_LAYOUT_TRACK_MAJOR, rotations,
                        4 * count - 1) != TUMBLE_RESULT_WRONG_SIZE) {
        exit(2);
    }
    fprintf(stderr, "as it should be: %s\n", tumble_last_error());
    free(rotations);
    check(tumble_set_free(set), "tumble_set_free");
}

/* The first clip of a file, as a clip that stays on the device, at three times. */
static void file(TumbleEngine *engine, const char *path) {
    const double times[3] = {0.0, 7.3, 1.0 / 3.0};
    TumbleSamples samples;
    TumbleFile *loaded;
    TumbleSet *set;
    TumbleClip *clip;
    size_t tracks, count;
    float *rotations;

    memset(&samples, 0, sizeof samples);
    samples.size = sizeof samples;
    samples.sampling = TUMBLE_SAMPLING_TIMES;
    samples.times = times;
    samples.time_count = 3;

    check(tumble_file_load(path, &loaded), "tumble_file_load");
    check(tumble_file_clip_set(loaded, 0, &set), "tumble_file_clip_set");
    check(tumble_file_free(loaded), "tumble_file_free");
    tracks = tumble_set_track_count(set);
    check(tumble_upload(engine, set, NULL, &clip), "tumble_upload");
    check(tumble_set_free(set), "tumble_set_free");

    check(tumble_clip_sample_count(clip, &samples, &count), "tumble_clip_sample_count");
    rotations = floats(4 * tracks * count);
    check(tumble_clip_evaluate(clip, &samples, TUMBLE_LAYOUT_FRAME_MAJOR, rotations,
                               4 * tracks * count),
          "tumble_clip_evaluate");
    print_bits("file", rotations, 4 * tracks * count);
    free(rotations);
    check(tumble_clip_free(clip), "tumble_clip_free");
}

int main(int argument_count, char **arguments) {
    TumbleEngine *engine;
    if (argument_count != 3) {
        fprintf(stderr, "usage: evaluate DEVICE FILE\n");
        return 2;
    }
    if (tumble_version() != TUMBLE_VERSION) {
        fprintf(stderr, "the library is version %" PRIu32 ", the header %d\n", tumble_version(),
                TUMBLE_VERSION);
        return 2;
    }
    check(tumble_engine_open(arguments[1], NULL, &engine), "tumble_engine_open");
    fprintf(stderr, "evaluating on %s\n", tumble_engine_device_name(engine));
    elbow(engine);
    file(engine, arguments[2]);
    check(tumble_engine_free(engine), "tumble_engine_free");
    return 0;
}
