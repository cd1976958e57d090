// The bits of the package are those of the program.

import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { load, sample } from "../package/node.js";
import { FILES, differs, folder, npy, root, tumble } from "./support.js";

const engine = await load();
const place = folder();
const TIMES = [0.5, -1, 0.123456789, 1e3, 1 / 3, 0.75, 2.5, 0.5];
writeFileSync(join(place, "times.txt"), TIMES.join("\n"));

const read = (file) => engine.read(readFileSync(join(root, file)), { name: file }).clips[0];

/** Rotations by the program, all samples of the first track first. */
function evaluated(file, ...options) {
  tumble(place, "eval", join(root, file), "--device", "cpu", "-o", "out.npy", "--overwrite", ...options);
  return npy(join(place, "out.npy"));
}

test("every method gives the program's bits at frames and at times", () => {
  let compared = 0;
  assert.ok(engine.methods.length >= 15);
  for (const file of FILES) {
    const clip = read(file);
    for (const method of ["authored", ...engine.methods.map(({ name }) => name)]) {
      for (const [times, ...options] of [
        [{ fps: "30000/1001" }, "--fps", "30000/1001"],
        [TIMES, "--times", "times.txt"],
      ]) {
        const right = evaluated(file, "-m", method, ...options);
        const found = sample(clip, times, { method });
        assert.deepEqual([found.tracks, found.samples, 4], right.shape, `${file} ${method}`);
        assert.equal(differs(found.rotations, right.numbers), -1, `${file}, ${method}, ${options.join(" ")}`);
        compared += found.rotations.length / 4;
      }
    }
    clip.free();
  }
  console.log(`${compared} rotations compared with the program's`);
  assert.ok(compared > 10_000);
});

test("options mean what they mean to the program", () => {
  const clip = read("data/pendulum-random.dat");
  const frames = { fps: 24, start: -2, end: 30 };
  for (const [options, ...line] of [
    [{ ends: "natural" }, "--ends", "natural"],
    [{ ends: "clamped", after: "extrapolate" }, "--ends", "clamped", "--after", "extrapolate"],
    [{ before: "loop", after: "mirror" }, "--before", "loop", "--after", "mirror"],
    [{ signs: "as-authored" }, "--signs", "as-authored"],
    [{ speed: "constant" }, "--speed", "constant"],
    [{ method: "kochanek-bartels", tension: 0.1, continuity: 0.3, bias: -0.7 }, "--tension", "0.1", "--continuity", "0.3", "--bias", "-0.7"],
    [{ layout: "frame" }, "--layout", "frame"],
  ]) {
    const method = options.method ?? "catmull-rom";
    const range = ["--fps", "24", "--start", "-2", "--end", "30", "-m", method];
    const right = evaluated("data/pendulum-random.dat", ...range, ...line);
    const found = clip.sample(frames, { method, ...options });
    assert.equal(differs(found.rotations, right.numbers), -1, line.join(" "));
    assert.equal(found.times.length, found.samples);
    assert.equal(found.times[24], -1);
  }
});

test("samplers give the bits of samples, and fill what they are given", () => {
  const clip = read("data/pendulum-random.dat");
  const sampler = clip.sampler({ method: "c2", after: "loop" });
  const found = clip.sample(TIMES, { method: "c2", after: "loop", layout: "frame" });
  clip.free();
  const out = new Float32Array(4 * sampler.tracks);
  TIMES.forEach((time, i) => {
    assert.equal(sampler.pose(time, out), out);
    for (let track = 0; track < sampler.tracks; track++) {
      const at = 4 * track;
      const expected = found.rotations.subarray(4 * i * sampler.tracks + at, 4 * i * sampler.tracks + at + 4);
      const rotation = out.subarray(at, at + 4);
      // The sign of each sample continues from the sample before.
      const sign = expected.some((number, c) => number * rotation[c] < 0) ? -1 : 1;
      assert.deepEqual([...rotation], [...expected].map((number) => number * sign || 0));
      assert.deepEqual(sampler.sample(track, time), rotation.slice());
    }
  });
  sampler.free();
});

test("velocities, accelerations and places in the world are the program's", () => {
  const file = "formats/tests/fixtures/bvh/good.bvh";
  const clip = read(file);
  for (const [found, output] of [
    [clip.velocities(TIMES, { method: "c2" }).values, "velocity"],
    [clip.accelerations(TIMES, { method: "c2", axes: "parent" }).values, "acceleration"],
  ]) {
    const axes = output === "acceleration" ? ["--axes", "parent"] : [];
    const right = evaluated(file, "-m", "c2", "--times", "times.txt", "--quantity", output, ...axes);
    assert.equal(differs(found, right.numbers), -1, output);
  }
  const right = evaluated(file, "-m", "c2", "--times", "times.txt", "--quantity", "world");
  const world = clip.world(TIMES, { method: "c2", layout: "frame" });
  const joints = world.tracks;
  assert.deepEqual(right.shape, [TIMES.length, joints, 7]);
  const matrices = clip.matrices(TIMES, { method: "c2", layout: "frame" }).matrices;
  for (let i = 0; i < TIMES.length * joints; i++) {
    const seven = right.numbers.subarray(7 * i, 7 * i + 7);
    const at = Float32Array.from(world.positions.subarray(3 * i, 3 * i + 3));
    assert.deepEqual([...at, ...world.rotations.subarray(4 * i, 4 * i + 4)], [...seven]);
    assert.deepEqual([...matrices.subarray(16 * i + 12, 16 * i + 15)], [...at]);
  }
});

test("arrays make the clip that a file makes", () => {
  for (const file of ["data/pendulum-random.dat", "formats/tests/fixtures/bvh/good.bvh"]) {
    const clip = read(file);
    const tracks = clip.names.map((name, track) => {
      const keys = clip.keys(track);
      const translations = keys.translations && { times: keys.translationTimes, values: keys.translations };
      return {
        name,
        times: keys.times,
        rotations: keys.rotations,
        ...(translations ? { translations } : {}),
        ...(clip.parents[track] === null ? {} : { parent: clip.parents[track] }),
      };
    });
    const same = engine.clip(tracks, { name: "same" });
    assert.deepEqual([same.name, same.names, same.start, same.end], ["same", clip.names, clip.start, clip.end]);
    assert.deepEqual(same.parents, clip.parents);
    for (const method of ["slerp", "c2"]) {
      const [one, other] = [clip, same].map((each) => each.sample({ fps: 60 }, { method }));
      assert.equal(differs(one.rotations, other.rotations), -1, `${file} ${method}`);
      if (one.translations && clip.parents[0] === null) {
        const first = (pose) => pose.translations.slice(0, 3 * pose.samples);
        assert.equal(differs(first(one), first(other)), -1);
      }
    }
  }
});
