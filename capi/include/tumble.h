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
 The result of a call.
 */
enum TumbleResult
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   Success.
   */
  TUMBLE_RESULT_OK = 0,
  /*
   A pointer is null, or not aligned for what it points to.
   */
  TUMBLE_RESULT_INVALID_POINTER = 1,
  /*
   A handle was freed, never existed, or has another type.
   */
  TUMBLE_RESULT_INVALID_HANDLE = 2,
  /*
   An argument has a value that it cannot have: an unknown constant or name, a size that
   overflows, a structure of another version, text that is not UTF-8.
   */
  TUMBLE_RESULT_INVALID_ARGUMENT = 3,
  /*
   Memory for a result is not exactly as large as the result, or a buffer's range does not fit it.
   */
  TUMBLE_RESULT_WRONG_SIZE = 4,
  /*
   The index is out of range.
   */
  TUMBLE_RESULT_OUT_OF_RANGE = 5,
  /*
   Keys, times, samples or a file are refused; the message says where.
   */
  TUMBLE_RESULT_INVALID_INPUT = 6,
  /*
   Not enough memory.
   */
  TUMBLE_RESULT_OUT_OF_MEMORY = 7,
  /*
   There is no such device, it cannot be opened, it is not exact, or it failed.
   */
  TUMBLE_RESULT_DEVICE = 8,
  /*
   An internal error of the library; please report it.
   */
  TUMBLE_RESULT_INTERNAL = 9,
  /*
   The call is not possible now: nothing was submitted, the result of a submission was not taken, or it
   needs data that the object does not have.
   */
  TUMBLE_RESULT_WRONG_STATE = 10,
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
 Which of the two quaternions `q` and `-q` of each key is used.
 */
enum TumblePath
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   The one nearer to the previous key, so that every rotation is the shorter one.
   */
  TUMBLE_PATH_SHORTEST = 0,
  /*
   The stored one. Methods that define the path themselves ignore this.
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
 The speed along the curve of a track.
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
 The values outside the keys.
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
   The track repeats.
   */
  TUMBLE_WRAP_LOOP = 1,
  /*
   The track runs backwards, then forwards again.
   */
  TUMBLE_WRAP_MIRROR = 2,
  /*
   The rotation continues at the angular velocity at that end.
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
 The boundary condition: the curve in the first and the last segment.
 */
enum TumbleEnds
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   That of the method.
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
   A closed curve: the last key equals the first.
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
   The listed times, the same for every track, in any order.
   */
  TUMBLE_SAMPLING_TIMES = 2,
  /*
   The listed times, different for each track: first those of the first track, then those of the
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
 What is written for every joint of every instance, in the order `[instance][joint]`.
 */
enum TumbleCrowdValues
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   The rotation in the parent's frame, four numbers: `x y z w`.
   */
  TUMBLE_CROWD_VALUES_ROTATIONS = 0,
  /*
   The transform in the parent's frame, twelve numbers: three rows of four, for column vectors, the
   last column the translation.
   */
  TUMBLE_CROWD_VALUES_LOCAL = 1,
  /*
   The transform in the model, likewise.
   */
  TUMBLE_CROWD_VALUES_MODEL = 2,
  /*
   The transform in the model times the inverse bind matrix, likewise: what vertices are skinned
   with.
   */
  TUMBLE_CROWD_VALUES_SKINNING = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum TumbleCrowdValues TumbleCrowdValues;
#else
typedef uint32_t TumbleCrowdValues;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 How a matrix lies in memory.
 */
enum TumbleMatrixOrder
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   Row by row.
   */
  TUMBLE_MATRIX_ORDER_ROW_MAJOR = 0,
  /*
   Column by column.
   */
  TUMBLE_MATRIX_ORDER_COLUMN_MAJOR = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum TumbleMatrixOrder TumbleMatrixOrder;
#else
typedef uint32_t TumbleMatrixOrder;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 A set prepared for one method, on an engine's device. Any number of threads may use it at once.
 */
typedef struct TumbleClip TumbleClip;

/*
 A range of an application's buffer that a request of a clip is evaluated into, with all that recording needs.
 */
typedef struct TumbleClipTarget TumbleClipTarget;

/*
 Many instances of a library's skeleton, each of which plays clips at a separate time and speed. Threads
 that use the same crowd at once wait for each other.
 */
