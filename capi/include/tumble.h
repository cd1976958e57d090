/* Tumble for C and C++: keyframe tracks of unit quaternions in, the rotation of every track at every
   sample out, on the CPU or a Vulkan device, with the same bits from both. docs/c.md is the guide.
   Written by cbindgen from capi/src: UPDATE_HEADER=1 cargo test -p tumble-capi */

#ifndef TUMBLE_H
#define TUMBLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/*
 The version of this header: major, minor and patch, as `TUMBLE_VERSION_MAJOR` and the others say.
 */
#define TUMBLE_VERSION 1000

/*
 Versions with another major number are made for other headers.
 */
#define TUMBLE_VERSION_MAJOR 0

/*
 Versions with a greater minor number have more functions; before 1.0 they may change some.
 */
#define TUMBLE_VERSION_MINOR 1

/*
 Versions with another patch number have the same interface.
 */
#define TUMBLE_VERSION_PATCH 0

/*
 What became of a call.
 */
enum TumbleResult
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   It did what it says.
   */
  TUMBLE_RESULT_OK = 0,
  /*
   A pointer is null, or not aligned for what it points to.
   */
  TUMBLE_RESULT_INVALID_POINTER = 1,
  /*
   A handle was freed, was never given, or is of another kind.
   */
  TUMBLE_RESULT_INVALID_HANDLE = 2,
  /*
   An argument has a value that it cannot have: an unknown constant or name, a size that
   overflows, a structure of another version, text that is not UTF-8.
   */
  TUMBLE_RESULT_INVALID_ARGUMENT = 3,
  /*
   Memory for a result is not exactly as large as the result.
   */
  TUMBLE_RESULT_WRONG_SIZE = 4,
  /*
   There is nothing at that index.
   */
  TUMBLE_RESULT_OUT_OF_RANGE = 5,
  /*
   Keys, times, samples or a file are refused; the message names the place.
   */
  TUMBLE_RESULT_INVALID_INPUT = 6,
  /*
   There is not the memory.
   */
  TUMBLE_RESULT_OUT_OF_MEMORY = 7,
  /*
   There is no such device, it cannot be opened, it is not exact, or it failed.
   */
  TUMBLE_RESULT_DEVICE = 8,
  /*
   A mistake of the library's; please report it.
   */
  TUMBLE_RESULT_INTERNAL = 9,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum TumbleResult TumbleResult;
#else
typedef int32_t TumbleResult;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 The order of a result in memory, four numbers for each sample of each track.
 */
enum TumbleLayout
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   `[track][sample]`: the samples of a track lie together.
   */
  TUMBLE_LAYOUT_TRACK_MAJOR = 0,
  /*
   `[sample][track]`: the tracks of a sample lie together.
   */
  TUMBLE_LAYOUT_FRAME_MAJOR = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum TumbleLayout TumbleLayout;
#else
typedef uint32_t TumbleLayout;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 Which of the two quaternions of each key counts.
 */
enum TumblePath
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   The one nearer to the key before: no rotation goes the long way round.
   */
  TUMBLE_PATH_SHORTEST = 0,
  /*
   The one that was given. Methods that have a path of their own keep it.
   */
  TUMBLE_PATH_AS_AUTHORED = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum TumblePath TumblePath;
#else
typedef uint32_t TumblePath;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 How fast a track runs through its curve.
 */
enum TumbleSpeed
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   As the key times say.
   */
  TUMBLE_SPEED_AS_KEYED = 0,
  /*
   At one angular speed from the first key to the last.
   */
  TUMBLE_SPEED_CONSTANT = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum TumbleSpeed TumbleSpeed;
#else
typedef uint32_t TumbleSpeed;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 What happens outside the keys.
 */
enum TumbleWrap
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   The end value is held.
   */
  TUMBLE_WRAP_HOLD = 0,
  /*
   The track starts again.
   */
  TUMBLE_WRAP_LOOP = 1,
  /*
   The track runs backwards, then forwards again.
   */
  TUMBLE_WRAP_MIRROR = 2,
  /*
   The rotation goes on at the angular velocity that it has at that end.
   */
  TUMBLE_WRAP_EXTRAPOLATE = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum TumbleWrap TumbleWrap;
#else
typedef uint32_t TumbleWrap;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 The curve in the first and the last segment.
 */
