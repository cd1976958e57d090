/** The interpolation methods, with the names of the program. */
export type Method =
  | "authored"
  | "slerp"
  | (string & {});

/** The order of results: all samples of the first track first, or all tracks of the first sample. */
export type Layout = "track" | "frame";

/** The curve between keys and outside them. */
export interface CurveOptions {
  /** Default: `authored`, the interpolation that the file states for each channel, slerp for BVH, or bessel-overhauser for others that state none. */
  method?: Method;
  /** The boundary condition at the first and the last key. Default: depends on the method. */
  ends?: "parabolic" | "natural" | "clamped" | "secant" | "loop" | "frozen";
  /** Whether to rotate the shorter way between neighbouring keys, or as their signs say (`q` and `-q` differ). Default: `shortest`. */
  signs?: "shortest" | "as-authored";
  /** The speed along the curve. Default: `as-keyed`. */
  speed?: "as-keyed" | "constant";
  /** The values before the first key. Default: `hold`. */
  before?: "hold" | "loop" | "mirror" | "extrapolate";
  /** The values after the last key. Default: `hold`. */
  after?: "hold" | "loop" | "mirror" | "extrapolate";
  /** kochanek-bartels: 0 is neutral, 1 stops at the keys, -1 doubles the speed at the keys. Default: 0. */
  tension?: number;
  /** kochanek-bartels: 0 is smooth, -1 makes corners at the keys. Default: 0. */
  continuity?: number;
  /** kochanek-bartels: 0 is neutral, 1 uses the velocity of the interval before a key, -1 of the one after it. Default: 0. */
  bias?: number;
}

/** How clips are sampled. */
export interface SampleOptions extends CurveOptions {
  /** Default: `track`. */
  layout?: Layout;
}

/** How angular velocities and accelerations are sampled. */
export interface RateOptions extends SampleOptions {
  /** The axes of the result: those of the body (the default) or of its parent. */
  axes?: "body" | "parent";
}

/** Frames at an exact rate: `60`, `"30000/1001"`. */
export interface Frames {
  fps: number | string;
  /** Seconds. Default: the clip's first key. */
  start?: number;
  /** Seconds. Default: the clip's last key. */
  end?: number;
}

/** Seconds, in any order; or frames. */
export type Times = number | ArrayLike<number> | Frames;

/** The fields of all results. */
export interface Result {
  tracks: number;
  /** The number of samples of each track. */
  samples: number;
  /** The times of the frames in seconds; only if frames were requested. */
  times?: Float64Array;
}

/** The pose of each track, relative to its parent. */
export interface Pose extends Result {
  /** Unit quaternions `x y z w`; neighbouring samples of a track have the nearer signs. */
  rotations: Float32Array;
  /** `x y z`; null where no track has any. */
  translations: Float32Array | null;
  /** `x y z`; null where no track has any. */
  scales: Float32Array | null;
}

/** Angular velocities, rad/s, or accelerations, rad/s². */
export interface Rates extends Result {
  /** `x y z`. */
  values: Float32Array;
}

/** Positions and rotations of joints, in the world. */
export interface World extends Result {
  /** `x y z`. */
  positions: Float64Array;
  /** `x y z w`. */
  rotations: Float32Array;
}

/** Matrices that transform points from the axes of a joint to the world. */
export interface Matrices extends Result {
  /** 16 numbers a joint, column after column. */
  matrices: Float32Array;
}

/** Keys of a track. */
export interface Keys {
  /** Seconds. */
  times: Float64Array;
  /** `x y z w`. */
  rotations: Float32Array;
  translationTimes: Float64Array | null;
  translations: Float32Array | null;
  scaleTimes: Float64Array | null;
  scales: Float32Array | null;
}

/** Vectors at times. */
export interface VectorKeys {
  /** Seconds, increasing. */
  times: ArrayLike<number>;
  /** `x y z` for each time. */
  values: ArrayLike<number>;
  /** For `cubic`: the in-tangent and the out-tangent of each key, units per second. */
  tangents?: ArrayLike<number>;
}

