/* Tumble for C and C++: evaluates tracks of rotation keys (unit quaternions) at any times, on the CPU or
   on a Vulkan device, with the same bits from both. docs/c.md is the guide, and docs/words.md defines the terms.
   Written by cbindgen from capi/src: UPDATE_HEADER=1 cargo test -p tumble-capi

   These rules apply to all functions, unless a comment says otherwise:

   - Errors: a function that can fail returns a TumbleResult: TUMBLE_RESULT_OK (0) on success, otherwise the reason,
     and tumble_last_error returns a message. Functions that return a number or a text return 0 or null on an error,
     and the message is set too. Handles and numbers are written to output arguments on success only.
   - Handles: pointers to TumbleEngine, TumbleSet, TumbleClip and other types without members are handles of objects
     and cannot be dereferenced. A function that creates an object writes the handle to its last argument. The caller
     frees every object, in any order, with the function of its type that ends with _free. An object stays valid when
     the objects that it was made from are freed. A handle that was freed gives TUMBLE_RESULT_INVALID_HANDLE.
   - Pointers: they must not be null, except those of arrays of length 0. Arrays, structures and texts that the caller
     passes are used during the call only. Arrays and texts that a function returns must not be freed.
   - Structures: the first member, size, must be sizeof of the structure. Set members that are not used to 0.
   - Data: texts are UTF-8 and end with a zero byte. Quaternions are x y z w. Times are in seconds, except those of
     crowds, which are in ticks. Indices count from 0.
   - Threads: any thread may call any function at any time, with the same handles too. Calls on the same Vulkan device
     or the same crowd run one after another. If a handle is freed during a call of another thread, that call still
     ends normally. */

#ifndef TUMBLE_H
#define TUMBLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/*
 The version of this header as one number: 1 000 000 × major + 1 000 × minor + patch.
 */
#define TUMBLE_VERSION 1000

/*
 The major version. Header and library must have the same one.
 */
#define TUMBLE_VERSION_MAJOR 0

/*
 The minor version. A greater one has more functions; before version 1.0 it may also change functions.
 */
#define TUMBLE_VERSION_MINOR 1

/*
 The patch version. It does not change the interface.
 */
#define TUMBLE_VERSION_PATCH 0

/*
 The result code of a call. If it is not `TUMBLE_RESULT_OK`, `tumble_last_error` returns a message with the reason.
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
   A pointer is null where null is not allowed, or is not aligned for its type.
   */
  TUMBLE_RESULT_INVALID_POINTER = 1,
  /*
   A handle is null, was freed, never existed, or belongs to an object of another type.
   */
  TUMBLE_RESULT_INVALID_HANDLE = 2,
  /*
   An argument is invalid: an unknown constant or name, a number out of its range, an array that is too large for
   memory, a structure whose `size` is not that of a known version, text that is not UTF-8, or objects that do not
   belong together.
   */
  TUMBLE_RESULT_INVALID_ARGUMENT = 3,
  /*
   The memory for a result does not have the required size, or a range of a buffer is too short or not aligned.
   */
  TUMBLE_RESULT_WRONG_SIZE = 4,
  /*
   There is no track, sample, clip, joint, mask, instance, layer or message with this index.
   */
  TUMBLE_RESULT_OUT_OF_RANGE = 5,
  /*
   Keys, times, a skeleton, a mask, a request or a file are refused. The message says where the error is.
   */
  TUMBLE_RESULT_INVALID_INPUT = 6,
  /*
   There is not enough memory.
   */
  TUMBLE_RESULT_OUT_OF_MEMORY = 7,
  /*
   The device does not exist, cannot be opened, does not compute the CPU's bits, or failed; or the system refused
   to start worker threads.
   */
  TUMBLE_RESULT_DEVICE = 8,
  /*
   An internal error of the library. Please report it, with the message.
   */
  TUMBLE_RESULT_INTERNAL = 9,
  /*
   The call is not possible in this state of the object: nothing was submitted, the result of a submission was
   not taken, it has another precision, or the object lacks data, such as clips or inverse bind matrices.
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
 The order of a result in memory. Each sample of a track has one value: four numbers, or in a request as many as
 its encoding has.
 */
enum TumbleLayout
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   `[track][sample]`: all samples of the first track, then those of the second, and so on.
   */
  TUMBLE_LAYOUT_TRACK_MAJOR = 0,
  /*
   `[sample][track]`: all tracks at the first sample, then at the second, and so on.
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
 Which sign of each key is used: `q` and `-q` are the same rotation. The method "gltf-cubic" ignores
 this option in tracks with tangents, whose keys keep their signs.
 */
enum TumbleKeySigns
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   Each key has the sign that is nearer to the key before it, so rotations between keys are at most 180°.
   */
  TUMBLE_KEY_SIGNS_SHORTEST = 0,
  /*
   Keys keep their signs. Where the dot product of neighbouring keys is negative, the rotation between them is
   more than 180°.
   */
  TUMBLE_KEY_SIGNS_AS_AUTHORED = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum TumbleKeySigns TumbleKeySigns;
#else
typedef uint32_t TumbleKeySigns;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 The speed on the curve of a track.
 */
enum TumbleSpeed
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   According to the key times.
   */
  TUMBLE_SPEED_AS_KEYED = 0,
  /*
   The same angular speed from the first key to the last. The path is the same, but inner keys are reached at
   other times.
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
 The motion before the first key of a track, or after the last.
 */
enum TumbleWrap
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   The value of the first or the last key stays.
   */
  TUMBLE_WRAP_HOLD = 0,
  /*
   The track repeats.
   */
  TUMBLE_WRAP_LOOP = 1,
  /*
   The track runs backwards, then forwards again, and so on. Quantities other than the rotation are refused.
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
 The boundary condition: the curve in the first and in the last interval, where a neighbouring key is missing.
 */
enum TumbleEnds
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   The default of the method.
   */
  TUMBLE_ENDS_OF_METHOD = 0,
  /*
   The parabola through the last three keys at each end.
   */
  TUMBLE_ENDS_PARABOLIC = 1,
  /*
   The angular acceleration is 0 at the ends.
   */
  TUMBLE_ENDS_NATURAL = 2,
  /*
   The angular velocities at the ends are `start_velocity` and `end_velocity`.
   */
  TUMBLE_ENDS_CLAMPED = 3,
  /*
   The angular velocity at an end is that of slerp between the last two keys there.
   */
  TUMBLE_ENDS_SECANT = 4,
  /*
   The curve is closed and smooth there. The last key must equal the first, within 0.002 rad.
   */
  TUMBLE_ENDS_LOOP = 5,
  /*
   The first and the last interval are constant: each has the value of its first key.
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
 The quantity that is evaluated: four numbers for each sample.
 */
enum TumbleQuantity
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   The rotation relative to the parent, a unit quaternion `x y z w`.
   */
  TUMBLE_QUANTITY_ROTATION = 0,
  /*
   The angular velocity in the axes of the rotating body in rad/s: `x y z 0`.
   */
  TUMBLE_QUANTITY_VELOCITY_IN_BODY = 1,
  /*
   The angular velocity in the axes of the parent in rad/s: `x y z 0`.
   */
  TUMBLE_QUANTITY_VELOCITY_IN_PARENT = 2,
  /*
   The angular acceleration in the axes of the rotating body in rad/s²: `x y z 0`.
   */
  TUMBLE_QUANTITY_ACCELERATION_IN_BODY = 3,
  /*
   The angular acceleration in the axes of the parent in rad/s²: `x y z 0`.
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
 The quantity evaluated of scalars.
 */
enum TumbleScalarQuantity
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   The number itself.
   */
  TUMBLE_SCALAR_QUANTITY_VALUE = 0,
  /*
   Its derivative, per second: that of the curve, not a difference of samples.
   */
  TUMBLE_SCALAR_QUANTITY_VELOCITY = 1,
  /*
   Its second derivative, per second squared.
   */
  TUMBLE_SCALAR_QUANTITY_ACCELERATION = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum TumbleScalarQuantity TumbleScalarQuantity;
#else
typedef uint32_t TumbleScalarQuantity;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 How sample times are specified.
 */
enum TumbleSampling
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   Frames at a rate, from the first key time of the set to the last (`tumble_set_time_span`).
   */
  TUMBLE_SAMPLING_KEYS = 0,
  /*
   Frames at a rate, from `start` to `end`.
   */
  TUMBLE_SAMPLING_RANGE = 1,
  /*
   A list of times in any order, the same for every track.
   */
  TUMBLE_SAMPLING_TIMES = 2,
  /*
   A list of times for each track, in the order `[track][sample]`, with the same number of times for every track.
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
 Commands of an application that use the memory of a result.
 */
enum TumbleCommandUsers
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   All commands.
   */
  TUMBLE_COMMAND_USERS_ANY = 0,
  /*
   Compute shaders.
   */
  TUMBLE_COMMAND_USERS_KERNELS = 1,
  /*
   Copies, fills and updates of buffers.
   */
  TUMBLE_COMMAND_USERS_COPIES = 2,
  /*
   Compute shaders, copies, fills and updates.
   */
  TUMBLE_COMMAND_USERS_KERNELS_AND_COPIES = 3,
  /*
   The host.
   */
  TUMBLE_COMMAND_USERS_HOST = 4,
  /*
   Vertex shaders, and vertex buffers: the queue must support graphics.
   */
  TUMBLE_COMMAND_USERS_VERTEX_SHADERS = 5,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum TumbleCommandUsers TumbleCommandUsers;
#else
typedef uint32_t TumbleCommandUsers;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 Matrices of a crowd in a buffer that become those of a later stage, in place. The application may have changed
 them before.
 */
enum TumbleCrowdStage
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   `TUMBLE_CROWD_VALUES_LOCAL` become `TUMBLE_CROWD_VALUES_MODEL`.
   */
  TUMBLE_CROWD_STAGE_LOCAL_TO_MODEL = 0,
  /*
   `TUMBLE_CROWD_VALUES_MODEL` become `TUMBLE_CROWD_VALUES_SKINNING`.
   */
  TUMBLE_CROWD_STAGE_MODEL_TO_SKINNING = 1,
  /*
   `TUMBLE_CROWD_VALUES_LOCAL` become `TUMBLE_CROWD_VALUES_SKINNING`.
   */
  TUMBLE_CROWD_STAGE_LOCAL_TO_SKINNING = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum TumbleCrowdStage TumbleCrowdStage;
#else
typedef uint32_t TumbleCrowdStage;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 The values that are stored for every joint of every visible instance, in the order `[instance][joint]`.
 */
enum TumbleCrowdValues
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   The rotation in the parent's frame: four numbers `x y z w`.
   */
  TUMBLE_CROWD_VALUES_ROTATIONS = 0,
  /*
   The transform in the parent's frame: a matrix of twelve numbers, three rows of four, for column vectors. The
   last column is the translation.
   */
  TUMBLE_CROWD_VALUES_LOCAL = 1,
  /*
   The transform in the model's frame, as a matrix of the same form.
   */
  TUMBLE_CROWD_VALUES_MODEL = 2,
  /*
   The transform in the model's frame times the inverse bind matrix, as a matrix of the same form, for skinning
   of vertices.
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
 The order of matrix elements in memory.
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
 The operation of a pass. Each has the bits of the same operation on the CPU.
 */
enum TumblePassOperation
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   The weighted sum of layers, normalized. Inputs: one or more layers, with a weight for each, finite and within
   ±1e9.
   */
  TUMBLE_PASS_OPERATION_BLEND = 0,
  /*
   Slerp between two inputs, with one weight, 0 to 1: at 0 the result is the first input.
   */
  TUMBLE_PASS_OPERATION_MIX = 1,
  /*
   The first input, and the weighted difference of the second from `reference`, with one weight, 0 to 1.
   */
  TUMBLE_PASS_OPERATION_ADD = 2,
  /*
   Rotations and positions in the world, of the skeleton `parents` and `offsets`. The one input is the rotations in
   the parents' frames. No weight; the layout must be `TUMBLE_LAYOUT_FRAME_MAJOR`.
   */
  TUMBLE_PASS_OPERATION_WORLD = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum TumblePassOperation TumblePassOperation;