enum TumbleEnds
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   The method's own.
   */
  TUMBLE_ENDS_OF_METHOD = 0,
  /*
   The parabola through the last three keys.
   */
  TUMBLE_ENDS_PARABOLIC = 1,
  /*
   No angular acceleration.
   */
  TUMBLE_ENDS_NATURAL = 2,
  /*
   The angular velocities `start_velocity` and `end_velocity`.
   */
  TUMBLE_ENDS_CLAMPED = 3,
  /*
   The angular velocity of slerp between the last two keys.
   */
  TUMBLE_ENDS_SECANT = 4,
  /*
   The last key repeats the first; neighbours are taken across the seam.
   */
  TUMBLE_ENDS_LOOP = 5,
  /*
   The first and the last segment hold their first key.
   */
  TUMBLE_ENDS_FROZEN = 6,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum TumbleEnds TumbleEnds;
#else
typedef uint32_t TumbleEnds;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 What is evaluated: four numbers for each sample.
 */
enum TumbleQuantity
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   The rotation, a unit quaternion `x y z w`.
   */
  TUMBLE_QUANTITY_ROTATION = 0,
  /*
   The angular velocity in the body's axes, rad/s, `x y z 0`.
   */
  TUMBLE_QUANTITY_VELOCITY_IN_BODY = 1,
  /*
   The angular velocity in the parent's axes, rad/s, `x y z 0`.
   */
  TUMBLE_QUANTITY_VELOCITY_IN_PARENT = 2,
  /*
   The angular acceleration in the body's axes, rad/s², `x y z 0`.
   */
  TUMBLE_QUANTITY_ACCELERATION_IN_BODY = 3,
  /*
   The angular acceleration in the parent's axes, rad/s², `x y z 0`.
   */
  TUMBLE_QUANTITY_ACCELERATION_IN_PARENT = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum TumbleQuantity TumbleQuantity;
#else
typedef uint32_t TumbleQuantity;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 Which samples.
 */
enum TumbleSampling
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   Frames at a rate, from the first key of the set to its last.
   */
  TUMBLE_SAMPLING_KEYS = 0,
  /*
   Frames at a rate, from `start` to `end`.
   */
  TUMBLE_SAMPLING_RANGE = 1,
  /*
   The times given, the same for every track, in any order.
   */
  TUMBLE_SAMPLING_TIMES = 2,
  /*
   The times given, for each track its own: first those of the first track, then those of the
   second, the same number for each.
   */
  TUMBLE_SAMPLING_TIMES_OF_TRACKS = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum TumbleSampling TumbleSampling;
#else
typedef uint32_t TumbleSampling;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 A set prepared for one method, on an engine's device. Any number of threads may use it at once.
 */
typedef struct TumbleClip TumbleClip;

/*
 One device, open. Any number of threads may use it at once.
 */
typedef struct TumbleEngine TumbleEngine;

/*
 What was read from a motion file: clips, and what is remarkable about it.
 */
typedef struct TumbleFile TumbleFile;

/*
 Tracks of keys. Any number of threads may read a set at once.
 */
typedef struct TumbleSet TumbleSet;

/*
 How a device is opened. All zeros but `size` are the defaults.
 */
typedef struct TumbleEngineOptions {
  /*
   `sizeof(TumbleEngineOptions)`.
   */
  size_t size;
  /*
   Bytes of a Vulkan device's memory that segments may take; 0: as many as it has.
   */
  uint64_t memory;
  /*
   Threads of the CPU; 0: one for each core, shared by all engines.
   */
  uint32_t threads;
  /*
   1: a device that fails its self-test is used all the same, and its bits may differ.
   */
  uint32_t allow_inexact;
} TumbleEngineOptions;

/*
 The samples of an evaluation. Zeros stand for what is not used.
 */
typedef struct TumbleSamples {
  /*
   `sizeof(TumbleSamples)`.
   */
  size_t size;
  /*
   A `TumbleSampling`.
   */
  uint32_t sampling;
  /*
   Frames per `rate_seconds`: 60, or 30000 in 1001 seconds.
   */
  uint64_t rate_frames;
  /*
   0 stands for 1.
   */
  uint64_t rate_seconds;
  /*
   Seconds, for `TUMBLE_SAMPLING_RANGE`.
   */
  double start;
  /*
   Seconds, for `TUMBLE_SAMPLING_RANGE`.
   */
  double end;
  /*
   Seconds, for `TUMBLE_SAMPLING_TIMES` and `TUMBLE_SAMPLING_TIMES_OF_TRACKS`.
   */
  const double *times;
  /*
   How many times there are, of all tracks together.
   */
  size_t time_count;
} TumbleSamples;

/*
 A method with its options. All zeros but `size` are the defaults.
 */
