// The interface to the WebAssembly module: clips, their samples and samplers. `index.js` (browsers) and `node.js` load the
// module's bytes.

const CALLS = { about: 0, unpack: 1, read: 2, sample: 3, keys: 4, free: 5, sampler: 6, freeSampler: 7 };
const EVERY_TRACK = 0xffffffff;
const text = new TextEncoder();
const words = new TextDecoder();

/** An error of the engine, a file or an argument. `code`: the code of a file's error, as in docs/codes.md; otherwise null. */
export class TumbleError extends Error {
  constructor(message, code = null) {
    super(message);
    this.name = "TumbleError";
    this.code = code;
  }
}

/** An instance of the WebAssembly module with its memory. */
class Module {
  constructor(instance) {
    this.exports = instance.exports;
    this.broken = null;
  }

  /** Executes a call. Returns the answer's JSON, in which each array is a property of its name. */
  call(name, header, numbers = new Uint8Array(0)) {
    const json = text.encode(JSON.stringify(header));
    const bytes = json.length + numbers.byteLength;
    return this.attempt(() => {
      const at = this.exports.tumble_input(bytes) >>> 0;
      if (at === 0) throw new TumbleError(`there is no memory for ${bytes} bytes of input`);
      const memory = new Uint8Array(this.exports.memory.buffer, at, bytes);
      memory.set(json);
      memory.set(numbers, json.length);
      const isDone = this.exports.tumble_call(CALLS[name], json.length) === 1;
      return this.answer(isDone);
    });
  }

  /** Samples one track or all (EVERY_TRACK) at a time [s], and copies x y z w of each to `out`, which has this length. */
  pose(sampler, track, time, out) {
    return this.attempt(() => {
      const at = this.exports.tumble_pose(sampler, track, time) >>> 0;
      if (at === 0) return this.answer(false);
      out.set(new Float32Array(this.exports.memory.buffer, at, out.length));
      return out;
    });
  }

  /** Runs a function that calls the instance. If the instance traps, this and all later calls throw TumbleError. */
  attempt(run) {
    if (this.broken) throw new TumbleError(`${this.broken}; load the package's engine anew (load())`);
    try {
      return run();
    } catch (error) {
      if (error instanceof TumbleError) throw error;
      // A trap in the middle of a call leaves the module's state inconsistent, so it is not called again.
      this.broken = `the engine stopped: ${error.message}; it may have run out of memory`;
      throw new TumbleError(this.broken);
    }
  }

  answer(isDone) {
    const { memory, tumble_answer, tumble_answer_bytes, tumble_array } = this.exports;
    const json = new Uint8Array(memory.buffer, tumble_answer() >>> 0, tumble_answer_bytes() >>> 0);
    const answer = JSON.parse(words.decode(json));
    if (!isDone) throw new TumbleError(answer.message, answer.code);
    answer.arrays.forEach(({ name, kind, bytes }, i) => {
      const at = tumble_array(i) >>> 0;
      const copy = memory.buffer.slice(at, at + bytes);
      answer[name] = kind === "f64" ? new Float64Array(copy) : new Float32Array(copy);
    });
    delete answer.arrays;
    return answer;
  }
}

const isNumbers = (value) => ArrayBuffer.isView(value) || Array.isArray(value);

function numbers(value, kind, components, what) {
  if (!isNumbers(value)) throw new TumbleError(`${what} are no array of numbers, but ${typeof value}`);
  const flat = Array.isArray(value) ? value.flat(2) : value;
  for (let i = 0; i < flat.length; i++) {
    // Typed arrays would silently convert holes to NaN and strings to numbers.
    if (typeof flat[i] !== "number") throw new TumbleError(`${what}: number ${i} is ${String(flat[i])}, no number`);
  }
  const array = kind.from(flat);
  if (array.length % components !== 0) {
    throw new TumbleError(`${what}: ${array.length} numbers are no whole number of ${components}`);
  }
  return array;
}