#else
typedef uint32_t TumblePassOperation;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 A clip: a set that was prepared for one interpolation and uploaded to an engine's device. Any number of threads
 may use it at the same time.
 */
typedef struct TumbleClip TumbleClip;

/*
 A clip target: a request of a clip, prepared for recording into command buffers, and the range of the
 application's buffer that receives its result. Any number of threads may use it at the same time.
 */
typedef struct TumbleClipTarget TumbleClipTarget;

/*
 A crowd: many instances of a library's skeleton, each of which plays clips at its time and speed. Calls of several
 threads on the same crowd run one after another.
 */
typedef struct TumbleCrowd TumbleCrowd;

/*
 A library: the clips, masks and inverse bind matrices of one skeleton, prepared for crowds. Any number of threads
 may use it at the same time.
 */
typedef struct TumbleCrowdLibrary TumbleCrowdLibrary;

/*
 A crowd target: everything that is needed to record evaluations of a crowd, or a stage of them, and the range of the
 application's buffer that receives their results.
 */
typedef struct TumbleCrowdTarget TumbleCrowdTarget;

/*
 An engine: an open device, the CPU or a Vulkan device, that evaluates. Any number of threads may use it at the
 same time.
 */
typedef struct TumbleEngine TumbleEngine;

/*
 A motion file that was read: its clips, and messages about it. Any number of threads may use it at the same time.
 */
typedef struct TumbleFile TumbleFile;

/*
 A pass target: a pass, prepared for recording into command buffers, and the range of the application's buffer that
 receives its result.
 */
typedef struct TumblePassTarget TumblePassTarget;

/*
 A sampler: it evaluates a clip at one time after another, on the calling thread, for programs that need a pose now.
 Sampling is fastest if most times are near the time before. Threads that share a sampler wait for each other; give
 each thread its own (`tumble_sampler_copy`).
 */
typedef struct TumbleSampler TumbleSampler;

/*
 A set: tracks of rotation keys that are evaluated together, each with optional translations and scales. Any number
 of threads may use it at the same time.
 */
typedef struct TumbleSet TumbleSet;

/*
 A timed target: everything that is needed to record samples of a clip at other times in each frame, and the range of
 the application's buffer that receives them.
 */
typedef struct TumbleTimedTarget TumbleTimedTarget;

/*
 Options for opening a device. If all members except `size` are 0, they have their defaults.
 */
typedef struct TumbleEngineOptions {
  /*
   `sizeof(TumbleEngineOptions)`.
   */
  size_t size;
  /*
   The limit of memory in bytes: on a Vulkan device for everything except results, on the CPU for the segments of a
   set. Larger sets are prepared piece by piece. 0: no limit.
   */
  uint64_t memory;
  /*
   The number of worker threads of the CPU, up to 1024; ignored on a Vulkan device. 0: all engines share a pool
   with one thread for each core, or as many as the environment variable `RAYON_NUM_THREADS` says.
   */
  uint32_t threads;
  /*
   1: a Vulkan device is used although it fails the self-test; its bits may differ from the CPU's. 0: it is
   refused.
   */
  uint32_t allow_inexact;
  /*
   The directory in which the library keeps what the driver compiled, which kernels are exact, and how fast a
   device is; it is created when something is written. The library reads and writes no other files on its own.
   Null: the directory that the environment variable `TUMBLE_CACHE_DIR` names, or `tumble` in the user's cache
   directory. An empty text: no file is read or written.
   */
  const char *cache_directory;
} TumbleEngineOptions;

/*
 The sample times of an evaluation. Members that `sampling` does not use are ignored.
 */
typedef struct TumbleSamples {
  /*
   `sizeof(TumbleSamples)`.
   */
  size_t size;
  /*
   A `TumbleSampling`: which of the members below are used.
   */
  uint32_t sampling;
  /*
   The numerator of the frame rate: there are `rate_frames` frames in `rate_seconds` seconds, such as 60 in 1, or
   30000 in 1001.
   */
  uint64_t rate_frames;
  /*
   The denominator of the frame rate: a number of seconds; 0 means 1.
   */
  uint64_t rate_seconds;
  /*
   The time of the first frame in seconds, for `TUMBLE_SAMPLING_RANGE`.
   */
  double start;
  /*
   The time in seconds after which there are no frames, for `TUMBLE_SAMPLING_RANGE`; not before `start`.
   */
  double end;
  /*
   The sample times in seconds, for `TUMBLE_SAMPLING_TIMES` and `TUMBLE_SAMPLING_TIMES_OF_TRACKS`. They are copied
   during the call.
   */
  const double *times;
  /*
   The number of `times`, for all tracks together.
   */
  size_t time_count;
} TumbleSamples;

/*
 A method with its options. If all members except `size` are 0, they have their defaults.
 */
typedef struct TumbleInterpolation {
  /*
   `sizeof(TumbleInterpolation)`.
   */
  size_t size;
  /*
   The name of the method, such as "slerp", from `tumble_method_name`; null: "bessel-overhauser".
   */
  const char *method;
  /*
   A `TumbleKeySigns`.
   */
  uint32_t signs;
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
   The motion before the first key: a `TumbleWrap`.
   */
  uint32_t before;
  /*
   The motion after the last key: a `TumbleWrap`.
   */
  uint32_t after;
  /*
   The angular velocity at the first key of every track for `TUMBLE_ENDS_CLAMPED`: `x y z` in the body's axes,
   rad/s.
   */
  double start_velocity[3];
  /*
   The angular velocity at the last key of every track, likewise.
   */
  double end_velocity[3];
  /*
   The tension of "kochanek-bartels"; 0 is neutral, usual values are from -1 to 1. With 1 the velocity at a key
   is 0, with -1 it is doubled.
   */
  double tension;
  /*
   The continuity of "kochanek-bartels", likewise. With -1 the curve has a corner at a key; with 1 the corner
   points the other way, because the curve overshoots on both sides of the key.
   */
  double continuity;
  /*
   The bias of "kochanek-bartels", likewise. With 1 the tangent at a key follows the interval before it, with -1
   the interval after it.
   */
  double bias;
} TumbleInterpolation;

/*
 A request: which tracks and samples of a clip are evaluated, and their layout and encoding. If all members except
 `size` and `samples` are 0, it selects all tracks and samples, track by track, as `x y z w` in f32.
 */
typedef struct TumbleRequest {
  /*
   `sizeof(TumbleRequest)`.
   */
  size_t size;
  /*
   The sample times, not null.
   */
  const struct TumbleSamples *samples;
  /*
   A `TumbleLayout`.
   */
  uint32_t layout;
  /*
   A `TumbleMatrixOrder`, for the encodings "matrix" and "matrix-3x4".
   */
  uint32_t matrix_order;
  /*
   The name of the encoding of each value, such as "f16" or "matrix-3x4", from `tumble_encoding_name`; null:
   "f32". Angles are in degrees.
   */
  const char *encoding;
  /*
   The axes of the encoding "euler": uppercase, such as "ZXY", for axes that rotate with the body (intrinsic);
   lowercase, such as "zxy", for fixed axes (extrinsic). Null: "XYZ".
   */
  const char *sequence;
  /*
   The index of the first track, from 0.
   */
  size_t first_track;
  /*
   The number of tracks; 0: all from `first_track` on.
   */
  size_t track_count;
  /*
   The index of the first sample, from 0.
   */
  size_t first_sample;
  /*
   The number of samples of each track; 0: all from `first_sample` on.
   */
  size_t sample_count;
} TumbleRequest;

/*
 A range of a Vulkan buffer.
 */
typedef struct TumbleBufferRange {
  /*
   The `VkBuffer`, as a number: `(uint64_t)buffer`.
   */
  uint64_t buffer;
  /*
   The start of the range in bytes.
   */
  uint64_t offset;
  /*
   The length of the range in bytes.
   */
  uint64_t size;
} TumbleBufferRange;

/*
 A pass over rotations in buffers of an application's Vulkan device. Each input has four f32 `x y z w` for each
 sample of each track, as `tumble_clip_evaluate_to_buffer` and `tumble_clip_record` write them.
 */
typedef struct TumblePass {
  /*
   `sizeof(TumblePass)`.
   */
  size_t size;
  /*
   A `TumblePassOperation`.
   */
  uint32_t operation;
  /*
   A `TumbleLayout`, of every input and of the result.
   */
  uint32_t layout;
  /*
   The number of tracks of every input.
   */
  size_t track_count;
  /*
   The number of samples of each track.
   */
  size_t sample_count;
  /*
   The inputs, as the operation says. Each range has at least 16 × `track_count` × `sample_count` bytes. For
   `TUMBLE_PASS_OPERATION_BLEND`, each range must start at a multiple of 16; for other operations, at a multiple of
   256. Layers of a blend that follow each other in one buffer, the first at a multiple of 256, are read directly;
   others are first copied into one buffer.
   */
  const struct TumbleBufferRange *inputs;
  /*
   The number of `inputs`.
   */
  size_t input_count;
  /*
   The weights, as the operation says.
   */
  const float *weights;
  /*
   The number of `weights`.
   */
  size_t weight_count;
  /*
   For `TUMBLE_PASS_OPERATION_ADD`: a rotation `x y z w` for each track.
   */
  const float *reference;
  /*
   For `TUMBLE_PASS_OPERATION_WORLD`: the index of each joint's parent, -1 for a root, with a joint for each track.
   */
  const int32_t *parents;
  /*
   For `TUMBLE_PASS_OPERATION_WORLD`: the position `x y z` of each joint in its parent's frame; null: all are 0.
   */
  const float *offsets;
} TumblePass;

/*
 An application's Vulkan instance, device and queue, for `tumble_engine_from_vulkan`. The library does not destroy
 them.

 No features of the device are required, but software devices are faster with `shaderInt64`. Below Vulkan 1.2,
 enable `VK_KHR_shader_float_controls` if the device has it.
 */
typedef struct TumbleVulkan {
  /*
   `sizeof(TumbleVulkan)`.
   */
  size_t size;
  /*
   `vkGetInstanceProcAddr` of the loader that created the instance, cast to `void (*)(void)`. The loader must
   stay loaded until the engine and all objects that were made with it are freed.
   */
  void (*get_instance_proc_addr)(void);
  /*
   The `VkInstance`, of Vulkan 1.1 or newer.
   */
  void *instance;
  /*
   The `VkPhysicalDevice` of `device`.
   */
  void *physical_device;
  /*
   The `VkDevice`.
   */
  void *device;
  /*
   A `VkQueue` of the device, of a family that can compute.
   */
  void *queue;
  /*
   The family of `queue`.
   */
  uint32_t queue_family;
  /*
   The Vulkan version for which the instance was created, `VkApplicationInfo.apiVersion`: 1.1 or newer. If
   it is newer than the loader's, the loader's counts.
   */
  uint32_t api_version;
  /*
   1 if `VK_KHR_shader_float_controls` is enabled, otherwise 0; ignored from Vulkan 1.2 on.
   */
  uint32_t shader_float_controls;
  /*
   1 if the feature `shaderInt64` is enabled, otherwise 0.
   */
  uint32_t shader_int64;
  /*
   Another `VkQueue` of the device, on which results are copied to the host while `queue` computes, or null. The
   device must then have the feature `timelineSemaphore` enabled, and only the library may use this queue.
   */
  void *copy_queue;
  /*
   The family of `copy_queue`; ignored if that is null.
   */
  uint32_t copy_queue_family;
  /*
   A function that locks `queue`, or null. The library calls this function with `queue_user` before each submission
   to `queue`, on any thread, and `unlock_queue` after the submission. The application must use the same lock for
   `queue`, and must not hold the lock when it calls the library, which would wait forever. If `lock_queue` is
   null, `unlock_queue` must be null too, and the application must not use `queue` during a call that submits to
   it. Several engines on one queue need no lock among themselves.
   */
  void (*lock_queue)(void *user);
  /*
   The function that unlocks `queue`; the library calls it on the thread that called `lock_queue`.
   */
  void (*unlock_queue)(void *user);
  /*
   The argument of `lock_queue` and `unlock_queue`. It must stay valid until the engine and all objects that were
   made with it are freed.
   */
  void *queue_user;
  /*
   The application's `VkPipelineCache`, in which the library makes its pipelines, or 0 (`VK_NULL_HANDLE`). It must
   have been created without `VK_PIPELINE_CACHE_CREATE_EXTERNALLY_SYNCHRONIZED_BIT`, and must stay valid until the
   engine and all objects that were made with it are freed. The library neither reads this cache from a file nor writes it to one. 0: the library makes a cache and
   keeps it in a file (`TumbleEngineOptions.cache_directory`).
   */
  uint64_t pipeline_cache;
} TumbleVulkan;