typedef struct TumbleInterpolation {
  /*
   `sizeof(TumbleInterpolation)`.
   */
  size_t size;
  /*
   The method's name, such as "slerp" (`tumble_method_name`); null: "bessel-overhauser".
   */
  const char *method;
  /*
   A `TumblePath`.
   */
  uint32_t path;
  /*
   A `TumbleEnds`.
   */
  uint32_t ends;
  /*
   A `TumbleQuantity`.
   */
  uint32_t quantity;
  /*
   A `TumbleSpeed`.
   */
  uint32_t speed;
  /*
   A `TumbleWrap`: before the first key.
   */
  uint32_t before;
  /*
   A `TumbleWrap`: after the last key.
   */
  uint32_t after;
  /*
   The angular velocity at the first key for `TUMBLE_ENDS_CLAMPED`, rad/s, in the body's axes.
   */
  double start_velocity[3];
  /*
   The same at the last key.
   */
  double end_velocity[3];
  /*
   The tension of "kochanek-bartels".
   */
  double tension;
  /*
   Its continuity.
   */
  double continuity;
  /*
   Its bias.
   */
  double bias;
} TumbleInterpolation;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/*
 The version of the library: 1 000 000 for each major, 1 000 for each minor and 1 for each patch
 version. It equals `TUMBLE_VERSION` where header and library belong together.
 */
uint32_t tumble_version(void);

/*
 What was wrong with the last call of this thread that failed, in words: UTF-8, empty before the
 first. It stays valid until another call of this thread fails.
 */
const char *tumble_last_error(void);

/*
 Opens a device.

 `device`: "auto" (or null), the device that is measured to be the fastest; "cpu"; "vulkan", the
 first Vulkan device that is exact; or a Vulkan device by its index or by a part of its name. All
 give the same bits. `options` may be null.

 # Safety
 `device` is null or text that ends with a zero, `options` null or such a structure, and `engine`
 has room for a handle.
 */
TumbleResult tumble_engine_open(const char *device,
                                const struct TumbleEngineOptions *options,
                                struct TumbleEngine **engine);

/*
 The name of the device, "CPU" for the CPU: UTF-8, valid until the engine is freed; null for what
 is no engine.
 */
const char *tumble_engine_device_name(const struct TumbleEngine *engine);

/*
 Gives an engine back; clips that were uploaded to it keep its device. Null is allowed.
 */
TumbleResult tumble_engine_free(struct TumbleEngine *engine);

/*
 A set without tracks.

 # Safety
 `set` has room for a handle.
 */
TumbleResult tumble_set_new(struct TumbleSet **set);

/*
 Appends a track. `times` are seconds, strictly increasing; `keys` are unit quaternions, `x y z w`
 each, four numbers for each time. Keys that are unit to within rounding are kept bit for bit, others
 (norm within 0.1 of 1) are normalised. `name` may be null. If anything is refused, the set is as it
 was.

 # Safety
 `name` is null or text that ends with a zero, `times` has `key_count` numbers, and `keys` four
 times as many.
 */
TumbleResult tumble_set_push(struct TumbleSet *set,
                             const char *name,
                             const double *times,
                             const float *keys,
                             size_t key_count);

/*
 A set whose tracks all have the same key times: `keys` holds one track after another, `key_count`
 keys of four numbers each.

 # Safety
 `times` has `key_count` numbers, `keys` 4 × `key_count` × `track_count`, and `set` has room for a
 handle.
 */
TumbleResult tumble_set_with_shared_times(const double *times,
                                          size_t key_count,
                                          const float *keys,
                                          size_t track_count,
                                          struct TumbleSet **set);

/*
 The number of tracks; 0 for what is no set.
 */
size_t tumble_set_track_count(const struct TumbleSet *set);

/*
 The number of keys of all tracks together; 0 for what is no set.
 */
size_t tumble_set_key_count(const struct TumbleSet *set);

/*
 The times and the keys (`x y z w`) of a track, as they lie in the set. They stay there until a
 track is pushed to the set, or it is freed.

 # Safety
 `times` and `keys` have room for a pointer and `key_count` for a number.
 */
TumbleResult tumble_set_track(const struct TumbleSet *set,
                              size_t index,
                              const double **times,
                              const float **keys,
                              size_t *key_count);

/*
 The name of a track, `box1`, `box2` … by its place where it has none: UTF-8, with a zero behind
 it. `length` is set to its bytes without that zero, also where `size`, the bytes of `buffer`, is
 not more than that: then nothing else is written, which is an error unless `buffer` is null.

 # Safety
 `buffer` is null or has room for `size` bytes, and `length` for a number.
 */
TumbleResult tumble_set_track_name(const struct TumbleSet *set,
                                   size_t index,
                                   char *buffer,
                                   size_t size,
                                   size_t *length);

/*
 The first and the last key time over all tracks, seconds; an error for a set without tracks.

 # Safety
 `first` and `last` have room for a number.
 */
TumbleResult tumble_set_time_span(const struct TumbleSet *set, double *first, double *last);