typedef struct TumbleCrowd TumbleCrowd;

/*
 Clips of one skeleton, prepared for crowds. Any number of threads may use it at once.
 */
typedef struct TumbleCrowdLibrary TumbleCrowdLibrary;

/*
 A range of an application's buffer that a crowd is evaluated into, with all that recording needs.
 */
typedef struct TumbleCrowdTarget TumbleCrowdTarget;

/*
 An open device. Any number of threads may use it at once.
 */
typedef struct TumbleEngine TumbleEngine;

/*
 A motion file that was read: its clips, and messages about them.
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
   The bytes of a Vulkan device's memory that segments may use; 0: no limit.
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

/*
 What is asked of a clip. All zeros but `size` and `samples` ask for all of it, as `x y z w` in f32, track by track.
 */
typedef struct TumbleRequest {
  /*
   `sizeof(TumbleRequest)`.
   */
  size_t size;
  /*
   At which times.
   */
  const struct TumbleSamples *samples;
  /*
   A `TumbleLayout`.
   */
  uint32_t layout;
  /*
   A `TumbleMatrixOrder`, for matrices.
   */
  uint32_t matrix_order;
  /*
   The name of what each rotation is stored as, such as "f16" or "matrix-3x4" (`tumble_encoding_name`); null:
   "f32".
   */
  const char *encoding;
  /*
   The axes of "euler": "ZXY" about turned axes, "zxy" about fixed ones; null: "XYZ".
   */
  const char *sequence;
  /*
   The first track, from 0.
   */
  size_t first_track;
  /*
   How many tracks; 0: all from the first one on.
   */
  size_t track_count;
  /*
   The first of the samples, from 0.
   */
  size_t first_sample;
  /*
   How many of the samples; 0: all from the first one on.
   */
  size_t sample_count;
} TumbleRequest;

/*
 An application's Vulkan instance, device and queue. They stay the application's.

 The device needs no features; a software device is faster with `shaderInt64`. Below Vulkan 1.2,
 enable `VK_KHR_shader_float_controls` where it is offered.
 */
typedef struct TumbleVulkan {
  /*
   `sizeof(TumbleVulkan)`.
   */
  size_t size;
  /*
   `vkGetInstanceProcAddr` of the loader that the instance was made by, cast to `void (*)(void)`.
   The loader stays loaded as long as the engine and all that was made with it.
   */
  void (*get_instance_proc_addr)(void);
  /*
   The `VkInstance`, of Vulkan 1.1 or newer.
   */
  void *instance;
  /*
   The `VkPhysicalDevice` of the device.
   */
  void *physical_device;
  /*
   The `VkDevice`.
   */
  void *device;
  /*
   A `VkQueue` of the device that can compute.
   */
  void *queue;
  /*
   The family of that queue.
   */
  uint32_t queue_family;
  /*
   The version that the instance was made for, `VkApplicationInfo.apiVersion`.
   */
  uint32_t api_version;
  /*
   1: `VK_KHR_shader_float_controls` is enabled; it does not count from Vulkan 1.2 on.
   */
  uint32_t shader_float_controls;
  /*
   1: the feature `shaderInt64` is enabled.
   */
  uint32_t shader_int64;
  /*
   Another `VkQueue` of the device, which copies results to the host while the first one computes, or
   null. The device must have the feature `timelineSemaphore` enabled then.
   */
  void *copy_queue;
  /*
   The family of that queue.
   */
  uint32_t copy_queue_family;
  /*
   Locks `queue`, which the application uses too, maybe on another thread; called with `queue_user` before each
   submission of the engine. With it goes `unlock_queue`. Null: nobody else may use the queue while the library
   does. The application must not hold the lock while it calls the library.
   */
  void (*lock_queue)(void *user);
  /*
   Unlocks it, called after each submission on the same thread.
   */
  void (*unlock_queue)(void *user);
  /*
   What both get. It must stay valid as long as the engine and all that was made with it.
   */
  void *queue_user;
} TumbleVulkan;

/*
 What a layer of an instance plays. If all is zero but `size`, it stands still at the start of the first clip.
 */