/*
 The clip that a layer of an instance plays, and its time, speed, wrap mode and weight. If all members except
 `size`, `instance` and `layer` are 0, the layer stands still at the start of the first clip, with weight 0.
 */
typedef struct TumbleCrowdLayer {
  /*
   `sizeof(TumbleCrowdLayer)`.
   */
  size_t size;
  /*
   The index of the instance, from 0.
   */
  size_t instance;
  /*
   The index of the layer in the instance, from 0. Each layer is blended over the layers with lower indices.
   */
  size_t layer;
  /*
   The index of the clip in the library, from 0.
   */
  size_t clip;
  /*
   The layer's current time in ticks of the clip. Outside the clip `wrap` applies.
   */
  int64_t time;
  /*
   The speed: ticks of the clip for each tick of the clock. 1: as keyed, 0: the layer stands still, negative:
   backwards. Its magnitude is below 128; it is rounded to a multiple of 2^-16.
   */
  float speed;
  /*
   The weight with which the layer is blended over the layers below, 0 to 1, rounded to a multiple of 2^-15. The
   weight of layer 0 is ignored.
   */
  float weight;
  /*
   The motion outside the clip: a `TumbleWrap`, but not `TUMBLE_WRAP_EXTRAPOLATE`.
   */
  uint32_t wrap;
  /*
   1: the clip's difference from its reference pose is added to the layers below. 0: the layers below are
   interpolated towards the clip.
   */
  uint32_t additive;
  /*
   The number of a mask, from `tumble_crowd_library_push_mask`; 0: all joints take part.
   */
  size_t mask;
} TumbleCrowdLayer;

/*
 A fade: a layer's weight that changes linearly with the clock. The weight is `from` until the tick `start`,
 reaches `to` after `ticks` ticks, and then stays.
 */
typedef struct TumbleCrowdFade {
  /*
   `sizeof(TumbleCrowdFade)`.
   */
  size_t size;
  /*
   The index of the instance, from 0.
   */
  size_t instance;
  /*
   The index of the layer in the instance, from 1: layer 0 has no weight.
   */
  size_t layer;
  /*
   The clock's time in ticks at which the fade starts; in the past or in the future.
   */
  uint64_t start;
  /*
   The duration of the fade in ticks; with 0 the weight changes at once.
   */
  uint64_t ticks;
  /*
   The weight before the fade, 0 to 1, rounded to a multiple of 2^-15.
   */
  float from;
  /*
   The weight after the fade, 0 to 1, rounded to a multiple of 2^-15.
   */
  float to;
} TumbleCrowdFade;

/*
 An event that a layer of an instance passed. This structure has no `size`, because calls write arrays of it; it will
 not change.
 */
typedef struct TumblePassedEvent {
  /*
   The clock's time in ticks at which the layer reached the event.
   */
  uint64_t clock;
  /*
   The index of the instance, from 0.
   */
  size_t instance;
  /*
   The index of the layer in the instance, from 0.
   */
  size_t layer;
  /*
   The event's index in the library, from 0.
   */
  size_t event;
  /*
   The weight of the layer now, 0 to 1.
   */
  float weight;
} TumblePassedEvent;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/*
 Returns the version of the library as one number: 1 000 000 × major + 1 000 × minor + patch. It equals
 `TUMBLE_VERSION` if the library belongs to this header.
 */
uint32_t tumble_version(void);

/*
 Returns the message of the last failed call of this thread: UTF-8, never null, empty if no call has failed.

 The text belongs to the library. It stays valid until another call of this thread fails, or the thread ends;
 successful calls do not change it.
 */
const char *tumble_last_error(void);

/*
 Opens a device and creates an engine on it.

 `device` selects the device by a name in upper or lower case:

 - "auto", or null: the CPU or the exact Vulkan device that is measured to be the fastest for large results;
   the choice is made once, here;
 - "cpu": the CPU;
 - "vulkan": the first Vulkan device that can be opened and passes the self-test;
 - any other text: the Vulkan device with this index, counted from 0, or the first one whose name contains the
   text.

 All devices give the same bits. `options` may be null for the defaults. The caller frees the engine with
 `tumble_engine_free`.

 # Errors
 - `TUMBLE_RESULT_DEVICE` if there is no such device, it cannot be opened, or it fails the self-test.
 - `TUMBLE_RESULT_INVALID_ARGUMENT` if an option is out of its range.

 # Safety
 `device` must be null or a text that ends with a zero byte, `options` must be null or point to a
 `TumbleEngineOptions`, and `engine` must point to memory for a handle.
 */
TumbleResult tumble_engine_open(const char *device,
                                const struct TumbleEngineOptions *options,
                                struct TumbleEngine **engine);

/*
 Returns the name of the engine's device, "CPU" for the CPU: UTF-8, valid until the engine is freed; null if the
 handle is invalid.
 */
const char *tumble_engine_device_name(const struct TumbleEngine *engine);

/*
 Frees an engine. Its clips and crowds stay valid and keep the device open. Does nothing if `engine` is null.
 */
TumbleResult tumble_engine_free(struct TumbleEngine *engine);

/*
 Creates a set without tracks. The caller frees it with `tumble_set_free`.

 # Safety
 `set` must point to memory for a handle.
 */
TumbleResult tumble_set_new(struct TumbleSet **set);

/*
 Appends a track of `key_count` rotation keys, at least one, to a set.

 `times` are the key times in seconds, strictly increasing. `keys` are unit quaternions, `x y z w`, one for each
 time. Keys whose norm is 1 within f32 rounding keep their bits; others, whose norm is within 0.1 of 1, are
 normalised. `name` is the track's name in UTF-8, or null for none. Arrays and name are copied. Pointers that
 `tumble_set_track` returned for this set become invalid.

 # Errors
 `TUMBLE_RESULT_INVALID_INPUT` if there are no keys, the times are not finite and strictly increasing, or a key's
 norm is not within 0.1 of 1. After any error the set is unchanged.

 # Safety
 `name` must be null or a text that ends with a zero byte; `times` must have `key_count` numbers, and `keys`
 4 × `key_count`.
 */
TumbleResult tumble_set_push(struct TumbleSet *set,
                             const char *name,
                             const double *times,
                             const float *keys,
                             size_t key_count);

/*
 Creates a set of `track_count` tracks without names, which all have the same `key_count` key times.

 `times` are the key times in seconds. `keys` are unit quaternions in the order `[track][key]`, four numbers
 `x y z w` each. The conditions and errors are those of `tumble_set_push`. The arrays are copied. The caller frees
 the set with `tumble_set_free`.

 # Safety
 `times` must have `key_count` numbers and `keys` 4 × `key_count` × `track_count`; `set` must point to memory for a
 handle.
 */
TumbleResult tumble_set_with_shared_times(const double *times,
                                          size_t key_count,
                                          const float *keys,
                                          size_t track_count,
                                          struct TumbleSet **set);

/*
 Returns the number of tracks; 0 if the handle is invalid.
 */
size_t tumble_set_track_count(const struct TumbleSet *set);

/*
 Returns the number of rotation keys of all tracks together; 0 if the handle is invalid.
 */
size_t tumble_set_key_count(const struct TumbleSet *set);

/*
 Returns pointers to the key times and the rotation keys of the track `index`, counted from 0.

 `times` receives a pointer to `key_count` numbers in seconds, and `keys` a pointer to 4 × `key_count` numbers, `x y
 z w` for each key. The arrays belong to the set and stay valid until a track is pushed to the set, or the set is
 freed.

 # Errors
 `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such track.

 # Safety
 `times` and `keys` must each point to memory for a pointer, and `key_count` to memory for a number.
 */
TumbleResult tumble_set_track(const struct TumbleSet *set,
                              size_t index,
                              const double **times,
                              const float **keys,
                              size_t *key_count);

/*
 Copies the name of the track `index`, counted from 0, into `buffer`: UTF-8, followed by a zero byte. Tracks
 without a name are called `box1`, `box2` … in the order of the tracks.

 `size` is the size of `buffer` in bytes. `length` receives the length of the name in bytes, without the zero byte.
 If `buffer` is null, only `length` is written.

 # Errors
 - `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such track.
 - `TUMBLE_RESULT_WRONG_SIZE` if `buffer` is not null and `size` is less than the length + 1: then `length` is
   written, and `buffer` is not.

 # Safety
 `buffer` must be null or have `size` bytes, and `length` must point to memory for a number.
 */
TumbleResult tumble_set_track_name(const struct TumbleSet *set,
                                   size_t index,
                                   char *buffer,
                                   size_t size,
                                   size_t *length);

/*
 Returns the first and the last key time of all tracks in seconds; key times of translations and scales count too.

 # Errors
 `TUMBLE_RESULT_OUT_OF_RANGE` if the set has no tracks.

 # Safety
 `first` and `last` must each point to memory for a number.
 */
TumbleResult tumble_set_time_span(const struct TumbleSet *set,
                                  double *first,
                                  double *last);

/*
 Frees a set. Clips that were made from it stay valid. Does nothing if `set` is null.
 */
TumbleResult tumble_set_free(struct TumbleSet *set);

/*
 Reads a motion file: glTF and GLB, BVH, FBX, NPZ and NPY, pickles, Parquet, Arrow, CSV, JSON of robots, TUM, `EuRoC`,
 KITTI, MCAP or `.dat`.

 The format is recognised by the first bytes of the file, otherwise by the extension of its name. `path` is UTF-8;
 on Unix it may have any bytes. If some clips of the file are invalid, the others are read, and the messages of the
 file say why (`tumble_file_message`). The caller frees the file with `tumble_file_free`.

 # Errors
 `TUMBLE_RESULT_INVALID_INPUT` if the file cannot be read; the message says why and where.

 # Safety
 `path` must be a text that ends with a zero byte, and `file` must point to memory for a handle.
 */
TumbleResult tumble_file_load(const char *path,
                              struct TumbleFile **file);

/*
 Returns the number of clips that could be read; 0 if the handle is invalid. Other functions take the index of a
 clip among these, counted from 0.
 */
size_t tumble_file_clip_count(const struct TumbleFile *file);

/*
 Returns the name of a clip, empty if it has none: UTF-8, valid until the file is freed; null if there is no such
 clip.
 */
const char *tumble_file_clip_name(const struct TumbleFile *file,
                                  size_t clip);

