// Reads the clips and results that are stored in the page, and evaluates others with the page's WebAssembly engine. All
// rotations come from the engine; this file interpolates none.

import { Live } from "./live.js";

/** Decodes base64, then decompresses: `deflate` or `gzip`. Returns the bytes. */
export async function inflated(text, format = "deflate") {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream(format));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Unpacks a mesh: `places`, x y z of each vertex, and `triangles`, three vertex indices each. */
export async function mesh({ places, triangles }) {
  return {
    places: new Float32Array((await inflated(places)).buffer),
    triangles: new Uint32Array((await inflated(triangles)).buffer),
  };
}

/** Unpacks a skinned mesh: each vertex has four joints (`bonesOf`) and their weights; `toJoints` are inverse bind matrices. */
export async function skin({ places, triangles, bonesOf, weights, joints, toJoints }) {
  return {
    ...(await mesh({ places, triangles })),
    bonesOf: new Uint16Array((await inflated(bonesOf)).buffer),
    weights: new Uint16Array((await inflated(weights)).buffer),
    joints,
    toJoints: new Float32Array((await inflated(toJoints)).buffer),
  };
}

const doubles = async (text) => new Float64Array((await inflated(text)).buffer);

// Decodes 16-bit integers. Each sample is stored as its difference from the sample before it (`stride` numbers earlier), and
// all low bytes come before all high bytes, because this compresses better.
async function differences(text, stride) {
  const bytes = await inflated(text);
  const length = bytes.length / 2;
  const values = new Uint16Array(length);
  for (let i = 0; i < length; i++) {
    const difference = bytes[i] | (bytes[length + i] << 8);
    values[i] = i < stride ? difference : values[i - stride] + difference;
  }
  return values;
}

/** One clip: its boxes or joints, its sample times [s], its keys, and its results for each method. */
export class Set {
  constructor(stored) {
    this.stored = stored;
    this.name = stored.name;
    this.boxes = stored.boxes;
    this.length = stored.length;
    // The parent of each joint (-1: root) and its name. Both are empty for the boxes of a chain.
    this.parents = stored.parents;
    this.names = stored.names;
    this.isWorld = stored.isWorld;
    this.isSkeleton = stored.parents.length > 0;
    // The sizes to draw with, if the tracks are bodies that follow paths; otherwise null.
    this.bodies = stored.bodies;
    this.hasFrames = stored.hasFrames;
    // The methods whose frames are stored in the page.
    this.written = stored.results.map((result) => result.method);
    this.methods = this.written;
    this.results = new Map();
    // Clips of other inputs that can be drawn together with this clip.
    this.ghosts = [];
    // `live`: the clip in the page's engine; null if the page has no engine or no keys. `rate`: frames per second; null for
    // the frames that are stored in the page.
    this.live = null;
    this.rate = null;
  }

  /** Uploads the clip's keys to the page's engine, so that further methods, rates and times can be evaluated. */
  async enliven(engine, options) {
    if (!engine || !this.stored.clip) return;
    const { bytes, methods } = this.stored.clip;
    const { origin } = this.stored;
    this.live = new Live(engine.unpack(await inflated(bytes)), { options, origin, isPlaced: this.isSkeleton });
    this.methods = [...this.written, ...methods.filter((name) => !this.written.includes(name))];
  }

  async unpack() {
    if (this.times) return;
    this.writtenTimes = await doubles(this.stored.times);
    this.times = this.writtenTimes;
    this.keyTimes = await doubles(this.stored.keyTimes);
    this.keys = new Int16Array((await differences(this.stored.keys, 4)).buffer);
  }