typedef struct TumbleCrowdLayer {
  /*
   `sizeof(TumbleCrowdLayer)`.
   */
  size_t size;
  /*
   The instance, from 0.
   */
  size_t instance;
  /*
   Its layer, from 0; higher ones are laid over lower ones.
   */
  size_t layer;
  /*
   The clip, by its number in the library.
   */
  size_t clip;
  /*
   The time in the clip, ticks; `wrap` says what happens outside of the clip.
   */
  int64_t time;
  /*
   Ticks of the clip for a tick of the clock: 1 as keyed, 0 to stand still, negative to run
   backwards; magnitudes below 128, kept in units of 2^-16.
   */
  float speed;
  /*
   The weight with which it is blended over the layers below, 0 to 1, stored in units of 2^-15. The first layer
   has no weight.
   */
  float weight;
  /*
   A `TumbleWrap`, but not `TUMBLE_WRAP_EXTRAPOLATE`.
   */
  uint32_t wrap;
  /*
   1: the clip's difference from its reference pose is added to the layers below; 0: it is blended
   over them.
   */
  uint32_t additive;
  /*
   0: all joints take part; or a mask, by the number that `tumble_crowd_library_push_mask` gave.
   */
  size_t mask;
} TumbleCrowdLayer;

/*
 A layer's weight as a function of the clock: `from` before `start`, `to` from `ticks` later on, and between them in
 equal parts for equal ticks.
 */
typedef struct TumbleCrowdFade {
  /*
   `sizeof(TumbleCrowdFade)`.
   */
  size_t size;
  /*
   The instance, from 0.
   */
  size_t instance;
  /*
   Its layer, from 1: the first has no weight.
   */
  size_t layer;
  /*
   When it starts, ticks of the clock; before now or later.
   */
  uint64_t start;
  /*
   How many ticks it takes; 0 for a step.
   */
  uint64_t ticks;
  /*
   The weight before, 0 to 1, kept in units of 2^-15.
   */
  float from;
  /*
   The weight after, likewise.
   */
  float to;
} TumbleCrowdFade;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/*
 The version of the library: 1 000 000 for each major, 1 000 for each minor and 1 for each patch
 version. It equals `TUMBLE_VERSION` where header and library belong together.
 */
uint32_t tumble_version(void);

/*
 The error message of the last failed call of this thread: UTF-8, empty before the
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
 The name of the device, "CPU" for the CPU: UTF-8, valid until the engine is freed; null for an
 invalid handle.
 */
const char *tumble_engine_device_name(const struct TumbleEngine *engine);

/*
 Frees an engine; clips that were uploaded to it keep its device open. Null is allowed.
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
 The number of tracks; 0 for an invalid handle.
 */
size_t tumble_set_track_count(const struct TumbleSet *set);

/*
 The number of keys of all tracks together; 0 for an invalid handle.
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
 Frees a set; clips that were made of it stay. Null is allowed.
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
 The number of clips that could be read; 0 for an invalid handle.
 */
size_t tumble_file_clip_count(const struct TumbleFile *file);

/*
 The name of a clip, empty where it has none: UTF-8, valid until the file is freed; null where there
 is no such clip.
 */
const char *tumble_file_clip_name(const struct TumbleFile *file, size_t clip);

/*
 A clip's tracks of rotations, with the translations and scales that crowds use, as a set of the
 caller's own, to be freed.

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
 What was subtracted from the translations of a track of a clip, so that f32 is accurate enough for positions
 such as those of maps: add it to what is made of them, in doubles. Mostly 0, 0, 0.

 # Safety
 `origin` has room for three numbers.
 */
TumbleResult tumble_file_clip_origin(const struct TumbleFile *file,
                                     size_t clip,
                                     size_t track,
                                     double *origin);

/*
 How many messages there are about the file: warnings, and why clips could not be read; 0 for an
 invalid handle.
 */
size_t tumble_file_message_count(const struct TumbleFile *file);

/*
 A message about the file: UTF-8, valid until the file is freed; null where there is none.
 */
const char *tumble_file_message(const struct TumbleFile *file, size_t index);