/*
 Creates a set with the rotations, translations and scales of all tracks of a clip. The set is a copy: it does not
 need the file, and the caller frees it with `tumble_set_free`.

 # Errors
 `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such clip.

 # Safety
 `set` must point to memory for a handle.
 */
TumbleResult tumble_file_clip_set(const struct TumbleFile *file,
                                  size_t clip,
                                  struct TumbleSet **set);

/*
 Returns the name of the method by which the file interpolates the rotations of a track, for
 `TumbleInterpolation.method`: UTF-8, valid until the file is freed; null if there is no such clip or track.

 For LINEAR in glTF it is "slerp". A track for which the file names no method has the most frequent method of the
 clip's other tracks, or "bessel-overhauser" if the file names none at all.
 */
const char *tumble_file_track_method(const struct TumbleFile *file,
                                     size_t clip,
                                     size_t track);

/*
 Returns the whole number of seconds that was subtracted from all times of a clip, usually 0. Add it to the set's
 times to get those of the file. It is not 0 if, for example, the file's times count from 1970: f64 is not accurate
 enough for these.

 # Errors
 `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such clip.

 # Safety
 `seconds` must point to memory for a number.
 */
TumbleResult tumble_file_clip_time_offset(const struct TumbleFile *file,
                                          size_t clip,
                                          int64_t *seconds);

/*
 Returns the position `x y z` that was subtracted from the translations of a track of a clip, usually 0 0 0. It is
 not 0 for large coordinates, such as those of maps, for which f32 is not accurate enough. Add it, in doubles, to
 translations that are evaluated.

 # Errors
 `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such clip or track.

 # Safety
 `origin` must point to memory for three numbers.
 */
TumbleResult tumble_file_clip_origin(const struct TumbleFile *file,
                                     size_t clip,
                                     size_t track,
                                     double *origin);

/*
 Returns the number of messages about the file: first why clips could not be read, then warnings. It is 0 if the
 handle is invalid.
 */
size_t tumble_file_message_count(const struct TumbleFile *file);

/*
 Returns the message `index`, counted from 0: UTF-8, valid until the file is freed; null if there is no such
 message.
 */
const char *tumble_file_message(const struct TumbleFile *file,
                                size_t index);

/*
 Frees a file. Sets and libraries that were made from it stay valid. Does nothing if `file` is null.
 */
TumbleResult tumble_file_free(struct TumbleFile *file);

/*
 Returns the number of methods.
 */
size_t tumble_method_count(void);

/*
 Returns the name of the method `index`, counted from 0: a text that is never freed; null, without an error
 message, if there is no such method.
 */
const char *tumble_method_name(size_t index);

/*
 Returns the number of samples of each track of a set. A result has 4 × tracks × samples floats.

 # Errors
 `TUMBLE_RESULT_INVALID_INPUT` if the sample times are invalid or do not fit the set.

 # Safety
 `samples` must point to a `TumbleSamples` whose `times` has `time_count` numbers, and `count` must point to memory
 for a number.
 */
TumbleResult tumble_set_sample_count(const struct TumbleSet *set,
                                     const struct TumbleSamples *samples,
                                     size_t *count);

/*
 Prepares and evaluates a set in one call, into the caller's memory, and waits for the result.

 `interpolation` may be null for the defaults. `layout` is a `TumbleLayout`. `output` receives four floats for each
 sample of each track, according to the quantity of the interpolation. `output_count` is the number of floats,
 exactly 4 × tracks × samples (`tumble_set_sample_count`). Memory that is aligned to 16 bytes is filled without a
 copy.

 # Errors
 - `TUMBLE_RESULT_WRONG_SIZE` if `output_count` is another number.
 - `TUMBLE_RESULT_INVALID_INPUT` if the sample times are invalid, or a track cannot be interpolated as requested.
 - `TUMBLE_RESULT_DEVICE` if the device fails.

 All arguments are checked before anything is written.

 # Safety
 `interpolation` must be null or point to a `TumbleInterpolation` whose `method` is null or a text that ends with a
 zero byte; `samples` must point to a `TumbleSamples` whose `times` has `time_count` numbers; and `output` must
 have `output_count` floats, which nothing else uses during the call.
 */
TumbleResult tumble_evaluate(const struct TumbleEngine *engine,
                             const struct TumbleSet *set,
                             const struct TumbleInterpolation *interpolation,
                             const struct TumbleSamples *samples,
                             uint32_t layout,
                             float *output,
                             size_t output_count);

/*
 Prepares a set for an interpolation and uploads it to the engine's device as a clip, for repeated evaluation.

 `interpolation` may be null for the defaults. The clip is independent of the set, and the engine may be freed
 before it. The caller frees the clip with `tumble_clip_free`.

 # Errors
 - `TUMBLE_RESULT_INVALID_INPUT` if a track cannot be interpolated as requested.
 - `TUMBLE_RESULT_OUT_OF_MEMORY` or `TUMBLE_RESULT_DEVICE` if the device lacks memory or fails.

 # Safety
 `interpolation` must be null or point to a `TumbleInterpolation` whose `method` is null or a text that ends with a
 zero byte, and `clip` must point to memory for a handle.
 */
TumbleResult tumble_upload(const struct TumbleEngine *engine,
                           const struct TumbleSet *set,
                           const struct TumbleInterpolation *interpolation,
                           struct TumbleClip **clip);

/*
 Returns the memory that a clip takes on the host for each key, in bytes: 16 or more if the clip keeps its keys; if
 the clip keeps segments, at least 64 for arcs (slerp), at least 144 for polynomials. On the CPU, a clip
 whose segments would exceed the limit `memory` of `TumbleEngineOptions` keeps its keys instead, if samples can be
 computed from them.

 # Safety
 `bytes` must point to memory for a number.
 */
TumbleResult tumble_clip_bytes_per_key(const struct TumbleClip *clip,
                                       double *bytes);

/*
 Returns the number of samples of each track of a clip. A result of `tumble_clip_evaluate` has 4 × tracks × samples
 floats.

 # Errors
 `TUMBLE_RESULT_INVALID_INPUT` if the sample times are invalid or do not fit the clip.

 # Safety
 `samples` must point to a `TumbleSamples` whose `times` has `time_count` numbers, and `count` must point to memory
 for a number.
 */
TumbleResult tumble_clip_sample_count(const struct TumbleClip *clip,
                                      const struct TumbleSamples *samples,
                                      size_t *count);

/*
 Evaluates a clip into the caller's memory, and waits for the result. The arguments, the result and the errors are
 those of `tumble_evaluate`; the number of samples is that of `tumble_clip_sample_count`.

 # Safety
 As `tumble_evaluate`.
 */
TumbleResult tumble_clip_evaluate(const struct TumbleClip *clip,
                                  const struct TumbleSamples *samples,
                                  uint32_t layout,
                                  float *output,
                                  size_t output_count);

/*
 Evaluates a clip into a range of the application's Vulkan buffer: four floats for each sample of each track.

 The clip's engine must have been created by `tumble_engine_from_vulkan`. `layout` is a `TumbleLayout`. `buffer` is
 the `VkBuffer`, as a number: `(uint64_t)buffer`. The range starts at `offset`, a multiple of 16, and has `size`
 bytes, at least 16 × tracks × samples. The buffer must belong to the engine's device, be bound to memory, and have
 the usages `VK_BUFFER_USAGE_STORAGE_BUFFER_BIT` and `VK_BUFFER_USAGE_TRANSFER_DST_BIT`.

 The call submits to the engine's queue (`tumble_engine_from_vulkan` says who may use the queue meanwhile) and
 returns when the result is written. Commands that are submitted to the queue afterwards see it.

 # Errors
 - `TUMBLE_RESULT_INVALID_ARGUMENT` if the engine was not created by `tumble_engine_from_vulkan`.
 - `TUMBLE_RESULT_WRONG_SIZE` if the range is not aligned or too short.
 - Otherwise as `tumble_evaluate`.

 # Safety
 `samples` must point to a `TumbleSamples` whose `times` has `time_count` numbers. The buffer must be as described,
 and nothing else may use the range during the call.
 */
TumbleResult tumble_clip_evaluate_to_buffer(const struct TumbleClip *clip,
                                            const struct TumbleSamples *samples,
                                            uint32_t layout,
                                            uint64_t buffer,
                                            uint64_t offset,
                                            uint64_t size);

/*
 Frees a clip. Targets that were made from it stay valid. Does nothing if `clip` is null.
 */
TumbleResult tumble_clip_free(struct TumbleClip *clip);

/*
 Creates a sampler of a clip. Its values have the bits that `tumble_clip_evaluate` gives at listed times.

 The clip may be freed before the sampler. The caller frees the sampler with `tumble_sampler_free`.

 # Errors
 `TUMBLE_RESULT_OUT_OF_MEMORY` if the segments of the clip exceed its engine's memory limit, and samples cannot be
 computed from its keys within the limit.

 # Safety
 `sampler` must point to memory for a handle.
 */
TumbleResult tumble_sampler_new(const struct TumbleClip *clip,
                                struct TumbleSampler **sampler);

/*
 Creates a sampler of the same clip, for another thread or another playback. The caller frees it with
 `tumble_sampler_free`.

 # Safety
 `copy` must point to memory for a handle.
 */
TumbleResult tumble_sampler_copy(const struct TumbleSampler *sampler,
                                 struct TumbleSampler **copy);

/*
 Evaluates one track at `time`, which is in seconds. `value` receives four floats, according to the quantity of the
 clip's interpolation. Nothing is allocated.

 # Errors
 - `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such track.
 - `TUMBLE_RESULT_INVALID_INPUT` if the time is not finite.

 # Safety
 `value` must have four floats, which nothing else uses during the call.
 */
TumbleResult tumble_sampler_sample(const struct TumbleSampler *sampler,
                                   size_t track,
                                   double time,
                                   float *value);

/*
 Evaluates every track at `time`, which is in seconds, into the caller's memory: four floats for each track.
 `output_count` is the number of floats. Nothing is allocated.

 # Errors
 - `TUMBLE_RESULT_WRONG_SIZE` if `output_count` is not 4 × tracks.
 - `TUMBLE_RESULT_INVALID_INPUT` if the time is not finite.

 # Safety
 `output` must have `output_count` floats, which nothing else uses during the call.
 */
TumbleResult tumble_sampler_pose(const struct TumbleSampler *sampler,
                                 double time,
                                 float *output,
                                 size_t output_count);

/*
 Evaluates some tracks at `time`, which is in seconds, into the caller's memory: four floats for each of the
 `track_count` indices in `tracks`. `output_count` is the number of floats. Nothing is allocated.

 # Errors
 - `TUMBLE_RESULT_WRONG_SIZE` if `output_count` is not 4 × `track_count`.
 - `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such track.
 - `TUMBLE_RESULT_INVALID_INPUT` if the time is not finite.

 # Safety
 `tracks` must have `track_count` numbers, and `output` must have `output_count` floats, which nothing else uses
 during the call.
 */
TumbleResult tumble_sampler_pose_of(const struct TumbleSampler *sampler,
                                    const size_t *tracks,
                                    size_t track_count,
                                    double time,
                                    float *output,
                                    size_t output_count);

/*
 Frees a sampler. Does nothing if `sampler` is null.
 */
TumbleResult tumble_sampler_free(struct TumbleSampler *sampler);

/*
 Appends a scalar to a set: a number that changes over time, such as the angle of a hinge or a weight, with
 `key_count` keys, at least one. A set may have scalars without tracks.

 `name` is the scalar's name in UTF-8. `times` are the key times in seconds, strictly increasing, and `keys` a number
 for each. `tangents` are for the method "gltf-cubic" and may be null: two numbers for each time, the incoming
 tangent and the outgoing one, in units per second. Arrays and name are copied.

 # Errors
 `TUMBLE_RESULT_INVALID_INPUT` if there are no keys, the times are not finite and strictly increasing, or a number
 is not finite or exceeds 1e30 in magnitude. After any error the set is unchanged.

 # Safety
 `name` must be a text that ends with a zero byte; `times` and `keys` must have `key_count` numbers; `tangents` must
 be null or have 2 × `key_count`.
 */