/** A track that is given as arrays. */
export interface Track {
  name?: string;
  /** Seconds, increasing. Default: one key at 0. */
  times?: ArrayLike<number>;
  /** Unit quaternions `x y z w`, one for each time. */
  rotations?: ArrayLike<number>;
  /** For `cubic`: the in-tangent and the out-tangent of each key, per second. */
  tangents?: ArrayLike<number>;
  translations?: VectorKeys;
  scales?: VectorKeys;
  /** The index of its parent track. */
  parent?: number;
  /** The rest pose, which is used without keys. */
  rest?: { translation?: ArrayLike<number>; rotation?: ArrayLike<number>; scale?: ArrayLike<number> };
  /** The interpolation that `authored` uses for it, as in glTF. */
  interpolation?: "step" | "linear" | "cubic";
}

/** A clip: tracks with their keys, as a clip of a file. */
export class Clip {
  private constructor();
  readonly name: string | null;
  /** The names of the tracks. */
  readonly names: readonly string[];
  /** The index of each track's parent; null for roots. */
  readonly parents: readonly (number | null)[];
  /** Whether rotations and translations are relative to the world instead of the parent. */
  readonly isWorld: boolean;
  /** The time of the first key in seconds. */
  readonly start: number;
  /** The time of the last key in seconds. */
  readonly end: number;
  readonly keyCount: number;
  /** The rate on whose frames all keys lie, if there is one. */
  readonly rate: string | null;
  /** The pose of each track at times. */
  sample(times: Times, options?: SampleOptions): Pose;
  /** Angular velocities, rad/s. */
  velocities(times: Times, options?: RateOptions): Rates;
  /** Angular accelerations, rad/s². */
  accelerations(times: Times, options?: RateOptions): Rates;
  /** The positions and rotations of all joints in the world. */
  world(times: Times, options?: SampleOptions): World;
  /** The matrix of each joint, from its axes to the world. */
  matrices(times: Times, options?: SampleOptions): Matrices;
  /** Rotations at one time after another, such as the frames of a game; the clip may be freed before it. */
  sampler(options?: CurveOptions): Sampler;
  /** The keys of a track, which counts from 0. */
  keys(track: number): Keys;
  /** Frees the memory at once; otherwise the garbage collector does this later. */
  free(): void;
}

/**
 * Evaluates a clip's rotations at one time after another. They have the bits of `Clip.sample`, except that a rotation
 * may have the other sign: there neighbouring samples have the nearer one.
 */
export class Sampler {
  private constructor();
  readonly tracks: number;
  /** `x y z w` of every track at `time`, which is in seconds. `out`: an array of 4 × tracks numbers that is filled and returned. */
  pose(time: number, out?: Float32Array): Float32Array;
  /** `x y z w` of a track, which counts from 0. */
  sample(track: number, time: number, out?: Float32Array): Float32Array;
  /** Frees the memory at once; otherwise the garbage collector does this later. */
  free(): void;
}

/** The engine in this page, worker or process. */
export class Tumble {
  private constructor();
  readonly version: string;
  readonly methods: readonly { name: string; summary: string; interpolates: boolean }[];
  /** The formats that `read` supports. */
  readonly formats: readonly string[];
  /** A clip of arrays. */
  clip(tracks: Track[], options?: { name?: string | null; isWorld?: boolean }): Clip;
  /**
   * The clips of a file. Its format is recognised by its first bytes, then by the ending of `name`. `refused`:
   * error messages for clips that cannot be read.
   */
  read(
    bytes: ArrayBuffer | ArrayBufferView,
    options?: { name?: string; sourceRate?: number | string },
  ): { clips: Clip[]; warnings: string[]; refused: string[] };
  /** A clip in the packed form that the pages of `tumble view` contain. */
  unpack(bytes: ArrayBuffer | ArrayBufferView): Clip;
}

/** An error of the engine, a file or an argument. */
export class TumbleError extends Error {
  /** The code of an error in a file, as in the program (`tumble explain`). */
  readonly code: string | null;
}

/** The poses of a clip at times: `clip.sample(times, options)`. */
export function sample(clip: Clip, times: Times, options?: SampleOptions): Pose;

/** Loads the engine. `source`: the module's bytes, its URL, or a response with it; by default the file in the package. */
export function load(source?: URL | string | Response | WebAssembly.Module | ArrayBuffer | ArrayBufferView): Promise<Tumble>;