/*
 Frees a file; sets that were made of it stay. Null is allowed.
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
 Prepares and evaluates a set in one call, into the caller's memory: `output_count` floats, exactly
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
 Prepares a set for a method and uploads it to the engine's device, where it stays.

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
 Evaluates a clip of an engine of `tumble_engine_from_vulkan` into a range of a buffer on its device:
 four floats for each sample of each track, which stay there. Returns when they are written; what is
 submitted to the queue afterwards sees them. `buffer` is the `VkBuffer`, as a number:
 `(uint64_t)buffer`. The range starts at a multiple of 16 and has at least 16 × tracks × samples bytes.

 The buffer belongs to that device, has memory, and was made for use as
 `VK_BUFFER_USAGE_STORAGE_BUFFER_BIT` and `VK_BUFFER_USAGE_TRANSFER_DST_BIT`. Nobody else uses it, or
 the queue, during the call.

 # Safety
 `samples` is such a structure, and the buffer is as said.
 */
TumbleResult tumble_clip_evaluate_to_buffer(const struct TumbleClip *clip,
                                            const struct TumbleSamples *samples,
                                            uint32_t layout,
                                            uint64_t buffer,
                                            uint64_t offset,
                                            uint64_t size);

/*
 Frees a clip. Null is allowed.
 */
TumbleResult tumble_clip_free(struct TumbleClip *clip);

/*
 The number of encodings.
 */
size_t tumble_encoding_count(void);

/*
 The name of an encoding, from 0; null where there is none.
 */
const char *tumble_encoding_name(size_t index);

/*
 How many bytes the result of a request has.

 # Safety
 `request` is such a structure, and `bytes` has room for a number.
 */
TumbleResult tumble_request_bytes(const struct TumbleClip *clip,
                                  const struct TumbleRequest *request,
                                  size_t *bytes);

/*
 Evaluates what is asked of a clip into the caller's memory: exactly `tumble_request_bytes`, values of the encoding in
 the order of the layout. All arguments are checked before anything is written.

 # Safety
 `request` is such a structure, and `output` has room for so many bytes, which nothing else uses during the call.
 */
TumbleResult tumble_request_evaluate(const struct TumbleClip *clip,
                                     const struct TumbleRequest *request,
                                     void *output,
                                     size_t output_bytes);

/*
 Makes ready what it takes to evaluate a request into a range of a buffer of the application's, on the device of
 `tumble_engine_from_vulkan`: kernels are compiled, and what they read of the samples is brought to the device, here,
 and not when a frame is recorded. `buffer` is the `VkBuffer`, as a number: `(uint64_t)buffer`. The range starts at
 a multiple of the bytes of a value (16 for "f32"), and has at least `tumble_request_bytes`.

 The buffer belongs to that device, has memory, and was made for use as `VK_BUFFER_USAGE_STORAGE_BUFFER_BIT` and
 `VK_BUFFER_USAGE_TRANSFER_DST_BIT`; it stays the application's, and lives longer than the target. The target needs
 neither the clip nor the engine that it was made of. This call submits to the queue, as uploading does.

 # Safety
 `request` is such a structure, the buffer is as said, and `target` has room for a handle.
 */
TumbleResult tumble_clip_target_new(const struct TumbleClip *clip,
                                    const struct TumbleRequest *request,
                                    uint64_t buffer,
                                    uint64_t offset,
                                    uint64_t size,
                                    struct TumbleClipTarget **target);

/*
 Records an evaluation into the application's `VkCommandBuffer`, to `offset` bytes behind the beginning of the
 target's range, a multiple of the bytes of a value. Nothing is waited for, submitted or allocated. What is recorded
 waits for all that was recorded before it, and all that comes behind it sees the result; it may be submitted any
 number of times, to any queue of the family.

 The command buffer is of the engine's device and of a family that computes, in recording, outside of a render pass.

 # Safety
 The command buffer is as said, and nobody else uses it during the call.
 */
TumbleResult tumble_clip_record(const struct TumbleClipTarget *target,
                                void *commands,
                                uint64_t offset);

/*
 Frees a target, after all work that was recorded with it has ended. Null is allowed.

 # Safety
 No such work is in flight, and none will be submitted.
 */
TumbleResult tumble_clip_target_free(struct TumbleClipTarget *target);

/*
 Sets the translations of a track, replacing any it had. `times` are seconds, strictly increasing,
 and may differ from those of its rotations; `keys` are vectors, three numbers for each time;
 `tangents`, for "gltf-cubic", may be null or has six numbers for each time: the tangent with which the
 curve arrives, then the one with which it leaves, units per second. If anything is refused, the set
 is as it was.

 # Safety
 `times` has `key_count` numbers, `keys` three times as many, and `tangents` is null or has six times
 as many.
 */