TumbleResult tumble_set_push_scalar(struct TumbleSet *set,
                                    const char *name,
                                    const double *times,
                                    const float *keys,
                                    const float *tangents,
                                    size_t key_count);

/*
 Returns the number of scalars; 0 if the handle is invalid.
 */
size_t tumble_set_scalar_count(const struct TumbleSet *set);

/*
 Evaluates the scalars of a set, or how fast they change, into the caller's memory, and waits for the result.

 `interpolation` may be null for the defaults. The method of `interpolation` determines how scalars are interpolated,
 as it does for translations (docs/methods.md): "slerp" along lines, "bessel-overhauser" with continuous velocities.
 The ends and wraps of `interpolation` apply; its quantity is ignored. `quantity` is a `TumbleScalarQuantity`,
 `layout` a `TumbleLayout`. `output` receives a float for each sample of each scalar. `output_count` is the number of
 floats, exactly scalars × samples (`tumble_set_scalar_count`, `tumble_set_sample_count`).

 # Errors
 - `TUMBLE_RESULT_WRONG_SIZE` if `output_count` is another number.
 - Otherwise as `tumble_evaluate`.

 On an error nothing is written.

 # Safety
 As `tumble_evaluate`.
 */
TumbleResult tumble_scalars_evaluate(const struct TumbleEngine *engine,
                                     const struct TumbleSet *set,
                                     const struct TumbleInterpolation *interpolation,
                                     const struct TumbleSamples *samples,
                                     uint32_t quantity,
                                     uint32_t layout,
                                     float *output,
                                     size_t output_count);

/*
 Returns the number of encodings.
 */
size_t tumble_encoding_count(void);

/*
 Returns the name of the encoding `index`, counted from 0: a text that is never freed; null, without an error
 message, if there is no such encoding.
 */
const char *tumble_encoding_name(size_t index);

/*
 Returns the size of a request's result in bytes.

 # Errors
 - `TUMBLE_RESULT_INVALID_ARGUMENT` if a constant or a name is unknown.
 - `TUMBLE_RESULT_OUT_OF_RANGE` if the clip does not have these tracks or samples.
 - `TUMBLE_RESULT_INVALID_INPUT` if the sample times are invalid, or the encoding is for rotations and the clip's
   quantity is a velocity or an acceleration.

 # Safety
 `request` must point to a `TumbleRequest` whose pointers are null or as its members say, and `bytes` must point to
 memory for a number.
 */
TumbleResult tumble_request_bytes(const struct TumbleClip *clip,
                                  const struct TumbleRequest *request,
                                  size_t *bytes);

/*
 Evaluates a request of a clip into the caller's memory, and waits for the result.

 `output` receives the values in the request's layout and encoding. `output_bytes` is its size, exactly that of
 `tumble_request_bytes`. Memory that is aligned to 16 bytes is filled without a copy.

 # Errors
 - As `tumble_request_bytes`.
 - `TUMBLE_RESULT_WRONG_SIZE` if `output_bytes` is another number.
 - `TUMBLE_RESULT_DEVICE` if the device fails.

 All arguments are checked before anything is written.

 # Safety
 `request` must point to a `TumbleRequest` whose pointers are null or as its members say, and `output` must have
 `output_bytes` bytes, which nothing else uses during the call.
 */
TumbleResult tumble_request_evaluate(const struct TumbleClip *clip,
                                     const struct TumbleRequest *request,
                                     void *output,
                                     size_t output_bytes);

/*
 Prepares the recording of a request of a clip, whose result goes to a range of the application's Vulkan buffer.

 Kernels are compiled and work lists are uploaded here, not when a frame is recorded. The clip's engine must have
 been created by `tumble_engine_from_vulkan`. This call submits to the engine's queue. `buffer` is the `VkBuffer`, as
 a number: `(uint64_t)buffer`. The range starts at `offset`, a multiple of the bytes of a value (16 for "f32"), and
 has `size` bytes, at least those of `tumble_request_bytes`. The buffer must belong to the engine's device, be bound
 to memory, and have the usages `VK_BUFFER_USAGE_STORAGE_BUFFER_BIT` and `VK_BUFFER_USAGE_TRANSFER_DST_BIT`.

 The target needs neither the clip nor the engine afterwards. The application frees the target with
 `tumble_clip_target_free` before it destroys the buffer or the device.

 # Errors
 - As `tumble_request_bytes`.
 - `TUMBLE_RESULT_INVALID_ARGUMENT` if the engine was not created by `tumble_engine_from_vulkan`.
 - `TUMBLE_RESULT_WRONG_SIZE` if the range is not aligned or too short.

 # Safety
 `request` must point to a `TumbleRequest` whose pointers are null or as its members say; the buffer must be as
 described; and `target` must point to memory for a handle.
 */
TumbleResult tumble_clip_target_new(const struct TumbleClip *clip,
                                    const struct TumbleRequest *request,
                                    uint64_t buffer,
                                    uint64_t offset,
                                    uint64_t size,
                                    struct TumbleClipTarget **target);

/*
 Records an evaluation into the application's command buffer `commands`, a `VkCommandBuffer`.

 The result starts `offset` bytes after the start of the target's range, a multiple of the bytes of a value.
 Nothing is submitted, waited for or allocated. Barriers are included: the evaluation waits for all commands that
 were recorded before it, and all commands after it see the result. The commands may be submitted any number of
 times, to any queue of the command buffer's family.

 The command buffer must belong to the engine's device and to a queue family that can compute, and must be in the
 recording state, outside a render pass.

 # Errors
 `TUMBLE_RESULT_WRONG_SIZE` if the result does not fit there or `offset` is not aligned; then nothing is recorded.

 # Safety
 The command buffer must be as described, and nothing else may use it during the call.
 */
TumbleResult tumble_clip_record(const struct TumbleClipTarget *target,
                                void *commands,
                                uint64_t offset);

/*
 Frees a clip target. Does nothing if `target` is null.

 # Safety
 All work that was recorded with the target must have ended, and none may be submitted later.
 */
TumbleResult tumble_clip_target_free(struct TumbleClipTarget *target);

/*
 Prepares a request of a clip for recording at times that are given when it is recorded: for a clip at another time
 in each frame, without a submission.

 The request's own times only say how many samples of each track are recorded: for one pose, one listed time. The
 buffer and its range are as for `tumble_clip_target_new`. The application frees the target with
 `tumble_timed_target_free` before it destroys the buffer or the device.

 # Errors
 As `tumble_clip_target_new`.

 # Safety
 As for `tumble_clip_target_new`.
 */
TumbleResult tumble_timed_target_new(const struct TumbleClip *clip,
                                     const struct TumbleRequest *request,
                                     uint64_t buffer,
                                     uint64_t offset,
                                     uint64_t size,
                                     struct TumbleTimedTarget **target);

/*
 Records an evaluation at `times`, which are in seconds, into the application's command buffer `commands`, a
 `VkCommandBuffer`. The times are those of all tracks; there must be as many as the request has samples.

 The result starts `offset` bytes after the start of the target's range, a multiple of the bytes of a value, and has
 the bits that `tumble_clip_evaluate` gives at listed times. Nothing is submitted or waited for. The commands contain
 about 28 bytes for each sample of a track. Barriers are included, as for `tumble_clip_record`. Several recordings of a
 target may be in flight on one queue. Commands that are submitted again evaluate the same times.

 # Errors
 - `TUMBLE_RESULT_WRONG_SIZE` if the result does not fit there or `offset` is not aligned.
 - `TUMBLE_RESULT_INVALID_INPUT` if there is another number of times, or a time is not finite.
 - `TUMBLE_RESULT_OUT_OF_MEMORY` if there is not enough memory.

 After any error nothing is recorded.

 # Safety
 `times` must have `time_count` numbers. The command buffer must be as for `tumble_clip_record`, and nothing else may
 use it during the call.
 */
TumbleResult tumble_timed_target_record(const struct TumbleTimedTarget *target,
                                        void *commands,
                                        uint64_t offset,
                                        const double *times,
                                        size_t time_count);

/*
 Frees a timed target. Does nothing if `target` is null.

 # Safety
 All work that was recorded with the target must have ended, and none may be submitted later.
 */
TumbleResult tumble_timed_target_free(struct TumbleTimedTarget *target);

/*
 Returns the size of a pass's result in bytes: 16 for each sample of each track, or 32 for
 `TUMBLE_PASS_OPERATION_WORLD`, whose result is a rotation `x y z w` and a position `x y z 0` each.

 # Errors
 - `TUMBLE_RESULT_INVALID_ARGUMENT` if a constant is unknown, the number of inputs or weights is not the operation's,
   or the engine was not created by `tumble_engine_from_vulkan`.
 - `TUMBLE_RESULT_INVALID_POINTER` if an array is null.
 - `TUMBLE_RESULT_INVALID_INPUT` if the skeleton is refused.

 # Safety
 `pass` must point to a `TumblePass` whose pointers are null or as its members say, and `bytes` must point to memory
 for a number.
 */
TumbleResult tumble_pass_bytes(const struct TumbleEngine *engine,
                               const struct TumblePass *pass,
                               uint64_t *bytes);

/*
 Runs a pass whose result goes to a range of a buffer, and waits for the result. Commands that are submitted to the
 engine's queue afterwards see the result; the inputs may be written by commands that were submitted there before.

 The range starts at a multiple of 256, has at least the bytes of `tumble_pass_bytes`, and does not overlap an
 input. All buffers must belong to the engine's device, be bound to memory, and have the usage
 `VK_BUFFER_USAGE_STORAGE_BUFFER_BIT`; layers of a blend that are not contiguous need
 `VK_BUFFER_USAGE_TRANSFER_SRC_BIT` too. This call submits to the engine's queue.

 # Errors
 - As `tumble_pass_bytes`.
 - `TUMBLE_RESULT_WRONG_SIZE` if a range is not aligned or too short.
 - `TUMBLE_RESULT_INVALID_ARGUMENT` if there is no layer, a weight is out of its range, the layout for a skeleton is
   track by track, or the result overlaps an input.
 - `TUMBLE_RESULT_DEVICE` if the device fails.

 # Safety
 `pass` must point to a `TumblePass` whose pointers are null or as its members say; the buffers must be as
 described, and nothing else may use the ranges during the call.
 */
TumbleResult tumble_pass_to_buffer(const struct TumbleEngine *engine,
                                   const struct TumblePass *pass,
                                   uint64_t buffer,
                                   uint64_t offset,
                                   uint64_t size);

/*
 Prepares the recording of a pass, whose result goes to a range of the application's Vulkan buffer.

 The kernel is compiled and memory is allocated here, not when a frame is recorded. If the kernel was not checked
 before, this call checks it; only then it submits to the engine's queue. The buffers must be as `tumble_pass_to_buffer`
 says. The target does not need the engine afterwards. The application frees the target with
 `tumble_pass_target_free` before it destroys a buffer or the device.

 # Errors
 As `tumble_pass_to_buffer`.

 # Safety
 `pass` must point to a `TumblePass` whose pointers are null or as its members say; the buffers must be as
 described; and `target` must point to memory for a handle.
 */
TumbleResult tumble_pass_target_new(const struct TumbleEngine *engine,
                                    const struct TumblePass *pass,
                                    uint64_t buffer,
                                    uint64_t offset,
                                    uint64_t size,
                                    struct TumblePassTarget **target);