/** A track's header and number arrays, in the order that formats/src/motion/packed.rs reads. `before`: the times of the track before it, which are not repeated if equal. */
function packedTrack(track, index, before) {
  const what = (name) => `track ${index}${track.name ? ` (${track.name})` : ""}: ${name}`;
  const known = ["name", "times", "rotations", "translations", "scales", "parent", "rest", "interpolation", "tangents"];
  for (const name of Object.keys(track)) {
    // `path` is the name that `signs` had before.
    if (!known.includes(name) && name !== "path") throw new TumbleError(`${what(`there is no \`${name}\``)}; there are ${known.join(", ")}`);
  }
  const times = numbers(track.times ?? [0], Float64Array, 1, what("times"));
  const rotations = numbers(track.rotations ?? [0, 0, 0, 1], Float32Array, 4, what("rotations"));
  if (rotations.length !== times.length * 4) {
    throw new TumbleError(`${what("")}${rotations.length / 4} rotations at ${times.length} times`);
  }
  const shares = before !== null && before.length === times.length && before.every((time, i) => time === times[i]);
  const header = { name: String(track.name ?? ""), keys: times.length, sharesTimes: shares };
  const parts = shares ? [rotations] : [times, rotations];
  const sampler = track.interpolation ?? null;
  if (track.tangents !== undefined) {
    const tangents = numbers(track.tangents, Float32Array, 8, what("tangents"));
    if (tangents.length !== times.length * 8) throw new TumbleError(`${what("tangents")}: two quaternions a key are expected`);
    header.tangents = true;
    parts.push(tangents);
  }
  for (const [name, tangentsName] of [["translations", "translationTangents"], ["scales", "scaleTangents"]]) {
    const vectors = track[name];
    if (vectors === undefined) continue;
    const at = numbers(vectors.times, Float64Array, 1, what(`times of ${name}`));
    const values = numbers(vectors.values, Float32Array, 3, what(name));
    if (values.length !== at.length * 3) {
      throw new TumbleError(`${what("")}${values.length / 3} ${name} at ${at.length} times`);
    }
    header[name] = at.length;
    parts.push(at, values);
    if (vectors.tangents !== undefined) {
      const tangents = numbers(vectors.tangents, Float32Array, 6, what(`tangents of ${name}`));
      if (tangents.length !== at.length * 6) throw new TumbleError(`${what(`tangents of ${name}`)}: two vectors a key are expected`);
      header[tangentsName] = true;
      parts.push(tangents);
    }
  }
  if (sampler !== null) {
    header.rotationSampler = sampler;
    if (track.translations) header.translationSampler = sampler;
    if (track.scales) header.scaleSampler = sampler;
  }
  header.parent = track.parent ?? null;
  const { translation = [0, 0, 0], rotation = [0, 0, 0, 1], scale = [1, 1, 1], ...rest } = track.rest ?? {};
  if (Object.keys(rest).length > 0) throw new TumbleError(`${what("rest")} has no \`${Object.keys(rest)[0]}\``);
  const pose = numbers([...translation, ...rotation, ...scale], Float32Array, 10, what("rest"));
  header.rest = true;
  parts.push(pose);
  return { header, parts, times };
}

/** Tracks as bytes in the form of formats/src/motion/packed.rs. */
function packed(tracks, { name = null, isWorld = false } = {}) {
  if (!Array.isArray(tracks)) throw new TumbleError("tracks are no array");
  let before = null;
  const made = tracks.map((track, index) => {
    const packed = packedTrack(track, index, before);
    before = packed.times;
    return packed;
  });
  const isSkeleton = tracks.some((track) => track.parent !== undefined || track.rest !== undefined || track.translations !== undefined);
  const hasChannels = tracks.some((track) => track.interpolation !== undefined);
  for (const packed of made) {
    if (isSkeleton) continue;
    packed.header.rest = false;
    packed.parts.pop();
  }
  const header = { name, isWorld, hasSkeleton: isSkeleton, hasChannels, tracks: made.map((packed) => packed.header) };
  const json = text.encode(JSON.stringify(header));
  const parts = made.flatMap((packed) => packed.parts);
  const bytes = new Uint8Array(4 + json.length + parts.reduce((sum, part) => sum + part.byteLength, 0));
  new DataView(bytes.buffer).setUint32(0, json.length, true);
  bytes.set(json, 4);
  let at = 4 + json.length;
  for (const part of parts) {
    bytes.set(new Uint8Array(part.buffer, part.byteOffset, part.byteLength), at);
    at += part.byteLength;
  }
  return bytes;
}