TumbleResult tumble_set_translations(struct TumbleSet *set,
                                     size_t track,
                                     const double *times,
                                     const float *keys,
                                     const float *tangents,
                                     size_t key_count);

/*
 Sets the scales of a track along its axes; otherwise as `tumble_set_translations`.

 # Safety
 As there.
 */
TumbleResult tumble_set_scales(struct TumbleSet *set,
                               size_t track,
                               const double *times,
                               const float *keys,
                               const float *tangents,
                               size_t key_count);

/*
 Creates an engine on an application's Vulkan device, for crowds that are recorded into its command buffers
 (`tumble_crowd_record`), and for all else that engines do.

 The handles stay the application's, which destroys them after it has freed the engine, its clips,
 crowds and targets, and no call with one of them is under way. Calls that submit work (uploading,
 evaluating, submitting; not recording) use the queue, so nobody else may at the same time: a queue
 of the library's own is the simplest where the device has several.

 # Safety
 `vulkan` is such a structure, whose handles are valid and belong together and live as said; `options` is
 null or such a structure, and `engine` has room for a handle.
 */
TumbleResult tumble_engine_from_vulkan(const struct TumbleVulkan *vulkan,
                                       const struct TumbleEngineOptions *options,
                                       struct TumbleEngine **engine);

/*
 Creates an empty library for a skeleton that is given by arrays. `parents` has the index of each joint's parent, -1 for a
 root; parents may come after their children. `offsets` has three numbers for each joint: where it
 is in its parent's frame if a clip has no translations for it; null: at the parent.
 `ticks_per_second`: the unit of all times, 0 for 705 600, which allows clips of 50 minutes.

 # Safety
 `parents` has `joint_count` numbers, `offsets` is null or has three times as many, and `library` has
 room for a handle.
 */
TumbleResult tumble_crowd_library_new(const int32_t *parents,
                                      const float *offsets,
                                      size_t joint_count,
                                      uint32_t ticks_per_second,
                                      struct TumbleCrowdLibrary **library);

/*
 Adds a clip: a track for each joint, in their order, the rotations by `interpolation` and the
 translations and scales by `vectors`: "step", "linear", "catmull-rom", "bessel-overhauser",
 "gltf-cubic", "c2" or "b-spline"; null is "linear". Joints without translations hang at their
 offsets. Instances say what happens outside the keys, so `before` and `after` do not count. The
 clip's reference pose, for additive layers, is its pose at its start. If anything is refused, the
 library is as it was.

 # Safety
 `interpolation` is null (the defaults) or such a structure, `vectors` null or text that ends with a
 zero, and `clip`, where the clip's number goes, null or room for one.
 */
TumbleResult tumble_crowd_library_push(struct TumbleCrowdLibrary *library,
                                       const struct TumbleSet *set,
                                       const struct TumbleInterpolation *interpolation,
                                       const char *vectors,
                                       size_t *clip);

/*
 Adds a mask, a weight from 0 to 1 for each joint, which layers' weights are multiplied with. There
 can be 31. `mask` gets its number, from 1, as `TumbleCrowdLayer.mask` takes it.

 # Safety
 `weights` has `joint_count` numbers, and `mask` is null or has room for a number.
 */
TumbleResult tumble_crowd_library_push_mask(struct TumbleCrowdLibrary *library,
                                            const float *weights,
                                            size_t joint_count,
                                            size_t *mask);

/*
 Sets the inverse bind matrix of every joint: the inverse of its model matrix in the bind pose,
 three rows of four numbers each, for column vectors, the last column the translation, as results are.
 (A matrix of 16 numbers in columns, as glTF has them, has `m[0] m[4] m[8] m[12]` in its first row.)

 # Safety
 `matrices` has 12 × `joint_count` numbers.
 */
TumbleResult tumble_crowd_library_set_inverse_bind(struct TumbleCrowdLibrary *library,
                                                   const float *matrices,
                                                   size_t joint_count);

/*
 Makes the pose of the clip `from` at a tick, held at its ends, the reference pose of `clip`: what
 additive layers of it differ from.
 */
TumbleResult tumble_crowd_library_set_reference(struct TumbleCrowdLibrary *library,
                                                size_t clip,
                                                size_t from,
                                                uint32_t tick);

/*
 The number of joints; 0 for an invalid handle.
 */
size_t tumble_crowd_library_joint_count(const struct TumbleCrowdLibrary *library);