/*
 Sets the weights of a pass target for later recordings: as many as the pass has. Commands that are already recorded
 keep theirs.

 # Errors
 `TUMBLE_RESULT_INVALID_ARGUMENT` if the number of weights is another, or a weight is out of its range; then none is
 set.

 # Safety
 `weights` must have `weight_count` numbers.
 */
TumbleResult tumble_pass_set_weights(const struct TumblePassTarget *target,
                                     const float *weights,
                                     size_t weight_count);

/*
 Records a pass into the application's command buffer `commands`, a `VkCommandBuffer`.

 Nothing is submitted, waited for or allocated. The weights stay in the commands. Barriers are included: the pass
 waits for all commands that were recorded before it, such as those of `tumble_clip_record`, and all commands after
 it see the result. The commands may be submitted any number of times; all recordings of one target must run on one
 queue.

 The command buffer must belong to the engine's device and to a queue family that can compute, and must be in the
 recording state, outside a render pass.

 # Safety
 The command buffer must be as described, and nothing else may use it during the call.
 */
TumbleResult tumble_pass_record(const struct TumblePassTarget *target,
                                void *commands);

/*
 Frees a pass target. Does nothing if `target` is null.

 # Safety
 All work that was recorded with the target must have ended, and none may be submitted later.
 */
TumbleResult tumble_pass_target_free(struct TumblePassTarget *target);

/*
 Sets the translation keys of the track `track`, counted from 0, and replaces earlier ones.

 `times` are `key_count` key times in seconds, at least one, strictly increasing; they may differ from the times of
 the rotations. `keys` are vectors `x y z`, one for each time. `tangents` are for the method "gltf-cubic" and may
 be null: six numbers for each time, the incoming tangent `x y z` and the outgoing one, in units per second. The
 arrays are copied.

 # Errors
 - `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such track.
 - `TUMBLE_RESULT_INVALID_INPUT` if the times are not finite and strictly increasing, or a number is not finite or
   exceeds 1e30 in magnitude.

 After any error the set is unchanged.

 # Safety
 `times` must have `key_count` numbers and `keys` 3 × `key_count`; `tangents` must be null or have 6 × `key_count`.
 */
TumbleResult tumble_set_translations(struct TumbleSet *set,
                                     size_t track,
                                     const double *times,
                                     const float *keys,
                                     const float *tangents,
                                     size_t key_count);

/*
 Sets the scale keys of a track: factors `x y z` along its axes. Otherwise as `tumble_set_translations`.

 # Safety
 As `tumble_set_translations`.
 */
TumbleResult tumble_set_scales(struct TumbleSet *set,
                               size_t track,
                               const double *times,
                               const float *keys,
                               const float *tangents,
                               size_t key_count);

/*
 Creates an engine on an application's Vulkan device. It evaluates as any other engine, and can record crowds,
 clips and passes into the application's command buffers (`tumble_crowd_record`, `tumble_clip_record`,
 `tumble_pass_record`).

 The Vulkan objects belong to the application. It may destroy them only after it has freed the engine, its clips,
 crowds and targets, and after all calls with these have returned. The caller frees the engine with
 `tumble_engine_free`. `options` may be null for the defaults.

 These calls submit to the queue: this one, `tumble_upload`, `tumble_evaluate`, `tumble_clip_evaluate`,
 `tumble_clip_evaluate_to_buffer`, `tumble_request_evaluate`, `tumble_clip_target_new`, `tumble_timed_target_new`,
 `tumble_pass_to_buffer`, `tumble_pass_target_new`, `tumble_crowd_new`, `tumble_crowd_target_new`, `tumble_crowd_stage_target_new`,
 `tumble_crowd_evaluate`, `tumble_crowd_evaluate_half` and `tumble_crowd_submit`.
 All others do not. Without `lock_queue`, the application must not use the queue while one of them runs. The simplest
 solution is a queue that only the library uses, if the device has several. Any number of engines may be created on
 one queue: they take turns.

 # Errors
 - `TUMBLE_RESULT_INVALID_POINTER` if a required handle or function is null.
 - `TUMBLE_RESULT_INVALID_ARGUMENT` if the version is below 1.1, or the physical device or a queue family does not
   fit.
 - `TUMBLE_RESULT_DEVICE` if the device fails the self-test.

 # Safety
 `vulkan` must point to a `TumbleVulkan` whose handles are valid, belong together and live as long as described;
 `options` must be null or point to a `TumbleEngineOptions`; and `engine` must point to memory for a handle.
 */
TumbleResult tumble_engine_from_vulkan(const struct TumbleVulkan *vulkan,
                                       const struct TumbleEngineOptions *options,
                                       struct TumbleEngine **engine);

/*
 Creates an empty library for a skeleton of `joint_count` joints.

 `parents` are the indices of the joints' parents, -1 for a root; parents may come after their children. `offsets`
 are three numbers `x y z` for each joint: the position in the parent's frame, for clips without translations of the
 joint. Null: all are 0. `ticks_per_second` is the number of ticks in a second, 0 for 705 600. A clip has up to
 2147221504 ticks, which are 50 minutes by default. The arrays are copied. The caller frees the library with
 `tumble_crowd_library_free`.

 # Errors
 - `TUMBLE_RESULT_INVALID_ARGUMENT` if a parent is negative but not -1, or there are too many ticks in a second.
 - `TUMBLE_RESULT_INVALID_INPUT` if there are no joints, a parent does not exist, the parents form a cycle, or an
   offset is not finite.

 # Safety
 `parents` must have `joint_count` numbers; `offsets` must be null or have 3 × `joint_count`; and `library` must
 point to memory for a handle.
 */
TumbleResult tumble_crowd_library_new(const int32_t *parents,
                                      const float *offsets,
                                      size_t joint_count,
                                      uint32_t ticks_per_second,
                                      struct TumbleCrowdLibrary **library);

/*
 Sets how clips are stored that are added from now on: "segments" (also if `storage` is null) or "compact".

 Poses have the same bits. Compact clips take a third to a sixth of the memory where keys are close, and poses take
 longer. `tumble_crowd_library_bytes_per_key` returns how much memory clips take.

 # Errors
 `TUMBLE_RESULT_INVALID_ARGUMENT` if the name is unknown.

 # Safety
 `storage` must be null or a text that ends with a zero byte.
 */
TumbleResult tumble_crowd_library_set_storage(struct TumbleCrowdLibrary *library,
                                              const char *storage);

/*
 Returns the bytes of the clips divided by the number of their keys (of rotations, translations and scales), on the CPU
 and on devices; 0 if the handle is invalid.
 */
double tumble_crowd_library_bytes_per_key(const struct TumbleCrowdLibrary *library);

/*
 Adds a clip to a library.

 `set` has one track for each joint, of the same name, in any order. The joints have the names of the file of
 `tumble_crowd_library_of_file`, else those of the first set, whose tracks are then in the order of the joints. Sets
 without names are matched by index. Rotations are interpolated by `interpolation`, or by the defaults if it is
 null. Translations and scales are interpolated by the method `vectors`: "step", "linear", "catmull-rom",
 "bessel-overhauser", "gltf-cubic", "c2" or "b-spline"; null: "linear". Joints without translations stay at their
 offsets. `before` and `after` of `interpolation` are ignored, because each layer of an instance has its wrap mode.
 The reference pose of the clip, for additive layers, is its pose at its start
 (`tumble_crowd_library_set_reference`). `clip` receives the clip's index, counted from 0; it may be null.

 # Errors
 - `TUMBLE_RESULT_INVALID_INPUT` if the set does not have exactly one track for each joint, a track has the name of no joint, a
   track cannot be interpolated as requested, the quantity is not the rotation, a curve rotates so fast that no
   polynomial fits it, the clip is too long, or the library is full.
 - `TUMBLE_RESULT_INVALID_ARGUMENT` if a name is unknown.

 After any error the library is unchanged.

 # Safety
 `interpolation` must be null or point to a `TumbleInterpolation` whose `method` is null or a text that ends with a
 zero byte; `vectors` must be null or a text that ends with a zero byte; and `clip` must be null or point to memory
 for a number.
 */
TumbleResult tumble_crowd_library_push(struct TumbleCrowdLibrary *library,
                                       const struct TumbleSet *set,
                                       const struct TumbleInterpolation *interpolation,
                                       const char *vectors,
                                       size_t *clip);

/*
 Adds a mask: a weight from 0 to 1 for each joint, by which the weights of layers are multiplied.

 `joint_count` must be the library's number of joints. A library has up to 31 masks. `mask` receives the number of
 the mask for `TumbleCrowdLayer.mask`, counted from 1; it may be null.

 # Errors
 `TUMBLE_RESULT_INVALID_INPUT` if the number of weights is not that of joints, a weight is outside 0 to 1, or the
 library has 31 masks already.

 # Safety
 `weights` must have `joint_count` numbers, and `mask` must be null or point to memory for a number.
 */
TumbleResult tumble_crowd_library_push_mask(struct TumbleCrowdLibrary *library,
                                            const float *weights,
                                            size_t joint_count,
                                            size_t *mask);

/*
 Sets the inverse bind matrix of every joint: the inverse of the joint's model matrix in the bind pose.

 `matrices` are 12 numbers for each joint, as in results: three rows of four, for column vectors; the last column
 is the translation. (The 16 numbers `m` of a glTF matrix are in columns: its first row is `m[0] m[4] m[8] m[12]`.)
 `joint_count` must be the library's number of joints.

 # Errors
 `TUMBLE_RESULT_INVALID_INPUT` if there is not one matrix for each joint, or a number is not finite.

 # Safety
 `matrices` must have 12 × `joint_count` numbers.
 */
TumbleResult tumble_crowd_library_set_inverse_bind(struct TumbleCrowdLibrary *library,
                                                   const float *matrices,
                                                   size_t joint_count);

/*
 Sets the reference pose of `clip`, from which its additive layers differ: the pose of the clip `from` at `tick`; for
 ticks after the end of `from`, its last pose.

 # Errors
 `TUMBLE_RESULT_OUT_OF_RANGE` if one of the two clips does not exist.
 */
TumbleResult tumble_crowd_library_set_reference(struct TumbleCrowdLibrary *library,
                                                size_t clip,
                                                size_t from,
                                                uint32_t tick);

/*
 Returns the number of joints; 0 if the handle is invalid.
 */
size_t tumble_crowd_library_joint_count(const struct TumbleCrowdLibrary *library);

/*
 Returns the number of clips; 0 if the handle is invalid.
 */
size_t tumble_crowd_library_clip_count(const struct TumbleCrowdLibrary *library);

/*
 Returns the number of ticks in a second; 0 if the handle is invalid.
 */
uint32_t tumble_crowd_library_ticks_per_second(const struct TumbleCrowdLibrary *library);

/*
 Returns the length of a clip in ticks: from its first key (of a rotation, translation or scale) to its last, and
 at least 1; 0 if there is no such clip.
 */
uint32_t tumble_crowd_library_clip_ticks(const struct TumbleCrowdLibrary *library,
                                         size_t clip);

/*
 Returns the name of a joint: UTF-8, valid until the library is freed; null if there is no such joint.

 In a library of `tumble_crowd_library_new` names are empty until the first set is added, whose names the joints then
 have. A joint without a name is `box1`, `box2` … by its index.
 */
const char *tumble_crowd_library_joint_name(const struct TumbleCrowdLibrary *library,
                                            size_t joint);

/*
 Copies the indices of the joints' parents into `parents`, -1 for a root. `joint_count` must be the number of
 joints.

 # Errors
 `TUMBLE_RESULT_WRONG_SIZE` if `joint_count` is another number.

 # Safety
 `parents` must have memory for `joint_count` numbers, which nothing else uses during the call.
 */
