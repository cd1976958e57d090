// The results that the page carries, unpacked, and those that its engine makes of the keys. Nothing here makes a
// rotation that the engine has not made.

import { Live } from "./live.js";

/** What base64 and an archive hold. */
export async function inflated(text, format = "deflate") {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream(format));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** The triangles of a mesh: places of vertices, and three vertices each. */
export async function mesh({ places, triangles }) {
  return {
    places: new Float32Array((await inflated(places)).buffer),
    triangles: new Uint32Array((await inflated(triangles)).buffer),
  };
}

/** What joints carry. */
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

// Each sample is stored as its difference from the one before it, all low bytes before
// all high bytes, which packs better.
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

/** One clip: its boxes or joints, sample times, keys, and results by each method. */
export class Set {
  constructor(stored) {
    this.stored = stored;
    this.name = stored.name;
    this.boxes = stored.boxes;
    this.length = stored.length;
    // Of joints: what each hangs on (-1: nothing), and its name. Boxes of a chain have neither.
    this.parents = stored.parents;
    this.names = stored.names;
    this.isWorld = stored.isWorld;
    this.isSkeleton = stored.parents.length > 0;
    // How bodies on paths are drawn, where tracks are these.
    this.bodies = stored.bodies;
    this.hasFrames = stored.hasFrames;
    // Those that the page has frames of.
    this.written = stored.results.map((result) => result.method);
    this.methods = this.written;
    this.results = new Map();
    // Clips of other inputs that are shown with it.
    this.ghosts = [];
    // The engine's clip, if the page can evaluate the keys; the frames a second, if not those that were written.
    this.live = null;
    this.rate = null;
  }

  /** Lets the engine evaluate the keys. */
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

  /** The rotations by a method, [sample][box][xyzw] as 16-bit integers, the speeds, and where joints are. */
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

  /** Frames at another rate, and the keys between them; null: those that were written. */
  setRate(rate) {
    const times = rate === null ? this.writtenTimes : this.live.times(rate, this.writtenTimes, this.boxes, this.keyTimes);
    this.results.clear();
    this.rate = rate;
    this.times = times;
  }

  /** The key of a box at a time, from 0; -1 between keys. */
  keyAt(box, time) {
    const near = 1e-9 * Math.max(1, Math.abs(time));
    return this.keysOf(box).times.findIndex((key) => Math.abs(key - time) <= near);
  }

  /** The box that turns most: the sum of all that it turns by. */
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

  /** The last sample that is not after a time. */
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

  /** The sample nearest to a time. */
  nearest(time) {
    const { times, samples } = this;
    const sample = this.sampleAt(time);
    return sample + 1 < samples && times[sample + 1] - time < time - times[sample] ? sample + 1 : sample;
  }

  /** Key times of a box, and where its keys begin in `keys`. */
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

/** A stored rotation's components x y z w, of length 1. */
export function rotation(result, boxes, sample, box) {
  const at = (sample * boxes + box) * 4;
  const q = [0, 1, 2, 3].map((i) => result.rotations[at + i] / result.unit);
  const length = Math.hypot(...q) || 1;
  return q.map((component) => component / length);
}

/** Where a joint is in the world, x y z. */
export function position({ positions }, joints, sample, joint) {
  const { low, scale, packed } = positions;
  const at = (sample * joints + joint) * 3;
  return low.map((least, axis) => least + packed[at + axis] * scale[axis]);
}

/** The decimals of lengths that are exact to about a thousandth of a percent of the clip's extent. */
export function decimals({ positions }) {
  const extent = Math.max(...positions.size) || 1;
  return Math.min(Math.max(5 - Math.ceil(Math.log10(extent)), 0), 20);
}

/** Where a joint is, in words. */
export function placeInWords(result, joints, sample, joint) {
  const digits = decimals(result);
  // No -0.00: what is rounded to zero loses its sign.
  const words = (value) => (Number(value.toFixed(digits)) + 0).toFixed(digits).replace("-", "−");
  return position(result, joints, sample, joint).map(words).join("  ");
}