const CURVE_OPTIONS = ["method", "ends", "signs", "speed", "before", "after", "tension", "continuity", "bias"];
const OPTIONS = [...CURVE_OPTIONS, "layout", "axes"];

/** The header of a call for a quantity; throws if an option is not in the list `known`. */
function headerOf(quantity, options, known) {
  const header = { quantity };
  for (const [name, value] of Object.entries(options)) {
    // `path` is the name that `signs` had before.
    if (!known.includes(name) && name !== "path") throw new TumbleError(`there is no option \`${name}\`; there are ${known.join(", ")}`);
    // Numbers are passed as text, because readers of JSON may round their last digit.
    if (value !== undefined) header[name] = typeof value === "number" ? String(value) : value;
  }
  return header;
}

/** A clip: tracks with their keys, stored in the module's memory. */
export class Clip {
  #module;
  #handle;

  /** Internal: `Tumble.clip`, `Tumble.read` and `Tumble.unpack` create clips. */
  constructor(module, found) {
    this.#module = module;
    this.#handle = { module, call: "free", header: { clip: found.clip }, isFreed: false };
    this.name = found.name;
    this.names = found.names;
    this.parents = found.parents;
    this.isWorld = found.isWorld;
    this.start = found.span ? found.span[0] : 0;
    this.end = found.span ? found.span[1] : 0;
    this.keyCount = found.keys;
    this.rate = found.rate;
    forgotten?.register(this, this.#handle, this.#handle);
  }

  #call(name, header, bytes) {
    if (this.#handle.isFreed) throw new TumbleError("the clip was freed");
    return this.#module.call(name, { ...this.#handle.header, ...header }, bytes);
  }

  #sample(quantity, times, options) {
    const header = headerOf(quantity, options, OPTIONS);
    let list;
    if (isNumbers(times)) {
      list = numbers(times, Float64Array, 1, "times");
    } else if (typeof times === "number") {
      list = Float64Array.of(times);
    } else if (times !== null && typeof times === "object" && times.fps !== undefined) {
      const { fps, start = this.start, end = this.end, ...rest } = times;
      if (Object.keys(rest).length > 0) throw new TumbleError(`frames have no \`${Object.keys(rest)[0]}\`; there are fps, start, end`);
      header.rate = String(fps);
      list = numbers([start, end], Float64Array, 1, "start and end");
    } else {
      throw new TumbleError("times are a number, an array of seconds, or frames: {fps, start, end}");
    }
    return this.#call("sample", header, new Uint8Array(list.buffer, list.byteOffset, list.byteLength));
  }

  /** Rotations x y z w; translations and scales x y z, or null if no track has any. */
  sample(times, options = {}) {
    const found = this.#sample("pose", times, options);
    return { translations: null, scales: null, ...found };
  }

  /** Angular velocities, rad/s: x y z. */
  velocities(times, options = {}) {
    return this.#sample("velocities", times, options);
  }

  /** Angular accelerations, rad/s²: x y z. */
  accelerations(times, options = {}) {
    return this.#sample("accelerations", times, options);
  }

  /** Positions and rotations of all joints in the world. */
  world(times, options = {}) {
    return this.#sample("world", times, options);
  }

  /** A matrix for each joint, from its axes to the world: 16 numbers, column-major. */
  matrices(times, options = {}) {
    return this.#sample("matrices", times, options);
  }