TumbleResult tumble_crowd_library_parents(const struct TumbleCrowdLibrary *library,
                                          int32_t *parents,
                                          size_t joint_count);

/*
 Frees a library. Crowds that were made from it stay valid. Does nothing if `library` is null.
 */
TumbleResult tumble_crowd_library_free(struct TumbleCrowdLibrary *library);

/*
 Creates an empty library for the skeleton of a file. `tumble_crowd_library_push_clip` adds clips to it.

 Its joints are those of all clips of the file, matched by name, with their parents and rest positions; the joints
 of the first clip come first. All of them are roots if the file has no hierarchy. `ticks_per_second` is as in
 `tumble_crowd_library_new`. The caller frees the library with `tumble_crowd_library_free`.

 # Errors
 `TUMBLE_RESULT_INVALID_INPUT` if a clip has two joints of the same name, or a joint has another parent in another
 clip.

 # Safety
 `library` must point to memory for a handle.
 */
TumbleResult tumble_crowd_library_of_file(const struct TumbleFile *file,
                                          uint32_t ticks_per_second,
                                          struct TumbleCrowdLibrary **library);

/*
 Adds a clip of a file to a library. Tracks are matched to joints by name; the file may be another one than that of
 `tumble_crowd_library_of_file`. A joint must have the same parent in the clip as in the library.

 Joints that the clip does not have stay at rest. The clip must not have joints that the library does not have.
 `clip_of_file` is the index of the clip in the file, counted from 0. `interpolation` and `vectors` are as in
 `tumble_crowd_library_push`, but null stands for the methods of the file. All rotations of the file must then
 have one method, and all translations and scales must have one. `clip` receives the clip's index in the library,
 counted from 0; it may be null.

 # Errors
 - `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such clip.
 - `TUMBLE_RESULT_INVALID_INPUT` if the joints or methods of the clip do not fit, or its rotations are relative to
   the world.
 - Otherwise as `tumble_crowd_library_push`.

 # Safety
 `interpolation` must be null or point to a `TumbleInterpolation` whose `method` is null or a text that ends with a
 zero byte; `vectors` must be null or a text that ends with a zero byte; and `clip` must be null or point to memory
 for a number.
 */
TumbleResult tumble_crowd_library_push_clip(struct TumbleCrowdLibrary *library,
                                            const struct TumbleFile *file,
                                            size_t clip_of_file,
                                            const struct TumbleInterpolation *interpolation,
                                            const char *vectors,
                                            size_t *clip);

/*
 Creates a crowd of 1 to 1 000 000 instances with 1 to 4 layers each, on an engine's device.

 All instances stand still at the start of the library's first clip until `tumble_crowd_set` changes them; the
 layers above the first have weight 0. The clock starts at 0. The library is copied, also to the device: later
 changes of it do not reach the crowd. The engine and the library may be freed before the crowd. The caller frees
 the crowd with `tumble_crowd_free`.

 # Errors
 - `TUMBLE_RESULT_WRONG_STATE` if the library has no clips.
 - `TUMBLE_RESULT_INVALID_ARGUMENT` if the number of instances or layers is out of range.
 - `TUMBLE_RESULT_OUT_OF_MEMORY` or `TUMBLE_RESULT_DEVICE` if there is not enough memory or the device fails.

 # Safety
 `crowd` must point to memory for a handle.
 */
TumbleResult tumble_crowd_new(const struct TumbleEngine *engine,
                              const struct TumbleCrowdLibrary *library,
                              size_t instances,
                              size_t layers,
                              struct TumbleCrowd **crowd);

/*
 Sets the clips that layers of instances play from now on. `layers` is an array of `count` changes.

 A fade of a layer that is set ends. If two changes are for one layer, the later one counts. The changes, at most
 20 bytes each, reach the device with the next evaluation.

 # Errors
 - `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such instance, layer, clip or mask.
 - `TUMBLE_RESULT_INVALID_ARGUMENT` if another member is invalid.

 The message has the index of the first change that is refused. After any error nothing changes.

 # Safety
 `layers` must have `count` structures.
 */
TumbleResult tumble_crowd_set(struct TumbleCrowd *crowd,
                              const struct TumbleCrowdLayer *layers,
                              size_t count);

/*
 Returns the clip that a layer of an instance plays, with its current time and its rounded speed and weight.

 The caller sets `layer->size`, `layer->instance` and `layer->layer`; the call writes the other members.

 # Errors
 `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such instance or layer.

 # Safety
 `layer` must point to a `TumbleCrowdLayer`, which nothing else uses during the call.
 */
TumbleResult tumble_crowd_get(const struct TumbleCrowd *crowd,
                              struct TumbleCrowdLayer *layer);

/*
 Returns the tick of its clip at which a layer of an instance is evaluated now, from 0 to the clip's length.

 # Errors
 `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such instance or layer.

 # Safety
 `tick` must point to memory for a number.
 */
TumbleResult tumble_crowd_tick(const struct TumbleCrowd *crowd,
                               size_t instance,
                               size_t layer,
                               uint32_t *tick);

/*
 Moves the clock of all instances forward by `seconds`, rounded to ticks.

 The rounding errors of many steps add up. If the clock must follow frames exactly, as in a film at 30000/1001
 frames a second, use `tumble_crowd_set_clock` with each frame's time.

 # Errors
 `TUMBLE_RESULT_INVALID_ARGUMENT` if `seconds` is negative or not finite, or the clock would reach 2^52 ticks.
 */
TumbleResult tumble_crowd_advance(struct TumbleCrowd *crowd,
                                  double seconds);

/*
 Sets the clock's time in ticks, forwards or backwards. All instances follow.

 # Errors
 `TUMBLE_RESULT_INVALID_ARGUMENT` if `ticks` is 2^52 or more.
 */
TumbleResult tumble_crowd_set_clock(struct TumbleCrowd *crowd, uint64_t ticks);

/*
 Returns the clock's time in ticks.

 # Safety
 `ticks` must point to memory for a number.
 */
TumbleResult tumble_crowd_clock(const struct TumbleCrowd *crowd, uint64_t *ticks);

/*
 Frees a crowd, after waiting for a submitted evaluation. Its targets stay valid until they are freed. Does nothing
 if `crowd` is null.
 */
TumbleResult tumble_crowd_free(struct TumbleCrowd *crowd);

/*
 Sets the weight of a layer above layer 0: 0 to 1, rounded to a multiple of 2^-15. The layer's clip, time and speed
 stay, and its fade ends.

 # Errors
 - `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such instance or layer.
 - `TUMBLE_RESULT_INVALID_ARGUMENT` if the layer is layer 0, or a weight is outside 0 to 1.

 After any error nothing changes.
 */
TumbleResult tumble_crowd_set_weight(struct TumbleCrowd *crowd,
                                     size_t instance,
                                     size_t layer,
                                     float weight);

/*
 Fades the weight of a layer above layer 0 from its current value to `weight`, linearly within `ticks` of the
 clock. With 0 ticks it changes at once.

 Afterwards the weight stays. `tumble_crowd_set`, `tumble_crowd_set_weight` and another fade of the layer end the
 fade.

 # Errors
 - `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such instance or layer.
 - `TUMBLE_RESULT_INVALID_ARGUMENT` if the layer is layer 0, or a weight is outside 0 to 1.

 After any error nothing changes.
 */
TumbleResult tumble_crowd_fade(struct TumbleCrowd *crowd,
                               size_t instance,
                               size_t layer,
                               float weight,
                               uint64_t ticks);

/*
 Sets the weight of a layer above layer 0 as a function of the clock. Unlike that of `tumble_crowd_fade`, this fade
 starts at any weight and at any time, past or future.

 The fade that `tumble_crowd_get_fade` returns, set in another crowd at the same time of the clock, gives the same
 weights at all times.

 # Errors
 - `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such instance or layer.
 - `TUMBLE_RESULT_INVALID_ARGUMENT` if the layer is layer 0, or a weight is outside 0 to 1.

 After any error nothing changes.

 # Safety
 `fade` must point to a `TumbleCrowdFade`.
 */
TumbleResult tumble_crowd_set_fade(struct TumbleCrowd *crowd,
                                   const struct TumbleCrowdFade *fade);

/*
 Returns the fade of a layer's weight, with its rounded weights; also a fade that has ended, because the clock may
 go back.

 The caller sets `fade->size`, `fade->instance` and `fade->layer`. `fades` receives whether the layer has a fade.
 If it has, the call writes the other members of `fade`; otherwise `fade` is unchanged.

 # Errors
 `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such instance or layer.

 # Safety
 `fade` must point to a `TumbleCrowdFade`, which nothing else uses during the call, and `fades` must point to
 memory for a `bool`.
 */
TumbleResult tumble_crowd_get_fade(const struct TumbleCrowd *crowd,
                                   struct TumbleCrowdFade *fade,
                                   bool *fades);

/*
 Adds an event to a clip of a library: a moment such as a step or the throw of a ball, `tick` ticks after the
 clip's start, up to its length. Crowds that were made before do not have the event.

 `name` may be null: then the event has none. Several events may have one name. `event` receives the event's index; it
 may be null.

 # Errors
 - `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such clip.
 - `TUMBLE_RESULT_INVALID_ARGUMENT` if the tick is after the clip's end, or the name is not UTF-8.

 # Safety
 `name` must be null or a text that ends with a zero byte, and `event` null or point to memory for a number.
 */
TumbleResult tumble_crowd_library_push_event(struct TumbleCrowdLibrary *library,
                                             size_t clip,
                                             uint32_t tick,
                                             const char *name,
                                             size_t *event);

/*
 Returns the events that the layers of all instances passed after the time `since` of the clock, up to its current
 time: in the order of the times at which they were passed, then of instances, layers and events.

 `events` has memory for `capacity` events, and `count` receives the number of events. If there are more events than
 `capacity`, only `count` is written, and the call returns `TUMBLE_RESULT_WRONG_SIZE`: call again with more memory.
 With `capacity` 0, `events` may be null.

 A layer passes an event when its time in the clip reaches the event's tick, in either direction, and in a loop once in
 each round. Times are whole ticks, so that one large step passes the same events as many small ones. The clips that
 the layers play now count, so call this after the clock was moved and before layers get other clips. Layers with
 weight 0 pass events, too.

 # Errors
 - `TUMBLE_RESULT_WRONG_SIZE` if there are more events than `capacity`.
 - `TUMBLE_RESULT_INVALID_ARGUMENT` if `since` is later than the clock.
 - `TUMBLE_RESULT_OUT_OF_MEMORY` if there is not enough memory for the list.

 # Safety
 `events` must have memory for `capacity` structures, and `count` must point to memory for a number; nothing else may
 use them during the call.
 */
TumbleResult tumble_crowd_passed_events(const struct TumbleCrowd *crowd,
                                        uint64_t since,
                                        struct TumblePassedEvent *events,
                                        size_t capacity,
                                        size_t *count);

/*
 Limits evaluations to a list of `count` instances, for example those that a camera sees.

 A result then has the rows of these instances only, in the list's order, with the same bits as among all
 instances. The clips of the other instances continue. The list may be in any order and may be empty; no instance
 may be in it twice. It is copied.

 # Errors
 - `TUMBLE_RESULT_OUT_OF_RANGE` if an instance does not exist.
 - `TUMBLE_RESULT_INVALID_ARGUMENT` if an instance is in the list twice.

 After any error nothing changes.

 # Safety
 `instances` must have `count` numbers.
 */
TumbleResult tumble_crowd_set_visible(struct TumbleCrowd *crowd,
                                      const size_t *instances,
                                      size_t count);

/*
 Makes all instances visible again, in the order of their indices.
 */
TumbleResult tumble_crowd_set_all_visible(struct TumbleCrowd *crowd);

