// Ghosts: clips of other inputs that are drawn translucent with the selected clip, at the same time. This file finds the
// sample of a ghost at a time of the clip, and measures how far apart the joints of both are.

import { position, rotation } from "./data.js";

// Times that differ by less than this [s] count as equal.
const SAME_TIME = 1e-6;

/** A ghost of a clip: its clip `input`, and how times and joints of the two correspond, as `tumble view` found it. */
export class Ghost {
  constructor(input, { shift, pairs, inWorld, note }) {
    this.input = input;
    // A time of the clip plus `shift` is the corresponding time of the ghost [s].
    this.shift = shift;
    // Pairs of indices: a joint of the clip, and the same joint of the ghost.
    this.pairs = pairs;
    this.inWorld = inWorld;
    this.note = note;
    this.method = "";
    this.result = null;
  }

  /** The reverse pair: the clip as a ghost of this ghost's clip. */
  reversed(clip) {
    const { shift, pairs, inWorld, note } = this;
    return new Ghost(clip, { shift: -shift, pairs: pairs.map(([own, other]) => [other, own]), inWorld, note });
  }

  /** The ghost's joint that corresponds to a joint of the clip; -1 if there is none. */
  partner(joint) {
    return this.pairs.find(([own]) => own === joint)?.[1] ?? -1;
  }

  /** Loads the ghost's result for a method, or for the ghost's first method if it does not have this one. */
  async load(method) {
    const { input } = this;
    await input.unpack();
    this.method = input.methods.includes(method) ? method : input.methods[0];
    this.result = await input.result(this.method);
  }

  /** The ghost's first and last time, as times of the clip [s]. */
  get span() {
    const { times, samples } = this.input;
    return [times[0] - this.shift, times[samples - 1] - this.shift];
  }

  /**
   * The ghost at a time of the clip: a result and the index of a sample in it; null outside the ghost's times. Without an
   * engine this is the nearest stored sample; `late` is then its time minus the requested time [s].
   */
  at(time) {
    const [first, last] = this.span;
    if (time < first - SAME_TIME || time > last + SAME_TIME) return null;
    const { input } = this;
    const own = time + this.shift;
    const sample = input.nearest(own);
    const late = input.times[sample] - own;
    if (Math.abs(late) <= SAME_TIME) return { result: this.result, sample, late: 0 };
    if (!input.live) return { result: this.result, sample, late };
    return { result: input.live.pose(this.method, [own]), sample: 0, late: 0 };
  }

  /** The vector to add to positions of the ghost, because its origin may differ from the clip's. */
  offset(clip) {
    return this.input.stored.origin.map((value, axis) => value - clip.stored.origin[axis]);
  }

  /**
   * The joint pair with the largest angle [rad] and the one with the largest distance. The distance is NaN unless both clips
   * have positions. `own`, `moment`: the result and sample of the clip and of the ghost.
   */
  furthest(clip, own, moment) {
    const angle = (joint, other) =>
      this.inWorld
        ? apart(inWorld(own, clip, joint), inWorld(moment, this.input, other))
        : apart(
            rotation(own.result, clip.boxes, own.sample, joint),
            rotation(moment.result, this.input.boxes, moment.sample, other),
          );
    const offset = this.offset(clip);
    const distance = (joint, other) => {
      if (!own.result.positions || !moment.result.positions) return NaN;
      const from = position(own.result, clip.boxes, own.sample, joint);
      const to = position(moment.result, this.input.boxes, moment.sample, other);
      return Math.hypot(...to.map((value, axis) => value + offset[axis] - from[axis]));
    };
    const largest = (measure) =>
      this.pairs.reduce(
        (found, [joint, other]) => {
          const value = measure(joint, other);
          return value > found.value ? { joint, value } : found;
        },
        { joint: -1, value: -1 },
      );
    return { angle: largest(angle), distance: largest(distance) };
  }

  /** The text beside the ghost's name in the list of clips: the largest differences. `decimals`: digits of distances. */
  words(clip, own, moment, decimals) {
    if (!moment) {
      const [first, last] = this.span.map((time) => time.toFixed(3));
      return `not at this moment; it has ${first} to ${last} s`;
    }
    const late = moment.late && `${Math.abs(moment.late).toFixed(4)} s ${moment.late > 0 ? "later" : "earlier"}, `;
    if (this.pairs.length === 0) return late ? `its nearest frame is ${late.slice(0, -2)}` : "";
    const name = (joint) => clip.names[joint] ?? `box ${joint + 1}`;
    const { angle, distance } = this.furthest(clip, own, moment);
    const found = [];
    const add = ({ joint }, text, unit) => {
      if (joint >= 0) found.push((Number(text) > 0 ? `${name(joint)} ` : "") + text + unit);
    };
    add(angle, ((angle.value * 180) / Math.PI).toFixed(2), "°");
    add(distance, distance.value.toFixed(decimals), "");
    const distances = found.length > 0 ? `furthest apart: ${found.join(", ")}` : "";
    return `${late ? `its nearest frame, ${late}` : ""}${distances}`;
  }
}

/** The world rotation of a joint. For a skeleton it comes from the drawn bones, because results are relative to parents. */
function inWorld({ turned, result, sample }, input, joint) {
  return turned && (turned[joint]?.toArray() ?? rotation(result, input.boxes, sample, joint));
}

/** The angle between two rotations x y z w [rad]; NaN if one is missing. */
function apart(q, p) {
  if (!q || !p) return NaN;
  const [a, b, c, w] = q;
  const [x, y, z, v] = p;
  const across = Math.hypot(
    w * x - v * a - (b * z - c * y),
    w * y - v * b - (c * x - a * z),
    w * z - v * c - (a * y - b * x),
  );
  return 2 * Math.atan2(across, Math.abs(a * x + b * y + c * z + w * v));
}
