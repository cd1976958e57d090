// Wrong arguments are refused in words, and the engine goes on.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { TumbleError, load } from "../package/node.js";
import { FILES, root } from "./support.js";

const engine = await load();
const half = Math.SQRT1_2;
const door = { name: "door", times: [0, 1], rotations: [0, 0, 0, 1, 0, 0, half, half] };

const refused = (call, words) =>
  assert.throws(call, (error) => error instanceof TumbleError && error.message.includes(words), `\`${words}\` is said`);

test("arrays that are no tracks", () => {
  refused(() => engine.clip([{ ...door, times: [1, 0] }]), "track 0");
  refused(() => engine.clip([{ ...door, times: [0, 1, 2] }]), "2 rotations at 3 times");
  refused(() => engine.clip([{ ...door, times: [0, NaN] }]), "track 0");
  refused(() => engine.clip([{ ...door, times: [0, "1"] }]), "number 1 is 1, no number");
  refused(() => engine.clip([{ ...door, rotations: [0, 0, 0, 1, 0, 0, 0, 0] }]), "track 0");
  refused(() => engine.clip([{ ...door, rotations: [1, 2, 3] }]), "no whole number of 4");
  refused(() => engine.clip([{ ...door, rotation: [1] }]), "there is no `rotation`");
  refused(() => engine.clip([{ ...door, interpolation: "spline" }]), "spline");
  refused(() => engine.clip({}), "no array");
  refused(() => engine.unpack("abc"), "bytes are");
});

test("times and options that mean nothing", () => {
  const clip = engine.clip([door]);
  refused(() => clip.sample([0], { method: "slurp" }), "there is no method `slurp`; there are authored, ");
  refused(() => clip.sample([0], { methd: "slerp" }), "there is no option `methd`");
  refused(() => clip.sample([0], { ends: "open" }), "there is no kind of ends `open`; there are parabolic, ");
  refused(() => clip.sample([0, Infinity]), "time 1 is inf");
  refused(() => clip.sample({ fps: 0 }), "`0` is not a frame rate");
  refused(() => clip.sample({ fps: 25, end: -1 }), "before it starts");
  refused(() => clip.sample({ fps: 25, stop: 1 }), "frames have no `stop`");
  refused(() => clip.sample("now"), "times are");
  refused(() => clip.sample([0], { method: "kochanek-bartels", tension: NaN }), "tension");
  refused(() => clip.sample({ fps: 1e9, start: 0, end: 1e6 }), "frames");
  refused(() => clip.sample({ fps: 1e6, start: 0, end: 1e2 }), "more memory than there is");
  refused(() => clip.keys(1), "there is no track 1 of 1");
  refused(() => clip.world([0], { axes: "wrold" }), "there is no kind of axes `wrold`; there are body, parent");
  const { rotations } = clip.sample(0.5);
  assert.ok(Math.abs(rotations[2] - Math.sin(Math.PI / 8)) < 1e-6, "the engine goes on");
  const sampler = clip.sampler({ method: "slerp" });
  refused(() => clip.sampler({ layout: "frame" }), "there is no option `layout`");
  refused(() => sampler.pose(NaN), "NaN");
  refused(() => sampler.pose("0"), "a time is a number of seconds, not 0");
  refused(() => sampler.pose(0, new Float32Array(3)), "out is a Float32Array of 4 numbers, not of 3");
  refused(() => sampler.sample(1, 0), "there is no track 1 of 1");
  clip.free();
  clip.free();
  refused(() => clip.sample(0), "the clip was freed");
  assert.ok(Math.abs(sampler.pose(0.5)[2] - Math.sin(Math.PI / 8)) < 1e-6, "it outlives its clip");
  sampler.free();
  refused(() => sampler.pose(0), "the sampler was freed");
});

test("files that are broken have the program's code", () => {
  const bad = join(root, "formats/tests/fixtures/glb/bin_missing.glb");
  assert.throws(
    () => engine.read(readFileSync(bad), { name: "bad.glb" }),
    (error) => error instanceof TumbleError && /^E\d+$/.test(error.code) && error.message.startsWith("bad.glb:"),
  );
  const beside = readFileSync(join(root, "formats/tests/fixtures/glb/cubic.gltf"), "utf8");
  const named = beside.replace(/"data:[^"]*"/, '"beside.bin"');
  refused(() => engine.read(new TextEncoder().encode(named)), "is a file of its own");
});

test("no bytes stop the engine", () => {
  // A step of a linear congruential generator: the same bytes in every run.
  let state = 1;
  const random = (below) => ((state = (Math.imul(state, 1664525) + 1013904223) >>> 0) >>> 8) % below;
  let [refusals, reads] = [0, 0];
  for (const file of FILES) {
    const whole = readFileSync(join(root, file));
    for (let round = 0; round < 300; round++) {
      const bytes = Uint8Array.from(whole.subarray(0, random(4) === 0 ? random(whole.length) : whole.length));
      // Many files stay valid if only digits are replaced by digits.
      for (let change = random(6); change > 0 && bytes.length > 0; change--) {
        const at = random(bytes.length);
        bytes[at] = bytes[at] >= 48 && bytes[at] < 58 ? 48 + random(10) : random(256);
      }
      for (const call of [() => engine.read(bytes, { name: file }).clips.forEach((clip) => clip.free()), () => engine.unpack(bytes).free()]) {
        try {
          call();
          reads += 1;
        } catch (error) {
          assert.ok(error instanceof TumbleError, String(error));
          assert.ok(!error.message.includes("the engine stopped"), error.message);
          refusals += 1;
        }
      }
    }
  }
  assert.ok(refusals > 300 && reads > 10, `${refusals} refused, ${reads} read`);
});

test("clips that are freed leave room for others", () => {
  const first = engine.clip([door]);
  const times = Float64Array.from({ length: 20_000 }, (_, i) => i / 10);
  const many = () => engine.clip([{ times, rotations: Float32Array.from({ length: 80_000 }, (_, i) => (i % 4 === 3 ? 1 : 0)) }]);
  for (let round = 0; round < 300; round++) many().free();
  assert.equal(first.sample([0]).samples, 1);
});
