// The clips of other inputs that are shown with one, at the same moment: where each is then, and how far apart they are.

import { position, rotation } from "./data.js";

// Times closer than this are one moment, seconds.
const SAME_TIME = 1e-6;

/** Another clip beside one: `input`, with what the program has found out about both. */
export class Ghost {
  constructor(input, { shift, pairs, inWorld, note }) {
    this.input = input;
    // Added to a time of the clip: the same moment by the clock of the ghost.
    this.shift = shift;
    // Joints of the clip and of the ghost that are the same.
    this.pairs = pairs;
    this.inWorld = inWorld;
    this.note = note;
    this.method = "";
    this.result = null;
  }

  /** The clip as a ghost of this one. */
  reversed(clip) {
    const { shift, pairs, inWorld, note } = this;
    return new Ghost(clip, { shift: -shift, pairs: pairs.map(([own, other]) => [other, own]), inWorld, note });
  }

  /** The joint that is the same as one of the clip's; -1 where there is none. */
  partner(joint) {
    return this.pairs.find(([own]) => own === joint)?.[1] ?? -1;
  }

  /** Loads its result by a method, or by its first where it is not shown by that. */
  async load(method) {
    const { input } = this;
    await input.unpack();
    this.method = input.methods.includes(method) ? method : input.methods[0];
    this.result = await input.result(this.method);
  }

  /** First and last time, by the clock of the clip. */
  get span() {
    const { times, samples } = this.input;
    return [times[0] - this.shift, times[samples - 1] - this.shift];
  }

  /** A result and the sample of it at a time of the clip; null outside its own times. `late`: by how much, seconds. */
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

  /** How far positions of the ghost are from those of the clip, which count from another origin. */
  offset(clip) {
    return this.input.stored.origin.map((value, axis) => value - clip.stored.origin[axis]);
  }

  /** The pair of joints that is furthest apart by an angle, and by a distance where both clips have positions. */
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

  /** What is said of it while the clip is at a sample of a result. `decimals`: of lengths. */
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

/** The rotation of a joint in the world, which only the drawn bones know of joints that have parents. */
function inWorld({ turned, result, sample }, input, joint) {
  return turned && (turned[joint]?.toArray() ?? rotation(result, input.boxes, sample, joint));
}

/** The angle between two rotations x y z w, radians; NaN where there are none. */
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