  /** A sampler: rotations at one time after another, such as the frames of a game. */
  sampler(options = {}) {
    return new Sampler(this.#module, this.#call("sampler", headerOf("pose", options, CURVE_OPTIONS)));
  }

  /** The keys of a track. */
  keys(track) {
    const found = this.#call("keys", { track });
    return { translationTimes: null, translations: null, scaleTimes: null, scales: null, ...found };
  }

  /** Frees the clip's memory. The clip cannot be used afterwards. */
  free() {
    free(this.#handle);
  }
}

/** Evaluates a clip's rotations at one time after another. */
export class Sampler {
  #module;
  #handle;

  /** Internal: `Clip.sampler` creates samplers. */
  constructor(module, { sampler, tracks }) {
    this.#module = module;
    this.#handle = { module, call: "freeSampler", header: { sampler }, isFreed: false };
    this.tracks = tracks;
    forgotten?.register(this, this.#handle, this.#handle);
  }

  #rotations(track, time, out, length) {
    if (this.#handle.isFreed) throw new TumbleError("the sampler was freed");
    if (typeof time !== "number") throw new TumbleError(`a time is a number of seconds, not ${String(time)}`);
    const isArray = out instanceof Float32Array;
    if (!isArray || out.length !== length) {
      throw new TumbleError(`out is a Float32Array of ${length} numbers, not ${isArray ? `of ${out.length}` : typeof out}`);
    }
    return this.#module.pose(this.#handle.header.sampler, track, time, out);
  }

  /** The rotations x y z w of all tracks at a time [s]. */
  pose(time, out = new Float32Array(4 * this.tracks)) {
    return this.#rotations(EVERY_TRACK, time, out, 4 * this.tracks);
  }

  /** The rotation x y z w of a track at a time [s]. */
  sample(track, time, out = new Float32Array(4)) {
    if (!Number.isInteger(track) || track < 0 || track >= this.tracks) {
      throw new TumbleError(`there is no track ${String(track)} of ${this.tracks}; they count from 0`);
    }
    return this.#rotations(track, time, out, 4);
  }

  /** Frees the sampler's memory. The sampler cannot be used afterwards. */
  free() {
    free(this.#handle);
  }
}

function free(handle) {
  if (handle.isFreed) return;
  forgotten?.unregister(handle);
  release(handle);
}

function release(handle) {
  handle.isFreed = true;
  if (!handle.module.broken) handle.module.call(handle.call, handle.header);
}

// Frees clips and samplers that are garbage-collected without a call of free(); their memory is in the module.
const forgotten = globalThis.FinalizationRegistry && new FinalizationRegistry(release);

/** The engine in this page, worker or process. */
export class Tumble {
  #module;

  /** Internal: `load` creates it. */
  constructor(instance) {
    this.#module = new Module(instance);
    const { version, methods, formats } = this.#module.call("about", {});
    this.version = version;
    this.methods = methods;
    this.formats = formats;
  }

  /** A clip from arrays of times and keys. */
  clip(tracks, options) {
    return this.unpack(packed(tracks, options));
  }

  /** A clip from bytes in the packed form that pages of `tumble view` contain. */
  unpack(bytes) {
    return new Clip(this.#module, this.#module.call("unpack", {}, bytesOf(bytes)));
  }

  /** Reads the clips of a file from its bytes. `name`: for messages, and to recognise the format by its extension. */
  read(bytes, { name = "file", sourceRate } = {}) {
    const header = { name, sourceRate: sourceRate === undefined ? null : String(sourceRate) };
    const { clips, warnings, refused } = this.#module.call("read", header, bytesOf(bytes));
    return { clips: clips.map((found) => new Clip(this.#module, found)), warnings, refused };
  }
}

function bytesOf(value) {
  if (ArrayBuffer.isView(value)) return new Uint8Array(value.buffer, value.byteOffset, value.byteLength);
  if (value instanceof ArrayBuffer) return new Uint8Array(value);
  throw new TumbleError("bytes are an ArrayBuffer, or an array of bytes such as Uint8Array");
}

/** The poses of a clip at times: `clip.sample(times, options)`. */
export function sample(clip, times, options) {
  return clip.sample(times, options);
}

/** Starts the engine from the module's bytes or from a compiled WebAssembly.Module. */
export async function loadFrom(module) {
  const isCompiled = module instanceof WebAssembly.Module;
  const compiled = isCompiled ? module : await WebAssembly.compile(bytesOf(module));
  return new Tumble(await WebAssembly.instantiate(compiled, imports(compiled)));
}

/** Imports for the module. A library in it imports random numbers (to encrypt archives), but never calls them; each import throws. */
function imports(compiled) {
  const found = {};
  for (const { module, name } of WebAssembly.Module.imports(compiled)) {
    found[module] ??= {};
    found[module][name] = () => {
      throw new Error(`${name} was called`);
    };
  }
  return found;
}