/*
 Returns the number of visible instances: the length of the list, or the number of all instances without a list.

 # Safety
 `count` must point to memory for a number.
 */
TumbleResult tumble_crowd_visible_count(const struct TumbleCrowd *crowd,
                                        size_t *count);

/*
 Returns the number of numbers of a result: 4 for rotations, or 12 for matrices, × joints × visible instances.
 `values` is a `TumbleCrowdValues`.

 # Safety
 `count` must point to memory for a number.
 */
TumbleResult tumble_crowd_output_count(const struct TumbleCrowd *crowd,
                                       uint32_t values,
                                       size_t *count);

/*
 Evaluates all visible instances at the clock's time into the caller's memory, and waits for the result.

 `values` is a `TumbleCrowdValues`. `output_count` is the number of floats of `output`, exactly that of
 `tumble_crowd_output_count`.

 # Errors
 - `TUMBLE_RESULT_WRONG_SIZE` if `output_count` is another number.
 - `TUMBLE_RESULT_WRONG_STATE` if the result of `tumble_crowd_submit` was not taken, or skinning matrices are
   requested but the library has no inverse bind matrices.
 - `TUMBLE_RESULT_DEVICE` if the device fails.

 # Safety
 `output` must have `output_count` floats, which nothing else uses during the call.
 */
TumbleResult tumble_crowd_evaluate(struct TumbleCrowd *crowd,
                                   uint32_t values,
                                   float *output,
                                   size_t output_count);

/*
 As `tumble_crowd_evaluate`, in 16 bits: each number is the bits of an IEEE 754 half-precision float, rounded to
 nearest.

 # Safety
 `output` must have `output_count` numbers of 16 bits, which nothing else uses during the call.
 */
TumbleResult tumble_crowd_evaluate_half(struct TumbleCrowd *crowd,
                                        uint32_t values,
                                        uint16_t *output,
                                        size_t output_count);

/*
 Starts an evaluation of all visible instances at the clock's time and returns at once.

 `values` is a `TumbleCrowdValues`. `half` is 0 for a result in 32 bits, 1 for 16 bits. A Vulkan device evaluates
 while instances and the clock are changed for the next frame; the CPU evaluates before this function returns. The
 caller takes the result with `tumble_crowd_wait`, or with `tumble_crowd_wait_half` if `half` is 1, before it
 evaluates or submits again.

 # Errors
 - `TUMBLE_RESULT_WRONG_STATE` if the result of the previous submission was not taken, or skinning matrices are
   requested but the library has no inverse bind matrices.
 - `TUMBLE_RESULT_DEVICE` if the device fails.
 */
TumbleResult tumble_crowd_submit(struct TumbleCrowd *crowd,
                                 uint32_t values,
                                 uint32_t half);

/*
 Returns whether the submitted evaluation has ended, so that `tumble_crowd_wait` does not wait.

 # Errors
 - `TUMBLE_RESULT_WRONG_STATE` if nothing was submitted.
 - `TUMBLE_RESULT_DEVICE` if the device fails.

 # Safety
 `done` must point to memory for a `bool`.
 */
TumbleResult tumble_crowd_poll(const struct TumbleCrowd *crowd, bool *done);

/*
 Waits for an evaluation that was submitted with `half` 0, and takes its result.

 `output_count` is the number of floats of `output`: exactly the `tumble_crowd_output_count` at the time of the
 submission.

 # Errors
 - `TUMBLE_RESULT_WRONG_STATE` if nothing was submitted, or `half` was 1.
 - `TUMBLE_RESULT_WRONG_SIZE` if `output_count` is another number.
 - `TUMBLE_RESULT_DEVICE` if the device fails.

 After the first two errors, a submitted result can still be taken.

 # Safety
 `output` must have `output_count` floats, which nothing else uses during the call.
 */
TumbleResult tumble_crowd_wait(struct TumbleCrowd *crowd,
                               float *output,
                               size_t output_count);

/*
 Waits for an evaluation that was submitted with `half` 1, and takes its result.

 `output_count` is the number of numbers of 16 bits of `output`: exactly the `tumble_crowd_output_count` at the
 time of the submission.

 # Errors
 - `TUMBLE_RESULT_WRONG_STATE` if nothing was submitted, or `half` was 0.
 - `TUMBLE_RESULT_WRONG_SIZE` if `output_count` is another number.
 - `TUMBLE_RESULT_DEVICE` if the device fails.

 After the first two errors, a submitted result can still be taken.

 # Safety
 `output` must have `output_count` numbers of 16 bits, which nothing else uses during the call.
 */
TumbleResult tumble_crowd_wait_half(struct TumbleCrowd *crowd,
                                    uint16_t *output,
                                    size_t output_count);

/*
 Converts matrices of `TUMBLE_CROWD_VALUES_LOCAL` to those of `TUMBLE_CROWD_VALUES_MODEL`, in place, with the bits of
 a crowd that evaluates `TUMBLE_CROWD_VALUES_MODEL` directly.

 Before, the application may change the local matrices, for example by inverse kinematics. `poses` are 12 numbers for
 each joint of each instance, in the order of results, of any number of instances; `count` is the number of floats.
 Several threads may convert a part each. `tumble_crowd_stage_target_new` is the same on a device.

 # Errors
 `TUMBLE_RESULT_WRONG_SIZE` if `count` is not a whole number of instances: 12 × the library's joints each.

 # Safety
 `poses` must have `count` floats, which nothing else uses during the call.
 */
TumbleResult tumble_crowd_library_local_to_model(const struct TumbleCrowdLibrary *library,
                                                 float *poses,
                                                 size_t count);

/*
 Converts matrices of `TUMBLE_CROWD_VALUES_MODEL` to those of `TUMBLE_CROWD_VALUES_SKINNING`, in place, as
 `tumble_crowd_library_local_to_model`.

 # Errors
 - `TUMBLE_RESULT_WRONG_SIZE` if `count` is not a whole number of instances.
 - `TUMBLE_RESULT_WRONG_STATE` if the library has no inverse bind matrices.

 # Safety
 As for `tumble_crowd_library_local_to_model`.
 */
TumbleResult tumble_crowd_library_model_to_skinning(const struct TumbleCrowdLibrary *library,
                                                    float *poses,
                                                    size_t count);

/*
 Prepares the recording of evaluations of a crowd, whose results go to a range of the application's Vulkan buffer.

 Kernels are compiled and memory is allocated here, not when a frame is recorded. The crowd's engine must have been
 created by `tumble_engine_from_vulkan`. This call checks kernels that were not checked before, and then submits to
 the engine's queue. `values` is a `TumbleCrowdValues`. `half` is 0 for numbers of 32 bits, 1 for 16 bits. `buffer`
 is the `VkBuffer`, as a number: `(uint64_t)buffer`. The range starts at `offset`, a multiple of 256, and has `size`
 bytes: at least `tumble_crowd_output_count` × 4, or × 2 with `half` 1, and room for one instance. If it has room for
 more instances than are visible now, more may be visible later.

 The buffer must belong to the engine's device, be bound to memory, and have the usage
 `VK_BUFFER_USAGE_STORAGE_BUFFER_BIT`. The application frees the target with `tumble_crowd_target_free` before it
 destroys the buffer or the device.

 # Errors
 - `TUMBLE_RESULT_INVALID_ARGUMENT` if the engine was not created by `tumble_engine_from_vulkan`.
 - `TUMBLE_RESULT_WRONG_SIZE` if the range is not aligned or too short.
 - `TUMBLE_RESULT_WRONG_STATE` if skinning matrices are requested but the library has no inverse bind matrices.
 - `TUMBLE_RESULT_DEVICE` if the device fails.

 # Safety
 The buffer must be as described, and `target` must point to memory for a handle.
 */
TumbleResult tumble_crowd_target_new(const struct TumbleCrowd *crowd,
                                     uint32_t values,
                                     uint32_t half,
                                     uint64_t buffer,
                                     uint64_t offset,
                                     uint64_t size,
                                     struct TumbleCrowdTarget **target);

/*
 Prepares a stage that continues matrices in a range of the application's Vulkan buffer, in place, in 32 bits.

 `stage` is a `TumbleCrowdStage`. A frame is then, for example: `tumble_crowd_record` with a target for
 `TUMBLE_CROWD_VALUES_LOCAL` in this range, the application's own commands that change these matrices (inverse
 kinematics), and `tumble_crowd_record` with the stage's target, which makes them skinning matrices. The stage
 continues the matrices of as many instances as are visible when it is recorded. The application may have changed these
 matrices. Results have the bits of the CPU, if all numbers are finite and less than 2^36 in magnitude; where
 nothing was changed, they have the bits of an evaluation without stages. The buffer, its range and the errors
 are as for `tumble_crowd_target_new` with matrices in 32 bits.

 # Safety
 As for `tumble_crowd_target_new`.
 */
TumbleResult tumble_crowd_stage_target_new(const struct TumbleCrowd *crowd,
                                           uint32_t stage,
                                           uint64_t buffer,
                                           uint64_t offset,
                                           uint64_t size,
                                           struct TumbleCrowdTarget **target);

/*
 Records an evaluation at the clock's time, or the stage of the target, into the application's command buffer
 `commands`, a `VkCommandBuffer`.

 The commands write up to 20 bytes for each layer that changed since the last evaluation and 4 bytes for each
 instance of a new list of visible instances, and dispatch the kernels. A stage writes none of these changes; they
 remain for the next evaluation. If no instance is visible, nothing is recorded. Nothing is submitted, waited for or
 allocated. Barriers are included: the evaluation waits for all commands that were recorded before it; commands that
 are recorded after it, or submitted to the same queue later, see the result.

 The command buffer must belong to the engine's device and to the family of the engine's queue, and must be in the
 recording state, outside a render pass. Everything that is recorded must be submitted to the engine's queue, once
 and in the order of the calls. If a recorded frame is discarded, call `tumble_crowd_forget_recorded`.
 `tumble_engine_from_vulkan` says which calls of the library submit to that queue: the application must not submit
 at the same time without a lock.

 # Errors
 - `TUMBLE_RESULT_INVALID_ARGUMENT` if the target belongs to another crowd.
 - `TUMBLE_RESULT_WRONG_SIZE` if more instances are visible than the target has room for.

 After any error nothing is recorded.

 # Safety
 The command buffer must be as described, nothing else may use it during the call, and its commands must be
 submitted as described.
 */
TumbleResult tumble_crowd_record(struct TumbleCrowd *crowd,
                                 const struct TumbleCrowdTarget *target,
                                 void *commands);

/*
 As `tumble_crowd_record`, but the barriers order the evaluation only with the commands that are named: it waits for
 those of `before`, and those of `after` wait for it. Both are `TumbleCommandUsers`. Earlier evaluations of the crowd
 are always waited for. Waiting for fewer kinds of commands takes less time.

 # Errors
 As `tumble_crowd_record`; also `TUMBLE_RESULT_INVALID_ARGUMENT` if a constant is unknown.

 # Safety
 As for `tumble_crowd_record`. In addition, the application must have its own barriers for all other commands that use
 the result's memory.
 */
TumbleResult tumble_crowd_record_between(struct TumbleCrowd *crowd,
                                         const struct TumbleCrowdTarget *target,
                                         void *commands,
                                         uint32_t before,
                                         uint32_t after);

/*
 Marks all layers as unknown to the device, so that the next evaluation writes all of them. Call it if a recorded
 frame was discarded.
 */
TumbleResult tumble_crowd_forget_recorded(struct TumbleCrowd *crowd);

/*
 Frees a crowd target. Does nothing if `target` is null.

 # Safety
 All work that was recorded with the target must have ended, and none may be submitted later.
 */
TumbleResult tumble_crowd_target_free(struct TumbleCrowdTarget *target);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* TUMBLE_H */