/*
 Gives a set back; clips that were made of it stay. Null is allowed.
 */
TumbleResult tumble_set_free(struct TumbleSet *set);

/*
 Reads a motion file of any format: glTF and GLB, BVH, NPZ and NPY, Parquet, Arrow, CSV, TUM,
 `.dat`, known by its first bytes and its name. `path` is UTF-8; on Unix any bytes.

 # Safety
 `path` is text that ends with a zero, and `file` has room for a handle.
 */
TumbleResult tumble_file_load(const char *path, struct TumbleFile **file);

/*
 The number of clips that could be read; 0 for what is no file.
 */
size_t tumble_file_clip_count(const struct TumbleFile *file);

/*
 The name of a clip, empty where it has none: UTF-8, valid until the file is freed; null where there
 is no such clip.
 */
const char *tumble_file_clip_name(const struct TumbleFile *file, size_t clip);

/*
 A clip's tracks of rotations, as a set of the caller's own, to be freed.

 # Safety
 `set` has room for a handle.
 */
TumbleResult tumble_file_clip_set(const struct TumbleFile *file,
                                  size_t clip,
                                  struct TumbleSet **set);

/*
 The name of the method by which the file interpolates the rotations of a track, as
 `TumbleInterpolation.method` takes it ("slerp" for LINEAR in glTF, "bessel-overhauser" where the file
 says nothing): valid until the file is freed; null where there is no such track.
 */
const char *tumble_file_track_method(const struct TumbleFile *file,
                                     size_t clip,
                                     size_t track);

/*
 Whole seconds that were taken from all times of a clip, so that clocks which count from 1970 lose
 no digits; mostly 0.

 # Safety
 `seconds` has room for a number.
 */
TumbleResult tumble_file_clip_time_offset(const struct TumbleFile *file,
                                          size_t clip,
                                          int64_t *seconds);

/*
 How many messages there are about the file: warnings, and why clips could not be read; 0 for what
 is no file.
 */
size_t tumble_file_message_count(const struct TumbleFile *file);

/*
 A message about the file: UTF-8, valid until the file is freed; null where there is none.
 */
const char *tumble_file_message(const struct TumbleFile *file, size_t index);

/*
 Gives a file back; sets that were made of it stay. Null is allowed.
 */
TumbleResult tumble_file_free(struct TumbleFile *file);

/*
 The number of methods.
 */
size_t tumble_method_count(void);

/*
 The name of a method, from 0; null where there is none.
 */
const char *tumble_method_name(size_t index);

/*
 How many samples each track of a set has: a result has 4 × tracks × samples floats.

 # Safety
 `samples` is such a structure, and `count` has room for a number.
 */
TumbleResult tumble_set_sample_count(const struct TumbleSet *set,
                                     const struct TumbleSamples *samples,
                                     size_t *count);

/*
 Prepares and evaluates a set in one go, into the caller's memory: `output_count` floats, exactly
 4 × tracks × samples. Memory that is aligned to 16 bytes is filled without a copy. All arguments are
 checked before anything is written.

 # Safety
 `interpolation` is null (the defaults) or such a structure, `samples` is such a structure, and
 `output` has room for `output_count` floats, which nothing else uses during the call.
 */
TumbleResult tumble_evaluate(const struct TumbleEngine *engine,
                             const struct TumbleSet *set,
                             const struct TumbleInterpolation *interpolation,
                             const struct TumbleSamples *samples,
                             uint32_t layout,
                             float *output,
                             size_t output_count);

/*
 Prepares a set for a method and brings it to the engine's device, where it stays.

 # Safety
 `interpolation` is null (the defaults) or such a structure, and `clip` has room for a handle.
 */
TumbleResult tumble_upload(const struct TumbleEngine *engine,
                           const struct TumbleSet *set,
                           const struct TumbleInterpolation *interpolation,
                           struct TumbleClip **clip);

/*
 How many samples each track of a clip has: a result has 4 × tracks × samples floats.

 # Safety
 `samples` is such a structure, and `count` has room for a number.
 */
TumbleResult tumble_clip_sample_count(const struct TumbleClip *clip,
                                      const struct TumbleSamples *samples,
                                      size_t *count);

/*
 Evaluates a clip into the caller's memory, as `tumble_evaluate` does a set.

 # Safety
 As `tumble_evaluate`.
 */
TumbleResult tumble_clip_evaluate(const struct TumbleClip *clip,
                                  const struct TumbleSamples *samples,
                                  uint32_t layout,
                                  float *output,
                                  size_t output_count);

/*
 Gives a clip back. Null is allowed.
 */
TumbleResult tumble_clip_free(struct TumbleClip *clip);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* TUMBLE_H */