/*
 The number of clips; 0 for an invalid handle.
 */
size_t tumble_crowd_library_clip_count(const struct TumbleCrowdLibrary *library);

/*
 Ticks of a second; 0 for an invalid handle.
 */
uint32_t tumble_crowd_library_ticks_per_second(const struct TumbleCrowdLibrary *library);

/*
 The length of a clip, ticks: from the first key of any channel to the last, at least 1. 0 if there
 is no such clip.
 */
uint32_t tumble_crowd_library_clip_ticks(const struct TumbleCrowdLibrary *library, size_t clip);

/*
 The name of a joint, empty in libraries that were made of arrays: UTF-8, valid until the library is
 freed; null where there is no such joint.
 */
const char *tumble_crowd_library_joint_name(const struct TumbleCrowdLibrary *library, size_t joint);

/*
 The index of each joint's parent, -1 for a root: `joint_count` numbers, exactly as many as there are
 joints.

 # Safety
 `parents` has room for `joint_count` numbers, which nothing else uses during the call.
 */
TumbleResult tumble_crowd_library_parents(const struct TumbleCrowdLibrary *library,
                                          int32_t *parents,
                                          size_t joint_count);

/*
 Frees a library; crowds that were made of it stay. Null is allowed.
 */
TumbleResult tumble_crowd_library_free(struct TumbleCrowdLibrary *library);

/*
 An empty library for the skeleton of a file: the joints of all of its clips, by name, with their
 parents and rest positions; all of them are roots if the file has no hierarchy. Its clips are then
 pushed by `tumble_crowd_library_push_clip`. `ticks_per_second` is as in `tumble_crowd_library_new`.

 # Safety
 `library` has room for a handle.
 */
TumbleResult tumble_crowd_library_of_file(const struct TumbleFile *file,
                                          uint32_t ticks_per_second,
                                          struct TumbleCrowdLibrary **library);

/*
 Adds a clip of a file, whose joints are known by their names. Joints that the clip does not have stay
 where they rest, and it must have none that the library has not. `interpolation` and `vectors` are as
 in `tumble_crowd_library_push`; null is what the file says, which must then be one method for all
 rotations and one for all translations and scales.

 # Safety
 `interpolation` is null or such a structure, `vectors` null or text that ends with a zero, and
 `clip`, where the clip's number in the library goes, null or room for one.
 */
TumbleResult tumble_crowd_library_push_clip(struct TumbleCrowdLibrary *library,
                                            const struct TumbleFile *file,
                                            size_t clip_of_file,
                                            const struct TumbleInterpolation *interpolation,
                                            const char *vectors,
                                            size_t *clip);

/*
 Creates a crowd of 1 to 1 000 000 instances with 1 to 4 layers each. All of them stand still at the start of
 the library's first clip until they are set. The library is copied, to the device too: what is
 pushed to it later is not in this crowd.

 # Safety
 `crowd` has room for a handle.
 */
TumbleResult tumble_crowd_new(const struct TumbleEngine *engine,
                              const struct TumbleCrowdLibrary *library,
                              size_t instances,
                              size_t layers,
                              struct TumbleCrowd **crowd);

/*
 Sets what layers of instances play from now on: 16 bytes each that reach the device with the next
 evaluation. Of two for the same layer the later one counts. If one is refused, none is set.

 # Safety
 `layers` has `count` such structures.
 */
TumbleResult tumble_crowd_set(struct TumbleCrowd *crowd,
                              const struct TumbleCrowdLayer *layers,
                              size_t count);

/*
 What a layer of an instance plays, and where it stands now; speed and weight are as they were rounded.
 `layer->size`, `layer->instance` and `layer->layer` say which, the rest is written.

 # Safety
 `layer` is such a structure, which nothing else uses during the call.
 */
TumbleResult tumble_crowd_get(const struct TumbleCrowd *crowd,
                              struct TumbleCrowdLayer *layer);

/*
 The tick of its clip at which a layer of an instance is evaluated now, from 0 to the clip's length.

 # Safety
 `tick` has room for a number.
 */
TumbleResult tumble_crowd_tick(const struct TumbleCrowd *crowd,
                               size_t instance,
                               size_t layer,
                               uint32_t *tick);

