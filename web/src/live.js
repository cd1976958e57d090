// Evaluates a clip's keys with the WebAssembly engine in the page. The results are bit-identical to the program's.

import { loadFrom } from "../../npm/package/core.js";
import { inflated } from "./data.js";

/** The largest result that the page evaluates, bytes. */
const LARGEST = 256e6;
/** The bytes of one sample of one track: rotation, speed and position. */
const SAMPLE = 48;

/** Starts the engine. Null if the page contains none, or if the browser cannot run it (it needs WebAssembly SIMD). */
export async function engine(packed) {
  if (!packed) return null;
  try {
    return await loadFrom(await inflated(packed, "gzip"));
  } catch (error) {
    console.warn(`what was written is shown, and nothing else: ${error.message}`);
    return null;
  }
}

export class Live {
  constructor(clip, { options, origin, isPlaced }) {
    this.clip = clip;
    this.options = { ...options, layout: "frame" };
    this.origin = origin;
    this.isPlaced = isPlaced;
  }

  /**
   * Sample times at a rate, from the first stored time to the last. Key times are added, so that keys are
   * shown exactly, unless there are more keys than frames.
   */
  times(rate, written, tracks, keys) {
    const [first, last] = [written[0], written[written.length - 1]];
    const count = Math.floor((last - first) * rate + 1e-6) + 1;
    if (!(rate > 0) || count * tracks * SAMPLE > LARGEST) {
      throw new Error(`${rate} frames a second are ${count} frames; ${tracks} tracks have room for ${Math.floor(LARGEST / SAMPLE / tracks)}`);
    }
    const frames = Array.from({ length: count }, (_, frame) => first + frame / rate);
    const within = Array.from(new Set(keys)).filter((key) => key >= first && key <= last);
    const all = within.length <= count ? frames.concat(within) : frames;
    return Float64Array.from(new Set(all)).sort();
  }

  /** Rotations, angular speeds [rad/s] and positions at times, in the form of a stored result (see `Set.result`). */
  result(method, times) {
    const { values } = this.clip.velocities(times, { ...this.options, method });
    const speeds = Float32Array.from({ length: values.length / 3 }, (_, i) => Math.hypot(...values.subarray(3 * i, 3 * i + 3)));
    return { ...this.pose(method, times), speeds, speedUnit: 1 };
  }

  /** Like `result`, without speeds. */
  pose(method, times) {
    const options = { ...this.options, method };
    const { rotations } = this.clip.sample(times, options);
    return { method, rotations, unit: 1, positions: this.isPlaced ? this.positions(times, options) : undefined };
  }

  positions(times, options) {
    const packed = this.clip.world(times, options).positions;
    const low = [Infinity, Infinity, Infinity];
    const high = low.map((value) => -value);
    for (let i = 0; i < packed.length; i++) {
      packed[i] -= this.origin[i % 3];
      low[i % 3] = Math.min(low[i % 3], packed[i]);
      high[i % 3] = Math.max(high[i % 3], packed[i]);
    }
    return { low: [0, 0, 0], scale: [1, 1, 1], size: high.map((value, axis) => value - low[axis]), packed };
  }

  /** The matrix of each joint at a time, from joint axes to the view: 16 numbers per joint, column-major, with scales. */
  matrices(method, time) {
    const { matrices } = this.clip.matrices([time], { ...this.options, method });
    for (let i = 12; i < matrices.length; i += 16) {
      for (let axis = 0; axis < 3; axis++) matrices[i + axis] -= this.origin[axis];
    }
    return matrices;
  }
}