  /**
   * The result of a method: rotations [sample][box][xyzw], to be divided by `unit`; angular speeds [sample][box], rad/s after
   * multiplying by `speedUnit`; positions of joints [sample][joint][xyz] in units of `scale` from `low`. Stored results have
   * 16-bit integers.
   */
  async result(method) {
    if (!this.results.has(method)) {
      const stored = this.rate === null && this.stored.results.find((result) => result.method === method);
      if (!stored) {
        this.results.set(method, this.live.result(method, this.times));
        return this.results.get(method);
      }
      const rotations = await differences(stored.rotations, this.boxes * 4);
      const speeds = await differences(stored.speeds, this.boxes);
      const positions = stored.positions && {
        ...stored.positions,
        scale: stored.positions.size.map((size) => size / 65535),
        packed: await differences(stored.positions.packed, this.boxes * 3),
      };
      this.results.set(method, {
        method,
        rotations: new Int16Array(rotations.buffer),
        unit: 32767,
        speeds,
        speedUnit: stored.fastest / 65535,
        positions,
      });
    }
    return this.results.get(method);
  }

  /** Selects frames at another rate, together with the key times between them; null selects the stored frames. */
  setRate(rate) {
    const times = rate === null ? this.writtenTimes : this.live.times(rate, this.writtenTimes, this.boxes, this.keyTimes);
    this.results.clear();
    this.rate = rate;
    this.times = times;
  }

  /** The index of the key of a box at a time; -1 if the time is between keys. */
  keyAt(box, time) {
    const near = 1e-9 * Math.max(1, Math.abs(time));
    return this.keysOf(box).times.findIndex((key) => Math.abs(key - time) <= near);
  }

  /** The index of the box with the largest total rotation over the clip: its angular speed, summed over time. */
  busiest(result) {
    let [most, found] = [0, 0];
    for (let box = 0; box < this.boxes; box++) {
      let turned = 0;
      for (let sample = 1; sample < this.samples; sample++) {
        const speed = result.speeds[sample * this.boxes + box];
        turned += speed * (this.times[sample] - this.times[sample - 1]);
      }
      if (turned > most) [most, found] = [turned, box];
    }
    return found;
  }

  get samples() {
    return this.times.length;
  }

  /** The index of the last sample at or before a time. */
  sampleAt(time) {
    let low = 0;
    let high = this.samples - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.times[middle] <= time) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  /** The index of the sample nearest to a time. */
  nearest(time) {
    const { times, samples } = this;
    const sample = this.sampleAt(time);
    return sample + 1 < samples && times[sample + 1] - time < time - times[sample] ? sample + 1 : sample;
  }

  /** The key times of a box, and the index of its first key in `keys`. */
  keysOf(box) {
    const { sharedKeys, keyCounts } = this.stored;
    if (sharedKeys) {
      return { times: this.keyTimes, first: box * this.keyTimes.length };
    }
    let first = 0;
    for (let i = 0; i < box; i++) first += keyCounts[i];
    return { times: this.keyTimes.subarray(first, first + keyCounts[box]), first };
  }
}

/** A rotation of a result as a unit quaternion x y z w. Normalised, because stored components are rounded to 16 bits. */
export function rotation(result, boxes, sample, box) {
  const at = (sample * boxes + box) * 4;
  const q = [0, 1, 2, 3].map((i) => result.rotations[at + i] / result.unit);
  const length = Math.hypot(...q) || 1;
  return q.map((component) => component / length);
}

/** The world position x y z of a joint, relative to the clip's origin. */
export function position({ positions }, joints, sample, joint) {
  const { low, scale, packed } = positions;
  const at = (sample * joints + joint) * 3;
  return low.map((least, axis) => least + packed[at + axis] * scale[axis]);
}

/** The number of decimals to print positions with: about 1e-5 of the clip's extent, the step of stored positions. */
export function decimals({ positions }) {
  const extent = Math.max(...positions.size) || 1;
  return Math.min(Math.max(5 - Math.ceil(Math.log10(extent)), 0), 20);
}

/** The world position of a joint as text. */
export function placeInWords(result, joints, sample, joint) {
  const digits = decimals(result);
  // Adding 0 turns -0 into 0, so that no `-0.00` is printed.
  const words = (value) => (Number(value.toFixed(digits)) + 0).toFixed(digits).replace("-", "−");
  return position(result, joints, sample, joint).map(words).join("  ");
}