/*
 Advances the clock of all instances by the ticks nearest to a number of seconds. Where the sum must not
 drift, as in a film at 30000/1001 frames a second, `tumble_crowd_set_clock` to each frame's ticks.
 */
TumbleResult tumble_crowd_advance(struct TumbleCrowd *crowd,
                                  double seconds);

/*
 Sets the clock, ticks below 2^52; all instances move with it, forwards or backwards.
 */
TumbleResult tumble_crowd_set_clock(struct TumbleCrowd *crowd, uint64_t ticks);

/*
 The clock, ticks.

 # Safety
 `ticks` has room for a number.
 */
TumbleResult tumble_crowd_clock(const struct TumbleCrowd *crowd, uint64_t *ticks);

/*
 Frees a crowd, after waiting for what was submitted; its targets stay. Null is allowed.
 */
TumbleResult tumble_crowd_free(struct TumbleCrowd *crowd);

/*
 Sets the weight of a layer above the first, 0 to 1, kept in units of 2^-15. The rest of what it plays goes on, and
 a fade of it ends.
 */
TumbleResult tumble_crowd_set_weight(struct TumbleCrowd *crowd,
                                     size_t instance,
                                     size_t layer,
                                     float weight);

/*
 Lets the weight of a layer above the first go from what it is now to `weight`, in equal parts for equal ticks of
 the clock, within `ticks`; 0 is at once. From then on it stays. Another fade of the layer, `tumble_crowd_set` and
 `tumble_crowd_set_weight` end it.
 */
TumbleResult tumble_crowd_fade(struct TumbleCrowd *crowd,
                               size_t instance,
                               size_t layer,
                               float weight,
                               uint64_t ticks);

/*
 Sets the weight of a layer above the first as a function of the clock: as `tumble_crowd_fade`, from any weight and
 any time. What `tumble_crowd_get_fade` reports, set in another crowd whose clock stands at the same time, gives
 the same weights at all times.

 # Safety
 `fade` is such a structure.
 */
TumbleResult tumble_crowd_set_fade(struct TumbleCrowd *crowd,
                                   const struct TumbleCrowdFade *fade);

/*
 The fade that the weight of a layer follows, with its weights as they were rounded; one that has ended too, for
 the clock may go back. `fade->size`, `fade->instance` and `fade->layer` say which. `fades`: whether there is one;
 where there is none, the structure stays as it is.

 # Safety
 `fade` is such a structure, which nothing else uses during the call, and `fades` has room for a truth value.
 */
TumbleResult tumble_crowd_get_fade(const struct TumbleCrowd *crowd,
                                   struct TumbleCrowdFade *fade,
                                   bool *fades);

/*
 From now on evaluates the instances of a list alone, as a camera sees them: a result has their rows and no others,
 in the list's order, with the bits that they have among all. The others go on meanwhile. The list is in any
 order, names no instance twice, and may be empty; it is copied. If it is refused, everything stays.

 # Safety
 `instances` has `count` numbers.
 */
TumbleResult tumble_crowd_set_visible(struct TumbleCrowd *crowd,
                                      const uint32_t *instances,
                                      size_t count);

/*
 From now on evaluates all instances again.
 */
TumbleResult tumble_crowd_set_all_visible(struct TumbleCrowd *crowd);

/*
 How many instances are evaluated: as many as the list has, or all.

 # Safety
 `count` has room for a number.
 */
TumbleResult tumble_crowd_visible_count(const struct TumbleCrowd *crowd, size_t *count);

/*
 How many numbers a result has: 4 or 12 × joints × instances, those that are visible.

 # Safety
 `count` has room for a number.
 */
TumbleResult tumble_crowd_output_count(const struct TumbleCrowd *crowd,
                                       uint32_t values,
                                       size_t *count);

/*
 Evaluates all instances, or those that are visible, at the clock's time into the caller's memory, and waits until it is done.
 `values` is a `TumbleCrowdValues`; `output_count` is exactly as `tumble_crowd_output_count` says.

 # Safety
 `output` has room for `output_count` floats, which nothing else uses during the call.
 */
TumbleResult tumble_crowd_evaluate(struct TumbleCrowd *crowd,
                                   uint32_t values,
                                   float *output,
                                   size_t output_count);

/*
 As `tumble_crowd_evaluate`, in 16 bits: the bits of halves (IEEE 754), rounded to nearest.

 # Safety
 `output` has room for `output_count` halves, which nothing else uses during the call.
 */
TumbleResult tumble_crowd_evaluate_half(struct TumbleCrowd *crowd,
                                        uint32_t values,
                                        uint16_t *output,
                                        size_t output_count);

/*
 Starts an evaluation at the clock's time and returns at once; a Vulkan device works on it while
 instances and the clock are changed for the next one. The CPU evaluates before this returns. The
 result must be taken by `tumble_crowd_wait`, or by `tumble_crowd_wait_half` where `half` is 1, before
 anything else is evaluated or submitted.
 */
TumbleResult tumble_crowd_submit(struct TumbleCrowd *crowd,
                                 uint32_t values,
                                 uint32_t half);

/*
 Whether what was submitted is done, so that `tumble_crowd_wait` does not wait.

 # Safety
 `done` has room for a truth value.
 */
TumbleResult tumble_crowd_poll(const struct TumbleCrowd *crowd, bool *done);

/*
 Waits for what was submitted with `half` 0, and takes its result. If an argument is refused, the
 result can still be taken.

 # Safety
 `output` has room for `output_count` floats, which nothing else uses during the call.
 */
TumbleResult tumble_crowd_wait(struct TumbleCrowd *crowd, float *output, size_t output_count);

/*
 Waits for what was submitted with `half` 1, and takes its result. If an argument is refused, the
 result can still be taken.

 # Safety
 `output` has room for `output_count` halves, which nothing else uses during the call.
 */
TumbleResult tumble_crowd_wait_half(struct TumbleCrowd *crowd,
                                    uint16_t *output,
                                    size_t output_count);

/*
 Prepares everything to evaluate into a range of an application's buffer, on the device of
 `tumble_engine_from_vulkan`: kernels are compiled and memory is allocated here, and not when a frame
 is recorded. `values` is a `TumbleCrowdValues`, and `half` 1 for numbers of 16 bits. `buffer` is the
 `VkBuffer`, as a number: `(uint64_t)buffer`. The range starts at `offset`, a multiple of 256, and has
 at least `tumble_crowd_output_count` × 4 bytes, × 2 with `half`: as many instances as have room there may be
 visible later.

 The buffer belongs to that device, has memory, and was made for use as
 `VK_BUFFER_USAGE_STORAGE_BUFFER_BIT`; it stays the application's, and lives longer than the target.

 # Safety
 The buffer is as said, and `target` has room for a handle.
 */
TumbleResult tumble_crowd_target_new(const struct TumbleCrowd *crowd,
                                     uint32_t values,
                                     uint32_t half,
                                     uint64_t buffer,
                                     uint64_t offset,
                                     uint64_t size,
                                     struct TumbleCrowdTarget **target);

/*
 Records an evaluation at the clock's time into the application's `VkCommandBuffer`: up to 20 bytes for each
 layer that changed since the last evaluation, 4 for each instance of a new list of visible ones, and the dispatches. Nothing is waited for, submitted or
 allocated. What is recorded behind it, or submitted to the same queue later, sees the result; it
 waits for all that was recorded before it.

 The command buffer is of the engine's device and of the family of its queue, in recording, outside of
 a render pass. What is recorded is submitted once, to the engine's queue, in the order of the calls;
 after a frame that is thrown away, call `tumble_crowd_forget_recorded`. The library submits to that
 queue by itself only in `tumble_upload`, `tumble_evaluate`, `tumble_clip_evaluate`,
 `tumble_clip_evaluate_to_buffer`, `tumble_crowd_new`, `tumble_crowd_evaluate` and `tumble_crowd_submit` (and their `half` forms): the
 application keeps these calls and its own submissions from one another.

 # Safety
 The command buffer is as said, and its work is submitted as said.
 */
TumbleResult tumble_crowd_record(struct TumbleCrowd *crowd,
                                 const struct TumbleCrowdTarget *target,
                                 void *commands);

/*
 Forgets what was recorded: the next evaluation writes all layers again.
 Call it if a recorded frame was discarded.
 */
TumbleResult tumble_crowd_forget_recorded(struct TumbleCrowd *crowd);

/*
 Frees a target, after all work that was recorded with it has ended. Null is allowed.

 # Safety
 No such work is in flight.
 */
TumbleResult tumble_crowd_target_free(struct TumbleCrowdTarget *target);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* TUMBLE_H */
